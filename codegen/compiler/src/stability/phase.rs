//! Phase margin of a loop given by its transition from tick to tick.

use core::f64::consts::PI;

use specgen_numerics::{Matrix, eigenvalues};

/// Steps of the scan over half a turn, and bisections of the interval that contains the margin.
const STEPS: u32 = 90;
const BISECTIONS: u32 = 12;

/// Phase lag, rad, added to all inputs of the plant at once, at which a stable loop becomes unstable; none if there is none up to
/// half a turn, or if the loop is unstable without it.
///
/// `transition` gives the matrix of one tick with the plant's inputs times a factor, in which it is affine. With the factor
/// e^(−jφ) it is complex, A − jB; its eigenvalues and their conjugates are those of [A B; −B A].
pub fn phase_margin(transition: impl Fn(f64) -> Matrix) -> Option<f64> {
    let (open, closed) = (transition(0.0), transition(1.0));
    let n = open.size();
    let stable = |phase: f64| {
        let (sin, cos) = libm::sincos(phase);
        let mut both = Matrix::zeros(2 * n);
        for i in 0..n {
            for j in 0..n {
                let input = closed[(i, j)] - open[(i, j)];
                let (re, im) = (open[(i, j)] + cos * input, -sin * input);
                both[(i, j)] = re;
                both[(n + i, n + j)] = re;
                both[(i, n + j)] = -im;
                both[(n + i, j)] = im;
            }
        }
        eigenvalues(&both).is_some_and(|values| values.iter().all(|(re, im)| libm::hypot(*re, *im) <= 1.0))
    };
    if !stable(0.0) {
        return None;
    }
    let at = |step: u32| PI * f64::from(step) / f64::from(STEPS);
    let first = (1..=STEPS).find(|step| !stable(at(*step)))?;
    let (mut low, mut high) = (at(first - 1), at(first));
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if stable(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_integrator_has_the_margin_that_its_frequency_response_says() {
        // y ← y + k u, u = −y: L = k/(z − 1). |L| = 1 where 2 sin(θ/2) = k, and its phase there is −(90° + θ/2).
        for gain in [0.1, 0.5, 1.0, 1.5] {
            let found = phase_margin(|factor| {
                let mut matrix = Matrix::identity(1);
                matrix[(0, 0)] -= factor * gain;
                matrix
            });
            let theta = 2.0 * libm::asin(0.5 * gain);
            let expected = 0.5 * PI - 0.5 * theta;
            assert!((found.unwrap() - expected).abs() < 1e-4, "{gain}: {found:?} {expected}");
        }
        // Unstable without any lag.
        assert_eq!(phase_margin(|factor| Matrix::identity(1).scaled(1.0 - 2.5 * factor)), None);
    }
}
