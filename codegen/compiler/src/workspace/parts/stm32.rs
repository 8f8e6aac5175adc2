//! What the STM32 boards have in common.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "stm32",
    member: false,
    what: "what the STM32 boards have in common",
    needs: "nothing by itself",
    with: &["board", "hal", "link"],
    files: files! { "stm32":
        "Cargo.toml",
        "program.rs",
        "src/burst.rs",
        "src/converters.rs",
        "src/cycles.rs",
        "src/delay.rs",
        "src/enable.rs",
        "src/lib.rs",
        "src/memory.rs",
        "src/oscillator.rs",
        "src/pins.rs",
        "src/pulses.rs",
        "src/serial.rs",
        "src/stack.rs",
        "src/supply.rs",
        "src/timer.rs",
        "src/times.rs",
        "src/watchdog.rs",
    },
};
