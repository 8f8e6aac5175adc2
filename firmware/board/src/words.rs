//! Requirements on the converters, from the controller's constants, at compile time.

use controller::PERIOD_SECONDS;
use controller::sensing::CONVERTER;

/// Bits of a gauge's code, from `sensor.bits`.
pub const GAUGE_BITS: u32 = u32::BITS - CONVERTER.highest.leading_zeros();

/// Control period, ns; from `timing.period`.
pub const PERIOD_NANOSECONDS: u32 = (PERIOD_SECONDS * 1e9 + 0.5) as u32;
