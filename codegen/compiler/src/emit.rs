//! IR to the text of the `controller` crate.
//!
//! One emitter per emitted file. Emitters cannot fail and do no arithmetic: errors are found in lowering.
//!
//! The law itself is the crate `specgen-law`, which the workspace contains. Constants, tables and types are emitted. `legs` and
//! `platform` are the parts that differ between six legs with their own gauges and a platform in task space.

mod body;
mod checked;
mod crate_root;
mod defaults;
mod format;
mod gauge_converter;
mod geometry;
mod hysteresis;
mod identity;
mod legs;
mod limits;
mod literal;
mod manifest;
mod permitted;
mod platform;
mod setpoint;
mod supervision;

use std::collections::BTreeMap;

use proc_macro2::TokenStream;

use crate::ir::{Ir, TaskSpace};

pub use crate_root::calling;

/// Files of the emitted crate: path relative to the crate, text.
pub type EmittedCrate = BTreeMap<String, String>;

/// Emits the controller crate.
pub fn emit(ir: &Ir) -> EmittedCrate {
    let mut sources = vec![
        ("src/checked.rs", checked::emit(ir)),
        ("src/defaults.rs", defaults::emit(ir)),
        ("src/geometry.rs", geometry::emit(ir)),
        ("src/hysteresis.rs", hysteresis::emit(ir)),
        ("src/identity.rs", identity::emit(ir)),
        ("src/limits.rs", limits::emit(ir)),
        ("src/permitted.rs", permitted::emit(ir)),
        ("src/supervision.rs", supervision::emit(ir)),
    ];
    match &ir.task_space {
        None => sources.push(("src/gauges.rs", legs::gauges::emit(ir))),
        Some(task) => sources.extend(of_platform(ir, task)),
    }
    let header = format::header(ir);
    let mut files: EmittedCrate =
        sources.into_iter().map(|(path, tokens)| (path.to_owned(), format::source(&header, tokens))).collect();
    let root = crate_root::emit(ir, &header, files.keys().map(String::as_str));
    files.insert("src/lib.rs".to_owned(), root);
    files.insert("Cargo.toml".to_owned(), manifest::emit(ir));
    files
}

fn of_platform(ir: &Ir, task: &TaskSpace) -> [(&'static str, TokenStream); 4] {
    [
        ("src/body.rs", body::emit(ir)),
        ("src/gauges.rs", platform::gauges::emit(ir, &task.sensing)),
        ("src/setpoint.rs", setpoint::emit(ir, &task.setpoints)),
        ("src/task_space.rs", platform::task_space::emit(ir, task)),
    ]
}
