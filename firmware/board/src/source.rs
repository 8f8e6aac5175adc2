//! Sources of the next tick's command besides the host: a wave, a pass, and a command that waits for an edge.

use core::borrow::BorrowMut;

use controller::supervised::Phase;
use controller::waves::{self, Wave};
use controller::{Config, Real, State, passes};
use specgen_link::EdgeStatus;
use specgen_runtime::pass::Player;
use specgen_runtime::pending::EdgeWait;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::wave::Stage;

use crate::requests::Command;

/// A command that waits for the edge of the input line.
#[derive(Debug, Clone, Copy)]
pub enum EdgeCommand {
    /// This command.
    Command(Command),
    /// The wave in [`Source::wave`], which has not started. New settings leave it valid: only a platform has an input line,
    /// and its limits of waves are constants.
    Wave,
}

/// Wave, pass and waiting command of the ticks. `P` holds the player of passes.
#[derive(Debug)]
pub struct Source<P> {
    /// Generates the set-points while it is under way.
    pub wave: Option<Wave>,
    /// The input line, and the command that waits for it.
    pub pending: EdgeWait<EdgeCommand>,
    /// Corrects the motion while a pass is under way, if it was given memory.
    pub player: Option<P>,
}

impl<P: BorrowMut<Player<'static, Real>>> Source<P> {
    /// At power-up: nothing is under way, and nothing waits.
    #[must_use]
    pub const fn at_reset() -> Self {
        Self { wave: None, pending: EdgeWait::new(), player: None }
    }

    /// Whether a wave is under way.
    #[must_use]
    pub fn waves(&self) -> bool {
        self.wave.as_ref().is_some_and(|wave| wave.stage() != Stage::Idle)
    }

    /// Whether a pass is under way.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.player.as_ref().is_some_and(|player| player.borrow().is_running())
    }

    /// Whether a wave or a pass is under way, which commands in place of the host.
    #[must_use]
    pub fn is_engaged(&self) -> bool {
        self.waves() || self.passes()
    }

    /// Status of the input line.
    #[must_use]
    pub const fn edge(&self) -> EdgeStatus {
        let pending = &self.pending;
        EdgeStatus { stage: pending.stage().word() as u8, edges: pending.edges(), tick: pending.tick() }
    }

    /// Removes the waiting command.
    pub fn cancel_awaited(&mut self) {
        self.pending.cancel();
        if !self.waves() {
            self.wave = None;
        }
    }

    /// Stops the wave under way, and removes the waiting command.
    pub fn stop_wave(&mut self) {
        self.cancel_awaited();
        if let Some(wave) = &mut self.wave {
            wave.stop();
        }
    }

    /// After the tick `tick` with this phase and status: starts the waiting command in the next one, if the line rose in
    /// this one. If the machine does not run, nothing waits.
    #[inline(never)]
    pub fn begin_awaited(&mut self, tick: u64, phase: Phase, status: u32, config: &Config, command: &mut Command) {
        if phase != Phase::Running {
            self.cancel_awaited();
        }
        let Some(awaited) = self.pending.due() else { return };
        let free = !self.is_engaged() && status & BUSY == 0;
        let begun = match (awaited, &mut self.wave) {
            (EdgeCommand::Command(awaited), _) if free => {
                *command = awaited;
                true
            }
            (EdgeCommand::Wave, Some(wave)) if free => {
                let limits = waves::limits(config);
                let may = waves::may_begin(status, command, wave.center(), &limits).is_ok();
                if may {
                    wave.start();
                }
                may
            }
            _ => false,
        };
        self.pending.settle(tick, begun);
    }

    /// Writes the set-point of a wave into the command; true if there is one. Only a machine that runs has one,
    /// or one that drives if it is of voltages: to continue later would be a jump. Not inlined, so that its stack frame is released before the law needs the stack.
    #[inline(never)]
    pub fn advance_wave(&mut self, phase: Phase, command: &mut Command) -> bool {
        let Some(wave) = self.wave.as_mut().filter(|wave| wave.stage() != Stage::Idle) else { return false };
        let phase_of_wave = if wave.drives() { Phase::Driving } else { Phase::Running };
        let motion = if phase == phase_of_wave { wave.advance() } else { None };
        match motion {
            Some(motion) => waves::write(&motion, wave.sequence(), wave.drives(), command),
            None => self.wave = None,
        }
        motion.is_some()
    }

    /// Writes the next correction of a pass into the command. Only a running machine has one.
    #[inline(never)]
    pub fn advance_pass(&mut self, phase: Phase, command: &mut Command) {
        if phase != Phase::Running {
            self.abort_pass(command);
        }
        if let Some(given) = self.player.as_mut().and_then(|player| player.borrow_mut().give()) {
            passes::write(&given, command);
        }
    }

    /// Records a tick of a pass; after the last one the correction ends.
    #[inline(never)]
    pub fn keep_pass(&mut self, state: &State, status: u32, command: &mut Command) {
        if let (Some(player), Some([target, pose])) = (&mut self.player, passes::shown(state)) {
            let player = player.borrow_mut();
            if player.is_running() {
                player.keep(&target, &pose, status);
                if !player.is_running() {
                    passes::end(command);
                }
            }
        }
    }

    /// Ends the pass under way, if there is one, and its correction.
    pub fn abort_pass(&mut self, command: &mut Command) {
        if let Some(player) = self.player.as_mut().map(BorrowMut::borrow_mut).filter(|player| player.is_running()) {
            player.abort();
            passes::end(command);
        }
    }
}
