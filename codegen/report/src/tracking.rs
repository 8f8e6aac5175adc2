//! Tracking of the spec's own trajectories.

mod pane;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{OnBoard, PlatformRun, Record, RunOptions};
use host_sim::platform::scenario::select;
use host_sim::trajectory::{self, PaperPose, Reading};
use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_language::model::{Model, PaperPath, TaskSpace, TrajectoryKind};
use specgen_studies::machine::on_board;
use specgen_studies::reproduce::write::digits;
use specgen_studies::verdict::{Figure, Subject};

use super::section::{Grid, Rows, Section};

pub use pane::{PlottedRun, pane, short};
pub(crate) use pane::{error_groups, round_up};

/// Names of the coordinates.
pub const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
/// Names of the legs, counted from 0 like their words.
pub const LEGS: [&str; 6] = ["leg 0", "leg 1", "leg 2", "leg 3", "leg 4", "leg 5"];
/// Factor of the second speed at which each trajectory is run.
const FAST: f64 = 10.0;
/// Spec key of the limits.
const LIMITS: &str = "requirements.tracking";

/// How a trajectory of the spec is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// Streamed as set-points.
    Streamed(PaperPose),
    /// Played by the controller.
    Played(OnBoard),
}

impl Course {
    /// Runs it with the controller as configured.
    ///
    /// # Errors
    /// As [`PlatformScenario::run`] and [`PlatformScenario::play`].
    pub fn run(
        &self,
        machine: &PlatformScenario,
        controller: &mut dyn TickController,
    ) -> Result<PlatformRun, RunError> {
        match self {
            Self::Streamed(path) => machine.run(controller, path),
            Self::Played(path) => machine.play(controller, path, None),
        }
    }
}

/// A run of a trajectory of the spec at one frequency on the simulated machine.
#[derive(Debug, Clone)]
pub struct TrackedPath {
    /// Name of the trajectory.
    pub name: String,
    /// Operating frequency, Hz; `None` for a waveform, which has a fixed speed.
    pub frequency: Option<f64>,
    /// Whether it is the spec's own speed.
    pub own: bool,
    /// How it was played.
    pub course: Course,
    /// The run; `None` if the controller refused set-points.
    pub run: Option<PlatformRun>,
}

impl TrackedPath {
    /// `1 Hz`, or `own speed` for a waveform.
    pub fn speed(&self) -> String {
        self.frequency.map_or_else(|| "own speed".to_owned(), |hertz| format!("{hertz}\u{2009}Hz"))
    }

    /// Name for the verdict.
    fn named(&self) -> String {
        self.frequency.map_or_else(|| self.name.clone(), |hertz| format!("{} {hertz} Hz", self.name))
    }

    /// Rms error of each axis, nm and nrad.
    pub fn rms(&self) -> Option<[f64; 6]> {
        self.run.as_ref().map(|run| run.errors.rms_nano())
    }

    /// The measured part of the path.
    pub fn coverage(&self) -> Option<Coverage> {
        self.run.as_ref().map(|run| run.errors.coverage())
    }
}

/// Norm of the errors of three axes.
pub fn norm(rms: &[f64; 6], turning: bool) -> f64 {
    let axes = if turning { &rms[3..] } else { &rms[..3] };
    libm::sqrt(axes.iter().map(|v| v * v).sum())
}

/// The simulator's form of a path of the paper.
pub fn path(path: PaperPath) -> trajectory::PaperPath {
    match path {
        PaperPath::Case1 => trajectory::PaperPath::Case1,
        PaperPath::Case2 => trajectory::PaperPath::Case2,
        PaperPath::Machining => trajectory::PaperPath::Machining,
    }
}

/// The control mode of the spec, as the value of the word `mode`.
pub fn mode_of(controller: &Controller) -> u32 {
    let place = controller.description().config_names.iter().position(|name| name == "mode");
    let word = place.and_then(|place| controller.default_config().get(place).copied());
    word.and_then(|word| u32::try_from(word).ok()).unwrap_or_default()
}

/// Runs every trajectory of the spec at its own frequency, at ten times it, and at the frequency of a limit.
///
/// # Errors
/// As [`Course::run`].
pub fn follow(
    compiled: &Compilation,
    task: &TaskSpace,
    machine: &PlatformScenario,
    controller: &mut Controller,
    progress: &dyn Fn(&str),
) -> Result<Vec<TrackedPath>, RunError> {
    let mut sampled = machine.clone();
    sampled.options = RunOptions { record: Record::Samples, ..machine.options.clone() };
    let mode = mode_of(controller);
    select(controller, mode)?;
    let mut all = Vec::new();
    for (number, one) in task.trajectories.iter().enumerate() {
        let name = &one.name;
        let mut follow = |frequency: Option<f64>, own: bool, course: Course| -> Result<(), RunError> {
            let run = Some(course.run(&sampled, controller)?).filter(PlatformRun::is_followed);
            all.push(TrackedPath { name: name.clone(), frequency, own, course, run });
            Ok(())
        };
        match &one.kind {
            TrajectoryKind::Paper { path: which, as_printed, frequency } => {
                let asked = compiled
                    .model
                    .requirements
                    .tracking
                    .iter()
                    .filter(|limit| limit.trajectory.as_ref().is_none_or(|for_| for_ == name));
                let mut frequencies = vec![*frequency, FAST * frequency];
                frequencies.extend(asked.filter_map(|limit| limit.frequency));
                frequencies.sort_by(f64::total_cmp);
                frequencies.dedup();
                for hertz in frequencies {
                    progress(&format!("{name} at {hertz} Hz"));
                    let reading = if *as_printed { Reading::AsPrinted } else { Reading::Corrected };
                    let streamed = Course::Streamed(PaperPose { path: path(*which), reading, frequency: hertz });
                    follow(Some(hertz), hertz == *frequency, streamed)?;
                }
            }
            _ => {
                let Some(path) = on_board(compiled, number as u32) else { continue };
                progress(&format!("{name} on board"));
                follow(None, true, Course::Played(path))?;
            }
        }
    }
    Ok(all)
}

/// Figures of the runs with limits in the spec, nm and nrad rms.
pub fn figures(model: &Model, all: &[TrackedPath]) -> Vec<Figure> {
    let mut figures = Vec::new();
    for one in all {
        let Some((rms, coverage)) = one.rms().zip(one.coverage()) else { continue };
        let limits = model.requirements.tracking.iter().filter(|limit| {
            limit.trajectory.as_ref().is_none_or(|name| *name == one.name)
                && limit.frequency.map_or(one.own, |hertz| one.frequency == Some(hertz))
        });
        let before = figures.len();
        for limit in limits {
            let mut judge = |what: &str, value: f64, most: Option<f64>, unit: &'static str| {
                if let Some(most) = most {
                    let name = format!("{} {what}", one.named());
                    let figure = Figure::new(Subject::Tracking, &name, value, unit).over(coverage);
                    figures.push(figure.at_most(1e9 * most, LIMITS));
                }
            };
            judge("xyz", norm(&rms, false), limit.translation, "nm");
            judge("θ", norm(&rms, true), limit.rotation, "nrad");
            for axis in 0..6 {
                let unit = if axis < 3 { "nm" } else { "nrad" };
                judge(AXES[axis], rms[axis], limit.axes.map(|axes| axes[axis]), unit);
            }
        }
        if figures.len() == before && one.own {
            figures.push(Figure::new(Subject::Tracking, &one.named(), norm(&rms, false), "nm").over(coverage));
        }
    }
    figures
}

/// A row of the error chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name of the trajectory.
    pub name: String,
    /// Errors: whether at the spec's own speed, value, and measured part if it is for a path.
    pub values: Vec<(bool, f64, Option<Coverage>)>,
    /// Note beside it.
    pub note: String,
    /// Limit in the spec.
    pub limit: Option<f64>,
}

/// Rows for the trajectories of a platform, position (nm) or angle (nrad): norm of three axes.
pub fn lines(model: &Model, noise: Option<&[f64; 6]>, all: &[TrackedPath], turning: bool) -> Vec<Line> {
    let mut lines = Vec::new();
    if let Some(noise) = noise {
        let nano = noise.map(|v| v * 1e9);
        let axes = if turning { 3..6 } else { 0..3 };
        let each: Vec<String> = axes.map(|axis| format!("{} {}", AXES[axis], two_digits(nano[axis]))).collect();
        let values = vec![(true, norm(&nano, turning), None)];
        let unit = if turning { "nrad" } else { "nm" };
        let note = format!("{} {unit}", each.join(", "));
        lines.push(Line { name: "gauge noise".to_owned(), values, note, limit: None });
    }
    let mut names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
    names.dedup();
    for name in names {
        let of = || all.iter().filter(|one| one.name == name);
        let refused: Vec<String> =
            of().filter(|one| one.run.is_none()).map(|one| format!("{} refused", one.speed())).collect();
        let limit = model.requirements.tracking.iter().find_map(|limit| {
            let holds = limit.trajectory.as_ref().is_none_or(|for_| for_ == name);
            holds.then_some(if turning { limit.rotation } else { limit.translation }).flatten()
        });
        lines.push(Line {
            name: name.to_owned(),
            values: of().filter_map(|one| Some((one.own, norm(&one.rms()?, turning), one.coverage()))).collect(),
            note: refused.join(", "),
            limit: limit.map(|limit| 1e9 * limit),
        });
    }
    lines
}

fn two_digits(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

/// Error chart, `unit` rms; `speeds` are the meanings of hollow and full dots.
pub fn dumbbell(lines: &[Line], speeds: [Option<String>; 2], unit: &str) -> Rows {
    let mut numbers = Grid::new(&format!("Error on trajectories, {unit} rms"), &["trajectory", "own speed", "faster"]);
    let mut rows: Vec<Value> = Vec::new();
    let (mut low, mut high) = (f64::INFINITY, 0.0);
    for line in lines {
        let mut ends = (f64::INFINITY, 0.0);
        let wider = |(low, high): (f64, f64), value: f64| {
            (if value < low { value } else { low }, if value > high { value } else { high })
        };
        for (_, value, _) in &line.values {
            ends = wider(ends, *value);
        }
        (low, high) = line.values.iter().map(|one| one.1).chain(line.limit).fold((low, high), wider);
        let text = |own: bool| {
            let over =
                |coverage: Option<Coverage>| coverage.map_or_else(String::new, |c| format!(" over {}", c.brief()));
            let found = line.values.iter().filter(|one| one.0 == own);
            found.map(|one| digits(one.1) + &over(one.2)).collect::<Vec<_>>().join(", ")
        };
        numbers.push(vec![line.name.clone(), text(true), text(false)]);
        let several = line.values.len() > 1;
        let marks: Vec<Value> = line
            .values
            .iter()
            .enumerate()
            .map(|(k, (own, value, _))| {
                let before = several && k == 0 || !several && !line.note.is_empty();
                let outer = k == 0 || k + 1 == line.values.len();
                json!({ "m": if *own { "hollow" } else { "dot" }, "x": value, "text": if outer { two_digits(*value) } else { String::new() }, "before": before })
            })
            .collect();
        let noted = if several || line.values.is_empty() { None } else { line.values.first().map(|one| one.1) };
        rows.push(json!({ "name": line.name, "line": several.then_some([ends.0, ends.1]), "marks": marks, "note": line.note, "notex": noted,
            "limit": line.limit }));
    }
    let range = if low <= high {
        // Room for texts on both sides.
        let step = |value: f64| libm::pow(10.0, value);
        [step(libm::floor(3.0 * libm::log10(low / 1.5)) / 3.0), step(libm::ceil(3.0 * libm::log10(high * 1.5)) / 3.0)]
    } else {
        [1.0, 100.0]
    };
    let legend: Vec<Value> = ["hollow", "dot"]
        .iter()
        .zip(speeds)
        .filter_map(|(mark, text)| text.map(|text| json!({ "m": mark, "text": text })))
        .collect();
    Rows {
        id: format!("errors-{unit}"),
        title: String::new(),
        data: json!({ "scale": "log", "range": range, "unit": unit, "rows": rows, "legend": legend, "right": 30, "left": 96, "step": 31,
            "label": format!("Error on trajectories, {unit} rms") }),
        numbers,
    }
}

/// The section: each trajectory at each speed, per axis.
pub fn section(all: &[TrackedPath], law: &str, interval: f64, corners: bool, command: &str) -> Section {
    let mut section = Section::new("tracking", "Tracking", command);
    // The trajectory with the largest error comes first.
    let hardest = |one: &&TrackedPath| one.rms().map_or(-1.0, |rms| norm(&rms, false));
    let first = all.iter().max_by(|a, b| hardest(a).total_cmp(&hardest(b))).map(|one| one.name.clone());
    let mut ordered: Vec<&TrackedPath> = all.iter().collect();
    ordered.sort_by_key(|one| (Some(&one.name) != first.as_ref(), Some(&one.name) != first.as_ref() || one.own));
    let mut refused = Vec::new();
    for one in ordered {
        let speed = one.speed();
        let Some(run) = &one.run else {
            refused.push(format!("{} at {speed}", one.name));
            continue;
        };
        let shown = PlottedRun {
            id: format!(
                "{}-{}",
                one.name,
                one.frequency.map_or_else(|| "own".to_owned(), |hertz| format!("{hertz}hz"))
            ),
            what: format!("{} at {speed}", one.name),
            law,
            names: AXES,
            lengths: 3,
            interval,
            coverage: run.errors.coverage(),
            samples: run.samples.iter().map(|sample| [sample.target, sample.tick.pose]).collect(),
            corner: if corners { "corner, W0458" } else { "corner" },
        };
        section = section.pane(&[&one.name, &speed], pane(&shown));
    }
    if all.is_empty() {
        section = section.lead("The spec has no trajectories. Add [[trajectory]] tables to see their errors here.");
    }
    if !refused.is_empty() {
        section = section.text(&format!(
            "Ended early and not scored, because the controller refused set-points outside the workspace or faster than control.setpoint.stream_speed: {}.",
            refused.join(", ")
        ));
    }
    section
}
