//! The load of the legs under motion and gravity: by the whole kernel, or to first order if that is proven to be accurate enough.
//!
//! ```text
//! p(h, ḣ, ḧ) = (J⁻ᵀ (M ḧ + C ḣ + G) − f_rest)/k_a = P h + Q ḧ + e      (7) without the interaction force
//! ```
//! P and Q are the derivatives of the controller's own kernel at rest. The error e is bounded over the whole workspace and all
//! motions within the declared limits by running that kernel on polynomials with a remainder ([`specgen_numerics::Taylor`]), without
//! sampling. Terms of P are left out, the smallest first, as far as the tolerance allows. Q is kept complete: its error would grow
//! with the acceleration of stops and streams.
//!
//! Joints that are stiff, and gauges that are tilted, couple the legs: leg i reaches the length l_i with l_i + Σ E_ij l_j of its own
//! displacement. To first order that is E J h, another load that is known: it is part of P.

use super::kinematics::leg_jacobian;
use super::linear::with_alike;
use super::setpoint::motions::{self, Motions};
use crate::figure::figure;
use crate::ir::{Affine, Dynamics, LEGS, Load, LoadBound, Scalar, Setpoints};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{DynamicsChoice, Model, TaskSpace};
use specgen_numerics::{Expansion, expand_leg_forces, multiply6};

/// Default of the largest error, as a share of the converter's step.
const SHARE_OF_STEP: f64 = 0.1;
/// Derivatives below this share of the largest in their matrix are rounding errors of zero.
const DUST: f64 = 1e-12;

/// The way the controller computes the load.
///
/// # Errors
/// Frames that the set-points refuse.
pub(super) fn lower(
    model: &Model,
    task: &TaskSpace,
    scalar: Scalar,
    platform: &Dynamics,
    setpoints: &Setpoints,
    step: f64,
) -> Result<Load, Vec<Diagnostic>> {
    let tolerance = task.dynamics_tolerance.unwrap_or(SHARE_OF_STEP * step * model.actuator.leg_gain());
    let motions = motions::largest(model, task, setpoints)?;
    let spaces = motions.map(|motions| Space::of(model, platform, motions));
    let tracked = &spaces[0];
    let affine = tracked.affine(scalar, tolerance);
    let bounds = spaces.each_ref().map(|space| space.bound(&affine));
    let taken = task.dynamics == DynamicsChoice::Cheapest && bounds[0].error <= tolerance;
    let coupled = model.actuator.cross_talk.zip(leg_jacobian(&model.geometry));
    let cross_talk = coupled.map(|(coupling, jacobian)| multiply6(&coupling, &jacobian));
    let with = |pose: [[f64; 6]; LEGS], more: &[[f64; 6]; LEGS]| {
        core::array::from_fn(|leg| core::array::from_fn(|axis| scalar.round(pose[leg][axis] + more[leg][axis])))
    };
    let affine = match &cross_talk {
        Some(more) => Affine { pose: with(affine.pose, more), ..affine },
        None => affine,
    };
    let cross_talk = cross_talk.map(|rows| with([[0.0; 6]; LEGS], &rows));
    let operations = [tracked.operations, 2 * affine.terms()];
    Ok(Load { affine: taken.then_some(affine), cross_talk, tolerance, bounds, operations })
}

/// Text for `specgen check`: how the load is computed, and the proven error.
#[must_use]
pub fn describe(load: &Load) -> String {
    let nm = |value: f64| figure(value * 1e9);
    let [tracked, stops, streams] = &load.bounds;
    let [whole, first] = load.operations;
    let (chosen, instead) = match &load.affine {
        Some(_) => ("to first order", format!("{first} operations in place of {whole}")),
        None => ("by the whole kernel", format!("{whole} operations; to first order {first}")),
    };
    let (tracked_error, tolerance, tracked_load) = (nm(tracked.error), nm(load.tolerance), nm(tracked.load));
    let (stop_error, stop_load, stream_error) = (nm(stops.error), nm(stops.load), nm(streams.error));
    let stream_load = nm(streams.load);
    format!(
        "  load of the legs under motion and gravity: {chosen}, {instead}\n    first order off by {tracked_error} nm at most, tolerance {tolerance} nm, in moves and \
         trajectories (load up to {tracked_load} nm); {stop_error} of {stop_load} nm in stops, {stream_error} of {stream_load} nm in any permitted stream\n"
    )
}

/// The load of each leg, m, over the workspace and a set of motions.
struct Space {
    widths: [f64; 18],
    motions: Motions,
    load: [Expansion; LEGS],
    operations: usize,
}

impl Space {
    fn of(model: &Model, platform: &Dynamics, motions: Motions) -> Self {
        let pose = model.workspace.bounds();
        let widths = core::array::from_fn(|k| match k {
            0..6 => pose[k],
            6..12 => motions.rate[k - 6],
            _ => motions.acceleration[k - 12],
        });
        let (forces, operations) = expand_leg_forces(&platform.platform(), &widths);
        let compliance = 1.0 / model.actuator.axial_stiffness;
        Self { widths, motions, load: forces.map(|force| force.scaled(compliance)), operations }
    }

    /// P and Q, P with as few terms as the tolerance (m) permits.
    fn affine(&self, scalar: Scalar, tolerance: f64) -> Affine {
        let mut affine = Affine { pose: [[0.0; 6]; LEGS], acceleration: [[0.0; 6]; LEGS] };
        let derivative = |leg: usize, k: usize| self.load[leg].slope()[k] / self.widths[k];
        let largest = |k: usize| (0..LEGS).fold(0.0, |most: f64, leg| larger(most, derivative(leg, k).abs()));
        for leg in 0..LEGS {
            for k in 0..6 {
                let kept = |k: usize| {
                    let value = derivative(leg, k);
                    if value.abs() <= DUST * largest(k) { 0.0 } else { scalar.round(value) }
                };
                affine.pose[leg][k] = kept(k);
                affine.acceleration[leg][k] = kept(k + 12);
            }
            let mut room = tolerance - self.left(&affine, leg);
            let reach = |k: &usize| self.load[leg].slope()[*k].abs();
            let mut order = [0, 1, 2, 3, 4, 5];
            order.sort_by(|a, b| reach(a).total_cmp(&reach(b)));
            for k in order {
                room -= reach(&k);
                if room < 0.0 {
                    break;
                }
                affine.pose[leg][k] = 0.0;
            }
        }
        Affine { pose: with_alike(affine.pose), acceleration: with_alike(affine.acceleration) }
    }

    /// Error of `affine` for the load of a leg, m.
    fn left(&self, affine: &Affine, leg: usize) -> f64 {
        let (pose, acceleration) = (&affine.pose[leg], &affine.acceleration[leg]);
        let slope = core::array::from_fn(|k| match k {
            0..6 => pose[k] * self.widths[k],
            6..12 => 0.0,
            _ => acceleration[k - 12] * self.widths[k],
        });
        self.load[leg].left_by(&slope)
    }

    fn bound(&self, affine: &Affine) -> LoadBound {
        let worst = |of: &dyn Fn(usize) -> f64| (0..LEGS).fold(0.0, |most: f64, leg| larger(most, of(leg)));
        LoadBound {
            rate: self.motions.rate,
            acceleration: self.motions.acceleration,
            load: worst(&|leg| self.load[leg].left_by(&[0.0; 18])),
            error: worst(&|leg| self.left(affine, leg)),
        }
    }
}

/// The larger one; NaN counts as the largest.
fn larger(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}
