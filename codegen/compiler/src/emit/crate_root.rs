//! `src/lib.rs`: documentation of the crate, its modules, and the call of the law's `controller!`.

use crate::ir::Ir;

/// Public modules of the crate. The law's `controller!` adds those that are not constants.
const PUBLIC: [&str; 7] = ["body", "hysteresis", "limits", "permitted", "setpoint", "supervision", "task_space"];

/// Documentation of the crate: for a platform, for six legs, and how to call it.
const PLATFORM_PAGE: &str = include_str!("pages/platform.md");
const LEGS_PAGE: &str = include_str!("pages/legs.md");
const CALLING: &str = include_str!("pages/use.md");
const LICENCE: &str = "Generated code is under the licence 0BSD: use it as you like.";

/// How to call the controller, with units and frames: for its documentation and the README.
pub fn calling(ir: &Ir) -> String {
    let (command, frames) = if ir.task_space.is_some() {
        (
            "// A move to z = +1 µm; the words of a command are the first of `INPUT_NAMES`.\n\
             command[0] = 2;\n\
             command[3 + 2] = (1e-6 as Real).to_bits().into();",
            "- Set-points are in the user's frames (`control.frames` of the spec; else the base frame) and do not contain the\n  \
             bias. `pose` and `target` of the output contain it.\n\
             - A gauge's word is in m, or in V if the spec gives a calibration.\n\
             - A wrench is force and torque of the work piece **on** the platform, about its centre, in base axes.",
        )
    } else {
        (
            "// +1 µm in z, or of leg 2 if `controller.setpoint` of the spec is \"leg\".\n\
             command[2] = (1e-6 as Real).to_bits().into();",
            "- A gauge's word is the displacement of its leg from rest (m).",
        )
    };
    CALLING.replace("{command}", command).replace("{frames}", frames)
}

/// The text for a crate of these files, `src/NAME.rs` each.
pub fn emit<'a>(ir: &Ir, header: &str, files: impl Iterator<Item = &'a str>) -> String {
    let (law, page) = match (&ir.task_space, ir.hysteresis.identified) {
        (None, _) => ("legs", LEGS_PAGE),
        (Some(_), true) => ("platform", PLATFORM_PAGE),
        (Some(_), false) => ("platform, open_drive", PLATFORM_PAGE),
    };
    let only = if ir.hysteresis.identified { "" } else { ", with the open drive only: no leg is identified" };
    let title = format!("Controller of platform `{}`{only}.", ir.name);
    let mut text = header.to_owned();
    let calling = calling(ir);
    let pages = page.lines().chain([""]).chain(calling.lines()).chain(["", LICENCE]);
    for line in [title.as_str(), ""].into_iter().chain(pages) {
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
