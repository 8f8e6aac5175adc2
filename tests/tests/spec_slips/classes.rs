//! Slips that make every value plausible by itself: another frame, a mirror image, angles for components, degrees for radians,
//! a diameter, what is not looked at by anybody until a machine stands. Each is reported at one of its keys by the rules that
//! need no record, a note counting for the one that says so.

use std::collections::{BTreeMap, BTreeSet};

use specgen::diagnostic::Diagnostic;
use specgen::spec::{SpecSource, load_as_far};

use super::edit::Edit::{Add, Value, With};
use super::set::Of::{self, Joints, Own, Reference};
use super::set::{Change, Slip, slips};
use crate::physical_lint::list;
use crate::physical_lint::support::spec;

type Vector = [f64; 3];

fn negated(axis: usize) -> impl Fn(Vector) -> Vector {
    move |mut vector| {
        vector[axis] = -vector[axis];
        vector
    }
}

/// The numbers of a literal such as `["1 mm", "2 mm"]` or `[0, 1]`.
fn numbers(literal: &str) -> Vec<f64> {
    let inner = literal.replace(['[', ']', '"'], "").replace("mm", "");
    inner.split(',').map(|text| text.trim().parse().unwrap()).collect()
}

/// Every line `KEY = …` with its vector changed.
fn vectors(text: &str, key: &str, is_length: bool, change: &dyn Fn(Vector) -> Vector) -> String {
    let line = |line: &str| match line.split_once('=') {
        Some((name, literal)) if name.trim() == key => {
            let vector = change(numbers(literal).try_into().unwrap());
            let items = vector.map(|x| if is_length { format!("\"{x} mm\"") } else { format!("{x}") });
            format!("{key} = [{}]", items.join(", "))
        }
        _ => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

fn points(text: &str, change: &dyn Fn(Vector) -> Vector) -> String {
    vectors(text, "point", true, change)
}

fn directions(text: &str, change: &dyn Fn(Vector) -> Vector) -> String {
    vectors(text, "direction", false, change)
}

fn gauges(text: &str, change: &dyn Fn(Vector) -> Vector) -> String {
    directions(&points(text, change), change)
}

/// Rows of `base_joints` or `platform_joints`, changed as a list.
fn joints(text: &str, body: &str, change: &dyn Fn(Vec<Vector>) -> Vec<Vector>) -> String {
    let begin = text.find(&format!("{body}_joints = [\n")).unwrap();
    let begin = begin + text[begin..].find('\n').unwrap() + 1;
    let end = begin + text[begin..].find("\n]").unwrap() + 1;
    let rows = text[begin..end].lines().map(|row| numbers(row.trim().trim_end_matches(',')).try_into().unwrap());
    let rows = change(rows.collect());
    let rows = rows.iter().map(|row| format!("    [{}],\n", row.map(|x| format!("\"{x} mm\"")).join(", ")));
    format!("{}{}{}", &text[..begin], rows.collect::<String>(), &text[end..])
}

fn both(text: &str, change: &dyn Fn(Vec<Vector>) -> Vec<Vector>) -> String {
    joints(&joints(text, "base", change), "platform", change)
}

fn backwards(mut rows: Vec<Vector>) -> Vec<Vector> {
    rows.reverse();
    rows
}

fn further(by: usize) -> impl Fn(Vec<Vector>) -> Vec<Vector> {
    move |mut rows| {
        rows.rotate_left(by);
        rows
    }
}

fn each(change: impl Fn(Vector) -> Vector) -> impl Fn(Vec<Vector>) -> Vec<Vector> {
    move |rows| rows.into_iter().map(&change).collect()
}

/// Changes of a spec as a whole.
const CHANGES: &[Change] = &[
    ("joints: -y", |t| both(t, &each(negated(1)))),
    ("joints: -x", |t| both(t, &each(negated(0)))),
    ("joints: x and y swapped", |t| both(t, &each(|[x, y, z]| [y, x, z]))),
    ("joints: backwards", |t| both(t, &backwards)),
    ("base joints: -y", |t| joints(t, "base", &each(negated(1)))),
    ("platform joints: backwards", |t| joints(t, "platform", &backwards)),
    ("base joints: one further", |t| joints(t, "base", &further(1))),
    ("base joints: two further", |t| joints(t, "base", &further(2))),
    ("platform joints: three further", |t| joints(t, "platform", &further(3))),
    ("gauges: -y", |t| gauges(t, &negated(1))),
    ("gauges: -x", |t| gauges(t, &negated(0))),
    ("points: -y", |t| points(t, &negated(1))),
    ("gauges: x and y swapped", |t| gauges(t, &|[x, y, z]| [y, x, z])),
    ("gauges: -z", |t| gauges(t, &negated(2))),
    ("directions: angles in degrees", |t| directions(t, &|v| v.map(|x: f64| x.acos().to_degrees()))),
    ("points: 180 lower", |t| points(t, &|[x, y, z]| [x, y, z - 180.0])),
    ("points: 180 higher", |t| points(t, &|[x, y, z]| [x, y, z + 180.0])),
    ("points: by 10", |t| points(t, &|v| v.map(|x| x / 10.0))),
    ("points: 200 further in x and y", |t| points(t, &|[x, y, z]| [x + 200.0, y + 200.0, z])),
    ("points: turned by 30 degrees", |t| points(t, &|[x, y, z]| [0.866 * x - 0.5 * y, 0.5 * x + 0.866 * y, z])),
    ("directions: turned by 20 degrees", |t| {
        directions(t, &|[x, y, z]| [0.94 * x - 0.342 * y, 0.342 * x + 0.94 * y, z])
    }),
    ("platform joints: 190 higher", |t| joints(t, "platform", &each(|[x, y, z]| [x, y, z + 190.0]))),
    ("base joints: 190 lower", |t| joints(t, "base", &each(|[x, y, z]| [x, y, z - 190.0]))),
];

/// What is found without a record: by the reader and by the lint.
fn found(text: &str) -> Vec<Diagnostic> {
    let dir = specgen_tests::repository().join("specs");
    let source = SpecSource { display_name: "spec".to_owned(), text: text.to_owned(), dir };
    let (model, mut found) = load_as_far(&source);
    found.extend(model.iter().flat_map(specgen::lint::check));
    // The records of the made-up platforms are elsewhere.
    found.retain(|one| !one.key.starts_with("hysteresis.records"));
    found
}

/// The codes that are for a class.
fn codes_of(class: &str) -> &'static [&'static str] {
    match class {
        "mirrored" => &["W0818", "W0825", "W0882", "N0883"],
        "angles for a vector" => &["W0340"],
        "another frame" => &["W0881", "W0884", "W0885", "W0825"],
        "noise" => &["W0807", "E0890", "W0886", "W0820", "W0822", "W0821"],
        "degrees for radians" => &["W0842", "W0887"],
        "a period that no board keeps" => &["E0334", "W0335", "E0870", "W0871"],
        "another point of a body" => &["W0856", "W0865"],
        "diameter, digits" => &["W0816", "W0817", "W0842", "W0877", "W0878", "W0888"],
        "percent, quality factor" => &["W0858"],
        "a time in another unit" => &["W0830", "W0831", "W0888"],
        "a tolerance for a factor" => &["W0889"],
        "a requirement in another unit" => &["W0854", "W0866"],
        _ => &[],
    }
}

fn mark(one: &Diagnostic) -> (&'static str, String) {
    (one.code, one.key.clone())
}

#[test]
fn slips_that_leave_every_value_plausible_are_reported_at_their_key() {
    let slips = slips("plausible_slips.txt", CHANGES);
    assert!(slips.len() >= 80);
    let (mut missed, mut used) = (String::new(), BTreeSet::new());
    let mut bases: BTreeMap<Of, BTreeSet<(&str, String)>> = BTreeMap::new();
    for Slip { kind: class, of, edits, keys, .. } in &slips {
        let text = of.text();
        let slip = edits.iter().fold(text.clone(), |text, edit| edit.of(&text));
        assert_ne!(slip, text, "{edits:?}");
        let known = &*bases.entry(*of).or_insert_with(|| found(&text).iter().map(mark).collect());
        let new: Vec<Diagnostic> = found(&slip).into_iter().filter(|one| !known.contains(&mark(one))).collect();
        let at = |one: &Diagnostic| {
            let named = |key: &&&str| list(&one.key) == **key || one.help.contains(&format!("`{key}`"));
            keys.iter().any(|key| named(&key)) && codes_of(class).contains(&one.code)
        };
        used.extend(new.iter().filter(|one| at(one)).map(|one| (*class, one.code)));
        if !new.iter().any(at) {
            let shown: Vec<_> = new.iter().map(|one| format!("{} {}: {}", one.code, one.key, one.message)).collect();
            missed += &format!("{class} in {of:?}: {edits:?}: not at {keys:?} but {shown:?}\n");
        }
    }
    assert!(missed.is_empty(), "{missed}");
    for Slip { kind: class, .. } in &slips {
        let idle = codes_of(class).iter().find(|code| !used.contains(&(*class, *code)));
        assert!(idle.is_none(), "{class}: {idle:?} for nothing");
    }
}

/// A gauge of 24 bits with another line for its noise.
fn with_bits(text: &str, noise: &str) -> String {
    text.replace("noise = \"2.2 nm\"", noise).replace("bits  = 17", "bits  = 24")
}

fn square(text: &str) -> String {
    let corners = [
        Value("gauge[3].point", "[\"60 mm\", \"60 mm\", \"180 mm\"]"),
        Value("gauge[4].point", "[\"-60 mm\", \"60 mm\", \"180 mm\"]"),
        Value("gauge[5].point", "[\"60 mm\", \"-60 mm\", \"180 mm\"]"),
    ];
    corners.into_iter().fold(text.to_owned(), |text, edit| edit.of(&text))
}

/// What a slip leads to is not said beside it, and its own finding names it.
#[test]
fn one_slip_is_one_finding() {
    for (of, edit, code, others) in [
        (Reference, Value("sensor.noise", "\"130 nm\""), "W0303", &["W0886"][..]),
        (Reference, Value("sensor.range", "[\"-55 nm\", \"55 nm\"]"), "W0304", &["W0886"]),
        (Reference, Value("gauge[5].point", "[\"0 mm\", \"80 mm\", \"29 mm\"]"), "W0881", &["W0826", "W0848"]),
        (Reference, Value("gauge[5].point", "[\"0 mm\", \"80 mm\", \"0 mm\"]"), "W0881", &["W0826", "W0848"]),
        (Reference, Value("gauge[1].point", "[\"40 mm\", \"-69.282 mm\", \"-180 mm\"]"), "W0848", &["N0883"]),
        (Joints, With(|t| both(t, &each(negated(1)))), "W0882", &["N0883"]),
        (Joints, With(|t| both(t, &backwards)), "W0882", &["N0883"]),
    ] {
        let found = found(&edit.of(&of.text()));
        let is = |code: &str| found.iter().any(|one| one.code == code);
        assert!(is(code) && !others.iter().any(|other| is(other)), "{edit:?}: {found:#?}");
        // Nothing is refused as far off at a key that was not touched.
        let Value(key, _) = edit else { continue };
        assert!(found.iter().all(|one| one.code != "E0890" || list(&one.key) == key), "{edit:?}: {found:#?}");
    }
    // Nor is a period beyond the estimate of a tick said to leave it room.
    let text = Value("timing.period", "\"45 us\"").of(&Own.text());
    assert!(found(&text).iter().any(|one| one.code == "W0335" && one.message.contains("about as long as the period")));
}

/// A vector may have any length, and points may lie about the platform.
#[test]
fn what_is_meant_is_not_reported() {
    let rules = ["W0340", "W0807", "W0881", "W0882", "N0883", "W0884", "W0885", "E0890"];
    for (of, edit) in [
        (Own, Value("gauge[0].direction", "[0, 0, 1000]")),
        (Own, Value("gauge[0].direction", "[0, 0, 0.001]")),
        (Own, Value("gauge[5].direction", "[25.4, 0, 0]")),
        (Own, Value("gauge[3].direction", "[1, 1, 0]")),
        (Own, Value("gauge[3].direction", "[3, 4, 0]")),
        (Own, Value("gauge[3].direction", "[100, 100, 0]")),
        (Own, Value("gauge[3].direction", "[0.866025, 0.5, 0]")),
        (Own, Value("gauge[0].point", "[\"96 mm\", \"0 mm\", \"0 mm\"]")),
        (Own, Value("gauge[5].point", "[\"0 mm\", \"96 mm\", \"240 mm\"]")),
        (Own, Value("platform.center_of_mass", "[\"0 mm\", \"0 mm\", \"60 mm\"]")),
        (Own, Add("gauge[0]", "target_point = [\"96 mm\", \"0 mm\", \"-20 mm\"]")),
        (Reference, With(|text| gauges(text, &|[x, y, z]| [-x, -y, z]))),
        // A fine converter beside an amplifier as it is bought.
        (Reference, With(|text| with_bits(text, "noise = \"5 pm\""))),
        (Reference, With(|text| with_bits(text, ""))),
        // In the plane, at corners of a square, along its sides.
        (Reference, With(square)),
    ] {
        let found = found(&edit.of(&of.text()));
        let wrong = found.iter().find(|one| rules.contains(&one.code));
        assert!(wrong.is_none(), "{edit:?}: {wrong:?}");
    }
    let specs = specgen_tests::repository().join("specs");
    for folder in [".", "features"] {
        for entry in std::fs::read_dir(specs.join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".toml") && name != "as-printed.toml" {
                let found = found(&spec(&format!("{folder}/{name}")));
                assert!(found.iter().all(|one| !rules.contains(&one.code)), "{name}: {found:?}");
            }
        }
    }
}
