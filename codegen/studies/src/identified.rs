//! The simulated machine of a spec whose legs were identified: that of `specgen sim`, with legs that move as their models do.
//!
//! ```text
//! controller ─ u ─► noise, lag of the amplifier ─► model of the leg, (1 + ε) d ─► linear leg of the simulated platform
//! ```
//! A leg is its own model off by ε, the error that its model had on a record that no fit used. ε is positive for even legs and
//! negative for odd ones, so that the errors do not act as one factor. Without ε the inverse model would be exact, and feed-forward
//! better than on any machine.

use host_sim::controller::{ControllerError, TickController};
use host_sim::description::Description;
use host_sim::noise::Gaussian;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::Noise;

use specgen_compiler::compile::Compilation;
use specgen_language::model::{Model, TaskSpace};
use specgen_language::outcome::{Failure, environment};
use specgen_run_time::ModelLegs;

use crate::machine::{scenario, specimen};

const LEGS: usize = 6;
/// Seed of the noise, and its first stream for amplifiers: apart from those of the gauges.
const SEED: u64 = 1;
const STREAM: u64 = 1 << 33;

/// A controller on identified legs: it outputs the voltages for which the linear legs of [`machine`] move as the models do.
pub struct IdentifiedLegs<'a> {
    controller: &'a mut dyn TickController,
    /// As built, and as they are now.
    fresh: ModelLegs,
    legs: ModelLegs,
    outputs: [usize; LEGS],
    noise: [Gaussian; LEGS],
    /// Lowest voltage and the voltage of a cell of the table, V.
    volts: [f64; 2],
    /// Displacement of a linear leg, m/V, and e^(−T_s/τ).
    gain: f64,
    kept: f64,
    errors: [f64; LEGS],
    /// Voltages behind the lag, V, and displacements there, m.
    lagged: [f64; LEGS],
    moved: [f64; LEGS],
    rest: f64,
}

/// The leg of the spec without hysteresis, creep, lag and noise of its amplifier: others add these.
fn linear(model: &Model) -> LegParameters {
    let leg = crate::machine::leg(model, &LegParameters::reference());
    let noise = NoiseParameters { amplifier_mv_rms: 0.0, ..leg.noise };
    LegParameters {
        gain_um_per_v: model.actuator.leg_gain() * 1e6,
        s2: 0.0,
        kappa: 0.0,
        tau_amp_s: 0.0,
        play_thresholds_v: vec![0.0],
        play_weights: vec![1.0],
        creep_weights: vec![0.0; leg.creep_weights.len()],
        noise,
        ..leg
    }
}

/// The platform of a spec on linear legs, prepared.
pub fn machine(model: &Model, task: &TaskSpace) -> PlatformScenario {
    let mut machine = specimen(model, task, &LegParameters::reference(), None);
    machine.legs = core::array::from_fn(|_| linear(model));
    let noise = Noise::of(&machine);
    scenario(model, task, &machine, &noise, SEED)
}

impl<'a> IdentifiedLegs<'a> {
    /// `errors`: |ε| of each leg.
    ///
    /// # Errors
    /// The controller is not of this spec.
    pub fn new(
        controller: &'a mut dyn TickController,
        compiled: &Compilation,
        errors: &[f64; LEGS],
    ) -> Result<Self, Failure> {
        let (model, ir) = (&compiled.model, &compiled.ir);
        let [low, high] = model.actuator.voltage;
        let outputs = controller.description().outputs("voltage").map_err(environment)?;
        let fresh = ModelLegs::of(ir).map_err(environment)?;
        let rest = model.rest_voltage();
        let lag = model.amplifier.lag;
        let mut made = Self {
            controller,
            legs: fresh.clone(),
            fresh,
            outputs,
            noise: core::array::from_fn(|leg| Gaussian::new(model.amplifier.noise, SEED, STREAM + leg as u64)),
            volts: [low, (high - low) / ir.hysteresis.grid as f64],
            gain: model.actuator.leg_gain(),
            kept: if lag > 0.0 { libm::exp(-model.timing.period / lag) } else { 0.0 },
            errors: core::array::from_fn(|leg| if leg % 2 == 0 { errors[leg] } else { -errors[leg] }),
            lagged: [rest; LEGS],
            moved: [0.0; LEGS],
            rest,
        };
        made.begin();
        Ok(made)
    }

    fn begin(&mut self) {
        self.legs = self.fresh.clone();
        self.lagged = [self.rest; LEGS];
        self.moved = self.displacements();
    }

    fn displacements(&self) -> [f64; LEGS] {
        let moved = self.legs.displacements();
        core::array::from_fn(|leg| (1.0 + self.errors[leg]) * moved[leg])
    }
}

impl TickController for IdentifiedLegs<'_> {
    fn description(&self) -> &Description {
        self.controller.description()
    }
    fn default_config(&self) -> Vec<u64> {
        self.controller.default_config()
    }
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.controller.configure(words)
    }
    fn reset(&mut self) {
        self.controller.reset();
        self.begin();
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        self.controller.step(input, output);
        let scalar = self.controller.description().scalar;
        let [low, cell] = self.volts;
        for (leg, place) in self.outputs.into_iter().enumerate() {
            let held = scalar.decode(output[place]) + self.noise[leg].draw();
            self.lagged[leg] = held + self.kept * (self.lagged[leg] - held);
        }
        self.legs.apply(&self.lagged.map(|volts| (volts - low) / cell));
        let after = self.displacements();
        for (leg, place) in self.outputs.into_iter().enumerate() {
            // A voltage is held over the tick: it gives the mean of the displacements at its ends.
            let mean = 0.5 * (self.moved[leg] + after[leg]);
            output[place] = scalar.encode(low + mean / self.gain);
        }
        self.moved = after;
    }
    fn state_digest(&self) -> u64 {
        self.controller.state_digest()
    }
}
