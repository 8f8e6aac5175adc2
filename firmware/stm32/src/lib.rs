//! Code shared by the STM32 boards, on the registers of `stm32-metapac`: a HAL takes longer to compile than the rest of an image. The
//! board's program selects the microcontroller by a cargo feature and defines pins, clocks and interrupts.
#![no_std]
#![deny(missing_docs)]
#![deny(unsafe_code)]

pub mod burst;
pub mod converters;
pub mod cycles;
mod delay;
pub mod enable;
mod memory;
pub mod oscillator;
pub mod pins;
pub mod pulses;
pub mod serial;
mod stack;
pub mod supply;
pub mod timer;
pub mod times;
pub mod watchdog;

pub use delay::CycleDelay;
pub use stack::used as stack_used;
