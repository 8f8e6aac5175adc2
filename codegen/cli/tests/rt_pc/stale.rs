//! A machine whose gauges are no longer read: old measurements are not shown as current.

use std::process::Command;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::Value;

use super::{Bench, ProcessGuard, signal, wait_for};

/// Disarmed, because then a silent converter causes no fault. Its record, which contains NaN gauges, replays bit for bit.
#[test]
#[ignore = "long: another session"]
fn a_pose_that_is_not_measured_is_not_shown_as_that_of_now() {
    let bench = Bench::named("reference.toml", "stale");
    let link = bench.path("stale.link");
    let mut command = bench.command("stale.rec");
    command.args(["--elastic", "--sim-timeout", "1500", "--link-silence", "5000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let operate = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg("operate").arg("--socket").arg(&link).args(more);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let place = || -> Value {
        let document: Value = serde_json::from_str(&operate(&["--json", "where"])).unwrap();
        document["result"]["answers"][0]["answer"].clone()
    };
    // At first there was no tick.
    wait_for("a pose", || place()["pose"].is_array());
    // On a busy computer ticks may pause, which is then reported.
    wait_for("a text with the pose", || !operate(&["where", "status"]).contains("pose not measured:"));

    signal(&bench.plant, Signal::STOP);
    std::thread::sleep(Duration::from_millis(800));
    // While it waits for the reading, there is no tick.
    let text = operate(&["where", "status"]);
    assert!(text.contains("not measured: no tick for") && text.contains(" s ago"), "{text}");
    assert!(text.contains("voltages unknown") && text.contains("this is its state"), "{text}");
    // Then ticks continue without it.
    wait_for("ticks", || place()["why"] == "the gauges are not read");
    let found = place();
    assert!(found["pose"].is_null() && found["error"].is_null() && found["voltage"].is_null(), "{found}");
    assert!(found["last"]["age"].as_f64().unwrap() > 1.0 && found["last"]["pose"].is_array(), "{found}");
    signal(&bench.plant, Signal::CONT);
    wait_for("a pose again", || place()["pose"].is_array());

    let (_, record) = bench.check(&running.end(Signal::INT), "stale.rec");
    let gauge = record.place("gauge[0]");
    assert!(record.rows.iter().any(|row| f64::from_bits(row.input[gauge]).is_nan()));
}
