//! `specgen robust`: runs corners and random draws of the declared uncertainties, and checks quantiles of the error against
//! gates. A study can be split over computers; `specgen robust merge` combines the parts.

use clap::{Args, Subcommand};
use specgen_language::outcome::Failure;
use specgen_language::spec::quantity::{self, Dimension};
use specgen_language::ui::Ui;
use specgen_report::robust::{self, Options};
use specgen_studies::robust::Shard;
use specgen_studies::robust::factors::UserRange;

use super::number::number;
use super::path_roles::{InputFile, OutputFolder};
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
    /// Merge the parts of a study that were run with --shard. The report equals that of a single run, byte for byte.
    Merge(MergeArguments),
}

/// Arguments of `robust merge`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::MERGE)]
struct MergeArguments {
    /// Files written with --shard, all of one study, in any order.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<InputFile>,
    /// Folder for the runs (CSV) and the report (JSON).
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    plot: Plot,
}

/// Arguments of a study or one of its parts.
#[derive(Args, Debug)]
struct StudyArguments {
    /// The spec file.
    #[arg(required = true)]
    spec: Option<InputFile>,
    /// Number of random machines, in addition to the corners.
    #[arg(long = "draws", value_name = "N", alias = "samples", default_value_t = 100, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    draws: u32,
    /// Range of an uncertainty, instead of that of [robust] or the default: `mass=5%`, `gain=0.9:1.1`, `delay_ticks=1`, `structure=1`.
    /// Names: mass, stiffness, damping, gain, hysteresis, creep, lag, gauge_lag, noise (factors), delay_ticks, and structure (0 or 1).
    #[arg(long, value_name = "NAME=RANGE", value_parser = UserRange::parse)]
    vary: Vec<UserRange>,
    /// Trajectory: case-1 (default), case-2, machining, multisine or the name of a trajectory of the spec; without [control],
    /// leg (default) or multisine.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Operating frequency of the paper's trajectory, or highest frequency of the multisine, Hz; 10 if not given. A trajectory
    /// of the spec has its own.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Run only one machine, given by the seed of a draw or the name of a corner.
    #[arg(long, value_name = "SEED|NAME")]
    replay: Option<String>,
    /// Gate: largest rms error of the translation, or of the legs, such as "30 nm"; that of [robust] if not given.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    max_error: Option<f64>,
    /// Gate: largest rms error of the angles, such as "100 nrad"; for a spec with [control].
    #[arg(long, value_name = "ANGLE", value_parser = angle, allow_hyphen_values = true)]
    max_orientation: Option<f64>,
    /// Learn the motion on each machine with this many passes, and show the remaining error; for a spec with control.correction.
    #[arg(long, value_name = "PASSES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1000))]
    learn: Option<u32>,
    /// Gate: largest rms error of the translation after learning, such as "6 nm"; that of [robust] if not given. It also fails if
    /// the error grows from pass to pass on any machine.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true, requires = "learn")]
    max_learned: Option<f64>,
    /// Quantile of the draws that the gates check, %; the maximum of draws and corners if not given.
    #[arg(long, value_name = "PERCENT", value_parser = number("%", "a percentage above 0, up to 100", f64::MIN_POSITIVE..=100.0), allow_negative_numbers = true)]
    quantile: Option<f64>,
    /// Error above which a run counts as diverged; 5 % of the stroke if not given.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    diverged_above: Option<f64>,
    /// Number of worker threads; one per processor if not given. The result does not depend on it.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Run only part I of N (I from 1 to N), and write it to the file of -o, for `specgen robust merge`. Gates are not
    /// checked.
    #[arg(long, value_name = "I/N", value_parser = Shard::parse, requires = "output", conflicts_with_all = ["replay", "plot"])]
    shard: Option<Shard>,
    /// Folder for the runs (CSV) and the report (JSON); with --shard, the output file.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

fn measure(text: &str, dimension: Dimension, unit: &str) -> Result<f64, String> {
    let found =
        quantity::parse_as(text, dimension).ok().filter(|found| found.dimension == dimension && found.value > 0.0);
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
        return Err(Failure::Usage("expected a spec file, or merge".to_owned()));
    };
    let options = options!(arguments => Options {
        draws vary trajectory frequency replay max_error max_orientation learn max_learned quantile diverged_above
        threads shard;
        spec: spec.to_owned(), output: arguments.output.as_deref().map(Into::into), plot: arguments.plot.place(),
        plant: arguments.plant.options(),
    });
    robust::run(&options, ui)
}
