//! Checks the gauges' samples against the two before: a sample that jumps is replaced by its prediction; a repeated one
//! is counted.
//!
//! ```text
//! prediction   2 y(n−1) − y(n−2)            wrong by no more than the legs can accelerate, and noise: the bound `leap`
//! swing        s ← max(15/16 s, |y(n) − prediction|/leap), the largest of all gauges, without replaced words.
//!              It grows while an oscillation is suspected, which no straight line predicts, and later only by
//!              values above 1. If a prediction is stored for a word, s is tripled: the next line goes through it
//! replaced     |y(n) − prediction| > (1 + 2 s) leap; 3, 6, … times that if y(n−1), y(n−2), … were missing or
//!              repeated. If y(n) is within `leap` of y(n−2), then y(n−1) jumped, by less than the bound: the mean
//!              of y(n) and y(n−2) replaces it from here on
//! repeated     all six words are those of the sample before, or of the one before that
//! ```
//! Both are leaky counters: 4 up for a tick with the condition, 1 down for one without. Three replaced samples in a row
//! are a fault, or every fourth over a long time. The spec sets the limit for repeated samples. There is none if the
//! noise is below a converter step, or if the gauges showed no noise while the machine armed.

use super::debounce::{WRONG, rise};
use super::kinds::{Cause, FIRST_CHANNEL};
use super::supervision::Supervision;
use crate::linear::each;
use crate::real::Real;
use crate::snapshot::LARGEST;

/// Bit 22 of the status: a gauge's word jumped and was replaced by its prediction.
pub const SAMPLE_REPLACED: u32 = 0x40_0000;
/// Bit 23 of the status: all six gauges repeated the words of an earlier sample.
pub const SAMPLE_REPEATED: u32 = 0x80_0000;
/// Count of replaced samples that is a fault.
const REPLACED_LIMIT: u32 = 3 * WRONG;
/// Predictions in a row after which the next sample is accepted.
const MOST_PREDICTED: usize = 3;
/// First bit in conditions for gauges whose words were replaced.
const FIRST_REPLACED: u32 = 22;

/// Multiple of the swing by which the next word may differ from its prediction.
const GROWTH: f64 = 2.0;
/// Factor on a swing per tick.
const DECAY: f64 = 0.9375;
/// Multiple of the swing by which a word may differ from the line through a prediction with an error of the swing; and
/// the largest such swing.
const AFTER_PREDICTED: f64 = 3.0;
const MOST_WIDENED: f64 = 64.0;
/// A smaller swing counts as zero.
const NEGLIGIBLE: f64 = 0.0625;

/// State of the machine, as far as its samples show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// Arming; no leg moves.
    Standing,
    /// A straight line through two samples predicts the next one.
    Moving,
    /// An oscillation is suspected.
    Oscillating,
}

crate::state! { |words|
    /// Memory of samples. Empty at reset.
    pub struct Sift<T>[T: Real] {
        /// The two previous samples. Every word was valid.
        pub samples: [[T; 6]; 2] = [[T::ZERO; 6]; 2], rows(words.sizes().reading);
        /// Index of the newer sample.
        pub newer: usize = 0, place(1);
        /// Number of known samples.
        pub known: usize = 0, place(2);
        /// Number of samples in a row that were missing or repeated.
        pub predicted: usize = 0, place(MOST_PREDICTED);
        /// s: swing of the gauges during an oscillation, as a multiple of `leap`.
        pub swing: T = T::ZERO, number(LARGEST);
        /// Checksums of the words of the last two samples, the newer first, if they may differ from `samples`.
        pub sums: [u32; 2] = [0; 2], tallies;
        /// Leaky count of samples with replaced words.
        pub leapt: u32 = 0, tally;
        /// Leaky count of repeated samples.
        pub stale: u32 = 0, tally;
        /// Leaky count of new samples while the machine arms and no leg moves: it shows whether the gauges have noise.
        pub noise: u32 = 0, tally;
        /// Gauges whose words were replaced in this tick, bit by bit.
        pub replaced: u32 = 0, tally;
        /// Whether this tick's sample was a repeated one.
        pub repeated: bool = false, set;
        /// Two samples are known, neither is a prediction, and nothing is being counted.
        pub quiet: bool = false, set if !*quiet || *known == 2;
    }
}

impl<T: Real> Sift<T> {
    /// Takes a sample without irregularities. If it returns false, nothing has changed; then call [`Sift::sift`].
    #[inline]
    pub fn accepts(&mut self, supervision: &Supervision<T>, words: &[T; 6]) -> bool {
        if !self.quiet {
            return false;
        }
        let [even, odd] = &mut self.samples;
        let (newer, older) = if self.newer == 0 { (even, odd) } else { (odd, even) };
        if supervision.repeats != 0 && (words == newer || words == older) {
            return false;
        }
        for (((word, newer), older), leap) in words.iter().zip(newer.iter()).zip(older.iter()).zip(&supervision.leap) {
            if !is_within(*word, predict(*newer, *older), *leap) {
                return false;
            }
        }
        *older = *words;
        self.newer = usize::from(self.newer == 0);
        true
    }

    /// Takes any sample, and replaces the words that jumped. Returns the causes that have lasted, as bits.
    ///
    /// `faults` are the gauges that the law rejects: such a sample is left to the law.
    #[cold]
    #[inline(never)]
    pub fn sift(
        &mut self,
        supervision: &Supervision<T>,
        words: &mut [T; 6],
        faults: impl Fn(&[T; 6]) -> u32,
        activity: Activity,
    ) -> u32 {
        let before = self.predicted;
        let is_valid = faults(words) == 0;
        self.repeated = self.repeats(supervision, words, is_valid, activity) && is_valid;
        let (newer, older) = self.last_two();
        // The prediction if it is valid, otherwise the previous word.
        let mut prediction = each(|gauge| predict(newer[gauge], older[gauge]));
        if self.known < 2 || faults(&prediction) != 0 {
            prediction = newer;
        }
        self.replaced = 0;
        let mut smoothed = newer;
        self.swing = self.swing * T::from_f64(DECAY);
        if is_valid && self.known == 2 {
            smoothed = self.replace(supervision, words, &prediction, activity == Activity::Oscillating);
        }
        if !is_valid && (self.known < 2 || self.predicted >= MOST_PREDICTED) {
            self.known = 0;
            self.predicted = 0;
        } else {
            self.samples[self.newer & 1] = smoothed;
            // A repeated sample is passed to the law, but carries no information on the motion.
            let by_prediction = !is_valid || (self.repeated && self.known == 2);
            let remembered = if by_prediction { prediction } else { *words };
            self.remember(words, &remembered, !is_valid || self.repeated);
        }
        count(&mut self.leapt, self.replaced != 0, REPLACED_LIMIT);
        count(&mut self.stale, self.repeated, supervision.repeats);
        let undisturbed = self.predicted == 0 && before == 0 && self.leapt | self.stale == 0 && smoothed == newer;
        self.quiet =
            self.known == 2 && undisturbed && activity == Activity::Moving && self.swing <= T::from_f64(NEGLIGIBLE);
        if self.quiet {
            self.swing = T::ZERO;
        }
        let mut lasted = 0;
        if self.replaced != 0 && self.leapt >= REPLACED_LIMIT {
            // Accept the gauges from here on: predictions from predictions diverge.
            self.known = 0;
            lasted |= Cause::GaugeDisagreement.bit();
        }
        if self.repeated && self.stale >= supervision.repeats {
            lasted |= Cause::GaugeStuck.bit();
        }
        lasted
    }

    /// The two previous samples, the newer first.
    fn last_two(&self) -> ([T; 6], [T; 6]) {
        let [even, odd] = self.samples;
        if self.newer == 0 { (even, odd) } else { (odd, even) }
    }

    /// Whether the words repeat an earlier sample, on a machine whose gauges showed noise at rest.
    fn repeats(&mut self, supervision: &Supervision<T>, words: &[T; 6], is_valid: bool, activity: Activity) -> bool {
        let (newer, older) = self.last_two();
        let sums = if self.quiet { [sum(&newer), sum(&older)] } else { self.sums };
        let now = sum(words);
        let same = now == sums[0] || now == sums[1];
        self.sums = [now, sums[0]];
        if activity == Activity::Standing && is_valid {
            self.noise = if same { self.noise.saturating_sub(1) } else { self.noise.saturating_add(3) };
            let most = supervision.arm_ticks.saturating_mul(3);
            if self.noise > most {
                self.noise = most;
            }
        }
        same && supervision.repeats != 0 && self.noise.saturating_mul(2) > supervision.arm_ticks
    }

    /// An oscillation is suspected: from now on every sample goes through [`Sift::sift`], which tracks the swing.
    #[cold]
    #[inline(never)]
    pub fn look_closely(&mut self) {
        if self.quiet {
            let (newer, older) = self.last_two();
            self.sums = [sum(&newer), sum(&older)];
            self.quiet = false;
        }
    }

    /// The swing, from the words within the bound. A prediction from predictions is weaker evidence.
    #[cold]
    #[inline(never)]
    fn swings(&self, leaps: &[T; 6], words: &[T; 6], prediction: &[T; 6], bound: T, oscillates: bool) -> T {
        let mut swing = self.swing;
        if self.predicted != 0 {
            return swing;
        }
        let least = if oscillates { T::ZERO } else { T::ONE };
        for ((word, predicted), leap) in words.iter().zip(prediction).zip(leaps) {
            let off = (*word - *predicted).abs();
            if off <= *leap * bound && off > *leap * swing && off > *leap * least {
                swing = off / *leap;
            }
        }
        swing
    }

    /// Replaces the words that jumped by their prediction. Returns the previous sample, without words that now prove to
    /// have jumped.
    fn replace(
        &mut self,
        supervision: &Supervision<T>,
        words: &mut [T; 6],
        prediction: &[T; 6],
        oscillates: bool,
    ) -> [T; 6] {
        let (mut newer, older) = self.last_two();
        let intervals = self.predicted as i32 + 1;
        let mut bound = T::from_i32(intervals * (intervals + 1) / 2);
        let swings = oscillates || self.swing != T::ZERO;
        if swings {
            bound = (T::ONE + self.swing * T::from_f64(GROWTH)) * bound;
            self.swing = self.swings(&supervision.leap, words, prediction, bound, oscillates);
        }
        for (gauge, (word, predicted)) in words.iter_mut().zip(prediction).enumerate() {
            let leap = supervision.leap[gauge];
            if is_within(*word, *predicted, leap * bound) {
                continue;
            }
            if is_within(*word, older[gauge], leap) {
                newer[gauge] = (*word + older[gauge]) * T::HALF;
            } else {
                self.replaced |= 1 << gauge;
                *word = *predicted;
            }
        }
        if swings && self.replaced != 0 {
            self.swing = widened(self.swing);
        }
        newer
    }

    /// The law rejects this tick's sample. A sample close to the range limit is not stored.
    #[cold]
    #[inline(never)]
    pub fn forget(&mut self) {
        if self.quiet {
            self.samples = [[T::ZERO; 6]; 2];
            self.known = 0;
            self.quiet = false;
        }
    }

    /// Stores a sample. After too many predictions in a row, it starts again with the measured words.
    fn remember(&mut self, words: &[T; 6], remembered: &[T; 6], is_predicted: bool) {
        let begins = is_predicted && (self.known < 2 || self.predicted >= MOST_PREDICTED);
        if begins {
            self.known = 0;
        } else if is_predicted {
            self.swing = widened(self.swing);
        }
        self.predicted = if begins || !is_predicted { 0 } else { self.predicted + 1 };
        self.newer = usize::from(self.newer == 0);
        self.samples[self.newer] = if begins { *words } else { *remembered };
        if self.known < 2 {
            self.known += 1;
        }
    }

    /// This tick's sample as conditions: causes, and the gauges from bit 16 and bit 22 on.
    #[inline]
    #[must_use]
    pub fn conditions(&self) -> u32 {
        if self.quiet {
            return 0;
        }
        let leapt = if self.replaced == 0 { 0 } else { Cause::GaugeDisagreement.bit() };
        let stale = if self.repeated { Cause::GaugeStuck.bit() | 0x3f << FIRST_CHANNEL } else { 0 };
        leapt | stale | self.replaced << FIRST_CHANNEL | self.replaced << FIRST_REPLACED
    }

    /// The same as bits of the status.
    #[inline]
    #[must_use]
    pub fn status(&self) -> u32 {
        if self.quiet {
            return 0;
        }
        let leapt = if self.replaced == 0 { 0 } else { SAMPLE_REPLACED };
        leapt | if self.repeated { SAMPLE_REPEATED } else { 0 }
    }
}

/// Bound on the swing after a prediction was stored for a word.
fn widened<T: Real>(swing: T) -> T {
    let (most, widened) = (T::from_f64(MOST_WIDENED), swing * T::from_f64(AFTER_PREDICTED));
    if swing >= most {
        swing
    } else if widened < most {
        widened
    } else {
        most
    }
}

/// Linear extrapolation of a word.
#[inline(always)]
fn predict<T: Real>(newer: T, older: T) -> T {
    newer + newer - older
}

/// Written so that a NaN is not within.
#[inline(always)]
fn is_within<T: Real>(word: T, predicted: T, bound: T) -> bool {
    (word - predicted).abs() <= bound
}

/// One number for the bits of six words.
fn sum<T: Real>(words: &[T; 6]) -> u32 {
    words.iter().fold(1, |sum: u32, word| {
        let word = word.to_word();
        (sum ^ word as u32 ^ ((word >> 32) as u32).rotate_left(11)).wrapping_mul(0x9e37_79b1)
    })
}

/// A leaky counter, saturated at its limit.
fn count(count: &mut u32, wrong: bool, limit: u32) {
    if wrong {
        rise(count, WRONG, limit);
    } else {
        *count = count.saturating_sub(1);
    }
}
