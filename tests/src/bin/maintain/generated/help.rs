//! The page of the book with every command: `docs/commands.md`, then the help of each command.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Width of a line of help.
const WIDTH: usize = 100;

/// The page.
///
/// # Errors
/// The hand-written page cannot be read.
pub fn markdown(root: &Path) -> Result<String, String> {
    let path = root.join("docs/commands.md");
    let mut text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut command = specgen::cli::command();
    command.build();
    add(command, "specgen", &mut text);
    Ok(text)
}

/// Adds the help of a command, then of its subcommands.
fn add(command: clap::Command, path: &str, text: &mut String) {
    let mut command = command.term_width(WIDTH);
    // Writing to a String cannot fail.
    let _ = write!(text, "\n## {path}\n\n```text\n{}\n```\n", command.render_long_help().to_string().trim_end());
    let below: Vec<clap::Command> = command.get_subcommands().cloned().collect();
    for command in below.into_iter().filter(|command| command.get_name() != "help") {
        let path = format!("{path} {}", command.get_name());
        add(command, &path, text);
    }
}
