//! Finds printed texts in the sources that look like shell commands.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::repository;

/// Programs that commands start with.
pub const PROGRAMS: [&str; 25] = [
    "specgen", "cargo", "rustup", "apt-get", "apt", "sudo", "python3", "pip", "iconv", "gunzip", "probe-rs", "usermod",
    "setcap", "modprobe", "cpupower", "taskset", "cat", "cc", "sh", "brew", "dnf", "chmod", "cp", "mv", "rt-pc",
];
/// Sources of the product, without tests.
pub fn sources() -> Vec<PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.file_stem().is_some_and(|stem| stem == "tests") {
                continue;
            }
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|end| end == "rs") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    for part in ["codegen", "firmware"] {
        for entry in fs::read_dir(repository().join(part)).unwrap() {
            let source = entry.unwrap().path().join("src");
            if source.is_dir() {
                walk(&source, &mut found);
            }
        }
    }
    found.sort();
    found
}

/// Code above the tests, without comments.
pub fn code(text: &str) -> String {
    let lines = text.lines().take_while(|line| !line.contains("#[cfg(test)]"));
    lines.filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// String literals, with escapes resolved and continued lines joined.
pub fn literals(code: &str) -> Vec<String> {
    let (mut found, mut rest) = (Vec::new(), code);
    while let Some(start) = rest.find('"') {
        if let Some(raw) = rest[..start].ends_with("r#").then(|| &rest[start + 1..]) {
            let end = raw.find("\"#").unwrap_or(raw.len());
            found.push(raw[..end].to_owned());
            rest = raw.get(end + 2..).unwrap_or_default();
            continue;
        }
        // `'"'` is a letter.
        let is_letter = rest[..start].ends_with('\'') && rest[start + 1..].starts_with('\'');
        let mut text = String::new();
        let mut letters = rest[start + 1..].char_indices();
        let mut end = rest.len();
        while let Some((at, letter)) = letters.next() {
            match letter {
                '"' => {
                    end = start + 1 + at + 1;
                    break;
                }
                '\\' => match letters.next() {
                    Some((_, 'n')) => text.push('\n'),
                    Some((_, '\n')) => {
                        let behind = &rest[start + 1..][at + 2..];
                        let skip = behind.len() - behind.trim_start().len();
                        (0..skip).for_each(|_| {
                            letters.next();
                        });
                    }
                    Some((_, other)) => text.push(other),
                    None => {}
                },
                other => text.push(other),
            }
        }
        if is_letter {
            rest = &rest[start + 1..];
            continue;
        }
        found.push(text);
        rest = &rest[end.min(rest.len())..];
    }
    found
}

/// Commands within a text: texts between backticks, and the text itself, if they start with a program.
pub fn lines(text: &str) -> Vec<String> {
    let quoted = text.split('`').skip(1).step_by(2);
    let begins =
        |line: &&str| line.split_once(' ').is_some_and(|(first, rest)| PROGRAMS.contains(&first) && !rest.is_empty());
    quoted.chain([text]).map(str::trim).filter(begins).map(str::to_owned).collect()
}

/// Number of places in a source where a command is built.
pub fn built(code: &str) -> usize {
    ["shell::line(", "shell::on(", "shell::converted(", "shell::as_utf8("]
        .iter()
        .map(|call| code.matches(call).count())
        .sum()
}

/// Whether a text is a sentence about a command, not a command.
pub fn is_sentence(line: &str) -> bool {
    line.contains(['<', '\n', '|']) || line.ends_with(['.', ':', ';']) || line.split(' ').count() > 14
}

#[test]
fn a_loose_line_is_seen() {
    let code = code(
        "let a = \"save it: `iconv -f {x} > {y}`\"; // `cp {a} {b}`\nlet b = format!(\"specgen sim \\\n    {spec}\");\nlet c = '\"';\n#[cfg(test)]\nlet d = \"cat {x}\";",
    );
    let found: Vec<String> = literals(&code).iter().flat_map(|text| lines(text)).collect();
    assert_eq!(found, ["iconv -f {x} > {y}", "specgen sim {spec}"]);
    assert_eq!(built("shell::on(\"a\", b, \"\"); shell::line(\"c\")"), 2);
}
