//! Commands of help texts and documents, as a shell would read them.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{BINARY, Run, repository};

/// Marks of lines that a test only parses; the main help explains them.
const MARKS: [&str; 2] = ["(minutes)", "(board)"];

/// A command line and its location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    pub place: String,
    /// The line, including its comment.
    pub text: String,
    /// `specgen` and its arguments.
    pub words: Vec<String>,
}

impl Line {
    /// The line if it calls specgen, by name or by cargo from a checkout.
    pub fn of(place: &str, line: &str) -> Option<Self> {
        let text = line.trim();
        let called = ["specgen ", "cargo run --release -- "].into_iter().find_map(|call| text.strip_prefix(call))?;
        let words = shlex::split(called).unwrap_or_else(|| panic!("{place}: no shell takes `{text}`"));
        let ends = |word: &String| ["|", "&", "&&", ";", "<"].contains(&word.as_str()) || word.starts_with('>');
        let arguments = words.iter().take_while(|word| !ends(word)).cloned();
        let words = std::iter::once("specgen".to_owned()).chain(arguments).collect();
        Some(Self { place: place.to_owned(), text: text.to_owned(), words })
    }

    pub fn is_marked(&self) -> bool {
        is_marked(&self.text)
    }

    /// Why the program would refuse the line, if it would.
    pub fn fault(&self) -> Option<String> {
        use clap::error::ErrorKind::{DisplayHelp, DisplayVersion};
        let parsed = specgen::cli::command().try_get_matches_from(&self.words);
        let error = parsed.err().filter(|error| ![DisplayHelp, DisplayVersion].contains(&error.kind()))?;
        Some(format!("{}: `{}`\n{error}", self.place, self.text))
    }
}

pub fn is_marked(line: &str) -> bool {
    let remark = line.split_once(" # ").map_or("", |(_, remark)| remark);
    MARKS.iter().any(|mark| remark.trim_start().starts_with(mark))
}

/// Names of the pages of `docs`, from the root, sorted.
pub fn pages() -> Vec<String> {
    let mut pages = Vec::new();
    for folder in ["docs", "docs/decisions"] {
        for entry in std::fs::read_dir(repository().join(folder)).unwrap() {
            pages.push(format!("{folder}/{}", entry.unwrap().file_name().to_str().unwrap()));
        }
    }
    pages.retain(|name| name.ends_with(".md"));
    pages.sort();
    pages
}

/// A block between fences.
pub struct Block {
    pub language: String,
    pub body: String,
    /// Number of its first line, from 1.
    pub line: usize,
}

pub fn blocks(markdown: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut open: Option<Block> = None;
    for (number, line) in (1..).zip(markdown.lines()) {
        match (line.strip_prefix("```"), &mut open) {
            (Some(language), None) => {
                open = Some(Block { language: language.trim().to_owned(), body: String::new(), line: number + 1 });
            }
            (Some(_), Some(_)) => found.extend(open.take()),
            (None, Some(block)) => block.body += &format!("{line}\n"),
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block without end");
    found
}

/// Runs a shell script in `folder`, with `specgen` as the program under test; stops at the first error.
pub fn shell(folder: &Path, script: &str) -> Run {
    let programs = Path::new(BINARY).parent().map(Path::to_owned).into_iter();
    let others = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(programs.chain(std::env::split_paths(&others).collect::<Vec<PathBuf>>())).unwrap();
    Run::of(Command::new("sh").args(["-ec", script]).current_dir(folder).env("PATH", path))
}
