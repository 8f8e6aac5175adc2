//! Hum of the mains in a residual.

use super::RemovedPart;
use crate::least_squares::{fit, mean_square};
use crate::statistics::centred;

/// Frequencies of mains and their first harmonics, Hz.
const MAINS: [f64; 6] = [50.0, 60.0, 100.0, 120.0, 150.0, 180.0];
/// Largest relative deviation of the mains frequency.
const OFF: f64 = 0.004;
/// Frequencies tried on each side, and number of samples used.
const TRIED: i32 = 10;
const SAMPLES: usize = 4000;
/// Harmonics of the drive up to this one do not count as hum.
const HARMONICS: f64 = 8.0;
/// Fraction of the drive above which a frequency belongs to the drive.
const DRIVEN: f64 = 0.001;

/// The strongest hum in `left` up to `highest` (Hz) that is not one of the drive's frequencies.
pub(super) fn take(time: &[f64], drive: &[f64], left: &[f64], highest: f64) -> Option<RemovedPart> {
    let duration = time.last()? - time.first()?;
    let step = time.len().div_ceil(SAMPLES);
    let thin = |values: &[f64]| -> Vec<f64> { values.iter().step_by(step).copied().collect() };
    let (t, few, u) = (thin(time), thin(left), centred(thin(drive)));
    let explained =
        |frequency: f64, values: &[f64]| Some(1.0 - mean_square(&wave(frequency, &t, values)?) / mean_square(values));
    // A record resolves a frequency by the inverse of its duration.
    let between = |mains: f64| if OFF * mains * duration > 1.0 { OFF * mains / f64::from(TRIED) } else { 0.0 };
    let tried = MAINS.iter().flat_map(|mains| (-TRIED..=TRIED).map(move |k| (*mains, k)));
    let tried = tried
        .filter(|(mains, k)| *k == 0 || between(*mains) > 0.0)
        .map(|(mains, k)| mains + f64::from(k) * between(mains));
    let cycles = 0.5 * turns(drive) as f64 / duration;
    let harmonic = |frequency: f64| {
        let order = (frequency / cycles).round();
        (1.0..=HARMONICS).contains(&order) && (frequency - order * cycles).abs() * duration < 1.5
    };
    let best = tried
        .filter(|frequency| frequency * duration > 3.0 && *frequency < highest && !harmonic(*frequency))
        .filter(|frequency| explained(*frequency, &u).is_some_and(|share| share < DRIVEN))
        .filter_map(|frequency| Some((frequency, explained(frequency, &few)?)))
        .fold(
            None,
            |best: Option<(f64, f64)>, found| if best.is_none_or(|best| found.1 > best.1) { Some(found) } else { best },
        );
    let (frequency, _) = best?;
    Some(RemovedPart::of(left, wave(frequency, time, left)?, frequency))
}

/// Number of changes of direction of a signal.
fn turns(values: &[f64]) -> usize {
    let steps = values.windows(2).map(|w| w[1] - w[0]).filter(|step| *step != 0.0);
    let (_, turns) =
        steps.fold((0.0, 0), |(last, turns): (f64, usize), step| (step, turns + usize::from(last * step < 0.0)));
    turns
}

/// `values` without their part of one frequency.
fn wave(frequency: f64, time: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let angle = |t: &f64| core::f64::consts::TAU * frequency * t;
    let sine: Vec<f64> = time.iter().map(|t| libm::sin(angle(t))).collect();
    let cosine: Vec<f64> = time.iter().map(|t| libm::cos(angle(t))).collect();
    fit(&[&sine, &cosine], values).map(|found| found.residual)
}
