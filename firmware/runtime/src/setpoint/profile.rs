//! Point-to-point motion with limited speed, acceleration and jerk: the seven-phase S-curve, in whole ticks.
//!
//! All axes share one progress variable s from 0 to 1, so that they start and end together and the path is straight: h
//! = h₀ + Δ s(k). With n ticks of jerk, m ≥ n ticks from the start until the acceleration falls again, and L ticks that
//! the whole distance would take at full speed,
//!
//! ```text
//! k:      0      n          m     m+n            L       L+n        L+m    L+m+n
//! jerk    +j     0          −j     0             −j       0          +j
//! j = 1/(n m L)     peak acceleration 1/(m L)     peak speed 1/L            (per tick)
//! ```
//! The least n, m and L, in this order, that keep every axis within its limits are found by an integer search, without
//! a square root: see [`Profile::plan`].
//!
//! # Example
//!
//! A move of 1 mm with at most 10 µm a tick, 1 µm a tick² and 0.5 µm a tick³: n = 2 ticks of jerk reach the full
//! acceleration, m = 10 ticks the full speed, L = 100 ticks at full speed cover the distance. It takes L + m + n ticks.
//!
//! ```
//! use specgen_runtime::setpoint::{MoveLimits, Profile};
//!
//! let limits = MoveLimits::<f64> { speed: [1e5; 6], acceleration: [1e6; 6], jerk: [2e6; 6] };
//! let profile = Profile::plan(&[1e-3, 0.0, 0.0, 0.0, 0.0, 0.0], &limits);
//! assert_eq!(profile.map(|profile| profile.ticks()), Some(112));
//! ```

use crate::real::Real;

/// Longest phase, ticks: 2²¹ is 3.5 min at 10 kHz.
pub const LONGEST: i32 = 1 << BITS;
const BITS: u32 = 21;

/// Reciprocal limits of one tick, by axis: 1/(V T_s), 1/(A T_s²), 1/(J T_s³), per m or rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveLimits<T> {
    /// Of speed.
    pub speed: [T; 6],
    /// Of acceleration.
    pub acceleration: [T; 6],
    /// Of jerk.
    pub jerk: [T; 6],
}

crate::state! { |words|
    /// Progress from 0 to 1. Nothing to move at reset.
    #[derive(PartialEq)]
    pub struct Profile<T>[T: Real] {
        /// n.
        jerk_ticks: i32 = 0, ticks(LONGEST);
        /// m.
        rise_ticks: i32 = 0, ticks(LONGEST);
        /// L + m + n.
        ticks: i32 = 0, ticks(3 * LONGEST);
        /// j, per tick³. This and the following fields are fractions of the distance.
        jerk: T = T::ZERO, number(1.0);
        /// Peak acceleration, per tick².
        acceleration: T = T::ZERO, number(1.0);
        /// Peak speed, per tick.
        speed: T = T::ZERO, number(1.0);
    }
}

/// Progress at a tick: s, ṡ per tick, s̈ per tick².
pub(super) struct Progress<T> {
    pub place: T,
    pub rate: T,
    pub acceleration: T,
}

/// Largest |value · factor|.
pub(super) fn largest<T: Real>(values: &[T; 6], factors: &[T; 6]) -> T {
    let mut largest = T::ZERO;
    for (value, factor) in values.iter().zip(factors) {
        let product = value.abs() * *factor;
        if product > largest {
            largest = product;
        }
    }
    largest
}

/// The least n in 1..=[`LONGEST`] that is `enough`; none if there is none. `enough` must be monotone, and hold at the
/// next power of two above `known` (≥ 0, or NaN if 1 is enough).
pub(super) fn least<T: Real>(known: T, enough: impl Fn(T) -> bool) -> Option<i32> {
    let mut too_few = 0;
    // Start the bisection at that power of two.
    let known = known.truncate();
    let above = if known < LONGEST { BITS + known.leading_zeros() - 31 } else { 0 };
    for bit in above..=BITS {
        let tried = too_few + (LONGEST >> bit);
        if !enough(T::from_i32(tried)) {
            too_few = tried;
        }
    }
    (too_few < LONGEST).then_some(too_few + 1)
}

impl<T: Real> Profile<T> {
    /// The profile for a move by `delta` (m and rad, finite); none if it would take longer than [`LONGEST`].
    #[must_use]
    pub fn plan(delta: &[T; 6], limits: &MoveLimits<T>) -> Option<Self> {
        // Limits of s: speed ≤ 1/v, acceleration ≤ 1/a, jerk ≤ 1/j.
        let v = largest(delta, &limits.speed);
        let a = largest(delta, &limits.acceleration);
        let j = largest(delta, &limits.jerk);
        // Jerk until full acceleration or full speed is reached, or a quarter of the time is over.
        let jerk_ticks: i32 = least(j / a, |n: T| n * a >= j || n * n * v >= j || (n * n * n) + (n * n * n) >= j)?;
        let n = T::from_i32(jerk_ticks);
        let for_jerk = j / n;
        let a = if for_jerk > a { for_jerk } else { a };
        // Then constant acceleration until full speed is reached, or half the distance is done.
        let full_speed = a / v;
        let known = if full_speed > n { full_speed } else { n };
        let rise_ticks: i32 = least(known, |m: T| m >= n && (m * v >= a || m * (m + n) >= a))?;
        let m = T::from_i32(rise_ticks);
        let for_acceleration = a / m;
        let span = if for_acceleration > v { for_acceleration } else { v };
        let mut span_ticks = span.truncate();
        if T::from_i32(span_ticks) < span {
            span_ticks = span_ticks.saturating_add(1);
        }
        let both = jerk_ticks + rise_ticks;
        if span_ticks < both {
            span_ticks = both;
        }
        if span_ticks > LONGEST {
            return None;
        }
        let speed = T::ONE / T::from_i32(span_ticks);
        let acceleration = speed / m;
        Some(Self { jerk_ticks, rise_ticks, ticks: span_ticks + both, jerk: acceleration / n, acceleration, speed })
    }

    /// Duration.
    #[must_use]
    pub fn ticks(&self) -> i32 {
        self.ticks
    }

    /// Progress `tick` ticks after the start, 0 to [`Profile::ticks`]. The second half mirrors the first.
    #[inline]
    pub(super) fn at(&self, tick: i32) -> Progress<T> {
        let left = self.ticks - tick;
        if left < tick {
            let mirrored = self.first_half(left);
            Progress { place: T::ONE - mirrored.place, rate: mirrored.rate, acceleration: -mirrored.acceleration }
        } else {
            self.first_half(tick)
        }
    }

    #[inline]
    fn first_half(&self, tick: i32) -> Progress<T> {
        let sixth = T::from_f64(1.0 / 6.0);
        let both = self.jerk_ticks + self.rise_ticks;
        if tick <= self.jerk_ticks {
            let t = T::from_i32(tick);
            let acceleration = self.jerk * t;
            Progress { place: acceleration * t * t * sixth, rate: acceleration * t * T::HALF, acceleration }
        } else if tick <= self.rise_ticks {
            let (n, t) = (T::from_i32(self.jerk_ticks), T::from_i32(tick - self.jerk_ticks));
            let early = self.acceleration * n * T::HALF;
            let place = early * n * (sixth + sixth) + early * t + self.acceleration * t * t * T::HALF;
            Progress { place, rate: early + self.acceleration * t, acceleration: self.acceleration }
        } else if tick <= both {
            // Time from the point of full speed, half of `both` after a start at full speed.
            let t = T::from_i32(both - tick);
            let acceleration = self.jerk * t;
            let place = self.speed * (T::from_i32(both) * T::HALF - t) + acceleration * t * t * sixth;
            Progress { place, rate: self.speed - acceleration * t * T::HALF, acceleration }
        } else {
            let t = T::from_i32(tick) - T::from_i32(both) * T::HALF;
            Progress { place: self.speed * t, rate: self.speed, acceleration: T::ZERO }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The search may start lower, and finds the same.
    #[test]
    fn what_is_known_changes_no_result() {
        let mut seed = 1_u64;
        let mut number = |scale: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            scale * ((seed >> 40) as f64 / 16_777_216.0)
        };
        let mut found = [0; 2];
        for k in 0..20_000 {
            let (a, j) = (number(1e3), number([1.0, 1e3, 1e6, 1e10][k % 4]) as f32);
            let a = a as f32;
            let enough = |n: f32| n * a >= j || n * n * n >= j;
            let (all, fewer) = (least(LONGEST as f32, enough), least(j / a, enough));
            assert_eq!(all, fewer, "{a} {j}");
            found[usize::from(all.is_some_and(|n| n > 1))] += 1;
        }
        assert!(found.iter().all(|n| *n > 1000), "{found:?}");
        for exact in [0.0, 1.0, 2.0, 3.0, 4.0, 1023.0, 1024.0, 2_097_151.0, 2_097_152.0, 2_097_153.0, 1e12] {
            let enough = |n: f64| n >= exact;
            assert_eq!(least(1e12, enough), least(exact, enough), "{exact}");
        }
    }
}
