//! Measurements of a machine during a pass.

use specgen_runtime::playback::Knot;

/// Observation of a pass, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct PassObservation {
    /// Set-point minus gauge pose at the end of each tick, m and rad: the mean over the ticks between knots.
    pub measured: Vec<[f64; 6]>,
    /// Set-point minus true pose; the measured error if the true pose is unknown.
    pub real: Vec<[f64; 6]>,
    /// The measured error as recorded, one value per knot.
    pub kept: Vec<Knot>,
    /// Accumulated status bits.
    pub status: u32,
}
