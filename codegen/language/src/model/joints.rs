//! From joint circles (1), (2) to joints. The controller's bytes depend on these numbers, so only `libm` is used.

use core::f64::consts::PI;

/// Joint angles λ_i of the base (1), rad.
fn base_angles(alpha: f64) -> [f64; 6] {
    [
        PI / 3.0 - alpha / 2.0,
        PI / 3.0 + alpha / 2.0,
        PI - alpha / 2.0,
        PI + alpha / 2.0,
        5.0 * PI / 3.0 - alpha / 2.0,
        5.0 * PI / 3.0 + alpha / 2.0,
    ]
}

/// Joint angles Λ_i of the platform (2), rad.
fn platform_angles(alpha: f64) -> [f64; 6] {
    [
        alpha / 2.0,
        2.0 * PI / 3.0 - alpha / 2.0,
        2.0 * PI / 3.0 + alpha / 2.0,
        4.0 * PI / 3.0 - alpha / 2.0,
        4.0 * PI / 3.0 + alpha / 2.0,
        -alpha / 2.0,
    ]
}

/// Joints on a circle in the plane z = 0 (AI.3), (AI.4), m, from its radius (m) and their directions (rad).
pub(crate) fn on_circle(radius: f64, angles: [f64; 6]) -> [[f64; 3]; 6] {
    angles.map(|angle| [radius * libm::cos(angle), radius * libm::sin(angle), 0.0])
}

/// B_i in {B}, m, from r_B (m) and α_B (rad).
pub(crate) fn base_joints(radius: f64, angle: f64) -> [[f64; 3]; 6] {
    on_circle(radius, base_angles(angle))
}

/// P_i in {P}, m, from r_P (m) and α_P (rad).
pub(crate) fn platform_joints(radius: f64, angle: f64) -> [[f64; 3]; 6] {
    on_circle(radius, platform_angles(angle))
}

/// Joints given in another frame, in {B} or {P}: `frame` is the pose of {B} or {P} in that frame, m and rad, with
/// R = Rz Ry Rx.
pub(crate) fn from_frame(frame: &[f64; 6], joints: [[f64; 3]; 6]) -> [[f64; 3]; 6] {
    let [x, y, z, rx, ry, rz] = *frame;
    // The plane of a rotation: its first axis turned towards its second one.
    let back = |point: [f64; 3], first: usize, second: usize, angle: f64| {
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let mut turned = point;
        turned[first] = c * point[first] + s * point[second];
        turned[second] = c * point[second] - s * point[first];
        turned
    };
    joints.map(|[px, py, pz]| {
        let point = back([px - x, py - y, pz - z], 0, 1, rz);
        back(back(point, 2, 0, ry), 1, 2, rx)
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    #[test]
    fn a_frame_is_undone() {
        let frame = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6];
        let own = base_joints(0.15, 0.04);
        // nalgebra's Euler angles are R = Rz Ry Rx.
        let rotation = Rotation3::from_euler_angles(frame[3], frame[4], frame[5]);
        let given = own.map(|joint| (rotation * Vector3::from(joint) + Vector3::new(0.1, -0.2, 0.3)).into());
        for (found, expected) in from_frame(&frame, given).as_flattened().iter().zip(own.as_flattened()) {
            assert!((found - expected).abs() < 1e-15, "{found} and {expected}");
        }
    }
}
