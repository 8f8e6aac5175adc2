//! Byte spans to lines and columns.

use std::ops::Range;

use crate::lines::Lines;

/// Start of a span, and its part on that line.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Spot<'a> {
    /// Counted from 1.
    pub(super) line: usize,
    /// In characters, from 1.
    pub(super) column: usize,
    /// The line without its end.
    pub(super) line_text: &'a str,
    /// Bytes of the span within `line_text`.
    pub(super) in_line: Range<usize>,
}

impl<'a> Lines<'a> {
    /// Any range: it is limited to the text and to whole characters.
    pub(super) fn spot(&self, span: &Range<usize>) -> Spot<'a> {
        let (index, start) = self.locate(span.start);
        let line_start = self.starts[index];
        let line_end = self.starts.get(index + 1).map_or(self.text.len(), |next| next - 1);
        let line_text = self.text[line_start..line_end].trim_end_matches('\r');
        let from = (start - line_start).min(line_text.len());
        let mut to = span.end.saturating_sub(line_start).clamp(from, line_text.len());
        while !line_text.is_char_boundary(to) {
            to += 1;
        }
        Spot { line: index + 1, column: line_text[..from].chars().count() + 1, line_text, in_line: from..to }
    }
}

/// A part of a line around a span.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) text: String,
    pub(super) span: Range<usize>,
    /// Whether the line starts before the part.
    pub(super) cut_left: bool,
}

/// At most about `max` characters of `line` around `span` (byte range on character boundaries).
pub(super) fn window(line: &str, span: Range<usize>, max: usize) -> Window {
    // Counting a line of a megabyte for each finding would be slow.
    if line.len() <= max || line.chars().nth(max).is_none() {
        return Window { text: line.to_owned(), span, cut_left: false };
    }
    let before: Vec<usize> = line[..span.start].char_indices().rev().take(max / 4).map(|(i, _)| i).collect();
    let from = before.last().copied().unwrap_or(span.start);
    let to = line[from..].char_indices().nth(max).map_or(line.len(), |(i, _)| from + i);
    let head = if from > 0 { "…" } else { "" };
    let tail = if to < line.len() { "…" } else { "" };
    let span_end = span.end.min(to);
    let shift = |at: usize| at - from + head.len();
    Window {
        text: format!("{head}{}{tail}", &line[from..to]),
        span: shift(span.start)..shift(span_end.max(span.start)),
        cut_left: from > 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_in_characters() {
        let lines = Lines::new("a = 1\r\n\u{b5} = 22\n");
        let spot = lines.spot(&(12..14));
        assert_eq!((spot.line, spot.column, spot.line_text), (2, 5, "\u{b5} = 22"));
        assert_eq!(&spot.line_text[spot.in_line], "22");
        assert_eq!(lines.spot(&(999..1000)).line, 3);
        assert_eq!(lines.spot(&(8..9)).column, 1, "inside a character");
    }

    #[test]
    fn a_long_line_is_cut_around_the_span() {
        let line = format!("{}HERE{}", "x".repeat(500), "y".repeat(500));
        let cut = window(&line, 500..504, 80);
        assert!(cut.cut_left);
        assert_eq!(&cut.text[cut.span.clone()], "HERE");
        assert!(cut.text.chars().count() <= 82);
        let start = window(&line, 0..3, 80);
        assert!(!start.cut_left);
        assert_eq!(&start.text[start.span.clone()], "xxx");
    }
}
