//! Platforms that no controller may be made for: each is refused before anything is written, at its place in the file, with
//! what was expected, and with a fix that is itself accepted when it is put into the spec.

use std::fs;
use std::path::Path;

use specgen::compile::compile;
use specgen::diagnostic::{Diagnostic, Place, Severity, render};
use specgen::outcome::Refusal;
use specgen_tests::cases::{self, Case, replaced};
use specgen_tests::{length, repository};

fn reference() -> String {
    fs::read_to_string(repository().join("specs/reference.toml")).expect("a spec of this repository")
}

/// A folder with the records that the spec names.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("records")).expect("created");
    let record = "records/reference-forc.csv";
    fs::copy(repository().join("specs").join(record), folder.path().join(record)).expect("copied");
    folder
}

fn verdict(folder: &Path, text: &str, table: Option<&str>) -> Result<Vec<Diagnostic>, Refusal> {
    let path = folder.join("platform.toml");
    fs::write(&path, text).expect("written");
    if let Some(table) = table {
        fs::write(folder.join("table.csv"), table).expect("written");
    }
    compile(&path).map(|compiled| compiled.findings)
}

/// A table of poses; the first is 3 µm in x and 40 µrad about y, up and back in 0.1 s.
fn table(name: &str) -> String {
    let row = |k: u32| {
        let part = 0.5 * (1.0 - (std::f64::consts::TAU * f64::from(k) / 100.0).cos());
        format!("{:.6},{:.6}\n", 3.0 * part, 40.0 * part)
    };
    match name {
        "poses" => "x_um,theta_y_urad\n".to_owned() + &(0..=100).map(row).collect::<String>(),
        "ramp" => "z_um\n".to_owned() + &(0..=220).map(|k| format!("{}\n", 0.2 * f64::from(k))).collect::<String>(),
        "every 2 ms" => "time_ms,x_um\n0,0\n2,0\n4,0\n".to_owned(),
        "one row" => "x_um\n1\n".to_owned(),
        "empty" => String::new(),
        _ => panic!("no table {name}"),
    }
}

/// The number that follows `marker`.
fn after<'a>(help: &'a str, marker: &str) -> &'a str {
    let (_, rest) = help.split_once(marker).unwrap_or_else(|| panic!("no `{marker}` in: {help}"));
    let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c))).unwrap_or(rest.len());
    rest[..end].trim_end_matches('.')
}

/// The text with what the help says in place of everything in braces.
fn filled(text: &str, help: &str) -> String {
    let Some((before, rest)) = text.split_once('{') else { return text.to_owned() };
    let (mark, rest) = rest.split_once('}').expect("a closing brace");
    let value = if let Some((mark, end)) = mark.split_once('…') {
        let (_, rest) = help.split_once(mark).unwrap_or_else(|| panic!("no `{mark}` in: {help}"));
        rest.split_once(end).unwrap_or_else(|| panic!("no `{end}` in: {rest}")).0.to_owned()
    } else if let Some((sum, mark)) = mark.split_once(" + ") {
        let more: f64 = after(help, mark).parse().expect("a number");
        format!("{}", sum.parse::<f64>().expect("a number") + more)
    } else {
        after(help, mark).to_owned()
    };
    format!("{before}{value}{}", filled(rest, help))
}

/// The values of a list that the help offers.
fn list<'a>(help: &'a str, name: &str) -> &'a str {
    let (_, rest) =
        help.split_once(&format!("{name} [")).or_else(|| help.split_once(&format!("{name} = ["))).expect(help);
    rest.split_once(']').expect("a list").0
}

/// The spec with the lists that the help offers.
fn with_lists(which: &str, help: &str, bad: &str) -> String {
    let in_place = |name: &str, units: [&str; 2]| {
        let values = list(help, name).split(", ").enumerate().map(|(k, v)| format!("\"{v} {}\"", units[k / 3]));
        format!("{name} = [{}]", values.collect::<Vec<_>>().join(", "))
    };
    let lines = bad.lines().filter(|line| which != "stops" || !line.starts_with("stop_")).map(|line| {
        let line = match which {
            "gains" if line.starts_with("proportional = ") => in_place("proportional", ["N/m", "N m/rad"]),
            "gains" if line.starts_with("integral     = ") => in_place("integral", ["N/(m s)", "N m/(rad s)"]),
            "stiffness" if line.starts_with("stiffness = ") => {
                let factor: f64 = after(help, "stable up to ").parse().expect("a number");
                let [linear, angular] = [(1e9, "N/m"), (1e6, "N m/rad")]
                    .map(|(value, unit)| vec![format!("\"{:e} {unit}\"", value * factor); 3].join(", "));
                format!("stiffness = [{linear}, {angular}]")
            }
            "stops" if line.starts_with("stream_speed") => {
                let [acceleration, jerk] = ["stop_acceleration", "stop_jerk"].map(|name| list(help, name));
                format!("stop_acceleration = [{acceleration}]\nstop_jerk = [{jerk}]\n{line}")
            }
            _ => line.to_owned(),
        };
        line + "\n"
    });
    lines.collect()
}

/// Spec and table with the changes of a case: each changes the table if that has its text.
fn changed<'a>([spec, table]: [&str; 2], changes: impl Iterator<Item = (&'a str, String)>) -> [String; 2] {
    changes.fold([spec.to_owned(), table.to_owned()], |[spec, table], (old, new)| {
        if table.contains(old) { [spec, replaced(&table, old, &new)] } else { [replaced(&spec, old, &new), table] }
    })
}

/// The finding of a case, whose fix is accepted.
fn refused(case: &Case, folder: &Path) -> String {
    const CASE_1: &str = "kind      = \"case-1\"\nfrequency = \"1 Hz\"";
    let what = &case.title;
    let (mut spec, mut poses) = (reference(), String::new());
    if let Some(name) = case.one('t') {
        spec = replaced(&spec, CASE_1, "kind   = \"waveform\"\nfile   = \"table.csv\"\nperiod = \"1 ms\"");
        poses = table(name);
    }
    let [bad, bad_table] = changed([&spec, &poses], case.all('-').zip(case.all('+').map(str::to_owned)));
    let Err(refused) = verdict(folder, &bad, case.one('t').map(|_| bad_table.as_str())) else {
        panic!("{what}: accepted")
    };
    let source = refused.source.expect("it was read");
    let shown = render(&refused.findings, &source, false);
    let found = refused.findings.iter().find(|found| found.code == &what[..5]);
    let found = found.unwrap_or_else(|| panic!("{what}: not found:\n{shown}"));
    assert!(found.severity == Severity::Error && specgen::findings::find(found.code).is_some(), "{what}");
    let place = match (&found.place, case.one('@')) {
        (Place::Spec(span), Some(at)) => {
            assert!(bad[span.start..].starts_with(at), "{what}: not at `{at}`:\n{shown}");
            let (before, line) = (&bad[..span.start], bad[..span.start].matches('\n').count() + 1);
            let place = format!("{line}:{}", before.len() - before.rfind('\n').map_or(0, |end| end + 1) + 1);
            assert!(shown.contains(&format!("/platform.toml:{place}\n")), "{what}: not at {place}:\n{shown}");
            place
        }
        (Place::File { path, line }, None) => {
            assert!(path == "table.csv" && shown.contains("--> table.csv"), "{what}:\n{shown}");
            line.map_or("the table".to_owned(), |line| format!("line {line} of the table"))
        }
        (place, at) => panic!("{what}: at {place:?}, not {at:?}"),
    };
    let fixes = case.all('*').zip(case.all('=').map(|new| filled(new, &found.help)));
    let [mut fixed, mut table_fixed] = changed([&bad, &bad_table], fixes);
    match case.one('!') {
        Some("poses") => table_fixed = table("poses"),
        Some(which) => fixed = with_lists(which, &found.help, &bad),
        None => {}
    }
    assert!(fixed != bad || table_fixed != bad_table, "{what}: nothing fixed");
    if let Err(refused) = verdict(folder, &fixed, case.one('t').map(|_| table_fixed.as_str())) {
        let shown = render(&refused.findings, &source, false);
        panic!("{what}: the fix `{}` is refused in its turn:\n{shown}", found.help);
    }
    format!("{place}: {}\nhelp: {}", found.message, found.help)
}

#[test]
fn what_is_refused_has_a_fix_that_is_accepted() {
    let folder = folder();
    // Every tenth in the short run.
    cases::hold(&repository().join("tests/cases/platform_refusals.txt"), length(10, 1), |case| {
        refused(case, folder.path())
    });
}

#[test]
fn the_reference_is_accepted_and_what_can_be_found_in_a_bad_spec_is_found_in_one_run() {
    let folder = folder();
    let found = verdict(folder.path(), &reference(), None).expect("the reference compiles");
    assert!(found.iter().all(|found| found.severity < Severity::Error));
    let changes = [
        (
            "kind      = \"case-1\"\nfrequency = \"1 Hz\"",
            "kind   = \"waveform\"\nfile   = \"table.csv\"\nperiod = \"1 ms\"",
        ),
        (
            "mode       = \"pcc\"",
            "mode       = \"pcc\"\nlevel_bandwidth = \"5000 rad/s\"\ndrift_bandwidth = \"200 rad/s\"",
        ),
        ("records/reference-forc.csv", "records/bad.csv"),
    ];
    let bad = changes.iter().fold(reference(), |text, (old, new)| replaced(&text, old, new));
    fs::write(folder.path().join("records/bad.csv"), "seconds,volts\n0,1\n").expect("written");
    let poses = table("poses").replace("x_um", "x_V");
    let refused = verdict(folder.path(), &bad, Some(&poses)).expect_err("refused");
    let found: Vec<&str> = refused.findings.iter().map(|found| found.code).collect();
    assert!(["E0504", "E0421", "E0460"].iter().all(|code| found.contains(code)), "{found:?}");
}
