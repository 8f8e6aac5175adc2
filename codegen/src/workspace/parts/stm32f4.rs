//! Firmware of the NUCLEO-F446RE.

use super::{Part, files};

pub const PART: Part = Part {
    folder: "stm32f4",
    member: false,
    what: "firmware of the NUCLEO-F446RE (Cortex-M4F, `f32`)",
    needs: "target `thumbv7em-none-eabihf`",
    with: &["hal", "link"],
    files: files! { "stm32f4": },
};
