//! Test cases as text in `tests/cases/`: the input, and below it the expected result.
//!
//! A case is a block of lines; an empty line ends it. Its first line names it. Every other line begins with a letter or
//! sign and a space. The test defines their meaning, except for `- old` and `+ new`, which change a text, and `> …`, the
//! expected result. `SPECGEN_BLESS=1` updates the lines with `>`. A block that begins with `#` is a comment.

use std::fs;
use std::path::Path;

/// One case without its result.
#[derive(Debug, Clone)]
pub struct Case {
    /// The first line.
    pub title: String,
    /// Sign and text of the other lines; consecutive lines with the same sign are one text.
    pub parts: Vec<(char, String)>,
}

impl Case {
    fn of(lines: &[&str]) -> Self {
        let mut parts: Vec<(char, String)> = Vec::new();
        for line in &lines[1..] {
            let sign = line.chars().next().unwrap_or_default();
            let text = &line[sign.len_utf8()..];
            assert!(text.is_empty() || text.starts_with(' '), "a sign and a space: {line}");
            let text = text.strip_prefix(' ').unwrap_or_default();
            match parts.last_mut() {
                Some((last, whole)) if *last == sign => *whole += &format!("\n{text}"),
                _ => parts.push((sign, text.to_owned())),
            }
        }
        Self { title: lines[0].to_owned(), parts }
    }

    /// The texts with a sign.
    pub fn all(&self, sign: char) -> impl DoubleEndedIterator<Item = &str> {
        self.parts.iter().filter(move |part| part.0 == sign).map(|part| part.1.as_str())
    }

    /// The last text with a sign, if there is one.
    pub fn one(&self, sign: char) -> Option<&str> {
        self.all(sign).next_back()
    }

    /// A text with all changes.
    ///
    /// # Panics
    /// If a change finds nothing to replace.
    pub fn edited(&self, text: &str) -> String {
        self.all('-').zip(self.all('+')).fold(text.to_owned(), |text, (old, new)| replaced(&text, old, new))
    }
}

/// A text with the first place of a part replaced.
///
/// # Panics
/// If there is none.
pub fn replaced(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "no `{old}`");
    text.replacen(old, new, 1)
}

/// Cases of a file, each with the lines of its expected result.
///
/// # Panics
/// If there is no such file, or no case in it.
pub fn read(file: &Path) -> Vec<(Case, String)> {
    let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let blocks = text.trim_end().split("\n\n").filter(|block| !block.starts_with('#'));
    let cases = blocks.map(|block| {
        let (given, came): (Vec<&str>, Vec<&str>) = block.lines().partition(|line| !line.starts_with('>'));
        (Case::of(&given), came.join("\n"))
    });
    let cases: Vec<_> = cases.collect();
    assert!(!cases.is_empty(), "{}", file.display());
    cases
}

/// Compares the result of every `step`th case of a file with the expected one, or updates it if `SPECGEN_BLESS` is set.
///
/// # Panics
/// With all differences.
pub fn hold(file: &Path, step: usize, mut run: impl FnMut(&Case) -> String) {
    let is_new = std::env::var_os("SPECGEN_BLESS").is_some();
    let (mut stale, mut lines) = (Vec::new(), Vec::new());
    for (case, expected) in read(file).into_iter().step_by(if is_new { 1 } else { step }) {
        let found: Vec<String> = run(&case).lines().map(|line| format!("> {line}").trim_end().to_owned()).collect();
        let found = found.join("\n");
        if found != expected {
            stale.push(format!("{}\nwas\n{expected}\nis\n{found}\n", case.title));
        }
        lines.push(found);
    }
    if is_new {
        let text = fs::read_to_string(file).unwrap();
        let mut lines = lines.into_iter();
        let block = |block: &str| {
            let given: String =
                block.lines().filter(|line| !line.starts_with('>')).map(|line| format!("{line}\n")).collect();
            let came = if block.starts_with('#') { None } else { lines.next().filter(|came| !came.is_empty()) };
            came.map_or(given.clone(), |came| format!("{given}{came}\n"))
        };
        let blocks: Vec<String> = text.trim_end().split("\n\n").map(block).collect();
        fs::write(file, blocks.join("\n")).unwrap();
        return;
    }
    let count = stale.len();
    assert!(
        stale.is_empty(),
        "{count} cases of {} differ; SPECGEN_BLESS=1 accepts:\n{}",
        file.display(),
        stale.join("\n")
    );
}
