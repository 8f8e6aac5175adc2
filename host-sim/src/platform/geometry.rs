//! Positions of joints and lengths of legs: exact, at any pose.
//!
//! A pose h = [x, y, z, θx, θy, θz] counts from rest: P_C is at [x, y, height + z] in the base frame {B}, and
//! R = Rz(θz) Ry(θy) Rx(θx) takes the platform frame {P} to {B}.

use core::f64::consts::PI;

use super::linear::{Matrix3, Matrix6, Six, Three, apply, cross, dot};

/// Joints of a hexapod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// B_i in {B}, m.
    pub base_joints: [Three; 6],
    /// P_i in {P}, m.
    pub platform_joints: [Three; 6],
    /// z of P_C at rest in {B}, m.
    pub height: f64,
}

/// sin and cos. Piezo platforms rotate by less than a milliradian, where a short series is exact to about the last bit.
#[inline]
fn sincos(angle: f64) -> (f64, f64) {
    if angle.abs() > 1e-2 {
        return libm::sincos(angle);
    }
    let square = angle * angle;
    let sin = angle - angle * square * (1.0 / 6.0 - square * (1.0 / 120.0 - square / 5040.0));
    let cos = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square / 720.0));
    (sin, cos)
}

/// R and T(θ) of the angles [θx, θy, θz], rad.
#[inline]
pub(super) fn attitude(angles: Three) -> (Matrix3, Matrix3) {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(sincos);
    (
        [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ],
        [[cz * cy, -sz, 0.0], [sz * cy, cz, 0.0], [-sy, 0.0, 1.0]],
    )
}

/// R of the angles [θx, θy, θz], rad.
pub fn rotation(angles: Three) -> Matrix3 {
    attitude(angles).0
}

/// T(θ) of ω = T(θ) θ̇, ω in {B}: the axes about which the three angles turn, as columns.
pub fn rate_matrix(angles: Three) -> Matrix3 {
    attitude(angles).1
}

/// ∂(P_C + R a)/∂h of a point fixed to the platform, with `arm` = R a in {B}, and T(θ).
pub fn point_jacobian(arm: Three, rates: &Matrix3) -> [Six; 3] {
    let mut out = [[0.0; 6]; 3];
    for k in 0..3 {
        out[k][k] = 1.0;
        let turned = cross([rates[0][k], rates[1][k], rates[2][k]], arm);
        for row in 0..3 {
            out[row][3 + k] = turned[row];
        }
    }
    out
}

/// The angles of a pose.
pub fn angles(pose: &Six) -> Three {
    [pose[3], pose[4], pose[5]]
}

impl Geometry {
    /// The symmetric platform of (1) and (2): joints on two circles, in pairs `base_angle` and `platform_angle` (rad) apart.
    pub fn hexagonal(
        [base_radius, platform_radius]: [f64; 2],
        [base_angle, platform_angle]: [f64; 2],
        height: f64,
    ) -> Self {
        let base = [(1.0, -1.0), (1.0, 1.0), (3.0, -1.0), (3.0, 1.0), (5.0, -1.0), (5.0, 1.0)];
        let platform = [(0.0, 1.0), (2.0, -1.0), (2.0, 1.0), (4.0, -1.0), (4.0, 1.0), (0.0, -1.0)];
        let joints = |radius: f64, spread: f64, places: [(f64, f64); 6]| {
            places.map(|(thirds, side)| {
                let (sin, cos) = libm::sincos(thirds * PI / 3.0 + side * spread / 2.0);
                [radius * cos, radius * sin, 0.0]
            })
        };
        Self {
            base_joints: joints(base_radius, base_angle, base),
            platform_joints: joints(platform_radius, platform_angle, platform),
            height,
        }
    }

    /// From B_i to P_i at rest, in {B}, m.
    pub fn rest_leg(&self, leg: usize) -> Three {
        let (b, p) = (self.base_joints[leg], self.platform_joints[leg]);
        [p[0] - b[0], p[1] - b[1], self.height + p[2] - b[2]]
    }

    /// Leg lengths at rest, m.
    pub fn rest_lengths(&self) -> Six {
        std::array::from_fn(|leg| {
            let r = self.rest_leg(leg);
            libm::sqrt(dot(&r, &r))
        })
    }

    /// Leg vectors r_i, from B_i to P_i in {B}, and the arms R P_i, m.
    pub fn legs(&self, pose: &Six) -> [(Three, Three); 6] {
        let r = rotation(angles(pose));
        std::array::from_fn(|leg| {
            let arm = apply(&r, &self.platform_joints[leg]);
            let b = self.base_joints[leg];
            ([pose[0] + arm[0] - b[0], pose[1] + arm[1] - b[1], self.height + pose[2] + arm[2] - b[2]], arm)
        })
    }

    /// Δl: extension of each leg from rest, m, exact apart from rounding at 1e-17 m.
    pub fn extensions(&self, pose: &Six) -> Six {
        self.extensions_and_jacobian(pose).0
    }

    /// J = ∂l/∂h, m/m and m/rad.
    pub fn jacobian(&self, pose: &Six) -> Matrix6 {
        self.extensions_and_jacobian(pose).1
    }

    /// Δl and J together.
    pub fn extensions_and_jacobian(&self, pose: &Six) -> (Six, Matrix6) {
        self.extensions_and_jacobian_from(&self.rest_lengths(), pose)
    }

    /// The same from known leg lengths at rest.
    pub(crate) fn extensions_and_jacobian_from(&self, rest_lengths: &Six, pose: &Six) -> (Six, Matrix6) {
        let (turn, rates) = attitude(angles(pose));
        let mut extensions = [0.0; 6];
        let mut jacobian = [[0.0; 6]; 6];
        for leg in 0..6 {
            let rest = self.rest_leg(leg);
            let joint = self.platform_joints[leg];
            let arm = apply(&turn, &joint);
            let shift = [pose[0] + (arm[0] - joint[0]), pose[1] + (arm[1] - joint[1]), pose[2] + (arm[2] - joint[2])];
            // l² − l0², without the large squares.
            let growth = 2.0 * dot(&rest, &shift) + dot(&shift, &shift);
            let length = libm::sqrt(dot(&rest, &rest) + growth);
            extensions[leg] = growth / (length + rest_lengths[leg]);
            let inverse = 1.0 / length;
            let direction = [0, 1, 2].map(|k| (rest[k] + shift[k]) * inverse);
            let moment = cross(arm, direction);
            for k in 0..3 {
                jacobian[leg][k] = direction[k];
                jacobian[leg][3 + k] = moment[0] * rates[0][k] + moment[1] * rates[1][k] + moment[2] * rates[2][k];
            }
        }
        (extensions, jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: Six = [3e-3, -5e-3, 4e-3, 0.03, -0.05, 0.04];

    fn geometry() -> Geometry {
        Geometry::hexagonal([0.15, 0.1], [0.012 * PI; 2], 0.18)
    }

    #[test]
    fn the_series_is_sine_and_cosine() {
        for n in -1000..=1000 {
            let angle = 1e-5 * f64::from(n);
            let (sin, cos) = sincos(angle);
            assert!((sin - libm::sin(angle)).abs() <= 2e-18 && (cos - libm::cos(angle)).abs() <= 2e-16, "{angle}");
        }
    }

    #[test]
    fn extensions_are_differences_of_lengths() {
        let geometry = geometry();
        let rest = geometry.rest_lengths();
        let found = geometry.extensions(&POSE);
        for (leg, (r, _)) in geometry.legs(&POSE).iter().enumerate() {
            assert!((found[leg] - (libm::sqrt(dot(r, r)) - rest[leg])).abs() < 2e-16);
        }
        assert_eq!(geometry.extensions(&[0.0; 6]), [0.0; 6]);
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_extensions() {
        let geometry = geometry();
        let jacobian = geometry.jacobian(&POSE);
        for k in 0..6 {
            let (mut above, mut below) = (POSE, POSE);
            above[k] += 1e-5;
            below[k] -= 1e-5;
            let (above, below) = (geometry.extensions(&above), geometry.extensions(&below));
            for leg in 0..6 {
                let slope = (above[leg] - below[leg]) / 2e-5;
                assert!((slope - jacobian[leg][k]).abs() < 1e-9, "{leg} {k}");
            }
        }
    }

    #[test]
    fn the_rate_matrix_turns_angle_rates_into_angular_velocity() {
        // Ṙ = [ω]× R by central difference, one angle at a time.
        let at = angles(&POSE);
        let (turn, rates) = (rotation(at), rate_matrix(at));
        for k in 0..3 {
            let (mut above, mut below) = (at, at);
            above[k] += 1e-5;
            below[k] -= 1e-5;
            let (above, below) = (rotation(above), rotation(below));
            let axis = [rates[0][k], rates[1][k], rates[2][k]];
            for column in 0..3 {
                let expected = cross(axis, [turn[0][column], turn[1][column], turn[2][column]]);
                for row in 0..3 {
                    let slope = (above[row][column] - below[row][column]) / 2e-5;
                    assert!((slope - expected[row]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn home_row_of_the_reference_vectors() {
        // `reference/dynamics-vectors.json`, structured/000, first row of J and the leg length.
        let expected = [
            0.101_928_635_980_122_67,
            -0.572_240_831_072_846_4,
            0.813_726_602_994_082_8,
            0.001_533_747_682_135_785_4,
            -0.081_358_204_640_038_86,
            -0.057_406_036_960_214_755,
        ];
        let row = geometry().jacobian(&[0.0; 6])[0];
        for k in 0..6 {
            assert!((row[k] - expected[k]).abs() < 1e-15, "{row:?}");
        }
        assert!((geometry().rest_lengths()[0] - 0.221_204_516_772_212_37).abs() < 1e-16);
    }
}
