//! `specgen identify`: a reversal-curve record in, an Everett table and its figures out.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;

use super::file::write_file;
use super::ui::{Failure, Ui};
use crate::compile::Refused;
use crate::diagnostic::Diagnostic;
use crate::identify::{self, Options, Report, Validation};

/// Arguments of `identify`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "specgen identify [OPTIONS] --drive <MIN:MAX> <RECORD>\n       specgen identify rate [OPTIONS] --drive <MIN:MAX> <RECORD>..."
)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Option<Kind>,
    #[command(flatten)]
    table: Option<Table>,
}

/// What else can be identified.
#[derive(Subcommand, Debug)]
enum Kind {
    /// Compare rate-dependent models on records of one leg at several rates.
    Rate(super::identify_rate::Arguments),
}

/// Arguments of the identification of a table.
#[derive(Args, Debug)]
struct Table {
    /// Reversal-curve record: CSV with columns time_s, drive_V, displacement_um.
    record: PathBuf,
    /// Voltage range of the table, V, such as 0:100 or -90:90.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true)]
    drive: [f64; 2],
    /// Cells per axis of the Preisach grid.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = grid, allow_negative_numbers = true)]
    grid: usize,
    /// A second record of the leg, not used for the fit, to judge the table by.
    #[arg(long, value_name = "RECORD")]
    validate: Option<PathBuf>,
    /// Write the table (CSV: up_V, down_V, everett_um) here.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Voltages that make sense; `actuator.voltage` of a spec has the same range.
const VOLTS: std::ops::RangeInclusive<f64> = -1e4..=1e4;

pub(super) fn range(text: &str) -> Result<[f64; 2], String> {
    let expected = || format!("expected two voltages such as 0:100, found `{text}`");
    let (low, high) = text.split_once(':').ok_or_else(expected)?;
    let number = |part: &str| part.trim().trim_end_matches('V').trim().parse::<f64>().map_err(|_| expected());
    let (low, high) = (number(low)?, number(high)?);
    if ![low, high].iter().all(|volts| VOLTS.contains(volts)) {
        Err(format!("expected voltages from {} to {} V, found `{text}`", VOLTS.start(), VOLTS.end()))
    } else if low < high {
        Ok([low, high])
    } else {
        Err(format!("the lower voltage must be below the upper one, found `{text}`"))
    }
}

/// Any whole number: which sizes can be identified is for identification to say.
pub(super) fn grid(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("expected a whole number such as 32, found `{text}`"))
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    match (&arguments.kind, &arguments.table) {
        (Some(Kind::Rate(arguments)), _) => super::identify_rate::run(arguments, ui),
        (None, Some(arguments)) => run_table(arguments, ui),
        (None, None) => Err(Failure::Usage("name a record, or a kind of identification such as `rate`".to_owned())),
    }
}

fn run_table(arguments: &Table, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.record.display().to_string();
    let options = Options::new(arguments.grid, arguments.drive);
    let identified = identify::read_record(&arguments.record, &shown)
        .and_then(|record| identify::identify(&record, &options))
        .map_err(refused)?;
    ui.findings(None, &identified.warnings);
    let validation = match &arguments.validate {
        Some(path) => Some(validate(path, &identified).map_err(refused)?),
        None => None,
    };
    if let Some(output) = &arguments.output {
        write_file(output, identify::write_table_csv(&identified.table).as_bytes())?;
    }
    let mut text = format!("{shown}: {}\n", summary(&identified.report));
    if let Some(validation) = &validation {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{}: predicted to {:.3} % rms, {:.3} % at worst, of {:.3} µm (start taken as {:?})",
            validation.record,
            validation.best.rms_percent,
            validation.best.max_percent,
            validation.displacement_range * 1e6,
            validation.best.start
        );
    }
    if let Some(output) = &arguments.output {
        let _ = writeln!(text, "wrote {}", output.display());
    }
    ui.result(&text, json!({ "report": identified.report, "validation": validation }));
    Ok(())
}

fn validate(path: &Path, identified: &identify::Identified) -> Result<Validation, Vec<Diagnostic>> {
    let record = identify::read_record(path, &path.display().to_string())?;
    identify::validate(&identified.table, &record, identified.report.dead_time)
}

fn refused(findings: Vec<Diagnostic>) -> Failure {
    Failure::from(Refused { source: None, findings })
}

/// A report in one line.
pub fn summary(report: &Report) -> String {
    format!(
        "{} reversal curves, fit {:.2} nm rms ({:.3} % of {:.2} µm; {:.2} nm within branches), noise {:.2} nm, drift {:.3} nm/s, dead time {:.3} ms, \
         {} of {} weights zero, {:.1} % of the plane excited",
        report.reversal_curves,
        report.fit_rms * 1e9,
        report.fit_rms_percent,
        report.displacement_range * 1e6,
        report.branch_rms * 1e9,
        report.noise_floor * 1e9,
        report.drift * 1e9,
        report.dead_time * 1e3,
        report.zero_weights,
        report.weights,
        report.excited_share * 100.0
    )
}
