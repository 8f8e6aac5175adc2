//! `specgen replay`: a record run again on the host, tick by tick, by bits.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::controller::{MachineWord, Supervised};
use host_sim::description::Description;
use host_sim::record::{self, Block, Header, Piece, Reader, Replay, ReplayError};
use serde_json::{Value, json};

use super::file::{PendingFile, unwritten};
use super::sim;
use super::ui::{Failure, Ui};
use specgen_compiler::compile::{self, Compiled};

/// Changes of the phase that are shown.
const SHOWN: usize = 20;
/// Arguments of `replay`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPLAY)]
pub struct Arguments {
    /// The record: from a target, from `specgen sim --record` or from `rt-pc --record`.
    record: PathBuf,
    /// The spec that the target was built from. Without it the record can only be exported.
    #[arg(long, value_name = "SPEC", required_unless_present = "csv")]
    spec: Option<PathBuf>,
    /// Write the record as CSV, with time and units.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.record.display();
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{shown}: {error}"));
    let mut reader = open(&arguments.record)?;
    let mut csv = arguments.csv.as_deref().map(Csv::new).transpose()?;
    let Some(spec) = &arguments.spec else {
        let found = export(&mut reader, csv.as_mut(), &refuse)?;
        let rows = csv.map(Csv::finish).transpose()?.unwrap_or_default();
        let result = json!({ "rows": rows, "damaged": found.damaged, "cut": found.cut });
        let cut = if found.cut { "; the file ends within a block" } else { "" };
        let text = format!("{shown}: {rows} rows exported{cut}\n");
        let Some((block, reason)) = found.damaged.first() else {
            ui.result(&text, result);
            return Ok(());
        };
        if !ui.is_json() {
            ui.out(&text);
        }
        let message =
            format!("{shown}: block {block} is damaged: {reason}; its rows are missing. Fetch or copy it again");
        return Err(Failure::Judged { message, result });
    };
    let compiled = compile::compile(spec)?;
    ui.findings_in_brief(&compiled.source, &compiled.findings);
    // Before the library is built: a wrong spec is told at once.
    same_build(arguments, &reader.header().description, &compiled)?;
    let controller = sim::emitted(&compiled, ui)?;
    let mut machine = Supervised::new(controller).map_err(sim::environment)?;
    ui.progress("running the record again");
    let mut trouble = None;
    let found = record::replay(&mut reader, &mut machine, |header, block| {
        if let Some(csv) = &mut csv
            && trouble.is_none()
        {
            trouble = csv.add(header, block).err();
        }
    });
    let found = match found {
        Err(ReplayError::Controller(error)) => return Err(sim::environment(error)),
        other => other.map_err(|error| refuse(&error))?,
    };
    if let Some(failure) = trouble {
        return Err(failure);
    }
    if let Some(csv) = csv {
        csv.finish()?;
    }
    let period = reader.header().period;
    let result = document(&found, period);
    let text = format!("{shown}: {}\n{}", compiled.ir.name, text(&found, period));
    match verdict(&found) {
        None => {
            ui.result(&text, result);
            Ok(())
        }
        Some(message) => {
            if !ui.is_json() {
                ui.out(&text);
            }
            Err(Failure::Judged { message: format!("{shown}: {message}"), result })
        }
    }
}

/// Refuses the record of another spec or of another version of specgen.
fn same_build(arguments: &Arguments, recorded: &Description, compiled: &Compiled) -> Result<(), Failure> {
    let version = env!("CARGO_PKG_VERSION");
    if recorded.digest == compiled.ir.digest && recorded.version == version {
        return Ok(());
    }
    Err(Failure::Gate(format!(
        "{} is of spec digest {}, specgen {}; {} gives {}, specgen {version}: name the spec that the target was built from, and \
         use the specgen that built it",
        arguments.record.display(),
        recorded.digest,
        recorded.version,
        arguments.spec.as_ref().map_or_else(String::new, |spec| spec.display().to_string()),
        compiled.ir.digest,
    )))
}

fn open(path: &Path) -> Result<Reader<BufReader<File>>, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", path.display()));
    let file = File::open(path).map_err(|error| refuse(&format_args!("cannot be read: {error}")))?;
    Reader::new(BufReader::with_capacity(1 << 20, file)).map_err(|error| refuse(&error))
}

/// Why the record fails, if it does. A file that was cut off is whole as far as it goes.
fn verdict(found: &Replay) -> Option<String> {
    if let Some(divergence) = &found.divergence {
        return Some(format!("the first tick that differs is {divergence}"));
    }
    if let Some((block, reason)) = found.damaged.first() {
        return Some(format!(
            "block {block} is damaged: {reason}; the ticks around it are bit-equal. Fetch or copy it again"
        ));
    }
    if found.ticks == 0 {
        return Some("there is no tick in it; record again".to_owned());
    }
    None
}

fn text(found: &Replay, period: f64) -> String {
    let mut out = String::new();
    let seconds = |tick: u64| tick as f64 * period;
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        out,
        "  {} ticks, {:.4} s, in {} blocks; codes, status, supervisor and {} digests of the machine compared",
        found.ticks,
        seconds(found.ticks),
        found.blocks,
        found.digests
    );
    for (index, change) in found.phases.iter().enumerate() {
        if index == SHOWN {
            let _ = writeln!(out, "  … {} more changes of the phase", found.phases.len() - SHOWN);
            break;
        }
        let _ =
            writeln!(out, "  tick {:>9} {:>10.4} s  {}", change.tick, seconds(change.tick), name(change.supervisor));
    }
    for tick in &found.triggers {
        let _ = writeln!(out, "  tick {tick:>9} {:>10.4} s  trigger", seconds(*tick));
    }
    for (from, to) in &found.gaps {
        let _ = writeln!(out, "  ticks {from} to {} are missing; the record goes on behind them", to.saturating_sub(1));
    }
    for (block, reason) in &found.damaged {
        let _ = writeln!(out, "  block {block} is damaged: {reason}");
    }
    if let Some(tick) = found.cut {
        let _ = writeln!(out, "  the file ends within a block: from tick {tick} on the record is lost");
    }
    match &found.divergence {
        None => out.push_str("  bit-equal\n"),
        Some(divergence) => {
            let _ = writeln!(out, "  first difference: {divergence}");
        }
    }
    out
}

/// Phase, cause and amplifiers in words.
fn name(supervisor: u32) -> String {
    let word = MachineWord::of(u64::from(supervisor));
    format!("{word}, amplifiers {}", if word.amplifier_on { "on" } else { "off" })
}

fn document(found: &Replay, period: f64) -> Value {
    let phases = found.phases.iter().map(|change| {
        let MachineWord { phase, cause, amplifier_on } = MachineWord::of(u64::from(change.supervisor));
        json!({ "tick": change.tick, "phase": phase, "cause": cause, "amplifiers_on": amplifier_on })
    });
    json!({
        "ticks": found.ticks,
        "seconds": found.ticks as f64 * period,
        "blocks": found.blocks,
        "digests": found.digests,
        "bit_equal": found.divergence.is_none() && found.ticks > 0,
        "first_difference": found.divergence.as_ref().map(|divergence| json!({
            "tick": divergence.tick,
            "signal": divergence.signal,
            "recorded": format!("{:016x}", divergence.recorded),
            "replayed": format!("{:016x}", divergence.replayed),
        })),
        "phases": phases.collect::<Vec<_>>(),
        "triggers": found.triggers,
        "gaps": found.gaps,
        "damaged": found.damaged,
        "lost_from": found.cut,
    })
}

/// What is wrong with a record that was read for its CSV alone.
#[derive(Default)]
struct Exported {
    damaged: Vec<(usize, String)>,
    cut: bool,
}

fn export(
    reader: &mut Reader<BufReader<File>>,
    mut csv: Option<&mut Csv>,
    refuse: &impl Fn(&dyn std::fmt::Display) -> Failure,
) -> Result<Exported, Failure> {
    let header = reader.header().clone();
    let mut found = Exported::default();
    while let Some(piece) = reader.next_piece().map_err(|error| refuse(&error))? {
        match piece {
            Piece::Block(block) => {
                if let Some(csv) = csv.as_deref_mut() {
                    csv.add(&header, &block)?;
                }
            }
            Piece::Damaged { block, reason } => found.damaged.push((block, reason)),
            Piece::Cut { .. } => found.cut = true,
        }
    }
    Ok(found)
}

/// A CSV file on its way.
struct Csv {
    file: BufWriter<PendingFile>,
    /// As its user named it.
    path: PathBuf,
    rows: u64,
}

impl Csv {
    fn new(path: &Path) -> Result<Self, Failure> {
        Ok(Self { file: BufWriter::new(PendingFile::create(path)?), path: path.to_owned(), rows: 0 })
    }

    fn add(&mut self, header: &Header, block: &Block) -> Result<(), Failure> {
        record::write_csv(&mut self.file, header, block, self.rows == 0)
            .map_err(|error| unwritten(&self.path, &error))?;
        self.rows += block.rows.len() as u64;
        Ok(())
    }

    fn finish(mut self) -> Result<u64, Failure> {
        self.file.flush().map_err(|error| unwritten(&self.path, &error))?;
        self.file.into_inner().map_err(|error| unwritten(&self.path, &error))?.keep()?;
        Ok(self.rows)
    }
}
