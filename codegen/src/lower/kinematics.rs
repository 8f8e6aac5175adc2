//! Joints, rest legs, and how many terms and steps the kinematics needs over the declared workspace.

use crate::diagnostic::{Diagnostic, Place, Severity, codes};
use crate::ir::{Kinematics, LEGS, Scalar};
use crate::model::{Geometry, Model};

/// Largest |Δl| / l₀ for which the Newton steps are known to converge as counted.
const LARGEST_RATIO: f64 = 0.25;

/// B_i in the base frame and P_i in the platform frame, m.
#[must_use]
pub fn joint_positions(geometry: &Geometry) -> ([[f64; 3]; LEGS], [[f64; 3]; LEGS]) {
    (geometry.base_joints, geometry.platform_joints)
}

fn norm(v: [f64; 3]) -> f64 {
    libm::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
}

pub(super) fn lower(model: &Model, scalar: Scalar) -> Result<Kinematics, Vec<Diagnostic>> {
    let (base, platform) = joint_positions(&model.geometry);
    let mut rest_leg = [[0.0; 3]; LEGS];
    for ((rest, b), p) in rest_leg.iter_mut().zip(&base).zip(&platform) {
        *rest = [p[0] - b[0], p[1] - b[1], model.geometry.height + p[2] - b[2]];
    }
    let rest_length = rest_leg.map(norm);
    let largest_angle = model.workspace.rotation.iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
    // |Δl| ≤ |t| + |θ| |P_i|: a chord is no longer than its arc.
    let joint_radius = platform.iter().fold(0.0, |a: f64, p| if norm(*p) > a { norm(*p) } else { a });
    let largest_displacement = norm(model.workspace.translation) + norm(model.workspace.rotation) * joint_radius;
    let shortest = rest_length.iter().fold(f64::INFINITY, |a: f64, b| if *b < a { *b } else { a });
    if largest_displacement > LARGEST_RATIO * shortest {
        return Err(vec![too_large(model, largest_displacement, shortest)]);
    }
    let round3 = |v: [f64; 3]| v.map(|x| scalar.round(x));
    Ok(Kinematics {
        rest_leg: rest_leg.map(round3),
        platform_joint: platform.map(round3),
        rest_length: rest_length.map(|l| scalar.round(l)),
        sine: sine_series(largest_angle, scalar),
        versine: versine_series(largest_angle, scalar),
        newton_steps: newton_steps(largest_displacement / shortest, scalar),
        largest_displacement,
    })
}

fn too_large(model: &Model, displacement: f64, length: f64) -> Diagnostic {
    let key = "workspace.translation";
    Diagnostic {
        severity: Severity::Error,
        code: codes::WORKSPACE_TOO_LARGE,
        key: key.to_owned(),
        place: model.spans.get(key).cloned().map_or(Place::Whole, Place::Spec),
        message: format!(
            "the declared workspace may change a leg by {:.3} mm, more than a quarter of its length of {:.3} mm",
            displacement * 1e3,
            length * 1e3
        ),
        help:
            "the difference-form kinematics is for small motions: reduce workspace.translation and workspace.rotation"
                .to_owned(),
    }
}

/// −1/3!, 1/5!, …: as many terms of sin x / x as x ≤ `largest` needs for a remainder below a quarter ulp.
fn sine_series(largest: f64, scalar: Scalar) -> Vec<f64> {
    series(largest, scalar, 1.0, 2)
}

/// 1/2!, −1/4!, …: likewise for (1 − cos x) / x².
fn versine_series(largest: f64, scalar: Scalar) -> Vec<f64> {
    let mut terms = vec![0.5];
    terms.extend(series(largest, scalar, 0.5, 3));
    terms
}

/// Coefficients after `leading`, each the last one times −1/(k (k+1)) with k growing by two; alternating and falling, so
/// the first one left out bounds the remainder.
fn series(largest: f64, scalar: Scalar, leading: f64, first: u32) -> Vec<f64> {
    let square = largest * largest;
    let mut terms = Vec::new();
    let (mut coefficient, mut power, mut k) = (leading, 1.0, first);
    loop {
        coefficient = -coefficient / f64::from(k * (k + 1));
        power *= square;
        if coefficient.abs() * power < leading * scalar.epsilon() / 4.0 {
            return terms;
        }
        terms.push(scalar.round(coefficient));
        k += 2;
    }
}

/// Steps of Δl ← (s + Δl²) / (2 (l₀ + Δl)) from Δl = s / (2 l₀).
///
/// With r = |Δl| / l₀ the first guess is off by r/2 of Δl, and a step turns a relative error ε into ε² r / (2 (1 − r)).
fn newton_steps(ratio: f64, scalar: Scalar) -> u32 {
    let mut error = ratio / 2.0;
    let mut steps = 0;
    while error > scalar.epsilon() / 4.0 && steps < 8 {
        error = error * error * ratio / (2.0 * (1.0 - ratio));
        steps += 1;
    }
    steps
}
