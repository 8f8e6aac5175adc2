//! Geometry in 106 bits, for oracles that must not lose to cancellation.

use specgen::model::Geometry;
use specgen_numerics::Double;

/// a · b.
pub fn dot(a: [Double; 3], b: [Double; 3]) -> Double {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// R = Rz(θz) Ry(θy) Rx(θx) of a pose by its textbook entries, row by row.
pub fn rotation(pose: &[f64; 6]) -> [[Double; 3]; 3] {
    let [(sx, cx), (sy, cy), (sz, cz)] = [pose[3], pose[4], pose[5]].map(sin_cos);
    [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]
}

/// sin and cos of a small angle, by their series.
fn sin_cos(angle: f64) -> (Double, Double) {
    let mut sums = [Double::from(1.0), Double::from(0.0)];
    let mut term = Double::from(1.0);
    for k in 1..24_u32 {
        term = term * Double::from(angle) / Double::from(f64::from(k));
        let sum = &mut sums[k as usize % 2];
        *sum = if k % 4 < 2 { *sum + term } else { *sum - term };
    }
    (sums[1], sums[0])
}

/// Leg displacements |P₀ + t + R P_i − B_i| − l₀, m.
pub fn displacements(geometry: &Geometry, pose: &[f64; 6]) -> [f64; 6] {
    let rest = [0.0, 0.0, geometry.height];
    std::array::from_fn(|leg| {
        let length = |pose: &[f64; 6]| {
            let r = rotation(pose);
            let joint = geometry.platform_joints[leg].map(Double::from);
            let part = [0, 1, 2].map(|k| {
                let moved = dot(r[k], joint) + Double::from(pose[k]) + Double::from(rest[k]);
                moved - Double::from(geometry.base_joints[leg][k])
            });
            dot(part, part).sqrt()
        };
        (length(pose) - length(&[0.0; 6])).value()
    })
}
