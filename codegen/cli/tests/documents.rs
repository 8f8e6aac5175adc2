//! Links, files, tests, commands and options that the hand-written documents mention exist.

use std::collections::BTreeSet;
use std::fs;

use crate::support::commands::{pages, shell};
use crate::support::{Folder, repository};

/// Names of the documents, from the root.
fn documents() -> Vec<String> {
    let root = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(str::to_owned);
    root.into_iter().chain(pages()).collect()
}

fn read(name: &str) -> String {
    fs::read_to_string(repository().join(name)).unwrap()
}

/// Texts between backticks, outside of code blocks.
fn quoted(text: &str) -> Vec<String> {
    let plain: String = text.split("```").step_by(2).collect();
    plain.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn links_lead_somewhere() {
    let mut links = 0;
    for name in documents() {
        let folder = repository().join(&name).parent().unwrap().to_owned();
        let text = read(&name);
        for part in text.split("](").skip(1) {
            let target = part.split(')').next().unwrap();
            if !target.contains("://") {
                links += 1;
                let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
                let file = if file.is_empty() { repository().join(&name) } else { folder.join(file) };
                assert!(file.exists(), "{name} links to {target}");
                let is_heading = |line: &str| {
                    line.starts_with('#')
                        && line.to_lowercase().replace(' ', "-").replace('.', "").ends_with(&format!("#-{anchor}"))
                };
                let found = anchor.is_empty() || fs::read_to_string(file).unwrap().lines().any(is_heading);
                assert!(found, "{name} links to {target}");
            }
        }
    }
    assert!(links > 5, "{links} links");
}

#[test]
fn files_and_folders_that_are_named_exist() {
    let mut found = 0;
    for name in documents() {
        for word in quoted(&read(&name)) {
            let tops = ["codegen/", "firmware/", "host-sim/", "specs/", "tests/", "xtask/", "docs/"];
            let is_path = tops.iter().any(|top| word.starts_with(top)) && !word.contains(['*', ' ']);
            if is_path {
                found += 1;
                assert!(repository().join(&word).exists(), "{name} names {word}");
            }
        }
    }
    assert!(found > 20, "{found} paths");
}

/// A typical change needs few files, and they exist.
#[test]
fn a_typical_change_touches_at_most_three_files() {
    let text = read("CONTRIBUTING.md");
    let (_, below) = text.split_once("## Where would I change …").unwrap();
    let rows: Vec<&str> = below
        .lines()
        .skip_while(|line| !line.starts_with("|---"))
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .collect();
    assert!(rows.len() >= 10, "{} changes", rows.len());
    for row in rows {
        let places = quoted(row);
        assert!((1..=3).contains(&places.len()), "{row}");
        places.iter().for_each(|place| assert!(repository().join(place).exists(), "{row}"));
    }
}

/// Modules of tests that figures come from: the word before `--`, or the last, of a call of `cargo test`.
#[test]
fn tests_that_figures_come_from_exist() {
    let folders = ["tests/tests", "codegen/cli/tests"];
    let mut names = BTreeSet::new();
    for call in quoted(&read("docs/figures.md")) {
        let Some(words) = call.strip_prefix("… ").or_else(|| call.strip_prefix("cargo test --release -p ")) else {
            continue;
        };
        let last = words.split(" -- ").next().and_then(|filter| filter.split(' ').next_back()).unwrap();
        if !last.starts_with("specgen-") {
            names.insert(last.split("::").next().unwrap().to_owned());
        }
    }
    assert!(names.len() > 8, "{names:?}");
    for name in names {
        let files = [format!("{name}.rs"), format!("{name}/mod.rs")];
        let exists =
            folders.iter().any(|folder| files.iter().any(|file| repository().join(folder).join(file).is_file()));
        assert!(exists, "docs/figures.md names the test {name}");
    }
}

/// Each `specgen …` in the text is an existing command, with options from its help, or the main job on a spec.
#[test]
fn commands_and_options_of_the_documents_are_those_of_the_program() {
    let folder = Folder::new();
    let main = folder.run(&["--help"]).stdout;
    let mut commands = 0;
    for (name, line) in
        documents().iter().flat_map(|name| quoted(&read(name)).into_iter().map(move |line| (name, line)))
    {
        let Some(line) = line.strip_prefix("specgen ") else { continue };
        let words: Vec<&str> = line.split_whitespace().collect();
        let help = if words[0].ends_with(".toml") || words[0] == "SPEC" {
            let is_there = ["platform.toml", "SPEC"].contains(&words[0]) || repository().join(words[0]).is_file();
            assert!(is_there, "{name}: {line}");
            main.clone()
        } else {
            let below: &[&str] = match words[0] {
                "identify" | "export" => &words[..words.len().min(2)],
                _ => &words[..1],
            };
            let is_command =
                |word: &&str| word.chars().all(|c| c.is_ascii_lowercase() || c == '-') && !word.starts_with('-');
            let path: Vec<&str> = below.iter().copied().filter(is_command).chain(["--help"]).collect();
            let run = folder.run(&path);
            assert_eq!(run.code, 0, "{name} names the command {line}");
            run.stdout
        };
        for option in
            words.iter().map(|word| word.trim_matches(['[', ']', ',', ';'])).filter(|word| word.starts_with("--"))
        {
            let option = option.split('=').next().unwrap();
            let mut words = help.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
            assert!(words.any(|word| word == option), "{name}: `specgen {line}` has no {option}");
        }
        commands += 1;
    }
    assert!(commands >= 40, "{commands}");
}

/// The program of the page is compiled against the library of the reference spec, and moves the legs.
#[test]
#[ignore = "long: a library for C is built"]
#[cfg(target_os = "linux")]
fn the_example_in_c_runs() {
    let folder = Folder::new();
    let page = read("docs/from-simulink.md");
    let program = page.split("```c\n").nth(1).unwrap().split("```").next().unwrap();
    folder.write("example.c", program);
    folder.run(&["build", "reference.toml", "--target", "host", "-o", "host"]).says(0, &[]);
    let line = page.lines().find_map(|line| line.strip_prefix('`')?.split('`').next()?.strip_prefix("cc ")).unwrap();
    let run = shell(
        &folder.path(""),
        &format!("cc {line} -Wall -Werror -Wl,-rpath,$PWD/host/target/host/release && ./example"),
    );
    assert_eq!(run.code, 0, "{}", run.stderr);
    let volts: Vec<f64> = run
        .stdout
        .lines()
        .map(|line| line.split_whitespace().nth(2).and_then(|volts| volts.parse().ok()).unwrap())
        .collect();
    assert!(volts.len() == 6 && volts.iter().all(|volts| (1.0..=100.0).contains(volts)), "{}", run.stdout);
}

/// The status bits of the page match the emitted controller.
#[test]
fn status_bits_are_those_that_are_emitted() {
    let page = read("docs/control-law.md");
    let step = read("firmware/law/src/status.rs") + &read("firmware/runtime/src/supervisor/sift.rs");
    for (rows, constant, value) in [
        ("0–5", "LEG_LIMITED", 0x3f_u32),
        ("8–13", "GAUGE_FAULT", 0x3f00),
        ("16", "SETPOINT_FAULT", 1 << 16),
        ("17", "SETPOINT_STALE", 1 << 17),
        ("18", "GENERATOR_BUSY", 1 << 18),
        ("19", "WRENCH_FAULT", 1 << 19),
        ("6, 7, 14, 15", "TRIGGER_HIGH", 0xc0c0),
        ("20", "CORRECTION_LIMITED", 1 << 20),
        ("21", "TRIGGER_MISSED", 1 << 21),
        ("22", "SAMPLE_REPLACED", 1 << 22),
        ("23", "SAMPLE_REPEATED", 1 << 23),
    ] {
        assert!(page.contains(&format!("\n| {rows} | ")), "no row {rows}");
        let line = step.lines().find(|line| line.contains(&format!("const {constant}: u32"))).unwrap();
        let number = line.split("= ").nth(1).unwrap().trim_end_matches(';').replace('_', "");
        assert_eq!(u32::from_str_radix(number.trim_start_matches("0x"), 16), Ok(value), "{line}");
    }
}
