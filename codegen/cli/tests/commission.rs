//! `specgen commission` as a user runs it, with a board on simulated converters at a socket, in real time. The whole of it, with a
//! new controller: `rt_pc/commission.rs`.

#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

use std::process::{Command, Stdio};

use controller::supervised::Phase;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::operate::{SocketBoard, wait};
use crate::support::{Folder, Run};

fn commission(folder: &Folder, board: &SocketBoard, more: &[&str]) -> Command {
    let mut command = folder.command();
    command.args(["commission", "reference.toml", "--socket"]).arg(&board.path).args(more).stdin(Stdio::null());
    command
}

fn state(folder: &Folder) -> Value {
    serde_json::from_str(&folder.read("commission/commission.json")).unwrap()
}

/// Nothing is sent without an agreement, and nothing that cannot be.
#[test]
fn a_plan_is_shown_first_and_one_that_leaves_the_workspace_is_refused() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    for more in [&["--plan"][..], &[], &["--step", "curves"]] {
        let run = Run::of(&mut commission(&folder, &board, more));
        run.says(0, &["nothing was sent"]);
        assert!(run.stdout.contains(" min of machine time") && board.is(Phase::Disarmed), "{run:?}");
        assert!(!folder.path("commission").exists());
    }
    let minutes = |text: &str| text.split("about ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
    let run = folder.run(&["commission", "reference.toml", "--plan"]);
    assert!((5.0..=15.0).contains(&minutes(&run.stdout)), "{run:?}");
    folder.run(&["commission", "reference.toml", "--yes"]).says(2, &["name the device with --port or --socket"]);
    let rotation = "[\"0.4 mrad\", \"0.35 mrad\", \"0.5 mrad\"]";
    let narrow = folder.read("reference.toml").replacen(rotation, "[\"0.1 mrad\", \"0.1 mrad\", \"0.1 mrad\"]", 1);
    folder.write("narrow.toml", narrow);
    let narrow = folder.run(&["commission", "narrow.toml", "--plan"]);
    narrow.says(1, &["the platform would leave its workspace", "nothing was sent"]);
    folder.run(&["commission", "legs.toml", "--plan"]).says(2, &["expected a spec with [control]"]);
    assert!(board.is(Phase::Disarmed));
}

#[test]
fn a_step_runs_alone_is_kept_and_an_interrupt_ramps_down() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    let first = ["--step", "wiring", "--yes", "--machine", "stage 7", "--skip", "identify=another day"];
    let run = Run::of(&mut commission(&folder, &board, &first));
    run.says(0, &["the wiring check passed"]);
    assert!(board.is(Phase::Disarmed));
    let known = state(&folder);
    let noise = &known["rest"][1]["rms"];
    assert!((0.5e-9..5e-9).contains(&noise[2].as_f64().unwrap()), "{known}");
    assert_eq!((&known["machine"], &known["steps"]["identify"]["skipped"]), (&"stage 7".into(), &"another day".into()));
    let page = folder.read("commission/commission.md");
    assert!(page.contains("machine stage 7") && page.contains("distinguishes all single faults"), "{page}");
    for part in ["    check by hand: each cable", "    gauge 5: ", "  the amplifiers add, rms: x ", "amplifiers off: "]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert!(run.stdout.starts_with(&page), "{run:?}");
    // Done: the next run has nothing of it to do, and the page comes from the records.
    Run::of(&mut commission(&folder, &board, &["--step", "wiring", "--yes"])).says(0, &[]);
    std::fs::remove_file(folder.path("commission/commission.md")).unwrap();
    folder.run(&["commission", "reference.toml", "--report"]).says(0, &[]);
    assert_eq!(folder.read("commission/commission.md"), page);

    let mut command = commission(&folder, &board, &["--step", "cross-talk", "--yes"]);
    let running = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait(&board, Phase::Driving);
    kill_process(Pid::from_raw(running.id().cast_signed()).unwrap(), Signal::INT).unwrap();
    let output = running.wait_with_output().unwrap();
    let shown = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{shown}");
    assert!(
        shown.contains("interrupted; the machine is disarmed, amplifiers off; the same command continues"),
        "{shown}"
    );
    assert!(board.is(Phase::Disarmed) && !folder.path("commission/leg0-cross-talk.csv").exists());
    assert!(state(&folder)["steps"]["cross-talk"].is_null());
    // Another spec has another folder.
    folder.write("other.toml", folder.read("reference.toml").replacen("1.195 kg", "1.2 kg", 1));
    folder.run(&["commission", "other.toml", "--report"]).says(1, &["has records of another spec", "--again"]);
}
