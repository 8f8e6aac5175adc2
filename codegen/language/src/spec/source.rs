//! Reads the spec file as text.

// clippy finds a finding too large for a Result. There is one per run, and every phase shares its type.
#![expect(clippy::result_large_err)]

use std::path::Path;

use crate::SpecSource;
use crate::diagnostic::{Diagnostic, codes};
use crate::files::{self, ReadError};
use crate::shell;

/// Largest spec file, bytes.
pub const MAX_BYTES: usize = 1 << 20;

impl SpecSource {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// One finding (E0101 to E0103) if it cannot be opened, is larger than [`MAX_BYTES`], or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let display_name = path.display().to_string();
        let bytes = read_bytes(path, &display_name)?;
        let text = into_text(bytes, &display_name)?;
        let dir = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        note_files(&text, dir);
        Ok(Self { display_name, text, dir: dir.to_path_buf() })
    }
}

/// Every file that the spec names belongs to it, whether or not the command reads it: no output may replace it.
fn note_files(text: &str, dir: &Path) {
    fn note(value: &toml::Value, dir: &Path) {
        match value {
            toml::Value::String(name) => files::note_input(&dir.join(name)),
            toml::Value::Array(values) => values.iter().for_each(|value| note(value, dir)),
            toml::Value::Table(table) => table.values().for_each(|value| note(value, dir)),
            _ => {}
        }
    }
    if let Ok(table) = text.parse::<toml::Table>() {
        note(&toml::Value::Table(table), dir);
    }
}

fn read_bytes(path: &Path, shown: &str) -> Result<Vec<u8>, Diagnostic> {
    files::read(path, MAX_BYTES as u64).map_err(|unread| match unread {
        ReadError::Large(_) => Diagnostic::in_file(
            shown,
            None,
            codes::TOO_LARGE,
            "the spec file is larger than 1 MiB, expected a few kilobytes",
            "name the .toml spec; measurements belong in CSV files that the spec refers to",
        ),
        ReadError::Kind(kind) if path.is_dir() => {
            let reason = format!("the spec file cannot be read: this is {kind}");
            Diagnostic::in_file(shown, None, codes::UNREADABLE, reason, "name the .toml file in it")
        }
        unread => {
            let reason = format!("the spec file cannot be read: {unread}");
            Diagnostic::in_file(shown, None, codes::UNREADABLE, reason, unread.help())
        }
    })
}

fn into_text(bytes: Vec<u8>, shown: &str) -> Result<String, Diagnostic> {
    // Some bytes of a text in another encoding may be valid UTF-8; but no text contains a zero byte.
    if let Some(found) = other_encoding(&bytes, shown) {
        return Err(found);
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = 1 + bytes[..offset].iter().filter(|b| **b == b'\n').count();
        // `valid_up_to` is before the end: the byte there is the invalid one.
        let byte = bytes.get(offset).copied().unwrap_or_default();
        Diagnostic::in_file(
            shown,
            Some(line),
            codes::NOT_TEXT,
            format!("the spec file is not UTF-8 text: byte {offset} (line {line}) is 0x{byte:02x}"),
            "save the file as UTF-8; a unit may be written without special characters, such as \"um\" or \"deg\"",
        )
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// UTF-16 and UTF-32, by their marks and by their zeros.
fn other_encoding(bytes: &[u8], shown: &str) -> Option<Diagnostic> {
    let marked = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    let zero = bytes.iter().position(|byte| *byte == 0);
    if !marked && zero.is_none_or(|_| std::str::from_utf8(bytes).is_err()) {
        return None;
    }
    let offset = if marked { 0 } else { zero.unwrap_or_default() };
    let line = 1 + bytes[..offset].iter().filter(|b| **b == b'\n').count();
    let looks = if marked { "it begins with the mark of UTF-16".to_owned() } else { format!("byte {offset} is zero") };
    // The first letter of a spec is ASCII, so half of it is zero.
    let encoding = match (marked, offset) {
        (true, _) => Some("UTF-16"),
        (false, 0) => Some("UTF-16BE"),
        (false, 1) => Some("UTF-16LE"),
        (false, _) => None,
    };
    let by = encoding.map_or_else(String::new, |encoding| {
        format!(", not as UTF-16 (\"Unicode\" in some editors): {}", shell::as_utf8(encoding, shown))
    });
    Some(Diagnostic::in_file(
        shown,
        Some(line),
        codes::NOT_TEXT,
        format!("the spec file is not UTF-8 text: {looks} (line {line})"),
        format!("save the file as UTF-8{by}"),
    ))
}
