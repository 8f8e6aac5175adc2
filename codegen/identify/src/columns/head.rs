//! Finds the names of the columns in a file: after a preamble, above a line of units, or in a comment.

use super::dialect::{SEPARATORS, decoded, is_blank, is_comment, is_row, split};
use super::names;

/// Number of lines in which the names are searched.
pub(super) const LINES: usize = 300;

/// The lines before the samples.
#[derive(Debug, PartialEq)]
pub(super) struct Head {
    /// Names of the columns with their units; empty for a file without names.
    pub(super) names: Vec<String>,
    /// Line of the names, counted from 1.
    pub(super) line: usize,
    /// Index of the first line after them.
    pub(super) next: usize,
    /// Separator of the samples.
    pub(super) separator: u8,
    /// Sampling interval stated in the preamble, s.
    pub(super) interval: Option<f64>,
}

/// A line and its number.
type Line = (usize, Vec<u8>);

/// The head of a file whose names are in the first line that is not a comment.
pub(super) fn plain(lines: &[Line]) -> Option<Head> {
    let at = lines.iter().position(|(_, line)| !is_blank(line) && !is_comment(line))?;
    Some(at_line(lines, at, None))
}

/// The head of a record, which may have a preamble; `None` if the file is empty.
pub(super) fn of_record(lines: &[Line]) -> Option<Head> {
    let first = lines.iter().position(|(_, line)| !is_blank(line) && !is_comment(line))?;
    let known = |at: usize| names_of(&lines[at].1).iter().filter(|name| names::is_known(name)).count();
    let interval = lines.iter().find_map(|(_, line)| interval(line));
    if let Some(at) = (first..lines.len()).find(|&at| known(at) > 1) {
        return Some(at_line(lines, at, interval));
    }
    let row = (first..lines.len()).find(|&at| separator_of(&lines[at].1).is_some());
    let above = |row: usize, fits: &dyn Fn(&[u8]) -> bool| (0..row).rev().find(|&at| fits(&lines[at].1));
    match row {
        // Some programs write the names into the last comment.
        Some(row) if row == first => match above(row, &is_comment) {
            Some(at) if known(at) > 1 => Some(Head { next: row, ..at_line(lines, at, interval) }),
            _ => Some(Head {
                names: Vec::new(),
                line: lines[row].0,
                next: row,
                separator: separator_of(&lines[row].1).unwrap_or(b','),
                interval,
            }),
        },
        Some(row) => {
            // A line with a number among its fields is an invalid row of numbers.
            let has_number = |line: &[u8]| names_of(line).iter().any(|name| name.parse::<f64>().is_ok());
            let is_text = |line: &[u8]| !is_blank(line) && !is_comment(line) && !is_units(line) && !has_number(line);
            Some(at_line(lines, above(row, &is_text).unwrap_or(first), interval))
        }
        None => Some(at_line(lines, first, interval)),
    }
}

fn at_line(lines: &[Line], at: usize, interval: Option<f64>) -> Head {
    let (line, text) = &lines[at];
    let mut names = names_of(text);
    let mut next = at + 1;
    if let Some((_, below)) = lines.get(next).filter(|(_, below)| is_units(below)) {
        for (name, unit) in names.iter_mut().zip(names_of(below)) {
            if !unit.is_empty() && !names::is_known(name) {
                *name = format!("{name} [{}]", unit.trim_matches(['[', ']', '(', ')']));
            }
        }
        next += 1;
    }
    let separator = lines[next..].iter().find_map(|(_, line)| separator_of(line));
    Head { names, line: *line, next, separator: separator.unwrap_or_else(|| of_names(text)), interval }
}

/// The separator with which a line is a row of numbers.
fn separator_of(line: &[u8]) -> Option<u8> {
    SEPARATORS.into_iter().find(|separator| is_row(line, *separator))
}

/// The separator that gives most known names; if equal, the one that occurs in the line.
fn of_names(line: &[u8]) -> u8 {
    let known = |separator: u8| {
        let fields = split(line, separator);
        (fields.iter().filter(|field| names::is_known(&decoded(field))).count(), fields.len() > 1)
    };
    SEPARATORS.into_iter().rev().max_by_key(|separator| known(*separator)).unwrap_or(b',')
}

fn names_of(line: &[u8]) -> Vec<String> {
    let line = line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"%")).unwrap_or(line);
    split(line, of_names(line)).into_iter().map(decoded).collect()
}

fn is_units(line: &[u8]) -> bool {
    let fields = names_of(line);
    fields.len() > 1 && fields.iter().all(|field| field.is_empty() || names::is_unit(field)) && !is_blank(line)
}

/// `Delta_X` of LabVIEW, s.
fn interval(line: &[u8]) -> Option<f64> {
    let rest = line.strip_prefix(b"Delta_X")?;
    let text = decoded(rest).replace(',', ".");
    text.split_whitespace().next()?.parse().ok().filter(|step: &f64| step.is_finite() && *step > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Head {
        let lines: Vec<Line> = text.lines().enumerate().map(|(k, line)| (k + 1, line.as_bytes().to_vec())).collect();
        of_record(&lines).unwrap()
    }

    #[test]
    fn names_are_found_behind_a_preamble_above_units_and_in_a_comment() {
        for (text, line, names, separator) in [
            ("time_s,drive_V\n0,1\n", 1, &["time_s", "drive_V"][..], b','),
            ("# by hand\ntime_s, drive_V\n0,1\n", 2, &["time_s", "drive_V"], b','),
            ("LabVIEW\t\nTime\t12:30\n***End***\t\nX_Value\tA\tB\n0,1\t2\t3\n", 4, &["X_Value", "A", "B"], b'\t'),
            ("sep=;\nt (s);a\n0,1;2\n", 2, &["t (s)", "a"], b';'),
            ("a;b\ns;V\n0;1\n", 1, &["a [s]", "b [V]"], b';'),
            ("# time_s drive_V\n0.1 2\n", 1, &["time_s", "drive_V"], b' '),
            ("0;1\n2;3\n", 1, &[], b';'),
            ("drve_V,t_s\nx,1\n0,1\n", 1, &["drve_V", "t_s"], b','),
            ("time_s;drive_V\n", 1, &["time_s", "drive_V"], b';'),
        ] {
            let found = head(text);
            assert_eq!(
                (found.line, &found.names[..], found.separator),
                (line, &names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>()[..], separator),
                "{text}"
            );
        }
        assert_eq!(head("Delta_X\t0,001\t0,001\nX_Value\tA\n\t2\n").interval, Some(1e-3));
    }
}
