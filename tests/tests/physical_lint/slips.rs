//! Slips are found at the key where they were made, and platforms without one are not refused.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use specgen::diagnostic::{Diagnostic, Place, Severity, codes};

use specgen_tests::length;

use super::support::tally::{Base, hit_rate, is_about, new_findings};
use super::support::undetectable::{is_of, undetectable};
use super::support::{mutants, plausible, slips, spec, verdict};

/// Specs that slips are made in.
const BASES: [&str; 5] = [
    "reference.toml",
    "legs.toml",
    "features/platform-gains.toml",
    "features/platform-calibration.toml",
    "features/platform-environment.toml",
];
const LEAST: f64 = 0.95;
/// More than this share declared undetectable would say that the kinds are no slips, or that the table excuses too much.
const MOST_UNDETECTABLE: f64 = 0.12;

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
/// First kinds in the second specs and ten plausible platforms: 267 of 300 before any rule was changed for them, 289 after.
const OTHER_SEED: u64 = 6_051;
/// 241 of 300 at first, 254 after a first round of rules, 273 after the second; 26 of the other 27 are undetectable.
const SECOND_SEED: u64 = 411;
/// Run only when rules and reasons stood: 281 of 300 at the first run, 13 of the rest undetectable. 283 after a slip of digits
/// that one rule hid from another was let through; nothing else was changed for it.
const THIRD_SEED: u64 = 90_417;

fn share_of_first(kind: &str) -> usize {
    if kind == "unit off by 1000" { 120 } else { 60 }
}

#[test]
#[ignore = "long: hundreds of slips, each compiled; those of the first hour are in the short run"]
fn slips_are_found_at_their_key() {
    let dir = specgen_tests::repository().join("specs");
    let bases: Vec<Base> =
        BASES.iter().take(length(1, BASES.len())).map(|name| Base::of(name, spec(name), &dir)).collect();
    let tally = hit_rate(&bases, mutants::all, 20_261_121, share_of_first);
    assert!(tally.of_all() >= LEAST, "{tally:?}");
}

/// Specs of the repository and `count` plausible platforms of a seed, whose tables lie in the folder.
fn bases(names: &[&str], seed: u64, count: usize) -> (tempfile::TempDir, Vec<Base>) {
    let dir = specgen_tests::repository().join("specs");
    let mut bases: Vec<Base> = names.iter().map(|name| Base::of(name, spec(name), &dir)).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for index in 0..count {
        let text = plausible::platform(&mut random, folder.path(), index);
        bases.push(Base::of(&format!("plausible {index}"), text, folder.path()));
    }
    (folder, bases)
}

/// Slips of the first kinds in other specs than those that the rules were tuned on.
#[test]
#[ignore = "long: hundreds of slips, each compiled"]
fn slips_of_the_first_kinds_are_found_in_other_specs() {
    let (_folder, bases) = bases(&SECOND_BASES[1..], OTHER_SEED, 10);
    let tally = hit_rate(&bases, mutants::all, OTHER_SEED, share_of_first);
    assert!(tally.of_all() >= LEAST, "{tally:?}");
}

/// Slips of other kinds in other specs than those that the rules were tuned on.
#[test]
#[ignore = "long: hundreds of slips, each compiled"]
fn slips_of_a_second_set_are_found_at_their_key() {
    let (_folder, bases) = bases(&SECOND_BASES, SECOND_SEED, 6);
    let tally = hit_rate(&bases, slips::all, SECOND_SEED, |_| 30);
    assert!(tally.of_detectable() >= LEAST && tally.excused() <= MOST_UNDETECTABLE, "{tally:?}");
}

/// All kinds, in platforms that nobody looked at while rules were made.
#[test]
#[ignore = "long: hundreds of slips, each compiled"]
fn slips_of_all_kinds_are_found_in_fresh_platforms() {
    let (_folder, bases) = bases(&[], THIRD_SEED, 10);
    let both = |text: &str| mutants::all(text).into_iter().chain(slips::all(text)).collect();
    let tally = hit_rate(&bases, both, THIRD_SEED, |_| 25);
    assert!(tally.of_detectable() >= LEAST && tally.excused() <= MOST_UNDETECTABLE, "{tally:?}");
}

/// No reason stands for a slip that nobody makes.
#[test]
#[ignore = "long: every slip of thirteen specs; the reasons are used in the full run only"]
fn every_reason_is_of_a_slip() {
    let (_folder, bases) = bases(&SECOND_BASES, SECOND_SEED, 6);
    let made = |base: &Base| mutants::all(&base.text).into_iter().chain(slips::all(&base.text)).collect::<Vec<_>>();
    let all: Vec<(&Base, Vec<mutants::Mutant>)> = bases.iter().map(|base| (base, made(base))).collect();
    for one in undetectable() {
        let used = all.iter().any(|(base, slips)| slips.iter().any(|slip| is_of(one, &base.name, slip)));
        assert!(used, "{one:?}");
    }
}

#[test]
fn the_comparison_knows_a_wrong_key() {
    let finding = |key: &str, message: &str| Diagnostic::new(codes::OUT_OF_RANGE, key, Place::Whole, message, "");
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
#[ignore = "long: a hundred platforms; some of another seed are in the short run"]
fn plausible_platforms_are_not_refused() {
    // The second seed was never looked at while rules were made.
    for seed in [20_261_122, 7] {
        are_accepted(seed);
    }
}

fn are_accepted(seed: u64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut refused = String::new();
    let mut warnings: BTreeMap<String, usize> = BTreeMap::new();
    let platforms = length(10, 50);
    for index in 0..platforms {
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
    println!("warnings on {platforms} plausible platforms of seed {seed}: {warnings:?}");
    assert!(refused.is_empty(), "{refused}");
    // Warnings are no errors, but a lint that cries wolf is not read: at most one platform in ten for any rule of it.
    for (code, count) in warnings {
        assert!(!code.starts_with("W08") || 10 * count <= platforms, "{code}: {count} of {platforms}");
    }
}
