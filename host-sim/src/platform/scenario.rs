//! The paper's experiments on a simulated platform: Tables 5 to 8 (free motion) and 9 (machining).

use super::contact::WorkPart;
use super::rig::{Noise, OnBoard, PlatformRig, PlatformRun, RunOptions};
use super::specimen::Specimen;
use super::table::{MachiningTable, PoseRow, PoseTable};
use crate::closed_loop::{Preparation, RunError};
use crate::controller::{ControllerError, TickController};
use crate::trajectory::PoseTrajectory;
use specgen_runtime::ControlMode;

pub use crate::scenario::select;

/// Selects a mode of Tables 5 to 8. The paper compares the laws of P/F at equal gains, so Invhys gets those of the other two.
///
/// # Errors
/// As [`select`], and if the controller has no gains.
pub fn select_at_equal_gains(controller: &mut dyn TickController, mode: u32) -> Result<(), ControllerError> {
    let mut words = controller.default_config();
    let description = controller.description();
    description.set_config(&mut words, "mode", f64::from(mode))?;
    for gain in ["kp", "ki", "kv"] {
        let from = description.config(&format!("{gain}[0]"))?;
        let to = description.config(&format!("position_{gain}[0]"))?;
        words.copy_within(from..from + 6, to);
    }
    controller.configure(&words)
}

/// The modes of Tables 5 to 8.
pub const FREE_MODES: [(&str, u32); 3] = [ControlMode::WORDS[4], ControlMode::WORDS[5], ControlMode::WORDS[6]];

/// The modes of Table 9.
pub const MACHINING_MODES: [(&str, u32); 2] = [ControlMode::WORDS[0], ControlMode::WORDS[6]];

/// One plant, prepared once; every run starts from the same state.
#[derive(Debug, Clone)]
pub struct PlatformScenario {
    prepared: PlatformRig,
    /// Settings of its runs.
    pub options: RunOptions,
}

impl PlatformScenario {
    /// A plant, pre-cycled, settled and zeroed by the parameters of its first leg, with noise from `seed`.
    pub fn new(specimen: &Specimen, noise: &Noise, seed: u64, options: RunOptions) -> Self {
        let mut prepared = PlatformRig::new(specimen, noise, seed);
        let nominal = &specimen.nominal;
        prepared.prepare(&Preparation::of(&specimen.legs[0], nominal.rest_voltage_v - nominal.lowest_voltage_v));
        Self { prepared, options }
    }

    /// The prepared rig.
    pub fn rig(&self) -> &PlatformRig {
        &self.prepared
    }

    /// The prepared rig, to change gauges or steps for all runs.
    pub fn rig_mut(&mut self) -> &mut PlatformRig {
        &mut self.prepared
    }

    /// Runs a trajectory with the controller as configured.
    ///
    /// # Errors
    /// As [`PlatformRig::run`].
    pub fn run(
        &self,
        controller: &mut dyn TickController,
        trajectory: &dyn PoseTrajectory,
    ) -> Result<PlatformRun, RunError> {
        self.prepared.clone().run(controller, trajectory, &self.options)
    }

    /// Lets the controller play one of its stored trajectories, see [`PlatformRig::play`].
    ///
    /// # Errors
    /// As [`PlatformRig::play`].
    pub fn play(
        &self,
        controller: &mut dyn TickController,
        path: &OnBoard,
        limit: Option<f64>,
    ) -> Result<PlatformRun, RunError> {
        self.prepared.clone().play(controller, path, &self.options, limit)
    }

    /// Runs a trajectory against a work part.
    ///
    /// # Errors
    /// As [`PlatformRig::run`].
    pub fn against(
        &self,
        controller: &mut dyn TickController,
        trajectory: &dyn PoseTrajectory,
        part: WorkPart,
    ) -> Result<PlatformRun, RunError> {
        let options = RunOptions { part: Some(part), ..self.options.clone() };
        self.prepared.clone().run(controller, trajectory, &options)
    }

    /// Tables 5 to 8: every mode on a trajectory, under the name and the operating frequency (Hz) that the tables give it: `case-1`
    /// and `case-2` are the paper's. The controller keeps the last mode; other configuration words, except those of
    /// [`select_at_equal_gains`], are the spec's.
    ///
    /// # Errors
    /// As [`PlatformRig::run`], and if the controller has no `mode` word.
    pub fn free_motion(
        &self,
        controller: &mut dyn TickController,
        modes: &[(&str, u32)],
        (name, frequency): (&str, f64),
        trajectory: &dyn PoseTrajectory,
    ) -> Result<PoseTable, RunError> {
        let mut table = PoseTable::default();
        for &(mode, word) in modes {
            select_at_equal_gains(controller, word)?;
            let run = self.run(controller, trajectory)?;
            table.rows.push(PoseRow::of(name, mode, frequency, run.scored()?));
        }
        Ok(table)
    }

    /// Table 9: every mode on every part.
    ///
    /// # Errors
    /// As [`PlatformScenario::free_motion`].
    pub fn machining(
        &self,
        controller: &mut dyn TickController,
        modes: &[(&str, u32)],
        parts: &[(&str, WorkPart)],
        trajectory: &dyn PoseTrajectory,
    ) -> Result<MachiningTable, RunError> {
        let mut table = MachiningTable::default();
        for &(name, part) in parts {
            for &(mode, word) in modes {
                select(controller, word)?;
                let run = self.against(controller, trajectory, part)?;
                table.push(name, mode, run.scored()?);
            }
        }
        Ok(table)
    }
}
