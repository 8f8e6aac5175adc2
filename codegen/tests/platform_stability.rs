//! Design and stability of the platform loop against the study's figures, and against a simulation that shares nothing
//! with it.

#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

mod platform;

use std::f64::consts::TAU;

use platform::{model, rest};
use specgen::stability::platform::{
    Adapting, ClosedLoop, Conditions, Law, Tuning, bandwidth_limit, closed_loop_of, describe, design,
};

/// First crossing of radius 1 along a factor, by a scan and bisection of its own.
fn limit(low: f64, high: f64, radius: impl Fn(f64) -> f64) -> f64 {
    let mut good = low;
    while good < high {
        let next = good * 1.05;
        if radius(next) >= 1.0 {
            let (mut good, mut bad) = (good, next);
            for _ in 0..20 {
                let middle = 0.5 * (good + bad);
                if radius(middle) < 1.0 { good = middle } else { bad = middle }
            }
            return good;
        }
        good = next;
    }
    high
}

fn loop_at(rate: f64, damping: f64, notch: Option<f64>) -> ClosedLoop {
    let (mut model, mut task) = model();
    model.timing.period = 1.0 / rate;
    task.modal_damping = damping;
    task.notch_damping = notch;
    closed_loop_of(&model, &task, &rest()).unwrap()
}

fn base(rule: [f64; 4]) -> (Tuning, ClosedLoop) {
    let closed_loop = loop_at(10_000.0, 0.02, if rule[0] > 0.01 { Some(1.0) } else { None });
    let [kp, ki, level, drift] = rule;
    let tuning = Tuning {
        proportional: closed_loop.basis.axis_stiffness.map(|k| kp * k),
        integral: closed_loop.basis.axis_stiffness.map(|k| ki * k),
        derivative: [0.0; 6],
        level_bandwidth: level,
        drift_bandwidth: drift,
    };
    (tuning, closed_loop)
}

#[test]
fn explore() {
    for (rate, damping, notch) in [
        (1e3, 0.02, None),
        (2e3, 0.02, None),
        (5e3, 0.02, None),
        (1e4, 0.02, None),
        (2e4, 0.02, None),
        (1e3, 0.05, None),
        (1e4, 0.05, None),
        (2e3, 0.02, Some(0.5)),
        (5e3, 0.02, Some(0.5)),
        (1e4, 0.02, Some(0.5)),
        (2e4, 0.02, Some(0.5)),
        (2e3, 0.02, Some(1.0)),
        (5e3, 0.02, Some(1.0)),
        (1e4, 0.02, Some(1.0)),
        (2e4, 0.02, Some(1.0)),
    ] {
        let l = loop_at(rate, damping, notch);
        let o = bandwidth_limit(&l);
        let pcc = limit(1e-3 * rate, rate, |w| {
            l.spectral_radius(
                Law::Feedforward(Adapting::Pcc),
                &Tuning { level_bandwidth: w, drift_bandwidth: 0.044 * w, ..Tuning::NONE },
                &Conditions::NOMINAL,
            )
        });
        println!("{rate} {damping} {notch:?}: ewma {o:.1} {:.4} pcc {:.4}", o / rate, pcc / rate);
    }
    for (name, rule) in [
        ("U", [0.005, 20.0, 40.0, 1.75]),
        ("N", [0.05, 150.0, 450.0, 19.6]),
        ("PN", [0.056, 1007.0, 0.0, 0.0]),
        ("PU", [0.002, 41.0, 0.0, 0.0]),
    ] {
        let (t, l) = base(rule);
        let law = if name.starts_with('P') { Law::Position } else { Law::Combined(Adapting::Pcc) };
        let lam =
            limit(1.0, 10.0, |g| l.spectral_radius(law, &t, &Conditions { gain_ratio: g, ..Conditions::NOMINAL }));
        let gain = limit(1.0, 10.0, |g| l.spectral_radius(law, &t.scaled(g, g), &Conditions::NOMINAL));
        let lam1 = limit(1.0, 10.0, |g| {
            l.spectral_radius(law, &t, &Conditions { gain_ratio: g, delay: 1.0, ..Conditions::NOMINAL })
        });
        let gain1 = limit(1.0, 10.0, |g| {
            l.spectral_radius(law, &t.scaled(g, g), &Conditions { delay: 1.0, ..Conditions::NOMINAL })
        });
        let up = limit(1.0, 10.0, |g| l.spectral_radius(law, &t, &Conditions { stiffness: g, ..Conditions::NOMINAL }));
        let down =
            limit(1.0, 10.0, |g| l.spectral_radius(law, &t, &Conditions { stiffness: 1.0 / g, ..Conditions::NOMINAL }));
        println!(
            "{name}: λ {lam:.3} gain {gain:.3}; delayed λ {lam1:.3} gain {gain1:.3}; k_a {:.3} to {up:.3}",
            1.0 / down
        );
    }
    let (m, t) = model();
    let start = std::time::Instant::now();
    let d = design(&m, &t, &rest()).unwrap();
    println!("{:?}\n{}", start.elapsed(), describe(&d));
    println!("{:?}", d.modes.map(|m| m.shape));
    println!("Ω/4.5 {} ; factor {}", d.bandwidth_limit / 4.5, d.combined.level_bandwidth / d.bandwidth_limit * 4.5);
    let _ = TAU;
}
