//! Nothing that a sound machine does is taken for an oscillation.

use host_sim::controller::{Supervised, TickController};
use host_sim::platform::Wrench;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::machine as simulated;
use specgen_tests::{Emitted, leg_class, repository};
use std::fs;

use super::super::bench::{ACKNOWLEDGE, ARM, HOLD, HOLDING, NOTHING, RAMP_DOWN, RUN, RUNNING};
use super::machine::{Machine, Six};
use super::{OSCILLATION, in_micrometres};

/// Random numbers.
struct RandomSource(ChaCha8Rng);

impl RandomSource {
    fn below(&mut self, count: u64) -> u64 {
        self.0.next_u64() % count
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A platform that does what platforms do, and what happened.
struct Usage<'a> {
    machine: Machine,
    emitted: &'a Emitted,
    draw: RandomSource,
    what: String,
    alarms: Vec<String>,
    trajectories: u64,
}

impl Usage<'_> {
    fn tick(&mut self, request: u64) {
        let before = (self.machine.word.cause, self.machine.word.finding);
        let word = self.machine.tick(request);
        if (word.cause == OSCILLATION || word.finding != 0) && before != (word.cause, word.finding) {
            let (ticks, what, error) = (self.machine.ticks, &self.what, in_micrometres(&self.machine.error()));
            self.alarms.push(format!("tick {ticks}, {what}: {word}, error {error}"));
        }
    }

    fn ticks(&mut self, time: f64) {
        for _ in 0..(time / self.machine.period()) as u64 {
            self.tick(NOTHING);
        }
    }

    fn arrive(&mut self, limit: f64) {
        for _ in 0..(limit / self.machine.period()) as u64 {
            self.tick(NOTHING);
            if !self.machine.is_busy() {
                break;
            }
        }
    }

    fn home(&mut self) {
        self.machine.command(2, 0, &[0.0; 6]);
        self.arrive(3.0);
    }

    /// A pose in the workspace about the bias.
    fn pose(&mut self, share: f64) -> Six {
        let model = &self.emitted.compiled.model;
        let (bounds, bias) = (model.workspace.bounds(), model.task_space.as_ref().unwrap().setpoint.bias);
        std::array::from_fn(|k| {
            let room = bounds[k] - bias[k].abs();
            self.draw.within(-share * room, share * room)
        })
    }

    /// A sine of one axis as a stream, faded in and out.
    fn wave(&mut self) {
        let hertz = [1.0, 5.0, 10.0, 30.0, 50.0, 100.0, 200.0][self.draw.below(7) as usize];
        let axis = self.draw.below(6) as usize;
        let task = self.emitted.compiled.model.task_space.as_ref().unwrap();
        let omega = std::f64::consts::TAU * hertz;
        let fastest = task.setpoint.stream_speed[axis.min(3) / 3];
        let most = if axis < 3 { 5e-6 } else { 5e-5 };
        let amplitude = self.draw.within(0.1, 1.0) * f64::min(most, 0.4 * fastest / omega);
        self.what = format!("wave of {hertz} Hz, {amplitude:.2e} along {axis}");
        let (time, fade) = (self.draw.within(0.2, 0.6), 0.05);
        let period = self.machine.period();
        for tick in 1..=(time / period) as u64 {
            let now = tick as f64 * period;
            let edge = f64::min(now, time - now) / fade;
            let share = if edge >= 1.0 { 1.0 } else { edge * edge * (3.0 - 2.0 * edge) };
            let slope = if edge >= 1.0 { 0.0 } else { 6.0 * edge * (1.0 - edge) / fade };
            let slope = if now < 0.5 * time { slope } else { -slope };
            let (sine, cosine) = (omega * now).sin_cos();
            let one = |value: f64| std::array::from_fn(|k| if k == axis { value } else { 0.0 });
            self.machine.stream(
                &one(amplitude * share * sine),
                &one(amplitude * (share * omega * cosine + slope * sine)),
                &one(-amplitude * share * omega * omega * sine),
            );
            self.tick(NOTHING);
        }
        self.machine.command(0, 0, &[0.0; 6]);
        self.arrive(1.0);
        self.ticks(0.1);
    }

    /// Steps of 1 um in 2 ms.
    fn steps(&mut self) {
        let axis = self.draw.below(3) as usize;
        self.what = format!("steps of 1 um along {axis}");
        let period = self.machine.period();
        let ticks = (2e-3 / period).round() as u64;
        for number in 0..6_u64 {
            let rest = (self.draw.within(5e-3, 0.1) / period) as u64;
            let up = number % 2 == 0;
            for tick in 1..=ticks + rest {
                let s = f64::min(tick as f64 / ticks as f64, 1.0);
                let shape = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
                let rate = 30.0 * s * s * (1.0 - s) * (1.0 - s) / 2e-3;
                let acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / 4e-6;
                let sign = if up { 1e-6 } else { -1e-6 };
                let place = if up { shape } else { 1.0 - shape } * 1e-6;
                let one = |value: f64| std::array::from_fn(|k| if k == axis { value } else { 0.0 });
                self.machine.stream(&one(place), &one(sign * rate), &one(sign * acceleration));
                self.tick(NOTHING);
            }
        }
        self.machine.command(0, 0, &[0.0; 6]);
        self.arrive(1.0);
    }

    fn force(&mut self) {
        self.what = "a force of 1 N".into();
        let [x, y, z]: [f64; 3] = std::array::from_fn(|_| self.draw.within(-1.0, 1.0));
        let size = (x * x + y * y + z * z).sqrt();
        let wrench = Wrench { force: [x / size, y / size, z / size], torque: [0.0; 3] };
        for wrench in [wrench, Wrench { force: [0.0; 3], torque: [0.0; 3] }] {
            self.machine.rig.plant_mut().disturb(&wrench);
            let time = self.draw.within(0.1, 0.4);
            self.ticks(time);
        }
    }

    /// Stops in the midst of what is under way, and goes on.
    fn hold(&mut self) {
        self.tick(HOLD);
        let time = self.draw.within(0.01, 1.0);
        for _ in 0..(time / self.machine.period()) as u64 {
            self.tick(HOLD);
        }
        self.tick(RUN);
        self.ticks(0.2);
    }

    fn mode(&mut self) {
        let mut config = self.machine.supervised.controller().default_config();
        let usual = config.clone();
        config[0] = self.draw.below(7);
        self.what = format!("mode {}", config[0]);
        self.machine.supervised.configure(&config).unwrap();
        self.ticks(0.1);
        let to = self.pose(0.3);
        self.machine.command(2, 0, &to);
        let time = self.draw.within(0.05, 0.5);
        self.ticks(time);
        self.what = format!("back from mode {}", config[0]);
        self.machine.supervised.configure(&usual).unwrap();
        self.arrive(2.0);
        self.ticks(0.2);
    }

    fn act(&mut self) {
        if self.machine.is_limited() {
            // A corner of the workspace that its legs do not reach: it does not stay there.
            self.home();
        }
        let action = self.draw.below(40);
        match action {
            0..=4 => {
                self.what = "rest".into();
                let time = self.draw.within(0.05, 0.5);
                self.ticks(time);
            }
            5..=9 => {
                let to = self.pose(0.6);
                self.what = format!("a move to {}", in_micrometres(&to));
                self.machine.command(2, 0, &to);
                self.arrive(3.0);
                self.ticks(0.1);
            }
            10..=15 if self.trajectories > 0 => {
                let selector = self.draw.below(self.trajectories);
                self.what = format!("trajectory {selector}");
                self.machine.command(3, selector, &[0.0; 6]);
                let time = self.draw.within(0.3, 2.5);
                self.ticks(time);
                if self.draw.below(3) == 0 {
                    self.what += ", stopped by a hold";
                    self.hold();
                }
                self.machine.command(0, 0, &[0.0; 6]);
                self.arrive(1.0);
            }
            16..=21 => {
                self.home();
                self.wave();
            }
            22..=27 => {
                self.home();
                self.steps();
            }
            28..=31 => self.force(),
            32..=34 => {
                self.what = "hold".into();
                let to = self.pose(0.5);
                self.machine.command(2, 0, &to);
                let time = self.draw.within(0.0, 0.3);
                self.ticks(time);
                self.hold();
                self.arrive(2.0);
            }
            35..=38 => self.mode(),
            _ => {
                self.what = "ramp down and arm anew".into();
                for _ in 0..40_000 {
                    self.tick(RAMP_DOWN);
                    if !self.machine.word.amplifier_on {
                        break;
                    }
                }
                self.recover();
            }
        }
    }

    /// Armed and running, whatever it was before.
    fn recover(&mut self) {
        for _ in 0..400_000 {
            let request = match self.machine.word.phase {
                0 | 1 => ARM,
                HOLDING => RUN,
                RUNNING => break,
                5 => ACKNOWLEDGE,
                _ => NOTHING,
            };
            self.tick(NOTHING);
            self.tick(request);
            while self.machine.word.phase == 1 {
                self.tick(ARM);
            }
        }
        self.arrive(5.0);
    }
}

/// Of one spec: ticks, and what was taken for an oscillation.
type QuietResult = (u64, Vec<String>);

fn platform(emitted: &Emitted, spec: &str, ticks: u64, number: u64) -> QuietResult {
    let supervised = Supervised::new(emitted.at_run_time());
    let (mut made, mut alarms) = (0, Vec::new());
    for class in 0..3 {
        let mut machine = Machine::with(supervised.fork(), &emitted.compiled, &leg_class(class), 5 + class);
        machine.start();
        // Gauges and frame drift by 2 nm a second; a reading is in V where there is a calibration.
        if emitted.compiled.model.task_space.as_ref().unwrap().calibration.is_none() {
            machine.vibration = Some(Box::new(|time| [2e-9 * time, -1e-9 * time, 2e-9 * time, 0.0, 0.0, 0.0]));
        }
        let trajectories = emitted.compiled.model.task_space.as_ref().unwrap().trajectories.len() as u64;
        let draw = RandomSource(ChaCha8Rng::seed_from_u64(1000 * number + class));
        let mut usage = Usage { machine, emitted, draw, what: String::new(), alarms: Vec::new(), trajectories };
        while usage.machine.ticks < ticks / 3 {
            usage.act();
            if usage.machine.word.phase != RUNNING || usage.machine.word.cause != 0 {
                usage.recover();
            }
        }
        made += usage.machine.ticks;
        alarms.extend(usage.alarms.into_iter().map(|alarm| format!("{spec}, class {class}: {alarm}")));
    }
    (made, alarms)
}

/// Six legs with their own gauges, whose set-points rest, step and go to and fro.
fn legs(emitted: &Emitted, spec: &str, ticks: u64, number: u64) -> QuietResult {
    let model = &emitted.compiled.model;
    let mut supervised = Supervised::new(emitted.at_run_time());
    let (scalar, period) = (supervised.controller().description().scalar, model.timing.period);
    let (inputs, outputs) = (supervised.input_names(), supervised.output_names());
    let at = |names: &[String], name: &str| names.iter().position(|one| one == name).expect("a word");
    let (gauges, voltages, request) =
        (at(&inputs, "displacement[0]"), at(&outputs, "voltage[0]"), at(&inputs, "request"));
    let is_pose = model.controller.setpoint == specgen::model::SetpointKind::Pose;
    let (mut made, mut alarms) = (0, Vec::new());
    for class in 0..3 {
        supervised.reset();
        let mut draw = RandomSource(ChaCha8Rng::seed_from_u64(1000 * number + class));
        let parameters = simulated::leg(model, &leg_class(class));
        let mut scenario =
            simulated::legs(model, &std::array::from_fn(|_| parameters.clone()), &parameters.noise, class, 60);
        let rig = scenario.rig_mut();
        let (mut input, mut output) = (vec![0; inputs.len()], vec![0; outputs.len()]);
        let mut from: Six = [if is_pose { 0.0 } else { 0.25 * model.actuator.stroke }; 6];
        let (mut to, mut hertz, mut swing) = (from, 1.0, 0.0);
        let mut was = (0, 0);
        for tick in 0..ticks / 3 {
            if tick % 2000 == 0 {
                from = to;
                to = std::array::from_fn(|axis| {
                    if !is_pose {
                        return draw.within(0.1, 0.6) * model.actuator.stroke;
                    }
                    draw.within(-0.2, 0.2) * model.workspace.bounds()[axis] + if axis == 2 { 10e-6 } else { 0.0 }
                });
                hertz = [1.0, 5.0, 20.0, 50.0][draw.below(4) as usize];
                swing = [0.0, 0.0, 1e-7, 1e-6][draw.below(4) as usize];
            }
            // A step at once, a ramp of 0.1 s, or a sine.
            let now = (tick % 2000) as f64 * period;
            let along = if tick / 2000 % 2 == 0 { f64::min(now / 0.1, 1.0) } else { 1.0 };
            let wave = swing * (std::f64::consts::TAU * hertz * now).sin();
            for axis in 0..6 {
                let wave = if is_pose && axis > 2 { 0.0 } else { wave };
                input[axis] = scalar.encode(from[axis] + along * (to[axis] - from[axis]) + wave);
            }
            for (slot, reading) in input[gauges..].iter_mut().zip(rig.read()) {
                *slot = scalar.encode(reading);
            }
            input[request] = match was.0 {
                _ if tick % 4 == 0 => NOTHING,
                0 | 1 => ARM,
                5 => ACKNOWLEDGE,
                RUNNING if tick % 50_000 == 49_999 => HOLD,
                _ => RUN,
            };
            let word = supervised.step(&input, &mut output);
            if word.cause == OSCILLATION && was != (word.phase, word.cause) {
                alarms.push(format!("{spec}, class {class}: tick {tick}: {word}"));
            }
            was = (word.phase, word.cause);
            rig.hold(&std::array::from_fn(|leg| scalar.decode(output[voltages + leg])), period);
        }
        made += ticks / 3;
    }
    (made, alarms)
}

/// Every spec that is compiled: platforms and six legs, three classes of legs each.
#[test]
fn nothing_that_a_sound_machine_does_is_taken_for_an_oscillation() {
    let specs = repository().join("specs");
    let mut names: Vec<String> = ["", "features/"]
        .iter()
        .flat_map(|folder| {
            let files = fs::read_dir(specs.join(folder)).unwrap().map(|file| file.unwrap().file_name());
            let names = files.map(|name| name.into_string().unwrap()).filter(|name| name.ends_with(".toml"));
            names.map(|name| format!("{folder}{name}")).collect::<Vec<_>>()
        })
        .collect();
    names.sort();
    let is_long = specgen_tests::length(false, true);
    if !is_long {
        names.retain(|name| ["reference.toml", "legs.toml"].contains(&name.as_str()));
    }
    let each = 10_500_000 / (names.len() as u64 + 1);
    let ticks = specgen_tests::length(18_000, each);
    let mut all: QuietResult = (0, Vec::new());
    let mut used = 0;
    let damped = [specgen_tests::damped()];
    for (number, (spec, edits)) in
        names.iter().map(|name| (name.as_str(), &[][..])).chain([("reference.toml", &damped[..])]).enumerate()
    {
        let name = format!("oscillation-quiet-{number}");
        let path = specs.join(spec);
        if is_long && edits.is_empty() && specgen::compile::compile(&path).is_err() {
            println!("  {spec} is refused");
            continue;
        }
        let emitted = Emitted::new(&name, spec, edits);
        let is_platform = emitted.compiled.model.task_space.is_some();
        let used_by = if is_platform { platform } else { legs };
        let (made, alarms) = used_by(&emitted, spec, ticks, number as u64);
        println!("  {spec}{}: {made} ticks, {} alarms", if edits.is_empty() { "" } else { ", damped" }, alarms.len());
        (all.0, used) = (all.0 + made, used + 1);
        all.1.extend(alarms);
    }
    println!("{used} specs, {} ticks, {} false alarms", all.0, all.1.len());
    assert!(all.1.is_empty(), "{:#?}", all.1);
    assert!(used >= specgen_tests::length(3, 15) && (!is_long || all.0 >= 10_000_000), "{used} specs, {} ticks", all.0);
}
