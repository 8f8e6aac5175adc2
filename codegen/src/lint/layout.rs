//! Where the joints are.

use super::{Facts, Found, figure};
use crate::diagnostic::codes;

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
        let radius = joints.iter().map(|joint| distance(joint, &[0.0; 3])).fold(0.0, |a: f64, b| if b > a { b } else { a });
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
            &format!("check the unit of `{key}`: an angle of a few degrees sets the joints of a pair some millimetres apart"),
        );
    }
}
