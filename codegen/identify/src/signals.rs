//! Reads records of other kinds than reversal curves: named columns, some of which may be left out.

use std::path::Path;

use super::columns::{self, RECORD};
use super::findings::Findings;
use super::record::read_file;
use super::{sanity, statistics};
use specgen_language::diagnostic::{Diagnostic, codes};

/// A column that a record may have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    /// Name with unit, such as `force_N`.
    pub(crate) name: &'static str,
    /// Whether the record is refused without it.
    pub(crate) required: bool,
}

/// Columns of equal length, in the order wanted, in the units of their names.
#[derive(Debug, Clone)]
pub(crate) struct Signals {
    /// Name of the file as its user knows it.
    pub(crate) shown_as: String,
    /// Line of each sample.
    pub(crate) lines: Vec<usize>,
    /// Values; none for a column that the file does not have.
    pub(crate) columns: Vec<Option<Vec<f64>>>,
}

/// Fewer samples are no record.
const MIN_SAMPLES: usize = 8;

/// Reads the `wanted` columns. Time, if wanted, is the first one; it must rise.
pub(crate) fn read(path: &Path, shown_as: &str, wanted: &[Wanted]) -> Result<Signals, Vec<Diagnostic>> {
    parse(&read_file(path, shown_as)?, shown_as, wanted)
}

/// The same from the text of a file.
pub(crate) fn parse(text: &str, shown_as: &str, wanted: &[Wanted]) -> Result<Signals, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let parsed = parse_into(text, shown_as, wanted, &mut findings);
    match parsed {
        Some(signals) if !findings.any_error() => Ok(signals),
        _ => Err(findings.into_diagnostics()),
    }
}

fn parse_into(text: &str, shown_as: &str, wanted: &[Wanted], findings: &mut Findings) -> Option<Signals> {
    let (header, lines) = columns::open(text, &RECORD, findings)?;
    let names: Vec<&str> = wanted.iter().map(|w| w.name).collect();
    let help = format!("name the columns with their units: {}", names.join(","));
    let places: Vec<Option<usize>> =
        wanted.iter().map(|w| header.place(w.name, w.required.then_some(&help), findings)).collect();
    if findings.any_error() {
        return None;
    }
    let there: Vec<(usize, &str)> =
        places.iter().zip(names).filter_map(|(place, name)| Some(((*place)?, name))).collect();
    let (lines, values) = lines.read(&there, findings);
    let mut values = values.into_iter();
    let columns: Vec<Option<Vec<f64>>> = places.iter().map(|place| place.and_then(|_| values.next())).collect();
    if lines.len() < MIN_SAMPLES {
        let message = format!("has {} samples; at least {MIN_SAMPLES} are needed", lines.len());
        findings.add(codes::RECORD_TOO_SHORT, None, message, "record more samples");
    } else if let (Some(Some(time)), true, false) = (columns.first(), wanted[0].name == "time_s", findings.any_error())
    {
        sanity::check_time(&lines, time, findings);
    }
    Some(Signals { shown_as: shown_as.to_owned(), lines, columns })
}

impl Signals {
    /// A column that was required; empty if it was not.
    pub(crate) fn column(&self, k: usize) -> &[f64] {
        self.columns.get(k).and_then(Option::as_deref).unwrap_or(&[])
    }

    /// Where a sample is, for messages: its time if column 0 holds times, else its line.
    pub(crate) fn place(&self, k: usize) -> String {
        match self.columns.first().and_then(Option::as_ref).and_then(|t| t.get(k)) {
            Some(t) => format!("{t} s"),
            None => format!("line {}", self.lines.get(k).copied().unwrap_or(0)),
        }
    }

    /// Refuses a column that never changes, or that stands exactly still while `input` travels 5 % of its range.
    pub(crate) fn check_moves(&self, input: usize, output: usize, names: [&str; 2], findings: &mut Findings) {
        for (which, name) in [input, output].into_iter().zip(names) {
            let (low, high) = statistics::extent(self.column(which));
            if low >= high {
                let message = format!(
                    "`{name}` is {low} in every sample, from {} to {}",
                    self.place(0),
                    self.place(self.lines.len() - 1)
                );
                findings.add(
                    codes::RECORD_CONSTANT,
                    None,
                    message,
                    "record while it runs through its range; is the channel connected?",
                );
                return;
            }
        }
        let (x, y) = (self.column(input), self.column(output));
        let (low, high) = statistics::extent(x);
        let (bottom, top) = statistics::extent(y);
        let mut first = 0;
        while first < y.len() {
            let run = y[first..].iter().take_while(|v| **v == y[first]).count();
            let (a, b) = statistics::extent(&x[first..first + run]);
            if run > 2 && b - a > 0.05 * (high - low) {
                let what = if y[first] == bottom || y[first] == top { "is limited at" } else { "is stuck at" };
                let message = format!(
                    "from {} to {} `{}` {what} {} for {run} samples while `{}` goes through {a} to {b}",
                    self.place(first),
                    self.place(first + run - 1),
                    names[1],
                    y[first],
                    names[0]
                );
                findings.add(
                    codes::RECORD_STUCK,
                    Some(self.lines[first]),
                    message,
                    "check the range and the connection of that channel; record again within its range",
                );
            }
            first += run;
        }
    }
}
