//! `assumed` names values in the spec, each once.

use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::keys::{self, Key, Kind, SECTIONS, Section};
use crate::spec::text;

const PATH: &str = "assumed";
/// Most keys that a help lists.
const MOST_LISTED: usize = 8;

pub(super) fn values(f: &Fields, findings: &mut Findings) -> Option<()> {
    let entries = f.texts(PATH)?;
    for (index, entry) in entries.iter().enumerate() {
        let before = entries[..index].iter().find(|other| is_covered(other, entry) || is_covered(entry, other));
        let problem = match (of(entry), before) {
            (None, _) => Some((codes::ASSUMED_UNKNOWN, unknown(f, entry))),
            (Some(named), _) if !named.stands_in(f, entry) => {
                if is_reported(findings, entry) {
                    continue;
                }
                Some((codes::ASSUMED_UNKNOWN, absent(entry)))
            }
            (Some(_), Some(other)) => Some((codes::ASSUMED_TWICE, twice(entry, other))),
            (Some(_), None) => None,
        };
        if let Some((code, Problem { message, help, replacement })) = problem {
            let key = format!("{PATH}[{index}]");
            findings.add(code, &key, f.item_span(PATH, index), message, help);
            findings.replace_by(&key, replacement);
        }
    }
    Some(())
}

struct Problem {
    message: String,
    help: String,
    replacement: Option<String>,
}

/// Kind of the object that an entry names.
enum EntryKind {
    Key,
    /// Every table of a repeated section, or one of them.
    Tables,
}

/// The key or repeated section that `entry` names; none for a key before the first section.
fn of(entry: &str) -> Option<EntryKind> {
    let bare = without_indices(entry)?;
    if keys::section(&bare).is_some_and(|section| matches!(section.kind, Kind::Repeated(..))) {
        return Some(EntryKind::Tables);
    }
    (bare.contains('.') && keys::key(&bare).is_some()).then_some(EntryKind::Key)
}

impl EntryKind {
    /// Whether the spec has the object that `entry` names, also as a default.
    fn stands_in(&self, f: &Fields, entry: &str) -> bool {
        let has = |path: &str| match split_index(path) {
            (list, Some(item)) => f.get(list).is_some_and(|field| item < field.items.len()),
            (path, None) => f.get(path).is_some(),
        };
        match (self, entry.rsplit_once('.')) {
            (Self::Tables, _) => match split_index(entry) {
                (section, Some(table)) => table < f.count(section),
                (section, None) => f.count(section) > 0,
            },
            // `gauge.point` covers every gauge.
            (Self::Key, Some((section, key))) if f.count(section) > 0 => {
                (0..f.count(section)).any(|table| has(&format!("{section}[{table}].{key}")))
            }
            (Self::Key, _) => has(entry),
        }
    }
}

/// `gauge[2].point` as `gauge.point`; none if that is not a path.
fn without_indices(entry: &str) -> Option<String> {
    let parts: Option<Vec<&str>> = entry
        .split('.')
        .map(|part| match part.split_once('[') {
            None => Some(part),
            Some((name, rest)) => rest.strip_suffix(']').filter(|index| index.parse::<usize>().is_ok()).map(|_| name),
        })
        .collect();
    parts.map(|parts| parts.join("."))
}

/// `workspace.translation[2]` as `workspace.translation` and 2.
fn split_index(path: &str) -> (&str, Option<usize>) {
    let split = path.strip_suffix(']').and_then(|path| path.rsplit_once('['));
    split.map_or((path, None), |(list, index)| (list, index.parse().ok()))
}

/// Whether `other` includes everything that `entry` names.
fn is_covered(entry: &str, other: &str) -> bool {
    let parts = |path: &str| {
        path.split('.')
            .map(|part| {
                part.split_once('[')
                    .map_or((part.to_owned(), None), |(name, index)| (name.to_owned(), Some(index.to_owned())))
            })
            .collect::<Vec<_>>()
    };
    let (inner, outer) = (parts(entry), parts(other));
    outer.len() <= inner.len()
        && outer
            .iter()
            .zip(&inner)
            .all(|(outer, inner)| outer.0 == inner.0 && (outer.1.is_none() || outer.1 == inner.1))
}

/// Whether the value, or the section that it belongs in, has a finding already.
fn is_reported(findings: &Findings, entry: &str) -> bool {
    let section = entry.rsplit_once('.').map_or(entry, |(section, _)| section);
    findings.mentions_item(split_index(entry).0) || findings.mentions(&[section])
}

fn twice(entry: &str, other: &str) -> Problem {
    let message = if entry == other {
        format!("\"{entry}\" is named twice")
    } else {
        format!("\"{entry}\" and \"{other}\" name the same value")
    };
    Problem { message, help: "remove one of the two: the verdict counts each value once".to_owned(), replacement: None }
}

fn absent(entry: &str) -> Problem {
    Problem {
        message: format!("this spec has no value `{}` that could be assumed", text::shorten(entry)),
        help: "take the entry out, or give the value".to_owned(),
        replacement: None,
    }
}

fn unknown(f: &Fields, entry: &str) -> Problem {
    let message = format!("\"{}\" names no value of a spec", text::shorten(entry));
    let meant = |path: String| Problem {
        message: message.clone(),
        help: format!("did you mean \"{path}\"?"),
        replacement: Some(format!("\"{path}\"")),
    };
    if let Some(section) = keys::section(entry.trim()).filter(|section| !section.name.is_empty()) {
        let there = section.keys.iter().map(|key| section.path(key.name)).filter(|path| f.given(path));
        let list: Vec<String> = there.take(MOST_LISTED).map(|path| format!("\"{path}\"")).collect();
        let help = if list.is_empty() {
            format!("remove it: this spec gives no value of {}", section.header())
        } else {
            format!("{} is a section: name its assumed keys one by one, such as {}", section.header(), list.join(", "))
        };
        return Problem { message, help, replacement: None };
    }
    // A misspelt path; a key without its section; another name of the key.
    let (paths, name) = (paths(), entry.trim().rsplit('.').next().unwrap_or(entry).to_owned());
    if let Some(path) = text::nearest(entry.trim(), paths.iter().map(|(path, _)| path.as_str())) {
        return meant(path.to_owned());
    }
    let called = |wanted: &dyn Fn(&Key) -> bool| {
        let mut found = paths.iter().filter(|(path, key)| wanted(key) && f.get(path).is_some()).map(|(path, _)| path);
        found.next().cloned()
    };
    if let Some(path) = called(&|key| key.name == name).or_else(|| called(&|key| key.is_called(&name))) {
        return meant(path);
    }
    let help = "write the path of a key, section first, as in assumed = [\"sensor.noise\"]".to_owned();
    Problem { message, help, replacement: None }
}

/// Every permitted path, without indices.
fn paths() -> Vec<(String, &'static Key)> {
    let of = |section: &'static Section| section.keys.iter().map(move |key| (section.path(key.name), key));
    SECTIONS.iter().filter(|section| !section.name.is_empty()).flat_map(of).collect()
}
