//! Appendix B, checked run by run on a static leg Y = λ·ρ̂X + d: steady errors, equivalence of the two forms, anti-windup.

use specgen_runtime::{Estimate, Law};

const LEVEL: f64 = 0.252;
const DRIFT: f64 = 0.011;

/// Error T − Y after `runs` runs with disturbance `d(n)` and demand `t(n)`.
fn error_after(law: Law, gain_ratio: f64, runs: u32, t: impl Fn(f64) -> f64, d: impl Fn(f64) -> f64) -> f64 {
    let mut estimate = Estimate::<f64>::new();
    let mut error = 0.0;
    for n in 0..runs {
        let n = f64::from(n);
        let request = t(n) - estimate.correction();
        let measured = gain_ratio * request + d(n);
        error = t(n) - measured;
        estimate.update(law, LEVEL, DRIFT, measured - request);
    }
    error
}

/// (AII.1)–(AII.3) and (AII.4)–(AII.6) on a leg of another gain; by (AII.15) and (AII.17) a step leaves nothing.
#[test]
fn a_step_disturbance_leaves_no_error() {
    for law in [Law::Ewma, Law::Pcc] {
        for gain_ratio in [0.7, 1.0, 1.3] {
            let error = error_after(law, gain_ratio, 4000, |_| 20e-6, |_| 0.6e-6);
            assert!(error.abs() < 1e-15, "{law:?} {gain_ratio}: {error:e}");
        }
    }
}

/// The limits of (AII.15) and (AII.17) for a ramp.
#[test]
fn a_ramp_disturbance_leaves_slope_over_lambda_omega_under_ewma_and_nothing_under_pcc() {
    let slope = 1e-9;
    for gain_ratio in [0.8, 1.0, 1.25] {
        let ewma = error_after(Law::Ewma, gain_ratio, 6000, |_| 20e-6, |n| slope * n);
        let expected = -slope / (gain_ratio * LEVEL);
        assert!((ewma - expected).abs() < 1e-3 * expected.abs(), "{ewma:e} {expected:e}");
        let pcc = error_after(Law::Pcc, gain_ratio, 6000, |_| 20e-6, |n| slope * n);
        assert!(pcc.abs() < 1e-13, "{pcc:e}");
    }
}

/// (AII.5) and (AII.6) by hand.
#[test]
fn the_drift_estimate_uses_the_old_level() {
    let mut estimate = Estimate { level: 3e-6_f64, drift: 0.5e-6 };
    estimate.update(Law::Pcc, 0.25, 0.5, 5e-6);
    assert_eq!(estimate.level, 0.25 * 5e-6 + 0.75 * 3e-6);
    assert_eq!(estimate.drift, 0.5 * (5e-6 - 3e-6) + 0.5 * 0.5e-6);
}

#[test]
fn the_filter_form_equals_the_integrator_form_while_nothing_saturates() {
    // (AII.7) without φ̂, (AII.9), (AII.10) with e = Y − Ŷ, Ŷ = ρ̂X + δ̂ + φ̂.
    let mut filter = Estimate::<f64>::new();
    let (mut level, mut drift) = (0.0, 0.0);
    for n in 0..500 {
        let t = 20e-6 + 5e-6 * (f64::from(n) * 0.05).sin();
        let d = 0.3e-6 * (f64::from(n) * 0.011).cos();
        let request = t - filter.correction();
        let measured = 0.97 * request + d;
        let e = measured - (request + level + drift);
        filter.update(Law::Pcc, LEVEL, DRIFT, measured - request);
        let old_drift = drift;
        drift += DRIFT * e;
        // PCC's δ̂ in the filter form holds no φ̂: m − δ̂ = e + φ̂, so (AII.9) adds ω1 (e + φ̂_old).
        level += LEVEL * (e + old_drift);
        // (AII.10) written for the filter: ω2 (m − δ̂_old) + (1 − ω2) φ̂ = φ̂ + ω2 e.
        assert!((filter.level - level).abs() < 1e-17 && (filter.drift - drift).abs() < 1e-17, "run {n}");
    }
}

#[test]
fn saturation_does_not_wind_the_estimates_up() {
    let limit = 38e-6;
    let mut estimate = Estimate::<f64>::new();
    for _ in 0..1000 {
        let wanted = 44e-6 - estimate.correction();
        let request = if wanted > limit { limit } else { wanted };
        let measured = request;
        estimate.update(Law::Pcc, LEVEL, DRIFT, measured - request);
    }
    assert_eq!(estimate.correction(), 0.0);
}

#[test]
fn invhys_keeps_no_estimate() {
    let mut estimate = Estimate { level: 1e-6_f64, drift: 1e-6 };
    estimate.update(Law::Invhys, LEVEL, DRIFT, 5e-6);
    assert_eq!(estimate.correction(), 0.0);
}

/// What would grow beyond ±1 stays at the bound of its own sign; a neighbour within it keeps its value.
#[test]
fn an_estimate_beyond_the_bound_is_held_there_with_its_sign() {
    for sign in [1.0, -1.0] {
        let mut six = [Estimate::<f64>::new(); 6];
        Estimate::correct(&mut six, Law::Pcc, 1.0, 0.25, &[8.0 * sign, 8.0 * sign, 1e-6, 0.0, 0.0, 0.0]);
        let found = six.map(|estimate| [estimate.level, estimate.drift]);
        assert_eq!(found[..3], [[sign; 2], [sign; 2], [1e-6, 0.25e-6]]);
        Estimate::correct(&mut six, Law::Ewma, 1.0, 0.0, &[-8.0 * sign; 6]);
        assert!(six.iter().all(|estimate| (estimate.level, estimate.drift) == (-sign, 0.0)), "{six:?}");
    }
}

/// With a filter that turns the innovation's sign and delays it, no weight is stable: the estimates stay finite all the same,
/// leave their neighbours alone, and find the offset when the filter is taken away.
#[test]
fn an_unstable_filter_leaves_the_estimates_finite_and_able_to_recover() {
    let mut six = [Estimate::<f32>::new(); 6];
    let mut delayed = [0.0_f32; 3];
    let mut largest = 0.0_f32;
    for _ in 0..20_000 {
        let innovation = 1e-6 - six[2].correction();
        let mut innovations = six.map(|estimate| 2e-6 - estimate.correction());
        innovations[2] = delayed[0];
        Estimate::correct(&mut six, Law::Pcc, 1.0, 1.0, &innovations);
        delayed = [delayed[1], delayed[2], -innovation];
        let estimate = six[2];
        assert!(estimate.level.is_finite() && estimate.drift.is_finite() && innovation.is_finite());
        largest = if estimate.level.abs() > largest { estimate.level.abs() } else { largest };
    }
    assert!(largest == 1.0, "{largest} m: this filter is not unstable");
    for k in [0, 1, 3, 4, 5] {
        assert!((six[k].correction() - 2e-6).abs() < 1e-9, "{k}: {:?}", six[k]);
    }
    for _ in 0..200 {
        let innovations = six.map(|estimate| 1e-6 - estimate.correction());
        Estimate::correct(&mut six, Law::Ewma, 0.25, 0.0, &innovations);
    }
    assert!(six.iter().all(|estimate| (estimate.level - 1e-6).abs() < 1e-9), "{six:?}");
}
