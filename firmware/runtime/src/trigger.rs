//! Triggers: output lines that show, tick by tick, where the platform is measured to be or what it does.
//!
//! | kind | the line |
//! |---|---|
//! | position | gives a pulse as the pose passes p_k = start + k step, k ≥ 0, p_k ≤ stop + step/2 |
//! | level | is high while start ≤ pose ≤ stop; leaves only beyond that by the hysteresis |
//! | motion | is high while the set-point moves |
//! | points | gives a pulse at set-point `first` of a stream or wave, counted from 1, and at every `every`-th after it |
//! | ticks | gives a pulse at tick `first` of the run, counted from 1, and at every `every`-th after it |
//!
//! A position that was passed, in either direction, is armed again once the pose has moved away from it by the
//! hysteresis h, to either side. With h above the noise, each passage is detected once.
//!
//! ```text
//! armed ──x reaches p_k──► near p_k ──|x − p_k| ≥ h──► armed          a pulse on the way in, if its direction is selected
//! ```
//! A pulse lasts `width` ticks, and the line is low for a tick before the next, so that every pulse has its own edge.
//! Positions passed while the line is not low, and all but one of those passed within a tick, give no pulse and are
//! counted as missed. The resolution is a tick: a position is passed in the tick whose pose is the first at or beyond
//! it.

use core::fmt::Debug;

use crate::choice::choice;
use crate::linear::component;
use crate::real::Real;
use crate::snapshot::{LARGEST_PLACE, Snapshot};

/// Most output lines.
pub const MOST: usize = 4;
/// Most steps from start to stop, guaranteed by the ranges of settings.
pub const MOST_STEPS: i32 = 1 << 20;
/// Longest pulse, ticks.
pub const LONGEST: i32 = 1_000_000;
/// Largest count of missed pulses.
pub const MOST_MISSED: i32 = 0x7fff;

/// Bit of the status of each line: it is high.
pub const HIGH: [u32; MOST] = [1 << 6, 1 << 7, 1 << 14, 1 << 15];
/// Bit 21 of the status: a line has missed a pulse since its settings were written.
pub const MISSED: u32 = 1 << 21;

choice! {
    /// Function of a line.
    pub enum Kind {
        /// Off: it is low.
        Off = 0,
        /// Positions passed.
        Position = 1,
        /// High while the pose is within bounds.
        Level = 2,
        /// High while the set-point moves.
        Motion = 3,
        /// Pulses at set-points of a stream or wave.
        Points = 4,
        /// Pulses at ticks of the run.
        Ticks = 5,
    }
}

choice! {
    /// Direction of passages that give a pulse.
    pub enum Direction {
        /// All.
        Both = 0,
        /// Only with the pose rising.
        Up = 1,
        /// Only with the pose falling.
        Down = 2,
    }
}

crate::state! { |words|
    /// Settings of a line.
    #[derive(PartialEq)]
    pub struct Line<T>[T: Real] {
        /// What it shows.
        pub kind: Kind = Kind::Off, choice;
        /// Axis of position and level: x y z θx θy θz.
        pub axis: usize = 0, place(5);
        /// Of positions.
        pub direction: Direction = Direction::Both, choice;
        /// First position, or lower end of the level, from rest: m or rad.
        pub start: T = T::ZERO, number(words.sizes().line);
        /// Last position, or upper end of the level; not below `start`.
        pub stop: T = T::ZERO, number(words.sizes().line);
        /// Distance between positions, > 0, large enough for at most [`MOST_STEPS`].
        pub step: T = T::ONE, number(LARGEST_PLACE);
        /// h, m or rad.
        pub hysteresis: T = T::ZERO, number(words.sizes().line);
        /// First set-point or tick with a pulse, ≥ 1.
        pub first: u32 = 1, tally;
        /// Set-points or ticks from pulse to pulse, ≥ 1.
        pub every: u32 = 1, tally;
        /// Last set-point or tick with a pulse; 0: no last one.
        pub last: u32 = 0, tally;
        /// Length of a pulse, ticks ≥ 1.
        pub width: i32 = 1, ticks(LONGEST);
    }
}

/// Inputs of the lines in a tick.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a, T> {
    /// Last valid measured pose from rest, m and rad.
    pub pose: &'a [T; 6],
    /// The set-point moves.
    pub moves: bool,
    /// Set-points are streamed.
    pub streams: bool,
    /// Counter of the stream, see [`Command::sequence`](crate::setpoint::Command::sequence).
    pub sequence: u32,
}

choice! {
    enum Place {
        /// No pose was seen yet.
        Unknown = 0,
        /// Between positions `passed` − 1 and `passed`.
        Between = 1,
        /// At position `passed`, which was passed and is not armed.
        Near = 2,
    }
}

crate::state! { |words|
    /// State of a line.
    struct Watch<T>[T: Real] {
        /// The settings that the state belongs to.
        line: Line<T> = Line::new(), part;
        place: Place = Place::Unknown, choice;
        passed: i32 = 0, ticks(MOST_STEPS + 1);
        /// Set-points or ticks so far, and how many remain before the next pulse.
        count: u32 = 0, tally;
        left: u32 = 0, tally;
        /// Ticks that the line remains high.
        high: i32 = 0, ticks(LONGEST);
        missed: i32 = 0, ticks(MOST_MISSED);
    }
}

crate::state! { |words|
    /// All lines of a controller; `N` is 0 for a controller without lines, which then cost no memory and no
    /// instructions.
    pub struct Triggers<T, N>[T: Real, const N: usize] {
        lines: [Watch<T>; N] = [Watch::new(); N], parts;
        /// Counter of the stream at the last tick.
        sequence: [u32; N] = [0; N], tallies;
    }
}

impl<T: Real> Line<T> {
    /// Position `index`.
    #[inline]
    fn position(&self, index: i32) -> T {
        self.start + T::from_i32(index) * self.step
    }

    /// Upper bound of the positions.
    #[inline]
    fn top(&self) -> T {
        self.stop + self.step * T::HALF
    }

    /// Number of positions that are not above `pose`.
    fn below(&self, pose: T) -> i32 {
        let top = self.top();
        let pose = if pose < top { pose } else { top };
        if pose < self.start {
            return 0;
        }
        // The quotient is off by less than one, because the number of positions is limited.
        let index = ((pose - self.start) / self.step).truncate();
        let index = if index > MOST_STEPS { MOST_STEPS } else { index };
        if self.position(index) > pose {
            index
        } else if self.position(index + 1) <= pose && index < MOST_STEPS {
            index + 2
        } else {
            index + 1
        }
    }
}

impl<T: Real> Watch<T> {
    /// One tick of a run. Returns whether the line is high.
    #[inline(never)]
    fn tick(&mut self, line: &Line<T>, seen: &Observation<'_, T>, fresh: bool) -> bool {
        if self.line != *line {
            *self = Self { line: *line, ..Self::new() };
        }
        let was_high = self.high > 0;
        let pulses = match line.kind {
            Kind::Position | Kind::Points | Kind::Ticks => {
                self.high -= i32::from(was_high);
                match line.kind {
                    Kind::Position => self.passes(line, component(seen.pose, line.axis)),
                    Kind::Ticks => self.counts(line),
                    _ if !seen.streams => {
                        self.count = 0;
                        0
                    }
                    _ if fresh => self.counts(line),
                    _ => 0,
                }
            }
            Kind::Level => {
                let pose = component(seen.pose, line.axis);
                let room = if was_high { line.hysteresis } else { T::ZERO };
                self.high = i32::from(pose >= line.start - room && pose <= line.stop + room);
                0
            }
            Kind::Motion => {
                self.high = i32::from(seen.moves);
                0
            }
            Kind::Off => 0,
        };
        if pulses > 0 {
            let given = i32::from(!was_high);
            if !was_high {
                self.high = line.width;
            }
            let missed = self.missed.saturating_add(pulses - given);
            self.missed = if missed < MOST_MISSED { missed } else { MOST_MISSED };
        }
        self.high > 0
    }

    /// Sets the line low and restarts it.
    fn rest(&mut self) {
        self.place = Place::Unknown;
        self.count = 0;
        self.high = 0;
    }

    /// One set-point or tick; 1 if it has a pulse.
    #[inline]
    fn counts(&mut self, line: &Line<T>) -> i32 {
        if self.count == 0 {
            self.left = line.first.saturating_sub(1);
        }
        self.count = self.count.saturating_add(1);
        if self.left > 0 {
            self.left -= 1;
            return 0;
        }
        self.left = line.every.saturating_sub(1);
        i32::from(line.last == 0 || self.count <= line.last)
    }

    /// Takes the pose `x`. Returns how many positions it has passed in the selected direction.
    #[inline]
    fn passes(&mut self, line: &Line<T>, x: T) -> i32 {
        match self.place {
            Place::Unknown => {
                self.settle(line, x);
                return 0;
            }
            Place::Near => {
                let position = line.position(self.passed);
                if x >= position + line.hysteresis {
                    self.passed += 1;
                } else if x > position - line.hysteresis {
                    return 0;
                }
                self.place = Place::Between;
            }
            Place::Between => {}
        }
        let next = line.position(self.passed);
        if x >= next && next <= line.top() {
            self.rise(line, x)
        } else if self.passed > 0 && x <= line.position(self.passed - 1) {
            self.fall(line, x)
        } else {
            0
        }
    }

    /// Initial state: a position within the hysteresis counts as passed.
    fn settle(&mut self, line: &Line<T>, x: T) {
        let below = line.below(x);
        let next = line.position(below);
        self.place = Place::Near;
        self.passed = below;
        if below > 0 && x < line.position(below - 1) + line.hysteresis {
            self.passed = below - 1;
        } else if next > line.top() || x <= next - line.hysteresis {
            self.place = Place::Between;
        }
    }

    fn rise(&mut self, line: &Line<T>, x: T) -> i32 {
        let below = line.below(x);
        let passed = below - self.passed;
        let near = x < line.position(below - 1) + line.hysteresis;
        (self.place, self.passed) = if near { (Place::Near, below - 1) } else { (Place::Between, below) };
        if line.direction == Direction::Down { 0 } else { passed }
    }

    fn fall(&mut self, line: &Line<T>, x: T) -> i32 {
        // A position exactly at the pose is passed, too.
        let at = line.below(x);
        let below = if at > 0 && line.position(at - 1) >= x { at - 1 } else { at };
        let passed = self.passed - below;
        let near = x > line.position(below) - line.hysteresis;
        (self.place, self.passed) = (if near { Place::Near } else { Place::Between }, below);
        if line.direction == Direction::Up { 0 } else { passed }
    }
}

/// Output lines.
pub trait OutputLines<T: Real>: Copy + Debug + Snapshot {
    /// Settings of the lines.
    type Settings: Copy + Debug + PartialEq + AsRef<[Line<T>]> + AsMut<[Line<T>]>;
    /// All lines low.
    const LOW: Self;
    /// Whether there is any line.
    fn any(&self) -> bool;
    /// One tick of a run under these settings; the lines as bits of the status: [`HIGH`], [`MISSED`].
    fn tick(&mut self, lines: &Self::Settings, seen: &Observation<'_, T>) -> u32;
    /// One tick outside a run: all lines are low. [`MISSED`] keeps its value.
    fn rest(&mut self) -> u32;
    /// Pulses that each line has missed since its settings were written, up to [`MOST_MISSED`]: 15 bits a line, the
    /// first lowest.
    #[must_use]
    fn missed(&self) -> u64;
}

impl<T: Real + Debug, const N: usize> OutputLines<T> for Triggers<T, N> {
    type Settings = [Line<T>; N];
    const LOW: Self = Self::new();

    #[inline(always)]
    fn any(&self) -> bool {
        N != 0
    }

    #[inline]
    fn tick(&mut self, lines: &[Line<T>; N], seen: &Observation<'_, T>) -> u32 {
        let mut status = 0;
        for (((watch, last), line), bit) in self.lines.iter_mut().zip(&mut self.sequence).zip(lines).zip(HIGH) {
            let fresh = seen.sequence != *last;
            *last = seen.sequence;
            if watch.tick(line, seen, fresh) {
                status |= bit;
            }
            if watch.missed > 0 {
                status |= MISSED;
            }
        }
        status
    }

    #[inline]
    fn rest(&mut self) -> u32 {
        let mut status = 0;
        for watch in &mut self.lines {
            watch.rest();
            if watch.missed > 0 {
                status = MISSED;
            }
        }
        status
    }

    fn missed(&self) -> u64 {
        let mut word = 0;
        for (line, watch) in self.lines.iter().enumerate() {
            word |= (watch.missed as u64) << (15 * line);
        }
        word
    }
}

/// The lines that are high in a status: bit k for line k.
///
/// ```
/// use specgen_runtime::trigger::{HIGH, lines};
///
/// assert_eq!(lines(HIGH[0] | HIGH[3]), 0b1001);
/// ```
#[inline]
#[must_use]
pub const fn lines(status: u32) -> u32 {
    status >> 6 & 0b11 | status >> 12 & 0b1100
}
