//! Every constant matters: one ulp more in one of them changes a digest, an output or a snapshot.

mod trial;

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::panic::Location;
use std::path::{Path, PathBuf};

use host_sim::controller::Controller;
use specgen_compiler::compile::compile;
use specgen_ir::Ir;
use specgen_runtime::Real;

use trial::Trial;

/// Source location of the conversion of a constant; numbers of an array have the same.
type Place = &'static Location<'static>;

thread_local! {
    /// Index of the number to change, and count of converted numbers.
    static SPOILT: Cell<Option<usize>> = const { Cell::new(None) };
    static COUNT: Cell<usize> = const { Cell::new(0) };
    /// Location of each number; none for zero.
    static PLACES: RefCell<Vec<Option<Place>>> = const { RefCell::new(Vec::new()) };
}

/// Changes a number of [`Convert`](crate::convert::Convert) by one ulp if it is the selected one.
#[track_caller]
pub fn spoilt<T: Real>(value: T) -> T {
    let number = COUNT.replace(COUNT.get() + 1);
    let place = (value != T::ZERO).then_some(Location::caller());
    PLACES.with_borrow_mut(|places| places.push(place));
    if SPOILT.get() == Some(number) { T::from_word(value.to_word() + 1) } else { value }
}

fn with_one_ulp(ir: &Ir, number: Option<usize>) -> Controller {
    SPOILT.set(number);
    COUNT.set(0);
    PLACES.with_borrow_mut(Vec::clear);
    crate::controller(ir).unwrap()
}

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The converted expression at a location, such as `law.lead`.
fn name(place: Place, sources: &mut BTreeMap<String, String>) -> String {
    let read = || std::fs::read_to_string(here().join("../..").join(place.file())).unwrap();
    let text = sources.entry(place.file().to_owned()).or_insert_with(read);
    let line = text.lines().nth(place.line() as usize - 1).unwrap();
    let call = &line[place.column() as usize - 1..];
    let argument = call.split_once('(').map_or(call, |(_, rest)| rest);
    let mut depth = 1;
    let end = argument.find(|c| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        depth == 0
    });
    argument[..end.unwrap_or(argument.len())].trim_start_matches(['&', '*']).to_owned()
}

/// Numbers of constants of one name, counted from 0 among those that are not zero.
type Numbers = BTreeSet<usize>;

/// Number of constants of a spec, and the names of those where an ulp is not seen.
struct ConstantCounts {
    all: usize,
    unseen: BTreeMap<String, Numbers>,
}

fn trial(spec: &str) -> ConstantCounts {
    let compiled =
        compile(&here().join("../../specs").join(spec)).unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let good = with_one_ulp(&compiled.ir, None);
    let places = PLACES.with_borrow(Clone::clone);
    let trial = Trial::of(&compiled, &good);
    let expected = trial.digests(&good);
    assert_eq!(trial.differs_in(&good, &expected, 0), None, "{spec}: a repeated trial");
    let (mut found, mut sources) = (ConstantCounts { all: 0, unseen: BTreeMap::new() }, BTreeMap::new());
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    // The part that saw the last constant of a name mostly sees the next one, too.
    let mut parts: BTreeMap<String, usize> = BTreeMap::new();
    for (number, place) in places.iter().enumerate() {
        let Some(place) = place else { continue };
        let name = name(place, &mut sources);
        let count = counts.entry(name.clone()).or_default();
        *count += 1;
        found.all += 1;
        let bad = with_one_ulp(&compiled.ir, Some(number));
        match trial.differs_in(&bad, &expected, parts.get(&name).copied().unwrap_or(0)) {
            Some(part) => {
                parts.insert(name, part);
            }
            None => {
                found.unseen.entry(name).or_default().insert(*count - 1);
            }
        }
    }
    found
}

/// Numbers as `0-5 9`.
fn shown(numbers: &Numbers) -> String {
    let mut text = String::new();
    let mut numbers = numbers.iter().peekable();
    while let Some(first) = numbers.next() {
        let mut last = first;
        while let Some(next) = numbers.next_if(|next| **next == last + 1) {
            last = next;
        }
        let space = if text.is_empty() { "" } else { " " };
        let _ = if first == last { write!(text, "{space}{first}") } else { write!(text, "{space}{first}-{last}") };
    }
    text
}

/// The committed list: after the name of a spec, a line for each constant that the trial does not see: name, numbers, reason.
fn list() -> PathBuf {
    here().join("unseen.txt")
}

/// Lines of the list for a spec: name and numbers to reason.
fn listed(spec: &str) -> BTreeMap<(String, String), String> {
    let text = std::fs::read_to_string(list()).unwrap();
    let of_spec = text.split("\n== ").find_map(|part| part.strip_prefix(&format!("{spec}\n"))).unwrap_or_default();
    let line = |line: &str| {
        let [name, numbers, reason] = line.splitn(3, " | ").collect::<Vec<_>>()[..] else { panic!("{line}") };
        assert!(!reason.is_empty() && !reason.contains('?'), "no reason: {line}");
        ((name.to_owned(), numbers.to_owned()), reason.to_owned())
    };
    of_spec.lines().filter(|line| !line.is_empty()).map(line).collect()
}

/// Errors in the lines of the list, with the correct lines; none if they are exact.
fn wrong(unseen: &BTreeMap<String, Numbers>, listed: &BTreeMap<(String, String), String>) -> Option<String> {
    let lines: BTreeSet<(String, String)> =
        unseen.iter().map(|(name, numbers)| (name.clone(), shown(numbers))).collect();
    let expected: BTreeSet<(String, String)> = listed.keys().cloned().collect();
    let of_name = |name: &str| listed.iter().find(|(key, _)| key.0 == name).map_or("?", |(_, reason)| reason.as_str());
    let right: Vec<String> =
        lines.iter().map(|(name, numbers)| format!("{name} | {numbers} | {}", of_name(name))).collect();
    (lines != expected).then(|| {
        format!(
            "not seen and not listed: {:?}; listed and seen: {:?}; exact would be:\n{}\n",
            lines.difference(&expected).collect::<Vec<_>>(),
            expected.difference(&lines).collect::<Vec<_>>(),
            right.join("\n")
        )
    })
}

fn every_constant_but_those_listed_is_seen(spec: &str) {
    let found = trial(spec);
    let unseen: usize = found.unseen.values().map(BTreeSet::len).sum();
    println!("{spec}: {unseen} of {} constants are not seen", found.all);
    if let Some(wrong) = wrong(&found.unseen, &listed(spec)) {
        panic!("{spec}: the list is not exact: {wrong}");
    }
}

/// Both a constant that is no longer seen, and one that is seen again, are reported.
#[test]
fn a_list_that_is_not_exact_is_refused() {
    let unseen = |names: &[(&str, &[usize])]| -> BTreeMap<String, Numbers> {
        names.iter().map(|(name, numbers)| ((*name).to_owned(), numbers.iter().copied().collect())).collect()
    };
    let listed = BTreeMap::from([(("a".to_owned(), "0-2 5".to_owned()), "a threshold".to_owned())]);
    assert_eq!(wrong(&unseen(&[("a", &[0, 1, 2, 5])]), &listed), None);
    for (numbers, word) in [(&[0, 1, 2][..], "0-2"), (&[0, 1, 2, 5, 6], "0-2 5-6"), (&[], "listed and seen: [(\"a\"")] {
        let found = if numbers.is_empty() { unseen(&[]) } else { unseen(&[("a", numbers)]) };
        assert!(wrong(&found, &listed).is_some_and(|text| text.contains(word)), "{word}");
    }
    let dead = wrong(&unseen(&[("a", &[0, 1, 2, 5]), ("b", &[7])]), &listed);
    assert!(dead.is_some_and(|text| text.contains("b | 7 | ?")));
}

#[test]
#[ignore = "long: some thousand controllers"]
fn one_ulp_in_a_constant_of_a_platform_is_seen() {
    every_constant_but_those_listed_is_seen("reference.toml");
}

#[test]
#[ignore = "long: some thousand controllers"]
fn one_ulp_in_a_constant_of_a_platform_in_single_precision_is_seen() {
    every_constant_but_those_listed_is_seen("features/platform-f32.toml");
}

#[test]
fn one_ulp_in_a_constant_of_six_legs_is_seen() {
    every_constant_but_those_listed_is_seen("legs.toml");
}
