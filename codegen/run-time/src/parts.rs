//! Parts of the law that are optional, or whose number varies.

use std::convert::Infallible;
use std::fmt::Debug;

use specgen_law::legs::{Change, DeadTimeLead, LastChange, Lead};
use specgen_runtime::attitude::horner;
use specgen_runtime::linear::each;
use specgen_runtime::setpoint::{Frames, Parallel, Target, Tool, Work};
use specgen_runtime::snapshot::{Field, InvalidState, Reader, WordSink};
use specgen_runtime::trigger::{Line, MOST, Observation, OutputLines, Triggers};
use specgen_runtime::{
    Correction, CorrectionLimit, Damping, GaugeCalibration, ModalDamping, Real, RequestCorrection, Resonator, Snapshot,
};

/// An optional part; without it there are no words.
#[derive(Debug, Clone, Copy)]
pub struct Optional<S> {
    /// Whether the spec has it.
    pub given: bool,
    part: S,
}

impl<S: Field> Field for Optional<S> {
    const WORDS: usize = S::WORDS;
}

impl<S: Snapshot> Snapshot for Optional<S> {
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible> {
        if self.given { self.part.show(words) } else { Ok(()) }
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState> {
        if self.given { self.part.restore(words) } else { Ok(()) }
    }
}

impl<T: Real + Debug> ModalDamping<T> for Optional<Damping<T, 6>> {
    type Sections = Option<[Resonator<T>; 6]>;
    const REST: Self = Self { given: false, part: Damping::new() };

    fn rest(&mut self) {
        self.part = Damping::new();
    }

    #[inline]
    fn update(&mut self, sections: &Self::Sections, error: &[T; 6]) {
        if let Some(sections) = sections {
            self.part.update(sections, error);
        }
    }

    #[inline]
    fn add_to(&self, feedback: [T; 6]) -> [T; 6] {
        if self.given { self.part.add_to(feedback) } else { feedback }
    }
}

/// Up to `N` values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpTo<X, const N: usize> {
    values: [X; N],
    count: usize,
}

impl<X, const N: usize> AsRef<[X]> for UpTo<X, N> {
    fn as_ref(&self) -> &[X] {
        &self.values[..self.count]
    }
}

impl<X, const N: usize> AsMut<[X]> for UpTo<X, N> {
    fn as_mut(&mut self) -> &mut [X] {
        &mut self.values[..self.count]
    }
}

/// Settings of the output lines.
pub type LineSettings<T> = UpTo<Line<T>, MOST>;

impl<T: Real> LineSettings<T> {
    /// None if there are too many.
    pub fn new(given: &[Line<T>]) -> Option<Self> {
        let mut values = [Line::new(); MOST];
        values.get_mut(..given.len())?.copy_from_slice(given);
        Some(Self { values, count: given.len() })
    }
}

impl<T: Real + Debug> RequestCorrection<T> for Optional<Correction<T, 6>> {
    type Limits = Option<[CorrectionLimit<T>; 6]>;
    type Offsets = UpTo<T, 6>;
    const REST: Self = Self { given: false, part: Correction::new() };

    fn rest(&mut self) {
        self.part = Correction::new();
    }

    #[inline]
    fn nothing(limits: &Self::Limits) -> UpTo<T, 6> {
        UpTo { values: [T::ZERO; 6], count: if limits.is_some() { 6 } else { 0 } }
    }

    #[inline]
    fn follow(&mut self, limits: &Self::Limits, wanted: &UpTo<T, 6>) -> bool {
        limits.as_ref().is_some_and(|limits| self.part.follow(limits, &wanted.values))
    }

    #[inline]
    fn pose(&self) -> Option<[T; 6]> {
        if self.given { self.part.pose() } else { None }
    }
}

impl<T: Real + Debug> DeadTimeLead<T> for Optional<Lead<T, 1>> {
    const REST: Self = Self { given: false, part: Lead::REST };

    fn rest(&mut self) {
        self.part = Lead::REST;
    }

    #[inline]
    fn ask(&mut self, lead: impl FnOnce() -> T) {
        if self.given {
            self.part.ask(lead);
        }
    }

    #[inline]
    fn asked(&self) -> Option<T> {
        if self.given { self.part.asked() } else { None }
    }
}

impl<T: Real + Debug> LastChange<T> for Optional<Change<T, 1>> {
    const REST: Self = Self { given: false, part: Change::REST };

    fn rest(&mut self) {
        self.part = Change::REST;
    }

    #[inline]
    fn differences(&mut self, before: T, change: T, growth: T) -> Option<[T; 2]> {
        if self.given { self.part.differences(before, change, growth) } else { None }
    }
}

/// Up to four output lines.
#[derive(Debug, Clone, Copy)]
pub enum Lines<T: Real> {
    None,
    One(Triggers<T, 1>),
    Two(Triggers<T, 2>),
    Three(Triggers<T, 3>),
    Four(Triggers<T, 4>),
}

impl<T: Real> Lines<T> {
    /// One line for each of the settings, all low.
    pub fn low(settings: &LineSettings<T>) -> Self {
        match settings.count {
            0 => Self::None,
            1 => Self::One(Triggers::new()),
            2 => Self::Two(Triggers::new()),
            3 => Self::Three(Triggers::new()),
            _ => Self::Four(Triggers::new()),
        }
    }
}

macro_rules! lines {
    ($lines:expr, $name:ident => $value:expr, $none:expr) => {
        match $lines {
            Lines::None => $none,
            Lines::One($name) => $value,
            Lines::Two($name) => $value,
            Lines::Three($name) => $value,
            Lines::Four($name) => $value,
        }
    };
}

impl<T: Real> Field for Lines<T> {
    const WORDS: usize = Triggers::<T, MOST>::WORDS;
}

impl<T: Real> Snapshot for Lines<T> {
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible> {
        lines!(self, lines => lines.show(words), Ok(()))
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState> {
        lines!(self, lines => lines.restore(words), Ok(()))
    }
}

impl<T: Real + Debug> OutputLines<T> for Lines<T> {
    type Settings = LineSettings<T>;
    const LOW: Self = Self::None;

    fn any(&self) -> bool {
        !matches!(self, Self::None)
    }

    fn tick(&mut self, settings: &LineSettings<T>, seen: &Observation<'_, T>) -> u32 {
        lines!(self, lines => settings.values.first_chunk().map_or(0, |settings| lines.tick(settings, seen)), 0)
    }

    fn rest(&mut self) -> u32 {
        lines!(self, lines => lines.rest(), 0)
    }

    fn missed(&self) -> u64 {
        lines!(self, lines => lines.missed(), 0)
    }
}

/// Any of the user's frames.
#[derive(Debug, Clone, Copy)]
pub enum UserFrames<T> {
    Parallel,
    Tool(Tool<T>),
    Work(Work<T>),
}

impl<T: Real> Frames<T> for UserFrames<T> {
    fn to_platform(&self, user: &Target<T>) -> Option<Target<T>> {
        match self {
            Self::Parallel => Parallel.to_platform(user),
            Self::Tool(frames) => frames.to_platform(user),
            Self::Work(frames) => frames.to_platform(user),
        }
    }

    fn admit(&self, user: &Target<T>, bias: &[T; 6], bound: &[T; 6], target: &mut Target<T>) -> bool {
        match self {
            Self::Parallel => Parallel.admit(user, bias, bound, target),
            Self::Tool(frames) => frames.admit(user, bias, bound, target),
            Self::Work(frames) => frames.admit(user, bias, bound, target),
        }
    }
}

/// A polynomial of each gauge, lowest power first.
#[derive(Debug, Clone, Copy)]
pub struct Polynomials<T: 'static>(pub [&'static [T]; 6]);

impl<T: Real> GaugeCalibration<T> for Polynomials<T> {
    fn readings(&self, words: &[T; 6]) -> [T; 6] {
        each(|gauge| horner(self.0[gauge], words[gauge]).unwrap_or(T::ZERO))
    }
}
