//! `specgen robust`: corners and random draws of declared uncertainties, quantiles of the error, a gate for builds; in parts on
//! many computers, which `specgen robust merge` puts together.

use clap::{Args, Subcommand};
use specgen_language::outcome::Failure;
use specgen_language::spec::quantity::{self, Dimension};
use specgen_language::ui::Ui;
use specgen_report::robust::{self, Options};
use specgen_studies::robust::Shard;
use specgen_studies::robust::factors::UserRange;

use super::named::{InputFile, OutputFolder};
use super::number::number;
use super::plot::Plot;
use super::sim::{PlantArguments, frequency};

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
    Merge(MergeArguments),
}

/// Arguments of `robust merge`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::MERGE)]
struct MergeArguments {
    /// Files that --shard wrote, all of one study, in any order.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<InputFile>,
    /// Write runs (CSV) and report (JSON) here.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    plot: Plot,
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
    /// The trajectory: case-1, case-2, machining or multisine, or a trajectory of the spec by its name; without
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
    /// Gate: largest rms error of the translation once learned, such as "6 nm", that of [robust] if not given. It also fails if the error grows from pass to pass on any machine.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true, requires = "learn")]
    max_learned: Option<f64>,
    /// Quantile of the draws that the gate compares, %; the largest of draws and corners if not given.
    #[arg(long, value_name = "PERCENT", value_parser = number("%", "a percentage above 0, up to 100", f64::MIN_POSITIVE..=100.0), allow_negative_numbers = true)]
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

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let arguments = match &arguments.kind {
        None => &arguments.study,
        Some(Kind::Merge(MergeArguments { parts, output, plot })) => {
            return robust::merge(parts, output.as_deref(), &plot.place(), ui);
        }
    };
    let Some(spec) = arguments.spec.as_deref() else {
        return Err(Failure::Usage("a spec file is expected, or merge".to_owned()));
    };
    let options = Options {
        spec: spec.to_owned(),
        draws: arguments.draws,
        vary: arguments.vary.clone(),
        trajectory: arguments.trajectory.clone(),
        frequency: arguments.frequency,
        replay: arguments.replay.clone(),
        max_error: arguments.max_error,
        max_orientation: arguments.max_orientation,
        learn: arguments.learn,
        max_learned: arguments.max_learned,
        quantile: arguments.quantile,
        diverged_above: arguments.diverged_above,
        threads: arguments.threads,
        shard: arguments.shard,
        output: arguments.output.as_deref().map(Into::into),
        plot: arguments.plot.place(),
        plant: arguments.plant.options(),
    };
    robust::run(&options, ui)
}
