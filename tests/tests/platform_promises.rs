//! Controllers keep their promises whatever the inputs and whatever the settings, also while these change:
//! every output is finite, every voltage within limits and within the slew limit; settings that could break that are refused.

use std::fs;
use std::process::Command;

use host_sim::controller::{Controller, TickController};
use host_sim::word::Scalar;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::ir::Range;
use specgen_tests::Emitted;

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
fn ticks() -> u32 {
    specgen_tests::length(100_000, 1_000_000)
}
/// Ticks under one `Config`.
const STRETCH: u32 = 2000;
/// Ticks from one reset to the next.
const LIFE: u32 = 20_000;
/// Status bits that are not about the legs' limits or the generator's work: faults of inputs; of six legs and of a platform.
const FAULTS: [u64; 2] = [0x1_3f00, 0xb_3f00];

struct Fuzz {
    rng: ChaCha8Rng,
    scalar: Scalar,
    /// Of six legs.
    legs: bool,
}

impl Fuzz {
    fn below(&mut self, bound: u64) -> u64 {
        self.rng.next_u64() % bound
    }

    /// Uniform in [0, 1].
    fn unit(&mut self) -> f64 {
        self.rng.next_u64() as f64 / u64::MAX as f64
    }

    /// Uniform in [−1, 1].
    fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn bits(&mut self) -> u64 {
        let bits = self.rng.next_u64();
        if self.scalar.bits() == 32 { bits & 0xffff_ffff } else { bits }
    }

    /// 0, or any size from 1e-3 to `largest`.
    fn magnitude(&mut self, largest: f64) -> f64 {
        if self.below(4) == 0 { 0.0 } else { 1e-3 * (largest * 1e3).powf(self.unit()) }
    }

    /// Settings that are permitted, most of them absurd.
    fn settings(&mut self, controller: &Controller, codes: [i64; 2], slew: u64) -> Vec<u64> {
        let description = controller.description();
        let mut words = controller.default_config();
        if self.below(4) == 0 {
            return words;
        }
        for name in &description.config_names {
            let stem = name.split('[').next().unwrap_or(name);
            let value = match stem {
                "mode" => self.below(if self.legs { 3 } else { 7 }) as f64,
                "setpoint_kind" => self.below(2) as f64,
                "run_interval" => 1.0 + self.below(9) as f64,
                "interaction" => self.below(3) as f64,
                "level_weight" | "drift_weight" => self.unit(),
                "max_step_codes" => 1.0 + self.below(slew) as f64,
                // Both limits anywhere, the lower one in the lower half.
                "code_min" => (codes[0] + self.below((codes[1] - codes[0]) as u64 / 2) as i64) as f64,
                "code_max" => (codes[1] - self.below((codes[1] - codes[0]) as u64 / 2) as i64) as f64,
                "environment_rest" => 0.1 * self.symmetric(),
                // The largest gain, rounded to f32, is still permitted.
                "kp" | "ki" | "kv" | "position_kp" | "position_ki" | "position_kv" | "environment_stiffness" => {
                    self.magnitude(0.999e15)
                }
                other => panic!("an unknown setting {other}"),
            };
            description.set_config(&mut words, name, value).expect("a setting");
        }
        words
    }

    /// A row of inputs: plausible, but for one row in four where half of the words are any bits.
    fn row(&mut self, controller: &Controller, input: &mut [u64], sequence: &mut u64, calm: bool) {
        let raw = !calm && self.below(4) == 0;
        for (place, name) in controller.description().input_names.iter().enumerate() {
            let plausible = match name.split('[').next().unwrap_or(name) {
                "command" => self.below(5),
                "selector" => self.below(4),
                "sequence" => {
                    *sequence += self.below(2);
                    *sequence
                }
                stem => {
                    let value = match stem {
                        "displacement" | "setpoint" if self.legs => 39e-6 * self.unit(),
                        "setpoint" => 1e-6 * self.symmetric(),
                        "setpoint_rate" => 1e-3 * self.symmetric(),
                        "setpoint_acceleration" => self.symmetric(),
                        "gauge" => 54e-6 * self.symmetric(),
                        "wrench" => 3.0 * self.symmetric(),
                        other => panic!("an unknown input {other}"),
                    };
                    self.scalar.encode(value)
                }
            };
            let spoilt = raw && self.below(2) == 0;
            input[place] = match name.as_str() {
                "command" | "selector" | "sequence" if spoilt => self.rng.next_u64(),
                _ if spoilt => self.bits(),
                _ => plausible,
            };
        }
    }
}

fn fuzz(name: &str, spec: &str, edits: &[(&str, &str)]) {
    let emitted = Emitted::new(name, spec, edits);
    let mut controller = emitted.at_run_time();
    let description = controller.description().clone();
    let place = |name: &str| description.output(name).expect("an output word");
    let (voltage, code, status) = (place("voltage[0]"), place("dac_code[0]"), place("status"));
    let numbers: Vec<usize> = (0..status).filter(|k| !(code..code + 6).contains(k)).collect();
    let setting = |name: &str| description.config_names.iter().position(|known| known == name).expect("a setting");
    let max_step = setting("max_step_codes");
    let actuation = &emitted.compiled.ir.actuation;
    let codes = [i64::from(actuation.code_min), i64::from(actuation.code_max)];
    let [low, high] = emitted.compiled.model.actuator.voltage;
    let slew = i64::from(emitted.compiled.ir.defaults.max_step);

    let mut fuzz = Fuzz { rng: ChaCha8Rng::seed_from_u64(17), scalar: description.scalar, legs: spec == "legs.toml" };
    let mut input = vec![0; description.input_names.len()];
    let mut output = vec![0; description.output_names.len()];
    let (mut previous, mut sequence, mut step, mut calm) = ([codes[0]; 6], 0, 0, false);
    let (mut healthy, mut faulty, mut largest) = (0, 0, 0);
    for tick in 0..ticks() {
        if tick % LIFE == 0 {
            controller.reset();
            previous = [codes[0]; 6];
        }
        if tick % STRETCH == 0 {
            let words = fuzz.settings(&controller, codes, slew as u64);
            controller.configure(&words).unwrap_or_else(|error| panic!("{name}, tick {tick}: {error}"));
            step = words[max_step] as i64;
            calm = fuzz.below(3) == 0;
        }
        fuzz.row(&controller, &mut input, &mut sequence, calm);
        controller.step(&input, &mut output);
        for place in &numbers {
            let value = description.scalar.decode(output[*place]);
            assert!(value.is_finite(), "{name}, tick {tick}: {} is {value}", description.output_names[*place]);
        }
        for leg in 0..6 {
            let volts = description.scalar.decode(output[voltage + leg]);
            assert!((low..=high).contains(&volts), "{name}, tick {tick}: {volts} V");
            let now = output[code + leg] as i64;
            let change = (now - previous[leg]).abs();
            assert!(change <= step, "{name}, tick {tick}: leg {leg} moved by {change} codes, {step} permitted");
            largest = largest.max(change);
            previous[leg] = now;
        }
        let faults = output[status] & FAULTS[usize::from(!fuzz.legs)] != 0;
        (healthy, faulty) = (healthy + u32::from(!faults), faulty + u32::from(faults));
    }
    let ticks = ticks();
    println!("{name}: {ticks} ticks, {healthy} without and {faulty} with a fault, largest step {largest} codes");
    assert!(healthy > ticks / 20 && faulty > ticks / 20, "{name}: {healthy} without, {faulty} with a fault");
    assert!(largest > slew * 9 / 10 && largest <= slew, "{name}: {largest} of {slew} codes a tick");
}

#[test]
fn f64_outputs_stay_finite_and_within_limits_for_any_input_bits_and_settings() {
    fuzz("promises-f64", "legs.toml", &[]);
    fuzz("platform-promises-f64", "reference.toml", &[]);
}

#[test]
fn f32_outputs_stay_finite_and_within_limits_for_any_input_bits_and_settings() {
    fuzz("promises-f32", "legs.toml", &[("scalar   = \"f64\"", "scalar   = \"f32\"")]);
    fuzz("platform-promises-f32", "reference.toml", &[F32]);
}

/// Every word of the settings has a range; what is beyond it is refused by name, and the old settings stay in force.
#[test]
fn every_setting_out_of_range_is_refused_by_its_name() {
    for (folder, edits) in [("platform-config-f64", &[][..]), ("platform-config-f32", &[F32][..])] {
        let emitted = Emitted::new(folder, "reference.toml", edits);
        let mut controller = emitted.at_run_time();
        let description = controller.description().clone();
        let good = controller.default_config();
        let table = &emitted.compiled.ir.permitted;
        assert_eq!(table.names(), description.config_names);
        let real = |value: f64| description.scalar.encode(value);
        let never = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(real);
        let mut refused = 0;
        for (place, (name, range)) in table.words().enumerate() {
            // Words just and far outside the range, and its ends, which are permitted.
            let (beyond, ends): (Vec<u64>, Vec<u64>) = match range {
                Range::Whole(least, most) => {
                    let (least, most) = (i64::from(least), i64::from(most));
                    (vec![(least - 1) as u64, (most + 1) as u64, u64::MAX, 1 << 31], vec![least as u64, most as u64])
                }
                Range::Number(least, most) => {
                    let below = if least < 0.0 { 1.001 * least } else { -1e-30 };
                    ([below, 1.001 * most].map(real).into_iter().chain(never).collect(), [least, most].map(real).into())
                }
            };
            // The lower code limit alone may not go above the upper one, nor the other way round.
            let name = name.as_str();
            let ends = match name {
                "code_min" => vec![ends[0]],
                "code_max" => vec![ends[1]],
                _ => ends,
            };
            for word in beyond {
                let mut words = good.clone();
                words[place] = word;
                let error = controller.configure(&words).expect_err(name).to_string();
                assert!(error.contains(&format!("`{name}`")), "{name} = {word:x}: {error}");
                refused += 1;
            }
            for word in ends {
                let mut words = good.clone();
                words[place] = word;
                controller.configure(&words).unwrap_or_else(|error| panic!("{name} = {word:x}: {error}"));
            }
        }
        println!("{folder}: {refused} words out of range refused by name");
        // The lower limit above the upper one: either word may be named.
        let mut crossed = good.clone();
        description.set_config(&mut crossed, "code_min", 200.0).expect("a setting");
        description.set_config(&mut crossed, "code_max", 199.0).expect("a setting");
        assert!(controller.configure(&crossed).is_err());
    }
}

/// A refused configuration changes nothing: the controller goes on as one that was never asked.
#[test]
fn a_refused_configuration_leaves_the_old_one_in_force() {
    let emitted = Emitted::new("platform-refused", "reference.toml", &[]);
    let mut controller = emitted.at_run_time();
    let inputs = emitted.platform_stimulus(&controller.description().clone(), 4000, 9);
    let mut output = vec![0; controller.description().output_names.len()];
    let mut bad = controller.default_config();
    bad[0] = 0;
    *bad.last_mut().expect("settings") = f64::NAN.to_bits();
    let mut run = |ask: bool| -> Vec<u64> {
        controller.reset();
        let row = |(tick, row): (usize, &[u64])| {
            if ask && tick % 100 == 50 {
                controller.configure(&bad).expect_err("a NaN is no setting");
            }
            controller.step(row, &mut output);
            controller.state_digest()
        };
        inputs.rows().enumerate().map(row).collect()
    };
    assert!(run(false) == run(true));
}

/// Settings to words and back, of the emitted crate itself, for the defaults and a thousand others.
#[test]
#[ignore = "long: a test of the emitted crate is built"]
fn settings_come_back_from_their_words() {
    let each = [("platform-words-f64", &[][..]), ("platform-words-f32", &[F32][..])];
    for (folder, edits) in each.into_iter().take(specgen_tests::length(1, 2)) {
        let emitted = Emitted::new(folder, "reference.toml", edits);
        let tests = emitted.dir().join("controller/tests");
        fs::create_dir_all(&tests).expect("target is writable");
        fs::write(tests.join("words.rs"), ROUND_TRIP).expect("target is writable");
        let built = Command::new(env!("CARGO"))
            .args(["test", "--quiet", "--package", "controller", "--test", "words"])
            .current_dir(emitted.dir())
            .env("CARGO_TARGET_DIR", emitted.dir().join("target"))
            .output()
            .expect("cargo");
        let text = format!("{}{}", String::from_utf8_lossy(&built.stdout), String::from_utf8_lossy(&built.stderr));
        assert!(built.status.success() && text.contains("1 passed"), "{text}");
    }
}

/// Changes every word in turn, keeps what is permitted, and wants the same words back.
const ROUND_TRIP: &str = r#"
use controller::{CONFIG_NAMES, CONFIG_WORDS, Config};

#[test]
fn words_come_back() {
    let mut words = Config::new().to_words();
    let mut random = 1_u64;
    let mut kept = [0_u32; CONFIG_WORDS];
    for round in 0..200_000_usize {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let place = round % CONFIG_WORDS;
        let mut tried = words;
        tried[place] = match words[place] {
            // Mode and interaction.
            _ if place < 2 => random >> 61,
            // A step, of 1747 codes at most.
            _ if place == 4 => random >> 53,
            // Codes.
            1..100_000 => random >> 47,
            // Numbers: other low bits.
            number => number ^ random >> 44,
        };
        if let Ok(config) = Config::from_words(&tried) {
            assert_eq!(config.to_words(), tried, "{}", CONFIG_NAMES[place]);
            kept[place] += 1;
            words = tried;
        }
    }
    for (name, kept) in CONFIG_NAMES.iter().zip(kept) {
        assert!(kept > 100, "{name}: {kept}");
    }
}
"#;
