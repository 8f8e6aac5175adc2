//! Structural modes in a spec: known ones, those that a controller must tolerate, and the design that was made for them.

// Clippy sees the helpers of an integration test as production code.
use std::fs;

use crate::support::specs::{errors, folder_with_records, source};
use specgen::diagnostic::{Diagnostic, codes};
use specgen::model::{Model, StoredDesign, StructuralKind, StructuralMode, StructuralUncertainty};
use specgen::spec;
use specgen_tests::repository;

/// The spec `name` with `more` behind it.
fn load(name: &str, more: &str) -> (Option<Model>, Vec<Diagnostic>) {
    let text = fs::read_to_string(repository().join("specs").join(name)).expect("readable");
    spec::load(&source(&format!("{text}\n{more}"), "spec.toml", &folder_with_records()))
}

fn model(more: &str) -> Model {
    let (model, findings) = load("reference.toml", more);
    assert!(findings.is_empty(), "{findings:#?}");
    model.expect("no findings")
}

fn mode(frequency: &str, at: &str, participation: &str) -> String {
    format!("[[mode]]\nfrequency = \"{frequency}\"\ndamping_ratio = 0.02\nat = \"{at}\"\n{participation}\n")
}

#[test]
fn a_mode_is_read_with_its_place_and_the_participation_of_its_kind() {
    use StructuralKind::{Frame, Gauge, Leg};
    for (at, given, kind, place, participation) in [
        ("leg", "", Leg, None, 1.0),
        ("leg 1", "", Leg, Some(0), 1.0),
        ("leg 6", "", Leg, Some(5), 1.0),
        ("gauge", "", Gauge, None, 0.5),
        ("gauge 2", "participation = 0.25", Gauge, Some(1), 0.25),
        ("frame", "", Frame, None, -0.1),
        ("frame", "participation = -1", Frame, None, -1.0),
    ] {
        let expected = StructuralMode { kind, place, frequency: 1180.0, damping_ratio: 0.02, participation };
        assert_eq!(model(&mode("1.18 kHz", at, given)).structural_modes, [expected], "{at}");
    }
    // In the order of the spec; other places may have the same frequency.
    let several = ["leg 1", "leg 2", "gauge 1", "frame"].map(|at| mode("1 kHz", at, "")).concat();
    let read = model(&(several + &mode("1.02 kHz", "leg 1", ""))).structural_modes;
    assert_eq!(read.iter().map(|mode| mode.place).collect::<Vec<_>>(), [Some(0), Some(1), Some(0), None, Some(0)]);
    assert!(model("").structural_modes.is_empty());
}

#[test]
fn a_spec_without_the_section_has_the_uncertainty_of_its_defaults() {
    let assumed = model("").structure;
    let kinds = vec![StructuralKind::Leg, StructuralKind::Gauge, StructuralKind::Frame];
    let expected = StructuralUncertainty {
        from: None,
        damping_ratio: 0.01,
        kinds,
        gauge_participation: 0.5,
        frame_participation: -0.1,
        given: false,
    };
    assert_eq!(assumed, expected);
    let given = |more: &str| model(&format!("[robust.structure]\n{more}")).structure;
    assert_eq!(given(""), StructuralUncertainty { given: true, ..expected.clone() });
    let own = "f0 = \"900 Hz\"\ndamping_ratio = 0.3\nkinds = [\"frame\", \"leg\"]\ngauge_participation = 1\nframe_participation = -0.2";
    let expected = StructuralUncertainty {
        from: Some(900.0),
        damping_ratio: 0.3,
        kinds: vec![StructuralKind::Frame, StructuralKind::Leg],
        gauge_participation: 1.0,
        frame_participation: -0.2,
        given: true,
    };
    assert_eq!(given(own), expected);
}

#[test]
fn what_is_wrong_with_a_mode_or_with_the_uncertainty_is_said_at_its_key() {
    let structure = |line: &str| format!("[robust.structure]\n{line}\n");
    let pair = |first: &str, at: &str, second: &str, other: &str| mode(first, at, "") + &mode(second, other, "");
    for (more, code, key) in [
        (mode("1 kHz", "leg 7", ""), codes::UNKNOWN_CHOICE, "mode[0].at"),
        (mode("1 kHz", "frame 1", ""), codes::UNKNOWN_CHOICE, "mode[0].at"),
        (mode("1 kHz", "leg 1", "participation = 0.5"), codes::MODE_KEY, "mode[0].participation"),
        (mode("1 kHz", "gauge", "participation = -0.5"), codes::OUT_OF_RANGE, "mode[0].participation"),
        (mode("1 kHz", "gauge 3", "participation = 0"), codes::OUT_OF_RANGE, "mode[0].participation"),
        (mode("1 kHz", "frame", "participation = 0.1"), codes::OUT_OF_RANGE, "mode[0].participation"),
        (pair("1 kHz", "leg 2", "1.009 kHz", "leg 2"), codes::MODE_TWICE, "mode[1].frequency"),
        (pair("1.009 kHz", "gauge 2", "1 kHz", "gauge"), codes::MODE_TWICE, "mode[1].frequency"),
        (pair("1 kHz", "frame", "1 kHz", "frame"), codes::MODE_TWICE, "mode[1].frequency"),
        ("[[mode]]\nfrequency = \"1 kHz\"\nat = \"leg\"\n".to_owned(), codes::MISSING_KEY, "mode[0].damping_ratio"),
        (structure("damping_ratio = 0"), codes::OUT_OF_RANGE, "robust.structure.damping_ratio"),
        (structure("damping_ratio = 0.31"), codes::OUT_OF_RANGE, "robust.structure.damping_ratio"),
        (structure("gauge_participation = 0"), codes::OUT_OF_RANGE, "robust.structure.gauge_participation"),
        (structure("frame_participation = 0"), codes::OUT_OF_RANGE, "robust.structure.frame_participation"),
        (structure("frame_participation = -1.1"), codes::OUT_OF_RANGE, "robust.structure.frame_participation"),
        (structure("kinds = []"), codes::WRONG_COUNT, "robust.structure.kinds"),
        (structure("kinds = [\"legs\"]"), codes::UNKNOWN_CHOICE, "robust.structure.kinds[0]"),
        (structure("kinds = [\"leg\", \"leg\"]"), codes::MODE_TWICE, "robust.structure.kinds[1]"),
        (structure("f0 = \"900 rad/s\""), codes::WRONG_DIMENSION, "robust.structure.f0"),
        (mode("5.001 kHz", "leg", ""), codes::RESONANCE_ALIASED, "mode[0].frequency"),
    ] {
        let (_, findings) = load("reference.toml", &more);
        let found: Vec<_> = findings.iter().map(|finding| (finding.code, finding.key.as_str())).collect();
        assert_eq!(found, [(code.id, key)], "{more}");
    }
    // A mode that the gauges see at another frequency is a warning only.
    assert!(load("reference.toml", &mode("6 kHz", "leg", "")).0.is_some());
}

#[test]
fn six_legs_with_their_own_gauges_take_no_structural_modes() {
    for (more, key) in [(mode("1 kHz", "leg", ""), "mode[0]"), ("[robust.structure]\n".to_owned(), "robust.structure")]
    {
        let (_, findings) = load("legs.toml", &more);
        let found: Vec<_> = errors(&findings).iter().map(|finding| (finding.code, finding.key.as_str())).collect();
        assert_eq!(found, [(codes::WITHOUT_CONTROL.id, key)]);
    }
    assert!(!load("legs.toml", "").0.expect("accepted").structure.given);
}

/// Every bit of it: the digest would otherwise belong to another design.
#[test]
fn a_stored_design_is_read_as_it_was_written() {
    let value = |index: usize| f64::from_bits(0x3ff0_0000_0000_0000 + 0x000f_1234_5678_9abc * index as u64 / 61);
    let design = StoredDesign {
        digest: "d0123456789abcdef".to_owned(),
        sections: std::array::from_fn(|mode| std::array::from_fn(|k| value(5 * mode + k) * [1.0, -3e-7, 0.0][k % 3])),
        notch_damping: std::array::from_fn(|mode| value(30 + mode) / 3.0),
        proportional: std::array::from_fn(|axis| value(36 + axis) * 1e7),
        integral: std::array::from_fn(|axis| value(42 + axis) * 1e-5),
        level_bandwidth: 450.0 / 7.0,
        drift_bandwidth: 1e6 / 3.0,
    };
    let read = model(&design.text()).task_space.expect("a spec with [control]").design;
    assert_eq!(read, Some(design.clone()));
    assert_eq!(model("").task_space.expect("a spec with [control]").design, None);
    // Without any of its keys it is no design.
    for key in ["digest", "notch_damping", "proportional", "integral", "level_bandwidth", "drift_bandwidth"] {
        let text = design.text();
        let kept: Vec<&str> = text.lines().filter(|line| !line.starts_with(key)).collect();
        let (_, findings) = load("reference.toml", &kept.join("\n"));
        let found: Vec<_> = errors(&findings).iter().map(|finding| (finding.code, finding.key.as_str())).collect();
        assert_eq!(found, [(codes::MISSING_KEY.id, format!("control.design.{key}").as_str())]);
    }
}
