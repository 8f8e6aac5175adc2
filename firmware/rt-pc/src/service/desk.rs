//! What is answered over the link.

use controller::supervised::{Cause, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Phase, Request as Wanted};
use controller::{COMMAND_WORDS, CONFIG_WORDS, Config, DESCRIPTION, PLACE_WORDS, Real, passes, triggers};
use specgen_link::{
    Bytes, Counted, Counters, Device, Health, Identity, KNOT, KNOTS, PassAction, RecorderAction, RecorderStatus,
    Refusal, Reply, Request, Status, WaveAction, put_knots, put_words,
};
use specgen_runtime::learning;
use specgen_runtime::pass::Course;
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::{self, Settings};

use crate::capture::CAPACITY;
use crate::console::{Console, No};
use crate::operator::{Denied, HostId};
use crate::passes::Passes;
use crate::samples::Stream;

/// Bytes of a piece of something longer.
const CHUNK: usize = 960;
const _: () = assert!(CHUNK + 24 < specgen_link::MESSAGE);

/// The console as the device of a link.
pub struct Desk<'a> {
    /// What is asked of the run.
    pub console: &'a mut Console,
    pub host: HostId,
    /// What it asks for was sent before a stop of another host.
    pub is_late: bool,
    /// Events that were not yet reported to this host.
    pub events: &'a mut u32,
    /// What it looks on with.
    pub stream: &'a mut Stream,
    /// Now, ns.
    pub now: u64,
    pub words: [u8; size_of::<[u64; CONFIG_WORDS]>()],
    pub knots: [u8; KNOTS * KNOT],
}

impl<'a> Desk<'a> {
    pub fn new(
        console: &'a mut Console,
        host: HostId,
        is_late: bool,
        events: &'a mut u32,
        stream: &'a mut Stream,
        now: u64,
    ) -> Self {
        let words = [0; size_of::<[u64; CONFIG_WORDS]>()];
        Self { console, host, is_late, events, stream, now, words, knots: [0; KNOTS * KNOT] }
    }

    fn status(&self) -> Reply<'static> {
        // Before the first tick it is as at power-up.
        let said = self.console.said.as_ref();
        Reply::Status(Status {
            tick: said.map_or(0, |said| said.tick + 1),
            phase: said.map_or(Phase::Disarmed, |said| said.phase).word() as u8,
            cause: said.map_or(Cause::None, |said| said.cause).word() as u8,
            finding: said.map_or(0, |said| said.finding.word() as u16),
            amplifier_on: said.is_some_and(|said| said.on),
            status: said.map_or(0, |said| said.status),
            events: *self.events,
            late: said.map_or(0, |said| u32::try_from(said.late).unwrap_or(u32::MAX)),
            age: self.since(self.console.ticked),
            // The endpoint fills it in.
            link: Counters::NONE,
        })
    }

    /// From then to now, µs.
    fn since(&self, then: Option<u64>) -> Option<u64> {
        then.map(|then| self.now.saturating_sub(then) / 1000)
    }

    fn health(&mut self) -> Reply<'static> {
        Reply::Health(Health { events: core::mem::take(self.events), ..self.console.health })
    }

    fn place(&mut self) -> Reply<'_> {
        let Reply::Status(Status { tick, phase, status, .. }) = self.status() else {
            return Reply::Refused(Refusal::State);
        };
        let measured = self.since(self.console.measured);
        match put_words(&self.console.place, &mut self.words) {
            Some(words) if PLACE_WORDS > 0 => Reply::Place { tick, phase, status, measured, words },
            _ => Reply::Refused(Refusal::Unsupported),
        }
    }

    /// Gives the orders to this host, then does `what`.
    fn ordered(&mut self, what: impl FnOnce(&mut Self) -> Result<(), Refusal>) -> Reply<'static> {
        // One that orders faster than the loop obeys is not to delay what others have to say.
        let done = if self.console.is_full() { Err(Refusal::Busy) } else { self.take().and_then(|()| what(self)) };
        done.map_or_else(Reply::Refused, |()| Reply::Done)
    }

    fn take(&mut self) -> Result<(), Refusal> {
        if self.is_late {
            return Err(Refusal::Busy);
        }
        self.console.operator.take_for_host(self.host, self.now).map_err(|denied| match denied {
            Denied::Ending => Refusal::State,
            Denied::Others => Refusal::Busy,
        })
    }

    /// What slows the machine down is obeyed whoever has the orders.
    fn supervise(&mut self, request: u8) -> Result<(), Refusal> {
        let wanted = Wanted::from_word(u64::from(request));
        if wanted.word() != u64::from(request) {
            return Err(Refusal::Word { index: 0 });
        }
        match (self.take(), wanted) {
            (Ok(()), _) | (Err(Refusal::Busy), Wanted::Hold) | (Err(_), Wanted::RampDown) => {}
            (refused, _) => return refused,
        }
        let stops = matches!(wanted, Wanted::Hold | Wanted::RampDown);
        if stops {
            self.console.stop();
        }
        self.console.operator.ask_by_link(wanted, self.host);
        Ok(())
    }

    fn command(&mut self, words: Bytes<'_>) -> Result<(), Refusal> {
        // A wave makes the set-points, and a pass: two at once would be a contradiction.
        if self.console.is_engaged() {
            return Err(Refusal::State);
        }
        let mut command = [0; COMMAND_WORDS];
        if !words.read_words(&mut command) {
            return Err(Refusal::Length { expected: COMMAND_WORDS as u16 });
        }
        // What came before it runs would be followed when nobody expects it any more.
        if !self.console.runs() {
            return Err(Refusal::State);
        }
        self.console.operator.set_by_link(command);
        Ok(())
    }

    fn configure(&mut self, words: Bytes<'_>) -> Result<(), Refusal> {
        let mut config = [0; CONFIG_WORDS];
        if !words.read_words(&mut config) {
            return Err(Refusal::Length { expected: CONFIG_WORDS as u16 });
        }
        let config = Config::from_words(&config).map_err(|error| Refusal::Word { index: error.word as u16 })?;
        self.console.configure(config);
        Ok(())
    }

    fn command_on_edge(&mut self, words: Bytes<'_>) -> Result<(), Refusal> {
        let mut command = [0; COMMAND_WORDS];
        if !words.read_words(&mut command) {
            return Err(Refusal::Length { expected: COMMAND_WORDS as u16 });
        }
        self.console.command_on_edge(command).map_err(refusal)
    }

    fn edge(&mut self, drop: bool) -> Reply<'static> {
        if drop {
            let dropped = self.ordered(|desk| {
                desk.console.stop_waiting();
                Ok(())
            });
            if dropped != Reply::Done {
                return dropped;
            }
        }
        Reply::Edge(self.console.edge)
    }

    fn wave(&mut self, action: WaveAction, words: Bytes<'_>) -> Result<(), Refusal> {
        let on_edge = match action {
            WaveAction::Start => false,
            WaveAction::StartOnEdge if triggers::INPUT => true,
            WaveAction::StartOnEdge => return Err(Refusal::Unsupported),
            WaveAction::Stop => {
                self.console.stop_wave();
                return Ok(());
            }
        };
        let mut settings = [0; wave::WORDS];
        if !words.read_words(&mut settings) {
            return Err(Refusal::Length { expected: wave::WORDS as u16 });
        }
        let settings = Settings::<Real>::from_words(&settings)
            .map_err(|refused| refused.word().map_or(Refusal::State, |index| Refusal::Word { index: index as u16 }))?;
        self.console.start_wave(&settings, on_edge).map_err(refusal)
    }

    fn knots(&mut self, first: u32, knots: Bytes<'_>) -> Result<(), Refusal> {
        // Not as a message that nobody can read, whose number is used again.
        let whole = Refusal::Length { expected: (KNOTS * KNOT / size_of::<u64>()) as u16 };
        let knots = knots.knots().ok_or(whole)?;
        self.console.put_knots(first, knots).map_err(refusal)
    }

    fn pass(&mut self, action: PassAction) -> Reply<'static> {
        if action != PassAction::Look {
            let others = !self.console.operator.may_order(self.host, self.now) || self.console.is_full();
            let done = match action {
                _ if others => Err(Refusal::Busy),
                PassAction::Learn { reach, fade } => self.take().and_then(|()| {
                    let learns = self.console.passes.learn(learning::Settings { reach, fade });
                    if learns { Ok(()) } else { Err(Refusal::State) }
                }),
                PassAction::Begin { spacing, before, ticks, trajectory } => self.take().and_then(|()| {
                    self.console.begin_pass(Course { spacing, before, ticks, trajectory }).map_err(refusal)
                }),
                _ => {
                    self.console.abort_pass();
                    Ok(())
                }
            };
            if let Err(refused) = done {
                return Reply::Refused(refused);
            }
        }
        self.console.passes.status().map_or(Reply::Refused(Refusal::Unsupported), Reply::Pass)
    }

    /// Knots of what a pass kept, or of what the next one plays.
    fn fetched(&mut self, offset: u32, knots: impl Fn(&Passes) -> Option<&[Knot]>) -> Reply<'_> {
        let Some(knots) = knots(&self.console.passes) else { return Reply::Refused(Refusal::State) };
        let total = u32::try_from(knots.len() * KNOT).unwrap_or(u32::MAX);
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let bytes = Bytes(put_knots(knots, start, &mut self.knots));
        Reply::Chunk { offset, total, bytes }
    }

    fn recorder(&mut self, action: RecorderAction) -> Reply<'static> {
        let others = !self.console.operator.may_order(self.host, self.now) || self.console.is_full();
        let done = match action {
            action if others && action != RecorderAction::Look => return Reply::Refused(Refusal::Busy),
            RecorderAction::Look => Ok(()),
            RecorderAction::Arm { after } => self.console.arm_recorder(after),
            RecorderAction::Trigger => {
                self.console.trigger_recorder();
                Ok(())
            }
            RecorderAction::Stop => {
                self.console.stop_recorder();
                Ok(())
            }
        };
        if let Err(no) = done {
            return Reply::Refused(refusal(no));
        }
        let standing = self.console.capture.standing();
        Reply::Recorder(RecorderStatus {
            running: standing.running,
            triggered: standing.triggered,
            ticks: u32::try_from(standing.ticks).unwrap_or(u32::MAX),
            capacity: CAPACITY,
        })
    }
}

fn refusal(no: No) -> Refusal {
    match no {
        No::State => Refusal::State,
        No::Word(index) => Refusal::Word { index: index as u16 },
    }
}

fn piece(whole: &[u8], offset: u32) -> Reply<'_> {
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    let rest = whole.get(start..).unwrap_or_default();
    let piece = rest.get(..CHUNK).unwrap_or(rest);
    Reply::Chunk { offset, total: u32::try_from(whole.len()).unwrap_or(u32::MAX), bytes: Bytes(piece) }
}

impl Device for Desk<'_> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        self.console.operator.seen(self.host, self.now);
        match *request {
            Request::Hello => {
                self.console.operator.connected(self.host, self.now);
                Reply::Identity(Identity {
                    config_words: CONFIG_WORDS as u16,
                    input_words: MACHINE_INPUT_WORDS as u16,
                    output_words: MACHINE_OUTPUT_WORDS as u16,
                    stages: 0,
                    counted: Counted::Nothing,
                    description: DESCRIPTION.len() as u32,
                })
            }
            Request::Describe { offset } => piece(DESCRIPTION.as_bytes(), offset),
            Request::Status => self.status(),
            Request::Health => self.health(),
            Request::Place => self.place(),
            Request::Supervise { request } => self.supervise(request).map_or_else(Reply::Refused, |()| Reply::Done),
            Request::Setpoint { words } => self.ordered(|desk| desk.command(words)),
            Request::SetpointOnEdge { .. } | Request::Edge { .. } if !triggers::INPUT => {
                Reply::Refused(Refusal::Unsupported)
            }
            Request::SetpointOnEdge { words } => self.ordered(|desk| desk.command_on_edge(words)),
            Request::Edge { drop } => self.edge(drop),
            Request::ReadConfig => match put_words(&self.console.config().to_words(), &mut self.words) {
                Some(words) => Reply::Config { words },
                None => Reply::Refused(Refusal::TooLong),
            },
            Request::WriteConfig { words } => self.ordered(|desk| desk.configure(words)),
            Request::Recorder { action } => self.recorder(action),
            Request::Download { offset } => match self.console.capture.image() {
                Some(image) => piece(image, offset),
                None => Reply::Refused(Refusal::State),
            },
            Request::Wave { action, words } => self.ordered(|desk| desk.wave(action, words)),
            Request::Knots { .. } | Request::Pass { .. } | Request::Errors { .. } | Request::Correction { .. }
                if !passes::POSSIBLE =>
            {
                Reply::Refused(Refusal::Unsupported)
            }
            Request::Knots { first, knots } => self.ordered(|desk| desk.knots(first, knots)),
            Request::Pass { action } => self.pass(action),
            Request::Errors { offset } => self.fetched(offset, Passes::errors),
            Request::Correction { offset } => self.fetched(offset, Passes::correction),
            Request::Stream { every } => self.stream.start(every).map_or_else(Reply::Refused, |()| Reply::Done),
            Request::Samples => self.stream.take(),
            Request::Stop => {
                self.console.operator.ramp_down(self.now);
                Reply::Done
            }
            // The machine of a PC is the host's own: it is tried by `specgen sim` and `specgen replay`.
            Request::LockstepReset { .. } | Request::LockstepStep { .. } | Request::LockstepStage { .. } => {
                Reply::Refused(Refusal::Unsupported)
            }
        }
    }
}
