//! Records in files of MATLAB, HDF5, TDMS and NumPy: their arrays as columns of tables.
//!
//! Arrays of one length are the columns of a table; a matrix gives one for each of its columns.

mod bytes;
mod hdf5;
mod mat;
mod npy;
mod tdms;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use super::columns::names::quantity;
use super::tables::{Extent, listed};
pub(crate) use bytes::{FARTHEST, Refusal, unpack};
use bytes::{Form, INEXACT, MOST_ARRAYS};
pub(crate) use npy::only_file;
use specgen_language::interrupt::Interruption;

/// Names and values.
pub(crate) type Columns = Vec<(String, Vec<f64>)>;

/// An array of numbers.
struct Array {
    /// Struct or group that it belongs to; empty for the file itself.
    group: String,
    /// Empty if it has none.
    name: String,
    /// Its dimensions, of which the first varies fastest.
    size: Vec<usize>,
    values: Vec<f64>,
}

/// What is in a file.
#[derive(Default)]
struct Contents {
    arrays: Vec<Array>,
    /// Name and kind of everything else.
    others: Vec<(String, String)>,
    /// Comments of a table that specgen wrote.
    comment: Option<String>,
    /// Whether it has more than is read.
    is_full: bool,
}

/// Tables of a file, and what is in none of them.
pub(crate) struct Tables {
    pub(crate) tables: Vec<Table>,
    /// Names, each with what it is.
    pub(crate) left_out: Vec<String>,
    /// Comments of any of the tables.
    pub(crate) comment: Option<String>,
}

/// Columns of equal length.
pub(crate) struct Table {
    /// The struct or group that has them, or the first array.
    name: String,
    columns: Columns,
}

/// Kind of a file by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// MAT-file of version 5.
    Mat,
    /// MAT-file of version 7.3: HDF5 with an additional header.
    Mat73,
    /// HDF5.
    Hdf5,
    /// TDMS.
    Tdms,
    /// An array of NumPy.
    Npy,
    /// A ZIP archive of arrays of NumPy.
    Npz,
}

/// Columns of a matrix from here on are an image, not channels.
const WIDEST: usize = 64;

impl Kind {
    /// Bytes that tell.
    pub(crate) const TELLING: usize = 128;

    /// Of a file that begins with `first`.
    pub(crate) fn of(first: &[u8]) -> Option<Self> {
        let kinds = [
            (&b"MATLAB 5.0 MAT-file"[..], Self::Mat),
            (b"MATLAB 7.3 MAT-file", Self::Mat73),
            (b"\x89HDF\r\n\x1a\n", Self::Hdf5),
            (b"TDSm", Self::Tdms),
            (b"\x93NUMPY", Self::Npy),
        ];
        if npy::is_archive(first) {
            return Some(Self::Npz);
        }
        kinds.into_iter().find(|(magic, _)| first.starts_with(magic)).map(|(_, kind)| kind)
    }

    /// The kind in words.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mat => "a MAT-file of version 5",
            Self::Mat73 => "a MAT-file of version 7.3",
            Self::Hdf5 => "an HDF5 file",
            Self::Tdms => "a TDMS file of LabVIEW",
            Self::Npy => "an array of NumPy",
            Self::Npz => "a file of arrays of NumPy",
        }
    }

    /// The tables of `file`, whose numbers, at 8 bytes each, and unpacked parts take at most `limit` bytes.
    ///
    /// # Errors
    /// Reason why it has none, as a text that follows the name of the file.
    pub(crate) fn tables(self, file: Vec<u8>, limit: u64) -> Result<Tables, Refusal> {
        let contents = guarded(|| match self {
            Self::Mat => mat::contents(&file, limit),
            Self::Mat73 | Self::Hdf5 => hdf5::contents(file, limit),
            Self::Tdms => tdms::contents(&file, limit),
            Self::Npy => npy::contents(&file, limit),
            Self::Npz => npy::of_archive(&file, limit),
        });
        let found = match contents {
            Ok(contents) if contents.is_full() => {
                return Err(format!("cannot be read: it has more than {MOST_ARRAYS} arrays or names").into());
            }
            Ok(contents) => tables(contents),
            Err(Refusal::Because(error)) => return Err(format!("cannot be read: {error}").into()),
            Err(large) => return Err(large),
        };
        if !found.tables.is_empty() {
            return Ok(found);
        }
        let there = if found.left_out.is_empty() { "nothing".to_owned() } else { listed(&found.left_out) };
        Err(format!("has no two arrays of numbers of one length for the columns, but {there}").into())
    }
}

/// What a reader gives. A panic in it, which a damaged file may cause, refuses the file.
fn guarded(read: impl FnOnce() -> Result<Contents, Refusal>) -> Result<Contents, Refusal> {
    let read = || {
        #[cfg(test)]
        tests::injected();
        read()
    };
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|cause| {
        if cause.is::<Interruption>() {
            resume_unwind(cause);
        }
        Err("its reader failed, most likely because it is damaged; if other programs read it, please report it".into())
    })
}

impl Contents {
    /// Adds an array whose numbers have this form in the file.
    fn add(&mut self, array: Array, form: Form) {
        if matches!(form, ('i' | 'u', 8)) && array.values.iter().any(|value| value.abs() >= INEXACT) {
            self.others.push((array.name.clone(), "last digits of its integers from 2⁵³ on".to_owned()));
        }
        self.arrays.push(array);
    }

    /// Whether more was found than is read.
    fn is_full(&self) -> bool {
        self.is_full || self.arrays.len() + self.others.len() > MOST_ARRAYS
    }
}

/// Whether an array is called as a time.
fn is_time(name: &str) -> bool {
    quantity("time_s").is_some_and(|time| time.fits(name).is_some() || time.is_named(name))
}

/// Number of samples and of columns of an array of one or two dimensions.
fn length_and_width(size: &[usize]) -> Option<[usize; 2]> {
    let long: Vec<usize> = size.iter().copied().filter(|length| *length > 1).collect();
    match long[..] {
        [length] => Some([length, 1]),
        [a, b] if a.min(b) < WIDEST => Some([a.max(b), a.min(b)]),
        _ => None,
    }
}

/// Puts arrays of equal length together: of the whole file if their names differ and at most one group has times,
/// otherwise of each group. Each matrix without a vector beside it is a table of its own.
fn tables(contents: Contents) -> Tables {
    let mut left_out: Vec<String> = Vec::new();
    let mut of_length: BTreeMap<usize, Vec<Channels>> = BTreeMap::new();
    for (order, array) in contents.arrays.into_iter().enumerate() {
        match length_and_width(&array.size)
            .filter(|[length, width]| length.checked_mul(*width) == Some(array.values.len()))
        {
            Some([length, width]) => of_length.entry(length).or_default().push(Channels { order, width, array }),
            // In a struct such numbers describe its arrays.
            None if array.group.is_empty() => left_out.push(format!("`{}` ({})", array.name, array.in_words())),
            None => {}
        }
    }
    left_out.extend(contents.others.into_iter().map(|(name, what)| format!("`{name}` ({what})")));
    let mut tables: Vec<(usize, Table)> = Vec::new();
    for mut same in of_length.into_values() {
        join_signals(&mut same);
        let mut names = BTreeSet::new();
        let is_unique = same.iter().all(|one| names.insert(one.array.name.clone()));
        let timed = same.iter().filter(|one| is_time(&one.array.name)).map(|one| &one.array.group);
        let is_one = is_unique && timed.collect::<BTreeSet<_>>().len() < 2;
        let mut groups: BTreeMap<String, Vec<Channels>> = BTreeMap::new();
        for one in same {
            groups.entry(if is_one { String::new() } else { one.array.group.clone() }).or_default().push(one);
        }
        for group in groups.into_values() {
            if group.iter().all(|one| one.width > 1) {
                tables.extend(group.into_iter().map(|one| (one.order, Table::of(vec![one]))));
            } else {
                tables.push((group[0].order, Table::of(group)));
            }
        }
    }
    tables.sort_by_key(|(order, _)| *order);
    let mut tables: Vec<Table> = tables.into_iter().map(|(_, table)| table).collect();
    let is_single = |table: &Table| table.columns.len() < 2;
    left_out.extend(
        tables
            .iter()
            .filter(|table| is_single(table))
            .flat_map(|table| &table.columns)
            .map(|(name, values)| format!("`{name}` ({} numbers)", values.len())),
    );
    tables.retain(|table| !is_single(table));
    Tables { tables, left_out, comment: contents.comment }
}

/// Puts groups together that have one array each beside the same times, as Simulink writes a struct for each signal.
fn join_signals(same: &mut Vec<Channels>) {
    let (times, signals): (Vec<_>, Vec<_>) = same.iter().partition(|one| is_time(&one.array.name));
    let groups = |all: &[&Channels]| all.iter().map(|one| one.array.group.clone()).collect::<BTreeSet<_>>();
    let [of_times, of_signals] = [groups(&times), groups(&signals)];
    let is_apart = of_times.len() == times.len() && of_signals.len() == signals.len() && of_times == of_signals;
    if times.len() < 2 || !is_apart || times.iter().any(|one| one.array.values != times[0].array.values) {
        return;
    }
    let first = times[0].order;
    let is_unique = signals.iter().map(|one| &one.array.name).collect::<BTreeSet<_>>().len() == signals.len();
    same.retain(|one| one.order == first || !is_time(&one.array.name));
    for one in same.iter_mut() {
        let group = std::mem::take(&mut one.array.group);
        if !is_unique && one.order != first {
            one.array.name = format!("{group}.{}", one.array.name);
        }
    }
}

/// An array of one or two dimensions as columns.
struct Channels {
    /// Its place in the file.
    order: usize,
    width: usize,
    array: Array,
}

impl Channels {
    /// Columns, along the longer dimension.
    fn columns(self) -> Columns {
        let Self { width, array: Array { name, size, values, .. }, .. } = self;
        if width == 1 {
            return vec![(name, values)];
        }
        let length = values.len() / width;
        let is_along_first = size.iter().find(|length| **length > 1) == Some(&length);
        let column = |k: usize| -> Vec<f64> {
            if is_along_first {
                values[k * length..(k + 1) * length].to_vec()
            } else {
                values.iter().skip(k).step_by(width).copied().collect()
            }
        };
        let named =
            |k: usize| if name.is_empty() { format!("column {}", k + 1) } else { format!("{name}(:,{})", k + 1) };
        (0..width).map(|k| (named(k), column(k))).collect()
    }
}

impl Array {
    /// Its size in words.
    fn in_words(&self) -> String {
        let size: Vec<String> = self.size.iter().map(usize::to_string).collect();
        if self.values.len() == 1 { "a number".to_owned() } else { format!("{} numbers", size.join(" × ")) }
    }
}

impl Table {
    fn of(channels: Vec<Channels>) -> Self {
        let first = &channels[0].array;
        let name = if first.group.is_empty() { first.name.clone() } else { first.group.clone() };
        Self { name, columns: channels.into_iter().flat_map(Channels::columns).collect() }
    }

    /// Its names and lengths.
    pub(crate) fn extent(&self) -> Extent {
        let columns: Vec<String> = self.columns.iter().map(|(name, _)| name.clone()).collect();
        let rows = self.columns.first().map_or(0, |(_, values)| values.len());
        Extent { name: self.name.clone(), rows, columns, first_line: None }
    }

    /// Its columns, with names that are no numbers.
    pub(crate) fn columns(self) -> Columns {
        let is_number = |name: &str| name.trim().parse::<f64>().is_ok();
        let named = |name: String| if is_number(&name) { format!("column {name}") } else { name };
        self.columns.into_iter().map(|(name, values)| (named(name), values)).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use crate::{Reading, decode_record};
    use specgen_language::diagnostic::codes;

    thread_local! {
        static PANICS: Cell<bool> = const { Cell::new(false) };
    }

    /// A panic in the middle of a reader.
    pub(super) fn injected() {
        assert!(!PANICS.get(), "injected");
    }

    #[test]
    fn a_panic_of_a_reader_is_a_finding() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/record/tests/containers");
        for name in ["v5.mat", "v7.3.mat", "record.h5", "record.tdms"] {
            let file = std::fs::read(folder.join(name)).unwrap();
            let read = || decode_record(file.clone(), name, &Reading::default());
            assert!(read().is_ok(), "{name}");
            PANICS.set(true);
            let found = read().unwrap_err();
            PANICS.set(false);
            assert_eq!((found.len(), found[0].code), (1, codes::RECORD_NOT_TEXT.id), "{name}");
            assert!(found[0].message.contains("its reader failed"), "{found:?}");
        }
    }
}
