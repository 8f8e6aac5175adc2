//! Rounding errors of leg displacements.

use specgen_numerics::{Double, Kernels, TracedNumber, trace};
use specgen_runtime::{Legs, Real, Series};

use super::{Figures, boxes, keep};
use crate::ir::{Kinematics, Scalar};
use specgen_language::model::{Geometry, Model};

/// Terms of sine and versine: below 2⁻¹⁰⁶ of the first up to 0.5 rad.
const TERMS: u32 = 14;
/// Newton steps for 106 bits from any start.
const STEPS: usize = 8;

/// The legs without relevant rounding.
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
            root: &[],
            newton_steps: STEPS,
        };
        Double::displacements(&legs, &pose.map(Double::from))
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
pub(super) fn displacements<T: Kernels>(constants: &Kinematics, pose: &[f64; 6]) -> [f64; 6]
where
    f64: FromReal<T>,
{
    let of = T::from_f64;
    let sine: Vec<T> = constants.sine.iter().map(|c| of(*c)).collect();
    let versine: Vec<T> = constants.versine.iter().map(|c| of(*c)).collect();
    let root: Vec<T> = constants.root.iter().map(|c| of(*c)).collect();
    let legs = Legs {
        rest_leg: constants.rest_leg.map(|leg| leg.map(of)),
        platform_joint: constants.platform_joint.map(|joint| joint.map(of)),
        rest_length: constants.rest_length.map(of),
        series: Series { sine: &sine, versine: &versine },
        root: &root,
        newton_steps: constants.newton_steps as usize,
    };
    T::displacements(&legs, &pose.map(of)).map(f64::from_real)
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

/// A constant of the controller with its rounding error.
pub(super) fn kept<const SINGLE: bool>(kept: f64, exact: Double) -> TracedNumber<SINGLE> {
    TracedNumber::constant(kept, [(Double::from(kept) - exact).value(); 2])
}

/// A truncated series. The remainder, for arguments whose square is at most `square`, counts as an error of the last coefficient:
/// terms decrease, so it is between zero and the first omitted term over 1 − `square`.
pub(super) fn cut<const SINGLE: bool>(
    coefficients: &[f64],
    exact: &[Double],
    square: f64,
) -> Vec<TracedNumber<SINGLE>> {
    // Without any terms, that of the first is zero.
    let last = if coefficients.is_empty() { 0 } else { coefficients.len() - 1 };
    (0..=last)
        .map(|k| {
            let value = coefficients.get(k).copied().unwrap_or(0.0);
            let off = (Double::from(value) - exact[k]).value();
            let beyond = if k == last { exact[k + 1].value() * square / (1.0 - square) } else { 0.0 };
            let (low, high) = if beyond > 0.0 { (off - beyond, off) } else { (off, off - beyond) };
            TracedNumber::constant(value, [low, high])
        })
        .collect()
}

/// The legs in numbers that record their rounding.
pub(super) struct TracedLegs<const SINGLE: bool> {
    sine: Vec<TracedNumber<SINGLE>>,
    versine: Vec<TracedNumber<SINGLE>>,
    root: Vec<TracedNumber<SINGLE>>,
}

impl<const SINGLE: bool> TracedLegs<SINGLE> {
    /// For angles up to `largest`, rad.
    pub(super) fn of(constants: &Kinematics, exact: &Exact, largest: f64) -> Self {
        let square = largest * largest;
        Self {
            sine: cut(&constants.sine, &exact.sine, square),
            versine: cut(&constants.versine, &exact.versine, square),
            // Divided by powers of two, so exact.
            root: constants.root.iter().map(|c| TracedNumber::constant(*c, [0.0; 2])).collect(),
        }
    }

    pub(super) fn series(&self) -> Series<'_, TracedNumber<SINGLE>> {
        Series { sine: &self.sine, versine: &self.versine }
    }
}

/// Errors of the legs, and of the resulting pose.
pub(super) fn figures(model: &Model, constants: &Kinematics, scalar: Scalar, poses: &[[f64; 6]]) -> (Figures, Figures) {
    let exact = Exact::of(&model.geometry);
    let single = scalar == Scalar::F32;
    let inverse = crate::lower::inverse_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let (of_legs, of_pose) = if single {
        bound::<true>(model, constants, &exact, &inverse)
    } else {
        bound::<false>(model, constants, &exact, &inverse)
    };
    let to_pose = |legs: &[f64; 6]| inverse.map(|row| (0..6).fold(0.0, |sum, leg| sum + row[leg] * legs[leg]));
    let mut legs = Figures::none(of_legs, single);
    let mut whole = Figures::none(of_pose, single);
    for pose in poses {
        let found = if single { displacements::<f32>(constants, pose) } else { displacements::<f64>(constants, pose) };
        let wanted = exact.displacements(pose);
        let error: [f64; 6] = core::array::from_fn(|leg| (Double::from(found[leg]) - wanted[leg]).value());
        keep(&mut legs.sampled, error);
        keep(&mut whole.sampled, to_pose(&error));
        if let (Some(legs), Some(whole)) = (&mut legs.against_f64, &mut whole.against_f64) {
            let in_f64 = displacements::<f64>(constants, pose);
            let error: [f64; 6] = core::array::from_fn(|leg| found[leg] - in_f64[leg]);
            keep(legs, error);
            keep(whole, to_pose(&error));
        }
    }
    (legs, whole)
}

/// Proven bounds over the workspace of the errors of leg displacements, and of the resulting pose.
fn bound<const SINGLE: bool>(
    model: &Model,
    constants: &Kinematics,
    exact: &Exact,
    inverse: &[[f64; 6]; 6],
) -> ([f64; 6], [f64; 6])
where
    TracedNumber<SINGLE>: Kernels,
{
    let bounds = model.workspace.bounds();
    let largest = bounds[3..].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
    let (mut of_legs, mut of_pose) = ([0.0; 6], [0.0; 6]);
    for corner in boxes(&bounds) {
        let (found, record) = trace(|| {
            let numbers = TracedLegs::<SINGLE>::of(constants, exact, largest);
            let three = |kept_rows: &[[f64; 3]; 6], exact: &[[Double; 3]; 6]| {
                core::array::from_fn(|leg| core::array::from_fn(|k| kept(kept_rows[leg][k], exact[leg][k])))
            };
            let legs = Legs {
                rest_leg: three(&constants.rest_leg, &exact.rest_leg),
                platform_joint: three(&constants.platform_joint, &exact.platform_joint),
                rest_length: core::array::from_fn(|leg| kept(constants.rest_length[leg], exact.rest_length[leg])),
                series: numbers.series(),
                root: &numbers.root,
                newton_steps: constants.newton_steps as usize,
            };
            let pose = core::array::from_fn(|axis| TracedNumber::coordinate(axis, corner[axis][0], corner[axis][1]));
            let found = TracedNumber::displacements(&legs, &pose);
            core::array::from_fn::<_, 6, _>(|leg| {
                let left = left_by_root(constants, found[leg].magnitude(), constants.rest_length[leg]);
                found[leg].off_by([-left, left])
            })
        });
        keep(&mut of_legs, core::array::from_fn(|leg| record.error(&[(found[leg], 1.0)])));
        keep(
            &mut of_pose,
            inverse.map(|row| record.error(&core::array::from_fn::<_, 6, _>(|leg| (found[leg], row[leg])))),
        );
    }
    (of_legs, of_pose)
}

/// Remainder of a displacement after the series of the root and Newton steps, m. For u = s/(2 l) = Δ + Δ²/(2 l) that of the series is less than
/// twice its last term times τ and the geometric sum of the omitted terms; a step leaves its square over 2 (l + Δ).
fn left_by_root(constants: &Kinematics, displacement: f64, length: f64) -> f64 {
    let twice = 2.0 * (length - displacement);
    let way = displacement + displacement * displacement / (2.0 * length);
    let ratio = way / length;
    let last = constants.root.last().map_or(0.25, |c| c.abs());
    let power = constants.root.iter().fold(1.0, |power, _| power * ratio);
    let series = way * last * power * 2.0 * ratio / (1.0 - 2.0 * ratio);
    (0..constants.newton_steps).fold(series, |left, _| left * left / (twice - 2.0 * left))
}
