//! The output depends on the spec and its records, and on nothing else.

#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use support::unprivileged::Unprivileged;
use support::{Folder, Run, contents, repository};

type Files = BTreeMap<String, Vec<u8>>;

/// The reference workspace, made in the plainest way.
fn baseline(folder: &Folder) -> Files {
    made(folder.command().args(["legs.toml", "-o", "out", "--no-build"]), &folder.path("out"))
}

fn made(command: &mut Command, output: &Path) -> Files {
    let run = Run::of(command);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let files = contents(output);
    assert!(files.len() > 30, "{} files", files.len());
    files
}

/// The same bytes in every file, the first difference named.
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
    let first = baseline(&folder);
    same(&first, &made(folder.command().args(["legs.toml", "-o", "again", "--no-build"]), &folder.path("again")));
    folder.spec("other.toml", &[("level_weight = 0.252", "level_weight = 0.2520000000000001")]);
    let other = made(folder.command().args(["other.toml", "-o", "other", "--no-build"]), &folder.path("other"));
    assert_ne!(first["controller/src/config.rs"], other["controller/src/config.rs"]);
    assert_ne!(first["ir.json"], other["ir.json"]);
    // The record is as much a source as the spec: one digit in its last line.
    let record = folder.read("records/reference-forc.csv");
    let (head, last) = record.trim_end().rsplit_once('\n').unwrap();
    folder.write("records/reference-forc.csv", format!("{head}\n{last}1\n"));
    let other = made(folder.command().args(["legs.toml", "-o", "third", "--no-build"]), &folder.path("third"));
    assert_ne!(first["ir.json"], other["ir.json"]);
}

#[test]
fn the_folder_and_the_name_of_the_spec_do_not_matter() {
    let (folder, other) = (Folder::new(), Folder::new());
    let first = baseline(&folder);
    same(&first, &baseline(&other));

    // From somewhere else, by absolute paths.
    let mut command = Command::new(support::BINARY);
    command.current_dir("/").arg(folder.path("legs.toml")).arg("-o").arg(folder.path("far")).arg("--no-build");
    same(&first, &made(&mut command, &folder.path("far")));

    fs::create_dir_all(folder.path("deep er/ünïcode")).unwrap();
    fs::create_dir(folder.path("deep er/ünïcode/records")).unwrap();
    for (from, to) in [("legs.toml", "my platform.toml"), ("records/reference-forc.csv", "records/reference-forc.csv")]
    {
        fs::copy(folder.path(from), folder.path("deep er/ünïcode").join(to)).unwrap();
    }
    let mut command = folder.command();
    command.args(["deep er/ünïcode/my platform.toml", "-o", "deep er/out", "--no-build"]);
    same(&first, &made(&mut command, &folder.path("deep er/out")));
}

#[test]
fn the_environment_does_not_matter() {
    let folder = Folder::new();
    let first = baseline(&folder);
    let odd = [
        ("USER", "somebody-else"),
        ("LOGNAME", "somebody-else"),
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
    let mut command = folder.command();
    command.envs(odd).args(["legs.toml", "-o", "odd", "--no-build"]);
    same(&first, &made(&mut command, &folder.path("odd")));
    let mut command = folder.command();
    command.env_clear().args(["legs.toml", "-o", "bare", "--no-build"]);
    same(&first, &made(&mut command, &folder.path("bare")));
}

#[test]
fn line_ends_of_the_spec_do_not_matter() {
    let folder = Folder::new();
    let first = baseline(&folder);
    let text = folder.read("legs.toml");
    assert!(!text.contains('\r'));
    folder.write("legs.toml", text.replace('\n', "\r\n"));
    same(&first, &made(folder.command().args(["legs.toml", "-o", "crlf", "--no-build"]), &folder.path("crlf")));
}

#[test]
fn another_user_makes_the_same_bytes() {
    let folder = Folder::new();
    let first = baseline(&folder);
    let Some(user) = Unprivileged::owning(&folder) else { return };
    let mut command = user.command(&folder);
    command.args(["legs.toml", "-o", "theirs", "--no-build"]);
    same(&first, &made(&mut command, &folder.path("theirs")));
}

/// The committed controller is what the reference spec gives: else the rest would compare something stale.
#[test]
fn the_committed_controller_is_the_reference_output() {
    let folder = Folder::new();
    let files = baseline(&folder);
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
    let mut command = folder.command();
    command.env("USER", "user-of-this-run").env("LOGNAME", "user-of-this-run");
    let files = made(command.args(["legs.toml", "-o", "out", "--no-build"]), &folder.path("out"));
    let mut traces = vec![
        folder.path("").to_string_lossy().trim_end_matches('/').to_owned(),
        repository().to_string_lossy().into_owned(),
        "user-of-this-run".to_owned(),
        "/home/".to_owned(),
        ".cargo/".to_owned(),
        "legs.toml".to_owned(),
    ];
    traces.extend(std::env::var("HOME").ok().filter(|home| home.len() > 1));
    // A host may be called anything; a short name could be a word of the text.
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_owned();
    if host.len() >= 6 {
        traces.push(host);
    }
    let year = 1970 + SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs() / 31_556_952;
    for (path, bytes) in &files {
        let text = String::from_utf8(bytes.clone()).unwrap();
        for trace in &traces {
            assert!(!text.contains(trace), "{path} holds `{trace}`");
        }
        // As a number of its own: the digits may well occur in a constant or a digest.
        let mut words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '_'));
        assert!(!words.any(|word| word == year.to_string()), "{path} holds the year {year}");
    }
}
