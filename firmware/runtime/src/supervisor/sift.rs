//! Samples of the gauges against the two before them: one that leaps is replaced by its prediction, one that repeats is counted.
//!
//! ```text
//! prediction   2 y(n−1) − y(n−2)            wrong by no more than the legs can accelerate, and noise: the bound `leap`
//! swing        s ← max(15/16 s, |y(n) − prediction|/leap) of the gauge that swings most, of words that were not replaced, while an
//!              oscillation is suspected, which no straight line predicts; afterwards as long as it is above 1. Else it decays, to
//!              nothing. Where a prediction is remembered for a word, 3 s: so much may the next one be off a line through it
//! replaced     |y(n) − prediction| > (1 + 2 s) leap; times 3, 6, … where y(n−1), y(n−2), … were missing or repeated. Not where y(n) is as near
//!              to y(n−2): then it was y(n−1) that leapt, by less than the bound, and the middle stands for it from here on
//! repeated     all six words are those of the sample before, or of the one before that
//! ```
//! Both are leaky counts: 4 for a tick with it, 1 taken off by one without. Three replaced in a row are a fault, or every fourth over long. Of
//! repeated ones the spec says how many: none where the noise is below a step of the converter, or where the gauges showed no noise
//! while the machine armed.

use super::debounce::{WRONG, rise};
use super::kinds::{Cause, FIRST_CHANNEL};
use super::supervision::Supervision;
use crate::linear::each;
use crate::real::Real;
use crate::snapshot::LARGEST;

/// Bit 22 of the status: the word of a gauge leapt and was replaced by its prediction.
pub const SAMPLE_REPLACED: u32 = 0x40_0000;
/// Bit 23 of the status: six gauges gave the very words of a sample before.
pub const SAMPLE_REPEATED: u32 = 0x80_0000;
/// Count of replaced samples at which they are a fault.
const REPLACED_LIMIT: u32 = 3 * WRONG;
/// Predictions in a row after which a sample is taken as it comes.
const MOST_PREDICTED: usize = 3;
/// Conditions name gauges whose words were replaced from this bit on.
const FIRST_REPLACED: u32 = 22;

/// Times the swing by which the next word may be off its prediction.
const GROWTH: f64 = 2.0;
/// What a tick leaves of a swing.
const DECAY: f64 = 0.9375;
/// Times the swing by which a word is off the line through a prediction that was off by the swing; up to so large a swing.
const AFTER_PREDICTED: f64 = 3.0;
const MOST_WIDENED: f64 = 64.0;
/// A swing below it is none.
const NEGLIGIBLE: f64 = 0.0625;

/// What the machine does, as far as its samples tell it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// It arms, and no leg moves.
    Standing,
    /// A straight line through two samples predicts the next one.
    Moving,
    /// An oscillation is suspected.
    Oscillating,
}

crate::state! { |words|
    /// What is remembered of samples. At reset none is known.
    pub struct Sift<T>[T: Real] {
        /// The two samples before this one. Every word was believed.
        pub samples: [[T; 6]; 2] = [[T::ZERO; 6]; 2], rows(words.sizes().reading);
        /// Which of them is the newer one.
        pub newer: usize = 0, place(1);
        /// How many there are.
        pub known: usize = 0, place(2);
        /// How many of the last ones, in a row, were missing or repeated.
        pub predicted: usize = 0, place(MOST_PREDICTED);
        /// By how much words were lately off their predictions, as a multiple of `leap`: what an oscillation makes of them.
        pub swing: T = T::ZERO, number(LARGEST);
        /// Checksums of the words of the last two samples, the newer one first, where they may not be in `samples`.
        pub sums: [u32; 2] = [0; 2], tallies;
        /// Leaky count of samples with replaced words.
        pub leapt: u32 = 0, tally;
        /// Leaky count of repeated samples.
        pub stale: u32 = 0, tally;
        /// Leaky count of new samples while the machine arms and stands: whether the gauges show noise.
        pub noise: u32 = 0, tally;
        /// Gauges whose words were replaced in this tick, bit by bit.
        pub replaced: u32 = 0, tally;
        /// The sample of this tick was a repeated one.
        pub repeated: bool = false, set;
        /// Two samples are known, neither is a prediction, and nothing is being counted.
        pub quiet: bool = false, set if !*quiet || *known == 2;
    }
}

impl<T: Real> Sift<T> {
    /// Takes a sample in which nothing is wrong. Where it returns false nothing has changed: [`Sift::sift`] it.
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

    /// Takes any sample, and replaces the words that leapt. Returns the causes that have lasted, as bits.
    ///
    /// `faults` says which words the law does not believe: such a sample is left to the law.
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
        let believed = faults(words) == 0;
        self.repeated = self.repeats(supervision, words, believed, activity) && believed;
        let (newer, older) = self.last_two();
        // A prediction is believed, or it is the word before.
        let mut prediction = each(|gauge| predict(newer[gauge], older[gauge]));
        if self.known < 2 || faults(&prediction) != 0 {
            prediction = newer;
        }
        self.replaced = 0;
        let mut smoothed = newer;
        self.swing = self.swing * T::from_f64(DECAY);
        if believed && self.known == 2 {
            smoothed = self.replace(supervision, words, &prediction, activity == Activity::Oscillating);
        }
        if !believed && (self.known < 2 || self.predicted >= MOST_PREDICTED) {
            self.known = 0;
            self.predicted = 0;
        } else {
            self.samples[self.newer & 1] = smoothed;
            // A repeated sample is given to the law, but says nothing of how the legs move.
            let by_prediction = !believed || (self.repeated && self.known == 2);
            let remembered = if by_prediction { prediction } else { *words };
            self.remember(words, &remembered, !believed || self.repeated);
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
            // From here on it is the gauges that are right: what is predicted from predictions runs away.
            self.known = 0;
            lasted |= Cause::GaugeDisagreement.bit();
        }
        if self.repeated && self.stale >= supervision.repeats {
            lasted |= Cause::GaugeStuck.bit();
        }
        lasted
    }

    /// The two samples before this one, the newer one first.
    fn last_two(&self) -> ([T; 6], [T; 6]) {
        let [even, odd] = self.samples;
        if self.newer == 0 { (even, odd) } else { (odd, even) }
    }

    /// Whether the words are those of a sample before, on a machine whose gauges showed noise while it stood.
    fn repeats(&mut self, supervision: &Supervision<T>, words: &[T; 6], believed: bool, activity: Activity) -> bool {
        let (newer, older) = self.last_two();
        let sums = if self.quiet { [sum(&newer), sum(&older)] } else { self.sums };
        let now = sum(words);
        let same = now == sums[0] || now == sums[1];
        self.sums = [now, sums[0]];
        if activity == Activity::Standing && believed {
            self.noise = if same { self.noise.saturating_sub(1) } else { self.noise.saturating_add(3) };
            let most = supervision.arm_ticks.saturating_mul(3);
            if self.noise > most {
                self.noise = most;
            }
        }
        same && supervision.repeats != 0 && self.noise.saturating_mul(2) > supervision.arm_ticks
    }

    /// An oscillation is suspected: from here on every sample goes through [`Sift::sift`], which looks at its swing.
    #[cold]
    #[inline(never)]
    pub fn look_closely(&mut self) {
        if self.quiet {
            let (newer, older) = self.last_two();
            self.sums = [sum(&newer), sum(&older)];
            self.quiet = false;
        }
    }

    /// The swing, with the words that are within the bound. A prediction from predictions says less of it.
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

    /// Replaces the words that leapt by their prediction. Returns the sample before, without what turns out to have leapt in it.
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

    /// The law does not believe the sample of this tick. One that was let pass, close to the bound of the range, is not remembered.
    #[cold]
    #[inline(never)]
    pub fn forget(&mut self) {
        if self.quiet {
            self.samples = [[T::ZERO; 6]; 2];
            self.known = 0;
            self.quiet = false;
        }
    }

    /// Remembers a sample. After too many predictions in a row it begins anew with the words.
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

    /// What this tick's sample is as conditions: causes, and from bit 16 and bit 22 on the gauges.
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

/// What a swing may be behind a prediction that is remembered for a word.
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

/// Where a word goes on in a straight line.
#[inline(always)]
fn predict<T: Real>(newer: T, older: T) -> T {
    newer + newer - older
}

/// Written so that what is no number is not within.
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

/// A leaky count, held at its limit.
fn count(count: &mut u32, wrong: bool, limit: u32) {
    if wrong {
        rise(count, WRONG, limit);
    } else {
        *count = count.saturating_sub(1);
    }
}
