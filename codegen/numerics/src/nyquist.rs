//! A single loop in the frequency domain.

/// Re and Im.
pub type Complex = [f64; 2];

/// a b.
#[inline]
#[must_use]
pub fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// a + b.
#[inline]
#[must_use]
pub fn plus(a: Complex, b: Complex) -> Complex {
    [a[0] + b[0], a[1] + b[1]]
}

/// a/b.
#[inline]
#[must_use]
pub fn over(a: Complex, b: Complex) -> Complex {
    let norm = b[0] * b[0] + b[1] * b[1];
    [(a[0] * b[0] + a[1] * b[1]) / norm, (a[1] * b[0] - a[0] * b[1]) / norm]
}

/// |a|².
#[inline]
#[must_use]
pub fn square(a: Complex) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

/// |S|² at each frequency, S = 1/(1 + P C), to `seen`; whether the closed loop is stable by Nyquist's criterion.
///
/// The responses are those of plant and controller at rising frequencies from near 0 to half the sampling rate, so
/// close together that the phase changes by less than half a turn between neighbours. P is stable; C is stable apart
/// from integrators: `controller` is C times (1 − z⁻¹) for each of them, and `cancelled` that factor. Then (1 − z⁻¹)ⁿ
/// (1 + P C) has no pole outside the unit circle, and begins and ends on the positive real axis. Its number of zeros
/// outside is the number of upward crossings of the negative real axis less that of downward ones.
pub fn sensitivity(
    plant: &[Complex],
    controller: &[Complex],
    cancelled: &[Complex],
    mut seen: impl FnMut(usize, f64),
) -> bool {
    let mut last = [1.0, 0.0];
    let mut turns = 0;
    for (k, ((p, c), one)) in plant.iter().zip(controller).zip(cancelled).enumerate() {
        let value = plus(*one, times(*p, *c));
        seen(k, square(*one) / square(value));
        if (last[1] < 0.0) != (value[1] < 0.0) {
            // The intersection of the step with the real axis.
            let crossing = last[0] * value[1] - value[0] * last[1];
            let upwards = last[1] < 0.0;
            if (crossing < 0.0) == upwards {
                turns += if upwards { 1 } else { -1 };
            }
        }
        last = value;
    }
    turns == 0 && last[0] > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    /// L = k z⁻¹/(1 − p z⁻¹) is stable for −(1 + p) < −k < 1 − p … |p − k| < 1; an integrator for 0 < k < 2.
    #[test]
    fn a_loop_is_stable_where_its_pole_is_within_the_unit_circle() {
        for (pole, integrators) in [(0.5, 0), (1.0, 1)] {
            for step in 1..40 {
                let gain = 0.07 * f64::from(step);
                let angles: Vec<f64> = (1..=4000).map(|k| PI * f64::from(k) / 4000.0).collect();
                let delay: Vec<Complex> = angles.iter().map(|w| [libm::cos(*w), -libm::sin(*w)]).collect();
                let cancelled: Vec<Complex> =
                    delay.iter().map(|q| if integrators == 1 { [1.0 - q[0], -q[1]] } else { [1.0, 0.0] }).collect();
                let plant: Vec<Complex> = delay
                    .iter()
                    .map(|q| if integrators == 1 { *q } else { over(*q, [1.0 - pole * q[0], -pole * q[1]]) })
                    .collect();
                let controller = vec![[gain, 0.0]; delay.len()];
                let mut largest = 0.0;
                let stable = sensitivity(&plant, &controller, &cancelled, |_, s| {
                    if s > largest {
                        largest = s;
                    }
                });
                assert_eq!(stable, (pole - gain).abs() < 1.0, "pole {pole}, gain {gain}");
                if stable && integrators == 1 && gain > 0.5 {
                    // Largest at half the rate: 1/(1 + k (−1)/(1 + 1)).
                    let expected = 1.0 / (1.0 - 0.5 * gain);
                    assert!((libm::sqrt(largest) - expected).abs() < 1e-3 * expected, "{gain}");
                }
            }
        }
    }
}
