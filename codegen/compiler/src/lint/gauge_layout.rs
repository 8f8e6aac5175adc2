//! Mistakes that explain why the gauges measure some motion badly; the order in which gauges are listed.

use nalgebra::Matrix6;

use super::gauge_pattern::{Change, GAUGE_PATTERN, changes};
use super::gauge_places::GAUGE_FAR;
use super::gauges::GAUGES_ALIKE;
use super::order::{JOINTS_CLOCKWISE, turn};
use super::{Facts, Findings, figure};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::Probe;
use specgen_numerics::{cross, dot};

lints! {
    rules: slip_of_one, gauges_run_round;

    /// # W0826: a poor gauge layout that one mistake would explain
    ///
    /// If the gauges measure some motion badly, each sign and each order of two
    /// coordinates is tried. One that makes the layout good is reported.
    ///
    /// ## Why it matters
    ///
    /// For a badly measured motion, the condition number amplifies the gauge noise.
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
    /// Correct the gauge named in the message.
    ///
    /// ```toml
    /// point     = ["-80 mm", "0 mm", "180 mm"]
    /// ```
    GAUGE_SLIP = "W0826";

    /// # N0883: gauges and joints numbered in opposite directions
    ///
    /// Seen from above, the three gauges along the axis are numbered in the opposite
    /// direction to the joints.
    ///
    /// ## Why it matters
    ///
    /// Any order is possible. But if x or y of the gauges has the wrong sign, the
    /// layout is mirrored: everything else looks right, but rotations are measured with
    /// the wrong sign.
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
    /// None needed if the gauges are wired in this order. Otherwise correct the signs.
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

/// A layout is reported if undoing one mistake improves its condition number by this factor.
const MUCH_BETTER: f64 = 1.5;
/// Below this condition number a layout is good.
const GOOD: f64 = 2.0;

/// Least cosine to the axis of a gauge that measures along it.
const AXIAL: f64 = 0.99;

/// Condition number: best over worst measured motion, rotations as motion at the joint radius; infinite if one is not measured.
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

/// Finds the gauge whose sign or order of coordinates would explain a poor layout.
fn slip_of_one(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    // These findings are more specific.
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
    // Changes that are as good or nearly as good: the mistake may be in any of them.
    let mut keys: Vec<&str> = Vec::new();
    for (_, change) in tried.iter().filter(|(other, _)| *other <= 1.2 * best) {
        if !keys.contains(&change.key.as_str()) {
            keys.push(&change.key);
        }
    }
    let seen = if now.is_finite() {
        format!("measure one motion {} times better than another", figure(now))
    } else {
        "do not measure every motion".to_owned()
    };
    let (what, key, best) = (&first.what, &first.key, figure(*best));
    found.add(
        GAUGE_SLIP,
        &first.key,
        format!("the gauges {seen}; with {what} in `{key}` changed, the ratio would be {best}"),
        &format!(
            "check the signs and the order of the coordinates in {}",
            keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
        ),
    );
}

/// Checks whether gauges along the axis are numbered in the opposite direction to the joints, as in a mirrored layout.
fn gauges_run_round(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    // These findings would explain it.
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
            "seen from above, gauges {}, {} and {} are numbered {}, the joints {}",
            numbers[0], numbers[1], numbers[2], way[0], way[1]
        ),
        "gauges may be numbered in any order; but if x or y has the wrong sign, the layout is mirrored, and rotations are measured with the wrong sign",
    );
}
