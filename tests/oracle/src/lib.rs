//! Controllers in plain f64, written independently of the emitted ones: oracles for them and for the plants' figures.
//! Only for tests: slow, with unbounded memory. This file has the leg controller, `platform` that of poses.
//!
//! Inputs that exercise a controller's bits in `stimulus`, and their replay; machines in `random`.
//!
//! Hysteresis by `preisach`; run-to-run adaptation (AII.3), (AII.5), (AII.6) in the filter form.

use host_sim::closed_loop::LEGS;
use host_sim::controller::{ControllerError, TickController};
use host_sim::description::{Description, indexed};
use host_sim::word::Scalar;

pub mod design;
mod linear;
mod notch;
pub mod platform;
mod preisach;
pub mod random;
pub mod replay;
pub mod stimulus;

pub use design::Rule;
pub use platform::{PlatformOracle, Settings};
use preisach::Memory;
pub use preisach::Table;

#[derive(Debug, Clone)]
struct Leg {
    memory: Memory,
    requested: f64,
    level: f64,
    drift: f64,
}

/// See the module.
pub struct Oracle {
    table: Table,
    drive_max: f64,
    /// DAC step in V; 0 for none.
    lsb: f64,
    mode: u64,
    legs: [Leg; LEGS],
    description: Description,
}

const LEVEL_WEIGHT: f64 = 0.252;
const DRIFT_WEIGHT: f64 = 0.011;

impl Oracle {
    /// Six legs with one table; `drive_max` in V; `lsb` is the DAC's step in V, 0 for a continuous drive.
    pub fn new(table: Table, drive_max: f64, lsb: f64) -> Self {
        let rest = Leg { memory: Memory::new(), requested: 0.0, level: 0.0, drift: 0.0 };
        let legs = std::array::from_fn(|_| rest.clone());
        Self { table, drive_max, lsb, mode: 0, legs, description: description() }
    }
}

/// The part of the emitted controller's interface that this controller supports.
fn description() -> Description {
    Description {
        name: "oracle".to_owned(),
        digest: "0".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scalar: Scalar::F64,
        config_names: ["mode", "level_weight", "drift_weight"].map(str::to_owned).to_vec(),
        input_names: indexed(&["setpoint", "displacement"]),
        output_names: indexed(&["voltage", "requested", "demand", "level", "drift"]),
    }
}

impl TickController for Oracle {
    fn description(&self) -> &Description {
        &self.description
    }

    fn default_config(&self) -> Vec<u64> {
        vec![2, LEVEL_WEIGHT.to_bits(), DRIFT_WEIGHT.to_bits()]
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.mode = words[0];
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self { mode: self.mode, ..Self::new(self.table.clone(), self.drive_max, self.lsb) };
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let q_max = self.table.everett(self.drive_max, 0.0);
        for (index, leg) in self.legs.iter_mut().enumerate() {
            let target = f64::from_bits(input[index]);
            let error = f64::from_bits(input[LEGS + index]) - leg.requested;
            if self.mode == 2 {
                leg.drift = DRIFT_WEIGHT * (error - leg.level) + (1.0 - DRIFT_WEIGHT) * leg.drift;
            }
            if self.mode >= 1 {
                leg.level = LEVEL_WEIGHT * error + (1.0 - LEVEL_WEIGHT) * leg.level;
            }
            let demand = (target - leg.level - leg.drift).clamp(0.0, q_max);
            let mut drive = leg.memory.solve(&self.table, self.drive_max, demand);
            if self.lsb > 0.0 {
                drive = (drive / self.lsb).round() * self.lsb;
            }
            leg.memory.apply(&self.table, drive);
            leg.requested = leg.memory.displacement();
            output[index] = drive.to_bits();
            output[LEGS + index] = leg.requested.to_bits();
            output[2 * LEGS + index] = target.to_bits();
            output[3 * LEGS + index] = leg.level.to_bits();
            output[4 * LEGS + index] = leg.drift.to_bits();
        }
    }

    fn state_digest(&self) -> u64 {
        self.legs
            .iter()
            .fold(0, |digest: u64, leg| digest.rotate_left(7) ^ leg.requested.to_bits() ^ leg.level.to_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_sim::forc::ReversalExperiment;
    use host_sim::noise::Gauge;
    use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};

    fn table() -> Table {
        let experiment = ReversalExperiment { rate: 2000.0, rows_per_interval: 3, ..ReversalExperiment::reference(8) };
        let mut leg = LegPlant::new(&LegParameters::reference());
        let record = experiment.run(&mut leg, &mut Gauge::new(&NoiseParameters::NONE, 0, 0));
        Table::from_record(&record, 8, 100.0)
    }

    #[test]
    fn what_is_requested_is_what_was_demanded_within_the_range() {
        let mut oracle = Oracle::new(table(), 100.0, 0.0);
        let mut output = vec![0; 30];
        for k in 0..500 {
            let demand = 30e-6 + 25e-6 * libm::sin(0.37 * f64::from(k));
            let input: Vec<u64> = [[demand.to_bits(); 6], [0; 6]].concat();
            oracle.step(&input, &mut output);
            assert!((f64::from_bits(output[6]) - demand).abs() < 1e-18);
        }
        oracle.step(&[[1.0_f64.to_bits(); 6], [0; 6]].concat(), &mut output);
        assert!((f64::from_bits(output[0]) - 100.0).abs() < 1e-12);
    }
}
