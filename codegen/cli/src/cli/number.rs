//! Numbers in arguments.

use std::ops::RangeInclusive;

/// A parser of a number in a range, with or without its unit.
pub fn number(
    unit: &'static str,
    expected: &'static str,
    range: RangeInclusive<f64>,
) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let value = text.trim().trim_end_matches(unit).trim().parse().ok().filter(|value| range.contains(value));
        value.ok_or_else(|| format!("expected {expected}, found `{text}`"))
    }
}
