//! `specgen check`: every finding about a spec, nothing written.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::ui::{Failure, Ui};
use crate::compile::{self, Compiled};

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
    ui.result(&text, json!({ "name": compiled.ir.name, "digest": compiled.ir.digest, "margins": compiled.margins, "records": compiled.records }));
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
    let margins = &compiled.margins;
    if let (Some(limit), Some(largest)) = (margins.static_gain_limit, margins.largest_level_weight) {
        let _ = writeln!(
            text,
            "  adaptation: λ < {limit:.3} without leg dynamics; sampled leg has spectral radius {:.4}; \
             stable up to level weight {largest:.4} (here {})",
            margins.spectral_radius, compiled.model.adaptation.level_weight
        );
    }
    text
}
