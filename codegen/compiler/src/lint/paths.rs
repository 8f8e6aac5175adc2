//! What the declared trajectories demand of stacks and amplifiers.
//!
//! Jumps, corners, speed and position of a path are checked where it is lowered, its reach in [`crate::reach`].

use serde::Serialize;
use specgen_numerics::{coupled, displacements, mass_matrix};
use specgen_runtime::Platform;

use super::{Findings, Legs, figure};
use crate::lower::setpoint::Stretch;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace};

lints! {
    rules:;

    /// # E0850: trajectory beyond the slew rate
    ///
    /// Along a trajectory no leg may need a faster change of voltage than
    /// `actuator.slew_rate`, even if its gain is a quarter above the mean.
    ///
    /// ## Why it matters
    ///
    /// The leg would lag from the first fast segment on, and the platform would leave
    /// its path on all axes.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -slew_rate       = "40 V/ms"
    /// +slew_rate       = "0.09 V/ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Lower the frequency, or check the unit of `slew_rate`.
    ///
    /// ```toml
    /// slew_rate       = "40 V/ms"
    /// ```
    PATH_BEYOND_SLEW = "E0850";

    /// # W0851: trajectory near the slew rate
    ///
    /// Along a trajectory a leg should stay within `actuator.slew_rate` even where the
    /// gain of its stacks is lowest.
    ///
    /// ## Why it matters
    ///
    /// The gain varies by some ten per cent over a hysteresis loop. Where it is lowest,
    /// the same motion needs more voltage.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -slew_rate       = "40 V/ms"
    /// +slew_rate       = "0.15 V/ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Lower the frequency a little, or allow a higher slew rate.
    ///
    /// ```toml
    /// slew_rate       = "40 V/ms"
    /// ```
    PATH_NEAR_SLEW = "W0851";

    /// # E0852: trajectory beyond the current of the amplifier
    ///
    /// I = C dU/dt along the trajectory, with `actuator.capacitance` and the gain of
    /// the stacks, must not exceed `amplifier.current`.
    ///
    /// ## Why it matters
    ///
    /// The amplifier would limit the current and so the slew rate, and the controller
    /// would not know.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[lint]
    /// +allow = ["amplifier.current: a small one"]
    /// @@ [actuator] @@
    ///  damping_ratio   = 0.1
    /// +capacitance = "1 uF"
    /// @@ [amplifier] @@
    ///  noise = "2 mV"
    /// +current = "0.1 mA"
    /// ```
    ///
    /// ## Fix
    ///
    /// Lower the frequency, or check capacitance (of a whole leg) and current.
    ///
    /// ```toml
    /// current = "100 mA"
    /// ```
    PATH_BEYOND_CURRENT = "E0852";

    /// # W0853: trajectory whose inertia deflects the legs
    ///
    /// Along a trajectory, the inertia force by (3) over the stiffness of a leg should
    /// be less than a tenth of the stroke.
    ///
    /// ## Why it matters
    ///
    /// Feed-forward compensates the deflection, but the reach check ignores it: near
    /// the ends of the strokes the compensation runs out of travel.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -slew_rate       = "40 V/ms"
    /// +slew_rate       = "430 V/ms"
    /// @@ [control.setpoint] @@
    /// -stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// +stream_speed = ["0.9 m/s", "0.9 m/s", "0.9 m/s", "6 rad/s", "6 rad/s", "6 rad/s"]
    /// @@ [[trajectory]] @@
    ///  kind      = "case-1"
    /// -frequency = "1 Hz"
    /// +frequency = "340 Hz"
    /// ```
    ///
    /// ## Fix
    ///
    /// Lower the frequency.
    PATH_INERTIA = "W0853";

    /// # W0854: trajectory near the lowest mode
    ///
    /// The frequency of a sinusoid should be below a fifth of the lowest mode.
    ///
    /// ## Why it matters
    ///
    /// A higher frequency excites the mode: the platform moves further than its legs.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// +stream_speed = ["0.9 m/s", "0.9 m/s", "0.9 m/s", "6 rad/s", "6 rad/s", "6 rad/s"]
    /// @@ [[trajectory]] @@
    ///  kind      = "case-1"
    /// -frequency = "1 Hz"
    /// +frequency = "80 Hz"
    /// ```
    ///
    /// ## Fix
    ///
    /// Lower the frequency.
    PATH_EXCITES = "W0854";
}

/// Largest ratio between the local and the mean gain of a stack, in either direction.
const GAIN_SLACK: f64 = 1.3;
/// Largest deflection by inertia, as a share of the stroke.
const LARGEST_DEFLECTION: f64 = 0.1;
/// Highest frequency of a sinusoid, as a share of the lowest mode.
const FASTEST: f64 = 0.2;

/// What a trajectory demands of the legs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathDemand {
    /// Its name.
    pub name: String,
    /// Largest speed of a leg, m/s.
    pub leg_speed: f64,
    /// Largest rate of a leg's voltage at its mean gain, V/s.
    pub slew: f64,
    /// Largest acceleration of a leg between the corners, m/s².
    pub leg_acceleration: f64,
    /// Deflection of a leg by inertia there, m.
    pub deflection: f64,
    /// Largest current, A, with `actuator.capacitance`.
    pub current: Option<f64>,
}

/// Checks every trajectory of `task`; `paths` are their poses, in the order of the spec.
pub fn check(
    model: &Model,
    task: &TaskSpace,
    platform: &Platform<f64>,
    paths: &[Vec<Stretch>],
) -> (Vec<PathDemand>, Vec<Diagnostic>) {
    let mut found = Findings::new(model);
    let legs = Legs::of(model, platform);
    let mass = mass_matrix(platform, &[0.0; 6]);
    let inverse = crate::lower::inverse_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let mut demands = Vec::new();
    for (index, (trajectory, path)) in task.trajectories.iter().zip(paths).enumerate() {
        let mut demand = PathDemand {
            name: trajectory.name.clone(),
            leg_speed: 0.0,
            slew: 0.0,
            leg_acceleration: 0.0,
            deflection: 0.0,
            current: None,
        };
        for stretch in path {
            look(&mut demand, model, platform, (&mass, &inverse), stretch);
        }
        demand.slew = demand.leg_speed / model.actuator.leg_gain();
        demand.current = model.actuator.capacitance.map(|capacitance| capacitance * demand.slew);
        let (rate, frequency) = trajectory.kind.rate();
        let key = format!("trajectory[{index}].{rate}");
        slew(model, &key, &demand, &mut found);
        current(model, &key, &demand, &mut found);
        deflection(model, &key, &demand, &mut found);
        if let ("frequency", Some(modes)) = (rate, legs.modes) {
            excitation(&key, &demand.name, frequency, modes[0], &mut found);
        }
        demands.push(demand);
    }
    (demands, found.list())
}

fn larger(slot: &mut f64, value: f64) {
    if value > *slot {
        *slot = value;
    }
}

type Matrix = [[f64; 6]; 6];

/// Adds a stretch to `demand`. Speeds and accelerations are differences of leg displacements, which are nonlinear in the pose.
#[allow(clippy::needless_range_loop)] // Axes and legs by number, as in the equations.
fn look(
    demand: &mut PathDemand,
    model: &Model,
    platform: &Platform<f64>,
    (mass, inverse): (&Matrix, &Matrix),
    stretch: &Stretch,
) {
    let dt = stretch.interval;
    let legs: Vec<[f64; 6]> = {
        let of = |pose| coupled(model.actuator.cross_talk.as_ref(), displacements(platform, pose));
        stretch.poses.iter().map(of).collect()
    };
    for pair in legs.windows(2) {
        for leg in 0..6 {
            larger(&mut demand.leg_speed, (pair[1][leg] - pair[0][leg]).abs() / dt);
        }
    }
    let second = |a: f64, b: f64, c: f64| (a - 2.0 * b + c) / (dt * dt);
    for (three, poses) in legs.windows(3).zip(stretch.poses.windows(3)) {
        for leg in 0..6 {
            larger(&mut demand.leg_acceleration, second(three[0][leg], three[1][leg], three[2][leg]).abs());
        }
        // f = J⁻ᵀ M ḧ, with M and J at rest: they are constant over the travel of a piezo.
        let acceleration: [f64; 6] =
            core::array::from_fn(|axis| second(poses[0][axis], poses[1][axis], poses[2][axis]));
        let wrench: [f64; 6] =
            core::array::from_fn(|row| (0..6).fold(0.0, |sum, axis| sum + mass[row][axis] * acceleration[axis]));
        for leg in 0..6 {
            let force = (0..6).fold(0.0, |sum, axis| sum + inverse[axis][leg] * wrench[axis]);
            larger(&mut demand.deflection, force.abs() / model.actuator.axial_stiffness);
        }
    }
}

fn slew(model: &Model, key: &str, demand: &PathDemand, found: &mut Findings) {
    let limit = model.actuator.slew_rate;
    if demand.slew <= limit / GAIN_SLACK {
        return;
    }
    let (name, speed, needed) = (&demand.name, figure(demand.leg_speed * 1e6), figure(demand.slew * 1e-3));
    let allowed = figure(limit * 1e-3);
    let message = format!(
        "`{name}` moves a leg at {speed} um/s, which needs about {needed} V/ms, but `actuator.slew_rate` is {allowed} V/ms"
    );
    let help = format!(
        "run it {} times slower, or raise `actuator.slew_rate` if amplifier and stack allow it; check its unit (V/ms or V/s)",
        figure(demand.slew * GAIN_SLACK / limit)
    );
    // Certain only if even a gain above the mean is not enough.
    if demand.slew > limit * GAIN_SLACK {
        found.add(PATH_BEYOND_SLEW, key, message, &help);
    } else {
        found.add(PATH_NEAR_SLEW, key, message, &help);
    }
}

fn current(model: &Model, key: &str, demand: &PathDemand, found: &mut Findings) {
    let (Some(needed), Some(limit)) = (demand.current, model.amplifier.current) else { return };
    if needed <= limit / GAIN_SLACK {
        return;
    }
    let (name, amperes, slew, supplied) = (&demand.name, figure(needed), figure(demand.slew * 1e-3), figure(limit));
    found.add(
        PATH_BEYOND_CURRENT,
        key,
        format!(
            "`{name}` charges a leg with about {amperes} A (at {slew} V/ms), but `amplifier.current` is {supplied} A"
        ),
        &format!(
            "run it {} times slower; or check `actuator.capacitance` and `amplifier.current`",
            figure(needed * GAIN_SLACK / limit)
        ),
    );
}

fn deflection(model: &Model, key: &str, demand: &PathDemand, found: &mut Findings) {
    let stroke = model.actuator.stroke;
    if demand.deflection <= LARGEST_DEFLECTION * stroke {
        return;
    }
    let (name, deflection, stroke) = (&demand.name, figure(demand.deflection * 1e6), figure(stroke * 1e6));
    let acceleration = figure(demand.leg_acceleration);
    found.add(
        PATH_INERTIA,
        key,
        format!(
            "the inertia along `{name}` deflects a leg by {deflection} um of its stroke of {stroke} um (leg acceleration {acceleration} m/s^2)"
        ),
        "run it slower; or check `platform.mass`, `platform.inertia` and `actuator.axial_stiffness`",
    );
}

fn excitation(key: &str, name: &str, frequency: f64, mode: f64, found: &mut Findings) {
    if frequency <= FASTEST * mode {
        return;
    }
    found.add(
        PATH_EXCITES,
        key,
        format!("`{name}` at {} Hz excites the lowest mode of {} Hz", figure(frequency), figure(mode)),
        "a tenth of the lowest mode is usual: check the unit of the frequency, and `actuator.axial_stiffness`, which determines the mode",
    );
}
