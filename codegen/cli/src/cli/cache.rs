//! `specgen cache`: what is kept of earlier builds.

use clap::Args;
use serde_json::json;

use super::ui::{Failure, Ui};
use specgen_toolchain::budget::group;
use specgen_toolchain::cache::{Cache, LIMIT};
use specgen_toolchain::user_cache::VARIABLE;

/// Arguments of `cache`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::CACHE)]
pub struct Arguments {
    /// Remove every build that is kept.
    #[arg(long)]
    clear: bool,
}

pub fn run(arguments: &Arguments, ui: &Ui) -> Result<(), Failure> {
    let Some(cache) = Cache::of_user() else {
        let text = format!("no builds are kept: {VARIABLE} is set and empty, or there is no home folder\n");
        ui.result(&text, json!({ "folder": null, "builds": 0, "bytes": 0, "limit": LIMIT, "removed": 0 }));
        return Ok(());
    };
    let removed = if arguments.clear { Some(cache.clear()?) } else { None };
    let extent = cache.extent()?;
    let shown = cache.folder().display();
    let builds = |count: usize| format!("{count} build{}", if count == 1 { "" } else { "s" });
    let text = match removed {
        Some(removed) => format!("removed {}, {} bytes, from {shown}\n", builds(removed.builds), group(removed.bytes)),
        None => format!(
            "{shown}: {}, {} of at most {} bytes; what was used longest ago goes first\n",
            builds(extent.builds),
            group(extent.bytes),
            group(LIMIT)
        ),
    };
    let removed = removed.map_or(0, |removed| removed.builds);
    let result = json!({
        "folder": shown.to_string(), "builds": extent.builds, "bytes": extent.bytes, "limit": LIMIT, "removed": removed,
    });
    ui.result(&text, result);
    Ok(())
}
