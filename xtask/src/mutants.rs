//! Mutation tests: cargo-mutants (`.cargo/mutants.toml`) changes one operator or body at a time, and a test should notice. Mutants
//! that survive are in [`LIST`], each with a reason.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::run::Outcome;
use crate::setup;

/// Names of surviving mutants, each group followed by an indented reason. `#` starts a comment.
const LIST: &str = "tests/mutants.txt";
const INSTALL: &str = "cargo install cargo-mutants --locked";

/// Mutants that are run together.
struct Group {
    package: &'static str,
    /// Folder of its workspace, with its own settings, if it is not the repository.
    folder: Option<&'static str>,
    /// Other arguments of cargo-mutants, before and after its `--`.
    arguments: [&'static [&'static str]; 2],
    /// Size of a sample: one mutant of this many.
    one_in: u32,
    /// Least percentage of noticed mutants.
    bar: usize,
}

const GROUPS: [Group; 5] = [
    Group { package: "specgen-runtime", folder: None, arguments: [&[], &["--tests"]], one_in: 32, bar: 90 },
    // Two test packages: with the reference's controller, and with one that has corrections and an input line.
    Group {
        package: "specgen-board",
        folder: None,
        arguments: [&["--test-package", "specgen-board,specgen-board-passes"], &["--tests"]],
        one_in: 8,
        bar: 90,
    },
    // Without the test that builds the crate again to prove that it has no panic path.
    Group {
        package: "specgen-link",
        folder: None,
        arguments: [&[], &["--tests", "--", "--skip", "panic_free"]],
        one_in: 4,
        bar: 90,
    },
    Group { package: "specgen-rt-pc", folder: Some("firmware/rt-pc"), arguments: [&[], &[]], one_in: 16, bar: 90 },
    // Only `lower`, `stability` and `lint`. `--lib` is a cargo argument, so that the build also compiles only the library.
    Group { package: "specgen-compiler", folder: None, arguments: [&["--cargo-arg=--lib"], &[]], one_in: 40, bar: 85 },
];

/// Selection of mutants.
#[derive(Debug, PartialEq, Eq)]
pub enum Sample {
    /// Successive samples of each group for this time.
    For(Duration),
    /// The K-th sample of one in N: `K/N`.
    One(String),
    All,
}

impl Sample {
    /// Parses the arguments of the command; none if they are invalid.
    pub fn of(arguments: &[&str]) -> Option<Self> {
        match *arguments {
            [] => Some(Self::For(Duration::from_mins(60))),
            ["all"] => Some(Self::All),
            [one] if one.contains('/') => Some(Self::One(one.to_owned())),
            [minutes] => Some(Self::For(Duration::from_mins(minutes.parse().ok()?))),
            _ => None,
        }
    }
}

/// Makes the mutants and runs the tests. `counts` gets the numbers of noticed mutants.
pub fn run(root: &Path, sample: &Sample, counts: &mut String) -> Outcome {
    let works = cargo_mutants(root, &["--version"]).output().is_ok_and(|output| output.status.success());
    if !works {
        return setup::missing(format!("cargo-mutants is not installed; install it with: {INSTALL}"));
    }
    let text = std::fs::read_to_string(root.join(LIST)).unwrap_or_default();
    let listed = match read(&text) {
        Ok(listed) => listed,
        Err(why) => return Outcome::Failed(format!("{LIST}: {why}")),
    };
    let mut wrong = Vec::new();
    let mut known = BTreeSet::new();
    for group in &GROUPS {
        match group.run(root, sample, &listed, &mut known) {
            Ok((found, count)) => {
                wrong.extend(found);
                *counts += &format!("{}{count}", if counts.is_empty() { "" } else { ", " });
            }
            Err(why) => return Outcome::Failed(why),
        }
    }
    wrong.extend(listed.difference(&known).map(|name| format!("there is no such mutant any more: {name}")));
    for line in &wrong {
        println!("{line}");
    }
    if wrong.is_empty() { Outcome::Passed } else { Outcome::Failed(format!("see above; the list is {LIST}")) }
}

fn cargo_mutants(root: &Path, arguments: &[&str]) -> Command {
    let mut command = crate::run::cargo(root, &["mutants"]);
    // Build within the copy of the sources: in a shared target folder an interrupted run would leave a mutant behind.
    command.args(arguments).env_remove("CARGO_TARGET_DIR");
    command
}

impl Group {
    fn cargo_mutants(&self, root: &Path, arguments: &[&str]) -> Command {
        let mut command = cargo_mutants(root, &["--package", self.package]);
        if let Some(folder) = self.folder {
            command.args(["--dir", folder, "--config"]).arg(root.join(format!(".cargo/mutants-{}.toml", self.package)));
        }
        command.args(arguments);
        command
    }

    /// Runs a sample and reports differences from the list. All existing mutants are added to `known`.
    fn run(
        &self,
        root: &Path,
        sample: &Sample,
        listed: &BTreeSet<String>,
        known: &mut BTreeSet<String>,
    ) -> Result<(Vec<String>, String), String> {
        let output = self.cargo_mutants(root, &["--list"]).output().map_err(|error| error.to_string())?;
        let names = names(&String::from_utf8_lossy(&output.stdout), self.folder);
        known.extend(names.values().cloned());

        let (mut noticed, mut missed) = (Vec::new(), Vec::new());
        let mut add = |shard: Option<&str>| -> Result<(), String> {
            let [caught, survive] = self.shard(root, shard, &names)?;
            noticed.extend(caught);
            missed.extend(survive);
            Ok(())
        };
        match sample {
            Sample::All => add(None)?,
            Sample::One(shard) => add(Some(shard))?,
            Sample::For(time) => {
                let start = Instant::now();
                for number in 0..self.one_in {
                    // Each group gets an equal share of the time, and at least one sample.
                    if number > 0 && start.elapsed() >= *time / GROUPS.len() as u32 {
                        break;
                    }
                    add(Some(&format!("{number}/{}", self.one_in)))?;
                }
            }
        }
        let count = format!("{} {} of {} noticed", self.package, noticed.len(), noticed.len() + missed.len());
        Ok((self.judge(&noticed, &missed, listed), count))
    }

    /// Makes the mutants of a shard, or all. Returns those that were noticed, and those that survive.
    fn shard(
        &self,
        root: &Path,
        shard: Option<&str>,
        names: &BTreeMap<String, String>,
    ) -> Result<[Vec<String>; 2], String> {
        let results = root.join("target/mutants").join(self.package);
        let mut command = self.cargo_mutants(root, &["--colors", "never", "--no-times", "--output"]);
        command.arg(&results).args(self.arguments[0]);
        if let Some(shard) = shard {
            command.args(["--sharding", "round-robin", "--shard", shard]);
        }
        command.arg("--").args(self.arguments[1]);
        std::fs::create_dir_all(&results).map_err(|error| format!("{}: {error}", results.display()))?;
        let status = command.status().map_err(|error| error.to_string())?;
        // Exit codes 2 and 3: some were missed, or timed out.
        if !matches!(status.code(), Some(0 | 2 | 3)) {
            return Err(format!("cargo mutants --package {}: {status}; see above", self.package));
        }
        let of = |file: &str| -> Vec<String> {
            let path = results.join("mutants.out").join(file);
            let text = std::fs::read_to_string(path).unwrap_or_default();
            text.lines().filter_map(|line| names.get(line).cloned()).collect()
        };
        // A mutant that times out counts as noticed.
        Ok([[of("caught.txt"), of("timeout.txt")].concat(), of("missed.txt")])
    }

    fn judge(&self, noticed: &[String], missed: &[String], listed: &BTreeSet<String>) -> Vec<String> {
        let all = noticed.len() + missed.len();
        for file in modules(noticed.iter().chain(missed)) {
            let of = |names: &[String]| names.iter().filter(|name| module(name) == file).count();
            println!("  {file}: {} of {} noticed", of(noticed), of(noticed) + of(missed));
        }
        println!("{}: {} of {all} mutants noticed, {} survive", self.package, noticed.len(), missed.len());
        let mut wrong = Vec::new();
        if 100 * noticed.len() < self.bar * all {
            wrong.push(format!("{}: less than {} % of the mutants are noticed", self.package, self.bar));
        }
        let new = missed.iter().filter(|name| !listed.contains(*name));
        wrong.extend(new.map(|name| format!("survives and is not on the list: {name}")));
        let caught = noticed.iter().filter(|name| listed.contains(*name));
        wrong.extend(caught.map(|name| format!("is on the list and no longer survives: {name}")));
        wrong
    }
}

/// Module of a mutant for counting: its file or folder below `src`.
fn module(name: &str) -> &str {
    let path = name.split(':').next().unwrap_or_default();
    let below = path.split_once("/src/").map_or(path, |(_, below)| below);
    below.split(['/', '.']).next().unwrap_or_default()
}

fn modules<'a>(names: impl Iterator<Item = &'a String>) -> BTreeSet<&'a str> {
    names.map(|name| module(name)).collect()
}

/// Stable names of mutants, by those of cargo-mutants: without line and column, but with a number to distinguish mutants of one
/// kind in a function. Files of a separate workspace have its `folder` as prefix.
fn names(list: &str, folder: Option<&str>) -> BTreeMap<String, String> {
    let mut count: BTreeMap<String, u32> = BTreeMap::new();
    let lines = list.lines().filter_map(|line| {
        let mut parts = line.splitn(4, ':');
        let (file, what) = (parts.next()?, parts.nth(2)?);
        let name = format!("{}{file}:{what}", folder.map(|folder| format!("{folder}/")).unwrap_or_default());
        let number = count.entry(name.clone()).or_default();
        *number += 1;
        Some((line.to_owned(), format!("{name} #{number}")))
    });
    lines.collect()
}

/// The names in the list; an error if one has no reason.
fn read(text: &str) -> Result<BTreeSet<String>, String> {
    let mut names = BTreeSet::new();
    let mut without = None;
    for line in text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#')) {
        if line.starts_with(' ') {
            without = None;
        } else if names.insert(line.to_owned()) {
            without = Some(line);
        } else {
            return Err(format!("listed twice: {line}"));
        }
    }
    without.map_or(Ok(names), |line| Err(format!("a reason is missing, as an indented line below: {line}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLUS: &str = "a/b.rs: replace + with - in f";

    #[test]
    fn names_do_not_depend_on_lines_and_tell_mutants_of_one_kind_apart() {
        let list = "a/b.rs:7:9: replace + with - in f\na/b.rs:7:30: replace + with - in f\na/b.rs:9:1: replace g -> T with 0: x\n";
        let found: Vec<String> = names(list, None).into_values().collect();
        assert_eq!(
            found,
            [format!("{PLUS} #2"), format!("{PLUS} #1"), "a/b.rs: replace g -> T with 0: x #1".to_owned()]
        );
        let moved = list.replace(":7:", ":8:");
        assert_eq!(names(&moved, None).into_values().collect::<Vec<_>>(), found);
        let below = names(list, Some("f"));
        assert_eq!(below["a/b.rs:7:9: replace + with - in f"], format!("f/{PLUS} #1"));
    }

    #[test]
    fn a_sample_is_a_time_a_share_or_all() {
        let minutes = |count| Some(Sample::For(Duration::from_mins(count)));
        assert_eq!(Sample::of(&[]), minutes(60));
        assert_eq!(Sample::of(&["5"]), minutes(5));
        assert_eq!(Sample::of(&["3/40"]), Some(Sample::One("3/40".to_owned())));
        assert_eq!(Sample::of(&["all"]), Some(Sample::All));
        assert_eq!(Sample::of(&["some"]), None);
        assert_eq!(Sample::of(&["1", "2"]), None);
    }

    #[test]
    fn a_module_is_a_file_or_a_folder() {
        let names =
            ["c/src/lower.rs: x #1", "c/src/lower/setpoint/stop.rs: x #1", "c/src/lint.rs: a::b #2"].map(str::to_owned);
        assert_eq!(modules(names.iter()).into_iter().collect::<Vec<_>>(), ["lint", "lower"]);
    }

    #[test]
    fn a_list_has_a_reason_for_every_name() {
        let names = read("# remark\na #1\nb #1\n    one reason for both\n\nc #1\n    another\n").unwrap();
        assert_eq!(names.into_iter().collect::<Vec<_>>(), ["a #1", "b #1", "c #1"]);
        assert!(read("a #1\n    why\nb #1\n").is_err_and(|why| why.ends_with(": b #1")));
        assert!(read("a #1\na #1\n    why\n").is_err());
    }

    #[test]
    fn differences_from_the_list_are_reported() {
        let group = Group { package: "p", folder: None, arguments: [&[], &[]], one_in: 1, bar: 50 };
        let strings = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let listed: BTreeSet<String> = strings(&["a", "b"]).into_iter().collect();
        assert!(group.judge(&strings(&["c"]), &strings(&["a"]), &listed).is_empty());
        assert_eq!(group.judge(&strings(&["b", "c"]), &strings(&["d"]), &listed).len(), 2);
        assert_eq!(group.judge(&strings(&["c"]), &strings(&["a", "b"]), &listed).len(), 1);
    }
}
