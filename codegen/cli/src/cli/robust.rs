//! `specgen robust`: corners and random draws of declared uncertainties, quantiles of the error, a gate for builds; in parts on
//! many computers, which `specgen robust merge` puts together.

mod merge;
mod report;
mod work;

use std::path::Path;
use std::time::Instant;

use clap::{Args, Subcommand};
use serde_json::json;

use super::learn::{NOWHERE, takes_correction};
use super::named::{InputFile, OutputFolder};
use super::plot::Plot;
use super::sim::{PlantArguments, at_run_time, frequency};
use super::spec;
use super::trajectory;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, claim, write_folder};
use specgen_language::spec::quantity::{self, Dimension};
use specgen_language::ui::Ui;
use specgen_report::learning::BANDWIDTH;
use specgen_studies::machine::run_failure;
use specgen_studies::robust::factors::UserRange;
use specgen_studies::robust::{Factors, Learning, Member, Outcome, Plan, Shard, Study};
use work::{Part, Ran, Work};

/// Lines of progress of a run whose output is not looked at.
const LINES: usize = 20;

/// Arguments of `robust`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "specgen robust [OPTIONS] <SPEC>\n       specgen robust merge [OPTIONS] <PART>...",
    after_help = super::examples::ROBUST
)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Option<Kind>,
    #[command(flatten)]
    study: StudyArguments,
}

#[derive(Subcommand, Debug)]
enum Kind {
    /// Put the parts of a study together that were run with --shard; the report is that of a single run, byte for byte.
    Merge(merge::Arguments),
}

/// Arguments of a study, or of a part of one.
#[derive(Args, Debug)]
struct StudyArguments {
    /// The spec file.
    #[arg(required = true)]
    spec: Option<InputFile>,
    /// Random machines, besides the corners.
    #[arg(long = "draws", value_name = "N", alias = "samples", default_value_t = 100, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    draws: u32,
    /// Range of an uncertainty, in place of that of [robust] or the default: `mass=5%`, `gain=0.9:1.1`, `delay_ticks=1`.
    /// Of mass, stiffness, damping, gain, hysteresis, creep, lag, noise (factors) and delay_ticks.
    #[arg(long, value_name = "NAME=RANGE", value_parser = UserRange::parse)]
    vary: Vec<UserRange>,
    /// What is followed: case-1, case-2, machining or multisine, or a trajectory of the spec by its name; without
    /// [control] leg or multisine. The first of them if not given.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Operating frequency of the paper's trajectory or highest of the multisine, Hz; 10 if not given. A trajectory of the
    /// spec has its own.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Run one machine alone: the seed of a draw, or the name of a corner.
    #[arg(long, value_name = "SEED|NAME")]
    replay: Option<String>,
    /// Gate: largest rms error of the translation, or of legs, such as "30 nm"; that of [robust] if not given.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    max_error: Option<f64>,
    /// Gate: largest rms error of the angles, such as "100 nrad"; for a spec with [control].
    #[arg(long, value_name = "ANGLE", value_parser = angle, allow_hyphen_values = true)]
    max_orientation: Option<f64>,
    /// Learn the motion on each machine, from so many passes, and show what is left; for a spec with control.correction.
    #[arg(long, value_name = "PASSES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1000))]
    learn: Option<u32>,
    /// Gate: largest rms error of the translation once learned, such as "6 nm", that of [robust] if not given; learning must grow on no machine, either.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true, requires = "learn")]
    max_learned: Option<f64>,
    /// Quantile of the draws that the gate compares, %; the largest of draws and corners if not given.
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    quantile: Option<f64>,
    /// Error beyond which a run counts as diverged; 5 % of the stroke if not given.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    diverged_above: Option<f64>,
    /// Worker threads; as many as the machine has if not given. The result does not depend on it.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Run one part of N alone, I from 1 to N, and write it into the file of -o, for `specgen robust merge`. No gate is
    /// judged.
    #[arg(long, value_name = "I/N", value_parser = Shard::parse, requires = "output", conflicts_with_all = ["replay", "plot"])]
    shard: Option<Shard>,
    /// Write runs (CSV) and report (JSON) here; with --shard the name of one file.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

fn measure(text: &str, dimension: Dimension, unit: &str) -> Result<f64, String> {
    let found = quantity::parse(text).ok().filter(|found| found.dimension == dimension && found.value > 0.0);
    found
        .map(|found| found.value)
        .ok_or_else(|| format!("expected a quantity above zero in the form \"<number> {unit}\", found `{text}`"))
}

fn length(text: &str) -> Result<f64, String> {
    measure(text, Dimension::LENGTH, "nm")
}

fn angle(text: &str) -> Result<f64, String> {
    measure(text, Dimension::ANGLE, "nrad")
}

fn percent(text: &str) -> Result<f64, String> {
    let found = text.trim().trim_end_matches('%').trim().parse().ok().filter(|x| *x > 0.0 && *x <= 100.0);
    found.ok_or_else(|| format!("expected a percentage above 0, up to 100, found `{text}`"))
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    match &arguments.kind {
        Some(Kind::Merge(arguments)) => merge::run(arguments, ui),
        None => study(&arguments.study, ui),
    }
}

fn study(arguments: &StudyArguments, ui: &mut Ui) -> Result<(), Failure> {
    let begun = Instant::now();
    let Some(path) = &arguments.spec else {
        return Err(Failure::Usage("a spec file is expected, or merge".to_owned()));
    };
    let leg = arguments.plant.leg()?;
    let compiled = spec::compiled(path, ui)?;
    let followed =
        trajectory::chosen(arguments.trajectory.as_deref(), arguments.frequency, arguments.plant.seed, &compiled)?;
    let factors = Factors::of(&compiled.model, &arguments.vary);
    let learning = match arguments.learn {
        Some(passes) => {
            takes_correction(&compiled)?;
            let learning =
                Learning::of(&compiled, &followed.choice, &factors, BANDWIDTH, passes).map_err(run_failure)?;
            Some(learning.ok_or_else(|| Failure::Gate(NOWHERE.to_owned()))?)
        }
        None => None,
    };
    let work = Work::of(arguments, path, &compiled, &followed, &leg, learning.as_ref())?;
    let whole = match &arguments.replay {
        Some(name) => Plan::alone(&work.factors, name, work.seed).map_err(Failure::Usage)?,
        None => work.plan(),
    };
    let plan = arguments.shard.map_or_else(|| whole.clone(), |shard| shard.of(&whole));
    let threads = arguments.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let _claimed = match (&arguments.output, arguments.shard) {
        (Some(file), Some(_)) => check_place(file).map(|()| None)?,
        (folder, _) => folder.as_deref().map(claim).transpose()?,
    };
    arguments.plot.wanted()?;
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
    // The machines that are done make a result.
    let stop = interrupt::heed();
    let all = plan.members.len();
    let started = Instant::now();
    let mut shown = 0;
    let runs = study.run_all(&plan, threads, stop, |done| {
        let lines = done * LINES / all;
        if lines > shown || ui.is_terminal() {
            shown = lines;
            let elapsed = started.elapsed().as_secs_f64();
            let left = elapsed * (all - done) as f64 / done as f64;
            let rate = done as f64 / elapsed.max(1e-9);
            ui.rate(&format!("robust: {done} of {all} machines, {rate:.1} a second, {left:.0} s left"));
        }
    });
    ui.rate_done();
    let runs = runs.map_err(run_failure)?;
    if let (Some(shard), Some(file)) = (arguments.shard, &arguments.output) {
        if runs.len() < all {
            // A part is whole or not there.
            return Err(Failure::interrupted());
        }
        Part { shard, planned: whole.members.len(), work, runs: runs.into_iter().map(Ran::from).collect() }
            .write(file, ui)?;
        ui.progress(&format!("{:.1} s in all", begun.elapsed().as_secs_f64()));
        return Ok(());
    }
    let results = Results { output: arguments.output.as_deref(), plot: &arguments.plot };
    results.put(&work, arguments.replay.is_some(), all, &runs, ui, || {
        ui.progress(&format!("{:.1} s in all", begun.elapsed().as_secs_f64()));
    })
}

/// Where a report goes.
struct Results<'a> {
    output: Option<&'a Path>,
    plot: &'a Plot,
}

impl Results<'_> {
    /// Writes and shows what `runs` of `planned` machines found; `alone` if it was one that was named. `last` is called
    /// before the report is shown.
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
        let found = report::Found { work, gate: &gate, reasons: &reasons, alone, planned, runs };
        let report = found.report();
        let below = "rms error by share of the machines";
        if let Some(line) = self.plot.charts(&work.name, below, &found.charts())? {
            ui.progress(line.trim_end());
        }
        if let Some(folder) = self.output {
            let files = [
                ("runs.csv".to_owned(), found.csv().into_bytes()),
                ("report.json".to_owned(), format!("{:#}\n", json!(report)).into_bytes()),
            ];
            write_folder(folder, &files)?;
            ui.progress(&format!("wrote {} files to {}", files.len(), folder.display()));
        }
        last();
        if runs.len() < planned {
            let message =
                format!("interrupted: the figures are of {} of {planned} machines, and no gate is passed", runs.len());
            return Err(Failure::Interrupted { message, result: ui.shown(&report) });
        }
        ui.judged(&report, (!reasons.is_empty()).then(|| format!("not robust: {}", reasons.join("; "))))
    }
}
