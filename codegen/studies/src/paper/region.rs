//! Fig. 29: the largest λ for which the adaptation is stable, by the paper's formulas and by the emitted controller.
//!
//! The controller runs on six legs without dynamics, whose displacement is λ times the request relative to their initial position;
//! each leg has its own λ. A step of 0.2 µm disturbs them. If the loop is stable, the disturbance decays; otherwise
//! it grows until a limit or a gauge range stops it, far from the target.

use host_sim::closed_loop::LEGS;
use host_sim::controller::{ControllerError, TickController};
use host_sim::scenario::{MODES, select};
use serde::Serialize;

use specgen_compiler::stability::{ewma_limit, pcc_limit};

/// Number of runs of a trial, and number of final runs that are checked.
const RUNS: usize = 700;
const LAST: usize = 60;
/// The run of the disturbance. Before it the legs follow the request exactly, since they first slew to their place.
const DISTURBED: usize = 60;
/// Position of the legs, and size of the disturbance, m.
const PLACE: f64 = 20e-6;
const DISTURBANCE: f64 = 0.2e-6;
/// A leg within this distance of its target has settled, m. Converter steps times λ are smaller, and a growth of 1 %
/// per run ends a hundred times larger.
const SETTLED: f64 = 1e-6;
/// Range of λ, and number of times the interval is divided by seven.
const RANGE: [f64; 2] = [0.05, 60.0];
const CUTS: usize = 5;

/// One pair of weights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    /// ω (EWMA) or ω1 (PCC).
    pub level: f64,
    /// ω2; `None` for EWMA.
    pub drift: Option<f64>,
    /// Stability limit of λ in the paper.
    pub printed: f64,
    /// Limit by the corrected formula.
    pub jury: f64,
    /// Largest λ at which the emitted controller settles.
    pub emitted: f64,
}

/// Weights at which the emitted controller is run.
pub const TRIED: [(f64, Option<f64>); 10] = [
    (0.1, None),
    (0.252, None),
    (0.5, None),
    (1.0, None),
    (0.1, Some(0.011)),
    (0.252, Some(0.011)),
    (0.252, Some(0.1)),
    (0.5, Some(0.2)),
    (0.8, Some(0.4)),
    (1.0, Some(0.8)),
];

/// The paper's limit of λ: (AII.18) as printed, (AII.19).
pub fn printed(level: f64, drift: Option<f64>) -> f64 {
    drift.map_or(2.0, |drift| pcc_limit(level, drift))
}

/// The correct limit of λ for a leg without dynamics.
pub fn jury(level: f64, drift: Option<f64>) -> f64 {
    drift.map_or_else(|| ewma_limit(level), |drift| pcc_limit(level, drift))
}

/// The limits at the weights of [`TRIED`], with the emitted controller of six legs with their own gauges, which adapts every
/// `run_interval` ticks.
///
/// # Errors
/// If the controller lacks a word or refuses weights within (0, 1].
pub fn limits(controller: &mut dyn TickController, run_interval: u32) -> Result<Vec<Limit>, ControllerError> {
    TRIED
        .iter()
        .map(|&(level, drift)| {
            let emitted = emitted_limit(controller, level, drift, run_interval)?;
            Ok(Limit { level, drift, printed: printed(level, drift), jury: jury(level, drift), emitted })
        })
        .collect()
}

/// The largest λ at which the loop settles, found by trying six values at a time.
fn emitted_limit(
    controller: &mut dyn TickController,
    level: f64,
    drift: Option<f64>,
    run_interval: u32,
) -> Result<f64, ControllerError> {
    let mode = MODES[if drift.is_some() { 2 } else { 1 }].1;
    select(controller, mode)?;
    let mut words = controller.default_config();
    let description = controller.description();
    description.set_config(&mut words, "mode", f64::from(mode))?;
    description.set_config(&mut words, "setpoint_kind", 1.0)?;
    description.set_config(&mut words, "level_weight", level)?;
    description.set_config(&mut words, "drift_weight", drift.unwrap_or_default())?;
    controller.configure(&words)?;
    let [mut low, mut high] = RANGE;
    for _ in 0..CUTS {
        let part = (high - low) / (LEGS + 1) as f64;
        let ratios: [f64; LEGS] = std::array::from_fn(|leg| low + part * (leg + 1) as f64);
        let settled = settles(controller, &ratios, run_interval as usize)?;
        // The region ends at the first value that does not settle.
        let stable = settled.iter().take_while(|settled| **settled).count();
        (low, high) = (low + part * stable as f64, low + part * (stable + 1) as f64);
    }
    Ok(0.5 * (low + high))
}

/// Whether legs with these λ settle after the disturbance.
fn settles(
    controller: &mut dyn TickController,
    ratios: &[f64; LEGS],
    run_interval: usize,
) -> Result<[bool; LEGS], ControllerError> {
    controller.reset();
    let description = controller.description().clone();
    let (scalar, setpoint, measured) =
        (description.scalar, description.input("setpoint[0]")?, description.input("displacement[0]")?);
    let requested = description.output("requested[0]")?;
    let mut input = vec![0; description.input_names.len()];
    let mut output = vec![0; description.output_names.len()];
    let (mut reading, mut largest) = ([PLACE; LEGS], [0.0_f64; LEGS]);
    // The legs respond immediately, so nothing changes within a run.
    for tick in 0..RUNS * run_interval {
        let run = tick / run_interval;
        for leg in 0..LEGS {
            input[setpoint + leg] = scalar.encode(PLACE);
            input[measured + leg] = scalar.encode(reading[leg]);
        }
        controller.step(&input, &mut output);
        for leg in 0..LEGS {
            let moved = scalar.decode(output[requested + leg]) - PLACE;
            let error = if run < DISTURBED { moved } else { ratios[leg] * moved + DISTURBANCE };
            reading[leg] = PLACE + error;
            if run >= RUNS - LAST && error.abs() > largest[leg] {
                largest[leg] = error.abs();
            }
        }
    }
    Ok(largest.map(|error| error < SETTLED))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_limit_of_ewma_is_correct_only_at_weight_one() {
        assert_eq!(printed(1.0, None), jury(1.0, None));
        assert!((jury(0.252, None) - 7.937).abs() < 1e-3 && printed(0.252, None) == 2.0);
        assert_eq!(printed(0.252, Some(0.011)), jury(0.252, Some(0.011)));
    }
}
