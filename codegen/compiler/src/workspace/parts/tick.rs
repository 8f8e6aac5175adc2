//! A board's tick on an emulated Cortex-M, for the estimate of its time.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "tick",
    member: false,
    what: "a board's tick between stand-ins for its converters, on an emulated Cortex-M: what its time is estimated from",
    needs: "target `thumbv7em-none-eabihf`, QEMU",
    with: &["board", "hal", "link", "qemu", "stm32"],
    files: files! { "tick":
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
        "src/main.rs",
        "src/parts.rs",
    },
};
