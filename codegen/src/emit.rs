//! IR to the text of the `controller` crate.
//!
//! One emitter per emitted file. Emitters are infallible and do no arithmetic: whatever can fail failed in lowering.

mod config;
mod crate_root;
mod dynamics;
mod format;
mod hysteresis;
mod kinematics;
mod limits;
mod literal;
mod manifest;
mod state;
mod step;
mod words;

use std::collections::BTreeMap;

use crate::ir::Ir;

/// Files of the emitted crate: path relative to the crate, text.
pub type EmittedCrate = BTreeMap<String, String>;

/// Emits the controller crate.
#[must_use]
pub fn emit(ir: &Ir) -> EmittedCrate {
    let sources = [
        ("src/config.rs", config::emit(ir)),
        ("src/dynamics.rs", dynamics::emit(ir)),
        ("src/hysteresis.rs", hysteresis::emit(ir)),
        ("src/kinematics.rs", kinematics::emit(ir)),
        ("src/lib.rs", crate_root::emit(ir)),
        ("src/limits.rs", limits::emit(ir)),
        ("src/state.rs", state::emit(ir)),
        ("src/step.rs", step::emit(ir)),
        ("src/words.rs", words::emit(ir)),
    ];
    let header = format::header(ir);
    let mut files: EmittedCrate =
        sources.into_iter().map(|(path, tokens)| (path.to_owned(), format::source(&header, tokens))).collect();
    files.insert("Cargo.toml".to_owned(), manifest::emit(ir));
    files
}
