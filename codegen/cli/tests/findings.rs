//! The page of every finding: its example gives the finding, and the fix removes it.

use std::collections::BTreeMap;
use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::support::commands::{is_marked, shell};
use crate::support::{Document, repository};
use specgen::diagnostic::{Code, Severity, codes};

/// A block of code, and the file that is named above it.
struct Block<'a> {
    file: &'a str,
    language: &'a str,
    lines: Vec<&'a str>,
}

fn blocks(text: &str) -> Vec<Block<'_>> {
    let (mut found, mut file, mut open): (Vec<Block>, _, Option<Block>) = (Vec::new(), "", None);
    for line in text.lines() {
        match (line.strip_prefix("```"), &mut open) {
            (Some(language), None) => open = Some(Block { file, language, lines: Vec::new() }),
            (Some(_), Some(_)) => found.extend(open.take()),
            (None, Some(block)) => block.lines.push(line),
            (None, None) => {
                let named = line.strip_prefix('`').and_then(|line| line.trim_end_matches(" with").strip_suffix('`'));
                file = named.filter(|name| !name.contains('`')).unwrap_or(file);
            }
        }
    }
    found
}

/// A line of a spec without its comment.
fn bare(line: &str) -> &str {
    line.split_once(" #").map_or(line, |(before, _)| before).trim_end()
}

/// The lines that begin with one of the signs, without it.
fn signed<'a>(lines: &[&'a str], signs: &str) -> Vec<&'a str> {
    lines.iter().filter(|line| line.starts_with(|sign| signs.contains(sign))).map(|line| &line[1..]).collect()
}

/// Applies a change to `text`: lines with `-` and lines without a sign, after the line given in `@@`, are replaced by lines with `+`
/// and those without a sign. Lines with only `+` are inserted after that line, or at the end. `fix`: lines that replace the last
/// lines with `+`.
fn changed(text: &str, change: &[&str], fix: Option<&[&str]>) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let mut hunks: Vec<(&str, &[&str])> = Vec::new();
    let mut rest = change;
    while let [first, behind @ ..] = rest {
        let (anchor, body) = match first.strip_prefix("@@") {
            Some(anchor) => (anchor.trim_end_matches('@').trim(), behind),
            None => ("", rest),
        };
        let length = body.iter().position(|line| line.starts_with("@@")).unwrap_or(body.len());
        hunks.push((anchor, &body[..length]));
        rest = &body[length..];
    }
    for (k, (anchor, body)) in hunks.iter().enumerate() {
        let old = signed(body, " -");
        let new = match fix.filter(|_| k + 1 == hunks.len()) {
            None => signed(body, " +"),
            Some(fix) => {
                let first = body.iter().position(|line| line.starts_with('+')).unwrap_or(body.len());
                [signed(&body[..first], " "), fix.to_vec(), signed(&body[first..], " ")].concat()
            }
        };
        let start = if anchor.is_empty() {
            0
        } else {
            lines.iter().position(|line| bare(line) == *anchor).unwrap_or_else(|| panic!("no line `{anchor}`"))
        };
        let at = match (old.is_empty(), anchor.is_empty()) {
            (true, true) => lines.len(),
            (true, false) => start + 1,
            _ => (start..=lines.len() - old.len())
                .find(|&at| lines[at..at + old.len()].iter().zip(&old).all(|(line, old)| bare(line) == *old))
                .unwrap_or_else(|| panic!("no lines {old:?}")),
        };
        lines.splice(at..at + old.len(), new);
    }
    lines.join("\n") + "\n"
}

/// Codes of what was found, and the exit code.
type Outcome = (Vec<String>, i32);

/// Results of commands on the repository's own files: most fixes give these files.
type Known = Mutex<BTreeMap<String, Outcome>>;

/// Runs the example of a page, with the fix applied if `is_fixed`, and returns the outcome; none if it cannot be run here.
fn outcome(page: &str, is_fixed: bool, known: &Known) -> Option<Outcome> {
    let (example, fix) = page.split_once("\n## Example\n").unwrap().1.split_once("\n## Fix\n").unwrap();
    let (example, fix) = (blocks(example), blocks(fix));
    let mut looked_at = example.iter().chain(fix.iter().filter(|_| is_fixed));
    if looked_at.any(|block| block.language == "text" || block.lines.iter().any(|line| is_marked(line))) {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    for part in ["specs", "specs/features", "specs/records", "specs/waveforms"] {
        fs::create_dir(folder.path().join(part)).unwrap();
        for entry in fs::read_dir(repository().join(part)).unwrap().map(Result::unwrap) {
            if entry.path().is_file() {
                fs::copy(entry.path(), folder.path().join(part).join(entry.file_name())).unwrap();
            }
        }
    }
    let (commands, mut files): (Vec<&Block>, Vec<&Block>) = example.iter().partition(|block| block.language == "sh");
    let (new_commands, new_lines): (Vec<&Block>, Vec<&Block>) = fix.iter().partition(|block| block.language == "sh");
    let checked = files.iter().map(|block| block.file).find(|file| file.ends_with(".toml"));
    if is_fixed && fix.is_empty() {
        // The unchanged file.
        files.pop();
    }
    let mut is_changed = false;
    for (k, block) in files.iter().enumerate() {
        let lines = new_lines.first().filter(|_| is_fixed && k + 1 == files.len()).map(|fix| fix.lines.as_slice());
        let path = folder.path().join(block.file);
        let before = fs::read_to_string(&path).unwrap_or_default();
        let text = if block.language == "diff" {
            changed(&before, &block.lines, lines)
        } else {
            lines.unwrap_or(&block.lines).join("\n") + "\n"
        };
        is_changed |= !text.lines().map(bare).eq(before.lines().map(bare));
        fs::write(&path, text).unwrap();
    }
    let commands = if is_fixed && !new_commands.is_empty() { new_commands } else { commands };
    let script = commands.first().map_or_else(
        || format!("specgen check {}", checked.unwrap_or_else(|| panic!("no spec"))),
        // A command that goes on in the next line is one.
        |block| block.lines.join("\n").replace("\\\n", ""),
    );
    if let Some(outcome) = known.lock().unwrap().get(&script).filter(|_| !is_changed) {
        return Some(outcome.clone());
    }
    let (before, last) = script.rsplit_once('\n').unwrap_or(("", &script));
    let run = shell(folder.path(), before);
    assert_eq!(run.code, 0, "{before}: {run:?}");
    let document = Document::of(&shell(folder.path(), &format!("{last} --json")));
    let found = document.findings().iter().map(|one| one["code"].as_str().unwrap().to_owned()).collect();
    let outcome: Outcome = (found, document.code);
    if !is_changed {
        known.lock().unwrap().insert(script, outcome.clone());
    }
    Some(outcome)
}

/// Checks the example of a code. Returns whether it was run, or the error.
fn judged(code: Code, page: &str, known: &Known) -> Result<bool, String> {
    let Some((found, exit)) = outcome(page, false, known) else { return Ok(false) };
    if !found.iter().any(|one| one == code.id) {
        return Err(format!("{}: the example gives {found:?}", code.id));
    }
    if code.severity() == Severity::Error && exit != 1 {
        return Err(format!("{}: the example ends with {exit}", code.id));
    }
    let Some((found, exit)) = outcome(page, true, known) else { return Ok(true) };
    if exit != 0 || found.iter().any(|one| one == code.id) {
        return Err(format!("{}: the fix gives {found:?} and ends with {exit}", code.id));
    }
    Ok(true)
}

#[test]
fn every_example_gives_its_finding_and_every_fix_removes_it() {
    let (next, known) = (AtomicUsize::new(0), Known::default());
    // In the short run, every twentieth.
    let codes: Vec<Code> = specgen::findings::all().into_iter().step_by(crate::support::length(20, 1)).collect();
    let judge = || {
        let next = || codes.get(next.fetch_add(1, Ordering::Relaxed));
        std::iter::from_fn(next).map(|code| judged(*code, &code.page(), &known)).collect::<Vec<_>>()
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let judged: Vec<Result<bool, String>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(judge)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    let wrong: Vec<&str> = judged.iter().filter_map(|one| one.as_ref().err()).map(String::as_str).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), judged.len(), wrong.join("\n"));
    let not_run = judged.iter().filter(|one| **one == Ok(false)).count();
    println!("{} findings; the examples of {not_run} are not run", judged.len());
    assert_eq!(judged.len(), codes.len());
    assert!(100 * not_run <= 15 * judged.len(), "{not_run} examples are not run");
}

/// The check detects errors.
#[test]
fn an_example_that_shows_nothing_and_a_fix_that_does_not_help_are_seen() {
    let known = Known::default();
    let with = |code: Code, old: &str, new: &str| {
        assert!(code.page().contains(old), "no `{old}`");
        judged(code, &code.page().replacen(old, new, 1), &known)
    };
    assert_eq!(judged(codes::SLEW_BELOW_CODE, &codes::SLEW_BELOW_CODE.page(), &known), Ok(true));
    let shows_nothing = with(codes::SLEW_BELOW_CODE, "\"4 V/s\"", "\"4 V/ms\"").unwrap_err();
    assert!(shows_nothing.contains("the example gives"), "{shows_nothing}");
    let does_not_help = with(codes::SLEW_BELOW_CODE, "\"40 V/ms\"\n```\n", "\"5 V/s\"\n```\n");
    assert!(does_not_help.is_err_and(|why| why.contains("the fix gives")));
}

#[test]
fn changes_are_made_where_they_say() {
    let text = "a = 1  # one\n[x]\nb = 2\nb = 2\n[y]\nb = 2\n";
    for (change, fix, expected) in [
        (&["-a = 1", "+a = 3"][..], None, "a = 3\n[x]\nb = 2\nb = 2\n[y]\nb = 2\n"),
        (&["@@ [y] @@", "-b = 2", "+b = 3"], None, "a = 1  # one\n[x]\nb = 2\nb = 2\n[y]\nb = 3\n"),
        (&["@@ [x] @@", " b = 2", "+c = 3"], None, "a = 1  # one\n[x]\nb = 2\nc = 3\nb = 2\n[y]\nb = 2\n"),
        (&["@@ [x] @@", "+c = 3"], None, "a = 1  # one\n[x]\nc = 3\nb = 2\nb = 2\n[y]\nb = 2\n"),
        (&["+[z]", "+c = 3"], None, "a = 1  # one\n[x]\nb = 2\nb = 2\n[y]\nb = 2\n[z]\nc = 3\n"),
        (&["-a = 1", "@@ [y] @@", "-b = 2", "+b = 3"], Some(&["b = 4"][..]), "[x]\nb = 2\nb = 2\n[y]\nb = 4\n"),
        (
            &["@@ [y] @@", " [y]", "+c = 3", " b = 2"],
            Some(&["d = 4"]),
            "a = 1  # one\n[x]\nb = 2\nb = 2\n[y]\nd = 4\nb = 2\n",
        ),
    ] {
        assert_eq!(changed(text, change, fix), expected, "{change:?}");
    }
}
