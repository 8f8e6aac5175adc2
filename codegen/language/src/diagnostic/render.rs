//! Findings as text: file, line, column, the line itself with a mark below it, and the fix.

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use super::position;
use super::{Diagnostic, Place, Severity};
use crate::SpecSource;
use crate::lines::Lines;

/// Longest part of a line that is shown, characters.
const MAX_SHOWN: usize = 160;

/// Line width; fixed, so that the same findings give the same text everywhere.
const WIDTH: usize = 140;

/// All findings in turn, and a last line with their number; empty without findings.
pub fn render(diagnostics: &[Diagnostic], source: &SpecSource, color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH);
    let lines = Lines::new(&source.text);
    let mut text = String::new();
    for diagnostic in diagnostics {
        text.push_str(&one(diagnostic, source, &lines, &renderer));
        text.push_str("\n\n");
    }
    if !diagnostics.is_empty() {
        text.push_str(&count(diagnostics));
        text.push('\n');
    }
    text
}

fn count(diagnostics: &[Diagnostic]) -> String {
    let of = |severity| diagnostics.iter().filter(|d| d.severity == severity).count();
    let plural = |n: usize, word: &str| format!("{n} {word}{}", if n == 1 { "" } else { "s" });
    format!("{}, {}", plural(of(Severity::Error), "error"), plural(of(Severity::Warning), "warning"))
}

fn one(diagnostic: &Diagnostic, source: &SpecSource, lines: &Lines<'_>, renderer: &Renderer) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let message = visible(&diagnostic.message);
    let help = visible(&diagnostic.help);
    let title = level.primary_title(message).id(diagnostic.code);
    let group: Group<'_> = match &diagnostic.place {
        Place::Whole => title.element(Level::HELP.message(help)),
        Place::File { path, line } => {
            let origin = Origin::path(visible(path));
            title
                .element(if let Some(line) = line { origin.line(*line) } else { origin })
                .element(Level::HELP.message(help))
        }
        Place::Spec(span) => {
            let spot = lines.spot(span);
            let window = position::window(spot.line_text, spot.in_line.clone(), MAX_SHOWN);
            let path = visible(&source.display_name);
            if window.cut_left {
                // The snippet would count the column from the cut, so state the position and show the part below.
                let origin = Origin::path(path).line(spot.line).char_column(spot.column);
                let snippet = Snippet::source(without_c1(&window.text))
                    .line_start(spot.line)
                    .annotation(AnnotationKind::Primary.span(window.span));
                title.element(origin).element(snippet).element(Level::HELP.message(help))
            } else {
                let snippet = Snippet::source(without_c1(&window.text))
                    .path(path)
                    .line_start(spot.line)
                    .annotation(AnnotationKind::Primary.span(window.span));
                title.element(snippet).element(Level::HELP.message(help))
            }
        }
    };
    renderer.render(&[group])
}

/// Escapes control characters, which a terminal would interpret; line breaks of our own texts stay.
fn visible(text: &str) -> String {
    text.chars()
        .flat_map(|c| if c.is_control() && c != '\n' { c.escape_default().collect::<Vec<_>>() } else { vec![c] })
        .collect()
}

/// Replaces U+0080 to U+009F, which the snippet would keep and a terminal may interpret, by a mark of the same length
/// in UTF-8, so that spans stay valid.
fn without_c1(line: &str) -> String {
    line.chars().map(|c| if matches!(c, '\u{80}'..='\u{9f}') { '\u{bf}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::codes;

    #[test]
    fn no_control_character_of_a_spec_reaches_the_terminal() {
        let text =
            format!("a = {}\n", ('\u{1}'..='\u{9f}').filter(|c| c.is_control() && *c != '\n').collect::<String>());
        let source = SpecSource { display_name: "x\u{9b}.toml".to_owned(), text, dir: ".".into() };
        let place = Place::Spec(4..source.text.len() - 1);
        let finding = Diagnostic::new(codes::SYNTAX, "", place, "m\u{85}", "h");
        let shown = render(&[finding], &source, false);
        assert!(!shown.contains(|c: char| c.is_control() && c != '\n'), "{shown:?}");
    }
}
