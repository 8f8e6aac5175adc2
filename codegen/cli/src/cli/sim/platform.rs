//! `specgen sim` of a spec with `[control]`: the paper's Tables 5 to 9 on the machine that the spec describes, or one of
//! the spec's own trajectories played on board.
//!
//! The machine's legs are out of tolerance, each in its own way; the controller has the records that the spec names. With
//! one nominal record for six legs the inverse model is then off by as much as the legs, and adaptation takes it up.

use std::fmt::Write as _;

use host_sim::closed_loop::RunError;
use host_sim::controller::Controller;
use host_sim::platform::rig::{Noise, PlatformRun, Record};
use host_sim::platform::scenario::{FREE_MODES, PLATFORM_MODES, select};
use host_sim::platform::table::{AXES, MachiningRow, MachiningTable, PoseRow, PoseTable};
use host_sim::platform::{PlatformScenario, WorkPart};
use host_sim::trajectory::{PaperPath, PaperPose, Reading};
use serde::Serialize;
use serde_json::json;

use super::{Arguments, environment};
use crate::cli::file::write_folder;
use crate::cli::ui::{Failure, Outcome, Ui};
use specgen_compiler::compile::Compiled;
use specgen_language::model::TaskSpace;
use specgen_runtime::setpoint::{REFUSED, STALE};
use specgen_studies::machine;

/// Operating frequencies, Hz, unless asked otherwise.
const FREQUENCIES: [f64; 2] = [1.0, 10.0];
/// The paper's free motions.
const CASES: [(&str, PaperPath); 2] = [("case-1", PaperPath::Case1), ("case-2", PaperPath::Case2)];
/// P, F and P/F of Table 9.
const MACHINING: [(&str, u32); 3] = [PLATFORM_MODES[0], PLATFORM_MODES[3], PLATFORM_MODES[6]];
/// Frequency of the machining path, Hz.
const MACHINING_FREQUENCY: f64 = 1.0;
/// A trajectory on board that does not end is followed for this long, s.
pub(in crate::cli) const PLAYED: f64 = 60.0;

/// Refuses arguments that are for legs alone, and a trajectory that the spec does not have.
pub(super) fn check(arguments: &Arguments, task: &TaskSpace) -> Result<(), Failure> {
    if arguments.samples.is_some() {
        return Err(Failure::Usage(
            "--samples is for legs with their own gauges; a spec with [control] runs at its timing.period".to_owned(),
        ));
    }
    let Some(name) = &arguments.trajectory else { return Ok(()) };
    if arguments.frequency.is_some() {
        return Err(Failure::Usage(
            "--frequency is for the paper's cases; the spec gives the frequency of its own trajectories".to_owned(),
        ));
    }
    selector(task, name).map(|_| ())
}

/// Number of a trajectory of the spec.
pub(in crate::cli) fn selector(task: &TaskSpace, name: &str) -> Result<u32, Failure> {
    let names: Vec<&str> = task.trajectories.iter().map(|trajectory| trajectory.name.as_str()).collect();
    let place = names.iter().position(|known| *known == name);
    place.and_then(|place| u32::try_from(place).ok()).ok_or_else(|| {
        let known = if names.is_empty() { "no trajectory".to_owned() } else { names.join(", ") };
        Failure::Usage(format!("the spec has {known}, but not `{name}`; name one of its [[trajectory]] tables"))
    })
}

pub(super) fn run(
    arguments: &Arguments,
    compiled: &Compiled,
    task: &TaskSpace,
    controller: &mut Controller,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let seed = arguments.plant.seed;
    let specimen = machine::specimen(&compiled.model, task, &arguments.plant.leg()?, Some(seed));
    let noise = if arguments.plant.no_noise { Noise::NONE } else { Noise::of(&specimen) };
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    let mut scenario = machine::scenario(&compiled.model, task, &specimen, &noise, seed);
    scenario.options.latency = arguments.latency as usize;
    if arguments.output.is_some() {
        scenario.options.record = Record::Samples;
    }
    let mut experiment = Experiment { scenario, controller, ui, files: Vec::new(), refused: Vec::new() };
    let found = match &arguments.trajectory {
        Some(name) => experiment.own(name, selector(task, name)?)?,
        None => experiment.tables(arguments.frequency.as_deref().unwrap_or(&FREQUENCIES))?,
    };
    let Experiment { mut files, refused, .. } = experiment;
    let report = Report {
        name: &compiled.ir.name,
        digest: &compiled.ir.digest,
        seed,
        noise: !arguments.plant.no_noise,
        latency_ticks: arguments.latency,
        records: compiled.model.hysteresis.records.len(),
        axial_stiffness: specimen.stiffness,
        leg_gain: specimen.legs.each_ref().map(|leg| leg.gain_um_per_v),
        refused,
        found,
    };
    if let Some(output) = &arguments.output {
        files.push(("tables.json".to_owned(), format!("{:#}\n", json!(report)).into_bytes()));
        write_folder(output, &files)?;
        ui.progress(&format!("wrote {} files to {}", files.len(), output.display()));
    }
    ui.result(&report);
    Ok(())
}

/// The machine, and what was found on it.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(skip)]
    name: &'a str,
    digest: &'a str,
    seed: u64,
    noise: bool,
    latency_ticks: u32,
    /// Records of reversal curves that the controller has.
    records: usize,
    #[serde(rename = "axial_stiffness_N_per_m")]
    axial_stiffness: [f64; 6],
    #[serde(rename = "leg_gain_um_per_V")]
    leg_gain: [f64; 6],
    /// Runs whose set-points the controller refused, in words.
    refused: Vec<String>,
    #[serde(flatten)]
    found: Found,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Found {
    Tables {
        free_motion: Vec<PoseRow>,
        machining: Vec<MachiningRow>,
        #[serde(skip)]
        text: String,
    },
    /// The true pose against the controller's target, axis by axis.
    Trajectory { trajectory: String, seconds: f64, rms_nano: [f64; 6], peak_nano: [f64; 6] },
    /// The only run was refused.
    Nothing {},
}

impl Outcome for Report<'_> {
    fn text(&self) -> String {
        let records = match self.records {
            1 => "one hysteresis record for all legs".to_owned(),
            many => format!("{many} hysteresis records"),
        };
        let mut out = format!(
            "{}: a machine with legs within ±10 %, stiffness within ±5 % (seed {}); {records} of the controller\n",
            self.name, self.seed
        );
        match &self.found {
            Found::Tables { text, .. } => out += text,
            Found::Trajectory { trajectory, seconds, rms_nano, peak_nano } => {
                out += &format!("{trajectory}, on board, {seconds:.3} s: true pose against the controller's target\n");
                for (axis, name) in AXES.iter().enumerate() {
                    let unit = if axis < 3 { "nm" } else { "nrad" };
                    // Writing to a String cannot fail, here and below.
                    let _ = writeln!(
                        out,
                        "  {name:<3}{:>10.2} {unit} rms{:>10.2} {unit} peak",
                        rms_nano[axis], peak_nano[axis]
                    );
                }
            }
            Found::Nothing {} => {}
        }
        for line in &self.refused {
            let _ = writeln!(out, "{line}");
        }
        out
    }
}

struct Experiment<'a> {
    scenario: PlatformScenario,
    controller: &'a mut Controller,
    ui: &'a Ui,
    files: Vec<(String, Vec<u8>)>,
    refused: Vec<String>,
}

impl Experiment<'_> {
    /// Tables 5 to 9.
    fn tables(&mut self, frequencies: &[f64]) -> Result<Found, Failure> {
        let mut free = PoseTable::default();
        for (name, path) in CASES {
            for &frequency in frequencies {
                self.ui.progress(&format!("Tables 5 to 8: {name} at {frequency} Hz"));
                let trajectory = PaperPose { path, reading: Reading::Corrected, frequency };
                for (mode, word) in FREE_MODES {
                    select(self.controller, word).map_err(environment)?;
                    let run = self.scenario.run(self.controller, &trajectory);
                    let row = |run: &PlatformRun| PoseRow::of(name, mode, frequency, &run.errors);
                    free.rows.extend(self.keep(&format!("{name}-{frequency}hz-{mode}"), run)?.as_ref().map(row));
                }
            }
        }
        let mut machining = MachiningTable::default();
        let trajectory =
            PaperPose { path: PaperPath::Machining, reading: Reading::Corrected, frequency: MACHINING_FREQUENCY };
        for (part, work) in [("glass", WorkPart::glass()), ("aluminium", WorkPart::aluminium())] {
            self.ui.progress(&format!("Table 9: machining {part}"));
            for (mode, word) in MACHINING {
                select(self.controller, word).map_err(environment)?;
                let run = self.scenario.against(self.controller, &trajectory, work);
                if let Some(run) = self.keep(&format!("machining-{part}-{mode}"), run)? {
                    machining.push(part, mode, &run.errors);
                }
            }
        }
        self.files.push(("free-motion.csv".to_owned(), free.to_csv().into_bytes()));
        self.files.push(("machining.csv".to_owned(), machining.to_csv().into_bytes()));
        let text = format!(
            "Tables 5 to 8, beside the paper's (its angles read as µrad)\n{}Table 9, machining at {MACHINING_FREQUENCY} Hz\n{}",
            free.to_text(),
            machining.to_text()
        );
        Ok(Found::Tables { free_motion: free.rows, machining: machining.rows, text })
    }

    /// A trajectory of the spec, in the mode of the spec.
    fn own(&mut self, name: &str, selector: u32) -> Result<Found, Failure> {
        self.ui.progress(&format!("playing {name} on board"));
        let run = self.scenario.play(self.controller, selector, PLAYED);
        let Some(run) = self.keep(&format!("trajectory-{name}"), run)? else { return Ok(Found::Nothing {}) };
        Ok(Found::Trajectory {
            trajectory: name.to_owned(),
            seconds: run.errors.count() as f64 * self.scenario.options.interval,
            rms_nano: run.errors.rms_nano(),
            peak_nano: run.errors.peak_nano(),
        })
    }

    /// Samples of a run for its file; none, and a line about it, if the controller held instead of following.
    fn keep(&mut self, name: &str, run: Result<PlatformRun, RunError>) -> Result<Option<PlatformRun>, Failure> {
        let run = run.map_err(environment)?;
        if !run.samples.is_empty() {
            self.files.push((format!("{name}.csv"), run.to_csv().into_bytes()));
        }
        if run.status & (REFUSED | STALE) == 0 {
            return Ok(Some(run));
        }
        let line = format!(
            "{name}: not scored, the controller refused set-points (status {:#x}); the path leaves the workspace, or moves faster than control.setpoint.stream_speed",
            run.status
        );
        self.refused.push(line);
        Ok(None)
    }
}
