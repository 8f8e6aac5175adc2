//! The wiring check by itself: words of findings, the regression of a leg's samples, and what is found in responses.

use specgen_runtime::CodeLimits;
use specgen_runtime::supervisor::{
    Cause, Check, Fault, Finding, FindingText, Phase, Request, Response, Supervision, Supervisor, Wiring, explains,
    with,
};

use super::SUPERVISION;

/// Readings per leg displacement of a platform of six upright legs and level gauges: no row or column is alone.
const EXPECTED: Response<f64> = [
    [0.53, 0.09, -0.01, -0.01, 0.09, 0.53],
    [0.09, 0.53, 0.53, 0.09, -0.01, -0.01],
    [-0.01, -0.01, 0.09, 0.53, 0.53, 0.09],
    [-0.81, -0.05, 0.07, -0.07, 0.05, 0.81],
    [-0.35, -0.51, 0.53, -0.53, 0.51, 0.35],
    [0.24, -0.74, 0.73, 0.27, -0.28, -0.22],
];
const TICKS: u32 = 200;
/// Ticks of a fit: a round each, as a whole fit takes longer than a tick has.
const FIT: u32 = 8;

/// A check whose weights are a plain projection on the pulse: of a pulse over its own mean, with no other regressor.
fn wiring() -> Wiring<f64> {
    let turn = |turns: f64| [(std::f64::consts::TAU * turns).cos(), (std::f64::consts::TAU * turns).sin()];
    // Σ (u − 1/2) u = N/8 and Σ (u − 1/2) = 0 for u = (1 − cos θ)/2.
    let weight = 8.0 / f64::from(TICKS);
    Wiring {
        ticks: TICKS,
        height: 400,
        turn: [turn(1.0 / f64::from(TICKS)), [1.0, 0.0]],
        lag: [1.0, 0.0],
        weights: [weight, 0.0, -0.5 * weight, 0.0, 0.0, 0.0],
        per_metre: [1e6; 6],
        gauge_gain: [0.75, 1.33],
        leg_gain: Some([0.7, 1.43]),
        residual: 0.01,
    }
}

fn faults() -> Vec<Finding> {
    let kinds: [fn(u32, Fault) -> Finding; 2] = [Finding::Gauge, Finding::Leg];
    let mut all = Vec::new();
    for kind in kinds {
        for place in 0..6 {
            all.extend(
                [Fault::Inverted, Fault::Dead, Fault::Gain(50), Fault::Gain(200)].map(|fault| kind(place, fault)),
            );
            all.extend((place + 1..6).map(|other| kind(place, Fault::Swapped(other))));
        }
    }
    all
}

fn checked(shown: &Response<f64>, wiring: &Wiring<f64>) -> (Finding, u32) {
    checked_while(shown, wiring, |readings, _| readings)
}

/// Six legs one after the other, each of which moves 0.6 µm times its gain at the pulse; what is found, and ticks. What is `shaken` changes
/// the readings of each tick.
fn checked_while(
    shown: &Response<f64>,
    wiring: &Wiring<f64>,
    shaken: impl Fn([f64; 6], u32) -> [f64; 6],
) -> (Finding, u32) {
    let mut check = Check::new();
    let (mut ticks, mut most) = (0, 0);
    while !check.done {
        assert!(ticks < 3 * (7 * TICKS + 37 * FIT), "it does not end");
        let codes: [i32; 6] = std::array::from_fn(|leg| check.pulse(wiring, leg));
        assert!(codes.iter().filter(|code| **code != 0).count() <= 1, "one leg at a time");
        most = most.max(codes.iter().map(|code| code.abs()).max().unwrap_or(0));
        // An offset of each gauge is not its business.
        let readings = shown.map(|row| {
            row.iter().zip(codes).map(|(part, code)| part * 0.6e-6 * f64::from(code) / 400.0).sum::<f64>() + 3e-6
        });
        check.tick(wiring, &EXPECTED, &shaken(readings, ticks), ticks);
        ticks += 1;
    }
    assert_eq!(most, wiring.height.abs());
    (Finding::of_word(check.finding), ticks)
}

#[test]
fn every_finding_is_its_word_and_says_what_it_is() {
    let mut all = faults();
    all.extend([Finding::None, Finding::Nothing, Finding::Unexplained, Finding::NoRoom]);
    all.extend([Finding::Inverted, Finding::TooSlow]);
    all.extend([0, 20, 500, 2000].map(Finding::Common));
    all.extend([0, 48, 99, 1999, 2000].map(|gain| Finding::Leg(5, Fault::Gain(gain))));
    for finding in &all {
        assert!(finding.word() < 1 << Finding::BITS, "{finding}");
        assert_eq!(Finding::of_word(finding.word()), *finding);
    }
    for (place, one) in all.iter().enumerate() {
        assert!(all[..place].iter().all(|other| other.word() != one.word() || other == one), "{one}");
    }
    for word in 0..1 << Finding::BITS {
        let back = Finding::of_word(word).word();
        assert!(back == word || Finding::of_word(word) == Finding::Unexplained, "{word}");
    }
    assert_eq!(Finding::Leg(1, Fault::Gain(5000)).word(), Finding::Leg(1, Fault::Gain(2000)).word());
    assert_eq!(Finding::Gauge(3, Fault::Inverted).to_string(), "gauge 3 inverted");
    assert_eq!(Finding::Leg(0, Fault::Swapped(4)).to_string(), "leg 0 swapped with leg 4");
    assert_eq!(Finding::Gauge(2, Fault::Gain(48)).to_string(), "gauge 2 gain × 0.48");
    assert_eq!(Finding::None.to_string(), "");
}

#[test]
fn a_finding_is_named_with_what_looks_like_it() {
    let word = |finding: Finding| finding.word();
    let inverted = [Finding::Gauge(1, Fault::Inverted), Finding::Leg(1, Fault::Inverted)];
    let half = [Finding::Gauge(1, Fault::Gain(50)), Finding::Leg(1, Fault::Gain(50))];
    let twice = [Finding::Gauge(1, Fault::Gain(200)), Finding::Leg(1, Fault::Gain(200))];
    let alike = [inverted, half, twice].map(|set| set.map(word));
    let named = |finding| FindingText(finding, &alike).to_string();
    assert_eq!(named(inverted[1]), "leg 1 inverted, or gauge 1 inverted");
    assert_eq!(named(Finding::Leg(1, Fault::Gain(48))), "leg 1 gain × 0.48, or gauge 1 gain × 0.48");
    assert_eq!(named(Finding::Gauge(1, Fault::Gain(190))), "gauge 1 gain × 1.90, or leg 1 gain × 1.90");
    assert_eq!(named(Finding::Leg(2, Fault::Inverted)), "leg 2 inverted");
}

#[test]
fn a_good_machine_passes_and_the_pulse_may_go_down() {
    // 0.36 to 1.32 of the spec's gain.
    for gain in [0.6, 1.0, 2.2] {
        let shown = EXPECTED.map(|row| row.map(|entry| gain * entry));
        let (found, ticks) = checked(&shown, &wiring());
        assert_eq!((found, ticks), (Finding::None, 6 * TICKS + FIT), "gain {gain}");
    }
    let down = Wiring { height: -400, per_metre: [-1e6; 6], ..wiring() };
    assert_eq!(checked(&EXPECTED, &down).0, Finding::None);
}

#[test]
fn every_single_fault_is_named() {
    for fault in faults() {
        let shown = with(&EXPECTED, fault).map(|row| row.map(|entry| 0.6 * entry));
        let (found, ticks) = checked(&shown, &wiring());
        match (found, fault) {
            (Finding::Gauge(a, Fault::Gain(found)), Finding::Gauge(b, Fault::Gain(made)))
            | (Finding::Leg(a, Fault::Gain(found)), Finding::Leg(b, Fault::Gain(made))) => {
                let ratio = f64::from(found) / f64::from(made);
                assert!(a == b && (0.85..1.15).contains(&ratio), "{fault}: × {found}");
            }
            (found, fault) => assert_eq!(found, fault),
        }
        assert!(ticks <= 6 * TICKS + 37 * FIT, "{fault}: {ticks}");
    }
}

#[test]
fn what_no_single_fault_explains_is_not_explained_away() {
    let exchanged = with(&with(&EXPECTED, Finding::Leg(0, Fault::Swapped(3))), Finding::Gauge(1, Fault::Swapped(4)));
    let (found, ticks) = checked(&exchanged, &wiring());
    assert_eq!(found, Finding::Unexplained);
    // Three checks, with pauses of a quarter and a half of a pulse between them.
    assert_eq!(ticks, 3 * (6 * TICKS + 37 * FIT) + TICKS / 4 + TICKS / 2);
    assert_eq!(checked(&[[0.0; 6]; 6], &wiring()).0, Finding::Nothing);
}

#[test]
fn what_all_gauges_or_all_legs_have_in_common_is_named() {
    // As a gain over that of the spec, where `checked` has legs of 0.6.
    let scaled = |gain: f64| checked(&EXPECTED.map(|row| row.map(|entry| gain / 0.6 * entry)), &wiring()).0;
    assert_eq!((scaled(-0.6), scaled(-5.0)), (Finding::Inverted, Finding::Inverted));
    assert_eq!(Finding::Inverted.to_string(), "all gauges or all legs inverted");
    assert_eq!((scaled(3.0), scaled(0.3)), (Finding::Common(300), Finding::Common(30)));
    assert_eq!(Finding::Common(305).to_string(), "all legs or all gauges gain × 3.05");
}

/// A machine without a fault whose table swings: it is checked again, and no gauge or leg is blamed.
#[test]
fn vibration_that_ends_refuses_no_good_machine_and_blames_no_gauge() {
    let whole = 6 * TICKS + 37 * FIT;
    for of_pulse in [0.6, 0.8, 1.1, 1.4] {
        let turn = std::f64::consts::TAU * of_pulse / f64::from(TICKS);
        let shaken = |until: u32| {
            checked_while(&EXPECTED, &wiring(), move |readings, tick| {
                let by = if tick < until { 500e-9 * (turn * f64::from(tick)).sin() } else { 0.0 };
                std::array::from_fn(|gauge| readings[gauge] + by * [1.0, -1.0, 0.3][gauge % 3])
            })
        };
        assert_eq!(shaken(u32::MAX).0, Finding::Unexplained, "{of_pulse}");
        let (found, ticks) = shaken(whole);
        assert_eq!((found, ticks), (Finding::None, whole + TICKS / 4 + 6 * TICKS + FIT), "{of_pulse}");
    }
}

/// In the middle of a pulse, or before the first: the machine ramps down, and the leg goes nowhere but to rest.
#[test]
fn a_hold_while_arming_ends_the_check_at_once() {
    let supervision = Supervision { wiring: Some(wiring()), arm_ticks: 10, ..SUPERVISION };
    let limits = CodeLimits { min: -1000, max: 1000, max_step: 100 };
    for stop in [Request::Hold, Request::RampDown] {
        for after in [3, 10 + TICKS / 2, 10 + 5 * TICKS + TICKS / 3] {
            let mut supervisor = Supervisor::<f64>::new();
            supervisor.decide(&supervision, Request::Arm, 0, true);
            for _ in 0..after {
                assert_eq!(supervisor.phase, Phase::Arming);
                supervisor.decide(&supervision, Request::Arm, 0, false);
                supervisor.check(&supervision, &EXPECTED, &[0.0; 6], limits);
            }
            supervisor.decide(&supervision, stop, 0, false);
            assert_eq!((supervisor.phase, supervisor.cause), (Phase::RampingDown, Cause::None), "{stop:?} {after}");
            assert!((0..6).all(|leg| supervisor.goal(&supervision, leg) == supervision.rest));
            supervisor.decide(&supervision, stop, 0, true);
            assert_eq!(supervisor.phase, Phase::Disarmed);
        }
    }
}

/// Codes that may change by 1 a tick cannot follow a pulse of π · 400 / 200 codes a tick.
#[test]
fn settings_that_cannot_follow_the_pulse_are_refused_by_name() {
    let supervision = Supervision { wiring: Some(wiring()), arm_ticks: 1, ..SUPERVISION };
    for (max_step, max, expected) in
        [(6, 1000, Finding::TooSlow), (7, 1000, Finding::None), (100, 300, Finding::NoRoom)]
    {
        let mut supervisor = Supervisor::<f64>::new();
        for _ in 0..3 {
            supervisor.decide(&supervision, Request::Arm, 0, true);
            supervisor.check(&supervision, &EXPECTED, &[0.0; 6], CodeLimits { min: -1000, max, max_step });
        }
        assert_eq!(Finding::of_word(supervisor.check.finding), expected, "{max_step}");
        assert_eq!(supervisor.phase == Phase::RampingDown, expected != Finding::None);
    }
}

#[test]
fn gains_at_the_bounds_pass_and_beyond_do_not() {
    let gauge = |gain: u32| with(&EXPECTED, Finding::Gauge(2, Fault::Gain(gain)));
    let leg = |gain: u32| with(&EXPECTED, Finding::Leg(4, Fault::Gain(gain)));
    for good in [gauge(78), gauge(128), leg(72), leg(140)] {
        assert!(explains(&wiring(), &EXPECTED, &good));
    }
    for bad in [gauge(60), gauge(160), leg(66), leg(150)] {
        assert!(!explains(&wiring(), &EXPECTED, &bad));
    }
    // Legs of different makes: their gains are not tested, all else is.
    let untested = Wiring { leg_gain: None, ..wiring() };
    assert!(explains(&untested, &EXPECTED, &leg(50)) && explains(&untested, &EXPECTED, &leg(200)));
    assert!(!explains(&untested, &EXPECTED, &gauge(50)));
    assert_eq!(checked(&with(&EXPECTED, Finding::Leg(4, Fault::Dead)), &untested).0, Finding::Leg(4, Fault::Dead));
}

/// The same fit in 32 bits finds the same.
#[test]
fn f32_finds_what_f64_finds() {
    let expected = EXPECTED.map(|row| row.map(|entry| entry as f32));
    let w = wiring();
    let narrow = |values: [f64; 2]| values.map(|value| value as f32);
    let single = Wiring {
        ticks: w.ticks,
        height: w.height,
        turn: w.turn.map(narrow),
        lag: narrow(w.lag),
        weights: w.weights.map(|value| value as f32),
        per_metre: w.per_metre.map(|value| value as f32),
        gauge_gain: narrow(w.gauge_gain),
        leg_gain: w.leg_gain.map(narrow),
        residual: w.residual as f32,
    };
    for fault in faults() {
        let shown = with(&expected, fault);
        let mut check: Check<f32> = Check { leg: 6, response: shown, ..Check::new() };
        while !check.done {
            check.tick(&single, &expected, &[0.0; 6], 0);
        }
        let mut wide: Check<f64> = Check { leg: 6, response: with(&EXPECTED, fault), ..Check::new() };
        while !wide.done {
            wide.tick(&w, &EXPECTED, &[0.0; 6], 0);
        }
        assert_eq!(check.finding, wide.finding, "{fault}");
    }
}
