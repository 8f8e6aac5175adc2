//! The head of a file and its dialect: the names of the columns (after a preamble, above a line of units, or in a
//! comment), their separator, and the form of numbers.

use super::names;

/// Number of lines in which the names are searched.
pub(super) const LINES: usize = 300;

/// The lines before the samples.
#[derive(Debug, PartialEq)]
pub(crate) struct Head {
    /// Names of the columns with their units; empty for a file without names.
    pub(crate) names: Vec<String>,
    /// Line of the names, counted from 1.
    pub(crate) line: usize,
    /// Time between samples stated in the preamble, s.
    pub(crate) interval: Option<f64>,
    /// Columns, from 0, that have a number in the first sample.
    pub(crate) filled: Vec<usize>,
    /// Index of the first line after them.
    pub(super) next: usize,
    /// Separator of the samples.
    pub(super) separator: u8,
}

/// A line and its number.
pub(super) type Line = (usize, Vec<u8>);

/// The head of a file that begins with `lines`; `None` if it is empty. The names are in the first line that is not a
/// comment, or, with `preamble`, anywhere.
pub(super) fn find(lines: &[Line], preamble: bool) -> Option<Head> {
    let first = lines.iter().position(|(_, line)| has_fields(line))?;
    if !preamble {
        return Some(at_line(lines, first, None));
    }
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
            _ => {
                let separator = separator_of(&lines[row].1).unwrap_or(b',');
                Some(Head { next: row, interval, ..Head::without_names(lines[row].0, separator) })
            }
        },
        Some(row) => {
            // A line with a number among its fields is an invalid row of numbers.
            let has_number = |line: &[u8]| names_of(line).iter().any(|name| name.parse::<f64>().is_ok());
            let is_text = |line: &[u8]| has_fields(line) && !is_units(line) && !has_number(line);
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
    let rows = lines[next..].iter().find_map(|(_, line)| Some((separator_of(line)?, line)));
    let separator = rows.map_or_else(|| of_names(text), |(separator, _)| separator);
    if rows.is_some_and(|(separator, row)| names.len() == 2 * split(row, separator).len())
        && names[1..].iter().step_by(2).all(|unit| names::is_unit(unit))
    {
        // `Time,s,Ch1,V` above columns that commas separate.
        names = names.chunks(2).map(|pair| pair.join(",")).collect();
    }
    Head { names, next, interval, ..Head::without_names(*line, separator) }
}

/// The separator with which a line is a row of numbers.
pub(super) fn separator_of(line: &[u8]) -> Option<u8> {
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

pub(super) fn names_of(line: &[u8]) -> Vec<String> {
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

/// Rows that are checked for decimal commas.
const ROWS: usize = 10;

impl Head {
    /// Of a file without names whose first sample is in `line`.
    pub(super) fn without_names(line: usize, separator: u8) -> Self {
        Self { names: Vec::new(), line, interval: None, filled: Vec::new(), next: 0, separator }
    }

    /// Of arrays with these names.
    pub(crate) fn of_arrays(names: Vec<String>) -> Self {
        Self { filled: (0..names.len()).collect(), names, ..Self::without_names(1, b',') }
    }

    /// Finds the columns that have numbers in the first of the `lines` of samples.
    pub(super) fn find_filled(&mut self, lines: &[Line]) {
        let Some((_, row)) = lines.iter().find(|(_, line)| has_fields(line)) else { return };
        let is_number = |field: &[u8]| number(&decoded(field), self.separator).is_some();
        let fields = split(row, self.separator).into_iter().enumerate();
        self.filled = fields.filter(|(_, field)| is_number(field)).map(|(at, _)| at).collect();
    }

    /// The line, the message and the help if commas are both decimal signs and separators in the `lines` of samples.
    pub(super) fn ambiguous_commas(&self, lines: &[Line]) -> Option<(usize, String, String)> {
        let count = self.names.len();
        let rows: Vec<&Line> = lines.iter().filter(|(_, line)| has_fields(line)).take(ROWS).collect();
        let is_ambiguous =
            |line: &[u8]| is_row(line, b',') && !line.contains(&b'.') && split(line, b',').len() > count + 1;
        let (number, line) = rows.first()?;
        if self.separator != b',' || count < 2 || !rows.iter().all(|(_, line)| is_ambiguous(line)) {
            return None;
        }
        let fields: Vec<String> = split(line, b',').into_iter().map(decoded).collect();
        let fixed: Vec<String> = fields.chunks(2).map(|pair| pair.join(",")).collect();
        let is_pairs = fields.len() == 2 * count;
        let example = if is_pairs { format!("; this line is then `{}`", fixed.join(";")) } else { String::new() };
        let message = format!(
            "has {} numbers for {count} columns: a comma seems to be the decimal sign, and the separator, too",
            fields.len()
        );
        let help = format!("export with semicolons or tabs between the columns, or with decimal points{example}");
        Some((*number, message, help))
    }
}

/// Separators in the order in which they are tried. Apart from the comma, none of them occurs in a number.
const SEPARATORS: [u8; 4] = [b'\t', b';', b',', BLANK];
/// Any number of blanks and tabs.
const BLANK: u8 = b' ';

/// The fields of a line, without blanks and quotation marks around them.
pub(super) fn split(line: &[u8], separator: u8) -> Vec<&[u8]> {
    let mut fields = Vec::new();
    let (mut start, mut quoted) = (0, false);
    for (k, byte) in line.iter().enumerate() {
        if *byte == b'"' {
            quoted = !quoted;
        } else if !quoted && (*byte == separator || separator == BLANK && *byte == b'\t') {
            fields.push(clean(&line[start..k]));
            start = k + 1;
        }
    }
    fields.push(clean(&line[start..]));
    if separator == BLANK {
        fields.retain(|field| !field.is_empty());
    }
    fields
}

fn clean(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    match field {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        _ => field,
    }
}

/// Text of a line with names: UTF-8, or else Latin-1, in which many instruments write their µ.
pub(crate) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// A number with its decimal sign, if it has one.
pub(super) fn number(field: &str, separator: u8) -> Option<(f64, Option<char>)> {
    if let Ok(value) = field.parse() {
        return Some((value, field.contains('.').then_some('.')));
    }
    if separator == b',' || field.contains('.') || field.matches(',').count() != 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().map(|value| (value, Some(',')))
}

/// Whether a line is a row of numbers: at least two fields, some of which may be empty, but not all.
pub(super) fn is_row(line: &[u8], separator: u8) -> bool {
    let fields = split(line, separator);
    let is_number = |field: &&[u8]| std::str::from_utf8(field).is_ok_and(|text| number(text, separator).is_some());
    let filled = fields.iter().filter(|field| !field.is_empty());
    fields.len() > 1 && filled.clone().count() > 0 && filled.clone().all(is_number)
}

/// Whether a line is empty, or has only separators.
fn is_blank(line: &[u8]) -> bool {
    line.iter().all(|byte| matches!(byte, b' ' | b'\t' | b'\r' | b';' | b','))
}

fn is_comment(line: &[u8]) -> bool {
    matches!(line.first(), Some(b'#' | b'%'))
}

/// Whether a line has names or numbers: it is neither blank nor a comment.
pub(super) fn has_fields(line: &[u8]) -> bool {
    !is_blank(line) && !is_comment(line)
}

/// Whether a line marks its file as simulated: a comment whose first word is `simulated`.
pub(super) fn is_mark(line: &[u8]) -> bool {
    let words = line.trim_ascii_start().iter().skip_while(|byte| matches!(byte, b'#' | b'%' | b' ' | b'\t'));
    let first: Vec<u8> = words.take_while(|byte| byte.is_ascii_alphabetic()).copied().collect();
    is_comment(line) && first.eq_ignore_ascii_case(b"simulated")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Head {
        let lines: Vec<Line> = text.lines().enumerate().map(|(k, line)| (k + 1, line.as_bytes().to_vec())).collect();
        find(&lines, true).unwrap()
    }

    #[test]
    fn names_are_found_behind_a_preamble_above_units_and_in_a_comment() {
        for (text, line, names, separator) in [
            ("time_s,drive_V\n0,1\n", 1, &["time_s", "drive_V"][..], b','),
            ("# by hand\ntime_s, drive_V\n0,1\n", 2, &["time_s", "drive_V"], b','),
            ("LabVIEW\t\nTime\t12:30\n***End***\t\nX_Value\tA\tB\n0,1\t2\t3\n", 4, &["X_Value", "A", "B"], b'\t'),
            ("sep=;\nt (s);a\n0,1;2\n", 2, &["t (s)", "a"], b';'),
            ("a;b\ns;V\n0;1\n", 1, &["a [s]", "b [V]"], b';'),
            ("Time,s;Ch1,V\n0;1\n", 1, &["Time,s", "Ch1,V"], b';'),
            ("Time,s,Ch1,V\n0,1\n", 1, &["Time,s", "Ch1,V"], b','),
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

    #[test]
    fn numbers_have_a_point_or_where_that_is_no_separator_a_comma() {
        assert_eq!(number("-12.5e-3", b','), Some((-12.5e-3, Some('.'))));
        assert_eq!(number("-12,5e-3", b';'), Some((-12.5e-3, Some(','))));
        assert_eq!(number("7", b';'), Some((7.0, None)));
        for bad in ["1.234,5", "1,234,5", "", "1 2", "2 V"] {
            assert_eq!(number(bad, b';'), None, "{bad}");
        }
        assert_eq!(number("1,5", b','), None);
    }

    #[test]
    fn a_comment_that_begins_so_marks_a_file_as_simulated() {
        for mark in ["# simulated by specgen", "%Simulated", "#  simulated: by hand"] {
            assert!(is_mark(mark.as_bytes()), "{mark}");
        }
        for other in ["simulated", "# not simulated", "# simulatedly", "0,1,2", "# drive simulated by a source", ""] {
            assert!(!is_mark(other.as_bytes()), "{other}");
        }
    }

    #[test]
    fn fields_lose_blanks_and_quotation_marks() {
        assert_eq!(split(b" a ,\"b, c\",", b','), [&b"a"[..], b"b, c", b""]);
        assert_eq!(split(b"  1   2\t3 ", b' '), [b"1", b"2", b"3"]);
        assert!(is_row(b"1,5;2;", b';') && !is_row(b"1;x", b';') && !is_row(b";", b';') && !is_row(b"1,5", b';'));
    }
}
