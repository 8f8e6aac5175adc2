//! Whether tables and settings in memory are as the compiler wrote them.

use core::hint::black_box;

use specgen_runtime::Crc32;

/// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
///
/// Everything is read through `black_box`, so that memory is read and not folded constants.
///
/// ```
/// use specgen_law::integrity::computed;
///
/// // Identity and tables in this order: the check value of the nine digits.
/// assert_eq!(computed(b"1234", |crc| crc.bytes(b"56789"), &[]), 0xcbf4_3926);
/// // One changed bit in the settings is found.
/// assert_ne!(computed(b"1234", |_| {}, &[0]), computed(b"1234", |_| {}, &[1]));
/// ```
#[must_use]
pub fn computed(identity: &[u8], add_tables: impl FnOnce(&mut Crc32), settings: &[u64]) -> u32 {
    let mut crc = Crc32::new();
    crc.bytes(black_box(identity));
    add_tables(&mut crc);
    crc.words(black_box(settings));
    crc.finish()
}
