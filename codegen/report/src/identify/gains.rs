//! `specgen identify gains`: a recorded run of a platform in; the gain of each leg relative to its table, and six separate tables out.

use std::path::{Path, PathBuf};

use host_sim::controller::{MachineWord, Supervised};
use host_sim::record::{self, Block, Header};
use serde::Serialize;

use super::{MeasuredKeys, refused};
use crate::replay;
use specgen_compiler::compile::Compilation;
use specgen_compiler::{lower, spec_file};
use specgen_identify::gains::{self, LegGain};
use specgen_identify::{declared, marked_as_simulated, write_table_csv};
use specgen_language::model::RateDependence;
use specgen_language::outcome::{Failure, Outcome, Refusal};
use specgen_language::output::write_folder;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;
use specgen_numerics::displacements;
use specgen_studies::controllers;

/// Supervisor phases in which the law moves the legs: running, holding.
const MOVING: [u8; 2] = [2, 3];
/// Largest acceptable standard error of λ.
const LARGEST_ERROR: f64 = 0.02;
/// Plausible λ; outside, the spec is wrong or a leg does not follow.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Reads the recording, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(recording: &Path, spec: &Path, output: Option<&str>, ui: &mut Ui) -> Result<(), Failure> {
    let shown = recording.display().to_string();
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{shown}: {error}"));
    let folder = output.map(|name| folder(spec, name)).transpose()?;
    let mut reader = replay::open(recording)?;
    let compiled = spec_file::looked_up(spec, ui)?;
    let model = &compiled.model;
    if model.task_space.is_none() {
        return Err(refuse(&"six legs with their own gauges have one record each: use `specgen identify linear`"));
    }
    if matches!(model.hysteresis.rate, RateDependence::DynamicPreisach(_)) {
        return Err(refuse(
            &"the second weight of (6) has a separate gain: identify each leg with `specgen identify rate`",
        ));
    }
    replay::same_build(recording, spec, &reader.header().description, &compiled)?;
    let simulated = !compiled.assumptions.simulated.is_empty();
    let dir = spec.parent().unwrap_or(Path::new(""));
    let tables = declared::records(model, dir).map_err(refused)?;
    tables.tables_only().map_err(|why| refuse(&why))?;

    let mut machine = Supervised::new(controllers::at_run_time(&compiled, ui)?);
    ui.progress("replaying the record");
    let names = machine.output_names();
    let mut moves = Moves::new(&compiled, &names)?;
    let found = record::replay(&mut reader, &mut machine, |header, block, rows| moves.add(header, block, rows));
    let found = found.map_err(|error| refuse(&error))?;
    if let Some(message) = replay::verdict(&found) {
        return Err(refuse(&message));
    }

    let mut legs = Vec::new();
    for (leg, (voltage, displacement)) in moves.voltages.iter().zip(&moves.displacements).enumerate() {
        let Some(mut own) = tables.leg(model, leg) else { continue };
        own.inertia = None;
        own.dead_time = model.amplifier.lag;
        let name = format!("{shown}, leg {}", leg + 1);
        let gain = gains::of(&own, &moves.times, voltage, displacement, &name).map_err(refused)?;
        let gain = gain.filter(|found| found.error <= LARGEST_ERROR && PLAUSIBLE.contains(&found.gain));
        legs.push((own.still, gain.ok_or_else(|| refuse(&poor(leg, gain)))?));
    }
    let mut files = String::new();
    if let Some(folder) = &folder {
        let tables = legs.iter().enumerate().map(|(leg, (table, found))| {
            let text = write_table_csv(&gains::scaled(table, found.gain));
            // The shape comes from the spec's record, which may be simulated.
            let text = if simulated { marked_as_simulated(&text) } else { text };
            (format!("leg{}.csv", leg + 1), text.into_bytes())
        });
        write_folder(folder, &tables.collect::<Vec<_>>())?;
        files = format!("wrote 6 tables to {}\n", folder.display());
    }
    let legs = legs.into_iter().map(|(_, found)| found).collect();
    let records = output.map(line).unwrap_or_default();
    let measured = MeasuredKeys::of(&["hysteresis.records"], simulated);
    ui.result(&Gains { recording: shown, seconds: moves.seconds(), legs, measured, records, files });
    Ok(())
}

/// Why a run is unsuitable, and how to record a better one.
fn poor(leg: usize, found: Option<LegGain>) -> String {
    let what = found.map_or_else(
        || "does not move enough to determine a gain".to_owned(),
        |found| format!("has the gain {:.3} ± {:.3}", found.gain, found.error),
    );
    format!(
        "leg {} of 1 to 6 {what}: record at least a second of a slow wave on all axes, as large as the workspace permits, in closed loop \
         and without contact",
        leg + 1
    )
}

/// The folder `name` beside `spec`.
fn folder(spec: &Path, name: &str) -> Result<PathBuf, Failure> {
    let within = Path::new(name).components().all(|part| matches!(part, std::path::Component::Normal(_)));
    if name.is_empty() || !within || name.contains('\\') {
        let message =
            format!("-o `{name}`: expected a folder relative to the spec's, such as `gains`, with forward slashes");
        return Err(Failure::Usage(message));
    }
    Ok(spec.parent().unwrap_or(Path::new("")).join(name))
}

/// The spec line with the tables.
fn line(folder: &str) -> String {
    let names: Vec<String> = (1..=6).map(|leg| format!("\"{}/leg{leg}.csv\"", folder.trim_end_matches('/'))).collect();
    format!("records = [{}]", names.join(", "))
}

/// Motion of the legs while the law moved them.
struct Moves {
    platform: specgen_runtime::Platform<f64>,
    voltage: usize,
    pose: usize,
    times: Vec<f64>,
    voltages: [Vec<f64>; 6],
    displacements: [Vec<f64>; 6],
}

impl Moves {
    fn new(compiled: &Compilation, names: &[String]) -> Result<Self, Failure> {
        let platform = lower::platform(&compiled.model)
            .map_err(|findings| Refusal { source: Some(compiled.source.clone()), findings })?;
        let place = |name: &str| {
            let found = names.iter().position(|other| other == name);
            found.ok_or_else(|| Failure::Environment(format!("the controller has no output {name}")))
        };
        let (voltage, pose) = (place("voltage[0]")?, place("pose[0]")?);
        Ok(Self {
            platform,
            voltage,
            pose,
            times: Vec::new(),
            voltages: Default::default(),
            displacements: Default::default(),
        })
    }

    /// Adds the rows of a block in which the law moves the legs. A row after a gap starts over, because the memory of the legs
    /// is unknown there.
    fn add(&mut self, header: &Header, block: &Block, rows: &[Vec<u64>]) {
        let scalar = header.description.scalar;
        for (row, given) in block.rows.iter().zip(rows) {
            let machine = MachineWord::of(u64::from(row.supervisor));
            if !machine.amplifier_on || !MOVING.contains(&machine.phase) {
                continue;
            }
            let time = row.tick as f64 * header.period;
            if self.times.last().is_some_and(|last| time > last + 1.5 * header.period) {
                self.times.clear();
                self.voltages.iter_mut().chain(&mut self.displacements).for_each(Vec::clear);
            }
            self.times.push(time);
            let six = |first: usize| core::array::from_fn(|k| scalar.decode(given[first + k]));
            let pose: [f64; 6] = six(self.pose);
            let voltages: [f64; 6] = six(self.voltage);
            self.voltages.iter_mut().zip(voltages).for_each(|(all, v)| all.push(v));
            let moved = displacements(&self.platform, &pose);
            self.displacements.iter_mut().zip(moved).for_each(|(all, d)| all.push(d));
        }
    }

    fn seconds(&self) -> f64 {
        self.times.first().zip(self.times.last()).map_or(0.0, |(first, last)| last - first)
    }
}

/// Identified gains.
#[derive(Serialize)]
struct Gains {
    #[serde(skip)]
    recording: String,
    /// Duration in which the law moved the legs, s.
    seconds: f64,
    /// In leg order.
    legs: Vec<LegGain>,
    measured: MeasuredKeys,
    #[serde(skip)]
    records: String,
    #[serde(skip)]
    files: String,
}

impl Outcome for Gains {
    fn text(&self) -> String {
        let mut text =
            format!("{}: gains of legs 1 to 6 relative to their tables, from {:.3} s\n", self.recording, self.seconds);
        let columns = [5, 9, 11, 11, 13, 15].map(|width| right(width).behind(" "));
        row(&mut text, &columns, &[&"leg", &"lambda", &"± std err", &"travel µm", &"error nm rms", &"with λ = 1"]);
        for (leg, found) in self.legs.iter().enumerate() {
            row(
                &mut text,
                &columns,
                &[
                    &(leg + 1),
                    &format_args!("{:.4}", found.gain),
                    &format_args!("{:.4}", found.error),
                    &format_args!("{:.3}", found.travel * 1e6),
                    &format_args!("{:.1}", found.residual_rms * 1e9),
                    &format_args!("{:.1}", found.residual_before * 1e9),
                ],
            );
        }
        if !self.records.is_empty() {
            text += &format!("lines for the spec:\n[hysteresis]\n{}\n{}", self.records, self.measured.text());
        }
        text + &self.files
    }
}
