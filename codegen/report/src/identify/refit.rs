//! `specgen identify RUN.rec --spec SPEC`: refits gain, delay and cubic term of each leg of a platform from a recorded
//! run, names the legs that no longer match their model, and writes six separate tables.
use std::path::Path;

use serde::Serialize;
use specgen_runtime::record::FILE_MAGIC;

use super::recorded_run::{records, records_line, replayed, within, write_tables};
use super::{MeasuredKeys, refused};
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;
use specgen_identify::rate::RateModel;
use specgen_identify::refit::{self, KNOWN, LegRefit, LegRun, Number, SPREAD};
use specgen_identify::write_leg_csv;
use specgen_language::files;
use specgen_language::model::{Model, RateDependence};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::check_input;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;

/// Largest plausible change of gain and cubic term; beyond, the spec is wrong or a leg does not follow.
const PLAUSIBLE: [f64; 2] = [0.5, 0.05];
/// Name, unit, its size and digits of each number.
const NAMES: [(&str, &str, f64, usize); 3] =
    [("gain", " %", 1e2, 1), ("delay", " ms", 1e3, 3), ("cubic term", " %", 1e2, 2)];
/// How to record a better run; SPEC is in the line.
const ADVICE: &str = "record at least a second of a slow wave on all axes, in closed loop and without contact, as \
                      `specgen sim SPEC --record run.rec --seconds 2` simulates";

/// Whether a file is a recorded run. One that cannot be read is not.
pub fn is_recorded_run(path: &Path) -> bool {
    use std::io::Read as _;
    let mut start = [0; FILE_MAGIC.len()];
    files::open_file(path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok()) && start == FILE_MAGIC
}

/// A leg of the spec, and what the run shows of it.
type Leg = (RateModel, Option<LegRefit>);

/// Reads the recording, refits, writes the requested files and shows the result. `output` lies within the folder of the spec.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(recording: &Path, spec: &Path, output: Option<&Path>, ui: &mut Ui) -> Result<(), Failure> {
    let shown = recording.display().to_string();
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{shown}: {error}"));
    let folder = output.map(|folder| within(spec, folder).map(|name| (name, folder))).transpose()?;
    check_input(recording)?;
    let compiled = spec_file::looked_up(spec, ui)?;
    let tables = records(&compiled.model, spec, &refuse)?;
    let moves = replayed(recording, spec, &compiled, ui)?;
    let lead = lead(&compiled);
    let mut legs: Vec<Leg> = Vec::new();
    for (leg, own) in (0..6).filter_map(|leg| Some((leg, tables.leg(&compiled.model, leg)?))) {
        let run = LegRun {
            shown_as: &format!("{shown}, leg {leg}"),
            time: &moves.times,
            voltage: &moves.voltages[leg],
            displacement: &moves.displacements[leg],
            // A voltage commands the pose at the end of its period; the gauge lags behind that.
            delay: lead + compiled.model.timing.period + compiled.model.sensor.lag,
        };
        let found = refit::of(&own, &run).map_err(refused)?;
        if let Some(found) = found.filter(|found| !is_plausible(found)) {
            return Err(refuse(&implausible(leg, &found, spec)));
        }
        legs.push((own, found));
    }
    let known = |leg: &LegRefit| leg.numbers().iter().any(|number| number.accepted);
    if !legs.iter().any(|(_, found)| found.as_ref().is_some_and(known)) {
        return Err(refuse(&too_little(&legs, spec)));
    }
    let simulated = !compiled.assumptions.simulated.is_empty();
    let (mut files, mut lines, mut keys) = (String::new(), String::new(), Vec::new());
    if let Some((name, folder)) = folder {
        let shaped = legs.iter().any(|(_, found)| found.is_some_and(|found| found.differs()[2]));
        files = write_tables(folder, tables_of(&legs, shaped).map_err(|why| refuse(&why))?, simulated)?;
        let lead = lead_line(&legs, lead);
        keys = ["hysteresis.records"].into_iter().chain(lead.as_ref().map(|_| "control.lead")).collect();
        lines = records_lines(&compiled.model, &name, shaped) + &lead.unwrap_or_default();
    }
    let legs = legs.into_iter().map(|(_, found)| found).collect();
    let measured = MeasuredKeys::of(&keys, simulated);
    ui.result(&Refits { recording: shown, seconds: moves.seconds(), legs, measured, lines, files });
    Ok(())
}

/// The table of each leg. `shaped`: all with a read-out.
fn tables_of(legs: &[Leg], shaped: bool) -> Result<Vec<String>, String> {
    let table = |(leg, (own, found)): (usize, &Leg)| {
        let [gain, cubic] = found.map_or([0.0; 2], |found| found.changes());
        let changed = refit::refitted(own, gain, cubic, shaped);
        Ok(write_leg_csv(&changed.map_err(|why| format!("leg {leg}: {why}"))?))
    };
    legs.iter().enumerate().map(table).collect()
}

/// Lead that the law has, or would have if it were not below zero, s: the delay from command to pose.
fn lead(compiled: &Compilation) -> f64 {
    let model = &compiled.model;
    compiled.design.as_ref().map_or(0.0, |design| {
        let modes = design.leg_damping / model.actuator.axial_stiffness;
        if design.lead_given { design.lead } else { model.amplifier.lag + modes - 0.5 * model.timing.period }
    })
}

fn is_plausible(found: &LegRefit) -> bool {
    found.gain.change.abs() <= PLAUSIBLE[0] && found.cubic.change.abs() <= PLAUSIBLE[1]
}

/// Why a run is unsuitable, and how to record a better one.
fn implausible(leg: usize, found: &LegRefit, spec: &Path) -> String {
    let [gain, _, cubic] = found.numbers();
    let (gain, cubic, advice) = (gain.change * 1e2, cubic.change * 1e2, advice(spec));
    format!(
        "leg {leg}: gain {gain:+.1} %, cubic term {cubic:+.1} % are not plausible: check the table in the spec, or {advice}"
    )
}

/// Why no number is accepted.
fn too_little(legs: &[Leg], spec: &Path) -> String {
    if legs.is_empty() {
        return "the spec has no table of a leg to refit".to_owned();
    }
    let moved = legs.iter().filter_map(|(_, found)| found.as_ref());
    let most = moved.reduce(|a, b| if b.travel > a.travel { b } else { a });
    let travels = most.map_or(String::new(), |leg| {
        let [travel, enough] = [leg.travel, leg.enough()].map(|length| length * 1e6);
        format!(" (legs move by up to {travel:.3} um; a quarter of the stroke, {enough:.1} um, is enough)")
    });
    format!("no leg moves enough to determine a number{travels}: {}", advice(spec))
}

fn advice(spec: &Path) -> String {
    ADVICE.replace("SPEC", &spec.display().to_string())
}

/// The spec lines with the tables. Creep of the spec moves into tables with a read-out around them.
fn records_lines(model: &Model, folder: &str, shaped: bool) -> String {
    let creep = match &model.hysteresis.rate {
        RateDependence::Creep(_) if shaped => "rate = \"static\"  # remove creep_times and creep_weights\n",
        _ => "",
    };
    format!("[hysteresis]\n{}\n{creep}", records_line(folder))
}

/// The spec line with the mean delay of the legs that show one, if it differs; `old` is the lead now, s. A lead is at least
/// 0: legs that are even faster are named again by the same run.
fn lead_line(legs: &[Leg], old: f64) -> Option<String> {
    let known: Vec<LegRefit> =
        legs.iter().filter_map(|(_, found)| *found).filter(|found| found.delay.accepted).collect();
    if !known.iter().any(|found| found.differs()[1]) {
        return None;
    }
    let mean = known.iter().fold(0.0, |sum, found| sum + found.delay.change) / known.len() as f64;
    let lead = if old + mean > 0.0 { (old + mean) * 1e3 } else { 0.0 };
    Some(format!("[control]\nlead = \"{lead:.4} ms\"  # mean of the legs\n"))
}

/// Refitted legs.
#[derive(Serialize)]
struct Refits {
    #[serde(skip)]
    recording: String,
    /// Duration in which the law moved the legs, s.
    seconds: f64,
    /// In leg order; null for a leg that never moves.
    legs: Vec<Option<LegRefit>>,
    measured: MeasuredKeys,
    #[serde(skip)]
    lines: String,
    #[serde(skip)]
    files: String,
}

impl Refits {
    /// A sentence for each leg that no longer matches its model, or one for all.
    fn verdict(&self) -> String {
        let mut text = String::new();
        for (leg, found) in self.legs.iter().enumerate() {
            let Some(found) = found else { continue };
            let each = found.numbers().into_iter().zip(found.differs()).zip(NAMES);
            let differing: Vec<String> = each
                .filter(|((_, differs), _)| *differs)
                .map(|((number, _), (name, unit, size, digits))| {
                    format!("{name} {:+.digits$}{unit}", number.change * size)
                })
                .collect();
            if !differing.is_empty() {
                let held = found.differs()[0] && !found.cubic.accepted;
                let assumed = if held { ", cubic term assumed unchanged" } else { "" };
                text += &format!("leg {leg}: {} since identification{assumed}; refit\n", differing.join(", "));
            }
        }
        if text.is_empty() {
            text += "no leg is seen to differ from its model\n";
        }
        text
    }

    /// A line for each number that the run does not show of some legs.
    fn refusals(&self) -> String {
        let mut text = String::new();
        for (k, (name, unit, size, digits)) in NAMES.into_iter().enumerate() {
            let legs: Vec<(usize, Option<&LegRefit>)> = self
                .legs
                .iter()
                .enumerate()
                .map(|(leg, found)| (leg, found.as_ref()))
                .filter(|(_, found)| found.is_none_or(|found| !found.numbers()[k].accepted))
                .collect();
            if legs.is_empty() {
                continue;
            }
            let most = |of: &dyn Fn(&LegRefit) -> f64| {
                self.legs.iter().flatten().map(of).fold(0.0, |a, b| if b > a { b } else { a })
            };
            let of_leg = |found: &Option<&LegRefit>| found.map_or(f64::INFINITY, |found| found.numbers()[k].error);
            let worst = legs.iter().map(|(_, found)| of_leg(found)).fold(0.0, |a, b| if b > a { b } else { a });
            let known = if worst < 1e3 * size {
                let (up_to, required) = (worst * size, KNOWN * SPREAD[k] * size);
                format!("standard error up to {up_to:.digits$}{unit}, {required:.digits$}{unit} required")
            } else {
                "this run does not show it at all".to_owned()
            };
            let fix = match k {
                0 => {
                    format!("A motion over a quarter of the stroke, {:.1} um, shows it.", most(&LegRefit::enough) * 1e6)
                }
                1 => "A faster motion shows it.".to_owned(),
                _ => format!(
                    "The gain is that over the motion: a cubic term of {:.2} %, its usual spread, would read as up to {:.1} % of \
                     gain. A motion over most of the stroke shows it.",
                    SPREAD[2] * 1e2,
                    most(&|found| found.gain_per_cubic.abs()) * SPREAD[2] * 1e2
                ),
            };
            let numbers: Vec<String> = legs.iter().map(|(leg, _)| leg.to_string()).collect();
            text +=
                &format!("{name} of leg {}: not determined by this run, kept ({known}). {fix}\n", numbers.join(", "));
        }
        text
    }
}

fn error(number: &Number, size: f64, digits: usize) -> String {
    if number.error < 1e3 * size { format!("{:.digits$}", number.error * size) } else { "infinite".to_owned() }
}

impl Outcome for Refits {
    fn text(&self) -> String {
        let mut text =
            format!("{}: legs 0 to 5 relative to their models, from {:.3} s\n", self.recording, self.seconds);
        let columns = [4, 8, 7, 9, 8, 8, 7, 10, 9, 8].map(|width| right(width).behind(" "));
        row(
            &mut text,
            &columns,
            &[&"leg", &"gain %", &"±", &"delay ms", &"±", &"cubic %", &"±", &"travel µm", &"error nm", &"before"],
        );
        for (leg, found) in self.legs.iter().enumerate() {
            let Some(found) = found else { continue };
            let numbers = found.numbers();
            let shown = |k: usize| {
                let (_, _, size, digits) = NAMES[k];
                let digits = digits + 1;
                let change = if numbers[k].accepted {
                    format!("{:+.digits$}", numbers[k].change * size)
                } else {
                    "kept".to_owned()
                };
                (change, error(&numbers[k], size, digits))
            };
            let [gain, delay, cubic] = [shown(0), shown(1), shown(2)];
            let [after, before] = [found.residual_rms, found.residual_before].map(|rms| format!("{:.1}", rms * 1e9));
            let travel = format!("{:.3}", found.travel * 1e6);
            row(
                &mut text,
                &columns,
                &[&leg, &gain.0, &gain.1, &delay.0, &delay.1, &cubic.0, &cubic.1, &travel, &after, &before],
            );
        }
        text += &self.refusals();
        text += &self.verdict();
        if !self.lines.is_empty() {
            text += &format!("lines for the spec:\n{}{}", self.lines, self.measured.text());
        }
        text + &self.files
    }
}
