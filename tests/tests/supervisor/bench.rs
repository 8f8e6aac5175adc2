//! A supervised controller on a plant that does what the model says, and what may be wrong with it.

use host_sim::controller::{Controller, MachineWord, Supervised, TickController};
use host_sim::word::Scalar;
use specgen_tests::Emitted;
use std::collections::BTreeMap;

pub use super::oracle::{
    ACKNOWLEDGE, AMPLIFIER, AMPLIFIER_FAULT, ARM, ARMING, DISARMED, DRIVE, DRIVING, FAULTED, HOLD, HOLDING, NOTHING,
    RAMP_DOWN, RAMPING, RUN, RUNNING, STALLED, WORKSPACE,
};

/// The cause of a *run* that is refused.
pub const NOT_IDENTIFIED: u8 = 19;

/// A converter whose codes meet every threshold of the grid: 2.5 mV a code, 1250 codes a cell.
pub const ALIGNED: (&str, &str) = ("[\"0 V\", \"150 V\"]", "[\"0 V\", \"163.8375 V\"]");

/// Short times, so that a sequence gets somewhere; `timing.period` of the two kinds.
pub const SECTION: &str = "[supervisor]
arm_time          = \"2 ms\"
ramp_rate         = \"10 V/ms\"
gauge_time        = \"1 ms\"
stuck_time        = \"3.6 ms\"
disagreement      = \"20 um\"
disagreement_time = \"3.6 ms\"
leap              = \"10 mm\"
tracking_error    = 0.1
tracking_time     = \"3.6 ms\"
voltage_time      = \"2 ms\"
slew_time         = \"1 ms\"
missed_ticks      = 2
disturbance       = \"10 mm\"
host_lost         = [\"0.4 ms\", \"1.4 ms\"]
wiring_check      = { off = \"sequences of 24 ticks\" }

[timing]
";

/// A spec of `specs/` with that section and further edits.
pub fn emitted(name: &str, spec: &str, more: &[(&str, &str)]) -> Emitted {
    let mut edits = vec![("[timing]\n", SECTION)];
    edits.extend(more);
    Emitted::new(name, spec, &edits)
}

/// Which of the two kinds of controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Legs,
    Platform,
}

impl Kind {
    pub fn spec(self) -> &'static str {
        match self {
            Self::Legs => "legs.toml",
            Self::Platform => "reference.toml",
        }
    }
}

/// Where words of a row of output are.
#[derive(Clone, Copy)]
struct Places {
    requested: usize,
    voltage: usize,
    code: usize,
    status: usize,
    /// Of a platform.
    load: Option<usize>,
    target: Option<usize>,
}

/// One controller and its plant.
pub struct Bench {
    pub kind: Kind,
    pub machine: Supervised,
    pub scalar: Scalar,
    /// Input and output row of the last tick.
    pub input: Vec<u64>,
    pub output: Vec<u64>,
    /// What the supervisor said.
    pub word: MachineWord,
    pub tick: u64,
    /// Set-point: pose or leg displacements.
    pub setpoint: [f64; 6],
    /// Added to the readings, m.
    pub offset: [f64; 6],
    /// Readings that stay as they are.
    pub frozen: [bool; 6],
    pub readings_per_leg: Option<[[f64; 6]; 6]>,
    limits: [f64; 2],
    max_step: i64,
    inputs: BTreeMap<String, usize>,
    outputs: BTreeMap<String, usize>,
    /// First words of the gauges and of what every tick looks at.
    gauges: usize,
    at: Places,
    /// Code at rest.
    pub rest: i64,
    config: Vec<u64>,
}

impl Bench {
    pub fn new(kind: Kind, emitted: &Emitted, settings: &[(&str, f64)]) -> Self {
        Self::with(emitted.at_run_time(), kind, emitted, settings)
    }

    /// With a controller of that spec.
    pub fn with(controller: Controller, kind: Kind, emitted: &Emitted, settings: &[(&str, f64)]) -> Self {
        let description = controller.description().clone();
        let mut config = controller.default_config();
        for (name, value) in settings {
            description.set_config(&mut config, name, *value).expect("a setting");
        }
        let mut machine = Supervised::new(controller);
        machine.configure(&config).expect("permitted settings");
        let ir = &emitted.compiled.ir;
        let rest = i64::from(ir.supervision.rest);
        let mut output = vec![0; machine.output_names().len()];
        let places = |names: Vec<String>| (0..).zip(names).map(|(place, name)| (name, place)).collect();
        let (inputs, outputs): (_, BTreeMap<String, usize>) =
            (places(machine.input_names()), places(machine.output_names()));
        output[outputs["dac_code[0]"]..][..6].fill(rest as u64);
        let at = Places {
            requested: outputs["requested[0]"],
            voltage: outputs["voltage[0]"],
            code: outputs["dac_code[0]"],
            status: outputs["status"],
            load: outputs.get("load[0]").copied(),
            target: (kind == Kind::Platform).then(|| outputs["target[0]"]),
        };
        let gauges = match kind {
            Kind::Legs => inputs["displacement[0]"],
            Kind::Platform => inputs["gauge[0]"],
        };
        Self {
            kind,
            scalar: description.scalar,
            input: vec![0; machine.input_names().len()],
            output,
            rest,
            machine,
            word: MachineWord::of(0),
            tick: 0,
            setpoint: match kind {
                Kind::Legs => [15e-6; 6],
                Kind::Platform => [0.0; 6],
            },
            offset: [0.0; 6],
            frozen: [false; 6],
            readings_per_leg: ir.supervision.readings_per_leg,
            limits: emitted.compiled.model.actuator.voltage,
            max_step: i64::from(ir.defaults.max_step),
            config,
            inputs,
            outputs,
            gauges,
            at,
        }
    }

    /// Another that goes on from where this one is.
    pub fn fork(&self) -> Self {
        Self {
            machine: self.machine.fork(),
            input: self.input.clone(),
            output: self.output.clone(),
            config: self.config.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            ..*self
        }
    }

    pub fn config(&self) -> &[u64] {
        &self.config
    }

    pub fn input_at(&self, name: &str) -> usize {
        self.inputs[name]
    }

    pub fn at(&self, name: &str) -> usize {
        self.outputs[name]
    }

    pub fn six(&self, name: &str) -> [f64; 6] {
        self.six_of(&self.output, name)
    }

    /// Six numbers of a row of output.
    pub fn six_of(&self, row: &[u64], name: &str) -> [f64; 6] {
        self.six_from(row, self.at(&format!("{name}[0]")))
    }

    fn six_from(&self, row: &[u64], first: usize) -> [f64; 6] {
        std::array::from_fn(|leg| self.scalar.decode(row[first + leg]))
    }

    fn target(&self) -> Option<[f64; 6]> {
        self.at.target.map(|first| self.six_from(&self.output, first))
    }

    pub fn codes(&self) -> [i64; 6] {
        self.codes_of(&self.output)
    }

    /// Codes of a row of output.
    pub fn codes_of(&self, row: &[u64]) -> [i64; 6] {
        std::array::from_fn(|leg| row[self.at.code + leg] as i64)
    }

    /// First word of the gauges.
    pub fn gauges(&self) -> usize {
        self.gauges
    }

    /// What the gauges read of the codes last sent, by the model, with a nanometre that changes from tick to tick.
    pub fn readings(&self) -> [f64; 6] {
        let requested = self.six_from(&self.output, self.at.requested);
        let plain = match &self.readings_per_leg {
            None => requested,
            Some(rows) => {
                let load = self.at.load.filter(|_| self.tick > 0);
                let load = load.map_or([0.0; 6], |first| self.six_from(&self.output, first));
                rows.map(|row| row.iter().zip(&requested).zip(&load).map(|((g, q), p)| g * (q - p)).sum())
            }
        };
        let noise = |gauge: u64| ((self.tick * 37 + gauge * 11) % 23) as f64 * 1e-10;
        std::array::from_fn(|gauge| plain[gauge] + self.offset[gauge] + noise(gauge as u64))
    }

    /// The next row of input, before anybody spoils it.
    pub fn prepare(&mut self, request: u64, events: u64) {
        let readings = self.readings();
        let gauges = self.gauges();
        for (gauge, reading) in readings.iter().enumerate() {
            if !self.frozen[gauge] {
                self.input[gauges + gauge] = self.scalar.encode(*reading);
            }
        }
        let first = self.input_at("setpoint[0]");
        for (axis, value) in self.setpoint.iter().enumerate() {
            self.input[first + axis] = self.scalar.encode(*value);
        }
        if self.kind == Kind::Platform {
            let command = self.input_at("command");
            self.input[command] = 2;
        }
        let more = self.input.len() - 2;
        self.input[more] = request;
        self.input[more + 1] = events;
    }

    /// Commands these voltages in place of the set-point.
    pub fn drive(&mut self, voltages: [f64; 6]) {
        let [command, first] = ["command", "setpoint[0]"].map(|name| self.input_at(name));
        self.input[command] = 4;
        for (leg, voltage) in voltages.into_iter().enumerate() {
            self.input[first + leg] = self.scalar.encode(voltage);
        }
    }

    /// Steps the row as it stands and checks what must always hold.
    pub fn step(&mut self) -> MachineWord {
        let before = self.codes();
        let target_before = self.target();
        self.word = self.machine.step(&self.input, &mut self.output);
        self.tick += 1;
        for (place, word) in self.output.iter().enumerate().take(self.at.status) {
            if !(self.at.code..self.at.code + 6).contains(&place) {
                let value = self.scalar.decode(*word);
                assert!(value.is_finite(), "tick {}: output word {place} is {value}", self.tick);
            }
        }
        for (leg, (voltage, (code, before))) in
            self.six_from(&self.output, self.at.voltage).iter().zip(self.codes().iter().zip(&before)).enumerate()
        {
            let [low, high] = self.limits;
            assert!((low..=high).contains(voltage), "tick {}: {voltage} V on leg {leg}", self.tick);
            let step = (code - before).abs();
            assert!(step <= self.max_step, "tick {}: leg {leg} moves by {step} codes", self.tick);
        }
        assert!(self.word.phase <= DRIVING && self.word.cause <= NOT_IDENTIFIED, "tick {}: {:?}", self.tick, self.word);
        let powered = !matches!(self.word.phase, DISARMED | FAULTED);
        assert_eq!(self.word.amplifier_on, powered, "tick {}: amplifiers", self.tick);
        // A platform in motion is first brought to rest.
        let stands = target_before == self.target();
        if self.word.phase == ARMING || self.word.phase == HOLDING && stands {
            assert_eq!(self.codes(), before, "tick {}: codes are held", self.tick);
        }
        self.word
    }

    /// One tick without anything wrong but what is set.
    pub fn tick(&mut self, request: u64, events: u64) -> MachineWord {
        self.prepare(request, events);
        self.step()
    }

    /// Ticks until the phase; panics if that takes too long.
    pub fn until(&mut self, phase: u8, request: u64) {
        for _ in 0..2000 {
            if self.tick(request, 0).phase == phase {
                return;
            }
        }
        panic!(
            "phase {phase} is not reached by request {request}: {:?}, conditions {:x}",
            self.word,
            self.conditions()
        );
    }

    pub fn conditions(&self) -> u64 {
        self.output[self.output.len() - 1]
    }

    /// Into a phase by requests alone, from disarmed. Running goes on until it is under way.
    pub fn bring_to(&mut self, phase: u8) {
        self.tick(NOTHING, 0);
        if phase == DISARMED {
            return;
        }
        self.until(ARMING, ARM);
        if phase == ARMING {
            return;
        }
        self.until(HOLDING, ARM);
        self.until(RUNNING, RUN);
        for _ in 0..2000 {
            self.tick(RUN, 0);
        }
        match phase {
            HOLDING => self.until(HOLDING, HOLD),
            RAMPING => self.until(RAMPING, RAMP_DOWN),
            FAULTED => {
                self.tick(RUN, 16);
                for _ in 0..200 {
                    self.tick(NOTHING, 0);
                }
            }
            _ => {}
        }
        assert_eq!(self.word.phase, phase);
    }
}
