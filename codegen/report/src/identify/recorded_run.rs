//! Motion of the legs in a recorded run of a platform, for what is identified from it.

use std::path::Path;

use host_sim::controller::{MachineWord, Supervised};
use host_sim::record::{self, Block, Header};

use super::refused;
use crate::replay;
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_identify::declared::{self, SpecRecords};
use specgen_identify::marked_as_simulated;
use specgen_language::model::{Model, RateDependence};
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::output::write_folder;
use specgen_language::ui::Ui;
use specgen_numerics::displacements;
use specgen_studies::controllers;

/// Supervisor phases in which the legs move: running, holding, driving.
const MOVING: [u8; 3] = [2, 3, 6];

/// The records of a spec that a run can refit.
pub(super) fn records(
    model: &Model,
    spec: &Path,
    refuse: &dyn Fn(&dyn std::fmt::Display) -> Failure,
) -> Result<SpecRecords, Failure> {
    if model.task_space.is_none() {
        return Err(refuse(&"six legs with their own gauges have one record each: use `specgen identify linear`"));
    }
    if matches!(model.hysteresis.rate, RateDependence::DynamicPreisach(_)) {
        return Err(refuse(
            &"the second weight of (6) has a separate gain: identify each leg with `specgen identify rate`",
        ));
    }
    if !model.hysteresis.is_identified() {
        return Err(refuse(
            &"no leg of the spec is identified: run `specgen commission`, or name records in hysteresis.records",
        ));
    }
    declared::records(model, spec.parent().unwrap_or(Path::new(""))).map_err(refused)
}

/// Motion of the legs in a record that replays bit by bit.
pub(super) fn replayed(recording: &Path, spec: &Path, compiled: &Compilation, ui: &mut Ui) -> Result<Moves, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", recording.display()));
    let mut reader = replay::open(recording)?;
    replay::same_build(recording, spec, &reader.header().description, compiled)?;
    let mut machine = Supervised::new(controllers::at_run_time(compiled, ui)?);
    ui.progress("replaying the record");
    let mut moves = Moves::new(compiled, &machine.output_names())?;
    let found = record::replay(&mut reader, &mut machine, |header, block, rows| moves.add(header, block, rows));
    match replay::verdict(&found.map_err(|error| refuse(&error))?) {
        Some(message) => Err(refuse(&message)),
        None => Ok(moves),
    }
}

/// The name of `folder`, which is relative to the current folder, relative to that of the spec.
pub(super) fn within(spec: &Path, folder: &Path) -> Result<String, Failure> {
    let dir = spec.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let whole = std::path::absolute(folder).unwrap_or_default();
    // The folder itself may be new.
    let parent = whole.parent().and_then(|parent| parent.canonicalize().ok());
    let whole = parent.zip(whole.file_name()).map_or(whole.clone(), |(parent, name)| parent.join(name));
    let dir = dir.canonicalize().unwrap_or_default();
    let relative = whole.strip_prefix(dir).ok();
    let plain = |path: &Path| path.components().all(|part| matches!(part, std::path::Component::Normal(_)));
    let text = relative.filter(|path| plain(path)).and_then(Path::to_str);
    let text = text.filter(|text| !text.is_empty() && !text.contains('\\'));
    text.map(|text| text.trim_end_matches('/').to_owned()).ok_or_else(|| {
        let expected = "expected a folder within that of the spec, such as `gains`, with forward slashes";
        Failure::Usage(format!("-o `{}`: {expected}", folder.display()))
    })
}

/// The spec line with the tables of a folder.
pub(super) fn records_line(folder: &str) -> String {
    format!("records = [{}]", [0, 1, 2, 3, 4, 5].map(|leg| format!("\"{folder}/leg{leg}.csv\"")).join(", "))
}

/// Writes one table for each leg, in leg order; returns a line about them. `simulated`: their shape comes from a simulated record
/// of the spec.
pub(super) fn write_tables(folder: &Path, tables: Vec<String>, simulated: bool) -> Result<String, Failure> {
    let file = |(leg, text): (usize, String)| {
        let text = if simulated { marked_as_simulated(&text) } else { text };
        (format!("leg{leg}.csv"), text.into_bytes())
    };
    write_folder(folder, &tables.into_iter().enumerate().map(file).collect::<Vec<_>>())?;
    Ok(format!("wrote 6 tables to {}\n", folder.display()))
}

/// Motion of the legs while the law moved them.
pub(super) struct Moves {
    platform: specgen_runtime::Platform<f64>,
    voltage: usize,
    pose: usize,
    /// s.
    pub(super) times: Vec<f64>,
    /// V.
    pub(super) voltages: [Vec<f64>; 6],
    /// m.
    pub(super) displacements: [Vec<f64>; 6],
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

    /// Duration, s.
    pub(super) fn seconds(&self) -> f64 {
        self.times.first().zip(self.times.last()).map_or(0.0, |(first, last)| last - first)
    }
}
