//! Typed quantities in text: `"1.195 kg"`, `"3.26e7 g mm^2"`, `"0.012 pi rad"`, `"40 V/ms"`.
//!
//! ```text
//! quantity = number [unit]            number = ["+"|"-"] decimal ["e" exponent]
//! unit     = product {"/" factor}     product = factor {[" "|"*"|"·"|"-"] factor}
//! factor   = (name | "(" unit ")") [["^"|"**"] power]
//! ```
//! Conversion to SI rounds once, to the nearest double. A name that is not a symbol may have several meanings (module `names`):
//! [`parse`] takes the surest one, [`parse_as`] the one that gives the wanted dimension.

mod decimal;
mod dimension;
mod names;
mod number;
mod unit_parser;
mod units;

use std::ops::Range;

use names::Trust;

pub use decimal::Decimal;
pub use dimension::Dimension;
pub use units::units_markdown;

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
    /// An unknown unit, and the units that were probably meant.
    UnknownUnit(String, Vec<String>),
    /// The unit can be read in these ways: quantities.
    AmbiguousUnit(Vec<String>),
    /// A product after a slash can be read in these two ways: quantities.
    AmbiguousQuotient(Vec<String>),
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

/// Units in common use, for helps; any other unit of the same dimension is valid, too.
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

/// Further units that an editor offers.
const FURTHER: &[&str] = &[
    "in",
    "mil",
    "lb",
    "oz",
    "arcsec",
    "arcmin",
    "mdeg",
    "lbf/in",
    "lbf in/rad",
    "lbf s/in",
    "kg cm^2",
    "kg mm^2",
    "lb in^2",
    "in/s",
    "deg/s",
];

/// The usual units of a dimension, for helps.
pub fn common_units(dimension: Dimension) -> impl Iterator<Item = &'static str> {
    COMMON.iter().copied().filter(move |unit| unit_value(unit).is_some_and(|one| one.dimension == dimension))
}

/// The same and others, for editors.
pub fn offered_units(dimension: Dimension) -> impl Iterator<Item = &'static str> {
    let further = FURTHER.iter().copied();
    common_units(dimension)
        .chain(further.filter(move |unit| unit_value(unit).is_some_and(|one| one.dimension == dimension)))
}

/// Reads a quantity. A text without a unit is a quantity without dimension.
///
/// # Errors
/// The first error, with its place in `text`; a unit with several meanings.
pub fn parse(text: &str) -> Result<Quantity, QuantityError> {
    let found = meanings(text)?;
    let surest = found.iter().filter(|one| one.trust == found[0].trust);
    only(text, surest.collect())
}

/// Reads a quantity of `dimension`: of several meanings of its unit, the one with this dimension, so that "lb/in" is a
/// stiffness. Without such a meaning, this is [`parse`].
///
/// # Errors
/// As those of [`parse`].
pub fn parse_as(text: &str, dimension: Dimension) -> Result<Quantity, QuantityError> {
    let found = meanings(text)?;
    // Capital letters are not doubted where the unit has a meaning as it is written: "Nm" is no nm.
    let most = found[0].trust.max(Trust::Spelling);
    let taken = |one: &&Meaning| one.trust <= most && one.scale.dimension == dimension && one.quantity().is_ok();
    let mut fitting: Vec<&Meaning> = found.iter().filter(taken).collect();
    let Some(surest) = fitting.first().map(|one| one.trust) else { return parse(text) };
    fitting.retain(|one| one.trust == surest);
    only(text, fitting)
}

/// The meanings of a quantity that have `dimension`, in symbols and with their values; none if it is not a quantity.
pub fn readings(text: &str, dimension: Dimension) -> Vec<(String, f64)> {
    let fitting = meanings(text).unwrap_or_default().into_iter().filter(|one| one.scale.dimension == dimension);
    fitting.filter_map(|one| Some((one.text.trim().to_owned(), one.quantity().ok()?.value))).collect()
}

/// One meaning of a quantity.
struct Meaning {
    trust: Trust,
    negative: bool,
    number: Decimal,
    scale: unit_parser::Scale,
    /// The whole text, in symbols.
    text: String,
    /// Where its unit starts.
    unit_start: usize,
}

impl Meaning {
    fn quantity(&self) -> Result<Quantity, Problem> {
        let times = |product: Decimal, factor: &Decimal| product.times(factor);
        let above = self.scale.times.iter().fold(self.number.shifted(self.scale.power_of_ten), times);
        let below = self.scale.over.iter().fold(Decimal::new("1", 0), times);
        let value = if self.scale.over.is_empty() { above.to_f64() } else { above.over(&below) };
        if !value.is_finite() {
            return Err(Problem::Overflow);
        }
        if value == 0.0 && !self.number.is_zero() {
            return Err(Problem::Underflow);
        }
        Ok(Quantity { value: if self.negative { -value } else { value }, dimension: self.scale.dimension })
    }
}

/// The meanings of a quantity, the surest first; at least one.
fn meanings(text: &str) -> Result<Vec<Meaning>, QuantityError> {
    if text.len() > MAX_LENGTH {
        return Err(QuantityError { range: 0..text.len(), problem: Problem::TooLong });
    }
    let (negative, number, unit_start) = number::parse(text)?;
    let units = unit_parser::parse(text, unit_start)?.into_iter();
    let meaning = |unit_parser::Reading { trust, scale, text }| Meaning {
        trust,
        negative,
        number: number.clone(),
        scale,
        text,
        unit_start,
    };
    Ok(units.map(meaning).collect())
}

/// The value of the only meaning; several are an error.
fn only(text: &str, found: Vec<&Meaning>) -> Result<Quantity, QuantityError> {
    if let [only] = found.as_slice() {
        return only.quantity().map_err(|problem| QuantityError { range: 0..text.len(), problem });
    }
    let start = found.first().map_or(0, |one| one.unit_start);
    let start = text.len() - text[start..].trim_start().len();
    let problem = Problem::AmbiguousUnit(found.iter().map(|one| one.text.trim().to_owned()).collect());
    Err(QuantityError { range: start..text.trim_end().len(), problem })
}

/// SI value of one `unit` such as "mm" or "N m/rad"; `None` if it is not a unit.
pub fn unit_value(unit: &str) -> Option<Quantity> {
    parse(&format!("1 {unit}")).ok()
}

/// Whether `sign` in a number of a data file may divide thousands, as in `21,484`, which it does not in `0,484` or `21,48`.
#[must_use]
pub fn may_divide_thousands(number: &str, sign: char) -> bool {
    let digits = number.trim_start_matches(['+', '-', '\u{2212}']).split_once(sign);
    digits.is_some_and(|(whole, rest)| {
        let is_digits = [whole, rest].iter().all(|text| text.bytes().all(|byte| byte.is_ascii_digit()));
        is_digits && (1..=3).contains(&whole.len()) && !whole.starts_with('0') && rest.len() == 3
    })
}

#[cfg(test)]
mod tests;
