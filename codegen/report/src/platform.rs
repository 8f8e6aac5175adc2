//! 3-D view of the platform, with rotation and playback: data for the page's script.

use host_sim::closed_loop::Tracking;
use host_sim::platform::rig::PlatformRun;
use serde_json::{Value, json};
use specgen_numerics::jacobian;
use specgen_runtime::Platform;

use super::section::Part;
use specgen_compiler::lower;
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::model::Model;

/// Number of poses in a playback.
const POSES: usize = 400;

/// Moments of a run.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// Time between moments, s.
    step: f64,
    /// Pose relative to rest, m and rad, and extension of each leg, m.
    moments: Vec<[[f64; 6]; 2]>,
}

impl Motion {
    /// The true poses of a run; leg extensions by J at rest.
    pub fn of_platform(platform: &Platform<f64>, run: &PlatformRun, interval: f64) -> Self {
        let jacobian = jacobian(platform, &[0.0; 6]);
        let poses: Vec<[f64; 6]> = run.samples.iter().map(|sample| sample.tick.pose).collect();
        Self::thinned(interval, &poses, |pose| [*pose, product(&jacobian, pose)])
    }

    /// Gauge readings of six legs, and the resulting pose by J⁻¹ at rest. `None` without a platform.
    pub fn of_legs(model: &Model, run: &Tracking) -> Option<Self> {
        let inverse = lower::inverse_jacobian(&model.geometry)?;
        let legs: Vec<[f64; 6]> = run.samples.iter().map(|sample| sample.measured).collect();
        Some(Self::thinned(run.interval, &legs, |legs| [product(&inverse, legs), *legs]))
    }

    fn thinned(interval: f64, all: &[[f64; 6]], moment: impl Fn(&[f64; 6]) -> [[f64; 6]; 2]) -> Self {
        let every = all.len().div_ceil(POSES).max(1);
        Self { step: every as f64 * interval, moments: all.iter().step_by(every).map(moment).collect() }
    }
}

fn product(rows: &[[f64; 6]; 6], vector: &[f64; 6]) -> [f64; 6] {
    rows.map(|row| row.iter().zip(vector).fold(0.0, |sum, (a, b)| sum + a * b))
}

/// Joints, legs, gauges, work part and dimensions of the platform at rest, with the subjects of `findings` marked.
pub fn at_rest(model: &Model, findings: &[Diagnostic]) -> Part {
    let mut data = geometry(model);
    data["label"] = json!(format!(
        "The platform of {}: base, six legs, {}, dimensions.",
        model.name,
        if model.task_space.is_some() {
            "six gauges with arrows in the direction of positive readings"
        } else {
            "a gauge in each leg"
        }
    ));
    if let Some(task) = &model.task_space {
        let round = |point: [f64; 3]| point.map(|v| libm::round(v * 1e6) / 1e6);
        let gauges =
            task.probes.each_ref().map(|probe| json!({ "p": round(probe.point), "d": round(probe.direction) }));
        data["gauges"] = json!(gauges);
        data["part"] = json!(task.frames.tool);
    }
    let errors = || findings.iter().filter(|finding| finding.severity == Severity::Error);
    let numbered = |table: &str| {
        let of = |finding: &Diagnostic| {
            finding.key.strip_prefix(table)?.strip_prefix('[')?.split(']').next()?.parse::<usize>().ok()
        };
        errors().filter_map(of).collect::<Vec<_>>()
    };
    let legs = ["workspace", "control.setpoint.bias", "trajectory", "actuator", "leg", "hysteresis"];
    let about_legs = errors().any(|finding| legs.iter().any(|key| finding.key.starts_with(key)));
    data["bad"] =
        json!({ "legs": if about_legs { (0..6).collect() } else { Vec::<usize>::new() }, "gauges": numbered("gauge") });
    Part::View("platform", data)
}

/// The platform along a motion; bars show each leg within its `travel`, m.
pub fn in_motion(model: &Model, motion: &Motion, travel: f64) -> Part {
    let mut data = geometry(model);
    // Integer nanometres and nanoradians.
    let whole = |values: &[f64; 6]| values.map(|v| libm::round(v * 1e9) as i64);
    data["label"] = json!("The platform along its path, with the travel of each leg.");
    data["poses"] = json!(motion.moments.iter().map(|[pose, _]| whole(pose)).collect::<Vec<_>>());
    data["legs"] = json!(motion.moments.iter().map(|[_, legs]| whole(legs)).collect::<Vec<_>>());
    data["step"] = json!(motion.step);
    data["travel"] = json!(travel);
    Part::View("motion-view", data)
}

fn geometry(model: &Model) -> Value {
    let round = |joints: &[[f64; 3]; 6]| joints.map(|joint| joint.map(|v| libm::round(v * 1e6) / 1e6));
    json!({
        "base": round(&model.geometry.base_joints),
        "platform": round(&model.geometry.platform_joints),
        "height": model.geometry.height,
    })
}
