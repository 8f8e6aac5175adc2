//! Checked values to the task-space part of the model.

use std::f64::consts::PI;

use super::fields::Fields;
use crate::model::{
    ControlMode, Environment, Frames, Gains, Interaction, PaperPath, Probe, SetpointRules, TaskSpace, Trajectory,
    TrajectoryKind,
};

/// Share of half the tick rate that the velocity filter passes if the spec does not say.
const CUTOFF_SHARE: f64 = 0.6;

/// `Some(None)` for a spec without `[control]`; `None` if a value is missing.
// The outer option says whether the spec could be read, the inner one whether it has the part.
#[expect(clippy::option_option)]
pub(super) fn task_space(f: &Fields) -> Option<Option<TaskSpace>> {
    if f.table("control").is_none() {
        return Some(None);
    }
    let period = f.number("timing.period")?;
    let environment = Environment {
        stiffness: f.list("control.environment.stiffness").unwrap_or([0.0; 6]),
        rest: f.list("control.environment.rest").unwrap_or([0.0; 6]),
    };
    Some(Some(TaskSpace {
        mode: match f.choice("control.mode")? {
            "p" => ControlMode::P,
            "f" => ControlMode::F,
            _ => ControlMode::PF,
        },
        probes: six(|gauge| probe(f, gauge))?,
        calibration: calibration(f),
        modal_damping: f.number("control.modal_damping")?,
        notch_damping: f.flag("control.notch")?.then(|| f.number("control.notch_damping").unwrap_or(1.0)),
        gains: gains(f, "gains"),
        position_gains: gains(f, "position_gains"),
        adaptation: bandwidths(f),
        velocity_cutoff: f.number("control.velocity_cutoff").unwrap_or(CUTOFF_SHARE * PI / period),
        interaction: match f.choice("control.interaction")? {
            "modelled" => Interaction::Modelled,
            "measured" => Interaction::Measured,
            _ => Interaction::None,
        },
        environment,
        lead: f.number("control.lead")?,
        transfer_time: f.number("control.transfer_time")?,
        setpoint: SetpointRules {
            bias: f.list("control.setpoint.bias")?,
            speed: f.list("control.setpoint.speed")?,
            acceleration: f.list("control.setpoint.acceleration")?,
            jerk: f.list("control.setpoint.jerk")?,
            stop_acceleration: f.list("control.setpoint.stop_acceleration"),
            stop_jerk: f.list("control.setpoint.stop_jerk"),
            stream_speed: f.list("control.setpoint.stream_speed")?,
            stale_ticks: f.whole("control.setpoint.stale_ticks")?,
        },
        frames: Frames { work: f.list("control.frames.work")?, tool: f.list("control.frames.tool")? },
        trajectories: (0..f.count("trajectory")).map(|index| trajectory(f, index)).collect::<Option<_>>()?,
    }))
}

/// One value for each gauge, if all are there.
fn six<T>(each: impl Fn(usize) -> Option<T>) -> Option<[T; 6]> {
    (0..6).map(each).collect::<Option<Vec<T>>>()?.try_into().ok()
}

fn probe(f: &Fields, gauge: usize) -> Option<Probe> {
    let key = |name: &str| format!("gauge[{gauge}].{name}");
    let point = f.list::<3>(&key("point"))?;
    let direction = unit(f.list(&key("direction"))?)?;
    // What faces the gauge at rest, unless the spec says otherwise: {P} then differs from {B} by the height alone.
    let [x, y, z] = point;
    let facing = [x, y, z - f.number("geometry.height")?];
    let normal = f.list(&key("target_normal"));
    Some(Probe {
        point,
        direction,
        plane_point: f.list(&key("target_point")).unwrap_or(facing),
        plane_normal: normal.map_or(Some(direction), unit)?,
    })
}

/// `vector` with length 1; `None` if it has none worth speaking of.
pub(super) fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
    (length > 1e-9).then(|| vector.map(|component| component / length))
}

/// Each gauge's own, or that of all; `None` if the gauge words are metres.
fn calibration(f: &Fields) -> Option<[Vec<f64>; 6]> {
    let of_all = f.numbers("sensor.calibration");
    six(|gauge| f.numbers(&format!("gauge[{gauge}].calibration")).or(of_all).map(<[f64]>::to_vec))
}

fn gains(f: &Fields, section: &str) -> Option<Gains> {
    Some(Gains {
        proportional: f.list(&format!("{section}.proportional"))?,
        integral: f.list(&format!("{section}.integral"))?,
        derivative: f.list(&format!("{section}.derivative"))?,
    })
}

fn bandwidths(f: &Fields) -> Option<[f64; 2]> {
    Some([f.number("adaptation.level_bandwidth")?, f.number("adaptation.drift_bandwidth")?])
}

fn trajectory(f: &Fields, index: usize) -> Option<Trajectory> {
    let key = |name: &str| format!("trajectory[{index}].{name}");
    let paper = |path| {
        Some(TrajectoryKind::Paper {
            path,
            as_printed: f.flag(&key("as_printed")).unwrap_or(false),
            frequency: f.number(&key("frequency"))?,
        })
    };
    let kind = match f.choice(&key("kind"))? {
        "case-1" => paper(PaperPath::Case1),
        "case-2" => paper(PaperPath::Case2),
        "machining" => paper(PaperPath::Machining),
        _ => Some(TrajectoryKind::Waveform {
            file: f.name(&key("file"))?.to_owned(),
            period: f.number(&key("period"))?,
            repeat: f.flag(&key("repeat")).unwrap_or(false),
        }),
    };
    Some(Trajectory { name: f.name(&key("name"))?.to_owned(), kind: kind? })
}
