//! One TOML value against what its key wants.

use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::fields::{Field, Parsed};
use super::findings::Findings;
use super::keys::{Item, Key, MAX_NAME, Shape};
use super::{messages, text};
use crate::diagnostic::codes;

/// A value with its place: the file's own, or the parsed text of a default.
pub(super) struct ValueReader<'a> {
    pub(super) source: &'a str,
    pub(super) key: &'static Key,
    pub(super) path: &'a str,
    pub(super) findings: &'a mut Findings,
}

/// A single value that passed.
enum Scalar {
    Number(f64),
    Integer(i64),
    Choice(&'static str),
    Name(String),
}

impl ValueReader<'_> {
    /// The value as its key wants it; `None` if there is a finding.
    pub(super) fn read(&mut self, value: &Spanned<DeValue<'_>>) -> Option<Field> {
        let span = text::clamp(self.source, value.span());
        let (parsed, items) = match self.key.shape {
            Shape::One(item) => {
                let parsed = match self.scalar(item, self.path, value)? {
                    Scalar::Number(number) => Parsed::Numbers(vec![number]),
                    Scalar::Integer(integer) => Parsed::Integer(integer),
                    Scalar::Choice(word) => Parsed::Choice(word),
                    Scalar::Name(name) => Parsed::Name(name),
                };
                (parsed, Vec::new())
            }
            Shape::List(items) => self.list(items, value)?,
            Shape::Records => self.records(value)?,
        };
        Some(Field {
            parsed,
            span,
            items,
            given: true,
        })
    }

    fn list(
        &mut self,
        items: &'static [Item],
        value: &Spanned<DeValue<'_>>,
    ) -> Option<(Parsed, Vec<Range<usize>>)> {
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(
                self.path,
                value,
                &format!("an array of {} values", items.len()),
                None,
            );
        };
        let mut numbers = Vec::new();
        let mut spans = Vec::new();
        for (i, (item, element)) in items.iter().zip(array.iter()).enumerate() {
            spans.push(text::clamp(self.source, element.span()));
            if let Some(Scalar::Number(number)) =
                self.scalar(*item, &format!("{}[{i}]", self.path), element)
            {
                numbers.push(number);
            }
        }
        if array.len() != items.len() {
            self.findings.error(
                codes::WRONG_COUNT,
                self.path,
                text::clamp(self.source, value.span()),
                format!(
                    "`{}` has {} value{}, expected {}",
                    self.path,
                    array.len(),
                    if array.len() == 1 { "" } else { "s" },
                    items.len()
                ),
                format!(
                    "write {} values: {} = {}",
                    items.len(),
                    self.key.name,
                    self.key.example
                ),
            );
            return None;
        }
        (numbers.len() == items.len()).then_some((Parsed::Numbers(numbers), spans))
    }

    fn records(&mut self, value: &Spanned<DeValue<'_>>) -> Option<(Parsed, Vec<Range<usize>>)> {
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(self.path, value, "an array of file names", None);
        };
        let mut texts = Vec::new();
        let mut spans = Vec::new();
        for (i, element) in array.iter().enumerate() {
            spans.push(text::clamp(self.source, element.span()));
            let path = format!("{}[{i}]", self.path);
            match element.get_ref() {
                DeValue::String(file) => texts.push(file.to_string()),
                _ => return self.wrong_type(&path, element, "a file name", None),
            }
        }
        Some((Parsed::Texts(texts), spans))
    }

    fn scalar(&mut self, item: Item, path: &str, value: &Spanned<DeValue<'_>>) -> Option<Scalar> {
        match item {
            Item::Quantity { .. } => self.quantity(item, path, value).map(Scalar::Number),
            Item::Number(range) => {
                let number = self.plain_number(path, value)?;
                self.in_range(
                    range.contains(number),
                    item,
                    path,
                    value,
                    &text::number(number),
                )?;
                Some(Scalar::Number(number))
            }
            Item::Integer(min, max) => {
                let integer = self.integer(path, value)?;
                self.in_range(
                    (min..=max).contains(&integer),
                    item,
                    path,
                    value,
                    &integer.to_string(),
                )?;
                Some(Scalar::Integer(integer))
            }
            Item::Choice(words) => {
                let DeValue::String(found) = value.get_ref() else {
                    return self.wrong_type(
                        path,
                        value,
                        &format!("one of {}", text::alternatives(words)),
                        None,
                    );
                };
                let known = words.iter().find(|word| **word == found.as_ref());
                if known.is_none() {
                    let meant = text::nearest(found, words.iter().copied());
                    let did_you_mean =
                        meant.map_or_else(String::new, |word| format!("did you mean \"{word}\"? "));
                    self.findings.error(
                        codes::UNKNOWN_CHOICE,
                        path,
                        text::clamp(self.source, value.span()),
                        format!(
                            "`{path}` is \"{}\", expected {}",
                            text::shorten(found),
                            text::alternatives(words)
                        ),
                        format!(
                            "{did_you_mean}write {}. {}",
                            text::alternatives(words),
                            self.key.doc
                        ),
                    );
                }
                known.map(|word| Scalar::Choice(word))
            }
            Item::Name => self.name(path, value).map(Scalar::Name),
        }
    }

    fn quantity(&mut self, item: Item, path: &str, value: &Spanned<DeValue<'_>>) -> Option<f64> {
        let Item::Quantity {
            dimension,
            range,
            unit,
        } = item
        else {
            return None;
        };
        let span = text::clamp(self.source, value.span());
        let found = match value.get_ref() {
            DeValue::String(found) => found,
            DeValue::Integer(_) | DeValue::Float(_) => {
                let number = self.plain_number(path, value)?;
                self.unit_missing(path, span, number, unit);
                return None;
            }
            _ => {
                let expected = format!(
                    "{} such as {}",
                    dimension.describe(),
                    messages::example_of(self.key, path)
                );
                return self.wrong_type(path, value, &expected, None);
            }
        };
        match super::quantity::parse(found) {
            Ok(quantity) if quantity.dimension == super::quantity::Dimension::NONE => {
                self.unit_missing(path, span, quantity.value, unit);
                None
            }
            Ok(quantity) if quantity.dimension != dimension => {
                let (message, help) =
                    messages::wrong_dimension(self.key, path, found, quantity.dimension, dimension);
                self.findings
                    .error(codes::WRONG_DIMENSION, path, span, message, help);
                None
            }
            Ok(quantity) => {
                self.in_range(
                    range.contains(quantity.value),
                    item,
                    path,
                    value,
                    &text::shorten(found),
                )?;
                // -0.0 and 0.0 would be two different models.
                Some(if quantity.value == 0.0 {
                    0.0
                } else {
                    quantity.value
                })
            }
            Err(error) => {
                let place = self.inside(&span, found, &error.range);
                let (code, message, help) =
                    messages::bad_quantity(self.key, path, found, &error.problem);
                self.findings.error(code, path, place, message, help);
                None
            }
        }
    }

    /// Where `range` of the text `found` stands in the file; the whole value where escapes moved it.
    fn inside(&self, span: &Range<usize>, found: &str, range: &Range<usize>) -> Range<usize> {
        let written = &self.source[span.clone()];
        match written.find(found) {
            Some(offset) if !found.is_empty() => {
                span.start + offset + range.start..span.start + offset + range.end
            }
            _ => span.clone(),
        }
    }

    fn unit_missing(&mut self, path: &str, span: Range<usize>, number: f64, unit: &str) {
        let form = format!("\"{} {unit}\"", text::number(number));
        let message =
            format!("`{path}` is a number without unit, expected a quantity such as {form}");
        self.findings.error(
            codes::UNIT_MISSING,
            path,
            span,
            message,
            format!("write {form}, with the unit that you mean"),
        );
    }

    fn plain_number(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<f64> {
        let (written, number) = match value.get_ref() {
            DeValue::Float(float) => (float.as_str(), float.as_str().parse::<f64>().ok()),
            // Through i64, so that 0x10 counts as well.
            DeValue::Integer(integer) => (
                integer.as_str(),
                i64::from_str_radix(integer.as_str(), integer.radix())
                    .ok()
                    .map(|i| i as f64),
            ),
            DeValue::String(found) => {
                let is_number = found.trim().parse::<f64>().is_ok_and(f64::is_finite);
                let mend = is_number.then(|| format!("write {} without quotes", found.trim()));
                return self.wrong_type(path, value, "a number", mend);
            }
            _ => return self.wrong_type(path, value, "a number", None),
        };
        let mantissa = written.split(['e', 'E']).next().unwrap_or_default();
        let vanished = number == Some(0.0) && mantissa.bytes().any(|b| (b'1'..=b'9').contains(&b));
        match number {
            Some(number) if number.is_finite() && !vanished => {
                Some(if number == 0.0 { 0.0 } else { number })
            }
            _ => {
                self.findings.error(
                    codes::NOT_FINITE,
                    path,
                    text::clamp(self.source, value.span()),
                    format!(
                        "`{path}` is {}, which is not a finite number that a double can hold",
                        text::shorten(written)
                    ),
                    format!(
                        "write a finite value, such as {}",
                        messages::example_of(self.key, path)
                    ),
                );
                None
            }
        }
    }

    fn integer(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<i64> {
        let expected = "a whole number";
        match value.get_ref() {
            DeValue::Integer(integer) => {
                let parsed = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
                if parsed.is_none() {
                    self.findings.error(
                        codes::OUT_OF_RANGE,
                        path,
                        text::clamp(self.source, value.span()),
                        format!(
                            "`{path}` is {}, too large for a whole number of 64 bits",
                            text::shorten(integer.as_str())
                        ),
                        messages::range_help(self.key, path),
                    );
                }
                parsed
            }
            DeValue::Float(float) => {
                let number: f64 = float.as_str().parse().unwrap_or(f64::NAN);
                if !number.is_finite() {
                    self.plain_number(path, value);
                    return None;
                }
                let mend = (number.fract() == 0.0)
                    .then(|| format!("write {number} without the decimal point"));
                self.wrong_type(path, value, expected, mend)
            }
            DeValue::String(found) => {
                let mend = found
                    .trim()
                    .parse::<i64>()
                    .ok()
                    .map(|number| format!("write {number} without quotes"));
                self.wrong_type(path, value, expected, mend)
            }
            _ => self.wrong_type(path, value, expected, None),
        }
    }

    fn name(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<String> {
        let DeValue::String(found) = value.get_ref() else {
            return self.wrong_type(path, value, "a name in quotes", None);
        };
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let good =
            found.starts_with(|c: char| c.is_ascii_alphabetic()) && found.chars().all(allowed);
        if good && found.len() <= MAX_NAME {
            return Some(found.to_string());
        }
        let mended: String = found
            .chars()
            .map(|c| if allowed(c) { c } else { '-' })
            .take(MAX_NAME)
            .collect();
        let mended = mended.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
        let such_as = if mended.is_empty() {
            "my-platform"
        } else {
            mended
        };
        self.findings.error(
            codes::BAD_NAME,
            path,
            text::clamp(self.source, value.span()),
            format!("`{path}` is \"{}\", which is not a name", text::shorten(found)),
            format!("use a letter, then letters, digits, - and _, at most {MAX_NAME} characters, such as \"{such_as}\""),
        );
        None
    }

    fn in_range(
        &mut self,
        inside: bool,
        item: Item,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        shown: &str,
    ) -> Option<()> {
        if !inside {
            self.findings.error(
                codes::OUT_OF_RANGE,
                path,
                text::clamp(self.source, value.span()),
                format!("`{path}` is {shown}, expected {}", messages::range_of(item)),
                messages::range_help(self.key, path),
            );
        }
        inside.then_some(())
    }

    fn wrong_type<T>(
        &mut self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        expected: &str,
        mend: Option<String>,
    ) -> Option<T> {
        let help =
            mend.unwrap_or_else(|| format!("write {} = {}", self.key.name, self.key.example));
        self.findings.error(
            codes::WRONG_TYPE,
            path,
            text::clamp(self.source, value.span()),
            format!(
                "`{path}` is {}, expected {expected}",
                messages::kind_of(value.get_ref())
            ),
            help,
        );
        None
    }
}
