//! A leg model as a file: the CSV of its table, with a line about what is around it.

use super::{Around, LegModel};
use crate::export::{read_table_csv, write_table_csv};
use crate::findings::Findings;
use crate::regressor::Plane;
use specgen_language::diagnostic::{Diagnostic, codes};

/// Begins the line of a leg file with what is around its table.
const AROUND: &str = "# leg-model ";

/// A leg model as CSV text: the table, after a line with what is around it. Without one, as [`write_table_csv`].
#[must_use]
pub fn write_leg_csv(model: &LegModel) -> String {
    let text = write_table_csv(&model.table);
    let Some(around) = &model.around else { return text };
    match serde_json::to_string(around) {
        Ok(line) => text.replacen('\n', &format!("\n{AROUND}{line}\n"), 1),
        Err(error) => unreachable!("{error}: numbers are JSON"),
    }
}

/// Reads the text of [`write_leg_csv`]; the table of plays is made from them again.
///
/// # Errors
/// As [`read_table_csv`]; or a finding if the line of the leg model is not as written.
pub fn read_leg_csv(text: &str, shown_as: &str) -> Result<LegModel, Vec<Diagnostic>> {
    let table = read_table_csv(text, shown_as)?;
    let line = text.lines().enumerate().find_map(|(at, line)| Some((at + 1, line.strip_prefix(AROUND)?)));
    let Some((at, line)) = line else { return Ok(LegModel { table, around: None }) };
    let around = serde_json::from_str::<Around>(line).map_err(|error| error.to_string());
    match around.and_then(|around| around.validate()) {
        Ok(around) => {
            let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
            let table = around.plays.as_ref().map_or(table, |plays| plays.table(&plane));
            Ok(LegModel { table, around: Some(around) })
        }
        Err(why) => {
            let mut findings = Findings::new(shown_as);
            let help = "identify the record again";
            findings.add(codes::TABLE_FILE, Some(at), format!("the line of the leg model: {why}"), help);
            Err(findings.into_diagnostics())
        }
    }
}
