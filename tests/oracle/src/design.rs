//! Gains by rule from nominal data: the sampled linear loop of a platform and its spectral radius.
//!
//! One tick of the loop is written as a program on numbers. Its matrix is the result of the program for unit vectors.

use nalgebra::DMatrix;

use host_sim::platform::{Matrix6, PlatformParameters, Specimen, StructureParameters};

use super::linear::{Matrix, Vector, matrix, vector};
use super::notch::{Notch, NotchState};

/// Data for the design of a platform controller, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Joints, masses, nominal stiffness and damping of the legs.
    pub structure: StructureParameters,
    /// ζ of the lowest mode.
    pub modal_damping: f64,
    /// Amplifier lag, s.
    pub lag: f64,
    /// Control period, s.
    pub period: f64,
}

/// Gains of a loop as fractions of the stiffness K_ii of each axis, and bandwidths of the adaptation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// k_p / K.
    pub proportional: f64,
    /// k_I / K, 1/s.
    pub integral: f64,
    /// ω1/T, rad/s; 0: no adaptation.
    pub level: f64,
    /// ω2/T, rad/s; 0: EWMA.
    pub drift: f64,
}

impl Gains {
    /// All four times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            proportional: self.proportional * factor,
            integral: self.integral * factor,
            level: self.level * factor,
            drift: self.drift * factor,
        }
    }
}

/// Deviation of the real plant from the nominal one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// λ: displacement per requested displacement.
    pub gain: f64,
    /// Axial stiffness relative to nominal.
    pub stiffness: f64,
    /// Damping relative to nominal.
    pub damping: f64,
    /// Whole ticks of delay.
    pub delay: usize,
}

impl Deviation {
    /// The nominal plant.
    pub const NONE: Self = Self { gain: 1.0, stiffness: 1.0, damping: 1.0, delay: 0 };
}

/// The sampled loop around a plant.
struct SampledLoop {
    /// Amplifier, pose and rate over one tick from themselves and a held request.
    transition: Vec<Vec<f64>>,
    jacobian: Matrix,
    inverse_jacobian: Matrix,
    /// J⁻ᵀ diag(K_ii) / k_a: from fractions of K to leg displacement.
    per_axis: Matrix,
    notch: Option<Notch>,
    gains: Gains,
    period: f64,
    delay: usize,
}

/// Plant states: lag 6, pose 6, rate 6; delayed requests, 6 per tick, and the states of the controller follow.
const PHYSICAL: usize = 18;

impl SampledLoop {
    fn new(plant: &Plant, gains: Gains, notch: Option<Notch>, deviation: Deviation) -> Option<Self> {
        let mut real = plant.structure.clone();
        for k in &mut real.stiffness {
            *k *= deviation.stiffness;
        }
        // c = β k with β of the changed mode.
        for c in &mut real.damping {
            *c *= deviation.damping * libm::sqrt(deviation.stiffness);
        }
        let jacobian = matrix(&real.geometry.jacobian(&[0.0; 6]));
        let flexibility = matrix(&real.mass_matrix()).try_inverse()?;
        let legs = |values: &[f64; 6]| Matrix::from_diagonal(&vector(values));
        let push = flexibility * jacobian.transpose();
        let spring = push * legs(&real.stiffness) * jacobian;
        let damper = push * legs(&real.damping) * jacobian;
        let drive = push * legs(&real.stiffness) * deviation.gain;
        let mut rates = vec![vec![0.0; PHYSICAL + 6]; PHYSICAL + 6];
        // A lag far below the period is negligible; the bound keeps the exponential well scaled.
        let lag = plant.lag.max(1e-3 * plant.period);
        for row in 0..6 {
            rates[row][row] = -plant.period / lag;
            rates[row][PHYSICAL + row] = plant.period / lag;
            rates[6 + row][12 + row] = plant.period;
            for column in 0..6 {
                rates[12 + row][column] = plant.period * drive[(row, column)];
                rates[12 + row][6 + column] = -plant.period * spring[(row, column)];
                rates[12 + row][12 + column] = -plant.period * damper[(row, column)];
            }
        }
        let nominal = matrix(&plant.structure.stiffness_matrix());
        let axes = Matrix::from_diagonal(&nominal.diagonal());
        let compliance = legs(&plant.structure.stiffness.map(|k| 1.0 / k));
        let inverse_jacobian = jacobian.try_inverse()?;
        Some(Self {
            transition: host_sim::platform::exponential(&rates),
            jacobian,
            inverse_jacobian,
            per_axis: compliance * inverse_jacobian.transpose() * axes,
            notch,
            gains,
            period: plant.period,
            delay: deviation.delay,
        })
    }

    fn has_integral(&self) -> bool {
        self.gains.integral > 0.0
    }

    fn has_feedback(&self) -> bool {
        self.has_integral() || self.gains.proportional > 0.0
    }

    fn states(&self) -> usize {
        let notch = if self.notch.is_some() { 12 } else { 0 };
        let mut count = PHYSICAL + 6 * self.delay;
        if self.has_feedback() {
            count += notch + if self.has_integral() { 6 } else { 0 };
        }
        if self.gains.level > 0.0 {
            count += notch + 6 + if self.gains.drift > 0.0 { 6 } else { 0 };
            // The request of the last interval, for the innovation.
            count += 6;
        }
        count
    }

    /// One tick. Takes exactly the states of [`SampledLoop::states`], in the order in which they are read here.
    fn step(&self, state: &[f64]) -> Vec<f64> {
        let mut rest = state;
        let mut take = || {
            let (head, tail) = rest.split_at(6);
            rest = tail;
            Vector::from_column_slice(head)
        };
        let mut out = state[..PHYSICAL].to_vec();
        let (_, pose, _) = (take(), take(), take());
        let mut underway: Vec<Vector> = (0..self.delay).map(|_| take()).collect();
        let filter = |take: &mut dyn FnMut() -> Vector, error: Vector, kept: &mut Vec<f64>| match &self.notch {
            None => error,
            Some(notch) => {
                let (first, second) = (take(), take());
                let mut delays = NotchState::default();
                for k in 0..6 {
                    delays[k] = [first[k], second[k]];
                }
                let filtered = notch.filter(&mut delays, &error);
                kept.extend(delays.iter().map(|d| d[0]));
                kept.extend(delays.iter().map(|d| d[1]));
                filtered
            }
        };
        let mut controller = Vec::new();
        let mut request = Vector::zeros();
        if self.has_feedback() {
            let error = filter(&mut take, -pose, &mut controller);
            let mut effort = error * self.gains.proportional;
            if self.has_integral() {
                let sum = take() + error * (self.gains.integral * self.period);
                controller.extend(sum.iter());
                effort += sum;
            }
            request += self.per_axis * effort;
        }
        if self.gains.level > 0.0 {
            let (level_weight, drift_weight) = (self.gains.level * self.period, self.gains.drift * self.period);
            let (requested, level) = (take(), take());
            let drift = if self.gains.drift > 0.0 { take() } else { Vector::zeros() };
            let raw = self.inverse_jacobian * (self.jacobian * pose - requested - level - drift);
            let mut notched = Vec::new();
            let innovation = self.jacobian * filter(&mut take, raw, &mut notched);
            let level = level + (innovation + drift) * level_weight;
            let drift = drift + innovation * drift_weight;
            request -= level + drift;
            controller.extend(request.iter());
            controller.extend(level.iter());
            if self.gains.drift > 0.0 {
                controller.extend(drift.iter());
            }
            controller.extend(notched);
        }
        underway.push(request);
        let held = underway.remove(0);
        for (row, value) in out.iter_mut().enumerate() {
            *value = 0.0;
            for (column, x) in state[..PHYSICAL].iter().chain(held.iter()).enumerate() {
                *value += self.transition[row][column] * x;
            }
        }
        for vector in &underway {
            out.extend(vector.iter());
        }
        out.extend(controller);
        out
    }

    fn radius(&self) -> f64 {
        let count = self.states();
        let mut one = DMatrix::zeros(count, count);
        for column in 0..count {
            let mut unit = vec![0.0; count];
            unit[column] = 1.0;
            for (row, value) in self.step(&unit).iter().enumerate() {
                one[(row, column)] = *value;
            }
        }
        // Gelfand: |Aⁿ|^(1/n) with n = 2²⁴; unlike an iteration for eigenvalues it always terminates.
        const SQUARINGS: i32 = 24;
        let mut logarithm = 0.0;
        for _ in 0..SQUARINGS {
            let norm = one.norm();
            if !(norm > 0.0 && norm.is_finite()) {
                return if norm == 0.0 { 0.0 } else { f64::INFINITY };
            }
            one /= norm;
            logarithm = 2.0 * (logarithm + libm::log(norm));
            one = &one * &one;
        }
        libm::exp((logarithm + libm::log(one.norm())) * libm::exp2(f64::from(-SQUARINGS)))
    }
}

/// The largest number up to `bound` that is `good`, to 0.1 %, assuming that all smaller ones are good.
fn largest(bound: f64, good: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (1e-3, bound);
    while high / low > 1.001 {
        let middle = libm::sqrt(low * high);
        if good(middle) { low = middle } else { high = middle }
    }
    low
}

/// A nominal plant with its notch.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    plant: Plant,
    notch_damping: Option<f64>,
}

/// Result of the rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// Ω: largest bandwidth of EWMA alone with a radius below 1, rad/s.
    pub limit: f64,
    /// P/F.
    pub combined: Gains,
    /// P alone.
    pub position: Gains,
}

impl Rule {
    /// The design for a plant; `notch_damping` is ζ_d of the modal notch, if there is one.
    pub fn new(plant: Plant, notch_damping: Option<f64>) -> Self {
        Self { plant, notch_damping }
    }

    /// The design for the nominal data of a machine, its legs' lag and a control period (s).
    pub fn of(nominal: &PlatformParameters, lag: f64, period: f64, notch_damping: Option<f64>) -> Self {
        let leg = host_sim::plant::LegParameters::reference();
        let structure = Specimen::ideal(nominal, &leg).structure();
        Self::new(Plant { structure, modal_damping: nominal.modal_damping, lag, period }, notch_damping)
    }

    /// The nominal plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    fn notch(&self) -> Option<Notch> {
        let (frequencies, shapes): ([f64; 6], Matrix6) = self.plant.structure.modes();
        Notch::new((&frequencies, &matrix(&shapes)), self.plant.modal_damping, self.notch_damping?, self.plant.period)
    }

    /// Spectral radius of the loop with `gains` on a plant that deviates; infinite if the geometry is singular.
    pub fn radius(&self, gains: Gains, deviation: Deviation) -> f64 {
        SampledLoop::new(&self.plant, gains, self.notch(), deviation).map_or(f64::INFINITY, |loop_| loop_.radius())
    }

    /// Largest factor on `gains` for which the radius stays below 1, by bisection to 0.1 %.
    pub fn margin(&self, gains: Gains, deviation: Deviation) -> f64 {
        largest(2e4, |factor| self.radius(gains.scaled(factor), deviation) < 1.0)
    }

    /// Largest λ for which the radius stays below 1, by bisection to 0.1 %.
    pub fn gain_margin(&self, gains: Gains, deviation: Deviation) -> f64 {
        largest(100.0, |gain| self.radius(gains, Deviation { gain, ..deviation }) < 1.0)
    }

    /// The start rule of the study (`sixdof.md` §6).
    pub fn design(&self) -> Design {
        let alone = Gains { proportional: 0.0, integral: 0.0, level: 1.0, drift: 0.0 };
        let limit = self.margin(alone, Deviation::NONE);
        let proportional = if self.notch_damping.is_some() { 0.05 } else { 0.005 };
        let level = limit / 4.5;
        let combined = Gains { proportional, integral: limit / 12.0, level, drift: 0.044 * level };
        let position = Gains { proportional, integral: limit / 2.0, level: 0.0, drift: 0.0 };
        Design { limit, combined: self.shrunk(combined), position: self.shrunk(position) }
    }

    /// `gains`, reduced until they have the required margins.
    fn shrunk(&self, mut gains: Gains) -> Gains {
        const WEAK: Deviation = Deviation { damping: 0.7, ..Deviation::NONE };
        let cases = [
            Deviation { gain: 2.0, ..WEAK },
            Deviation { gain: 1.4, stiffness: 0.85, ..WEAK },
            Deviation { gain: 1.4, stiffness: 1.15, ..WEAK },
            Deviation { gain: 1.3, delay: 1, ..WEAK },
        ];
        for _ in 0..40 {
            if cases.iter().all(|case| self.radius(gains, *case) < 1.0) {
                break;
            }
            gains = gains.scaled(0.85);
        }
        gains
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(rate: f64, damping: f64, notch_damping: Option<f64>) -> Rule {
        let nominal = PlatformParameters { modal_damping: damping, ..PlatformParameters::reference() };
        Rule::of(&nominal, 0.35e-3, 1.0 / rate, notch_damping)
    }

    #[test]
    fn ewma_limits_are_those_of_the_study() {
        // `sixdof.md` §3, linear columns: weight per tick.
        let alone = Gains { proportional: 0.0, integral: 0.0, level: 1.0, drift: 0.0 };
        for (rate, damping, notch, expected) in [
            (1e3, 0.02, None, 0.1436),
            (10e3, 0.02, None, 0.0143),
            (10e3, 0.05, None, 0.034),
            (10e3, 0.02, Some(0.5), 0.169),
            (5e3, 0.02, Some(1.0), 0.428),
            (10e3, 0.02, Some(1.0), 0.215),
            (2e3, 0.02, Some(1.0), 1.03),
        ] {
            let found = rule(rate, damping, notch).margin(alone, Deviation::NONE) / rate;
            println!("{rate} Hz, ζ {damping}, notch {notch:?}: {found:.4}, study {expected}");
            assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
        }
        let pcc = Gains { drift: 0.044, ..alone };
        let found = rule(10e3, 0.02, None).margin(pcc, Deviation::NONE) / 10e3;
        assert!((found / 0.0137 - 1.0).abs() < 0.03, "{found}");
    }

    #[test]
    fn margins_of_the_hand_gains_are_those_of_the_study() {
        let rule = rule(10e3, 0.02, Some(1.0));
        let gains = Gains { proportional: 0.05, integral: 150.0, level: 450.0, drift: 19.6 };
        let found = rule.gain_margin(gains, Deviation::NONE);
        let delayed = rule.gain_margin(gains, Deviation { delay: 1, ..Deviation::NONE });
        println!("base N: margin {found:.3} (study 3.92), with an extra tick {delayed:.3} (study 3.16)");
        assert!((found / 3.92 - 1.0).abs() < 0.02 && (delayed / 3.16 - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_rule_keeps_its_margins() {
        let rule = rule(10e3, 0.02, Some(1.0));
        let design = rule.design();
        println!("{design:?}");
        assert!((design.limit / 2151.0 - 1.0).abs() < 0.03);
        for gains in [design.combined, design.position] {
            assert!(rule.radius(gains, Deviation { gain: 2.0, damping: 0.7, ..Deviation::NONE }) < 1.0);
            assert!(rule.radius(gains, Deviation { gain: 1.3, damping: 0.7, delay: 1, ..Deviation::NONE }) < 1.0);
        }
        assert!((design.combined.integral / 150.0 - 1.0).abs() < 0.5, "{design:?}");
    }
}
