//! The order in which joints are listed.

use super::{Facts, Findings, figure};
use specgen_language::model::Geometry;

lints! {
    rules: joints_run_round, legs_cross;

    /// # W0882: joints numbered clockwise
    ///
    /// `base_joints` and `platform_joints` should be listed counter-clockwise, seen
    /// from above, as equations (1) and (2) number them.
    ///
    /// ## Why it matters
    ///
    /// In right-handed coordinates with z up, the paper numbers legs counter-clockwise.
    /// If yours are clockwise, y may have the wrong sign or x and y may be swapped:
    /// then the geometry is a mirror image, and rotations have the wrong sign. The
    /// lists may also be in reverse order. Numbering legs clockwise on purpose is
    /// allowed.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-joints.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -    ["81 mm", "125 mm", "2 mm"],
    /// -    ["66 mm", "134 mm", "-1 mm"],
    /// -    ["-147 mm", "9 mm", "0 mm"],
    /// -    ["-152 mm", "-4 mm", "3 mm"],
    /// -    ["74 mm", "-128 mm", "-2 mm"],
    /// -    ["83 mm", "-133 mm", "1 mm"],
    /// -]
    /// -platform_joints = [
    /// -    ["103 mm", "5 mm", "-12 mm"],
    /// -    ["-44 mm", "91 mm", "-10 mm"],
    /// -    ["-56 mm", "83 mm", "-11 mm"],
    /// -    ["-51 mm", "-88 mm", "-12 mm"],
    /// -    ["-46 mm", "-84 mm", "-9 mm"],
    /// -    ["98 mm", "-3 mm", "-10 mm"],
    /// +    ["81 mm", "-125 mm", "2 mm"],
    /// +    ["66 mm", "-134 mm", "-1 mm"],
    /// +    ["-147 mm", "-9 mm", "0 mm"],
    /// +    ["-152 mm", "4 mm", "3 mm"],
    /// +    ["74 mm", "128 mm", "-2 mm"],
    /// +    ["83 mm", "133 mm", "1 mm"],
    /// +]
    /// +platform_joints = [
    /// +    ["103 mm", "-5 mm", "-12 mm"],
    /// +    ["-44 mm", "-91 mm", "-10 mm"],
    /// +    ["-56 mm", "-83 mm", "-11 mm"],
    /// +    ["-51 mm", "88 mm", "-12 mm"],
    /// +    ["-46 mm", "84 mm", "-9 mm"],
    /// +    ["98 mm", "3 mm", "-10 mm"],
    /// ```
    ///
    /// ## Fix
    ///
    /// Seen from above, y is to the left of x.
    ///
    /// ```toml
    ///     ["81 mm", "125 mm", "2 mm"],
    ///     ["66 mm", "134 mm", "-1 mm"],
    ///     ["-147 mm", "9 mm", "0 mm"],
    ///     ["-152 mm", "-4 mm", "3 mm"],
    ///     ["74 mm", "-128 mm", "-2 mm"],
    ///     ["83 mm", "-133 mm", "1 mm"],
    /// ]
    /// platform_joints = [
    ///     ["103 mm", "5 mm", "-12 mm"],
    ///     ["-44 mm", "91 mm", "-10 mm"],
    ///     ["-56 mm", "83 mm", "-11 mm"],
    ///     ["-51 mm", "-88 mm", "-12 mm"],
    ///     ["-46 mm", "-84 mm", "-9 mm"],
    ///     ["98 mm", "-3 mm", "-10 mm"],
    /// ```
    JOINTS_CLOCKWISE = "W0882";

    /// # W0818: legs that cross
    ///
    /// Swapping two platform joints should not make the legs shorter. Nor should
    /// starting one list at another joint, or reversing it.
    ///
    /// ## Why it matters
    ///
    /// Both lists of joints are in the order of the legs. If two are swapped, each
    /// voltage goes to the wrong leg. A layout with crossed legs is possible, but rare.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-joints.toml` with
    ///
    /// ```diff
    /// @@ [geometry] @@
    /// -    ["-46 mm", "-84 mm", "-9 mm"],
    /// -    ["98 mm", "-3 mm", "-10 mm"],
    /// +    ["98 mm", "-3 mm", "-10 mm"],
    /// +    ["-46 mm", "-84 mm", "-9 mm"],
    /// ```
    ///
    /// ## Fix
    ///
    /// Put both lists in the same order.
    ///
    /// ```toml
    ///     ["-46 mm", "-84 mm", "-9 mm"],
    ///     ["98 mm", "-3 mm", "-10 mm"],
    /// ```
    LEGS_CROSS = "W0818";
}

/// Legs that swapping joints would shorten by more than this share cross.
const CROSSED: f64 = 1e-3;

/// Direction of the points about their middle, seen from above: positive is counter-clockwise. Twice the area of their polygon,
/// m².
pub(super) fn turn(points: &[[f64; 3]]) -> f64 {
    let count = points.len();
    let following = |k: usize| points[(k + 1) % count];
    (0..count).fold(0.0, |sum, k| sum + points[k][0] * following(k)[1] - points[k][1] * following(k)[0])
}

fn is_listed(facts: &Facts, body: &str) -> bool {
    facts.model.spans.contains_key(&format!("geometry.{body}_joints"))
}

/// Checks that joints are numbered as in (1) and (2): counter-clockwise, seen from above.
fn joints_run_round(facts: &Facts, found: &mut Findings) {
    let geometry = &facts.model.geometry;
    let bodies = [("base", turn(&geometry.base_joints)), ("platform", turn(&geometry.platform_joints))];
    let clockwise: Vec<&str> =
        bodies.iter().filter(|(body, turn)| *turn < 0.0 && is_listed(facts, body)).map(|(body, _)| *body).collect();
    let (key, message) = match clockwise[..] {
        [one] => (
            one,
            format!(
                "seen from above, the joints of the {one} are listed clockwise, those of the other body counter-clockwise"
            ),
        ),
        [_, _] => ("base", "seen from above, the joints of base and platform are listed clockwise".to_owned()),
        _ => return,
    };
    found.add(
        JOINTS_CLOCKWISE,
        &format!("geometry.{key}_joints"),
        message,
        &format!(
            "equations (1) and (2) of the paper number legs counter-clockwise: check the sign of y, the order of x and y, and the order of the lists; if the legs are numbered clockwise on purpose, allow it in [lint]: allow = [\"geometry.{key}_joints: <reason>\"]"
        ),
    );
}

/// Total length of the legs if leg k goes from base joint k to platform joint `to(k)`, m.
fn length(geometry: &Geometry, to: impl Fn(usize) -> usize) -> f64 {
    (0..6).fold(0.0, |sum, k| sum + leg(geometry, k, to(k)))
}

fn leg(geometry: &Geometry, base: usize, platform: usize) -> f64 {
    let (b, p) = (&geometry.base_joints[base], &geometry.platform_joints[platform]);
    libm::hypot(libm::hypot(p[0] - b[0], p[1] - b[1]), geometry.height + p[2] - b[2])
}

/// Checks whether legs cross. Only listed joints can be in the wrong order; joints on circles cannot.
fn legs_cross(facts: &Facts, found: &mut Findings) {
    let geometry = &facts.model.geometry;
    if !["base", "platform"].iter().any(|body| is_listed(facts, body)) {
        return;
    }
    let help = "`geometry.base_joints` and `geometry.platform_joints` must have the legs in the same order";
    let now = length(geometry, |k| k);
    let limit = now * (1.0 - CROSSED);
    let pairs: Vec<(usize, usize)> = (0..6).flat_map(|i| (i + 1..6).map(move |j| (i, j))).collect();
    let exchanged = |(i, j): (usize, usize)| {
        length(geometry, |k| match k {
            _ if k == i => j,
            _ if k == j => i,
            _ => k,
        })
    };
    let crossing = |pair: &(usize, usize)| {
        let (i, j) = *pair;
        let both = leg(geometry, i, i) + leg(geometry, j, j);
        leg(geometry, i, j) + leg(geometry, j, i) < both * (1.0 - CROSSED)
    };
    // The whole list started at another joint, or reversed.
    let turned = (0..12_usize).map(|k| (k, length(geometry, |leg| if k < 6 { (leg + k) % 6 } else { (k - leg) % 6 })));
    let best = turned.reduce(|best, one| if one.1 < best.1 { one } else { best });
    let best_pair =
        pairs.iter().map(|pair| exchanged(*pair)).fold(now, |best, one| if one < best { one } else { best });
    if let Some((k, shorter)) = best.filter(|(_, shorter)| *shorter < limit && *shorter < best_pair) {
        let how = if k < 6 { format!("starting {k} joints later") } else { "in reverse order".to_owned() };
        let [length, other] = [now * 1e3, shorter * 1e3].map(figure);
        found.add(
            LEGS_CROSS,
            "geometry.platform_joints[0]",
            format!(
                "the legs cross: their total length is {length} mm, but {other} mm with the platform's joints listed {how}"
            ),
            help,
        );
        return;
    }
    let Some((i, j)) = pairs.iter().copied().find(crossing) else { return };
    let (now, then) = (leg(geometry, i, i) + leg(geometry, j, j), leg(geometry, i, j) + leg(geometry, j, i));
    let [length, other] = [now * 1e3, then * 1e3].map(figure);
    found.add(
        LEGS_CROSS,
        &format!("geometry.platform_joints[{i}]"),
        format!(
            "legs {i} and {j} cross: their total length is {length} mm, but {other} mm with their platform joints exchanged"
        ),
        help,
    );
}
