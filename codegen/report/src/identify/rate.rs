//! `specgen identify rate`: records at several rates in; a comparison of rate-dependent models and spec lines out.

use crate::drawing::wrote;
use std::path::{Path, PathBuf};

use super::{Bench, IdentificationResult, MeasuredKeys, refused};
use crate::identification as figure;
use specgen_identify::everett::FINE_GRID;
use specgen_identify::rate::{RateIdentification, RateOption, RateReport, identify_rate, spec_lines, write_rate_csv};
use specgen_identify::{marked_as_simulated, read_record, write_table_csv};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_folder;
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;

/// Reads the records, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(
    paths: &[impl AsRef<Path>],
    drive: [f64; 2],
    grid: usize,
    hold_out: Option<&Path>,
    output: Option<&Path>,
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let read = |path: &Path| read_record(path, &path.display().to_string(), &bench.reading);
    let mut records = Vec::new();
    let mut errors = Vec::new();
    for path in paths {
        match read(path.as_ref()) {
            Ok(record) => records.push(record),
            Err(found) => errors.extend(found),
        }
    }
    let hold_out = match hold_out.map(read).transpose() {
        Ok(record) => record,
        Err(found) => {
            errors.extend(found);
            None
        }
    };
    if !errors.is_empty() {
        return Err(refused(errors));
    }
    ui.progress(&format!("{} fits of {} records", RateOption::ALL.len() * (records.len() + 1), records.len()));
    let fit = specgen_identify::Options::new(grid, drive);
    let identified = identify_rate(&records, hold_out.as_ref(), &fit).map_err(refused)?;
    ui.findings(None, &identified.warnings);
    let files = output.map(|output| write(output, &identified)).transpose()?.unwrap_or_default();
    let plot = bench.plot.write("Rate dependence", || figure::rate(&identified.report))?;
    let files = files.iter().map(|path| wrote(path)).chain(plot).collect();
    let keys = keys(&identified.report);
    let measured = MeasuredKeys::of(&keys, is_simulated(&identified.report));
    ui.result(&IdentificationResult { report: identified.report, measured, files });
    Ok(())
}

impl Outcome for IdentificationResult<RateReport> {
    fn text(&self) -> String {
        table(&self.report) + &self.files
    }
}

/// Whether any record is simulated; the fit is then no measurement.
fn is_simulated(report: &RateReport) -> bool {
    report.records.iter().any(|record| record.simulated)
}

/// The spec keys of the best option.
fn keys(report: &RateReport) -> Vec<&'static str> {
    let of_mode = ["actuator.resonance", "actuator.damping_ratio", "actuator.resonance_gain"];
    let own = ["hysteresis.grid", "hysteresis.records", "hysteresis.rate", "hysteresis.dead_time"];
    own.into_iter().chain(report.ring.iter().flat_map(|_| of_mode)).collect()
}

/// Writes the tables, then the spec lines that refer to them.
fn write(output: &Path, identified: &RateIdentification) -> Result<Vec<PathBuf>, Failure> {
    let name = output.file_name().map(|name| name.to_string_lossy().into_owned()).ok_or_else(|| {
        Failure::Usage(format!("`{}` is not a file name: give a name such as models/leg1", output.display()))
    })?;
    let best = identified.report.verdict.best;
    let simulated = is_simulated(&identified.report);
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut lines = format!(
        "# Rate dependence of the leg, from `specgen identify rate`. The active option has the lowest error at rates that it was\n\
         # not fitted to. Table paths are relative to the spec.\n[hysteresis]\n# {}\n",
        identified.report.verdict.text.replace('\n', "\n# ")
    );
    for (option, model) in &identified.models {
        let table = match option {
            RateOption::Static => format!("{name}-static.csv"),
            RateOption::DeadTime => format!("{name}-dead-time.csv"),
            RateOption::DynamicPreisach => format!("{name}-mu0.csv"),
            RateOption::Creep => format!("{name}-creep.csv"),
            RateOption::EvenCreep => format!("{name}-creep-one.csv"),
            RateOption::CreepMode => format!("{name}-creep-mode.csv"),
        };
        let rate_table = format!("{name}-mu1.csv");
        let mark = |text: String| if simulated { marked_as_simulated(&text) } else { text };
        files.push((table.clone(), mark(write_table_csv(&model.still)).into_bytes()));
        if let Some(rate) = &model.rate {
            files.push((rate_table.clone(), mark(write_rate_csv(rate)).into_bytes()));
        }
        let block = spec_lines(*option, model, identified.report.held, &table, &rate_table);
        let prefix = if *option == best { "" } else { "# " };
        lines += &format!("\n# {}\n", option.name());
        lines.extend(block.lines().map(|line| format!("{prefix}{line}\n")));
    }
    lines += &format!("\n{}", MeasuredKeys::of(&keys(&identified.report), simulated).text());
    files.push((format!("{name}.toml"), lines.into_bytes()));
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write_folder(folder, &files)?;
    Ok(files.into_iter().map(|(file, _)| output.with_file_name(file)).collect())
}

fn table(report: &RateReport) -> String {
    let mut text = String::new();
    for record in &report.records {
        let (name, frequency, speed) = (&record.record, record.frequency_text(), record.speed);
        let (samples, range, noise) = (record.samples, record.range * 1e6, record.noise_percent);
        text += &format!(
            "{name}: {frequency} curves, median {speed:.0} V/s, {samples} samples, range {range:.3} µm, noise {noise:.3} % of it\n"
        );
    }
    if let Some(held) = &report.hold_out {
        text += &format!("{}: held out of all fits\n", held.record);
    }
    text += &format!("\nrms error in % of the range, grid {}\n", report.grid);
    // Nine characters per record, twice; the last column exists only if a record was held out.
    let width = 9 * report.records.len();
    let held = if report.hold_out.is_some() { "  held out" } else { "" };
    let heads = [left(20), right(width), right(width).behind("   "), left(0)];
    row(&mut text, &heads, &[&"", &"fitted to all", &"fitted to the others", &held]);
    let frequencies: String = report.records.iter().map(|record| format!("{:>9}", record.frequency_text())).collect();
    row(&mut text, &heads, &[&"model", &frequencies, &frequencies, &""]);
    for option in &report.options {
        let numbers = |values: &[f64]| values.iter().map(|v| format!("{v:>9.3}")).collect::<String>();
        let held = option.hold_out.map(|v| format!("{v:>10.3}")).unwrap_or_default();
        row(&mut text, &heads, &[&option.option.name(), &numbers(&option.fitted), &numbers(&option.left_out), &held]);
    }
    text.push('\n');
    for option in report.options.iter().filter(|o| o.dead_time > 0.0 || !o.creep.is_empty()) {
        let creep: Vec<String> =
            option.creep.iter().map(|c| format!("{:.4} at {:.4} s", c.weight, c.time_constant)).collect();
        let creep = match option.option {
            _ if option.creep.is_empty() && option.option >= RateOption::Creep => {
                "; no creep term improves the fit".to_owned()
            }
            _ if creep.is_empty() => String::new(),
            RateOption::EvenCreep => {
                let (weight, count) = (option.creep[0].weight, creep.len());
                let (fastest, slowest) = (option.creep[creep.len() - 1].time_constant, option.creep[0].time_constant);
                format!("; creep {weight:.4} at each of {count} time constants from {fastest:.4} to {slowest:.4} s")
            }
            _ => format!("; creep {}", creep.join(", ")),
        };
        text += &format!("{}: dead time {:.3} ms{creep}\n", option.option.name(), option.dead_time * 1e3);
    }
    for (option, period) in report.options.iter().filter_map(|o| Some((o.option, o.period?))) {
        let when = match period > 0.0 {
            true => format!("at periods of {:.3} ms or longer; `specgen check` refuses shorter ones", period * 1e3),
            false => "at any period".to_owned(),
        };
        text += &format!("{}: invertible by a controller {when}\n", option.name());
    }
    if let Some(ring) = report.ring {
        let gain = report.options.iter().find_map(|option| option.inertia).map_or(0.0, |inertia| inertia.gain);
        let coarse = if report.grid < FINE_GRID { "; too large on this coarse grid" } else { "" };
        let (frequency, damping, gain) = (ring.mode.frequency, ring.mode.damping, gain * 1e6);
        text += &format!(
            "mode: {frequency:.1} Hz, damping ratio {damping:.4}, gain {gain:.5} µm/V (slope after a reversal{coarse})\n"
        );
        if let Some([frequency, amplitude]) = ring.at_first {
            let (first, last_frequency, last) = (amplitude * 1e6, ring.mode.frequency, ring.amplitude * 1e6);
            text += &format!(
                "its frequency by amplitude: {frequency:.1} Hz at {first:.3} µm, {last_frequency:.1} Hz at {last:.3} µm\n"
            );
        }
    }
    if report.held > 0.0 {
        text += &format!(
            "{:.3} ms of each dead time is the hold of the commands; the spec lines contain the rest\n",
            report.held * 1e3
        );
    }
    text += &format!("{}\n", report.verdict.text);
    text += &format!("lowest error at rates not fitted to: {}\n", report.verdict.best.name());
    text
}
