//! HDF5 files, with those of MATLAB 7.3: the datasets of the file and of its groups.

use hdf5_pure::{AttrValue, Dataset, Error, File, Group};

use super::{Array, Contents};

/// Classes of MATLAB that have no numbers, though they are stored as numbers.
const NO_NUMBERS: [&str; 4] = ["char", "cell", "string", "function_handle"];
/// Levels of groups that are read, and number of groups: links may make a circle.
const DEEPEST: usize = 4;
const MOST_GROUPS: usize = 1000;
/// Most numbers that are read: a small file can declare many that were never written, and several links to them.
const MOST_NUMBERS: usize = 1 << 26;

pub(super) fn contents(file: Vec<u8>) -> Result<Contents, String> {
    let file = File::from_bytes(file).map_err(|error| error.to_string())?;
    let mut contents = Contents::default();
    let mut left = (MOST_GROUPS, MOST_NUMBERS);
    add(&file.root(), "", 0, &mut left, &mut contents).map_err(|error| error.to_string())?;
    Ok(contents)
}

/// Adds the datasets of `group`, which is called `path`, and of its groups.
fn add(
    group: &Group,
    path: &str,
    depth: usize,
    left: &mut (usize, usize),
    contents: &mut Contents,
) -> Result<(), Error> {
    for name in group.datasets()? {
        match group.dataset(&name).ok().and_then(|data| numbers(&data, &mut left.1)) {
            Some((size, values)) => contents.arrays.push(Array { group: path.to_owned(), name, size, values }),
            None => contents.others.push((name, "no array of numbers that can be read".to_owned())),
        }
    }
    // Names of MATLAB's internal objects begin so.
    for name in group.groups()?.into_iter().filter(|name| !name.starts_with('#')) {
        if depth == DEEPEST || left.0 == 0 {
            contents.others.push((name, "a group".to_owned()));
            continue;
        }
        left.0 -= 1;
        let below = if path.is_empty() { name.clone() } else { format!("{path}/{name}") };
        let added = group.group(&name).and_then(|group| add(&group, &below, depth + 1, left, contents));
        if let Err(error) = added {
            contents.others.push((name, format!("not readable: {error}")));
        }
    }
    Ok(())
}

/// Size and values of an array of numbers; none for texts and tables, or beyond what is `left` to read.
fn numbers(data: &Dataset, left: &mut usize) -> Option<(Vec<usize>, Vec<f64>)> {
    let attributes = data.attrs().ok()?;
    let class = attributes.get("MATLAB_class").and_then(AttrValue::as_str);
    if class.is_some_and(|class| NO_NUMBERS.contains(&class)) {
        return None;
    }
    // The last dimension varies fastest.
    let size: Option<Vec<usize>> =
        data.shape().ok()?.into_iter().rev().map(|length| usize::try_from(length).ok()).collect();
    let size = size?;
    let count = size.iter().try_fold(1_usize, |count, length| count.checked_mul(*length))?;
    *left = left.checked_sub(count)?;
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
        outer.create_dataset("count").with_i32_data(&[7]);
        outer.create_dataset("matrix").with_f64_data(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_shape(&[3, 2]);
        builder.add_group(outer.finish());
        let found = contents(builder.finish().unwrap()).unwrap();
        let arrays: Vec<_> = found.arrays.iter().map(|a| (a.group.as_str(), a.name.as_str(), &a.size[..])).collect();
        assert_eq!(arrays, [("scan", "count", &[1][..]), ("scan", "matrix", &[2, 3])]);
        assert_eq!(found.others, [("operator".to_owned(), "no array of numbers that can be read".to_owned())]);
    }
}
