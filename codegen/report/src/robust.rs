//! Robustness study: corners and random machines within declared uncertainties, error quantiles, a gate for builds.
//! A study can be split over many computers.

mod figures;
mod work;

use std::path::{Path, PathBuf};
use std::time::Instant;

use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, claim, read_text};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_studies::controllers::{at_run_time, threads};
use specgen_studies::learning::{NOWHERE, takes_correction};
use specgen_studies::machine::{PlantOptions, run_failure};
use specgen_studies::robust::factors::UserRange;
use specgen_studies::robust::{Factors, Learning, Member, Outcome, Plan, Shard, Study, shard};
use specgen_studies::trajectory;

use crate::drawing::{self, Plot};
use crate::learning::BANDWIDTH;
use work::{MemberRun, Part, Work};

/// Number of progress lines without a terminal.
const LINES: usize = 20;

/// Options of a study.
#[derive(Debug)]
pub struct Options {
    /// The spec file.
    pub spec: PathBuf,
    /// Number of random machines, in addition to the corners.
    pub draws: u32,
    /// Ranges that replace those of the spec.
    pub vary: Vec<UserRange>,
    /// Name of the trajectory.
    pub trajectory: Option<String>,
    /// Hz.
    pub frequency: Option<f64>,
    /// A single machine: the seed of a random machine, or the name of a corner.
    pub replay: Option<String>,
    /// Gate for the translation, m.
    pub max_error: Option<f64>,
    /// Gate for the angles, rad.
    pub max_orientation: Option<f64>,
    /// Number of passes from which each machine learns.
    pub learn: Option<u32>,
    /// Gate for the translation after learning, m.
    pub max_learned: Option<f64>,
    /// Quantile of the random machines compared with the gate, %.
    pub quantile: Option<f64>,
    /// Error above which a run has diverged, m.
    pub diverged_above: Option<f64>,
    /// Worker threads.
    pub threads: Option<u32>,
    /// Part of the study to run.
    pub shard: Option<Shard>,
    /// Report folder, or file of a part.
    pub output: Option<PathBuf>,
    /// Plot of the errors.
    pub plot: Plot,
    /// The machine.
    pub plant: PlantOptions,
}

/// Runs a study, or a part of one, writes the requested files and shows the result.
///
/// # Errors
/// The options do not fit the spec, a run fails, a file cannot be written, or the gate fails.
pub fn run(options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let begun = Instant::now();
    let path = &options.spec;
    let leg = options.plant.leg()?;
    let compiled = spec_file::compiled(path, ui)?;
    let followed = trajectory::chosen(options.trajectory.as_deref(), options.frequency, options.plant.seed, &compiled)?;
    let factors = Factors::of(&compiled.model, &options.vary);
    let learning = match options.learn {
        Some(passes) => {
            takes_correction(&compiled)?;
            let learning =
                Learning::of(&compiled, &followed.choice, &factors, BANDWIDTH, passes).map_err(run_failure)?;
            Some(learning.ok_or_else(|| Failure::Gate(NOWHERE.to_owned()))?)
        }
        None => None,
    };
    let work = Work::of(options, path, &compiled, &followed, &leg, learning.as_ref())?;
    let whole = match &options.replay {
        Some(name) => Plan::alone(&work.factors, name, work.seed).map_err(Failure::Usage)?,
        None => work.plan(),
    };
    let plan = options.shard.map_or_else(|| whole.clone(), |shard| shard.of(&whole));
    let threads = threads(options.threads);
    let _claimed = match (&options.output, options.shard) {
        (Some(file), Some(_)) => check_place(file).map(|()| None)?,
        (folder, _) => folder.as_deref().map(claim).transpose()?,
    };
    options.plot.wanted()?;
    let controller = at_run_time(&compiled, ui)?;
    let study = Study {
        compiled: &compiled,
        controller: &controller,
        leg: &leg,
        trajectory: followed.choice,
        learning,
        noise: work.noise,
        bound: work.bound,
    };
    // When interrupted, the completed machines form the result.
    let stop = interrupt::heed();
    let all = plan.members.len();
    let runs = study.run_all(&plan, threads, stop, progress(all, ui));
    ui.rate_done();
    let runs = runs.map_err(run_failure)?;
    if let (Some(shard), Some(file)) = (options.shard, &options.output) {
        if runs.len() < all {
            // A part is complete or not written.
            return Err(Failure::interrupted());
        }
        Part { shard, planned: whole.members.len(), work, runs: runs.into_iter().map(MemberRun::from).collect() }
            .write(file, ui)?;
        ui.progress(&format!("{:.1} s in total", begun.elapsed().as_secs_f64()));
        return Ok(());
    }
    let results = Results { output: options.output.as_deref(), plot: &options.plot };
    results.put(&work, options.replay.is_some(), all, &runs, ui, || {
        ui.progress(&format!("{:.1} s in total", begun.elapsed().as_secs_f64()));
    })
}

/// Merges the parts of a study into the report of a single run.
///
/// # Errors
/// The parts belong to different studies, a file cannot be written, or the gate fails.
pub fn merge(parts: &[impl AsRef<Path>], output: Option<&Path>, plot: &Plot, ui: &Ui) -> Result<(), Failure> {
    plot.wanted()?;
    let mut read = Vec::new();
    for path in parts.iter().map(AsRef::as_ref) {
        let name = path.display().to_string();
        let part = Part::read(&read_text(path)?).map_err(|why| Failure::Gate(format!("`{name}` {why}")))?;
        if let Some((first, other)) = read.first()
            && let Some((what, here, there)) = part.differs(other)
        {
            return Err(Failure::Gate(format!(
                "`{name}` and `{first}` belong to different studies: {what} is {here} here, {there} there"
            )));
        }
        read.push((name, part));
    }
    let Some((_, first)) = read.first() else {
        return Err(Failure::Usage("no parts to merge".to_owned()));
    };
    let work = first.work.clone();
    let plan = work.plan();
    let parts: Vec<shard::Part> = read.into_iter().map(|(name, part)| part.named(name)).collect();
    let runs = shard::merged(&plan, &parts).map_err(Failure::Gate)?;
    // Parts are always run with this controller.
    ui.runs(ControllerForm::RunTime);
    let _claimed = output.map(claim).transpose()?;
    let results = Results { output, plot };
    results.put(&work, false, plan.members.len(), &runs, ui, || {})
}

/// Destination of a report.
struct Results<'a> {
    output: Option<&'a Path>,
    plot: &'a Plot,
}

impl Results<'_> {
    /// Writes and shows the results of `runs` out of `planned` machines; `alone` for a single named machine. Calls `last`
    /// before showing the report.
    fn put(
        &self,
        work: &Work,
        alone: bool,
        planned: usize,
        runs: &[(Member, Outcome)],
        ui: &Ui,
        last: impl FnOnce(),
    ) -> Result<(), Failure> {
        let gate = work.gate(alone);
        let reasons = gate.reasons(runs);
        let found = figures::StudyResult { work, gate: &gate, reasons: &reasons, alone, planned, runs };
        let report = found.report();
        let below = "rms error by share of the machines";
        self.plot.show(&work.name, below, &found.charts(), ui)?;
        if let Some(folder) = self.output {
            let files = [("runs.csv".to_owned(), found.csv().into_bytes()), drawing::json("report.json", &report)];
            drawing::write(folder, &files, ui)?;
        }
        last();
        if runs.len() < planned {
            let message = format!(
                "interrupted: the figures cover {} of {planned} machines, so the gate was not passed",
                runs.len()
            );
            return Err(Failure::Interrupted { message, result: ui.shown(&report) });
        }
        ui.judged(&report, (!reasons.is_empty()).then(|| format!("not robust: {}", reasons.join("; "))))
    }
}

/// Shows how many of `all` machines are done.
fn progress(all: usize, ui: &Ui) -> impl FnMut(usize) {
    let started = Instant::now();
    let mut shown = 0;
    move |done| {
        let lines = done * LINES / all;
        if lines > shown || ui.is_terminal() {
            shown = lines;
            let elapsed = started.elapsed().as_secs_f64();
            let left = elapsed * (all - done) as f64 / done as f64;
            let rate = done as f64 / elapsed.max(1e-9);
            ui.rate(&format!("robust: {done} of {all} machines, {rate:.1} per second, {left:.0} s left"));
        }
    }
}
