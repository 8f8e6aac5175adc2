//! HDF5 files, with those of MATLAB 7.3: the datasets of the file and of its groups.

use hdf5_pure::{AttrValue, DType, Dataset, Datatype, DatatypeByteOrder, Error, File, Group};

use super::bytes::{Bytes, Form, LONGEST_NAME, MOST_ARRAYS, Refusal, Space};
use super::{Array, Contents};
use crate::columns::names::with_unit;

/// How classes of MATLAB begin that are numbers. Others are stored as numbers, too.
const NUMBERS: [&str; 5] = ["double", "single", "int", "uint", "logical"];
/// Names of an attribute with the unit of a dataset.
const UNIT: [&str; 5] = ["unit", "units", "Unit", "Units", "UNIT"];
/// Levels of groups that are read, and number of groups: links may make a circle.
const DEEPEST: usize = 4;
const MOST_GROUPS: usize = 1000;
/// Most bytes that deflate unpacks from one. A dataset that is larger than all of the file can hold was never written.
const MOST_PER_BYTE: usize = 1032;

/// Memory for the place of a chunk, in numbers.
const NUMBERS_PER_CHUNK: usize = 32;

/// What may still be read: groups, numbers, and the largest dataset, bytes.
struct Left {
    groups: usize,
    space: Space,
    largest: usize,
    /// Reason why the last dataset is not read.
    why: String,
}

pub(super) fn contents(file: Vec<u8>, limit: u64) -> Result<Contents, Refusal> {
    let largest = file.len().saturating_mul(MOST_PER_BYTE);
    let file = File::from_bytes(file).map_err(|error| error.to_string())?;
    let mut contents = Contents::default();
    let mut left = Left { groups: MOST_GROUPS, space: Space::new(limit), largest, why: String::new() };
    add(&file.root(), "", 0, &mut left, &mut contents).map_err(|error| error.to_string())?;
    left.space.check()?;
    Ok(contents)
}

/// Adds the datasets of `group`, which is called `path`, and of its groups.
fn add(group: &Group, path: &str, depth: usize, left: &mut Left, contents: &mut Contents) -> Result<(), Error> {
    // By these walks, as opening one by its name searches the whole group.
    let datasets = group.iter_datasets()?;
    if contents.arrays.len() + contents.others.len() + datasets.len() > MOST_ARRAYS {
        contents.is_full = true;
        return Ok(());
    }
    for (name, data) in datasets {
        if is_long(&name, contents) {
            continue;
        }
        if let Some(columns) = fields(&data, left) {
            let group = if path.is_empty() { name } else { format!("{path}/{name}") };
            for (name, values, form) in columns {
                contents.add(Array { group: group.clone(), name, size: vec![values.len()], values }, form);
            }
            continue;
        }
        match numbers(&data, left) {
            Some((size, values)) => {
                let is_wide = matches!(data.dtype(), Ok(DType::I64 | DType::U64));
                let form = (if is_wide { 'i' } else { 'f' }, 8);
                let attributes = data.attrs().unwrap_or_default();
                let unit = UNIT.iter().find_map(|unit| attributes.get(*unit)?.as_str());
                let name = with_unit(&name, unit.unwrap_or_default());
                contents.add(Array { group: path.to_owned(), name, size, values }, form);
            }
            None => contents.others.push((name, left.why.clone())),
        }
    }
    // Names of MATLAB's internal objects begin so.
    for (name, group) in group.iter_groups()?.filter(|(name, _)| !name.starts_with('#')) {
        if contents.is_full() {
            break;
        }
        if is_long(&name, contents) {
            continue;
        }
        if depth == DEEPEST || left.groups == 0 {
            contents.others.push((name, "a group".to_owned()));
            continue;
        }
        left.groups -= 1;
        let below = if path.is_empty() { name.clone() } else { format!("{path}/{name}") };
        let added = add(&group, &below, depth + 1, left, contents);
        if let Err(error) = added {
            contents.others.push((name, format!("not readable: {error}")));
        }
    }
    Ok(())
}

/// Whether a name is too long; it is then left out.
fn is_long(name: &str, contents: &mut Contents) -> bool {
    let is_long = name.len() > LONGEST_NAME;
    if is_long {
        let begin = name.chars().take(20).collect::<String>() + "…";
        contents.others.push((begin, format!("a name of more than {LONGEST_NAME} bytes")));
    }
    is_long
}

/// Size and values of an array of numbers; none for texts and tables, or beyond what is `left` to read.
fn numbers(data: &Dataset, left: &mut Left) -> Option<(Vec<usize>, Vec<f64>)> {
    left.why = "no array of numbers".to_owned();
    let attributes = data.attrs().ok()?;
    let class = attributes.get("MATLAB_class").and_then(AttrValue::as_str);
    // Of packed numbers the scale is an attribute.
    let is_packed = [("scale_factor", 1.0), ("add_offset", 0.0)].iter().any(|(name, neutral)| {
        let value = |value: &AttrValue| value.as_f64().or_else(|| value.as_i64().map(|value| value as f64));
        attributes.get(*name).is_some_and(|given| value(given) != Some(*neutral))
    });
    if is_packed {
        left.why = "not readable: its numbers have a scale or an offset as attributes".to_owned();
        return None;
    }
    if let Some(class) = class.filter(|class| !NUMBERS.iter().any(|begin| class.starts_with(begin))) {
        left.why = match class {
            "char" => "a text".to_owned(),
            "cell" => "a cell array".to_owned(),
            _ => format!("an object of class {class}"),
        };
        return None;
    }
    // The last dimension varies fastest.
    let size: Option<Vec<usize>> =
        data.shape().ok()?.into_iter().rev().map(|length| usize::try_from(length).ok()).collect();
    let size = size?;
    let count = size.iter().try_fold(1_usize, |count, length| count.checked_mul(*length))?;
    use DType::{Array, Compound, ObjectReference, String, VariableLengthString};
    if matches!(data.dtype().ok()?, Array(..) | Compound(_) | ObjectReference | String | VariableLengthString) {
        return None;
    }
    if !has_space(data, count, left)? {
        // Counted only.
        return Some((size, Vec::new()));
    }
    let values = data.read_f64().map_err(|error| left.why = reason(&error)).ok()?;
    Some((size, values))
}

/// The fields of a table that are numbers; none for other datasets.
fn fields(data: &Dataset, left: &mut Left) -> Option<Vec<(String, Vec<f64>, Form)>> {
    let (DType::Compound(kinds), Datatype::Compound { size, members }) = (data.dtype().ok()?, data.datatype().ok()?)
    else {
        return None;
    };
    let [rows] = data.shape().ok()?[..] else { return None };
    let (rows, size) = (usize::try_from(rows).ok()?, usize::try_from(size).ok().filter(|size| *size > 0)?);
    if !has_space(data, rows, left)? || !left.space.has(rows.checked_mul(members.len())?) {
        return Some(Vec::new());
    }
    let raw = data.read_raw().map_err(|error| left.why = reason(&error)).ok()?;
    let fields = members.into_iter().zip(kinds).filter_map(|(member, (name, kind))| {
        let form = form(&kind)?;
        use Datatype::{FixedPoint, FloatingPoint};
        let (FixedPoint { byte_order, .. } | FloatingPoint { byte_order, .. }) = member.datatype else { return None };
        let from = usize::try_from(member.byte_offset).ok()?;
        let own: Option<Vec<&[u8]>> = raw.chunks_exact(size).map(|row| row.get(from..from + form.1)).collect();
        let bytes = Bytes { rest: &own?.concat(), is_big_endian: byte_order == DatatypeByteOrder::BigEndian };
        Some((name, bytes.numbers(form), form))
    });
    Some(fields.collect())
}

fn form(kind: &DType) -> Option<Form> {
    Some(match kind {
        DType::F32 => ('f', 4),
        DType::F64 => ('f', 8),
        DType::I8 => ('i', 1),
        DType::I16 => ('i', 2),
        DType::I32 => ('i', 4),
        DType::I64 => ('i', 8),
        DType::U8 => ('u', 1),
        DType::U16 => ('u', 2),
        DType::U32 => ('u', 4),
        DType::U64 => ('u', 8),
        _ => return None,
    })
}

/// Whether there is space for a dataset of `count` elements; none if it cannot be read.
fn has_space(data: &Dataset, count: usize, left: &mut Left) -> Option<bool> {
    // A chunk is unpacked as a whole.
    let chunk = data.chunk_shape().map_err(|error| left.why = reason(&error)).ok()?.unwrap_or_default();
    let lengths = data.shape().ok()?.into_iter().zip(&chunk);
    let chunks = lengths.fold(1_u64, |count, (all, own)| count.saturating_mul(all.div_ceil((*own).max(1))));
    let chunk = chunk.into_iter().try_fold(1, |count, length| usize::try_from(length).ok()?.checked_mul(count))?;
    let most = if count > chunk { count } else { chunk };
    let element = usize::try_from(data.element_size().ok()?).ok()?;
    if most.checked_mul(element)? > left.largest {
        return None;
    }
    let listed = usize::try_from(chunks).ok()?.saturating_mul(NUMBERS_PER_CHUNK);
    Some(left.space.has(most.saturating_mul(element.div_ceil(8)).saturating_add(listed)))
}

/// Reason why a dataset is not read.
fn reason(error: &Error) -> String {
    let text = error.to_string();
    let is_newer = text.contains("data layout version");
    let newer = "it is in the form of HDF5 2.0: write it with libver=('earliest', 'v114')";
    format!("not readable: {}", if is_newer { newer } else { &text })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdf5_pure::{CompoundTypeBuilder, FileBuilder};

    #[test]
    fn numbers_in_the_fields_of_a_table_are_columns() {
        let kind = CompoundTypeBuilder::new().f64_field("t").i32_field("n").f32_field("y").build().unwrap();
        let row = |k: u8| {
            [&f64::from(k).to_le_bytes()[..], &i32::from(k).to_le_bytes(), &f32::from(k).to_le_bytes()].concat()
        };
        let raw = [row(1), row(2)].concat();
        let mut builder = FileBuilder::new();
        builder.create_dataset("rec").with_compound_data(kind, raw, 2);
        let file = builder.finish().unwrap();
        let found = contents(file.clone(), u64::MAX).unwrap().arrays;
        let columns: Vec<_> = found.iter().map(|a| (a.group.as_str(), a.name.as_str(), &a.values[..])).collect();
        assert_eq!(columns, ["t", "n", "y"].map(|name| ("rec", name, &[1.0, 2.0][..])));
        assert!(matches!(contents(file, 20), Err(Refusal::Large(_))));
    }

    #[test]
    fn groups_in_groups_are_read_and_texts_left_out() {
        let mut builder = FileBuilder::new();
        let mut outer = builder.create_group("scan");
        let text = outer.create_dataset("operator").with_u16_data(&[110, 111]);
        text.set_attr("MATLAB_class", AttrValue::AsciiString("char".into()));
        let count = outer.create_dataset("count").with_i32_data(&[7]);
        count.set_attr("units", AttrValue::AsciiString("mV".into()));
        let drive = outer.create_dataset("drive_V").with_i32_data(&[7]);
        drive.set_attr("units", AttrValue::AsciiString("mV".into()));
        let counts = outer.create_dataset("force_N").with_i32_data(&[7]);
        counts.set_attr("units", AttrValue::AsciiString("counts".into()));
        let packed = outer.create_dataset("packed").with_i32_data(&[7]);
        packed.set_attr("scale_factor", AttrValue::F64(0.5));
        let neutral = outer.create_dataset("neutral").with_i32_data(&[7]);
        neutral.set_attr("scale_factor", AttrValue::F64(1.0));
        neutral.set_attr("add_offset", AttrValue::I32(0));
        let time = outer.create_dataset("time_s").with_i32_data(&[7]);
        time.set_attr("units", AttrValue::AsciiString("sec".into()));
        outer.create_dataset("matrix").with_f64_data(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_shape(&[3, 2]);
        builder.add_group(outer.finish());
        let found = contents(builder.finish().unwrap(), u64::MAX).unwrap();
        let arrays: Vec<_> = found.arrays.iter().map(|a| (a.group.as_str(), a.name.as_str(), &a.size[..])).collect();
        let units = ["count [mV]", "drive_V [mV]", "force_N [counts]", "neutral", "time_s"]
            .map(|name| ("scan", name, &[1][..]));
        assert_eq!(arrays, [&units[..], &[("scan", "matrix", &[2, 3])]].concat());
        let others =
            [("operator", "a text"), ("packed", "not readable: its numbers have a scale or an offset as attributes")];
        assert_eq!(found.others, others.map(|(name, what)| (name.to_owned(), what.to_owned())));
    }
}
