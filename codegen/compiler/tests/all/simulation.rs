//! The same linear platform and the controller's tick in pose and leg coordinates, stepped finely: no modal coordinates in
//! the plant, no matrix exponential, no eigenvalue.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use specgen_compiler::stability::platform::RestDynamics;

/// Everything that a run needs; gains in pose coordinates, weights per tick.
#[derive(Debug, Clone)]
pub struct Run {
    pub rate: f64,
    pub damping: f64,
    pub lag: f64,
    /// Lag of the gauges, s; 0: none.
    pub gauge_lag: f64,
    pub axial_stiffness: f64,
    pub notch: Option<f64>,
    pub gain_ratio: f64,
    /// Ticks between reading and voltage.
    pub delay: f64,
    pub proportional: [f64; 6],
    pub integral: [f64; 6],
    pub derivative: [f64; 6],
    pub velocity_cutoff: f64,
    pub level_weight: f64,
    pub drift_weight: f64,
    /// Diagonal stiffness of a touched work piece, and whether its force is measured and fed forward.
    pub contact: [f64; 6],
    pub measured: bool,
    pub seconds: f64,
}

/// Six notches in modal coordinates, as difference equations of past inputs and outputs.
struct ModalNotch {
    to_modal: Matrix6<f64>,
    from_modal: Matrix6<f64>,
    coefficients: [[f64; 5]; 6],
    past: [[f64; 4]; 6],
}

impl ModalNotch {
    fn new(run: &Run, mass: &Matrix6<f64>, stiffness: &Matrix6<f64>) -> Self {
        // M^½ by nalgebra, K v = ω² M v.
        let of_mass = SymmetricEigen::new(*mass);
        let inverse_root = of_mass.eigenvectors
            * Matrix6::from_diagonal(&of_mass.eigenvalues.map(|x| 1.0 / x.sqrt()))
            * of_mass.eigenvectors.transpose();
        let modes = SymmetricEigen::new(inverse_root * stiffness * inverse_root);
        let from_modal = inverse_root * modes.eigenvectors;
        let first = modes.eigenvalues.min().sqrt();
        let coefficients = std::array::from_fn(|i| {
            let w: f64 = modes.eigenvalues[i].sqrt();
            let zeta = run.damping * w / first;
            let wide = run.notch.unwrap();
            // s = c (1 − q)/(1 + q) with q a tick's delay.
            let c = w / (0.5 * w / run.rate).tan();
            let polynomial =
                |z: f64| [c * c + 2.0 * z * w * c + w * w, 2.0 * (w * w - c * c), c * c - 2.0 * z * w * c + w * w];
            let (b, a) = (polynomial(zeta), polynomial(wide));
            [b[0] / a[0], b[1] / a[0], b[2] / a[0], a[1] / a[0], a[2] / a[0]]
        });
        Self { to_modal: from_modal.try_inverse().unwrap(), from_modal, coefficients, past: [[0.0; 4]; 6] }
    }

    fn step(&mut self, pose: Vector6<f64>) -> Vector6<f64> {
        let input = self.to_modal * pose;
        let mut output = Vector6::zeros();
        for i in 0..6 {
            let [b0, b1, b2, a1, a2] = self.coefficients[i];
            let [x1, x2, y1, y2] = self.past[i];
            output[i] = b0 * input[i] + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
            self.past[i] = [input[i], x1, output[i], y1];
        }
        self.from_modal * output
    }
}

struct Plant {
    inverse_mass: Matrix6<f64>,
    jacobian: Matrix6<f64>,
    contact: Matrix6<f64>,
    stiffness: f64,
    damper: f64,
    lag: f64,
    gauge_lag: f64,
}

/// Pose, its rate, leg displacements driven by the amplifiers, and the pose measured by gauges with lag.
type State = (Vector6<f64>, Vector6<f64>, Vector6<f64>, Vector6<f64>);

impl Plant {
    fn slope(&self, (x, v, d, shown): &State, command: &Vector6<f64>) -> State {
        let force = (d - self.jacobian * x) * self.stiffness - self.jacobian * v * self.damper;
        let acceleration = self.inverse_mass * (self.jacobian.transpose() * force - self.contact * x);
        let following = if self.gauge_lag > 0.0 { (x - shown) / self.gauge_lag } else { Vector6::zeros() };
        (*v, acceleration, (command - d) / self.lag, following)
    }

    /// Classical Runge–Kutta.
    fn step(&self, s: &State, command: &Vector6<f64>, dt: f64) -> State {
        let ahead = |k: &State, h: f64| (s.0 + k.0 * h, s.1 + k.1 * h, s.2 + k.2 * h, s.3 + k.3 * h);
        let k1 = self.slope(s, command);
        let k2 = self.slope(&ahead(&k1, 0.5 * dt), command);
        let k3 = self.slope(&ahead(&k2, 0.5 * dt), command);
        let k4 = self.slope(&ahead(&k3, dt), command);
        let sum = |a: Vector6<f64>, b: Vector6<f64>, c: Vector6<f64>, d: Vector6<f64>| (a + 2.0 * (b + c) + d) / 6.0;
        (
            s.0 + sum(k1.0, k2.0, k3.0, k4.0) * dt,
            s.1 + sum(k1.1, k2.1, k3.1, k4.1) * dt,
            s.2 + sum(k1.2, k2.2, k3.2, k4.2) * dt,
            s.3 + sum(k1.3, k2.3, k3.3, k4.3) * dt,
        )
    }
}

fn matrix(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

/// Whether a kick dies out: the pose at the end of the run is smaller than in its middle.
pub fn settles(run: &Run, rest: &RestDynamics) -> bool {
    let (mass, jacobian) = (matrix(&rest.mass), matrix(&rest.jacobian));
    let stiffness = jacobian.transpose() * jacobian * run.axial_stiffness;
    let inverse_mass = mass.try_inverse().unwrap();
    let first = (inverse_mass * stiffness).complex_eigenvalues().iter().map(|x| x.re).fold(f64::INFINITY, f64::min);
    let plant = Plant {
        inverse_mass,
        jacobian,
        contact: Matrix6::from_diagonal(&Vector6::from(run.contact)),
        stiffness: run.axial_stiffness,
        damper: 2.0 * run.damping / first.sqrt() * run.axial_stiffness,
        lag: run.lag,
        gauge_lag: run.gauge_lag,
    };
    let period = 1.0 / run.rate;
    // 1/30 of the shortest period of a mode at least: Runge–Kutta's own damping is then far below 1e-4 of a mode's.
    let mut fine = (period * 800.0 * 60.0).ceil().max(4.0) as usize;
    if run.gauge_lag > 0.0 {
        fine = fine.max((4.0 * period / run.gauge_lag).ceil() as usize);
    }
    let mut notches =
        run.notch.map(|_| (ModalNotch::new(run, &mass, &stiffness), ModalNotch::new(run, &mass, &stiffness)));
    let (inverse, inverse_transposed) = (jacobian.try_inverse().unwrap(), jacobian.transpose().try_inverse().unwrap());
    let vector = |gains: &[f64; 6]| Vector6::from(*gains);
    let pole = (-run.velocity_cutoff * period).exp();

    let kick = Vector6::new(1e-6, -2e-6, 1.5e-6, 1e-5, 2e-5, -1e-5);
    let mut state: State = (kick, Vector6::zeros(), Vector6::zeros(), kick);
    let (mut level, mut drift, mut sum) = (Vector6::zeros(), Vector6::zeros(), Vector6::zeros());
    let (mut last_pose, mut velocity) = (state.0, Vector6::zeros());
    // q̂ − p of the last interval; delayed requests.
    let mut known = Vector6::zeros();
    let mut line = vec![Vector6::<f64>::zeros(); run.delay as usize + 1];
    let ticks = (run.seconds * run.rate) as usize;
    let (mut middle, mut late) = (0.0_f64, 0.0_f64);
    let scale = Vector6::new(1.0, 1.0, 1.0, 0.1, 0.1, 0.1);
    for tick in 0..ticks {
        let pose = if run.gauge_lag > 0.0 { state.3 } else { state.0 };
        let mut error = -pose;
        let mut innovation = inverse * (jacobian * pose - known - level - drift);
        if let Some((of_error, of_innovation)) = &mut notches {
            error = of_error.step(error);
            innovation = of_innovation.step(innovation);
        }
        let innovation = jacobian * innovation;
        level += run.level_weight * (innovation + drift);
        drift += run.drift_weight * innovation;
        sum += vector(&run.integral).component_mul(&error) * period;
        velocity = pole * velocity + (1.0 - pole) * (pose - last_pose) / period;
        last_pose = pose;
        let mut load_force = -vector(&run.derivative).component_mul(&velocity);
        if run.measured {
            // The work piece pushes with −K_e x; the load to be held is its opposite.
            load_force += vector(&run.contact).component_mul(&state.0);
        }
        let load = inverse_transposed * load_force / run.axial_stiffness;
        let feedback =
            inverse_transposed * (vector(&run.proportional).component_mul(&error) + sum) / run.axial_stiffness;
        let request = load + feedback - level - drift;
        known = request - load;
        line.push(request);
        // The first part of the interval still has the previous request.
        let (older, newer) = (line[0] * run.gain_ratio, line[1] * run.gain_ratio);
        line.remove(0);
        let part = run.delay.fract();
        for (command, share) in [(older, part), (newer, 1.0 - part)] {
            let steps = (fine as f64 * share).ceil();
            for _ in 0..steps as usize {
                state = plant.step(&state, &command, period * share / steps);
            }
        }
        let size = state.0.component_mul(&scale).norm();
        if size > 1.0 || size.is_nan() {
            return false;
        }
        let part = tick as f64 / ticks as f64;
        if (0.45..0.55).contains(&part) {
            middle = middle.max(size);
        } else if part >= 0.9 {
            late = late.max(size);
        }
    }
    late < middle || late < 1e-15
}
