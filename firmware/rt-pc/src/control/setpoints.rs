//! Source of the next tick's command: the operator's command, set-points of a wave, or corrections of a pass.

use controller::supervised::{Phase, Request};
use controller::waves::Wave;
use controller::{COMMAND_WORDS, Config, State};
use specgen_board::{EdgeCommand, Source};
use specgen_link::EdgeStatus;

use crate::handover::{OperatorRequest, Player};
use crate::words::Command;

/// Command, wave and pass of the loop.
pub struct Setpoints {
    command: Command,
    request: Request,
    /// Its player is that of the pass under way, or of a completed one until it is handed back.
    source: Source<Player>,
    /// Number of set-points from waves: a new wave continues the count, or its first set-point would look like an old
    /// one.
    sequence: u32,
    waving: bool,
}

impl Setpoints {
    pub fn new() -> Self {
        let command = [0; COMMAND_WORDS];
        Self { command, request: Request::None, source: Source::at_reset(), sequence: 0, waving: false }
    }

    /// A pass has its own command: only the request is taken.
    pub fn accept(&mut self, wish: OperatorRequest) {
        if let Some(command) = wish.command.filter(|_| !self.source.passes()) {
            self.source.cancel_awaited();
            self.command = command;
        }
        self.request = wish.request;
    }

    /// The input line in a tick, as [`specgen_runtime::pending::EdgeWait::sense`].
    pub fn sense<E>(&mut self, high: Result<bool, E>) -> bool {
        self.source.pending.sense(high)
    }

    /// A wave under way stays: at the edge, the command is then refused.
    pub fn wait_for_edge(&mut self, awaited: EdgeCommand, mut wave: Option<Wave>) {
        if !self.source.waves() {
            if let Some(wave) = &mut wave {
                wave.count_from(self.sequence);
            }
            self.source.wave = wave;
        }
        self.source.pending.wait(awaited);
    }

    pub fn stop_waiting(&mut self) {
        self.source.cancel_awaited();
    }

    /// Status of the input line.
    pub fn edge(&self) -> EdgeStatus {
        self.source.edge()
    }

    /// After a tick with this phase and status, as [`Source::begin_awaited`].
    pub fn begin_awaited(&mut self, tick: u64, phase: Phase, status: u32, config: &Config) {
        self.source.begin_awaited(tick, phase, status, config, &mut self.command);
    }

    pub fn request(&self) -> Request {
        self.request
    }

    /// Starts a wave, if none is under way; it replaces a waiting command.
    pub fn start(&mut self, mut wave: Wave) {
        self.source.cancel_awaited();
        if !self.source.waves() {
            wave.count_from(self.sequence);
            wave.start();
            self.source.wave = Some(wave);
        }
    }

    pub fn stop(&mut self) {
        self.source.stop_wave();
    }

    /// Starts the pass that the player was prepared for, if no wave is under way. The loop never has two players.
    pub fn pass(&mut self, mut player: Player) {
        self.source.cancel_awaited();
        if self.source.waves() {
            player.abort();
        }
        if let Some(other) = self.source.player.replace(player) {
            // Not reached: there is one player. A release here would be in the real-time thread.
            core::mem::forget(other);
        }
    }

    pub fn abort_pass(&mut self) {
        self.source.abort_pass(&mut self.command);
    }

    /// Records a tick of a pass.
    pub fn keep(&mut self, state: &State, status: u32) {
        self.source.keep_pass(state, status, &mut self.command);
    }

    /// The player of a completed pass.
    pub fn take_player(&mut self) -> Option<Player> {
        self.source.player.take_if(|player| !player.is_running())
    }

    /// Takes it back if it could not be handed over yet.
    pub fn put_player(&mut self, player: Player) {
        self.source.player = Some(player);
    }

    /// Whether the last command was a wave's.
    pub fn waving(&self) -> bool {
        self.waving
    }

    /// Command of the next tick. If the machine does not run, by its last `phase`, wave and pass end at once.
    pub fn next(&mut self, phase: Phase) -> Command {
        self.source.advance_pass(phase, &mut self.command);
        let mut command = self.command;
        self.waving = self.source.advance_wave(phase, &mut command);
        self.sequence = self.sequence.wrapping_add(u32::from(self.waving));
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::{Real, waves};
    use specgen_runtime::pass::{self, Course};
    use specgen_runtime::pending;
    use specgen_runtime::playback::Knot;
    use specgen_runtime::setpoint::BUSY;
    use specgen_runtime::wave::Settings;

    const LOW: Result<bool, ()> = Ok(false);
    const HIGH: Result<bool, ()> = Ok(true);
    const COURSE: Course = Course { spacing: 1, before: 2, ticks: 5, trajectory: 9 };

    fn wave_of(settings: &Settings<Real>) -> Wave {
        let mut wave = Wave::new(waves::limits(&Config::new()));
        wave.set(settings).unwrap();
        wave
    }

    fn wave(ticks: i32) -> Wave {
        wave_of(&Settings { ticks, ..Settings::still() })
    }

    fn setpoints() -> Setpoints {
        let mut setpoints = Setpoints::new();
        setpoints.accept(OperatorRequest { command: Some([5; COMMAND_WORDS]), request: Request::Run });
        setpoints
    }

    fn player() -> Player {
        let memory: &'static mut [Knot] = vec![[0; 6]; 16].leak();
        let mut player = Box::new(pass::Player::new(memory));
        assert!(player.begin(COURSE));
        player
    }

    fn stage(setpoints: &Setpoints) -> Option<pending::Stage> {
        pending::Stage::from_word(setpoints.edge().stage.into())
    }

    /// A tick of a machine that runs, in which the line is high or low.
    fn tick(setpoints: &mut Setpoints, number: u64, line: Result<bool, ()>, status: u32) -> bool {
        let rose = setpoints.sense(line);
        setpoints.begin_awaited(number, Phase::Running, status, &Config::new());
        rose
    }

    #[test]
    fn a_wave_gives_numbered_setpoints_and_then_the_command_again() {
        let mut setpoints = setpoints();
        assert_eq!(setpoints.request(), Request::Run);
        assert_eq!(setpoints.next(Phase::Running), [5; COMMAND_WORDS]);
        assert!(!setpoints.waving());
        for first in [1, 11] {
            setpoints.start(wave(10));
            // Not in place of the one under way.
            setpoints.start(wave(4));
            for number in first..first + 10 {
                let command = setpoints.next(Phase::Running);
                assert!(setpoints.waving());
                assert_eq!(command[..3], [1, 0, number], "a stream that goes on counting");
            }
            assert_eq!(setpoints.next(Phase::Running), [5; COMMAND_WORDS]);
            assert!(!setpoints.waving());
        }
        setpoints.start(wave(0));
        assert_eq!(setpoints.next(Phase::Running)[0], 1);
        setpoints.stop();
        let more = (0..100).take_while(|_| setpoints.next(Phase::Running)[0] == 1).count();
        assert!(more < 10, "{more}");
        setpoints.start(wave(0));
        assert_eq!(setpoints.next(Phase::Holding), [5; COMMAND_WORDS]);
        assert_eq!(setpoints.next(Phase::Running), [5; COMMAND_WORDS], "it does not go on later");
    }

    #[test]
    fn a_wish_keeps_what_it_does_not_name() {
        let mut setpoints = setpoints();
        setpoints.accept(OperatorRequest { command: None, request: Request::Hold });
        assert_eq!((setpoints.request(), setpoints.next(Phase::Running)), (Request::Hold, [5; COMMAND_WORDS]));
    }

    #[test]
    fn a_command_begins_behind_the_tick_in_which_the_line_rises() {
        let mut setpoints = setpoints();
        assert_eq!(stage(&setpoints), Some(pending::Stage::None));
        setpoints.wait_for_edge(EdgeCommand::Command([8; COMMAND_WORDS]), None);
        assert_eq!([HIGH, LOW, LOW].map(|line| tick(&mut setpoints, 1, line, 0)), [false; 3]);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Waiting));
        assert_eq!(setpoints.next(Phase::Running), [5; COMMAND_WORDS]);
        assert!(tick(&mut setpoints, 44, HIGH, 0));
        assert_eq!(setpoints.next(Phase::Running), [8; COMMAND_WORDS]);
        let edge = setpoints.edge();
        assert_eq!((stage(&setpoints), edge.edges, edge.tick), (Some(pending::Stage::Begun), 1, 44));
    }

    #[test]
    fn what_waits_is_refused_where_something_moves_and_dropped_by_other_commands() {
        let waits = || {
            let mut setpoints = setpoints();
            assert!(!setpoints.sense(LOW));
            setpoints
        };
        let await_it = |setpoints: &mut Setpoints| {
            setpoints.wait_for_edge(EdgeCommand::Command([8; COMMAND_WORDS]), None);
        };
        // A motion, a wave, a pass.
        let mut setpoints = waits();
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, BUSY);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        let mut setpoints = waits();
        setpoints.start(wave(0));
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, 0);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        let mut setpoints = waits();
        setpoints.pass(player());
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, 0);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        // Other commands, and a machine that does not run.
        let commands: [fn(&mut Setpoints); 6] = [
            |setpoints| setpoints.stop_waiting(),
            |setpoints| setpoints.accept(OperatorRequest { command: Some([1; COMMAND_WORDS]), request: Request::None }),
            |setpoints| setpoints.start(wave(9)),
            |setpoints| setpoints.stop(),
            |setpoints| setpoints.pass(player()),
            |setpoints| setpoints.begin_awaited(3, Phase::Holding, 0, &Config::new()),
        ];
        for order in commands {
            let mut setpoints = waits();
            await_it(&mut setpoints);
            order(&mut setpoints);
            assert_eq!(stage(&setpoints), Some(pending::Stage::Dropped));
            tick(&mut setpoints, 1, HIGH, 0);
            assert_eq!(stage(&setpoints), Some(pending::Stage::Dropped));
        }
    }

    #[test]
    fn a_wave_begins_behind_the_edge_if_it_may() {
        // At rest, and under a trajectory.
        for (command, stage_then) in [(0, pending::Stage::Begun), (3, pending::Stage::Refused)] {
            let mut setpoints = setpoints();
            setpoints.accept(OperatorRequest { command: Some([command; COMMAND_WORDS]), request: Request::None });
            setpoints.wait_for_edge(EdgeCommand::Wave, Some(wave(10)));
            tick(&mut setpoints, 1, LOW, 0);
            tick(&mut setpoints, 2, HIGH, 0);
            assert_eq!(stage(&setpoints), Some(stage_then));
            setpoints.next(Phase::Running);
            assert_eq!(setpoints.waving(), stage_then == pending::Stage::Begun);
        }
    }

    #[test]
    fn a_pass_commands_alone_and_its_player_comes_back() {
        let mut setpoints = setpoints();
        setpoints.pass(player());
        assert!(setpoints.take_player().is_none(), "under way");
        setpoints.accept(OperatorRequest { command: Some([7; COMMAND_WORDS]), request: Request::Hold });
        assert_eq!(setpoints.request(), Request::Hold);
        let state = controller::state_at_reset();
        for number in 0..6 {
            let command = setpoints.next(Phase::Running);
            assert_eq!((command[0], command[1]), if number < 2 { (5, 5) } else { (3, 9) }, "{number}");
            setpoints.keep(&state, 64);
        }
        let player = setpoints.take_player().unwrap();
        assert_eq!((player.stage(), player.status(), player.errors().len()), (pass::Stage::Complete, 64, 5));
        setpoints.put_player(player);
        assert!(setpoints.take_player().is_some_and(|player| player.begun() == Some(9)));
        assert!(setpoints.take_player().is_none());
    }

    #[test]
    fn a_pass_ends_when_told_with_the_machine_and_under_a_wave() {
        let ends: [fn(&mut Setpoints); 2] = [
            |setpoints| setpoints.abort_pass(),
            |setpoints| {
                setpoints.next(Phase::Holding);
            },
        ];
        for end in ends {
            let mut setpoints = setpoints();
            setpoints.pass(player());
            setpoints.next(Phase::Running);
            assert!(setpoints.take_player().is_none());
            end(&mut setpoints);
            assert!(setpoints.take_player().is_some_and(|player| player.stage() == pass::Stage::Aborted));
        }
        let mut setpoints = setpoints();
        setpoints.start(wave(0));
        setpoints.pass(player());
        assert!(setpoints.take_player().is_some_and(|player| player.stage() == pass::Stage::Aborted));
    }
}
