//! Inverse dynamics of a platform on six two-part legs: motion to leg forces and leg displacements.
//!
//! Coordinates are h = [x y z θx θy θz] from rest (m, rad): translation of P_C in {B} and R = Rz(θz) Ry(θy) Rx(θx) about
//! fixed axes (AI.1). Rates and accelerations are time derivatives of these six numbers; the angular velocity is
//! ω = T(θ) θ̇, which the paper's (4) takes for θ̇.
//!
//! ```text
//! Jᵀ f + w = M ḧ + C ḣ + G          J = ∂l/∂h;  f > 0 pushes the platform;  w: other forces on it
//! ```
//! M is never formed. Joints move with ṙ = v + ω × P and r̈ = a + (ω̇× + ω×ω×) P; the force on the leg at its platform
//! joint (AI.17), in the consistent form of the errata, is
//!
//! ```text
//! F = m_e (r̈ + g) + y + (s·(F − m_e (r̈ + g)) − s·y) s          s = r/l, l̇ = s·ṙ
//! y = −[(2 q − J/l) r̈ − 2 (q − J/l) (l̇/l) ṙ + (q − σ) g] / l    q = m_e l_e, σ = m_s l_s, J = I_s + I_e + m_s l_s² + m_e l_e²
//! s·(F − m_e (r̈ + g)) = q |ṙ⊥|² / l²
//! ```
//! so m_e moves with the platform as a point mass at the joint (put into its mass constants when compiling), what
//! remains along s goes straight into that leg's force, and y loads the platform. Six equilibrium equations then give the
//! leg forces. Moments are taken about the joint of the leg that is eliminated first (its moment column is zero); which
//! equation is solved for which leg is a constant of the platform.
//!
//! Vectors are in platform axes unless said otherwise: there joints and inertia are constant.
//!
//! # Range
//! |θx|, |θy|, |θz| ≤ π/4 and leg lengths within ±30 % of those at rest: there every result is exact but for rounding.
//! Beyond, the polynomials for sine, cosine and 1/l depart from what they stand for, and a singular pose divides by a
//! pivot near zero: results are then wrong, and for absurd arguments not finite. Callers accept poses of the declared
//! workspace only, over which the compiler checks lengths and pivots.

use core::ops::{Add, Mul, Sub};

use crate::real::Real;
use crate::trig::sine_versine;

/// Number of legs.
const LEGS: usize = 6;
/// Legs that are worked on side by side: they share the loads of what is common, and two `f64` fill a vector register of a
/// host.
pub const LANES: usize = 2;
/// Rounds over the legs.
pub const GROUPS: usize = LEGS / LANES;

/// Pose with its first and second time derivatives: m and rad, per s, per s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<T> {
    /// h.
    pub pose: [T; 6],
    /// ḣ.
    pub rate: [T; 6],
    /// ḧ.
    pub acceleration: [T; 6],
}

impl<T: Real> Default for Motion<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Motion<T> {
    /// Standstill at rest.
    #[must_use]
    pub const fn new() -> Self {
        Self { pose: [T::ZERO; 6], rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] }
    }
}

/// What the legs must do for a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load<T> {
    /// Δl, m: change of each leg's length from rest.
    pub displacement: [T; 6],
    /// f, N: force of each leg on the platform, > 0 pushes.
    pub force: [T; 6],
}

/// Joints and lengths of [`LANES`] legs: `vector[axis][lane]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegGroup<T> {
    /// From the base joint to [0, 0, `base_depth`] below P_C at rest, base axes, m: −B_i but for z.
    pub base: [[T; LANES]; 3],
    /// P_i, platform axes, m.
    pub joint: [[T; LANES]; 3],
    /// P_i from the pole, platform axes, m.
    pub arm: [[T; LANES]; 3],
    /// r₀, leg vector at rest, m.
    pub rest: [[T; LANES]; 3],
    /// l₀ = |r₀|, m.
    pub length: [T; LANES],
    /// 1/l₀, 1/m.
    pub inverse_length: [T; LANES],
    /// 1/(2 l₀²), 1/m².
    pub half_inverse_square: [T; LANES],
}

/// Constants of a platform. The compiler computes them (specgen, `lower/dynamics.rs`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform<T> {
    /// The legs in the order of elimination.
    pub groups: [LegGroup<T>; GROUPS],
    /// Leg (0 to 5) at each place of that order.
    pub order: [usize; LEGS],
    /// Equation (0 to 2 force, 3 to 5 moment about the pole) that each place is solved from; the first is a force.
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

/// [`LANES`] numbers, worked on element by element.
#[derive(Clone, Copy)]
struct Lanes<T>([T; LANES]);

impl<T: Real> Lanes<T> {
    #[inline(always)]
    fn splat(value: T) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self;
        for (out, other) in out.0.iter_mut().zip(other.0) {
            *out = f(*out, other);
        }
        out
    }

    /// Sum over the lanes, in order.
    #[inline(always)]
    fn total(self) -> T {
        let [first, rest @ ..] = self.0;
        let mut sum = first;
        for value in rest {
            sum = sum + value;
        }
        sum
    }
}

impl<T: Real> Add for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<T: Real> Sub for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<T: Real> Mul for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<T: Real> Mul<T> for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: T) -> Self {
        self * Self::splat(other)
    }
}

impl<T: Real> Add<T> for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: T) -> Self {
        self + Self::splat(other)
    }
}

/// A vector per lane.
type Vectors<T> = [Lanes<T>; 3];

#[inline(always)]
fn dot<T: Real>(a: &Vectors<T>, b: &Vectors<T>) -> Lanes<T> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// offset + matrix · v; without v's third component where it is known to be zero.
#[inline(always)]
fn affine<T: Real>(matrix: &[[T; 3]; 3], v: &Vectors<T>, offset: &[T; 3], flat: bool) -> Vectors<T> {
    let mut out = *v;
    for ((out, row), offset) in out.iter_mut().zip(matrix).zip(offset) {
        let plane = v[0] * row[0] + v[1] * row[1] + *offset;
        *out = if flat { plane } else { plane + v[2] * row[2] };
    }
    out
}

/// a × b; without a's third component where it is known to be zero.
#[inline(always)]
fn cross<T: Real>(a: &Vectors<T>, b: &Vectors<T>, flat: bool) -> Vectors<T> {
    let last = a[0] * b[1] - a[1] * b[0];
    if flat {
        // The sign stays with the operand, so that nothing is subtracted from zero.
        [a[1] * b[2], Lanes::splat(-T::ONE) * a[0] * b[2], last]
    } else {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], last]
    }
}

#[inline(always)]
fn cross3<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
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
fn sum3<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Attitude of the platform.
struct Attitude<T> {
    /// Rᵀ − I: from base axes to platform axes.
    turn: [[T; 3]; 3],
    /// Rᵀ.
    to_platform: [[T; 3]; 3],
    sine_x: T,
    cosine_x: T,
    sine_y: T,
    cosine_y: T,
}

impl<T: Real> Attitude<T> {
    /// (AI.1) from sine and 1 − cosine, so that nothing cancels for small angles.
    #[inline(always)]
    fn new(pose: &[T; 6]) -> Self {
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
    fn angular(&self, [x, y, z]: [T; 3]) -> [T; 3] {
        let [[_, _, zx], [_, _, zy], [_, _, zz]] = self.to_platform;
        [x + zx * z, self.cosine_x * y + zy * z, zz * z - self.sine_x * y]
    }

    /// dω/dt in platform axes but for the term in θ̈, which is `angular(θ̈)`.
    #[inline(always)]
    fn angular_drift(&self, [x, y, z]: [T; 3], omega: &[T; 3]) -> [T; 3] {
        let yz = y * z;
        let tilt = self.sine_y * yz;
        [-(self.cosine_y * yz), x * omega[2] - self.sine_x * tilt, -(x * omega[1]) - self.cosine_x * tilt]
    }

    /// Generalised force of the angles for a torque about P_C in platform axes: the transpose of [`Self::angular`].
    #[inline(always)]
    fn angular_transposed(&self, torque: &[T; 3]) -> [T; 3] {
        let [[_, _, zx], [_, _, zy], [_, _, zz]] = self.to_platform;
        [
            torque[0],
            self.cosine_x * torque[1] - self.sine_x * torque[2],
            zx * torque[0] + zy * torque[1] + zz * torque[2],
        ]
    }
}

/// One over the length of a leg whose squared length is `ratio` times 2 l₀², as a multiple of 1/l₀: ratio^−½/√2 by Newton
/// from a cubic, multiplications only. Relative error below 2e-16 (f64) and 1e-8 (f32) plus rounding for lengths
/// within ±30 %.
#[inline(always)]
fn inverse_root<T: Real>(half: Lanes<T>) -> Lanes<T> {
    let c = T::from_f64;
    // Through 1 at rest, so that small motions converge at once; 0.7 % off at worst.
    let mut y = half * c(-2.427_454_611_221_644) + c(5.478_193_507_198_157);
    y = half * y + c(-4.681_659_876_000_378);
    y = half * y + c(2.274_713_387_603_355_6);
    for _ in 0..if T::SINGLE { 2 } else { 3 } {
        y = y * (Lanes::splat(c(1.5)) - half * y * y);
    }
    y
}

/// A motion, resolved into what each leg and the platform ask for.
struct Resolved<T> {
    /// Equilibrium equations: force rows 0–2, moment rows 3–5 about the pole; a column per leg in order of elimination.
    columns: [[T; LEGS]; 6],
    /// What goes straight into the leg's force, N; likewise ordered.
    axial: [T; LEGS],
    /// Force and moment about the pole that the legs must balance, besides.
    wrench: [T; 6],
    /// Δl, likewise ordered.
    displacement: [T; LEGS],
}

impl<T: Real> Platform<T> {
    /// Six leg forces for a motion, N, f > 0 pushes: J⁻ᵀ (M ḧ + C ḣ + G).
    #[inline]
    #[must_use]
    pub fn leg_forces(&self, motion: &Motion<T>) -> [T; 6] {
        let attitude = Attitude::new(&motion.pose);
        self.solve(&self.resolve(&attitude, motion, T::ONE))
    }

    /// Leg displacements and leg forces for a motion under a wrench on the platform: force (N) and torque (N m) about P_C,
    /// base axes.
    #[inline]
    #[must_use]
    pub fn load(&self, motion: &Motion<T>, wrench: &[T; 6]) -> Load<T> {
        let attitude = Attitude::new(&motion.pose);
        let mut resolved = self.resolve(&attitude, motion, T::ONE);
        let [fx, fy, fz, tx, ty, tz] = *wrench;
        let force = map(&attitude.to_platform, &[fx, fy, fz]);
        let torque = map(&attitude.to_platform, &[tx, ty, tz]);
        let shift = cross3(&self.pole, &force);
        for k in 0..3 {
            resolved.wrench[k] = resolved.wrench[k] - force[k];
            resolved.wrench[k + 3] = resolved.wrench[k + 3] - (torque[k] - shift[k]);
        }
        Load { displacement: self.by_leg(&resolved.displacement), force: self.solve(&resolved) }
    }

    /// Leg displacements Δl from rest, m, for a pose.
    #[inline]
    #[must_use]
    pub fn displacements(&self, pose: &[T; 6]) -> [T; 6] {
        let motion = Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] };
        self.by_leg(&self.resolve(&Attitude::new(pose), &motion, T::ZERO).displacement)
    }

    /// J = ∂l/∂h, row by leg: m/m and m/rad.
    #[inline]
    #[must_use]
    pub fn jacobian(&self, pose: &[T; 6]) -> [[T; 6]; 6] {
        let attitude = Attitude::new(pose);
        let motion = Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] };
        let c = self.resolve(&attitude, &motion, T::ZERO).columns;
        let mut rows = [[T::ZERO; 6]; LEGS];
        for k in 0..LEGS {
            let direction = [c[0][k], c[1][k], c[2][k]];
            let moment = sum3(&[c[3][k], c[4][k], c[5][k]], &cross3(&self.pole, &direction));
            let [x, y, z] = map_transposed(&attitude.to_platform, &direction);
            let [a, b, c] = attitude.angular_transposed(&moment);
            rows[self.leg(k)] = [x, y, z, a, b, c];
        }
        rows
    }

    /// M(h), symmetric: generalised force per acceleration of a coordinate. Formed for analysis, never on the tick.
    #[inline]
    #[must_use]
    pub fn mass_matrix(&self, pose: &[T; 6]) -> [[T; 6]; 6] {
        let mut rows = [[T::ZERO; 6]; 6];
        for k in 0..6 {
            let mut motion = Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] };
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
        self.generalised_force(&Motion { pose: *pose, rate: *rate, acceleration: [T::ZERO; 6] }, T::ZERO)
    }

    /// G(h), N and N m.
    #[inline]
    #[must_use]
    pub fn gravity(&self, pose: &[T; 6]) -> [T; 6] {
        self.generalised_force(&Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] }, T::ONE)
    }

    /// M ḧ + C ḣ + G times `gravity`, in coordinates h: N and N m.
    #[inline]
    #[must_use]
    pub fn generalised_force(&self, motion: &Motion<T>, gravity: T) -> [T; 6] {
        let attitude = Attitude::new(&motion.pose);
        let Resolved { columns, axial, wrench, .. } = self.resolve(&attitude, motion, gravity);
        let mut total = wrench;
        for (total, row) in total.iter_mut().zip(&columns) {
            for (entry, axial) in row.iter().zip(&axial) {
                *total = *total + *entry * *axial;
            }
        }
        let [fx, fy, fz, tx, ty, tz] = total;
        let force = [fx, fy, fz];
        let torque = sum3(&[tx, ty, tz], &cross3(&self.pole, &force));
        let [x, y, z] = map_transposed(&attitude.to_platform, &force);
        let [a, b, c] = attitude.angular_transposed(&torque);
        [x, y, z, a, b, c]
    }

    /// Ratio of the smallest to the largest pivot of the elimination at a pose, moments in units of `reach` (m): how
    /// near the fixed order comes to dividing by zero. 0 if a pivot vanishes.
    #[must_use]
    pub fn pivot_ratio(&self, pose: &[T; 6], reach: T) -> T {
        let motion = Motion { pose: *pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] };
        let mut columns = self.resolve(&Attitude::new(pose), &motion, T::ZERO).columns;
        for row in columns.iter_mut().skip(3) {
            for entry in row.iter_mut() {
                *entry = *entry / reach;
            }
        }
        let (_, _, pivots) = self.eliminate(&columns, &[T::ZERO; 6]);
        let (mut low, mut high) = (pivots[0].abs(), pivots[0].abs());
        for pivot in pivots {
            let size = pivot.abs();
            low = if size < low { size } else { low };
            high = if size > high { size } else { high };
        }
        // A NaN, from a division by a pivot of zero, fails the comparison.
        if low > T::ZERO && high.is_finite() { low / high } else { T::ZERO }
    }

    /// All that depends on the motion but the solution for the leg forces. `gravity` scales g.
    #[inline(always)]
    fn resolve(&self, attitude: &Attitude<T>, motion: &Motion<T>, gravity: T) -> Resolved<T> {
        let [x, y, z, ..] = motion.pose;
        let [vx, vy, vz, rx, ry, rz] = motion.rate;
        let [ax, ay, az, bx, by, bz] = motion.acceleration;
        let to_platform = &attitude.to_platform;
        let shift = sum3(&[x, y, z], &map(&attitude.turn, &[x, y, z + self.base_depth]));
        let velocity = map(to_platform, &[vx, vy, vz]);
        let acceleration = map(to_platform, &[ax, ay, az]);
        let omega = attitude.angular([rx, ry, rz]);
        let alpha = sum3(&attitude.angular([bx, by, bz]), &attitude.angular_drift([rx, ry, rz], &omega));
        let [[_, _, up_x], [_, _, up_y], [_, _, up_z]] = *to_platform;
        let g = self.gravity * gravity;
        let weight = self.leg_weight_moment * gravity;
        let leg_weight = [weight * up_x, weight * up_y, weight * up_z];

        // ω× and ω̇× + ω×ω×.
        let [p, q, r] = omega;
        let spin = [[T::ZERO, -r, q], [r, T::ZERO, -p], [-q, p, T::ZERO]];
        let (pp, qq, rr, pq, pr, qr) = (p * p, q * q, r * r, p * q, p * r, q * r);
        let tow = [
            [-(qq + rr), pq - alpha[2], pr + alpha[1]],
            [pq + alpha[2], -(pp + rr), qr - alpha[0]],
            [pr - alpha[1], qr + alpha[0], -(pp + qq)],
        ];

        let heave = [acceleration[0] + g * up_x, acceleration[1] + g * up_y, acceleration[2] + g * up_z];
        let mut wrench = self.body(&heave, &tow);
        let mut columns = [[T::ZERO; LEGS]; 6];
        let mut axial = [T::ZERO; LEGS];
        let mut displacement = [T::ZERO; LEGS];
        for (group, legs) in self.groups.iter().enumerate() {
            let base = legs.base.map(Lanes);
            let joint = legs.joint.map(Lanes);
            let arm = legs.arm.map(Lanes);
            let rest = legs.rest.map(Lanes);

            // r₀ + d with the difference in one piece: l² − l₀² = (2 r₀ + d)·d loses nothing for small d.
            let moved = affine(&attitude.turn, &base, &shift, self.flat_base);
            let leg = [rest[0] + moved[0], rest[1] + moved[1], rest[2] + moved[2]];
            let doubled = [rest[0] + leg[0], rest[1] + leg[1], rest[2] + leg[2]];
            let square = dot(&doubled, &moved);
            let half = square * Lanes(legs.half_inverse_square) + T::HALF;
            let root = inverse_root(half);
            let w = root * Lanes(legs.inverse_length);
            let direction = [leg[0] * w, leg[1] * w, leg[2] * w];

            let v = spun(&spin, &joint, &velocity, self.flat_platform);
            let lengthening = dot(&direction, &v);
            let turning = w * lengthening;
            // |ṙ⊥|² / l
            let across = dot(&v, &v) * w - lengthening * turning;

            let swing = w * self.leg_inertia;
            let inertial = Lanes::splat(self.extensible_moment + self.extensible_moment) - swing;
            let coriolis = (inertial - swing) * turning;
            let a = affine(&tow, &joint, &acceleration, self.flat_platform);
            let mut y = a;
            for k in 0..3 {
                y[k] = inertial * a[k] - coriolis * v[k] + leg_weight[k];
            }
            let along = w * (across * self.extensible_moment + dot(&direction, &y));
            let y = [y[0] * w, y[1] * w, y[2] * w];
            let moment = cross(&arm, &y, self.flat_platform);
            let column = cross(&arm, &direction, self.flat_platform);
            for k in 0..3 {
                wrench[k] = wrench[k] - y[k].total();
                wrench[k + 3] = wrench[k + 3] - moment[k].total();
            }
            let length = Lanes(legs.length);
            for lane in 0..LANES {
                let place = group * LANES + lane;
                for k in 0..3 {
                    columns[k][place] = direction[k].0[lane];
                    columns[k + 3][place] = column[k].0[lane];
                }
                axial[place] = along.0[lane];
                // l = l² · 1/l; Δl = (l² − l₀²) / (l + l₀).
                let l0 = length.0[lane];
                let l = (half.0[lane] + half.0[lane]) * root.0[lane] * l0;
                displacement[place] = square.0[lane] / (l + l0);
            }
        }
        Resolved { columns, axial, wrench, displacement }
    }

    /// Force and moment about the pole that accelerate platform and joint masses; `heave` is r̈ of P_C plus gravity.
    #[inline(always)]
    fn body(&self, heave: &[T; 3], tow: &[[T; 3]; 3]) -> [T; 6] {
        let swept = map(tow, &self.first_moment);
        let lifted = cross3(&self.pole_moment, heave);
        let n = &self.second_moment;
        // (Ω N)_jk: what the torque is the axial vector of.
        let entry = |j: usize, k: usize| tow[j][0] * n[0][k] + tow[j][1] * n[1][k] + tow[j][2] * n[2][k];
        [
            self.mass * heave[0] + swept[0],
            self.mass * heave[1] + swept[1],
            self.mass * heave[2] + swept[2],
            lifted[0] + (entry(2, 1) - entry(1, 2)),
            lifted[1] + (entry(0, 2) - entry(2, 0)),
            lifted[2] + (entry(1, 0) - entry(0, 1)),
        ]
    }

    /// Leg forces that balance the wrench, each with its own axial part.
    #[inline(always)]
    fn solve(&self, resolved: &Resolved<T>) -> [T; 6] {
        let (upper, right, pivots) = self.eliminate(&resolved.columns, &resolved.wrench);
        let mut force = right;
        for k in (0..LEGS).rev() {
            let mut rest = right[k];
            for j in k + 1..LEGS {
                rest = rest - upper[k][j] * force[j];
            }
            force[k] = rest / pivots[k];
        }
        for (force, axial) in force.iter_mut().zip(resolved.axial) {
            *force = *force + axial;
        }
        self.by_leg(&force)
    }

    /// Gaussian elimination in the fixed order: the upper triangle, the right side, and the pivots.
    #[inline(always)]
    fn eliminate(&self, columns: &[[T; LEGS]; 6], wrench: &[T; 6]) -> ([[T; LEGS]; 6], [T; 6], [T; 6]) {
        let mut m = *columns;
        let mut right = *wrench;
        for k in 0..6 {
            m[k] = columns[self.row(k)];
            right[k] = wrench[self.row(k)];
        }
        for k in 0..LEGS {
            let inverse = T::ONE / m[k][k];
            for i in k + 1..6 {
                // The first leg has no moment about the pole.
                if k > 0 || self.row(i) < 3 {
                    let factor = m[i][k] * inverse;
                    for j in k + 1..LEGS {
                        m[i][j] = m[i][j] - factor * m[k][j];
                    }
                    right[i] = right[i] - factor * right[k];
                }
            }
        }
        let mut pivots = right;
        for k in 0..LEGS {
            pivots[k] = m[k][k];
        }
        (m, right, pivots)
    }

    /// From the order of elimination to that of the legs.
    #[inline(always)]
    fn by_leg(&self, values: &[T; LEGS]) -> [T; LEGS] {
        let mut out = [T::ZERO; LEGS];
        for k in 0..LEGS {
            out[self.leg(k)] = values[k];
        }
        out
    }

    /// `order[place]`; the bound is for the compiler, which then sees no panic path.
    #[inline(always)]
    fn leg(&self, place: usize) -> usize {
        let leg = self.order[place];
        if leg < LEGS { leg } else { 0 }
    }

    /// `rows[place]`, likewise.
    #[inline(always)]
    fn row(&self, place: usize) -> usize {
        let row = self.rows[place];
        if row < 6 { row } else { 0 }
    }
}

/// `velocity` + ω × P, by the matrix of ω, whose diagonal is left out.
#[inline(always)]
fn spun<T: Real>(spin: &[[T; 3]; 3], joint: &Vectors<T>, velocity: &[T; 3], flat: bool) -> Vectors<T> {
    let x = joint[1] * spin[0][1] + velocity[0];
    let y = joint[0] * spin[1][0] + velocity[1];
    let z = joint[0] * spin[2][0] + joint[1] * spin[2][1] + velocity[2];
    if flat { [x, y, z] } else { [x + joint[2] * spin[0][2], y + joint[2] * spin[1][2], z] }
}
