//! What a tick of the controller in task space costs on the emulated microcontrollers: against the figures the project
//! promises, and against the committed ones of `tests/budgets/platform.json`, stage by stage.
//!
//! `cargo test --release -p specgen-tests platform_budgets -- --nocapture` prints them; with `SPECGEN_BLESS=1` in
//! the environment the figures of the present cross compiler are committed anew.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::{env, fs};

use host_sim::controller::TickController;
use serde::{Deserialize, Serialize};
use specgen::model::Mcu;
use specgen::target::stack;
use specgen::verify::{self, Measurement};
use specgen_tests::{Emitted, host_trace, repository};

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
/// Way to the bias pose, then tracking of the first on-board trajectory in closed loop, with noise, P/F with PCC.
const TICKS: u32 = 20_000;
/// A stage may grow by this share of its committed figure, and by as many instructions, before it is a regression.
const GROWTH: (f64, f64) = (0.03, 2.0);
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

/// The committed figures of one machine and one compiler.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Figures {
    /// Bytes of the code that a tick can reach.
    tick_code: u64,
    /// Bytes of the code and constants of the six leg forces.
    dynamics: u64,
    /// Static bound, bytes.
    stack: u64,
    /// Mean instructions by stage; `step` is the whole tick.
    instructions: BTreeMap<String, f64>,
}

/// By machine and scalar, then by version of the cross compiler.
type Table = BTreeMap<String, BTreeMap<String, Figures>>;

fn table_path() -> PathBuf {
    repository().join("tests/budgets/platform.json")
}

fn table() -> Table {
    let text = fs::read_to_string(table_path()).expect("tests/budgets/platform.json");
    serde_json::from_str(&text).expect("the committed figures")
}

/// Every figure that has grown beyond what is allowed, and every stage that has no figure, in words.
fn regressions(committed: &Figures, found: &Figures) -> Vec<String> {
    let allowed = |figure: f64| figure * (1.0 + GROWTH.0) + GROWTH.1;
    let mut grown = Vec::new();
    for (name, committed, found) in [
        ("bytes of the tick's code", committed.tick_code, found.tick_code),
        ("bytes of the dynamics", committed.dynamics, found.dynamics),
        ("bytes of stack", committed.stack, found.stack),
    ] {
        if found as f64 > allowed(committed as f64) {
            grown.push(format!("{name}: {found}, committed {committed}"));
        }
    }
    for (stage, mean) in &found.instructions {
        match committed.instructions.get(stage) {
            None => grown.push(format!("{stage}: no committed figure")),
            Some(committed) if *mean > allowed(*committed) => {
                grown.push(format!("{stage}: {mean} instructions, committed {committed}"));
            }
            Some(_) => {}
        }
    }
    grown
}

/// `1.96.0` of `rustc 1.96.0 (… …)`: to the minor version, for a patch changes no code generation.
fn minor_version(compiler: &str) -> String {
    let version = compiler.split_whitespace().find(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    version.unwrap_or(compiler).split('.').take(2).collect::<Vec<_>>().join(".")
}

#[test]
fn a_tick_keeps_its_promises_and_grows_no_stage() {
    let bless = env::var_os("SPECGEN_BLESS").is_some_and(|value| value == "1");
    let mut committed = table();
    let mut broken = Vec::new();
    for budget in &BUDGETS {
        let name = budget.name;
        let emitted =
            Emitted::new(&format!("platform-budget-{}", name.replace(' ', "-")), "reference.toml", budget.edits);
        let Some(image) = emitted.image(budget.mcu) else { continue };
        let mut controller = emitted.controller();
        let host = verify::exercise(&mut controller, &emitted.compiled.model, &emitted.compiled.ir, TICKS).unwrap();
        let m = verify::measure(&image, &controller.default_config(), &host).unwrap();
        assert_eq!(m.first_difference, None, "{name}");
        let code = stack::bound(&image.elf, "controller::stages::dynamics").unwrap().code_bytes;
        let constants = 6 * NUMBERS_OF_A_LEG * u64::from(emitted.compiled.ir.scalar.bits() / 8);
        let bound = stack::bound(&image.elf, stack::STEP_SYMBOL).unwrap();
        let found = Figures {
            tick_code: m.tick_code,
            dynamics: code + constants,
            stack: bound.bytes,
            instructions: m
                .stages
                .iter()
                .map(|stage| (stage.name.clone(), (10.0 * stage.mean).round() / 10.0))
                .collect(),
        };
        print(name, &m, &found);

        let mut check = |kept: bool, what: String| {
            if !kept {
                broken.push(format!("{name}: {what}"))
            }
        };
        let tick = m.stage("step").unwrap();
        assert_eq!(tick.calls, u64::from(TICKS));
        if let Some(most) = budget.tick {
            check(tick.mean <= most, format!("{} instructions per tick, promised {most}", tick.mean));
        }
        let dynamics = m.stage("dynamics").unwrap();
        check(dynamics.min == dynamics.max, format!("data decides what the dynamics compute: {dynamics:?}"));
        if let Some(most) = budget.dynamics {
            check(dynamics.max <= most, format!("{} instructions of the dynamics, promised {most}", dynamics.max));
        }
        check(
            found.dynamics <= DYNAMICS_BYTES,
            format!("{} bytes of dynamics, promised {DYNAMICS_BYTES}", found.dynamics),
        );
        check(code > 1500, format!("{code} bytes of code can hardly be the dynamics"));
        check(m.forbidden_symbols.is_empty(), format!("{:?}", m.forbidden_symbols));
        check(bound.is_complete(), format!("the stack bound does not hold: {bound:?}"));
        check(bound.bytes <= STACK, format!("{} bytes of stack, promised {STACK}", bound.bytes));
        check(
            bound.bytes >= m.stack_painted && m.stack_painted > 0,
            format!("bound {} below the {} painted bytes of stack", bound.bytes, m.stack_painted),
        );

        let version = minor_version(&m.compiler);
        match committed.get(name).and_then(|figures| figures.get(&version)) {
            _ if bless => {
                committed.entry(name.to_owned()).or_default().insert(version, found);
            }
            Some(figures) => {
                for grown in regressions(figures, &found) {
                    check(false, format!("{grown}; if that must be: SPECGEN_BLESS=1 renews the figures"));
                }
            }
            None => println!("  no committed figures for rustc {version}: SPECGEN_BLESS=1 adds them"),
        }
    }
    if bless {
        let text = serde_json::to_string_pretty(&committed).unwrap() + "\n";
        fs::write(table_path(), text).unwrap();
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The hostile record, of which nothing is promised but that the worst tick is bounded.
#[test]
fn the_worst_tick_of_the_hostile_record_is_bounded() {
    let emitted = Emitted::new("platform-budget-hostile", "reference.toml", &[]);
    let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
    let mut controller = emitted.controller();
    let inputs = emitted.platform_stimulus(&controller.description().clone(), 20_000, 3);
    for (what, mode) in [("P", 0.0), ("F invhys", 1.0), ("P/F pcc", 6.0)] {
        let (host, config) = host_trace(&mut controller, &[("mode", mode), ("interaction", 2.0)], &inputs);
        let m = verify::measure(&image, &config, &host).unwrap();
        assert_eq!(m.first_difference, None, "{what}");
        let (tick, leg) = (m.stage("step").unwrap(), m.stage("actuate").unwrap());
        println!("M7 f64, hostile, {what}: tick {:.0} mean {} max, leg {} max", tick.mean, tick.max, leg.max);
        assert!(tick.max <= 6 * leg.max + 4500, "{what}: {} instructions", tick.max);
        assert!(tick.max <= 12_000, "{what}: {} instructions", tick.max);
    }
}

#[test]
fn the_gate_sees_a_stage_that_grows_by_four_percent() {
    let committed = Figures {
        tick_code: 10_000,
        dynamics: 3000,
        stack: 1500,
        instructions: [("step".to_owned(), 4000.0), ("notch".to_owned(), 200.0)].into(),
    };
    assert_eq!(regressions(&committed, &committed), Vec::<String>::new());
    for (stage, factor, expected) in [("step", 1.04, 1), ("step", 1.02, 0), ("notch", 1.05, 1), ("notch", 0.5, 0)] {
        let mut found = committed.clone();
        *found.instructions.get_mut(stage).unwrap() *= factor;
        assert_eq!(regressions(&committed, &found).len(), expected, "{stage} × {factor}");
    }
    let mut found = committed.clone();
    found.instructions.insert("another".to_owned(), 1.0);
    (found.stack, found.dynamics, found.tick_code) = (1600, 3200, 11_000);
    assert_eq!(regressions(&committed, &found).len(), 4);
    assert_eq!(minor_version("rustc 1.96.0 (ac68faa20 2026-05-25)"), "1.96");
    // The committed file is one of figures, for the machines that are measured.
    assert!(table().keys().all(|name| BUDGETS.iter().any(|budget| budget.name == name)));
}

fn print(name: &str, m: &Measurement, figures: &Figures) {
    println!(
        "{name}, {}: flash {} ({} code, {} constants), RAM {}, tick code {}, dynamics {} bytes, stack {:?} bound {} painted",
        m.compiler, m.flash, m.code, m.constants, m.ram, m.tick_code, figures.dynamics, m.stack_bound, m.stack_painted
    );
    for stage in &m.stages {
        println!("  {:<12} {:>8.1} mean {:>6} min {:>6} max", stage.name, stage.mean, stage.min, stage.max);
    }
}
