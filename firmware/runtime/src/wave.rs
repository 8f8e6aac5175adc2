//! The wave generator: set-points, or voltages of an open drive, from the controller's own tick, in fixed memory, for
//! identification, tests and records.
//!
//! Each of the six axes (of the pose, or the legs) has a [`Shape`] about an offset. All of them begin and end together at the
//! `center`, smoothly: the wave is
//!
//! ```text
//! h_d = center + e(t) (offset + s(t))        e: 0 → 1 over `ramp_ticks` as x³ (10 − 15 x + 6 x²), and back at the end
//! ```
//! with analytic rates and accelerations. A wave that would leave the range of an axis, or exceed the limits of its
//! stream, is refused before it begins ([`Wave::load`]). The controller checks every set-point again. Sine and chirp
//! count their phase in 2⁻⁶⁴ turns and use [`crate::trig`]: the same bits everywhere, and no drift.

mod shape;
mod words;

pub use shape::{AxisWave, Shape, TONES, Tone, step_of};
pub use words::{LARGEST, WORDS};

use crate::motion::Motion;
use crate::real::Real;
use crate::setpoint::{Frames, Setpoints};
use shape::{Cursor, Sample};

/// Limits of a wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T> {
    /// Lowest and highest set-point of each axis, m and rad.
    pub low: [T; 6],
    /// See `low`.
    pub high: [T; 6],
    /// Largest |rate|, m/s and rad/s.
    pub rate: [T; 6],
    /// Largest |acceleration|, m/s² and rad/s².
    pub acceleration: [T; 6],
    /// Ticks in a second.
    pub ticks_per_second: T,
}

impl<T: Real> Limits<T> {
    /// The limits of a platform's streams. In frames that rotate the user's coordinates, the range is that of the
    /// platform; the controller refuses set-points beyond it.
    #[must_use]
    pub fn of<F: Frames<T>>(setpoints: &Setpoints<T, F>) -> Self {
        let mut limits = Self {
            low: setpoints.bound,
            high: setpoints.bound,
            rate: setpoints.stream_rate,
            acceleration: setpoints.stream_acceleration,
            ticks_per_second: setpoints.rate,
        };
        for (axis, bias) in setpoints.bias.iter().enumerate() {
            limits.low[axis] = -(setpoints.bound[axis] + *bias);
            limits.high[axis] = setpoints.bound[axis] - *bias;
        }
        limits
    }
}

/// A wave of six axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<T> {
    /// Pose at its start and end, m and rad.
    pub center: [T; 6],
    /// By axis.
    pub axes: [AxisWave<T>; 6],
    /// Tones of multisines.
    pub tones: [Tone<T>; TONES],
    /// Ticks of the smooth start and of the smooth end, ≥ 1.
    pub ramp_ticks: i32,
    /// Ticks from the start until it ends by itself; 0: it runs until it is stopped.
    pub ticks: i32,
}

/// Reason why a wave is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Another one is under way.
    Busy,
    /// A word that is not a number, or out of range for its place.
    Word(usize),
    /// The axis would leave its range.
    Range(usize),
    /// The axis would be too fast.
    Rate(usize),
    /// The axis would accelerate too much.
    Acceleration(usize),
}

/// State of a wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Nothing.
    Idle,
    /// The amplitude grows: ticks since the start.
    Starting(i32),
    /// At full amplitude.
    Running,
    /// The amplitude falls: ticks since the stop.
    Ending(i32),
}

/// The generator.
#[derive(Debug, Clone, Copy)]
pub struct Wave<T> {
    limits: Limits<T>,
    settings: Settings<T>,
    stage: Stage,
    /// Ticks since the start.
    tick: i32,
    /// Stop as soon as the start is complete.
    stop: bool,
    cursors: [Cursor; 6],
    /// Number of set-points so far.
    sequence: u32,
    /// Whether it is of the voltages of an open drive.
    drives: bool,
}

impl<T: Real> Wave<T> {
    /// Idle, with a constant wave.
    #[must_use]
    pub const fn new(limits: Limits<T>) -> Self {
        Self {
            limits,
            settings: Settings::still(),
            stage: Stage::Idle,
            tick: 0,
            stop: false,
            cursors: [Cursor::new(); 6],
            sequence: 0,
            drives: false,
        }
    }

    /// Of the voltages of an open drive, if `drives`.
    #[must_use]
    pub const fn of_drive(self, drives: bool) -> Self {
        Self { drives, ..self }
    }

    /// Whether it is of the voltages of an open drive.
    #[must_use]
    pub const fn drives(&self) -> bool {
        self.drives
    }

    /// Its state.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Pose at its start and end.
    #[must_use]
    pub fn center(&self) -> &[T; 6] {
        &self.settings.center
    }

    /// Number of set-points so far: the `sequence` of a stream.
    #[must_use]
    pub fn sequence(&self) -> u32 {
        self.sequence
    }

    /// Continues the count of an earlier wave.
    pub fn count_from(&mut self, sequence: u32) {
        self.sequence = sequence;
    }

    /// Takes new settings, as words ([`Settings::to_words`]).
    ///
    /// # Errors
    /// If a wave is under way, a word is invalid, or an axis would exceed its limits. The settings are then unchanged.
    pub fn load(&mut self, words: &[u64; WORDS]) -> Result<(), Refusal> {
        self.set(&Settings::from_words(words)?)
    }

    /// Takes other settings.
    ///
    /// # Errors
    /// As [`Wave::load`].
    pub fn set(&mut self, settings: &Settings<T>) -> Result<(), Refusal> {
        if self.stage != Stage::Idle {
            return Err(Refusal::Busy);
        }
        settings.check(&self.limits)?;
        self.settings = *settings;
        Ok(())
    }

    /// Starts, if no wave is under way.
    pub fn start(&mut self) {
        if self.stage == Stage::Idle {
            self.stage = Stage::Starting(0);
            self.tick = 0;
            self.stop = false;
            for (cursor, axis) in self.cursors.iter_mut().zip(&self.settings.axes) {
                *cursor = Cursor::start(axis, self.settings.ramp_ticks);
            }
        }
    }

    /// Ends smoothly; a start in progress is completed first.
    pub fn stop(&mut self) {
        self.stop = true;
    }

    /// The set-point at the end of the next interval; none if no wave is under way. The last one is at rest at the
    /// center.
    #[inline]
    pub fn advance(&mut self) -> Option<Motion<T>> {
        let envelope = self.envelope()?;
        self.sequence = self.sequence.wrapping_add(1);
        let mut target = Motion::at(self.settings.center);
        let second = self.limits.ticks_per_second;
        for (index, (axis, cursor)) in self.settings.axes.iter().zip(&mut self.cursors).enumerate() {
            let shape = cursor.next(axis, &self.settings.tones);
            let value = axis.offset + shape.value;
            let (e, s) = (&envelope, &shape);
            target.pose[index] = target.pose[index] + e.value * value;
            target.rate[index] = (e.rate * value + e.value * s.rate) * second;
            let bend = e.bend * value + (e.rate + e.rate) * s.rate + e.value * s.bend;
            target.acceleration[index] = bend * second * second;
        }
        Some(target)
    }

    /// Moves e one tick on, with its derivatives per tick.
    #[inline]
    fn envelope(&mut self) -> Option<Sample<T>> {
        let full = Sample { value: T::ONE, rate: T::ZERO, bend: T::ZERO };
        let ramp = self.settings.ramp_ticks;
        self.tick = self.tick.saturating_add(1);
        if self.settings.ticks > 0 && self.tick > self.settings.ticks.saturating_sub(ramp) {
            self.stop = true;
        }
        match self.stage {
            Stage::Idle => None,
            Stage::Starting(since) => {
                let now = since + 1;
                self.stage = if now >= ramp { Stage::Running } else { Stage::Starting(now) };
                Some(if now >= ramp { full } else { smooth(now, ramp) })
            }
            Stage::Running if self.stop => Some(self.end(0)),
            Stage::Running => Some(full),
            Stage::Ending(since) => Some(self.end(since)),
        }
    }

    fn end(&mut self, since: i32) -> Sample<T> {
        let now = since + 1;
        let ramp = self.settings.ramp_ticks;
        if now >= ramp {
            self.stage = Stage::Idle;
            return Sample { value: T::ZERO, rate: T::ZERO, bend: T::ZERO };
        }
        self.stage = Stage::Ending(now);
        let left = smooth::<T>(ramp - now, ramp);
        Sample { rate: -left.rate, ..left }
    }
}

/// x³ (10 − 15 x + 6 x²) at x = `tick`/`ticks`, with its derivatives per tick.
#[inline]
fn smooth<T: Real>(tick: i32, ticks: i32) -> Sample<T> {
    let n = T::from_i32(ticks);
    let x = T::from_i32(tick) / n;
    let c = |number: i32| T::from_i32(number);
    let rest = T::ONE - x;
    Sample {
        value: x * x * x * (c(10) - x * (c(15) - c(6) * x)),
        rate: c(30) * x * x * rest * rest / n,
        bend: c(60) * x * rest * (rest - x) / n / n,
    }
}

impl<T: Real> Settings<T> {
    /// Constant zero.
    #[must_use]
    pub const fn still() -> Self {
        Self {
            center: [T::ZERO; 6],
            axes: [AxisWave::still(); 6],
            tones: [Tone { amplitude: T::ZERO, phase: 0, step: 0 }; TONES],
            ramp_ticks: 1,
            ticks: 0,
        }
    }

    /// Whether each axis stays within its limits, ramps included.
    fn check(&self, limits: &Limits<T>) -> Result<(), Refusal> {
        // Largest slope and curvature of the envelope: 15/8, and 10/√3 rounded up.
        let n = T::from_i32(if self.ramp_ticks > 0 { self.ramp_ticks } else { 1 });
        let (slope, bend) = (T::from_f64(1.875) / n, T::from_f64(5.774) / n / n);
        let second = limits.ticks_per_second;
        for (index, axis) in self.axes.iter().enumerate() {
            let peak = axis.peak(&self.tones);
            let center = self.center[index];
            let (low, high) = (axis.offset + peak.low, axis.offset + peak.high);
            let lowest = center + if low < T::ZERO { low } else { T::ZERO };
            let highest = center + if high > T::ZERO { high } else { T::ZERO };
            // Written so that a NaN is refused.
            if !(lowest >= limits.low[index] && highest <= limits.high[index]) {
                return Err(Refusal::Range(index));
            }
            let reach = if -low > high { -low } else { high };
            let within = (peak.rate + reach * slope) * second <= limits.rate[index];
            if !within {
                return Err(Refusal::Rate(index));
            }
            let most = peak.bend + (peak.rate + peak.rate) * slope + reach * bend;
            let within = most * second * second <= limits.acceleration[index];
            if !within {
                return Err(Refusal::Acceleration(index));
            }
        }
        Ok(())
    }
}
