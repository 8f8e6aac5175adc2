//! Cross toolchain, emulator and image analysis: from an emitted workspace to measured figures.
//!
//! ```text
//! DIR/qemu ─build_image→ Image ─image::footprint→ flash, RAM, forbidden symbols
//!                              ─stack::bound────→ static stack bound of `controller::step`
//!                              ─replay──────────→ outputs, state digests, instructions, painted stack
//! DIR/host ─host::build_library→ shared library
//! ```
//! [`toolchain`] is the one place that looks for a cross compiler, [`places`] says where tools may be, [`provision`] brings them.
//! Nothing here knows TOML, the IR or the control law; the words it moves are opaque.
//!
//! | module | what |
//! |---|---|
//! | [`checks`], [`size`], [`budget`] | rules of the tick in the image; bytes by owner; figures against budget and part |
//! | [`trace`], [`time`] | executed blocks, priced by `specgen-cycles`; the longest tick of a board against the period |
//! | [`targets`] | the list of targets |
//! | [`cache`] | builds by the digest of everything that determines their bytes, checked when used |

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

/// Rust's name of the compilation target of every [`Mcu`](specgen_language::model::Mcu) here.
pub const TRIPLE: &str = "thumbv7em-none-eabihf";

/// SHA-256 in hex.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What brings the tools that are missing.
pub const SET_UP: &str = "specgen SPEC --setup, or in the repository cargo xtask setup";

/// What is there to build for a microcontroller and to run the image.
#[derive(Debug, Clone)]
pub struct Tools {
    /// The cross compiler.
    pub toolchain: toolchain::Toolchain,
    /// The emulator.
    pub emulator: emulator::Emulator,
}

/// The cross compiler and the emulator, or what is missing and the command that installs it.
///
/// # Errors
/// [`TargetError::MissingTool`], for the first of the two that is not there.
pub fn available() -> Result<Tools, TargetError> {
    Ok(Tools { toolchain: toolchain::find()?, emulator: emulator::Emulator::find()? })
}

/// Set to `1`, a tool that a test misses is a failure, and not only a skip that is said: `cargo xtask test` brings them first.
pub const REQUIRE_TOOLS: &str = "SPECGEN_REQUIRE_TOOLS";

/// What a test needs, if it was found. Where it is missing, that is [`skipped`].
///
/// # Errors
/// What is missing, if [`REQUIRE_TOOLS`] is `1`.
pub fn found_or_skipped<T>(found: Result<T, TargetError>) -> Result<Option<T>, TargetError> {
    match found {
        Err(missing) if std::env::var_os(REQUIRE_TOOLS).is_none_or(|value| value != "1") => {
            skipped(&missing.to_string());
            Ok(None)
        }
        found => found.map(Some),
    }
}

/// Says, past what the test runner holds back, that the test of this thread was not run, or not wholly, and how many that is so far.
pub fn skipped(why: &str) {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed) + 1;
    let thread = std::thread::current();
    // Where nobody can read it, there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "skipped {count}: {}: {why}", thread.name().unwrap_or("a test"));
}
