//! Prepared trajectories: segments, and tables with cubic splines.

use super::Target;
use crate::crc::Crc32;
use crate::real::Real;
use crate::trig::sine_cosine_turns;

/// Largest tick count, so that none overflows within a day.
pub(super) const MOST: i32 = 1 << 30;

/// A prepared trajectory, in the user's frames.
#[derive(Debug, Clone, Copy)]
pub enum Trajectory<T: Real> {
    /// Analytic segments; it ends at rest.
    Segments {
        /// Start pose, m and rad.
        start: [T; 6],
        /// In order of time; each lasts at least a tick.
        segments: &'static [Segment<T>],
        /// First tick that is not before the end.
        ticks: i32,
        /// End pose, m and rad.
        end: [T; 6],
    },
    /// Rows at equal time intervals.
    Table(Table<T>),
}

impl<T: Real> Trajectory<T> {
    /// Adds its pieces or rows to a checksum.
    pub fn checksum(&self, crc: &mut Crc32) {
        match self {
            Self::Segments { segments, .. } => {
                for segment in *segments {
                    crc.words(&[u64::from(segment.first as u32), segment.phase, segment.phase_step]);
                    crc.reals(&[segment.per_tick, segment.per_second, segment.angular]);
                    for axis in &segment.axes {
                        crc.reals(&[axis.place, axis.slope]);
                        crc.reals(&axis.sine);
                        crc.reals(&axis.cosine);
                    }
                }
            }
            Self::Table(table) => {
                for row in table.rows {
                    crc.reals(&row.pose);
                    crc.reals(&row.bend);
                }
            }
        }
    }
}

/// A segment on which each axis is a straight line plus a sinusoid whose amplitude grows linearly with time.
///
/// With w = 0..1 over the segment and S, C the sine and cosine of its phase,
/// h = p + q w + (a + b w) S + (c + d w) C.
#[derive(Debug, Clone, Copy)]
pub struct Segment<T> {
    /// First tick; the segment's own time counts from there.
    pub first: i32,
    /// w per tick.
    pub per_tick: T,
    /// w per s.
    pub per_second: T,
    /// Phase at `first`, turn/2⁶⁴.
    pub phase: u64,
    /// Phase per tick, turn/2⁶⁴; 0 if no axis has a sinusoid.
    pub phase_step: u64,
    /// Phase rate, rad/s.
    pub angular: T,
    /// By coordinate.
    pub axes: [Axis<T>; 6],
}

/// One axis of a [`Segment`], m or rad.
#[derive(Debug, Clone, Copy)]
pub struct Axis<T> {
    /// p.
    pub place: T,
    /// q.
    pub slope: T,
    /// a, b.
    pub sine: [T; 2],
    /// c, d.
    pub cosine: [T; 2],
}

/// Poses at equal time intervals, joined by a cubic spline.
#[derive(Debug, Clone, Copy)]
pub struct Table<T: Real> {
    /// At least two; if the table repeats, the last equals the first.
    pub rows: &'static [Row<T>],
    /// Ticks from row to row, ≥ 1.
    pub row_ticks: i32,
    /// 1/row_ticks.
    pub per_tick: T,
    /// Rows per s.
    pub per_second: T,
    /// 6 · (rows per s)², 1/s².
    pub bend_rate: T,
    /// Whether it starts again after the last row.
    pub repeat: bool,
}

/// A node of a spline.
#[derive(Debug, Clone, Copy)]
pub struct Row<T> {
    /// m and rad.
    pub pose: [T; 6],
    /// Second derivative · (row time)²/6, m and rad.
    pub bend: [T; 6],
}

crate::state! { |words|
    /// Position within a trajectory.
    #[derive(PartialEq, Eq)]
    pub(super) struct Cursor {
        /// Segment or row.
        pub part: usize = 0, place(MOST as usize);
        /// Ticks since the start (segments) or since the row.
        pub tick: i32 = 0, ticks(MOST);
    }
}

impl<T: Real> Trajectory<T> {
    /// First pose, m and rad.
    #[must_use]
    pub fn start(&self) -> [T; 6] {
        match self {
            Self::Segments { start, .. } => *start,
            Self::Table(table) => table.rows.first().map_or([T::ZERO; 6], |row| row.pose),
        }
    }

    /// Set-point after one tick, and whether that is the end, at rest.
    #[inline]
    pub(super) fn next(&self, cursor: &mut Cursor) -> (Target<T>, bool) {
        match self {
            Self::Segments { segments, ticks, end, .. } => {
                cursor.tick += 1;
                if let Some(following) = segments.get(cursor.part + 1) {
                    if cursor.tick >= following.first {
                        cursor.part += 1;
                    }
                }
                match segments.get(cursor.part) {
                    Some(segment) if cursor.tick < *ticks => (segment.at(cursor.tick - segment.first), false),
                    _ => (Target::at(*end), true),
                }
            }
            Self::Table(table) => table.next(cursor),
        }
    }
}

impl<T: Real> Segment<T> {
    /// Set-point `tick` ticks after the segment began.
    #[inline]
    fn at(&self, tick: i32) -> Target<T> {
        let w = T::from_i32(tick) * self.per_tick;
        let mut target = Target::new();
        if self.phase_step == 0 {
            for (index, axis) in self.axes.iter().enumerate() {
                target.pose[index] = axis.place + axis.slope * w;
                target.rate[index] = axis.slope * self.per_second;
            }
            return target;
        }
        let (s, c) = sine_cosine_turns::<T>(self.phase.wrapping_add(self.phase_step.wrapping_mul(tick as u64)));
        let square = self.angular * self.angular;
        let growth = (self.angular + self.angular) * self.per_second;
        for (index, axis) in self.axes.iter().enumerate() {
            let [a, b] = axis.sine;
            let [c0, d] = axis.cosine;
            let sine = a + b * w;
            let cosine = c0 + d * w;
            let swing = sine * s + cosine * c;
            target.pose[index] = axis.place + axis.slope * w + swing;
            target.rate[index] =
                (axis.slope + b * s + d * c) * self.per_second + (sine * c - cosine * s) * self.angular;
            target.acceleration[index] = (b * c - d * s) * growth - swing * square;
        }
        target
    }
}

impl<T: Real> Table<T> {
    #[inline]
    fn next(&self, cursor: &mut Cursor) -> (Target<T>, bool) {
        cursor.tick += 1;
        if cursor.tick >= self.row_ticks {
            cursor.tick = 0;
            cursor.part += 1;
        }
        if self.repeat && cursor.part + 1 >= self.rows.len() {
            cursor.part = 0;
        }
        match (self.rows.get(cursor.part), self.rows.get(cursor.part + 1)) {
            (Some(row), Some(following)) => (self.between(row, following, cursor.tick), false),
            _ => (Target::at(self.rows.last().map_or([T::ZERO; 6], |row| row.pose)), true),
        }
    }

    /// y = y₀ + b (y₁ − y₀) + (a³ − a) m₀ + (b³ − b) m₁ with b = 0..1 from row to row, a = 1 − b.
    #[inline]
    fn between(&self, row: &Row<T>, following: &Row<T>, tick: i32) -> Target<T> {
        let b = T::from_i32(tick) * self.per_tick;
        let a = T::ONE - b;
        let three = T::from_f64(3.0);
        let (from_a, from_b) = (a * (a * a - T::ONE), b * (b * b - T::ONE));
        let (rate_a, rate_b) = (T::ONE - three * (a * a), three * (b * b) - T::ONE);
        let mut target = Target::new();
        for index in 0..6 {
            let (y, m, n) = (row.pose[index], row.bend[index], following.bend[index]);
            let rise = following.pose[index] - y;
            target.pose[index] = y + b * rise + (from_a * m + from_b * n);
            target.rate[index] = (rise + rate_a * m + rate_b * n) * self.per_second;
            target.acceleration[index] = (a * m + b * n) * self.bend_rate;
        }
        target
    }
}
