//! Figures of the machine with its new controller, from records of its closed loop: at rest, a step, a circle, the trajectories of the
//! spec, and |S|. Errors are those of the gauges: set-point less measured pose, tick by tick. Each is shown beside that of the simulated
//! machine with the legs that were identified.

use std::path::Path;
use std::time::Duration;

use specgen_compiler::compile::Compilation;
use specgen_identify::mean;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_runtime::supervisor::{Phase, Request};

use super::machine::{Machine, arm, request, rest};
use super::motions;
use super::plan::MARGIN;
use super::rows::{Rows, rms};
use super::sensitivity::Experiment;
use super::simulated;
use super::state::{Figure, State, record};
use crate::command::{Command, WaitCondition};
use crate::commands::SessionError;

/// Timeout of a move.
const MOVE: Duration = Duration::from_secs(60);
/// Pose after arming, in the user's coordinates, m and rad.
fn home(compiled: &Compilation) -> [f64; 6] {
    compiled.ir.task_space.as_ref().map_or([0.0; 6], |task| task.setpoints.home)
}

/// The waves for |S|, at the modes of the spec; none for six legs.
fn waves<'a>(compiled: &'a Compilation, state: &State) -> Option<Experiment<'a>> {
    let modes = compiled.design.iter().flat_map(|design| &design.modes);
    let modes: Vec<f64> = modes.map(|mode| mode.frequency / core::f64::consts::TAU).collect();
    Experiment::of(compiled, state.mains, &modes)
}

/// Records all motions of a disarmed machine into the folder.
pub(super) fn measure(
    machine: &mut Machine,
    compiled: &Compilation,
    state: &State,
    folder: &Path,
    ui: &Ui,
) -> Result<(), SessionError> {
    arm(machine, ui)?;
    request(machine, Request::Run, Phase::Running, ui)?;
    machine.execute(&Command::Wait { until: WaitCondition::Arrived, limit: MOVE }, ui)?;
    rest(machine, MARGIN, ui)?;
    motions::all(compiled, &home(compiled)).iter().try_for_each(|motion| motion.record(machine, folder, ui))?;
    waves(compiled, state).map_or(Ok(()), |waves| waves.measure(machine, folder, ui))
}

/// Figures of the records in the folder, beside those of the simulated machine.
///
/// # Errors
/// A record cannot be read, or the simulation fails.
pub(super) fn evaluate(folder: &Path, compiled: &Compilation, state: &mut State, ui: &Ui) -> Result<(), Failure> {
    let motions = motions::all(compiled, &home(compiled));
    let simulated = ui.during("simulating the identified machine", || {
        ui.progress("simulating the same motions with the identified legs");
        simulated::records(compiled, &state.legs, &compiled.ir.integrity.settings, &motions)
    })?;
    state.acceptance = Vec::new();
    for (motion, simulated) in motions.iter().zip(&simulated) {
        let measured = Rows::read(&motion.path(folder))?;
        for part in &motion.figures {
            let [value, computed] = [&measured, simulated].map(|rows| figure(rows, part));
            state.acceptance.push(Figure {
                name: part.name.clone(),
                axis: part.axes.start,
                value: value?,
                computed: Some(computed?),
                limit: part.limit.clone(),
            });
        }
    }
    state.straight = (0..6).map(|leg| straight(folder, leg, state.spec_gain)).collect::<Result<_, _>>()?;
    if let Some(waves) = waves(compiled, state) {
        state.sensitivity = waves.figures(folder)?;
    }
    Ok(())
}

/// Error of a straight line of this gain (m/V) on the arbitrary record of a leg, without their means, m rms; none without a record.
fn straight(folder: &Path, leg: usize, gain: f64) -> Result<Option<f64>, Failure> {
    let path = record(folder, &format!("leg{leg}-arbitrary"));
    if !path.exists() {
        return Ok(None);
    }
    let rows = Rows::read(&path)?;
    let (volts, legs) = (rows.column(&format!("volts[{leg}]_mean_V"))?, rows.legs()?);
    let errors: Vec<f64> = legs[leg].iter().zip(volts).map(|(moved, volts)| moved - gain * volts).collect();
    let level = mean(&errors);
    Ok(Some(rms(&errors.iter().map(|error| error - level).collect::<Vec<_>>())))
}

/// Rms of the norm of the errors of the axes of a part, or their largest.
fn figure(rows: &Rows, part: &motions::Part) -> Result<f64, Failure> {
    let errors = rows.errors(part.span)?;
    let errors = &errors[part.axes.clone()];
    Ok(if part.is_peak {
        let all = errors.iter().flatten().map(|error| error.abs());
        all.fold(0.0, |most, error| if error > most { error } else { most })
    } else {
        norm(errors)
    })
}

/// Root mean square of the norm of errors.
fn norm(errors: &[Vec<f64>]) -> f64 {
    let square = errors.iter().map(|one| rms(one) * rms(one)).fold(0.0, |sum, square| sum + square);
    square.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_axes_add_up_as_a_norm() {
        assert!((norm(&[vec![3e-9, -3e-9], vec![0.0, 0.0], vec![4e-9, 4e-9]]) - 5e-9).abs() < 1e-20);
    }
}
