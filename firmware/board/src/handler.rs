//! The link commands of a board.

use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Phase, Request as Wanted};
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, CONFIG_WORDS, DESCRIPTION, PLACE_WORDS, Real, passes, place_words, triggers};
use specgen_link::lockstep::{Session, piece};
use specgen_link::samples::Block;
use specgen_link::{
    Bytes, CostUnit, Counters, Device, EdgeStatus, Identity, KNOT, KNOTS, PassAction, PassStatus, RecorderAction,
    Refusal, Reply, Request, Status, WaveAction, put_knots,
};
use specgen_runtime::learning::Settings as Plan;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::{self, Settings};

use crate::catch_up::catch_up;
use crate::download::{self, Download};
use crate::exchange::{Access, EdgeCommand, Exchange};
use crate::gather::with_rows;
use crate::recording;
use crate::report::{Probes, Report};
use crate::samples;
use crate::stepper::{Costs, Stepper, Stopwatch};
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
        Self { stopwatch, costs: Costs::NONE, session: Session::new(), download: Download::new(), block: Block::EMPTY }
    }
}

/// Functions with large stack frames are not inlined: only one of them is then on the stack at a time, and none while
/// the reply is written.
impl RequestContext<'_, '_> {
    fn identity(&mut self) -> Identity {
        self.handler.session.end();
        (self.with)(&mut |exchange, machine| {
            // A new session has no request yet.
            exchange.orders.request = Wanted::None;
            exchange.leave_lockstep(machine);
            exchange.cancel_awaited();
            if let Some(wave) = &mut exchange.wave {
                wave.stop();
            }
            exchange.abort_pass();
            let _ = exchange.watch(0);
        });
        Identity {
            config_words: CONFIG_WORDS as u16,
            input_words: MACHINE_INPUT_WORDS as u16,
            output_words: MACHINE_OUTPUT_WORDS as u16,
            stages: u8::from(self.handler.stopwatch.counted != CostUnit::Nothing),
            counted: self.handler.stopwatch.counted,
            description: DESCRIPTION.len() as u32,
        }
    }

    fn status(&mut self) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            let report = &exchange.report;
            reply = Reply::Status(Status {
                tick: report.tick,
                phase: report.phase.word() as u8,
                cause: report.cause.word() as u8,
                finding: report.finding,
                amplifier_on: report.amplifier_on,
                status: report.status,
                events: report.health.events,
                late: report.missed,
                // A board whose ticks stop is reset by its watchdog.
                age: if report.tick > 0 { Some(0) } else { None },
                // The endpoint fills it in.
                link: Counters::NONE,
            });
        });
        reply
    }

    fn health(&mut self) -> Reply<'static> {
        let (mut counts, mut probes) = (Report::NONE.health, Probes::NONE);
        (self.with)(&mut |exchange, _| {
            (counts, probes) = (exchange.report.health, exchange.probes);
            // A lost reply is sent again unchanged.
            exchange.report.health.events = 0;
        });
        Reply::Health(counts.health(&probes))
    }

    #[inline(never)]
    fn place(&mut self) -> Reply<'_> {
        let mut words = [0; PLACE_WORDS];
        let (mut tick, mut phase, mut status, mut measured) = (0, Phase::Disarmed, 0, None);
        (self.with)(&mut |exchange, machine| {
            let report = &exchange.report;
            (tick, phase, status, measured) = (report.tick, report.phase, report.status, report.measured);
            words = place_words(&machine.state);
        });
        let since = |measured: u64| tick.saturating_sub(measured).saturating_mul(u64::from(PERIOD_NANOSECONDS)) / 1000;
        match self.handler.session.answer(&words) {
            Some(words) if PLACE_WORDS > 0 => {
                Reply::Place { tick, phase: phase.word() as u8, status, measured: measured.map(since), words }
            }
            _ => Reply::Refused(Refusal::Unsupported),
        }
    }

    /// Changes the command of the ticks, unless the host steps the machine or `order` refuses.
    fn order(&mut self, mut order: impl FnMut(&mut Exchange) -> bool) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            if !exchange.in_lockstep() && order(exchange) {
                reply = Reply::Done;
            }
        });
        reply
    }

    fn supervise(&mut self, request: u8) -> Reply<'static> {
        let wanted = Wanted::from_word(u64::from(request));
        if wanted.word() != u64::from(request) {
            return Reply::Refused(Refusal::Word { index: 0 });
        }
        self.order(|exchange| {
            exchange.orders.request = wanted;
            true
        })
    }

    #[inline(never)]
    fn command(&mut self, words: Bytes<'_>, on_edge: bool) -> Reply<'static> {
        let mut command = [0; COMMAND_WORDS];
        if !words.read_words(&mut command) {
            return Reply::Refused(Refusal::Length { expected: COMMAND_WORDS as u16 });
        }
        if on_edge {
            return self.wait_for_edge(EdgeCommand::Command(command), None);
        }
        self.order(|exchange| {
            // A command from before the run must not take effect later.
            let free = !exchange.is_engaged() && exchange.report.phase == Phase::Running;
            if free {
                exchange.cancel_awaited();
                exchange.orders.command = command;
            }
            free
        })
    }

    fn wait_for_edge(&mut self, awaited: EdgeCommand, wave: Option<Wave>) -> Reply<'static> {
        let mut done = Ok(());
        (self.with)(&mut |exchange, _| done = exchange.wait_for_edge(awaited, wave));
        done.map_or_else(Reply::Refused, |()| Reply::Done)
    }

    fn edge(&mut self, drop: bool) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::Unsupported);
        (self.with)(&mut |exchange, _| {
            if drop {
                exchange.cancel_awaited();
            }
            let pending = &exchange.pending;
            let (stage, edges, tick) = (pending.stage().word() as u8, pending.edges(), pending.tick());
            reply = Reply::Edge(EdgeStatus { stage, edges, tick });
        });
        reply
    }

    #[inline(never)]
    fn config(&mut self) -> Reply<'_> {
        let mut config = None;
        (self.with)(&mut |exchange, _| config = Some(*exchange.settings()));
        let words = config.map(|config| config.to_words()).unwrap_or([0; CONFIG_WORDS]);
        match self.handler.session.answer(&words) {
            Some(words) => Reply::Config { words },
            None => Reply::Refused(Refusal::TooLong),
        }
    }

    fn recorder(&mut self, action: RecorderAction) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::Unsupported);
        (self.with)(&mut |exchange, _| {
            if let Some(recorder) = &mut exchange.recorder {
                reply = Reply::Recorder(recording::act(recorder, action));
            }
        });
        reply
    }

    #[inline(never)]
    fn download(&mut self, offset: u32) -> Reply<'_> {
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
        match found {
            Some((total, bytes)) => Reply::Chunk { offset, total, bytes: Bytes(bytes) },
            None => Reply::Refused(refusal),
        }
    }

    fn wave(&mut self, action: WaveAction, words: Bytes<'_>) -> Reply<'static> {
        match action {
            WaveAction::Start => self.start_wave(words, false),
            WaveAction::StartOnEdge => self.start_wave(words, true),
            WaveAction::Stop => self.order(|exchange| {
                exchange.cancel_awaited();
                if let Some(wave) = &mut exchange.wave {
                    wave.stop();
                }
                true
            }),
        }
    }

    /// Checks a wave while ticks go on, then passes it to them.
    #[inline(never)]
    fn start_wave(&mut self, bytes: Bytes<'_>, on_edge: bool) -> Reply<'static> {
        let mut limits = None;
        (self.with)(&mut |exchange, _| limits = Some(waves::limits(exchange.settings())));
        let Some(limits) = limits else { return Reply::Refused(Refusal::State) };
        match &settings(bytes) {
            None => Reply::Refused(Refusal::Length { expected: wave::WORDS as u16 }),
            Some(Err(refused)) => Reply::Refused(refusal(*refused)),
            Some(Ok(settings)) => self.begin_wave(limits, settings, on_edge),
        }
    }

    /// Passes a wave to the ticks, if the machine runs and no wave is under way.
    #[inline(never)]
    fn begin_wave(&mut self, limits: wave::Limits<Real>, settings: &Settings<Real>, on_edge: bool) -> Reply<'static> {
        let mut wave = Wave::new(limits);
        if let Err(refused) = wave.set(settings) {
            return Reply::Refused(refusal(refused));
        }
        if on_edge {
            return self.wait_for_edge(EdgeCommand::Wave, Some(wave));
        }
        wave.start();
        let center = settings.center;
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            let runs = exchange.report.phase == Phase::Running && !exchange.in_lockstep();
            if runs && !exchange.is_engaged() {
                let command = &exchange.orders.command;
                reply = match waves::may_begin(exchange.report.status, command, &center, &limits) {
                    Ok(()) => Reply::Done,
                    Err(_) => Reply::Refused(Refusal::State),
                };
                if reply == Reply::Done {
                    exchange.cancel_awaited();
                    exchange.wave = Some(wave);
                }
            }
        });
        reply
    }

    /// Stores knots of the correction of passes, one message at a time.
    #[inline(never)]
    fn knots(&mut self, first: u32, knots: Bytes<'_>) -> Reply<'static> {
        let Some(given) = knots.knots().filter(|given| given.len() <= KNOTS) else {
            // Not [`Refusal::Message`]: the sequence number of an unreadable message is used again.
            return Reply::Refused(Refusal::Length { expected: (KNOTS * KNOT / size_of::<u64>()) as u16 });
        };
        let (mut taken, count) = ([[0; 6]; KNOTS], given.len());
        for (slot, knot) in taken.iter_mut().zip(given) {
            *slot = knot;
        }
        let mut reply = Reply::Refused(Refusal::Unsupported);
        (self.with)(&mut |exchange, _| {
            if exchange.away.is_some() {
                reply = Reply::Refused(Refusal::State);
            }
            let Some(player) = &mut exchange.player else { return };
            reply = match player.is_busy() {
                true => Reply::Refused(Refusal::State),
                false if player.put(first as usize, taken.iter().take(count).copied()) => Reply::Done,
                false => Reply::Refused(Refusal::Word { index: 0 }),
            };
        });
        reply
    }

    #[inline(never)]
    fn pass(&mut self, action: PassAction) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::Unsupported);
        (self.with)(&mut |exchange, _| {
            let refusal = match action {
                PassAction::Look => None,
                PassAction::Begin { spacing, before, ticks, trajectory } => {
                    exchange.begin_pass(Course { spacing, before, ticks, trajectory }).err()
                }
                PassAction::Abort => {
                    exchange.abort_pass();
                    None
                }
                PassAction::Learn { reach, fade } => {
                    let player = exchange.player.as_mut();
                    let learns = player.is_some_and(|player| player.learn(Plan { reach, fade }));
                    (!learns).then_some(Refusal::State)
                }
            };
            if let Some(status) = exchange.away.or_else(|| exchange.player.as_ref().map(standing)) {
                reply = refusal.map_or(Reply::Pass(status), Reply::Refused);
            }
        });
        reply
    }

    /// Knots of the last pass's error, or of the next one's correction.
    #[inline(never)]
    fn fetched(&mut self, offset: u32, knots: impl for<'p> Fn(&'p Player<'static, Real>) -> &'p [Knot]) -> Reply<'_> {
        let (mut taken, mut count, mut total) = ([[0; 6]; KNOTS], 0, 0);
        let mut refusal = Some(Refusal::Unsupported);
        let first = offset as usize / KNOT;
        for few in taken.chunks_exact_mut(KNOTS_AT_ONCE) {
            let before = count;
            (self.with)(&mut |exchange, _| {
                if exchange.away.is_some() {
                    refusal = Some(Refusal::State);
                }
                let Some(player) = &exchange.player else { return };
                refusal = player.is_busy().then_some(Refusal::State);
                total = knots(player).len() * KNOT;
                for (slot, knot) in few.iter_mut().zip(knots(player).iter().skip(first + before)) {
                    *slot = *knot;
                    count += 1;
                }
            });
            if refusal.is_some() || count < before + KNOTS_AT_ONCE {
                break;
            }
        }
        if let Some(refusal) = refusal {
            return Reply::Refused(refusal);
        }
        let taken = taken.get(..count).unwrap_or_default();
        let bytes = Bytes(put_knots(taken, offset as usize - first * KNOT, self.handler.session.buffer()));
        Reply::Chunk { offset, total: total as u32, bytes }
    }

    fn stream(&mut self, every: u32) -> Reply<'static> {
        let mut done = Ok(());
        (self.with)(&mut |exchange, _| done = exchange.watch(every));
        done.map_or_else(Reply::Refused, |()| Reply::Done)
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
        let Block { number, tick, every, .. } = *block;
        Reply::Samples { number, tick, every, more, rows: Bytes(block.bytes()) }
    }

    /// The host steps the machine: only while nothing can move.
    #[cfg(feature = "lockstep")]
    #[inline(never)]
    fn reset(&mut self, config: Bytes<'_>) -> Reply<'static> {
        let (mut was, mut may) = (false, false);
        (self.with)(&mut |exchange, _| {
            was = exchange.lockstep.is_some();
            may = exchange.enter_lockstep();
        });
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
        let mut steps = false;
        (self.with)(&mut |exchange, _| steps = exchange.lockstep.is_some());
        if !steps {
            return Reply::Refused(Refusal::State);
        }
        let LinkHandler { stopwatch, costs, session, .. } = &mut *self.handler;
        session.step(&mut Stepper { stopwatch: *stopwatch, costs, with: &mut *self.with }, input)
    }
}

/// Status of a player.
pub(crate) fn standing(player: &Player<'_, Real>) -> PassStatus {
    PassStatus {
        stage: player.stage().word(),
        status: player.status(),
        knots: player.errors().len() as u32,
        capacity: player.capacity() as u32,
    }
}

/// The settings of a wave; the words are released before the wave is built. None if their number is wrong.
#[inline(never)]
fn settings(bytes: Bytes<'_>) -> Option<Result<Settings<Real>, wave::Refusal>> {
    let mut words = [0; wave::WORDS];
    bytes.read_words(&mut words).then(|| Settings::from_words(&words))
}

/// The link's code for the refusal of a wave.
fn refusal(refused: wave::Refusal) -> Refusal {
    refused.word().map_or(Refusal::State, |index| Refusal::Word { index: index as u16 })
}

impl Device for RequestContext<'_, '_> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        (self.with)(&mut |exchange, _| exchange.host_alive());
        match *request {
            Request::Hello => Reply::Identity(self.identity()),
            Request::Describe { offset } => piece(DESCRIPTION.as_bytes(), offset),
            Request::Status => self.status(),
            Request::Health => self.health(),
            Request::Place => self.place(),
            Request::Supervise { request } => self.supervise(request),
            Request::Setpoint { words } => self.command(words, false),
            Request::SetpointOnEdge { words } => self.command(words, true),
            Request::Edge { .. } if !triggers::INPUT => Reply::Refused(Refusal::Unsupported),
            Request::Edge { drop } => self.edge(drop),
            Request::ReadConfig => self.config(),
            Request::WriteConfig { words } => {
                let LinkHandler { stopwatch, costs, session, .. } = &mut *self.handler;
                session.configure(&mut Stepper { stopwatch: *stopwatch, costs, with: &mut *self.with }, words)
            }
            #[cfg(feature = "lockstep")]
            Request::LockstepReset { config } => self.reset(config),
            #[cfg(feature = "lockstep")]
            Request::LockstepStep { input } => self.step(input),
            #[cfg(feature = "lockstep")]
            Request::LockstepStage { index: 0 } if self.handler.stopwatch.counted != CostUnit::Nothing => {
                Reply::Stage(self.handler.costs.stage())
            }
            #[cfg(not(feature = "lockstep"))]
            Request::LockstepReset { .. } | Request::LockstepStep { .. } => Reply::Refused(Refusal::Unsupported),
            Request::LockstepStage { .. } | Request::Stop => Reply::Refused(Refusal::Unsupported),
            Request::Recorder { action } => self.recorder(action),
            Request::Download { offset } => self.download(offset),
            Request::Wave { action, words } => self.wave(action, words),
            Request::Knots { .. } | Request::Pass { .. } | Request::Errors { .. } | Request::Correction { .. }
                if !passes::POSSIBLE =>
            {
                Reply::Refused(Refusal::Unsupported)
            }
            Request::Knots { first, knots } => self.knots(first, knots),
            Request::Pass { action } => self.pass(action),
            Request::Errors { offset } => self.fetched(offset, Player::errors),
            Request::Correction { offset } => self.fetched(offset, Player::correction),
            Request::Stream { .. } | Request::Samples if !samples::POSSIBLE => Reply::Refused(Refusal::Unsupported),
            Request::Stream { every } => self.stream(every),
            Request::Samples => self.samples(),
        }
    }
}
