//! `specgen sim` of a spec without `[control]`: the paper's leg experiment, Tables 1 and 2.

use std::fmt::Write as _;

use host_sim::controller::Controller;
use host_sim::scenario::{LINEARITY_FREQUENCIES, MODES, TRACKING_FREQUENCIES, select};
use host_sim::table::{LinearityTable, TrackingTable};
use serde::Serialize;
use serde_json::json;

use super::{Arguments, environment};
use crate::cli::file::write_folder;
use crate::cli::table::{left, right, row};
use crate::cli::ui::{Failure, Outcome, Ui};
use specgen_compiler::compile::Compiled;
use specgen_language::model::Adaptation;
use specgen_studies::machine;
use specgen_studies::paper::printed;

/// Control ticks per period of the trajectory, unless asked otherwise.
const SAMPLES: u32 = 500;

/// Refuses arguments that are for a platform alone.
pub(super) fn check(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.frequency.is_some() || arguments.trajectory.is_some() || arguments.latency != 0 {
        return Err(Failure::Usage(
            "--frequency, --trajectory and --latency are for a platform that six gauges see; this spec has no [control]".to_owned(),
        ));
    }
    Ok(())
}

pub(super) fn run(
    arguments: &Arguments,
    compiled: &Compiled,
    controller: &mut Controller,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let (parameters, noise) = arguments.plant.read()?;
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs = std::array::from_fn(|_| parameters.clone());
    let samples = arguments.samples.unwrap_or(SAMPLES);
    let scenario = machine::legs(&compiled.model, &legs, &noise, arguments.plant.seed, samples);
    let modes = modes(&compiled.model.adaptation);
    ui.progress("Table 2: every law that the spec gives weights for, at three frequencies");
    let tracking = scenario.tracking(controller, &modes, &TRACKING_FREQUENCIES).map_err(environment)?;
    ui.progress("Table 1: inverse model alone at six frequencies");
    let linearity = scenario.linearity(controller, &LINEARITY_FREQUENCIES).map_err(environment)?;

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
            select(controller, word).map_err(environment)?;
            for frequency in TRACKING_FREQUENCIES {
                let run = scenario.run(controller, frequency).map_err(environment)?;
                let stem = format!("trace-{mode}-{frequency}hz");
                files.push((format!("{stem}.csv"), run.trace.to_csv().into_bytes()));
                files.push((format!("{stem}.trace"), run.trace.to_bytes()));
            }
        }
        write_folder(output, &files)?;
        ui.progress(&format!("wrote {} files to {}", files.len(), output.display()));
    }
    ui.result(&Tables { name: &compiled.ir.name, digest: &compiled.ir.digest, tracking, linearity });
    Ok(())
}

/// The laws that the spec gives weights for: with a weight of zero a law adapts nothing, and its row would say nothing.
pub(in crate::cli) fn modes(adaptation: &Adaptation) -> Vec<(&'static str, u32)> {
    let given = |mode: &str| match mode {
        "ewma" => adaptation.level_weight > 0.0,
        "pcc" => adaptation.level_weight > 0.0 && adaptation.drift_weight > 0.0,
        _ => true,
    };
    MODES.into_iter().filter(|(mode, _)| given(mode)).collect()
}

/// The paper's tables of the legs.
#[derive(Serialize)]
struct Tables<'a> {
    #[serde(skip)]
    name: &'a str,
    digest: &'a str,
    tracking: TrackingTable,
    linearity: LinearityTable,
}

impl Outcome for Tables<'_> {
    fn text(&self) -> String {
        let name = self.name;
        let mut out = format!("{name}: tracking error of the leg trajectory, nm rms of T − Y (paper's Table 2)\n");
        let columns = [left(8).behind("  "), right(22), right(22), right(22)];
        row(&mut out, &columns, &[&"", &"0.1 Hz", &"1 Hz", &"10 Hz"]);
        for (mode, paper) in printed::TABLE_2 {
            let [a, b, c] = std::array::from_fn(|k| {
                let ours = self.tracking.rmse_nm(mode, TRACKING_FREQUENCIES[k]);
                format!("{} ({:.1})", ours.map_or("-".to_owned(), |nm| format!("{nm:.2}")), paper[k])
            });
            row(&mut out, &columns, &[&mode, &a, &b, &c]);
        }
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(out, "{name}: slope of Y on q̂, as a ratio to that at 0.1 Hz (paper's Table 1)");
        for (index, row) in self.linearity.rows.iter().enumerate() {
            let paper = printed::slope_ratio(index);
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
}
