//! `specgen check`: every finding about a spec, nothing written.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::ui::{Failure, Ui};
use crate::compile::{self, Compiled};
use crate::{reach, stability};

/// Arguments of `check`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The spec file.
    spec: PathBuf,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = compile::compile(&arguments.spec)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    let text = format!("{} is good\n{}", compiled.source.display_name, describe(&compiled));
    ui.result(&text, json!({ "name": compiled.ir.name, "digest": compiled.ir.digest, "margins": compiled.margins, "design": compiled.design, "reach": compiled.reach, "pose_noise": compiled.pose_noise, "records": compiled.records }));
    Ok(())
}

/// What identification and the stability check found, a line each.
pub fn describe(compiled: &Compiled) -> String {
    let mut text = String::new();
    for (name, report) in compiled.model.hysteresis.records.iter().zip(&compiled.records) {
        let what = report.as_ref().map_or_else(|| "a table, taken as it is".to_owned(), super::identify::summary);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  record {name}: {what}");
    }
    if let Some(margins) = &compiled.margins
        && let (Some(limit), Some(largest)) = (margins.static_gain_limit, margins.largest_level_weight)
    {
        let _ = writeln!(
            text,
            "  adaptation: λ < {limit:.3} without leg dynamics; sampled leg has spectral radius {:.4}; \
             stable up to level weight {largest:.4} (here {})",
            margins.spectral_radius, compiled.model.adaptation.level_weight
        );
    }
    if let Some(design) = &compiled.design {
        text.push_str(&stability::platform::describe(design));
    }
    if let Some(reach) = &compiled.reach {
        text.push_str(&reach::describe(reach));
    }
    if let (Some(noise), Some(task)) = (&compiled.pose_noise, &compiled.ir.task_space) {
        let list = |values: &[f64]| values.iter().map(|v| format!("{:.1}", v * 1e9)).collect::<Vec<_>>().join("/");
        let _ = writeln!(
            text,
            "  gauges: {:.2} nm rms each with quantisation; pose {} nm and {} nrad rms; legs {} nm rms; found in {} passes to {:.1e} m, {:.1e} rad",
            noise.reading * 1e9,
            list(&noise.pose[..3]),
            list(&noise.pose[3..]),
            list(&noise.leg),
            task.sensing.passes,
            task.sensing.remainder[0],
            task.sensing.remainder[1]
        );
    }
    text
}
