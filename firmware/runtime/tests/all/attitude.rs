//! R, T(θ) and the leg Jacobian against quaternions and central differences.

use crate::common::{Random, cross, times};
use specgen_runtime::Attitude;

/// Scalar first.
type Quaternion = [f64; 4];

fn attitude(angles: [f64; 3]) -> Attitude<f64> {
    Attitude { sine: angles.map(f64::sin), versine: angles.map(|a| 2.0 * (0.5 * a).sin().powi(2)) }
}

fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn about(axis: usize, angle: f64) -> Quaternion {
    let mut q = [(0.5 * angle).cos(), 0.0, 0.0, 0.0];
    q[axis + 1] = (0.5 * angle).sin();
    q
}

/// Turns about fixed axes: x first, then y, then z.
fn quaternion([x, y, z]: [f64; 3]) -> Quaternion {
    product(about(2, z), product(about(1, y), about(0, x)))
}

fn conjugate(q: Quaternion) -> Quaternion {
    [q[0], -q[1], -q[2], -q[3]]
}

fn turned(q: Quaternion, v: [f64; 3]) -> [f64; 3] {
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), conjugate(q));
    [x, y, z]
}

fn angles(random: &mut Random) -> [f64; 3] {
    [0; 3].map(|_| 2.4 * random.unit() - 1.2)
}

fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// (AI.1), and the cross product (AI.6) behind it.
#[test]
fn rotation_less_identity_turns_vectors_as_quaternions_do() {
    let mut random = Random(1);
    for _ in 0..1000 {
        let (angles, v) = (angles(&mut random), [0; 3].map(|_| random.unit()));
        let e = attitude(angles).rotation_less_identity();
        let by_matrix: Vec<f64> = times(&e, v).iter().zip(v).map(|(moved, v)| moved + v).collect();
        assert!(close(by_matrix.try_into().unwrap(), turned(quaternion(angles), v), 1e-15));
    }
}

/// ω = 2 q̇ q* with q̇ by central differences along a straight line of angles.
#[test]
fn rate_matrix_gives_the_angular_velocity_of_the_quaternion() {
    let mut random = Random(2);
    for _ in 0..1000 {
        let (at, rates) = (angles(&mut random), [0; 3].map(|_| 2.0 * random.unit() - 1.0));
        let h = 1e-5;
        let moved = |by: f64| quaternion([0, 1, 2].map(|k| at[k] + by * rates[k]));
        let (ahead, behind) = (moved(h), moved(-h));
        let derivative = [0, 1, 2, 3].map(|k| (ahead[k] - behind[k]) / h);
        let [_, x, y, z] = product(derivative, conjugate(quaternion(at)));
        let omega = times(&attitude(at).rate_matrix(), rates);
        assert!(close(omega, [x, y, z], 1e-9), "{omega:?} {:?}", [x, y, z]);
        // Taking the rates themselves for ω, as the paper does, is another thing.
        assert!(!close(rates, [x, y, z], 1e-6));
    }
}

#[test]
fn inverse_and_derivative_of_the_rate_matrix_are_what_they_say() {
    let mut random = Random(3);
    for _ in 0..1000 {
        let (at, rates) = (angles(&mut random), [0; 3].map(|_| 2.0 * random.unit() - 1.0));
        let here = attitude(at);
        assert!(close(times(&here.rate_matrix_inverse(), times(&here.rate_matrix(), rates)), rates, 1e-14));
        let h = 1e-5;
        let moved = |by: f64| attitude([0, 1, 2].map(|k| at[k] + by * rates[k])).rate_matrix();
        let (ahead, behind) = (moved(h), moved(-h));
        for ((found, ahead), behind) in here.rate_matrix_derivative(rates).iter().zip(ahead).zip(behind) {
            assert!(close(*found, [0, 1, 2].map(|k| (ahead[k] - behind[k]) / (2.0 * h)), 1e-9));
        }
    }
}

/// ∂l/∂h = [s, Tᵀ (R P × s)] for a leg from B to P₀ + t + R P: what T(θ) is for.
#[test]
fn the_true_leg_jacobian_needs_the_rate_matrix() {
    let mut random = Random(4);
    for _ in 0..1000 {
        let mut vector = |size: f64| [0; 3].map(|_| size * (2.0 * random.unit() - 1.0));
        let (joint, base, shift, at) = (vector(0.1), vector(0.15), vector(0.05), vector(1.0));
        let leg = |shift: [f64; 3], angles: [f64; 3]| {
            let arm = turned(quaternion(angles), joint);
            [0, 1, 2].map(|k| shift[k] + arm[k] - base[k] + if k == 2 { 0.4 } else { 0.0 })
        };
        let length = |shift, angles| {
            let r: [f64; 3] = leg(shift, angles);
            (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt()
        };
        let l = length(shift, at);
        let s = leg(shift, at).map(|part| part / l);
        let torque = cross(turned(quaternion(at), joint), s);
        let t = attitude(at).rate_matrix();
        let of_angles: [f64; 3] = [0, 1, 2].map(|j| t[0][j] * torque[0] + t[1][j] * torque[1] + t[2][j] * torque[2]);
        let h = 1e-6;
        let nudged = |v: [f64; 3], k: usize, by: f64| {
            let mut v = v;
            v[k] += by;
            v
        };
        for k in 0..3 {
            let by_shift = (length(nudged(shift, k, h), at) - length(nudged(shift, k, -h), at)) / (2.0 * h);
            let by_turn = (length(shift, nudged(at, k, h)) - length(shift, nudged(at, k, -h))) / (2.0 * h);
            assert!((by_shift - s[k]).abs() < 1e-9 && (by_turn - of_angles[k]).abs() < 1e-9);
        }
    }
}
