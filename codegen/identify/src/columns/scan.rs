//! The tables of numbers in a text, found by their rows: a table ends where lines without numbers precede further rows.

use std::io::Read;

use super::head::{self, Line, decoded, has_fields, is_row, is_rule, names_of, separator_of, split};
use super::lines::LineReader;
use super::number::{is_grouped, number};
use crate::tables::Extent;
use specgen_language::interrupt;

/// The lines of a text that belong to a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Part {
    /// The first one, from 1: names and comments precede the rows.
    pub(crate) from: usize,
    /// The last row; none for the last table of a text.
    pub(crate) last: Option<usize>,
    /// Number of its rows; 0 if they were not counted.
    pub(crate) rows: usize,
    /// Parts between blank lines in which the first column always changes in the same direction; 0 if any does not.
    pub(crate) curves: usize,
    /// Rises of the first column, or falls, if between all of them it goes back in one step, without a blank line.
    pub(crate) sweeps: usize,
    /// Number of the lines behind the last table that look like rows, and the first of them.
    pub(crate) behind: (usize, usize),
}

impl Part {
    /// A text that is not divided.
    pub(crate) const WHOLE: Self = Self { from: 1, last: None, rows: 0, curves: 0, sweeps: 0, behind: (0, 0) };
}

/// Most tables of a text.
pub(crate) const MOST_TABLES: usize = 10_000;

/// Rows of a part between blank lines that are a curve.
const CURVE: usize = 3;

/// A table that is being read.
struct Open {
    part: Part,
    extent: Extent,
    separator: u8,
    last: usize,
    curve: Curve,
    /// Curves with a rising and with a falling first column, and others.
    curves: [usize; 3],
    sweeps: Sweeps,
}

/// Runs of the first column in one direction.
#[derive(Default)]
struct Sweeps {
    rises: Option<bool>,
    /// First value of the last run, and steps in it.
    start: f64,
    steps: usize,
    /// Steps back.
    back: usize,
    /// Whether it turned, did not change, or began again with the same value, as times do.
    others: bool,
}

impl Sweeps {
    fn add(&mut self, last: f64, value: f64) {
        let step = value - last;
        if self.rises.is_none() {
            self.start = last;
        }
        let rises = *self.rises.get_or_insert(step > 0.0);
        if step != 0.0 && (step > 0.0) == rises {
            self.steps += 1;
        } else {
            // A curve has several rows.
            self.others |= step == 0.0 || self.steps + 1 < CURVE || value == self.start;
            self.start = value;
            self.back += 1;
            self.steps = 0;
        }
    }

    fn count(&self) -> usize {
        if self.others || self.back == 0 { 0 } else { self.back + 1 }
    }
}

/// Rows since the last blank line.
#[derive(Default)]
struct Curve {
    rows: usize,
    last: f64,
    steps: [bool; 3],
}

/// The tables of a text, in their order, at most one more than [`MOST_TABLES`]; none if it is not one.
pub(crate) fn tables(source: impl Read) -> Vec<(Part, Extent)> {
    let mut input = LineReader::new(source);
    let mut tables: Vec<Open> = Vec::new();
    // Lines without numbers since the last row.
    let mut between: Vec<Line> = Vec::new();
    let mut line = Vec::new();
    // An error is reported when the table is read.
    while let Ok(Some(at)) = input.next(&mut line) {
        interrupt::point();
        if line.contains(&0) {
            return Vec::new();
        }
        let last = tables.last_mut().filter(|_| between.is_empty());
        match last {
            Some(table) if !has_fields(&line) => table.end_curve(),
            Some(table) if table.has_row(&line) => table.add(at, &line),
            Some(table) if is_text(&line, table.separator, table.curve.rows == 0) => {
                table.count_behind(at, &line);
                between.push((at, std::mem::take(&mut line)));
            }
            // A row with a mistake.
            Some(_) => {}
            None => match separator_of(&line).filter(|_| has_fields(&line)) {
                Some(separator) => {
                    between.push((at, std::mem::take(&mut line)));
                    let from = tables.last().map_or(1, |table| table.last + 1);
                    tables.push(Open::new(from, separator, &between));
                    between.clear();
                    if tables.len() > MOST_TABLES {
                        break;
                    }
                }
                None if has_fields(&line) => {
                    tables.last_mut().into_iter().for_each(|table| table.count_behind(at, &line));
                    if between.len() < head::LINES {
                        between.push((at, std::mem::take(&mut line)));
                    }
                }
                None => {}
            },
        }
    }
    let count = tables.len();
    tables.iter_mut().rev().skip(1).for_each(|table| table.part.behind = (0, 0));
    let ends = between.is_empty();
    tables.into_iter().enumerate().map(|(k, table)| table.finish(ends && k + 1 == count)).collect()
}

/// Whether a line is about the rows below it, or ends the table, and is not a row with a mistake: that has a number, and
/// behind a blank line it begins with one.
fn is_text(line: &[u8], separator: u8, is_behind_blank: bool) -> bool {
    let is_number = |field: &&[u8]| {
        let text = decoded(field);
        number(&text, separator).is_some() || is_grouped(&text)
    };
    let fields = split(line, separator);
    let count = if is_behind_blank { 1 } else { fields.len() };
    !fields.iter().take(count).any(is_number)
}

impl Open {
    /// A table whose first row is the last of `lines`.
    fn new(from: usize, separator: u8, lines: &[Line]) -> Self {
        let (first, row) = lines.last().map_or((from, &[][..]), |(at, row)| (*at, row.as_slice()));
        let columns = head::find(lines, true).map(|head| head.names).unwrap_or_default();
        let title = lines.iter().map(|(_, line)| line).find(|line| !is_row(line, separator));
        let title = title.filter(|line| names_of(line) != columns).map_or_else(String::new, |line| decoded(line));
        let name = title.trim().chars().take(40).collect();
        let mut table = Self {
            part: Part { from, ..Part::WHOLE },
            extent: Extent { name, rows: 0, columns, first_line: Some(first) },
            separator,
            last: first,
            curve: Curve::default(),
            curves: [0; 3],
            sweeps: Sweeps::default(),
        };
        table.add(first, row);
        table
    }

    /// Whether a line is one of its rows: quickly, as every line of a long text is looked at.
    fn has_row(&self, line: &[u8]) -> bool {
        let is_part = |byte: &u8| {
            matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b',' | b'e' | b'E' | b' ' | b'\t' | b';' | b'\r')
        };
        let is_drawn = || is_rule(line) && !line.trim_ascii().iter().any(u8::is_ascii_whitespace);
        line.iter().all(is_part) && !is_drawn() || is_row(line, self.separator)
    }

    /// Counts a line behind the table if it begins with a number or has two.
    fn count_behind(&mut self, at: usize, line: &[u8]) {
        let numbers = split(line, self.separator).into_iter().map(|field| number(&decoded(field), self.separator));
        let numbers: Vec<bool> = numbers.map(|number| number.is_some()).collect();
        if numbers.first() == Some(&true) || numbers.iter().filter(|is| **is).count() > 1 {
            let (count, first) = &mut self.part.behind;
            *first = if *count == 0 { at } else { *first };
            *count += 1;
        }
    }

    fn add(&mut self, at: usize, line: &[u8]) {
        self.extent.rows += 1;
        self.last = at;
        self.curve.rows += 1;
        // Without a blank line there is one curve, whatever its direction.
        let first = split(line, self.separator).first().and_then(|field| number(&decoded(field), self.separator));
        if let Some((value, _)) = first {
            if self.extent.rows > 1 {
                self.sweeps.add(self.curve.last, value);
            }
            if self.curve.rows > 1 {
                let step = usize::from(value <= self.curve.last) + usize::from(value == self.curve.last);
                self.curve.steps[step] = true;
            }
            self.curve.last = value;
        }
    }

    fn end_curve(&mut self) {
        let Curve { rows, steps, last } = std::mem::take(&mut self.curve);
        self.curve.last = last;
        match steps {
            _ if rows < CURVE => {}
            [true, false, false] => self.curves[0] += 1,
            [false, true, false] => self.curves[1] += 1,
            _ => self.curves[2] += 1,
        }
    }

    fn finish(mut self, is_last: bool) -> (Part, Extent) {
        self.end_curve();
        let curves = match self.curves {
            [curves, 0, 0] | [0, curves, 0] => curves,
            _ => 0,
        };
        let rows = self.extent.rows;
        (
            Part { last: (!is_last).then_some(self.last), rows, curves, sweeps: self.sweeps.count(), ..self.part },
            self.extent,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First and last line, rows, name and columns of a table.
    type Table = (usize, Option<usize>, usize, String, Vec<String>);

    fn found(text: &str) -> Vec<Table> {
        let all = tables(text.as_bytes()).into_iter();
        all.map(|(part, extent)| (part.from, part.last, extent.rows, extent.name, extent.columns)).collect()
    }

    #[test]
    fn lines_without_numbers_divide_a_text_into_tables() {
        let names = |names: &str| names.split(',').map(str::to_owned).collect::<Vec<_>>();
        let text = "Report\nR,C\n10,2\n\nRun 1\nt,U\n0,1\n1,2\n\n2,3\nRun 2\nt,U\n0,1\n";
        assert_eq!(
            found(text),
            [
                (1, Some(3), 1, "Report".to_owned(), names("R,C")),
                (4, Some(10), 3, "Run 1".to_owned(), names("t,U")),
                (11, None, 1, "Run 2".to_owned(), names("t,U")),
            ]
        );
        // Mistakes in rows divide nothing, and texts behind the last one end a table.
        assert_eq!(found("t,U\n0,1\n1,x\n2,3\n"), [(1, None, 2, String::new(), names("t,U"))]);
        for end in ["end of file\n", "\nMean,1.5\n"] {
            let text = format!("t,U\n0,1\n1,x\n2,3\n{end}");
            assert_eq!(found(&text), [(1, Some(4), 2, String::new(), names("t,U"))], "{end}");
        }
        for rule in ["+---+---+", "-----"] {
            let text = format!("t,U\n0,1\n2,3\n{rule}\n");
            assert_eq!(found(&text), [(1, Some(3), 2, String::new(), names("t,U"))], "{rule}");
        }
        assert_eq!(found("0 1\n\n\"\"\n").len(), 1);
        assert!(found("t,U\n0,\0\n").is_empty() && found("").is_empty());
    }

    #[test]
    fn lines_behind_the_table_that_look_like_rows_are_counted() {
        let behind = |text: &str| tables(text.as_bytes()).into_iter().map(|(part, _)| part.behind).collect::<Vec<_>>();
        assert_eq!(behind("t,U\n0,1\noverload\n1,2,OVL\nnote,5\n\nup,3,4\n3,OVL\n"), [(3, 4)]);
        assert_eq!(behind("t,U\n0,1\nMean,1\nend\n"), [(0, 0)]);
        assert_eq!(behind("t,U\n0,1\noverload\n1,2,OVL\n2,3\n"), [(0, 0), (0, 0)]);
    }

    #[test]
    fn curves_in_one_direction_are_counted() {
        let curve = |first: i32, step: i32| (0..5).map(|k| format!("{},{k}\n", first + k * step)).collect::<String>();
        let curves = |text: &str| tables(text.as_bytes())[0].0.curves;
        let rises = [curve(0, 1), curve(-1, 1), curve(-2, 1)];
        assert_eq!(curves(&rises.join("\n")), 3);
        assert_eq!(curves(&rises.concat()), 0);
        let sweeps = |text: &str| tables(text.as_bytes())[0].0.sweeps;
        assert_eq!([sweeps(&rises.concat()), sweeps(&curve(0, 1))], [3, 0]);
        // A drive that returns or rests, and times.
        assert_eq!(sweeps(&[curve(0, 1), curve(4, -1), curve(0, 1)].concat()), 0);
        assert_eq!(sweeps(&format!("{}4,4\n{}", curve(0, 1), curve(0, 1))), 0);
        assert_eq!(sweeps(&curve(0, 1).repeat(3)), 0);
        assert_eq!(curves(&[curve(0, 1), curve(4, -1), curve(0, 1)].join("\n")), 0);
        // A point between the curves, as magnetometers record their drift.
        assert_eq!(curves(&rises.join("\n9,0\n\n")), 3);
    }
}
