//! What workspace, trajectories and stops demand of the legs, compared with what stacks, tables and amplifiers can do.

use specgen_runtime::Platform;

use crate::ir::Setpoints;
use crate::lint::{self, paths::PathDemand};
use crate::lower::setpoint::{self, Stopping};
use crate::lower::{platform, stroke};
use crate::reach::{self, Reach};
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::model::{Model, TaskSpace};

/// What a spec demands of its legs, all within their capability.
#[derive(Debug, Default)]
pub struct Demand {
    /// Travel of the platform; none if the legs do not determine its pose.
    pub reach: Option<Reach>,
    /// What each trajectory demands of the legs, in the order of the spec.
    pub paths: Vec<PathDemand>,
    /// Stopping distances from every declared speed.
    pub stops: Vec<Stopping>,
    /// Warnings and notes.
    pub warnings: Vec<Diagnostic>,
}

/// Checks that trajectories and stops stay within reach of the legs, as limited by the data sheet's stroke and every leg's table,
/// and that stacks and amplifiers are fast enough.
///
/// # Errors
/// All findings about what is out of reach or too fast.
pub fn check(model: &Model, setpoints: Option<&Setpoints>, strokes: &[f64]) -> Result<Demand, Vec<Diagnostic>> {
    let stroke = stroke(model, strokes);
    match (&model.task_space, setpoints) {
        (Some(task), Some(setpoints)) => of_platform(model, task, &platform(model)?, setpoints, stroke),
        _ => of_legs(model, stroke),
    }
}

/// Legs with their own gauges. If they do not determine a pose, there is nothing to check.
fn of_legs(model: &Model, stroke: f64) -> Result<Demand, Vec<Diagnostic>> {
    let Ok(platform) = platform(model) else { return Ok(Demand::default()) };
    let (reach, warnings) = reach::check_legs(model, &platform, stroke)?;
    Ok(Demand { reach: Some(reach), warnings, ..Demand::default() })
}

fn of_platform(
    model: &Model,
    task: &TaskSpace,
    platform: &Platform<f64>,
    setpoints: &Setpoints,
    stroke: f64,
) -> Result<Demand, Vec<Diagnostic>> {
    let mut errors = Vec::new();
    let reach = reach::check(model, task, platform, stroke).map_err(|found| errors.extend(found));
    let stretches = setpoint::stretches(model, task, setpoints)?;
    let (paths, asked) = lint::paths::check(model, task, platform, &stretches);
    for (index, (trajectory, path)) in task.trajectories.iter().zip(&stretches).enumerate() {
        let key = format!("trajectory[{index}].kind");
        let poses = path.iter().flat_map(|stretch| stretch.poses.iter().copied());
        let reached = reach::check_poses(model, platform, stroke, [&key, &trajectory.name], poses);
        errors.extend(reached.err().unwrap_or_default());
    }
    let stops = setpoint::check_stops(model, task, setpoints, platform, stroke).map_err(|found| errors.extend(found));
    let made = asked.iter().all(|finding| finding.severity < Severity::Error);
    match (reach, stops) {
        (Ok((reach, mut warnings)), Ok(stops)) if made && errors.is_empty() => {
            warnings.extend(asked);
            Ok(Demand { reach: Some(reach), paths, stops, warnings })
        }
        _ => Err(errors.into_iter().chain(asked).collect()),
    }
}
