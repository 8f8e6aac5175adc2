//! A repeated motion, learned over the link on the real-time program and played there with the learned correction.

use std::path::Path;
use std::process::{Command, Output};

use rustix::process::Signal;
use serde_json::Value;

use super::host::Host;
use super::{Bench, DISARMED, ProcessGuard, wait_for};

fn specgen(bench: &Bench, arguments: &[&str], link: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
    command.args(arguments).arg("--socket").arg(link).current_dir(bench.folder.path());
    command.output().unwrap()
}

/// With elastic time, so that it runs on any computer. The first pass has no correction. The learned correction must be much better on a
/// machine with hysteresis and tolerances unknown to its controller, also when it is played from its file.
#[test]
#[ignore = "long: learning over the link of the real-time program"]
fn a_motion_is_learned_over_the_link_and_played_under_what_was_learned() {
    let folder = tempfile::tempdir().unwrap();
    let spec = folder.path().join("learning.toml");
    let specs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs");
    std::os::unix::fs::symlink(specs.join("records").canonicalize().unwrap(), folder.path().join("records")).unwrap();
    let text = std::fs::read_to_string(specs.join("reference.toml")).unwrap();
    let text = text.replacen("[control]\n", "[control]\ncorrection = \"2 um\"\nactive_damping = true\n", 1).replacen(
        "\"1 Hz\"",
        "\"10 Hz\"",
        1,
    );
    std::fs::write(&spec, text + &crate::support::damping_design()).unwrap();
    let bench = Bench::of(&spec);
    let link = bench.path("learn.link");
    let mut command = bench.command("learn.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "1000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());

    let spec = spec.to_str().unwrap();
    let learn = |more: &[&str]| {
        let given = ["learn", spec, "--trajectory", "case-1", "--passes", "4", "--output", "t.json", "--json"];
        specgen(&bench, &[&given[..], more].concat(), &link)
    };
    let unnamed = learn(&[]);
    let said = String::from_utf8_lossy(&unnamed.stdout) + String::from_utf8_lossy(&unnamed.stderr);
    assert!(unnamed.status.code() == Some(2) && said.contains("--machine NAME"), "{said}");
    // By the host, then in the idle time of the program; the command verifies the result with the same kernel.
    let mut nm = Vec::new();
    for more in [&["--machine", "stage-7"][..], &["--machine", "stage-7", "--on-device", "65536"]] {
        let output = learn(more);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        let found = &found["result"];
        let (passes, best) = (found["passes"].as_array().unwrap(), found["best"].as_u64().unwrap() as usize);
        nm = passes.iter().map(|pass| pass["translation_nm"].as_f64().unwrap()).collect();
        println!("over the link, nm by the gauges: {nm:.2?}");
        assert!(passes.len() == 5 && nm[best] < 0.5 * nm[0], "{found}");
        let mut host = Host::open(&link, 9).unwrap();
        host.wait("rest", |status| status.phase == DISARMED && !status.amplifier_on);
    }

    let operate = |more: &[&str]| {
        let begin = ["operate", spec, "arm", "wait 0.3", "run", "wait running", "wait arrived"];
        specgen(&bench, &[&begin[..], more, &["ramp-down", "wait disarmed"]].concat(), &link)
    };
    let other = operate(&["play case-1 correction=t.json machine=stage-8"]);
    let said = String::from_utf8_lossy(&other.stderr);
    assert!(!other.status.success() && said.contains("stage-7") && said.contains("nothing was sent"), "{said}");
    let played = operate(&["play case-1 correction=t.json machine=stage-7"]);
    let text = String::from_utf8_lossy(&played.stdout);
    assert!(played.status.success(), "{text}{}", String::from_utf8_lossy(&played.stderr));
    let again: f64 = text.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(again < 0.5 * nm[0], "{again} {nm:?}");

    let output = running.end(Signal::INT);
    let (_, record) = bench.check(&output, "learn.rec");
    // The correction is an input of the tick, so it is in the record.
    let place = record.place("correction[0]");
    assert!(record.rows.iter().filter(|row| row.input[place] << 1 != 0).count() > 10_000);
}
