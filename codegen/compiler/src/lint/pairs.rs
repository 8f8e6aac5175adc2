//! Joints in pairs.

use core::f64::consts::PI;

use super::{Facts, Found, figure};

lints! {
    rules: angles_of_pairs;

    /// # W0868: joints of a pair further apart than pairs are
    ///
    /// `base_angle` and `platform_angle` should be at most 60 degrees.
    ///
    /// ## Why it matters
    ///
    /// They are the angle between the two joints of a pair, the smaller one. Beyond 60
    /// degrees the joints of a pair are nearer to those of the next pair: the larger
    /// angle was given, and the legs are numbered differently than in (1) and (2).
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -base_angle      = "0.012 pi rad"
    /// +base_angle      = "61 deg"
    /// ```
    ///
    /// ## Fix
    ///
    /// Give the smaller angle.
    ///
    /// ```toml
    /// base_angle      = "0.012 pi rad"
    /// ```
    PAIR_WIDE = "W0868";
}

/// Six joints evenly on their circle are so many degrees apart: no pair is wider.
const WIDEST_PAIR: f64 = 60.0;

/// Joints of a pair are nearer to each other than to the next pair.
fn angles_of_pairs(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    for (body, joints, other) in [("base", &geometry.base_joints, 1), ("platform", &geometry.platform_joints, 5)] {
        let key = format!("geometry.{body}_angle");
        let ([ax, ay, _], [bx, by, _]) = (joints[0], joints[other]);
        let angle = libm::fabs(libm::atan2(ax * by - ay * bx, ax * bx + ay * by)) * 180.0 / PI;
        if !found.model.spans.contains_key(&key) || angle <= WIDEST_PAIR {
            continue;
        }
        found.add(
            PAIR_WIDE,
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
