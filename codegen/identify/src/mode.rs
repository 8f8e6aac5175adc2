//! A mode after the model: the second-order resonance of the driven mass, and its estimate from a record.
//!
//! ```text
//! y″ + 2ζω y′ + ω² y = ω² f        f: what the actuator would do without inertia
//! ```
//! Below the mode, y lags f by 2ζ/ω and is larger by (f/f₀)²; near and above it, y is another signal. After a jump of
//! the drive followed by a rest the mode rings freely, and the ring shows frequency and damping without any model of
//! the actuator.

use serde::Serialize;

use crate::least_squares::{fit, mean_square};
use crate::statistics::extent;

/// A second-order mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mode {
    /// ω/2π, Hz, > 0.
    pub frequency: f64,
    /// ζ, within (0, 1).
    pub damping: f64,
}

impl Mode {
    fn angular(self) -> f64 {
        2.0 * core::f64::consts::PI * self.frequency
    }

    /// Response of the mode to `f`, exact for an f that is linear between the samples at `time` (s). It starts at rest.
    #[must_use]
    pub fn behind(self, time: &[f64], f: &[f64]) -> Vec<f64> {
        let omega = self.angular();
        let lag = 2.0 * self.damping / omega;
        let (mut y, mut rate) = (f.first().copied().unwrap_or(0.0), 0.0);
        let mut turn = FreeStep::over(self, 0.0);
        let mut all = Vec::with_capacity(f.len());
        for (k, &value) in f.iter().enumerate() {
            if k > 0 {
                let step = time[k] - time[k - 1];
                if (step - turn.step).abs() > SAME_STEP * step {
                    turn = FreeStep::over(self, step);
                }
                // After a ramp y lags by 2ζ/ω times its slope; the rest rotates and decays.
                let slope = (value - f[k - 1]) / step;
                let (off, speed) = turn.apply(y - f[k - 1] + lag * slope, rate - slope);
                (y, rate) = (value - lag * slope + off, slope + speed);
            }
            all.push(y);
        }
        all
    }

    /// A free ring from `time[0]` on: its two phases, each with amplitude 1 there.
    #[must_use]
    pub(crate) fn ring(self, time: &[f64]) -> [Vec<f64>; 2] {
        let start = time.first().copied().unwrap_or(0.0);
        let omega = self.angular();
        let free = omega * (1.0 - self.damping * self.damping).sqrt();
        let phase = |of: fn(f64) -> f64| {
            time.iter().map(|t| libm::exp(-self.damping * omega * (t - start)) * of(free * (t - start))).collect()
        };
        [phase(libm::cos), phase(libm::sin)]
    }
}

/// Steps whose relative difference is smaller are equal.
const SAME_STEP: f64 = 1e-6;

/// Free motion of a mode over one step: displacement and speed after it as functions of those before it.
struct FreeStep {
    step: f64,
    of: [[f64; 2]; 2],
}

impl FreeStep {
    fn over(mode: Mode, step: f64) -> Self {
        let (omega, zeta) = (mode.angular(), mode.damping);
        let free = omega * (1.0 - zeta * zeta).sqrt();
        let decay = libm::exp(-zeta * omega * step);
        let (sin, cos) = (libm::sin(free * step), libm::cos(free * step));
        let tilt = zeta * omega / free * sin;
        let of =
            [[decay * (cos + tilt), decay * sin / free], [-decay * omega * omega / free * sin, decay * (cos - tilt)]];
        Self { step, of }
    }

    fn apply(&self, off: f64, speed: f64) -> (f64, f64) {
        let [a, b] = self.of;
        (a[0] * off + a[1] * speed, b[0] * off + b[1] * speed)
    }
}

/// A ring of a record while its drive rests.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ring {
    /// What rings, at the amplitude of the part used.
    pub mode: Mode,
    /// Time of the first sample used, s.
    pub time: f64,
    /// Amplitude there, m.
    pub amplitude: f64,
    /// Residual of the displacement, rms, m.
    pub left: f64,
    /// Frequency (Hz) and amplitude (m) at the beginning of the rest, if the part used is a later one: an actuator is
    /// softer at a larger amplitude.
    pub at_first: Option<[f64; 2]>,
}

/// Most samples of a rest that are used, from those after the jump on, and fewest.
const LOOKED_AT: usize = 800;
const FEWEST: usize = 100;
/// Samples skipped after a jump: the amplifier is still slewing, and gauges have filters.
const BEHIND_JUMP: usize = 20;
/// Least number of periods in a rest, and of samples in a period.
const PERIODS: f64 = 5.0;
const SAMPLES_A_PERIOD: f64 = 4.0;
/// Damping ratios tried at each frequency, before both are refined.
const DAMPING: [f64; 4] = [0.004, 0.015, 0.05, 0.15];
const LARGEST_DAMPING: f64 = 0.5;
/// A ring with less damping is hum.
const LEAST_DAMPING: f64 = 1e-3;
/// Least fraction of the motion in the rest that a ring explains, and least ratio to its residual.
const EXPLAINED: f64 = 0.8;
const ABOVE_LEFT: f64 = 5.0;
/// Part of a ring that is used if it is clear, in periods after the beginning of the rest: its amplitude is nearer to
/// that of the mode in service, and the creep of the jump is slower.
const LATE: [f64; 2] = [15.0, 50.0];
/// Largest relative change of the frequency between the two parts.
const SAME_MODE: f64 = 0.1;
/// Number of rests that are tried.
const RESTS: usize = 4;
const REFINED: usize = 40;

/// The clearest ring of a record (s, V, m): in a rest of the drive at its beginning or after a jump. `None` if nothing
/// rings.
#[must_use]
pub fn ring(time: &[f64], drive: &[f64], displacement: &[f64]) -> Option<Ring> {
    let (low, high) = extent(drive);
    let mut rests = rests(drive, 1e-3 * (high - low));
    rests.sort_by_key(|(from, to)| core::cmp::Reverse(to - from));
    rests.truncate(RESTS);
    let clearer = |a: &Ring, b: &Ring| a.amplitude * b.left > b.amplitude * a.left;
    rests
        .into_iter()
        .filter_map(|(from, to)| ring_of_rest(&time[from..to], &displacement[from..to]))
        .reduce(|a, b| if clearer(&b, &a) { b } else { a })
}

/// Stretches over which the drive stays within `tolerance` (V) of its first value there.
fn rests(drive: &[f64], tolerance: f64) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut from = 0;
    while from < drive.len() {
        let long = drive[from..].iter().take_while(|u| (**u - drive[from]).abs() <= tolerance).count();
        if long >= FEWEST + BEHIND_JUMP {
            found.push((from + BEHIND_JUMP, from + long));
        }
        from += long;
    }
    found
}

/// The ring of a rest, of its late part if that is clear.
fn ring_of_rest(time: &[f64], y: &[f64]) -> Option<Ring> {
    let first = ring_of_part(time, y)?;
    let [from, to] = LATE.map(|periods| time.partition_point(|t| *t < time[0] + periods / first.mode.frequency));
    let late = if to - from < FEWEST { None } else { ring_of_part(&time[from..to], &y[from..to]) };
    let same = |late: &Ring| (late.mode.frequency / first.mode.frequency - 1.0).abs() < SAME_MODE;
    let at_first = Some([first.mode.frequency, first.amplitude]);
    Some(late.filter(same).map_or(first, |late| Ring { at_first, ..late }))
}

fn ring_of_part(time: &[f64], y: &[f64]) -> Option<Ring> {
    let count = if time.len() < LOOKED_AT { time.len() } else { LOOKED_AT };
    let (time, y) = (&time[..count], &y[..count]);
    let duration = time[time.len() - 1] - time[0];
    let interval = duration / (time.len() - 1) as f64;
    let slow: Vec<f64> = time.iter().map(|t| libm::exp(-4.0 * (t - time[0]) / duration)).collect();
    let line: Vec<f64> = time.iter().map(|t| (t - time[0]) / duration).collect();
    let one = vec![1.0; time.len()];
    let plain = mean_square(&fit(&[&one, &line, &slow], y)?.residual);
    let left = |mode: Mode| -> Option<(f64, f64)> {
        let [cos, sin] = mode.ring(time);
        let found = fit(&[&cos, &sin, &one, &line, &slow], y)?;
        let amplitude = libm::hypot(found.coefficients[0], found.coefficients[1]);
        Some((mean_square(&found.residual), amplitude))
    };
    // Steps of a quarter of the line's width for such a duration.
    let (lowest, highest) = (PERIODS / duration, 1.0 / (SAMPLES_A_PERIOD * interval));
    let steps = (4.0 * (highest - lowest) * duration) as usize;
    let tried = (0..=steps).flat_map(|k| {
        let frequency = lowest + k as f64 * 0.25 / duration;
        DAMPING.map(|damping| Mode { frequency, damping })
    });
    let mut best: Option<(f64, Mode)> = None;
    for mode in tried {
        if let Some((rest, _)) = left(mode).filter(|(rest, _)| best.is_none_or(|(least, _)| *rest < least)) {
            best = Some((rest, mode));
        }
    }
    let mode = refine(best?.1, 0.125 / duration, |mode| left(mode).map(|found| found.0));
    let (rest, amplitude) = left(mode)?;
    let rings = rest < (1.0 - EXPLAINED) * plain && amplitude > ABOVE_LEFT * rest.sqrt();
    (rings && mode.damping > LEAST_DAMPING).then_some(Ring {
        mode,
        time: time[0],
        amplitude,
        left: rest.sqrt(),
        at_first: None,
    })
}

/// The mode near `mode` with the least `left`: steps in both directions, halved if none helps.
fn refine(mut mode: Mode, step: f64, left: impl Fn(Mode) -> Option<f64>) -> Mode {
    let (mut wide, mut factor) = (step, 1.5);
    let mut least = left(mode).unwrap_or(f64::INFINITY);
    for _ in 0..REFINED {
        let beside = [
            Mode { frequency: mode.frequency + wide, ..mode },
            Mode { frequency: mode.frequency - wide, ..mode },
            Mode { damping: mode.damping * factor, ..mode },
            Mode { damping: mode.damping / factor, ..mode },
        ];
        let mut moved = false;
        for next in beside.into_iter().filter(|next| next.frequency > 0.0 && next.damping < LARGEST_DAMPING) {
            if let Some(rest) = left(next).filter(|rest| *rest < least) {
                (mode, least, moved) = (next, rest, true);
            }
        }
        if !moved {
            (wide, factor) = (0.5 * wide, factor.sqrt());
        }
    }
    mode
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE: Mode = Mode { frequency: 735.0, damping: 0.0147 };

    fn time(n: usize) -> Vec<f64> {
        (0..n).map(|k| k as f64 * 1e-4).collect()
    }

    /// Against the integration of the differential equation in steps of 0.1 µs.
    #[test]
    fn a_mode_follows_its_differential_equation() {
        let time = time(300);
        let f: Vec<f64> = time.iter().map(|t| libm::sin(3000.0 * t) + if *t > 0.01 { 1.0 } else { 0.0 }).collect();
        let found = MODE.behind(&time, &f);
        let omega = MODE.angular();
        let (mut y, mut v) = (f[0], 0.0);
        let fine = 1000;
        for k in 1..300 {
            for part in 0..fine {
                let input = f[k - 1] + (f[k] - f[k - 1]) * (f64::from(part) + 0.5) / f64::from(fine);
                v += 1e-4 / f64::from(fine) * (omega * omega * (input - y) - 2.0 * MODE.damping * omega * v);
                y += 1e-4 / f64::from(fine) * v;
            }
            assert!((y - found[k]).abs() < 2e-3, "{k}: {y} against {}", found[k]);
        }
    }

    #[test]
    fn a_ring_is_found_behind_a_jump_and_none_without_one() {
        let n = 3000;
        let time = time(n);
        let drive: Vec<f64> = (0..n)
            .map(|k| {
                if k < 700 {
                    -40.0
                } else if k < 1500 {
                    50.0
                } else {
                    50.0 - 0.1 * (k - 1500) as f64
                }
            })
            .collect();
        let make = |mode: Option<Mode>| {
            let f: Vec<f64> = drive.iter().map(|u| 5e-8 * u).collect();
            let clean = mode.map_or(f.clone(), |mode| mode.behind(&time, &f));
            let y: Vec<f64> = clean.iter().enumerate().map(|(k, y)| y + 2e-9 * libm::sin(1e4 * k as f64)).collect();
            y
        };
        let found = ring(&time, &drive, &make(Some(MODE))).unwrap();
        assert!((found.mode.frequency - 735.0).abs() < 0.2, "{found:?}");
        assert!((found.mode.damping / 0.0147 - 1.0).abs() < 0.02, "{found:?}");
        assert!(ring(&time, &drive, &make(None)).is_none());
    }
}
