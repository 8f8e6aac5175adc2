//! Firmware of the NUCLEO-F446RE.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "stm32f4",
    member: false,
    what: "firmware of the NUCLEO-F446RE (Cortex-M4F, `f32`)",
    needs: "target `thumbv7em-none-eabihf`",
    with: &["board", "hal", "link", "stm32", "tick"],
    files: files! { "stm32f4":
        ".cargo/config.toml",
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
        "memory.x",
        "src/clocks.rs",
        "src/main.rs",
        "src/pins.rs",
        "src/spi.rs",
    },
};
