//! Layout of the gauges, and whether the six determine the pose.

use nalgebra::Matrix6;
use specgen_runtime::Gauges;

use super::finding;
use crate::lower::linear::{self, Matrix, cross, dot, dusted, norm};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{Model, Probe};
use specgen_numerics::multiply6;

/// Largest distance from P_C at which a line may meet its plane, in joint radii.
const FARTHEST: f64 = 10.0;
/// Largest ratio of the best to the worst measured motion, with rotations as motion of the targets.
const WORST_CONDITION: f64 = 100.0;

/// Gauges as in the runtime's equations, in f64, and J.
pub(super) struct Layout {
    pub(super) direction: [[f64; 3]; 6],
    pub(super) normal: [[f64; 3]; 6],
    pub(super) skew: [[f64; 3]; 6],
    pub(super) pierced: [[f64; 3]; 6],
    /// J = ∂y/∂h at rest: rows [m, c × m].
    pub(super) jacobian: Matrix,
    pub(super) inverse: Matrix,
    pub(super) curvature: Matrix,
}

impl Layout {
    /// The gauges for the runtime, with one pass.
    pub(super) fn gauges<'a>(&self, (arc_sine, arc_tangent): &'a (Vec<f64>, Vec<f64>)) -> Gauges<'a, f64> {
        Gauges {
            direction: self.direction,
            normal: self.normal,
            skew: self.skew,
            pierced: self.pierced,
            inverse: self.inverse,
            curvature: self.curvature,
            passes: 1,
            arc_sine,
            arc_tangent,
        }
    }
}

/// The layout, if every line meets its plane and the gauges measure every motion.
pub(super) fn check(model: &Model, probes: &[Probe; 6]) -> Result<Layout, Vec<Diagnostic>> {
    let mut findings = Vec::new();
    let mut direction = [[0.0; 3]; 6];
    let mut normal = [[0.0; 3]; 6];
    let mut skew = [[0.0; 3]; 6];
    let mut pierced = [[0.0; 3]; 6];
    for (k, probe) in probes.iter().enumerate() {
        match target(model, k, probe) {
            Ok(target) => (direction[k], normal[k], skew[k], pierced[k]) = target,
            Err(found) => findings.extend(found),
        }
    }
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut jacobian = [[0.0; 6]; 6];
    for ((row, m), c) in jacobian.iter_mut().zip(&normal).zip(&pierced) {
        let ([x, y, z], [a, b, c]) = (*m, cross(*c, *m));
        *row = [x, y, z, a, b, c];
    }
    let lever = lever(model, &pierced);
    blind_motion(&jacobian, lever).map_or(Ok(()), |motion| Err(vec![blind(model, motion)]))?;
    let inverse = linear::inverse(&jacobian).ok_or_else(|| vec![blind(model, (f64::INFINITY, [0.0; 6]))])?;
    let mut second = [[0.0; 6]; 6];
    for ((row, m), c) in second.iter_mut().zip(&normal).zip(&pierced) {
        // ½ [(m·ψ)(c·ψ) − (m·c)|ψ|²] by products of ψ.
        *row = [
            -0.5 * (m[1] * c[1] + m[2] * c[2]),
            -0.5 * (m[0] * c[0] + m[2] * c[2]),
            -0.5 * (m[0] * c[0] + m[1] * c[1]),
            0.5 * (m[0] * c[1] + m[1] * c[0]),
            0.5 * (m[0] * c[2] + m[2] * c[0]),
            0.5 * (m[1] * c[2] + m[2] * c[1]),
        ];
    }
    let curvature = multiply6(&inverse, &second);
    let rows = |of_translation: f64, of_rotation: f64| {
        [of_translation, of_translation, of_translation, of_rotation, of_rotation, of_rotation]
    };
    Ok(Layout {
        direction,
        normal,
        skew,
        pierced,
        jacobian,
        inverse: linear::with_alike(linear::without_dust(inverse, rows(1.0, 1.0 / lever))),
        curvature: linear::with_alike(linear::without_dust(curvature, rows(lever, 1.0))),
    })
}

/// n, m, m × n and c of one gauge.
type Target = ([f64; 3], [f64; 3], [f64; 3], [f64; 3]);

fn target(model: &Model, k: usize, probe: &Probe) -> Result<Target, Vec<Diagnostic>> {
    let (n, m) = (probe.direction, probe.plane_normal);
    let across = dot(m, n);
    // In {P} the point of the line is `point` − P₀.
    let start = [probe.point[0], probe.point[1], probe.point[2] - model.geometry.height];
    let way = dot(m, [0, 1, 2].map(|j| probe.plane_point[j] - start[j])) / across;
    let c = [0, 1, 2].map(|j| start[j] + way * n[j]);
    let radius = model.geometry.joint_radius();
    // The checks of the spec refuse a line parallel to its plane, which would meet it at infinity.
    let far = norm(c);
    if far.is_nan() || far > FARTHEST * radius {
        let (distance, joints) = (far * 1e3, radius * 1e3);
        return Err(vec![finding(
            model,
            codes::PROBE_MISSES,
            &format!("gauge[{k}].point"),
            format!(
                "the line of gauge {k} meets its target plane {distance:.1} mm from P_C, but the platform's joints are {joints:.1} mm from it"
            ),
            "check `point` and `direction` (in {B}), `target_point` and `target_normal` (in {P}, from P_C) of the gauge"
                .to_owned(),
        )]);
    }
    let scaled = m.map(|part| dusted(part / across, 1.0));
    let clean = |v: [f64; 3], size: f64| v.map(|part| dusted(part, size));
    Ok((clean(n, 1.0), scaled, clean(cross(scaled, n), 1.0), clean(c, radius)))
}

/// Typical distance of the targets from P_C, m: the lever arm that makes rotations comparable with translations.
fn lever(model: &Model, pierced: &[[f64; 3]; 6]) -> f64 {
    let mean = pierced.iter().fold(0.0, |sum, c| sum + dot(*c, *c)) / 6.0;
    let radius = model.geometry.joint_radius();
    if mean > 1e-6 * radius * radius { libm::sqrt(mean) } else { radius }
}

/// The worst measured motion, if the condition number is too large: condition number, and pose coordinates whose largest translation
/// or rotation times `lever` is 1.
fn blind_motion(jacobian: &Matrix, lever: f64) -> Option<(f64, [f64; 6])> {
    // Used only for this check: no emitted number depends on it.
    let scaled = Matrix6::from_fn(|i, j| if j < 3 { jacobian[i][j] } else { jacobian[i][j] / lever });
    let svd = scaled.svd(false, true);
    let (smallest, value) = svd.singular_values.argmin();
    let condition = svd.singular_values.max() / value;
    if condition <= WORST_CONDITION {
        return None;
    }
    let motion = svd.v_t?.row(smallest).into_owned();
    let largest = motion.iter().fold(0.0_f64, |a, b| if b.abs() > a.abs() { *b } else { a });
    let mut coordinates = [0.0; 6];
    for (k, coordinate) in coordinates.iter_mut().enumerate() {
        *coordinate = motion[k] / largest / if k < 3 { 1.0 } else { lever };
    }
    Some((condition, coordinates))
}

fn blind(model: &Model, (condition, motion): (f64, [f64; 6])) -> Diagnostic {
    // A motion of 1 µm without parts below a thousandth.
    let lever = motion[3..].iter().fold(1.0_f64, |a, b| if b.abs() > a { b.abs() } else { a });
    let parts: Vec<String> = motion
        .iter()
        .zip([("x", "µm"), ("y", "µm"), ("z", "µm"), ("θx", "µrad"), ("θy", "µrad"), ("θz", "µrad")])
        .enumerate()
        .filter(|(k, (part, _))| part.abs() > 1e-3 * if *k < 3 { 1.0 } else { lever })
        .map(|(_, (part, (axis, unit)))| format!("{axis} {part:+.3} {unit}"))
        .collect();
    let how = if condition > 1e9 {
        "do not measure the motion".to_owned()
    } else {
        format!("measure one motion {condition:.0} times worse than another:")
    };
    finding(
        model,
        codes::GAUGES_BLIND,
        "gauge[0]",
        format!("the six gauges {how} {}", parts.join(", ")),
        "six gauges determine a pose if, for instance, three measure along one axis at the corners of a triangle, two along another axis side by side, and one along the third: move or turn one that should measure this motion"
            .to_owned(),
    )
}
