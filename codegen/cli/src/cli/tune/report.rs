//! What tuning found, as text and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::super::sim::environment;
use super::super::ui::Failure;
use super::Job;
use super::start::Starts;
use specgen_compiler::compile::Compiled;
use specgen_compiler::stability::platform::{Adapting, Conditions, Law, ModeMargins};
use specgen_compiler::stability::{LegDynamics, phase_margin, transition};
use specgen_language::model::{AdaptationMode, ControlMode};
use specgen_studies::tuning::feasible::Feasibility;
use specgen_studies::tuning::{Case, Evaluation, Score, Search, Setting};

/// Axes in messages.
const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];

/// One setting with what it does on both cases.
struct Row {
    name: &'static str,
    setting: Setting,
    /// Whether it holds the margins.
    holds: bool,
    tuned_on: Evaluation,
    other: Evaluation,
}

/// Margins of the result.
struct Margins {
    gain: Option<f64>,
    phase_degrees: Option<f64>,
    delay_ticks: Option<f64>,
}

/// See the module.
pub(super) struct Report {
    rows: Vec<Row>,
    head: String,
    tail: String,
    patch: String,
    value: Value,
}

impl Report {
    #[expect(clippy::too_many_arguments, reason = "everything that was found, once")]
    pub(super) fn of(
        job: &Job,
        case: &Case,
        other: &Case,
        settings: &[(&'static str, Setting)],
        starts: &Starts,
        searches: &[(&'static str, Search)],
        tuned: &Compiled,
        patch: &str,
    ) -> Result<Self, Failure> {
        let (mut here, mut there) = (case.worker(), other.worker());
        let mut rows = Vec::new();
        for &(name, setting) in settings {
            rows.push(Row {
                name,
                setting,
                holds: job.feasibility.holds(&setting),
                tuned_on: case.run(&mut here, &setting).map_err(environment)?,
                other: other.run(&mut there, &setting).map_err(environment)?,
            });
        }
        let margins = margins_of(job, tuned);
        let mut head = String::new();
        for (name, search) in searches {
            let (unstable, limited) =
                search.history.iter().fold((0, 0), |(a, b), one| (a + one.unstable, b + one.limited));
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                head,
                "{name}: {} candidates, {} simulated ({:.0} s of machine time), {unstable} unstable or without the margins, {limited} at a limit; best cost {}",
                search.evaluations,
                search.runs,
                search.runs as f64 * case.seconds(),
                search.best().map_or("none".to_owned(), |best| format!("{:.5} µm s²", best.score.cost))
            );
        }
        if let Some(ultimate) = &starts.ultimate {
            head.push_str("relay with the notch in:");
            for (axis, found) in AXES.iter().zip(ultimate) {
                let _ = match found {
                    Some(u) => write!(head, "  {axis} {:.2} K at {:.0} Hz", u.gain, 1.0 / u.period),
                    None => write!(head, "  {axis} none"),
                };
            }
            head.push('\n');
        }
        let or = |value: Option<f64>, none: &str| value.map_or(none.to_owned(), |value| format!("{value:.2}"));
        let delay = if job.compiled.model.task_space.is_some() {
            format!("{} ticks", or(margins.delay_ticks, "> 5"))
        } else {
            "not looked at".to_owned()
        };
        let mut tail = format!(
            "margins of the result: gain × {}, phase {}°, delay {delay}\n",
            or(margins.gain, "> 30 or up to a weight of 1"),
            margins.phase_degrees.map_or("> 180".to_owned(), |degrees| format!("{degrees:.1}"))
        );
        for parameter in &job.space.parameters {
            if let Some(row) = rows.last() {
                let _ = write!(tail, "  {} {:.4e}", parameter.role, job.space.value(&row.setting, parameter.role));
            }
        }
        tail.push('\n');
        if job.compiled.model.task_space.is_some() {
            tail.push_str("(kp, ki, kv over the stiffness of their axis)\n");
        }
        let value = json!({
            "name": job.compiled.ir.name,
            "seed": job.arguments.plant.seed,
            "tuned_on": job.tuned_on(),
            "scored_on": job.scored_on(),
            "parameters": job.space.parameters.iter().map(|p| json!({ "name": p.role.to_string(), "bounds": p.bounds })).collect::<Vec<_>>(),
            "relay": starts.ultimate,
            "settings": rows.iter().map(|row| json!({
                "name": row.name,
                "holds_margins": row.holds,
                "setting": row.setting,
                "tuned_on": row.tuned_on,
                "scored_on": row.other,
            })).collect::<Vec<_>>(),
            "margins": { "gain": margins.gain, "phase_degrees": margins.phase_degrees, "delay_ticks": margins.delay_ticks },
            "searches": searches.iter().map(|(name, search)| json!({
                "optimiser": name,
                "evaluations": search.evaluations,
                "runs": search.runs,
                "interrupted": search.interrupted,
                "best": search.best(),
                "history": search.history,
            })).collect::<Vec<_>>(),
            "patch": patch,
        });
        Ok(Self { rows, head, tail, patch: patch.to_owned(), value })
    }

    pub(super) fn value(&self) -> &Value {
        &self.value
    }

    /// Scores on what was tuned on, by name.
    pub(super) fn marks(&self) -> Vec<(&str, Score)> {
        self.rows.iter().filter_map(|row| Some((row.name, *row.tuned_on.score()?))).collect()
    }

    pub(super) fn text(&self, with_patch: bool) -> String {
        let mut text = self.head.clone();
        let _ = writeln!(
            text,
            "{:<18}{:>44}   {:>34}\n{:<18}{:>9}{:>9}{:>9}{:>9}{:>8}   {:>9}{:>9}{:>9}{:>7}",
            "rms",
            "tuned on",
            "not tuned on",
            "",
            "nm",
            "nrad",
            "peak nm",
            "effort",
            "cost",
            "nm",
            "nrad",
            "peak nm",
            ""
        );
        for row in &self.rows {
            let mark = if row.holds { "" } else { " *" };
            let _ = write!(text, "{:<18}", format!("{}{mark}", row.name));
            match row.tuned_on {
                Evaluation::Scored(s) => {
                    let _ = write!(
                        text,
                        "{:>9.2}{:>9.2}{:>9.1}{:>9.2}{:>8.4}   ",
                        s.translation_nm, s.orientation_nrad, s.peak_nm, s.effort_nm, s.cost
                    );
                }
                Evaluation::Limited { time, .. } => {
                    let _ = write!(text, "{:>44}   ", format!("at a limit after {time:.4} s"));
                }
            }
            let _ = match row.other {
                Evaluation::Scored(s) => {
                    writeln!(text, "{:>9.2}{:>9.2}{:>9.1}", s.translation_nm, s.orientation_nrad, s.peak_nm)
                }
                Evaluation::Limited { time, .. } => writeln!(text, "{:>27}", format!("at a limit after {time:.4} s")),
            };
        }
        if self.rows.iter().any(|row| !row.holds) {
            text.push_str("* without the margins that are asked for\n");
        }
        text.push_str(&self.tail);
        if with_patch {
            text.push('\n');
            text.push_str(&self.patch);
        }
        text
    }
}

/// Margins of the spec's own mode.
fn margins_of(job: &Job, tuned: &Compiled) -> Margins {
    let model = &tuned.model;
    let adapting = match model.adaptation.mode {
        AdaptationMode::Invhys => Adapting::Invhys,
        AdaptationMode::Ewma => Adapting::Ewma,
        AdaptationMode::Pcc => Adapting::Pcc,
    };
    let degrees = |phase: Option<f64>| phase.map(f64::to_degrees);
    if let (Some(task), Some(design), Feasibility::Platform { closed_loop, .. }) =
        (&model.task_space, &tuned.design, &job.feasibility)
    {
        let law = match task.mode {
            ControlMode::P => Law::Position,
            ControlMode::F => Law::Feedforward(adapting),
            ControlMode::PF => Law::Combined(adapting),
        };
        let tuning = if law == Law::Position { &design.position } else { &design.combined };
        let phase = phase_margin(|gain_ratio| {
            closed_loop.transition(law, tuning, &Conditions { gain_ratio, ..Conditions::NOMINAL })
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
