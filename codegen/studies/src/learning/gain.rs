//! Decides whether a pass is better than another by more than passes differ without learning.
//!
//! ```text
//! d: difference in error of two passes under the same correction, tick by tick
//! d_b = mean of (e + e') d over part b of the motion, b = 1 … B
//! noise = max(2 √Σ d_b² / B, |Σ d_b| / B)
//! ```
//! If two errors e and e' differ by d, their mean squares differ by the mean of (e + e') d. So `noise` is the difference in mean square of two
//! passes without learning in between: twice the standard error if the parts differ at random, the difference itself
//! if all parts differ alike, as with drift. It contains the noise of both passes and scales with the remaining error.

use std::cmp::Ordering;

use super::motion::Motion;
use super::observation::PassObservation;

/// B: number of parts of a motion.
const PARTS: usize = 16;
/// Number of standard errors that count as noise.
const SURE: f64 = 2.0;

/// For translation, for angles times the joint radius, and for both.
type Kinds = [f64; 3];

/// Measured error of a pass, over the motion itself.
#[derive(Debug, Clone)]
pub(super) struct Score {
    /// Mean squares, m².
    squares: Kinds,
    /// Error tick by tick, angles times the radius, m.
    error: Vec<[f64; 6]>,
}

/// Difference between passes under the same correction, tick by tick, m.
#[derive(Debug, Clone)]
pub(super) struct Noise(Vec<[f64; 6]>);

/// Decision on a pass and its correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// An improvement: keep its correction.
    Keep,
    /// Within the noise: continue learning, discard the correction.
    GoOn,
    /// Worse: discard the correction, which changed too much.
    Worse,
    /// Stop learning, discard the correction.
    Stop,
}

/// Decides on one pass after the other.
pub(super) struct Judge {
    noise: Noise,
    first: Score,
    best: Score,
    /// The last pass was no improvement.
    idle: bool,
}

impl Judge {
    /// From the `first` pass and the one before it under the same correction.
    pub(super) fn new(first: Score, before: &Score) -> Self {
        let (first, noise) = first.repeated(before);
        Self { noise, best: first.clone(), first, idle: false }
    }

    /// Noise of the first pass in terms of its rms error, nm.
    pub(super) fn noise_nm(&self) -> f64 {
        self.noise.nm(&self.first)
    }

    /// Decides on the next pass.
    pub(super) fn judge(&mut self, pass: Score) -> Verdict {
        match pass.compare([&self.first, &self.best], &self.noise) {
            Some(Ordering::Less) => {
                (self.best, self.idle) = (pass, false);
                Verdict::Keep
            }
            Some(Ordering::Equal) if !self.idle => {
                self.idle = true;
                Verdict::GoOn
            }
            Some(Ordering::Greater) => {
                self.idle = false;
                Verdict::Worse
            }
            _ => Verdict::Stop,
        }
    }
}

/// Sum of products of three axes, starting at `first`.
fn product(a: &[f64; 6], b: &[f64; 6], first: usize) -> f64 {
    (first..first + 3).map(|axis| a[axis] * b[axis]).sum()
}

fn kinds(of: impl Fn(usize) -> f64) -> Kinds {
    let [translation, angles] = [of(0), of(3)];
    [translation, angles, translation + angles]
}

impl Score {
    /// The score of a pass.
    pub(super) fn of(seen: &PassObservation, motion: &Motion) -> Self {
        let scaled =
            |error: &[f64; 6]| std::array::from_fn(|axis| error[axis] * if axis < 3 { 1.0 } else { motion.radius });
        let error: Vec<[f64; 6]> = seen.measured[motion.scored.clone()].iter().map(scaled).collect();
        let mean = |first| error.iter().map(|error| product(error, error, first)).sum::<f64>() / error.len() as f64;
        Self { squares: kinds(mean), error }
    }

    /// The score of the first pass and its noise, from two passes under the same correction. Uses the mean of both errors: the error of one
    /// alone is not independent of the noise.
    pub(super) fn repeated(self, before: &Self) -> (Self, Noise) {
        let pairs = || self.error.iter().zip(&before.error);
        let of = |with: fn(f64, f64) -> f64| {
            pairs().map(|(a, b)| std::array::from_fn(|axis| with(a[axis], b[axis]))).collect::<Vec<[f64; 6]>>()
        };
        let (mean, difference) = (of(|a, b| 0.5 * (a + b)), of(|a, b| a - b));
        (Self { error: mean, ..self }, Noise(difference))
    }

    /// Compares this pass with the best one. `Less`: better by more than the noise, with neither translation nor angles worse than in the
    /// first pass by more than the noise. `Greater`: worse in one of them by more than the noise. `Equal`: in between. `None`: not a number.
    pub(super) fn compare(&self, [first, best]: [&Self; 2], noise: &Noise) -> Option<Ordering> {
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
    /// Difference in mean square of two passes without learning, m².
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

    /// The noise in terms of the rms error of a pass, nm.
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

    /// Errors x and rx in every tick.
    fn score(x: impl Fn(usize) -> f64, rx: f64) -> Score {
        let error: Vec<[f64; 6]> = (0..TICKS).map(|tick| [x(tick), 0.0, 0.0, rx, 0.0, 0.0]).collect();
        let mean = |first| error.iter().map(|error| product(error, error, first)).sum::<f64>() / TICKS as f64;
        Score { squares: kinds(mean), error }
    }

    /// Two passes of 3 and 1 with a random difference of 0.2.
    fn equal() -> (Score, Noise) {
        let other = |tick: usize| if (tick / 20).is_multiple_of(2) { 3.1 } else { 2.9 };
        score(|tick| 6.0 - other(tick), 1.0).repeated(&score(other, 1.0))
    }

    #[test]
    fn an_improvement_exceeds_the_noise_of_equal_passes() {
        let (first, noise) = equal();
        // Parts of ±0.2 · 6: the mean of sixteen parts is known to 2 · 1.2/√16.
        let found = noise.between(&first, &first);
        for (found, expected) in found.iter().zip([0.6, 0.0, 0.6]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert!((noise.nm(&first) * 1e-9 - 0.3 / libm::sqrt(10.01)).abs() < 1e-12);
        let compare = |x: f64, rx: f64| score(|_| x, rx).compare([&first, &first], &noise);
        for (x, rx, expected) in [
            (2.8, 1.0, Some(Ordering::Less)),
            (2.95, 1.0, Some(Ordering::Equal)),
            (3.05, 1.0, Some(Ordering::Equal)),
            (3.3, 1.0, Some(Ordering::Greater)),
            // The sum is better, but one kind is worse than without learning.
            (1.0, 1.1, Some(Ordering::Greater)),
            (3.3, 0.0, Some(Ordering::Greater)),
            (3.05, 0.0, Some(Ordering::Less)),
            (f64::NAN, 1.0, None),
        ] {
            assert_eq!(compare(x, rx), expected, "{x} {rx}");
        }
        // Better than the first but not than the best. A smaller error has a smaller noise.
        let best = score(|_| 0.5, 0.0);
        assert_eq!(score(|_| 0.65, 0.0).compare([&first, &best], &noise), Some(Ordering::Greater));
        assert_eq!(score(|_| 0.45, 0.0).compare([&first, &best], &noise), Some(Ordering::Equal));
        assert_eq!(score(|_| 0.3, 0.0).compare([&first, &best], &noise), Some(Ordering::Less));
    }

    #[test]
    fn two_passes_without_improvement_or_one_without_a_number_stop_learning() {
        let before = |tick: usize| if (tick / 20).is_multiple_of(2) { 3.1 } else { 2.9 };
        let judged = |passes: &[f64]| -> Vec<Verdict> {
            let mut judge = Judge::new(score(|tick| 6.0 - before(tick), 1.0), &score(before, 1.0));
            passes.iter().map(|x| judge.judge(score(|_| *x, 1.0))).collect()
        };
        use Verdict::{GoOn, Keep, Stop, Worse};
        assert_eq!(judged(&[1.0, 0.99, 0.5, 0.5, 0.49]), [Keep, GoOn, Keep, GoOn, Stop]);
        assert_eq!(judged(&[2.99, 3.0]), [GoOn, Stop]);
        assert_eq!(judged(&[4.4]), [Worse]);
        assert_eq!(judged(&[1.0, 0.99, 2.0, 0.99, 0.99]), [Keep, GoOn, Worse, GoOn, Stop]);
        assert_eq!(judged(&[1.0, f64::NAN]), [Keep, Stop]);
    }

    #[test]
    fn drift_counts_in_full() {
        let (first, noise) = score(|_| 3.1, 1.0).repeated(&score(|_| 3.0, 1.0));
        let [translation, ..] = noise.between(&first, &first);
        assert!((translation - 0.61).abs() < 1e-12, "{translation}");
    }
}
