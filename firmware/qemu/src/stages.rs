//! What is counted beside the whole tick: parts of the controller, called on copies.
//!
//! To add a stage: name it in [`Stages::new`] and measure it in [`Stages::measure`]. Nothing here may touch
//! the state that the replay steps.

use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::dynamics::{self, Load, Motion};
use controller::hysteresis::{TABLES, Table};
use controller::{Config, LEGS, LegState, Real, SetpointKind, State, TickInput, actuate, kinematics, limits};
use core::hint::black_box;

/// Stages in the order in which they are reported.
pub struct Stages {
    /// The whole of `controller::step`.
    step: Stage,
    /// Pose to six leg displacements.
    kinematics: Stage,
    /// Motion to six leg forces.
    dynamics: Stage,
    /// Motion and wrench to six leg forces and displacements.
    load: Stage,
    /// Γ⁻¹ of one leg: displacement to drive.
    inverse: Stage,
    /// One leg from demand to code: Γ⁻¹, converter and limits, and the reversal memory brought up to date.
    actuate: Stage,
}

impl Stages {
    /// Nothing counted yet.
    pub const fn new() -> Self {
        Self {
            step: Stage::new("step"),
            kinematics: Stage::new("kinematics"),
            dynamics: Stage::new("dynamics"),
            load: Stage::new("load"),
            inverse: Stage::new("inverse"),
            actuate: Stage::new("actuate"),
        }
    }

    /// Adds one tick of `controller::step`.
    pub fn add_step(&mut self, instructions: u32) {
        self.step.add(instructions);
    }

    /// Measures the parts for the tick that is about to be stepped.
    ///
    /// The legs are asked for the demand of this tick with the estimates of the last one, which differs from what the
    /// tick itself asks by one update of the estimates.
    #[inline(never)]
    pub fn measure(&mut self, counter: &mut InstructionCounter, config: &Config, state: &State, input: &TickInput) {
        let mut demand = state.demand;
        match config.setpoint() {
            SetpointKind::Pose if kinematics::pose_is_accepted(&input.setpoint) => {
                let (displacements, instructions) = counter.measure(|| pose_to_legs(black_box(&input.setpoint)));
                self.kinematics.add(instructions);
                demand = displacements;
            }
            SetpointKind::Leg if limits::leg_setpoint_is_accepted(&input.setpoint) => demand = input.setpoint,
            _ => {}
        }
        self.measure_dynamics(counter, &input.setpoint);
        for ((leg, table), demand) in state.legs.iter().zip(&TABLES).zip(demand) {
            let request = demand - leg.estimate.correction();
            let (_, instructions) = counter.measure(|| invert(black_box(leg), table, request));
            self.inverse.add(instructions);
            let mut copy = *leg;
            let (_, instructions) = counter.measure(|| drive_leg(config, black_box(&mut copy), table, demand));
            self.actuate.add(instructions);
        }
    }

    /// The dynamics at the set-point, if it is a pose, and at rest otherwise; moving and accelerating about as a platform
    /// does.
    #[allow(unsafe_code)] // Functions are called from assembly that counts them.
    fn measure_dynamics(&mut self, counter: &mut InstructionCounter, setpoint: &[Real; 6]) {
        let pose = if kinematics::pose_is_accepted(setpoint) { *setpoint } else { [0.0; 6] };
        let motion = Motion {
            pose,
            rate: [1e-3, -2e-3, 3e-3, 4e-3, -5e-3, 6e-3],
            acceleration: [1.0, -2.0, 3.0, -4.0, 5.0, -6.0],
        };
        let wrench: [Real; 6] = [1.0, 2.0, -3.0, 0.1, -0.2, 0.3];
        let mut force = [0.0; 6];
        let mut both = Load { displacement: [0.0; 6], force: [0.0; 6] };
        let address = |value: &Motion<Real>| (&raw const *value) as usize;
        // SAFETY: the C ABI passes the addresses in the first registers.
        unsafe {
            let arguments = [(&raw mut force) as usize, address(&motion), 0, 0];
            self.dynamics.add(counter.measure_call(specgen_leg_forces as *const (), arguments));
            let arguments = [(&raw mut both) as usize, address(&motion), (&raw const wrench) as usize, 0];
            self.load.add(counter.measure_call(specgen_load as *const (), arguments));
        }
        black_box((&force, &both));
    }

    /// All of them.
    pub fn all(&self) -> [Stage; 6] {
        [self.step, self.kinematics, self.dynamics, self.load, self.inverse, self.actuate]
    }
}

#[inline(never)]
fn pose_to_legs(pose: &[Real; 6]) -> [Real; LEGS] {
    kinematics::leg_displacements(pose)
}

#[inline(never)]
fn invert(leg: &LegState, table: &Table, request: Real) -> Real {
    leg.memory.solve(table, request)
}

#[inline(never)]
fn drive_leg(config: &Config, leg: &mut LegState, table: &Table, demand: Real) -> bool {
    actuate(config, leg, table, demand)
}

/// What the stage `dynamics` counts; specgen looks the symbol up for its size.
#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`.
extern "C" fn specgen_leg_forces(force: &mut [Real; 6], motion: &Motion<Real>) {
    *force = dynamics::leg_forces(motion);
}

/// What the stage `load` counts.
#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`.
extern "C" fn specgen_load(both: &mut Load<Real>, motion: &Motion<Real>, wrench: &[Real; 6]) {
    *both = dynamics::load(motion, wrench);
}
