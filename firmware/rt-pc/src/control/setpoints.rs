//! What the operator wants of the tick to come: the command, set-points of a wave, or what a pass corrects.

use controller::supervised::{Phase, Request};
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, Real, State, passes};
use specgen_link::EdgeStatus;
use specgen_runtime::pending::Pending;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::wave::{Settings, Stage};

use crate::handover::{Awaited, Player, Wish};
use crate::words::Command;

/// Command, wave and pass of the loop.
pub struct Setpoints {
    command: Command,
    request: Request,
    wave: Wave,
    /// Set-points given by waves so far: a new wave goes on counting, or its first would look like an old one's last.
    sequence: u32,
    waving: bool,
    /// Of the pass under way; or one that is over, until it is handed back.
    player: Option<Player>,
    /// The input line, and what waits for it.
    pending: Pending<Awaited>,
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
            pending: Pending::new(),
        }
    }

    /// During a pass the command is its own: only the request is taken.
    pub fn wish(&mut self, wish: Wish) {
        if let Some(command) = wish.command.filter(|_| !self.passes()) {
            self.pending.cancel();
            self.command = command;
        }
        self.request = wish.request;
    }

    /// The input line in a tick, as [`Pending::sense`].
    pub fn sense<E>(&mut self, high: Result<bool, E>) -> bool {
        self.pending.sense(high)
    }

    pub fn wait_for_edge(&mut self, awaited: Awaited) {
        self.pending.wait(awaited);
    }

    pub fn stop_waiting(&mut self) {
        self.pending.cancel();
    }

    /// How it stands with the input line.
    pub fn edge(&self) -> EdgeStatus {
        let pending = &self.pending;
        EdgeStatus { stage: pending.stage().word() as u8, edges: pending.edges(), tick: pending.tick() }
    }

    /// Behind a tick: begins what waited, with the next one, if the line rose in this one, which ended with this phase and status. A machine
    /// that does not run waits for nothing.
    pub fn begin_awaited(&mut self, tick: u64, phase: Phase, status: u32, config: &Config) {
        if phase != Phase::Running {
            self.pending.cancel();
        }
        let Some(awaited) = self.pending.due() else { return };
        let free = self.wave.stage() == Stage::Idle && !self.passes() && status & BUSY == 0;
        let begun = free
            && match awaited {
                Awaited::Command(command) => {
                    self.command = command;
                    true
                }
                Awaited::Wave(settings) => {
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

    /// Begins a wave, in place of what waits for the edge, if none is under way. What it asks for was looked at when it was ordered, and is looked at again here.
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

    /// Begins the pass that a player was told, if no wave is under way. The loop never has two.
    pub fn pass(&mut self, mut player: Player) {
        self.pending.cancel();
        if self.wave.stage() != Stage::Idle {
            player.abort();
        }
        if let Some(other) = self.player.replace(player) {
            // Not reached: there is one player. Released here it would be by the real-time thread.
            core::mem::forget(other);
        }
    }

    pub fn abort_pass(&mut self) {
        if let Some(player) = &mut self.player {
            player.abort();
        }
    }

    /// Keeps what a tick of a pass showed.
    pub fn keep(&mut self, state: &State, status: u32) {
        if let (Some(player), Some([target, pose])) = (&mut self.player, passes::shown(state)) {
            player.keep(&target, &pose, status);
        }
    }

    /// The player of a pass that is over: nothing is corrected from here on.
    pub fn take_player(&mut self) -> Option<Player> {
        let player = self.player.take_if(|player| !player.is_running())?;
        passes::end(&mut self.command);
        Some(player)
    }

    /// Back, where it could not be handed over yet.
    pub fn put_player(&mut self, player: Player) {
        self.player = Some(player);
    }

    /// Whether the last command was a wave's.
    pub fn waving(&self) -> bool {
        self.waving
    }

    /// Command of the tick to come. A machine that does not run, by its last `phase`, follows no wave and no pass: they end at once, for
    /// going on later would be a jump.
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
