//! A record as CSV: time, inputs, outputs, and after a replay also volts, pose, target and error. Numbers as the
//! shortest decimals that give the same bits; units in the names.

use std::io::{self, Write};

use specgen_runtime::trigger;

use super::{Block, Header};
use crate::controller::MachineWord;
use crate::word::{Scalar, WordKind, status_words};

/// Names of what came out.
const OUTPUTS: &str = "dac_code[0],dac_code[1],dac_code[2],dac_code[3],dac_code[4],dac_code[5],status,phase,cause,\
                       amplifiers_on,supervisor_text,status_text";

/// Outputs of a controller that replays a block, for each of its rows.
#[derive(Debug, Clone, Copy)]
pub struct ReplayedRows<'a> {
    /// Names of its output words.
    pub names: &'a [String],
    /// Its output words, row by row; fewer rows than in the block if it was not replayed to the end.
    pub rows: &'a [Vec<u64>],
}

/// The rows of a block, with the line of names before the `first` block. All blocks of a file have `again`, or none.
///
/// # Errors
/// If the sink fails.
pub fn write_csv(
    sink: &mut impl Write,
    header: &Header,
    block: &Block,
    again: Option<ReplayedRows>,
    first: bool,
) -> io::Result<()> {
    let names = header.input_names();
    let scalar = header.description.scalar;
    let lines = header.description.lines();
    let more = again.map_or_else(Vec::new, |again| Column::all(&names, again.names, lines));
    if first {
        write!(sink, "tick,time_s")?;
        for name in &names {
            write!(sink, ",{}", title(name))?;
        }
        write!(sink, ",{OUTPUTS}")?;
        for line in 0..lines {
            write!(sink, ",trigger[{line}]")?;
        }
        for column in &more {
            write!(sink, ",{}", column.title)?;
        }
        writeln!(sink)?;
    }
    let kinds: Vec<WordKind> = names.iter().map(|name| WordKind::of(name)).collect();
    for (index, row) in block.rows.iter().enumerate() {
        write!(sink, "{},{:.9}", row.tick, row.tick as f64 * header.period)?;
        for (word, kind) in row.input.iter().zip(&kinds) {
            match kind {
                WordKind::Integer => write!(sink, ",{word}")?,
                WordKind::Real => real(sink, scalar, *word)?,
            }
        }
        for code in row.codes {
            write!(sink, ",{code}")?;
        }
        let [phase, cause, on, _] = row.supervisor.to_le_bytes();
        let supervisor = MachineWord::of(u64::from(row.supervisor));
        write!(sink, ",{},{phase},{cause},{on},{supervisor},{}", row.status, status_words(row.status))?;
        for line in 0..lines {
            write!(sink, ",{}", trigger::lines(row.status) >> line & 1)?;
        }
        let given = again.and_then(|again| again.rows.get(index));
        for column in &more {
            match (given, &column.of) {
                (None, _) => write!(sink, ",")?,
                (Some(given), ColumnSource::Output(place)) => real(sink, scalar, given[*place])?,
                (Some(given), ColumnSource::Missed(place, line)) => {
                    write!(sink, ",{}", given[*place] >> (15 * line) & trigger::MOST_MISSED as u64)?;
                }
                (Some(given), ColumnSource::Difference(target, place)) => {
                    write!(sink, ",{:.6e}", scalar.decode(given[*target]) - scalar.decode(given[*place]))?;
                }
                (Some(given), ColumnSource::FromInput(target, place)) => {
                    write!(sink, ",{:.6e}", scalar.decode(given[*target]) - scalar.decode(row.input[*place]))?;
                }
            }
        }
        writeln!(sink)?;
    }
    Ok(())
}

fn real(sink: &mut impl Write, scalar: Scalar, word: u64) -> io::Result<()> {
    if scalar.bits() == 32 {
        write!(sink, ",{:?}", f32::from_bits(word as u32))
    } else {
        write!(sink, ",{:?}", f64::from_bits(word))
    }
}

/// A column from the replay.
struct Column {
    title: String,
    of: ColumnSource,
}

enum ColumnSource {
    /// An output word.
    Output(usize),
    /// Pulses that a line has missed, in this output word.
    Missed(usize, usize),
    /// An output word less another: target less pose.
    Difference(usize, usize),
    /// An output word less an input word: demand of a leg less its gauge.
    FromInput(usize, usize),
}

impl Column {
    /// Volts; then for a platform pose, target, missed pulses of its `lines` and error; for legs demand and error.
    fn all(inputs: &[String], outputs: &[String], lines: usize) -> Vec<Self> {
        let place =
            |names: &[String], stem: &str, k: usize| names.iter().position(|name| *name == format!("{stem}[{k}]"));
        let mut columns = Vec::new();
        for (stem, units) in
            [("voltage", ["V", "V"]), ("pose", ["m", "rad"]), ("target", ["m", "rad"]), ("demand", ["m", "m"])]
        {
            // The target of a platform says what its legs are asked for.
            if stem == "demand" && place(outputs, "target", 0).is_some() {
                continue;
            }
            columns.extend((0..6).filter_map(|k| {
                let of = ColumnSource::Output(place(outputs, stem, k)?);
                Some(Self { title: format!("{stem}[{k}]_{}", units[k / 3]), of })
            }));
        }
        if let Some(missed) = outputs.iter().position(|name| name == "missed") {
            let column = |line| Self { title: format!("missed[{line}]"), of: ColumnSource::Missed(missed, line) };
            columns.extend((0..lines).map(column));
        }
        for k in 0..6 {
            let platform = place(outputs, "target", k).zip(place(outputs, "pose", k));
            let leg = place(outputs, "demand", k).zip(place(inputs, "displacement", k));
            let (of, unit) = match (platform, leg) {
                (Some((target, pose)), _) => (ColumnSource::Difference(target, pose), ["m", "rad"][k / 3]),
                (None, Some((demand, gauge))) => (ColumnSource::FromInput(demand, gauge), "m"),
                (None, None) => continue,
            };
            columns.push(Self { title: format!("error[{k}]_{unit}"), of });
        }
        columns
    }
}

/// A name with its unit, if the unit is unique: a set-point is a pose (m, rad) or a displacement, a gauge gives m or V.
fn title(name: &str) -> String {
    let (stem, index) = name.split_once('[').unwrap_or((name, ""));
    let turns = matches!(index.trim_end_matches(']'), "3" | "4" | "5");
    let unit = match (stem, turns) {
        ("setpoint_rate", false) => "_m/s",
        ("setpoint_rate", true) => "_rad/s",
        ("setpoint_acceleration", false) => "_m/s2",
        ("setpoint_acceleration", true) => "_rad/s2",
        ("correction", false) => "_m",
        ("correction", true) => "_rad",
        ("wrench", false) => "_N",
        ("wrench", true) => "_Nm",
        ("displacement", _) => "_m",
        _ => "",
    };
    format!("{name}{unit}")
}
