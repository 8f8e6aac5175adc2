//! The data of the paper as printed.

use super::list;
use super::support::{spec, verdict};

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
    // Each is there for its own reason: fixed, its finding is gone.
    let fixes = [
        ("\"1.195 g\"", "\"1.195 kg\"", "E0311"),
        ("stacks          = 1", "stacks          = 5", "E0801"),
        ("\"2.2 um\"", "\"2.2 nm\"", "W0303"),
    ];
    for (printed, fixed, code) in fixes {
        assert!(text.contains(printed), "{printed}");
        let (_, findings) = verdict(&text.replace(printed, fixed), &dir);
        assert!(findings.iter().all(|one| one.code != code), "{code} stays");
    }
    let (accepted, findings) = verdict(&spec("reference.toml"), &dir);
    assert!(accepted && findings.iter().all(|one| !one.code.starts_with("W08")), "{findings:?}");
}
