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

/// Joints on a circle in the plane z = 0 (AI.3), (AI.4), m.
fn joints(radius: f64, angles: [f64; 6]) -> [[f64; 3]; 6] {
    angles.map(|angle| [radius * libm::cos(angle), radius * libm::sin(angle), 0.0])
}

/// B_i in {B}, m, from r_B (m) and α_B (rad).
pub(crate) fn base_joints(radius: f64, angle: f64) -> [[f64; 3]; 6] {
    joints(radius, base_angles(angle))
}

/// P_i in {P}, m, from r_P (m) and α_P (rad).
pub(crate) fn platform_joints(radius: f64, angle: f64) -> [[f64; 3]; 6] {
    joints(radius, platform_angles(angle))
}
