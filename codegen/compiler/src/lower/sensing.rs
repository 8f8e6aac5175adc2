//! Lowers the gauges of the platform to the constants of `specgen_runtime::sensing`, after checking that they are usable.

mod calibration;
mod layout;
mod noise;

pub use noise::{PoseNoise, pose_noise, poses_per_reading, reading_noise, readings_per_pose};

use specgen_runtime::{Gauges, Series};

use super::kinematics::{leg_jacobian, series_of, tolerance};
use super::linear::{grid, norm};
use crate::figure::fixed;
use crate::ir::{Scalar, Sensing};
use layout::Layout;
use specgen_language::diagnostic::{Code, Diagnostic, Place, codes};
use specgen_language::model::{Model, TaskSpace};
use specgen_numerics::Kernels as _;

/// Most passes. More mean that the pose does not converge.
const MOST_PASSES: u32 = 12;
/// Largest error of the pose for readings at the ends of the gauges' range, as a share of the range: beyond the declared workspace
/// the pose need not be exact, but it must be plausible.
const SOUND_AT_RANGE: f64 = 1e-3;

/// The constants of the gauges.
///
/// # Errors
/// A gauge that misses the platform, gauges that do not measure every motion, a range smaller than the workspace, a calibration
/// that cannot be inverted, a workspace too large.
pub(super) fn lower(model: &Model, task: &TaskSpace, scalar: Scalar) -> Result<Sensing, Vec<Diagnostic>> {
    let layout = layout::check(model, &task.probes)?;
    let mut findings = range_holds_workspace(model, &layout);
    let raw_limits = calibration::raw_limits(model, task.calibration.as_ref()).map_err(|found| findings.extend(found));
    let solution = Solution::of(model, &layout, scalar).map_err(|found| findings.extend(found));
    let (Ok(raw_limits), Ok(solution), true) = (raw_limits, solution, findings.is_empty()) else {
        return Err(findings);
    };
    let round = |value: f64| scalar.round(value);
    let vectors = |rows: [[f64; 3]; 6]| rows.map(|row| row.map(round));
    let matrix = |rows: [[f64; 6]; 6]| rows.map(|row| row.map(round));
    // 1 − α = exp(−ω_c T): the exact sampled first-order low-pass.
    let phase = task.velocity_cutoff * model.timing.period;
    Ok(Sensing {
        direction: vectors(layout.direction),
        normal: vectors(layout.normal),
        skew: vectors(layout.skew),
        pierced: vectors(layout.pierced),
        inverse: matrix(layout.inverse),
        curvature: matrix(layout.curvature),
        passes: solution.passes,
        remainder: solution.remainder,
        arc_sine: solution.arc_sine.into_iter().map(round).collect(),
        arc_tangent: solution.arc_tangent.into_iter().map(round).collect(),
        calibration: task.calibration.as_ref().map(|of_gauge| calibration::padded(of_gauge, scalar)),
        raw_limits: raw_limits.map(|limits| limits.map(round)),
        rate_keep: round(libm::exp(-phase)),
        rate_gain: round(-libm::expm1(-phase) / model.timing.period),
    })
}

/// Number of passes and terms for the workspace.
struct Solution {
    passes: u32,
    remainder: [f64; 2],
    arc_sine: Vec<f64>,
    arc_tangent: Vec<f64>,
}

impl Solution {
    /// Counts them in f64 at 3⁶ poses on the faces of the workspace, and checks the ends of the gauges' range.
    fn of(model: &Model, layout: &Layout, scalar: Scalar) -> Result<Self, Vec<Diagnostic>> {
        let bounds = model.workspace.bounds();
        let tolerance = tolerance(bounds, scalar);
        let largest = bounds[3..].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
        let (sine, versine) = series_of(largest, Scalar::F64);
        let series = Series { sine: &sine, versine: &versine };
        let exact = arcs(largest, Scalar::F64);
        let mut gauges = layout.gauges(&exact);
        for passes in 1..=MOST_PASSES {
            gauges.passes = passes as usize;
            let error = largest_error(&gauges, &series, bounds);
            if !error.iter().zip(&tolerance).all(|(error, most)| error <= most) {
                continue;
            }
            if !sound_at_range(&gauges, model.sensor.range) {
                break;
            }
            let most = |part: &[f64]| part.iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
            let (arc_sine, arc_tangent) = arcs(largest, scalar);
            return Ok(Self { passes, remainder: [most(&error[..3]), most(&error[3..])], arc_sine, arc_tangent });
        }
        Err(vec![finding(
            model,
            codes::GAUGES_DIVERGE,
            "workspace.rotation",
            format!("over the declared workspace and sensor.range, the pose does not converge from the readings within {MOST_PASSES} passes"),
            "the equations of the gauges are solved for small motions: reduce workspace.rotation and workspace.translation, or sensor.range"
                .to_owned(),
        )])
    }
}

/// Largest error of each coordinate over the workspace, m and rad.
fn largest_error(gauges: &Gauges<f64>, series: &Series<f64>, bounds: [f64; 6]) -> [f64; 6] {
    let mut largest = [0.0; 6];
    for pose in grid(bounds) {
        let found = f64::pose(gauges, &f64::readings(gauges, series, &pose));
        for ((largest, found), exact) in largest.iter_mut().zip(&found).zip(&pose) {
            let error = (found - exact).abs();
            // NaN counts as an infinite error.
            let error = if error.is_nan() { f64::INFINITY } else { error };
            if error > *largest {
                *largest = error;
            }
        }
    }
    largest
}

/// Whether the pose for every combination of readings at the ends of `range` reproduces these readings.
fn sound_at_range(gauges: &Gauges<f64>, range: [f64; 2]) -> bool {
    let span = range[1] - range[0];
    (0..64_u32).all(|corner| {
        let mut readings = [0.0; 6];
        for (k, reading) in readings.iter_mut().enumerate() {
            *reading = range[(corner as usize >> k) & 1];
        }
        let pose = f64::pose(gauges, &readings);
        let angle = norm([pose[3], pose[4], pose[5]]);
        if angle.is_nan() || angle > 1.0 {
            return false;
        }
        let (sine, versine) = series_of(angle, Scalar::F64);
        let back = f64::readings(gauges, &Series { sine: &sine, versine: &versine }, &pose);
        back.iter().zip(&readings).all(|(back, reading)| (back - reading).abs() <= SOUND_AT_RANGE * span)
    })
}

/// Coefficients in x² of asin x / x and atan x / x after the leading 1, for angles up to `largest`: the remainder is below a
/// quarter of the last bit.
fn arcs(largest: f64, scalar: Scalar) -> (Vec<f64>, Vec<f64>) {
    let limit = scalar.epsilon() / 4.0;
    let (mut arc_sine, mut arc_tangent) = (Vec::new(), Vec::new());
    // Each term of the arc sine is less than x² times the one before, so the remainder is less than its first term over 1 − x².
    let square = libm::pow(libm::sin(largest), 2.0);
    let (mut binomial, mut power) = (1.0, 1.0);
    for k in 1..200_u32 {
        let n = f64::from(k);
        binomial *= (2.0 * n - 1.0) / (2.0 * n);
        power *= square;
        let coefficient = binomial / (2.0 * n + 1.0);
        if coefficient * power < limit * (1.0 - square) {
            break;
        }
        arc_sine.push(coefficient);
    }
    let square = libm::pow(libm::tan(largest), 2.0);
    let (mut sign, mut power) = (1.0, 1.0);
    for k in 1..200_u32 {
        sign = -sign;
        power *= square;
        let coefficient = sign / (2.0 * f64::from(k) + 1.0);
        if coefficient.abs() * power < limit {
            break;
        }
        arc_tangent.push(coefficient);
    }
    (arc_sine, arc_tangent)
}

/// Largest magnitude of each axis alone that the gauges can read, m and rad; none without gauges on the platform.
pub(crate) fn seen(model: &Model) -> Option<[f64; 6]> {
    let layout = layout::check(model, &model.task_space.as_ref()?.probes).ok()?;
    Some(core::array::from_fn(|axis| seen_along(model, &layout, axis)))
}

fn seen_along(model: &Model, layout: &Layout, axis: usize) -> f64 {
    let [low, high] = model.sensor.range;
    let legs = leg_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let ways = [-1.0, 1.0].into_iter().filter(|way| !legs.iter().all(|leg| leg[axis] * way < 0.0));
    let ends = ways.flat_map(|way| layout.jacobian.iter().map(move |row| row[axis] * way)).filter_map(|slope| {
        if slope == 0.0 { None } else { Some(if slope > 0.0 { high / slope } else { low / slope }) }
    });
    ends.fold(f64::INFINITY, |least, end| if end < least { end } else { least })
}

/// Checks that the gauges can read each axis alone up to its bound. Directions out of reach of every leg, as all poses below rest,
/// are skipped.
fn range_holds_workspace(model: &Model, layout: &Layout) -> Vec<Diagnostic> {
    const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
    let [low, high] = model.sensor.range;
    let legs = leg_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let mut worst: Option<(f64, usize, usize, f64)> = None;
    for (axis, bound) in model.workspace.bounds().into_iter().enumerate() {
        for motion in [-bound, bound] {
            if legs.iter().all(|leg| leg[axis] * motion < 0.0) {
                continue;
            }
            for (k, sensitivity) in layout.jacobian.iter().enumerate() {
                let reading = sensitivity[axis] * motion;
                let beyond = if reading > high { reading - high } else { low - reading };
                if beyond > 1e-9 * (high - low) && worst.is_none_or(|(most, ..)| beyond > most) {
                    worst = Some((beyond, axis, k, reading));
                }
            }
        }
    }
    let Some((_, axis, k, reading)) = worst else { return Vec::new() };
    let (name, unit, scale) = if axis < 3 { ("translation", "µm", 1e6) } else { ("rotation", "mrad", 1e3) };
    let most = libm::floor(seen_along(model, layout, axis) * scale * 1e4) / 1e4;
    // If the range ends at rest on one side, there is no bound to suggest.
    let less = if most > 0.0 {
        format!("at most {most} {unit} on this axis (workspace.{name}[{}]), or ", axis % 3)
    } else {
        String::new()
    };
    let (name, bound, beyond) = (AXES[axis], model.workspace.bounds()[axis] * scale, fixed(reading * 1e6, 3));
    let (low, high) = (fixed(low * 1e6, 3), fixed(high * 1e6, 3));
    vec![finding(
        model,
        codes::GAUGE_RANGE,
        "sensor.range",
        format!(
            "within the declared workspace, {name} of ±{bound:.4} {unit} alone moves gauge {k} to {beyond} µm, beyond its range of {low} µm to {high} µm"
        ),
        format!("{less}gauges whose range includes {} µm; check the unit of sensor.range", fixed(reading * 1e6, 3)),
    )]
}

fn finding(model: &Model, code: Code, key: &str, message: String, help: String) -> Diagnostic {
    // A key with its default value has no place in the spec; its table may have one.
    let table = key.split('.').next().unwrap_or(key);
    let span = model.spans.get(key).or_else(|| model.spans.get(table));
    let place = span.cloned().map_or(Place::Whole, Place::Spec);
    Diagnostic::new(code, key, place, message, help)
}
