//! Helpers that the cross-crate tests share. The tests themselves are in `tests/tests/`.
//!
//! Controllers are emitted into `target/tests`, built there for the host and for the emulated microcontrollers, and executed
//! through their words: the tests use what a user gets.

pub mod cases;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use host_sim::controller::{Controller, TickController};
use host_sim::description::Description;
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::Noise;
use host_sim::trace::{Trace, first_difference};
use oracle::replay;
use oracle::stimulus::platform::{self as platform_stimulus, PlatformInputs};
use oracle::stimulus::{self, InputRecording, Setpoints};
use specgen::compile::{Compilation, compile, compile_source};
use specgen::diagnostic::Diagnostic;
use specgen::machine;
use specgen::model::Mcu;
use specgen::spec::SpecSource;
pub use specgen::target::skipped;
use specgen::target::{self, Image, ReplayResult};
use specgen::verify;
use specgen::workspace;
use specgen_runtime::Motion;

/// The repository.
pub fn repository() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}

/// A new folder of this process below `target/tests/scratch`, which the next complete test run empties. No other process writes there.
///
/// # Panics
/// If it cannot be created.
pub fn scratch(name: &str) -> PathBuf {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let number = MADE.fetch_add(1, Ordering::Relaxed);
    let folder = builds().join("scratch").join(std::process::id().to_string()).join(format!("{name}-{number}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("target is writable");
    folder
}

/// Folder of a board's image and spec, which are kept for later steps.
pub fn kept(board: &str) -> PathBuf {
    builds().join("boards").join(board)
}

/// Target folder for images. It is shared, so that common dependencies are compiled once, but not used by two tests at the same
/// time, because cargo would make one wait for the other.
pub fn image_target() -> PathBuf {
    builds().join(format!("build-{}", worker()))
}

/// Length of a test that benefits from more data: `short` normally, `long` if `SPECGEN_FULL` is set, as by `cargo xtask test --full`.
pub fn length<T>(short: T, long: T) -> T {
    if std::env::var_os("SPECGEN_FULL").is_some() { long } else { short }
}

/// Keys of `[control]`: active damping with the design that `specs/features/platform-damping.toml` stores. It is that of every spec
/// with the platform, period and lags of `specs/reference.toml`, so that tests do not search it again, which takes seconds.
///
/// # Panics
/// If that spec stores none.
pub fn active_damping() -> String {
    let text = fs::read_to_string(repository().join("specs/features/platform-damping.toml")).expect("a spec");
    let (_, design) = text.split_once("[control.design]\n").expect("a stored design");
    let keys = design.lines().map(|line| {
        let table = if line.starts_with(char::is_alphabetic) { "design." } else { "" };
        format!("\n{table}{line}")
    });
    std::iter::once("active_damping = true".to_owned()).chain(keys).collect()
}

/// Edit of the reference spec: with [`active_damping`].
pub fn damped() -> (&'static str, &'static str) {
    static DAMPED: OnceLock<String> = OnceLock::new();
    let notch = "notch_damping   = 1.0";
    (notch, DAMPED.get_or_init(|| format!("{notch}\n{}", active_damping())))
}

/// Motions of a platform with displacements and angles up to `size`, m and rad.
pub fn motions(count: usize, size: f64) -> Vec<Motion<f64>> {
    let mut state = 1_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    };
    let mut six = |scale: f64| -> [f64; 6] { std::array::from_fn(|_| scale * unit()) };
    (0..count).map(|_| Motion { pose: six(size), rate: six(0.1), acceleration: six(10.0) }).collect()
}

/// The larger of two errors. Unlike `f64::max` it keeps a NaN, which no bound admits.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}

fn builds() -> PathBuf {
    repository().join("target/tests")
}

/// A compiled spec, and its workspace on disk once a test asks for it.
pub struct Emitted {
    /// The compiled spec.
    pub compiled: Arc<Compilation>,
    name: String,
    dir: OnceLock<PathBuf>,
}

/// Folder in which workspaces are built one after the other. Cargo identifies crates by their path, so parts shared with the last
/// workspace, above all the runtime, are compiled once. Each worker of the test run has its own folder.
struct Stage {
    folder: PathBuf,
    _lock: fs::File,
}

impl Stage {
    /// Copies a workspace there. Unchanged files keep their modification time, which cargo uses.
    fn of(workspace: &Path) -> Self {
        let folder = builds().join(format!("stage-{}", worker()));
        fs::create_dir_all(&folder).expect("target is writable");
        let lock = fs::File::create(folder.join(".lock")).expect("target is writable");
        lock.lock().expect("a lock");
        let folder = folder.join("workspace");
        let (wanted, there) = (files(workspace), files(&folder));
        for (path, content) in &wanted {
            if there.get(path) != Some(content) {
                let path = folder.join(path);
                fs::create_dir_all(path.parent().expect("below the stage")).expect("target is writable");
                fs::write(path, content).expect("target is writable");
            }
        }
        for path in there.keys().filter(|path| !wanted.contains_key(*path)) {
            fs::remove_file(folder.join(path)).expect("target is writable");
        }
        Self { folder, _lock: lock }
    }
}

fn worker() -> String {
    std::env::var("SPECGEN_TEST_WORKER").unwrap_or_default()
}

/// Files below `dir` with their content, by path relative to it, except those built by cargo.
fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![dir.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().map_while(Result::ok) {
            let path = entry.path();
            if path.is_dir() {
                open.extend((path != dir.join("target")).then_some(path));
            } else {
                let name = path.strip_prefix(dir).expect("below it").to_owned();
                files.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    files
}

impl Emitted {
    /// Compiles a spec of `specs/` with `edits` (old text, new text). Its workspace gets a folder of this name.
    ///
    /// # Panics
    /// If an edit finds nothing to replace, or the spec is refused.
    pub fn new(name: &str, spec: &str, edits: &[(&str, &str)]) -> Self {
        Self::with_records(name, spec, edits, &[])
    }

    /// The same with further records: name, CSV text.
    ///
    /// # Panics
    /// As [`Emitted::new`].
    pub fn with_records(name: &str, spec: &str, edits: &[(&str, &str)], records: &[(&str, String)]) -> Self {
        // Tests of a module share specs.
        static COMPILED: Mutex<BTreeMap<String, Arc<Compilation>>> = Mutex::new(BTreeMap::new());
        let compiled = || COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
        let key = format!("{spec} {edits:?} {records:?}");
        let known = compiled().get(&key).cloned();
        let made = || Arc::new(compile_edited(name, spec, edits, records));
        let one = known.unwrap_or_else(made);
        compiled().insert(key, one.clone());
        Self::of(name, one)
    }

    /// The unchanged reference of `specs/`: its digest is that of `firmware/controller`.
    ///
    /// # Panics
    /// As [`Emitted::new`].
    pub fn reference(name: &str) -> Self {
        let path = repository().join("specs/reference.toml");
        let compiled = compile(&path).unwrap_or_else(|refused| panic!("{name} is refused: {:#?}", refused.findings));
        Self::of(name, compiled.into())
    }

    /// A compiled spec.
    pub fn of(name: &str, compiled: Arc<Compilation>) -> Self {
        Self { compiled, name: name.to_owned(), dir: OnceLock::new() }
    }

    /// The workspace, in a folder of its own.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn dir(&self) -> &Path {
        self.dir.get_or_init(|| {
            let dir = scratch(&self.name);
            workspace::write_scratch(&dir, &self.compiled.files()).expect("an empty folder");
            dir
        })
    }

    /// Checks packages of the workspace with `cargo check`; warnings are errors.
    ///
    /// # Panics
    /// If cargo cannot be run.
    pub fn check(&self, packages: &[&str]) -> Output {
        let stage = Stage::of(self.dir());
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["check", "--quiet"]).args(packages).current_dir(&stage.folder).env("RUSTFLAGS", "-D warnings");
        cargo.env("CARGO_TARGET_DIR", image_target().join("checked")).output().expect("cargo")
    }

    /// The emitted crate as a host library.
    ///
    /// # Panics
    /// If it does not build.
    pub fn library(&self) -> PathBuf {
        let stage = Stage::of(self.dir());
        target::host::build_library(&stage.folder, &image_target()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The emitted crate, loaded.
    ///
    /// # Panics
    /// If it does not build or load.
    pub fn controller(&self) -> Controller {
        Controller::load(&self.library()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The law with the constants of the compiled spec: the bits of [`Emitted::controller`] without a build.
    ///
    /// # Panics
    /// If the compiled spec cannot be run.
    pub fn at_run_time(&self) -> Controller {
        specgen::run_time::controller(&self.compiled.ir).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The emitted crate for a microcontroller; none, with a printed line, if tools are missing and not required.
    ///
    /// # Panics
    /// If it does not build.
    pub fn image(&self, mcu: Mcu) -> Option<Image> {
        target::found_or_skipped(target::available()).unwrap_or_else(|error| panic!("{error}"))?;
        let stage = Stage::of(self.dir());
        Some(target::build_image(&stage.folder, mcu, &image_target()).unwrap_or_else(|error| panic!("{error}")))
    }

    /// Input rows of every kind that may occur in a tick, for leg or pose set-points.
    ///
    /// # Panics
    /// If the controller lacks a word.
    pub fn stimulus(&self, description: &Description, pose: bool, rows: usize, seed: u64) -> InputRecording {
        let ir = &self.compiled.ir;
        let stroke = self.compiled.model.actuator.stroke;
        let setpoints = if pose {
            Setpoints::Pose { bounds: ir.bounds.pose, stroke }
        } else {
            let nodes = &ir.hysteresis.tables[0];
            let everett = (0..=ir.hysteresis.grid).map(|up| nodes[up * (up + 1) / 2..][..=up].to_vec()).collect();
            Setpoints::Leg { stroke, everett }
        };
        stimulus::record(description, &setpoints, rows, seed).expect("the controller has set-point and gauge words")
    }

    /// Input rows of every kind that may occur in a tick of a platform.
    ///
    /// # Panics
    /// If the controller is not one in task space.
    pub fn platform_stimulus(&self, description: &Description, rows: usize, seed: u64) -> InputRecording {
        let ir = &self.compiled.ir;
        let task = self.compiled.model.task_space.as_ref().expect("a controller in task space");
        let inputs = PlatformInputs {
            bounds: ir.bounds.pose,
            bias: task.setpoint.bias,
            period: ir.defaults.period,
            gauge: ir.bounds.sensor,
            trajectories: task.trajectories.len() as u32,
        };
        platform_stimulus::record(description, &inputs, rows, seed).expect("the words of a platform")
    }
}

/// Compiles a spec of `specs/` after edits of its text, with records in addition to those of `specs/records/`.
///
/// # Panics
/// If an edit finds nothing to replace, or the spec is refused.
pub fn compile_edited(name: &str, spec: &str, edits: &[(&str, &str)], more: &[(&str, String)]) -> Compilation {
    let specs = repository().join("specs");
    let mut text = fs::read_to_string(specs.join(spec)).expect("a spec of this repository");
    for (old, new) in edits {
        assert!(text.contains(old), "{spec} has no `{old}`");
        text = text.replace(old, new);
    }
    // Next to a copy of the records, as for a user: an unchanged spec gives the same controller in any folder.
    let scratch = scratch(name);
    let folder = scratch.join(Path::new(spec).parent().unwrap_or(Path::new("")));
    let records = scratch.join("records");
    for folder in [&folder, &records] {
        fs::create_dir_all(folder).expect("target is writable");
    }
    for record in fs::read_dir(specs.join("records")).expect("records").map_while(Result::ok) {
        fs::copy(record.path(), records.join(record.file_name())).expect("target is writable");
    }
    for (file, text) in more {
        fs::write(records.join(file), text).expect("target is writable");
    }
    let path = folder.join("platform.toml");
    fs::write(&path, text).expect("target is writable");
    compile(&path).unwrap_or_else(|refused| panic!("{name} is refused: {:#?}", refused.findings))
}

/// A spec of `specs/` after edits of its text, each at its first place.
///
/// # Panics
/// If there is no such spec, or an edit finds nothing to replace.
pub fn edited(spec: &str, edits: &[(&str, &str)]) -> String {
    let text = fs::read_to_string(repository().join("specs").join(spec)).expect("a spec of this repository");
    edits.iter().fold(text, |text, (old, new)| cases::replaced(&text, old, new))
}

/// Compiles a text as if it were in `specs/`.
///
/// # Errors
/// The findings, if it is refused.
pub fn compile_text(text: &str) -> Result<Compilation, Vec<Diagnostic>> {
    let (name, dir) = ("platform.toml".to_owned(), repository().join("specs"));
    let source = SpecSource { display_name: name, text: text.to_owned(), dir };
    compile_source(source).map_err(|refused| refused.findings)
}

/// The host's trace of recorded inputs, with the spec's settings except the named ones.
///
/// # Panics
/// If the controller has no such setting or refuses it.
#[must_use]
pub fn host_trace(controller: &mut Controller, settings: &[(&str, f64)], inputs: &InputRecording) -> (Trace, Vec<u64>) {
    let mut words = controller.default_config();
    for (name, value) in settings {
        controller.description().set_config(&mut words, name, *value).expect("a setting of the controller");
    }
    controller.configure(&words).expect("a permitted setting");
    (replay::replay(controller, inputs), words)
}

/// Replays the host's trace on an image: every word of every tick has the same bits.
///
/// # Panics
/// If the image does not run, or with `what` and the first word that differs.
pub fn assert_same_bits(what: &str, image: &Image, config: &[u64], host: &Trace) {
    let (target, _) = verify::replay(image, config, host).unwrap_or_else(|error| panic!("{error}"));
    let difference = first_difference(host, &target);
    assert!(difference.is_none(), "{what}, {:?}: {}", image.mcu, difference.expect("a difference"));
    println!("{what}, {:?}: {} ticks, no differing word", image.mcu, host.len());
}

/// Input, output and digest of a supervised tick.
pub type Row = (Vec<u64>, Vec<u64>, u64);

/// The first tick of a recorded machine in which output or digest of an image differ, and the other results of the image.
///
/// # Panics
/// If the image does not run.
pub fn machine_difference(image: &Image, config: &[u64], rows: &[Row]) -> (Option<usize>, ReplayResult) {
    let inputs: Vec<Vec<u64>> = rows.iter().map(|(input, ..)| input.clone()).collect();
    let result = target::replay_machine(image, config, &inputs, Duration::from_secs(600));
    let result = result.unwrap_or_else(|error| panic!("{error}"));
    assert!(result.outputs.len() == rows.len() && result.digests.len() == rows.len(), "a row each");
    let found = result.outputs.iter().zip(&result.digests);
    let differs = rows.iter().zip(found).position(|((_, output, digest), found)| (output, digest) != found);
    (differs, result)
}

/// The same, asserting that no tick differs.
///
/// # Panics
/// With `what` and the first tick that differs.
pub fn assert_same_machine(what: &str, image: &Image, config: &[u64], rows: &[Row]) -> ReplayResult {
    let (differs, result) = machine_difference(image, config, rows);
    assert_eq!(differs, None, "{what}: the first tick that differs");
    result
}

/// The simulated platform of a compiled spec, with these legs.
///
/// # Panics
/// If the spec is of six legs.
pub fn scenario(compiled: &Compilation, leg: &LegParameters, seed: u64) -> PlatformScenario {
    let task = compiled.model.task_space.as_ref().expect("a platform");
    let specimen = machine::specimen(&compiled.model, task, leg, Some(seed));
    machine::scenario(&compiled.model, task, &specimen, &Noise::of(&specimen), seed)
}

/// Three classes of legs: plays with creep, Bouc-Wen with creep over five decades, rate-dependent plays with the same creep.
pub fn leg_class(number: u64) -> LegParameters {
    let [plays, bouc_wen] = [LegParameters::reference(), LegParameters::bouc_wen()];
    match number % 3 {
        0 => plays,
        1 => bouc_wen,
        _ => LegParameters {
            kappa: 0.02,
            creep_rates_per_s: bouc_wen.creep_rates_per_s,
            creep_weights: bouc_wen.creep_weights,
            creep_thresholds_v: bouc_wen.creep_thresholds_v,
            ..plays
        },
    }
}

/// Numbers of an output word over a trace, by name.
///
/// # Panics
/// If the controller has no such word.
pub fn column(trace: &Trace, name: &str) -> Vec<f64> {
    let description = trace.description();
    let place = description.input_names.len() + description.output(name).expect("an output word");
    trace.rows().map(|row| description.scalar.decode(row[place])).collect()
}

/// Integers of an output word over a trace, by name.
///
/// # Panics
/// If the controller has no such word.
pub fn integers(trace: &Trace, name: &str) -> Vec<u64> {
    let description = trace.description();
    let place = description.input_names.len() + description.output(name).expect("an output word");
    trace.rows().map(|row| row[place]).collect()
}

/// Text files below `dir`, by path relative to it.
///
/// # Panics
/// If there are none, or one is not text.
pub fn sources(dir: &Path) -> BTreeMap<String, String> {
    let files = files(dir);
    assert!(!files.is_empty(), "no file in {}", dir.display());
    let text =
        |(path, content): (PathBuf, Vec<u8>)| (path.display().to_string(), String::from_utf8(content).expect("text"));
    files.into_iter().map(text).collect()
}
