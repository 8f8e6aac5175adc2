//! Reset cause of a device, as bits of [`Health::reset_cause`](crate::Health::reset_cause).

/// Meaning of each bit, from the lowest. The last is not a reset cause: the part runs on its internal oscillator,
/// because there was no other.
pub const NAMES: [&str; 8] =
    ["power-up", "brown-out", "reset pin", "software", "watchdog", "window watchdog", "low power", "no external clock"];

/// The bits of these flags.
#[must_use]
pub fn of(flags: [bool; 8]) -> u8 {
    flags.iter().rev().fold(0, |bits, flag| bits << 1 | u8::from(*flag))
}

/// The names of these bits.
pub fn names(bits: u8) -> impl Iterator<Item = &'static str> {
    NAMES.into_iter().enumerate().filter(move |(bit, _)| bits >> bit & 1 == 1).map(|(_, name)| name)
}
