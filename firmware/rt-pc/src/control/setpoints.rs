//! What the operator wants of the tick to come: the command, or set-points of a wave.

use controller::supervised::{Phase, Request};
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, Real};
use specgen_runtime::wave::{Settings, Stage};

use crate::handover::Wish;
use crate::words::Command;

/// Command and wave of the loop.
pub struct Setpoints {
    wish: Wish,
    wave: Wave,
    /// Set-points given by waves so far: a new wave goes on counting, or its first would look like an old one's last.
    sequence: u32,
    waving: bool,
}

impl Setpoints {
    pub fn new(config: &Config) -> Self {
        let wish = Wish { command: [0; COMMAND_WORDS], request: Request::None };
        Self { wish, wave: Wave::new(waves::limits(config)), sequence: 0, waving: false }
    }

    pub fn wish(&mut self, wish: Wish) {
        self.wish = wish;
    }

    pub fn request(&self) -> Request {
        self.wish.request
    }

    /// Begins a wave, if none is under way. What it asks for was looked at when it was ordered, and is looked at again here.
    pub fn start(&mut self, settings: &Settings<Real>, config: &Config) {
        if self.wave.stage() == Stage::Idle {
            self.wave = Wave::new(waves::limits(config));
            if self.wave.set(settings).is_ok() {
                self.wave.start();
            }
        }
    }

    pub fn stop(&mut self) {
        self.wave.stop();
    }

    /// Whether the last command was a wave's.
    pub fn waving(&self) -> bool {
        self.waving
    }

    /// Command of the tick to come. A machine that does not run, by its last `phase`, follows no wave: it ends at once, for
    /// going on with it later would be a jump.
    pub fn next(&mut self, phase: Phase, config: &Config) -> Command {
        let mut command = self.wish.command;
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
