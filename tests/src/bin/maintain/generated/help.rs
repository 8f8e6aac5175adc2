//! The page of the book with every command: what `docs/commands.md` has, then the help of each.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Letters in a line of help.
const WIDTH: usize = 100;

/// The page.
///
/// # Errors
/// The page by hand cannot be read.
pub fn markdown(root: &Path) -> Result<String, String> {
    let path = root.join("docs/commands.md");
    let mut text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut command = specgen::cli::command();
    command.build();
    add(command, "specgen", &mut text);
    Ok(text)
}

/// Help of a command, then of those below it.
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
