//! Where the lines of the gauges meet the platform.

use super::{Facts, Findings, figure};
use specgen_language::model::Probe;

lints! {
    rules: turned_layout, size_of_pattern, size_of_layout;

    /// # W0884: gauge points and directions rotated
    ///
    /// Gauges that measure across the axis usually measure along a radius or a tangent.
    /// Three or more that are all rotated from it by the same angle are reported. 45
    /// degrees is not: gauges at the corners of a square have it.
    ///
    /// ## Why it matters
    ///
    /// Points and directions are then in frames that are rotated against each other,
    /// and measured translations are rotated, too.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["80 mm", "0 mm", "180 mm"]
    /// -direction = [0, 1, 0]
    /// -
    /// -[[gauge]]
    /// -point     = ["-80 mm", "0 mm", "180 mm"]
    /// -direction = [0, 1, 0]
    /// -
    /// -[[gauge]]
    /// -point     = ["0 mm", "80 mm", "180 mm"]
    /// -direction = [1, 0, 0]
    /// +point     = ["69.282 mm", "40 mm", "180 mm"]
    /// +direction = [0, 1, 0]
    /// +
    /// +[[gauge]]
    /// +point     = ["-69.282 mm", "-40 mm", "180 mm"]
    /// +direction = [0, 1, 0]
    /// +
    /// +[[gauge]]
    /// +point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// +direction = [1, 0, 0]
    /// ```
    ///
    /// ## Fix
    ///
    /// Give points and directions in {B}.
    ///
    /// ```toml
    /// point     = ["80 mm", "0 mm", "180 mm"]
    /// direction = [0, 1, 0]
    ///
    /// [[gauge]]
    /// point     = ["-80 mm", "0 mm", "180 mm"]
    /// direction = [0, 1, 0]
    ///
    /// [[gauge]]
    /// point     = ["0 mm", "80 mm", "180 mm"]
    /// direction = [1, 0, 0]
    /// ```
    LAYOUT_TURNED = "W0884";

    /// # W0885: gauges close together
    ///
    /// The outermost gauge should be at least a fifth of the joint radius from the
    /// axis.
    ///
    /// ## Why it matters
    ///
    /// With a short lever arm, a rotation changes the readings little and is lost in
    /// noise. The usual cause is points in cm that were written as mm.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["80 mm", "0 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// -
    /// -[[gauge]]
    /// -point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// -
    /// -[[gauge]]
    /// -point     = ["-40 mm", "-69.282 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// -
    /// -[[gauge]]
    /// -point     = ["80 mm", "0 mm", "180 mm"]
    /// -direction = [0, 1, 0]
    /// -
    /// -[[gauge]]
    /// -point     = ["-80 mm", "0 mm", "180 mm"]
    /// -direction = [0, 1, 0]
    /// -
    /// -[[gauge]]
    /// -point     = ["0 mm", "80 mm", "180 mm"]
    /// -direction = [1, 0, 0]
    /// +point     = ["8 mm", "0 mm", "180 mm"]
    /// +direction = [0, 0, 1]
    /// +
    /// +[[gauge]]
    /// +point     = ["-4 mm", "6.9282 mm", "180 mm"]
    /// +direction = [0, 0, 1]
    /// +
    /// +[[gauge]]
    /// +point     = ["-4 mm", "-6.9282 mm", "180 mm"]
    /// +direction = [0, 0, 1]
    /// +
    /// +[[gauge]]
    /// +point     = ["8 mm", "0 mm", "180 mm"]
    /// +direction = [0, 1, 0]
    /// +
    /// +[[gauge]]
    /// +point     = ["-8 mm", "0 mm", "180 mm"]
    /// +direction = [0, 1, 0]
    /// +
    /// +[[gauge]]
    /// +point     = ["0 mm", "8 mm", "180 mm"]
    /// +direction = [1, 0, 0]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit of the points.
    ///
    /// ```toml
    /// point     = ["80 mm", "0 mm", "180 mm"]
    /// direction = [0, 0, 1]
    ///
    /// [[gauge]]
    /// point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// direction = [0, 0, 1]
    ///
    /// [[gauge]]
    /// point     = ["-40 mm", "-69.282 mm", "180 mm"]
    /// direction = [0, 0, 1]
    ///
    /// [[gauge]]
    /// point     = ["80 mm", "0 mm", "180 mm"]
    /// direction = [0, 1, 0]
    ///
    /// [[gauge]]
    /// point     = ["-80 mm", "0 mm", "180 mm"]
    /// direction = [0, 1, 0]
    ///
    /// [[gauge]]
    /// point     = ["0 mm", "80 mm", "180 mm"]
    /// direction = [1, 0, 0]
    /// ```
    LAYOUT_SMALL = "W0885";

    /// # W0825: a gauge that misses the platform
    ///
    /// The line of a gauge should meet its target plane within about one and a half
    /// radii of the platform.
    ///
    /// ## Why it matters
    ///
    /// There is no target there. Coordinates are usually in the wrong order or unit.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["80 mm", "0 mm", "180 mm"]
    /// +point     = ["800 mm", "0 mm", "180 mm"]
    ///  direction = [0, 0, 1]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check point and direction, both in {B}.
    ///
    /// ```toml
    /// point     = ["80 mm", "0 mm", "180 mm"]
    /// ```
    GAUGE_FAR = "W0825";
}

/// Least cosine to the axis of a gauge whose position along the axis does not matter.
pub(super) const ALONG_AXIS: f64 = 0.5;
/// Least reported angle of the lines to radius and tangent, deg, and the most that these angles may differ.
const TURNED: f64 = 3.0;
const ALIKE: f64 = 0.5;
/// Fewest such lines: two may agree by chance.
const FEWEST: usize = 3;
/// Least distance from the axis, in joint radii, at which the angle means something.
const OFF_AXIS: f64 = 0.1;
/// Least distance of the outermost gauge from the axis, in joint radii.
const NARROWEST: f64 = 0.2;
/// Largest distance of a target from P_C, in joint radii.
const DETACHED: f64 = 3.0;

/// Where the line of a gauge meets its target at rest, in {P}, m.
pub(super) fn pierced(probe: &Probe, height: f64) -> [f64; 3] {
    let start = [probe.point[0], probe.point[1], probe.point[2] - height];
    let (n, m) = (probe.direction, probe.plane_normal);
    let across = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
    let way: f64 = (0..3).fold(0.0, |sum, k| sum + m[k] * (probe.plane_point[k] - start[k])) / across;
    core::array::from_fn(|k| start[k] + way * n[k])
}

/// Angle from radius or tangent to the line of a gauge that measures across the axis, deg, from -45 to 45.
fn beside(probe: &Probe, height: f64, radius: f64) -> Option<f64> {
    let ([x, y, _], [a, b, c]) = (pierced(probe, height), probe.direction);
    if libm::fabs(c) >= ALONG_AXIS || libm::hypot(x, y) < OFF_AXIS * radius {
        return None;
    }
    let angle = libm::atan2(x * b - y * a, x * a + y * b).to_degrees();
    Some(angle - 90.0 * libm::rint(angle / 90.0))
}

/// Checks whether all lines are rotated from radius or tangent by the same angle.
fn turned_layout(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let (height, radius) = (facts.model.geometry.height, facts.model.geometry.joint_radius());
    let angles: Vec<(usize, f64)> = task
        .probes
        .iter()
        .enumerate()
        .filter_map(|(gauge, probe)| Some((gauge, beside(probe, height, radius)?)))
        .collect();
    let Some((gauge, first)) = angles.first().copied() else { return };
    let apart = |angle: f64| {
        let apart = angle - first;
        libm::fabs(apart - 90.0 * libm::rint(apart / 90.0))
    };
    // Gauges at the corners of a square, along its sides, have 45 deg.
    let is_meant = libm::fabs(first) < TURNED || libm::fabs(first) > 45.0 - TURNED;
    if angles.len() < FEWEST || is_meant || angles.iter().any(|(_, angle)| apart(*angle) > ALIKE) {
        return;
    }
    let (count, degrees) = (angles.len(), figure(libm::fabs(first)));
    found.add(
        LAYOUT_TURNED,
        &format!("gauge[{gauge}].direction"),
        format!(
            "the {count} gauges that measure across the axis are all rotated by {degrees} deg from their radius or tangent"
        ),
        "points and directions are both in {B}: check that both use its axes",
    );
}

/// Checks that the gauges are far enough apart to measure rotations.
fn size_of_pattern(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let (height, radius) = (facts.model.geometry.height, facts.model.geometry.joint_radius());
    let far = task.probes.iter().fold(0.0, |far: f64, probe| {
        let [x, y, _] = pierced(probe, height);
        let one = libm::hypot(x, y);
        if one > far { one } else { far }
    });
    if far >= NARROWEST * radius || far == 0.0 {
        return;
    }
    let [farthest, joints] = [far * 1e3, radius * 1e3].map(figure);
    found.add_off(
        NARROWEST * radius / far,
        LAYOUT_SMALL,
        "gauge[0].point",
        format!(
            "all gauges are within {farthest} mm of the axis, but the platform's joints are {joints} mm from it"
        ),
        "check the unit of the points (mm or cm), or place the gauges further apart: this close together they hardly measure a rotation",
    );
}

/// Checks that targets are on the platform.
fn size_of_layout(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let radius = facts.model.geometry.joint_radius();
    for (gauge, probe) in task.probes.iter().enumerate() {
        if found.is_in_other_frame(gauge) {
            continue;
        }
        let (n, pierced) = (probe.direction, pierced(probe, facts.model.geometry.height));
        let far = libm::sqrt(pierced.iter().fold(0.0, |sum, part| sum + part * part));
        if far.is_nan() || far <= DETACHED * radius {
            if let Some(axis) = aside(&pierced, &n, radius) {
                let (distance, along) = (figure(pierced[axis] * 1e3), ["x", "y", "z"][axis]);
                let joints = figure(radius * 1e3);
                found.add(
                    GAUGE_FAR,
                    &format!("gauge[{gauge}].point[{axis}]"),
                    format!(
                        "the line of gauge {gauge} meets its target {distance} mm along {along} from P_C, but the platform's joints are {joints} mm from it"
                    ),
                    "check the order and the units of `point`: x, y, z in {B}, whose origin is in the base",
                );
            }
            continue;
        }
        let [distance, joints] = [far * 1e3, radius * 1e3].map(figure);
        found.add_off(
            far / (DETACHED * radius),
            GAUGE_FAR,
            &format!("gauge[{gauge}].point"),
            format!(
                "the line of gauge {gauge} meets its target {distance} mm from P_C, but the platform's joints are {joints} mm from it"
            ),
            "check `point` and `direction` (in {B}), `target_point` and `target_normal` (in {P}, from P_C) of the gauge",
        );
    }
}

/// The axis across the gauge's line on which the target is outside a platform of `radius`.
fn aside(pierced: &[f64; 3], direction: &[f64; 3], radius: f64) -> Option<usize> {
    (0..3).find(|axis| direction[*axis].abs() < 0.5 && pierced[*axis].abs() > 1.5 * radius)
}
