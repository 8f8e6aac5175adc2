//! In which frame points and directions are given: {B} below, {P} at `geometry.height` above it.

use super::gauge_places::{ALONG_AXIS, pierced};
use super::{Facts, Found, figure};

lints! {
    rules: other_frame;

    /// # W0881: a point counted in another frame
    ///
    /// Points of {P} count from the centre of the platform joints, points of {B} from
    /// that of the base, `geometry.height` below. Reported is a point of a gauge, a
    /// target, a joint, the centre of mass or the tool that lies 0.83 to 1.25 heights
    /// above or below its own body, so that it would lie at it if z were counted from
    /// the other one.
    ///
    /// ## Why it matters
    ///
    /// The lever of a gauge or a load is then wrong by the height. Tilts are read as
    /// translations, and the loop works with gauges that are elsewhere.
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
    /// Count z from the origin of the frame that the key asks for.
    ///
    /// ```toml
    /// point     = ["0 mm", "80 mm", "180 mm"]
    /// ```
    OTHER_FRAME = "W0881";
}

/// A point is given in another frame if a height more or less leaves no more of its distance from the platform than this share.
const FOUND_AGAIN: f64 = 0.2;

/// Heights that are to be added to `z`, m above P_C, so that it lies near P_C: 1 or −1. None: neither does that.
fn heights_off(z: f64, height: f64) -> Option<f64> {
    let near = |other: f64| libm::fabs(other) <= FOUND_AGAIN * libm::fabs(z);
    [1.0, -1.0].into_iter().find(|heights| near(z + heights * height))
}

/// Points that would lie at the platform if they were counted from the other frame.
fn other_frame(facts: &Facts, found: &mut Found) {
    let (model, height) = (facts.model, facts.model.geometry.height);
    let mean = |joints: &[[f64; 3]; 6]| joints.iter().fold(0.0, |sum, joint| sum + joint[2]) / 6.0;
    let (base, platform) = (mean(&model.geometry.base_joints), mean(&model.geometry.platform_joints));
    let mut say = |key: String, z: f64, to: &str, help: &str| {
        let message = format!(
            "`{key}` puts z {} mm {} {to}, and `geometry.height` is {} mm",
            figure(libm::fabs(z) * 1e3),
            if z < 0.0 { "below" } else { "above" },
            figure(height * 1e3)
        );
        found.add(OTHER_FRAME, &key, message, help);
    };
    if heights_off(platform, height) == Some(-1.0) {
        say(
            "geometry.platform_joints".to_owned(),
            platform,
            "P_C",
            "platform joints are in {P}, which `height` puts above {B}: take the height off z, if they are counted from the base",
        );
    }
    if heights_off(base, height).is_some() {
        say(
            "geometry.base_joints".to_owned(),
            base,
            "the origin of {B}",
            "base joints are in {B}, with z about 0: check that they are not counted from the platform",
        );
    }
    if heights_off(model.platform.center_of_mass[2], height) == Some(-1.0) {
        say(
            "platform.center_of_mass[2]".to_owned(),
            model.platform.center_of_mass[2],
            "P_C",
            "the centre of mass is in {P}, from the centre of the platform joints: take the height off z, if it is counted from the base",
        );
    }
    let Some(task) = &model.task_space else { return };
    if heights_off(task.frames.tool[2], height) == Some(-1.0) {
        say(
            "control.frames.tool[2]".to_owned(),
            task.frames.tool[2],
            "P_C",
            "the tool is in {P}, from the centre of the platform joints: take the height off z, if it is counted from the base",
        );
    }
    for (gauge, probe) in task.probes.iter().enumerate() {
        let z = pierced(probe, height)[2];
        let heights = heights_off(z, height).filter(|_| libm::fabs(probe.direction[2]) < ALONG_AXIS);
        if let Some(heights) = heights {
            let counted = if heights > 0.0 { "from the platform" } else { "with the height twice" };
            let help = format!(
                "a gauge's `point` is in {{B}}, whose origin lies in the base, and this one looks as if z were counted {counted}; check its unit, too"
            );
            say(format!("gauge[{gauge}].point[2]"), z, "P_C", &help);
        }
    }
    for (gauge, probe) in task.probes.iter().enumerate() {
        let key = format!("gauge[{gauge}].target_point");
        let given = facts.model.spans.contains_key(&key);
        if given && heights_off(probe.plane_point[2], height).is_some() {
            let help = "`target_point` is in {P}, from the centre of the platform joints: check that it is not counted from the base";
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
