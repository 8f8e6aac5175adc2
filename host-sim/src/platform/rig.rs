//! A plant with gauges, converters and noise, as a controller sees it.
//!
//! ```text
//! PlatformRig   the plant as a controller sees it
//!   └ Bench     rig and controller, tick by tick
//!       └ run   a trajectory on a bench, scored against the true pose
//! ```

mod bench;
mod run;

use super::gauge::{GaugeSignal, ProbeLanes};
use super::geometry::{angles, rotation};
use super::imperfections::Imperfections;
use super::linear::Six;
use super::plant::PlatformPlant;
use super::sensor::ForceSensor;
use super::specimen::Specimen;
use crate::closed_loop::Preparation;
use crate::noise::{Gauge, Gaussian, amplifier};
use crate::plant::NoiseParameters;

pub use bench::{BUSY, Bench, BenchState, Command, NOT_FOLLOWED, Request, Tick};
pub use run::{OnBoard, PlatformRun, PoseSample, Record, RunOptions};

/// Noise streams of the jitter of readings and voltages, after those of gauges, amplifiers and force sensor.
const JITTER_STREAMS: [u64; 2] = [18, 19];

/// Noise around a plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Gauges and amplifiers; the gauge's figures are per reading of each of the six.
    pub channels: NoiseParameters,
    /// Force sensor, N and N m rms.
    pub force: Six,
}

impl Noise {
    /// No noise, no quantisation.
    pub const NONE: Self = Self { channels: NoiseParameters::NONE, force: [0.0; 6] };

    /// That of the parameter files.
    pub fn of(specimen: &Specimen) -> Self {
        Self { channels: specimen.legs[0].noise, force: specimen.nominal.force_noise }
    }
}

/// Fault of a gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GaugeFault {
    /// It repeats its last reading.
    Stuck,
    /// It gives this number, in m or V as the controller expects; any bits.
    Reading(f64),
}

/// A plant with gauges, converters, force sensor and noise.
#[derive(Debug, Clone)]
pub struct PlatformRig {
    plant: PlatformPlant,
    height: f64,
    /// Voltage from which the drive of the legs counts, V.
    lowest_voltage: f64,
    /// Voltage at which the legs rest, V.
    rest_voltage: f64,
    probes: ProbeLanes,
    /// Distance of each probe from its plane at rest, m.
    rest_distances: Six,
    gauges: [Gauge; 6],
    range: [f64; 2],
    signal: GaugeSignal,
    faults: [Option<GaugeFault>; 6],
    last_readings: Six,
    force_sensor: ForceSensor,
    amplifiers: [Gaussian; 6],
    /// Mains, drift and jitter of the gauges; none for a platform without imperfections.
    imperfections: Option<Imperfections>,
    /// Of readings and voltages.
    jitter: [Gaussian; 2],
    /// Voltages of the last interval, V.
    held: Option<Six>,
    /// Since the preparation, s.
    time: f64,
}

impl PlatformRig {
    /// A plant as built, with noise from one seed. Gauges give metres.
    pub fn new(specimen: &Specimen, noise: &Noise, seed: u64) -> Self {
        let nominal = &specimen.nominal;
        Self {
            plant: PlatformPlant::new(specimen),
            height: nominal.height_m,
            lowest_voltage: nominal.lowest_voltage_v,
            rest_voltage: nominal.rest_voltage_v,
            probes: ProbeLanes::of(&nominal.probes),
            rest_distances: nominal.probes.map(|probe| probe.distance(nominal.height_m, &[0.0; 6])),
            gauges: std::array::from_fn(|k| Gauge::new(&noise.channels, seed, k as u64)),
            range: nominal.gauge_range_m,
            signal: GaugeSignal::Metres,
            faults: [None; 6],
            last_readings: [0.0; 6],
            force_sensor: ForceSensor::new(&noise.force, &nominal.force_range, seed),
            amplifiers: std::array::from_fn(|k| amplifier(&noise.channels, seed, k as u64)),
            imperfections: Some(&nominal.imperfections).filter(|all| !all.is_none()).cloned(),
            jitter: JITTER_STREAMS.map(|stream| Gaussian::new(nominal.imperfections.timing_jitter_s, seed, stream)),
            held: None,
            time: 0.0,
        }
    }

    /// Sets the gauges' signal: volts, or metres.
    #[must_use]
    pub fn with_signal(mut self, signal: GaugeSignal) -> Self {
        self.signal = signal;
        self
    }

    /// Pre-cycle, rest and zero of the gauges, see [`PlatformPlant::prepare`].
    pub fn prepare(&mut self, preparation: &Preparation) {
        self.plant.prepare(preparation);
        (self.time, self.held) = (0.0, None);
    }

    /// Draws the noise of the next `ticks` ticks now, so that later clones share it. The bits of a run do not change.
    pub fn draw_ahead(&mut self, ticks: usize) {
        self.gauges.iter_mut().for_each(|gauge| gauge.draw_ahead(ticks));
        self.amplifiers.iter_mut().for_each(|noise| noise.draw_ahead(ticks));
        self.force_sensor.draw_ahead(ticks);
        self.jitter.iter_mut().for_each(|jitter| jitter.draw_ahead(ticks));
    }

    /// Period of the mains in the gauges, s; none without mains.
    pub fn mains_period(&self) -> Option<f64> {
        let mains = self.imperfections.as_ref()?.mains.iter().find(|one| one.amplitude_m > 0.0)?;
        (mains.frequency_hz > 0.0).then(|| 1.0 / mains.frequency_hz)
    }

    /// The plant.
    pub fn plant(&self) -> &PlatformPlant {
        &self.plant
    }

    /// The plant, to touch work parts or to change its step.
    pub fn plant_mut(&mut self) -> &mut PlatformPlant {
        &mut self.plant
    }

    /// Makes gauge `index` faulty, or repairs it.
    pub fn set_fault(&mut self, index: usize, fault: Option<GaugeFault>) {
        if let Some(slot) = self.faults.get_mut(index) {
            *slot = fault;
        }
    }

    /// Reads the six gauges, in m or V.
    pub fn read_gauges(&mut self) -> Six {
        let [mut pose, rate] = self.plant.seen_motion();
        let mut offsets = None;
        if let Some(imperfections) = &self.imperfections {
            // Early or late by some µs: to first order in it.
            let late = self.jitter[0].draw();
            pose.iter_mut().zip(rate).for_each(|(pose, rate)| *pose += late * rate);
            let mut added = imperfections.offsets(self.time + late);
            if let Some([values, rates]) = self.plant.added() {
                (0..6).for_each(|k| added[k] += values[k] + late * rates[k]);
            }
            offsets = Some(added);
        }
        let distances = self.probes.distances(self.height, &pose, &rotation(angles(&pose)));
        let [low, high] = self.range;
        for k in 0..6 {
            // Drawn in any case, so that a fault does not shift the noise of a run.
            let mut moved = distances[k] - self.rest_distances[k];
            if let Some(offsets) = &offsets {
                moved += offsets[k];
            }
            let reading = self.gauges[k].read(moved);
            let held = reading.clamp(low, high);
            match self.faults[k] {
                None => self.last_readings[k] = self.signal.of(k, held),
                Some(GaugeFault::Stuck) => {}
                Some(GaugeFault::Reading(number)) => self.last_readings[k] = number,
            }
        }
        self.last_readings
    }

    /// Reads the force sensor: force and torque on the platform, N and N m.
    pub fn read_wrench(&mut self) -> Six {
        let wrench = self.plant.wrench();
        self.force_sensor.read(&wrench)
    }

    /// Holds six voltages (V) for `interval` (s), each with the noise of its amplifier.
    pub fn hold(&mut self, voltages: &Six, interval: f64) {
        let mut inputs = *voltages;
        if self.imperfections.as_ref().is_some_and(|all| all.timing_jitter_s > 0.0) {
            // Early or late by some µs: to first order, below the slew limit, the volt-seconds that this adds, spread
            // over the interval.
            let share = self.jitter[1].draw() / interval;
            let before = self.held.replace(*voltages).unwrap_or(*voltages);
            (0..6).for_each(|k| inputs[k] += share * (before[k] - voltages[k]));
        }
        for (input, noise) in inputs.iter_mut().zip(&mut self.amplifiers) {
            *input += noise.draw() - self.lowest_voltage;
        }
        self.plant.hold(&inputs, interval);
        self.time += interval;
    }
}
