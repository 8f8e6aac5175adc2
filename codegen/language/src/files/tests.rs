use super::*;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::net::UnixListener;

use rustix::fs::{CWD, Mode, mkfifoat};

/// A folder with `read.csv`, which is read, and `free.csv`, which is not.
fn folder() -> (tempfile::TempDir, impl Fn(&str) -> PathBuf) {
    forget_inputs();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().to_owned();
    let at = move |name: &str| root.join(name);
    for name in ["read.csv", "free.csv"] {
        fs::write(at(name), "1,2\n").unwrap();
    }
    assert_eq!(text(&at("read.csv")).unwrap(), "1,2\n");
    (folder, at)
}

fn refusal(path: &Path) -> String {
    guard(path).unwrap_err().to_string()
}

#[test]
fn an_input_is_no_output_whatever_its_name() {
    let (_folder, at) = folder();
    symlink("read.csv", at("link.csv")).unwrap();
    symlink("link.csv", at("second.csv")).unwrap();
    fs::hard_link(at("read.csv"), at("hard.csv")).unwrap();
    for name in ["read.csv", "./read.csv", "link.csv", "second.csv", "hard.csv"] {
        let path = at(name);
        assert!(refusal(&path).contains("an input of this command"), "{name}");
        assert!(matches!(guard_edit(&path), Ok(Destination::File(_))), "{name}");
    }
    assert!(matches!(guard(&at("free.csv")), Ok(Destination::File(target)) if target.ends_with("free.csv")));
    // Another command begins.
    forget_inputs();
    assert!(guard(&at("read.csv")).is_ok());
    note_input(&at("link.csv"));
    assert!(refusal(&at("read.csv")).contains("link.csv"));
}

#[test]
fn links_to_nothing_lead_to_what_is_to_be() {
    let (_folder, at) = folder();
    symlink("b", at("a")).unwrap();
    symlink("new.csv", at("b")).unwrap();
    assert!(matches!(guard(&at("a")), Ok(Destination::File(target)) if target.ends_with("new.csv")));
    symlink("d", at("c")).unwrap();
    symlink("c", at("d")).unwrap();
    assert!(guard(&at("c")).is_err());
    assert!(matches!(guard(&at("read.csv/below")), Ok(Destination::File(_))));
}

/// Root may write to everything, and is refused all the same.
#[test]
fn what_is_write_protected_stays_as_it_is() {
    let (_folder, at) = folder();
    let protect = |mode| fs::set_permissions(at("free.csv"), fs::Permissions::from_mode(mode)).unwrap();
    for (mode, free) in [(0o444, false), (0o400, false), (0o644, true), (0o000, false)] {
        protect(mode);
        assert_eq!(guard(&at("free.csv")).is_ok(), free, "{mode:o}");
    }
    assert_eq!(refusal(&at("free.csv")), OutputError::Protected.to_string());
}

/// Nothing waits for a process that does not exist.
#[test]
fn the_kind_is_seen_before_the_file_is_opened() {
    let (_folder, at) = folder();
    mkfifoat(CWD, at("pipe"), Mode::RWXU).unwrap();
    let _listener = UnixListener::bind(at("socket")).unwrap();
    let cases = [
        (at("pipe"), "a named pipe (FIFO)", None),
        (at("socket"), "a socket", Some("a socket")),
        (at("."), "a folder", Some("a folder")),
        ("/dev/zero".into(), "a device", None),
        ("/dev/null".into(), "a device", None),
    ];
    for (path, kind, output) in cases {
        for unread in [open(&path).map(|_| ()), open_file(&path).map(|_| ()), text(&path).map(|_| ())] {
            assert!(matches!(unread, Err(ReadError::Kind(found)) if found == kind), "{}", path.display());
        }
        match (guard(&path), output) {
            (Ok(Destination::Device), None) => {}
            (Err(OutputError::Kind(found)), Some(expected)) => assert_eq!(found, expected),
            (found, _) => panic!("{}: {found:?}", path.display()),
        }
    }
    assert_eq!(open(&at("absent")).unwrap_err().to_string(), "there is no such file");
    let start = Instant::now();
    assert!(matches!(open_device(&at("pipe")), Err(OutputError::Unheard)));
    assert!(start.elapsed() < 3 * READER);
}

/// What a shell makes of `<(…)` and `>(…)`.
#[test]
fn a_pipe_that_the_process_was_given_is_read_and_written() {
    forget_inputs();
    let (reader, mut writer) = io::pipe().unwrap();
    let name = |fd: &dyn std::os::fd::AsRawFd| PathBuf::from(format!("/dev/fd/{}", fd.as_raw_fd()));
    let mut file = open(&name(&reader)).unwrap();
    assert!(matches!(open_file(&name(&reader)), Err(ReadError::Kind(_))));
    // Reading waits for what is written later.
    let late = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(50));
        io::Write::write_all(&mut writer, b"late").unwrap();
    });
    let mut found = String::new();
    file.read_to_string(&mut found).unwrap();
    late.join().unwrap();
    assert_eq!(found, "late");
    let (mut reader, writer) = io::pipe().unwrap();
    assert!(matches!(guard(&name(&writer)), Ok(Destination::Device)));
    io::Write::write_all(&mut open_device(&name(&writer)).unwrap(), b"out").unwrap();
    drop(writer);
    found.clear();
    reader.read_to_string(&mut found).unwrap();
    assert_eq!(found, "out");
}

#[test]
fn content_has_a_limit() {
    let (_folder, at) = folder();
    assert_eq!(read(&at("free.csv"), 4).unwrap(), b"1,2\n");
    let large = read(&at("free.csv"), 3).unwrap_err();
    assert!(matches!(large, ReadError::Large(3)) && large.to_string() == "it is larger than 3 bytes");
    // Of a file with a hole nothing but the limit is read.
    File::create(at("huge")).unwrap().set_len(1 << 40).unwrap();
    assert!(matches!(read(&at("huge"), 1 << 16), Err(ReadError::Large(_))));
    assert!(matches!(look(&at("huge")), Err(ReadError::Large(MAX_BYTES))) && look(&at("free.csv")).is_ok());
    fs::write(at("latin"), b"a\nb\xe9\n").unwrap();
    assert_eq!(text(&at("latin")).unwrap_err().to_string(), "it is not UTF-8 text: byte 3, in line 2");
}
