//! Leg displacements and gauge readings of a pose by points, lines and planes, and the pose back from them.

use specgen_runtime::linear::{difference, transform};
use specgen_runtime::sensing::faults;
use specgen_runtime::{Calibration, GaugeCalibration as _, Gauges, Legs, Series};

use crate::common::{Random, cross, dot, inverse, rotation, times, worse};

type Six = [f64; 6];
type Vector = [f64; 3];

/// −1/3!, 1/5!, … and 1/2!, −1/4!, …: enough for a third of a radian.
const SERIES: Series<'static, f64> = Series {
    sine: &[-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0],
    versine: &[0.5, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0, 1.0 / 3_628_800.0, -1.0 / 479_001_600.0],
};

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Where a point of the platform is, from P_C at rest.
fn moved(pose: &Six, point: Vector) -> Vector {
    plus([pose[0], pose[1], pose[2]], times(&rotation([pose[3], pose[4], pose[5]]), point))
}

fn poses(seed: u64, reach: f64, tilt: f64) -> impl Iterator<Item = Six> {
    let mut random = Random(seed);
    std::iter::repeat_with(move || {
        std::array::from_fn(|k| (if k < 3 { reach } else { tilt }) * (2.0 * random.unit() - 1.0))
    })
    .take(200)
}

fn apart(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, worse)
}

/// Platform joint and leg at rest, nothing symmetric.
fn legs() -> ([Vector; 6], [Vector; 6]) {
    let mut random = Random(9);
    let mut off = || 0.02 * (2.0 * random.unit() - 1.0);
    let ring = |radius: f64, leg: usize, spread: f64| {
        let angle = std::f64::consts::TAU / 3.0 * (leg / 2) as f64 + if leg % 2 == 0 { -spread } else { spread };
        [radius * angle.cos(), radius * angle.sin(), 0.0]
    };
    let joint = std::array::from_fn(|leg| plus(ring(0.1, leg, 0.8), [off(), off(), off()]));
    let rest = std::array::from_fn(|leg| plus(minus(joint[leg], ring(0.15, leg, 0.2)), [off(), off(), 0.25]));
    (joint, rest)
}

#[test]
fn leg_displacements_are_differences_of_lengths_and_lead_back_to_the_pose() {
    let (joint, rest) = legs();
    let length = |v: Vector| dot(v, v).sqrt();
    let kernel = Legs {
        rest_leg: rest,
        platform_joint: joint,
        rest_length: rest.map(length),
        series: SERIES,
        root: &[],
        newton_steps: 5,
    };
    // At rest: directions and their moments.
    let jacobian: [Six; 6] = std::array::from_fn(|leg| {
        let s = rest[leg].map(|x| x / length(rest[leg]));
        let [a, b, c] = cross(joint[leg], s);
        [s[0], s[1], s[2], a, b, c]
    });
    for pose in poses(1, 0.01, 0.1) {
        let expected: Six = std::array::from_fn(|leg| {
            length(plus(rest[leg], minus(moved(&pose, joint[leg]), joint[leg]))) - length(rest[leg])
        });
        let found = kernel.displacements(&pose);
        assert!(apart(&found, &expected) < 3e-16, "{found:?} {expected:?}");
        let back = kernel.pose(&inverse(&jacobian), 40, &found);
        assert!(apart(&back, &pose) < 1e-13, "{back:?} {pose:?}");
        // Every correction brings it nearer by what J changes.
        let first = kernel.pose(&inverse(&jacobian), 0, &found);
        assert_eq!(first, transform(&inverse(&jacobian), &found));
        let second = kernel.pose(&inverse(&jacobian), 1, &found);
        assert!(apart(&second, &pose) < 0.5 * apart(&first, &pose));
    }
    // Without Newton's steps, s/(2 l₀); the steps square the error.
    let rough = Legs { newton_steps: 0, ..kernel };
    let pose = [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0];
    for (leg, (rough, exact)) in rough.displacements(&pose).iter().zip(kernel.displacements(&pose)).enumerate() {
        let s = 2.0 * rest[leg][2] * 1e-3 + 1e-6;
        assert!((rough - s / (2.0 * length(rest[leg]))).abs() < 1e-18 && (rough - exact).abs() > 1e-7, "leg {leg}");
    }
    // The series does without them, and they end where it began.
    let series = Legs { root: &[-0.5, 0.5, -0.625, 0.875], ..rough };
    let both = Legs { newton_steps: 1, ..series };
    let exact = kernel.displacements(&pose);
    assert!(apart(&series.displacements(&pose), &exact) < 3e-15 && apart(&rough.displacements(&pose), &exact) > 1e-7);
    assert!(apart(&both.displacements(&pose), &exact) < 1e-18);
}

/// A gauge as a drawing has it: where its line pierces the plane at rest, from P_C, along which direction, and the plane.
struct Gauge {
    pierced: Vector,
    direction: Vector,
    normal: Vector,
}

/// Three along z, two along y, one along x; or each askew, with its plane askew to that.
fn layout(skew: f64) -> [Gauge; 6] {
    let mut random = Random(4);
    let mut off = || skew * (2.0 * random.unit() - 1.0);
    let places = [[0.1, 0.0], [-0.05, 0.08], [-0.06, -0.09], [0.07, 0.03], [-0.08, 0.02], [0.01, 0.06]];
    std::array::from_fn(|k| {
        let axis = [2, 2, 2, 1, 1, 0][k];
        let [a, b] = places[k];
        let along = |by: f64| -> Vector { std::array::from_fn(|j| if j == axis { by } else { 0.0 }) };
        let pierced = match axis {
            2 => [a, b, 0.01],
            1 => [a, 0.02, b],
            _ => [0.03, a, b],
        };
        let unit = |v: Vector| v.map(|x| x / dot(v, v).sqrt());
        Gauge {
            pierced,
            direction: unit(plus(along(1.0), [off(), off(), off()])),
            normal: unit(plus(along(1.0), [off(), off(), off()])),
        }
    })
}

/// How far along its line a gauge sees the plane of a pose.
fn reading(gauge: &Gauge, pose: &Six) -> f64 {
    let normal = times(&rotation([pose[3], pose[4], pose[5]]), gauge.normal);
    dot(normal, minus(moved(pose, gauge.pierced), gauge.pierced)) / dot(normal, gauge.direction)
}

fn kernel(layout: &[Gauge; 6], passes: usize) -> Gauges<'static, f64> {
    let vectors = |of: &dyn Fn(&Gauge) -> Vector| -> [Vector; 6] { std::array::from_fn(|k| of(&layout[k])) };
    let normal = vectors(&|gauge| gauge.normal.map(|x| x / dot(gauge.normal, gauge.direction)));
    let (direction, pierced) = (vectors(&|gauge| gauge.direction), vectors(&|gauge| gauge.pierced));
    let jacobian: [Six; 6] = std::array::from_fn(|k| {
        let [a, b, c] = cross(pierced[k], normal[k]);
        let [x, y, z] = normal[k];
        [x, y, z, a, b, c]
    });
    let inverse = inverse(&jacobian);
    // ½ [(m·ψ)(c·ψ) − (m·c)|ψ|²] by its products.
    let products: [Six; 6] = std::array::from_fn(|k| {
        let (m, c) = (normal[k], pierced[k]);
        let square = |i: usize| 0.5 * (m[i] * c[i] - dot(m, c));
        let mixed = |i: usize, j: usize| 0.5 * (m[i] * c[j] + m[j] * c[i]);
        [square(0), square(1), square(2), mixed(0, 1), mixed(0, 2), mixed(1, 2)]
    });
    let curvature = inverse.map(|row| std::array::from_fn(|column| (0..6).map(|k| row[k] * products[k][column]).sum()));
    Gauges {
        direction,
        normal,
        skew: std::array::from_fn(|k| cross(normal[k], direction[k])),
        pierced,
        inverse,
        curvature,
        passes,
        arc_sine: &[1.0 / 6.0, 3.0 / 40.0, 15.0 / 336.0, 105.0 / 3456.0, 945.0 / 42_240.0, 10_395.0 / 599_040.0],
        arc_tangent: &[-1.0 / 3.0, 0.2, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0, 1.0 / 13.0],
    }
}

#[test]
fn gauges_read_where_their_lines_pierce_the_planes_and_give_the_pose_back() {
    for skew in [0.0, 0.3] {
        let layout = layout(skew);
        let many = kernel(&layout, 30);
        for pose in poses(2, 1e-3, 0.05) {
            let expected: Six = std::array::from_fn(|k| reading(&layout[k], &pose));
            let found = many.readings(&SERIES, &pose);
            assert!(apart(&found, &expected) < 1e-16, "{found:?} {expected:?}");
            let back = many.pose(&found);
            // The series of the arcs end at the 15th power of 0.05.
            assert!(apart(&back, &pose) < 1e-15, "skew {skew}: {:e}", apart(&back, &pose));
            // A pass more is nearer, and passes by hand are those of the kernel.
            let errors = [1, 2, 3].map(|passes| apart(&kernel(&layout, passes).pose(&found), &pose));
            assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1] + 1e-16, "{errors:?}");
            let guess = many.guess(&found);
            assert_eq!(guess, transform(&many.inverse, &found));
            let psi = many.next_turn(&found, &guess, &[guess[3], guess[4], guess[5]]);
            assert_eq!(kernel(&layout, 1).pose_from(&found, &guess, psi), kernel(&layout, 2).pose(&found));
        }
    }
}

#[test]
fn calibrations_are_polynomials_and_faults_are_what_is_not_within() {
    let calibration = Calibration { coefficients: std::array::from_fn(|k| [1.0, 0.5, k as f64]) };
    let raw = [0.0, 1.0, -2.0, 3.0, 0.5, 10.0];
    let expected: Six = std::array::from_fn(|k| 1.0 + 0.5 * raw[k] + k as f64 * raw[k] * raw[k]);
    assert_eq!(calibration.readings(&raw), expected);
    assert_eq!(Calibration::<f64, 0> { coefficients: [[]; 6] }.readings(&raw), [0.0; 6]);

    let limits = [[-1.0, 2.0]; 6];
    assert_eq!(faults(&[-1.0, 2.0, 0.0, -0.5, 1.5, 1.0], &limits), 0);
    for bad in [-1.001, 2.001, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for gauge in 0..6 {
            let mut raw = [0.0; 6];
            raw[gauge] = bad;
            assert_eq!(faults(&raw, &limits), 1 << gauge, "{bad} of gauge {gauge}");
        }
        assert_eq!(faults(&[bad, 0.0, bad, bad, 0.0, bad], &limits), 0b10_1101);
    }
}

#[test]
fn maps_are_matrices_and_keep_the_sign_of_zero() {
    let matrix: [Six; 6] = std::array::from_fn(|i| std::array::from_fn(|j| ((i * 6 + j) % 7) as f64 - 3.0));
    let vector = [1.0, -2.0, 4.0, 8.0, -16.0, 32.0];
    let expected: Six = std::array::from_fn(|i| (0..6).map(|j| matrix[i][j] * vector[j]).sum());
    assert_eq!(transform(&matrix, &vector), expected);
    assert_eq!(difference(&expected, &vector), std::array::from_fn(|k| expected[k] - vector[k]));
    let unit: [Six; 6] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    assert_eq!(transform(&unit, &[-0.0; 6]).map(f64::to_bits), [(-0.0_f64).to_bits(); 6]);
    assert_eq!(transform(&unit, &[0.0; 6]).map(f64::to_bits), [0; 6]);
    // A constant of zero takes nothing in, not even what is no number.
    assert_eq!(transform(&unit, &[1.0, f64::NAN, 2.0, 3.0, 4.0, 5.0])[0], 1.0);
}

#[test]
fn series_without_coefficients_are_their_first_terms() {
    let none = Series::<f64> { sine: &[], versine: &[] }.attitude([0.1, -0.2, 0.3]);
    assert_eq!((none.sine, none.versine), ([0.1, -0.2, 0.3], [0.0; 3]));
    let one = Series { sine: &[-0.5], versine: &[0.5, 2.0] }.attitude([0.5, -0.5, 1.0]);
    assert_eq!(one.sine, [0.5 * (1.0 - 0.125), -0.5 * (1.0 - 0.125), 0.5]);
    assert_eq!(one.versine, [0.25 * (0.5 + 0.5), 0.25 * (0.5 + 0.5), 2.5]);
}
