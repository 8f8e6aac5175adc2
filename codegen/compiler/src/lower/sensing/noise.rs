//! Noise of the pose due to the gauges.

use super::layout;
use crate::lower::kinematics::leg_jacobian;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::Model;
use specgen_numerics::{Matrix6, multiply6};

/// Noise of one gauge reading, of the pose and of the legs, rms. Gauges are independent of each other, and the converter's error is
/// uniform over its step.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PoseNoise {
    /// Noise of a reading, quantisation included, m.
    pub reading: f64,
    /// The converter's share: a step over √12, m.
    pub quantisation: f64,
    /// Noise of x, y, z (m) and θx, θy, θz (rad), by J⁻¹ of the gauges at rest.
    pub pose: [f64; 6],
    /// Noise of each leg displacement computed from the pose, m.
    pub leg: [f64; 6],
}

/// Reading of each gauge (rows) per pose coordinate (columns) at rest, m/m and m/rad; none without gauges on the platform.
///
/// # Errors
/// Gauges that do not determine the pose.
pub fn readings_per_pose(model: &Model) -> Result<Option<[[f64; 6]; 6]>, Vec<Diagnostic>> {
    match &model.task_space {
        Some(task) => Ok(Some(layout::check(model, &task.probes)?.jacobian)),
        None => Ok(None),
    }
}

/// Pose coordinates (rows) per reading of each gauge (columns) at rest, m/m and rad/m; none without gauges on the platform.
///
/// # Errors
/// Gauges that do not determine the pose.
pub fn poses_per_reading(model: &Model) -> Result<Option<Matrix6>, Vec<Diagnostic>> {
    match &model.task_space {
        Some(task) => Ok(Some(layout::check(model, &task.probes)?.inverse)),
        None => Ok(None),
    }
}

/// Noise of a reading, quantisation included, and that of the quantisation alone: a step over √12. Rms, m.
#[must_use]
pub fn reading_noise(model: &Model) -> [f64; 2] {
    let quantisation = model.sensor.step() / libm::sqrt(12.0);
    [libm::sqrt(model.sensor.noise * model.sensor.noise + quantisation * quantisation), quantisation]
}

/// Pose noise of a platform with gauges; none for one without.
///
/// # Errors
/// Gauges that do not determine the pose.
pub fn pose_noise(model: &Model) -> Result<Option<PoseNoise>, Vec<Diagnostic>> {
    let Some(task) = &model.task_space else {
        return Ok(None);
    };
    let layout = layout::check(model, &task.probes)?;
    let [reading, quantisation] = reading_noise(model);
    let norm = |row: [f64; 6]| libm::sqrt(row.iter().fold(0.0, |sum, part| sum + part * part));
    let of_legs = leg_jacobian(&model.geometry).map(|legs| multiply6(&legs, &layout.inverse));
    Ok(Some(PoseNoise {
        reading,
        quantisation,
        pose: layout.inverse.map(|row| reading * norm(row)),
        leg: of_legs.map_or([0.0; 6], |legs| legs.map(|row| reading * norm(row))),
    }))
}
