//! Output files of a run, checked before anything moves.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_setfl};

use crate::Failure;

/// Links to other links that are followed, as the system does.
const MOST_LINKS: usize = 40;

/// Checks that a record and a capture can be written to these files: they differ, are not write-protected, and do not
/// replace a device.
///
/// # Errors
/// If both name one file, which is a usage error; or if a file cannot be written, which is an error of the environment.
pub fn check(record: Option<&Path>, capture: Option<&Path>) -> Result<(), Failure> {
    let same = |a: &Metadata, b: &Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    let (recorded, captured) = (found(record), found(capture));
    let is_one = recorded.as_ref().zip(captured.as_ref()).is_some_and(|((_, a), (_, b))| same(a, b));
    if is_one || record.is_some() && record.map(whole) == capture.map(whole) {
        return Err(Failure::Usage("--record and --capture name one file; name two".to_owned()));
    }
    let refused = |path: &Path, why: &str| Err(Failure::Environment(format!("{}: {why}", path.display())));
    if let Some((path, _)) = captured.as_ref().filter(|(_, found)| !found.is_file()) {
        return refused(path, "a capture is written to a regular file; name one");
    }
    for (path, found) in [recorded, captured].into_iter().flatten() {
        let kind = found.file_type();
        if kind.is_dir() || kind.is_block_device() || kind.is_socket() {
            return refused(path, "it is no file that can be written; name a regular file");
        }
        if found.is_file() && found.mode() & 0o222 == 0 {
            return refused(path, "it is write-protected; name another file");
        }
    }
    Ok(())
}

/// A unique name of a file, existing or not: links to the file or its folder are resolved.
fn whole(path: &Path) -> PathBuf {
    let mut path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    for _ in 0..MOST_LINKS {
        let Ok(target) = std::fs::read_link(&path) else { break };
        path = path.parent().map_or(target.clone(), |folder| folder.join(&target));
    }
    let folder = path.parent().and_then(|folder| folder.canonicalize().ok());
    folder.zip(path.file_name()).map_or(path.clone(), |(folder, name)| folder.join(name))
}

fn found(path: Option<&Path>) -> Option<(&Path, Metadata)> {
    path.and_then(|path| Some((path, std::fs::metadata(path).ok()?)))
}

/// Creates or replaces a file. A pipe without a reader is an error, not a wait.
///
/// # Errors
/// What the system says.
pub fn create(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().write(true).create(true).truncate(true).custom_flags(flags).open(path)?;
    fcntl_setfl(&file, OFlags::empty())?;
    Ok(file)
}

/// Prints a result whole.
///
/// # Errors
/// As text, unless the reader has closed the output.
pub fn print(text: &str) -> Result<(), String> {
    put(&mut io::stdout(), text)
}

fn put(out: &mut impl Write, text: &str) -> Result<(), String> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("could not write to standard output: {error}"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// Accepts a number of bytes, then fails.
    struct Out(usize, io::ErrorKind);

    impl Write for Out {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.0);
            self.0 -= count;
            if count > 0 { Ok(count) } else { Err(self.1.into()) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_may_have_read_enough_but_a_disk_may_not_be_full() {
        let mut all = Vec::new();
        assert_eq!(put(&mut all, "text"), Ok(()));
        assert_eq!(all, b"text");
        assert_eq!(put(&mut Out(2, io::ErrorKind::BrokenPipe), "text"), Ok(()));
        assert!(put(&mut Out(2, io::ErrorKind::StorageFull), "text").unwrap_err().contains("standard output"));
    }

    #[test]
    fn outputs_that_would_lose_something_are_refused() {
        let folder = std::env::temp_dir().join(format!("rt-pc-outputs-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("sub")).unwrap();
        let at = |name: &str| folder.join(name);
        std::fs::write(at("a"), "").unwrap();
        for (target, name) in [("a", "link"), (".", "here"), ("sub/../new", "to-new")] {
            std::os::unix::fs::symlink(target, at(name)).unwrap();
        }
        // By the exit code: of the call, or of the environment.
        let refused = |record: &str, capture: &str| {
            let path = |name: &str| (!name.is_empty()).then(|| at(name));
            let checked = check(path(record).as_deref(), path(capture).as_deref());
            checked.map_or_else(Failure::code_and_text, |()| (0, String::new()))
        };
        for (record, capture, expected, words) in [
            ("a", "", 0, ""),
            ("a", "new", 0, ""),
            ("new", "sub/new", 0, ""),
            ("new", "here/newer", 0, ""),
            ("/dev/full", "a", 0, ""),
            ("a", "link", 2, "two"),
            ("new", "new", 2, "two"),
            ("new", "sub/../new", 2, "two"),
            ("here/new", "new", 2, "two"),
            ("to-new", "here/new", 2, "two"),
            ("", "/dev/null", 3, "regular file"),
            (".", "", 3, "regular file"),
        ] {
            let (code, text) = refused(record, capture);
            assert!(code == expected && text.contains(words) && text.is_empty() == words.is_empty(), "{text}");
        }
        std::fs::set_permissions(at("a"), std::fs::Permissions::from_mode(0o444)).unwrap();
        for (code, text) in [refused("a", ""), refused("", "a")] {
            assert!(code == 3 && text.contains("write-protected"), "{text}");
        }
        rustix::fs::mknodat(rustix::fs::CWD, at("pipe"), rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU, 0)
            .unwrap();
        assert!(create(&at("pipe")).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
