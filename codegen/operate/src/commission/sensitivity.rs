//! |S| of the closed loop, from a wave of the set-point along each axis, with feedback and without it.
//!
//! ```text
//! e = h_d − h,  h = P (F h_d + C e)   ⇒   with feedback e₁ = S (1 − P F) h_d,  without e₀ = (1 − P F) h_d,  S = (1 + P C)⁻¹
//! ```
//! A wave of the set-point alone does not show S: feed-forward F takes most of it away, by an unknown amount. But it takes the same
//! away in both runs, so that |e₁|/|e₀| is |S| in the direction of e₀, whatever lag, modes and hysteresis of the machine are. The run
//! without feedback has the same feed-forward: mode F without estimates, or mode P with its gains at zero. The set-point of a row
//! is for the end of a tick and its pose for the beginning; the motion between them is subtracted.

use std::path::Path;

use host_sim::word::Scalar;
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::start_mode;
use specgen_identify::least_squares::{fit, mean_square};
use specgen_language::model::TaskSpace;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_numerics::nyquist::{Complex, plus, times};
use specgen_runtime::{ControlMode, Law};
use specgen_studies::learning::Learnable;

use super::machine::{Machine, rest};
use super::motions::{LATE, Motion, MotionKind, SHARE, SIZE};
use super::rows::Rows;
use super::state::Sensitivity;
use crate::commands::{SessionError, is_gain};
use crate::place::AXES;

/// Frequencies, Hz, and amplitudes of their set-points over the unit of an axis. 10.5 and not 10: hysteresis adds multiples.
const LOW: [(f64, f64); 4] = [(10.5, 4.0), (30.0, 1.0), (50.0, 1.0), (100.0, 0.5)];
/// The same of a mode: there the error without feedback is as large as the set-point, and must stay below what counts as an
/// oscillation.
const MODE: f64 = 0.01;
/// Sum of all amplitudes, rounded up.
const ALL: f64 = 6.6;
/// Rest before a wave, its ramps, and the time between them, s. Tones have whole periods in the latter.
const TIMES: [f64; 3] = [0.3, 0.25, 2.0];
/// Least distance of a tone from multiples of the mains and from other tones, and how far it is moved, Hz.
const APART: f64 = 1.0;
const MOVED: f64 = 1.5;
/// Rows in a period of the fastest tone.
const ROWS: f64 = 2.5;
/// Part of the limit on the speed of a stream that a wave may have.
const SPEED: f64 = 0.5;
/// An error without feedback below this many standard errors shows nothing.
const SHOWN: f64 = 10.0;
/// Rest after a change of mode, s.
const CHANGED: f64 = 1.0;
/// The two runs.
const RUNS: [&str; 2] = ["open", "closed"];

/// A frequency of the waves.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tone {
    hertz: f64,
    share: f64,
    mode: Option<usize>,
}

/// What is measured on a platform: `modes` are its frequencies, Hz.
pub(super) struct Experiment<'a> {
    compiled: &'a Compilation,
    task: &'a TaskSpace,
    mains: f64,
    tones: Vec<Tone>,
    home: [f64; 6],
}

impl<'a> Experiment<'a> {
    /// None for six legs.
    pub fn of(compiled: &'a Compilation, mains: f64, modes: &[f64]) -> Option<Self> {
        let home = compiled.ir.task_space.as_ref()?.setpoints.home;
        let task = compiled.model.task_space.as_ref()?;
        let tones = tones(modes, mains, 0.45 / compiled.model.timing.period);
        Some(Self { compiled, task, mains, tones, home })
    }

    /// Unit of the amplitude of an axis, m or rad: all tones together take a small part of workspace and speed.
    fn unit(&self, axis: usize) -> f64 {
        let model = &self.compiled.model;
        let size = if axis < 3 { SIZE } else { SIZE / model.geometry.joint_radius() };
        let swift = self.tones.iter().fold(0.0, |sum, tone| sum + tone.share * core::f64::consts::TAU * tone.hertz);
        let limits =
            [SHARE * model.workspace.bounds()[axis] / ALL, SPEED * self.task.setpoint.stream_speed[axis] / swift];
        limits.iter().fold(size, |least, limit| if *limit < least { *limit } else { least })
    }

    /// The file of the wave along an axis.
    fn wave(&self, axis: usize) -> String {
        let unit = self.unit(axis);
        let tone = |(number, tone): (usize, &Tone)| {
            // Phases that keep the peak low.
            let phase = (0.5 * (number * number) as f64 / self.tones.len() as f64) % 1.0;
            format!("{{ amplitude = {:?}, frequency = {:?}, phase = {phase:?} }}", tone.share * unit, tone.hertz)
        };
        let tones: Vec<String> = self.tones.iter().enumerate().map(tone).collect();
        let [_, ramp, long] = TIMES;
        format!(
            "center = {:?}\nramp = {ramp:?}\nseconds = {:?}\n[[axis]]\naxis = \"{}\"\nshape = {{ kind = \"multisine\", tones = [{}] }}\n",
            self.home,
            long + 2.0 * ramp,
            AXES[axis],
            tones.join(", ")
        )
    }

    /// Records the waves of a running machine at its home pose; then it has the settings of the spec again.
    pub fn measure(&self, machine: &mut Machine, folder: &Path, ui: &Ui) -> Result<(), SessionError> {
        let settings = &self.compiled.ir.integrity.settings;
        let description = machine.session.description();
        let open = self.without_feedback(&description.config_names, description.scalar, settings);
        let measured = self.waves(machine, (RUNS[1], settings), folder, ui);
        let measured = measured.and_then(|()| self.waves(machine, (RUNS[0], &open), folder, ui));
        match measured {
            // The machine is about to be ramped down; its next arming must find the settings of the spec.
            Err(error @ (SessionError::Link(_) | SessionError::Stopped)) => Err(error),
            done => self.set(machine, settings).and(done),
        }?;
        rest(machine, CHANGED, ui)
    }

    fn set(&self, machine: &mut Machine, settings: &[u64]) -> Result<(), SessionError> {
        machine.configure(settings, |name| format!("the device refused `{name}` of the spec"))
    }

    /// The settings without feedback, but with the feed-forward of the mode that the spec starts with. `names` are their names.
    fn without_feedback(&self, names: &[String], scalar: Scalar, settings: &[u64]) -> Vec<u64> {
        let mode = start_mode(&self.compiled.model, self.task);
        let open = if mode.inverts() { ControlMode::F(Law::Invhys) } else { mode };
        let word = |(name, word): (&String, &u64)| match name.as_str() {
            "mode" => open.word(),
            name if !mode.inverts() && is_gain(name) => scalar.encode(0.0),
            _ => *word,
        };
        names.iter().zip(settings).map(word).collect()
    }

    fn waves(
        &self,
        machine: &mut Machine,
        (run, settings): (&str, &[u64]),
        folder: &Path,
        ui: &Ui,
    ) -> Result<(), SessionError> {
        self.set(machine, settings)?;
        rest(machine, CHANGED, ui)?;
        self.motions(run).iter().try_for_each(|motion| motion.record(machine, folder, ui))
    }

    /// The waves along the axes, in one of the runs.
    fn motions(&self, run: &str) -> Vec<Motion> {
        let fastest = self.tones.iter().fold(0.0, |most, tone| if tone.hertz > most { tone.hertz } else { most });
        let period = self.compiled.model.timing.period;
        let every = libm::floor(1.0 / (ROWS * fastest * period));
        let [lead, ramp, long] = TIMES;
        let motion = |(axis, name): (usize, &&str)| Motion {
            name: format!("sensitivity-{name}-{run}"),
            start: self.home,
            kind: MotionKind::Wave(self.wave(axis)),
            spans: [lead, long + 2.0 * ramp + LATE],
            row: if every > 1.0 { every * period } else { period },
            figures: Vec::new(),
        };
        AXES.iter().enumerate().map(motion).collect()
    }

    /// |S| from the records in the folder.
    ///
    /// # Errors
    /// A record cannot be read.
    pub fn figures(&self, folder: &Path) -> Result<Vec<Sensitivity>, Failure> {
        let [open, closed] = RUNS.map(|run| {
            let paths = self.motions(run).into_iter().map(|motion| motion.path(folder));
            paths.map(|path| Rows::read(&path)).collect::<Result<Vec<_>, Failure>>()
        });
        self.compare(&open?, &closed?)
    }

    /// |S| from the records of both runs along each of the axes.
    fn compare(&self, open: &[Rows], closed: &[Rows]) -> Result<Vec<Sensitivity>, Failure> {
        let both = open.iter().zip(closed).enumerate();
        let runs = both.map(|(axis, (open, closed))| Ok([self.errors(open, axis)?, self.errors(closed, axis)?]));
        let runs = runs.collect::<Result<Vec<_>, Failure>>()?;
        let lost = || Failure::Gate("the platform has no modes, although the spec was checked".to_owned());
        let hertz: Vec<f64> = self.tones.iter().map(|tone| tone.hertz).collect();
        let computed = Learnable::of(self.compiled).ok_or_else(lost)?.sensitivity(&hertz);
        let radius = self.compiled.model.geometry.joint_radius();
        let scale = |axis: usize| if axis < 3 { 1.0 } else { radius };
        let norm = |vector: &[Complex; 6]| {
            let squares =
                vector.iter().enumerate().map(|(axis, [re, im])| (re * re + im * im) * scale(axis) * scale(axis));
            squares.fold(0.0, |sum, square| sum + square).sqrt()
        };
        let one = |(number, tone): (usize, &Tone)| {
            let mut found = Sensitivity {
                hertz: tone.hertz,
                mode: tone.mode,
                measured: [None; 6],
                error: [0.0; 6],
                computed: [0.0; 6],
            };
            for (axis, [open, closed]) in runs.iter().enumerate() {
                let (before, after) = (&open.tones[number], &closed.tones[number]);
                let without = norm(before);
                let noise = |run: &Phasors| norm(&run.noise.map(|noise| [noise, 0.0]));
                let left = computed[number].map(|row| {
                    row.iter().zip(before).fold([0.0; 2], |sum, (factor, error)| plus(sum, times(*factor, *error)))
                });
                found.computed[axis] = norm(&left) / without;
                if without < SHOWN * noise(open) || without.is_nan() {
                    continue;
                }
                let ratio = norm(after) / without;
                found.measured[axis] = Some(ratio);
                found.error[axis] = libm::hypot(noise(closed), ratio * noise(open)) / without;
            }
            found
        };
        Ok(self.tones.iter().enumerate().map(one).collect())
    }

    /// Errors of the axes at the tones of a record of the wave along `axis`, in the user's coordinates.
    fn errors(&self, rows: &Rows, axis: usize) -> Result<Phasors, Failure> {
        let [_, ramp, long] = TIMES;
        let (time, period, target) = (rows.time()?, rows.period()?, rows.axes("target", "")?);
        // The wave begins when the link has passed it on.
        let first = target[axis].iter().position(|value| (value - target[axis][0]).abs() > 0.0);
        let begun = first.map_or(f64::INFINITY, |row| time[row]) + ramp;
        let span = rows.span([begun, begun + long])?;
        if begun + long > time[time.len() - 1] {
            return Err(Failure::Gate(format!(
                "a wave of |S| along {} is not whole in its record: repeat acceptance with --again, on a less busy computer",
                AXES[axis]
            )));
        }
        let time = &time[span.clone()];
        let pi = core::f64::consts::TAU;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for hertz in self.tones.iter().map(|tone| tone.hertz).chain([self.mains, 2.0 * self.mains]) {
            columns.push(time.iter().map(|t| libm::cos(pi * hertz * t)).collect());
            columns.push(time.iter().map(|t| libm::sin(pi * hertz * t)).collect());
        }
        let middle = begun + 0.5 * long;
        (0..4).for_each(|power| {
            columns.push(time.iter().map(|t| libm::pow((t - middle) / long, f64::from(power))).collect())
        });
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let dependent = || {
            Failure::Gate(
                "rows of the waves of |S| are too long to tell its frequencies apart: use a faster line".to_owned(),
            )
        };
        let count = self.tones.len();
        let phasors = |values: &[f64]| {
            let found = fit(&columns, values).ok_or_else(dependent)?;
            let tones: Vec<Complex> =
                (0..count).map(|k| [found.coefficients[2 * k], -found.coefficients[2 * k + 1]]).collect();
            let noise = (2.0 * mean_square(&found.residual) / values.len() as f64).sqrt();
            Ok::<_, Failure>((tones, noise))
        };
        let every = rows.column("ticks")?[0];
        let errors = rows.axes("error", "_mean")?;
        let (moves, _) = phasors(&target[axis][span.clone()])?;
        let mut found = Phasors { tones: vec![[[0.0; 2]; 6]; count], noise: [0.0; 6] };
        for (other, values) in errors.iter().enumerate() {
            let (tones, noise) = phasors(&values[span.clone()])?;
            found.noise[other] = noise;
            for (number, (tone, shown)) in self.tones.iter().zip(tones).enumerate() {
                // The set-point of the last tick of a row, and its mean motion over a tick within the row.
                let angle = pi * tone.hertz * period;
                let moved = if other == axis { times(moves[number], motion(angle, every)) } else { [0.0; 2] };
                found.tones[number][other] = [shown[0] - moved[0], shown[1] - moved[1]];
            }
        }
        Ok(found)
    }
}

/// Complex amplitudes of the errors of the axes, by tone, and their noise, m and rad.
struct Phasors {
    tones: Vec<[Complex; 6]>,
    noise: [f64; 6],
}

/// From the set-point of the last tick of a row of `every` ticks to the mean over the row of its motion in a tick.
fn motion(angle: f64, every: f64) -> Complex {
    let turned = |ticks: f64| [libm::cos(angle * ticks), -libm::sin(angle * ticks)];
    // The sum of the motions is that from before the row to its end.
    let [re, im] = turned(every);
    [(1.0 - re) / every, -im / every]
}

/// Tones beside the mains, those of the modes (Hz) behind the fixed ones, up to `most` (Hz).
fn tones(modes: &[f64], mains: f64, most: f64) -> Vec<Tone> {
    let mut tones: Vec<Tone> = Vec::new();
    let low = LOW.iter().map(|(hertz, share)| (*hertz, *share, None));
    let modes = modes.iter().enumerate().map(|(number, hertz)| (*hertz, MODE, Some(number)));
    for (wanted, share, mode) in low.chain(modes) {
        // A mode of two directions has one tone.
        let same = |tone: &Tone| mode.is_some() && tone.mode.is_some() && (tone.hertz - wanted).abs() < 2.0 * APART;
        if tones.iter().any(same) || wanted > most {
            continue;
        }
        let mut hertz = libm::round(2.0 * wanted) / 2.0;
        let is_near = |hertz: f64| {
            let multiple = mains * libm::round(hertz / mains);
            multiple > 0.0 && (hertz - multiple).abs() < APART
        };
        while is_near(hertz) || tones.iter().any(|tone| (tone.hertz - hertz).abs() < APART) {
            hertz += MOVED;
        }
        tones.push(Tone { hertz, share, mode });
    }
    tones
}

#[cfg(test)]
mod tests {
    use host_sim::controller::TickController as _;
    use specgen_compiler::compile;

    use super::super::findings::findings;
    use super::super::simulated::records;
    use super::super::state::{Leg, State};
    use super::*;

    fn experiment(compiled: &Compilation) -> Experiment<'_> {
        let modes = compiled.design.as_ref().unwrap().modes.map(|mode| mode.frequency / core::f64::consts::TAU);
        Experiment::of(compiled, 50.0, &modes).unwrap()
    }

    /// |S| of the simulated machine, whose gains are those of the spec times `factor`.
    fn measured(experiment: &Experiment<'_>, factor: f64) -> Vec<Sensitivity> {
        let compiled = experiment.compiled;
        let description = specgen_run_time::controller(&compiled.ir).unwrap().description().clone();
        let mut settings = compiled.ir.integrity.settings.clone();
        for (word, name) in settings.iter_mut().zip(&description.config_names) {
            if is_gain(name) || name.ends_with("_weight") {
                *word = description.scalar.encode(factor * description.scalar.decode(*word));
            }
        }
        let open = experiment.without_feedback(&description.config_names, description.scalar, &settings);
        // Legs off by half a percent.
        let leg = Leg {
            model: "preisach".to_owned(),
            gain: compiled.model.actuator.leg_gain(),
            fit_rms: 0.0,
            arbitrary_rms: Some(90e-9),
            record: String::new(),
        };
        let legs = vec![leg; 6];
        let run = |settings: &[u64], run: &str| records(compiled, &legs, settings, &experiment.motions(run)).unwrap();
        experiment.compare(&run(&open, RUNS[0]), &run(&settings, RUNS[1])).unwrap()
    }

    #[test]
    fn the_sensitivity_of_a_simulated_machine_is_that_of_its_spec_and_half_the_gains_are_seen() {
        let spec = concat!(env!("CARGO_MANIFEST_DIR"), "/../../specs/reference.toml");
        let compiled = compile::compile(Path::new(spec)).unwrap();
        let experiment = experiment(&compiled);
        let all = measured(&experiment, 1.0);
        assert!(all.len() == 8 && all[7].mode == Some(5), "{all:?}");
        for one in &all {
            println!("{} Hz: {:.3?}, computed {:.3?}", one.hertz, one.measured, one.computed);
            for axis in 0..6 {
                let (measured, computed) = (one.measured[axis].unwrap(), one.computed[axis]);
                let off = (measured - computed).abs();
                assert!(off < 0.05 * computed && off < 3.0 * one.error[axis], "{one:?}");
            }
        }
        let state = |sensitivity: Vec<Sensitivity>| State { sensitivity, ..State::default() };
        assert!(findings(&state(all)).is_empty());
        // Half the gains: at low frequencies three times the error is left.
        let half = measured(&experiment, 0.5);
        assert!(half[0].measured[2].unwrap() > 3.0 * half[0].computed[2], "{:?}", half[0]);
        let found = findings(&state(half));
        assert_eq!(found[0], "|S| at 10.5 Hz, x y z rx ry rz: above 1.5 times that of the spec");
    }

    #[test]
    fn tones_keep_away_from_the_mains_and_from_each_other() {
        let all = tones(&[361.2, 361.3, 428.0, 450.2, 9000.0], 50.0, 4500.0);
        let hertz: Vec<f64> = all.iter().map(|tone| tone.hertz).collect();
        assert_eq!(hertz, [10.5, 30.0, 51.5, 101.5, 361.0, 428.0, 451.5]);
        assert_eq!(all.iter().map(|tone| tone.mode).collect::<Vec<_>>()[4..], [Some(0), Some(2), Some(3)]);
    }
}
