//! From a drive to a converter code, with the voltage and slew limits as integers.
//!
//! A voltage leaves the controller only as `volts_at_zero + code · volts_per_code` with `code_min ≤ code ≤ code_max`.
//! So it is always finite and within limits.
//!
//! # Example
//!
//! A converter of 10 mV and a thousandth of a cell a code, with at most 100 codes a tick:
//!
//! ```
//! use specgen_runtime::{CodeLimits, Dac};
//!
//! let dac = Dac::<f64> {
//!     volts_at_zero: 0.0,
//!     volts_per_code: 0.01,
//!     cells_at_zero: 0.0,
//!     cells_per_code: 0.001,
//!     codes_per_cell: 1000.0,
//! };
//! let limits = CodeLimits { min: 0, max: 10_000, max_step: 100 };
//! assert_eq!(dac.code(2.0004, 1990, limits), (2000, false));
//! assert_eq!(dac.voltage(2000), 20.0);
//! assert_eq!(dac.code_of_voltage(20.004, 1990, limits), (2000, false));
//! // The slew limit, and the highest code.
//! assert_eq!(dac.code(2.0, 1000, limits), (1100, true));
//! assert_eq!(dac.code(10.5, 9990, limits), (10_000, true));
//! ```

use crate::real::Real;

/// A converter with straight binary codes, and its scale on the Everett grid.
#[derive(Debug, Clone, Copy)]
pub struct Dac<T> {
    /// Voltage of code 0, V.
    pub volts_at_zero: T,
    /// Voltage step, V.
    pub volts_per_code: T,
    /// Drive of code 0, cells of the Everett grid.
    pub cells_at_zero: T,
    /// Drive step, cells.
    pub cells_per_code: T,
    /// Codes in one cell.
    pub codes_per_cell: T,
}

/// Limits of the codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeLimits {
    /// Lowest code.
    pub min: i32,
    /// Highest code, ≥ `min`.
    pub max: i32,
    /// Largest change from one tick to the next, ≥ 1 (slew rate × control period).
    pub max_step: i32,
}

impl<T: Real> Dac<T> {
    /// The permitted code nearest to `drive` (cells) after the code `previous`, and whether a limit held it back. The
    /// slew limit has priority: after a change of limits, a code outside them returns no faster than the slew limit
    /// allows.
    #[inline]
    #[must_use]
    pub fn code(&self, drive: T, previous: i32, limits: CodeLimits) -> (i32, bool) {
        limited(self.nearest(drive), previous, limits)
    }

    /// [`Dac::code`] for a voltage (V, finite).
    #[inline]
    #[must_use]
    pub fn code_of_voltage(&self, voltage: T, previous: i32, limits: CodeLimits) -> (i32, bool) {
        let wanted = ((voltage - self.volts_at_zero) / self.volts_per_code + T::HALF).truncate();
        limited(wanted, previous, limits)
    }

    /// The code nearest to `drive` (cells), as [`Dac::code`] if no limit holds it back.
    #[inline(always)]
    #[must_use]
    pub fn free_code(&self, drive: T, previous: i32, limits: CodeLimits) -> Option<i32> {
        let wanted = self.nearest(drive);
        // One comparison for each range: a code below the range wraps to a large number. Codes are far from the ends of
        // their type.
        let within = wanted.wrapping_sub(limits.min) as u32 <= limits.max.wrapping_sub(limits.min) as u32;
        let place = wanted.wrapping_sub(previous).wrapping_add(limits.max_step) as u32;
        (within && place <= 2 * limits.max_step as u32).then_some(wanted)
    }

    #[inline(always)]
    fn nearest(&self, drive: T) -> i32 {
        ((drive - self.cells_at_zero) * self.codes_per_cell + T::HALF).truncate()
    }

    /// Drive of `code`, cells.
    #[inline]
    #[must_use]
    pub fn drive(&self, code: i32) -> T {
        from(self.cells_at_zero, T::from_i32(code) * self.cells_per_code)
    }

    /// Voltage of `code`, V.
    #[inline]
    #[must_use]
    pub fn voltage(&self, code: i32) -> T {
        from(self.volts_at_zero, T::from_i32(code) * self.volts_per_code)
    }
}

/// `start` + `way`. The compiler omits the sum if the converter starts at zero. (No code gives −0.)
#[inline(always)]
fn from<T: Real>(start: T, way: T) -> T {
    if start == T::ZERO { way } else { start + way }
}

/// The permitted code nearest to `wanted`, and whether a limit held it back.
#[inline]
fn limited(wanted: i32, previous: i32, limits: CodeLimits) -> (i32, bool) {
    let permitted = within(wanted, limits.min, limits.max);
    let code = within(permitted, previous.saturating_sub(limits.max_step), previous.saturating_add(limits.max_step));
    (code, code != wanted)
}

#[inline]
fn within(value: i32, low: i32, high: i32) -> i32 {
    if value > high {
        high
    } else if value < low {
        low
    } else {
        value
    }
}
