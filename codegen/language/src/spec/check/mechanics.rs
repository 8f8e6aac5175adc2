//! Masses, inertias and geometry: whether the platform is physically possible, and whether its legs hold it.

use nalgebra::{Matrix3, Matrix6, RowVector6, Vector3};

use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model::Geometry;
use crate::spec::findings::Findings;
use crate::spec::text::number;

/// Legs at rest: lengths in m, and the rows of dl/dh per m and rad.
struct Legs {
    lengths: [f64; 6],
    jacobian: Matrix6<f64>,
}

/// (1), (2) and the derivative of (AI.1) at the rest pose P = (0, 0, height), R = I:
/// dl_i/dh = [s_i, P_i × s_i], with s_i from B_i to P_i.
fn legs_at_rest(geometry: &Geometry) -> Legs {
    let mut legs = Legs { lengths: [0.0; 6], jacobian: Matrix6::zeros() };
    for (i, (base, joint)) in geometry.base_joints.iter().zip(&geometry.platform_joints).enumerate() {
        let joint = Vector3::from(*joint);
        let leg = Vector3::new(0.0, 0.0, geometry.height) + joint - Vector3::from(*base);
        let direction = leg.normalize();
        let turn = joint.cross(&direction);
        legs.lengths[i] = leg.norm();
        legs.jacobian.set_row(i, &RowVector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z));
    }
    legs
}

/// A shorter leg at rest is a mistake, m.
const SHORTEST_LEG: f64 = 1e-3;

/// Usual radii of gyration of a platform, in radii of its joint circle.
const SOUND: std::ops::RangeInclusive<f64> = 0.1..=3.0;

fn shortest_leg(f: &Fields) -> Option<f64> {
    let legs = legs_at_rest(&Geometry::read(f, "geometry")?);
    if legs.lengths.iter().any(|length| *length < SHORTEST_LEG) {
        return None;
    }
    Some(legs.lengths.into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a }))
}

pub(super) fn mass_centers_inside_leg(f: &Fields, findings: &mut Findings) -> Option<()> {
    let length = shortest_leg(f)?;
    for (path, joint) in [("leg.fixed_center", "base"), ("leg.extensible_center", "platform")] {
        let Some(center) = f.number(path) else {
            continue;
        };
        if center >= length {
            let [distance, long] = [center * 1e3, length * 1e3].map(number);
            findings.add(
                codes::CENTER_OUTSIDE_LEG,
                path,
                f.span(path),
                format!("`{path}` is {distance} mm from the {joint} joint, but a leg is only {long} mm long at rest"),
                format!("give less than {} mm, or fix [geometry]", number(length * 1e3)),
            );
        }
    }
    Some(())
}

pub(super) fn leg_gyration(f: &Fields, findings: &mut Findings) -> Option<()> {
    let length = shortest_leg(f)?;
    for part in ["fixed", "extensible"] {
        let path = format!("leg.{part}_inertia");
        let (Some(inertia), Some(mass)) = (f.number(&path), f.number(&format!("leg.{part}_mass"))) else {
            continue;
        };
        let radius = (inertia / mass).sqrt();
        // A rod as long as the leg has 0.29 of its length.
        if radius > length || radius < length * 1e-3 {
            let [gyration, kilograms, moment, long] = [radius * 1e3, mass, inertia, length * 1e3].map(number);
            findings.add(
                codes::GYRATION,
                &path,
                f.span(&path),
                format!(
                    "the {part} part of a leg has a radius of gyration of {gyration} mm (from {kilograms} kg and {moment} kg m^2), but a leg is {long} mm long"
                ),
                format!("check the units of `{path}` and `leg.{part}_mass`: kg or g, mm^2 or m^2"),
            );
        }
    }
    Some(())
}

pub(super) fn platform_inertia(f: &Fields, findings: &mut Findings) -> Option<()> {
    let [xx, yy, zz] = f.list::<3>("platform.inertia")?;
    let [xy, xz, yz] = f.list::<3>("platform.products")?;
    let mut principal: [f64; 3] = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).symmetric_eigenvalues().into();
    principal.sort_by(f64::total_cmp);
    let [small, middle, large] = principal;
    // A rounded last digit in the data of a flat plate must not matter.
    let unphysical = if small <= 0.0 {
        "is not positive definite"
    } else if large > (small + middle) * (1.0 + 1e-6) {
        "breaks the triangle inequality: the largest exceeds the sum of the others"
    } else {
        return Some(());
    };
    let list = principal.map(|moment| number(moment * 1e9)).join(", ");
    findings.add(
        codes::INERTIA_UNPHYSICAL,
        "platform.inertia",
        f.span("platform.inertia"),
        format!("no body has this inertia: with principal moments {list} g mm^2 it {unphysical}"),
        "check the three moments and `platform.products` against the CAD data, units and signs included".to_owned(),
    );
    Some(())
}

pub(super) fn platform_gyration(f: &Fields, findings: &mut Findings) -> Option<()> {
    let mass = f.number("platform.mass")?;
    let moments = f.list::<3>("platform.inertia")?;
    let size = Geometry::read(f, "geometry")?.joint_radius();
    let radii = moments.map(|moment| (moment / mass).sqrt());
    let largest = radii.into_iter().fold(0.0, |a, b| if b > a { b } else { a });
    let ratio = largest / size;
    if SOUND.contains(&ratio) {
        return Some(());
    }
    let [gyration, joints] = [largest, size].map(number);
    let message = format!(
        "mass and inertia give a radius of gyration of {gyration} m, but the platform's joint circle has a radius of {joints} m"
    );
    let help = "check the units of `platform.mass` (kg or g) and `platform.inertia` (mm^2 or m^2)".to_owned();
    let (path, span) = ("platform.mass", f.span("platform.mass"));
    if (0.02..=10.0).contains(&ratio) {
        findings.add(codes::GYRATION_ODD, path, span, message, help);
    } else {
        findings.add(codes::GYRATION, path, span, message, help);
    }
    Some(())
}

/// A leg without length has no direction.
pub(super) fn legs_have_length(f: &Fields, findings: &mut Findings) -> Option<()> {
    let lengths = legs_at_rest(&Geometry::read(f, "geometry")?).lengths;
    let leg = lengths.iter().position(|length| *length < SHORTEST_LEG)?;
    let path = if f.given("geometry.base_joints") { "geometry.platform_joints" } else { "geometry.height" };
    findings.add(
        codes::DEGENERATE_GEOMETRY,
        path,
        f.item_span(path, leg),
        format!("the joints of leg {leg} (from 0) are only {} mm apart at rest", number(lengths[leg] * 1e3)),
        "base joints are in {B}, platform joints in {P}, which is `height` above {B}: check that neither is given in the other frame".to_owned(),
    );
    Some(())
}

pub(super) fn geometry_holds(f: &Fields, findings: &mut Findings) -> Option<()> {
    let geometry = Geometry::read(f, "geometry")?;
    let legs = legs_at_rest(&geometry);
    if legs.lengths.iter().any(|length| *length < SHORTEST_LEG) {
        return None;
    }
    let mut jacobian = legs.jacobian;
    // Rotations as lengths at the joint circle, so that the condition number has no unit.
    for column in 3..6 {
        jacobian.column_mut(column).unscale_mut(geometry.joint_radius());
    }
    let singular = jacobian.singular_values();
    let condition = singular.max() / singular.min();
    if condition.is_finite() && condition < 1e4 {
        return Some(());
    }
    let (path, help) = if f.given("geometry.platform_joints") {
        (
            "geometry.platform_joints",
            "check that `geometry.base_joints` and `geometry.platform_joints` list the legs in the same order, both counter-clockwise from above, and the signs of y",
        )
    } else {
        (
            "geometry.height",
            "make the height comparable to the radii and the joint pairs close (small base_angle and platform_angle)",
        )
    };
    findings.add(
        codes::DEGENERATE_GEOMETRY,
        path,
        f.span(path),
        format!(
            "the six legs hardly hold the platform: the condition number of their Jacobian at rest is {}",
            if condition.is_finite() { number(condition) } else { "infinite".to_owned() }
        ),
        help.to_owned(),
    );
    Some(())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_3;

    use super::*;
    use crate::model::joints;

    const ANGLE: f64 = 0.0377;

    fn reference() -> Geometry {
        Geometry {
            base_joints: joints::base_joints(0.15, ANGLE),
            platform_joints: joints::platform_joints(0.1, ANGLE),
            height: 0.18,
            joint_file: None,
        }
    }

    fn leg_lengths(g: &Geometry, pose: [f64; 6]) -> [f64; 6] {
        // Angles of (1) and (2), written out.
        let third = 2.0 * FRAC_PI_3;
        let (b, p) = (ANGLE / 2.0, ANGLE / 2.0);
        let base = [
            FRAC_PI_3 - b,
            FRAC_PI_3 + b,
            3.0 * FRAC_PI_3 - b,
            3.0 * FRAC_PI_3 + b,
            5.0 * FRAC_PI_3 - b,
            5.0 * FRAC_PI_3 + b,
        ];
        let platform = [p, third - p, third + p, 2.0 * third - p, 2.0 * third + p, -p];
        let turn = nalgebra::Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
        std::array::from_fn(|i| {
            let joint = Vector3::new(libm::cos(platform[i]), libm::sin(platform[i]), 0.0) * 0.1;
            let anchor = Vector3::new(libm::cos(base[i]), libm::sin(base[i]), 0.0) * 0.15;
            (Vector3::new(pose[0], pose[1], g.height + pose[2]) + turn * joint - anchor).norm()
        })
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_leg_lengths() {
        let geometry = reference();
        let legs = legs_at_rest(&geometry);
        for axis in 0..6 {
            let step = 1e-6;
            let mut pose = [0.0; 6];
            pose[axis] = step;
            let ahead = leg_lengths(&geometry, pose);
            pose[axis] = -step;
            let behind = leg_lengths(&geometry, pose);
            for leg in 0..6 {
                let difference = (ahead[leg] - behind[leg]) / (2.0 * step);
                assert!((difference - legs.jacobian[(leg, axis)]).abs() < 1e-8, "leg {leg}, axis {axis}");
            }
        }
        assert!((legs.lengths[0] - leg_lengths(&geometry, [0.0; 6])[0]).abs() < 1e-15);
    }
}
