//! One tick of the closed loop (8) as a matrix: the plant, sampled exactly, and the controller's tick, line by line.
//!
//! Everything is in modal coordinates z = V⁻¹ x, where leg motions are V⁻¹ J⁻¹ of leg coordinates and a wrench w is
//! V⁻¹ K⁻¹ w, the leg motion that it requests. Set-point and load are zero: only feedback matters for stability. g is the
//! reading of z: z itself, or z behind the lag of the gauges.
//!
//! ```text
//! e  = N(−g) ;   s ← s + T k_I e ;   u = K⁻¹ (k_p e + s)
//! ν  = N(g − u_last) ;   δ̂ ← δ̂ + ω1 (ν + φ̂) ;   φ̂ ← φ̂ + ω2 ν          Y − (q̂ − p) − δ̂ − φ̂ is g − u_last
//! v  ← a v + (1 − a) (g − g_last)/T ;   p = K⁻¹ (K_w z − k_v v)          K_w: measured interaction force
//! q̂ = u − δ̂ − φ̂ + p + D e ;   d = λ q̂, late by the delay                    D: active damping, on e before N
//! ```

mod driven;

use super::channel::StructuralChannel;
use super::law::Tuning;
use super::modes::ModalBasis;
use super::notch::{Biquad, Notch};
use super::sampled::{PLACE, Plant, shown, states};
use specgen_numerics::{Matrix, Matrix6, spectral_radius};
use specgen_runtime::{ControlMode, Law};

/// A linear combination of the states.
type Signal = Vec<f64>;

/// Conditions under which the loop is checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// λ = ρ/ρ̂ of the actuators.
    pub gain_ratio: f64,
    /// Axial stiffness of the legs relative to the nominal one, which the controller assumes; damping ratios are unchanged.
    pub stiffness: f64,
    /// Damping ratios relative to the nominal ones.
    pub damping: f64,
    /// Additional delay between reading the gauges and the voltage, ticks.
    pub delay: f64,
    /// Whether the platform touches the declared work piece.
    pub touching: bool,
}

impl Conditions {
    /// The declared platform.
    pub const NOMINAL: Self = Self { gain_ratio: 1.0, stiffness: 1.0, damping: 1.0, delay: 0.0, touching: false };
}

/// A platform and its controller, without the tuning.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// Modes of the free platform.
    pub basis: ModalBasis,
    /// ζ of each mode.
    pub damping: [f64; 6],
    /// T_s, s.
    pub period: f64,
    /// Amplifier lag τ, s.
    pub lag: f64,
    /// Lag of the gauges and their filter, s.
    pub gauge_lag: f64,
    /// Notch on feedback.
    pub notch: Option<Notch>,
    /// D of each mode in P/F, if there is active damping.
    pub active_damping: Option<[Biquad; 6]>,
    /// Structural modes that are known.
    pub structure: Vec<StructuralChannel>,
    /// Cut-off of the velocity filter, rad/s.
    pub velocity_cutoff: f64,
    /// Diagonal of K_e, N/m and N m/rad.
    pub environment: [f64; 6],
    /// Whether the interaction force is measured and fed forward, which closes a loop through K_e.
    pub measured: bool,
}

impl ClosedLoop {
    /// Largest magnitude of an eigenvalue of one tick; infinite if it cannot be found.
    pub fn spectral_radius(&self, law: ControlMode, tuning: &Tuning, conditions: &Conditions) -> f64 {
        spectral_radius(&self.transition(law, tuning, conditions))
    }

    /// The matrix of one tick. States that the law or the tuning does not use are left out: an idle integrator would give an
    /// eigenvalue of 1.
    pub fn transition(&self, law: ControlMode, tuning: &Tuning, conditions: &Conditions) -> Matrix {
        Assembly::new(self, law, tuning, conditions).matrix()
    }

    /// Lags of amplifier and gauges, s. A lag below a ten-thousandth of a tick is negligible: for the amplifier that bound is used,
    /// for the gauges zero. This keeps the matrix exponential well scaled.
    pub(super) fn lags_used(&self) -> [f64; 2] {
        let shortest = 1e-4 * self.period;
        [
            if self.lag > shortest { self.lag } else { shortest },
            // Structural modes of what the gauges see need readings that are states.
            match self.structure.iter().any(StructuralChannel::on_readings) {
                _ if self.gauge_lag > shortest => self.gauge_lag,
                true => shortest,
                false => 0.0,
            },
        ]
    }

    fn contact(&self, touching: bool) -> Matrix6 {
        if touching { self.basis.couple(&self.environment) } else { [[0.0; 6]; 6] }
    }

    /// diag(ω⁻²) A: from a modal force to the leg motion that it requests.
    pub(super) fn requested_motion(&self, modal_force: &Matrix6) -> Matrix6 {
        core::array::from_fn(|i| {
            let square = self.basis.frequencies[i] * self.basis.frequencies[i];
            modal_force[i].map(|x| x / square)
        })
    }
}

/// Axes whose factor is not zero.
fn used(factors: &[f64; 6]) -> Vec<usize> {
    (0..6).filter(|&axis| factors[axis] != 0.0).collect()
}

/// Index of the first state of each group.
#[derive(Debug, Clone)]
struct Layout {
    history: usize,
    error_notch: usize,
    innovation_notch: usize,
    active_damping: usize,
    last_feedback: usize,
    integral: usize,
    level: usize,
    drift: usize,
    last_pose: usize,
    velocity: usize,
    total: usize,
}

struct Assembly<'a> {
    of: &'a ClosedLoop,
    tuning: &'a Tuning,
    conditions: &'a Conditions,
    feeds_back: bool,
    damps_modes: bool,
    adapts: bool,
    drifts: bool,
    integrating: Vec<usize>,
    damped: Vec<usize>,
    /// First state of the correction, if there is one.
    correction: Option<usize>,
    /// Whether the correction is an error of the readings instead of a correction of the request.
    on_gauges: bool,
    layout: Layout,
    next: Matrix,
}

impl<'a> Assembly<'a> {
    fn new(of: &'a ClosedLoop, law: ControlMode, tuning: &'a Tuning, conditions: &'a Conditions) -> Self {
        let feeds_back = law.feeds_back();
        let adapts = law.law() != Law::Invhys && tuning.level_bandwidth != 0.0;
        let drifts = adapts && law.law() == Law::Pcc && tuning.drift_bandwidth != 0.0;
        let integrating = if feeds_back { used(&tuning.integral) } else { Vec::new() };
        let damped = if feeds_back { used(&tuning.derivative) } else { Vec::new() };
        let notch = |wanted: bool| if wanted && of.notch.is_some() { 12 } else { 0 };
        let mut total = states(of.lags_used()[1], &of.structure);
        let mut take = |count: usize| {
            total += count;
            total - count
        };
        let history = take(6 * libm::ceil(conditions.delay) as usize);
        let error_notch = take(notch(feeds_back));
        let innovation_notch = take(notch(adapts));
        let active_damping = take(if of.active_damping.is_some() && law.damps_modes() { 12 } else { 0 });
        let last_feedback = take(if feeds_back && adapts { 6 } else { 0 });
        let integral = take(integrating.len());
        let level = take(if adapts { 6 } else { 0 });
        let drift = take(if drifts { 6 } else { 0 });
        let last_pose = take(damped.len());
        let velocity = take(damped.len());
        let layout = Layout {
            history,
            error_notch,
            innovation_notch,
            active_damping,
            last_feedback,
            integral,
            level,
            drift,
            last_pose,
            velocity,
            total,
        };
        let next = Matrix::zeros(total);
        Self {
            of,
            tuning,
            conditions,
            feeds_back,
            damps_modes: law.damps_modes(),
            adapts,
            drifts,
            integrating,
            damped,
            correction: None,
            on_gauges: false,
            layout,
            next,
        }
    }

    /// The matrix of a tick, and the effect of a correction of each mode, added to the request, on the states.
    fn driven(mut self) -> (Matrix, Vec<[f64; 6]>) {
        let total = self.layout.total;
        // Six constant states.
        self.layout.total += 6;
        self.next = Matrix::zeros(total + 6);
        self.correction = Some(total);
        let both = self.matrix();
        let mut transition = Matrix::zeros(total);
        let mut input = Vec::with_capacity(total);
        for row in 0..total {
            transition.set_row(row, &both.row(row)[..total]);
            input.push(core::array::from_fn(|mode| both.row(row)[total + mode]));
        }
        (transition, input)
    }

    fn matrix(mut self) -> Matrix {
        let shown = shown(self.of.lags_used()[1]);
        let [place, seen] =
            [PLACE, shown].map(|first| -> [Signal; 6] { core::array::from_fn(|i| self.state(first + i)) });
        let given = self.correction;
        let seen = match given.filter(|_| self.on_gauges) {
            Some(first) => core::array::from_fn(|i| {
                let mut seen = seen[i].clone();
                seen[first + i] -= 1.0;
                seen
            }),
            None => seen,
        };
        let feedback = self.feedback(&seen);
        let estimates = self.adaptation(&seen, &feedback);
        let load = self.load(&place, &seen);
        let damping = self.active_damping(&seen);
        let request: [Signal; 6] = core::array::from_fn(|i| {
            let mut request = feedback[i].clone();
            add(&mut request, -1.0, &estimates[i]);
            add(&mut request, 1.0, &load[i]);
            add(&mut request, 1.0, &damping[i]);
            if let Some(first) = given.filter(|_| !self.on_gauges) {
                request[first + i] += 1.0;
            }
            request
        });
        self.plant(&request);
        self.next
    }

    fn zero(&self) -> Signal {
        vec![0.0; self.layout.total]
    }

    fn zeros(&self) -> [Signal; 6] {
        core::array::from_fn(|_| self.zero())
    }

    fn state(&self, index: usize) -> Signal {
        let mut signal = self.zero();
        signal[index] = 1.0;
        signal
    }

    /// The notch on six modal signals, its states at `first`.
    fn notched(&mut self, first: usize, input: &[Signal; 6]) -> [Signal; 6] {
        match &self.of.notch {
            Some(notch) => self.filtered(first, &notch.sections, input),
            None => input.clone(),
        }
    }

    /// Sections on six modal signals, their states at `first`.
    fn filtered(&mut self, first: usize, sections: &[Biquad; 6], input: &[Signal; 6]) -> [Signal; 6] {
        core::array::from_fn(|i| {
            let Biquad { b, a } = sections[i];
            let (s1, s2) = (first + 2 * i, first + 2 * i + 1);
            let mut output = self.state(s1);
            add(&mut output, b[0], &input[i]);
            let mut next = self.state(s2);
            add(&mut next, b[1], &input[i]);
            add(&mut next, -a[0], &output);
            self.next.set_row(s1, &next);
            let mut next = self.zero();
            add(&mut next, b[2], &input[i]);
            add(&mut next, -a[1], &output);
            self.next.set_row(s2, &next);
            output
        })
    }

    /// u = K⁻¹ (k_p e + s).
    fn feedback(&mut self, seen: &[Signal; 6]) -> [Signal; 6] {
        let mut feedback = self.zeros();
        if !self.feeds_back {
            return feedback;
        }
        let minus = core::array::from_fn(|i| scaled(-1.0, &seen[i]));
        let error = self.notched(self.layout.error_notch, &minus);
        let proportional = self.of.requested_motion(&self.of.basis.couple(&self.tuning.proportional));
        for (out, row) in feedback.iter_mut().zip(&proportional) {
            for (factor, signal) in row.iter().zip(&error) {
                add(out, *factor, signal);
            }
        }
        for (k, axis) in self.integrating.clone().into_iter().enumerate() {
            // In units of the stiffness of its axis, so that the states have similar magnitudes.
            let index = self.layout.integral + k;
            let stiffness = self.of.basis.axis_stiffness[axis];
            let gain = self.of.period * self.tuning.integral[axis] / stiffness;
            let mut integral = self.state(index);
            for (factor, signal) in self.of.basis.from_modal[axis].iter().zip(&error) {
                add(&mut integral, gain * factor, signal);
            }
            self.next.set_row(index, &integral);
            for (out, compliance) in feedback.iter_mut().zip(self.of.basis.compliance(axis)) {
                add(out, stiffness * compliance, &integral);
            }
        }
        feedback
    }

    /// D e, which does not enter the innovation.
    fn active_damping(&mut self, seen: &[Signal; 6]) -> [Signal; 6] {
        let Some(sections) = self.of.active_damping.as_ref().filter(|_| self.damps_modes) else {
            return self.zeros();
        };
        let minus = core::array::from_fn(|i| scaled(-1.0, &seen[i]));
        self.filtered(self.layout.active_damping, sections, &minus)
    }

    /// δ̂ + φ̂ after the reading.
    fn adaptation(&mut self, seen: &[Signal; 6], feedback: &[Signal; 6]) -> [Signal; 6] {
        let mut estimates = self.zeros();
        if !self.adapts {
            return estimates;
        }
        let mut innovation = seen.clone();
        if self.feeds_back {
            for i in 0..6 {
                let index = self.layout.last_feedback + i;
                innovation[i][index] -= 1.0;
                self.next.set_row(index, &feedback[i]);
            }
        }
        let innovation = self.notched(self.layout.innovation_notch, &innovation);
        let level_weight = self.of.period * self.tuning.level_bandwidth;
        let drift_weight = self.of.period * self.tuning.drift_bandwidth;
        for i in 0..6 {
            let mut level = self.state(self.layout.level + i);
            add(&mut level, level_weight, &innovation[i]);
            if self.drifts {
                let index = self.layout.drift + i;
                level[index] += level_weight;
                let mut drift = self.state(index);
                add(&mut drift, drift_weight, &innovation[i]);
                self.next.set_row(index, &drift);
                add(&mut estimates[i], 1.0, &drift);
            }
            self.next.set_row(self.layout.level + i, &level);
            add(&mut estimates[i], 1.0, &level);
        }
        estimates
    }

    /// p = K⁻¹ (K_w z − k_v v): known to the model, so it does not enter the innovation. The force sensor has no lag.
    fn load(&mut self, place: &[Signal; 6], seen: &[Signal; 6]) -> [Signal; 6] {
        let mut load = self.zeros();
        if self.of.measured && self.conditions.touching {
            let fed = self.of.requested_motion(&self.of.contact(true));
            for (out, row) in load.iter_mut().zip(&fed) {
                for (factor, signal) in row.iter().zip(place) {
                    add(out, *factor, signal);
                }
            }
        }
        let pole = libm::exp(-self.of.velocity_cutoff * self.of.period);
        for (k, axis) in self.damped.clone().into_iter().enumerate() {
            let (last, index) = (self.layout.last_pose + k, self.layout.velocity + k);
            let mut pose = self.zero();
            for (factor, signal) in self.of.basis.from_modal[axis].iter().zip(seen) {
                add(&mut pose, *factor, signal);
            }
            // Displacement per tick.
            let mut velocity = scaled(pole, &self.state(index));
            add(&mut velocity, 1.0 - pole, &pose);
            velocity[last] -= 1.0 - pole;
            self.next.set_row(last, &pose);
            self.next.set_row(index, &velocity);
            let gain = self.tuning.derivative[axis] / self.of.period;
            for (out, compliance) in load.iter_mut().zip(self.of.basis.compliance(axis)) {
                add(out, -gain * compliance, &velocity);
            }
        }
        load
    }

    /// The plant under the requests that act during this tick, and the delayed requests.
    fn plant(&mut self, request: &[Signal; 6]) {
        let contact = self.of.contact(self.conditions.touching);
        let damping = self.of.damping.map(|ratio| ratio * self.conditions.damping);
        let plant = Plant::new(
            &self.of.basis,
            &damping,
            self.conditions.stiffness,
            &contact,
            self.of.lags_used(),
            &self.of.structure,
        );
        let whole = libm::floor(self.conditions.delay);
        let part = self.conditions.delay - whole;
        // Request of `age` ticks ago.
        let aged = |this: &Self, age: usize, i: usize| {
            if age == 0 { request[i].clone() } else { this.state(this.layout.history + 6 * (age - 1) + i) }
        };
        let over_tick = plant.sample(self.of.period);
        let late = (part > 0.0).then(|| plant.sample(self.of.period * (1.0 - part)).input);
        for row in 0..over_tick.transition.len() {
            let mut next = self.zero();
            for (column, factor) in over_tick.transition[row].iter().enumerate() {
                next[column] += factor;
            }
            for i in 0..6 {
                let all = over_tick.input[row][i];
                let newer = late.as_ref().map_or(all, |input| input[row][i]);
                let age = whole as usize;
                add(&mut next, self.conditions.gain_ratio * newer, &aged(self, age, i));
                if late.is_some() {
                    add(&mut next, self.conditions.gain_ratio * (all - newer), &aged(self, age + 1, i));
                }
            }
            self.next.set_row(row, &next);
        }
        let ages = (self.layout.error_notch - self.layout.history) / 6;
        for age in 0..ages {
            for i in 0..6 {
                let signal = aged(self, age, i);
                self.next.set_row(self.layout.history + 6 * age + i, &signal);
            }
        }
    }
}

fn add(sum: &mut Signal, factor: f64, signal: &Signal) {
    // Zero terms are skipped, so that decoupled states stay exactly decoupled.
    if factor == 0.0 {
        return;
    }
    for (a, b) in sum.iter_mut().zip(signal) {
        *a += factor * b;
    }
}

fn scaled(factor: f64, signal: &Signal) -> Signal {
    signal.iter().map(|x| factor * x).collect()
}
