//! Every cause in every phase: what it does, after how long, and how the machine is armed again.

use super::bench::*;
use specgen_runtime::supervisor::Reaction;
use specgen_tests::Emitted;
use std::collections::BTreeMap;

const NAMES: [&str; 19] = [
    "none",
    "gauge not finite",
    "gauge range",
    "gauge stuck",
    "gauge disagreement",
    "tracking error",
    "voltage saturation",
    "slew saturation",
    "missed tick",
    "link lost",
    "integrity",
    "converter",
    "emergency stop",
    "host gone",
    "wiring",
    "stalled",
    "",
    "amplifier fault",
    "end of the workspace",
];

/// What is wrong from now on, tick by tick, for one cause.
fn inject(bench: &mut Bench, cause: u8, tick: u32, request: u64) -> u8 {
    let gauge = bench.gauges() + 2;
    match cause {
        1 => {
            bench.prepare(request, 0);
            bench.input[gauge] = bench.scalar.encode(f64::NAN);
        }
        2 => {
            bench.prepare(request, 0);
            bench.input[gauge] = bench.scalar.encode(1e-3);
        }
        3 => {
            // The platform goes to another pose, or the legs to other displacements; gauge 2 does not follow.
            bench.frozen[2] = true;
            bench.setpoint = match bench.kind {
                Kind::Legs => [17e-6; 6],
                Kind::Platform => [0.0, 0.0, 2e-6, 0.0, 0.0, 0.0],
            };
            bench.prepare(request, 0);
        }
        4 => {
            bench.offset[2] = 25e-6;
            bench.prepare(request, 0);
        }
        5 => {
            // Without feedback and adaptation, what one gauge shows beside the truth stays.
            bench.offset[5] = 10e-6;
            bench.prepare(request, 0);
        }
        6 => {
            // Below rest: no voltage reaches that.
            bench.setpoint = match bench.kind {
                Kind::Legs => [-3e-6; 6],
                Kind::Platform => [0.0, 0.0, -14e-6, 0.0, 0.0, 0.0],
            };
            bench.prepare(request, 0);
        }
        7 => {
            // To and fro faster than the slew rate goes.
            let up = tick.is_multiple_of(2);
            bench.setpoint = [if up { 38e-6 } else { 2e-6 }; 6];
            bench.prepare(request, 0);
        }
        8 => bench.prepare(request, 1),
        9 => bench.prepare(request, 2),
        10 => bench.prepare(request, 4),
        11 => bench.prepare(request, 8),
        12 => bench.prepare(request, 16),
        AMPLIFIER_FAULT => bench.prepare(request, AMPLIFIER),
        _ => bench.prepare(request, STALLED),
    }
    bench.step().phase
}

/// Where a cause leads from a phase, and the cause that is shown then; `None` if it changes nothing.
/// `amplifier`: what the spec says of a fault of an amplifier.
fn expected(cause: u8, phase: u8, amplifier: Reaction) -> Option<(u8, u8)> {
    let amplifier = (cause == AMPLIFIER_FAULT).then_some(amplifier);
    let off = matches!(cause, 10 | 12) || amplifier == Some(Reaction::Off);
    let ramp = matches!(cause, 1..=4 | 11 | 15) || amplifier == Some(Reaction::RampDown);
    match phase {
        // Disarmed machines do not mind gauges, links or amplifiers: they only refuse to arm.
        DISARMED => (off && amplifier.is_none()).then_some((FAULTED, cause)),
        FAULTED => None,
        // From the first cause on: another one does not hide it.
        RAMPING => Some((FAULTED, cause)),
        // Nothing of it is seen: arming ends as it should.
        ARMING if matches!(cause, 3 | 5 | 6 | 7) => Some((HOLDING, 0)),
        HOLDING if matches!(cause, 3 | 5 | 6 | 7) => None,
        ARMING => Some((FAULTED, cause)),
        HOLDING | RUNNING if off => Some((FAULTED, cause)),
        _ if ramp => Some((FAULTED, cause)),
        // It holds, and once nobody is waited for any more it ramps down.
        _ if cause == 9 => Some((FAULTED, 13)),
        _ => Some((HOLDING, cause)),
    }
}

/// What can be wrong with this kind in this phase by these means.
fn applies(kind: Kind, cause: u8, phase: u8) -> bool {
    // A generator of set-points never asks for more than the slew rate.
    let slew = cause == 7 && kind == Kind::Platform;
    // Set-points and gauges against the model say nothing where the law does not run or the codes move.
    let of_the_law = matches!(cause, 3 | 5 | 6 | 7);
    let watched = of_the_law || cause == 4;
    !(slew || watched && matches!(phase, DISARMED | RAMPING | FAULTED))
}

/// In the short run each pair is tried with one of the kinds.
fn is_of_the_other(kind: Kind, cause: u8, phase: u8) -> bool {
    let both = [Kind::Legs, Kind::Platform].iter().all(|kind| applies(*kind, cause, phase));
    both && (cause + phase).is_multiple_of(2) != (kind == Kind::Legs)
}

fn table(kind: Kind) {
    let emitted = emitted(&format!("supervisor-table-{kind:?}").to_lowercase(), kind.spec(), &[]);
    rows(kind, &emitted, (1..=12_u8).chain([15, AMPLIFIER_FAULT]), specgen_tests::length(false, true));
}

fn rows(kind: Kind, emitted: &Emitted, causes: impl IntoIterator<Item = u8>, is_whole: bool) {
    let amplifier = emitted.compiled.ir.supervision.amplifier_fault;
    let mut reached: BTreeMap<&str, String> = BTreeMap::new();
    // Many cases begin alike: each phase is come to once in each mode.
    let mut begun: BTreeMap<(u64, u8), Bench> = BTreeMap::new();
    for cause in causes {
        for phase in [DISARMED, ARMING, RUNNING, HOLDING, RAMPING, FAULTED] {
            if !applies(kind, cause, phase) || !is_whole && is_of_the_other(kind, cause, phase) {
                continue;
            }
            // What the law would learn or feed back hides an error of tracking: there it does neither.
            let mode = match (kind, cause) {
                (Kind::Legs, 5..=7) => 0.0,
                (Kind::Platform, 5) => 1.0,
                (Kind::Legs, _) => 2.0,
                (Kind::Platform, _) => 6.0,
            };
            let come = || {
                let mut settings = vec![("mode", mode)];
                if kind == Kind::Legs {
                    settings.push(("setpoint_kind", 1.0));
                }
                let mut bench = Bench::new(kind, emitted, &settings);
                bench.bring_to(phase);
                bench
            };
            let mut bench = begun.entry((mode.to_bits(), phase)).or_insert_with(come).fork();
            let request = match phase {
                RUNNING => RUN,
                RAMPING => RAMP_DOWN,
                _ => NOTHING,
            };
            let before = (bench.word.phase, bench.word.cause);
            let (mut first, mut ended) = (None, before.0);
            // A set-point out of reach is gone to at the speed of the platform.
            let ticks = if cause == 6 { 3000 } else { specgen_tests::length(800, 3000) };
            for tick in 0..ticks {
                ended = inject(&mut bench, cause, tick, request);
                if first.is_none() && (bench.word.phase, bench.word.cause) != before {
                    first = Some(tick);
                }
            }
            let what = format!("{kind:?}: {} in phase {phase}", NAMES[usize::from(cause)]);
            match expected(cause, phase, amplifier) {
                None => assert_eq!((ended, bench.word.cause), before, "{what}"),
                Some(expected) => assert_eq!((ended, bench.word.cause), expected, "{what}"),
            }
            if phase == RUNNING {
                reached.insert(NAMES[usize::from(cause)], format!("{first:?}"));
                at_once_or_later(cause, first, kind, &what);
            }
            recovers(&mut bench, &what);
        }
    }
    println!("{kind:?}, {amplifier:?}: ticks from the fault to what it does: {reached:?}");
}

/// Times of [`super::bench`]'s section in ticks.
fn at_once_or_later(cause: u8, first: Option<u32>, kind: Kind, what: &str) {
    let first = first.unwrap_or_else(|| panic!("{what}: nothing happened"));
    let per_ms = if kind == Kind::Legs { 5 } else { 10 };
    match cause {
        // As many ticks as declared, and the one that the law needs to see it.
        1 | 2 => assert_eq!(first, per_ms, "{what}"),
        // 3.6 ms of samples, from the first one of its channel on.
        4 => assert!((per_ms * 36 / 10 - 11..=per_ms * 36 / 10 + 12).contains(&first), "{what}: {first}"),
        9 | 10 | 12 | 15 | AMPLIFIER_FAULT => assert_eq!(first, 0, "{what}"),
        8 => assert_eq!(first, 1, "{what}"),
        11 => assert_eq!(first, per_ms - 1, "{what}"),
        _ => assert!(first >= per_ms, "{what}: {first} is no debounce"),
    }
}

/// Once the cause is gone, the machine is armed again by acknowledging, arming, running; not by what stays from before.
fn recovers(bench: &mut Bench, what: &str) {
    bench.offset = [0.0; 6];
    bench.frozen = [false; 6];
    bench.setpoint = match bench.kind {
        Kind::Legs => [15e-6; 6],
        Kind::Platform => [0.0; 6],
    };
    let stays = bench.word;
    if stays.phase == FAULTED {
        for request in [RUN, ARM, HOLD, RAMP_DOWN, NOTHING] {
            for _ in 0..50 {
                assert_eq!(bench.tick(request, 0), stays, "{what}: request {request} must not leave a fault");
            }
        }
        // Not while a condition is there.
        for _ in 0..50 {
            assert_eq!(bench.tick(ACKNOWLEDGE, 2).phase, FAULTED, "{what}: acknowledged with the link lost");
        }
        assert_eq!(bench.tick(ACKNOWLEDGE, 0).phase, FAULTED, "{what}: a request from before is no acknowledgement");
        bench.tick(NOTHING, 0);
        assert_eq!(bench.tick(ACKNOWLEDGE, 0).phase, DISARMED, "{what}");
    }
    if stays.phase == HOLDING && stays.cause != 0 {
        bench.tick(RUN, 2);
        for _ in 0..20 {
            assert_eq!(bench.tick(RUN, 0).phase, HOLDING, "{what}: a request to run that stays from before");
        }
        bench.tick(NOTHING, 0);
        assert_eq!(bench.tick(RUN, 0).phase, RUNNING, "{what}");
        // A set-point out of reach is left as slowly as it was come to: that one holds again.
        let back_at_once = bench.kind == Kind::Legs || stays.cause != 6;
        for _ in 0..if back_at_once { 200 } else { 0 } {
            assert_eq!(bench.tick(RUN, 0).phase, RUNNING, "{what}: runs on, conditions {:x}", bench.conditions());
        }
        bench.until(DISARMED, RAMP_DOWN);
    } else if bench.word.phase != DISARMED {
        bench.until(DISARMED, RAMP_DOWN);
    }
    bench.tick(NOTHING, 0);
    bench.until(ARMING, ARM);
    bench.until(RUNNING, RUN);
}

#[test]
fn every_cause_in_every_phase_of_six_legs() {
    table(Kind::Legs);
}

#[test]
fn every_cause_in_every_phase_of_a_platform() {
    table(Kind::Platform);
}

/// What a fault of an amplifier leads to where the spec says so; switching off, the default, is among every cause above.
#[test]
fn a_fault_of_an_amplifier_ramps_down_or_holds_as_the_spec_says() {
    let cases = [("ramp-down", Reaction::RampDown, Kind::Platform), ("hold", Reaction::Hold, Kind::Legs)];
    for (action, reaction, kind) in cases {
        let line = format!("arm_time          = \"2 ms\"\namplifier_fault = \"{action}\"");
        let emitted = emitted(&format!("supervisor-{action}"), kind.spec(), &[("arm_time          = \"2 ms\"", &line)]);
        assert_eq!(emitted.compiled.ir.supervision.amplifier_fault, reaction);
        rows(kind, &emitted, [AMPLIFIER_FAULT], true);
    }
}

/// Without a request to arm that begins now, and with any condition, a machine stays disarmed.
#[test]
fn arming_takes_a_request_that_begins_and_a_machine_that_is_well() {
    let emitted = emitted("supervisor-arming", "legs.toml", &[]);
    let mut bench = Bench::new(Kind::Legs, &emitted, &[]);
    for request in [NOTHING, RUN, HOLD, RAMP_DOWN, ACKNOWLEDGE, NOTHING] {
        for _ in 0..20 {
            assert_eq!(bench.tick(request, 0).phase, DISARMED, "request {request}");
        }
    }
    for _ in 0..20 {
        assert_eq!(bench.tick(ARM, 8).phase, DISARMED, "a converter that does not answer");
    }
    for _ in 0..20 {
        assert_eq!(bench.tick(ARM, AMPLIFIER).phase, DISARMED, "an amplifier with a fault");
        assert_eq!(bench.conditions(), 1 << 31);
    }
    assert_eq!(bench.tick(ARM, 0).phase, ARMING, "the request waits as long as it is given");
    bench.until(HOLDING, ARM);
    bench.until(DISARMED, RAMP_DOWN);
    bench.until(ARMING, ARM);
    // The time begins anew with every condition.
    for _ in 0..40 {
        for _ in 0..7 {
            assert_eq!(bench.tick(ARM, 0).phase, ARMING);
        }
        bench.tick(ARM, 1);
        for _ in 0..2 {
            bench.tick(ARM, 0);
        }
        if bench.word.phase != ARMING {
            break;
        }
    }
    assert_ne!(bench.word.phase, HOLDING, "armed although ticks were missed all the time");
}
