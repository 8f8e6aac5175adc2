//! The files of a self-contained workspace. Beside the emitted crate it holds the runtime and the targets, copied verbatim
//! from the sources that specgen itself was built with. [`write()`] puts them into a folder, whole or not at all.

mod output;

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};

use crate::emit::EmittedCrate;
use crate::ir::Ir;

pub use output::{WriteError, write};

/// Hand-written files that every workspace gets, as path and text.
const FIXED: &[(&str, &str)] = &[
    ("runtime/Cargo.toml", include_str!("../../firmware/runtime/Cargo.toml")),
    ("runtime/src/lib.rs", include_str!("../../firmware/runtime/src/lib.rs")),
    ("runtime/src/adaptation.rs", include_str!("../../firmware/runtime/src/adaptation.rs")),
    ("runtime/src/attitude.rs", include_str!("../../firmware/runtime/src/attitude.rs")),
    ("runtime/src/creep.rs", include_str!("../../firmware/runtime/src/creep.rs")),
    ("runtime/src/dac.rs", include_str!("../../firmware/runtime/src/dac.rs")),
    ("runtime/src/digest.rs", include_str!("../../firmware/runtime/src/digest.rs")),
    ("runtime/src/dynamic.rs", include_str!("../../firmware/runtime/src/dynamic.rs")),
    ("runtime/src/dynamics.rs", include_str!("../../firmware/runtime/src/dynamics.rs")),
    ("runtime/src/dynamics/attitude.rs", include_str!("../../firmware/runtime/src/dynamics/attitude.rs")),
    ("runtime/src/dynamics/balance.rs", include_str!("../../firmware/runtime/src/dynamics/balance.rs")),
    ("runtime/src/dynamics/lanes.rs", include_str!("../../firmware/runtime/src/dynamics/lanes.rs")),
    ("runtime/src/dynamics/leg.rs", include_str!("../../firmware/runtime/src/dynamics/leg.rs")),
    ("runtime/src/everett.rs", include_str!("../../firmware/runtime/src/everett.rs")),
    ("runtime/src/kinematics.rs", include_str!("../../firmware/runtime/src/kinematics.rs")),
    ("runtime/src/memory.rs", include_str!("../../firmware/runtime/src/memory.rs")),
    ("runtime/src/feedback.rs", include_str!("../../firmware/runtime/src/feedback.rs")),
    ("runtime/src/linear.rs", include_str!("../../firmware/runtime/src/linear.rs")),
    ("runtime/src/mode.rs", include_str!("../../firmware/runtime/src/mode.rs")),
    ("runtime/src/motion.rs", include_str!("../../firmware/runtime/src/motion.rs")),
    ("runtime/src/notch.rs", include_str!("../../firmware/runtime/src/notch.rs")),
    ("runtime/src/transfer.rs", include_str!("../../firmware/runtime/src/transfer.rs")),
    ("runtime/src/real.rs", include_str!("../../firmware/runtime/src/real.rs")),
    ("runtime/src/sensing.rs", include_str!("../../firmware/runtime/src/sensing.rs")),
    ("runtime/src/velocity.rs", include_str!("../../firmware/runtime/src/velocity.rs")),
    ("runtime/src/setpoint.rs", include_str!("../../firmware/runtime/src/setpoint.rs")),
    ("runtime/src/setpoint/frames.rs", include_str!("../../firmware/runtime/src/setpoint/frames.rs")),
    ("runtime/src/setpoint/generator.rs", include_str!("../../firmware/runtime/src/setpoint/generator.rs")),
    ("runtime/src/setpoint/profile.rs", include_str!("../../firmware/runtime/src/setpoint/profile.rs")),
    ("runtime/src/setpoint/stop.rs", include_str!("../../firmware/runtime/src/setpoint/stop.rs")),
    ("runtime/src/setpoint/trajectory.rs", include_str!("../../firmware/runtime/src/setpoint/trajectory.rs")),
    ("runtime/src/supervisor.rs", include_str!("../../firmware/runtime/src/supervisor.rs")),
    ("runtime/src/supervisor/kinds.rs", include_str!("../../firmware/runtime/src/supervisor/kinds.rs")),
    ("runtime/src/trig.rs", include_str!("../../firmware/runtime/src/trig.rs")),
    ("host/Cargo.toml", include_str!("../../firmware/host/Cargo.toml")),
    ("host/build.rs", include_str!("../../firmware/host/build.rs")),
    ("host/src/lib.rs", include_str!("../../firmware/host/src/lib.rs")),
    ("qemu/Cargo.lock", include_str!("../../firmware/qemu/Cargo.lock")),
    ("qemu/README.md", include_str!("../../firmware/qemu/README.md")),
    ("qemu/Cargo.toml", include_str!("../../firmware/qemu/Cargo.toml")),
    ("qemu/build.rs", include_str!("../../firmware/qemu/build.rs")),
    ("qemu/memory.x", include_str!("../../firmware/qemu/memory.x")),
    ("qemu/src/instructions.rs", include_str!("../../firmware/qemu/src/instructions.rs")),
    ("qemu/src/main.rs", include_str!("../../firmware/qemu/src/main.rs")),
    ("qemu/src/panic.rs", include_str!("../../firmware/qemu/src/panic.rs")),
    ("qemu/src/semihosting.rs", include_str!("../../firmware/qemu/src/semihosting.rs")),
    ("qemu/src/stack.rs", include_str!("../../firmware/qemu/src/stack.rs")),
    ("qemu/src/stages.rs", include_str!("../../firmware/qemu/src/stages.rs")),
    ("qemu/src/stats.rs", include_str!("../../firmware/qemu/src/stats.rs")),
];

/// All files of a workspace: path relative to its root, text. The same spec gives the same bytes.
#[must_use]
pub fn files(ir: &Ir, controller: &EmittedCrate) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> =
        FIXED.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    for (path, text) in controller {
        files.insert(format!("controller/{path}"), text.clone());
    }
    files.insert("Cargo.toml".to_owned(), root_manifest(ir));
    files.insert("README.md".to_owned(), readme(ir));
    files.insert("ir.json".to_owned(), ir_text(ir));
    files
}

/// The IR as JSON text, for people and for comparing two versions.
#[must_use]
pub fn ir_text(ir: &Ir) -> String {
    match serde_json::to_string_pretty(ir) {
        Ok(text) => text + "\n",
        // Plain data with string keys always serialises.
        Err(error) => unreachable!("the IR does not serialise: {error}"),
    }
}

fn root_manifest(ir: &Ir) -> String {
    format!(
        "# Generated by specgen {} from platform `{}`.
[workspace]
resolver = \"3\"
members = [\"controller\", \"runtime\", \"host\"]
exclude = [\"qemu\"]

[profile.dev]
panic = \"abort\"

[profile.release]
panic = \"abort\"
opt-level = 3
lto = \"fat\"
codegen-units = 1
debug = \"line-tables-only\"
",
        ir.specgen_version, ir.name
    )
}

fn readme(ir: &Ir) -> String {
    format!(
        "# Controller of platform `{name}`

Generated by specgen {version}; spec digest `{digest}`. Do not edit: change the spec and generate again.

| folder | what | needs |
|---|---|---|
| `controller/` | the controller: `no_std`, no allocation, no panic path, `{scalar}` | nothing |
| `runtime/` | the kernels it calls | nothing |
| `host/` | the same controller as a shared library: `cargo build --release` | a host toolchain |
| `qemu/` | the same controller on an emulated Cortex-M: see its README | target `thumbv7em-none-eabihf`, QEMU |
| `ir.json` | every constant of the controller | |

Start reading at `controller/src/step.rs`.

Generated code carries no licence restriction of its own: use it as you like. `runtime/`, `host/` and `qemu/` are
MIT OR Apache-2.0, like specgen.
",
        name = ir.name,
        version = ir.specgen_version,
        digest = ir.digest,
        scalar = format_args!("f{}", ir.scalar.bits()),
    )
}

/// SHA-256 in hex.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn list(root: &Path, below: &str) -> Vec<String> {
        let inside =
            |(path, kind): (String, std::fs::FileType)| if kind.is_dir() { list(root, &path) } else { vec![path] };
        output::entries(root, below).unwrap().into_iter().flat_map(inside).collect()
    }

    /// Nothing that a target needs is forgotten: what lies in its folder is copied, but for tests.
    #[test]
    fn every_hand_written_file_of_runtime_and_targets_is_copied() {
        let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware");
        let mut present: Vec<String> = list(&firmware, "")
            .into_iter()
            .filter(|path| !path.starts_with("controller/") && !path.starts_with("runtime/tests/"))
            .collect();
        // `list` passes lock files over; the one of the image is ours.
        present.push("qemu/Cargo.lock".to_owned());
        present.sort();
        let mut copied: Vec<String> = FIXED.iter().map(|(path, _)| (*path).to_owned()).collect();
        copied.sort();
        assert_eq!(present, copied);
    }
}
