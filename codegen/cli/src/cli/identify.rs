//! `specgen identify`: measured records in, tables, spec lines, figures and plots out.
//!
//! `specgen identify RECORD` identifies the Everett table; other kinds have a command of their own. A record that has the
//! name of such a command is given as `./linear`.

mod cause;
mod everett;
mod gains;
mod gauge;
mod linear;
mod predict;
mod rate;
mod reading;
mod response;
mod stiffness;

use clap::{Args, Subcommand};
use serde::Serialize;

use specgen_language::diagnostic::Diagnostic;
use specgen_language::outcome::Failure;
use specgen_language::outcome::Refusal;
use specgen_language::ui::Ui;

pub(super) use everett::range;
pub use everett::summary;

/// Arguments of `identify`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "specgen identify [OPTIONS] --drive <MIN:MAX> <RECORD>\n       specgen identify <COMMAND>",
    after_help = super::examples::IDENTIFY
)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Option<Kind>,
    #[command(flatten)]
    everett: everett::EverettArguments,
}

#[derive(Subcommand, Debug)]
enum Kind {
    /// The linear relation Y = ρX + δ of records at several frequencies, λ and the weights that are stable over it.
    Linear(linear::Arguments),
    /// Frequency response from a swept sine, multisine or noise: resonance, damping, lag, dead time.
    Response(response::Arguments),
    /// Gain of each leg of a platform over its table, from a recorded run; writes the six tables.
    Gains(gains::Arguments),
    /// Calibration of a gauge from its voltage and a reference.
    Gauge(gauge::Arguments),
    /// Displacement that a table or a spec predicts for a drive, beside the measured one.
    Predict(predict::Arguments),
    /// Axial stiffness from force and displacement at constant drive.
    Stiffness(stiffness::Arguments),
    /// Compare rate-dependent models on records of one leg at several rates.
    Rate(rate::Arguments),
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    match &arguments.kind {
        Some(Kind::Linear(arguments)) => linear::run(arguments, ui),
        Some(Kind::Response(arguments)) => response::run(arguments, ui),
        Some(Kind::Gains(arguments)) => gains::run(arguments, ui),
        Some(Kind::Gauge(arguments)) => gauge::run(arguments, ui),
        Some(Kind::Stiffness(arguments)) => stiffness::run(arguments, ui),
        Some(Kind::Predict(arguments)) => predict::run(arguments, ui),
        Some(Kind::Rate(arguments)) => rate::run(arguments, ui),
        None => everett::run(&arguments.everett, ui),
    }
}

/// What was identified, by its report.
#[derive(Serialize)]
pub(super) struct Identified<R> {
    /// As it was named.
    #[serde(skip)]
    pub record: String,
    pub report: R,
    /// Keys of a spec whose values are measured now; none where the record is simulated.
    pub measured: Measured,
    /// A line for each file that was written.
    #[serde(skip)]
    pub files: String,
}

/// Keys of a spec whose values a record gives.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(super) struct Measured(Vec<String>);

impl Measured {
    /// These; none if the record is `simulated`, which measures nothing.
    fn of(keys: &[&str], simulated: bool) -> Self {
        let keys: &[&str] = if simulated { &[] } else { keys };
        Self(keys.iter().map(|key| (*key).to_owned()).collect())
    }

    /// What becomes of the spec's list of assumed values once the lines stand in it: a comment, so that it may be pasted with them.
    fn text(&self) -> String {
        if self.0.is_empty() {
            return "# simulated, not measured: the spec's `assumed` stays as it is\n".to_owned();
        }
        let list: Vec<String> = self.0.iter().map(|key| format!("\"{key}\"")).collect();
        format!("# measured: take out of the spec's `assumed`, where they are in it: {}\n", list.join(", "))
    }
}

fn refused(findings: Vec<Diagnostic>) -> Failure {
    Failure::from(Refusal { source: None, findings })
}
