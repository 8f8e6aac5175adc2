//! The user's description of the columns of bench files.

use super::columns::names::{QUANTITIES, Quantity};

/// How to read records whose names are not standard. By default, by their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    columns: Vec<ColumnChoice>,
    /// Samples per second, Hz; time is computed from it.
    rate: Option<f64>,
}

/// A column that the user names.
#[derive(Debug, Clone, PartialEq)]
struct ColumnChoice {
    /// The quantity's name in this project, or `sample`.
    quantity: &'static str,
    /// Number of the column's units in one of the quantity's.
    per: f64,
    /// Its name, or its number from 1.
    column: String,
}

/// Quantity of a column with sample numbers.
const SAMPLE: &str = "sample";

impl Reading {
    /// From `NAME=COLUMN` each, such as `drive_mV=Voltage` or `time_s=1`: a name with its unit, and the header or the
    /// number (from 1) of its column; and samples per second, Hz.
    ///
    /// # Errors
    /// The expected form, for the first that does not have it.
    pub fn new(columns: &[String], rate: Option<f64>) -> Result<Self, String> {
        Ok(Self { columns: columns.iter().map(|text| column_choice(text)).collect::<Result<_, _>>()?, rate })
    }

    /// Samples per second, Hz.
    pub(crate) fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// The name or number of the column that the user names for a quantity, with its unit.
    pub(crate) fn column(&self, quantity: &str) -> Option<(&str, f64)> {
        self.columns
            .iter()
            .find(|chosen| chosen.quantity == quantity)
            .map(|chosen| (chosen.column.as_str(), chosen.per))
    }

    /// The column with sample numbers.
    pub(crate) fn sample_column(&self) -> Option<&str> {
        self.column(SAMPLE).map(|(column, _)| column)
    }

    /// Quantities with a column from the user, without those `wanted`.
    pub(crate) fn unknown<'a>(&'a self, wanted: &'a [&str]) -> impl Iterator<Item = &'static str> + 'a {
        self.columns.iter().map(|chosen| chosen.quantity).filter(|name| *name != SAMPLE && !wanted.contains(name))
    }
}

fn column_choice(text: &str) -> Result<ColumnChoice, String> {
    let expected = || format!("expected a name with its unit and a column, such as drive_V=2, found `{text}`");
    let (name, column) = text.split_once('=').ok_or_else(expected)?;
    let (name, column) = (name.trim(), column.trim().to_owned());
    if column.is_empty() {
        return Err(expected());
    }
    if name == SAMPLE {
        return Ok(ColumnChoice { quantity: SAMPLE, per: 1.0, column });
    }
    let found = QUANTITIES.iter().find_map(|quantity: &Quantity| quantity.per_of(name).map(|per| (quantity.name, per)));
    match found {
        Some((quantity, per)) => Ok(ColumnChoice { quantity, per, column }),
        None => {
            let plain = name.split('_').next().unwrap_or(name);
            let near = QUANTITIES.iter().find(|quantity| quantity.plain().eq_ignore_ascii_case(plain));
            let known = near.map_or_else(
                || {
                    QUANTITIES.iter().map(|quantity| format!("`{}`", quantity.name)).collect::<Vec<_>>().join(", ")
                        + ", `sample`"
                },
                Quantity::all_names,
            );
            Err(format!("`{name}` is not a column name; expected one of {known}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_with_their_units() {
        let reading = Reading::new(&["drive_mV=Voltage 1".to_owned(), "sample=3".to_owned()], Some(1e4)).unwrap();
        assert_eq!(reading.column("drive_V"), Some(("Voltage 1", 1e3)));
        assert_eq!((reading.sample_column(), reading.rate()), (Some("3"), Some(1e4)));
        assert_eq!(reading.unknown(&["time_s"]).collect::<Vec<_>>(), ["drive_V"]);
        for (text, expected) in [
            ("drive_V", "such as drive_V=2"),
            ("drive_V=", "such as drive_V=2"),
            ("drive=2", "`drive_V`, `drive_mV`"),
            ("speed_V=2", "`time_s`, `drive_V`"),
        ] {
            let found = Reading::new(&[text.to_owned()], None).unwrap_err();
            assert!(found.contains(expected), "{found}");
        }
    }
}
