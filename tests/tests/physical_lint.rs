//! The physical lint as a whole: slips are found at their key, and plausible platforms are not refused.

mod lint_support;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use lint_support::mutants::{self, Mutant};
use lint_support::rules::{RULES, Rule};
use lint_support::{plausible, slips, spec, verdict};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::diagnostic::{Diagnostic, Severity};
use specgen::precision::{self, Figures};
use specgen::spec::SpecSource;

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

/// A key without the indices of list items: `gauge[2].point[1]` → `gauge[2].point`.
fn list(key: &str) -> &str {
    let table = key.rfind('.').unwrap_or(0);
    key[table..].find('[').map_or(key, |at| &key[..table + at])
}

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

/// Every line of the errata under Data and Trajectories that a spec can hold: what is printed, the code, and the key or file.
/// Not here, for no spec holds them: geometry that the paper leaves out, the names of Table 1's columns, and one cell of
/// Table 5, a result.
const ERRATA: [(&str, &str, &str); 9] = [
    ("Table 4: 1.195 g", "E0311", "platform.mass"),
    ("section 3: 0.1262 um/V for a leg", "E0801", "actuator.stroke"),
    ("section 4: 2.2 um of 50 um", "W0303", "sensor.noise"),
    ("section 4: gains without units", "E0208", "gains.integral"),
    ("rotations of pi/72 rad", "E0313", "workspace.rotation[0]"),
    ("leg: 3.9 to 4.0122 um", "W0855", "trajectory"),
    ("case 1: y", "E0453", "trajectory[0].as_printed"),
    ("case 2: z", "E0453", "trajectory[1].as_printed"),
    ("machining: f_c and tf", "E0453", "trajectory[2].as_printed"),
];

#[test]
fn the_paper_as_printed_is_refused_with_every_erratum_and_the_corrected_one_passes() {
    let dir = specgen_tests::repository().join("specs");
    let text = spec("as-printed.toml");
    let (accepted, findings) = verdict(&text, &dir);
    assert!(!accepted);
    for (what, code, key) in ERRATA {
        let found =
            findings.iter().find(|one| one.code == code && list(&one.key) == list(key) && one.key.starts_with(key));
        let Some(found) = found else { panic!("{what}: no {code} at {key} in {findings:#?}") };
        assert!(!matches!(found.place, specgen::diagnostic::Place::Whole), "{what}: {found:?}");
        assert!(!found.help.is_empty(), "{what}");
    }
    // Each is there for its own reason: mended, its finding is gone.
    let mends = [
        ("\"1.195 g\"", "\"1.195 kg\"", "E0311"),
        ("stacks          = 1", "stacks          = 5", "E0801"),
        ("\"2.2 um\"", "\"2.2 nm\"", "W0303"),
    ];
    for (printed, mended, code) in mends {
        assert!(text.contains(printed), "{printed}");
        let (_, findings) = verdict(&text.replace(printed, mended), &dir);
        assert!(findings.iter().all(|one| one.code != code), "{code} stays");
    }
    let (accepted, findings) = verdict(&spec("reference.toml"), &dir);
    assert!(accepted && findings.iter().all(|one| !one.code.starts_with("W08")), "{findings:?}");
}

/// Each error found is within its bound, and the bound within so many times the largest found.
const NEAR: f64 = 20.0;

fn near(what: &str, figures: &Figures) -> Result<(), String> {
    for (axis, ratio) in figures.ratio().into_iter().enumerate() {
        let (bound, sampled) = (figures.bound[axis], figures.sampled[axis]);
        match ratio {
            // An axis that the workspace locks has neither.
            None if bound == 0.0 => {}
            Some(ratio) if (1.0..=NEAR).contains(&ratio) => {}
            _ => return Err(format!("{what} {axis}: bound {bound:e}, found {sampled:e}")),
        }
    }
    Ok(())
}

fn compiled(name: &str) -> specgen::compile::Compiled {
    let dir = specgen_tests::repository().join("specs");
    let source = SpecSource { display_name: name.to_owned(), text: spec(name), dir };
    specgen::compile::compile_source(source).expect("a good spec")
}

/// Every spec that is accepted, but the one that measures in QEMU only.
fn good_specs() -> Vec<String> {
    let specs = specgen_tests::repository().join("specs");
    let mut names = Vec::new();
    for folder in ["", "features/"] {
        for entry in std::fs::read_dir(specs.join(folder)).expect("specs") {
            let name = entry.expect("an entry").file_name().into_string().expect("a plain name");
            if name.ends_with(".toml") && name != "as-printed.toml" {
                names.push(format!("{folder}{name}"));
            }
        }
    }
    names.sort();
    names
}

#[test]
fn rounding_errors_stay_within_their_bound_and_near_it() {
    println!("spec, pose: x y z (nm), θx θy θz (nrad): bound / largest found = ratio");
    for name in good_specs() {
        let compiled = compiled(&name);
        let precision = precision::of(&compiled.model, &compiled.ir).expect("lowered before");
        let mut all = vec![("legs", precision.legs), ("commanded", precision.commanded)];
        all.extend(precision.measured.map(|figures| ("measured", figures)));
        for (what, figures) in all {
            let shown: Vec<String> = (0..6)
                .map(|k| {
                    let (bound, found) = (figures.bound[k] * 1e9, figures.sampled[k] * 1e9);
                    format!("{bound:.1e}/{found:.1e}={:.1}", bound / found)
                })
                .collect();
            println!("{name:<36} {what:<10} {}", shown.join(" "));
            near(&format!("{name} {what}"), &figures).expect("near");
            if let Some(against) = figures.against_f64 {
                // Another measure, of the same size: the same kernels in doubles.
                for (value, sampled) in against.iter().zip(&figures.sampled) {
                    assert!(*value > 0.5 * sampled && *value < 2.0 * sampled, "{name} {what}: {value:e} {sampled:e}");
                }
            }
        }
    }
}

#[test]
fn no_fresh_pose_is_off_by_more_than_the_bound() {
    for name in ["reference.toml", "features/platform-f32.toml", "features/platform-joints.toml"] {
        let compiled = compiled(name);
        let fresh = precision::tried(&compiled.model, &compiled.ir, 20_261_122, 30_000).expect("lowered before");
        for (what, figures) in
            [("legs", fresh.legs), ("commanded", fresh.commanded), ("measured", fresh.measured.expect("gauges"))]
        {
            near(&format!("{name} {what}"), &figures).expect("near");
        }
    }
}

#[test]
fn the_judgement_of_bounds_can_fail() {
    let good = Figures { bound: [6.0; 6], sampled: [1.0; 6], against_f64: None };
    near("good", &good).expect("near");
    for axis in 0..6 {
        let mut shrunk = good;
        shrunk.bound[axis] = 0.999;
        assert!(near("below what was found", &shrunk).is_err());
        let mut loose = good;
        loose.bound[axis] = 20.1;
        assert!(near("far from what was found", &loose).is_err());
        let mut none = good;
        none.bound[axis] = f64::NAN;
        assert!(near("no bound", &none).is_err());
    }
    // And the real one, shrunk as far as what was found.
    let compiled = compiled("reference.toml");
    let mut real = precision::of(&compiled.model, &compiled.ir).expect("lowered before").commanded;
    near("as it is", &real).expect("near");
    real.bound = real.bound.map(|bound| bound / 15.0);
    assert!(near("shrunk", &real).is_err());
}

/// Findings of `check`: those of the compiler, of what only a build can tell, and, where it is asked for, of rounding.
fn checked(text: &str, dir: &Path, rounding: bool) -> Vec<Diagnostic> {
    let source = SpecSource { display_name: "platform.toml".to_owned(), text: text.to_owned(), dir: dir.to_path_buf() };
    match specgen::compile::compile_source(source) {
        Ok(compiled) => {
            let mut findings = compiled.findings;
            if rounding {
                let precision = precision::of(&compiled.model, &compiled.ir).expect("lowered before");
                findings.extend(precision::findings(&compiled.model, &precision, compiled.pose_noise.as_ref()));
            }
            findings.extend(specgen::lint::estimated(&compiled.model));
            findings
        }
        Err(refused) => refused.findings,
    }
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "no {from:?}");
    text.replacen(from, to, 1)
}

/// What is wrong with a rule of the table, if anything.
fn broken(rule: &Rule, dir: &Path) -> Option<String> {
    let base = rule.with.iter().fold(spec(rule.base), |text, (from, to)| replaced(&text, from, to));
    let rounding = rule.code == specgen::diagnostic::codes::PRECISION_POOR;
    let known: BTreeSet<(String, String)> =
        checked(&base, dir, rounding).into_iter().map(|one| (one.code.to_owned(), one.key)).collect();
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
    let broken: Vec<String> = RULES.iter().filter_map(|rule| broken(rule, &dir)).collect();
    assert!(broken.is_empty(), "{} of {}:\n{}", broken.len(), RULES.len(), broken.join("\n"));
    // No rule is left out; that of steps in a table of poses has a test of its own.
    let tried: BTreeSet<&str> = RULES.iter().map(|rule| rule.code).chain(["W0855"]).collect();
    for code in specgen::diagnostic::codes::REGISTRY.iter().filter(|code| code.id[1..].starts_with("08")) {
        assert!(tried.contains(code.id), "{} is never tried", code.id);
    }
}

#[test]
fn the_test_of_rules_knows_a_wrong_one() {
    let dir = specgen_tests::repository().join("specs");
    let good = RULES.iter().find(|rule| rule.code == "W0832").expect("a rule");
    assert!(broken(good, &dir).is_none());
    let wrong = [
        Rule { code: "W0831", ..*good },
        Rule { key: "control.lead", ..*good },
        Rule { raises: good.passes, ..*good },
        Rule { passes: good.raises, ..*good },
        Rule { line: Some("lead"), ..*good },
    ];
    for rule in wrong {
        assert!(broken(&rule, &dir).is_some());
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
