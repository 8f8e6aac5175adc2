//! The list of all findings: `specgen explain`, and the page *Findings* of the book.

use crate::lint;
use specgen_language::diagnostic::{Code, codes};

/// All codes, by number.
pub fn all() -> Vec<Code> {
    let mut all: Vec<Code> = codes::REGISTRY.iter().copied().chain(lint::codes()).collect();
    all.sort_by_key(|code| (&code.id[1..], &code.id[..1]));
    all
}

/// The entry of `id`.
pub fn find(id: &str) -> Option<Code> {
    all().into_iter().find(|code| code.id == id)
}

const MARKDOWN_HEAD: &str = "\
<!-- Generated from the pages in codegen/language/findings and codegen/compiler/src/lint; do not edit. -->

# Findings

Every finding has a code whose meaning never changes. E is an error: the spec is refused and nothing is written. W is a warning,
N a note. Numbers: 01 file and syntax, 02 keys and values, 03 ranges and consistency, 04 stability, reach, set-points, gauges and
supervisor, 05 records, 06 identification, 07 tuning, 08 inconsistent values. `specgen explain CODE` prints one of these pages. An
example is a change of a spec of the repository, or commands. A test runs it with and without its fix, unless it is marked
(minutes) or is in a block `text`.
";

/// The pages of all codes as one Markdown text: the page *Findings* of the book.
pub fn reference_markdown() -> String {
    let mut text = MARKDOWN_HEAD.to_owned();
    for code in all() {
        text.push('\n');
        let mut is_code = false;
        for line in code.page().lines() {
            is_code ^= line.starts_with("```");
            // One level below the heading of the document.
            if line.starts_with('#') && !is_code {
                text.push('#');
            }
            text += line;
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_well_formed_and_each_has_its_number() {
        for code in all() {
            assert!(code.id.len() == 5 && code.id.starts_with(['E', 'W', 'N']), "{}", code.id);
            assert!(code.id[1..].bytes().all(|b| b.is_ascii_digit()), "{}", code.id);
        }
        for pair in all().windows(2) {
            let [first, second] = [pair[0].id, pair[1].id].map(|id| (&id[1..], &id[..1]));
            assert!(first < second, "{} before {}", pair[0].id, pair[1].id);
        }
    }

    #[test]
    fn every_page_has_its_parts() {
        for code in all() {
            let page = code.page();
            let (heading, rest) = page.split_once("\n\n").unwrap();
            assert_eq!(heading, format!("# {}: {}", code.id, code.title()));
            let headings = ["\n## Why it matters\n\n", "\n## Example\n\n", "\n## Fix\n\n"];
            let mut parts = Vec::new();
            let mut rest = rest;
            for heading in headings {
                let (part, behind) = rest.split_once(heading).unwrap_or_else(|| panic!("{}: no {heading:?}", code.id));
                parts.push(part);
                rest = behind;
            }
            parts.push(rest);
            assert!(parts.iter().all(|part| !part.trim().is_empty()), "{}", code.id);
            // Only the text between the blocks of code.
            let text = page.split("```").step_by(2).flat_map(str::lines);
            text.for_each(|line| assert!(line.chars().count() <= 80, "{}: {line}", code.id));
        }
    }
}
