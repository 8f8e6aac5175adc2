//! `specgen tune --evaluate`: scores candidates proposed by another program.

use std::collections::BTreeMap;
use std::path::Path;

use host_sim::controller::Controller;
use serde::Serialize;

use super::Job;
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::read_text;
use specgen_language::ui::Ui;
use specgen_studies::machine::run_failure;
use specgen_studies::tuning::search::{Verdict, evaluate};
use specgen_studies::tuning::{self, Evaluation, Setting, Space};

/// The candidates in a file; all names and numbers are checked before any is run.
pub(super) fn read(file: &Path, space: &Space) -> Result<Vec<Setting>, Failure> {
    let shown = file.display();
    let text = read_text(file)?;
    let asked: Vec<BTreeMap<String, f64>> = serde_json::from_str(&text).map_err(|error| {
        Failure::Gate(format!("`{shown}`: expected an array of objects such as [{{\"level\": 0.2}}]: {error}"))
    })?;
    let one = |(index, values)| {
        space.named(values).map_err(|why| Failure::Gate(format!("`{shown}`: candidate {index}, from 0: {why}")))
    };
    asked.iter().enumerate().map(one).collect()
}

/// A parameter of candidates.
#[derive(Serialize)]
struct Parameter {
    name: String,
    bounds: [f64; 2],
    /// Value in the spec.
    spec: f64,
}

/// A candidate as run: rounded to the digits of a spec.
#[derive(Serialize)]
struct Candidate {
    values: BTreeMap<String, f64>,
    /// Cost minimised by a search, µm s²; `None` for a rejected candidate.
    cost: Option<f64>,
    verdict: Verdict,
}

#[derive(Serialize)]
struct EvaluationReport<'a> {
    name: &'a str,
    digest: &'a str,
    seed: u64,
    tuned_on: tuning::Conditions,
    parameters: Vec<Parameter>,
    /// In the order of the file.
    candidates: Vec<Candidate>,
}

pub(super) fn run(job: &Job, asked: &[Setting], ui: &Ui) -> Result<(), Failure> {
    let own = Setting::of(&job.compiled);
    let value = |setting: &Setting| -> BTreeMap<String, f64> {
        let parameters = job.space.parameters.iter();
        parameters.map(|one| (one.role.to_string(), job.space.value(setting, one.role))).collect()
    };
    let mut candidates = Vec::new();
    if !asked.is_empty() {
        ui.progress("preparing the machine: pre-cycle, settling, arming");
        let case = job.case(&own, &job.tuned_on())?;
        let mut workers: Vec<Controller> = (0..job.threads.clamp(1, asked.len())).map(|_| case.worker()).collect();
        let settings: Vec<&Setting> = asked.iter().collect();
        let verdicts = evaluate(&settings, &job.feasibility, &case, &mut workers, interrupt::heed());
        for (setting, verdict) in asked.iter().zip(verdicts) {
            // An incomplete list is not a valid result.
            let Some(verdict) = verdict else { return Err(Failure::interrupted()) };
            let verdict = verdict.map_err(run_failure)?;
            let cost = match verdict {
                Verdict::Run(Evaluation::Scored(score)) => Some(score.cost),
                _ => None,
            };
            candidates.push(Candidate { values: value(setting), cost, verdict });
        }
    }
    let parameters = job.space.parameters.iter().map(|one| Parameter {
        name: one.role.to_string(),
        bounds: one.bounds,
        spec: job.space.value(&own, one.role),
    });
    ui.result(&EvaluationReport {
        name: &job.compiled.ir.name,
        digest: &job.compiled.ir.digest,
        seed: job.options.plant.seed,
        tuned_on: job.tuned_on(),
        parameters: parameters.collect(),
        candidates,
    });
    Ok(())
}

impl Outcome for EvaluationReport<'_> {
    fn text(&self) -> String {
        let mut text = String::new();
        text.extend(self.parameters.iter().map(|Parameter { name, bounds: [low, high], spec }| {
            format!("{name:<8} {low:.3e} to {high:.3e}, {spec:.3e} in the spec\n")
        }));
        for (index, Candidate { verdict, .. }) in self.candidates.iter().enumerate() {
            let score = match verdict {
                Verdict::Unstable => "unstable, or margins not met".to_owned(),
                Verdict::Run(Evaluation::Limited { time, .. }) => format!("at a limit after {time:.4} s"),
                Verdict::Run(Evaluation::Scored(score)) => {
                    let (cost, translation) = (score.cost, score.translation_nm);
                    let (orientation, effort) = (score.orientation_nrad, score.effort_nm);
                    let coverage = score.coverage.brief();
                    format!(
                        "cost {cost:.5} µm s², {translation:.2} nm rms, {orientation:.2} nrad rms, effort {effort:.2} nm over {coverage}"
                    )
                }
            };
            text += &format!("candidate {index}: {score}\n");
        }
        text
    }
}
