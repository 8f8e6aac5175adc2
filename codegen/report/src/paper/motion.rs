//! Figs 11 to 22 and Tables 5 to 8: free motion of a platform.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{PoseSample, Record, RunOptions};
use host_sim::platform::scenario::{FREE_MODES, select_at_equal_gains};
use host_sim::platform::table::{PoseRow, PoseTable};
use host_sim::trajectory::{PaperPose, Reading};

use crate::chart::{Axis, Chart, DASHED, INK, LINE};
use crate::section::Section;
use crate::tracking::AXES;
use specgen_studies::reproduce::platform::{CASES, FREQUENCIES, tables};

/// Colour of targets.
pub(super) const TARGETS: usize = INK;

/// Why a run is not scored.
pub(super) const REFUSED_PATH: &str = "The controller refused set-points: the path leaves the workspace of the spec, or moves faster than its control.setpoint.stream_speed.";

/// Selects a value of one coordinate from a sample.
type Pick = fn(&PoseSample, usize) -> f64;

/// The sections of both cases.
///
/// # Errors
/// As [`PlatformScenario::run`].
pub fn sections(
    machine: &PlatformScenario,
    controller: &mut dyn TickController,
    command: &str,
    progress: &dyn Fn(&str),
) -> Result<Vec<Section>, RunError> {
    let mut sampled = machine.clone();
    sampled.options = RunOptions { record: Record::Samples, ..machine.options.clone() };
    let mut sections = Vec::new();
    for (case, (name, path)) in CASES.into_iter().enumerate() {
        let mut section = Section::new(
            ["case-1", "case-2"][case],
            ["Free motion, case 1: along x, y and z", "Free motion, case 2: along z, rotation about x and y"][case],
            command,
        )
        .text("P/F with each adaptation law at equal gains; target and true pose of the platform, both relative to rest, including the bias. Errors are target minus true pose.");
        let mut table = PoseTable::default();
        let mut refused = Vec::new();
        for (place, frequency) in FREQUENCIES.into_iter().enumerate() {
            progress(&format!("{name} at {frequency} Hz"));
            let trajectory = PaperPose { path, reading: Reading::Corrected, frequency };
            let mut figures = Figures::new(case, place, frequency, sampled.options.interval);
            for (mode, word) in FREE_MODES {
                select_at_equal_gains(controller, word)?;
                let run = sampled.run(controller, &trajectory)?;
                let Ok(errors) = run.scored() else {
                    refused.push(format!("{mode} at {frequency} Hz"));
                    continue;
                };
                table.rows.push(PoseRow::of(name, mode, frequency, errors));
                figures.add(mode, &run.samples);
            }
            if let Some(charts) = figures.finish() {
                section = section.charts(charts);
            }
        }
        if !refused.is_empty() {
            section = section.text(&format!("{REFUSED_PATH} Not scored: {}.", refused.join(", ")));
        }
        for comparison in tables(&table, name) {
            section = section.comparison(&comparison);
        }
        sections.push(section);
    }
    Ok(sections)
}

/// Charts of one case at one frequency.
struct Figures {
    interval: f64,
    paths: [Chart; 2],
    errors: [Chart; 2],
    laws: [Chart; 2],
    any: bool,
}

impl Figures {
    fn new(case: usize, place: usize, frequency: f64, interval: f64) -> Self {
        let number = if case == 0 { 11 } else { 17 } + 2 * place;
        let make = |kind: &str, turning: usize, what: &str, y: [&str; 2]| {
            let figure = number + turning;
            let motion = ["translation", "rotation"][turning];
            Chart::new(
                &format!("{kind}-{figure}"),
                &format!("Fig. {figure}: {motion}, {what}, {frequency} Hz"),
                Axis::linear("time", "s"),
                Axis::linear(y[0], y[1]),
            )
        };
        let path = |turning: usize| make("path", turning, "P/F with PCC", ["pose from rest", ["µm", "µrad"][turning]]);
        let error = |turning: usize| make("error", turning, "error with PCC", ["error", ["nm", "nrad"][turning]]);
        let law =
            |turning: usize| make("law", turning, "error norm by law", ["norm of the error", ["nm", "nrad"][turning]]);
        Self { interval, paths: [path(0), path(1)], errors: [error(0), error(1)], laws: [law(0), law(1)], any: false }
    }

    fn add(&mut self, mode: &str, samples: &[PoseSample]) {
        self.any = true;
        let times = [self.interval, self.interval];
        for turning in 0..2 {
            let places = 3 * turning..3 * turning + 3;
            let norm: Vec<f64> = samples
                .iter()
                .map(|sample| libm::sqrt(places.clone().map(|k| error(sample, k) * error(sample, k)).sum()))
                .collect();
            change(&mut self.laws[turning], |chart| chart.over_time(mode, LINE, times, &norm));
            if mode != "pf-pcc" {
                continue;
            }
            for axis in places {
                let of = |pick: Pick| samples.iter().map(|sample| pick(sample, axis)).collect::<Vec<f64>>();
                let name = AXES[axis];
                change(&mut self.paths[turning], |chart| {
                    chart
                        .over_time(name, LINE, times, &of(|s, k| s.tick.pose[k] * 1e6))
                        .colored(axis % 3)
                        .over_time(&format!("{name} target"), DASHED, times, &of(|s, k| s.target[k] * 1e6))
                        .colored(TARGETS)
                });
                change(&mut self.errors[turning], |chart| chart.over_time(name, LINE, times, &of(error)));
            }
        }
    }

    fn finish(self) -> Option<Vec<Chart>> {
        let ([path, turn], [error, error_turn], [law, law_turn]) = (self.paths, self.errors, self.laws);
        self.any.then(|| vec![path, error, law, turn, error_turn, law_turn])
    }
}

/// Target minus true pose, nm or nrad.
pub(super) fn error(sample: &PoseSample, axis: usize) -> f64 {
    (sample.target[axis] - sample.tick.pose[axis]) * 1e9
}

/// Applies a builder method that takes the chart by value.
pub(super) fn change(chart: &mut Chart, with: impl FnOnce(Chart) -> Chart) {
    *chart = with(chart.clone());
}
