//! Reads a measured record: a text file with the columns `time_s`, `drive_V`, `displacement_um`, or under other names.
//!
//! One run reports every problem of the file. [`super::coverage`] later checks the drive range.

use std::ops::Range;
use std::path::Path;

use super::columns::{LineNumbers, RECORD};
use super::distrust;
use super::file::{Source, open_file};
use super::findings::Findings;
use super::reading::Reading;
use super::signals::{self, ColumnSpec, MONITOR, Signals, optional, required};
use super::{sanity, statistics};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Header names of time, drive and displacement.
const NAMES: [&str; 3] = ["time_s", "drive_V", "displacement_um"];

/// A measured record in SI units, checked sample by sample.
///
/// The three columns have equal length, at least 100; every value is finite;
/// time increases strictly and has no gaps, but between joined records.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Name of the file as the user gave it.
    pub shown_as: String,
    /// Time, s.
    pub time: Vec<f64>,
    /// Drive, V.
    pub drive: Vec<f64>,
    /// Whether the drive is the measured voltage (column `monitor_V`), not the command that a converter holds.
    pub monitored: bool,
    /// Displacement, m.
    pub displacement: Vec<f64>,
    /// Samples without weight in fits: glitches, which are replaced, and those after a jump of the drive.
    pub weightless: Vec<bool>,
    /// Whether a comment in the file marks it as simulated.
    pub simulated: bool,
    /// First sample of each further record that was joined to this one; empty for a single record.
    pub parts: Vec<usize>,
    /// Findings that refuse nothing.
    pub warnings: Vec<Diagnostic>,
}

impl Record {
    /// A record from columns in memory (s, V, m), under the same checks as a file.
    ///
    /// # Errors
    /// The same findings as [`read_record`]; line k + 2 is that of sample k.
    pub fn from_columns(
        shown_as: &str,
        time: Vec<f64>,
        drive: Vec<f64>,
        displacement: Vec<f64>,
    ) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Findings::new(shown_as);
        let n = time.len();
        if drive.len() != n || displacement.len() != n {
            let message = format!("columns of {n}, {} and {} samples", drive.len(), displacement.len());
            findings.add(codes::RECORD_LENGTHS, None, message, "give columns of equal length");
            return Err(findings.into_diagnostics());
        }
        for (column, name) in [&time, &drive, &displacement].into_iter().zip(NAMES) {
            for (k, x) in column.iter().enumerate().filter(|(_, x)| !x.is_finite()) {
                RECORD.report_not_finite(k + 2, name, &x.to_string(), &mut findings);
            }
        }
        let lines = LineNumbers::consecutive(2, n);
        finish(findings, shown_as, &lines, [time, drive, displacement])
    }

    /// Half the interval for which a converter holds each sample of the drive, s: the mean lag of the voltage behind a
    /// command. 0 if the drive is the measured voltage, or is sampled more slowly than at 1 kHz.
    #[must_use]
    pub fn held(&self) -> f64 {
        let longest = |most: f64, span: Range<usize>| {
            let half = hold(&self.time[span]);
            if half > most { half } else { most }
        };
        if self.monitored { 0.0 } else { self.spans().fold(0.0, longest) }
    }

    /// Some of the samples of a single record.
    pub(crate) fn part(&self, span: Range<usize>) -> Self {
        let of = |column: &[f64]| column[span.clone()].to_vec();
        let (time, drive, displacement) = (of(&self.time), of(&self.drive), of(&self.displacement));
        let (weightless, parts) = (self.weightless[span].to_vec(), Vec::new());
        let (shown_as, warnings) = (self.shown_as.clone(), self.warnings.clone());
        Self { shown_as, time, drive, displacement, weightless, parts, warnings, ..*self }
    }

    /// The samples of each record that this one was joined from, in order.
    pub(crate) fn spans(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let firsts = [0].into_iter().chain(self.parts.iter().copied());
        let ends = self.parts.iter().copied().chain([self.time.len()]);
        firsts.zip(ends).map(|(first, end)| first..end)
    }

    /// Difference of the largest and the smallest displacement, m.
    #[must_use]
    pub fn displacement_range(&self) -> f64 {
        let (low, high) = statistics::extent(&self.displacement);
        high - low
    }
}

/// Reads a record. `shown_as` is its name in messages, `reading` the user's description of its columns.
///
/// # Errors
/// All findings of the file, including warnings, if at least one refuses it.
pub fn read_record(path: &Path, shown_as: &str, reading: &Reading) -> Result<Record, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    match open_file(path, reading, &mut findings) {
        Some(file) => of_source(file, reading, findings),
        None => Err(findings.into_diagnostics()),
    }
}

/// A record from the bytes of its file, of any kind.
///
/// # Errors
/// As [`read_record`].
pub fn decode_record(file: Vec<u8>, shown_as: &str, reading: &Reading) -> Result<Record, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    match Source::of_bytes(file, reading, &mut findings) {
        Some(source) => of_source(source, reading, findings),
        None => Err(findings.into_diagnostics()),
    }
}

/// A record from the text of its file.
///
/// # Errors
/// As [`read_record`].
pub fn parse_record(text: &str, shown_as: &str) -> Result<Record, Vec<Diagnostic>> {
    parse_record_as(text, shown_as, &Reading::default())
}

/// The same with a description of its columns.
pub(crate) fn parse_record_as(text: &str, shown_as: &str, reading: &Reading) -> Result<Record, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    match Source::of_text(text.as_bytes(), None, &mut findings) {
        Some(text) => of_source(text, reading, findings),
        None => Err(findings.into_diagnostics()),
    }
}

/// Columns of a record; the displacement is optional in a record for prediction.
pub(crate) const fn wanted(displacement: bool) -> [ColumnSpec; 4] {
    let [time, drive, moved] = NAMES;
    let moved = ColumnSpec { required: displacement, ..required(moved) };
    [required(time), required(drive), optional(MONITOR), moved]
}

/// Time (s), drive (V), whether that was measured, and displacement (m) of signals with the [`wanted`] columns.
pub(crate) fn quantities(signals: &mut Signals) -> (Vec<f64>, Vec<f64>, bool, Option<Vec<f64>>) {
    let mut take = |k: usize| signals.columns[k].take();
    let (time, command, monitor, micrometres) = (take(0), take(1), take(2), take(3));
    let monitored = command.is_none();
    let displacement = micrometres.map(|um| um.iter().map(|y| y * 1e-6).collect());
    (time.unwrap_or_default(), command.or(monitor).unwrap_or_default(), monitored, displacement)
}

fn of_source(source: Source, reading: &Reading, mut findings: Findings) -> Result<Record, Vec<Diagnostic>> {
    let Some(mut signals) = signals::columns_of(source, &wanted(true), reading, &mut findings) else {
        return Err(findings.into_diagnostics());
    };
    let (time, drive, monitored, displacement) = quantities(&mut signals);
    let columns = [time, drive, displacement.unwrap_or_default()];
    let record = finish(findings, &signals.shown_as, &signals.lines, columns)?;
    Ok(Record { monitored, simulated: signals.simulated, ..record })
}

/// Longest plausible hold of a converter, s: a record sampled more slowly does not contain every command.
const LONGEST_HOLD: f64 = 1e-3;

/// Half of the median sampling interval, s; 0 if that is too long for a converter.
pub(crate) fn hold(time: &[f64]) -> f64 {
    let interval = statistics::median_interval(time);
    if interval > LONGEST_HOLD { 0.0 } else { 0.5 * interval }
}

fn finish(
    mut findings: Findings,
    shown_as: &str,
    lines: &LineNumbers,
    columns: [Vec<f64>; 3],
) -> Result<Record, Vec<Diagnostic>> {
    // An unreadable value would only cause further findings.
    if !findings.any_error() {
        sanity::check(lines, &columns, &mut findings);
    }
    if findings.any_error() {
        return Err(findings.into_diagnostics());
    }
    let [time, drive, mut displacement] = columns;
    let weightless = distrust::weightless(lines, &time, &drive, &mut displacement, &mut findings);
    let warnings = findings.into_diagnostics();
    let shown_as = shown_as.to_owned();
    let parts = Vec::new();
    Ok(Record { shown_as, time, drive, monitored: false, displacement, weightless, simulated: false, parts, warnings })
}

/// `values` at each `time` − `delay` (s), interpolated; the first value before the beginning.
pub(crate) fn later(time: &[f64], values: &[f64], delay: f64) -> Vec<f64> {
    let mut next = 0;
    let at = |wanted: f64| {
        while next < time.len() && time[next] <= wanted {
            next += 1;
        }
        match next.checked_sub(1) {
            None => values[0],
            Some(before) if next < time.len() => {
                let share = (wanted - time[before]) / (time[next] - time[before]);
                values[before] + share * (values[next] - values[before])
            }
            Some(before) => values[before],
        }
    };
    time.iter().map(|t| t - delay).map(at).collect()
}

#[cfg(test)]
#[path = "record/tests/files.rs"]
mod files;
#[cfg(test)]
#[path = "record/tests/hostile.rs"]
mod hostile;
#[cfg(test)]
#[path = "record/tests/labs.rs"]
mod labs;
#[cfg(test)]
#[path = "record/tests/mat_file.rs"]
mod mat_file;
#[cfg(test)]
#[path = "record/tests/misread.rs"]
mod misread;
