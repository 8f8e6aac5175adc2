//! The law begins without a jump, wherever the codes are held.

use super::bench::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Codes by which a leg may move in the tick in which the law begins.
const MOST_CODES: i64 = 1;

/// Holds and runs again and again, at codes all over the range, with gauges that show something else than the model.
fn begins(kind: Kind, mode: f64, more: &[(&str, &str)]) -> i64 {
    let name = format!("supervisor-begin-{kind:?}-{}", more.len()).to_lowercase();
    let emitted = emitted(&name, kind.spec(), more);
    let mut settings = vec![("mode", mode)];
    if kind == Kind::Legs {
        settings.push(("setpoint_kind", 1.0));
    }
    let mut bench = Bench::new(kind, &emitted, &settings);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut most = 0;
    let (mut lowest, mut highest) = (i64::MAX, 0);
    for round in 0..specgen_tests::length(12, 60) {
        let mut draw = |span: f64| (rng.next_u64() % 1_000_001) as f64 * 1e-6 * span;
        // Below the bounds of disagreement and of tracking, so that nothing is a fault.
        let offset = if kind == Kind::Legs { 2e-6 } else { 0.2e-6 };
        bench.offset = std::array::from_fn(|_| draw(2.0 * offset) - offset);
        bench.tick(NOTHING, 0);
        if round % 4 == 0 {
            bench.until(DISARMED, RAMP_DOWN);
            bench.until(ARMING, ARM);
        }
        bench.until(HOLDING, HOLD);
        for _ in 0..20 {
            bench.tick(HOLD, 0);
        }
        // Another place is asked for in the very tick in which the law begins.
        bench.setpoint = match kind {
            Kind::Legs => std::array::from_fn(|_| 3e-6 + draw(35e-6)),
            // Within reach: the bias leaves the legs 8 µm downwards.
            Kind::Platform => [draw(0.5e-6), draw(0.5e-6), draw(20e-6), 0.0, 0.0, 0.0],
        };
        let held = bench.codes();
        bench.until(RUNNING, RUN);
        for (code, held) in bench.codes().iter().zip(&held) {
            let jump = (code - held).abs();
            most = if jump > most { jump } else { most };
            lowest = if *held < lowest { *held } else { lowest };
            highest = if *held > highest { *held } else { highest };
        }
        // Long enough to get there.
        for tick in 0..1500 {
            assert_eq!(
                bench.tick(RUN, 0).phase,
                RUNNING,
                "{kind:?} round {round} tick {tick}: {:x} {:?}",
                bench.conditions(),
                bench.codes()
            );
        }
    }
    println!(
        "{kind:?}, mode {mode}: held between codes {lowest} and {highest}; the first tick moves a leg by {most} codes at most"
    );
    assert!(highest - lowest > 3000, "{kind:?}: the holds were all in one place");
    most
}

#[test]
fn six_legs_begin_without_a_jump() {
    for mode in [2.0, 0.0, 1.0].into_iter().take(specgen_tests::length(1, 3)) {
        assert!(begins(Kind::Legs, mode, &[]) <= MOST_CODES);
    }
}

#[test]
fn a_platform_begins_without_a_jump() {
    // On its way from rest to the bias a platform may want legs shorter than they get.
    let tolerant = [("voltage_time      = \"2 ms\"", "voltage_time      = \"500 ms\"")];
    for mode in [6.0, 1.0, 3.0].into_iter().take(specgen_tests::length(1, 3)) {
        assert!(begins(Kind::Platform, mode, &tolerant) <= MOST_CODES);
    }
}
