//! Records reversal curves of a simulated leg outside the controller's model class, or only computes the drive signal
//! for a generator.

use std::fmt::Write as _;
use std::path::Path;

use host_sim::forc::{ReversalExperiment, ReversalRecord, trimmed};
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};
use specgen_compiler::spec_file;
use specgen_language::model::Model;
use specgen_language::outcome::Failure;

use crate::machine;

/// Default number of curves.
const CURVES: u32 = 32;
/// Time for the drive to cross its range, s.
const CROSSING: f64 = 5.0;
/// Largest number of samples of a drive for a generator.
const MOST_SAMPLES: f64 = 1e7;

/// Options of a recording.
pub struct Experiment {
    /// Number of reversal curves and of cells per axis.
    pub grid: Option<u32>,
    /// Slope of the drive, V/s.
    pub rate: Option<f64>,
    /// Seed of the noise.
    pub seed: u64,
    /// No gauge noise.
    pub no_noise: bool,
    /// Properties of a leg that a spec does not specify: shape of the hysteresis, creep.
    pub shape: LegParameters,
}

impl Default for Experiment {
    fn default() -> Self {
        Self { grid: None, rate: None, seed: 1, no_noise: false, shape: LegParameters::reference() }
    }
}

impl Experiment {
    /// Records a leg of a spec, whose own records may be missing, or the reference leg.
    ///
    /// # Errors
    /// The spec is refused.
    pub fn record(&self, spec: Option<&Path>) -> Result<ReversalRecord, Failure> {
        match spec {
            Some(path) => Ok(simulate(&spec_file::model(path)?, self)),
            None => Ok(self.run(&self.shape, CURVES, 0.0)),
        }
    }

    /// Records `leg`; `lowest` is its lowest voltage, V.
    fn run(&self, leg: &LegParameters, curves: u32, lowest: f64) -> ReversalRecord {
        let noise = if self.no_noise { NoiseParameters::NONE } else { leg.noise };
        let reference = ReversalExperiment::reference(self.grid.unwrap_or(curves));
        let rate = self.rate.unwrap_or(leg.u_max / CROSSING);
        let experiment = ReversalExperiment { drive_max: leg.u_max, rate, ..reference };
        let mut record = experiment.run(&mut LegPlant::new(leg), &mut Gauge::new(&noise, self.seed, 0));
        record.rows.iter_mut().for_each(|row| row.drive += lowest);
        record
    }

    /// The drive signal as CSV, for a generator: over `range` (V) if given, else over the range of the spec, else from 0 to 100 V.
    ///
    /// # Errors
    /// The spec is refused, or the drive has too many samples.
    pub fn drive(&self, spec: Option<&Path>, range: Option<[f64; 2]>, sampling: f64) -> Result<String, Failure> {
        let model = spec.map(spec_file::model).transpose()?;
        let of_spec = model.as_ref().map(|model| (model.actuator.voltage, model.hysteresis.grid as u32));
        let (voltage, grid) = of_spec.unwrap_or(([0.0, 100.0], CURVES));
        let [lowest, highest] = range.unwrap_or(voltage);
        let span = highest - lowest;
        let reference = ReversalExperiment::reference(self.grid.unwrap_or(grid));
        let rate = self.rate.unwrap_or(span / CROSSING);
        let experiment = ReversalExperiment { drive_max: span, rate, ..reference }.sampled(sampling);
        let rows = experiment.duration() * sampling;
        if rows > MOST_SAMPLES {
            let most = sampling * MOST_SAMPLES / rows;
            return Err(Failure::Usage(format!(
                "the drive takes {:.0} s, {rows:.1e} samples at {} Hz: use --sampling {:.0} or a higher --rate",
                experiment.duration(),
                sampling,
                most.floor()
            )));
        }
        let drive = experiment.drive(lowest, 1.0);
        let mut text = String::from("time_s,drive_V\n");
        for (k, u) in drive.iter().enumerate() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{},{}", trimmed(k as f64 / sampling, 8), trimmed(*u, 6));
        }
        Ok(text)
    }
}

/// A record of a leg of `model`.
pub fn simulate(model: &Model, experiment: &Experiment) -> ReversalRecord {
    let leg = machine::leg(model, &experiment.shape);
    // At most `MAX_GRID`.
    experiment.run(&leg, model.hysteresis.grid as u32, model.actuator.voltage[0])
}
