//! What a board answers over the link.

use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, Phase, Request as Wanted};
use controller::waves::{self, Wave};
use controller::{CONFIG_WORDS, DESCRIPTION, Real};
use specgen_link::lockstep::{Session, piece};
use specgen_link::{
    Bytes, Counted, Counters, Device, Identity, RecorderAction, Refusal, Reply, Request, Status, WaveAction,
};
use specgen_runtime::wave::{self, Settings};

use crate::download::{self, Download};
use crate::exchange::Exchange;
use crate::recording;
use crate::stepper::{Costs, Stepper, Stopwatch};
use crate::words::COMMAND_WORDS;

/// Words of the longest answer: settings, what a step gives, a piece of a record.
const WORDS: usize = larger(larger(CONFIG_WORDS, MACHINE_OUTPUT_WORDS), larger(MACHINE_INPUT_WORDS, download::WORDS));

const fn larger(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// What lies behind the desk of the background. Everything else is in the [`Exchange`], which it looks into for as long as a copy
/// takes.
#[derive(Debug)]
pub struct Desk<S> {
    stopwatch: S,
    costs: Costs,
    session: Session<WORDS>,
    download: Download,
}

/// A desk while bytes are looked at. `with` gives access to the exchange and the machine, with the tick held off.
#[derive(Debug)]
pub struct Visit<'d, S, F> {
    /// The desk.
    pub desk: &'d mut Desk<S>,
    /// The access.
    pub with: F,
}

impl<S: Stopwatch> Desk<S> {
    /// At power-up.
    #[must_use]
    pub const fn new(stopwatch: S) -> Self {
        Self { stopwatch, costs: Costs::NONE, session: Session::new(), download: Download::new() }
    }
}

impl<S: Stopwatch, F: FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine))> Visit<'_, S, F> {
    fn identity(&mut self) -> Identity {
        self.desk.session.end();
        (self.with)(&mut |exchange, machine| {
            // A host that comes anew has asked for nothing yet.
            exchange.orders.request = Wanted::None;
            exchange.leave_lockstep(machine);
            if let Some(wave) = &mut exchange.wave {
                wave.stop();
            }
        });
        Identity {
            config_words: CONFIG_WORDS as u16,
            input_words: MACHINE_INPUT_WORDS as u16,
            output_words: MACHINE_OUTPUT_WORDS as u16,
            stages: u8::from(S::COUNTED != Counted::Nothing),
            counted: S::COUNTED,
            description: DESCRIPTION.len() as u32,
        }
    }

    fn status(&mut self) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            let report = &mut exchange.report;
            reply = Reply::Status(Status {
                tick: report.tick,
                phase: report.phase.word() as u8,
                cause: report.cause.word() as u8,
                amplifier_on: report.amplifier_on,
                status: report.status,
                events: report.events,
                late: report.missed,
                // The endpoint fills it in.
                link: Counters::NONE,
            });
            // An answer that is lost is given again as it is.
            report.events = 0;
        });
        reply
    }

    /// Asks for something of the ticks, unless the host steps the machine or `allowed` says otherwise.
    fn order(&mut self, mut order: impl FnMut(&mut Exchange) -> bool) -> Reply<'static> {
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            if exchange.lockstep.is_none() && order(exchange) {
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

    fn command(&mut self, words: Bytes<'_>) -> Reply<'static> {
        let mut command = [0; COMMAND_WORDS];
        if !words.read_words(&mut command) {
            return Reply::Refused(Refusal::Length { expected: COMMAND_WORDS as u16 });
        }
        self.order(|exchange| {
            let free = !exchange.waves();
            if free {
                exchange.orders.command = command;
            }
            free
        })
    }

    fn config(&mut self) -> Reply<'_> {
        let mut config = None;
        (self.with)(&mut |exchange, _| config = Some(exchange.config));
        let words = config.map(|config| config.to_words()).unwrap_or([0; CONFIG_WORDS]);
        match self.desk.session.answer(&words) {
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

    fn download(&mut self, offset: u32) -> Reply<'_> {
        let with = &mut self.with;
        let mut refusal = Refusal::Unsupported;
        let Desk { download, session, .. } = &mut *self.desk;
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
            WaveAction::Start => self.start_wave(words),
            WaveAction::Stop => self.order(|exchange| {
                if let Some(wave) = &mut exchange.wave {
                    wave.stop();
                }
                true
            }),
        }
    }

    /// Checks a wave while ticks go on, then hands it over.
    fn start_wave(&mut self, bytes: Bytes<'_>) -> Reply<'static> {
        let mut words = [0; wave::WORDS];
        if !bytes.read_words(&mut words) {
            return Reply::Refused(Refusal::Length { expected: wave::WORDS as u16 });
        }
        let mut config = None;
        (self.with)(&mut |exchange, _| config = Some(exchange.config));
        let limits = waves::limits(&config.unwrap_or_default());
        let loaded = Settings::<Real>::from_words(&words).and_then(|settings| {
            let mut wave = Wave::new(limits);
            wave.set(&settings)?;
            wave.start();
            Ok((settings.center, wave))
        });
        let (center, wave) = match loaded {
            Ok(loaded) => loaded,
            Err(refused) => {
                let word = |index| Refusal::Word { index: index as u16 };
                return Reply::Refused(refused.word().map_or(Refusal::State, word));
            }
        };
        let mut reply = Reply::Refused(Refusal::State);
        (self.with)(&mut |exchange, _| {
            let runs = exchange.report.phase == Phase::Running && exchange.lockstep.is_none();
            if runs && !exchange.waves() {
                let command = &exchange.orders.command;
                reply = match waves::may_begin(exchange.report.status, command, &center, &limits) {
                    Ok(()) => Reply::Done,
                    Err(_) => Reply::Refused(Refusal::State),
                };
                if reply == Reply::Done {
                    exchange.wave = Some(wave);
                }
            }
        });
        reply
    }

    /// The host steps the machine: only while nothing can move.
    fn reset(&mut self, config: Bytes<'_>) -> Reply<'static> {
        let (mut was, mut may) = (false, false);
        (self.with)(&mut |exchange, _| {
            was = exchange.lockstep.is_some();
            may = exchange.enter_lockstep();
        });
        if !may {
            return Reply::Refused(Refusal::State);
        }
        let Desk { stopwatch, costs, session, .. } = &mut *self.desk;
        let reply = session.reset(&mut Stepper { stopwatch, costs, with: &mut self.with }, config);
        if reply != Reply::Done && !was {
            // Settings that were refused have changed nothing.
            (self.with)(&mut |exchange, _| exchange.lockstep = None);
        }
        reply
    }

    fn step(&mut self, input: Bytes<'_>) -> Reply<'_> {
        let mut steps = false;
        (self.with)(&mut |exchange, _| steps = exchange.lockstep.is_some());
        if !steps {
            return Reply::Refused(Refusal::State);
        }
        let Desk { stopwatch, costs, session, .. } = &mut *self.desk;
        session.step(&mut Stepper { stopwatch, costs, with: &mut self.with }, input)
    }
}

impl<S: Stopwatch, F: FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine))> Device for Visit<'_, S, F> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        (self.with)(&mut |exchange, _| exchange.hear());
        match *request {
            Request::Hello => Reply::Identity(self.identity()),
            Request::Describe { offset } => piece(DESCRIPTION.as_bytes(), offset),
            Request::Status => self.status(),
            Request::Supervise { request } => self.supervise(request),
            Request::Setpoint { words } => self.command(words),
            Request::ReadConfig => self.config(),
            Request::WriteConfig { words } => {
                let Desk { stopwatch, costs, session, .. } = &mut *self.desk;
                session.configure(&mut Stepper { stopwatch, costs, with: &mut self.with }, words)
            }
            Request::LockstepReset { config } => self.reset(config),
            Request::LockstepStep { input } => self.step(input),
            Request::LockstepStage { index: 0 } if S::COUNTED != Counted::Nothing => {
                Reply::Stage(self.desk.costs.stage())
            }
            Request::LockstepStage { .. } => Reply::Refused(Refusal::Unsupported),
            Request::Recorder { action } => self.recorder(action),
            Request::Download { offset } => self.download(offset),
            Request::Wave { action, words } => self.wave(action, words),
        }
    }
}
