//! Whether tables and settings in memory are as the compiler wrote them.

use core::hint::black_box;

use specgen_runtime::Crc32;

/// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
///
/// Everything is read through `black_box`, so that memory is read and not folded constants.
#[must_use]
pub fn computed(identity: &[u8], add_tables: impl FnOnce(&mut Crc32), settings: &[u64]) -> u32 {
    let mut crc = Crc32::new();
    crc.bytes(black_box(identity));
    add_tables(&mut crc);
    crc.words(black_box(settings));
    crc.finish()
}
