//! Inverse dynamics of a platform on six two-part legs: motion to leg forces and leg displacements.
//!
//! Coordinates are h = [x y z θx θy θz] from rest (m, rad): translation of P_C in {B} and R = Rz(θz) Ry(θy) Rx(θx)
//! about fixed axes (AI.1). Rates and accelerations are time derivatives of these six numbers. The angular velocity is
//! ω = T(θ) θ̇; the paper's (4) equates it with θ̇.
//!
//! ```text
//! Jᵀ f + w = M ḧ + C ḣ + G    (3)   J = ∂l/∂h;  f > 0 pushes the platform;  w: other forces on it, such as (5)
//! ```
//! M is never formed. Joints move with ṙ = v + ω × P (AI.5), (AI.6) and r̈ = a + (ω̇× + ω×ω×) P (AI.7); the force on the leg at
//! its platform joint (AI.17), with (AI.8)–(AI.16) in the consistent form of the errata, is
//!
//! ```text
//! F = m_e (r̈ + g) + y + (s·(F − m_e (r̈ + g)) − s·y) s          s = r/l, l̇ = s·ṙ
//! y = −[(2 q − J/l) r̈ − 2 (q − J/l) (l̇/l) ṙ + (q − σ) g] / l    q = m_e l_e, σ = m_s l_s, J = I_s + I_e + m_s l_s² + m_e l_e²
//! s·(F − m_e (r̈ + g)) = q |ṙ⊥|² / l²
//! ```
//! so m_e moves with the platform as a point mass at the joint (the compiler adds it to the mass constants). The
//! remainder along s goes straight into that leg's force, and y loads the platform. Six equilibrium equations then give
//! the leg forces. Moments are taken about the joint of the leg that is eliminated first (its moment column is zero).
//! The equation for each leg is a constant of the platform.
//!
//! A flat base or platform (joints in one plane) saves a fifth: zero components are left out.
//!
//! Vectors are in platform axes unless stated otherwise: joints and inertia are constant there.
//!
//! # Range
//! |θx|, |θy|, |θz| ≤ π/4 and leg lengths within ±30 % of those at rest: there every result is exact but for rounding.
//! Beyond these bounds, the polynomials for sine, cosine and 1/l lose accuracy, and a singular pose divides by a pivot
//! near zero. Results are then wrong, and for extreme arguments not finite. Callers accept only poses of the declared
//! workspace; the compiler checks lengths and pivots over it.

mod affine;
mod attitude;
mod balance;
mod lanes;
mod leg;

pub use crate::motion::Motion;
use crate::real::Real;
pub use affine::Affine;
use attitude::Attitude;
use balance::Balance;
use leg::{Common, Round};

/// Number of legs.
const LEGS: usize = 6;

/// Leg displacements and forces for a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load<T> {
    /// Δl, m: change of each leg's length from rest.
    pub displacement: [T; 6],
    /// f, N: force of each leg on the platform, > 0 pushes.
    pub force: [T; 6],
}

/// Joints and length of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg<T> {
    /// From the base joint to the point `base_depth` below P_C at rest, base axes, m: −B_i, with z from the plane of the base.
    pub base: [T; 3],
    /// P_i, platform axes, m.
    pub joint: [T; 3],
    /// P_i from the pole, platform axes, m.
    pub arm: [T; 3],
    /// r₀, leg vector at rest, m.
    pub rest: [T; 3],
    /// l₀ = |r₀|, m.
    pub length: T,
    /// 1/l₀, 1/m.
    pub inverse_length: T,
    /// 1/(2 l₀²), 1/m².
    pub half_inverse_square: T,
}

/// Constants of a platform. The compiler computes them (specgen, `lower/dynamics.rs`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform<T> {
    /// The legs in the order of elimination.
    pub legs: [Leg<T>; LEGS],
    /// Index (0 to 5) of each leg in that order.
    pub places: [usize; LEGS],
    /// Equation (0 to 2 force, 3 to 5 moment about the pole) that is solved at each step; the first is a force.
    pub rows: [usize; LEGS],
    /// All third components of `base` are zero: they are left out.
    pub flat_base: bool,
    /// All third components of `joint` and `arm` are zero: they are left out.
    pub flat_platform: bool,
    /// Height of P_C at rest above the plane that `base` is measured from, m.
    pub base_depth: T,
    /// P_a: the joint that moments are taken about, m.
    pub pole: [T; 3],
    /// Platform and six times m_e, kg.
    pub mass: T,
    /// ∫ x dm of these about P_C, kg m.
    pub first_moment: [T; 3],
    /// ∫ (x − P_a) dm, kg m.
    pub pole_moment: [T; 3],
    /// ∫ x (x − P_a)ᵀ dm, kg m²; symmetric only for a pole at P_C.
    pub second_moment: [[T; 3]; 3],
    /// q = m_e l_e, kg m.
    pub extensible_moment: T,
    /// J = I_s + I_e + m_s l_s² + m_e l_e², kg m².
    pub leg_inertia: T,
    /// (q − σ) g, N m.
    pub leg_weight_moment: T,
    /// g, m/s², along −z of {B}.
    pub gravity: T,
}

impl<T: Real> Platform<T> {
    /// Six leg forces for a motion, N, f > 0 pushes: J⁻ᵀ (M ḧ + C ḣ + G).
    #[inline]
    #[must_use]
    pub fn leg_forces(&self, motion: &Motion<T>) -> [T; 6] {
        let attitude = Attitude::new(&motion.pose);
        let balance = self.balance::<0>(&attitude, motion, T::ONE);
        self.by_leg(&balance.forces(&self.rows))
    }

    /// Leg displacements and leg forces for a motion, with an optional wrench on the platform: force (N) and torque (N
    /// m) about P_C, base axes.
    #[inline]
    #[must_use]
    pub fn load(&self, motion: &Motion<T>, wrench: Option<&[T; 6]>) -> Load<T> {
        let attitude = Attitude::new(&motion.pose);
        let mut balance = self.balance::<1>(&attitude, motion, T::ONE);
        if let Some([fx, fy, fz, tx, ty, tz]) = wrench {
            let force = map(&attitude.to_platform, &[*fx, *fy, *fz]);
            let torque = map(&attitude.to_platform, &[*tx, *ty, *tz]);
            let shift = cross(&self.pole, &force);
            for k in 0..3 {
                balance.wrench[k] = balance.wrench[k] - force[k];
                balance.wrench[k + 3] = balance.wrench[k + 3] - (torque[k] - shift[k]);
            }
        }
        Load { displacement: self.by_leg(&balance.displacements()), force: self.by_leg(&balance.forces(&self.rows)) }
    }

    /// Leg displacements Δl from rest, m, for a pose.
    #[inline]
    #[must_use]
    pub fn displacements(&self, pose: &[T; 6]) -> [T; 6] {
        self.by_leg(&self.balance::<1>(&Attitude::new(pose), &at_rest(pose), T::ZERO).displacements())
    }

    /// Leg lengths l₀ at rest, m.
    #[inline]
    #[must_use]
    pub fn rest_lengths(&self) -> [T; 6] {
        let [a, b, c, d, e, f] = &self.legs;
        self.by_leg(&[a.length, b.length, c.length, d.length, e.length, f.length])
    }

    /// J = ∂l/∂h, row by leg: m/m and m/rad.
    #[inline]
    #[must_use]
    pub fn jacobian(&self, pose: &[T; 6]) -> [[T; 6]; 6] {
        let attitude = Attitude::new(pose);
        let balance = self.balance::<0>(&attitude, &at_rest(pose), T::ZERO);
        self.by_leg(&balance.shares.map(|share| {
            let [sx, sy, sz, mx, my, mz] = share.column;
            let direction = [sx, sy, sz];
            let moment = sum(&[mx, my, mz], &cross(&self.pole, &direction));
            let [x, y, z] = map_transposed(&attitude.to_platform, &direction);
            let [a, b, c] = attitude.angular_transposed(&moment);
            [x, y, z, a, b, c]
        }))
    }

    /// M(h), symmetric: generalised force per acceleration of a coordinate. For analysis, not on the tick.
    #[inline]
    #[must_use]
    pub fn mass_matrix(&self, pose: &[T; 6]) -> [[T; 6]; 6] {
        let mut rows = [[T::ZERO; 6]; 6];
        for k in 0..6 {
            let mut motion = at_rest(pose);
            motion.acceleration[k] = T::ONE;
            for (row, force) in rows.iter_mut().zip(self.generalised_force(&motion, T::ZERO)) {
                row[k] = force;
            }
        }
        rows
    }

    /// C(h, ḣ) ḣ, N and N m.
    #[inline]
    #[must_use]
    pub fn coriolis(&self, pose: &[T; 6], rate: &[T; 6]) -> [T; 6] {
        self.generalised_force(&Motion { rate: *rate, ..at_rest(pose) }, T::ZERO)
    }

    /// G(h), N and N m.
    #[inline]
    #[must_use]
    pub fn gravity(&self, pose: &[T; 6]) -> [T; 6] {
        self.generalised_force(&at_rest(pose), T::ONE)
    }

    /// M ḧ + C ḣ + G times `gravity`, in coordinates h: N and N m.
    #[must_use]
    pub fn generalised_force(&self, motion: &Motion<T>, gravity: T) -> [T; 6] {
        let attitude = Attitude::new(&motion.pose);
        let balance = self.balance::<0>(&attitude, motion, gravity);
        let mut total = balance.wrench;
        for share in &balance.shares {
            for (total, entry) in total.iter_mut().zip(&share.column) {
                *total = *total + *entry * share.axial;
            }
        }
        let [fx, fy, fz, tx, ty, tz] = total;
        let force = [fx, fy, fz];
        let torque = sum(&[tx, ty, tz], &cross(&self.pole, &force));
        let [x, y, z] = map_transposed(&attitude.to_platform, &force);
        let [a, b, c] = attitude.angular_transposed(&torque);
        [x, y, z, a, b, c]
    }

    /// Ratio of the smallest to the largest pivot of the elimination at a pose, with moments in units of `reach` (m).
    /// It shows how near the fixed order is to a division by zero. 0 if a pivot vanishes.
    #[must_use]
    pub fn pivot_ratio(&self, pose: &[T; 6], reach: T) -> T {
        let mut balance = self.balance::<0>(&Attitude::new(pose), &at_rest(pose), T::ZERO);
        let scale = T::ONE / reach;
        for share in &mut balance.shares {
            for moment in share.column.iter_mut().skip(3) {
                *moment = *moment * scale;
            }
        }
        let pivots = balance.pivots(&self.rows);
        let (mut low, mut high) = (pivots[0].abs(), pivots[0].abs());
        for pivot in pivots {
            let size = pivot.abs();
            low = if size < low { size } else { low };
            high = if size > high { size } else { high };
        }
        // A division by a zero pivot gives a result that is not finite.
        if low > T::ZERO && high.is_finite() { low / high } else { T::ZERO }
    }

    /// The equilibrium equations for a motion; `gravity` scales g. With displacements if `E` is 1.
    #[inline(always)]
    fn balance<const E: usize>(&self, attitude: &Attitude<T>, motion: &Motion<T>, gravity: T) -> Balance<T, E> {
        match (self.flat_base, self.flat_platform) {
            (true, true) => self.balance_in::<2, 2, E>(attitude, motion, gravity),
            (true, false) => self.balance_in::<2, 3, E>(attitude, motion, gravity),
            (false, true) => self.balance_in::<3, 2, E>(attitude, motion, gravity),
            (false, false) => self.balance_in::<3, 3, E>(attitude, motion, gravity),
        }
    }

    /// The same with base and platform joints of `B` and `P` dimensions.
    #[inline]
    fn balance_in<const B: usize, const P: usize, const E: usize>(
        &self,
        attitude: &Attitude<T>,
        motion: &Motion<T>,
        gravity: T,
    ) -> Balance<T, E> {
        let [x, y, z, ..] = motion.pose;
        let [vx, vy, vz, rx, ry, rz] = motion.rate;
        let [ax, ay, az, bx, by, bz] = motion.acceleration;
        let Attitude { turn, to_platform, .. } = attitude;
        let [[_, _, up_x], [_, _, up_y], [_, _, up_z]] = *to_platform;
        // Rotates three vectors row by row, so that a microcontroller loads each row once.
        let turned = |k: usize| {
            let (e, r) = (&turn[k], &to_platform[k]);
            let shift = e[0] * x + e[1] * y + e[2] * (z + self.base_depth);
            (shift, r[0] * vx + r[1] * vy + r[2] * vz, r[0] * ax + r[1] * ay + r[2] * az)
        };
        let (first, second, third) = (turned(0), turned(1), turned(2));
        let shift = [x + first.0, y + second.0, z + third.0];
        let velocity = [first.1, second.1, third.1];
        let acceleration = [first.2, second.2, third.2];
        let omega = attitude.angular([rx, ry, rz]);
        let alpha = attitude.angular_acceleration([rx, ry, rz], [bx, by, bz], &omega);
        let tow = tow(&omega, &alpha);
        let weight = self.leg_weight_moment * gravity;
        let common: Common<T, B, P> = Common {
            turn: first_columns(turn),
            shift,
            omega,
            velocity,
            tow: first_columns(&tow),
            acceleration,
            leg_weight: [weight * up_x, weight * up_y, weight * up_z],
        };
        let g = self.gravity * gravity;
        let heave = [acceleration[0] + g * up_x, acceleration[1] + g * up_y, acceleration[2] + g * up_z];
        let [a, b, c, d, e, f] = &self.legs;
        let mut round = Round { platform: self, common: &common, wrench: self.body(&heave, &tow) };
        // Two at once share loads, but need more registers than a Cortex-M has in f64 (16; 32 in f32). The bits are the
        // same.
        let shares = if T::SINGLE {
            let ([a, b], [c, d], [e, f]) = (round.shares([a, b]), round.shares([c, d]), round.shares([e, f]));
            [a, b, c, d, e, f]
        } else {
            let ([a], [b], [c]) = (round.shares([a]), round.shares([b]), round.shares([c]));
            let ([d], [e], [f]) = (round.shares([d]), round.shares([e]), round.shares([f]));
            [a, b, c, d, e, f]
        };
        Balance { shares, wrench: round.wrench }
    }

    /// Force and moment about the pole that accelerate platform and joint masses; `heave` is r̈ of P_C plus gravity.
    #[inline(always)]
    fn body(&self, heave: &[T; 3], tow: &[[T; 3]; 3]) -> [T; 6] {
        let n = &self.second_moment;
        let [cx, cy, cz] = self.first_moment;
        let [px, py, pz] = self.pole_moment;
        // Ω c: what the mass centre accelerates with beside P_C.
        let swept = |k: usize| taken_up(taken_up(taken_up(T::ZERO, tow[k][0], cx), tow[k][1], cy), tow[k][2], cz);
        // (Ω N)_jk − (Ω N)_kj: what the torque is made of.
        let torque = |j: usize, k: usize, mut sum: T| {
            for i in 0..3 {
                sum = taken_up(sum, tow[j][i], n[i][k]);
            }
            for i in 0..3 {
                sum = taken_off(sum, tow[k][i], n[i][j]);
            }
            sum
        };
        [
            swept(0) + self.mass * heave[0],
            swept(1) + self.mass * heave[1],
            swept(2) + self.mass * heave[2],
            torque(2, 1, taken_off(taken_up(T::ZERO, heave[2], py), heave[1], pz)),
            torque(0, 2, taken_off(taken_up(T::ZERO, heave[0], pz), heave[2], px)),
            torque(1, 0, taken_off(taken_up(T::ZERO, heave[1], px), heave[0], py)),
        ]
    }

    /// From the order of elimination to that of the legs.
    #[inline(always)]
    fn by_leg<V: Copy>(&self, values: &[V; LEGS]) -> [V; LEGS] {
        // The bound is for the compiler, which then sees no panic path.
        self.places.map(|place| values[if place < LEGS { place } else { 0 }])
    }
}

/// `sum` + value · constant. A constant of zero is left out, at no cost where it is known when compiling: a centred and
/// symmetric platform has many.
#[inline(always)]
fn taken_up<T: Real>(sum: T, value: T, constant: T) -> T {
    if constant == T::ZERO { sum } else { sum + value * constant }
}

/// `sum` − value · constant, likewise.
#[inline(always)]
fn taken_off<T: Real>(sum: T, value: T, constant: T) -> T {
    if constant == T::ZERO { sum } else { sum - value * constant }
}

/// A pose held.
#[inline(always)]
fn at_rest<T: Real>(pose: &[T; 6]) -> Motion<T> {
    Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] }
}

/// ω̇× + ω×ω×: acceleration of a point of the platform per distance from P_C, 1/s².
#[inline(always)]
fn tow<T: Real>([p, q, r]: &[T; 3], alpha: &[T; 3]) -> [[T; 3]; 3] {
    let (pq, pr, qr) = (*p * *q, *p * *r, *q * *r);
    [
        [-(*q * *q) - *r * *r, pq - alpha[2], pr + alpha[1]],
        [pq + alpha[2], -(*p * *p) - *r * *r, qr - alpha[0]],
        [pr - alpha[1], qr + alpha[0], -(*p * *p) - *q * *q],
    ]
}

#[inline(always)]
fn first_columns<T: Real, const N: usize>(m: &[[T; 3]; 3]) -> [[T; N]; 3] {
    let mut out = [[T::ZERO; N]; 3];
    for (out, row) in out.iter_mut().zip(m) {
        for (out, value) in out.iter_mut().zip(row) {
            *out = *value;
        }
    }
    out
}

#[inline(always)]
fn cross<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn map<T: Real>(m: &[[T; 3]; 3], v: &[T; 3]) -> [T; 3] {
    let row = |r: &[T; 3]| r[0] * v[0] + r[1] * v[1] + r[2] * v[2];
    [row(&m[0]), row(&m[1]), row(&m[2])]
}

#[inline(always)]
fn map_transposed<T: Real>(m: &[[T; 3]; 3], v: &[T; 3]) -> [T; 3] {
    let column = |k: usize| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2];
    [column(0), column(1), column(2)]
}

#[inline(always)]
fn sum<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
