//! The wave of a drive: as a file, and at any tick as the runtime's generator computes it.

use core::fmt::Write as _;

use super::Bench;

/// A sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tone {
    /// V.
    pub amplitude: f64,
    /// Hz.
    pub frequency: f64,
    /// Turns, from 0 to 1.
    pub phase: f64,
}

/// The motion, above the lowest voltage of the range.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// Raised cosines over the range, of so many ticks.
    Strokes { ticks: f64, count: u32 },
    /// Reversal curves in ascending order: hold, rise, hold, fall; all in ticks.
    Curves { grid: u32, step: u32, hold: u32, corner: u32 },
    /// A sum of sines about the middle of the range, for so many ticks.
    Tones { tones: Vec<Tone>, ticks: f64 },
}

/// A wave of legs from rest and back.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wave {
    pub tick_rate: f64,
    /// Of all, with the smooth start and end.
    pub ticks: u32,
    rest: f64,
    range: [f64; 2],
    /// Of the smooth start, and of the end.
    ramp: u32,
    pub shape: Shape,
}

impl Shape {
    /// Largest rate, V/s.
    pub(super) fn rate(&self, [low, high]: [f64; 2], tick_rate: f64) -> f64 {
        let span = high - low;
        match self {
            Self::Strokes { ticks, .. } => core::f64::consts::PI * span / ticks * tick_rate,
            Self::Curves { grid, step, .. } => span / f64::from(*grid) / f64::from(*step) * tick_rate,
            Self::Tones { tones, .. } => {
                tones.iter().fold(0.0, |sum, tone| sum + core::f64::consts::TAU * tone.frequency * tone.amplitude)
            }
        }
    }

    /// Ticks without the smooth start and end of curves, which begin with the end of the start.
    fn ticks(&self, ramp: u32) -> f64 {
        match self {
            Self::Strokes { ticks, count } => ticks * f64::from(*count),
            Self::Curves { grid, step, hold, .. } => {
                f64::from(grid * (grid + 1) * step + (2 * grid + 1) * hold + 2 * ramp)
            }
            Self::Tones { ticks, .. } => *ticks,
        }
    }
}

impl Wave {
    pub(super) fn new(bench: &Bench, range: [f64; 2], ramp: u32, shape: Shape) -> Self {
        let ticks = shape.ticks(ramp);
        Self { tick_rate: bench.tick_rate, ticks: ticks as u32, rest: bench.rest, range, ramp, shape }
    }

    /// Tick at which curves begin.
    pub(super) fn begin(&self) -> u32 {
        self.ramp - 1
    }

    /// V.
    pub(super) fn voltage(&self, tick: f64) -> f64 {
        let left = f64::from(self.ticks) - tick;
        let x = if left < tick { left } else { tick } / f64::from(self.ramp);
        let envelope = match x {
            x if x <= 0.0 => return self.rest,
            x if x < 1.0 => x * x * x * (10.0 - x * (15.0 - 6.0 * x)),
            _ => 1.0,
        };
        let [low, high] = self.range;
        let height = match &self.shape {
            Shape::Strokes { ticks, .. } => {
                0.5 * (high - low) * (1.0 - libm::cos(core::f64::consts::TAU * tick / ticks))
            }
            Shape::Curves { grid, step, hold, corner } => {
                let slope = (high - low) / f64::from(*grid) / f64::from(*step);
                let after = tick - f64::from(self.begin());
                slope * curves(after, *grid, [*step, *hold, *corner].map(f64::from))
            }
            Shape::Tones { tones, .. } => {
                let time = tick / self.tick_rate;
                let at = |tone: &Tone| {
                    tone.amplitude * libm::sin(core::f64::consts::TAU * (tone.frequency * time + tone.phase))
                };
                tones.iter().fold(0.5 * (high - low), |sum, tone| sum + at(tone))
            }
        };
        self.rest + envelope * (low - self.rest + height)
    }

    /// The wave as a file, in which the other legs are at `held` (V).
    pub(super) fn file(&self, legs: &[usize], held: &[f64; 6]) -> String {
        let seconds = |ticks: f64| ticks / self.tick_rate;
        let mut text = format!(
            "drive = true\ncenter = {:?}\nramp = {:?}\nseconds = {:?}\n",
            [self.rest; 6],
            seconds(f64::from(self.ramp)),
            seconds(f64::from(self.ticks))
        );
        let [low, high] = self.range;
        let half = 0.5 * (high - low);
        let (above, shape) = match &self.shape {
            Shape::Strokes { ticks, .. } => (
                half,
                format!(
                    "kind = \"sine\", amplitude = {half:?}, frequency = {:?}, phase = 0.75",
                    self.tick_rate / ticks
                ),
            ),
            Shape::Curves { grid, step, hold, corner } => {
                let [step, hold, corner] = [step, hold, corner].map(|ticks| seconds(f64::from(*ticks)));
                let times = format!("seconds = {step:?}, hold = {hold:?}, corner = {corner:?}");
                (0.0, format!("kind = \"reversals\", amplitude = {:?}, levels = {grid}, {times}", high - low))
            }
            Shape::Tones { tones, .. } => {
                let tone = |Tone { amplitude, frequency, phase }: &Tone| {
                    format!("{{ amplitude = {amplitude:?}, frequency = {frequency:?}, phase = {phase:?} }}")
                };
                let all: Vec<String> = tones.iter().map(tone).collect();
                (half, format!("kind = \"multisine\", tones = [{}]", all.join(", ")))
            }
        };
        for (leg, volts) in held.iter().enumerate() {
            let (offset, shape) = if legs.contains(&leg) {
                (low - self.rest + above, shape.as_str())
            } else {
                (volts - self.rest, "kind = \"constant\"")
            };
            // Writing to a String cannot fail.
            let _ = write!(text, "\n[[axis]]\naxis = {leg}\noffset = {offset:?}\nshape = {{ {shape} }}\n");
        }
        text
    }
}

/// Reversal curves of slope 1, `tick` ticks after their start: for k = 1 … `grid`, hold, rise for k `step`, hold, fall;
/// the slope changes over `corner` ticks.
fn curves(tick: f64, grid: u32, [step, hold, corner]: [f64; 3]) -> f64 {
    let mut begin = 0.0;
    for curve in 1..=grid {
        let top = f64::from(curve) * step;
        let [rise, high, fall, end] = [hold, hold + top, hold + top + hold, 2.0 * (hold + top)].map(|t| begin + t);
        if tick <= end + 0.5 * corner || curve == grid {
            let ramp = |from: f64, to: f64| rounded(tick - from, corner) - rounded(tick - to, corner);
            return ramp(rise, high) - ramp(fall, end);
        }
        begin = end;
    }
    0.0
}

/// The larger of 0 and x, with a change of slope over `corner` about 0.
fn rounded(x: f64, corner: f64) -> f64 {
    let half = 0.5 * corner;
    if x <= -half {
        0.0
    } else if x < half {
        (x + half) * (x + half) / (2.0 * corner)
    } else {
        x
    }
}
