//! Replays a recording on the host, tick by tick, and compares the bits; exports it for other programs.

mod export;
mod mcap;
mod messages;
mod signals;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use host_sim::controller::{MachineWord, Supervised};
use host_sim::description::Description;
use host_sim::record::{self, Block, FileItem, Header, PhaseChange, Reader, Replay, ReplayedRows};
use serde::Serialize;

use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;
use specgen_language::files;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::unread_file;
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_studies::controllers;

use crate::chart::{Axis, Chart, DASHED, LINE};
use crate::drawing::Plot;
use export::Exports;
use signals::{Numbers, Signals};

/// Number of phase changes shown.
const SHOWN: usize = 20;

/// Replays a record with a spec, optionally with the emitted controller, or only exports it, and shows the result.
///
/// # Errors
/// The record cannot be read or differs, the spec does not match, or a file cannot be written.
pub fn run(
    recording: &Path,
    spec: Option<(&Path, bool)>,
    csv: Option<&Path>,
    mcap: Option<&Path>,
    plot: &Plot,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let mut reader = open(recording)?;
    let mut exports = Exports::new(csv, mcap)?;
    if plot.wanted()? && spec.is_none() {
        return Err(Failure::Usage("--plot needs a replay: give the --spec of the recording".to_owned()));
    }
    match spec {
        Some(spec) => run_again(recording, spec, (reader, exports), plot, ui),
        None => {
            let shown = recording.display().to_string();
            let found = export(&mut reader, &mut exports, &shown)?;
            let rows = exports.finish()?;
            let failed = found.damaged.first().map(|(block, reason)| {
                format!("{shown}: block {block} is damaged: {reason}; its rows are missing. Fetch or copy it again")
            });
            ui.judged(&ExportReport { file: shown, rows, ..found }, failed)
        }
    }
}

fn run_again(
    recording: &Path,
    (spec, emitted): (&Path, bool),
    (mut reader, mut exports): (Reader<BufReader<File>>, Exports),
    plot: &Plot,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let shown = recording.display();
    let drawn = plot.wanted()?;
    let compiled = spec_file::looked_up(spec, ui)?;
    // Before building a library, so that a wrong spec is refused immediately.
    same_build(recording, spec, &reader.header().description, &compiled)?;
    let controller = controllers::chosen(&compiled, emitted, ui)?;
    let mut machine = Supervised::new(controller);
    ui.progress("replaying the record");
    let names = machine.output_names();
    let mut errors = Errors::default();
    let mut trouble = None;
    let found = record::replay(&mut reader, &mut machine, |header, block, rows| {
        let again = ReplayedRows { names: &names, rows };
        if drawn {
            errors.add(header, block, again);
        }
        if trouble.is_none() {
            trouble = exports.add(header, block, Some(again)).err();
        }
    });
    let found = found.map_err(|error| Failure::Gate(format!("{shown}: {error}")))?;
    if let Some(failure) = trouble {
        return Err(failure);
    }
    exports.finish()?;
    plot.show(&compiled.ir.name, &shown.to_string(), &[errors.chart()], ui)?;
    let failed = verdict(&found).map(|message| format!("{shown}: {message}"));
    ui.judged(&Report::of(format!("{shown}: {}", compiled.ir.name), found, reader.header().period), failed)
}

/// Refuses a record of another spec or another version of specgen.
///
/// # Errors
/// The record does not match.
pub fn same_build(
    recording: &Path,
    spec: &Path,
    recorded: &Description,
    compiled: &Compilation,
) -> Result<(), Failure> {
    let version = env!("CARGO_PKG_VERSION");
    if recorded.digest == compiled.ir.digest && recorded.version == version {
        return Ok(());
    }
    let (recording, digest, built_by) = (recording.display(), &recorded.digest, &recorded.version);
    let (spec, own_digest) = (spec.display(), &compiled.ir.digest);
    Err(Failure::Gate(format!(
        "{recording} was recorded with spec digest {digest}, specgen {built_by}, but {spec} has {own_digest}, specgen {version}: give the spec that the target was built from, and \
         use the specgen that built it"
    )))
}

/// Opens a record.
///
/// # Errors
/// The file cannot be read, or is not a record.
pub fn open(path: &Path) -> Result<Reader<BufReader<File>>, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", path.display()));
    let file = files::open(path).map_err(|unread| unread_file(path, &unread))?;
    Reader::new(BufReader::with_capacity(1 << 20, file)).map_err(|error| refuse(&error))
}

/// Why the record fails, if it does. A truncated file is valid as far as it goes.
pub fn verdict(found: &Replay) -> Option<String> {
    if let Some(divergence) = &found.divergence {
        return Some(format!("first difference at {divergence}"));
    }
    if let Some((block, reason)) = found.damaged.first() {
        return Some(format!(
            "block {block} is damaged: {reason}; the ticks around it are bit-equal. Fetch or copy it again"
        ));
    }
    if found.ticks == 0 {
        return Some("it contains no ticks; record again".to_owned());
    }
    None
}

/// Report of a replay.
#[derive(Serialize)]
struct Report {
    #[serde(skip)]
    title: String,
    /// s.
    #[serde(skip)]
    period: f64,
    ticks: u64,
    seconds: f64,
    blocks: u64,
    digests: u64,
    bit_equal: bool,
    first_difference: Option<Difference>,
    phases: Vec<PhaseAt>,
    triggers: Vec<u64>,
    /// Missing ticks: the first, and the one after the last.
    gaps: Vec<(u64, u64)>,
    /// Damaged blocks, with reasons.
    damaged: Vec<(usize, String)>,
    /// First lost tick of a truncated file.
    lost_from: Option<u64>,
}

/// Words as sixteen hex digits.
#[derive(Serialize)]
struct Difference {
    tick: u64,
    signal: String,
    recorded: String,
    replayed: String,
    #[serde(skip)]
    text: String,
}

#[derive(Serialize)]
struct PhaseAt {
    tick: u64,
    phase: u8,
    cause: u8,
    amplifiers_on: bool,
    /// As text.
    state: String,
}

impl Report {
    fn of(title: String, found: Replay, period: f64) -> Self {
        let phase = |change: &PhaseChange| {
            let word = MachineWord::of(u64::from(change.supervisor));
            let MachineWord { phase, cause, amplifier_on, .. } = word;
            PhaseAt { tick: change.tick, phase, cause, amplifiers_on: amplifier_on, state: word.to_string() }
        };
        Self {
            title,
            period,
            ticks: found.ticks,
            seconds: found.ticks as f64 * period,
            blocks: found.blocks,
            digests: found.digests,
            bit_equal: found.divergence.is_none() && found.ticks > 0,
            first_difference: found.divergence.map(|divergence| Difference {
                text: divergence.to_string(),
                tick: divergence.tick,
                recorded: format!("{:016x}", divergence.recorded),
                replayed: format!("{:016x}", divergence.replayed),
                signal: divergence.signal,
            }),
            phases: found.phases.iter().map(phase).collect(),
            triggers: found.triggers,
            gaps: found.gaps,
            damaged: found.damaged,
            lost_from: found.cut,
        }
    }
}

impl Outcome for Report {
    fn text(&self) -> String {
        let mut out = format!(
            "{}\n  {} ticks, {:.4} s, in {} blocks; codes, status, supervisor and {} digests of the state compared\n",
            self.title, self.ticks, self.seconds, self.blocks, self.digests
        );
        let columns = [right(9).behind("  tick "), right(10).behind(" "), left(0).behind(" s  ")];
        let event = |out: &mut String, tick: u64, what: &str| {
            row(out, &columns, &[&tick, &format_args!("{:.4}", tick as f64 * self.period), &what]);
        };
        for PhaseAt { tick, amplifiers_on, state: phase, .. } in self.phases.iter().take(SHOWN) {
            let on = if *amplifiers_on { "on" } else { "off" };
            event(&mut out, *tick, &format!("{phase}, amplifiers {on}"));
        }
        let more = self.phases.len().saturating_sub(SHOWN);
        if more > 0 {
            out += &format!("  … {more} more phase changes\n");
        }
        for tick in &self.triggers {
            event(&mut out, *tick, "trigger");
        }
        for (from, to) in &self.gaps {
            let last = to.saturating_sub(1);
            out += &format!("  ticks {from} to {last} are missing; the record continues after them\n");
        }
        out.extend(self.damaged.iter().map(|(block, reason)| format!("  block {block} is damaged: {reason}\n")));
        if let Some(tick) = self.lost_from {
            out += &format!("  the file ends within a block: ticks from {tick} on are lost\n");
        }
        match &self.first_difference {
            None => out.push_str("  bit-equal\n"),
            Some(difference) => {
                out += &format!("  first difference: {}\n", difference.text);
            }
        }
        out
    }
}

/// Report of an export without replay, with problems found.
#[derive(Default, Serialize)]
struct ExportReport {
    #[serde(skip)]
    file: String,
    rows: u64,
    damaged: Vec<(usize, String)>,
    cut: bool,
}

impl Outcome for ExportReport {
    fn text(&self) -> String {
        let cut = if self.cut { "; the file ends within a block" } else { "" };
        format!("{}: {} rows exported{cut}\n", self.file, self.rows)
    }
}

fn export(reader: &mut Reader<BufReader<File>>, exports: &mut Exports, shown: &str) -> Result<ExportReport, Failure> {
    let header = reader.header().clone();
    let mut found = ExportReport::default();
    while let Some(piece) = reader.next_piece().map_err(|error| Failure::Gate(format!("{shown}: {error}")))? {
        match piece {
            FileItem::Block(block) => exports.add(&header, &block, None)?,
            FileItem::Damaged { block, reason } => found.damaged.push((block, reason)),
            FileItem::Cut { .. } => found.cut = true,
        }
    }
    Ok(found)
}

/// Errors of the first three coordinates of a platform, or of the legs, over time.
#[derive(Default)]
struct Errors {
    /// s, nm.
    points: [Vec<[f64; 2]>; 6],
    platform: bool,
}

impl Errors {
    fn add(&mut self, header: &Header, block: &Block, again: ReplayedRows) {
        let Signals(all, platform) = Signals::new(header, Some(again));
        let Some((_, of)) = all.iter().find(|(name, _)| *name == "error") else { return };
        self.platform = platform;
        let count = if platform { 3 } else { 6 };
        for (row, given) in block.rows.iter().zip(again.rows) {
            let Some(Numbers::Values(errors)) = of.numbers(header.description.scalar, row, Some(given)) else {
                continue;
            };
            let time = row.tick as f64 * header.period;
            self.points.iter_mut().zip(errors).take(count).for_each(|(points, error)| points.push([time, 1e9 * error]));
        }
    }

    fn chart(self) -> Chart {
        let title = if self.platform { "target minus measured pose" } else { "demand minus gauge" };
        let chart = Chart::new("", title, Axis::linear("time", "s"), Axis::linear("error", "nm"));
        let name = |k: usize| if self.platform { ["x", "y", "z"][k].to_owned() } else { format!("leg {k}") };
        let lines = self.points.iter().enumerate().filter(|(_, points)| !points.is_empty());
        lines.fold(chart, |chart, (k, points)| chart.with(&name(k), if k < 4 { LINE } else { DASHED }, points.clone()))
    }
}
