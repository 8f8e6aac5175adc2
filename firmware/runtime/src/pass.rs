//! A pass of a repeated motion: the player applies a correction and stores the measured error, both in fixed memory.
//!
//! ```text
//! e_k = 1/D Σ (h_d(n) − h(n)),  n = k D … (k + 1) D − 1        D: ticks from knot to knot, of errors as of corrections
//! ```
//! A pass begins at rest, where the correction may already be active. Then a trajectory is played, and the rest after it
//! belongs to the pass. Between passes, the host or the device's [background](crate::learning) learns from the stored error.

use crate::learning::{Learning, Settings};
use crate::playback::{self, Knot, UNIT};
use crate::real::Real;

/// Most ticks of a pass, so that every count fits.
pub const MOST_TICKS: u32 = 1 << 30;

/// Timing of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Course {
    /// D, ticks, at least 1.
    pub spacing: u32,
    /// Ticks at rest before the motion starts.
    pub before: u32,
    /// Ticks in all, at least 1.
    pub ticks: u32,
    /// Number of the trajectory that is played after the rest.
    pub trajectory: u32,
}

impl Course {
    /// Knots of the correction, and of the error.
    #[must_use]
    pub const fn knots(&self) -> u32 {
        if self.spacing == 0 { 0 } else { self.ticks.div_ceil(self.spacing) }
    }
}

/// State of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// There was no pass.
    None,
    /// Under way.
    Running,
    /// Complete.
    Complete,
    /// Ended early: the machine left its running phase, or a stop was requested.
    Aborted,
    /// Complete; the correction for the next pass is being computed.
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

    /// The stage with this number.
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

/// Input of the next tick of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassInput<T> {
    /// c, m and rad.
    pub correction: [T; 6],
    /// The trajectory that starts in this tick.
    pub begins: Option<u32>,
}

/// Plays corrections and stores errors.
#[derive(Debug)]
pub struct Player<'m, T> {
    table: &'m mut [Knot],
    errors: &'m mut [Knot],
    course: Course,
    stage: Stage,
    /// Completed ticks of the pass.
    tick: u32,
    /// h_d of the previous tick; none before the first.
    last: Option<[T; 6]>,
    /// Sum of the errors of a knot, m and rad, and the number of sums.
    sum: [T; 6],
    kept: u32,
    /// Status bits of its ticks.
    status: u32,
    /// The trajectory that it started.
    begun: Option<u32>,
    learning: Learning,
}

impl<'m, T: Real> Player<'m, T> {
    /// Uses one half of `memory` for corrections, which are empty at first.
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

    /// State of the pass.
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

    /// Union of the controller's status bits over the ticks of the last pass.
    #[must_use]
    pub const fn status(&self) -> u32 {
        self.status
    }

    /// The trajectory that the last pass started, if it came to that.
    #[must_use]
    pub const fn begun(&self) -> Option<u32> {
        self.begun
    }

    /// Errors of the last pass, up to where it ended.
    #[must_use]
    pub fn errors(&self) -> &[Knot] {
        self.errors.get(..self.kept as usize).unwrap_or_default()
    }

    /// The correction that the next pass with the same timing plays.
    #[must_use]
    pub fn correction(&self) -> &[Knot] {
        self.table.get(..self.course.knots() as usize).unwrap_or_default()
    }

    /// Stores knots of the correction, or rows of a [plan](crate::learning), from index `first` on. False, with nothing
    /// stored, during a pass or learning, or if they do not fit.
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

    /// Starts a pass with the next tick. False, with nothing changed, if another pass is under way, if the timing is
    /// invalid, or if it does not fit.
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

    /// Aborts the pass.
    pub fn abort(&mut self) {
        if self.is_running() {
            self.stage = Stage::Aborted;
        }
    }

    /// Starts to compute the correction of the next pass from the pass that completed. False, with nothing changed, if
    /// there is no such pass, no [plan](crate::learning) after its knots, or no room. The stored error is overwritten.
    /// [`Player::work`] does the computation.
    pub fn learn(&mut self, settings: Settings) -> bool {
        let knots = self.course.knots();
        if self.stage != Stage::Complete || self.kept != knots {
            return false;
        }
        let Some(learning) = Learning::new(settings, knots as usize, self.table, self.errors) else { return false };
        (self.learning, self.stage, self.kept) = (learning, Stage::Learning, 0);
        true
    }

    /// Does `steps` steps of learning and returns whether more remain. A step takes at most four products for every
    /// knot that the plan reaches. For the background: no pass can start before learning is complete.
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

    /// Input of the next tick; none if no pass is under way.
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

    /// Records a completed tick of the pass: `target` is h_d for its end, `pose` is h at its beginning, m and rad,
    /// `status` the controller's status.
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
            // The pose is one tick older: of tick n − 1.
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
