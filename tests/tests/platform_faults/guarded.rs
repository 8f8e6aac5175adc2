//! The emitted reference controller on the simulated machine, with the promises held against every tick.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::OnceLock;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, ControllerError, TickController};
use host_sim::description::Description;
use host_sim::platform::rig::{Bench, GaugeFault, Noise, Request, RunOptions, Tick};
use host_sim::platform::{PlatformRig, PlatformScenario, Specimen};
use host_sim::trajectory::PoseTarget;
use specgen_tests::{Emitted, worse};

pub const PERIOD: f64 = 1e-4;
/// Ticks of a period of the path that streams follow.
pub const LAP: usize = 2000;
/// From a turn to the way that it moves a gauge's target, m.
pub const LEVER: f64 = 0.08;

/// A converter code and a rounding, V.
pub const CODE: f64 = 150.0 / 65535.0 * 1.01;

pub const REFUSED: u32 = 1 << 16;
pub const STALE: u32 = 1 << 17;
pub const BUSY: u32 = 1 << 18;
pub const WRENCH: u32 = 1 << 19;

/// The reference, compiled once.
pub fn emitted() -> &'static Emitted {
    static EMITTED: OnceLock<Emitted> = OnceLock::new();
    EMITTED.get_or_init(|| Emitted::new("platform-faults", "reference.toml", &[]))
}

/// The reference machine with its tolerances and noise, pre-cycled and zeroed once.
pub fn machine() -> PlatformRig {
    static MACHINE: OnceLock<PlatformRig> = OnceLock::new();
    let prepared = MACHINE.get_or_init(|| {
        let specimen = Specimen::reference();
        let options = RunOptions::new(PERIOD, [0.0; 6]);
        PlatformScenario::new(&specimen, &Noise::of(&specimen), 1, options).rig().clone()
    });
    prepared.clone()
}

/// What a test does to the controller beside what the bench does.
#[derive(Default)]
pub struct Commands {
    /// Input words that are replaced while they stand here.
    words: Vec<(usize, u64)>,
    /// Settings to take before the next tick.
    config: Option<Vec<u64>>,
    /// Settings to offer before the next tick, which must be refused.
    pub bad_config: Option<Vec<u64>>,
}

/// The controller, with the promises held against every tick: all numbers finite, codes within the voltage limits, no code
/// further from the last than the slew rate allows, the target within the workspace and no further from the last than a
/// stream may go.
pub struct GuardedMachine {
    inner: Controller,
    orders: Rc<RefCell<Commands>>,
    codes: [i64; 6],
    target: [f64; 6],
    tick: usize,
}

impl GuardedMachine {
    fn number(&self, output: &[u64], name: &str, k: usize) -> f64 {
        let place = self.inner.description().output(&format!("{name}[{k}]")).expect("an output word");
        self.inner.description().scalar.decode(output[place])
    }

    fn check(&mut self, output: &[u64]) {
        let compiled = &emitted().compiled;
        let [low, high] = compiled.model.actuator.voltage;
        let setpoints = &compiled.ir.task_space.as_ref().expect("in task space").setpoints;
        let code = self.inner.description().output("dac_code[0]").expect("an output word");
        for k in 0..6 {
            for name in ["voltage", "requested", "demand", "level", "drift", "pose", "target", "load"] {
                let value = self.number(output, name, k);
                assert!(value.is_finite(), "tick {}: {name}[{k}] is {value}", self.tick);
            }
            let voltage = self.number(output, "voltage", k);
            assert!((low..=high).contains(&voltage), "tick {}: leg {k} at {voltage} V", self.tick);
            let step = output[code + k] as i64 - self.codes[k];
            let most = i64::from(compiled.ir.defaults.max_step);
            assert!(step.abs() <= most, "tick {}: leg {k} by {step} codes", self.tick);
            self.codes[k] = output[code + k] as i64;
            let target = self.number(output, "target", k);
            assert!(target.abs() <= compiled.ir.bounds.pose[k], "tick {}: target[{k}] {target}", self.tick);
            let step = (target - self.target[k]).abs();
            assert!(step <= setpoints.stream_step[k], "tick {}: target[{k}] by {step}", self.tick);
            self.target[k] = target;
        }
        self.tick += 1;
    }
}

impl TickController for GuardedMachine {
    fn description(&self) -> &Description {
        self.inner.description()
    }
    fn default_config(&self) -> Vec<u64> {
        self.inner.default_config()
    }
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.inner.configure(words)
    }
    fn reset(&mut self) {
        self.inner.reset();
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let mut words = input.to_vec();
        {
            let mut orders = self.orders.borrow_mut();
            for (place, word) in &orders.words {
                words[*place] = *word;
            }
            if let Some(config) = orders.bad_config.take() {
                assert!(self.inner.configure(&config).is_err(), "these settings must be refused");
            }
            if let Some(config) = orders.config.take() {
                self.inner.configure(&config).expect("permitted settings");
            }
        }
        self.inner.step(&words, output);
        self.check(output);
    }
    fn state_digest(&self) -> u64 {
        self.inner.state_digest()
    }
}

/// A machine under the controller, at its bias pose and settled.
pub struct Run<'a> {
    pub bench: Bench<'a>,
    pub orders: Rc<RefCell<Commands>>,
    pub description: Description,
    pub config: Vec<u64>,
    /// Tick of the path, for streams.
    pub now: usize,
}

pub fn run(test: impl FnOnce(&mut Run)) {
    let inner = emitted().at_run_time();
    let (description, config) = (inner.description().clone(), inner.default_config());
    let orders = Rc::<RefCell<Commands>>::default();
    let mut guarded = GuardedMachine { inner, orders: Rc::clone(&orders), codes: [0; 6], target: [0.0; 6], tick: 0 };
    let mut rig = machine();
    let mut bench = Bench::new(&mut rig, &mut guarded, PERIOD, 0).expect("the words of a platform");
    bench.arm(10.0).expect("the bias pose");
    let mut run = Run { bench, orders, description, config, now: 0 };
    run.ticks(2000, &Request::default());
    test(&mut run);
}

/// A smooth closed path: 6 µm in x, 4 µm in z, 60 µrad about y, from and to the bias pose.
pub fn path(tick: usize) -> PoseTarget {
    let omega = std::f64::consts::TAU / (LAP as f64 * PERIOD);
    let phase = std::f64::consts::TAU * (tick % LAP) as f64 / LAP as f64;
    let sizes = [3e-6, 0.0, 2e-6, 0.0, 30e-6, 0.0];
    PoseTarget {
        pose: sizes.map(|a| a * (1.0 - phase.cos())),
        rate: sizes.map(|a| a * omega * phase.sin()),
        acceleration: sizes.map(|a| a * omega * omega * phase.cos()),
    }
}

impl Run<'_> {
    pub fn ticks(&mut self, count: usize, request: &Request) -> Vec<Tick> {
        (0..count).map(|_| self.bench.tick(request).unwrap_or_else(|error: RunError| panic!("{error:?}"))).collect()
    }

    /// Follows the path for some ticks.
    pub fn stream(&mut self, count: usize) -> Vec<Tick> {
        (0..count)
            .flat_map(|_| {
                self.now += 1;
                self.ticks(1, &Request::stream(path(self.now)))
            })
            .collect()
    }

    /// Replaces an input word by a number until [`Run::release`].
    pub fn force(&mut self, name: &str, value: f64) {
        let word = self.description.scalar.encode(value);
        self.force_word(name, word);
    }

    pub fn force_word(&mut self, name: &str, word: u64) {
        let place = self.description.input(name).expect("an input word");
        self.orders.borrow_mut().words.push((place, word));
    }

    pub fn release(&mut self) {
        self.orders.borrow_mut().words.clear();
    }

    /// Changes settings from the next tick on.
    pub fn set(&mut self, settings: &[(&str, f64)]) {
        for (name, value) in settings {
            self.description.set_config(&mut self.config, name, *value).expect("a setting");
        }
        self.orders.borrow_mut().config = Some(self.config.clone());
    }

    pub fn fault(&mut self, gauge: usize, fault: Option<GaugeFault>) {
        self.bench.rig().set_fault(gauge, fault);
    }
}

/// Largest distance of the true pose from the target, turns counted by the way at a gauge, m.
pub fn worst(ticks: &[Tick]) -> f64 {
    ticks.iter().map(distance).fold(0.0, worse)
}

pub fn distance(tick: &Tick) -> f64 {
    let error = |k: usize| (tick.pose[k] - tick.target[k]) * if k < 3 { 1.0 } else { LEVER };
    (0..6).map(|k| error(k) * error(k)).sum::<f64>().sqrt()
}

/// Largest change of a voltage from tick to tick, the first from `before`, V.
pub fn largest_step(before: &Tick, ticks: &[Tick]) -> f64 {
    let mut largest = 0.0_f64;
    for (a, b) in std::iter::once(before).chain(ticks).zip(ticks) {
        for leg in 0..6 {
            largest = worse(largest, (b.voltage[leg] - a.voltage[leg]).abs());
        }
    }
    largest
}

pub fn all_status(ticks: &[Tick]) -> Vec<u32> {
    let mut all: Vec<u32> = ticks.iter().map(|tick| tick.status).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// What an undisturbed lap does: largest error (m) and voltage step (V).
pub fn undisturbed(run: &mut Run) -> (f64, f64, Tick) {
    run.stream(LAP);
    let lap = run.stream(LAP);
    assert_eq!(all_status(&lap), [0]);
    (worst(&lap), largest_step(&lap[0], &lap[1..]), lap[LAP - 1])
}
