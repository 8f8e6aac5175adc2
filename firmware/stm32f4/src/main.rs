//! The emitted controller on a NUCLEO-F446RE with an AD7606 and two AD5686R; wiring and bring-up: docs/bring-up.md.
//!
//! | priority | what |
//! | --- | --- |
//! | 16, the highest | the voltage detector: stops with the amplifiers off |
//! | 15 | `tick`: TIM2, once a control period |
//! | 8 of the NVIC | DMA and USART2 |
//! | 1 | `link`: requests of the host |
//! | idle | shows the tick that the background is alive, sleeps |
#![no_std]
#![no_main]
#![allow(unsafe_code)] // Names and sections for the linker.

mod clocks;
mod pins;
mod spi;

/// The target that this is built for, which `specgen flash` takes from the image.
static BOARD: [u8; 23] = *b"specgen-board: stm32f4\n";

/// Words of the recorder: what the 128 KiB of RAM have besides the 24 KiB of the rest and some in reserve, 80 KiB with the knots and
/// samples.
const RECORD: usize = (80 * 1024 - size_of::<[[i32; 6]; PASSES]>() - size_of::<SampleMemory>()) / size_of::<u64>();

/// Knots of passes that learn, where the controller takes a correction: 36 KiB, half for corrections and half for errors.
const PASSES: usize = if controller::passes::POSSIBLE { 1536 } else { 0 };

/// This core has no caches.
const fn prepare(_: &mut cortex_m::Peripherals) {}

/// Nothing is copied but the initial values of variables.
const fn memory_intact() -> bool {
    true
}

include!("../../stm32/program.rs");
