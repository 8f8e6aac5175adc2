//! `build --target`, `size` and `flash`: build a workspace with one target, check it, and compare it with its budget.

use clap::Args;
use clap::builder::PossibleValuesParser;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::firmware::{self, Options, flash, size};
use specgen_toolchain::targets::NAMES;

use super::path_roles::{InputFile, OutputFolder};

/// Arguments common to these commands.
#[derive(Args, Debug)]
struct Common {
    /// Target to build for; that of the spec's `target.mcu` if not given.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(NAMES))]
    target: Option<String>,
    /// Output folder; `<name>-controller` if not given. Must be new, empty, or an unchanged earlier output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Cargo's target folder for microcontrollers; `target` in the output folder if not given. Share it between outputs to
    /// compile less.
    #[arg(long, value_name = "DIR")]
    target_dir: Option<OutputFolder>,
    /// For boards: include lock-step for `specgen pil --port`, which lets the host step a board at rest.
    #[arg(long)]
    lockstep: bool,
    /// Do not run the emulator: no instruction counts and no bit comparison.
    #[arg(long)]
    no_measure: bool,
    /// Allow an image for a real board even if values of the spec are assumed or its records are simulated.
    #[arg(long)]
    assumed_ok: bool,
    #[command(flatten)]
    strictness: super::Strictness,
}

impl Common {
    fn options(&self) -> Options {
        options!(self => Options {
            target lockstep no_measure assumed_ok;
            output: self.output.as_deref().map(Into::into), target_dir: self.target_dir.as_deref().map(Into::into),
            deny_warnings: self.strictness.deny_warnings,
        })
    }
}

/// Arguments of `build`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::BUILD)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    #[command(flatten)]
    common: Common,
}

/// Arguments of `size`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::SIZE)]
pub struct SizeArguments {
    /// A spec, which is built first, or an ELF image.
    #[arg(value_name = "SPEC|ELF")]
    file: InputFile,
    #[command(flatten)]
    common: Common,
    /// The function that computes one tick; found automatically in images of specgen.
    #[arg(long, value_name = "SYMBOL")]
    tick: Option<String>,
    /// Fail if a tick uses f64: for a core without double-precision FPU.
    #[arg(long)]
    single: bool,
}

/// Arguments of `flash`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::FLASH)]
pub struct FlashArguments {
    /// A spec, which is built first, or an ELF image that `specgen build` made.
    #[arg(value_name = "SPEC|ELF")]
    file: InputFile,
    #[command(flatten)]
    common: Common,
    /// Confirm that the amplifiers are off, without being asked.
    #[arg(long)]
    yes: bool,
    /// Debug probe to use, as named by `probe-rs list`, if several are connected.
    #[arg(long, value_name = "VID:PID:SERIAL")]
    probe: Option<String>,
    /// Clock of the probe, kHz; use a slower one for a long cable.
    #[arg(long, value_name = "KHZ", value_parser = clap::value_parser!(u32).range(1..))]
    speed: Option<u32>,
    /// Hold the part in reset until the probe is attached, if its program hangs or keeps resetting it.
    #[arg(long)]
    connect_under_reset: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    firmware::run(&arguments.spec, &arguments.common.options(), ui)
}

pub fn run_size(arguments: &SizeArguments, ui: &mut Ui) -> Result<(), Failure> {
    let SizeArguments { file, common, tick, single } = arguments;
    size::run(file, &common.options(), tick.as_deref(), *single, ui)
}

pub fn run_flash(arguments: &FlashArguments, ui: &mut Ui) -> Result<(), Failure> {
    let FlashArguments { file, common, yes, probe, speed, connect_under_reset } = arguments;
    let speed = speed.map(|speed| speed.to_string());
    let mut options: Vec<&str> = probe.iter().flat_map(|probe| ["--probe", probe.as_str()]).collect();
    options.extend(speed.iter().flat_map(|speed| ["--speed", speed.as_str()]));
    options.extend(connect_under_reset.then_some("--connect-under-reset"));
    flash::run(file, &common.options(), &options, *yes, ui)
}
