//! Angles of the pairs of joints.

use core::f64::consts::PI;

use super::{Facts, Findings, figure};

lints! {
    rules: angles_of_pairs;

    /// # W0868: joints of a pair too far apart
    ///
    /// `base_angle` and `platform_angle` should be at most 60 degrees.
    ///
    /// ## Why it matters
    ///
    /// The key is the smaller of the two angles between neighbouring joints. Beyond 60
    /// degrees a joint is closer to the next pair than to its partner: the larger angle
    /// was given, and the legs are not numbered as in (1) and (2).
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

/// Widest pair, deg: the angle of six evenly spaced joints.
const WIDEST_PAIR: f64 = 60.0;

/// Checks that the joints of a pair are closer to each other than to the next pair.
fn angles_of_pairs(facts: &Facts, found: &mut Findings) {
    let geometry = &facts.model.geometry;
    for (body, joints, other) in [("base", &geometry.base_joints, 1), ("platform", &geometry.platform_joints, 5)] {
        let key = format!("geometry.{body}_angle");
        let ([ax, ay, _], [bx, by, _]) = (joints[0], joints[other]);
        let angle = libm::fabs(libm::atan2(ax * by - ay * bx, ax * bx + ay * by)) * 180.0 / PI;
        if !found.model.spans.contains_key(&key) || angle <= WIDEST_PAIR {
            continue;
        }
        let [apart, from_next] = [angle, 120.0 - angle].map(figure);
        found.add(
            PAIR_WIDE,
            &key,
            format!(
                "the joints of a pair are {apart} deg apart, and {from_next} deg from those of the next pair"
            ),
            &format!(
                "`{key}` is the angle within a pair, the smaller of the two: write \"{} deg\" if the other angle was given",
                figure(120.0 - angle)
            ),
        );
    }
}
