//! Reach of the legs: travel of each axis, the declared workspace, the bias, trajectories; and the conditioning of the geometry
//! there.
//!
//! A leg moves between 0 (no voltage, where the gauges are zeroed) and its stroke. Weight and pre-load are not included: the
//! zero of the gauges contains their effect on the rest pose. Poses are x, y, z (m), θx, θy, θz (rad) from rest; those of
//! set-points include the bias. The reachable poses of a hexapod are not a box. So corners of the declared workspace beyond reach
//! cause only a warning, but a bound that its axis alone cannot reach is an error.

mod boxes;
mod conditioning;
mod findings;
pub mod joints;
mod travel;

use serde::Serialize;
use specgen_runtime::Platform;

use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace};

pub use boxes::Boxes;
pub use conditioning::Conditioning;
pub use findings::describe;

/// Interior poses that are checked in addition to the corners.
const INTERIOR_POSES: u32 = 128;
/// Least distance of a leg from its ends, as a share of the stroke, that leaves room for corrections.
const ROOM: f64 = 0.01;

/// Pose from rest, m and rad.
pub type Pose = [f64; 6];

/// Reach of the platform.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reach {
    /// Largest leg displacement, m; the smallest is 0.
    pub stroke: f64,
    /// x, y, z, θx, θy, θz.
    pub axes: [AxisReach; 6],
    /// Smallest and largest leg displacement at the bias, m.
    pub at_bias: [f64; 2],
    /// Scale of the declared workspace, shrunk towards the bias, at which every corner is within reach; 0 to 1.
    pub share: f64,
    /// Smallest and largest leg displacement that corners and interior of the declared workspace would need, m.
    pub demanded: [f64; 2],
    /// No pose in the declared workspace needs more than this in magnitude, m.
    pub demanded_bound: f64,
    /// Conditioning of the geometry.
    pub conditioning: Conditioning,
    /// Largest angle of a joint over the declared workspace, rad: at the base, at the platform.
    pub joint_angles: [f64; 2],
    /// Largest boxes about the middle of the strokes.
    pub boxes: Boxes,
}

/// Reach of one axis with all others fixed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisReach {
    /// Declared bound on its magnitude, m or rad.
    pub declared: f64,
    /// Lowest and highest value, from rest, with the other axes at the middle of all strokes, m or rad.
    pub from_middle: [f64; 2],
    /// The same with the other axes at the bias; at rest if there is no bias.
    pub from_bias: [f64; 2],
}

/// What a path needs of the legs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathReach {
    /// Number of poses.
    pub poses: usize,
    /// Smallest and largest displacement of any leg, m.
    pub displacement: [f64; 2],
    /// Range of shifts in z that keeps all legs within their strokes at every pose, m; none if no shift does.
    pub shift: Option<[f64; 2]>,
}

/// Checks bias and workspace of `model`, whose `[control]` is `task`. `stroke`: travel of every leg, m.
///
/// # Errors
/// A bias out of reach, a bound that its axis cannot reach. (For a nearly singular workspace there is no `platform`:
/// [`crate::lower::platform`] refuses it.)
pub fn check(
    model: &Model,
    task: &TaskSpace,
    platform: &Platform<f64>,
    stroke: f64,
) -> Result<(Reach, Vec<Diagnostic>), Vec<Diagnostic>> {
    let bias = task.setpoint.bias;
    let reach = measure(model, platform, stroke, &bias);
    let legs = travel::Legs::of(model, platform, stroke);
    let found = findings::of(model, &reach, &legs.shift(core::iter::once(bias)));
    if found.iter().any(|one| one.severity == specgen_language::diagnostic::Severity::Error) {
        return Err(found);
    }
    Ok((reach, found))
}

/// Checks the workspace of `model`, whose legs have their own gauges and no bias: set-points are relative to rest, where the
/// legs are at the lower end of their strokes. `stroke`: travel of every leg, m.
///
/// # Errors
/// A bound that its axis cannot reach, if set-points are poses.
pub fn check_legs(
    model: &Model,
    platform: &Platform<f64>,
    stroke: f64,
) -> Result<(Reach, Vec<Diagnostic>), Vec<Diagnostic>> {
    let reach = measure(model, platform, stroke, &[0.0; 6]);
    let found = findings::of_legs(model, &reach);
    if found.iter().any(|one| one.severity == specgen_language::diagnostic::Severity::Error) {
        return Err(found);
    }
    Ok((reach, found))
}

/// Findings about workspace bounds that no pose reaches with the declared stroke.
pub fn check_bounds(model: &Model) -> Vec<Diagnostic> {
    let Ok(platform) = crate::lower::platform(model) else { return Vec::new() };
    let legs = travel::Legs::of(model, &platform, model.actuator.stroke);
    let middle = legs.middle();
    findings::of_bounds(model, legs.stroke, |axis| [-1.0, 1.0].map(|sign| legs.travel(&middle, axis, sign)))
}

/// Notes for `check` about legs that reach beyond their own gauges.
pub fn notes(model: &Model, reach: &Reach) -> Vec<Diagnostic> {
    if model.task_space.is_some() { Vec::new() } else { findings::notes_of_legs(model, reach) }
}

/// The reach with set-points about `bias` (m and rad, from rest). `stroke`: travel of every leg, m.
pub fn measure(model: &Model, platform: &Platform<f64>, stroke: f64, bias: &Pose) -> Reach {
    let bounds = model.workspace.bounds();
    let legs = travel::Legs::of(model, platform, stroke);
    let lengths = model.geometry.rest_legs().map(|[x, y, z]| libm::sqrt(x * x + y * y + z * z));
    let middle = legs.middle();
    let from = |pose: &Pose, axis: usize| [legs.travel(pose, axis, -1.0), legs.travel(pose, axis, 1.0)];
    Reach {
        stroke,
        axes: core::array::from_fn(|axis| AxisReach {
            declared: bounds[axis],
            from_middle: from(&middle, axis),
            from_bias: from(bias, axis),
        }),
        at_bias: legs.span(bias),
        share: legs.share(bias, &bounds),
        demanded: travel::samples(&bounds).map(|pose| legs.span(&pose)).fold([0.0, 0.0], wider),
        demanded_bound: legs.bound(&bounds, &lengths, model.geometry.joint_radius()),
        conditioning: Conditioning::over(
            platform,
            core::iter::once([0.0; 6]).chain(travel::samples(&bounds)),
            shortest(&lengths),
            model.geometry.joint_radius(),
        )
        .bounded(&bounds, shortest(&lengths), model.geometry.joint_radius()),
        joint_angles: joints::angles(&model.geometry, &bounds),
        boxes: Boxes::of(&legs, middle, &bounds),
    }
}

/// Checks the poses of a declared path, bias included. `key`: place of the path in the spec; `name`: its name for users.
///
/// # Errors
/// [`specgen_language::diagnostic::codes::TRAJECTORY_UNREACHABLE`] at `key`, with the shift in z that would make it fit, if one does.
pub fn check_poses(
    model: &Model,
    platform: &Platform<f64>,
    stroke: f64,
    [key, name]: [&str; 2],
    poses: impl Iterator<Item = Pose>,
) -> Result<PathReach, Vec<Diagnostic>> {
    let legs = travel::Legs::of(model, platform, stroke);
    let path = legs.shift(poses);
    match findings::of_path(model, stroke, [key, name], &path) {
        None => Ok(path),
        Some(found) => Err(vec![found]),
    }
}

fn shortest(lengths: &[f64; 6]) -> f64 {
    lengths.iter().fold(f64::INFINITY, |a, b| if *b < a { *b } else { a })
}

fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [if b[0] < a[0] { b[0] } else { a[0] }, if b[1] > a[1] { b[1] } else { a[1] }]
}
