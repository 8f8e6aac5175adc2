//! `specgen explain`: the page of a finding.

use clap::Args;
use serde::Serialize;

use specgen_compiler::findings;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_studies::verdict::WIDTH;

/// Arguments of `explain`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPLAIN)]
pub struct Arguments {
    /// A code such as E0441, shown in brackets after `error`, `warning` or `note`.
    code: String,
}

/// The documentation of a code.
#[derive(Serialize)]
struct Explanation {
    code: &'static str,
    title: &'static str,
    /// Markdown.
    page: String,
}

pub fn run(arguments: &Arguments, ui: &Ui) -> Result<(), Failure> {
    let asked = arguments.code.to_uppercase();
    let Some(code) = findings::find(&asked) else {
        // The letter may be wrong or missing.
        let same = findings::all().into_iter().find(|code| asked.get(1..) == code.id.get(1..) || asked == code.id[1..]);
        let help = same.map_or_else(
            || "docs/diagnostics.md lists them".to_owned(),
            |code| format!("did you mean {}, {}?", code.id, code.title()),
        );
        return Err(Failure::Usage(format!("there is no finding `{}`; {help}", arguments.code)));
    };
    ui.result(&Explanation { code: code.id, title: code.title(), page: code.page() });
    Ok(())
}

impl Outcome for Explanation {
    /// The page without its Markdown, code indented.
    fn text(&self) -> String {
        let mut text = String::new();
        let mut code = None;
        for line in self.page.lines() {
            if let Some(language) = line.strip_prefix("```") {
                code = code.is_none().then_some(language);
                continue;
            }
            match code {
                Some(language) => wrapped(line, language).iter().for_each(|part| {
                    text += if part.is_empty() { "" } else { INDENT };
                    text += part;
                    text.push('\n');
                }),
                None => {
                    text += line.trim_start_matches('#').trim_start();
                    text.push('\n');
                }
            }
        }
        text
    }
}

/// Before a line of code.
const INDENT: &str = "    ";

/// Wraps a line of code to the width of a terminal: a list after a comma, with the mark of a diff repeated; a command after a
/// backslash.
fn wrapped(line: &str, language: &str) -> Vec<String> {
    let width = WIDTH - INDENT.len();
    let shell = language == "sh";
    let (space, end) = if shell { (" ", " \\") } else { (", ", ",") };
    let mark = line.chars().next().filter(|first| language == "diff" && "+-".contains(*first));
    let begin = format!("{}    ", mark.map_or_else(String::new, String::from));
    let mut lines = Vec::new();
    let mut rest = line.to_owned();
    while rest.chars().count() > width {
        let fits = rest.char_indices().nth(width - end.len()).map_or(rest.len(), |(place, _)| place);
        // A break within the indentation would loop forever.
        let Some(place) = rest[..fits].rfind(space).filter(|place| *place > begin.len()) else { break };
        lines.push(format!("{}{end}", &rest[..place]));
        rest = format!("{begin}{}", &rest[place + space.len()..]);
    }
    lines.push(rest);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_of_a_page_is_longer_than_a_terminal_is_wide() {
        for code in findings::all() {
            let page = Explanation { code: code.id, title: code.title(), page: code.page() }.text();
            let long = page.lines().find(|line| line.chars().count() > WIDTH);
            assert_eq!(long, None, "{}", code.id);
        }
    }

    #[test]
    fn a_line_that_is_wrapped_says_the_same() {
        let list = format!("+key = [{}]", ["\"10 mm/s^2\""; 12].join(", "));
        let lines = wrapped(&list, "diff");
        assert!(lines.len() == 3 && lines.iter().all(|line| line.starts_with('+')), "{lines:#?}");
        let plain: String = lines.iter().map(|line| line[1..].trim_start()).collect::<Vec<_>>().join(" ");
        assert_eq!(plain, list[1..]);
        let command = ["specgen identify"; 9].join(" ");
        let again = wrapped(&command, "sh").join("\n").replace(" \\\n    ", " ");
        assert_eq!(again, command);
    }
}
