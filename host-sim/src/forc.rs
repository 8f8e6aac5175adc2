//! The reversal-curve experiment: input data for identification.
//!
//! From 0 V, for k = 1..=N: a ramp up to k·u_max/N and back to 0, all at one speed and without a pause. N = 32 at 20
//! V/s takes 165 s, N = 16 takes 85 s.

mod random;

use std::fmt::Write;

use crate::noise::Gauge;
use crate::plant::{LegPlant, steps_within};

pub use random::RandomDrive;

/// The comment that marks a record as simulated. `specgen_identify::SIMULATED` is equal; a test compares them.
pub const SIMULATED: &str = "# simulated by specgen: no leg was measured";

/// Drive and sampling of the curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReversalExperiment {
    /// N: peaks at u_max/N, 2 u_max/N, ..., u_max.
    pub intervals: u32,
    /// u_max, V.
    pub drive_max: f64,
    /// Slope, V/s.
    pub rate: f64,
    /// Rows per interval u_max/N (at least 1): every peak and every grid node is a row exactly.
    pub rows_per_interval: u32,
    /// Longest time a drive value is held while ramping, s.
    pub update: f64,
}

impl ReversalExperiment {
    /// N curves to 100 V at 20 V/s, 0.39 V and 19.5 ms between rows for N = 32.
    pub fn reference(intervals: u32) -> Self {
        Self { intervals, drive_max: 100.0, rate: 20.0, rows_per_interval: 8, update: 5e-5 }
    }

    /// Length in s.
    pub fn duration(&self) -> f64 {
        let n = f64::from(self.intervals);
        self.drive_max * (n + 1.0) / self.rate
    }

    /// The same with `sampling` (Hz) rows a second: the slope changes by less than half a row of an interval.
    #[must_use]
    pub fn sampled(self, sampling: f64) -> Self {
        let interval = self.drive_max / f64::from(self.intervals);
        let rows = (sampling * interval / self.rate).round().clamp(1.0, 1e7);
        Self { rows_per_interval: rows as u32, rate: sampling * interval / rows, ..self }
    }

    /// The drive of every row, V, above `lowest`. Before the curves it goes there from 0 V at the same slope, and rests
    /// for `rest` (s).
    pub fn drive(&self, lowest: f64, rest: f64) -> Vec<f64> {
        let levels = self.intervals * self.rows_per_interval;
        let mut drive = self.lead_in(lowest, rest);
        for curve in 1..=self.intervals {
            let peak = curve * self.rows_per_interval;
            let at = |level: u32| lowest + f64::from(level) * self.drive_max / f64::from(levels);
            drive.extend((1..=peak).chain((0..peak).rev()).map(at));
        }
        drive
    }

    /// The drive before the curves: from 0 V to `lowest` (V) and `rest` (s) there, at least one row.
    pub fn lead_in(&self, lowest: f64, rest: f64) -> Vec<f64> {
        let step = self.drive_max / f64::from(self.intervals * self.rows_per_interval);
        let approach = (lowest.abs() / step).ceil();
        let resting = (rest * self.rate / step).ceil();
        let mut drive: Vec<f64> = (0..approach as u32).map(|k| lowest * f64::from(k) / approach).collect();
        drive.extend(std::iter::repeat_n(lowest, resting as usize + 1));
        drive
    }

    /// Runs on `leg` from its present state, which must be at 0 V. The first row is that state at time 0.
    ///
    /// The reference figures are for a leg as built: a saturating pre-cycle before the curves leaves creep in them and
    /// raises the Invhys error at 0.1 Hz from 127 to 138 nm.
    pub fn run(&self, leg: &mut LegPlant, gauge: &mut Gauge) -> ReversalRecord {
        let rows = self.rows_per_interval.max(1);
        let levels = f64::from(self.intervals) * f64::from(rows);
        // A single division, so that a grid node has the same bits for any number of rows between.
        let drive_at = |level: u32| f64::from(level) * self.drive_max / levels;
        let row_time = self.drive_max / levels / self.rate;
        let updates = steps_within(row_time, self.update);
        let update = row_time / f64::from(updates);

        let mut record = ReversalRecord {
            rows: vec![ReversalRow { time: 0.0, drive: 0.0, displacement: gauge.read(leg.displacement()) }],
        };
        let mut elapsed = 0_u32;
        for curve in 1..=self.intervals {
            let peak = curve * rows;
            let path =
                (1..=peak).map(|level| (level - 1, level)).chain((0..peak).rev().map(|level| (level + 1, level)));
            for (from, to) in path {
                let (start, end) = (drive_at(from), drive_at(to));
                let displacement = leg.ramp(start, end, row_time, update);
                elapsed += 1;
                record.rows.push(ReversalRow {
                    time: f64::from(elapsed) * row_time,
                    drive: end,
                    displacement: gauge.read(displacement),
                });
            }
        }
        record
    }
}

/// One sample of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReversalRow {
    /// s from the start.
    pub time: f64,
    /// V.
    pub drive: f64,
    /// m.
    pub displacement: f64,
}

/// A measured set of reversal curves.
#[derive(Debug, Clone, PartialEq)]
pub struct ReversalRecord {
    /// In order of time.
    pub rows: Vec<ReversalRow>,
}

impl ReversalRecord {
    /// CSV with the columns `time_s,drive_V,displacement_um`, and a comment below their names that marks it as
    /// simulated. Resolutions are 1e-8 s, 1e-5 V and 1e-5 µm, a tenth of the smallest noise here; grid nodes of N = 32
    /// over 100 V are exact.
    pub fn to_csv(&self) -> String {
        let mut out = format!("time_s,drive_V,displacement_um\n{SIMULATED}\n");
        for row in &self.rows {
            let (time, drive) = (trimmed(row.time, 8), trimmed(row.drive, 6));
            // Writing to a String cannot fail.
            let _ = writeln!(out, "{time},{drive},{}", trimmed(row.displacement * 1e6, 5));
        }
        out
    }
}

/// Decimal with at most `digits` after the point and no trailing zeros; −0 becomes 0.
pub fn trimmed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{LegParameters, NoiseParameters};

    fn record(experiment: &ReversalExperiment, noise: &NoiseParameters) -> ReversalRecord {
        let mut leg = LegPlant::new(&LegParameters::reference());
        experiment.run(&mut leg, &mut Gauge::new(noise, 1, 0))
    }

    #[test]
    fn thirty_two_curves_take_165_s_and_sixteen_85_s() {
        assert_eq!(ReversalExperiment::reference(32).duration(), 165.0);
        assert_eq!(ReversalExperiment::reference(16).duration(), 85.0);
        let short = ReversalExperiment { rate: 2000.0, ..ReversalExperiment::reference(16) };
        let record = record(&short, &NoiseParameters::NONE);
        assert!((record.rows.last().unwrap().time - short.duration()).abs() < 1e-12);
        assert_eq!(record.rows.len(), 1 + 8 * 16 * 17);
    }

    #[test]
    fn peaks_and_nodes_are_rows_exactly_and_rise_and_fall_meet_them() {
        // Three rows per interval: a third of 3.125 V is not a binary fraction.
        let fast = ReversalExperiment { rate: 2000.0, rows_per_interval: 3, ..ReversalExperiment::reference(32) };
        let record = record(&fast, &NoiseParameters::NONE);
        let peaks: Vec<f64> = record
            .rows
            .windows(3)
            .filter(|w| w[1].drive > w[0].drive && w[1].drive > w[2].drive)
            .map(|w| w[1].drive)
            .collect();
        assert_eq!(peaks, (1..=32).map(|k| f64::from(k) * 3.125).collect::<Vec<_>>());
        let node = |k: u32| record.rows.iter().filter(|row| row.drive == f64::from(k) * 3.125).count();
        assert_eq!(node(32), 1);
        assert_eq!(node(31), 3);
        assert_eq!(node(1), 63);
    }

    #[test]
    fn the_drive_alone_goes_to_the_lowest_voltage_and_then_along_the_curves() {
        let experiment = ReversalExperiment { drive_max: 180.0, ..ReversalExperiment::reference(8) }.sampled(1000.0);
        let drive = experiment.drive(-90.0, 1.0);
        assert!((experiment.rate / 20.0 - 1.0).abs() < 1e-3);
        let steepest = drive.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(steepest <= experiment.rate / 1000.0 * (1.0 + 1e-9), "{steepest}");
        assert_eq!(drive.iter().filter(|u| **u == 90.0).count(), 1);
        assert!((drive[0], drive.last()) == (0.0, Some(&-90.0)) && drive.iter().all(|u| (-90.0..=90.0).contains(u)));
        let rest = drive.windows(2).filter(|w| w == &[-90.0, -90.0]).count();
        assert_eq!(rest, 1000);
    }

    #[test]
    fn the_csv_is_small_and_reads_back_to_a_hundredth_of_a_nanometre() {
        let fast = ReversalExperiment { rate: 2000.0, ..ReversalExperiment::reference(32) };
        let record = record(&fast, &LegParameters::reference().noise);
        let csv = record.to_csv();
        assert!(csv.len() < 300_000, "{}", csv.len());
        let mut lines = csv.lines();
        assert_eq!(lines.next(), Some("time_s,drive_V,displacement_um"));
        assert_eq!(lines.next(), Some(SIMULATED));
        for (line, row) in lines.zip(&record.rows) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            assert!((cells[0] - row.time).abs() < 1e-8);
            assert_eq!(cells[1], row.drive);
            assert!((cells[2] * 1e-6 - row.displacement).abs() <= 0.5001e-11);
        }
    }

    #[test]
    fn numbers_have_no_idle_zeros() {
        assert_eq!(trimmed(3.125, 6), "3.125");
        assert_eq!(trimmed(-0.000_000_1, 5), "0");
        assert_eq!(trimmed(100.0, 6), "100");
        assert_eq!(trimmed(100.0, 0), "100");
    }
}
