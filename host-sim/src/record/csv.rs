//! A record as CSV: time, inputs, what came out. Numbers as the shortest decimals that give the same bits; units in the names.

use std::io::{self, Write};

use super::{Block, Header};
use crate::word::WordKind;

/// Names of what came out.
const OUTPUTS: &str =
    "dac_code[0],dac_code[1],dac_code[2],dac_code[3],dac_code[4],dac_code[5],status,phase,cause,amplifiers_on";

/// The rows of a block; with the line of names before them for the `first` block.
///
/// # Errors
/// The sink does not take them.
pub fn write_csv(sink: &mut impl Write, header: &Header, block: &Block, first: bool) -> io::Result<()> {
    let names = header.input_names();
    if first {
        write!(sink, "tick,time_s")?;
        for name in &names {
            write!(sink, ",{}", title(name))?;
        }
        writeln!(sink, ",{OUTPUTS}")?;
    }
    let single = header.description.scalar.bits() == 32;
    let kinds: Vec<WordKind> = names.iter().map(|name| WordKind::of(name)).collect();
    for row in &block.rows {
        write!(sink, "{},{:.9}", row.tick, row.tick as f64 * header.period)?;
        for (word, kind) in row.input.iter().zip(&kinds) {
            match kind {
                WordKind::Integer => write!(sink, ",{word}")?,
                WordKind::Real if single => write!(sink, ",{:?}", f32::from_bits(*word as u32))?,
                WordKind::Real => write!(sink, ",{:?}", f64::from_bits(*word))?,
            }
        }
        for code in row.codes {
            write!(sink, ",{code}")?;
        }
        let [phase, cause, on, _] = row.supervisor.to_le_bytes();
        writeln!(sink, ",{},{phase},{cause},{on}", row.status)?;
    }
    Ok(())
}

/// A name with its unit, where it is one and the same: a set-point is a pose (m, rad) or a displacement, a gauge gives m or V.
fn title(name: &str) -> String {
    let (stem, index) = name.split_once('[').unwrap_or((name, ""));
    let turns = matches!(index.trim_end_matches(']'), "3" | "4" | "5");
    let unit = match (stem, turns) {
        ("setpoint_rate", false) => "_m/s",
        ("setpoint_rate", true) => "_rad/s",
        ("setpoint_acceleration", false) => "_m/s2",
        ("setpoint_acceleration", true) => "_rad/s2",
        ("wrench", false) => "_N",
        ("wrench", true) => "_Nm",
        ("displacement", _) => "_m",
        _ => "",
    };
    format!("{name}{unit}")
}
