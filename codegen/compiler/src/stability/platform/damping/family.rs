//! The loop of one mode under all its design conditions: its figures, and the cost of a design.

use core::f64::consts::PI;

use super::super::channel::StructuralChannel;
use super::super::closed_loop::{ClosedLoop, Conditions};
use super::super::law::Tuning;
use super::super::notch::Biquad;
use super::super::structure::{RATIO, StructureDemand, corners};
use specgen_numerics::Matrix6;
use specgen_numerics::nyquist::{Complex, FlexureRange, over, plus, sensitivity, square, times, tolerance};
use specgen_runtime::Law;

/// Number of frequencies below, around and above the mode.
const POINTS: [u32; 3] = [40, 80, 60];
/// Target of the largest |S|: over the corners, and with a structural mode.
const SENSITIVITY: f64 = 1.98;
const WITH_STRUCTURE: f64 = 2.46;
/// Target of the compliance peak, relative to that without feedback: of modes up to [`LOW`] times the lowest, and of others.
const COMPLIANCE: [f64; 2] = [0.48, 1.0];
pub(super) const LOW: f64 = 1.3;
/// Frequencies at which |S| of slow motion is compared with that of the start rule: the lowest mode over these.
pub const SLOW: [f64; 3] = [36.0, 7.2, 3.6];
/// Target of |S| at the first of them, relative to the start rule.
const SLOWEST: f64 = 1.15;
/// Target of |C| above this share of half the tick rate: what it amplifies of the gauge noise.
const FAST: f64 = 1.0;
const FAST_FROM: f64 = 0.4;
/// Weights of tracking and of compliance.
const TRACKING: f64 = 8.0;
const STIFF: f64 = 8.0;
/// Shares of the error power of a path with corners under the start rule: hysteresis, whose power falls with f⁻⁴; corners, alike at all
/// frequencies up to the mode; and ringing at the mode. Simulated, hysteresis has 0.07 on legs of plays and 0.8 on Bouc-Wen legs.
const SHARES: [f64; 3] = [0.3, 0.3, 0.4];
/// Penalties for an unstable corner, and for the depth of a border in the range of structural modes.
const UNSTABLE: f64 = 1000.0;
const DEPTH: f64 = 20.0;
/// Share of the least ζ to which the sections alone are designed: with gains, the loop of one mode is not the whole.
const SPARE: f64 = 0.7;
/// The same for the estimates alone, whose grid of frequencies is coarser than that of the check.
const SPARE_OF_ESTIMATES: f64 = 0.9;
/// A suspected mode may be off by this share of its frequency: the check of the whole loop looks at intervals beside it, too.
const SUSPECT_OFF: f64 = 0.12;

/// Gains and weights in the loop of one mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feedback {
    /// k_p/K and T k_I/K.
    pub(super) gains: [f64; 2],
    /// ω1 and ω2 per tick.
    pub(super) weights: [f64; 2],
}

/// Target of the compliance peak of the mode at ω, relative to that without feedback.
pub(in super::super) fn target(of: &ClosedLoop, frequency: f64) -> f64 {
    COMPLIANCE[usize::from(frequency > LOW * of.basis.frequencies[0])]
}

/// A mode under all its design conditions.
pub(super) struct Family<'a> {
    of: &'a ClosedLoop,
    adapting: Law,
    mode: usize,
    frequency: f64,
    damping: f64,
    /// Hz and z⁻¹ at each frequency.
    hertz: Vec<f64>,
    delay: Vec<Complex>,
    /// |compliance|² without feedback, relative to the static compliance.
    open: Vec<f64>,
    nominal: Vec<Complex>,
    corners: Vec<Vec<Complex>>,
    /// The corners with each structural mode that is known but not part of the plant.
    suspects: Vec<Vec<Complex>>,
    /// The border of stability about each of them.
    about: Vec<FlexureRange>,
    /// With the distance of [`WITH_STRUCTURE`], and the border of stability itself.
    range: Option<FlexureRange>,
    pub(super) bare_range: Option<FlexureRange>,
    /// The same with a [`SPARE`] of ζ.
    pub(super) spare_range: Option<FlexureRange>,
    /// Indices of [`SLOW`] in the list of frequencies.
    slow: [usize; 3],
    /// Share of the band up to half the tick rate that each frequency represents.
    width: Vec<f64>,
}

/// C times (1 − z⁻¹)ⁿ, that factor, and C.
pub(super) struct Controller {
    response: Vec<Complex>,
    cancelled: Vec<Complex>,
    gain: Vec<Complex>,
}

pub(super) struct Figures {
    /// Members of the family that are unstable.
    unstable: usize,
    pub(super) sensitivity: [f64; 2],
    /// Largest |S| with a suspected mode, and depth of the border in the range of structural modes.
    suspected: f64,
    depth: f64,
    pub(super) compliance: f64,
    most_compliance: f64,
    pub(super) slow: [f64; 3],
    /// Power of each of [`SHARES`].
    tracking: [f64; 3],
    noise: f64,
    /// Largest |C| at high frequency.
    fast: f64,
}

impl Figures {
    /// Error on a path with corners over that of `rule`.
    pub(super) fn tracking(&self, rule: &Self) -> f64 {
        libm::sqrt((0..SHARES.len()).map(|k| SHARES[k] * self.tracking[k] / rule.tracking[k]).sum())
    }

    pub(super) fn cost(&self, rule: &Self) -> f64 {
        let over = |value: f64, bound: f64| if value > bound { value - bound } else { 0.0 };
        let value = UNSTABLE * self.unstable as f64
            + 100.0 * over(self.sensitivity[1], SENSITIVITY)
            + 100.0 * over(self.suspected, WITH_STRUCTURE)
            + DEPTH * self.depth
            + 200.0 * over(self.compliance, self.most_compliance)
            + 5.0 * over(self.slow[0] / rule.slow[0], SLOWEST)
            + 20.0 * over(self.noise, rule.noise)
            + 3.0 * over(self.fast, FAST)
            + TRACKING * self.tracking(rule)
            + STIFF * self.compliance;
        if value.is_finite() { value } else { f64::MAX }
    }
}

impl<'a> Family<'a> {
    /// Without a `demand` structural modes are left out.
    pub(super) fn of(of: &'a ClosedLoop, mode: usize, adapting: Law, demand: Option<&StructureDemand>) -> Self {
        let (frequency, period) = (of.basis.frequencies[mode], of.period);
        let slow = SLOW.map(|share| of.basis.frequencies[0] / share);
        let angles = angles(frequency * period, slow.map(|one| one * period));
        let damping = of.damping[mode];
        let respond = |conditions: &Conditions, lag: f64| -> Vec<Complex> {
            let modes = of.modal_responses(conditions, lag, &angles);
            let plants = modes.iter().zip(&angles).map(|(modes, angle)| of.plant_at(modes, *angle)[(mode, mode)]);
            plants.map(|value| [value.re, value.im]).collect()
        };
        let nominal = respond(&Conditions::NOMINAL, 1.0);
        let corners: Vec<Vec<Complex>> = corners()
            .flat_map(|(conditions, lag)| {
                let one = respond(&conditions, lag);
                RATIO.map(|ratio| one.iter().map(|[re, im]| [ratio * re, ratio * im]).collect())
            })
            .collect();
        let suspects = demand.map_or_else(Vec::new, |demand| {
            let with = |channel: &StructuralChannel, plant: &Vec<Complex>| {
                let factor =
                    |angle: &f64| channel.flexure.factor(angle / period / channel.frequency, channel.damping_ratio);
                plant.iter().zip(&angles).map(|(p, angle)| times(*p, factor(angle))).collect()
            };
            demand.suspects.iter().flat_map(|one| corners.iter().map(move |plant| with(one, plant))).collect()
        });
        let about = |one: &StructuralChannel| {
            let (hertz, off) = (one.frequency / (2.0 * PI), 1.0 + SUSPECT_OFF);
            let mut range = FlexureRange::new(hertz / off, SPARE * one.damping_ratio, vec![one.flexure], 0.0);
            range.to = hertz * off;
            range
        };
        let open = |angle: &f64| {
            let ratio = angle / (frequency * period);
            let (re, im) = (1.0 - ratio * ratio, 2.0 * damping * ratio);
            1.0 / (re * re + im * im)
        };
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
            mode,
            frequency,
            damping,
            hertz: angles.iter().map(|angle| super::super::loop_gain::hertz(*angle, period)).collect(),
            delay: angles.iter().map(|angle| [libm::cos(*angle), -libm::sin(*angle)]).collect(),
            open: angles.iter().map(open).collect(),
            nominal,
            corners,
            suspects,
            about: demand.map_or_else(Vec::new, |demand| demand.suspects.iter().map(about).collect()),
            range: demand.map(|demand| demand.range(1.0 / WITH_STRUCTURE, 1.0)),
            bare_range: demand.map(|demand| demand.range(0.0, SPARE_OF_ESTIMATES)),
            spare_range: demand.map(|demand| demand.range(0.0, SPARE)),
            slow: slow.map(place),
            width,
        }
    }

    /// Gains of the axes, projected on the mode, and weights.
    pub(super) fn feedback(&self, tuning: &Tuning) -> Feedback {
        let (basis, mode) = (&self.of.basis, self.mode);
        let along = |gains: &[f64; 6]| {
            let coupled: Matrix6 = basis.couple(gains);
            coupled[mode][mode] / (self.frequency * self.frequency)
        };
        let period = self.of.period;
        Feedback {
            gains: [along(&tuning.proportional), along(&tuning.integral) * period],
            weights: [
                tuning.level_bandwidth * period,
                if self.adapting == Law::Pcc { tuning.drift_bandwidth * period } else { 0.0 },
            ],
        }
    }

    /// c₀ + c₁ s/ω + c₂ (s/ω)² over (s/ω)² + 2 ζ β s/ω + β², with β and ζ last.
    pub(super) fn section(&self, x: &[f64]) -> Biquad {
        let &[c0, c1, c2, beta, zeta] = x else { return Biquad { b: [0.0; 3], a: [0.0; 2] } };
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

    /// C with the section of these numbers.
    pub(super) fn controller(&self, feedback: &Feedback, notch_damping: f64, section: Option<&[f64]>) -> Controller {
        let section = section.map_or(Biquad { b: [0.0; 3], a: [0.0; 2] }, |x| self.section(x));
        self.with_section(feedback, notch_damping, &section)
    }

    pub(super) fn with_section(&self, feedback: &Feedback, notch_damping: f64, section: &Biquad) -> Controller {
        let [proportional, integral] = feedback.gains;
        let [level, drift] = feedback.weights;
        let adapts = self.adapting != Law::Invhys && level > 0.0;
        let integrates = integral > 0.0;
        let drifts = adapts && drift > 0.0;
        let scaled = |factor: f64, value: Complex| [factor * value[0], factor * value[1]];
        let ones = |e: Complex, count: usize| (0..count).fold([1.0, 0.0], |power, _| times(power, e));
        let (of_gains, of_weights) = (usize::from(integrates), usize::from(adapts) + usize::from(drifts));
        let notch = match &self.of.notch {
            Some(_) => Biquad::notch(self.frequency, self.damping, notch_damping, self.of.period),
            None => Biquad::IDENTITY,
        };
        let (response, cancelled): (Vec<Complex>, Vec<Complex>) = self
            .delay
            .iter()
            .map(|delay| {
                let e = [1.0 - delay[0], -delay[1]];
                let notch = of_section(&notch, *delay);
                // κ and A times their integrators.
                let kappa =
                    if integrates { plus(scaled(proportional, e), [integral, 0.0]) } else { [proportional, 0.0] };
                let fed_back = times(notch, kappa);
                let all = ones(e, of_gains + of_weights);
                let mut sum = times(fed_back, ones(e, of_weights));
                if adapts {
                    let estimates = if drifts {
                        plus(scaled(level, plus(e, scaled(drift, *delay))), scaled(drift, e))
                    } else {
                        [level, 0.0]
                    };
                    let seen = plus(ones(e, of_gains), times(*delay, fed_back));
                    sum = plus(sum, times(times(estimates, notch), seen));
                }
                (plus(sum, times(of_section(section, *delay), all)), all)
            })
            .unzip();
        let gain = response.iter().zip(&cancelled).map(|(c, one)| over(*c, *one)).collect();
        Controller { response, cancelled, gain }
    }

    /// Penalty for what makes a loop unstable: a corner, a structural mode of the range, or one that is suspected. Not counted further
    /// above `most`.
    pub(super) fn penalty(
        &self,
        Controller { response, cancelled, gain }: &Controller,
        range: Option<&FlexureRange>,
        most: f64,
    ) -> f64 {
        let mut penalty = 0.0;
        for plant in &self.corners {
            for range in range.into_iter().chain(&self.about) {
                let found = tolerance(plant, response, cancelled, gain, &self.hertz, Some(range));
                penalty += if found.stable { DEPTH * found.depth } else { UNSTABLE };
            }
            if penalty > most {
                break;
            }
        }
        penalty
    }

    /// Figures over all corners.
    pub(super) fn figures(&self, controller: &Controller) -> Figures {
        let mut figures = self.nominal_figures(controller);
        self.add_corners(controller, &mut figures, |_| true);
        figures
    }

    /// Adds the corners, as long as `goes_on` is true of the figures so far.
    pub(super) fn add_corners(
        &self,
        Controller { response, cancelled, gain }: &Controller,
        figures: &mut Figures,
        goes_on: impl Fn(&Figures) -> bool,
    ) {
        let add = |plant: &Vec<Complex>, range: Option<&FlexureRange>, figures: &mut Figures| {
            let found = tolerance(plant, response, cancelled, gain, &self.hertz, range);
            if found.depth > figures.depth {
                figures.depth = found.depth;
            }
            figures.unstable += usize::from(!found.stable);
            found.sensitivity
        };
        let larger = |most: &mut f64, value: f64| {
            if value > *most {
                *most = value;
            }
        };
        for (corner, plant) in self.corners.iter().enumerate() {
            let worst = add(plant, self.range.as_ref(), figures);
            larger(&mut figures.sensitivity[1], worst);
            for about in &self.about {
                add(plant, Some(about), figures);
            }
            for suspect in self.suspects.iter().skip(corner).step_by(self.corners.len()) {
                let worst = add(suspect, None, figures);
                larger(&mut figures.suspected, worst);
            }
            if !goes_on(figures) {
                return;
            }
        }
    }

    /// Figures of the nominal loop.
    pub(super) fn nominal_figures(&self, Controller { response, cancelled, gain }: &Controller) -> Figures {
        let mut slow = [0.0; 3];
        let (mut nominal, mut compliance, mut noise, mut fast) = (0.0, 0.0, 0.0, 0.0);
        let mut tracking = [0.0; 3];
        let stable = sensitivity(&self.nominal, response, cancelled, |k, [above, below]| {
            let s = above / below;
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
            let gain = square(gain[k]);
            // T = P C S.
            noise += self.width[k] * square(self.nominal[k]) * gain * s;
            let open = self.open[k];
            let square_hertz = self.hertz[k] * self.hertz[k];
            let weights = [1.0 / (square_hertz * square_hertz), if open < 1.0 { open } else { 1.0 }, open];
            for (power, weight) in tracking.iter_mut().zip(weights) {
                *power += self.width[k] * s * weight;
            }
            if self.delay[k][0] < libm::cos(FAST_FROM * PI) && gain > fast {
                fast = gain;
            }
        });
        Figures {
            unstable: usize::from(!stable),
            sensitivity: [libm::sqrt(nominal), 0.0],
            suspected: 0.0,
            depth: 0.0,
            // The open peak is 1/(2 ζ) of the static compliance, for small ζ.
            compliance: libm::sqrt(compliance) * 2.0 * self.damping * libm::sqrt(1.0 - self.damping * self.damping),
            most_compliance: target(self.of, self.frequency),
            slow,
            tracking,
            noise: libm::sqrt(noise),
            fast: libm::sqrt(fast),
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
