//! The pose from the gauges.

use specgen_runtime::{Gauges, Real};

use super::kinematics::{Exact as ExactLegs, FromReal};
use super::{Double, Enclosed, Figures, bounds, keep};
use crate::diagnostic::Diagnostic;
use crate::ir::{Kinematics, Scalar, Sensing};
use crate::lower;
use crate::model::{Model, TaskSpace};

/// Passes to 106 bits: each leaves a part of the error as small as the angle.
const PASSES: usize = 40;
/// Terms of arc sine and arc tangent: enough for 0.5 rad.
const TERMS: u32 = 70;
/// Doublings of the digits of an inverse.
const REFINEMENTS: u32 = 3;

type Vectors = [[Double; 3]; 6];
type Matrix = [[Double; 6]; 6];

/// The gauges without any rounding that matters. What the layout says, in doubles, counts as exact.
struct Exact {
    direction: Vectors,
    normal: Vectors,
    skew: Vectors,
    pierced: Vectors,
    inverse: Matrix,
    curvature: Matrix,
    arc_sine: Vec<Double>,
    arc_tangent: Vec<Double>,
}

fn cross(a: [Double; 3], b: [Double; 3]) -> [Double; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
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
            arc_sine,
            arc_tangent,
        }
    }

    fn gauges(&self) -> Gauges<'_, Double> {
        Gauges {
            direction: self.direction,
            normal: self.normal,
            skew: self.skew,
            pierced: self.pierced,
            inverse: self.inverse,
            curvature: self.curvature,
            passes: PASSES,
            arc_sine: &self.arc_sine,
            arc_tangent: &self.arc_tangent,
        }
    }
}

fn pose<T: Real>(constants: &Sensing, readings: &[f64; 6]) -> [f64; 6]
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
    gauges.pose(&readings.map(of)).map(f64::from_real)
}

/// Errors of the pose that is computed from the readings that `poses` make.
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
    let (mut sampled, mut against_f64) = ([0.0; 6], [0.0; 6]);
    let mut largest = [0.0; 6];
    for given in poses {
        let readings = gauges.readings(&legs.series(), &given.map(Double::from)).map(|y| scalar.round(y.value()));
        keep(&mut largest, readings);
        let found = if single { pose::<f32>(constants, &readings) } else { pose::<f64>(constants, &readings) };
        let wanted = gauges.pose(&readings.map(Double::from));
        keep(&mut sampled, core::array::from_fn(|axis| (Double::from(found[axis]) - wanted[axis]).value()));
        let in_f64 = pose::<f64>(constants, &readings);
        keep(&mut against_f64, core::array::from_fn(|axis| found[axis] - in_f64[axis]));
    }
    let bound = if single {
        bound::<true>(model, kinematics, constants, &exact, scalar, largest)
    } else {
        bound::<false>(model, kinematics, constants, &exact, scalar, largest)
    };
    Ok(Figures { bound, sampled, against_f64: single.then_some(against_f64) })
}

/// No pose in the workspace is off by more. `largest`: readings at the corners, where they are largest.
fn bound<const SINGLE: bool>(
    model: &Model,
    kinematics: &Kinematics,
    constants: &Sensing,
    exact: &Exact,
    scalar: Scalar,
    largest: [f64; 6],
) -> [f64; 6] {
    let of =
        |kept: f64, exact: &Double| Enclosed::<SINGLE>::constant(kept, (Double::from(kept) - *exact).value().abs());
    let vectors = |kept: &[[f64; 3]; 6], exact: &Vectors| {
        core::array::from_fn(|k| core::array::from_fn(|j| of(kept[k][j], &exact[k][j])))
    };
    let matrix = |kept: &[[f64; 6]; 6], exact: &Matrix| {
        core::array::from_fn(|k| core::array::from_fn(|j| of(kept[k][j], &exact[k][j])))
    };
    let list = |kept: &[f64], exact: &[Double]| {
        kept.iter().zip(exact).map(|(kept, exact)| of(*kept, exact)).collect::<Vec<_>>()
    };
    let (arc_sine, arc_tangent) =
        (list(&constants.arc_sine, &exact.arc_sine), list(&constants.arc_tangent, &exact.arc_tangent));
    let gauges = Gauges {
        direction: vectors(&constants.direction, &exact.direction),
        normal: vectors(&constants.normal, &exact.normal),
        skew: vectors(&constants.skew, &exact.skew),
        pierced: vectors(&constants.pierced, &exact.pierced),
        inverse: matrix(&constants.inverse, &exact.inverse),
        curvature: matrix(&constants.curvature, &exact.curvature),
        passes: constants.passes as usize,
        arc_sine: &arc_sine,
        arc_tangent: &arc_tangent,
    };
    let bounds = bounds(model);
    let turn = bounds[3] + bounds[4] + bounds[5];
    // Readings are linear in the pose but for the square of the turn, and largest at a corner but for that.
    let size =
        exact.pierced.iter().flatten().map(|part| part.value().abs()).fold(0.0, |a: f64, b| if b > a { b } else { a });
    let more = turn * turn * (size + kinematics.largest_displacement);
    let readings = largest.map(|reading| Enclosed::input(-(reading + more), reading + more));
    let found = gauges.pose(&readings);
    core::array::from_fn(|axis| {
        let left_out = constants.remainder[axis / 3];
        found[axis].error()
            + 2.0 * left_out
            + 0.25 * scalar.epsilon() * if axis < 3 { 0.0 } else { found[axis].magnitude() }
    })
}
