//! A machine that can repeat a motion: what a pass needs, the simulated machine, and the checks of a pass.

use host_sim::closed_loop::RunError;
use host_sim::platform::rig::{Bench, Request};
use host_sim::word::status_words;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::{Knot, UNIT};

use super::motion::Motion;
use super::observation::PassObservation;
use super::plan::Plan;

/// Status bits for refused or stale set-points: the machine did not follow the motion.
const NOT_FOLLOWED: u32 = 0x3_0000;
/// Status bits for implausible gauges.
const GAUGES: u32 = 0x3f00;
/// Status bits for legs at a limit.
const LEGS: u32 = 0x3f;
/// Status bit for a limited correction.
pub(super) const CORRECTION_LIMITED: u32 = 1 << 20;

/// Why a pass or learning failed.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// The simulated machine cannot make a pass.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The controller refused a set-point or rejected a gauge in a pass; its status bits.
    #[error(
        "the controller cannot follow this motion: {}; make it slower, or raise control.setpoint.stream_speed or the \
         workspace in the spec",
        status_words(*.0)
    )]
    Status(u32),
    /// Limits restricted the excitation; the status bits.
    #[error(
        "limits restricted the sweep, so the response could not be measured: {}; use a smaller motion or a larger \
         control.correction",
        status_words(*.0)
    )]
    Limited(u32),
    /// The user or the machine stopped a pass. The machine's driver holds the reason.
    #[error("a pass was ended by the user or the machine")]
    PassEnded,
    /// The device refuses the plan.
    #[error("the device refuses this learning plan")]
    Refused,
}

/// A machine that can repeat a motion.
pub trait RepeatableMachine {
    /// Runs a pass of the motion with a correction given by knots, `spacing` ticks apart.
    ///
    /// # Errors
    /// If the machine does not complete it.
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError>;

    /// The correction that the device computes from the present one and the pass with it.
    ///
    /// # Errors
    /// If the device refuses the plan.
    fn next(&mut self, plan: &Plan, correction: &[Knot], pass: &PassObservation) -> Result<Vec<Knot>, LearnError> {
        plan.next(correction, &pass.kept).ok_or(LearnError::Refused)
    }

    /// Loads the correction with which learning ended, if the machine has another one in memory.
    ///
    /// # Errors
    /// If the machine refuses it.
    fn keep(&mut self, _motion: &Motion, _knots: &[Knot], _spacing: u32) -> Result<(), LearnError> {
        Ok(())
    }
}

/// The simulated machine. It plays knots with the code of a real device.
impl RepeatableMachine for Bench<'_> {
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
        let timing = pass_timing(motion, spacing, 0);
        let count = timing.knots() as usize;
        let mut memory = vec![[0; 6]; 2 * count];
        let mut player = Player::<f64>::new(&mut memory);
        let accepted = player.put(0, knots.iter().copied().take(count)) && player.begin(timing);
        debug_assert!(accepted, "{timing:?}");
        let mut real = Vec::with_capacity(motion.targets.len());
        let mut status = 0;
        self.shift_mains_phase(motion.targets[0])?;
        for target in &motion.targets {
            let correction = player.give().map_or([0.0; 6], |played| played.correction);
            let tick = self.tick(&Request { correction, ..Request::stream(*target) })?;
            player.keep(&tick.target, &tick.measured, tick.status);
            status |= tick.status;
            real.push(std::array::from_fn(|axis| tick.target[axis] - tick.pose[axis]));
        }
        let kept = player.errors().to_vec();
        Ok(PassObservation { measured: error_by_tick(&kept, spacing, motion.corrected), real, kept, status })
    }
}

/// Timing of a pass: its ticks, the spacing of its knots in ticks, and the number of its trajectory.
pub fn pass_timing(motion: &Motion, spacing: u32, trajectory: u32) -> Course {
    Course { spacing, before: motion.scored.start as u32, ticks: motion.corrected as u32, trajectory }
}

/// The error of each tick, m and rad: the recorded error of its knot, the same over `spacing` ticks.
pub fn error_by_tick(errors: &[Knot], spacing: u32, ticks: usize) -> Vec<[f64; 6]> {
    let metres = |knot: &Knot| knot.map(|value| f64::from(value) * UNIT);
    errors.iter().flat_map(|knot| std::iter::repeat_n(metres(knot), spacing as usize)).take(ticks).collect()
}

/// Passes on an observation of a motion that the controller followed with plausible gauges.
pub(super) fn require_followed(pass: PassObservation) -> Result<PassObservation, LearnError> {
    let bad = pass.status & (NOT_FOLLOWED | GAUGES);
    if bad == 0 { Ok(pass) } else { Err(LearnError::Status(bad)) }
}

/// Passes on an observation in which no limit acted on a leg or on the correction.
pub(super) fn require_unlimited(pass: PassObservation) -> Result<PassObservation, LearnError> {
    let bad = pass.status & (LEGS | CORRECTION_LIMITED);
    if bad == 0 { Ok(pass) } else { Err(LearnError::Limited(bad)) }
}
