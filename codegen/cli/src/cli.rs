//! The command line: arguments in, text or JSON out, exit code.
//!
//! Exit codes: 0 good; 1 a spec, record, budget or gate is refused, or an input cannot be read; 2 usage, or an output is an input;
//! 3 environment (a missing tool, a full disk, a file that cannot be written); 4 a simulated run ended before the end of its
//! path; 130 interrupted by Ctrl-C, with the best result so far if there is one.

/// The options of a command from its arguments: fields that both have under one name, then the others.
macro_rules! options {
    ($arguments:ident => $options:ident { $($same:ident)+; $($other:ident: $value:expr,)* }) => {
        $options { $($same: $arguments.$same.clone(),)+ $($other: $value,)* }
    };
}

mod build;
mod cache;
mod check;
mod commission;
mod completions;
mod design;
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
mod new;
mod number;
mod operate;
mod panel;
mod path_roles;
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

pub use path_roles::{Role, role};
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
    /// The command line, without the program.
    #[arg(skip)]
    words: Vec<String>,
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

/// Treatment of warnings.
#[derive(Args, Debug, Clone, Copy)]
struct Strictness {
    /// Treat warnings as errors. `[lint] allow` exempts a key, with a reason.
    #[arg(long)]
    deny_warnings: bool,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Start a project from about fifteen answers: a folder with a commented spec of your platform and a simulated record of its legs.
    New(new::Arguments),
    /// Report every finding about a spec; write nothing.
    Check(check::Arguments),
    /// Explain a finding by its code: what is checked, why it matters, an example, the fix.
    Explain(explain::Arguments),
    /// Build for one target, check the image and compare it with the budget.
    Build(firmware::Arguments),
    /// Show what uses the memory of an image, and which functions a tick can call.
    Size(firmware::SizeArguments),
    /// Build and check an image, and flash it to a board with probe-rs.
    Flash(firmware::FlashArguments),
    /// Run the controller of a spec on a simulated machine; with --paper, the paper's experiments.
    Sim(sim::Arguments),
    /// Tune gains and weights on the simulated loop.
    Tune(tune::Arguments),
    /// Design active damping that is stable with every structural mode in [robust.structure], and write it into the spec.
    Design(design::Arguments),
    /// Iterative learning control: repeat a motion and compute the correction that cancels its error, in simulation or (with
    /// --port or --socket) on a machine, which is armed first and ramped down afterwards.
    Learn(learn::Arguments),
    /// Simulate machines that differ from the spec within the declared uncertainties: corners and random draws; also as a build
    /// gate.
    Robust(robust::Arguments),
    /// Write an HTML report about a spec (verdict, tracking, error budget, margins, hysteresis, findings) or about a run.
    Report(report::Arguments),
    /// Run all of the paper's experiments with built-in specs, and compare the results with the paper's.
    Reproduce(reproduce::Arguments),
    /// Processor in the loop: control a simulated machine with a microcontroller, emulated or at a serial port.
    Pil(pil::Arguments),
    /// Commission a wired machine: check the wiring, measure each leg with the machine's own converters, write the results into
    /// the spec, and test the machine with its new controller. After an interruption the same command continues.
    Commission(commission::Arguments),
    /// Operate a machine at a serial port or socket: arm, run, move, change settings, play waves, record; from a script or line by
    /// line.
    Operate(operate::Arguments),
    /// Show and operate a machine in the browser: pose, strip charts, spectrum, events. One page is in control at a time.
    Panel(panel::Arguments),
    /// Bridge to the General Command Set (GCS) 2.0 of piezo stages and hexapods: let its clients move a machine.
    Gcs(gcs::Arguments),
    /// Replay a recorded run on this computer and compare every tick bit for bit; or export it as CSV or MCAP.
    Replay(replay::Arguments),
    /// Compute inertia M, Coriolis terms C ḣ, gravity G, Jacobian J and leg forces at given states, with the controller's model.
    Dynamics(dynamics::Arguments),
    /// Export the controller as a C library, a Python module or an FMU.
    Export(export::Arguments),
    /// Identify an Everett table, or another property such as response or stiffness, from measured records.
    Identify(identify::Arguments),
    /// Simulate the reversal-curve experiment that `identify` needs, or only write its drive signal for a waveform generator.
    Forc(forc::Arguments),
    /// Serve the simulated machine of a spec to a real-time controller on this computer.
    Plant(plant::Arguments),
    /// Check whether this computer can run a controller in real time, and show what to change.
    Doctor(doctor::Arguments),
    /// Language server for editors: findings as you type, documentation of keys, completion, fixes.
    Lsp(lsp::Arguments),
    /// Print the intermediate representation of a spec: every constant of its controller.
    #[command(after_help = examples::DUMP_IR)]
    DumpIr {
        /// The spec file.
        spec: path_roles::InputFile,
    },
    /// Show the size of the build cache, or clear it.
    Cache(cache::Arguments),
    /// Print a completion script for a shell.
    Completions(completions::Arguments),
}

/// The command line as clap sees it: commands, options and their help.
#[must_use]
pub fn command() -> clap::Command {
    path_roles::with_hints(Cli::command())
}

/// Runs the command that the process was started with.
#[must_use]
pub fn run() -> ExitCode {
    // Report a file that exceeds the size limit as an error: the signal would end the process.
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
    // From here on an interrupt must not cut the final output short.
    interrupt::heed();
    if let Some(trouble) = target::cache::trouble() {
        ui.progress(&format!("warning: {trouble}"));
    }
    let code = done.map_or_else(|failure| ui.failed(&failure), |()| 0);
    ExitCode::from(ui.not_all_out().unwrap_or(code))
}

/// Runs one command inside this process and returns its JSON document. `arguments` are those after `specgen`, and `listener`
/// gets the progress. Once `stop` is set, the command ends with its result so far, or at the next simulated tick or line of
/// progress. `lines` are the commands of an interactive session: `operate` without commands.
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
        // Nothing of the command is used after it unwinds.
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

/// The arguments, as a struct and by their names.
fn parsed(arguments: impl IntoIterator<Item = OsString>) -> Result<(Cli, ArgMatches), clap::Error> {
    let mut command = command();
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let matches = command.try_get_matches_from_mut(&arguments)?;
    let cli = Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
    let words = arguments.iter().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    Ok((Cli { words, ..cli }, matches))
}

/// Runs the requested command.
fn perform(cli: &Cli, matches: &ArgMatches, ui: &mut Ui) -> Result<(), Failure> {
    files::forget_inputs();
    path_roles::check(matches)?;
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
        Some(Command::Design(arguments)) => design::run(arguments, ui),
        Some(Command::Learn(arguments)) => learn::run(arguments, ui),
        Some(Command::Robust(arguments)) => robust::run(arguments, ui),
        Some(Command::Report(arguments)) => report::run(arguments, ui),
        Some(Command::Reproduce(arguments)) => reproduce::run(arguments, ui),
        Some(Command::Pil(arguments)) => pil::run(arguments, ui),
        Some(Command::Commission(arguments)) => commission::run(arguments, ui),
        Some(Command::Operate(arguments)) => operate::run(arguments, ui),
        Some(Command::Panel(arguments)) => panel::run(arguments, ui),
        Some(Command::Gcs(arguments)) => gcs::run(arguments, ui),
        Some(Command::Replay(arguments)) => replay::run(arguments, ui),
        Some(Command::Export(arguments)) => export::run(arguments, ui),
        Some(Command::Dynamics(arguments)) => dynamics::run(arguments, ui),
        Some(Command::Identify(arguments)) => identify::run(arguments, &cli.words, ui),
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

/// Prints help or version, or reports invalid arguments.
fn refuse_arguments(error: clap::Error) -> ExitCode {
    let error = match error.kind() {
        // `specgen chek platform.toml`: clap would complain about a subcommand `platform.toml`.
        ErrorKind::ArgumentConflict if error.get(ContextKind::InvalidSubcommand).is_some() => {
            let mut command = command();
            let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
            let written = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
            let meant = nearest(&written, names.iter().copied());
            let message = match meant {
                Some(meant) => format!("there is no command `{written}`; did you mean `specgen {meant}`?"),
                None => {
                    format!("expected one spec file, or a command ({}) with its arguments", names.join(", "))
                }
            };
            command.error(ErrorKind::ArgumentConflict, message)
        }
        _ => error,
    };
    // Parsing failed, so look for the option in the raw arguments.
    if error.use_stderr() && std::env::args_os().any(|argument| argument == "--json") {
        let text = error.render().to_string();
        let message = text.trim().trim_start_matches("error: ").to_owned();
        return ExitCode::from(Ui::new(true).failed(&Failure::Usage(message)));
    }
    if error.use_stderr() {
        error.exit()
    }
    // Help and version are results: report incomplete output.
    let ui = Ui::new(false);
    ui.styled(&error.render().ansi().to_string());
    ExitCode::from(ui.not_all_out().unwrap_or(0))
}

/// `specgen chek`: a missing spec whose name resembles a command.
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
