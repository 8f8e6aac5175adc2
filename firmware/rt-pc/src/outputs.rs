//! Files that a run writes, looked at before anything moves.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{OFlags, fcntl_setfl};

/// Whether a record and a capture can be written to these files: they are two, nobody has protected them, and what replaces a
/// file replaces no device.
///
/// # Errors
/// In words.
pub fn check(record: Option<&Path>, capture: Option<&Path>) -> Result<(), String> {
    let same = |a: &Metadata, b: &Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    let (recorded, captured) = (found(record), found(capture));
    let is_one = recorded.as_ref().zip(captured.as_ref()).is_some_and(|((_, a), (_, b))| same(a, b));
    if is_one || record.is_some() && record == capture {
        return Err("--record and --capture name one file; name two".to_owned());
    }
    if let Some((path, _)) = captured.as_ref().filter(|(_, found)| !found.is_file()) {
        return Err(format!("{}: a capture is written to a regular file; name one", path.display()));
    }
    for (path, found) in [recorded, captured].into_iter().flatten() {
        let kind = found.file_type();
        if kind.is_dir() || kind.is_block_device() || kind.is_socket() {
            return Err(format!("{}: it is no file that can be written; name a regular file", path.display()));
        }
        if found.is_file() && found.mode() & 0o222 == 0 {
            return Err(format!("{}: it is write-protected; name another file", path.display()));
        }
    }
    Ok(())
}

fn found(path: Option<&Path>) -> Option<(&Path, Metadata)> {
    path.and_then(|path| Some((path, std::fs::metadata(path).ok()?)))
}

/// A new file, or one that is replaced. A pipe that nobody reads is an error, not a wait.
///
/// # Errors
/// What the system says.
pub fn create(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits().cast_signed();
    let file = OpenOptions::new().write(true).create(true).truncate(true).custom_flags(flags).open(path)?;
    fcntl_setfl(&file, OFlags::empty())?;
    Ok(file)
}

/// Prints a result whole.
///
/// # Errors
/// In words, unless the reader has read enough.
pub fn print(text: &str) -> Result<(), String> {
    let mut out = io::stdout();
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

    #[test]
    fn outputs_that_would_lose_something_are_refused() {
        let folder = std::env::temp_dir().join(format!("rt-pc-outputs-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let at = |name: &str| folder.join(name);
        std::fs::write(at("a"), "").unwrap();
        std::os::unix::fs::symlink("a", at("link")).unwrap();
        let refused = |record: &str, capture: &str| {
            let path = |name: &str| (!name.is_empty()).then(|| at(name));
            check(path(record).as_deref(), path(capture).as_deref()).err().unwrap_or_default()
        };
        for (record, capture, words) in [
            ("a", "", ""),
            ("a", "new", ""),
            ("/dev/full", "a", ""),
            ("a", "link", "two"),
            ("new", "new", "two"),
            ("", "/dev/null", "regular file"),
            (".", "", "regular file"),
        ] {
            assert!(
                refused(record, capture).contains(words) && refused(record, capture).is_empty() == words.is_empty()
            );
        }
        std::fs::set_permissions(at("a"), std::fs::Permissions::from_mode(0o444)).unwrap();
        assert!(refused("a", "").contains("write-protected") && refused("", "a").contains("write-protected"));
        rustix::fs::mknodat(rustix::fs::CWD, at("pipe"), rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU, 0)
            .unwrap();
        assert!(create(&at("pipe")).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
