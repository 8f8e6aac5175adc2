//! Reversal curves at the nodes of their grid, from the means of coarse rows.
//!
//! A serial line carries four rows of a grid step. Between the nodes the leg is curved, and rows about a turn show
//! neither its voltage nor its displacement. The cubic through the means of four rows gives the displacement at a node.
//! A turn has two: a curve ends with the displacement as the drive arrives, and the next one begins with that at the end
//! of the hold. Between them a leg relaxes by up to 200 nm if its hysteresis depends on the rate.

use super::Drive;
use super::wave::Shape;
use crate::least_squares::fit;

/// Time over which the mains are taken for constant, s, and least number of rows in it that show them.
const CONSTANT: f64 = 2.0;
const LEAST: usize = 24;
/// Rows on a straight line depart from it by at most this part of the range.
const STRAIGHT: f64 = 1e-6;
/// Least number of rows of a step.
const ROWS: u32 = 3;

impl Drive {
    /// Time (s), voltage (V) and displacement (m) at the nodes and turns of curves whose steps last whole periods of the
    /// `mains` (Hz), for [`Record::from_columns`](crate::Record::from_columns). `displacement` is the mean of each row of
    /// a record that begins with the tick `first`; it follows the voltage by `delay` (s). None for other drives, and where
    /// rows are missing.
    #[must_use]
    pub fn nodes(&self, first: f64, displacement: &[f64], delay: f64, mains: f64) -> Option<[Vec<f64>; 3]> {
        let Shape::Curves { grid, step, hold, corner } = self.wave.shape else { return None };
        let rows = step / self.average;
        if rows < ROWS || self.average > step || f64::from(self.average) * mains > 0.5 * self.wave.tick_rate {
            return None;
        }
        let volts = self.rows(first, displacement.len(), delay);
        let quiet = self.without_mains(&volts, displacement, mains);
        let interval = (self.range[1] - self.range[0]) / f64::from(grid);
        let voltage = |level: u32| self.range[0] + f64::from(level) * interval;
        let place = |tick: f64| (tick + delay * self.wave.tick_rate - first - 0.5) / f64::from(self.average);
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        let mut add = |tick: f64, level: u32, displacement: Option<f64>| {
            columns[0].push(tick / self.wave.tick_rate);
            columns[1].push(voltage(level));
            columns[2].push(displacement?);
            Some(())
        };
        let arrived = |tick: f64, level: u32| at_arrival(&volts, &quiet, place(tick), voltage(level));
        let left = |tick: f64| at_departure(&quiet, place(tick - 0.5 * f64::from(corner)));
        let [step, hold] = [step, hold].map(f64::from);
        let mut tick = f64::from(self.wave.begin());
        for curve in 1..=grid {
            for (turn, up) in [(0, true), (curve, false)] {
                if turn > 0 || curve > 1 {
                    add(tick, turn, arrived(tick, turn))?;
                }
                tick += hold;
                add(tick, turn, left(tick))?;
                for passed in 1..curve {
                    let tick = tick + f64::from(passed) * step;
                    add(tick, if up { passed } else { curve - passed }, at(&quiet, place(tick)))?;
                }
                tick += f64::from(curve) * step;
            }
        }
        add(tick, 0, arrived(tick, 0))?;
        add(tick + hold, 0, left(tick + hold))?;
        Some(columns)
    }

    /// The rows less the mains, fitted every [`CONSTANT`] seconds to what rows on a straight drive depart from their mean
    /// over a period.
    fn without_mains(&self, volts: &[f64], displacement: &[f64], mains: f64) -> Vec<f64> {
        let seconds = f64::from(self.average) / self.wave.tick_rate;
        let half = (0.5 / (mains * seconds)).round() as usize;
        let departure = |rows: &[f64], row: usize| {
            let own = rows.get(row.checked_sub(half)?..=row + half)?;
            let ends = 0.5 * (own[0] + own[2 * half]);
            let within = own[1..2 * half].iter().fold(ends, |sum, row| sum + row);
            Some(own[half] - within / (2 * half) as f64)
        };
        let most = STRAIGHT * (self.range[1] - self.range[0]);
        let is_straight = |row: &usize| departure(volts, *row).is_some_and(|volts| volts.abs() < most);
        let angle = |row: usize| core::f64::consts::TAU * mains * seconds * row as f64;
        let mut quiet = displacement.to_vec();
        let block = (CONSTANT / seconds) as usize;
        for begin in (0..quiet.len()).step_by(block) {
            let end = if begin + block < quiet.len() { begin + block } else { quiet.len() };
            let straight: Vec<usize> = (begin..end).filter(is_straight).collect();
            if straight.len() < LEAST {
                continue;
            }
            let column = |of: &dyn Fn(usize) -> f64| straight.iter().map(|row| of(*row)).collect::<Vec<f64>>();
            let waves = [column(&|_| 1.0), column(&|row| libm::cos(angle(row))), column(&|row| libm::sin(angle(row)))];
            let departures = column(&|row| departure(displacement, row).unwrap_or(0.0));
            if let Some(found) = fit(&waves.each_ref().map(Vec::as_slice), &departures) {
                for (row, quiet) in quiet[begin..end].iter_mut().enumerate() {
                    let angle = angle(begin + row);
                    *quiet -= found.coefficients[1] * libm::cos(angle) + found.coefficients[2] * libm::sin(angle);
                }
            }
        }
        quiet
    }
}

/// Value at a place, in rows from the first, from the cubic that has the means of the four rows about it.
fn at(rows: &[f64], place: f64) -> Option<f64> {
    let x = place - place.round();
    let begin = place.round() as usize;
    let [a, b, c, d] = *rows.get(begin.checked_sub(2)?..begin + 2)? else { return None };
    let value = (7.0 * (b + c) - a - d) / 12.0;
    let slope = (15.0 * (c - b) + a - d) / 12.0;
    let (bend, change) = (0.5 * (a - b - c + d), d - a + 3.0 * (b - c));
    Some(value + x * (slope + x * (0.5 * bend + x * change / 6.0)))
}

/// Value as the drive arrives at a turn of `volts`: of the two rows about the middle of the corner, each moved to that
/// voltage along the line from the row before them.
fn at_arrival(drive: &[f64], rows: &[f64], place: f64, volts: f64) -> Option<f64> {
    let own = (place - 0.5).floor() as usize;
    let x = place - 0.5 - own as f64;
    let [before, first, second] = *rows.get(own.checked_sub(1)?..own + 2)? else { return None };
    let [from, to, last] = *drive.get(own - 1..own + 2)? else { return None };
    let moved = |drive: f64, row: f64| row + (row - before) * (volts - drive) / (drive - from);
    Some((1.0 - x) * moved(to, first) + x * moved(last, second))
}

/// Value at the end of a hold, from the line through its last three whole rows: a leg has relaxed before them.
fn at_departure(rows: &[f64], place: f64) -> Option<f64> {
    let end = place.floor() as usize;
    let [a, b, c] = *rows.get(end.checked_sub(3)?..end)? else { return None };
    Some((a + b + c) / 3.0 + 0.5 * (c - a) * (place - (end as f64 - 1.5)))
}
