//! Lowers model and tables to IR: all arithmetic on constants is here.
//!
//! Trigonometry uses `libm`, so that the same spec gives the same bytes on every computer.

mod actuation;
mod dynamics;
mod gauge_converter;
mod integrity;
mod kinematics;
mod linear;
mod load;
mod permitted;
mod rate;
mod sensing;
pub mod setpoint;
pub(crate) mod supervision;
mod task_space;
pub mod triggers;

pub use dynamics::{GRAVITY, platform};
pub(crate) use integrity::digest;
pub use kinematics::{inverse_jacobian, joint_positions, leg_jacobian};
pub use load::describe as describe_load;
pub(crate) use sensing::seen;
pub use sensing::{PoseNoise, pose_noise, poses_per_reading, reading_noise, readings_per_pose};
pub use supervision::{describe_wiring, single_faults};

use crate::ir::{
    Bounds, Defaults, Hysteresis, Ir, Load, PlatformDefaults, Scalar, Sensing, SetpointKind, Setpoints, TaskSpace,
};
use crate::stability::platform::{Design, RestDynamics, start_law};
use specgen_identify::everett::EverettTable;
use specgen_identify::leg_model::{Around, strokes};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{self, Model};
use specgen_numerics::leg_forces;
use specgen_runtime::Motion;

/// Beyond this many strokes a leg set-point is a mistake, not a demand to saturate on.
const LEG_SETPOINT_STROKES: f64 = 2.0;

/// Where a controller comes from.
#[derive(Debug, Clone)]
pub struct Origin<'a> {
    /// Hex digest of spec and records.
    pub digest: &'a str,
    /// Values that were not measured, see [`Assumptions::list`](crate::assumed::Assumptions::list).
    pub assumed: Vec<String>,
}

/// Computes every constant of the controller.
///
/// `task` is the tuning of a controller in task space and its set-points ([`setpoint::lower`]), none for six legs with their own
/// gauges; `tables` holds one Everett table for all legs or one for each, `rate_tables` those of the second weight of (6), if the
/// spec names any, `around` what is around each of `tables`. `origin` does not change the law.
///
/// # Errors
/// Findings about values that cannot be turned into a controller (a converter too coarse
/// for the grid, a workspace too large for the legs), with their place in the spec.
pub fn lower(
    model: &Model,
    task: Option<(&Design, Setpoints)>,
    tables: &[EverettTable],
    rate_tables: &[EverettTable],
    around: &[Option<Around>],
    origin: Origin<'_>,
) -> Result<Ir, Vec<Diagnostic>> {
    let scalar = scalar(model);
    let hysteresis = hysteresis(model, tables, rate_tables, around, scalar);
    let (actuation, max_step) = actuation::lower(model, scalar)?;
    let stroke = model.actuator.stroke;
    let round = |value| scalar.round(value);
    let defaults = Defaults {
        law: start_law(model),
        setpoint: match model.controller.setpoint {
            model::SetpointKind::Pose => SetpointKind::Pose,
            model::SetpointKind::Leg => SetpointKind::Leg,
        },
        level_weight: round(model.adaptation.level_weight),
        drift_weight: round(model.adaptation.drift_weight),
        run_interval: model.adaptation.run_interval,
        max_step,
        period: model.timing.period,
        leg_gain: model.actuator.leg_gain(),
    };
    let rings = match &task {
        // The longest over all control modes: without a notch, feedback reduces the damping of the platform's modes.
        Some((design, _)) => {
            design.margins.iter().flat_map(|margins| &margins.modes).fold(0.0, |longest: f64, mode| {
                let rings = 1.0 / (core::f64::consts::TAU * mode.frequency * mode.damping_ratio);
                if mode.frequency > supervision::LOWEST_SWING && rings > longest { rings } else { longest }
            })
        }
        None => 1.0 / (core::f64::consts::TAU * model.actuator.resonance * model.actuator.damping_ratio),
    };
    let dynamics = dynamics::lower(model, scalar)?;
    let task_space = match (&model.task_space, task) {
        (Some(task), Some((design, setpoints))) => {
            let load = load::lower(model, task, scalar, &dynamics, &setpoints, actuation.volts_per_code)?;
            Some(task_space(model, task, scalar, design, setpoints, load)?)
        }
        _ => None,
    };
    let integrity = integrity::lower(
        integrity::identity(&model.name, &origin, scalar),
        scalar,
        &hysteresis,
        &actuation,
        &defaults,
        task_space.as_ref(),
    );
    let unseen = gauge_converter::unseen(model, task_space.as_ref().map(|task| &task.sensing));
    if !unseen.is_empty() {
        return Err(unseen);
    }
    let gauge_converter = gauge_converter::lower(model, task_space.as_ref().map(|task| &task.sensing), scalar);
    let kinematics = kinematics::lower(model, scalar)?;
    let bounds = Bounds {
        pose: model.workspace.bounds().map(round),
        leg: [-stroke, LEG_SETPOINT_STROKES * stroke].map(round),
        sensor: model.sensor.range.map(round),
        stroke: self::stroke(model, &strokes(tables, around)),
    };
    Ok(Ir {
        name: model.name.clone(),
        digest: origin.digest.to_owned(),
        assumed: origin.assumed,
        specgen_version: env!("CARGO_PKG_VERSION").to_owned(),
        scalar,
        permitted: permitted::lower(
            &actuation,
            &defaults,
            task_space.as_ref(),
            &bounds,
            &hysteresis,
            &kinematics,
            scalar,
        ),
        kinematics,
        dynamics,
        supervision: supervision::lower(
            model,
            &hysteresis,
            &actuation,
            max_step,
            task_space.as_ref().map(|task| &task.sensing),
            rings,
            scalar,
        )?,
        hysteresis,
        bounds,
        gauge_converter,
        actuation,
        defaults,
        task_space,
        integrity,
    })
}

/// Travel of every leg, m: the smaller of the data sheet's stroke and that of every leg's model.
#[must_use]
pub fn stroke(model: &Model, strokes: &[f64]) -> f64 {
    strokes.iter().copied().fold(model.actuator.stroke, |a, b| if b < a { b } else { a })
}

/// Arithmetic of the emitted controller.
#[must_use]
pub fn scalar(model: &Model) -> Scalar {
    match model.controller.scalar {
        model::Scalar::F32 => Scalar::F32,
        model::Scalar::F64 => Scalar::F64,
    }
}

/// The constants of the gauges as a controller of `scalar` holds them.
///
/// # Errors
/// As [`lower`].
pub fn gauges(model: &Model, task: &model::TaskSpace, scalar: Scalar) -> Result<Sensing, Vec<Diagnostic>> {
    sensing::lower(model, task, scalar)
}

/// The part that only a controller in task space has.
fn task_space(
    model: &Model,
    task: &model::TaskSpace,
    scalar: Scalar,
    design: &Design,
    setpoints: Setpoints,
    load: Load,
) -> Result<TaskSpace, Vec<Diagnostic>> {
    let platform = platform(model)?;
    let rest = RestDynamics::of(&platform);
    let rest_force = leg_forces(&platform, &Motion::new());
    let noise = pose_noise(model)?.map_or([0.0; 6], |noise| noise.pose);
    Ok(TaskSpace {
        sensing: sensing::lower(model, task, scalar)?,
        setpoints,
        load,
        law: task_space::law(model, task, scalar, &rest, &rest_force, design),
        defaults: PlatformDefaults {
            triggers: triggers::lower(model, task, &noise, scalar),
            ..task_space::defaults(model, task, scalar, design)
        },
    })
}

/// Tables in the layout of the controller, each distinct one once, with their indices and rates.
fn hysteresis(
    model: &Model,
    tables: &[EverettTable],
    rate_tables: &[EverettTable],
    around: &[Option<Around>],
    scalar: Scalar,
) -> Hysteresis {
    let (distinct, table_of_leg) = rate::distinct(tables, 1.0, scalar);
    Hysteresis {
        grid: model.hysteresis.grid,
        memory: model.hysteresis.memory,
        tables: distinct,
        table_of_leg,
        rate: rate::lower(model, tables, rate_tables, around, scalar),
        lead: rate::lead(model, tables, around, scalar),
        identified: model.hysteresis.is_identified(),
    }
}
