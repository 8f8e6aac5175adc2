//! HDF5 files, with those of MATLAB 7.3: the datasets of the file and of its groups.

use hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group};

use super::bytes::{LONGEST_NAME, MOST_ARRAYS, Refusal, Space};
use super::{Array, Contents};
use crate::columns::names::with_unit;

/// Classes of MATLAB that have no numbers, though they are stored as numbers.
const NO_NUMBERS: [&str; 4] = ["char", "cell", "string", "function_handle"];
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
}

pub(super) fn contents(file: Vec<u8>, limit: u64) -> Result<Contents, Refusal> {
    let largest = file.len().saturating_mul(MOST_PER_BYTE);
    let file = File::from_bytes(file).map_err(|error| error.to_string())?;
    let mut contents = Contents::default();
    let mut left = Left { groups: MOST_GROUPS, space: Space::new(limit), largest };
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
        match numbers(&data, left) {
            _ if is_long(&name, contents) => {}
            Some((size, values)) => {
                let is_wide = matches!(data.dtype(), Ok(DType::I64 | DType::U64));
                let form = (if is_wide { 'i' } else { 'f' }, 8);
                let attributes = data.attrs().unwrap_or_default();
                let unit = UNIT.iter().find_map(|unit| attributes.get(*unit)?.as_str());
                let name = with_unit(&name, unit.unwrap_or_default());
                contents.add(Array { group: path.to_owned(), name, size, values }, form);
            }
            None => {
                contents.others.push((name, "no array of numbers that can be read, or one with a scale".to_owned()))
            }
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
    let attributes = data.attrs().ok()?;
    let class = attributes.get("MATLAB_class").and_then(AttrValue::as_str);
    // Of packed numbers the scale is an attribute.
    let is_packed = [("scale_factor", 1.0), ("add_offset", 0.0)].iter().any(|(name, neutral)| {
        let value = |value: &AttrValue| value.as_f64().or_else(|| value.as_i64().map(|value| value as f64));
        attributes.get(*name).is_some_and(|given| value(given) != Some(*neutral))
    });
    if is_packed || class.is_some_and(|class| NO_NUMBERS.contains(&class)) {
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
    // A chunk is unpacked as a whole.
    let chunk = data.chunk_shape().ok()?.unwrap_or_default();
    let lengths = data.shape().ok()?.into_iter().zip(&chunk);
    let chunks = lengths.fold(1_u64, |count, (all, own)| count.saturating_mul(all.div_ceil((*own).max(1))));
    let chunk = chunk.into_iter().try_fold(1, |count, length| usize::try_from(length).ok()?.checked_mul(count))?;
    let most = if count > chunk { count } else { chunk };
    if most.checked_mul(usize::try_from(data.element_size().ok()?).ok()?)? > left.largest {
        return None;
    }
    let listed = usize::try_from(chunks).ok()?.saturating_mul(NUMBERS_PER_CHUNK);
    if !left.space.has(most.saturating_add(listed)) {
        // Counted only.
        return Some((size, Vec::new()));
    }
    Some((size, data.read_f64().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdf5_pure::FileBuilder;

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
        let reason = "no array of numbers that can be read, or one with a scale".to_owned();
        assert_eq!(found.others, [("operator".to_owned(), reason.clone()), ("packed".to_owned(), reason)]);
    }
}
