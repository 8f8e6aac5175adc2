//! The unit part of a quantity: products, quotients and powers of units.

use super::decimal::Decimal;
use super::dimension::Dimension;
use super::{Problem, QuantityError, units};

const MAX_NESTING: usize = 4;
const MAX_CONSTANTS: usize = 32;

/// Reads the unit that starts at byte `at` of `text`; a text that ends there has the unit 1.
///
/// # Errors
/// The first error, with its place in `text`.
pub(super) fn parse(text: &str, at: usize) -> Result<Scale, QuantityError> {
    UnitParser { text, at, depth: 0 }.whole()
}

/// Factor of a unit to SI, and its dimension.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    pub(super) dimension: Dimension,
    pub(super) power_of_ten: i64,
    /// Factors other than powers of ten.
    pub(super) times: Vec<Decimal>,
    /// Divisors other than powers of ten.
    pub(super) over: Vec<Decimal>,
}

impl Scale {
    const ONE: Self = Self { dimension: Dimension::NONE, power_of_ten: 0, times: Vec::new(), over: Vec::new() };

    fn multiply(&mut self, other: &Self, power: i8) -> Option<()> {
        self.dimension = self.dimension.times(other.dimension, power)?;
        self.power_of_ten += other.power_of_ten * i64::from(power);
        for _ in 0..power.unsigned_abs() {
            let (times, over) = if power > 0 { (&other.times, &other.over) } else { (&other.over, &other.times) };
            self.times.extend_from_slice(times);
            self.over.extend_from_slice(over);
            // `pi` has no dimension that could overflow, so its powers are bounded here.
            if self.times.len() + self.over.len() > MAX_CONSTANTS {
                return None;
            }
        }
        Some(())
    }
}

struct UnitParser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl UnitParser<'_> {
    fn whole(&mut self) -> Result<Scale, QuantityError> {
        self.skip_spaces();
        if self.at == self.text.len() {
            return Ok(Scale::ONE);
        }
        let scale = self.unit()?;
        if self.at < self.text.len() {
            return self.unexpected();
        }
        Ok(scale)
    }

    fn unit(&mut self) -> Result<Scale, QuantityError> {
        let mut scale = Scale::ONE;
        let mut divided = false;
        let start = self.at;
        self.factor(&mut scale, 1)?;
        loop {
            self.skip_spaces();
            match self.peek() {
                None | Some(')') => return Ok(scale),
                Some('/') => {
                    self.at += 1;
                    self.skip_spaces();
                    self.factor(&mut scale, -1)?;
                    divided = true;
                }
                Some(c) => {
                    if matches!(c, '*' | '\u{b7}' | '\u{22c5}') {
                        self.at += c.len_utf8();
                        self.skip_spaces();
                    }
                    if divided {
                        return Err(QuantityError {
                            range: start..self.text.len(),
                            problem: Problem::AmbiguousQuotient,
                        });
                    }
                    self.factor(&mut scale, 1)?;
                }
            }
        }
    }

    fn factor(&mut self, scale: &mut Scale, direction: i8) -> Result<(), QuantityError> {
        let start = self.at;
        let base = if self.peek() == Some('(') {
            if self.depth == MAX_NESTING {
                return self.unexpected();
            }
            self.depth += 1;
            self.at += 1;
            self.skip_spaces();
            let inner = self.unit()?;
            if self.peek() != Some(')') {
                return self.unexpected();
            }
            self.at += 1;
            self.depth -= 1;
            inner
        } else {
            self.name()?
        };
        let power = self.power()?;
        scale
            .multiply(&base, direction * power)
            .ok_or(QuantityError { range: start..self.at, problem: Problem::BadPower })
    }

    fn name(&mut self) -> Result<Scale, QuantityError> {
        let start = self.at;
        let length =
            self.text[start..].find(|c: char| !(c.is_alphabetic() || c == '°')).unwrap_or(self.text.len() - start);
        if length == 0 {
            return self.unexpected();
        }
        self.at += length;
        let name = &self.text[start..self.at];
        let unit = units::find(name).ok_or_else(|| QuantityError {
            range: start..start + length,
            problem: Problem::UnknownUnit(name.to_owned(), units::suggest(name)),
        })?;
        Ok(Scale {
            dimension: unit.dimension,
            power_of_ten: i64::from(unit.power_of_ten),
            times: unit.constant.iter().map(|c| c.decimal()).collect(),
            over: Vec::new(),
        })
    }

    /// The power of the factor just read: "^2", "^-1", "²"; 1 if none is written.
    fn power(&mut self) -> Result<i8, QuantityError> {
        let start = self.at;
        let rest = &self.text[start..];
        if let Some(after) = rest.strip_prefix('^') {
            let length = after.find(|c: char| !(c.is_ascii_digit() || c == '-')).unwrap_or(after.len());
            self.at += 1 + length;
            return match after[..length].parse::<i8>() {
                Ok(power) if (-9..=9).contains(&power) => Ok(power),
                _ => Err(QuantityError { range: start..self.at, problem: Problem::BadPower }),
            };
        }
        for (mark, power) in [("²", 2), ("³", 3), ("⁻¹", -1), ("⁻²", -2)] {
            if rest.starts_with(mark) {
                self.at += mark.len();
                return Ok(power);
            }
        }
        Ok(1)
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn skip_spaces(&mut self) {
        self.at = self.text.len() - self.text[self.at..].trim_start().len();
    }

    fn unexpected<T>(&self) -> Result<T, QuantityError> {
        let (found, length) = match self.peek() {
            Some(c) => (format!("\"{}\"", c.escape_debug()), c.len_utf8()),
            None => ("the end".to_owned(), 0),
        };
        Err(QuantityError { range: self.at..self.at + length, problem: Problem::Unexpected(found) })
    }
}
