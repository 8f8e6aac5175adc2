//! Processor in the loop, as a user runs it: an image in QEMU, a board at a serial port, and errors of both.
//!
//! Needs a cross compiler and QEMU, except for the serial port; without them it skips.

mod board;

use crate::support;
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::support::{BINARY, Run, repository};
use board::{Board, SteppedMachine};
use host_sim::controller::{Controller, Supervised, TickController};
use serde_json::Value;
use specgen::model::Mcu;
use specgen::pil::{Lockstep, Pipes, Stop};
use specgen::target::{self, Image, emulator::Emulator};
use specgen_link::client::Timeout;

/// One workspace for all, so that dependencies are built once; one run at a time writes it.
static ONE: Mutex<()> = Mutex::new(());

fn workspace() -> (MutexGuard<'static, ()>, PathBuf) {
    (ONE.lock().unwrap_or_else(PoisonError::into_inner), Path::new(env!("CARGO_TARGET_TMPDIR")).join("pil"))
}

fn spec(name: &str) -> String {
    repository().join("specs").join(name).display().to_string()
}

fn pil(spec: &str, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(BINARY);
    command.args(["pil", spec, "-o"]).arg(folder).args(arguments);
    command
}

/// The document of a run that must end with `code`.
fn document(command: &mut Command, code: i32) -> Value {
    let run = Run::of(command.arg("--json"));
    let value: Value = serde_json::from_str(&run.stdout).unwrap_or_else(|_| panic!("{run:#?}"));
    assert_eq!((run.code, &value["exit_code"]), (code, &code.into()), "{value:#}");
    value
}

/// The image of six legs, its file outside of the workspace, and the controller on this computer.
fn legs(folder: &Path) -> (Image, PathBuf, Supervised) {
    let image = built(folder, true).unwrap();
    let file = folder.with_extension("elf");
    std::fs::write(&file, &image.elf).unwrap();
    (image, file, supervised(folder))
}

fn supervised(folder: &Path) -> Supervised {
    let library = target::host::build_library(folder, &folder.join("target")).unwrap();
    Supervised::new(Controller::load(&library).unwrap())
}

/// Writes the workspace of six legs, and builds its image if `image`.
fn built(folder: &Path, image: bool) -> Option<Image> {
    let compiled = specgen::compile::compile(Path::new(&spec("legs.toml"))).unwrap();
    drop(specgen::workspace::write(folder, &compiled.files()).unwrap());
    image.then(|| target::build_pil(folder, Mcu::Mps2An500, &folder.join("target")).unwrap())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn six_legs_and_a_platform_are_bit_equal_in_closed_loop_and_legs_outrun_real_time() {
    if support::tools().is_none() {
        return;
    }
    let (_one, folder) = workspace();
    let mut fastest = 0.0;
    for _ in 0..support::length(1, 3) {
        let plot = folder.with_extension("svg").display().to_string();
        let value = document(&mut pil(&spec("legs.toml"), &folder, &["--plot", &plot]), 0);
        let drawn = std::fs::read_to_string(&plot).unwrap();
        assert!(["invhys at 10 Hz", "pcc at 10 Hz", "leg 5"].iter().all(|text| drawn.contains(text)), "{drawn}");
        let result = &value["result"];
        assert_eq!(result["first_difference"], Value::Null);
        let ticks = number(&result["ticks"]);
        assert!(ticks >= 3.0 * 1100.0, "{result:#}");
        let modes: Vec<&str> =
            result["tracking"]["rows"].as_array().unwrap().iter().map(|row| row["mode"].as_str().unwrap()).collect();
        assert_eq!(modes, ["invhys", "ewma", "pcc"]);
        let error = number(&result["tracking"]["rows"][2]["rmse_nm"]);
        // Nanometres show that the loop is closed; invhys alone leaves hundreds.
        assert!((5.0..60.0).contains(&error), "{error} nm");
        let whole = &result["costs"][0];
        assert_eq!(
            (&whole["name"], &whole["calls"], &result["counted"]),
            (&"supervise".into(), &result["ticks"], &"instructions".into())
        );
        assert!(number(&whole["min"]) > 500.0 && number(&whole["min"]) <= number(&whole["mean"]));
        assert!(number(&whole["mean"]) <= number(&whole["max"]) && number(&whole["max"]) < 20_000.0);
        assert!(number(&whole["stack"]) > 0.0 && number(&whole["stack"]) <= number(&result["stack_bound"]));
        let ratio = ticks * number(&result["interval"]) / number(&result["seconds"]);
        println!("legs at 5 kHz: {ratio:.2} × real time");
        if ratio > fastest {
            fastest = ratio;
        }
        // Other tests run on this machine at the same time.
        if fastest > 1.0 {
            break;
        }
    }
    if support::length(true, false) {
        support::skipped(&format!(
            "only in the full run: the platform, and how fast they are; here {fastest:.2} × real time"
        ));
        return;
    }
    // Emulator and simulator alternate, so a busy computer delays every tick.
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load: f64 = load.split(' ').next().and_then(|text| text.parse().ok()).unwrap_or(0.0);
    let idle = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    if load > idle + 2.0 {
        support::skipped(&format!("not judged at a load of {load}: {fastest:.2} × real time"));
    } else {
        assert!(fastest > 1.0, "{fastest}");
    }

    let value = document(&mut pil(&spec("reference.toml"), &folder, &["--mode", "pf-pcc", "--seconds", "0.1"]), 0);
    let result = &value["result"];
    assert_eq!(result["first_difference"], Value::Null);
    assert!(number(&result["ticks"]) > 2000.0);
    let row = &result["free_motion"][0];
    assert_eq!((&row["trajectory"], &row["mode"]), (&"case-1".into(), &"pf-pcc".into()), "{row:#}");
    // Only part of the trajectory was requested, and the figure says so.
    assert!(
        (number(&row["seconds"]) - 0.1).abs() < 1e-9 && (number(&row["path_seconds"]) - 0.25).abs() < 1e-9,
        "{row:#}"
    );
    let names: Vec<&str> =
        result["costs"].as_array().unwrap().iter().map(|cost| cost["name"].as_str().unwrap()).collect();
    assert!(names.starts_with(&["supervise", "sense"]), "{names:?}");
}

#[test]
#[ignore = "long: an image on the emulated board; the short run flips a bit of a constant on the host"]
fn a_flipped_bit_in_a_table_of_the_image_is_found_with_its_tick_and_signal() {
    if support::tools().is_none() {
        return;
    }
    let (_one, folder) = workspace();
    let (image, file, _) = legs(&folder);
    let compiled = specgen::compile::compile(Path::new(&spec("legs.toml"))).unwrap();
    let table = &compiled.ir.hysteresis.tables[0];
    // A node in the middle of the table, found by its bits and those of its neighbours.
    let middle = table.len() / 2;
    let bytes: Vec<u8> = table[middle..middle + 4].iter().flat_map(|node| node.to_bits().to_le_bytes()).collect();
    let place = image.elf.windows(bytes.len()).position(|window| window == bytes).unwrap();
    let mut elf = image.elf.clone();
    elf[place] ^= 1;
    let flipped = file.with_extension("flipped.elf");
    std::fs::write(&flipped, &elf).unwrap();

    let run =
        |file: &Path, code| document(pil(&spec("legs.toml"), &folder, &["--mode", "pcc"]).arg("--elf").arg(file), code);
    if support::length(false, true) {
        run(&file, 0);
    }
    let value = run(&flipped, 1);
    let difference = &value["result"]["first_difference"];
    let (signal, tick) = (difference["signal"].as_str().unwrap(), difference["tick"].as_u64().unwrap());
    assert!(tick > 0 && difference["host"] != difference["device"], "{difference:#}");
    let error = value["error"].as_str().unwrap();
    assert!(error.contains(&format!("tick {tick} {signal}: host ")), "{error}");
    println!("{error}");
}

static NEVER: AtomicBool = AtomicBool::new(false);

#[test]
#[ignore = "long: three images on the emulated board, and waiting times"]
fn an_emulator_that_ends_or_hangs_is_an_error_in_words() {
    if support::tools().is_none() {
        return;
    }
    let (_one, folder) = workspace();
    let (image, ..) = legs(&folder);
    let emulator = Emulator::find().unwrap();
    for (signal, word) in [(Signal::KILL, "the emulator ended"), (Signal::STOP, "no answer within")] {
        let pipes = Pipes::start(&emulator, &image).unwrap();
        let process = pipes.process();
        let timeout = Timeout { limit: Duration::from_secs(2), attempts: 1 };
        let mut lockstep = Lockstep::open(supervised(&folder), pipes, timeout, &NEVER).unwrap();
        lockstep.reset();
        let description = lockstep.description().clone();
        let mut output = vec![0; description.output_names.len()];
        let input = vec![0; description.input_names.len()];
        for _ in 0..50 {
            lockstep.step(&input, &mut output);
        }
        assert!(lockstep.stop().is_none());
        support::send(signal, process);
        let start = Instant::now();
        // A signal may reach it some ticks later.
        let mut stepped = || {
            lockstep.step(&input, &mut output);
            lockstep.take_stop()
        };
        let stop = (0..1000).find_map(|_| stepped()).unwrap();
        assert!(matches!(stop, Stop::Link(_)) && stop.to_string().contains(word), "{stop}");
        assert!(start.elapsed() < Duration::from_secs(5));
        assert!(output.iter().all(|word| *word == u64::MAX), "voltages that no machine takes");
        drop(lockstep);
        assert!(!Path::new("/proc").join(process.to_string()).exists(), "{signal:?}: the emulator is left running");
    }
    let nonsense = Image { elf: b"no image".to_vec(), ..image };
    let pipes = Pipes::start(&emulator, &nonsense).unwrap();
    let timeout = Timeout { limit: Duration::from_secs(20), attempts: 1 };
    let error = Lockstep::open(supervised(&folder), pipes, timeout, &NEVER).err().unwrap().to_string();
    assert!(error.contains("the emulator ended: "), "{error}");
}

#[test]
fn ctrl_c_ends_it_with_what_was_done_and_leaves_no_emulator() {
    if support::tools().is_none() {
        return;
    }
    let (_one, folder) = workspace();
    let (_, file, _) = legs(&folder);
    let mut command = pil(&spec("legs.toml"), &folder, &["--frequency", "0.1", "--samples", "50000", "--elf"]);
    let child = command.arg(file).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let start = Instant::now();
    let emulator = loop {
        assert!(start.elapsed() < Duration::from_secs(60), "no emulator was started");
        let list = std::fs::read_to_string(&children).unwrap_or_default();
        let is_emulator = |id: &&str| {
            // Before the run its version is queried.
            let words = std::fs::read_to_string(format!("/proc/{id}/cmdline")).unwrap_or_default();
            words.contains("image.elf")
        };
        if let Some(id) = list.split_whitespace().find(is_emulator) {
            break id.to_owned();
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    std::thread::sleep(Duration::from_secs(1));
    support::send(Signal::INT, child.id());
    let output = child.wait_with_output().unwrap();
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{printed}");
    assert!(printed.contains("error: interrupted after "), "{printed}");
    assert!(!Path::new("/proc").join(emulator).exists(), "the emulator is left running");
}

#[test]
fn without_the_emulator_the_command_that_installs_it_is_named() {
    let (_one, folder) = workspace();
    let nothing = tempfile::tempdir().unwrap();
    let mut command = pil(&spec("legs.toml"), &folder, &[]);
    let value = document(command.env("SPECGEN_TOOLS", nothing.path()).env("XDG_CACHE_HOME", nothing.path()), 3);
    assert!(value["error"].as_str().unwrap().contains("apt-get install qemu-system-arm"), "{value:#}");
}

#[test]
#[ignore = "long: an image of its own for the serial port"]
fn a_board_at_a_serial_port_is_stepped_like_the_emulator() {
    let (_one, folder) = workspace();
    built(&folder, false);
    let at = |board: &Board, code: i32| {
        let port = board.port.display().to_string();
        document(&mut pil(&spec("legs.toml"), &folder, &["--mode", "pcc", "--seconds", "0.05", "--port", &port]), code)
    };
    let quiet = Board::plug(Some(SteppedMachine::new(supervised(&folder))), 0);
    let value = at(&quiet, 0);
    let counters = quiet.unplug();
    let result = &value["result"];
    assert_eq!((&result["first_difference"], &result["damaged_frames"]), (&Value::Null, &0.into()));
    assert_eq!((&result["counted"], &result["costs"][0]["calls"]), (&"cycles".into(), &result["ticks"]));
    assert!(number(&result["ticks"]) > 250.0 && counters.errors() == 0, "{counters:?}");

    // The same ticks over a noisy line, with some requests repeated.
    let noisy = Board::plug(Some(SteppedMachine::new(supervised(&folder))), 20_000);
    let again = at(&noisy, 0);
    let counters = noisy.unplug();
    assert_eq!(again["result"]["tracking"], result["tracking"]);
    assert_eq!(again["result"]["costs"], result["costs"]);
    assert!(counters.errors() > 0, "{counters:?}");

    let mut wrong = SteppedMachine::new(supervised(&folder));
    wrong.flip = Some((100, 3));
    let value = at(&Board::plug(Some(wrong), 0), 1);
    let difference = &value["result"]["first_difference"];
    assert_eq!(
        (&difference["tick"], &difference["signal"], &difference["ulps"]),
        (&100.into(), &"voltage[3]".into(), &1.into())
    );

    let other = SteppedMachine::new(supervised(&folder)).pretend("0123");
    let error = at(&Board::plug(Some(other), 0), 1)["error"].as_str().unwrap().to_owned();
    assert!(error.contains("spec digest 0123") && error.contains("build and flash it"), "{error}");

    let error = at(&Board::plug(None, 0), 3)["error"].as_str().unwrap().to_owned();
    assert!(error.contains("no answer within") && error.contains("8 attempts"), "{error}");
}

#[test]
fn what_is_no_board_is_refused_before_anything_is_built() {
    let nothing = tempfile::tempdir().unwrap();
    let folder = nothing.path().join("out");
    for (port, words) in [("/no/such/device", "is the board plugged in?"), ("/dev/null", "is not a serial device")] {
        let value = document(&mut pil(&spec("legs.toml"), &folder, &["--port", port]), 3);
        assert!(value["error"].as_str().unwrap().contains(words), "{value:#}");
    }
    assert!(!folder.exists());
}
