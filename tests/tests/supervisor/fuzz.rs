//! Any bits in every input word: 25,000 ticks of each kind, and 15 million in the full run.

use super::bench::*;
use host_sim::controller::Supervised;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

fn ticks() -> u64 {
    specgen_tests::length(25_000, 15_000_000)
}

fn fuzz(kind: Kind, more: &[(&str, &str)], name: &str) {
    let emitted = emitted(name, kind.spec(), more);
    let controller = emitted.at_run_time();
    let mut machine = Supervised::new(controller);
    let inputs = machine.input_names();
    let outputs = machine.output_names();
    let place = |name: &str| outputs.iter().position(|found| found == name).expect("an output word");
    let scalar = host_sim::controller::TickController::description(machine.controller()).scalar;
    let (voltage, code, status) = (place("voltage[0]"), place("dac_code[0]"), place("status"));
    let numbers: Vec<usize> = (0..status).filter(|at| !(code..code + 6).contains(at)).collect();
    let [low, high] = emitted.compiled.model.actuator.voltage;
    let max_step = i64::from(emitted.compiled.ir.defaults.max_step);
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut input = vec![0; inputs.len()];
    let mut output = vec![0; outputs.len()];
    let mut codes = [0_i64; 6];
    let mut phases = [0_u64; 7];
    let mut request = 0;
    let count = ticks();
    for tick in 0..count {
        let dice = rng.next_u64();
        // A stretch of one request is long enough to get somewhere; nearly always a sensible one.
        if tick % 16 == 0 {
            request = match dice >> 32 & 7 {
                0..=2 => [1, 1, 2, 6, 4, 5, 6][usize::from(machine_phase(&output, status))],
                3 => 0,
                _ => [1, 2, 2, 6, 3, 4, 5, u64::MAX][(dice >> 40 & 7) as usize],
            };
        }
        // Raw bits in every word now and then, else in none or in one: most ticks must get past the gauges.
        let wild = dice & 63 == 0;
        for word in &mut input {
            let bits = rng.next_u64();
            *word = if wild { bits } else { scalar.encode((bits >> 11) as f64 / (1_u64 << 53) as f64 * 20e-6) };
        }
        if kind == Kind::Platform && !wild {
            input[0] = dice >> 8 & 3;
            if machine_phase(&output, status) == DRIVING && dice >> 10 & 7 > 0 {
                input[0] = 4;
                for word in &mut input[3..9] {
                    // From below the lowest voltage to beyond the highest.
                    *word = scalar.encode(scalar.decode(*word) * 10e6 - 20.0);
                }
            }
            input[1] = dice >> 12 & 3;
            input[2] = dice >> 16 & 1;
        }
        if !wild && dice >> 20 & 7 == 0 {
            let at = (dice >> 24) as usize % input.len();
            input[at] = rng.next_u64();
        }
        if scalar.bits() == 32 {
            for word in &mut input {
                *word &= 0xffff_ffff;
            }
        }
        let more = input.len() - 2;
        if !wild {
            input[more] = request;
            input[more + 1] = if dice >> 48 & 1023 == 0 { 1 << (dice >> 58 & 7) } else { 0 };
        }
        let word = machine.step(&input, &mut output);
        for at in &numbers {
            let value = scalar.decode(output[*at]);
            assert!(value.is_finite(), "{name}, tick {tick}: {} is {value}", outputs[*at]);
        }
        for leg in 0..6 {
            let volts = scalar.decode(output[voltage + leg]);
            assert!(volts >= low && volts <= high, "{name}, tick {tick}: {volts} V on leg {leg}");
            let now = output[code + leg] as i64;
            assert!((now - codes[leg]).abs() <= max_step, "{name}, tick {tick}: leg {leg} jumps");
            codes[leg] = now;
        }
        let powered = !matches!(word.phase, DISARMED | FAULTED);
        assert_eq!(word.amplifier_on, powered, "{name}, tick {tick}");
        phases[usize::from(word.phase)] += 1;
    }
    println!("{name}: {count} ticks of any bits, none out of limits; ticks in each phase {phases:?}");
    for (phase, ticks) in phases.iter().enumerate() {
        assert!(*ticks > count / 100_000, "{name}: phase {phase} is hardly reached: {phases:?}");
    }
}

fn machine_phase(output: &[u64], status: usize) -> u8 {
    output[status + 1] as u8 % 7
}

#[test]
fn any_bits_leave_six_legs_within_limits() {
    let wide = ("disagreement      = \"20 um\"", "disagreement      = \"50 um\"");
    let loose = ("tracking_error    = 0.1", "tracking_error    = 2.0");
    fuzz(Kind::Legs, &[wide, loose], "supervisor-fuzz-legs");
}

#[test]
fn any_bits_leave_a_platform_within_limits() {
    let wide = ("disagreement      = \"20 um\"", "disagreement      = \"100 um\"");
    let loose = ("tracking_error    = 0.1", "tracking_error    = 5.0");
    fuzz(Kind::Platform, &[wide, loose], "supervisor-fuzz-platform");
}
