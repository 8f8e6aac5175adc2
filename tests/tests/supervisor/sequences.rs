//! Random sequences of requests, events, readings and set-points.

use super::bench::*;
use super::oracle::Oracle;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeSet;

/// Sequences, and ticks of each.
pub const SEQUENCES: u32 = 10_000;
const TICKS: u32 = 24;

/// A controller under random sequences; `each` sees every row of input before, and the bench after the tick.
pub fn run(bench: &mut Bench, seed: u64, sequences: u32, mut each: impl FnMut(&Bench, &[i64; 6], &[[f64; 6]; 2])) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |below: u64| rng.next_u64() % below;
    // A first tick, so that the output row holds what the machine holds.
    for _ in 0..sequences {
        // Half of the sequences go on from where the last one ended towards running; the others do anything.
        let towards = draw(2) == 0;
        let wrong = draw(4) == 0;
        let gauge = draw(6) as usize;
        let kind = draw(9);
        bench.frozen = [false; 6];
        bench.offset = [0.0; 6];
        let mut request = draw(7);
        let base = bench.setpoint[0];
        for tick in 0..TICKS {
            if tick % 8 == 0 {
                request = match (towards, bench.word.phase, tick) {
                    (true, DISARMED, _) => [ARM, NOTHING][(tick as usize / 8) % 2],
                    (true, ARMING | HOLDING | RUNNING, 8) => NOTHING,
                    (true, ARMING | HOLDING | RUNNING, _) => RUN,
                    (true, FAULTED, _) => [NOTHING, ACKNOWLEDGE, NOTHING][tick as usize / 8],
                    _ => draw(7),
                };
            }
            let mut events = 0;
            if wrong && kind == 0 && draw(3) == 0 {
                events = 1 << draw(5);
            }
            let amount = [30e-6, 8e-6, 1.0, f64::NAN, f64::INFINITY][draw(5) as usize];
            if wrong && kind == 1 {
                bench.frozen[gauge] = true;
            } else if wrong && kind == 2 {
                bench.offset[gauge] = [30e-6, 8e-6, -8e-6][gauge % 3];
            }
            if draw(12) == 0 {
                let target = [base, base + 2e-6, 25e-6, 4e-6, -3e-6, 90e-6, 14e-6][draw(7) as usize];
                bench.setpoint = match bench.kind {
                    Kind::Legs => [target; 6],
                    Kind::Platform => [0.0, target * 0.2, target - 15e-6, 0.0, 0.0, 0.0],
                };
            }
            bench.prepare(request, events);
            let gauges = bench.gauges();
            if wrong && kind == 3 {
                bench.input[gauges + gauge] = bench.scalar.encode(amount);
            } else if wrong && kind == 4 {
                let place = draw(bench.input.len() as u64) as usize;
                let mask =
                    if bench.scalar.bits() == 32 && place + 2 < bench.input.len() { 0xffff_ffff } else { u64::MAX };
                bench.input[place] = draw(u64::MAX) & mask;
            }
            let before = bench.codes();
            let held = [bench.six("requested"), bench.six("demand")];
            bench.step();
            each(bench, &before, &held);
        }
    }
}

/// Phase and cause of every tick of 10,000 sequences are those of a state machine of its own text.
#[test]
fn phases_and_causes_of_random_sequences_are_those_of_the_oracle() {
    let emitted = emitted("supervisor-sequences", "legs.toml", &[]);
    let mut bench = Bench::new(Kind::Legs, &emitted, &[("setpoint_kind", 1.0), ("mode", 2.0)]);
    let max_step = i64::from(emitted.compiled.ir.defaults.max_step);
    let mut oracle = Oracle::new();
    let mut met = BTreeSet::new();
    let mut ticks = 0_u64;
    run(&mut bench, 5, SEQUENCES, |bench, before, [modelled, demand]| {
        let more = bench.input.len() - 2;
        let ran = oracle.phase == RUNNING;
        oracle.decide(bench.input[more], bench.input[more + 1], before.iter().all(|code| *code == 0));
        let word = bench.word;
        assert_eq!(
            (word.phase, word.cause),
            (oracle.phase, oracle.cause),
            "tick {}: request {}, events {:x}, conditions {:x}: {oracle:?}",
            bench.tick,
            bench.input[more],
            bench.input[more + 1],
            bench.conditions()
        );
        met.insert((word.phase, word.cause));
        ticks += 1;
        let gauges = bench.gauges();
        let words = &bench.input[gauges..gauges + 6];
        let readings: [f64; 6] = std::array::from_fn(|leg| bench.scalar.decode(words[leg]));
        // Where the law begins, the demand is where the gauges show the legs, if they are believed.
        let demand = if ran || word.phase != RUNNING {
            *demand
        } else {
            std::array::from_fn(|leg| {
                let reading = readings[leg];
                if (-2e-6..=48e-6).contains(&reading) { reading } else { modelled[leg] }
            })
        };
        let status = bench.output[bench.at("status")];
        oracle.observe(words, &readings, modelled, &demand, [before, &bench.codes()], status, max_step);
    });
    println!("{SEQUENCES} sequences, {ticks} ticks; {} pairs of phase and cause: {met:?}", met.len());
    for cause in 1..=12 {
        assert!(met.iter().any(|(_, found)| *found == cause), "cause {cause} never came: {met:?}");
    }
    for phase in 0..=5 {
        assert!(met.iter().any(|(found, _)| *found == phase), "phase {phase} never came");
    }
}
