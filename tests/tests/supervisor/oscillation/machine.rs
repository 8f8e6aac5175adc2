//! A supervised platform controller on the simulated machine, with what the spec does not know of: a structural mode, vibration.

use host_sim::controller::{MachineWord, Supervised, TickController};
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformRig;
use host_sim::word::Scalar;
use specgen::compile::Compilation;
use specgen_tests::{Emitted, Row, scenario};

use super::super::bench::{ARM, FAULTED, HOLDING, NOTHING, RUN, RUNNING};

pub type Six = [f64; 6];

/// Integration step of the structure, s.
const STEP: f64 = 1e-6;
/// Longest time that a voltage stands still behind a leg's structure, s.
const HELD: f64 = 2e-5;
/// Bit of the status: bias or motion under way.
pub const BUSY: u64 = 1 << 18;

/// A structural mode that the spec does not have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Structure {
    /// In series with every leg: H = 1/(1 − r² + 2jζr).
    Leg { hertz: f64, damping: f64 },
    /// Under every gauge: 1 + a r² H.
    Mount { hertz: f64, damping: f64, participation: f64 },
}

impl Structure {
    fn resonance(&self) -> (f64, f64) {
        match *self {
            Self::Leg { hertz, damping } | Self::Mount { hertz, damping, .. } => {
                (hertz * std::f64::consts::TAU, damping)
            }
        }
    }
}

/// Six oscillators: place and rate of each.
#[derive(Debug, Clone, Copy)]
struct Modes([[f64; 2]; 6]);

impl Modes {
    /// One step towards `driven`, which moves at `rate`; mount: damping is against the base's motion.
    fn step(&mut self, (omega, zeta): (f64, f64), driven: &Six, rate: &Six) {
        for ((place, driven), rate) in self.0.iter_mut().zip(driven).zip(rate) {
            place[1] += STEP * (omega * omega * (driven - place[0]) + 2.0 * zeta * omega * (rate - place[1]));
            place[0] += STEP * place[1];
        }
    }
}

pub struct Machine {
    pub supervised: Supervised,
    pub rig: PlatformRig,
    pub structure: Option<Structure>,
    /// Added to the pose that the gauges see, of each axis, m and rad, by time in s.
    pub vibration: Option<Box<dyn Fn(f64) -> Six>>,
    /// Added to what the gauges show in the next tick, m.
    pub wrong: Option<Six>,
    /// What the gauges show per what they would show as the spec says.
    pub shows: Option<[Six; 6]>,
    /// Rows of the last tick.
    pub input: Vec<u64>,
    pub output: Vec<u64>,
    pub word: MachineWord,
    pub ticks: u64,
    rows: Option<Vec<Row>>,
    scalar: Scalar,
    period: f64,
    legs: Modes,
    mounts: Modes,
    shown: Option<Six>,
    readings_per_pose: [Six; 6],
    places: Places,
}

struct Places {
    gauge: usize,
    setpoint: usize,
    rate: usize,
    acceleration: usize,
    voltage: usize,
    pose: usize,
    target: usize,
    status: usize,
    code: usize,
}

impl Machine {
    pub fn new(emitted: &Emitted, leg: &LegParameters, seed: u64) -> Self {
        Self::with(Supervised::new(emitted.at_run_time()), &emitted.compiled, leg, seed)
    }

    pub fn with(supervised: Supervised, compiled: &Compilation, leg: &LegParameters, seed: u64) -> Self {
        let model = &compiled.model;
        let (inputs, outputs) = (supervised.input_names(), supervised.output_names());
        let at = |names: &[String], name: &str| names.iter().position(|one| one == name).expect("a word");
        let places = Places {
            gauge: at(&inputs, "gauge[0]"),
            setpoint: at(&inputs, "setpoint[0]"),
            rate: at(&inputs, "setpoint_rate[0]"),
            acceleration: at(&inputs, "setpoint_acceleration[0]"),
            voltage: at(&outputs, "voltage[0]"),
            pose: at(&outputs, "pose[0]"),
            target: at(&outputs, "target[0]"),
            status: at(&outputs, "status"),
            code: at(&outputs, "dac_code[0]"),
        };
        let rows = compiled.ir.supervision.readings_per_leg.expect("a platform");
        let jacobian = specgen::lower::leg_jacobian(&model.geometry).expect("a platform");
        let readings_per_pose =
            rows.map(|row| std::array::from_fn(|axis| (0..6).map(|leg| row[leg] * jacobian[leg][axis]).sum()));
        let mut machine = Self {
            scalar: supervised.controller().description().scalar,
            rig: scenario(compiled, leg, seed).rig().clone(),
            rows: None,
            structure: None,
            vibration: None,
            wrong: None,
            shows: None,
            input: vec![0; inputs.len()],
            output: vec![0; outputs.len()],
            word: MachineWord::of(0),
            ticks: 0,
            period: model.timing.period,
            legs: Modes([[0.0; 2]; 6]),
            mounts: Modes([[0.0; 2]; 6]),
            shown: None,
            readings_per_pose,
            places,
            supervised,
        };
        machine.supervised.reset();
        machine
    }

    /// Another machine that goes on from where this one was with that rig and controller.
    pub fn like(&self, supervised: &Supervised, rig: &PlatformRig, compiled: &Compilation) -> Self {
        let mut other = Self::with(supervised.fork(), compiled, &LegParameters::reference(), 5);
        other.supervised = supervised.fork();
        other.rig = rig.clone();
        // A structure that is given to it begins at rest where the machine stands.
        (other.legs, other.mounts, other.shown) = (self.legs, self.mounts, self.shown);
        other.structure = self.structure;
        other
    }

    /// Keeps rows of input and output, and digests, from here on.
    pub fn record(&mut self) {
        self.rows = Some(Vec::new());
    }

    /// What was kept.
    pub fn recorded(&mut self) -> Vec<Row> {
        self.rows.take().unwrap_or_default()
    }

    /// One tick with the command as it stands.
    pub fn tick(&mut self, request: u64) -> MachineWord {
        let readings = self.read();
        for (slot, reading) in self.input[self.places.gauge..].iter_mut().zip(readings) {
            *slot = self.scalar.encode(reading);
        }
        let more = self.input.len() - 2;
        self.input[more] = request;
        self.word = self.supervised.step(&self.input, &mut self.output);
        if let Some(rows) = &mut self.rows {
            rows.push((self.input.clone(), self.output.clone(), self.supervised.digest()));
        }
        let held = self.six(self.places.voltage);
        self.hold(&held);
        self.ticks += 1;
        self.word
    }

    fn read(&mut self) -> Six {
        let plain = self.rig.read_gauges();
        let mut seen = plain;
        if let Some(Structure::Mount { participation, .. }) = self.structure {
            let before = self.shown.unwrap_or(plain);
            let steps = (self.period / STEP).round();
            let rate = std::array::from_fn(|k| (plain[k] - before[k]) / self.period);
            for step in 1..=steps as u32 {
                let along = f64::from(step) / steps;
                let driven = std::array::from_fn(|k| before[k] + along * (plain[k] - before[k]));
                self.mounts.step(self.structure.unwrap().resonance(), &driven, &rate);
            }
            seen = std::array::from_fn(|k| plain[k] + participation * (self.mounts.0[k][0] - plain[k]));
        } else {
            self.mounts = Modes(plain.map(|place| [place, 0.0]));
        }
        self.shown = Some(plain);
        if let Some(vibration) = &self.vibration {
            let pose = vibration(self.ticks as f64 * self.period);
            for (seen, row) in seen.iter_mut().zip(&self.readings_per_pose) {
                *seen += row.iter().zip(&pose).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        if let Some(wrong) = self.wrong.take() {
            for (seen, wrong) in seen.iter_mut().zip(wrong) {
                *seen += wrong;
            }
        }
        if let Some(shows) = &self.shows {
            seen = shows.map(|row| row.iter().zip(&seen).map(|(part, one)| part * one).sum());
        }
        seen
    }

    fn hold(&mut self, voltages: &Six) {
        let Some(structure @ Structure::Leg { .. }) = self.structure else {
            self.legs = Modes(voltages.map(|volts| [volts, 0.0]));
            return self.rig.hold(voltages, self.period);
        };
        let pieces = (self.period / HELD).round();
        for _ in 0..pieces as u32 {
            for _ in 0..(self.period / pieces / STEP).round() as u32 {
                self.legs.step(structure.resonance(), voltages, &[0.0; 6]);
            }
            self.rig.hold(&self.legs.0.map(|place| place[0]), self.period / pieces);
        }
    }

    fn six(&self, first: usize) -> Six {
        std::array::from_fn(|k| self.scalar.decode(self.output[first + k]))
    }

    /// Set-point less measured pose, m and rad.
    pub fn error(&self) -> Six {
        let (target, pose) = (self.six(self.places.target), self.six(self.places.pose));
        std::array::from_fn(|k| target[k] - pose[k])
    }

    pub fn is_busy(&self) -> bool {
        self.output[self.places.status] & BUSY != 0
    }

    /// Whether a leg is held back by a limit.
    pub fn is_limited(&self) -> bool {
        self.output[self.places.status] & 0x3f != 0
    }

    pub fn status(&self) -> u64 {
        self.output[self.places.status]
    }

    pub fn codes(&self) -> [i64; 6] {
        std::array::from_fn(|leg| self.output[self.places.code + leg] as i64)
    }

    pub fn conditions(&self) -> u64 {
        self.output[self.output.len() - 1]
    }

    pub fn command(&mut self, command: u64, selector: u64, pose: &Six) {
        self.stream_as(command, selector, pose, &[0.0; 6], &[0.0; 6]);
    }

    /// The next set-point of a stream.
    pub fn stream(&mut self, pose: &Six, rate: &Six, acceleration: &Six) {
        let sequence = self.input[2] + 1;
        self.stream_as(1, 0, pose, rate, acceleration);
        self.input[2] = sequence;
    }

    fn stream_as(&mut self, command: u64, selector: u64, pose: &Six, rate: &Six, acceleration: &Six) {
        (self.input[0], self.input[1]) = (command, selector);
        for k in 0..6 {
            self.input[self.places.setpoint + k] = self.scalar.encode(pose[k]);
            self.input[self.places.rate + k] = self.scalar.encode(rate[k]);
            self.input[self.places.acceleration + k] = self.scalar.encode(acceleration[k]);
        }
    }

    /// Arms it, lets it run and come to its bias pose, and rest there.
    pub fn start(&mut self) {
        self.tick(NOTHING);
        for _ in 0..40_000 {
            if self.tick(ARM).phase == HOLDING {
                break;
            }
            assert_ne!(self.word.phase, FAULTED, "{}", self.word);
        }
        self.tick(RUN);
        for _ in 0..60_000 {
            self.tick(RUN);
            if !self.is_busy() {
                break;
            }
        }
        assert!(!self.is_busy() && self.word.phase == RUNNING, "{}", self.word);
        self.rest(1.0);
        assert_eq!((self.word.phase, self.word.cause), (RUNNING, 0), "{}", self.word);
    }

    /// Stays where it is, for so many s.
    pub fn rest(&mut self, time: f64) {
        for _ in 0..(time / self.period).round() as u64 {
            self.tick(NOTHING);
        }
    }

    /// Amplitude of the error of the axis that oscillates most over so many s from now: √2 of its rms beside a straight line, as
    /// displacement; angles times `arm` (m).
    pub fn amplitude(&mut self, time: f64, arm: f64) -> f64 {
        let count = (time / self.period).round() as usize;
        let errors: Vec<Six> = (0..count)
            .map(|_| {
                self.tick(NOTHING);
                self.error()
            })
            .collect();
        (0..6).map(|axis| swing(&errors, axis) * if axis < 3 { 1.0 } else { arm }).fold(0.0, f64::max)
    }

    pub fn period(&self) -> f64 {
        self.period
    }
}

/// √2 of the rms of one axis beside its straight line.
pub fn swing(errors: &[Six], axis: usize) -> f64 {
    let count = errors.len() as f64;
    let time = |k: usize| k as f64 - (count - 1.0) / 2.0;
    let mean = errors.iter().map(|error| error[axis]).sum::<f64>() / count;
    let spread: f64 = (0..errors.len()).map(|k| time(k) * time(k)).sum();
    let slope = errors.iter().enumerate().map(|(k, error)| time(k) * error[axis]).sum::<f64>() / spread;
    let left = |(k, error): (usize, &Six)| (error[axis] - mean - slope * time(k)).powi(2);
    (2.0 * errors.iter().enumerate().map(left).sum::<f64>() / count).sqrt()
}
