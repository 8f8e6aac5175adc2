//! Positions of the joints.

use super::{Facts, Findings, figure};
use crate::reach::joints;

lints! {
    rules: joints_apart, joints_turn, base_is_wider, proportions;

    /// # W0815: joints that would touch
    ///
    /// Two joints of one body should be more than a hundredth of a leg length apart.
    ///
    /// ## Why it matters
    ///
    /// The legs would have to be thinner than that. Usually the angle between two
    /// joints is in the wrong unit, or the half angle was given.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -base_angle      = "0.012 pi rad"
    /// +base_angle      = "0.012 rad"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `base_angle` and `platform_angle`: each is the full angle between a pair.
    ///
    /// ```toml
    /// base_angle      = "0.012 pi rad"
    /// ```
    JOINTS_TOUCH = "W0815";

    /// # E0860: joints beyond their angle limit
    ///
    /// Over the workspace, no joint at base or platform may turn further from rest
    /// than `leg.joint_angle`.
    ///
    /// ## Why it matters
    ///
    /// A flexure bent beyond its limit yields or breaks.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [leg] @@
    ///  extensible_center  = "50 mm"
    /// +joint_angle = "0.5 mrad"
    /// ```
    ///
    /// ## Fix
    ///
    /// Reduce the workspace, or check the unit of the angle.
    ///
    /// ```toml
    /// joint_angle = "5 mrad"
    /// ```
    JOINT_ANGLE = "E0860";

    /// # W0816: platform wider than its base
    ///
    /// The joint circle of the platform is larger than that of the base.
    ///
    /// ## Why it matters
    ///
    /// It is possible, but most hexapods have a base wider than the platform.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -base_radius     = "150 mm"
    /// +base_radius     = "90 mm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check whether the two radii are swapped.
    ///
    /// ```toml
    /// base_radius     = "150 mm"
    /// ```
    PLATFORM_WIDER = "W0816";

    /// # W0817: radii and height out of proportion
    ///
    /// Base radius, platform radius and height should each be within a factor of five
    /// of the geometric mean of the other two. The base should be at most 2.5 times as
    /// wide as the platform.
    ///
    /// ## Why it matters
    ///
    /// A very flat or very tall hexapod is soft in some directions. More often a unit
    /// is wrong.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -height          = "180 mm"
    /// +height          = "1.8 m"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of all three.
    ///
    /// ```toml
    /// height          = "180 mm"
    /// ```
    SIZES_APART = "W0817";
}

/// Least distance of two joints of one body, in leg lengths: two legs side by side cannot be thinner than this.
const NEAREST: f64 = 1e-2;
/// Largest ratio of base, platform or height to the geometric mean of the other two.
const OUT_OF_PROPORTION: f64 = 5.0;
/// Largest ratio of base radius to platform radius.
const WIDEST_BASE: f64 = 2.5;

/// Checks that joints are far enough apart to be built.
fn joints_apart(facts: &Facts, found: &mut Findings) {
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
        // Legs that meet in one joint are a valid layout; only a tiny gap is reported.
        if gap == 0.0 || gap >= NEAREST * legs.shortest() {
            continue;
        }
        let listed = format!("geometry.{body}_joints[{j}]");
        let key = if found.model.spans.contains_key(&format!("geometry.{body}_joints")) {
            listed
        } else {
            format!("geometry.{body}_angle")
        };
        let [distance, length] = [gap * 1e3, legs.shortest() * 1e3].map(figure);
        found.add(
            JOINTS_TOUCH,
            &key,
            format!(
                "joints {i} and {j} of the {body} are {distance} mm apart, for legs of {length} mm"
            ),
            &format!(
                "check the unit of `{key}`: with an angle of a few degrees, the joints of a pair are some millimetres apart"
            ),
        );
    }
}

/// Checks the angles of the joints over the workspace.
fn joints_turn(facts: &Facts, found: &mut Findings) {
    let Some(most) = facts.model.leg.joint_angle else { return };
    let [base, platform] = joints::angles(&facts.model.geometry, &facts.model.workspace.bounds());
    let (end, angle) = if base > platform { ("base", base) } else { ("platform", platform) };
    if angle <= most {
        return;
    }
    let [turn, limit] = [angle * 1e3, most * 1e3].map(figure);
    found.add(
        JOINT_ANGLE,
        "leg.joint_angle",
        format!("in the declared workspace a joint at the {end} turns by {turn} mrad, but its limit is {limit} mrad"),
        "reduce [workspace], or check the unit of `leg.joint_angle` (mrad or deg)",
    );
}

/// Largest distance of joints from the axis, m.
fn radius(joints: &[[f64; 3]; 6]) -> f64 {
    joints.iter().map(|joint| libm::hypot(joint[0], joint[1])).fold(0.0, |a, b| if b > a { b } else { a })
}

/// Checks that the base is wider than the platform.
fn base_is_wider(facts: &Facts, found: &mut Findings) {
    let geometry = &facts.model.geometry;
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
    let [platform, base] = [platform * 1e3, base * 1e3].map(figure);
    found.add(
        PLATFORM_WIDER,
        key,
        format!("the platform's joints are {platform} mm from the axis, those of the base {base} mm"),
        &format!(
            "check that `{key}` and `{other}` are not swapped; a platform wider than its base is possible but unusual"
        ),
    );
}

/// Checks the proportions of radii and height.
fn proportions(facts: &Facts, found: &mut Findings) {
    let geometry = &facts.model.geometry;
    let keys = if found.model.spans.contains_key("geometry.base_radius") {
        ["geometry.base_radius", "geometry.platform_radius", "geometry.height"]
    } else {
        ["geometry.base_joints", "geometry.platform_joints", "geometry.height"]
    };
    let sizes = [radius(&geometry.base_joints), radius(&geometry.platform_joints), geometry.height];
    // Relative to the geometric mean of the other two.
    let apart: [f64; 3] = core::array::from_fn(|k| {
        let (a, b) = (sizes[(k + 1) % 3], sizes[(k + 2) % 3]);
        libm::fabs(libm::log(sizes[k] / libm::sqrt(a * b)))
    });
    let odd = (1..3).fold(0, |odd, k| if apart[k] > apart[odd] { k } else { odd });
    let wide = sizes[0] > WIDEST_BASE * sizes[1];
    // A platform in the plane of its base has a finding of its own.
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
    let [base, platform, height] = [sizes[0] * 1e3, sizes[1] * 1e3, sizes[2] * 1e3].map(figure);
    found.add_off(
        libm::exp(apart[odd]) / OUT_OF_PROPORTION,
        SIZES_APART,
        keys[odd],
        format!(
            "base joints are {base} mm from the axis and platform joints {platform} mm, at a height of {height} mm"
        ),
        &format!(
            "check the unit of `{}`{radius}: base, platform and height are of similar size on most hexapods{width}",
            keys[odd]
        ),
    );
}
