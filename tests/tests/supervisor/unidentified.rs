//! Legs that are not identified: the machine has the open drive only, and *run* is refused.

use super::bench::*;
use super::sequences;
use host_sim::controller::Controller;
use specgen_tests::{Emitted, length};
use std::collections::BTreeSet;

/// The edit that takes the records out.
const WITHOUT: (&str, &str) = ("records = [\"records/reference-forc.csv\"]", "records = []");

fn unidentified() -> (Emitted, Bench) {
    let emitted = emitted("supervisor-unidentified", "reference.toml", &[WITHOUT]);
    let bench = Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]);
    (emitted, bench)
}

fn request(bench: &Bench) -> u64 {
    bench.input[bench.input.len() - 2]
}

/// From disarmed into a hold.
fn hold(bench: &mut Bench) {
    bench.tick(NOTHING, 0);
    bench.until(ARMING, ARM);
    bench.until(HOLDING, ARM);
}

/// What the law keeps for itself: its set-point.
fn of_the_law(bench: &Bench) -> Vec<u64> {
    let first = bench.at("target[0]");
    bench.output[first..first + 6].to_vec()
}

/// Whatever is requested, commanded, read or wrong: the law never acts, and codes change in an open drive only, or to rest.
#[test]
fn run_is_refused_from_every_phase_whatever_the_inputs() {
    let (_, mut bench) = unidentified();
    bench.tick(NOTHING, 0);
    let (at_reset, rest) = (of_the_law(&bench), bench.rest);
    let (mut met, mut driven, mut refused) = (BTreeSet::new(), 0_u64, 0_u64);
    for seed in 0..length(2, 8) {
        sequences::run(&mut bench, seed, sequences::sequences(), |bench, before| {
            let word = bench.word;
            assert_ne!(word.phase, RUNNING, "tick {}", bench.tick);
            assert_eq!(of_the_law(bench), at_reset, "tick {}: the law has a set-point", bench.tick);
            for (code, before) in bench.codes().iter().zip(bench.codes_of(before)) {
                let to_rest = (code - rest).abs() <= (before - rest).abs() && (code - rest) * (before - rest) >= 0;
                assert!(word.phase == DRIVING || to_rest, "tick {}: {before} to {code} while {word}", bench.tick);
                driven += u64::from(*code != before && word.phase == DRIVING);
            }
            let is_told = word.cause == NOT_IDENTIFIED;
            if word.phase == HOLDING && request(bench) == RUN {
                assert_ne!(word.cause, 0, "tick {}", bench.tick);
            }
            assert!(!is_told || (word.phase, request(bench)) == (HOLDING, RUN), "tick {}: {word}", bench.tick);
            refused += u64::from(is_told);
            met.insert(word.phase);
        });
    }
    println!("{driven} codes driven, {refused} ticks refused");
    assert_eq!(met.into_iter().collect::<Vec<_>>(), [DISARMED, ARMING, HOLDING, RAMPING, FAULTED, DRIVING]);
    assert!(driven > 1000 && refused > 1000, "{driven} {refused}");
}

/// The same sequences with records: what the property says of the law is false there.
#[test]
fn with_records_the_law_acts() {
    let emitted = emitted("supervisor-unidentified", "reference.toml", &[]);
    let mut bench = Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]);
    bench.tick(NOTHING, 0);
    let (at_reset, mut ran, mut acted) = (of_the_law(&bench), false, false);
    sequences::run(&mut bench, 0, 200, |bench, _| {
        ran |= bench.word.phase == RUNNING;
        acted |= of_the_law(bench) != at_reset;
        assert_ne!(bench.word.cause, NOT_IDENTIFIED);
    });
    assert!(ran && acted);
}

#[test]
fn a_refused_run_says_so_and_the_machine_drives_and_switches_off_without_a_fault() {
    let (_, mut bench) = unidentified();
    hold(&mut bench);
    for _ in 0..2 {
        let words = [(NOTHING, 0), (RUN, NOT_IDENTIFIED), (RUN, NOT_IDENTIFIED), (HOLD, 0)];
        for (request, cause) in words {
            bench.tick(request, 0);
            assert_eq!((bench.word.phase, bench.word.cause), (HOLDING, cause), "{request}");
        }
    }
    let said = bench.tick(RUN, 0).to_string();
    assert_eq!(said, "holding: legs not identified");
    bench.until(DRIVING, DRIVE);
    for tick in 0..400_u32 {
        bench.prepare(DRIVE, 0);
        bench.drive([f64::from(tick) * 0.05; 6]);
        bench.step();
        assert_eq!((bench.word.phase, bench.word.cause), (DRIVING, 0));
    }
    let held = bench.codes();
    assert!(held.iter().all(|code| *code > bench.rest));
    bench.tick(RUN, 0);
    assert_eq!((bench.word.phase, bench.word.cause, bench.codes()), (HOLDING, NOT_IDENTIFIED, held));
    bench.until(DISARMED, RAMP_DOWN);
    assert_eq!((bench.word.cause, bench.codes()), (0, [bench.rest; 6]));
}

/// *Run* may be given while arming: the wiring check goes on, and the machine holds.
#[test]
fn a_run_requested_while_arming_does_not_end_the_wiring_check() {
    let emitted = Emitted::new("supervisor-unidentified-wiring", "reference.toml", &[WITHOUT]);
    assert!(emitted.compiled.ir.supervision.wiring.is_some());
    let mut bench = Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]);
    bench.tick(NOTHING, 0);
    let mut pulsed = [false; 6];
    for tick in 0..30_000 {
        bench.prepare(if bench.word.phase == DISARMED { ARM } else { RUN }, 0);
        // The bench's own check of codes that are held does not know the pulse.
        bench.word = bench.machine.step(&bench.input, &mut bench.output);
        bench.tick += 1;
        pulsed.iter_mut().zip(bench.codes()).for_each(|(any, code)| *any |= code != bench.rest);
        if bench.word.phase == HOLDING {
            println!("holding after {tick} ticks");
            break;
        }
        assert!(matches!(bench.word.phase, DISARMED | ARMING), "tick {tick}: {}", bench.word);
    }
    assert_eq!((bench.word.phase, bench.word.cause, pulsed), (HOLDING, NOT_IDENTIFIED, [true; 6]));
}

/// A straight line is wrong by more than `supervisor.disagreement`: it holds no machine up. A stuck gauge does.
#[test]
fn gauges_are_not_compared_with_a_straight_line() {
    let (_, mut bench) = unidentified();
    hold(&mut bench);
    bench.offset[2] = 25e-6;
    for _ in 0..500 {
        bench.tick(NOTHING, 0);
        assert_eq!((bench.word.phase, bench.word.cause), (HOLDING, 0));
    }
    bench.offset[2] = 0.0;
    bench.tick(NOTHING, 0);
    bench.until(DRIVING, DRIVE);
    bench.frozen[2] = true;
    for tick in 0..2000_u32 {
        bench.prepare(DRIVE, 0);
        bench.drive([f64::from(tick) * 0.02; 6]);
        bench.step();
    }
    assert_eq!((bench.word.phase, bench.word.cause), (FAULTED, 3), "{}", bench.word);
}

/// Not even a snapshot of a running machine makes the law run.
#[test]
fn a_state_that_runs_holds() {
    let (_, mut bench) = unidentified();
    hold(&mut bench);
    bench.tick(NOTHING, 0);
    let holding = bench.machine.save();
    bench.tick(DRIVE, 0);
    let driving = bench.machine.save();
    // Of all words only the phase goes from 3 to 6: the request was none.
    let phase: Vec<usize> = (0..holding.len())
        .filter(|at| (holding[*at], driving[*at]) == (u64::from(HOLDING), u64::from(DRIVING)))
        .collect();
    assert_eq!(phase.len(), 1, "{phase:?}");
    let mut running = driving;
    running[phase[0]] = u64::from(RUNNING);
    bench.machine.load(&running).expect("a valid phase");
    let (held, law) = (bench.codes(), of_the_law(&bench));
    for _ in 0..500 {
        bench.tick(NOTHING, 0);
        assert_eq!((bench.word.phase, bench.codes()), (RUNNING, held));
        assert_eq!(of_the_law(&bench), law);
    }
    bench.until(DISARMED, RAMP_DOWN);
}

/// Half the voltage is half the stroke, on the way up and down: nothing is remembered.
#[test]
fn a_leg_that_is_not_identified_is_a_straight_line() {
    let (emitted, _) = unidentified();
    let (ir, stroke) = (&emitted.compiled.ir, emitted.compiled.model.actuator.stroke);
    assert_eq!((ir.hysteresis.tables.len(), ir.hysteresis.table_of_leg, ir.bounds.stroke), (1, [0; 6], stroke));
    let (table, grid) = (&ir.hysteresis.tables[0], ir.hysteresis.grid);
    for up in 0..=grid {
        for down in 0..=up {
            let expected = stroke * (up - down) as f64 / grid as f64;
            assert!((table[up * (up + 1) / 2 + down] - expected).abs() <= 1e-15 * stroke, "{up} {down}");
        }
    }
    let findings = &emitted.compiled.findings;
    assert_eq!(findings.iter().filter(|one| one.code == "W0652").count(), 1, "{findings:?}");
}

/// The emitted crate is the one of the constants: it compiles, without warnings, and gives the same bits.
#[test]
fn the_emitted_controller_is_the_same() {
    let (emitted, _) = unidentified();
    let files = emitted.compiled.files();
    assert!(files["controller/src/lib.rs"].ends_with("\nspecgen_law::controller!(platform, open_drive);\n"));
    let bench = |controller: Controller| Bench::with(controller, Kind::Platform, &emitted, &[("mode", 6.0)]);
    let [mut library, mut law] = [bench(emitted.controller()), bench(emitted.at_run_time())];
    let mut rows = Vec::new();
    sequences::run(&mut library, 3, 200, |bench, _| rows.push((bench.input.clone(), bench.output.clone())));
    for (tick, (input, expected)) in rows.iter().enumerate() {
        let mut output = vec![0; expected.len()];
        law.machine.step(input, &mut output);
        assert_eq!(&output, expected, "tick {tick}");
    }
    assert_eq!(library.machine.digest(), law.machine.digest());
}
