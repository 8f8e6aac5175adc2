//! The motions of the acceptance: at rest, a step, a circle, and the trajectories of the spec.

use std::path::{Path, PathBuf};
use std::time::Duration;

use specgen_compiler::compile::Compilation;
use specgen_language::ui::Ui;

use super::machine::{Machine, rest};
use super::plan::MARGIN;
use super::state::record;
use crate::command::{Command, WaitCondition};
use crate::commands::SessionError;

/// Duration of the record at rest, of a step, and of a circle with its ramps, s.
const HOLD: f64 = 4.0;
const STEP: f64 = 1.5;
const CIRCLE: [f64; 2] = [4.0, 0.5];
/// When a step has settled, s.
const SETTLED: f64 = 0.5;
/// Duration of a row at rest and in motion, s.
const ROWS: [f64; 2] = [4e-3, 1e-3];
/// Longest record of a trajectory, s.
const LONGEST: f64 = 30.0;
/// Size of step and circle, m, and the part of the workspace that a motion may take.
pub(super) const SIZE: f64 = 1e-6;
pub(super) const SHARE: f64 = 0.1;
/// Frequency of the circle, Hz.
const TURNS: f64 = 2.0;

/// Rest after the move to the start of a motion, s, and timeout of that move.
pub(super) const AFTER_MOVE: f64 = 0.5;
const MOVE: Duration = Duration::from_secs(60);
/// A motion begins at most so long after the rest in its record, s: on a busy computer.
pub(super) const LATE: f64 = 1.0;
/// Names of records of trajectories, one of which may be called `hold`, begin with this.
pub(super) const TRAJECTORY: &str = "trajectory-";

/// A motion with its record.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    /// Name of its record, without `accept-`.
    pub name: String,
    /// Pose at its start, in the user's coordinates, m and rad.
    pub start: [f64; 6],
    pub kind: MotionKind,
    /// Rest before it and duration of its record from then on, s.
    pub spans: [f64; 2],
    /// Duration of a row, s.
    pub row: f64,
    pub figures: Vec<Part>,
}

#[derive(Debug, Clone)]
pub(super) enum MotionKind {
    Rest,
    Move([f64; 6]),
    /// The text of its file.
    Wave(String),
    /// The trajectory of the spec with this number.
    Trajectory(u32),
}

/// A figure of a record.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub name: String,
    /// Its axes: the norm of several.
    pub axes: std::ops::Range<usize>,
    /// Span of time in the record, s.
    pub span: [f64; 2],
    /// The largest error in place of the rms.
    pub is_peak: bool,
    /// Limit, m or rad, and its key.
    pub limit: Option<(f64, String)>,
}

impl Motion {
    /// File of its record.
    pub fn path(&self, folder: &Path) -> PathBuf {
        record(folder, &format!("accept-{}", self.name))
    }

    /// Moves a running machine to its start, and records it.
    pub fn record(&self, machine: &mut Machine, folder: &Path, ui: &Ui) -> Result<(), SessionError> {
        let Self { name, start, kind, spans, row, .. } = self;
        let arrived = Command::Wait { until: WaitCondition::Arrived, limit: MOVE };
        machine.go(*start)?;
        machine.execute(&arrived, ui)?;
        rest(machine, AFTER_MOVE, ui)?;
        let wave = match kind {
            MotionKind::Wave(text) => Some(machine.wave_of_text(text).map_err(SessionError::Refused)?),
            _ => None,
        };
        let mut begin = |machine: &mut Machine| match (kind, &wave) {
            (MotionKind::Move(pose), _) => machine.go(*pose),
            (MotionKind::Trajectory(_), _) => {
                let name = name.trim_start_matches(TRAJECTORY).to_owned();
                machine.execute(&Command::Play { name, correction: None }, ui)
            }
            (_, Some(wave)) => machine.start_wave(name, wave, false),
            _ => Ok(()),
        };
        let every = libm::round(row / machine.session.period()) as u32;
        machine.record_rows((every.max(1), u32::MAX), *spans, &self.path(folder), &mut begin, ui)?;
        if wave.is_some() {
            // It began as late as the link was.
            rest(machine, LATE, ui)?;
        }
        if matches!(kind, MotionKind::Trajectory(_)) {
            machine.execute(&Command::Set(vec![("command".to_owned(), "hold".to_owned())]), ui)?;
        }
        machine.execute(&arrived, ui)
    }
}

/// All motions of a spec; `home`: the set-point after arming.
pub(super) fn all(compiled: &Compilation, home: &[f64; 6]) -> Vec<Motion> {
    let mut motions = vec![hold(compiled, home)];
    let size = size(compiled);
    let shown = size * 1e6;
    let mut up = *home;
    up[2] += size;
    let part = |name: String, axes, span| Part { name, axes, span, is_peak: false, limit: None };
    let motion = |name: &str, kind, seconds, figures| Motion {
        name: name.to_owned(),
        start: *home,
        kind,
        spans: [MARGIN, seconds],
        row: ROWS[1],
        figures,
    };
    let step =
        |what: &str, from: f64| part(format!("step of {shown:.2} um, z, {what}"), 2..3, [MARGIN + from, MARGIN + STEP]);
    let peak = Part { is_peak: true, ..step("largest", 0.0) };
    motions.push(motion("step", MotionKind::Move(up), STEP, vec![peak, step("settled", SETTLED)]));
    let [seconds, ramp] = CIRCLE;
    let turns =
        part(format!("circle of {shown:.2} um, {TURNS} Hz, xyz"), 0..3, [MARGIN + ramp, MARGIN + seconds - ramp]);
    motions.push(motion("circle", MotionKind::Wave(circle(home, size)), seconds, vec![turns]));
    motions.extend(trajectories(compiled));
    motions
}

fn hold(compiled: &Compilation, home: &[f64; 6]) -> Motion {
    let figure = |(axis, name): (usize, &&str)| Part {
        name: format!("hold, {name}"),
        axes: axis..axis + 1,
        span: [0.0, HOLD],
        is_peak: false,
        limit: compiled.model.requirements.noise_of(axis).map(|(limit, key)| (limit, key.to_owned())),
    };
    let figures = crate::place::AXES.iter().enumerate().map(figure).collect();
    Motion { name: "hold".to_owned(), start: *home, kind: MotionKind::Rest, spans: [0.0, HOLD], row: ROWS[0], figures }
}

fn trajectories(compiled: &Compilation) -> impl Iterator<Item = Motion> {
    let known = compiled.ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories).enumerate();
    known.map(|(number, one)| {
        let seconds = f64::from(one.path.ticks()) * compiled.model.timing.period;
        let seconds = if seconds < LONGEST { seconds } else { LONGEST };
        let figure = |(what, axes, key): (&str, std::ops::Range<usize>, &str)| {
            let limits = compiled.model.requirements.tracking.iter();
            let own = limits.filter(|limit| limit.trajectory.as_deref().is_none_or(|own| own == one.name));
            let of = own.filter(|limit| limit.frequency.is_none());
            let limit = of.filter_map(|limit| if axes.start == 0 { limit.translation } else { limit.rotation });
            let least = limit.reduce(|a, b| if b < a { b } else { a });
            Part {
                name: format!("{}, {what}", one.name),
                axes,
                span: [MARGIN, MARGIN + seconds],
                is_peak: false,
                limit: least.map(|limit| (limit, format!("requirements.tracking.{key}"))),
            }
        };
        Motion {
            name: format!("{TRAJECTORY}{}", one.name),
            start: one.path.start(),
            kind: MotionKind::Trajectory(number as u32),
            spans: [MARGIN, seconds],
            row: ROWS[1],
            figures: [("xyz", 0..3, "translation"), ("rx ry rz", 3..6, "rotation")].map(figure).into(),
        }
    })
}

/// Size of step and circle on this platform, m.
fn size(compiled: &Compilation) -> f64 {
    let bounds = compiled.model.workspace.bounds();
    bounds[..3].iter().fold(SIZE, |size, bound| if SHARE * bound < size { SHARE * bound } else { size })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wave::read_wave;

    #[test]
    fn the_circle_is_a_wave_of_a_running_machine() {
        let wave = read_wave(&circle(&[1e-6, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-6), 1e-4, false).unwrap();
        assert!(!wave.drives && f64::from_bits(wave.center[0]) == 1e-6);
    }
}
