//! Mass matrix and weight of platform and legs, from the motion of every body: M(h) = Σ Jᵀ m J + Jωᵀ I Jω.
//!
//! A leg consists of two bodies on one line: the fixed part rotates about the base joint, the extensible part slides
//! along it. Legs do not spin about their own line (`docs/errata.md`, consistent form of Appendix I).

use super::geometry::{Geometry, angles, point_jacobian, rate_matrix, rotation};
use super::linear::{Matrix3, Matrix6, Six, Three, add_congruent, apply, dot, product, transposed};

/// Masses of a hexapod, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Masses {
    /// Platform, kg.
    pub platform: f64,
    /// Inertia tensor of the platform about its centre of mass in {P}, kg m².
    pub platform_inertia: Matrix3,
    /// Its centre of mass in {P}, m.
    pub center: Three,
    /// Fixed part of a leg, kg.
    pub fixed: f64,
    /// Extensible part of a leg, kg.
    pub extensible: f64,
    /// Transverse inertia of the fixed part about its centre of mass, kg m².
    pub fixed_inertia: f64,
    /// Of the extensible part.
    pub extensible_inertia: f64,
    /// l_s: centre of mass of the fixed part from the base joint, m.
    pub fixed_center: f64,
    /// l_e: centre of mass of the extensible part from the platform joint, m.
    pub extensible_center: f64,
    /// Weight per kilogram, m/s², towards −z.
    pub gravity: f64,
}

/// Bodies of a leg at a pose: ∂/∂h of both centres of mass and of the leg's angle.
struct LegBodies {
    fixed: [Six; 3],
    extensible: [Six; 3],
    turn: [Six; 3],
}

impl LegBodies {
    fn at(masses: &Masses, leg_vector: Three, arm: Three, rates: &Matrix3) -> Self {
        let length = libm::sqrt(dot(&leg_vector, &leg_vector));
        let s = leg_vector.map(|x| x / length);
        let joint = point_jacobian(arm, rates);
        // Transverse part of the joint's motion.
        let along: Six = std::array::from_fn(|k| s[0] * joint[0][k] + s[1] * joint[1][k] + s[2] * joint[2][k]);
        let across: [Six; 3] = std::array::from_fn(|row| std::array::from_fn(|k| joint[row][k] - s[row] * along[k]));
        let fixed_share = masses.fixed_center / length;
        let extensible_share = (length - masses.extensible_center) / length;
        Self {
            fixed: across.map(|row| row.map(|x| fixed_share * x)),
            extensible: std::array::from_fn(|row| {
                std::array::from_fn(|k| s[row] * along[k] + extensible_share * across[row][k])
            }),
            // ω = s × ṙ / l.
            turn: std::array::from_fn(|row| {
                let (a, b) = ((row + 1) % 3, (row + 2) % 3);
                std::array::from_fn(|k| (s[a] * joint[b][k] - s[b] * joint[a][k]) / length)
            }),
        }
    }
}

impl Masses {
    /// M(h), kg, kg m, kg m²: T = ½ ḣᵀ M ḣ.
    pub fn mass_matrix(&self, geometry: &Geometry, pose: &Six) -> Matrix6 {
        let turn = rotation(angles(pose));
        let rates = rate_matrix(angles(pose));
        let mut mass = [[0.0; 6]; 6];
        let center = point_jacobian(apply(&turn, &self.center), &rates);
        add_congruent(&mut mass, &center, &[self.platform; 3]);
        // ½ ωᵀ R I Rᵀ ω with ω = T θ̇.
        let body_rates = product(&transposed(&turn), &rates);
        let inertia = product(&transposed(&body_rates), &product(&self.platform_inertia, &body_rates));
        for row in 0..3 {
            for column in 0..3 {
                mass[3 + row][3 + column] += inertia[row][column];
            }
        }
        for (leg_vector, arm) in geometry.legs(pose) {
            let bodies = LegBodies::at(self, leg_vector, arm, &rates);
            add_congruent(&mut mass, &bodies.fixed, &[self.fixed; 3]);
            add_congruent(&mut mass, &bodies.extensible, &[self.extensible; 3]);
            add_congruent(&mut mass, &bodies.turn, &[self.fixed_inertia + self.extensible_inertia; 3]);
        }
        mass
    }

    /// G(h) = ∂V/∂h of the weight, N and N m: the generalised force that carries platform and legs.
    pub fn weight(&self, geometry: &Geometry, pose: &Six) -> Six {
        let turn = rotation(angles(pose));
        let rates = rate_matrix(angles(pose));
        let mut weight = point_jacobian(apply(&turn, &self.center), &rates)[2].map(|x| x * self.platform);
        for (leg_vector, arm) in geometry.legs(pose) {
            let bodies = LegBodies::at(self, leg_vector, arm, &rates);
            for k in 0..6 {
                weight[k] += self.fixed * bodies.fixed[2][k] + self.extensible * bodies.extensible[2][k];
            }
        }
        weight.map(|x| x * self.gravity)
    }
}
