//! Reads records of other kinds than reversal curves: named columns, some of which are optional.

mod places;

use std::path::Path;

pub(crate) use super::columns::TIME;
use super::columns::{Column, Format, Head, LineNumbers, RECORD, Reader, Samples, names};
use super::file::{Source, open_file};
use super::findings::Findings;
use super::reading::Reading;
use super::sanity;
use super::statistics::{self, Standstill, standstills};
use super::stretches;
use specgen_language::diagnostic::{Diagnostic, codes};

/// A column that a record may have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColumnSpec {
    /// Name with unit, such as `force_N`.
    pub(crate) name: &'static str,
    /// Whether the record is refused without it.
    pub(crate) required: bool,
    /// Number of the quantity's units in one of the values: 1, or 10⁶ µm in a metre.
    pub(crate) per: f64,
}

pub(crate) const fn required(name: &'static str) -> ColumnSpec {
    ColumnSpec { name, required: true, per: 1.0 }
}

pub(crate) const fn optional(name: &'static str) -> ColumnSpec {
    ColumnSpec { name, required: false, per: 1.0 }
}

/// Columns of equal length, in the requested order, in the units of their names.
#[derive(Debug, Clone)]
pub(crate) struct Signals {
    /// Name of the file as the user gave it.
    pub(crate) shown_as: String,
    /// Line of each sample.
    pub(crate) lines: LineNumbers,
    /// Values; none for a column that the file does not have.
    pub(crate) columns: Vec<Option<Vec<f64>>>,
    /// Whether a comment marks the file as simulated.
    pub(crate) simulated: bool,
    /// Findings that refuse nothing.
    pub(crate) warnings: Vec<Diagnostic>,
}

pub(crate) use places::MONITOR;

/// Least number of samples of a record.
const MIN_SAMPLES: usize = 8;

/// Where a record is read from.
#[derive(Debug, Clone, Copy)]
pub enum Input<'a> {
    /// A file, and how to read it.
    File(&'a Path, &'a Reading),
    /// The text of a file with standard names.
    Text(&'a str),
}

/// Reads the `wanted` columns. Time, if requested, is the first one; it must rise.
pub(crate) fn read(input: Input, shown_as: &str, wanted: &[ColumnSpec]) -> Result<Signals, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let signals = match input {
        Input::File(path, reading) => {
            open_file(path, reading, &mut findings).and_then(|file| checked(file, wanted, reading, &mut findings))
        }
        Input::Text(text) => Source::of_text(text.as_bytes(), None, &mut findings)
            .and_then(|text| checked(text, wanted, &Reading::default(), &mut findings)),
    };
    findings.conclude(signals).map(|(signals, warnings)| Signals { warnings, ..signals })
}

fn checked(source: Source, wanted: &[ColumnSpec], reading: &Reading, findings: &mut Findings) -> Option<Signals> {
    let signals = columns_of(source, wanted, reading, findings)?;
    let lines = &signals.lines;
    if lines.len() < MIN_SAMPLES {
        let message = format!("has {} samples; at least {MIN_SAMPLES} are needed", lines.len());
        findings.add(codes::RECORD_TOO_SHORT, None, message, "record more samples");
    } else if let (Some(Some(time)), TIME, false) = (signals.columns.first(), wanted[0].name, findings.any_error()) {
        sanity::check_time(lines, time, findings);
    }
    Some(signals)
}

/// The `wanted` columns without any check of their values; `None` after every problem of the header was reported.
pub(crate) fn columns_of(
    Source { content, choice }: Source,
    wanted: &[ColumnSpec],
    reading: &Reading,
    findings: &mut Findings,
) -> Option<Signals> {
    let ([curves, sweeps], rows) = (content.curves(), content.rows());
    let (header, read) = content.open(&RECORD, findings)?;
    let curves = if reading.rate().is_none() && sweeps > curves { sweeps } else { curves };
    if wanted[0].name == TIME && wanted[0].required && curves >= CURVES && !has_time(&header, reading) {
        let message = format!(
            "has {curves} curves, each in one direction and without times, as magnetometers record FORC: the way back to each reversal was not recorded, so the drive between the curves is not known"
        );
        let help = "record time, drive and displacement without a break, on the ways back as well";
        return findings.refuse(codes::RECORD_GAP, None, message, help);
    }
    let has_names = header.names.iter().any(|name| names::is_known(name))
        || !header.names.is_empty() && reading.chosen().next().is_some();
    if header.filled.len() > COLUMNS && rows > 0 && rows < header.filled.len() && !has_names {
        let message = format!("has {rows} lines of {} numbers: rows and columns are exchanged", header.filled.len());
        return findings.refuse(
            codes::RECORD_HEADER,
            None,
            message,
            "write a line for each sample, not for each column",
        );
    }
    let mut signals = assigned(&header, read, wanted, (reading, &RECORD), findings)?;
    if let (TIME, Some(Some(time)), false) = (wanted[0].name, signals.columns.first(), findings.any_error())
        && let Some(stretch) = stretches::chosen(time, choice, findings)
    {
        signals.lines = signals.lines.part(stretch.clone());
        signals.columns.iter_mut().flatten().for_each(|column| *column = column[stretch.clone()].to_vec());
    }
    Some(signals)
}

/// The `wanted` columns below a header, as the user describes them, in a file of this kind.
pub(crate) fn assigned(
    header: &Head,
    read: Reader,
    wanted: &[ColumnSpec],
    (reading, format): (&Reading, &Format),
    findings: &mut Findings,
) -> Option<Signals> {
    let places = places::find(header, wanted, (reading, format), findings)?;
    let there: Vec<Column> = places.columns.iter().flatten().copied().collect();
    let Samples { lines, columns: values, simulated } = read(&there, findings);
    let mut values = values.into_iter();
    let mut columns: Vec<Option<Vec<f64>>> =
        places.columns.iter().map(|place| place.and_then(|_| values.next())).collect();
    if let Some(interval) = places.interval {
        let time = &mut columns[0];
        match time {
            // Sample numbers.
            Some(numbers) => numbers.iter_mut().for_each(|number| *number *= interval),
            None => *time = Some((0..lines.len()).map(|k| k as f64 * interval).collect()),
        }
    }
    Some(Signals { shown_as: findings.path().to_owned(), lines, columns, simulated, warnings: Vec::new() })
}

/// Numbers in each of a few lines from which a file has a line for each column.
const COLUMNS: usize = 100;

/// Curves in one direction from which a file is a magnetometer's.
const CURVES: usize = 3;

/// Whether a file has a column of times.
fn has_time(header: &Head, reading: &Reading) -> bool {
    let is_time = |name: &String| names::quantity(TIME).is_some_and(|time| time.fits(name).is_some());
    reading.column(TIME).is_some() || header.clock().is_some() || header.names.iter().any(is_time)
}

impl Signals {
    /// A required column; empty if it was not required.
    pub(crate) fn column(&self, k: usize) -> &[f64] {
        self.columns.get(k).and_then(Option::as_deref).unwrap_or(&[])
    }

    /// Place of a sample in messages: its time if column 0 holds times, otherwise its line.
    pub(crate) fn place(&self, k: usize) -> String {
        match self.columns.first().and_then(Option::as_ref).and_then(|t| t.get(k)) {
            Some(t) => format!("{t} s"),
            None => format!("line {}", self.lines.at(k)),
        }
    }

    /// Refuses a column that never changes; returns whether it does not.
    pub(crate) fn is_constant(&self, column: usize, name: &str, help: &str, findings: &mut Findings) -> bool {
        let (low, high) = statistics::extent(self.column(column));
        if low >= high {
            let (from, to) = (self.place(0), self.place(self.lines.len() - 1));
            let message = format!("`{name}` is {low} in every sample, from {from} to {to}");
            findings.add(codes::RECORD_CONSTANT, None, message, help);
        }
        low >= high
    }

    /// Refuses a column that never changes, or that is exactly constant while `input` travels 5 % of its range.
    pub(crate) fn check_moves(&self, input: usize, output: usize, names: [&str; 2], findings: &mut Findings) {
        let help = "record while it runs through its range; is the channel connected?";
        let mut channels = [input, output].into_iter().zip(names);
        if channels.any(|(which, name)| self.is_constant(which, name, help, findings)) {
            return;
        }
        let y = self.column(output);
        let (bottom, top) = statistics::extent(y);
        for Standstill { first, run, input: [a, b] } in standstills(self.column(input), y, 3) {
            let what = if y[first] == bottom || y[first] == top { "is limited at" } else { "is stuck at" };
            let (start, end, name, value) = (self.place(first), self.place(first + run - 1), names[1], y[first]);
            let other = names[0];
            let message = format!(
                "from {start} to {end} `{name}` {what} {value} for {run} samples while `{other}` goes through {a} to {b}"
            );
            let help = "check the range and the connection of that channel; record again within its range";
            findings.add(codes::RECORD_STUCK, Some(self.lines.at(first)), message, help);
        }
    }
}
