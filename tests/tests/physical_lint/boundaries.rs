//! Every rule by itself: one change that it reports, and the nearest that it does not.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use specgen::diagnostic::{Diagnostic, Severity};
use specgen::precision;
use specgen::spec::SpecSource;

use super::support::rules::{RULES, Rule};
use super::support::spec;

/// Findings of `check`: those of the compiler, of what only a build can tell, and, where it is asked for, of rounding.
fn checked(text: &str, dir: &Path, rounding: bool) -> Vec<Diagnostic> {
    let source = SpecSource { display_name: "platform.toml".to_owned(), text: text.to_owned(), dir: dir.to_path_buf() };
    match specgen::compile::compile_source(source) {
        Ok(compiled) => {
            let mut findings = compiled.findings;
            if rounding {
                let precision = precision::bounds(&compiled.model, &compiled.ir).expect("lowered before");
                findings.extend(precision::findings(&compiled.model, &precision, compiled.pose_noise.as_ref()));
            }
            findings.extend(specgen::lint::estimated(&compiled.model));
            findings.extend(compiled.reach.iter().flat_map(|reach| specgen::reach::notes(&compiled.model, reach)));
            findings
        }
        Err(refused) => refused.findings,
    }
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "no {from:?}");
    text.replacen(from, to, 1)
}

/// What a base is reported for without any change, by its text and whether rounding was asked for: many rules share one.
type Expectations = BTreeMap<(String, bool), BTreeSet<(String, String)>>;

/// What is wrong with a rule of the table, if anything.
fn broken(rule: &Rule, dir: &Path, bases: &mut Expectations) -> Option<String> {
    let base = rule.with.iter().fold(spec(rule.base), |text, (from, to)| replaced(&text, from, to));
    let rounding = rule.code == specgen::diagnostic::codes::PRECISION_POOR;
    let known = &*bases.entry((base.clone(), rounding)).or_insert_with(|| {
        checked(&base, dir, rounding).into_iter().map(|one| (one.code.to_owned(), one.key)).collect()
    });
    let new = |text: &str| {
        let mut found = checked(text, dir, rounding);
        found.retain(|one| {
            !known.contains(&(one.code.to_owned(), one.key.clone()))
                && (one.severity > Severity::Note || one.code == rule.code)
        });
        found
    };
    let (raised, passed) = (replaced(&base, rule.text, rule.raises), replaced(&base, rule.text, rule.passes));
    let list = |found: &[Diagnostic]| found.iter().map(|one| format!("{} {}", one.code, one.key)).collect::<Vec<_>>();
    let (found, quiet) = (new(&raised), new(&passed));
    let head = format!("{} {:?}", rule.code, rule.raises);
    if let Some(one) = quiet.iter().find(|one| one.code == rule.code) {
        return Some(format!("{head}: also raised by {:?}: {}", rule.passes, one.message));
    }
    let Some(one) = found.iter().find(|one| one.code == rule.code && one.key == rule.key) else {
        return Some(format!("{head}: not at {}: {:?}", rule.key, list(&found)));
    };
    if let Some(other) = found.iter().find(|one| one.code != rule.code && !rule.also.contains(&one.code)) {
        return Some(format!("{head}: also {} {}: {}", other.code, other.key, other.message));
    }
    let specgen::diagnostic::Place::Spec(span) = &one.place else {
        return Some(format!("{head}: at no place of the spec"));
    };
    let start = raised[..span.start].rfind('\n').map_or(0, |at| at + 1);
    let line = raised[start..].lines().next().unwrap_or("");
    let wanted = rule.line.unwrap_or_else(|| rule.raises.lines().next().unwrap_or(""));
    (!line.contains(wanted)).then(|| format!("{head}: at {line:?}"))
}

#[test]
fn every_rule_has_its_boundary() {
    let dir = specgen_tests::repository().join("specs");
    let mut bases = Expectations::new();
    let rules = RULES.iter().step_by(specgen_tests::length(20, 1));
    let broken: Vec<String> = rules.filter_map(|rule| broken(rule, &dir, &mut bases)).collect();
    assert!(broken.is_empty(), "{} of {}:\n{}", broken.len(), RULES.len(), broken.join("\n"));
    // No rule is left out; that of steps in a table of poses has a test of its own.
    let tried: BTreeSet<&str> = RULES.iter().map(|rule| rule.code).chain(["W0855"]).collect();
    for code in specgen::findings::all().iter().filter(|code| code.id[1..].starts_with("08")) {
        assert!(tried.contains(code.id), "{} is never tried", code.id);
    }
}

#[test]
fn the_test_of_rules_knows_a_wrong_one() {
    let dir = specgen_tests::repository().join("specs");
    let good = RULES.iter().find(|rule| rule.code == "W0832").expect("a rule");
    let mut bases = Expectations::new();
    assert!(broken(good, &dir, &mut bases).is_none());
    let wrong = [
        Rule { code: "W0831", ..*good },
        Rule { key: "control.lead", ..*good },
        Rule { raises: good.passes, ..*good },
        Rule { passes: good.raises, ..*good },
        Rule { line: Some("lead"), ..*good },
    ];
    for rule in wrong.into_iter().take(specgen_tests::length(2, 5)) {
        assert!(broken(&rule, &dir, &mut bases).is_some());
    }
}

#[test]
fn a_step_in_a_table_of_poses_stands_out_from_four_times_its_neighbours() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let base = spec("reference.toml").replace(
        "kind      = \"case-1\"\nfrequency = \"1 Hz\"",
        "kind = \"waveform\"\nfile = \"path.csv\"\nperiod = \"1 ms\"",
    );
    std::fs::create_dir(folder.path().join("records")).expect("a folder");
    let record = specgen_tests::repository().join("specs/records/reference-forc.csv");
    std::fs::copy(record, folder.path().join("records/reference-forc.csv")).expect("a record");
    // Rows 0.01 um apart, with one of `step` between.
    let steps = |step: f64| {
        let rows: Vec<String> =
            (0..40).map(|k| format!("{:.4}", 0.01 * f64::from(k) + if k >= 20 { step - 0.01 } else { 0.0 })).collect();
        std::fs::write(folder.path().join("path.csv"), format!("x_um\n{}\n", rows.join("\n"))).expect("written");
        let found = checked(&base, folder.path(), false);
        found.into_iter().find(|one| one.code == "W0855")
    };
    let raised = steps(0.0402).expect("a finding");
    // The twenty-first row, below the heading.
    assert!(
        matches!(&raised.place, specgen::diagnostic::Place::File { path, line: Some(22) } if path == "path.csv"),
        "{raised:?}"
    );
    assert!(steps(0.0398).is_none());
}
