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
    drop(running.end(Signal::INT));
    let read = |name: &str| std::fs::read_to_string(bench.path(&format!("found/{name}"))).unwrap();
    let known: Value = serde_json::from_str(&read("commission.json")).unwrap();
    for leg in known["legs"].as_array().unwrap() {
        let rms = leg["arbitrary_rms"].as_f64().unwrap();
        assert!(rms < 500e-9, "{leg}");
    }
    let written = bench.path("found/platform.toml");
    assert!(read("platform.toml").contains("cross_talk = [\n"), "{}", read("platform.toml"));

    let commissioned = Bench::named(written.to_str().unwrap(), "commissioned");
    let (running, link) = serve(&commissioned, "second.rec");
    let output = commission(folder, &written, &link, &[]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("trajectory case-1, rms of x y z"), "{text}");
    drop(running.end(Signal::INT));
}
