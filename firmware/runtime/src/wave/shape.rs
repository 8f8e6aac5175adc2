//! The shape of one axis: value, rate and curvature at a tick.

use crate::real::Real;
use crate::trig::sine_cosine_turns;

/// Tones that the multisines of a wave share.
pub const TONES: usize = 16;
/// 2π/2³²: rad in a step of 2⁻³² turns.
const RADIANS: f64 = core::f64::consts::TAU / 4_294_967_296.0;

/// Motion of an axis. Amplitudes in m or rad; phases and steps per tick in 2⁻⁶⁴ turns, steps below half a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape<T> {
    /// Stays.
    Constant,
    /// Straight to `amplitude` in `ticks`, then constant.
    Ramp {
        /// Its end; of either sign.
        amplitude: T,
        /// ≥ 1.
        ticks: i32,
    },
    /// Straight up to `amplitude`, down to −`amplitude` and back: a period takes one turn.
    Triangle {
        /// ≥ 0.
        amplitude: T,
        /// A period is one turn.
        step: u64,
    },
    /// Sine.
    Sine {
        /// The tone.
        tone: Tone<T>,
    },
    /// Sine whose frequency changes linearly from that of the tone to another, and stays there.
    Chirp {
        /// It begins so.
        tone: Tone<T>,
        /// Change of the step per tick, as a signed number.
        sweep: i64,
        /// Ticks of the change, ≥ 1.
        ticks: i32,
    },
    /// Sum of some of the wave's tones.
    Multisine {
        /// Index of the first tone.
        first: usize,
        /// Number of tones, `first` + `count` ≤ [`TONES`].
        count: usize,
    },
    /// First-order reversal curves, as `specgen identify` reads them: for k = 1 … `levels`, a hold at zero, straight to
    /// `amplitude` k/`levels`, a hold, and straight back, all at one speed; then zero. They begin with the end of the
    /// wave's smooth start.
    Reversals {
        /// Highest peak; of either sign.
        amplitude: T,
        /// Peaks, ≥ 1.
        levels: i32,
        /// Ticks for `amplitude`/`levels`, ≥ 1.
        ticks: i32,
        /// Ticks of a hold, ≥ 0.
        hold: i32,
        /// Ticks over which the speed changes, half of them within the hold; at most `hold` and `ticks`.
        corner: i32,
    },
}

/// A sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone<T> {
    /// ≥ 0.
    pub amplitude: T,
    /// At the start, 2⁻⁶⁴ turns.
    pub phase: u64,
    /// Per tick, 2⁻⁶⁴ turns.
    pub step: u64,
}

/// The wave of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisWave<T> {
    /// Added to the shape, m or rad.
    pub offset: T,
    /// Shape of the motion.
    pub shape: Shape<T>,
}

/// A value with its derivatives per tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample<T> {
    pub value: T,
    pub rate: T,
    pub bend: T,
}

/// Bounds of a shape.
pub(super) struct Peak<T> {
    pub low: T,
    pub high: T,
    pub rate: T,
    pub bend: T,
}

/// Position in a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cursor {
    /// Ticks since the start, and since the last reversal.
    tick: i32,
    peak: i32,
    /// Phase and step of a sine; ticks since the start of a multisine.
    phase: u64,
    step: u64,
}

/// Phase step of a frequency (Hz) at a control period (s).
#[must_use]
pub fn step_of(frequency: f64, period: f64) -> u64 {
    (frequency * period * 18_446_744_073_709_551_616.0) as u64
}

/// rad per tick of a step below half a turn.
#[inline]
fn angular<T: Real>(step: u64) -> T {
    T::from_i32((step >> 32) as i32) * T::from_f64(RADIANS)
        + T::from_i32((step as u32 >> 1) as i32) * T::from_f64(RADIANS / 2_147_483_648.0)
}

impl<T: Real> Sample<T> {
    const ZERO: Self = Self { value: T::ZERO, rate: T::ZERO, bend: T::ZERO };

    /// Spreads a `change` of the rate at a kink, `since` ticks ago, over `corner` ticks about it.
    fn round(&mut self, since: i32, corner: i32, change: T) {
        if since <= -corner || since >= corner {
            return;
        }
        let away = if since < 0 { -since } else { since };
        let left = corner - 2 * away;
        if left > 0 {
            let (left, bend) = (T::from_i32(left), change / T::from_i32(corner));
            let rate = T::from_f64(0.5) * bend * left;
            self.value = self.value + T::from_f64(0.25) * rate * left;
            self.rate = self.rate + if since <= 0 { rate } else { -rate };
            self.bend = self.bend + bend;
        }
    }
}

impl<T: Real> Tone<T> {
    /// At a phase, with a step and its change per tick.
    #[inline]
    fn at(&self, phase: u64, step: u64, sweep: T) -> Sample<T> {
        let (sine, cosine) = sine_cosine_turns::<T>(phase);
        let w = angular::<T>(step);
        let a = self.amplitude;
        Sample { value: a * sine, rate: a * w * cosine, bend: a * (sweep * cosine - w * w * sine) }
    }

    fn peak(&self, step: u64, sweep: T) -> Peak<T> {
        let (a, w) = (self.amplitude, angular::<T>(step));
        Peak { low: -a, high: a, rate: a * w, bend: a * (w * w + sweep.abs()) }
    }
}

/// rad per tick² of a signed change of a step.
#[inline]
fn bend_of<T: Real>(sweep: i64) -> T {
    let size = angular::<T>(sweep.unsigned_abs());
    if sweep < 0 { -size } else { size }
}

impl<T: Real> AxisWave<T> {
    /// Stays at zero.
    #[must_use]
    pub const fn still() -> Self {
        Self { offset: T::ZERO, shape: Shape::Constant }
    }

    /// Bounds of the shape, without the offset.
    pub(super) fn peak(&self, tones: &[Tone<T>; TONES]) -> Peak<T> {
        let zero = T::ZERO;
        match &self.shape {
            Shape::Constant => Peak { low: zero, high: zero, rate: zero, bend: zero },
            Shape::Ramp { amplitude, ticks } => straight(*amplitude, amplitude.abs() / T::from_i32(*ticks)),
            Shape::Reversals { amplitude, levels, ticks, corner, .. } => {
                let rate = amplitude.abs() / T::from_i32(*levels) / T::from_i32(*ticks);
                let bend = if *corner > 0 { rate / T::from_i32(*corner) } else { zero };
                Peak { bend, ..straight(*amplitude, rate) }
            }
            Shape::Triangle { amplitude, step } => {
                let turns = angular::<T>(*step) * T::from_f64(1.0 / core::f64::consts::TAU);
                let rate = T::from_i32(4) * *amplitude * turns;
                Peak { low: -*amplitude, high: *amplitude, rate, bend: zero }
            }
            Shape::Sine { tone } => tone.peak(tone.step, zero),
            Shape::Chirp { tone, sweep, ticks } => {
                let last = last_step(tone.step, *sweep, *ticks);
                tone.peak(if last > tone.step { last } else { tone.step }, bend_of(*sweep))
            }
            Shape::Multisine { first, count } => {
                let mut sum = Peak { low: zero, high: zero, rate: zero, bend: zero };
                for tone in tones.iter().skip(*first).take(*count) {
                    let peak = tone.peak(tone.step, zero);
                    sum.low = sum.low + peak.low;
                    sum.high = sum.high + peak.high;
                    sum.rate = sum.rate + peak.rate;
                    sum.bend = sum.bend + peak.bend;
                }
                sum
            }
        }
    }
}

fn straight<T: Real>(amplitude: T, rate: T) -> Peak<T> {
    let (low, high) = if amplitude < T::ZERO { (amplitude, T::ZERO) } else { (T::ZERO, amplitude) };
    Peak { low, high, rate, bend: T::ZERO }
}

/// Step at the end of a chirp.
fn last_step(step: u64, sweep: i64, ticks: i32) -> u64 {
    step.wrapping_add((sweep as u64).wrapping_mul(ticks as u64))
}

impl Cursor {
    pub(super) const fn new() -> Self {
        Self { tick: 0, peak: 1, phase: 0, step: 0 }
    }

    pub(super) fn start<T: Real>(axis: &AxisWave<T>, ramp_ticks: i32) -> Self {
        match &axis.shape {
            Shape::Reversals { .. } => Self { tick: 1 - ramp_ticks, ..Self::new() },
            Shape::Sine { tone } | Shape::Chirp { tone, .. } => {
                Self { phase: tone.phase, step: tone.step, ..Self::new() }
            }
            _ => Self::new(),
        }
    }

    /// Moves the shape one tick on.
    #[inline]
    pub(super) fn next<T: Real>(&mut self, axis: &AxisWave<T>, tones: &[Tone<T>; TONES]) -> Sample<T> {
        match &axis.shape {
            Shape::Constant => Sample::ZERO,
            Shape::Ramp { amplitude, ticks } => {
                if self.tick >= *ticks {
                    return Sample { value: *amplitude, ..Sample::ZERO };
                }
                self.tick += 1;
                let slope = *amplitude / T::from_i32(*ticks);
                Sample { value: slope * T::from_i32(self.tick), rate: slope, bend: T::ZERO }
            }
            Shape::Triangle { amplitude, step } => {
                self.phase = self.phase.wrapping_add(*step);
                triangle(*amplitude, self.phase, *step)
            }
            Shape::Sine { tone } => {
                self.phase = self.phase.wrapping_add(tone.step);
                tone.at(self.phase, tone.step, T::ZERO)
            }
            Shape::Chirp { tone, sweep, ticks } => {
                let sweeps = self.tick < *ticks;
                // φ = φ₀ + n s + n² h with the step s and half its change h: between two ticks it grows by s + (2 n +
                // 1) h.
                self.phase = self.phase.wrapping_add(self.step);
                if sweeps {
                    self.tick += 1;
                    self.phase = self.phase.wrapping_add((*sweep / 2) as u64);
                    self.step = self.step.wrapping_add(*sweep as u64);
                }
                tone.at(self.phase, self.step, if sweeps { bend_of(*sweep) } else { T::ZERO })
            }
            Shape::Multisine { first, count } => {
                self.phase = self.phase.wrapping_add(1);
                let mut sum = Sample::ZERO;
                for tone in tones.iter().skip(*first).take(*count) {
                    let phase = tone.phase.wrapping_add(tone.step.wrapping_mul(self.phase));
                    let sample = tone.at(phase, tone.step, T::ZERO);
                    sum.value = sum.value + sample.value;
                    sum.rate = sum.rate + sample.rate;
                    sum.bend = sum.bend + sample.bend;
                }
                sum
            }
            Shape::Reversals { amplitude, levels, ticks, hold, corner } => {
                self.reversal(*amplitude, *levels, *ticks, *hold, *corner)
            }
        }
    }

    fn reversal<T: Real>(&mut self, amplitude: T, levels: i32, ticks: i32, hold: i32, corner: i32) -> Sample<T> {
        let tick = self.tick.saturating_add(1);
        self.tick = tick;
        if tick <= 0 || self.peak > levels {
            return Sample::ZERO;
        }
        let top = self.peak.saturating_mul(ticks);
        let (high, fall) = (hold + top, hold + top + hold);
        let end = fall + top;
        let slope = amplitude / (T::from_i32(levels) * T::from_i32(ticks));
        let (height, rate) = if tick <= hold || tick > end {
            (0, T::ZERO)
        } else if tick <= high {
            (tick - hold, slope)
        } else if tick <= fall {
            (top, T::ZERO)
        } else {
            (end - tick, -slope)
        };
        let mut sample = Sample { value: slope * T::from_i32(height), rate, bend: T::ZERO };
        for (kink, change) in [(hold, slope), (high, -slope), (fall, -slope), (end, slope)] {
            sample.round(tick - kink, corner, change);
        }
        // The last corner ends within the next hold.
        if tick >= end + corner / 2 {
            self.peak += 1;
            self.tick = tick - end;
        }
        sample
    }
}

/// 0 at phase 0, `amplitude` a quarter of a turn on.
#[inline]
fn triangle<T: Real>(amplitude: T, phase: u64, step: u64) -> Sample<T> {
    // Half a turn around each peak, as a signed fraction of a quarter turn.
    let shifted = phase.wrapping_add(1 << 62);
    let falls = shifted >> 63 == 1;
    let within = (shifted << 1).wrapping_sub(1 << 63) as i64;
    let share = T::from_i32((within >> 32) as i32) * T::from_f64(1.0 / 2_147_483_648.0);
    let value = amplitude * share;
    let turns = angular::<T>(step) * T::from_f64(4.0 / core::f64::consts::TAU);
    let rate = amplitude * turns;
    if falls { Sample { value: -value, rate: -rate, bend: T::ZERO } } else { Sample { value, rate, bend: T::ZERO } }
}
