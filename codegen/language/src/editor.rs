//! Places in a text as editors count them, and the key or value there. The text may be half written, so this reads lines, not TOML.

pub mod complete;

use std::ops::Range;

pub use crate::lines::Lines;
use crate::spec::keys::{self, Key, Section};
use serde::{Deserialize, Serialize};

/// A place in a text: a line, and a UTF-16 unit in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Position {
    line: u32,
    character: u32,
}

/// Part of a text.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Part {
    /// The first place.
    pub start: Position,
    /// The place behind the last.
    pub end: Position,
}

/// Editors count lines and UTF-16 units from 0.
impl Lines<'_> {
    fn position(&self, byte: usize) -> Position {
        let (line, byte) = self.locate(byte);
        let column = self.text[self.starts[line]..byte].encode_utf16().count();
        Position { line: line as u32, character: column as u32 }
    }

    /// Positions of a range of bytes.
    pub fn part(&self, span: &Range<usize>) -> Part {
        Part { start: self.position(span.start), end: self.position(span.end) }
    }

    /// The byte at `position`; past the end of a line, the line's end.
    pub fn offset(&self, position: Position) -> usize {
        let Some(start) = self.starts.get(position.line as usize) else { return self.text.len() };
        let line = self.text[*start..].split('\n').next().unwrap_or_default();
        let mut units = 0;
        for (at, letter) in line.char_indices() {
            if units >= position.character as usize {
                return start + at;
            }
            units += letter.len_utf16();
        }
        start + line.len()
    }

    /// The first place of `words`, or the beginning.
    pub fn find(&self, words: &str) -> Range<usize> {
        self.text.find(words).map_or(0..0, |start| start..start + words.len())
    }
}

/// The key or value at a place.
pub struct Spot {
    /// The byte.
    offset: usize,
    /// Path of the table, such as `gauge[2]`; empty before the first.
    table: String,
    /// What that table is, if it is known.
    pub section: Option<&'static Section>,
    /// The key whose line or value this is.
    pub key: Option<&'static Key>,
    /// Whether the line is the header of a section.
    pub is_header: bool,
    /// The line up to the place.
    pub before: String,
    /// Whether the place is behind the equals sign of a key.
    pub in_value: bool,
}

impl Spot {
    /// Around a byte of a text.
    pub fn at(text: &str, offset: usize) -> Self {
        let end = text[offset..].find('\n').map_or(text.len(), |found| offset + found);
        let start = text[..offset].rfind('\n').map_or(0, |found| found + 1);
        let mut spot = Self {
            offset,
            table: String::new(),
            section: keys::section(""),
            key: None,
            is_header: false,
            before: text[start..offset].to_owned(),
            in_value: false,
        };
        let mut counts = std::collections::BTreeMap::<&str, usize>::new();
        // Brackets of a value that are still open: an array may go over lines.
        let mut depth = 0_i32;
        for line in text[..end].lines() {
            let code = line.split('#').next().unwrap_or_default().trim();
            let opens = code.starts_with('[') && depth == 0;
            spot.is_header = opens;
            if opens {
                let name = code.trim_matches(['[', ']']).trim();
                spot.section = keys::section(name);
                spot.key = None;
                spot.table = name.to_owned();
                if code.starts_with("[[") {
                    let count = counts.entry(name).or_default();
                    spot.table = format!("{name}[{count}]");
                    *count += 1;
                }
                continue;
            }
            if depth == 0 {
                let name = code.split('=').next().unwrap_or_default().trim();
                spot.key = spot.section.and_then(|section| section.keys.iter().find(|key| key.name == name));
            }
            let count = |bracket: char| code.matches(bracket).count() as i32;
            let open = depth > 0;
            depth = (depth + count('[') - count(']')).max(0);
            // Of the last line, the part before the place decides.
            spot.in_value = open || (spot.key.is_some() && spot.before.contains('='));
        }
        spot.in_value &= !spot.is_header;
        spot
    }

    /// Whether the table around the place has a key `name` already.
    pub fn has(&self, text: &str, name: &str) -> bool {
        self.own_lines(text).iter().any(|line| line.split('=').next().is_some_and(|found| found.trim() == name))
    }

    /// The lines of the table around the place.
    fn own_lines<'a>(&self, text: &'a str) -> Vec<&'a str> {
        let is_header = |line: &str| line.trim_start().starts_with('[') && line.trim_end().ends_with(']');
        let mut own = Vec::new();
        let mut at = 0;
        for line in text.split_inclusive('\n') {
            if is_header(line) {
                if at > self.offset {
                    break;
                }
                own.clear();
            }
            own.push(line);
            at += line.len();
        }
        own
    }

    /// Path of the key, such as `gauge[2].point`.
    pub fn path(&self) -> String {
        keys::join(&self.table, self.key.map_or("", |key| key.name))
    }
}

/// A path with `%20` and the like decoded.
pub fn decoded(path: &str) -> String {
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let [first, tail @ ..] = rest {
        let escaped = tail.get(..2).filter(|_| *first == b'%').and_then(|hex| std::str::from_utf8(hex).ok());
        match escaped.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            None => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "schema = 1\n[geometry]\nheight = \"180 mm\" # µ\n\n[[gauge]]\npoint = [\n  \"0 mm\",\n]\n[[gauge]]\npoi\n";

    fn spot(words: &str) -> Spot {
        let at = TEXT.find(words).map(|at| at + words.len());
        Spot::at(TEXT, at.unwrap_or_default())
    }

    #[test]
    fn a_place_knows_its_section_and_key_also_in_an_array_over_lines() {
        assert_eq!(spot("heig").path(), "geometry.height");
        assert!(!spot("heig").in_value && spot("\"180 ").in_value);
        let point = spot("\"0 m");
        assert_eq!((point.path().as_str(), point.in_value), ("gauge[0].point", true));
        let last = spot("poi\n");
        assert_eq!((last.section.map(|section| section.name), last.key.is_none()), (Some("gauge"), true));
        assert!(spot("[geom").is_header);
        assert_eq!(spot("sch").path(), "schema");
    }

    #[test]
    fn positions_count_utf_16_units_and_come_back() {
        let text = "a = \"µ𝛼\"\nb";
        let lines = Lines::new(text);
        for (offset, _) in text.char_indices() {
            assert_eq!(lines.offset(lines.position(offset)), offset);
        }
        let behind = text.find("\"\nb").unwrap_or_default();
        assert_eq!(lines.position(behind), Position { line: 0, character: 8 });
        assert_eq!(lines.offset(Position { line: 0, character: 99 }), text.find('\n').unwrap_or_default());
        assert_eq!(lines.offset(Position { line: 99, character: 0 }), text.len());
    }

    #[test]
    fn names_of_files_are_decoded() {
        assert_eq!(decoded("/home/my%20bench/%C2%B5.toml"), "/home/my bench/µ.toml");
        assert_eq!(decoded("/100%"), "/100%");
    }
}
