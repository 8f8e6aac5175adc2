//! Host, Cortex-M7 and Cortex-M4F compute the same bits: every output word and the state digest of every tick, from one
//! recorded input with saturation, reversals on thresholds, ±0, subnormals, NaN and infinities.

use crate::supervisor::bench::{ALIGNED, SECTION};
use host_sim::controller::TickController;
use host_sim::trace::{Trace, first_difference};
use specgen::ir::Ir;
use specgen::model::Mcu;
use specgen::verify;
use specgen_tests::{Emitted, assert_same_bits, column, compile_edited, host_trace, integers};

/// Ticks of each comparison.
fn ticks() -> usize {
    specgen_tests::length(10_000, 100_000)
}
/// With the supervisor of its tests, whose image this is, too.
const SUPERVISED: (&str, &str) = ("[timing]\n", SECTION);
const CODES_PER_CELL: i64 = 1250;
const F32: (&str, &str) = ("scalar   = \"f64\"", "scalar   = \"f32\"");

/// Set-points (poses or legs) and law of a run. Under Invhys nothing disturbs the requests, so that drives turn exactly on
/// thresholds.
const RUNS: [(&str, bool, f64); 3] =
    [("legs, pcc", false, 2.0), ("legs, invhys", false, 0.0), ("poses, ewma", true, 1.0)];

fn compare(name: &str, edits: &[(&str, &str)], mcus: &[Mcu]) {
    let emitted = Emitted::new(name, "legs.toml", edits);
    let mut controller = emitted.at_run_time();
    let description = controller.description().clone();
    for (what, pose, mode) in RUNS {
        let inputs = emitted.stimulus(&description, pose, ticks(), 7);
        let kind = if pose { 0.0 } else { 1.0 };
        let (host, config) = host_trace(&mut controller, &[("mode", mode), ("setpoint_kind", kind)], &inputs);
        covers(&host, what, pose);
        for mcu in mcus {
            let Some(image) = emitted.image(*mcu) else { continue };
            assert_eq!(host.len(), ticks());
            assert_same_bits(&format!("{name}, {what}"), &image, &config, &host);
        }
    }
}

/// The recording really holds what it is meant to hold.
fn covers(trace: &Trace, what: &str, pose: bool) {
    let status = integers(trace, "status");
    let count = |mask: u64| status.iter().filter(|word| *word & mask != 0).count();
    assert!(count(0x3f) > 100, "{what}: saturation");
    assert!(count(0x3f00) > 100, "{what}: gauge faults");
    assert!(count(0x1_0000) > 100, "{what}: set-point faults");
    let first_leg = 1 | 0x100 | 0x1_0000;
    assert!(status.iter().filter(|word| **word & first_leg == 0).count() > 200, "{what}: undisturbed ticks of a leg");
    if !pose && what.contains("invhys") {
        let codes: Vec<i64> = integers(trace, "dac_code[0]").iter().map(|code| *code as i64).collect();
        let on_threshold = codes
            .windows(3)
            .filter(|w| w[1] % CODES_PER_CELL == 0 && (w[1] - w[0]).signum() * (w[2] - w[1]).signum() < 0)
            .count();
        assert!(on_threshold > 20, "{what}: only {on_threshold} reversals on thresholds");
    }
    let inputs = trace.description().input_names.len();
    let scalar = trace.description().scalar;
    let numbers = || trace.rows().flat_map(|row| row[..inputs].iter()).map(|word| scalar.decode(*word));
    assert!(numbers().any(f64::is_nan) && numbers().any(f64::is_infinite), "{what}: NaN and infinity");
    assert!(numbers().any(|x| x == 0.0 && x.is_sign_negative()), "{what}: −0");
    let smallest = if scalar.bits() == 32 { f64::from(f32::MIN_POSITIVE) } else { f64::MIN_POSITIVE };
    assert!(numbers().any(|x| x != 0.0 && x.abs() < smallest), "{what}: subnormals");
    for leg in 0..6 {
        for name in ["voltage", "requested", "demand", "level", "drift"] {
            assert!(column(trace, &format!("{name}[{leg}]")).iter().all(|x| x.is_finite()), "{what}: {name}[{leg}]");
        }
        assert!(column(trace, &format!("voltage[{leg}]")).iter().all(|u| (0.0..=100.0).contains(u)), "{what}: limits");
    }
}

#[test]
fn f64_on_the_host_and_the_m7_is_equal_in_every_bit() {
    compare("bits-f64", &[SUPERVISED, ALIGNED], &[Mcu::Mps2An500]);
}

#[test]
#[ignore = "long: single precision, on the emulated M4F and M7"]
fn f32_on_the_host_the_m7_and_the_m4f_is_equal_in_every_bit() {
    compare("bits-f32", &[ALIGNED, F32], &[Mcu::Mps2An386, Mcu::Mps2An500]);
}

/// With room for eight extrema the memory overflows all the time, and what it drops is the same everywhere.
#[test]
#[ignore = "long: a controller of little memory"]
fn an_overflowing_memory_is_equal_in_every_bit() {
    let emitted = Emitted::new("bits-memory", "legs.toml", &[ALIGNED, ("memory  = 64", "memory  = 8")]);
    let mut controller = emitted.at_run_time();
    let roomy = Emitted::new("bits-roomy", "legs.toml", &[ALIGNED]);
    let inputs = emitted.stimulus(&controller.description().clone(), false, 20_000, 9);
    let settings = [("mode", 0.0), ("setpoint_kind", 1.0)];
    let (host, config) = host_trace(&mut controller, &settings, &inputs);
    let (unbounded, _) = host_trace(&mut roomy.at_run_time(), &settings, &inputs);
    let differs = column(&host, "requested[0]").iter().zip(&column(&unbounded, "requested[0]")).any(|(a, b)| a != b);
    assert!(differs, "the record never overfilled the memory");
    let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
    assert_same_bits("overflowing memory", &image, &config, &host);
}

/// The comparison is falsifiable: one flipped ulp of one constant of the controller on one side is found, and named.
#[test]
fn one_ulp_of_one_constant_is_found_with_tick_and_signal() {
    let good = Emitted::new("ulp-good", "legs.toml", &[SUPERVISED, ALIGNED]);
    let Some(image) = good.image(Mcu::Mps2An500) else { return };
    // E(N, 0): a saturated leg shows it as it is. Of another node an ulp may be lost in rounding, tick after tick.
    let grid = good.compiled.ir.hysteresis.grid;
    type Constant = fn(&mut Ir, usize) -> &mut f64;
    let cases: [(&str, Constant, bool, &str); 3] = [
        ("a node of the table", |ir, grid| &mut ir.hysteresis.tables[0][grid * (grid + 1) / 2], false, "requested"),
        ("a direction of a leg", |ir, _| &mut ir.kinematics.rest_leg[2][0], true, "demand[2]"),
        ("volts per code", |ir, _| &mut ir.actuation.volts_per_code, false, "voltage"),
    ];
    for (what, constant, pose, signal) in cases {
        let mut bad = compile_edited("ulp-bad", "legs.toml", &[SUPERVISED, ALIGNED], &[]);
        let value = constant(&mut bad.ir, grid);
        *value = f64::from_bits(value.to_bits() + 1);
        let bad = Emitted::of("ulp-bad", bad.into());
        let mut controller = bad.at_run_time();
        let inputs = bad.stimulus(&controller.description().clone(), pose, 3000, 7);
        let kind = if pose { 0.0 } else { 1.0 };
        let (host, config) = host_trace(&mut controller, &[("setpoint_kind", kind)], &inputs);
        let (target, _) = verify::replay(&image, &config, &host).unwrap_or_else(|error| panic!("{error}"));
        let difference =
            first_difference(&host, &target).unwrap_or_else(|| panic!("{what}: the flipped ulp was not seen"));
        let text = difference.to_string();
        println!("{what}: {text}");
        assert!(text.starts_with("tick ") && text.contains(signal), "{what}: {text}");
    }
}
