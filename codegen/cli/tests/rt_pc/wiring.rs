//! A miswired machine: the real-time program refuses to run it and names the fault, to hosts and in its summary, and the record of the
//! checks replays bit for bit.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use rustix::process::Signal;
use specgen::lower::single_faults;
use specgen_runtime::supervisor::{Fault, Finding};

use super::{Bench, ProcessGuard, wait_for};

const REFUSED: &str = ": faulted: wiring, ";

#[test]
#[ignore = "long: another session; every fault of the wiring is named by the supervisor in the short run"]
fn every_single_fault_of_gauges_and_legs_is_refused_and_named() {
    let bench = Bench::named("reference.toml", "wiring");
    let faults: Vec<Finding> = single_faults();
    let (mut plant, place, running, link) = miswired(&bench, &faults);
    let mut operate = Command::new(env!("CARGO_BIN_EXE_specgen"));
    operate.arg("operate").arg("--socket").arg(&link).arg(&bench.spec);
    let mut host = operate.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(host.stdout.take().unwrap()).lines();
    let mut order = |orders: &str, words: &str| {
        writeln!(host.stdin.as_mut().unwrap(), "{orders}").unwrap();
        lines.by_ref().map(Result::unwrap).find(|line| line.contains(words)).unwrap_or_else(|| panic!("no {words}"))
    };
    for fault in &faults {
        let line = order("arm\nwait faulted 60\nstatus", REFUSED);
        let found = line.split(REFUSED).nth(1).unwrap();
        assert!(is_named(found, *fault), "{fault}: {line}");
        assert!(line.contains("amplifiers off"), "{line}");
        order("acknowledge\nwait disarmed 60\nnone\nstatus", ": disarmed");
    }
    // The last fault was fixed.
    order("arm\nwait holding 60\nstatus", ": holding");
    order("ramp-down\nwait disarmed 60\nstatus", ": disarmed");
    drop(host.stdin.take());
    host.wait().unwrap();
    let (summary, _) = bench.check(&running.end(Signal::TERM), "wiring.rec");
    let incidents = summary["incidents"].as_array().unwrap();
    assert_eq!(incidents.len(), faults.len(), "{summary}");
    for (incident, fault) in incidents.iter().zip(&faults) {
        let why = incident["why"].as_str().and_then(|why| why.strip_prefix("wiring, ")).unwrap();
        assert!(is_named(why, *fault), "{fault}: {incident}");
    }
    plant.kill().unwrap();
    plant.wait().unwrap();
    let _ = fs::remove_file(place);
}

/// The machine of a bench with these faults in turn, and a program with a link: process and place of the machine, program, link.
fn miswired(bench: &Bench, faults: &[Finding]) -> (Child, PathBuf, ProcessGuard, PathBuf) {
    let name = format!("{}-wrong", bench.name);
    let mut plant = Command::new(env!("CARGO_BIN_EXE_specgen"));
    plant.arg("plant").arg(&bench.spec).args(["--name", &name]).stdout(Stdio::null()).stderr(Stdio::null());
    for fault in faults {
        plant.args(["--wrong", &fault.to_string().replace('×', "x")]);
    }
    let plant = plant.spawn().unwrap();
    let place = Path::new("/dev/shm").join(format!("specgen-plant-{name}"));
    wait_for("the machine", || place.exists());
    let link = bench.path("wiring.link");
    let mut command = Command::new(&bench.programs.binary);
    command
        .args(["--sim", &name, "--allow-no-rt", "--elastic", "--sim-timeout", "10000", "--json", "--record"])
        .arg(bench.path("wiring.rec"));
    let running = ProcessGuard::new(command.arg("--link").arg(&link));
    wait_for("the link", || link.exists());
    (plant, place, running, link)
}

/// What a user reads of each kind of fault: gauge or leg, fault, and what to do. At last all is right.
#[test]
#[ignore = "long: a step of a commissioning for each kind of fault"]
fn the_step_wiring_of_a_commissioning_names_each_kind_of_fault() {
    let bench = Bench::named("reference.toml", "wiring-step");
    let of = [Fault::Inverted, Fault::Dead, Fault::Gain(50), Fault::Gain(200), Fault::Swapped(5)];
    let gauges = (0..).zip(of).map(|(place, fault)| Finding::Gauge(place, fault));
    let legs = (0..).zip(of).map(|(place, fault)| Finding::Leg(place, fault));
    let faults: Vec<Finding> = gauges.chain(legs).collect();
    let (mut plant, place, running, link) = miswired(&bench, &faults);
    let specgen = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg(words[0]).arg(&bench.spec).arg("--socket").arg(&link).args(&words[1..]);
        command.current_dir(bench.folder.path()).stdin(Stdio::null()).output().unwrap()
    };
    for fault in &faults {
        let output = specgen(&["commission", "--step", "wiring", "--yes"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let last = said.lines().last().unwrap_or_default();
        println!("{fault}: {last}");
        assert_eq!(output.status.code(), Some(1), "{fault}: {said}");
        let found = last.split("faulted: wiring, ").nth(1).unwrap_or_else(|| panic!("{fault}: {said}"));
        assert!(is_named(found, *fault), "{fault}: {last}");
        assert!(last.contains(". Check ") || last.contains(". Swap ") || last.contains(". Switch off. "), "{last}");
        let output = specgen(&["operate", "acknowledge", "wait disarmed 60", "none"]);
        assert!(output.status.success(), "{output:?}");
    }
    let output = specgen(&["commission", "--step", "wiring", "--yes"]);
    let page = String::from_utf8_lossy(&output.stdout).into_owned();
    print!("{page}");
    assert!(output.status.success(), "{output:?}");
    for part in ["gauge 5: ", "the amplifiers add, rms: x ", "lines with the amplifiers on: ", "check by hand: "] {
        assert!(page.contains(part), "{part}: {page}");
    }
    drop(running.end(Signal::TERM));
    plant.kill().unwrap();
    plant.wait().unwrap();
    let _ = fs::remove_file(place);
}

/// Whether a text starts with the fault; for a gain, with one of similar error.
fn is_named(text: &str, fault: Finding) -> bool {
    let (Finding::Gauge(_, Fault::Gain(made)) | Finding::Leg(_, Fault::Gain(made))) = fault else {
        return text.starts_with(&fault.to_string());
    };
    let words = fault.to_string().split_inclusive("× ").next().unwrap().to_owned();
    let gain = text.strip_prefix(&words).and_then(|rest| rest.get(..4)).and_then(|gain| gain.parse::<f64>().ok());
    gain.is_some_and(|gain| if made < 100 { (0.3..0.72).contains(&gain) } else { (1.42..2.8).contains(&gain) })
}
