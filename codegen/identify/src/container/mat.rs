//! MAT-files of version 5 (MathWorks, MAT-File Format): a sequence of elements, each with type, length and bytes.
//!
//! Structs give their arrays. An array with a text beside it is called by that text, as dSPACE writes it: `X.Data` is the
//! time in s, and each `Y(k).Data` a signal with the name `Y(k).Name`.

use std::ops::RangeInclusive;

use flate2::read::ZlibDecoder;

use super::bytes::{
    Bytes, DAMAGED, FARTHEST, Form, LONGEST_NAME, LONGEST_TEXT, MOST_DIMENSIONS, Refusal, Space, unpack,
};
use super::{Array, Contents};
use crate::columns::decoded;
use crate::columns::names::with_unit;
use specgen_language::arrays::COMMENT;

/// Name of a time in s.
const TIME: &str = "time_s";
/// Bytes before the first element; the last two show the byte order.
const HEADER: usize = 128;
/// Type of an array, whose parts are elements.
const ARRAY: u32 = 14;
/// Type of an element that contains another in zlib format.
const COMPRESSED: u32 = 15;
/// Classes of arrays of numbers.
const NUMBERS: RangeInclusive<u8> = 6..=15;
/// Flag of an array with imaginary parts.
const COMPLEX: u8 = 8;
const STRUCT: u8 = 2;
const TEXT: u8 = 4;
/// Objects of classes: texts in double quotes, time series, tables.
const OPAQUE: u8 = 17;
/// Levels of structs that are read.
const DEEPEST: usize = 6;

/// A variable, or a field of a struct.
enum Value {
    /// Size, values and their form in the file; whether there are imaginary parts, too.
    Numbers(Vec<usize>, Vec<f64>, Form, bool),
    Text(String),
    /// Names of the fields, and the values of the fields of each struct in turn.
    Structs(Vec<String>, Vec<Self>),
    /// What it is instead.
    Other(String),
}

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

/// The values of the next element, which may have `most`, and their form.
fn numbers(from: &mut Bytes, most: usize) -> Result<(Vec<f64>, Form), String> {
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
    if rest.len() / form.1 > most {
        return Err(DAMAGED.to_owned());
    }
    Ok((Bytes { rest, ..*from }.numbers(form), form))
}

/// The next element as a name.
fn name(from: &mut Bytes) -> Result<String, String> {
    text(from, LONGEST_NAME)?.ok_or_else(|| format!("it has a name of more than {LONGEST_NAME} bytes"))
}

/// The text of the next element, in bytes or in units of UTF-16; none if it has more than `most` bytes.
fn text(from: &mut Bytes, most: usize) -> Result<Option<String>, String> {
    let (kind, rest) = element(from)?;
    if rest.len() > most {
        return Ok(None);
    }
    if !matches!(kind, 4 | 17) {
        return Ok(Some(decoded(rest).trim_end_matches('\0').to_owned()));
    }
    let read = if from.is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
    let units = rest.as_chunks().0.iter().map(|unit| read(*unit));
    Ok(Some(char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()))
}

/// Name and value of an array with these parts.
fn variable(mut parts: Bytes, depth: usize, space: &mut Space) -> Result<(String, Value), String> {
    if parts.rest.is_empty() {
        return Ok((String::new(), Value::Numbers(Vec::new(), Vec::new(), ('f', 8), false)));
    }
    let (_, flags) = element(&mut parts)?;
    let class = *flags.get(if parts.is_big_endian { 3 } else { 0 }).ok_or(DAMAGED)?;
    let is_complex = flags.get(if parts.is_big_endian { 2 } else { 1 }).is_some_and(|flags| flags & COMPLEX > 0);
    if class == OPAQUE {
        let [name, _system, class] = [name(&mut parts)?, name(&mut parts)?, name(&mut parts)?];
        return Ok((name, Value::Other(format!("an object of class {class}"))));
    }
    // Lengths are integers.
    let size: Vec<usize> = numbers(&mut parts, MOST_DIMENSIONS)?.0.into_iter().map(|length| length as usize).collect();
    let count = size.iter().try_fold(1_usize, |count, length| count.checked_mul(*length)).ok_or(DAMAGED)?;
    let name = name(&mut parts)?;
    let value = match class {
        // For complex numbers, the real part.
        class if NUMBERS.contains(&class) && !space.has(count) => Value::Other(String::new()),
        class if NUMBERS.contains(&class) => {
            let (values, form) = numbers(&mut parts, count)?;
            if count != values.len() {
                return Err(DAMAGED.to_owned());
            }
            Value::Numbers(size, values, form, is_complex)
        }
        TEXT => text(&mut parts, LONGEST_TEXT)?.map_or_else(|| Value::Other("a long text".to_owned()), Value::Text),
        STRUCT if depth < DEEPEST => return structs(parts, count, depth, space).map(|value| (name, value)),
        STRUCT => Value::Other("a struct".to_owned()),
        1 => Value::Other("a cell array".to_owned()),
        5 => Value::Other("a sparse matrix".to_owned()),
        _ => Value::Other("no array of numbers".to_owned()),
    };
    Ok((name, value))
}

/// `count` structs of these parts.
fn structs(mut parts: Bytes, count: usize, depth: usize, space: &mut Space) -> Result<Value, String> {
    let longest = numbers(&mut parts, 1)?.0.first().map_or(0, |length| *length as usize);
    let (_, names) = element(&mut parts)?;
    if longest > LONGEST_NAME {
        return Err(DAMAGED.to_owned());
    }
    let names = names.chunks_exact(longest.max(1));
    let count = count.checked_mul(names.len()).ok_or(DAMAGED)?;
    if !space.take_parts(names.len().saturating_add(count)) {
        return Ok(Value::Other(format!("a struct of {count} values")));
    }
    let fields = names.map(|name| decoded(name.split(|byte| *byte == 0).next().unwrap_or(name))).collect();
    let mut values = Vec::with_capacity(count);
    for _ in 0..count {
        let (_, rest) = element(&mut parts)?;
        values.push(variable(Bytes { rest, ..parts }, depth + 1, space)?.1);
    }
    Ok(Value::Structs(fields, values))
}

/// Adds the arrays of `value`, called `name` in `group`.
fn add(group: &str, name: &str, value: Value, contents: &mut Contents) {
    match value {
        // Written after the variables, with the content of their objects.
        Value::Numbers(..) if name.is_empty() => {}
        Value::Numbers(size, values, form, is_complex) => {
            if is_complex {
                contents.others.push((name.to_owned(), "its imaginary part".to_owned()));
            }
            contents.add(Array { group: group.to_owned(), name: name.to_owned(), size, values }, form);
        }
        Value::Text(_) if !group.is_empty() => {}
        Value::Text(text) if name == COMMENT => contents.comment = Some(text),
        Value::Text(_) => contents.others.push((name.to_owned(), "a text".to_owned())),
        Value::Other(what) => contents.others.push((name.to_owned(), what)),
        Value::Structs(fields, values) => add_structs(group, name, &fields, values, contents),
    }
}

/// Adds the arrays of structs with these fields, called `name` in `group`. Each struct of a variable is a group.
fn add_structs(group: &str, name: &str, fields: &[String], values: Vec<Value>, contents: &mut Contents) {
    let count = values.len() / fields.len().max(1);
    let mut values = values.into_iter();
    for number in 1..=count {
        let own: Vec<(&String, Value)> = fields.iter().zip(values.by_ref()).collect();
        let text = |names: &[&str]| {
            let found = own.iter().find_map(|(field, value)| match value {
                Value::Text(text) if names.contains(&field.as_str()) => Some(text.trim()),
                _ => None,
            });
            found.filter(|text| !text.is_empty() && text.len() <= LONGEST_NAME)
        };
        let title = text(&["Name", "label"]);
        let is_time = !group.is_empty() && name == "X" && title.is_none_or(|title| title.eq_ignore_ascii_case("time"));
        let title = if is_time { Some(TIME) } else { title };
        let unit = text(&["Unit", "unit"]).unwrap_or_default();
        let title = title.map(|title| match unit {
            // Whether it is known or not.
            unit if is_time && !unit.is_empty() => format!("time [{unit}]"),
            unit => with_unit(title, unit),
        });
        let element = if count > 1 { format!("{name}({number})") } else { name.to_owned() };
        for (field, value) in own {
            let is_data = matches!(field.as_str(), "Data" | "values");
            match title.as_ref().filter(|_| is_data) {
                Some(title) => add(group, title, value, contents),
                None if group.is_empty() => add(&element, field, value, contents),
                None => add(group, &format!("{element}.{field}"), value, contents),
            }
        }
    }
}

/// The arrays of a file.
///
/// # Errors
/// Why it is not read.
pub(super) fn contents(file: &[u8], limit: u64) -> Result<Contents, Refusal> {
    let (header, rest) = file.split_at_checked(HEADER).ok_or(DAMAGED)?;
    let mut file = Bytes { rest, is_big_endian: header.ends_with(b"MI") };
    let mut contents = Contents::default();
    let (mut space, mut unpacked) = (Space::new(limit), 0);
    while !file.rest.is_empty() && !contents.is_full() {
        let (mut kind, mut rest) = element(&mut file)?;
        let mut inflated = Vec::new();
        if kind == COMPRESSED {
            let (left, farthest) = (limit.saturating_sub(unpacked), limit.saturating_mul(FARTHEST) - unpacked);
            let there = unpack(ZlibDecoder::new(rest), left, farthest, &mut inflated);
            unpacked += there.map_err(|error| error.to_string())?.ok_or(Refusal::Large(None))?;
            if unpacked > limit {
                // Counted only.
                continue;
            }
            (kind, rest) = element(&mut Bytes { rest: &inflated, ..file })?;
        }
        if kind == ARRAY {
            let (name, value) = variable(Bytes { rest, ..file }, 0, &mut space)?;
            add("", &name, value, &mut contents);
        }
    }
    if unpacked > limit {
        return Err(Refusal::Large(Some(unpacked)));
    }
    space.check()?;
    Ok(contents)
}
