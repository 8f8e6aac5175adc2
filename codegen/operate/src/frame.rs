//! A host's own work frame and tool point, like those of `control.frames`. The host converts poses to the controller's
//! coordinates before it sends them, so the frame can change while the machine runs.

use specgen_runtime::setpoint::{Frames, Target, Work};

use crate::motion::{inverse, rotation};

/// Largest angle between the frames, and of a pose in them, rad: the range of the kernel's series.
const LARGEST: f64 = core::f64::consts::PI / 12.0;

/// A frame, relative to the controller's coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Position of the work frame, m, and its angles, rad.
    work: [f64; 6],
    /// Reference point and centre of rotation of poses, relative to the controller's tool point, m.
    tool: [f64; 3],
    frames: Option<Work<f64>>,
}

impl Default for Frame {
    fn default() -> Self {
        Self::new([0.0; 6], [0.0; 3])
    }
}

impl Frame {
    /// From position and angles of a work frame (R = Rz Ry Rx) and a tool point; m and rad.
    #[must_use]
    pub fn new(work: [f64; 6], tool: [f64; 3]) -> Self {
        let [_, _, _, rx, ry, rz] = work;
        let is_own = work != [0.0; 6] || tool != [0.0; 3];
        let frames = is_own.then(|| Work { axes: rotation([rx, ry, rz]), point: tool, largest_angle: LARGEST });
        Self { work, tool, frames }
    }

    /// Position and angles of the work frame, m and rad.
    #[must_use]
    pub fn work(&self) -> &[f64; 6] {
        &self.work
    }

    /// The tool point, m.
    #[must_use]
    pub fn tool(&self) -> &[f64; 3] {
        &self.tool
    }

    /// The controller's coordinates of a pose in the frame, m and rad; none if an angle is too large.
    #[must_use]
    pub fn user(&self, pose: &[f64; 6]) -> Option<[f64; 6]> {
        let Some(frames) = &self.frames else { return Some(*pose) };
        let mut user = frames.to_platform(&Target::at(*pose))?.pose;
        for (value, offset) in user.iter_mut().zip(&self.work).take(3) {
            *value += offset;
        }
        Some(user)
    }

    /// Converts a pose from the controller's coordinates to the frame, m and rad; none if an angle is too large.
    #[must_use]
    pub fn pose(&self, user: &[f64; 6]) -> Option<[f64; 6]> {
        let Some(frames) = &self.frames else { return Some(*user) };
        inverse(|pose| self.user(pose), Some(&frames.axes), user)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_come_back_and_a_turn_leaves_the_tool_point_where_it_is() {
        let none = Frame::default();
        assert_eq!(none.user(&[1.0; 6]), Some([1.0; 6]));
        let angle = 0.2;
        let frame = Frame::new([1e-6, 2e-6, 3e-6, 0.0, 0.0, angle], [0.01, 0.0, -0.01]);
        let pose = [3e-6, -2e-6, 1e-6, 1e-4, -2e-4, 3e-4];
        let back = frame.user(&pose).and_then(|user| frame.pose(&user)).unwrap();
        assert!(back.iter().zip(pose).all(|(back, pose)| (back - pose).abs() < 1e-15), "{back:?}");
        // Along the frame's x: cos and sin of its angle, and its place.
        let [x, y, z, ..] = frame.user(&[1e-5, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let expected = [1e-6 + 1e-5 * libm::cos(angle), 2e-6 + 1e-5 * libm::sin(angle), 3e-6];
        assert!([x, y, z].iter().zip(expected).all(|(found, wanted)| (found - wanted).abs() < 1e-18), "{x} {y} {z}");
        // -(R - I) c of c = (10 mm, 0, -10 mm) turned by 100 urad about y: (+1, 0, +1) um.
        let pivot = Frame::new([0.0; 6], [0.01, 0.0, -0.01]);
        let [x, y, z, ..] = pivot.user(&[0.0, 0.0, 0.0, 0.0, 1e-4, 0.0]).unwrap();
        assert!((x - 1e-6).abs() < 1e-10 && y.abs() < 1e-18 && (z - 1e-6).abs() < 1e-10, "{x} {y} {z}");
        assert_eq!(pivot.user(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), None);
    }
}
