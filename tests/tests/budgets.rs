//! What a tick costs on the emulated microcontrollers, against the figures the project promises.
//! `cargo test --release -p specgen-tests budgets -- --nocapture` prints them.

use crate::figures;
use host_sim::controller::TickController;
use host_sim::description::Description;
use oracle::stimulus::InputRecording;
use specgen::model::Mcu;
use specgen::target::{Image, image, stack};
use specgen::verify::{self, Measurement};
use specgen_tests::{Emitted, host_trace};

const F32: (&str, &str) = ("scalar   = \"f64\"", "scalar   = \"f32\"");
/// Tracking in closed loop, with noise; of a platform the way to its bias pose, then its first trajectory on board, P/F with PCC.
pub const TICKS: u32 = 20_000;
/// Instructions of the inverse Preisach model of one leg on the M7: mean, worst.
const INVERSE: (f64, u64) = (250.0, 450);

/// Figures of that model, and of the longest tick.
const INVERSE_MEAN: &str = "instructions, inverse";
const INVERSE_MOST: &str = "instructions, inverse at most";
const LONGEST: &str = "instructions, step at most";

struct Budget {
    name: &'static str,
    edits: &'static [(&'static str, &'static str)],
    mcu: Mcu,
    /// Mean instructions of a whole tick.
    tick: f64,
}

const BUDGETS: [Budget; 3] = [
    Budget { name: "M7 f64", edits: &[], mcu: Mcu::Mps2An500, tick: 3000.0 },
    Budget { name: "M7 f32", edits: &[F32], mcu: Mcu::Mps2An500, tick: 2500.0 },
    Budget { name: "M4F f32", edits: &[F32], mcu: Mcu::Mps2An386, tick: 3000.0 },
];

/// Pose set-points to six voltages under PCC, tracking with gauge noise, each tick measured.
#[test]
fn a_tick_of_six_legs_stays_within_its_instructions_and_its_stack() {
    // The first in the short run.
    for budget in &BUDGETS[..specgen_tests::length(1, BUDGETS.len())] {
        let Some((_, image, m)) = measured("legs.toml", budget.name, budget.edits, budget.mcu) else { continue };
        held(budget.name, &m);
        let tick = m.stage("step").unwrap();
        assert_eq!(tick.calls, u64::from(TICKS));
        assert!(tick.mean <= budget.tick, "{}: {} instructions", budget.name, tick.mean);
        let inverse = m.stage("inverse").unwrap();
        assert!(
            inverse.mean <= INVERSE.0 && inverse.max <= INVERSE.1,
            "{}: {} mean, {} worst",
            budget.name,
            inverse.mean,
            inverse.max
        );

        assert!(m.forbidden_symbols.is_empty(), "{}: {:?}", budget.name, m.forbidden_symbols);
        let bound = stack::bound(&image.elf, stack::STEP_SYMBOL).unwrap();
        assert!(bound.is_complete(), "{}: {bound:?}", budget.name);
        assert!(bound.bytes >= m.stack_painted && m.stack_painted > 0, "{} < {}", bound.bytes, m.stack_painted);
        assert!(bound.bytes <= 2048);
        assert!(image::footprint(&image.elf).unwrap().flash <= 96 * 1024);
    }
}

/// Holds what a tick costs, and the inverse of a leg in it, against the committed figures.
fn held(name: &str, m: &Measurement) {
    let inverse = m.stage("inverse").unwrap();
    let longest = m.stage("step").unwrap().max as f64;
    let more = [(INVERSE_MEAN, inverse.mean.ceil()), (INVERSE_MOST, inverse.max as f64), (LONGEST, longest)];
    let found = figures::cost(m).into_iter().chain(more.map(|(what, value)| (what.to_owned(), value)));
    assert_eq!(figures::held("legs.json", name, &m.compiler, found.collect()), Vec::<String>::new());
}

/// The rows in docs/figures.md have the committed figures.
#[test]
fn the_page_says_what_a_tick_of_six_legs_costs() {
    let [step, leg, longest_leg] = ["instructions, step", "instructions, actuate", "instructions, actuate at most"];
    let figure = |name: &str, what: &str| figures::figure("legs.json", name, what);
    let of_each = |what: &str| BUDGETS.each_ref().map(|budget| figure(budget.name, what));
    let [[m7, m7_single, m4f], [stack, stack_single, stack_m4f]] = [step, "bytes of stack"].map(of_each);
    let tracking = |what: &str| figure("M7 f64", what);
    let hostile = |what: &str| figure("M7 f64, hostile, invhys", what);
    let (tracked, hostile_tick) = (tracking(LONGEST), hostile(LONGEST));
    let overflow = figure("M7 f64, overflow", LONGEST);
    let (mean, most, leg) = (tracking(INVERSE_MEAN), tracking(INVERSE_MOST), tracking(leg));
    let (longest, hostile_most) = (tracking(longest_leg), hostile(INVERSE_MOST));
    let hostile_longest = hostile(longest_leg);
    figures::shown(
        "figures.md",
        &[
            format!(
                "| inverse Preisach, one leg, N = 32, M7 f64 | tracking {mean} instructions mean, {most} worst; with converter and memory {leg} and {longest}; \
             hostile record {hostile_most} and {hostile_longest} at worst | `… budgets -- --nocapture` |"
            ),
            format!(
                "| leg feed-forward, whole tick, pose to six voltages, PCC (rustc 1.95) | M7 f64 {m7} instructions mean; M7 f32 {m7_single}; \
             M4F f32 {m4f}; stack, static bound, {stack}, {stack_single}, {stack_m4f} bytes | `… budgets -- --nocapture` |"
            ),
            format!(
                "| the same, worst tick, M7 f64, rustc 1.95 | tracking {tracked}; hostile record {hostile_tick}; all six reversal memories overflowing in one tick {overflow} \
             (65 nested loops a leg) | same |"
            ),
        ],
    );
}

/// The hostile record of the bit comparison, and nested loops that overfill the memory of all six legs in the same tick:
/// no promise, but stated and bounded.
#[test]
fn the_worst_tick_is_bounded_even_when_every_memory_overflows() {
    let emitted = Emitted::new("budget-hostile", "legs.toml", &[]);
    let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
    let mut controller = emitted.at_run_time();
    let description = controller.description().clone();
    let hostile = emitted.stimulus(&description, false, 20_000, 3);
    let nested = nested_loops(&description);
    let cases = [("overflow", 0.0, &nested), ("hostile, pcc", 2.0, &hostile), ("hostile, invhys", 0.0, &hostile)];
    for (what, mode, inputs) in cases.into_iter().take(specgen_tests::length(1, 3)) {
        let (host, config) = host_trace(&mut controller, &[("mode", mode), ("setpoint_kind", 1.0)], inputs);
        let m = verify::measure(&image, &config, &host).unwrap();
        assert_eq!(m.first_difference, None, "{what}");
        print(&format!("M7 f64, {what}"), &m);
        held(&format!("M7 f64, {what}"), &m);
        let leg = m.stage("actuate").unwrap();
        // A full memory drops one pair: a look-up for each of 62 pairs, and two moves of 62 entries.
        assert!(leg.max <= 6000, "{} instructions", leg.max);
        assert!(m.stage("step").unwrap().max <= 6 * leg.max + 1000);
        if what == "overflow" {
            assert!(leg.max > 1000, "{what}: no pair was dropped");
        }
    }
}

/// Leg set-points that swing about 20 µm with falling amplitude: 200 loops, each within the one before.
fn nested_loops(description: &Description) -> InputRecording {
    let row = |k: u32| {
        let amplitude = 2e-6 * (1.0 - f64::from(k) / 200.0);
        let setpoint = 20e-6 + if k.is_multiple_of(2) { amplitude } else { -amplitude };
        let mut words = vec![description.scalar.encode(setpoint); 6];
        words.extend([description.scalar.encode(20e-6); 6]);
        words
    };
    // The slew limit needs some ticks to get there.
    let words = (0..20).map(|_| 0).chain(0..200).flat_map(row).collect();
    InputRecording { width: description.input_names.len(), words }
}

/// What [`TICKS`] of a spec's own motion cost on a microcontroller; none where tools are missing.
pub fn measured(spec: &str, name: &str, edits: &[(&str, &str)], mcu: Mcu) -> Option<(Emitted, Image, Measurement)> {
    let emitted = Emitted::new(&format!("budget-{spec}-{name}").replace([' ', '.'], "-"), spec, edits);
    let image = emitted.image(mcu)?;
    let mut controller = emitted.at_run_time();
    let host = verify::exercise(&mut controller, &emitted.compiled.model, &emitted.compiled.ir, TICKS).unwrap();
    let m = verify::measure(&image, &controller.default_config(), &host).unwrap();
    assert_eq!(m.first_difference, None, "{name}");
    print(name, &m);
    // The gate names who takes most.
    let mut tight = emitted.compiled.model.target.clone();
    tight.budget.instructions = m.used.instructions.map(|count| count - 1);
    tight.budget.flash = Some(m.used.flash - 1);
    let over = specgen::budget::over(&tight, &m.used);
    let named = |what: &str| over.iter().any(|one| one.contains(what) && one.contains(": reduce it by 1; largest: "));
    assert!(named("target.budget.instructions allows") && named("target.budget.flash allows"), "{name}: {over:?}");
    Some((emitted, image, m))
}

/// Sizes and stages of a measurement.
fn print(name: &str, m: &Measurement) {
    println!(
        "{name}, {}: flash {} ({} code, {} constants), RAM {}, tick code {}, stack {:?} bound {} painted",
        m.compiler, m.flash, m.code, m.constants, m.ram_without_stack, m.tick_code, m.stack_bound, m.stack_painted
    );
    for stage in &m.stages {
        println!("  {:<12} {:>8.1} mean {:>6} min {:>6} max", stage.name, stage.mean, stage.min, stage.max);
    }
}
