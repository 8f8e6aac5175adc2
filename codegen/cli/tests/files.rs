//! File arguments of all commands: inputs are never overwritten, and no command blocks on a file that is not regular. The arguments
//! come from the program's own description, so that new ones are tested automatically.

#![allow(clippy::disallowed_methods, reason = "what stands in a test is emitted nowhere")]
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use rustix::fs::{CWD, Mode, mkfifoat};
use specgen::cli::{Role, role};

use crate::support::{BINARY, Folder, Run, length};

/// A command that has not ended by then is blocked.
const PATIENCE: Duration = Duration::from_secs(60);

/// For each command, arguments by name with which it reads every given file. Commands without files are in `OTHERS`.
const LINES: &[(&str, &[(&str, &str)])] = &[
    ("specgen", &[("spec", "legs.toml"), ("no_build", "")]),
    ("specgen new", &[("name", "new"), ("like", "reference")]),
    ("specgen check", &[("spec", "legs.toml")]),
    ("specgen build", &[("spec", "legs.toml"), ("target", "host")]),
    ("specgen size", &[("file", "legs.toml")]),
    ("specgen flash", &[("file", "legs.toml"), ("target", "stm32h743")]),
    ("specgen sim", &[("spec", "legs.toml")]),
    ("specgen tune", &[("spec", "legs.toml")]),
    ("specgen design", &[("spec", "reference.toml")]),
    ("specgen learn", &[("spec", "learning.toml")]),
    ("specgen robust", &[("spec", "legs.toml")]),
    ("specgen robust merge", &[("parts", "any.json")]),
    ("specgen report", &[("spec", "legs.toml")]),
    ("specgen reproduce", &[]),
    ("specgen pil", &[("spec", "legs.toml")]),
    ("specgen commission", &[("spec", "reference.toml"), ("socket", "none"), ("yes", "")]),
    ("specgen operate", &[("socket", "none")]),
    ("specgen panel", &[("socket", "none"), ("spec", "legs.toml")]),
    ("specgen gcs", &[("socket", "none")]),
    ("specgen replay", &[("recording", "run.rec"), ("spec", "legs.toml")]),
    ("specgen dynamics", &[("spec", "reference.toml"), ("states", "states.json")]),
    ("specgen export c", &[("spec", "legs.toml"), ("output", "c")]),
    ("specgen export python", &[("spec", "legs.toml"), ("output", "python")]),
    ("specgen export fmu", &[("spec", "legs.toml"), ("output", "fmu")]),
    ("specgen export table", &[("table", "r.csv"), ("output", "r.npz")]),
    ("specgen identify", &[("records", "r.csv"), ("drive", "0:100"), ("grid", "4")]),
    ("specgen identify linear", &[("records", "sine.csv")]),
    ("specgen identify response", &[("record", "r.csv")]),
    ("specgen identify gains", &[("recording", "run.rec"), ("spec", "legs.toml")]),
    ("specgen identify cross-talk", &[("records", "r.csv")]),
    ("specgen identify gauge", &[("record", "r.csv")]),
    ("specgen identify predict", &[("model", "table.csv"), ("drive", "r.csv")]),
    ("specgen identify stiffness", &[("record", "r.csv")]),
    ("specgen identify rate", &[("records", "r.csv"), ("drive", "0:100"), ("grid", "4")]),
    ("specgen forc", &[("spec", "legs.toml"), ("output", "curves.csv"), ("grid", "4")]),
    ("specgen plant", &[("spec", "legs.toml")]),
    ("specgen doctor", &[("spec", "legs.toml")]),
    ("specgen dump-ir", &[("spec", "legs.toml")]),
];
/// Commands without file arguments.
const WITHOUT: [&str; 6] =
    ["specgen explain", "specgen export", "specgen lsp", "specgen cache", "specgen completions", "specgen help"];
/// A path argument without a path type: words of which some are files.
const UNTYPED: [&str; 1] = ["specgen operate words"];

/// An argument that names a file.
struct Slot {
    command: String,
    argument: clap::Arg,
    role: Role,
    /// All arguments of the command.
    all: Vec<clap::Arg>,
}

impl Slot {
    fn name(&self) -> String {
        format!("{} {}", self.command, self.argument.get_id())
    }

    /// The words of a line with the given values for this argument and others.
    fn line(&self, values: &[(&str, &str)]) -> Vec<String> {
        let own = LINES.iter().find(|(command, _)| *command == self.command);
        let (_, usual) = own.unwrap_or_else(|| panic!("{}: add its line to LINES", self.command));
        let mut all: BTreeMap<&str, &str> = usual.iter().copied().collect();
        // A recorded run has a spec in the place of drive and grid.
        if self.name() == "specgen identify spec" {
            all = BTreeMap::from([("records", "run.rec")]);
        }
        all.extend(values.iter().copied());
        let mut words: Vec<String> = self.command.split(' ').skip(1).map(str::to_owned).collect();
        let mut positional: Vec<(usize, &str)> = Vec::new();
        for (id, value) in all {
            let argument = self.all.iter().find(|argument| argument.get_id() == id);
            let argument = argument.unwrap_or_else(|| panic!("{} has no argument {id}", self.command));
            match (argument.get_long(), argument.get_index()) {
                (Some(long), _) if value.is_empty() => words.push(format!("--{long}")),
                (Some(long), _) => words.push(format!("--{long}={value}")),
                (None, index) => positional.push((index.unwrap_or_default(), value)),
            }
        }
        positional.sort_unstable();
        words.extend(positional.into_iter().map(|(_, value)| value.to_owned()));
        words
    }

    /// The line with only this argument changed.
    fn with(&self, value: &str) -> Vec<String> {
        self.line(&[(self.argument.get_id().as_str(), value)])
    }
}

/// Every argument of every command that names a file.
fn slots() -> Vec<Slot> {
    fn walk(path: &str, command: &clap::Command, found: &mut Vec<Slot>) {
        let all: Vec<clap::Arg> = command.get_arguments().cloned().collect();
        for argument in command.get_arguments() {
            if let Some(role) = role(argument) {
                found.push(Slot { command: path.to_owned(), argument: argument.clone(), role, all: all.clone() });
            }
        }
        for below in command.get_subcommands() {
            walk(&format!("{path} {}", below.get_name()), below, found);
        }
    }
    let mut found = Vec::new();
    let mut command = specgen::cli::command();
    command.build();
    walk("specgen", &command, &mut found);
    found
}

/// A folder with the files of [`LINES`].
fn prepared() -> Folder {
    let folder = Folder::new();
    let learning = folder.read("reference.toml").replacen("[control]\n", "[control]\ncorrection = \"2 um\"\n", 1);
    folder.write("learning.toml", learning);
    folder.write("any.json", "{}");
    let zeros = "[0, 0, 0, 0, 0, 0]";
    folder.write("states.json", format!("[{{\"h\": {zeros}, \"hd\": {zeros}, \"hdd\": {zeros}}}]"));
    let sine = |k: i32| (f64::from(k) * 0.1).sin();
    let rows = (0..400).map(|k| format!("{},{},{}\n", f64::from(k) * 1e-3, 50.0 + 40.0 * sine(k), 6.0 + 5.0 * sine(k)));
    folder.write("sine.csv", format!("time_s,drive_V,displacement_um\n{}", rows.collect::<String>()));
    // Made once for all tests.
    static MADE: OnceLock<[(&str, Vec<u8>); 3]> = OnceLock::new();
    let made = MADE.get_or_init(|| {
        let folder = Folder::new();
        [
            ("r.csv", &["forc", "--grid", "4", "-o", "r.csv"][..]),
            ("table.csv", &["identify", "r.csv", "--drive", "0:100", "--grid", "4", "-o", "table.csv"]),
            ("run.rec", &["sim", "legs.toml", "--seconds", "0.1", "--record", "run.rec"]),
        ]
        .map(|(name, line)| {
            assert_eq!(folder.run(line).code, 0, "{line:?}");
            (name, fs::read(folder.path(name)).unwrap())
        })
    });
    made.iter().for_each(|(name, bytes)| folder.write(name, bytes));
    folder
}

/// Runs a line with a bound on memory and time; ends the test if it waits.
fn run(folder: &Folder, words: &[String]) -> Run {
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -v 8000000; exec \"$@\"", "sh", BINARY]).args(words);
    command.current_dir(folder.path("")).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let (out, err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let reader = |mut pipe: Box<dyn Read + Send>| {
        std::thread::spawn(move || {
            let mut text = String::new();
            pipe.read_to_string(&mut text).map(|_| text).unwrap_or_default()
        })
    };
    let (stdout, stderr) = (reader(Box::new(out)), reader(Box::new(err)));
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("specgen {words:?} waits");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    if start.elapsed() > Duration::from_secs(1) {
        println!("{:.1} s: {}", start.elapsed().as_secs_f64(), words.join(" "));
    }
    let code = status.code().unwrap_or_else(|| panic!("{words:?} ended by signal {:?}", status.signal()));
    Run { code, stdout: stdout.join().unwrap(), stderr: stderr.join().unwrap() }
}

#[test]
fn every_argument_for_a_file_says_what_it_is_for() {
    let slots = slots();
    for slot in &slots {
        assert_ne!(slot.role, Role::Unknown, "{}: give it one of the types of cli::named", slot.name());
    }
    let mut command = specgen::cli::command();
    command.build();
    let mut seen = 0;
    let mut ways = vec![("specgen".to_owned(), command)];
    while let Some((path, command)) = ways.pop() {
        let is_listed =
            LINES.iter().any(|(line, _)| *line == path) || path.ends_with(" help") || path.contains(" help ");
        assert!(is_listed || WITHOUT.contains(&path.as_str()), "{path}: add its line to LINES");
        for argument in command.get_arguments() {
            let names = argument.get_value_names().unwrap_or_default().join(" ");
            let sounds = ["FILE", "DIR", "PATH", "SPEC", "RECORD", "DEVICE", "TABLE", "ELF"];
            let name = format!("{path} {}", argument.get_id());
            if sounds.iter().any(|word| names.split(['|', ' ', '.', ']']).any(|part| part == *word)) {
                seen += 1;
                assert!(
                    role(argument).is_some() || UNTYPED.contains(&name.as_str()),
                    "{name}: it has no type of cli::named"
                );
            }
        }
        ways.extend(command.get_subcommands().map(|below| (format!("{path} {}", below.get_name()), below.clone())));
    }
    let count = |wanted: Role| slots.iter().filter(|slot| slot.role == wanted).count();
    println!("{} inputs, {} outputs, {} folders", count(Role::Input), count(Role::Output), count(Role::Folder));
    assert!(count(Role::Input) > 40 && count(Role::Output) > 15 && seen > 60, "{seen}");
}

/// A pipe without a writer, an endless device, a file of a terabyte, and a missing file are refused immediately, with the same exit
/// code and a message with the name.
#[test]
fn an_input_that_is_no_plain_file_is_refused_by_every_command() {
    let folder = prepared();
    mkfifoat(CWD, folder.path("pipe.toml"), Mode::RWXU).unwrap();
    fs::File::create(folder.path("huge.toml")).unwrap().set_len(1 << 40).unwrap();
    let kinds = [
        ("pipe.toml", "a named pipe (FIFO)"),
        ("/dev/zero", "a device"),
        ("absent.toml", "there is no such file"),
        ("huge.toml", ""),
    ];
    let slots = slots();
    let inputs = slots.iter().filter(|slot| slot.role == Role::Input);
    let mut tried = 0;
    for (number, slot) in inputs.enumerate() {
        // In the short run, one kind for each.
        for (name, words) in length(vec![kinds[number % 4]], kinds.to_vec()) {
            let run = run(&folder, &slot.with(name));
            let text = format!("{}{}", run.stdout, run.stderr);
            let shown = format!("{} = {name}: {run:#?}", slot.name());
            assert_eq!(run.code, 1, "{shown}");
            assert!(text.contains(name) && text.contains(words), "{shown}");
            tried += 1;
        }
    }
    // A missing endpoint has another message, but must not block either.
    for slot in slots.iter().filter(|slot| slot.role == Role::Endpoint) {
        let own = slot.argument.get_id().as_str();
        let other = if own == "port" { "socket" } else { "port" };
        let mut words = slot.with("pipe.toml");
        words.retain(|word| !word.starts_with(&format!("--{other}=")));
        assert_ne!(run(&folder, &words).code, 0, "{}", slot.name());
        tried += 1;
    }
    println!("{tried} runs");
    // Files that a spec names, and those of a session's lines.
    for (from, to) in [("records/reference-forc.csv", "pipe.toml"), ("records/reference-forc.csv", "absent.csv")] {
        folder.spec("naming.toml", &[(&format!("\"{from}\""), &format!("\"{to}\""))]);
        let run = run(&folder, &["check".to_owned(), "naming.toml".to_owned()]);
        assert!(run.code == 1 && run.stderr.contains(to), "{run:#?}");
    }
}

/// The other names of a file.
fn names(folder: &Folder, input: &str) -> Vec<String> {
    let [link, hard] = ["link", "hard"].map(|kind| format!("{kind}-{}", input.replace('/', "-")));
    let _ = (fs::remove_file(folder.path(&link)), fs::remove_file(folder.path(&hard)));
    symlink(folder.path(input), folder.path(&link)).unwrap();
    fs::hard_link(folder.path(input), folder.path(&hard)).unwrap();
    vec![input.to_owned(), format!("./{input}"), link, hard]
}

/// Every output of every command, set to each of its inputs, under each name of that file.
#[test]
fn no_output_replaces_an_input() {
    let folder = prepared();
    let slots = slots();
    let mut pairs = 0;
    for output in slots.iter().filter(|slot| slot.role == Role::Output) {
        for input in slots.iter().filter(|slot| slot.role == Role::Input && slot.command == output.command) {
            // The name of a plot determines its format.
            let name = if output.argument.get_id() == "plot" { "input.svg" } else { "input.toml" };
            folder.write(name, "what the user has measured");
            let id = input.argument.get_id().as_str();
            // In the short run, one name for each.
            let names = names(&folder, name);
            for other in length(vec![names[pairs % 4].clone()], names) {
                let words = output.line(&[(id, name), (output.argument.get_id().as_str(), &other)]);
                let run = run(&folder, &words);
                // Some arguments exclude each other, which is reported first.
                assert!(run.code == 2, "{words:?}: {run:#?}");
                let told = ["is an input of this command", "cannot be used with"];
                assert!(told.iter().any(|words| run.stderr.contains(words)), "{words:?}: {run:#?}");
                assert_eq!(folder.read(name), "what the user has measured", "{words:?}");
            }
            pairs += 1;
        }
    }
    assert!(pairs > 25, "{pairs}");
    println!("{pairs} pairs of an input and an output");
}

/// Commands that once lost data, and files that only a spec names.
#[test]
fn data_is_where_it_was() {
    let folder = prepared();
    folder.write("own.toml", folder.read("legs.toml"));
    let before = folder.listing();
    for line in [
        "identify r.csv --drive 0:100 --grid 4 -o r.csv",
        "identify r.csv --drive 0:100 --grid 4 --validate table.csv -o table.csv",
        "forc own.toml -o own.toml",
        "sim own.toml --record own.toml",
        "report own.toml -o own.toml",
        "replay run.rec --csv run.rec",
        "identify predict own.toml r.csv -o r.csv",
        "identify predict table.csv r.csv -o table.csv",
        "identify predict own.toml r.csv -o records/reference-forc.csv",
        "sim own.toml --record records/reference-forc.csv",
        "identify gauge r.csv --table r.csv",
        "dynamics reference.toml --states states.json -o states.json",
        "learn learning.toml --from any.json -o any.json",
        "replay run.rec --csv out.csv --mcap out.csv",
        "replay run.rec --csv out.csv --mcap ./records/../out.csv",
    ] {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let run = run(&folder, &words);
        assert!(run.code == 2 && run.stderr.contains("is not written: "), "{line}: {run:#?}");
        assert_eq!(folder.listing(), before, "{line}");
    }
}

#[test]
fn what_cannot_be_written_is_left_alone() {
    let folder = prepared();
    for name in ["protected.csv", "protected.svg"] {
        folder.write(name, "mine");
        fs::set_permissions(folder.path(name), fs::Permissions::from_mode(0o444)).unwrap();
    }
    fs::create_dir(folder.path("folder.svg")).unwrap();
    let before = folder.listing();
    for (number, slot) in slots().iter().filter(|slot| slot.role == Role::Output).enumerate() {
        let is_plot = slot.argument.get_id() == "plot";
        let [protected, dir] = if is_plot { ["protected.svg", "folder.svg"] } else { ["protected.csv", "records"] };
        // In the short run, one kind for each.
        let kinds = [(protected, "write-protected"), (dir, "it is a folder")];
        for (name, words) in length(vec![kinds[number % 2]], kinds.to_vec()) {
            let run = run(&folder, &slot.with(name));
            assert!(run.code == 3 && run.stderr.contains(words), "{} = {name}: {run:#?}", slot.name());
        }
        assert_eq!(folder.listing(), before, "{}", slot.name());
    }
    // The spec that `tune` would write.
    folder.write("own.toml", folder.read("legs.toml"));
    fs::set_permissions(folder.path("own.toml"), fs::Permissions::from_mode(0o400)).unwrap();
    folder.run(&["tune", "own.toml", "--write"]).says(3, &["own.toml", "write-protected"]);
    // A pipe without a reader ends the command, and remains a pipe.
    mkfifoat(CWD, folder.path("pipe"), Mode::RWXU).unwrap();
    let words = ["forc", "--grid", "4", "-o", "pipe"].map(str::to_owned);
    let run = run(&folder, &words);
    assert!(run.code == 3 && run.stderr.contains("no program reads this pipe"), "{run:#?}");
}

/// Files named by the spec are inputs, even if the command does not read them.
#[test]
fn no_output_replaces_a_table_of_the_spec() {
    let folder = Folder::new();
    fs::create_dir(folder.path("waves")).unwrap();
    folder.write("waves/w.csv", "x_um\n0\n1\n0\n");
    let path = "[[trajectory]]\nname = \"w\"\nkind = \"waveform\"\nfile = \"waves/w.csv\"\nperiod = \"10 ms\"\n\n[[trajectory]]";
    folder.write("m.toml", folder.read("reference.toml").replacen("[[trajectory]]", path, 1));
    folder.run(&["forc", "m.toml", "-o", "waves/w.csv"]).says(2, &["waves/w.csv` is not written: it is an input"]);
    assert_eq!(folder.read("waves/w.csv"), "x_um\n0\n1\n0\n");
}

/// A command writes either all of its files or none.
#[test]
fn of_several_outputs_none_is_written_if_one_cannot_be() {
    let folder = Folder::new();
    for (name, rate) in [("slow.csv", "20"), ("fast.csv", "400")] {
        assert_eq!(folder.run(&["forc", "-o", name, "--grid", "8", "--rate", rate]).code, 0);
    }
    let names = ["leg-static.csv", "leg-dead-time.csv", "leg.toml"];
    names.iter().for_each(|name| folder.write(name, "mine"));
    fs::set_permissions(folder.path("leg.toml"), fs::Permissions::from_mode(0o444)).unwrap();
    let rate = ["identify", "rate", "slow.csv", "fast.csv", "--drive", "0:100", "--grid", "8", "-o", "leg"];
    folder.run(&rate).says(3, &["leg.toml`", "write-protected", "nothing was changed"]);
    names.iter().for_each(|name| assert_eq!(folder.read(name), "mine", "{name}"));

    folder.write("rep-paper.html", folder.read("legs.toml"));
    folder.write("rep.html", "mine");
    let report = ["report", "rep-paper.html", "--no-target", "--paper", "--generations", "1", "-o", "rep.html"];
    folder.run(&report).says(2, &["rep-paper.html` is not written: it is an input", "nothing was changed"]);
    assert_eq!(folder.read("rep.html"), "mine");
}

/// A replaced file keeps its permissions.
#[test]
fn a_file_that_others_may_not_read_stays_one() {
    let folder = Folder::new();
    folder.write("curves.csv", "old");
    fs::set_permissions(folder.path("curves.csv"), fs::Permissions::from_mode(0o600)).unwrap();
    assert_eq!(folder.run(&["forc", "--grid", "4", "-o", "curves.csv"]).code, 0);
    assert!(folder.read("curves.csv").starts_with("time_s"));
    assert_eq!(fs::metadata(folder.path("curves.csv")).unwrap().permissions().mode() & 0o777, 0o600);
}

/// A limit on file sizes (`ulimit -f`) is reported like a full disk, and existing files are kept.
#[test]
fn a_file_that_grows_beyond_the_limit_is_an_error_to_report() {
    let folder = Folder::new();
    folder.write("old.csv", "old");
    let before = folder.listing();
    for line in [
        "forc --grid 8 -o old.csv",
        "forc --grid 8 -o new/curves.csv",
        "identify records/leg1.csv --drive 0:100 --grid 32 -o old.csv",
        "identify records/leg1.csv --drive 0:100 --grid 8 --plot a.svg",
        "legs.toml --no-build -o out",
        "new mine --like reference",
        "dump-ir legs.toml > printed",
        "check legs.toml --json > printed",
        "sim --help > printed",
    ] {
        let script = format!("ulimit -f 2; '{BINARY}' {line}");
        let output = Command::new("sh").args(["-c", &script]).current_dir(folder.path("")).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{line}: {output:?}");
        assert!(text.contains("File too large") && text.contains("could not"), "{line}: {text}");
        let _ = fs::remove_file(folder.path("printed"));
        assert_eq!(folder.listing(), before, "{line}");
    }
}

/// Help and version are also results.
#[test]
fn help_that_finds_no_room_is_an_error() {
    let Ok(_) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        return crate::support::skipped("there is no /dev/full here");
    };
    let mut lines: Vec<Vec<String>> = LINES
        .iter()
        .map(|(command, _)| command.split(' ').skip(1).map(str::to_owned).chain(["--help".to_owned()]).collect())
        .collect();
    lines.extend([vec!["--version".to_owned()], vec!["help".to_owned()], vec!["-h".to_owned()]]);
    for words in lines.into_iter().step_by(length(3, 1)) {
        let to = |path: &str| {
            let file = fs::OpenOptions::new().write(true).open(path).unwrap();
            Command::new(BINARY).args(&words).stdout(file).output().unwrap()
        };
        let full = to("/dev/full");
        let text = String::from_utf8_lossy(&full.stderr).into_owned();
        assert_eq!(full.status.code(), Some(3), "{words:?}: {text}");
        assert!(text.contains("could not write to standard output"), "{words:?}: {text}");
        let good = to("/dev/null");
        assert!(good.status.success() && good.stderr.is_empty(), "{words:?}: {good:?}");
    }
    // A reader that closes the pipe early is not an error.
    let script = format!("'{BINARY}' --help | head -1; echo \"${{PIPESTATUS[0]}}\"");
    let output = Command::new("bash").args(["-c", &script]).output().unwrap();
    assert!(String::from_utf8_lossy(&output.stdout).ends_with("\n0\n") && output.stderr.is_empty(), "{output:?}");
}

/// A shell's pipes are read and written.
#[test]
fn pipes_of_a_shell_work() {
    let folder = Folder::new();
    for script in [
        "cat legs.toml | 'SPECGEN' check /dev/stdin --json > /dev/null || true",
        "'SPECGEN' forc --grid 4 -o /dev/stdout | grep -q displacement_um",
        "'SPECGEN' forc --grid 4 -o >(cat > copied.csv); sleep 0.2; grep -q displacement_um copied.csv",
        "'SPECGEN' forc --grid 4 -o /dev/null",
    ] {
        let script = script.replace("SPECGEN", BINARY);
        let output = Command::new("bash").args(["-ec", &script]).current_dir(folder.path("")).output().unwrap();
        assert!(output.status.success(), "{script}: {output:?}");
    }
    // A spec without records is reported as such.
    let output = Command::new("bash")
        .args(["-c", &format!("'{BINARY}' check <(echo 'no = \"spec\"')")])
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && !text.contains("E0101"), "{text}");
}
