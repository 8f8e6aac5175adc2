//! An Everett table as CSV: columns `up_V`, `down_V`, `everett_um`, one line per node with up > down.

use std::fmt::Write as _;

use super::columns::{self, Column, Format, LineNumbers, Samples};
use super::findings::Findings;
use crate::everett::EverettTable;
use specgen_language::diagnostic::{Code, Diagnostic, codes};

const HEADER: &str = "up_V,down_V,everett_um";

/// The table as CSV text. Numbers are shortest round-trip, so that the same table gives the same bytes.
#[must_use]
pub fn write_table_csv(table: &EverettTable) -> String {
    write_nodes(table, HEADER)
}

/// Thresholds in V, nodes in µ of their unit, one line per node, below `header`.
pub(crate) fn write_nodes(table: &EverettTable, header: &str) -> String {
    let mut text = format!("{header}\n");
    for up in 1..=table.grid {
        for down in 0..up {
            let value = table.node(up, down) * 1e6;
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{:?},{:?},{value:?}", table.threshold(up), table.threshold(down));
        }
    }
    text
}

/// Whether a data file is a table as [`write_table_csv`] writes it, by its first line.
#[must_use]
pub fn is_table_csv(text: &str) -> bool {
    text.lines().next().is_some_and(|first| is_header(first, HEADER))
}

/// Whether a line has these names. Files of arrays give them with tabs.
fn is_header(line: &str, header: &str) -> bool {
    line.trim().replace('\t', ",") == header
}

/// Reads the text of [`write_table_csv`]; node values are equal within rounding of the unit. `shown_as` names the file
/// in messages.
///
/// # Errors
/// A finding for each line that does not have the form of [`write_table_csv`].
pub fn read_table_csv(text: &str, shown_as: &str) -> Result<EverettTable, Vec<Diagnostic>> {
    const LINE: [&str; 2] = ["is not three finite numbers", "write the file with `specgen identify`"];
    let mut findings = Findings::new(shown_as);
    let table = read_nodes(text, HEADER, codes::TABLE_FILE, LINE, f64::INFINITY, &mut findings);
    if let Some((table, lines)) = &table {
        check_weights(table, lines, &mut findings);
    }
    findings.conclude(table).map(|((table, _), _)| table)
}

/// Nodes in µ of their unit after two thresholds in V, in the order of a triangle with rising thresholds; with the line
/// of each node. Values above `largest` are refused. `None` after the problem was reported.
pub(crate) fn read_nodes(
    text: &str,
    header: &str,
    code: Code,
    line: [&'static str; 2],
    largest: f64,
    findings: &mut Findings,
) -> Option<(EverettTable, LineNumbers)> {
    let [message, help] = line;
    if !text.lines().next().is_some_and(|first| is_header(first, header)) {
        return findings.refuse(code, Some(1), format!("the header must be `{header}`"), help);
    }
    let format = Format {
        header: code,
        value: code,
        not_finite: (code, help),
        longer_lines: false,
        whole_line: Some(line),
        preamble: false,
        expected: help,
    };
    let (_, lines) = columns::open(text.as_bytes(), &format, findings)?;
    let Samples { lines, columns: values, .. } = lines.read(&[0, 1, 2].map(|at| Column::plain(at, "")), findings);
    let [ups, downs, values] = <[Vec<f64>; 3]>::try_from(values).ok()?;
    let nodes: Vec<f64> = values.iter().map(|value| value * 1e-6).collect();
    for (line, _) in lines.iter().zip(&nodes).filter(|(_, node)| node.abs() > largest) {
        findings.add(code, Some(line), message.to_owned(), help);
    }
    if findings.any_error() {
        return None;
    }
    let grid = (1..=256).find(|n| n * (n + 1) / 2 == nodes.len());
    let table = match (grid, downs.first(), ups.last()) {
        (Some(grid), Some(&drive_min), Some(&drive_max)) if drive_min < drive_max => {
            EverettTable { grid, drive_min, drive_max, nodes }
        }
        _ => {
            let message = format!("{} nodes do not make a triangle of rising thresholds", nodes.len());
            return findings.refuse(code, None, message, help);
        }
    };
    let tolerance = 1e-9 * (table.drive_max - table.drive_min);
    for up in 1..=table.grid {
        for down in 0..up {
            let at = EverettTable::index(up, down);
            let wanted = [table.threshold(up), table.threshold(down)];
            if (ups[at] - wanted[0]).abs() > tolerance || (downs[at] - wanted[1]).abs() > tolerance {
                let message =
                    format!("thresholds {} V, {} V; expected {} V, {} V", ups[at], downs[at], wanted[0], wanted[1]);
                findings.add(code, Some(lines.at(at)), message, help);
            }
        }
    }
    Some((table, lines))
}

/// Refuses a table with a negative weight: it is not monotone, so its inverse is not unique. Rounding is tolerated.
fn check_weights(table: &EverettTable, lines: &LineNumbers, findings: &mut Findings) {
    let rounding = 1e-9 * table.node(table.grid, 0).abs();
    for up in 1..=table.grid {
        for down in 0..up {
            let weight = table.weight(up, down);
            if weight < -rounding {
                let (below, above, excess) = (table.threshold(up), table.threshold(down), weight * 1e6);
                let message = format!(
                    "the weight of the cell below {below} V and above {above} V is negative ({excess:.3e} µm): the model would not be monotone"
                );
                let help = "identify the record again";
                findings.add(codes::TABLE_FILE, Some(lines.at(EverettTable::index(up, down))), message, help);
            }
        }
    }
}
