//! The modal notch: six biquads in modal coordinates, on feedback only.

use core::f64::consts::PI;

use serde::Serialize;

use super::modes::ModalBasis;
use specgen_numerics::Matrix6;

/// A mode above this share of half the tick rate gets no section, because it is nearly aliased.
const HIGHEST: f64 = 0.9;

/// y = b0 x + s1 ; s1 ← b1 x − a1 y + s2 ; s2 ← b2 x − a2 y.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Biquad {
    /// b0, b1, b2.
    pub b: [f64; 3],
    /// a1, a2; a0 is 1.
    pub a: [f64; 2],
}

impl Biquad {
    /// The identity.
    pub const IDENTITY: Self = Self { b: [1.0, 0.0, 0.0], a: [0.0, 0.0] };

    /// (s² + 2 ζ ω s + ω²) / (s² + 2 ζ_d ω s + ω²), bilinear with the mode itself prewarped; `frequency` in rad/s below π/T.
    pub fn notch(frequency: f64, damping_ratio: f64, notch_damping: f64, period: f64) -> Self {
        let t = libm::tan(0.5 * frequency * period);
        let square = t * t;
        let scale = 1.0 / (1.0 + 2.0 * notch_damping * t + square);
        let middle = 2.0 * (square - 1.0) * scale;
        Self {
            b: [
                (1.0 + 2.0 * damping_ratio * t + square) * scale,
                middle,
                (1.0 - 2.0 * damping_ratio * t + square) * scale,
            ],
            a: [middle, (1.0 - 2.0 * notch_damping * t + square) * scale],
        }
    }
}

/// The notch V · six sections · V⁻¹.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Notch {
    /// V⁻¹: pose coordinates (m, rad) → modal.
    pub to_modal: Matrix6,
    /// V: modal → pose coordinates.
    pub from_modal: Matrix6,
    /// One section a mode, in the order of the modes.
    pub sections: [Biquad; 6],
}

impl Notch {
    /// `damping`: ζ of each mode; `notch_damping`: the one that its notch gives to it.
    pub(super) fn of(basis: &ModalBasis, damping: &[f64; 6], notch_damping: &[f64; 6], period: f64) -> Self {
        Self {
            to_modal: basis.to_modal,
            from_modal: basis.from_modal,
            sections: core::array::from_fn(|i| {
                let frequency = basis.frequencies[i];
                if in_reach(frequency, period) {
                    Biquad::notch(frequency, damping[i], notch_damping[i], period)
                } else {
                    Biquad::IDENTITY
                }
            }),
        }
    }
}

/// Whether a notch at `frequency` (rad/s) can be sampled.
pub(super) fn in_reach(frequency: f64, period: f64) -> bool {
    frequency * period < HIGHEST * PI
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |H| at ω rad/s.
    fn gain(section: &Biquad, frequency: f64, period: f64) -> f64 {
        let at = |c: &[f64]| {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, x) in c.iter().enumerate() {
                let angle = -frequency * period * k as f64;
                re += x * libm::cos(angle);
                im += x * libm::sin(angle);
            }
            libm::hypot(re, im)
        };
        at(&section.b) / at(&[1.0, section.a[0], section.a[1]])
    }

    #[test]
    fn a_section_passes_slow_and_fast_and_cuts_its_mode_to_the_ratio_of_dampings() {
        let period = 1e-4;
        for (frequency, ratio, notch) in [(2268.0, 0.02, 1.0), (5000.0, 0.044, 0.5), (27000.0, 0.1, 0.7)] {
            let section = Biquad::notch(frequency, ratio, notch, period);
            assert!((gain(&section, 0.0, period) - 1.0).abs() < 1e-12);
            assert!((gain(&section, PI / period, period) - 1.0).abs() < 1e-9);
            assert!((gain(&section, frequency, period) - ratio / notch).abs() < 1e-9, "{frequency}");
        }
    }
}
