//! Leg displacements of a pose.

use specgen_runtime::{Legs, Real, Series};

use super::{Double, Enclosed, Figures, bounds, keep};
use crate::ir::{Kinematics, Scalar};
use crate::model::{Geometry, Model};

/// Terms of sine and versine: below 2⁻¹⁰⁶ of the first up to 0.5 rad.
const TERMS: u32 = 14;
/// Newton steps to 106 bits from anywhere.
const STEPS: usize = 8;

/// The legs without any rounding that matters.
pub(super) struct Exact {
    rest_leg: [[Double; 3]; 6],
    platform_joint: [[Double; 3]; 6],
    rest_length: [Double; 6],
    sine: Vec<Double>,
    versine: Vec<Double>,
}

impl Exact {
    pub(super) fn of(geometry: &Geometry) -> Self {
        let rest_leg: [[Double; 3]; 6] = core::array::from_fn(|leg| {
            core::array::from_fn(|k| {
                let height = if k == 2 { geometry.height } else { 0.0 };
                Double::from(geometry.platform_joints[leg][k]) - Double::from(geometry.base_joints[leg][k])
                    + Double::from(height)
            })
        });
        Self {
            rest_leg,
            platform_joint: geometry.platform_joints.map(|joint| joint.map(Double::from)),
            rest_length: rest_leg.map(|[x, y, z]| (x * x + y * y + z * z).sqrt()),
            sine: series(Double::ONE, 2),
            versine: core::iter::once(Double::HALF).chain(series(Double::HALF, 3)).collect(),
        }
    }

    pub(super) fn series(&self) -> Series<'_, Double> {
        Series { sine: &self.sine, versine: &self.versine }
    }

    pub(super) fn displacements(&self, pose: &[f64; 6]) -> [Double; 6] {
        let legs = Legs {
            rest_leg: self.rest_leg,
            platform_joint: self.platform_joint,
            rest_length: self.rest_length,
            series: self.series(),
            newton_steps: STEPS,
        };
        legs.displacements(&pose.map(Double::from))
    }
}

/// −1/(k (k+1)) times the last one, k = `first`, `first` + 2, …
fn series(leading: Double, first: u32) -> Vec<Double> {
    let mut coefficient = leading;
    (0..TERMS)
        .map(|term| {
            let k = f64::from(first + 2 * term);
            coefficient = -(coefficient / Double::from(k * (k + 1.0)));
            coefficient
        })
        .collect()
}

/// The kernel with the controller's constants in numbers of `T`.
pub(super) fn displacements<T: Real>(constants: &Kinematics, pose: &[f64; 6]) -> [f64; 6]
where
    f64: FromReal<T>,
{
    let of = T::from_f64;
    let sine: Vec<T> = constants.sine.iter().map(|c| of(*c)).collect();
    let versine: Vec<T> = constants.versine.iter().map(|c| of(*c)).collect();
    let legs = Legs {
        rest_leg: constants.rest_leg.map(|leg| leg.map(of)),
        platform_joint: constants.platform_joint.map(|joint| joint.map(of)),
        rest_length: constants.rest_length.map(of),
        series: Series { sine: &sine, versine: &versine },
        newton_steps: constants.newton_steps as usize,
    };
    legs.displacements(&pose.map(of)).map(f64::from_real)
}

/// A number of the controller as a double, exactly.
pub(super) trait FromReal<T> {
    fn from_real(value: T) -> Self;
}

impl FromReal<f32> for f64 {
    fn from_real(value: f32) -> Self {
        Self::from(value)
    }
}

impl FromReal<Self> for f64 {
    fn from_real(value: Self) -> Self {
        value
    }
}

/// Errors of the legs, and of the pose that they make.
pub(super) fn figures(model: &Model, constants: &Kinematics, scalar: Scalar, poses: &[[f64; 6]]) -> (Figures, Figures) {
    let exact = Exact::of(&model.geometry);
    let single = scalar == Scalar::F32;
    let bound = if single {
        bound::<true>(model, constants, &exact, scalar)
    } else {
        bound::<false>(model, constants, &exact, scalar)
    };
    let inverse = crate::lower::inverse_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let to_pose = |legs: &[f64; 6]| inverse.map(|row| (0..6).fold(0.0, |sum, leg| sum + row[leg] * legs[leg]));
    let (mut of_legs, mut of_pose) = ([0.0; 6], [0.0; 6]);
    let (mut legs_f64, mut pose_f64) = ([0.0; 6], [0.0; 6]);
    for pose in poses {
        let found = if single { displacements::<f32>(constants, pose) } else { displacements::<f64>(constants, pose) };
        let wanted = exact.displacements(pose);
        let error: [f64; 6] = core::array::from_fn(|leg| (Double::from(found[leg]) - wanted[leg]).value());
        keep(&mut of_legs, error);
        keep(&mut of_pose, to_pose(&error));
        let in_f64 = displacements::<f64>(constants, pose);
        let error: [f64; 6] = core::array::from_fn(|leg| found[leg] - in_f64[leg]);
        keep(&mut legs_f64, error);
        keep(&mut pose_f64, to_pose(&error));
    }
    let pose_bound = inverse.map(|row| (0..6).fold(0.0, |sum, leg| sum + row[leg].abs() * bound[leg]));
    (
        Figures { bound, sampled: of_legs, against_f64: single.then_some(legs_f64) },
        Figures { bound: pose_bound, sampled: of_pose, against_f64: single.then_some(pose_f64) },
    )
}

/// No leg displacement in the workspace is off by more.
fn bound<const SINGLE: bool>(model: &Model, constants: &Kinematics, exact: &Exact, scalar: Scalar) -> [f64; 6] {
    let of =
        |kept: f64, exact: &Double| Enclosed::<SINGLE>::constant(kept, (Double::from(kept) - *exact).value().abs());
    let list = |kept: &[f64], exact: &[Double]| {
        kept.iter().zip(exact).map(|(kept, exact)| of(*kept, exact)).collect::<Vec<_>>()
    };
    let (sine, versine) = (list(&constants.sine, &exact.sine), list(&constants.versine, &exact.versine));
    let three = |kept: &[[f64; 3]; 6], exact: &[[Double; 3]; 6]| {
        core::array::from_fn(|leg| core::array::from_fn(|k| of(kept[leg][k], &exact[leg][k])))
    };
    let legs = Legs {
        rest_leg: three(&constants.rest_leg, &exact.rest_leg),
        platform_joint: three(&constants.platform_joint, &exact.platform_joint),
        rest_length: core::array::from_fn(|leg| of(constants.rest_length[leg], &exact.rest_length[leg])),
        series: Series { sine: &sine, versine: &versine },
        newton_steps: constants.newton_steps as usize,
    };
    let bounds = bounds(model);
    let found = legs.displacements(&bounds.map(|bound| Enclosed::input(-bound, bound)));
    // Terms and steps that are left out: a quarter of a last bit of the angle and of the displacement each.
    let turn = (bounds[3] + bounds[4] + bounds[5]) * model.geometry.joint_radius();
    found.map(|leg| leg.error() + 0.25 * scalar.epsilon() * (2.0 * turn + leg.magnitude()))
}
