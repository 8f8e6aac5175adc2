//! How the spec's own trajectories are followed.

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{PlatformRun, Record, RunOptions};
use host_sim::platform::scenario::select;
use host_sim::trajectory::{self, PaperPose, Reading};
use serde_json::{Value, json};
use specgen_language::model::{Model, PaperPath, TaskSpace, TrajectoryKind};
use specgen_runtime::setpoint::{REFUSED, STALE};
use specgen_studies::reproduce::write::digits;
use specgen_studies::verdict::{Figure, Subject};

use super::chart::{Axis, BLUE, Chart, DASHED, INK, LINE, Note, WIDE};
use super::section::{Grid, Group, Multiples, Part, Rows, Section};

/// Names of the coordinates.
pub const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
/// Names of the legs, counted as their words are.
pub const LEGS: [&str; 6] = ["leg 0", "leg 1", "leg 2", "leg 3", "leg 4", "leg 5"];
/// A trajectory is run at its own frequency and at this many times it.
const FAST: f64 = 10.0;
/// A trajectory on board that does not end is followed for this long, s.
pub(crate) const PLAYED: f64 = 60.0;
/// The key of limits.
const LIMITS: &str = "requirements.tracking";

/// A trajectory of the spec at a frequency, followed by the simulated machine.
#[derive(Debug, Clone)]
pub struct Followed {
    /// Of the trajectory.
    pub name: String,
    /// Operating frequency, Hz; none: a waveform, which has one speed.
    pub frequency: Option<f64>,
    /// Whether it is the speed that the spec gives.
    pub own: bool,
    /// The run; none if the controller refused set-points.
    pub run: Option<PlatformRun>,
}

impl Followed {
    /// `1 Hz`, or `as it is` for a waveform.
    #[must_use]
    pub fn speed(&self) -> String {
        self.frequency.map_or_else(|| "as it is".to_owned(), |hertz| format!("{hertz}\u{2009}Hz"))
    }

    /// The same for the verdict.
    fn named(&self) -> String {
        self.frequency.map_or_else(|| self.name.clone(), |hertz| format!("{} {hertz} Hz", self.name))
    }

    /// rms of the error of each axis, nm and nrad.
    #[must_use]
    pub fn rms(&self) -> Option<[f64; 6]> {
        self.run.as_ref().map(|run| run.errors.rms_nano())
    }
}

/// Norm of the errors of three axes.
#[must_use]
pub fn norm(rms: &[f64; 6], turning: bool) -> f64 {
    let axes = if turning { &rms[3..] } else { &rms[..3] };
    libm::sqrt(axes.iter().map(|v| v * v).sum())
}

/// Path of the paper's as the simulator has it.
#[must_use]
pub fn path(path: PaperPath) -> trajectory::PaperPath {
    match path {
        PaperPath::Case1 => trajectory::PaperPath::Case1,
        PaperPath::Case2 => trajectory::PaperPath::Case2,
        PaperPath::Machining => trajectory::PaperPath::Machining,
    }
}

/// The control mode of the spec, as the word `mode` has it.
#[must_use]
pub fn mode_of(controller: &Controller) -> u32 {
    let place = controller.description().config_names.iter().position(|name| name == "mode");
    let word = place.and_then(|place| controller.default_config().get(place).copied());
    word.and_then(|word| u32::try_from(word).ok()).unwrap_or_default()
}

/// Every trajectory of the spec at its own frequency, at ten times it, and where a limit asks for another one, at that.
///
/// # Errors
/// As [`PlatformScenario::run`].
pub fn follow(
    model: &Model,
    task: &TaskSpace,
    machine: &PlatformScenario,
    controller: &mut Controller,
    progress: &dyn Fn(&str),
) -> Result<Vec<Followed>, RunError> {
    let mut sampled = machine.clone();
    sampled.options = RunOptions { record: Record::Samples, ..machine.options.clone() };
    let mode = mode_of(controller);
    select(controller, mode)?;
    let mut all = Vec::new();
    for (number, one) in task.trajectories.iter().enumerate() {
        let kept = |run: PlatformRun| (run.status & (REFUSED | STALE) == 0).then_some(run);
        let name = one.name.clone();
        match &one.kind {
            TrajectoryKind::Paper { path: which, as_printed, frequency } => {
                let asked = model
                    .requirements
                    .tracking
                    .iter()
                    .filter(|limit| limit.trajectory.as_ref().is_none_or(|for_| *for_ == name));
                let mut frequencies = vec![*frequency, FAST * frequency];
                frequencies.extend(asked.filter_map(|limit| limit.frequency));
                frequencies.sort_by(f64::total_cmp);
                frequencies.dedup();
                for hertz in frequencies {
                    progress(&format!("{name} at {hertz} Hz"));
                    let reading = if *as_printed { Reading::AsPrinted } else { Reading::Corrected };
                    let run = sampled.run(controller, &PaperPose { path: path(*which), reading, frequency: hertz })?;
                    let own = hertz == *frequency;
                    all.push(Followed { name: name.clone(), frequency: Some(hertz), own, run: kept(run) });
                }
            }
            TrajectoryKind::Waveform { .. } => {
                progress(&format!("{name} on board"));
                let run = sampled.play(controller, number as u32, PLAYED)?;
                all.push(Followed { name, frequency: None, own: true, run: kept(run) });
            }
        }
    }
    Ok(all)
}

/// What the runs say to the limits of the spec, nm and nrad rms; what has no limit is not judged.
#[must_use]
pub fn judged(model: &Model, all: &[Followed]) -> Vec<Figure> {
    let mut figures = Vec::new();
    for one in all {
        let Some(rms) = one.rms() else { continue };
        let limits = model.requirements.tracking.iter().filter(|limit| {
            limit.trajectory.as_ref().is_none_or(|name| *name == one.name)
                && limit.frequency.map_or(one.own, |hertz| one.frequency == Some(hertz))
        });
        let before = figures.len();
        for limit in limits {
            let mut judge = |what: &str, value: f64, most: Option<f64>, unit: &'static str| {
                if let Some(most) = most {
                    let name = format!("{} {what}", one.named());
                    figures.push(Figure::new(Subject::Tracking, &name, value, unit).at_most(1e9 * most, LIMITS));
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
            figures.push(Figure::new(Subject::Tracking, &one.named(), norm(&rms, false), "nm"));
        }
    }
    figures
}

/// A row of the picture of errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What was followed.
    pub name: String,
    /// Errors: whether it is at the speed that the spec gives, and how much.
    pub values: Vec<(bool, f64)>,
    /// Beside it.
    pub note: String,
    /// Limit of the spec.
    pub limit: Option<f64>,
}

/// Lines of the trajectories of a platform, position (nm) or angle (nrad): norm of three axes.
#[must_use]
pub fn lines(model: &Model, noise: Option<&[f64; 6]>, all: &[Followed], turning: bool) -> Vec<Line> {
    let mut lines = Vec::new();
    if let Some(noise) = noise {
        let nano = noise.map(|v| v * 1e9);
        let axes = if turning { 3..6 } else { 0..3 };
        let each: Vec<String> = axes.map(|axis| format!("{} {}", AXES[axis], few(nano[axis]))).collect();
        let values = vec![(true, norm(&nano, turning))];
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
            values: of().filter_map(|one| one.rms().map(|rms| (one.own, norm(&rms, turning)))).collect(),
            note: refused.join(", "),
            limit: limit.map(|limit| 1e9 * limit),
        });
    }
    lines
}

fn few(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

/// Errors in one picture, `unit` rms; `speeds` are what hollow and full dots stand for.
#[must_use]
pub fn dumbbell(lines: &[Line], speeds: [Option<String>; 2], unit: &str) -> Rows {
    let mut numbers =
        Grid::new(&format!("Error on trajectories, {unit} rms"), &["trajectory", "at its speed", "faster"]);
    let mut rows: Vec<Value> = Vec::new();
    let (mut low, mut high) = (f64::INFINITY, 0.0);
    for line in lines {
        let mut ends = (f64::INFINITY, 0.0);
        let wider = |(low, high): (f64, f64), value: f64| {
            (if value < low { value } else { low }, if value > high { value } else { high })
        };
        for (_, value) in &line.values {
            ends = wider(ends, *value);
        }
        (low, high) = line.values.iter().map(|one| one.1).chain(line.limit).fold((low, high), wider);
        let text = |own: bool| {
            let found: Vec<String> = line.values.iter().filter(|one| one.0 == own).map(|one| digits(one.1)).collect();
            found.join(", ")
        };
        numbers.push(vec![line.name.clone(), text(true), text(false)]);
        let several = line.values.len() > 1;
        let marks: Vec<Value> = line
            .values
            .iter()
            .enumerate()
            .map(|(k, (own, value))| {
                let before = several && k == 0 || !several && !line.note.is_empty();
                let outer = k == 0 || k + 1 == line.values.len();
                json!({ "m": if *own { "hollow" } else { "dot" }, "x": value, "text": if outer { few(*value) } else { String::new() }, "before": before })
            })
            .collect();
        let noted = if several || line.values.is_empty() { None } else { line.values.first().map(|one| one.1) };
        rows.push(json!({ "name": line.name, "line": several.then_some([ends.0, ends.1]), "marks": marks, "note": line.note, "notex": noted,
            "limit": line.limit }));
    }
    let range = if low <= high {
        // Some room for texts on both sides.
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

/// The section: each trajectory at each speed, axis by axis.
#[must_use]
pub fn section(all: &[Followed], law: &str, interval: f64, corners: bool, command: &str) -> Section {
    let mut section = Section::new("tracking", "Tracking", command);
    // What is hardest to follow is seen first.
    let hardest = |one: &&Followed| one.rms().map_or(-1.0, |rms| norm(&rms, false));
    let first = all.iter().max_by(|a, b| hardest(a).total_cmp(&hardest(b))).map(|one| one.name.clone());
    let mut ordered: Vec<&Followed> = all.iter().collect();
    ordered.sort_by_key(|one| (Some(&one.name) != first.as_ref(), Some(&one.name) != first.as_ref() || one.own));
    let mut refused = Vec::new();
    for one in ordered {
        let speed = one.speed();
        let Some(run) = &one.run else {
            refused.push(format!("{} at {speed}", one.name));
            continue;
        };
        let shown = Shown {
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
            samples: run.samples.iter().map(|sample| [sample.target, sample.tick.pose]).collect(),
            corner: if corners { "corner, W0458" } else { "corner" },
        };
        section = section.pane(&[&one.name, &speed], pane(&shown));
    }
    if all.is_empty() {
        section = section
            .lead("The spec has no trajectory of its own: add [[trajectory]] tables, and their errors stand here.");
    }
    if !refused.is_empty() {
        section = section.text(&format!(
            "Not run, for the controller refuses set-points that leave the workspace or move faster than control.setpoint.stream_speed: {}.",
            refused.join(", ")
        ));
    }
    section
}

/// A run as it is drawn: axis by axis, or leg by leg.
#[derive(Debug, Clone)]
pub struct Shown<'a> {
    /// Name on the page.
    pub id: String,
    /// What was followed, and how fast.
    pub what: String,
    /// Control mode.
    pub law: &'a str,
    /// Of the coordinates.
    pub names: [&'a str; 6],
    /// How many of them are lengths; the others are angles.
    pub lengths: usize,
    /// Control interval, s.
    pub interval: f64,
    /// Target and what was reached, m and rad, tick by tick.
    pub samples: Vec<[[f64; 6]; 2]>,
    /// What a corner of the path is called.
    pub corner: &'a str,
}

impl Shown<'_> {
    /// rms of the error over all coordinates and ticks, nm.
    #[must_use]
    pub fn rms_nano(&self) -> f64 {
        let square =
            |[target, pose]: &[[f64; 6]; 2]| target.iter().zip(pose).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 6.0;
        libm::sqrt(self.samples.iter().map(square).sum::<f64>() / self.samples.len().max(1) as f64) * 1e9
    }
}

/// What a section shows of a run.
#[must_use]
pub fn pane(run: &Shown) -> Vec<Part> {
    let of = |axis: usize| -> Vec<f64> {
        run.samples.iter().map(|[target, pose]| (target[axis] - pose[axis]) * 1e9).collect()
    };
    let all: [Vec<f64>; 6] = core::array::from_fn(of);
    let rms =
        all.each_ref().map(|errors| libm::sqrt(errors.iter().map(|v| v * v).sum::<f64>() / errors.len().max(1) as f64));
    let peak = all
        .each_ref()
        .map(|errors| errors.iter().fold(0.0, |peak: f64, v| if v.abs() > peak { v.abs() } else { peak }));
    let worst = (1..run.lengths).fold(0, |worst, axis| if rms[axis] > rms[worst] { axis } else { worst });
    let times = [run.interval, run.interval];
    let causes = bends(&run.samples, run.interval);
    let (id, what) = (&run.id, &run.what);
    let mut items = Vec::new();
    let mut at_corner = false;
    for axis in 0..6 {
        let (unit, large) = if axis < run.lengths { ("nm", "µm") } else { ("nrad", "µrad") };
        let name = run.names[axis];
        let errors = &all[axis];
        let mut error = Chart::new(
            &format!("error-{id}-{axis}"),
            &format!("Error of {name}, {what}"),
            Axis::linear("time", "s"),
            Axis::linear(&format!("error of {name}"), unit),
        )
        .over_time("", LINE, times, errors)
        .colored(BLUE)
        .noted(Note::Band([-rms[axis], rms[axis]], [format!("+rms {} {unit}", short(rms[axis])), "−rms".to_owned()]));
        error.short = format!("{name} {} {unit}", short(rms[axis]));
        error.height = 250;
        let (mut largest, mut place) = (0.0, 0);
        for (k, value) in errors.iter().enumerate() {
            if value.abs() > largest {
                (largest, place) = (value.abs(), k);
            }
        }
        for time in &causes {
            let follows = place as f64 * run.interval - time;
            let caused = (0.0..0.02).contains(&follows);
            at_corner |= caused && axis == worst;
            let text = if caused { run.corner } else { "" };
            error = error.noted(Note::Cause(*time, text.to_owned()));
        }
        let at = (place + 1) as f64 * run.interval;
        let value = errors.get(place).copied().unwrap_or_default();
        error = error.noted(Note::Ring([at, value], format!("largest {} {unit}", short(largest))));
        let mut path = Chart::new(
            &format!("path-{id}-{axis}"),
            &format!("{name} of {what}: path above, error below"),
            Axis::linear("time", "s"),
            Axis::linear(name, large),
        )
        .over_time(
            if run.lengths == 3 { "true pose" } else { "reading" },
            WIDE,
            times,
            &run.samples.iter().map(|[_, pose]| pose[axis] * 1e6).collect::<Vec<_>>(),
        )
        .colored(2)
        .over_time(
            "target",
            DASHED,
            times,
            &run.samples.iter().map(|[target, _]| target[axis] * 1e6).collect::<Vec<_>>(),
        )
        .colored(INK);
        path.bare = true;
        path.height = 140;
        items.push(vec![path, error]);
    }
    let range = |axes: core::ops::Range<usize>| {
        let largest = peak[axes].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
        let round = round_up(largest);
        Some([-round, round])
    };
    let groups = error_groups(run.lengths == 3, range);
    let follows = if at_corner { "; the peak follows a corner of the path" } else { "" };
    vec![
        Part::Lead(format!(
            "With {} {} stays within {}\u{2009}nm of {what}, {}\u{2009}nm rms{follows}.",
            run.law,
            run.names[worst],
            short(peak[worst]),
            short(rms[worst])
        )),
        Part::Multiples(Multiples { id: format!("axes-{id}"), items, groups, selected: worst }),
    ]
}

/// Three digits.
#[must_use]
pub fn short(value: f64) -> String {
    let size = value.abs();
    if size >= 99.95 {
        format!("{value:.0}")
    } else if size >= 9.995 {
        format!("{value:.1}")
    } else {
        format!("{value:.2}")
    }
}

/// The next of 1, 2, 3, 4, 6, 8 times a power of ten.
#[must_use]
pub(crate) fn round_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 1.0;
    }
    let decade = libm::pow(10.0, libm::floor(libm::log10(value)));
    [1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0].iter().map(|k| k * decade).find(|v| *v >= value).unwrap_or(10.0 * decade)
}

/// Times at which the path turns at once, s: its second difference is far above what is usual. The three sharpest.
fn bends(samples: &[[[f64; 6]; 2]], interval: f64) -> Vec<f64> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for axis in 0..6 {
        let target = |window: &[[[f64; 6]; 2]], k: usize| window[k][0][axis];
        let second: Vec<f64> =
            samples.windows(3).map(|w| (target(w, 2) - 2.0 * target(w, 1) + target(w, 0)).abs()).collect();
        let mut sorted = second.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() * 99 / 100).copied().unwrap_or_default();
        let sharpest = sorted.last().copied().unwrap_or_default();
        if sharpest <= 5.0 * usual || sharpest <= 0.0 {
            continue;
        }
        for (k, value) in second.iter().enumerate() {
            if *value > 0.2 * sharpest && *value > 5.0 * usual {
                found.push((value / sharpest, (k + 2) as f64 * interval));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
    let mut times: Vec<f64> = Vec::new();
    for (_, time) in found {
        if times.len() < 3 && times.iter().all(|other| (time - other).abs() > 1e-3) {
            times.push(time);
        }
    }
    times.sort_by(f64::total_cmp);
    times
}

/// Small multiples of errors: of a pose (`axes`), lengths apart from angles, or of six legs. `range`: that of some of them.
pub(crate) fn error_groups(axes: bool, range: impl Fn(core::ops::Range<usize>) -> Option<[f64; 2]>) -> Vec<Group> {
    let group = |title: &str, items: Vec<usize>, of| Group { title: title.to_owned(), items, range: range(of) };
    if axes {
        vec![
            group("Position error, nm over s", vec![0, 1, 2], 0..3),
            group("Angle error, nrad over s", vec![3, 4, 5], 3..6),
        ]
    } else {
        vec![group("Error, nm over s", vec![0, 1, 2], 0..6), group("", vec![3, 4, 5], 0..6)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_hold_their_values() {
        for value in [0.3, 1.0, 1.21, 172.0, 610.0, 9.9] {
            assert!(round_up(value) >= value && round_up(value) <= 1.7 * value, "{value}");
        }
        assert_eq!((round_up(172.0), round_up(0.0)), (200.0, 1.0));
        assert_eq!([short(171.6), short(23.84), short(4.806)], ["172", "23.8", "4.81"]);
    }
}
