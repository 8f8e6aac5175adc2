//! The user's coordinates: displacement of the tool point along the axes of the work frame, and rotation about them.
//!
//! A user's set-point is q, the displacement of the tool point from its place at rest, along the axes W of the work
//! frame (m), and the angles of R_u = Rz Ry Rx about these axes (rad). Rotations turn about the tool point c, which is
//! fixed in {P}. The platform's coordinates are then
//!
//! ```text
//! R = W R_u Wᵀ        t = W q − (R − I) c        (the offset of the work frame is part of the plan's bias)
//! ω = W T(θ_u) θ̇_u    ṫ = W q̇ − ω × R c          ẗ = W q̈ − ω̇ × R c − ω × (ω × R c)
//! ```
//! R − I is computed directly, with 1 − cos as one number: nothing cancels, and f32 keeps its last bits. Euler rates
//! are not angular velocities: T(θ) and its derivative are exact.

use super::Target;
use crate::attitude::Attitude;
use crate::real::Real;
use crate::trig::sine_cosine;

/// From the user's coordinates to those of the platform.
pub trait Frames<T: Real> {
    /// `user` as pose of P_C from rest, without the bias; none if an angle is beyond its limit.
    fn to_platform(&self, user: &Target<T>) -> Option<Target<T>>;

    /// Writes `user` plus `bias` to `target` if that is finite and within ±`bound`; otherwise leaves `target`
    /// unchanged.
    #[inline]
    fn admit(&self, user: &Target<T>, bias: &[T; 6], bound: &[T; 6], target: &mut Target<T>) -> bool {
        let Some(mut platform) = self.to_platform(user) else {
            return false;
        };
        let Some(pose) = shifted(&platform.pose, bias, bound) else {
            return false;
        };
        platform.pose = pose;
        *target = platform;
        true
    }
}

/// `pose` + `bias`, if every component is finite and within ±`bound`.
#[inline]
fn shifted<T: Real>(pose: &[T; 6], bias: &[T; 6], bound: &[T; 6]) -> Option<[T; 6]> {
    let mut shifted = *pose;
    for (value, bias) in shifted.iter_mut().zip(bias) {
        *value = *value + *bias;
    }
    // A NaN fails the comparison.
    shifted.iter().zip(bound).all(|(value, bound)| value.abs() <= *bound).then_some(shifted)
}

/// Axes parallel to the base, rotations about P_C: the same coordinates, at no cost.
#[derive(Debug, Clone, Copy)]
pub struct Parallel;

impl<T: Real> Frames<T> for Parallel {
    #[inline]
    fn to_platform(&self, user: &Target<T>) -> Option<Target<T>> {
        Some(*user)
    }

    #[inline]
    fn admit(&self, user: &Target<T>, bias: &[T; 6], bound: &[T; 6], target: &mut Target<T>) -> bool {
        let Some(pose) = shifted(&user.pose, bias, bound) else {
            return false;
        };
        *target = Target { pose, ..*user };
        true
    }
}

/// Axes parallel to the base, rotations about a tool point.
#[derive(Debug, Clone, Copy)]
pub struct Tool<T> {
    /// c in {P}, m.
    pub point: [T; 3],
    /// Largest permitted |angle|, ≤ π/4, rad.
    pub largest_angle: T,
}

impl<T: Real> Frames<T> for Tool<T> {
    #[inline]
    fn to_platform(&self, user: &Target<T>) -> Option<Target<T>> {
        let turn = Rotation::of(user, self.largest_angle)?;
        let mut target = *user;
        let shift = pivot(&turn.less_identity, &turn.velocity, &turn.acceleration, &self.point);
        subtract(&mut target, &shift);
        Some(target)
    }
}

/// Axes of a work frame, rotations about a tool point.
#[derive(Debug, Clone, Copy)]
pub struct Work<T> {
    /// W: columns are the axes of the work frame in {B}.
    pub axes: [[T; 3]; 3],
    /// c in {P}, m.
    pub point: [T; 3],
    /// Largest permitted |angle|, ≤ π/12, rad.
    pub largest_angle: T,
}

impl<T: Real> Frames<T> for Work<T> {
    #[inline]
    fn to_platform(&self, user: &Target<T>) -> Option<Target<T>> {
        let turn = Rotation::of(user, self.largest_angle)?;
        let w = &self.axes;
        let less_identity = product_with_transpose(&product(w, &turn.less_identity), w);
        let velocity = apply(w, &turn.velocity);
        let angular_acceleration = apply(w, &turn.acceleration);

        let mut target = Target::new();
        for (place, of_user) in [&mut target.pose, &mut target.rate, &mut target.acceleration].into_iter().zip([
            &user.pose,
            &user.rate,
            &user.acceleration,
        ]) {
            let [x, y, z] = apply(w, &[of_user[0], of_user[1], of_user[2]]);
            place[0] = x;
            place[1] = y;
            place[2] = z;
        }
        subtract(&mut target, &pivot(&less_identity, &velocity, &angular_acceleration, &self.point));

        // The angles of R: each is a ratio of entries once those before are known.
        let r = &less_identity;
        let z = angle_of(r[1][0], T::ONE + r[0][0]);
        let (sz, cz) = sine_cosine(z);
        let y = angle_of(-r[2][0], cz * (T::ONE + r[0][0]) + sz * r[1][0]);
        let x = angle_of(r[2][1], T::ONE + r[2][2]);
        let attitude = attitude([x, y, z]);
        let inverse = attitude.rate_matrix_inverse();
        let rates = apply(&inverse, &velocity);
        let turning = apply(&attitude.rate_matrix_derivative(rates), &rates);
        let accelerations = apply(&inverse, &minus(&angular_acceleration, &turning));
        for (axis, angle) in [x, y, z].into_iter().enumerate() {
            target.pose[3 + axis] = angle;
            target.rate[3 + axis] = rates[axis];
            target.acceleration[3 + axis] = accelerations[axis];
        }
        Some(target)
    }
}

/// A rotation with its angular velocity and acceleration.
struct Rotation<T> {
    /// R − I.
    less_identity: [[T; 3]; 3],
    /// ω, rad/s.
    velocity: [T; 3],
    /// ω̇, rad/s².
    acceleration: [T; 3],
}

impl<T: Real> Rotation<T> {
    /// None if an angle is larger than `largest` or not a number.
    #[inline]
    fn of(user: &Target<T>, largest: T) -> Option<Self> {
        let [_, _, _, ax, ay, az] = user.pose;
        if !(ax.abs() <= largest && ay.abs() <= largest && az.abs() <= largest) {
            return None;
        }
        let attitude = attitude([ax, ay, az]);
        let rates = [user.rate[3], user.rate[4], user.rate[5]];
        let accelerations = [user.acceleration[3], user.acceleration[4], user.acceleration[5]];
        let matrix = attitude.rate_matrix();
        let [x, y, z] = apply(&matrix, &accelerations);
        let [tx, ty, tz] = apply(&attitude.rate_matrix_derivative(rates), &rates);
        Some(Self {
            less_identity: attitude.rotation_less_identity(),
            velocity: apply(&matrix, &rates),
            acceleration: [x + tx, y + ty, z + tz],
        })
    }
}

/// For |angles| ≤ π/4; 1 − cos without cancellation.
#[inline]
fn attitude<T: Real>(angles: [T; 3]) -> Attitude<T> {
    let [(sx, vx), (sy, vy), (sz, vz)] = angles.map(|angle| {
        let (sine, cosine) = sine_cosine(angle);
        (sine, sine * sine / (T::ONE + cosine))
    });
    Attitude { sine: [sx, sy, sz], versine: [vx, vy, vz] }
}

/// The angle whose sine and cosine are in the ratio `s` to `c` > 0, |angle| ≤ π/4: Newton on s cos θ − c sin θ, whose
/// error is cubed by every step. From tan θ, three steps reach the last bit in the worst case.
#[inline]
fn angle_of<T: Real>(s: T, c: T) -> T {
    let mut angle = s / c;
    for _ in 0..3 {
        let (sine, cosine) = sine_cosine(angle);
        angle = angle + (s * cosine - c * sine) / (c * cosine + s * sine);
    }
    angle
}

/// (R − I) c and its derivatives.
#[inline]
fn pivot<T: Real>(
    less_identity: &[[T; 3]; 3],
    velocity: &[T; 3],
    acceleration: &[T; 3],
    point: &[T; 3],
) -> [[T; 3]; 3] {
    let shift = apply(less_identity, point);
    let arm = [point[0] + shift[0], point[1] + shift[1], point[2] + shift[2]];
    let rate = cross(velocity, &arm);
    let [tx, ty, tz] = cross(acceleration, &arm);
    let [nx, ny, nz] = cross(velocity, &rate);
    [shift, rate, [tx + nx, ty + ny, tz + nz]]
}

#[inline]
fn subtract<T: Real>(target: &mut Target<T>, shift: &[[T; 3]; 3]) {
    let [pose, rate, acceleration] = shift;
    for (numbers, shift) in
        [(&mut target.pose, pose), (&mut target.rate, rate), (&mut target.acceleration, acceleration)]
    {
        for (number, shift) in numbers.iter_mut().zip(shift) {
            *number = *number - *shift;
        }
    }
}

#[inline]
fn minus<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn cross<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
fn apply<T: Real>(matrix: &[[T; 3]; 3], v: &[T; 3]) -> [T; 3] {
    let row = |r: &[T; 3]| r[0] * v[0] + r[1] * v[1] + r[2] * v[2];
    [row(&matrix[0]), row(&matrix[1]), row(&matrix[2])]
}

/// a · b.
#[inline]
fn product<T: Real>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    let row = |r: &[T; 3]| {
        let entry = |j: usize| r[0] * b[0][j] + r[1] * b[1][j] + r[2] * b[2][j];
        [entry(0), entry(1), entry(2)]
    };
    [row(&a[0]), row(&a[1]), row(&a[2])]
}

/// a · bᵀ.
#[inline]
fn product_with_transpose<T: Real>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    let row = |r: &[T; 3]| apply(b, r);
    [row(&a[0]), row(&a[1]), row(&a[2])]
}
