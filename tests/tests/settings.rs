//! The table of what settings may be: nothing beyond it enters, anything within it keeps every limit of the spec whatever the
//! inputs, and whatever state is reached so has a snapshot that loads and goes on with the same bits.

use host_sim::controller::{Supervised, TickController};
use host_sim::word::Scalar;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::ir::{PermittedRanges, Range};
use specgen_runtime::snapshot::Field;
use specgen_runtime::supervisor::Supervisor;
use specgen_tests::Emitted;

/// Ticks under one `Config`.
const STRETCH: u32 = 400;
/// From one snapshot to the next, and for how long the machine that was loaded goes on beside the first.
const EVERY: u32 = 97;
const BESIDE: u32 = 40;

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
/// Bounds so wide that hostile readings are not always a fault, and no wiring check: drawn at random, none passes it.
const WIDE: (&str, &str) = (
    "[timing]\n",
    "[supervisor]\nwiring_check = { off = \"random readings\" }\narm_time = \"1 ms\"\nramp_rate = \"40 V/ms\"\ndisagreement = \"200 um\"\nleap = \"10 mm\"\ntracking_error = 9.0\nvoltage_time = \"5 s\"\nslew_time = \"5 s\"\n\n[timing]\n",
);

struct RandomSource {
    rng: ChaCha8Rng,
    scalar: Scalar,
}

impl RandomSource {
    fn below(&mut self, bound: u64) -> u64 {
        self.rng.next_u64() % bound
    }

    fn unit(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A word in a range: an end of it, or anything between, small numbers as often as large ones.
    fn within(&mut self, range: Range) -> u64 {
        match range {
            Range::Whole(least, most) => match self.below(4) {
                0 => u64::from(least as u32),
                1 => u64::from(most as u32),
                _ => u64::from(least as u32) + self.below((most - least) as u64 + 1),
            },
            Range::Number(least, most) => {
                let value = match self.below(4) {
                    0 => least,
                    1 => most,
                    2 => most * 10_f64.powf(-20.0 * self.unit()),
                    _ => least + (most - least) * 0.999 * self.unit(),
                };
                self.scalar.encode(value)
            }
        }
    }

    /// A word that no range takes, or any bits at all.
    fn beyond(&mut self, range: Range) -> u64 {
        let (below, above) = match range {
            Range::Whole(least, most) => (i64::from(least - 1) as u64, u64::from(most as u32) + 1),
            Range::Number(least, most) => {
                (self.scalar.encode(least - 1e-3 * most.abs()), self.scalar.encode(most * 1.001))
            }
        };
        match self.below(4) {
            0 => below,
            1 => above,
            2 => self.scalar.encode([f64::NAN, f64::INFINITY, f64::NEG_INFINITY][self.below(3) as usize]),
            _ => self.rng.next_u64(),
        }
    }

    fn settings(&mut self, table: &PermittedRanges) -> Vec<u64> {
        let mut words: Vec<u64> = table.words().map(|(_, range)| self.within(range)).collect();
        let at = table.names().iter().position(|name| name == "code_min").expect("a setting");
        if words[at] > words[at + 1] {
            words.swap(at, at + 1);
        }
        words
    }
}

/// What the table takes.
fn is_permitted(table: &PermittedRanges, words: &[u64], scalar: Scalar) -> bool {
    let at = table.names().iter().position(|name| name == "code_min").expect("a setting");
    let each = table.words().zip(words).all(|((_, range), word)| match range {
        Range::Whole(least, most) => (least as u64..=most as u64).contains(word),
        Range::Number(least, most) => {
            let fits = scalar.bits() == 64 || word >> 32 == 0;
            fits && (least..=most).contains(&scalar.decode(*word))
        }
    });
    each && words[at] <= words[at + 1]
}

struct Bench {
    machine: Supervised,
    other: Supervised,
    input: Vec<u64>,
    output: Vec<u64>,
    beside: Vec<u64>,
}

/// What a run met.
#[derive(Default, Debug)]
struct LimitHits {
    accepted: u32,
    refused: u32,
    snapshots: u32,
    running: u32,
    largest_step: i64,
    /// Snapshots with a leg that is held back by more than any place: by 16 m.
    held_back: u32,
}

fn hostile(name: &str, spec: &str, edits: &[(&str, &str)], records: &[(&str, String)]) {
    let emitted = Emitted::with_records(name, spec, edits, records);
    let ir = &emitted.compiled.ir;
    let load = || Supervised::new(emitted.at_run_time());
    let machine = load();
    let (inputs, outputs) = (machine.input_names(), machine.output_names());
    let place = |name: &str| outputs.iter().position(|found| found == name).expect("an output word");
    let (voltage, code, status) = (place("voltage[0]"), place("dac_code[0]"), place("status"));
    let scalar = machine.controller().description().scalar;
    let max_step_at = ir.permitted.names().iter().position(|name| name == "max_step_codes").expect("a setting");
    let slew = ir.permitted.words().nth(max_step_at).expect("a setting").1;
    let spec_step = i64::from(ir.defaults.max_step);
    assert_eq!(slew, Range::Whole(1, ir.defaults.max_step), "the slew limit of the spec is the largest step");
    let [low, high] = emitted.compiled.model.actuator.voltage;
    let platform = ir.task_space.is_some();
    let mut draw = RandomSource { rng: ChaCha8Rng::seed_from_u64(23), scalar };
    let mut bench = Bench {
        other: load(),
        input: vec![0; inputs.len()],
        output: vec![0; outputs.len()],
        beside: vec![0; outputs.len()],
        machine,
    };
    let mut config = bench.machine.controller().default_config();
    let mut codes = [i64::from(ir.supervision.rest); 6];
    let (mut met, mut request, mut beside, mut sequence) = (LimitHits::default(), 0, 0, 0);
    for tick in 0..specgen_tests::length(60_000, 5_000_000) as u32 {
        if tick % STRETCH == 0 {
            let mut words = draw.settings(&ir.permitted);
            if draw.below(3) == 0 {
                let at = draw.below(words.len() as u64) as usize;
                let range = ir.permitted.words().nth(at).expect("a setting").1;
                words[at] = draw.beyond(range);
            }
            let permitted = is_permitted(&ir.permitted, &words, scalar);
            let taken = bench.machine.configure(&words).is_ok();
            assert_eq!(taken, permitted, "{name}, tick {tick}: {words:x?}");
            met.accepted += u32::from(taken);
            met.refused += u32::from(!taken);
            if taken {
                config = words;
                beside = 0;
            }
        }
        if tick % 16 == 0 {
            let sensible = [1, 1, 2, 2, 4, 5][(bench.output[status + 1] & 7) as usize % 6];
            request = if draw.below(8) < 7 { sensible } else { draw.below(7) };
            if tick % 32 == 0 && bench.output[status + 1] & 7 == 5 {
                request = 0;
            }
        }
        // Most ticks are plausible, so that the law is reached; one in sixteen has any bits in one word.
        for (word, name) in bench.input.iter_mut().zip(&inputs) {
            let size = match name.split('[').next().unwrap_or(name) {
                "setpoint_rate" => 1e-3,
                "setpoint_acceleration" | "wrench" => 1.0,
                "setpoint" if platform => 4e-6,
                _ => 40e-6,
            };
            *word = scalar.encode(size * draw.unit());
        }
        if platform {
            sequence += draw.below(2);
            (bench.input[0], bench.input[1], bench.input[2]) = (draw.below(4), draw.below(3), sequence & 0xffff_ffff);
        }
        let more = bench.input.len() - 2;
        if draw.below(16) == 0 {
            let at = draw.below(more as u64) as usize;
            let bits = draw.rng.next_u64();
            bench.input[at] = if scalar.bits() == 32 { bits & 0xffff_ffff } else { bits };
        }
        bench.input[more] = request;
        bench.input[more + 1] = if draw.below(4096) == 0 { 1 << draw.below(5) } else { 0 };
        let word = bench.machine.step(&bench.input, &mut bench.output);
        met.running += u32::from(word.phase == 2);
        let step = (config[max_step_at] as i64).min(spec_step);
        for (leg, before) in codes.iter_mut().enumerate() {
            let volts = scalar.decode(bench.output[voltage + leg]);
            assert!((low..=high).contains(&volts), "{name}, tick {tick}: {volts} V on leg {leg}");
            let now = bench.output[code + leg] as i64;
            let moved = (now - *before).abs();
            assert!(moved <= step, "{name}, tick {tick}: leg {leg} moves by {moved} codes, {step} permitted");
            met.largest_step = met.largest_step.max(moved);
            *before = now;
        }
        if beside > 0 {
            beside -= 1;
            bench.other.step(&bench.input, &mut bench.beside);
            assert!(
                bench.output == bench.beside,
                "{name}, tick {tick}: the machine that was loaded does another thing"
            );
            assert_eq!(bench.machine.digest(), bench.other.digest(), "{name}, tick {tick}");
        }
        if tick % EVERY == 0 {
            let words = bench.machine.save();
            bench.other.configure(&config).expect("settings in force");
            bench.other.load(&words).unwrap_or_else(|error| {
                let index =
                    words.iter().map(|word| scalar.decode(*word)).enumerate().filter(|(_, value)| value.abs() > 16.0);
                panic!("{name}, tick {tick}: {error}; words above 16: {:?}", index.collect::<Vec<_>>())
            });
            assert_eq!(bench.machine.digest(), bench.other.digest(), "{name}, tick {tick}");
            met.snapshots += 1;
            // Of a leg of a platform: memory, code, what is requested, what is held back. Legs end the state of the law.
            let leg = 4 + 2 * ir.hysteresis.memory + 3;
            let legs = words.len() - Supervisor::<f64>::WORDS - 6 * leg;
            let excess = words[legs..].chunks_exact(leg).take(6).map(|leg| scalar.decode(leg[leg.len() - 1]).abs());
            met.held_back += u32::from(platform && excess.fold(0.0, f64::max) > 16.0);
            beside = BESIDE;
        }
    }
    println!("{name}: {met:?}");
    assert!(met.accepted > 50 && met.refused > 20 && met.snapshots > 500, "{name}: {met:?}");
    assert!(met.running > 5_000, "{name}: the law hardly runs: {met:?}");
    assert!(!platform || met.held_back > 10, "{name}: what once was no state is hardly reached: {met:?}");
    assert!(met.largest_step > spec_step / 2, "{name}: the slew limit is hardly felt: {met:?}");
}

#[test]
fn any_settings_keep_a_platform_within_its_limits_and_its_snapshots_load() {
    hostile("settings-platform", "reference.toml", &[WIDE], &[]);
}

#[test]
fn any_settings_keep_a_platform_in_f32_within_its_limits_and_its_snapshots_load() {
    hostile("settings-platform-f32", "reference.toml", &[WIDE, F32], &[]);
}

#[test]
fn any_settings_keep_six_legs_within_their_limits_and_their_snapshots_load() {
    hostile("settings-legs", "legs.toml", &[WIDE], &[]);
}

#[test]
fn any_settings_keep_legs_with_creep_within_their_limits_and_their_snapshots_load() {
    let creep = (
        "[hysteresis]\n",
        "[hysteresis]\nrate = \"creep\"\ncreep_times = [\"0.8 s\", \"40 ms\"]\ncreep_weights = [0.03, 0.09]\n",
    );
    hostile("settings-creep", "legs.toml", &[WIDE, creep], &[]);
}
