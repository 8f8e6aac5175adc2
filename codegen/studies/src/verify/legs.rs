//! The exercise of six legs with a gauge each.

use std::f64::consts::TAU;

use host_sim::controller::{ControllerError, TickController};
use host_sim::noise::Gaussian;
use host_sim::trace::Trace;

use super::SEED;
use specgen_compiler::ir::{Ir, LEGS, SetpointKind};
use specgen_language::model::Model;

/// Set-points within the stroke; the gauges read the request plus noise.
///
/// # Errors
/// The controller lacks a word.
pub(super) fn exercise(
    controller: &mut dyn TickController,
    model: &Model,
    ir: &Ir,
    ticks: u32,
) -> Result<Trace, ControllerError> {
    controller.reset();
    let description = controller.description().clone();
    let mut trace = Trace::new(description.clone());
    let mut noise: Vec<Gaussian> = (0..LEGS as u64).map(|leg| Gaussian::new(model.sensor.noise, SEED, leg)).collect();
    let mut input = vec![0; description.input_names.len()];
    let mut output = vec![0; description.output_names.len()];
    let mut reading = [0.0; LEGS];
    let requested = description.output("requested[0]")?;
    for tick in 0..ticks {
        let time = f64::from(tick + 1) * model.timing.period;
        for (word, value) in input.iter_mut().zip(setpoint(model, ir, time).into_iter().chain(reading)) {
            *word = description.scalar.encode(value);
        }
        controller.step(&input, &mut output);
        trace.push(&input, &output, controller.state_digest());
        for ((reading, noise), word) in reading.iter_mut().zip(&mut noise).zip(&output[requested..]) {
            *reading = description.scalar.decode(*word) + noise.draw();
        }
    }
    Ok(trace)
}

/// A slow motion in all six axes about the middle of the stroke, within the accepted set-points.
fn setpoint(model: &Model, ir: &Ir, time: f64) -> [f64; 6] {
    let reach = ir
        .hysteresis
        .tables
        .iter()
        .filter_map(|nodes| nodes.get(nodes.len() - 1 - ir.hysteresis.grid))
        .fold(model.actuator.stroke, |least, full| if *full < least { *full } else { least });
    let swing = |axis: u32| libm::sin(TAU * (2.0 + 0.7 * f64::from(axis)) * time + f64::from(axis));
    match ir.defaults.setpoint {
        SetpointKind::Leg => [0, 1, 2, 3, 4, 5].map(|leg| reach * (0.5 + 0.3 * swing(leg))),
        SetpointKind::Pose => {
            let bounds = ir.bounds.pose;
            let within = |axis: usize, value: f64| {
                let limit = 0.95 * bounds[axis];
                if value > limit { limit } else { value }
            };
            // A lift along z lengthens every leg by its vertical component.
            let lift = reach * ir.kinematics.rest_length[0] / model.geometry.height;
            let turn = reach / model.geometry.joint_radius();
            [
                within(0, 0.1 * lift) * swing(0),
                within(1, 0.1 * lift) * swing(1),
                within(2, 0.5 * lift) * (0.8 + 0.2 * swing(2)),
                within(3, 0.05 * turn) * swing(3),
                within(4, 0.05 * turn) * swing(4),
                within(5, 0.05 * turn) * swing(5),
            ]
        }
    }
}
