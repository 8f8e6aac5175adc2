//! Rate-dependent options of the emitted controller: equal bits on host and microcontroller, and what they are worth on the
//! reference plant. `SPECGEN_FULL=1 cargo test --release -p specgen-tests rate_options -- --include-ignored --nocapture` prints the table of
//! `docs/hysteresis.md`, and what a tick costs with each.

use crate::figures;
use host_sim::controller::TickController;
use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};
use host_sim::scenario::{LegScenario, MODES};
use specgen::everett::EverettTable;
use specgen::identify::leg_model::{Around, LegModel, WidenedPlays};
use specgen::identify::rate::{RateIdentification, RateModel, RateOption, identify_rate, spec_lines, write_rate_csv};
use specgen::identify::{Options, Record, identify, parse_record, read_leg_csv, write_leg_csv, write_table_csv};
use specgen::model::Mcu;
use specgen::target::Image;
use specgen::verify;
use specgen_tests::{Emitted, assert_same_bits, column, host_trace, integers, length, skipped};

/// Ticks of each comparison.
fn ticks() -> usize {
    length(8_000, 30_000)
}
/// Ticks that instructions are counted over.
const EXERCISE: u32 = 5000;
pub const CREEP: &str = "memory  = 64\nrate = \"creep\"\ncreep_times = [\"2 s\", \"50 ms\", \"4 ms\"]\ncreep_weights = [0.03, 0.05, 0.08]\ndead_time = \"0.35 ms\"";
pub const DYNAMIC: &str = "memory  = 8\nrate = \"dynamic-preisach\"\nrate_tables = [\"records/mu1.csv\"]";
/// STATIC_INVERSE.
const FELL_BACK: u64 = 0x3f00_0000;

/// A second table of either sign: a lag in the lower half of the range, a lead above.
fn rate_table() -> String {
    let (grid, high) = (32, 100.0);
    let nodes = (1..=grid)
        .flat_map(|up: usize| {
            (0..up).map(move |down| {
                let (u, d) = (up as f64 / 32.0, down as f64 / 32.0);
                -4e-10 * (u - d) * (1.0 - 1.6 * u)
            })
        })
        .collect();
    write_rate_csv(&EverettTable { grid, drive_min: 0.0, drive_max: high, nodes })
}

/// A leg with plays that widen, in `WIDENED.1`.
pub const WIDENED: (&str, &str) = ("records/reference-forc.csv", "records/plays.csv");

/// That of [`WIDENED`]: its table is that of the plays at rest.
fn widened_leg() -> String {
    let (grid, count) = (32, 24);
    let thresholds: Vec<f64> = (0..count).map(|k| 2.0 * k as f64).collect();
    let weights: Vec<f64> = (0..count).map(|k| if k == 0 { 0.44 } else { 0.02 - 6e-4 * k as f64 }).collect();
    let of = |span: f64| {
        let plays = thresholds.iter().zip(&weights).map(|(r, w)| w * (span - 2.0 * r).max(0.0));
        plays.sum::<f64>() * 1e-6
    };
    let nodes = (1..=grid).flat_map(|up| (0..up).map(move |down| (up - down) as f64 * 100.0 / 32.0)).map(of).collect();
    let table = EverettTable { grid, drive_min: 0.0, drive_max: 100.0, nodes };
    let plays = WidenedPlays { kappa: 0.02, v0: 20.0, lag_s: 2e-3, thresholds, weights };
    let creep = vec![[1.0, 0.01], [0.01, 0.02]];
    let around = Around { creep, plays: Some(plays), ..Around::of_table(&table) };
    write_leg_csv(&LegModel { table, around: Some(around) })
}

/// Files that a spec of these options names.
pub fn option_files() -> [(&'static str, String); 2] {
    [("mu1.csv", rate_table()), ("plays.csv", widened_leg())]
}

fn equal_bits(name: &str, spec: &str, edits: &[(&str, &str)], mcus: &[Mcu], dynamic: bool) {
    let emitted = Emitted::with_records(name, spec, edits, &option_files());
    let mut controller = emitted.at_run_time();
    let description = controller.description().clone();
    let platform = emitted.compiled.model.task_space.is_some();
    let (inputs, settings): (_, Vec<(&str, f64)>) = if platform {
        (emitted.platform_stimulus(&description, ticks(), 3), Vec::new())
    } else {
        (emitted.stimulus(&description, false, ticks(), 3), vec![("mode", 2.0), ("setpoint_kind", 1.0)])
    };
    let (host, config) = host_trace(&mut controller, &settings, &inputs);
    let status = integers(&host, "status");
    let back = status.iter().filter(|word| **word & FELL_BACK != 0).count();
    let limited = status.iter().filter(|word| **word & 0x3f != 0).count();
    println!("{name}: {back} of {} ticks with the static inverse, {limited} limited", ticks());
    assert!(limited > 100 && (dynamic == (back > 100)) && back < ticks(), "{limited} {back}");
    for leg in 0..6 {
        assert!(column(&host, &format!("voltage[{leg}]")).iter().all(|u| (0.0..=100.0).contains(u)));
    }
    for mcu in mcus {
        let Some(image) = emitted.image(*mcu) else { continue };
        assert_eq!(host.len(), ticks());
        assert_same_bits(name, &image, &config, &host);
        cost(name, &emitted, &image);
    }
}

/// What a tick of the exercise costs, against the committed figures in `tests/budgets/rate.json`; `SPECGEN_BLESS=1` renews
/// them. The exercise is what the figures without the option are from.
fn cost(name: &str, emitted: &Emitted, image: &Image) {
    let mut controller = emitted.at_run_time();
    let (model, ir) = (&emitted.compiled.model, &emitted.compiled.ir);
    let host = verify::exercise(&mut controller, model, ir, EXERCISE).unwrap();
    let m = verify::measure(image, &controller.default_config(), &host).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(m.first_difference, None, "{name}");
    assert_eq!(m.checks.faults, [], "{name}");
    let (step, leg) = (m.stage("step").unwrap(), m.stage("actuate").unwrap());
    let name = format!("{name}, {:?}", image.mcu);
    let stack = m.checks.stack.unwrap();
    println!(
        "{name}: step {:.0} mean {} max, actuate {:.0} mean {} max, State {}, stack {stack}, flash {}",
        step.mean, step.max, leg.mean, leg.max, m.state, m.flash
    );
    // Bounded, whatever the data: the inverse of (6) ends after a fixed number of steps.
    assert!(step.max <= 6 * leg.max + 4500, "{name}: {} instructions at most", step.max);
    assert_eq!(figures::held("rate.json", &name, &m.compiler, figures::cost(&m)), Vec::<String>::new());
}

/// The table of costs in docs/hysteresis.md has the committed figures.
#[test]
fn the_page_says_what_the_options_cost() {
    let rows = [
        ("legs, M7 f64: static, 64 extrema", "legs.json", "M7 f64"),
        ("creep, 3 operators, and dead time", "rate.json", "rate-creep, Mps2An500"),
        ("dynamic Preisach, 8 extrema", "rate.json", "rate-dynamic, Mps2An500"),
        ("the same, M7 f32", "rate.json", "rate-dynamic-f32, Mps2An500"),
        ("the same, M4F f32", "rate.json", "rate-dynamic-f32, Mps2An386"),
        ("platform, M7 f64: static", "platform.json", "M7 f64"),
        ("platform: creep, 3 operators", "rate.json", "rate-creep-platform, Mps2An500"),
        ("platform: dynamic Preisach, 8 extrema", "rate.json", "rate-dynamic-platform, Mps2An500"),
        ("platform: plays that widen with the rate", "rate.json", "rate-plays-platform, Mps2An500"),
    ];
    let rows = rows.map(|(cell, file, name)| format!("| {cell} | {} |", figures::cost_columns(file, name)));
    figures::shown("hysteresis.md", &rows);
}

#[test]
#[ignore = "long: creep; the dynamic model is compared in the test run"]
fn creep_of_legs_is_equal_in_every_bit() {
    equal_bits("rate-creep", "legs.toml", &[("memory  = 64", CREEP)], &[Mcu::Mps2An500], false);
}

#[test]
#[ignore = "long: below in single precision, and of a platform"]
fn dynamic_preisach_of_legs_is_equal_in_every_bit() {
    equal_bits("rate-dynamic", "legs.toml", &[("memory  = 64", DYNAMIC)], &[Mcu::Mps2An500], true);
}

#[test]
#[ignore = "long: single precision, on the emulated M4F and M7"]
fn dynamic_preisach_in_f32_is_equal_in_every_bit() {
    let f32 = ("scalar   = \"f64\"", "scalar   = \"f32\"");
    let mcus = &[Mcu::Mps2An386, Mcu::Mps2An500];
    equal_bits("rate-dynamic-f32", "legs.toml", &[("memory  = 64", DYNAMIC), f32], mcus, true);
}

#[test]
#[ignore = "long: single precision; those of a platform are in the test run"]
fn plays_of_legs_that_widen_in_f32_are_equal_in_every_bit() {
    let f32 = ("scalar   = \"f64\"", "scalar   = \"f32\"");
    let mcus = &[Mcu::Mps2An386, Mcu::Mps2An500];
    equal_bits("rate-plays-f32", "legs.toml", &[WIDENED, f32], mcus, false);
}

#[test]
fn plays_of_a_platform_that_widen_are_equal_in_every_bit() {
    equal_bits("rate-plays-platform", "reference.toml", &[WIDENED], &[Mcu::Mps2An500], false);
}

#[test]
fn both_options_of_a_platform_are_equal_in_every_bit() {
    let creep = CREEP.replace("\ndead_time = \"0.35 ms\"", "");
    // In the short run the law of the dynamic model on the host: the image of a rate-dependent platform is that of the test above.
    let mcus = length(&[][..], &[Mcu::Mps2An500]);
    if length(true, false) {
        skipped(
            "only in the full run: creep of a platform, which is that of six legs, and the image of the dynamic model",
        );
    } else {
        equal_bits("rate-creep-platform", "reference.toml", &[("memory  = 64", &creep)], mcus, false);
    }
    equal_bits("rate-dynamic-platform", "reference.toml", &[("memory  = 64", DYNAMIC)], mcus, true);
}

#[test]
fn a_file_of_plays_is_checked_its_table_made_again_and_its_gain_refitted() {
    let text = widened_leg();
    let read = |text: &str| read_leg_csv(text, "plays.csv");
    let leg = read(&text).unwrap();
    let around = leg.around.clone().unwrap();
    let sum = |around: &Around| around.plays.as_ref().unwrap().weights.iter().sum::<f64>();
    assert!((sum(&around.refitted(1.1, 0.0).unwrap()) / sum(&around) - 1.1).abs() < 1e-12);
    // The table follows from the plays, whatever the rows say.
    let double = |line: &str| match line.rsplit_once(',') {
        Some((cell, value)) if !line.starts_with('#') && !line.starts_with('u') => {
            format!("{cell},{}", 2.0 * value.parse::<f64>().unwrap())
        }
        _ => line.to_owned(),
    };
    let doubled = text.lines().map(double).collect::<Vec<_>>().join("\n");
    assert!(doubled != text);
    assert_eq!(read(&doubled).unwrap().table.nodes, leg.table.nodes);
    for (from, to) in [
        ("\"kappa\":0.02", "\"kappa\":2"),
        ("\"v0_V_per_s\":20.0", "\"v0_V_per_s\":1e-310"),
        ("\"lag_s\":0.002", "\"lag_s\":1e12"),
        ("um_per_V\":[0.44", "um_per_V\":[1e-9"),
        ("_V\":[0.0,2.0,", "_V\":[0.0,6.0,"),
        ("\"slope_um_per_V\":0.0,\"beta_per_V\":0.0", "\"slope_um_per_V\":0.1,\"beta_per_V\":0.1"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert!(changed != text, "{from}");
        assert!(read(&changed).unwrap_err()[0].message.contains("plays are expected"), "{to}");
    }
}

/// Without the option nothing of it is emitted: a controller whose rate model is empty is the static one, tick for tick.
#[test]
fn creep_without_weight_moves_as_the_static_model_does() {
    let empty = "memory  = 64\nrate = \"creep\"\ncreep_times = [\"1 s\"]\ncreep_weights = [0]";
    let with = Emitted::new("rate-empty", "legs.toml", &[("memory  = 64", empty)]);
    let without = Emitted::new("rate-none", "legs.toml", &[]);
    let text = |emitted: &Emitted| emitted.compiled.files().remove("controller/src/hysteresis.rs").unwrap();
    assert!(text(&with).contains("Creep") && !text(&without).contains("Creep"));
    let mut traces = [&with, &without].map(|emitted| {
        let mut controller = emitted.at_run_time();
        let inputs = without.stimulus(&controller.description().clone(), false, 20_000, 5);
        host_trace(&mut controller, &[("mode", 2.0), ("setpoint_kind", 1.0)], &inputs).0
    });
    let [with, without] = &mut traces;
    for leg in 0..6 {
        for word in ["voltage", "requested"] {
            let name = format!("{word}[{leg}]");
            assert_eq!(column(with, &name), column(without, &name), "{name}");
        }
    }
}

/// The reversal curves of the reference leg at 20, 200 and 2000 V/s: sweeps over the range in 5 s, 0.5 s and 50 ms.
fn records() -> Vec<Record> {
    let parameters = LegParameters::reference();
    let record = |rate: f64| {
        let experiment = ReversalExperiment { rate, ..ReversalExperiment::reference(32) };
        let mut leg = LegPlant::new(&parameters);
        let text = experiment.run(&mut leg, &mut Gauge::new(&parameters.noise, 1, 0)).to_csv();
        parse_record(&text, &format!("{rate} V/s")).unwrap_or_else(|found| panic!("{found:#?}"))
    };
    [20.0, 200.0, 2000.0].map(record).to_vec()
}

/// RMSE in nm at 0.1, 1 and 10 Hz under Invhys and PCC with one tick of 250 µs, as the study's column at 4 kHz.
fn tracking(name: &str, lines: &str, records: &[(&str, String)]) -> [[f64; 3]; 2] {
    let block = format!("[hysteresis]\nmemory = 64\n{lines}\n[unused]\n");
    let old = "[hysteresis]\ngrid    = 32\nmemory  = 64\nrecords = [\"records/reference-forc.csv\"]  # one for all six legs, or six\n";
    let block = block.replace("\n[unused]\n", "");
    let edits = [(old, block.as_str()), ("\"200 us\"", "\"250 us\"")];
    let emitted = Emitted::with_records(name, "legs.toml", &edits, records);
    let mut controller = emitted.at_run_time();
    let legs = std::array::from_fn(|_| LegParameters::reference());
    let mut result = [[f64::NAN; 3]; 2];
    for (k, frequency) in [0.1, 1.0, 10.0].into_iter().enumerate() {
        let samples = (4000.0 / frequency) as u32;
        let scenario = LegScenario::new(&legs, &LegParameters::reference().noise, 1, samples);
        let modes = [MODES[0], MODES[2]];
        let table = scenario.tracking(&mut controller, &modes, &[frequency]).unwrap_or_else(|error| panic!("{error}"));
        for (row, (mode, _)) in result.iter_mut().zip(modes) {
            row[k] = table.rmse_nm(mode, frequency).unwrap();
        }
    }
    let mut status = |mode: f64| {
        // Share of the ticks of the 10 Hz run in which a leg was inverted statically.
        let mut words = controller.default_config();
        controller.description().set_config(&mut words, "mode", mode).unwrap();
        controller.description().set_config(&mut words, "setpoint_kind", 1.0).unwrap();
        controller.configure(&words).unwrap();
        let run =
            LegScenario::new(&legs, &LegParameters::reference().noise, 1, 400).run(&mut controller, 10.0).unwrap();
        let words = integers(&run.trace, "status");
        words.iter().filter(|word| **word & FELL_BACK != 0).count() as f64 / words.len() as f64
    };
    println!("{name:<24} static inverse in {:.0} % of the ticks at 10 Hz", 100.0 * status(0.0));
    for (row, mode) in result.iter().zip(["invhys", "pcc"]) {
        println!("{name:<24} {mode:<7} {:>7.1} {:>7.1} {:>7.1} nm", row[0], row[1], row[2]);
    }
    result
}

fn option(found: &RateIdentification, wanted: RateOption) -> &RateModel {
    &found.models.iter().find(|(option, _)| *option == wanted).unwrap().1
}

/// What the study found holds for the emitted controller: on the reference plant (6) beats the static inverse at 1 Hz, and not at 10 Hz, nor under
/// PCC; creep with lead does both.
#[test]
#[ignore = "long: the study of the options, of five controllers"]
fn what_the_options_are_worth_on_the_reference_plant() {
    let records = records();
    let found = identify_rate(&records, None, &Options::new(32, [0.0, 100.0])).unwrap_or_else(|d| panic!("{d:#?}"));
    println!("{:#?}", found.report.options);
    println!("{}", found.report.verdict.text);
    let run = |name: &str, found: &RateIdentification, wanted: RateOption| {
        let model = option(found, wanted);
        let mut files = vec![("table.csv", write_table_csv(&model.still))];
        files.extend(model.rate.as_ref().map(|rate| ("mu1.csv", write_rate_csv(rate))));
        let lines = spec_lines(wanted, model, found.report.held, "records/table.csv", "records/mu1.csv");
        tracking(name, &lines, &files)
    };
    // What a user has without any of this: the table of the slowest record.
    let slow = identify(&records[0], &Options::new(32, [0.0, 100.0])).unwrap();
    let line = "grid = 32\nrecords = [\"records/table.csv\"]";
    let [slow, slow_pcc] = tracking("rate-plant-slow", line, &[("table.csv", write_table_csv(&slow.table))]);
    let [still, still_pcc] = run("rate-plant-static", &found, RateOption::Static);
    run("rate-plant-dead-time", &found, RateOption::DeadTime);
    let [dynamic, dynamic_pcc] = run("rate-plant-dynamic", &found, RateOption::DynamicPreisach);
    let [creep, creep_pcc] = run("rate-plant-creep", &found, RateOption::Creep);
    // The table of the slowest record gives the study's row: 127, 242 and about 500 nm.
    for (ours, study) in slow.iter().zip([127.0, 242.0, 500.0]) {
        assert!((ours / study - 1.0).abs() < 0.1, "{ours} against {study}");
    }
    // (6) against the static table of the same records, and against that of the slowest one under PCC.
    assert!(dynamic[1] < still[1] && dynamic[2] > still[2], "{dynamic:?} {still:?}");
    assert!(
        dynamic_pcc[2] > still_pcc[2] && dynamic_pcc[2] > slow_pcc[2],
        "{dynamic_pcc:?} {still_pcc:?} {slow_pcc:?}"
    );
    // Creep and lead at 10 Hz: the study has 195 nm alone and 10.4 nm with PCC.
    assert!(creep[2] < 0.7 * still[2] && creep[2] < 0.3 * slow[2], "{creep:?}");
    assert!(creep_pcc[2] < 0.8 * still_pcc[2] && creep_pcc[2] < 12.0, "{creep_pcc:?} {still_pcc:?}");
    // It has its price: alone, its slow states are off for as long as they take to settle.
    assert!(creep[0] > slow[0], "{creep:?} {slow:?}");
}
