//! Host and emulated MCU: the same bits of every supervised tick.

use super::bench::*;
use super::sequences;
use specgen::model::Mcu;
use specgen::target;
use specgen_tests::{Emitted, Row, assert_same_machine, compile_edited, machine_difference};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(600);

/// Rows of a machine in random sequences, and its settings.
fn record(kind: Kind, emitted: &Emitted, sequences: u32) -> (Vec<Row>, Vec<u64>) {
    let settings: &[(&str, f64)] = if kind == Kind::Legs { &[("setpoint_kind", 1.0)] } else { &[] };
    let mut bench = Bench::new(kind, emitted, settings);
    let (config, mut rows) = (bench.config().to_vec(), Vec::new());
    sequences::run(&mut bench, 9, sequences, |bench, _| {
        rows.push((bench.input.clone(), bench.output.clone(), bench.machine.digest()));
    });
    (rows, config)
}

fn compare(name: &str, kind: Kind, more: &[(&str, &str)], mcu: Mcu, sequences: u32) {
    let emitted = emitted(name, kind.spec(), more);
    let (rows, config) = record(kind, &emitted, sequences);
    let running = rows.iter().filter(|(_, row, _)| row[row.len() - 2] as u8 == RUNNING).count();
    assert!(running > rows.len() / 20, "{name}: {running} of {} ticks run", rows.len());
    let Some(image) = emitted.image(mcu) else { return };
    let result = assert_same_machine(name, &image, &config, &rows);
    let mean = |stage: &str| result.stats.stage(stage).map_or(0.0, |stage| stage.mean());
    let (ticks, whole, law) = (rows.len(), mean("supervise"), mean("law"));
    let (supervisor, other) = (mean("supervise") - mean("law"), mean("other phases"));
    let most = result.stats.stages.iter().map(|stage| stage.largest).max().unwrap_or(0);
    let stack = result.stats.painted_stack;
    println!(
        "{name}: {sequences} sequences, {ticks} ticks equal in every bit; {running} run: {whole:.0} instructions mean, {law:.0} of them the law, \
         {supervisor:.0} the supervisor; other phases {other:.0} mean; most of any tick {most}; stack {stack} bytes"
    );
}

#[test]
fn sequences_of_six_legs_have_the_same_bits_on_the_m7() {
    compare("supervisor-bits-legs", Kind::Legs, &[ALIGNED], Mcu::Mps2An500, specgen_tests::length(150, 10_000));
}

#[test]
#[ignore = "long: a platform; its samples are compared in the test run"]
fn sequences_of_a_platform_have_the_same_bits_on_the_m7() {
    compare("supervisor-bits-platform", Kind::Platform, &[], Mcu::Mps2An500, specgen_tests::length(150, 10_000));
}

#[test]
#[ignore = "long: the supervisor in single precision; the law is compared in the test run"]
fn sequences_in_f32_have_the_same_bits_on_the_m4f() {
    let f32 = ("scalar   = \"f64\"", "scalar   = \"f32\"");
    compare("supervisor-bits-f32", Kind::Legs, &[f32], Mcu::Mps2An386, specgen_tests::length(150, 2_000));
}

/// The comparison can fail: one ulp of one constant of the supervisor is found.
#[test]
fn one_ulp_of_a_constant_of_the_supervisor_is_found() {
    let good = emitted("supervisor-ulp-good", "legs.toml", &[ALIGNED]);
    let Some(image) = good.image(Mcu::Mps2An500) else { return };
    let mut bad = compile_edited("supervisor-ulp-bad", "legs.toml", &[("[timing]\n", SECTION), ALIGNED], &[]);
    let keep = &mut bad.ir.supervision.approach_keep;
    *keep = keep.next_up();
    let bad = Emitted::of("supervisor-ulp-bad", bad.into());
    let (rows, config) = record(Kind::Legs, &bad, 200);
    let (found, _) = machine_difference(&image, &config, &rows);
    println!("one ulp of `approach_keep` shows in tick {found:?}");
    assert!(found.is_some(), "the flipped ulp was not seen");
}

/// What the supervisor costs a tick in which nothing is wrong, instructions on an M7.
const MOST_INSTRUCTIONS: f64 = 385.0;

#[test]
fn a_tick_in_which_nothing_is_wrong_costs_little_more_than_the_law() {
    for kind in [Kind::Legs, Kind::Platform].into_iter().take(specgen_tests::length(1, 2)) {
        let more = if kind == Kind::Legs { &[ALIGNED][..] } else { &[] };
        let emitted = emitted(&format!("supervisor-cost-{kind:?}").to_lowercase(), kind.spec(), more);
        let mut bench = Bench::new(kind, &emitted, &[]);
        if kind == Kind::Legs {
            bench.setpoint = [1e-6, 2e-6, 9e-6, 0.0, 0.0, 0.0];
        }
        let mut inputs = Vec::new();
        for tick in 0..4000 {
            let request = if tick < 10 {
                NOTHING
            } else if tick < 60 {
                ARM
            } else {
                RUN
            };
            bench.tick(request, 0);
            inputs.push(bench.input.clone());
        }
        assert_eq!(bench.word.phase, RUNNING, "{kind:?}: {:x}", bench.conditions());
        let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
        let result = target::replay_machine(&image, bench.config(), &inputs, LIMIT).unwrap_or_else(|e| panic!("{e}"));
        let mean = |stage: &str| result.stats.stage(stage).map_or(0.0, |stage| stage.mean());
        let cost = mean("supervise") - mean("law");
        let (whole, law, stack) = (mean("supervise"), mean("law"), result.stats.painted_stack);
        let bytes = result.stats.state_bytes;
        println!(
            "{kind:?}: {whole:.0} instructions mean, {law:.0} of them the law, {cost:.0} the supervisor; stack {stack} bytes; Machine {bytes} bytes"
        );
        assert!(cost > 0.0 && cost < MOST_INSTRUCTIONS, "{kind:?}: {cost:.0} instructions");
    }
}
