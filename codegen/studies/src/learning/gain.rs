//! Whether a pass is better than another one by more than passes differ without learning.
//!
//! ```text
//! d: error of a pass less that of another one under the same correction, tick by tick
//! d_b = mean of (e + e') d over part b of the motion, b = 1 … B
//! noise = max(2 √Σ d_b² / B, |Σ d_b| / B)
//! ```
//! The mean squares of two errors e and e' that differ by d differ by the mean of (e + e') d. So `noise` is what the mean squares of two passes
//! differ by when nothing was learned in between: twice the standard error of their difference if the parts differ at random, the difference itself
//! if all of them differ alike, as drift makes them. It holds the noise of both passes, and scales with what is left of the error.

use std::cmp::Ordering;

use super::motion::Motion;
use super::seen::PassObservation;

/// B: parts of a motion.
const PARTS: usize = 16;
/// Standard errors that count as noise.
const SURE: f64 = 2.0;

/// Of the translation, of the angles times the radius of the joints, and of both.
type Kinds = [f64; 3];

/// What a pass showed by the gauges, over the motion itself.
#[derive(Debug, Clone)]
pub(super) struct Score {
    /// Mean squares, m².
    squares: Kinds,
    /// Error tick by tick, angles times the radius, m.
    error: Vec<[f64; 6]>,
}

/// By what passes under the same correction differ, tick by tick, m.
#[derive(Debug, Clone)]
pub(super) struct Noise(Vec<[f64; 6]>);

/// What becomes of a pass and its correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It gains: its correction is kept.
    Keep,
    /// Within the noise: learning goes on, and the correction is not kept.
    GoOn,
    /// Learning ends, and the correction is not kept.
    Stop,
}

/// Judges passes one after the other.
pub(super) struct Judge {
    noise: Noise,
    first: Score,
    best: Score,
    /// The last pass gained nothing.
    idle: bool,
}

impl Judge {
    /// After the `first` pass and the one before it, under the same correction.
    pub(super) fn new(first: Score, before: &Score) -> Self {
        let (first, noise) = first.repeated(before);
        Self { noise, best: first.clone(), first, idle: false }
    }

    /// What repetitions of the first pass differ by in the root mean square of the whole error, nm.
    pub(super) fn noise_nm(&self) -> f64 {
        self.noise.nm(&self.first)
    }

    /// The next pass.
    pub(super) fn judge(&mut self, pass: Score) -> Verdict {
        match pass.beside([&self.first, &self.best], &self.noise) {
            Some(Ordering::Less) => {
                (self.best, self.idle) = (pass, false);
                Verdict::Keep
            }
            Some(Ordering::Equal) if !self.idle => {
                self.idle = true;
                Verdict::GoOn
            }
            _ => Verdict::Stop,
        }
    }
}

/// Sum of products along the three axes from this one on.
fn product(a: &[f64; 6], b: &[f64; 6], first: usize) -> f64 {
    (first..first + 3).map(|axis| a[axis] * b[axis]).sum()
}

fn kinds(of: impl Fn(usize) -> f64) -> Kinds {
    let [translation, angles] = [of(0), of(3)];
    [translation, angles, translation + angles]
}

impl Score {
    /// Of a pass.
    pub(super) fn of(seen: &PassObservation, motion: &Motion) -> Self {
        let scaled =
            |error: &[f64; 6]| std::array::from_fn(|axis| error[axis] * if axis < 3 { 1.0 } else { motion.radius });
        let error: Vec<[f64; 6]> = seen.measured[motion.scored.clone()].iter().map(scaled).collect();
        let mean = |first| error.iter().map(|error| product(error, error, first)).sum::<f64>() / error.len() as f64;
        Self { squares: kinds(mean), error }
    }

    /// Of the first pass, beside the one before it under the same correction, and the noise of both. Its error is their mean: that of one alone is
    /// not independent of the noise.
    pub(super) fn repeated(self, before: &Self) -> (Self, Noise) {
        let pairs = || self.error.iter().zip(&before.error);
        let of = |with: fn(f64, f64) -> f64| {
            pairs().map(|(a, b)| std::array::from_fn(|axis| with(a[axis], b[axis]))).collect::<Vec<[f64; 6]>>()
        };
        let (mean, difference) = (of(|a, b| 0.5 * (a + b)), of(|a, b| a - b));
        (Self { error: mean, ..self }, Noise(difference))
    }

    /// How this pass stands to the best one: less if it is better by more than the noise, and neither translation nor angles are worse than in the
    /// first pass by more than that; greater if it is worse than one of them by more than the noise; equal in between, none if it is no number.
    pub(super) fn beside(&self, [first, best]: [&Self; 2], noise: &Noise) -> Option<Ordering> {
        let ([.., both], [.., least]) = (self.squares, best.squares);
        let [.., apart] = noise.between(self, best);
        let allowed = noise.between(self, first);
        let worse = (0..2).any(|kind| self.squares[kind] > first.squares[kind] + allowed[kind]);
        if !both.is_finite() {
            None
        } else if worse || both > least + apart {
            Some(Ordering::Greater)
        } else if both < least - apart {
            Some(Ordering::Less)
        } else {
            Some(Ordering::Equal)
        }
    }
}

impl Noise {
    /// What the mean squares of two passes differ by without learning, m².
    fn between(&self, one: &Score, other: &Score) -> Kinds {
        let width = self.0.len().div_ceil(PARTS).max(1);
        let count = self.0.len().div_ceil(width) as f64;
        let of = |axes: &[usize]| {
            let at = |tick: usize| -> f64 {
                let sum: [f64; 6] = std::array::from_fn(|axis| one.error[tick][axis] + other.error[tick][axis]);
                axes.iter().map(|first| product(&sum, &self.0[tick], *first)).sum()
            };
            let parts = (0..self.0.len()).step_by(width).map(|first| {
                let part = first..self.0.len().min(first + width);
                part.clone().map(at).sum::<f64>() / part.len() as f64
            });
            let [sum, squares] = parts.fold([0.0; 2], |[sum, squares], part| [sum + part, squares + part * part]);
            let (by_chance, alike) = (SURE * libm::sqrt(squares), f64::abs(sum));
            (if by_chance > alike { by_chance } else { alike }) / count
        };
        [of(&[0]), of(&[3]), of(&[0, 3])]
    }

    /// In the root mean square of the whole error of a pass, nm.
    pub(super) fn nm(&self, score: &Score) -> f64 {
        let [.., both] = self.between(score, score);
        let root = libm::sqrt(score.squares[2]);
        if root > 0.0 { 1e9 * both / (2.0 * root) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICKS: usize = 320;

    /// x and rx of every tick.
    fn score(x: impl Fn(usize) -> f64, rx: f64) -> Score {
        let error: Vec<[f64; 6]> = (0..TICKS).map(|tick| [x(tick), 0.0, 0.0, rx, 0.0, 0.0]).collect();
        let mean = |first| error.iter().map(|error| product(error, error, first)).sum::<f64>() / TICKS as f64;
        Score { squares: kinds(mean), error }
    }

    /// Two passes of 3 and 1 that differ by 0.2 at random.
    fn equal() -> (Score, Noise) {
        let other = |tick: usize| if (tick / 20).is_multiple_of(2) { 3.1 } else { 2.9 };
        score(|tick| 6.0 - other(tick), 1.0).repeated(&score(other, 1.0))
    }

    #[test]
    fn a_gain_is_more_than_two_equal_passes_differ_by() {
        let (first, noise) = equal();
        // Parts of ±0.2 · 6: the mean of sixteen of them is known to 2 · 1.2/√16.
        let found = noise.between(&first, &first);
        for (found, expected) in found.iter().zip([0.6, 0.0, 0.6]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert!((noise.nm(&first) * 1e-9 - 0.3 / libm::sqrt(10.01)).abs() < 1e-12);
        let beside = |x: f64, rx: f64| score(|_| x, rx).beside([&first, &first], &noise);
        for (x, rx, expected) in [
            (2.8, 1.0, Some(Ordering::Less)),
            (2.95, 1.0, Some(Ordering::Equal)),
            (3.05, 1.0, Some(Ordering::Equal)),
            (3.3, 1.0, Some(Ordering::Greater)),
            // The sum is less, and a part of it worse than without learning.
            (1.0, 1.1, Some(Ordering::Greater)),
            (3.3, 0.0, Some(Ordering::Greater)),
            (3.05, 0.0, Some(Ordering::Less)),
            (f64::NAN, 1.0, None),
        ] {
            assert_eq!(beside(x, rx), expected, "{x} {rx}");
        }
        // Better than the first, and not than the best; the smaller the error, the smaller the noise.
        let best = score(|_| 0.5, 0.0);
        assert_eq!(score(|_| 0.65, 0.0).beside([&first, &best], &noise), Some(Ordering::Greater));
        assert_eq!(score(|_| 0.45, 0.0).beside([&first, &best], &noise), Some(Ordering::Equal));
        assert_eq!(score(|_| 0.3, 0.0).beside([&first, &best], &noise), Some(Ordering::Less));
    }

    #[test]
    fn two_passes_without_a_gain_or_one_that_is_worse_end_learning() {
        let before = |tick: usize| if (tick / 20).is_multiple_of(2) { 3.1 } else { 2.9 };
        let judged = |passes: &[f64]| -> Vec<Verdict> {
            let mut judge = Judge::new(score(|tick| 6.0 - before(tick), 1.0), &score(before, 1.0));
            passes.iter().map(|x| judge.judge(score(|_| *x, 1.0))).collect()
        };
        use Verdict::{GoOn, Keep, Stop};
        assert_eq!(judged(&[1.0, 0.99, 0.5, 0.5, 0.49]), [Keep, GoOn, Keep, GoOn, Stop]);
        assert_eq!(judged(&[2.99, 3.0]), [GoOn, Stop]);
        assert_eq!(judged(&[4.4]), [Stop]);
        assert_eq!(judged(&[1.0, f64::NAN]), [Keep, Stop]);
    }

    #[test]
    fn drift_counts_whole() {
        let (first, noise) = score(|_| 3.1, 1.0).repeated(&score(|_| 3.0, 1.0));
        let [translation, ..] = noise.between(&first, &first);
        assert!((translation - 0.61).abs() < 1e-12, "{translation}");
    }
}
