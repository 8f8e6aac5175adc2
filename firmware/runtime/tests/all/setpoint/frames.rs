//! Frames of the user: tool point and work axes, held to the definition of a turn about a point.

use specgen_runtime::setpoint::{Frames, Target, Tool, Work};

use crate::common::{Random, product, rotation, transpose, worse};

const POINT: [f64; 3] = [7e-3, -5e-3, 40e-3];
const AXES: [f64; 3] = [0.4, -0.3, 1.1];

fn work() -> Work<f64> {
    Work { axes: rotation(AXES), point: POINT, largest_angle: 0.26 }
}

/// Pose of P_C by the definition: where the tool point is, which way the platform is turned.
fn by_definition(user: [f64; 6]) -> [f64; 6] {
    let w = rotation(AXES);
    let r = product(&product(&w, &rotation([user[3], user[4], user[5]])), &transpose(&w));
    let moved = |row: usize| (0..3).map(|k| w[row][k] * user[k]).sum::<f64>();
    let turned = |row: usize| (0..3).map(|k| r[row][k] * POINT[k]).sum::<f64>();
    let t: [f64; 3] = std::array::from_fn(|row| moved(row) + POINT[row] - turned(row));
    [t[0], t[1], t[2], r[2][1].atan2(r[2][2]), (-r[2][0]).asin(), r[1][0].atan2(r[0][0])]
}

#[test]
fn work_frames_place_the_tool_point_and_turn_about_it() {
    let mut random = Random(23);
    let mut worst = 0.0_f64;
    for _ in 0..5000 {
        let size = if random.unit() < 0.5 { 1e-3 } else { 0.25 };
        let user: [f64; 6] =
            std::array::from_fn(|axis| (if axis < 3 { 50e-6 } else { size }) * (2.0 * random.unit() - 1.0));
        let pose = work().to_platform(&Target::at(user)).unwrap().pose;
        let expected = by_definition(user);
        for axis in 0..6 {
            worst = worse(worst, (pose[axis] - expected[axis]).abs());
        }
    }
    println!("f64 against the definition: {worst:.1e} m, rad");
    // The definition itself cancels: eps of 40 mm, of a radian.
    assert!(worst < 4e-16, "{worst:e}");
    let tool = Tool { point: POINT, largest_angle: 0.26 };
    let straight = Work { axes: rotation([0.0; 3]), ..work() };
    let user = Target {
        pose: [1e-6, 2e-6, 3e-6, 0.1, -0.2, 0.05],
        rate: [0.1; 6],
        acceleration: [0.3, 1.0, -2.0, 0.4, 0.5, 0.6],
    };
    let (a, b) = (tool.to_platform(&user).unwrap(), straight.to_platform(&user).unwrap());
    for (a, b) in [(a.pose, b.pose), (a.rate, b.rate), (a.acceleration, b.acceleration)] {
        for axis in 0..6 {
            assert!((a[axis] - b[axis]).abs() < 1e-15, "{a:?} {b:?}");
        }
    }
}

#[test]
fn rates_and_accelerations_through_frames_are_the_derivatives_of_the_pose() {
    // A smooth motion of large angles; differences of the platform's coordinates in time.
    let user = |t: f64| {
        let phase = |axis: usize| 3.0 * t + 0.7 * axis as f64;
        let size = |axis: usize| if axis < 3 { 1e-3 } else { 0.2 };
        Target {
            pose: std::array::from_fn(|axis| size(axis) * phase(axis).sin()),
            rate: std::array::from_fn(|axis| 3.0 * size(axis) * phase(axis).cos()),
            acceleration: std::array::from_fn(|axis| -9.0 * size(axis) * phase(axis).sin()),
        }
    };
    let h = 1e-4;
    for k in 0..300 {
        let t = 0.01 * f64::from(k);
        let [before, here, after] = [t - h, t, t + h].map(|t| work().to_platform(&user(t)).unwrap());
        for axis in 0..6 {
            let rate = (after.pose[axis] - before.pose[axis]) / (2.0 * h);
            let acceleration = (after.rate[axis] - before.rate[axis]) / (2.0 * h);
            assert!((rate - here.rate[axis]).abs() < 1e-7, "axis {axis}: {rate} {}", here.rate[axis]);
            assert!((acceleration - here.acceleration[axis]).abs() < 3e-7, "axis {axis}");
        }
    }
}

#[test]
fn frames_in_single_precision_keep_a_tenth_of_a_nanometre() {
    let mut random = Random(29);
    let single = Work {
        axes: work().axes.map(|row| row.map(|x| x as f32)),
        point: POINT.map(|x| x as f32),
        largest_angle: 0.01,
    };
    let exact = Work {
        axes: single.axes.map(|row| row.map(f64::from)),
        point: single.point.map(f64::from),
        largest_angle: 0.01,
    };
    let mut worst = [0.0_f64; 2];
    for _ in 0..5000 {
        let user: [f32; 6] =
            std::array::from_fn(|axis| ((if axis < 3 { 50e-6 } else { 0.4e-3 }) * (2.0 * random.unit() - 1.0)) as f32);
        let a = single.to_platform(&Target::at(user)).unwrap().pose;
        let b = exact.to_platform(&Target::at(user.map(f64::from))).unwrap().pose;
        for axis in 0..6 {
            let worst = &mut worst[axis / 3];
            *worst = worse(*worst, (f64::from(a[axis]) - b[axis]).abs());
        }
    }
    println!("f32 frames against f64: {:.1e} m, {:.1e} rad", worst[0], worst[1]);
    assert!(worst[0] < 0.02e-9 && worst[1] < 0.2e-9, "{worst:?}");
}

#[test]
fn an_angle_beyond_what_is_meant_is_refused() {
    for bad in [0.27, -0.27, 6.3, 1e300, f64::NAN, f64::INFINITY] {
        assert!(work().to_platform(&Target::at([0.0, 0.0, 0.0, 0.0, bad, 0.0])).is_none(), "{bad}");
    }
}
