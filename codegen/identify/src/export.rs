//! An Everett table as CSV: columns `up_V`, `down_V`, `everett_um`, one line per node with up > down.

use std::fmt::Write as _;

use super::findings::Findings;
use crate::everett::EverettTable;
use specgen_language::diagnostic::{Diagnostic, codes};

const HEADER: &str = "up_V,down_V,everett_um";

/// The table as CSV text. Numbers are shortest round-trip, so that the same table gives the same bytes.
#[must_use]
pub fn write_table_csv(table: &EverettTable) -> String {
    let mut text = format!("{HEADER}\n");
    for up in 1..=table.grid {
        for down in 0..up {
            let um = table.node(up, down) * 1e6;
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{:?},{:?},{um:?}", table.threshold(up), table.threshold(down));
        }
    }
    text
}

/// Whether a data file is a table as [`write_table_csv`] writes it, by its first line.
#[must_use]
pub fn is_table_csv(text: &str) -> bool {
    text.lines().next() == Some(HEADER)
}

/// Reads what [`write_table_csv`] wrote; node values are the same within rounding of the unit. `shown_as` names the file in messages.
///
/// # Errors
/// A finding per line that is not as [`write_table_csv`] writes it.
pub fn read_table_csv(text: &str, shown_as: &str) -> Result<EverettTable, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let help = "write the file with `specgen identify`";
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim()));
    if lines.next().is_none_or(|(_, header)| header != HEADER) {
        findings.add(codes::TABLE_FILE, Some(1), format!("the header must be `{HEADER}`"), help);
        return Err(findings.into_diagnostics());
    }
    let mut values = Vec::new();
    for (line, text) in lines.filter(|(_, text)| !text.is_empty()) {
        let fields: Vec<f64> =
            text.split(',').filter_map(|f| f.trim().parse().ok()).filter(|x: &f64| x.is_finite()).collect();
        match fields[..] {
            [up, down, um] => values.push([up, down, um]),
            _ => findings.add(codes::TABLE_FILE, Some(line), "is not three finite numbers".to_owned(), help),
        }
    }
    let grid = (1..=256).find(|n| n * (n + 1) / 2 == values.len());
    let table = match (grid, values.first(), values.last()) {
        (Some(grid), Some(first), Some(last)) if first[1] < last[0] => EverettTable {
            grid,
            drive_min: first[1],
            drive_max: last[0],
            nodes: values.iter().map(|v| v[2] * 1e-6).collect(),
        },
        _ => {
            let message = format!("{} nodes do not make a triangle of rising thresholds", values.len());
            findings.add(codes::TABLE_FILE, None, message, help);
            return Err(findings.into_diagnostics());
        }
    };
    let tolerance = 1e-9 * (table.drive_max - table.drive_min);
    for up in 1..=table.grid {
        for down in 0..up {
            let at = EverettTable::index(up, down);
            let wanted = [table.threshold(up), table.threshold(down)];
            if (values[at][0] - wanted[0]).abs() > tolerance || (values[at][1] - wanted[1]).abs() > tolerance {
                let message = format!(
                    "thresholds {} V, {} V; expected {} V, {} V",
                    values[at][0], values[at][1], wanted[0], wanted[1]
                );
                findings.add(codes::TABLE_FILE, Some(at + 2), message, help);
            }
        }
    }
    check_weights(&table, &mut findings);
    if findings.any_error() { Err(findings.into_diagnostics()) } else { Ok(table) }
}

/// A table with a negative weight is not monotone, so that its inverse is not unique. Rounding is let pass.
fn check_weights(table: &EverettTable, findings: &mut Findings) {
    let rounding = 1e-9 * table.node(table.grid, 0).abs();
    for up in 1..=table.grid {
        for down in 0..up {
            let weight = table.weight(up, down);
            if weight < -rounding {
                let message = format!(
                    "the weight of the cell below {} V and above {} V is negative ({:.3e} µm): the model would not be monotone",
                    table.threshold(up),
                    table.threshold(down),
                    weight * 1e6
                );
                findings.add(
                    codes::TABLE_FILE,
                    Some(EverettTable::index(up, down) + 2),
                    message,
                    "identify the record again",
                );
            }
        }
    }
}
