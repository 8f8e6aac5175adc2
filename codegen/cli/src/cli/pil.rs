//! `specgen pil`: processor in the loop. A microcontroller image in QEMU, or a board at a serial port, controls a simulated
//! machine. The host library computes the same ticks, and every bit is compared.

use clap::Args;
use specgen_compiler::spec_file;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::pil::{self, BAUD, Options, Run};
use specgen_report::sim::{chart_of_legs, chart_of_platform};

use super::path_roles::{Endpoint, InputFile, OutputFolder};
use super::plot::Plot;
use super::sim::{PlantArguments, frequency};

/// Arguments of `pil`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::PIL)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Workspace to write and build, kept for the next run; NAME-controller if not given.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// With [control]: case-1, case-2, glass or aluminium of the paper; case-1 if not given.
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// With [control]: play this trajectory of the spec, generated on the device, instead.
    #[arg(long, value_name = "NAME", conflicts_with = "scenario")]
    trajectory: Option<String>,
    /// Run only this control mode, named as in `sim`: invhys, ewma, pcc; with [control] p, f-pcc, pf-pcc and others. All modes of
    /// `sim` if not given.
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// Operating frequency of the scenario, Hz; 10 if not given, 1 for glass and aluminium.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Without [control]: control ticks per period of the trajectory; 500 if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: Option<u32>,
    /// Run only this much of the trajectory, s.
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    plant: PlantArguments,
    /// Use a board at this serial port instead of QEMU.
    #[arg(long, value_name = "DEVICE", conflicts_with = "elf")]
    port: Option<Endpoint>,
    /// Baud rate of the serial port.
    #[arg(long, default_value_t = BAUD, requires = "port", value_parser = clap::value_parser!(u32).range(1200..=12_000_000))]
    baud: u32,
    /// Run this image in QEMU instead of building one.
    #[arg(long, value_name = "FILE")]
    elf: Option<InputFile>,
    #[command(flatten)]
    plot: Plot,
}

fn seconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a time from 0.001 to 1000 s, found `{text}`");
    text.parse().ok().filter(|time| (1e-3..=1e3).contains(time)).ok_or_else(expected)
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let plant = arguments.plant.options();
    // Report a bad leg file or an unwritable plot before the long part of the work.
    plant.leg()?;
    arguments.plot.place().wanted()?;
    let compiled = spec_file::compiled(&arguments.spec, ui)?;
    let options = Options {
        output: arguments.output.as_deref(),
        scenario: arguments.scenario.as_deref(),
        trajectory: arguments.trajectory.as_deref(),
        mode: arguments.mode.as_deref(),
        frequency: arguments.frequency,
        samples: arguments.samples,
        seconds: arguments.seconds,
        plant,
        port: arguments.port.as_deref().map(|path| (path, arguments.baud)),
        elf: arguments.elf.as_deref(),
    };
    let mut charts = Vec::new();
    let mut draw = |run: Run<'_>| {
        charts.push(match run {
            Run::Legs { title, tracking } => chart_of_legs(tracking, title),
            Run::Platform { title, interval, run } => chart_of_platform(title, interval, run),
        });
    };
    let mut report = pil::run(&options, &compiled, &mut draw, ui)?;
    let below = if compiled.model.task_space.is_some() { "target minus true pose" } else { "target minus gauge" };
    report.plot = arguments.plot.place().charts(&report.name, below, &charts)?;
    ui.scored(&report, &report.ended_early)
}
