//! Where the HAL's checks of itself end: its texts stay out of the image, and nothing is logged.
//!
//! The HAL checks its clocks and its DMA with some fifty texts that nobody reads on a board: 8 KB of flash. With its feature
//! `defmt` they are numbers in a section that is not loaded. specgen builds with `DEFMT_LOG=off`, so that the HAL logs
//! nothing either; without it the image is larger, and what is logged goes nowhere.

#![allow(unsafe_code)] // `Logger` is an unsafe trait.

/// A failed check of the HAL is a panic as every other: the program's handler disables the amplifiers.
#[defmt::panic_handler]
fn failed() -> ! {
    core::panic!()
}

/// Drops what it gets.
#[defmt::global_logger]
struct Silent;

// SAFETY: in its functions too, it holds nothing that two writers could spoil.
unsafe impl defmt::Logger for Silent {
    fn acquire() {}

    unsafe fn flush() {}

    unsafe fn release() {}

    unsafe fn write(_: &[u8]) {}
}
