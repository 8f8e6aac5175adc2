//! A table of corrections, played from fixed memory at a reduced rate.
//!
//! ```text
//! c(n) = Σ_k a_k B(n/D − k)        B: cubic B-spline, (4 − 6 x² + 3 |x|³)/6 for |x| < 1, (2 − |x|)³/6 for |x| < 2
//! ```
//! n counts ticks, D is the number of ticks from knot to knot, a_k a knot: six whole numbers of pm and prad. Before the first and behind the
//! last knot c is 0, so that it fades in and out. B is not negative and sums to 1: |c| is nowhere above the largest |a_k|, and its change in a
//! tick nowhere above the largest |a_k − a_{k−1}|/D.
//!
//! # Example
//!
//! One knot of 600 pm along x, D = 4 ticks: B is 4/6 at the knot and 1/6 at the next.
//!
//! ```
//! use specgen_runtime::playback::at;
//!
//! let knots = [[600, 0, 0, 0, 0, 0]];
//! let x = [0, 4, 8].map(|tick| at::<f64>(&knots, 4, tick)[0]);
//! assert!((x[0] - 400e-12).abs() < 1e-24);
//! assert!((x[1] - 100e-12).abs() < 1e-24);
//! assert_eq!(x[2], 0.0);
//! ```

use crate::real::Real;

/// A knot: x, y, z in pm, θx, θy, θz in prad.
pub type Knot = [i32; 6];

/// m in a unit of a knot, and rad.
pub const UNIT: f64 = 1e-12;

/// The correction for the end of tick `tick`, counted from 0, m and rad. `spacing` is D, at least 1.
#[must_use]
pub fn at<T: Real>(knots: &[Knot], spacing: u32, tick: u32) -> [T; 6] {
    let spacing = if spacing == 0 { 1 } else { spacing };
    let (whole, part) = ((tick / spacing) as usize, tick % spacing);
    let n = |number: i32| T::from_i32(number);
    // Both are below 2³¹: a memory cannot hold more knots.
    let x = n(part as i32) / n(spacing as i32);
    let rest = T::ONE - x;
    let unit = T::from_f64(UNIT / 6.0);
    let weights = [
        rest * rest * rest * unit,
        (n(4) - x * x * (n(6) - n(3) * x)) * unit,
        (n(4) - rest * rest * (n(6) - n(3) * rest)) * unit,
        x * x * x * unit,
    ];
    let mut sum = [T::ZERO; 6];
    for (ahead, weight) in weights.iter().enumerate() {
        // Counts from the previous knot.
        let Some(knot) = (whole + ahead).checked_sub(1).and_then(|index| knots.get(index)) else { continue };
        for (sum, value) in sum.iter_mut().zip(knot) {
            *sum = *sum + *weight * n(*value);
        }
    }
    sum
}
