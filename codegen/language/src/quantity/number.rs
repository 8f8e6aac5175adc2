//! The number at the start of a quantity.

use std::ops::Range;

use super::decimal::Decimal;
use super::{Problem, QuantityError};

const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/// U+2212 is the minus sign of word processors.
pub(super) const MINUS: [char; 2] = ['-', '\u{2212}'];

/// Sign, magnitude, and where the unit starts.
pub(super) fn parse(text: &str) -> Result<(bool, Decimal, usize), QuantityError> {
    let fail = |range: Range<usize>, problem| Err(QuantityError { range, problem });
    let start = text.len() - text.trim_start().len();
    let rest = &text[start..];
    let body = rest.strip_prefix('+').or_else(|| rest.strip_prefix(MINUS)).unwrap_or(rest);
    let negative = rest.starts_with(MINUS);
    let digits_start = text.len() - body.len();
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
    let after = &body[length..];
    if after.starts_with(',') {
        return fail(digits_start + length..digits_start + length + 1, Problem::Comma);
    }
    // "10^7 N/m"
    if let (true, Some((exponent, exponent_length))) = (&body[..length] == "10", power(after)) {
        return Ok((negative, Decimal::new("1", exponent), digits_start + length + exponent_length));
    }
    let (exponent, exponent_length) = exponent(after).or_else(|| times_ten(after)).unwrap_or((0, 0));
    length += exponent_length;
    // `fraction` is at most MAX_LENGTH, so that the cast is exact.
    let decimal = Decimal::new(&digits, exponent.saturating_sub(fraction as i64));
    Ok((negative, decimal, digits_start + length))
}

/// Value and length of a leading "e-3"; none if the text starts otherwise, as "eV" does.
fn exponent(text: &str) -> Option<(i64, usize)> {
    let after = text.strip_prefix(['e', 'E'])?;
    let (value, length) = whole(after)?;
    Some((value, text.len() - after.len() + length))
}

/// The same of a leading "×10^-3", with or without blanks.
fn times_ten(text: &str) -> Option<(i64, usize)> {
    let after = text.trim_start().strip_prefix(['×', 'x', 'X', '*', '\u{b7}', '\u{22c5}'])?;
    let after = after.trim_start().strip_prefix("10")?;
    let (value, length) = power(after)?;
    Some((value, text.len() - after.len() + length))
}

/// The same of a leading "^-3", "**-3" or "⁻³".
pub(super) fn power(text: &str) -> Option<(i64, usize)> {
    if let Some(after) = text.strip_prefix("**").or_else(|| text.strip_prefix('^')) {
        let (value, length) = whole(after)?;
        return Some((value, text.len() - after.len() + length));
    }
    let digits = text.strip_prefix(['⁻', '⁺']).unwrap_or(text);
    let of = |c: char| SUPERSCRIPTS.chars().position(|mark| mark == c);
    let values: Vec<usize> = digits.chars().map_while(of).collect();
    let length = digits.chars().take(values.len()).map(char::len_utf8).sum::<usize>();
    // A longer power is as far out of range.
    let value = values.iter().take(9).fold(0, |sum, digit| 10 * sum + *digit as i64);
    let value = if text.starts_with('⁻') { -value } else { value };
    (!values.is_empty()).then_some((value, text.len() - digits.len() + length))
}

/// Value and length of a leading "-3" or "3".
pub(super) fn whole(text: &str) -> Option<(i64, usize)> {
    let digits = text.strip_prefix('+').or_else(|| text.strip_prefix(MINUS)).unwrap_or(text);
    let count = digits.bytes().take_while(u8::is_ascii_digit).count();
    // Beyond i64 the value overflows or underflows in any case.
    let magnitude = digits[..count].parse::<i64>().unwrap_or(i64::MAX / 2);
    let value = if text.starts_with(MINUS) { -magnitude } else { magnitude };
    (count > 0).then_some((value, text.len() - digits.len() + count))
}
