//! The lead of a trajectory: as much of the delay from command to pose as its corners permit.
//!
//! With a lead τ the legs receive x_d + τ ẋ_d. The remaining error is linear in τ,
//!
//! ```text
//! e = S (x_d − G (x_d + ẍ_d/ω² + τ Δx_d/T)) = a + τ b          G: request to pose without feedback, S: sensitivity
//! ```
//! so the mean square of e over the motion and the rest after it is least for τ = −⟨a, b⟩/⟨b, b⟩. On a smooth path b is −ẋ_d, filtered by the
//! feedback, and a is the delay times ẋ_d, so τ is the delay. At each jump of ẋ_d by Δv the request steps by τ Δv, which excites the modes. For a
//! single jump the best lead is τ = δ²/(2 H), with δ the delay and H the integral of the squared step error: more and larger jumps with
//! less motion reduce τ. Hysteresis is not modelled.

use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::ClosedLoop;
use specgen_language::model::{self, TrajectoryKind};

use crate::learning::{Learnable, Motion};
use host_sim::trajectory::{PaperPath, PaperPose};

/// A lead is proposed if it reduces the error to less than this share of the error with the usual lead.
const WORTH: f64 = 0.97;

/// Effect of the lead on a trajectory of the spec, by the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeadOf {
    /// The trajectory.
    pub name: String,
    /// The lead in use, s.
    pub lead: f64,
    /// The best, s.
    pub best: f64,
    /// Rms error at the joints over the motion and 0.1 s of rest after it, m: with the lead in use and with the best one.
    pub errors: [f64; 2],
}

impl LeadOf {
    /// Whether the best lead is so much better that it should be proposed.
    pub fn is_proposed(&self) -> bool {
        self.errors[1] < WORTH * self.errors[0]
    }
}

/// The lead of each trajectory of the paper's kinds; none for six legs. Waveforms are splines without corners and use the usual lead.
pub fn of(compiled: &Compilation) -> Vec<LeadOf> {
    let model = &compiled.model;
    let Some((task, learnable)) = model.task_space.as_ref().zip(Learnable::of(compiled)) else { return Vec::new() };
    let usual = compiled.design.as_ref().map_or(0.0, |design| design.lead);
    let radius = model.geometry.joint_radius();
    let each = task.trajectories.iter().filter_map(|trajectory| {
        let TrajectoryKind::Paper { path, as_printed: false, frequency } = trajectory.kind else { return None };
        let path = PaperPose::corrected(streamed(path), frequency);
        let motion = Motion::of(&path, model.timing.period, &task.setpoint.speed, radius).ok()?;
        let [squares, products, leads] = products(&learnable, &motion);
        let error = |lead: f64| {
            let square =
                (squares + lead * (2.0 * products + lead * leads)) / (motion.corrected - motion.scored.start) as f64;
            // Rounding may give a tiny negative value.
            libm::sqrt(if square > 0.0 { square } else { 0.0 })
        };
        let lead = trajectory.lead.unwrap_or(usual);
        let free = -products / leads;
        let best = if free > 0.0 { free } else { 0.0 };
        Some(LeadOf { name: trajectory.name.clone(), lead, best, errors: [error(lead), error(best)] })
    });
    each.filter(|one| one.best.is_finite()).collect()
}

/// The path as the simulator plays it.
pub fn streamed(path: model::PaperPath) -> PaperPath {
    match path {
        model::PaperPath::Case1 => PaperPath::Case1,
        model::PaperPath::Case2 => PaperPath::Case2,
        model::PaperPath::Machining => PaperPath::Machining,
    }
}

/// ⟨a, a⟩, ⟨a, b⟩ and ⟨b, b⟩ over the motion and the rest after it, with angles times the radius: m², m²/s, m²/s².
fn products(learnable: &Learnable, motion: &Motion) -> [f64; 3] {
    let (law, tuning) = learnable.law();
    let closed_loop: &ClosedLoop = learnable.closed_loop();
    let (to_modal, from_modal) = (&closed_loop.basis.to_modal, &closed_loop.basis.from_modal);
    let mapped = |matrix: &[[f64; 6]; 6], vector: &[f64; 6]| -> [f64; 6] {
        matrix.map(|row| row.iter().zip(vector).map(|(factor, value)| factor * value).sum())
    };
    let targets = &motion.targets[..motion.corrected];
    let start = targets[0].pose;
    let mut last = [0.0; 6];
    let (mut places, mut requests, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    for target in targets {
        let place = mapped(to_modal, &std::array::from_fn(|axis| target.pose[axis] - start[axis]));
        let bend = mapped(to_modal, &target.acceleration);
        let squared = closed_loop.basis.frequencies.map(|frequency| frequency * frequency);
        requests.push(std::array::from_fn(|mode| place[mode] + bend[mode] / squared[mode]));
        rates.push(std::array::from_fn(|mode| (place[mode] - last[mode]) / closed_loop.period));
        places.push(place);
        last = place;
    }
    // Value at the end of each interval, which is the start of the next.
    let shown = closed_loop.without_feedback(&requests);
    let late: Vec<[f64; 6]> =
        places.iter().zip(&shown).map(|(place, shown)| std::array::from_fn(|mode| place[mode] - shown[mode])).collect();
    let led: Vec<[f64; 6]> =
        closed_loop.without_feedback(&rates).iter().map(|shown| shown.map(|value| -value)).collect();
    let [late, led] = [late, led].map(|errors| closed_loop.left(law, tuning, &errors));
    let scale = |axis: usize| if axis < 3 { 1.0 } else { motion.radius };
    let mut sums = [0.0; 3];
    for (a, b) in late.iter().zip(&led).skip(motion.scored.start) {
        let [a, b] = [a, b].map(|modal| mapped(from_modal, modal));
        for axis in 0..6 {
            let (a, b) = (scale(axis) * a[axis], scale(axis) * b[axis]);
            sums = [sums[0] + a * a, sums[1] + a * b, sums[2] + b * b];
        }
    }
    sums
}
