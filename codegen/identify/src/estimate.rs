//! Estimates of values of a spec from a record: what every kind of them has in common.

use serde::{Deserialize, Serialize};

use super::findings::Findings;
use super::signals::{self, ColumnSpec, Input, Signals};
use specgen_language::diagnostic::Diagnostic;

/// What a record gives: values, and where they come from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate<V> {
    /// Name of the record.
    pub record: String,
    /// Whether a comment in it marks it as simulated.
    pub simulated: bool,
    /// Values, their standard errors and residuals.
    #[serde(flatten)]
    pub value: V,
    /// Findings that do not refuse the record.
    #[serde(skip)]
    pub warnings: Vec<Diagnostic>,
}

/// A parameter of a model, and its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Parameter {
    /// The value, in its unit.
    pub value: f64,
    /// Standard error, in its unit; 0 for a parameter held at zero.
    pub error: f64,
}

/// Reads the columns `wanted` and estimates from them. `estimate` returns `None` after it has reported why.
pub(crate) fn of<V>(
    input: Input,
    shown_as: &str,
    wanted: &[ColumnSpec],
    estimate: impl FnOnce(&Signals, &mut Findings) -> Option<V>,
) -> Result<Estimate<V>, Vec<Diagnostic>> {
    let signals = signals::read(input, shown_as, wanted)?;
    let mut findings = Findings::after(shown_as, &signals.warnings);
    let value = estimate(&signals, &mut findings);
    let (value, warnings) = findings.conclude(value)?;
    Ok(Estimate { record: signals.shown_as, simulated: signals.simulated, value, warnings })
}
