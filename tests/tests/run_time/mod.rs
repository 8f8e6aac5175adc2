//! The run-time platform against the emitted library: the same outputs, codes, digests, snapshots and dynamics in every bit, under
//! inputs that try everything; and what one of them recorded or saved goes on in the other. That one ulp in a constant is seen is a
//! test of `codegen/run-time`.

mod random;

use std::io::Cursor;

use crate::rate_options::{CREEP, DYNAMIC, WIDENED, option_files};
use host_sim::controller::{Controller, RestingReadings, Supervised, TickController as _};
use host_sim::record::{Reader, Writer, replay};
use host_sim::trace::first_difference;
use oracle::stimulus::InputRecording;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::ir::{Ir, Range};
use specgen_runtime::record::Layout;
use specgen_runtime::recorder::{Recorder, Row, Settings};
use specgen_tests::{Emitted, host_trace, length};

/// Bytes of a block of a record.
const BLOCK: usize = 8192;

/// Ticks of each run of a law alone; a machine runs for some times as many.
fn ticks() -> usize {
    length(2_500, 7_000)
}

/// Ticks of a machine in a trial of so many ticks of the law.
const MACHINE: usize = 8;
/// Ticks that a machine may take to be armed, at most.
const ARMING: usize = 60_000;
/// Ticks out of the running phase after which a machine that ran is put back to where it did.
const AWAY: usize = 60;

fn hostile(emitted: &Emitted, controller: &Controller, rows: usize, seed: u64) -> InputRecording {
    let description = controller.description();
    match emitted.compiled.ir.task_space {
        Some(_) => emitted.platform_stimulus(description, rows, seed),
        None => emitted.stimulus(description, seed.is_multiple_of(2), rows, seed),
    }
}

/// Settings of the spec with some of them anywhere in their range.
fn settings(ir: &Ir, draw: &mut ChaCha8Rng) -> Vec<u64> {
    let mut words = ir.integrity.settings.clone();
    let single = ir.scalar.bits() == 32;
    for (word, (_, range)) in words.iter_mut().zip(ir.permitted.words()) {
        // Choices stand first: mode, law, where forces come from.
        let chosen = matches!(range, Range::Whole(0, 0..=8));
        if !draw.next_u64().is_multiple_of(if chosen { 2 } else { 40 }) {
            continue;
        }
        let unit = (draw.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        *word = match range {
            Range::Whole(least, most) => {
                (f64::from(least) + (unit * (f64::from(most) - f64::from(least) + 1.0)).floor()) as u64
            }
            Range::Number(least, most) => {
                let value = ir.scalar.round(least + unit * (most - least));
                if single { u64::from((value as f32).to_bits()) } else { value.to_bits() }
            }
        };
    }
    words
}

/// The law alone, under hostile records in several settings.
fn laws_alike(name: &str, emitted: &Emitted, library: &mut Controller, at_run_time: &mut Controller, ticks: usize) {
    let ir = &emitted.compiled.ir;
    let mut draw = ChaCha8Rng::seed_from_u64(5);
    let modes = if ir.task_space.is_some() { 7 } else { 3 };
    for mode in 0..modes {
        let inputs = hostile(emitted, library, ticks, 30 + mode);
        let mode_word = [("mode", mode as f64)];
        let (truth, _) = host_trace(library, &mode_word, &inputs);
        let (found, _) = host_trace(at_run_time, &mode_word, &inputs);
        let difference = first_difference(&truth, &found);
        assert!(difference.is_none(), "{name}, mode {mode}: {}", difference.unwrap());
    }
    // From here on settings change from stretch to stretch, and the state stays.
    let inputs = hostile(emitted, library, ticks, 77);
    let mut outputs = [vec![0; library.description().output_names.len()], vec![]];
    outputs[1] = outputs[0].clone();
    for (tick, row) in inputs.rows().enumerate() {
        if tick % 100 == 0 {
            let words = settings(ir, &mut draw);
            let results = [&mut *library, &mut *at_run_time].map(|controller| controller.configure(&words).is_ok());
            assert_eq!(results[0], results[1], "{name}: settings {words:x?}");
        }
        library.step(row, &mut outputs[0]);
        at_run_time.step(row, &mut outputs[1]);
        assert_eq!(outputs[0], outputs[1], "{name}, tick {tick} with changing settings");
        assert_eq!(library.state_digest(), at_run_time.state_digest(), "{name}, tick {tick}");
    }
}

/// Inputs of a machine: hostile rows, requests that mostly make sense, events, settings that change, snapshots.
struct Course {
    rows: InputRecording,
    standing: RestingReadings,
    /// Input of a machine at rest.
    at_rest: Vec<u64>,
    draw: ChaCha8Rng,
    request: u64,
    gauges: usize,
    tick: usize,
}

impl Course {
    fn new(emitted: &Emitted, machine: &Supervised, ticks: usize, seed: u64) -> Self {
        let rows = hostile(emitted, machine.controller(), MACHINE * ticks, seed);
        let names = machine.input_names();
        let gauges = names.iter().position(|name| name == "gauge[0]" || name == "displacement[0]").unwrap();
        // At rest: of gauges with a calibration, the middle of what is believed.
        let mut input = vec![0; names.len()];
        if let Some(task) = &emitted.compiled.ir.task_space
            && task.sensing.calibration.is_some()
        {
            let scalar = machine.controller().description().scalar;
            for (word, [low, high]) in input[gauges..].iter_mut().zip(task.sensing.raw_limits) {
                *word = scalar.encode(0.5 * (low + high));
            }
        }
        let standing = machine.standing(&input).unwrap();
        Self { rows, standing, at_rest: input, draw: ChaCha8Rng::seed_from_u64(seed), request: 0, gauges, tick: 0 }
    }

    /// The next input, for a machine with this last output.
    fn next(&mut self, machine: &Supervised, output: &[u64], input: &mut [u64]) {
        let width = self.rows.width;
        let row = self.rows.rows().nth(self.tick % self.rows.rows().len()).unwrap();
        let phase = output[output.len() - 2] as u8 % 6;
        let last = if self.tick == 0 { &*self.at_rest } else { &*input };
        let held: [u64; 6] = last[self.gauges..][..6].try_into().unwrap();
        input[..width].copy_from_slice(row);
        let dice = self.draw.next_u64();
        // Gauges that follow the legs bring the machine through its wiring check and keep it going; in some stretches they do not.
        if phase != 2 || (self.tick / 512) % 4 != 3 {
            input[self.gauges..][..6].copy_from_slice(&held);
            if self.tick > 0 {
                self.standing.show(machine, output, input);
            }
        }
        // Arming takes thousands of ticks, which a disturbance makes begin anew.
        let arms = phase == 1;
        if !arms && dice & 0xfff == 0 {
            let at = (dice >> 24) as usize % width;
            input[at] = self.draw.next_u64() >> if machine_bits(machine) == 32 { 32 } else { 0 };
        }
        if self.tick.is_multiple_of(64) {
            self.request = match dice >> 32 & 1023 {
                0..=1015 => [1, 2, 2, 2, 4, 5][usize::from(phase)],
                1016..=1019 => 0,
                _ => [3, 4, 5, u64::MAX][(dice >> 40 & 3) as usize],
            };
        }
        input[width] = self.request;
        input[width + 1] = if !arms && dice >> 48 & 8191 == 0 { 1 << (dice >> 58 & 7) } else { 0 };
        self.tick += 1;
    }
}

fn machine_bits(machine: &Supervised) -> u32 {
    machine.controller().description().scalar.bits()
}

/// Changes one to three words of a snapshot.
fn spoil(words: &mut [u64], draw: &mut ChaCha8Rng, bits: u32) {
    for _ in 0..1 + draw.next_u64() % 3 {
        let at = (draw.next_u64() % words.len() as u64) as usize;
        words[at] = match draw.next_u64() % 4 {
            0 => words[at] ^ 1 << (draw.next_u64() % u64::from(bits)),
            1 => draw.next_u64() % 70,
            2 => words[(draw.next_u64() % words.len() as u64) as usize],
            _ => draw.next_u64() >> (64 - bits),
        };
    }
}

/// Ticks of each phase.
type Phases = [usize; 6];

/// Both machines under one course, from power-up through arming, then for `MACHINE * ticks` ticks. Whatever stops them, they are put back
/// to where they ran, so that most of the ticks are of the running phase.
fn machines_alike(name: &str, emitted: &Emitted, library: Controller, at_run_time: Controller, ticks: usize) -> Phases {
    let ir = &emitted.compiled.ir;
    let [mut library, mut at_run_time] = [library, at_run_time].map(Supervised::new);
    for machine in [&mut library, &mut at_run_time] {
        machine.configure(&ir.integrity.settings).unwrap();
    }
    assert_eq!(library.state_words(), at_run_time.state_words(), "{name}: words of a snapshot");
    let bits = machine_bits(&library);
    let mut course = Course::new(emitted, &library, ticks, 9);
    let mut draw = ChaCha8Rng::seed_from_u64(11);
    let mut input = vec![0; library.input_names().len()];
    let mut outputs = [vec![0; library.output_names().len()], vec![0; library.output_names().len()]];
    let (mut phases, mut refused, mut taken) = ([0; 6], 0, 0);
    // Where it ran first, and for how long it does not run any more.
    let (mut ran, mut away) = (None, 0);
    let (mut tick, mut left) = (0, MACHINE * ticks);
    while left > 0 {
        if tick == ARMING && ran.is_none() {
            // A course that stands at rest does not arm every machine; what it did is compared.
            break;
        }
        course.next(&library, &outputs[0], &mut input);
        let [first, second] = &mut outputs;
        let word = library.step(&input, first);
        at_run_time.step(&input, second);
        assert_eq!(first, second, "{name}, supervised tick {tick}");
        assert_eq!(library.digest(), at_run_time.digest(), "{name}, supervised tick {tick}: digest");
        phases[usize::from(word.phase)] += 1;
        tick += 1;
        left -= usize::from(ran.is_some());
        if tick % 1000 == 0 && word.phase == 2 {
            let words = settings(ir, &mut draw);
            let results = [&mut library, &mut at_run_time].map(|machine| machine.configure(&words).is_ok());
            assert_eq!(results[0], results[1], "{name}: settings {words:x?}");
        }
        if tick % 400 == 0 {
            let saved = library.save();
            assert_eq!(saved, at_run_time.save(), "{name}, supervised tick {tick}: snapshot");
            for _ in 0..20 {
                let mut spoilt = saved.clone();
                spoil(&mut spoilt, &mut draw, bits);
                let results = [&mut library, &mut at_run_time]
                    .map(|machine| machine.load(&spoilt).map_err(|error| error.to_string()));
                assert_eq!(results[0], results[1], "{name}, supervised tick {tick}: a spoilt snapshot");
                let counted = if results[0].is_ok() { &mut taken } else { &mut refused };
                *counted += 1;
                assert_eq!(library.digest(), at_run_time.digest(), "{name}: a spoilt snapshot that is taken");
            }
            // Each goes on from what the other saved.
            library.load(&saved).unwrap();
            at_run_time.load(&saved).unwrap();
        }
        match (&ran, word.phase) {
            (None, 2) => ran = Some((library.save(), course.standing.clone())),
            (_, 2) => away = 0,
            (Some((state, standing)), _) => {
                away += 1;
                if away == AWAY {
                    for machine in [&mut library, &mut at_run_time] {
                        machine.load(state).unwrap();
                        machine.configure(&ir.integrity.settings).unwrap();
                    }
                    course.standing = standing.clone();
                    away = 0;
                }
            }
            (None, _) => {}
        }
    }
    println!("{name}: ticks in each phase {phases:?}; spoilt snapshots {taken} taken, {refused} refused");
    assert!(refused > 0 && (ran.is_none() || phases[2] > MACHINE * ticks / 10), "{name}: {phases:?}");
    phases
}

fn record(mut machine: Supervised, emitted: &Emitted, ticks: usize) -> Vec<u8> {
    let mut memory = vec![0; 2 * BLOCK];
    let description = machine.controller().description().clone();
    let config = emitted.compiled.ir.integrity.settings.clone();
    let layout = Layout { config: config.len(), input: machine.input_names().len(), state: machine.state_words() };
    let mut recorder = Recorder::new(&mut memory, 2, layout).unwrap();
    recorder.start(Settings::STREAM);
    let mut writer = Writer::new(Vec::new(), machine.controller().text()).unwrap();
    let mut course = Course::new(emitted, &machine, ticks, 21);
    let mut input = vec![0; machine.input_names().len()];
    let mut output = vec![0; machine.output_names().len()];
    let codes = description.outputs("dac_code").unwrap();
    let (status, supervisor) = (description.output("status").unwrap(), description.output_names.len());
    for _ in 0..ticks {
        course.next(&machine, &output, &mut input);
        if recorder.opens() {
            let state = machine.save();
            recorder.open(&config, machine.digest(), |words| words.copy_from_slice(&state));
        }
        machine.step(&input, &mut output);
        let row = Row {
            codes: codes.map(|place| output[place] as i32),
            status: output[status] as u32,
            supervisor: output[supervisor] as u32,
        };
        recorder.push(&input, &row, || machine.digest());
        writer.drain(&mut recorder).unwrap();
    }
    recorder.stop();
    writer.drain(&mut recorder).unwrap();
    writer.finish().unwrap()
}

/// What one recorded, the other replays.
fn records_alike(name: &str, emitted: &Emitted, library: &Controller, at_run_time: &Controller, ticks: usize) {
    for (recorder, player) in [(library, at_run_time), (at_run_time, library)] {
        let bytes = record(Supervised::new(recorder.fork()), emitted, ticks);
        let mut player = Supervised::new(player.fork());
        let mut reader = Reader::new(Cursor::new(&bytes)).unwrap();
        let replayed = replay(&mut reader, &mut player, |_, _, _| ()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(replayed.divergence, None, "{name}");
        assert_eq!(replayed.ticks, ticks as u64, "{name}");
    }
}

/// The lines of a description without those of a library's memory.
fn without_sizes(text: &str) -> String {
    let of_memory =
        |line: &&str| !["state_", "config_b", "config_a", "machine_"].iter().any(|key| line.starts_with(key));
    text.lines().filter(of_memory).collect::<Vec<_>>().join("\n")
}

/// Builds the controller and compares all that it gives, but for the time that it takes.
fn alike_in_all(name: &str, emitted: &Emitted, ticks: usize) -> Phases {
    let (mut library, mut at_run_time) = (emitted.controller(), emitted.at_run_time());
    assert_eq!(without_sizes(library.text()), without_sizes(at_run_time.text()), "{name}");
    assert_eq!(library.default_config(), at_run_time.default_config(), "{name}");
    laws_alike(name, emitted, &mut library, &mut at_run_time, ticks);
    let spec_settings = library.default_config();
    for controller in [&mut library, &mut at_run_time] {
        controller.configure(&spec_settings).unwrap();
        controller.reset();
    }
    records_alike(name, emitted, &library, &at_run_time, ticks);
    machines_alike(name, emitted, library, at_run_time, ticks)
}

fn alike(name: &str, spec: &str, edits: &[(&str, &str)]) {
    let emitted = Emitted::with_records(&format!("run-time-{name}"), spec, edits, &option_files());
    let phases = alike_in_all(name, &emitted, ticks());
    assert!(phases[2] > 0, "{name}: {phases:?}");
}

/// Every part of the law that a spec has to ask for.
const PARTS: (&str, &str) =
    ("interaction     = \"none\"", "hand_over       = true\ncorrection      = \"2 um\"\ninteraction     = \"none\"");

#[test]
#[ignore = "long: another controller; one with a leg model of every part is in the short run"]
fn a_platform_with_every_part_of_the_law_has_the_bits_of_the_emitted_one() {
    let damping = specgen_tests::active_damping();
    let parts = format!("[control]\nhand_over = true\ncorrection = \"2 um\"\n{damping}");
    alike("parts-f32", "features/triggers.toml", &[("[control]", parts.as_str())]);
}

/// Plays, a Bouc-Wen state, a read-out and creep.
const LEG_MODEL: (&str, &str) = ("memory  = 64", "memory  = 64\nmodel   = \"bouc-wen-plays\"");

#[test]
fn a_platform_with_a_leg_model_of_every_part_has_the_bits_of_the_emitted_one() {
    alike("leg-model", "reference.toml", &[LEG_MODEL]);
}

#[test]
#[ignore = "long: another controller with a leg model"]
fn six_legs_with_a_leg_model_in_single_precision_have_the_bits_of_the_emitted_ones() {
    let edits = [LEG_MODEL, ("scalar   = \"f64\"", "scalar   = \"f32\"")];
    alike("leg-model-f32", "legs.toml", &edits);
}

#[test]
#[ignore = "long: a controller of six legs and one of a platform; its image has the bits of the run-time law in the short run"]
fn plays_that_widen_have_the_bits_of_the_emitted_ones() {
    alike("plays", "reference.toml", &[WIDENED]);
    alike("plays-f32", "legs.toml", &[WIDENED, ("scalar   = \"f64\"", "scalar   = \"f32\"")]);
}

#[test]
#[ignore = "long: a controller with creep"]
fn six_legs_with_creep_have_the_bits_of_the_emitted_ones() {
    alike("creep", "legs.toml", &[("memory  = 64", CREEP)]);
}

#[test]
#[ignore = "long: a controller of the dynamic model, whose law runs on the host in the short run"]
fn six_legs_of_the_dynamic_model_in_single_precision_have_the_bits_of_the_emitted_ones() {
    alike("dynamic", "legs.toml", &[("memory  = 64", DYNAMIC), ("scalar   = \"f64\"", "scalar   = \"f32\"")]);
}

#[test]
#[ignore = "long: a controller of each spec of this repository"]
fn every_spec_has_the_bits_of_its_emitted_controller() {
    let specs = specgen_tests::repository().join("specs");
    let mut names: Vec<String> = ["", "features"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(specs.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.strip_prefix(&specs).unwrap().display().to_string())
        .filter(|name| name != "as-printed.toml")
        .collect();
    names.sort();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        alike(&name.replace(['/', '.'], "-"), &name, &[]);
    }
    alike("parts", "reference.toml", &[specgen_tests::damped(), PARTS]);
}

/// Platforms as they might be built, with whatever else a spec may ask for drawn at random.
#[test]
#[ignore = "long: a controller of each; one with a leg model of every part is in the short run"]
fn random_specs_have_the_bits_of_their_emitted_controllers() {
    let (mut kinds, mut ran) = (random::Kinds::default(), 0);
    let count = length(1, 50);
    for index in (0..count).map(|number| (number + 3) % 50) {
        let (emitted, parts) = random::emitted(index);
        println!("random spec {index}: {parts:?}");
        kinds.add(&emitted.compiled, &parts);
        ran += usize::from(alike_in_all(&format!("random spec {index}"), &emitted, 3_000)[2] > 0);
    }
    println!("{ran} of {count} machines ran");
    assert!(ran >= length(1, 25), "{ran} ran");
    kinds.assert_varied(count);
}

/// Ticks of a stretch that is timed: a tenth of a millisecond.
const STRETCH: usize = 200;

/// What a tick of either costs; for the page on speed. Of short stretches the fastest of many passes counts, so that other
/// work of the machine has no part in it.
#[test]
#[ignore = "long: a measurement"]
fn a_tick_at_run_time_takes_less_than_three_times_the_emitted_one() {
    for (name, spec, edits) in [
        ("reference", "reference.toml", &[][..]),
        ("f32", "features/platform-f32.toml", &[]),
        ("environment", "features/platform-environment.toml", &[]),
        ("legs", "legs.toml", &[]),
    ] {
        let emitted = Emitted::new(&format!("run-time-cost-{name}"), spec, edits);
        let controllers = [emitted.controller(), emitted.at_run_time()];
        let inputs = hostile(&emitted, &controllers[0], 20_000, 1);
        let times = controllers.map(|mut controller| {
            let mut output = vec![0; controller.description().output_names.len()];
            let rows: Vec<_> = inputs.rows().collect();
            let mut best = vec![f64::INFINITY; rows.len().div_ceil(STRETCH)];
            for _ in 0..30 {
                for (best, stretch) in best.iter_mut().zip(rows.chunks(STRETCH)) {
                    let start = std::time::Instant::now();
                    for row in stretch {
                        controller.step(row, &mut output);
                    }
                    *best = best.min(start.elapsed().as_secs_f64());
                }
            }
            best.iter().sum::<f64>() / rows.len() as f64
        });
        let (emitted, at_run_time, ratio) = (times[0] * 1e9, times[1] * 1e9, times[1] / times[0]);
        println!("{name}: {emitted:.0} ns emitted, {at_run_time:.0} ns at run time: {ratio:.2}");
        assert!(times[1] < 3.0 * times[0], "{name}: {times:?}");
    }
}
