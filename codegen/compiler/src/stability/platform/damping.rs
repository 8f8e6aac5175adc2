//! Active damping: one second-order section per mode, designed together with gains and bandwidths. The sections depend only on the
//! platform: gains from the spec or set on a running machine do not change them.
//!
//! In modal coordinates each mode is treated as a single-input single-output loop. The coupling by the gains of the axes is left to
//! the later check of the whole loop. With the sampled mode P, the notch N and e = 1 − z⁻¹,
//!
//! ```text
//! C = N κ + A N (1 + z⁻¹ N κ) + D        κ = k_p/K + T k_I/(K e) ;   A = (ω1 (e + z⁻¹ ω2) + ω2 e)/e² ;   S = 1/(1 + P C)
//! ```
//! D, and for the lowest mode κ and A with it, minimise a cost. Targets: the worst |S| over stiffness, λ, lag, delay and damping below
//! 2, the peak of the compliance below half of that without feedback, |S| of slow motion and noise no worse than with the start rule.
//! Bounds are penalties. If not all can be met, the result is the best compromise, and the figures show it.

use core::f64::consts::PI;

use serde::Serialize;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::notch::{Biquad, in_reach};
use super::sampled::{PLACE, Plant, shown};
use specgen_numerics::nyquist::{Complex, over, plus, sensitivity, square, times};
use specgen_numerics::{Matrix6, simplex};
use specgen_runtime::Law;

/// Number of frequencies below, around and above the mode.
const POINTS: [u32; 3] = [50, 100, 40];
/// Design conditions of D: stiffness, λ, delay in ticks, relative lag of the amplifier; each with 0.7 of the damping.
const STIFFNESS: [f64; 2] = [0.9, 1.1];
const RATIO: [f64; 2] = [0.9, 1.1];
const DELAY: [f64; 2] = [0.0, 1.0];
const LAG: [f64; 2] = [0.7, 1.3];
/// Stiffness over a wider range, with a looser target of |S|.
const WIDE: [f64; 2] = [0.6, 1.6];
/// Target of the largest |S|: over the design conditions, and over [`WIDE`].
const SENSITIVITY: f64 = 1.95;
const WIDE_SENSITIVITY: f64 = 4.0;
/// Target of the compliance peak, relative to that without feedback.
const COMPLIANCE: f64 = 0.5;
/// Frequencies at which |S| of slow motion is compared with that of the start rule: the lowest mode over these.
pub const SLOW: [f64; 3] = [36.0, 7.2, 3.6];
const SLOWEST: f64 = 1.04;
const MIDDLE: f64 = 0.74;
/// Target of the gain of D above all modes, which amplifies the gauge noise.
const FAST: f64 = 1.0;
/// Least Ω2, relative to that of the rule.
const LEAST_DRIFT: f64 = 0.3;
/// Evaluations of the cost from each start; and the relative steps of restarts from the best, with as many evaluations.
const FIRST: usize = 500;
const THEN: [f64; 5] = [0.5, -1.0, 0.7, -0.5, 0.3];

/// Effect of active damping on a mode; ratios.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DampedMode {
    /// Peak of the compliance (force to pose), relative to that without feedback.
    pub compliance: f64,
    /// Largest |S|: nominal, and over ±10 % of stiffness and λ, ±30 % of the amplifier's lag, one tick more, 0.7 of the damping.
    pub sensitivity: [f64; 2],
    /// |S| at 1/36, 1/7.2 and 1/3.6 of the lowest mode's frequency.
    pub slow: [f64; 3],
    /// The same without active damping, by the start rule.
    pub without: [f64; 3],
}

/// Active damping of a platform.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveDamping {
    /// The section D of each mode.
    pub sections: [Biquad; 6],
    /// Effect on each mode; none for a mode that is too fast to be sampled.
    pub modes: [Option<DampedMode>; 6],
}

/// Gains and weights in the loop of one mode.
#[derive(Debug, Clone, Copy)]
struct Feedback {
    /// k_p/K and T k_I/K.
    gains: [f64; 2],
    /// ω1 and ω2 per tick.
    weights: [f64; 2],
}

/// The sections, and gains and bandwidths that replace the rule's `start`.
pub(super) fn design(of: &ClosedLoop, adapting: Law, start: &Tuning) -> (ActiveDamping, Tuning) {
    let share = shares(of, start);
    let feedback = |mode: usize, factors: [f64; 4]| Feedback {
        gains: [share[mode][0] * factors[0], share[mode][1] * of.period * factors[1]],
        weights: [
            start.level_bandwidth * of.period * factors[2],
            if adapting == Law::Pcc { start.drift_bandwidth * of.period * factors[3] } else { 0.0 },
        ],
    };
    // Factors of k_p, k_I, Ω1 and Ω2.
    let mut factors = [1.0; 4];
    let mut sections = [Biquad { b: [0.0; 3], a: [0.0; 2] }; 6];
    let mut modes = [None; 6];
    let mut found: Option<Vec<f64>> = None;
    for mode in 0..6 {
        let frequency = of.basis.frequencies[mode];
        if !in_reach(frequency, of.period) {
            continue;
        }
        let family = Family::of(of, mode, adapting);
        let rule = family.figures(&family.controller(&feedback(mode, [1.0; 4]), None));
        let before = modes.iter().position(|one: &Option<DampedMode>| one.is_some());
        let alike = before.is_some() && mode > 0 && frequency - of.basis.frequencies[mode - 1] < 1e-6 * frequency;
        if !alike {
            // The lowest mode also determines the gains.
            let tried = if before.is_none() { factors.len() } else { 0 };
            let cost = |x: &[f64]| {
                let (tuned, section) = x.split_at(tried);
                let factors = with(factors, tuned);
                let controller = family.controller(&feedback(mode, factors), Some(section));
                // Without a bound Ω2 would vanish: it corrects errors slower than any frequency in the cost.
                let lost = LEAST_DRIFT - factors[3];
                family.figures(&controller).cost(&rule) + if lost > 0.0 { 10.0 * lost } else { 0.0 }
            };
            let known = found.as_deref();
            let mut best = search(tried, known, cost);
            found = Some(best.split_off(tried));
            factors = with(factors, &best);
        }
        if let Some(section) = &found {
            sections[mode] = family.section(section);
            let figures = family.figures(&family.controller(&feedback(mode, factors), Some(section)));
            modes[mode] = Some(DampedMode {
                compliance: figures.compliance,
                sensitivity: figures.sensitivity,
                slow: figures.slow,
                without: rule.slow,
            });
        }
    }
    let tuning = Tuning {
        proportional: start.proportional.map(|gain| gain * factors[0]),
        integral: start.integral.map(|gain| gain * factors[1]),
        derivative: start.derivative,
        level_bandwidth: start.level_bandwidth * factors[2],
        drift_bandwidth: start.drift_bandwidth * factors[3],
    };
    (ActiveDamping { sections, modes }, tuning)
}

/// `factors` with e to the numbers of `tuned` in place of the first.
fn with(mut factors: [f64; 4], tuned: &[f64]) -> [f64; 4] {
    for (factor, value) in factors.iter_mut().zip(tuned) {
        *factor = libm::exp(*value);
    }
    factors
}

/// k_p/K and k_I/K of each mode: the gains of the axes, projected on it.
fn shares(of: &ClosedLoop, tuning: &Tuning) -> [[f64; 2]; 6] {
    let along = |gains: &[f64; 6]| -> [f64; 6] {
        let coupled: Matrix6 = of.basis.couple(gains);
        core::array::from_fn(|i| coupled[i][i] / (of.basis.frequencies[i] * of.basis.frequencies[i]))
    };
    let (proportional, integral) = (along(&tuning.proportional), along(&tuning.integral));
    core::array::from_fn(|i| [proportional[i], integral[i]])
}

/// Logarithms of `count` factors and a section with the least cost: starts from four weak sections and from `known`.
fn search(count: usize, known: Option<&[f64]>, mut cost: impl FnMut(&[f64]) -> f64) -> Vec<f64> {
    const GAINS: [[f64; 4]; 3] = [[0.0; 4], [0.0, -0.5, 0.35, -0.8], [0.7, -0.3, 0.2, -1.0]];
    const WEAK: [[f64; 3]; 4] = [[0.02, 0.0, 0.06], [0.02, 0.06, 0.0], [0.02, -0.06, 0.0], [0.02, 0.0, -0.06]];
    let steps: Vec<f64> = [0.15].repeat(count).into_iter().chain([0.08, 0.08, 0.08, 0.2, 0.2]).collect();
    let from = |gains: &[f64; 4], numerator: [f64; 3]| {
        let mut x = gains[..count].to_vec();
        x.extend(numerator);
        x.extend([libm::log(1.5), libm::log(0.3)]);
        x
    };
    let gains = if count > 0 { &GAINS[..] } else { &GAINS[..1] };
    let mut starts: Vec<Vec<f64>> = gains.iter().flat_map(|gains| WEAK.map(|weak| from(gains, weak))).collect();
    starts.extend(known.map(<[f64]>::to_vec));
    let mut best: Option<(Vec<f64>, f64)> = None;
    for start in starts {
        let found = simplex(&start, &steps, FIRST, &mut cost);
        if best.as_ref().is_none_or(|(_, least)| found.1 < *least) {
            best = Some(found);
        }
    }
    let mut start = best.map_or_else(|| from(&GAINS[0], WEAK[0]), |(x, _)| x);
    for factor in THEN {
        let steps: Vec<f64> = steps.iter().map(|step| factor * step).collect();
        start = simplex(&start, &steps, FIRST, &mut cost).0;
    }
    start
}

/// A mode under all its design conditions.
struct Family<'a> {
    of: &'a ClosedLoop,
    adapting: Law,
    frequency: f64,
    damping: f64,
    /// z⁻¹, N and s/ω of the bilinear map at each frequency.
    delay: Vec<Complex>,
    notch: Vec<Complex>,
    slope: Vec<Complex>,
    /// |compliance|² without feedback, relative to the static compliance.
    open: Vec<f64>,
    nominal: Vec<Complex>,
    narrow: Vec<Vec<Complex>>,
    wide: Vec<Vec<Complex>>,
    /// Indices of [`SLOW`] in the list of frequencies.
    slow: [usize; 3],
    /// Share of the band up to half the tick rate that each frequency represents.
    width: Vec<f64>,
}

/// C times (1 − z⁻¹)ⁿ, and that factor.
struct Controller {
    response: Vec<Complex>,
    cancelled: Vec<Complex>,
    /// |D| at half the tick rate.
    fast: f64,
}

struct Figures {
    /// Members of the family that are unstable.
    unstable: usize,
    sensitivity: [f64; 2],
    wide: f64,
    compliance: f64,
    slow: [f64; 3],
    noise: f64,
    /// |D| at half the tick rate.
    fast: f64,
}

impl Figures {
    fn cost(&self, rule: &Self) -> f64 {
        let over = |value: f64, bound: f64| if value > bound { value - bound } else { 0.0 };
        let value = 1000.0 * self.unstable as f64
            + 20.0 * over(self.sensitivity[1], SENSITIVITY)
            + 0.1 * over(self.wide, WIDE_SENSITIVITY)
            + 20.0 * over(self.compliance, COMPLIANCE)
            + 100.0 * over(self.slow[0], SLOWEST * rule.slow[0])
            + 30.0 * over(self.slow[1], MIDDLE * rule.slow[1])
            + 20.0 * over(self.noise, rule.noise)
            + 0.3 * over(self.fast, FAST)
            + 8.0 * self.compliance
            + self.slow[1]
            + 0.5 * self.slow[2];
        if value.is_finite() { value } else { f64::MAX }
    }
}

impl<'a> Family<'a> {
    fn of(of: &'a ClosedLoop, mode: usize, adapting: Law) -> Self {
        let (frequency, period) = (of.basis.frequencies[mode], of.period);
        let slow = SLOW.map(|share| of.basis.frequencies[0] / share);
        let angles = angles(frequency * period, slow.map(|one| one * period));
        let damping = of.damping[mode];
        let nominal = response(of, mode, &Conditions::NOMINAL, of.lag, &angles);
        let mut narrow = Vec::new();
        for stiffness in STIFFNESS {
            for lag in LAG {
                for delay in DELAY {
                    let conditions = Conditions { stiffness, damping: 0.7, delay, ..Conditions::NOMINAL };
                    let one = response(of, mode, &conditions, of.lag * lag, &angles);
                    narrow.extend(RATIO.map(|ratio| one.iter().map(|[re, im]| [ratio * re, ratio * im]).collect()));
                }
            }
        }
        let wide = WIDE.map(|stiffness| {
            let conditions = Conditions { stiffness, damping: 0.7, ..Conditions::NOMINAL };
            response(of, mode, &conditions, of.lag, &angles)
        });
        let delay: Vec<Complex> = angles.iter().map(|angle| [libm::cos(*angle), -libm::sin(*angle)]).collect();
        let bilinear = 1.0 / libm::tan(0.5 * frequency * period);
        let open = |angle: &f64| {
            let ratio = angle / (frequency * period);
            let (re, im) = (1.0 - ratio * ratio, 2.0 * damping * ratio);
            1.0 / (re * re + im * im)
        };
        let section = of.notch.as_ref().map_or(Biquad::IDENTITY, |notch| notch.sections[mode]);
        let place = |wanted: f64| {
            angles.iter().position(|angle| *angle >= wanted * period * (1.0 - 1e-12)).unwrap_or(angles.len() - 1)
        };
        let width = (0..angles.len())
            .map(|k| {
                let next = angles.get(k + 1).unwrap_or(&angles[k]);
                let before = if k == 0 { 0.0 } else { angles[k - 1] };
                0.5 * (next - before) / PI
            })
            .collect();
        Self {
            of,
            adapting,
            frequency,
            damping,
            notch: delay.iter().map(|q| of_section(&section, *q)).collect(),
            // (1 − z⁻¹)/(1 + z⁻¹) = j tan(ωT/2).
            slope: angles.iter().map(|angle| [0.0, bilinear * libm::tan(0.5 * angle)]).collect(),
            open: angles.iter().map(open).collect(),
            delay,
            nominal,
            narrow,
            wide: wide.to_vec(),
            slow: slow.map(place),
            width,
        }
    }

    /// c₀ + c₁ s/ω + c₂ (s/ω)² over (s/ω)² + 2 ζ β s/ω + β², with ln β and ln ζ last.
    fn section(&self, x: &[f64]) -> Biquad {
        let &[c0, c1, c2, place, damping] = x else { return Biquad { b: [0.0; 3], a: [0.0; 2] } };
        let (beta, zeta) = (libm::exp(place), libm::exp(damping));
        let k = 1.0 / libm::tan(0.5 * self.frequency * self.of.period);
        let (square, line) = (beta * beta, 2.0 * zeta * beta * k);
        let scale = 1.0 / (k * k + line + square);
        Biquad {
            b: [
                (c0 + c1 * k + c2 * k * k) * scale,
                2.0 * (c0 - c2 * k * k) * scale,
                (c0 - c1 * k + c2 * k * k) * scale,
            ],
            a: [2.0 * (square - k * k) * scale, (k * k - line + square) * scale],
        }
    }

    fn controller(&self, feedback: &Feedback, section: Option<&[f64]>) -> Controller {
        let [proportional, integral] = feedback.gains;
        let [level, drift] = feedback.weights;
        let adapts = self.adapting != Law::Invhys && level > 0.0;
        let integrates = integral > 0.0;
        let drifts = adapts && drift > 0.0;
        let scaled = |factor: f64, value: Complex| [factor * value[0], factor * value[1]];
        let ones = |e: Complex, count: usize| (0..count).fold([1.0, 0.0], |power, _| times(power, e));
        let (of_gains, of_weights) = (usize::from(integrates), usize::from(adapts) + usize::from(drifts));
        let pairs = self.delay.iter().zip(&self.notch).zip(&self.slope);
        let (response, cancelled) = pairs
            .map(|((delay, notch), slope)| {
                let e = [1.0 - delay[0], -delay[1]];
                // κ and A times their integrators.
                let kappa =
                    if integrates { plus(scaled(proportional, e), [integral, 0.0]) } else { [proportional, 0.0] };
                let fed_back = times(*notch, kappa);
                let all = ones(e, of_gains + of_weights);
                let mut sum = times(fed_back, ones(e, of_weights));
                if adapts {
                    let estimates = if drifts {
                        plus(scaled(level, plus(e, scaled(drift, *delay))), scaled(drift, e))
                    } else {
                        [level, 0.0]
                    };
                    let seen = plus(ones(e, of_gains), times(*delay, fed_back));
                    sum = plus(sum, times(times(estimates, *notch), seen));
                }
                if let Some(&[c0, c1, c2, place, damping]) = section {
                    let (beta, zeta) = (libm::exp(place), libm::exp(damping));
                    let squared = times(*slope, *slope);
                    let above = plus(plus([c0, 0.0], scaled(c1, *slope)), scaled(c2, squared));
                    let below = plus(plus([beta * beta, 0.0], scaled(2.0 * zeta * beta, *slope)), squared);
                    sum = plus(sum, times(over(above, below), all));
                }
                (sum, all)
            })
            .unzip();
        let fast = section.map_or(0.0, |x| {
            let Biquad { b, a } = self.section(x);
            ((b[0] - b[1] + b[2]) / (1.0 - a[0] + a[1])).abs()
        });
        Controller { response, cancelled, fast }
    }

    fn figures(&self, Controller { response, cancelled, fast }: &Controller) -> Figures {
        let mut unstable = 0;
        let mut largest = |plants: &[Vec<Complex>]| {
            let mut most = 0.0;
            for plant in plants {
                let stable = sensitivity(plant, response, cancelled, |_, s| {
                    if s > most {
                        most = s;
                    }
                });
                unstable += usize::from(!stable);
            }
            libm::sqrt(most)
        };
        let (worst, wide) = (largest(&self.narrow), largest(&self.wide));
        let mut slow = [0.0; 3];
        let (mut nominal, mut compliance, mut noise) = (0.0, 0.0, 0.0);
        let stable = sensitivity(&self.nominal, response, cancelled, |k, s| {
            if s > nominal {
                nominal = s;
            }
            if s * self.open[k] > compliance {
                compliance = s * self.open[k];
            }
            for (value, place) in slow.iter_mut().zip(self.slow) {
                if k == place {
                    *value = libm::sqrt(s);
                }
            }
            // T = P C S.
            let shown = square(times(self.nominal[k], response[k])) / square(cancelled[k]) * s;
            noise += self.width[k] * shown;
        });
        unstable += usize::from(!stable);
        Figures {
            unstable,
            sensitivity: [libm::sqrt(nominal), worst],
            wide,
            // The open peak is 1/(2 ζ) of the static compliance, for small ζ.
            compliance: libm::sqrt(compliance) * 2.0 * self.damping * libm::sqrt(1.0 - self.damping * self.damping),
            slow,
            noise: libm::sqrt(noise),
            fast: *fast,
        }
    }
}

/// ωT of every checked frequency, ascending to π: dense around the mode, and including `wanted`.
fn angles(mode: f64, wanted: [f64; 3]) -> Vec<f64> {
    let [below, about, above] = POINTS;
    let (low, high) = (0.6 * mode, if 1.6 * mode < PI { 1.6 * mode } else { 0.5 * (mode + PI) });
    let first = mode / 700.0;
    let geometric = |from: f64, to: f64, k: u32, count: u32| {
        from * libm::exp(libm::log(to / from) * f64::from(k) / f64::from(count))
    };
    let mut all: Vec<f64> = (0..below).map(|k| geometric(first, low, k, below)).collect();
    all.extend((0..about).map(|k| low + (high - low) * f64::from(k) / f64::from(about)));
    all.extend((0..=above).map(|k| if k == above { PI } else { geometric(high, PI, k, above) }));
    all.extend(wanted.into_iter().filter(|angle| *angle > first && *angle < PI));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| *a - *b < 1e-9 * *b);
    all
}

/// H(z⁻¹).
fn of_section(Biquad { b, a }: &Biquad, delay: Complex) -> Complex {
    let square = times(delay, delay);
    let sum = |first: f64, second: f64, third: f64| {
        [first + second * delay[0] + third * square[0], second * delay[1] + third * square[1]]
    };
    over(sum(b[0], b[1], b[2]), sum(1.0, a[0], a[1]))
}

/// P of a mode: from a requested leg motion to the readings of the gauges.
fn response(of: &ClosedLoop, mode: usize, conditions: &Conditions, lag: f64, angles: &[f64]) -> Vec<Complex> {
    let [shortest, gauge_lag] = ClosedLoop { lag, ..of.clone() }.lags_used();
    let damping = of.damping.map(|ratio| ratio * conditions.damping);
    let plant = Plant::new(&of.basis, &damping, conditions.stiffness, &[[0.0; 6]; 6], [shortest, gauge_lag]);
    let sampled = plant.sample(of.period);
    // Without contact a mode is decoupled from the others: every sixth state.
    let states: Vec<usize> = (mode..sampled.transition.len()).step_by(6).collect();
    let seen = if shown(gauge_lag) == PLACE { 1 } else { 3 };
    angles
        .iter()
        .map(|angle| {
            let z = [libm::cos(*angle), libm::sin(*angle)];
            let mut rows: Vec<Vec<Complex>> = states
                .iter()
                .map(|&row| {
                    let of_column = |&column: &usize| {
                        let own = if row == column { z } else { [0.0; 2] };
                        [own[0] - sampled.transition[row][column], own[1]]
                    };
                    states.iter().map(of_column).chain([[sampled.input[row][mode], 0.0]]).collect()
                })
                .collect();
            super::open_loop::solve(&mut rows);
            let late = conditions.delay * angle;
            times(rows[seen][states.len()], [libm::cos(late), -libm::sin(late)])
        })
        .collect()
}
