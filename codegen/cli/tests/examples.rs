//! The examples of every help text run unchanged; the program accepts the commands in documents.

#![allow(clippy::disallowed_methods, reason = "what stands in a test is emitted nowhere")]
use crate::support;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::time::Instant;

use crate::support::commands::{Line, blocks, pages, shell};
use crate::support::{Folder, repository};

/// Every command with its path, such as `specgen identify linear`, and the examples below its help.
fn examples() -> Vec<(String, Vec<Line>)> {
    fn walk(path: &str, command: &clap::Command, found: &mut Vec<(String, Vec<Line>)>) {
        let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        found.push((path.to_owned(), text.lines().filter_map(|line| Line::of(path, line)).collect()));
        for below in command.get_subcommands() {
            walk(&format!("{path} {}", below.get_name()), below, found);
        }
    }
    let mut found = Vec::new();
    walk("specgen", &specgen::cli::command(), &mut found);
    found
}

#[test]
fn every_command_has_examples_that_the_program_takes() {
    let found = examples();
    assert!(found.len() > 20, "{}", found.len());
    for (path, lines) in &found {
        assert!(!lines.is_empty(), "{path} has no example");
        let own = |line: &&Line| path == "specgen" || line.words.join(" ").starts_with(path.as_str());
        assert_eq!(lines.iter().filter(own).count(), lines.len(), "{path}: an example of another command");
        let faults: Vec<String> = lines.iter().filter_map(Line::fault).collect();
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}

/// Records of a leg with 0.1262 µm/V and a resonance at 400 Hz, of its gauge and of its stiffness, 10 N/µm.
fn prepared() -> Folder {
    let folder = Folder::new();
    fs::copy(folder.path("reference.toml"), folder.path("platform.toml")).unwrap();
    let learning = fs::read_to_string(folder.path("reference.toml")).unwrap();
    let learning = learning.replacen("[control]\n", "[control]\ncorrection = \"2 um\"\n", 1);
    fs::write(folder.path("learning.toml"), learning).unwrap();
    fs::copy(repository().join("tests/oracle/dynamics-reference.json"), folder.path("states.json")).unwrap();
    let write = |name: &str, header: &str, rows: &mut dyn Iterator<Item = [f64; 3]>| {
        let text = rows.fold(format!("{header}\n"), |mut text, [a, b, c]| {
            writeln!(text, "{a},{b},{c}").unwrap();
            text
        });
        folder.write(name, text);
    };
    for (name, frequency) in [("1hz.csv", 1.0), ("10hz.csv", 10.0)] {
        let row = |k: u32| {
            let time = f64::from(k) / 400.0 / frequency;
            let drive = 50.0 - 40.0 * (TAU * frequency * time).cos();
            // The residual must not be zero, or there would be no standard error.
            [time, drive, 0.6 + 0.1262 * drive + 1e-4 * (f64::from(k) * 1.7).sin()]
        };
        write(name, "time_s,drive_V,displacement_um", &mut (0..=1600).map(row));
    }
    // Sweeps from 5 Hz to 1 kHz; the leg integrated in small steps.
    let (mut place, mut speed, step) = (0.0, 0.0, 1.0 / 160_000.0);
    let rows = (0..40_000).map(|k: u32| {
        let time = f64::from(k) * 1e-4;
        let rate = 200_f64.ln();
        let drive = 2.0 * (TAU * 5.0 / rate * ((rate * (time % 1.0)).exp() - 1.0)).sin();
        let row = [time, drive, place + 1e-4 * (f64::from(k) * 1.7).sin()];
        let natural = TAU * 400.0;
        for _ in 0..16 {
            speed += step * (natural * natural * (0.1262 * drive - place) - 0.2 * natural * speed);
            place += step * speed;
        }
        row
    });
    write("sweep.csv", "time_s,drive_V,displacement_um", &mut rows.collect::<Vec<_>>().into_iter());
    let gauge = |k: u32| {
        let volts = -5.0 * (TAU * f64::from(k) / 400.0).cos();
        [f64::from(k) * 0.1, volts + 1e-4 * (f64::from(k) * 1.7).sin(), 5.0 * volts]
    };
    write("gauge.csv", "time_s,gauge_V,reference_um", &mut (0..=800).map(gauge));
    let force = |k: u32| {
        let newtons = 20.0 * (1.0 - (TAU * f64::from(k) / 1000.0).cos());
        [f64::from(k) * 0.01, newtons, 5.0 + newtons / 10.0 + 1e-3 * (f64::from(k) * 1.7).sin()]
    };
    // Three strokes of each leg alone, as `watch` writes them.
    for leg in 0..6 {
        let six = |name: &str, unit: &str| (0..6).map(|k| format!(",{name}[{k}]{unit}")).collect::<String>();
        let mut text = format!("phase,time_s{}{}\n", six("volts", "_mean_V"), six("leg", "_m"));
        for row in 0..75 {
            let time = f64::from(row) * 0.02;
            let volts = 10.0 * (1.0 - (TAU * 2.0 * time).cos());
            let of =
                |own: f64, other: f64| (0..6).map(|k| format!(",{}", if k == leg { own } else { other })).collect();
            let (drives, lengths): (String, String) = (of(volts, 0.0), of(6e-7 * volts, 2e-9 * volts));
            writeln!(text, "6,{time}{drives}{lengths}").unwrap();
        }
        folder.write(&format!("leg{leg}.csv"), text);
    }
    folder.write("candidates.json", "[{}, {\"level\": 0.2, \"drift\": 0.03}]");
    write("force.csv", "time_s,force_N,displacement_um", &mut (0..4000).map(force));
    folder
}

#[test]
fn examples_run_as_they_stand() {
    let folder = prepared();
    let mut lines: Vec<Line> = Vec::new();
    // Other tests run these: `export`, `fmu`, `tune`, `robust`, `refit`, `report`, the tutorials in `guide` and, in the full run,
    // `platform_tables`.
    let elsewhere = [
        "sim platform.toml --frequency",
        "sim platform.toml --trajectory",
        "build legs.toml --target host",
        "report legs.toml",
        "specgen export",
        "learning.toml --from",
        "learning.toml --prepare",
        "learning.toml --excite",
        "learning.toml --response",
        "tune legs.toml --evaluations",
        "robust legs.toml --draws",
        "identify run.rec --spec",
        "robust merge",
        "legs.toml --paper",
    ];
    let elsewhere = support::length(&elsewhere[..], &[]);
    for line in examples().into_iter().flat_map(|(_, lines)| lines).filter(|line| !line.is_marked()) {
        if elsewhere.iter().any(|part| line.text.contains(part)) {
            support::skipped(&format!("only in the full run: {}", line.text));
            continue;
        }
        if lines.iter().all(|other| other.words != line.words) {
            lines.push(line);
        }
    }
    // Records first: others read them.
    lines.sort_by_key(|line| line.words[1] != "forc");
    assert!(lines.len() > 25, "{} examples", lines.len());
    let (mut failed, mut helped) = (Vec::new(), false);
    for line in &lines {
        let start = Instant::now();
        let learns = line.text.contains("learn learning.toml -o case-1.json");
        // Fewer frequencies, to shorten the search for convergence; a fixed grid, instead of a search.
        let less = match (learns, line.text.contains("--columns")) {
            (true, _) => support::length(" --bandwidth 100 --passes 1", ""),
            (_, true) => support::length(" --grid 32", ""),
            _ => "",
        };
        let run = shell(&folder.path(""), &format!("{}{less}", line.text));
        println!("{:5.1} s  {}", start.elapsed().as_secs_f64(), line.text);
        if run.code != 0 {
            failed.push(format!("{}: `{}`: {run:#?}", line.place, line.text));
        }
        if learns && less.is_empty() {
            assert!(run.stdout.contains(" Hz, damp the modes: `control.active_damping = true`\n"), "{run:#?}");
        }
        helped |= learns;
    }
    assert!(failed.is_empty() && helped, "{}", failed.join("\n"));
    for made in [
        "table.csv",
        "table.svg",
        "predicted.csv",
        "predicted.svg",
        "leg.toml",
        "run.csv",
        "forces.json",
        "specgen.bash",
    ]
    .iter()
    .chain(support::length(&[][..], &["legs.html"]))
    {
        assert!(folder.path(made).is_file(), "no {made}");
    }
}

/// Documents: name and text.
fn documents() -> Vec<(String, String)> {
    let names = ["README.md", "ARCHITECTURE.md"].map(str::to_owned).into_iter().chain(pages());
    let read = |name: String| (name.clone(), fs::read_to_string(repository().join(name)).unwrap());
    // Generated pages with commands.
    let findings = ("findings".to_owned(), specgen::findings::reference_markdown());
    let keys = ("keys".to_owned(), specgen::spec::reference_markdown());
    names.map(read).chain([findings, keys]).collect()
}

/// Lines that call specgen in the blocks of a document, each with the language of its block.
fn commands_of(name: &str, text: &str) -> Vec<(String, Line)> {
    let mut lines = Vec::new();
    for block in blocks(text) {
        let joined = block.body.replace("\\\n", " ");
        let found = joined.lines().filter_map(|line| Line::of(&format!("{name}:{}", block.line), line));
        lines.extend(found.map(|line| (block.language.clone(), line)));
    }
    lines
}

fn is_known(command: &str) -> bool {
    specgen::cli::command().find_subcommand(command).is_some()
}

#[test]
fn commands_in_documents_are_those_of_the_program() {
    let mut count = 0;
    let mut faults = Vec::new();
    for (name, text) in documents() {
        for (language, line) in commands_of(&name, &text) {
            count += 1;
            faults.extend(line.fault());
            if language != "sh" {
                faults.push(format!("{}: commands stand in blocks of `sh`: {}", line.place, line.text));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(count > 40, "{count} commands");
}

/// Within a sentence an argument may be omitted, but commands and options must exist.
#[test]
fn commands_within_sentences_are_those_of_the_program() {
    let mut count = 0;
    for (name, text) in documents() {
        let plain: String = text.split("```").step_by(2).collect();
        for quoted in plain.split('`').skip(1).step_by(2).filter(|quoted| !quoted.contains(['[', '|', '…', '\n'])) {
            let Some(line) = Line::of(&name, quoted) else { continue };
            let [_, first, ..] = line.words.as_slice() else { continue };
            // Other words are taken as a spec.
            assert!(is_known(first) || first.contains(".toml") || first == "SPEC", "{name}: `{quoted}`");
            let parsed = specgen::cli::command().try_get_matches_from(&line.words);
            if let Err(error) = parsed {
                use clap::error::ErrorKind::{DisplayHelp, InvalidValue, MissingRequiredArgument, MissingSubcommand};
                let left_out = [DisplayHelp, MissingRequiredArgument, MissingSubcommand].contains(&error.kind());
                // `--target NAME` stands for its values.
                let stands_for = |word: &String| word.chars().all(|letter| letter.is_ascii_uppercase());
                // `identify -o` names an option.
                let named = line.words.last().is_some_and(|word| word.starts_with('-'));
                let general = error.kind() == InvalidValue && (named || line.words.iter().skip(1).any(stands_for));
                assert!(left_out || general, "{name}: `{quoted}`\n{error}");
            }
            count += 1;
        }
    }
    assert!(count > 60, "{count} commands");
}

/// The check detects errors.
#[test]
fn a_command_that_is_not_there_is_seen() {
    let fault = |text: &str| Line::of("here", text).unwrap().fault();
    for bad in [
        "specgen chek platform.toml",
        "specgen check platform.toml --bogus",
        "specgen check",
        "specgen build platform.toml --target NAME",
        "cargo run --release -- sim platform.toml --frequency fast",
        "specgen plant platform.toml --cpu one &",
    ] {
        assert!(fault(bad).is_some(), "{bad}");
    }
    for good in [
        "specgen check platform.toml   # every finding --bogus",
        "specgen dump-ir a.toml > b --x",
        "specgen tune --help",
    ] {
        assert_eq!(fault(good), None);
    }
    assert!(Line::of("", "specgen flash a.toml # (board) x").unwrap().is_marked());
    assert!(!Line::of("", "specgen sim a.toml # takes (minutes)").unwrap().is_marked());
    assert!(Line::of("", "target/release/rt-pc --cpu 0").is_none());
    let found = commands_of("x.md", "text\n```text\nspecgen check \\\n  a.toml\nother\n```\nspecgen sim\n");
    let [(language, line)] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((language.as_str(), line.words.join(" ").as_str()), ("text", "specgen check a.toml"));
}

#[test]
fn completions_load_in_their_shell_and_name_every_command() {
    let folder = Folder::new();
    let command = specgen::cli::command();
    for (shell, check) in [("bash", "-n"), ("zsh", "-n"), ("fish", "-n"), ("powershell", ""), ("elvish", "")] {
        let script = folder.run(&["completions", shell]);
        assert_eq!((script.code, script.stderr.as_str()), (0, ""));
        for below in command.get_subcommands() {
            assert!(script.stdout.contains(below.get_name()), "{shell}: no {}", below.get_name());
        }
        folder.write(shell, &script.stdout);
        if check.is_empty() {
            continue;
        }
        match Command::new(shell).arg(check).arg(folder.path(shell)).output() {
            Ok(output) => assert!(output.status.success() && output.stderr.is_empty(), "{output:?}"),
            Err(_) => support::skipped(&format!("no {shell}: its script is not loaded")),
        }
    }
    // In a user's bash after loading: the function is registered, completes a command and its options, and leaves files to bash.
    let typed = |words: &str, current: &str, before: &str| {
        format!(
            "source ./bash; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _specgen specgen '{current}' '{before}'; echo \"${{COMPREPLY[@]}}\""
        )
    };
    let bash = |script: &str| {
        let output = Command::new("bash").args(["--norc", "-c", script]).current_dir(folder.path("")).output();
        output.ok().map(|output| (output.status.success(), String::from_utf8(output.stdout).unwrap()))
    };
    let Some((good, registered)) = bash("source ./bash && complete -p specgen") else {
        return support::skipped("no bash: completion is not tried");
    };
    assert!(good && registered.contains("-F _specgen") && registered.contains("-o default"), "{registered}");
    assert_eq!(bash(&typed("specgen rep", "rep", "specgen")).unwrap().1.trim(), "report reproduce replay");
    assert!(bash(&typed("specgen build --t", "--t", "build")).unwrap().1.contains("--target-dir"));
    assert!(bash(&typed("specgen build --target st", "st", "--target")).unwrap().1.contains("stm32h743"));
    assert_eq!(bash(&typed("specgen check legs.t", "legs.t", "check")).unwrap().1.trim(), "");
    assert_eq!(folder.json(&["completions", "fish"]).value["result"]["shell"], "fish");
    assert_eq!(folder.run(&["completions", "tcsh"]).code, 2);
}
