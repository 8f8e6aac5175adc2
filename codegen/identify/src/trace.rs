//! Samples of an identification or a validation, for drawing.

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// Drive of each sample, V.
    pub drive: Vec<f64>,
    /// Displacement shifted by the dead time, m.
    pub measured: Vec<f64>,
    /// Displacement minus model, offset and drift, m; NaN for a sample without weight.
    pub residual: Vec<f64>,
}
