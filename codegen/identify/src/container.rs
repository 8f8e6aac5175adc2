//! Records in files of MATLAB, HDF5 and TDMS: their columns as lines of text, which are then read as in any other file.
//!
//! Columns are the named arrays of numbers with the most values; shorter arrays are metadata and left out. Numbers are
//! written so that they read back to the bit.

mod bytes;
mod mat;
mod tdms;

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Names and values.
type Columns = Vec<(String, Vec<f64>)>;

/// Kind of a file by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// MAT-file of version 5.
    Mat,
    /// HDF5, including MAT-files of version 7.3, which have an additional header.
    Hdf5,
    /// TDMS.
    Tdms,
}

impl Kind {
    /// Bytes that tell.
    pub(crate) const TELLING: usize = 19;

    /// Of a file that begins with `first`.
    pub(crate) fn of(first: &[u8]) -> Option<Self> {
        let kinds = [
            (&b"MATLAB 5.0 MAT-file"[..], Self::Mat),
            (b"MATLAB 7.3 MAT-file", Self::Hdf5),
            (b"\x89HDF\r\n\x1a\n", Self::Hdf5),
            (b"TDSm", Self::Tdms),
        ];
        kinds.into_iter().find(|(magic, _)| first.starts_with(magic)).map(|(_, kind)| kind)
    }

    /// The columns of `file`, which lies at `path`, as lines.
    ///
    /// # Errors
    /// Reason why it has none, as a text that follows the name of the file.
    pub(crate) fn open(self, mut file: File, path: &Path) -> Result<Lines, String> {
        let mut whole = || -> Result<Vec<u8>, String> {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(|error| error.to_string())?;
            Ok(bytes)
        };
        let columns = match self {
            Self::Mat => whole().and_then(|file| mat::columns(&file)),
            Self::Hdf5 => of_hdf5(path),
            Self::Tdms => whole().and_then(|file| tdms::columns(&file)),
        };
        let mut columns = columns.map_err(|error| format!("cannot be read: {error}"))?;
        let longest = columns.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
        columns.retain(|(_, values)| values.len() == longest);
        if longest < 2 || columns.len() < 2 {
            return Err("has no two arrays of numbers, one for each column".to_owned());
        }
        Ok(Lines::new(columns))
    }
}

/// Whether an array has exactly one dimension larger than 1.
fn is_column<N: Copy + PartialOrd + From<u8>>(size: &[N]) -> bool {
    size.iter().filter(|length| **length > N::from(1)).count() <= 1
}

/// Datasets of the root, and of its groups if the root has no column.
fn of_hdf5(path: &Path) -> Result<Columns, String> {
    let said = |error: hdf5_pure::Error| error.to_string();
    let file = hdf5_pure::File::open(path).map_err(said)?;
    let read = |names: Vec<String>, of: &dyn Fn(&str) -> Result<hdf5_pure::Dataset, hdf5_pure::Error>| -> Columns {
        // Texts and tables are not columns.
        let column = |name: String| {
            let data = of(&name).ok()?;
            is_column(&data.shape().ok()?).then(|| data.read_f64().ok())?.map(|values| (name, values))
        };
        names.into_iter().filter_map(column).collect()
    };
    let root = file.root();
    let mut columns = read(root.datasets().map_err(said)?, &|name| root.dataset(name));
    if columns.iter().filter(|(_, values)| values.len() > 1).count() < 2 {
        // Names of MATLAB's internal objects begin so.
        for name in root.groups().map_err(said)?.into_iter().filter(|name| !name.starts_with('#')) {
            let group = file.group(&name).map_err(said)?;
            columns.extend(read(group.datasets().map_err(said)?, &|name| group.dataset(name)));
        }
    }
    Ok(columns)
}

/// Columns of equal length, line by line, names first.
pub(crate) struct Lines {
    columns: Columns,
    next: usize,
    line: Vec<u8>,
    taken: usize,
}

impl Lines {
    fn new(columns: Columns) -> Self {
        // A separator must not occur in a name.
        let names: Vec<String> = columns.iter().map(|(name, _)| name.replace(['\t', '\n', '\r'], " ")).collect();
        Self { columns, next: 0, line: (names.join("\t") + "\n").into_bytes(), taken: 0 }
    }
}

impl Read for Lines {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.taken == self.line.len() {
            let mut text = String::new();
            for (k, (_, values)) in self.columns.iter().enumerate() {
                let Some(value) = values.get(self.next) else { return Ok(0) };
                // Writing to a String cannot fail.
                let _ = write!(text, "{}{value:?}", if k > 0 { "\t" } else { "" });
            }
            text.push('\n');
            self.next += 1;
            (self.line, self.taken) = (text.into_bytes(), 0);
        }
        let count = into.len().min(self.line.len() - self.taken);
        into[..count].copy_from_slice(&self.line[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}
