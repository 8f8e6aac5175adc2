//! The controller on an emulated Cortex-M.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "qemu",
    member: false,
    what: "the same controller on an emulated Cortex-M: see its README",
    needs: "target `thumbv7em-none-eabihf`, QEMU",
    with: &["link"],
    files: files! { "qemu":
        "Cargo.lock",
        "Cargo.toml",
        "README.md",
        "build.rs",
        "link.x",
        "src/counted.rs",
        "src/instructions.rs",
        "src/machine.rs",
        "src/main.rs",
        "src/panic.rs",
        "src/pil.rs",
        "src/pipe.rs",
        "src/semihosting.rs",
        "src/stack.rs",
        "src/stages.rs",
        "src/start.rs",
        "src/stats.rs",
        "src/steps.rs",
    },
};
