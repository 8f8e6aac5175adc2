//! Reads a measured record: a CSV file with the columns `time_s`, `drive_V`, `displacement_um`.
//!
//! Every problem of the file is reported in one run. What depends on the declared drive range is checked
//! later, by [`super::coverage`].

use std::io::Read;
use std::path::Path;

use super::columns::{self, Header, RECORD};
use super::distrust;
use super::findings::Findings;
use super::{sanity, statistics};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Time of the sample, s.
pub(crate) const TIME: usize = 0;
/// Drive, V.
pub(crate) const DRIVE: usize = 1;
/// Displacement, µm.
pub(crate) const DISPLACEMENT: usize = 2;

/// Header names in the order of [`TIME`], [`DRIVE`], [`DISPLACEMENT`].
pub(crate) const NAMES: [&str; 3] = ["time_s", "drive_V", "displacement_um"];

/// Name of the drive's column where it is the measured voltage.
pub(crate) const MONITOR: &str = "monitor_V";

/// Headers closer than this many edits to a wanted one are suggested.
const NEAR: usize = 4;

/// Larger files are refused before they are read.
pub const MAX_FILE_BYTES: u64 = 256 << 20;

/// A measured record in SI units, checked sample by sample.
///
/// The three columns have equal length, at least 100; every value is finite;
/// time increases strictly and has no gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Name of the file as its user knows it.
    pub shown_as: String,
    /// Time, s.
    pub time: Vec<f64>,
    /// Drive, V.
    pub drive: Vec<f64>,
    /// Whether the drive is the measured voltage (column `monitor_V`), not the command that a converter holds.
    pub monitored: bool,
    /// Displacement, m.
    pub displacement: Vec<f64>,
    /// Samples that no fit believes: glitches, and what follows a jump of the drive.
    pub weightless: Vec<bool>,
    /// Findings that refuse nothing.
    pub warnings: Vec<Diagnostic>,
}

impl Record {
    /// A record from columns in memory (s, V, m), under the same checks as a file.
    ///
    /// # Errors
    /// The same findings as [`read_record`]; line k + 2 stands for sample k.
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
        for (column, name) in [(&time, NAMES[TIME]), (&drive, NAMES[DRIVE]), (&displacement, NAMES[DISPLACEMENT])] {
            for (k, x) in column.iter().enumerate().filter(|(_, x)| !x.is_finite()) {
                RECORD.report_not_finite(k + 2, name, &x.to_string(), &mut findings);
            }
        }
        let lines = (2..n + 2).collect();
        finish(findings, shown_as, lines, [time, drive, displacement])
    }

    /// Half the interval for which a converter holds each sample of the drive, s: by so much the voltage lags a command on the
    /// mean. 0 where the drive is the measured voltage, or is sampled more slowly than at 1 kHz.
    #[must_use]
    pub fn held(&self) -> f64 {
        if self.monitored { 0.0 } else { hold(&self.time) }
    }

    /// Difference of the largest and the smallest displacement, m.
    #[must_use]
    pub fn displacement_range(&self) -> f64 {
        let (low, high) = statistics::extent(&self.displacement);
        high - low
    }
}

/// Reads a record. `shown_as` is how messages name the file.
///
/// # Errors
/// All findings of the file, warnings included, if at least one refuses it.
pub fn read_record(path: &Path, shown_as: &str) -> Result<Record, Vec<Diagnostic>> {
    parse_record(&read_file(path, shown_as)?, shown_as)
}

/// The text of a data file, record or table, without a byte order mark.
///
/// # Errors
/// A finding if it is no regular file, cannot be read, is larger than [`MAX_FILE_BYTES`] or not UTF-8.
pub fn read_file(path: &Path, shown_as: &str) -> Result<String, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    read_text(path, &mut findings).ok_or_else(|| findings.into_diagnostics())
}

/// A record from the text of its file.
///
/// # Errors
/// As [`read_record`].
pub fn parse_record(text: &str, shown_as: &str) -> Result<Record, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let Some((lines, columns)) = parse(text, &mut findings) else {
        return Err(findings.into_diagnostics());
    };
    let [time, drive, micrometres] = columns;
    let displacement = micrometres.into_iter().map(|y| y * 1e-6).collect();
    let record = finish(findings, shown_as, lines, [time, drive, displacement])?;
    Ok(Record { monitored: is_monitored(text), ..record })
}

/// Whether the header of a file has the measured voltage, and no command.
pub(crate) fn is_monitored(text: &str) -> bool {
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    let has = |name: &str| header.split(',').any(|column| column.trim().eq_ignore_ascii_case(name));
    has(MONITOR) && !has(NAMES[DRIVE])
}

/// Longest interval for which a converter is believed to hold a command, s: a record sampled more slowly leaves commands out.
const LONGEST_HOLD: f64 = 1e-3;

/// Half of the median sampling interval, s; 0 where that is too long for a converter's.
pub(crate) fn hold(time: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let interval = statistics::median(&mut intervals);
    if interval > LONGEST_HOLD { 0.0 } else { 0.5 * interval }
}

fn finish(
    mut findings: Findings,
    shown_as: &str,
    lines: Vec<usize>,
    columns: [Vec<f64>; 3],
) -> Result<Record, Vec<Diagnostic>> {
    // A value that could not be read would only cause a trail of follow-up findings.
    if !findings.any_error() {
        sanity::check(&lines, &columns, &mut findings);
    }
    if findings.any_error() {
        return Err(findings.into_diagnostics());
    }
    let [time, drive, displacement] = columns;
    let weightless = distrust::weightless(&lines, &time, &drive, &displacement, &mut findings);
    let warnings = findings.into_diagnostics();
    Ok(Record { shown_as: shown_as.to_owned(), time, drive, monitored: false, displacement, weightless, warnings })
}

/// The text of the file without a byte order mark, or `None` after the reason was reported.
fn read_text(path: &Path, findings: &mut Findings) -> Option<String> {
    let unreadable = |e: std::io::Error| (format!("cannot be read: {e}"), "name an existing CSV file");
    let bytes = match read_limited(path) {
        Ok(bytes) => bytes,
        Err(e) => {
            let (message, help) = unreadable(e);
            findings.add(codes::RECORD_IO, None, message, help);
            return None;
        }
    };
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let message = format!("is larger than {} MiB", MAX_FILE_BYTES >> 20);
        findings.add(codes::RECORD_TOO_LARGE, None, message, "record at a lower rate, or keep every n-th sample");
        return None;
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let end_of_text = bytes.iter().position(|&b| b == 0);
    let bad = std::str::from_utf8(bytes).err().map(|e| e.valid_up_to());
    if let Some(at) = end_of_text.or(bad) {
        let line = 1 + bytes[..at].iter().filter(|&&b| b == b'\n').count();
        let message = format!("is not a text file in UTF-8: byte {at} is 0x{:02x}", bytes[at]);
        findings.add(codes::RECORD_NOT_TEXT, Some(line), message, "export the record as CSV text in UTF-8");
        return None;
    }
    Some(String::from_utf8_lossy(bytes).into_owned())
}

/// At most one byte more than the limit, so that a huge file or a device costs neither time nor memory.
fn read_limited(path: &Path) -> std::io::Result<Vec<u8>> {
    let file = std::fs::File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Line numbers and the three columns in the file's units; `None` if there is no usable header.
fn parse(text: &str, findings: &mut Findings) -> Option<(Vec<usize>, [Vec<f64>; 3])> {
    if text.trim().is_empty() {
        let help = format!("the first line must be the header `{}`", NAMES.join(","));
        findings.add(codes::RECORD_HEADER, None, "is empty".to_owned(), &help);
        return None;
    }
    let (header, lines) = columns::open(text, &RECORD, findings)?;
    let places = places(&header, findings)?;
    let (lines, values) = lines.read(&[0, 1, 2].map(|k| (places[k], NAMES[k])), findings);
    Some((lines, values.try_into().ok()?))
}

/// Places of the three columns, or `None` after every problem was reported.
fn places(header: &Header, findings: &mut Findings) -> Option<[usize; 3]> {
    let has = |name: &str| header.names.iter().any(|column| column.eq_ignore_ascii_case(name));
    let drive = if has(MONITOR) && !has(NAMES[DRIVE]) { MONITOR } else { NAMES[DRIVE] };
    let found = [NAMES[TIME], drive, NAMES[DISPLACEMENT]]
        .map(|name| header.place(name, Some(&missing_column_help(&header.names, name)), findings));
    let [Some(time), Some(drive), Some(displacement)] = found else { return None };
    Some([time, drive, displacement])
}

fn missing_column_help(header: &[String], name: &str) -> String {
    if header.len() == 1 && (header[0].contains(';') || header[0].contains('\t')) {
        return "separate the columns by commas and write numbers with a decimal point".to_owned();
    }
    if header.iter().any(|h| h.parse::<f64>().is_ok()) {
        return format!("the first line must be the header `{}`", NAMES.join(","));
    }
    let quantity = name.split('_').next().unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    let near = header
        .iter()
        .filter(|h| !NAMES.iter().any(|other| h.eq_ignore_ascii_case(other)))
        .map(|h| (strsim::damerau_levenshtein(&h.to_ascii_lowercase(), &lower), h))
        .filter(|(distance, h)| *distance < NEAR || h.to_ascii_lowercase().starts_with(quantity))
        .min();
    match near {
        Some((_, h)) if other_unit(h, name) => {
            format!("`{h}` seems to be in another unit: convert it and name the column `{name}`")
        }
        Some((_, h)) => format!("rename `{h}` to `{name}` if that is what it holds"),
        None => format!("name the column that holds it `{name}`; the unit is part of the name"),
    }
}

/// Whether `header` names the same quantity as `name` with another unit behind the underscore.
fn other_unit(header: &str, name: &str) -> bool {
    match (header.rsplit_once('_'), name.rsplit_once('_')) {
        (Some((quantity, unit)), Some((wanted, wanted_unit))) => {
            quantity.eq_ignore_ascii_case(wanted) && !unit.eq_ignore_ascii_case(wanted_unit)
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn help(header: &[&str]) -> Vec<String> {
        let mut findings = Findings::new("r.csv");
        let text = header.join(",");
        let (header, _) = columns::open(&text, &RECORD, &mut findings).unwrap();
        let found = places(&header, &mut findings);
        let all = findings.into_diagnostics();
        assert_eq!(found.is_none(), !all.is_empty());
        all.into_iter().map(|d| format!("{} / {}", d.message, d.help)).collect()
    }

    #[test]
    fn order_case_and_extra_columns_do_not_matter() {
        let mut findings = Findings::new("r.csv");
        let (header, _) = columns::open("note,Displacement_UM, TIME_S,drive_v", &RECORD, &mut findings).unwrap();
        assert_eq!(places(&header, &mut findings), Some([2, 3, 1]));
    }

    #[test]
    fn near_misses_units_and_wrong_separators_get_their_own_advice() {
        assert!(help(&["tme_s", "drive_V", "displacement_um"])[0].contains("rename `tme_s` to `time_s`"));
        assert!(
            help(&["time_s", "drive_V", "displacement_nm"])[0]
                .contains("`displacement_nm` seems to be in another unit")
        );
        assert!(help(&["time_s;drive_V;displacement_um"])[0].contains("separate the columns by commas"));
        assert!(help(&["0.0", "1.0", "2.0"])[0].contains("first line must be the header"));
        assert!(help(&["time_s", "time_s", "drive_V", "displacement_um"])[0].contains("appears twice"));
        assert!(help(&["time_s", "drive_V"])[0].contains("column `displacement_um` is missing"));
    }
}
