//! What a platform may have or not, and then has a size of: none costs neither memory nor instructions.

use core::fmt::Debug;

use specgen_runtime::trigger::{Line, Seen, Triggers};
use specgen_runtime::{Calibration, Correction, CorrectionLimit, Damping, Real, Resonator, Snapshot};

/// Active damping of six modes, or of none: what it remembers.
pub trait ModalDamping<T: Real>: Copy + Debug + Snapshot {
    /// A section for each mode.
    type Sections;
    /// Nothing asked for.
    const REST: Self;
    /// From now on nothing is asked for.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// One tick: the error of each mode to what is asked for against it.
    fn act(&mut self, sections: &Self::Sections, error: &[T; 6]);
    /// `wanted` and what is asked for against the modes.
    fn beside(&self, wanted: [T; 6]) -> [T; 6];
}

impl<T: Real + Debug, const N: usize> ModalDamping<T> for Damping<T, N> {
    type Sections = [Resonator<T>; N];
    const REST: Self = Self::new();
    #[inline(always)]
    fn act(&mut self, sections: &Self::Sections, error: &[T; 6]) {
        self.act(sections, error);
    }
    #[inline(always)]
    fn beside(&self, wanted: [T; 6]) -> [T; 6] {
        self.beside(wanted)
    }
}

/// Correction of the request on six axes, or on none.
pub trait RequestCorrection<T: Real>: Copy + Debug + Snapshot {
    /// How far and how fast that of each axis goes.
    type Limits;
    /// What is wanted of each axis.
    type Wanted: Copy + Debug + PartialEq + AsRef<[T]> + AsMut<[T]>;
    /// Nothing corrected.
    const REST: Self;
    /// From now on nothing is corrected.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// Nothing wanted of as many axes as have limits.
    fn nothing(limits: &Self::Limits) -> Self::Wanted;
    /// One tick: follows what is wanted as far as the limits let it. Returns whether they held any axis back.
    fn follow(&mut self, limits: &Self::Limits, wanted: &Self::Wanted) -> bool;
    /// c as a pose; none where there is none.
    fn pose(&self) -> Option<[T; 6]>;
}

impl<T: Real + Debug, const N: usize> RequestCorrection<T> for Correction<T, N> {
    type Limits = [CorrectionLimit<T>; N];
    type Wanted = [T; N];
    const REST: Self = Self::new();
    #[inline(always)]
    fn nothing(_limits: &Self::Limits) -> [T; N] {
        [T::ZERO; N]
    }
    #[inline(always)]
    fn follow(&mut self, limits: &Self::Limits, wanted: &[T; N]) -> bool {
        self.follow(limits, wanted)
    }
    #[inline(always)]
    fn pose(&self) -> Option<[T; 6]> {
        self.pose()
    }
}

/// Output lines.
pub trait OutputLines<T: Real>: Copy + Debug + Snapshot {
    /// What each line shows.
    type Settings: Copy + Debug + PartialEq + AsRef<[Line<T>]> + AsMut<[Line<T>]>;
    /// All lines low.
    const LOW: Self;
    /// Whether there is any line.
    fn any(&self) -> bool;
    /// One tick of a run under these settings; the lines as bits of the status.
    fn tick(&mut self, lines: &Self::Settings, seen: &Seen<'_, T>) -> u32;
    /// One tick outside a run: all lines are low.
    fn rest(&mut self) -> u32;
    /// Pulses that each line has missed since its settings were given: 15 bits a line, the first lowest.
    fn missed(&self) -> u64;
}

impl<T: Real + Debug, const N: usize> OutputLines<T> for Triggers<T, N> {
    type Settings = [Line<T>; N];
    const LOW: Self = Self::new();
    #[inline(always)]
    fn any(&self) -> bool {
        N != 0
    }
    #[inline(always)]
    fn tick(&mut self, lines: &Self::Settings, seen: &Seen<'_, T>) -> u32 {
        self.tick(lines, seen)
    }
    #[inline(always)]
    fn rest(&mut self) -> u32 {
        self.rest()
    }
    #[inline(always)]
    fn missed(&self) -> u64 {
        self.missed()
    }
}

/// What the gauges' words mean.
pub trait GaugeCalibration<T: Real> {
    /// Readings, m, of words.
    fn readings(&self, words: &[T; 6]) -> [T; 6];
}

impl<T: Real, const N: usize> GaugeCalibration<T> for Calibration<T, N> {
    #[inline(always)]
    fn readings(&self, words: &[T; 6]) -> [T; 6] {
        self.readings(words)
    }
}
