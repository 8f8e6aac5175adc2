//! A work part under the tip of the platform.

use super::geometry::{angles, point_jacobian, rate_matrix, rotation};
use super::linear::{Matrix3, Matrix6, Six, Three, apply, congruent, cross};

/// A spring between tip and surroundings, in axes parallel to the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkPart {
    /// Stiffness along x, y and z, N/m.
    pub stiffness: Three,
    /// Tip in {P}, m.
    pub tip: Three,
}

impl WorkPart {
    /// Diamond tip 40 mm above P_C on a part of `stiffness` k (N/m): K = diag(0.8, 0.8, 1) k, in both directions.
    pub const fn of_stiffness(stiffness: f64) -> Self {
        Self { stiffness: [0.8 * stiffness, 0.8 * stiffness, stiffness], tip: [0.0, 0.0, 0.04] }
    }

    /// Glass, k = 3 MN/m: order of magnitude of a Rockwell tip at 1 to 10 µm of indentation.
    pub const fn glass() -> Self {
        Self::of_stiffness(3e6)
    }

    /// Aluminium, k = 1.2 MN/m.
    pub const fn aluminium() -> Self {
        Self::of_stiffness(1.2e6)
    }

    /// Stiffness at a pose in coordinates h: Jᵀ K J of the tip.
    pub fn stiffness_matrix(&self, pose: &Six) -> Matrix6 {
        let arm = apply(&rotation(angles(pose)), &self.tip);
        congruent(&point_jacobian(arm, &rate_matrix(angles(pose))), &self.stiffness)
    }
}

/// A work part in contact: its spring is unloaded at the pose of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The part.
    pub part: WorkPart,
    pose: Six,
    /// R tip at contact, m.
    arm: Three,
}

/// Force and torque about P_C in base axes, N and N m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// N.
    pub force: Three,
    /// N m.
    pub torque: Three,
}

impl Wrench {
    /// The generalised force in coordinates h of a wrench on the platform: [F, Tᵀ τ].
    pub fn generalised(&self, rates: &Matrix3) -> Six {
        let mut out = [self.force[0], self.force[1], self.force[2], 0.0, 0.0, 0.0];
        for k in 0..3 {
            for row in 0..3 {
                out[3 + k] += rates[row][k] * self.torque[row];
            }
        }
        out
    }

    /// Both together.
    pub fn and(&self, other: &Self) -> Self {
        let sum = |a: &Three, b: &Three| [0, 1, 2].map(|k| a[k] + b[k]);
        Self { force: sum(&self.force, &other.force), torque: sum(&self.torque, &other.torque) }
    }

    /// Force, then torque.
    pub fn numbers(&self) -> Six {
        let (f, t) = (self.force, self.torque);
        [f[0], f[1], f[2], t[0], t[1], t[2]]
    }
}

impl Contact {
    /// Touches `part` at `pose` without force.
    pub fn at(part: WorkPart, pose: &Six) -> Self {
        Self { part, pose: *pose, arm: apply(&rotation(angles(pose)), &part.tip) }
    }

    /// Displacement of the tip from the point of contact, m.
    fn deflection(&self, pose: &Six) -> Three {
        let arm = apply(&rotation(angles(pose)), &self.part.tip);
        [0, 1, 2].map(|k| (pose[k] - self.pose[k]) + (arm[k] - self.arm[k]))
    }

    /// (5): force of the part on the platform.
    pub fn wrench(&self, pose: &Six) -> Wrench {
        let deflection = self.deflection(pose);
        let force = [0, 1, 2].map(|k| -self.part.stiffness[k] * deflection[k]);
        Wrench { force, torque: cross(apply(&rotation(angles(pose)), &self.part.tip), force) }
    }
}

#[cfg(test)]
impl Contact {
    /// Energy in the spring, J.
    pub(super) fn energy(&self, pose: &Six) -> f64 {
        let d = self.deflection(pose);
        let k = self.part.stiffness;
        0.5 * (k[0] * d[0] * d[0] + k[1] * d[1] * d[1] + k[2] * d[2] * d[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOME: Six = [1e-6, -2e-6, 10e-6, 20e-6, -30e-6, 5e-6];

    fn moved(axis: usize, by: f64) -> Six {
        let mut pose = HOME;
        pose[axis] += by;
        pose
    }

    /// (5), by hand.
    #[test]
    fn a_part_pushes_back_with_its_stiffness_and_turns_the_platform() {
        let contact = Contact::at(WorkPart::glass(), &HOME);
        assert_eq!(contact.wrench(&HOME), Wrench::default());
        let pressed = contact.wrench(&moved(2, 10e-6));
        assert!((pressed.force[2] + 30.0).abs() < 1e-9, "{pressed:?}");
        // Tip 40 mm up, pushed back along −x: torque about −y.
        let sideways = contact.wrench(&moved(0, 10e-6));
        assert!((sideways.force[0] + 24.0).abs() < 1e-9);
        assert!((sideways.torque[1] + 24.0 * 0.04).abs() < 1e-4, "{sideways:?}");
        // A turn about y moves the tip along x.
        let turned = contact.wrench(&moved(4, 100e-6));
        assert!((turned.force[0] + 2.4e6 * 4e-6).abs() < 1e-3);
    }

    #[test]
    fn the_wrench_is_the_slope_of_the_energy() {
        let contact = Contact::at(WorkPart::aluminium(), &HOME);
        let pose = [6e-6, 3e-6, -4e-6, 90e-6, 70e-6, -200e-6];
        let force = contact.wrench(&pose).generalised(&rate_matrix(angles(&pose)));
        for k in 0..6 {
            let (mut above, mut below) = (pose, pose);
            above[k] += 1e-8;
            below[k] -= 1e-8;
            let slope = (contact.energy(&above) - contact.energy(&below)) / 2e-8;
            assert!((slope + force[k]).abs() < 1e-6 * (1.0 + force[k].abs()), "{k}: {slope} {}", force[k]);
        }
    }
}
