//! `specgen cache`: the cache of earlier builds.

use clap::Args;
use serde::Serialize;

use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_toolchain::budget::group;
use specgen_toolchain::cache::{Cache, LIMIT};
use specgen_toolchain::user_cache::VARIABLE;

/// Arguments of `cache`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::CACHE)]
pub struct Arguments {
    /// Remove all cached builds.
    #[arg(long)]
    clear: bool,
}

#[derive(Serialize)]
struct CacheSize {
    /// None if the cache is off.
    folder: Option<String>,
    builds: usize,
    bytes: u64,
    limit: u64,
    removed: usize,
    /// Bytes removed, if removal was requested.
    #[serde(skip)]
    cleared: Option<u64>,
}

impl Outcome for CacheSize {
    fn text(&self) -> String {
        let builds = |count: usize| format!("{count} build{}", if count == 1 { "" } else { "s" });
        match (&self.folder, self.cleared) {
            (None, _) => format!("no builds are kept: {VARIABLE} is set and empty, or there is no home folder\n"),
            (Some(folder), Some(bytes)) => {
                format!("removed {}, {} bytes, from {folder}\n", builds(self.removed), group(bytes))
            }
            (Some(folder), None) => {
                let (kept, size, limit) = (builds(self.builds), group(self.bytes), group(self.limit));
                format!(
                    "{folder}: {kept}, {size} of at most {limit} bytes; least recently used builds are removed first\n"
                )
            }
        }
    }
}

pub fn run(arguments: &Arguments, ui: &Ui) -> Result<(), Failure> {
    let mut kept = CacheSize { folder: None, builds: 0, bytes: 0, limit: LIMIT, removed: 0, cleared: None };
    if let Some(cache) = Cache::of_user() {
        let removed = if arguments.clear { Some(cache.clear()?) } else { None };
        let extent = cache.extent()?;
        kept = CacheSize {
            folder: Some(cache.folder().display().to_string()),
            builds: extent.builds,
            bytes: extent.bytes,
            removed: removed.as_ref().map_or(0, |removed| removed.builds),
            cleared: removed.map(|removed| removed.bytes),
            ..kept
        };
    }
    ui.result(&kept);
    Ok(())
}
