//! MAT-files of version 5 (MathWorks, MAT-File Format): a sequence of elements, each with type, length and bytes.

use std::io::Read;
use std::ops::RangeInclusive;

use flate2::read::ZlibDecoder;

use super::bytes::{Bytes, DAMAGED};
use super::{Columns, is_column};

/// Bytes before the first element; the last two show the byte order.
const HEADER: usize = 128;
/// Type of an array, whose parts are elements.
const ARRAY: u32 = 14;
/// Type of an element that contains another in zlib format.
const COMPRESSED: u32 = 15;
/// Classes of arrays of numbers.
const NUMBERS: RangeInclusive<u8> = 6..=15;

/// Type and bytes of the next element.
fn element<'a>(from: &mut Bytes<'a>) -> Result<(u32, &'a [u8]), String> {
    let kind = from.word()?;
    if kind >> 16 > 0 {
        // At most four bytes, in the place of the length.
        let bytes = from.take(4)?.get(..(kind >> 16) as usize).ok_or(DAMAGED)?;
        return Ok((kind & 0xffff, bytes));
    }
    let length = from.word()? as usize;
    let bytes = from.take(length)?;
    // All elements but compressed ones are aligned to eight bytes.
    if kind != COMPRESSED {
        from.rest = from.rest.get(length.wrapping_neg() % 8..).unwrap_or_default();
    }
    Ok((kind, bytes))
}

/// The values of the next element.
fn numbers(from: &mut Bytes) -> Result<Vec<f64>, String> {
    let (kind, rest) = element(from)?;
    let form = match kind {
        1 => ('i', 1),
        2 => ('u', 1),
        3 => ('i', 2),
        4 => ('u', 2),
        5 => ('i', 4),
        6 => ('u', 4),
        7 => ('f', 4),
        9 => ('f', 8),
        12 => ('i', 8),
        13 => ('u', 8),
        _ => return Err(DAMAGED.to_owned()),
    };
    Ok(Bytes { rest, ..*from }.numbers(form))
}

/// Name and values of an array with these parts; none if it is not a column.
fn column(mut parts: Bytes) -> Result<Option<(String, Vec<f64>)>, String> {
    let (_, flags) = element(&mut parts)?;
    let class = flags.get(if parts.is_big_endian { 3 } else { 0 }).ok_or(DAMAGED)?;
    if !NUMBERS.contains(class) {
        return Ok(None);
    }
    let size = numbers(&mut parts)?;
    let (_, name) = element(&mut parts)?;
    // For complex numbers, the real part.
    let values = numbers(&mut parts)?;
    if size.iter().product::<f64>() != values.len() as f64 {
        return Err(DAMAGED.to_owned());
    }
    Ok(is_column(&size).then(|| (String::from_utf8_lossy(name).into_owned(), values)))
}

/// The columns of a file.
pub(super) fn columns(file: &[u8]) -> Result<Columns, String> {
    let (header, rest) = file.split_at_checked(HEADER).ok_or(DAMAGED)?;
    let mut file = Bytes { rest, is_big_endian: header.ends_with(b"MI") };
    let mut columns = Columns::new();
    while !file.rest.is_empty() {
        let (mut kind, mut rest) = element(&mut file)?;
        let mut inflated = Vec::new();
        if kind == COMPRESSED {
            ZlibDecoder::new(rest).read_to_end(&mut inflated).map_err(|error| error.to_string())?;
            (kind, rest) = element(&mut Bytes { rest: &inflated, ..file })?;
        }
        if kind == ARRAY {
            columns.extend(column(Bytes { rest, ..file })?);
        }
    }
    Ok(columns)
}
