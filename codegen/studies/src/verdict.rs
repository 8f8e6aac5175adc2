//! Whether a platform is ready, and the figures that decide: the first lines of `specgen check`, the main command and the report.

mod figure;
mod known;

use serde::Serialize;

use specgen_compiler::assumed::Assumptions;
use specgen_compiler::compile::Compilation;
use specgen_language::diagnostic::Severity;
use specgen_toolchain::budget::{self, group};

use crate::verify::{Inspection, Measurement};

pub use figure::{Figure, Limit, Mark, Subject};

/// Longest line of [`Verdict::text`], in characters.
pub const WIDTH: usize = 80;
/// Names of pose coordinates; neighbouring figures share a group in a line.
const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
/// Largest gain ratio and largest delay (ticks) searched.
const LOOKED_AT: [f64; 2] = [10.0, 5.0];
/// Name of the figure for error limits that no run was compared with.
const NOT_SIMULATED: &str = "not simulated";

/// Whether this platform may be run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// Every figure is within its limit.
    Ready,
    /// Yes so far: time, memory or bits are not measured, or errors with limits not simulated.
    NotMeasured,
    /// A figure exceeds its limit.
    NotReady,
}

/// Whether a platform is ready, and the figures that decide.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Name of the platform.
    pub name: String,
    /// SHA-256 of spec and records.
    pub digest: String,
    /// The answer.
    pub answer: Answer,
    /// Number of warnings about the spec.
    pub warnings: usize,
    /// Unmeasured values that the figures rest on. They do not change the answer, but a real machine accepts the controller only if its user does.
    pub assumed: Assumptions,
    /// In the order of [`Subject::ALL`].
    pub figures: Vec<Figure>,
    /// Why time, memory or bits are not measured, if so.
    pub unmeasured: Option<String>,
    /// Suggested next commands.
    pub next: Vec<String>,
}

impl Verdict {
    /// The verdict on a compiled spec before it is built. `unmeasured`: why it is not.
    pub fn of(compiled: &Compilation, unmeasured: &str) -> Self {
        let warnings = compiled.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
        let mut verdict = Self {
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            answer: Answer::NotMeasured,
            warnings,
            assumed: compiled.assumptions.clone(),
            figures: Vec::new(),
            unmeasured: Some(unmeasured.to_owned()),
            next: Vec::new(),
        };
        known::figures(compiled).for_each(|figure| verdict.push(figure));
        verdict
    }

    /// Adds a figure and updates the answer. A simulated error replaces the entry for unsimulated ones.
    pub fn push(&mut self, figure: Figure) {
        if figure.subject == Subject::Tracking {
            self.figures.retain(|one| one.name != NOT_SIMULATED);
        }
        let order = |subject: Subject| Subject::ALL.iter().position(|one| *one == subject);
        let place = self.figures.partition_point(|one| order(one.subject) <= order(figure.subject));
        self.figures.insert(place, figure);
        self.judge();
    }

    /// Adds the results of a run on the emulated machine.
    pub fn measured(&mut self, compiled: &Compilation, measurement: &Measurement) {
        self.unmeasured = None;
        self.inspected(compiled, measurement);
        if let Some(step) = measurement.stage("step") {
            self.push(Figure::new(Subject::Time, "longest tick", step.max as f64, "instructions"));
        }
        if let Some(time) = &measurement.time {
            let figure = Figure::new(Subject::Time, "longest tick of the board, modelled", time.worst, "us");
            self.push(figure.at_most(time.period, "timing.period"));
        }
        let machine = &measurement.machine;
        let (words, good) = match &measurement.first_difference {
            None => (format!("host and {machine} agree in every bit over {} ticks", group(measurement.ticks)), true),
            Some(difference) => (format!("host and {machine} DIFFER: {difference}"), false),
        };
        self.push(Figure::fact(Subject::Bits, "host and microcontroller", words, good));
    }

    /// Adds the results of inspecting an image that was not run, for the reason in [`Verdict::unmeasured`].
    pub fn inspected(&mut self, compiled: &Compilation, inspection: &Inspection) {
        for held in budget::usage_lines(&compiled.model.target, &inspection.used) {
            let (subject, unit) =
                if held.what == "instructions" { (Subject::Time, "instructions") } else { (Subject::Memory, "bytes") };
            let figure = Figure::new(subject, held.what, held.used as f64, unit);
            self.push(match held.most {
                Some((most, from)) => figure.at_most(most as f64, &from),
                None => figure,
            });
        }
        if inspection.used.stack.is_none() {
            let words = "the tick's stack is unbounded".to_owned();
            self.push(Figure::fact(Subject::Memory, "stack", words, compiled.model.target.budget.stack.is_none()));
        }
        for fault in &inspection.checks.faults {
            self.push(Figure::fact(Subject::Memory, "image", fault.text.clone(), false));
        }
    }

    fn judge(&mut self) {
        self.answer = if self.beyond().next().is_some() {
            Answer::NotReady
        } else if self.unmeasured.is_some() || self.figures.iter().any(|one| one.name == NOT_SIMULATED) {
            Answer::NotMeasured
        } else {
            Answer::Ready
        };
    }

    /// The figures that exceed their limits.
    pub fn beyond(&self) -> impl Iterator<Item = &Figure> {
        self.figures.iter().filter(|figure| figure.mark == Mark::Beyond)
    }

    /// The answer as a sentence.
    pub fn headline(&self) -> String {
        let name = &self.name;
        let kept = match self.figures.iter().filter(|figure| figure.mark == Mark::Within).count() {
            0 => "no figure has a limit".to_owned(),
            1 => "1 limit kept".to_owned(),
            many => format!("{many} limits kept"),
        };
        let record = self
            .assumed
            .records()
            .map(|records| if self.assumed.simulated.len() == 1 { format!("a {records}") } else { records });
        let on = self.assumed.count().or(record).map_or_else(String::new, |assumed| format!(" on {assumed}"));
        let warnings = match self.warnings {
            0 => String::new(),
            1 => ", 1 warning".to_owned(),
            many => format!(", {many} warnings"),
        };
        match self.answer {
            Answer::Ready => format!("{name} is ready{on}: {kept}{warnings}"),
            Answer::NotMeasured => format!("{name} is good so far{on}: {kept}{warnings}"),
            Answer::NotReady => {
                let beyond: Vec<&Figure> = self.beyond().collect();
                let reasons: Vec<String> = beyond.chunk_by(share_a_group).map(reason).collect();
                format!("{name} is NOT ready: {}{warnings}", reasons.join(", "))
            }
        }
    }

    /// The figures of a subject, in one line; `None` if there are none.
    pub fn line(&self, subject: Subject) -> Option<String> {
        let figures: Vec<&Figure> = self.figures.iter().filter(|figure| figure.subject == subject).collect();
        let groups: Vec<&[&Figure]> = figures.chunk_by(share_a_group).collect();
        // Neighbours with the same unit and measured part show these once.
        let alike = |a: &Figure, b: &Figure| a.unit == b.unit && a.coverage == b.coverage;
        let runs = groups.chunk_by(|a, b| alike(a[0], b[0]) && a[0].words.is_none() && b[0].words.is_none());
        let parts: Vec<String> = runs
            .map(|run| {
                let text = run.iter().map(|group| group_text(group)).collect::<Vec<_>>().join(", ");
                let unit = if run[0][0].unit == "bytes" { "KiB" } else { run[0][0].unit };
                let text = if unit.is_empty() || text.contains(unit) { text } else { format!("{text} {unit}") };
                run[0][0].coverage.map_or(text.clone(), |coverage| format!("{text} over {}", coverage.brief()))
            })
            .collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// At most ten lines of at most [`WIDTH`] characters, eleven with limits on errors: the answer, one line per subject, assumptions, and
    /// next commands.
    pub fn text(&self) -> String {
        let mut lines = vec![self.headline()];
        let known = |subject: &Subject| self.line(*subject).map(|line| format!("  {:<9}{line}", subject.name()));
        lines.extend(Subject::ALL.iter().filter_map(known));
        if !self.assumed.summary().is_empty() {
            lines.push(format!("  {:<9}{}", "assumed", self.assumed.summary().replace(" assumed value", " value")));
        }
        if let Some(why) = &self.unmeasured {
            lines.push(format!("  {:<9}{why}", "skipped"));
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
        lines.iter().map(|line| format!("{}\n", shorten(line))).collect()
    }
}

fn is_axis(figure: &Figure) -> bool {
    AXES.contains(&figure.name.as_str())
}

/// Whether neighbours are coordinates to be written as one group.
fn share_a_group(a: &&Figure, b: &&Figure) -> bool {
    let both = is_axis(a) && is_axis(b) && a.subject == b.subject;
    both && a.unit == b.unit && a.relation() == b.relation() && a.words == b.words
}

/// Exceeded limits as a reason: `flash 68.4 > 64`, `noise x/y 6.1/5.4 > 5/5 nm`.
fn reason(group: &[&Figure]) -> String {
    let first = group[0];
    if first.words.is_some() {
        return first.subject.name().to_owned();
    }
    if !is_axis(first) {
        return group_text(group);
    }
    let names: Vec<&str> = group.iter().map(|figure| figure.name.as_str()).collect();
    format!("{} {} {} {}", first.subject.name(), names.join("/"), group_text(group), first.unit)
}

/// Shortens a line that is too long, between two figures; the details contain all of it.
fn shorten(line: &str) -> String {
    const MORE: &str = ", …";
    if line.chars().count() <= WIDTH {
        return line.to_owned();
    }
    let ends = line.match_indices(", ").map(|(at, _)| &line[..at]);
    let whole = ends.take_while(|part| part.chars().count() + MORE.chars().count() <= WIDTH).last();
    let letters = || line.chars().take(WIDTH - 2).chain(" …".chars()).collect();
    whole.map_or_else(letters, |part| format!("{part}{MORE}"))
}

/// One figure, or neighbouring coordinates: `54.9/52.4/73.7 ≥ 50/50/52 µm`.
fn group_text(group: &[&Figure]) -> String {
    let first = group[0];
    if let Some(words) = &first.words {
        return words.clone();
    }
    let list = |of: &dyn Fn(&Figure) -> String| group.iter().map(|figure| of(figure)).collect::<Vec<_>>().join("/");
    let mut text = if is_axis(first) { String::new() } else { format!("{} ", first.name) };
    text += &list(&Figure::value_text);
    if let Some(relation) = first.relation() {
        text += &format!(" {relation} {}", list(&Figure::limit_text));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_sim::coverage::Coverage;

    fn empty() -> Verdict {
        Verdict {
            name: "bench".to_owned(),
            digest: String::new(),
            answer: Answer::NotMeasured,
            warnings: 1,
            assumed: Assumptions::default(),
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
        for (name, value, ticks) in [("case-1 xyz", 20.7, 25_000), ("case-1 z", 3.0, 25_000), ("line", 78.6, 10_000)] {
            let figure = Figure::new(Subject::Tracking, name, value, "nm").over(Coverage::new(ticks, ticks, 1e-4));
            verdict.push(figure);
        }
        assert_eq!(
            verdict.text(),
            "bench is ready: 5 limits kept, 1 warning\n\
             \x20 reach    54.9/52.4/174 ≥ 50/50/50 µm, 421 ≥ 400 µrad\n\
             \x20 margins  delay > 5 ticks\n\
             \x20 tracking case-1 xyz 20.7, case-1 z 3.00 nm over 2.500/2.500 s, …\n\
             \x20 time     instructions 4,043 ≤ 4,500\n\
             \x20 next     specgen sim bench.toml\n"
        );
    }

    #[test]
    fn one_exceeded_limit_is_enough() {
        let mut verdict = empty();
        verdict.push(Figure::new(Subject::Memory, "flash", 70_000.0, "bytes").at_most(65_536.0, "spec"));
        verdict.push(Figure::new(Subject::Memory, "RAM", 70.0, "bytes").at_most(70.0, "spec"));
        assert_eq!(verdict.answer, Answer::NotReady);
        assert_eq!(verdict.headline(), "bench is NOT ready: flash 68.4 > 64, 1 warning");
        assert_eq!(verdict.line(Subject::Memory).unwrap(), "flash 68.4 > 64, RAM 0.07 ≤ 0.07 KiB");
        for (axis, value) in [("x", 6.1), ("y", 5.4), ("z", 4.0)] {
            verdict.push(Figure::new(Subject::Noise, axis, value, "nm").at_most(5.0, "spec"));
        }
        assert_eq!(verdict.headline(), "bench is NOT ready: noise x/y 6.10/5.40 > 5/5 nm, flash 68.4 > 64, 1 warning");
        let more = Figure::more_than(Subject::Margins, "λ", 10.0, "");
        assert_eq!(more.clone().at_least(1.1, "spec").mark, Mark::Within);
        assert_eq!(more.at_most(20.0, "spec").mark, Mark::Beyond);
    }

    #[test]
    fn assumptions_are_counted_in_the_headline_and_listed() {
        let mut verdict = empty();
        verdict.next.clear();
        verdict.unmeasured = None;
        verdict.push(Figure::new(Subject::Noise, "x", 2.7, "nm").at_most(5.0, "spec"));
        let of = |values: usize, simulated: usize| Assumptions {
            values: vec![String::new(); values],
            simulated: vec![String::new(); simulated],
            unidentified: false,
        };
        for (assumed, headline, line) in [
            (
                of(13, 1),
                "bench is ready on 13 assumed values: 1 limit kept, 1 warning",
                "13 values, simulated leg record",
            ),
            (of(1, 0), "bench is ready on 1 assumed value: 1 limit kept, 1 warning", "1 value"),
            (of(0, 1), "bench is ready on a simulated leg record: 1 limit kept, 1 warning", "simulated leg record"),
            (of(0, 6), "bench is ready on 6 simulated leg records: 1 limit kept, 1 warning", "6 simulated leg records"),
            (
                Assumptions { unidentified: true, ..of(0, 0) },
                "bench is ready on unidentified legs: 1 limit kept, 1 warning",
                "unidentified legs",
            ),
        ] {
            verdict.assumed = assumed;
            assert_eq!(verdict.text(), format!("{headline}\n  noise    2.70 ≤ 5 nm\n  assumed  {line}\n"));
        }
        verdict.assumed = Assumptions::default();
        assert_eq!(verdict.text(), "bench is ready: 1 limit kept, 1 warning\n  noise    2.70 ≤ 5 nm\n");
    }

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let mut verdict = empty();
        verdict.push(Figure::fact(Subject::Bits, "bits", "they DIFFER ".repeat(20), false));
        verdict.unmeasured = Some("µ".repeat(100));
        assert!(verdict.text().lines().all(|line| line.chars().count() <= WIDTH), "{}", verdict.text());
    }
}
