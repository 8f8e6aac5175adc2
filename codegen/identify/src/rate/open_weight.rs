//! Information of a record about the state before it.
//!
//! Let y₋ be the model's displacement if every relay that the first drive u₀ leaves open (up > u₀ > down) is off, y₊ if
//! all are on. D = y₊ − y₋ is the weight of those that the drive has not switched since. It falls as the drive reaches
//! further than before, and the relays switch in one order. So for any earlier state, the displacement is y₋ + A(D)
//! with A(0) = 0 and a slope of A from 0 (those relays were off) to 1 (on). A is piecewise linear in [`PARTS`] equal
//! parts of D. Its slopes are least squares within these bounds, together with the record's offset and line, and the
//! start states of creep and mode. Negative and positive saturation are the slopes 0 and 1, a demagnetised actuator is
//! about ½.

use super::start::RecordColumns;
use crate::staircase::saturate;

/// Parts of A.
const PARTS: usize = 16;
/// Pull towards ½ of a slope that the record does not determine, as a fraction of the mean square of the others.
const PULL: f64 = 1e-6;
const SWEEPS: usize = 5000;
/// An iteration that changes no slope by more is the last.
const SETTLED: f64 = 1e-9;

/// The parts of A behind unit slopes: one signal a part, as long as `open` (D, m), which sum to D.
pub(crate) fn parts(open: &[f64]) -> Vec<Vec<f64>> {
    let most = open.iter().fold(0.0, |most: f64, d| if *d > most { *d } else { most });
    let height = most / PARTS as f64;
    if height <= 0.0 {
        return Vec::new();
    }
    let part = |k: usize| open.iter().map(|d| height * saturate(d / height - k as f64, [0.0, 1.0])).collect();
    (0..PARTS).map(part).collect()
}

/// The slopes with which `rest` ≈ Σ slope·part + the record's own columns.
pub(crate) fn slopes(rest: &[f64], parts: &[Vec<f64>], own: &RecordColumns) -> Vec<f64> {
    let without_own = |values: &[f64]| -> Vec<f64> {
        let mut values = values.to_vec();
        own.take_out(&mut values);
        values
    };
    let columns: Vec<Vec<f64>> = parts.iter().map(|part| without_own(part)).collect();
    let target = without_own(rest);
    let count = columns.len();
    let mut gram: Vec<Vec<f64>> = columns.iter().map(|a| columns.iter().map(|b| own.dot(a, b)).collect()).collect();
    let mut rhs: Vec<f64> = columns.iter().map(|column| own.dot(column, &target)).collect();
    let pull = PULL * (0..count).fold(f64::MIN_POSITIVE, |sum, k| sum + gram[k][k] / count as f64);
    for k in 0..count {
        gram[k][k] += pull;
        rhs[k] += 0.5 * pull;
    }
    let mut slopes = vec![0.5; count];
    for _ in 0..SWEEPS {
        let mut change = 0.0;
        for k in 0..count {
            let wanted =
                slopes[k] + (rhs[k] - gram[k].iter().zip(&slopes).fold(0.0, |sum, (g, s)| sum + g * s)) / gram[k][k];
            let next = saturate(wanted, [0.0, 1.0]);
            let moved = (next - slopes[k]).abs();
            change = if moved > change { moved } else { change };
            slopes[k] = next;
        }
        if change < SETTLED {
            break;
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_within_bounds_come_back_and_one_that_is_not_shown_stays_in_the_middle() {
        let open: Vec<f64> = (0..2000).map(|k| if k < 1500 { 1.0 - k as f64 / 2000.0 } else { 0.25 }).collect();
        let time: Vec<f64> = (0..2000).map(|k| k as f64 * 1e-3).collect();
        let parts = parts(&open);
        let wanted = |k: usize| [1.0, 0.0, 0.3, 0.8][k % 4];
        let rest: Vec<f64> = (0..2000)
            .map(|k| 7.0 - 0.2 * time[k] + (0..PARTS).fold(0.0, |sum, part| sum + wanted(part) * parts[part][k]))
            .collect();
        let own = RecordColumns::of(&time, vec![true; 2000], core::iter::empty(), None);
        let found = slopes(&rest, &parts, &own);
        // The lowest quarter of D is never reached.
        assert!(found[..3].iter().all(|s| (s - 0.5).abs() < 1e-3), "{found:?}");
        for (k, slope) in found.iter().enumerate().skip(5) {
            assert!((slope - wanted(k)).abs() < 0.02, "{k}: {found:?}");
        }
    }
}
