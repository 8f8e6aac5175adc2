//! What a sustained oscillation is told by.

use serde::Serialize;

/// What a sustained oscillation is told by; the constants of [`specgen_runtime::supervisor::Steadiness`], where each is explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Steadiness {
    /// 1/m and 1/rad, of each axis; or 1/m, of each leg.
    pub per_limit: [f64; 6],
    /// Part of a swing.
    pub follow: f64,
    /// Times a change of the set-point.
    pub motion: f64,
    /// After a tick.
    pub keep: f64,
    /// After a tick.
    pub keep_fallen: f64,
    /// Samples.
    pub one_way: u32,
    /// Samples.
    pub first: u32,
    /// Samples.
    pub next: u32,
}
