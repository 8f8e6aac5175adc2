//! Compiles the spec of a command and shows its findings.

use std::path::Path;

use crate::compile::{self, Compilation};
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::spec::{self, SpecSource};
use specgen_language::ui::Ui;

/// Compiles the spec at `path` and shows its findings.
///
/// # Errors
/// The spec is refused.
pub fn compiled(path: &Path, ui: &mut Ui) -> Result<Compilation, Failure> {
    let compiled = quietly(path, ui)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    Ok(compiled)
}

/// The same for a command that only reads values of the spec: the findings in one line.
///
/// # Errors
/// The spec is refused.
pub fn looked_up(path: &Path, ui: &mut Ui) -> Result<Compilation, Failure> {
    let compiled = quietly(path, ui)?;
    ui.findings_in_brief(&compiled.source, &compiled.findings);
    Ok(compiled)
}

/// The same without showing findings. Tables on a fine grid take seconds.
///
/// # Errors
/// The spec is refused.
pub fn quietly(path: &Path, ui: &Ui) -> Result<Compilation, Failure> {
    Ok(ui.during("compiling the spec", || compile::compile(path))?)
}

/// The model of a spec whose records need not exist.
///
/// # Errors
/// The spec is refused.
pub fn model(path: &Path) -> Result<Model, Failure> {
    let source = SpecSource::read(path).map_err(|finding| Refusal { source: None, findings: vec![finding] })?;
    let (model, findings) = spec::load_as_far(&source);
    model.ok_or_else(|| Refusal { source: Some(source), findings }.into())
}

/// Refuses a spec with a warning among `findings`, if warnings are denied.
///
/// # Errors
/// There is a warning, and warnings are denied.
pub fn accept(compiled: &Compilation, findings: &[Diagnostic], deny_warnings: bool) -> Result<(), Failure> {
    if !deny_warnings || findings.iter().all(|one| one.severity < Severity::Warning) {
        return Ok(());
    }
    Err(Refusal { source: Some(compiled.source.clone()), findings: findings.to_vec() }.into())
}
