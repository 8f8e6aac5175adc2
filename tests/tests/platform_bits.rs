//! The controller in task space computes the same bits on the host, the Cortex-M7 and the Cortex-M4F: every output word and
//! the state digest of every tick, in every mode, from one recorded input with streams that jump and dry up, moves,
//! trajectories, gauge and force faults, saturation, ±0, subnormals, NaN and infinities.

use std::fs;

use host_sim::controller::TickController;
use host_sim::trace::{Trace, first_difference};
use specgen::model::Mcu;
use specgen::verify;
use specgen_tests::{Emitted, column, host_trace, integers};

/// Ticks of each mode.
const TICKS: usize = 100_000;
/// Mode words with their names, and the source of the interaction force that the run exercises.
const MODES: [(&str, f64, f64); 7] = [
    ("P", 0.0, 0.0),
    ("F invhys", 1.0, 1.0),
    ("F ewma", 2.0, 2.0),
    ("F pcc", 3.0, 0.0),
    ("P/F invhys", 4.0, 2.0),
    ("P/F ewma", 5.0, 0.0),
    ("P/F pcc", 6.0, 1.0),
];
const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");

fn compare(name: &str, edits: &[(&str, &str)], mcus: &[Mcu]) {
    let emitted = Emitted::new(name, "reference.toml", edits);
    let mut controller = emitted.controller();
    let description = controller.description().clone();
    for (seed, (what, mode, interaction)) in (20..).zip(MODES) {
        let inputs = emitted.platform_stimulus(&description, TICKS, seed);
        let settings = [("mode", mode), ("interaction", interaction), ("environment_stiffness[2]", 3e6)];
        let (host, config) = host_trace(&mut controller, &settings, &inputs);
        covers(&host, what);
        for mcu in mcus {
            let Some(image) = emitted.image(*mcu) else { continue };
            let (target, _) = verify::replay(&image, &config, &host).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(target.len(), TICKS);
            let difference = first_difference(&host, &target);
            assert!(difference.is_none(), "{name}, {what}, {mcu:?}: {}", difference.unwrap());
            println!("{name}, {what}, {mcu:?}: {TICKS} ticks, no differing word");
        }
    }
}

/// The recording really holds what it is meant to hold, and nothing that comes out is beyond its limits.
fn covers(trace: &Trace, what: &str) {
    let status = integers(trace, "status");
    let faults = [
        (0x3f, "saturation"),
        (0x3f00, "gauge faults"),
        (0x1_0000, "refused set-points"),
        (0x2_0000, "a stale stream"),
        (0x4_0000, "moves"),
        (0x8_0000, "force faults"),
    ];
    for (mask, name) in faults {
        let count = status.iter().filter(|word| *word & mask != 0).count();
        assert!(count > 100, "{what}: only {count} ticks with {name}");
        assert!(status.len() - count > 100, "{what}: only {} ticks without {name}", status.len() - count);
    }
    let inputs = trace.description().input_names.len();
    let scalar = trace.description().scalar;
    let numbers = || trace.rows().flat_map(|row| row[3..inputs].iter()).map(|word| scalar.decode(*word));
    assert!(numbers().any(f64::is_nan) && numbers().any(f64::is_infinite), "{what}: NaN and infinity");
    for leg in 0..6 {
        for name in ["voltage", "requested", "demand", "level", "drift", "pose", "target", "load"] {
            let name = format!("{name}[{leg}]");
            assert!(column(trace, &name).iter().all(|x| x.is_finite()), "{what}: {name}");
        }
        let voltage = column(trace, &format!("voltage[{leg}]"));
        assert!(voltage.iter().all(|u| (0.0..=100.0).contains(u)), "{what}: voltage limits");
        let codes: Vec<i64> = integers(trace, &format!("dac_code[{leg}]")).iter().map(|code| *code as i64).collect();
        let fastest = codes.windows(2).map(|pair| (pair[1] - pair[0]).abs()).max();
        // 40 V/ms over 100 µs of 2.29 mV codes.
        assert!(fastest <= Some(1747), "{what}: slew {fastest:?} codes");
    }
}

#[test]
fn f64_on_the_host_and_the_m7_is_equal_in_every_bit_of_every_mode() {
    compare("platform-bits-f64", &[], &[Mcu::Mps2An500]);
}

#[test]
fn f32_on_the_host_the_m7_and_the_m4f_is_equal_in_every_bit_of_every_mode() {
    compare("platform-bits-f32", &[F32], &[Mcu::Mps2An500, Mcu::Mps2An386]);
}

/// The comparison is falsifiable: one flipped ulp of one constant of each new part is found, and named.
#[test]
fn one_ulp_of_one_constant_is_found_with_tick_and_signal() {
    let good = Emitted::new("platform-ulp-good", "reference.toml", &[]);
    let Some(image) = good.image(Mcu::Mps2An500) else { return };
    let task = good.compiled.ir.task_space.as_ref().unwrap();
    let notch = task.law.notch.as_ref().unwrap();
    let cases = [
        ("controller/src/task_space.rs", notch.sections[2].depth, "voltage"),
        ("controller/src/task_space.rs", task.law.wrench_to_legs[1][2], "requested"),
        ("controller/src/config.rs", task.defaults.gains.integral[0], "requested"),
    ];
    for (file, value, _signal) in cases {
        let bad = Emitted::new("platform-ulp-bad", "reference.toml", &[]);
        let path = bad.dir.join(file);
        let text = fs::read_to_string(&path).unwrap();
        let (old, new) = (format!("{:?}", value.abs()), format!("{:?}", f64::from_bits(value.abs().to_bits() + 1)));
        assert!(text.contains(&old), "{file} has no {old}");
        fs::write(&path, text.replacen(&old, &new, 1)).unwrap();

        let mut controller = bad.controller();
        let inputs = bad.platform_stimulus(&controller.description().clone(), 5000, 7);
        let (host, _) = host_trace(&mut controller, &[("mode", 6.0)], &inputs);
        // The target gets its own default settings, so that a settings constant is compared too.
        let mut unchanged = good.controller();
        let (_, config) = host_trace(&mut unchanged, &[("mode", 6.0)], &inputs);
        let (target, _) = verify::replay(&image, &config, &host).unwrap_or_else(|error| panic!("{error}"));
        let difference =
            first_difference(&host, &target).unwrap_or_else(|| panic!("{file}: the flipped ulp was not seen"));
        println!("{file}: {difference}");
        assert!(difference.to_string().starts_with("tick "), "{file}: {difference}");
    }
}
