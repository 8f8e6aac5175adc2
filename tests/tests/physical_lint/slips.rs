//! Slips are found at the key where they were made, and platforms without one are not refused.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::diagnostic::{Diagnostic, Severity};

use super::list;
use super::support::mutants::{self, Mutant};
use super::support::{plausible, slips, spec, verdict};

/// Specs that slips are made in.
const BASES: [&str; 5] = [
    "reference.toml",
    "legs.toml",
    "features/platform-gains.toml",
    "features/platform-calibration.toml",
    "features/platform-environment.toml",
];
const MUTANTS: usize = 300;
const LEAST: f64 = 0.95;

/// Specs of the second set, beside six plausible platforms.
const SECOND_BASES: [&str; 7] = [
    "legs.toml",
    "features/ewma-bandwidth.toml",
    "features/f32.toml",
    "features/offset-load.toml",
    "features/platform-joints.toml",
    "features/platform-frames.toml",
    "features/platform-f32.toml",
];
const SECOND_SEED: u64 = 411;
/// 241 of 300 before any rule was changed for what this set showed, 254 after. Most of the rest are values in each other's place
/// that are nearly alike, and a digit too many where both values are plausible.
const SECOND_LEAST: f64 = 0.83;

/// Whether a finding is about the key: at it, or naming it in full.
fn is_about(finding: &Diagnostic, key: &str) -> bool {
    let key = list(key);
    let (section, name) = key.rsplit_once('.').expect("a key of a section");
    let plain = section.split('[').next().unwrap_or(section);
    let text = format!("{} {}", finding.message, finding.help);
    let named = text.contains(&format!("{plain}.{name}")) || text.contains(key);
    list(&finding.key) == key || named
}

/// Findings of the base are not found again.
fn new_findings(base: &BTreeSet<(String, String)>, findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let known = |one: &Diagnostic| base.contains(&(one.code.to_owned(), one.key.clone()));
    findings.into_iter().filter(|one| one.severity > Severity::Note && !known(one)).collect()
}

#[derive(Default)]
struct Count {
    all: usize,
    at_key: usize,
    named: usize,
    elsewhere: usize,
}

/// A spec in which slips are made: its name, text and folder, and what is found in it as it is.
struct Base {
    name: String,
    text: String,
    dir: std::path::PathBuf,
    known: BTreeSet<(String, String)>,
}

impl Base {
    fn of(name: &str, text: String, dir: &Path) -> Self {
        let (accepted, findings) = verdict(&text, dir);
        assert!(accepted, "{name}: {findings:?}");
        let known = findings.into_iter().map(|one| (one.code.to_owned(), one.key)).collect();
        Self { name: name.to_owned(), text, dir: dir.to_path_buf(), known }
    }
}

/// `MUTANTS` of all the slips that `make` makes, the same number of each kind as far as there are; then whatever comes.
/// SPECGEN_MUTANTS=all tries every one. Returns how many of how many were found at the right key.
fn hit_rate(bases: &[Base], make: fn(&str) -> Vec<Mutant>, seed: u64, share: fn(&str) -> usize) -> (usize, usize) {
    let mut pool: Vec<(&Base, Mutant)> =
        bases.iter().flat_map(|base| make(&base.text).into_iter().map(move |one| (base, one))).collect();
    let whole = pool.len();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    if std::env::var("SPECGEN_MUTANTS").as_deref() != Ok("all") {
        for at in (1..pool.len()).rev() {
            pool.swap(at, random.next_u32() as usize % (at + 1));
        }
        let mut taken: BTreeMap<&str, usize> = BTreeMap::new();
        let (mut few, rest): (Vec<_>, Vec<_>) = pool.into_iter().partition(|(_, one)| {
            let count = taken.entry(one.kind).or_default();
            *count += 1;
            *count <= share(one.kind)
        });
        few.extend(rest);
        few.truncate(MUTANTS);
        pool = few;
        assert_eq!(pool.len(), MUTANTS, "of {whole}");
    }
    let mut counts: BTreeMap<&str, Count> = BTreeMap::new();
    let mut missed = String::new();
    for (base, mutant) in &pool {
        let (_, findings) = verdict(&mutant.text, &base.dir);
        let findings = new_findings(&base.known, findings);
        let count = counts.entry(mutant.kind).or_default();
        count.all += 1;
        if findings.iter().any(|one| list(&one.key) == list(&mutant.key)) {
            count.at_key += 1;
        } else if findings.iter().any(|one| is_about(one, &mutant.key)) {
            count.named += 1;
        } else {
            let found: Vec<String> = findings.iter().map(|one| format!("{} {}", one.code, one.key)).collect();
            count.elsewhere += usize::from(!found.is_empty());
            let (name, found) = (&base.name, found.join(", "));
            missed += &format!("  {name} | {} | {} | {} | {found}\n", mutant.kind, mutant.key, mutant.change);
        }
    }
    println!("{:<20} {:>5} {:>7} {:>6} {:>10} {:>7}", "kind", "all", "at key", "named", "elsewhere", "missed");
    let (mut all, mut good) = (0, 0);
    for (kind, one) in &counts {
        let silent = one.all - one.at_key - one.named - one.elsewhere;
        println!("{kind:<20} {:>5} {:>7} {:>6} {:>10} {silent:>7}", one.all, one.at_key, one.named, one.elsewhere);
        all += one.all;
        good += one.at_key + one.named;
    }
    println!("{good} of {all} found with the right key, of a pool of {whole}; not found:\n{missed}");
    (good, all)
}

#[test]
fn slips_are_found_at_their_key() {
    let dir = specgen_tests::repository().join("specs");
    let bases: Vec<Base> = BASES.iter().map(|name| Base::of(name, spec(name), &dir)).collect();
    let share = |kind: &str| if kind == "unit off by 1000" { 120 } else { 60 };
    let (good, all) = hit_rate(&bases, mutants::all, 20_261_121, share);
    assert!(good as f64 >= LEAST * all as f64, "{good} of {all}");
}

/// Slips of other kinds in other specs than those that the rules were tuned on.
#[test]
fn slips_of_a_second_set_are_found_at_their_key() {
    let dir = specgen_tests::repository().join("specs");
    let mut bases: Vec<Base> = SECOND_BASES.iter().map(|name| Base::of(name, spec(name), &dir)).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = ChaCha8Rng::seed_from_u64(SECOND_SEED);
    for index in 0..6 {
        let text = plausible::platform(&mut random, folder.path(), index);
        bases.push(Base::of(&format!("plausible {index}"), text, folder.path()));
    }
    let (good, all) = hit_rate(&bases, slips::all, SECOND_SEED, |_| 30);
    assert!(good as f64 >= SECOND_LEAST * all as f64, "{good} of {all}");
}

#[test]
fn the_comparison_knows_a_wrong_key() {
    let finding = |key: &str, message: &str| Diagnostic {
        severity: Severity::Error,
        code: "E0301",
        key: key.to_owned(),
        place: specgen::diagnostic::Place::Whole,
        message: message.to_owned(),
        help: String::new(),
    };
    assert!(is_about(&finding("gauge[2].point[1]", ""), "gauge[2].point[0]"));
    assert!(!is_about(&finding("gauge[1].point", ""), "gauge[2].point"));
    assert!(is_about(&finding("timing.period", "check `actuator.stroke`"), "actuator.stroke"));
    assert!(!is_about(&finding("actuator.stroke", "the stroke of the actuator"), "actuator.stack_gain"));
    // A spec without a slip has no new finding.
    let dir = specgen_tests::repository().join("specs");
    let (_, findings) = verdict(&spec("reference.toml"), &dir);
    let base = findings.iter().map(|one| (one.code.to_owned(), one.key.clone())).collect();
    assert!(new_findings(&base, findings).is_empty());
}

#[test]
fn plausible_platforms_are_not_refused() {
    // The second seed was never looked at while rules were made.
    for seed in [7, 20_261_122] {
        fifty_platforms(seed);
    }
}

fn fifty_platforms(seed: u64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut refused = String::new();
    let mut warnings: BTreeMap<String, usize> = BTreeMap::new();
    for index in 0..50 {
        let platform = plausible::platform(&mut random, folder.path(), index);
        let (accepted, findings) = verdict(&platform, folder.path());
        let (errors, rest): (Vec<_>, Vec<_>) = findings.into_iter().partition(|one| one.severity == Severity::Error);
        for one in rest {
            *warnings.entry(one.code.to_owned()).or_default() += 1;
        }
        if !accepted {
            for one in errors {
                refused += &format!("platform {index}: {} {}: {} ({})\n", one.code, one.key, one.message, one.help);
            }
        }
    }
    println!("warnings on 50 plausible platforms of seed {seed}: {warnings:?}");
    assert!(refused.is_empty(), "{refused}");
    // Warnings are no errors, but a lint that cries wolf is not read: at most one platform in ten for any rule of it.
    for (code, count) in warnings {
        assert!(!code.starts_with("W08") || count <= 5, "{code}: {count} of 50");
    }
}
