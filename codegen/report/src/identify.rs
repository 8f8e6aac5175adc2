//! Identification commands: measured records in; tables, spec lines, figures and pictures out.

mod cause;
pub mod cross_talk;
pub mod estimates;
pub mod everett;
pub mod gains;
pub mod linear;
pub mod predict;
pub mod rate;
mod recorded_run;
pub mod refit;

use serde::Serialize;
use specgen_identify::Reading;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::outcome::{Failure, Refusal};

use crate::drawing::Plot;

/// How record files are read, and the destination of a picture.
#[derive(Debug)]
pub struct Bench {
    /// For files whose headers do not specify it.
    pub reading: Reading,
    /// The picture.
    pub plot: Plot,
}

/// An identification result with its report.
#[derive(Serialize)]
struct IdentificationResult<R> {
    report: R,
    /// Spec keys whose values are now measured; empty if the record is simulated.
    measured: MeasuredKeys,
    /// One line per written file.
    #[serde(skip)]
    files: String,
}

/// Spec keys whose values come from a record.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
struct MeasuredKeys(Vec<String>);

impl MeasuredKeys {
    /// These keys; empty if the record is `simulated`, which measures nothing.
    fn of(keys: &[&str], simulated: bool) -> Self {
        let keys: &[&str] = if simulated { &[] } else { keys };
        Self(keys.iter().map(|key| (*key).to_owned()).collect())
    }

    /// A comment about the spec's list `assumed`, which can be pasted with the spec lines.
    fn text(&self) -> String {
        if self.0.is_empty() {
            return "# simulated, not measured: do not change `assumed` in the spec\n".to_owned();
        }
        let list: Vec<String> = self.0.iter().map(|key| format!("\"{key}\"")).collect();
        format!("# measured: remove from `assumed` in the spec: {}\n", list.join(", "))
    }
}

pub(crate) fn refused(findings: Vec<Diagnostic>) -> Failure {
    Failure::from(Refusal { source: None, findings })
}
