//! The user's description of the columns of bench files.

mod scale;

use super::columns::names::{self, COORDINATES, Conversion, QUANTITIES, Quantity};
use crate::findings::Findings;
use scale::Scaled;
use specgen_language::diagnostic::{Code, Diagnostic};
use specgen_language::shell;

/// How to read records whose names are not standard. By default, by their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    columns: Vec<ColumnChoice>,
    /// Samples per second, Hz; time is computed from it.
    rate: Option<f64>,
    /// Name or number of the table in a file that has several.
    series: Option<String>,
    /// Largest size of what is unpacked in memory, bytes.
    max_size: MaxSize,
    /// Whether the key `columns` of a spec describes them, not the option `--columns`.
    is_key: bool,
}

/// Limit of what is unpacked in memory: of the bytes of the file, packed and unpacked, and of its numbers at 8 bytes each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MaxSize {
    pub(crate) bytes: u64,
    /// Whether the user can raise it.
    pub(crate) is_option: bool,
}

impl Default for MaxSize {
    fn default() -> Self {
        Self { bytes: 2 * GB, is_option: true }
    }
}

/// Bytes.
const GB: u64 = 1_000_000_000;

/// A size such as `4GB`, in bytes.
///
/// # Errors
/// The expected form.
pub fn size(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "KB" => 1000,
        "MB" => GB / 1000,
        "GB" => GB,
        "TB" => 1000 * GB,
        _ => 0,
    };
    let bytes = digits.parse::<f64>().ok().map(|number| (number * unit as f64).ceil()).filter(|bytes| *bytes > 0.0);
    bytes.map(|bytes| bytes as u64).ok_or_else(|| "expected a size such as 500MB or 4GB".to_owned())
}

/// The least such size with three decimals that is not below `bytes`.
pub(crate) fn shown_size(bytes: u64) -> String {
    let (unit, name) = match bytes {
        ..1_000_000 => (1000, "kB"),
        1_000_000..GB => (GB / 1000, "MB"),
        _ => (GB, "GB"),
    };
    format!("{}{name}", bytes.div_ceil(unit / 1000) as f64 / 1000.0)
}

/// A column that the user names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColumnChoice {
    /// `NAME=COLUMN`.
    pub(crate) text: String,
    /// The quantity's name in this project, or `sample`.
    pub(crate) quantity: &'static str,
    /// Its name, or its number from 1, and what follows it: a name may look like a scale.
    pub(crate) column: String,
    /// Its unit; none if only the scale has one.
    pub(crate) conversion: Option<Conversion>,
    /// What `column` means if no column has that name.
    pub(crate) scaled: Option<Scaled>,
}

/// Quantity of a column with sample numbers.
const SAMPLE: &str = "sample";

impl Reading {
    /// From lists of `NAME=COLUMN`, such as `drive_mV=Voltage,time_s=1`: a name with its unit, and the header or the
    /// number (from 1) of its column, which may be scaled, as in `displacement=CH2*5 um/V+0.3 um`; and samples per
    /// second, Hz.
    ///
    /// # Errors
    /// The expected form, for the first that does not have it.
    pub fn new(columns: &[String], rate: Option<f64>) -> Result<Self, String> {
        let entries = columns.iter().flat_map(|list| entries(list));
        let columns = entries.map(column_choice).collect::<Result<Vec<_>, _>>()?;
        let other = |k: usize| columns[..k].iter().find(|other| other.quantity == columns[k].quantity);
        match (0..columns.len()).find_map(|k| Some((other(k)?, &columns[k]))) {
            Some((first, second)) => {
                Err(format!("`{}` and `{}` name two columns for {}: give one", first.text, second.text, first.quantity))
            }
            None => Ok(Self { columns, rate, ..Self::default() }),
        }
    }

    /// From the key `columns` of a spec, for a file with this name; by the names in the file if it is not given.
    ///
    /// # Errors
    /// A finding with the expected form.
    pub(crate) fn of_key(columns: Option<&str>, shown_as: &str, code: Code) -> Result<Self, Vec<Diagnostic>> {
        let given: Vec<String> = columns.map(str::to_owned).into_iter().collect();
        Self::new(&given, None).map(|reading| Self { is_key: true, ..reading }).map_err(|why| {
            let mut findings = Findings::new(shown_as);
            findings.add(code, None, format!("`columns` of the spec: {why}"), "describe a column as in `x_um=2`");
            findings.into_diagnostics()
        })
    }

    /// What describes the columns, for a message.
    pub(crate) fn option(&self) -> &'static str {
        if self.is_key { "`columns` of the spec" } else { "`--columns`" }
    }

    /// `columns` as they are given.
    pub(crate) fn given(&self, columns: &str) -> String {
        if self.is_key { format!("columns = {columns:?}") } else { format!("--columns {}", shell::quoted(columns)) }
    }

    /// The same, of the table with this name or number (from 1) in a file that has several.
    #[must_use]
    pub fn of_series(self, series: Option<String>) -> Self {
        Self { series, ..self }
    }

    /// The same with another limit of the size in memory, bytes.
    #[must_use]
    pub fn with_max_size(self, bytes: u64) -> Self {
        Self { max_size: MaxSize { bytes, is_option: true }, ..self }
    }

    /// Limit of the size in memory.
    pub(crate) fn max_size(&self) -> MaxSize {
        self.max_size
    }

    /// Name or number of the table.
    pub(crate) fn series(&self) -> Option<&str> {
        self.series.as_deref()
    }

    /// Samples per second, Hz.
    pub(crate) fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// The column that the user names for a quantity.
    pub(crate) fn column(&self, quantity: &str) -> Option<&ColumnChoice> {
        self.columns.iter().find(|chosen| chosen.quantity == quantity)
    }

    /// The columns that the user names, one for each quantity.
    pub(crate) fn chosen(&self) -> impl Iterator<Item = &ColumnChoice> {
        self.columns.iter()
    }

    /// The column with sample numbers.
    pub(crate) fn sample_column(&self) -> Option<&ColumnChoice> {
        self.column(SAMPLE)
    }

    /// Quantities with a column from the user, without those `wanted`.
    pub(crate) fn unknown<'a>(&'a self, wanted: &'a [&str]) -> impl Iterator<Item = &'static str> + 'a {
        self.columns.iter().map(|chosen| chosen.quantity).filter(|name| *name != SAMPLE && !wanted.contains(name))
    }
}

/// The entries of a list. A comma within a header separates nothing: an entry begins with a name and `=`.
fn entries(list: &str) -> Vec<String> {
    let begins = |piece: &str| {
        let is_letter = |c: char| c.is_alphanumeric() || matches!(c, '_' | '/' | '^');
        piece.split_once('=').is_some_and(|(name, _)| !name.trim().is_empty() && name.trim().chars().all(is_letter))
    };
    let mut entries: Vec<String> = Vec::new();
    for piece in list.split(',') {
        match entries.last_mut() {
            Some(last) if !begins(piece) => {
                last.push(',');
                last.push_str(piece);
            }
            _ => entries.push(piece.to_owned()),
        }
    }
    entries
}

fn column_choice(text: String) -> Result<ColumnChoice, String> {
    let expected = || format!("expected a name with its unit and a column, such as drive_V=2, found `{text}`");
    let (name, column) = text.split_once('=').ok_or_else(expected)?;
    let (name, column) = (name.trim().to_owned(), column.trim().to_owned());
    if column.is_empty() {
        return Err(expected());
    }
    if name == SAMPLE {
        return Ok(ColumnChoice {
            text,
            quantity: SAMPLE,
            column,
            conversion: Some(Conversion::unit(1.0)),
            scaled: None,
        });
    }
    let found = names::all().find_map(|quantity| match quantity.per_of(&name) {
        Some(per) => Some((quantity, Some(per))),
        None => (name == quantity.plain()).then_some((quantity, None)),
    });
    let Some((quantity, per)) = found else { return Err(unknown(&name)) };
    let scaled = match scale::parse(&column, quantity, per) {
        // With a unit in the name, what looks like a scale may be a header.
        Err(_) if per.is_some() => None,
        scaled => scaled?,
    };
    if per.is_none() && scaled.is_none() {
        let unit = quantity.unit();
        return Err(format!("`{name}` has no unit: {}, or `{name}={column}*5 {unit}/V`", quantity.all_names()));
    }
    Ok(ColumnChoice { text, quantity: quantity.name, column, conversion: per.map(Conversion::unit), scaled })
}

fn unknown(name: &str) -> String {
    let plain = name.split('_').next().unwrap_or(name);
    let near = names::all().find(|quantity| quantity.plain().eq_ignore_ascii_case(plain));
    let usual = QUANTITIES.iter().chain(&COORDINATES).map(|quantity| format!("`{}`", quantity.name));
    let all = || usual.collect::<Vec<_>>().join(", ");
    let known = near.map_or_else(|| all() + ", `sample`", Quantity::all_names);
    format!("`{name}` is not a column name; expected one of {known}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_shown_so_that_they_suffice() {
        for (bytes, shown) in [
            (2 * GB, "2GB"),
            (2 * GB + 1, "2.001GB"),
            (GB, "1GB"),
            (GB - 1, "1000MB"),
            (16_384_000, "16.384MB"),
            (20, "0.02kB"),
        ] {
            assert_eq!(shown_size(bytes), shown);
            assert!(size(shown).unwrap() >= bytes && size(shown).unwrap() <= bytes + bytes / 1000 + 1, "{shown}");
        }
        for text in ["0GB", "-1GB", "GB", "nanGB", "4", "4GiB"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn columns_are_named_with_their_units() {
        let list = "drive_mV=Voltage 1,sample=3,displacement_um=Ch2,um".to_owned();
        let reading = Reading::new(&[list], Some(1e4)).unwrap();
        let drive = reading.column("drive_V").unwrap();
        assert_eq!((drive.column.as_str(), drive.conversion), ("Voltage 1", Some(Conversion::unit(1e3))));
        assert_eq!(reading.column("displacement_um").unwrap().column, "Ch2,um");
        assert_eq!((reading.sample_column().unwrap().column.as_str(), reading.rate()), ("3", Some(1e4)));
        assert_eq!(reading.unknown(&["time_s", "drive_V"]).collect::<Vec<_>>(), ["displacement_um"]);
        for (text, expected) in [
            ("drive_V", "such as drive_V=2"),
            ("drive_V=", "such as drive_V=2"),
            ("drive=2", "`drive_V`, `drive_mV`"),
            ("speed_V=2", "`time_s`, `drive_V`"),
            ("time_s=1,speed_V=2", "`time_s`, `drive_V`"),
            ("displacement=CH2*5 V/um", "a unit of `displacement`"),
            ("displacement=CH2*x", "a factor"),
            ("drive_V=1,drive_mV=2", "two columns for drive_V"),
        ] {
            let found = Reading::new(&[text.to_owned()], None).unwrap_err();
            assert!(found.contains(expected), "{found}");
        }
    }
}
