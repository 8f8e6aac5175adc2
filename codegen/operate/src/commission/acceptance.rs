//! Figures of the machine with its new controller, from records of its closed loop: at rest, a step, a circle, and the trajectories
//! of the spec. Errors are those of the gauges: set-point less measured pose, tick by tick.

use std::path::Path;
use std::time::Duration;

use specgen_compiler::compile::Compilation;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_runtime::supervisor::{Phase, Request};

use super::machine::{Machine, arm, request, rest};
use super::plan::MARGIN;
use super::rows::{Rows, rms};
use super::state::{Figure, record};
use crate::command::{Command, WaitCondition};
use crate::commands::SessionError;
use crate::place::AXES;

/// Duration of the record at rest, of a step, and of a circle with its ramps, s.
const HOLD: f64 = 4.0;
const STEP: f64 = 1.5;
const CIRCLE: [f64; 2] = [4.0, 0.5];
/// When a step has settled, s.
const SETTLED: f64 = 0.5;
/// Ticks of a row at rest and in motion, s.
const ROWS: [f64; 2] = [4e-3, 1e-3];
/// Longest record of a trajectory, s.
const LONGEST: f64 = 30.0;
/// Size of step and circle, m, and the part of the workspace that they may take.
const SIZE: f64 = 1e-6;
const SHARE: f64 = 0.1;
/// Frequency of the circle, Hz.
const TURNS: f64 = 2.0;
/// Timeout of a move.
const MOVE: Duration = Duration::from_secs(60);

/// A trajectory of the spec: name, start, duration (s).
fn trajectories(compiled: &Compilation) -> Vec<(&str, [f64; 6], f64)> {
    let known = compiled.ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories);
    let period = compiled.model.timing.period;
    known.map(|one| (one.name.as_str(), one.path.start(), f64::from(one.path.ticks()) * period)).collect()
}

/// Size of step and circle on this platform, m.
fn size(compiled: &Compilation) -> f64 {
    let bounds = compiled.model.workspace.bounds();
    bounds[..3].iter().fold(SIZE, |size, bound| if SHARE * bound < size { SHARE * bound } else { size })
}

/// Name of its record: a trajectory may be called `hold`.
fn of_trajectory(name: &str) -> String {
    format!("trajectory-{name}")
}

/// Records all motions of a disarmed machine into the folder.
pub(super) fn measure(
    machine: &mut Machine,
    compiled: &Compilation,
    folder: &Path,
    ui: &Ui,
) -> Result<(), SessionError> {
    let ticks = |row: f64| libm::ceil(row / compiled.model.timing.period) as u32;
    let path = |name: &str| record(folder, &format!("accept-{name}"));
    let [slow, fast] = ROWS.map(ticks);
    let arrived = Command::Wait { until: WaitCondition::Arrived, limit: MOVE };
    arm(machine, ui)?;
    request(machine, Request::Run, Phase::Running, ui)?;
    machine.execute(&arrived, ui)?;
    rest(machine, 2.0 * MARGIN, ui)?;
    machine.record_rows((slow, u32::MAX), [0.0, HOLD], &path("hold"), &mut |_| Ok(()), ui)?;

    let (home, size) = (machine.place()?.target, size(compiled));
    let mut up = home;
    up[2] += size;
    machine.record_rows((fast, u32::MAX), [MARGIN, STEP], &path("step"), &mut |machine| machine.go(up), ui)?;
    machine.execute(&arrived, ui)?;
    machine.go(home)?;
    machine.execute(&arrived, ui)?;

    let wave = machine.wave_of_text(&circle(&home, size)).map_err(SessionError::Refused)?;
    let mut turn = |machine: &mut Machine| machine.start_wave("circle", &wave, false);
    machine.record_rows((fast, u32::MAX), [MARGIN, CIRCLE[0]], &path("circle"), &mut turn, ui)?;
    rest(machine, MARGIN, ui)?;

    for (name, start, seconds) in trajectories(compiled) {
        machine.go(start)?;
        machine.execute(&arrived, ui)?;
        let play = Command::Play { name: name.to_owned(), correction: None };
        let seconds = if seconds < LONGEST { seconds } else { LONGEST };
        machine.record_rows(
            (fast, u32::MAX),
            [MARGIN, seconds],
            &path(&of_trajectory(name)),
            &mut |machine| machine.execute(&play, ui),
            ui,
        )?;
        machine.execute(&Command::Set(vec![("command".to_owned(), "hold".to_owned())]), ui)?;
        machine.execute(&arrived, ui)?;
    }
    Ok(())
}

/// A circle in x and y, as the file of a wave.
fn circle(center: &[f64; 6], size: f64) -> String {
    let axis = |name: &str, phase: f64| {
        let shape = format!("kind = \"sine\", amplitude = {size:?}, frequency = {TURNS:?}, phase = {phase:?}");
        format!("[[axis]]\naxis = \"{name}\"\nshape = {{ {shape} }}\n")
    };
    let [seconds, ramp] = CIRCLE;
    format!("center = {center:?}\nramp = {ramp:?}\nseconds = {seconds:?}\n{}{}", axis("x", 0.0), axis("y", 0.25))
}

/// Figures of the records in the folder.
///
/// # Errors
/// A record cannot be read.
pub(super) fn figures(folder: &Path, compiled: &Compilation) -> Result<Vec<Figure>, Failure> {
    let read = |name: &str| Rows::read(&record(folder, &format!("accept-{name}")));
    let mut figures = Vec::new();
    let errors = read("hold")?.errors([0.0, HOLD])?;
    for (axis, name) in AXES.iter().enumerate() {
        figures.push(Figure {
            name: format!("hold {name}, rms"),
            axis,
            value: rms(&errors[axis]),
            computed: Some(compiled.rest_noise.pose[axis]),
            limit: compiled.model.requirements.noise_of(axis).map(|(limit, key)| (limit, key.to_owned())),
        });
    }
    let bare = |name: String, value: f64| Figure { name, axis: 0, value, computed: None, limit: None };
    let size = size(compiled) * 1e6;
    let step = read("step")?;
    let moved = step.errors([MARGIN, MARGIN + STEP])?;
    let most = moved[2].iter().fold(0.0, |most: f64, error| if error.abs() > most { error.abs() } else { most });
    figures.push(bare(format!("step of {size:.3} um in z, largest error of z"), most));
    let settled = step.errors([MARGIN + SETTLED, MARGIN + STEP])?;
    figures.push(bare(format!("step of {size:.3} um in z, rms of z after {SETTLED} s"), rms(&settled[2])));
    let [seconds, ramp] = CIRCLE;
    let turns = read("circle")?.errors([MARGIN + ramp, MARGIN + seconds - ramp])?;
    figures.push(bare(format!("circle of {size:.3} um at {TURNS} Hz, rms of x y z"), norm(&turns[..3])));
    for (name, _, seconds) in trajectories(compiled) {
        let errors =
            read(&of_trajectory(name))?.errors([MARGIN, MARGIN + if seconds < LONGEST { seconds } else { LONGEST }])?;
        for (what, axis, key) in [("x y z", 0, "translation"), ("rx ry rz", 3, "rotation")] {
            let limits = compiled.model.requirements.tracking.iter();
            let own = limits.filter(|limit| limit.trajectory.as_deref().is_none_or(|own| own == name));
            let of = own.filter(|limit| limit.frequency.is_none());
            let limit = of.filter_map(|limit| if axis == 0 { limit.translation } else { limit.rotation });
            let least = limit.reduce(|a, b| if b < a { b } else { a });
            figures.push(Figure {
                name: format!("trajectory {name}, rms of {what}"),
                axis,
                value: norm(&errors[axis..axis + 3]),
                computed: None,
                limit: least.map(|limit| (limit, format!("requirements.tracking.{key}"))),
            });
        }
    }
    Ok(figures)
}

/// Root mean square of the norm of three errors.
fn norm(errors: &[Vec<f64>]) -> f64 {
    let square = errors.iter().map(|one| rms(one) * rms(one)).fold(0.0, |sum, square| sum + square);
    square.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wave::read_wave;

    #[test]
    fn the_circle_is_a_wave_of_a_running_machine() {
        let wave = read_wave(&circle(&[1e-6, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-6), 1e-4, false).unwrap();
        assert!(!wave.drives && f64::from_bits(wave.center[0]) == 1e-6);
        assert!((norm(&[vec![3e-9, -3e-9], vec![0.0, 0.0], vec![4e-9, 4e-9]]) - 5e-9).abs() < 1e-20);
    }
}
