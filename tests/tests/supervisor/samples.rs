//! Wrong samples of the gauges in the closed loop of the simulated machine: what they move, what is counted and what is a fault; and
//! that no sample of a machine without a fault is replaced.

use super::bench::{ARM, ARMING, DISARMED, FAULTED, HOLD, HOLDING, NOTHING, RAMP_DOWN, RAMPING, RUN, RUNNING};
use host_sim::controller::{MachineWord, Supervised, TickController};
use host_sim::machine::Machine;
use host_sim::plant::LegParameters;
use host_sim::word::Scalar;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::compile::Compilation;
use specgen::machine;
use specgen::model::{Mcu, SetpointKind};
use specgen_runtime::supervisor::{CONVERTER, Cause, SAMPLE_REPEATED, SAMPLE_REPLACED};
use specgen_tests::{Emitted, Row, assert_same_machine, leg_class, repository, scenario};
use std::fs;

type Six = [f64; 6];

/// The simulated machine of a spec.
fn prepared(compiled: &Compilation, leg: &LegParameters, seed: u64) -> Machine {
    let model = &compiled.model;
    if model.task_space.is_none() {
        let leg = machine::leg(model, leg);
        let scenario = machine::legs(model, &std::array::from_fn(|_| leg.clone()), &leg.noise, seed, 1);
        return Machine::Legs(Box::new(scenario.rig().clone()));
    }
    Machine::Platform(Box::new(scenario(compiled, leg, seed).rig().clone()))
}

/// Pose, m and rad, or displacements of the legs, m.
fn truth(machine: &Machine) -> Six {
    match machine {
        Machine::Platform(rig) => rig.plant().pose(),
        Machine::Legs(rig) => rig.displacements(),
    }
}

/// Where the words of a tick are.
#[derive(Clone, Copy)]
struct Places {
    gauges: usize,
    request: usize,
    setpoint: usize,
    /// Of a platform.
    command: Option<usize>,
    voltages: usize,
    status: usize,
    conditions: usize,
}

/// A controller and its plant, tick by tick.
struct Loop {
    machine: Supervised,
    plant: Machine,
    scalar: Scalar,
    period: f64,
    input: Vec<u64>,
    output: Vec<u64>,
    at: Places,
    word: MachineWord,
    /// Set-point, m and rad, and its rate per tick.
    setpoint: Six,
    rate: Six,
    sequence: u64,
    moves: bool,
    /// Where it stands between its motions, m and rad.
    middle: Six,
}

impl Loop {
    fn new(emitted: &Emitted, leg: &LegParameters, seed: u64) -> Self {
        let machine = Supervised::new(emitted.at_run_time());
        let scalar = machine.controller().description().scalar;
        let (inputs, outputs) = (machine.input_names(), machine.output_names());
        let place = |names: &[String], name: &str| names.iter().position(|one| one == name);
        let known = |names: &[String], name: &str| place(names, name).expect("a word");
        let gauges = place(&inputs, "gauge[0]").unwrap_or_else(|| known(&inputs, "displacement[0]"));
        let at = Places {
            gauges,
            request: known(&inputs, "request"),
            setpoint: known(&inputs, "setpoint[0]"),
            command: place(&inputs, "command"),
            voltages: known(&outputs, "voltage[0]"),
            status: known(&outputs, "status"),
            conditions: known(&outputs, "conditions"),
        };
        let middle = match (&emitted.compiled.model.task_space, emitted.compiled.model.controller.setpoint) {
            (Some(_), _) => [0.0; 6],
            (None, SetpointKind::Pose) => [0.0, 0.0, 22e-6, 0.0, 0.0, 0.0],
            (None, SetpointKind::Leg) => [15e-6; 6],
        };
        Self {
            middle,
            plant: prepared(&emitted.compiled, leg, seed),
            scalar,
            period: emitted.compiled.model.timing.period,
            input: vec![0; inputs.len()],
            output: vec![0; outputs.len()],
            at,
            machine,
            word: MachineWord::of(0),
            setpoint: middle,
            rate: [0.0; 6],
            sequence: 0,
            moves: true,
        }
    }

    fn fork(&self) -> Self {
        Self {
            machine: self.machine.fork(),
            plant: self.plant.clone(),
            input: self.input.clone(),
            output: self.output.clone(),
            ..*self
        }
    }

    /// A tick whose sample is spoiled: words in m or V.
    fn spoiled(&mut self, request: u64, spoil: impl FnOnce(&mut Six)) -> MachineWord {
        let mut words = self.plant.read_gauges();
        spoil(&mut words);
        let encode = |words: &mut [u64], values: &Six| {
            for (slot, value) in words.iter_mut().zip(values) {
                *slot = self.scalar.encode(*value);
            }
        };
        encode(&mut self.input[self.at.gauges..], &words);
        encode(&mut self.input[self.at.setpoint..], &self.setpoint);
        if let Some(command) = self.at.command {
            self.sequence += 1;
            self.input[command] = if self.moves { 2 } else { 1 };
            self.input[command + 2] = self.sequence & 0x7fff_ffff;
            let rate = self.rate.map(|rate| rate / self.period);
            encode(&mut self.input[self.at.setpoint + 6..], &rate);
        }
        self.input[self.at.request] = request;
        self.word = self.machine.step(&self.input, &mut self.output);
        let voltages = std::array::from_fn(|leg| self.scalar.decode(self.output[self.at.voltages + leg]));
        self.plant.hold(&voltages, self.period);
        self.word
    }

    fn tick(&mut self, request: u64) -> MachineWord {
        self.spoiled(request, |_| {})
    }

    fn status(&self) -> u32 {
        self.output[self.at.status] as u32
    }

    fn conditions(&self) -> u32 {
        self.output[self.at.conditions] as u32
    }

    /// Armed, checked, running, at rest at its bias.
    fn run(&mut self) {
        self.tick(NOTHING);
        for _ in 0..20_000 {
            if self.tick(ARM).phase == HOLDING {
                break;
            }
        }
        for _ in 0..8000 {
            self.tick(RUN);
        }
        assert_eq!(self.word.phase, RUNNING, "{:?}, conditions {:x}", self.word, self.conditions());
    }
}

/// Of the true translation, m.
fn apart(one: &Six, other: &Six) -> f64 {
    (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>().sqrt()
}

const KINDS: [(&str, &str); 2] = [("supervisor-samples", "reference.toml"), ("supervisor-samples-legs", "legs.toml")];
const BITS: (&str, &str) = ("bits  = 17", "bits  = 18");
const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
const WIDE: (&str, &str) = ("[timing]\n", "[supervisor]\nleap = \"10 mm\"\n\n[timing]\n");
/// Ticks in which what a wrong sample did is looked for.
const AFTER: usize = 300;

/// By how much one sample with this bit (of 18) wrong moves the platform, m: at most, of each gauge up and down; and how many of these
/// samples were replaced and how many were out of range.
fn moved_by(steady: &Loop, bit: i32, span: f64) -> (f64, u32, u32) {
    let mut twin = steady.fork();
    let path: Vec<Six> = (0..AFTER)
        .map(|_| {
            twin.tick(RUN);
            truth(&twin.plant)
        })
        .collect();
    let (mut most, mut replaced, mut out) = (0.0_f64, 0, 0);
    for gauge in 0..6 {
        for sign in [1.0, -1.0] {
            let mut machine = steady.fork();
            let mut beyond = false;
            for (tick, good) in path.iter().enumerate() {
                machine.spoiled(RUN, |words| {
                    if tick == 0 {
                        words[gauge] += sign * span / 2f64.powi(18 - bit);
                        beyond = words[gauge].abs() > 0.5 * span;
                    }
                });
                if tick == 0 && machine.status() & SAMPLE_REPLACED != 0 {
                    assert_eq!(machine.conditions() >> 16, 0x41 << gauge, "the gauge is named as replaced");
                    replaced += 1;
                }
                most = most.max(apart(&truth(&machine.plant), good));
            }
            out += u32::from(beyond);
            assert_eq!(machine.word.phase, RUNNING);
        }
    }
    (most, replaced, out)
}

#[test]
fn one_wrong_sample_moves_the_platform_by_less_than_20_nm_from_bit_15_on() {
    let leg = LegParameters::reference();
    let steady = |name: &str, edits: &[(&str, &str)], speed: f64| {
        let emitted = Emitted::new(name, "reference.toml", edits);
        let mut machine = Loop::new(&emitted, &leg, 5);
        machine.run();
        if speed > 0.0 {
            // Towards +x, as a stream.
            (machine.moves, machine.rate[0]) = (false, speed * machine.period);
            machine.setpoint = [0.0; 6];
            for _ in 0..12 {
                machine.setpoint[0] += machine.rate[0];
                machine.tick(RUN);
            }
        }
        (machine, emitted.compiled.model.sensor.range)
    };
    let (now, [low, high]) = steady("supervisor-samples-18", &[BITS], 0.0);
    let (before, _) = steady("supervisor-samples-wide", &[BITS, WIDE], 0.0);
    println!("bit of 18, its leap: nm of true motion with the sift (of 12 samples replaced, out of range), without it");
    let mut of_bit_15 = [0.0; 2];
    for bit in specgen_tests::length(vec![17, 15, 9], (6..18).rev().collect()) {
        let (sifted, replaced, out) = moved_by(&now, bit, high - low);
        let (wide, none, _) = moved_by(&before, bit, high - low);
        let leap = (high - low) / 2f64.powi(18 - bit);
        println!("{bit:>2} {:>10.3} um {:>8.2} ({replaced}, {out}) {:>9.2}", leap * 1e6, sifted * 1e9, wide * 1e9);
        assert_eq!(none, 0);
        if bit >= 15 {
            assert_eq!(replaced + out, 12, "bit {bit}");
            assert!(sifted <= 20e-9, "bit {bit}: {sifted:e}");
        }
        if bit == 15 {
            of_bit_15 = [sifted, wide];
        }
    }
    assert!(of_bit_15[1] > 100e-9, "without the sift it is seen: {:e}", of_bit_15[1]);
    // In motion, too: the set-point goes on at 5 mm/s through the wrong sample.
    let (moving, _) = steady("supervisor-samples-18", &[BITS], 5e-3);
    let (sifted, replaced, _) = moved_by(&moving, 15, high - low);
    println!("bit 15 at 5 mm/s: {:.2} nm ({replaced} replaced)", sifted * 1e9);
    assert!(replaced == 12 && sifted <= 20e-9, "{replaced}: {sifted:e}");
}

/// What is wrong with a sample, of which the two before are known.
type Spoil = fn(&mut Six, &[Six; 2]);

/// Ticks until it is a fault, and the cause; none in 2,000. How many samples were shown as replaced, repeated and not finite.
fn lasts(steady: &Loop, spoil: impl Fn(usize, &mut Six, &[Six; 2])) -> (Option<(usize, u8)>, [u32; 3]) {
    let mut machine = steady.fork();
    let mut came = [[0.0; 6]; 2];
    let mut seen = [0; 3];
    let fault = (0..2000).find_map(|tick| {
        let word = machine.spoiled(RUN, |words| {
            spoil(tick, words, &came);
            came = [*words, came[0]];
        });
        seen[0] += u32::from(machine.status() & SAMPLE_REPLACED != 0);
        seen[1] += u32::from(machine.status() & SAMPLE_REPEATED != 0);
        let repeated = Cause::GaugeStuck.bit() | 0x3f << 16;
        assert!(machine.status() & SAMPLE_REPEATED == 0 || machine.conditions() & repeated == repeated);
        seen[2] += u32::from(machine.conditions() & Cause::GaugeNotFinite.bit() != 0);
        (word.phase != RUNNING).then_some((tick, word.cause))
    });
    (fault, seen)
}

#[test]
fn samples_that_are_stale_missing_or_leap_are_counted_and_a_fault_if_it_goes_on() {
    for (name, spec) in KINDS.into_iter().take(specgen_tests::length(1, 2)) {
        let emitted = Emitted::new(name, spec, &[]);
        let mut steady = Loop::new(&emitted, &LegParameters::reference(), 7);
        steady.run();
        let (stuck, disagree) = (Cause::GaugeStuck.word() as u8, Cause::GaugeDisagreement.word() as u8);
        let print = |what: &str, found: &(Option<(usize, u8)>, [u32; 3])| println!("{name}, {what}: {found:?}");

        let stale: Spoil = |words, came| *words = came[0];
        let once: [(&str, Spoil, [u32; 3]); 3] = [
            ("one duplicated sample", stale, [0, 1, 0]),
            ("one missing sample", |words, _| words[2] = f64::NAN, [0, 0, 1]),
            ("one that leaps", |words, _| words[2] += 10e-6, [1, 0, 0]),
        ];
        for (what, spoil, shown) in once {
            let found = lasts(&steady, |tick, words, came| {
                if tick == 100 {
                    spoil(words, came)
                }
            });
            print(what, &found);
            assert_eq!(found, (None, shown), "{what}");
        }
        type When = fn(usize) -> bool;
        let again: [(&str, When, Spoil, usize); 3] = [
            ("no new sample", |tick| tick > 0, stale, 5),
            ("a stale value in every second sample", |tick| tick % 2 == 1, stale, 15),
            ("one of two buffers dead", |tick| tick > 2 && tick % 2 == 1, |words, came| *words = came[1], 15),
        ];
        for (what, when, spoil, most) in again {
            let found = lasts(&steady, |tick, words, came| {
                if when(tick) {
                    spoil(words, came)
                }
            });
            print(what, &found);
            assert!(found.0.is_some_and(|(ticks, cause)| ticks < most && cause == stuck), "{what}");
        }
        for (every, most) in [(1, 3), (2, 10), (3, 16)] {
            let leaps = lasts(&steady, |tick, words, _| {
                if tick % every == 0 {
                    words[4] += if tick % 2 == 0 { 10e-6 } else { -7e-6 };
                }
            });
            print(&format!("a leap in one of {every} samples"), &leaps);
            assert!(leaps.0.is_some_and(|(ticks, cause)| ticks < most && cause == disagree));
        }
    }
}

/// A sample that is missing, out of range, or of a converter that did not answer, time and again.
#[test]
fn samples_that_are_missing_in_every_second_tick_are_a_fault() {
    for (name, spec) in KINDS.into_iter().rev().take(specgen_tests::length(1, 2)) {
        let emitted = Emitted::new(name, spec, &[]);
        let mut steady = Loop::new(&emitted, &LegParameters::reference(), 7);
        steady.run();
        // 10 ms, `supervisor.gauge_time`.
        let lasting = 0.01 / steady.period;
        for cause in [Cause::GaugeNotFinite, Cause::GaugeRange, Cause::Converter] {
            for (every, times) in [(2, 2.7), (3, 6.0), (4, 16.0), (5, f64::INFINITY)] {
                let mut machine = steady.fork();
                let fault = (0..(20.0 * lasting) as u32).find(|tick| {
                    let wrong = tick % every == 0;
                    let events = machine.at.request + 1;
                    machine.input[events] = u64::from(wrong && cause == Cause::Converter) * u64::from(CONVERTER);
                    let word = machine.spoiled(RUN, |words| match cause {
                        Cause::GaugeNotFinite if wrong => words[2] = f64::NAN,
                        Cause::GaugeRange if wrong => words[2] = 1e-3,
                        _ => {}
                    });
                    assert!(word.phase == RUNNING || u64::from(word.cause) == cause.word(), "{word:?}");
                    word.phase != RUNNING
                });
                println!(
                    "{name}, {cause:?}, one of {every}: {:?} ms",
                    fault.map(|ticks| f64::from(ticks) * machine.period * 1e3)
                );
                match fault {
                    Some(ticks) => assert!(f64::from(ticks) <= times * lasting + 2.0, "{cause:?}, {every}: {ticks}"),
                    None => assert!(times.is_infinite(), "{cause:?}, one of {every} is no fault"),
                }
            }
        }
    }
}

/// What a machine without a fault is asked for, from one seed: steps of 1 µm, streams at up to 5 mm/s that turn on the spot, moves, holds
/// and ramps in the middle of them.
struct Path {
    draw: ChaCha8Rng,
    /// Ticks that are left of this part of the path, and which it is.
    left: u32,
    part: u64,
    axis: usize,
    request: u64,
}

impl Path {
    fn new(seed: u64) -> Self {
        Self { draw: ChaCha8Rng::seed_from_u64(seed), left: 0, part: 0, axis: 0, request: NOTHING }
    }

    /// Sets what the next tick is asked for.
    fn lead(&mut self, machine: &mut Loop) {
        match machine.word.phase {
            DISARMED => {
                self.request = if self.request == NOTHING { ARM } else { NOTHING };
                (machine.setpoint, machine.rate, machine.moves) = (machine.middle, [0.0; 6], true);
                self.left = 0;
                return;
            }
            ARMING => return,
            RAMPING | FAULTED => {
                self.request = NOTHING;
                return;
            }
            _ => {}
        }
        if self.left == 0 {
            self.left = 400 + (self.draw.next_u64() % 800) as u32;
            self.part = self.draw.next_u64() % 16;
            self.axis = (self.draw.next_u64() % 6) as usize;
            self.request = match self.part {
                0 => HOLD,
                1 if self.draw.next_u64().is_multiple_of(2) => RAMP_DOWN,
                _ => RUN,
            };
            machine.rate = [0.0; 6];
        }
        self.left -= 1;
        let platform = machine.at.command.is_some();
        let axis = self.axis;
        // Angles of all axes together must leave every leg within its voltage.
        let middle = machine.middle[axis];
        let unit = match (axis > 2 && middle == 0.0, platform) {
            (true, true) => 4e-6,
            (true, false) => 3e-6,
            _ => 1e-6,
        };
        let (place, rate) = (&mut machine.setpoint[axis], &mut machine.rate[axis]);
        match self.part {
            0 | 1 => {}
            // Steps of 1 µm, of a platform as fast as a stream may be.
            2..=5 => {
                machine.moves = self.part == 2;
                let fastest = if platform && !machine.moves { 5e-3 * machine.period * unit * 1e6 } else { unit };
                let up = (self.left / 40).is_multiple_of(2);
                let goal = middle + if up { unit } else { 0.0 };
                *rate = (goal - *place).clamp(-fastest, fastest);
                *place += *rate;
            }
            // A triangle.
            6..=11 => {
                machine.moves = false;
                let speed = [5e-3, 2e-3, 1e-3][(self.part % 3) as usize] * machine.period * unit * 1e6;
                if rate.abs() != speed {
                    *rate = speed;
                }
                if (*place - middle).abs() > 5.0 * unit && (*place - middle) * *rate > 0.0 {
                    *rate = -*rate;
                }
                *place += *rate;
            }
            _ => {
                machine.moves = true;
                if self.left.is_multiple_of(256) {
                    *place = middle + unit * (self.draw.next_u64() % 10) as f64 - 5.0 * unit;
                }
            }
        }
    }
}

/// Runs a spec's machines of three classes without a fault; how many ticks in each phase, and samples replaced and repeated.
fn fault_free(spec: &str, ticks: u64) -> ([u64; 6], [u64; 2]) {
    let name = spec.trim_end_matches(".toml").replace('/', "-");
    // After a ramp down creep leaves legs up to 2 µm below their zero: room for it, at the same step of the converter.
    let room = ["range = [\"-2 um\", \"48 um\"]", "range = [\"-6 um\", \"44 um\"]"];
    let text = fs::read_to_string(repository().join("specs").join(spec)).expect("a spec");
    let edits: Vec<(&str, &str)> = text.contains(room[0]).then_some((room[0], room[1])).into_iter().collect();
    let emitted = Emitted::new(&format!("supervisor-samples-free-{name}"), spec, &edits);
    let (mut phases, mut seen) = ([0; 6], [0; 2]);
    for number in 0..3 {
        let mut machine = Loop::new(&emitted, &leg_class(number), 100 + number);
        let mut path = Path::new(number);
        for tick in 0..ticks / 3 {
            path.lead(&mut machine);
            let word = machine.tick(path.request);
            phases[usize::from(word.phase)] += 1;
            let conditions = machine.conditions();
            assert_ne!(
                word.phase,
                FAULTED,
                "{spec}, tick {tick}: {word:?}, conditions {conditions:x}, set-point {:?}, truth {:?}",
                machine.setpoint,
                truth(&machine.plant)
            );
            seen[0] += u64::from(machine.status() & SAMPLE_REPLACED != 0 || conditions >> 22 != 0);
            seen[1] += u64::from(machine.status() & SAMPLE_REPEATED != 0);
        }
    }
    println!("{spec}: ticks in each phase {phases:?}; replaced, repeated {seen:?}");
    (phases, seen)
}

/// Every spec that can be armed, in the full run; one of each kind in the short one.
#[test]
fn no_sample_of_a_machine_without_a_fault_is_replaced() {
    let mut specs: Vec<String> = ["legs.toml", "features/platform-calibration.toml"].map(str::to_owned).into();
    if specgen_tests::length(false, true) {
        let features = fs::read_dir(repository().join("specs/features"))
            .expect("specs")
            .map(|file| file.expect("a file").file_name());
        specs = features
            .map(|name| format!("features/{}", name.to_string_lossy()))
            .filter(|name| name.ends_with(".toml"))
            .collect();
        specs.extend(["reference.toml", "legs.toml", "minimal.toml"].map(str::to_owned));
        specs.sort();
    }
    let each = specgen_tests::length(40_000, 10_000_000) / specs.len() as u64 + 3;
    let (mut all, mut replaced) = (0, 0);
    for spec in &specs {
        let (phases, seen) = fault_free(spec, each);
        let ticks: u64 = phases.iter().sum();
        assert!(phases[usize::from(RUNNING)] > ticks / 4, "{spec}: {phases:?}");
        assert!(phases[usize::from(ARMING)] > 0 && phases[usize::from(HOLDING)] > 0, "{spec}: {phases:?}");
        all += ticks;
        replaced += seen[0];
    }
    println!("{} specs, {all} ticks without a fault: {replaced} samples replaced", specs.len());
    assert_eq!(replaced, 0);
}

/// Host and emulated MCU: the same bits where samples are stale, missing and leap, in f64 and in f32.
#[test]
fn spoiled_samples_have_the_same_bits_on_the_mcu() {
    let machines =
        [("supervisor-samples-f32", &[F32][..], Mcu::Mps2An386), ("supervisor-samples", &[], Mcu::Mps2An500)];
    // In the short run the image that other tests have built.
    for &(name, edits, mcu) in &machines[specgen_tests::length(1..2, 0..2)] {
        let emitted = Emitted::new(name, "reference.toml", edits);
        let Some(image) = emitted.image(mcu) else { return };
        let mut machine = Loop::new(&emitted, &LegParameters::reference(), 3);
        let config = machine.machine.controller().default_config();
        let mut draw = ChaCha8Rng::seed_from_u64(9);
        let mut rows: Vec<Row> = Vec::new();
        let (mut path, mut came, mut seen) = (Path::new(1), [[0.0; 6]; 2], [0; 2]);
        for tick in 0..specgen_tests::length(9000, 60_000) {
            path.lead(&mut machine);
            let dice = draw.next_u64();
            let request = if machine.word.phase == FAULTED { [NOTHING, 5][tick % 2] } else { path.request };
            machine.spoiled(request, |words| {
                let gauge = (dice >> 8) as usize % 6;
                match dice % 60 {
                    0 => *words = came[(dice >> 12 & 1) as usize],
                    1 => words[gauge] = f64::from_bits(draw.next_u64()),
                    2..=4 => words[gauge] += 40e-6 * ((dice >> 20) as f64 / 2f64.powi(43) - 1.0),
                    _ => {}
                }
                came = [*words, came[0]];
            });
            seen[0] += u32::from(machine.status() & SAMPLE_REPLACED != 0);
            seen[1] += u32::from(machine.status() & SAMPLE_REPEATED != 0);
            rows.push((machine.input.clone(), machine.output.clone(), machine.machine.digest()));
        }
        assert!(seen[0] > 100 && seen[1] > 20, "{seen:?}");
        assert_same_machine(name, &image, &config, &rows);
        println!("{name}: {} ticks equal in every bit; replaced, repeated {seen:?}", rows.len());
    }
}
