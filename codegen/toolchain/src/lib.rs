//! Cross toolchain, emulator and image analysis: from an emitted workspace to measured figures.
//!
//! ```text
//! DIR/qemu ─build_image→ Image ─image::footprint→ flash, RAM, forbidden symbols
//!                              ─stack::bound────→ static stack bound of `controller::step`
//!                              ─replay──────────→ outputs, state digests, instructions, painted stack
//! DIR/host ─host::build_library→ shared library
//! ```
//! Only [`toolchain`] looks for a cross compiler, [`places`] lists where tools may be, [`provision`] installs them.
//! This crate knows nothing of TOML, the IR or the control law; it treats their words as opaque.
//!
//! | module | purpose |
//! |---|---|
//! | [`checks`], [`size`], [`budget`] | rules for the tick; bytes by owner; figures against budget and part |
//! | [`trace`], [`time`] | executed blocks and their cost by `specgen-cycles`; the longest tick of a board against the period |
//! | [`targets`] | the list of build targets |
//! | [`cache`] | build cache, keyed by everything that determines the bytes and verified on use |

use std::io::Write as _;
use std::sync::atomic::{AtomicU32, Ordering};

use sha2::{Digest as _, Sha256};

mod apt;
pub mod budget;
pub mod build;
pub mod cache;
pub mod callgraph;
pub mod checks;
pub mod emulator;
pub mod engine;
pub mod error;
pub mod host;
pub mod image;
mod owner;
mod panics;
pub mod places;
mod process;
pub mod provision;
pub mod replay;
pub mod size;
pub mod stack;
pub mod targets;
mod thumb;
pub mod time;
pub mod toolchain;
pub mod trace;
pub mod unpacked;
pub mod user_cache;

pub use build::{Image, build_image, build_pil};
pub use error::TargetError;
pub use process::find_in_path as find_program;
pub use replay::{ReplayResult, replay, replay_machine};
pub use size::{ASSUMED_MARK, ASSUMED_SEPARATOR, IDENTITY_MARK};

/// Rust target triple of every [`Mcu`](specgen_language::model::Mcu).
pub const TRIPLE: &str = "thumbv7em-none-eabihf";

/// SHA-256 in hex.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The command that installs missing tools.
pub const SET_UP: &str = "specgen SPEC --setup, or in the repository cargo xtask setup";

/// Tools to build for a microcontroller and to run the image.
#[derive(Debug, Clone)]
pub struct Tools {
    /// The cross compiler.
    pub toolchain: toolchain::Toolchain,
    /// The emulator.
    pub emulator: emulator::Emulator,
}

/// The cross compiler and the emulator.
///
/// # Errors
/// [`TargetError::MissingTool`] for the first of the two that is missing.
pub fn available() -> Result<Tools, TargetError> {
    Ok(Tools { toolchain: toolchain::find()?, emulator: emulator::Emulator::find()? })
}

/// If this variable is `1`, a test fails instead of being skipped when a tool is missing. `cargo xtask test` installs them first.
pub const REQUIRE_TOOLS: &str = "SPECGEN_REQUIRE_TOOLS";

/// The tool that a test needs. If it is missing, the test is reported as [`skipped`].
///
/// # Errors
/// The missing tool, if [`REQUIRE_TOOLS`] is `1`.
pub fn found_or_skipped<T>(found: Result<T, TargetError>) -> Result<Option<T>, TargetError> {
    match found {
        Err(missing) if std::env::var_os(REQUIRE_TOOLS).is_none_or(|value| value != "1") => {
            skipped(&missing.to_string());
            Ok(None)
        }
        found => found.map(Some),
    }
}

/// Reports, bypassing the test runner's capture, that the current test was skipped in whole or in part, with a running count.
pub fn skipped(why: &str) {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed) + 1;
    let thread = std::thread::current();
    // If stderr is closed, there is nobody to report to.
    let _ = writeln!(std::io::stderr(), "skipped {count}: {}: {why}", thread.name().unwrap_or("a test"));
}
