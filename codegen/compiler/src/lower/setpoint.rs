//! Lowers limits, user frames and trajectories to the constants of `specgen_runtime::setpoint`, each checked against the
//! workspace and the limits that the spec declares.

mod check;
mod corners;
mod declared;
pub(super) mod motions;
mod paper;
mod poses;
mod segments;
mod spline;
mod stop;
mod stopping;
mod table;

pub use corners::step;
pub use declared::{SpecSetpoints, declared};
pub use poses::{Stretch, stretches};
pub use stopping::{Stopping, check as check_stops, describe as describe_stops};

use specgen_runtime::setpoint::{Frames as _, MoveLimits, Profile, Target, Tool, Work};

use crate::figure::AXES;
use crate::ir::{Frames, Scalar, Setpoints, Trajectory};
use specgen_identify::waveform::Waveform;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{Model, TaskSpace, TrajectoryKind};
use specgen_numerics::rotation;

/// Ticks of the longest trajectory: counted exactly in f32, and 7 min at 10 kHz.
const LONGEST: f64 = 4_194_304.0;
/// Largest sum of the workspace's angles for which the angles of a turned frame are computed: every one of them is then within
/// π/4 of zero.
const TURNED: f64 = core::f64::consts::PI / 14.0;
/// Factor by which a user's angle may exceed that sum.
const TURNED_MARGIN: f64 = 1.1;

/// The constants of the set-point generator, and warnings. `waveforms` holds the table of each trajectory that is one.
///
/// # Errors
/// A bias or work zero outside the workspace, limits too low to move, a trajectory that jumps, leaves the workspace, is too
/// fast, or does not fit the ticks.
pub fn lower(
    model: &Model,
    task: &TaskSpace,
    waveforms: &[Option<Waveform>],
    scalar: Scalar,
) -> Result<(Setpoints, Vec<Diagnostic>), Vec<Diagnostic>> {
    let round = |value: f64| scalar.round(value);
    let period = model.timing.period;
    let rules = &task.setpoint;
    let user = User::of(model, task)?;
    let mut findings = user.check_zero(model, task);
    let reciprocal = |limit: [f64; 6], power: f64| limit.map(|value| 1.0 / (value * power));
    let limits = MoveLimits {
        speed: reciprocal(rules.speed, period),
        acceleration: reciprocal(rules.acceleration, period * period),
        jerk: reciprocal(rules.jerk, period * period * period),
    };
    findings.extend(too_slow(model, &user, &limits));
    let mut warnings = Vec::new();
    let mut trajectories = Vec::new();
    for (index, trajectory) in task.trajectories.iter().enumerate() {
        let lowered = match (&trajectory.kind, waveforms.get(index)) {
            (TrajectoryKind::Waveform { period, repeat, .. }, Some(Some(waveform))) => {
                table::lower(model, task, &user, index, waveform, *period, *repeat)
            }
            (kind, _) => match paper::formula(kind) {
                Some((pieces, frequency)) => segments::lower(model, task, &user, index, pieces, frequency),
                // Reading the file has reported the error.
                None => continue,
            },
        };
        match lowered {
            Ok((path, found)) => {
                trajectories.push(Trajectory { name: trajectory.name.clone(), path: path.rounded(scalar) });
                warnings.extend(found);
            }
            Err(found) => findings.extend(found),
        }
    }
    if !findings.is_empty() {
        return Err(findings);
    }
    let stop = stop::Limits::of(model, task, &user).reciprocal(period);
    // A step of exactly the limit must pass after its rounding.
    let [step, rate] = [rules.stream_speed.map(|v| v * period), rules.stream_speed];
    let slack = |axis: usize| 4.0 * scalar.epsilon() * user.bound[axis];
    Ok((
        Setpoints {
            period: round(period),
            rate: round(1.0 / period),
            square_rate: round(1.0 / (period * period)),
            bias: user.bias.map(round),
            home: user.home.map(round),
            speed: rules.speed,
            speed_limit: limits.speed.map(round),
            acceleration_limit: limits.acceleration.map(round),
            jerk_limit: limits.jerk.map(round),
            stop_acceleration_limit: stop.acceleration.map(round),
            stop_jerk_limit: stop.jerk.map(round),
            shortest_stop: stop.shortest,
            stream_step: core::array::from_fn(|axis| round(step[axis] + slack(axis))),
            stream_rate: rate.map(|v| round(v * (1.0 + 2.0 * scalar.epsilon()))),
            stream_acceleration: rate.map(|v| round(v / period)),
            stale_ticks: rules.stale_ticks,
            frames: user.frames.rounded(scalar),
            trajectories,
        },
        warnings,
    ))
}

/// The user's frames and the workspace in them.
pub(super) struct User {
    frames: Frames,
    /// Pose that user set-points are added to: the spec's bias and the offset of the work frame, m and rad.
    bias: [f64; 6],
    /// The user's coordinates of the spec's bias, m and rad.
    home: [f64; 6],
    bound: [f64; 6],
}

impl User {
    fn of(model: &Model, task: &TaskSpace) -> Result<Self, Vec<Diagnostic>> {
        let [rx, ry, rz] = model.workspace.rotation;
        let [ox, oy, oz, ax, ay, az] = task.frames.work;
        let tool = task.frames.tool;
        let axes = rotation([ax, ay, az]);
        let frames = if [ax, ay, az] != [0.0; 3] {
            let sum = rx + ry + rz;
            if sum > TURNED {
                return Err(vec![too_wide(model, sum, TURNED)]);
            }
            Frames::Work { axes, point: tool, largest_angle: sum * TURNED_MARGIN }
        } else if tool != [0.0; 3] {
            let eighth = core::f64::consts::FRAC_PI_4;
            let largest = [rx, ry, rz].into_iter().fold(0.0, |a: f64, b| if b > a { b } else { a });
            if largest > eighth {
                return Err(vec![too_wide(model, largest, eighth)]);
            }
            Frames::Tool { point: tool, largest_angle: eighth }
        } else {
            Frames::Parallel
        };
        let mut bias = task.setpoint.bias;
        let mut home = [0.0; 6];
        for (axis, offset) in [ox, oy, oz].into_iter().enumerate() {
            bias[axis] += offset;
            // Wᵀ (−offset); 0 instead of −0 without an offset.
            home[axis] = 0.0 - (axes[0][axis] * ox + axes[1][axis] * oy + axes[2][axis] * oz);
        }
        Ok(Self { frames, bias, home, bound: model.workspace.bounds() })
    }

    /// Rate of the platform's pose at rest for unit rate of the user's axis.
    fn column(&self, axis: usize) -> [f64; 6] {
        let mut user = Target::new();
        user.rate[axis] = 1.0;
        self.platform(&user).map_or([0.0; 6], |platform| platform.rate)
    }

    /// The platform's set-point for a user's, without the bias; none if an angle is out of range.
    fn platform(&self, user: &Target<f64>) -> Option<Target<f64>> {
        match self.frames {
            Frames::Parallel => Some(*user),
            Frames::Tool { point, largest_angle } => Tool { point, largest_angle }.to_platform(user),
            Frames::Work { axes, point, largest_angle } => Work { axes, point, largest_angle }.to_platform(user),
        }
    }

    /// Pose of the platform from rest at a user's pose, with the bias.
    fn pose(&self, user: [f64; 6]) -> Option<[f64; 6]> {
        let mut pose = self.platform(&Target::at(user))?.pose;
        for (value, bias) in pose.iter_mut().zip(self.bias) {
            *value += bias;
        }
        Some(pose)
    }

    /// The axis on which the platform would leave the workspace furthest at a user's pose, with its place there.
    fn outside(&self, user: [f64; 6]) -> Option<(usize, f64)> {
        let Some(pose) = self.pose(user) else {
            // An angle beyond all bounds.
            let axis = (3..6).fold(3, |worst, axis| if user[axis].abs() > user[worst].abs() { axis } else { worst });
            return Some((axis, user[axis]));
        };
        let excess = |axis: usize| pose[axis].abs() / self.bound[axis];
        let worst = (0..6).fold(0, |worst, axis| if excess(axis) > excess(worst) { axis } else { worst });
        (excess(worst) > 1.0).then(|| (worst, pose[worst]))
    }

    /// Checks that bias and work zero are within the workspace.
    fn check_zero(&self, model: &Model, task: &TaskSpace) -> Vec<Diagnostic> {
        let places = [
            ("control.setpoint.bias", "the bias pose", self.home, "reduce the bias, or widen the workspace"),
            (
                "control.frames.work",
                "the zero of the work frame",
                [0.0; 6],
                "the offset moves the zero of set-points away from the bias pose: keep it within the travel, or set it to 0",
            ),
        ];
        let offset = task.frames.work[..3] != [0.0; 3];
        let mut findings = Vec::new();
        for (key, what, user, help) in places {
            if key == "control.frames.work" && !offset {
                continue;
            }
            if let Some((axis, value)) = self.outside(user) {
                let (name, value, bound) = (AXES[axis], amount(axis, value), amount(axis, self.bound[axis]));
                let message = format!("{what} has {name} = {value}, outside the workspace of ±{bound}");
                findings.push(Diagnostic::at(&model.spans, &[key], codes::ZERO_OUTSIDE, message, help));
            }
        }
        findings
    }
}

fn too_wide(model: &Model, found: f64, largest: f64) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["control.frames"],
        codes::FRAMES_TOO_WIDE,
        format!("the workspace turns by up to {:.1} mrad; user frames allow {:.1} mrad", found * 1e3, largest * 1e3),
        "reduce workspace.rotation, or leave control.frames out".to_owned(),
    )
}

/// Checks that a move from end to end of the workspace does not take too many ticks.
fn too_slow(model: &Model, user: &User, limits: &MoveLimits<f64>) -> Option<Diagnostic> {
    let [tx, ty, tz, rx, ry, rz] = user.bound;
    let point = match user.frames {
        Frames::Parallel => [0.0; 3],
        Frames::Tool { point, .. } | Frames::Work { point, .. } => point,
    };
    let angle = rx + ry + rz;
    let way = match user.frames {
        Frames::Parallel => user.bound.map(|bound| 2.0 * bound),
        _ => {
            // A user's axis may have any direction, and a rotation moves P_C about the tool point.
            let reach = tx + ty + tz + angle * (point[0].abs() + point[1].abs() + point[2].abs());
            [2.0 * reach, 2.0 * reach, 2.0 * reach, 2.0 * angle, 2.0 * angle, 2.0 * angle]
        }
    };
    if Profile::plan(&way, limits).is_some() {
        return None;
    }
    Some(Diagnostic::at(
        &model.spans,
        &["control.setpoint.speed"],
        codes::MOVES_TOO_SLOW,
        format!(
            "at these limits a move across the workspace takes more than {:.0} s",
            f64::from(specgen_runtime::setpoint::LONGEST) * model.timing.period
        ),
        "raise control.setpoint.speed, acceleration or jerk".to_owned(),
    ))
}

/// A length in µm or an angle in µrad.
fn amount(axis: usize, value: f64) -> String {
    let digits = if (value * 1e6).abs() < 0.1 { 5 } else { 3 };
    format!("{:.digits$} {}", value * 1e6, if axis < 3 { "um" } else { "urad" })
}
