//! The controller's kernels on the compiler's numbers. Generic code is compiled by the crate that names its types. It
//! is named here, so that the kernels are compiled once, with optimisation.

use specgen_runtime::{Gauges, Legs, Motion, Platform, Real, Series};

use crate::{Double, Expansion, Taylor, TracedNumber, expand};

/// Displacements of the legs from rest at `pose` (m and rad), m: [`Platform::displacements`].
pub fn displacements(platform: &Platform<f64>, pose: &[f64; 6]) -> [f64; 6] {
    platform.displacements(pose)
}

/// Displacements of the legs with their cross-talk E, if any: (I + E) l. E has rows by leg, m/m; m in and out.
pub fn coupled(cross_talk: Option<&[[f64; 6]; 6]>, l: [f64; 6]) -> [f64; 6] {
    let Some(e) = cross_talk else { return l };
    core::array::from_fn(|leg| e[leg].iter().zip(&l).fold(l[leg], |sum, (e, l)| sum + e * l))
}

/// ∂l/∂h at `pose` (m and rad), a row by leg, m/m and m/rad: [`Platform::jacobian`].
pub fn jacobian(platform: &Platform<f64>, pose: &[f64; 6]) -> [[f64; 6]; 6] {
    platform.jacobian(pose)
}

/// Six leg forces for a motion, N: [`Platform::leg_forces`].
pub fn leg_forces(platform: &Platform<f64>, motion: &Motion<f64>) -> [f64; 6] {
    platform.leg_forces(motion)
}

/// M(h) at `pose` (m and rad), symmetric but for rounding: [`Platform::mass_matrix`].
pub fn mass_matrix(platform: &Platform<f64>, pose: &[f64; 6]) -> [[f64; 6]; 6] {
    platform.mass_matrix(pose)
}

/// C(h, ḣ) ḣ at `pose` (m and rad) and `rate` (m/s and rad/s), N and N m: [`Platform::coriolis`].
pub fn coriolis(platform: &Platform<f64>, pose: &[f64; 6], rate: &[f64; 6]) -> [f64; 6] {
    platform.coriolis(pose, rate)
}

/// G(h) at `pose` (m and rad), N and N m: [`Platform::gravity`].
pub fn gravity(platform: &Platform<f64>, pose: &[f64; 6]) -> [f64; 6] {
    platform.gravity(pose)
}

/// Distance of the elimination from a zero pivot at `pose` (m and rad), moments in units of `reach` (m):
/// [`Platform::pivot_ratio`].
pub fn pivot_ratio(platform: &Platform<f64>, pose: &[f64; 6], reach: f64) -> f64 {
    platform.pivot_ratio(pose, reach)
}

/// [`Platform::leg_forces`] of every motion up to ± `widths` (pose, rate, acceleration; m, rad, s), N: expanded at rest. Also the number
/// of operations.
pub fn expand_leg_forces(platform: &Platform<Taylor>, widths: &[f64; 18]) -> ([Expansion; 6], usize) {
    expand(widths, |variables| {
        let six = |first: usize| core::array::from_fn(|k| variables[first + k]);
        platform.leg_forces(&Motion { pose: six(0), rate: six(6), acceleration: six(12) })
    })
}

/// A number with the controller's kinematics and gauges compiled for it.
pub trait Kernels: Real {
    /// [`Legs::displacements`] at `pose` (m and rad), m.
    fn displacements(legs: &Legs<'_, Self>, pose: &[Self; 6]) -> [Self; 6];

    /// [`Gauges::readings`] at `pose` (m and rad), m.
    fn readings(gauges: &Gauges<'_, Self>, series: &Series<'_, Self>, pose: &[Self; 6]) -> [Self; 6];

    /// [`Gauges::pose`] of `readings` (m), m and rad.
    fn pose(gauges: &Gauges<'_, Self>, readings: &[Self; 6]) -> [Self; 6];

    /// [`Gauges::next_turn`]: one pass from the turn `psi`.
    fn next_turn(gauges: &Gauges<'_, Self>, readings: &[Self; 6], guess: &[Self; 6], psi: &[Self; 3]) -> [Self; 3];

    /// [`Gauges::pose_from`]: all passes from the turn `psi`.
    fn pose_from(gauges: &Gauges<'_, Self>, readings: &[Self; 6], guess: &[Self; 6], psi: [Self; 3]) -> [Self; 6];
}

macro_rules! kernels {
    ($($number:ty),*) => {$(
        impl Kernels for $number {
            fn displacements(legs: &Legs<'_, Self>, pose: &[Self; 6]) -> [Self; 6] {
                legs.displacements(pose)
            }
            fn readings(gauges: &Gauges<'_, Self>, series: &Series<'_, Self>, pose: &[Self; 6]) -> [Self; 6] {
                gauges.readings(series, pose)
            }
            fn pose(gauges: &Gauges<'_, Self>, readings: &[Self; 6]) -> [Self; 6] {
                gauges.pose(readings)
            }
            fn next_turn(gauges: &Gauges<'_, Self>, readings: &[Self; 6], guess: &[Self; 6], psi: &[Self; 3]) -> [Self; 3] {
                gauges.next_turn(readings, guess, psi)
            }
            fn pose_from(gauges: &Gauges<'_, Self>, readings: &[Self; 6], guess: &[Self; 6], psi: [Self; 3]) -> [Self; 6] {
                gauges.pose_from(readings, guess, psi)
            }
        }
    )*};
}

kernels!(f32, f64, Double, TracedNumber<true>, TracedNumber<false>);
