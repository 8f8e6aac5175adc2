//! Typed quantities in text: `"1.195 kg"`, `"3.26e7 g mm^2"`, `"0.012 pi rad"`, `"40 V/ms"`.
//!
//! ```text
//! quantity = number [unit]            number = ["+"|"-"] decimal ["e" exponent]
//! unit     = product {"/" factor}     product = factor {[" "|"*"|"·"] factor}
//! factor   = (name | "(" unit ")") [["^"] power]
//! ```
//! Conversion to SI is exact up to one rounding, unless a divisor other than a power of ten stands in the unit
//! (`V/min`): then the division rounds a second time.

mod decimal;
mod dimension;
mod units;

use std::ops::Range;

pub use decimal::Decimal;
pub use dimension::Dimension;

/// Longer quantities are refused: no sane one comes near.
pub const MAX_LENGTH: usize = 120;

const MAX_NESTING: usize = 4;
const MAX_CONSTANTS: usize = 32;

/// A quantity in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// In SI units (m, kg, s, V, rad, byte).
    pub value: f64,
    /// What it measures.
    pub dimension: Dimension,
}

/// Why a text is not a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantityError {
    /// The bytes of the text that are to blame.
    pub range: Range<usize>,
    /// What is wrong there.
    pub problem: Problem,
}

/// The ways in which a text fails to be a quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum Problem {
    /// Longer than [`MAX_LENGTH`].
    TooLong,
    /// It does not begin with a number.
    NoNumber,
    /// A decimal comma, or commas between thousands.
    Comma,
    /// A unit nobody knows; with what was probably meant.
    UnknownUnit(String, Option<&'static str>),
    /// A product after a slash can be read in two ways.
    AmbiguousQuotient,
    /// A power that is not a whole number from -9 to 9.
    BadPower,
    /// Something that belongs to no quantity, such as a stray slash.
    Unexpected(String),
    /// NaN or infinity.
    NotFinite,
    /// Too large for a double in SI units.
    Overflow,
    /// Not zero, but too small for a double in SI units.
    Underflow,
}

/// Reads a quantity. A text without a unit is a quantity without dimension.
///
/// # Errors
/// The first thing that is wrong, with its place in `text`.
pub fn parse(text: &str) -> Result<Quantity, QuantityError> {
    if text.len() > MAX_LENGTH {
        return Err(QuantityError {
            range: 0..text.len(),
            problem: Problem::TooLong,
        });
    }
    let (negative, number, unit_start) = parse_number(text)?;
    let mut parser = UnitParser {
        text,
        at: unit_start,
        depth: 0,
    };
    let scale = parser.whole()?;

    let mut decimal = number.shifted(scale.power_of_ten);
    for constant in &scale.times {
        decimal = decimal.times(constant);
    }
    let mut value = decimal.to_f64();
    for constant in &scale.over {
        value /= constant.to_f64();
    }
    let everything = 0..text.len();
    if !value.is_finite() {
        return Err(QuantityError {
            range: everything,
            problem: Problem::Overflow,
        });
    }
    if value == 0.0 && !number.is_zero() {
        return Err(QuantityError {
            range: everything,
            problem: Problem::Underflow,
        });
    }
    Ok(Quantity {
        value: if negative { -value } else { value },
        dimension: scale.dimension,
    })
}

/// SI value of one `unit` such as "mm" or "N m/rad"; `None` if it is not a unit.
#[must_use]
pub fn unit_value(unit: &str) -> Option<Quantity> {
    parse(&format!("1 {unit}")).ok()
}

/// Sign, magnitude, and where the unit starts.
fn parse_number(text: &str) -> Result<(bool, Decimal, usize), QuantityError> {
    let fail = |range: Range<usize>, problem| Err(QuantityError { range, problem });
    let start = text.len() - text.trim_start().len();
    let rest = &text[start..];
    // U+2212 is what word processors make of a minus sign.
    let sign_length = match rest.chars().next() {
        Some(sign @ ('+' | '-' | '\u{2212}')) => sign.len_utf8(),
        _ => 0,
    };
    let negative = sign_length > 0 && !rest.starts_with('+');
    let digits_start = start + sign_length;
    let body = &text[digits_start..];
    let word: String = body.chars().take_while(|c| c.is_alphabetic()).collect();
    if matches!(
        word.to_ascii_lowercase().as_str(),
        "nan" | "inf" | "infinity"
    ) {
        return fail(start..digits_start + word.len(), Problem::NotFinite);
    }

    let count = |s: &str| s.bytes().take_while(u8::is_ascii_digit).count();
    let whole = count(body);
    let mut length = whole;
    let mut fraction = 0;
    if body[length..].starts_with('.') {
        fraction = count(&body[length + 1..]);
        length += 1 + fraction;
    }
    if whole + fraction == 0 {
        return fail(start..text.len(), Problem::NoNumber);
    }
    let mut digits = body[..whole].to_owned();
    if fraction > 0 {
        digits.push_str(&body[whole + 1..whole + 1 + fraction]);
    }
    if body[length..].starts_with(',') {
        return fail(
            digits_start + length..digits_start + length + 1,
            Problem::Comma,
        );
    }
    let (exponent, exponent_length) = parse_exponent(&body[length..]);
    length += exponent_length;
    // `fraction` is at most MAX_LENGTH, so that the cast is exact.
    let decimal = Decimal::new(&digits, exponent.saturating_sub(fraction as i64));
    Ok((negative, decimal, digits_start + length))
}

/// Value and length of a leading "e-3"; (0, 0) if the text starts otherwise, as "eV" does.
fn parse_exponent(text: &str) -> (i64, usize) {
    let Some(after) = text.strip_prefix(['e', 'E']) else {
        return (0, 0);
    };
    let (sign, digits) = match after.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, after.strip_prefix('+').unwrap_or(after)),
    };
    let count = digits.bytes().take_while(u8::is_ascii_digit).count();
    if count == 0 {
        return (0, 0);
    }
    // Beyond i64 the value overflows or underflows in any case.
    let magnitude = digits[..count].parse::<i64>().unwrap_or(i64::MAX / 2);
    (sign * magnitude, text.len() - digits.len() + count)
}

/// Factor of a unit to SI, and what it measures.
#[derive(Debug, Clone)]
struct Scale {
    dimension: Dimension,
    power_of_ten: i64,
    times: Vec<Decimal>,
    over: Vec<Decimal>,
}

impl Scale {
    const ONE: Self = Self {
        dimension: Dimension::NONE,
        power_of_ten: 0,
        times: Vec::new(),
        over: Vec::new(),
    };

    fn multiply(&mut self, other: &Self, power: i8) -> Option<()> {
        self.dimension = self.dimension.times(other.dimension, power)?;
        self.power_of_ten += other.power_of_ten * i64::from(power);
        for _ in 0..power.unsigned_abs() {
            let (times, over) = if power > 0 {
                (&other.times, &other.over)
            } else {
                (&other.over, &other.times)
            };
            self.times.extend_from_slice(times);
            self.over.extend_from_slice(over);
            // `pi` has no dimension to run out of range, so that its powers are bounded here.
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
            .ok_or(QuantityError {
                range: start..self.at,
                problem: Problem::BadPower,
            })
    }

    fn name(&mut self) -> Result<Scale, QuantityError> {
        let start = self.at;
        let length = self.text[start..]
            .find(|c: char| !(c.is_alphabetic() || c == '°'))
            .unwrap_or(self.text.len() - start);
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
            let length = after
                .find(|c: char| !(c.is_ascii_digit() || c == '-'))
                .unwrap_or(after.len());
            self.at += 1 + length;
            return match after[..length].parse::<i8>() {
                Ok(power) if (-9..=9).contains(&power) => Ok(power),
                _ => Err(QuantityError {
                    range: start..self.at,
                    problem: Problem::BadPower,
                }),
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
        Err(QuantityError {
            range: self.at..self.at + length,
            problem: Problem::Unexpected(found),
        })
    }
}

#[cfg(test)]
mod tests;
