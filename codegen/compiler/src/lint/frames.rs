//! In which frame points and directions are given: {B} below, {P} at `geometry.height` above it.

use super::gauges::pierced;
use super::{Facts, Found, figure};
use specgen_language::diagnostic::codes;
use specgen_language::model::Probe;

/// A point is given in another frame if a height more or less leaves no more of its distance from the platform than this share.
const FOUND_AGAIN: f64 = 0.2;
/// A line within this cosine of the axis: where along the axis it begins does not matter.
const ALONG_AXIS: f64 = 0.5;
/// Lines that all look beside radius and tangent by an angle, deg, and how far these angles may differ.
const TURNED: f64 = 3.0;
const ALIKE: f64 = 0.5;
/// Fewest such lines: two are alike by chance.
const FEWEST: usize = 3;
/// Nearer to the axis than this share of its radius no line is beside it.
const OFF_AXIS: f64 = 0.1;
/// The farthest gauge stands so many joint radii from the axis, at least.
const NARROWEST: f64 = 0.2;

/// Heights that are to be added to `z`, m above P_C, so that it lies near P_C: 1 or −1. None: neither does that.
fn heights_off(z: f64, height: f64) -> Option<f64> {
    let near = |other: f64| libm::fabs(other) <= FOUND_AGAIN * libm::fabs(z);
    [1.0, -1.0].into_iter().find(|heights| near(z + heights * height))
}

/// Points that would lie at the platform if they were counted from the other frame.
pub(super) fn other_frame(facts: &Facts, found: &mut Found) {
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
        found.add(codes::OTHER_FRAME, &key, message, help);
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

/// Angle from radius or tangent to the line of a gauge that looks across the axis, deg, from -45 to 45.
fn beside(probe: &Probe, height: f64, radius: f64) -> Option<f64> {
    let ([x, y, _], [a, b, c]) = (pierced(probe, height), probe.direction);
    if libm::fabs(c) >= ALONG_AXIS || libm::hypot(x, y) < OFF_AXIS * radius {
        return None;
    }
    let angle = libm::atan2(x * b - y * a, x * a + y * b).to_degrees();
    Some(angle - 90.0 * libm::rint(angle / 90.0))
}

/// Gauges look along a radius or across it. All beside it by one angle: points and directions are turned against each other.
pub(super) fn turned_layout(facts: &Facts, found: &mut Found) {
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
    // At the corners of a square, along its sides: 45 deg from both.
    let is_meant = libm::fabs(first) < TURNED || libm::fabs(first) > 45.0 - TURNED;
    if angles.len() < FEWEST || is_meant || angles.iter().any(|(_, angle)| apart(*angle) > ALIKE) {
        return;
    }
    found.add(
        codes::LAYOUT_TURNED,
        &format!("gauge[{gauge}].direction"),
        format!(
            "the {} gauges that look across the axis are all turned by {} deg from their radius or its tangent",
            angles.len(),
            figure(libm::fabs(first))
        ),
        "points and directions are both in {B}: check that both are given along its axes",
    );
}

/// Gauges stand apart by much of the platform: on a spot in its middle they do not see it turn.
pub(super) fn size_of_pattern(facts: &Facts, found: &mut Found) {
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
    found.add_off(
        NARROWEST * radius / far,
        codes::LAYOUT_SMALL,
        "gauge[0].point",
        format!(
            "all gauges stand within {} mm of the axis, on a platform whose joints are {} mm from the middle",
            figure(far * 1e3),
            figure(radius * 1e3)
        ),
        "check the unit of the points (mm or cm), or set the gauges further apart: so near to each other they hardly see a rotation",
    );
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
