//! Firmware of the NUCLEO-H743ZI2.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "stm32h743",
    member: false,
    what: "firmware of the NUCLEO-H743ZI2 (Cortex-M7)",
    needs: "target `thumbv7em-none-eabihf`",
    with: &["board", "hal", "link", "stm32", "tick"],
    files: files! { "stm32h743":
        ".cargo/config.toml",
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
        "memory.x",
        "src/caches.rs",
        "src/clocks.rs",
        "src/main.rs",
        "src/pins.rs",
        "src/spi.rs",
        "src/tightly.rs",
    },
};
