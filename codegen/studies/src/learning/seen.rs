//! What a machine showed while it made a motion.

use specgen_runtime::playback::Knot;

/// What a machine showed in a pass, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct PassObservation {
    /// Set-point less what the gauges showed, at the end of each tick, m and rad: the mean over the ticks from knot to knot.
    pub measured: Vec<[f64; 6]>,
    /// Set-point less true pose; what was measured, where nothing else is known.
    pub real: Vec<[f64; 6]>,
    /// What was measured, as it was kept from knot to knot.
    pub kept: Vec<Knot>,
    /// Status bits seen.
    pub status: u32,
}
