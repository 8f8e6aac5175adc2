//! `specgen learn`: learns a repeated motion between passes, on the simulated machine of a spec or on a real one over the link.

use std::path::Path;

use clap::Args;
use specgen_compiler::spec_file;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::learning;
use specgen_report::learning::BANDWIDTH;
use specgen_studies::factors::UserRange;
use specgen_studies::lessons::{self, Options};

use super::line::Line;
use super::number::number;
use super::path_roles::{InputFile, OutputFile};
use super::sim::{PlantArguments, frequency};

/// Arguments of `learn`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LEARN)]
pub struct Arguments {
    /// The spec file; it must have the key `control.correction`.
    spec: InputFile,
    /// Motion to learn: case-1, case-2, machining, multisine or the name of a trajectory of the spec; case-1 if not given. A
    /// machine over the link learns only trajectories of its spec.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Operating frequency of the motion, Hz; that of the spec's trajectory, or 10, if not given.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Largest number of learning passes. Learning ends early after two passes in a row without improvement, or after the third
    /// pass that is worse than the best so far.
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=1000))]
    passes: u32,
    /// Highest frequency to learn, Hz. It is lowered until learning converges on every machine within the uncertainties of
    /// [robust]. With --excite, the sweeps reach 1.6 times this frequency, but at most 0.4 times the knots (samples of the
    /// correction) per second.
    #[arg(long, value_name = "HZ", value_parser = number("Hz", "a frequency from 0.001 to 4000 Hz", 1e-3..=4e3), allow_negative_numbers = true, default_value_t = BANDWIDTH)]
    bandwidth: f64,
    /// Range of an uncertainty, instead of that of [robust] or the default: `stiffness=2%`, `gain=0.9:1.1`, `delay_ticks=0`.
    #[arg(long, value_name = "NAME=RANGE", value_parser = UserRange::parse)]
    vary: Vec<UserRange>,
    /// Start from the correction that the model predicts for lag, modes and hysteresis.
    #[arg(long, conflicts_with = "from")]
    prepare: bool,
    /// Start from the correction in this file, learned with the same spec, machine and motion.
    #[arg(long, value_name = "FILE")]
    from: Option<InputFile>,
    /// Do not learn. Measure the response of the running loop to corrections (sweeps during passes of the motion), and write it
    /// to this file (JSON). Structural modes that it shows are printed as lines for the spec.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["passes", "vary", "prepare", "from", "output", "response"])]
    excite: Option<OutputFile>,
    /// Learn with the response that --excite measured on this machine, instead of the model's with the intervals of [robust].
    #[arg(long, value_name = "FILE", conflicts_with = "vary")]
    response: Option<InputFile>,
    /// Let the device compute each correction in its idle time, with storage for KNOTS knots per pass: an STM32H743 has 4096
    /// (default), an STM32F446 768, a PC 65536.
    #[arg(long, value_name = "KNOTS", num_args = 0..=1, default_missing_value = "4096", conflicts_with_all = ["excite", "response"],
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    on_device: Option<u32>,
    /// Write the resulting correction to this file (JSON): that of the last pass that improved by more than its noise.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    /// Learn on this machine: it is armed first and ramped down afterwards.
    #[command(flatten)]
    line: Line,
    /// Name of the machine on the link. A correction is played only on the machine that it was learned on.
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    #[command(flatten)]
    plant: PlantArguments,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let named = arguments.line.is_named();
    if named != arguments.machine.is_some() {
        let missing = if named { "--machine NAME: a correction fits only its machine" } else { "--port or --socket" };
        return Err(Failure::Usage(format!("learning on a machine also needs {missing}")));
    }
    if named && (arguments.plant.plant.is_some() || arguments.plant.no_noise || arguments.frequency.is_some()) {
        let text = "--plant, --no-noise and --frequency are only for the simulated machine; a real machine plays the trajectories \
                    of its spec";
        return Err(Failure::Usage(text.to_owned()));
    }
    let options = options!(arguments => Options {
        trajectory frequency passes bandwidth vary prepare on_device machine;
        from: arguments.from.as_deref().map(Into::into), excite: arguments.excite.as_deref().map(Into::into),
        response: arguments.response.as_deref().map(Into::into), output: arguments.output.as_deref().map(Into::into),
        plant: arguments.plant.options(),
    });
    options.check()?;
    let spec: &Path = &arguments.spec;
    if !named {
        return lessons::simulated(&options, spec_file::compiled(spec, ui)?, ui);
    }
    let compiled = spec_file::looked_up(spec, ui)?;
    learning::run(arguments.line.end()?, spec, &options, compiled, ui)
}
