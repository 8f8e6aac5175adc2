//! Where the joints are.

use super::{Facts, Found, figure};
use crate::diagnostic::codes;
use crate::reach::joints;

/// Two joints of one body nearer than this share of its radius cannot be built: they would be one.
const NEAREST: f64 = 2e-3;

/// The joints of a pair are two parts that stand beside each other.
pub(super) fn joints_apart(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    for (body, joints) in [("base", &geometry.base_joints), ("platform", &geometry.platform_joints)] {
        let distance = |a: &[f64; 3], b: &[f64; 3]| libm::hypot(libm::hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
        let pairs = (0..6).flat_map(|i| (0..i).map(move |j| (i, j)));
        let Some((i, j, gap)) = pairs
            .map(|(i, j)| (j, i, distance(&joints[i], &joints[j])))
            .reduce(|nearest, one| if one.2 < nearest.2 { one } else { nearest })
        else {
            continue;
        };
        let radius =
            joints.iter().map(|joint| distance(joint, &[0.0; 3])).fold(0.0, |a: f64, b| if b > a { b } else { a });
        // Legs that meet in one joint are a layout of their own; a gap that is nearly none is a slip.
        if gap == 0.0 || gap >= NEAREST * radius {
            continue;
        }
        let listed = format!("geometry.{body}_joints[{j}]");
        let key = if found.model.spans.contains_key(&format!("geometry.{body}_joints")) {
            listed
        } else {
            format!("geometry.{body}_angle")
        };
        found.warning(
            codes::JOINTS_TOUCH,
            &key,
            format!(
                "joints {i} and {j} of the {body} are {} mm apart, on a body of {} mm",
                figure(gap * 1e3),
                figure(radius * 1e3)
            ),
            &format!(
                "check the unit of `{key}`: an angle of a few degrees sets the joints of a pair some millimetres apart"
            ),
        );
    }
}

/// The joints of a leg stand what the workspace asks of them.
pub(super) fn joints_turn(facts: &Facts, found: &mut Found) {
    let Some(most) = facts.model.leg.joint_angle else { return };
    let ([x, y, z], [a, b, c]) = (facts.model.workspace.translation, facts.model.workspace.rotation);
    let [base, platform] = joints::angles(&facts.model.geometry, &[x, y, z, a, b, c]);
    let (end, angle) = if base > platform { ("base", base) } else { ("platform", platform) };
    if angle <= most {
        return;
    }
    found.error(
        codes::JOINT_ANGLE,
        "leg.joint_angle",
        format!(
            "in the declared workspace a joint at the {end} turns by {} mrad, but it may turn by {} mrad",
            figure(angle * 1e3),
            figure(most * 1e3)
        ),
        "reduce [workspace], or check the unit of `leg.joint_angle` (mrad or deg)",
    );
}

/// Hexapods stand on a base that is wider than their platform.
pub(super) fn base_is_wider(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    let radius = |joints: &[[f64; 3]; 6]| {
        joints.iter().map(|joint| libm::hypot(joint[0], joint[1])).fold(0.0, |a: f64, b| if b > a { b } else { a })
    };
    let (base, platform) = (radius(&geometry.base_joints), radius(&geometry.platform_joints));
    if platform <= base {
        return;
    }
    let circles = found.model.spans.contains_key("geometry.base_radius");
    let [key, other] = if circles {
        ["geometry.base_radius", "geometry.platform_radius"]
    } else {
        ["geometry.base_joints", "geometry.platform_joints"]
    };
    found.warning(
        codes::PLATFORM_WIDER,
        key,
        format!(
            "the platform's joints are {} mm from its axis, those of the base {} mm",
            figure(platform * 1e3),
            figure(base * 1e3)
        ),
        &format!(
            "check that `{key}` and `{other}` are not in each other's place; a platform wider than its base is possible"
        ),
    );
}
