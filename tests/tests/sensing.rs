//! Pose from gauges, and from leg displacements, against geometry in 32 digits; layouts that cannot work are refused.

use crate::support::exact::{self, dot};
use crate::support::gauges::{
    Random, double, legs, lowered, model, probe, real, runtime, sensing, series, task, three_two_one, tilted,
    with_scalar,
};
use host_sim::noise::Gaussian;
use specgen::ir::{Ir, Scalar as IrScalar};
use specgen::lower::pose_noise;
use specgen::model::{Model, Probe, Scalar};
use specgen_numerics::Double;
use specgen_runtime::{Calibration, GaugeCalibration as _, Gauges, Real};
use specgen_tests::worse;

fn poses() -> usize {
    specgen_tests::length(150, 2000)
}

/// Where the line of a gauge meets its plane, from its point, along its direction, less the same at rest: by the rotated plane
/// itself, in 106 bits.
fn exact_reading(model: &Model, probe: &Probe, pose: &[f64; 6]) -> Double {
    let along_line = |pose: &[f64; 6]| {
        let r = exact::rotation(pose);
        let vector = |v: [f64; 3]| v.map(Double::from);
        let turned = |v: [f64; 3]| r.map(|row| dot(row, vector(v)));
        let normal = turned(probe.plane_normal);
        let on_plane = turned(probe.plane_point);
        let rest = [0.0, 0.0, model.geometry.height];
        let moved = |k: usize| on_plane[k] + Double::from(pose[k]) + Double::from(rest[k]);
        let from_line = [0, 1, 2].map(|k| moved(k) - Double::from(probe.point[k]));
        dot(normal, from_line) / dot(normal, vector(probe.direction))
    };
    along_line(pose) - along_line(&[0.0; 6])
}

fn exact_readings(model: &Model, pose: &[f64; 6]) -> [f64; 6] {
    let probes = &model.task_space.as_ref().unwrap().probes;
    std::array::from_fn(|k| exact_reading(model, &probes[k], pose).value())
}

/// Largest error of the translation (m) and of the rotation (rad) over random poses.
fn pose_error<T: Real>(model: &Model, ir: &Ir, seed: u64, poses: usize) -> [f64; 2] {
    let gauges = runtime::<T>(ir);
    let mut random = Random::new(seed);
    let mut worst = [0.0_f64; 2];
    for _ in 0..poses {
        let pose = random.pose(model);
        let readings = exact_readings(model, &pose).map(|reading| real::<T>(reading));
        for (k, (found, pose)) in gauges.pose(&readings).into_iter().zip(pose).enumerate() {
            worst[k / 3] = worse(worst[k / 3], (double(found) - pose).abs());
        }
    }
    worst
}

#[test]
fn pose_from_gauges_is_exact_to_1e_12_in_f64_and_to_a_tenth_of_a_nanometre_in_f32() {
    for (name, layout) in [("3-2-1", three_two_one()), ("tilted", tilted())] {
        let model = with_scalar(model(layout), Scalar::F64);
        let ir = lowered(&model).unwrap();
        let [shift, turn] = pose_error::<f64>(&model, &ir, 1, poses());
        println!("{name}: {} passes, f64 {shift:.1e} m, {turn:.1e} rad", sensing(&ir).passes);
        assert!(shift <= 1e-12 && turn <= 1e-12, "{name}: {shift:e} m, {turn:e} rad");
        // The promise of the IR holds, and is not an idle one.
        let [promised_shift, promised_turn] = sensing(&ir).remainder;
        assert!(shift <= promised_shift.max(1e-17) && turn <= promised_turn.max(1e-16));

        let single = with_scalar(model, Scalar::F32);
        let ir = lowered(&single).unwrap();
        let [shift, turn] = pose_error::<f32>(&single, &ir, 1, poses());
        println!("{name}: {} passes, f32 {:.4} nm, {:.4} nrad", sensing(&ir).passes, shift * 1e9, turn * 1e9);
        // A turn counts by what it moves at the gauges, 0.1 m away.
        assert!(shift <= 0.1e-9 && 0.1 * turn <= 0.1e-9, "{name}: {shift:e} m, {turn:e} rad");
    }
}

/// One pass less misses what is promised: the count is not idle.
#[test]
fn one_pass_less_is_worse_than_the_tolerance() {
    for layout in [three_two_one(), tilted()] {
        let model = model(layout);
        let mut ir = lowered(&model).unwrap();
        ir.task_space.as_mut().unwrap().sensing.passes -= 1;
        let [shift, turn] = pose_error::<f64>(&model, &ir, 1, 200);
        assert!(shift > 1e-13 || turn > 1e-13, "{shift:e} m, {turn:e} rad");
    }
}

#[test]
fn random_layouts_that_are_accepted_are_exact_too() {
    let mut random = Random::new(11);
    let (mut accepted, mut refused) = (0, 0);
    let mut worst = [0.0_f64; 2];
    while accepted < specgen_tests::length(4, 60) {
        let mut model = model(random.layout());
        // These may look anywhere, so their readings may be large.
        model.sensor.range = [-500e-6, 500e-6];
        let Ok(ir) = lowered(&model) else {
            refused += 1;
            assert!(refused < 200);
            continue;
        };
        accepted += 1;
        let error = pose_error::<f64>(&model, &ir, accepted, 50);
        worst = [worse(worst[0], error[0]), worse(worst[1], error[1])];
    }
    println!("{accepted} layouts, {refused} refused: {:.1e} m, {:.1e} rad", worst[0], worst[1]);
    assert!(worst[0] <= 1e-12 && worst[1] <= 1e-12, "{worst:?}");
}

/// A workspace thirty to fifty times as large takes more passes and longer series, and keeps the promise.
#[test]
fn a_workspace_of_millimetres_and_a_degree_is_as_exact() {
    for layout in [three_two_one(), tilted()] {
        let mut model = model(layout);
        model.workspace.translation = [2e-3; 3];
        model.workspace.rotation = [0.02; 3];
        model.sensor.range = [-4e-3, 4e-3];
        let ir = lowered(&model).unwrap();
        let [shift, turn] = pose_error::<f64>(&model, &ir, 3, specgen_tests::length(100, 500));
        println!("{} passes: {shift:.1e} m, {turn:.1e} rad", sensing(&ir).passes);
        assert!(sensing(&ir).passes > 3 && shift <= 1e-12 && turn <= 1e-12, "{shift:e} m, {turn:e} rad");
    }
}

#[test]
fn readings_of_a_pose_are_those_of_the_rotated_planes() {
    for layout in [three_two_one(), tilted()] {
        let model = model(layout);
        let ir = lowered(&model).unwrap();
        let (gauges, series) = (runtime::<f64>(&ir), series::<f64>(&ir));
        let mut random = Random::new(2);
        let mut worst = 0.0_f64;
        for _ in 0..poses() {
            let pose = random.pose(&model);
            let found = gauges.readings(&series, &pose);
            for (found, exact) in found.iter().zip(exact_readings(&model, &pose)) {
                worst = worse(worst, (found - exact).abs());
            }
        }
        assert!(worst <= 1e-18, "{worst:e} m");
    }
}

/// Signs: a reading grows when the target moves the way of the gauge.
#[test]
fn a_shift_along_a_gauge_is_its_reading_and_a_turn_lifts_the_far_side() {
    let ir = lowered(&model(three_two_one())).unwrap();
    let (gauges, series) = (runtime::<f64>(&ir), series::<f64>(&ir));
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let up = gauges.readings(&series, &[0.0, 0.0, 1e-6, 0.0, 0.0, 0.0]);
    assert!(up.iter().zip([1e-6, 1e-6, 1e-6, 0.0, 0.0, 0.0]).all(|(a, b)| close(*a, b)), "{up:?}");
    // About x by the right hand: +y goes up.
    let roll = gauges.readings(&series, &[0.0, 0.0, 0.0, 1e-6, 0.0, 0.0]);
    assert!(close(roll[1], 0.08 * 0.75_f64.sqrt() * 1e-6) && close(roll[2], -roll[1]), "{roll:?}");
    // About z: the point at +x goes to +y, the one at −x to −y, the one at +y to −x.
    let yaw = gauges.readings(&series, &[0.0, 0.0, 0.0, 0.0, 0.0, 1e-6]);
    assert!(close(yaw[3], 0.08e-6) && close(yaw[4], -0.08e-6) && close(yaw[5], -0.08e-6), "{yaw:?}");
}

/// A comparison of poses by bits sees one last bit in the constant that a coordinate depends on most.
#[test]
fn a_constant_one_ulp_off_gives_another_pose() {
    let model = model(tilted());
    let ir = lowered(&model).unwrap();
    let good = runtime::<f64>(&ir);
    let mut random = Random::new(4);
    let readings: Vec<[f64; 6]> = (0..200).map(|_| exact_readings(&model, &random.pose(&model))).collect();
    let poses = |gauges: &Gauges<f64>| -> Vec<[u64; 6]> {
        readings.iter().map(|readings| gauges.pose(readings).map(f64::to_bits)).collect()
    };
    let expected = poses(&good);
    assert!(poses(&good) == expected);
    for row in 0..6 {
        let largest =
            (0..6).max_by(|a, b| good.inverse[row][*a].abs().total_cmp(&good.inverse[row][*b].abs())).unwrap();
        let mut wrong = good;
        wrong.inverse[row][largest] = f64::from_bits(wrong.inverse[row][largest].to_bits() + 1);
        assert!(poses(&wrong) != expected, "row {row}");
    }
}

#[test]
fn forward_kinematics_undoes_the_inverse_over_the_workspace() {
    let model = model(three_two_one());
    let ir = lowered(&model).unwrap();
    let single = lowered(&with_scalar(model.clone(), Scalar::F32)).unwrap();
    let ((legs64, inverse64), (legs32, inverse32)) = (legs::<f64>(&ir), legs::<f32>(&single));
    let mut random = Random::new(6);
    let (mut worst, mut worst32) = ([0.0_f64; 2], [0.0_f64; 2]);
    for _ in 0..poses() {
        let pose = random.pose(&model);
        let lengths = exact::displacements(&model.geometry, &pose);
        let found = legs64.pose(&inverse64, ir.kinematics.corrections as usize, &lengths);
        let rounded = lengths.map(|length| length as f32);
        let found32 = legs32.pose(&inverse32, single.kinematics.corrections as usize, &rounded);
        for k in 0..6 {
            worst[k / 3] = worse(worst[k / 3], (found[k] - pose[k]).abs());
            worst32[k / 3] = worse(worst32[k / 3], (f64::from(found32[k]) - pose[k]).abs());
        }
    }
    println!("{} corrections: f64 {:.1e} m, {:.1e} rad", ir.kinematics.corrections, worst[0], worst[1]);
    let (corrections, nm, nrad) = (single.kinematics.corrections, worst32[0] * 1e9, worst32[1] * 1e9);
    println!("{corrections} corrections: f32 {nm:.4} nm, {nrad:.4} nrad");
    assert!(worst[0] <= 1e-12 && worst[1] <= 1e-12, "{worst:?}");
    assert!(worst32[0] <= 0.1e-9 && 0.1 * worst32[1] <= 0.1e-9, "{worst32:?}");
}

/// Independent gauges of the declared noise behind a converter of the declared step, through the whole solution.
#[test]
fn predicted_pose_noise_is_what_noisy_gauges_give() {
    // Of as many draws, the spread of an rms: 1.8 % and 0.35 %.
    let (draws, near) = specgen_tests::length((1_500, 0.93..=1.07), (40_000, 0.97..=1.03));
    for layout in [tilted(), three_two_one()].into_iter().take(specgen_tests::length(1, 2)) {
        let mut model = model(layout);
        // A coarse converter, so that its part counts.
        model.sensor.bits = 14;
        let ir = lowered(&model).unwrap();
        let (gauges, (legs, _)) = (runtime::<f64>(&ir), legs::<f64>(&ir));
        let predicted = pose_noise(&model).unwrap().unwrap();
        assert!(predicted.quantisation > 0.5 * model.sensor.noise);
        let step = (model.sensor.range[1] - model.sensor.range[0]) / 2f64.powi(14);
        let mut random = Random::new(8);
        let mut noise: Vec<Gaussian> = (0..6).map(|k| Gaussian::new(model.sensor.noise, 9, k)).collect();
        let (mut of_pose, mut of_leg) = ([0.0_f64; 6], [0.0_f64; 6]);
        for _ in 0..draws {
            let pose = random.pose(&model);
            let mut readings = exact_readings(&model, &pose);
            for (reading, noise) in readings.iter_mut().zip(&mut noise) {
                *reading = ((*reading + noise.draw()) / step).round() * step;
            }
            let found = gauges.pose(&readings);
            let (moved, still) = (legs.displacements(&found), legs.displacements(&pose));
            for k in 0..6 {
                of_pose[k] += (found[k] - pose[k]).powi(2);
                of_leg[k] += (moved[k] - still[k]).powi(2);
            }
        }
        for (seen, predicted) in of_pose.iter().chain(&of_leg).zip(predicted.pose.iter().chain(&predicted.leg)) {
            let ratio = (seen / f64::from(draws)).sqrt() / predicted;
            assert!(near.contains(&ratio), "{ratio}");
        }
    }
}

fn refusal(model: &Model) -> (String, String, String) {
    let findings = lowered(model).unwrap_err();
    let first = &findings[0];
    assert!(!first.help.is_empty());
    (first.code.to_owned(), first.key.clone(), first.message.clone())
}

#[test]
fn gauges_that_cannot_see_a_motion_are_refused_and_the_motion_is_named() {
    // Nothing looks along x.
    let mut layout = three_two_one();
    layout[5] = probe([0.0, 0.08, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
    let (code, _, message) = refusal(&model(layout));
    assert_eq!(code, "E0432", "{message}");
    assert!(message.ends_with("x +1.000 µm"), "{message}");

    // Three lines along z in a row along x: a turn about x is unseen.
    let mut layout = three_two_one();
    for (probe_k, x) in layout.iter_mut().zip([0.08, 0.0, -0.08]) {
        *probe_k = probe([x, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    }
    let (code, _, message) = refusal(&model(layout));
    assert_eq!(code, "E0432", "{message}");
    assert!(message.contains("θx") && !message.contains("θy") && !message.contains(" x "), "{message}");

    // A row 10 mm beside P_C: a turn about it lifts P_C.
    let mut layout = three_two_one();
    for (probe_k, x) in layout.iter_mut().zip([0.08, 0.0, -0.08]) {
        *probe_k = probe([x, 0.01, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    }
    let (_, _, message) = refusal(&model(layout));
    assert!(message.contains("z ") && message.contains("θx"), "{message}");

    // Nearly blind: two lines along y a millimetre apart see a turn about z 80 times worse than at 80 mm.
    let mut layout = three_two_one();
    layout[3] = probe([0.0005, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
    layout[4] = probe([-0.0005, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
    layout[5] = probe([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let (code, _, message) = refusal(&model(layout));
    assert_eq!(code, "E0432", "{message}");
    assert!(message.contains("times worse") && message.contains("θz"), "{message}");
}

#[test]
fn a_gauge_that_misses_the_platform_is_refused() {
    // A plane point in {B} where {P} is due: far above.
    let mut layout = three_two_one();
    layout[4].plane_point = [1.0, 2.0, 0.0];
    layout[4].plane_normal = [0.0, 0.8, 0.6];
    let (code, key, message) = refusal(&model(layout));
    assert_eq!((code.as_str(), key.as_str()), ("E0431", "gauge[4].point"), "{message}");
}

#[test]
fn a_workspace_beyond_the_range_of_the_gauges_or_of_their_equations_is_refused() {
    let mut small = model(three_two_one());
    small.sensor.range = [-45e-6, 45e-6];
    let (code, key, message) = refusal(&small);
    assert_eq!((code.as_str(), key.as_str()), ("E0433", "sensor.range"), "{message}");
    assert!(message.contains("48.000 µm") && message.contains("θ"), "{message}");
    // ±70 µm hold it.
    assert!(lowered(&model(three_two_one())).is_ok());

    let mut large = model(three_two_one());
    large.workspace.rotation = [0.5; 3];
    large.workspace.translation = [1e-3; 3];
    large.sensor.range = [-1.0, 1.0];
    let rules = &mut large.task_space.as_mut().expect("a spec with [control]").setpoint;
    (rules.speed, rules.acceleration, rules.jerk) = ([1.0; 6], [100.0; 6], [1e4; 6]);
    let findings = lowered(&large).unwrap_err();
    assert!(findings.iter().any(|found| found.code == "E0435" || found.code == "E0412"), "{findings:#?}");
}

#[test]
fn calibrated_gauges_take_volts_and_refuse_those_beyond_their_range() {
    let mut model = model(three_two_one());
    // 6 µm/V with some curvature, each gauge its own.
    let polynomials: [Vec<f64>; 6] = std::array::from_fn(|k| {
        let k = k as f64;
        vec![0.1e-6 * k, (6.0 + 0.1 * k) * 1e-6, if k == 5.0 { 0.0 } else { 1e-8 * k }]
    });
    task(&mut model).calibration = Some(polynomials.clone());
    let ir = lowered(&model).unwrap();
    let s = sensing(&ir);
    let coefficients = s.calibration.clone().unwrap().map(|c| <[f64; 3]>::try_from(c).unwrap());
    let calibration = Calibration { coefficients };
    let volts = [-3.0, 2.0, 0.5, -9.0, 8.0, 1.0];
    let readings = calibration.readings(&volts);
    for ((reading, polynomial), volts) in readings.iter().zip(&polynomials).zip(volts) {
        let exact = polynomial[0] + polynomial[1] * volts + polynomial[2] * volts * volts;
        assert!((reading - exact).abs() < 1e-19, "{reading:e} {exact:e}");
    }
    // At the limits the readings are those of sensor.range, and beyond there is a fault.
    for high in [false, true] {
        let at = s.raw_limits.map(|limits| limits[usize::from(high)]);
        let end = model.sensor.range[usize::from(high)];
        assert!(calibration.readings(&at).iter().all(|reading| (reading - end).abs() < 1e-15));
        assert_eq!(specgen_runtime::sensing::faults(&at, &s.raw_limits), 0);
        let beyond = at.map(|volts| volts * 1.000001);
        assert_eq!(specgen_runtime::sensing::faults(&beyond, &s.raw_limits), 0x3f);
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        let mut raw = [0.0; 6];
        raw[3] = bad;
        assert_eq!(specgen_runtime::sensing::faults(&raw, &s.raw_limits), 1 << 3);
    }

    // One that turns within the range.
    task(&mut model).calibration = Some([0; 6].map(|_| vec![0.0, 6e-6, 1e-6]));
    let (code, key, message) = refusal(&model);
    assert_eq!((code.as_str(), key.as_str()), ("E0434", "gauge[0].calibration"), "{message}");
}

/// Whatever accepted readings come, the pose is finite and near what a linear gauge would say.
#[test]
fn every_accepted_reading_gives_a_finite_pose() {
    for (layout, scalar) in [(three_two_one(), Scalar::F64), (tilted(), Scalar::F32)] {
        let model = with_scalar(model(layout), scalar);
        let ir = lowered(&model).unwrap();
        let [low, high] = model.sensor.range;
        let mut random = Random::new(12);
        for _ in 0..specgen_tests::length(1_000, 20_000) {
            let readings: [f64; 6] = std::array::from_fn(|_| {
                let u = random.unit();
                if u > 0.7 {
                    high
                } else if u < -0.7 {
                    low
                } else {
                    0.5 * (low + high) + 0.5 * (high - low) * u
                }
            });
            let pose = match ir.scalar {
                IrScalar::F64 => runtime_pose::<f64>(&ir, &readings),
                IrScalar::F32 => runtime_pose::<f32>(&ir, &readings),
            };
            assert!(pose.iter().all(|value| value.is_finite() && value.abs() < 0.01), "{pose:?}");
        }
    }
}

fn runtime_pose<T: Real>(ir: &Ir, readings: &[f64; 6]) -> [f64; 6] {
    runtime::<T>(ir).pose(&readings.map(|reading| real::<T>(reading))).map(double)
}

#[test]
fn the_rate_filter_has_the_declared_cutoff() {
    let model = model(three_two_one());
    let ir = lowered(&model).unwrap();
    let (keep, gain) = (sensing(&ir).rate_keep, sensing(&ir).rate_gain);
    let (cutoff, period) = (2000.0, model.timing.period);
    assert!((keep - (-cutoff * period).exp()).abs() < 1e-15);
    assert!((gain * period + keep - 1.0).abs() < 1e-15);
    // The pole of an analogue low-pass of that cut-off, sampled.
    assert!((keep.ln() / period + cutoff).abs() < 1e-9);
}
