//! The platform in three dimensions, to turn and to play: data for the page's script.

use host_sim::platform::rig::PlatformRun;
use serde_json::json;
use specgen_runtime::Platform;

use super::section::{Part, Section};
use crate::model::Model;

/// Poses that are played.
const POSES: usize = 400;

/// The path of a run; without one the platform stands.
#[must_use]
pub fn section(model: &Model, platform: Option<&Platform<f64>>, run: Option<&PlatformRun>, interval: f64) -> Section {
    let samples = run.map_or(&[][..], |run| &run.samples);
    let every = samples.len().div_ceil(POSES).max(1);
    let jacobian = platform.map(|platform| platform.jacobian(&[0.0; 6]));
    let shown = samples.iter().step_by(every);
    // Whole nanometres and nanoradians.
    let poses: Vec<[i64; 6]> = shown.clone().map(|s| s.tick.pose.map(|v| libm::round(v * 1e9) as i64)).collect();
    let legs: Vec<[i64; 6]> = shown
        .map(|s| match &jacobian {
            Some(rows) => {
                rows.map(|row| libm::round(row.iter().zip(&s.tick.pose).map(|(j, h)| j * h).sum::<f64>() * 1e9) as i64)
            }
            None => [0; 6],
        })
        .collect();
    let round = |joints: &[[f64; 3]; 6]| joints.map(|joint| joint.map(|v| libm::round(v * 1e6) / 1e6));
    let data = json!({
        "base": round(&model.geometry.base_joints),
        "platform": round(&model.geometry.platform_joints),
        "height": model.geometry.height,
        "stroke": model.actuator.stroke,
        "step": every as f64 * interval,
        "poses": poses,
        "legs": legs,
    });
    let mut section = Section::new("view", "The platform", "")
        .text(if samples.is_empty() {
            "Joints and legs as the spec has them. Drag to turn."
        } else {
            "Drag to turn. Played: the true pose in case 1 at 1 Hz with P/F and PCC (or the first path that the workspace holds). Motion is exaggerated as the slider says; bars show the leg extensions as they are."
        });
    section.parts.push(Part::View(data));
    section
}
