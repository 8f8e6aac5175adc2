//! TOML text to a tree with spans, and syntax errors.
//!
//! The parser recovers, so that one run reports several mistakes. If they leave the tree complete (a key given twice, a
//! text without quotes), the values are checked as well.

use std::ops::Range;

use toml::de::DeTable;

use super::findings::{Findings, MAX_FINDINGS};
use super::keys::{Item, Shape};
use super::{keys, text};
use crate::diagnostic::{Place, codes};

/// A parsed file.
pub(super) struct ParsedFile<'a> {
    pub(super) root: DeTable<'a>,
    /// Whether the tree is worth checking.
    pub(super) whole: bool,
}

/// Parses `source`, with one finding per syntax error.
pub(super) fn parse<'a>(source: &'a str, findings: &mut Findings) -> ParsedFile<'a> {
    let (root, errors) = DeTable::parse_recoverable(source);
    let mut whole = true;
    for error in errors.iter().take(MAX_FINDINGS) {
        let span = text::clamp(source, error.span().unwrap_or(0..0));
        whole &= report(source, span, error.message(), findings);
    }
    let left_out = errors.len().saturating_sub(MAX_FINDINGS);
    findings.leave_out(left_out);
    ParsedFile { root: root.into_inner(), whole: whole && left_out == 0 }
}

/// Reports one syntax error; returns whether the tree is still complete.
fn report(source: &str, span: Range<usize>, message: &str, findings: &mut Findings) -> bool {
    let found = &source[span.clone()];
    // These two phrases are the parser's. A test pins them, so that an update that changes them is noticed.
    if message.starts_with("duplicate key") {
        duplicate(source, span, findings);
        return true;
    }
    if message.starts_with("string values must be quoted") && !found.trim().is_empty() {
        unquoted(source, span, findings);
        return true;
    }
    if let Some(word) = bare_word(source, &span, message) {
        unquoted(source, word, findings);
        return false;
    }
    let missing_value = message.starts_with("string values must be quoted");
    findings.add(
        codes::SYNTAX,
        "",
        span,
        if missing_value { "there is no value here".to_owned() } else { format!("this is not TOML: {message}") },
        if missing_value {
            "write a value after the equals sign, or remove the line".to_owned()
        } else {
            help_for(message).to_owned()
        },
    );
    false
}

/// Reports a text without quotes, once per place.
fn unquoted(source: &str, span: Range<usize>, findings: &mut Findings) {
    let place = Place::Spec(span.clone());
    if findings.all().iter().any(|d| d.place == place) {
        return;
    }
    let found = &source[span.clone()];
    let key = key_at(source, span.start);
    findings.add(
        codes::UNQUOTED,
        &key,
        span,
        format!("{} is a text without quotes", text::quote(found)),
        format!("texts and quantities need quotes: write \"{}\"", text::shorten(found.trim())),
    );
    // If the key takes no text, quotes are not enough.
    let takes_text = keys::key(&key)
        .is_none_or(|key| !matches!(key.shape, Shape::One(Item::Number(_) | Item::Integer(..) | Item::Flag)));
    findings.replace_by(&key, takes_text.then(|| format!("\"{}\"", found.trim())));
}

/// Path of the key whose value is at `offset`; empty if the line has no key of its own.
fn key_at(source: &str, offset: usize) -> String {
    let line = source[..offset].rfind('\n').map_or(0, |i| i + 1);
    let name = key_name(&source[line..offset]).unwrap_or_default();
    let (header, is_header) = header_before(source, offset);
    let bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if is_header || name.is_empty() || !name.chars().all(bare) {
        return String::new();
    }
    let (_, repetition) = section_start(source, header, offset);
    let table = repetition.map_or_else(|| header.to_owned(), |index| format!("{header}[{index}]"));
    text::shorten(&keys::join(&table, name))
}

/// A text without quotes that the parser took for an invalid number or boolean: `150mm`, `f32`, `invhys`.
fn bare_word(source: &str, span: &Range<usize>, message: &str) -> Option<Range<usize>> {
    if !SCALAR_PHRASES.iter().any(|phrase| message.starts_with(phrase)) {
        return None;
    }
    let delimiter = |c: char| matches!(c, '=' | ',' | '[' | ']' | '{' | '}' | '#' | '"' | '\'' | '\n' | '\r');
    let start = source[..span.start].rfind(delimiter).map_or(0, |i| i + 1);
    let end = source[span.start..].find(delimiter).map_or(source.len(), |i| span.start + i);
    let word = source[start..end].trim();
    let start = start + source[start..end].find(word)?;
    word.contains(|c: char| c.is_alphabetic()).then_some(start..start + word.len())
}

/// The parser's phrases for a value that is not a number, date or boolean.
const SCALAR_PHRASES: &[&str] =
    &["invalid boolean", "invalid float", "invalid integer", "invalid date-time", "unexpected leading zero"];

fn help_for(message: &str) -> &'static str {
    if message.contains("unclosed array") || message.contains("in array") || message.contains("array elements") {
        "an array is written [VALUE, VALUE]: a comma between values, a bracket at each end"
    } else if message.contains("unclosed table") {
        "a section starts with its name in brackets on a line of its own: [geometry]"
    } else if message.contains("basic string") || message.contains("literal string") || message.contains("escape") {
        "a text starts and ends with a quote on the same line; write a backslash twice"
    } else if message.contains("recurs") {
        "a spec nests no deeper than a section and an array"
    } else {
        "a line is a section [name], a key = value, or a # comment"
    }
}

fn duplicate(source: &str, span: Range<usize>, findings: &mut Findings) {
    let name = &source[span.clone()];
    let (header, is_header) = header_before(source, span.start);
    let (key, first) = if is_header {
        (name.to_owned(), first_line(source, 0, &span, |line| header_name(line) == Some(header)))
    } else {
        // Before its section, a key of the same name belongs elsewhere.
        let (from, repetition) = section_start(source, header, span.start);
        let table = repetition.map_or_else(|| header.to_owned(), |index| format!("{header}[{index}]"));
        let key = keys::join(&table, name);
        (key, first_line(source, from, &span, |line| key_name(line) == Some(name)))
    };
    let before = first.map_or_else(String::new, |line| format!(", first on line {line}"));
    let what = if is_header { "section" } else { "key" };
    findings.add(
        codes::DUPLICATE,
        &text::shorten(&key),
        span.clone(),
        format!("{what} {} is given twice{before}", text::quote(name)),
        format!("remove one of the two: specgen does not guess which {what} counts"),
    );
}

/// The section header that applies at `offset`, and whether `offset` is on that header itself.
fn header_before(source: &str, offset: usize) -> (&str, bool) {
    let line_start = source[..offset].rfind('\n').map_or(0, |i| i + 1);
    let line_end = source[offset..].find('\n').map_or(source.len(), |i| offset + i);
    if let Some(name) = header_name(&source[line_start..line_end]) {
        return (name, true);
    }
    (source[..line_start].lines().rev().find_map(header_name).unwrap_or(""), false)
}

/// Start of the last section `header` before byte `before`, and its number from 0 if it has double brackets.
fn section_start(source: &str, header: &str, before: usize) -> (usize, Option<usize>) {
    let mut start = 0;
    let mut seen: usize = 0;
    let mut repeated = false;
    for (offset, line) in lines_with_offsets(&source[..before]).filter(|(_, line)| header_name(line) == Some(header)) {
        start = offset;
        seen += 1;
        repeated = line.trim_start().starts_with("[[");
    }
    (start, repeated.then(|| seen.saturating_sub(1)))
}

/// Number (from 1) of the first line between byte `from` and the line of `span` that `matches`.
fn first_line(source: &str, from: usize, span: &Range<usize>, matches: impl Fn(&str) -> bool) -> Option<usize> {
    let line_start = source[..span.start].rfind('\n').map_or(0, |i| i + 1);
    lines_with_offsets(&source[..line_start])
        .enumerate()
        .find(|(_, (offset, line))| *offset >= from && matches(line))
        .map(|(index, _)| index + 1)
}

fn lines_with_offsets(source: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut offset = 0;
    source.split_inclusive('\n').map(move |line| {
        let start = offset;
        offset += line.len();
        (start, line)
    })
}

/// "geometry" of "[geometry]  # comment"; only bare names and dots, as every section has.
fn header_name(line: &str) -> Option<&str> {
    let inner = line.trim_start().strip_prefix('[')?.trim_start_matches('[');
    let name = inner[..inner.find(']')?].trim();
    let bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    (!name.is_empty() && name.chars().all(bare)).then_some(name)
}

fn key_name(line: &str) -> Option<&str> {
    line.split_once('=').map(|(key, _)| key.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes_of(source: &str) -> Vec<&'static str> {
        let mut findings = Findings::default();
        parse(source, &mut findings);
        findings.all().iter().map(|d| d.code).collect()
    }

    #[test]
    fn several_mistakes_are_found_in_one_run() {
        let found = codes_of("a = 3 mm\na = 4\nb = \"x\nc = 5\n[d\n");
        assert_eq!(found.iter().filter(|c| **c == codes::DUPLICATE).count(), 1, "{found:?}");
        assert_eq!(found.iter().filter(|c| **c == codes::UNQUOTED).count(), 1, "{found:?}");
        assert_eq!(found.iter().filter(|c| **c == codes::SYNTAX).count(), 2, "{found:?}");
    }

    #[test]
    fn words_that_look_like_numbers_are_texts_without_quotes() {
        for word in
            ["f32", "invhys", "true_north", "nm", "150mm", "1.195kg", "40V/ms", "0.6mrad", "-2um", "60 µm", "0x mm"]
        {
            let mut findings = Findings::default();
            parse(&format!("a = {word} # comment\n"), &mut findings);
            let messages: Vec<_> = findings.all().iter().map(|d| (d.code, d.message.clone())).collect();
            let expected = format!("`{word}` is a text without quotes");
            assert_eq!(messages, [(codes::UNQUOTED.id, expected)], "{word}");
        }
    }

    #[test]
    fn a_duplicate_names_its_path_and_first_line() {
        let mut findings = Findings::default();
        parse("x = 1\n[a]\ny = 1\n[b]\nx = 2\nx = 3\n", &mut findings);
        assert_eq!(findings.all()[0].key, "b.x");
        assert!(findings.all()[0].message.contains("line 5"), "{}", findings.all()[0].message);
    }

    #[test]
    fn a_duplicate_in_a_repeated_section_names_its_own_table() {
        let mut findings = Findings::default();
        parse("[[g]]\nx = 1\n[a]\nx = 1\n[[g]]\nx = 2\nx = 3\n", &mut findings);
        assert_eq!(findings.all()[0].key, "g[1].x");
        assert!(findings.all()[0].message.contains("line 6"), "{}", findings.all()[0].message);
    }
}
