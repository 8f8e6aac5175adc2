//! Finds comments that cite an equation, and the items that they document.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::equations::EQUATIONS;

/// A comment that cites an equation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mention {
    /// Index in [`EQUATIONS`].
    pub equation: usize,
    /// Relative to the repository, `/` between the parts.
    pub file: String,
    /// The documented item, or empty for the whole file.
    pub item: String,
    /// Line of the comment, from 1.
    pub line: usize,
    /// Whether the item is a test, or in a file of tests.
    pub test: bool,
}

/// All mentions in the `.rs` files below `folder`, in order of file and line.
pub fn folder(root: &Path, folder: &str) -> io::Result<Vec<Mention>> {
    let mut paths = Vec::new();
    collect(&root.join(folder), &mut paths)?;
    paths.sort();
    let mut mentions = Vec::new();
    for path in paths {
        let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        mentions.extend(file(&name, &fs::read_to_string(&path)?));
    }
    Ok(mentions)
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if path.file_name().is_some_and(|name| name != "target") {
                collect(&path, paths)?;
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            paths.push(path);
        }
    }
    Ok(())
}

/// Mentions in one file.
pub fn file(name: &str, text: &str) -> Vec<Mention> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let only_tests = name.contains("/tests/") || name.ends_with("/tests.rs");
    let mut mentions = Vec::new();
    for (k, line) in lines.iter().enumerate() {
        let Some(comment) = comment(line).filter(|_| !is_page(&lines[k..])) else { continue };
        for equation in cited(comment) {
            let (item, is_test) = place(&lines, k);
            let test = is_test || only_tests;
            mentions.push(Mention { equation, file: name.to_owned(), item, line: k + 1, test });
        }
    }
    mentions
}

/// Whether a comment is the page of a lint, which does not count: the code is in the rule below.
fn is_page(lines: &[&str]) -> bool {
    let declared = lines.iter().find(|line| !line.starts_with("///"));
    lines[0].starts_with("///") && declared.is_some_and(|line| is_code(line))
}

/// `NAME = "W0801";`
fn is_code(line: &str) -> bool {
    let name = line.split_once(" = \"").filter(|(_, rest)| rest.len() == 7 && rest.ends_with("\";"));
    name.is_some_and(|(name, _)| name.chars().all(|c| c.is_ascii_uppercase() || c == '_'))
}

/// The comment on a line.
fn comment(line: &str) -> Option<&str> {
    line.find("//").map(|start| &line[start..])
}

/// Indices of the equations that a text cites: `(7)`, `(AII.5)`, or all from one to another, `(AI.2)–(AI.4)`.
pub fn cited(text: &str) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut before: Option<(usize, usize)> = None;
    for (start, _) in text.match_indices('(') {
        // f(5) is not a citation.
        if text[..start].ends_with(|c: char| c.is_alphanumeric()) {
            continue;
        }
        let Some(length) = text[start..].find(')') else { break };
        let inner = &text[start + 1..start + length];
        let Some(index) = EQUATIONS.iter().position(|equation| equation.number == inner) else { continue };
        if let Some((first, end)) = before
            && &text[end..start] == "–"
        {
            found.extend(first..index);
        }
        found.insert(index);
        before = Some((index, start + length + 1));
    }
    found
}

/// The item that the comment on line `k` documents, and whether it is a test.
fn place(lines: &[&str], k: usize) -> (String, bool) {
    if lines[k].starts_with("//!") {
        return (String::new(), false);
    }
    if lines[k].starts_with("///") {
        let mut test = false;
        for line in &lines[k + 1..] {
            test |= *line == "#[test]";
            if !(line.starts_with("//") || line.starts_with("#[") || line.is_empty()) {
                return (named(line).unwrap_or_default(), test);
            }
        }
        return (String::new(), false);
    }
    // Within a body: the function above.
    for at in (0..=k).rev() {
        if let Some(name) = function(lines[at]) {
            let test = lines[..at].iter().rev().take_while(|line| line.starts_with("#[") || line.starts_with("///"));
            return (name, test.into_iter().any(|line| *line == "#[test]"));
        }
    }
    (String::new(), false)
}

/// The name that a line declares: of an item, a field or a variant.
fn named(line: &str) -> Option<String> {
    let mut words = line.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
    words
        .find(|word| {
            !matches!(
                *word,
                "pub"
                    | "crate"
                    | "super"
                    | "const"
                    | "fn"
                    | "struct"
                    | "enum"
                    | "mod"
                    | "static"
                    | "type"
                    | "unsafe"
                    | "extern"
                    | "C"
                    | "in"
                    | "trait"
            )
        })
        .map(str::to_owned)
}

fn function(line: &str) -> Option<String> {
    let start = if line.starts_with("fn ") { 3 } else { line.find(" fn ")? + 4 };
    (!line.starts_with("//")).then(|| named(&line[start..])).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<&'static str> {
        cited(text).into_iter().map(|index| EQUATIONS[index].number).collect()
    }

    #[test]
    fn single_numbers_and_ranges_are_cited() {
        assert_eq!(numbers("/// by (AII.3) or (7), f(5), (20)"), ["7", "AII.3"]);
        assert_eq!(numbers("//! (AI.2)–(AI.4) and (1)"), ["1", "AI.2", "AI.3", "AI.4"]);
        assert_eq!(numbers("/// (AI.2) – not a range – (AI.4)"), ["AI.2", "AI.4"]);
        assert!(numbers("/// none (0.5)").is_empty());
    }

    #[test]
    fn a_mention_is_placed_at_what_it_documents() {
        let text = "//! (1)\n/// (7).\n#[inline]\npub fn law() {\n    // (9)\n}\n/// (6)\n#[test]\nfn inverse() {}\n";
        let found = file("src/a.rs", text);
        let shown: Vec<_> = found.iter().map(|m| (EQUATIONS[m.equation].number, &*m.item, m.line, m.test)).collect();
        assert_eq!(
            shown,
            [("1", "", 1, false), ("7", "law", 2, false), ("9", "law", 5, false), ("6", "inverse", 7, true)]
        );
        assert!(file("crate/tests/a.rs", text)[0].test);
        assert!(file("a.rs", "fn law() { x(1) }").is_empty());
        let lint = "lints! {\n    /// as in (7)\n    ///\n    /// (9)\n    ODD = \"W0801\";\n}\n";
        assert!(file("a.rs", lint).is_empty());
        assert_eq!(file("a.rs", &lint.replace("W0801", "word")).len(), 2);
    }
}
