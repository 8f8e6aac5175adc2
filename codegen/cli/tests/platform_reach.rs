//! Reach of the reference platform, compared with the study's figures and with leg lengths by Pythagoras.

use std::path::Path;

use host_sim::trajectory::{PaperPath, PaperPose, PoseTrajectory, Reading};
use nalgebra::{Rotation3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::diagnostic::Diagnostic;
use specgen::lower;
use specgen::model::{Model, TaskSpace};
use specgen::reach::{self, Pose, Reach};
use specgen::spec::{self, SpecSource};

fn reference(name: &str) -> (Model, TaskSpace) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().join("specs").join(name);
    let model = spec::load(&SpecSource::read(&path).unwrap()).0.unwrap();
    let task = model.task_space.clone().unwrap();
    (model, task)
}

fn checked(model: &Model, task: &TaskSpace) -> Result<(Reach, Vec<Diagnostic>), Vec<Diagnostic>> {
    reach::check(model, task, &lower::platform(model).unwrap(), model.actuator.stroke)
}

/// Leg displacements by the difference of two lengths: good to some 1e-17 m · 1e1.
fn displacements(model: &Model, pose: &Pose) -> [f64; 6] {
    let geometry = &model.geometry;
    let turn = Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
    let centre = Vector3::new(pose[0], pose[1], geometry.height + pose[2]);
    std::array::from_fn(|leg| {
        let (base, joint) = (Vector3::from(geometry.base_joints[leg]), Vector3::from(geometry.platform_joints[leg]));
        let rest = Vector3::new(0.0, 0.0, geometry.height) + joint - base;
        (centre + turn * joint - base).norm() - rest.norm()
    })
}

fn span(model: &Model, pose: &Pose) -> [f64; 2] {
    let all = displacements(model, pose);
    [all.iter().copied().fold(f64::INFINITY, f64::min), all.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

/// Legs extend by (I + E) l. What rests, the bias and every declared path need is compared with lengths by Pythagoras.
#[test]
fn cross_talk_counts_as_travel() {
    let (mut model, task) = reference("reference.toml");
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let bias = task.setpoint.bias;
    for _ in 0..8 {
        let mut entry = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 0.04 - 0.02;
        let e: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { entry() }));
        model.actuator.cross_talk = Some(e);
        let platform = lower::platform(&model).unwrap();
        let reach = reach::measure(&model, &platform, model.actuator.stroke, &bias);
        let l = displacements(&model, &bias);
        let extended = (0..6).map(|i| l[i] + (0..6).map(|j| e[i][j] * l[j]).sum::<f64>());
        let [low, high] = extended.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        assert!((reach.at_bias[0] - low).abs() < 1e-14 && (reach.at_bias[1] - high).abs() < 1e-14, "{reach:?}");
        assert!(reach.demanded_bound >= reach.demanded[1], "{reach:?}");
        let plain = span(&model, &bias);
        assert!((plain[1] - high).abs() > 1e-9, "E changes nothing here: {plain:?}");
    }
}

fn bounds(model: &Model) -> Pose {
    let ([x, y, z], [a, b, c]) = (model.workspace.translation, model.workspace.rotation);
    [x, y, z, a, b, c]
}

#[test]
fn travel_from_the_middle_of_the_strokes_is_that_of_the_study() {
    let (model, task) = reference("reference.toml");
    let (reach, found) = checked(&model, &task).unwrap();
    assert!(found.is_empty(), "{found:?}");
    for (axis, expected) in [54.9, 52.4, 36.9, 421.0, 369.0, 523.0].into_iter().enumerate() {
        let travel = reach.axes[axis].from_middle.map(|x| x * 1e6);
        let centre = 0.5 * (travel[0] + travel[1]);
        assert!((centre - if axis == 2 { 36.9 } else { 0.0 }).abs() < 0.05, "{axis}: {centre}");
        let [low, high] = travel.map(|x| x - centre);
        let half_digit = if axis < 3 { 0.06 } else { 0.6 };
        assert!((high - expected).abs() < half_digit && (low + expected).abs() < half_digit, "{axis}: {low} {high}");
    }
}

#[test]
fn at_the_end_of_every_travel_one_leg_is_at_an_end_of_its_stroke_and_none_beyond() {
    for name in ["reference.toml", "features/platform-joints.toml"] {
        let (model, task) = reference(name);
        let (reach, _) = checked(&model, &task).unwrap();
        let stroke = model.actuator.stroke;
        for axis in 0..6 {
            for end in reach.axes[axis].from_bias {
                let mut pose = task.setpoint.bias;
                pose[axis] = end;
                let [low, high] = span(&model, &pose);
                let nearest = low.abs().min((stroke - high).abs());
                assert!(nearest < 1e-12, "{name}, axis {axis}: {nearest:e}");
                assert!(low > -1e-12 && high < stroke + 1e-12, "{name}, axis {axis}: {low:e} {high:e}");
            }
        }
        let [low, high] = span(&model, &task.setpoint.bias);
        assert!((reach.at_bias[0] - low).abs() < 1e-15 && (reach.at_bias[1] - high).abs() < 1e-15);
    }
}

#[test]
fn no_pose_of_the_workspace_needs_more_than_the_bound_and_the_shrunk_box_is_reached() {
    for name in ["reference.toml", "features/platform-joints.toml"] {
        let (model, task) = reference(name);
        let (reach, _) = checked(&model, &task).unwrap();
        let (bounds, bias) = (bounds(&model), task.setpoint.bias);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut part = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        assert!(reach.share > 0.0 && reach.share < 1.0);
        for _ in 0..20_000 {
            // Corners as often as interior poses.
            let mut inside: Pose = std::array::from_fn(|_| part());
            if part() > 0.0 {
                inside = inside.map(f64::signum);
            }
            let pose: Pose = std::array::from_fn(|axis| inside[axis] * bounds[axis]);
            let [low, high] = span(&model, &pose);
            assert!(-low <= reach.demanded_bound && high <= reach.demanded_bound, "{pose:?}");
            assert!(low >= reach.demanded[0] - 1e-9 && high <= reach.demanded[1] + 1e-9, "corners are the extremes");
            let shrunk: Pose = std::array::from_fn(|axis| bias[axis] + reach.share * (pose[axis] - bias[axis]));
            let [low, high] = span(&model, &shrunk);
            // A tenth of a nanometre for the curvature inside the box.
            assert!(low > -1e-10 && high < reach.stroke + 1e-10, "{shrunk:?}: {low:e} {high:e}");
        }
        // The bound is tight: it exceeds the required travel by less than a hundredth.
        let needed = reach.demanded[1].max(-reach.demanded[0]);
        assert!(reach.demanded_bound < 1.01 * needed, "{} {needed}", reach.demanded_bound);
        // The share is the largest possible: with a little more, some corner is out of reach.
        let beyond = (0..64).any(|corner| {
            let pose: Pose = std::array::from_fn(|axis| {
                let at = if corner >> axis & 1 == 0 { -bounds[axis] } else { bounds[axis] };
                bias[axis] + 1.001 * reach.share * (at - bias[axis])
            });
            let [low, high] = span(&model, &pose);
            low < 0.0 || high > reach.stroke
        });
        assert!(beyond, "{name}: {}", reach.share);
    }
}

/// Poses of a path of the paper at 1 kHz, `lift` added to z.
fn path(path: PaperPath, lift: f64) -> Vec<Pose> {
    let path = PaperPose { path, reading: Reading::Corrected, frequency: 1.0 };
    let ticks = (path.duration() * 1e3) as u32;
    (0..=ticks)
        .map(|tick| {
            let mut pose = path.target(f64::from(tick) * 1e-3).pose;
            pose[2] += lift;
            pose
        })
        .collect()
}

#[test]
fn leg_spans_of_the_paper_s_paths_are_those_of_the_study() {
    let (model, _) = reference("reference.toml");
    let platform = lower::platform(&model).unwrap();
    let key = ["trajectory[0].kind", "case-1"];
    for (which, expected) in [(PaperPath::Case1, 39.2), (PaperPath::Case2, 27.7), (PaperPath::Machining, 33.2)] {
        let found = reach::check_poses(&model, &platform, 60e-6, key, path(which, 0.0).into_iter()).unwrap();
        let span = (found.displacement[1] - found.displacement[0]) * 1e6;
        assert!((span - expected).abs() < 0.06, "{which:?}: {span}");
        assert!(found.displacement[0].abs() < 1e-12, "from the rest pose: {found:?}");
    }
    // Allowed bias of case 1: 0 to 25.5 um.
    let found = reach::check_poses(&model, &platform, 60e-6, key, path(PaperPath::Case1, 0.0).into_iter()).unwrap();
    let [low, high] = found.shift.unwrap();
    assert!(low.abs() < 1e-9 && (high * 1e6 - 25.5).abs() < 0.06, "{low:e} {high:e}");
}

#[test]
fn a_path_beyond_the_strokes_is_refused_and_the_shift_offered_makes_it_fit() {
    let (model, _) = reference("reference.toml");
    let platform = lower::platform(&model).unwrap();
    let check = |lift: f64| {
        reach::check_poses(
            &model,
            &platform,
            60e-6,
            ["trajectory[0].kind", "case-1"],
            path(PaperPath::Case1, lift).into_iter(),
        )
    };
    for lift in [36.9e-6, -5e-6] {
        let found = &check(lift).unwrap_err()[0];
        assert_eq!((found.code, found.key.as_str()), ("E0442", "trajectory[0].kind"), "{found:?}");
        let numbers: Vec<f64> = found.help.split(' ').filter_map(|word| word.parse().ok()).collect();
        assert_eq!(numbers.len(), 2, "{}", found.help);
        for shift in numbers {
            check(lift + shift * 1e-6).unwrap();
        }
    }
    // The printed pi/72 rad: nothing makes it fit.
    let turned = path(PaperPath::Case2, 0.0).into_iter().map(|[x, y, z, a, b, c]| [x, y, z, 1e3 * a, 1e3 * b, 1e3 * c]);
    let found = reach::check_poses(&model, &platform, 60e-6, ["trajectory[1].kind", "case-2"], turned).unwrap_err();
    assert!(found[0].help.starts_with("no z of"), "{found:?}");
    // A pose that is not a number is out of reach.
    let none = reach::check_poses(&model, &platform, 60e-6, ["trajectory", "x"], [[f64::NAN; 6]].into_iter());
    assert!(none.is_err());
}

#[test]
fn bounds_and_bias_out_of_reach_are_refused_with_a_number_that_is_accepted() {
    let (mut model, task) = reference("reference.toml");
    model.workspace.translation[0] = 60e-6;
    model.workspace.rotation[2] = 1e-3;
    let found = checked(&model, &task).unwrap_err();
    let keys: Vec<(&str, &str)> = found.iter().map(|one| (one.code, one.key.as_str())).collect();
    assert_eq!(keys, [("E0313", "workspace.translation[0]"), ("E0313", "workspace.rotation[2]")]);
    let offered: Vec<f64> =
        found.iter().map(|one| one.help.split(' ').nth(2).unwrap().parse::<f64>().unwrap() * 1e-6).collect();
    model.workspace.translation[0] = offered[0];
    model.workspace.rotation[2] = offered[1];
    checked(&model, &task).unwrap();

    let (model, mut task) = reference("reference.toml");
    task.setpoint.bias = [0.0, 20e-6, 0.0, 0.0, 0.0, 0.0];
    let found = checked(&model, &task).unwrap_err();
    assert_eq!((found[0].code, found[0].key.as_str()), ("E0440", "control.setpoint.bias[2]"), "{found:?}");
    let lift: f64 = found[0].help.split(' ').find_map(|word| word.parse().ok()).unwrap();
    task.setpoint.bias[2] += lift * 1e-6;
    let (_, found) = checked(&model, &task).unwrap();
    assert_eq!(found[0].code, "W0444", "there is no room at the end of a stroke: {found:?}");
    task.setpoint.bias[2] = 36.9e-6;
    assert!(checked(&model, &task).unwrap().1.is_empty());
}

#[test]
fn conditioning_is_that_of_the_jacobian_by_differences() {
    let (model, task) = reference("reference.toml");
    let (reach, _) = checked(&model, &task).unwrap();
    assert!(reach.conditioning.at_rest > 1.0 && reach.conditioning.at_rest < 5.0, "{:?}", reach.conditioning);
    let platform = lower::platform(&model).unwrap();
    let scale = model.geometry.joint_radius();
    let jacobian = nalgebra::Matrix6::from_fn(|leg, axis| {
        let step = 1e-6;
        let mut pose = [0.0; 6];
        pose[axis] = step;
        let ahead = displacements(&model, &pose)[leg];
        pose[axis] = -step;
        let slope = (ahead - displacements(&model, &pose)[leg]) / (2.0 * step);
        if axis < 3 { slope } else { slope / scale }
    });
    let values = jacobian.singular_values();
    assert!((values.max() / values.min() - reach.conditioning.at_rest).abs() < 1e-6);
    assert!((values.min() - reach.conditioning.smallest_singular_value).abs() < 1e-3);
    // J is nowhere near singular within the declared motion.
    let free = reach.conditioning.free_of_singularities;
    assert!(free > 1e-3);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..2000 {
        let mut pose: Pose = std::array::from_fn(|_| f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5);
        for angle in &mut pose[3..] {
            *angle /= scale;
        }
        let length = pose[..3].iter().map(|x| x * x).sum::<f64>().sqrt()
            + scale * pose[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        let pose = pose.map(|x| x * free / length);
        let jacobian = platform.jacobian(&pose);
        let scaled = nalgebra::Matrix6::from_fn(|i, j| jacobian[i][j] / if j < 3 { 1.0 } else { scale });
        assert!(scaled.singular_values().min() > 0.1 * values.min(), "{pose:?}");
    }
}
