//! Results of tuning as text and as JSON.

use serde::Serialize;

use super::Job;
use super::start::Starts;
use crate::tracking::AXES;
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::{Conditions, ModeMargins};
use specgen_compiler::stability::{LegDynamics, phase_margin, transition};
use specgen_language::model::AdaptationMode;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::table::{left, right, row};
use specgen_studies::machine::run_failure;
use specgen_studies::tuning::feasible::Feasibility;
use specgen_studies::tuning::relay::Ultimate;
use specgen_studies::tuning::search::Generation;
use specgen_studies::tuning::{self, Candidate, Case, Evaluation, Score, Search, Setting, space};

/// A setting and its results on both conditions.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    setting: Setting,
    /// Whether it meets the required margins.
    holds_margins: bool,
    tuned_on: Evaluation,
    scored_on: Evaluation,
}

#[derive(Serialize)]
struct Margins {
    gain: Option<f64>,
    phase_degrees: Option<f64>,
    delay_ticks: Option<f64>,
}

#[derive(Serialize)]
struct Parameter {
    name: String,
    bounds: [f64; 2],
    /// Value in the result, in the unit of the bounds.
    #[serde(skip)]
    value: Option<f64>,
}

#[derive(Serialize)]
struct SearchReport<'a> {
    optimiser: &'static str,
    evaluations: usize,
    runs: usize,
    interrupted: bool,
    best: Option<&'a Candidate>,
    history: &'a [Generation],
}

#[derive(Serialize)]
pub(super) struct Report<'a> {
    name: &'a str,
    seed: u64,
    tuned_on: tuning::Conditions,
    scored_on: tuning::Conditions,
    parameters: Vec<Parameter>,
    relay: &'a Option<[Option<Ultimate>; 6]>,
    settings: Vec<Row>,
    margins: Margins,
    searches: Vec<SearchReport<'a>>,
    patch: &'a str,
    /// Whether the spec has task space.
    #[serde(skip)]
    is_platform: bool,
    /// Duration of a simulated run, s.
    #[serde(skip)]
    seconds: f64,
    /// The patch is shown because it was not written into the spec.
    #[serde(skip)]
    pub(super) with_patch: bool,
}

impl<'a> Report<'a> {
    #[expect(clippy::too_many_arguments, reason = "called once with all results")]
    pub(super) fn of(
        job: &'a Job,
        case: &Case,
        other: &Case,
        settings: &[(&'static str, Setting)],
        starts: &'a Starts,
        searches: &'a [(&'static str, Search)],
        tuned: &Compilation,
        patch: &'a str,
    ) -> Result<Self, Failure> {
        let (mut here, mut there) = (case.worker(), other.worker());
        let mut rows = Vec::new();
        for &(name, setting) in settings {
            rows.push(Row {
                name,
                setting,
                holds_margins: job.feasibility.holds(&setting),
                tuned_on: case.run(&mut here, &setting).map_err(run_failure)?,
                scored_on: other.run(&mut there, &setting).map_err(run_failure)?,
            });
        }
        let result = rows.last().map(|row| row.setting);
        let parameter = |p: &space::Parameter| Parameter {
            name: p.role.to_string(),
            bounds: p.bounds,
            value: result.map(|setting| job.space.value(&setting, p.role)),
        };
        let searched = |(optimiser, search): &'a (&'static str, Search)| SearchReport {
            optimiser,
            evaluations: search.evaluations,
            runs: search.runs,
            interrupted: search.interrupted,
            best: search.best(),
            history: &search.history,
        };
        Ok(Self {
            name: &job.compiled.ir.name,
            seed: job.options.plant.seed,
            tuned_on: job.tuned_on(),
            scored_on: job.scored_on(),
            parameters: job.space.parameters.iter().map(parameter).collect(),
            relay: &starts.ultimate,
            settings: rows,
            margins: margins_of(job, tuned),
            searches: searches.iter().map(searched).collect(),
            patch,
            is_platform: job.compiled.model.task_space.is_some(),
            seconds: case.seconds(),
            with_patch: true,
        })
    }

    /// Scores on the tuning conditions, by name.
    pub(super) fn marks(&self) -> Vec<(&str, Score)> {
        self.settings.iter().filter_map(|row| Some((row.name, *row.tuned_on.score()?))).collect()
    }

    /// Results of the searches and of the relay test.
    fn head(&self, text: &mut String) {
        for search in &self.searches {
            let (unstable, limited) =
                search.history.iter().fold((0, 0), |(a, b), one| (a + one.unstable, b + one.limited));
            let (name, candidates, runs) = (search.optimiser, search.evaluations, search.runs);
            let seconds = search.runs as f64 * self.seconds;
            let best = search.best.map_or("none".to_owned(), |best| format!("{:.5} µm s²", best.score.cost));
            *text += &format!(
                "{name}: {candidates} candidates, {runs} simulated ({seconds:.0} s of machine time), {unstable} unstable or below the margins, {limited} at a limit; best cost {best}\n"
            );
        }
        if let Some(ultimate) = self.relay {
            text.push_str("relay test with notch:");
            for (axis, found) in AXES.iter().zip(ultimate) {
                *text += &match found {
                    Some(u) => format!("  {axis} {:.2} K at {:.0} Hz", u.gain, 1.0 / u.period),
                    None => format!("  {axis} none"),
                };
            }
            text.push('\n');
        }
    }

    fn scores(&self, text: &mut String) {
        let two = [left(18), right(44), right(34).behind("   ")];
        let over = |of: fn(&Row) -> &Evaluation| {
            let score = self.settings.iter().find_map(|row| of(row).score());
            score.map_or_else(String::new, |score| format!(" over {}", score.coverage.brief()))
        };
        let (tuned, other) = (over(|row| &row.tuned_on), over(|row| &row.scored_on));
        row(text, &two, &[&"rms", &format_args!("tuned on{tuned}"), &format_args!("not tuned on{other}")]);
        // Columns of a score; its first three columns again.
        let tuned = format!("{:>9}{:>9}{:>9}{:>9}{:>8}", "nm", "nrad", "peak nm", "effort", "cost");
        let other = format!("{:>9}{:>9}{:>9}{:>7}", "nm", "nrad", "peak nm", "");
        row(text, &two, &[&"", &tuned, &other]);
        let limited = |time: f64| format!("at a limit after {time:.4} s");
        for one in &self.settings {
            let mark = if one.holds_margins { "" } else { " *" };
            let tuned = match one.tuned_on {
                Evaluation::Scored(s) => format!(
                    "{:>9.2}{:>9.2}{:>9.1}{:>9.2}{:>8.4}",
                    s.translation_nm, s.orientation_nrad, s.peak_nm, s.effort_nm, s.cost
                ),
                Evaluation::Limited { time, .. } => limited(time),
            };
            let other = match one.scored_on {
                Evaluation::Scored(s) => {
                    format!("{:>9.2}{:>9.2}{:>9.1}", s.translation_nm, s.orientation_nrad, s.peak_nm)
                }
                Evaluation::Limited { time, .. } => limited(time),
            };
            let two = [left(18), right(44), right(27).behind("   ")];
            row(text, &two, &[&format_args!("{}{mark}", one.name), &tuned, &other]);
        }
        if self.settings.iter().any(|one| !one.holds_margins) {
            text.push_str("* does not meet the required margins\n");
        }
    }

    /// Margins and parameters of the result.
    fn tail(&self, text: &mut String) {
        let or = |value: Option<f64>, none: &str| value.map_or(none.to_owned(), |value| format!("{value:.2}"));
        let Margins { gain, phase_degrees, delay_ticks } = self.margins;
        let delay =
            if self.is_platform { format!("{} ticks", or(delay_ticks, "> 5")) } else { "not checked".to_owned() };
        *text += &format!(
            "margins of the result: gain × {}, phase {}°, delay {delay}\n",
            or(gain, "> 30 or up to a weight of 1"),
            phase_degrees.map_or("> 180".to_owned(), |degrees| format!("{degrees:.1}"))
        );
        for parameter in &self.parameters {
            if let Some(value) = parameter.value {
                *text += &format!("  {} {value:.4e}", parameter.name);
            }
        }
        text.push('\n');
        if self.is_platform {
            text.push_str("(kp, ki, kv relative to the stiffness of their axis)\n");
        }
    }
}

impl Outcome for Report<'_> {
    fn text(&self) -> String {
        let mut text = String::new();
        self.head(&mut text);
        self.scores(&mut text);
        self.tail(&mut text);
        if self.with_patch {
            text.push('\n');
            text.push_str(self.patch);
        }
        text
    }
}

/// Margins in the spec's own mode.
fn margins_of(job: &Job, tuned: &Compilation) -> Margins {
    let model = &tuned.model;
    let degrees = |phase: Option<f64>| phase.map(f64::to_degrees);
    if let (Some(task), Some(design), Feasibility::Platform { corners, .. }) =
        (&model.task_space, &tuned.design, &job.feasibility)
    {
        let (law, tuning) = design.law(model, task);
        let phase = phase_margin(|gain_ratio| {
            corners.closed_loop().transition(law, tuning, &Conditions { gain_ratio, ..Conditions::NOMINAL })
        });
        let found: Option<&ModeMargins> = design.margins.iter().find(|one| one.law == law);
        return Margins {
            gain: found.and_then(|one| one.gain_margin),
            phase_degrees: degrees(phase),
            delay_ticks: found.and_then(|one| one.delay_margin_ticks),
        };
    }
    let adaptation = &model.adaptation;
    let largest = tuned.margins.as_ref().and_then(|margins| margins.largest_level_weight);
    let drift = (adaptation.mode == AdaptationMode::Pcc).then_some(adaptation.drift_weight);
    let dynamics = LegDynamics::of(model);
    let phase = phase_margin(|ratio| transition(&dynamics, adaptation.level_weight, drift, ratio));
    Margins {
        gain: largest.map(|largest| largest / adaptation.level_weight),
        phase_degrees: degrees(phase),
        delay_ticks: None,
    }
}
