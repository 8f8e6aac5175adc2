//! An unstable spec is refused with the largest weight that would do: that weight is accepted, a little more is not, and
//! the emitted controller on a simulated leg agrees.

use specgen::diagnostic::Severity;
use specgen_tests::{compile_text, edited};

/// Compiles the reference spec after edits; the findings' code and help if it is refused.
fn verdict(edits: &[(&str, String)]) -> Result<(), (String, String)> {
    let edits: Vec<(&str, &str)> = edits.iter().map(|(old, new)| (*old, new.as_str())).collect();
    match compile_text(&edited("legs.toml", &edits)) {
        Ok(_) => Ok(()),
        Err(findings) => {
            let errors = findings.iter().filter(|finding| finding.severity == Severity::Error);
            let [finding] = errors.collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
            assert!(matches!(finding.place, specgen::diagnostic::Place::Spec(_)), "{finding:?}");
            Err((finding.code.to_owned(), finding.help.clone()))
        }
    }
}

/// The number after `name is`, and the drift weight if one is named.
fn suggestion(help: &str, name: &str) -> (f64, Option<f64>) {
    let after = |marker: &str| {
        let rest = help.split_once(marker)?.1;
        let end = rest.find(|c: char| !(c.is_ascii_digit() || ".e-".contains(c))).unwrap_or(rest.len());
        rest[..end].trim_end_matches('.').parse().ok()
    };
    (after(&format!("{name} is ")).expect(help), after("proportion: "))
}

const LEVEL: &str = "level_weight = 0.252";
const DRIFT: &str = "drift_weight = 0.011";
const LAG: &str = "lag   = \"0.35 ms\"";

#[test]
fn the_suggested_weight_is_accepted_and_three_percent_more_is_not() {
    // Without the amplifier's lag the integrator meets the resonance at 5 kHz.
    let no_lag = || (LAG, "lag   = \"0 ms\"".to_owned());
    let (code, help) = verdict(&[no_lag()]).unwrap_err();
    assert_eq!(code, "E0402");
    let (level, drift) = suggestion(&help, "level_weight");
    let drift = drift.expect("PCC has a drift weight");
    let with = |scale: f64| {
        verdict(&[
            no_lag(),
            (LEVEL, format!("level_weight = {}", scale * level)),
            (DRIFT, format!("drift_weight = {}", scale * drift)),
        ])
    };
    println!("suggested {level}, {drift}");
    with(1.0).unwrap();
    assert_eq!(with(1.03).unwrap_err().0, "E0402");
}

#[test]
fn a_bandwidth_is_answered_with_a_bandwidth() {
    let edit = |bandwidth: f64| {
        vec![
            (LAG, "lag   = \"0 ms\"".to_owned()),
            ("mode         = \"pcc\"", "mode         = \"ewma\"".to_owned()),
            (LEVEL, format!("level_bandwidth = \"{bandwidth} rad/s\"")),
            (DRIFT, String::new()),
        ]
    };
    let (code, help) = verdict(&edit(2000.0)).unwrap_err();
    assert_eq!(code, "E0402");
    let (bandwidth, _) = suggestion(&help, "level_bandwidth");
    verdict(&edit(bandwidth)).unwrap();
    assert_eq!(verdict(&edit(1.03 * bandwidth)).unwrap_err().0, "E0402");
}

#[test]
fn weights_beyond_jury_are_refused_as_such() {
    let edits = [("gain_ratio   = [0.9, 1.1]", "gain_ratio   = [0.9, 8.0]".to_owned())];
    let (code, help) = verdict(&edits).unwrap_err();
    assert_eq!(code, "E0401");
    let (level, drift) = suggestion(&help, "level_weight");
    let fixed = [
        edits[0].clone(),
        (LEVEL, format!("level_weight = {level}")),
        (DRIFT, format!("drift_weight = {}", drift.expect("PCC"))),
    ];
    verdict(&fixed).unwrap();
}

/// A weight that the mode in force does not use is told from one in force, and taking it out is accepted.
#[test]
fn a_weight_that_is_not_in_force_may_be_taken_out() {
    let mode = || ("mode         = \"pcc\"", "mode         = \"invhys\"".to_owned());
    let no_lag = || (LAG, "lag   = \"0 ms\"".to_owned());
    let (code, help) = verdict(&[no_lag(), mode()]).unwrap_err();
    assert!(code == "E0402" && help.starts_with("leave out the weights of level and drift,"), "{help}");
    verdict(&[no_lag(), mode(), (LEVEL, String::new()), (DRIFT, String::new())]).unwrap();
}
