//! The paper's experiments on six simulated legs: Table 2 (tracking) and Table 1 (straight-line relation).

use crate::closed_loop::{LEGS, Preparation, Rig, Run, RunError};
use crate::controller::{ControllerError, TickController};
use crate::plant::{LegParameters, LegPlant, NoiseParameters};
use crate::table::{LinearityTable, TrackingRow, TrackingTable};
use crate::trajectory::PaperLeg;

/// Modes of the controller with the value of its `mode` word, in the order of Table 2.
pub const MODES: [(&str, u32); 3] = [("invhys", 0), ("ewma", 1), ("pcc", 2)];

/// Operating frequencies of Table 2, Hz.
pub const TRACKING_FREQUENCIES: [f64; 3] = [0.1, 1.0, 10.0];

/// Operating frequencies of Table 1, Hz.
pub const LINEARITY_FREQUENCIES: [f64; 6] = [0.1, 1.0, 10.0, 20.0, 40.0, 50.0];

/// Value of the `setpoint_kind` word for leg displacements.
const SETPOINT_LEG: f64 = 1.0;

/// Six legs, prepared once; every run starts from the same state.
#[derive(Debug, Clone)]
pub struct LegScenario {
    prepared: Rig,
    samples_per_period: u32,
}

impl LegScenario {
    /// Six legs, pre-cycled, settled and zeroed by the parameters of the first leg.
    ///
    /// `noise` replaces the noise in the parameters of all legs (`NoiseParameters::NONE` for none);
    /// `samples_per_period` is N_s (≥ 1): the control interval is 1/(N_s f).
    pub fn new(legs: &[LegParameters; LEGS], noise: &NoiseParameters, seed: u64, samples_per_period: u32) -> Self {
        Self::resting(legs, noise, seed, samples_per_period, [0.0; 2])
    }

    /// As [`LegScenario::new`] with another lowest voltage than 0 V, at which the gauges are zeroed and from which the
    /// legs' drive counts, and a rest voltage above it for the legs before a run; V.
    pub fn resting(
        legs: &[LegParameters; LEGS],
        noise: &NoiseParameters,
        seed: u64,
        samples_per_period: u32,
        [lowest, rest]: [f64; 2],
    ) -> Self {
        let mut prepared = Rig::new(legs.each_ref().map(LegPlant::new), noise, seed);
        prepared.set_lowest_voltage(lowest);
        prepared.prepare(&Preparation::of(&legs[0], rest - lowest));
        Self { prepared, samples_per_period: samples_per_period.max(1) }
    }

    /// The prepared rig.
    pub fn rig(&self) -> &Rig {
        &self.prepared
    }

    /// The prepared rig, to change it for all runs.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.prepared
    }

    /// Runs the paper's leg trajectory at `frequency` (Hz) with the controller as configured.
    ///
    /// # Errors
    /// As [`Rig::run`].
    pub fn run(&self, controller: &mut dyn TickController, frequency: f64) -> Result<Run, RunError> {
        let interval = 1.0 / frequency / f64::from(self.samples_per_period);
        self.prepared.clone().run(controller, &PaperLeg { frequency }, interval)
    }

    /// Table 2: `modes` (see [`MODES`]) at every frequency. The controller keeps the last mode; other configuration words
    /// are the spec's.
    ///
    /// # Errors
    /// As [`Rig::run`], and if the controller has no `mode` word.
    pub fn tracking(
        &self,
        controller: &mut dyn TickController,
        modes: &[(&str, u32)],
        frequencies: &[f64],
    ) -> Result<TrackingTable, RunError> {
        let mut table = TrackingTable::default();
        for &(mode, word) in modes {
            select(controller, word)?;
            for &frequency in frequencies {
                let run = self.run(controller, frequency)?;
                table.rows.push(TrackingRow::of(mode, frequency, &run.tracking));
            }
        }
        Ok(table)
    }

    /// Table 1: Y on q̂ = ρ̂ X with the inverse model alone, over the last period of each run.
    ///
    /// # Errors
    /// As [`LegScenario::tracking`].
    pub fn linearity(
        &self,
        controller: &mut dyn TickController,
        frequencies: &[f64],
    ) -> Result<LinearityTable, RunError> {
        let mut table = LinearityTable::default();
        select(controller, MODES[0].1)?;
        for &frequency in frequencies {
            let run = self.run(controller, frequency)?;
            // A controller that requests a constant displacement defines no line and gets no row.
            table.push(frequency, &run.tracking, self.samples_per_period as usize);
        }
        Ok(table)
    }
}

/// The spec's configuration with another mode; for six legs with leg displacements as set-points.
///
/// # Errors
/// If the controller has no such word or refuses the mode.
pub fn select(controller: &mut dyn TickController, mode: u32) -> Result<(), ControllerError> {
    let mut words = controller.default_config();
    let description = controller.description();
    description.set_config(&mut words, "mode", f64::from(mode))?;
    if description.config_names.iter().any(|name| name == "setpoint_kind") {
        description.set_config(&mut words, "setpoint_kind", SETPOINT_LEG)?;
    }
    controller.configure(&words)
}
