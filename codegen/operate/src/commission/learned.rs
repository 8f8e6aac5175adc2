//! The trajectories of the spec, learned on the machine: the passes of `specgen learn` over the line.

use std::path::Path;

use serde_json::Value;
use specgen_compiler::compile::Compilation;
use specgen_compiler::ir::Path as Poses;
use specgen_language::files;
use specgen_language::outcome::Failure;
use specgen_language::output::{edit_file, unread_file};
use specgen_language::ui::Ui;
use specgen_studies::lessons::Options;
use specgen_studies::machine::PlantOptions;

use super::state::LearnedFigure;
use crate::learning;
use crate::line::Line;

/// Passes to learn from, and the highest frequency, Hz: those of `specgen learn`.
const PASSES: u32 = 5;
const BANDWIDTH: f64 = 800.0;

/// Names of the trajectories that a machine can learn.
fn names(compiled: &Compilation) -> impl Iterator<Item = &str> {
    let known = compiled.ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories);
    known.filter(|one| matches!(one.path, Poses::Segments { .. })).map(|one| one.name.as_str())
}

/// File of the passes of a trajectory.
fn passes(name: &str) -> String {
    format!("learned-{name}.json")
}

/// Refuses a spec whose controller takes no correction.
pub(super) fn check(compiled: &Compilation) -> Result<(), Failure> {
    let takes = compiled.model.task_space.as_ref().is_some_and(|task| task.correction.is_some());
    if takes && names(compiled).next().is_some() {
        return Ok(());
    }
    Err(Failure::Usage(
        "--learn needs a [[trajectory]] that is not a waveform, and corrections, such as `control.correction = \"2 um\"`, in the spec \
         of the machine: add them, build it again, and repeat"
            .to_owned(),
    ))
}

/// Learns every trajectory on the disarmed machine. Corrections and passes go to the folder.
///
/// # Errors
/// A session or learning fails.
pub(super) fn learn(
    line: Line<'_>,
    spec: &Path,
    compiled: &Compilation,
    machine: &str,
    folder: &Path,
    ui: &Ui,
) -> Result<(), Failure> {
    for name in names(compiled) {
        ui.progress(&format!("learning {name}: at most {PASSES} passes"));
        let options = Options {
            trajectory: Some(name.to_owned()),
            frequency: None,
            passes: PASSES,
            bandwidth: BANDWIDTH,
            vary: Vec::new(),
            prepare: false,
            from: None,
            excite: None,
            response: None,
            on_device: None,
            output: Some(folder.join(format!("correction-{name}.json"))),
            machine: Some(machine.to_owned()),
            plant: PlantOptions { plant: None, no_noise: false, seed: 1 },
        };
        let mut quiet = Ui::called(|_| (), None);
        learning::run(line, spec, &options, compiled.clone(), &mut quiet)?;
        let found = &quiet.into_document()["result"];
        edit_file(&folder.join(passes(name)), format!("{found:#}\n").as_bytes())?;
    }
    Ok(())
}

/// What the passes in the folder show.
///
/// # Errors
/// A file cannot be read.
pub(super) fn figures(folder: &Path, compiled: &Compilation) -> Result<Vec<LearnedFigure>, Failure> {
    let mut all = Vec::new();
    for name in names(compiled) {
        let path = folder.join(passes(name));
        if !path.exists() {
            continue;
        }
        let text = files::text(&path).map_err(|unread| unread_file(&path, &unread))?;
        let lost = || Failure::Gate(format!("{} has no passes: learn again with --learn", path.display()));
        let found: Value = serde_json::from_str(&text).map_err(|_| lost())?;
        let error = |pass: u64| Some(1e-9 * found["passes"][usize::try_from(pass).ok()?]["translation_nm"].as_f64()?);
        let best = found["best"].as_u64().ok_or_else(lost)?;
        all.push(LearnedFigure {
            trajectory: name.to_owned(),
            before: error(0).ok_or_else(lost)?,
            after: error(best).ok_or_else(lost)?,
            passes: best,
            correction: format!("correction-{name}.json"),
        });
    }
    Ok(all)
}
