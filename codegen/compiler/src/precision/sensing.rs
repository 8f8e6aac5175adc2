//! Rounding errors of the pose computed from the readings.

use specgen_numerics::{Double, Kernels, Trace, TracedNumber, cross, magnitude, trace};
use specgen_runtime::{Gauges, Real};

use super::kinematics::{Exact as ExactLegs, FromReal, TracedLegs, cut, kept};
use super::{Figures, boxes, keep};
use crate::ir::{Kinematics, Scalar, Sensing};
use crate::lower;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace};

/// Passes for 106 bits: each multiplies the error by about the angle.
const PASSES: usize = 40;
/// Terms of arc sine and arc tangent: enough for 0.5 rad.
const TERMS: u32 = 70;
/// Newton steps for an inverse; each doubles the number of digits.
const REFINEMENTS: u32 = 3;

type Vectors = [[Double; 3]; 6];
type Matrix = [[Double; 6]; 6];

/// Constants of the gauges.
struct Constants<T> {
    direction: [[T; 3]; 6],
    normal: [[T; 3]; 6],
    skew: [[T; 3]; 6],
    pierced: [[T; 3]; 6],
    inverse: [[T; 6]; 6],
    curvature: [[T; 6]; 6],
    passes: usize,
    arc_sine: Vec<T>,
    arc_tangent: Vec<T>,
}

/// The gauges without relevant rounding. The layout in doubles counts as exact.
type Exact = Constants<Double>;

impl<T: Copy> Constants<T> {
    fn gauges(&self) -> Gauges<'_, T> {
        Gauges {
            direction: self.direction,
            normal: self.normal,
            skew: self.skew,
            pierced: self.pierced,
            inverse: self.inverse,
            curvature: self.curvature,
            passes: self.passes,
            arc_sine: &self.arc_sine,
            arc_tangent: &self.arc_tangent,
        }
    }
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..6).fold(Double::ZERO, |sum, k| sum + a[i][k] * b[k][j])))
}

impl Exact {
    fn of(layout: &Sensing) -> Self {
        let exact = |rows: &[[f64; 3]; 6]| rows.map(|row| row.map(Double::from));
        let (direction, normal, pierced) = (exact(&layout.direction), exact(&layout.normal), exact(&layout.pierced));
        let jacobian: Matrix = core::array::from_fn(|k| {
            let ([x, y, z], [a, b, c]) = (normal[k], cross(pierced[k], normal[k]));
            [x, y, z, a, b, c]
        });
        // X ← X (2 − J X) doubles the digits of the double's inverse.
        let mut inverse = layout.inverse.map(|row| row.map(Double::from));
        let two = Double::ONE + Double::ONE;
        for _ in 0..REFINEMENTS {
            let rest = product(&jacobian, &inverse);
            let rest: Matrix =
                core::array::from_fn(|i| core::array::from_fn(|j| if i == j { two - rest[i][j] } else { -rest[i][j] }));
            inverse = product(&inverse, &rest);
        }
        let second: Matrix = core::array::from_fn(|k| {
            let (m, c) = (normal[k], pierced[k]);
            let half = Double::HALF;
            [
                -(half * (m[1] * c[1] + m[2] * c[2])),
                -(half * (m[0] * c[0] + m[2] * c[2])),
                -(half * (m[0] * c[0] + m[1] * c[1])),
                half * (m[0] * c[1] + m[1] * c[0]),
                half * (m[0] * c[2] + m[2] * c[0]),
                half * (m[1] * c[2] + m[2] * c[1]),
            ]
        });
        let (mut arc_sine, mut arc_tangent) = (Vec::new(), Vec::new());
        let (mut binomial, mut sign) = (Double::ONE, Double::ONE);
        for k in 1..=TERMS {
            let n = f64::from(k);
            binomial = binomial * Double::from(2.0 * n - 1.0) / Double::from(2.0 * n);
            sign = -sign;
            let odd = Double::from(2.0 * n + 1.0);
            arc_sine.push(binomial / odd);
            arc_tangent.push(sign / odd);
        }
        Self {
            direction,
            normal,
            skew: core::array::from_fn(|k| cross(normal[k], direction[k])),
            pierced,
            curvature: product(&inverse, &second),
            inverse,
            passes: PASSES,
            arc_sine,
            arc_tangent,
        }
    }
}

fn pose<T: Kernels>(constants: &Sensing, readings: &[f64; 6]) -> [f64; 6]
where
    f64: FromReal<T>,
{
    let of = T::from_f64;
    let vectors = |rows: &[[f64; 3]; 6]| rows.map(|row| row.map(of));
    let matrix = |rows: &[[f64; 6]; 6]| rows.map(|row| row.map(of));
    let arc_sine: Vec<T> = constants.arc_sine.iter().map(|c| of(*c)).collect();
    let arc_tangent: Vec<T> = constants.arc_tangent.iter().map(|c| of(*c)).collect();
    let gauges = Gauges {
        direction: vectors(&constants.direction),
        normal: vectors(&constants.normal),
        skew: vectors(&constants.skew),
        pierced: vectors(&constants.pierced),
        inverse: matrix(&constants.inverse),
        curvature: matrix(&constants.curvature),
        passes: constants.passes as usize,
        arc_sine: &arc_sine,
        arc_tangent: &arc_tangent,
    };
    T::pose(&gauges, &readings.map(of)).map(f64::from_real)
}

/// Errors of the pose computed from the readings at `poses`.
pub(super) fn figures(
    model: &Model,
    task: &TaskSpace,
    kinematics: &Kinematics,
    constants: &Sensing,
    scalar: Scalar,
    poses: &[[f64; 6]],
) -> Result<Figures, Vec<Diagnostic>> {
    let exact = Exact::of(&lower::gauges(model, task, Scalar::F64)?);
    let legs = ExactLegs::of(&model.geometry);
    let gauges = exact.gauges();
    let single = scalar == Scalar::F32;
    let bound = if single {
        bound::<true>(model, kinematics, constants, &exact, &legs)
    } else {
        bound::<false>(model, kinematics, constants, &exact, &legs)
    };
    let mut figures = Figures::none(bound, single);
    for given in poses {
        let readings =
            Double::readings(&gauges, &legs.series(), &given.map(Double::from)).map(|y| scalar.round(y.value()));
        let found = if single { pose::<f32>(constants, &readings) } else { pose::<f64>(constants, &readings) };
        let wanted = Double::pose(&gauges, &readings.map(Double::from));
        keep(&mut figures.sampled, core::array::from_fn(|axis| (Double::from(found[axis]) - wanted[axis]).value()));
        if let Some(against) = &mut figures.against_f64 {
            let in_f64 = pose::<f64>(constants, &readings);
            keep(against, core::array::from_fn(|axis| found[axis] - in_f64[axis]));
        }
    }
    Ok(figures)
}

/// Proven bound of the errors over the workspace.
fn bound<const SINGLE: bool>(
    model: &Model,
    kinematics: &Kinematics,
    constants: &Sensing,
    exact: &Exact,
    legs: &ExactLegs,
) -> [f64; 6]
where
    TracedNumber<SINGLE>: Kernels,
{
    let bounds = model.workspace.bounds();
    let largest = bounds[3..].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
    let mut bound = [0.0; 6];
    for corner in boxes(&bounds) {
        let (found, record) = trace(|| {
            let gauges = Constants::<TracedNumber<SINGLE>>::traced(constants, exact, largest);
            let gauges = gauges.gauges();
            let series = TracedLegs::of(kinematics, legs, largest);
            let pose = core::array::from_fn(|axis| TracedNumber::coordinate(axis, corner[axis][0], corner[axis][1]));
            // Readings are inputs without error; only their ranges matter.
            let readings = TracedNumber::readings(&gauges, &series.series(), &pose).map(TracedNumber::given);
            let guess = gauges.guess(&readings);
            let start = start(&gauges, &readings, &guess);
            TracedNumber::pose_from(&gauges, &readings, &guess, start)
        });
        keep(&mut bound, found.map(|axis| record.error(&[(axis, 1.0)])));
    }
    bound
}

/// The first guess of the rotation, with a bound of its distance from the fixed point of the passes.
///
/// The error after finitely many passes is the remainder of that distance. With ψ₁ one pass from ψ₀, and passes that contract by
/// κ around there, ψ∞ − ψ₀ differs from ψ₁ − ψ₀ by at most κ/(1 − κ) of it.
fn start<const SINGLE: bool>(
    gauges: &Gauges<'_, TracedNumber<SINGLE>>,
    readings: &[TracedNumber<SINGLE>; 6],
    guess: &[TracedNumber<SINGLE>; 6],
) -> [TracedNumber<SINGLE>; 3]
where
    TracedNumber<SINGLE>: Kernels,
{
    let psi = [guess[3], guess[4], guess[5]];
    let next = TracedNumber::next_turn(gauges, readings, guess, &psi);
    // The step without rounding.
    let step: [TracedNumber<SINGLE>; 3] = core::array::from_fn(|k| (next[k] - psi[k]).given());
    let longest = step.iter().fold(0.0, |a: f64, step| if step.magnitude() > a { step.magnitude() } else { a });
    // The range of all passes if κ is below a half.
    let around = psi.map(|psi| psi.widened(2.0 * longest).given());
    let after = TracedNumber::next_turn(gauges, readings, guess, &around);
    // The controller's constants contract like the exact ones, except for their last bits.
    let contraction = 1.001
        * Trace::peek(|record| {
            after.iter().fold(0.0, |largest: f64, row| {
                let sum = around.iter().fold(0.0, |sum, psi| sum + magnitude(record.derivative(&[(*row, 1.0)], *psi)));
                if sum > largest { sum } else { largest }
            })
        });
    let more = if contraction < 0.5 { longest * contraction / (1.0 - contraction) } else { f64::INFINITY };
    core::array::from_fn(|k| {
        let [low, high] = step[k].range();
        // The fixed point is the guess plus the step, so the error of the guess is its negative.
        psi[k].off_by([-high - more, more - low])
    })
}

impl<const SINGLE: bool> Constants<TracedNumber<SINGLE>> {
    /// Constants of the controller with their rounding and truncation errors, for angles up to `largest`, rad.
    fn traced(constants: &Sensing, exact: &Exact, largest: f64) -> Self {
        let vectors = |rows: &[[f64; 3]; 6], exact: &Vectors| {
            core::array::from_fn(|k| core::array::from_fn(|j| kept(rows[k][j], exact[k][j])))
        };
        let matrix = |rows: &[[f64; 6]; 6], exact: &Matrix| {
            core::array::from_fn(|k| core::array::from_fn(|j| kept(rows[k][j], exact[k][j])))
        };
        // Room for readings that are rounded.
        let square = |x: f64| x * x * (1.0 + 1e-6);
        Self {
            direction: vectors(&constants.direction, &exact.direction),
            normal: vectors(&constants.normal, &exact.normal),
            skew: vectors(&constants.skew, &exact.skew),
            pierced: vectors(&constants.pierced, &exact.pierced),
            inverse: matrix(&constants.inverse, &exact.inverse),
            curvature: matrix(&constants.curvature, &exact.curvature),
            passes: constants.passes as usize,
            arc_sine: cut(&constants.arc_sine, &exact.arc_sine, square(libm::sin(largest))),
            arc_tangent: cut(&constants.arc_tangent, &exact.arc_tangent, square(libm::tan(largest))),
        }
    }
}
