//! Creates a folder with a commented spec of the user's own platform and a simulated record of its legs, from about
//! fifteen answers.

mod draft;
pub mod questions;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write as _};
use std::path::Path;

use serde::Serialize;
use specgen_compiler::compile::{self, Compilation};
use specgen_compiler::lower;
use specgen_compiler::reach::{self, Reach};
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::interrupt::Scratch;
use specgen_language::outcome::{Failure, Outcome, Refusal, environment};
use specgen_language::shell;
use specgen_language::spec::keys::{self, Item};
use specgen_language::spec::quantity::{self, Dimension};
use specgen_language::spec::{self, SpecSource, json_schema};

use crate::reversal_curves::{Experiment, simulate};
use draft::{Draft, Origin};
use questions::{QUESTIONS, Question};
use specgen_language::output::{write_folder, write_scratch};
use specgen_language::ui::Ui;

/// Name of the spec in its folder.
const SPEC: &str = "platform.toml";
/// JSON schema for editors that support it.
const SCHEMA: &str = "platform.schema.json";
/// A simulated record in place of measured ones.
const RECORD: &str = "leg.csv";
/// Spec sections of a platform whose gauges measure its pose.
const TASK_SPACE: &[&str] = &["control", "gauge", "adaptation"];
/// Radius of the gauges relative to that of the platform's joints.
const GAUGE_RADIUS: f64 = 0.8;
/// Range of a pose gauge relative to its largest reading for motion along a single axis.
const GAUGE_ROOM: f64 = 1.06;
/// Declared workspace relative to the reach of a single axis.
const SHARE: f64 = 0.9;
/// Stream speed: workspace bounds per second.
const STREAM: f64 = 20.0;
/// Largest stream step per tick, in workspace bounds.
const STALE_SHARE: f64 = 0.004;

// Keys that other values are computed from.
const GEOMETRY: [&str; 3] = ["geometry.base_radius", "geometry.platform_radius", "geometry.height"];
const MASS: &str = "platform.mass";
const STROKE: &str = "actuator.stroke";
const VOLTAGE: &str = "actuator.voltage";
const STIFFNESS: &str = "actuator.axial_stiffness";
/// What the reach of the platform depends on, and what limits it.
const REACH_FROM: &[&str] = &[
    GEOMETRY[0],
    GEOMETRY[1],
    GEOMETRY[2],
    "geometry.base_angle",
    "geometry.platform_angle",
    STROKE,
    "sensor.range",
    "workspace.translation",
    "workspace.rotation",
];

/// User-supplied values, by the option of their question.
pub type Answers = BTreeMap<&'static str, String>;

/// Creates the folder with a spec and a simulated record, for six `legs` with their own gauges or for a platform. If `is_asked`, prompts
/// for the missing answers.
///
/// # Errors
/// The folder exists, an answer is invalid, or a file cannot be written.
pub fn run(folder: &Path, legs: bool, is_asked: bool, answers: &Answers, ui: &mut Ui) -> Result<(), Failure> {
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_free = !folder.exists() || std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
    if !is_free {
        let shown = folder.display();
        return Err(Failure::Usage(format!("`{shown}` already exists; choose another name or remove it")));
    }
    let mut draft = Draft::default();
    if legs {
        draft.leave_out(TASK_SPACE);
    }
    let scratch = Scratch::new().map_err(environment)?;
    let place = scratch.path();
    take_options(&mut draft, answers, name, place)?;
    if is_asked {
        ask_the_rest(&mut draft, name, place)?;
    }
    compute(&mut draft);

    let mut files = vec![(SCHEMA.to_owned(), json_schema().into_bytes())];
    if let Some(record) = simulated_record(&draft, name, place) {
        write_scratch(&place.join(RECORD), record.as_bytes())?;
        files.push((RECORD.to_owned(), record.into_bytes()));
    }
    fit_workspace(&mut draft, name, place);
    let compiled = compile::compile_source(source(&draft, name, place));
    // Write the spec even if it is invalid, so that the answers are not lost.
    files.push((SPEC.to_owned(), draft.text(name).into_bytes()));
    write_folder(folder, &files)?;
    report(folder, &draft, compiled, ui)
}

/// The current spec, as if saved at `place`.
fn source(draft: &Draft, name: &str, place: &Path) -> SpecSource {
    SpecSource { display_name: SPEC.to_owned(), text: draft.text(name), dir: place.to_owned() }
}

/// The finding about the value at `key`, if any.
fn finding_at(draft: &Draft, name: &str, place: &Path, key: &str) -> Option<Diagnostic> {
    let (_, findings) = spec::load_as_far(&source(draft, name, place));
    let blamed = |found: &Diagnostic| found.severity == Severity::Error && found.key.starts_with(key);
    findings.into_iter().find(blamed)
}

fn take_options(draft: &mut Draft, answers: &Answers, name: &str, place: &Path) -> Result<(), Failure> {
    if let Some(found) = finding_at(draft, name, place, "name") {
        return Err(Failure::Usage(format!("{}; {}", found.message, found.help)));
    }
    let mut refused = Vec::new();
    for question in QUESTIONS {
        let Some(answer) = answers.get(question.option) else { continue };
        draft.set(question.key, questions::literal(question, answer), Origin::Given);
        compute(draft);
        if let Some(found) = finding_at(draft, name, place, question.key) {
            refused.push(format!("--{} \"{answer}\": {}; {}", question.option, found.message, found.help));
        }
    }
    if refused.is_empty() { Ok(()) } else { Err(Failure::Usage(refused.join("\n"))) }
}

/// Prompts on standard input for missing values; an empty line accepts the value in brackets.
fn ask_the_rest(draft: &mut Draft, name: &str, place: &Path) -> Result<(), Failure> {
    let open: Vec<&Question> = QUESTIONS.iter().filter(|one| one.asked && !draft.is_given(one.key)).collect();
    if open.is_empty() {
        return Ok(());
    }
    prompt("Press Enter to accept the value in brackets. Give numbers with their units.\n");
    prompt("Do six gauges measure the platform's pose, or does each leg have its own gauge? [platform] ");
    loop {
        match line(&open)?.as_str() {
            "" | "platform" => break,
            "leg" | "legs" => {
                draft.leave_out(TASK_SPACE);
                break;
            }
            _ => prompt("  expected `platform` or `legs`: "),
        }
    }
    for (at, question) in open.iter().enumerate() {
        compute(draft);
        loop {
            prompt(&format!("{} [{}] ", question.text, questions::plain(&draft.literal(question.key))));
            let answer = line(&open[at..])?;
            if answer.is_empty() {
                break;
            }
            let mut tried = draft.clone();
            tried.set(question.key, questions::literal(question, &answer), Origin::Given);
            compute(&mut tried);
            let Some(found) = finding_at(&tried, name, place, question.key) else {
                *draft = tried;
                break;
            };
            prompt(&format!("  {}\n  {}\n", found.message, found.help));
        }
    }
    Ok(())
}

fn prompt(text: &str) {
    let _ = write!(io::stderr(), "{text}");
    let _ = io::stderr().flush();
}

/// Reads a line of standard input; at its end, returns an error that names the `open` questions.
fn line(open: &[&Question]) -> Result<String, Failure> {
    let mut line = String::new();
    let read = io::stdin().read_line(&mut line).map_err(environment)?;
    // End the line of the question, since no Enter key did.
    if read == 0 || !io::stdin().is_terminal() {
        prompt("\n");
    }
    if read == 0 {
        let names: Vec<String> = open.iter().map(|one| format!("--{}", one.option)).collect();
        return Err(Failure::Usage(format!(
            "standard input ended before all questions were answered; give {}, or take the other values from a spec with --like reference",
            names.join(", ")
        )));
    }
    Ok(line.trim().to_owned())
}

/// SI values of a key, one or a list.
fn values(draft: &Draft, key: &str) -> Vec<f64> {
    let dimension = match keys::key(key).and_then(|known| known.item(key)) {
        Some(Item::Quantity { dimension, .. }) => dimension,
        _ => Dimension::NONE,
    };
    let plain = questions::plain(&draft.literal(key));
    plain.split(',').map(|text| quantity::parse_as(text.trim(), dimension).map_or(0.0, |found| found.value)).collect()
}

/// Computes dependent values that were not given, if their inputs were.
fn compute(draft: &mut Draft) {
    let known = draft.clone();
    let value = |key: &str| values(&known, key).first().copied().unwrap_or(0.0);
    let volts = values(draft, VOLTAGE);
    let span = volts.last().unwrap_or(&0.0) - volts.first().unwrap_or(&0.0);
    let (stroke, mass, stiffness) = (value(STROKE), value(MASS), value(STIFFNESS));
    let [base, platform, height] = GEOMETRY.map(value);
    // Roughly: the joints of a leg are 60 degrees apart.
    let leg = (height * height + base * base + platform * platform - base * platform).sqrt();
    // As a thick disc.
    let disc = |factor: f64| format!("\"{} g mm^2\"", figures(mass * platform * platform * factor * 1e9, 3));
    let mm = |x: f64| format!("\"{} mm\"", figures(x * 1e3, 5));
    let um = |x: f64| format!("\"{} um\"", figures(x * 1e6, 3));
    let centre = format!("\"{} mm\"", figures(leg / 4.0 * 1e3, 2));
    let moved = mass / 6.0 + value("leg.extensible_mass");
    let resonance = format!("\"{} Hz\"", figures((stiffness / moved).sqrt() / core::f64::consts::TAU, 2));
    let dac_range = draft.literal(VOLTAGE);

    draft.compute("platform.inertia", &[MASS, GEOMETRY[1]], format!("[{0}, {0}, {1}]", disc(0.3), disc(0.5)));
    for [part, mass] in [["fixed", "leg.fixed_mass"], ["extensible", "leg.extensible_mass"]] {
        // As a rod of half the leg's length.
        let inertia = value(mass) * (leg / 2.0) * (leg / 2.0) / 12.0;
        draft.compute(&format!("leg.{part}_center"), &GEOMETRY, centre.clone());
        draft.compute(&format!("leg.{part}_inertia"), &GEOMETRY, format!("\"{} g mm^2\"", figures(inertia * 1e9, 3)));
    }
    if span > 0.0 {
        // Rounded up, so that the stack reaches its full stroke at the highest voltage.
        let gain = format!("\"{} um/V\"", rounded_up(stroke * 1e6 / span, 4));
        draft.compute("actuator.stacks", &[STROKE, VOLTAGE], "1".to_owned());
        draft.compute("actuator.stack_gain", &[STROKE, VOLTAGE], gain);
        draft.compute("actuator.slew_rate", &[VOLTAGE], format!("\"{} V/ms\"", figures(0.4 * span, 2)));
    }
    draft.compute("actuator.resonance", &[MASS, STIFFNESS], resonance);
    draft.compute("dac.range", &[VOLTAGE], dac_range);
    let radius = GAUGE_RADIUS * platform;
    let (half, side) = (-radius / 2.0, radius * 0.75_f64.sqrt());
    let places = [[radius, 0.0], [half, side], [half, -side], [radius, 0.0], [-radius, 0.0], [0.0, radius]];
    for (index, [x, y]) in places.into_iter().enumerate() {
        let point = format!("[{}, {}, {}]", mm(x), mm(y), mm(height));
        draft.compute(&format!("gauge[{index}].point"), &GEOMETRY, point);
    }
    if !draft.has("gauge[0].point") {
        draft.set("sensor.range", format!("[{}, {}]", um(-0.05 * stroke), um(1.15 * stroke)), Origin::Computed);
    }
    // Initial values until the reach of the legs is known: within the reach of any platform, and with sufficient gauge range.
    draft.compute("workspace.translation", REACH_FROM, format!("[\"1 um\", \"1 um\", {}]", um(stroke / 5.0)));
    draft.compute("workspace.rotation", REACH_FROM, "[\"1 urad\", \"1 urad\", \"1 urad\"]".to_owned());
    draft.compute("control.setpoint.bias", REACH_FROM, bias(stroke / 6.0));
    if draft.has("gauge[0].point") {
        draft.compute("sensor.range", REACH_FROM, format!("[{}, {}]", um(-2.0 * stroke), um(2.0 * stroke)));
    }
}

/// A bias with `z` in m.
fn bias(z: f64) -> String {
    format!("[\"0 um\", \"0 um\", \"{} um\", \"0 urad\", \"0 urad\", \"0 urad\"]", figures(z * 1e6, 2))
}

/// `value` with the given number of significant digits, in plain notation.
fn figures(value: f64, digits: i32) -> String {
    rounded(value, digits, f64::round)
}

fn rounded_up(value: f64, digits: i32) -> String {
    rounded(value, digits, f64::ceil)
}

fn rounded_down(value: f64, digits: i32) -> String {
    rounded(value, digits, f64::floor)
}

fn rounded(value: f64, digits: i32, to_whole: impl Fn(f64) -> f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    // Parses powers of ten, so that the shortest decimal results.
    let read = |text: String| text.parse::<f64>().unwrap_or(value);
    let shown = format!("{value:e}");
    let power: i32 = shown.rsplit('e').next().and_then(|text| text.parse().ok()).unwrap_or(0);
    let exponent = power + 1 - digits;
    let value = read(format!("{}e{exponent}", to_whole(value / read(format!("1e{exponent}")))));
    if (1e-4..1e6).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// A simulated record of a leg; `None` if the spec is not complete enough.
fn simulated_record(draft: &Draft, name: &str, place: &Path) -> Option<String> {
    let (model, _) = spec::load_as_far(&source(draft, name, place));
    simulate(&model?, &Experiment::default()).first().map(|record| record.to_csv())
}

/// Fits workspace, bias, stream speed and gauge range to the reach of the legs, where they were not given.
fn fit_workspace(draft: &mut Draft, name: &str, place: &Path) {
    let (Some(model), _) = spec::load_as_far(&source(draft, name, place)) else { return };
    let Ok(platform) = lower::platform(&model) else { return };
    let reach = reach::measure(&model, &platform, model.actuator.stroke, &[0.0; 6]);
    let mut bounds: [f64; 6] = core::array::from_fn(|axis| {
        let [low, high] = reach.axes[axis].from_middle;
        // z counts from the lower end of the stroke.
        SHARE * if axis == 2 { high } else { low.abs().min(high.abs()) }
    });
    if model.task_space.is_some() {
        // A gauge must stay in range for motion along any single axis, with a little margin.
        let joint = model.geometry.platform_joints[0];
        let radius = GAUGE_RADIUS * (joint[0] * joint[0] + joint[1] * joint[1]).sqrt();
        let lever = [1.0, 1.0, 1.0, radius, radius, radius];
        if draft.is_given("sensor.range") {
            let [low, high] = model.sensor.range;
            for (bound, lever) in bounds.iter_mut().zip(lever) {
                *bound = bound.min(low.abs().min(high.abs()) / lever);
            }
        }
        let seen = bounds.iter().zip(lever).map(|(bound, lever)| bound * lever).fold(0.0, f64::max);
        let range = figures(GAUGE_ROOM * seen * 1e6, 2);
        draft.compute("sensor.range", REACH_FROM, format!("[\"-{range} um\", \"{range} um\"]"));
    }
    let list = |axes: core::ops::Range<usize>, unit: &str, scale: f64| {
        let items = bounds[axes].iter().map(|bound| format!("\"{} {unit}\"", rounded_down(bound * scale, 2)));
        items.collect::<Vec<_>>().join(", ")
    };
    draft.compute("control.setpoint.bias", REACH_FROM, bias(bounds[2] / 2.0));
    draft.compute("workspace.translation", REACH_FROM, format!("[{}]", list(0..3, "um", 1e6)));
    draft.compute("workspace.rotation", REACH_FROM, format!("[{}]", list(3..6, "mrad", 1e3)));
    // For slow ticks, limit the motion during the time until a stream counts as stale.
    let stream = STREAM.min(STALE_SHARE / model.timing.period);
    let speeds = [list(0..3, "mm/s", 1e3 * stream), list(3..6, "mrad/s", 1e3 * stream)];
    let from = [REACH_FROM, &["timing.period"]].concat();
    draft.compute("control.setpoint.stream_speed", &from, format!("[{}]", speeds.join(", ")));
}

/// Result of creating a platform.
#[derive(Serialize)]
struct NewPlatform {
    folder: String,
    files: [&'static str; 3],
    /// Paths in the spec of the values that the user did not give.
    assumed: Vec<String>,
    /// Reach of the legs; `None` if they cannot hold a platform.
    reach: Option<Reach>,
    /// Suggested next commands.
    next: [String; 3],
}

impl Outcome for NewPlatform {
    fn text(&self) -> String {
        let mut text = format!("wrote {}; its spec is valid\n", self.folder);
        if let Some(reach) = &self.reach {
            let bounds = |axes: core::ops::Range<usize>, scale: f64| {
                let items = reach.axes[axes].iter().map(|axis| format!("±{}", figures(axis.declared * scale, 2)));
                items.collect::<Vec<_>>().join(", ")
            };
            text.push_str(&format!("  workspace {} µm and {} mrad from rest\n", bounds(0..3, 1e6), bounds(3..6, 1e3)));
        }
        text.push_str(&format!("  {} values are assumed; `assumed` in {SPEC} lists them\n", self.assumed.len()));
        text.push_str(&format!("  {RECORD} is simulated: replace it with a record of your legs\nnext\n"));
        self.next.iter().for_each(|command| text.push_str(&format!("  {command}\n")));
        text
    }
}

/// Reports what was written, whether it is valid, and the next steps.
fn report(folder: &Path, draft: &Draft, compiled: Result<Compilation, Refusal>, ui: &mut Ui) -> Result<(), Failure> {
    let shown = folder.display().to_string();
    let spec = folder.join(SPEC);
    let check = shell::on("specgen check", &spec, "");
    let compiled = match compiled {
        Ok(compiled) => compiled,
        Err(refused) => {
            ui.findings(refused.source.as_ref(), &refused.findings);
            let message =
                format!("wrote {shown}, but its spec is refused: correct the findings above, then run `{check}`");
            return Err(Failure::Gate(message));
        }
    };
    ui.findings(Some(&compiled.source), &compiled.findings);
    let next = [
        check,
        shell::on("specgen sim", &spec, "--frequency 10"),
        shell::line("specgen").path(&spec).words("-o").path(folder.join("controller")).into(),
    ];
    let files = [SPEC, RECORD, SCHEMA];
    ui.result(&NewPlatform { folder: shown, files, assumed: draft.assumed(), reach: compiled.reach, next });
    Ok(())
}
