//! Typed quantities in text: `"1.195 kg"`, `"3.26e7 g mm^2"`, `"0.012 pi rad"`, `"40 V/ms"`.
//!
//! ```text
//! quantity = number [unit]            number = ["+"|"-"] decimal ["e" exponent]
//! unit     = product {"/" factor}     product = factor {[" "|"*"|"·"] factor}
//! factor   = (name | "(" unit ")") [["^"] power]
//! ```
//! Conversion to SI is exact up to one rounding. If the unit has a divisor other than a power of ten (`V/min`), the
//! division rounds a second time.

mod decimal;
mod dimension;
mod unit_parser;
mod units;

use std::ops::Range;

pub use decimal::Decimal;
pub use dimension::Dimension;

/// Longest quantity that is accepted.
pub const MAX_LENGTH: usize = 120;

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
    /// The bytes of the text that are wrong.
    pub range: Range<usize>,
    /// What is wrong there.
    pub problem: Problem,
}

/// Reasons why a text is not a quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum Problem {
    /// Longer than [`MAX_LENGTH`].
    TooLong,
    /// It does not begin with a number.
    NoNumber,
    /// A decimal comma, or commas between thousands.
    Comma,
    /// An unknown unit, and the unit that was probably meant.
    UnknownUnit(String, Option<&'static str>),
    /// A product after a slash can be read in two ways.
    AmbiguousQuotient,
    /// A power that is not a whole number from -9 to 9.
    BadPower,
    /// Text that does not belong to a quantity, such as a stray slash.
    Unexpected(String),
    /// NaN or infinity.
    NotFinite,
    /// Too large for a double in SI units.
    Overflow,
    /// Not zero, but too small for a double in SI units.
    Underflow,
}

/// Units in common use; any other unit of the same dimension is valid, too.
const COMMON: &[&str] = &[
    "m",
    "mm",
    "um",
    "nm",
    "kg",
    "g",
    "rad",
    "mrad",
    "urad",
    "nrad",
    "deg",
    "s",
    "ms",
    "us",
    "Hz",
    "kHz",
    "V",
    "mV",
    "V/ms",
    "V/s",
    "um/V",
    "nm/V",
    "N/m",
    "N/um",
    "N m/rad",
    "N s/m",
    "N m s/rad",
    "N/(m s)",
    "N m/(rad s)",
    "kg m^2",
    "g mm^2",
    "um/s",
    "mm/s",
    "mrad/s",
    "rad/s",
    "mm/s^2",
    "m/s^2",
    "mrad/s^2",
    "rad/s^2",
    "m/s^3",
    "rad/s^3",
    "A",
    "mA",
    "uF",
    "nF",
    "KiB",
    "MiB",
];

/// The usual units of a dimension, for helps and editors.
pub fn common_units(dimension: Dimension) -> impl Iterator<Item = &'static str> {
    COMMON.iter().copied().filter(move |unit| unit_value(unit).is_some_and(|one| one.dimension == dimension))
}

/// Reads a quantity. A text without a unit is a quantity without dimension.
///
/// # Errors
/// The first error, with its place in `text`.
pub fn parse(text: &str) -> Result<Quantity, QuantityError> {
    if text.len() > MAX_LENGTH {
        return Err(QuantityError { range: 0..text.len(), problem: Problem::TooLong });
    }
    let (negative, number, unit_start) = parse_number(text)?;
    let scale = unit_parser::parse(text, unit_start)?;

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
        return Err(QuantityError { range: everything, problem: Problem::Overflow });
    }
    if value == 0.0 && !number.is_zero() {
        return Err(QuantityError { range: everything, problem: Problem::Underflow });
    }
    Ok(Quantity { value: if negative { -value } else { value }, dimension: scale.dimension })
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
    // U+2212 is the minus sign of word processors.
    let sign_length = match rest.chars().next() {
        Some(sign @ ('+' | '-' | '\u{2212}')) => sign.len_utf8(),
        _ => 0,
    };
    let negative = sign_length > 0 && !rest.starts_with('+');
    let digits_start = start + sign_length;
    let body = &text[digits_start..];
    let word: String = body.chars().take_while(|c| c.is_alphabetic()).collect();
    if matches!(word.to_ascii_lowercase().as_str(), "nan" | "inf" | "infinity") {
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
        return fail(digits_start + length..digits_start + length + 1, Problem::Comma);
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

#[cfg(test)]
mod tests;
