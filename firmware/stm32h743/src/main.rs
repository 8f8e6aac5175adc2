//! The emitted controller on a NUCLEO-H743ZI2 with an AD7606 and two AD5686R; wiring and bring-up: docs/bring-up.md.
//!
//! | priority | what |
//! | --- | --- |
//! | 16, the highest | the voltage detector: stops with the amplifiers off |
//! | 15 | `tick`: TIM2, once a control period |
//! | 8 of the NVIC | DMA and USART3 |
//! | 1 | `link`: requests of the host |
//! | idle | signals the tick that the background is alive, sleeps |
#![no_std]
#![no_main]
#![allow(unsafe_code)] // Names and sections for the linker.

mod caches;
mod clocks;
mod pins;
mod spi;
mod tightly;

use tightly::is_intact as memory_intact;

/// The target of this image, which `specgen flash` reads.
static BOARD: [u8; 25] = *b"specgen-board: stm32h743\n";

/// Words of the recorder: 448 KiB of the AXI SRAM (512 KiB), shared with knots and samples. The buffers of the DMA are the only
/// other contents.
const RECORD: usize = (448 * 1024 - size_of::<[[i32; 6]; PASSES]>() - size_of::<SampleMemory>()) / size_of::<u64>();

/// Knots of learning passes, if the controller has a correction: 192 KiB, half for corrections and half for errors.
const PASSES: usize = if controller::passes::POSSIBLE { 8192 } else { 0 };

/// Initialises memories and caches before anything else.
fn prepare(core: &mut cortex_m::Peripherals) {
    caches::enable(&mut core.MPU, &mut core.SCB, &mut core.CPUID);
}

include!("../../stm32/program.rs");
