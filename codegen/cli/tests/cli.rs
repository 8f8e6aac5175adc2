//! The command as a user sees it: exit codes, `--json`, help, and messages about wrong arguments and files.

use crate::support;
use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::{PermissionsExt, symlink};

use crate::support::{Document, Folder, Run, cases, repository};

const COMMANDS: [&str; 22] = [
    "check",
    "build",
    "size",
    "flash",
    "sim",
    "tune",
    "design",
    "robust",
    "report",
    "reproduce",
    "pil",
    "commission",
    "operate",
    "gcs",
    "replay",
    "dynamics",
    "identify",
    "forc",
    "plant",
    "doctor",
    "dump-ir",
    "completions",
];

#[test]
fn arguments_that_make_no_sense_are_usage_errors() {
    let folder = Folder::new();
    let before = folder.listing();
    for (number, (case, _)) in cases::read(&repository().join("tests/cases/usage_errors.txt")).iter().enumerate() {
        let (words, word) = (shlex::split(&case.title).unwrap(), case.one('w').unwrap());
        let arguments: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
        // In the short run one of four as JSON, and of the others every second one as text.
        let is_json = number.is_multiple_of(support::length(4, 1));
        if support::length(!is_json && number.is_multiple_of(2), false) {
            continue;
        }
        folder.run(&arguments).says(2, &["error: ", word]);
        if !is_json {
            continue;
        }
        let document = folder.json(&arguments);
        assert_eq!(document.code, 2, "{arguments:?}");
        assert!(document.error().contains(word), "{arguments:?}: {}", document.error());
        // Earlier findings of the spec are kept: they are warnings.
        assert!(document.findings().is_empty() || arguments.contains(&"reference.toml"));
    }
    assert_eq!(folder.listing(), before);
}

#[test]
fn every_command_explains_itself() {
    let folder = Folder::new();
    let main = folder.run(&["--help"]);
    assert_eq!((main.code, main.stderr.as_str()), (0, ""));
    for word in COMMANDS.iter().chain(&["Exit codes: 0", "--no-build", "--json", "specgen platform.toml -o"]) {
        assert!(main.stdout.contains(word), "{word}:\n{}", main.stdout);
    }
    for command in COMMANDS {
        let help = folder.run(&[command, "--help"]);
        assert_eq!((help.code, help.stderr.as_str()), (0, ""));
        let text = &help.stdout;
        assert!(text.contains(&format!("Usage: specgen {command}")) && text.contains("--json"), "{text}");
        // Every option and argument has a sentence, on its line or below; deeper lines continue it.
        let depth = |line: &str| line.len() - line.trim_start().len();
        let (options, _) = text.split_once("\nExamples:\n").unwrap();
        let lines: Vec<&str> = options.lines().chain([""]).collect();
        for (line, next) in lines.iter().zip(&lines[1..]).filter(|(line, _)| (2..=6).contains(&depth(line))) {
            let beside = line.trim().split_once("  ").is_some_and(|(_, text)| text.trim().len() > 4);
            let explained = beside || (depth(next) == 10 && next.trim().len() > 4);
            assert!(explained, "{command}: `{line}`");
        }
    }
    let version = folder.run(&["--version"]);
    assert_eq!(version.stdout, format!("specgen {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn no_help_is_wider_than_a_terminal() {
    fn walk(path: &[&str], command: &clap::Command, folder: &Folder, wide: &mut Vec<String>) {
        let help = folder.run(&[path, &["--help"]].concat());
        assert_eq!(help.code, 0, "{path:?}");
        let lines = help.stdout.lines().filter(|line| line.chars().count() > 80);
        wide.extend(lines.map(|line| format!("{}: {line}", path.join(" "))));
        for below in command.get_subcommands() {
            walk(&[path, &[below.get_name()]].concat(), below, folder, wide);
        }
    }
    let mut wide = Vec::new();
    walk(&[], &specgen::cli::command(), &Folder::new(), &mut wide);
    assert!(wide.is_empty(), "{}", wide.join("\n"));
}

#[test]
fn a_good_spec_gives_one_document_and_its_text_the_same_facts() {
    let folder = Folder::new();
    let document = folder.json(&["legs.toml", "-o", "out", "--no-build"]);
    let made = &document.value["result"];
    assert_eq!((document.code, &made["name"], &made["output"]), (0, &"legs".into(), &"out".into()));
    assert_eq!(made["files"], support::contents(&folder.path("out")).len() - 1, "all but the manifest");
    let digest = made["digest"].as_str().unwrap();
    assert!(folder.read("out/README.md").contains(digest));
    let text = folder.run(&["legs.toml", "-o", "out", "--no-build"]);
    is_a_verdict(&text.stdout, "legs is good so far on 10 assumed values: ");
    let all = folder.run(&["legs.toml", "-o", "out", "--no-build", "--details"]).stdout;
    let (verdict, details) = all.split_once("\n\n").unwrap();
    assert_eq!(format!("{verdict}\n"), text.stdout);
    assert!(details.starts_with(&format!("legs → out (f64, digest {}", &digest[..16])), "{details}");

    let check = folder.json(&["check", "legs.toml"]);
    assert_eq!((check.code, &check.value["result"]["digest"]), (0, &digest.into()));
    assert_eq!(check.value["result"]["records"][0]["grid"], 32);
    let text = folder.run(&["check", "legs.toml"]);
    is_a_verdict(&text.stdout, "legs is good so far on 10 assumed values: ");
    assert_eq!((text.code, &check.value["result"]["verdict"]["answer"]), (0, &"not-measured".into()));
    let details = folder.run(&["check", "legs.toml", "--details"]).stdout;
    assert!(details.starts_with(&text.stdout) && details.contains("\n  record records/"), "{details}");
    // Only notes: about what a check cannot measure, and about the ranges of legs and gauges.
    assert!(text.stderr.starts_with("note[N0872]") && text.stderr.ends_with("0 errors, 0 warnings\n"), "{text:#?}");

    let ir = folder.json(&["dump-ir", "legs.toml"]);
    let plain: serde_json::Value = serde_json::from_str(&folder.run(&["dump-ir", "legs.toml"]).stdout).unwrap();
    assert_eq!((ir.code, &ir.value["result"]), (0, &plain));
    assert_eq!(plain, serde_json::from_str::<serde_json::Value>(&folder.read("out/ir.json")).unwrap());
    assert_eq!(plain["digest"], digest);
}

/// Asserts that the text starts with a verdict of at most ten lines of eighty letters.
fn is_a_verdict(text: &str, start: &str) {
    assert!(text.starts_with(start), "{text}");
    assert!(text.lines().count() <= 10 && text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn the_output_folder_is_named_after_the_platform_if_not_given() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["legs.toml", "--no-build"]).code, 0);
    assert!(folder.path("legs-controller/law/src/legs/step.rs").is_file());
}

/// Builds the emitted controller, as `sim` does for a user.
#[test]
fn sim_gives_one_document_and_its_files_hold_the_same_table() {
    let folder = Folder::new();
    let paper = ["sim", "legs.toml", "--paper", "--samples", "40", "--no-noise", "-o", "out/sim"];
    assert_eq!(folder.json(&paper).code, 0);
    assert!(!folder.path("out/sim/trace-pcc-1hz.csv").exists(), "traces are written where they are asked for");
    let document = folder.json(&[&paper[..], &["--traces"]].concat());
    assert_eq!(document.code, 0, "{:#}", document.value);
    let result = &document.value["result"];
    let tables: serde_json::Value = serde_json::from_str(&folder.read("out/sim/tables.json")).unwrap();
    assert_eq!((&tables["tracking"], &tables["linearity"]), (&result["tracking"], &result["linearity"]));
    for mode in ["invhys", "ewma", "pcc"] {
        let trace = folder.read(&format!("out/sim/trace-{mode}-1hz.csv"));
        assert!(trace.lines().count() > 40, "{mode}");
    }
    // The result for the spec's own legs does not mention the paper.
    let own = ["sim", "legs.toml", "--frequency", "10", "--plot", "plots/own.svg", "-o", "own", "--traces"];
    let own = folder.run(&own);
    assert!(own.code == 0 && !own.stdout.contains("paper") && own.stdout.contains("pcc"), "{own:?}");
    assert!(own.stdout.lines().all(|line| line.chars().count() <= 80), "{}", own.stdout);
    assert!(folder.read("plots/own.svg").starts_with("<svg "));
    assert!(own.stderr.contains(" MB, to own"), "{}", own.stderr);
    let trace = folder.read("own/trace-pcc-10hz.csv");
    for name in
        ["time_s", "dac_code[0]", "voltage[5]_V", "displacement[0]_m", "target[5]_m", "error[5]_m", "status_text"]
    {
        assert!(trace.lines().next().unwrap().split(',').any(|column| column == name), "{name}");
    }
    // Another interval is checked like the period of the spec.
    folder.run(&["sim", "legs.toml", "--frequency", "10", "--samples", "2000"]).says(1, &["50.0 µs", "timing.period"]);
    folder.json(&["sim", "nothing.toml"]).finding("E0101");
    let refused = folder.json(&["sim", "legs.toml", "--plant", "legs.toml"]);
    assert!(refused.code == 1 && refused.error().contains("legs.toml"), "{}", refused.error());
}

#[test]
fn a_simulated_record_can_be_identified() {
    let folder = Folder::new();
    let forc = folder.json(&["forc", "-o", "record.csv", "--grid", "8", "--plot", "record.html"]);
    assert!(folder.read("record.html").contains("<svg "));
    let rows = folder.read("record.csv").lines().filter(|line| !line.starts_with('#')).count() - 1;
    assert_eq!((forc.code, &forc.value["result"]["rows"]), (0, &rows.into()));
    let arguments = ["identify", "record.csv", "--drive", "0:100", "--grid", "8", "-o", "table.csv"];
    let document = folder.json(&[&arguments[..], &["--validate", "records/leg1.csv"]].concat());
    let report = &document.value["result"]["report"];
    assert_eq!((document.code, &report["reversal_curves"], &report["grid"]), (0, &8.into(), &8.into()));
    assert_eq!(document.value["result"]["validation"]["record"], "records/leg1.csv");
    assert!(folder.read("table.csv").starts_with("up_V,down_V,everett_um\n"));
    let text = folder.run(&arguments);
    assert!(text.code == 0 && text.stdout.contains("8 reversal curves") && text.stdout.contains("wrote table.csv"));
    // Another seed gives other noise; the same seed gives the same bytes.
    folder.run(&["forc", "-o", "again.csv", "--grid", "8"]);
    folder.run(&["forc", "-o", "other.csv", "--grid", "8", "--seed", "2"]);
    assert_eq!(folder.read("record.csv"), folder.read("again.csv"));
    assert_ne!(folder.read("record.csv"), folder.read("other.csv"));
}

#[test]
fn records_at_two_rates_are_written_and_identified_together() {
    let folder = Folder::new();
    let forc = folder.json(&["forc", "-o", "leg.csv", "--grid", "8", "--two-rates"]);
    let further = forc.value["result"]["further"].as_array().unwrap();
    let files: Vec<&serde_json::Value> = further.iter().map(|one| &one["file"]).collect();
    assert_eq!(files, ["leg-fast.csv", "leg-arbitrary.csv"]);
    let last = folder.read("leg-fast.csv").lines().last().unwrap().to_owned();
    // 500 V at 640 V/s, less what makes whole rows of 0.1 ms.
    assert!(last.starts_with("0.782,0,"), "{last}");
    // In the short run a table alone; every family takes seconds.
    let model = support::length("preisach", "auto");
    let both = ["identify", "leg.csv", "leg-fast.csv", "--drive", "0:100", "--grid", "8", "--model", model];
    let document = folder.json(&[&both[..], &["--validate", "leg-arbitrary.csv"]].concat());
    let codes: Vec<String> = document.findings().iter().map(|finding| finding["code"].to_string()).collect();
    assert!(document.code == 0 && codes.is_empty(), "{codes:?}");
    let result = &document.value["result"];
    assert_eq!(result["report"]["reversal_curves"], 12);
    let scored = result["scores"][0]["arbitrary_rms"].as_f64().is_some_and(|rms| rms > 0.0);
    assert_eq!(scored, model == "auto", "{result}");
    assert_eq!(result["validation"]["record"], "leg-arbitrary.csv");
    // Drives for a generator: each rests at the lowest voltage, and returns to it.
    let drive = ["forc", "-o", "drive.csv", "--drive-only", "--drive", "-90:90", "--sampling", "2000", "--grid", "4"];
    assert_eq!(folder.run(&[&drive[..], &["--two-rates"]].concat()).code, 0);
    for name in ["drive.csv", "drive-fast.csv", "drive-arbitrary.csv"] {
        let text = folder.read(name);
        let drive: Vec<f64> =
            text.lines().skip(1).map(|line| line.split_once(',').unwrap().1.parse().unwrap()).collect();
        let resting = drive.iter().skip_while(|u| **u > -90.0).take_while(|u| **u == -90.0).count();
        assert!(resting >= 2000 && drive[0] == 0.0 && drive.last() == Some(&-90.0), "{name}: {resting}");
    }
}

#[test]
fn a_spec_that_is_no_spec_is_refused_with_its_name_and_a_fix() {
    let folder = Folder::new();
    folder.write("empty.toml", "");
    folder.write("huge.toml", vec![b'#'; 2 << 20]);
    folder.write("latin.toml", b"schema = 1\nname = \"caf\xe9\"\n");
    folder.write("binary.toml", (0..=255).cycle().take(5000).map(|b: u16| b as u8).collect::<Vec<_>>());
    folder.write("syntax.toml", "schema = 1\nname = [\n");
    let units = || "schema = 1\nname = \"x\"\n".encode_utf16();
    folder.write("utf16.toml", units().flat_map(u16::to_be_bytes).collect::<Vec<_>>());
    let mark = std::iter::once(0xfeff).chain(units());
    folder.write("marked.toml", mark.flat_map(u16::to_le_bytes).collect::<Vec<_>>());
    fs::create_dir(folder.path("folder.toml")).unwrap();
    let before = folder.listing();
    for (spec, code, line, fix) in [
        ("nothing.toml", "E0101", None, "path"),
        ("folder.toml", "E0101", None, "name the .toml file in it"),
        ("empty.toml", "E0105", Some(1), "specgen new"),
        ("huge.toml", "E0102", None, "measurements belong in CSV files"),
        ("latin.toml", "E0103", Some(2), "save the file as UTF-8"),
        ("binary.toml", "E0103", Some(2), "save the file as UTF-8"),
        ("utf16.toml", "E0103", Some(1), "iconv"),
        ("marked.toml", "E0103", Some(1), "iconv"),
        ("syntax.toml", "E0104", Some(2), "]"),
    ] {
        let ways = [&[spec, "-o", "out", "--no-build"][..], &["check", spec], &["dump-ir", spec]];
        for arguments in ways.into_iter().take(support::length(1, 3)) {
            let document = folder.json(arguments);
            assert_eq!(document.code, 1, "{arguments:?}");
            assert_eq!(document.error(), format!("{spec} is refused; nothing was written"));
            let finding = document.finding(code);
            assert_eq!(finding["file"], spec);
            assert!(finding["help"].as_str().unwrap().contains(fix), "{finding:#}");
            if let Some(line) = line {
                assert_eq!(finding["line"], line, "{spec}");
            }
            folder.run(arguments).says(1, &[&format!("error[{code}]"), spec, "help: ", "nothing was written"]);
        }
    }
    assert_eq!(folder.listing(), before);
}

#[test]
fn a_grid_that_cannot_be_is_refused_at_its_line() {
    let folder = Folder::new();
    for grid in ["0", "1", "10000"] {
        folder.spec("grid.toml", &[("grid    = 32", &format!("grid    = {grid}"))]);
        let line = 1 + folder.read("grid.toml").lines().position(|line| line.starts_with("grid")).unwrap();
        let document = folder.json(&["grid.toml", "-o", "out", "--no-build"]);
        let finding = document.finding("E0301");
        assert_eq!((document.code, &finding["line"], &finding["column"]), (1, &line.into(), &11.into()));
        assert_eq!(finding["key"], "hysteresis.grid");
        for word in [grid, "2 to 128"] {
            assert!(finding["message"].as_str().unwrap().contains(word), "{finding:#}");
        }
        let document = folder.json(&["identify", "records/leg1.csv", "--drive", "0:100", "--grid", grid]);
        assert_eq!(document.code, 1);
        assert!(document.finding("E0601")["message"].as_str().unwrap().contains(grid));
    }
    assert!(!folder.path("out").exists());
}

/// All findings of a spec in one run, each at its own line.
#[test]
fn several_mistakes_are_reported_together() {
    let folder = Folder::new();
    let edits = [
        ("mass           = \"1.195 kg\"", "mass           = \"1.195 V\""),
        ("bits  = 16\nrange = [\"0", "bitz  = 16\nrange = [\"0"),
        ("stacks          = 5", "stacks          = \"five\""),
    ];
    folder.spec("bad.toml", &edits);
    let document = folder.json(&["check", "bad.toml"]);
    for code in ["E0211", "E0202", "E0206"] {
        let finding = document.finding(code);
        assert!(finding["line"].as_u64().is_some() && finding["column"].as_u64().is_some(), "{finding:#}");
    }
    assert!(document.finding("E0202")["help"].as_str().unwrap().contains("bits"));
    folder.run(&["check", "bad.toml"]).says(1, &["bad.toml is refused; nothing was written", "--> bad.toml:"]);
}

/// A name need not be UTF-8: only the content of the file matters, and the name reaches no output.
#[test]
fn a_file_name_that_is_not_utf_8_is_read_or_refused_but_never_fatal() {
    let folder = Folder::new();
    let name = OsString::from_vec(b"caf\xe9.toml".to_vec());
    let run = |arguments: &[&str]| Run::of(folder.command().args(arguments).arg(&name));
    run(&["check"]).says(1, &["E0101", "there is no such file", "caf\u{fffd}.toml"]);
    Document::of(&run(&["check", "--json"])).finding("E0101");
    if fs::copy(folder.path("legs.toml"), folder.path(&name)).is_err() {
        return support::skipped("the file system takes UTF-8 names only");
    }
    assert_eq!(run(&["check"]).code, 0);
    assert_eq!(run(&["-o", "out", "--no-build"]).code, 0);
    folder.run(&["legs.toml", "-o", "plain", "--no-build"]);
    assert_eq!(support::contents(&folder.path("out")), support::contents(&folder.path("plain")));
    let output = OsString::from_vec(b"out-\xff".to_vec());
    let made = Run::of(folder.command().args(["legs.toml", "--no-build", "-o"]).arg(&output));
    assert_eq!(made.code, 0, "{}", made.stderr);
    assert!(folder.path(&output).join("Cargo.toml").is_file());
    // As a record: such a name is possible on the command line, but not in a spec.
    fs::copy(folder.path("records/leg1.csv"), folder.path(&name)).unwrap();
    let mut identify = folder.command();
    identify.arg("identify").arg(&name).args(["--drive", "0:100", "--grid", "8", "--json"]);
    assert_eq!(Document::of(&Run::of(&mut identify)).code, 0);
}

#[test]
fn a_written_file_has_usual_permissions_and_a_link_or_device_stays_one() {
    let folder = Folder::new();
    folder.write("plain", "");
    let usual = fs::metadata(folder.path("plain")).unwrap().permissions().mode();
    let identify =
        |output: &str| folder.run(&["identify", "records/leg1.csv", "--drive", "0:100", "--grid", "8", "-o", output]);
    assert_eq!(identify("table.csv").code, 0);
    assert_eq!(fs::metadata(folder.path("table.csv")).unwrap().permissions().mode(), usual);

    symlink("table.csv", folder.path("link.csv")).unwrap();
    folder.write("table.csv", "old");
    assert_eq!(identify("link.csv").code, 0);
    assert!(folder.path("link.csv").is_symlink() && folder.read("table.csv").starts_with("up_V"));

    // A pipe, not /dev/null: if this failed, root would lose the device.
    let made = std::process::Command::new("mkfifo").arg(folder.path("pipe")).status();
    if !made.is_ok_and(|status| status.success()) {
        return support::skipped("no mkfifo");
    }
    let pipe = folder.path("pipe");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    assert_eq!(identify("pipe").code, 0);
    assert!(reader.join().unwrap().starts_with("up_V"));
    assert!(!fs::symlink_metadata(folder.path("pipe")).unwrap().is_file());
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let folder = Folder::new();
    let before = folder.listing();
    for (output, word) in
        [("legs.toml/a.csv", "could not create the folder `legs.toml`"), ("records", "it is a folder")]
    {
        let table = ["identify", "records/leg1.csv", "--drive", "0:100", "--grid", "8", "-o", output];
        for arguments in [&table[..], &["forc", "--grid", "4", "-o", output]] {
            folder.run(arguments).says(3, &[&format!("could not write `{output}`"), word, "nothing was changed"]);
            assert_eq!(folder.json(arguments).code, 3);
        }
    }
    assert_eq!(folder.listing(), before);
    // Missing parent folders are created.
    assert_eq!(folder.run(&["forc", "--grid", "4", "-o", "new/below/record.csv"]).code, 0);
    assert!(folder.path("new/below/record.csv").is_file());
}

/// `specgen … | head` closes the pipe early.
#[test]
fn a_closed_pipe_is_no_panic() {
    let folder = Folder::new();
    let mut child = folder
        .command()
        .args(["dump-ir", "legs.toml"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.is_empty(), "{output:?}");
}

#[test]
fn a_computer_is_judged_by_the_period_of_a_spec() {
    let folder = Folder::new();
    let free = folder.json(&["doctor", "--seconds", "0.2"]);
    let result = &free.value["result"];
    assert_eq!((free.code, &result["period_ns"]), (0, &100_000.into()));
    let latency = &result["latency"];
    let count = |key: &str| latency[key].as_u64().unwrap();
    let measured: u64 = latency["below_ns"].as_array().unwrap().iter().map(|bin| bin[1].as_u64().unwrap()).sum();
    assert_eq!(measured + count("skipped"), count("planned"));
    assert!(count("planned") >= 2_000 && count("p50_ns") <= count("max_ns"));
    for finding in result["findings"].as_array().unwrap() {
        let good = finding["grade"] == "good";
        assert_eq!(finding["fix"].is_null(), good, "{finding}");
    }

    // With a spec the verdict decides the exit code; the figures are printed in any case.
    let judged = folder.run(&["doctor", "legs.toml", "--seconds", "0.2", "--json"]);
    let document: serde_json::Value = serde_json::from_str(&judged.stdout).unwrap();
    let result = &document["result"];
    let bad = result["verdict"]["grade"] == "bad";
    assert_eq!(judged.code, i32::from(bad));
    assert_eq!(bad, result["latency"]["skipped"] != 0);
    let text = folder.run(&["doctor", "--seconds", "0.1"]);
    assert!(
        text.stdout.contains("wake-up delays, from the planned time to running") && text.stdout.contains("10000 Hz: ")
    );
}
