//! The head of a file and its dialect: the names of the columns (after a preamble, above a line of units, or in a
//! comment), their separator, and the form of numbers.

use super::names;
use super::number::{clock, is_date, number};
use specgen_language::quantity::may_divide_thousands;

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
    /// Numbers of the names and of the columns if they differ; the names are then not used.
    pub(crate) unfit: Option<[usize; 2]>,
    /// Columns, from 0, that have a number in the first sample, and what their first samples are.
    pub(crate) filled: Vec<(usize, Shape)>,
    /// Index of the first line after them.
    pub(super) next: usize,
    /// Separator of the samples.
    pub(super) separator: u8,
}

/// What the first samples of a column are, if there are at least three, or times of day.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// All equal.
    Constant,
    /// Integers in steps of 1.
    Counting,
    /// Rising, as times do.
    Rising,
    Other,
    /// There are too few.
    Unknown,
    /// Times of day.
    Clock,
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
    let row = (first..lines.len()).find(|&at| separator_of(&lines[at].1).is_some());
    // A comment behind a row is not above it.
    let is_above = |at: usize| row.is_none_or(|row| at < row) || !is_comment(&lines[at].1);
    if let Some(at) = (first..lines.len()).find(|&at| is_above(at) && known(at) > 1) {
        return Some(at_line(lines, at, interval));
    }
    if let Some(row) = row
        && let Some(separator) = separator_of(&lines[row].1)
    {
        // `# NAME0 = …` of the General Command Set.
        let names: Vec<String> = lines[..row].iter().filter_map(|(_, line)| numbered_name(line)).collect();
        if names.len() > 1 && names.len() == split(&lines[row].1, separator).len() {
            return Some(Head { names, next: row, interval, ..Head::without_names(lines[row].0, separator) });
        }
    }
    let above = |row: usize, fits: &dyn Fn(&[u8]) -> bool| (0..row).rev().find(|&at| fits(&lines[at].1));
    match row {
        // Some programs write the names into the last comment.
        Some(row) if row == first => {
            match above(row, &is_comment).map(|at| (known(at), at_line(lines, at, interval))) {
                Some((known, head)) if known > 1 || head.has_units_of(&lines[row].1) => {
                    Some(Head { next: row, ..head })
                }
                _ => {
                    let separator = separator_of(&lines[row].1).unwrap_or(b',');
                    Some(Head { next: row, interval, ..Head::without_names(lines[row].0, separator) })
                }
            }
        }
        Some(row) => {
            // A line with a number among its fields is an invalid row of numbers.
            let has_number = |line: &[u8]| names_of(line).iter().any(|name| name.parse::<f64>().is_ok());
            let is_text = |line: &[u8]| has_fields(line) && !is_units(line) && !is_rule(line) && !has_number(line);
            Some(at_line(lines, above(row, &is_text).unwrap_or(first), interval))
        }
        // A single column has no separator.
        None => {
            let is_number = |line: &[u8]| has_fields(line) && number(&decoded(line.trim_ascii()), BLANK).is_some();
            let names = lines.iter().position(|(_, line)| is_number(line)).filter(|row| *row > first);
            let names = names.and_then(|row| above(row, &|line| has_fields(line) && !is_unit_line(line)));
            Some(at_line(lines, names.unwrap_or(first), interval))
        }
    }
}

/// Whether a line is only a unit, such as `[um]`.
fn is_unit_line(line: &[u8]) -> bool {
    names::is_unit(decoded(line).trim())
}

/// The name in a comment such as `# NAME0 = Current Position`.
fn numbered_name(line: &[u8]) -> Option<String> {
    let text = decoded(uncommented(line));
    let (number, name) = text.trim().strip_prefix("NAME").filter(|_| is_comment(line))?.split_once('=')?;
    number.trim().parse::<u8>().ok().map(|_| name.trim().to_owned())
}

fn at_line(lines: &[Line], at: usize, interval: Option<f64>) -> Head {
    let (line, text) = &lines[at];
    let rows = lines[at + 1..].iter().find_map(|(_, line)| Some((separator_of(line)?, line)));
    let separator = rows.map_or_else(|| of_names(text), |(separator, _)| separator);
    let count = rows.map(|(separator, row)| split(row, separator).len());
    let mut names = fitting_names(text, count.filter(|_| matches!(separator, BLANK | b'\t')));
    if let Some(joined) = count.filter(|count| names.len() > *count).and_then(|count| with_commas(&names, count)) {
        names = joined;
    }
    let mut head = Head { names, next: at + 1, interval, ..Head::without_names(*line, separator) };
    head.skip_rule(lines);
    let has_units =
        |(_, line): &&Line| is_units(line) || head.names.iter().any(|name| is_increment(name)) && is_start(line);
    if let Some((_, below)) = lines.get(head.next).filter(has_units) {
        head.add_units(below);
        head.next += 1;
        head.skip_rule(lines);
    } else if let Some((_, above)) = at.checked_sub(1).map(|at| &lines[at]).filter(|(_, above)| is_units(above)) {
        head.add_units(above);
    }
    head
}

/// The names in a line; `count`: of the columns below, if blanks or tabs separate them. These may also be within the names
/// or before their units.
fn fitting_names(line: &[u8], count: Option<usize>) -> Vec<String> {
    let names = names_of(line);
    let words = split(uncommented(line), BLANK);
    if count.is_none_or(|count| count == names.len()) || words.len() < 2 {
        return names;
    }
    let mut of_words: Vec<String> = Vec::new();
    for word in words.into_iter().map(decoded) {
        match of_words.last_mut() {
            Some(last) if word.starts_with(['(', '[']) || last.contains(['(', '[']) && !last.ends_with([')', ']']) => {
                *last = format!("{last} {word}");
            }
            _ => of_words.push(word),
        }
    }
    let text = decoded(uncommented(line));
    let of_gaps = text.replace('\t', "  ");
    let of_gaps = of_gaps.split("  ").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect();
    [of_words, of_gaps].into_iter().find(|other: &Vec<String>| Some(other.len()) == count).unwrap_or(names)
}

/// `count` names, of which commas divide some: within brackets, or before the unit, as in `Time,s,Ch1,V`.
fn with_commas(names: &[String], count: usize) -> Option<Vec<String>> {
    let join = |names: &[String], between: &str, is_joined: &dyn Fn(&str, &str) -> bool| {
        let mut joined: Vec<String> = Vec::new();
        for name in names {
            match joined.last_mut() {
                Some(last) if is_joined(last, name) => *last = format!("{last}{between}{name}"),
                _ => joined.push(name.clone()),
            }
        }
        joined
    };
    let is_open = |name: &str, _: &str| name.matches(['(', '[']).count() > name.matches([')', ']']).count();
    let closed = join(names, ", ", &is_open);
    let with_units = join(&closed, ",", &|name, next| names::is_unit(next) && !name.contains(','));
    [closed, with_units].into_iter().find(|names| names.len() == count)
}

/// Whether a line below `Start,Increment` has units, start and increment, as `Sequence,Volt,0,1e-3`.
fn is_start(line: &[u8]) -> bool {
    let fields = names_of(line);
    let is_unit_or_number = |field: &String| field.is_empty() || names::is_unit(field) || field.parse::<f64>().is_ok();
    let [first, rest @ ..] = &fields[..] else { return false };
    first.starts_with(char::is_alphabetic)
        && first.parse::<f64>().is_err()
        && rest.iter().any(|field| names::is_unit(field))
        && rest.iter().all(is_unit_or_number)
}

fn is_increment(name: &str) -> bool {
    name.eq_ignore_ascii_case("increment")
}

/// Whether a line is drawn, as `-----` or `|---|---|`.
pub(super) fn is_rule(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.len() > 2 && line.iter().all(|byte| matches!(byte, b'-' | b'=' | b'_' | b'|' | b'+' | b':' | b' ' | b'\t'))
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

/// The line without its comment sign.
fn uncommented(line: &[u8]) -> &[u8] {
    line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"%")).unwrap_or(line)
}

pub(super) fn names_of(line: &[u8]) -> Vec<String> {
    let line = uncommented(line);
    split(line, of_names(line)).into_iter().map(decoded).collect()
}

fn is_units(line: &[u8]) -> bool {
    let fields = names_of(line);
    fields.len() > 1 && fields.iter().all(|field| field.is_empty() || names::is_unit(field)) && !is_blank(line)
}

/// Names of a sampling interval in preambles, in lower case letters.
const INTERVALS: [&str; 6] = ["deltax", "sampleinterval", "samplinginterval", "sampletime", "xincrement", "timestep"];

/// The sampling interval in a line such as `Delta_X\t0,001`, `Sample Interval,1e-3,s` or `# SAMPLE_TIME = 0.001`, s; none
/// if its unit is not known.
fn interval(line: &[u8]) -> Option<f64> {
    let text = decoded(uncommented(line));
    let (name, rest) = text.split_once(['\t', ',', ';', '=', ':'])?;
    if !INTERVALS.contains(&names::plain(name).as_str()) {
        return None;
    }
    let rest = rest.trim_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ';'));
    let mut words = rest.split([' ', '\t', ';']).filter(|word| !word.is_empty());
    let number = words.next()?;
    let (number, unit) = match number.split_once(',') {
        Some((whole, unit)) if unit.starts_with(char::is_alphabetic) => (whole.to_owned(), Some(unit)),
        _ if may_divide_thousands(number, ',') => return None,
        _ => (number.replace(',', "."), words.next()),
    };
    let unit = unit.map(|unit| unit.trim_matches(['[', ']', '(', ')']));
    let per = match unit.filter(|unit| unit.starts_with(char::is_alphabetic)) {
        Some(unit) => names::quantity("time_s")?.per(unit)?,
        None => 1.0,
    };
    number.parse().ok().map(|step: f64| step / per).filter(is_interval)
}

fn is_interval(step: &f64) -> bool {
    step.is_finite() && *step > 0.0
}

impl Head {
    /// Of a file without names whose first sample is in `line`.
    pub(super) fn without_names(line: usize, separator: u8) -> Self {
        Self { names: Vec::new(), line, interval: None, unfit: None, filled: Vec::new(), next: 0, separator }
    }

    /// Of named arrays.
    pub(crate) fn of_arrays(arrays: &[(String, Vec<f64>)]) -> Self {
        let filled = arrays.iter().map(|(_, values)| Shape::of(values)).enumerate().collect();
        let names = arrays.iter().map(|(name, _)| name.trim().to_owned()).collect();
        Self { filled, names, ..Self::without_names(1, b',') }
    }

    /// The first column with times of day.
    pub(crate) fn clock(&self) -> Option<usize> {
        self.filled.iter().find(|(_, shape)| *shape == Shape::Clock).map(|(at, _)| *at)
    }

    fn skip_rule(&mut self, lines: &[Line]) {
        self.next += usize::from(lines.get(self.next).is_some_and(|(_, line)| is_rule(line)));
    }

    /// Appends the units in a line to the names without them; `Increment` has the interval of a counted time.
    fn add_units(&mut self, line: &[u8]) {
        for (name, unit) in self.names.iter_mut().zip(names_of(line)) {
            if is_increment(name) {
                self.interval = self.interval.or_else(|| unit.parse().ok().filter(is_interval));
            }
            // A name whose own unit is another one then fits no quantity.
            *name = names::with_unit(name, unit.trim_matches(['[', ']', '(', ')']));
        }
    }

    /// Whether there is a name for each number of a row, and a unit in one of them.
    fn has_units_of(&self, row: &[u8]) -> bool {
        let count = separator_of(row).map(|separator| split(row, separator).len());
        Some(self.names.len()) == count && self.names.iter().any(|name| names::own_unit(name).is_some())
    }

    /// Finds the columns that have numbers in the first of the `lines` of samples.
    pub(super) fn find_filled(&mut self, lines: &[Line]) {
        let value = |field: &[u8]| number(&decoded(field), self.separator).map(|(value, _)| value);
        let mut columns: Vec<(usize, Vec<f64>)> = Vec::new();
        for (k, (_, row)) in lines.iter().filter(|(_, line)| has_fields(line)).enumerate() {
            let fields: Vec<Option<f64>> = split(row, self.separator).into_iter().map(value).collect();
            if k == 0 {
                let filled = fields.into_iter().enumerate();
                columns = filled.filter_map(|(at, value)| Some((at, vec![value?]))).collect();
            } else {
                columns.iter_mut().for_each(|(at, values)| values.extend(fields.get(*at).copied().flatten()));
            }
        }
        self.filled = columns.iter().map(|(at, values)| (*at, Shape::of(values))).collect();
        let first = lines.iter().find(|(_, line)| has_fields(line)).map(|(_, row)| split(row, self.separator));
        let is_clock = |at: usize| first.as_ref().is_some_and(|row| clock(&decoded(row[at])).is_some());
        self.filled.iter_mut().filter(|(at, _)| is_clock(*at)).for_each(|(_, shape)| *shape = Shape::Clock);
    }
}

impl Shape {
    fn of(values: &[f64]) -> Self {
        let all = |is: fn(f64) -> bool| values.windows(2).all(|pair| is(pair[1] - pair[0]));
        match values {
            _ if values.len() < 3 => Self::Unknown,
            _ if all(|step| step == 0.0) => Self::Constant,
            [first, ..] if all(|step| step == 1.0) && first.fract() == 0.0 => Self::Counting,
            _ if all(|step| step > 0.0) => Self::Rising,
            _ => Self::Other,
        }
    }
}

/// Separators in the order in which they are tried. Apart from the comma, none of them occurs in a number.
const SEPARATORS: [u8; 5] = [b'\t', b';', b'|', b',', BLANK];
/// Any number of blanks and tabs.
pub(super) const BLANK: u8 = b' ';

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

/// Whether a line is a row of numbers: at least two fields, some of which may be empty or dates, but not all.
pub(super) fn is_row(line: &[u8], separator: u8) -> bool {
    let fields = split(line, separator);
    let is_number = |field: &&[u8]| std::str::from_utf8(field).is_ok_and(|text| number(text, separator).is_some());
    let filled = fields.iter().filter(|field| !field.is_empty());
    fields.len() > 1
        // Not only a date and a time.
        && filled.clone().any(|field| is_number(field) && !field.contains(&b':'))
        && filled.clone().all(|field| is_number(field) || is_date(field))
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
            ("t,s,F (N, mean),y,um\n0,1,2\n", 1, &["t,s", "F (N, mean)", "y,um"], b','),
            ("# time_s drive_V\n0.1 2\n", 1, &["time_s", "drive_V"], b' '),
            ("0;1\n2;3\n", 1, &[], b';'),
            ("0;1\n# time_s;drive_V\n2;3\n", 1, &[], b';'),
            ("DRR? 1 2\n# DIM = 2\n# NAME0 = a b\n# NAME1 = c\n1 2\n", 5, &["a b", "c"], b' '),
            ("bench\n# time_s;drive_V\n2;3\n", 2, &["time_s", "drive_V"], b';'),
            ("drve_V,t_s\nx,1\n0,1\n", 1, &["drve_V", "t_s"], b','),
            ("time_s;drive_V\n", 1, &["time_s", "drive_V"], b';'),
            ("Time s,Drive V,Position um\n0,1,2,\n", 1, &["Time s", "Drive V", "Position um"], b','),
        ] {
            let found = head(text);
            assert_eq!(
                (found.line, &found.names[..], found.separator),
                (line, &names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>()[..], separator),
                "{text}"
            );
        }
        for (line, interval) in [
            ("Delta_X\t0,001\t0,001", Some(1e-3)),
            ("Delta_X\t1,000000E-3\t1,000000E-3", Some(1e-3)),
            ("Sample Interval;2,000E-06", Some(2e-6)),
            ("Sample Interval: 1  [ms]", Some(1e-3)),
            ("Sample Interval: 1000000 nsec", Some(1e-3)),
            ("Sample Interval: 1000 microsec", Some(1e-3)),
            ("Sample Interval: 1e9 ps", Some(1e-3)),
            ("Sample Interval: 1000 fortnights", None),
            ("Sample Interval,1e-3,ticks", None),
            ("Sample Interval: 1,000 us", None),
        ] {
            assert_eq!(head(&format!("{line}\nX_Value\tA\n\t2\n")).interval, interval, "{line}");
        }
        assert_eq!(head("X,A,Start,Increment\nSequence,Volt,0,inf\n0,1\n").interval, None);
    }

    #[test]
    fn rows_that_look_like_units_are_rows() {
        for (text, next) in [
            ("dir,mark,time_s,drive_V\nup,d,0,0\nup,d,1,0\n", 1),
            ("X,A,Start,Increment\nSequence,Volt,0,1\nup,s,0,1\n0,1\n", 2),
            ("time,drive\n----\ns,V\n----\ns,V\n0,1\n", 4),
        ] {
            assert_eq!(head(text).next, next, "{text}");
        }
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
        assert!(is_row(b"1,5;2;", b';') && is_row(b"5.3.2024;1:02:03;2", b';') && !is_row(b"5.3.2024 1:02:03", b' '));
        assert!(!is_row(b"1;x", b';') && !is_row(b";", b';') && !is_row(b"1,5", b';'));
    }
}
