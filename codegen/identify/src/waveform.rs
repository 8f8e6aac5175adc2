//! Reads a table of poses: a CSV file whose columns name axis and unit, such as `x_um`, `theta_z_urad` or `Rz [deg]`.
//!
//! Rows have the fixed period of the spec. A column `time_s` (or `Time [ms]` and so on) is optional; it is compared with
//! that period, so that a table played at the wrong speed is found. Axes without a column stay at 0. One run reports
//! every problem of the file.

use std::path::Path;

use crate::columns::names::{self, Quantity};
use crate::columns::{self, Format, Head, RECORD, TIME};
use crate::file::Source;
use crate::findings::Findings;
use crate::reading::Reading;
use crate::signals::{self, ColumnSpec, Signals, optional};
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
    /// Findings that refuse nothing.
    pub warnings: Vec<Diagnostic>,
}

/// The waveform in the file at `path`, whose rows are `period` (s) apart, and the text of the file. `columns`: as for
/// records, such as `x_um=Ch1,z=3*2 um/V`; if not given, columns are found by their names.
///
/// # Errors
/// One finding if it is not a regular file, cannot be read, is too large or not UTF-8; otherwise as [`parse`].
pub fn read(
    path: &Path,
    shown_as: &str,
    period: f64,
    columns: Option<&str>,
) -> Result<(Waveform, String), Vec<Diagnostic>> {
    let text = crate::read_file(path, shown_as)?;
    Ok((parse(&text, shown_as, period, columns)?, text))
}

/// A waveform from the text of its file, whose rows are `period` (s) apart.
///
/// # Errors
/// All findings of the file.
pub fn parse(text: &str, shown_as: &str, period: f64, columns: Option<&str>) -> Result<Waveform, Vec<Diagnostic>> {
    let reading = Reading::of_key(columns, shown_as, codes::WAVEFORM_HEADER)?;
    let mut findings = Findings::new(shown_as);
    let waveform = parse_rows(text, period, &reading, &mut findings);
    findings.conclude(waveform).map(|(waveform, warnings)| Waveform { warnings, ..waveform })
}

fn parse_rows(text: &str, period: f64, reading: &Reading, findings: &mut Findings) -> Option<Waveform> {
    let Source { content, choice } = Source::of_text(text.as_bytes(), None, findings)?;
    if choice.of > 1 || !findings.is_empty() {
        // What is left out of a path would be a jump.
        let message = "lines of text divide its rows".to_owned();
        return findings.refuse(codes::WAVEFORM_VALUE, None, message, "delete the text between the rows");
    }
    let (header, rows) = content.open(&FORMAT, findings)?;
    if reading.chosen().next().is_none() {
        check_names(&header, text, findings)?;
    }
    let Signals { lines, columns, .. } = signals::assigned(&header, rows, &WANTED, (reading, &FORMAT), findings)?;
    let [time, axes @ ..] = &columns[..] else { return None };
    if axes.iter().all(Option::is_none) {
        return findings.refuse(codes::WAVEFORM_HEADER, Some(header.line), "has no coordinate".to_owned(), EXPECTED);
    }
    let lines: Vec<usize> = lines.iter().collect();
    let mut rows = vec![[0.0; 6]; lines.len()];
    for (axis, values) in axes.iter().enumerate() {
        rows.iter_mut().zip(values.iter().flatten()).for_each(|(row, value)| row[axis] = value * 1e-6);
    }
    let times = lines.iter().copied().zip(time.iter().flatten().copied()).filter(|(_, time)| time.is_finite());
    check_times(&times.collect::<Vec<_>>(), period, findings);
    if !(2..=MAX_ROWS).contains(&rows.len()) {
        let message = format!("has {} rows, expected 2 to {MAX_ROWS}", rows.len());
        findings.add(codes::WAVEFORM_LENGTH, None, message, "sample more coarsely: rows are joined by cubic splines");
    }
    Some(Waveform { shown_as: findings.path().to_owned(), lines, rows, warnings: Vec::new() })
}

const FORMAT: Format = Format {
    header: codes::WAVEFORM_HEADER,
    value: codes::WAVEFORM_VALUE,
    not_finite: (codes::WAVEFORM_VALUE, "give every row a value"),
    longer_lines: false,
    expected: EXPECTED,
    ..RECORD
};

const EXPECTED: &str = "name the columns by axis and unit in the first line, such as `x_um,y_um,z_um,theta_x_urad`, or describe them by `columns` in the spec, such as `x_um=2`";

/// Time, then the coordinates in the order of a row.
const WANTED: [ColumnSpec; 7] = [
    optional(TIME),
    optional("x_um"),
    optional("y_um"),
    optional("z_um"),
    optional("theta_x_urad"),
    optional("theta_y_urad"),
    optional("theta_z_urad"),
];

/// Reports every column that would be left out: a pose without it is another path. Row numbers, and what is empty, are
/// none. `None` if there is any, or no name.
fn check_names(header: &Head, text: &str, findings: &mut Findings) -> Option<()> {
    let line = Some(header.line);
    if header.names.is_empty() {
        let message = match header.unfit {
            Some([names, columns]) => format!("has {names} names for {columns} columns"),
            None => "has no names of columns".to_owned(),
        };
        return findings.refuse(codes::WAVEFORM_HEADER, line, message, EXPECTED);
    }
    let quantities: Vec<&Quantity> = WANTED.iter().filter_map(|wanted| names::quantity(wanted.name)).collect();
    let mut found = vec![None; quantities.len()];
    for (at, name) in header.names.iter().enumerate() {
        let of = quantities.iter().position(|quantity| quantity.fits(name).is_some());
        let (message, help) = match of.map(|of| found[of].replace(at)) {
            Some(None) => continue,
            Some(Some(first)) => {
                let message = format!("columns {} and {} (`{name}`) hold the same coordinate", first + 1, at + 1);
                (message, "keep one of them".to_owned())
            }
            None if names::is_sample_number(name) || header.clock() == Some(at) => continue,
            None if !name.is_empty() => {
                (format!("`{name}` is not a column of a table of poses"), help(name, &quantities))
            }
            None if columns::has_values(text, header, at) => {
                (format!("column {} has values, but no name", at + 1), EXPECTED.to_owned())
            }
            None => continue,
        };
        findings.add(codes::WAVEFORM_HEADER, line, message, &help);
    }
    (!findings.any_error()).then_some(())
}

/// How to fix a name.
fn help(name: &str, all: &[&Quantity]) -> String {
    // `theta_x` alone is an axis without unit, not a quantity `theta` in a unit x.
    if let Some(quantity) = all.iter().find(|quantity| quantity.is_named(name)) {
        return format!("the unit is part of the name: `{name}_{}`", quantity.unit());
    }
    let without_unit = name.rsplit_once(['_', ' ', '(', '[', '/', ',']).map_or(name, |(quantity, _)| quantity);
    match all.iter().find(|quantity| quantity.is_named(without_unit)) {
        Some(quantity) => format!("the unit is part of the name: {}", quantity.all_names()),
        None => EXPECTED.to_owned(),
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
        let found = parse(text, "w.csv", 1e-3, None).unwrap_err();
        found.into_iter().map(|d| format!("{} {:?} {} / {}", d.code, d.place, d.message, d.help)).collect()
    }

    #[test]
    fn columns_may_come_in_any_order_and_unit_and_missing_axes_rest() {
        let text = "\u{feff}".to_owned() + "# a table\ntime_ms, THETA_Z_mrad ,x_um\n0,0.5,-1\n1,0,2.5e1\n";
        let waveform = parse(text.trim_start_matches('\u{feff}'), "w.csv", 1e-3, None).unwrap();
        assert_eq!(waveform.lines, [3, 4]);
        assert_eq!(waveform.rows, [[-1e-6, 0.0, 0.0, 0.0, 0.0, 0.5e-3], [25.0 * 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]]);
        let text = "WaveGen 2.1\nRate,1000\n\nA,B,C\n0,1,7\n0,2,8\n";
        let chosen = parse(text, "w.csv", 1e-3, Some("z_nm=C,theta_x=2*2 mrad/V+1 mrad")).unwrap();
        assert!((chosen.rows[1][2] / 8e-9 - 1.0).abs() < 1e-12 && (chosen.rows[1][3] / 5e-3 - 1.0).abs() < 1e-12);
        let numbered = parse("0 1\n1 2\n", "w.csv", 1e-3, Some("x_um=2")).unwrap();
        assert_eq!((numbered.rows[0][0], numbered.lines), (1e-6, vec![1, 2]));
        let behind = parse("WaveGen\nDate: 5.3.2024\nx_um,y_um\n1,2\n3,4\n", "w.csv", 1e-3, None).unwrap();
        assert_eq!(behind.lines, [4, 5]);
        let under = parse("n,time,x,rx,\n,ms,mm,deg,\n0,0,0.001,180,\n1,1,0,0,\n", "w.csv", 1e-3, None).unwrap();
        let other = parse("Time [s];X (mm);Rx deg;Z, nm\n0;0,001;180;7\n0,001;0;0;0\n", "w.csv", 1e-3, None).unwrap();
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
        assert!(parse("x_um,,z_um\n0,,2\n0,,2\n", "w.csv", 1e-3, None).is_ok());
        for (text, words) in [
            ("x_um,theta_x_urad\num,mrad\n0,1\n1,2\n", "`theta_x_urad [mrad]` is not a column"),
            ("x_um,y_um\nmm,mm\n0,1\n1,2\n", "`x_um [mm]` is not a column"),
            ("x_um,-y_um\n0,1\n1,2\n", "`-y_um` is not a column"),
            ("x_um;y_um\n0;999\n1;2,500\n", "`y_um` is `2,500`: the comma may divide thousands"),
            ("x_um,y_um\n0,5,0\n1,5,0\n", "has 3 numbers for 2 columns"),
            ("x_um,y_um\n0.5,0,1\n1,5,0\n", "has 2 names for 3 columns"),
            ("x_um,y_um\n0,1\n# y_um,x_um\n1,2\n", "a comment names the columns"),
        ] {
            assert!(refused(text)[0].contains(words), "{:?}", refused(text));
        }
        assert!(parse("x_um;y_um\n0;1,250\n1;2,500\n", "w.csv", 1e-3, None).is_ok());
        assert!(parse("x_um;y_um\n0,000;1,250\n1,000;2,500\n", "w.csv", 1e-3, None).is_ok());
    }

    #[test]
    fn a_description_of_columns_must_fit_the_file() {
        let found = |columns: &str| {
            let found = parse("A,B\n1,2\n3,4\n", "w.csv", 1e-3, Some(columns)).unwrap_err();
            format!("{} {} / {}", found[0].code, found[0].message, found[0].help)
        };
        let code = codes::WAVEFORM_HEADER.id;
        for (columns, expected) in [
            ("pitch=1", "`pitch` is not a column name"),
            ("drive_V=1", "`columns` of the spec names `drive_V`"),
            ("x_um=C", "`columns` of the spec names `C` for `x_um`; the header has `A`, `B`"),
            ("time_s=1", "has no coordinate"),
        ] {
            let found = found(columns);
            assert!(found.starts_with(code) && found.contains(expected), "{found}");
        }
        let rows = "1,2\n3,4\n5,6\n";
        for divided in
            [format!("{rows}overload\n7,8\n"), format!("7,8\npause\n{rows}"), format!("{rows}end\n7,8,OVL\n")]
        {
            let found = refused(&format!("x_um,y_um\n{divided}"));
            assert!(found.iter().any(|found| found.contains("lines of text divide its rows")), "{divided}: {found:?}");
        }
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
        assert!(parse("time_ms,x_um\n0,1\n1,2\n2.0005,3\n", "w.csv", 1e-3, None).is_ok());
        assert!(refused("time_ms,x_um\n0,1\n1,2\n1,3\n")[0].contains("does not rise"));
        assert!(refused("time_s,x_um\n0,1\n1,2\n")[0].contains("the spec's period is 1.000000 ms"));
    }
}
