//! Whether one slip in the layout of the gauges would explain that it sees a motion badly; in which order they are listed.

use nalgebra::Matrix6;

use super::gauge_pattern::{Change, GAUGE_PATTERN, changes};
use super::gauge_places::GAUGE_FAR;
use super::gauges::GAUGES_ALIKE;
use super::order::{JOINTS_CLOCKWISE, turn};
use super::{Facts, Found, figure};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::Probe;
use specgen_numerics::{cross, dot};

lints! {
    rules: slip_of_one, gauges_run_round;

    /// # W0826: a layout of gauges that one slip would explain
    ///
    /// Where the gauges see some motion badly, each sign and each order of two
    /// coordinates is tried; one that makes the layout sound is named.
    ///
    /// ## Why it matters
    ///
    /// A badly seen motion amplifies the noise of the gauges by the condition number.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["-80 mm", "0 mm", "180 mm"]
    /// +point     = ["70 mm", "0 mm", "180 mm"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Correct the gauge that the message names.
    ///
    /// ```toml
    /// point     = ["-80 mm", "0 mm", "180 mm"]
    /// ```
    GAUGE_SLIP = "W0826";

    /// # N0883: gauges and joints numbered in opposite directions
    ///
    /// The three gauges along the axis run round it in the opposite direction to the
    /// joints, seen from above.
    ///
    /// ## Why it matters
    ///
    /// Any order may be meant. But if x or y of the gauges was measured to the other
    /// side, the layout is mirrored: everything else about it looks right, and
    /// rotations are measured with the wrong sign.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// -
    /// -[[gauge]]
    /// -point     = ["-40 mm", "-69.282 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// +point     = ["-40 mm", "-69.282 mm", "180 mm"]
    /// +direction = [0, 0, 1]
    /// +
    /// +[[gauge]]
    /// +point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// +direction = [0, 0, 1]
    /// ```
    ///
    /// ## Fix
    ///
    /// Nothing, if the gauges are wired in this order. Otherwise correct the signs.
    ///
    /// ```toml
    /// point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// direction = [0, 0, 1]
    ///
    /// [[gauge]]
    /// point     = ["-40 mm", "-69.282 mm", "180 mm"]
    /// direction = [0, 0, 1]
    /// ```
    GAUGES_MIRRORED = "N0883";
}

/// A layout is suspected if undoing one slip makes its condition this many times better.
const MUCH_BETTER: f64 = 1.5;
/// Below this condition a layout is good whatever could be better.
const GOOD: f64 = 2.0;

/// Within this cosine of the axis a gauge looks along it.
const AXIAL: f64 = 0.99;

/// Best seen over worst seen motion, turns counted at the joint radius; infinite if one is not seen at all.
fn condition(probes: &[Probe; 6], height: f64, radius: f64) -> f64 {
    let mut rows = Matrix6::zeros();
    for (k, probe) in probes.iter().enumerate() {
        let (n, m) = (probe.direction, probe.plane_normal);
        let start = [probe.point[0], probe.point[1], probe.point[2] - height];
        let across = dot(m, n);
        let way = dot(m, core::array::from_fn(|j| probe.plane_point[j] - start[j])) / across;
        let c: [f64; 3] = core::array::from_fn(|j| start[j] + way * n[j]);
        let m = m.map(|part| part / across);
        let turn = cross(c, m);
        for j in 0..3 {
            rows[(k, j)] = m[j];
            rows[(k, j + 3)] = turn[j] / radius;
        }
    }
    if rows.iter().any(|part| !part.is_finite()) {
        return f64::INFINITY;
    }
    let values = rows.singular_values();
    if values.min() > 1e-9 { values.max() / values.min() } else { f64::INFINITY }
}

/// Names the one gauge whose sign or order of coordinates would explain a layout that sees badly.
fn slip_of_one(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    // A slip that puts a gauge out of the pattern of the others is known better from that, and a copy as a copy.
    let known = |finding: &Diagnostic| finding.code == GAUGE_PATTERN || finding.code == GAUGES_ALIKE;
    if found.list.iter().any(known) || (0..6).any(|gauge| found.is_in_other_frame(gauge)) {
        return;
    }
    let (height, radius) = (facts.model.geometry.height, facts.model.geometry.joint_radius());
    let now = condition(&task.probes, height, radius);
    if now <= GOOD {
        return;
    }
    let mut tried: Vec<(f64, Change)> = Vec::new();
    for (gauge, probe) in task.probes.iter().enumerate() {
        for change in changes(gauge, probe, height) {
            let mut probes = task.probes.clone();
            probes[gauge] = change.probe.clone();
            tried.push((condition(&probes, height, radius), change));
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some((best, first)) = tried.first() else { return };
    if !best.is_finite() || now < MUCH_BETTER * best {
        return;
    }
    // Others do as well, or nearly: the slip may be in any of them.
    let mut keys: Vec<&str> = Vec::new();
    for (_, change) in tried.iter().filter(|(other, _)| *other <= 1.2 * best) {
        if !keys.contains(&change.key.as_str()) {
            keys.push(&change.key);
        }
    }
    let seen = if now.is_finite() {
        format!("see one motion {} times better than another", figure(now))
    } else {
        "do not see every motion".to_owned()
    };
    found.add(
        GAUGE_SLIP,
        &first.key,
        format!(
            "the gauges {seen}; with {} in `{}` changed it would be {} times",
            first.what,
            first.key,
            figure(*best)
        ),
        &format!(
            "check signs and order of the coordinates in {}",
            keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
        ),
    );
}

/// Gauges along the axis that are numbered the other way round than the joints: a mirrored layout looks so.
fn gauges_run_round(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    // These findings explain it.
    let known = [JOINTS_CLOCKWISE, GAUGE_PATTERN, GAUGE_FAR];
    if found.list.iter().any(|one| known.iter().any(|code| one.code == *code)) {
        return;
    }
    let axial = task.probes.iter().enumerate().filter(|(_, probe)| libm::fabs(probe.direction[2]) > AXIAL);
    let (numbers, points): (Vec<usize>, Vec<[f64; 3]>) = axial.map(|(gauge, probe)| (gauge, probe.point)).unzip();
    let of_joints = turn(&facts.model.geometry.base_joints);
    if points.len() != 3 || turn(&points) * of_joints >= 0.0 {
        return;
    }
    let way = if of_joints < 0.0 { ["counter-clockwise", "clockwise"] } else { ["clockwise", "counter-clockwise"] };
    found.add(
        GAUGES_MIRRORED,
        &format!("gauge[{}].point", numbers[1]),
        format!(
            "gauges {}, {} and {} run {} seen from above, the joints {}",
            numbers[0], numbers[1], numbers[2], way[0], way[1]
        ),
        "gauges may be numbered in any order; but if x or y was measured to the other side, the layout is mirrored, and rotations come out with the wrong sign",
    );
}
