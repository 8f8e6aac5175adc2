//! A host that is lost: the machine holds, then ramps down and switches off; one that comes back in between finds it holding.

use super::bench::*;

/// The event, the cause that holds and the one that ramps down.
const EVENT: u64 = 2;
const HOLDS: u8 = 9;
const RAMPS: u8 = 13;

/// Ticks of the event until it ramps down, by the times of [`super::bench`]: a host is lost in the tick after 0.4 ms, and holds at
/// once; it is given up after 1.4 ms.
fn ticks(kind: Kind) -> u32 {
    match kind {
        Kind::Legs => 6,
        Kind::Platform => 11,
    }
}

/// Away for so many ticks while `request` is given, from `phase` on; checks every one of them.
fn away(bench: &mut Bench, count: u32, request: u64) {
    for tick in 1..=count {
        let word = bench.tick(request, EVENT);
        let what = format!("{:?}, request {request}, tick {tick}: {word:?}", bench.kind);
        if tick < ticks(bench.kind) {
            assert_eq!((word.phase, word.cause, word.amplifier_on), (HOLDING, HOLDS, true), "{what}");
        } else {
            assert_eq!(word.cause, RAMPS, "{what}");
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
    let mut bench = Bench::new(kind, &emitted, settings);
    bench.bring_to(RUNNING);
    for _ in 0..100 {
        bench.tick(RUN, 0);
    }
    // Back just before it ramps down, and again: one that came back counts anew.
    for _ in 0..3 {
        away(&mut bench, ticks(kind) - 1, RUN);
        runs_again(&mut bench);
    }
    // Back after it began to ramp down: too late, it goes down to the end.
    away(&mut bench, ticks(kind), RUN);
    bench.until(FAULTED, RUN);
    assert_eq!((bench.word.cause, bench.word.amplifier_on), (RAMPS, false));
    arms_again(&mut bench);
    // Never back, whatever was asked for last; also where it was held by request.
    for request in [RUN, NOTHING, HOLD, 7] {
        bench.tick(request, 0);
        away(&mut bench, specgen_tests::length(600, 3000), request);
        assert_eq!((bench.word.phase, bench.word.amplifier_on), (FAULTED, false), "request {request}");
        assert_eq!(bench.codes(), [bench.rest; 6]);
        // Not acknowledged by what stays from before.
        for _ in 0..20 {
            assert_eq!(bench.tick(request, 0).phase, FAULTED);
        }
        arms_again(&mut bench);
    }
}

#[test]
fn six_legs_that_lost_their_host_ramp_down() {
    lost(Kind::Legs);
}

#[test]
fn a_platform_that_lost_its_host_ramps_down() {
    lost(Kind::Platform);
}
