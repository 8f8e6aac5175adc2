//! In which order gauges are listed.

use super::gauge_pattern::GAUGE_PATTERN;
use super::gauge_places::GAUGE_FAR;
use super::order::JOINTS_CLOCKWISE;
use super::order::turn;
use super::{Facts, Found, Lints};
use specgen_language::diagnostic::Code;

lints! {
    rules: gauges_run_round;

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

/// Within this cosine of the axis a gauge looks along it.
const AXIAL: f64 = 0.99;

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
