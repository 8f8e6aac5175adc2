//! The link commands of a board.

use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, Phase, Request as Wanted};
use controller::waves::{self, Wave};
use controller::{CONFIG_WORDS, Config, PLACE_WORDS, Real, passes, place_words};
use heapless::Vec;
use specgen_link::lockstep::Session;
use specgen_link::samples::Block;
use specgen_link::{
    Bytes, CostUnit, Device, EdgeStatus, Health, KNOT, KNOTS, PassAction, PassStatus, RecorderAction, RecorderStatus,
    Refusal, Reply, Request, Status, put_knots,
};
use specgen_runtime::learning::Settings as Plan;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::Settings;

use crate::catch_up::catch_up;
use crate::download::{self, Download};
use crate::exchange::{Access, Exchange};
use crate::gather::with_rows;
use crate::recording;
use crate::report::{Probes, Report, Stopwatch};
use crate::requests::{Backend, Command, execute, pass_status, wave_refusal};
use crate::source::EdgeCommand;
#[cfg(feature = "lockstep")]
use crate::stepper::{Costs, Stepper};
use crate::words::PERIOD_NANOSECONDS;

/// Words of the longest reply: settings, the result of a step, a piece of a record or of errors.
const WORDS: usize = {
    let words = larger(larger(CONFIG_WORDS, MACHINE_OUTPUT_WORDS), larger(MACHINE_INPUT_WORDS, download::WORDS));
    if passes::POSSIBLE { larger(words, KNOTS * KNOT / size_of::<u64>()) } else { words }
};

/// Knots, of [`KNOTS`], that are copied at a time with the tick held off: an H7 takes a microsecond for it.
const KNOTS_AT_ONCE: usize = 4;

const fn larger(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// State of the link command handler, in the background. Everything else is in the [`Exchange`], which it locks only
/// for a copy.
#[derive(Debug)]
pub struct LinkHandler {
    stopwatch: Stopwatch,
    #[cfg(feature = "lockstep")]
    costs: Costs,
    session: Session<WORDS>,
    download: Download,
    /// Block of the last reply with samples.
    block: Block,
}

/// A handler while it processes bytes. `dyn`, so that there is one copy of it, compiled with this crate's options.
pub struct RequestContext<'d, 'a> {
    /// The handler.
    pub handler: &'d mut LinkHandler,
    /// The access.
    pub with: &'d mut Access<'a>,
}

impl LinkHandler {
    /// At power-up.
    #[must_use]
    pub const fn new(stopwatch: Stopwatch) -> Self {
        Self {
            stopwatch,
            #[cfg(feature = "lockstep")]
            costs: Costs::NONE,
            session: Session::new(),
            download: Download::new(),
            block: Block::EMPTY,
        }
    }
}

impl RequestContext<'_, '_> {
    /// Result of `action`, with the tick held off meanwhile.
    fn locked<R>(&mut self, initial: R, mut action: impl FnMut(&mut Exchange, &mut Machine) -> R) -> R {
        let mut result = initial;
        (self.with)(&mut |exchange, machine| result = action(exchange, machine));
        result
    }

    /// Changes the command of the ticks, unless the host steps the machine or `change` refuses.
    fn change_command(&mut self, mut change: impl FnMut(&mut Exchange) -> bool) -> Result<(), Refusal> {
        let done = self.locked(false, |exchange, _| !exchange.in_lockstep() && change(exchange));
        if done { Ok(()) } else { Err(Refusal::State) }
    }

    fn wait_for_edge(&mut self, awaited: EdgeCommand, wave: Option<Wave>) -> Result<(), Refusal> {
        self.locked(Err(Refusal::State), |exchange, _| exchange.wait_for_edge(awaited, wave))
    }

    /// The host steps the machine: only while nothing can move.
    #[cfg(feature = "lockstep")]
    #[inline(never)]
    fn reset(&mut self, config: Bytes<'_>) -> Reply<'static> {
        let (was, may) =
            self.locked((false, false), |exchange, _| (exchange.lockstep.is_some(), exchange.enter_lockstep()));
        if !may {
            return Reply::Refused(Refusal::State);
        }
        let LinkHandler { stopwatch, costs, session, .. } = &mut *self.handler;
        let reply = session.reset(&mut Stepper { stopwatch: *stopwatch, costs, with: &mut *self.with }, config);
        if reply != Reply::Done && !was {
            // Refused settings have changed nothing.
            (self.with)(&mut |exchange, _| exchange.lockstep = None);
        }
        reply
    }

    #[cfg(feature = "lockstep")]
    #[inline(never)]
    fn step(&mut self, input: Bytes<'_>) -> Reply<'_> {
        if !self.locked(false, |exchange, _| exchange.lockstep.is_some()) {
            return Reply::Refused(Refusal::State);
        }
        let LinkHandler { stopwatch, costs, session, .. } = &mut *self.handler;
        session.step(&mut Stepper { stopwatch: *stopwatch, costs, with: &mut *self.with }, input)
    }
}

/// The player of passes, unless it is playing or learning.
fn idle_player(exchange: &mut Exchange) -> Result<&mut Player<'static, Real>, Refusal> {
    let absent = if exchange.away.is_some() { Refusal::State } else { Refusal::Unsupported };
    let player = exchange.source.player.as_mut().ok_or(absent)?;
    if player.is_busy() { Err(Refusal::State) } else { Ok(player) }
}

/// Functions with large stack frames are not inlined: only one of them is then on the stack at a time, and none while
/// the reply is written.
impl Backend for RequestContext<'_, '_> {
    const PIECE: usize = specgen_link::lockstep::PIECE;

    fn host_alive(&mut self) {
        (self.with)(&mut |exchange, _| exchange.host_alive());
    }

    fn connect(&mut self) -> CostUnit {
        self.handler.session.end();
        (self.with)(&mut |exchange, machine| {
            // A new session has no request yet.
            exchange.command.request = Wanted::None;
            exchange.leave_lockstep(machine);
            exchange.source.stop_wave();
            exchange.abort_pass();
            let _ = exchange.watch(0);
        });
        self.handler.stopwatch.counted
    }

    fn status(&mut self) -> Status {
        self.locked(Report::NONE, |exchange, _| exchange.report).status()
    }

    fn health(&mut self) -> Health {
        let (counts, probes) = self.locked((Report::NONE.health, Probes::NONE), |exchange, _| {
            let counts = exchange.report.health;
            // A lost reply is sent again unchanged.
            exchange.report.health.events = 0;
            (counts, exchange.probes)
        });
        counts.health(&probes)
    }

    fn place(&mut self) -> (Status, Option<u64>, [u64; PLACE_WORDS]) {
        let (mut report, mut words) = (Report::NONE, [0; PLACE_WORDS]);
        (self.with)(&mut |exchange, machine| (report, words) = (exchange.report, place_words(&machine.state)));
        let since = |tick| report.tick.saturating_sub(tick).saturating_mul(u64::from(PERIOD_NANOSECONDS)) / 1000;
        (report.status(), report.measured.map(since), words)
    }

    fn buffer(&mut self) -> &mut [u8] {
        self.handler.session.buffer()
    }

    fn supervise(&mut self, request: Wanted) -> Result<(), Refusal> {
        self.change_command(|exchange| {
            exchange.command.request = request;
            true
        })
    }

    fn command(&mut self, command: &Command) -> Result<(), Refusal> {
        self.change_command(|exchange| {
            // A command from before the run must not take effect later.
            let free = !exchange.source.is_engaged() && exchange.report.phase.is_commanded();
            if free {
                exchange.source.cancel_awaited();
                exchange.command.command = *command;
            }
            free
        })
    }

    fn command_on_edge(&mut self, command: &Command) -> Result<(), Refusal> {
        self.wait_for_edge(EdgeCommand::Command(*command), None)
    }

    fn edge(&mut self, drop: bool) -> Result<EdgeStatus, Refusal> {
        self.locked(Err(Refusal::Unsupported), |exchange, _| {
            if drop {
                exchange.source.cancel_awaited();
            }
            Ok(exchange.source.edge())
        })
    }

    fn settings(&mut self) -> [u64; CONFIG_WORDS] {
        let config = self.locked(None, |exchange, _| Some(*exchange.settings()));
        config.map_or([0; CONFIG_WORDS], |config| config.to_words())
    }

    fn configure(&mut self, config: Config) {
        (self.with)(&mut |exchange, _| exchange.configure(config));
    }

    fn recorder(&mut self, action: RecorderAction) -> Result<RecorderStatus, Refusal> {
        self.locked(Err(Refusal::Unsupported), |exchange, _| {
            let recorder = exchange.recorder.as_mut().ok_or(Refusal::Unsupported)?;
            Ok(recording::act(recorder, action))
        })
    }

    #[inline(never)]
    fn download(&mut self, offset: u32) -> Result<Reply<'_>, Refusal> {
        let with = &mut *self.with;
        // What it stopped with.
        catch_up(with, || false);
        let mut refusal = Refusal::Unsupported;
        let LinkHandler { download, session, .. } = &mut *self.handler;
        let found = download.read(offset, session.buffer(), |action: &mut dyn FnMut(&_)| {
            let mut stands = false;
            with(&mut |exchange, _| {
                if let Some(recorder) = &exchange.recorder {
                    refusal = Refusal::State;
                    stands = recording::is_stopped(recorder);
                    if stands {
                        action(recorder);
                    }
                }
            });
            stands
        });
        let (total, bytes) = found.ok_or(refusal)?;
        Ok(Reply::Chunk { offset, total, bytes: Bytes(bytes) })
    }

    /// Checks a wave while ticks go on, then passes it to them, if the machine follows commands and no wave is under way.
    #[inline(never)]
    fn start_wave(&mut self, settings: &Settings<Real>, on_edge: bool) -> Result<(), Refusal> {
        let (drives, limits) = self
            .locked(None, |exchange, _| {
                let drives = exchange.report.phase == Phase::Driving;
                let limits = if drives { waves::drive_limits } else { waves::limits };
                Some((drives, limits(exchange.settings())))
            })
            .ok_or(Refusal::State)?;
        let mut wave = Wave::new(limits).of_drive(drives);
        wave.set(settings).map_err(wave_refusal)?;
        if on_edge {
            return self.wait_for_edge(EdgeCommand::Wave, Some(wave));
        }
        wave.start();
        self.locked(Err(Refusal::State), |exchange, machine| {
            let (status, command) = (exchange.report.status, &exchange.command.command);
            let is_there = match exchange.report.phase {
                Phase::Running if !drives => waves::may_begin(status, command, &settings.center, &limits).is_ok(),
                Phase::Driving if drives => waves::may_drive(&place_words(&machine.state), &settings.center, &limits),
                _ => false,
            };
            if !is_there || exchange.in_lockstep() || exchange.source.is_engaged() {
                return Err(Refusal::State);
            }
            exchange.source.cancel_awaited();
            exchange.source.wave = Some(wave);
            Ok(())
        })
    }

    fn stop_wave(&mut self) -> Result<(), Refusal> {
        self.change_command(|exchange| {
            exchange.source.stop_wave();
            true
        })
    }

    fn put_knots(&mut self, first: u32, knots: &[Knot]) -> Result<(), Refusal> {
        self.locked(Err(Refusal::Unsupported), |exchange, _| {
            let taken = idle_player(exchange)?.put(first as usize, knots.iter().copied());
            if taken { Ok(()) } else { Err(Refusal::Word { index: 0 }) }
        })
    }

    #[inline(never)]
    fn pass(&mut self, action: PassAction) -> Result<PassStatus, Refusal> {
        self.locked(Err(Refusal::Unsupported), |exchange, _| {
            let done = match action {
                PassAction::Look => Ok(()),
                PassAction::Begin { spacing, before, ticks, trajectory } => {
                    exchange.begin_pass(Course { spacing, before, ticks, trajectory })
                }
                PassAction::Abort => {
                    exchange.abort_pass();
                    Ok(())
                }
                PassAction::Learn { reach, fade } => {
                    let learns = |player: &mut Player<'_, Real>| player.learn(Plan { reach, fade }).then_some(());
                    exchange.source.player.as_mut().and_then(learns).ok_or(Refusal::State)
                }
            };
            let status = exchange.away.or_else(|| exchange.source.player.as_ref().map(pass_status));
            status.map_or(Err(Refusal::Unsupported), |status| done.map(|()| status))
        })
    }

    #[inline(never)]
    fn knots(
        &mut self,
        offset: u32,
        knots: impl for<'p> Fn(&'p Player<'static, Real>) -> &'p [Knot],
    ) -> Result<Reply<'_>, Refusal> {
        let (mut taken, mut total) = (Vec::<Knot, KNOTS>::new(), 0);
        let first = offset as usize / KNOT;
        for _ in 0..KNOTS / KNOTS_AT_ONCE {
            let before = taken.len();
            self.locked(Err(Refusal::Unsupported), |exchange, _| {
                let knots = knots(idle_player(exchange)?);
                total = knots.len() * KNOT;
                for knot in knots.iter().skip(first + before).take(KNOTS_AT_ONCE) {
                    // There is room for each of them.
                    let _ = taken.push(*knot);
                }
                Ok(())
            })?;
            if taken.len() < before + KNOTS_AT_ONCE {
                break;
            }
        }
        let bytes = Bytes(put_knots(&taken, offset as usize - first * KNOT, self.handler.session.buffer()));
        Ok(Reply::Chunk { offset, total: total as u32, bytes })
    }

    fn stream(&mut self, every: u32) -> Result<(), Refusal> {
        self.locked(Ok(()), |exchange, _| exchange.watch(every))
    }

    #[inline(never)]
    fn samples(&mut self) -> Reply<'_> {
        let (block, mut more) = (&mut self.handler.block, false);
        *block = Block::EMPTY;
        with_rows(&mut *self.with, |rows| {
            more = rows.waiting() > 1;
            if let Some(oldest) = rows.take() {
                *block = *oldest;
            }
        });
        block.reply(more)
    }

    fn other(&mut self, request: &Request<'_>) -> Reply<'_> {
        match *request {
            #[cfg(feature = "lockstep")]
            Request::LockstepReset { config } => self.reset(config),
            #[cfg(feature = "lockstep")]
            Request::LockstepStep { input } => self.step(input),
            #[cfg(feature = "lockstep")]
            Request::LockstepStage { index: 0 } if self.handler.stopwatch.counted != CostUnit::Nothing => {
                Reply::Stage(self.handler.costs.stage())
            }
            _ => Reply::Refused(Refusal::Unsupported),
        }
    }
}

impl Device for RequestContext<'_, '_> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        execute(self, request)
    }
}
