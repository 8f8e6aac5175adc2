//! `specgen robust merge`: the report of a study whose parts were run apart.

use clap::Args;

use super::Results;
use super::work::Part;
use crate::cli::named::{InputFile, OutputFolder};
use crate::cli::plot::Plot;
use specgen_language::outcome::Failure;
use specgen_language::output::{claim, read_text};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_studies::robust::shard;

/// Arguments of `robust merge`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::MERGE)]
pub struct Arguments {
    /// Files that --shard wrote, all of one study, in any order.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<InputFile>,
    /// Write runs (CSV) and report (JSON) here.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    plot: Plot,
}

pub(super) fn run(arguments: &Arguments, ui: &Ui) -> Result<(), Failure> {
    arguments.plot.wanted()?;
    let mut read = Vec::new();
    for path in &arguments.parts {
        let name = path.display().to_string();
        let part = Part::read(&read_text(path)?).map_err(|why| Failure::Gate(format!("`{name}` {why}")))?;
        if let Some((first, other)) = read.first()
            && let Some((what, here, there)) = part.differs(other)
        {
            return Err(Failure::Gate(format!(
                "`{name}` and `{first}` are of different studies: {what} is {here} here, {there} there"
            )));
        }
        read.push((name, part));
    }
    let Some((_, first)) = read.first() else {
        return Err(Failure::Usage("there is no part to merge".to_owned()));
    };
    let work = first.work.clone();
    let plan = work.plan();
    let parts: Vec<shard::Part> = read.into_iter().map(|(name, part)| part.named(name)).collect();
    let runs = shard::merged(&plan, &parts).map_err(Failure::Gate)?;
    // That of the parts: a study has no other.
    ui.runs(ControllerForm::RunTime);
    let _claimed = arguments.output.as_deref().map(claim).transpose()?;
    let results = Results { output: arguments.output.as_deref(), plot: &arguments.plot };
    results.put(&work, false, plan.members.len(), &runs, ui, || {})
}
