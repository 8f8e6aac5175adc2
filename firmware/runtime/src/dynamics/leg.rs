//! One leg: the request to its own actuator, and its load on the platform.

use super::balance::Share;
use super::lanes::{Lanes, Vectors, dot};
use super::{Leg, Platform};
use crate::real::Real;

/// Data of a motion that all legs share, platform axes. `B` and `P` are the dimensions of base and platform joints that
/// count.
pub(super) struct Common<T, const B: usize, const P: usize> {
    /// Rᵀ − I.
    pub turn: [[T; B]; 3],
    /// Shift common to all joints, m.
    pub shift: [T; 3],
    /// ω, rad/s.
    pub omega: [T; 3],
    /// v of P_C, m/s.
    pub velocity: [T; 3],
    /// ω̇× + ω×ω×, 1/s².
    pub tow: [[T; P]; 3],
    /// v̇ of P_C, m/s².
    pub acceleration: [T; 3],
    /// (q − σ) g, N m.
    pub leg_weight: [T; 3],
}

/// A pass over the legs.
pub(super) struct Round<'a, T, const B: usize, const P: usize> {
    pub platform: &'a Platform<T>,
    pub common: &'a Common<T, B, P>,
    /// Remainder for the equilibrium equations after the legs so far: force, and moment about the pole.
    pub wrench: [T; 6],
}

impl<T: Real, const B: usize, const P: usize> Round<'_, T, B, P> {
    /// Contributions of `N` legs; the rest of their load is subtracted from the wrench. `E` is 1 if displacements are
    /// requested, else 0. Inlined only where code size costs nothing: on a PC the legs then overlap, which takes 0.6 of
    /// the time. The bits are the same.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(never))]
    pub fn shares<const N: usize, const E: usize>(&mut self, legs: [&Leg<T>; N]) -> [Share<T, E>; N] {
        let platform = self.platform;
        let common = self.common;
        let number = |value: fn(&Leg<T>) -> T| Lanes(legs.map(value));
        let vector = |value: fn(&Leg<T>) -> &[T; 3]| {
            [
                Lanes(legs.map(|leg| value(leg)[0])),
                Lanes(legs.map(|leg| value(leg)[1])),
                Lanes(legs.map(|leg| value(leg)[2])),
            ]
        };
        let (rest, joint, arm) = (vector(|leg| &leg.rest), vector(|leg| &leg.joint), vector(|leg| &leg.arm));

        // r₀ + d with the difference as one number: l² − l₀² = (2 r₀ + d)·d keeps its accuracy for small d.
        let moved = affine(&common.shift, &common.turn, &vector(|leg| &leg.base));
        let r = [rest[0] + moved[0], rest[1] + moved[1], rest[2] + moved[2]];
        let doubled = [rest[0] + r[0], rest[1] + r[1], rest[2] + r[2]];
        let square = dot(&doubled, &moved);
        let half = Lanes::splat(T::HALF) + square * number(|leg| leg.half_inverse_square);
        let root = inverse_root(half);
        let w = root * number(|leg| leg.inverse_length);
        let s = [r[0] * w, r[1] * w, r[2] * w];

        let v = spun(&common.velocity, &common.omega, &joint, P);
        let lengthening = dot(&s, &v);
        let turning = w * lengthening;
        // |ṙ⊥|² / l
        let across = dot(&v, &v) * w - lengthening * turning;

        // −l y of the module's documentation.
        let moment = Lanes::splat(platform.extensible_moment);
        let swing = w * platform.leg_inertia;
        let inertial = moment + moment - swing;
        let coriolis = (inertial - swing) * turning;
        let a = affine(&common.acceleration, &common.tow, &joint);
        let weight = common.leg_weight.map(Lanes::splat);
        let y = [
            weight[0] + inertial * a[0] - coriolis * v[0],
            weight[1] + inertial * a[1] - coriolis * v[1],
            weight[2] + inertial * a[2] - coriolis * v[2],
        ];
        let axial = (dot(&s, &y) + across * moment) * w;
        let scaled = [arm[0] * w, arm[1] * w, arm[2] * w];
        let wrench = &mut self.wrench;
        for n in 0..N {
            let (w, y, arm) = (w.0[n], y.map(|y| y.0[n]), scaled.map(|arm| arm.0[n]));
            wrench[0] = wrench[0] - w * y[0];
            wrench[1] = wrench[1] - w * y[1];
            wrench[2] = wrench[2] - w * y[2];
            wrench[3] = wrench[3] - arm[1] * y[2];
            wrench[4] = wrench[4] + arm[0] * y[2];
            wrench[5] = wrench[5] - arm[0] * y[1] + arm[1] * y[0];
            if P == 3 {
                wrench[3] = wrench[3] + arm[2] * y[1];
                wrench[4] = wrench[4] - arm[2] * y[0];
            }
        }
        let mut turned = [arm[1] * s[2], arm[0] * s[2] * -T::ONE, arm[0] * s[1] - arm[1] * s[0]];
        if P == 3 {
            turned[0] = turned[0] - arm[2] * s[1];
            turned[1] = turned[1] + arm[2] * s[0];
        }
        // l = l²/l₀² · l₀/l · l₀; Δl = (l² − l₀²) / (l + l₀).
        let rest_length = number(|leg| leg.length);
        let sum = rest_length + (half + half) * root * rest_length;
        let displacement = square.zip(sum, |a, b| if E > 0 { a / b } else { a });
        let mut n = 0;
        legs.map(|_| {
            let place = n % N;
            n += 1;
            let of = |value: &Lanes<T, N>| value.0[place];
            Share {
                column: [of(&s[0]), of(&s[1]), of(&s[2]), of(&turned[0]), of(&turned[1]), of(&turned[2])],
                axial: of(&axial),
                displacement: [of(&displacement); E],
            }
        })
    }
}

/// l₀/l for `half` = l² / (2 l₀²), by Newton steps from a cubic: multiplications only. Relative error below 2e-16 (f64)
/// and 1e-8 (f32), plus rounding, for lengths within ±30 %.
#[inline(always)]
fn inverse_root<T: Real, const N: usize>(half: Lanes<T, N>) -> Lanes<T, N> {
    let c = |value: f64| Lanes::splat(T::from_f64(value));
    // Exact at rest, so that small motions converge at once; 0.7 % off at worst.
    let mut y = c(5.478_193_507_198_157) + half * c(-2.427_454_611_221_644);
    y = c(-4.681_659_876_000_378) + half * y;
    y = c(2.274_713_387_603_355_6) + half * y;
    for _ in 0..if T::SINGLE { 2 } else { 3 } {
        y = y * (c(1.5) - half * y * y);
    }
    y
}

/// offset + m v, with the first `D` components of v.
#[inline(always)]
fn affine<T: Real, const N: usize, const D: usize>(
    offset: &[T; 3],
    m: &[[T; D]; 3],
    v: &Vectors<T, N>,
) -> Vectors<T, N> {
    let mut out = offset.map(Lanes::splat);
    for (out, row) in out.iter_mut().zip(m) {
        for (m, v) in row.iter().zip(v) {
            *out = *out + *v * *m;
        }
    }
    out
}

/// v + ω × P, with the first `dimensions` components of the joint.
#[inline(always)]
fn spun<T: Real, const N: usize>(
    v: &[T; 3],
    omega: &[T; 3],
    joint: &Vectors<T, N>,
    dimensions: usize,
) -> Vectors<T, N> {
    let [p, q, r] = *omega;
    let [vx, vy, vz] = v.map(Lanes::splat);
    let (x, y) = (vx - joint[1] * r, vy + joint[0] * r);
    let z = vz + joint[1] * p - joint[0] * q;
    if dimensions == 3 { [x + joint[2] * q, y - joint[2] * p, z] } else { [x, y, z] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number for each place, in no order.
    fn number(k: usize) -> f64 {
        ((k * 7919 + 13) % 1009) as f64 / 1009.0 - 0.4
    }

    fn vector(k: usize) -> [f64; 3] {
        [number(k), number(k + 100), number(k + 200)]
    }

    fn leg(k: usize) -> Leg<f64> {
        let rest = [0.1 * number(k), 0.1 * number(k + 1), 0.2];
        let square = rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2];
        Leg {
            base: vector(k + 2),
            joint: vector(k + 3),
            arm: vector(k + 4),
            rest,
            length: 0.21,
            inverse_length: 4.7,
            half_inverse_square: 0.5 / square,
        }
    }

    /// The number of legs per pass changes only the speed.
    #[test]
    fn results_do_not_depend_on_how_many_legs_are_side_by_side() {
        let (first, second) = (leg(5), leg(50));
        let platform = Platform {
            legs: [first; 6],
            places: [0, 1, 2, 3, 4, 5],
            rows: [0, 1, 2, 3, 4, 5],
            flat_base: false,
            flat_platform: false,
            base_depth: 0.2,
            pole: vector(7),
            mass: 1.5,
            first_moment: vector(8),
            pole_moment: vector(9),
            second_moment: [vector(10), vector(11), vector(12)],
            extensible_moment: 0.0037,
            leg_inertia: 5.7e-4,
            leg_weight_moment: -0.008,
            gravity: 9.81,
        };
        let common: Common<f64, 3, 3> = Common {
            turn: [vector(20), vector(21), vector(22)].map(|row| row.map(|x| 0.01 * x)),
            shift: vector(23).map(|x| 0.01 * x),
            omega: vector(24),
            velocity: vector(25),
            tow: [vector(26), vector(27), vector(28)],
            acceleration: vector(29),
            leg_weight: vector(30),
        };
        let round = || Round { platform: &platform, common: &common, wrench: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6] };
        let (mut one, mut two) = (round(), round());
        let ([a], [b]) = (one.shares::<1, 1>([&first]), one.shares::<1, 1>([&second]));
        let [c, d] = two.shares::<2, 1>([&first, &second]);
        let bits = |share: &Share<f64, 1>| {
            (share.column.map(f64::to_bits), share.axial.to_bits(), share.displacement.map(f64::to_bits))
        };
        assert_eq!((bits(&a), bits(&b)), (bits(&c), bits(&d)));
        assert_eq!(one.wrench.map(f64::to_bits), two.wrench.map(f64::to_bits));
        assert_ne!(bits(&a), bits(&b));
    }
}
