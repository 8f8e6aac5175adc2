//! `specgen explain`: the page of a finding.

use clap::Args;
use serde::Serialize;

use super::ui::{Failure, Outcome, Ui};
use specgen_language::diagnostic::codes;

/// Arguments of `explain`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPLAIN)]
pub struct Arguments {
    /// A code such as E0441, as it stands in brackets behind `error`, `warning` or `note`.
    code: String,
}

/// What is known of a code.
#[derive(Serialize)]
struct Explained {
    code: &'static str,
    title: &'static str,
    /// Markdown.
    page: &'static str,
}

pub fn run(arguments: &Arguments, ui: &Ui) -> Result<(), Failure> {
    let asked = arguments.code.to_uppercase();
    let Some(code) = codes::find(&asked) else {
        // The letter may be mistaken, or left out.
        let same = codes::REGISTRY.iter().find(|code| asked.get(1..) == code.id.get(1..) || asked == code.id[1..]);
        let help = same.map_or_else(
            || "docs/diagnostics.md lists them".to_owned(),
            |code| format!("did you mean {}, {}?", code.id, code.title()),
        );
        return Err(Failure::Usage(format!("there is no finding `{}`; {help}", arguments.code)));
    };
    ui.result(&Explained { code: code.id, title: code.title(), page: code.page });
    Ok(())
}

impl Outcome for Explained {
    /// The page without its marks, code indented.
    fn text(&self) -> String {
        let mut text = String::new();
        let mut is_code = false;
        for line in self.page.lines() {
            if line.starts_with("```") {
                is_code = !is_code;
                continue;
            }
            if is_code && !line.is_empty() {
                text += "    ";
            }
            text += if is_code { line } else { line.trim_start_matches('#').trim_start() };
            text.push('\n');
        }
        text
    }
}
