//! Rotation of the platform, and its angular velocity from the rates of the three angles.

use crate::real::Real;
use crate::trig::sine_versine;

/// Attitude of the platform.
pub(super) struct Attitude<T> {
    /// Rᵀ − I: from base axes to platform axes.
    pub turn: [[T; 3]; 3],
    /// Rᵀ.
    pub to_platform: [[T; 3]; 3],
    sine_x: T,
    cosine_x: T,
    sine_y: T,
    cosine_y: T,
}

impl<T: Real> Attitude<T> {
    /// (AI.1) from sine and 1 − cosine, so that nothing cancels for small angles.
    #[inline(always)]
    pub fn new(pose: &[T; 6]) -> Self {
        let ((sx, vx), (sy, vy), (sz, vz)) = (sine_versine(pose[3]), sine_versine(pose[4]), sine_versine(pose[5]));
        let (cx, cy, cz) = (T::ONE - vx, T::ONE - vy, T::ONE - vz);
        let (sxsy, cxsy) = (sx * sy, cx * sy);
        let turn = [
            [vy * vz - vy - vz, cy * sz, -sy],
            [sxsy * cz - cx * sz, sxsy * sz + (vx * vz - vx - vz), sx * cy],
            [cxsy * cz + sx * sz, cxsy * sz - sx * cz, vx * vy - vx - vy],
        ];
        let mut to_platform = turn;
        to_platform[0][0] = cy * cz;
        to_platform[1][1] = T::ONE + turn[1][1];
        to_platform[2][2] = cx * cy;
        Self { turn, to_platform, sine_x: sx, cosine_x: cx, sine_y: sy, cosine_y: cy }
    }

    /// ω in platform axes for the rates of the angles.
    #[inline(always)]
    pub fn angular(&self, [x, y, z]: [T; 3]) -> [T; 3] {
        let [[_, _, zx], [_, _, zy], [_, _, zz]] = self.to_platform;
        [x + zx * z, self.cosine_x * y + zy * z, zz * z - self.sine_x * y]
    }

    /// dω/dt in platform axes for the rates and accelerations of the angles, with ω.
    #[inline(always)]
    pub fn angular_acceleration(&self, [x, y, z]: [T; 3], [ax, ay, az]: [T; 3], omega: &[T; 3]) -> [T; 3] {
        let [[_, _, zx], [_, _, zy], [_, _, zz]] = self.to_platform;
        let yz = y * z;
        let tilt = self.sine_y * yz;
        [
            ax + zx * az - self.cosine_y * yz,
            self.cosine_x * ay + zy * az + x * omega[2] - self.sine_x * tilt,
            zz * az - self.sine_x * ay - x * omega[1] - self.cosine_x * tilt,
        ]
    }

    /// Generalised force of the angles for a torque about P_C in platform axes: the transpose of [`Self::angular`].
    #[inline(always)]
    pub fn angular_transposed(&self, torque: &[T; 3]) -> [T; 3] {
        let [[_, _, zx], [_, _, zy], [_, _, zz]] = self.to_platform;
        [
            torque[0],
            self.cosine_x * torque[1] - self.sine_x * torque[2],
            zx * torque[0] + zy * torque[1] + zz * torque[2],
        ]
    }
}
