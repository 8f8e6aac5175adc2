//! What the emitted text must and must not hold, for every example spec; goldens compile without a warning.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use specgen::compile::compile;
use specgen::workspace::{self, parts};
use specgen_tests::{Emitted, repository, scratch, sources};

/// Every example spec, relative to `specs/`.
fn specs() -> Vec<String> {
    let folder = repository().join("specs");
    let toml = |dir: &PathBuf, prefix: &str| -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(dir)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".toml") && name != "as-printed.toml")
            .map(|name| format!("{prefix}{name}"))
            .collect();
        names.sort();
        names
    };
    let mut all = toml(&folder, "");
    all.extend(toml(&folder.join("features"), "features/"));
    // Both kinds of controller are among them: six legs, and platforms with every option of `[control]`.
    let platforms = all
        .iter()
        .filter(|name| fs::read_to_string(folder.join(name)).unwrap().lines().any(|line| line.trim() == "[control]"));
    assert!(platforms.count() >= 9 && all.len() >= 17, "{all:?}");
    all
}

type Files = BTreeMap<String, String>;

/// Specs of the short run: one of each kind, single precision, and those of the goldens.
const SOME: [&str; 5] = [
    "reference.toml",
    "legs.toml",
    "features/platform-f32.toml",
    "features/six-records.toml",
    "features/small-grid.toml",
];

/// What every spec gives, by path.
fn compiled() -> &'static BTreeMap<String, Files> {
    static FILES: OnceLock<BTreeMap<String, Files>> = OnceLock::new();
    let of = |spec: String| {
        let compiled =
            compile(&repository().join("specs").join(&spec)).unwrap_or_else(|r| panic!("{spec}: {:?}", r.findings));
        (spec, compiled.files())
    };
    let is_tried = |spec: &String| specgen_tests::length(SOME.contains(&spec.as_str()), true);
    FILES.get_or_init(|| specs().into_iter().filter(is_tried).map(of).collect())
}

/// Controller and runtime of every spec, by path.
fn controller_code() -> &'static [(String, Files)] {
    static CODE: OnceLock<Vec<(String, Files)>> = OnceLock::new();
    let wanted = |path: &String| ["controller/", "law/", "runtime/"].iter().any(|folder| path.starts_with(folder));
    let of = |(spec, files): (&String, &Files)| {
        let code = files.iter().filter(|(path, _)| wanted(path));
        (spec.clone(), code.map(|(path, text)| (path.clone(), text.clone())).collect())
    };
    CODE.get_or_init(|| compiled().iter().map(of).collect())
}

/// Lines of code, without comments.
fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(k, line)| (k + 1, line.split("//").next().unwrap_or_default()))
}

#[test]
fn controller_code_keeps_to_the_invariants() {
    // Results on ±0 and NaN or the order of a sum would depend on the compiler; or a panic path, an allocation, a call into std.
    // No literal of an emitted file is one of the last three.
    let forbidden = ".min( | .max( | .clamp( | .mul_add( | .sum() | .sum::< | .product( | .sqrt() | .sin() | .cos() | \
        .powi( | .powf( | .exp() | .floor() | .round() | .unwrap() | .expect( | panic! | unreachable! | \
        todo! | std:: | alloc:: | unsafe { | unsafe fn | HashMap | f64::EPSILON | NaN | inf, | INFINITY";
    let forbidden: Vec<&str> = forbidden.split(" | ").collect();
    assert_eq!(forbidden.len(), 29);
    // Law and runtime are the same in most of them.
    let mut seen = BTreeSet::new();
    for (spec, code) in controller_code() {
        for (path, text) in code.iter().filter(|(_, text)| seen.insert(text.as_str())) {
            for (line, code) in code_lines(text) {
                for word in &forbidden {
                    assert!(!code.contains(word), "{spec}: {path}:{line} holds `{word}`: {code}");
                }
            }
        }
    }
}

#[test]
fn controller_and_runtime_depend_on_nothing_else() {
    for (spec, code) in controller_code() {
        for (path, expected) in [
            ("controller/Cargo.toml", &["specgen-law", "specgen-runtime"][..]),
            ("law/Cargo.toml", &["specgen-runtime"]),
            ("runtime/Cargo.toml", &[]),
        ] {
            assert_eq!(dependencies(&code[path].parse().unwrap()), expected, "{spec}: {path}");
        }
    }
    // Wherever a manifest may name one.
    let anywhere = "[dependencies]\na = \"1\"\n[dependencies.b]\npath = \"b\"\n[build-dependencies]\nc = \"1\"\n\
        [dev-dependencies]\nd = \"1\"\n[target.'cfg(unix)'.dependencies]\ne = \"1\"\n[lints.rust]\nf = \"deny\"\n";
    assert_eq!(dependencies(&anywhere.parse().unwrap()), ["a", "b", "c", "d", "e"]);
}

/// Names in every table of dependencies of a manifest, sorted.
fn dependencies(table: &toml::Table) -> Vec<String> {
    let mut names = Vec::new();
    for (name, value) in table {
        match value.as_table() {
            Some(inner) if name.ends_with("dependencies") => names.extend(inner.keys().cloned()),
            Some(inner) => names.extend(dependencies(inner)),
            None => {}
        }
    }
    names.sort();
    names
}

#[test]
fn every_source_file_says_where_it_comes_from_and_forbids_unsafe_code() {
    for (spec, code) in controller_code() {
        for (path, text) in code {
            if path.starts_with("controller/") && path.ends_with(".rs") {
                let head = text.lines().nth(1).unwrap();
                assert!(head.starts_with("// Generated by specgen ") && head.contains("spec digest"), "{spec}: {path}");
            }
        }
        for root in ["controller/src/lib.rs", "law/src/lib.rs", "runtime/src/lib.rs"] {
            assert!(
                code[root].contains("#![forbid(unsafe_code)]") && code[root].contains("#![no_std]"),
                "{spec}: {root}"
            );
        }
    }
}

#[test]
#[ignore = "long: every spec; in the short run the reference is checked below, and `bit_identity` builds its library"]
fn every_example_spec_builds_without_a_warning_and_without_a_panic_path() {
    for (index, spec) in specs().into_iter().enumerate() {
        let name = format!("example-{}", spec.replace(['/', '.'], "-"));
        let emitted = Emitted::new(&name, &spec, &[]);
        let _ = emitted.library();
        // The other packages are copied: the same in every output.
        let packages: &[&str] = if index == 0 { &["--workspace"] } else { &["--package", "controller"] };
        let built = emitted.check(packages);
        assert!(built.status.success(), "{spec}: {}", String::from_utf8_lossy(&built.stderr));
    }
}

/// An output of a platform and one of six legs, with every folder that there is.
fn whole_outputs() -> &'static [Files; 2] {
    static FILES: OnceLock<[Files; 2]> = OnceLock::new();
    let of = |spec| {
        let compiled = compile(&repository().join("specs").join(spec)).unwrap();
        let folders: Vec<&str> = parts::all().iter().map(|part| part.folder).collect();
        workspace::files_with(&compiled.ir, &specgen::emit::emit(&compiled.ir), &folders)
    };
    FILES.get_or_init(|| ["reference.toml", "legs.toml"].map(of))
}

#[test]
fn every_source_file_and_manifest_names_its_licence() {
    for files in whole_outputs() {
        let (mut sources, mut manifests) = (0, 0);
        for (path, text) in files {
            let licence = if path.starts_with("controller/") { "0BSD" } else { "MIT OR Apache-2.0" };
            let head = text.lines().next().unwrap();
            if path.ends_with(".rs") {
                assert_eq!(head, format!("// SPDX-License-Identifier: {licence}"), "{path}");
                sources += 1;
            } else if path.ends_with(".x") {
                assert_eq!(head, format!("/* SPDX-License-Identifier: {licence} */"), "{path}");
            } else if path.ends_with("/Cargo.toml") {
                let package = &text.parse::<toml::Table>().unwrap()["package"];
                assert_eq!(package["license"].as_str(), Some(licence), "{path}");
                // Programs for the emulator have naked functions.
                let oldest = if ["qemu/", "tick/"].iter().any(|part| path.starts_with(part)) { "1.88" } else { "1.85" };
                assert_eq!(package["rust-version"].as_str(), Some(oldest), "{path}");
                manifests += 1;
            }
        }
        assert!(sources > 200 && manifests == parts::all().len() + 1, "{sources}, {manifests}");
        for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert_eq!(files[name], fs::read_to_string(repository().join(name)).unwrap());
        }
    }
}

/// Lines of code with a condition that holds a `let` and another condition: Rust 1.88. New methods of `core` and `std` are a lint.
fn let_chains(text: &str) -> Vec<usize> {
    let code: Vec<&str> = code_lines(text).map(|(_, line)| line).collect();
    let has_chain = |first: usize| {
        if !code[first].contains("if let ") && !code[first].contains("while let ") {
            return false;
        }
        let rest = code[first..].join("\n");
        rest.match_indices("if let ").chain(rest.match_indices("while let ")).any(|(start, _)| {
            if rest[..start].contains('\n') {
                return false;
            }
            // A pattern may hold braces; the value before the block holds none outside of brackets.
            let value = rest[start..].split_once(" = ").map_or("", |(_, value)| value);
            let mut depth = 0;
            for (place, letter) in value.char_indices() {
                match letter {
                    '{' | ';' if depth == 0 => return false,
                    '(' | '[' | '{' => depth += 1,
                    ')' | ']' | '}' => depth -= 1,
                    '&' if depth == 0 && value[place..].starts_with("&& ") => return true,
                    _ => {}
                }
            }
            false
        })
    };
    (0..code.len()).filter(|line| code[*line].contains("&& let ") || has_chain(*line)).map(|line| line + 1).collect()
}

#[test]
fn outputs_hold_no_condition_of_a_later_rust() {
    let found = let_chains(
        "if let Some(a) = b(|c| c && d)\n    && a\n{}\nif a && let B { c, .. } = d {}\n// if let a = b && c\nif let A { b } = c {\nd && e }",
    );
    assert_eq!(found, [1, 4]);
    let mut seen = BTreeSet::new();
    let sources = whole_outputs().iter().flatten().filter(|(path, text)| path.ends_with(".rs") && seen.insert(*text));
    for (path, text) in sources {
        let found = let_chains(text);
        assert!(found.is_empty(), "{path}: lines {found:?}");
    }
}

/// Neither a network nor a registry: cargo finds an empty folder of its own. The example is that of the README.
#[test]
fn an_output_builds_offline_and_its_example_and_manual_are_good() {
    let dir = scratch("received");
    // A platform in the short run, six legs, too, in the full run.
    for files in whole_outputs().iter().take(specgen_tests::length(1, 2)) {
        workspace::write_scratch(&dir, files).unwrap();
        let example = |text: &str| text.split("```").find(|block| block.starts_with("rust")).unwrap().to_owned();
        let manual: Vec<&str> = files["controller/src/lib.rs"]
            .lines()
            .filter_map(|line| line.strip_prefix("//!"))
            .map(|line| line.strip_prefix(' ').unwrap_or(line))
            .collect();
        assert_eq!(example(&manual.join("\n")), example(&files["README.md"]));
        let all = [&["check", "--workspace"][..], &["test", "--doc", "--package=controller"], &["doc", "--no-deps"]];
        // The manual's example is built and run, and its pages are made, in the full run.
        for arguments in &all[..specgen_tests::length(1, 3)] {
            let run = Command::new(env!("CARGO"))
                .args(*arguments)
                .args(["--offline", "--quiet"])
                .current_dir(&dir)
                .env("CARGO_HOME", dir.join("empty"))
                .env("CARGO_TARGET_DIR", dir.join("target"))
                .env("RUSTFLAGS", "-D warnings")
                .env("RUSTDOCFLAGS", "-D warnings")
                .output()
                .unwrap();
            assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
            let tested = arguments[0] != "test" || String::from_utf8_lossy(&run.stdout).contains("1 passed");
            assert!(tested, "{}", String::from_utf8_lossy(&run.stdout));
        }
    }
}

/// A committed golden is what the compiler emits today; `cargo xtask bless` renews it. That it compiles is the test above.
#[test]
fn goldens_are_fresh() {
    for (path, committed) in sources(&repository().join("tests/golden")) {
        let (name, file) = path.split_once('/').unwrap();
        let files = &compiled()[&format!("features/{name}.toml")];
        let fresh = match file {
            "ir.json" => &files["ir.json"],
            file => &files[&format!("controller/{}", file.trim_end_matches(".golden"))],
        };
        assert!(committed == *fresh, "{path} is stale; run: cargo xtask bless");
    }
}

#[test]
fn the_committed_controller_is_what_the_reference_spec_gives() {
    let files = &compiled()["reference.toml"];
    for (path, committed) in sources(&repository().join("firmware/controller")) {
        assert!(committed == files[&format!("controller/{path}")], "{path} is stale; run: cargo xtask bless");
    }
}

/// The proof is falsifiable: a runtime with a panic path does not link, and the error says so.
#[test]
#[ignore = "long: built and searched from nothing; a stand-in with a panic path is refused in the test run"]
fn a_panic_path_keeps_the_host_library_from_linking() {
    let emitted = Emitted::new("panics", "features/small-grid.toml", &[]);
    let path = emitted.dir().join("runtime/src/memory.rs");
    let text = fs::read_to_string(&path).unwrap();
    let line = "self.dropped = self.dropped.saturating_add(1);";
    assert!(text.contains(line));
    fs::write(&path, text.replace(line, "self.dropped = self.dropped.checked_add(1).unwrap();")).unwrap();
    let error = specgen::target::host::build_library(emitted.dir(), &emitted.dir().join("target")).unwrap_err();
    assert!(matches!(error, specgen::target::TargetError::PanicPath { .. }), "{error}");
}

/// What does not depend on the spec stands in the files of the law: in the emitters' `quote!` blocks there are at most so many lines
/// without a splice, documentation among them.
#[test]
fn little_constant_text_is_emitted() {
    const MOST: usize = 300;
    let mut constant = 0;
    for (path, text) in sources(&repository().join("codegen/compiler/src/emit")) {
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let Some((before, block)) = line.split_once("quote! {") else { continue };
            let end = format!("{}}}", &before[..before.len() - before.trim_start().len()]);
            let of_block: Vec<&str> = match block.contains('}') {
                true => vec![block],
                false => lines.by_ref().take_while(|line| !line.starts_with(&end)).collect(),
            };
            assert!(of_block.len() < 100, "{path}: {line}");
            // `#name` and `#(…)` are splices, `#[…]` and `#![…]` are text.
            let spliced = |line: &&str| line.replace("#[", "").replace("#![", "").contains('#');
            let comment = |line: &&str| line.trim().starts_with("// ") || line.trim().is_empty();
            constant += of_block.iter().filter(|line| !spliced(line) && !comment(line)).count();
        }
    }
    println!("{constant} lines of constant text in the emitters, at most {MOST}");
    assert!((50..=MOST).contains(&constant), "{constant} lines");
}
