//! Whether tables and settings in memory are still those that the compiler wrote.

use core::hint::black_box;

use specgen_runtime::Crc32;

/// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
///
/// Everything is read through `black_box`, so that memory is looked at and not what the compiler remembers.
#[must_use]
pub fn computed(identity: &[u8], add_tables: impl FnOnce(&mut Crc32), settings: &[u64]) -> u32 {
    let mut crc = Crc32::new();
    crc.bytes(black_box(identity));
    add_tables(&mut crc);
    crc.words(black_box(settings));
    crc.finish()
}
