//! The real-time target as a user runs it: the emitted workspace built, its binary in closed loop with `specgen plant`, its record
//! replayed by the host library. Nothing here asserts times: only that every tick is accounted for, and bits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use host_sim::controller::{Controller, Supervised};
use host_sim::trace::Trace;
use serde_json::Value;
use specgen::{compile, emit, target, workspace};

/// Length of the platform's run, s, where another than that of CI is wanted.
const SECONDS: &str = "SPECGEN_RT_SECONDS";

/// A spec's workspace with the built binary, the host library and a running machine.
struct Bench {
    folder: tempfile::TempDir,
    binary: PathBuf,
    library: PathBuf,
    plant: Child,
    name: String,
    spec: PathBuf,
}

impl Bench {
    fn new(spec: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let spec_file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../specs").join(spec);
        let compiled = compile::compile(&spec_file).unwrap_or_else(|_| panic!("{spec} compiles"));
        let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &["rt-pc"]);
        let root = folder.path().join("controller");
        workspace::write(&root, &files).unwrap();
        // Kept between runs and shared by both specs, so that dependencies are compiled once.
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rt-pc").join(spec);
        let cargo = |verb: &[&str]| {
            let mut command = Command::new("cargo");
            command.args(verb).args(["--release", "--locked", "--quiet", "--features", "comedi"]);
            command.arg("--target-dir").arg(&kept).current_dir(root.join("rt-pc"));
            for leak in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR"] {
                command.env_remove(leak);
            }
            // Fat link-time optimisation costs the test more than all the rest.
            command.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
            let output = command.output().unwrap();
            assert!(output.status.success(), "cargo {verb:?}: {}", String::from_utf8_lossy(&output.stderr));
        };
        // Its own tests are those of the emitted copy.
        cargo(&["test"]);
        cargo(&["build"]);
        let library = target::host::build_library(&root, &kept).unwrap();
        let name = format!("test-{}-{}", spec.trim_end_matches(".toml"), std::process::id());
        // Under real-time priority where that is granted: other tests want the processors too.
        let plant = |more: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
            command.args(["plant", spec_file.to_str().unwrap(), "--name", &name]).args(more);
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        };
        let granted = Command::new("chrt").args(["-f", "50", "true"]).stderr(Stdio::null()).status();
        let plant = plant(if granted.is_ok_and(|status| status.success()) { &["--priority", "50"] } else { &[] });
        let place = Path::new("/dev/shm").join(format!("specgen-plant-{name}"));
        wait_for("the machine", || place.exists());
        Self { binary: kept.join("release/rt-pc"), folder, library, plant, name, spec: spec_file }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The binary on the simulated machine, recording to `record`.
    fn command(&self, record: &str) -> Command {
        let mut command = Command::new(&self.binary);
        command.args(["--sim", &self.name, "--allow-no-rt", "--json", "--record"]).arg(self.path(record));
        command
    }

    /// The first row of a record that the host's own build does not repeat, as tick and name of the word.
    fn first_difference(&self, trace: &Trace) -> Option<(usize, String)> {
        let mut host = Supervised::new(Controller::load(&self.library).unwrap()).unwrap();
        let (inputs, outputs) = (host.input_names(), host.output_names());
        assert_eq!((&trace.description().input_names, &trace.description().output_names), (&inputs, &outputs));
        let mut output = vec![0; outputs.len()];
        for (tick, row) in trace.rows().enumerate() {
            let (input, rest) = row.split_at(inputs.len());
            host.step(input, &mut output);
            if let Some(place) = (0..outputs.len()).find(|k| output[*k] != rest[*k]) {
                return Some((tick, outputs[place].clone()));
            }
            if host.digest() != rest[outputs.len()] {
                return Some((tick, "digest".to_owned()));
            }
        }
        None
    }

    /// Checks what holds of every run, whatever the machine did and however loaded this computer is.
    fn check(&self, output: &Output, record: &str) -> (Value, Trace) {
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
        let trace = Trace::from_bytes(&fs::read(self.path(record)).unwrap()).unwrap();
        assert_eq!(trace.len() as u64, count("on_time") + count("late"), "a row for every tick that was run");
        // A tick after skipped ones says so, and no other.
        let events = trace.description().input_names.iter().position(|name| name == "events").unwrap();
        let missed = trace.rows().filter(|row| row[events] & 1 == 1).count() as u64;
        assert!(missed <= count("skipped") && (missed > 0) == (count("skipped") > 0), "{missed}: {text}");
        assert_eq!(self.first_difference(&trace), None);
        (summary, trace)
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
        assert!(start.elapsed() < Duration::from_secs(60), "{what} does not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn signal(process: &Child, name: &str) {
    assert!(Command::new("kill").args([&format!("-{name}"), &process.id().to_string()]).status().unwrap().success());
}

#[test]
fn a_platform_runs_its_trajectory_in_closed_loop_and_its_record_replays_to_the_bit() {
    let bench = Bench::new("reference.toml");
    let seconds: f64 = std::env::var(SECONDS).map_or(2.5, |text| text.parse().expect("a number of seconds"));
    let output =
        bench.command("a.trace").args(["--seconds", &seconds.to_string(), "--set", "command=3"]).output().unwrap();
    let (summary, trace) = bench.check(&output, "a.trace");
    // At 10 kHz; the ramp down comes after.
    assert!(summary["planned"].as_f64().unwrap() > 1e4 * (seconds - 0.1), "{summary}");
    println!("{summary:#}");
    println!("{} ticks replayed on the host, outputs and digests equal to the bit", trace.len());
    assert_eq!(output.status.code(), Some(i32::from(!summary["failure"].is_null())), "{summary}");

    // The comparison notices one bit in one word.
    let mut words = trace.words().to_vec();
    let (width, output_place) = (trace.width(), trace.description().input_names.len());
    let tick = trace.len() / 2;
    words[tick * width + output_place + 3] ^= 1;
    let flipped = Trace::from_words(trace.description().clone(), words).unwrap();
    let name = trace.description().output_names[3].clone();
    assert_eq!(bench.first_difference(&flipped), Some((tick, name.clone())));

    // As a user does it.
    let replay = |record: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg("replay").arg(bench.path(record)).arg("--spec").arg(&bench.spec).output().unwrap()
    };
    let good = replay("a.trace");
    assert!(good.status.success() && String::from_utf8_lossy(&good.stdout).contains("bit-equal"), "{good:?}");
    fs::write(bench.path("flipped.trace"), flipped.to_bytes()).unwrap();
    let bad = replay("flipped.trace");
    let text = String::from_utf8_lossy(&bad.stderr);
    assert!(
        bad.status.code() == Some(1) && text.contains(&format!("number {tick} ")) && text.contains(&name),
        "{bad:?}"
    );

    // With time that waits it runs on any computer. SIGTERM: down, and off.
    let mut command = bench.command("b.trace");
    command
        .args(["--elastic", "--patience", "5000", "--set", "command=3"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut running = command.spawn().unwrap();
    wait_for("the record", || fs::metadata(bench.path("b.trace")).is_ok_and(|file| file.len() > 4_000_000));
    assert!(running.try_wait().unwrap().is_none(), "it runs until it is told");
    signal(&running, "TERM");
    let output = running.wait_with_output().unwrap();
    let (summary, trace) = bench.check(&output, "b.trace");
    assert_eq!((&summary["last_phase"], &summary["skipped"]), (&"Disarmed".into(), &0.into()), "{summary}");
    let supervisor = width - 1 - 2;
    assert!(trace.rows().any(|row| row[supervisor] & 0xff == 2), "it ran");
    assert_eq!(trace.rows().last().unwrap()[supervisor] >> 16, 0, "amplifiers off in the last tick");
    assert_eq!(output.status.code(), Some(0), "{summary}");

    a_card_is_read_driven_and_switched_off(&bench);
}

/// The same binary on a library that stands in for comedilib.
fn a_card_is_read_driven_and_switched_off(bench: &Bench) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rt_pc/fake_comedi.rs");
    let library = bench.path("libcomedi.so");
    let built =
        Command::new("rustc").args(["--edition=2024", "--crate-type=cdylib", "-o"]).arg(&library).arg(source).output();
    let built = built.unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let run = |variables: &[(&str, &str)], arguments: &[&str]| {
        let mut command = Command::new(&bench.binary);
        command.args(["--allow-no-rt", "--json", "--seconds", "0.4", "--arm", "--comedi-library"]).arg(&library);
        command.args(["--comedi", "/dev/fake1"]).args(arguments).arg("--record").arg(bench.path("card.trace"));
        command.env("FAKE_LOG", bench.path("card.log")).envs(variables.iter().copied()).output().unwrap()
    };
    // Whether the amplifiers were ever to be on.
    let was_on = |trace: &Trace| trace.rows().any(|row| row[trace.width() - 3] >> 16 & 1 == 1);
    let log = || {
        let text = fs::read_to_string(bench.path("card.log")).unwrap();
        let field = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).unwrap().to_owned();
        let numbers =
            ["reads=", "writes1=", "writes2=", "lowest=", "highest="].map(|key| field(key).parse::<u64>().unwrap());
        (numbers, field("line="), field("configured=") == "true" && field("bad=").is_empty())
    };

    let two = ["--comedi-out", "/dev/fake1", "--comedi-out", "/dev/fake2"];
    let output = run(&[], &two);
    let (_, trace) = bench.check(&output, "card.trace");
    let ([reads, first, second, _, highest], line, sound) = log();
    assert_eq!(reads, 6 * trace.len() as u64);
    assert_eq!((first, second), (4 * trace.len() as u64, 2 * trace.len() as u64));
    assert!(sound && highest <= 43_690);
    assert!(line.starts_with('0') && line.ends_with('0') && line.contains('1') == was_on(&trace), "{line}");

    // A card that fails in the middle: counted, told to the supervisor, off at the end.
    let (summary, trace) = bench.check(&run(&[("FAKE_FAIL_AFTER", "600")], &two), "card.trace");
    let events = trace.description().input_names.iter().position(|name| name == "events").unwrap();
    let broken = trace.rows().filter(|row| row[events] & 8 != 0).count() as u64;
    assert!(broken > 0 && broken == trace.len() as u64 - 100, "{broken} of {}", trace.len());
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
fn legs_are_moved_by_lines_and_a_machine_that_is_killed_is_a_converter_that_does_not_answer() {
    let mut bench = Bench::new("legs.toml");
    let socket = bench.path("socket");
    let mut command = bench.command("legs.trace");
    command.args(["--elastic", "--patience", "1000", "--socket"]).arg(&socket);
    let running = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for("the socket", || UnixStream::connect(&socket).is_ok());
    let mut lines = BufReader::new(UnixStream::connect(&socket).unwrap());
    lines.get_ref().set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut ask = |line: &str| {
        lines.get_mut().write_all(format!("{line}\n").as_bytes()).unwrap();
        let mut answer = String::new();
        lines.read_line(&mut answer).unwrap();
        answer.trim().to_owned()
    };
    wait_for("a tick", || ask("status").contains("phase=Disarmed"));
    assert!(ask("set request=1").starts_with("error: `request`"));
    assert!(ask("fly").starts_with("error: `fly` is none of"));
    assert_eq!(ask("arm"), "ok");
    wait_for("arming", || !ask("status").contains("phase=Disarmed"));
    assert_eq!(ask("run"), "ok");
    wait_for("running", || ask("status").contains("phase=Running"));
    assert_eq!(ask("set setpoint[2]=2e-6"), "ok");
    let tick = |status: &str| status.split(['=', ' ']).nth(1).unwrap().parse::<u64>().unwrap();
    let start = tick(&ask("status"));
    wait_for("half a second of its time", || tick(&ask("status")) > start + 2_500);

    signal(&bench.plant, "KILL");
    bench.plant.wait().unwrap();
    // The first reading is waited for, the next ones are not.
    std::thread::sleep(Duration::from_millis(1_000));
    let start = tick(&ask("status"));
    wait_for("ticks without a machine", || tick(&ask("status")) > start + 100);
    signal(&running, "INT");
    let (summary, trace) = bench.check(&running.wait_with_output().unwrap(), "legs.trace");
    assert!(summary["device_faults"].as_u64().unwrap() > 0, "{summary}");
    let inputs = &trace.description().input_names;
    let place = |name: &str| inputs.iter().position(|known| known == name).unwrap();
    let (events, setpoint, measured) = (place("events"), place("setpoint[2]"), place("displacement[2]"));
    assert_ne!(trace.rows().last().unwrap()[events] & 8, 0, "the supervisor was told");
    let moved = trace.rows().filter(|row| row[setpoint] != 0 && row[events] & 8 == 0).last().unwrap();
    assert!(f64::from_bits(moved[measured]) > 1e-6, "the leg went: {:e}", f64::from_bits(moved[measured]));
}
