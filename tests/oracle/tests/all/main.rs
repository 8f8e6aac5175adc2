//! Figures of the feasibility studies with the oracles in the loop, and tests of the rig, in one binary.
#![allow(clippy::unwrap_used)] // Helpers of tests, where a panic is a failed test.

mod legs;
mod platform;
mod rig;

/// The larger of two errors. Unlike `f64::max` it keeps a NaN, which no bound admits.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}
