//! What is counted beside the whole tick: parts of the controller, called on copies.
//!
//! To add a stage: name it in [`Stages::new`] and measure it in [`Stages::measure`]. Nothing here may touch
//! the state that the replay steps.

use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::hysteresis::{TABLES, Table};
use controller::{Config, LEGS, LegState, Real, SetpointKind, State, TickInput, actuate, kinematics, limits};
use core::hint::black_box;

/// Stages in the order in which they are reported.
pub struct Stages {
    /// The whole of `controller::step`.
    step: Stage,
    /// Pose to six leg displacements.
    kinematics: Stage,
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
        for ((leg, table), demand) in state.legs.iter().zip(&TABLES).zip(demand) {
            let request = demand - leg.estimate.correction();
            let (_, instructions) = counter.measure(|| invert(black_box(leg), table, request));
            self.inverse.add(instructions);
            let mut copy = *leg;
            let (_, instructions) = counter.measure(|| drive_leg(config, black_box(&mut copy), table, demand));
            self.actuate.add(instructions);
        }
    }

    /// All of them.
    pub fn all(&self) -> [Stage; 4] {
        [self.step, self.kinematics, self.inverse, self.actuate]
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
