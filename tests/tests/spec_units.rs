//! Units of engineers in a spec: what is read, with its bits, and what is refused, with a help that is itself accepted.

use crate::support::specs::{every_key, folder_with_records, source};
use specgen::diagnostic::{Code, Diagnostic, Place, codes};
use specgen::model::Model;
use specgen::spec::{self, quantity};

/// The spec with every key, with the first line `name = …` replaced.
fn with(name: &str, value: &str) -> String {
    let text = every_key();
    let start = text.find(&format!("\n{name} = ")).expect(name) + 1;
    let end = start + text[start..].find('\n').expect("an end");
    format!("{}{name} = {value}{}", &text[..start], &text[end..])
}

/// The model, and the errors about the unit or the range of `name`.
fn load(text: &str, name: &str) -> (Option<Model>, Vec<Diagnostic>) {
    let (model, mut findings) = spec::load_as_far(&source(text, "spec.toml", &folder_with_records()));
    let about = |finding: &Diagnostic| finding.key.rsplit('.').next().is_some_and(|key| key.starts_with(name));
    findings.retain(|finding| {
        about(finding) && (finding.code.starts_with("E02") || finding.code == codes::OUT_OF_RANGE.id)
    });
    (model, findings)
}

type Field = fn(&Model) -> f64;

#[test]
fn engineers_units_give_the_bits_of_their_definitions() {
    let rows: &[(&str, &str, Field, f64)] = &[
        ("height", r#""7.1 in""#, |m| m.geometry.height, 0.180_34),
        ("height", r#""7.1″""#, |m| m.geometry.height, 0.180_34),
        ("height", "'7.1\"'", |m| m.geometry.height, 0.180_34),
        ("height", r#""7100 thou""#, |m| m.geometry.height, 0.180_34),
        ("mass", r#""2.6 lb""#, |m| m.platform.mass, 1.179_340_162),
        ("mass", r#""2.6 pounds""#, |m| m.platform.mass, 1.179_340_162),
        ("inertia", r#"["326 kg cm²", "326kgcm2", "97 KG CM^2"]"#, |m| m.platform.inertia[1], 0.0326),
        (
            "inertia",
            r#"["111 lb in^2", "111 lb-in²", "33 lbin^2"]"#,
            |m| m.platform.inertia[1],
            0.032_483_001_530_641_2,
        ),
        ("axial_stiffness", r#""57000 lbf/in""#, |m| m.actuator.axial_stiffness, 9_982_229.609_049_154),
        ("axial_stiffness", r#""57000 lb/in""#, |m| m.actuator.axial_stiffness, 9_982_229.609_049_154),
        ("axial_stiffness", r#""10 N/µm""#, |m| m.actuator.axial_stiffness, 1e7),
    ];
    for (name, value, field, expected) in rows {
        let (model, findings) = load(&with(name, value), name);
        assert!(findings.is_empty(), "{name} = {value}: {findings:#?}");
        let found = field(&model.unwrap_or_else(|| panic!("{name} = {value}")));
        assert_eq!(found.to_bits(), expected.to_bits(), "{name} = {value}: {found} and {expected}");
    }
}

/// Key, value, code, words of the help. Every quantity that a help shows is put in the place of the one that was refused.
#[test]
fn a_refused_unit_is_offered_as_a_value_that_is_accepted() {
    let rows: &[(&str, &str, Code, &str)] = &[
        // Two readings, of which the key takes one, both, or neither.
        ("height", "180 MM", codes::UNKNOWN_UNIT, "did you mean \"180 mm\"?"),
        ("period", "0.0002 S", codes::UNKNOWN_UNIT, "did you mean \"s\"?"),
        ("resonance", "0.9 khz x", codes::UNKNOWN_UNIT, "such as Hz or kHz"),
        ("slew_rate", "40 V/ms s", codes::BAD_QUANTITY, "group it"),
        // Other quantities of a data sheet.
        ("mass", "11.7 N", codes::WRONG_DIMENSION, "\"1.19306796918 kg\""),
        ("mass", "2.6 lbf", codes::WRONG_DIMENSION, "\"1.179340162 kg\""),
        ("axial_stiffness", "1000 kg/mm", codes::WRONG_DIMENSION, "\"9.80665e6 N/m\""),
        ("axial_stiffness", "0.1 um/N", codes::WRONG_DIMENSION, "the reciprocal: write \"1e7 N/m\""),
        ("stack_gain", "8 V/um", codes::WRONG_DIMENSION, "\"0.125 um/V\""),
        (
            "fixed_inertia",
            "35 mm",
            codes::WRONG_DIMENSION,
            "inertia = mass × radius of gyration²; with `leg.fixed_mass`",
        ),
        ("period", "20 kHz", codes::WRONG_DIMENSION, "\"50 us\""),
        ("period", "20 KHZ", codes::WRONG_DIMENSION, "\"50 us\""),
        // Capital letters that are another unit.
        ("height", "180e6 Nm", codes::WRONG_DIMENSION, "did you mean \"180e6 nm\"?"),
    ];
    let mut offered = 0;
    for (name, value, code, words) in rows {
        let (_, findings) = load(&with(name, &format!("\"{value}\"")), name);
        let [found] = findings.as_slice() else { panic!("{name} = {value}: {findings:#?}") };
        assert_eq!(found.code, code.id, "{name} = {value}: {found:#?}");
        assert!(found.help.contains(words), "{name} = {value}: {}", found.help);
        offered += accepted(name, value, found, |quantity| format!("\"{quantity}\""));
    }
    assert!(offered >= 10, "{offered} values offered");
}

/// Puts every quantity of a help in the place of the refused one, and applies its replacement; the number of quantities.
fn accepted(name: &str, value: &str, found: &Diagnostic, write: impl Fn(&str) -> String) -> usize {
    let quoted = found.help.split('"').skip(1).step_by(2);
    let offered: Vec<&str> = quoted.filter(|text| quantity::parse(text).is_ok()).collect();
    for quantity in &offered {
        let (_, findings) = load(&with(name, &write(quantity)), name);
        assert!(findings.is_empty(), "{name} = {quantity}, offered for {value}: {findings:#?}");
    }
    if let (Some(replacement), Place::Spec(place)) = (&found.replacement, &found.place) {
        let mut text = with(name, &write(value));
        text.replace_range(place.clone(), replacement);
        let (_, findings) = load(&text, name);
        assert!(findings.is_empty(), "{name}: {replacement}, for {value}: {findings:#?}");
    }
    offered.len()
}

/// A radius of gyration needs a mass, and a noise density a bandwidth.
#[test]
fn radius_of_gyration_and_noise_density_are_converted_with_the_other_values() {
    let list = |quantity: &str| format!("[\"{quantity}\", \"3.26e7 g mm^2\", \"9.7e6 g mm^2\"]");
    let (_, findings) = load(&with("inertia", &list("165 mm")), "inertia");
    let [found] = findings.as_slice() else { panic!("{findings:#?}") };
    assert_eq!((found.code, found.key.as_str()), (codes::WRONG_DIMENSION.id, "platform.inertia[0]"));
    assert_eq!(found.help, "inertia = mass × radius of gyration²; with `platform.mass`: \"3.2533875e7 g mm^2\"");
    assert_eq!(accepted("inertia", "165 mm", found, list), 1);

    // The first `noise` is that of the amplifier; the period is 200 us.
    let (_, findings) = load(&with("noise", "\"40 uV/√Hz\""), "noise");
    let [found] = findings.as_slice() else { panic!("{findings:#?}") };
    assert!(found.message.contains("this is the noise density of a voltage, expected a voltage"), "{}", found.message);
    assert_eq!(found.help, "rms = density × √bandwidth; up to half the control rate, 2500 Hz: \"2 mV\"");
    assert_eq!(accepted("noise", "40 uV/√Hz", found, |quantity| format!("\"{quantity}\"")), 1);
    assert_eq!(found.replacement, None);

    let other = "schema = 1\n[leg]\nfixed_inertia = \"35 mm\"\n[sensor]\nnoise = \"40 pm/rtHz\"\n";
    for (name, form) in [("fixed_inertia", "<number> g mm^2"), ("noise", "<number> nm")] {
        let (_, findings) = load(other, name);
        let [found] = findings.as_slice() else { panic!("{findings:#?}") };
        assert!(found.help.ends_with(&format!("in the form \"{form}\"")), "{}", found.help);
    }
}
