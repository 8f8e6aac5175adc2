//! Finds parts of a record in which the displacement does not follow the drive: a gauge at the end of its range or
//! stuck, with noise, or an amplifier at its limit.

use super::columns::LineNumbers;
use super::findings::Findings;
use super::statistics::{LAG, extent, median, noise_floor, step};
use specgen_language::diagnostic::codes;

/// Travel of the drive that is evaluated, as a fraction of its range, and least number of samples in it.
const TRAVEL: f64 = 0.1;
const SAMPLES: usize = 10;
/// Least time that is skipped after a reversal, s, but at least [`LAG`] samples: a dead time holds the displacement there.
const SKIPPED_TIME: f64 = 1.6e-3;
/// Fraction of the mean gain below which a piezo does not move; after a reversal it moves by about half.
const HARDLY: f64 = 0.08;
/// Least ratio of the travel's displacement to the noise.
const ABOVE_NOISE: f64 = 30.0;
/// Largest peak-to-peak value of noise over a travel, in units of its rms.
const NOISE_EXTENT: f64 = 8.0;

/// Reports every part in which the displacement does not follow the drive.
pub(crate) fn check(lines: &LineNumbers, time: &[f64], drive: &[f64], displacement: &[f64], findings: &mut Findings) {
    let (low, high) = extent(drive);
    let (bottom, top) = extent(displacement);
    let gain = (top - bottom) / (high - low);
    let travel = TRAVEL * (high - low);
    let noise = noise_floor(displacement);
    if gain * travel < ABOVE_NOISE * noise {
        return;
    }
    // Medians of three, so that a glitch at the end of a part has no effect.
    let middle: Vec<f64> = (0..displacement.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(1), (k + 2).min(displacement.len()));
            median(&mut displacement[from..to].to_vec())
        })
        .collect();
    for (first, end, rising) in runs(drive) {
        let sign = if rising { 1.0 } else { -1.0 };
        let after = |at: usize| {
            let count = time[at..].iter().take_while(|t| **t - time[at] < SKIPPED_TIME).count();
            at + if count > LAG { count } else { LAG }
        };
        let mut at = after(first);
        let mut flat: Option<(usize, usize)> = None;
        while at < end {
            let Some(to) = (at..end).find(|&k| k >= at + SAMPLES && (drive[k] - drive[at]).abs() >= travel) else {
                break;
            };
            // After a step, the displacement is given time to follow, whatever the drive does then.
            let seen = if step(&drive[at..=to]).is_some() { after(to) } else { to };
            let seen = if seen < time.len() { seen } else { time.len() - 1 };
            let moved = sign * (middle[seen] - middle[at]);
            let little = HARDLY * gain * (drive[to] - drive[at]).abs();
            // A ringing displacement returns to its start, but has moved in the meantime.
            let (lowest, highest) = extent(&middle[at..=seen]);
            let hardly = moved < little && highest - lowest < little + NOISE_EXTENT * noise;
            flat = match (flat, hardly) {
                (Some((from, _)), true) => Some((from, to)),
                (None, true) => Some((at, to)),
                (found, false) => found,
            };
            if flat.is_some() && !hardly {
                break;
            }
            at += 1 + (to - at) / 8;
        }
        if let Some((from, to)) = flat {
            let (y_low, y_high) = extent(&displacement[from..=to]);
            let near = 0.05 * (top - bottom);
            let where_ = if y_high > top - near || y_low < bottom + near { "is limited at" } else { "is stuck at" };
            let (start, end, level, first) = (time[from], time[to], 0.5e6 * (y_low + y_high), drive[from]);
            let last = drive[to];
            let message = format!(
                "from {start} s to {end} s the displacement {where_} about {level:.4} um while the drive goes from {first} V to {last} V"
            );
            let help =
                "check the range of the gauge, the limit of the amplifier and the preload; record again within them";
            findings.add(codes::RECORD_LIMITED, Some(lines.at(from)), message, help);
        }
    }
}

/// Ranges `first..end` in which the drive does not change direction, and whether it rises.
fn runs(drive: &[f64]) -> Vec<(usize, usize, bool)> {
    let mut runs = Vec::new();
    let mut first = 0;
    let mut rising = None;
    for k in 1..drive.len() {
        let step = drive[k] - drive[k - 1];
        if step == 0.0 {
            continue;
        }
        match rising {
            Some(up) if up != (step > 0.0) => {
                runs.push((first, k, up));
                first = k - 1;
                rising = Some(step > 0.0);
            }
            None => rising = Some(step > 0.0),
            _ => {}
        }
    }
    if let Some(up) = rising {
        runs.push((first, drive.len(), up));
    }
    runs
}
