//! The kernels against the host's elementary functions in double precision, and the reduction of turns against exact places.

use crate::common::worse;
use specgen_runtime::Real;
use specgen_runtime::trig::{sine_cosine, sine_cosine_turns, sine_versine, versine};

/// Distance of `value` from `exact` in units of the last place of `exact` in the scalar.
fn ulps(value: f64, exact: f64, epsilon: f64) -> f64 {
    let exponent = exact.abs().log2().floor();
    (value - exact).abs() / (exponent.exp2() * epsilon)
}

#[test]
fn one_unit_in_the_last_place_is_seen_and_so_is_what_is_no_number() {
    for exact in [0.3, -0.6, 1e-5] {
        for units in [1_u64, 2] {
            let next = f64::from_bits(f64::to_bits(exact) + units);
            assert_eq!(ulps(next, exact, f64::EPSILON), units as f64, "{exact}");
        }
    }
    let off = [0.5, ulps(f64::NAN, 0.3, f64::EPSILON), 0.7].into_iter().fold(0.0, worse);
    assert!(off.is_nan() && worse(0.5, 0.7) == 0.7 && worse(0.7, 0.5) == 0.7);
}

#[test]
fn the_kernels_stay_within_one_ulp_of_an_eighth_of_a_turn() {
    let (mut double, mut single) = (0.0_f64, 0.0_f64);
    for k in 1..=400_000 {
        let angle = core::f64::consts::FRAC_PI_4 * f64::from(k) / 400_000.0;
        for angle in [angle, -angle] {
            let (s, c) = sine_cosine::<f64>(angle);
            // The host's functions are themselves within 0.55 ulp.
            double = worse(worse(double, ulps(s, angle.sin(), f64::EPSILON)), ulps(c, angle.cos(), f64::EPSILON));
            let angle = angle as f32;
            let (s, c) = sine_cosine::<f32>(angle);
            let angle = f64::from(angle);
            let epsilon = f64::from(f32::EPSILON);
            single = worse(worse(single, ulps(s.into(), angle.sin(), epsilon)), ulps(c.into(), angle.cos(), epsilon));
        }
    }
    println!("worst: f64 {double:.3} ulp against the host, f32 {single:.3} ulp");
    assert!(double <= 1.0, "{double}");
    assert!(single <= 1.0, "{single}");
}

fn turns_against_the_host<T: Real + Into<f64>>(tolerance: f64) {
    let mut phase = 0x1234_5678_9abc_def0_u64;
    for _ in 0..200_000 {
        phase = phase.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let (s, c) = sine_cosine_turns::<T>(phase);
        // The nearest eighth is taken off in integers, so that the host's argument is as exact as ours.
        let eighths = (phase >> 61) + (phase >> 60 & 1);
        let rest = phase.wrapping_sub(eighths << 61) as i64 as f64 * (core::f64::consts::TAU / 2f64.powi(64));
        let base = eighths as f64 * core::f64::consts::FRAC_PI_4;
        let (sin, cos) =
            (base.sin() * rest.cos() + base.cos() * rest.sin(), base.cos() * rest.cos() - base.sin() * rest.sin());
        let (s, c): (f64, f64) = (s.into(), c.into());
        assert!((s - sin).abs() <= tolerance && (c - cos).abs() <= tolerance, "{phase:#x}: {s} {sin}, {c} {cos}");
    }
}

#[test]
fn turns_agree_with_the_host_over_the_whole_circle() {
    turns_against_the_host::<f64>(8e-16);
    turns_against_the_host::<f32>(1.2e-7);
}

#[test]
fn quarters_of_a_turn_are_exact_and_the_circle_closes() {
    for (quarter, expected) in [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)].into_iter().enumerate() {
        assert_eq!(sine_cosine_turns::<f64>((quarter as u64) << 62), expected);
        assert_eq!(sine_cosine_turns::<f32>((quarter as u64) << 62), (expected.0 as f32, expected.1 as f32));
    }
    let last = sine_cosine_turns::<f64>(u64::MAX);
    assert!(last.0 < 0.0 && last.0 > -1e-18 && last.1 == 1.0, "{last:?}");
}

/// 1 − cos x = 2 sin² (x/2), which loses nothing.
#[test]
fn the_versine_keeps_its_precision_down_to_the_smallest_angles() {
    let (mut double, mut single) = (0.0_f64, 0.0_f64);
    for k in 1..=200_000 {
        let angle = core::f64::consts::FRAC_PI_4 * (f64::from(k) / 200_000.0).powi(2);
        let exact = |angle: f64| 2.0 * (angle / 2.0).sin().powi(2);
        double = worse(double, ulps(versine::<f64>(angle), exact(angle), f64::EPSILON));
        assert_eq!(sine_versine::<f64>(angle), (sine_cosine::<f64>(angle).0, versine::<f64>(-angle)));
        let angle = angle as f32;
        single = worse(single, ulps(versine::<f32>(angle).into(), exact(angle.into()), f32::EPSILON.into()));
    }
    println!("worst: f64 {double:.3} ulp, f32 {single:.3} ulp");
    // The host's own function and square are within 1.6 ulp.
    assert!(double <= 3.0, "{double}");
    assert!(single <= 2.0, "{single}");
}
