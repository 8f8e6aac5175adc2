//! Whether a platform is ready, and the figures that decide: what `specgen check`, the main job and the report say first.

use serde::Serialize;

use specgen_compiler::compile::Compiled;
use specgen_compiler::requirements;
use specgen_language::diagnostic::Severity;
use specgen_toolchain::budget::{self, Used, group};

use crate::verify::{Inspection, Measurement};

/// Longest line of [`Verdict::text`], letters.
pub const WIDTH: usize = 80;
/// Names of the coordinates of a pose; figures of neighbours stand in one group of a line.
const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
/// Beyond this no gain ratio and no delay (ticks) is looked for.
const LOOKED_AT: [f64; 2] = [10.0, 5.0];

/// What a figure is about: a line of the text, a row of a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// How far each axis goes alone, from the middle of the strokes, µm and µrad; the limit is the declared workspace.
    Reach,
    /// Noise of the measured pose and of a gauge, rms; `step`: the finest of the converters, at a leg or the platform.
    Noise,
    /// How well the hysteresis tables fit their records.
    Record,
    /// How far the worst control mode is from instability.
    Margins,
    /// Errors along trajectories of the spec. [`Verdict::of`] has none: a run has to be made.
    Tracking,
    /// Instructions of a tick.
    Time,
    /// Flash, RAM and stack; what the image must not do.
    Memory,
    /// Whether host and microcontroller compute the same bits.
    Bits,
}

impl Subject {
    /// In the order in which they are said.
    pub const ALL: [Self; 8] =
        [Self::Reach, Self::Noise, Self::Record, Self::Margins, Self::Tracking, Self::Time, Self::Memory, Self::Bits];

    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reach => "reach",
            Self::Noise => "noise",
            Self::Record => "record",
            Self::Margins => "margins",
            Self::Tracking => "tracking",
            Self::Time => "time",
            Self::Memory => "memory",
            Self::Bits => "bits",
        }
    }
}

/// How a figure stands to its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// It keeps it.
    Within,
    /// It does not: the platform is not ready.
    Beyond,
    /// There is none: the figure is not judged.
    NoLimit,
}

/// What a figure may be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// In the unit of the figure.
    pub value: f64,
    /// Whether the figure must be at least this; else at most.
    pub least: bool,
    /// Who says so: a key of the spec, or the part.
    pub from: String,
}

/// A number about the platform, and its limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is about.
    pub subject: Subject,
    /// Which one of these, such as `z` or `flash`.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// Whether it is more than `value`: nothing beyond was looked at.
    pub more: bool,
    /// Of value and limit; empty for ratios.
    pub unit: &'static str,
    /// If the spec or the part has one.
    pub limit: Option<Limit>,
    /// How it stands to that.
    pub mark: Mark,
    /// Said in place of the number, where it is no measure.
    pub words: Option<String>,
}

impl Figure {
    /// A figure that is not judged.
    #[must_use]
    pub fn new(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        let name = name.to_owned();
        Self { subject, name, value, more: false, unit, limit: None, mark: Mark::NoLimit, words: None }
    }

    /// A fact in words that is as it must be, or not.
    #[must_use]
    pub fn fact(subject: Subject, name: &str, words: String, good: bool) -> Self {
        let mark = if good { Mark::Within } else { Mark::Beyond };
        Self { mark, words: Some(words), ..Self::new(subject, name, 0.0, "") }
    }

    /// A figure of which only this is known: it is more.
    #[must_use]
    pub fn more_than(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        Self { more: true, ..Self::new(subject, name, value, unit) }
    }

    /// The same, which must be at most `value` by what `from` says.
    #[must_use]
    pub fn at_most(self, value: f64, from: &str) -> Self {
        let mark = if self.value <= value && !self.more { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: false, from: from.to_owned() }), ..self }
    }

    /// The same, which must be at least `value` by what `from` says.
    #[must_use]
    pub fn at_least(self, value: f64, from: &str) -> Self {
        let mark = if self.value >= value { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: true, from: from.to_owned() }), ..self }
    }

    /// The value without its unit, in KiB where that is bytes; `> 5` where it is more.
    #[must_use]
    pub fn value_text(&self) -> String {
        if self.more { format!("> {}", plain(self.value, self.unit)) } else { number(self.value, self.unit) }
    }

    /// How value and limit stand to each other: `≤`, `>`, `≥` or `<`; none without a limit.
    #[must_use]
    pub fn relation(&self) -> Option<&'static str> {
        let limit = self.limit.as_ref()?;
        Some(match (limit.least, self.mark) {
            (false, Mark::Beyond) => ">",
            (false, _) => "≤",
            (true, Mark::Beyond) => "<",
            (true, _) => "≥",
        })
    }

    /// The limit without its unit, as the value; empty without one.
    #[must_use]
    pub fn limit_text(&self) -> String {
        self.limit.as_ref().map_or_else(String::new, |limit| plain(limit.value, self.unit))
    }
}

/// A number that was chosen has few decimals.
fn plain(value: f64, unit: &str) -> String {
    let text = number(value, unit);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Counts with their thousands, bytes in KiB, three digits.
fn number(value: f64, unit: &str) -> String {
    if unit == "instructions" {
        return group(value as u64);
    }
    let value = if unit == "bytes" { value / 1024.0 } else { value };
    let size = value.abs();
    let decimals = if size >= 99.95 {
        0
    } else if size >= 9.995 {
        1
    } else {
        2
    };
    format!("{value:.decimals$}")
}

/// The answer to whether this platform may be run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// Every figure that has a limit keeps it.
    Ready,
    /// So far yes: time, memory or bits are not measured.
    NotMeasured,
    /// A figure is beyond its limit.
    NotReady,
}

/// Whether a platform is ready, and the figures that decide.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Of the platform.
    pub name: String,
    /// Of spec and records, SHA-256.
    pub digest: String,
    /// Whether it is ready.
    pub answer: Answer,
    /// Warnings about the spec.
    pub warnings: usize,
    /// By subject, in the order of [`Subject::ALL`].
    pub figures: Vec<Figure>,
    /// Why time, memory or bits are not measured, if they are not.
    pub unmeasured: Option<String>,
    /// Commands that come next.
    pub next: Vec<String>,
}

impl Verdict {
    /// What is known of a spec that compiled, before it is built. `unmeasured`: why it is not.
    #[must_use]
    pub fn of(compiled: &Compiled, unmeasured: &str) -> Self {
        let warnings = compiled.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
        let mut verdict = Self {
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            answer: Answer::NotMeasured,
            warnings,
            figures: Vec::new(),
            unmeasured: Some(unmeasured.to_owned()),
            next: Vec::new(),
        };
        let figures = [reach(compiled), noise(compiled), record(compiled), margins(compiled)];
        figures.into_iter().flatten().for_each(|figure| verdict.push(figure));
        verdict
    }

    /// Adds a figure, and answers with it.
    pub fn push(&mut self, figure: Figure) {
        let order = |subject: Subject| Subject::ALL.iter().position(|one| *one == subject);
        let place = self.figures.partition_point(|one| order(one.subject) <= order(figure.subject));
        self.figures.insert(place, figure);
        self.judge();
    }

    /// Adds what a run on the emulated machine showed.
    pub fn measured(&mut self, compiled: &Compiled, measurement: &Measurement) {
        self.unmeasured = None;
        self.image(compiled, &measurement.used, measurement.checks.faults.iter().map(|fault| &fault.text));
        if let Some(step) = measurement.stage("step") {
            self.push(Figure::new(Subject::Time, "longest tick", step.max as f64, "instructions"));
        }
        let machine = &measurement.machine;
        let (words, good) = match &measurement.first_difference {
            None => (format!("host and {machine} agree in every bit over {} ticks", group(measurement.ticks)), true),
            Some(difference) => (format!("host and {machine} DIFFER: {difference}"), false),
        };
        self.push(Figure::fact(Subject::Bits, "host and microcontroller", words, good));
    }

    /// Adds what an image shows that was not run, for the reason that [`Verdict::unmeasured`] gives.
    pub fn inspected(&mut self, compiled: &Compiled, inspection: &Inspection) {
        self.image(compiled, &inspection.used, inspection.checks.faults.iter().map(|fault| &fault.text));
    }

    fn image<'a>(&mut self, compiled: &Compiled, used: &Used, faults: impl Iterator<Item = &'a String>) {
        for held in budget::held(&compiled.model.target, used) {
            let (subject, unit) =
                if held.what == "instructions" { (Subject::Time, "instructions") } else { (Subject::Memory, "bytes") };
            let figure = Figure::new(subject, held.what, held.used as f64, unit);
            self.push(match held.most {
                Some((most, from)) => figure.at_most(most as f64, &from),
                None => figure,
            });
        }
        if used.stack.is_none() {
            let words = "the stack of a tick has no bound".to_owned();
            self.push(Figure::fact(Subject::Memory, "stack", words, compiled.model.target.budget.stack.is_none()));
        }
        for fault in faults {
            self.push(Figure::fact(Subject::Memory, "image", fault.clone(), false));
        }
    }

    fn judge(&mut self) {
        self.answer = if self.beyond().next().is_some() {
            Answer::NotReady
        } else if self.unmeasured.is_some() {
            Answer::NotMeasured
        } else {
            Answer::Ready
        };
    }

    /// The figures that are why it is not ready.
    pub fn beyond(&self) -> impl Iterator<Item = &Figure> {
        self.figures.iter().filter(|figure| figure.mark == Mark::Beyond)
    }

    /// The answer as a sentence.
    #[must_use]
    pub fn headline(&self) -> String {
        let name = &self.name;
        let kept = match self.figures.iter().filter(|figure| figure.mark == Mark::Within).count() {
            0 => "no figure has a limit".to_owned(),
            1 => "1 figure within its limit".to_owned(),
            many => format!("{many} figures within their limits"),
        };
        let warnings = match self.warnings {
            0 => String::new(),
            1 => ", 1 warning".to_owned(),
            many => format!(", {many} warnings"),
        };
        match self.answer {
            Answer::Ready => format!("{name} is ready: {kept}{warnings}"),
            Answer::NotMeasured => format!("{name} is good so far: {kept}{warnings}"),
            Answer::NotReady => {
                let why = |one: &Figure| match one.words {
                    Some(_) => one.subject.name().to_owned(),
                    None => said(&[one]),
                };
                let why: Vec<String> = self.beyond().map(why).collect();
                format!("{name} is NOT ready: {}{warnings}", why.join(", "))
            }
        }
    }

    /// What the figures of a subject are, in one line; none if there are none.
    #[must_use]
    pub fn line(&self, subject: Subject) -> Option<String> {
        let figures: Vec<&Figure> = self.figures.iter().filter(|figure| figure.subject == subject).collect();
        let is_axis = |figure: &Figure| AXES.contains(&figure.name.as_str());
        let together = |a: &&Figure, b: &&Figure| {
            is_axis(a) && is_axis(b) && a.unit == b.unit && a.relation() == b.relation() && a.words == b.words
        };
        let groups: Vec<&[&Figure]> = figures.chunk_by(together).collect();
        // Neighbours of one unit say it once.
        let runs = groups.chunk_by(|a, b| a[0].unit == b[0].unit && a[0].words.is_none() && b[0].words.is_none());
        let said: Vec<String> = runs
            .map(|run| {
                let text = run.iter().map(|group| said(group)).collect::<Vec<_>>().join(", ");
                let unit = if run[0][0].unit == "bytes" { "KiB" } else { run[0][0].unit };
                if unit.is_empty() || text.contains(unit) { text } else { format!("{text} {unit}") }
            })
            .collect();
        (!said.is_empty()).then(|| said.join(", "))
    }

    /// At most nine lines of at most [`WIDTH`] letters: the answer, a line a subject, what comes next.
    #[must_use]
    pub fn text(&self) -> String {
        let mut lines = vec![self.headline()];
        let known = |subject: &Subject| self.line(*subject).map(|line| format!("  {:<9}{line}", subject.name()));
        lines.extend(Subject::ALL.iter().filter_map(known));
        if let Some(why) = &self.unmeasured {
            lines.push(format!("  {:<9}{why}", "left out"));
        }
        let mut next = String::new();
        for command in &self.next {
            let more = if next.is_empty() { command.clone() } else { format!("{next}; {command}") };
            if next.is_empty() || more.chars().count() + 11 <= WIDTH {
                next = more;
            }
        }
        if !next.is_empty() {
            lines.push(format!("  {:<9}{next}", "next"));
        }
        lines.iter().map(|line| format!("{}\n", cut(line))).collect()
    }
}

/// A line that is too long, with dots where it is cut: all of it is in the details.
fn cut(line: &str) -> String {
    if line.chars().count() <= WIDTH {
        return line.to_owned();
    }
    line.chars().take(WIDTH - 2).chain(" …".chars()).collect()
}

/// One figure, or neighbours that are coordinates: `54.9/52.4/73.7 ≥ 50/50/52 µm`.
fn said(group: &[&Figure]) -> String {
    let first = group[0];
    if let Some(words) = &first.words {
        return words.clone();
    }
    let list = |of: &dyn Fn(&Figure) -> String| group.iter().map(|figure| of(figure)).collect::<Vec<_>>().join("/");
    let mut text = if AXES.contains(&first.name.as_str()) { String::new() } else { format!("{} ", first.name) };
    text += &list(&Figure::value_text);
    if let Some(relation) = first.relation() {
        text += &format!(" {relation} {}", list(&Figure::limit_text));
    }
    text
}

fn reach(compiled: &Compiled) -> Vec<Figure> {
    let Some(reach) = &compiled.reach else { return Vec::new() };
    let axes = reach.axes.iter().enumerate().map(|(axis, one)| {
        let [low, high] = one.from_middle.map(f64::abs);
        let unit = if axis < 3 { "µm" } else { "µrad" };
        let figure = Figure::new(Subject::Reach, AXES[axis], 1e6 * if low > high { low } else { high }, unit);
        // Legs with gauges of their own stop one by one at the ends of their strokes: the workspace binds nothing.
        if compiled.design.is_none() {
            return figure;
        }
        let key = if axis < 3 { "workspace.translation" } else { "workspace.rotation" };
        figure.at_least(1e6 * one.declared, key)
    });
    axes.collect()
}

fn noise(compiled: &Compiled) -> Vec<Figure> {
    let mut figures = Vec::new();
    if let Some(noise) = &compiled.pose_noise {
        for (axis, value) in noise.pose.iter().enumerate() {
            let unit = if axis < 3 { "nm" } else { "nrad" };
            figures.push(Figure::new(Subject::Noise, AXES[axis], 1e9 * value, unit));
        }
        figures.push(Figure::new(Subject::Noise, "gauge", 1e9 * noise.reading, "nm"));
    } else if compiled.model.sensor.noise > 0.0 {
        figures.push(Figure::new(Subject::Noise, "gauge", 1e9 * compiled.model.sensor.noise, "nm"));
    }
    let steps = requirements::steps(&compiled.model);
    let largest = steps.platform.iter().fold(steps.leg, |largest, step| if *step > largest { *step } else { largest });
    let step = Figure::new(Subject::Noise, "step", 1e9 * largest, "nm");
    figures.push(match compiled.model.requirements.precision {
        Some(precision) => step.at_most(1e9 * precision, "requirements.precision"),
        None => step,
    });
    figures
}

fn record(compiled: &Compiled) -> Vec<Figure> {
    let worst = compiled.records.iter().flatten().max_by(|a, b| a.fit_rms_percent.total_cmp(&b.fit_rms_percent));
    let Some(worst) = worst else { return Vec::new() };
    vec![
        Figure::new(Subject::Record, "fit", worst.fit_rms_percent, "%"),
        Figure::new(Subject::Record, "range", 1e6 * worst.displacement_range, "µm"),
        Figure::new(Subject::Record, "noise", 1e9 * worst.noise_floor, "nm"),
    ]
}

fn margins(compiled: &Compiled) -> Vec<Figure> {
    let subject = Subject::Margins;
    let highest = compiled.model.adaptation.gain_ratio[1];
    let lambda = |limit: Option<f64>| {
        let figure = limit.map_or_else(
            || Figure::more_than(subject, "λ", LOOKED_AT[0], ""),
            |limit| Figure::new(subject, "λ", limit, ""),
        );
        figure.at_least(highest, "adaptation.gain_ratio")
    };
    if let Some(design) = &compiled.design {
        let least = |of: fn(&specgen_compiler::stability::platform::ModeMargins) -> Option<f64>| {
            design.margins.iter().filter_map(of).min_by(f64::total_cmp)
        };
        let mut figures = vec![lambda(least(|mode| mode.gain_ratio_limit))];
        figures.extend(least(|mode| mode.gain_margin).map(|gain| Figure::new(subject, "gain ×", gain, "")));
        figures.push(least(|mode| mode.delay_margin_ticks).map_or_else(
            || Figure::more_than(subject, "delay", LOOKED_AT[1], "ticks"),
            |ticks| Figure::new(subject, "delay", ticks, "ticks"),
        ));
        return figures;
    }
    let Some(margins) = &compiled.margins else { return Vec::new() };
    let mut figures: Vec<Figure> = margins.static_gain_limit.map(|limit| lambda(Some(limit))).into_iter().collect();
    if let Some(largest) = margins.largest_level_weight {
        let weight = Figure::new(subject, "level weight", compiled.model.adaptation.level_weight, "");
        figures.push(weight.at_most(largest, "stability of the sampled leg"));
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;

    fn empty() -> Verdict {
        Verdict {
            name: "bench".to_owned(),
            digest: String::new(),
            answer: Answer::NotMeasured,
            warnings: 1,
            figures: Vec::new(),
            unmeasured: None,
            next: vec!["specgen sim bench.toml".to_owned(), format!("specgen report {}", "x".repeat(80))],
        }
    }

    #[test]
    fn neighbouring_axes_share_a_group_and_subjects_keep_their_order() {
        let mut verdict = empty();
        verdict.push(Figure::new(Subject::Time, "instructions", 4043.0, "instructions").at_most(4500.0, "spec"));
        for (axis, value) in [("x", 54.94), ("y", 52.4), ("z", 173.7)] {
            verdict.push(Figure::new(Subject::Reach, axis, value, "µm").at_least(50.0, "spec"));
        }
        verdict.push(Figure::new(Subject::Reach, "θx", 421.1, "µrad").at_least(400.0, "spec"));
        verdict.push(Figure::more_than(Subject::Margins, "delay", 5.0, "ticks"));
        assert_eq!(
            verdict.text(),
            "bench is ready: 5 figures within their limits, 1 warning\n\
             \x20 reach    54.9/52.4/174 ≥ 50/50/50 µm, 421 ≥ 400 µrad\n\
             \x20 margins  delay > 5 ticks\n\
             \x20 time     instructions 4,043 ≤ 4,500\n\
             \x20 next     specgen sim bench.toml\n"
        );
    }

    #[test]
    fn one_figure_beyond_its_limit_is_enough() {
        let mut verdict = empty();
        verdict.push(Figure::new(Subject::Memory, "flash", 70_000.0, "bytes").at_most(65_536.0, "spec"));
        verdict.push(Figure::new(Subject::Memory, "RAM", 70.0, "bytes").at_most(70.0, "spec"));
        assert_eq!(verdict.answer, Answer::NotReady);
        assert_eq!(verdict.headline(), "bench is NOT ready: flash 68.4 > 64, 1 warning");
        assert_eq!(verdict.line(Subject::Memory).unwrap(), "flash 68.4 > 64, RAM 0.07 ≤ 0.07 KiB");
        let more = Figure::more_than(Subject::Margins, "λ", 10.0, "");
        assert_eq!(more.clone().at_least(1.1, "spec").mark, Mark::Within);
        assert_eq!(more.at_most(20.0, "spec").mark, Mark::Beyond);
    }

    #[test]
    fn no_line_is_longer_than_a_terminal_is_wide() {
        let mut verdict = empty();
        verdict.push(Figure::fact(Subject::Bits, "bits", "they DIFFER ".repeat(20), false));
        verdict.unmeasured = Some("µ".repeat(100));
        assert!(verdict.text().lines().all(|line| line.chars().count() <= WIDTH), "{}", verdict.text());
    }
}
