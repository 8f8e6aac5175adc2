//! Tables: as CSV, as `.npz` of NumPy, or as a MAT-file of MATLAB 7, by the suffix of the file. In a file of arrays each
//! column is an array with the name of the column, and the comments are a text with the name `comment`.

use std::fmt::Write as _;
use std::io::{self, Cursor, Write};
use std::path::Path;

use crate::quantity::may_divide_thousands;
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
    pub fn of(path: &Path) -> Option<Self> {
        let suffix = path.extension()?.to_str()?;
        let is = |form: &str| suffix.eq_ignore_ascii_case(form);
        if is("npz") { Some(Self::Npz) } else { is("mat").then_some(Self::Mat) }
    }

    /// The file with the columns of `table`, numbers to the bit.
    ///
    /// # Errors
    /// Reason why there is no such file, as a text that follows the name of the file.
    pub fn file(self, table: &Table) -> Result<Vec<u8>, String> {
        match self {
            Self::Npz => table.npz().map_err(|error| error.to_string()),
            Self::Mat => table.mat(),
        }
    }

    /// The same for a table as CSV, as in [`Table::of_csv`].
    ///
    /// # Errors
    /// As [`Form::file`].
    pub fn of_csv(self, csv: &[u8]) -> Result<Vec<u8>, String> {
        let none = "there is no table: a line of names, then rows of as many fields; give a name with another suffix";
        self.file(&Table::of_csv(csv).ok_or(none)?)
    }
}

/// Values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers; NaN where the table has none.
    Numbers(Vec<f64>),
    /// Texts, as they are in CSV.
    Texts(Vec<String>),
}

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Names and values.
    pub columns: Vec<(String, Column)>,
    /// Lines of text about it; may be empty.
    pub comment: String,
}

impl Table {
    /// A table in CSV: names, then rows with as many fields, without quotation marks. Semicolons or tabs in the line of
    /// names separate instead of commas, which are decimal signs then, unless each may divide thousands: such a column has
    /// texts. Empty fields are NaN.
    #[must_use]
    pub fn of_csv(csv: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(csv).ok()?;
        let is_comment = |line: &&str| line.starts_with('#');
        let lines = text.split(['\n', '\r']);
        let comment: Vec<&str> = lines.clone().filter(is_comment).map(|line| line[1..].trim()).collect();
        let mut rows = lines.filter(|line| !is_comment(line) && !line.is_empty());
        let head = rows.next()?;
        let separator = ['\t', ';'].into_iter().find(|sign| head.contains(*sign)).unwrap_or(',');
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
        // A text of one line is none.
        let is_name = |name: &&str| !name.is_empty() && name.parse::<f64>().is_err();
        if cells[0].is_empty() && names.len() < 2 || !names.iter().all(is_name) || head.contains('"') {
            return None;
        }
        let commas = || cells.iter().flatten().filter(|field| field.contains(','));
        let has_decimals = separator != ',' && !commas().all(|field| may_divide_thousands(field, ','));
        let columns = cells.iter().map(|fields| Column::of(fields, has_decimals));
        let columns = names.iter().map(|name| (*name).to_owned()).zip(columns).collect();
        Some(Self { columns, comment: comment.join("\n") })
    }

    /// As CSV, with the comments below the names. A name with a comma is in quotation marks.
    pub fn csv(&self) -> String {
        let quoted = |name: &String| {
            let name = name.replace(['\n', '\r'], " ");
            if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name }
        };
        let mut text = self.columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
        for line in self.comment.lines() {
            text += &format!("# {line}\n");
        }
        let rows = self.columns.first().map_or(0, |(_, column)| column.len());
        for row in 0..rows {
            for (k, (_, column)) in self.columns.iter().enumerate() {
                text.push_str(if k > 0 { "," } else { "" });
                // Writing to a String cannot fail.
                let _ = match column {
                    Column::Numbers(values) => write!(text, "{:?}", values[row]),
                    Column::Texts(texts) => write!(text, "{}", texts[row]),
                };
            }
            text.push('\n');
        }
        text
    }

    /// The columns, each with a name that a file accepts and that no other one has, and the comments, in which a name that
    /// was changed is explained.
    fn named(&self, spelled: fn(&str) -> String) -> (Vec<(String, &Column)>, String) {
        // The text with the comments has a name of its own.
        let mut names = vec![COMMENT.to_owned()];
        let mut comment = self.comment.clone();
        for (name, _) in &self.columns {
            let own = unique(spelled(name), &names);
            if own != *name {
                let line = format!("column {own} is `{name}`");
                comment = if comment.is_empty() { line } else { format!("{comment}\n{line}") };
            }
            names.push(own);
        }
        (names.drain(1..).zip(self.columns.iter().map(|(_, column)| column)).collect(), comment)
    }

    fn npz(&self) -> io::Result<Vec<u8>> {
        let array = |(name, column): &(String, &Column)| {
            let (kind, shape, values) = match column {
                Column::Numbers(values) => ("<f8".to_owned(), values.len(), bytes(values)),
                Column::Texts(texts) => {
                    let width = texts.iter().map(|text| text.chars().count()).max().unwrap_or_default().max(1);
                    let padded = texts.iter().flat_map(|text| text.chars().chain(['\0'].repeat(width)).take(width));
                    let values = padded.flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
                    (format!("<U{width}"), texts.len(), values)
                }
            };
            (format!("{name}.npy"), npy(&kind, &format!("({shape},)"), &values))
        };
        let (columns, comment) = self.named(file_name);
        let mut files: Vec<(String, Vec<u8>)> = columns.iter().map(array).collect();
        if !comment.is_empty() {
            let values: Vec<u8> = comment.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
            files.push((format!("{COMMENT}.npy"), npy(&format!("<U{}", comment.chars().count()), "()", &values)));
        }
        zipped(files.iter().map(|(name, file)| (name.as_str(), file.as_slice())))
    }

    fn mat(&self) -> Result<Vec<u8>, String> {
        let mut file = format!("{:116}", "MATLAB 5.0 MAT-file, written by specgen").into_bytes();
        file.extend([0; 8]);
        file.extend(b"\0\x01IM");
        let (columns, comment) = self.named(identifier);
        for (name, column) in columns {
            let (class, size, kind, data) = match column {
                Column::Numbers(values) => (6, [values.len(), 1], 9, bytes(values)),
                Column::Texts(texts) => {
                    let (size, data) = letters(texts);
                    (4, size, 4, data)
                }
            };
            variable(&mut file, &name, class, size, kind, &data)?;
        }
        if !comment.is_empty() {
            let (size, data) = letters(&[comment]);
            variable(&mut file, COMMENT, 4, size, 4, &data)?;
        }
        Ok(file)
    }
}

impl Column {
    /// `has_decimals`: whether commas are decimal signs.
    fn of(fields: &[&str], has_decimals: bool) -> Self {
        let number = |field: &&str| match field.parse() {
            Ok(value) => Some(value),
            Err(_) if field.is_empty() => Some(f64::NAN),
            Err(_) if has_decimals => field.replace(',', ".").parse().ok(),
            Err(_) => None,
        };
        match fields.iter().map(number).collect() {
            Some(values) => Self::Numbers(values),
            None => Self::Texts(fields.iter().map(|field| (*field).to_owned()).collect()),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Texts(texts) => texts.len(),
        }
    }
}

fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Name of an array in an archive, where `/` and `\` divide folders and `:` follows a drive.
fn file_name(name: &str) -> String {
    let name = name.replace('/', "_per_").replace(['\\', ':', '\0'], "_");
    if name.starts_with('.') { format!("_{name}") } else { name }
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
fn letters(texts: &[String]) -> ([usize; 2], Vec<u8>) {
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

/// A name that MATLAB accepts.
fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let spelled = name.replace('µ', "u").replace('/', "_per_").replace(']', "");
    let whole: String = spelled.chars().map(plain).take(55).collect();
    if whole.starts_with(|c: char| c.is_ascii_alphabetic()) { whole } else { format!("x{whole}") }
}

/// A name that is none of `taken`.
fn unique(name: String, taken: &[String]) -> String {
    let number = (2..).map(|number| format!("{name}_{number}"));
    [name.clone()].into_iter().chain(number).find(|name| !taken.contains(name)).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_has_its_own_name() {
        let names = [
            "time_s",
            "gauge[0]_V",
            "gain_um/V",
            "1st (µm)",
            "a:b",
            "a\\b",
            "c:b",
            "time_s",
            "gain_um/V",
            "..",
            "comment",
        ];
        let columns = names.map(|name| (name.to_owned(), Column::Numbers(vec![1.0])));
        let table = Table { columns: columns.into(), comment: "note".to_owned() };
        let named = |spelled| {
            let (columns, comment) = table.named(spelled);
            (columns.into_iter().map(|(name, _)| name).collect::<Vec<_>>(), comment)
        };
        let (of_mat, comment) = named(identifier);
        assert_eq!(of_mat[1..6], ["gauge_0_V", "gain_um_per_V", "x1st__um_", "a_b", "a_b_2"]);
        assert!(comment.starts_with("note\ncolumn gauge_0_V is `gauge[0]_V`\ncolumn gain_um_per_V is"), "{comment}");
        let (of_npz, comment) = named(file_name);
        assert_eq!(
            of_npz[2..],
            ["gain_um_per_V", "1st (µm)", "a_b", "a_b_2", "c_b", "time_s_2", "gain_um_per_V_2", "_..", "comment_2"]
        );
        assert!(comment.contains("column a_b_2 is `a\\b`") && !comment.contains("gauge[0]"), "{comment}");
        // As they are in the archive.
        let text = String::from_utf8_lossy(&Form::Npz.file(&table).unwrap()).into_owned();
        assert!(of_npz.iter().all(|name| text.contains(&format!("{name}.npy"))), "{of_npz:?}");
        assert_eq!(Form::of(Path::new("a.NPZ")), Some(Form::Npz));
        assert_eq!(Form::of(Path::new("a.csv")), None);
    }

    #[test]
    fn only_tables_become_arrays() {
        for csv in ["", "a\n", "a,b\n1\n", "a,b\n1,2,3\n", "{\"a\": 1}\n", "1,2\n3,4\n"] {
            assert!(Form::Npz.of_csv(csv.as_bytes()).is_err(), "{csv}");
        }
        let file = Form::Npz.of_csv(b"a,name\n# note\n1,x\n,yz\n").unwrap();
        let text = String::from_utf8_lossy(&file);
        for part in ["a.npy", "'<f8'", "name.npy", "'<U2'", "comment.npy", "'shape': (2,), }", "'shape': ()"] {
            assert!(text.contains(part), "{part}");
        }
        // Without rows, and with other signs.
        let empty = String::from_utf8_lossy(&Form::Npz.of_csv(b"a,b\n").unwrap()).into_owned();
        assert!(empty.contains("'<f8'") && empty.contains("'shape': (0,)"));
        let table = Table::of_csv(b"a;b;c\n# one, two\n1,5;2;x\n-3;4,25;y\n").unwrap();
        let numbers = |k: usize| table.columns[k].1.clone();
        assert_eq!([numbers(0), numbers(1)], [[1.5, -3.0], [2.0, 4.25]].map(|values| Column::Numbers(values.into())));
        assert_eq!(table.csv(), "a,b,c\n# one, two\n1.5,2.0,x\n-3.0,4.25,y\n");
        assert_eq!(Table::of_csv(b"a;b\r1;2\r3;4\r"), Table::of_csv(b"a;b\n1;2\n3;4\n"));
        for (csv, texts) in [("a;b\n1,234;2\n5,678;3\n", true), ("a;b\n1,234;2\n0,678;3\n", false)] {
            let table = Table::of_csv(csv.as_bytes()).unwrap();
            assert_eq!(matches!(table.columns[0].1, Column::Texts(_)), texts, "{csv}");
        }
        let quoted = Table { columns: vec![("t, \"s\"".to_owned(), numbers(0))], comment: String::new() };
        assert!(quoted.csv().starts_with("\"t, \"\"s\"\"\"\n"));
    }
}
