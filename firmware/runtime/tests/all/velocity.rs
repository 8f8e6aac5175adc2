//! The rate filter against its transfer function.

use std::f64::consts::{PI, TAU};

use specgen_runtime::{Rate, RateFilter};

const PERIOD: f64 = 1e-4;

fn filter(cutoff: f64) -> RateFilter<f64> {
    let keep = (-cutoff * PERIOD).exp();
    RateFilter { keep, gain: (1.0 - keep) / PERIOD }
}

#[test]
fn a_ramp_gives_its_slope_once_the_start_has_died_away() {
    let slopes = [1e-3, -2e-4, 3.0, 0.0, -0.5, 7e-2];
    for cutoff in [100.0, 2000.0, 2.5e4] {
        let filter = filter(cutoff);
        let mut rate = Rate::new();
        // 40 time constants: e⁻⁴⁰ is below the last bit.
        let ticks = (40.0 / (cutoff * PERIOD)).ceil() as u32 + 2;
        for n in 0..ticks {
            rate.update(&filter, &slopes.map(|slope| 1e-5 + slope * f64::from(n) * PERIOD));
        }
        for (rate, slope) in rate.value().iter().zip(slopes) {
            // Differences of numbers of that size, over a period, lose as many bits.
            let lost = (1e-5 + slope.abs() * f64::from(ticks) * PERIOD) * f64::EPSILON / PERIOD;
            assert!((rate - slope).abs() <= 4.0 * lost + 1e-15 * slope.abs(), "{rate} {slope} at {cutoff}");
        }
    }
}

/// V(z)/H(z) = (α/T)(1 − z⁻¹)/(1 − (1 − α) z⁻¹) at z = e^{jωT}: gain and phase.
fn response(filter: &RateFilter<f64>, angular: f64) -> (f64, f64) {
    let turn = angular * PERIOD;
    let (re, im) = (1.0 - turn.cos(), turn.sin());
    let (below_re, below_im) = (1.0 - filter.keep * turn.cos(), filter.keep * turn.sin());
    let gain = filter.gain * (re * re + im * im).sqrt() / (below_re * below_re + below_im * below_im).sqrt();
    (gain, im.atan2(re) - below_im.atan2(below_re))
}

#[test]
fn sines_have_the_gain_and_the_phase_of_the_transfer_function() {
    for cutoff in [300.0, 2000.0, 2e4] {
        let filter = filter(cutoff);
        // Whole numbers of periods over the 2000 ticks that are looked at.
        for cycles in [2.0, 40.0, 300.0, 900.0] {
            let angular = TAU * cycles / (2000.0 * PERIOD);
            let mut rate = Rate::new();
            let (mut with_sine, mut with_cosine) = (0.0, 0.0);
            for n in 0..6000_u32 {
                let phase = angular * f64::from(n) * PERIOD;
                rate.update(&filter, &[phase.sin(); 6]);
                if n >= 4000 {
                    with_sine += rate.value()[3] * phase.sin() / 1000.0;
                    with_cosine += rate.value()[3] * phase.cos() / 1000.0;
                }
            }
            let (gain, phase) = response(&filter, angular);
            let seen = (with_sine.powi(2) + with_cosine.powi(2)).sqrt();
            let late = with_cosine.atan2(with_sine) - phase;
            assert!((seen / gain - 1.0).abs() < 1e-9, "{seen} {gain}");
            assert!((late - TAU * (late / TAU).round()).abs() < 1e-9, "{late}");
        }
        // What the documentation says: the delay of slow sines, and −3 dB (less the difference's own droop) at the cut-off.
        let (_, phase) = response(&filter, 1e-3 * cutoff);
        let delay = (PI / 2.0 - phase) / (1e-3 * cutoff);
        let alpha = 1.0 - filter.keep;
        assert!((delay / (PERIOD / 2.0 + filter.keep * PERIOD / alpha) - 1.0).abs() < 1e-5, "{delay}");
    }
}

#[test]
fn white_noise_becomes_what_the_documentation_says() {
    let filter = filter(2000.0);
    let alpha = filter.gain * PERIOD;
    let mut state = 5_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut rate = Rate::new();
    let mut square = 0.0;
    let draws = 400_000;
    for n in 0..draws + 1000 {
        rate.update(&filter, &[unit(); 6]);
        square += if n < 1000 { 0.0 } else { rate.value()[0].powi(2) };
    }
    // Even in −1..1: σ = 1/√3.
    let seen = (square / f64::from(draws)).sqrt();
    let predicted = (1.0f64 / 3.0).sqrt() * alpha / PERIOD * (2.0 / (2.0 - alpha)).sqrt();
    assert!((seen / predicted - 1.0).abs() < 0.01, "{seen} {predicted}");
}

#[test]
fn a_gap_dies_away_and_its_jump_is_no_rate() {
    let filter = filter(2000.0);
    let mut rate = Rate::<f64>::new();
    // The first pose is wherever the platform happens to be.
    rate.update(&filter, &[1.0; 6]);
    assert_eq!(rate.value(), &[0.0; 6]);
    for n in 0..1000_u32 {
        rate.update(&filter, &[1.0 + 0.1 * f64::from(n) * PERIOD; 6]);
    }
    let before = rate.value()[0];
    assert!((before - 0.1).abs() < 1e-9);
    for _ in 0..10 {
        rate.coast(&filter);
    }
    assert!((rate.value()[0] / before - (-2000.0 * 10.0 * PERIOD).exp()).abs() < 1e-12);
    let after = rate.value()[0];
    rate.update(&filter, &[5.0; 6]);
    assert_eq!(rate.value()[0], filter.keep * after);
    rate.update(&filter, &[5.0; 6]);
    assert!(rate.value()[0] < after);
}

#[test]
fn at_rest_nothing_is_remembered() {
    let filter = filter(2000.0);
    let mut rate = Rate::<f64>::new();
    for pose in [1.0, 1.1, 1.3] {
        rate.update(&filter, &[pose; 6]);
    }
    assert!(rate.value()[0] > 0.0);
    rate.rest();
    assert_eq!(rate.value(), &[0.0; 6]);
    // The next pose is a first one.
    rate.update(&filter, &[9.0; 6]);
    assert_eq!(rate.value(), &[0.0; 6]);
}
