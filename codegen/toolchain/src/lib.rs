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

/// Set to `1`, it turns a missing tool from a failure into a skip that is said.
pub const ALLOW_MISSING: &str = "SPECGEN_ALLOW_MISSING";

/// [`available`] for tests: `None`, said on standard error, if something is missing and [`ALLOW_MISSING`] is `1`.
///
/// # Errors
/// As [`available`], without that excuse.
pub fn available_or_skip(what: &str) -> Result<Option<Tools>, TargetError> {
    match available() {
        Ok(tools) => Ok(Some(tools)),
        Err(error) if std::env::var_os(ALLOW_MISSING).is_some_and(|value| value == "1") => {
            eprintln!("skipped: {what}: {error}");
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
