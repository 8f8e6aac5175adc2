//! Interrupted commands, and standard output or standard error that cannot be written.

#![cfg(unix)]

use crate::support;
use std::fs::{self, File};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Folder, Run};
use rustix::process::{Pid, Signal, kill_process_group};

/// A folder with a `cargo` that never ends, and a folder for temporary files.
fn with_slow_cargo() -> Folder {
    let folder = Folder::new();
    fs::create_dir_all(folder.path("bin")).unwrap();
    fs::create_dir_all(folder.path("tmp")).unwrap();
    let script = format!("#!/bin/sh\n: > '{}'\nexec sleep 20\n", folder.path("begun").display());
    folder.write("bin/cargo", script);
    fs::set_permissions(folder.path("bin/cargo"), fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

fn slow(folder: &Folder, arguments: &[&str]) -> Command {
    let mut command = folder.command();
    command.args(arguments).env("PATH", format!("{}:/usr/bin:/bin", folder.path("bin").display()));
    // A cached build would need no cargo.
    command.env("TMPDIR", folder.path("tmp")).env("SPECGEN_CACHE", "");
    command
}

/// Interrupts a command and its children as soon as it waits for cargo; `reproduce`, which needs none, once it has its own folder.
fn interrupted(folder: &Folder, arguments: &[&str], signal: Signal) -> Run {
    let _ = fs::remove_file(folder.path("begun"));
    let mut command = slow(folder, arguments);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0).spawn().unwrap();
    let start = Instant::now();
    while !folder.path("begun").exists() && (arguments[0] != "reproduce" || is_empty(folder, "tmp")) {
        assert!(start.elapsed() < Duration::from_secs(60), "{arguments:?} starts no cargo");
        std::thread::sleep(Duration::from_millis(10));
    }
    kill_process_group(Pid::from_raw(child.id().cast_signed()).unwrap(), signal).unwrap();
    Run::ended(&format!("{arguments:?}"), child.wait_with_output().unwrap())
}

fn is_empty(folder: &Folder, name: &str) -> bool {
    fs::read_dir(folder.path(name)).unwrap().next().is_none()
}

#[test]
fn an_interrupt_leaves_nothing_half_done() {
    let folder = with_slow_cargo();
    for (arguments, left) in [
        (&["sim", "legs.toml", "--emitted", "-o", "a/traces"][..], "a"),
        (&["reproduce", "-o", "rep"], "rep"),
        (&["report", "legs.toml", "-o", "page.html"], "page.html"),
        (&["replay", "legs.toml", "--csv", "rows.csv"], "rows.csv"),
    ] {
        if arguments[0] == "replay" {
            // A missing record, so a refusal before cargo.
            assert_eq!(folder.run(arguments).code, 1);
        } else {
            let run = interrupted(&folder, arguments, Signal::INT);
            run.says(130, &["error: interrupted: there is no result and no partial file"]);
            assert!(!run.stderr.contains("failed"), "{run:?}");
        }
        assert!(!folder.path(left).exists(), "{arguments:?} leaves {left}");
        assert!(is_empty(&folder, "tmp"), "{arguments:?}");
    }
    // Complete before the build started, so the next run can use it.
    let run = interrupted(&folder, &["legs.toml", "-o", "out"], Signal::INT);
    assert_eq!(run.code, 130, "{run:?}");
    assert!(is_empty(&folder, "tmp"));
    assert_eq!(folder.run(&["legs.toml", "-o", "out", "--no-build"]).code, 0);
}

/// A building run locks the folder: another run names its owner, and gets the lock once that is killed.
#[test]
fn a_folder_in_use_names_the_run_that_has_it() {
    let folder = with_slow_cargo();
    let mut command = slow(&folder, &["legs.toml", "-o", "out"]);
    let mut builds = command.stdout(Stdio::null()).stderr(Stdio::null()).process_group(0).spawn().unwrap();
    let start = Instant::now();
    while !folder.path("begun").exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "it starts no cargo");
        std::thread::sleep(Duration::from_millis(10));
    }
    let owner = format!("process {} (`", builds.id());
    let words = ["output folder `out` is in use by ", &owner, "legs.toml -o out`)", "nothing was written", "-o"];
    folder.run(&["legs.toml", "-o", "out", "--no-build"]).says(3, &words);
    kill_process_group(Pid::from_raw(builds.id().cast_signed()).unwrap(), Signal::KILL).unwrap();
    builds.wait().unwrap();
    assert!(folder.path(".out.specgen/lock").exists());
    assert_eq!(folder.run(&["legs.toml", "-o", "out", "--no-build"]).code, 0);
    assert!(!folder.path(".out.specgen").exists());
}

#[test]
fn an_end_from_outside_is_reported_to_programs() {
    let folder = with_slow_cargo();
    for signal in [Signal::TERM, Signal::HUP] {
        let run = interrupted(&folder, &["sim", "legs.toml", "--emitted", "--json"], signal);
        assert_eq!((run.code, run.stderr.as_str()), (130, ""));
        let document: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!((&document["exit_code"], &document["result"]), (&130.into(), &serde_json::Value::Null));
        assert!(document["error"].as_str().unwrap().starts_with("interrupted: "));
        assert!(is_empty(&folder, "tmp"));
    }
}

/// A device that is always full.
fn full() -> Option<File> {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").ok();
    if full.is_none() {
        support::skipped("there is no /dev/full here");
    }
    full
}

#[test]
fn output_that_is_not_whole_is_an_error() {
    let folder = Folder::new();
    for arguments in [&["dump-ir", "legs.toml"][..], &["check", "legs.toml", "--json"], &["completions", "bash"]] {
        let Some(full) = full() else { return };
        let output = folder.command().args(arguments).stdout(full).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {said}");
        assert!(said.contains("error: could not write to standard output: "), "{arguments:?}: {said}");
    }
    // A reader that closes the pipe early, such as `head`, is not an error.
    let script = format!("'{}' dump-ir legs.toml | head -1; echo \"${{PIPESTATUS[0]}}\"", support::BINARY);
    let output = Command::new("bash").args(["-c", &script]).current_dir(folder.path("")).output().unwrap();
    assert!(String::from_utf8(output.stdout).unwrap().ends_with("\n0\n"));
}

/// The exit code does not depend on whether the message can be written.
#[test]
fn messages_that_nobody_can_read_change_nothing() {
    let folder = Folder::new();
    for (arguments, code) in [(&["check", "nothing.toml"][..], 1), (&["check", "legs.toml"], 0), (&["--bogus"], 2)] {
        let Some(full) = full() else { return };
        let status = folder.command().args(arguments).stdout(Stdio::null()).stderr(full).status().unwrap();
        assert_eq!(status.code(), Some(code), "{arguments:?}");
    }
}

/// Output goes into a pipe, which is not replaced by a file. Nor is a folder left incomplete.
#[test]
fn a_pipe_stays_a_pipe() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.csv");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
    let mut reader = Command::new("cat").arg(&pipe).stdout(Stdio::piped()).spawn().unwrap();
    assert_eq!(folder.run(&["forc", "--grid", "4", "-o", "pipe.csv"]).code, 0);
    let mut rows = String::new();
    std::io::Read::read_to_string(&mut reader.stdout.take().unwrap(), &mut rows).unwrap();
    reader.wait().unwrap();
    assert!(rows.contains("displacement_um") && rows.lines().count() > 100);
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
}
