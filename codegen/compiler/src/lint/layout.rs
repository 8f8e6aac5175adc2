//! Where the joints are.

use core::f64::consts::PI;

use super::{Facts, Found, figure};
use crate::reach::joints;
use specgen_language::diagnostic::codes;

/// Two joints of one body nearer than this share of a leg cannot be built: a leg that is a hundred times as long as thick is no
/// strut, and two stand beside each other.
const NEAREST: f64 = 1e-2;
/// Base, platform and height are of one size: none is so many times larger or smaller than what lies between the others.
const OUT_OF_PROPORTION: f64 = 5.0;
/// A base is so many times as wide as the platform, at most.
const WIDEST_BASE: f64 = 2.5;
/// Six joints evenly on their circle are so many degrees apart: no pair is wider.
const WIDEST_PAIR: f64 = 60.0;

/// The joints of a pair are two parts that stand beside each other.
pub(super) fn joints_apart(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    let Some(legs) = &facts.legs else { return };
    for (body, joints) in [("base", &geometry.base_joints), ("platform", &geometry.platform_joints)] {
        let distance = |a: &[f64; 3], b: &[f64; 3]| libm::hypot(libm::hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
        let pairs = (0..6).flat_map(|i| (0..i).map(move |j| (i, j)));
        let Some((i, j, gap)) = pairs
            .map(|(i, j)| (j, i, distance(&joints[i], &joints[j])))
            .reduce(|nearest, one| if one.2 < nearest.2 { one } else { nearest })
        else {
            continue;
        };
        // Legs that meet in one joint are a layout of their own; a gap that is nearly none is a slip.
        if gap == 0.0 || gap >= NEAREST * legs.shortest() {
            continue;
        }
        let listed = format!("geometry.{body}_joints[{j}]");
        let key = if found.model.spans.contains_key(&format!("geometry.{body}_joints")) {
            listed
        } else {
            format!("geometry.{body}_angle")
        };
        found.add(
            codes::JOINTS_TOUCH,
            &key,
            format!(
                "joints {i} and {j} of the {body} are {} mm apart, for legs of {} mm",
                figure(gap * 1e3),
                figure(legs.shortest() * 1e3)
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
    let [base, platform] = joints::angles(&facts.model.geometry, &facts.model.workspace.bounds());
    let (end, angle) = if base > platform { ("base", base) } else { ("platform", platform) };
    if angle <= most {
        return;
    }
    found.add(
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
    found.add(
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

/// Radii and height of a hexapod are of one size.
pub(super) fn proportions(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    let radius = |joints: &[[f64; 3]; 6]| {
        joints.iter().map(|joint| libm::hypot(joint[0], joint[1])).fold(0.0, |a: f64, b| if b > a { b } else { a })
    };
    let keys = if found.model.spans.contains_key("geometry.base_radius") {
        ["geometry.base_radius", "geometry.platform_radius", "geometry.height"]
    } else {
        ["geometry.base_joints", "geometry.platform_joints", "geometry.height"]
    };
    let sizes = [radius(&geometry.base_joints), radius(&geometry.platform_joints), geometry.height];
    // Against the geometric mean of the two others.
    let apart: [f64; 3] = core::array::from_fn(|k| {
        let (a, b) = (sizes[(k + 1) % 3], sizes[(k + 2) % 3]);
        libm::fabs(libm::log(sizes[k] / libm::sqrt(a * b)))
    });
    let odd = (1..3).fold(0, |odd, k| if apart[k] > apart[odd] { k } else { odd });
    let wide = sizes[0] > WIDEST_BASE * sizes[1];
    // A platform in the plane of its base is found where the legs are.
    if !apart[odd].is_finite() || (apart[odd] <= libm::log(OUT_OF_PROPORTION) && !wide) {
        return;
    }
    let odd = if apart[odd] > libm::log(OUT_OF_PROPORTION) { odd } else { 0 };
    let radius = if keys[odd].ends_with("_radius") { ", and that it is a radius, not a diameter" } else { "" };
    let width = if odd < 2 {
        format!(", and a base is at most {WIDEST_BASE} times as wide as its platform")
    } else {
        String::new()
    };
    found.add_off(
        libm::exp(apart[odd]) / OUT_OF_PROPORTION,
        codes::OUT_OF_PROPORTION,
        keys[odd],
        format!(
            "joints are {} mm from the axis on the base and {} mm on the platform, at a height of {} mm",
            figure(sizes[0] * 1e3),
            figure(sizes[1] * 1e3),
            figure(sizes[2] * 1e3)
        ),
        &format!(
            "check the unit of `{}`{radius}: base, platform and height are of one size on most hexapods{width}",
            keys[odd]
        ),
    );
}

/// Joints of a pair are nearer to each other than to the next pair.
pub(super) fn angles_of_pairs(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    for (body, joints, other) in [("base", &geometry.base_joints, 1), ("platform", &geometry.platform_joints, 5)] {
        let key = format!("geometry.{body}_angle");
        let ([ax, ay, _], [bx, by, _]) = (joints[0], joints[other]);
        let angle = libm::fabs(libm::atan2(ax * by - ay * bx, ax * bx + ay * by)) * 180.0 / PI;
        if !found.model.spans.contains_key(&key) || angle <= WIDEST_PAIR {
            continue;
        }
        found.add(
            codes::PAIR_WIDE,
            &key,
            format!(
                "the joints of a pair are {} deg apart, and {} deg from those of the next pair",
                figure(angle),
                figure(120.0 - angle)
            ),
            &format!(
                "`{key}` is the angle within a pair, the smaller of the two: if \"{} deg\" is meant, write that",
                figure(120.0 - angle)
            ),
        );
    }
}
