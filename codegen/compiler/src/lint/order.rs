//! In which order joints and gauges are listed.

use super::{Facts, Found, figure};
use specgen_language::diagnostic::codes;
use specgen_language::model::Geometry;

/// Legs that would be shorter by more than this share with each other's joints cross.
const CROSSED: f64 = 1e-3;
/// Within this cosine of the axis a gauge looks along it.
const AXIAL: f64 = 0.99;

/// Which way points run round their middle in the order of the list, seen from above: positive counter-clockwise. Twice the
/// area of their polygon, m².
fn turn(points: &[[f64; 3]]) -> f64 {
    let count = points.len();
    let following = |k: usize| points[(k + 1) % count];
    (0..count).fold(0.0, |sum, k| sum + points[k][0] * following(k)[1] - points[k][1] * following(k)[0])
}

fn is_listed(facts: &Facts, body: &str) -> bool {
    facts.model.spans.contains_key(&format!("geometry.{body}_joints"))
}

/// Joints are numbered as in (1) and (2), counter-clockwise seen from above.
pub(super) fn joints_run_round(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    let bodies = [("base", turn(&geometry.base_joints)), ("platform", turn(&geometry.platform_joints))];
    let clockwise: Vec<&str> =
        bodies.iter().filter(|(body, turn)| *turn < 0.0 && is_listed(facts, body)).map(|(body, _)| *body).collect();
    let (key, message) = match clockwise[..] {
        [one] => (
            one,
            format!(
                "the joints of the {one} run clockwise, seen from above, those of the other body counter-clockwise"
            ),
        ),
        [_, _] => ("base", "the joints of base and platform run clockwise, seen from above".to_owned()),
        _ => return,
    };
    found.add(
        codes::JOINTS_CLOCKWISE,
        &format!("geometry.{key}_joints"),
        message,
        &format!(
            "the paper's equations (1) and (2) number legs counter-clockwise, x to the right, y up, seen from above: check the sign of y, that x and y are not exchanged, and the order of the lists; if the legs are numbered clockwise, say so in [lint]: allow = [\"geometry.{key}_joints: <reason>\"]"
        ),
    );
}

/// Gauges along the axis that are numbered the other way round than the joints: a mirrored layout looks so.
pub(super) fn gauges_run_round(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    // These findings explain it.
    let known = [codes::JOINTS_CLOCKWISE, codes::GAUGE_PATTERN, codes::GAUGE_FAR];
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
        codes::GAUGES_MIRRORED,
        &format!("gauge[{}].point", numbers[1]),
        format!(
            "gauges {}, {} and {} run {} seen from above, the joints {}",
            numbers[0], numbers[1], numbers[2], way[0], way[1]
        ),
        "gauges may be numbered in any order; but if x or y was measured to the other side, the layout is mirrored, and rotations come out with the wrong sign",
    );
}

/// Length of all legs together if leg k goes from base joint k to platform joint `to(k)`, m.
fn length(geometry: &Geometry, to: impl Fn(usize) -> usize) -> f64 {
    (0..6).fold(0.0, |sum, k| sum + leg(geometry, k, to(k)))
}

fn leg(geometry: &Geometry, base: usize, platform: usize) -> f64 {
    let (b, p) = (&geometry.base_joints[base], &geometry.platform_joints[platform]);
    libm::hypot(libm::hypot(p[0] - b[0], p[1] - b[1]), geometry.height + p[2] - b[2])
}

/// Legs do not cross. Joints on circles are paired by rule; those of a list may be in another order on one body.
pub(super) fn legs_cross(facts: &Facts, found: &mut Found) {
    let geometry = &facts.model.geometry;
    if !["base", "platform"].iter().any(|body| is_listed(facts, body)) {
        return;
    }
    let help = "`geometry.base_joints` and `geometry.platform_joints` list the legs in the same order: check it on both bodies";
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
    // The whole list begun elsewhere, or read backwards.
    let turned = (0..12_usize).map(|k| (k, length(geometry, |leg| if k < 6 { (leg + k) % 6 } else { (k - leg) % 6 })));
    let best = turned.reduce(|best, one| if one.1 < best.1 { one } else { best });
    let best_pair =
        pairs.iter().map(|pair| exchanged(*pair)).fold(now, |best, one| if one < best { one } else { best });
    if let Some((k, shorter)) = best.filter(|(_, shorter)| *shorter < limit && *shorter < best_pair) {
        let how = if k < 6 { format!("{k} places further on") } else { "in the other direction".to_owned() };
        found.add(
            codes::LEGS_CROSS,
            "geometry.platform_joints[0]",
            format!(
                "the legs cross: together they are {} mm long, and {} mm if the platform's joints were listed {how}",
                figure(now * 1e3),
                figure(shorter * 1e3)
            ),
            help,
        );
        return;
    }
    let Some((i, j)) = pairs.iter().copied().find(crossing) else { return };
    let (now, then) = (leg(geometry, i, i) + leg(geometry, j, j), leg(geometry, i, j) + leg(geometry, j, i));
    found.add(
        codes::LEGS_CROSS,
        &format!("geometry.platform_joints[{i}]"),
        format!(
            "legs {i} and {j} cross: together they are {} mm long, and {} mm if each went to the other's joint",
            figure(now * 1e3),
            figure(then * 1e3)
        ),
        help,
    );
}
