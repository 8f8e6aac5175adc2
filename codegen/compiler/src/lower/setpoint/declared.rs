//! Reads the tables of poses that a spec names, and lowers its set-points.

use std::path::Path;

use super::corners;
use crate::ir::Setpoints;
use crate::lower::scalar;
use specgen_identify::waveform;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TrajectoryKind};

/// The lowered set-points of a spec.
#[derive(Debug, Default)]
pub struct SpecSetpoints {
    /// The constants of the generator; none for six legs with their own gauges.
    pub setpoints: Option<Setpoints>,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
    /// Name and text of each table of poses.
    pub texts: Vec<(String, String)>,
}

/// Reads the tables of poses that `model` names, relative to `dir`, and lowers its set-points.
///
/// # Errors
/// All findings of the tables, and those of [`super::lower`].
pub fn declared(model: &Model, dir: &Path) -> Result<SpecSetpoints, Vec<Diagnostic>> {
    let Some(task) = &model.task_space else { return Ok(SpecSetpoints::default()) };
    let mut texts = Vec::new();
    let mut errors = Vec::new();
    let mut waveforms = Vec::new();
    for trajectory in &task.trajectories {
        let TrajectoryKind::Waveform { file, period, columns, .. } = &trajectory.kind else {
            waveforms.push(None);
            continue;
        };
        let read = waveform::read(&dir.join(file), file, *period, columns.as_deref());
        waveforms.push(read.map_err(|found| errors.extend(found)).ok().map(|(waveform, text)| {
            texts.push((file.clone(), text));
            waveform
        }));
    }
    let notes = waveforms.iter().flatten().flat_map(|waveform| waveform.warnings.clone());
    let steps = waveforms.iter().flatten().filter_map(corners::step).chain(notes);
    match super::lower(model, task, &waveforms, scalar(model)) {
        Ok((setpoints, warnings)) if errors.is_empty() => Ok(SpecSetpoints {
            setpoints: Some(setpoints),
            warnings: warnings.into_iter().chain(steps).collect(),
            texts,
        }),
        Ok((_, found)) | Err(found) => Err(errors.into_iter().chain(found).chain(steps).collect()),
    }
}
