//! What cannot work in `[supervisor]` is refused with its line, and the fix is accepted.

use specgen::compile::compile;
use specgen::diagnostic::{Diagnostic, Place};
use specgen_tests::repository;
use std::collections::BTreeSet;
use std::fs;

/// Errors of a spec with a line in `[supervisor]`, each on that line.
fn errors(spec: &str, line: &str) -> Vec<Diagnostic> {
    let folder = tempfile::tempdir().expect("a folder");
    let specs = repository().join("specs");
    let text = fs::read_to_string(specs.join(spec)).expect("a spec");
    let text = text.replace("[timing]\n", &format!("[supervisor]\n{line}\n\n[timing]\n"));
    let at = text.find(line).expect("inserted");
    fs::create_dir(folder.path().join("records")).expect("created");
    let record = "records/reference-forc.csv";
    fs::copy(specs.join(record), folder.path().join(record)).expect("copied");
    let path = folder.path().join("platform.toml");
    fs::write(&path, &text).expect("written");
    let mut errors = match compile(&path) {
        Ok(_) => return Vec::new(),
        Err(refused) => refused.findings,
    };
    errors.retain(|found| found.code.starts_with('E'));
    for error in &errors {
        let Place::Spec(span) = &error.place else { panic!("no place: {errors:?}") };
        assert!((at..at + line.len()).contains(&span.start), "not on the line: {errors:?}");
    }
    assert!(!errors.is_empty());
    errors
}

/// Compiles a spec with a line in `[supervisor]`: code and help of the one finding.
fn verdict(spec: &str, line: &str) -> Result<(), (String, String)> {
    let errors = errors(spec, line);
    assert!(errors.len() <= 1, "{errors:?}");
    errors.first().map_or(Ok(()), |error| Err((error.code.to_owned(), error.help.clone())))
}

#[test]
fn what_cannot_work_is_refused_with_a_fix_that_works() {
    let cases = [
        ("legs.toml", "stuck_time = \"2 ms\"", "E0470"),
        ("reference.toml", "tracking_time = \"1 ms\"", "E0470"),
        ("legs.toml", "gauge_time = \"0.1 ms\"", "E0470"),
        ("legs.toml", "stuck_motion = \"1 nm\"", "E0471"),
        ("reference.toml", "disagreement = \"10 nm\"", "E0471"),
        ("reference.toml", "tracking_error = 0.0002", "E0471"),
        ("legs.toml", "tracking_error = 0.0001", "E0471"),
        ("reference.toml", "disturbance = \"5 nm\"", "E0471"),
        ("legs.toml", "host_lost = [\"2 s\", \"1 s\"]", "E0470"),
        ("reference.toml", "host_lost = [\"5 ms\", \"5 ms\"]", "E0470"),
        ("reference.toml", "host_lost = [\"0.05 ms\", \"5 s\"]", "E0470"),
        ("legs.toml", "wiring_check.time = \"3 ms\"", "E0470"),
        ("reference.toml", "wiring_check = { amplitude = 0.0003, time = \"50 ms\" }", "E0471"),
        ("reference.toml", "wiring_check.amplitude = 1e-9", "E0471"),
        ("reference.toml", "wiring_check.amplitude = 1e-6", "E0471"),
        ("legs.toml", "wiring_check.amplitude = 1e-5", "E0471"),
        ("reference.toml", "wiring_check = { amplitude = 1e-4, time = \"20 ms\" }", "E0471"),
        ("reference.toml", "wiring_check.leg_gain = [0.8, 1.4]", "E0476"),
        ("legs.toml", "wiring_check.leg_gain = [0.7, 1.2]", "E0476"),
        ("legs.toml", "ramp_rate = \"41 V/ms\"", "E0472"),
        ("legs.toml", "rest_voltage = \"101 V\"", "E0473"),
        ("reference.toml", "rest_voltage = \"-1 V\"", "E0473"),
    ];
    // One of each code in the short run.
    let mut tried = BTreeSet::new();
    for (spec, line, code) in cases {
        if !tried.insert(code) && specgen_tests::length(true, false) {
            continue;
        }
        let (found, help) = verdict(spec, line).expect_err(line);
        assert_eq!(found, code, "{line}: {help}");
        println!("{line}: {help}");
        // "leave key out: …"
        if let Some(fix) = help.strip_prefix("leave ") {
            let key = line.split(" = ").next().expect("a key");
            assert!(fix.starts_with(&format!("{key} out: it is then ")), "{line}: {help}");
            assert_eq!(verdict(spec, "# left out"), Ok(()), "{line}: fixed by leaving it out");
            continue;
        }
        // "write key = value or more; …"
        let fix = help.strip_prefix("write ").expect("a fix");
        let end = [" or more", " or less", " or wider", " or a voltage"]
            .iter()
            .filter_map(|word| fix.find(word))
            .min()
            .expect("an amount");
        assert_eq!(verdict(spec, &fix[..end]), Ok(()), "{line}: fixed by {}", &fix[..end]);
        // "…, or wiring_check.time = value or more", beside the line as it stands.
        if let Some((_, longer)) = fix.split_once(", or wiring_check.time = ")
            && line.starts_with("wiring_check.")
        {
            let longer = longer.split(" or more").next().expect("a time");
            let both = format!("{line}\nwiring_check.time = {longer}");
            assert_eq!(verdict(spec, &both), Ok(()), "{line}: fixed by {longer}");
        }
    }
}

/// Bounds of the wiring check that are reversed, empty, refuse every machine or let a fault pass.
#[test]
fn the_wiring_check_is_not_weakened_by_a_number() {
    let lines = [
        "gauge_gain = [1.33, 0.75]",
        "gauge_gain = [10, 10]",
        "gauge_gain = [0.0001, 1.33]",
        "gauge_gain = [0.75, 10]",
        "gauge_gain = [0.5, 1.33]",
        "gauge_gain = [0.95, 1.33]",
        "leg_gain = [0.0001, 10]",
        "leg_gain = [1.43, 0.7]",
        "leg_gain = [0.7, 2]",
        "leg_gain = [0.8, 1.2]",
        "residual = 1e-9",
        "residual = 0.29",
    ];
    for (number, line) in lines.into_iter().enumerate() {
        // One or the other in the short run.
        let specs = ["reference.toml", "legs.toml"];
        for spec in specgen_tests::length(&specs[number % 2..][..1], &specs) {
            let errors = errors(spec, &format!("wiring_check.{line}"));
            assert!(!errors.is_empty(), "{spec}: {line}");
            for Diagnostic { code, message, help, .. } in errors {
                assert!(code == "E0301" || code == "E0476", "{line}: {code} {message}");
                assert!(message.contains("expected ") || message.contains(" pass"), "{message}");
                assert!(help.contains(" range: ") || help.starts_with("write "), "{help}");
            }
        }
    }
}

#[test]
fn a_number_just_out_of_range_is_shown_with_its_digits() {
    let errors = errors("legs.toml", "wiring_check.amplitude = 0.0200001");
    assert!(errors[0].message.contains(" is 0.0200001, expected "), "{errors:?}");
}

/// Between −20 V and 80 V legs rest at 0 V; where 0 V is not permitted, at the limit nearest to it; else where the spec says.
#[test]
fn legs_rest_where_amplifiers_that_are_off_leave_them() {
    let record = fs::read_to_string(repository().join("specs/records/reference-forc.csv")).expect("a record");
    let shifted = |by: f64| {
        let mut column = None;
        let lines = record.lines().filter(|line| !line.starts_with('#')).map(|line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            match column {
                None => column = cells.iter().position(|name| name.starts_with("drive")),
                Some(at) => cells[at] = format!("{:?}", cells[at].trim().parse::<f64>().expect("a number") + by),
            }
            cells.join(",") + "\n"
        });
        lines.collect::<String>()
    };
    let cases = [(-20.0, "", 0.0), (10.0, "", 10.0), (-110.0, "", -10.0), (-20.0, "rest_voltage = \"30 V\"", 30.0)];
    for (number, (low, key, rest)) in cases.into_iter().enumerate() {
        let high = low + 100.0;
        let voltage = format!("voltage         = [\"{low} V\", \"{high} V\"]");
        let range = format!("range = [\"{} V\", \"{} V\"]", low - 10.0, high + 40.0);
        let edits = [
            ("voltage         = [\"0 V\", \"100 V\"]", voltage.as_str()),
            ("range = [\"0 V\", \"150 V\"]", range.as_str()),
            ("reference-forc.csv", "shifted.csv"),
            ("[timing]\n", &format!("[supervisor]\n{key}\n\n[timing]\n")),
        ];
        let records = [("shifted.csv", shifted(low))];
        let specs = ["legs.toml", "reference.toml"];
        for spec in specgen_tests::length(&specs[number % 2..][..1], &specs) {
            let compiled = specgen_tests::compile_edited("supervisor-bipolar", spec, &edits, &records);
            let actuation = &compiled.ir.actuation;
            let code = compiled.ir.supervision.rest;
            let volts = actuation.volts_at_zero + f64::from(code) * actuation.volts_per_code;
            assert!(
                (volts - rest).abs() <= 0.5 * actuation.volts_per_code + 1e-9,
                "{spec}, {low} V: rests at {volts} V"
            );
            assert!((actuation.code_min..=actuation.code_max).contains(&code));
            let odd = compiled.findings.iter().any(|found| found.code == "W0819");
            assert_eq!(odd, !key.is_empty(), "{spec}, {low} V: {:?}", compiled.findings);
        }
    }
}
