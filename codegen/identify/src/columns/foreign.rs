//! Files of other programs that are not read: recognised by their first bytes, with what to do.

use crate::findings::Findings;
use specgen_language::diagnostic::codes;

/// Reports a file that is recognised by its first line; returns whether it was.
pub(crate) fn report(first: &[u8], findings: &mut Findings) -> bool {
    let what = match first {
        [b'P', b'K', 3, 4, ..] => "a ZIP archive, as spreadsheets are",
        [0xd0, 0xcf, 0x11, 0xe0, ..] => "a spreadsheet of an old kind",
        _ => return false,
    };
    let message = format!("is {what}, not a text file");
    findings.add(codes::RECORD_NOT_TEXT, Some(1), message, "save the sheet as CSV in UTF-8");
    true
}
