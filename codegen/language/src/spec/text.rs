//! Small helpers for the text of messages.

use std::ops::Range;

/// Longest piece of the user's text that a message repeats, characters.
const MAX_QUOTED: usize = 60;

/// The user's text, shortened, without control characters.
pub(super) fn shorten(found: &str) -> String {
    let mut short: String = found.chars().take(MAX_QUOTED).flat_map(printable).collect();
    if found.chars().nth(MAX_QUOTED).is_some() {
        short.push('…');
    }
    short
}

/// [`shorten`] in backquotes.
pub(super) fn quote(found: &str) -> String {
    format!("`{}`", shorten(found.trim()))
}

/// Escapes control characters and the characters that change text direction; the rest stays as it is.
fn printable(c: char) -> Vec<char> {
    let hidden = c.is_control()
        || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}');
    if hidden { c.escape_default().collect() } else { vec![c] }
}

/// `span` cut to the text and moved outward to whole characters.
pub(super) fn clamp(source: &str, span: Range<usize>) -> Range<usize> {
    let mut start = span.start.min(source.len());
    while !source.is_char_boundary(start) {
        start -= 1;
    }
    let mut end = span.end.clamp(start, source.len());
    while !source.is_char_boundary(end) {
        end += 1;
    }
    start..end
}

/// Relative on every system: no root, no drive, no backslash.
pub(super) fn is_relative_path(path: &str) -> bool {
    let drive = path.as_bytes().get(1) == Some(&b':');
    !path.trim().is_empty() && !path.starts_with('/') && !path.contains('\\') && !drive
}

/// A number for a message: up to four significant digits, without trailing zeros.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs();
    if !(1e-3..1e6).contains(&magnitude) {
        return format!("{:e}", rounded(value));
    }
    format!("{}", rounded(value))
}

/// A number for a fix: twelve significant digits, so that none of the user's are lost, and no noise of a division.
pub(super) fn digits(value: f64) -> String {
    let value = format!("{value:.11e}").parse().unwrap_or(value);
    if value == 0.0 || (1e-4..1e6).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// To four significant digits, by way of the decimal text.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// "a, b or c".
pub(super) fn alternatives(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [only] => format!("\"{only}\""),
        [first @ .., last] => {
            let quoted: Vec<String> = first.iter().map(|w| format!("\"{w}\"")).collect();
            format!("{} or \"{last}\"", quoted.join(", "))
        }
    }
}

/// The candidate that `name` is probably a misspelling of: at an edit distance of up to a third of its letters, at
/// least one. None if no candidate is close.
#[must_use]
pub fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // Nothing that long is a misspelt key, and the computation costs the product of the lengths.
    if name.len() > 64 {
        return None;
    }
    let limit = (name.chars().count() / 3).max(1);
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(&name.to_lowercase(), candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, expected) in [(0.15, "0.15"), (5.223_02, "5.223"), (6e-5, "6e-5"), (4200.0, "4200"), (-1e7, "-1e7")]
        {
            assert_eq!(number(value), expected);
        }
    }

    #[test]
    fn the_nearest_name_is_near() {
        let names = ["base_radius", "height"];
        assert_eq!(nearest("base_radus", names.into_iter()), Some("base_radius"));
        assert_eq!(nearest("heihgt", names.into_iter()), Some("height"));
        assert_eq!(nearest("voltage", names.into_iter()), None);
    }
}
