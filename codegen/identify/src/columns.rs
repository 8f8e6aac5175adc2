//! Reads columns of numbers from text files: names, then values. The first lines show how a file separates its columns,
//! writes decimals, and what precedes the names. Text after `#` or `%` at the beginning of a line is a comment.
//! [`Format`] has the codes and texts for the mistakes of a kind of file. Lines are read one by one, so that only the
//! numbers are kept in memory.

mod alignment;
pub(crate) mod foreign;
mod head;
mod lines;
pub(crate) mod names;
mod number;
mod scan;
mod signs;

use std::io::Read;

use super::findings::Findings;
use alignment::misaligned;
use head::{Line, has_fields, is_mark, names_of, split};
use lines::LineReader;
use names::Conversion;
use number::{Clock, SinceFirst, clock, is_date};
use signs::Signs;
use specgen_language::diagnostic::{Code, codes};
use specgen_language::interrupt;

pub(crate) use head::{Head, Shape, decoded};
pub(crate) use lines::LineNumbers;
pub(crate) use scan::{MOST_TABLES, Part, tables};

/// Codes and texts for the mistakes in a kind of file.
#[derive(Debug)]
pub(crate) struct Format {
    /// A header that cannot be read.
    pub(crate) header: Code,
    /// A line or a value that cannot be read.
    pub(crate) value: Code,
    /// NaN or infinity, and how to fix it.
    pub(crate) not_finite: (Code, &'static str),
    /// Whether a line may have more values than the header has names.
    pub(crate) longer_lines: bool,
    /// Message and help for any line without a finite number in every column, instead of one for each value.
    pub(crate) whole_line: Option<[&'static str; 2]>,
    /// Whether a preamble may precede the names.
    pub(crate) preamble: bool,
    /// Help for a file without a header.
    pub(crate) expected: &'static str,
}

/// Records of the bench.
pub(crate) const RECORD: Format = Format {
    header: codes::RECORD_HEADER,
    value: codes::RECORD_VALUE,
    not_finite: (codes::RECORD_NOT_FINITE, "delete the sample, or record again"),
    longer_lines: true,
    whole_line: None,
    preamble: true,
    expected: "the first line must be the header `time_s,drive_V,displacement_um`",
};

/// Most samples; a few columns of this length take a gigabyte.
pub(crate) const MAX_SAMPLES: usize = 1 << 25;

/// The column of times, which may be times of day.
pub(crate) const TIME: &str = "time_s";

/// A column that is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column<'a> {
    /// Its place, from 0.
    pub(crate) at: usize,
    /// Its name for messages.
    pub(crate) name: &'a str,
    /// To the unit of the quantity.
    pub(crate) conversion: Conversion,
}

/// The lines after the header.
pub(crate) struct Lines<'a> {
    format: &'a Format,
    names: Vec<String>,
    /// Those that are not empty, sorted.
    sorted: Vec<String>,
    /// Number of the names, or of the fields of the first row if there are none.
    count: usize,
    separator: u8,
    /// Times of day so far.
    clock: Option<SinceFirst>,
    /// Places of dates in columns of their own, once a row is read.
    dates: Option<Vec<usize>>,
    /// Whether an earlier line marked the file as simulated.
    simulated: bool,
    /// The last line of the table, if others follow.
    last: Option<usize>,
    input: LineReader<'a>,
}

/// The samples of a file.
pub(crate) struct Samples {
    /// Line of each.
    pub(crate) lines: LineNumbers,
    /// The requested columns; NaN after a problem with a value was reported.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Whether a comment marks the file as simulated.
    pub(crate) simulated: bool,
}

/// A simulation writes this mark below the column names of its record: the names stay in the first line, where programs
/// look for them, and the mark stays with every copy of the file. A measured record that replaces it has no mark.
pub const SIMULATED: &str = "# simulated by specgen: no leg was measured";

/// Whether the text of a data file is marked as simulated: by a comment whose first word is `simulated`.
#[must_use]
pub fn is_simulated(text: &str) -> bool {
    text.split(['\n', '\r']).any(|line| is_mark(line.as_bytes()))
}

/// The text of a table or record with the mark below its first line.
#[must_use]
pub fn marked_as_simulated(text: &str) -> String {
    let (names, rest) = text.split_once('\n').unwrap_or((text, ""));
    format!("{names}\n{SIMULATED}\n{rest}")
}

/// Reads the head; `None` after the problem was reported.
pub(crate) fn open<'a>(
    source: impl Read + 'a,
    format: &'a Format,
    findings: &mut Findings,
) -> Option<(Head, Lines<'a>)> {
    open_part(source, Part::WHOLE, format, findings)
}

/// Reads the head of a table in a text; `None` after the problem was reported.
pub(crate) fn open_part<'a>(
    source: impl Read + 'a,
    part: Part,
    format: &'a Format,
    findings: &mut Findings,
) -> Option<(Head, Lines<'a>)> {
    let mut input = LineReader::new(source);
    let ahead = input.skip_to(part.from, is_mark).and_then(|marked| Ok((input.head(head::LINES)?, marked)));
    let (mut ahead, marked) = match ahead {
        Ok(lines) => lines,
        Err(e) => {
            return findings.refuse(format.header, None, format!("cannot be read: {e}"), "write plain CSV");
        }
    };
    ahead.retain(|(line, _)| part.last.is_none_or(|last| *line <= last));
    if let Some((number, line)) = ahead.first() {
        if foreign::report(line, findings) {
            return None;
        }
        if let Some(at) = line.iter().position(|byte| *byte == 0) {
            not_text(Some(*number), at, 0, findings);
            return None;
        }
    }
    let found = head::find(&ahead, format.preamble);
    if found.is_none() && format.preamble {
        return findings.refuse(format.header, None, "is empty".to_owned(), format.expected);
    }
    let mut head = found.unwrap_or_else(|| Head { next: ahead.len(), ..Head::without_names(1, b',') });
    let simulated = ahead.drain(..head.next).fold(marked, |marked, (_, line)| marked | is_mark(&line));
    head.find_filled(&ahead);
    if let Some((line, message, help)) = head.ambiguous_commas(&ahead).filter(|_| format.preamble) {
        return findings.refuse(format.value, Some(line), message, &help);
    }
    if let Some(line) = cut_clock(&head, &ahead).filter(|_| format.preamble) {
        let message = "has a comma before the decimals of the times, and commas between the columns, too".to_owned();
        let help = "export with a point in the times, as in `10:00:01.123`, or with semicolons between the columns";
        return findings.refuse(format.value, Some(line), message, help);
    }
    if format.preamble {
        head.drop_unfit_names(&ahead);
    }
    let first = ahead.iter().find(|(_, line)| has_fields(line)).filter(|_| head.names.is_empty());
    let count = first.map_or(head.names.len(), |(_, row)| split(row, head.separator).len());
    input.put_back(ahead);
    let lines = Lines {
        format,
        names: head.names.clone(),
        sorted: sorted(&head.names),
        count,
        separator: head.separator,
        clock: None,
        dates: None,
        simulated,
        last: part.last,
        input,
    };
    Some((head, lines))
}

/// The first line of samples if each has a field more than names, because a comma divides its time of day, as in
/// `10:00:01,123`.
fn cut_clock(head: &Head, lines: &[Line]) -> Option<usize> {
    let is_cut = |(_, line): &&Line| {
        let fields = split(line, head.separator);
        let is_clock = |field| clock(&decoded(field)).is_some() && !field.contains(&b'.');
        let is_thousandths = |field: &[u8]| field.len() == 3 && field.iter().all(u8::is_ascii_digit);
        fields.len() == head.names.len() + 1
            && fields.windows(2).any(|pair| is_clock(pair[0]) && is_thousandths(pair[1]))
    };
    let mut rows = lines.iter().filter(|(_, line)| has_fields(line));
    let first = rows.next().filter(|_| head.separator == b',').filter(is_cut)?;
    rows.all(|row| is_cut(&row)).then_some(first.0)
}

/// The names that are not empty, in their order of letters.
fn sorted(names: &[String]) -> Vec<String> {
    let mut names: Vec<String> = names.iter().filter(|name| !name.is_empty()).cloned().collect();
    names.sort_unstable();
    names
}

/// Whether a line of `text` below its names has a value in column `at`.
pub(crate) fn has_values(text: &str, head: &Head, at: usize) -> bool {
    let text = text.replace("\r\n", "\n");
    let lines = text.split(['\n', '\r']).skip(head.line).map(str::as_bytes).filter(|line| has_fields(line));
    lines.map(|line| split(line, head.separator)).any(|fields| fields.get(at).is_some_and(|field| !field.is_empty()))
}

/// Where the columns of a record come from.
pub(crate) enum Content<'a> {
    /// A table of a text.
    Text(Box<dyn Read + 'a>, Part),
    /// Names and values of equal length, and comments.
    Arrays(Vec<(String, Vec<f64>)>, String),
}

/// Reads the columns of a record.
pub(crate) type Reader<'a> = Box<dyn FnOnce(&[Column], &mut Findings) -> Samples + 'a>;

impl<'a> Content<'a> {
    /// Curves and sweeps of a text, as in [`Part`].
    pub(crate) fn curves(&self) -> [usize; 2] {
        if let Self::Text(_, part) = self { [part.curves, part.sweeps] } else { [0; 2] }
    }

    /// Rows of numbers.
    pub(crate) fn rows(&self) -> usize {
        match self {
            Self::Text(_, part) => part.rows,
            Self::Arrays(arrays, _) => arrays.first().map_or(0, |(_, values)| values.len()),
        }
    }

    /// The names, and what reads the columns below them; `None` after the problem was reported.
    pub(crate) fn open(self, format: &'static Format, findings: &mut Findings) -> Option<(Head, Reader<'a>)> {
        match self {
            Self::Text(text, part) => {
                let (head, lines) = open_part(text, part, format, findings)?;
                Some((head, Box::new(|wanted, findings| lines.read(wanted, findings))))
            }
            Self::Arrays(arrays, comment) => Some((
                Head::of_arrays(&arrays),
                Box::new(move |wanted, findings| of_arrays(&arrays, &comment, wanted, findings)),
            )),
        }
    }
}

/// The columns `wanted` of arrays, with the line numbers that they have as CSV.
fn of_arrays(arrays: &[(String, Vec<f64>)], comment: &str, wanted: &[Column], findings: &mut Findings) -> Samples {
    let mut rows = arrays.first().map_or(0, |(_, values)| values.len());
    if rows > MAX_SAMPLES {
        rows = 0;
        RECORD.report_too_many(None, findings);
    }
    let columns = wanted.iter().map(|Column { at, name, conversion }| {
        let values = arrays[*at].1.iter().take(rows).enumerate();
        let finite = values.map(|(row, value)| {
            if !value.is_finite() {
                return RECORD.report_not_finite(row + 2, name, &value.to_string(), findings);
            }
            conversion.apply(*value)
        });
        finite.collect()
    });
    let columns = columns.collect();
    let simulated = comment.lines().any(|line| is_mark(format!("#{line}").as_bytes()));
    Samples { lines: LineNumbers::consecutive(2, rows), columns, simulated }
}

const ONE_EACH: &str = "one value to each column, a point as decimal sign";

/// Reports an invalid byte `byte` at position `at` of its line.
fn not_text(line: Option<usize>, at: usize, byte: u8, findings: &mut Findings) {
    let message = format!("is not a text file in UTF-8: byte {at} of the line is 0x{byte:02x}");
    findings.add(codes::RECORD_NOT_TEXT, line, message, "export the record as CSV text in UTF-8");
}

impl Lines<'_> {
    /// The columns `wanted`.
    pub(crate) fn read(mut self, wanted: &[Column], findings: &mut Findings) -> Samples {
        let mut lines = LineNumbers::default();
        let mut columns = vec![Vec::new(); wanted.len()];
        let mut signs = Signs::new(self.separator, wanted.len());
        let mut text = Vec::new();
        loop {
            interrupt::point();
            let line = match self.input.next(&mut text) {
                Ok(Some(line)) if self.last.is_none_or(|last| line <= last) => line,
                Ok(_) => break,
                Err(e) => {
                    findings.add(self.format.value, None, format!("cannot be read on: {e}"), "write plain CSV");
                    break;
                }
            };
            if !has_fields(&text) {
                self.simulated |= is_mark(&text);
                self.check_comment(&text, line, findings);
                continue;
            }
            if lines.len() == MAX_SAMPLES {
                self.format.report_too_many(Some(line), findings);
                break;
            }
            lines.push(line);
            let fields = split(&text, self.separator);
            if let Some([message, help]) = self.format.whole_line {
                let number = |field: &&[u8]| self.finite(field).is_some();
                if fields.len() != self.count || !fields.iter().all(number) {
                    findings.add(self.format.value, Some(line), message.to_owned(), help);
                    columns.iter_mut().for_each(|column| column.push(f64::NAN));
                    continue;
                }
            }
            if let Some(help) = self.misaligned(&fields) {
                let message = format!("has {} values, expected {}", fields.len(), self.count);
                findings.add(self.format.value, Some(line), message, help);
                columns.iter_mut().for_each(|column| column.push(f64::NAN));
                continue;
            }
            for (k, (column, wanted)) in columns.iter_mut().zip(wanted).enumerate() {
                column.push(self.number(&fields, (line, k), wanted, &mut signs, findings));
            }
            signs.look_at(&fields);
        }
        if let Some((column, line, text, is_likely)) = signs.doubt() {
            self.format.report_doubt(line, wanted[column].name, (text, is_likely), findings);
        }
        Samples { lines, columns, simulated: self.simulated }
    }

    /// Help for a row whose fields do not match the columns.
    fn misaligned(&self, fields: &[&[u8]]) -> Option<&'static str> {
        // Without names, a shorter row is one of another kind, whatever separates its fields.
        let separator = if self.names.is_empty() { head::BLANK } else { self.separator };
        let is_long = fields.len() > self.count && !self.format.longer_lines;
        is_long.then_some(ONE_EACH).or_else(|| misaligned(fields, self.count, separator))
    }

    /// Refuses a comment between the rows that names the columns in another order than the header, or other ones.
    fn check_comment(&self, comment: &[u8], line: usize, findings: &mut Findings) {
        let own = names_of(comment);
        if own.len() < 2 || self.names.is_empty() {
            return;
        }
        let pairs = || own.iter().zip(&self.names);
        let has_units = own.iter().filter(|name| names::has_unit(name)).count() > 1;
        let has_others = has_units && pairs().any(|(own, name)| !own.is_empty() && !names::are_alike(own, name));
        if has_others || pairs().any(|(own, name)| own != name) && sorted(&own) == self.sorted {
            let message =
                format!("a comment names the columns below it otherwise than the header: `{}`", own.join(","));
            let help = "write these rows into a file of their own";
            findings.add(self.format.header, Some(line), message, help);
        }
    }

    fn finite(&self, field: &[u8]) -> Option<f64> {
        let (value, _) = number::number(std::str::from_utf8(field).ok()?, self.separator)?;
        Some(value).filter(|value| value.is_finite())
    }

    /// The number in a field in the unit of the quantity, or NaN after the problem was reported.
    fn number(
        &mut self,
        fields: &[&[u8]],
        (line, k): (usize, usize),
        column: &Column,
        signs: &mut Signs,
        findings: &mut Findings,
    ) -> f64 {
        let (format, name) = (self.format, column.name);
        let Some(&field) = fields.get(column.at) else {
            let message = format!("`{name}` is missing: the line is too short");
            findings.add(format.value, Some(line), message, "complete or delete the line");
            return f64::NAN;
        };
        let bad = std::str::from_utf8(field).err().map(|e| e.valid_up_to());
        if let Some(at) = bad.or_else(|| field.iter().position(|byte| *byte == 0)) {
            not_text(Some(line), at, field[at], findings);
            return f64::NAN;
        }
        let text = decoded(field);
        let time = clock(&text);
        let is_clock = time.is_some();
        if let Some(time) = time.filter(|_| name == TIME) {
            return self.since_first(time, fields).unwrap_or_else(|| {
                let message = format!("the date or the zone of `{text}` is another one, and does not say by how much");
                let help = "write times in s, or in one zone with dates such as 2024-03-05";
                findings.add(format.value, Some(line), message, help);
                f64::NAN
            });
        }
        match number::number(&text, self.separator).filter(|_| !is_clock) {
            Some((value, _)) if !value.is_finite() => return format.report_not_finite(line, name, &text, findings),
            Some((value, sign)) => {
                if signs.add(k, line, &text, sign) {
                    return column.conversion.apply(value);
                }
                let message = format!("`{name}` is `{text}`: the numbers above have another decimal sign");
                findings.add(format.value, Some(line), message, "write all numbers with the same decimal sign");
            }
            None if text.is_empty() => {
                let message = format!("`{name}` is empty");
                findings.add(format.value, Some(line), message, "complete or delete the line");
            }
            None => {
                let shown: String = text.chars().take(40).collect();
                let message = format!("`{name}` is `{shown}`, which is not a number");
                let help = if number::is_grouped(&text) {
                    "export without a sign between thousands"
                } else {
                    "write a plain number with a decimal point, such as -12.5e-3"
                };
                findings.add(format.value, Some(line), message, help);
            }
        }
        f64::NAN
    }

    /// Time of a row since the first, s; none if that is not known.
    fn since_first(&mut self, time: Clock, fields: &[&[u8]]) -> Option<f64> {
        let places = || (0..fields.len()).filter(|at| is_date(fields[*at])).collect();
        let dates: Vec<&[u8]> =
            self.dates.get_or_insert_with(places).iter().filter_map(|at| fields.get(*at).copied()).collect();
        let time = time.with_dates(&dates);
        self.clock.get_or_insert_with(|| SinceFirst::new(time.clone())).seconds(time)
    }
}

impl Format {
    /// Reports NaN or infinity; returns NaN.
    pub(crate) fn report_not_finite(&self, line: usize, name: &str, shown: &str, findings: &mut Findings) -> f64 {
        let (code, help) = self.not_finite;
        findings.add(code, Some(line), format!("`{name}` is `{shown}`, not a finite number"), help);
        f64::NAN
    }

    /// Reports a sign that may divide thousands, and whether that is likely.
    fn report_doubt(&self, line: usize, name: &str, (text, is_likely): (&str, bool), findings: &mut Findings) {
        let sign = if text.contains(',') { "comma" } else { "point" };
        if !is_likely {
            let message = format!("`{name}` is `{text}`: the {sign} is read as the decimal sign");
            let help = "if it divides thousands, export without a sign between thousands";
            return findings.add(codes::RECORD_PART, Some(line), message, help);
        }
        let message =
            format!("`{name}` is `{text}`: the {sign} may divide thousands, and no number shows that it does not");
        let help = "export without a sign between thousands, and with a point and four decimals";
        findings.add(self.value, Some(line), message, help);
    }

    fn report_too_many(&self, line: Option<usize>, findings: &mut Findings) {
        let message = format!("has more than {MAX_SAMPLES} samples");
        let help = "record at a lower rate, or keep every n-th sample";
        findings.add(codes::RECORD_TOO_LARGE, line, message, help);
    }
}

impl<'a> Column<'a> {
    /// A column in the unit of the quantity.
    pub(crate) const fn plain(at: usize, name: &'a str) -> Self {
        Self { at, name, conversion: Conversion::unit(1.0) }
    }
}
