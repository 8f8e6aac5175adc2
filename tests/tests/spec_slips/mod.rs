//! The first hour of an engineer: slips in a spec are found, at the right key first, with a help that leads out.

mod classes;
mod edit;
mod set;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};
use specgen::diagnostic::{Diagnostic, Place, Severity};
use specgen::spec::keys::SECTIONS;
use specgen::spec::{SpecSource, load_as_far};

use crate::physical_lint::list;
use crate::physical_lint::support::{plausible, verdict};
use crate::support::help;
use edit::Edit;
use set::{Of, Slip};

/// Of all slips: found, found at the right key first, with the right help.
const BARS: [f64; 3] = [0.99, 0.95, 0.98];
const RECORD: &str = "leg.csv";

/// A spec as it is without a slip, in a folder with the files that it names.
struct Base {
    text: String,
    folder: tempfile::TempDir,
    known: BTreeSet<(String, String)>,
}

impl Base {
    fn of(which: Of) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let text = which.text();
        if matches!(which, Of::Own | Of::Small) {
            fs::write(folder.path().join(RECORD), record(&text, folder.path())).unwrap();
        } else {
            fs::create_dir(folder.path().join("records")).unwrap();
            let from = specgen_tests::repository().join("specs/records/reference-forc.csv");
            fs::copy(from, folder.path().join("records/reference-forc.csv")).unwrap();
        }
        let (accepted, findings) = verdict(&text, folder.path());
        assert!(accepted, "{which:?}: {findings:#?}");
        let known = findings.iter().map(mark).collect();
        Self { text, folder, known }
    }

    /// What is found with the slip and not without, in the order in which it is shown; and the text with the slip.
    fn with(&self, slip: &Slip) -> (String, Vec<Diagnostic>) {
        let text = slip.edits[0].of(&self.text);
        let path = self.folder.path().join(RECORD);
        let found = if let Edit::Record(change) = slip.edits[0] {
            let record = fs::read_to_string(&path).unwrap();
            fs::write(&path, change(&record)).unwrap();
            let (_, found) = verdict(&text, self.folder.path());
            fs::write(&path, record).unwrap();
            found
        } else {
            assert_ne!(text, self.text, "{slip:?}");
            verdict(&text, self.folder.path()).1
        };
        let new = |one: &Diagnostic| one.severity > Severity::Note && !self.known.contains(&mark(one));
        (text, found.into_iter().filter(new).collect())
    }
}

fn mark(one: &Diagnostic) -> (String, String) {
    (one.code.to_owned(), one.key.clone())
}

/// The record that `specgen new` simulates for such a spec.
fn record(text: &str, dir: &Path) -> String {
    let source = SpecSource { display_name: "spec".to_owned(), text: text.to_owned(), dir: dir.to_owned() };
    let model = load_as_far(&source).0.unwrap();
    let leg = specgen::machine::leg(&model, &LegParameters::reference());
    let experiment = ReversalExperiment {
        drive_max: leg.u_max,
        rate: leg.u_max / 5.0,
        ..ReversalExperiment::reference(model.hysteresis.grid as u32)
    };
    let mut record = experiment.run(&mut LegPlant::new(&leg), &mut Gauge::new(&leg.noise, 1, 0));
    record.rows.iter_mut().for_each(|row| row.drive += model.actuator.voltage[0]);
    record.to_csv()
}

/// The slips of `slips.txt`; each is one change.
fn slips() -> &'static [Slip] {
    static SLIPS: OnceLock<Vec<Slip>> = OnceLock::new();
    SLIPS.get_or_init(|| set::slips("slips.txt", set::RECORDS))
}

fn bases() -> BTreeMap<Of, Base> {
    let which: BTreeSet<Of> = slips().iter().map(|slip| slip.of).collect();
    which.into_iter().map(|of| (of, Base::of(of))).collect()
}

/// Slips, each with its text and what is found; every fifteenth of them in the short run. Two tests look at them.
type SlipResults = Vec<(&'static Slip, (String, Vec<Diagnostic>))>;

fn caught() -> &'static SlipResults {
    static TRIED: OnceLock<SlipResults> = OnceLock::new();
    TRIED.get_or_init(|| {
        let bases = bases();
        let some = slips().iter().step_by(specgen_tests::length(15, 1));
        some.map(|slip| (slip, bases[&slip.of].with(slip))).collect()
    })
}

/// Whether the finding is about one of the keys of the slip.
fn is_at(found: &Diagnostic, slip: &Slip) -> bool {
    // A finding about a file is about the record, whatever else the spec calls it.
    let in_record = matches!(&found.place, Place::File { .. }) && slip.keys.contains(&"");
    in_record || (!found.key.is_empty() && slip.keys.iter().any(|key| list(&found.key) == list(key)))
}

#[test]
fn slips_of_the_first_hour_are_found_at_the_right_key_with_a_help_that_leads_out() {
    assert!(slips().len() >= 120);
    let keys = SECTIONS.iter().flat_map(|section| section.keys);
    let examples: Vec<String> = keys.flat_map(help::values).filter(|value| value.starts_with('"')).collect();
    let mut counts: BTreeMap<&str, [usize; 4]> = BTreeMap::new();
    let mut missed = String::new();
    for (slip, (text, found)) in caught() {
        for one in found.iter().filter(|_| matches!(slip.of, Of::Own | Of::Small)) {
            // Some follow from what is written; the reference is the other machine.
            let known = |value: &str| {
                let (value, number) =
                    (value.trim_matches('"'), value.trim_matches('"').split(' ').next().unwrap_or(value));
                text.contains(number) || slip.fix.iter().any(|fix| fix.contains(value))
            };
            let foreign = examples.iter().find(|value| one.help.contains(*value) && !known(value));
            assert!(foreign.is_none(), "{slip:?}: {}: {foreign:?} is of another machine", one.help);
        }
        let first = found.first().is_some_and(|one| is_at(one, slip));
        let helps = |one: &Diagnostic| slip.fix.iter().any(|fix| one.help.contains(fix));
        let fixed = found.iter().find(|one| is_at(one, slip)).is_some_and(helps);
        let results = [!found.is_empty(), first, fixed];
        let count = counts.entry(slip.kind).or_default();
        count[0] += 1;
        for (sum, good) in count[1..].iter_mut().zip(results) {
            *sum += usize::from(good);
        }
        if results.contains(&false) {
            missed += &format!("  {results:?} {:?} {} {:?} for {:?}\n", slip.of, slip.kind, slip.edits, slip.keys);
            for one in found.iter().take(4) {
                missed += &format!("      {} {}: {} / {}\n", one.code, one.key, one.message, one.help);
            }
        }
    }
    println!("{:<24}{:>5}{:>8}{:>16}{:>12}", "kind", "all", "found", "right key first", "right help");
    let mut sum = [0; 4];
    for (kind, count) in &counts {
        println!("{kind:<24}{:>5}{:>8}{:>16}{:>12}", count[0], count[1], count[2], count[3]);
        sum.iter_mut().zip(count).for_each(|(sum, count)| *sum += count);
    }
    println!("{:<24}{:>5}{:>8}{:>16}{:>12}\nnot right:\n{missed}", "all", sum[0], sum[1], sum[2], sum[3]);
    for (good, bar) in sum[1..].iter().zip(BARS) {
        // No more misses than all of the set may have.
        assert!((sum[0] - good) as f64 <= (1.0 - bar) * slips().len() as f64, "{sum:?} against {BARS:?}");
    }
}

/// The voltage of the amplifier's input for that of the stacks: the converter and the stroke say 150 V, a power of ten 100 V.
#[test]
fn two_readings_of_a_value_are_both_offered() {
    let base = Base::of(Of::Small);
    for (edits, reading) in [
        (
            &[Edit::Value("actuator.voltage", "[\"0 V\", \"10 V\"]")][..],
            ["\"150 V\" (`dac.range` and the voltage", "\"100 V\""],
        ),
        (
            &[Edit::Value("actuator.voltage", "[\"0 V\", \"10 V\"]"), Edit::Value("dac.range", "[\"0 V\", \"10 V\"]")],
            ["it and `dac.range` are 15 times as large", "ten times larger"],
        ),
    ] {
        let text = edits.iter().fold(base.text.clone(), |text, edit| edit.of(&text));
        let (_, found) = verdict(&text, base.folder.path());
        let first = found.first().unwrap();
        assert!(list(&first.key) == "actuator.voltage" && first.help.contains("at the input"), "{first:?}");
        assert!(reading.iter().all(|reading| first.help.contains(reading)), "{first:?}");
    }
}

/// A value of the supervisor that is refused is said once, with a help that does not lead into the next finding.
#[test]
fn a_value_that_the_supervisor_refuses_is_found_once() {
    let base = Base::of(Of::Reference);
    let cases = [
        ("arm_time = \"10 us\"", "E0470", "\"100 ms\""),
        ("tracking_time = \"1 ms\"", "E0470", "\"100 ms\""),
        ("host_lost = [\"50 us\", \"70 us\"]", "E0470", "[\"100 ms\", \"10000 ms\"]"),
        ("ramp_rate = \"50 V/ms\"", "E0472", "\"100 V/s\""),
        ("disagreement = \"2 nm\"", "E0471", ""),
        ("leap = \"40 nm\"", "E0471", ""),
        ("tracking_error = 1e-6", "E0471", ""),
    ];
    for (line, code, default) in cases.into_iter().step_by(specgen_tests::length(3, 1)) {
        let with = |line: &str| base.text.replace("\n[timing]", &format!("\n[supervisor]\n{line}\n\n[timing]"));
        let (key, _) = line.split_once(" =").unwrap();
        let (accepted, found) = verdict(&with(line), base.folder.path());
        let here: Vec<&Diagnostic> = found.iter().filter(|one| one.key.contains(key)).collect();
        assert!(!accepted && here.len() == 1 && here[0].code == code, "{line}: {found:#?}");
        if default.is_empty() {
            continue;
        }
        let shown = default.replace('"', if default.starts_with('[') { "\"" } else { "" });
        assert!(here[0].help.contains(&format!("leave {key} out: the default is {shown}")), "{:?}", here[0]);
        let (accepted, found) = verdict(&with(&format!("{key} = {default}")), base.folder.path());
        assert!(accepted && found.iter().all(|one| !one.key.contains(key)), "{line}: {found:#?}");
    }
}

/// What stands as a replacement or as a figure in a help is accepted: with it in the text, what was found there is not found
/// again, and nothing new is refused at that key.
#[test]
fn every_fix_that_is_offered_is_accepted_by_the_next_check() {
    let bases = bases();
    let (mut tried, mut refused) = (0, String::new());
    let mut try_fix =
        |what: &str, found: &[Diagnostic], at: usize, text: &str, next: &dyn Fn(&str) -> Vec<Diagnostic>| {
            for fixed in fixes(&found[at], text) {
                tried += 1;
                let again = next(&fixed);
                let known = |one: &Diagnostic| found.iter().any(|old| mark(old) == mark(one));
                let stays = again.iter().filter(|one| mark(one) == mark(&found[at])).count()
                    >= found.iter().filter(|one| mark(one) == mark(&found[at])).count();
                let new = again.iter().find(|one| {
                    one.severity == Severity::Error && !known(one) && list(&one.key) == list(&found[at].key)
                });
                if stays || new.is_some() {
                    let old = &found[at];
                    refused += &format!(
                        "{what}: {} {}: {} / {:?}, then {new:#?}\n",
                        old.code, old.key, old.help, old.replacement
                    );
                }
            }
        };
    for (slip, (text, found)) in caught().iter().step_by(specgen_tests::length(5, 1)) {
        let base = &bases[&slip.of];
        let next = |text: &str| verdict(text, base.folder.path()).1;
        (0..found.len()).for_each(|at| try_fix(&format!("{:?}", slip.edits), found, at, text, &next));
    }
    let specs = specgen_tests::repository().join("specs");
    let corpus = fs::read_dir(specgen_tests::repository().join("tests/corpus")).unwrap();
    let mut paths: Vec<_> = corpus.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths.into_iter().step_by(specgen_tests::length(8, 1)) {
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = SpecSource::read(&path).unwrap().text;
        let next = |text: &str| verdict(text, &specs).1;
        let found = next(&text);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (0..found.len()).for_each(|at| try_fix(&name, &found, at, &text, &next));
    }
    println!("{tried} fixes tried");
    assert!(tried > specgen_tests::length(0, 100), "{tried}");
    assert!(refused.is_empty(), "{refused}");
}

/// The text with the fix that a finding offers: its replacement, or the largest value of a bound.
fn fixes(found: &Diagnostic, text: &str) -> Vec<String> {
    let Place::Spec(place) = &found.place else { return Vec::new() };
    let with = |new: &str| format!("{}{new}{}", &text[..place.start], &text[place.end..]);
    let mut fixes: Vec<String> = found.replacement.iter().map(|new| with(new)).collect();
    let bound = ["E0313", "E0441"].contains(&found.code);
    if let Some(most) = found.help.strip_prefix("at most ").filter(|_| bound) {
        let value = most.split([',', ';']).next().unwrap();
        fixes.push(with(&format!("\"{value}\"")));
    }
    fixes
}

/// Beside those of `physical_lint` and of `specgen new`: other platforms, which nobody looked at while rules were made.
#[test]
fn a_hundred_plausible_platforms_are_not_refused() {
    let mut refused = String::new();
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20_261_123);
    for index in 0..specgen_tests::length(3, 100) {
        let text = plausible::platform(&mut random, folder.path(), index);
        let (accepted, found) = verdict(&text, folder.path());
        if !accepted {
            refused += &format!("platform {index}: {:#?}\n{text}", found.first());
        }
    }
    assert!(refused.is_empty(), "{refused}");
}
