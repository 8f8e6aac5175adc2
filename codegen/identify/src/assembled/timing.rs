//! Times of reversal curves, in ticks.

use super::{Bench, SLEW};

/// Shortest row of a record, s: a serial line carries rows of 45 ticks at 10 kHz.
const ROW: f64 = 4.6e-3;
/// Largest part of the mains that may be left in the mean of a step.
const HUM: f64 = 0.01;
/// Periods of the mains in which that is sought.
const PERIODS: u32 = 64;
/// A step of so many periods has rows of one period.
const LONG: f64 = 4.0;
/// Periods of the slowest mode over which the slope changes: 5 ms of 361 Hz, which then rings by 2.6 nm at 156 V/s.
const CORNER: f64 = 1.8;

/// Whole rows of a hold: a leg relaxes in the first ones, the last three show its line until the next curve.
const HELD: u32 = 6;

/// Times of reversal curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timing {
    /// Ticks of a row of the record.
    pub row: u32,
    /// Ticks of a grid step, whole rows.
    pub step: u32,
    /// Ticks for which a turn is held: [`HELD`] whole rows between the corners, wherever rows begin.
    pub hold: u32,
    /// Ticks over which the slope changes.
    pub corner: u32,
    tick_rate: f64,
}

impl Timing {
    /// For grid steps of `interval` (V) that last about `seconds`, or a period of the mains.
    pub(super) fn of(bench: &Bench, interval: f64, seconds: Option<f64>) -> Self {
        let period = 1.0 / bench.mains;
        let least = interval / (SLEW * bench.slew_rate);
        let seconds = seconds.unwrap_or(period);
        let seconds = if seconds > least { seconds } else { least };
        let periods = seconds * bench.mains;
        let (row, step) = if periods < 0.75 {
            fast(bench, seconds)
        } else if periods >= LONG {
            let row = mains_row(bench);
            (row, row * (seconds * bench.tick_rate / f64::from(row)).ceil() as u32)
        } else {
            whole_periods(bench, periods)
        };
        let corner = (CORNER / bench.slowest_mode * bench.tick_rate) as u32;
        let corner = if corner < step { corner } else { step };
        let hold = row * (corner + HELD * row).div_ceil(row);
        Self { row, step, hold, corner, tick_rate: bench.tick_rate }
    }

    /// Rate of steps of `interval` (V), V/s.
    pub(super) fn rate(&self, interval: f64) -> f64 {
        interval * self.tick_rate / f64::from(self.step)
    }
}

/// Fewer than a period of the mains: as many rows as the link carries.
fn fast(bench: &Bench, seconds: f64) -> (u32, u32) {
    let ticks = seconds * bench.tick_rate;
    let least = (ROW * bench.tick_rate).ceil();
    let rows = (ticks / least).floor();
    let rows = if rows > 1.0 { rows } else { 1.0 };
    let row = (ticks / rows).ceil();
    let row = if row > least { row } else { least };
    (row as u32, (rows * row) as u32)
}

/// Ticks of a row and of a step of at least so many whole periods of the mains, with as many rows as the link carries.
fn whole_periods(bench: &Bench, periods: f64) -> (u32, u32) {
    let first = (periods - 0.25).ceil() as u32;
    let ticks_of = |count: u32| f64::from(count) * bench.tick_rate / bench.mains;
    for count in first..first + PERIODS {
        let most = (ticks_of(count) / (ROW * bench.tick_rate)).floor() as u32;
        for rows in (1..=most).rev() {
            let row = (ticks_of(count) / f64::from(rows)).round() as u32;
            if hum(bench, rows * row) <= HUM {
                return (row, rows * row);
            }
        }
    }
    let row = mains_row(bench);
    (row, row * first)
}

/// Ticks of the shortest row of which several last a period of the mains.
pub(super) fn short_row(bench: &Bench) -> u32 {
    whole_periods(bench, 1.0).0
}

/// Ticks of a row that lasts whole periods of the mains.
pub(super) fn mains_row(bench: &Bench) -> u32 {
    let ticks = |count: u32| (f64::from(count) * bench.tick_rate / bench.mains).round() as u32;
    let good = |row: &u32| f64::from(*row) >= ROW * bench.tick_rate && hum(bench, *row) <= HUM;
    let row = (1..=PERIODS).map(ticks).find(good).unwrap_or_else(|| ticks(PERIODS));
    if row > 0 { row } else { 1 }
}

/// Part of the mains that is left in a mean over so many ticks.
pub(super) fn hum(bench: &Bench, ticks: u32) -> f64 {
    let angle = core::f64::consts::PI * bench.mains * f64::from(ticks) / bench.tick_rate;
    (libm::sin(angle) / angle).abs()
}
