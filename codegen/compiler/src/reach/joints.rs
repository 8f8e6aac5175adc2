//! Angles of the joints of the legs.

use super::{Pose, travel};
use specgen_language::model::Geometry;
use specgen_numerics::{cross, dot, norm, rotation};

/// Largest angle between a leg and its direction at rest over corners and interior of the workspace `bounds`, rad: seen from
/// the base, and from the platform.
pub fn angles(geometry: &Geometry, bounds: &Pose) -> [f64; 2] {
    let mut largest = [0.0; 2];
    for pose in travel::samples(bounds) {
        let turn = rotation([pose[3], pose[4], pose[5]]);
        for (base, joint) in geometry.base_joints.iter().zip(&geometry.platform_joints) {
            let rest: [f64; 3] =
                core::array::from_fn(|k| joint[k] - base[k] + if k == 2 { geometry.height } else { 0.0 });
            let turned: [f64; 3] = core::array::from_fn(|row| (0..3).fold(0.0, |sum, k| sum + turn[row][k] * joint[k]));
            let leg: [f64; 3] =
                core::array::from_fn(|k| pose[k] + turned[k] - base[k] + if k == 2 { geometry.height } else { 0.0 });
            // Rᵀ leg: the leg in the platform's own axes.
            let seen: [f64; 3] = core::array::from_fn(|k| (0..3).fold(0.0, |sum, row| sum + turn[row][k] * leg[row]));
            for (slot, found) in largest.iter_mut().zip([angle(&rest, &leg), angle(&rest, &seen)]) {
                if found > *slot {
                    *slot = found;
                }
            }
        }
    }
    largest
}

/// From sine and cosine, so that a small angle keeps its digits.
fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    libm::atan2(norm(cross(*a, *b)), dot(*a, *b))
}
