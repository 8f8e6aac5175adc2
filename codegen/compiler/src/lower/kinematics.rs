//! Joints, legs at rest, and the number of terms and steps that the kinematics needs over the declared workspace.

use specgen_runtime::{Legs, Series};

use super::linear::{self, Matrix, alike, cross, norm};
use crate::ir::{Kinematics, LEGS, Scalar};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{Geometry, Model};

/// Largest |Δl| / l₀ for which the counted number of Newton steps is proven to converge.
const LARGEST_RATIO: f64 = 0.25;
/// Largest number of corrections. More mean that the forward kinematics does not converge.
const MOST_CORRECTIONS: u32 = 40;
/// Relative difference of coordinates that are equal except for rounding.
const SAME_JOINT: f64 = 4e-15;
/// Most terms of a root. More take longer than a Newton step.
const MOST_TERMS: usize = 8;

/// B_i in the base frame and P_i in the platform frame, m.
#[must_use]
pub fn joint_positions(geometry: &Geometry) -> ([[f64; 3]; LEGS], [[f64; 3]; LEGS]) {
    (geometry.base_joints, geometry.platform_joints)
}

pub(super) fn lower(model: &Model, scalar: Scalar) -> Result<Kinematics, Vec<Diagnostic>> {
    let platform = model.geometry.platform_joints;
    let rest_leg = model.geometry.rest_legs();
    let rest_length = rest_leg.map(norm);
    let largest_angle = model.workspace.rotation.iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
    // |Δl| ≤ |t| + |θ| |P_i|: a chord is no longer than its arc.
    let joint_radius = platform.iter().fold(0.0, |a: f64, p| if norm(*p) > a { norm(*p) } else { a });
    let largest_displacement = norm(model.workspace.translation) + norm(model.workspace.rotation) * joint_radius;
    let shortest = rest_length.iter().fold(f64::INFINITY, |a: f64, b| if *b < a { *b } else { a });
    if largest_displacement > LARGEST_RATIO * shortest {
        return Err(vec![too_large(model, largest_displacement, shortest)]);
    }
    let jacobian = jacobian_at_rest(&rest_leg, &rest_length, &platform);
    let inverse = linear::inverse(&jacobian).ok_or_else(|| vec![degenerate(model)])?;
    let (sine, versine) = series_of(largest_angle, Scalar::F64);
    let (root, newton_steps) = root_of(largest_displacement / shortest, Scalar::F64);
    let legs = Legs {
        rest_leg,
        platform_joint: platform,
        rest_length,
        series: Series { sine: &sine, versine: &versine },
        root: &root,
        newton_steps: newton_steps as usize,
    };
    let corrections = corrections(&legs, &inverse, model.workspace.bounds(), scalar)
        .ok_or_else(|| vec![too_large(model, largest_displacement, shortest)])?;
    let (root, newton_steps) = root_of(largest_displacement / shortest, scalar);
    let three = |mut rows: [[f64; 3]; LEGS]| {
        alike(rows.as_flattened_mut(), SAME_JOINT);
        rows.map(|row| row.map(|x| scalar.round(x)))
    };
    let mut lengths = rest_length;
    alike(&mut lengths, SAME_JOINT);
    Ok(Kinematics {
        rest_leg: three(rest_leg),
        platform_joint: three(platform),
        rest_length: lengths.map(|l| scalar.round(l)),
        sine: series_of(largest_angle, scalar).0,
        versine: series_of(largest_angle, scalar).1,
        root,
        newton_steps,
        largest_displacement,
        inverse_jacobian: inverse.map(|row| row.map(|x| scalar.round(x))),
        corrections,
    })
}

/// Largest error that a fixed number of corrections may leave over the declared workspace: 10⁻¹³ m or rad, or a quarter of
/// the last bit of the coordinate at its bound.
pub(super) fn tolerance(bounds: [f64; 6], scalar: Scalar) -> [f64; 6] {
    bounds.map(|bound| {
        let last_bit = scalar.epsilon() / 4.0 * bound;
        if last_bit > 1e-13 { last_bit } else { 1e-13 }
    })
}

/// J = ∂l/∂h at rest: rows [s_i, P_i × s_i].
fn jacobian_at_rest(rest_leg: &[[f64; 3]; LEGS], rest_length: &[f64; LEGS], platform: &[[f64; 3]; LEGS]) -> Matrix {
    let mut jacobian = [[0.0; 6]; LEGS];
    for (((row, leg), length), joint) in jacobian.iter_mut().zip(rest_leg).zip(rest_length).zip(platform) {
        let [x, y, z] = leg.map(|part| part / length);
        let [a, b, c] = cross(*joint, [x, y, z]);
        *row = [x, y, z, a, b, c];
    }
    jacobian
}

/// J⁻¹ of the legs at rest in f64: pose coordinates (rows) per leg displacement (columns).
///
/// None if the geometry is singular.
#[must_use]
pub fn inverse_jacobian(geometry: &Geometry) -> Option<[[f64; 6]; LEGS]> {
    leg_jacobian(geometry).and_then(|jacobian| linear::inverse(&jacobian))
}

/// J = ∂l/∂h of the legs at rest, in f64; none if a leg has no length.
#[must_use]
pub fn leg_jacobian(geometry: &Geometry) -> Option<[[f64; 6]; LEGS]> {
    let rest_leg = geometry.rest_legs();
    let rest_length = rest_leg.map(norm);
    let whole = rest_length.iter().all(|length| *length > 0.0);
    whole.then(|| jacobian_at_rest(&rest_leg, &rest_length, &geometry.platform_joints))
}

/// Number of corrections of the forward kinematics, counted at 3⁶ poses on the faces of the workspace; none without convergence.
fn corrections(legs: &Legs<f64>, inverse: &Matrix, bounds: [f64; 6], scalar: Scalar) -> Option<u32> {
    let tolerance = tolerance(bounds, scalar);
    let good = |count: &u32| {
        linear::grid(bounds).all(|pose| {
            let found = legs.pose(inverse, *count as usize, &legs.displacements(&pose));
            found.iter().zip(&pose).zip(&tolerance).all(|((found, pose), most)| (found - pose).abs() <= *most)
        })
    };
    (1..=MOST_CORRECTIONS).find(good)
}

fn degenerate(model: &Model) -> Diagnostic {
    let key = "geometry.base_joints";
    Diagnostic::at(
        &model.spans,
        &[key],
        codes::DEGENERATE_GEOMETRY,
        "the six legs leave one motion of the platform unconstrained at rest",
        "move the joints of base and platform apart: pairs of legs must meet at different points",
    )
}

fn too_large(model: &Model, displacement: f64, length: f64) -> Diagnostic {
    let key = "workspace.translation";
    let (change, length) = (displacement * 1e3, length * 1e3);
    Diagnostic::at(
        &model.spans,
        &[key],
        codes::WORKSPACE_TOO_LARGE,
        format!(
            "the declared workspace may change the length of a leg by {change:.3} mm, more than a quarter of its {length:.3} mm"
        ),
        "the difference-form kinematics is for small motions: reduce workspace.translation and workspace.rotation",
    )
}

/// Coefficients of sin x / x after the leading 1 (−1/3!, 1/5!, …) and of (1 − cos x) / x² (1/2!, −1/4!, …), in x²: as many as
/// x ≤ `largest` needs for a remainder below a quarter ulp.
pub(super) fn series_of(largest: f64, scalar: Scalar) -> (Vec<f64>, Vec<f64>) {
    let mut versine = vec![0.5];
    versine.extend(series(largest, scalar, 0.5, 3));
    (series(largest, scalar, 1.0, 2), versine)
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

/// Coefficients of the root Δl of Δl² + 2 l₀ Δl = s over u = s/(2 l₀) after the leading 1, in τ = u/l₀, and the number of Newton steps
/// after them, each with a division, for a remainder below a quarter ulp.
///
/// With r = |Δl| / l₀, |τ| ≤ r + r²/2. A step turns a relative error ε into ε² r / (2 (1 − r)).
fn root_of(ratio: f64, scalar: Scalar) -> (Vec<f64>, u32) {
    let small = scalar.epsilon() / 4.0;
    let largest = ratio + 0.5 * ratio * ratio;
    let mut terms = Vec::new();
    let (mut left, mut power) = (0.5 * largest / (1.0 - 2.0 * largest), 1.0);
    let mut coefficient = 1.0;
    while left > small && terms.len() < MOST_TERMS {
        power *= largest;
        let k = f64::from(terms.len() as u32 + 1);
        coefficient *= (1.0 - 2.0 * k) / (k + 1.0);
        terms.push(scalar.round(coefficient));
        left = coefficient.abs() * power * 2.0 * largest / (1.0 - 2.0 * largest);
    }
    let mut steps = 0;
    while left > small && steps < 8 {
        left = left * left * ratio / (2.0 * (1.0 - ratio));
        steps += 1;
    }
    (terms, steps)
}
