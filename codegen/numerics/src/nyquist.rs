//! A single loop in the frequency domain.

/// Re and Im.
pub type Complex = [f64; 2];

/// a b.
#[inline]
pub fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// a + b.
#[inline]
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
pub fn square(a: Complex) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

/// |S|² at each frequency, S = 1/(1 + P C), to `seen` as numerator and denominator; whether the closed loop is stable by Nyquist's criterion.
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
    mut seen: impl FnMut(usize, [f64; 2]),
) -> bool {
    let mut last = [1.0, 0.0];
    let mut turns = 0;
    for (k, ((p, c), one)) in plant.iter().zip(controller).zip(cancelled).enumerate() {
        let value = plus(*one, times(*p, *c));
        seen(k, [square(*one), square(value)]);
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

/// Where a structural mode acts on a loop.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Flexure {
    /// In series with the actuator: factor H = 1/(1 − r² + 2jζr), r = f/f_n.
    Series,
    /// On the sensor, with this participation a: factor 1 + a r² H.
    Sensor(f64),
}

impl Flexure {
    /// The factor at `ratio` r.
    #[inline]
    pub fn factor(self, ratio: f64, damping_ratio: f64) -> Complex {
        let below = [1.0 - ratio * ratio, 2.0 * damping_ratio * ratio];
        match self {
            Self::Series => over([1.0, 0.0], below),
            Self::Sensor(share) => plus([1.0, 0.0], over([share * ratio * ratio, 0.0], below)),
        }
    }

    /// f_n/f and ζ of the mode with which 1 + L·factor = δ at frequency f, for a loop L without the mode; none if there is no
    /// such mode. δ = 0 gives the border of stability: below that ζ the loop with the mode is unstable.
    ///
    /// ```text
    /// series   L' = L/(1 − δ)       f_n = f/√(1 + Re L')       ζ = −Im L'/(2 √(1 + Re L'))
    /// sensor   T' = L/(1 + L − δ)   f_n = f √(1 − a Re T')     ζ = −a Im T'/(2 √(1 − a Re T'))
    /// ```
    #[inline]
    pub fn border(self, loop_gain: Complex, distance: Complex) -> Option<[f64; 2]> {
        let (square, imaginary) = match self {
            Self::Series => {
                let [re, im] = over(loop_gain, [1.0 - distance[0], -distance[1]]);
                (1.0 + re, im)
            }
            Self::Sensor(share) => {
                let below = [1.0 + loop_gain[0] - distance[0], loop_gain[1] - distance[1]];
                let [re, im] = over(loop_gain, below);
                (1.0 - share * re, share * im)
            }
        };
        let root = libm::sqrt(square);
        let ratio = match self {
            Self::Series => 1.0 / root,
            Self::Sensor(_) => root,
        };
        (square > 0.0).then_some([ratio, -0.5 * imaginary / root])
    }

    /// Whether [`Flexure::border`] may give f_n/f above `least[0]` and ζ above `least[1]`, both from 0 on: false only where it certainly
    /// does not. It needs no division and no root.
    #[inline]
    pub fn may_exceed(self, loop_gain: Complex, distance: Complex, least: [f64; 2]) -> bool {
        // The numbers of `border` times the denominator d = |…|²: d·square and d·imaginary.
        let (below, share) = match self {
            Self::Series => ([1.0 - distance[0], -distance[1]], 1.0),
            Self::Sensor(share) => ([1.0 + loop_gain[0] - distance[0], loop_gain[1] - distance[1]], share),
        };
        let imaginary = share * (loop_gain[1] * below[0] - loop_gain[0] * below[1]);
        if imaginary >= 0.0 {
            return false;
        }
        let real = share * (loop_gain[0] * below[0] + loop_gain[1] * below[1]);
        let norm = square(below);
        let [frequency, damping] = least.map(|value| value * value * (1.0 - Self::SLACK));
        let (root, far_enough) = match self {
            Self::Series => (norm + real, norm >= frequency * (norm + real - Self::SLACK * norm)),
            Self::Sensor(_) => (norm - real, norm * (1.0 + Self::SLACK) - real >= frequency * norm),
        };
        let smallest = 4.0 * damping * (root - Self::SLACK * norm) * norm;
        far_enough && imaginary * imaginary * (1.0 + Self::SLACK) >= smallest
    }

    /// Whether [`Flexure::may_exceed`] may hold for any δ with |δ| = `distance` < 1: L' and T' are then on a circle. False only where it
    /// certainly holds for none of them.
    #[inline]
    pub fn may_exceed_about(self, loop_gain: Complex, distance: f64, least: [f64; 2]) -> bool {
        // −L' or a T' on the circle.
        let (from_one, norm, share) = match self {
            Self::Series => ([1.0, 0.0], 1.0 - distance * distance, -1.0),
            Self::Sensor(share) => {
                let from_one = [1.0 + loop_gain[0], loop_gain[1]];
                (from_one, square(from_one) - distance * distance, share)
            }
        };
        // Otherwise δ passes about the pole.
        if norm <= Self::SLACK {
            return true;
        }
        let [re, im] = over(loop_gain, from_one).map(|part| share * part * (square(from_one) / norm));
        let radius = share.abs() * distance * libm::sqrt(square(loop_gain)) / norm * (1.0 + Self::SLACK) + Self::SLACK;
        let [smallest, largest] = [1.0 - re - radius, 1.0 - re + radius];
        let (far_enough, imaginary) = match self {
            Self::Series => (smallest * least[0] * least[0] <= 1.0, im + radius),
            Self::Sensor(_) => (largest >= least[0] * least[0], radius - im),
        };
        let smallest = if smallest > 0.0 { smallest } else { 0.0 };
        far_enough && imaginary > 0.0 && imaginary * imaginary >= 4.0 * least[1] * least[1] * smallest
    }

    /// Relative, far above the rounding errors of [`Flexure::border`].
    const SLACK: f64 = 1e-9;
}

/// A range of structural modes, any single one of which a loop may have.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexureRange {
    /// Lowest f_n, in the unit of the loop's frequencies.
    pub from: f64,
    /// Highest f_n; infinite if not given.
    pub to: f64,
    /// Least ζ.
    pub damping_ratio: f64,
    /// Where a mode may act.
    pub flexures: Vec<Flexure>,
    /// Least |1 + L·factor|, and points on its circle.
    distance: f64,
    distances: Vec<Complex>,
}

impl FlexureRange {
    /// Number of points on the circle.
    const POINTS: u32 = 12;
    /// Weight of a share of f_n against one of ζ in a depth.
    const STEEP: f64 = 40.0;

    /// The range of modes with which |1 + L·factor| must be at least `distance` everywhere.
    pub fn new(from: f64, damping_ratio: f64, flexures: Vec<Flexure>, distance: f64) -> Self {
        let point = |k: u32| {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(k) / f64::from(Self::POINTS));
            [distance * cos, distance * sin]
        };
        let points = if distance > 0.0 { Self::POINTS } else { 1 };
        let distances = (0..points).map(point).collect();
        Self { from, to: f64::INFINITY, damping_ratio, flexures, distance, distances }
    }

    /// How far a mode within the range would have to change until |1 + L·factor| is no longer below the distance at this frequency:
    /// zero if no mode does that, else the smaller of ln(ζ/ζ of the range) and a multiple of ln(f_n/from), as a penalty. `depth` becomes
    /// this if it is larger.
    fn deepen(&self, loop_gain: Complex, frequency: f64, depth: &mut Depth) {
        let relative = self.from / frequency;
        let least = |depth: &Depth| [relative * depth.factors[0], self.damping_ratio * depth.factors[1]];
        for flexure in &self.flexures {
            if self.distance > 0.0 && !flexure.may_exceed_about(loop_gain, self.distance, least(depth)) {
                continue;
            }
            for distance in &self.distances {
                if !flexure.may_exceed(loop_gain, *distance, least(depth)) {
                    continue;
                }
                let Some([ratio, damping]) = flexure.border(loop_gain, *distance) else { continue };
                if ratio * frequency <= self.from || ratio * frequency >= self.to || damping <= self.damping_ratio {
                    continue;
                }
                let above = Self::STEEP * libm::log(ratio * frequency / self.from);
                let below = Self::STEEP * libm::log(self.to / (ratio * frequency));
                let above = if below < above { below } else { above };
                let damped = libm::log(damping / self.damping_ratio);
                let found = if above < damped { above } else { damped };
                if found > depth.most {
                    *depth = Depth { most: found, factors: [libm::exp(found / Self::STEEP), libm::exp(found)] };
                }
            }
        }
    }
}

/// The largest [`FlexureRange::deepen`] so far.
struct Depth {
    most: f64,
    /// f_n over the lowest and ζ over the least of the range, above both of which a mode is deeper.
    factors: [f64; 2],
}

/// What a loop tolerates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Whether it is stable.
    pub stable: bool,
    /// Largest |S|.
    pub sensitivity: f64,
    /// Largest depth of its border in the range of structural modes.
    pub depth: f64,
}

/// Stability and largest |S| of a loop, as in [`sensitivity`], and the largest depth of its border over `frequencies`; `gain` is
/// `controller` over `cancelled`.
pub fn tolerance(
    plant: &[Complex],
    controller: &[Complex],
    cancelled: &[Complex],
    gain: &[Complex],
    frequencies: &[f64],
    range: Option<&FlexureRange>,
) -> Tolerance {
    // The largest |S|² as numerator and denominator, which saves a division at each frequency.
    let (mut most, mut depth) = ([0.0, 1.0], Depth { most: 0.0, factors: [1.0; 2] });
    let stable = sensitivity(plant, controller, cancelled, |k, s| {
        if s[0] * most[1] > most[0] * s[1] {
            most = s;
        }
        let Some(range) = range else { return };
        // Below a quarter of the lowest mode |L| would have to be within a sixteenth of 1.
        if frequencies[k] > 0.25 * range.from {
            range.deepen(times(plant[k], gain[k]), frequencies[k], &mut depth);
        }
    });
    Tolerance { stable, sensitivity: libm::sqrt(most[0] / most[1]), depth: depth.most }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    /// The mode that `border` gives is put back into the loop.
    #[test]
    fn a_loop_with_the_mode_of_the_border_is_at_the_given_distance_from_oscillation() {
        let mut found = 0;
        for flexure in [Flexure::Series, Flexure::Sensor(0.5), Flexure::Sensor(-0.1)] {
            for k in 0..60_u32 {
                let (size, angle) = (0.05 * f64::from(1 + k % 12), 0.4 * f64::from(k));
                let loop_gain = [size * libm::cos(angle), size * libm::sin(angle)];
                for distance in [[0.0, 0.0], [0.4, 0.0], [-0.1, 0.3]] {
                    let Some([frequency, damping]) = flexure.border(loop_gain, distance) else { continue };
                    found += 1;
                    let value = plus([1.0, 0.0], times(loop_gain, flexure.factor(1.0 / frequency, damping)));
                    let left = [value[0] - distance[0], value[1] - distance[1]];
                    assert!(square(left) < 1e-20, "{flexure:?} {loop_gain:?} {distance:?}: {value:?}");
                }
            }
        }
        assert!(found > 300, "{found}");
    }

    /// What is settled without a division is what the border settles.
    #[test]
    fn a_mode_that_needs_more_damping_is_never_passed_over() {
        let (mut exceeding, mut settled) = (0, 0);
        for flexure in [Flexure::Series, Flexure::Sensor(0.5), Flexure::Sensor(-0.1), Flexure::Sensor(3.0)] {
            for k in 0..4000_u32 {
                let (size, angle) = (libm::exp(0.02 * f64::from(k % 400) - 6.0), 0.7 * f64::from(k));
                let loop_gain = [size * libm::cos(angle), size * libm::sin(angle)];
                for distance in [[0.0, 0.0], [0.4, 0.0], [-0.1, 0.3]] {
                    let exact = flexure.border(loop_gain, distance);
                    let [ratio, damping] = exact.unwrap_or([0.0; 2]);
                    let close = 1.0 - 1e-14;
                    for least in [[0.0, 0.0], [0.8, 0.01], [1.2, 0.0], [0.0, 0.1], [close * ratio, close * damping]] {
                        let least = least.map(|value| if value > 0.0 { value } else { 0.0 });
                        let may = flexure.may_exceed(loop_gain, distance, least);
                        if exact.is_some() && ratio > least[0] && damping > least[1] {
                            exceeding += 1;
                            assert!(may, "{flexure:?} {loop_gain:?} {distance:?} {least:?}: {exact:?}");
                        }
                        settled += u32::from(!may);
                    }
                }
            }
        }
        assert!(exceeding > 30_000 && settled > 100_000, "{exceeding} {settled}");
    }

    /// The circle settles nothing that one of its points does not.
    #[test]
    fn a_distance_of_a_circle_is_never_passed_over() {
        let (mut exceeding, mut settled) = (0, 0);
        for flexure in [Flexure::Series, Flexure::Sensor(0.5), Flexure::Sensor(-0.1), Flexure::Sensor(3.0)] {
            for k in 0..4000_u32 {
                let (size, angle) = (libm::exp(0.02 * f64::from(k % 400) - 6.0), 0.7 * f64::from(k));
                let loop_gain = [size * libm::cos(angle), size * libm::sin(angle)];
                for radius in [0.1, 0.4] {
                    for least in [[0.0, 0.0], [0.8, 0.01], [1.2, 0.01], [0.9, 0.1]] {
                        let may = flexure.may_exceed_about(loop_gain, radius, least);
                        let exceeds = (0..24).any(|point| {
                            let angle = core::f64::consts::TAU * f64::from(point) / 24.0;
                            let distance = [radius * libm::cos(angle), radius * libm::sin(angle)];
                            let border = flexure.border(loop_gain, distance);
                            border.is_some_and(|[ratio, damping]| ratio > least[0] && damping > least[1])
                        });
                        exceeding += u32::from(exceeds);
                        assert!(may || !exceeds, "{flexure:?} {loop_gain:?} {radius} {least:?}");
                        settled += u32::from(!may);
                    }
                }
            }
        }
        assert!(exceeding > 20_000 && settled > 30_000, "{exceeding} {settled}");
    }

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
                let stable = sensitivity(&plant, &controller, &cancelled, |_, [above, below]| {
                    if above / below > largest {
                        largest = above / below;
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
