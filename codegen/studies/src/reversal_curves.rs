//! Records reversal curves of a simulated leg outside the controller's model class, or only computes the drive signal
//! for a generator.
use std::path::Path;

use host_sim::forc::{RandomDrive, ReversalExperiment, ReversalRecord, trimmed};
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
/// Curves of the fast set, and its rate over that of the slow one: 640 V/s over 100 V.
const FAST_CURVES: u32 = 4;
const FASTER: f64 = 32.0;
/// Rest at the lowest voltage before each record, s.
const REST: f64 = 1.0;
/// Sampling rate of the fast set and of the arbitrary record in simulation, Hz.
const FAST_SAMPLING: f64 = 10_000.0;
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
    /// Also a fast set of curves, and an arbitrary record.
    pub two_rates: bool,
    /// Properties of a leg that a spec does not specify: shape of the hysteresis, creep.
    pub shape: LegParameters,
}

impl Default for Experiment {
    fn default() -> Self {
        Self { grid: None, rate: None, seed: 1, no_noise: false, two_rates: false, shape: LegParameters::reference() }
    }
}

impl Experiment {
    /// Records a leg of a spec, whose own records may be missing, or the reference leg: the curves, and with `two_rates`
    /// the fast set and the arbitrary record of the same leg, one after the other.
    ///
    /// # Errors
    /// The spec is refused.
    pub fn records(&self, spec: Option<&Path>) -> Result<Vec<ReversalRecord>, Failure> {
        match spec {
            Some(path) => Ok(simulate(&spec_file::model(path)?, self)),
            None => Ok(self.run(&self.shape, CURVES, 0.0)),
        }
    }

    /// The slow curves over `span` (V).
    fn slow(&self, curves: u32, span: f64) -> ReversalExperiment {
        let reference = ReversalExperiment::reference(self.grid.unwrap_or(curves));
        ReversalExperiment { drive_max: span, rate: self.rate.unwrap_or(span / CROSSING), ..reference }
    }

    /// Records `leg`; `lowest` is its lowest voltage, V.
    fn run(&self, leg: &LegParameters, curves: u32, lowest: f64) -> Vec<ReversalRecord> {
        let noise = if self.no_noise { NoiseParameters::NONE } else { leg.noise };
        let slow = self.slow(curves, leg.u_max);
        let (mut plant, mut gauge) = (LegPlant::new(leg), Gauge::new(&noise, self.seed, 0));
        let mut records = vec![slow.run(&mut plant, &mut gauge)];
        if self.two_rates {
            plant.hold(0.0, REST);
            records.push(faster(&slow).sampled(FAST_SAMPLING).run(&mut plant, &mut gauge));
            plant.hold(0.0, REST);
            records.push(RandomDrive::over([0.0, leg.u_max], FAST_SAMPLING).run(&mut plant, &mut gauge));
        }
        records.iter_mut().flat_map(|record| &mut record.rows).for_each(|row| row.drive += lowest);
        records
    }

    /// The drive signals as CSV, for a generator: over `range` (V) if given, else over the range of the spec, else from 0
    /// to 100 V. With `two_rates` also the fast set and the arbitrary record.
    ///
    /// # Errors
    /// The spec is refused, or a drive has too many samples.
    pub fn drives(&self, spec: Option<&Path>, range: Option<[f64; 2]>, sampling: f64) -> Result<Vec<String>, Failure> {
        let model = spec.map(spec_file::model).transpose()?;
        let of_spec = model.as_ref().map(|model| (model.actuator.voltage, model.hysteresis.grid as u32));
        let (voltage, grid) = of_spec.unwrap_or(([0.0, 100.0], CURVES));
        let [lowest, highest] = range.unwrap_or(voltage);
        let span = highest - lowest;
        let slow = self.slow(grid, span);
        let experiment = slow.sampled(sampling);
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
        let mut drives = vec![experiment.drive(lowest, REST)];
        if self.two_rates {
            let fast = faster(&slow).sampled(sampling);
            drives.push(fast.drive(lowest, REST));
            let mut random = fast.lead_in(lowest, REST);
            random.extend(RandomDrive::over([lowest, highest], sampling).drive());
            drives.push(random);
        }
        Ok(drives.iter().map(|drive| csv(drive, sampling)).collect())
    }
}

/// The fast set after `slow`.
fn faster(slow: &ReversalExperiment) -> ReversalExperiment {
    ReversalExperiment { intervals: FAST_CURVES, rate: FASTER * slow.rate, ..*slow }
}

/// A drive (V), evenly sampled (Hz).
fn csv(drive: &[f64], sampling: f64) -> String {
    let mut text = String::from("time_s,drive_V\n");
    for (k, u) in drive.iter().enumerate() {
        text += &format!("{},{}\n", trimmed(k as f64 / sampling, 8), trimmed(*u, 6));
    }
    text
}

/// The records of a leg of `model`.
pub fn simulate(model: &Model, experiment: &Experiment) -> Vec<ReversalRecord> {
    let leg = machine::leg(model, &experiment.shape);
    // At most `MAX_GRID`.
    experiment.run(&leg, model.hysteresis.grid as u32, model.actuator.voltage[0])
}
