//! How well a table predicts another record of the same actuator.

use serde::Serialize;

use super::branches::branches;
use super::cause::{self, Cause};
use super::distrust::{JUMP, SETTLING};
use super::findings::Findings;
use super::normal;
use super::record::Record;
use super::regressor::{self, Plane};
use super::staircase::Staircase;
use super::statistics::noise_floor;
use super::trace::Trace;
use super::trend::{Line, rms_and_max};
use super::{dead_time, statistics};
use crate::everett::EverettTable;
use specgen_language::diagnostic::{Diagnostic, codes};

/// What the drive did before a record whose start is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// It rose from the lowest drive to the first sample.
    NegativeSaturation,
    /// It fell from the highest drive to the first sample.
    PositiveSaturation,
    /// It swung over the whole range with slowly falling amplitude.
    Demagnetised,
}

impl Start {
    /// The assumption in words, for messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NegativeSaturation => "negative saturation",
            Self::PositiveSaturation => "positive saturation",
            Self::Demagnetised => "demagnetised",
        }
    }
}

/// Result under one assumption about the start. Lengths in m; percentages are of the displacement range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StartResult {
    /// What was assumed of the state before the record.
    pub start: Start,
    /// Root mean square error after removal of one offset and one linear drift.
    pub rms: f64,
    /// Largest magnitude of the error, m.
    pub max: f64,
    /// `rms` in percent of the range of the displacement.
    pub rms_percent: f64,
    /// `max` in percent of the range of the displacement.
    pub max_percent: f64,
}

/// How a table predicts a record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validation {
    /// Name of the record.
    pub record: String,
    /// Samples at the beginning, before the drive first moves, that are not compared.
    pub samples_skipped: usize,
    /// Samples behind a jump of the drive that are not compared: the actuator is still ringing.
    pub samples_after_jumps: usize,
    /// Samples compared.
    pub samples: usize,
    /// Of the compared displacement, m.
    pub displacement_range: f64,
    /// Dead time that was taken over from the identification, s.
    pub dead_time: f64,
    /// The start that fits best. It is one discrete unknown of the record, estimated from it.
    pub best: StartResult,
    /// What the residual under that start consists of.
    pub cause: Cause,
    /// Samples compared and their errors, for drawing.
    #[serde(skip)]
    pub trace: Trace,
    /// Every start that was tried, in the order of [`Start`].
    pub starts: Vec<StartResult>,
}

/// Swings of a demagnetisation.
const SWINGS: u32 = 100;

/// Runs the table forward over `record`, with `dead_time` (s) taken from the identification's report.
///
/// The state at the start is unknown: three histories are tried, all results are given, the best one is named.
/// Samples before the drive first moves are skipped: they say nothing about hysteresis. So are 200 samples from each
/// jump of the drive by more than 10 % of the table's range in one sampling interval.
///
/// # Errors
/// If the drive of the record never moves, or leaves the range of the table by more than 2 %.
pub fn validate(table: &EverettTable, record: &Record, dead_time: f64) -> Result<Validation, Vec<Diagnostic>> {
    let mut findings = Findings::new(&record.shown_as);
    let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
    let (low, high) = statistics::extent(&record.drive);
    let allowed = 0.02 * (plane.range[1] - plane.range[0]);
    if low < plane.range[0] - allowed || high > plane.range[1] + allowed {
        let message = format!(
            "the drive goes from {low} V to {high} V, outside the table's {} V to {} V",
            plane.range[0], plane.range[1]
        );
        findings.add(codes::DRIVE_RANGE, None, message, "validate with a record inside the range of the table");
    }
    let first = branches(&record.drive, 0, 0.5 * plane.interval()).first().map(|b| b.first);
    let Some(first) = first.filter(|_| !findings.any_error()) else {
        if !findings.any_error() {
            findings.add(
                codes::VALIDATION_IDLE,
                None,
                "the drive moves by less than half a grid interval".to_owned(),
                "validate with a record that moves the drive",
            );
        }
        return Err(findings.into_diagnostics());
    };
    let displacement = dead_time::delayed(record, dead_time);
    let jumps = compared(&record.drive, first, JUMP * (plane.range[1] - plane.range[0]));
    let samples_after_jumps = record.time.len() - first - jumps.len();
    let compared: Vec<usize> = jumps.into_iter().filter(|&k| !record.weightless[k]).collect();
    let time: Vec<f64> = compared.iter().map(|&k| record.time[k]).collect();
    let (bottom, top) = statistics::extent(&compared.iter().map(|&k| displacement[k]).collect::<Vec<_>>());
    let range = top - bottom;
    let errors_of = |start: Start| {
        let mut all = Vec::with_capacity(displacement.len() - first);
        let memory = history(start, &plane, record.drive[first]);
        normal::each_row_from(memory, &plane, &record.drive, first, |k, row| {
            all.push(displacement[k] - regressor::evaluate(row, &table.nodes));
        });
        all
    };
    let run = |start: Start| {
        let all = errors_of(start);
        let mut errors: Vec<f64> = compared.iter().map(|&k| all[k - first]).collect();
        let line = Line::fit(&time, &errors);
        for (e, t) in errors.iter_mut().zip(&time) {
            *e -= line.at(*t);
        }
        let (rms, max) = rms_and_max(&errors);
        let percent = 100.0 / range;
        StartResult { start, rms, max, rms_percent: rms * percent, max_percent: max * percent }
    };
    let starts = [Start::NegativeSaturation, Start::PositiveSaturation, Start::Demagnetised].map(run);
    let best = starts.iter().fold(starts[0], |best, s| if s.rms < best.rms { *s } else { best });
    let mut keep = vec![false; record.time.len() - first];
    compared.iter().for_each(|&k| keep[k - first] = true);
    let noise = noise_floor(&record.displacement[first..]);
    let gain = table.node(table.grid, 0) / (plane.range[1] - plane.range[0]);
    let errors = errors_of(best.start);
    let cause = cause::explain(&record.time[first..], &record.drive[first..], &errors, noise, gain, &keep);
    let line = Line::fit(&time, &compared.iter().map(|&k| errors[k - first]).collect::<Vec<_>>());
    let trace = Trace {
        drive: compared.iter().map(|&k| record.drive[k]).collect(),
        measured: compared.iter().map(|&k| displacement[k]).collect(),
        residual: compared.iter().zip(&time).map(|(&k, t)| errors[k - first] - line.at(*t)).collect(),
        time,
    };
    Ok(Validation {
        record: record.shown_as.clone(),
        samples_skipped: first,
        samples_after_jumps,
        samples: compared.len(),
        displacement_range: range,
        dead_time,
        best,
        cause,
        trace,
        starts: starts.to_vec(),
    })
}

/// Samples from `first` on, without those that follow a step of the drive of more than `jump` (V).
fn compared(drive: &[f64], first: usize, jump: f64) -> Vec<usize> {
    let mut settled = first;
    let mut compared = Vec::with_capacity(drive.len() - first);
    for k in first..drive.len() {
        if k > first && (drive[k] - drive[k - 1]).abs() > jump {
            settled = k + SETTLING;
        }
        if k >= settled {
            compared.push(k);
        }
    }
    compared
}

/// Memory after the assumed history, with the drive at `drive` (V).
fn history(start: Start, plane: &Plane, drive: f64) -> Staircase {
    let [low, high] = plane.range;
    let mut memory = Staircase::negative_saturation(plane.range);
    match start {
        Start::NegativeSaturation => {}
        Start::PositiveSaturation => memory.push(high),
        Start::Demagnetised => {
            for k in 0..SWINGS {
                let share = f64::from(k) / f64::from(SWINGS);
                memory.push(high + share * (drive - high));
                memory.push(low + share * (drive - low));
            }
        }
    }
    memory.push(drive);
    memory
}
