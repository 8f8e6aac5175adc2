//! Axial stiffness of an actuator from force and displacement at constant drive.
//!
//! Model: displacement = offset + force/k + slow part. The slow part is the linear drift of the record and, if it
//! lowers the residual enough, a first-order creep of the force. k is the stiffness at the rate of the record without
//! its creep. A force is positive if it pushes the displacement up: k is positive then.

use serde::Serialize;

use super::cause::lagging;
use super::estimate::{self, Estimate};
use super::findings::Findings;
use super::least_squares::{Fit, fit, independent_samples, mean_square};
use super::signals::{ColumnSpec, Input, Signals, optional, required};
use super::statistics::extent;
use specgen_language::diagnostic::{Diagnostic, codes};

/// A stiffness and its quality.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxialStiffness {
    /// Samples of the record.
    pub samples: usize,
    /// Stiffness k, N/m: force over displacement without creep.
    pub stiffness: f64,
    /// Standard error of k, N/m, for the number of independent samples that the correlation of the residual leaves.
    pub error: f64,
    /// Stiffness of a straight line through all samples, including creep and drift, N/m.
    pub uncorrected: f64,
    /// Time constant of the creep that was removed, s; none if it did not lower the residual.
    pub creep_time: Option<f64>,
    /// Creep in % of the elastic displacement.
    pub creep_percent: f64,
    /// Drift of the displacement that was removed, m/s.
    pub drift: f64,
    /// Least and largest force of the record, N.
    pub force: [f64; 2],
    /// Displacement less the model, root mean square, m.
    pub residual_rms: f64,
    /// Number of independent samples of the residual.
    pub independent: f64,
    /// Force (N), displacement without offset, drift and creep (m), residual (m) of each sample, for drawing.
    #[serde(skip)]
    pub points: Vec<[f64; 3]>,
    /// Time of each of the `points`, s.
    #[serde(skip)]
    pub time: Vec<f64>,
}

const COLUMNS: [ColumnSpec; 4] =
    [required("time_s"), required("force_N"), required("displacement_um"), optional("drive_V")];
/// Creep time constants tried per decade from ten samples to the record's length.
const PER_DECADE: usize = 6;
/// Halvings of the step in ln τ around the best of them.
const REFINED: usize = 12;
/// Least fraction by which creep must lower the residual's mean square.
const WORTHWHILE: f64 = 0.05;
/// Largest motion of the drive, V: more adds displacement that the force does not cause.
const CONSTANT: f64 = 0.05;
/// Stiffness (N/m) outside these bounds suggests a wrong unit.
const PLAUSIBLE: [f64; 2] = [1e4, 1e10];
/// Uncertainty that causes a warning, %.
const UNCERTAIN: f64 = 10.0;

/// A fit with creep of time constant `tau` (s).
struct Creep {
    tau: f64,
    square: f64,
    found: Fit,
    state: Vec<f64>,
}

/// Measures from the columns `time_s`, `force_N`, `displacement_um` and, if there is one, `drive_V`.
///
/// # Errors
/// E0644 if displacement falls with force, E0645 if the drive moves, E0646 if the force does not move the actuator or the
/// unit is wrong, and those of reading.
pub fn measure(input: Input, shown_as: &str) -> Result<Estimate<AxialStiffness>, Vec<Diagnostic>> {
    estimate::of(input, shown_as, &COLUMNS, measure_checked)
}

fn measure_checked(signals: &Signals, findings: &mut Findings) -> Option<AxialStiffness> {
    let (time, force) = (signals.column(0), signals.column(1));
    if time.len() < 30 {
        let (count, end) = (time.len(), signals.place(time.len() - 1));
        let message = format!("has {count} samples and ends at {end} s; at least 30 are needed");
        return findings.refuse(
            codes::RECORD_TOO_SHORT,
            None,
            message,
            "record at least one rise and fall of the force",
        );
    }
    signals.check_moves(1, 2, ["force_N", "displacement_um"], findings);
    check_drive(signals, findings);
    if findings.any_error() {
        return None;
    }
    let y: Vec<f64> = signals.column(2).iter().map(|y| y * 1e-6).collect();
    let one = vec![1.0; y.len()];
    let middle = 0.5 * (time[0] + time[time.len() - 1]);
    let duration = time[time.len() - 1] - time[0];
    let ramp: Vec<f64> = time.iter().map(|t| (t - middle) / duration).collect();
    let plain = fit(&[&one, force], &y)?;
    let Some(straight) = fit(&[&one, &ramp, force], &y) else {
        let (from, to) = (signals.place(0), signals.place(time.len() - 1));
        let message = format!(
            "from {from} to {to} the force only drifts in one direction: its effect cannot be distinguished from creep"
        );
        return findings.refuse(codes::STIFFNESS_RECORD, None, message, "raise and lower the force at least once");
    };
    let base = mean_square(&straight.residual);
    let mut best: Option<Creep> = None;
    let shortest = 10.0 * duration / (time.len() - 1) as f64;
    let steps = (libm::log10(duration / shortest) * PER_DECADE as f64).ceil().max(1.0) as usize;
    let at = |tau: f64| -> Option<Creep> {
        let state = lagging(time, force, tau);
        let found = fit(&[&one, &ramp, force, &state], &y)?;
        Some(Creep { tau, square: mean_square(&found.residual), found, state })
    };
    let better = |best: &Option<Creep>, tried: &Creep| best.as_ref().is_none_or(|b| tried.square < b.square);
    let ratio = libm::pow(duration / shortest, 1.0 / steps as f64);
    for k in 0..=steps {
        best = at(shortest * libm::pow(ratio, k as f64)).filter(|tried| better(&best, tried)).or(best);
    }
    // Narrows the interval between the neighbours of the best one.
    let mut width = ratio.sqrt();
    for _ in 0..REFINED {
        let Some(middle) = best.as_ref().map(|b| b.tau) else { break };
        for tau in [middle / width, middle * width] {
            best = at(tau).filter(|tried| better(&best, tried)).or(best);
        }
        width = width.sqrt();
    }
    // Creep has the direction of the force; a negative one would be an artefact.
    let best = best
        .filter(|b| b.square < (1.0 - WORTHWHILE) * base && b.found.coefficients[3] * b.found.coefficients[2] > 0.0);
    let (chosen, creep_time, creep_share, state) = match best {
        Some(Creep { tau, mut found, state, .. }) => {
            let share = found.coefficients[3] / found.coefficients[2];
            // The time constant is estimated too: its column increases the error of k.
            let near = lagging(time, force, tau * 1.001);
            let turn: Vec<f64> = near.iter().zip(&state).map(|(a, b)| a - b).collect();
            if let Some(wider) = fit(&[&one, &ramp, force, &state, &turn], &y) {
                found.covariance = wider.covariance;
            }
            (found, Some(tau), share, Some(state))
        }
        None => (straight, None, 0.0, None),
    };
    let compliance = chosen.coefficients[2];
    let independent = independent_samples(&chosen.residual);
    let freedom = (independent - chosen.coefficients.len() as f64).max(1.0);
    let variance = mean_square(&chosen.residual) * y.len() as f64 / freedom;
    // The covariance is for y.len() independent samples; fewer of them increase it in proportion.
    let compliance_error = (variance * chosen.covariance[(2, 2)]).sqrt();
    check_sign(signals, force, compliance, compliance_error, findings)?;
    let stiffness = 1.0 / compliance;
    if !(PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&stiffness) {
        let (low, high) = extent(force);
        let at = force.iter().position(|f| *f == high).unwrap_or(0);
        let message = format!(
            "a stiffness of {stiffness:.3e} N/m is not that of a piezo actuator (force {low} to {high} N, highest at {})",
            signals.place(at)
        );
        let help = "write the force in newtons and the displacement in micrometres; are the columns swapped?";
        findings.add(codes::STIFFNESS_RECORD, None, message, help);
    }
    let error = compliance_error * stiffness * stiffness;
    if error > 0.01 * UNCERTAIN * stiffness {
        let message = format!("the stiffness is uncertain by {:.0} %", 100.0 * error / stiffness);
        findings.add(codes::STIFFNESS_UNCERTAIN, None, message, "use more force, or average several rises and falls");
    }
    let points = (0..y.len())
        .map(|k| {
            let slow = chosen.coefficients[0]
                + chosen.coefficients[1] * ramp[k]
                + state.as_ref().map_or(0.0, |s| chosen.coefficients[3] * s[k]);
            [force[k], y[k] - slow, chosen.residual[k]]
        })
        .collect();
    let (low, high) = extent(force);
    Some(AxialStiffness {
        samples: y.len(),
        stiffness,
        error,
        uncorrected: 1.0 / plain.coefficients[1],
        creep_time,
        creep_percent: 100.0 * creep_share,
        drift: chosen.coefficients[1] / duration,
        force: [low, high],
        residual_rms: mean_square(&chosen.residual).sqrt(),
        independent,
        points,
        time: time.to_vec(),
    })
}

fn check_drive(signals: &Signals, findings: &mut Findings) {
    let Some(drive) = signals.columns[3].as_ref() else { return };
    let start = drive[0];
    if let Some(k) = drive.iter().position(|u| (u - start).abs() > CONSTANT) {
        let message = format!("at {} the drive is {} V, while it began with {start} V", signals.place(k), drive[k]);
        let help = "hold the drive constant while the force changes";
        findings.add(codes::STIFFNESS_DRIVE, Some(signals.lines.at(k)), message, help);
    }
}

fn check_sign(signals: &Signals, force: &[f64], compliance: f64, error: f64, findings: &mut Findings) -> Option<()> {
    let (low, high) = extent(force);
    let at = |value: f64| signals.place(force.iter().position(|f| *f == value).unwrap_or(0));
    if compliance.abs() <= 2.0 * error {
        let message =
            format!("the displacement does not follow the force (lowest at {}, highest at {})", at(low), at(high));
        return findings.refuse(codes::STIFFNESS_RECORD, None, message, "use more force, or a gauge of less noise");
    }
    if compliance < 0.0 {
        let (lowest, highest, stiffness) = (at(low), at(high), 1.0 / compliance);
        let message = format!(
            "the displacement falls when the force rises (force lowest at {lowest}, highest at {highest}): the stiffness would be {stiffness:.3e} N/m"
        );
        let help = "count force positive where it pushes the displacement up: change the sign of one column";
        return findings.refuse(codes::STIFFNESS_SIGN, None, message, help);
    }
    Some(())
}
