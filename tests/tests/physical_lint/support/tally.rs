//! Makes slips in specs, and counts where they were found.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::diagnostic::{Diagnostic, Severity};

use super::super::list;
use super::mutants::Mutant;
use super::{undetectable, verdict};

/// Slips of a set in the full run; a fifteenth of them in the short one.
const MUTANTS: usize = 300;

/// Whether a finding is about the key: at it, or naming it in full.
pub fn is_about(finding: &Diagnostic, key: &str) -> bool {
    let key = list(key);
    let (section, name) = key.rsplit_once('.').expect("a key of a section");
    let plain = section.split('[').next().unwrap_or(section);
    let text = format!("{} {}", finding.message, finding.help);
    let named = text.contains(&format!("{plain}.{name}")) || text.contains(key);
    list(&finding.key) == key || named
}

/// Findings of the base are not found again.
pub fn new_findings(base: &BTreeSet<(String, String)>, findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let known = |one: &Diagnostic| base.contains(&(one.code.to_owned(), one.key.clone()));
    findings.into_iter().filter(|one| one.severity > Severity::Note && !known(one)).collect()
}

#[derive(Default)]
struct Count {
    all: usize,
    at_key: usize,
    named: usize,
    elsewhere: usize,
    undetectable: usize,
}

/// What became of a set of slips.
#[derive(Debug, Clone, Copy)]
pub struct Tally {
    pub all: usize,
    /// Found at the key, or by a finding that names it.
    pub good: usize,
    /// Not found, and declared undetectable with a reason.
    pub undetectable: usize,
}

impl Tally {
    /// Found, of all.
    pub fn of_all(self) -> f64 {
        self.good as f64 / self.all as f64
    }

    /// Declared undetectable, of all.
    pub fn excused(self) -> f64 {
        self.undetectable as f64 / self.all as f64
    }

    /// Found, of what can be.
    pub fn of_detectable(self) -> f64 {
        self.good as f64 / (self.all - self.undetectable) as f64
    }
}

/// A spec in which slips are made: its name, text and folder, and what is found in it as it is.
pub struct Base {
    pub name: String,
    pub text: String,
    dir: std::path::PathBuf,
    known: BTreeSet<(String, String)>,
}

impl Base {
    pub fn of(name: &str, text: String, dir: &Path) -> Self {
        let (accepted, findings) = verdict(&text, dir);
        assert!(accepted, "{name}: {findings:?}");
        let known = findings.into_iter().map(|one| (one.code.to_owned(), one.key)).collect();
        Self { name: name.to_owned(), text, dir: dir.to_path_buf(), known }
    }
}

/// [`MUTANTS`] of all the slips that `make` makes, the same number of each kind as far as there are; then whatever comes.
/// SPECGEN_MUTANTS=all tries every one. Returns how many of how many were found.
pub fn hit_rate(bases: &[Base], make: fn(&str) -> Vec<Mutant>, seed: u64, share: fn(&str) -> usize) -> Tally {
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
        let count = specgen_tests::length(MUTANTS / 15, MUTANTS);
        few.truncate(count);
        pool = few;
        assert_eq!(pool.len(), count, "of {whole}");
    }
    let mut counts: BTreeMap<&str, Count> = BTreeMap::new();
    let mut missed = String::new();
    let mut excused: BTreeMap<&str, String> = BTreeMap::new();
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
            let why = undetectable::reason(&base.name, mutant);
            count.undetectable += usize::from(why.is_some());
            count.elsewhere += usize::from(why.is_none() && !found.is_empty());
            let (name, found) = (&base.name, found.join(", "));
            let line = format!("  {name} | {} | {} | {} | {found}", mutant.kind, mutant.key, mutant.change);
            match why {
                Some(why) => *excused.entry(why).or_default() += &format!("{line}\n"),
                None => missed += &format!("{line}\n"),
            }
        }
    }
    println!(
        "{:<20} {:>5} {:>7} {:>6} {:>10} {:>7} {:>13}",
        "kind", "all", "at key", "named", "elsewhere", "missed", "undetectable"
    );
    let mut tally = Tally { all: 0, good: 0, undetectable: 0 };
    for (kind, one) in &counts {
        let silent = one.all - one.at_key - one.named - one.elsewhere - one.undetectable;
        println!(
            "{kind:<20} {:>5} {:>7} {:>6} {:>10} {silent:>7} {:>13}",
            one.all, one.at_key, one.named, one.elsewhere, one.undetectable
        );
        tally.all += one.all;
        tally.good += one.at_key + one.named;
        tally.undetectable += one.undetectable;
    }
    let (good, all, of_all) = (tally.good, tally.all, 100.0 * tally.of_all());
    let (of_detectable, undetectable) = (100.0 * tally.of_detectable(), tally.undetectable);
    println!(
        "{good} of {all} found with the right key ({of_all:.1} %; {of_detectable:.1} % without the {undetectable} undetectable), of a pool of {whole}; not found:\n{missed}"
    );
    println!("undetectable:");
    for (why, slips) in excused {
        println!(" {why}:\n{slips}");
    }
    tally
}
