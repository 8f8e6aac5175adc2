//! Constants of the control law in task space: maps at rest, modal notch, settings at start-up.

use super::linear;
use crate::ir::{
    ControlLaw, CorrectionLimit, Gains, Interaction, LEGS, Notch, PlatformDefaults, Resonator, Scalar, Section,
};
use crate::stability::platform::{self as design, Design, RestDynamics};
use specgen_language::model::{self, Model};
use specgen_numerics::{Matrix6, multiply6, transpose6};

const IDENTITY: Matrix6 = {
    let mut matrix = [[0.0; 6]; 6];
    let mut k = 0;
    while k < 6 {
        matrix[k][k] = 1.0;
        k += 1;
    }
    matrix
};
/// Offset below which a change of mode is complete, m: a hundredth of a converter step, far below the resolution of a gauge.
const TRANSFER_NEGLIGIBLE: f64 = 1e-11;
/// Time in which a correction may go from zero to its limit, s.
const CORRECTION_TIME: f64 = 1e-3;

/// Constants of (7) and of the composition of P and F. `rest_force` are the leg forces at rest, N.
pub(super) fn law(
    model: &Model,
    task: &model::TaskSpace,
    scalar: Scalar,
    rest: &RestDynamics,
    rest_force: &[f64; LEGS],
    design: &Design,
) -> ControlLaw {
    let round = |value: f64| scalar.round(value);
    let round_all = |matrix: Matrix6| linear::with_alike(without_dust(matrix)).map(|row| row.map(round));
    let compliance = 1.0 / model.actuator.axial_stiffness;
    // A singular geometry was refused when lowering the dynamics.
    let legs_to_pose = linear::inverse(&rest.jacobian).unwrap_or([[0.0; 6]; 6]);
    let wrench_to_legs = transpose6(&legs_to_pose).map(|row| row.map(|value| value * compliance));
    // Without a notch pose axes serve as modes: the run-to-run law is the same in all coordinates.
    let (to_modal, from_modal) =
        design.notch.as_ref().map_or((IDENTITY, IDENTITY), |notch| (notch.to_modal, notch.from_modal));
    let legs_to_modes = multiply6(&to_modal, &legs_to_pose);
    let notch = design.notch.as_ref().map(|notch| Notch {
        pose_to_modes: round_all(notch.to_modal),
        modes_to_pose: round_all(notch.from_modal),
        // b₀ = 1 − g, b₁ = a₁, b₂ = a₂ + g.
        sections: notch.sections.map(|section| Section { depth: round(1.0 - section.b[0]), a: section.a.map(round) }),
    });
    let volts_per_cell = (model.actuator.voltage[1] - model.actuator.voltage[0]) / model.hysteresis.grid as f64;
    let metres_per_cell = model.actuator.leg_gain() * volts_per_cell;
    ControlLaw {
        period: round(model.timing.period),
        compliance: round(compliance),
        wrench_to_legs: round_all(wrench_to_legs),
        legs_to_wrench: round_all(
            transpose6(&rest.jacobian).map(|row| row.map(|value| value * model.actuator.axial_stiffness)),
        ),
        force_to_modes: round_all(multiply6(&legs_to_modes, &wrench_to_legs)),
        legs_to_modes: round_all(legs_to_modes),
        modes_to_legs: round_all(multiply6(&rest.jacobian, &from_modal)),
        rest_force: rest_force.map(round),
        wrench_limit: largest_wrench(model).map(round),
        lead: round(design.lead / model.timing.period),
        own_leads: own_leads(task, design.lead).map(|lead| round(lead / model.timing.period)).collect(),
        transfer_keep: round(libm::exp(-model.timing.period / task.transfer_time)),
        transfer_negligible: round(TRANSFER_NEGLIGIBLE),
        cells_per_metre: round(1.0 / metres_per_cell),
        metres_per_cell: round(metres_per_cell),
        bias: task.setpoint.bias,
        notch,
        damping: design.damping.as_ref().map(|damping| {
            damping.sections.map(|section| Resonator { b: section.b.map(round), a: section.a.map(round) })
        }),
        hands_over: task.hand_over,
        correction: task.correction.map(|most| {
            let turn = most / model.geometry.joint_radius();
            [most, most, most, turn, turn, turn].map(|most| CorrectionLimit {
                most: round(most),
                step: round(most * model.timing.period / CORRECTION_TIME),
            })
        }),
    }
}

/// The lead (s) of each trajectory, by default that of the control, `usual`; empty if no trajectory has its own.
fn own_leads(task: &model::TaskSpace, usual: f64) -> impl Iterator<Item = f64> {
    let any = task.trajectories.iter().any(|trajectory| trajectory.lead.is_some());
    let all = task.trajectories.iter().map(move |trajectory| trajectory.lead.unwrap_or(usual));
    all.take(if any { task.trajectories.len() } else { 0 })
}

/// The matrix with rounding errors set to zero: entries below 10⁻¹² of the largest in their column. A symmetric
/// platform has many, and a zero costs no instruction.
fn without_dust(matrix: Matrix6) -> Matrix6 {
    let mut largest = [0.0; 6];
    for row in &matrix {
        for (most, value) in largest.iter_mut().zip(row) {
            if value.abs() > *most {
                *most = value.abs();
            }
        }
    }
    matrix.map(|row| {
        let mut clean = row;
        for (value, most) in clean.iter_mut().zip(largest) {
            *value = linear::dusted(*value, 10.0 * most);
        }
        clean
    })
}

/// Largest wrench of six blocked legs, N and N m about P_C: a sensor that reads more is faulty.
fn largest_wrench(model: &Model) -> [f64; 6] {
    let force = LEGS as f64 * model.actuator.axial_stiffness * model.actuator.stroke;
    let radius = model.geometry.platform_joints.iter().fold(0.0, |most: f64, joint| {
        let length = libm::sqrt(joint[0] * joint[0] + joint[1] * joint[1] + joint[2] * joint[2]);
        if length > most { length } else { most }
    });
    [force, force, force, force * radius, force * radius, force * radius]
}

/// The `Config` at start-up.
pub(super) fn defaults(model: &Model, task: &model::TaskSpace, scalar: Scalar, design: &Design) -> PlatformDefaults {
    let round = |value: f64| scalar.round(value);
    let gains = |tuning: &design::Tuning| Gains {
        proportional: tuning.proportional.map(round),
        integral: tuning.integral.map(round),
        derivative: tuning.derivative.map(round),
    };
    PlatformDefaults {
        mode: design::start_mode(model, task),
        law: design::start_law(model),
        interaction: match task.interaction {
            model::Interaction::None => Interaction::Neglected,
            model::Interaction::Modelled => Interaction::Modelled,
            model::Interaction::Measured => Interaction::Measured,
        },
        level_weight: round(design.combined.level_bandwidth * model.timing.period),
        drift_weight: round(design.combined.drift_bandwidth * model.timing.period),
        gains: gains(&design.combined),
        position_gains: gains(&design.position),
        environment_stiffness: task.environment.stiffness.map(round),
        environment_rest: task.environment.rest.map(round),
        triggers: Vec::new(),
        input: task.triggers.iter().any(|trigger| trigger.kind == model::TriggerKind::Input),
    }
}
