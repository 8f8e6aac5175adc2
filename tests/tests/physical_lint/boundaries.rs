//! Every rule by itself: one change that it reports, and the nearest that it does not.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use specgen::diagnostic::{Diagnostic, Place, Severity};
use specgen::precision;
use specgen::spec::SpecSource;
use specgen_tests::cases::{self, Case, replaced};

use super::support::spec;

fn file() -> PathBuf {
    specgen_tests::repository().join("tests/cases/lint_boundaries.txt")
}

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

/// What a base is reported for without any change, by its text and whether rounding was asked for: many rules share one.
type Expectations = BTreeMap<(String, bool), BTreeSet<(String, String)>>;

/// What is new with the change of a rule, each with its line; or what is wrong with the rule.
fn raised(rule: &Case, dir: &Path, bases: &mut Expectations) -> Result<String, String> {
    let (code, key) = rule.title.split_once(' ').expect("a code and a key");
    let (olds, news): (Vec<&str>, Vec<&str>) = (rule.all('-').collect(), rule.all('+').collect());
    let last = olds.len() - 1;
    let base = spec(rule.one('@').unwrap_or("reference.toml"));
    let base = olds.iter().zip(&news).take(last).fold(base, |text, (old, new)| replaced(&text, old, new));
    let rounding = code == specgen::diagnostic::codes::PRECISION_POOR;
    let known = &*bases.entry((base.clone(), rounding)).or_insert_with(|| {
        checked(&base, dir, rounding).into_iter().map(|one| (one.code.to_owned(), one.key)).collect()
    });
    let new = |text: &str| {
        let mut found = checked(text, dir, rounding);
        found.retain(|one| {
            !known.contains(&(one.code.to_owned(), one.key.clone()))
                && (one.severity > Severity::Note || one.code == code)
        });
        found
    };
    let text = replaced(&base, olds[last], news[last]);
    if let Some(one) =
        new(&replaced(&base, olds[last], rule.one('=').expect("what passes"))).iter().find(|one| one.code == code)
    {
        return Err(format!("{code} {key}: also raised by what passes: {}", one.message));
    }
    let found = new(&text);
    let line = |one: &Diagnostic| {
        let Place::Spec(span) = &one.place else { return format!("{} {} at no place of the spec", one.code, one.key) };
        let start = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
        format!("{} {}: {}", one.code, one.key, text[start..].lines().next().unwrap_or("").trim())
    };
    let lines = found.iter().map(line).collect::<Vec<_>>().join("\n");
    let is_there = found.iter().any(|one| one.code == code && one.key == key);
    if is_there { Ok(lines) } else { Err(format!("{code} not at {key} but {lines}")) }
}

#[test]
fn every_rule_has_its_boundary() {
    let dir = specgen_tests::repository().join("specs");
    let mut bases = Expectations::new();
    cases::hold(&file(), specgen_tests::length(32, 1), |rule| {
        raised(rule, &dir, &mut bases).unwrap_or_else(|wrong| panic!("{wrong}"))
    });
    // No rule is left out; that of steps in a table of poses has a test of its own.
    let rules = cases::read(&file());
    let tried: BTreeSet<&str> = rules.iter().map(|(rule, _)| &rule.title[..5]).chain(["W0855"]).collect();
    for code in specgen::diagnostic::codes::REGISTRY.iter().filter(|code| code.id[1..].starts_with("08")) {
        assert!(tried.contains(code.id), "{} is never tried", code.id);
    }
}

#[test]
#[ignore = "long: a rule changed in four ways; that a case with another outcome fails is in the short run"]
fn the_test_of_rules_knows_a_wrong_one() {
    let dir = specgen_tests::repository().join("specs");
    let rules = cases::read(&file());
    let (good, came) = rules.iter().find(|(rule, _)| rule.title.starts_with("W0832 ")).expect("a rule");
    let mut bases = Expectations::new();
    assert_eq!(raised(good, &dir, &mut bases).map(|found| format!("> {found}")), Ok(came.clone()));
    let wrong = |change: fn(&mut Case)| {
        let mut rule = good.clone();
        change(&mut rule);
        raised(&rule, &dir, &mut Expectations::new())
    };
    assert_eq!(good.parts.iter().map(|part| part.0).collect::<String>(), "-+=");
    assert!(wrong(|rule| rule.title = rule.title.replace("W0832", "W0831")).is_err());
    assert!(wrong(|rule| rule.title = "W0832 control.lead".to_owned()).is_err());
    assert!(wrong(|rule| rule.parts[1].1 = rule.parts[2].1.clone()).is_err());
    assert!(wrong(|rule| rule.parts[2].1 = rule.parts[1].1.clone()).is_err());
}

/// A case with another outcome than its file says fails, and so does a file without a case.
#[test]
fn a_case_that_differs_is_seen() {
    if std::env::var_os("SPECGEN_BLESS").is_some() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let fails = |text: &str, step: usize| {
        let file = folder.path().join("cases.txt");
        std::fs::write(&file, text).expect("written");
        std::panic::catch_unwind(|| cases::hold(&file, step, |case| case.edited("a b"))).is_err()
    };
    assert!(!fails("# about\n\none\n- a\n+ c\n> c b\n\ntwo\n- b\n+ c\n> a c\n", 1));
    assert!(fails("one\n- a\n+ c\n> c\n", 1) && fails("one\n- a\n+ c\n", 1) && fails("# about\n", 1));
    assert!(fails("one\n- x\n+ c\n> a b\n", 1), "nothing to replace");
    assert!(!fails("one\n- a\n+ c\n> c b\n\ntwo\n> x\n", 2), "every second one");
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
    assert!(matches!(&raised.place, Place::File { path, line: Some(22) } if path == "path.csv"), "{raised:?}");
    assert!(steps(0.0398).is_none());
}
