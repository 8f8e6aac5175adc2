//! `specgen completions`: a shell completion script for commands, options, their values and files.

use clap::Args;
use clap_complete::Shell;
use serde::Serialize;

use specgen_language::outcome::Outcome;
use specgen_language::ui::Ui;

/// Arguments of `completions`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::COMPLETIONS)]
pub struct Arguments {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Serialize)]
struct Completions {
    shell: String,
    script: String,
}

impl Outcome for Completions {
    fn text(&self) -> String {
        self.script.clone()
    }
}

/// Prints the script for `command`.
pub fn run(arguments: &Arguments, mut command: clap::Command, ui: &Ui) {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "specgen", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    ui.result(&Completions { shell: arguments.shell.to_string(), script });
}
