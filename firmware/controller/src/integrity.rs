// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Whether tables and settings in memory are still those that the compiler wrote.
//!
//! Everything is read through `black_box`, so that memory is looked at and not what the compiler remembers.

pub use crate::checked::{CRC, IDENTITY, SETTINGS};

use crate::Config;
use crate::checked::add_tables;
use core::hint::black_box;
use specgen_runtime::Crc32;

/// The spec's settings as they lie in memory, which [`intact`] speaks for: what a target starts with. Words that no
/// `Config` can hold give `Config::new()`; then [`intact`] is false.
#[must_use]
pub fn config() -> Config {
    Config::from_words(black_box(&SETTINGS)).unwrap_or_default()
}

/// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
#[must_use]
pub fn computed() -> u32 {
    let mut crc = Crc32::new();
    crc.bytes(black_box(&IDENTITY));
    add_tables(&mut crc);
    crc.words(black_box(&SETTINGS));
    crc.finish()
}

/// Nothing has changed since the compiler wrote it. A target asks once, before it lets the amplifiers on.
#[must_use]
pub fn intact() -> bool {
    computed() == black_box(CRC)
}
