//! `src/lib.rs`: documentation of the crate, which stands beside the law, and its modules: every emitted file and every file of the law.

use crate::ir::Ir;

/// Modules that a user of the crate sees; what stands at its root is in the law's `api.rs`.
const PUBLIC: [&str; 16] = [
    "dynamics",
    "hysteresis",
    "integrity",
    "kinematics",
    "limits",
    "passes",
    "permitted",
    "sensing",
    "setpoint",
    "snapshot",
    "stages",
    "supervised",
    "supervision",
    "task_space",
    "triggers",
    "waves",
];

/// Modules for measuring alone, which only the image that measures asks for.
const MEASURED: [&str; 2] = ["stage", "stages"];

/// The text for a crate of these files, `src/NAME.rs` each.
pub fn emit<'a>(ir: &Ir, header: &str, documentation: &str, files: impl Iterator<Item = &'a str>) -> String {
    let title = format!("Controller of platform `{}`.", ir.name);
    let mut text = header.to_owned();
    for line in [title.as_str(), ""].into_iter().chain(documentation.lines()) {
        text += format!("//! {line}").trim_end();
        text.push('\n');
    }
    text += "#![no_std]\n#![forbid(unsafe_code)]\n#![deny(missing_docs)]\n\n";
    for module in files.filter_map(|path| path.strip_prefix("src/")?.strip_suffix(".rs")) {
        if MEASURED.contains(&module) {
            text += "#[cfg(feature = \"stages\")]\n";
        }
        text += if PUBLIC.contains(&module) { "pub mod " } else { "mod " };
        text += module;
        text += ";\n";
    }
    text + "\npub use api::*;\n"
}
