//! A band-limited random drive: a record on which leg models are compared that were fitted to reversal curves.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{ReversalRecord, ReversalRow};
use crate::noise::{Gauge, unit};
use crate::plant::LegPlant;

/// Lines of the spectrum, all of one amplitude, evenly spaced in the logarithm of their frequency.
const LINES: u32 = 48;
/// Lowest and highest frequency, Hz.
const BAND: [f64; 2] = [0.1, 20.0];
/// Time in which the drive leaves its rest, and returns to it, s.
const FADE: f64 = 0.5;
/// Longest time a drive value is held, s.
const UPDATE: f64 = 5e-5;

/// A random drive of 0.1 to 20 Hz that begins and ends at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomDrive {
    /// Drive before and after, V.
    pub rest: f64,
    /// Lowest and highest drive of the random part, V.
    pub range: [f64; 2],
    /// Length, s.
    pub duration: f64,
    /// Rate of the rows, Hz.
    pub sampling: f64,
    /// Of the phases.
    pub seed: u64,
}

impl RandomDrive {
    /// Ten seconds over the middle nine tenths of `range` (V), from its lower end.
    #[must_use]
    pub fn over([low, high]: [f64; 2], sampling: f64) -> Self {
        let margin = 0.05 * (high - low);
        Self { rest: low, range: [low + margin, high - margin], duration: 10.0, sampling, seed: 1 }
    }

    /// The drive of every row, V.
    pub fn drive(&self) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let spacing = libm::log(BAND[1] / BAND[0]) / f64::from(LINES - 1);
        let line = |k: u32| (BAND[0] * libm::exp(f64::from(k) * spacing), unit(&mut random));
        let lines: Vec<(f64, f64)> = (0..LINES).map(line).collect();
        let rows = (self.duration * self.sampling).round() as u32;
        let time = |row: u32| f64::from(row) / self.sampling;
        let wave = |t: f64| {
            lines.iter().fold(0.0, |sum, (hz, phase)| sum + libm::sin(core::f64::consts::TAU * (hz * t + phase)))
        };
        let waves: Vec<f64> = (0..=rows).map(|row| wave(time(row))).collect();
        let (low, high) = waves.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), w| {
            (if *w < low { *w } else { low }, if *w > high { *w } else { high })
        });
        let faded = |row: u32| {
            let end = time(rows) - time(row);
            let near = if end < time(row) { end } else { time(row) };
            if near < FADE { 0.5 - 0.5 * libm::cos(core::f64::consts::PI * near / FADE) } else { 1.0 }
        };
        let [bottom, top] = self.range;
        let value = |(row, w): (u32, &f64)| {
            self.rest + faded(row) * (bottom + (w - low) / (high - low) * (top - bottom) - self.rest)
        };
        (0..=rows).zip(&waves).map(value).collect()
    }

    /// Runs on `leg`, which must be at rest. The first row is that state at time 0.
    pub fn run(&self, leg: &mut LegPlant, gauge: &mut Gauge) -> ReversalRecord {
        let drive = self.drive();
        let interval = 1.0 / self.sampling;
        let mut before = self.rest;
        let row = |(k, u): (usize, &f64)| {
            let displacement = if k == 0 { leg.displacement() } else { leg.ramp(before, *u, interval, UPDATE) };
            before = *u;
            ReversalRow { time: k as f64 * interval, drive: *u, displacement: gauge.read(displacement) }
        };
        ReversalRecord { rows: drive.iter().enumerate().map(row).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drive_begins_and_ends_at_rest_and_uses_its_range() {
        let random = RandomDrive::over([-90.0, 90.0], 1000.0);
        let drive = random.drive();
        assert_eq!((drive.len(), drive[0], drive[10_000]), (10_001, -90.0, -90.0));
        let inner = &drive[500..9501];
        let (low, high) = inner.iter().fold((0.0, 0.0), |(low, high): (f64, f64), u| (low.min(*u), high.max(*u)));
        assert!(low >= -81.0 - 1e-9 && high <= 81.0 + 1e-9 && high - low > 120.0, "{low} {high}");
        let other = RandomDrive { seed: 2, ..random }.drive();
        assert_ne!(other, drive);
        assert_eq!(random.drive(), drive);
    }
}
