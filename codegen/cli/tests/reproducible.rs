//! The output depends only on the spec and its records.

use crate::support;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::support::unprivileged::Unprivileged;
use crate::support::{Folder, Run, contents, repository};

type Files = BTreeMap<String, Vec<u8>>;

/// Both kinds of controller: task space, legs with their own gauges.
const KINDS: [&str; 2] = ["reference.toml", "legs.toml"];

/// In the short run, both kinds only if they have different sources, otherwise one.
fn some(kind: usize) -> &'static [&'static str] {
    support::length(&KINDS[kind..][..1], &KINDS)
}

/// Writes the workspace of a spec to `output` without further options.
fn plain(folder: &Folder, spec: &str, output: &str) -> Files {
    made(folder.command().args([spec, "-o", output, "--no-build"]), &folder.path(output))
}

/// The same workspace, written once for all tests.
fn baseline(spec: &'static str) -> Files {
    static MADE: Mutex<BTreeMap<&str, Files>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(spec).or_insert_with(|| plain(&Folder::new(), spec, "out")).clone()
}

fn made(command: &mut Command, output: &Path) -> Files {
    let run = Run::of(command);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let files = contents(output);
    assert!(files.len() > 30, "{} files", files.len());
    files
}

/// Asserts that all files are equal, and names the first difference.
fn same(left: &Files, right: &Files) {
    assert_eq!(left.keys().collect::<Vec<_>>(), right.keys().collect::<Vec<_>>());
    for (path, bytes) in left {
        let at = bytes.iter().zip(&right[path]).position(|(a, b)| a != b);
        assert!(*bytes == right[path], "{path} differs, from byte {at:?} of {}", bytes.len());
    }
}

#[test]
fn two_runs_give_the_same_bytes_and_one_changed_constant_does_not() {
    let folder = Folder::new();
    let constants = [
        ("modal_damping   = 0.02 ", "modal_damping   = 0.020000000000000004 "),
        ("level_weight = 0.252", "level_weight = 0.2520000000000001"),
    ];
    for (spec, (old, new)) in KINDS.into_iter().zip(constants) {
        let first = baseline(spec);
        same(&first, &plain(&folder, spec, "again"));
        let text = folder.read(spec);
        assert_eq!(text.matches(old).count(), 1, "{spec}: `{old}`");
        folder.write("other.toml", text.replace(old, new));
        let other = plain(&folder, "other.toml", "other");
        assert_ne!(first["controller/src/defaults.rs"], other["controller/src/defaults.rs"]);
        assert_ne!(first["ir.json"], other["ir.json"]);
    }
    // A record is also a source: one digit in its last line.
    let record = folder.read("records/reference-forc.csv");
    let (head, last) = record.trim_end().rsplit_once('\n').unwrap();
    folder.write("records/reference-forc.csv", format!("{head}\n{last}1\n"));
    for spec in KINDS {
        assert_ne!(baseline(spec)["ir.json"], plain(&folder, spec, "third")["ir.json"], "{spec}");
    }
}

/// A table of poses is also a source.
#[test]
fn a_table_of_poses_is_a_source() {
    let folder = Folder::new();
    let text = folder.read("reference.toml");
    let spec = text.replacen(
        "kind      = \"case-1\"\nfrequency = \"1 Hz\"",
        "kind   = \"waveform\"\nfile   = \"table.csv\"\nperiod = \"1 ms\"",
        1,
    );
    assert_ne!(text, spec);
    folder.write("table.toml", spec);
    folder.write("table.csv", "x_um\n0\n1\n0\n");
    let first = plain(&folder, "table.toml", "first");
    same(&first, &plain(&folder, "table.toml", "again"));
    folder.write("table.csv", "x_um\n0\n1.0000000000000002\n0\n");
    let other = plain(&folder, "table.toml", "other");
    assert_ne!(first["controller/src/setpoint.rs"], other["controller/src/setpoint.rs"]);
}

#[test]
fn the_folder_and_the_name_of_the_spec_do_not_matter() {
    for &spec in some(0) {
        let (folder, other) = (Folder::new(), Folder::new());
        let first = baseline(spec);
        same(&first, &plain(&other, spec, "out"));

        // From somewhere else, by absolute paths.
        let mut command = Command::new(support::BINARY);
        command.current_dir("/").arg(folder.path(spec)).arg("-o").arg(folder.path("far")).arg("--no-build");
        same(&first, &made(&mut command, &folder.path("far")));

        fs::create_dir_all(folder.path("deep er/ünïcode/records")).unwrap();
        for (from, to) in [(spec, "my platform.toml"), ("records/reference-forc.csv", "records/reference-forc.csv")] {
            fs::copy(folder.path(from), folder.path("deep er/ünïcode").join(to)).unwrap();
        }
        let mut command = folder.command();
        command.args(["deep er/ünïcode/my platform.toml", "-o", "deep er/out", "--no-build"]);
        same(&first, &made(&mut command, &folder.path("deep er/out")));
    }
}

#[test]
fn the_environment_does_not_matter() {
    let odd = [
        ("USER", "another-user"),
        ("LOGNAME", "another-user"),
        ("HOME", "/nonexistent"),
        ("LANG", "tr_TR.UTF-8"),
        ("LC_ALL", "de_DE.UTF-8"),
        ("TZ", "Pacific/Kiritimati"),
        ("SOURCE_DATE_EPOCH", "1"),
        ("HOSTNAME", "elsewhere"),
        ("RUST_BACKTRACE", "full"),
        ("CLICOLOR_FORCE", "1"),
        ("RAYON_NUM_THREADS", "3"),
    ];
    let folder = Folder::new();
    for &spec in some(1) {
        let first = baseline(spec);
        let mut command = folder.command();
        command.envs(odd).args([spec, "-o", "odd", "--no-build"]);
        same(&first, &made(&mut command, &folder.path("odd")));
        let mut command = folder.command();
        command.env_clear().args([spec, "-o", "bare", "--no-build"]);
        same(&first, &made(&mut command, &folder.path("bare")));
    }
}

#[test]
fn line_ends_of_the_spec_do_not_matter() {
    let folder = Folder::new();
    for &spec in some(0) {
        let first = baseline(spec);
        let text = folder.read(spec);
        assert!(!text.contains('\r'));
        folder.write(spec, text.replace('\n', "\r\n"));
        same(&first, &plain(&folder, spec, "crlf"));
    }
}

#[test]
fn another_user_makes_the_same_bytes() {
    let folder = Folder::new();
    let Some(user) = Unprivileged::owning(&folder) else { return };
    for spec in some(1) {
        let mut command = user.command(&folder);
        command.args([spec, "-o", "theirs", "--no-build"]);
        same(&baseline(spec), &made(&mut command, &folder.path("theirs")));
    }
}

/// The committed controller is that of the reference spec; otherwise the other tests would compare a stale one.
#[test]
fn the_committed_controller_is_the_reference_output() {
    let files = baseline("reference.toml");
    let committed = contents(&repository().join("firmware/controller"));
    let emitted: Files = files
        .into_iter()
        .filter_map(|(path, bytes)| Some((path.strip_prefix("controller/")?.to_owned(), bytes)))
        .collect();
    same(&committed, &emitted);
}

#[test]
fn no_clock_path_user_or_host_reaches_the_output() {
    let folder = Folder::new();
    let mut files = Files::new();
    for spec in KINDS {
        let mut command = folder.command();
        command.env("USER", "user-of-this-run").env("LOGNAME", "user-of-this-run");
        let of_kind = made(command.args([spec, "-o", "out", "--no-build"]), &folder.path("out"));
        files.extend(of_kind.into_iter().map(|(path, bytes)| (format!("{spec}: {path}"), bytes)));
    }
    let mut traces = vec![
        folder.path("").to_string_lossy().trim_end_matches('/').to_owned(),
        repository().to_string_lossy().into_owned(),
        "user-of-this-run".to_owned(),
        "/home/".to_owned(),
        ".cargo/".to_owned(),
        "legs.toml".to_owned(),
        "reference.toml".to_owned(),
    ];
    traces.extend(std::env::var("HOME").ok().filter(|home| home.len() > 1));
    // A short host name could be a word of the text.
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_owned();
    if host.len() >= 6 {
        traces.push(host);
    }
    let year = 1970 + SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs() / 31_556_952;
    // The licences have the year of the notice.
    for (path, bytes) in files.iter().filter(|(path, _)| !path.contains("LICENSE-")) {
        let text = String::from_utf8(bytes.clone()).unwrap();
        for trace in &traces {
            assert!(!text.contains(trace), "{path} holds `{trace}`");
        }
        // As a separate number, because the digits may occur in a constant or a digest.
        let mut words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '_'));
        assert!(!words.any(|word| word == year.to_string()), "{path} holds the year {year}");
    }
}
