//! The second table as CSV, and the options as lines of a spec.

use std::fmt::Write as _;

use super::{Inertia, RateModel, RateOption};
use crate::everett::EverettTable;
use crate::export::{read_nodes, write_nodes};
use crate::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};

const HEADER: &str = "up_V,down_V,rate_um_s_per_V";
/// Largest valid value, m s/V: a metre at 1 V/s.
const LARGEST: f64 = 1.0;

/// Γ₁ as CSV text: columns `up_V`, `down_V`, `rate_um_s_per_V`, one line per node with up > down.
#[must_use]
pub fn write_rate_csv(table: &EverettTable) -> String {
    write_nodes(table, HEADER)
}

/// Reads the text of [`write_rate_csv`], m s/V. `shown_as` names the file in messages.
///
/// # Errors
/// A finding for each line that does not have the form of [`write_rate_csv`].
pub fn read_rate_csv(text: &str, shown_as: &str) -> Result<EverettTable, Vec<Diagnostic>> {
    const LINE: [&str; 2] = [
        "is not three numbers in range",
        "write the file with `specgen identify rate … -o NAME`: it is the one that ends in -mu1.csv",
    ];
    let mut findings = Findings::new(shown_as);
    let table = read_nodes(text, HEADER, codes::RATE_TABLE_FILE, LINE, LARGEST, &mut findings);
    findings.conclude(table).map(|((table, _), _)| table)
}

/// The `[hysteresis]` lines of a spec for `model`; `table` and `rate_table` name the CSV files. `held` (s) is the part
/// of the dead time that is the hold of the records' commands: the controller adds its own.
#[must_use]
pub fn spec_lines(option: RateOption, model: &RateModel, held: f64, table: &str, rate_table: &str) -> String {
    let mut text = format!("grid    = {}\nrecords = [\"{table}\"]\n", model.still.grid);
    // Writing to a String cannot fail.
    let _ = match option {
        RateOption::Static | RateOption::DeadTime => Ok(()),
        RateOption::DynamicPreisach => {
            writeln!(text, "rate    = \"dynamic-preisach\"\nrate_tables = [\"{rate_table}\"]")
        }
        _ if model.creep.is_empty() => Ok(()),
        RateOption::Creep | RateOption::EvenCreep | RateOption::CreepMode => {
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
    if model.dead_time > held {
        let ms = shown((model.dead_time - held) * 1e3);
        let _ = writeln!(text, "dead_time = \"{ms} ms\"    # for six legs; with [control] use control.lead");
    }
    if let Some(Inertia { mode, gain }) = model.inertia {
        let (frequency, damping) = (shown(mode.frequency), shown(mode.damping));
        let share = shown(gain / model.still.mean_gain());
        let _ = writeln!(
            text,
            "[actuator]\nresonance      = \"{frequency} Hz\"\ndamping_ratio  = {damping}\nresonance_gain = {share}"
        );
    }
    text
}

/// Six significant digits, without trailing zeros.
fn shown(value: f64) -> String {
    let text = format!("{value:.5e}");
    text.parse::<f64>().map_or(text, |rounded| format!("{rounded:?}"))
}
