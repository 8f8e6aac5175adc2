//! Arrays of NumPy (NEP 1): a header that describes them, then their values.

use super::bytes::{
    Bytes, DAMAGED, FARTHEST, Form, LONGEST_NAME, LONGEST_TEXT, MOST_ARRAYS, MOST_DIMENSIONS, Refusal, Space, unpack,
};
use super::{Array, Contents};
use crate::columns::decoded;
use flate2::read::DeflateDecoder;
use rawzip::{CompressionMethod, ZipArchive, ZipFileHeaderRecord, ZipSliceArchive};
use specgen_language::arrays::COMMENT;

/// Bytes of magic and version.
const VERSION: usize = 8;
/// Longest header, bytes: one of version 1 is shorter than 64 KiB.
const LONGEST_HEADER: usize = 1 << 20;

/// A field of a record: its name, format and place.
struct Field {
    name: String,
    form: Form,
    is_big_endian: bool,
}

/// The columns of a file: the fields of a structured array, or the columns of one or two dimensions.
pub(super) fn contents(file: &[u8], limit: u64) -> Result<Contents, Refusal> {
    let mut space = Space::new(limit);
    let contents = array(file, &mut space)?;
    space.check()?;
    Ok(contents)
}

/// The columns of an array; none if there is no space for them.
fn array(file: &[u8], space: &mut Space) -> Result<Contents, String> {
    let (version, rest) = file.split_at_checked(VERSION).ok_or(DAMAGED)?;
    let mut rest = Bytes { rest, is_big_endian: false };
    let length = if version[6] == 1 {
        let bytes = rest.take(2)?;
        usize::from(bytes[0]) | usize::from(bytes[1]) << 8
    } else {
        rest.word()? as usize
    };
    if length > LONGEST_HEADER {
        return Err(format!("its header has {length} bytes, more than {LONGEST_HEADER}"));
    }
    let header = decoded(rest.take(length)?);
    let (shape, _) = value(&header, "shape")?.trim_start_matches('(').split_once(')').ok_or(DAMAGED)?;
    // Python 2 wrote 1000L.
    let lengths =
        shape.split(',').map(|length| length.trim().trim_end_matches('L')).filter(|length| !length.is_empty());
    let shape = lengths.map(|length| length.parse().map_err(|_| DAMAGED)).collect::<Result<Vec<usize>, _>>()?;
    let fields = fields(value(&header, "descr")?)?;
    let in_columns = value(&header, "fortran_order")?.starts_with("True");
    if shape.len() > MOST_DIMENSIONS || fields.len() > MOST_ARRAYS {
        return Err(format!("it has {} dimensions and {} fields", shape.len(), fields.len()));
    }
    let count = shape.iter().try_fold(1_usize, |count, length| count.checked_mul(*length)).ok_or(DAMAGED)?;
    let width = fields
        .iter()
        .try_fold(0_usize, |sum, field| sum.checked_add(field.form.1))
        .filter(|width| *width > 0)
        .ok_or(DAMAGED)?;
    let bytes = rest.take(count.checked_mul(width).ok_or(DAMAGED)?)?;
    if !rest.rest.is_empty() {
        return Err("it has more than one array, or its header is damaged".to_owned());
    }
    let mut contents = Contents::default();
    if !space.has(count.saturating_mul(fields.len())) {
        return Ok(contents);
    }
    let mut at = 0;
    for Field { name, form, is_big_endian } in fields {
        let of_field: Vec<u8>;
        let own = if width == form.1 {
            bytes
        } else {
            of_field = bytes.chunks_exact(width.max(1)).flat_map(|row| &row[at..at + form.1]).copied().collect();
            &of_field[..]
        };
        at += form.1;
        match form.0 {
            'i' | 'u' | 'f' => {
                let values = Bytes { rest: own, is_big_endian }.numbers(form);
                let mut size = shape.clone();
                if !in_columns {
                    size.reverse();
                }
                contents.add(Array { group: String::new(), name, size, values }, form);
            }
            kind => {
                if kind == 'U' && shape.is_empty() && own.len() <= LONGEST_TEXT {
                    let letters = Bytes { rest: own, is_big_endian }.numbers(('u', 4));
                    contents.comment = Some(letters.into_iter().filter_map(|c| char::from_u32(c as u32)).collect());
                }
                contents.others.push((name, "no array of numbers".to_owned()));
            }
        }
    }
    Ok(contents)
}

/// Whether a file that begins so is an archive of arrays: by the name of its first file.
pub(super) fn is_archive(first: &[u8]) -> bool {
    let length = first.get(26..28).map_or(0, |bytes| usize::from(bytes[0]) | usize::from(bytes[1]) << 8);
    let name = first.get(30..).map(|rest| &rest[..length.min(rest.len())]);
    first.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(b".npy"))
}

/// The content of an archive of one file, apart from folders and what macOS adds; none if it has several, or is a sheet.
pub(crate) fn only_file(file: &[u8], limit: u64) -> Result<Option<Vec<u8>>, Refusal> {
    // Its first bytes show what it may be.
    let Ok(archive) = ZipArchive::from_slice(file) else { return Ok(None) };
    let mut found = None;
    for entry in archive.entries() {
        let entry = entry.map_err(|_| DAMAGED)?;
        let path = decoded(entry.file_path().as_ref());
        if path.ends_with('/') || path.starts_with("__MACOSX/") {
            continue;
        }
        if found.is_some() {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        let farthest = limit.saturating_mul(FARTHEST);
        match unpack_entry(&archive, &entry, &path, [limit, farthest], &mut bytes)? {
            Some(size) if size <= limit => found = Some(bytes),
            size => return Err(Refusal::Large(size)),
        }
    }
    Ok(found)
}

/// Number of bytes of a file in an archive, of which the first `left` are added to `bytes`; none if there are more than
/// `farthest`.
fn unpack_entry(
    archive: &ZipSliceArchive<&[u8]>,
    entry: &ZipFileHeaderRecord,
    path: &str,
    [left, farthest]: [u64; 2],
    bytes: &mut Vec<u8>,
) -> Result<Option<u64>, Refusal> {
    let packed = archive.get_entry(entry.wayfinder()).map_err(|_| DAMAGED)?;
    let data = packed.data();
    let size = match entry.compression_method() {
        CompressionMethod::STORE => unpack(packed.verifying_reader(data), left, farthest, bytes),
        CompressionMethod::DEFLATE => unpack(packed.verifying_reader(DeflateDecoder::new(data)), left, farthest, bytes),
        _ => return Err("it is packed in an unusual way: pack it by deflate, as numpy.savez does".into()),
    };
    size.map_err(|_| format!("its `{path}` is damaged").into())
}

/// The arrays of an archive, which are called as their files.
pub(super) fn of_archive(file: &[u8], limit: u64) -> Result<Contents, Refusal> {
    let archive = ZipArchive::from_slice(file).map_err(|_| DAMAGED)?;
    let mut contents = Contents::default();
    let (mut space, mut unpacked) = (Space::new(limit), 0);
    for entry in archive.entries() {
        if contents.is_full() {
            break;
        }
        let entry = entry.map_err(|_| DAMAGED)?;
        let path = decoded(entry.file_path().as_ref());
        if path.len() > LONGEST_NAME {
            return Err(format!("it has a name of more than {LONGEST_NAME} bytes").into());
        }
        let Some(name) = path.strip_suffix(".npy") else { continue };
        let (left, farthest) = (limit.saturating_sub(unpacked), limit.saturating_mul(FARTHEST) - unpacked);
        let mut bytes = Vec::new();
        let size = unpack_entry(&archive, &entry, &path, [left, farthest], &mut bytes)?;
        unpacked += size.ok_or(Refusal::Large(None))?;
        if unpacked > limit {
            // Counted only.
            continue;
        }
        match array(&bytes, &mut space) {
            Ok(found) => {
                contents.comment = contents.comment.or(found.comment.filter(|_| name == COMMENT));
                let is_comment = name == COMMENT && contents.comment.is_some();
                let called = |own: String| if own.is_empty() { name.to_owned() } else { own };
                contents.arrays.extend(found.arrays.into_iter().map(|one| Array { name: called(one.name), ..one }));
                let others = found.others.into_iter().filter(|_| !is_comment);
                contents.others.extend(others.map(|(own, what)| (called(own), what)));
            }
            Err(why) => contents.others.push((name.to_owned(), why)),
        }
    }
    if unpacked > limit {
        return Err(Refusal::Large(Some(unpacked)));
    }
    space.check()?;
    Ok(contents)
}

/// The text of the header from the value of `key` on.
fn value<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let (_, rest) = header.split_once(&format!("'{key}'")).ok_or(DAMAGED)?;
    Ok(rest.trim_start().strip_prefix(':').ok_or(DAMAGED)?.trim_start())
}

/// The fields of a description such as `'<f8'` or `[('time_s', '<f8'), ('drive_V', '<f4')]`.
fn fields(text: &str) -> Result<Vec<Field>, String> {
    let several = || "it has fields of more than one number".to_owned();
    if let Some(mut rest) = text.strip_prefix('[') {
        let mut fields = Vec::new();
        while let Some(field) = rest.trim_start_matches([' ', ',']).strip_prefix('(') {
            // Behind the format there may be a shape.
            let (name, format) = quoted(field).ok_or_else(several)?;
            let (form, end) = quoted(format.trim_start_matches([' ', ','])).ok_or_else(several)?;
            rest = end.strip_prefix(')').ok_or_else(several)?;
            fields.push(of_form(name, form)?);
        }
        return if fields.is_empty() { Err(DAMAGED.to_owned()) } else { Ok(fields) };
    }
    let form = text.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).ok_or(DAMAGED)?.0;
    Ok(vec![of_form("", form)?])
}

/// The text in quotation marks at the beginning of `text`, and the rest.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let mark = text.chars().next().filter(|mark| matches!(mark, '\'' | '"'))?;
    text[1..].split_once(mark)
}

/// A field with a format such as `<f8`.
fn of_form(name: &str, text: &str) -> Result<Field, String> {
    let unsupported = || format!("it has values of type {text}");
    let is_big_endian = text.starts_with('>');
    let text = text.trim_start_matches(['<', '>', '|', '=']);
    let mut letters = text.chars();
    let (Some(kind), Ok(width)) = (letters.next(), letters.as_str().parse::<usize>()) else {
        return Err(unsupported());
    };
    let bytes = match kind {
        'U' => width.checked_mul(4).ok_or_else(unsupported)?,
        _ => width,
    };
    if matches!((kind, width), ('f', 2 | 12 | 16)) || !kind.is_ascii_alphabetic() {
        return Err(unsupported());
    }
    Ok(Field { name: name.to_owned(), form: (kind, bytes), is_big_endian })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, values: &[u8]) -> Vec<u8> {
        let length = (header.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\0", &length[..], header.as_bytes(), values].concat()
    }

    #[test]
    fn fields_and_columns_of_both_orders_are_read() {
        let descr = "[('time_s', '<f8'), ('n', '|b1'), ('drive [V] (a)', '>i2')]";
        let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (2,), }}\n");
        let row = |t: f64, u: i16| [&t.to_le_bytes()[..], &[1], &u.to_be_bytes()].concat();
        let found = contents(&file(&header, &[row(0.5, -3), row(1.5, 4)].concat()), u64::MAX).unwrap();
        let columns: Vec<_> = found.arrays.iter().map(|array| (array.name.as_str(), array.values.clone())).collect();
        assert_eq!(columns, [("time_s", vec![0.5, 1.5]), ("drive [V] (a)", vec![-3.0, 4.0])]);
        assert_eq!(found.others[0].0, "n");
        for (order, size) in [("True", [3, 2]), ("False", [2, 3])] {
            let header = format!("{{'descr': '<f4', 'fortran_order': {order}, 'shape': (3, 2), }}\n");
            let values: Vec<u8> = (0..6_u8).flat_map(|k| f32::from(k).to_le_bytes()).collect();
            let found = contents(&file(&header, &values), u64::MAX).unwrap();
            assert_eq!((&found.arrays[0].size[..], found.arrays[0].values[5]), (&size[..], 5.0));
            assert!(contents(&file(&header, &values[1..]), u64::MAX).is_err());
        }
        for bad in ["{'descr': '<c16', 'shape': (2,)}", "{'descr': [('a', '<f8', (3,))], 'shape': (2,)}", "{}"] {
            assert!(contents(&file(bad, &[0; 99]), u64::MAX).is_err(), "{bad}");
        }
    }

    #[test]
    fn headers_are_limited() {
        let dimensions = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({})}}", "1,".repeat(33));
        let found = contents(&file(&dimensions, &[0; 8]), u64::MAX).map(|_| ());
        assert!(matches!(found, Err(Refusal::Because(why)) if why.contains("33 dimensions")));
        let long = [b"\x93NUMPY\x02\0", &(2_u32 << 20).to_le_bytes()[..], &vec![b' '; 2 << 20]].concat();
        let found = contents(&long, u64::MAX).map(|_| ());
        assert!(matches!(found, Err(Refusal::Because(why)) if why.contains("2097152 bytes")));
    }

    #[test]
    fn integers_that_are_rounded_are_named() {
        let read = |value: i64| {
            let header = "{'descr': '<i8', 'fortran_order': False, 'shape': (1,), }";
            let found = contents(&file(header, &value.to_le_bytes()), u64::MAX).unwrap();
            (found.arrays[0].values[0], found.others)
        };
        let most = 1 << 53;
        assert_eq!(read(most - 1), (9_007_199_254_740_991.0, Vec::new()));
        let (value, others) = read(-most - 1);
        assert!(value == -9_007_199_254_740_992.0 && others[0].1.contains("last digits"), "{others:?}");
    }
}
