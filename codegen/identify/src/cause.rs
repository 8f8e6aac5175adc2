//! Breaks a residual down into its causes: an ordered account of its mean square.
//!
//! The causes are removed one after the other, each by least squares on the rest of those before: a linear drift; a
//! part proportional to the drive's rate (dead time, lag); mains hum; the response of a lightly damped mode to the
//! drive; a curved drift, if it leaves less than half of what creep leaves; first-order creep of the drive. White noise
//! follows from second differences. The remainder belongs to the model: cells of finite size, and hysteresis that is
//! not of Preisach type.

use serde::Serialize;

mod mains;
mod resonance;

use super::least_squares::{fit, mean_square};
use super::statistics::{Line, centred, rates};

specgen_language::named! {
    /// A source of error.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Source {
        /// Linear in time; not part of the reported residual.
        Drift => "drift",
        /// Proportional to the rate of the drive.
        DeadTime => "dead time or lag",
        /// Response of a lightly damped mode to the drive.
        Resonance => "resonance",
        /// Quadratic in time, independent of the drive.
        BentDrift => "drift that bends",
        /// Slow response to the drive.
        Creep => "creep",
        /// At the mains frequency, which the drive does not contain.
        Hum => "hum of the mains",
        /// White noise of gauge and converter.
        Noise => "noise",
        /// Everything else.
        Model => "model (cells of finite size, hysteresis that no Preisach model has)",
    }
}

/// Fractions of the mean square of a residual with its linear drift. They sum to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// The largest fraction after the drift.
    pub main: Source,
    /// Fractions without the drift, in the order dead time, hum, resonance, bent drift, creep, noise, model; they sum
    /// to 1. Resonance, bent drift and hum are present only if they were found.
    pub shares: Vec<(Source, f64)>,
    /// Root mean square that the removed linear drift had, m.
    pub drift_rms: f64,
    /// Dead time that corresponds to the part proportional to the rate, s. Its sign shows whether the dead time in use
    /// is too short (+) or too long (−).
    pub rate_delay: f64,
    /// Frequency of the hum, Hz, if any.
    pub hum: Option<f64>,
    /// Frequency of the resonance, to one step of the search, Hz, if any.
    pub resonance: Option<f64>,
}

/// A bent drift or a hum with a smaller fraction is ignored.
const FOUND: f64 = 0.05;
/// Highest frequency of the search for hum, as a fraction of the sampling frequency.
const RESOLVED: f64 = 0.4;

/// Creep time constants tried, as fractions of the record's duration.
const CREEP: [f64; 4] = [0.003, 0.02, 0.1, 0.5];
/// Number of samples used; a longer record is decimated evenly.
const SAMPLES: usize = 20_000;

/// The account of `residual` (m) at `time` (s) under `drive` (V) with white noise `noise` (m); `gain` in m/V. `keep`
/// selects the samples.
pub(crate) fn explain(time: &[f64], drive: &[f64], residual: &[f64], noise: f64, gain: f64, keep: &[bool]) -> Cause {
    let step = time.len().div_ceil(SAMPLES).max(1);
    let chosen: Vec<usize> = (0..time.len()).filter(|&k| keep[k]).step_by(step).collect();
    let pick = |values: &[f64]| -> Vec<f64> { chosen.iter().map(|&k| values[k]).collect() };
    let (t, whole) = (pick(time), pick(residual));
    let mut left = Line::fit(&t, &whole).removed(&t, &whole);
    let total = mean_square(&left);
    let removed = mean_square(&centred(whole)) - total;

    let rate = centred(pick(&rates(time, drive, keep)));
    let mut rate_delay = 0.0;
    if let Some(found) = fit(&[&rate], &left) {
        rate_delay = -found.coefficients[0] / gain;
        left = found.residual;
    }
    let delay = total - mean_square(&left);
    let all = time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0);
    let highest = RESOLVED * time.len() as f64 / all;
    let hum = mains::take(&t, &pick(drive), &left, highest).filter(|hum| hum.explained > FOUND * total);
    left = hum.as_ref().map_or(left, |hum| hum.left.clone());
    let resonance = resonance::take(time, drive, &chosen, &left);
    left = resonance.as_ref().map_or(left, |resonance| resonance.left.clone());
    let after_rate = mean_square(&left);
    let (creep, bend) = (creep_of(time, drive, &pick, &t, &left), bend_of(&t, &left));
    let bend =
        bend.filter(|bend| 2.0 * mean_square(&bend.left) < mean_square(&creep.left) && bend.explained > FOUND * total);
    let creep = bend.as_ref().map_or(creep, |bend| creep_of(time, drive, &pick, &t, &bend.left)).explained;
    let explained = |part: &Option<RemovedPart>| part.as_ref().map(|part| part.explained);
    let rest = after_rate - explained(&bend).unwrap_or_default() - creep;
    let noise = if noise * noise < rest { noise * noise } else { rest };
    let share = |part: f64| if total > 0.0 { if part > 0.0 { part / total } else { 0.0 } } else { 0.0 };
    let shares: Vec<(Source, f64)> = [
        (Source::DeadTime, Some(delay)),
        (Source::Hum, explained(&hum)),
        (Source::Resonance, explained(&resonance)),
        (Source::BentDrift, explained(&bend)),
        (Source::Creep, Some(creep)),
        (Source::Noise, Some(noise)),
        (Source::Model, Some(rest - noise)),
    ]
    .into_iter()
    .filter_map(|(source, part)| Some((source, share(part?))))
    .collect();
    let main = shares.iter().fold(shares[0], |best, s| if s.1 > best.1 { *s } else { best }).0;
    let drift_rms = if removed > 0.0 { removed.sqrt() } else { 0.0 };
    let frequency = |part: Option<RemovedPart>| part.map(|part| part.frequency);
    Cause { main, shares, drift_rms, rate_delay, hum: frequency(hum), resonance: frequency(resonance) }
}

/// A part that was removed.
struct RemovedPart {
    /// Reduction of the residual's mean square.
    explained: f64,
    /// The residual without it.
    left: Vec<f64>,
    /// Hz; 0 for a part without one.
    frequency: f64,
}

impl RemovedPart {
    fn of(before: &[f64], left: Vec<f64>, frequency: f64) -> Self {
        Self { explained: mean_square(before) - mean_square(&left), left, frequency }
    }
}

/// The part that a parabola over time explains.
fn bend_of(time: &[f64], left: &[f64]) -> Option<RemovedPart> {
    let middle = 0.5 * (time.first()? + time.last()?);
    let line = centred(time.to_vec());
    let bent = centred(time.iter().map(|t| (t - middle) * (t - middle)).collect());
    let found = fit(&[&line, &bent], left)?;
    Some(RemovedPart::of(left, found.residual, 0.0))
}

/// The part that creep explains in addition to the drive itself, so that a wrong gain does not count as creep. Time
/// constants are added one by one, so that every fit is solvable. `pick` takes the samples at `chosen` from all.
fn creep_of(
    time: &[f64],
    drive: &[f64],
    pick: &impl Fn(&[f64]) -> Vec<f64>,
    chosen: &[f64],
    left: &[f64],
) -> RemovedPart {
    let duration = chosen.last().copied().unwrap_or(0.0) - chosen.first().copied().unwrap_or(0.0);
    let states: Vec<Vec<f64>> =
        CREEP.iter().map(|share| centred(pick(&lagging(time, drive, share * duration)))).collect();
    let level = centred(pick(drive));
    let Some(gain) = fit(&[&level], left) else {
        return RemovedPart::of(left, left.to_vec(), 0.0);
    };
    let mut columns: Vec<&[f64]> = vec![&level];
    // The part of the gain stays with the model.
    let mut best = RemovedPart::of(left, left.to_vec(), 0.0);
    for state in &states {
        columns.push(state);
        match fit(&columns, left) {
            Some(found) => best = RemovedPart::of(&gain.residual, found.residual, 0.0),
            None => drop(columns.pop()),
        }
    }
    best
}

/// First-order lag of `drive` with time constant `tau` (s), started at its first value.
pub(crate) fn lagging(time: &[f64], drive: &[f64], tau: f64) -> Vec<f64> {
    let mut state = drive.first().copied().unwrap_or(0.0);
    (0..time.len())
        .map(|k| {
            if k > 0 {
                let dt = time[k] - time[k - 1];
                state += (drive[k - 1] - state) * (1.0 - libm::exp(-dt / tau));
            }
            state
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(n: usize) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..n).map(|k| k as f64 * 1e-3).collect();
        let drive = (0..n)
            .map(|k| {
                let p = (k % 200) as f64;
                if p < 100.0 { p } else { 200.0 - p }
            })
            .collect();
        (time, drive)
    }

    #[test]
    fn each_source_is_named_when_it_is_the_only_one() {
        let (time, drive) = triangle(4000);
        let keep = vec![true; 4000];
        let rate = rates(&time, &drive, &keep);
        let lagged: Vec<f64> = rate.iter().map(|r| -1e-7 * 2e-4 * r).collect();
        let found = explain(&time, &drive, &lagged, 0.0, 1e-7, &keep);
        assert_eq!(found.main, Source::DeadTime);
        // To one per cent: the drift that is removed first takes a small part with it.
        assert!((found.rate_delay - 2e-4).abs() < 2e-6, "{}", found.rate_delay);
        // A jump at the end is excluded, and is not the rate of the sample before it.
        let (mut jumping, mut kept) = (drive.clone(), keep.clone());
        (jumping[3999], kept[3999]) = (1e4, false);
        assert_eq!(explain(&time, &jumping, &lagged, 0.0, 1e-7, &kept).main, Source::DeadTime);
        // Slow compared with the cycle of 0.2 s: a faster one looks like a lag, which is removed first.
        let creep: Vec<f64> = lagging(&time, &drive, 1.0).iter().map(|x| 1e-9 * x).collect();
        assert_eq!(explain(&time, &drive, &creep, 0.0, 1e-7, &keep).main, Source::Creep);
        let steps: Vec<f64> = drive.iter().map(|u| 1e-9 * libm::sin(0.8 * u)).collect();
        assert_eq!(explain(&time, &drive, &steps, 0.0, 1e-7, &keep).main, Source::Model);
        let rms = mean_square(&steps).sqrt();
        assert_eq!(explain(&time, &drive, &steps, rms, 1e-7, &keep).main, Source::Noise);
        let hum: Vec<f64> = time.iter().map(|t| 1e-9 * libm::sin(core::f64::consts::TAU * 49.98 * t)).collect();
        let found = explain(&time, &drive, &hum, 0.0, 1e-7, &keep);
        assert!(found.main == Source::Hum && found.hum.is_some_and(|f| (f - 49.98).abs() < 0.1), "{found:?}");
        let bent: Vec<f64> = time.iter().map(|t| 1e-9 * t * t).collect();
        assert_eq!(explain(&time, &drive, &bent, 0.0, 1e-7, &keep).main, Source::BentDrift);
        let resonant = crate::mode::Mode { frequency: 90.0, damping: 0.02 }.behind(&time, &drive);
        let resonant: Vec<f64> = resonant.iter().zip(&drive).map(|(y, u)| 1e-8 * (y - u)).collect();
        let found = explain(&time, &drive, &resonant, 0.0, 1e-7, &keep);
        assert_eq!(found.main, Source::Resonance, "{found:?}");
        assert!((found.resonance.unwrap() / 90.0 - 1.0).abs() < 0.1, "{found:?}");
        let drift: Vec<f64> = time.iter().map(|t| 1e-8 * t).collect();
        let found = explain(&time, &drive, &drift, 0.0, 1e-7, &keep);
        assert!(found.drift_rms > 1e-8, "{}", found.drift_rms);
    }
}
