//! The specs of the task-space controller as models: every value of the reference in SI, and what each feature changes.

// Clippy sees the helpers of an integration test as production code.
use crate::support;
use std::f64::consts::PI;
use std::fs;

use crate::support::specs::{errors, folder_with_records, source};
use specgen::diagnostic::{codes, render};
use specgen::model::{Model, Probe, TaskSpace, Trajectory, TrajectoryKind};
use specgen::spec::{self, SpecSource};
use specgen_tests::{cases, repository};

fn model(name: &str) -> Model {
    let source = SpecSource::read(&repository().join("specs").join(name)).expect("readable");
    let (model, findings) = spec::load(&source);
    assert!(findings.is_empty(), "{}", render(&findings, &source, false));
    model.expect("no findings")
}

fn task_space(name: &str) -> TaskSpace {
    model(name).task_space.expect("a spec with [control]")
}

/// Every value of a model, a line each, without where it stands in the spec.
fn values(mut model: Model) -> Vec<String> {
    model.spans.clear();
    let mut lines: Vec<String> = Vec::new();
    for line in format!("{model:#?}").lines() {
        // A list of numbers is one line.
        let is_number = |line: &str| line.trim_end_matches(',').trim().parse::<f64>().is_ok();
        match lines.last_mut() {
            Some(last) if last.ends_with('[') && is_number(line) => *last += line.trim(),
            Some(last) if last.ends_with(',') && last.contains('[') && is_number(line) => {
                *last += &format!(" {}", line.trim());
            }
            Some(last) if last.contains('[') && last.ends_with(',') && !last.contains(']') => {
                *last = format!("{}{}", last.trim_end_matches(','), line.trim());
            }
            _ => lines.push(line.to_owned()),
        }
    }
    lines
}

/// Of the first spec every value in SI; of the others what is not as there.
#[test]
fn every_value_is_in_si() {
    let reference = values(model("reference.toml"));
    cases::hold(&repository().join("tests/cases/spec_values.txt"), 1, |case| {
        let mut lines = values(model(&case.title));
        lines.retain(|line| case.title == "reference.toml" || !reference.contains(line));
        lines.join("\n")
    });
}

/// (1), (2) and (AI.3), (AI.4), the angles written out.
#[test]
fn joint_circles_are_the_joints_of_the_paper() {
    let geometry = model("reference.toml").geometry;
    let half = 0.006 * PI;
    let third = 2.0 * PI / 3.0;
    let base = [third / 2.0 - half, third / 2.0 + half, PI - half, PI + half, -third / 2.0 - half, -third / 2.0 + half];
    let platform = [half, third - half, third + half, -third - half, -third + half, -half];
    for leg in 0..6 {
        for (joint, angle, radius) in
            [(geometry.base_joints[leg], base[leg], 0.15), (geometry.platform_joints[leg], platform[leg], 0.1)]
        {
            let expected = [radius * angle.cos(), radius * angle.sin(), 0.0];
            for axis in 0..3 {
                assert!((joint[axis] - expected[axis]).abs() < 1e-15, "leg {leg}: {joint:?} and {expected:?}");
            }
        }
    }
    assert_eq!(geometry.height, 0.18);
    assert!((geometry.joint_radius() - 0.1).abs() < 1e-15);
    let legs = model("legs.toml");
    assert_eq!((legs.geometry, legs.task_space), (geometry, None));
}

/// Rows dy/dh of the gauges at rest, per m and rad: the reading d·(t + θ × p) where the target stands square.
fn readings(probes: &[Probe; 6], height: f64) -> nalgebra::Matrix6<f64> {
    let mut rows = nalgebra::Matrix6::zeros();
    for (i, probe) in probes.iter().enumerate() {
        let (n, d) = (nalgebra::Vector3::from(probe.plane_normal), nalgebra::Vector3::from(probe.direction));
        // Where the line meets the target at rest.
        let [x, y, z] = probe.point;
        let point = nalgebra::Vector3::new(x, y, z - height);
        let hit = point + d * (n.dot(&(nalgebra::Vector3::from(probe.plane_point) - point)) / n.dot(&d));
        let (along, about) = (n / n.dot(&d), hit.cross(&n) / n.dot(&d));
        rows.set_row(i, &nalgebra::RowVector6::new(along.x, along.y, along.z, about.x, about.y, about.z));
    }
    rows
}

/// The layout gives the pose noise of the study, 2.7, 1.6, 1.3 nm and 22, 22, 19 nrad from 2.2 nm.
#[test]
fn the_gauges_of_the_reference_give_the_pose_noise_of_the_study() {
    let inverse =
        readings(&task_space("reference.toml").probes, 0.18).try_inverse().expect("the gauges see every direction");
    let noise = [2.69, 1.56, 1.27, 22.45, 22.45, 19.45];
    for (axis, expected) in noise.into_iter().enumerate() {
        let found = 2.2 * inverse.row(axis).norm();
        assert!((found - expected).abs() < 0.01, "axis {axis}: {found}, expected {expected}");
    }
}

#[test]
fn the_gauges_of_every_platform_spec_see_every_direction() {
    let mut seen = 0;
    for path in support::specs::spec_files() {
        let (model, _) = spec::load(&SpecSource::read(&path).expect("readable"));
        let Some((height, space)) = model.and_then(|m| Some((m.geometry.height, m.task_space?))) else {
            continue;
        };
        let mut rows = readings(&space.probes, height);
        for axis in 3..6 {
            rows.column_mut(axis).unscale_mut(0.08);
        }
        let values = rows.singular_values();
        assert!(values.max() / values.min() < 10.0, "{}: {values}", path.display());
        seen += 1;
    }
    assert!(seen >= 9, "{seen} platform specs");
}

#[test]
fn a_waveform_is_named_and_not_read() {
    let folder = folder_with_records();
    let text = fs::read_to_string(repository().join("specs/reference.toml")).expect("readable");
    let waveform =
        "[[trajectory]]\nname = \"w\"\nkind = \"waveform\"\nfile = \"none.csv\"\nperiod = \"2 ms\"\nrepeat = true\n";
    let (model, findings) = spec::load(&source(&format!("{text}\n{waveform}"), "spec.toml", &folder));
    assert!(findings.is_empty(), "{findings:#?}");
    let kind = TrajectoryKind::Waveform { file: "none.csv".to_owned(), period: 2e-3, repeat: true, columns: None };
    let space = model.and_then(|model| model.task_space).expect("a model");
    assert_eq!(space.trajectories[3], Trajectory { name: "w".to_owned(), lead: None, kind });

    let printed = text.replacen("\"case-1\"\nfrequency", "\"case-1\"\nas_printed = true\nfrequency", 1);
    let (model, _) = spec::load(&source(&printed, "spec.toml", &folder));
    let space = model.and_then(|model| model.task_space).expect("a model");
    assert!(matches!(space.trajectories[0].kind, TrajectoryKind::Paper { as_printed: true, .. }));
}

#[test]
fn too_many_of_anything_are_refused() {
    let folder = folder_with_records();
    let text = fs::read_to_string(repository().join("specs/reference.toml")).expect("readable");
    let gauge = "[[gauge]]\npoint = [\"80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]\n";
    let path = |i: usize| format!("[[trajectory]]\nname = \"t{i}\"\nkind = \"case-1\"\nfrequency = \"1 Hz\"\n");
    let many: String = (0..29).map(path).collect();
    let enough: String = (0..200).map(path).collect();
    let mode =
        |i: usize| format!("[[mode]]\nfrequency = \"{} Hz\"\ndamping_ratio = 0.1\nat = \"leg\"\n", 1000 + 90 * i);
    let [modes, many_modes]: [String; 2] = [32, 33].map(|count| (0..count).map(mode).collect());
    for (more, expected) in [
        (gauge.to_owned(), vec![(codes::GAUGE_COUNT.id, "gauge[6]")]),
        (gauge.repeat(100), vec![(codes::GAUGE_COUNT.id, "gauge[6]")]),
        (many, Vec::new()),
        (enough, vec![(codes::TOO_MANY_TRAJECTORIES.id, "trajectory")]),
        (modes, Vec::new()),
        (many_modes, vec![(codes::TOO_MANY_MODES.id, "mode")]),
        (
            "[[trajectory]]\n".to_owned(),
            vec![(codes::MISSING_KEY.id, "trajectory[3].name"), (codes::MISSING_KEY.id, "trajectory[3].kind")],
        ),
    ] {
        let (_, findings) = spec::load(&source(&format!("{text}\n{more}"), "spec.toml", &folder));
        let found: Vec<_> = errors(&findings).iter().map(|d| (d.code, d.key.clone())).collect();
        let found: Vec<_> = found.iter().map(|(code, key)| (*code, key.as_str())).collect();
        assert_eq!(found, expected, "{}", &more[..more.len().min(60)]);
    }
}

/// Later phases point at the spec: the places of gauges, trajectories and gains are known.
#[test]
fn places_of_tables_and_values_are_known() {
    let text = fs::read_to_string(repository().join("specs/features/platform-gains.toml")).expect("readable");
    let model = model("features/platform-gains.toml");
    for (key, written) in [
        ("control", "control"),
        ("gauge[5]", "[[gauge]]"),
        ("gauge[5].direction", "[1, 0, 0]"),
        ("gains.proportional[2]", "\"1.99e6 N/m\""),
        ("adaptation.level_bandwidth", "\"450 rad/s\""),
    ] {
        let span = model.spans.get(key).unwrap_or_else(|| panic!("no place of {key}"));
        assert_eq!(&text[span.clone()], written, "{key}");
    }
}
