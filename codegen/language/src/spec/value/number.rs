//! Numbers and quantities.

use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::ValueReader;
use crate::diagnostic::codes;
use crate::quantity::{self, Dimension, Problem};
use crate::spec::keys::Item;
use crate::spec::{messages, suggestion, text};

impl ValueReader<'_> {
    pub(super) fn quantity(&mut self, item: Item, path: &str, value: &Spanned<DeValue<'_>>) -> Option<f64> {
        let Item::Quantity { dimension, range, .. } = item else {
            return None;
        };
        let span = text::clamp(self.source, value.span());
        let found = match value.get_ref() {
            DeValue::String(found) => found,
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.plain_number(path, value)?;
                let written = self.source[span.clone()].to_owned();
                self.unit_missing(path, span, &written);
                return None;
            }
            _ => {
                return self.wrong_type(path, value, &format!("{} in quotes", dimension.describe()), None);
            }
        };
        match quantity::parse_as(found, dimension) {
            Ok(quantity) if quantity.dimension == Dimension::NONE => {
                self.unit_missing(path, span, found.trim());
                None
            }
            Ok(quantity) if quantity.dimension != dimension => {
                let (shown, is) = (text::shorten(found), quantity.dimension.describe());
                let message = format!("`{path}` is \"{shown}\": this is {is}, expected {}", dimension.describe());
                let meant = suggestion::of_other(self.key, item, path, found, &quantity, self.spec)?;
                self.findings.add(codes::WRONG_DIMENSION, path, span, message, meant.help);
                self.findings.replace_by(path, meant.value.map(|value| format!("\"{value}\"")));
                None
            }
            Ok(quantity) => {
                self.in_range(range.contains(quantity.value), item, path, value, &text::shorten(found))?;
                // -0.0 and 0.0 would be two different models.
                Some(if quantity.value == 0.0 { 0.0 } else { quantity.value })
            }
            Err(error) => {
                let place = self.inside(&span, found, &error.range);
                let (code, message, help) = messages::bad_quantity(self.key, path, found, &error.problem);
                let replacement = match &error.problem {
                    Problem::UnknownUnit(_, meant) if meant.len() == 1 => meant.first().cloned(),
                    // Its number is as it was written.
                    Problem::AmbiguousUnit(all) if found.trim() == found => suggestion::choice(self.key, path, all)
                        .and_then(|meant| Some(meant.value?.get(error.range.start..)?.to_owned())),
                    _ => None,
                };
                // If escapes shifted it, the place is the whole value.
                let replacement =
                    replacement.filter(|_| self.source.get(place.clone()) == found.get(error.range.clone()));
                self.findings.add(code, path, place, message, help);
                self.findings.replace_by(path, replacement);
                None
            }
        }
    }

    /// Place in the file of `range` in the text `found`; the whole value if escapes shifted it.
    pub(super) fn inside(&self, span: &Range<usize>, found: &str, range: &Range<usize>) -> Range<usize> {
        let written = &self.source[span.clone()];
        match written.find(found) {
            Some(offset) if !found.is_empty() => span.start + offset + range.start..span.start + offset + range.end,
            _ => span.clone(),
        }
    }

    fn unit_missing(&mut self, path: &str, span: Range<usize>, written: &str) {
        let units = messages::units_of(self.key, path).unwrap_or_default();
        let message = format!("`{path}` is a number without unit");
        let help = format!("in which unit, {units}? Write \"{} <unit>\", in quotes", text::shorten(written));
        self.findings.add(codes::UNIT_MISSING, path, span, message, help);
    }

    pub(super) fn plain_number(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<f64> {
        let (written, number) = match value.get_ref() {
            DeValue::Float(float) => (float.as_str(), float.as_str().parse::<f64>().ok()),
            // Through i64, so that 0x10 is valid as well.
            DeValue::Integer(integer) => {
                (integer.as_str(), i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64))
            }
            DeValue::String(found) => {
                let is_number = found.trim().parse::<f64>().is_ok_and(f64::is_finite);
                let fix = is_number.then(|| format!("write {} without quotes", found.trim()));
                return self.wrong_type(path, value, "a number", fix);
            }
            _ => return self.wrong_type(path, value, "a number", None),
        };
        let mantissa = written.split(['e', 'E']).next().unwrap_or_default();
        let vanished = number == Some(0.0) && mantissa.bytes().any(|b| (b'1'..=b'9').contains(&b));
        match number {
            Some(number) if number.is_finite() && !vanished => Some(if number == 0.0 { 0.0 } else { number }),
            _ => {
                self.findings.add(
                    codes::NOT_FINITE,
                    path,
                    text::clamp(self.source, value.span()),
                    format!(
                        "`{path}` is {}, which is not a finite number that a double can hold",
                        text::shorten(written)
                    ),
                    messages::range_help(self.key, path),
                );
                None
            }
        }
    }

    pub(super) fn integer(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<i64> {
        let expected = "a whole number";
        match value.get_ref() {
            DeValue::Integer(integer) => {
                let parsed = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
                if parsed.is_none() {
                    self.findings.add(
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
                let fix = (number.fract() == 0.0).then(|| format!("write {number} without the decimal point"));
                self.wrong_type(path, value, expected, fix)
            }
            DeValue::String(found) => {
                let fix = found.trim().parse::<i64>().ok().map(|number| format!("write {number} without quotes"));
                self.wrong_type(path, value, expected, fix)
            }
            _ => self.wrong_type(path, value, expected, None),
        }
    }
}
