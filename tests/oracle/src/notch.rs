//! Modal notch: six biquads in modal coordinates.

use super::linear::{Matrix, Vector};

/// (s² + 2ζω s + ω²)/(s² + 2ζ_d ω s + ω²) by the bilinear transform, exact at ω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
}

impl Biquad {
    pub(super) fn notch(frequency: f64, damping: f64, notch_damping: f64, period: f64) -> Self {
        // s → c (z − 1)/(z + 1) with c = ω / tan(ωT/2).
        let c = frequency / libm::tan(0.5 * frequency * period);
        let (squares, linear) = (c * c + frequency * frequency, 2.0 * frequency * c);
        let cross = 2.0 * (frequency * frequency - c * c);
        let a0 = squares + notch_damping * linear;
        Self {
            b: [(squares + damping * linear) / a0, cross / a0, (squares - damping * linear) / a0],
            a: [cross / a0, (squares - notch_damping * linear) / a0],
        }
    }
}

/// The notch of a platform: V from K v = ω² M v, biquads on V⁻¹ of a pose error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Notch {
    to_modal: Matrix,
    from_modal: Matrix,
    sections: Vec<Biquad>,
}

/// Two delays of each section, transposed direct form II.
pub(super) type NotchState = [[f64; 2]; 6];

impl Notch {
    /// `damping` is ζ of the lowest mode; that of other modes is proportional to frequency.
    pub(super) fn new(
        (frequencies, shapes): (&[f64; 6], &Matrix),
        damping: f64,
        notch_damping: f64,
        period: f64,
    ) -> Option<Self> {
        let sections = frequencies
            .iter()
            .map(|w| Biquad::notch(*w, damping * w / frequencies[0], notch_damping, period))
            .collect();
        Some(Self { to_modal: shapes.try_inverse()?, from_modal: *shapes, sections })
    }

    /// Filters one pose error.
    pub(super) fn filter(&self, state: &mut NotchState, error: &Vector) -> Vector {
        let mut modal = self.to_modal * error;
        for ((x, section), delays) in modal.iter_mut().zip(&self.sections).zip(state) {
            let y = section.b[0] * *x + delays[0];
            delays[0] = section.b[1] * *x - section.a[0] * y + delays[1];
            delays[1] = section.b[2] * *x - section.a[1] * y;
            *x = y;
        }
        self.from_modal * modal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_passes_and_the_notched_frequency_is_weakened_by_the_ratio_of_dampings() {
        let (frequency, period) = (2270.0, 1e-4);
        let notch =
            Notch::new((&[frequency; 6], &Matrix::from_diagonal_element(2.0)), 0.02, 1.0, period).expect("invertible");
        let mut state = NotchState::default();
        let mut last = Vector::zeros();
        for _ in 0..2000 {
            last = notch.filter(&mut state, &Vector::repeat(3.0));
        }
        assert!((last - Vector::repeat(3.0)).norm() < 1e-9);
        let mut state = NotchState::default();
        let mut peak = 0.0_f64;
        for n in 0..4000 {
            let out = notch.filter(&mut state, &Vector::repeat(libm::sin(frequency * period * f64::from(n))));
            if n > 2000 {
                peak = peak.max(out[2].abs());
            }
        }
        assert!((peak - 0.02).abs() < 1e-3, "{peak}");
    }
}
