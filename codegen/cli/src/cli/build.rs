//! The main job: compiles a spec to a workspace, builds and checks it, and measures it if the tools are installed.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::build::{self, Options};

use super::path_roles::{InputFile, OutputFolder};

/// Arguments of the main job.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The spec: a TOML file that describes the platform. `specgen new` writes one to start from.
    #[arg(required = true)]
    pub spec: Option<InputFile>,
    /// Output folder; `<name>-controller` if not given. Must be new, empty, or an unchanged earlier output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Only write the source code; build nothing.
    #[arg(long)]
    no_build: bool,
    /// Also write the crates for your own board: `hal`, `board`, `link`. See docs/porting.md.
    #[arg(long)]
    board: bool,
    /// First install a missing cross compiler or emulator, with rustup or apt, or into the user's cache. If that fails, the job
    /// continues without it.
    #[arg(long, conflicts_with = "no_build")]
    setup: bool,
    /// Print all findings and measurements below the verdict.
    #[arg(long)]
    details: bool,
    /// Exit with code 3 if the cross compiler or the emulator is missing.
    #[arg(long, conflicts_with = "no_build")]
    require_target: bool,
    #[command(flatten)]
    strictness: super::Strictness,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Some(spec) = arguments.spec.as_deref() else {
        // clap requires it unless there is a subcommand.
        return Err(Failure::Usage("name a spec file".to_owned()));
    };
    let options = options!(arguments => Options {
        no_build board setup details require_target;
        spec: spec.to_owned(), output: arguments.output.as_deref().map(Into::into),
        deny_warnings: arguments.strictness.deny_warnings,
    });
    build::run(&options, ui)
}
