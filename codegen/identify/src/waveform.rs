//! Reads a table of poses: a CSV file whose columns name axis and unit, such as `x_um`, `theta_z_urad` or `Rz [deg]`.
//!
//! Rows have the fixed period of the spec. A column `time_s` (or `Time [ms]` and so on) is optional; it is compared with
//! that period, so that a table played at the wrong speed is found. Axes without a column stay at 0. One run reports
//! every problem of the file.

use std::path::Path;

use crate::columns::names::{self, COORDINATES, Conversion};
use crate::columns::{self, Column, Format, Head, Samples};
use crate::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};

/// Most rows: a table is stored in a microcontroller's flash.
pub const MAX_ROWS: usize = 65_536;

/// Largest deviation of a time column from the period, as a fraction of it: times have few digits.
const TIME_SLACK: f64 = 1e-3;

/// A table of poses, each finite, at least two.
#[derive(Debug, Clone, PartialEq)]
pub struct Waveform {
    /// Name of the file as the user gave it.
    pub shown_as: String,
    /// Line of each row.
    pub lines: Vec<usize>,
    /// x, y, z (m), θx, θy, θz (rad) of each row.
    pub rows: Vec<[f64; 6]>,
}

/// The waveform in the file at `path`, whose rows are `period` (s) apart, and the text of the file.
///
/// # Errors
/// One finding if it is not a regular file, cannot be read, is too large or not UTF-8; otherwise as [`parse`].
pub fn read(path: &Path, shown_as: &str, period: f64) -> Result<(Waveform, String), Vec<Diagnostic>> {
    let text = crate::read_file(path, shown_as)?;
    Ok((parse(&text, shown_as, period)?, text))
}

/// A waveform from the text of its file, whose rows are `period` (s) apart.
///
/// # Errors
/// All findings of the file.
pub fn parse(text: &str, shown_as: &str, period: f64) -> Result<Waveform, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let waveform = parse_rows(text, shown_as, period, &mut findings);
    findings.conclude(waveform).map(|(waveform, _)| waveform)
}

/// Axis of a column, none for the time, and the conversion to µm, µrad or s.
type Meaning = (Option<usize>, Conversion);

fn parse_rows(text: &str, shown_as: &str, period: f64, findings: &mut Findings) -> Option<Waveform> {
    let (header, lines) = columns::open(text.as_bytes(), &FORMAT, findings)?;
    if header.names.iter().all(String::is_empty) {
        return findings.refuse(codes::WAVEFORM_HEADER, None, "is empty".to_owned(), EXPECTED);
    }
    let is_nameless = |(at, name): &(usize, &String)| name.is_empty() && columns::has_values(text, &header, *at);
    for (at, _) in header.names.iter().enumerate().filter(is_nameless) {
        let message = format!("column {} has values, but no name", at + 1);
        findings.add(codes::WAVEFORM_HEADER, Some(header.line), message, EXPECTED);
    }
    let meanings = meanings(&header, findings)?;
    let names = header.names.iter().enumerate().filter(|(_, name)| is_read(name));
    let columns = meanings.iter().zip(names);
    let all: Vec<Column> = columns.map(|(&(_, conversion), (at, name))| Column { at, name, conversion }).collect();
    let Samples { lines, columns: values, .. } = lines.read(&all, findings);
    let lines: Vec<usize> = lines.iter().collect();
    let mut rows = vec![[0.0; 6]; lines.len()];
    for ((axis, _), values) in meanings.iter().zip(&values) {
        match *axis {
            None => {
                let times = lines.iter().copied().zip(values.iter().copied()).filter(|(_, time)| time.is_finite());
                check_times(&times.collect::<Vec<_>>(), period, findings);
            }
            Some(axis) => rows.iter_mut().zip(values).for_each(|(row, value)| row[axis] = value * 1e-6),
        }
    }
    if !(2..=MAX_ROWS).contains(&rows.len()) {
        let message = format!("has {} rows, expected 2 to {MAX_ROWS}", rows.len());
        findings.add(codes::WAVEFORM_LENGTH, None, message, "sample more coarsely: rows are joined by cubic splines");
    }
    Some(Waveform { shown_as: shown_as.to_owned(), lines, rows })
}

const FORMAT: Format = Format {
    header: codes::WAVEFORM_HEADER,
    value: codes::WAVEFORM_VALUE,
    not_finite: (codes::WAVEFORM_VALUE, "give every row a value"),
    longer_lines: false,
    whole_line: None,
    preamble: false,
};

const EXPECTED: &str = "name the columns by axis and unit in the first line, such as `x_um,y_um,z_um,theta_x_urad`";

/// Whether a column may be part of a pose: it has a name, and does not count the rows.
fn is_read(name: &str) -> bool {
    !name.is_empty() && !names::is_sample_number(name)
}

/// Content of each column, or `None` after every problem of the header was reported.
fn meanings(header: &Head, findings: &mut Findings) -> Option<Vec<Meaning>> {
    let line = Some(header.line);
    let mut found: Vec<Meaning> = Vec::new();
    for (place, name) in header.names.iter().enumerate().filter(|(_, name)| is_read(name)) {
        match meaning(name) {
            Ok(meaning) => {
                if let Some(first) = found.iter().position(|(axis, _)| *axis == meaning.0) {
                    let first = header.names.iter().enumerate().filter(|(_, name)| is_read(name)).nth(first);
                    let first = first.map_or(0, |(at, _)| at) + 1;
                    let message = format!("columns {first} and {} (`{name}`) hold the same coordinate", place + 1);
                    findings.add(codes::WAVEFORM_HEADER, line, message, "keep one of them");
                }
                found.push(meaning);
            }
            Err(help) => {
                let message = format!("`{name}` is not a column of a table of poses");
                findings.add(codes::WAVEFORM_HEADER, line, message, &help);
            }
        }
    }
    if findings.any_error() {
        return None;
    }
    if found.iter().all(|(axis, _)| axis.is_none()) {
        return findings.refuse(codes::WAVEFORM_HEADER, line, "has no coordinate".to_owned(), EXPECTED);
    }
    Some(found)
}

/// The meaning of a name, or how to fix the name.
fn meaning(name: &str) -> Result<Meaning, String> {
    let coordinates = COORDINATES.iter().enumerate().map(|(axis, quantity)| (Some(axis), quantity));
    let all: Vec<_> = coordinates.chain(names::quantity("time_s").map(|time| (None, time))).collect();
    if let Some(found) = all.iter().find_map(|(axis, quantity)| Some((*axis, quantity.fits(name)?.1))) {
        return Ok((found.0, Conversion::unit(found.1)));
    }
    // `theta_x` alone is an axis without unit, not a quantity `theta` in a unit x.
    if let Some((_, quantity)) = all.iter().find(|(_, quantity)| quantity.is_named(name)) {
        return Err(format!("the unit is part of the name: `{name}_{}`", quantity.unit()));
    }
    let without_unit = name.rsplit_once(['_', ' ', '(', '[', '/', ',']).map_or(name, |(quantity, _)| quantity);
    match all.iter().find(|(_, quantity)| quantity.is_named(without_unit)) {
        Some((_, quantity)) => Err(format!("the unit is part of the name: {}", quantity.all_names())),
        None => Err(EXPECTED.to_owned()),
    }
}

/// Times rise by the period from row to row.
fn check_times(times: &[(usize, f64)], period: f64, findings: &mut Findings) {
    for pair in times.windows(2) {
        let (line, step) = (pair[1].0, pair[1].1 - pair[0].1);
        if step <= 0.0 {
            let message = format!("the time does not rise: it changes by {:.6} ms", step * 1e3);
            findings.add(codes::WAVEFORM_TIME, Some(line), message, "order the rows by time, each once");
        } else if (step - period).abs() > TIME_SLACK * period {
            let message =
                format!("the time rises by {:.6} ms, the spec's period is {:.6} ms", step * 1e3, period * 1e3);
            let help = "sample at a fixed period and give that as trajectory.period";
            findings.add(codes::WAVEFORM_TIME, Some(line), message, help);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> Vec<String> {
        let found = parse(text, "w.csv", 1e-3).unwrap_err();
        found.into_iter().map(|d| format!("{} {:?} {} / {}", d.code, d.place, d.message, d.help)).collect()
    }

    #[test]
    fn columns_may_come_in_any_order_and_unit_and_missing_axes_rest() {
        let text = "\u{feff}".to_owned() + "# a table\ntime_ms, THETA_Z_mrad ,x_um\n0,0.5,-1\n1,0,2.5e1\n";
        let waveform = parse(text.trim_start_matches('\u{feff}'), "w.csv", 1e-3).unwrap();
        assert_eq!(waveform.lines, [3, 4]);
        assert_eq!(waveform.rows, [[-1e-6, 0.0, 0.0, 0.0, 0.0, 0.5e-3], [25.0 * 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]]);
        let under = parse("n,time,x,rx,\n,ms,mm,deg,\n0,0,0.001,180,\n1,1,0,0,\n", "w.csv", 1e-3).unwrap();
        let other = parse("Time [s];X (mm);Rx deg;Z, nm\n0;0,001;180;7\n0,001;0;0;0\n", "w.csv", 1e-3).unwrap();
        let [x, _, z, theta_x, ..] = other.rows[0];
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 1e-12;
        assert!(near(under.rows[0][0], 1e-6) && near(under.rows[0][3], core::f64::consts::PI), "{:?}", under.rows);
        assert!(near(x, 1e-6) && near(z, 7e-9) && near(theta_x, core::f64::consts::PI), "{:?}", other.rows);
    }

    #[test]
    fn a_bad_header_comes_with_its_fix() {
        assert!(refused("")[0].contains("is empty"));
        assert!(refused("n,x_um,x_nm\n0,1,2\n")[0].contains("columns 2 and 3 (`x_nm`) hold the same coordinate"));
        assert!(refused("x_um,theta_x_turns\n")[0].contains("`theta_x_rad`"));
        assert!(refused("x_um,z_V\n")[0].contains("`z_um`"));
        assert!(refused("theta_x\n")[0].contains("`theta_x_urad`"));
        assert!(refused("pitch\n")[0].contains("is not a column of a table"));
        assert!(refused("1.0,2.0\n1,2\n")[0].contains("first line"));
        assert!(refused("time_s\n1\n2\n")[0].contains("no coordinate"));
        assert!(refused("x_um,,z_um\n0,,2\n0,1,2\n")[0].contains("column 2 has values, but no name"));
        assert!(parse("x_um,,z_um\n0,,2\n0,,2\n", "w.csv", 1e-3).is_ok());
        for (text, words) in [
            ("x_um,theta_x_urad\num,mrad\n0,1\n1,2\n", "`theta_x_urad [mrad]` is not a column"),
            ("x_um,y_um\nmm,mm\n0,1\n1,2\n", "`x_um [mm]` is not a column"),
            ("x_um,-y_um\n0,1\n1,2\n", "`-y_um` is not a column"),
            ("x_um;y_um\n0;999\n1;2,500\n", "`y_um` is `2,500`: the comma may divide thousands"),
            ("x_um,y_um\n0,5,0\n1,5,0\n", "has 3 values, expected 2"),
            ("x_um,y_um\n0,1\n# y_um,x_um\n1,2\n", "a comment names the columns"),
        ] {
            assert!(refused(text)[0].contains(words), "{:?}", refused(text));
        }
        assert!(parse("x_um;y_um\n0;1,250\n1;2,500\n", "w.csv", 1e-3).is_ok());
        assert!(parse("x_um;y_um\n0,000;1,250\n1,000;2,500\n", "w.csv", 1e-3).is_ok());
    }

    #[test]
    fn bad_values_are_named_by_line() {
        let found = refused("x_um,y_um\n1,2\nNaN,2\n1\n1,2,3\n1,a\n1,inf\n");
        let lines: Vec<bool> = (3..=7).map(|line| found.iter().any(|f| f.contains(&format!("Some({line})")))).collect();
        assert_eq!(lines, [true; 5], "{found:#?}");
        assert!(refused("x_um\n1\n")[0].contains("has 1 rows"));
    }

    #[test]
    fn a_time_column_must_rise_by_the_period() {
        assert!(parse("time_ms,x_um\n0,1\n1,2\n2.0005,3\n", "w.csv", 1e-3).is_ok());
        assert!(refused("time_ms,x_um\n0,1\n1,2\n1,3\n")[0].contains("does not rise"));
        assert!(refused("time_s,x_um\n0,1\n1,2\n")[0].contains("the spec's period is 1.000000 ms"));
    }
}
