//! The unit part of a quantity: products, quotients and powers of units.

use std::ops::Range;

use super::decimal::Decimal;
use super::dimension::Dimension;
use super::names::{self, Trust};
use super::units::{self, Unit};
use super::{Problem, QuantityError, number};

const MAX_NESTING: usize = 4;
const MAX_CONSTANTS: usize = 32;
/// Most meanings of a unit that are tried.
const MAX_READINGS: usize = 64;

/// Multiplication dots of keyboards, word processors and fonts.
const DOTS: [char; 7] = ['*', '\u{b7}', '\u{22c5}', '\u{2219}', '\u{2022}', '\u{2027}', '×'];
/// Also between two letters: "lbf-in", "N.m".
const JOINS: [char; 4] = ['-', '\u{2010}', '\u{2011}', '.'];
const SLASHES: [char; 3] = ['/', '\u{2044}', '\u{2215}'];
/// Marks of lengths and angles, and the root, which are names as letters are.
const MARKS: [char; 6] = ['°', '"', '\'', '″', '′', '√'];
/// What makes √Hz of Hz, and the sign of the power.
const ROOTS: [(&str, i8); 8] =
    [("^0.5", 1), ("^.5", 1), ("^(0.5)", 1), ("^(1/2)", 1), ("^1/2", 1), ("^-0.5", -1), ("^(-1/2)", -1), ("^-1/2", -1)];

/// A meaning of a unit.
pub(super) struct Reading {
    pub(super) trust: Trust,
    pub(super) scale: Scale,
    /// The whole text, with symbols in the place of other names.
    pub(super) text: String,
}

/// Reads the unit that starts at byte `at` of `text`: its meanings, the surest first; a text that ends there has the unit 1.
///
/// # Errors
/// The first error, with its place in `text`.
pub(super) fn parse(text: &str, at: usize) -> Result<Vec<Reading>, QuantityError> {
    let mut first = UnitParser::new(text, at, Vec::new());
    let scale = first.whole()?;
    let combinations = first.counts.iter().try_fold(1_usize, |product, count| product.checked_mul(*count));
    let counts = first.counts.clone();
    let mut found = vec![first.reading(scale)];
    for combination in 1..combinations.unwrap_or(MAX_READINGS).min(MAX_READINGS) {
        let mut rest = combination;
        let choice = |count: &usize| {
            let own = rest % count;
            rest /= count;
            own
        };
        let mut parser = UnitParser::new(text, at, counts.iter().map(choice).collect());
        found.extend(parser.whole().ok().map(|scale| parser.reading(scale)));
    }
    found.sort_by_key(|reading| reading.trust);
    Ok(found)
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

    fn of(unit: &Unit) -> Self {
        Self {
            dimension: unit.dimension,
            power_of_ten: i64::from(unit.power_of_ten),
            times: unit.constant.iter().map(|c| c.decimal()).collect(),
            over: unit.over.iter().map(|c| c.decimal()).collect(),
        }
    }

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
    /// The meaning that each name is given, in their order; the first if there is none.
    chosen: Vec<usize>,
    /// Number of meanings of each name so far.
    counts: Vec<usize>,
    trust: Trust,
    /// What to write in the place of names that are not symbols.
    edits: Vec<(Range<usize>, String)>,
}

impl<'a> UnitParser<'a> {
    fn new(text: &'a str, at: usize, chosen: Vec<usize>) -> Self {
        Self { text, at, depth: 0, chosen, counts: Vec::new(), trust: Trust::Symbol, edits: Vec::new() }
    }

    fn reading(&self, scale: Scale) -> Reading {
        let mut text = self.text.to_owned();
        for (range, symbols) in self.edits.iter().rev() {
            text.replace_range(range.clone(), symbols);
        }
        Reading { trust: self.trust, scale, text }
    }

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
        let start = self.at;
        self.factor(&mut scale, 1)?;
        // Place of the last slash.
        let mut divided = None;
        loop {
            let end = self.at;
            self.skip_spaces();
            let rest = &self.text[self.at..];
            match self.peek() {
                None | Some(')') => return Ok(scale),
                Some(c) if SLASHES.contains(&c) || rest.starts_with("per ") => {
                    let slash = self.at;
                    self.at += if c == 'p' { 3 } else { c.len_utf8() };
                    self.skip_spaces();
                    self.factor(&mut scale, -1)?;
                    divided = Some(slash);
                }
                Some(c) => {
                    let joins = JOINS.contains(&c) && rest[c.len_utf8()..].starts_with(char::is_alphabetic);
                    if DOTS.contains(&c) || joins {
                        self.at += c.len_utf8();
                        self.skip_spaces();
                    }
                    if let Some(slash) = divided {
                        let problem = Problem::AmbiguousQuotient(self.quotients(slash, end));
                        return Err(QuantityError { range: start..self.text.len(), problem });
                    }
                    self.factor(&mut scale, 1)?;
                }
            }
        }
    }

    /// The two meanings of a product after the slash at `slash`, whose first factor ends at `end`.
    fn quotients(&self, slash: usize, end: usize) -> Vec<String> {
        let above = self.text[..slash].trim();
        let below = self.text[slash..end].trim_start_matches(SLASHES).trim_start_matches("per ").trim();
        let last = self.text[self.at..].trim();
        vec![format!("{above} {last}/{below}"), format!("{above}/({below} {last})")]
    }

    fn factor(&mut self, scale: &mut Scale, direction: i8) -> Result<(), QuantityError> {
        let start = self.at;
        if self.peek() == Some('(') {
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
            let power = self.power()?;
            return self.multiply(scale, &inner, direction * power, start);
        }
        let product = self.name()?;
        let name_end = self.at;
        if let [(_, unit)] = product.as_slice()
            && *unit == units::HERTZ
            && let Some((root, sign)) = ROOTS.iter().find(|(root, _)| self.text[self.at..].starts_with(root))
        {
            self.at += root.len();
            return self.multiply(scale, &Scale::of(&units::ROOT_HERTZ), direction * sign, start);
        }
        let power = self.power()?;
        // The power is that of the last unit: "kgcm^2" is kg cm^2.
        for (index, (_, unit)) in product.iter().enumerate() {
            let power = if index + 1 == product.len() { power } else { 1 };
            self.multiply(scale, &Scale::of(unit), direction * power, start)?;
        }
        let symbols: Vec<&str> = product.iter().map(|(symbol, _)| symbol.as_str()).collect();
        let symbols = symbols.join(" ");
        if symbols != self.text[start..name_end] {
            let edit = if direction < 0 && product.len() > 1 {
                (start..self.at, format!("({symbols}{})", &self.text[name_end..self.at]))
            } else {
                (start..name_end, symbols)
            };
            self.edits.push(edit);
        }
        Ok(())
    }

    fn multiply(&self, scale: &mut Scale, other: &Scale, power: i8, start: usize) -> Result<(), QuantityError> {
        let bad = QuantityError { range: start..self.at, problem: Problem::BadPower };
        scale.multiply(other, power).ok_or(bad)
    }

    /// The units of the name here, in the meaning that is tried.
    fn name(&mut self) -> Result<Vec<(String, Unit)>, QuantityError> {
        let start = self.at;
        let is_letter = |c: char| c.is_alphabetic() || MARKS.contains(&c);
        let length = self.text[start..].find(|c| !is_letter(c)).unwrap_or(self.text.len() - start);
        if length == 0 {
            return self.unexpected();
        }
        self.at += length;
        let name = &self.text[start..self.at];
        // "in." and "lb."
        let rest = &self.text[self.at..];
        if rest.starts_with('.') && !rest[1..].starts_with(char::is_alphanumeric) {
            self.at += 1;
        }
        if let Some(root) = self.root(start) {
            return Ok(vec![("√Hz".to_owned(), root)]);
        }
        let range = start..start + length;
        let mut readings = names::readings(name);
        if readings.iter().all(|reading| reading.trust == Trust::Guess) {
            let guesses: Vec<String> = readings.iter().filter_map(|one| Some(one.units.first()?.0.clone())).collect();
            return Err(QuantityError { range, problem: Problem::UnknownUnit(name.to_owned(), guesses) });
        }
        readings.retain(|reading| reading.trust != Trust::Guess);
        let chosen = self.chosen.get(self.counts.len()).copied().unwrap_or(0);
        self.counts.push(readings.len());
        let reading = readings.swap_remove(chosen.min(readings.len() - 1));
        self.trust = self.trust.max(reading.trust);
        Ok(reading.units)
    }

    /// √Hz as "sqrt(Hz)", "rt Hz" or "√(Hz)": the name ends here, and began at `start`.
    fn root(&mut self, start: usize) -> Option<Unit> {
        let name = self.text[start..self.at].to_lowercase();
        if !matches!(name.as_str(), "√" | "sqrt" | "rt" | "root") {
            return None;
        }
        let rest = self.text[self.at..].trim_start();
        let inner = rest.strip_prefix('(').map_or(rest, str::trim_start);
        let after = inner.strip_prefix("Hz").or_else(|| inner.strip_prefix("hz"))?;
        let after = if inner.len() == rest.len() { after } else { after.trim_start().strip_prefix(')')? };
        self.at = self.text.len() - after.len();
        Some(units::ROOT_HERTZ)
    }

    /// The power of the factor just read: "^2", "**-1", "²", or "2" without a blank; 1 if none is written.
    fn power(&mut self) -> Result<i8, QuantityError> {
        let start = self.at;
        let rest = &self.text[start..];
        let plain = Some(rest).filter(|rest| !rest.starts_with('+'));
        let found = number::power(rest).or_else(|| number::whole(plain?));
        let marked = rest.starts_with('^') || rest.starts_with("**");
        match found {
            Some((power, length)) => {
                self.at += length;
                let small = i8::try_from(power).ok().filter(|power| (-9..=9).contains(power));
                small.ok_or(QuantityError { range: start..self.at, problem: Problem::BadPower })
            }
            None if marked => {
                self.at += if rest.starts_with('^') { 1 } else { 2 };
                Err(QuantityError { range: start..self.at, problem: Problem::BadPower })
            }
            None => Ok(1),
        }
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
