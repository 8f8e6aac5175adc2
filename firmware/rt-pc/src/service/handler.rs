//! The link commands of a run.

use controller::supervised::{Cause, Phase, Request as Wanted};
use controller::{CONFIG_WORDS, Config, PLACE_WORDS, Real};
use specgen_board::{Backend, Command, execute};
use specgen_link::lockstep::piece;
use specgen_link::{
    Bytes, CostUnit, Counters, Device, EdgeStatus, Health, KNOT, KNOTS, PassAction, PassStatus, RecorderAction,
    RecorderStatus, Refusal, Reply, Request, Status, put_knots,
};
use specgen_runtime::learning;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::Settings;

use crate::capture::CAPACITY;
use crate::console::Console;
use crate::operator::{ControlRefusal, HostId};
use crate::samples::Stream;

/// Bytes of a piece of something longer.
const CHUNK: usize = 960;
const _: () = assert!(CHUNK + 24 < specgen_link::MESSAGE);

/// The console as the device of a link.
pub struct LinkHandler<'a> {
    /// The console of the run.
    pub console: &'a mut Console,
    pub host: HostId,
    /// Its requests were sent before a stop of another host.
    pub is_late: bool,
    /// Events that were not yet reported to this host.
    pub events: &'a mut u32,
    /// Its samples.
    pub stream: &'a mut Stream,
    /// Now, ns.
    pub now: u64,
    pub words: [u8; size_of::<[u64; CONFIG_WORDS]>()],
    pub knots: [u8; KNOTS * KNOT],
}

impl<'a> LinkHandler<'a> {
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

    /// From then to now, µs.
    fn since(&self, then: Option<u64>) -> Option<u64> {
        then.map(|then| self.now.saturating_sub(then) / 1000)
    }

    /// Gives control to this host.
    fn take(&mut self) -> Result<(), Refusal> {
        if self.is_late {
            return Err(Refusal::Busy);
        }
        self.console.operator.take_for_host(self.host, self.now).map_err(|denied| match denied {
            ControlRefusal::Ending => Refusal::State,
            ControlRefusal::Others => Refusal::Busy,
        })
    }

    /// Refuses while another host is in control, or the queue of commands is full.
    fn admit(&self) -> Result<(), Refusal> {
        let others = !self.console.operator.may_take_control(self.host, self.now) || self.console.is_full();
        if others { Err(Refusal::Busy) } else { Ok(()) }
    }
}

impl Backend for LinkHandler<'_> {
    const PIECE: usize = CHUNK;

    fn host_alive(&mut self) {
        self.console.operator.seen(self.host, self.now);
    }

    fn connect(&mut self) -> CostUnit {
        self.console.operator.connected(self.host, self.now);
        CostUnit::Nothing
    }

    fn status(&mut self) -> Status {
        // Before the first tick it is as at power-up.
        let said = self.console.said.as_ref();
        Status {
            tick: said.map_or(0, |said| said.tick + 1),
            phase: said.map_or(Phase::Disarmed, |said| said.phase).word() as u8,
            cause: said.map_or(Cause::None, |said| said.cause).word() as u8,
            finding: said.map_or(0, |said| said.finding.word() as u16),
            amplifier_on: said.is_some_and(|said| said.on),
            status: said.map_or(0, |said| said.status),
            events: *self.events,
            late: said.map_or(0, |said| u32::try_from(said.late).unwrap_or(u32::MAX)),
            age: self.since(self.console.ticked),
            link: Counters::NONE,
        }
    }

    fn health(&mut self) -> Health {
        Health { events: core::mem::take(self.events), ..self.console.health }
    }

    fn place(&mut self) -> (Status, Option<u64>, [u64; PLACE_WORDS]) {
        (self.status(), self.since(self.console.measured), self.console.place)
    }

    fn buffer(&mut self) -> &mut [u8] {
        &mut self.words
    }

    fn authorise(&mut self) -> Result<(), Refusal> {
        // A host that sends commands faster than the loop takes them must not delay other hosts.
        if self.console.is_full() { Err(Refusal::Busy) } else { self.take() }
    }

    /// A request that slows the machine down is accepted from every host.
    fn supervise(&mut self, request: Wanted) -> Result<(), Refusal> {
        match (self.take(), request) {
            (Ok(()), _) | (Err(Refusal::Busy), Wanted::Hold) | (Err(_), Wanted::RampDown) => {}
            (refused, _) => return refused,
        }
        if matches!(request, Wanted::Hold | Wanted::RampDown) {
            self.console.stop();
        }
        self.console.operator.ask_by_link(request, self.host);
        Ok(())
    }

    fn command(&mut self, command: &Command) -> Result<(), Refusal> {
        // A wave or a pass makes the set-points: two sources would conflict. A command from before the run must not
        // take effect later.
        if self.console.is_engaged() || !self.console.is_commanded() {
            return Err(Refusal::State);
        }
        self.console.operator.set_by_link(*command);
        Ok(())
    }

    fn command_on_edge(&mut self, command: &Command) -> Result<(), Refusal> {
        self.console.command_on_edge(*command)
    }

    fn edge(&mut self, drop: bool) -> Result<EdgeStatus, Refusal> {
        if drop {
            self.authorise()?;
            self.console.stop_waiting();
        }
        Ok(self.console.edge)
    }

    fn settings(&mut self) -> [u64; CONFIG_WORDS] {
        self.console.config().to_words()
    }

    fn configure(&mut self, config: Config) {
        self.console.configure(config);
    }

    fn recorder(&mut self, action: RecorderAction) -> Result<RecorderStatus, Refusal> {
        if action != RecorderAction::Look {
            self.admit()?;
        }
        match action {
            RecorderAction::Look => {}
            RecorderAction::Arm { after } => self.console.arm_recorder(after)?,
            RecorderAction::Trigger => self.console.trigger_recorder(),
            RecorderAction::Stop => self.console.stop_recorder(),
        }
        let standing = self.console.capture.standing();
        Ok(RecorderStatus {
            running: standing.running,
            triggered: standing.triggered,
            ticks: u32::try_from(standing.ticks).unwrap_or(u32::MAX),
            capacity: CAPACITY,
        })
    }

    fn download(&mut self, offset: u32) -> Result<Reply<'_>, Refusal> {
        self.console.capture.image().map(|image| piece(image, offset, CHUNK)).ok_or(Refusal::State)
    }

    fn start_wave(&mut self, settings: &Settings<Real>, on_edge: bool) -> Result<(), Refusal> {
        self.console.start_wave(settings, on_edge)
    }

    fn stop_wave(&mut self) -> Result<(), Refusal> {
        self.console.stop_wave();
        Ok(())
    }

    fn put_knots(&mut self, first: u32, knots: &[Knot]) -> Result<(), Refusal> {
        self.console.put_knots(first, knots)
    }

    fn pass(&mut self, action: PassAction) -> Result<PassStatus, Refusal> {
        if action != PassAction::Look {
            self.admit()?;
        }
        match action {
            PassAction::Look => {}
            PassAction::Begin { spacing, before, ticks, trajectory } => {
                self.take()?;
                self.console.begin_pass(Course { spacing, before, ticks, trajectory })?;
            }
            PassAction::Abort => self.console.abort_pass(),
            PassAction::Learn { reach, fade } => {
                self.take()?;
                if !self.console.passes.learn(learning::Settings { reach, fade }) {
                    return Err(Refusal::State);
                }
            }
        }
        self.console.passes.status().ok_or(Refusal::Unsupported)
    }

    fn knots(
        &mut self,
        offset: u32,
        knots: impl for<'p> Fn(&'p Player<'static, Real>) -> &'p [Knot],
    ) -> Result<Reply<'_>, Refusal> {
        let knots = knots(self.console.passes.player().ok_or(Refusal::State)?);
        let total = u32::try_from(knots.len() * KNOT).unwrap_or(u32::MAX);
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        Ok(Reply::Chunk { offset, total, bytes: Bytes(put_knots(knots, start, &mut self.knots)) })
    }

    fn stream(&mut self, every: u32) -> Result<(), Refusal> {
        self.stream.start(every)
    }

    fn samples(&mut self) -> Reply<'_> {
        self.stream.take()
    }

    /// The machine of a PC runs on the host itself: `specgen sim` and `specgen replay` test it without lock-steps.
    fn other(&mut self, request: &Request<'_>) -> Reply<'_> {
        if *request != Request::Stop {
            return Reply::Refused(Refusal::Unsupported);
        }
        self.console.operator.ramp_down(self.now);
        Reply::Done
    }
}

impl Device for LinkHandler<'_> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        execute(self, request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::{row, said};
    use crate::capture::Capture;
    use crate::handover::LoopCommand;
    use crate::operator::{Arbiter, Timeout};
    use crate::passes::Passes;
    use controller::supervised::MACHINE_INPUT_WORDS;
    use controller::{COMMAND_WORDS, CONFIG_NAMES, DESCRIPTION};
    use specgen_link::WaveAction;
    use specgen_runtime::wave;

    const A: HostId = HostId(1);
    const B: HostId = HostId(2);
    const NOW: u64 = 5_000_000;

    fn console(phase: Phase) -> Console {
        let operator = Arbiter::new(true, Timeout { silence: 1 << 40, idle: 1 << 40 });
        let mut console = Console::new(operator, Capture::new(None).unwrap().0, Config::new());
        console.update(&row(7), said(phase), NOW - 3_000_000);
        console
    }

    /// What a host is answered, as text; a piece of something longer as its bytes.
    fn ask_as(console: &mut Console, host: HostId, is_late: bool, request: &Request<'_>) -> String {
        let (mut events, mut stream) = (0, Stream::default());
        let mut handler = LinkHandler::new(console, host, is_late, &mut events, &mut stream, NOW);
        format!("{:?}", handler.execute(request))
    }

    fn ask(console: &mut Console, request: &Request<'_>) -> String {
        ask_as(console, A, false, request)
    }

    fn refused(refusal: Refusal) -> String {
        format!("{:?}", Reply::Refused(refusal))
    }

    fn bytes(words: &[u64]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    fn whole(console: &mut Console, request: impl Fn(u32) -> Request<'static>) -> Vec<u8> {
        let mut all = Vec::new();
        loop {
            let (mut events, mut stream) = (0, Stream::default());
            let mut handler = LinkHandler::new(console, A, false, &mut events, &mut stream, NOW);
            let Reply::Chunk { offset, total, bytes } = handler.execute(&request(all.len() as u32)) else {
                panic!("no piece")
            };
            assert_eq!(offset as usize, all.len());
            if bytes.0.is_empty() {
                assert_eq!(total as usize, all.len());
                return all;
            }
            all.extend_from_slice(bytes.0);
        }
    }

    const DONE: &str = "Done";

    #[test]
    fn a_host_learns_who_is_there_and_how_it_stands() {
        let mut console = console(Phase::Holding);
        let hello = ask(&mut console, &Request::Hello);
        let words = format!("config_words: {CONFIG_WORDS}, input_words: {MACHINE_INPUT_WORDS}");
        assert!(hello.contains(&words) && hello.contains(&format!("description: {}", DESCRIPTION.len())), "{hello}");
        assert_eq!(whole(&mut console, |offset| Request::Describe { offset }), DESCRIPTION.as_bytes());
        let status = ask(&mut console, &Request::Status);
        for part in ["tick: 8,", "phase: 3,", "cause: 0,", "amplifier_on: true", "age: Some(3000)"] {
            assert!(status.contains(part), "{part} {status}");
        }
        console.said = None;
        console.ticked = None;
        let status = ask(&mut console, &Request::Status);
        for part in ["tick: 0,", "phase: 0,", "amplifier_on: false", "age: None"] {
            assert!(status.contains(part), "{part} {status}");
        }
    }

    #[test]
    fn the_place_is_that_of_the_last_tick_with_its_age() {
        let mut console = console(Phase::Running);
        let mut shown = row(9);
        shown.place = core::array::from_fn(|k| k as u64 + 70);
        let blind = crate::operator::SupervisorReport { status: controller::GAUGE_FAULT, ..said(Phase::Running) };
        console.update(&shown, blind, NOW);
        let (mut events, mut stream) = (0, Stream::default());
        let mut handler = LinkHandler::new(&mut console, A, false, &mut events, &mut stream, NOW);
        let Reply::Place { tick, phase, status, measured, words } = handler.execute(&Request::Place) else {
            panic!("no place")
        };
        assert_eq!((tick, phase, status, measured), (8, 2, controller::GAUGE_FAULT, Some(3000)));
        let mut found = [0; PLACE_WORDS];
        assert!(words.read_words(&mut found) && found == shown.place);
    }

    #[test]
    fn health_gives_events_once_and_leaves_the_rest() {
        let mut console = console(Phase::Holding);
        console.health.overruns = Some(5);
        let (mut events, mut stream) = (6, Stream::default());
        let mut handler = LinkHandler::new(&mut console, A, false, &mut events, &mut stream, NOW);
        for expected in [6, 0] {
            let Reply::Health(health) = handler.execute(&Request::Health) else { panic!("no health") };
            assert_eq!((health.events, health.overruns), (expected, Some(5)));
        }
    }

    #[test]
    fn one_host_has_the_orders_and_every_host_may_stop() {
        let mut console = console(Phase::Running);
        let supervise = |request| Request::Supervise { request };
        assert_eq!(ask(&mut console, &supervise(9)), refused(Refusal::Word { index: 0 }));
        assert_eq!(ask(&mut console, &supervise(0)), DONE);
        assert_eq!(console.stops, 0);
        assert_eq!(ask_as(&mut console, B, false, &supervise(2)), refused(Refusal::Busy));
        for (stops, request) in [(1, 3), (2, 4)] {
            assert_eq!(ask_as(&mut console, B, false, &supervise(request)), DONE);
            assert_eq!(console.stops, stops);
            assert_eq!(console.operator.take_pending().unwrap().request.word(), u64::from(request));
        }
        // What was sent before another host's stop moves nothing.
        assert_eq!(ask_as(&mut console, A, true, &supervise(2)), refused(Refusal::Busy));
        assert_eq!(ask_as(&mut console, A, true, &supervise(3)), DONE);
        // At the end nothing but the way down is obeyed.
        assert_eq!(ask_as(&mut console, B, false, &Request::Stop), DONE);
        assert_eq!(ask(&mut console, &supervise(2)), refused(Refusal::State));
        assert_eq!(ask(&mut console, &supervise(3)), refused(Refusal::State));
        assert_eq!(ask(&mut console, &supervise(4)), DONE);
        assert!(console.operator.is_ending());
    }

    #[test]
    fn a_command_is_whole_and_of_a_machine_that_runs() {
        let words = bytes(&[3; COMMAND_WORDS]);
        let setpoint = Request::Setpoint { words: Bytes(&words) };
        let short = Request::Setpoint { words: Bytes(&words[8..]) };
        assert_eq!(ask(&mut console(Phase::Holding), &setpoint), refused(Refusal::State));
        let mut console = console(Phase::Running);
        console.operator.take_pending();
        assert_eq!(ask(&mut console, &short), refused(Refusal::Length { expected: COMMAND_WORDS as u16 }));
        assert!(console.operator.take_pending().is_none());
        assert_eq!(ask(&mut console, &setpoint), DONE);
        assert_eq!(console.operator.take_pending().unwrap().command, Some([3; COMMAND_WORDS]));
        // A wave commands in its place.
        assert_eq!(console.start_wave(&Settings::still(), false), Err(Refusal::State), "under a trajectory");
        console.operator.set_by_link([0; COMMAND_WORDS]);
        console.start_wave(&Settings::still(), false).unwrap();
        assert_eq!(ask(&mut console, &setpoint), refused(Refusal::State));
    }

    #[test]
    fn settings_are_taken_whole_or_not_at_all() {
        let mut console = console(Phase::Holding);
        let mut words = Config::new().to_words();
        let write =
            |console: &mut Console, words: &[u64]| ask(console, &Request::WriteConfig { words: Bytes(&bytes(words)) });
        let expected = CONFIG_WORDS as u16;
        assert_eq!(write(&mut console, &words[1..]), refused(Refusal::Length { expected }));
        let place = CONFIG_NAMES.iter().position(|name| *name == "kp[0]").unwrap();
        words[place] = crate::words::word(Real::NAN);
        assert_eq!(write(&mut console, &words), refused(Refusal::Word { index: place as u16 }));
        assert!(console.outgoing().0.is_empty() && *console.config() == Config::new());
        words[place] = crate::words::word(0.0);
        assert_eq!(write(&mut console, &words), DONE);
        assert!(
            matches!(console.outgoing().0.back(), Some(LoopCommand::Configure(config)) if config.to_words() == words)
        );
        let (mut events, mut stream) = (0, Stream::default());
        let mut handler = LinkHandler::new(&mut console, A, false, &mut events, &mut stream, NOW);
        let Reply::Config { words: found } = handler.execute(&Request::ReadConfig) else { panic!("no settings") };
        assert_eq!(found.0, bytes(&words));
    }

    #[test]
    fn orders_beyond_what_the_loop_takes_are_refused_but_for_a_stop() {
        let mut console = console(Phase::Running);
        let stop = Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) };
        let mut taken = 0;
        while ask(&mut console, &stop) == DONE {
            taken += 1;
            assert!(taken <= 64);
        }
        assert_eq!((taken, console.outgoing().0.len()), (64, 64));
        assert_eq!(ask(&mut console, &stop), refused(Refusal::Busy));
        let arm = Request::Recorder { action: RecorderAction::Arm { after: 1 } };
        assert_eq!(ask(&mut console, &arm), refused(Refusal::Busy));
        assert_eq!(ask(&mut console, &Request::Supervise { request: 3 }), DONE);
    }

    #[test]
    fn the_recorder_obeys_who_has_the_orders_and_is_shown_to_everybody() {
        let mut console = console(Phase::Holding);
        assert_eq!(ask(&mut console, &Request::Supervise { request: 0 }), DONE);
        let recorder = |action| Request::Recorder { action };
        let look = ask_as(&mut console, B, false, &recorder(RecorderAction::Look));
        assert!(look.contains("running: true, triggered: false, ticks: 0"), "{look}");
        assert!(look.contains(&format!("capacity: {CAPACITY}")));
        for action in [RecorderAction::Arm { after: 1 }, RecorderAction::Trigger, RecorderAction::Stop] {
            assert_eq!(ask_as(&mut console, B, false, &recorder(action)), refused(Refusal::Busy));
            assert!(ask(&mut console, &recorder(action)).contains("running: true"));
        }
        let commands: Vec<_> = console.outgoing().0.iter().collect();
        assert!(
            matches!(commands[..], [LoopCommand::Record(settings), LoopCommand::Trigger, LoopCommand::StopRecorder] if settings.after == 1)
        );
        let arm = |after| Request::Recorder { action: RecorderAction::Arm { after } };
        assert_eq!(ask(&mut console, &arm(CAPACITY + 1)), refused(Refusal::Word { index: 0 }));
        assert!(ask(&mut console, &arm(CAPACITY)).starts_with("Recorder"));
        assert_eq!(ask(&mut console, &Request::Download { offset: 0 }), refused(Refusal::State), "it is away");
        let (_, tape) = Capture::new(None).unwrap();
        console.capture.receive(tape, 9);
        let file = whole(&mut console, |offset| Request::Download { offset });
        assert!(file.len() > CHUNK && file.windows(4).any(|window| window == &DESCRIPTION.as_bytes()[..4]));
    }

    #[test]
    fn a_wave_is_whole_and_of_a_machine_that_runs() {
        let mut settings = Settings::<Real>::still();
        settings.ticks = 50;
        let good = settings.to_words();
        let wave = |console: &mut Console, action, words: &[u64]| {
            ask(console, &Request::Wave { action, words: Bytes(&bytes(words)) })
        };
        let start = WaveAction::Start;
        assert_eq!(wave(&mut console(Phase::Holding), start, &good), refused(Refusal::State));
        let mut console = console(Phase::Running);
        assert_eq!(wave(&mut console, start, &good[1..]), refused(Refusal::Length { expected: wave::WORDS as u16 }));
        let mut bad = good;
        bad[0] = crate::words::word(Real::NAN);
        assert_eq!(wave(&mut console, start, &bad), refused(Refusal::Word { index: 0 }));
        assert!(!console.is_engaged() && console.outgoing().0.is_empty());
        assert_eq!(wave(&mut console, start, &good), DONE);
        assert!(console.is_engaged());
        let commands: Vec<_> = console.outgoing().0.iter().collect();
        assert!(
            matches!(commands[..], [LoopCommand::Request(_), LoopCommand::Wave(wave)] if format!("{wave:?}").contains(" ticks: 50 "))
        );
        assert_eq!(wave(&mut console, start, &good), refused(Refusal::State));
        assert_eq!(wave(&mut console, WaveAction::Stop, &[]), DONE);
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::StopWave)));
    }

    #[test]
    fn what_this_controller_does_not_do_is_refused() {
        let mut console = console(Phase::Running);
        let none = Bytes(&[]);
        let requests = [
            Request::SetpointOnEdge { words: none },
            Request::Edge { drop: false },
            Request::Wave { action: WaveAction::StartOnEdge, words: none },
            Request::Knots { first: 0, knots: none },
            Request::Pass { action: PassAction::Look },
            Request::Errors { offset: 0 },
            Request::Correction { offset: 0 },
            Request::LockstepReset { config: none },
            Request::LockstepStep { input: none },
            Request::LockstepStage { index: 0 },
        ];
        for request in &requests {
            assert_eq!(ask(&mut console, request), refused(Refusal::Unsupported), "{request:?}");
        }
        assert!(console.outgoing().0.is_empty());
    }

    #[test]
    fn orders_for_the_edge_of_an_input_line_wait_for_a_machine_at_rest() {
        let mut console = console(Phase::Running);
        console.operator.take_pending();
        let (mut events, mut stream) = (0, Stream::default());
        let command = [1; COMMAND_WORDS];
        let mut handler = LinkHandler::new(&mut console, A, false, &mut events, &mut stream, NOW);
        assert_eq!(handler.command_on_edge(&command), Ok(()));
        assert!(handler.edge(false).is_ok());
        assert_eq!(handler.console.outgoing().0.len(), 1);
        assert!(handler.edge(true).is_ok());
        assert!(matches!(handler.console.outgoing().0.back(), Some(LoopCommand::StopWaiting)));
        handler.is_late = true;
        assert_eq!(handler.edge(true), Err(Refusal::Busy));
        let mut resting = self::console(Phase::Holding);
        let mut handler = LinkHandler::new(&mut resting, A, false, &mut events, &mut stream, NOW);
        assert_eq!(handler.command_on_edge(&command), Err(Refusal::State));
    }

    #[test]
    fn passes_are_made_by_who_has_the_orders() {
        let mut console = console(Phase::Running);
        console.passes = Passes::with(8);
        let (mut events, mut stream) = (0, Stream::default());
        let mut handler = LinkHandler::new(&mut console, A, false, &mut events, &mut stream, NOW);
        let knots = [[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]];
        assert_eq!(handler.put_knots(0, &knots), Ok(()));
        assert_eq!(handler.put_knots(4, &knots), Err(Refusal::Word { index: 0 }));
        let knots: Vec<u8> = (1..=12_i32).flat_map(i32::to_le_bytes).collect();
        // Of a course of one knot, as long as there was no other.
        for (offset, piece) in [(0, &knots[..KNOT]), (KNOT, &[])] {
            let piece = Reply::Chunk { offset: offset as u32, total: KNOT as u32, bytes: Bytes(piece) };
            assert_eq!(handler.knots(offset as u32, Player::correction), Ok(piece));
        }
        // This controller has no correction: what is done otherwise ends with that.
        let done = Err(Refusal::Unsupported);
        assert_eq!(handler.pass(PassAction::Look), done);
        assert_eq!(handler.pass(PassAction::Abort), done);
        assert!(matches!(handler.console.outgoing().0.back(), Some(LoopCommand::AbortPass)));
        assert_eq!(handler.pass(PassAction::Learn { reach: 1, fade: [0, 0] }), Err(Refusal::State));
        let begin = PassAction::Begin { spacing: 1, before: 0, ticks: 2, trajectory: 0 };
        assert_eq!(handler.pass(begin), Err(Refusal::State));
        handler.host = B;
        assert_eq!(handler.pass(PassAction::Abort), Err(Refusal::Busy));
        assert_eq!(handler.pass(PassAction::Look), done);
        let mut away = self::console(Phase::Running);
        let mut handler = LinkHandler::new(&mut away, A, false, &mut events, &mut stream, NOW);
        assert_eq!(handler.knots(0, Player::errors), Err(Refusal::State));
    }
}
