//! Names what a residual consists of: an ordered account of its mean square.
//!
//! Taken out one after the other, each by least squares on what the ones before it left: a linear drift; what is
//! proportional to the drive's rate (dead time, lag); what first-order creep of the drive explains. White noise is known
//! from second differences. The rest is the model's: cells of finite size, and hysteresis that is not a Preisach model's.

use serde::Serialize;

use super::least_squares::{fit, mean_square};
use super::trend::Line;

/// A source of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Linear in time; not part of the reported residual.
    Drift,
    /// Proportional to the rate of the drive.
    DeadTime,
    /// Slow answer to the drive.
    Creep,
    /// White noise of gauge and converter.
    Noise,
    /// Everything else.
    Model,
}

impl Source {
    /// The cause as messages name it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drift => "drift",
            Self::DeadTime => "dead time or lag",
            Self::Creep => "creep",
            Self::Noise => "noise",
            Self::Model => "model (cells of finite size, hysteresis that no Preisach model has)",
        }
    }
}

/// Shares of the mean square of a residual with its linear drift. They sum to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// The largest share of what is left without the drift.
    pub main: Source,
    /// Shares without the drift, in the order dead time, creep, noise, model; they sum to 1.
    pub shares: Vec<(Source, f64)>,
    /// Root mean square that the removed linear drift had, m.
    pub drift_rms: f64,
    /// Dead time that the part proportional to the rate would mean, s; its sign shows a dead time taken too short (+) or too long (−).
    pub rate_delay: f64,
}

/// Creep time constants tried, as shares of the record's duration.
const CREEP: [f64; 4] = [0.003, 0.02, 0.1, 0.5];
/// Samples that the account is made on; a longer record is taken in even steps.
const SAMPLES: usize = 20_000;

/// The account of `residual` (m) at `time` (s) under `drive` (V), of white noise `noise` (m); `gain` in m/V.
/// `keep` tells the samples that count.
pub(crate) fn explain(time: &[f64], drive: &[f64], residual: &[f64], noise: f64, gain: f64, keep: &[bool]) -> Cause {
    let step = time.len().div_ceil(SAMPLES).max(1);
    let chosen: Vec<usize> = (0..time.len()).filter(|&k| keep[k]).step_by(step).collect();
    let pick = |values: &[f64]| -> Vec<f64> { chosen.iter().map(|&k| values[k]).collect() };
    let (t, mut left) = (pick(time), pick(residual));
    let line = Line::fit(&t, &left);
    let offset = left.iter().fold(0.0, |sum, r| sum + r) / left.len().max(1) as f64;
    let before = left.iter().fold(0.0, |sum, r| sum + (r - offset) * (r - offset)) / left.len().max(1) as f64;
    left.iter_mut().zip(&t).for_each(|(r, t)| *r -= line.at(*t));
    let total = mean_square(&left);
    let removed = before - total;

    let rate = centred(pick(&rates(time, drive)));
    let mut rate_delay = 0.0;
    if let Some(found) = fit(&[&rate], &left) {
        rate_delay = -found.coefficients[0] / gain;
        left = found.residual;
    }
    let after_rate = mean_square(&left);
    let duration = t.last().copied().unwrap_or(0.0) - t.first().copied().unwrap_or(0.0);
    let states: Vec<Vec<f64>> =
        CREEP.iter().map(|share| centred(pick(&lagging(time, drive, share * duration)))).collect();
    // Beside the drive itself, so that a wrong gain is not taken for creep; one after the other keeps every fit solvable.
    let level = centred(pick(drive));
    let mut columns: Vec<&[f64]> = Vec::new();
    let mut after_creep = after_rate;
    let mut gain_part = 0.0;
    if let Some(found) = fit(&[&level], &left) {
        gain_part = after_rate - mean_square(&found.residual);
        columns.push(&level);
        after_creep = after_rate - gain_part;
    }
    for state in &states {
        columns.push(state);
        match fit(&columns, &left) {
            Some(found) => after_creep = mean_square(&found.residual),
            None => drop(columns.pop()),
        }
    }
    let delay = total - after_rate;
    let creep = after_rate - gain_part - after_creep;
    let rest = after_creep + gain_part;
    let noise = if noise * noise < rest { noise * noise } else { rest };
    let share = |part: f64| if total > 0.0 { if part > 0.0 { part / total } else { 0.0 } } else { 0.0 };
    let shares = vec![
        (Source::DeadTime, share(delay)),
        (Source::Creep, share(creep)),
        (Source::Noise, share(noise)),
        (Source::Model, share(rest - noise)),
    ];
    let main = shares.iter().fold(shares[0], |best, s| if s.1 > best.1 { *s } else { best }).0;
    Cause { main, shares, drift_rms: if removed > 0.0 { removed.sqrt() } else { 0.0 }, rate_delay }
}

/// Central differences, V/s.
fn rates(time: &[f64], drive: &[f64]) -> Vec<f64> {
    let last = time.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), if k < last { k + 1 } else { last });
            if b > a { (drive[b] - drive[a]) / (time[b] - time[a]) } else { 0.0 }
        })
        .collect()
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

fn centred(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().fold(0.0, |sum, v| sum + v) / values.len().max(1) as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    values
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
        let rate = rates(&time, &drive);
        let lagged: Vec<f64> = rate.iter().map(|r| -1e-7 * 2e-4 * r).collect();
        let found = explain(&time, &drive, &lagged, 0.0, 1e-7, &keep);
        assert_eq!(found.main, Source::DeadTime);
        // To one per cent: the drift that is taken out first takes a little of it along.
        assert!((found.rate_delay - 2e-4).abs() < 2e-6, "{}", found.rate_delay);
        // Slow against the cycle of 0.2 s: a faster one looks like a lag, which the account takes out first.
        let creep: Vec<f64> = lagging(&time, &drive, 1.0).iter().map(|x| 1e-9 * x).collect();
        assert_eq!(explain(&time, &drive, &creep, 0.0, 1e-7, &keep).main, Source::Creep);
        let steps: Vec<f64> = drive.iter().map(|u| 1e-9 * libm::sin(0.8 * u)).collect();
        assert_eq!(explain(&time, &drive, &steps, 0.0, 1e-7, &keep).main, Source::Model);
        let rms = mean_square(&steps).sqrt();
        assert_eq!(explain(&time, &drive, &steps, rms, 1e-7, &keep).main, Source::Noise);
        let drift: Vec<f64> = time.iter().map(|t| 1e-8 * t).collect();
        let found = explain(&time, &drive, &drift, 0.0, 1e-7, &keep);
        assert!(found.drift_rms > 1e-8, "{}", found.drift_rms);
    }
}
