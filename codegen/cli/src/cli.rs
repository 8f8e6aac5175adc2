//! The command line: arguments in, text or JSON out, exit code.
//!
//! Exit codes: 0 good; 1 the spec, a record or a budget fails, or an input cannot be read; 2 usage, or an output is an input;
//! 3 environment (a missing tool, a full disk, a file that cannot be written); 4 a simulated run ended before the end of its
//! path; 130 ended by Ctrl-C, with the best so far where a part of the work is a result.

mod build;
mod cache;
mod check;
mod completions;
mod doctor;
mod dynamics;
mod examples;
mod explain;
mod export;
mod firmware;
mod forc;
mod gcs;
mod identify;
mod learn;
mod line;
mod lsp;
mod named;
mod new;
mod number;
mod operate;
mod panel;
mod pil;
mod plant;
mod plot;
mod replay;
mod report;
mod reproduce;
mod robust;
mod sim;
mod tune;

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Receiver;

use clap::error::{ContextKind, ErrorKind};
use clap::{ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use serde::Serialize;
use serde_json::Value;

pub use named::{Role, role};
use specgen_compiler::ir::Ir;
use specgen_compiler::spec_file;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::spec::nearest;
use specgen_language::ui::{Message, Ui};
use specgen_language::{files, interrupt};
use specgen_toolchain as target;

/// Compiles one description of a piezo-driven Stewart platform into a `no_std` Rust controller.
#[derive(Parser, Debug)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    max_term_width = 80,
    override_usage = "specgen [OPTIONS] <SPEC>\n       specgen <COMMAND>",
    after_help = examples::MAIN
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    build: build::Arguments,
    #[command(flatten)]
    common: Common,
}

/// Options of every command.
#[derive(Args, Debug, Clone, Copy)]
struct Common {
    /// Print the result as JSON on standard output.
    #[arg(long, global = true)]
    json: bool,
    /// Ignore the build cache: neither read nor write it.
    #[arg(long, global = true)]
    no_cache: bool,
}

/// How findings are taken.
#[derive(Args, Debug, Clone, Copy)]
struct Strictness {
    /// Refuse a spec with warnings, as one with errors. A key that is meant is named in `[lint] allow`, with the reason.
    #[arg(long)]
    deny_warnings: bool,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Start a project: a folder with a commented spec of your platform and a simulated record of its legs, from about fifteen answers.
    New(new::Arguments),
    /// Report every finding about a spec; write nothing.
    Check(check::Arguments),
    /// Explain a finding by its code: what is checked, why it matters, a spec that shows it, the fix.
    Explain(explain::Arguments),
    /// Build for one target, check the image, compare it with the budget.
    Build(firmware::Arguments),
    /// Show what uses the memory of an image, and what its tick reaches.
    Size(firmware::SizeArguments),
    /// Build, check, and write the image to a board by probe-rs.
    Flash(firmware::FlashArguments),
    /// Simulate the controller of a spec on its simulated machine; with --paper the paper's experiments.
    Sim(sim::Arguments),
    /// Tune gains and weights on the simulated loop.
    Tune(tune::Arguments),
    /// Learn a repeated motion, simulated or on a machine: measure passes, and compute the correction that cancels their error.
    Learn(learn::Arguments),
    /// Try the closed loop on corners and random draws of declared uncertainties; a gate for builds.
    Robust(robust::Arguments),
    /// Write one HTML page about a spec: a verdict, tracking, error budget, margins, hysteresis, findings; or about a run.
    Report(report::Arguments),
    /// Run the paper's whole list of experiments, from specs in the binary: ours beside the paper's, with remarks.
    Reproduce(reproduce::Arguments),
    /// Close the loop of a simulated machine with the program of a microcontroller, emulated or at a serial port.
    Pil(pil::Arguments),
    /// Operate a machine over the link: arm, run, set-points, settings, waves, records; from a script or line by line.
    Operate(operate::Arguments),
    /// Show a machine on one page in the browser, and operate it there: pose, strips, spectrum, events; one page is in control.
    Panel(panel::Arguments),
    /// Let programs that speak the General Command Set 2.0 of piezo stages and hexapods move a machine: a bridge on the link.
    Gcs(gcs::Arguments),
    /// Run a recording of a target again on the host and compare every tick by bits; export it as CSV.
    Replay(replay::Arguments),
    /// Compute M, C, G, J and leg forces at given states, by the model that the controller uses.
    Dynamics(dynamics::Arguments),
    /// Export the controller as a C library, a Python module or an FMU.
    Export(export::Arguments),
    /// Identify from measured records: the Everett table, or linear, response, gauge, stiffness.
    Identify(identify::Arguments),
    /// Simulate the reversal-curve experiment that `identify` needs, on a leg of a spec or the reference leg.
    Forc(forc::Arguments),
    /// Serve the simulated machine of a spec to a real-time controller on this computer.
    Plant(plant::Arguments),
    /// Measure how well this computer keeps time, and say what to change for real time.
    Doctor(doctor::Arguments),
    /// Serve an editor by the Language Server Protocol: findings as you type, meanings of keys, completion, fixes.
    Lsp(lsp::Arguments),
    /// Print the intermediate representation of a spec: every constant of its controller.
    #[command(after_help = examples::DUMP_IR)]
    DumpIr {
        /// The spec file.
        spec: named::InputFile,
    },
    /// Show the size of the build cache, or clear it.
    Cache(cache::Arguments),
    /// Print a script that completes commands, options and files in a shell.
    Completions(completions::Arguments),
}

/// The command line as clap sees it: commands, options and their help.
#[must_use]
pub fn command() -> clap::Command {
    named::with_hints(Cli::command())
}

/// Runs the command that the process was started with.
#[must_use]
pub fn run() -> ExitCode {
    // A file that grows beyond the limit is an error to report, not the end of the process.
    specgen_rt::signals::ignore_file_size();
    let (cli, matches) = match parsed(std::env::args_os()) {
        Ok(parsed) => parsed,
        Err(error) => return refuse_arguments(error),
    };
    let mut ui = Ui::new(cli.common.json);
    interrupt::catch(move || Ui::new(cli.common.json).failed(&Failure::interrupted()));
    if cli.common.no_cache {
        target::cache::switch_off();
    }
    let done = perform(&cli, &matches, &mut ui);
    if done.is_err() {
        interrupt::settle();
    }
    // What is said from here on is the last word.
    interrupt::heed();
    if let Some(trouble) = target::cache::trouble() {
        ui.progress(&format!("warning: {trouble}"));
    }
    let code = done.map_or_else(|failure| ui.failed(&failure), |()| 0);
    ExitCode::from(ui.not_all_out().unwrap_or(code))
}

/// Performs one command as a function of this program: `arguments` are those behind `specgen`, what `--json` prints comes back,
/// and `listener` gets the progress. After `stop` is set, the command ends with what there is of a result, or at the next tick
/// of a simulation or line of progress. `lines` are the commands of a session that reads any: `operate` without commands.
#[must_use]
pub fn call(
    arguments: impl IntoIterator<Item = OsString>,
    stop: &'static AtomicBool,
    listener: impl Fn(Message<'_>) + 'static,
    lines: Option<Receiver<String>>,
) -> Value {
    interrupt::own(stop);
    let listener = move |message: Message<'_>| {
        listener(message);
        interrupt::point();
    };
    let mut ui = Ui::called(listener, lines);
    let done = match parsed(std::iter::once("specgen".into()).chain(arguments)) {
        // What it has not shown when it unwinds is not looked at.
        Ok((cli, matches)) => {
            catch_unwind(AssertUnwindSafe(|| perform(&cli, &matches, &mut ui))).unwrap_or_else(|cause| {
                if cause.is::<interrupt::Interruption>() { Err(Failure::interrupted()) } else { resume_unwind(cause) }
            })
        }
        Err(error) => {
            let text = error.render().to_string();
            Err(Failure::Usage(text.trim().trim_start_matches("error: ").to_owned()))
        }
    };
    if let Err(failure) = done {
        ui.failed(&failure);
    }
    ui.into_document()
}

/// The arguments, as values and by their names.
fn parsed(arguments: impl IntoIterator<Item = OsString>) -> Result<(Cli, ArgMatches), clap::Error> {
    let mut command = command();
    let matches = command.try_get_matches_from_mut(arguments)?;
    let cli = Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
    Ok((cli, matches))
}

/// What was asked for.
fn perform(cli: &Cli, matches: &ArgMatches, ui: &mut Ui) -> Result<(), Failure> {
    files::forget_inputs();
    named::check(matches)?;
    match &cli.command {
        None => match misspelt(cli.build.spec.as_deref()) {
            Some(failure) => Err(failure),
            None => build::run(&cli.build, ui),
        },
        Some(Command::New(arguments)) => new::run(arguments, ui),
        Some(Command::Check(arguments)) => check::run(arguments, ui),
        Some(Command::Explain(arguments)) => explain::run(arguments, ui),
        Some(Command::Build(arguments)) => firmware::run(arguments, ui),
        Some(Command::Size(arguments)) => firmware::run_size(arguments, ui),
        Some(Command::Flash(arguments)) => firmware::run_flash(arguments, ui),
        Some(Command::Sim(arguments)) => sim::run(arguments, ui),
        Some(Command::Tune(arguments)) => tune::run(arguments, ui),
        Some(Command::Learn(arguments)) => learn::run(arguments, ui),
        Some(Command::Robust(arguments)) => robust::run(arguments, ui),
        Some(Command::Report(arguments)) => report::run(arguments, ui),
        Some(Command::Reproduce(arguments)) => reproduce::run(arguments, ui),
        Some(Command::Pil(arguments)) => pil::run(arguments, ui),
        Some(Command::Operate(arguments)) => operate::run(arguments, ui),
        Some(Command::Panel(arguments)) => panel::run(arguments, ui),
        Some(Command::Gcs(arguments)) => gcs::run(arguments, ui),
        Some(Command::Replay(arguments)) => replay::run(arguments, ui),
        Some(Command::Export(arguments)) => export::run(arguments, ui),
        Some(Command::Dynamics(arguments)) => dynamics::run(arguments, ui),
        Some(Command::Identify(arguments)) => identify::run(arguments, ui),
        Some(Command::Forc(arguments)) => forc::run(arguments, ui),
        Some(Command::Plant(arguments)) => plant::run(arguments, ui),
        Some(Command::Doctor(arguments)) => doctor::run(arguments, ui),
        Some(Command::Lsp(arguments)) => lsp::run(arguments),
        Some(Command::DumpIr { spec }) => dump_ir(spec, ui),
        Some(Command::Cache(arguments)) => cache::run(arguments, ui),
        Some(Command::Completions(arguments)) => {
            completions::run(arguments, command(), ui);
            Ok(())
        }
    }
}

/// Help and version, or why the arguments make no sense.
fn refuse_arguments(error: clap::Error) -> ExitCode {
    let error = match error.kind() {
        // `specgen chek platform.toml`: clap would speak of a subcommand `platform.toml`.
        ErrorKind::ArgumentConflict if error.get(ContextKind::InvalidSubcommand).is_some() => {
            let mut command = command();
            let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
            let written = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
            let meant = nearest(&written, names.iter().copied());
            let message = match meant {
                Some(meant) => format!("there is no command `{written}`; did you mean `specgen {meant}`?"),
                None => {
                    format!("one spec file is expected, or a command ({}) with its own arguments", names.join(", "))
                }
            };
            command.error(ErrorKind::ArgumentConflict, message)
        }
        _ => error,
    };
    // Nothing was parsed, so the arguments are asked themselves.
    if error.use_stderr() && std::env::args_os().any(|argument| argument == "--json") {
        let text = error.render().to_string();
        let message = text.trim().trim_start_matches("error: ").to_owned();
        return ExitCode::from(Ui::new(true).failed(&Failure::Usage(message)));
    }
    if error.use_stderr() {
        error.exit()
    }
    // Help and version are results: that they are whole is known.
    let ui = Ui::new(false);
    ui.styled(&error.render().ansi().to_string());
    ExitCode::from(ui.not_all_out().unwrap_or(0))
}

/// `specgen chek`: a spec that is not there, under the name of a command or nearly so.
fn misspelt(spec: Option<&std::path::Path>) -> Option<Failure> {
    let spec = spec.filter(|spec| !spec.exists())?;
    let (written, command) = (spec.to_str()?, command());
    let meant = nearest(written, command.get_subcommands().map(clap::Command::get_name))?;
    Some(Failure::Usage(format!("there is no file and no command `{written}`; did you mean `specgen {meant}`?")))
}

/// Every constant of a controller.
#[derive(Serialize)]
struct Constants<'a>(&'a Ir);

impl Outcome for Constants<'_> {
    fn text(&self) -> String {
        specgen_compiler::workspace::ir_text(self.0)
    }
}

fn dump_ir(path: &std::path::Path, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec_file::compiled(path, ui)?;
    ui.result(&Constants(&compiled.ir));
    Ok(())
}
