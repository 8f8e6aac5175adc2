//! Constants of the inverse dynamics, and the order in which its six equilibrium equations are solved.
//!
//! Complete pivoting at rest gives one candidate order for each leg as the first one (moments are taken about that leg's joint).
//! The candidate whose smallest pivot over the declared workspace is largest is used.

use specgen_runtime::Platform;

use super::kinematics::joint_positions;
use crate::ir::{Dynamics, DynamicsLeg, LEGS, Scalar};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;
use specgen_numerics::{cross, dot, pivot_ratio};

/// Standard gravity of the project's reference data, m/s², along −z of {B}.
pub const GRAVITY: f64 = 9.81;
/// Smallest accepted ratio of pivots anywhere in the workspace. Elimination may lose this many digits:
/// three leave 1e-12 of the 1e-16 of `f64`, and 1e-4 of the 1e-7 of `f32`.
const SMALLEST_PIVOT_RATIO: f64 = 1e-3;
/// Interior poses checked in addition to rest and the 64 corners.
const INTERIOR_POSES: u32 = 128;

/// Relative rounding error of a sum that is zero.
const ROUNDING: f64 = 1e-14;

type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// The dynamics of a model at full precision. The emitted controller contains it rounded to its scalar.
///
/// # Errors
/// [`codes::ILL_CONDITIONED`] if the geometry is nearly singular somewhere in the declared workspace.
pub fn platform(model: &Model) -> Result<Platform<f64>, Vec<Diagnostic>> {
    constants(model).map(|constants| constants.platform())
}

pub(super) fn lower(model: &Model, scalar: Scalar) -> Result<Dynamics, Vec<Diagnostic>> {
    constants(model).map(|constants| constants.rounded(scalar))
}

fn constants(model: &Model) -> Result<Dynamics, Vec<Diagnostic>> {
    let reach = model.geometry.joint_radius();
    let poses = poses(model);
    let mut best: Option<Dynamics> = None;
    for first in 0..LEGS {
        let (order, rows) = elimination(model, first, reach);
        let mut candidate = assemble(model, order, rows);
        let beaten = best.as_ref().map_or(-1.0, |best| best.pivot_ratio);
        candidate.pivot_ratio = smallest_pivot_ratio(&candidate.platform(), &poses, reach, beaten);
        if candidate.pivot_ratio > beaten {
            best = Some(candidate);
        }
    }
    match best {
        Some(best) if best.pivot_ratio >= SMALLEST_PIVOT_RATIO => Ok(best),
        best => Err(vec![ill_conditioned(model, best.map_or(0.0, |best| best.pivot_ratio))]),
    }
}

/// The smallest ratio over `poses`. Stops early once it is not above `beaten`.
fn smallest_pivot_ratio(platform: &Platform<f64>, poses: &[[f64; 6]], reach: f64, beaten: f64) -> f64 {
    let mut smallest = f64::INFINITY;
    for pose in poses {
        let ratio = pivot_ratio(platform, pose, reach);
        if ratio < smallest {
            smallest = ratio;
        }
        if smallest <= beaten {
            break;
        }
    }
    smallest
}

/// All constants for an order of elimination.
fn assemble(model: &Model, order: [usize; LEGS], rows: [usize; LEGS]) -> Dynamics {
    let (base, joint) = joint_positions(&model.geometry);
    let pole = joint[order[0]];
    // A planar base is measured from its plane, so that its third components are zero.
    let level = base[0][2];
    let flat_base = base.iter().all(|b| b[2] == level);
    let base_height = if flat_base { level } else { 0.0 };
    let legs = order.map(|leg| {
        let (b, p) = (base[leg], joint[leg]);
        let rest = [p[0] - b[0], p[1] - b[1], model.geometry.height + p[2] - b[2]];
        let length = libm::sqrt(dot(rest, rest));
        DynamicsLeg {
            base: [-b[0], -b[1], base_height - b[2]],
            joint: p,
            arm: difference(p, pole),
            rest,
            length,
            inverse_length: 1.0 / length,
            half_inverse_square: 0.5 / (length * length),
        }
    });

    let mut places = [0; LEGS];
    for (place, leg) in order.into_iter().enumerate() {
        places[leg] = place;
    }
    let leg = &model.leg;
    let body = &model.platform;
    let [xx, yy, zz] = body.inertia;
    let [xy, xz, yz] = body.products;
    let inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let trace = xx + yy + zz;
    let mut mass = body.mass;
    let mut first_moment = body.center_of_mass.map(|c| body.mass * c);
    // ∫ x xᵀ dm = (tr I) / 2 − I about the mass centre; then the parallel axis theorem, and the point masses at the joints.
    let mut second: Matrix = inertia.map(|row| row.map(|entry| -entry));
    for (k, row) in second.iter_mut().enumerate() {
        row[k] += trace / 2.0;
    }
    add_point(&mut second, body.mass, body.center_of_mass);
    for p in joint {
        mass += leg.extensible_mass;
        for (moment, p) in first_moment.iter_mut().zip(p) {
            *moment += leg.extensible_mass * p;
        }
        add_point(&mut second, leg.extensible_mass, p);
    }
    let mut about_pole = second;
    for (row, moment) in about_pole.iter_mut().zip(first_moment) {
        for (entry, pole) in row.iter_mut().zip(pole) {
            *entry -= moment * pole;
        }
    }

    // Entries that are zero by symmetry are set to zero, so that the controller omits them.
    let reach = model.geometry.joint_radius();
    let clean = |value: f64, size: f64| if value.abs() <= ROUNDING * size { 0.0 } else { value };
    let first_moment = first_moment.map(|moment| clean(moment, mass * reach));
    let pole_moment = difference(first_moment, pole.map(|p| mass * p)).map(|moment| clean(moment, mass * reach));
    let about_pole = about_pole.map(|row| row.map(|entry| clean(entry, mass * reach * reach)));

    let extensible_moment = leg.extensible_mass * leg.extensible_center;
    Dynamics {
        legs,
        places,
        rows,
        flat_base,
        flat_platform: joint.iter().all(|p| p[2] == 0.0),
        base_depth: model.geometry.height - base_height,
        pole,
        mass,
        first_moment,
        pole_moment,
        second_moment: about_pole,
        extensible_moment,
        leg_inertia: leg.fixed_inertia
            + leg.extensible_inertia
            + leg.fixed_mass * leg.fixed_center * leg.fixed_center
            + extensible_moment * leg.extensible_center,
        leg_weight_moment: (extensible_moment - leg.fixed_mass * leg.fixed_center) * GRAVITY,
        gravity: GRAVITY,
        pivot_ratio: 0.0,
    }
}

/// The equilibrium equations at rest with moments about the joint of leg `pole` in units of `reach`: row, leg.
fn equations_at_rest(model: &Model, pole: usize, reach: f64) -> [[f64; LEGS]; 6] {
    let (base, joint) = joint_positions(&model.geometry);
    let mut m = [[0.0; LEGS]; 6];
    for leg in 0..LEGS {
        let (b, p) = (base[leg], joint[leg]);
        let r = [p[0] - b[0], p[1] - b[1], model.geometry.height + p[2] - b[2]];
        let length = libm::sqrt(dot(r, r));
        let s = r.map(|r| r / length);
        let a = difference(p, joint[pole]).map(|a| a / reach);
        let moment = cross(a, s);
        for k in 0..3 {
            m[k][leg] = s[k];
            m[k + 3][leg] = moment[k];
        }
    }
    m
}

/// Legs and equations in the order of complete pivoting at rest, leg `first` before all others.
fn elimination(model: &Model, first: usize, reach: f64) -> ([usize; LEGS], [usize; LEGS]) {
    let mut m = equations_at_rest(model, first, reach);
    let mut order: [usize; LEGS] = std::array::from_fn(|k| k);
    let mut rows: [usize; 6] = std::array::from_fn(|k| k);
    order.swap(0, first);
    for step in 0..LEGS {
        let (mut row, mut column, mut largest) = (step, step, -1.0);
        let columns = if step == 0 { 0..1 } else { step..LEGS };
        for j in columns {
            for i in step..6 {
                let size = m[rows[i]][order[j]].abs();
                // Among entries equal by symmetry, the first one is used despite rounding.
                if size > largest * (1.0 + 1e-9) {
                    (row, column, largest) = (i, j, size);
                }
            }
        }
        rows.swap(step, row);
        order.swap(step, column);
        let pivot = m[rows[step]][order[step]];
        if pivot == 0.0 {
            break;
        }
        for i in step + 1..6 {
            let factor = m[rows[i]][order[step]] / pivot;
            for j in step..LEGS {
                m[rows[i]][order[j]] -= factor * m[rows[step]][order[j]];
            }
        }
    }
    (order, rows)
}

/// Rest, the corners of the declared workspace, and poses spread through it (Halton).
fn poses(model: &Model) -> Vec<[f64; 6]> {
    let bounds = model.workspace.bounds();
    let mut poses = vec![[0.0; 6]];
    for corner in 0..64_u32 {
        poses.push(std::array::from_fn(|k| if corner >> k & 1 == 1 { bounds[k] } else { -bounds[k] }));
    }
    for index in 1..=INTERIOR_POSES {
        let bases = [2, 3, 5, 7, 11, 13];
        poses.push(std::array::from_fn(|k| bounds[k] * (2.0 * radical_inverse(index, bases[k]) - 1.0)));
    }
    poses
}

/// The digits of `index`, mirrored at the radix point.
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut unit) = (0.0, 1.0);
    while index > 0 {
        unit /= f64::from(base);
        value += f64::from(index % base) * unit;
        index /= base;
    }
    value
}

fn ill_conditioned(model: &Model, ratio: f64) -> Diagnostic {
    let reach = model.geometry.joint_radius();
    let equations = equations_at_rest(model, 0, reach);
    let singular = nalgebra::Matrix6::from_fn(|i, j| equations[i][j]).singular_values();
    let key = if model.spans.contains_key("geometry.height") { "geometry.height" } else { "geometry.base_joints" };
    Diagnostic::at(
        &model.spans,
        &[key],
        codes::ILL_CONDITIONED,
        format!(
            "somewhere in the declared workspace the six legs hardly hold the platform: the smallest pivot of the equations for the leg \
             forces is {ratio:.2e} of the largest, expected {SMALLEST_PIVOT_RATIO:.0e} or more (condition number at rest {:.3e})",
            singular.max() / singular.min()
        ),
        "spread the leg directions: make the height comparable to the radii, bring the joints of base and platform closer in \
               different pairs (small base_angle and platform_angle), or reduce workspace.rotation",
    )
}

fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn add_point(second: &mut Matrix, mass: f64, p: Vector) {
    for (row, a) in second.iter_mut().zip(p) {
        for (entry, b) in row.iter_mut().zip(p) {
            *entry += mass * a * b;
        }
    }
}
