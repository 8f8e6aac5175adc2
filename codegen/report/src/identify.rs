//! Measured records in; tables, lines of a spec, figures and pictures out.

mod cause;
pub mod everett;
pub mod gains;
pub mod gauge;
pub mod linear;
pub mod predict;
pub mod rate;
pub mod response;
pub mod stiffness;

use serde::Serialize;
use specgen_identify::Reading;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::outcome::{Failure, Refusal};

use crate::drawing::Plot;

/// How the files of the bench are read, and where a picture of the result goes.
#[derive(Debug)]
pub struct Bench {
    /// Where their headers do not say it.
    pub reading: Reading,
    /// The picture.
    pub plot: Plot,
}

/// What was identified, by its report.
#[derive(Serialize)]
struct Identified<R> {
    /// As it was named.
    #[serde(skip)]
    record: String,
    report: R,
    /// Keys of a spec whose values are measured now; none where the record is simulated.
    measured: Measured,
    /// A line for each file that was written.
    #[serde(skip)]
    files: String,
}

/// Keys of a spec whose values a record gives.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
struct Measured(Vec<String>);

impl Measured {
    /// These; none if the record is `simulated`, which measures nothing.
    fn of(keys: &[&str], simulated: bool) -> Self {
        let keys: &[&str] = if simulated { &[] } else { keys };
        Self(keys.iter().map(|key| (*key).to_owned()).collect())
    }

    /// What becomes of the spec's list of assumed values once the lines stand in it: a comment, so that it may be pasted with them.
    fn text(&self) -> String {
        if self.0.is_empty() {
            return "# simulated, not measured: the spec's `assumed` stays as it is\n".to_owned();
        }
        let list: Vec<String> = self.0.iter().map(|key| format!("\"{key}\"")).collect();
        format!("# measured: take out of the spec's `assumed`, where they are in it: {}\n", list.join(", "))
    }
}

fn refused(findings: Vec<Diagnostic>) -> Failure {
    Failure::from(Refusal { source: None, findings })
}
