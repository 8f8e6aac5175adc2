//! The main job on machines that lack the tools for microcontrollers: it does the rest, says what was skipped, and fails only
//! if that is asked for.

use std::path::Path;
use std::process::Command;

use crate::support::{Folder, Run, length};
use serde_json::Value;
use specgen::target;

/// The main job on the legs, with `PATH` set to `tools`.
fn main_job(folder: &Folder, tools: &Path, more: &[&str]) -> Command {
    let mut command = folder.command();
    command
        .args(["legs.toml", "-o", "out"])
        .args(more)
        .env("SPECGEN_TOOLS", tools)
        .env("XDG_CACHE_HOME", folder.path("no-cache"));
    command
}

fn json(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap_or_else(|error| panic!("not one document: {error}\n{}", run.stdout))
}

#[test]
fn without_tools_everything_else_is_done_and_one_line_says_what_was_left_out() {
    let folder = Folder::new();
    let nothing = tempfile::tempdir().unwrap();
    let run = Run::of(&mut main_job(&folder, nothing.path(), &[]));
    run.says(0, &[]);
    let lines: Vec<&str> = run.stderr.lines().filter(|line| line.contains("skipped:")).collect();
    assert_eq!(lines.len(), 1, "{}", run.stderr);
    let verdict = [
        "legs is good so far on 10 assumed values: ",
        "  skipped  the image for the microcontroller (time, memory, bits)\n",
        " --setup\n",
    ];
    assert!(verdict.iter().all(|words| run.stdout.contains(words)), "{}", run.stdout);
    for words in ["the image for the microcontroller", "thumbv7em-none-eabihf", "specgen SPEC --setup"] {
        assert!(lines[0].contains(words), "no `{words}` in: {}", lines[0]);
    }
    assert!(run.stderr.contains("host library: "), "{}", run.stderr);
    for file in [
        "controller/src/lib.rs",
        "law/src/platform/step.rs",
        "host/Cargo.toml",
        "qemu/Cargo.toml",
        "runtime/Cargo.toml",
    ] {
        assert!(folder.path("out").join(file).is_file(), "{file}");
    }

    // If they are required, exit code 3 with the same result.
    if length(false, true) {
        let run = Run::of(&mut main_job(&folder, nothing.path(), &["--require-target"]));
        run.says(3, &["error: skipped: the image for the microcontroller"]);
        assert!(run.stderr.contains("host library: "), "{}", run.stderr);
    }
    for (more, code) in [(&["--json", "--require-target"][..], 3), (&["--json"], 0)].into_iter().take(length(1, 2)) {
        let run = Run::of(&mut main_job(&folder, nothing.path(), more));
        let document = json(&run);
        assert_eq!((run.code, &document["exit_code"]), (code, &Value::from(code)));
        assert!(document["result"]["host_library"].is_string(), "{document:#}");
        assert!(document["result"]["measurement"].is_null() && document["result"]["image"].is_null());
        assert!(document["result"]["missing"].as_str().unwrap().contains("specgen SPEC --setup"), "{document:#}");
    }
}

#[test]
#[ignore = "long: missing tools are in the short run"]
fn set_up_that_fails_says_what_was_tried_and_the_job_goes_on() {
    let folder = Folder::new();
    let nothing = tempfile::tempdir().unwrap();
    let run = Run::of(&mut main_job(&folder, nothing.path(), &["--setup"]));
    run.says(0, &["rustup was not found", "apt-get was not found", "continuing without"]);
    assert!(run.stderr.contains("skipped: the image for the microcontroller"), "{}", run.stderr);
    assert!(run.stderr.contains("could not be set up: rustup target add: rustup was not found"), "{}", run.stderr);
    assert!(folder.path("out/law/src/platform/step.rs").is_file());
    if length(false, true) {
        let required = ["--setup", "--require-target"];
        Run::of(&mut main_job(&folder, nothing.path(), &required)).says(3, &["could not be set up"]);
    }
}

#[cfg(unix)]
#[test]
#[ignore = "long: an image by another compiler's name"]
fn without_the_emulator_alone_the_image_is_built_and_looked_at() {
    let Some(found) = target::found_or_skipped(target::toolchain::find()).unwrap() else { return };
    let folder = Folder::new();
    let tools = tempfile::tempdir().unwrap();
    for (name, program) in [("rustc", &found.rustc), ("cargo", &found.cargo)] {
        std::os::unix::fs::symlink(program, tools.path().join(name)).unwrap();
    }
    if found.linker.is_some() || !found.libraries.is_empty() {
        crate::support::skipped("the cross compiler here is more than two programs");
        return;
    }
    // An emulator that does not run counts as missing.
    std::fs::write(tools.path().join("qemu-system-arm"), "").unwrap();
    let run = Run::of(&mut main_job(&folder, tools.path(), &["--json"]));
    let document = json(&run);
    assert_eq!(run.code, 0, "{document:#}");
    let image = &document["result"]["image"];
    assert!(image["flash"].as_u64().unwrap() > 10_000, "{document:#}");
    assert!(image["stack_bound"].as_u64().unwrap() > 100, "{document:#}");
    assert_eq!(image["forbidden_symbols"], serde_json::json!([]));
    let missing = document["result"]["missing"].as_str().unwrap();
    assert!(missing.starts_with("skipped: running the image"), "{missing}");
    assert!(missing.contains("apt-get install qemu-system-arm"), "{missing}");
    assert_eq!(missing.lines().count(), 1);
    // Without the size of state and settings there is no RAM figure, and the text says so.
    let verdict = &document["result"]["verdict"];
    let figures: Vec<&str> =
        verdict["figures"].as_array().unwrap().iter().filter_map(|one| one["name"].as_str()).collect();
    assert!(figures.contains(&"flash") && figures.contains(&"stack") && !figures.contains(&"RAM"), "{figures:?}");
    assert_eq!(verdict["unmeasured"], "running the image (time, RAM, bits)");
    assert!(image["used"]["ram"].is_null() && image["ram_static"].is_u64(), "{document:#}");
}

/// Asserts that the README shows the command's output, except for the path of the spec, and for figures that depend on the compiler.
fn is_shown_in_the_readme(lines: &[&str], compiler: &str) {
    let readme = std::fs::read_to_string(crate::support::repository().join("README.md")).unwrap();
    let version = compiler.split(' ').nth(1).unwrap();
    let is_of_the_readme = readme.contains(&format!("(rustc {version})"));
    if !is_of_the_readme {
        crate::support::skipped(&format!("no committed figures of the README for {compiler}"));
    }
    let depends = |line: &str| {
        let places = ["  next "].iter().chain(["  time ", "  memory "].iter().filter(|_| !is_of_the_readme));
        places.into_iter().any(|subject| line.starts_with(subject))
    };
    let shown: Vec<&str> =
        readme.lines().skip_while(|line| !line.starts_with("reference is ")).take(lines.len()).collect();
    for (shown, line) in shown.iter().zip(lines) {
        assert!(
            shown == line || (depends(shown) && depends(line)),
            "README.md shows `{shown}`, the command prints `{line}`"
        );
    }
}

/// At most ten lines of at most eighty letters, after a build with measurements, or with the reason why it is not ready.
#[test]
fn the_main_job_answers_in_ten_lines() {
    let Some(tools) = crate::support::tools() else { return };
    let folder = Folder::new();
    folder.spec("small.toml", &[("instructions = 3000", "instructions = 300")]);
    let jobs = [
        (
            "reference.toml",
            0,
            ["reference is ready on 14 assumed values: ", "agree in every bit over 20,000 ticks", "≤ 4,500"],
        ),
        ("small.toml", 1, ["legs is NOT ready: instructions 2,", "> 300", "  next     specgen size small.toml"]),
    ];
    // One that is not ready needs another controller, so only in the full run.
    for (spec, code, words) in jobs.into_iter().take(length(1, 2)) {
        let run = folder.run(&[spec, "-o", "out/made"]);
        assert_eq!(run.code, code, "{run:?}");
        let lines: Vec<&str> = run.stdout.lines().collect();
        assert!(lines.len() <= 10 && lines.iter().all(|line| line.chars().count() <= 80), "{}", run.stdout);
        assert!(words.iter().all(|words| run.stdout.contains(words)), "{}", run.stdout);
        if code == 0 {
            is_shown_in_the_readme(&lines, &tools.toolchain.version);
        }
        for subject in ["reach", "noise", "record", "margins", "time", "memory", "bits", "assumed", "next"] {
            assert!(lines.iter().any(|line| line.starts_with(&format!("  {subject:<9}"))), "{subject}: {}", run.stdout);
        }
    }
}
