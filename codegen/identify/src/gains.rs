//! Gain of each leg of a platform relative to its table, from a recorded run of the machine: λ = ρ/ρ̂ of (AII.13).
//!
//! The table follows the voltages of the run. A leg moves by λ times that, from an unknown offset (the previous state
//! of its memory, and its load) and with a slow drift (creep, temperature). Forces on the platform under motion are not
//! compensated: a record of slow motion, well below the lowest mode, has almost none.

use serde::Serialize;

use super::least_squares::{fit, mean_square};
use super::rate::RateModel;
use super::rate::predict::{Drive, predict};
use super::statistics::{extent, mean_and_error};
use crate::everett::EverettTable;
use specgen_language::diagnostic::Diagnostic;

/// Parts of a run that are also fitted separately: their spread gives the error of the whole.
const PARTS: usize = 8;
/// A part needs at least this many samples.
const SAMPLES: usize = 16;

/// One leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegGain {
    /// λ: displacement divided by that of the table.
    pub gain: f64,
    /// Standard error of λ, from the spread of the parts of the run.
    pub error: f64,
    /// Difference of the highest and lowest displacement, m.
    pub travel: f64,
    /// Root mean square residual, m.
    pub residual_rms: f64,
    /// The same with λ = 1, m.
    pub residual_before: f64,
}

/// λ of a leg with `model` whose voltage (V) and displacement (m) were recorded at `time` (s, rising). None if it did
/// not move enough: the motion is within its noise, or almost absent in one part.
///
/// # Errors
/// As [`predict`]: the drive never moves, or leaves the range of the table.
pub fn of(
    model: &RateModel,
    time: &[f64],
    voltage: &[f64],
    displacement: &[f64],
    shown_as: &str,
) -> Result<Option<LegGain>, Vec<Diagnostic>> {
    let predicted = predict(model, &Drive::of_voltage(shown_as, time.to_vec(), voltage.to_vec()))?;
    let measured = displacement.get(predicted.samples_skipped..).unwrap_or_default();
    let times = &predicted.time;
    let slope = |range: std::ops::Range<usize>| {
        let (x, y) = (&predicted.displacement[range.clone()], &measured[range.clone()]);
        let one = vec![1.0; x.len()];
        fit(&[x, &one, &times[range]], y).map(|found| (found.coefficients[0], mean_square(&found.residual)))
    };
    let count = measured.len();
    let parts: Option<Vec<f64>> = (0..PARTS)
        .map(|k| k * count / PARTS..(k + 1) * count / PARTS)
        .map(|range| if range.len() < SAMPLES { None } else { slope(range).map(|(gain, _)| gain) })
        .collect();
    let (Some(parts), Some((gain, square))) = (parts, slope(0..count)) else { return Ok(None) };
    let one = vec![1.0; count];
    let off: Vec<f64> = measured.iter().zip(&predicted.displacement).map(|(y, x)| y - x).collect();
    let before = fit(&[&one, times], &off).map_or(0.0, |found| mean_square(&found.residual));
    let (low, high) = extent(measured);
    Ok(Some(LegGain {
        gain,
        error: mean_and_error(&parts).1,
        travel: high - low,
        residual_rms: square.sqrt(),
        residual_before: before.sqrt(),
    }))
}

/// The table of a leg whose gain is λ times that of `table`.
#[must_use]
pub fn scaled(table: &EverettTable, gain: f64) -> EverettTable {
    EverettTable { nodes: table.nodes.iter().map(|node| node * gain).collect(), ..table.clone() }
}
