//! What cannot work in `[supervisor]` is refused with its line, and the mend is accepted.

use specgen::compile::compile;
use specgen::diagnostic::Place;
use specgen_tests::repository;
use std::fs;

/// Compiles a spec with a line in `[supervisor]`: code and help of the one finding.
fn verdict(spec: &str, line: &str) -> Result<(), (String, String)> {
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
    let refused = match compile(&path) {
        Ok(_) => return Ok(()),
        Err(refused) => refused,
    };
    let errors: Vec<_> = refused.findings.iter().filter(|found| found.code.starts_with('E')).collect();
    assert_eq!(errors.len(), 1, "{errors:?}");
    let Place::Spec(span) = &errors[0].place else { panic!("no place: {errors:?}") };
    assert!((at..at + line.len()).contains(&span.start), "not on the line: {errors:?}");
    Err((errors[0].code.to_owned(), errors[0].help.clone()))
}

#[test]
fn what_cannot_work_is_refused_with_a_mend_that_works() {
    let cases = [
        ("legs.toml", "stuck_time = \"2 ms\"", "E0470"),
        ("reference.toml", "tracking_time = \"1 ms\"", "E0470"),
        ("legs.toml", "gauge_time = \"0.1 ms\"", "E0470"),
        ("legs.toml", "stuck_motion = \"1 nm\"", "E0471"),
        ("reference.toml", "disagreement = \"10 nm\"", "E0471"),
        ("reference.toml", "tracking_error = 0.0002", "E0471"),
        ("legs.toml", "tracking_error = 0.0001", "E0471"),
        ("legs.toml", "ramp_rate = \"41 V/ms\"", "E0472"),
    ];
    for (spec, line, code) in cases {
        let (found, help) = verdict(spec, line).expect_err(line);
        assert_eq!(found, code, "{line}: {help}");
        // "write key = value or more; …"
        let mend = help.strip_prefix("write ").expect("a mend");
        let end = [" or more", " or less"].iter().filter_map(|word| mend.find(word)).min().expect("an amount");
        println!("{line}: {help}");
        assert_eq!(verdict(spec, &mend[..end]), Ok(()), "{line}: mended by {}", &mend[..end]);
    }
}
