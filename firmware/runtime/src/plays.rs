//! Plays whose thresholds widen with the rate: a hysteresis model in place of the table.
//!
//! With u the drive in cells,
//!
//! ```text
//! P = Σ w_i (p_i − r_i)      p_i ← min(max(p_i, u − s r_i), u + s r_i)       m; 0 at rest after negative saturation
//! s = 1 + κ ln(1 + |v|/v₀)   v: the step of the drive of the last ticks, low-pass filtered; cells per tick
//! ```
//! r_0 = 0 and w_0 > 0, so P is strictly monotone in the drive. A table cannot have a rate: s shifts every threshold.
//!
//! P(u) is piecewise linear, so a Newton step is exact where no play starts or stops between its ends. The tick before has
//! evaluated P, its slope and the distance to the nearest such place at the drive that repeats its own step, with the
//! thresholds of the next tick, which are known by then. Only a demand beyond that distance needs further steps, at most
//! [`MOST_STEPS`]. What they leave does not accumulate: the forward model uses the actual drive.
//!
//! # Example
//!
//! A leg of 1 µm a cell, and as much again once a play of 2 cells moves.
//!
//! ```
//! use specgen_runtime::plays::PLAYS;
//! use specgen_runtime::{DriveMemory, HysteresisMemory, PlayMemory, Plays};
//!
//! let mut plays = Plays {
//!     full_scale: 32.0_f64,
//!     thresholds: [2.0; PLAYS],
//!     weights: [0.0; PLAYS],
//!     slope: 2e-6,
//!     rest: 2e-6,
//!     widening: 0.0,
//!     per_rate: 1.0,
//!     decay: 0.0,
//! };
//! plays.thresholds[0] = 0.0;
//! [plays.weights[0], plays.weights[1]] = [1e-6; 2];
//! let mut leg = PlayMemory::new(plays.thresholds);
//! // The play moves from 4 cells on: 10 + (10 − 4) µm.
//! assert!((leg.apply(&&plays, 10.0) - 16e-6).abs() < 1e-18);
//! // It rests on the way back.
//! let drive = leg.solve(&&plays, 15e-6);
//! assert!((drive - 9.0).abs() < 1e-9);
//! ```

use crate::crc::Crc32;
use crate::everett::LastLine;
use crate::memory::{DriveMemory, HysteresisMemory};
use crate::real::{Real, saturate};
use crate::snapshot::LARGEST;

/// Number of plays of a leg.
pub const PLAYS: usize = 24;

/// Most Newton steps of a tick after the first.
pub const MOST_STEPS: u32 = 12;

/// Plays of one leg.
#[derive(Debug, Clone, Copy)]
pub struct Plays<T> {
    /// N, full drive, cells.
    pub full_scale: T,
    /// r_i at rest, cells; r_0 = 0.
    pub thresholds: [T; PLAYS],
    /// w_i, m per cell; w_0 > 0, none negative.
    pub weights: [T; PLAYS],
    /// Σ w_i, m per cell.
    pub slope: T,
    /// Σ w_i r_i, m.
    pub rest: T,
    /// κ ≥ 0.
    pub widening: T,
    /// 1/v₀, ticks per cell.
    pub per_rate: T,
    /// e^(−T/τ) of the filter of the rate.
    pub decay: T,
}

impl<T: Real> Plays<T> {
    /// Adds its numbers to a checksum.
    pub fn checksum(&self, crc: &mut Crc32) {
        crc.reals(&[self.full_scale]);
        crc.reals(&self.thresholds);
        crc.reals(&self.weights);
        crc.reals(&[self.slope, self.rest, self.widening, self.per_rate, self.decay]);
    }

    /// s at a rate, cells per tick.
    #[inline]
    fn scale(&self, rate: T) -> T {
        T::ONE + self.widening * logarithm(T::ONE + rate.abs() * self.per_rate)
    }
}

crate::state! { |words|
    /// Plays of one leg. Reset: drive 0 after negative saturation, with the `thresholds` of [`Plays`].
    pub struct PlayMemory<T>[T: Real](thresholds: [T; PLAYS]) {
        /// Drive last applied, cells.
        drive: T = T::ZERO, number(LARGEST);
        /// P, m.
        displacement: T = T::ZERO, number(words.sizes().leg);
        /// v, cells per tick.
        rate: T = T::ZERO, number(LARGEST);
        /// s of the next tick.
        scale: T = T::ONE, number(64.0) if *scale >= T::ONE;
        /// p_i − u, cells.
        states: [T; PLAYS] = thresholds, numbers(LARGEST);
        /// Last step of the drive, cells.
        step: T = T::ZERO, number(LARGEST);
        /// Change of P if the next tick repeats it, m; the slope of P there, m per cell; the distance to where it changes, cells.
        onward: T = T::ZERO, number(LARGEST);
        /// Until a tick has evaluated them, the search begins at the present drive.
        slope: T = T::ONE, number(LARGEST) if *slope >= T::from_f64(1e-15);
        clear: T = T::ZERO, number(LARGEST) if *clear >= T::ZERO;
    }
}

impl<T: Real> PlayMemory<T> {
    /// The state at a `drive` (cells) just reached from below, slowly, with p_i − u in `states` and P = `displacement`, m.
    #[must_use]
    pub const fn risen(drive: T, displacement: T, states: [T; PLAYS]) -> Self {
        let mut memory = Self::new(states);
        memory.drive = drive;
        memory.displacement = displacement;
        memory
    }

    /// The drive, cells, that ends at `displacement` (m), not limited to the range.
    #[inline(always)]
    fn unlimited(&self, plays: &Plays<T>, displacement: T) -> T {
        let wanted = displacement - self.displacement;
        let change = (wanted - self.onward) / self.slope;
        let step = self.step + change;
        self.drive + if change.abs() <= self.clear { step } else { self.sought(plays, wanted, step) }
    }

    /// The step, cells, that changes P by `wanted` (m), sought from `near`.
    #[inline(never)]
    fn sought(&self, plays: &Plays<T>, wanted: T, near: T) -> T {
        let mut step = near;
        for _ in 0..MOST_STEPS {
            let mut found = Onward::new(plays, step);
            for ((state, threshold), weight) in self.states.iter().zip(&plays.thresholds).zip(&plays.weights).skip(1) {
                found.add(*weight, step - *state, self.scale * *threshold);
            }
            let change = (wanted - found.change) / found.slope;
            step = step + change;
            if change.abs() <= found.clear {
                break;
            }
        }
        step
    }
}

/// Change of P over a step, m; its slope there, m per cell; the distance to where that changes, cells.
struct Onward<T> {
    change: T,
    slope: T,
    clear: T,
}

impl<T: Real> Onward<T> {
    /// That of the first play, which always moves with the drive.
    #[inline(always)]
    fn new(plays: &Plays<T>, step: T) -> Self {
        let [first, ..] = plays.weights;
        Self { change: first * step, slope: first, clear: T::from_f64(LARGEST) }
    }

    /// Adds a play from which the drive ends `ahead` away, with threshold `width`, both in cells.
    #[inline(always)]
    fn add(&mut self, weight: T, ahead: T, width: T) {
        let mut beyond = ahead.abs() - width;
        if beyond >= T::ZERO {
            self.change = self.change + weight * if ahead < T::ZERO { -beyond } else { beyond };
            self.slope = self.slope + weight;
        } else {
            beyond = -beyond;
        }
        if beyond < self.clear {
            self.clear = beyond;
        }
    }
}

impl<T: Real> DriveMemory<T> for PlayMemory<T> {
    #[inline(always)]
    fn drive(&self) -> T {
        self.drive
    }

    #[inline(always)]
    fn displacement(&self) -> T {
        self.displacement
    }
}

impl<T: Real> HysteresisMemory<T, &Plays<T>> for PlayMemory<T> {
    #[inline]
    fn apply(&mut self, plays: &&Plays<T>, drive: T) -> T {
        let drive = saturate(drive, T::ZERO, plays.full_scale);
        let step = drive - self.drive;
        let scale = self.scale;
        self.rate = step + (self.rate - step) * plays.decay;
        self.scale = plays.scale(self.rate);
        self.step = step;
        self.drive = drive;
        let mut sum = T::ZERO;
        let mut onward = Onward::new(plays, step);
        let each = self.states.iter_mut().zip(&plays.thresholds).zip(&plays.weights).skip(1);
        for ((state, threshold), weight) in each {
            let width = scale * *threshold;
            let away = saturate(*state - step, -width, width);
            *state = away;
            sum = sum + *weight * away;
            onward.add(*weight, step - away, self.scale * *threshold);
        }
        (self.onward, self.slope, self.clear) = (onward.change, onward.slope, onward.clear);
        self.displacement = plays.slope * drive + sum - plays.rest;
        self.displacement
    }

    #[inline]
    fn solve(&self, plays: &&Plays<T>, displacement: T) -> T {
        saturate(self.unlimited(plays, displacement), T::ZERO, plays.full_scale)
    }

    #[inline]
    fn reaches(&self, plays: &&Plays<T>, displacement: T) -> bool {
        let drive = self.unlimited(plays, displacement);
        drive >= T::ZERO && drive <= plays.full_scale
    }

    #[inline(always)]
    fn follow_within(&mut self, plays: &&Plays<T>, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
        let wanted = self.unlimited(plays, displacement);
        let drive = saturate(wanted, T::ZERO, plays.full_scale);
        self.apply(plays, permit(drive));
        drive != wanted
    }

    #[inline(always)]
    fn track(
        &mut self,
        plays: &&Plays<T>,
        _last: &mut LastLine<T>,
        displacement: T,
        permit: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        let wanted = self.unlimited(plays, displacement);
        let permitted = if wanted >= T::ZERO && wanted <= plays.full_scale { permit(wanted) } else { None };
        permitted.is_some_and(|drive| {
            self.apply(plays, drive);
            true
        })
    }
}

/// ln of a value from 1 to 2³², to 1e-6: halved until it is below 2, then a series in t = (m − 1)/(m + 1).
#[inline]
fn logarithm<T: Real>(value: T) -> T {
    let (mut rest, mut sum) = (value, T::ZERO);
    for (bound, share, part) in [
        (65536.0, 0.0000152587890625, 11.090354888959125),
        (256.0, 0.00390625, 5.545177444479562),
        (16.0, 0.0625, 2.772588722239781),
        (4.0, 0.25, 1.3862943611198906),
        (2.0, 0.5, core::f64::consts::LN_2),
    ] {
        if rest >= T::from_f64(bound) {
            rest = rest * T::from_f64(share);
            sum = sum + T::from_f64(part);
        }
    }
    let t = (rest - T::ONE) / (rest + T::ONE);
    let z = t * t;
    let [third, fifth, seventh, ninth] =
        [0.3333333333333333, 0.2, 0.14285714285714285, 0.1111111111111111].map(T::from_f64);
    sum + (t + t) * (T::ONE + z * (third + z * (fifth + z * (seventh + z * ninth))))
}
