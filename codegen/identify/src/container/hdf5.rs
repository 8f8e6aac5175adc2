//! HDF5 files, with those of MATLAB 7.3: the datasets of the file and of its groups.

use super::{Array, Contents};

/// Classes of MATLAB that have no numbers, though they are stored as numbers.
const NO_NUMBERS: [&str; 4] = ["char", "cell", "string", "function_handle"];

pub(super) fn contents(file: Vec<u8>) -> Result<Contents, String> {
    let said = |error: hdf5_pure::Error| error.to_string();
    let file = hdf5_pure::File::from_bytes(file).map_err(said)?;
    let mut contents = Contents::default();
    let root = file.root();
    add("", root.datasets().map_err(said)?, &|name| root.dataset(name), &mut contents);
    // Names of MATLAB's internal objects begin so.
    for name in root.groups().map_err(said)?.into_iter().filter(|name| !name.starts_with('#')) {
        match file.group(&name).and_then(|group| Ok((group.datasets()?, group))) {
            Ok((names, group)) => add(&name, names, &|name| group.dataset(name), &mut contents),
            Err(error) => contents.others.push((name, format!("unreadable: {error}"))),
        }
    }
    Ok(contents)
}

/// Adds the datasets `names` of `group`.
fn add(
    group: &str,
    names: Vec<String>,
    of: &dyn Fn(&str) -> Result<hdf5_pure::Dataset, hdf5_pure::Error>,
    contents: &mut Contents,
) {
    for name in names {
        let array = of(&name).ok().and_then(|data| {
            let class = data.attrs().ok().and_then(|all| all.get("MATLAB_class").map(|class| format!("{class:?}")));
            if class.is_some_and(|class| NO_NUMBERS.iter().any(|kind| class.contains(kind))) {
                return None;
            }
            let size: Option<Vec<usize>> = data.shape().ok()?.iter().map(|length| usize::try_from(*length).ok()).collect();
            // The last dimension varies fastest.
            Some((size?.into_iter().rev().collect(), data.read_f64().ok()?))
        });
        match array {
            Some((size, values)) => {
                contents.arrays.push(Array { group: group.to_owned(), name, size, values });
            }
            None => contents.others.push((name, "no array of numbers".to_owned())),
        }
    }
}
