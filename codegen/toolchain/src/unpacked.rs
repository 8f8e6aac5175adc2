//! Packages of the distribution, unpacked with their libraries into the user's cache and run from there.
//!
//! This needs no privileges, and installs and removes nothing: apt uses a private state in which no package is installed,
//! so nothing conflicts. A folder is put in place by one rename, so it is complete or absent. The search for a program
//! checks whether it runs on this machine.

use super::apt::{Apt, Refusal};
use super::places::Places;
use super::process;
use specgen_language::interrupt::Scratch;
use std::fs::{self, File};
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Not unpacked: the loader of this machine works only with its own C library.
const OF_THE_SYSTEM: [&str; 2] = ["libc6_", "libc-bin_"];
/// Documentation, which no program here reads.
const UNUSED: [&str; 4] = ["usr/share/doc", "usr/share/man", "usr/share/info", "usr/share/locale"];
/// Time limit for one package.
const LIMIT: Duration = Duration::from_secs(300);

/// Downloads packages with all their dependencies and unpacks them as `name`, replacing an older folder of this name.
/// Does nothing if `works` is true once the lock is held: another process has done it meanwhile.
///
/// # Errors
/// Why it failed.
pub(super) fn fetch(
    name: &str,
    packages: &[&str],
    places: &Places,
    works: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<(), Refusal> {
    let folder = places
        .cache()
        .ok_or_else(|| Refusal::other("no cache folder (neither XDG_CACHE_HOME nor a home folder is set)"))?;
    let [apt, dpkg] = ["apt-get", "dpkg-deb"].map(|program| places.program(program));
    let apt = apt.ok_or_else(|| Refusal::other("apt-get was not found"))?;
    let dpkg = dpkg.ok_or_else(|| Refusal::other("dpkg-deb was not found"))?;
    let failed = |error: io::Error| Refusal::other(format!("{}: {error}", folder.display()));

    fs::create_dir_all(folder).map_err(failed)?;
    let lock = File::create(folder.join("lock")).map_err(failed)?;
    lock.lock().map_err(failed)?;
    if works() {
        return Ok(());
    }
    remove_stale(folder);
    let scratch = Scratch::below(folder).map_err(failed)?;
    say(&format!("downloading {} with its libraries into {}", packages.join(" "), folder.display()));
    let archives = Apt::of_its_own(&apt, scratch.path()).map_err(failed)?.download(packages)?;
    say(&format!("unpacking {} packages", archives.len()));
    let root = scratch.path().join("root");
    fs::create_dir(&root).map_err(failed)?;
    for archive in archives.iter().filter(|archive| !is_of_the_system(archive)) {
        let mut command = Command::new(&dpkg);
        command.arg("-x").arg(archive).arg(&root);
        let done = process::run(&mut command, scratch.path(), LIMIT).map_err(failed)?;
        if !done.success() {
            return Err(Refusal::other(format!("{} cannot be unpacked: {}", archive.display(), done.stderr.trim())));
        }
    }
    for path in UNUSED {
        // Only saves space.
        let _ = fs::remove_dir_all(root.join(path));
    }
    let place = folder.join(name);
    if place.exists() {
        // A folder cannot be renamed onto a non-empty one. The old tool does not work, so losing it is harmless.
        fs::rename(&place, scratch.path().join("old")).map_err(failed)?;
    }
    fs::rename(&root, &place).map_err(failed)
}

fn is_of_the_system(archive: &Path) -> bool {
    let name = archive.file_name().unwrap_or_default().to_string_lossy();
    OF_THE_SYSTEM.iter().any(|start| name.starts_with(start))
}

/// Removes what a killed process left behind; safe while the lock is held.
fn remove_stale(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(".tmp") {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}
