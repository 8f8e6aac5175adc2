//! The compiler's crates stand on floors, and an arrow only goes down: the manifests say so, and this reads them. Within a crate
//! no modules use each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use specgen_tests::repository;

/// From the lowest.
const FLOORS: [&str; 11] = [
    "numerics",
    "language",
    "identify",
    "cycles",
    "toolchain",
    "compiler",
    "studies",
    "operate",
    "report",
    "cli",
    "python",
];

/// The crates of the compiler that a manifest names.
fn below(manifest: &str) -> Vec<usize> {
    let named = |name: &str| manifest.lines().any(|line| line.contains(&format!("path = \"../{name}\"")));
    (0..FLOORS.len()).filter(|floor| named(FLOORS[*floor])).collect()
}

/// Arrows that do not go down.
fn upward(floor: usize, manifest: &str) -> Vec<&'static str> {
    below(manifest).into_iter().filter(|other| *other >= floor).map(|other| FLOORS[other]).collect()
}

#[test]
fn no_arrow_goes_up() {
    let mut arrows = 0;
    for (floor, name) in FLOORS.into_iter().enumerate() {
        let path = repository().join("codegen").join(name).join("Cargo.toml");
        let manifest = std::fs::read_to_string(&path).unwrap();
        arrows += below(&manifest).len();
        assert!(
            upward(floor, &manifest).is_empty(),
            "{name} uses {:?}, on its own floor or above",
            upward(floor, &manifest)
        );
    }
    assert!(arrows > 20, "{arrows} arrows");
    let found: Vec<_> =
        std::fs::read_dir(repository().join("codegen")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(found.len(), FLOORS.len(), "a crate without a floor: {found:?}");
}

/// What must not see the simulator, does not.
#[test]
fn the_compiler_does_not_see_the_simulator() {
    for name in &FLOORS[..6] {
        let path = repository().join("codegen").join(name).join("Cargo.toml");
        let manifest = std::fs::read_to_string(path).unwrap();
        // Its tests may: margins are held against a simulation that shares nothing with them.
        let shipped = manifest.split("[dev-dependencies]").next().unwrap();
        assert!(!shipped.contains("host-sim"), "{name}");
    }
}

#[test]
fn an_arrow_that_goes_up_is_found() {
    let manifest =
        "[dependencies]\nspecgen-numerics = { path = \"../numerics\" }\nspecgen-cli = { path = \"../cli\" }\n";
    assert_eq!(upward(1, manifest), ["cli"]);
    assert_eq!(upward(0, manifest), ["numerics", "cli"]);
    assert!(upward(9, "specgen-report = { path = \"../report\" }").is_empty());
}

/// Crates in which no two top-level modules use each other, neither directly nor by way of others.
const WITHOUT_CIRCLES: [&str; 19] = [
    "codegen/numerics",
    "codegen/language",
    "codegen/identify",
    "codegen/toolchain",
    "codegen/compiler",
    "codegen/studies",
    "codegen/operate",
    "codegen/report",
    "codegen/cli",
    "codegen/python",
    "host-sim",
    "host-sim/oracle",
    "firmware/runtime",
    "firmware/rt",
    "firmware/link",
    "firmware/hal",
    "firmware/board",
    "firmware/rt-pc",
    "xtask",
];

/// What the top-level modules of a crate name of each other.
#[derive(Default)]
struct Modules {
    /// Words behind `crate::` in the files of each, tests aside.
    named: BTreeMap<String, BTreeSet<String>>,
    /// The module of what the root re-exports.
    exported: BTreeMap<String, String>,
}

impl Modules {
    /// Of a crate whose files lie in these folders.
    fn of(folders: &[&str]) -> Self {
        let mut modules = Self::default();
        for source in folders.iter().map(|folder| repository().join(folder)) {
            for file in files(&source) {
                let text = std::fs::read_to_string(&file).unwrap();
                let path = file.strip_prefix(&source).unwrap().with_extension("");
                modules.add(&path.iter().map(|part| part.to_str().unwrap()).collect::<Vec<_>>(), &text);
            }
        }
        modules
    }

    /// Adds the file of the module at `path`.
    fn add(&mut self, path: &[&str], text: &str) {
        let lines = text.lines().take_while(|line| !line.contains("#[cfg(test)]"));
        let code = lines.filter_map(|line| line.split("//").next()).collect::<Vec<_>>().join("\n");
        // What a controller shows at its root stands in `api`.
        if matches!(path, ["lib" | "main" | "api"]) {
            for tree in code.split("pub use ").skip(1).filter_map(|rest| rest.split(';').next()) {
                let tree = tree.trim_start_matches("crate::");
                let words = tree.split(|c: char| !c.is_alphanumeric() && c != '_');
                self.exported.extend(words.map(|word| (word.to_owned(), heads(tree)[0].clone())));
            }
        } else {
            let code = code.replace(&"super::".repeat(path.len()), "crate::");
            self.named.entry(path[0].to_owned()).or_default().extend(code.split("crate::").skip(1).flat_map(heads));
        }
    }

    /// Modules of which each uses the next, and the last the first.
    fn circle(&self) -> Option<Vec<&str>> {
        let mut done = BTreeSet::new();
        self.named.keys().find_map(|module| self.circle_behind(module, &mut Vec::new(), &mut done))
    }

    fn circle_behind<'a>(
        &'a self,
        module: &'a str,
        way: &mut Vec<&'a str>,
        done: &mut BTreeSet<&'a str>,
    ) -> Option<Vec<&'a str>> {
        if let Some(first) = way.iter().position(|before| *before == module) {
            return Some(way[first..].to_vec());
        }
        if !done.insert(module) {
            return None;
        }
        way.push(module);
        let used = self.named[module].iter().map(|word| self.exported.get(word).unwrap_or(word));
        let others = used.filter(|other| *other != module && self.named.contains_key(*other));
        let found = others.into_iter().find_map(|other| self.circle_behind(other, way, done));
        way.pop();
        found
    }
}

/// First words of a path; `{a::b, c}` has two.
fn heads(path: &str) -> Vec<String> {
    let first = |text: &str| text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let Some(group) = path.strip_prefix('{') else { return vec![first(path)] };
    let (mut words, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            '}' | ',' if depth == 0 => {
                words.push(first(&group[start..at]));
                start = at + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    words
}

/// Every Rust file in `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let each = entries.map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    each.flatten().filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
}

#[test]
fn no_modules_of_a_crate_use_each_other_in_a_circle() {
    for name in WITHOUT_CIRCLES {
        let modules = Modules::of(&[&format!("{name}/src")]);
        assert!(!modules.named.is_empty(), "{name} has no modules");
        assert_eq!(modules.circle(), None, "in {name}");
    }
}

/// Files of a controller: the law of a kind, and what is emitted beside it.
const CONTROLLERS: [&[&str]; 2] = [
    &["firmware/controller/src"],
    &["firmware/controller/law/common", "firmware/controller/law/legs", "tests/golden/six-records/src"],
];

#[test]
fn no_files_of_a_controller_use_each_other_in_a_circle() {
    for folders in CONTROLLERS {
        let mut modules = Modules::of(folders);
        assert_eq!(modules.circle(), None, "in {folders:?}");
        // Both ways of naming a file are followed: by its path, and by what the root shows of it.
        modules.add(&["state"], "use crate::TickInput;");
        let circle = modules.circle().map(BTreeSet::from_iter);
        assert_eq!(circle, Some(BTreeSet::from(["state", "tick"])), "in {folders:?}");
    }
}

#[test]
fn a_circle_of_modules_is_found() {
    let circle = |files: &[(&[&str], &str)]| {
        let mut modules = Modules::default();
        files.iter().for_each(|(path, text)| modules.add(path, text));
        modules.circle().map(|circle| circle.join(" "))
    };
    let straight: [(&[&str], &str); 4] = [
        (&["lib"], "mod a;\nmod b;\npub use b::{Item, c::Other};"),
        (&["a"], "use crate::b;\nfn f() -> crate::Item {}\n#[cfg(test)]\nmod tests {}"),
        (&["b"], "// crate::a is not used here.\nmod c;\n#[cfg(test)]\nmod tests { use crate::a; }"),
        (&["b", "c"], "use super::Item;"),
    ];
    assert_eq!(circle(&straight), None);
    for back in
        ["use crate::a::f;", "use super::super::a;", "use crate::{b::Item, a::{f, g}};", "fn f() { crate::a::f() }"]
    {
        let with = [&straight[..], &[(&["b", "c"], back)]].concat();
        assert_eq!(circle(&with).as_deref(), Some("a b"), "{back}");
    }
    // By way of what the root hands on, too.
    let by_root =
        [&straight[..2], &[(&["b"], "mod c;"), (&["b", "c"], "use crate::run;"), (&["d"], "use crate::a;")]].concat();
    assert_eq!(circle(&by_root), None);
    assert_eq!(circle(&[&by_root[..], &[(&["lib"], "pub use d::run;")]].concat()).as_deref(), Some("a b d"));
}
