//! Reads columns of numbers from CSV text: a header that names them, values between commas, comments behind `#`. How the
//! mistakes of a kind of file are called stands in its [`Format`].

use super::findings::Findings;
use specgen_language::diagnostic::{Code, codes};

/// What a kind of file calls its mistakes.
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
    /// Message and help for any line without a finite number in every column, instead of what is wrong with each value.
    pub(crate) whole_line: Option<[&'static str; 2]>,
}

/// Records of the bench.
pub(crate) const RECORD: Format = Format {
    header: codes::RECORD_HEADER,
    value: codes::RECORD_VALUE,
    not_finite: (codes::RECORD_NOT_FINITE, "delete the sample, or record again"),
    longer_lines: true,
    whole_line: None,
};

/// The header of a file.
#[derive(Debug)]
pub(crate) struct Header {
    /// Names of the columns, without white space around them.
    pub(crate) names: Vec<String>,
    /// Its line, counted from 1.
    pub(crate) line: usize,
}

/// The lines behind the header.
pub(crate) struct Lines<'a> {
    format: &'a Format,
    names: usize,
    reader: csv::Reader<&'a [u8]>,
}

/// Reads the header; `None` after the problem was reported.
pub(crate) fn open<'a>(text: &'a str, format: &'a Format, findings: &mut Findings) -> Option<(Header, Lines<'a>)> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map(|header| Header {
        names: header.iter().map(str::to_owned).collect(),
        line: header.position().map_or(1, |p| p.line() as usize),
    });
    match header {
        Ok(header) => {
            let names = header.names.len();
            Some((header, Lines { format, names, reader }))
        }
        Err(e) => {
            findings.add(format.header, Some(1), format!("the header cannot be read: {e}"), "write plain CSV");
            None
        }
    }
}

impl Header {
    /// The place of the column `name`, in upper or lower case; `None` after two of that name were reported. If there is none
    /// and a help is given, it is reported, too.
    pub(crate) fn place(&self, name: &str, help: Option<&str>, findings: &mut Findings) -> Option<usize> {
        let same = |k: &usize| self.names[*k].eq_ignore_ascii_case(name);
        let matching: Vec<usize> = (0..self.names.len()).filter(same).collect();
        match (&matching[..], help) {
            ([only], _) => return Some(*only),
            ([first, second, ..], _) => {
                let message = format!("column `{name}` appears twice, as columns {} and {}", first + 1, second + 1);
                findings.add(codes::RECORD_COLUMN_TWICE, Some(self.line), message, "keep one of them");
            }
            ([], Some(help)) => {
                let present: Vec<String> = self.names.iter().map(|name| format!("`{name}`")).collect();
                let message = format!("column `{name}` is missing; the header has {}", present.join(", "));
                findings.add(codes::RECORD_HEADER, Some(self.line), message, help);
            }
            ([], None) => {}
        }
        None
    }
}

impl Lines<'_> {
    /// Line numbers, and the values of the columns at `wanted`, each with its name for messages; NaN after the problem with a
    /// value was reported.
    pub(crate) fn read(mut self, wanted: &[(usize, &str)], findings: &mut Findings) -> (Vec<usize>, Vec<Vec<f64>>) {
        let format = self.format;
        let mut lines = Vec::new();
        let mut columns = vec![Vec::new(); wanted.len()];
        for row in self.reader.records() {
            let row = match row {
                Ok(row) => row,
                Err(e) => {
                    let line = e.position().map(|p| p.line() as usize);
                    findings.add(format.value, line, format!("cannot be read as CSV: {e}"), "write plain CSV");
                    continue;
                }
            };
            let line = row.position().map_or(0, |p| p.line() as usize);
            lines.push(line);
            if let Some([message, help]) = format.whole_line {
                let number = |field: &str| field.parse().is_ok_and(f64::is_finite);
                if row.len() != self.names || !row.iter().all(number) {
                    findings.add(format.value, Some(line), message.to_owned(), help);
                    columns.iter_mut().for_each(|column| column.push(f64::NAN));
                    continue;
                }
            }
            for (column, (at, name)) in columns.iter_mut().zip(wanted) {
                column.push(format.number(row.get(*at), line, name, findings));
            }
            if row.len() > self.names && !format.longer_lines {
                let message = format!("has {} values, expected {}", row.len(), self.names);
                findings.add(format.value, Some(line), message, "one value to each column, a point as decimal sign");
            }
        }
        (lines, columns)
    }
}

impl Format {
    /// The number in a field, or NaN after the problem was reported.
    fn number(&self, field: Option<&str>, line: usize, name: &str, findings: &mut Findings) -> f64 {
        let Some(field) = field else {
            let message = format!("`{name}` is missing: the line is too short");
            findings.add(self.value, Some(line), message, "complete or delete the line");
            return f64::NAN;
        };
        match field.parse::<f64>() {
            Ok(x) if x.is_finite() => return x,
            Ok(_) => self.report_not_finite(line, name, field, findings),
            Err(_) => {
                let shown: String = field.chars().take(40).collect();
                let message = format!("`{name}` is `{shown}`, which is not a number");
                let help = "write a plain number with a decimal point, such as -12.5e-3";
                findings.add(self.value, Some(line), message, help);
            }
        }
        f64::NAN
    }

    /// Reports NaN or infinity.
    pub(crate) fn report_not_finite(&self, line: usize, name: &str, shown: &str, findings: &mut Findings) {
        let (code, help) = self.not_finite;
        findings.add(code, Some(line), format!("`{name}` is `{shown}`, not a finite number"), help);
    }
}
