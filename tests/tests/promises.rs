//! Settings of six legs that would break a promise. What they promise for any input is tested with the platform's.

use host_sim::controller::TickController;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_tests::Emitted;

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
