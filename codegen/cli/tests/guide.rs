//! Follows the tutorials: runs their commands in order, in one folder, and compares the form of the output.

use std::fs;
use std::time::Instant;

use crate::support::commands::{blocks, is_marked, shell};
use crate::support::{length, repository};

/// A line with each number replaced by `#`. Columns may move.
fn form(line: &str) -> String {
    let mut out = String::new();
    for word in line.split_whitespace() {
        let mut digits = false;
        for letter in word.chars() {
            let number = letter.is_ascii_digit() || (digits && letter == '.');
            if !number {
                out.push(letter);
            } else if !digits {
                out.push('#');
            }
            digits = number;
        }
        out.push(' ');
    }
    out
}

/// Shown lines whose form no line of the output has.
fn missing(shown: &str, output: &str) -> Vec<String> {
    let forms: Vec<String> = output.lines().map(form).collect();
    let is_there = |line: &&str| line.trim() == "…" || forms.contains(&form(line));
    shown.lines().filter(|line| !is_there(line)).map(str::to_owned).collect()
}

/// An option that is shorter in the short run; the form of the output is the same.
const SHORTER: [(&str, &str); 1] = [("--draws 10", "--draws 2")];
/// The tutorials, in reading order.
const TUTORIALS: [&str; 3] = ["first-controller.md", "your-platform.md", "guide.md"];

#[test]
fn the_tutorials_can_be_walked() {
    let folder = tempfile::tempdir().unwrap();
    let specs = folder.path().join("specs");
    fs::create_dir_all(&specs).unwrap();
    fs::copy(repository().join("specs/minimal.toml"), specs.join("minimal.toml")).unwrap();
    let mut here = folder.path().to_owned();
    let (mut commands, mut compared) = (0, 0);
    for page in TUTORIALS {
        let text = fs::read_to_string(repository().join("docs").join(page)).unwrap();
        let mut output = None;
        for block in blocks(&text) {
            let place = format!("{page}:{}", block.line);
            match (block.language.as_str(), output.take()) {
                ("sh", _) => {
                    let script: String =
                        block.body.lines().filter(|line| !is_marked(line)).map(|line| format!("{line}\n")).collect();
                    let shorter = |text: String, (long, short): &(&str, &str)| text.replace(long, short);
                    let script = length(&SHORTER[..], &[]).iter().fold(script, shorter);
                    commands += script.lines().filter(|line| line.starts_with("specgen ")).count();
                    let start = Instant::now();
                    let folder = folder.path().join("place");
                    let run = shell(&here, &format!("{script}\npwd > '{}'", folder.display()));
                    println!("{:5.1} s  {place}", start.elapsed().as_secs_f64());
                    assert_eq!(run.code, 0, "{place}\n{script}{}\n{}", run.stdout, run.stderr);
                    here = fs::read_to_string(folder).unwrap().trim().into();
                    // Nothing to compare if all commands are only parsed.
                    output = script.contains("specgen ").then_some(run.stdout);
                }
                // A block directly after commands is their output.
                ("text", Some(printed)) => {
                    let missing = missing(&block.body, &printed);
                    assert!(missing.is_empty(), "{place} shows {missing:#?}, the command printed:\n{printed}");
                    compared += 1;
                }
                _ => {}
            }
        }
    }
    assert!(commands >= 10 && compared >= 6, "{commands} commands, {compared} outputs");
    assert!(here.ends_with("bench") && here.join("run.csv").is_file() && here.join("report.html").is_file());
}

/// docs/porting.md: the generated workspace, with the drivers of the example. `tests/tests/porting.rs` builds its programs.
#[test]
#[ignore = "long: packages of a board built and tested"]
fn the_page_about_porting_can_be_walked() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(repository().join("docs/porting.md")).unwrap();
    // Third-party packages do not change between runs.
    let (root, target) = (repository(), repository().join("target/tests/own-board"));
    let script: String = blocks(&text)
        .iter()
        .filter(|block| block.language == "sh")
        .flat_map(|block| block.body.lines())
        .filter(|line| !is_marked(line))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(script.contains(" --board") && script.contains("cargo test"), "{script}");
    let environment = format!("export SPECGEN='{}' CARGO_TARGET_DIR='{}'", root.display(), target.display());
    let run = shell(folder.path(), &format!("{environment}\n{script}"));
    assert_eq!(run.code, 0, "{script}{}\n{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("test result: ok. 6 passed"), "{}", run.stdout);
}

/// The check detects another form, and only that.
#[test]
fn a_line_that_is_not_said_is_seen() {
    let said = "error, nm rms  23.98 |  23.74\ngate: passed\n";
    assert_eq!(missing("error, nm rms 7.1 | 120.5\n…\n", said), Vec::<String>::new());
    for other in ["error, um rms  23.98 |  23.74", "gate: failed", "error, nm rms  23.98"] {
        assert_eq!(missing(other, said), [other]);
    }
}
