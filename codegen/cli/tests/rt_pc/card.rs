//! A killed program, contacts of a card, and a machine whose shared memory is truncated.

use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rustix::process::Signal;
use serde_json::Value;
use specgen_link::Request;

use super::host::{Host, Record};
use super::{
    ACKNOWLEDGE, ARM, Bench, DISARMED, FAULTED, HOLDING, NONE, ProcessGuard, RUN, RUNNING, TWO_CARDS, fake_comedi,
    wait_for,
};

const RAMPING_DOWN: u8 = 4;
const CONVERTER: u8 = 11;
const EMERGENCY_STOP: u8 = 12;
const AMPLIFIER_FAULT: u8 = 17;
/// Event bits of a record: the emergency stop, a fault of an amplifier.
const STOP: u64 = 16;
const AMPLIFIER: u64 = 64;
/// Control period, ns.
const PERIOD: u64 = 100_000;

fn command(bench: &Bench, library: &Path, record: &str, more: &[&str]) -> std::process::Command {
    let mut command = std::process::Command::new(&bench.programs.binary);
    command.args(["--allow-no-rt", "--json", "--assumed-ok", "--comedi", "/dev/fake1"]).args(TWO_CARDS).args(more);
    command.arg("--comedi-library").arg(library).arg("--record").arg(bench.path(record));
    command
}

/// A heartbeat that toggles in every tick, and stops after `kill -9`, when the enable line is no longer controlled.
pub fn a_heartbeat_ends_with_the_process(bench: &Bench) {
    let (library, file) = (fake_comedi(bench), bench.path("beats"));
    let mut command = command(bench, &library, "killed.rec", &["--arm"]);
    let length = || fs::metadata(&file).map_or(0, |found| found.len());
    // In short runs, repeated: missed ticks of this computer end a run.
    let beats = |_| {
        let _ = fs::remove_file(&file);
        let mut running = ProcessGuard::new(command.env("FAKE_BEATS", &file));
        while running.goes_on() {
            if length() > 16 * 300 {
                return Some(running);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        None
    };
    let running = (0..100).find_map(beats).expect("a run with a heartbeat");
    let output = running.end(Signal::KILL);
    let dead = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
    assert!(output.status.code().is_none(), "{output:?}");
    let beats = fs::read(&file).unwrap();
    let beats: Vec<[u64; 2]> = beats
        .as_chunks::<16>()
        .0
        .iter()
        .map(|beat| [0, 8].map(|at| u64::from_le_bytes(beat[at..at + 8].try_into().unwrap())))
        .collect();
    assert!(beats.windows(2).all(|pair| pair[0][1] != pair[1][1]), "it changes in every tick");
    let span = beats[beats.len() - 1][0] - beats[0][0];
    let mut gaps: Vec<u64> = beats.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    gaps.sort_unstable();
    let median = gaps[gaps.len() / 2];
    let (edges, seconds, apart) = (beats.len(), span as f64 * 1e-9, median as f64 * 1e-3);
    println!("heartbeat: {edges} edges in {seconds:.3} s, {apart:.1} us apart (median)");
    assert!(median < 2 * PERIOD, "{median}");
    std::thread::sleep(Duration::from_millis(50));
    assert!(beats[beats.len() - 1][0] <= dead + 2 * PERIOD && length() / 16 == beats.len() as u64);
}

/// `FAKE_PER_CODE` for linear legs of the reference platform: response of each gauge to each leg's code.
fn follows(bench: &Bench) -> String {
    let machine = bench.machine();
    let place = |names: &[String], name: &str| names.iter().position(|found| found == name).unwrap();
    let gauges = place(&machine.input_names(), "gauge[0]");
    let requested = place(&machine.output_names(), "requested[0]");
    let mut input = vec![0; machine.input_names().len()];
    let mut standing = machine.standing(&input).unwrap();
    let mut output = vec![0; machine.output_names().len()];
    standing.show(&machine, &output, &mut input);
    // Five stacks of 0.1262 um/V, reduced for small motions; steps of the converters.
    let metres_per_code = 0.8 * 5.0 * 0.1262e-6 * 150.0 / 65_535.0;
    let metres_per_step = 110e-6 / 131_071.0;
    let mut per_code = [[0.0; 6]; 6];
    for leg in 0..6 {
        output[requested + leg] = 1.0_f64.to_bits();
        standing.show(&machine, &output, &mut input);
        output[requested + leg] = 0.0_f64.to_bits();
        for (row, word) in per_code.iter_mut().zip(&input[gauges..]) {
            row[leg] = f64::from_bits(*word) * metres_per_code / metres_per_step;
        }
    }
    per_code.as_flattened().iter().map(|number| format!("{number} ")).collect()
}

/// Starts it repeatedly until it runs: arming tolerates no missed ticks, which an ordinary computer has.
fn comes_to_run(command: &mut std::process::Command, link: &Path) -> (ProcessGuard, Host) {
    for _ in 0..200 {
        // A socket of an earlier program may exist without a listener.
        let _ = fs::remove_file(link);
        let running = ProcessGuard::new(command);
        wait_for("the link", || link.exists());
        let mut host = Host::open(link, 1).unwrap();
        host.wait("a tick", |status| status.tick > 0);
        for request in [NONE, ARM] {
            host.done(&Request::Supervise { request });
            std::thread::sleep(Duration::from_millis(20));
        }
        host.done(&Request::Supervise { request: RUN });
        if host.wait("running or not", |status| [RUNNING, FAULTED].contains(&status.phase)).phase == RUNNING {
            return (running, host);
        }
        drop(host);
        running.end(Signal::INT);
    }
    panic!("it never runs");
}

/// Effect of an opening contact: phase in the same tick and at the end, cause, event bit.
struct Stop {
    contacts: &'static str,
    phases: [u8; 2],
    cause: u8,
    event: u64,
    name: &'static str,
}

/// Emergency stop and amplifier fault with the default action `"off"`.
pub fn contacts_stop_the_machine(bench: &Bench) {
    let emergency =
        Stop { contacts: "01", phases: [FAULTED, FAULTED], cause: EMERGENCY_STOP, event: STOP, name: "emergency stop" };
    opens(bench, &emergency);
    if crate::support::length(false, true) {
        opens(bench, &amplifier_fault([FAULTED, FAULTED]));
    }
}

fn amplifier_fault(phases: [u8; 2]) -> Stop {
    Stop { contacts: "10", phases, cause: AMPLIFIER_FAULT, event: AMPLIFIER, name: "amplifier fault" }
}

/// The two other actions, each with a separate controller.
#[test]
#[ignore = "long: programs of other specs"]
fn a_fault_of_an_amplifier_ramps_down_or_holds_where_the_spec_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let specs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs").canonicalize().unwrap();
    std::os::unix::fs::symlink(specs.join("records"), folder.path().join("records")).unwrap();
    let text = fs::read_to_string(specs.join("reference.toml")).unwrap();
    let actions = [("ramp-down", [RAMPING_DOWN, FAULTED]), ("hold", [HOLDING, HOLDING])];
    for (action, phases) in actions {
        let spec = folder.path().join(format!("amplifier-{action}.toml"));
        fs::write(&spec, format!("{text}\n[supervisor]\namplifier_fault = \"{action}\"\n")).unwrap();
        opens(&Bench::of(&spec), &amplifier_fault(phases));
    }
}

fn opens(bench: &Bench, stop: &Stop) {
    let &Stop { contacts, phases, cause, event, name } = stop;
    let (library, per_code) = (fake_comedi(bench), follows(bench));
    let (link, file) = (bench.path(&format!("card-{contacts}")), bench.path("contacts"));
    let set = |contacts: &str| {
        fs::write(bench.path("contacts.new"), contacts).unwrap();
        fs::rename(bench.path("contacts.new"), &file).unwrap();
    };
    set("11");
    let more = ["--link-silence", "5000", "--link", link.to_str().unwrap()];
    let mut command = command(bench, &library, "contacts.rec", &more);
    command.env("FAKE_CONTACTS", &file).env("FAKE_PER_CODE", &per_code);
    // More often than the program retries at its end.
    command.env("FAKE_REFUSES", "5").env("FAKE_LOG", bench.path("contacts.log"));
    let (running, mut host) = comes_to_run(&mut command, &link);
    set(contacts);
    host.wait("the stop", |status| status.phase != RUNNING);
    let holds = phases[1] == HOLDING;
    let ended = host.wait("its end", |status| status.phase == phases[1]);
    assert_eq!((ended.cause, ended.amplifier_on), (cause, holds), "{name}");
    // While the contact is open, a request to run or an acknowledgement has no effect.
    for request in [RUN, NONE, ACKNOWLEDGE, NONE] {
        host.done(&Request::Supervise { request });
        std::thread::sleep(Duration::from_millis(20));
        let status = host.status();
        assert_eq!((status.phase, status.cause), (phases[1], cause), "{name}: {request} while it is open");
    }
    set("11");
    std::thread::sleep(Duration::from_millis(50));
    let status = host.status();
    assert_eq!((status.phase, status.amplifier_on), (phases[1], holds), "nothing goes on by itself");
    host.done(&Request::Supervise { request: ACKNOWLEDGE });
    host.wait("the acknowledgement", |status| {
        status.cause == 0 && status.phase == if holds { HOLDING } else { DISARMED }
    });
    drop(host);
    let output = running.end(Signal::INT);
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = summary["failure"].as_str().unwrap_or_default();
    assert!(output.status.code() == Some(1) && text.contains(name), "{name}: {summary}");
    let log = fs::read_to_string(bench.path("contacts.log")).unwrap();
    let enable = log.lines().find_map(|line| line.strip_prefix("line=")).unwrap();
    assert!(enable.contains("1,0"), "tried until it is off: {enable}");
    let record = Record::new(fs::read(bench.path("contacts.rec")).unwrap());
    let events = record.place("events");
    let seen = |row: &host_sim::record::Row| row.input[events] & (AMPLIFIER | STOP) != 0;
    let first = record.rows.iter().position(seen).unwrap();
    assert_eq!(record.rows[first].input[events] & (AMPLIFIER | STOP), event, "{name}");
    let [before, then] = [first - 1, first].map(|row| record.rows[row].supervisor);
    assert_eq!(before & 0xff, u32::from(RUNNING), "{name}");
    assert_eq!(then & 0xffff, u32::from(phases[0]) | u32::from(cause) << 8, "{name}, in that very tick");
}

/// The shared memory of machine and controller is truncated during a run: both end properly, with amplifiers off.
pub fn shared_memory_that_becomes_shorter_ends_nobody(mut bench: Bench) {
    let link = bench.path("shorter.link");
    let mut command = bench.command("shorter.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "20000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let mut host = Host::open(&link, 1).unwrap();
    host.wait("a tick", |status| status.tick > 0);
    for request in [NONE, ARM] {
        host.done(&Request::Supervise { request });
        std::thread::sleep(Duration::from_millis(20));
    }
    host.wait("armed", |status| status.phase == HOLDING);
    let place = Path::new("/dev/shm").join(format!("specgen-plant-{}", bench.name));
    fs::OpenOptions::new().write(true).open(&place).unwrap().set_len(0).unwrap();
    let ended = bench.plant.wait().unwrap();
    assert_eq!(ended.code(), Some(3), "the machine's side says so, and ends");
    let status = host.wait("the fault", |status| status.phase == FAULTED);
    assert_eq!((status.cause, status.amplifier_on), (CONVERTER, false));
    let output = running.end(Signal::INT);
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), &summary["last_phase"]), (Some(1), &"Faulted".into()), "{summary}");
}
