//! Separators and number formats of a file.

/// Separators in the order in which they are tried. Apart from the comma, none of them occurs in a number.
pub(super) const SEPARATORS: [u8; 4] = [b'\t', b';', b',', BLANK];
/// Any number of blanks and tabs.
const BLANK: u8 = b' ';

/// The fields of a line, without blanks and quotation marks around them.
pub(super) fn split(line: &[u8], separator: u8) -> Vec<&[u8]> {
    let mut fields = Vec::new();
    let (mut start, mut quoted) = (0, false);
    for (k, byte) in line.iter().enumerate() {
        if *byte == b'"' {
            quoted = !quoted;
        } else if !quoted && (*byte == separator || separator == BLANK && *byte == b'\t') {
            fields.push(clean(&line[start..k]));
            start = k + 1;
        }
    }
    fields.push(clean(&line[start..]));
    if separator == BLANK {
        fields.retain(|field| !field.is_empty());
    }
    fields
}

fn clean(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    match field {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        _ => field,
    }
}

/// Text of a line with names: UTF-8, or else Latin-1, in which many instruments write their µ.
pub(super) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// A number with its decimal sign, if it has one.
pub(super) fn number(field: &str, separator: u8) -> Option<(f64, Option<char>)> {
    if let Ok(value) = field.parse() {
        return Some((value, field.contains('.').then_some('.')));
    }
    if separator == b',' || field.contains('.') || field.matches(',').count() != 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().map(|value| (value, Some(',')))
}

/// Whether a line is a row of numbers: at least two fields, some of which may be empty, but not all.
pub(super) fn is_row(line: &[u8], separator: u8) -> bool {
    let fields = split(line, separator);
    let is_number = |field: &&[u8]| std::str::from_utf8(field).is_ok_and(|text| number(text, separator).is_some());
    let filled = fields.iter().filter(|field| !field.is_empty());
    fields.len() > 1 && filled.clone().count() > 0 && filled.clone().all(is_number)
}

/// Whether a line is empty, or has only separators.
pub(super) fn is_blank(line: &[u8]) -> bool {
    line.iter().all(|byte| matches!(byte, b' ' | b'\t' | b'\r' | b';' | b','))
}

pub(super) fn is_comment(line: &[u8]) -> bool {
    matches!(line.first(), Some(b'#' | b'%'))
}

/// Whether a line marks its file as simulated: a comment whose first word is `simulated`.
pub(super) fn is_mark(line: &[u8]) -> bool {
    let words = line.trim_ascii_start().iter().skip_while(|byte| matches!(byte, b'#' | b'%' | b' ' | b'\t'));
    let first: Vec<u8> = words.take_while(|byte| byte.is_ascii_alphabetic()).copied().collect();
    is_comment(line) && first.eq_ignore_ascii_case(b"simulated")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_or_where_that_is_no_separator_a_comma() {
        assert_eq!(number("-12.5e-3", b','), Some((-12.5e-3, Some('.'))));
        assert_eq!(number("-12,5e-3", b';'), Some((-12.5e-3, Some(','))));
        assert_eq!(number("7", b';'), Some((7.0, None)));
        for bad in ["1.234,5", "1,234,5", "", "1 2", "2 V"] {
            assert_eq!(number(bad, b';'), None, "{bad}");
        }
        assert_eq!(number("1,5", b','), None);
    }

    #[test]
    fn a_comment_that_begins_so_marks_a_file_as_simulated() {
        for mark in ["# simulated by specgen", "%Simulated", "#  simulated: by hand"] {
            assert!(is_mark(mark.as_bytes()), "{mark}");
        }
        for other in ["simulated", "# not simulated", "# simulatedly", "0,1,2", "# drive simulated by a source", ""] {
            assert!(!is_mark(other.as_bytes()), "{other}");
        }
    }

    #[test]
    fn fields_lose_blanks_and_quotation_marks() {
        assert_eq!(split(b" a ,\"b, c\",", b','), [&b"a"[..], b"b, c", b""]);
        assert_eq!(split(b"  1   2\t3 ", b' '), [b"1", b"2", b"3"]);
        assert!(is_row(b"1,5;2;", b';') && !is_row(b"1;x", b';') && !is_row(b";", b';') && !is_row(b"1,5", b';'));
    }
}
