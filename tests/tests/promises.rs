//! Whatever the inputs and whatever the settings: every output is finite, every voltage within limits and within the
//! slew limit, every internal number finite.

use host_sim::controller::{Controller, TickController};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_tests::Emitted;

const F32: (&str, &str) = ("scalar   = \"f64\"", "scalar   = \"f32\"");

/// Places of the words of a controller.
struct Words {
    voltage: usize,
    code: usize,
    numbers: std::ops::Range<usize>,
    status: usize,
}

fn words(controller: &Controller) -> Words {
    let output = |name: &str| controller.description().output(name).expect("an output word");
    Words {
        voltage: output("voltage[0]"),
        code: output("dac_code[0]"),
        numbers: output("voltage[0]")..output("dac_code[0]"),
        status: output("status"),
    }
}

fn ticks() -> u32 {
    specgen_tests::length(120_000, 1_200_000)
}

/// Random bits in every input word: half of them raw (NaN, infinite, huge, tiny), half plausible.
fn fuzz(name: &str, edits: &[(&str, &str)], ticks: u32) {
    let emitted = Emitted::new(name, "legs.toml", edits);
    let mut controller = emitted.at_run_time();
    let places = words(&controller);
    let scalar = controller.description().scalar;
    let limits = emitted.compiled.model.actuator.voltage;
    let step = emitted.compiled.ir.defaults.max_step;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut input = vec![0; controller.description().input_names.len()];
    let mut output = vec![0; controller.description().output_names.len()];
    for round in 0..6_u32 {
        let mut config = controller.default_config();
        controller.description().set_config(&mut config, "mode", f64::from(round % 3)).expect("a setting");
        controller.description().set_config(&mut config, "setpoint_kind", f64::from(round / 3)).expect("a setting");
        controller.configure(&config).expect("permitted settings");
        controller.reset();
        let mut codes = [0_i64; 6];
        let mut undisturbed = 0;
        for tick in 0..ticks / 6 {
            let raw = rng.next_u64() % 4 == 0;
            for word in &mut input {
                let bits = rng.next_u64();
                *word = if raw && rng.next_u64() % 2 == 0 {
                    if scalar.bits() == 32 { bits & 0xffff_ffff } else { bits }
                } else {
                    scalar.encode(bits as f64 / 2f64.powi(64) * 39e-6)
                };
            }
            controller.step(&input, &mut output);
            for place in places.numbers.clone() {
                let value = scalar.decode(output[place]);
                assert!(value.is_finite(), "{name}, round {round}, tick {tick}: output word {place} is {value}");
            }
            for leg in 0..6 {
                let voltage = scalar.decode(output[places.voltage + leg]);
                assert!((limits[0]..=limits[1]).contains(&voltage), "{name}, round {round}, tick {tick}: {voltage} V");
                let code = output[places.code + leg] as i64;
                assert!((code - codes[leg]).abs() <= i64::from(step), "{name}, round {round}, tick {tick}: slew");
                codes[leg] = code;
            }
            undisturbed += u32::from(output[places.status] & 0x1_3f00 == 0);
        }
        assert!(undisturbed > ticks / 60, "{name}: the fuzz must also reach ticks without faults");
    }
}

#[test]
fn f64_outputs_stay_finite_and_within_limits_for_any_input_bits() {
    fuzz("promises-f64", &[], ticks());
}

#[test]
fn f32_outputs_stay_finite_and_within_limits_for_any_input_bits() {
    fuzz("promises-f32", &[F32], ticks());
}

/// Settings come from outside as words: those that would break a promise are refused and leave the old ones in force.
#[test]
fn settings_that_would_break_a_promise_are_refused() {
    let emitted = Emitted::new("promises-config", "legs.toml", &[]);
    let mut controller = emitted.at_run_time();
    let good = controller.default_config();
    let (min, max) = (emitted.compiled.ir.actuation.code_min, emitted.compiled.ir.actuation.code_max);
    let step = emitted.compiled.ir.defaults.max_step as u64;
    let bad: [(&str, u64); 17] = [
        ("mode", 3),
        ("setpoint_kind", 2),
        ("level_weight", f64::NAN.to_bits()),
        ("level_weight", (-0.1f64).to_bits()),
        ("level_weight", 1.0000001f64.to_bits()),
        ("level_weight", f64::INFINITY.to_bits()),
        ("drift_weight", f64::NAN.to_bits()),
        ("drift_weight", 2f64.to_bits()),
        ("run_interval", 0),
        ("run_interval", u64::MAX),
        ("run_interval", 1_000_001),
        ("max_step_codes", 0),
        ("max_step_codes", u64::MAX),
        // What `actuator.slew_rate` permits, and a code more.
        ("max_step_codes", step + 1),
        ("code_min", (max + 1) as u64),
        ("code_max", (max + 1) as u64),
        ("code_max", (min as i64 - 1) as u64),
    ];
    for (name, word) in bad {
        let mut words = good.clone();
        let place = controller.description().config_names.iter().position(|known| known == name).expect("a setting");
        words[place] = word;
        let error = controller.configure(&words).expect_err(name).to_string();
        assert!(error.contains(name), "{name} = {word:x}: {error}");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..specgen_tests::length(20_000, 100_000) {
        let words: Vec<u64> =
            good.iter().map(|word| if rng.next_u64() % 4 == 0 { rng.next_u64() } else { *word }).collect();
        if controller.configure(&words).is_ok() {
            let weight = |k: usize| f64::from_bits(words[k]);
            assert!((0.0..=1.0).contains(&weight(2)) && (0.0..=1.0).contains(&weight(3)));
            assert!(words[6] <= words[7] && words[7] <= max as u64 && words[4] > 0);
            assert!((1..=step).contains(&words[5]));
        }
    }
}
