//! `specgen learn`: a motion that repeats, learned between passes, on the simulated machine of a spec or over the link on a real one.

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
use super::named::{InputFile, OutputFile};
use super::sim::{PlantArguments, frequency};

/// Arguments of `learn`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LEARN)]
pub struct Arguments {
    /// The spec file, with `control.correction`.
    spec: InputFile,
    /// What is learned: case-1, case-2, machining or multisine, or a trajectory of the spec by its name; case-1 if not given. A machine
    /// at the end of a link learns the trajectories that it has.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Its operating frequency, Hz; 10, or that of the spec, if not given.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Largest number of learning passes; one more pass measures the result. Learning ends early once a pass gains no more than its noise.
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=1000))]
    passes: u32,
    /// Highest frequency to be learned, Hz; lowered to where every machine within [robust] converges.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true, default_value_t = BANDWIDTH)]
    bandwidth: f64,
    /// Range of an uncertainty, in place of that of [robust] or the default: `stiffness=2%`, `gain=0.9:1.1`, `delay_ticks=0`.
    #[arg(long, value_name = "NAME=RANGE", value_parser = UserRange::parse)]
    vary: Vec<UserRange>,
    /// Begin with the correction that the model predicts for lag and modes.
    #[arg(long, conflicts_with = "from")]
    prepare: bool,
    /// Begin with this correction, of the same spec, machine and motion.
    #[arg(long, value_name = "FILE")]
    from: Option<InputFile>,
    /// Learn nothing: measure the response of the running loop to a correction, by sweeps within passes of the motion, and write it here (JSON).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["passes", "vary", "prepare", "from", "output", "response"])]
    excite: Option<OutputFile>,
    /// Learn with the response that --excite measured on this machine, not with the model's and the intervals of [robust].
    #[arg(long, value_name = "FILE", conflicts_with = "vary")]
    response: Option<InputFile>,
    /// Let the device compute each correction in its background, with storage for N knots per pass: 4096 (default) on an STM32H743,
    /// 768 on an STM32F446, 65536 on a PC.
    #[arg(long, value_name = "KNOTS", num_args = 0..=1, default_missing_value = "4096", conflicts_with_all = ["excite", "response"],
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    on_device: Option<u32>,
    /// Write the resulting correction to this file (JSON): that of the last pass that gained more than its noise.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    /// Learn on this machine: it is armed first and ramped down afterwards.
    #[command(flatten)]
    line: Line,
    /// What the machine at the end of the link is called; a correction is played on no other.
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    #[command(flatten)]
    plant: PlantArguments,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let named = arguments.line.is_named();
    if named != arguments.machine.is_some() {
        let missing = if named { "--machine NAME: a correction is played on no other" } else { "--port or --socket" };
        return Err(Failure::Usage(format!("learning on a machine also needs {missing}")));
    }
    if named && (arguments.plant.plant.is_some() || arguments.plant.no_noise || arguments.frequency.is_some()) {
        let text = "--plant, --no-noise and --frequency are for the simulated machine; a real one is as it is, and plays the \
                    trajectories of its spec";
        return Err(Failure::Usage(text.to_owned()));
    }
    let options = Options {
        trajectory: arguments.trajectory.clone(),
        frequency: arguments.frequency,
        passes: arguments.passes,
        bandwidth: arguments.bandwidth,
        vary: arguments.vary.clone(),
        prepare: arguments.prepare,
        from: arguments.from.as_deref().map(Into::into),
        excite: arguments.excite.as_deref().map(Into::into),
        response: arguments.response.as_deref().map(Into::into),
        on_device: arguments.on_device,
        output: arguments.output.as_deref().map(Into::into),
        machine: arguments.machine.clone(),
        plant: arguments.plant.options(),
    };
    options.check()?;
    let spec: &Path = &arguments.spec;
    if !named {
        return lessons::simulated(&options, spec_file::compiled(spec, ui)?, ui);
    }
    let compiled = spec_file::looked_up(spec, ui)?;
    learning::run(arguments.line.end()?, spec, &options, compiled, ui)
}
