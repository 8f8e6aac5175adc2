//! The platform controller: gauges → pose, set-point, P, F and P/F in task space, six voltages (`sixdof.md` §2 iv).
//!
//! ```text
//! tick at t_n: pose h, Y = Δl(h); q̂ and p of the last interval, T the target at its end
//! ν = J N(J⁻¹ (Y − (q̂ − p) − δ̂ − φ̂)) ;  δ̂ ← δ̂ + ω1 (ν + φ̂) ;  φ̂ ← φ̂ + ω2 ν        EWMA: φ̂ = 0
//! e = N(T − h) ;  s ← s + T_s k_I e unless a leg was limited
//! p = (f_ff(T⁺) − f_rest)/k_a ,  Jᵀ f_ff = M ḧ + G + K_e (h − h_e) or − measured wrench ; k_v as a known part
//! q = Δl(T⁺) + p + J⁻ᵀ (k_p e + s)/k_a − δ̂ − φ̂ ;  u = Γ⁻¹(q), P alone: q/ρ̂ ;  q̂ = Γ(u) after converter and limits
//! ```
//! N is the modal notch; J in the feedback is that at rest. Velocity forces C ḣ are neglected: below 1 pm of leg
//! displacement for the motion of a piezo platform. No bumpless change between modes. Set-points: bias by a fifth-order
//! polynomial, hold and stream.

mod generator;
mod settings;

use super::design::Gains;
use super::linear::{Matrix, Vector, matrix, numbers, vector};
use super::notch::{Notch, NotchState};
use super::preisach::{Memory, Table};
use host_sim::closed_loop::LEGS;
use host_sim::controller::{ControllerError, TickController};
use host_sim::description::{Description, indexed};
use host_sim::platform::{Geometry, Masses, Probe};
use host_sim::trajectory::PoseTarget;
use host_sim::word::Scalar;

use generator::Generator;
pub use settings::{Drive, Settings};

/// Values of the configuration words.
#[derive(Debug, Clone, PartialEq)]
struct Config {
    mode: u64,
    interaction: u64,
    level_weight: f64,
    drift_weight: f64,
    step_max: i64,
    code_min: i64,
    code_max: i64,
    gains: [Vector; 3],
    position_gains: [Vector; 3],
    environment_stiffness: Vector,
    environment_rest: Vector,
}

#[derive(Debug, Clone)]
struct Leg {
    memory: Memory,
    code: i64,
    /// q̂, m.
    requested: f64,
}

/// State of the controller.
#[derive(Debug, Clone)]
struct State {
    legs: [Leg; LEGS],
    pose: Vector,
    velocity: Vector,
    target: PoseTarget,
    /// p of the last interval, m.
    load: Vector,
    /// Δl at the last set-point, m.
    demand: Vector,
    level: Vector,
    drift: Vector,
    integral: Vector,
    error_notch: NotchState,
    innovation_notch: NotchState,
    limited: u64,
    wrench: Vector,
    started: bool,
}

impl State {
    fn new() -> Self {
        let leg = Leg { memory: Memory::new(), code: 0, requested: 0.0 };
        let zero = Vector::zeros();
        Self {
            legs: std::array::from_fn(|_| leg.clone()),
            pose: zero,
            velocity: zero,
            target: PoseTarget::default(),
            load: zero,
            demand: zero,
            level: zero,
            drift: zero,
            integral: zero,
            error_notch: NotchState::default(),
            innovation_notch: NotchState::default(),
            limited: 0,
            wrench: zero,
            started: false,
        }
    }
}

/// See the module.
pub struct PlatformOracle {
    geometry: Geometry,
    masses: Masses,
    probes: [Probe; 6],
    tables: [Table; LEGS],
    drive: Drive,
    period: f64,
    velocity_pole: f64,
    /// Lead of the leg displacements, s.
    lead: f64,
    /// k_a of each leg, N/m.
    stiffness: Vector,
    jacobian: Matrix,
    inverse_jacobian: Matrix,
    /// ∂pose/∂reading of the gauges at rest.
    gauge_inverse: Matrix,
    /// Static leg forces at rest, N.
    carried: Vector,
    notch: Option<Notch>,
    config: Config,
    default: Config,
    generator: Generator,
    state: State,
    description: Description,
}

impl PlatformOracle {
    /// A controller at power-up. `None` if geometry or gauges are singular.
    pub fn new(settings: &Settings) -> Option<Self> {
        let Settings { plant, combined, position, .. } = settings;
        let structure = &plant.structure;
        let (geometry, masses) = (structure.geometry, structure.masses);
        let jacobian = matrix(&geometry.jacobian(&[0.0; 6]));
        let inverse_jacobian = jacobian.try_inverse()?;
        let (frequencies, shapes) = structure.modes();
        let notch = match settings.notch_damping {
            Some(damping) => {
                Some(Notch::new((&frequencies, &matrix(&shapes)), plant.modal_damping, damping, plant.period)?)
            }
            None => None,
        };
        let axes = matrix(&structure.stiffness_matrix()).diagonal();
        let gains = |gains: &Gains| [axes * gains.proportional, axes * gains.integral, vector(&settings.velocity)];
        let default = Config {
            mode: 6,
            interaction: 0,
            level_weight: combined.level * plant.period,
            drift_weight: combined.drift * plant.period,
            step_max: settings.drive.step_max,
            code_min: 0,
            code_max: settings.drive.code_max,
            gains: gains(combined),
            position_gains: gains(position),
            environment_stiffness: Vector::zeros(),
            environment_rest: vector(&settings.bias),
        };
        let carried = inverse_jacobian.transpose() * vector(&masses.weight(&geometry, &[0.0; 6]));
        let mut out = Self {
            geometry,
            masses,
            probes: settings.probes,
            tables: settings.tables.clone(),
            drive: settings.drive,
            period: plant.period,
            lead: settings.lead,
            velocity_pole: libm::exp(-settings.velocity_cutoff * plant.period),
            stiffness: vector(&structure.stiffness),
            jacobian,
            inverse_jacobian,
            gauge_inverse: Matrix::zeros(),
            carried,
            notch,
            config: default.clone(),
            default,
            generator: Generator::new(settings.bias, settings.bias_time, plant.period),
            state: State::new(),
            description: description(),
        };
        out.gauge_inverse = out.gauge_slopes().try_inverse()?;
        Some(out)
    }

    fn readings(&self, pose: &Vector) -> Vector {
        let pose = numbers(pose);
        Vector::from_fn(|k, _| self.probes[k].reading(self.geometry.height, &pose))
    }

    fn gauge_slopes(&self) -> Matrix {
        let mut out = Matrix::zeros();
        for axis in 0..6 {
            let mut step = Vector::zeros();
            step[axis] = 1e-6;
            out.set_column(axis, &((self.readings(&step) - self.readings(&-step)) / 2e-6));
        }
        out
    }

    /// The pose for the readings `gauge`, by Newton steps with the slopes at rest.
    fn sense(&self, gauge: &Vector) -> Vector {
        let mut pose = self.gauge_inverse * gauge;
        for _ in 0..8 {
            pose += self.gauge_inverse * (gauge - self.readings(&pose));
        }
        pose
    }

    fn notch(notch: Option<&Notch>, state: &mut NotchState, error: &Vector) -> Vector {
        notch.map_or(*error, |notch| notch.filter(state, error))
    }

    /// p: deflection of the legs under the known forces at `target`, m.
    fn load(&self, target: &PoseTarget, push: &Vector) -> Vector {
        let mass = matrix(&self.masses.mass_matrix(&self.geometry, &target.pose));
        let weight = vector(&self.masses.weight(&self.geometry, &target.pose));
        let jacobian = matrix(&self.geometry.jacobian(&target.pose));
        let force = mass * vector(&target.acceleration) + weight + push;
        // If J is regular at rest, it is regular within the reach of piezo legs.
        let legs = jacobian.transpose().lu().solve(&force).unwrap_or_else(Vector::zeros);
        (legs - self.carried).component_div(&self.stiffness)
    }
}

/// The emitted controller's interface.
pub fn description() -> Description {
    let one = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    Description {
        name: "platform-oracle".to_owned(),
        digest: "0".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scalar: Scalar::F64,
        config_names: [
            one(&["mode", "interaction", "level_weight", "drift_weight", "max_step_codes", "code_min", "code_max"]),
            indexed(&["kp", "ki", "kv", "position_kp", "position_ki", "position_kv"]),
            indexed(&["environment_stiffness", "environment_rest"]),
        ]
        .concat(),
        input_names: [
            one(&["command", "selector", "sequence"]),
            indexed(&["setpoint", "setpoint_rate", "setpoint_acceleration", "gauge", "wrench"]),
        ]
        .concat(),
        output_names: [
            indexed(&["voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load"]),
            one(&["status"]),
        ]
        .concat(),
    }
}

/// Scalar words before the groups of six words of a configuration.
const SCALARS: usize = 7;

impl TickController for PlatformOracle {
    fn description(&self) -> &Description {
        &self.description
    }

    fn default_config(&self) -> Vec<u64> {
        let c = &self.default;
        let mut words =
            vec![c.mode, c.interaction, c.level_weight.to_bits(), c.drift_weight.to_bits(), c.step_max as u64];
        words.extend([c.code_min as u64, c.code_max as u64]);
        let sixes = c.gains.iter().chain(&c.position_gains).chain([&c.environment_stiffness, &c.environment_rest]);
        words.extend(sixes.flat_map(|six| six.iter().map(|x| x.to_bits())));
        words
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        let expected = self.description.config_names.len();
        if words.len() != expected {
            return Err(ControllerError::ConfigLength { given: words.len(), expected });
        }
        if words[0] > 6 || words[1] > 2 {
            let place = usize::from(words[0] <= 6);
            return Err(ControllerError::Config {
                name: self.description.config_names[place].clone(),
                word: words[place],
            });
        }
        let six = |index: usize| Vector::from_fn(|k, _| f64::from_bits(words[SCALARS + 6 * index + k]));
        self.config = Config {
            mode: words[0],
            interaction: words[1],
            level_weight: f64::from_bits(words[2]),
            drift_weight: f64::from_bits(words[3]),
            step_max: words[4] as i64,
            code_min: words[5] as i64,
            code_max: words[6] as i64,
            gains: [six(0), six(1), six(2)],
            position_gains: [six(3), six(4), six(5)],
            environment_stiffness: six(6),
            environment_rest: six(7),
        };
        Ok(())
    }

    fn reset(&mut self) {
        self.state = State::new();
        self.generator.reset();
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let six = |index: usize| Vector::from_fn(|k, _| f64::from_bits(input[3 + 6 * index + k]));
        let wanted = PoseTarget { pose: numbers(&six(0)), rate: numbers(&six(1)), acceleration: numbers(&six(2)) };
        let (gauge, wrench) = (six(3), six(4));
        let mut status = 0;

        // Sense.
        let before = self.state.pose;
        let mut pose = before;
        for k in 0..6 {
            if !gauge[k].is_finite() {
                status |= 1 << (8 + k);
            }
        }
        if status == 0 {
            pose = self.sense(&gauge);
        }
        if self.state.started {
            let raw = (pose - before) / self.period;
            self.state.velocity = raw + (self.state.velocity - raw) * self.velocity_pole;
        }
        let wrench_good = wrench.iter().all(|x| x.is_finite());
        if wrench_good {
            self.state.wrench = wrench;
        } else {
            status |= 1 << 19;
        }
        let displacement = vector(&self.geometry.extensions(&numbers(&pose)));

        // Feedback on the last interval.
        let config = &self.config;
        let state = &mut self.state;
        let mode = config.mode;
        let [kp, ki, kv] = if matches!(mode, 0 | 4) { &config.position_gains } else { &config.gains };
        let (has_feedback, has_adaptation) = (mode == 0 || mode >= 4, matches!(mode, 2 | 3 | 5 | 6));
        let has_drift = matches!(mode, 3 | 6);
        let requested = Vector::from_fn(|leg, _| state.legs[leg].requested);
        if state.started && has_adaptation {
            let mismatch = displacement - (requested - state.load) - state.level - state.drift;
            let notched =
                Self::notch(self.notch.as_ref(), &mut state.innovation_notch, &(self.inverse_jacobian * mismatch));
            let innovation = self.jacobian * notched;
            state.level += (innovation + state.drift) * config.level_weight;
            if has_drift {
                state.drift += innovation * config.drift_weight;
            }
        }
        if !has_adaptation {
            state.level = Vector::zeros();
        }
        if !has_drift {
            state.drift = Vector::zeros();
        }
        let mut effort = Vector::zeros();
        if has_feedback {
            let error = vector(&state.target.pose) - pose;
            let error = Self::notch(self.notch.as_ref(), &mut state.error_notch, &error);
            if state.limited == 0 {
                state.integral += ki.component_mul(&error) * self.period;
            }
            effort = kp.component_mul(&error) + state.integral;
        }

        // Target and load of the coming interval.
        let (target, generator_status) = self.generator.next(input[0], &wanted);
        status |= generator_status;
        let mut push = match config.interaction {
            1 => config.environment_stiffness.component_mul(&(vector(&target.pose) - config.environment_rest)),
            2 => -self.state.wrench,
            _ => Vector::zeros(),
        };
        if has_feedback {
            push += kv.component_mul(&(vector(&self.state.target.rate) - self.state.velocity));
        }
        let demand = vector(&self.geometry.extensions(&target.pose));
        let lead = (demand - self.state.demand) * (self.lead / self.period);
        let load = self.load(&target, &push) + lead;
        let state = &mut self.state;
        let feedback = (self.inverse_jacobian.transpose() * effort).component_div(&self.stiffness);
        let request = demand + load + feedback - state.level - state.drift;

        // Six legs.
        state.limited = 0;
        for (index, leg) in state.legs.iter_mut().enumerate() {
            let table = &self.tables[index];
            let full = if mode == 0 { self.drive.gain * self.drive.max } else { table.everett(self.drive.max, 0.0) };
            let held = request[index].clamp(0.0, full);
            let drive = if mode == 0 { held / self.drive.gain } else { leg.memory.solve(table, self.drive.max, held) };
            let wanted = libm::floor(drive / self.drive.lsb + 0.5) as i64;
            let stepped = wanted.clamp(leg.code - config.step_max, leg.code + config.step_max);
            leg.code = stepped.clamp(config.code_min, config.code_max);
            let drive = leg.code as f64 * self.drive.lsb;
            leg.memory.apply(table, drive);
            leg.requested = if mode == 0 { self.drive.gain * drive } else { leg.memory.displacement() };
            if leg.code != wanted || held != request[index] {
                state.limited |= 1 << index;
            }
            output[index] = drive.to_bits();
            output[LEGS + index] = leg.requested.to_bits();
            output[2 * LEGS + index] = demand[index].to_bits();
            output[3 * LEGS + index] = state.level[index].to_bits();
            output[4 * LEGS + index] = state.drift[index].to_bits();
            output[5 * LEGS + index] = leg.code as u64;
            output[6 * LEGS + index] = pose[index].to_bits();
            output[7 * LEGS + index] = target.pose[index].to_bits();
            output[8 * LEGS + index] = load[index].to_bits();
        }
        output[9 * LEGS] = status | state.limited;
        state.pose = pose;
        state.target = target;
        state.load = load;
        state.demand = demand;
        state.started = true;
    }

    fn state_digest(&self) -> u64 {
        let reals = self.state.level.iter().chain(self.state.integral.iter()).chain(self.state.pose.iter());
        reals.fold(0, |digest: u64, x| digest.rotate_left(7) ^ x.to_bits())
    }
}
