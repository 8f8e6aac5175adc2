//! The boards' images, unmodified, on the emulated board of `tests/board`: arm, run, wave, settings, record, replay; and faults.
//!
//! Four processes: the emulated board, `specgen plant` with the machine, `specgen operate` as host, and this.

mod commission;
mod faults;
mod session;
mod triggers;
mod wiring;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use serde_json::Value;
use specgen_language::model::{BOARDS, Model, Trigger, TriggerKind};
use specgen_language::{SpecSource, spec};
use specgen_toolchain::provision;

use session::{Host, Session};
use xtask::run::{Outcome, Report, cargo, expect_success};
use xtask::setup;

/// Its own workspace.
pub const MANIFEST: &str = "tests/board/Cargo.toml";
/// A package that a run needs, as arguments of cargo.
type Package = &'static [&'static str];
const TOOL: Package = &["--manifest-path", MANIFEST];
/// Together with the tests: alone, its dependencies would have other features than in their build, and be compiled again.
const SPECGEN: Package = &["--package", "specgen", "--package", "specgen-tests", "--bin", "specgen"];
/// Folder in which `tests/tests/boards.rs` keeps image and spec of each target.
const TESTED: &str = "target/tests/boards";
/// End of the record of a played motion, s after its command: rest and knots take half a second, then it moves.
const RECORD: f64 = 0.7;
/// Fewest edges of a record of triggers.
const LEAST_EDGES: usize = 4;
/// In the answer to `status`.
const STATUS: &str = "; status 0x";
const WAVE: &str = "ramp = 0.05\nseconds = 0.4\n[[axis]]\naxis = \"z\"\nshape = { kind = \"sine\", amplitude = 1e-6, frequency = 5.0 }\n";

/// Permitted ratio of the estimated to the observed longest tick.
const BAND: [f64; 2] = [1.0, 1.5];

/// An image, its spec, and the folder for the files of its run.
#[derive(Clone)]
struct Trial {
    spec: PathBuf,
    target: &'static str,
    image: PathBuf,
    folder: PathBuf,
    /// Folder of specgen and the tool.
    programs: PathBuf,
    /// Whether times come from the tool's cycle model; else one cycle per instruction.
    cycles: bool,
}

/// `cargo xtask board SPEC [--target BOARD] [--cycles | --commission | --faults [NAME]]`, or `--tested [--faults]` for the images that the
/// tests built; none if the arguments are something else.
pub fn command(root: &Path, arguments: &[&str]) -> Option<ExitCode> {
    let (arguments, only) = match arguments {
        [rest @ .., "--commission"] => (rest, true),
        all => (all, false),
    };
    let (arguments, with_faults, fault, cycles) = match arguments {
        [rest @ .., "--faults"] => (rest, true, None, false),
        [rest @ .., "--faults", name] if faults::is_known(name) => (rest, true, Some(*name), false),
        [rest @ .., "--cycles"] => (rest, false, None, true),
        all => (all, false, None, false),
    };
    let (spec, target) = match *arguments {
        ["--tested"] if !only => return Some(tested(root, with_faults)),
        [option, ..] if option.starts_with('-') => return None,
        [spec] => (spec, BOARDS[0].folder),
        [spec, "--target", name] => (spec, BOARDS.iter().find(|board| board.folder == name)?.folder),
        _ => return None,
    };
    let folder = built_in(root).join("board").join(target);
    let trial = Trial {
        spec: std::path::absolute(spec).unwrap_or_else(|_| spec.into()),
        target,
        image: folder.join(format!("controller/target/{target}.elf")),
        folder,
        programs: built_in(root).join("release"),
        cycles,
    };
    let mut report = Report::new(2 + usize::from(fault.is_none()) + usize::from(with_faults));
    report.step("the tool, the engine and specgen", || built(root, &[SPECGEN, TOOL]));
    report.step("the image", || image(&trial));
    if !report.has_failed() {
        if only {
            report.step("a part of a commissioning", || outcome(commission::run(&trial)));
        } else if let Some(name) = fault {
            report.step("a fault", || outcome(faults::run(&trial, Some(name))));
        } else {
            report.step("from boot to a record that replays", || outcome(run(&trial, false)));
            if with_faults {
                report.step("faults", || outcome(faults::run(&trial, None).and_then(|()| wiring::run(&trial))));
            }
        }
    }
    Some(report.finish())
}

fn tested(root: &Path, with_faults: bool) -> ExitCode {
    let mut report = Report::new(1);
    report.step("images on the emulated board", || {
        if with_faults { long(root) } else { each(root, &[SPECGEN, TOOL], |trial| run(trial, true)) }
    });
    report.finish()
}

/// The tests of the models of a board's parts.
fn models(root: &Path) -> Outcome {
    let mut test = cargo(root, &[&["test", "--release", "--quiet", "--locked"], TOOL].concat());
    test.arg("--target-dir").arg(built_in(root));
    expect_success(test, "see the test above")
}

/// For the full test run, with the estimate of a tick and faults. One image after the other, because hosts time out if a board gets half a processor.
pub fn long(root: &Path) -> Outcome {
    each(root, &[SPECGEN, TOOL], |trial| {
        run(trial, false)?;
        run(&Trial { cycles: true, ..trial.clone() }, false)?;
        faults::run(trial, None)?;
        wiring::run(trial)
    })
}

fn each(root: &Path, packages: &[Package], work: impl Fn(&Trial) -> Result<(), String>) -> Outcome {
    let prepared = match models(root) {
        Outcome::Passed => built(root, packages),
        failed => failed,
    };
    if !matches!(prepared, Outcome::Passed) {
        return prepared;
    }
    for target in BOARDS.map(|board| board.folder) {
        let folder = root.join(TESTED).join(target);
        let trial = Trial {
            spec: folder.join("platform.toml"),
            target,
            image: folder.join("image.elf"),
            folder,
            programs: built_in(root).join("release"),
            cycles: false,
        };
        if !trial.image.is_file() {
            return setup::missing(format!("{} is not there; the tests of the boards build it", trial.image.display()));
        }
        if let Err(why) = work(&trial) {
            return Outcome::Failed(why);
        }
    }
    Outcome::Passed
}

fn outcome(result: Result<(), String>) -> Outcome {
    result.map_or_else(Outcome::Failed, |()| Outcome::Passed)
}

/// Builds and installs what a run needs.
fn built(root: &Path, packages: &[Package]) -> Outcome {
    if let Err(error) = provision::engine(&mut |line| println!("{line}")) {
        return setup::missing(format!("{error}"));
    }
    for package in packages {
        let mut build = cargo(root, &[&["build", "--release", "--quiet", "--locked"][..], package].concat());
        // The same folder for both: the dependencies of the tool are in the workspace's.
        build.arg("--target-dir").arg(built_in(root));
        let outcome = expect_success(build, "see above");
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
    }
    Outcome::Passed
}

fn built_in(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from)
}

/// Builds the image. Assumed values of the spec are harmless on an emulated board.
fn image(trial: &Trial) -> Outcome {
    if let Err(error) = fs::create_dir_all(&trial.folder) {
        return Outcome::Failed(format!("{}: {error}", trial.folder.display()));
    }
    let mut build = Command::new(trial.programs.join("specgen"));
    build.arg("build").arg(&trial.spec).args(["--no-measure", "--assumed-ok", "--target", trial.target]);
    build.arg("-o").arg(trial.folder.join("controller"));
    expect_success(build, "see above")
}

/// The longest tick by the estimate of `specgen build`, µs.
fn estimated(trial: &Trial) -> Result<f64, String> {
    let mut build = Command::new(trial.programs.join("specgen"));
    build.arg("build").arg(&trial.spec).args(["--json", "--assumed-ok", "--target", trial.target]);
    build.arg("-o").arg(trial.folder.join("estimated"));
    let output = build.output().map_err(|error| format!("specgen build: {error}"))?;
    // A tick that is too long is refused, with its time.
    let answer: Value = serde_json::from_slice(&output.stdout).map_err(|error| format!("specgen build: {error}"))?;
    let worst = answer["result"]["measurement"]["time"]["worst"].as_f64();
    let printed = [&output.stdout[..], &output.stderr[..]].map(String::from_utf8_lossy);
    worst.ok_or_else(|| format!("specgen build estimates no tick: {}{}", printed[0], printed[1]))
}

/// Compares the estimate with the longest observed tick, whose times come from the same table: it must be an upper bound, but not a
/// loose one.
fn hold(trial: &Trial, report: &session::Report) -> Result<(), String> {
    let (worst, seen) = (estimated(trial)?, report.longest_tick().ok_or("the board reports no ticks")?);
    println!("{}: longest tick {seen:.1} us, {worst:.1} us by specgen build", trial.target);
    let [low, high] = BAND;
    if (low..=high).contains(&(worst / seen)) {
        Ok(())
    } else {
        Err(format!("{}: the estimate of a tick is {:.2} of what was seen", trial.target, worst / seen))
    }
}

/// From reset to a record, which is replayed; `brief` without wave and settings.
fn run(trial: &Trial, brief: bool) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", trial.folder.display());
    fs::create_dir_all(&trial.folder).map_err(failed)?;
    fs::write(trial.folder.join("wave.toml"), WAVE).map_err(failed)?;
    let mut session = Session::begin(trial)?;
    let motion = if brief { None } else { learnable(&trial.spec)? };
    let has_input = !brief && has_triggers(&trial.spec, |trigger| trigger.kind == TriggerKind::Input)?;
    let operated = operate(trial, &mut session, brief)
        .and_then(|()| if has_input { wait_for_edge(trial, &mut session) } else { Ok(()) })
        .and_then(|()| motion.as_ref().map_or(Ok(()), |motion| learn(trial, &mut session, motion)));
    // If the board has stopped, report the interrupted operation, too.
    let report = match (session.report(), &operated) {
        (Err(gone), Err(why)) => return Err(format!("{}: {why}; then {gone}", trial.target)),
        (report, _) => report?,
    };
    println!("{}: {}", trial.target, report.text);
    operated.map_err(|why| format!("{}: {why}", trial.target))?;
    if let Some(text) = report.violations.first() {
        return Err(format!("{}: against a data sheet: {text}", trial.target));
    }
    if report.value("resets") != Some(0.0) || report.value("enable") != Some(0.0) {
        return Err(format!("{}: expected amplifiers off and no reset", trial.target));
    }
    if trial.cycles {
        hold(trial, &report)?;
    }
    let log = std::mem::take(&mut session.log);
    drop(session);
    replay(trial, "run.rec", &["--csv", "run.csv"])?;
    if has_input {
        replay(trial, "edge.rec", &["--csv", "edge.csv"])?;
        let ticks = triggers::started(&trial.folder.join("edge.csv"))?;
        println!("{}: the input line rose in tick {}, what waited began in tick {}", trial.target, ticks[0], ticks[1]);
    }
    if !brief && has_triggers(&trial.spec, |trigger| trigger.kind != TriggerKind::Input)? {
        let edges = triggers::check(&trial.folder.join("run.csv"), &log)?;
        println!("{}: triggers, {edges} edges of pins in the ticks that the record has", trial.target);
        if edges < LEAST_EDGES {
            return Err(format!("{}: expected {LEAST_EDGES} edges of triggers and more", trial.target));
        }
    }
    if motion.is_none() {
        return Ok(());
    }
    replay(trial, "pass.rec", &["--csv", "pass.csv"])?;
    let table = fs::read_to_string(trial.folder.join("pass.csv")).map_err(failed)?;
    let corrected = corrected(&table);
    println!("{}: a pass on record, {corrected} ticks of it under a correction", trial.target);
    if corrected > 0 {
        Ok(())
    } else {
        Err(format!(
            "{}: no tick of pass.rec is under a correction; a computer that is busy lets it begin late",
            trial.target
        ))
    }
}

fn replay(trial: &Trial, record: &str, more: &[&str]) -> Result<(), String> {
    let mut replay = Command::new(trial.programs.join("specgen"));
    replay.current_dir(&trial.folder).args(["replay", record, "--spec"]).arg(&trial.spec).args(more);
    if replay.status().is_ok_and(|status| status.success()) {
        Ok(())
    } else {
        Err(format!("{}: {record} does not replay bit by bit, see above", trial.target))
    }
}

/// Rows of a record's table in which a correction is not zero.
fn corrected(table: &str) -> usize {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let is = |place: usize| names.get(place).is_some_and(|name| name.starts_with("correction["));
    lines
        .filter(|line| {
            line.split(',')
                .enumerate()
                .any(|(place, text)| is(place) && text.parse().is_ok_and(|value: f64| value != 0.0))
        })
        .count()
}

/// The model of a spec.
fn model(path: &Path) -> Result<Model, String> {
    let source = SpecSource::read(path).map_err(|finding| finding.message)?;
    spec::load(&source).0.ok_or_else(|| format!("{} is refused", path.display()))
}

/// Whether a spec has such a trigger.
fn has_triggers(path: &Path, such: impl Fn(&Trigger) -> bool) -> Result<bool, String> {
    Ok(model(path)?.task_space.is_some_and(|task| task.triggers.iter().any(such)))
}

/// A motion to learn.
struct LearnedMotion {
    name: String,
    /// Ticks of its record.
    record: u32,
    /// Error due to the gauges' noise, nm rms.
    noise: f64,
}

/// The first trajectory that a machine of this spec can learn, if its controller has a correction.
fn learnable(path: &Path) -> Result<Option<LearnedMotion>, String> {
    let model = model(path)?;
    let task = model.task_space.filter(|task| task.correction.is_some());
    let record = (RECORD / model.timing.period) as u32;
    let noise = model.sensor.noise * 1e9;
    Ok(task.and_then(|task| {
        task.trajectories.first().map(|first| LearnedMotion { name: first.name.clone(), record, noise })
    }))
}

/// Learns a motion over the link, on the host and in the background of the board. That must remove a large part of the error. Then
/// plays it with a record.
fn learn(trial: &Trial, session: &mut Session, motion: &LearnedMotion) -> Result<(), String> {
    let LearnedMotion { name: motion, record, noise } = motion;
    let room = if trial.target.ends_with("f4") { "768" } else { "4096" };
    for (who, more) in [("board", &["--on-device", room][..]), ("host", &[])] {
        let mut command = session.command_of(trial, "learn");
        command.args(["--trajectory", motion, "--machine", "emulated", "--passes", "2"]).args(more);
        command.args(["--output", "learned.json", "--json"]);
        let output = command.output().map_err(|error| format!("specgen learn: {error}"))?;
        let found: Value = serde_json::from_slice(&output.stdout).map_err(|error| format!("specgen learn: {error}"))?;
        let passes = found["result"]["passes"].as_array().ok_or_else(|| format!("specgen learn: {found}"))?;
        let errors: Vec<f64> = passes.iter().filter_map(|pass| pass["translation_nm"].as_f64()).collect();
        let best = found["result"]["best"].as_u64().ok_or_else(|| format!("specgen learn: {found}"))? as usize;
        println!(
            "{}: {motion}, learned by the {who}, passes of {errors:.1?} nm rms by the gauges; kept: pass {best}",
            trial.target
        );
        match (errors.first(), errors.get(best)) {
            (Some(first), Some(kept)) if *first < 2.0 * noise && *kept < 2.0 * noise => {
                println!(
                    "note: the error of {motion} is near the gauges' noise, {noise:.1} nm rms: there is nothing to learn"
                );
            }
            (Some(first), Some(kept)) if *kept < 0.7 * first => {}
            _ => return Err(format!("{motion} was not learned by the {who}")),
        }
    }
    let mut host = Host::of(session.command_of(trial, "operate"))?;
    let play =
        format!("record arm {record}\nrecord trigger\nplay {motion} correction=learned.json machine=emulated\nstatus");
    host.orders(&[
        ("arm\nwait holding 600\nrun\nwait running 600\nset command=0\nwait arrived 600\nstatus", ": running"),
        (&play, STATUS),
        ("record stop\nrecord download pass.rec", "wrote "),
        ("ramp-down\nwait disarmed 600\nstatus", "disarmed, amplifiers off"),
    ])?;
    Ok(())
}

/// Makes a move wait for the input line, then raises the line.
fn wait_for_edge(trial: &Trial, session: &mut Session) -> Result<(), String> {
    let mut host = Host::of(session.command_of(trial, "operate"))?;
    session.command("input low")?;
    host.orders(&[
        ("arm\nwait holding 600\nrun\nwait running 600\nwait arrived 600\nset command=hold\nstatus", ": running"),
        ("record arm 400\nrecord trigger\non-edge move z=0.2um\non-edge", "waits for the edge"),
    ])?;
    session.command("input high")?;
    session.pass(10.0)?;
    host.orders(&[
        ("on-edge", "begun at the edge of tick "),
        ("record stop\nrecord download edge.rec", "wrote "),
        ("ramp-down\nwait disarmed 600\nstatus", "disarmed, amplifiers off"),
    ])?;
    Ok(())
}

/// From arming to a record; times are the board's, ms. The record is short, because it is transferred over the link.
fn operate(trial: &Trial, session: &mut Session, brief: bool) -> Result<(), String> {
    let settings = format!("config write {}\nstatus", trial.spec.display());
    let mut host = Host::of(session.command_of(trial, "operate"))?;
    let whole = [
        ("status\narm\nwait holding 600\nrun\nwait running 600\nset command=0\nstatus", ": running", 200.0),
        ("record arm 300\nwave wave.toml\nstatus", STATUS, 60.0),
        (&settings, STATUS, 20.0),
        ("record trigger\nstatus", STATUS, 60.0),
    ];
    let short = [
        ("status\narm\nwait holding 600\nrun\nwait running 600\nset command=0\nstatus", ": running", 0.0),
        ("record arm 30\nrecord trigger\nstatus", STATUS, 10.0),
    ];
    let end = [
        ("record stop\nrecord download run.rec", "wrote ", 0.0),
        ("ramp-down\nwait disarmed 600\nstatus", "disarmed, amplifiers off", 0.0),
    ];
    let begin: &[(&str, &str, f64)] = if brief { &short } else { &whole };
    for &(orders, words, time) in begin.iter().chain(&end) {
        host.order(orders, words)?;
        session.pass(time)?;
    }
    Ok(())
}
