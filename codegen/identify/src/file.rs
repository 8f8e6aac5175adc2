//! Opens data files: to keep their text, or to read them line by line.

use std::io::{Read, Seek};
use std::path::Path;

use super::columns::foreign;
use super::container::Kind;
use super::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};
pub use specgen_language::files::MAX_BYTES as MAX_FILE_BYTES;
use specgen_language::files::{self, ReadError};

/// The text of a data file, record or table, without a byte order mark.
///
/// # Errors
/// A finding if it is not a regular file, cannot be read, is larger than [`MAX_FILE_BYTES`], or is not UTF-8.
pub fn read_file(path: &Path, shown_as: &str) -> Result<String, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    read_text(path, &mut findings).ok_or_else(|| findings.into_diagnostics())
}

/// The text of the file without a byte order mark, or `None` after the reason was reported.
fn read_text(path: &Path, findings: &mut Findings) -> Option<String> {
    findings.lies_at(path);
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
    Some(String::from_utf8_lossy(bytes).into_owned())
}

/// A data file to read lines from, or `None` after the reason was reported. A file of MATLAB, HDF5 or TDMS has the size
/// limit of a text in memory; any other is read in sequence.
pub(crate) fn open_file(path: &Path, findings: &mut Findings) -> Option<Box<dyn Read>> {
    findings.lies_at(path);
    let (mut file, mut first) =
        (files::open_file(path).map_err(|unread| unreadable(&unread, findings)).ok()?, Vec::new());
    let begun = (&mut file).take(Kind::TELLING as u64).read_to_end(&mut first).and_then(|_| file.rewind());
    let bytes = begun.and_then(|()| file.metadata()).map_err(|error| unreadable(&error.into(), findings)).ok()?.len();
    let Some(kind) = Kind::of(&first) else { return Some(Box::new(file)) };
    if bytes > MAX_FILE_BYTES {
        foreign::report_as(&first, &format!("and larger than {} MiB", MAX_FILE_BYTES >> 20), findings);
        return None;
    }
    kind.open(file, path)
        .map(|lines| Box::new(lines) as Box<dyn Read>)
        .map_err(|why| foreign::report_as(&first, &format!("and {why}"), findings))
        .ok()
}

fn unreadable(unread: &ReadError, findings: &mut Findings) {
    findings.add(codes::RECORD_IO, None, format!("cannot be read: {unread}"), "name an existing CSV file");
}
