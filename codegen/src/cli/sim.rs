//! `specgen sim`: the paper's leg experiment with the emitted controller; `specgen forc`: the experiment that records
//! reversal curves. Both on simulated legs that are not of the controller's model class.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::controller::Controller;
use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};
use host_sim::scenario::{LINEARITY_FREQUENCIES, LegScenario, MODES, TRACKING_FREQUENCIES, select};
use host_sim::table::{LinearityTable, TrackingTable};
use serde_json::json;

use super::file::write_file;
use super::ui::{Failure, Ui};
use crate::compile;
use crate::model::Adaptation;
use crate::target;
use crate::workspace;

/// The paper's Table 2, nm, by mode and frequency (0.1, 1, 10 Hz).
const PAPER_TABLE_2: [(&str, [f64; 3]); 3] =
    [("invhys", [127.039, 232.143, 504.539]), ("ewma", [103.086, 117.305, 191.409]), ("pcc", [80.5, 81.783, 156.25])];
/// The paper's Table 1: slope at each frequency as a ratio to that at 0.1 Hz.
const PAPER_TABLE_1: [f64; 6] = [1.0, 0.9844, 0.9797, 0.9774, 0.9735, 0.9704];

/// Arguments of `sim`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The spec file.
    spec: PathBuf,
    /// Write traces and tables here; only print without it.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    plant: PlantArguments,
    /// Control ticks per period of the trajectory.
    #[arg(long, default_value_t = 500, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: u32,
}

/// Which leg is simulated.
#[derive(Args, Debug)]
pub struct PlantArguments {
    /// Leg parameters (JSON); the reference leg if not given.
    #[arg(long, value_name = "FILE")]
    plant: Option<PathBuf>,
    /// Without noise and quantisation of gauge and amplifier.
    #[arg(long)]
    no_noise: bool,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
}

impl PlantArguments {
    fn read(&self) -> Result<(LegParameters, NoiseParameters), Failure> {
        let parameters = match &self.plant {
            Some(path) => LegParameters::load(path).map_err(|error| Failure::Gate(error.to_string()))?,
            None => LegParameters::reference(),
        };
        let noise = if self.no_noise { NoiseParameters::NONE } else { parameters.noise };
        Ok((parameters, noise))
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let environment = |error: &dyn std::fmt::Display| Failure::Environment(error.to_string());
    let (parameters, noise) = arguments.plant.read()?;
    let compiled = compile::compile(&arguments.spec)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    // The controller that runs is the emitted one, built from the same files that the main job writes.
    let scratch = tempfile::tempdir().map_err(|error| environment(&error))?;
    let workspace = scratch.path().join("controller");
    workspace::write(&workspace, &compiled.files)?;
    ui.progress("building the emitted controller for this host");
    let library = target::host::build_library(&workspace, &scratch.path().join("target"))?;
    let mut controller = Controller::load(&library).map_err(|error| environment(&error))?;

    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs = std::array::from_fn(|_| parameters.clone());
    let scenario = LegScenario::new(&legs, &noise, arguments.plant.seed, arguments.samples);
    let modes = modes(&compiled.model.adaptation);
    ui.progress("Table 2: every law that the spec gives weights for, at three frequencies");
    let tracking =
        scenario.tracking(&mut controller, &modes, &TRACKING_FREQUENCIES).map_err(|error| environment(&error))?;
    ui.progress("Table 1: inverse model alone at six frequencies");
    let linearity = scenario.linearity(&mut controller, &LINEARITY_FREQUENCIES).map_err(|error| environment(&error))?;

    if let Some(output) = &arguments.output {
        let mut files = vec![
            ("tracking.csv".to_owned(), tracking.to_csv().into_bytes()),
            ("linearity.csv".to_owned(), linearity.to_csv().into_bytes()),
            (
                "tables.json".to_owned(),
                format!("{:#}\n", json!({ "tracking": tracking, "linearity": linearity })).into_bytes(),
            ),
        ];
        for &(mode, word) in &modes {
            select(&mut controller, word).map_err(|error| environment(&error))?;
            for frequency in TRACKING_FREQUENCIES {
                let run = scenario.run(&mut controller, frequency).map_err(|error| environment(&error))?;
                let stem = format!("trace-{mode}-{frequency}hz");
                files.push((format!("{stem}.csv"), run.trace.to_csv().into_bytes()));
                files.push((format!("{stem}.trace"), run.trace.to_bytes()));
            }
        }
        write_folder(output, &files)?;
        ui.progress(&format!("wrote {} files to {}", files.len(), output.display()));
    }
    let text = text(&compiled.ir.name, &tracking, &linearity);
    ui.result(&text, json!({ "digest": compiled.ir.digest, "tracking": tracking, "linearity": linearity }));
    Ok(())
}

/// The laws that the spec gives weights for: with a weight of zero a law adapts nothing, and its row would say nothing.
fn modes(adaptation: &Adaptation) -> Vec<(&'static str, u32)> {
    let given = |mode: &str| match mode {
        "ewma" => adaptation.level_weight > 0.0,
        "pcc" => adaptation.level_weight > 0.0 && adaptation.drift_weight > 0.0,
        _ => true,
    };
    MODES.into_iter().filter(|(mode, _)| given(mode)).collect()
}

fn text(name: &str, tracking: &TrackingTable, linearity: &LinearityTable) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{name}: tracking error of the leg trajectory, nm rms of T − Y (paper's Table 2)");
    let _ = writeln!(out, "  {:<8}{:>22}{:>22}{:>22}", "", "0.1 Hz", "1 Hz", "10 Hz");
    for (mode, paper) in PAPER_TABLE_2 {
        let _ = write!(out, "  {mode:<8}");
        for (frequency, paper) in TRACKING_FREQUENCIES.iter().zip(paper) {
            let ours = tracking.rmse_nm(mode, *frequency).map_or("-".to_owned(), |nm| format!("{nm:.2}"));
            let _ = write!(out, "{:>22}", format!("{ours} ({paper:.1})"));
        }
        out.push('\n');
    }
    let _ = writeln!(out, "{name}: slope of Y on q̂, as a ratio to that at 0.1 Hz (paper's Table 1)");
    for (row, paper) in linearity.rows.iter().zip(PAPER_TABLE_1) {
        let _ = writeln!(
            out,
            "  {:>5} Hz  λ {:.4}  offset {:>8.1} nm  ratio {:.4} ({paper:.4})",
            row.frequency_hz,
            row.gain_ratio,
            row.offset_um * 1e3,
            row.relative_slope
        );
    }
    out
}

/// Arguments of `forc`.
#[derive(Args, Debug)]
pub struct ForcArguments {
    /// File to write: CSV with time_s, drive_V, displacement_um.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Reversal curves, and cells per axis of the grid that they identify.
    #[arg(long, default_value_t = 32, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=256))]
    grid: u32,
    #[command(flatten)]
    plant: PlantArguments,
}

pub fn run_forc(arguments: &ForcArguments, ui: &mut Ui) -> Result<(), Failure> {
    let (parameters, noise) = arguments.plant.read()?;
    let mut leg = LegPlant::new(&parameters);
    let mut gauge = Gauge::new(&noise, arguments.plant.seed, 0);
    let record = ReversalExperiment::reference(arguments.grid).run(&mut leg, &mut gauge);
    let rows = record.rows.len();
    write_file(&arguments.output, record.to_csv().as_bytes())?;
    let text = format!("wrote {rows} rows to {}\n", arguments.output.display());
    ui.result(&text, json!({ "rows": rows, "file": arguments.output.display().to_string() }));
    Ok(())
}

/// Writes all files into a new or existing folder; each is replaced whole.
fn write_folder(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::Environment(format!("could not create `{}`: {error}", folder.display())))?;
    for (name, bytes) in files {
        write_file(&folder.join(name), bytes)?;
    }
    Ok(())
}
