//! `specgen commission`: identifies a wired machine with its own converters, step by step, writes its spec, and verifies it.

use std::sync::Arc;

use clap::Args;
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;
use specgen_language::model::LegModelKind;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::commission::{self, Options, Step};

use super::identify::model;
use super::line::Line;
use super::number::number;
use super::path_roles::{InputFile, OutputFolder};

/// Arguments of `commission`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::COMMISSION)]
pub struct Arguments {
    /// The spec of the controller that the machine runs: at first your draft, for `acceptance` the one that the step `spec`
    /// wrote.
    spec: InputFile,
    #[command(flatten)]
    line: Line,
    /// Folder for records and results. An interrupted commissioning continues from it.
    #[arg(short, long, value_name = "DIR", default_value = "commission")]
    output: OutputFolder,
    /// Do only this step: wiring, response, cross-talk, curves, identify, spec or acceptance. May be repeated.
    #[arg(long, value_name = "STEP", value_parser = Step::parse)]
    step: Vec<Step>,
    /// Repeat all steps, or those of --step. Their records are replaced, and later steps that depend on them are to be done
    /// again.
    #[arg(long)]
    again: bool,
    /// Skip a step, such as curves="identified before". The page of results, commission.md, shows the reason.
    #[arg(long, value_name = "STEP=REASON", value_parser = Step::parse_skip)]
    skip: Vec<(Step, String)>,
    /// Number of reversal curves for each leg; 32 if not given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(4..=128))]
    grid: Option<u16>,
    /// Frequency of the mains, Hz; 50 if not given.
    #[arg(long, value_name = "HZ", value_parser = number("Hz", "a frequency from 10 to 100 Hz", 10.0..=100.0), allow_negative_numbers = true)]
    mains: Option<f64>,
    /// Leg model: preisach, bouc-wen, generalized-plays, plays, bouc-wen-plays; or auto: for each leg
    /// the simplest of these whose error on its record of a random motion is within 10 % of the smallest.
    #[arg(long, value_name = "MODEL", value_parser = model, default_value = "auto")]
    model: LegModelKind,
    /// Name or serial number of the machine, for commission.md.
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    /// Print what the machine would do and for how long, and send nothing.
    #[arg(long, conflicts_with = "yes")]
    plan: bool,
    /// Begin without asking.
    #[arg(long)]
    yes: bool,
    /// Move nothing: compute the figures again from the records, and write commission.md again.
    #[arg(long, conflicts_with_all = ["plan", "yes", "step", "again", "skip", "learn"])]
    report: bool,
    /// Measure response, gains and noise again, in two minutes, and say what has changed since the commissioning; exit code 1 if
    /// anything has.
    #[arg(long, conflicts_with_all = ["plan", "step", "again", "skip", "report", "write"])]
    check: bool,
    /// Edit the spec in place, instead of writing platform.toml into the folder of the records.
    #[arg(long)]
    write: bool,
    /// After acceptance, learn the trajectories of the spec on the machine, as `specgen learn` does.
    #[arg(long)]
    learn: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let options = options!(arguments => Options {
        again skip mains model machine plan yes report write check learn;
        spec: arguments.spec.to_path_buf(), output: arguments.output.to_path_buf(), steps: arguments.step.clone(),
        grid: arguments.grid.map(usize::from), stop: Arc::default(),
    });
    let line = arguments.line.is_named().then(|| arguments.line.end()).transpose()?;
    let compiled = spec_file::looked_up(&arguments.spec, ui)?;
    run_with_page(line, &options, &compiled, ui)
}

/// Commissions, and shows the page of the folder in HTML, too, however it ended.
pub fn run_with_page(
    line: Option<specgen_operate::Line<'_>>,
    options: &Options,
    compiled: &Compilation,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let done = commission::run(line, options, compiled, ui);
    if !options.plan && !matches!(done, Err(Failure::Usage(_) | Failure::Refused(_))) {
        specgen_report::commission::write(&options.output)?;
    }
    done
}
