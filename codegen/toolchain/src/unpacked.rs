//! Packages of the distribution, unpacked with their libraries into a folder of the user's cache and run from there.
//!
//! No rights are needed, nothing is installed and nothing removed: apt works with a state of its own, in which no package is
//! installed, so that none conflicts. A folder is put in place by one rename and is whole or not there; whether what is in it
//! runs on this machine is asked by whoever looks for a program.

use super::apt::{Apt, Refusal};
use super::places::Places;
use super::process;
use specgen_language::interrupt::Scratch;
use std::fs::{self, File};
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Not unpacked: the loader of this machine fits its own C library only.
const OF_THE_SYSTEM: [&str; 2] = ["libc6_", "libc-bin_"];
/// Texts for people, which no program here reads.
const UNUSED: [&str; 4] = ["usr/share/doc", "usr/share/man", "usr/share/info", "usr/share/locale"];
/// Longest time for one package, s.
const LIMIT: Duration = Duration::from_secs(300);

/// Downloads packages with all that they depend on and unpacks them as `name`; what was there under this name goes.
/// If `works` says so once it is this process' turn, another has done it meanwhile.
///
/// # Errors
/// Why not, in words.
pub(super) fn fetch(
    name: &str,
    packages: &[&str],
    places: &Places,
    works: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<(), Refusal> {
    let folder = places
        .cache()
        .ok_or_else(|| Refusal::other("there is no cache folder to unpack into (neither XDG_CACHE_HOME nor a home)"))?;
    let [apt, dpkg] = ["apt-get", "dpkg-deb"].map(|program| places.program(program));
    let apt = apt.ok_or_else(|| Refusal::other("there is no apt-get"))?;
    let dpkg = dpkg.ok_or_else(|| Refusal::other("there is no dpkg-deb"))?;
    let failed = |error: io::Error| Refusal::other(format!("{}: {error}", folder.display()));

    fs::create_dir_all(folder).map_err(failed)?;
    let lock = File::create(folder.join("lock")).map_err(failed)?;
    // Dropping the file frees it.
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
        // Only to save room.
        let _ = fs::remove_dir_all(root.join(path));
    }
    let place = folder.join(name);
    if place.exists() {
        // A folder cannot be renamed onto one that is not empty. What does not run is no loss.
        fs::rename(&place, scratch.path().join("old")).map_err(failed)?;
    }
    fs::rename(&root, &place).map_err(failed)
}

fn is_of_the_system(archive: &Path) -> bool {
    let name = archive.file_name().unwrap_or_default().to_string_lossy();
    OF_THE_SYSTEM.iter().any(|start| name.starts_with(start))
}

/// What a process that was killed has left; nobody else is at work while the lock is held.
fn remove_stale(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(".tmp") {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}
