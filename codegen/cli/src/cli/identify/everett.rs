//! `specgen identify RECORD`: a reversal-curve record in, an Everett table and its figures out.

use std::fmt::Write as _;
use std::path::Path;

use clap::Args;
use serde::Serialize;

use super::cause::account;
use super::predict;
use super::reading::ReadingArguments;
use super::{Measured, refused};
use crate::cli::named::{InputFile, OutputFile};
use crate::cli::plot::{Plot, wrote};
use specgen_identify::{self as identify, DeadTime, GridChoice, Options, Prediction, Report};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;
use specgen_report::identification as figure;

/// Arguments of `identify RECORD`.
#[derive(Args, Debug)]
pub struct EverettArguments {
    /// Reversal-curve record: CSV with columns time_s, drive_V, displacement_um.
    #[arg(required = true)]
    record: Option<InputFile>,
    /// Voltage range of the table, V, such as 0:100 or -90:90.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true, required = true)]
    drive: Option<[f64; 2]>,
    /// Cells per axis of the Preisach grid; chosen by cross-validation over whole curves if not given.
    #[arg(long, value_name = "N", value_parser = grid, allow_negative_numbers = true)]
    grid: Option<usize>,
    /// A second record of the leg, not used for the fit, to judge the table by.
    #[arg(long, value_name = "RECORD")]
    validate: Option<InputFile>,
    /// Write the table (CSV: up_V, down_V, everett_um) here.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    #[command(flatten)]
    reading: ReadingArguments,
    #[command(flatten)]
    plot: Plot,
}

/// Voltages that make sense; `actuator.voltage` of a spec has the same range.
const VOLTS: std::ops::RangeInclusive<f64> = -1e4..=1e4;

pub(in crate::cli) fn range(text: &str) -> Result<[f64; 2], String> {
    let expected = || format!("expected two voltages LOW:HIGH in V, found `{text}`");
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
pub(in crate::cli) fn grid(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("expected a whole number, found `{text}`"))
}

pub fn run(arguments: &EverettArguments, ui: &mut Ui) -> Result<(), Failure> {
    // Both are required unless a command is named: the option is for clap's sake.
    let (Some(path), Some(drive)) = (&arguments.record, arguments.drive) else {
        return Err(Failure::Usage(
            "a record and --drive are expected, or one of linear, response, gauge, stiffness".to_owned(),
        ));
    };
    let shown = path.display().to_string();
    let reading = arguments.reading.reading()?;
    let record = identify::read_record(path, &shown, &reading).map_err(refused)?;
    let choice = match arguments.grid {
        Some(_) => None,
        None => Some(identify::choose_grid(&record, drive, DeadTime::Estimate).map_err(refused)?),
    };
    let grid = arguments.grid.or(choice.as_ref().map(|c| c.chosen)).unwrap_or_default();
    let identified = identify::identify(&record, &Options::new(grid, drive)).map_err(refused)?;
    ui.findings(None, &identified.warnings);
    let validation = match &arguments.validate {
        Some(path) => Some(validate(path, &identified, &reading).map_err(refused)?),
        None => None,
    };
    if let Some(output) = &arguments.output {
        let text = identify::write_table_csv(&identified.table);
        let text = if record.simulated { identify::marked_as_simulated(&text) } else { text };
        write_file(output, text.as_bytes())?;
    }
    let draw = || figure::everett(&identified, choice.as_ref(), validation.as_ref());
    let plot = arguments.plot.write("Everett table", draw)?;
    let table = arguments.output.as_ref().map(|path| wrote(path));
    ui.result(&Table {
        record: shown,
        grid,
        report: &identified.report,
        validation: validation.as_ref(),
        grid_choice: choice.as_ref(),
        measured: Measured::of(&["hysteresis.grid", "hysteresis.records"], record.simulated),
        files: table.into_iter().chain(plot).collect(),
    });
    Ok(())
}

/// An Everett table that was identified.
#[derive(Serialize)]
struct Table<'a> {
    #[serde(skip)]
    record: String,
    #[serde(skip)]
    grid: usize,
    report: &'a Report,
    validation: Option<&'a Prediction>,
    grid_choice: Option<&'a GridChoice>,
    measured: Measured,
    /// A line for each file that was written.
    #[serde(skip)]
    files: String,
}

impl Outcome for Table<'_> {
    fn text(&self) -> String {
        let mut text = self.grid_choice.map(curve).unwrap_or_default();
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(text, "{}: {}", self.record, summary(self.report));
        details(self.report, &mut text);
        if let Some(validation) = self.validation {
            let _ = writeln!(text, "{}: {}", validation.record, predict::summary(validation));
        }
        let _ = writeln!(text, "lines for the spec:\n[hysteresis]\ngrid = {}", self.grid);
        text + &self.measured.text() + &self.files
    }
}

fn validate(
    path: &Path,
    identified: &identify::Identification,
    reading: &identify::Reading,
) -> Result<Prediction, Vec<Diagnostic>> {
    let record = identify::read_record(path, &path.display().to_string(), reading)?;
    identify::validate(&identified.table, &record, identified.report.dead_time)
}

/// The held-out error of every grid.
fn curve(choice: &GridChoice) -> String {
    let mut text = format!(
        "grid by cross-validation: whole curves of {} reversal voltages held out in {} folds\n",
        choice.levels, choice.folds
    );
    let columns = [4, 14, 5, 11].map(|width| right(width).behind("  "));
    row(&mut text, &columns, &[&"N", &"held-out error", &"%", &"± std err to the best"]);
    for s in &choice.scores {
        let mark = match (s.grid == choice.chosen, s.grid == choice.best) {
            (true, true) => "  <- chosen and best",
            (true, false) => "  <- chosen",
            (false, true) => "  <- best",
            (false, false) => "",
        };
        // The mark stands behind the columns.
        let error = format_args!("{:>8.3} nm{mark}", s.standard_error * 1e9);
        let held_out = format_args!("{:.3} nm", s.held_out_rms * 1e9);
        row(&mut text, &columns, &[&s.grid, &held_out, &format_args!("{:.3}", s.held_out_percent), &error]);
    }
    let _ = writeln!(text, "  N = {}: {} (one-standard-error rule)", choice.chosen, choice.rule);
    text
}

/// What the summary has no room for.
fn details(report: &Report, text: &mut String) {
    let _ = writeln!(text, "  residual: {}", account(&report.cause));
    let _ = writeln!(text, "  dead time {}", report.dead_time_basis);
    if report.dead_time > report.held && report.held > 0.0 {
        let _ = writeln!(
            text,
            "  of it {:.3} ms is the hold of a command, as `drive_V` is taken to be; from the voltage it is {:.3} ms (a measured voltage is named `monitor_V`)",
            report.held * 1e3,
            (report.dead_time - report.held) * 1e3
        );
    }
    if report.weightless > 0 {
        let _ = writeln!(text, "  {} samples got no weight (see the warnings)", report.weightless);
    }
    if report.unexcited.is_empty() {
        let _ = writeln!(text, "  every cell of the plane was excited");
    }
    for region in report.unexcited.iter().take(5) {
        let _ = writeln!(
            text,
            "  not excited: {} cells ({:.1} %), up_threshold {:.3} to {:.3} V, down_threshold {:.3} to {:.3} V; the table divides the measured sum evenly there",
            region.cells,
            region.share * 100.0,
            region.up[0],
            region.up[1],
            region.down[0],
            region.down[1]
        );
    }
}

/// A report in one line.
pub fn summary(report: &Report) -> String {
    let simulated = if report.simulated { "simulated: " } else { "" };
    format!(
        "{simulated}{} reversal curves, fit {:.2} nm rms ({:.3} % of {:.2} µm; {:.2} nm within branches), noise {:.2} nm, drift {:.3} nm/s, dead time {:.3} ms, \
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
