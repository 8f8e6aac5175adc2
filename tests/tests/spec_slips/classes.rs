//! Slips that make every value plausible by itself: another frame, a mirror image, angles for components, degrees for radians,
//! a diameter, what is not looked at by anybody until a machine stands. Each is reported at one of its keys by the rules that
//! need no record, a note counting for the one that says so.

use std::collections::{BTreeMap, BTreeSet};

use specgen::diagnostic::Diagnostic;
use specgen::spec::{SpecSource, load_as_far};

use super::edit::Edit::{self, Add, Text, Value, With};
use super::set::Of::{self, Gains, Joints, Legs, Own, Reference, Small, Triggers};
use crate::physical_lint::list;
use crate::physical_lint::support::spec;

/// A class, the spec, the edits, and the keys of which one is named by a finding of the class.
struct Slip(&'static str, Of, &'static [Edit], &'static [&'static str]);

const MIRRORED: &str = "mirrored";
const ANGLES: &str = "angles for a vector";
const FRAME: &str = "another frame";
const NOISE: &str = "noise";
const DEGREES: &str = "degrees for radians";
const TICK: &str = "a period that no board keeps";
const BODY: &str = "another point of a body";
const SIZE: &str = "diameter, digits";
const DAMPING: &str = "percent, quality factor";
const TIME: &str = "a time in another unit";
const FACTOR: &str = "a tolerance for a factor";
const GOAL: &str = "a requirement in another unit";

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

const LISTS: &[&str] = &["geometry.base_joints", "geometry.platform_joints"];
const POINTS: &[&str] = &["gauge[0].point", "gauge[1].point", "gauge[3].point", "gauge[4].point", "gauge[5].point"];
const LINES: &[&str] = &["gauge[0].direction", "gauge[3].direction", "gauge[5].direction"];
const SPEED: &[&str] = &["control.setpoint.speed"];

// One slip a line: this is a table.
#[rustfmt::skip]
const CLASSES: &[Slip] = &[
    Slip(MIRRORED, Joints, &[With(|t| both(t, &each(negated(1))))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| both(t, &each(negated(0))))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| both(t, &each(|[x, y, z]| [y, x, z])))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| both(t, &backwards))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| joints(t, "base", &each(negated(1))))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| joints(t, "platform", &backwards))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| joints(t, "base", &further(1)))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| joints(t, "base", &further(2)))], LISTS),
    Slip(MIRRORED, Joints, &[With(|t| joints(t, "platform", &further(3)))], LISTS),
    Slip(MIRRORED, Own, &[With(|t| gauges(t, &negated(1)))], POINTS),
    Slip(MIRRORED, Own, &[With(|t| gauges(t, &negated(0)))], POINTS),
    Slip(MIRRORED, Reference, &[With(|t| points(t, &negated(1)))], POINTS),
    Slip(MIRRORED, Reference, &[With(|t| gauges(t, &|[x, y, z]| [y, x, z]))], POINTS),
    Slip(MIRRORED, Own, &[With(|t| gauges(t, &negated(2)))], POINTS),
    Slip(ANGLES, Own, &[Value("gauge[5].direction", "[180, 90, 90]")], LINES),
    Slip(ANGLES, Own, &[Value("gauge[0].direction", "[90, 90, 0]")], LINES),
    Slip(ANGLES, Reference, &[Value("gauge[5].direction", "[0, 90, 0]")], LINES),
    Slip(ANGLES, Reference, &[Value("gauge[0].direction", "[75.5, 90, 14.5]")], LINES),
    Slip(ANGLES, Own, &[Value("gauge[3].direction", "[45, 45, 90]")], LINES),
    Slip(ANGLES, Own, &[Value("gauge[3].direction", "[1.5708, 0, 1.5708]")], LINES),
    Slip(ANGLES, Reference, &[With(|t| directions(t, &|v| v.map(|x: f64| x.acos().to_degrees())))], LINES),
    Slip(ANGLES, Reference, &[Add("gauge[0]", "target_normal = [90, 90, 0]")], &["gauge[0].target_normal"]),
    Slip(ANGLES, Own, &[Value("gauge[0].direction", "[96, 0, 180]")], LINES),
    Slip(FRAME, Own, &[With(|t| points(t, &|[x, y, z]| [x, y, z - 180.0]))], POINTS),
    Slip(FRAME, Own, &[With(|t| points(t, &|[x, y, z]| [x, y, z + 180.0]))], POINTS),
    Slip(FRAME, Reference, &[Value("gauge[4].point", "[\"-80 mm\", \"0 mm\", \"5 mm\"]")], POINTS),
    Slip(FRAME, Own, &[With(|t| points(t, &|v| v.map(|x| x / 10.0)))], POINTS),
    Slip(FRAME, Reference, &[With(|t| points(t, &|[x, y, z]| [x + 200.0, y + 200.0, z]))], POINTS),
    Slip(FRAME, Own, &[With(|t| points(t, &|[x, y, z]| [0.866 * x - 0.5 * y, 0.5 * x + 0.866 * y, z]))], LINES),
    Slip(FRAME, Reference, &[With(|t| directions(t, &|[x, y, z]| [0.94 * x - 0.342 * y, 0.342 * x + 0.94 * y, z]))], LINES),
    Slip(FRAME, Own, &[Add("gauge[0]", "target_point = [\"96 mm\", \"0 mm\", \"180 mm\"]")], &["gauge[0].target_point"]),
    Slip(FRAME, Joints, &[With(|t| joints(t, "platform", &each(|[x, y, z]| [x, y, z + 190.0])))], LISTS),
    Slip(FRAME, Joints, &[With(|t| joints(t, "base", &each(|[x, y, z]| [x, y, z - 190.0])))], LISTS),
    Slip(FRAME, Own, &[Value("platform.center_of_mass", "[\"0 mm\", \"0 mm\", \"190 mm\"]")], &["platform.center_of_mass"]),
    Slip(FRAME, Own, &[Text("[control.setpoint]", "[control.frames]\ntool = [\"0 mm\", \"0 mm\", \"200 mm\"]\n\n[control.setpoint]")], &["control.frames.tool"]),
    Slip(NOISE, Own, &[Value("amplifier.noise", "\"200 mV\"")], &["amplifier.noise"]),
    Slip(NOISE, Small, &[Value("amplifier.noise", "\"200 mV\"")], &["amplifier.noise"]),
    Slip(NOISE, Reference, &[Value("amplifier.noise", "\"2 V\"")], &["amplifier.noise"]),
    Slip(NOISE, Reference, &[Value("amplifier.noise", "\"20 nV\"")], &["amplifier.noise"]),
    Slip(NOISE, Own, &[Value("sensor.noise", "\"100 nm\"")], &["sensor.noise"]),
    Slip(NOISE, Reference, &[Value("sensor.noise", "\"0.022 nm\"")], &["sensor.noise"]),
    Slip(NOISE, Own, &[Value("sensor.range", "[\"-1300 um\", \"1300 um\"]")], &["sensor.range"]),
    Slip(NOISE, Small, &[Value("sensor.range", "[\"-15 um\", \"345 um\"]")], &["sensor.range"]),
    Slip(DEGREES, Own, &[Add("control.setpoint", "speed = [\"100 um/s\", \"100 um/s\", \"100 um/s\", \"1 deg/s\", \"1 deg/s\", \"1 deg/s\"]")], SPEED),
    Slip(DEGREES, Own, &[Add("control.setpoint", "speed = [\"100 um/s\", \"100 um/s\", \"100 um/s\", \"0.057 rad/s\", \"0.057 rad/s\", \"0.057 rad/s\"]")], SPEED),
    Slip(DEGREES, Reference, &[Value("control.setpoint.speed", "[\"100 mm/s\", \"100 mm/s\", \"100 mm/s\", \"1 mrad/s\", \"1 mrad/s\", \"1 mrad/s\"]")], SPEED),
    Slip(DEGREES, Own, &[Value("control.setpoint.stream_speed", "[\"1.5 mm/s\", \"1.3 mm/s\", \"2.4 mm/s\", \"11 deg/s\", \"10 deg/s\", \"11 deg/s\"]")], &["control.setpoint.stream_speed"]),
    Slip(DEGREES, Own, &[Value("control.setpoint.stream_speed", "[\"1.5 mm/s\", \"1.3 mm/s\", \"2.4 mm/s\", \"0.19 mrad/s\", \"0.19 mrad/s\", \"0.19 mrad/s\"]")], &["control.setpoint.stream_speed"]),
    Slip(DEGREES, Reference, &[Value("control.setpoint.acceleration", "[\"10 mm/s^2\", \"10 mm/s^2\", \"10 mm/s^2\", \"100 deg/s^2\", \"100 deg/s^2\", \"100 deg/s^2\"]")], &["control.setpoint.acceleration"]),
    Slip(DEGREES, Reference, &[Value("control.setpoint.jerk", "[\"1 m/s^3\", \"1 m/s^3\", \"1 m/s^3\", \"10 deg/s^3\", \"10 deg/s^3\", \"10 deg/s^3\"]")], &["control.setpoint.jerk"]),
    Slip(DEGREES, Reference, &[Add("control.setpoint", "stop_acceleration = [\"5000 m/s^2\", \"5000 m/s^2\", \"5000 m/s^2\", \"50000 rad/s^2\", \"50000 rad/s^2\", \"50000 rad/s^2\"]")], &["control.setpoint.stop_acceleration"]),
    Slip(TICK, Own, &[Value("timing.period", "\"20 us\"")], &["timing.period"]),
    Slip(TICK, Own, &[Value("timing.period", "\"45 us\"")], &["timing.period"]),
    Slip(TICK, Small, &[Value("timing.period", "\"25 us\"")], &["timing.period"]),
    Slip(TICK, Own, &[Value("target.mcu", "\"stm32f446re\""), Text("[requirements]", "[controller]\nscalar = \"f32\"\n\n[requirements]")], &["timing.period"]),
    Slip(TICK, Reference, &[Add("target.budget", "time = \"80 ms\"")], &["target.budget.time"]),
    Slip(TICK, Reference, &[Add("target.budget", "time = \"1 us\"")], &["target.budget.time"]),
    Slip(TICK, Reference, &[Value("target.budget.instructions", "4500000")], &["target.budget.instructions"]),
    Slip(BODY, Own, &[Value("leg.fixed_inertia", "\"476000 g mm^2\"")], &["leg.fixed_inertia"]),
    Slip(BODY, Small, &[Value("leg.extensible_inertia", "\"113300 g mm^2\"")], &["leg.extensible_inertia"]),
    Slip(BODY, Own, &[Value("platform.inertia", "[\"0.0898 kg m^2\", \"0.0898 kg m^2\", \"0.02 kg m^2\"]")], &["platform.inertia"]),
    Slip(SIZE, Own, &[Value("geometry.base_radius", "\"400 mm\"")], &["geometry.base_radius"]),
    Slip(SIZE, Reference, &[Value("geometry.base_radius", "\"300 mm\"")], &["geometry.base_radius"]),
    Slip(SIZE, Small, &[Value("geometry.platform_radius", "\"120 mm\"")], &["geometry.platform_radius", "geometry.base_radius"]),
    Slip(SIZE, Gains, &[Text("1.52e9 N/(m s)\", \"1.52e9 N/(m s)\", \"5.96e9 N/(m s)\", \"2.98e7 N m/(rad s)\", \"2.98e7 N m/(rad s)\", \"2.97e7", "1.52e6 N/(m s)\", \"1.52e6 N/(m s)\", \"5.96e6 N/(m s)\", \"2.98e4 N m/(rad s)\", \"2.98e4 N m/(rad s)\", \"2.97e4")], &["gains.integral"]),
    Slip(SIZE, Reference, &[Add("control", "correction = \"2 nm\"")], &["control.correction"]),
    Slip(SIZE, Reference, &[Add("control", "dynamics_tolerance = \"0.1 um\"")], &["control.dynamics_tolerance"]),
    Slip(SIZE, Triggers, &[Value("trigger[0].step", "\"1 mm\"")], &["trigger[0].step"]),
    Slip(DAMPING, Own, &[Value("control.modal_damping", "0.5")], &["control.modal_damping"]),
    Slip(DAMPING, Own, &[Value("control.modal_damping", "2e-4")], &["control.modal_damping"]),
    Slip(DAMPING, Small, &[Value("actuator.damping_ratio", "0.9")], &["actuator.damping_ratio"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\ngauge_time = \"10 s\"")], &["supervisor.gauge_time"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\narm_time = \"100 us\"")], &["supervisor.arm_time"]),
    Slip(TIME, Legs, &[Add("timing", "\n[supervisor]\nvoltage_time = \"0.5 ms\"")], &["supervisor.voltage_time"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\nhost_lost = [\"100 s\", \"1000 s\"]")], &["supervisor.host_lost"]),
    Slip(TIME, Legs, &[Add("timing", "\n[supervisor]\nramp_rate = \"0.1 V/s\"")], &["supervisor.ramp_rate"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\nstuck_motion = \"100 um\"")], &["supervisor.stuck_motion"]),
    Slip(TIME, Legs, &[Add("timing", "\n[supervisor]\ndisagreement = \"0.5 mm\"")], &["supervisor.disagreement"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\nleap = \"2 mm\"")], &["supervisor.leap"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\ndisturbance = \"10 um\"")], &["supervisor.disturbance"]),
    Slip(TIME, Reference, &[Add("timing", "\n[supervisor]\ntracking_error = 5.0")], &["supervisor.tracking_error"]),
    Slip(TIME, Legs, &[Add("hysteresis", "dead_time = \"10 ms\"")], &["hysteresis.dead_time"]),
    Slip(TIME, Triggers, &[Add("trigger[0]", "width = \"0.1 us\"")], &["trigger[0].width"]),
    Slip(FACTOR, Reference, &[Add("timing", "\n[robust]\nmass = [0.05, 0.05]")], &["robust.mass"]),
    Slip(FACTOR, Legs, &[Add("timing", "\n[robust]\ngain = [5.0, 5.0]")], &["robust.gain"]),
    Slip(GOAL, Reference, &[Add("timing", "\n[robust]\nmax_orientation = \"1 mrad\"")], &["robust.max_orientation"]),
    Slip(GOAL, Reference, &[Add("timing", "\n[[requirements.tracking]]\ntranslation = \"50 um\"")], &["requirements.tracking[0].translation"]),
    Slip(GOAL, Reference, &[Add("timing", "\n[[requirements.tracking]]\nrotation = \"0.5 mrad\"")], &["requirements.tracking[0].rotation"]),
    Slip(GOAL, Reference, &[Add("timing", "\n[[requirements.tracking]]\nfrequency = \"1000 Hz\"\ntranslation = \"50 nm\"")], &["requirements.tracking[0].frequency"]),
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
        MIRRORED => &["W0818", "W0825", "W0882", "N0883"],
        ANGLES => &["W0340"],
        FRAME => &["W0881", "W0884", "W0885", "W0825"],
        NOISE => &["W0807", "E0890", "W0886", "W0820", "W0822", "W0821"],
        DEGREES => &["W0842", "W0887"],
        TICK => &["E0334", "W0335", "E0870", "W0871"],
        BODY => &["W0856", "W0865"],
        SIZE => &["W0816", "W0817", "W0842", "W0877", "W0878", "W0888"],
        DAMPING => &["W0858"],
        TIME => &["W0830", "W0831", "W0888"],
        FACTOR => &["W0889"],
        GOAL => &["W0854", "W0866"],
        _ => &[],
    }
}

fn mark(one: &Diagnostic) -> (&'static str, String) {
    (one.code, one.key.clone())
}

#[test]
fn slips_that_leave_every_value_plausible_are_reported_at_their_key() {
    assert!(CLASSES.len() >= 80);
    let (mut missed, mut used) = (String::new(), BTreeSet::new());
    let mut bases: BTreeMap<Of, BTreeSet<(&str, String)>> = BTreeMap::new();
    for Slip(class, of, edits, keys) in CLASSES {
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
    for Slip(class, ..) in CLASSES {
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
