//! Arrays of NumPy (NEP 1): a header that describes them, then their values.

use super::bytes::{Bytes, DAMAGED};
use super::{Array, Contents};

/// Bytes of magic and version.
const VERSION: usize = 8;

/// A field of a record: its name, format and place.
struct Field {
    name: String,
    form: (char, usize),
    is_big_endian: bool,
}

/// The columns of a file: the fields of a structured array, or the columns of one or two dimensions.
pub(super) fn contents(file: &[u8]) -> Result<Contents, String> {
    let (version, rest) = file.split_at_checked(VERSION).ok_or(DAMAGED)?;
    let mut rest = Bytes { rest, is_big_endian: false };
    let length = if version[6] == 1 {
        let bytes = rest.take(2)?;
        usize::from(bytes[0]) | usize::from(bytes[1]) << 8
    } else {
        rest.word()? as usize
    };
    let header = String::from_utf8_lossy(rest.take(length)?).into_owned();
    let (shape, _) = value(&header, "shape")?.trim_start_matches('(').split_once(')').ok_or(DAMAGED)?;
    // Python 2 wrote 1000L.
    let lengths =
        shape.split(',').map(|length| length.trim().trim_end_matches('L')).filter(|length| !length.is_empty());
    let shape = lengths.map(|length| length.parse().map_err(|_| DAMAGED)).collect::<Result<Vec<usize>, _>>()?;
    let fields = fields(value(&header, "descr")?)?;
    let in_columns = value(&header, "fortran_order")?.starts_with("True");
    let count = shape.iter().try_fold(1_usize, |count, length| count.checked_mul(*length)).ok_or(DAMAGED)?;
    let width = fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(field.form.1)).ok_or(DAMAGED)?;
    let bytes = rest.take(count.checked_mul(width).ok_or(DAMAGED)?)?;
    if !rest.rest.is_empty() {
        return Err("it has more than one array, or its header is damaged".to_owned());
    }
    let mut contents = Contents::default();
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
                contents.arrays.push(Array { group: String::new(), name, size, values });
            }
            _ => contents.others.push((name, "no array of numbers".to_owned())),
        }
    }
    Ok(contents)
}

/// The text of the header from the value of `key` on.
fn value<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let (_, rest) = header.split_once(&format!("'{key}'")).ok_or(DAMAGED)?;
    Ok(rest.trim_start().strip_prefix(':').ok_or(DAMAGED)?.trim_start())
}

/// The fields of a description such as `'<f8'` or `[('time_s', '<f8'), ('drive_V', '<f4')]`.
fn fields(text: &str) -> Result<Vec<Field>, String> {
    if let Some(list) = text.strip_prefix('[') {
        let list = list.split_once(']').ok_or(DAMAGED)?.0;
        return list
            .split('(')
            .skip(1)
            .map(|field| {
                let mut words = field.split('\'').skip(1).step_by(2);
                let (Some(name), Some(form), None) = (words.next(), words.next(), words.next()) else {
                    return Err("it has fields of more than one number".to_owned());
                };
                // Behind the format there may be a shape.
                if field.rsplit('\'').next().is_some_and(|rest| rest.contains(|c: char| c.is_ascii_digit())) {
                    return Err("it has fields of more than one number".to_owned());
                }
                of_form(name, form)
            })
            .collect();
    }
    let form = text.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).ok_or(DAMAGED)?.0;
    Ok(vec![of_form("", form)?])
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
        let descr = "[('time_s', '<f8'), ('n', '|b1'), ('drive_V', '>i2')]";
        let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (2,), }}\n");
        let row = |t: f64, u: i16| [&t.to_le_bytes()[..], &[1], &u.to_be_bytes()].concat();
        let found = contents(&file(&header, &[row(0.5, -3), row(1.5, 4)].concat())).unwrap();
        let columns: Vec<_> = found.arrays.iter().map(|array| (array.name.as_str(), array.values.clone())).collect();
        assert_eq!(columns, [("time_s", vec![0.5, 1.5]), ("drive_V", vec![-3.0, 4.0])]);
        assert_eq!(found.others[0].0, "n");
        for (order, size) in [("True", [3, 2]), ("False", [2, 3])] {
            let header = format!("{{'descr': '<f4', 'fortran_order': {order}, 'shape': (3, 2), }}\n");
            let values: Vec<u8> = (0..6_u8).flat_map(|k| f32::from(k).to_le_bytes()).collect();
            let found = contents(&file(&header, &values)).unwrap();
            assert_eq!((&found.arrays[0].size[..], found.arrays[0].values[5]), (&size[..], 5.0));
            assert!(contents(&file(&header, &values[1..])).is_err());
        }
        for bad in ["{'descr': '<c16', 'shape': (2,)}", "{'descr': [('a', '<f8', (3,))], 'shape': (2,)}", "{}"] {
            assert!(contents(&file(bad, &[0; 99])).is_err(), "{bad}");
        }
    }
}
