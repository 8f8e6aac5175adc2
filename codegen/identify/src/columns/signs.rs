//! The decimal sign of a file, which may divide thousands instead.

use super::number::{clock, number};
use specgen_language::quantity::may_divide_thousands;

/// The signs of the numbers so far.
#[derive(Debug)]
pub(super) struct Signs {
    separator: u8,
    /// Of the first number that has one.
    sign: Option<char>,
    /// Whether a number shows that it is the decimal sign, as `0,5` and `1,25` do.
    is_decimal: bool,
    /// Whether a number of four digits or more shows that nothing divides thousands.
    is_undivided: bool,
    /// Whether a time of day has decimals behind a comma.
    has_comma_clock: bool,
    columns: Vec<ColumnSigns>,
}

/// What the numbers of a column show.
#[derive(Debug, Clone, Default)]
struct ColumnSigns {
    /// Line and text of the first one such as `21,484`.
    doubtful: Option<(usize, String)>,
    /// Whether one has no sign.
    has_whole: bool,
}

impl Signs {
    pub(super) fn new(separator: u8, columns: usize) -> Self {
        let columns = vec![ColumnSigns::default(); columns];
        Self { separator, sign: None, is_decimal: false, is_undivided: false, has_comma_clock: false, columns }
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
        if self.is_decimal || self.is_undivided {
            return;
        }
        for text in fields.iter().filter_map(|field| std::str::from_utf8(field).ok()) {
            let digits = text.trim_start_matches(['+', '-']);
            self.is_undivided |= digits.len() > 3 && digits.bytes().all(|byte| byte.is_ascii_digit());
            self.has_comma_clock |= text.contains(',') && clock(text).is_some();
            self.is_decimal |= self.sign.is_some_and(|sign| {
                number(text, self.separator).is_some_and(|(_, own)| own == Some(sign))
                    && !may_divide_thousands(text, sign)
            });
        }
    }

    /// Column, line and text of a number whose sign may divide thousands, and whether that is likely: then the numbers below
    /// 1000 have no sign, or it is a comma where nothing shows decimal commas. Between commas a point divides nothing.
    pub(super) fn doubt(&self) -> Option<(usize, usize, &str, bool)> {
        let is_comma = self.sign.filter(|_| !self.is_decimal && !self.is_undivided)? == ',';
        if is_comma && self.has_comma_clock || !is_comma && self.separator == b',' {
            return None;
        }
        let all = || {
            self.columns.iter().enumerate().filter_map(|(at, seen)| {
                let (line, text) = seen.doubtful.as_ref()?;
                Some((at, *line, text.as_str(), seen.has_whole || is_comma && self.separator != b';'))
            })
        };
        all().find(|(.., is_likely)| *is_likely).or_else(|| all().next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_divides_thousands_unless_a_field_shows_that_it_does_not() {
        for (separator, rows, doubt) in [
            (b';', &["10:00:00,100;5,000", "10:00:00,200;20,000"][..], None),
            (b';', &["0;5,000", "1;20,000"], Some(("5,000", false))),
            (b';', &["0;999", "1;20,000"], Some(("20,000", true))),
            (b';', &["10:00:00,100;999", "10:00:00,200;20,000"], None),
            (b';', &["10:00:00,100;999", "10:00:00,200;20.000"], Some(("20.000", true))),
            (b'\t', &["0\t5,000", "1\t20,000"], Some(("5,000", true))),
            (b'\t', &["1000\t7", "1001\t20,000"], None),
            (b'\t', &["-1000\t7", "1\t20,000"], None),
            (b'\t', &["0,5\t7", "1\t20,000"], Some(("20,000", true))),
            (b'\t', &["0\t20,000", "0,5\t7"], None),
            (b'\t', &["0\t999", "1\t20.000"], Some(("20.000", true))),
            (b'\t', &["0\t5.000", "1\t20.000"], Some(("5.000", false))),
            (b'\t', &["0.000\t999", "0.001\t20.000"], None),
            (b',', &["0,999", "1,20.000"], None),
        ] {
            let mut signs = Signs::new(separator, 1);
            for (line, row) in rows.iter().enumerate() {
                let fields: Vec<&str> = row.split(char::from(separator)).collect();
                let (_, sign) = number(fields[1], separator).unwrap();
                assert!(signs.add(0, line, fields[1], sign), "{row}");
                signs.look_at(&fields.iter().map(|field| field.as_bytes()).collect::<Vec<_>>());
            }
            assert_eq!(signs.doubt().map(|(_, _, text, is_likely)| (text, is_likely)), doubt, "{rows:?}");
        }
    }
}
