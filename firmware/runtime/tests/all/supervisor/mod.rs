//! The supervisor: in [`sequences`] against a state machine of its own text; here pieces of it on their own: codes of converters,
//! steps to rest, debounce, approach.

mod oracle;
mod oscillation;
mod sequences;
mod sift;
mod wiring;

use specgen_runtime::GaugeConverter;
use specgen_runtime::supervisor::{Approach, Cause, Debounce, Reaction, Steadiness, Supervision, TIMED, WRONG, toward};

const SUPERVISION: Supervision<f64> = Supervision {
    arm_ticks: 10,
    rest: 0,
    ramp_step: 5,
    ramp_every: 1,
    timeout: [20, 20, 10, 5, 201, 12, 40],
    weight: [WRONG, WRONG, 1, 1, 100, WRONG, 1],
    stuck_motion: 1e-8,
    stuck_samples: 3,
    disagreement: 1e-6,
    disagreement_samples: 3,
    tracking: [1e-6; 6],
    tracking_samples: 3,
    leap: [1.0; 6],
    repeats: 0,
    steadiness: Steadiness {
        per_limit: [0.0; 6],
        follow: 0.2,
        motion: 5.0,
        keep: 0.997,
        keep_fallen: 0.99,
        one_way: 18,
        first: 50,
        next: 167,
    },
    amplifier_fault: Reaction::Off,
    wiring: None,
};

#[test]
fn codes_span_the_range_and_the_ends_are_out_of_it() {
    let step = 110e-6_f64 / 65_536.0;
    let converter = GaugeConverter { at_zero: -55e-6, per_code: step, highest: 65_535, beyond: [-165e-6, 165e-6] };
    for code in [i32::MIN, -1, 0] {
        assert!(converter.reading(code) < -55e-6, "{code}");
    }
    for code in [65_535, 65_536, i32::MAX] {
        assert!(converter.reading(code) > 55e-6, "{code}");
    }
    assert!(converter.reading(32_768).abs() < 1e-18, "the middle is rest");
    for code in 1..65_534 {
        let (here, next) = (converter.reading(code), converter.reading(code + 1));
        assert!((-55e-6..=55e-6).contains(&here) && next > here, "{code}");
    }
}

#[test]
fn a_code_moves_towards_its_goal_by_no_more_than_a_step() {
    for code in [-100, -1, 0, 7, 43_690, i32::MAX, i32::MIN] {
        for goal in [-100, 0, 5, 43_690, i32::MAX] {
            for step in [0, 1, 7, 1747, i32::MAX] {
                let next = toward(code, goal, step);
                let (moved, way) = (i64::from(next) - i64::from(code), i64::from(goal) - i64::from(code));
                assert!(moved.abs() <= i64::from(step) && moved * way >= 0, "{code} {goal} {step}: {next}");
                assert_eq!(moved.abs(), way.abs().min(i64::from(step)), "{code} {goal} {step}");
            }
        }
    }
}

/// Ticks after which a condition that is there as `shows` says becomes a cause.
fn lasts(cause: Cause, shows: impl Fn(u32) -> bool) -> Option<u32> {
    let mut debounce = Debounce::new();
    let mut busy = false;
    (0..2000).find(|tick| {
        let shown = match cause {
            Cause::HostGone => Cause::LinkLost,
            own => own,
        };
        let present = if shows(*tick) { shown.bit() } else { 0 };
        debounce.count(&SUPERVISION, present, &mut busy) & cause.bit() != 0
    })
}

#[test]
fn conditions_become_causes_when_they_have_lasted() {
    let (timeouts, weights) = (SUPERVISION.timeout, SUPERVISION.weight);
    for ((cause, timeout), weight) in TIMED.into_iter().zip(timeouts).zip(weights) {
        if cause != Cause::MissedTick {
            assert_eq!(lasts(cause, |_| true), Some(timeout / weight - 1), "{cause:?}");
            assert_eq!(lasts(cause, |tick| tick % 2 == 0).is_some(), weight == WRONG, "{cause:?}");
            // Two ticks of three: slower, but as sure.
            assert!(lasts(cause, |tick| tick % 3 != 2).is_some(), "{cause:?}");
        }
    }
    // Three within a window of 100 ticks, not three that are further apart.
    assert_eq!(lasts(Cause::MissedTick, |tick| tick % 49 == 0), Some(98));
    assert_eq!(lasts(Cause::MissedTick, |tick| tick % 101 == 0), None);
    for cause in [Cause::LinkLost, Cause::Integrity, Cause::EmergencyStop, Cause::Stalled, Cause::AmplifierFault] {
        assert_eq!(lasts(cause, |_| true), Some(0), "{cause:?}");
    }
}

/// Samples that are missing in every second to fourth tick: in 2.7, 6 and 16 times the time in which a fault that stays is one. Rarer ones
/// never are.
#[test]
fn samples_that_are_missing_time_and_again_are_a_fault_and_rare_ones_are_not() {
    const TICKS: u32 = 100;
    let mut timeout = [u32::MAX; 7];
    for index in [0, 1, 5] {
        timeout[index] = WRONG * TICKS;
    }
    let supervision = Supervision { timeout, ..SUPERVISION };
    for cause in [Cause::GaugeNotFinite, Cause::GaugeRange, Cause::Converter] {
        let lasts = |every: u32| {
            let (mut debounce, mut busy) = (Debounce::new(), false);
            (0..1_000_000).find(|tick| {
                let present = if tick % every == 0 { cause.bit() } else { 0 };
                debounce.count(&supervision, present, &mut busy) & cause.bit() != 0
            })
        };
        assert_eq!(lasts(1), Some(TICKS - 1), "{cause:?}");
        for (every, times) in [(2, 2.7), (3, 6.0), (4, 16.0)] {
            let ticks = lasts(every).expect("a fault");
            assert!(f64::from(ticks) <= times * f64::from(TICKS), "{cause:?}, one in {every}: {ticks}");
        }
        assert_eq!([lasts(5), lasts(6), lasts(50)], [None; 3], "{cause:?}");
    }
}

/// What is counted too much is not remembered longer: two missed ticks, then one when they are forgotten.
#[test]
fn a_count_is_forgotten_as_fast_as_its_patience_lasts() {
    let (mut debounce, mut busy) = (Debounce::new(), false);
    let mut tick = |present: u32| debounce.count(&SUPERVISION, present, &mut busy) & Cause::MissedTick.bit() != 0;
    assert_eq!([1, 1, 1, 1].map(|_| tick(Cause::MissedTick.bit())), [false, false, true, true]);
    for _ in 0..201 {
        assert!(!tick(0));
    }
    assert_eq!([1, 1, 1].map(|_| tick(Cause::MissedTick.bit())), [false, false, true]);
}

/// A way of 1 is halved until a quarter of it would be left, which is none.
#[test]
fn the_last_of_an_approach_is_left_out_and_not_its_last_but_one() {
    let mut approach = Approach::new();
    approach.begin([1.0, -1.0, 0.25, 0.0, 4.0, 1.0]);
    let asked = [2.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    let ways = [
        [1.0, -1.0, 0.25, 0.0, 4.0, 1.0],
        [1.5, -0.5, 0.0, 0.0, 2.0, 0.0],
        [2.0, 0.0, 0.0, 0.0, 1.0, -0.5],
        [2.0, 0.0, 0.0, 0.0, 0.5, -1.0],
        [2.0, 0.0, 0.0, 0.0, 0.0, -1.0],
    ];
    for (tick, way) in ways.into_iter().enumerate() {
        assert!(!approach.is_done() || tick == 4, "tick {tick}");
        assert_eq!(approach.setpoint(&asked, true, 0.5, 0.25), way, "tick {tick}");
    }
    assert!(approach.is_done());
}

#[test]
fn an_approach_begins_where_it_stands_and_ends_where_it_is_asked_to() {
    let (from, asked) = ([1e-6; 6], [21e-6, 1e-6, -5e-6, 0.0, 3e-6, 4e-6]);
    let mut approach = Approach::new();
    assert_eq!(approach.setpoint(&asked, true, 0.9, 1e-13), asked, "without a beginning nothing is changed");
    approach.begin(from);
    let refused = [f64::NAN; 6];
    assert!(approach.setpoint(&refused, false, 0.9, 1e-13)[0].is_nan(), "the law is to see what it refuses");
    let mut last = from;
    for tick in 0..400 {
        let setpoint = approach.setpoint(&asked, true, 0.9, 1e-13);
        for axis in 0..6 {
            if tick == 0 {
                assert!((setpoint[axis] - from[axis]).abs() < 1e-20);
            }
            let (way, left) = (asked[axis] - last[axis], asked[axis] - setpoint[axis]);
            assert!(left.abs() <= way.abs() + 1e-20 && left * way >= 0.0, "tick {tick}: away from the goal");
        }
        last = setpoint;
    }
    assert!(approach.is_done());
    assert_eq!(last, asked);
}
