//! What a tick of the controller in task space costs on the emulated microcontrollers: against the figures the project
//! promises, and against the committed ones of `tests/budgets/platform.json`, stage by stage (see [`crate::figures`]).
//!
//! `cargo test --release -p specgen-tests platform_budgets -- --nocapture` prints them.

use crate::budgets::{TICKS, measured};
use crate::figures;
use host_sim::controller::TickController;
use specgen::model::Mcu;
use specgen::target::stack;
use specgen::verify;
use specgen_tests::{Emitted, host_trace};

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
/// The stage whose code is held against [`DYNAMICS_BYTES`].
const DYNAMICS: &str = "specgen_law::platform::stages::dynamics::<controller::identity::Constants>";
/// Bytes of stack of a tick.
const STACK: u64 = 2048;
/// Bytes of code and constants that the six leg forces take.
const DYNAMICS_BYTES: u64 = 4096;
/// Numbers of a leg that lie beside the code of the dynamics; its other constants lie in it.
const NUMBERS_OF_A_LEG: u64 = 15;

struct Budget {
    name: &'static str,
    edits: &'static [(&'static str, &'static str)],
    mcu: Mcu,
    /// Mean instructions of a whole tick, if promised.
    tick: Option<f64>,
    /// Instructions of the worst motion to six leg forces, if promised.
    dynamics: Option<u64>,
}

const BUDGETS: [Budget; 3] = [
    Budget { name: "M7 f64", edits: &[], mcu: Mcu::Mps2An500, tick: Some(4500.0), dynamics: Some(1500) },
    Budget { name: "M7 f32", edits: &[F32], mcu: Mcu::Mps2An500, tick: None, dynamics: Some(1300) },
    Budget { name: "M4F f32", edits: &[F32], mcu: Mcu::Mps2An386, tick: Some(4500.0), dynamics: None },
];

#[test]
fn a_tick_keeps_its_promises_and_grows_no_stage() {
    let mut broken = Vec::new();
    // The M7 in f64 in the short run.
    for Budget { name, edits, mcu, tick: promised_tick, dynamics: promised_dynamics } in
        BUDGETS.iter().step_by(specgen_tests::length(3, 1))
    {
        let Some((emitted, image, m)) = measured("reference.toml", name, edits, *mcu) else { continue };
        let code = stack::bound(&image.elf, DYNAMICS).unwrap().code_bytes;
        let constants = 6 * NUMBERS_OF_A_LEG * u64::from(emitted.compiled.ir.scalar.bits() / 8);
        let bound = stack::bound(&image.elf, stack::STEP_SYMBOL).unwrap();
        let dynamics_bytes = code + constants;
        println!("  {dynamics_bytes} bytes of dynamics");

        let mut check = |kept: bool, what: String| {
            if !kept {
                broken.push(format!("{name}: {what}"))
            }
        };
        let tick = m.stage("step").unwrap();
        assert_eq!(tick.calls, u64::from(TICKS));
        if let Some(most) = *promised_tick {
            check(tick.mean <= most, format!("{} instructions per tick, promised {most}", tick.mean));
        }
        let dynamics = m.stage("dynamics").unwrap();
        check(dynamics.min == dynamics.max, format!("data decides what the dynamics compute: {dynamics:?}"));
        if let Some(most) = *promised_dynamics {
            check(dynamics.max <= most, format!("{} instructions of the dynamics, promised {most}", dynamics.max));
        }
        let most = DYNAMICS_BYTES;
        check(dynamics_bytes <= most, format!("{dynamics_bytes} bytes of dynamics, promised {most}"));
        check(code > 1500, format!("{code} bytes of code can hardly be the dynamics"));
        check(m.forbidden_symbols.is_empty(), format!("{:?}", m.forbidden_symbols));
        check(bound.is_complete(), format!("the stack bound does not hold: {bound:?}"));
        check(bound.bytes <= STACK, format!("{} bytes of stack, promised {STACK}", bound.bytes));
        check(
            bound.bytes >= m.stack_painted && m.stack_painted > 0,
            format!("bound {} below the {} painted bytes of stack", bound.bytes, m.stack_painted),
        );

        let sizes =
            [("bytes of dynamics", dynamics_bytes), ("bytes of stack", bound.bytes), ("bytes of tick", m.tick_code)];
        let sizes = sizes.map(|(what, bytes)| (what.to_owned(), bytes as f64));
        let sizes = sizes.into_iter().chain(figures::cost(&m));
        let stages = m.stages.iter().map(|stage| (stage.name.clone(), (10.0 * stage.mean).round() / 10.0));
        broken.extend(figures::held("platform.json", name, &m.compiler, sizes.chain(stages).collect()));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    assert!(figures::table("platform.json").keys().all(|name| BUDGETS.iter().any(|budget| budget.name == name)));
}

/// The rows in docs/figures.md have the committed figures.
#[test]
fn the_page_says_what_a_tick_costs() {
    let figure = |what: &str| BUDGETS.each_ref().map(|budget| figures::figure("platform.json", budget.name, what));
    let [[m7, m7_single, m4f], [stack, stack_single, stack_m4f]] = ["step", "bytes of stack"].map(figure);
    let [[dynamics, dynamics_single, _], [bytes, ..]] = ["dynamics", "bytes of dynamics"].map(figure);
    figures::shown(
        "figures.md",
        &[
            format!(
                "| platform, whole tick, six gauges to six voltages, P/F with PCC (rustc 1.95) | first-order load: M7 f64 {m7} \
             instructions mean, M7 f32 {m7_single}, M4F f32 {m4f}; stack {stack}, {stack_single}, {stack_m4f} bytes | \
             `cargo test --release -p specgen-tests platform_budgets -- --nocapture` |"
            ),
            format!(
                "| h, ḣ, ḧ to six leg forces, whole kernel | M7 f64 {dynamics} instructions, {bytes} bytes; f32 {dynamics_single} | \
             `… platform_budgets -- --nocapture` |"
            ),
        ],
    );
}

/// The hostile record, of which nothing is promised but that the worst tick is bounded.
#[test]
#[ignore = "long: the worst tick of six legs is in the short run"]
fn the_worst_tick_of_the_hostile_record_is_bounded() {
    let emitted = Emitted::new("platform-budget-hostile", "reference.toml", &[]);
    let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
    let mut controller = emitted.at_run_time();
    let ticks = specgen_tests::length(4_000, 20_000);
    let inputs = emitted.platform_stimulus(&controller.description().clone(), ticks, 3);
    let modes = [("P/F pcc", 6.0), ("P", 0.0), ("F invhys", 1.0)];
    for &(what, mode) in &modes[..specgen_tests::length(1, modes.len())] {
        let (host, config) = host_trace(&mut controller, &[("mode", mode), ("interaction", 2.0)], &inputs);
        let m = verify::measure(&image, &config, &host).unwrap();
        assert_eq!(m.first_difference, None, "{what}");
        let (tick, leg) = (m.stage("step").unwrap(), m.stage("actuate").unwrap());
        println!("M7 f64, hostile, {what}: tick {:.0} mean {} max, leg {} max", tick.mean, tick.max, leg.max);
        assert!(tick.max <= 6 * leg.max + 4500, "{what}: {} instructions", tick.max);
        assert!(tick.max <= 12_000, "{what}: {} instructions", tick.max);
    }
}
