//! The simulated machine of a spec behind converters, as a controller in another process moves it: see `specgen_rt::exchange`.
//!
//! It may be wired wrongly: with a list of faults each is there for one time that the amplifiers are on, after the last none.
//!
//! Time is the controller's ticks. What the machine does while no controller speaks is left out; what it does while a
//! controller skips ticks is not.

mod serve;

use host_sim::closed_loop::Rig;
use host_sim::plant::LegPlant;
use host_sim::platform::PlatformRig;
use specgen_rt::exchange::{Actuation, CHANNELS, Sensing};
use specgen_runtime::supervisor::{Finding, with};

use specgen_compiler::ir::{self, Ir};
use specgen_language::model::Model;

pub use serve::{Options, Summary, serve};

/// Ticks that are simulated at once at most: of a controller that was away for longer the rest is left out.
const MOST_TICKS: u64 = 200_000;

/// Each signal where it belongs.
const IDENTITY: [[f64; CHANNELS]; CHANNELS] = {
    let mut rows = [[0.0; CHANNELS]; CHANNELS];
    let mut channel = 0;
    while channel < CHANNELS {
        rows[channel][channel] = 1.0;
        channel += 1;
    }
    rows
};

/// A prepared plant.
pub enum Plant {
    /// Six gauges see a platform.
    Platform(Box<PlatformRig>),
    /// Six legs, each with its own gauge.
    Legs(Box<Rig<LegPlant>>),
}

impl Plant {
    fn hold(&mut self, voltages: &[f64; CHANNELS], interval: f64) {
        match self {
            Self::Platform(rig) => rig.hold(voltages, interval),
            Self::Legs(rig) => rig.hold(voltages, interval),
        }
    }

    /// Gauges in the unit that their converters take, and the wrench, N and N m.
    fn read(&mut self) -> ([f64; CHANNELS], [f64; CHANNELS]) {
        match self {
            Self::Platform(rig) => (rig.read_gauges(), rig.read_wrench()),
            Self::Legs(rig) => (rig.read(), [0.0; CHANNELS]),
        }
    }
}

/// The plant with its converters and its place in time.
pub struct PlantServer {
    plant: Plant,
    gauges: ir::GaugeConverter,
    volts_at_zero: f64,
    volts_per_code: f64,
    codes: [i32; 2],
    /// Voltage of amplifiers that are off, V.
    rest: f64,
    period: f64,
    session: u64,
    tick: u64,
    held: [f64; CHANNELS],
    /// Faults of its wiring still to come, the last one first, and what is wrong now.
    faults: Vec<Finding>,
    wired: Finding,
    enabled: bool,
    /// The last reading, which is not drawn anew.
    last: Option<Sensing>,
    /// Ticks simulated.
    pub ticks: u64,
    /// Controllers that came.
    pub sessions: u64,
}

impl PlantServer {
    /// The plant of a spec, with amplifiers off.
    #[must_use]
    pub fn new(plant: Plant, model: &Model, ir: &Ir) -> Self {
        let [low, high] = model.actuator.voltage;
        let rest = Model::nearest_to_zero(low, high);
        Self {
            plant,
            gauges: ir.gauge_converter.clone(),
            volts_at_zero: ir.actuation.volts_at_zero,
            volts_per_code: ir.actuation.volts_per_code,
            codes: [ir.actuation.code_min, ir.actuation.code_max],
            rest,
            period: model.timing.period,
            session: 0,
            tick: 0,
            held: [rest; CHANNELS],
            faults: Vec::new(),
            wired: Finding::None,
            enabled: false,
            last: None,
            ticks: 0,
            sessions: 0,
        }
    }

    /// The same with these faults of its wiring, one after the other.
    #[must_use]
    pub fn with_faults(mut self, faults: Vec<Finding>) -> Self {
        self.faults = faults;
        self.faults.reverse();
        self
    }

    /// Takes the latest actuation, goes on to what the controller waits for, and reads.
    pub fn answer(&mut self, actuation: &Actuation, wanted: [u64; 2]) -> Sensing {
        let [session, wanted] = wanted;
        if session != self.session {
            (self.session, self.tick) = (session, wanted);
            self.held = [self.rest; CHANNELS];
            self.last = None;
            self.sessions += 1;
        }
        if actuation.session == self.session && actuation.tick >= self.tick {
            self.go_on_to(actuation.tick);
            self.held = self.voltages(actuation);
            self.go_on_to(actuation.tick.saturating_add(1));
        } else if actuation.session == self.session && actuation.tick.saturating_add(1) == self.tick {
            // The same tick once more: amplifiers switched after the codes were given out. It counts from the next tick on.
            self.held = self.voltages(actuation);
        }
        self.go_on_to(wanted);
        match self.last {
            Some(last) if last.tick == self.tick => last,
            _ => {
                let (gauges, wrench) = self.plant.read();
                let gauges = if matches!(self.wired, Finding::Gauge(..)) { self.mixed(&gauges, 0.0) } else { gauges };
                let codes = gauges.map(|value| self.code(value));
                let sensing =
                    Sensing { session: self.session, tick: self.tick, codes, wrench: wrench.map(f64::to_bits) };
                self.last = Some(sensing);
                sensing
            }
        }
    }

    fn go_on_to(&mut self, tick: u64) {
        let count = tick.saturating_sub(self.tick);
        for _ in 0..count.min(MOST_TICKS) {
            self.plant.hold(&self.held, self.period);
            self.ticks += 1;
        }
        self.tick += count;
    }

    /// What amplifiers make of codes. They take no code beyond those whose voltages the spec permits.
    fn voltages(&mut self, actuation: &Actuation) -> [f64; CHANNELS] {
        if actuation.enable && !self.enabled {
            self.wired = self.faults.pop().unwrap_or(Finding::None);
        }
        self.enabled = actuation.enable;
        let [low, high] = self.codes;
        let volts = actuation.codes.map(|code| {
            let volts = self.volts_at_zero + f64::from(code.clamp(low, high)) * self.volts_per_code;
            if actuation.enable { volts } else { self.rest }
        });
        if matches!(self.wired, Finding::Leg(..)) { self.mixed(&volts, self.rest) } else { volts }
    }

    /// Six signals, counted from `zero`, as their wiring makes them.
    fn mixed(&self, signals: &[f64; CHANNELS], zero: f64) -> [f64; CHANNELS] {
        with(&IDENTITY, self.wired).map(|row| {
            zero + row
                .iter()
                .zip(signals)
                .map(|(part, signal)| if *part == 0.0 { 0.0 } else { part * (signal - zero) })
                .sum::<f64>()
        })
    }

    /// Code of a gauge.
    fn code(&self, value: f64) -> i32 {
        let code = libm::round((value - self.gauges.at_zero) / self.gauges.per_code);
        // Saturates; a NaN gives 0, which is an end of the range and a fault there.
        (code as i32).clamp(0, self.gauges.highest)
    }
}
