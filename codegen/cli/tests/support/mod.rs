//! Runs the real binary on a copy of the specs, and checks its output.

#[expect(dead_code, reason = "the cases are only read here")]
#[path = "../../../../tests/src/cases.rs"]
pub mod cases;
pub mod commands;
pub mod unprivileged;

use rustix::fs::{StatVfsMountFlags, statvfs};
use rustix::process::{Pid, Signal, kill_process};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use serde_json::Value;
use specgen::findings;
pub use specgen::target::skipped;
use specgen::target::{self, Tools};

pub const BINARY: &str = env!("CARGO_BIN_EXE_specgen");

/// The repository's own files.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_owned()
}

/// A temporary folder with a copy of the example specs and their records.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// In memory in the short run, because outputs are synced to the disk.
    pub fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let usable = statvfs(memory).is_ok_and(|found| {
            !found.f_flag.contains(StatVfsMountFlags::NOEXEC) && found.f_bavail * found.f_frsize > 1 << 30
        });
        if length(usable, false) { Self::below(memory) } else { Self::on_disk() }
    }

    /// On the disk, which is slower.
    pub fn on_disk() -> Self {
        Self::below(&std::env::temp_dir())
    }

    fn below(place: &Path) -> Self {
        let folder = Self(tempfile::tempdir_in(place).unwrap());
        let specs = repository().join("specs");
        fs::create_dir(folder.path("records")).unwrap();
        for file in ["reference.toml", "legs.toml", "minimal.toml", "records/leg1.csv", "records/reference-forc.csv"] {
            fs::copy(specs.join(file), folder.path(file)).unwrap();
        }
        folder
    }

    pub fn path(&self, below: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(below)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Writes `name`: the spec of six legs with each first text replaced by the second.
    pub fn spec(&self, name: &str, edits: &[(&str, &str)]) {
        let mut text = self.read("legs.toml");
        for (old, new) in edits {
            assert_eq!(text.matches(old).count(), 1, "`{old}` must stand once in legs.toml");
            text = text.replace(old, new);
        }
        self.write(name, text);
    }

    /// `specgen ARGUMENTS` in this folder.
    pub fn run(&self, arguments: &[&str]) -> Run {
        Run::of(self.command().args(arguments))
    }

    /// `specgen LINE` in this folder, the line split as by a shell.
    pub fn line(&self, line: &str) -> Run {
        Run::of(self.command().args(shlex::split(line).unwrap()))
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(BINARY);
        command.current_dir(self.0.path());
        command
    }

    /// The same with `--json`: exit code and document.
    pub fn json(&self, arguments: &[&str]) -> Document {
        let run = Run::of(self.command().args(arguments).arg("--json"));
        Document::of(&run)
    }

    pub fn listing(&self) -> Listing {
        listing(self.0.path())
    }
}

/// What a run printed and returned.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    pub fn of(command: &mut Command) -> Self {
        let run = Self::ended(&format!("{command:?}"), command.output().unwrap());
        assert!(!run.stderr.contains("panicked at"), "{command:?}: {}", run.stderr);
        assert!((0..=3).contains(&run.code), "{command:?}: exit code {}\n{}", run.code, run.stderr);
        run
    }

    /// The result of a process that was not killed.
    pub fn ended(what: &str, output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or_else(|| panic!("{what} ended by a signal: {output:?}")),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs `command`, and calls `act` on the process once standard error satisfies `seen`.
    pub fn meanwhile(command: &mut Command, seen: impl Fn(&str) -> bool, act: impl FnOnce(u32)) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap());
        let mut stderr = String::new();
        while !seen(&stderr) {
            assert_ne!(lines.read_line(&mut stderr).unwrap(), 0, "{command:?} ended too early: {stderr}");
        }
        act(child.id());
        lines.read_to_string(&mut stderr).unwrap();
        Self { stderr, ..Self::ended(&format!("{command:?}"), child.wait_with_output().unwrap()) }
    }

    /// Asserts that the run failed with `code`, with all `words` on standard error.
    pub fn says(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, code, "{self:#?}");
        for word in words {
            assert!(self.stderr.contains(word), "no `{word}` in:\n{}", self.stderr);
        }
    }
}

/// The JSON document of a run.
#[derive(Debug)]
pub struct Document {
    pub code: i32,
    pub value: Value,
}

impl Document {
    /// Asserts one document on standard output, consistent with the exit code, with registered and documented findings.
    pub fn of(run: &Run) -> Self {
        let value: Value = serde_json::from_str(&run.stdout)
            .unwrap_or_else(|error| panic!("not one JSON document: {error}\n{}", run.stdout));
        assert_eq!(run.stderr, "", "nothing but the document is printed");
        assert_eq!(value["exit_code"], run.code);
        assert_eq!(value["error"].is_null(), run.code == 0, "{value:#}");
        // A failed verdict also has a result.
        assert!(run.code == 1 || value["result"].is_null() == (run.code != 0), "{value:#}");
        assert_eq!(value["specgen"], env!("CARGO_PKG_VERSION"));
        let document = Self { code: run.code, value };
        let reference = findings::reference_markdown();
        for finding in document.findings() {
            let code = finding["code"].as_str().unwrap();
            assert!(findings::find(code).is_some(), "{code} is not registered");
            assert!(reference.contains(&format!("\n## {code}: ")), "{code} is not in the page of findings");
            for key in ["message", "help", "severity"] {
                assert!(finding[key].as_str().is_some_and(|text| !text.is_empty()), "{key} of {finding:#}");
            }
            for key in ["file", "line", "column", "key"] {
                assert!(finding.get(key).is_some(), "{key} of {finding:#}");
            }
        }
        document
    }

    pub fn findings(&self) -> &[Value] {
        self.value["findings"].as_array().unwrap()
    }

    /// The one finding with this code.
    pub fn finding(&self, code: &str) -> &Value {
        let with_code = |finding: &&Value| finding["code"] == code;
        self.findings().iter().find(with_code).unwrap_or_else(|| panic!("no {code} in {:#}", self.value))
    }

    pub fn error(&self) -> &str {
        self.value["error"].as_str().unwrap_or_default()
    }
}

/// Everything below a folder: kind, permissions, and digest or target.
pub type Listing = BTreeMap<String, String>;

pub fn listing(root: &Path) -> Listing {
    fn walk(root: &Path, folder: &Path, out: &mut Listing) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let found = fs::symlink_metadata(&path).unwrap();
            let what = if found.is_dir() {
                walk(root, &path, out);
                "folder".to_owned()
            } else if found.is_symlink() {
                format!("link to {}", fs::read_link(&path).unwrap().display())
            } else {
                digest(&fs::read(&path).unwrap())
            };
            let relative = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
            out.insert(relative, format!("{what} {:?}", found.permissions()));
        }
    }
    let mut out = Listing::new();
    walk(root, root, &mut out);
    out
}

/// SHA-256 in hexadecimal, computed independently of the code under test.
pub fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes of every file below a folder.
pub fn contents(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = listing(root).into_keys().filter(|path| root.join(path).is_file());
    files.map(|path| (path.clone(), fs::read(root.join(path)).unwrap())).collect()
}

/// Sends a signal, without an external program.
#[track_caller]
pub fn send(signal: Signal, process: u32) {
    kill_process(Pid::from_raw(process.cast_signed()).unwrap(), signal).unwrap();
}

/// A thread that goes on until it is dropped.
pub struct Background {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Background {
    /// `work` returns soon after its argument is set.
    pub fn new(work: impl FnOnce(&AtomicBool) + Send + 'static) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        Self { over, thread: Some(std::thread::spawn(move || work(&ends))) }
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || std::thread::panicking());
    }
}

/// The stored active damping of every spec with the platform, period and lags of `reference.toml`. Without it, each command on a spec
/// with active damping searches a design for seconds.
pub fn damping_design() -> String {
    let text = fs::read_to_string(repository().join("specs/features/platform-damping.toml")).unwrap();
    format!("\n[control.design]\n{}", text.split_once("[control.design]\n").unwrap().1)
}

/// Selects the short value, or the long one in the full run.
pub fn length<T>(short: T, long: T) -> T {
    if std::env::var_os("SPECGEN_FULL").is_some() { long } else { short }
}

/// The script of axe-core, which finds violations of accessibility rules: the file that `SPECGEN_AXE` names, or the one that
/// `npm install --global axe-core` installs. None, with a message, if there is neither.
pub fn axe() -> Option<String> {
    let installed = || {
        let output = Command::new("npm").args(["root", "--global"]).stderr(Stdio::null()).output().ok()?;
        let root = String::from_utf8(output.stdout).ok()?;
        Some(Path::new(root.trim()).join("axe-core/axe.min.js"))
    };
    let file = std::env::var_os("SPECGEN_AXE").map(PathBuf::from).or_else(installed);
    let script = file.and_then(|file| fs::read_to_string(file).ok());
    if script.is_none() {
        skipped("no axe-core (npm install --global axe-core): accessibility of the pages is not checked");
    }
    script
}

/// An expression for a browser with the script of [`axe`]: a promise of one line for each rule that the page violates.
pub const VIOLATIONS: &str =
    r"axe.run().then(run => run.violations.map(v => `${v.impact} ${v.id}: ${v.nodes.map(n => n.target)}`).join('\n'))";

/// Cross compiler and emulator; none, with a message, if one is missing and not required.
pub fn tools() -> Option<Tools> {
    target::found_or_skipped(target::available()).unwrap_or_else(|error| panic!("{error}"))
}
