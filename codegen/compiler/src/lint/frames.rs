//! Frames of points and directions: {B} at the base, {P} at `geometry.height` above it.

use super::gauge_places::{ALONG_AXIS, pierced};
use super::{Facts, Findings, figure};

lints! {
    rules: other_frame;

    /// # W0881: a point in the wrong frame
    ///
    /// Points in {P} are relative to the centre of the platform joints, points in {B}
    /// to that of the base joints, `geometry.height` below. A point of a gauge, a
    /// target, a joint, the centre of mass or the tool is reported if it is 0.83 to
    /// 1.25 heights above or below its own body: in the other frame it would be at it.
    ///
    /// ## Why it matters
    ///
    /// The lever arm of a gauge or a load is then wrong by the height, and tilts are
    /// read as translations.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["0 mm", "80 mm", "180 mm"]
    /// +point     = ["0 mm", "80 mm", "0 mm"]
    ///  direction = [1, 0, 0]
    /// ```
    ///
    /// ## Fix
    ///
    /// Measure z from the origin of the frame that the key requires.
    ///
    /// ```toml
    /// point     = ["0 mm", "80 mm", "180 mm"]
    /// ```
    OTHER_FRAME = "W0881";
}

/// A point is in the wrong frame if adding or subtracting the height leaves at most this share of its distance from the platform.
const FOUND_AGAIN: f64 = 0.2;

/// Number of heights, 1 or −1, to add to `z`, m above P_C, so that the point is near P_C; none if neither brings it there.
fn heights_off(z: f64, height: f64) -> Option<f64> {
    let near = |other: f64| libm::fabs(other) <= FOUND_AGAIN * libm::fabs(z);
    [1.0, -1.0].into_iter().find(|heights| near(z + heights * height))
}

/// Checks for points that would be at the platform if they were in the other frame.
fn other_frame(facts: &Facts, found: &mut Findings) {
    let (model, height) = (facts.model, facts.model.geometry.height);
    let mean = |joints: &[[f64; 3]; 6]| joints.iter().fold(0.0, |sum, joint| sum + joint[2]) / 6.0;
    let (base, platform) = (mean(&model.geometry.base_joints), mean(&model.geometry.platform_joints));
    let mut say = |key: String, z: f64, to: &str, help: &str| {
        let (distance, side) = (figure(libm::fabs(z) * 1e3), if z < 0.0 { "below" } else { "above" });
        let height = figure(height * 1e3);
        let message = format!("`{key}` is {distance} mm {side} {to} along z, and `geometry.height` is {height} mm");
        found.add(OTHER_FRAME, &key, message, help);
    };
    if heights_off(platform, height) == Some(-1.0) {
        say(
            "geometry.platform_joints".to_owned(),
            platform,
            "P_C",
            "platform joints are in {P}, which is `height` above {B}: if they were measured from the base, subtract the height from z",
        );
    }
    if heights_off(base, height).is_some() {
        say(
            "geometry.base_joints".to_owned(),
            base,
            "the origin of {B}",
            "base joints are in {B}, with z about 0: check that they were not measured from the platform",
        );
    }
    if heights_off(model.platform.center_of_mass[2], height) == Some(-1.0) {
        say(
            "platform.center_of_mass[2]".to_owned(),
            model.platform.center_of_mass[2],
            "P_C",
            "the centre of mass is in {P}, relative to the centre of the platform joints: if it was measured from the base, subtract the height from z",
        );
    }
    let Some(task) = &model.task_space else { return };
    if heights_off(task.frames.tool[2], height) == Some(-1.0) {
        say(
            "control.frames.tool[2]".to_owned(),
            task.frames.tool[2],
            "P_C",
            "the tool is in {P}, relative to the centre of the platform joints: if it was measured from the base, subtract the height from z",
        );
    }
    for (gauge, probe) in task.probes.iter().enumerate() {
        let z = pierced(probe, height)[2];
        let heights = heights_off(z, height).filter(|_| libm::fabs(probe.direction[2]) < ALONG_AXIS);
        if let Some(heights) = heights {
            let mistake = if heights > 0.0 { "measured from the platform" } else { "given with the height twice" };
            let help = format!(
                "a gauge's `point` is in {{B}}, whose origin is in the base, but here z seems to be {mistake}; also check its unit"
            );
            say(format!("gauge[{gauge}].point[2]"), z, "P_C", &help);
        }
    }
    for (gauge, probe) in task.probes.iter().enumerate() {
        let key = format!("gauge[{gauge}].target_point");
        let given = facts.model.spans.contains_key(&key);
        if given && heights_off(probe.plane_point[2], height).is_some() {
            let help = "`target_point` is in {P}, relative to the centre of the platform joints: check that it was not measured from the base";
            say(format!("{key}[2]"), probe.plane_point[2], "P_C", help);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_in_the_other_frame_from_five_sixths_to_five_fourths_of_the_height() {
        for (z, expected) in [
            (0.0, None),
            (-0.149, None),
            (-0.151, Some(1.0)),
            (-0.18, Some(1.0)),
            (-0.224, Some(1.0)),
            (-0.226, None),
            (0.18, Some(-1.0)),
            (0.4, None),
        ] {
            assert_eq!(heights_off(z, 0.18), expected, "{z}");
        }
    }
}
