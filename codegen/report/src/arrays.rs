//! `specgen export table`: a table in another form.

use std::path::Path;

use serde::Serialize;
use specgen_identify::{TextOrArrays, read_table};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{write_columns, write_table};
use specgen_language::ui::Ui;

use crate::drawing::wrote;
use crate::identify::refused;

/// A written table.
#[derive(Serialize)]
struct Written {
    file: String,
}

impl Outcome for Written {
    fn text(&self) -> String {
        wrote(Path::new(&self.file))
    }
}

/// Writes the table of a file to `output`, in the form of its suffix.
///
/// # Errors
/// The file cannot be read or has no table, or the output cannot be written.
pub fn run(table: &Path, output: &Path, ui: &mut Ui) -> Result<(), Failure> {
    match read_table(table, &table.display().to_string()).map_err(refused)? {
        TextOrArrays::Text(csv) => write_table(output, csv.as_bytes())?,
        TextOrArrays::Arrays(columns) => write_columns(output, &columns)?,
    }
    ui.result(&Written { file: output.display().to_string() });
    Ok(())
}
