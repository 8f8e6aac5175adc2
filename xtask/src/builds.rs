//! Counts the controllers that the tests built or took from the build cache. Each takes seconds if the cache is cold.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::time::SystemTime;

/// Largest number of host libraries in the short test run.
pub const MOST: usize = 10;
/// Bytes of a cache entry with its digest and the path of the build, see `specgen_toolchain::cache`.
const HEAD: u64 = 512;

/// Number of requested builds, each counted once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Builds {
    /// Controllers as libraries for this computer.
    pub libraries: usize,
    /// Images of microcontrollers, and programs of a real-time PC.
    pub images: usize,
}

impl Builds {
    /// Builds in a cache folder that were made or used since `begun`: both set the time of the entry.
    pub fn since(folder: &Path, begun: SystemTime) -> Self {
        let mut builds = Self::default();
        for entry in fs::read_dir(folder).into_iter().flatten().map_while(Result::ok) {
            let path = entry.path();
            let used = entry.metadata().and_then(|metadata| metadata.modified());
            if path.extension().is_some() || used.is_ok_and(|used| used < begun) {
                continue;
            }
            let mut head = Vec::new();
            let read = File::open(&path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
            let place = head.split(|byte| *byte == b'\n').nth(1).unwrap_or_default();
            let library = std::env::consts::DLL_EXTENSION;
            match read {
                Err(_) => {}
                Ok(_) if Path::new(&*String::from_utf8_lossy(place)).extension() == Some(OsStr::new(library)) => {
                    builds.libraries += 1;
                }
                Ok(_) => builds.images += 1,
            }
        }
        builds
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn libraries_and_images_that_were_used_are_counted_and_locks_and_old_entries_are_not() {
        let kept = tempfile::tempdir().unwrap();
        let folder = kept.path();
        let library = format!("release/libcontroller{}", std::env::consts::DLL_SUFFIX);
        let (begun, old) = (SystemTime::now(), Duration::from_secs(3600));
        for (name, place, age) in [
            ("a", library.as_str(), Duration::ZERO),
            ("b", "thumbv7em-none-eabihf/release/replay", Duration::ZERO),
            ("c", library.as_str(), old),
            ("d.lock", library.as_str(), Duration::ZERO),
        ] {
            let path = folder.join(name);
            fs::write(&path, format!("{}\n{place}\nbytes\n", "0".repeat(64))).unwrap();
            File::options().write(true).open(&path).unwrap().set_modified(begun - age).unwrap();
        }
        assert_eq!(Builds::since(folder, begun), Builds { libraries: 1, images: 1 });
        assert_eq!(Builds::since(&folder.join("none"), begun), Builds::default());
    }
}
