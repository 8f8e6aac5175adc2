//! The set-points of a spec with the tables of poses that it names.

use std::path::Path;

use crate::figure::{AXES, figure};
use crate::ir::Setpoints;
use crate::lower::scalar;
use specgen_identify::waveform::{self, Waveform};
use specgen_language::diagnostic::{Diagnostic, Place, codes};
use specgen_language::model::{Model, TrajectoryKind};

/// A step between two rows that is this many times its neighbours' is a jump.
const STANDS_OUT: f64 = 4.0;
/// A step that is none, m and rad.
const NO_STEP: [f64; 6] = [5e-9, 5e-9, 5e-9, 50e-9, 50e-9, 50e-9];

/// What the set-points of a spec yield.
#[derive(Debug, Default)]
pub struct Declared {
    /// The constants of the generator; none for six legs with their own gauges.
    pub setpoints: Option<Setpoints>,
    /// Warnings, none of which refuses anything.
    pub warnings: Vec<Diagnostic>,
    /// Name and text of each table of poses.
    pub texts: Vec<(String, String)>,
}

/// Reads the tables of poses that `model` names, relative to `dir`, and lowers its set-points.
///
/// # Errors
/// All findings of the tables, and those of [`super::lower`].
pub fn declared(model: &Model, dir: &Path) -> Result<Declared, Vec<Diagnostic>> {
    let Some(task) = &model.task_space else { return Ok(Declared::default()) };
    let mut texts = Vec::new();
    let mut errors = Vec::new();
    let mut waveforms = Vec::new();
    for trajectory in &task.trajectories {
        let TrajectoryKind::Waveform { file, period, .. } = &trajectory.kind else {
            waveforms.push(None);
            continue;
        };
        let read = waveform::read(&dir.join(file), file, *period);
        waveforms.push(read.map_err(|found| errors.extend(found)).ok().map(|(waveform, text)| {
            texts.push((file.clone(), text));
            waveform
        }));
    }
    let steps = waveforms.iter().flatten().filter_map(step);
    match super::lower(model, task, &waveforms, scalar(model)) {
        Ok((setpoints, warnings)) if errors.is_empty() => {
            Ok(Declared { setpoints: Some(setpoints), warnings: warnings.into_iter().chain(steps).collect(), texts })
        }
        Ok((_, found)) | Err(found) => Err(errors.into_iter().chain(found).chain(steps).collect()),
    }
}

/// A step of a table that stands out from those around it: a jump that no speed limit sees.
pub(crate) fn step(waveform: &Waveform) -> Option<Diagnostic> {
    let largest = |steps: [f64; 4]| steps.into_iter().fold(0.0, |a: f64, b| if b > a { b } else { a });
    (0..6).find_map(|axis| {
        let steps: Vec<f64> = waveform.rows.windows(2).map(|pair| (pair[1][axis] - pair[0][axis]).abs()).collect();
        let around = |k: usize| largest([steps[k - 2], steps[k - 1], steps[k + 1], steps[k + 2]]);
        // From rest every step is larger than the ones before.
        let stands_out = |k: usize| around(k) > 0.0 && steps[k] > STANDS_OUT * around(k) && steps[k] > NO_STEP[axis];
        let at = (2..steps.len().saturating_sub(2)).find(|k| stands_out(*k))?;
        let place = Place::File { path: waveform.shown_as.clone(), line: waveform.lines.get(at + 1).copied() };
        let message = format!(
            "{} steps by {} {} here, by at most {} in the rows around",
            AXES[axis],
            figure(steps[at] * 1e6),
            if axis < 3 { "um" } else { "urad" },
            figure(around(at) * 1e6)
        );
        let help = "a jump between two pieces? The platform rings behind it: join the pieces, or spread the step over some rows";
        Some(Diagnostic::new(codes::WAVEFORM_STEP, "trajectory", place, message, help))
    })
}
