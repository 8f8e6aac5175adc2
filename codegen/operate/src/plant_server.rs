//! The simulated machine of a spec with converters, for a controller in another process: see `specgen_rt::exchange`.
//!
//! Its wiring can have faults: those of a list apply in turn, one each time the amplifiers are switched on; after the last there
//! is none.
//!
//! Time advances with the controller's ticks. Time without a controller is not simulated; ticks that a controller skips are.

mod serve;

use host_sim::machine::Machine;
use specgen_rt::exchange::{Actuation, CHANNELS, Sensing};
use specgen_runtime::supervisor::{Finding, with};

use specgen_compiler::ir::{self, Ir};
use specgen_language::model::Model;

pub use serve::{Options, Summary, serve};

/// Largest number of ticks simulated at once; after a longer pause of the controller the rest is omitted.
const MOST_TICKS: u64 = 200_000;

/// Correct wiring.
const IDENTITY: [[f64; CHANNELS]; CHANNELS] = {
    let mut rows = [[0.0; CHANNELS]; CHANNELS];
    let mut channel = 0;
    while channel < CHANNELS {
        rows[channel][channel] = 1.0;
        channel += 1;
    }
    rows
};

/// The plant with its converters and its time.
pub struct PlantServer {
    plant: Machine,
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
    /// Remaining wiring faults, last one first, and the current one.
    faults: Vec<Finding>,
    wired: Finding,
    enabled: bool,
    /// The last reading; its noise is not drawn again.
    last: Option<Sensing>,
    /// Simulated ticks.
    pub ticks: u64,
    /// Number of controllers so far.
    pub sessions: u64,
}

impl PlantServer {
    /// The plant of a spec, with amplifiers off.
    #[must_use]
    pub fn new(plant: Machine, model: &Model, ir: &Ir) -> Self {
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

    /// Adds wiring faults, which apply in turn.
    #[must_use]
    pub fn with_faults(mut self, faults: Vec<Finding>) -> Self {
        self.faults = faults;
        self.faults.reverse();
        self
    }

    /// Applies the latest actuation, simulates up to the tick that the controller waits for, and reads the gauges.
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
            // The same tick again: the amplifiers were switched after the codes were output. It applies from the next tick on.
            self.held = self.voltages(actuation);
        }
        self.go_on_to(wanted);
        match self.last {
            Some(last) if last.tick == self.tick => last,
            _ => {
                let (gauges, wrench) = (self.plant.read_gauges(), self.plant.read_wrench());
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

    /// Voltages of the amplifiers. Codes are limited to those that the spec permits.
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

    /// Six signals, relative to `zero`, after the wiring.
    fn mixed(&self, signals: &[f64; CHANNELS], zero: f64) -> [f64; CHANNELS] {
        with(&IDENTITY, self.wired).map(|row| {
            zero + row
                .iter()
                .zip(signals)
                .map(|(part, signal)| if *part == 0.0 { 0.0 } else { part * (signal - zero) })
                .sum::<f64>()
        })
    }

    /// Converter code of a gauge.
    fn code(&self, value: f64) -> i32 {
        let code = libm::round((value - self.gauges.at_zero) / self.gauges.per_code);
        // Saturates; NaN gives 0, an end of the range, which the controller treats as a fault.
        (code as i32).clamp(0, self.gauges.highest)
    }
}
