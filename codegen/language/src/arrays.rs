//! Tables as arrays: the CSV that a command writes, as `.npz` of NumPy or as a MAT-file of MATLAB 7, by the suffix of its
//! file. Each column is an array with the name of the column, and the comments are a text with the name `comment`.

use std::fmt::Write as _;
use std::io::{self, Cursor, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rawzip::ZipArchiveWriter;

/// Kind of a file of arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Arrays of NumPy in a ZIP archive.
    Npz,
    /// MAT-file of version 7: that of version 5, compressed.
    Mat,
}

/// Name of the text with the comments of a table.
pub const COMMENT: &str = "comment";
/// Most bytes of a variable that MATLAB reads in this version.
const LARGEST: usize = i32::MAX as usize;

impl Form {
    /// That of a file with this suffix; none for other files.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let suffix = path.extension()?.to_str()?;
        let is = |form: &str| suffix.eq_ignore_ascii_case(form);
        if is("npz") { Some(Self::Npz) } else { is("mat").then_some(Self::Mat) }
    }

    /// The file with the columns of `csv`, numbers as `f64` to the bit. Empty fields are NaN.
    ///
    /// # Errors
    /// Reason why `csv` has no such file, as a text that follows the name of the file.
    pub fn of_csv(self, csv: &[u8]) -> Result<Vec<u8>, String> {
        let table =
            Table::of_csv(csv).ok_or("only tables are written in this form; give a name with another suffix")?;
        match self {
            Self::Npz => table.npz().map_err(|error| error.to_string()),
            Self::Mat => table.mat(),
        }
    }
}

/// Values of a column.
enum Column<'a> {
    Numbers(Vec<f64>),
    Texts(Vec<&'a str>),
}

struct Table<'a> {
    columns: Vec<(String, Column<'a>)>,
    comment: String,
}

impl<'a> Table<'a> {
    /// A table as the commands write it: names, then rows with as many fields, without quotation marks.
    fn of_csv(csv: &'a [u8]) -> Option<Self> {
        let text = std::str::from_utf8(csv).ok()?;
        let is_comment = |line: &&str| line.starts_with('#');
        let comment: Vec<&str> = text.lines().filter(is_comment).map(|line| line[1..].trim()).collect();
        let mut rows = text.lines().filter(|line| !is_comment(line) && !line.is_empty());
        let head = rows.next()?;
        let separator = if head.contains('\t') { '\t' } else { ',' };
        let names: Vec<&str> = head.split(separator).map(str::trim).collect();
        let mut cells: Vec<Vec<&str>> = vec![Vec::new(); names.len()];
        for row in rows {
            let mut fields = row.split(separator);
            for column in &mut cells {
                column.push(fields.next()?.trim());
            }
            if fields.next().is_some() {
                return None;
            }
        }
        let is_name = |name: &&str| !name.is_empty() && name.parse::<f64>().is_err();
        if cells[0].is_empty() || !names.iter().all(is_name) || head.contains('"') {
            return None;
        }
        let columns = names.iter().map(|name| (*name).to_owned()).zip(cells.into_iter().map(Column::of));
        Some(Self { columns: columns.collect(), comment: comment.join("\n") })
    }

    fn npz(&self) -> io::Result<Vec<u8>> {
        let array = |(name, column): &(String, Column)| {
            let (kind, shape, values) = match column {
                Column::Numbers(values) => ("<f8".to_owned(), values.len(), bytes(values)),
                Column::Texts(texts) => {
                    let width = texts.iter().map(|text| text.chars().count()).max().unwrap_or_default().max(1);
                    let padded = texts.iter().flat_map(|text| text.chars().chain(['\0'].repeat(width)).take(width));
                    let values = padded.flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
                    (format!("<U{width}"), texts.len(), values)
                }
            };
            (file_name(name), npy(&kind, &format!("({shape},)"), &values))
        };
        let mut files: Vec<(String, Vec<u8>)> = self.columns.iter().map(array).collect();
        if !self.comment.is_empty() {
            let values: Vec<u8> = self.comment.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
            files.push((file_name(COMMENT), npy(&format!("<U{}", self.comment.chars().count()), "()", &values)));
        }
        zipped(files.iter().map(|(name, file)| (name.as_str(), file.as_slice())))
    }

    fn mat(&self) -> Result<Vec<u8>, String> {
        let mut file = format!("{:116}", "MATLAB 5.0 MAT-file, written by specgen").into_bytes();
        file.extend([0; 8]);
        file.extend(b"\0\x01IM");
        // The text with the comments has a name of its own.
        let mut names = vec![COMMENT.to_owned()];
        for (name, column) in &self.columns {
            let name = identifier(name, &names);
            let (class, size, kind, data) = match column {
                Column::Numbers(values) => (6, [values.len(), 1], 9, bytes(values)),
                Column::Texts(texts) => {
                    let (size, data) = letters(texts);
                    (4, size, 4, data)
                }
            };
            variable(&mut file, &name, class, size, kind, &data)?;
            names.push(name);
        }
        if !self.comment.is_empty() {
            let (size, data) = letters(&[&self.comment]);
            variable(&mut file, COMMENT, 4, size, 4, &data)?;
        }
        Ok(file)
    }
}

impl<'a> Column<'a> {
    fn of(fields: Vec<&'a str>) -> Self {
        let number = |field: &&str| if field.is_empty() { Some(f64::NAN) } else { field.parse().ok() };
        match fields.iter().map(number).collect() {
            Some(values) => Self::Numbers(values),
            None => Self::Texts(fields),
        }
    }
}

fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Name of an array in an archive, where `/` divides folders.
fn file_name(name: &str) -> String {
    format!("{}.npy", name.replace('/', "_per_"))
}

/// An array of NumPy (NEP 1), aligned to 64 bytes.
fn npy(kind: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (header.len() + 11).next_multiple_of(64) - 10;
    // Writing to a String cannot fail.
    let _ = writeln!(header, "{:1$}", "", length - header.len() - 1);
    [b"\x93NUMPY\x01\0", &(length as u16).to_le_bytes()[..], header.as_bytes(), values].concat()
}

/// A ZIP archive of files, without times: the same files give the same bytes.
///
/// # Errors
/// A name is not one of a file.
pub fn zipped<'a>(files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> io::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let mut archive = ZipArchiveWriter::new(&mut out);
    for (name, bytes) in files {
        let (mut entry, config) = archive.new_file(name).start().map_err(io::Error::other)?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(bytes)?;
        let (_, written) = writer.finish().map_err(io::Error::other)?;
        entry.finish(written).map_err(io::Error::other)?;
    }
    archive.finish().map_err(io::Error::other)?;
    Ok(out.into_inner())
}

/// Size of a matrix of letters with a row for each text, and its letters, column by column.
fn letters(texts: &[&str]) -> ([usize; 2], Vec<u8>) {
    let rows: Vec<Vec<u16>> = texts.iter().map(|text| text.encode_utf16().collect()).collect();
    let width = rows.iter().map(Vec::len).max().unwrap_or_default();
    let letter = |at: usize| rows.iter().map(move |row| row.get(at).copied().unwrap_or(u16::from(b' ')));
    ([rows.len(), width], (0..width).flat_map(letter).flat_map(u16::to_le_bytes).collect())
}

/// An element of a MAT-file: type, length and bytes.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut all = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    all.extend(bytes);
    all.resize(all.len().next_multiple_of(8), 0);
    all
}

/// Appends a variable of a class (MathWorks, MAT-File Format), whose `data` are of type `kind`.
fn variable(file: &mut Vec<u8>, name: &str, class: u8, size: [usize; 2], kind: u32, data: &[u8]) -> Result<(), String> {
    if data.len() > LARGEST {
        return Err(format!("`{name}` is larger than the 2 GiB of a variable in this form; give a name in .npz"));
    }
    let size = element(5, &size.map(|length| (length as u32).to_le_bytes()).concat());
    let parts = [element(6, &[class, 0, 0, 0, 0, 0, 0, 0]), size, element(1, name.as_bytes()), element(kind, data)];
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    let packed = packed.write_all(&element(14, &parts.concat())).and_then(|()| packed.finish());
    let packed = packed.map_err(|error| error.to_string())?;
    // Compressed elements are not aligned.
    file.extend([15_u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
    file.extend(packed);
    Ok(())
}

/// A name that MATLAB accepts and that is none of `taken`.
fn identifier(name: &str, taken: &[String]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let spelled = name.replace('µ', "u").replace('/', "_per_").replace(']', "");
    let mut whole: String = spelled.chars().map(plain).take(60).collect();
    if !whole.starts_with(|c: char| c.is_ascii_alphabetic()) {
        whole.insert(0, 'x');
    }
    let number = (2..).map(|number| format!("{whole}_{number}"));
    [whole.clone()].into_iter().chain(number).find(|name| !taken.contains(name)).unwrap_or(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_columns() {
        let taken = [String::from("gain_um_per_V")];
        for (name, expected) in [
            ("time_s", "time_s"),
            ("gauge[0]_V", "gauge_0_V"),
            ("gain_um/V", "gain_um_per_V_2"),
            ("1st (µm)", "x1st__um_"),
        ] {
            assert_eq!(identifier(name, &taken), expected);
        }
        assert_eq!(Form::of(Path::new("a.NPZ")), Some(Form::Npz));
        assert_eq!(Form::of(Path::new("a.csv")), None);
    }

    #[test]
    fn only_tables_become_arrays() {
        for csv in ["", "a,b\n", "a,b\n1\n", "a,b\n1,2,3\n", "{\"a\": 1}\n", "1,2\n3,4\n"] {
            assert!(Form::Npz.of_csv(csv.as_bytes()).is_err(), "{csv}");
        }
        let file = Form::Npz.of_csv(b"a,name\n# note\n1,x\n,yz\n").unwrap();
        let text = String::from_utf8_lossy(&file);
        for part in ["a.npy", "'<f8'", "name.npy", "'<U2'", "comment.npy", "'shape': (2,), }", "'shape': ()"] {
            assert!(text.contains(part), "{part}");
        }
    }
}
