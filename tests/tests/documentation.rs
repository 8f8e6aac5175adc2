//! Form of the documentation: widths, lengths, words, and the table of contents of the book.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use specgen_tests::repository;

/// Letters in a line of text, or in a cell of a table.
const WIDTH: usize = 120;
/// Pages whose lines are those of emitted files.
const EMITTED: &str = "codegen/compiler/src/emit/pages";
/// Words of the hand-written pages in `docs`, as `wc -w` counts them.
const WORDS: usize = 40_000;
/// Lines of the two pages that everyone reads.
const LINES: [(&str, usize); 2] = [("README.md", 80), ("ARCHITECTURE.md", 100)];
/// Pages of the book that `cargo xtask book` generates; what is committed says how to get them.
const GENERATED: [&str; 5] =
    ["dependencies.md", "diagnostics.md", "settings.md", "spec-reference.md", "traceability.md"];
/// Private words of this project, or of another language's grammar, for which the field has a word.
const BANNED: [&str; 16] = [
    "soak",
    "desk",
    "hall",
    "said",
    "told",
    "stand",
    "stands",
    "stood",
    "whoever",
    "anew",
    "first power",
    "the orders",
    "has orders",
    "go down",
    "goes down",
    "gone down",
];

/// Folders whose Rust sources are free of [`BANNED`] words in comments and in texts.
const PLAIN: [&str; 19] = [
    "codegen/cli/src",
    "codegen/compiler/src",
    "codegen/identify/src",
    "codegen/ir/src",
    "codegen/language/src",
    "codegen/numerics/src",
    "codegen/operate/src",
    "codegen/report/src",
    "codegen/run-time/src",
    "codegen/studies/src",
    "codegen/toolchain/src",
    "firmware/board/src",
    "firmware/law/src",
    "firmware/link/src",
    "firmware/rt-pc/src",
    "firmware/rt/src",
    "firmware/runtime/src",
    "host-sim/src",
    "xtask/src",
];
/// Participles and private words that must not be the name of a type.
const BANNED_TYPES: [&str; 40] = [
    "Asked", "Awaited", "Begun", "Broken", "Built", "Chosen", "Claimed", "Compared", "Compiled", "Computed", "Copied",
    "Declared", "Denied", "Desk", "Ended", "Examined", "Finished", "Followed", "Found", "Given", "Hall", "Heard",
    "Held", "Judged", "Kept", "Learned", "Learnt", "Made", "Moved", "Noticed", "Owed", "Prepared", "Ran", "Refused",
    "Said", "Seen", "Shown", "Told", "Tried", "Wanted",
];

/// Texts of the files with this ending below a folder, by path from the repository.
fn texts_in(folder: &Path, ending: &str, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            if !name.starts_with('.') && !["target", "out"].contains(&name) {
                texts_in(&path, ending, found);
            }
        } else if name.ends_with(ending) {
            let place = path.strip_prefix(repository()).unwrap().to_str().unwrap().to_owned();
            found.push((place, fs::read_to_string(&path).unwrap()));
        }
    }
    found.sort();
}

fn pages(folder: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    texts_in(&repository().join(folder), ".md", &mut found);
    found
}

/// Lines outside of code blocks, with their numbers.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut is_code = false;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if !is_code && !is_fence {
            lines.push((number, line));
        }
    }
    lines
}

/// Numbers of the lines of text, or of rows with a cell, that are longer than `width`.
fn too_long(text: &str, width: usize) -> Vec<usize> {
    let is_long = |text: &str| text.chars().count() > width;
    let lines = prose(text).into_iter().filter(|(_, line)| {
        if line.starts_with('|') {
            line.replace("\\|", "/").trim_matches('|').split('|').any(|cell| is_long(cell.trim()))
        } else {
            is_long(line)
        }
    });
    lines.map(|(number, _)| number).collect()
}

/// Words as `wc -w` counts them: code, numbers and the bars of tables too.
fn words(text: &str) -> usize {
    text.split_whitespace().count()
}

/// Banned words in a text, with their lines; code is left out.
fn banned(text: &str) -> Vec<(usize, &'static str)> {
    let mut found = Vec::new();
    for (number, line) in prose(text) {
        let plain: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`").to_lowercase();
        let plain = format!(" {} ", plain.replace(|c: char| !c.is_alphanumeric() && !"-_".contains(c), " "));
        found.extend(BANNED.into_iter().filter(|word| plain.contains(&format!(" {word} "))).map(|word| (number, word)));
    }
    found
}

#[test]
fn no_line_and_no_cell_is_too_long() {
    let pages = pages("");
    assert!(pages.len() > 300, "{}", pages.len());
    let mut long = Vec::new();
    for (name, text) in pages.iter().filter(|(name, _)| !name.starts_with(EMITTED)) {
        // A release indents the lines of a fragment.
        let width = if name.starts_with("changelog/") { WIDTH - 2 } else { WIDTH };
        long.extend(too_long(text, width).into_iter().map(|line| format!("{name}:{line}")));
    }
    assert!(long.is_empty(), "longer than {WIDTH}, in changelog/ than {}: {long:#?}", WIDTH - 2);
}

#[test]
fn the_documentation_keeps_its_length() {
    for (name, most) in LINES {
        let lines = fs::read_to_string(repository().join(name)).unwrap().lines().count();
        assert!(lines <= most, "{name} has {lines} lines; at most {most}");
    }
    let pages = pages("docs");
    let written = pages.iter().filter(|(name, _)| !GENERATED.iter().any(|page| name.ends_with(page)));
    let words: usize = written.map(|(_, text)| words(text)).sum();
    println!("{words} words in docs");
    assert!((10_000..=WORDS).contains(&words), "docs has {words} words; at most {WORDS}");
}

#[test]
fn generated_pages_are_not_committed() {
    for name in GENERATED {
        let text = fs::read_to_string(repository().join("docs").join(name)).unwrap();
        assert!(text.lines().count() < 15 && text.contains("`cargo xtask book`"), "docs/{name}");
    }
}

#[test]
fn banned_words_are_not_used() {
    let root = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"];
    let root = root.map(|name| (name.to_owned(), fs::read_to_string(repository().join(name)).unwrap()));
    let mut found = Vec::new();
    for (name, text) in root.iter().chain(&pages("docs")) {
        found.extend(banned(text).into_iter().map(|(line, word)| format!("{name}:{line}: {word}")));
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_table_of_contents_has_every_page_once() {
    let contents = fs::read_to_string(repository().join("docs/SUMMARY.md")).unwrap();
    let listed: Vec<String> =
        contents.split("](").skip(1).map(|link| format!("docs/{}", link.split(')').next().unwrap())).collect();
    let once: BTreeSet<&String> = listed.iter().collect();
    assert_eq!(listed.len(), once.len(), "a page is listed twice");
    let pages = pages("docs");
    let there: BTreeSet<&String> =
        pages.iter().map(|(name, _)| name).filter(|name| !name.ends_with("SUMMARY.md")).collect();
    assert_eq!(once, there);
}

/// Comments and string literals of a line of Rust; code is left out.
fn texts(line: &str) -> String {
    let (code, comment) = line.split_once("//").map_or((line, ""), |(code, comment)| (code, comment));
    let literals: String = code.split('"').skip(1).step_by(2).collect::<Vec<_>>().join(" ");
    format!("{literals} {}", comment.trim_start_matches(['/', '!']))
}

/// Banned words in Rust sources, with their lines.
fn banned_in_source(text: &str) -> Vec<(usize, &'static str)> {
    let lines = (1..).zip(text.lines());
    lines.flat_map(|(number, line)| banned(&texts(line)).into_iter().map(move |(_, word)| (number, word))).collect()
}

/// Types with a banned name that a line declares.
fn banned_type(line: &str) -> Option<&str> {
    let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
    words.find(|word| ["struct", "enum", "trait", "type"].contains(word))?;
    words.next().filter(|name| BANNED_TYPES.contains(name))
}

#[test]
fn sources_use_plain_words() {
    let mut found = Vec::new();
    for folder in PLAIN {
        let mut files = Vec::new();
        texts_in(&repository().join(folder), ".rs", &mut files);
        assert!(files.len() > 5, "{folder}");
        for (name, text) in files {
            found.extend(banned_in_source(&text).into_iter().map(|(line, word)| format!("{name}:{line}: {word}")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn types_have_nouns_as_names() {
    let (mut files, mut found) = (Vec::new(), Vec::new());
    for folder in ["codegen", "examples", "firmware", "host-sim", "tests", "xtask"] {
        texts_in(&repository().join(folder), ".rs", &mut files);
    }
    assert!(files.len() > 1000, "{}", files.len());
    for (name, text) in files {
        let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        found.extend(lines.filter_map(banned_type).map(|banned| format!("{name}: {banned}")));
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// The book has no page outside of `docs`, and does not show its table of contents as a page.
#[test]
fn links_of_the_book_lead_to_its_pages() {
    for (name, text) in pages("docs") {
        let folder = Path::new(&name).parent().unwrap().to_owned();
        for link in prose(&text).iter().flat_map(|(_, line)| line.split("](").skip(1)) {
            let target = link.split([')', '#']).next().unwrap();
            if !target.contains("://") && !target.is_empty() {
                let climbs = target.matches("../").count() > folder.components().count() - 1;
                assert!(!climbs && target != "SUMMARY.md", "{name} links to {target}, which the book does not have");
                assert!(repository().join(&folder).join(target).is_file(), "{name} links to {target}");
            }
        }
    }
}

#[test]
fn what_is_too_long_or_banned_is_found() {
    let (good, bad) = ("a".repeat(WIDTH), "ä".repeat(WIDTH + 1));
    let text = format!("{good}\n{bad}\n| {good} | {good} |\n| x | {bad} |\n```text\n{bad}\n```\n{bad}\n");
    assert_eq!(too_long(&text, WIDTH), [2, 4, 8]);
    assert_eq!(words("One, two - `three` 4\n```sh\nfive\n```\n| six | 7 |"), 13);
    let text = "A machine that Stands,\nunderstands `stands` standard\n```text\nsoak\n```\nis told";
    assert_eq!(banned(text), [(1, "stands"), (6, "told")]);
    let source = "/// As told.\nlet desk = \"it stands\"; // `said`, anew\n";
    assert_eq!(banned_in_source(source), [(1, "told"), (2, "stands"), (2, "anew")]);
    let name = "Found";
    assert_eq!(banned_type(&format!("    pub(crate) struct {name}<'a> {{")), Some(name));
    assert_eq!(banned_type("fn found(said: Said) -> Foundation {"), None);
}
