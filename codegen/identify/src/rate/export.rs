//! The second table as CSV, and the options as lines of a spec.

use std::fmt::Write as _;

use super::{RateModel, RateOption};
use crate::everett::EverettTable;
use crate::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};

const HEADER: &str = "up_V,down_V,rate_um_s_per_V";
/// Largest value that is believed, m s/V: a metre at 1 V/s.
const LARGEST: f64 = 1.0;

/// Γ₁ as CSV text: columns `up_V`, `down_V`, `rate_um_s_per_V`, one line per node with up > down.
#[must_use]
pub fn write_rate_csv(table: &EverettTable) -> String {
    let mut text = format!("{HEADER}\n");
    for up in 1..=table.grid {
        for down in 0..up {
            let value = table.node(up, down) * 1e6;
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{:?},{:?},{value:?}", table.threshold(up), table.threshold(down));
        }
    }
    text
}

/// Whether a data file is a table as [`write_rate_csv`] writes it, by its first line.
#[must_use]
pub fn is_rate_csv(text: &str) -> bool {
    text.lines().next().is_some_and(|line| line.trim() == HEADER)
}

/// Reads what [`write_rate_csv`] wrote, m s/V. `shown_as` names the file in messages.
///
/// # Errors
/// A finding per line that is not as [`write_rate_csv`] writes it.
pub fn read_rate_csv(text: &str, shown_as: &str) -> Result<EverettTable, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let help = "write the file with `specgen identify rate … -o NAME`: it is the one that ends in -mu1.csv";
    if !is_rate_csv(text) {
        findings.add(codes::RATE_TABLE_FILE, Some(1), format!("the header must be `{HEADER}`"), help);
        return Err(findings.into_diagnostics());
    }
    let mut values = Vec::new();
    for (k, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let fields: Vec<f64> = line.split(',').filter_map(|f| f.trim().parse().ok()).collect();
        match fields[..] {
            [up, down, value] if [up, down].iter().all(|x| x.is_finite()) && (value * 1e-6).abs() <= LARGEST => {
                values.push([up, down, value * 1e-6]);
            }
            _ => findings.add(codes::RATE_TABLE_FILE, Some(k + 1), "is not three numbers in range".to_owned(), help),
        }
    }
    if findings.any_error() {
        return Err(findings.into_diagnostics());
    }
    let grid = (1..=256).find(|n| n * (n + 1) / 2 == values.len());
    let (Some(grid), Some(first), Some(last)) = (grid, values.first(), values.last()) else {
        let message = format!("{} nodes do not make a triangle of thresholds", values.len());
        findings.add(codes::RATE_TABLE_FILE, None, message, help);
        return Err(findings.into_diagnostics());
    };
    let nodes = values.iter().map(|v| v[2]).collect();
    let table = EverettTable { grid, drive_min: first[1], drive_max: last[0], nodes };
    let tolerance = 1e-9 * (table.drive_max - table.drive_min).abs();
    for up in 1..=grid {
        for down in 0..up {
            let at = EverettTable::index(up, down);
            let wanted = [table.threshold(up), table.threshold(down)];
            if (0..2).any(|k| (values[at][k] - wanted[k]).abs() > tolerance) || wanted[0] <= wanted[1] {
                let message = format!(
                    "thresholds {} V, {} V; expected {} V, {} V, rising",
                    values[at][0], values[at][1], wanted[0], wanted[1]
                );
                findings.add(codes::RATE_TABLE_FILE, Some(at + 2), message, help);
            }
        }
    }
    if findings.any_error() { Err(findings.into_diagnostics()) } else { Ok(table) }
}

/// The `[hysteresis]` lines of a spec that uses `model`; `table` and `rate_table` name the CSV files.
#[must_use]
pub fn spec_lines(option: RateOption, model: &RateModel, table: &str, rate_table: &str) -> String {
    let mut text = format!("grid    = {}\nrecords = [\"{table}\"]\n", model.still.grid);
    // Writing to a String cannot fail.
    let _ = match option {
        RateOption::Static | RateOption::DeadTime => Ok(()),
        RateOption::DynamicPreisach => {
            writeln!(text, "rate    = \"dynamic-preisach\"\nrate_tables = [\"{rate_table}\"]")
        }
        RateOption::Creep if model.creep.is_empty() => Ok(()),
        RateOption::Creep => {
            let times: Vec<String> =
                model.creep.iter().map(|c| format!("\"{} ms\"", shown(c.time_constant * 1e3))).collect();
            let weights: Vec<String> = model.creep.iter().map(|c| shown(c.weight)).collect();
            writeln!(
                text,
                "rate    = \"creep\"\ncreep_times   = [{}]\ncreep_weights = [{}]",
                times.join(", "),
                weights.join(", ")
            )
        }
    };
    if model.dead_time > 0.0 {
        let ms = shown(model.dead_time * 1e3);
        let _ = writeln!(text, "dead_time = \"{ms} ms\"    # of six legs; with [control] it is control.lead");
    }
    text
}

/// Six significant digits, without idle zeros.
fn shown(value: f64) -> String {
    let text = format!("{value:.5e}");
    text.parse::<f64>().map_or(text, |rounded| format!("{rounded:?}"))
}
