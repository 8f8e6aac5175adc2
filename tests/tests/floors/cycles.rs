//! No files of a crate use each other in a cycle, in any crate of the repository.
//!
//! What counts: an arrow goes from the file that names an item, by `use` or by a path in its code, to the file that defines
//! the item, whatever re-exports it on the way. What only a crate's own tests compile draws none. No two modules of one parent
//! may reach each other, directly or by way of others; each counts with all that is nested in it. A module and what is nested
//! in it may name each other's items, as a child is a part of its parent. So every cycle of files is found but for one that runs
//! between a file and files nested in it only.
//!
//! What is not seen: methods, whose file only the type of a value tells, and paths that a macro puts together.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use specgen_tests::repository;

use super::arrows::{Graph, reached};
use super::modules::Read;

/// Folders with Rust in them.
const FOLDERS: [&str; 6] = ["codegen", "examples", "firmware", "host-sim", "tests", "xtask"];
/// Roots of crates by another name than `lib.rs` or `main.rs`, with modules.
const PROGRAMS: [&str; 2] = ["firmware/board/tests/passes/tests.rs", "firmware/qemu/src/pil.rs"];
/// Programs and tests of one file, beside build scripts, benchmarks and examples.
const ALONE: [&str; 2] = ["codegen/cli/tests/rt_pc/fake_comedi.rs", "host-sim/tests/shared_library.rs"];
/// Folders of files that are no crate here: a controller or an image is put together of them and others.
const PARTS: [&str; 2] = ["tests/golden", "tests/tests/record_support"];
/// Folder of a controller of six legs.
const LEGS: &str = "tests/golden/six-records/src";

/// Text of a file of the repository.
fn read(path: &Path) -> Option<String> {
    fs::read_to_string(repository().join(path)).ok()
}

/// Every Rust file in `folder`, but for what cargo built and for parts of controllers; by path from the repository.
fn sources(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(repository().join(folder)).unwrap() {
        let path = folder.join(entry.unwrap().file_name());
        if repository().join(&path).is_dir() {
            let is_left_out = path.ends_with("target") || PARTS.iter().any(|part| path == Path::new(part));
            found.extend(if is_left_out { BTreeSet::new() } else { sources(&path) });
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.insert(path);
        }
    }
    found
}

/// Whether a file is named as the root of a crate.
fn is_root(path: &Path) -> bool {
    let is_program = path.parent().is_some_and(|folder| folder.ends_with("bin"));
    path.ends_with("lib.rs")
        || path.ends_with("main.rs")
        || is_program
        || PROGRAMS.iter().any(|root| path == Path::new(root))
}

/// Every crate of the repository: those with a root of the usual name, and each file that is in none of them.
fn crates() -> Vec<(PathBuf, Graph)> {
    let all: BTreeSet<PathBuf> = FOLDERS.iter().flat_map(|folder| sources(Path::new(folder))).collect();
    let (roots, others): (Vec<&PathBuf>, Vec<&PathBuf>) = all.iter().partition(|path| is_root(path));
    let (mut crates, mut seen): (Vec<(PathBuf, Graph)>, BTreeSet<PathBuf>) = (Vec::new(), BTreeSet::new());
    for root in roots.into_iter().chain(others) {
        if !seen.contains(root) {
            let graph = Graph::of(root, &read);
            seen.extend(graph.files().map(normal));
            crates.push((root.clone(), graph));
        }
    }
    crates
}

/// A path without `..`.
fn normal(path: &Path) -> PathBuf {
    path.iter().fold(PathBuf::new(), |mut normal, part| {
        if part == ".." {
            normal.pop();
        } else {
            normal.push(part);
        }
        normal
    })
}

#[test]
fn every_file_is_in_a_crate_and_none_use_each_other_in_a_cycle() {
    let mut arrows = 0;
    for (root, graph) in crates() {
        let cycles = graph.cycles();
        assert!(cycles.is_empty(), "cycles in the crate of {}:\n{}", root.display(), cycles.join("\n"));
        // A file that no `mod` leads to is compiled by nobody, and its tests are missed by nobody.
        let is_alone = ALONE.iter().any(|file| root == Path::new(file)) || root.ends_with("build.rs");
        let is_target = root.parent().is_some_and(|folder| folder.ends_with("benches") || folder.ends_with("examples"));
        assert!(is_root(&root) || is_alone || is_target, "{} is in no crate: no `mod` names it", root.display());
        arrows += graph.arrows.len();
    }
    assert!(arrows > 2500, "{arrows} arrows");
}

/// Cycles of a crate of the repository, with a line more in one of its files.
fn cycles_with(root: &str, read: Read, file: &str, line: &str) -> Vec<String> {
    let text = |path: &Path| read(path).map(|text| if path.ends_with(file) { format!("{line}\n{text}") } else { text });
    Graph::of(Path::new(root), &text).cycles()
}

#[test]
fn no_files_of_a_controller_of_legs_use_each_other_in_a_cycle() {
    let cycles = |file, line| cycles_with(&format!("{LEGS}/lib.rs"), &read, file, line);
    assert_eq!(cycles("limits.rs", ""), [""; 0]);
}

/// In crates of the repository an arrow more makes a cycle: between two files beside each other, nested ones, by way of a third,
/// and behind a re-export.
#[test]
fn a_cycle_in_a_crate_of_the_repository_is_found() {
    let (operate, report) = ("codegen/operate/src/lib.rs", "codegen/report/src/lib.rs");
    let studies = "codegen/studies/src/lib.rs";
    let cases: [(&str, &str, &str, &[&str]); 7] = [
        (studies, "src/firmware.rs", "use crate::build::Options as Build;", &["build.rs"]),
        (report, "identify/cause.rs", "use super::everett;\nfn f() { everett::run() }", &["everett.rs"]),
        (operate, "commands/pose.rs", "use super::operator::Operator;", &["operator.rs"]),
        (report, "pages/words.rs", "fn f() { super::recorded::read() }", &["recorded.rs"]),
        (studies, "learning/response.rs", "use super::Convergence;", &["convergence.rs"]),
        (
            "host-sim/src/lib.rs",
            "rig/run.rs",
            "use crate::platform::study::PlatformStudy;",
            &["study.rs", "scenario.rs"],
        ),
        ("xtask/src/main.rs", "src/results.rs", "use crate::steps::*;\nfn f() { test(); }", &["steps.rs"]),
    ];
    for (root, file, line, expected) in cases {
        assert_eq!(cycles_with(root, &read, file, ""), [""; 0], "{file}");
        let [found] = &cycles_with(root, &read, file, line)[..] else { panic!("{file}: {line}") };
        for name in expected.iter().chain([&file]) {
            assert!(found.contains(name), "{line}: {found}");
        }
    }
}

/// A crate with cycles at no level: `a` uses `b`, and what is nested in `b` uses the rest of `b`.
const STRAIGHT: [(&str, &str); 7] = [
    ("lib.rs", "mod a;\nmod b;\nmod d;\npub use b::{Item, c::Other as Third};"),
    ("a.rs", "use crate::b;\nuse b::c::Other;\nfn f() -> crate::Item {}\npub fn g() {}\n#[cfg(test)]\nmod tests {}"),
    (
        "b.rs",
        "// crate::a is not used here.\nmod c;\nmod e;\npub struct Item(c::Other);\n#[cfg(test)]\nmod tests { use crate::a::f; }",
    ),
    (
        "b/c.rs",
        "use super::{Item, e::{self as low, E}};\nconst TEXT: &str = \"crate::a::f\";\npub struct Other;\nfn f() { low::g() }",
    ),
    ("b/e.rs", "pub mod f;\npub enum E { A }\npub fn g<'a>() -> char { '\"' }"),
    ("b/e/f.rs", "use super::super::Item;\npub fn deep() {}"),
    (
        "d.rs",
        "pub use crate::a::f as run;\n#[cfg(test)]\nuse crate::b::{c, Item};\n/* use crate::nothing; */ pub fn own() {}",
    ),
];

/// The cycle of that crate where `text` is before the text of `file`; empty if there is none.
fn cycle(file: &str, text: &str) -> String {
    let of =
        |path: &Path| STRAIGHT.iter().find(|(name, _)| path == Path::new(name)).map(|(_, text)| (*text).to_owned());
    let found = cycles_with("lib.rs", &of, file, text);
    assert!(found.len() < 2, "{found:?}");
    found.concat()
}

#[test]
fn a_cycle_of_files_is_found_in_one_module_and_in_a_nested_one() {
    assert_eq!(cycle("lib.rs", ""), "");
    // Of files in one top-level module, and below that.
    for line in [
        "use super::c::Other;",
        "use super::c;\nfn f() -> c::Other {}",
        "use crate::b::c::{Other, f};",
        "fn f(_: &super::c::Other) {}",
        "mod inner { use super::super::c::Other; }",
        "use super::c as low;\nfn f() { let _ = [low::Other]; }",
        "use super::c::*;\nfn f(_: Other) {}",
        "fn f() { use crate::Third; }",
        "call!(super::c::Other);",
        "#[cfg(not(test))]\nuse super::c::Other;",
    ] {
        assert_eq!(cycle("b/e.rs", line).lines().count(), 2, "{line}: {}", cycle("b/e.rs", line));
    }
    let deep = cycle("b/e/f.rs", "use super::super::c::Other;");
    assert!(deep.contains("b/e/f.rs -> b/c.rs: super::super::c::Other"), "{deep}");
    // Of top-level modules, by what is nested in one, and by way of what a third or the root shows.
    for (file, line) in [
        ("b.rs", "use crate::a::g;"),
        ("b/c.rs", "use super::super::a::f;"),
        ("b/e/f.rs", "use crate::{b::Item, a::{f, g}};"),
        ("b/c.rs", "fn f() { crate::a::f() }"),
        ("b/c.rs", "use crate::d::run;"),
        ("b/c.rs", "use crate::d;\nfn f() { d::run() }"),
    ] {
        let found = cycle(file, line);
        assert!(
            found.contains("a.rs -> b.rs: crate::Item") && found.contains(&format!("{file} -> a.rs")),
            "{line}: {found}"
        );
    }
    // By way of a third, which only shows what it has of the first.
    let three = cycle("b/c.rs", "pub use crate::d::own;");
    assert!(
        three.contains("b/c.rs -> d.rs") && three.contains("d.rs -> a.rs") && three.contains("a.rs -> b.rs"),
        "{three}"
    );
}

#[test]
fn what_draws_no_arrow_makes_no_cycle() {
    for (file, line) in [
        // A module and what is nested in it are one.
        ("b.rs", "use e::f::deep;\nuse self::c::Other;"),
        ("b/e/f.rs", "use super::E;"),
        // Text, comments, tests, and what is of another crate.
        ("b/e.rs", "// use super::c::Other;\n/* /* use super::c::Other; */ */\n/// [`super::c::Other`]\nstruct S;"),
        ("b/e.rs", "const T: &str = r#\"use \"super::c::Other\"#;\nconst B: [u8; 2] = *b\"\\\"\\\\\";"),
        ("b/e.rs", "#[cfg(all(test, unix))]\nuse super::c::{Other, f};\n#[test]\nfn t() { super::c::f() }"),
        ("b/e.rs", "use other::c::Other;\nfn f(s: S) { s.c::<u8>(); c(); let c = 1; }"),
        // A module alone is no item of it.
        ("b/e.rs", "use super::c;"),
    ] {
        assert_eq!(cycle(file, line), "", "{line}");
    }
}

/// Modules of the Python package that import each other in a cycle, of their texts by name.
fn python_cycle(texts: &[(String, String)]) -> Vec<&str> {
    let mut imports = BTreeMap::new();
    for (from, (_, text)) in texts.iter().enumerate() {
        let lines = text.lines().filter_map(|line| line.trim().strip_prefix("from .")?.split_once(" import "));
        for (module, names) in lines {
            let to = if module.is_empty() { names } else { module };
            imports.extend(texts.iter().position(|(name, _)| name == to).map(|to| ((from, to), ())));
        }
    }
    let is_back = |number: &usize| reached(&imports, *number).contains(number);
    (0..texts.len()).filter(is_back).map(|number| texts[number].0.as_str()).collect()
}

#[test]
fn no_modules_of_the_python_package_import_each_other_in_a_cycle() {
    let folder = repository().join("codegen/python/specgen");
    let mut texts: Vec<(String, String)> = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|end| end == "py") {
            texts.push((path.file_stem().unwrap().to_str().unwrap().to_owned(), fs::read_to_string(&path).unwrap()));
        }
    }
    assert!(texts.len() >= 6, "{} modules", texts.len());
    assert_eq!(python_cycle(&texts), [""; 0]);
    let (_, findings) = texts.iter_mut().find(|(name, _)| name == "_findings").unwrap();
    findings.push_str("if TYPE_CHECKING:\n    from ._commands import Compiled\n");
    let mut found = python_cycle(&texts);
    found.sort_unstable();
    assert_eq!(found, ["_commands", "_findings"]);
}
