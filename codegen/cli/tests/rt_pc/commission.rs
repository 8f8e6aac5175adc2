//! A machine commissioned over the link of the real-time program: from the wiring check to the acceptance of the new controller.

use std::path::Path;
use std::process::{Command, Output};

use rustix::process::Signal;
use serde_json::Value;

use super::{Bench, ProcessGuard, wait_for};

fn commission(folder: &Path, spec: &Path, link: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
    command.arg("commission").arg(spec).args(["--yes", "-o", "found", "--socket"]).arg(link).args(more);
    command.current_dir(folder).output().unwrap()
}

fn serve(bench: &Bench, record: &str) -> (ProcessGuard, std::path::PathBuf) {
    let link = bench.path(&format!("{record}.link"));
    let mut command = bench.command(record);
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "1000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    (running, link)
}

/// With few curves, and with the Preisach model. Elastic time, so that it runs on any computer.
#[test]
#[ignore = "long: ten minutes of a machine's time, and two programs to build"]
fn a_machine_is_commissioned_over_the_link() {
    let bench = Bench::named("reference.toml", "commission");
    let folder = bench.folder.path();
    let (running, link) = serve(&bench, "first.rec");
    let output = commission(folder, &bench.spec, &link, &["--grid", "8", "--model", "preisach"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stdout));
    let checked = commission(folder, &bench.spec, &link, &["--check"]);
    let said = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && said.contains("nothing has changed"), "{said}");
    drop(running.end(Signal::INT));
    let read = |name: &str| std::fs::read_to_string(bench.path(&format!("found/{name}"))).unwrap();
    let known: Value = serde_json::from_str(&read("commission.json")).unwrap();
    for leg in known["legs"].as_array().unwrap() {
        let rms = leg["arbitrary_rms"].as_f64().unwrap();
        assert!(rms < 500e-9, "{leg}");
    }
    // Six legs within 10 % of 0.35 ms, and a stiffness within 5 %.
    let response = &known["response"];
    let delay = response["delay"]["value"].as_f64().unwrap();
    assert!((0.32e-3..0.38e-3).contains(&delay) && response["modes"].as_array().unwrap().len() == 6, "{response}");
    assert_eq!(response["others"], Value::Array(Vec::new()));
    assert!((0.95..1.05).contains(&response["stiffness_to_mass"]["value"].as_f64().unwrap()), "{response}");
    let written = bench.path("found/platform.toml");
    assert!(read("platform.toml").contains("cross_talk = [\n"), "{}", read("platform.toml"));
    assert!(
        read("platform.toml").contains(", with dead time, mean of the legs, response-leg0.rec"),
        "{}",
        read("platform.toml")
    );

    let commissioned = Bench::named(written.to_str().unwrap(), "commissioned");
    let (running, link) = serve(&commissioned, "second.rec");
    let output = commission(folder, &written, &link, &[]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("case-1, xyz") && text.contains("## Sensitivity |S|"), "{text}");
    drop(running.end(Signal::INT));
    // Beside the same motions of the simulated machine, and the loop of the spec.
    let known: Value = serde_json::from_str(&read("commission.json")).unwrap();
    for figure in known["acceptance"].as_array().unwrap() {
        let [measured, computed] = ["value", "computed"].map(|key| figure[key].as_f64().unwrap());
        assert!((0.5..2.0).contains(&(measured / computed)), "{figure}");
    }
    for one in known["sensitivity"].as_array().unwrap() {
        for axis in 0..6 {
            let Some(measured) = one["measured"][axis].as_f64() else { continue };
            let [computed, error] = ["computed", "error"].map(|key| one[key][axis].as_f64().unwrap());
            assert!((measured - computed).abs() < 0.2 * computed + 3.0 * error, "{one}");
        }
    }
    // From the records alone, the same bytes; without the state, the same figures.
    let files = ["commission.json", "commission.md", "commission.html"];
    let before = files.map(read);
    let report = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg("commission").arg(&written).args(["--report", "-o", "found"]).args(more).current_dir(folder);
        assert!(command.output().unwrap().status.success());
        files.map(read)
    };
    assert_eq!(report(&[]), before);
    std::fs::remove_file(bench.path("found/commission.json")).unwrap();
    let again = report(&["--grid", "8", "--model", "preisach"]);
    let figures = |text: &str| text.split_once("## Acceptance").unwrap().1.to_owned();
    assert_eq!(figures(&again[1]), figures(&before[1]));
}
