//! What workspace, trajectories and stops ask of the legs, against what stacks, tables and amplifiers can do.

use specgen_runtime::Platform;

use crate::ir::Setpoints;
use crate::lint::{self, paths::PathDemand};
use crate::lower::setpoint::{self, Stopping};
use crate::lower::{platform, stroke};
use crate::reach::{self, Reach};
use specgen_identify::everett::EverettTable;
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::model::{Model, TaskSpace};

/// What a spec asks of its legs, all of it within what they can do.
#[derive(Debug, Default)]
pub struct Demand {
    /// Travel of the platform; none for legs that do not hold one.
    pub reach: Option<Reach>,
    /// What each trajectory asks of the legs, in the order of the spec.
    pub paths: Vec<PathDemand>,
    /// How far stops go, from every declared speed.
    pub stops: Vec<Stopping>,
    /// Warnings and notes, none of which refuses anything.
    pub warnings: Vec<Diagnostic>,
}

/// Checks where the legs reach, and that trajectories and stops stay there: as far as both the data sheet's stroke and every
/// leg's table allow. And that stacks and amplifiers make them.
///
/// # Errors
/// All findings about what is out of reach or too fast.
pub fn check(model: &Model, setpoints: Option<&Setpoints>, tables: &[EverettTable]) -> Result<Demand, Vec<Diagnostic>> {
    let stroke = stroke(model, tables);
    match (&model.task_space, setpoints) {
        (Some(task), Some(setpoints)) => of_platform(model, task, &platform(model)?, setpoints, stroke),
        _ => of_legs(model, stroke),
    }
}

/// Legs may be driven one by one where they do not hold a platform: then there is no pose to look at.
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
