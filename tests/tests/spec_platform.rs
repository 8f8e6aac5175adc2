//! The specs of the task-space controller as models: every value of the reference in SI, and what each feature changes.

// Clippy sees the helpers of an integration test as production code.
use crate::support;
use std::f64::consts::{FRAC_PI_6, PI};
use std::fs;

use crate::support::specs::{errors, folder_with_records, source};
use specgen::diagnostic::{codes, render};
use specgen::model::{
    AdaptationMode, ControlMode, DynamicsChoice, Environment, Frames, Gains, Interaction, Mcu, Model, PaperPath, Probe,
    Scalar, SetpointKind, SetpointRules, TaskSpace, Trajectory, TrajectoryKind,
};
use specgen::spec::{self, SpecSource};
use specgen_tests::repository;

fn model(name: &str) -> Model {
    let source = SpecSource::read(&repository().join("specs").join(name)).expect("readable");
    let (model, findings) = spec::load(&source);
    assert!(findings.is_empty(), "{}", render(&findings, &source, false));
    model.expect("no findings")
}

fn task_space(name: &str) -> TaskSpace {
    model(name).task_space.expect("a spec with [control]")
}

/// A gauge in the plane of P_C that faces its target square.
fn square(x: f64, y: f64, direction: [f64; 3]) -> Probe {
    Probe { point: [x, y, 0.18], direction, plane_point: [x, y, 0.0], plane_normal: direction }
}

const NO_POSE: [f64; 6] = [0.0; 6];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

#[test]
fn every_value_of_the_reference_is_in_si() {
    let model = model("reference.toml");
    assert_eq!((model.name.as_str(), model.timing.period), ("reference", 1e-4));
    assert_eq!((model.platform.mass, model.platform.inertia), (1.195, [0.0326, 0.0326, 0.0097]));
    assert_eq!((model.platform.products, model.platform.center_of_mass), ([0.0; 3], [0.0; 3]));
    let leg = &model.leg;
    assert_eq!((leg.fixed_mass, leg.extensible_mass), (0.090_26, 0.073_62));
    assert_eq!((leg.fixed_inertia, leg.extensible_inertia), (1.07e-4, 5.27e-5));
    assert_eq!((leg.fixed_center, leg.extensible_center), (0.05, 0.05));
    let actuator = &model.actuator;
    assert_eq!((actuator.stacks, actuator.stack_gain, actuator.stroke), (5, 0.1262e-6, 60e-6));
    assert_eq!((actuator.voltage, actuator.slew_rate), ([0.0, 100.0], 40e3));
    assert_eq!((actuator.axial_stiffness, actuator.resonance, actuator.damping_ratio), (1e7, 870.0, 0.1));
    assert_eq!((model.amplifier.lag, model.amplifier.noise), (0.35e-3, 2e-3));
    assert_eq!((model.dac.bits, model.dac.range), (16, [0.0, 150.0]));
    assert_eq!((model.sensor.range, model.sensor.noise, model.sensor.bits), ([-55e-6, 55e-6], 2.2e-9, 17));
    assert_eq!((model.hysteresis.grid, model.hysteresis.memory), (32, 64));
    assert_eq!(model.hysteresis.records, ["records/reference-forc.csv"]);
    assert_eq!((model.adaptation.mode, model.adaptation.run_interval), (AdaptationMode::Pcc, 1));
    assert_eq!((model.adaptation.level_weight, model.adaptation.drift_weight), (0.0, 0.0));
    assert_eq!(model.adaptation.gain_ratio, [0.9, 1.1]);
    assert_eq!(model.workspace.translation, [50e-6, 50e-6, 52e-6]);
    assert_eq!(model.workspace.rotation, [0.4e-3, 0.35e-3, 0.5e-3]);
    assert_eq!((model.controller.scalar, model.controller.setpoint), (Scalar::F64, SetpointKind::Pose));
    assert_eq!((model.target.mcu, model.target.budget.instructions), (Mcu::Mps2An500, Some(4500)));
    assert_eq!(
        (model.target.budget.flash, model.target.budget.ram, model.target.budget.stack),
        (Some(131_072), Some(32_768), Some(3072))
    );

    let paper = |name: &str, path| Trajectory {
        name: name.to_owned(),
        lead: None,
        kind: TrajectoryKind::Paper { path, as_printed: false, frequency: 1.0 },
    };
    let expected = TaskSpace {
        mode: ControlMode::PF,
        probes: [
            square(0.08, 0.0, UP),
            square(-0.04, 0.069_282, UP),
            square(-0.04, -0.069_282, UP),
            square(0.08, 0.0, [0.0, 1.0, 0.0]),
            square(-0.08, 0.0, [0.0, 1.0, 0.0]),
            square(0.0, 0.08, [1.0, 0.0, 0.0]),
        ],
        calibration: None,
        modal_damping: 0.02,
        notch_damping: Some(1.0),
        active_damping: false,
        hand_over: false,
        correction: None,
        gains: None,
        position_gains: None,
        adaptation: None,
        velocity_cutoff: 1.9e4,
        interaction: Interaction::None,
        environment: Environment { stiffness: [0.0; 6], rest: NO_POSE },
        dynamics: DynamicsChoice::Cheapest,
        dynamics_tolerance: None,
        lead: None,
        transfer_time: 0.05,
        setpoint: SetpointRules {
            bias: [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0],
            speed: [1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3],
            acceleration: [0.01, 0.01, 0.01, 0.1, 0.1, 0.1],
            jerk: [1.0, 1.0, 1.0, 10.0, 10.0, 10.0],
            stop_acceleration: None,
            stop_jerk: None,
            stream_speed: [5e-3, 5e-3, 5e-3, 0.05, 0.05, 0.05],
            stale_ticks: 10,
        },
        frames: Frames { work: NO_POSE, tool: [0.0; 3] },
        trajectories: vec![
            paper("case-1", PaperPath::Case1),
            paper("case-2", PaperPath::Case2),
            paper("machining", PaperPath::Machining),
        ],
        triggers: Vec::new(),
    };
    assert_eq!(model.task_space, Some(expected));
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
fn each_feature_changes_what_it_says() {
    let single = model("features/platform-f32.toml");
    assert_eq!((single.controller.scalar, single.target.mcu), (Scalar::F32, Mcu::Mps2An386));

    let calibrated = task_space("features/platform-calibration.toml").calibration.expect("a calibration");
    let of_all = vec![-45e-6, 10e-6];
    for (gauge, polynomial) in calibrated.iter().enumerate() {
        let own = vec![-44.8e-6, 9.97e-6, 12e-9, -0.4e-9];
        assert_eq!(*polynomial, if gauge == 2 { own } else { of_all.clone() }, "gauge {gauge}");
    }

    assert_eq!(task_space("features/platform-force-sensor.toml").interaction, Interaction::Measured);

    let modelled = task_space("features/platform-environment.toml");
    assert_eq!((modelled.mode, modelled.interaction), (ControlMode::P, Interaction::Modelled));
    assert_eq!(modelled.environment.stiffness, [2.4e6, 2.4e6, 3e6, 3.8e3, 3.8e3, 0.0]);
    assert_eq!(modelled.environment.rest, [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0]);

    let frames = task_space("features/platform-frames.toml").frames;
    // 2° to 16 digits, from a calculation with 50.
    assert_eq!(frames.work, [4e-6, -5e-6, 0.0, 0.034_906_585_039_886_59, 0.0, FRAC_PI_6]);
    assert_eq!(frames.tool, [0.0, 0.0, 0.04]);

    let plain = task_space("features/platform-no-notch.toml");
    assert_eq!((plain.mode, plain.notch_damping), (ControlMode::F, None));
    // The default follows the period: 0.6 of half the tick rate.
    assert_eq!(plain.velocity_cutoff, 0.6 * PI / 500e-6);

    let fixed = model("features/platform-gains.toml");
    assert_eq!(fixed.adaptation.level_weight, 450.0 * 1e-4);
    let fixed = fixed.task_space.expect("[control]");
    assert_eq!((fixed.adaptation, fixed.velocity_cutoff), (Some([450.0, 19.6]), 1.9e4));
    let gains = Gains {
        proportional: [5.07e5, 5.07e5, 1.99e6, 9.9e3, 9.9e3, 9.9e3],
        integral: [1.52e9, 1.52e9, 5.96e9, 2.98e7, 2.98e7, 2.97e7],
        derivative: [0.0; 6],
    };
    assert_eq!(fixed.gains, Some(gains));
    assert_eq!(fixed.position_gains.map(|gains| gains.integral[2]), Some(2.4e10));

    let bare = model("features/platform-joints.toml");
    assert_eq!(bare.geometry.base_joints[3], [-0.152, -0.004, 0.003]);
    assert_eq!(bare.geometry.platform_joints[5], [0.098, -0.003, -0.01]);
    assert_eq!((bare.geometry.height, bare.platform.products), (0.19, [0.4e-3, -1.2e-3, 0.7e-3]));
    let probes = bare.task_space.expect("[control]").probes;
    let length = 1.0025_f64.sqrt();
    assert_eq!(probes[0].direction, [0.0, 0.05 / length, 1.0 / length]);
    assert_eq!(probes[0].plane_point, [0.082, 0.005, -0.008]);
    let length = 1.0004_f64.sqrt();
    for (found, expected) in probes[0].plane_normal.into_iter().zip([0.02 / length, 0.0, -1.0 / length]) {
        assert!((found - expected).abs() < 1e-16, "{found} and {expected}");
    }
    // Without target_point the target is where the gauge is, at rest.
    assert_eq!(probes[1].plane_point, [-0.04, 0.069, 0.182 - 0.19]);
}

#[test]
fn a_waveform_is_named_and_not_read() {
    let folder = folder_with_records();
    let text = fs::read_to_string(repository().join("specs/reference.toml")).expect("readable");
    let waveform =
        "[[trajectory]]\nname = \"w\"\nkind = \"waveform\"\nfile = \"none.csv\"\nperiod = \"2 ms\"\nrepeat = true\n";
    let (model, findings) = spec::load(&source(&format!("{text}\n{waveform}"), "spec.toml", &folder));
    assert!(findings.is_empty(), "{findings:#?}");
    let kind = TrajectoryKind::Waveform { file: "none.csv".to_owned(), period: 2e-3, repeat: true };
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
    for (more, expected) in [
        (gauge.to_owned(), vec![(codes::GAUGE_COUNT.id, "gauge[6]")]),
        (gauge.repeat(100), vec![(codes::GAUGE_COUNT.id, "gauge[6]")]),
        (many, Vec::new()),
        (enough, vec![(codes::TOO_MANY_TRAJECTORIES.id, "trajectory")]),
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
