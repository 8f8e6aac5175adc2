//! The platform in three dimensions, to turn and to play: data for the page's script.

use host_sim::closed_loop::Tracking;
use host_sim::platform::rig::PlatformRun;
use serde_json::json;
use specgen_runtime::Platform;

use super::section::{Part, Section};
use specgen_compiler::lower;
use specgen_language::model::Model;

/// Poses that are played.
const POSES: usize = 400;

/// What is played: some moments of a run.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// What it is, for the reader.
    text: &'static str,
    /// Between two moments, s.
    step: f64,
    /// Pose from rest, m and rad, with the extension of each leg, m.
    moments: Vec<[[f64; 6]; 2]>,
}

impl Motion {
    /// The true pose of a run; leg extensions by J at rest.
    #[must_use]
    pub fn of_platform(platform: &Platform<f64>, run: &PlatformRun, interval: f64) -> Self {
        let jacobian = platform.jacobian(&[0.0; 6]);
        let text = "Drag to turn. Played: the true pose in case 1 at 1 Hz with P/F and PCC (or the first path that the workspace holds). Motion is exaggerated as the slider says; bars show the leg extensions as they are.";
        let poses: Vec<[f64; 6]> = run.samples.iter().map(|sample| sample.tick.pose).collect();
        Self::thinned(text, interval, &poses, |pose| [*pose, product(&jacobian, pose)])
    }

    /// What the gauges of six legs read, and the pose that such legs carry, by J⁻¹ at rest. None if they carry none.
    #[must_use]
    pub fn of_legs(model: &Model, run: &Tracking) -> Option<Self> {
        let inverse = lower::inverse_jacobian(&model.geometry)?;
        let text = "Drag to turn. Played: the legs as their gauges read them along the trajectory at 1 Hz, and the pose that such legs give the platform, which no gauge of this spec sees. Motion is exaggerated as the slider says; bars show the leg extensions as they are.";
        let legs: Vec<[f64; 6]> = run.samples.iter().map(|sample| sample.measured).collect();
        Some(Self::thinned(text, run.interval, &legs, |legs| [product(&inverse, legs), *legs]))
    }

    fn thinned(
        text: &'static str,
        interval: f64,
        all: &[[f64; 6]],
        moment: impl Fn(&[f64; 6]) -> [[f64; 6]; 2],
    ) -> Self {
        let every = all.len().div_ceil(POSES).max(1);
        Self { text, step: every as f64 * interval, moments: all.iter().step_by(every).map(moment).collect() }
    }
}

fn product(rows: &[[f64; 6]; 6], vector: &[f64; 6]) -> [f64; 6] {
    rows.map(|row| row.iter().zip(vector).fold(0.0, |sum, (a, b)| sum + a * b))
}

/// The platform along a motion; without one it stands.
#[must_use]
pub fn section(model: &Model, motion: Option<&Motion>) -> Section {
    let standing = Motion { text: "Joints and legs as the spec has them. Drag to turn.", ..Motion::default() };
    let motion = motion.unwrap_or(&standing);
    // Whole nanometres and nanoradians.
    let whole = |values: &[f64; 6]| values.map(|v| libm::round(v * 1e9) as i64);
    let poses: Vec<[i64; 6]> = motion.moments.iter().map(|[pose, _]| whole(pose)).collect();
    let legs: Vec<[i64; 6]> = motion.moments.iter().map(|[_, legs]| whole(legs)).collect();
    let round = |joints: &[[f64; 3]; 6]| joints.map(|joint| joint.map(|v| libm::round(v * 1e6) / 1e6));
    let data = json!({
        "base": round(&model.geometry.base_joints),
        "platform": round(&model.geometry.platform_joints),
        "height": model.geometry.height,
        "stroke": model.actuator.stroke,
        "step": motion.step,
        "poses": poses,
        "legs": legs,
    });
    let mut section = Section::new("view", "The platform", "").text(motion.text);
    section.parts.push(Part::View(data));
    section
}
