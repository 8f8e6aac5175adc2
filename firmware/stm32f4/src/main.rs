//! The emitted controller on a NUCLEO-F446RE with an AD7606 and two AD5686R; wiring and bring-up: docs/bring-up.md.
//!
//! | priority | what |
//! | --- | --- |
//! | 16, the highest | the voltage detector: stops with the amplifiers off |
//! | 15 | `tick`: TIM2, once a control period |
//! | 8 of the NVIC | DMA and USART2 |
//! | 1 | `link`: requests of the host |
//! | idle | signals the tick that the background is alive, sleeps |
#![no_std]
#![no_main]
#![allow(unsafe_code)] // Names and sections for the linker.

mod clocks;
mod pins;
mod spi;

/// The target of this image, which `specgen flash` reads.
static BOARD: [u8; 23] = *b"specgen-board: stm32f4\n";

/// Words of the recorder: 80 KiB of the 128 KiB of RAM, shared with knots and samples. The rest of the program takes 24 KiB.
const RECORD: usize = (80 * 1024 - size_of::<[[i32; 6]; PASSES]>() - size_of::<SampleMemory>()) / size_of::<u64>();

/// Knots of learning passes, if the controller has a correction: 36 KiB, half for corrections and half for errors.
const PASSES: usize = if controller::passes::POSSIBLE { 1536 } else { 0 };

/// Nothing to do: this core has no caches.
const fn prepare(_: &mut cortex_m::Peripherals) {}

/// Only initial values of variables are copied to RAM.
const fn memory_intact() -> bool {
    true
}

include!("../../stm32/program.rs");
