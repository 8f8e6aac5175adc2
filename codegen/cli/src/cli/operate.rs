//! `specgen operate`: a session with a machine over the link, from the command line, a script, or line by line.

use clap::{ArgGroup, Args};
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::Command;
use specgen_operate::commands::{self, Source};

use super::line::Line;
use super::path_roles::InputFile;

/// Arguments of `operate`.
#[derive(Args, Debug)]
#[command(
    group(ArgGroup::new("line").required(true).args(["port", "socket"])),
    override_usage = "specgen operate [OPTIONS] --port <DEVICE> [SPEC] [COMMAND]...\n       specgen operate [OPTIONS] --socket <PATH> [SPEC] [COMMAND]...",
    after_help = super::examples::OPERATE
)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// Read commands from this file, one per line; `#` starts a comment.
    #[arg(long, value_name = "FILE")]
    script: Option<InputFile>,
    /// The spec that the device was built from (ending in .toml), then commands, each as one argument. Without commands, they
    /// are read from standard input.
    #[arg(value_name = "SPEC] [COMMAND")]
    words: Vec<String>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    // `wave x.toml` is a command.
    let is_spec = |word: &&String| word.ends_with(".toml") && Command::parse(word).is_err();
    let spec = arguments.words.first().filter(is_spec);
    let commands = arguments.words.get(usize::from(spec.is_some())..).unwrap_or_default();
    let source = Source::parse(commands, arguments.script.as_deref())?;
    let compiled = spec.map(|spec| spec_file::looked_up(spec.as_ref(), ui)).transpose()?;
    source.check_specs()?;
    // An interrupt must ramp down first.
    interrupt::heed();
    let digest = compiled.as_ref().map(|compiled| compiled.ir.digest.as_str());
    let (session, name) = arguments.line.open(digest)?;
    commands::run(session, &name, compiled, arguments.line.port.is_some(), source, ui)
}
