//! Runs cargo and other programs in steps, and reports the result of each. Developer commands that use the product itself are in
//! the program `maintain` of `tests`. This crate compiles in seconds, so that one call of cargo then builds everything else.

use std::path::{Path, PathBuf};

pub mod run;
pub mod setup;

/// The repository, the parent folder of this crate.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}
