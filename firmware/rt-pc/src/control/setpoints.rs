//! Source of the next tick's command: the operator's command, set-points of a wave, or corrections of a pass.

use controller::supervised::{Phase, Request};
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, Real, State, passes};
use specgen_link::EdgeStatus;
use specgen_runtime::pending::EdgeWait;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::wave::{Settings, Stage};

use crate::handover::{EdgeCommand, OperatorRequest, Player};
use crate::words::Command;

/// Command, wave and pass of the loop.
pub struct Setpoints {
    command: Command,
    request: Request,
    wave: Wave,
    /// Number of set-points from waves: a new wave continues the count, or its first set-point would look like an old
    /// one.
    sequence: u32,
    waving: bool,
    /// The player of the pass under way, or of a completed one until it is handed back.
    player: Option<Player>,
    /// The input line, and the command that waits for it.
    pending: EdgeWait<EdgeCommand>,
}

impl Setpoints {
    pub fn new(config: &Config) -> Self {
        Self {
            command: [0; COMMAND_WORDS],
            request: Request::None,
            wave: Wave::new(waves::limits(config)),
            sequence: 0,
            waving: false,
            player: None,
            pending: EdgeWait::new(),
        }
    }

    /// A pass has its own command: only the request is taken.
    pub fn wish(&mut self, wish: OperatorRequest) {
        if let Some(command) = wish.command.filter(|_| !self.passes()) {
            self.pending.cancel();
            self.command = command;
        }
        self.request = wish.request;
    }

    /// The input line in a tick, as [`EdgeWait::sense`].
    pub fn sense<E>(&mut self, high: Result<bool, E>) -> bool {
        self.pending.sense(high)
    }

    pub fn wait_for_edge(&mut self, awaited: EdgeCommand) {
        self.pending.wait(awaited);
    }

    pub fn stop_waiting(&mut self) {
        self.pending.cancel();
    }

    /// Status of the input line.
    pub fn edge(&self) -> EdgeStatus {
        let pending = &self.pending;
        EdgeStatus { stage: pending.stage().word() as u8, edges: pending.edges(), tick: pending.tick() }
    }

    /// After a tick with this phase and status: starts the waiting command with the next tick, if the line rose in this
    /// one. If the machine does not run, nothing waits.
    pub fn begin_awaited(&mut self, tick: u64, phase: Phase, status: u32, config: &Config) {
        if phase != Phase::Running {
            self.pending.cancel();
        }
        let Some(awaited) = self.pending.due() else { return };
        let free = self.wave.stage() == Stage::Idle && !self.passes() && status & BUSY == 0;
        let begun = free
            && match awaited {
                EdgeCommand::Command(command) => {
                    self.command = command;
                    true
                }
                EdgeCommand::Wave(settings) => {
                    let limits = waves::limits(config);
                    let may = waves::may_begin(status, &self.command, &settings.center, &limits).is_ok();
                    if may {
                        self.start(&settings, config);
                    }
                    may && self.wave.stage() != Stage::Idle
                }
            };
        self.pending.settle(tick, begun);
    }

    fn passes(&self) -> bool {
        self.player.as_ref().is_some_and(|player| player.is_running())
    }

    pub fn request(&self) -> Request {
        self.request
    }

    /// Starts a wave, if none is under way; it replaces a waiting command. Its limits were checked when it was
    /// requested, and are checked again here.
    pub fn start(&mut self, settings: &Settings<Real>, config: &Config) {
        self.pending.cancel();
        if self.wave.stage() == Stage::Idle {
            self.wave = Wave::new(waves::limits(config));
            if self.wave.set(settings).is_ok() {
                self.wave.start();
            }
        }
    }

    pub fn stop(&mut self) {
        self.pending.cancel();
        self.wave.stop();
    }

    /// Starts the pass that the player was prepared for, if no wave is under way. The loop never has two players.
    pub fn pass(&mut self, mut player: Player) {
        self.pending.cancel();
        if self.wave.stage() != Stage::Idle {
            player.abort();
        }
        if let Some(other) = self.player.replace(player) {
            // Not reached: there is one player. A release here would be in the real-time thread.
            core::mem::forget(other);
        }
    }

    pub fn abort_pass(&mut self) {
        if let Some(player) = &mut self.player {
            player.abort();
        }
    }

    /// Records a tick of a pass.
    pub fn keep(&mut self, state: &State, status: u32) {
        if let (Some(player), Some([target, pose])) = (&mut self.player, passes::shown(state)) {
            player.keep(&target, &pose, status);
        }
    }

    /// The player of a completed pass: the correction ends.
    pub fn take_player(&mut self) -> Option<Player> {
        let player = self.player.take_if(|player| !player.is_running())?;
        passes::end(&mut self.command);
        Some(player)
    }

    /// Takes it back if it could not be handed over yet.
    pub fn put_player(&mut self, player: Player) {
        self.player = Some(player);
    }

    /// Whether the last command was a wave's.
    pub fn waving(&self) -> bool {
        self.waving
    }

    /// Command of the next tick. If the machine does not run, by its last `phase`, wave and pass end at once: to
    /// continue later would be a jump.
    pub fn next(&mut self, phase: Phase, config: &Config) -> Command {
        if phase != Phase::Running {
            self.abort_pass();
        }
        if let Some(given) = self.player.as_mut().and_then(|player| player.give()) {
            passes::write(&given, &mut self.command);
        }
        let mut command = self.command;
        self.waving = false;
        if self.wave.stage() != Stage::Idle {
            if phase != Phase::Running {
                self.wave = Wave::new(waves::limits(config));
            } else if let Some(motion) = self.wave.advance() {
                self.sequence = self.sequence.wrapping_add(1);
                waves::write(&motion, self.sequence, &mut command);
                self.waving = true;
            }
        }
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_runtime::pass::{self, Course};
    use specgen_runtime::pending;
    use specgen_runtime::playback::Knot;

    const LOW: Result<bool, ()> = Ok(false);
    const HIGH: Result<bool, ()> = Ok(true);
    const COURSE: Course = Course { spacing: 1, before: 2, ticks: 5, trajectory: 9 };

    fn wave(ticks: i32) -> Settings<Real> {
        Settings { ticks, ..Settings::still() }
    }

    fn setpoints() -> (Setpoints, Config) {
        let config = Config::new();
        let mut setpoints = Setpoints::new(&config);
        setpoints.wish(OperatorRequest { command: Some([5; COMMAND_WORDS]), request: Request::Run });
        (setpoints, config)
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
        let (mut setpoints, config) = setpoints();
        assert_eq!(setpoints.request(), Request::Run);
        assert_eq!(setpoints.next(Phase::Running, &config), [5; COMMAND_WORDS]);
        assert!(!setpoints.waving());
        for first in [1, 11] {
            setpoints.start(&wave(10), &config);
            // Not in place of the one under way.
            setpoints.start(&wave(4), &config);
            for number in first..first + 10 {
                let command = setpoints.next(Phase::Running, &config);
                assert!(setpoints.waving());
                assert_eq!(command[..3], [1, 0, number], "a stream that goes on counting");
            }
            assert_eq!(setpoints.next(Phase::Running, &config), [5; COMMAND_WORDS]);
            assert!(!setpoints.waving());
        }
        setpoints.start(&wave(0), &config);
        assert_eq!(setpoints.next(Phase::Running, &config)[0], 1);
        setpoints.stop();
        let more = (0..100).take_while(|_| setpoints.next(Phase::Running, &config)[0] == 1).count();
        assert!(more < 10, "{more}");
        setpoints.start(&wave(0), &config);
        assert_eq!(setpoints.next(Phase::Holding, &config), [5; COMMAND_WORDS]);
        assert_eq!(setpoints.next(Phase::Running, &config), [5; COMMAND_WORDS], "it does not go on later");
    }

    #[test]
    fn a_wish_keeps_what_it_does_not_name() {
        let (mut setpoints, config) = setpoints();
        setpoints.wish(OperatorRequest { command: None, request: Request::Hold });
        assert_eq!((setpoints.request(), setpoints.next(Phase::Running, &config)), (Request::Hold, [5; COMMAND_WORDS]));
    }

    #[test]
    fn a_command_begins_behind_the_tick_in_which_the_line_rises() {
        let (mut setpoints, config) = setpoints();
        assert_eq!(stage(&setpoints), Some(pending::Stage::None));
        setpoints.wait_for_edge(EdgeCommand::Command([8; COMMAND_WORDS]));
        assert_eq!([HIGH, LOW, LOW].map(|line| tick(&mut setpoints, 1, line, 0)), [false; 3]);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Waiting));
        assert_eq!(setpoints.next(Phase::Running, &config), [5; COMMAND_WORDS]);
        assert!(tick(&mut setpoints, 44, HIGH, 0));
        assert_eq!(setpoints.next(Phase::Running, &config), [8; COMMAND_WORDS]);
        let edge = setpoints.edge();
        assert_eq!((stage(&setpoints), edge.edges, edge.tick), (Some(pending::Stage::Begun), 1, 44));
    }

    #[test]
    fn what_waits_is_refused_where_something_moves_and_dropped_by_other_orders() {
        let waits = || {
            let (mut setpoints, config) = setpoints();
            assert!(!setpoints.sense(LOW));
            (setpoints, config)
        };
        let await_it = |setpoints: &mut Setpoints| {
            setpoints.wait_for_edge(EdgeCommand::Command([8; COMMAND_WORDS]));
        };
        // A motion, a wave, a pass.
        let (mut setpoints, config) = waits();
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, BUSY);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        let (mut setpoints, _) = waits();
        setpoints.start(&wave(0), &config);
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, 0);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        let (mut setpoints, _) = waits();
        setpoints.pass(player());
        await_it(&mut setpoints);
        tick(&mut setpoints, 1, HIGH, 0);
        assert_eq!(stage(&setpoints), Some(pending::Stage::Refused));
        // Other orders, and a machine that does not run.
        let orders: [fn(&mut Setpoints); 6] = [
            |setpoints| setpoints.stop_waiting(),
            |setpoints| setpoints.wish(OperatorRequest { command: Some([1; COMMAND_WORDS]), request: Request::None }),
            |setpoints| setpoints.start(&wave(9), &Config::new()),
            |setpoints| setpoints.stop(),
            |setpoints| setpoints.pass(player()),
            |setpoints| setpoints.begin_awaited(3, Phase::Holding, 0, &Config::new()),
        ];
        for order in orders {
            let (mut setpoints, _) = waits();
            await_it(&mut setpoints);
            order(&mut setpoints);
            assert_eq!(stage(&setpoints), Some(pending::Stage::Dropped));
            tick(&mut setpoints, 1, HIGH, 0);
            assert_eq!(stage(&setpoints), Some(pending::Stage::Dropped));
        }
    }

    #[test]
    fn a_wave_begins_behind_the_edge_if_it_may() {
        for (command, settings, stage_then) in [
            (0, wave(10), pending::Stage::Begun),
            // Under a trajectory, and far beyond the workspace.
            (3, wave(10), pending::Stage::Refused),
            (0, Settings { center: [1.0; 6], ..wave(10) }, pending::Stage::Refused),
        ] {
            let (mut setpoints, config) = setpoints();
            setpoints.wish(OperatorRequest { command: Some([command; COMMAND_WORDS]), request: Request::None });
            setpoints.wait_for_edge(EdgeCommand::Wave(settings));
            tick(&mut setpoints, 1, LOW, 0);
            tick(&mut setpoints, 2, HIGH, 0);
            assert_eq!(stage(&setpoints), Some(stage_then));
            setpoints.next(Phase::Running, &config);
            assert_eq!(setpoints.waving(), stage_then == pending::Stage::Begun);
        }
    }

    #[test]
    fn a_pass_commands_alone_and_its_player_comes_back() {
        let (mut setpoints, config) = setpoints();
        setpoints.pass(player());
        assert!(setpoints.take_player().is_none(), "under way");
        setpoints.wish(OperatorRequest { command: Some([7; COMMAND_WORDS]), request: Request::Hold });
        assert_eq!(setpoints.request(), Request::Hold);
        let state = controller::state_at_reset();
        for number in 0..6 {
            let command = setpoints.next(Phase::Running, &config);
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
                setpoints.next(Phase::Holding, &Config::new());
            },
        ];
        for end in ends {
            let (mut setpoints, config) = setpoints();
            setpoints.pass(player());
            setpoints.next(Phase::Running, &config);
            assert!(setpoints.take_player().is_none());
            end(&mut setpoints);
            assert!(setpoints.take_player().is_some_and(|player| player.stage() == pass::Stage::Aborted));
        }
        let (mut setpoints, config) = setpoints();
        setpoints.start(&wave(0), &config);
        setpoints.pass(player());
        assert!(setpoints.take_player().is_some_and(|player| player.stage() == pass::Stage::Aborted));
    }
}
