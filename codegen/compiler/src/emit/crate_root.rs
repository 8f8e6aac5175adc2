//! `src/lib.rs`: documentation of the crate, its modules, and what the law adds for targets.

use crate::ir::Ir;

/// Modules that a user of the crate sees. The law's `controller!` adds those that are no constants.
const PUBLIC: [&str; 7] = ["body", "hysteresis", "limits", "permitted", "setpoint", "supervision", "task_space"];

/// Its documentation, of a platform and of six legs.
const PLATFORM_PAGE: &str = include_str!("pages/platform.md");
const LEGS_PAGE: &str = include_str!("pages/legs.md");

/// The text for a crate of these files, `src/NAME.rs` each.
pub fn emit<'a>(ir: &Ir, header: &str, files: impl Iterator<Item = &'a str>) -> String {
    let (law, page) = if ir.task_space.is_some() { ("platform", PLATFORM_PAGE) } else { ("legs", LEGS_PAGE) };
    let title = format!("Controller of platform `{}`.", ir.name);
    let mut text = header.to_owned();
    for line in [title.as_str(), ""].into_iter().chain(page.lines()) {
        text += format!("//! {line}").trim_end();
        text.push('\n');
    }
    text += "#![no_std]\n#![forbid(unsafe_code)]\n#![deny(missing_docs)]\n\n";
    for module in files.filter_map(|path| path.strip_prefix("src/")?.strip_suffix(".rs")) {
        text += if PUBLIC.contains(&module) { "pub mod " } else { "mod " };
        text += module;
        text += ";\n";
    }
    text + "\nspecgen_law::controller!(" + law + ");\n"
}
