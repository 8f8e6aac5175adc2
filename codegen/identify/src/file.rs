//! Opens data files: to keep their text, or to read a table of them line by line.
//!
//! Text is read in sequence, whatever its size. Text in UTF-16, files packed by gzip and the binary files of
//! [`container`](super::container) are unpacked in memory, up to a limit.

use std::io::{self, Cursor, Read, Seek};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::columns::{self, Content, MAX_SAMPLES, MOST_TABLES, Part, foreign, names};
use super::container::{Columns, FARTHEST, Kind, Refusal, Table, only_file, unpack};
use super::findings::Findings;
use super::reading::{MaxSize, Reading, shown_size};
use super::tables::{self, Choice, Extent};
use specgen_language::arrays;
use specgen_language::diagnostic::{Diagnostic, codes};
pub use specgen_language::files::MAX_BYTES as MAX_FILE_BYTES;
use specgen_language::files::{self, ReadError};

/// The table of a file that is read.
pub(crate) struct Source<'a> {
    pub(crate) content: Content<'a>,
    pub(crate) choice: Choice,
}

impl<'a> Source<'a> {
    /// A text that has one table.
    #[cfg(test)]
    pub(crate) fn whole(lines: impl Read + 'a) -> Self {
        Self { content: Content::Text(Box::new(lines), Part::WHOLE), choice: Choice::default() }
    }

    /// A text, and the table `series` of it, or else the longest; `None` after the problem was reported.
    pub(crate) fn of_text(text: &'a [u8], series: Option<&str>, findings: &mut Findings) -> Option<Self> {
        let (part, choice, _) = part(text, series, findings)?;
        Some(Self { content: Content::Text(Box::new(text), part), choice })
    }

    /// A table of a file in memory.
    pub(crate) fn of_bytes(file: Vec<u8>, reading: &Reading, findings: &mut Findings) -> Option<Source<'static>> {
        let (limit, series) = (reading.max_size(), reading.series());
        let text = match unpacked(file, limit, findings)? {
            Unpacked::Text(text) => text,
            Unpacked::Tables(kind, file) => {
                let (columns, comment, choice) = table(kind, file, series, limit, findings)?;
                return Some(Source { content: Content::Arrays(columns, comment), choice });
            }
        };
        let (part, choice, rows) = part(&text[..], series, findings)?;
        let numbers = (rows * QUANTITIES * size_of::<f64>()) as u64;
        if numbers > limit.bytes {
            return too_large("has numbers that take", Some(numbers), limit, findings);
        }
        Some(Source { content: Content::Text(Box::new(Cursor::new(text)), part), choice })
    }
}

/// Most columns of a text that are read.
const QUANTITIES: usize = 4;

/// The content of a file.
enum Unpacked {
    /// Text, unless it is something unknown.
    Text(Vec<u8>),
    /// A binary file of tables.
    Tables(Kind, Vec<u8>),
}

/// The table of a text that is read, and its number of rows.
fn part(text: impl Read, series: Option<&str>, findings: &mut Findings) -> Option<(Part, Choice, usize)> {
    let (parts, extents): (Vec<Part>, Vec<Extent>) = columns::tables(text).into_iter().unzip();
    if parts.len() > MOST_TABLES {
        let message = format!("has more than {MOST_TABLES} tables: lines of text divide its rows");
        return findings.refuse(codes::RECORD_TOO_LARGE, None, message, "delete the text between the rows");
    }
    // What has no table is refused when it is read.
    let choice = match parts[..] {
        [] if series.is_none() => return Some((Part::WHOLE, Choice::default(), 0)),
        [_] if series.is_none() => Choice::default(),
        _ => tables::choose(&extents, is_record, &[], series, findings)?,
    };
    let part = parts[choice.table];
    report_behind(part, findings)?;
    Some((part, choice, extents[choice.table].rows))
}

/// Most lines behind a table that may be left out: means and the like.
const FEW: usize = 10;

/// Notes the lines behind a table that look like rows; `None` if there are too many.
fn report_behind(Part { behind: (count, first), .. }: Part, findings: &mut Findings) -> Option<()> {
    let message = format!("behind a line of text, rows are not read: {count} from line {first} on");
    match count {
        0 => {}
        1..=FEW => findings.add(codes::RECORD_PART, Some(first), message, "check that the record needs none of them"),
        _ => {
            let help = "delete the text between the rows, and behind them what is no row";
            return findings.refuse(codes::RECORD_VALUE, Some(first), message, help);
        }
    }
    Some(())
}

/// Columns and comments of the table of a binary file that is read.
fn table(
    kind: Kind,
    file: Vec<u8>,
    series: Option<&str>,
    limit: MaxSize,
    findings: &mut Findings,
) -> Option<(Columns, String, Choice)> {
    let mut found = match kind.tables(file, limit.bytes) {
        Ok(found) => found,
        Err(Refusal::Large(size)) => return too_large("unpacked, is", size, limit, findings),
        Err(Refusal::Because(why)) => {
            let message = format!("is {} and {why}", kind.name());
            let help = "save time, drive and displacement as arrays of numbers";
            return findings.refuse(codes::RECORD_NOT_TEXT, None, message, help);
        }
    };
    let extents: Vec<Extent> = found.tables.iter().map(Table::extent).collect();
    let chosen = tables::choose(&extents, is_record, &found.left_out, series, findings)?;
    Some((found.tables.swap_remove(chosen.table).columns(), found.comment.unwrap_or_default(), chosen))
}

/// Whether a table has names of a record.
fn is_record(table: &Extent) -> bool {
    table.columns.iter().filter(|name| names::is_known(name)).count() > 1
}

/// Whether a file that begins so is unpacked in memory.
fn is_packed(first: &[u8]) -> bool {
    Kind::of(first).is_some()
        || first.starts_with(&[0x1f, 0x8b])
        || first.starts_with(b"PK\x03\x04")
        || utf_16(first).is_some()
}

/// Whether the text in UTF-16 that begins so has its high bytes first, and the length of its mark. Without a mark, its
/// first two letters are of ASCII.
fn utf_16(first: &[u8]) -> Option<(bool, usize)> {
    match first {
        [0xff, 0xfe, 0, 0, ..] => None,
        [0xff, 0xfe, ..] => Some((false, 2)),
        [0xfe, 0xff, ..] => Some((true, 2)),
        [b'\t'..=b'~', 0, b'\t'..=b'~', 0, ..] => Some((false, 0)),
        [0, b'\t'..=b'~', 0, b'\t'..=b'~', ..] => Some((true, 0)),
        _ => None,
    }
}

/// Unpacks gzip or a ZIP archive of one file, then UTF-16; `None` after the problem was reported.
fn unpacked(mut file: Vec<u8>, limit: MaxSize, findings: &mut Findings) -> Option<Unpacked> {
    if file.starts_with(&[0x1f, 0x8b]) {
        let mut content = Vec::new();
        let farthest = limit.bytes.saturating_mul(FARTHEST);
        let size = match unpack(MultiGzDecoder::new(&file[..]), limit.bytes, farthest, &mut content) {
            Ok(size) => size,
            Err(error) => {
                let message = format!("is packed by gzip and cannot be unpacked: {error}");
                let help = "copy the file again, or pack it again";
                return findings.refuse(codes::RECORD_NOT_TEXT, None, message, help);
            }
        };
        if size.is_none_or(|size| size > limit.bytes) {
            return too_large("unpacked, is", size, limit, findings);
        }
        file = content;
    }
    if Kind::of(&file).is_none() && file.starts_with(b"PK\x03\x04") {
        match only_file(&file, limit.bytes) {
            Ok(None) => {}
            Ok(Some(content)) => file = content,
            Err(Refusal::Large(size)) => return too_large("unpacked, is", size, limit, findings),
            Err(Refusal::Because(why)) => {
                let message = format!("is a ZIP archive and cannot be unpacked: {why}");
                return findings.refuse(codes::RECORD_NOT_TEXT, None, message, "unpack it, or pack it again");
            }
        }
    }
    if let Some(kind) = Kind::of(&file) {
        return Some(Unpacked::Tables(kind, file));
    }
    if let Some((is_big_endian, marks)) = utf_16(&file) {
        let (pairs, odd) = file[marks..].as_chunks::<2>();
        if !odd.is_empty() {
            let message = "is text in UTF-16 that is cut off: it has an odd number of bytes".to_owned();
            return findings.refuse(codes::RECORD_NOT_TEXT, None, message, "copy the file again, or export it again");
        }
        let read = if is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
        let unit = |pair: &[u8; 2]| read(*pair);
        let text = char::decode_utf16(pairs.iter().map(unit)).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
        // At most three bytes each; growing it would take more.
        let mut whole = String::with_capacity(3 * pairs.len());
        whole.extend(text);
        return Some(Unpacked::Text(whole.into_bytes()));
    }
    Some(Unpacked::Text(file))
}

/// Refuses a file of `size` bytes in memory, if known.
fn too_large<T>(what: &str, size: Option<u64>, limit: MaxSize, findings: &mut Findings) -> Option<T> {
    let most = shown_size(limit.bytes);
    let message = match size {
        Some(size) => format!("{what} {} in memory, more than {most}", shown_size(size)),
        None => format!("{what} more than {FARTHEST} times as large as {most}"),
    };
    let mut help = format!("save only time, drive and displacement, or as plain text, up to {MAX_SAMPLES} samples");
    if let Some(size) = size.filter(|_| limit.is_option) {
        help = format!("give `--max-size {}` to `specgen identify`, or {help}", shown_size(size));
    }
    findings.refuse(codes::RECORD_TOO_LARGE, None, message, &help)
}

/// The text of a data file, record or table, without a byte order mark. A binary file of tables gives one as CSV.
///
/// # Errors
/// A finding if it is not a regular file, cannot be read, is larger than [`MAX_FILE_BYTES`], or is not UTF-8.
pub fn read_file(path: &Path, shown_as: &str) -> Result<String, Vec<Diagnostic>> {
    read_table(path, shown_as).map(|table| match table {
        TextOrArrays::Text(text) => text,
        TextOrArrays::Arrays(table) => table.csv(),
    })
}

/// A table as a file has it.
pub enum TextOrArrays {
    /// As text.
    Text(String),
    /// As arrays.
    Arrays(arrays::Table),
}

/// The same as [`read_file`], without making text of arrays.
///
/// # Errors
/// As [`read_file`].
pub fn read_table(path: &Path, shown_as: &str) -> Result<TextOrArrays, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    read_content(path, &mut findings).ok_or_else(|| findings.into_diagnostics())
}

/// The table, or `None` after the reason was reported.
fn read_content(path: &Path, findings: &mut Findings) -> Option<TextOrArrays> {
    let bytes = match files::open_file(path).and_then(|file| files::content(file, MAX_FILE_BYTES)) {
        Ok(bytes) => bytes,
        Err(ReadError::Large(limit)) => {
            let message = format!("is larger than {} MiB", limit >> 20);
            let help = "name the table that `specgen identify RECORD -o table.csv` makes of a record of any size";
            return findings.refuse(codes::RECORD_TOO_LARGE, None, message, help);
        }
        Err(unread) => {
            unreadable(&unread, findings);
            return None;
        }
    };
    let limit = MaxSize { bytes: MAX_FILE_BYTES, is_option: false };
    let bytes = match unpacked(bytes, limit, findings)? {
        Unpacked::Text(text) => text,
        Unpacked::Tables(kind, file) => {
            let (columns, comment, _) = table(kind, file, None, limit, findings)?;
            if !findings.is_empty() {
                let message = "has several tables, or parts that are no numbers".to_owned();
                let help = "save one table as CSV, or the table that `specgen identify RECORD -o table.csv` makes";
                return findings.refuse(codes::RECORD_HEADER, None, message, help);
            }
            let columns = columns.into_iter().map(|(name, values)| (name, arrays::Column::Numbers(values))).collect();
            return Some(TextOrArrays::Arrays(arrays::Table { columns, comment }));
        }
    };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    if foreign::report(bytes, findings) {
        return None;
    }
    let end_of_text = bytes.iter().position(|&b| b == 0);
    let bad = std::str::from_utf8(bytes).err().map(|e| e.valid_up_to());
    if let Some(at) = end_of_text.or(bad) {
        let line = 1 + bytes[..at].iter().filter(|&&b| b == b'\n').count();
        let message = format!("is not a text file in UTF-8: byte {at} is 0x{:02x}", bytes[at]);
        return findings.refuse(codes::RECORD_NOT_TEXT, Some(line), message, "export the record as CSV text in UTF-8");
    }
    Some(TextOrArrays::Text(String::from_utf8_lossy(bytes).into_owned()))
}

/// The table `series` of a data file, or else the longest; `None` after the reason was reported.
pub(crate) fn open_file(path: &Path, reading: &Reading, findings: &mut Findings) -> Option<Source<'static>> {
    let begin = || -> Result<_, ReadError> {
        let (mut file, mut first) = (files::open_file(path)?, Vec::new());
        (&mut file).take(Kind::TELLING as u64).read_to_end(&mut first)?;
        file.rewind()?;
        Ok((file, first))
    };
    let (mut file, first) = begin().map_err(|unread| unreadable(&unread, findings)).ok()?;
    if is_packed(&first) {
        let limit = reading.max_size();
        let size = file.metadata().ok().map(|found| found.len());
        return match files::content(file, limit.bytes) {
            Ok(bytes) => Source::of_bytes(bytes, reading, findings),
            Err(ReadError::Large(_)) => too_large("is no plain text, and is", size, limit, findings),
            Err(unread) => {
                unreadable(&unread, findings);
                None
            }
        };
    }
    let (part, choice, _) = part(&file, reading.series(), findings)?;
    file.rewind().map_err(|error: io::Error| unreadable(&error.into(), findings)).ok()?;
    Some(Source { content: Content::Text(Box::new(file), part), choice })
}

fn unreadable(unread: &ReadError, findings: &mut Findings) {
    findings.add(codes::RECORD_IO, None, format!("cannot be read: {unread}"), "name an existing CSV file");
}
