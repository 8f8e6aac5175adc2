//! Gauges are usually arranged in a pattern. A gauge that breaks the pattern, and would fit after correcting one mistake,
//! probably has that mistake: a random layout fits a pattern to a thousandth only once in hundreds.

use super::gauges::GAUGES_ALIKE;
use super::{Facts, Findings};
use specgen_language::model::Probe;

lints! {
    rules: out_of_pattern;

    /// # W0848: a gauge that breaks the pattern of the others
    ///
    /// Gauges usually share one height or one radius, measure along the axis, along
    /// their radius or tangentially, or form an equilateral triangle. A gauge that does
    /// not, but would with a different sign, digit or order of its coordinates, is
    /// reported.
    ///
    /// ## Why it matters
    ///
    /// If a gauge is not where the spec says, its lever arm is wrong: the pose has
    /// tilts that do not exist.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// +point     = ["40 mm", "69.282 mm", "180 mm"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Compare the coordinates with the drawing.
    ///
    /// ```toml
    /// point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// ```
    GAUGE_PATTERN = "W0848";
}

/// Relative tolerance of a pattern: points are written with four digits.
const NEAR: f64 = 2e-3;

/// One possible mistake in one gauge, corrected.
pub(super) struct Change {
    pub(super) key: String,
    pub(super) what: String,
    pub(super) probe: Probe,
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Variants of `vector` with a changed sign or swapped coordinates, each with its description.
fn changed(vector: [f64; 3]) -> Vec<([f64; 3], String)> {
    let mut list = Vec::new();
    for k in 0..3 {
        let mut other = vector;
        other[k] = -vector[k];
        list.push((other, format!("the sign of {}", AXES[k])));
        let (a, b) = (k, (k + 1) % 3);
        let mut other = vector;
        other.swap(a, b);
        list.push((other, format!("the order of {} and {}", AXES[a], AXES[b])));
    }
    for by in 1..3 {
        let mut other = vector;
        other.rotate_left(by);
        list.push((other, "the order of x, y and z".to_owned()));
    }
    list.retain(|(other, _)| *other != vector);
    list
}

pub(super) fn changes(gauge: usize, probe: &Probe, height: f64) -> Vec<Change> {
    let point = changed(probe.point).into_iter().map(|(point, what)| Change {
        key: format!("gauge[{gauge}].point"),
        what,
        // The target moves with the gauge.
        probe: Probe { point, plane_point: [point[0], point[1], point[2] - height], ..probe.clone() },
    });
    let direction = changed(probe.direction).into_iter().map(|(direction, what)| Change {
        key: format!("gauge[{gauge}].direction"),
        what,
        probe: Probe { direction, plane_normal: direction, ..probe.clone() },
    });
    point.chain(direction).collect()
}

/// Whether a gauge fits the pattern of the others; none if the others have no such pattern.
type Pattern = fn(&[Probe; 6], usize) -> Option<bool>;

const PATTERNS: [(Pattern, &str); 4] = [
    (height, "is at the height of the other five"),
    (radius, "is as far from the axis as the other five"),
    (line, "measures along the axis, along its radius or tangentially, as the other five do"),
    (triangle, "forms an equilateral triangle with the other two that measure along the axis"),
];

fn across(probe: &Probe) -> f64 {
    libm::hypot(probe.point[0], probe.point[1])
}

fn height(probes: &[Probe; 6], gauge: usize) -> Option<bool> {
    let size = probes.iter().map(across).fold(0.0, |a: f64, b| if b > a { b } else { a });
    let one = probes[usize::from(gauge == 0)].point[2];
    let at = |probe: &Probe| libm::fabs(probe.point[2] - one) <= NEAR * size;
    let others = probes.iter().enumerate().all(|(other, probe)| other == gauge || at(probe));
    others.then(|| at(&probes[gauge]))
}

fn radius(probes: &[Probe; 6], gauge: usize) -> Option<bool> {
    let one = across(&probes[usize::from(gauge == 0)]);
    let at = |probe: &Probe| libm::fabs(across(probe) - one) <= NEAR * one;
    let others = probes.iter().enumerate().all(|(other, probe)| other == gauge || at(probe));
    others.then(|| at(&probes[gauge]))
}

fn line(probes: &[Probe; 6], gauge: usize) -> Option<bool> {
    let straight = |probe: &Probe| {
        let ([x, y, _], [a, b, c]) = (probe.point, probe.direction);
        let (along, aside) = (libm::fabs(a * x + b * y), libm::fabs(a * y - b * x));
        let near = NEAR * across(probe);
        axial(probe) || (libm::fabs(c) <= NEAR && (along <= near || aside <= near))
    };
    let others = probes.iter().enumerate().all(|(other, probe)| other == gauge || straight(probe));
    others.then(|| straight(&probes[gauge]))
}

fn axial(probe: &Probe) -> bool {
    libm::hypot(probe.direction[0], probe.direction[1]) <= NEAR
}

fn triangle(probes: &[Probe; 6], gauge: usize) -> Option<bool> {
    let trio: Vec<[f64; 3]> = probes.iter().filter(|probe| axial(probe)).map(|probe| probe.point).collect();
    let [a, b, c] = trio[..] else { return None };
    let side = |p: [f64; 3], q: [f64; 3]| libm::hypot(p[0] - q[0], p[1] - q[1]);
    let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
    let alike = libm::fabs(ab - bc) <= NEAR * ab && libm::fabs(bc - ca) <= NEAR * ab;
    axial(&probes[gauge]).then_some(ab > 0.0 && alike)
}

/// The gauge with its point taken as relative to the platform.
fn frame(gauge: usize, probe: &Probe, height: f64) -> Change {
    let [x, y, z] = probe.point;
    Change {
        key: format!("gauge[{gauge}].point"),
        what: "z measured from the base, in {B},".to_owned(),
        probe: Probe { point: [x, y, z + height], plane_point: [x, y, z], ..probe.clone() },
    }
}

/// A coordinate with a digit too many or too few, or cm for mm.
fn digits(gauge: usize, probe: &Probe, height: f64) -> Vec<Change> {
    let each = (0..3).flat_map(|axis| [(axis, 10.0), (axis, 0.1)]);
    each.map(|(axis, factor)| {
        let mut point = probe.point;
        point[axis] *= factor;
        Change {
            key: format!("gauge[{gauge}].point"),
            what: format!("the digits of {}", ["x", "y", "z"][axis]),
            probe: Probe { point, plane_point: [point[0], point[1], point[2] - height], ..probe.clone() },
        }
    })
    .collect()
}

/// Finds the gauge whose sign, digits or order of coordinates, if corrected, would fit the pattern.
fn out_of_pattern(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    // A copied gauge has its own finding.
    if found.list.iter().any(|finding| finding.code == GAUGES_ALIKE) {
        return;
    }
    // For each change that breaks no pattern: how many patterns it restores, and one of them.
    let mut restoring: Vec<(usize, &str, Change)> = Vec::new();
    for gauge in 0..6 {
        let now = PATTERNS.map(|(pattern, _)| pattern(&task.probes, gauge));
        if !now.contains(&Some(false)) || found.is_in_other_frame(gauge) {
            continue;
        }
        let (probe, height) = (&task.probes[gauge], facts.model.geometry.height);
        let other = digits(gauge, probe, height).into_iter().chain([frame(gauge, probe, height)]);
        for change in changes(gauge, probe, height).into_iter().chain(other) {
            let mut probes = task.probes.clone();
            probes[gauge] = change.probe.clone();
            let then = PATTERNS.map(|(pattern, _)| pattern(&probes, gauge));
            let breaks = (0..PATTERNS.len()).any(|k| now[k] == Some(true) && then[k] != Some(true));
            let fixed: Vec<usize> =
                (0..PATTERNS.len()).filter(|k| now[*k] == Some(false) && then[*k] == Some(true)).collect();
            if let (false, Some(first)) = (breaks, fixed.first()) {
                restoring.push((fixed.len(), PATTERNS[*first].1, change));
            }
        }
    }
    restoring.sort_by_key(|one| core::cmp::Reverse(one.0));
    let Some((most, pattern, first)) = restoring.first() else { return };
    let mut keys: Vec<&str> = Vec::new();
    for (_, _, change) in restoring.iter().filter(|one| one.0 == *most) {
        if !keys.contains(&change.key.as_str()) {
            keys.push(&change.key);
        }
    }
    found.add(
        GAUGE_PATTERN,
        &first.key,
        format!("with {} in `{}` changed, the gauge {pattern}; as written it does not fit", first.what, first.key),
        &format!(
            "check the signs, the digits and the order of the coordinates, which are in {{B}}, in {}",
            keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
        ),
    );
}
