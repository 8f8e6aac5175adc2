//! Shell commands that the program prints. Those with a file name are built by `specgen_language::shell`, and run here with names that
//! need quoting. Those without are run with stub programs that log their calls.

mod forms;
mod scan;

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use crate::support::commands::Line;
use crate::support::{BINARY, Folder, length, repository};
use scan::{PROGRAMS, built, code, is_sentence, lines, literals, sources};

/// Places where commands are built, and the test that runs them.
const BUILT: &[(&str, usize, &str)] = &[
    ("codegen/studies/src/design.rs", 1, "next_commands_name_the_files_that_were_named"),
    ("codegen/studies/src/build.rs", 3, "next_commands_name_the_files_that_were_named"),
    ("codegen/studies/src/check.rs", 2, "next_commands_name_the_files_that_were_named"),
    ("codegen/studies/src/firmware/flash.rs", 1, "a_line_for_a_programmer_names_the_image"),
    ("codegen/studies/src/begin.rs", 3, "next_commands_name_the_files_that_were_named"),
    ("codegen/report/src/pages.rs", 3, "commands_of_a_page_name_its_spec"),
    ("codegen/report/src/pages/paper.rs", 4, "commands_of_a_page_name_its_spec"),
    ("codegen/report/src/pages/simulated.rs", 5, "commands_of_a_page_name_its_spec"),
    ("codegen/report/src/robust/figures.rs", 1, "a_machine_is_run_again_by_its_line"),
    ("codegen/studies/src/trajectory.rs", 1, "a_machine_is_run_again_by_its_line"),
    ("codegen/report/src/robust/work.rs", 1, "a_machine_is_run_again_by_its_line"),
    ("codegen/language/src/ui.rs", 1, "next_commands_name_the_files_that_were_named"),
    ("codegen/report/src/identify/everett.rs", 1, "a_record_alone_is_described_with_the_line_that_identifies_it"),
    ("codegen/identify/src/coverage.rs", 1, "a_drive_is_written_beside_the_record"),
    ("codegen/language/src/spec/source.rs", 1, "specs_in_other_encodings_become_text_and_stay"),
];
/// Texts with a placeholder that look like a command but are not.
const NO_LINES: [&str; 10] = [
    "rustup cannot be run: {error}",
    "specgen {meant}",
    "specgen {} · f{} · {}",
    "specgen {} · {}",
    "specgen {}",
    "rt-pc {version}, controller of `{name}`, digest {digest}\\n",
    "apt-get cannot be run: {error}",
    "apt-get would have to remove {}",
    "apt-get failed: {}",
    "cargo install probe-rs-tools --locked",
];
/// Lines with a constant of the program, not of the user, in braces.
const CONSTANT: [&str; 4] = [
    "pip install {packages}",
    "apt-get install {PROGRAM} on Debian",
    "apt-get install {PACKAGE} on Debian; elsewhere set {VARIABLE} to the library of unicorn 2",
    "rustup target add {TRIPLE}{debian}",
];
/// Names of files.
const NAMES: [&str; 6] = ["leg", "my leg", "it's", "-x", "$(touch run)", "a&b;c \"d\""];

#[test]
fn every_line_with_a_name_in_it_is_built_in_one_place_and_run_by_a_test() {
    let (mut found, mut loose) = (Vec::new(), Vec::new());
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let own =
        ["shell_lines.rs", "shell_lines/forms.rs"].map(|file| fs::read_to_string(tests.join(file)).unwrap()).concat();
    for file in sources() {
        let text = fs::read_to_string(&file).unwrap();
        let name = file.strip_prefix(repository()).unwrap().to_str().unwrap().to_owned();
        if name == "codegen/language/src/shell.rs" {
            continue;
        }
        let code = code(&text);
        let count = built(&code);
        found.extend((count > 0).then(|| (name.clone(), count)));
        for line in literals(&code).iter().flat_map(|text| lines(text)) {
            let is_known = |known: &&str| known.replace("\\n", "\n").trim() == line;
            let is_listed = NO_LINES.iter().chain(&CONSTANT).any(is_known);
            if line.contains('{') && !is_listed && !is_sentence(&line) {
                loose.push(format!("{name}: `{line}`"));
            }
        }
    }
    assert!(loose.is_empty(), "build these by specgen_language::shell: {loose:#?}");
    let listed: Vec<(String, usize)> = BUILT.iter().map(|(name, count, _)| ((*name).to_owned(), *count)).collect();
    found.sort_by_key(|(name, _)| BUILT.iter().position(|(listed, ..)| listed == name));
    assert_eq!(found, listed, "each place where a line is built has a test in BUILT that runs it");
    for (_, _, test) in BUILT {
        assert!(own.contains(&format!("fn {test}()")), "there is no test {test}");
    }
}

/// Stub programs that log their arguments; only the shell's built-ins are real.
struct Stubs(tempfile::TempDir);

impl Stubs {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for program in PROGRAMS.iter().filter(|program| **program != "sh") {
            let file = folder.path().join(program);
            fs::write(&file, "#!/bin/sh\nfor word in \"${0##*/}\" \"$@\"; do printf '%s\\037' \"$word\"; done >> \"$CALLS\"\necho >> \"$CALLS\"\n").unwrap();
            fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        }
        Self(folder)
    }

    /// Calls of the programs by `line`.
    fn calls(&self, line: &str) -> Vec<Vec<String>> {
        let here = tempfile::tempdir().unwrap();
        let calls = self.0.path().join("calls");
        let _ = fs::remove_file(&calls);
        let mut command = Command::new("/bin/sh");
        command
            .args(["-ec", line])
            .current_dir(here.path())
            .env("PATH", self.0.path())
            .env("CALLS", &calls)
            .env("USER", "me");
        let output = command.output().unwrap();
        assert!(output.status.success(), "`{line}`: {output:?}");
        assert_eq!(fs::read_dir(here.path()).unwrap().count(), 0, "`{line}` writes a file");
        let text = fs::read_to_string(&calls).unwrap_or_default();
        text.split_terminator("\x1f\n").map(|call| call.split('\x1f').map(str::to_owned).collect()).collect()
    }
}

/// Commands without a file name: a shell accepts them, they write no user file, and those of specgen exist.
#[test]
fn every_constant_line_is_one_that_a_shell_runs() {
    let stubs = Stubs::new();
    let mut count = 0;
    for file in sources() {
        let code = code(&fs::read_to_string(&file).unwrap());
        for line in literals(&code).iter().flat_map(|text| lines(text)) {
            let is_text = ["platform spec", "response 1", "correction 1", "robust part", "version", "has a defect"];
            let is_text = is_text.iter().any(|words| line.contains(words)) || NO_LINES.contains(&line.as_str());
            let line = line.replace("{PROGRAM} on Debian", "qemu").replace("{TRIPLE}{debian}", "thumb");
            if is_text
                || line.contains('{')
                || is_sentence(&line)
                || line.contains(['…', '[', ',']) && !line.starts_with("python3 -c")
            {
                continue;
            }
            let calls = stubs.calls(&line);
            let first = line.split(' ').next().unwrap();
            assert_eq!(calls.first().and_then(|call| call.first()).map(String::as_str), Some(first), "`{line}`");
            if let Some(line) = Line::of(file.to_str().unwrap(), &line) {
                let known = line
                    .words
                    .get(1)
                    .is_some_and(|word| word == "SPEC" || specgen::cli::command().find_subcommand(word).is_some());
                assert!(known, "{}: `{}`", line.place, line.text);
            }
            count += 1;
        }
    }
    println!("{count} lines");
    assert!(count > 40, "{count}");
}

/// Texts between backticks in a command's output that start with `program`.
fn printed(text: &str, program: &str) -> Vec<String> {
    let begins = |line: &&str| line.starts_with(&format!("{program} "));
    let quoted = text.split('`').skip(1).step_by(2).filter(begins).map(str::to_owned);
    let alone = text.lines().map(str::trim).map(|line| {
        let behind = ["next ", "replay: "].iter().find_map(|word| line.strip_prefix(word));
        behind.unwrap_or(line).trim()
    });
    let alone = alone.filter(begins).map(str::to_owned);
    quoted.chain(alone).collect()
}

/// Runs a command with a file of any name.
fn run(folder: &Folder, before: &[&str], name: &str, after: &[&str]) -> (i32, String) {
    let name = if name.starts_with('-') { format!("./{name}") } else { name.to_owned() };
    let output = folder.command().args(before).arg(name).args(after).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap(), text)
}

/// Runs a shell in the folder, with `specgen` as the program under test.
fn shell(folder: &Folder, line: &str) -> Output {
    let programs = Path::new(BINARY).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("sh");
    command.args(["-ec", line]).current_dir(folder.path("")).env("PATH", path);
    command.output().unwrap()
}

/// The bytes of every file in the folder.
fn files(folder: &Folder) -> BTreeMap<String, Vec<u8>> {
    crate::support::contents(&folder.path(""))
}

#[test]
fn a_drive_is_written_beside_the_record() {
    let folder = Folder::new();
    fs::copy(folder.path("records/leg1.csv"), folder.path("drive.csv")).unwrap();
    let before = files(&folder);
    let (code, text) = run(&folder, &["identify"], "drive.csv", &["--drive", "-90:200", "--grid", "4"]);
    let lines = printed(&text, "specgen");
    assert!(code == 1 && !lines.is_empty(), "{text}");
    for line in lines {
        let output = shell(&folder, &line);
        assert!(output.status.success(), "{line}: {output:?}");
    }
    let mut after = files(&folder);
    assert!(after.remove("drive-2.csv").is_some_and(|made| !made.is_empty()));
    assert_eq!(after, before);
}

#[test]
fn a_record_alone_is_described_with_the_line_that_identifies_it() {
    for &name in length(&NAMES[2..4], &NAMES) {
        let folder = Folder::new();
        let record = format!("{name}.csv");
        fs::copy(folder.path("records/leg1.csv"), folder.path(&record)).unwrap();
        let (code, text) = run(&folder, &["identify"], &record, &["--grid", "4"]);
        let lines = printed(&text, "specgen");
        assert!(code == 2 && lines.len() == 1 && text.contains("samples in"), "{text}");
        let output = shell(&folder, &lines[0]);
        assert!(output.status.success(), "{}: {output:?}", lines[0]);
    }
    // A physical reason comes before the question for a range.
    let folder = Folder::new();
    let rows: String = (0..400)
        .map(|k| {
            let drive = f64::from((k % 160 - 80_i32).abs()) - 40.0;
            format!("{},{drive},{}\n", f64::from(k) * 1e-3, 0.1 * (drive - 5.0).abs() + 1e-3 * drive)
        })
        .collect();
    folder.write("butterfly.csv", format!("time_s,drive_V,displacement_um\n{rows}"));
    let (code, text) = run(&folder, &["identify"], "butterfly.csv", &[]);
    assert!(code == 1 && text.contains("butterfly"), "{text}");
}

/// Suggested next commands contain the name as one word.
#[test]
fn next_commands_name_the_files_that_were_named() {
    let stubs = Stubs::new();
    for &name in length(&NAMES[2..4], &NAMES) {
        let folder = Folder::new();
        let spec = format!("{name}.toml");
        fs::copy(folder.path("legs.toml"), folder.path(&spec)).unwrap();
        let called = |text: &str, names: &[&str], least: usize| {
            let lines = printed(text, "specgen");
            assert!(lines.len() >= least, "{text}");
            for line in lines {
                // SPEC in the help of a finding is a placeholder.
                for call in stubs.calls(&line).into_iter().filter(|call| !call.contains(&"SPEC".to_owned())) {
                    let is_named = |word: &String| names.iter().any(|name| word.trim_start_matches("./") == *name);
                    assert!(call.iter().any(is_named), "`{line}`: {call:?}");
                    let parsed = specgen::cli::command().try_get_matches_from(call);
                    assert!(parsed.is_ok(), "`{line}`: {}", parsed.unwrap_err());
                }
            }
        };
        let (code, text) = run(&folder, &["check"], &spec, &[]);
        assert_eq!(code, 0, "{text}");
        called(&text, &[&spec], 1);
        let (code, text) = run(&folder, &["--no-build", "-o", "out"], &spec, &[]);
        assert_eq!(code, 0, "{text}");
        called(&text, &[&spec], 1);
        fs::copy(folder.path("reference.toml"), folder.path(&spec)).unwrap();
        let (code, text) = run(&folder, &["design"], &spec, &[]);
        assert_eq!(code, 0, "{text}");
        called(&text, &[&spec], 1);
        let (_, text) = run(&folder, &["new", "--like", "reference"], &format!("{name}/bench"), &[]);
        let [own, controller] = ["platform.toml", "controller"].map(|file| format!("{name}/bench/{file}"));
        called(&text, &[&own, &controller], 3);
    }
}

#[test]
fn commands_of_a_page_name_its_spec() {
    let folder = Folder::new();
    for &name in length(&NAMES[4..], &NAMES) {
        let spec = format!("{name}.toml");
        folder.write(&spec, folder.read("legs.toml").replacen("bits", "bitz", 1));
        let (code, text) = run(&folder, &["report", "-o", "page.html"], &spec, &[]);
        assert_eq!(code, 1, "{text}");
        let page = folder.read("page.html");
        let page = page
            .replace("&#39;", "'")
            .replace("&quot;", "\"")
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&amp;", "&");
        let line = page.split("specgen report ").nth(1).and_then(|rest| rest.split(['<', '\n']).next()).unwrap();
        let words = shlex::split(line.trim()).unwrap_or_else(|| panic!("{line}"));
        assert_eq!(words[0].trim_start_matches("./"), spec, "{line}");
        fs::remove_file(folder.path("page.html")).unwrap();
    }
}

/// Without probe-rs, the manual commands are shown.
#[test]
fn a_line_for_a_programmer_names_the_image() {
    use specgen::shell::line;
    let stubs = Stubs::new();
    for name in NAMES {
        let words = ["download", "--chip", "STM32H743ZITx", "--verify", "--probe", "a b:c", name];
        let shown = words.iter().fold(line("probe-rs"), |line, word| line.word(word)).to_string();
        assert_eq!(stubs.calls(&shown)[0][1..], words);
    }
}

/// The options of a study are also arguments.
#[test]
fn a_machine_is_run_again_by_its_line() {
    let folder = Folder::new();
    let spec = "it's -a \"study\".toml";
    fs::copy(folder.path("legs.toml"), folder.path(spec)).unwrap();
    let (code, text) =
        run(&folder, &["robust", "--draws", "1", "--vary", "gain=0.9:1.1", "--max-error", "1 pm"], spec, &[]);
    assert_eq!(code, 1, "{text}");
    let lines = printed(&text, "specgen");
    assert!(!lines.is_empty(), "{text}");
    let stubs = Stubs::new();
    for line in lines {
        let call = &stubs.calls(&line)[0];
        assert!(call.contains(&spec.to_owned()) && call.contains(&"--replay".to_owned()), "{line}");
        assert!(specgen::cli::command().try_get_matches_from(call).is_ok(), "{line}");
    }
}
