//! Runs the command as an unprivileged user, because permissions do not apply to root.

use std::fs;
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{BINARY, Folder, Run, skipped};

/// User and group of "nobody" on Linux.
const NOBODY: u32 = 65534;

/// How to run as a user without privileges.
pub struct Unprivileged {
    binary: PathBuf,
    switch: bool,
}

impl Unprivileged {
    /// None, with a message, if we are root and cannot change the user. The user gets ownership of `folder`.
    pub fn owning(folder: &Folder) -> Option<Self> {
        // Tests the file system instead of the user id, because of capabilities.
        let probe = folder.path("probe");
        fs::create_dir(&probe).unwrap();
        set_mode(&probe, 0o555);
        let privileged = fs::write(probe.join("file"), "").is_ok();
        fs::remove_dir_all(&probe).unwrap();
        if !privileged {
            return Some(Self { binary: BINARY.into(), switch: false });
        }
        // The build folder may not be accessible to others.
        let binary = folder.path("specgen");
        fs::copy(BINARY, &binary).unwrap();
        hand_over(&folder.path(""));
        let this = Self { binary, switch: true };
        let works = this.command(folder).arg("--version").output().is_ok_and(|output| output.status.success());
        if !works {
            skipped("root may write everywhere, and setpriv cannot switch to another user");
        }
        works.then_some(this)
    }

    pub fn command(&self, folder: &Folder) -> Command {
        let mut command = if self.switch {
            let mut command = Command::new("setpriv");
            let user = format!("--reuid={NOBODY}");
            let group = format!("--regid={NOBODY}");
            command.args([user, group]).args(["--clear-groups", "--bounding-set=-all", "--inh-caps=-all", "--"]);
            command.arg(&self.binary);
            command
        } else {
            Command::new(&self.binary)
        };
        command.current_dir(folder.path(""));
        command
    }

    pub fn run(&self, folder: &Folder, arguments: &[&str]) -> Run {
        Run::of(self.command(folder).args(arguments))
    }
}

fn hand_over(path: &Path) {
    chown(path, Some(NOBODY), Some(NOBODY)).unwrap();
    if path.is_dir() {
        for entry in fs::read_dir(path).unwrap() {
            hand_over(&entry.unwrap().path());
        }
    }
}

pub fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}
