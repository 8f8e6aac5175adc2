//! An assembled machine and its recorder: the records that `specgen commission` takes of it. Simulation: each leg with its
//! amplifier, mode, hysteresis and creep; joints and gauges by their linear coupling, as measured lengths (I + k⁻¹N)⁻¹.

use crate::identify_support::{generator, uniform};
use host_sim::noise::Gaussian;
use host_sim::plant::{LegParameters, LegPlant};
use nalgebra::Matrix6;
use specgen::identify::assembled::{Bench, Drive, Kind, Plan};
use specgen_tests::leg_class;
use std::fmt::Write as _;
use std::path::Path;

pub const TICK: f64 = 1e-4;
/// Rows after the wave.
const AFTER: usize = 3;
/// Of a gauge: rms of a reading, m; drift, m/s; amplitude of the mains, m.
const NOISE: f64 = 2.2e-9;
const DRIFT: f64 = 1e-9;
const MAINS: f64 = 5e-9;
/// Largest change of a leg's gain and lag, and of a gauge's gain; tilt of a gauge, rad; its distance from the centre, m; stiffness
/// of the joints over that of the legs.
const GAIN: f64 = 0.15;
const LAG: f64 = 0.3;
const GAUGE: f64 = 5e-3;
const TILT: f64 = 1e-3;
const ARM: f64 = 0.08;
const JOINTS: f64 = 0.03;
/// Largest error of a lag that was measured before, by class, s: those of the study.
const LAG_ERROR: [f64; 3] = [2.0e-6, 14.0e-6, 4.8e-6];

/// A machine.
pub struct Machine {
    /// As one of the classes, with the lag of this machine.
    pub leg: LegParameters,
    /// Displacement of each assembled leg, of that of `leg`.
    pub gains: [f64; 6],
    /// Lengths by the gauges for the displacements of `leg`.
    response: Matrix6<f64>,
    /// Lengths for the noise of the gauges.
    of_gauges: Matrix6<f64>,
    /// Ticks between the first row and the start of the wave: rows are not aligned with the wave.
    pub before: usize,
    seed: u64,
}

impl Machine {
    /// Machine `seed`, of the class of that number.
    pub fn random(bench: &Bench, seed: u64) -> Self {
        let mut random = generator(1000 + seed);
        let mut off = |most: f64| most * (2.0 * uniform(&mut random) - 1.0);
        let class = leg_class(seed);
        let leg = LegParameters { tau_amp_s: class.tau_amp_s * (1.0 + off(LAG)), ..class };
        let inverse = Matrix6::from_fn(|leg, axis| bench.jacobian[leg][axis]).try_inverse().unwrap();
        let nominal = Matrix6::from_fn(|gauge, axis| bench.readings[gauge].0[axis]);
        let gauges = Matrix6::from_fn(|gauge, axis| {
            let turned = if axis < 3 { off(TILT) } else { ARM * off(TILT) };
            nominal[(gauge, axis)] + turned
        });
        let gauges = Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|_, _| 1.0 + off(GAUGE))) * gauges;
        let of_gauges = Matrix6::from_fn(|leg, axis| bench.jacobian[leg][axis]) * nominal.try_inverse().unwrap();
        // Joints as springs of each pose coordinate, over the stiffness of a leg.
        let stiffness = inverse.try_inverse().unwrap();
        let springs = (stiffness.transpose() * stiffness).diagonal().map(|own| own * JOINTS * (0.5 + off(0.5)));
        let joints = inverse.transpose() * Matrix6::from_diagonal(&springs) * inverse;
        let coupling = (Matrix6::identity() + joints).try_inverse().unwrap();
        let gains: [f64; 6] = std::array::from_fn(|_| 1.0 + off(GAIN));
        let response = of_gauges * gauges * inverse * coupling * Matrix6::from_diagonal(&gains.into());
        // The stiffness against its own joints belongs to a leg that is assembled.
        let gains = std::array::from_fn(|leg| gains[leg] / (1.0 + joints[(leg, leg)]));
        Self { leg, gains, response, of_gauges, before: 86 + 17 * (seed as usize % 3), seed }
    }

    /// From the voltage of a tick to the displacement at its end, with the error of a measurement, s.
    pub fn delay(&self) -> f64 {
        // The plant holds the voltage of a tick before its end, half a tick early, and its displacement leads by half a step of 50 µs.
        let LegParameters { tau_amp_s, zeta, fn_hz, .. } = self.leg;
        tau_amp_s + 2.0 * zeta / (std::f64::consts::TAU * fn_hz) - 0.75 * TICK
            + LAG_ERROR[self.seed as usize % 3] * if self.seed < 3 { 1.0 } else { -1.0 }
    }

    /// Makes the drives of `plan`, with a record in `folder` of each that has one. Legs that do not move stay where they are: they
    /// add a constant.
    pub fn record(&self, plan: &Plan, folder: &Path) {
        let mut legs: [LegPlant; 6] = std::array::from_fn(|_| LegPlant::new(&self.leg));
        let mut noise = Gaussian::new(1.0, self.seed, 0);
        let mut begun = 0.0;
        for drive in &plan.drives {
            for leg in &drive.legs {
                legs[*leg].hold(drive.voltage(0.0), drive.rest_before);
            }
            let every = drive.average as usize;
            let rows = (self.before + (drive.seconds() / TICK).round() as usize) / every + AFTER;
            let mut text = titles();
            for row in 0..rows {
                let (mut volts, mut moved) = ([0.0; 6], [0.0; 6]);
                for tick in row * every..(row + 1) * every {
                    let now = drive.voltage(tick as f64 + 1.0 - self.before as f64);
                    for leg in &drive.legs {
                        legs[*leg].hold(now, TICK);
                        volts[*leg] += now / every as f64;
                        moved[*leg] += legs[*leg].displacement() / every as f64;
                    }
                }
                let seconds = every as f64 * TICK;
                let seen = self.lengths(&moved, begun + (row as f64 + 0.5) * seconds, seconds, &mut noise);
                let _ = write!(text, "{},{:.9},{every},6", row * every, row as f64 * seconds);
                for (leg, held) in drive.held.iter().enumerate() {
                    let volts = if drive.legs.contains(&leg) { volts[leg] } else { *held };
                    let _ = write!(text, ",{:e}", volts as f32);
                }
                for length in seen {
                    let _ = write!(text, ",{:e}", length as f32);
                }
                text.push('\n');
            }
            begun += drive.rest_before + rows as f64 * every as f64 * TICK;
            if drive.kind != Kind::Preconditioning {
                std::fs::write(folder.join(format!("{}.csv", drive.name)), text).unwrap();
            }
        }
    }

    /// Means over a row of `seconds` about `time`.
    fn lengths(&self, moved: &[f64; 6], time: f64, seconds: f64, noise: &mut Gaussian) -> [f64; 6] {
        let angle = std::f64::consts::PI * 50.0 * seconds;
        let gauge = |number: usize, noise: &mut Gaussian| {
            let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
            let hum = MAINS * angle.sin() / angle * (std::f64::consts::TAU * 50.0 * time + number as f64).sin();
            noise.draw() * NOISE / (seconds / TICK).sqrt() + sign * DRIFT * time + hum
        };
        let errors = nalgebra::Vector6::from_fn(|number, _| gauge(number, noise));
        let lengths = self.response * nalgebra::Vector6::from(*moved) + self.of_gauges * errors;
        lengths.into()
    }

    /// The same leg without amplifier and mode, alone, with perfect gauges: mean voltage and displacement of each row of its first
    /// curves.
    pub fn perfect(&self, plan: &Plan, every: Option<usize>) -> (Drive, [Vec<f64>; 2]) {
        let still = LegParameters { tau_amp_s: 1e-6, fn_hz: 2e5, zeta: 0.7, ..self.leg.clone() };
        let mut plant = LegPlant::new(&still);
        for drive in plan.drives.iter().filter(|drive| drive.legs == plan.drives[6].legs) {
            plant.hold(drive.voltage(0.0), drive.rest_before);
            let every = every.unwrap_or(drive.average as usize);
            let rows = (self.before + (drive.seconds() / TICK).round() as usize) / every + AFTER;
            let mut means = [Vec::new(), Vec::new()];
            for row in 0..rows {
                let mut sums = [0.0; 2];
                for tick in row * every..(row + 1) * every {
                    let now = drive.voltage(tick as f64 + 1.0 - self.before as f64);
                    plant.hold(now, TICK);
                    sums = [sums[0] + now, sums[1] + plant.displacement()];
                }
                means.iter_mut().zip(sums).for_each(|(means, sum)| means.push(sum / every as f64));
            }
            if matches!(drive.kind, Kind::Curves { .. }) {
                return (drive.clone(), means);
            }
        }
        unreachable!("the plan has curves");
    }
}

fn titles() -> String {
    let volts = (0..6).map(|leg| format!(",volts[{leg}]_mean_V"));
    let legs = (0..6).map(|leg| format!(",leg[{leg}]_m"));
    format!("tick,time_s,ticks,phase{}\n", volts.chain(legs).collect::<String>())
}
