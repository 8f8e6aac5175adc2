//! tests/dependencies.txt: every package of others that a manifest names has a line that says what for, and none is left over.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use specgen_tests::repository;

const PAGE: &str = "tests/dependencies.txt";
/// Folders with manifests in them, beside the repository's own.
const FOLDERS: [&str; 6] = ["codegen", "examples", "firmware", "host-sim", "tests", "xtask"];
const KINDS: [&str; 3] = ["dependencies", "dev-dependencies", "build-dependencies"];

/// Packages of others that a table of dependencies names.
fn named(table: &toml::Table) -> BTreeSet<String> {
    let of_others = table.iter().filter(|(_, value)| value.get("path").is_none());
    let name = |(key, value): (&String, &toml::Value)| {
        value.get("package").and_then(toml::Value::as_str).unwrap_or(key).to_owned()
    };
    of_others.map(name).collect()
}

/// Packages of others that a manifest names, for any kind of dependency and any target.
fn of_manifest(text: &str) -> BTreeSet<String> {
    let manifest: toml::Table = text.parse().unwrap();
    let targets = manifest.get("target").and_then(toml::Value::as_table).into_iter().flatten();
    let tables = std::iter::once(&manifest).chain(targets.filter_map(|(_, target)| target.as_table()));
    let kinds = tables.flat_map(|table| KINDS.map(|kind| table.get(kind).and_then(toml::Value::as_table)));
    kinds.flatten().flat_map(named).collect()
}

/// The same of every manifest below a folder.
fn below(folder: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(below(&path));
        } else if path.ends_with("Cargo.toml") {
            found.extend(of_manifest(&fs::read_to_string(&path).unwrap()));
        }
    }
    found
}

#[test]
fn every_package_of_others_has_a_line_that_says_what_for() {
    let used: BTreeSet<String> = FOLDERS.iter().flat_map(|folder| below(&repository().join(folder))).collect();
    assert!(used.len() > 40, "{used:?}");
    let page = fs::read_to_string(repository().join(PAGE)).unwrap();
    let mut listed = BTreeSet::new();
    for line in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert!(cells.len() == 3 && cells.iter().all(|cell| !cell.is_empty()), "{line}");
        assert!(listed.insert(cells[0].trim_matches('`').to_owned()), "listed twice: {line}");
    }
    let missing: Vec<_> = used.difference(&listed).collect();
    let left: Vec<_> = listed.difference(&used).collect();
    assert!(missing.is_empty() && left.is_empty(), "{PAGE}: without a line {missing:?}, used nowhere {left:?}");
}

#[test]
fn a_dependency_is_seen_wherever_a_manifest_names_it() {
    let text = "[dependencies]\na = \"1\"\nown = { path = \"..\" }\n[dev-dependencies]\nb.workspace = true\n\
                [target.'cfg(unix)'.dependencies]\nc = { version = \"1\", package = \"d\" }\n[build-dependencies]\ne = \"1\"\n";
    assert_eq!(of_manifest(text).into_iter().collect::<Vec<_>>(), ["a", "b", "d", "e"]);
}
