//! Why a device's program began, as bits of [`Health::reset_cause`](crate::Health::reset_cause).

/// What each bit means, from the lowest on. The last is none of the reset: the part runs on its own oscillator, for there was no other.
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
