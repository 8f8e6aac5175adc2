//! Prepares records for the fits: the usable part, its branches and its rate.

use super::start::RecordColumns;
use crate::branches::Branch;
use crate::findings::Findings;
use crate::mode::Mode;
use crate::record::Record;
use crate::regressor::Plane;
use crate::statistics::{median, median_interval};
use crate::{dead_time, selection};
use specgen_language::diagnostic::codes;

/// Least ratio of the records' rates for an estimate of the rate dependence.
const RATE_RATIO: f64 = 1.2;

/// A record, its usable part and its rate.
pub(super) struct PreparedRecord<'a> {
    pub(super) record: &'a Record,
    /// First sample used.
    pub(super) first: usize,
    pub(super) branches: Vec<Branch>,
    /// Median |u̇| within the branches, V/s.
    pub(super) speed: f64,
    /// Curves (falls) per second, Hz.
    pub(super) frequency: f64,
    /// Median sampling interval, s.
    pub(super) interval: f64,
    /// du/dt by backward difference, as in the controller, V/s; one value for each sample.
    pub(super) slope: Vec<f64>,
}

impl PreparedRecord<'_> {
    pub(super) fn samples(&self) -> usize {
        self.record.time.len() - self.first
    }

    /// Duration of the used part, s.
    pub(super) fn duration(&self) -> f64 {
        self.record.time[self.record.time.len() - 1] - self.record.time[self.first]
    }

    /// The record's own columns for a model with creep of `times` (s) and a mode.
    pub(super) fn own(&self, times: &[f64], mode: Option<Mode>) -> RecordColumns {
        let keep = self.record.weightless[self.first..].iter().map(|w| !w).collect();
        RecordColumns::of(&self.record.time[self.first..], keep, times.iter().copied(), mode)
    }

    /// y(t + `tau`) of the used part, m.
    pub(super) fn delayed(&self, tau: f64) -> Vec<f64> {
        dead_time::delayed(self.record, tau).split_off(self.first)
    }
}

/// du/dt of each sample by backward difference, with the drive limited to `range` (V), V/s; 0 for the first.
pub(super) fn slope(time: &[f64], drive: &[f64], range: [f64; 2]) -> Vec<f64> {
    let held = |u: f64| crate::staircase::saturate(u, range);
    let pairs = drive.windows(2).zip(time.windows(2));
    let slopes = pairs.map(|(u, t)| (held(u[1]) - held(u[0])) / (t[1] - t[0]));
    core::iter::once(0.0).chain(slopes).collect()
}

/// Refuses a record that cannot identify the plane.
pub(super) fn prepare<'a>(record: &'a Record, plane: &Plane, findings: &mut Findings) -> Option<PreparedRecord<'a>> {
    let used = selection::usable(record, plane, findings)?;
    let slope = slope(&record.time, &record.drive, plane.range);
    let mut speeds: Vec<f64> = used.branches.iter().flat_map(|b| &slope[b.first + 1..b.end]).map(|s| s.abs()).collect();
    let mut prepared = PreparedRecord {
        record,
        first: used.first,
        speed: median(&mut speeds),
        frequency: 0.0,
        interval: median_interval(&record.time),
        slope,
        branches: used.branches,
    };
    let falls = prepared.branches.iter().filter(|b| !b.rising).count();
    prepared.frequency = falls as f64 / prepared.duration();
    Some(prepared)
}

/// Refuses records that all have one rate.
pub(super) fn check_rates(prepared: &[PreparedRecord], findings: &mut Findings) {
    let help = "record the same sweep again at a rate at least twice as high or low, and name both records";
    let mut speeds: Vec<f64> = prepared.iter().map(|p| p.speed).collect();
    speeds.sort_unstable_by(f64::total_cmp);
    let (Some(slow), Some(fast)) = (speeds.first(), speeds.last()) else {
        return;
    };
    if prepared.len() < 2 {
        let message = format!("is the only record, at {slow:.1} V/s: rate dependence shows between two rates");
        findings.add(codes::ONE_RATE, None, message, help);
    } else if *fast < RATE_RATIO * slow {
        let message = format!("and the other records all have one rate ({slow:.1} to {fast:.1} V/s, median)");
        findings.add(codes::ONE_RATE, None, message, help);
    }
}
