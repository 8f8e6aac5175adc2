//! Bits of a tick's status.
//!
//! # Example
//!
//! ```
//! use specgen_law::status::{GAUGE_FAULT, GENERATOR_BUSY, LEG_LIMITED};
//!
//! let status = 0x4_0201;
//! assert_eq!(status & LEG_LIMITED, 1 << 0); // leg 0 is held back
//! assert_eq!(status & GAUGE_FAULT, 1 << (8 + 1)); // gauge 1 is not trusted
//! assert_ne!(status & GENERATOR_BUSY, 0); // a motion is under way
//! ```

/// Bits 0 to 5 of the status: leg held back by table, voltage or slew limit.
pub const LEG_LIMITED: u32 = 0x3f;

/// Bits 8 to 13: gauge not finite or out of range. Pose, integral and estimates were held.
pub const GAUGE_FAULT: u32 = 0x3f00;

/// Bit 16: set-point not finite, out of the workspace or a jump; the last one was held.
pub const SETPOINT_FAULT: u32 = 0x1_0000;

/// Bit 17: the stream of set-points is stale; the platform was stopped.
pub const SETPOINT_STALE: u32 = 0x2_0000;

/// Bit 18: bias, move or trajectory under way.
pub const GENERATOR_BUSY: u32 = 0x4_0000;

/// Bit 19: measured wrench not finite or out of range; the last valid one was kept.
pub const WRENCH_FAULT: u32 = 0x8_0000;

/// Bit 20: correction not finite, or larger or faster than permitted; it was followed up to the limits.
pub const CORRECTION_LIMITED: u32 = 0x10_0000;

/// Bits 6, 7, 14 and 15: output line 0, 1, 2, 3 is high over the next interval. Only under the supervisor.
pub const TRIGGER_HIGH: u32 = 0xc0c0;

/// Bit 21: an output line has missed a pulse since its settings were written. Only under the supervisor.
pub const TRIGGER_MISSED: u32 = 0x20_0000;

/// Bits 24 to 29: the rate-dependent inverse of the leg was not safe to use, and the static one was used. Never set by
/// models with one inverse.
pub const STATIC_INVERSE: u32 = 0x3f00_0000;
