//! `specgen completions`: a script that completes commands, options, their values and files in a shell.

use clap::Args;
use clap_complete::Shell;
use serde_json::json;

use super::ui::Ui;

/// Arguments of `completions`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::COMPLETIONS)]
pub struct Arguments {
    /// The shell that the script is for.
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the script for `command`.
pub fn run(arguments: &Arguments, mut command: clap::Command, ui: &Ui) {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "specgen", &mut script);
    let script = String::from_utf8_lossy(&script);
    ui.result(&script, json!({ "shell": arguments.shell.to_string(), "script": script }));
}
