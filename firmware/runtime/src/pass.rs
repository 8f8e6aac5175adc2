//! A pass of a motion that repeats: its correction is played, and what the gauges show of its error is kept, both in fixed memory.
//!
//! ```text
//! e_k = 1/D Σ (h_d(n) − h(n)),  n = k D … (k + 1) D − 1        D: ticks from knot to knot, of errors as of corrections
//! ```
//! A pass begins with rest, in which the correction may already lead; then a trajectory is played, and the rest behind it belongs to the pass. What it
//! kept is for whoever learns from it, between passes: the host, or the [background](crate::learning) of the device itself.

use crate::learning::{Learning, Settings};
use crate::playback::{self, Knot, UNIT};
use crate::real::Real;

/// Ticks of a pass at most, so that every count fits.
pub const MOST_TICKS: u32 = 1 << 30;

/// How a pass runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Course {
    /// D, ticks, at least 1.
    pub spacing: u32,
    /// Ticks of rest before the command of the motion.
    pub before: u32,
    /// Ticks in all, at least 1.
    pub ticks: u32,
    /// Number of the trajectory that is played behind the rest.
    pub trajectory: u32,
}

impl Course {
    /// Knots of its correction, and of its error.
    #[must_use]
    pub const fn knots(&self) -> u32 {
        if self.spacing == 0 { 0 } else { self.ticks.div_ceil(self.spacing) }
    }
}

/// Where a pass stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// None was made.
    None,
    /// Under way.
    Running,
    /// It came to its end.
    Complete,
    /// It was ended before: the machine did not run any more, or somebody asked.
    Aborted,
    /// It came to its end, and the correction of the next one is being made of it.
    Learning,
}

impl Stage {
    /// Its number.
    #[must_use]
    pub const fn word(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Running => 1,
            Self::Complete => 2,
            Self::Aborted => 3,
            Self::Learning => 4,
        }
    }

    /// Of its number.
    #[must_use]
    pub const fn from_word(word: u8) -> Option<Self> {
        match word {
            0 => Some(Self::None),
            1 => Some(Self::Running),
            2 => Some(Self::Complete),
            3 => Some(Self::Aborted),
            4 => Some(Self::Learning),
            _ => None,
        }
    }
}

/// What the coming tick of a pass is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassInput<T> {
    /// c, m and rad.
    pub correction: [T; 6],
    /// This trajectory is played from this tick on.
    pub begins: Option<u32>,
}

/// Plays corrections and keeps errors.
#[derive(Debug)]
pub struct Player<'m, T> {
    table: &'m mut [Knot],
    errors: &'m mut [Knot],
    course: Course,
    stage: Stage,
    /// Ticks of the pass that are over.
    tick: u32,
    /// h_d of the tick before, once there was one.
    last: Option<[T; 6]>,
    /// Sum of the errors of a knot, m and rad, and of how many knots there are sums.
    sum: [T; 6],
    kept: u32,
    /// Status bits of its ticks.
    status: u32,
    /// The trajectory that it began.
    begun: Option<u32>,
    learning: Learning,
}

impl<'m, T: Real> Player<'m, T> {
    /// With this memory, half of it for corrections: none yet.
    #[must_use]
    pub fn new(memory: &'m mut [Knot]) -> Self {
        memory.fill([0; 6]);
        let (table, errors) = memory.split_at_mut(memory.len() / 2);
        Self {
            table,
            errors,
            course: Course { spacing: 1, before: 0, ticks: 1, trajectory: 0 },
            stage: Stage::None,
            tick: 0,
            last: None,
            sum: [T::ZERO; 6],
            kept: 0,
            status: 0,
            begun: None,
            learning: Learning::NONE,
        }
    }

    /// Most knots of a pass.
    #[must_use]
    pub const fn capacity(&self) -> usize {
        self.table.len()
    }

    /// Where it stands.
    #[must_use]
    pub const fn stage(&self) -> Stage {
        self.stage
    }

    /// Whether a pass is under way.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        matches!(self.stage, Stage::Running)
    }

    /// Whether a pass is under way, or learning from one.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        matches!(self.stage, Stage::Running | Stage::Learning)
    }

    /// Status bits that the controller gave in the ticks of the last pass.
    #[must_use]
    pub const fn status(&self) -> u32 {
        self.status
    }

    /// The trajectory that the last pass began; none if it did not come to that.
    #[must_use]
    pub const fn begun(&self) -> Option<u32> {
        self.begun
    }

    /// Errors of the last pass, as far as it came.
    #[must_use]
    pub fn errors(&self) -> &[Knot] {
        self.errors.get(..self.kept as usize).unwrap_or_default()
    }

    /// Knots of the correction that the next pass of the same course plays.
    #[must_use]
    pub fn correction(&self) -> &[Knot] {
        self.table.get(..self.course.knots() as usize).unwrap_or_default()
    }

    /// Takes knots of the correction, or rows of a [plan](crate::learning), from the `first` on; false, with nothing taken, during a pass or
    /// learning, or where there is no room.
    pub fn put(&mut self, first: usize, knots: impl ExactSizeIterator<Item = Knot>) -> bool {
        let Some(end) = first.checked_add(knots.len()) else { return false };
        let busy = self.is_busy();
        let Some(slots) = self.table.get_mut(first..end).filter(|_| !busy) else {
            return false;
        };
        for (slot, knot) in slots.iter_mut().zip(knots) {
            *slot = knot;
        }
        true
    }

    /// Begins a pass with the coming tick; false, with nothing changed, during another one, or if it is none or there is no room for it.
    pub fn begin(&mut self, course: Course) -> bool {
        let Course { spacing, before, ticks, .. } = course;
        let makes_sense = spacing >= 1 && (1..=MOST_TICKS).contains(&ticks) && before < ticks;
        let fits = course.knots() as usize <= self.capacity();
        if self.is_busy() || !makes_sense || !fits {
            return false;
        }
        (self.course, self.stage, self.tick) = (course, Stage::Running, 0);
        (self.last, self.sum, self.kept, self.status, self.begun) = (None, [T::ZERO; 6], 0, 0, None);
        true
    }

    /// Ends a pass that is under way.
    pub fn abort(&mut self) {
        if self.is_running() {
            self.stage = Stage::Aborted;
        }
    }

    /// Makes the correction of the next pass of the one that came to its end; false, with nothing changed, if there is none, or no
    /// [plan](crate::learning) behind its knots, or no room. What the pass kept of the error is gone then. [`Player::work`] does it.
    pub fn learn(&mut self, settings: Settings) -> bool {
        let knots = self.course.knots();
        if self.stage != Stage::Complete || self.kept != knots {
            return false;
        }
        let Some(learning) = Learning::new(settings, knots as usize, self.table, self.errors) else { return false };
        (self.learning, self.stage, self.kept) = (learning, Stage::Learning, 0);
        true
    }

    /// Does so many steps of learning, each of at most four products for every knot that the plan reaches; whether there are more. For a
    /// background: no pass begins before it is done.
    pub fn work(&mut self, steps: u32) -> bool {
        if self.stage != Stage::Learning {
            return false;
        }
        let more = self.learning.work(steps, self.table, self.errors);
        if !more {
            self.stage = Stage::Complete;
        }
        more
    }

    /// What the coming tick is given; none if no pass is under way.
    #[inline]
    #[must_use]
    pub fn give(&mut self) -> Option<PassInput<T>> {
        if self.stage != Stage::Running {
            return None;
        }
        let tick = self.tick;
        let Course { spacing, before, trajectory, .. } = self.course;
        let table = self.table.get(..self.course.knots() as usize).unwrap_or_default();
        let begins = if tick == before { Some(trajectory) } else { None };
        self.begun = self.begun.or(begins);
        Some(PassInput { correction: playback::at(table, spacing, tick), begins })
    }

    /// A tick of the pass is over: its `target` h_d is for its end, its `pose` is h at its beginning, m and rad; `status` is what the controller gave.
    #[inline]
    pub fn keep(&mut self, target: &[T; 6], pose: &[T; 6], status: u32) {
        if self.stage != Stage::Running {
            return;
        }
        let tick = self.tick;
        self.status |= status;
        if let Some(last) = self.last.replace(*target) {
            for ((sum, last), pose) in self.sum.iter_mut().zip(last).zip(pose) {
                *sum = *sum + (last - *pose);
            }
            // One tick is behind: of tick n − 1.
            let next = tick.checked_rem(self.course.spacing).unwrap_or(tick) == 0 || tick >= self.course.ticks;
            if next {
                if let Some(slot) = self.errors.get_mut(self.kept as usize) {
                    let first = self.kept * self.course.spacing;
                    let count = T::from_i32(tick.saturating_sub(first) as i32);
                    let scale = T::ONE / T::from_f64(UNIT);
                    *slot = self.sum.map(|sum| (sum / count * scale).truncate());
                    self.sum = [T::ZERO; 6];
                    self.kept += 1;
                }
            }
        }
        if tick >= self.course.ticks {
            self.stage = Stage::Complete;
        }
        self.tick = tick.saturating_add(1);
    }
}
