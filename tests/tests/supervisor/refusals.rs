//! What cannot work in `[supervisor]` is refused with its line, and the fix is accepted.

use specgen::diagnostic::{Diagnostic, Place};
use specgen_tests::{cases, compile_text, edited, repository};
use std::fs;

/// Errors of a spec with a line in `[supervisor]`, each on that line.
fn errors(spec: &str, line: &str) -> Vec<Diagnostic> {
    let text = edited(spec, &[("[timing]\n", &format!("[supervisor]\n{line}\n\n[timing]\n"))]);
    let at = text.find(line).expect("inserted");
    let Err(mut errors) = compile_text(&text) else { return Vec::new() };
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

/// What is said of a line; a fix that the help gives is accepted.
fn refused(spec: &str, line: &str) -> String {
    let found = errors(spec, line);
    assert!(!found.is_empty(), "{line} is accepted");
    for Diagnostic { help, .. } in &found {
        // "leave key out: …"
        if let Some(fix) = help.strip_prefix("leave ") {
            let key = line.split(" = ").next().expect("a key");
            assert!(fix.starts_with(&format!("{key} out: the default is ")), "{line}: {help}");
            assert_eq!(verdict(spec, "# left out"), Ok(()), "{line}: fixed by leaving it out");
            continue;
        }
        // "write key = value or more; …"
        let Some(fix) = help.strip_prefix("write ") else { continue };
        let ends = [" or more", " or less", " or wider", " or a voltage"];
        let end = ends.iter().filter_map(|word| fix.find(word)).min().expect("an amount");
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
    let said = |one: Diagnostic| format!("{} {}: {}\nhelp: {}", one.code, one.key, one.message, one.help);
    found.into_iter().map(said).collect::<Vec<_>>().join("\n")
}

#[test]
fn what_cannot_work_is_refused_with_a_fix_that_works() {
    let file = repository().join("tests/cases/supervisor_refusals.txt");
    cases::hold(&file, specgen_tests::length(8, 1), |case| refused(case.one('@').expect("a spec"), &case.title));
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
    for (number, (low, key, rest)) in cases.into_iter().enumerate().step_by(specgen_tests::length(3, 1)) {
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
