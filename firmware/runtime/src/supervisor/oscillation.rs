//! Detection of a sustained oscillation of the error, and the fallback of the law.
//!
//! ```text
//! swing      y = e − m, m ← m + a y                              of one axis (or leg) a tick, over what noise and environment may make of it
//! power      p ← p + (2 y² − p)/16                               the square of its amplitude, in these limits
//! explained  E ← max(E keep, 1, (motion |Δ set-point|)²)         of all axes together
//! sustained  p > E counts up, else down, and raises E to a share of p
//! ```
//! A ring that decays falls below the level explained by its own peak, which is held longer than any mode rings; so do
//! corners and steps of the set-point. An oscillation that does not decay keeps counting if it goes both ways. It is
//! not counted while an axis moves and a leg is at its voltage limit, which keeps the platform from following.

use super::kinds::Cause;
use crate::choice::choice;
use crate::real::Real;

choice! {
    /// Fallback stage: the active part of the law.
    pub enum Fallback {
        /// All of it.
        None = 0 => "",
        /// No active damping; feedback gains and weights of the estimates are [`Fallback::share`] of their settings.
        Reduced = 1 => "damping off and gains reduced",
        /// Feed-forward only: no feedback, estimates frozen.
        FeedForward = 2 => "feedback off",
    }
}

/// Factor on the gains in [`Fallback::Reduced`].
const SHARE: f64 = 0.25;
/// Weight of a new sample in the power.
const NEW: f64 = 0.0625;
/// Part of a power that it explains later, while held.
const OWN: f64 = 0.5;
/// Upper bound of a power, in squares of limits.
const LARGEST: f64 = 1e30;
/// Swing explained by an external correction, as a multiple of it: the amplification of a mode at resonance.
const GIVEN: f64 = 8.0;
/// First bit in the word of signs for axes whose mean and set-point are known.
const FIRST_KNOWN: u32 = 1 << 8;
/// First bit of the stage in conditions.
const FIRST_STAGE: u32 = 29;

impl Fallback {
    /// Factor on the gains.
    #[inline]
    #[must_use]
    pub fn share<T: Real>(self) -> T {
        match self {
            Self::None => T::ONE,
            Self::Reduced => T::from_f64(SHARE),
            Self::FeedForward => T::ZERO,
        }
    }

    /// The next stage if the oscillation continues; none after the last.
    #[must_use]
    pub const fn next(self) -> Option<Self> {
        match self {
            Self::None => Some(Self::Reduced),
            Self::Reduced => Some(Self::FeedForward),
            Self::FeedForward => None,
        }
    }
}

crate::constants::constants! {
    ($) steadiness_fields;
    /// Constants of the detection; from `supervisor.disturbance`.
    pub struct Steadiness<T> {
        /// For each axis (1/m, 1/rad) or leg (1/m): one over the swing that noise and environment may cause.
        pub per_limit: [T; 6],
        /// Fraction of a swing that the slow mean follows, in (0, 1].
        pub follow: T,
        /// Swing explained by a change of the set-point between samples, as a multiple of the change.
        pub motion: T,
        /// Fraction of the explained power that is kept to the next tick, in (0, 1).
        pub keep: T,
        /// The same in a fallback stage, where a continuing oscillation must soon be distinguished from the previous one.
        pub keep_fallen: T,
        /// More samples in a row with one sign than this are not an oscillation.
        pub one_way: u32,
        /// Samples before the first stage, ≥ 1.
        pub first: u32,
        /// Samples between stages, ≥ 1: a ring that the last stage left has decayed by then.
        pub next: u32,
    }
}

crate::state! { |words|
    /// State of the detection, and its fallback stage.
    pub struct Oscillation<T>[T: Real] {
        /// Present fallback stage.
        pub stage: Fallback = Fallback::None, choice;
        /// m: slow mean of each error, m or rad.
        mean: [T; 6] = [T::ZERO; 6], axes(words.sizes().apart);
        /// Set-point of the last sample of each axis or leg, m or rad.
        target: [T; 6] = [T::ZERO; 6], axes(words.sizes().apart);
        /// p of each.
        power: [T; 6] = [T::ZERO; 6], numbers(LARGEST);
        /// E.
        explained: T = T::ONE, number(LARGEST);
        /// Count for each axis or leg: samples with unexplained power less samples without.
        counts: [u32; 6] = [0; 6], tallies;
        /// Samples with unexplained power since the last change of sign. Sign bits: set if negative; from bit 8 on, set
        /// if a sample is known.
        runs: [u32; 6] = [0; 6], tallies;
        signs: u32 = 0, tally;
        /// Its part of the conditions: the bit of the cause while an oscillation is suspected, the stage from bit 29
        /// on.
        pub conditions: u32 = 0, tally;
    }
}

/// One axis or leg in one tick; all finite.
#[derive(Debug, Clone, Copy)]
pub struct Motion<T> {
    /// Set-point less measured value, m or rad.
    pub error: T,
    /// Set-point, m or rad.
    pub target: T,
    /// External correction, m or rad; none if the controller has none.
    pub given: Option<T>,
    /// A leg is at its voltage limit.
    pub limited: bool,
}

impl<T: Real> Oscillation<T> {
    /// Takes the motion of an axis or leg (0 to 5) while the law runs. Returns whether an oscillation of it is being
    /// counted.
    #[inline]
    pub fn look(&mut self, limits: &Steadiness<T>, index: usize, motion: &Motion<T>) -> bool {
        let index = if index < 6 { index } else { 0 };
        let per_limit = limits.per_limit[index];
        let known = FIRST_KNOWN << index;
        if self.signs & known == 0 {
            self.signs |= known;
            self.mean[index] = motion.error;
            self.target[index] = motion.target;
        }
        let swing = motion.error - self.mean[index];
        self.mean[index] = self.mean[index] + limits.follow * swing;
        let mut moved = (motion.target - self.target[index]) * limits.motion;
        self.target[index] = motion.target;
        if let Some(given) = motion.given {
            moved = moved.abs() + given.abs() * T::from_f64(GIVEN);
        }
        let (swing, moved) = (swing * per_limit, moved * per_limit);
        let square = swing * swing;
        let power = self.power[index] + (square + square - self.power[index]) * T::from_f64(NEW);
        self.power[index] = power;
        let keep = if self.stage == Fallback::None { limits.keep } else { limits.keep_fallen };
        let mut explained = self.explained * keep;
        if explained < T::ONE {
            explained = T::ONE;
        }
        if moved * moved > explained {
            explained = moved * moved;
        }
        self.explained = explained;
        (power > explained || self.counts[index] != 0)
            && self.count(limits, index, swing < T::ZERO, motion.limited && moved != T::ZERO)
    }

    /// Updates the count of an axis with unexplained power, now or lately. Returns whether there is a count.
    #[cold]
    #[inline(never)]
    fn count(&mut self, limits: &Steadiness<T>, index: usize, below: bool, kept_back: bool) -> bool {
        let enough = self.enough(limits);
        let of_axis = (self.counts.get_mut(index), self.runs.get_mut(index), self.power.get(index));
        let (Some(count), Some(run), Some(power)) = of_axis else { return false };
        if kept_back {
            return false;
        }
        let bit = 1 << index;
        let sign = if below { bit } else { 0 };
        *run = if self.signs & bit == sign { run.saturating_add(1) } else { 0 };
        self.signs = (self.signs & !bit) | sign;
        if *power > self.explained {
            // A motion in one direction is not an oscillation.
            *count = if *run <= limits.one_way { count.saturating_add(1) } else { count.saturating_sub(1) };
            let own = *power * T::from_f64(OWN);
            if own > self.explained {
                self.explained = own;
            }
        } else {
            *count = count.saturating_sub(1);
        }
        if *count > enough {
            *count = enough;
        }
        let suspected = self.counts.iter().any(|count| *count >= enough / 2);
        self.show(suspected);
        true
    }

    /// Samples that lead to the next stage.
    fn enough(&self, limits: &Steadiness<T>) -> u32 {
        if self.stage == Fallback::None { limits.first } else { limits.next }
    }

    /// Whether a counted oscillation has lasted long enough.
    pub(super) fn has_lasted(&self, limits: &Steadiness<T>) -> bool {
        self.counts.iter().any(|count| *count >= self.enough(limits))
    }

    /// Whether the error may be about to oscillate: an axis is counted, which is early enough for a growing
    /// oscillation, or a stage has not yet ended the oscillation.
    #[must_use]
    pub(super) fn is_suspected(&self) -> bool {
        let rings = self.stage != Fallback::None && self.power.iter().any(|power| *power > T::ONE);
        rings || self.counts.iter().any(|count| *count != 0)
    }

    /// Advances to the next stage. Returns whether there was one.
    pub(super) fn fall_back(&mut self) -> bool {
        let next = self.stage.next();
        if let Some(stage) = next {
            self.stage = stage;
        }
        self.forgive();
        next.is_some()
    }

    /// Clears the suspicion, but keeps the stage.
    pub(super) fn forgive(&mut self) {
        self.counts = [0; 6];
        self.show(false);
    }

    fn show(&mut self, suspected: bool) {
        let bit = if suspected { Cause::Oscillation.bit() } else { 0 };
        self.conditions = bit | (self.stage.word() as u32) << FIRST_STAGE;
    }
}
