//! Snapshots whose words were changed under a checksum that fits: what is loaded is a state that this machine can have, so that its ticks
//! stay finite and within limits from there on.

use crate::rate_options::{CREEP, DYNAMIC, WIDENED, option_files};
use host_sim::controller::TickController as _;
use host_sim::controller::{RestingReadings, SnapshotError, Supervised};
use host_sim::word::Scalar;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_tests::{Emitted, length};

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");

/// Ticks from reset to the snapshots that are changed: in the wiring check, on the way to the bias pose, at it, in motion.
const MOMENTS: [u32; 4] = [2000, 5200, 9000, 9300];

/// A machine under sensible inputs, tick by tick.
struct Course {
    machine: Supervised,
    /// Gauges that show what the legs move until the machine runs, and stand still from then on.
    standing: RestingReadings,
    input: Vec<u64>,
    output: Vec<u64>,
    /// Where the set-point and the gauges stand among the inputs.
    setpoint: usize,
    scalar: Scalar,
    platform: bool,
    tick: u32,
}

impl Course {
    fn new(emitted: &Emitted) -> Self {
        let machine = Supervised::new(emitted.at_run_time());
        let names = machine.input_names();
        let input = vec![0; names.len()];
        Self {
            standing: machine.standing(&input).expect("a library with the wiring check"),
            input,
            output: vec![0; machine.output_names().len()],
            setpoint: names.iter().position(|name| name == "setpoint[0]").expect("an input"),
            scalar: machine.controller().description().scalar,
            platform: emitted.compiled.ir.task_space.is_some(),
            machine,
            tick: 0,
        }
    }

    /// Arms, runs, and moves to one pose after the other; the gauges stand still.
    fn step(&mut self) {
        self.tick += 1;
        let runs = self.tick > 5000;
        let request = if self.tick < 5 { 0 } else { 1 + u64::from(runs) };
        let words = self.input.len();
        self.input[words - 2] = request;
        if self.tick > 9000 || !self.platform {
            if self.platform {
                self.input[0] = 2;
            }
            let place = if (self.tick / 2000).is_multiple_of(2) { 2e-6 } else { 4e-6 };
            self.input[self.setpoint + 2] = self.scalar.encode(place);
        }
        self.machine.step(&self.input, &mut self.output);
        if !runs {
            self.standing.show(&self.machine, &self.output, &mut self.input);
        }
    }
}

/// Words of a snapshot, one to four of them changed.
fn changed(words: &mut [u64], draw: &mut ChaCha8Rng, scalar: Scalar) -> [usize; 4] {
    let count = words.len();
    let mut places = [0; 4];
    for place in places.iter_mut().take(1 + (draw.next_u64() % 4) as usize) {
        *place = (draw.next_u64() % count as u64) as usize;
        let random = draw.next_u64();
        let unit = (random >> 11) as f64 / (1_u64 << 53) as f64;
        words[*place] = match draw.next_u64() % 6 {
            0 => words[*place] ^ 1 << (random % u64::from(scalar.bits())),
            1 => scalar.encode(4.0 * unit - 2.0),
            2 => scalar.encode(unit * 10_f64.powf(-8.0 * unit)),
            3 => words[(random % count as u64) as usize],
            4 => random % 70,
            _ => scalar.encode(scalar.decode(words[*place]) * (1.0 + 60.0 * unit)),
        };
    }
    places
}

fn changed_snapshots_are_refused_or_harmless(name: &str, spec: &str, edits: &[(&str, &str)]) {
    let emitted = Emitted::with_records(name, spec, edits, &option_files());
    let [low, high] = emitted.compiled.model.actuator.voltage;
    let mut course = Course::new(&emitted);
    let scalar = course.scalar;
    let mut originals = Vec::new();
    for moment in MOMENTS {
        while course.tick < moment {
            course.step();
        }
        originals.push(course.machine.save());
    }
    let mut draw = ChaCha8Rng::seed_from_u64(46);
    let mut loaded = course.machine.fork();
    // By how much the largest changed word was changed: the first are those nearest to a bound.
    let mut accepted: Vec<(f64, Vec<u64>)> = Vec::new();
    let most = length(40, 300);
    // Of what was changed by less there is enough.
    let mut enough = -1.0;
    let (mut refused, mut taken) = (0_u64, 0_u64);
    let mut words = originals[0].clone();
    for number in 0..length(30_000_u64, 6_000_000) {
        let original = &originals[number as usize % originals.len()];
        words.copy_from_slice(original);
        let places = changed(&mut words, &mut draw, scalar);
        if loaded.load(&words).is_err() {
            refused += 1;
            continue;
        }
        taken += 1;
        let far = places
            .iter()
            .map(|place| scalar.decode(words[*place]).abs())
            .filter(|size| *size > 1e-300)
            .fold(0.0, f64::max);
        if far <= enough {
            continue;
        }
        accepted.push((far, words.clone()));
        if accepted.len() >= 2 * most {
            accepted.sort_by(|a, b| b.0.total_cmp(&a.0));
            accepted.truncate(most);
            enough = accepted[most - 1].0;
        }
    }
    accepted.sort_by(|a, b| b.0.total_cmp(&a.0));
    accepted.truncate(most);
    let voltage = loaded.output_names().iter().position(|name| name == "voltage[0]").expect("an output");
    let ticks = length(400, 10_000);
    let mut rung = 0;
    for (far, words) in &accepted {
        loaded.load(words).expect("as before");
        for tick in 0..ticks {
            if tick % 500 == 0 {
                // Holds, runs, moves.
                let request = [1, 2, 2, 2][tick / 500 % 4];
                let place = course.input.len() - 2;
                course.input[place] = request;
            }
            loaded.step(&course.input, &mut course.output);
            for leg in 0..6 {
                let volts = scalar.decode(course.output[voltage + leg]);
                assert!((low..=high).contains(&volts), "{name}: {volts} V on leg {leg}, tick {tick} after {far:e}");
            }
        }
        let after = loaded.save();
        // All bits are the word for "none": no number has them.
        let is_wrong = |word: u64| word != u64::MAX && !scalar.decode(word).is_finite();
        let wrong: Vec<_> = after.iter().enumerate().filter(|(_, word)| is_wrong(**word)).collect();
        assert!(wrong.is_empty(), "{name}: not finite after {far:e}: {wrong:x?}");
        // What a machine comes to from there is a state of it, too; but a notch that was loaded at its bound rings beyond it before it
        // fades. No machine is near: the bound is that of a request under the largest gains.
        match loaded.load(&after) {
            Err(SnapshotError::Word { word, .. }) if scalar.decode(word).abs() > 1e15 => rung += 1,
            ended => ended.unwrap_or_else(|error| panic!("{name}: {error} after {far:e}")),
        }
    }
    println!("{name}: {refused} refused, {taken} taken, {} run for {ticks} ticks, {rung} rang on", accepted.len());
    assert!(refused > taken / 10 && accepted.len() == most, "{name}: {refused} {taken}");
}

/// The legs of a platform are led by `control.lead`.
fn creep_of_a_platform() -> String {
    CREEP.replace("\ndead_time = \"0.35 ms\"", "")
}

#[test]
fn of_a_platform_with_creep() {
    let creep = creep_of_a_platform();
    changed_snapshots_are_refused_or_harmless("snapshots-creep", "reference.toml", &[("memory  = 64", &creep)]);
}

#[test]
fn of_a_platform_with_creep_in_f32() {
    let edits = [("memory  = 64", &*creep_of_a_platform()), F32];
    changed_snapshots_are_refused_or_harmless("snapshots-creep-f32", "reference.toml", &edits);
}

#[test]
fn of_a_platform_with_dynamic_preisach() {
    changed_snapshots_are_refused_or_harmless("snapshots-dynamic", "reference.toml", &[("memory  = 64", DYNAMIC)]);
}

#[test]
fn of_a_platform_with_plays_that_widen() {
    changed_snapshots_are_refused_or_harmless("snapshots-plays", "reference.toml", &[WIDENED]);
}

#[test]
fn of_six_legs() {
    changed_snapshots_are_refused_or_harmless("snapshots-legs", "legs.toml", &[("memory  = 64", CREEP)]);
}
