//! Resonance in a residual: the response of a mode to the drive, beyond a wrong gain, searched over its frequency.

use super::RemovedPart;
use crate::least_squares::{fit, mean_square};
use crate::mode::Mode;
use crate::statistics::{centred, rates};

/// Frequencies tried for a resonance, from [`SLOWEST`] over the duration to [`FASTEST`] over the sampling interval, and its damping.
const MODES: usize = 48;
const SLOWEST: f64 = 20.0;
const FASTEST: f64 = 0.25;
const DAMPING: f64 = 0.02;
/// Least fraction of the rest that a resonance must explain.
const NOTABLE: f64 = 0.1;
/// Number of samples used in the search.
const STRETCH: usize = 200_000;

/// The mode whose response to the drive explains most of `left`, a residual at the samples `chosen`, beyond a wrong
/// gain.
pub(super) fn take(time: &[f64], drive: &[f64], chosen: &[usize], left: &[f64]) -> Option<RemovedPart> {
    let end = if time.len() < STRETCH { time.len() } else { STRETCH };
    let count = chosen.partition_point(|k| *k < end);
    let (chosen, left_there) = (&chosen[..count], &left[..count]);
    let duration = time.get(end.checked_sub(1)?)? - time[0];
    let (lowest, highest) = (SLOWEST / duration, FASTEST * (end - 1) as f64 / duration);
    if count < MODES || highest <= lowest {
        return None;
    }
    let pick = |values: &[f64]| centred(chosen.iter().map(|&k| values[k]).collect());
    let level = pick(&drive[..end]);
    let before = mean_square(&fit(&[&level], left_there)?.residual);
    let step = libm::log(highest / lowest) / (MODES - 1) as f64;
    // Its response has no jumps.
    let all = vec![true; end];
    let tried = (0..MODES).filter_map(|k| {
        let frequency = lowest * libm::exp(step * k as f64);
        let moved = Mode { frequency, damping: DAMPING }.behind(&time[..end], &drive[..end]);
        // Both phases, because neither the frequency nor the dead time is known to a fraction of a period.
        let (answer, speed) = (pick(&moved), pick(&rates(&time[..end], &moved, &all)));
        let found = fit(&[&level, &answer, &speed], left_there)?;
        Some((frequency, before - mean_square(&found.residual), [answer, speed], found.coefficients))
    });
    let best = tried.reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    if best.1 < NOTABLE * mean_square(left_there) {
        return None;
    }
    let mut rest = left.to_vec();
    for (k, rest) in rest.iter_mut().take(count).enumerate() {
        let gain_and_answer = best.3[1] * best.2[0][k] + best.3[2] * best.2[1][k];
        *rest -= gain_and_answer + (best.3[0] * level[k]);
    }
    Some(RemovedPart::of(left, rest, best.0)).filter(|part| part.explained > 0.0)
}
