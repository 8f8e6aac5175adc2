//! `specgen identify RECORD`: a record of reversal curves in, an Everett table and its figures out.

use crate::drawing::wrote;
use specgen_identify::leg_model::{Choice, FamilyScore, Selection, choose};
use specgen_identify::rate::RateModel;
use specgen_identify::{self as identify, DeadTime, Drive, GridChoice, Prediction, Report, predict};
use std::path::Path;

use serde::Serialize;

use super::cause::account;
use super::predict::summary;
use super::{Bench, MeasuredKeys, refused};
use crate::identification as figure;
use specgen_language::model::LegModelKind;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_table;
use specgen_language::shell;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;

/// What to fit.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Lowest and highest voltage of the table, V.
    pub drive: [f64; 2],
    /// Cells per axis; chosen if none.
    pub grid: Option<usize>,
    /// Of the record.
    pub dead_time: DeadTime,
    /// Family of the leg model.
    pub model: LegModelKind,
}

/// What is in the records, and the command line that identifies them over the range of their drive; or why they are refused.
/// `given` are the words of the command that lacks the range.
pub fn missing_range(paths: &[impl AsRef<Path>], bench: &Bench, given: &[String], ui: &mut Ui) -> Failure {
    let mut text = String::new();
    let mut whole = [f64::INFINITY, f64::NEG_INFINITY];
    for path in paths {
        let shown = path.as_ref().display().to_string();
        let record = match identify::read_record(path.as_ref(), &shown, &bench.reading) {
            Ok(record) => record,
            Err(findings) => return refused(findings),
        };
        ui.findings(None, &record.warnings);
        let (low, high) = identify::extent(&record.drive);
        whole = [if low < whole[0] { low } else { whole[0] }, if high > whole[1] { high } else { whole[1] }];
        let (least, most) = identify::extent(&record.displacement);
        let seconds = record.time[record.time.len() - 1] - record.time[0];
        text += &format!(
            "{shown}: {} samples in {seconds:.3} s, drive {low} V to {high} V, displacement {:.3} µm to {:.3} µm; ",
            record.time.len(),
            least * 1e6,
            most * 1e6
        );
    }
    let mut line = shell::line("specgen identify").word(&format!("--drive={}:{}", whole[0], whole[1]));
    for word in given {
        line = line.word(word);
    }
    Failure::Usage(format!("{text}the voltage range of the table is missing, such as that of the drive: `{line}`"))
}

/// Reads the records of a leg, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(
    paths: &[impl AsRef<Path>],
    &Options { drive, grid, dead_time, model }: &Options,
    validation: Option<&Path>,
    output: Option<&Path>,
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let reading = &bench.reading;
    let read = |path: &Path| identify::read_record(path, &path.display().to_string(), reading).map_err(refused);
    let records = paths.iter().map(|path| read(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    let record = identify::join(&records, drive).map_err(refused)?;
    let validation = validation.map(read).transpose()?;
    let choice = match grid {
        Some(_) => None,
        None => Some(identify::choose_grid(&record, drive, dead_time).map_err(refused)?),
    };
    let grid = grid.or(choice.as_ref().map(|c| c.chosen)).unwrap_or_default();
    let finest = if choice.is_some() { identify::MAX_GRID } else { grid };
    let options = identify::Options { dead_time, finest, ..identify::Options::new(grid, drive) };
    if let Some(record) = &validation {
        ui.findings(None, &record.warnings);
    }
    let error = validation.as_ref().map(identify::error_on);
    let error = error.as_ref().map(|error| error as &Selection<'_>);
    let chosen = choose(&record, error, &options, model).map_err(refused)?;
    let grid = chosen.model.table.grid;
    let families = families(&chosen, grid, validation.as_ref().map(|record| record.shown_as.as_str()));
    let Choice { table: identified, model, scores, .. } = chosen;
    ui.findings(None, &identified.warnings);
    let validate = |record: &identify::Record| {
        let model = RateModel { dead_time: identified.report.dead_time, ..RateModel::of_leg(model.clone()) };
        predict(&model, &Drive::from(record)).map_err(refused)
    };
    let validation = validation.as_ref().map(validate).transpose()?;
    if let Some(output) = output {
        let text = identify::write_leg_csv(&model);
        let text = if record.simulated { identify::marked_as_simulated(&text) } else { text };
        write_table(output, text.as_bytes())?;
    }
    let draw = || figure::everett(&identified, choice.as_ref(), validation.as_ref());
    let plot = bench.plot.write("Everett table", draw)?;
    let table = output.map(wrote);
    ui.result(&Table {
        record: record.shown_as,
        grid,
        report: &identified.report,
        validation: validation.as_ref(),
        grid_choice: choice.as_ref(),
        measured: MeasuredKeys::of(&["hysteresis.grid", "hysteresis.records"], record.simulated),
        scores,
        families,
        files: table.into_iter().chain(plot).collect(),
    });
    Ok(())
}

/// An identified Everett table.
#[derive(Serialize)]
struct Table<'a> {
    #[serde(skip)]
    record: String,
    #[serde(skip)]
    grid: usize,
    report: &'a Report,
    validation: Option<&'a Prediction>,
    grid_choice: Option<&'a GridChoice>,
    measured: MeasuredKeys,
    /// Errors of the families of leg models.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scores: Vec<FamilyScore>,
    /// The same as text.
    #[serde(skip)]
    families: String,
    /// One line per written file.
    #[serde(skip)]
    files: String,
}

impl Outcome for Table<'_> {
    fn text(&self) -> String {
        let mut text = self.grid_choice.map(curve).unwrap_or_default();
        text += &format!("{}: {}\n", self.record, self.report.summary());
        details(self.report, &mut text);
        if let Some(validation) = self.validation {
            text += &format!("{}: {}\n", validation.record, summary(validation));
        }
        text += &self.families;
        text += &format!("lines for the spec:\n[hysteresis]\ngrid = {}\n", self.grid);
        text + &self.measured.text() + &self.files
    }
}

/// The held-out error of every family, and its price.
fn families(choice: &Choice, grid: usize, arbitrary: Option<&str>) -> String {
    if choice.scores.is_empty() {
        return String::new();
    }
    let mut text = String::from("leg model by cross-validation: whole curves held out, each without its mean\n");
    let columns = [24, 14, 11, 14, 14, 8].map(|width| right(width).behind("  "));
    row(&mut text, &columns, &[&"model", &"held-out error", &"± std err", &"arbitrary", &"instructions", &"bytes"]);
    for score in &choice.scores {
        let mark = if score.family == choice.family { "  <- chosen" } else { "" };
        let [held_out, error] =
            [score.held_out_rms, score.standard_error].map(|error| format!("{:.2} nm", error * 1e9));
        let other = score.arbitrary_rms.map_or_else(|| "-".to_owned(), |rms| format!("{:.2} nm", rms * 1e9));
        let bytes = format!("{:>8}{mark}", score.family.bytes(grid));
        row(
            &mut text,
            &columns,
            &[&score.family.name(), &held_out, &error, &other, &score.family.instructions(), &bytes],
        );
    }
    match arbitrary {
        Some(name) => {
            text += &format!("  chosen: the simplest within a tenth of the least error on {name}\n");
        }
        None => {
            text += "  chosen: the simplest within a tenth of the best plus a fifth of the noise; a\n  \
                     table has to be within one standard error\n";
        }
    }
    text += "  instructions of one leg on a Cortex-M7 in f64 are estimated, not measured\n";
    text
}

/// The held-out error of every grid.
fn curve(choice: &GridChoice) -> String {
    let mut text = format!(
        "grid by cross-validation: whole curves of {} reversal voltages held out in {} folds\n",
        choice.levels, choice.folds
    );
    let columns = [4, 14, 5, 11].map(|width| right(width).behind("  "));
    row(&mut text, &columns, &[&"N", &"held-out error", &"%", &"± std err of difference"]);
    for s in &choice.scores {
        let mark = match (s.grid == choice.chosen, s.grid == choice.best) {
            (true, true) => "  <- chosen and best",
            (true, false) => "  <- chosen",
            (false, true) => "  <- best",
            (false, false) => "",
        };
        // The mark follows the columns.
        let error = format_args!("{:>8.3} nm{mark}", s.standard_error * 1e9);
        let held_out = format_args!("{:.3} nm", s.held_out_rms * 1e9);
        row(&mut text, &columns, &[&s.grid, &held_out, &format_args!("{:.3}", s.held_out_percent), &error]);
    }
    text += &format!("  N = {}: {} (one-standard-error rule)\n", choice.chosen, choice.rule);
    text
}

/// Further details.
fn details(report: &Report, text: &mut String) {
    *text += &format!("  residual: {}\n", account(&report.cause));
    *text += &format!("  dead time {}\n", report.dead_time_basis);
    if report.dead_time > report.held && report.held > 0.0 {
        let (held, rest) = (report.held * 1e3, (report.dead_time - report.held) * 1e3);
        *text += &format!(
            "  of this, {held:.3} ms is the hold of a command, since `drive_V` is a command; relative to the voltage it is {rest:.3} ms (name a measured voltage `monitor_V`)\n"
        );
    }
    if report.weightless > 0 {
        *text += &format!("  {} samples were given no weight (see the warnings)\n", report.weightless);
    }
    if report.unexcited.is_empty() {
        *text += "  every cell of the plane was excited\n";
    }
    for region in report.unexcited.iter().take(5) {
        let (cells, share, up_low, up_high) = (region.cells, region.share * 100.0, region.up[0], region.up[1]);
        let (down_low, down_high) = (region.down[0], region.down[1]);
        *text += &format!(
            "  not excited: {cells} cells ({share:.1} %), up_threshold {up_low:.3} to {up_high:.3} V, down_threshold {down_low:.3} to {down_high:.3} V; there the measured sum is distributed evenly\n"
        );
    }
}
