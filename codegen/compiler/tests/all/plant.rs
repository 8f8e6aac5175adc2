//! Compares the spectral radius with loops on the simulator's own plants: the growth of a kick. Gauges lag in both.
//!
//! The plants have linear stacks: one play without threshold, no creep, no asymmetry.

use std::f64::consts::TAU;

use host_sim::closed_loop::Preparation;
use host_sim::plant::{LegParameters, LegPlant};
use host_sim::platform::{PlatformParameters, PlatformPlant, Specimen};
use specgen_compiler::stability::platform::{ClosedLoop, Conditions, Tuning};
use specgen_compiler::stability::{LegDynamics, spectral_radius};

use super::{EWMA, loop_at};

/// Voltage at rest, V.
const REST: f64 = 50.0;
/// Growth per tick in the test: slowly unstable.
const GROWTH: f64 = 1.003;
/// Ticks of a window, and between the starts of two windows.
const WINDOW: usize = 500;
const APART: usize = 1500;

fn linear_leg(gauge_lag: f64) -> LegParameters {
    let reference = LegParameters::reference();
    LegParameters {
        gauge_lag_s: gauge_lag,
        s2: 0.0,
        kappa: 0.0,
        play_thresholds_v: vec![0.0],
        play_weights: vec![1.0],
        creep_weights: vec![0.0; reference.creep_weights.len()],
        settle_s: 0.01,
        step_s: 1e-6,
        ..reference
    }
}

/// Growth per tick of a signal, from the rms of two windows.
fn growth(mut tick: impl FnMut() -> f64) -> f64 {
    let signal: Vec<f64> = (0..1000 + APART + WINDOW).map(|_| tick()).collect();
    let size = |from: usize| signal[from..from + WINDOW].iter().map(|x| x * x).sum::<f64>().sqrt();
    (size(1000 + APART) / size(1000)).powf(1.0 / APART as f64)
}

/// The weight or bandwidth at which `radius` is [`GROWTH`].
fn at_growth(mut low: f64, mut high: f64, radius: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if radius(middle) < GROWTH { low = middle } else { high = middle }
    }
    low
}

/// As predicted, within a tenth of what the lag makes of it.
fn compare(what: &str, found: f64, without: f64) {
    println!("{what}: {found:.6} a tick, predicted {GROWTH}, without a lag {without:.6}");
    assert!((found - GROWTH).abs() < 0.1 * (without - GROWTH).abs(), "{what}: {found}");
}

#[test]
fn a_leg_grows_by_the_radius_behind_a_gauge_that_lags() {
    for gauge_lag in [15e-6, 0.3e-3] {
        let parameters = linear_leg(gauge_lag);
        let at_once = LegDynamics {
            run: 1e-4,
            lag: parameters.tau_amp_s,
            gauge_lag: 0.0,
            resonance: TAU * parameters.fn_hz,
            damping_ratio: parameters.zeta,
        };
        let dynamics = LegDynamics { gauge_lag, ..at_once };
        for drift_part in [None, Some(0.044)] {
            let radius = |dynamics: &LegDynamics, weight: f64| {
                spectral_radius(dynamics, weight, drift_part.map(|part| part * weight), 1.0)
            };
            let weight = at_growth(1e-2, 1.0, |weight| radius(&dynamics, weight));
            let mut leg = LegPlant::new(&parameters);
            leg.hold(REST, 0.2);
            let rest = leg.seen();
            let gain = parameters.gain_um_per_v * 1e-6;
            let (mut level, mut drift) = (1e-12, 0.0);
            let found = growth(|| {
                let request = -level - drift;
                leg.hold(REST + request / gain, dynamics.run);
                let model_error = leg.seen() - rest - request;
                let old = level;
                level += weight * (model_error - level);
                if let Some(part) = drift_part {
                    drift += part * weight * (model_error - old - drift);
                }
                model_error
            });
            compare(&format!("leg, lag {gauge_lag} s, drift {drift_part:?}"), found, radius(&at_once, weight));
        }
    }
}

/// F with EWMA and no notch, in leg coordinates. Steps of 2.5 µs, and one step a tick as studies take it.
#[test]
fn a_platform_grows_by_the_radius_behind_gauges_that_lag() {
    for (gauge_lag, whole_ticks) in [(15e-6, false), (15e-6, true), (0.3e-3, false)] {
        let leg = linear_leg(gauge_lag);
        // Without gravity, whose moments about the joints the stability check leaves out.
        let nominal =
            PlatformParameters { amplifier_current_a: 1e3, gravity_m_per_s2: 0.0, ..PlatformParameters::reference() };
        let specimen = Specimen::ideal(&nominal, &leg);
        let at_once = ClosedLoop { lag: leg.tau_amp_s, ..loop_at(1e4, 0.02, None) };
        let closed_loop = ClosedLoop { gauge_lag, ..at_once.clone() };
        let radius = |closed_loop: &ClosedLoop, level_bandwidth: f64| {
            let tuning = Tuning { level_bandwidth, ..Tuning::NONE };
            closed_loop.spectral_radius(EWMA, &tuning, &Conditions::NOMINAL)
        };
        let bandwidth = at_growth(10.0, 2e3, |bandwidth| radius(&closed_loop, bandwidth));
        let weight = bandwidth * closed_loop.period;

        let mut plant = PlatformPlant::new(&specimen);
        plant.set_longest_step(2.5e-6);
        plant.prepare(&Preparation { peak: 1.0, rate: 200.0, settle: 0.5, update: 1e-4, rest: REST });
        if whole_ticks {
            plant.step_whole_ticks(closed_loop.period);
        }
        let geometry = nominal.geometry();
        let rest = geometry.extensions(&plant.seen());
        let gain = leg.gain_um_per_v * 1e-6;
        let mut level = [1e-11, -1e-11, 2e-11, 0.0, 1e-11, -2e-11];
        let found = growth(|| {
            plant.hold(&level.map(|estimate| REST - estimate / gain), closed_loop.period);
            let reading = geometry.extensions(&plant.seen());
            for leg in 0..6 {
                // m − δ̂ with m = y + δ̂.
                level[leg] += weight * (reading[leg] - rest[leg]);
            }
            level[0]
        });
        let what = format!("platform, lag {gauge_lag} s, whole ticks {whole_ticks}");
        compare(&what, found, radius(&at_once, bandwidth));
    }
}
