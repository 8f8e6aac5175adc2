//! Sine and cosine from IEEE basic operations only: the same bits on every machine, no table, no library call.
//!
//! The kernels are those of fdlibm (f64) and Cephes (f32) for |angle| ≤ π/4. Larger angles are fractions of a turn in
//! fixed point, whose reduction is exact.
//!
//! # Example
//!
//! An eighth and a quarter of a turn, and a third of a half turn:
//!
//! ```
//! use specgen_runtime::trig::{sine_cosine, sine_cosine_turns};
//!
//! let (sine, cosine) = sine_cosine_turns::<f64>(1 << 61);
//! assert!((sine - 0.5_f64.sqrt()).abs() < 1e-15 && (cosine - 0.5_f64.sqrt()).abs() < 1e-15);
//! assert_eq!(sine_cosine_turns::<f64>(1 << 62), (1.0, 0.0));
//! let (sine, _) = sine_cosine(core::f64::consts::FRAC_PI_6);
//! assert!((sine - 0.5_f64).abs() < 1e-15);
//! ```

use crate::real::Real;

/// sin and cos of `angle` (rad, |angle| ≤ π/4), each within 1 ulp.
#[inline]
#[must_use]
pub fn sine_cosine<T: Real>(angle: T) -> (T, T) {
    let square = angle * angle;
    (sine_kernel(angle, square), cosine_kernel(square))
}

/// sin and 1 − cos of `angle` (rad, |angle| ≤ π/4), each within 3 ulp of itself: nothing cancels near zero.
#[inline]
#[must_use]
pub fn sine_versine<T: Real>(angle: T) -> (T, T) {
    let square = angle * angle;
    (sine_kernel(angle, square), square * (T::HALF - square * cosine_tail(square)))
}

/// 1 − cos of `angle`, see [`sine_versine`].
#[inline]
#[must_use]
pub fn versine<T: Real>(angle: T) -> T {
    sine_versine(angle).1
}

/// sin and cos of `phase`/2⁶⁴ of a turn, for every phase. The reduction to an eighth of a turn is exact.
///
/// Such a phase accumulator never drifts: it wraps at a full turn. Absolute error within 2 ulp of 1.
#[inline]
#[must_use]
pub fn sine_cosine_turns<T: Real>(phase: u64) -> (T, T) {
    let nearest = phase.wrapping_add(1 << 61);
    let rest = nearest.wrapping_sub(1 << 61).wrapping_sub(nearest & (3 << 62));
    // A signed number of 62 bits as two exact integers. A conversion of 64 bits would be a library call on a
    // microcontroller.
    let high = T::from_i32((rest >> 32) as i32) * T::from_f64(RADIANS_PER_HIGH);
    let low = T::from_i32((rest as u32 >> 1) as i32) * T::from_f64(RADIANS_PER_LOW);
    let (sine, cosine) = sine_cosine(high + low);
    match nearest >> 62 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// 2π/2³².
const RADIANS_PER_HIGH: f64 = core::f64::consts::TAU / 4_294_967_296.0;
/// 2π/2⁶³.
const RADIANS_PER_LOW: f64 = core::f64::consts::TAU / 9_223_372_036_854_775_808.0;

#[allow(clippy::excessive_precision)] // As published.
#[inline]
fn sine_kernel<T: Real>(angle: T, z: T) -> T {
    let c = T::from_f64;
    let tail = if T::SINGLE {
        c(-1.666_665_461_1e-1) + z * (c(8.332_160_873_6e-3) + z * c(-1.951_529_589_1e-4))
    } else {
        c(-1.666_666_666_666_663_243_48e-1)
            + z * (c(8.333_333_333_322_489_461_24e-3)
                + z * (c(-1.984_126_982_985_794_931_34e-4)
                    + z * (c(2.755_731_370_707_006_767_89e-6)
                        + z * (c(-2.505_076_025_340_686_341_95e-8) + z * c(1.589_690_995_211_550_102_21e-10)))))
    };
    angle + angle * z * tail
}

/// (cos x − 1 + x²/2) / x⁴ as a function of z = x².
#[allow(clippy::excessive_precision)] // As published.
#[inline]
fn cosine_tail<T: Real>(z: T) -> T {
    let c = T::from_f64;
    if T::SINGLE {
        c(4.166_664_568_298_827e-2) + z * (c(-1.388_731_625_493_765e-3) + z * c(2.443_315_711_809_948e-5))
    } else {
        c(4.166_666_666_666_660_190_37e-2)
            + z * (c(-1.388_888_888_887_410_957_49e-3)
                + z * (c(2.480_158_728_947_672_941_78e-5)
                    + z * (c(-2.755_731_435_139_066_330_35e-7)
                        + z * (c(2.087_572_321_298_174_827_90e-9) + z * c(-1.135_964_755_778_819_482_65e-11)))))
    }
}

#[inline]
fn cosine_kernel<T: Real>(z: T) -> T {
    let tail = cosine_tail(z);
    // Add back what 1 − z/2 rounds off.
    let half = T::HALF * z;
    let near = T::ONE - half;
    near + (((T::ONE - near) - half) + z * z * tail)
}
