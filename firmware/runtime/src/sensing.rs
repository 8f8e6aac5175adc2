//! Pose from six gauges that measure the platform.
//!
//! Gauge k measures along a line fixed in the base, of direction n (unit, {B}), to a plane fixed to the platform; at rest the line
//! pierces the plane at c ({P}) and the reading is zero. With m the plane's normal ({P}), scaled so that m·n = 1:
//!
//! ```text
//! y = [(R m)·t − ((R − I) m)·c] / [1 + n·(R − I) m]                       reading of a pose, in difference form
//! ```
//!
//! For the inverse, take u = D Rᵀt and the rotation as R = I + (ψ× + ½ ψ×²)/D with D = 1 + ¼|ψ|² (Cayley; |ψ| = 2
//! tan(φ/2) for a rotation by φ). The equations of the six gauges are then polynomials of second degree in ψ, and
//! linear in u:
//!
//! ```text
//! m·u + (c × m)·ψ = y (1 − ¼|ψ|²) + y [(m × n)·ψ + ½ (m·ψ)(n·ψ)] + ½ [(m·ψ)(c·ψ) − (m·c)|ψ|²]
//! ```
//!
//! The left side is J [u; ψ] with the Jacobian J of the gauges at rest. J⁻¹ of the readings is the first guess. A pass
//! puts ψ into the right side, which is of the order of the angle. All but the last pass need ψ alone. No sine or
//! cosine is needed; three divisions and three short series turn ψ into θ.
//!
//! A gauge along an axis of the base, or normal to its plane, has zeros among its constants. Their terms are left out,
//! so that constants known to the compiler cost nothing: an axis-aligned layout takes less than half the time of a skew
//! one.
//!
//! # Example
//!
//! A gauge that looks along z at x = 80 mm (here six times) reads a rise as is, and a tilt θ about y as −80 mm tan θ:
//!
//! ```
//! use specgen_runtime::{Gauges, Series};
//!
//! let gauges = Gauges::<f64> {
//!     direction: [[0.0, 0.0, 1.0]; 6],
//!     normal: [[0.0, 0.0, 1.0]; 6],
//!     skew: [[0.0; 3]; 6],
//!     pierced: [[0.08, 0.0, 0.0]; 6],
//!     inverse: [[0.0; 6]; 6], // needed only for the pose
//!     curvature: [[0.0; 6]; 6],
//!     passes: 1,
//!     arc_sine: &[],
//!     arc_tangent: &[],
//! };
//! let series = Series { sine: &[-1.0 / 6.0, 1.0 / 120.0], versine: &[1.0 / 2.0, -1.0 / 24.0] };
//! let read = |pose| gauges.readings(&series, &pose)[0];
//! assert_eq!(read([0.0, 0.0, 5e-6, 0.0, 0.0, 0.0]), 5e-6);
//! assert!((read([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0]) + 0.08 * 1e-3_f64.tan()).abs() < 1e-15);
//! ```

use crate::attitude::{Series, horner, odd_series};
use crate::linear::each;
use crate::real::Real;

/// Six gauges. Every constant belongs to the rest pose.
#[derive(Debug, Clone, Copy)]
pub struct Gauges<'a, T> {
    /// n of each gauge, unit, {B}.
    pub direction: [[T; 3]; 6],
    /// m of each gauge: the plane's normal over its product with n, {P}.
    pub normal: [[T; 3]; 6],
    /// m × n of each gauge; zero where the line is normal to its plane.
    pub skew: [[T; 3]; 6],
    /// c of each gauge: where the line pierces the plane at rest, {P}, m.
    pub pierced: [[T; 3]; 6],
    /// J⁻¹: pose coordinates (rows) per reading (columns), m/m and rad/m.
    pub inverse: [[T; 6]; 6],
    /// J⁻¹ of ½ [(m·ψ)(c·ψ) − (m·c)|ψ|²]: pose coordinates (rows) per ψx², ψy², ψz², ψxψy, ψxψz, ψyψz (columns).
    pub curvature: [[T; 6]; 6],
    /// Passes after the first guess, at least 1.
    pub passes: usize,
    /// Coefficients of asin x / x in x² after the leading 1.
    pub arc_sine: &'a [T],
    /// Coefficients of atan x / x in x² after the leading 1.
    pub arc_tangent: &'a [T],
}

impl<T: Real> Gauges<'_, T> {
    /// Readings of a pose [x y z θx θy θz] from rest (m, rad), m. `series` must hold for its angles.
    #[inline]
    #[must_use]
    pub fn readings(&self, series: &Series<'_, T>, pose: &[T; 6]) -> [T; 6] {
        let [x, y, z, tilt_x, tilt_y, tilt_z] = *pose;
        let turn = series.attitude([tilt_x, tilt_y, tilt_z]).rotation_less_identity();
        each(|k| {
            let normal = &self.normal[k];
            let turned = [dot3(&turn[0], normal), dot3(&turn[1], normal), dot3(&turn[2], normal)];
            let moved = (normal[0] + turned[0]) * x + (normal[1] + turned[1]) * y + (normal[2] + turned[2]) * z;
            (moved - dot3(&turned, &self.pierced[k])) / (T::ONE + dot3(&turned, &self.direction[k]))
        })
    }

    /// The pose [x y z θx θy θz] from rest (m, rad) at which the gauges read `readings` (m).
    ///
    /// The number of passes makes it exact over the declared workspace. It is finite for every reading that the gauges
    /// can give.
    #[inline]
    #[must_use]
    pub fn pose(&self, readings: &[T; 6]) -> [T; 6] {
        let guess = self.guess(readings);
        self.pose_from(readings, &guess, [guess[3], guess[4], guess[5]])
    }

    /// J⁻¹ of `readings` (m): [u; ψ] without the terms of second degree, m and 1.
    #[inline]
    #[must_use]
    pub fn guess(&self, readings: &[T; 6]) -> [T; 6] {
        each(|row| dot6(&self.inverse[row], readings))
    }

    /// A pass: a better ψ from this one, for `guess` of `readings` (m).
    #[inline]
    #[must_use]
    pub fn next_turn(&self, readings: &[T; 6], guess: &[T; 6], psi: &[T; 3]) -> [T; 3] {
        let terms = self.terms(readings, psi);
        [self.row(3, guess, &terms), self.row(4, guess, &terms), self.row(5, guess, &terms)]
    }

    /// The pose for `guess` of `readings` (m), after all passes from ψ.
    #[inline]
    #[must_use]
    pub fn pose_from(&self, readings: &[T; 6], guess: &[T; 6], mut psi: [T; 3]) -> [T; 6] {
        for _ in 1..self.passes {
            psi = self.next_turn(readings, guess, &psi);
        }
        let terms = self.terms(readings, &psi);
        let [x, y, z, a, b, c] = each(|row| self.row(row, guess, &terms));
        self.coordinates([x, y, z], [a, b, c])
    }

    /// The terms of second degree and above, for the rotation ψ.
    #[inline]
    fn terms(&self, readings: &[T; 6], psi: &[T; 3]) -> Terms<T> {
        let [a, b, c] = *psi;
        let products = [a * a, b * b, c * c, a * b, a * c, b * c];
        let quarter = T::HALF * T::HALF;
        Terms {
            products,
            scale: T::ONE - quarter * (products[0] + products[1] + products[2]),
            oblique: each(|k| {
                let along = T::HALF * dot3(&self.normal[k], psi) * dot3(&self.direction[k], psi);
                readings[k] * plus3(along, &self.skew[k], psi)
            }),
        }
    }

    /// One coordinate of [u; ψ].
    #[inline]
    fn row(&self, row: usize, guess: &[T; 6], terms: &Terms<T>) -> T {
        let curved = plus6(guess[row] * terms.scale, &self.curvature[row], &terms.products);
        plus6(curved, &self.inverse[row], &terms.oblique)
    }

    /// [u; ψ] to [t; θ].
    #[inline]
    fn coordinates(&self, u: [T; 3], psi: [T; 3]) -> [T; 6] {
        let [a, b, c] = psi;
        let quarter = T::HALF * T::HALF;
        let (aa, bb, cc) = (quarter * (a * a), quarter * (b * b), quarter * (c * c));
        let inverse = T::ONE / (T::ONE + (aa + bb + cc));
        // t = R u/D.
        let moved = [u[0] * inverse, u[1] * inverse, u[2] * inverse];
        let once = cross(&psi, &moved);
        let twice = cross(&psi, &once);
        let turned = |k: usize| moved[k] + inverse * (once[k] + T::HALF * twice[k]);
        // tan θx = r21/r22, sin θy = −r20, tan θz = r10/r00, each times D.
        let tangent_x = (a + T::HALF * (b * c)) / (T::ONE + (cc - aa - bb));
        let sine_y = (b - T::HALF * (a * c)) * inverse;
        let tangent_z = (c + T::HALF * (a * b)) / (T::ONE + (aa - bb - cc));
        [
            turned(0),
            turned(1),
            turned(2),
            odd_series(self.arc_tangent, tangent_x),
            odd_series(self.arc_sine, sine_y),
            odd_series(self.arc_tangent, tangent_z),
        ]
    }
}

/// The right side of the equations, without the readings themselves.
struct Terms<T> {
    /// ψx², ψy², ψz², ψxψy, ψxψz, ψyψz.
    products: [T; 6],
    /// 1 − ¼|ψ|².
    scale: T,
    /// y [(m × n)·ψ + ½ (m·ψ)(n·ψ)] of each gauge, m.
    oblique: [T; 6],
}

/// Raw gauge words to readings: a polynomial of the raw value for each gauge, lowest power first.
#[derive(Debug, Clone, Copy)]
pub struct Calibration<T, const N: usize> {
    /// m, m per unit, m per unit², …
    pub coefficients: [[T; N]; 6],
}

/// Meaning of the gauges' words.
pub trait GaugeCalibration<T: Real> {
    /// Readings, m, of words.
    #[must_use]
    fn readings(&self, raw: &[T; 6]) -> [T; 6];
}

impl<T: Real, const N: usize> GaugeCalibration<T> for Calibration<T, N> {
    #[inline]
    fn readings(&self, raw: &[T; 6]) -> [T; 6] {
        each(|k| match horner(&self.coefficients[k], raw[k]) {
            Some(reading) => reading,
            None => T::ZERO,
        })
    }
}

/// From the code of a gauge's converter to the number that the controller takes.
#[derive(Debug, Clone, Copy)]
pub struct GaugeConverter<T> {
    /// The number at code 0, m or V.
    pub at_zero: T,
    /// Step of a code.
    pub per_code: T,
    /// Highest code, 2^bits − 1.
    pub highest: i32,
    /// Numbers below and above every permitted reading: the reading of a converter at its end.
    pub beyond: [T; 2],
}

impl<T: Real> GaugeConverter<T> {
    /// The number for a code. At its lowest or highest code a converter shows only that the signal is there or beyond,
    /// as with a broken line. The code then gives a number that counts as a gauge fault.
    #[inline]
    #[must_use]
    pub fn reading(&self, code: i32) -> T {
        if code <= 0 {
            self.beyond[0]
        } else if code >= self.highest {
            self.beyond[1]
        } else {
            self.at_zero + T::from_i32(code) * self.per_code
        }
    }
}

/// Gauges whose raw value is not finite or not within its limits: bit k for gauge k.
#[inline]
#[must_use]
pub fn faults<T: Real>(raw: &[T; 6], limits: &[[T; 2]; 6]) -> u32 {
    let mut bits = 0;
    for (k, (value, [low, high])) in raw.iter().zip(limits).enumerate() {
        // Written so that a NaN is a fault.
        let good = *value >= *low && *value <= *high;
        bits |= u32::from(!good) << k;
    }
    bits
}

/// sum + constant·x; a constant zero has no term.
#[inline(always)]
fn plus<T: Real>(sum: T, constant: T, x: T) -> T {
    if constant == T::ZERO { sum } else { sum + constant * x }
}

#[inline(always)]
fn plus3<T: Real>(sum: T, c: &[T; 3], x: &[T; 3]) -> T {
    plus(plus(plus(sum, c[0], x[0]), c[1], x[1]), c[2], x[2])
}

#[inline(always)]
fn plus6<T: Real>(sum: T, c: &[T; 6], x: &[T; 6]) -> T {
    let half = plus(plus(plus(sum, c[0], x[0]), c[1], x[1]), c[2], x[2]);
    plus(plus(plus(half, c[3], x[3]), c[4], x[4]), c[5], x[5])
}

/// c·x from the left. The sum starts with −0, which leaves its first term unchanged.
#[inline(always)]
fn dot3<T: Real>(c: &[T; 3], x: &[T; 3]) -> T {
    plus3(-T::ZERO, c, x)
}

#[inline(always)]
fn dot6<T: Real>(c: &[T; 6], x: &[T; 6]) -> T {
    plus6(-T::ZERO, c, x)
}

#[inline(always)]
fn cross<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
