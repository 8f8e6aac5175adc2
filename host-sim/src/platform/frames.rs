//! User coordinates: from a set-point to P_C, with a rotated work frame and rotations about a tool point.

use super::geometry::{angles, rotation};
use super::linear::{Matrix3, Six, Three, apply, product, transposed};

/// Work axes and tool point of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UserFrames {
    axes: Matrix3,
    tool: Three,
}

impl UserFrames {
    /// Work axes rotated by `angles` (rad, R = Rz Ry Rx) from those of {B}; the tool point in {P}, m.
    pub fn new(angles: &Three, tool: Three) -> Self {
        Self { axes: rotation(*angles), tool }
    }

    /// Pose of P_C, without the bias, at which the tool point has moved by the first three numbers along the work axes
    /// and the platform has rotated about them by the last three.
    pub fn pose(&self, user: &Six) -> Six {
        if *self == Self::new(&[0.0; 3], [0.0; 3]) {
            return *user;
        }
        let w = &self.axes;
        let back = transposed(w);
        let turn = product(&product(w, &rotation(angles(user))), &back);
        let shift = apply(w, &[user[0], user[1], user[2]]);
        // The tool point moves from c to t + R c.
        let tool = apply(&turn, &self.tool);
        let at: Three = std::array::from_fn(|k| shift[k] + (self.tool[k] - tool[k]));
        let x = libm::atan2(turn[2][1], turn[2][2]);
        let y = libm::atan2(-turn[2][0], libm::hypot(turn[2][1], turn[2][2]));
        let z = libm::atan2(turn[1][0], turn[0][0]);
        [at[0], at[1], at[2], x, y, z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn parallel_axes_and_a_tool_at_the_centre_change_nothing() {
        let user = [1e-6, 2e-6, 3e-6, 1e-4, 2e-4, 3e-4];
        assert_eq!(UserFrames::new(&[0.0; 3], [0.0; 3]).pose(&user), user);
    }

    #[test]
    fn a_quarter_turn_of_the_work_frame_makes_x_of_the_user_y_of_the_base() {
        let frames = UserFrames::new(&[0.0, 0.0, FRAC_PI_2], [0.0; 3]);
        let pose = frames.pose(&[1e-6, 0.0, 0.0, 1e-4, 0.0, 0.0]);
        for (found, expected) in pose.iter().zip([0.0, 1e-6, 0.0, 0.0, 1e-4, 0.0]) {
            assert!((found - expected).abs() < 1e-19, "{pose:?}");
        }
    }

    #[test]
    fn the_tool_point_stays_when_the_user_turns() {
        let tool = [0.01, -0.02, 0.04];
        let frames = UserFrames::new(&[0.1, -0.2, 0.3], tool);
        let pose = frames.pose(&[0.0, 0.0, 0.0, 0.02, -0.01, 0.03]);
        let turned = apply(&rotation(angles(&pose)), &tool);
        for k in 0..3 {
            assert!((pose[k] + turned[k] - tool[k]).abs() < 1e-17, "{pose:?}");
        }
        assert!(pose[0].abs() > 1e-4);
    }
}
