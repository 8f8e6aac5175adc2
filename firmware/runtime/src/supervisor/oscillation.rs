//! A sustained oscillation of the error, and what the law falls back to.
//!
//! ```text
//! swing      y = e − m, m ← m + a y                              of one axis (or leg) a tick, over what noise and environment may make of it
//! power      p ← p + (2 y² − p)/16                               the square of its amplitude, in these limits
//! explained  E ← max(E keep, 1, (motion |Δ set-point|)²)         of all axes together
//! sustained  p > E counts up, else down, and raises E to a share of p
//! ```
//! A ring that dies out sinks below what its own peak explains, which is held longer than any mode rings; so do corners and steps of
//! the set-point. What stays as large as it was goes on counting, if it
//! goes both ways. While an axis moves and a leg is at the end of its
//! voltage, which keeps the platform from following, it is not counted.

use super::kinds::Cause;
use crate::choice::choice;
use crate::real::Real;

choice! {
    /// How much of the law is at work.
    pub enum Fallback {
        /// All of it.
        None = 0 => "",
        /// No active damping; gains of the feedback and weights of the estimates are [`Fallback::share`] of those set.
        Reduced = 1 => "damping off and gains reduced",
        /// Feed-forward alone: no feedback, the estimates as they were.
        FeedForward = 2 => "feedback off",
    }
}

/// What is left of the gains in [`Fallback::Reduced`].
const SHARE: f64 = 0.25;
/// Part of a new sample in the power.
const NEW: f64 = 0.0625;
/// Part of a power that explains itself later on, as long as it is held.
const OWN: f64 = 0.5;
/// No power is larger, in squares of limits.
const LARGEST: f64 = 1e30;
/// Swing that is explained by a correction given beside the law, as a multiple of it: what a mode makes of it at its resonance.
const GIVEN: f64 = 8.0;
/// The first axis whose mean and set-point are known, in the word of signs.
const FIRST_KNOWN: u32 = 1 << 8;
/// The stage stands from this bit of the conditions on.
const FIRST_STAGE: u32 = 29;

impl Fallback {
    /// What is left of the gains.
    #[inline]
    #[must_use]
    pub fn share<T: Real>(self) -> T {
        match self {
            Self::None => T::ONE,
            Self::Reduced => T::from_f64(SHARE),
            Self::FeedForward => T::ZERO,
        }
    }

    /// What comes next if the oscillation goes on; none after the last.
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
        /// Of each axis (1/m, 1/rad), or of each leg (1/m): one over what noise and environment may make of its swing.
        pub per_limit: [T; 6],
        /// Part of a swing that the slow mean takes up, in (0, 1].
        pub follow: T,
        /// Swing that is explained by a change of the set-point from one sample to the next, as a multiple of it.
        pub motion: T,
        /// What is left in the next tick of the power that was explained in this one, in (0, 1).
        pub keep: T,
        /// The same in a stage, where what goes on is to be told soon from what went before.
        pub keep_fallen: T,
        /// Samples with one sign in a row of which more are no oscillation.
        pub one_way: u32,
        /// Samples that lead to the first stage, ≥ 1.
        pub first: u32,
        /// Samples that lead from one stage to the next: a ring that the last stage left has died out by then.
        pub next: u32,
    }
}

crate::state! { |words|
    /// State of the detection, and the stage that it led to.
    pub struct Oscillation<T>[T: Real] {
        /// What the law has fallen back to.
        pub stage: Fallback = Fallback::None, choice;
        /// m: slow mean of each error, m or rad.
        mean: [T; 6] = [T::ZERO; 6], axes(words.sizes().apart);
        /// Set-point of the last sample of each axis or leg, m or rad.
        target: [T; 6] = [T::ZERO; 6], axes(words.sizes().apart);
        /// p of each.
        power: [T; 6] = [T::ZERO; 6], numbers(LARGEST);
        /// E.
        explained: T = T::ONE, number(LARGEST);
        /// Samples with a power that nothing explains, less those without.
        counts: [u32; 6] = [0; 6], tallies;
        /// Samples with such a power since the swing changed its sign. Bits of the signs: set where it is below zero; from bit 8 on,
        /// where a sample is known.
        runs: [u32; 6] = [0; 6], tallies;
        signs: u32 = 0, tally;
        /// What it adds to the conditions: the bit of the cause while it is suspected, the stage from bit 29 on.
        pub conditions: u32 = 0, tally;
    }
}

/// One axis or leg in one tick; finite.
#[derive(Debug, Clone, Copy)]
pub struct Motion<T> {
    /// Set-point less what is measured, m or rad.
    pub error: T,
    /// Set-point, m or rad.
    pub target: T,
    /// What is asked for against the error beside the law, m or rad; none where there is no such.
    pub given: Option<T>,
    /// A leg is at the end of its voltage.
    pub limited: bool,
}

impl<T: Real> Oscillation<T> {
    /// Takes the motion of an axis or leg (0 to 5) while the law runs. Whether an oscillation of it is counted.
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

    /// The count of an axis whose power nothing explains, or did not lately; whether there is one.
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
            // What goes one way is on its way somewhere.
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

    /// Whether an oscillation that is counted has lasted.
    pub(super) fn has_lasted(&self, limits: &Steadiness<T>) -> bool {
        self.counts.iter().any(|count| *count >= self.enough(limits))
    }

    /// Whether the error may be about to oscillate: something is counted, which an oscillation that grows is soon enough; or a stage
    /// has not yet ended it.
    #[must_use]
    pub(super) fn is_suspected(&self) -> bool {
        let rings = self.stage != Fallback::None && self.power.iter().any(|power| *power > T::ONE);
        rings || self.counts.iter().any(|count| *count != 0)
    }

    /// Goes on to the next stage; whether there was one.
    pub(super) fn fall_back(&mut self) -> bool {
        let next = self.stage.next();
        if let Some(stage) = next {
            self.stage = stage;
        }
        self.forgive();
        next.is_some()
    }

    /// Forgets what was suspected, but not the stage.
    pub(super) fn forgive(&mut self) {
        self.counts = [0; 6];
        self.show(false);
    }

    fn show(&mut self, suspected: bool) {
        let bit = if suspected { Cause::Oscillation.bit() } else { 0 };
        self.conditions = bit | (self.stage.word() as u32) << FIRST_STAGE;
    }
}
