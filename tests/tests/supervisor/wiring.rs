//! The wiring check in the emitted controller: machines with one fault each are refused and the fault is named, machines without
//! one are not refused. The machine of random draws is of its own text: six simulated legs, and a matrix from their free
//! displacements to the gauges; that of the faults is the simulated platform with its modes, too.

use super::bench::{ARM, ARMING, DISARMED, FAULTED, HOLD, HOLDING, NOTHING, RAMP_DOWN, RAMPING};
use host_sim::closed_loop::{Preparation, Rig};
use host_sim::controller::{MachineWord, Supervised, TickController};
use host_sim::noise::Gaussian;
use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};
use host_sim::platform::PlatformRig;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::compile::Compilation;
use specgen::machine;
use specgen::model::Mcu;
use specgen_runtime::supervisor::{Fault, Finding, FindingText, with};
use specgen_tests::{Emitted, Row, assert_same_machine, leg_class, scenario};

type Six = [f64; 6];
type Matrix = [Six; 6];

/// Most of the stroke that a leg may move in a check.
const MOST: f64 = 0.03;
const IDENTITY: Matrix = {
    let mut rows = [[0.0; 6]; 6];
    let mut k = 0;
    while k < 6 {
        rows[k][k] = 1.0;
        k += 1;
    }
    rows
};

/// What a controller moves and sees.
trait Machine {
    /// Holds six voltages for an interval; largest displacement of a leg, m.
    fn hold(&mut self, voltages: &Six, interval: f64) -> f64;
    fn read(&mut self) -> Six;
}

/// How a machine was armed, until it held or was faulted.
struct ArmedMachine {
    /// The supervisor's last word.
    word: MachineWord,
    ticks: u32,
    /// Largest displacement of a leg, m.
    moved: f64,
    rows: Vec<Row>,
}

fn arm(supervised: &mut Supervised, machine: &mut dyn Machine, compiled: &Compilation) -> ArmedMachine {
    arm_until(supervised, machine, compiled, u32::MAX, ARM)
}

/// Arms the machine, then sends request `then` from tick `until` on.
fn arm_until(
    supervised: &mut Supervised,
    machine: &mut dyn Machine,
    compiled: &Compilation,
    until: u32,
    then: u64,
) -> ArmedMachine {
    supervised.reset();
    let scalar = supervised.controller().description().scalar;
    let (inputs, outputs) = (supervised.input_names(), supervised.output_names());
    let place = |names: &[String], name: &str| names.iter().position(|one| one == name).expect("a word");
    let platform = compiled.model.task_space.is_some();
    let gauges = place(&inputs, if platform { "gauge[0]" } else { "displacement[0]" });
    let voltages = place(&outputs, "voltage[0]");
    let request = place(&inputs, "request");
    let (mut input, mut output) = (vec![0; inputs.len()], vec![0; outputs.len()]);
    let mut armed = ArmedMachine { word: MachineWord::of(0), ticks: 0, moved: 0.0, rows: Vec::new() };
    for tick in 0..20_000 {
        for (slot, reading) in input[gauges..].iter_mut().zip(machine.read()) {
            *slot = scalar.encode(reading);
        }
        input[request] = match tick {
            0 => NOTHING,
            _ if tick >= until => then,
            _ => ARM,
        };
        let word = supervised.step(&input, &mut output);
        (armed.word, armed.ticks) = (word, tick);
        armed.rows.push((input.clone(), output.clone(), supervised.digest()));
        if matches!(word.phase, HOLDING | FAULTED) || tick > 0 && word.phase == DISARMED {
            return armed;
        }
        assert!(tick == 0 || matches!(word.phase, ARMING | RAMPING), "tick {tick}: {word:?}");
        let held: Six = std::array::from_fn(|leg| scalar.decode(output[voltages + leg]));
        armed.moved = armed.moved.max(machine.hold(&held, compiled.model.timing.period));
    }
    panic!("it neither holds nor is faulted");
}

/// Six legs and what the gauges show of their free displacements.
struct Legs {
    rig: Rig,
    mix: Matrix,
    noise: Gaussian,
    /// What shakes the gauges, m and Hz, and for how long it did, s.
    shaken: [f64; 2],
    time: f64,
}

impl Legs {
    /// Legs of these parameters, each with a gain of its own.
    fn new(parameters: &LegParameters, gains: &Six, mix: Matrix, seed: u64) -> Self {
        let legs = std::array::from_fn(|leg| {
            LegPlant::new(&LegParameters { gain_um_per_v: parameters.gain_um_per_v * gains[leg], ..parameters.clone() })
        });
        let mut rig = Rig::new(legs, &NoiseParameters { amplifier_mv_rms: 2.0, ..NoiseParameters::NONE }, seed);
        rig.prepare(&Preparation { peak: 100.0, rate: 1000.0, settle: 0.5, update: 1e-3, rest: 0.0 });
        Self { rig, mix, noise: Gaussian::new(2.2e-9, seed, 77), shaken: [0.0; 2], time: 0.0 }
    }
}

impl Machine for Legs {
    fn hold(&mut self, voltages: &Six, interval: f64) -> f64 {
        self.rig.hold(voltages, interval);
        self.time += interval;
        self.rig.displacements().into_iter().fold(0.0, |most, moved| most.max(moved.abs()))
    }

    fn read(&mut self) -> Six {
        let moved = self.rig.displacements();
        let [amplitude, frequency] = self.shaken;
        let along = amplitude * (std::f64::consts::TAU * frequency * self.time).sin();
        // Along an axis that no gauge or leg has to itself.
        let shown = [0.6, -0.8, 0.5, 1.0, -0.4, 0.7].map(|part| part * along);
        std::array::from_fn(|gauge| dot(&self.mix[gauge], &moved) + shown[gauge] + self.noise.draw())
    }
}

/// The simulated platform, wired as a fault says.
struct Platform {
    rig: PlatformRig,
    gauges: Matrix,
    legs: Matrix,
}

impl Platform {
    fn new(rig: &PlatformRig, fault: Finding) -> Self {
        let mixed = |of_gauge: bool| match fault {
            Finding::Gauge(..) if of_gauge => with(&IDENTITY, fault),
            Finding::Leg(..) if !of_gauge => with(&IDENTITY, fault),
            _ => IDENTITY,
        };
        Self { rig: rig.clone(), gauges: mixed(true), legs: mixed(false) }
    }
}

impl Machine for Platform {
    fn hold(&mut self, voltages: &Six, interval: f64) -> f64 {
        let voltages = self.legs.map(|row| dot(&row, voltages));
        self.rig.hold(&voltages, interval);
        self.rig.plant().free_displacements().into_iter().fold(0.0, |most: f64, moved| most.max(moved.abs()))
    }

    fn read(&mut self) -> Six {
        let shown = self.rig.read_gauges();
        self.gauges.map(|row| dot(&row, &shown))
    }
}

fn dot(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Every single fault of a gauge or a leg.
fn faults() -> Vec<Finding> {
    let kinds: [fn(u32, Fault) -> Finding; 2] = [Finding::Gauge, Finding::Leg];
    let mut all = Vec::new();
    for kind in kinds {
        for place in 0..6 {
            all.extend(
                [Fault::Inverted, Fault::Dead, Fault::Gain(50), Fault::Gain(200)].map(|fault| kind(place, fault)),
            );
            all.extend((place + 1..6).map(|other| kind(place, Fault::Swapped(other))));
        }
    }
    assert_eq!(all.len(), 2 * (6 * 4 + 15));
    all
}

/// One of each kind in the short run.
fn tried() -> Vec<Finding> {
    let some = [Fault::Inverted, Fault::Dead, Fault::Gain(50), Fault::Gain(200), Fault::Swapped(5)];
    let of_gauges = (0..).zip(some).map(|(place, fault)| Finding::Gauge(place, fault));
    let of_legs = (0..).zip(some).map(|(place, fault)| Finding::Leg(4 - place, fault));
    let some: Vec<Finding> = of_gauges.chain(of_legs).collect();
    assert!(some.iter().all(|fault| faults().contains(fault)));
    specgen_tests::length(some, faults())
}

/// Whether what was found is the fault; of gains, one that is as wrong.
fn names(found: Finding, fault: Finding) -> bool {
    let near =
        |found: u32, made: u32| if made < 100 { (30..=72).contains(&found) } else { (142..=280).contains(&found) };
    match (found, fault) {
        (Finding::Gauge(a, Fault::Gain(found)), Finding::Gauge(b, Fault::Gain(made)))
        | (Finding::Leg(a, Fault::Gain(found)), Finding::Leg(b, Fault::Gain(made))) => a == b && near(found, made),
        (found, fault) => found == fault,
    }
}

fn finding(word: MachineWord) -> Finding {
    Finding::of_word(word.finding)
}

#[test]
fn every_single_fault_of_a_platform_is_refused_and_named() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let scenario = scenario(compiled, &LegParameters::reference(), 5);
    let ArmedMachine { word, ticks, moved, .. } =
        arm(&mut supervised, &mut Platform::new(scenario.rig(), Finding::None), compiled);
    assert_eq!((word.phase, word.cause, finding(word)), (HOLDING, 0, Finding::None));
    let stroke = compiled.model.actuator.stroke;
    println!("good: armed after {ticks} ticks, a leg moved {:.2} % of its stroke", moved / stroke * 1e2);
    // 100 ms, six legs of 50 ms, and the verdict.
    assert!((4000..4020).contains(&ticks), "{ticks}");
    assert!(moved > 0.003 * stroke && moved < 0.012 * stroke, "{moved}");
    let mut most = 0.0_f64;
    let faults = tried();
    for &fault in &faults {
        let ArmedMachine { word, moved, .. } =
            arm(&mut supervised, &mut Platform::new(scenario.rig(), fault), compiled);
        assert_eq!((word.phase, word.cause, word.amplifier_on), (FAULTED, 14, false), "{fault}: {}", finding(word));
        assert!(names(finding(word), fault), "{fault}: {}", finding(word));
        most = most.max(moved);
    }
    println!("{} faults named; a leg moved {:.2} % of its stroke at most", faults.len(), most / stroke * 1e2);
    assert!(most < MOST * stroke, "{most}");
}

/// Each leg with its own gauge: a gauge and its leg are not told apart, and the set that looks alike is named.
#[test]
fn every_single_fault_of_six_legs_is_refused_and_named_with_what_looks_like_it() {
    let emitted = Emitted::new("supervisor-wiring-legs", "legs.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let parameters = machine::leg(&compiled.model, &LegParameters::reference());
    let alike = &compiled.ir.supervision.wiring.as_ref().unwrap().alike;
    let run = |supervised: &mut Supervised, mix| {
        let mut legs = Legs::new(&parameters, &[1.0, 0.95, 1.05, 0.98, 1.02, 1.0], mix, 7);
        finding(arm(supervised, &mut legs, compiled).word)
    };
    assert_eq!(run(&mut supervised, IDENTITY), Finding::None);
    // Every second one in the short run: of gauges and of legs.
    for fault in tried().into_iter().step_by(specgen_tests::length(2, 1)) {
        let found = run(&mut supervised, with(&IDENTITY, fault));
        let text = FindingText(found, alike).to_string();
        let set = alike.iter().find(|set| set.contains(&fault.word())).unwrap_or_else(|| panic!("{fault}: alone"));
        assert!(set.iter().any(|word| names(found, Finding::of_word(*word))), "{fault}: {text}");
        assert!(text.contains(", or "), "{text}");
        assert!(!matches!(found, Finding::None | Finding::Unexplained | Finding::Nothing), "{fault}: {found}");
    }
}

/// Uniform between two values.
struct RandomSource(ChaCha8Rng);

impl RandomSource {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn six(&mut self, spread: f64) -> Six {
        std::array::from_fn(|_| 1.0 + self.within(-spread, spread))
    }
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| std::array::from_fn(|column| (0..6).map(|k| row[k] * b[k][column]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| a[column][row]))
}

fn inverse(a: &Matrix) -> Matrix {
    let matrix = nalgebra::Matrix6::from_fn(|row, column| a[row][column]);
    let inverse = matrix.try_inverse().expect("regular");
    std::array::from_fn(|row| std::array::from_fn(|column| inverse[(row, column)]))
}

/// A machine without a fault, as the study draws it: gauge gains ±5 %, tilts of 20 mrad, gauges 2 mm off, stiffness ±20 %, joints of
/// up to 5 % of the legs' stiffness in every axis, leg gains ±15 %, small motions of 0.5 to 0.95 of the spec's gain.
fn random(compiled: &Compilation, number: u64) -> Legs {
    let model = &compiled.model;
    let mut draw = RandomSource(ChaCha8Rng::seed_from_u64(4600 + number));
    let parameters = machine::leg(model, &leg_class(number));
    let small = {
        let mut leg = Legs::new(&parameters, &[1.0; 6], IDENTITY, number);
        let mut most = 0.0_f64;
        for tick in 0..500 {
            let turn = std::f64::consts::TAU * f64::from(tick) / 500.0;
            leg.rig.hold(&[0.5 - 0.5 * turn.cos(); 6], 1e-4);
            most = most.max(leg.rig.displacements()[0]);
        }
        most
    };
    let gain = draw.within(0.5, 0.95) * model.actuator.leg_gain() / small;
    let jacobian = specgen::lower::leg_jacobian(&model.geometry).expect("a platform");
    let mut gauges: Matrix = [[0.0; 6]; 6];
    let task = model.task_space.as_ref().expect("a platform");
    for (row, probe) in gauges.iter_mut().zip(&task.probes) {
        let mut direction: [f64; 3] =
            std::array::from_fn(|axis| probe.direction[axis] + draw.within(-0.02, 0.02) / 1.5);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        direction = direction.map(|x| x / length);
        let mut at: [f64; 3] = std::array::from_fn(|axis| probe.point[axis] + draw.within(-2e-3, 2e-3));
        at[2] -= model.geometry.height;
        let gain = draw.within(0.95, 1.05);
        let [dx, dy, dz] = direction;
        let [x, y, z] = at;
        *row = [dx, dy, dz, y * dz - z * dy, z * dx - x * dz, x * dy - y * dx].map(|part| part * gain);
    }
    let stiffness = draw.six(0.2).map(|factor| factor * model.actuator.axial_stiffness);
    let weighted = std::array::from_fn(|leg| jacobian[leg].map(|part| part * stiffness[leg]));
    let mut of_pose = times(&transposed(&jacobian), &weighted);
    for (axis, row) in of_pose.iter_mut().enumerate() {
        row[axis] *= 1.0 + draw.within(0.0, 0.05);
    }
    let pose = times(&inverse(&of_pose), &transposed(&weighted));
    let mix = times(&gauges, &pose).map(|row| row.map(|entry| entry * gain));
    Legs::new(&parameters, &draw.six(0.15), mix, number)
}

#[test]
fn no_fault_free_machine_is_refused() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let machines = specgen_tests::length(3, 200);
    let refused: Vec<String> = (0..machines)
        .filter_map(|number| {
            let word = arm(&mut supervised, &mut random(compiled, number), compiled).word;
            (word.phase != HOLDING).then(|| format!("{number}: {word}, {}", finding(word)))
        })
        .collect();
    assert!(refused.is_empty(), "of {machines} machines are refused {refused:#?}");
}

/// All gauges or legs turned round, and legs that all move five and ten times as far as the spec says.
#[test]
fn what_all_of_them_have_in_common_is_refused() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let scenario = scenario(compiled, &LegParameters::reference(), 5);
    let mut found = |gauges: f64, legs: f64| {
        let scaled = |by: f64| IDENTITY.map(|row| row.map(|entry| by * entry));
        let mut platform = Platform { rig: scenario.rig().clone(), gauges: scaled(gauges), legs: scaled(legs) };
        let word = arm(&mut supervised, &mut platform, compiled).word;
        assert_eq!((word.phase, word.cause, word.amplifier_on), (FAULTED, 14, false));
        finding(word)
    };
    assert_eq!(found(-1.0, 1.0), Finding::Inverted);
    for &gain in specgen_tests::length(&[5.0][..], &[5.0, 10.0]) {
        for common in [found(1.0, gain), found(gain, 1.0)] {
            let Finding::Common(hundredths) = common else { panic!("{gain}: {common}") };
            assert!((0.5..1.1).contains(&(f64::from(hundredths) / 100.0 / gain)), "{gain}: {common}");
        }
    }
}

/// Connectors of all gauges or of all legs turned by 120°, or both: on this geometry each is refused.
#[test]
fn turned_connectors_are_refused() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    assert!(compiled.ir.supervision.wiring.as_ref().unwrap().turned.is_empty());
    let mut supervised = Supervised::new(emitted.at_run_time());
    let scenario = scenario(compiled, &LegParameters::reference(), 5);
    let turned = |by: usize| -> Matrix { std::array::from_fn(|row| IDENTITY[(row + by) % 6]) };
    for &(gauges, legs) in
        specgen_tests::length(&[(2, 0), (0, 2)][..], &[(2, 0), (4, 0), (0, 2), (0, 4), (2, 2), (2, 4), (4, 2), (4, 4)])
    {
        let mut platform = Platform { rig: scenario.rig().clone(), gauges: turned(gauges), legs: turned(legs) };
        let word = arm(&mut supervised, &mut platform, compiled).word;
        println!("gauges turned by {gauges} places, legs by {legs}: {}", finding(word));
        assert_eq!((word.phase, word.cause, word.amplifier_on), (FAULTED, 14, false));
        assert_ne!(finding(word), Finding::None);
    }
}

/// A stop in the middle of a pulse: the leg goes to rest, no further, and the machine is disarmed.
#[test]
fn a_stop_ends_the_pulses_at_once() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let codes_at = supervised.output_names().iter().position(|name| name == "dac_code[0]").unwrap();
    let rest = i64::from(compiled.ir.supervision.rest);
    for then in [HOLD, RAMP_DOWN] {
        for &until in specgen_tests::length(&[600, 1250][..], &[600, 1250, 1251, 1600, 3900]) {
            let mut legs = random(compiled, 1);
            let ArmedMachine { word, ticks, rows, .. } = arm_until(&mut supervised, &mut legs, compiled, until, then);
            assert_eq!((word.phase, word.cause, word.amplifier_on), (DISARMED, 0, false), "{then} at {until}");
            let away = |tick: u32| -> i64 {
                rows[tick as usize].1[codes_at..][..6].iter().map(|code| (*code as i64 - rest).abs()).sum()
            };
            assert!((until..ticks).all(|tick| away(tick) <= away(tick - 1)), "{then} at {until}: it moves on");
            assert!(until == 600 || until == 1600 || away(until - 1) > 100, "{then} at {until}: not in a pulse");
            assert!(ticks - until < 110, "{then} at {until}: {} ticks to rest", ticks - until);
        }
    }
}

/// Vibration within what the reference platform tolerates while it runs.
#[test]
fn vibration_blames_no_gauge_or_leg() {
    let emitted = Emitted::new("supervisor-wiring", "reference.toml", &[]);
    let compiled = &emitted.compiled;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let (machines, amplitudes) = specgen_tests::length((4, &[(20e-9, 2)][..]), (26, &[(20e-9, 8), (40e-9, 20)]));
    for &(amplitude, most) in amplitudes {
        let mut refused = 0;
        for number in 0..machines {
            let mut legs = random(compiled, number);
            legs.shaken = [amplitude, 10.0 + number as f64];
            let word = arm(&mut supervised, &mut legs, compiled).word;
            assert!(matches!(finding(word), Finding::None | Finding::Unexplained), "{number}: {}", finding(word));
            refused += u32::from(word.phase != HOLDING);
        }
        println!("{:.0} nm of vibration, from 10 Hz: {refused} of {machines} machines refused", amplitude * 1e9);
        assert!(refused <= most, "{refused}");
    }
}

/// Host and emulated MCU: the same bits of a check that passes and of one that looks for what is wrong, in f64 and in f32.
#[test]
#[ignore = "long: the check on the emulated M7"]
fn a_check_has_the_same_bits_on_the_mcu() {
    for (name, spec, mcu) in [
        ("supervisor-wiring", "reference.toml", Mcu::Mps2An500),
        ("supervisor-wiring-f32", "features/platform-f32.toml", Mcu::Mps2An386),
    ] {
        let emitted = Emitted::new(name, spec, &[]);
        let compiled = &emitted.compiled;
        let mut supervised = Supervised::new(emitted.at_run_time());
        let Some(image) = emitted.image(mcu) else { return };
        let config = supervised.controller().default_config();
        let parameters = machine::leg(&compiled.model, &LegParameters::reference());
        let readings = compiled.ir.supervision.readings_per_leg.unwrap();
        for fault in [Finding::None, Finding::Gauge(3, Fault::Swapped(5)), Finding::Leg(2, Fault::Inverted)] {
            let mut legs = Legs::new(&parameters, &[1.0; 6], with(&readings, fault), 3);
            let host = arm(&mut supervised, &mut legs, compiled);
            assert_eq!(finding(host.word), fault);
            assert!(host.rows.len() > 1000);
            let result = assert_same_machine(&format!("{name}, {fault}"), &image, &config, &host.rows);
            let stage = result.stats.stage("other phases").expect("no tick runs");
            let (ticks, mean, most) = (host.rows.len(), stage.mean(), stage.largest);
            let bytes = result.stats.state_bytes;
            println!(
                "{name}, {fault}: {ticks} ticks equal in every bit; instructions {mean:.0} mean, {most} at most; Machine {bytes} bytes"
            );
        }
    }
}

/// What `specgen check --details` says of the check.
#[test]
fn what_looks_alike_and_what_is_not_seen_is_printed_for_each_spec() {
    let described = |spec: &str, section: &str| {
        let edits = [("[timing]\n", &*format!("[supervisor.wiring_check]\n{section}\n\n[timing]\n"))];
        let compiled = specgen_tests::compile_edited("supervisor-wiring-described", spec, &edits, &[]);
        specgen::lower::describe_wiring(&compiled.model, &compiled.ir.supervision)
    };
    let text = described("reference.toml", "");
    assert!(text.contains("0.950 V, 0.599 um, 50.0 ms on each leg; 0.30 s in total"), "{text}");
    assert!(text.contains("this geometry distinguishes all single faults"), "{text}");
    assert!(
        text.ends_with("all gauges or all legs that leaves 0.35 to 2.145 of the spec's gain\n")
            && !text.contains("rotated"),
        "{text}"
    );
    let text = described("legs.toml", "");
    assert!(text.contains("\n      gauge 1 inverted, leg 1 inverted\n"), "{text}");
    assert!(text.contains("\n      gauge 0 swapped with gauge 5, leg 0 swapped with leg 5\n"), "{text}");
    assert!(text.contains("gauges rotated by 2 positions and those of all legs by 2"), "{text}");
    let text = described("reference.toml", "legs = \"different\"");
    assert!(text.contains("gains of legs are not checked until each leg has its own record"), "{text}");
    assert!(text.contains("not detected: leg 0 gain × 0.50, leg 0 gain × 2.00, leg 1 gain × 0.50"), "{text}");
    let text = described("features/six-records.toml", "legs = \"different\"");
    assert!(!text.contains("not checked"), "legs with records of their own are compared with these: {text}");
    let text = described("reference.toml", "off = \"a plant without gauges\"");
    assert!(text.contains("wiring check: off (a plant without gauges)"), "{text}");
}
