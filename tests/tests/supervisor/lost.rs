//! A host that is lost and a converter that stays silent: the machine holds, then ramps down and switches off; what comes back in
//! between finds it holding.

use super::bench::*;

/// Events of the two, the cause that holds and the one that ramps down.
const LINK: (u64, u8, u8) = (2, 9, 13);
const CONVERTER: (u64, u8, u8) = (8, 11, 14);

/// Ticks of the event until it holds and until it ramps down, by the times of [`super::bench`]: a host is lost in the tick after
/// 0.4 ms, both are given up after 1.4 ms, a converter holds after `gauge_time`.
fn ticks(kind: Kind, event: u64) -> [u32; 2] {
    match (kind, event) {
        (Kind::Legs, 2) => [1, 6],
        (Kind::Legs, _) => [5, 7],
        (Kind::Platform, 2) => [1, 11],
        (Kind::Platform, _) => [10, 14],
    }
}

/// Away for so many ticks while `request` is given, from `phase` on; checks every one of them.
fn away(bench: &mut Bench, (event, holds, down): (u64, u8, u8), count: u32, from: u8, request: u64) {
    let [hold_at, down_at] = ticks(bench.kind, event);
    for tick in 1..=count {
        let word = bench.tick(request, event);
        let what = format!("{:?}, event {event}, request {request}, tick {tick}: {word:?}", bench.kind);
        if tick < hold_at {
            assert_eq!(word.phase, from, "{what}");
        } else if tick < down_at {
            assert_eq!((word.phase, word.cause, word.amplifier_on), (HOLDING, holds, true), "{what}");
        } else {
            assert_eq!(word.cause, down, "{what}");
            assert!(matches!(word.phase, RAMPING | FAULTED), "{what}");
        }
    }
}

fn runs_again(bench: &mut Bench) {
    for _ in 0..20 {
        assert_eq!(bench.tick(RUN, 0).phase, HOLDING, "a request that stays from before");
    }
    bench.tick(NOTHING, 0);
    assert_eq!(bench.tick(RUN, 0).phase, RUNNING);
}

fn arms_again(bench: &mut Bench) {
    bench.tick(NOTHING, 0);
    assert_eq!(bench.tick(ACKNOWLEDGE, 0).phase, DISARMED);
    bench.bring_to(RUNNING);
    for _ in 0..100 {
        bench.tick(RUN, 0);
    }
}

fn lost(kind: Kind) {
    let emitted = emitted(&format!("supervisor-lost-{kind:?}").to_lowercase(), kind.spec(), &[]);
    let settings: &[(&str, f64)] =
        if kind == Kind::Legs { &[("setpoint_kind", 1.0), ("mode", 2.0)] } else { &[("mode", 6.0)] };
    for silent in [LINK, CONVERTER] {
        let [hold_at, down_at] = ticks(kind, silent.0);
        let mut bench = Bench::new(kind, &emitted, settings);
        bench.bring_to(RUNNING);
        for _ in 0..100 {
            bench.tick(RUN, 0);
        }
        // Back before it holds, just before it ramps down, and again: what came back counts anew.
        for _ in 0..3 {
            away(&mut bench, silent, hold_at - 1, RUNNING, RUN);
            for _ in 0..20 {
                assert_eq!(bench.tick(RUN, 0).phase, RUNNING);
            }
            away(&mut bench, silent, down_at - 1, RUNNING, RUN);
            runs_again(&mut bench);
        }
        // Back after it began to ramp down: too late, it goes down to the end.
        away(&mut bench, silent, down_at, RUNNING, RUN);
        bench.until(FAULTED, RUN);
        assert_eq!((bench.word.cause, bench.word.amplifier_on), (silent.2, false));
        arms_again(&mut bench);
        // Never back, whatever was asked for last; also where it was held by request.
        for request in [RUN, NOTHING, HOLD, 7] {
            bench.tick(request, 0);
            let from = bench.word.phase;
            away(&mut bench, silent, 3000, from, request);
            assert_eq!((bench.word.phase, bench.word.amplifier_on), (FAULTED, false), "request {request}");
            assert_eq!(bench.codes(), [bench.rest; 6]);
            // Not acknowledged by what stays from before.
            for _ in 0..20 {
                assert_eq!(bench.tick(request, 0).phase, FAULTED);
            }
            arms_again(&mut bench);
        }
    }
}

#[test]
fn six_legs_that_lost_their_host_or_converter_ramp_down() {
    lost(Kind::Legs);
}

#[test]
fn a_platform_that_lost_its_host_or_converter_ramps_down() {
    lost(Kind::Platform);
}
