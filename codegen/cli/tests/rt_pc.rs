//! The real-time target as a user runs it: builds the emitted workspace, runs its binary in closed loop with `specgen plant`, operates
//! it over the link, and replays its records with the host library. The tests assert bits, and that every tick is accounted for, but
//! no times.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::support::{length, skipped};
use host_sim::controller::{Controller, Supervised, TickController};
use rustix::process::Signal;
use serde_json::Value;
use specgen::compile::Compilation;
use specgen::{compile, emit, target, workspace};
use specgen_link::{Bytes, RecorderAction, Refusal, Request, WaveAction};
use specgen_runtime::wave::{AxisWave, Settings, Shape, Tone, step_of};

mod aborts;
mod card;
mod clients;
mod commission;
mod edge;
mod gcs;
mod host;
mod learning;
mod panel;
mod samples;
mod stale;
mod stops;
mod wiring;
use host::{Host, Record};

/// Length of the platform's run, s, if not that of CI.
const SECONDS: &str = "SPECGEN_RT_SECONDS";

/// Phases of the supervisor, and its cause of a silent link.
const DISARMED: u8 = 0;
const RUNNING: u8 = 2;
const HOLDING: u8 = 3;
const FAULTED: u8 = 5;
const LINK_LOST: u8 = 9;
const HOST_GONE: u8 = 13;
/// Requests to the supervisor.
const NONE: u8 = 0;
const ARM: u8 = 1;
const RUN: u8 = 2;
const HOLD: u8 = 3;
const RAMP_DOWN: u8 = 4;
const ACKNOWLEDGE: u8 = 5;
/// Status bit of a platform: a motion is in progress.
const BUSY: u32 = 1 << 18;

/// The real-time program and the host library of a spec.
struct Programs {
    binary: PathBuf,
    library: PathBuf,
}

impl Programs {
    /// The programs of a spec, built once, because most tests use the same.
    fn of(spec: &Path) -> Arc<Self> {
        // Cargo's folder is kept between runs and shared by all specs, so that dependencies are compiled once. The programs have the same
        // name.
        static BUILT: Mutex<BTreeMap<PathBuf, Arc<Programs>>> = Mutex::new(BTreeMap::new());
        let mut built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
        built.entry(spec.to_owned()).or_insert_with(|| Arc::new(Self::built(spec))).clone()
    }

    fn built(spec: &Path) -> Self {
        let name = spec.file_name().unwrap().to_str().unwrap();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rt-pc-of").join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let (root, compiled, _one) = staged(spec);
        let binary = folder.join("rt-pc");
        fs::copy(cargo(&root, "build").join("release/rt-pc"), &binary).unwrap();
        // From the workspace of the main job, whose library is taken from the build cache.
        let plain = folder.join("workspace");
        workspace::write_scratch(&plain, &compiled.files()).unwrap();
        let library = target::host::build_library(&plain, &plain.join("target")).unwrap();
        Self { binary, library }
    }
}

/// Builds or tests the program of a workspace with cargo. Returns the shared target folder.
fn cargo(workspace: &Path, verb: &str) -> PathBuf {
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rt-pc");
    let mut command = Command::new("cargo");
    command.args([verb, "--release", "--locked", "--quiet", "--features", "comedi"]);
    command.arg("--target-dir").arg(&kept).current_dir(workspace.join("rt-pc"));
    for leak in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR"] {
        command.env_remove(leak);
    }
    // Fat link-time optimisation would take longer than everything else.
    command.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
    command.env("CARGO_PROFILE_RELEASE_DEBUG", "0");
    let output = command.output().unwrap();
    let printed = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "cargo {verb}: {}", printed.join("\n"));
    kept
}

/// The workspace of a spec, at the same path for all specs, so that cargo recompiles only crates with changed files. While the guard
/// lives, no other spec is written there.
fn staged(spec: &Path) -> (PathBuf, Compilation, MutexGuard<'static, ()>) {
    static ONE: Mutex<()> = Mutex::new(());
    let one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let compiled = compile::compile(spec).unwrap_or_else(|_| panic!("{} compiles", spec.display()));
    let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &["rt-pc"]);
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rt-pc-of/workspace");
    let mut open = vec![root.clone()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().map(Result::unwrap) {
            let path = entry.path();
            let name = path.strip_prefix(&root).unwrap().to_str().unwrap();
            if path.is_dir() {
                open.extend((name != "target").then_some(path));
            } else if !files.contains_key(name) {
                fs::remove_file(&path).unwrap();
            }
        }
    }
    for (name, text) in files {
        let path = root.join(name);
        if fs::read_to_string(&path).is_ok_and(|there| there == text) {
            continue;
        }
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    (root, compiled, one)
}

/// Only for the reference: some of these tests need features that other specs lack.
#[test]
#[ignore = "long: the program compiled once more"]
fn the_tests_of_the_program_itself_pass() {
    let (root, _, _one) = staged(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml"));
    cargo(&root, "test");
}

/// Programs of a spec and a running machine, with a separate folder.
struct Bench {
    programs: Arc<Programs>,
    folder: tempfile::TempDir,
    plant: Child,
    name: String,
    spec: PathBuf,
}

impl Bench {
    /// For a spec of this repository.
    fn new(spec: &str) -> Self {
        Self::of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs").join(spec))
    }

    /// For a spec of this repository, with a name for its machine.
    fn named(spec: &str, name: &str) -> Self {
        Self::with(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs").join(spec), name)
    }

    fn of(spec_file: &Path) -> Self {
        let name = spec_file.file_stem().unwrap().to_str().unwrap();
        Self::with(spec_file, name)
    }

    fn with(spec: &Path, name: &str) -> Self {
        let programs = Programs::of(spec);
        let name = format!("test-{name}-{}", std::process::id());
        // With real-time priority if permitted, because other tests use the processors, too.
        let plant = |more: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
            command.args(["plant", spec.to_str().unwrap(), "--name", &name]).args(more);
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        };
        let granted = Command::new("chrt").args(["-f", "50", "true"]).stderr(Stdio::null()).status();
        let plant = plant(if granted.is_ok_and(|status| status.success()) { &["--priority", "50"] } else { &[] });
        let place = Path::new("/dev/shm").join(format!("specgen-plant-{name}"));
        wait_for("the machine", || place.exists());
        Self { programs, folder: tempfile::tempdir().unwrap(), plant, name, spec: spec.to_owned() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The binary on the simulated machine, recording to `record`.
    fn command(&self, record: &str) -> Command {
        // With any umask, nobody else may connect.
        let mut command = Command::new("sh");
        command.args(["-c", "umask 0; exec \"$@\"", "sh"]).arg(&self.programs.binary);
        command.args(["--sim", &self.name, "--allow-no-rt", "--json", "--record"]).arg(self.path(record));
        command
    }

    /// The host's own build of the same controller.
    fn machine(&self) -> Supervised {
        Supervised::new(Controller::load(&self.programs.library).unwrap())
    }

    /// Checks what holds for every run, independent of the machine's motion and the load of this computer.
    fn check(&self, output: &Output, record: &str) -> (Value, Record) {
        let text = String::from_utf8_lossy(&output.stdout);
        let summary: Value = serde_json::from_str(&text).unwrap_or_else(|error| {
            panic!("{error}: {text}\n{}", String::from_utf8_lossy(&output.stderr));
        });
        let count = |key: &str| summary[key].as_u64().unwrap();
        assert_eq!(summary["balances"], true, "{text}");
        assert_eq!(count("planned"), count("on_time") + count("late") + count("skipped"), "{text}");
        let causes = summary["causes"].as_array().unwrap();
        let sum = |key: &str| causes.iter().map(|cause| cause[key].as_u64().unwrap()).sum::<u64>();
        assert_eq!((sum("late"), sum("skipped")), (count("late"), count("skipped")), "every one has a cause: {text}");
        assert_eq!((count("allocations"), count("waiting_ticks"), count("lost_rows")), (0, 0, 0), "{text}");
        let record = Record::new(fs::read(self.path(record)).unwrap());
        assert_eq!(record.rows.len() as u64, count("on_time") + count("late"), "a row for every tick that was run");
        // Only a tick after skipped ones reports them.
        let events = record.place("events");
        let missed = record.rows.iter().filter(|row| row.input[events] & 1 == 1).count() as u64;
        assert!(missed <= count("skipped") && (missed > 0) == (count("skipped") > 0), "{missed}: {text}");
        let replay = record.replay(&mut self.machine());
        assert_eq!((&replay.divergence, replay.gaps.len(), replay.digests), (&None, 0, record.rows.len() as u64));
        (summary, record)
    }

    /// Replays a record with the command.
    fn replay(&self, record: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg("replay").arg(self.path(record)).arg("--spec").arg(&self.spec).output().unwrap()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = self.plant.kill();
        let _ = self.plant.wait();
        let _ = fs::remove_file(Path::new("/dev/shm").join(format!("specgen-plant-{}", self.name)));
    }
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let start = Instant::now();
    while !there() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what} does not appear");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn signal(process: &Child, name: Signal) {
    crate::support::send(name, process.id());
}

/// A process that runs until it is asked to end, or until the test fails.
struct ProcessGuard(Option<Child>);

impl ProcessGuard {
    fn new(command: &mut Command) -> Self {
        Self(Some(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()))
    }

    /// Whether it is still running.
    fn goes_on(&mut self) -> bool {
        self.0.as_mut().unwrap().try_wait().unwrap().is_none()
    }

    /// Sends a signal and waits for the end.
    fn end(mut self, name: Signal) -> Output {
        assert!(self.goes_on(), "it runs until it is asked to end");
        signal(self.0.as_ref().unwrap(), name);
        self.wait()
    }

    /// Waits for the end.
    fn wait(mut self) -> Output {
        self.0.take().unwrap().wait_with_output().unwrap()
    }
}

impl Drop for ProcessGuard {
    fn drop(&mut self) {
        if let Some(running) = &mut self.0 {
            let _ = running.kill();
            let _ = running.wait();
        }
    }
}

#[test]
fn a_platform_runs_its_trajectory_in_closed_loop_and_its_record_replays_to_the_bit() {
    let bench = Bench::new("reference.toml");
    let seconds = length(1.0, 2.5);
    let seconds: f64 = std::env::var(SECONDS).map_or(seconds, |text| text.parse().expect("a number of seconds"));
    let output =
        bench.command("a.rec").args(["--seconds", &seconds.to_string(), "--set", "command=3"]).output().unwrap();
    let (summary, record) = bench.check(&output, "a.rec");
    // At 10 kHz; the ramp-down follows.
    assert!(summary["planned"].as_f64().unwrap() > 1e4 * (seconds - 0.1), "{summary}");
    println!("{summary:#}");
    println!("{} ticks replayed on the host, outputs and digests equal to the bit", record.rows.len());
    assert_eq!(output.status.code(), Some(i32::from(!summary["failure"].is_null())), "{summary}");

    // One changed bit is detected.
    let good = bench.replay("a.rec");
    assert!(good.status.success() && String::from_utf8_lossy(&good.stdout).contains("bit-equal"), "{good:?}");
    fs::write(bench.path("flipped.rec"), record.flipped()).unwrap();
    let bad = bench.replay("flipped.rec");
    let (text, tick) = (String::from_utf8_lossy(&bad.stderr), record.rows.len() - 1);
    assert!(
        bad.status.code() == Some(1) && text.contains(&format!("tick {tick}")) && text.contains("dac_code[0]"),
        "{bad:?}"
    );

    a_host_arms_it_over_the_link_makes_a_wave_and_is_missed(&bench);
    a_card_is_read_driven_and_switched_off(&bench);
    card::contacts_stop_the_machine(&bench);
    if length(true, false) {
        return skipped(
            "only in the full run: several clients, clients of the bridge at length, the end of the heartbeat, hosts that look on, a \
             full disk, a machine whose memory is taken away",
        );
    }
    clients::nobody_keeps_others_from_ramping_down(&bench);
    gcs::clients_move_it_and_none_disturbs_it(&bench);
    card::a_heartbeat_ends_with_the_process(&bench);
    samples::hosts_look_on_and_are_no_burden(&bench);
    a_record_that_finds_no_room_brings_the_machine_down(&bench);
    card::shared_memory_that_becomes_shorter_ends_nobody(bench);
}

/// With elastic time, so that it runs on any computer.
fn a_host_arms_it_over_the_link_makes_a_wave_and_is_missed(bench: &Bench) {
    let link = bench.path("link");
    let mut command = bench.command("b.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "1000", "--link"]).arg(&link);
    command.arg("--capture").arg(bench.path("capture.rec"));
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    assert_eq!(fs::metadata(&link).unwrap().permissions().mode() & 0o777, 0o600);

    let mut host = Host::open(&link, 1).unwrap();
    let machine = bench.machine();
    let description = host.fetch(|offset| Request::Describe { offset });
    // The host library adds its own sizes to it.
    assert!(machine.controller().text().as_bytes().starts_with(&description) && description.len() > 100);
    host.wait("a tick", |status| status.tick > 0 && status.phase == DISARMED);
    for request in [Request::LockstepReset { config: Bytes(&[]) }, Request::LockstepStage { index: 0 }] {
        assert_eq!(host.refused(&request), Refusal::Unsupported);
    }
    assert_eq!(host.refused(&Request::Supervise { request: 7 }), Refusal::Word { index: 0 });
    let command = vec![0; 8 * machine.input_names().iter().position(|name| name == "gauge[0]").unwrap()];
    assert_eq!(host.refused(&Request::Setpoint { words: Bytes(&command[8..]) }), Refusal::Length { expected: 21 });

    host.done(&Request::Supervise { request: ARM });
    host.wait("armed", |status| status.phase == HOLDING);
    // Others may query and request a hold, but only this host is in control.
    let mut other = Host::open(&link, 2).unwrap();
    assert_eq!(other.refused(&Request::Supervise { request: RUN }), Refusal::Busy);
    assert_eq!(other.refused(&Request::Setpoint { words: Bytes(&command) }), Refusal::Busy);
    other.done(&Request::Supervise { request: HOLD });
    host.done(&Request::Supervise { request: RUN });
    host.wait("at its bias pose", |status| status.phase == RUNNING && status.status & BUSY == 0);

    // Settings are replaced all at once or not at all.
    let mut config = host.config();
    assert_eq!(config, machine.controller().default_config());
    let bytes = |words: &[u64]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let mode = machine.controller().description().config_names.iter().position(|name| name == "mode").unwrap();
    config[mode] = 99;
    assert_eq!(
        host.refused(&Request::WriteConfig { words: Bytes(&bytes(&config)) }),
        Refusal::Word { index: mode as u16 }
    );
    config[mode] = 5;
    host.done(&Request::WriteConfig { words: Bytes(&bytes(&config)) });
    assert_eq!(host.config(), config);

    // A wave of 1 µm along z.
    let mut wave = Settings::<f64>::still();
    let tone = Tone { amplitude: 1e-6, phase: 0, step: step_of(20.0, 1e-4) };
    wave.axes[2] = AxisWave { offset: 0.0, shape: Shape::Sine { tone } };
    (wave.ramp_ticks, wave.ticks) = (500, 4000);
    let start = |wave: &Settings<f64>| bytes(&wave.to_words());
    let mut wide = wave;
    wide.axes[2].offset = 1.0;
    let request = |words| Request::Wave { action: WaveAction::Start, words: Bytes(words) };
    let words = start(&wide);
    assert_eq!(host.refused(&request(&words)), Refusal::Word { index: 6 + 7 * 2 + 1 });
    let words = start(&wave);
    host.done(&request(&words));
    assert_eq!(host.refused(&request(&words)), Refusal::State, "one wave at a time");
    assert_eq!(host.refused(&Request::Setpoint { words: Bytes(&command) }), Refusal::State);
    let tick = host.status().tick;
    host.wait("the wave", |status| status.tick > tick + 1000);

    // The record since power-up equals the file that it writes.
    assert_eq!(host.refused(&Request::Download { offset: 0 }), Refusal::State, "it records");
    let standing = host.recorder(RecorderAction::Look);
    assert!(standing.running && !standing.triggered && standing.ticks > 1000, "{standing:?}");
    host.recorder(RecorderAction::Arm { after: 1000 });
    host.wait("rows before the trigger", |status| status.tick > tick + 2000);
    host.recorder(RecorderAction::Trigger);
    wait_for("the end of the recording", || !host.recorder(RecorderAction::Look).running);
    let standing = host.recorder(RecorderAction::Look);
    let download = Record::new(host.fetch(|offset| Request::Download { offset }));
    assert!(
        standing.triggered && standing.ticks > 1000 && download.rows.len() == standing.ticks as usize,
        "{standing:?}"
    );
    assert_eq!(fs::read(bench.path("capture.rec")).unwrap(), download.bytes);
    let replay = download.replay(&mut bench.machine());
    assert_eq!((&replay.divergence, replay.triggers.len(), replay.ticks), (&None, 1, u64::from(standing.ticks)));
    host.recorder(RecorderAction::Arm { after: 1 });

    // Set-points are accepted again after the wave.
    host.wait("the end of the wave", |status| status.tick > tick + 6000);
    host.done(&Request::Setpoint { words: Bytes(&command) });

    // Invalid frames are counted, however long. A killed host is lost, and then another can take control.
    host.line().write_all(&[1, 2, 3, 0, 255, 255, 0]).unwrap();
    host.line().write_all(&[&[7; 5000][..], &[0]].concat()).unwrap();
    assert!(host.status().link.errors() >= 3);
    drop(host);
    other.wait("the loss", |status| (status.phase, status.cause) == (HOLDING, LINK_LOST));
    other.done(&Request::Supervise { request: RAMP_DOWN });
    // With a cause it ends in the faulted phase, until that is acknowledged.
    other.wait("the way down", |status| {
        (status.phase, status.cause, status.amplifier_on) == (FAULTED, LINK_LOST, false)
    });
    for request in [NONE, ACKNOWLEDGE] {
        other.done(&Request::Supervise { request });
    }
    other.wait("the acknowledgement", |status| status.phase == DISARMED);
    let output = running.end(Signal::TERM);
    let (summary, record) = bench.check(&output, "b.rec");
    assert_eq!((&summary["last_phase"], &summary["skipped"]), (&"Disarmed".into(), &0.into()), "{summary}");
    assert_eq!((output.status.code(), &summary["link"]["hosts"]), (Some(1), &2.into()), "{summary}");
    assert!(
        summary["link"]["errors"].as_u64().unwrap() >= 3 && summary["failure"].as_str().unwrap().contains("link lost")
    );
    let [setpoint, command] = ["setpoint[2]", "command"].map(|name| record.place(name));
    let waved = record.rows.iter().filter(|row| row.input[command] == 1);
    let highest = waved.clone().map(|row| f64::from_bits(row.input[setpoint])).fold(0.0, f64::max);
    assert!(waved.count() == 4000 && (highest - 1e-6).abs() < 1e-9, "{highest:e}");
    assert_eq!(record.rows.last().unwrap().supervisor >> 16, 0, "amplifiers off in the last tick");
    assert!(record.rows.iter().any(|row| row.supervisor >> 8 & 0xff == u32::from(LINK_LOST)));
}

/// A limit on file sizes acts like a full disk.
fn a_record_that_finds_no_room_brings_the_machine_down(bench: &Bench) {
    let script = "ulimit -f 800; trap '' XFSZ; exec \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", script, "sh"]).arg(&bench.programs.binary).args([
        "--sim",
        &bench.name,
        "--allow-no-rt",
        "--json",
    ]);
    command.args(["--elastic", "--sim-timeout", "5000", "--set", "command=3", "--record"]).arg(bench.path("cut.rec"));
    let output = command.output().unwrap();
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let failure = summary["failure"].as_str().unwrap();
    assert!(
        output.status.code() == Some(1) && failure.contains("cut.rec: the record is incomplete: File too large"),
        "{summary}"
    );
    assert_eq!((&summary["last_phase"], &summary["lost_rows"]), (&"Disarmed".into(), &0.into()), "{summary}");
    let cut = bench.replay("cut.rec");
    let text = String::from_utf8_lossy(&cut.stdout);
    assert!(
        cut.status.success() && text.contains("the file ends within a block") && text.contains("bit-equal"),
        "{cut:?}"
    );
}

/// Outputs of two cards.
const TWO_CARDS: [&str; 4] = ["--comedi-out", "/dev/fake1", "--comedi-out", "/dev/fake2"];

/// A library of cards with constant inputs; built once for a bench.
fn fake_comedi(bench: &Bench) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rt_pc/fake_comedi.rs");
    let library = bench.path("libcomedi.so");
    if library.exists() {
        return library;
    }
    let built =
        Command::new("rustc").args(["--edition=2024", "--crate-type=cdylib", "-o"]).arg(&library).arg(source).output();
    let built = built.unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    library
}

/// A short run on the cards, with assumed values accepted.
fn on_card(bench: &Bench, library: &Path, variables: &[(&str, &str)], arguments: &[&str]) -> Output {
    on_card_as_it_is(bench, library, variables, &[&["--assumed-ok"], arguments].concat())
}

fn on_card_as_it_is(bench: &Bench, library: &Path, variables: &[(&str, &str)], arguments: &[&str]) -> Output {
    let mut command = Command::new(&bench.programs.binary);
    command.args(["--allow-no-rt", "--json", "--seconds", "0.4", "--arm", "--comedi-library"]).arg(library);
    command.args(["--comedi", "/dev/fake1"]).args(arguments).arg("--record").arg(bench.path("card.rec"));
    command.env("FAKE_LOG", bench.path("card.log")).envs(variables.iter().copied()).output().unwrap()
}

/// The same binary with a fake comedilib.
fn a_card_is_read_driven_and_switched_off(bench: &Bench) {
    let library = fake_comedi(bench);
    let run = |variables: &[(&str, &str)], arguments: &[&str]| on_card(bench, &library, variables, arguments);
    // Whether the amplifiers were ever requested on.
    let was_on = |record: &Record| record.rows.iter().any(|row| row.supervisor >> 16 & 1 == 1);
    let log = || {
        let text = fs::read_to_string(bench.path("card.log")).unwrap();
        let field = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).unwrap().to_owned();
        let numbers =
            ["reads=", "writes1=", "writes2=", "lowest=", "highest="].map(|key| field(key).parse::<u64>().unwrap());
        (numbers, field("line="), field("directions=") == "0:1,2:0,3:0,1:1" && field("bad=").is_empty())
    };

    // The spec has assumed values and a simulated record, so no card is opened.
    let unasked = on_card_as_it_is(bench, &library, &[], &TWO_CARDS);
    let text = String::from_utf8_lossy(&unasked.stderr);
    let named = ["actuator.axial_stiffness", "records/reference-forc.csv (simulated)", "--assumed-ok"];
    assert!(unasked.status.code() == Some(1) && named.iter().all(|name| text.contains(name)), "{text}");
    assert!(!bench.path("card.log").exists() && !bench.path("card.rec").exists());
    let two = TWO_CARDS;
    let output = run(&[], &two);
    let (_, record) = bench.check(&output, "card.rec");
    let ([reads, first, second, _, highest], line, sound) = log();
    let ticks = record.rows.len() as u64;
    assert_eq!(reads, 6 * ticks);
    assert_eq!((first, second), (4 * ticks, 2 * ticks));
    assert!(sound && highest <= 43_690);
    let text = fs::read_to_string(bench.path("card.log")).unwrap();
    assert!(text.contains(&format!("\nbeats={ticks}\n")), "a beat a tick: {ticks}, {text}");
    assert!(line.starts_with('0') && line.ends_with('0') && line.contains('1') == was_on(&record), "{line}");

    // A card that fails during the run: counted, detected by the supervisor, off at the end.
    let (summary, record) = bench.check(&run(&[("FAKE_FAIL_AFTER", "600")], &two), "card.rec");
    let (events, ticks) = (record.place("events"), record.rows.len());
    let broken = record.rows.iter().filter(|row| row.input[events] & 8 != 0).count();
    assert!(broken > 0 && broken == ticks - 100, "{broken} of {ticks}");
    assert_eq!(summary["device_faults"], broken);
    assert!(log().1.ends_with('0'));

    for (variables, arguments, words) in [
        (&[][..], &[][..], "the cards have 4 analog outputs, six amplifiers need 6"),
        (&[], &["--comedi-out", "/dev/fake9"], "/dev/fake9: No such device"),
        (&[("FAKE_HIGHEST", "4095")], &two, "counts to 4095, the spec's sensor.bits to"),
        (&[], &["--comedi-range", "-20:20"], "has no range of -20 V to 20 V"),
        (&[], &["--comedi-library", "/nowhere.so"], "no comedilib: "),
    ] {
        let output = run(variables, arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(3) && text.contains(words), "{words}: {text}");
    }
}

#[test]
#[ignore = "long: the program of another spec"]
fn legs_are_moved_by_operate_and_a_machine_that_is_killed_is_a_converter_that_does_not_answer() {
    let mut bench = Bench::new("legs.toml");
    let link = bench.path("link");
    let mut command = bench.command("legs.rec");
    command.args(["--elastic", "--sim-timeout", "1000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let mut watcher = Host::open(&link, 1).unwrap();
    watcher.wait("a tick", |status| status.tick > 0 && status.phase == DISARMED);
    let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
    command.arg("operate").arg("--socket").arg(&link).arg(&bench.spec).stdin(Stdio::piped());
    let mut operate = ProcessGuard::new(&mut command);
    let mut input = operate.0.as_mut().unwrap().stdin.take().unwrap();
    input.write_all(b"set request=1\nfly\narm\nwait arming\nrun\nwait running\nset setpoint[2]=2e-6\n").unwrap();
    let start = watcher.wait("running", |status| status.phase == RUNNING).tick;
    watcher.wait("half a second of its time", |status| status.tick > start + 3_000);

    signal(&bench.plant, Signal::KILL);
    bench.plant.wait().unwrap();
    // The program waits for the first reading only.
    std::thread::sleep(Duration::from_millis(1_000));
    let start = watcher.status().tick;
    watcher.wait("ticks without a machine", |status| status.tick > start + 100);
    let output = running.end(Signal::INT);
    // The end of the program is detected.
    let operated = operate.wait();
    let text = String::from_utf8_lossy(&operated.stdout);
    assert!(operated.status.code() == Some(3) && text.contains("`request` cannot be set"), "{operated:?}");
    assert!(text.contains("invalid command `fly`"), "{text}");
    let (summary, record) = bench.check(&output, "legs.rec");
    assert!(summary["device_faults"].as_u64().unwrap() > 0, "{summary}");
    assert!(output.status.code() == Some(1) && summary["failure"].as_str().unwrap().contains("converter"), "{summary}");
    let [events, setpoint, measured] = ["events", "setpoint[2]", "displacement[2]"].map(|name| record.place(name));
    assert_ne!(record.rows.last().unwrap().input[events] & 8, 0, "the supervisor has seen it");
    let moved = record.rows.iter().rev().find(|row| row.input[setpoint] != 0 && row.input[events] & 8 == 0).unwrap();
    let measured = f64::from_bits(moved.input[measured]);
    assert!(measured > 1e-6, "the leg went: {measured:e}");
}
