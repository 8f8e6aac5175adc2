//! Everything that can be requested of a run, from any source: operator, settings, waves, recorder. Work for the loop
//! goes out as commands, in the order of the requests.

use std::collections::VecDeque;

use controller::supervised::Phase;
use controller::waves::{self, Wave};
use controller::{Config, GAUGE_FAULT, PLACE_WORDS, Real, passes};
use specgen_board::{EdgeCommand, wave_refusal};
use specgen_link::{EdgeStatus, Health, Refusal};
use specgen_runtime::pass::Course;
use specgen_runtime::pending::{self, EDGE};
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::Settings;

use crate::capture::{CAPACITY, Capture};
use crate::handover::{LoopCommand, Player, Row};
use crate::operator::{Arbiter, SupervisorReport};
use crate::passes::Passes;
use crate::words::Command;

/// Commands that may wait for room in the ring: the loop takes one a tick.
const MOST_COMMANDS: usize = 64;

pub struct Console {
    pub operator: Arbiter,
    pub capture: Capture,
    pub passes: Passes,
    pub said: Option<SupervisorReport>,
    /// Pose and set-point at that time.
    pub place: [u64; PLACE_WORDS],
    /// Time of that tick, and of the last one with valid gauges, ns.
    pub ticked: Option<u64>,
    pub measured: Option<u64>,
    /// Health of the loop.
    pub health: Health,
    /// Number of stops from hosts.
    pub stops: u64,
    /// Settings in force once all commands are taken.
    config: Config,
    /// Events that were not yet reported over the link.
    events: u32,
    commands: VecDeque<LoopCommand>,
    /// Number of the last queued command; the first is 1.
    number: u32,
    /// Number of the command that started the last wave.
    wave: Option<u32>,
    /// Status of the input line.
    pub edge: EdgeStatus,
    /// Number of the last command that waits for it, and the command itself; none for a wave.
    awaited: Option<(u32, Option<Command>)>,
}

impl Console {
    /// At the start, with the settings of the run.
    pub fn new(operator: Arbiter, capture: Capture, config: Config) -> Self {
        let health = Health::default();
        Self {
            operator,
            capture,
            passes: Passes::new(),
            said: None,
            place: [0; PLACE_WORDS],
            ticked: None,
            measured: None,
            health,
            stops: 0,
            config,
            events: 0,
            commands: VecDeque::new(),
            number: 0,
            wave: None,
            edge: EdgeStatus::NONE,
            awaited: None,
        }
    }

    /// Takes a tick's results, at this time, ns.
    pub fn update(&mut self, row: &Row, said: SupervisorReport, now: u64) {
        self.said = Some(said);
        self.place = row.place;
        self.ticked = Some(now);
        if said.status & GAUGE_FAULT == 0 {
            self.measured = Some(now);
        }
        self.events |= row.input.events & !EDGE;
        self.edge = row.edge;
        self.capture.update(row.recorded, row.triggered);
        let taken = |number: u32| (said.commands.wrapping_sub(number) as i32) >= 0;
        if let Some((number, command)) = self.awaited.filter(|(number, _)| taken(*number)) {
            let stage = pending::Stage::from_word(u64::from(row.edge.stage));
            match (stage, command) {
                (Some(pending::Stage::Waiting), _) => {}
                (Some(pending::Stage::Begun), Some(command)) => self.operator.has_begun_at_edge(&command),
                (Some(pending::Stage::Begun), None) => self.wave = Some(number),
                _ => {}
            }
            if stage != Some(pending::Stage::Waiting) {
                self.awaited = None;
            }
        }
        if !said.waving && self.wave.is_some_and(taken) {
            self.wave = None;
        }
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Events since the last call.
    pub fn take_events(&mut self) -> u32 {
        std::mem::take(&mut self.events)
    }

    /// Other settings from the next tick on.
    pub fn configure(&mut self, config: Config) {
        self.config = config;
        self.queue(LoopCommand::Configure(config));
    }

    /// Whether the control law runs, as far as is known.
    pub fn runs(&self) -> bool {
        self.said.is_some_and(|said| said.phase == Phase::Running)
    }

    /// Whether the machine follows commands, as far as is known.
    pub fn is_commanded(&self) -> bool {
        self.said.is_some_and(|said| said.phase.is_commanded())
    }

    /// Cancels motions that have not been sent to the loop.
    pub fn stop(&mut self) {
        self.stops += 1;
        let mut number = self.number.wrapping_sub(self.commands.len() as u32);
        for order in &mut self.commands {
            number = number.wrapping_add(1);
            match order {
                LoopCommand::Request(wish) => wish.command = None,
                LoopCommand::Wave(_) | LoopCommand::Await(..) => {
                    // In its place, so that numbers are unchanged.
                    *order = LoopCommand::StopWave;
                    self.wave.take_if(|wave| *wave == number);
                    self.awaited.take_if(|(awaited, _)| *awaited == number);
                }
                _ => {}
            }
        }
    }

    /// Whether a wave or a pass is under way, which commands in place of hosts.
    pub fn is_engaged(&self) -> bool {
        self.wave.is_some() || self.passes.is_running()
    }

    /// Begins a wave.
    ///
    /// # Errors
    /// If the machine does not run, or plays something else; if a wave or a pass is under way; or the word of the axis
    /// that would exceed its limits.
    pub fn start_wave(&mut self, settings: &Settings<Real>, on_edge: bool) -> Result<(), Refusal> {
        let commanded = self.said.filter(|said| said.phase.is_commanded() && !self.is_engaged());
        let said = commanded.ok_or(Refusal::State)?;
        let drives = said.phase == Phase::Driving;
        let limits = if drives { waves::drive_limits } else { waves::limits }(&self.config);
        let mut wave = Wave::new(limits).of_drive(drives);
        wave.set(settings).map_err(wave_refusal)?;
        let is_there = if drives {
            !on_edge && waves::may_drive(&self.place, &settings.center, &limits)
        } else {
            waves::may_begin(said.status, self.operator.command(), &settings.center, &limits).is_ok()
        };
        if !is_there {
            return Err(Refusal::State);
        }
        // The command after the wave is sent first.
        self.operator.rest_at(&settings.center);
        self.take_pending();
        if on_edge {
            let number = self.queue(LoopCommand::Await(EdgeCommand::Wave, Some(wave)));
            self.awaited = Some((number, None));
        } else {
            self.wave = Some(self.queue(LoopCommand::Wave(wave)));
        }
        Ok(())
    }

    /// Makes a command wait for the edge of the input line.
    ///
    /// # Errors
    /// If the machine does not run at rest, or a wave or a pass is under way.
    pub fn command_on_edge(&mut self, command: Command) -> Result<(), Refusal> {
        let rests = self
            .said
            .is_some_and(|said| said.phase == Phase::Running && said.status & specgen_runtime::setpoint::BUSY == 0);
        if !rests || self.is_engaged() {
            return Err(Refusal::State);
        }
        self.take_pending();
        let number = self.queue(LoopCommand::Await(EdgeCommand::Command(command), None));
        self.awaited = Some((number, Some(command)));
        Ok(())
    }

    /// Removes the waiting command.
    pub fn stop_waiting(&mut self) {
        self.queue(LoopCommand::StopWaiting);
    }

    /// Stops the wave, if there is one.
    pub fn stop_wave(&mut self) {
        self.queue(LoopCommand::StopWave);
    }

    /// Stores knots of the correction of passes.
    ///
    /// # Errors
    /// If a pass or learning is under way, or they do not fit.
    pub fn put_knots(&mut self, first: u32, knots: &[Knot]) -> Result<(), Refusal> {
        match self.passes.is_busy() {
            true => Err(Refusal::State),
            false if self.passes.put(first, knots.iter().copied()) => Ok(()),
            false => Err(Refusal::Word { index: 0 }),
        }
    }

    /// Begins a pass.
    ///
    /// # Errors
    /// If the machine does not run at rest, a wave or a pass is under way, or the pass is invalid or too long.
    pub fn begin_pass(&mut self, course: Course) -> Result<(), Refusal> {
        let running = self.said.filter(|said| said.phase == Phase::Running);
        let said = running.filter(|_| !self.is_engaged()).ok_or(Refusal::State)?;
        if !passes::may_begin(said.status, self.operator.command()) {
            return Err(Refusal::State);
        }
        let player = self.passes.begin(course).ok_or(Refusal::Word { index: 0 })?;
        self.take_pending();
        self.queue(LoopCommand::Pass(player));
        Ok(())
    }

    /// Ends the pass under way, if there is one.
    pub fn abort_pass(&mut self) {
        self.queue(LoopCommand::AbortPass);
    }

    /// Takes the player back. The trajectory that its pass began becomes the command, while the machine runs.
    pub fn receive_player(&mut self, player: Player) {
        if let Some(trajectory) = self.passes.receive(player) {
            if self.runs() {
                self.operator.has_begun(trajectory);
            }
        }
    }

    /// Records again, until `after` ticks after the trigger.
    ///
    /// # Errors
    /// If that many do not fit.
    pub fn arm_recorder(&mut self, after: u32) -> Result<(), Refusal> {
        if after > CAPACITY {
            return Err(Refusal::Word { index: 0 });
        }
        let order = self.capture.arm(after, self.number.wrapping_add(1));
        self.queue(order);
        Ok(())
    }

    pub fn trigger_recorder(&mut self) {
        self.queue(LoopCommand::Trigger);
    }

    pub fn stop_recorder(&mut self) {
        self.queue(LoopCommand::StopRecorder);
    }

    /// Whether the queue of commands is full.
    pub fn is_full(&self) -> bool {
        self.commands.len() >= MOST_COMMANDS
    }

    /// Queues a command; returns its number.
    pub fn queue(&mut self, order: LoopCommand) -> u32 {
        self.number = self.number.wrapping_add(1);
        self.commands.push_back(order);
        self.number
    }

    /// Queues the operator's request, if it changed.
    pub fn take_pending(&mut self) {
        if let Some(wish) = self.operator.take_pending() {
            self.queue(LoopCommand::Request(wish));
        }
    }

    /// Commands that are not sent yet, the oldest first, and the number of the oldest.
    pub fn outgoing(&mut self) -> (&mut VecDeque<LoopCommand>, u32) {
        let first = self.number.wrapping_sub(self.commands.len() as u32).wrapping_add(1);
        (&mut self.commands, first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::{row, said};
    use crate::handover::OperatorRequest;
    use crate::operator::Timeout;
    use controller::COMMAND_WORDS;
    use controller::supervised::Request;

    fn console(phase: Phase) -> Console {
        let operator = Arbiter::new(true, Timeout { silence: 1, idle: 1 });
        let mut console = Console::new(operator, Capture::new(None).unwrap().0, Config::new());
        console.said = Some(said(phase));
        console
    }

    /// A machine that runs, shown with so many commands taken.
    fn show(console: &mut Console, commands: u32, change: impl Fn(&mut Row, &mut SupervisorReport)) {
        let (mut row, mut said) = (row(1), SupervisorReport { commands, ..said(Phase::Running) });
        change(&mut row, &mut said);
        console.update(&row, said, 5);
    }

    #[test]
    fn a_tick_shows_events_until_they_are_taken_and_when_gauges_were_believed() {
        let mut console = console(Phase::Holding);
        for (number, (events, status)) in (0..).zip([(1 | EDGE, 0), (8, GAUGE_FAULT), (0, GAUGE_FAULT), (0, 1)]) {
            let mut row = row(number);
            (row.input.events, row.place[3]) = (events, number);
            (row.recorded, row.triggered) = (Some(number), number > 1);
            console.update(&row, SupervisorReport { status, tick: number, ..said(Phase::Holding) }, number * 10);
            assert_eq!((console.place[3], console.ticked), (number, Some(number * 10)));
            assert_eq!(console.measured, Some(if number < 3 { 0 } else { 30 }));
            assert_eq!(console.said.unwrap().tick, number);
        }
        assert_eq!((console.take_events(), console.take_events()), (9, 0));
        let standing = console.capture.standing();
        assert_eq!((standing.running, standing.triggered, standing.ticks), (true, true, 3));
        assert!(!console.runs());
        console.said = None;
        assert!(!console.runs());
    }

    #[test]
    fn a_stop_takes_back_what_would_move_and_leaves_the_numbers() {
        let mut console = console(Phase::Running);
        console.operator.take_pending();
        console.queue(LoopCommand::Trigger);
        console
            .queue(LoopCommand::Request(OperatorRequest { command: Some([7; COMMAND_WORDS]), request: Request::Run }));
        console.start_wave(&Settings::still(), true).unwrap();
        console.start_wave(&Settings::still(), false).unwrap();
        assert_eq!(console.command_on_edge([1; COMMAND_WORDS]), Err(Refusal::State), "under a wave");
        let numbers = (console.outgoing().0.len(), console.outgoing().1);
        assert!(console.is_engaged());
        console.stop();
        assert_eq!((console.stops, console.is_engaged()), (1, false));
        assert_eq!((console.outgoing().0.len(), console.outgoing().1), numbers);
        for order in console.outgoing().0.iter() {
            let moves = match order {
                LoopCommand::Request(wish) => wish.command.is_some(),
                LoopCommand::Wave(_) | LoopCommand::Await(..) => true,
                _ => false,
            };
            assert!(!moves, "{order:?}");
        }
        assert!(matches!(console.outgoing().0.front(), Some(LoopCommand::Trigger)));
        console.stop();
        assert_eq!(console.stops, 2);
    }

    #[test]
    fn a_stop_leaves_what_the_loop_already_has() {
        let mut console = console(Phase::Running);
        console.start_wave(&Settings::still(), false).unwrap();
        console.outgoing().0.clear();
        // Numbers go on behind what was sent.
        assert_eq!(console.outgoing().1, 3);
        console.queue(LoopCommand::Trigger);
        console.stop();
        assert!(console.is_engaged(), "the wave is under way until a tick shows that it is not");
        show(&mut console, 1, |_, _| {});
        assert!(console.is_engaged(), "that tick ran before the order");
        show(&mut console, 2, |_, said| said.waving = true);
        assert!(console.is_engaged());
        show(&mut console, 2, |_, _| {});
        assert!(!console.is_engaged());
    }

    #[test]
    fn a_wave_or_a_command_begins_from_a_machine_that_runs_at_rest() {
        let still = Settings::still();
        assert_eq!(console(Phase::Holding).start_wave(&still, false), Err(Refusal::State));
        assert_eq!(console(Phase::Holding).command_on_edge([0; COMMAND_WORDS]), Err(Refusal::State));
        let mut console = console(Phase::Running);
        console.said = Some(SupervisorReport { status: specgen_runtime::setpoint::BUSY, ..said(Phase::Running) });
        assert_eq!(console.start_wave(&still, false), Err(Refusal::State));
        assert_eq!(console.command_on_edge([0; COMMAND_WORDS]), Err(Refusal::State));
        console.said = Some(said(Phase::Running));
        let mut far = still;
        far.center[1] = 1.0;
        assert!(matches!(console.start_wave(&far, false), Err(Refusal::Word { index: _ })));
        assert!(console.outgoing().0.is_empty());
        console.operator.set_by_link([1; COMMAND_WORDS]);
        console.start_wave(&still, false).unwrap();
        // What is wanted once it is over goes first: to hold.
        let commands = console.outgoing().0;
        assert!(
            matches!(commands[0], LoopCommand::Request(OperatorRequest { command: Some(command), .. }) if command[0] == 0)
        );
        assert!(matches!(commands[1], LoopCommand::Wave(_)));
        console.stop_wave();
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::StopWave)));
    }

    #[test]
    fn a_wave_of_voltages_begins_where_the_legs_are() {
        let mut wave = Settings { center: [30.0; 6], ..Settings::still() };
        let mut console = console(Phase::Driving);
        assert_eq!(console.start_wave(&wave, false), Err(Refusal::State), "the legs are at 0 V");
        console.place[18..].fill((30.0 as Real).to_bits());
        assert_eq!(console.start_wave(&wave, true), Err(Refusal::State), "at an edge");
        wave.axes[3].offset = 400.0;
        assert!(matches!(console.start_wave(&wave, false), Err(Refusal::Word { index: _ })));
        wave.axes[3].offset = 0.0;
        console.start_wave(&wave, false).unwrap();
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::Wave(_))));
        let mut running = self::console(Phase::Running);
        assert!(matches!(running.start_wave(&wave, false), Err(Refusal::Word { index: _ })), "30 V are no 30 m");
    }

    #[test]
    fn what_waits_for_the_edge_is_followed_once_it_has_begun() {
        let edge = |stage: pending::Stage| EdgeStatus { stage: stage.word() as u8, ..EdgeStatus::NONE };
        for (stage, begun) in [(pending::Stage::Begun, true), (pending::Stage::Refused, false)] {
            let mut console = console(Phase::Running);
            console.command_on_edge([6; COMMAND_WORDS]).unwrap();
            let number = console.number;
            show(&mut console, number - 1, |row, _| row.edge = edge(pending::Stage::Begun));
            assert_eq!(console.operator.command()[5], 0, "of an order before it");
            show(&mut console, number, |row, _| row.edge = edge(pending::Stage::Waiting));
            assert!(console.awaited.is_some() && console.operator.command()[5] == 0);
            show(&mut console, number, |row, _| row.edge = edge(stage));
            assert_eq!((console.awaited.is_some(), console.operator.command()[5]), (false, if begun { 6 } else { 0 }));
            assert_eq!(console.edge.stage, stage.word() as u8);

            let mut console = self::console(Phase::Running);
            console.start_wave(&Settings::still(), true).unwrap();
            assert!(!console.is_engaged());
            let number = console.number;
            show(&mut console, number, |row, said| (row.edge, said.waving) = (edge(stage), true));
            assert_eq!(console.is_engaged(), begun);
        }
        let mut console = console(Phase::Running);
        console.stop_waiting();
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::StopWaiting)));
    }

    #[test]
    fn a_pass_takes_the_player_along_and_what_it_began_is_commanded() {
        let mut console = console(Phase::Running);
        assert_eq!(console.put_knots(0, &[[1; 6]]), Err(Refusal::Word { index: 0 }), "there is no player");
        console.passes = Passes::with(8);
        assert_eq!(console.put_knots(0, &[[1; 6]]), Ok(()));
        assert_eq!(console.put_knots(9, &[[1; 6]]), Err(Refusal::Word { index: 0 }));
        let course = Course { spacing: 1, before: 0, ticks: 2, trajectory: 3 };
        // This controller takes no correction, and so makes no pass.
        assert_eq!(console.begin_pass(course), Err(Refusal::State));
        console.abort_pass();
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::AbortPass)));
        for (phase, expected) in [(Phase::Holding, 0), (Phase::Running, 3)] {
            let mut player = console.passes.begin(course).unwrap();
            let _ = player.give();
            player.abort();
            console.said = Some(said(phase));
            console.receive_player(player);
            assert_eq!(console.operator.command()[1], expected);
        }
    }

    #[test]
    fn there_is_room_for_so_many_commands_and_for_so_many_ticks() {
        let mut console = console(Phase::Holding);
        assert_eq!(console.arm_recorder(CAPACITY + 1), Err(Refusal::Word { index: 0 }));
        assert_eq!(console.arm_recorder(CAPACITY), Ok(()));
        console.trigger_recorder();
        console.stop_recorder();
        let commands: Vec<_> = console.outgoing().0.iter().collect();
        assert!(matches!(commands[..], [LoopCommand::Record(_), LoopCommand::Trigger, LoopCommand::StopRecorder]));
        for number in 4..=MOST_COMMANDS as u32 {
            assert!(!console.is_full());
            assert_eq!(console.queue(LoopCommand::Trigger), number);
        }
        assert!(console.is_full());
        console.outgoing().0.clear();
        console.take_pending();
        console.take_pending();
        assert!(matches!(console.outgoing(), (commands, 65) if commands.len() == 1));
        let config = Config::new();
        console.configure(config);
        assert!(matches!(console.outgoing().0.back(), Some(LoopCommand::Configure(_))) && *console.config() == config);
    }
}
