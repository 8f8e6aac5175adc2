//! What is the same for every spec of a kind: ordinary files below `firmware/controller/law`, carried over as they stand. What
//! they need to know of the spec they take from the emitted constants.

use crate::ir::Ir;

/// Path in the emitted crate, text.
type File = (&'static str, &'static str);

macro_rules! files {
    ($($folder:literal: $($name:literal),+;)+) => {
        &[$($((
            concat!("src/", $name, ".rs"),
            include_str!(concat!("../../../../firmware/controller/law/", $folder, "/", $name, ".rs")),
        ),)+)+]
    };
}

/// Of six legs with their own gauges.
pub const LEGS: &[File] = files! {
    "common": "description", "dynamics", "integrity", "kinematics", "machine", "snapshot", "stage", "supervised", "words";
    "legs": "api", "config", "passes", "sensing", "stages", "standing", "state", "step", "tick", "triggers", "waves";
};

/// Documentation of their crate.
pub const LEGS_PAGE: &str = include_str!("../../../../firmware/controller/law/legs/lib.md");

/// Of a platform.
pub const PLATFORM: &[File] = files! {
    "common": "description", "dynamics", "integrity", "kinematics", "machine", "snapshot", "stage", "supervised", "words";
    "platform": "api", "config", "notch", "passes", "sensing", "stages", "standing", "state", "step", "tick", "triggers", "waves";
};

/// Documentation of its crate.
pub const PLATFORM_PAGE: &str = include_str!("../../../../firmware/controller/law/platform/lib.md");

/// The text of one in the emitted crate.
pub fn carried_over(ir: &Ir, text: &str) -> String {
    format!(
        "// Carried over by specgen {}: the same for every spec. Its constants are in the generated files beside it.\n\n{text}",
        ir.specgen_version
    )
}
