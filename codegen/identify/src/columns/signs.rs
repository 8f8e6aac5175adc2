//! The decimal sign of a file, which may divide thousands instead.

use super::number::number;
use specgen_language::quantity::may_divide_thousands;

/// The signs of the numbers so far.
#[derive(Debug)]
pub(super) struct Signs {
    separator: u8,
    /// Of the first number that has one.
    sign: Option<char>,
    /// Whether a number shows that it is the decimal sign, as `0,5` and `1,25` do.
    is_decimal: bool,
    columns: Vec<Seen>,
}

/// What the numbers of a column show.
#[derive(Debug, Clone, Default)]
struct Seen {
    /// Line and text of the first one such as `21,484`.
    doubtful: Option<(usize, String)>,
    /// Whether one has no sign.
    has_whole: bool,
}

impl Signs {
    pub(super) fn new(separator: u8, columns: usize) -> Self {
        Self { separator, sign: None, is_decimal: false, columns: vec![Seen::default(); columns] }
    }

    /// Adds a number of a column; returns whether its sign is that of the numbers before it.
    pub(super) fn add(&mut self, column: usize, line: usize, text: &str, sign: Option<char>) -> bool {
        let seen = &mut self.columns[column];
        let Some(sign) = sign else {
            seen.has_whole = true;
            return true;
        };
        if !self.is_decimal {
            if may_divide_thousands(text, sign) {
                seen.doubtful.get_or_insert_with(|| (line, text.to_owned()));
            } else {
                self.is_decimal = true;
            }
        }
        *self.sign.get_or_insert(sign) == sign
    }

    /// Looks at every field of a row, those of other columns as well, while there is a doubt.
    pub(super) fn look_at(&mut self, fields: &[&[u8]]) {
        let Some(sign) = self.sign.filter(|_| !self.is_decimal) else { return };
        let is_decimal = |text: &str| {
            number(text, self.separator).is_some_and(|(_, own)| own == Some(sign)) && !may_divide_thousands(text, sign)
        };
        self.is_decimal = fields.iter().any(|field| std::str::from_utf8(field).is_ok_and(is_decimal));
    }

    /// Column, line and text of a number whose sign may divide thousands. A point does so where semicolons separate the
    /// columns, and then not in the numbers below 1000.
    pub(super) fn doubt(&self) -> Option<(usize, usize, &str)> {
        let is_point = self.sign.filter(|_| !self.is_decimal)? == '.';
        if is_point && self.separator != b';' {
            return None;
        }
        let mut columns = self.columns.iter().enumerate().filter(|(_, seen)| !is_point || seen.has_whole);
        columns.find_map(|(at, seen)| seen.doubtful.as_ref().map(|(line, text)| (at, *line, text.as_str())))
    }
}
