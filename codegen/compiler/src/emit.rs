//! IR to the text of the `controller` crate.
//!
//! One emitter per emitted file. Emitters are infallible and do no arithmetic: whatever can fail failed in lowering.
//!
//! The law itself is carried over as it stands (`law`); emitted are constants, tables, types and words. What differs between six legs
//! with their own gauges and a platform in task space lies in `legs` and `platform`.

mod defaults;
mod description;
mod dynamics;
mod format;
mod gauge_converter;
mod hysteresis;
mod identity;
mod integrity;
mod kinematics;
mod law;
mod legs;
mod limits;
mod literal;
mod manifest;
mod permitted;
mod platform;
mod sensing;
mod setpoint;
mod supervision;

use std::collections::BTreeMap;

use proc_macro2::TokenStream;

use crate::ir::{Ir, TaskSpace};

/// Files of the emitted crate: path relative to the crate, text.
pub type EmittedCrate = BTreeMap<String, String>;

/// Emits the controller crate.
#[must_use]
pub fn emit(ir: &Ir) -> EmittedCrate {
    let mut sources = vec![
        ("src/defaults.rs", defaults::emit(ir)),
        ("src/description.rs", description::emit(ir)),
        ("src/dynamics.rs", dynamics::emit(ir)),
        ("src/hysteresis.rs", hysteresis::emit(ir)),
        ("src/integrity.rs", integrity::emit(ir)),
        ("src/kinematics.rs", kinematics::emit(ir)),
        ("src/limits.rs", limits::emit(ir)),
        ("src/permitted.rs", permitted::emit(ir)),
        ("src/supervision.rs", supervision::emit(ir)),
    ];
    let law = match &ir.task_space {
        None => {
            sources.extend(legs_sources(ir));
            law::LEGS
        }
        Some(task) => {
            sources.extend(platform_sources(ir, task));
            law::PLATFORM
        }
    };
    let header = format::header(ir);
    let mut files: EmittedCrate =
        sources.into_iter().map(|(path, tokens)| (path.to_owned(), format::source(&header, tokens))).collect();
    files.extend(law.iter().map(|(path, text)| ((*path).to_owned(), law::carried_over(ir, text))));
    files.insert("Cargo.toml".to_owned(), manifest::emit(ir));
    files
}

/// Whether a file of the emitted crate is the same for every spec of a kind.
#[must_use]
pub fn is_carried_over(path: &str) -> bool {
    [law::LEGS, law::PLATFORM].into_iter().flatten().any(|(law, _)| *law == path)
}

fn legs_sources(ir: &Ir) -> Vec<(&'static str, TokenStream)> {
    vec![("src/lib.rs", legs::crate_root::emit(ir)), ("src/sensing.rs", legs::sensing::emit(ir))]
}

fn platform_sources(ir: &Ir, task: &TaskSpace) -> Vec<(&'static str, TokenStream)> {
    vec![
        ("src/lib.rs", platform::crate_root::emit(ir)),
        ("src/sensing.rs", sensing::emit(ir, &task.sensing)),
        ("src/setpoint.rs", setpoint::emit(ir, &task.setpoints)),
        ("src/task_space.rs", platform::task_space::emit(ir, task)),
    ]
}
