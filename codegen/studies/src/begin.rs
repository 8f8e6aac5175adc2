//! A folder with a commented spec of the user's own platform and a simulated record of its legs, from some
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
use specgen_language::spec::{self, SpecSource, json_schema, quantity};

use crate::reversal_curves::{Experiment, simulate};
use draft::{Draft, Origin};
use questions::{QUESTIONS, Question};
use specgen_language::output::{write_folder, write_scratch};
use specgen_language::ui::Ui;

/// Name of the spec in its folder.
const SPEC: &str = "platform.toml";
/// For editors that know TOML schemas.
const SCHEMA: &str = "platform.schema.json";
/// The record that stands for measured ones.
const RECORD: &str = "leg.csv";
/// Sections of a spec whose gauges see the platform.
const TASK_SPACE: &[&str] = &["control", "gauge", "adaptation"];
/// Radius of the gauges beside that of the platform's joints.
const GAUGE_RADIUS: f64 = 0.8;
/// Range of a gauge that sees the platform, beside what it sees of the largest motion of one axis.
const GAUGE_ROOM: f64 = 1.06;
/// Declared workspace beside what an axis alone reaches.
const SHARE: f64 = 0.9;
/// Speed of streams: bounds of the workspace in a second.
const STREAM: f64 = 20.0;
/// Most that a stream covers in a tick, in bounds of the workspace.
const STALE_SHARE: f64 = 0.004;

// Keys that others are computed from.
const GEOMETRY: [&str; 3] = ["geometry.base_radius", "geometry.platform_radius", "geometry.height"];
const MASS: &str = "platform.mass";
const STROKE: &str = "actuator.stroke";
const VOLTAGE: &str = "actuator.voltage";
const STIFFNESS: &str = "actuator.axial_stiffness";
/// What the reach of the platform depends on, and what stands against it.
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

/// What was given, by the option of its question.
pub type Answers = BTreeMap<&'static str, String>;

/// Makes the folder with a spec, of six `legs` with gauges of their own or of a platform, and a simulated record. The rest of the
/// answers `is_asked` for.
///
/// # Errors
/// There is such a folder, an answer is wrong, or a file cannot be written.
pub fn run(folder: &Path, legs: bool, is_asked: bool, answers: &Answers, ui: &mut Ui) -> Result<(), Failure> {
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_free = !folder.exists() || std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
    if !is_free {
        let shown = folder.display();
        return Err(Failure::Usage(format!("`{shown}` is there already; give another name, or remove it")));
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
    // Whatever is wrong with it: the answers are not lost.
    files.push((SPEC.to_owned(), draft.text(name).into_bytes()));
    write_folder(folder, &files)?;
    report(folder, &draft, compiled, ui)
}

/// The spec as it stands, as if it lay at `place`.
fn source(draft: &Draft, name: &str, place: &Path) -> SpecSource {
    SpecSource { display_name: SPEC.to_owned(), text: draft.text(name), dir: place.to_owned() }
}

/// What is wrong with the value at `key`, if anything.
fn wrong(draft: &Draft, name: &str, place: &Path, key: &str) -> Option<Diagnostic> {
    let (_, findings) = spec::load_as_far(&source(draft, name, place));
    let blamed = |found: &Diagnostic| found.severity == Severity::Error && found.key.starts_with(key);
    findings.into_iter().find(blamed)
}

fn take_options(draft: &mut Draft, answers: &Answers, name: &str, place: &Path) -> Result<(), Failure> {
    if let Some(found) = wrong(draft, name, place, "name") {
        return Err(Failure::Usage(format!("{}; {}", found.message, found.help)));
    }
    let mut refused = Vec::new();
    for question in QUESTIONS {
        let Some(answer) = answers.get(question.option) else { continue };
        draft.set(question.key, questions::literal(question, answer), Origin::Given);
        compute(draft);
        if let Some(found) = wrong(draft, name, place, question.key) {
            refused.push(format!("--{} \"{answer}\": {}; {}", question.option, found.message, found.help));
        }
    }
    if refused.is_empty() { Ok(()) } else { Err(Failure::Usage(refused.join("\n"))) }
}

/// Asks on standard input for what was not given; an empty line takes the value in brackets.
fn ask_the_rest(draft: &mut Draft, name: &str, place: &Path) -> Result<(), Failure> {
    let open: Vec<&Question> = QUESTIONS.iter().filter(|one| one.asked && !draft.is_given(one.key)).collect();
    if open.is_empty() {
        return Ok(());
    }
    prompt("An empty line takes the value in brackets. Give numbers with their units.\n");
    prompt("Do six gauges see the platform, or has each leg its own? [platform] ");
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
            let Some(found) = wrong(&tried, name, place, question.key) else {
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

/// A line of standard input; where it has ended, an error that names what is `open`.
fn line(open: &[&Question]) -> Result<String, Failure> {
    let mut line = String::new();
    let read = io::stdin().read_line(&mut line).map_err(environment)?;
    // Nobody pressed the key that would end the line of the question.
    if read == 0 || !io::stdin().is_terminal() {
        prompt("\n");
    }
    if read == 0 {
        let names: Vec<String> = open.iter().map(|one| format!("--{}", one.option)).collect();
        return Err(Failure::Usage(format!(
            "standard input ended before all was answered; give {}, or take the rest from a spec by --like reference",
            names.join(", ")
        )));
    }
    Ok(line.trim().to_owned())
}

/// SI values of a literal, one or a list.
fn values(literal: &str) -> Vec<f64> {
    let plain = questions::plain(literal);
    plain.split(',').map(|text| quantity::parse(text.trim()).map_or(0.0, |found| found.value)).collect()
}

/// What follows from other values, where it was not given and they were.
fn compute(draft: &mut Draft) {
    let known = draft.clone();
    let value = |key: &str| values(&known.literal(key)).first().copied().unwrap_or(0.0);
    let volts = values(&draft.literal(VOLTAGE));
    let span = volts.last().unwrap_or(&0.0) - volts.first().unwrap_or(&0.0);
    let (stroke, mass, stiffness) = (value(STROKE), value(MASS), value(STIFFNESS));
    let [base, platform, height] = GEOMETRY.map(value);
    // Roughly: the joints of a leg stand 60 degrees apart.
    let leg = (height * height + base * base + platform * platform - base * platform).sqrt();
    // A thick disc.
    let disc = |factor: f64| format!("\"{} g mm^2\"", figures(mass * platform * platform * factor * 1e9, 3));
    let mm = |x: f64| format!("\"{} mm\"", figures(x * 1e3, 5));
    let um = |x: f64| format!("\"{} um\"", figures(x * 1e6, 3));
    let centre = format!("\"{} mm\"", figures(leg / 4.0 * 1e3, 2));
    let moved = mass / 6.0 + value("leg.extensible_mass");
    let resonance = format!("\"{} Hz\"", figures((stiffness / moved).sqrt() / core::f64::consts::TAU, 2));
    let dac_range = draft.literal(VOLTAGE);

    draft.compute("platform.inertia", &[MASS, GEOMETRY[1]], format!("[{0}, {0}, {1}]", disc(0.3), disc(0.5)));
    for [part, mass] in [["fixed", "leg.fixed_mass"], ["extensible", "leg.extensible_mass"]] {
        // A rod of half the leg.
        let inertia = value(mass) * (leg / 2.0) * (leg / 2.0) / 12.0;
        draft.compute(&format!("leg.{part}_center"), &GEOMETRY, centre.clone());
        draft.compute(&format!("leg.{part}_inertia"), &GEOMETRY, format!("\"{} g mm^2\"", figures(inertia * 1e9, 3)));
    }
    if span > 0.0 {
        // Rounded up: at the highest voltage the stack makes the whole stroke.
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
    // Until it is known what the legs reach: what any platform reaches, and gauges that see it.
    draft.compute("workspace.translation", REACH_FROM, format!("[\"1 um\", \"1 um\", {}]", um(stroke / 5.0)));
    draft.compute("workspace.rotation", REACH_FROM, "[\"1 urad\", \"1 urad\", \"1 urad\"]".to_owned());
    draft.compute("control.setpoint.bias", REACH_FROM, bias(stroke / 6.0));
    if draft.has("gauge[0].point") {
        draft.compute("sensor.range", REACH_FROM, format!("[{}, {}]", um(-2.0 * stroke), um(2.0 * stroke)));
    }
}

/// The bias of `z` m.
fn bias(z: f64) -> String {
    format!("[\"0 um\", \"0 um\", \"{} um\", \"0 urad\", \"0 urad\", \"0 urad\"]", figures(z * 1e6, 2))
}

/// `value` with so many significant digits, as people write it.
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
    // Powers of ten by the parser, so that the shortest decimal comes out.
    let read = |text: String| text.parse::<f64>().unwrap_or(value);
    let shown = format!("{value:e}");
    let power: i32 = shown.rsplit('e').next().and_then(|text| text.parse().ok()).unwrap_or(0);
    let exponent = power + 1 - digits;
    let value = read(format!("{}e{exponent}", to_whole(value / read(format!("1e{exponent}")))));
    if (1e-4..1e6).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// A record of one of these legs, simulated; none where the spec does not say what they are.
fn simulated_record(draft: &Draft, name: &str, place: &Path) -> Option<String> {
    let (model, _) = spec::load_as_far(&source(draft, name, place));
    Some(simulate(&model?, &Experiment::default()).to_csv())
}

/// Sets workspace, bias, speed of streams and range of the gauges to what the legs reach, where they were not given.
fn fit_workspace(draft: &mut Draft, name: &str, place: &Path) {
    let (Some(model), _) = spec::load_as_far(&source(draft, name, place)) else { return };
    let Ok(platform) = lower::platform(&model) else { return };
    let reach = reach::measure(&model, &platform, model.actuator.stroke, &[0.0; 6]);
    let mut bounds: [f64; 6] = core::array::from_fn(|axis| {
        let [low, high] = reach.axes[axis].from_middle;
        // z begins at the lower end of the strokes.
        SHARE * if axis == 2 { high } else { low.abs().min(high.abs()) }
    });
    if model.task_space.is_some() {
        // What a gauge sees of one axis alone is to stay in its range, with a little room.
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
    // Slow ticks: what goes by until a stream counts as stale stays small beside the workspace.
    let stream = STREAM.min(STALE_SHARE / model.timing.period);
    let speeds = [list(0..3, "mm/s", 1e3 * stream), list(3..6, "mrad/s", 1e3 * stream)];
    let from = [REACH_FROM, &["timing.period"]].concat();
    draft.compute("control.setpoint.stream_speed", &from, format!("[{}]", speeds.join(", ")));
}

/// A platform that was begun.
#[derive(Serialize)]
struct Begun {
    folder: String,
    files: [&'static str; 3],
    /// Paths of the values that nobody gave, as the spec names them.
    assumed: Vec<String>,
    /// What the legs reach; none where they do not hold a platform.
    reach: Option<Reach>,
    /// Commands to go on with.
    next: [String; 3],
}

impl Outcome for Begun {
    fn text(&self) -> String {
        let mut text = format!("{} is written, and its spec is good\n", self.folder);
        if let Some(reach) = &self.reach {
            let bounds = |axes: core::ops::Range<usize>, scale: f64| {
                let items = reach.axes[axes].iter().map(|axis| format!("±{}", figures(axis.declared * scale, 2)));
                items.collect::<Vec<_>>().join(", ")
            };
            text.push_str(&format!("  workspace {} µm and {} mrad from rest\n", bounds(0..3, 1e6), bounds(3..6, 1e3)));
        }
        text.push_str(&format!("  {} values are assumed: `assumed` in {SPEC} names them\n", self.assumed.len()));
        text.push_str(&format!("  {RECORD} is simulated: put a record of your legs in its place\nnext\n"));
        self.next.iter().for_each(|command| text.push_str(&format!("  {command}\n")));
        text
    }
}

/// Says what was written, whether it is good, and what to do next.
fn report(folder: &Path, draft: &Draft, compiled: Result<Compilation, Refusal>, ui: &mut Ui) -> Result<(), Failure> {
    let shown = folder.display().to_string();
    let spec = folder.join(SPEC);
    let check = shell::on("specgen check", &spec, "");
    let compiled = match compiled {
        Ok(compiled) => compiled,
        Err(refused) => {
            ui.findings(refused.source.as_ref(), &refused.findings);
            let message =
                format!("{shown} is written, but its spec is refused: change what is named above, then `{check}`");
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
    ui.result(&Begun { folder: shown, files, assumed: draft.assumed(), reach: compiled.reach, next });
    Ok(())
}
