//! The sweep that a leg is driven with, and the response of the gauges to it.

use std::f64::consts::TAU;
use std::ops::Range;

use specgen_compiler::compile::Compilation;
use specgen_numerics::fft::{self, Complex64};

use crate::learning::Bin;

/// Displacement of a leg, m: hysteresis is small, and noise too.
const TRAVEL: f64 = 0.22e-6;
/// Frequencies, Hz; the last one also as a part of the tick rate.
const BAND: [f64; 2] = [8.0, 1600.0];
const FASTEST: f64 = 0.2;
/// Time of the whole record, of the rest before and after the sweep, and of its smooth start and end, s.
const SECONDS: f64 = 1.6;
const REST: [f64; 2] = [0.06, 0.2];
const RAMP: f64 = 0.05;
/// Part of the slew rate that a sweep may take.
const SLEW: f64 = 0.25;
/// Part of the sweep below its highest frequency that is used.
const USED: f64 = 0.95;
/// Lowest frequency used, Hz: above the mains.
const LOWEST: f64 = 65.0;
/// Distance of bins and their width, relative to their frequency.
const SPACING: f64 = 0.008;
const WIDTH: f64 = 0.0025;
/// Band of the noise, over the highest frequency, and as a part of the tick rate.
const NOISE: [f64; 2] = [1.3, 0.45];
/// Least number of ticks of a rest.
const LEAST_REST: usize = 16;
/// Least swing of the drive, V.
const LEAST_SWING: f64 = 1e-3;

/// The sweep of a leg: a sine of rising frequency about an offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// V.
    pub amplitude: f64,
    /// From the voltage at rest to the middle of the sine, V.
    pub offset: f64,
    /// First and last frequency, Hz.
    pub band: [f64; 2],
    /// Duration with the smooth start and end, s.
    pub seconds: f64,
    /// Smooth start, and smooth end, s.
    pub ramp: f64,
    /// Rest in the record before and after it, s.
    pub rest: [f64; 2],
}

/// What was recorded while one leg was driven, tick by tick, with a rest before and after the sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRecord {
    /// Voltage of the leg during each tick, V.
    pub volts: Vec<f64>,
    /// Reading of each gauge at the start of the tick, m.
    pub readings: [Vec<f64>; 6],
}

impl Sweep {
    /// For a machine whose legs have a gain, m/V, and whose recorder holds so many ticks.
    #[must_use]
    pub fn of(compiled: &Compilation, gain: f64, capacity: u32) -> Self {
        let model = &compiled.model;
        let period = model.timing.period;
        let longest = 0.98 * f64::from(capacity) * period;
        let whole = if longest < SECONDS { longest } else { SECONDS };
        let share = whole / SECONDS;
        let fastest = FASTEST / period;
        let band = [BAND[0], if fastest < BAND[1] { fastest } else { BAND[1] }];
        let slew = SLEW * model.actuator.slew_rate / (TAU * band[1]);
        let wanted = TRAVEL / gain.abs();
        let amplitude = if slew < wanted { slew } else { wanted };
        let ([low, high], rest) = (model.actuator.voltage, model.rest_voltage());
        // Away from the nearer limit.
        let upward = if high - rest > rest - low { 1.0 } else { -1.0 };
        let rests = REST.map(|time| share * time);
        Self {
            amplitude,
            offset: upward * 1.5 * amplitude,
            band,
            seconds: whole - rests[0] - rests[1],
            ramp: share * RAMP,
            rest: rests,
        }
    }
}

impl SweepRecord {
    /// The part of a longer record about the sweep; `None` if it does not rest before and after it.
    #[must_use]
    pub fn about(self) -> Option<Self> {
        let (first, last) = self.moves()?;
        let [before, after] = REST.map(|rest| (rest / SECONDS * (last - first) as f64) as usize);
        let part = first.saturating_sub(before)..last + after;
        let rests = first >= LEAST_REST && last + LEAST_REST < self.volts.len();
        let cut = |values: &[f64]| {
            values.get(part.start..).map(|rest| &rest[..rest.len().min(part.len())]).unwrap_or_default().to_vec()
        };
        rests.then(|| Self { volts: cut(&self.volts), readings: self.readings.each_ref().map(|reading| cut(reading)) })
    }

    /// The first and the last tick of the sweep.
    fn moves(&self) -> Option<(usize, usize)> {
        let rest = *self.volts.first()?;
        let moves = |value: &f64| (value - rest).abs() > LEAST_SWING;
        Some((self.volts.iter().position(moves)?, self.volts.iter().rposition(moves)?))
    }
}

/// The response of the gauges (rows, m) to the voltage of each leg (columns, V), with the standard error by the noise.
///
/// # Errors
/// A record has no sweep.
pub(super) fn bins(records: &[SweepRecord; 6], period: f64) -> Result<Vec<Bin>, String> {
    let padded = records.iter().map(|record| record.volts.len()).fold(1, usize::max).next_power_of_two();
    let mut spectra = Vec::with_capacity(6);
    for (leg, record) in records.iter().enumerate() {
        spectra.push(
            Spectra::of(record, padded)
                .ok_or_else(|| format!("the record of leg {leg} shows no sweep between two rests"))?,
        );
    }
    let width = 1.0 / (padded as f64 * period);
    let top = spectra[0].top() as f64 * width * USED;
    let mut bins = Vec::new();
    let mut hertz = LOWEST;
    while hertz < top {
        let half = libm::round(0.5 * WIDTH * hertz / width) as usize;
        let middle = libm::round(hertz / width) as usize;
        let mut bin = Bin { hertz: middle as f64 * width, response: [[[0.0; 2]; 6]; 6], error: [[0.0; 6]; 6] };
        for (leg, own) in spectra.iter().enumerate() {
            let range = middle - half..=middle + half;
            let power = range.clone().map(|k| own.volts[k].norm_sqr()).fold(0.0, |sum, power| sum + power);
            for gauge in 0..6 {
                let readings = &own.readings[gauge];
                let both = range.clone().fold(Complex64::default(), |sum, k| sum + readings[k] * own.volts[k].conj());
                bin.response[gauge][leg] = [both.re / power, both.im / power];
                bin.error[gauge][leg] = libm::sqrt(own.floor[gauge] / power * padded as f64 / own.count);
            }
        }
        bins.push(bin);
        let step = SPACING * hertz;
        hertz += if step > 2.0 * width { step } else { 2.0 * width };
    }
    Ok(bins)
}

/// Spectra of a record, up to half the tick rate.
struct Spectra {
    volts: Vec<Complex64>,
    readings: [Vec<Complex64>; 6],
    /// Mean square of the noise of each reading.
    floor: [f64; 6],
    /// Ticks of the record.
    count: f64,
}

impl Spectra {
    fn of(record: &SweepRecord, padded: usize) -> Option<Self> {
        let volts = &record.volts;
        let (first, last) = record.moves()?;
        let (rest, count) = (volts[0], volts.len());
        // The mean of the noise over a rest is the level there; the platform rings in the first half of the last one.
        let tail = (count - last) / 2;
        if first < LEAST_REST || tail < LEAST_REST {
            return None;
        }
        let shape = |k: usize| {
            let x = if k < first { k as f64 / first as f64 } else { (count - 1 - k) as f64 / tail as f64 };
            if x < 1.0 { 0.5 - 0.5 * libm::cos(0.5 * TAU * x) } else { 1.0 }
        };
        let transform = fft::forward(padded);
        let spectrum = |values: &dyn Fn(usize) -> f64| {
            let mut whole: Vec<Complex64> = (0..count).map(|k| Complex64::new(shape(k) * values(k), 0.0)).collect();
            whole.resize(padded, Complex64::default());
            transform.process(&mut whole);
            whole.truncate(padded / 2);
            whole
        };
        let drive = spectrum(&|k| volts[k] - rest);
        let top = top(&drive);
        let [start, end] = [0.5 * first as f64, count as f64 - 0.5 * tail as f64];
        let readings = record.readings.each_ref().map(|reading| {
            let level = |part: Range<usize>| {
                let values = reading.get(part).unwrap_or_default();
                values.iter().fold(0.0, |sum, x| sum + x) / values.len() as f64
            };
            let (before, after) = (level(0..first), level(count - tail..count));
            let slope = (after - before) / (end - start);
            spectrum(&|k| reading.get(k).map_or(0.0, |x| x - before - slope * (k as f64 - start)))
        });
        let [low, high] = [NOISE[0] * top as f64, NOISE[1] * padded as f64].map(|k| k as usize);
        let floor = readings.each_ref().map(|reading| {
            let quiet = reading.get(low..high).unwrap_or_default();
            quiet.iter().fold(0.0, |sum, x| sum + x.norm_sqr())
                / if quiet.is_empty() { 1.0 } else { quiet.len() as f64 }
        });
        Some(Self { volts: drive, readings, floor, count: count as f64 })
    }

    fn top(&self) -> usize {
        top(&self.volts)
    }
}

/// The highest bin with a tenth of the largest amplitude above the offset's.
fn top(drive: &[Complex64]) -> usize {
    let above = drive.len() / 32;
    let most = drive[above..].iter().fold(0.0, |most: f64, x| if x.norm_sqr() > most { x.norm_sqr() } else { most });
    drive.iter().rposition(|x| x.norm_sqr() > 0.1 * most).unwrap_or_default()
}
