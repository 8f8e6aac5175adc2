//! Time, in a unit that every clock of both boards divides.

/// Units in a microsecond: a cycle of 400, 200, 180, 100, 90, 64, 45 and 16 MHz is a whole number of them.
pub const MICROSECOND: u64 = 14_400;

/// Units since power-up.
pub type Time = u64;

/// So many nanoseconds, rounded up.
pub const fn nanoseconds(count: u64) -> Time {
    (count * MICROSECOND).div_ceil(1000)
}

/// A cycle of a clock, Hz.
pub const fn cycle(hertz: u64) -> Time {
    MICROSECOND * 1_000_000 / hertz
}

/// In microseconds, to print.
pub fn microseconds(time: Time) -> f64 {
    time as f64 / MICROSECOND as f64
}
