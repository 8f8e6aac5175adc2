//! Checked values to the [`Model`].

use super::fields::Fields;
use super::{joints, task_space};
use crate::model::{
    Actuator, Adaptation, AdaptationMode, Amplifier, ControllerOptions, Dac, Geometry, Hysteresis, LegBody, Mcu, Model,
    RateDependence, RigidBody, Robust, Scalar, Sensor, SetpointKind, Supervisor, Target, Timing, Workspace,
};

/// The model, or `None` if a value is missing: then there is a finding for it.
pub(super) fn model(f: &Fields) -> Option<Model> {
    Some(Model {
        name: f.name("name")?.to_owned(),
        geometry: geometry(f)?,
        platform: RigidBody {
            mass: f.number("platform.mass")?,
            inertia: f.list("platform.inertia")?,
            products: f.list("platform.products")?,
            center_of_mass: f.list("platform.center_of_mass")?,
        },
        leg: LegBody {
            fixed_mass: f.number("leg.fixed_mass")?,
            extensible_mass: f.number("leg.extensible_mass")?,
            fixed_inertia: f.number("leg.fixed_inertia")?,
            extensible_inertia: f.number("leg.extensible_inertia")?,
            fixed_center: f.number("leg.fixed_center")?,
            extensible_center: f.number("leg.extensible_center")?,
            joint_angle: f.number("leg.joint_angle"),
        },
        actuator: Actuator {
            stacks: f.whole("actuator.stacks")?,
            stack_gain: f.number("actuator.stack_gain")?,
            stroke: f.number("actuator.stroke")?,
            voltage: f.list("actuator.voltage")?,
            slew_rate: f.number("actuator.slew_rate")?,
            axial_stiffness: f.number("actuator.axial_stiffness")?,
            resonance: f.number("actuator.resonance")?,
            damping_ratio: f.number("actuator.damping_ratio")?,
            capacitance: f.number("actuator.capacitance"),
        },
        amplifier: Amplifier {
            lag: f.number("amplifier.lag")?,
            noise: f.number("amplifier.noise")?,
            current: f.number("amplifier.current"),
        },
        dac: Dac { bits: f.whole("dac.bits")?, range: f.list("dac.range")? },
        sensor: Sensor {
            range: f.list("sensor.range")?,
            noise: f.number("sensor.noise")?,
            bits: f.whole("sensor.bits")?,
            input_range: f.list("sensor.input_range"),
        },
        hysteresis: Hysteresis {
            grid: f.whole("hysteresis.grid")?,
            memory: f.whole("hysteresis.memory")?,
            records: f.texts("hysteresis.records")?.to_vec(),
            rate: rate(f)?,
            dead_time: f.number("hysteresis.dead_time")?,
        },
        adaptation: adaptation(f)?,
        timing: Timing { period: f.number("timing.period")? },
        workspace: Workspace { translation: f.list("workspace.translation")?, rotation: f.list("workspace.rotation")? },
        controller: ControllerOptions {
            scalar: if f.choice("controller.scalar")? == "f32" { Scalar::F32 } else { Scalar::F64 },
            setpoint: if f.choice("controller.setpoint")? == "leg" { SetpointKind::Leg } else { SetpointKind::Pose },
        },
        target: target(f)?,
        task_space: task_space::task_space(f)?,
        precision: f.number("requirements.precision"),
        supervisor: supervisor(f)?,
        robust: robust(f),
        spans: f.spans(),
    })
}

fn rate(f: &Fields) -> Option<RateDependence> {
    Some(match f.choice("hysteresis.rate")? {
        "dynamic-preisach" => RateDependence::DynamicPreisach(f.texts("hysteresis.rate_tables")?.to_vec()),
        "creep" => {
            let times = f.numbers("hysteresis.creep_times")?;
            let weights = f.numbers("hysteresis.creep_weights")?;
            RateDependence::Creep(times.iter().zip(weights).map(|(time, weight)| [*time, *weight]).collect())
        }
        _ => RateDependence::Static,
    })
}

pub(super) fn geometry(f: &Fields) -> Option<Geometry> {
    let height = f.number("geometry.height")?;
    if let Some(base_joints) = f.rows("geometry.base_joints") {
        return Some(Geometry { base_joints, platform_joints: f.rows("geometry.platform_joints")?, height });
    }
    Some(Geometry {
        base_joints: joints::base_joints(f.number("geometry.base_radius")?, f.number("geometry.base_angle")?),
        platform_joints: joints::platform_joints(
            f.number("geometry.platform_radius")?,
            f.number("geometry.platform_angle")?,
        ),
        height,
    })
}

fn adaptation(f: &Fields) -> Option<Adaptation> {
    Some(Adaptation {
        mode: mode(f)?,
        // A mode that needs a weight has one: the check has seen to it. Zero leaves the estimate as it is.
        level_weight: weight(f, "level").unwrap_or(0.0),
        drift_weight: weight(f, "drift").unwrap_or(0.0),
        run_interval: f.whole("adaptation.run_interval")?,
        gain_ratio: f.list("adaptation.gain_ratio")?,
    })
}

pub(super) fn mode(f: &Fields) -> Option<AdaptationMode> {
    Some(match f.choice("adaptation.mode")? {
        "pcc" => AdaptationMode::Pcc,
        "ewma" => AdaptationMode::Ewma,
        _ => AdaptationMode::Invhys,
    })
}

/// Weight per run of "level" or "drift", given as such or as a bandwidth: ω = Ω · period · run_interval.
pub(super) fn weight(f: &Fields, which: &str) -> Option<f64> {
    if let Some(weight) = f.number(&format!("adaptation.{which}_weight")) {
        return Some(weight);
    }
    let run: u32 = f.whole("adaptation.run_interval")?;
    Some(f.number(&format!("adaptation.{which}_bandwidth"))? * f.number("timing.period")? * f64::from(run))
}

fn supervisor(f: &Fields) -> Option<Supervisor> {
    let number = |key: &str| f.number(&format!("supervisor.{key}"));
    Some(Supervisor {
        rest_voltage: number("rest_voltage"),
        arm_time: number("arm_time"),
        ramp_rate: number("ramp_rate"),
        gauge_time: number("gauge_time"),
        stuck_motion: number("stuck_motion"),
        stuck_time: number("stuck_time"),
        disagreement: number("disagreement"),
        disagreement_time: number("disagreement_time"),
        tracking_error: number("tracking_error")?,
        tracking_time: number("tracking_time"),
        voltage_time: number("voltage_time"),
        slew_time: number("slew_time"),
        missed_ticks: f.whole("supervisor.missed_ticks")?,
        host_lost: f.list("supervisor.host_lost"),
    })
}

fn robust(f: &Fields) -> Robust {
    Robust {
        mass: f.list("robust.mass"),
        stiffness: f.list("robust.stiffness"),
        damping: f.list("robust.damping"),
        gain: f.list("robust.gain"),
        hysteresis: f.list("robust.hysteresis"),
        creep: f.list("robust.creep"),
        lag: f.list("robust.lag"),
        noise: f.list("robust.noise"),
        delay_ticks: f.whole("robust.delay_ticks"),
        max_error: f.number("robust.max_error"),
        max_orientation: f.number("robust.max_orientation"),
    }
}

fn target(f: &Fields) -> Option<Target> {
    let bytes = |key: &str| f.number(key).map(|bytes| bytes as u64);
    Some(Target {
        mcu: Mcu::named(f.choice("target.mcu")?)?,
        flash: bytes("target.budget.flash"),
        ram: bytes("target.budget.ram"),
        stack: bytes("target.budget.stack"),
        instructions: f.whole("target.budget.instructions"),
    })
}
