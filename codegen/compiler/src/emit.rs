//! IR to the text of the `controller` crate.
//!
//! One emitter per emitted file. Emitters are infallible and do no arithmetic: whatever can fail failed in lowering.

//!
//! Files that every controller has are emitted here; what differs between six legs with their own gauges and a platform in
//! task space lies in `legs` and `platform`.

mod config;
mod description;
mod dynamics;
mod format;
mod gauge_converter;
mod hysteresis;
mod identity;
mod integrity;
mod kinematics;
mod legs;
mod limits;
mod literal;
mod machine_words;
mod manifest;
mod permitted;
mod platform;
mod rest;
mod sensing;
mod setpoint;
mod snapshot;
mod stage_type;
mod supervised;
mod supervision;
mod waves;

use std::collections::BTreeMap;

use proc_macro2::TokenStream;

use crate::ir::{Ir, TaskSpace};

/// Files of the emitted crate: path relative to the crate, text.
pub type EmittedCrate = BTreeMap<String, String>;

/// Emits the controller crate.
#[must_use]
pub fn emit(ir: &Ir) -> EmittedCrate {
    let mut sources = vec![
        ("src/dynamics.rs", dynamics::emit(ir)),
        ("src/hysteresis.rs", hysteresis::emit(ir)),
        ("src/integrity.rs", integrity::emit(ir)),
        ("src/kinematics.rs", kinematics::emit(ir)),
        ("src/limits.rs", limits::emit(ir)),
        ("src/permitted.rs", permitted::emit(ir)),
        ("src/supervision.rs", supervision::emit(ir)),
        ("src/waves.rs", waves::emit(ir)),
    ];
    match &ir.task_space {
        None => sources.extend(legs_sources(ir)),
        Some(task) => sources.extend(platform_sources(ir, task)),
    }
    let header = format::header(ir);
    let mut files: EmittedCrate =
        sources.into_iter().map(|(path, tokens)| (path.to_owned(), format::source(&header, tokens))).collect();
    files.insert("Cargo.toml".to_owned(), manifest::emit(ir));
    files
}

fn legs_sources(ir: &Ir) -> Vec<(&'static str, TokenStream)> {
    vec![
        ("src/config.rs", legs::config::emit(ir)),
        ("src/lib.rs", legs::crate_root::emit(ir)),
        ("src/machine_words.rs", machine_words::emit(&legs::words::inputs(), &legs::words::outputs())),
        ("src/sensing.rs", legs::sensing::emit(ir)),
        ("src/snapshot.rs", legs::snapshot::emit(ir)),
        ("src/stages.rs", legs::stages::emit()),
        ("src/state.rs", legs::state::emit(ir)),
        ("src/step.rs", legs::step::emit(ir)),
        ("src/supervised.rs", legs::supervised::emit(ir)),
        ("src/words.rs", legs::words::emit(ir)),
    ]
}

fn platform_sources(ir: &Ir, task: &TaskSpace) -> Vec<(&'static str, TokenStream)> {
    vec![
        ("src/config.rs", platform::config::emit(ir, &task.defaults)),
        ("src/lib.rs", platform::crate_root::emit(ir)),
        ("src/machine_words.rs", machine_words::emit(&platform::words::inputs(), &platform::words::outputs())),
        ("src/sensing.rs", sensing::emit(ir, &task.sensing)),
        ("src/setpoint.rs", setpoint::emit(ir, &task.setpoints)),
        ("src/snapshot.rs", platform::snapshot::emit()),
        ("src/stages.rs", platform::stages::emit()),
        ("src/state.rs", platform::state::emit(ir)),
        ("src/step.rs", platform::step::emit(ir)),
        ("src/supervised.rs", platform::supervised::emit()),
        ("src/task_space.rs", platform::task_space::emit(ir, task)),
        ("src/words.rs", platform::words::emit(ir, task)),
    ]
}
