//! Files of other programs that are not read: recognised by their first bytes, with what to do.

use crate::findings::Findings;
use specgen_language::diagnostic::codes;

const UNPACK: &str = "unpack it, or pack it by gzip";
const AS_CSV: &str = "save time, drive and displacement as CSV";

/// First bytes of a file, what it is, and what to do.
const KNOWN: [(&[u8], &str, &str); 22] = [
    (b"\xd0\xcf\x11\xe0", "a spreadsheet of an old kind", "save the sheet as CSV in UTF-8"),
    (b"BZh", "packed by bzip2", UNPACK),
    (b"\xfd7zXZ\0", "packed by xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "packed by Zstandard", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "packed by 7-Zip", UNPACK),
    (b"Rar!", "packed by RAR", UNPACK),
    (b"\xff\xfe\0\0", "text in UTF-32", "save it in UTF-8"),
    (b"\0\0\xfe\xff", "text in UTF-32", "save it in UTF-8"),
    (b"%PDF", "a PDF document", AS_CSV),
    (b"{\\rtf", "a document in RTF", "save it as plain text"),
    (b"<!DOC", "a page in HTML", AS_CSV),
    (b"<html", "a page in HTML", AS_CSV),
    (b"<?xml", "a file in XML", AS_CSV),
    (b"{", "JSON", AS_CSV),
    (b"[{", "JSON", AS_CSV),
    (b"[[", "JSON", AS_CSV),
    (b"PAR1\x15", "a Parquet file", AS_CSV),
    (b"ARROW1\0", "an Arrow file", AS_CSV),
    (b"\x89PNG", "a picture", AS_CSV),
    (b"\x80\x04", "a pickle of Python", "save it with `numpy.savez` or as CSV"),
    (b"Record Length,", "an oscilloscope's file of one channel", "export all channels into one file"),
    (b"\"Record Length\",", "an oscilloscope's file of one channel", "export all channels into one file"),
];

/// Reports a file that is recognised by its first line; returns whether it was.
pub(crate) fn report(first: &[u8], findings: &mut Findings) -> bool {
    let Some((what, help)) = kind(first) else { return false };
    let message = format!("is {what}, which is not read");
    findings.add(codes::RECORD_NOT_TEXT, Some(1), message, help);
    true
}

fn kind(first: &[u8]) -> Option<(&'static str, &'static str)> {
    match first {
        [b'P', b'K', 3, 4, rest @ ..] => {
            // The name of its first file.
            let name = rest.get(26..).unwrap_or_default();
            let is_sheet =
                [&b"[Content_Types]"[..], b"_rels", b"mimetype", b"xl/"].iter().any(|of| name.starts_with(of));
            let help = if is_sheet { "save the sheet as CSV in UTF-8" } else { UNPACK };
            Some((if is_sheet { "a spreadsheet" } else { "a ZIP archive" }, help))
        }
        // MAT-files of version 4 begin with a type, rows, columns, and whether there are imaginary parts.
        [0..=52, 0, 0, 0, _, _, _, 0, 1..=255, _, _, 0, 0 | 1, 0, 0, 0, _, 0, 0, 0, ..] => {
            Some(("a MAT-file of version 4", "save it again with `save('record.mat', '-v7')`"))
        }
        // Of several channels.
        _ if first.starts_with(b"Record Length,Analog") => None,
        _ => KNOWN.iter().find(|(bytes, ..)| first.starts_with(bytes)).map(|(_, what, help)| (*what, *help)),
    }
}
