//! Runs cargo and other programs step by step, and says how each step ended. The developer commands that compute with the product
//! itself are the program `maintain` of `tests`: this crate compiles in seconds, so that one call of cargo builds all the rest.

use std::path::{Path, PathBuf};

pub mod run;
pub mod setup;

/// The repository: this crate stands directly below it.
#[must_use]
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}
