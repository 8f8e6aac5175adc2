//! Leg displacements of the emitted controllers against the textbook formula |P + R P_i − B_i| − l₀, computed apart.

use crate::support::exact;
use host_sim::controller::TickController;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::lower::joint_positions;
use specgen_tests::{Emitted, worse};

fn count() -> usize {
    specgen_tests::length(2_000, 20_000)
}
const F32: (&str, &str) = ("scalar   = \"f64\"", "scalar   = \"f32\"");
/// ±55 µm, nearly as far as the identified hysteresis lets each axis go.
const WIDE: (&str, &str) = ("[\"40 um\", \"40 um\", \"40 um\"]", "[\"55 um\", \"55 um\", \"55 um\"]");
/// A travel that piezo legs of that stroke reach in every axis.
const STROKE: (&str, &str) = ("stroke          = \"60 um\"", "stroke          = \"200 um\"");

fn poses() -> Vec<[f64; 6]> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut unit = || rng.next_u64() as f64 / 2f64.powi(63) - 1.0;
    (0..count()).map(|_| [55e-6, 55e-6, 55e-6, 0.4e-3, 0.35e-3, 0.5e-3].map(|bound| bound * unit())).collect()
}

/// Leg displacements that the controller derives from poses; its arithmetic rounds the pose first.
fn emitted(name: &str, edits: &[(&str, &str)], poses: &[[f64; 6]]) -> (Vec<[f64; 6]>, Vec<[f64; 6]>) {
    let mut controller = Emitted::new(name, "legs.toml", edits).at_run_time();
    let description = controller.description().clone();
    let demand = description.output("demand[0]").expect("an output word");
    let mut output = vec![0; description.output_names.len()];
    let mut rounded = Vec::new();
    let mut displacements = Vec::new();
    for pose in poses {
        let words = pose.map(|value| description.scalar.encode(value));
        let mut input = words.to_vec();
        input.extend([description.scalar.encode(0.0); 6]);
        controller.step(&input, &mut output);
        rounded.push(words.map(|word| description.scalar.decode(word)));
        displacements.push(std::array::from_fn(|leg| description.scalar.decode(output[demand + leg])));
    }
    (rounded, displacements)
}

fn worst(a: &[[f64; 6]], b: &[[f64; 6]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |worst, (a, b)| worse(worst, (a - b).abs()))
}

/// (AI.1), (AI.2) in difference form.
#[test]
fn f64_is_exact_to_a_femtometre_and_f32_to_50_picometres() {
    let poses = poses();
    let reference = Emitted::new("kinematics-geometry", "legs.toml", &[WIDE, STROKE]);
    let geometry = &reference.compiled.model.geometry;
    let exact = |poses: &[[f64; 6]]| -> Vec<[f64; 6]> {
        poses.iter().map(|pose| exact::displacements(geometry, pose)).collect()
    };

    let (same, double) = emitted("kinematics-f64", &[WIDE, STROKE], &poses);
    assert_eq!(same, poses);
    let error = worst(&double, &exact(&poses));
    println!("f64 against the textbook formula in 32 digits: {:.2e} nm", error * 1e9);
    assert!(error <= 1e-18, "{error:e} m");
    // The comparison sees one displacement that is a little more off, or no number.
    for off in [2e-18, f64::NAN] {
        let mut spoilt = double.clone();
        spoilt[count() - 1][4] += off;
        let found = worst(&spoilt, &exact(&poses));
        assert!(found > 1e-18 || found.is_nan(), "{off:e}");
    }

    let (rounded, single) = emitted("kinematics-f32", &[WIDE, STROKE, F32], &poses);
    let error = worst(&single, &exact(&rounded));
    let with_rounding = worst(&single, &double);
    let (same, rounded_nm) = (error * 1e9, with_rounding * 1e9);
    println!("f32 against f64: {same:.4} nm on the same pose, {rounded_nm:.4} nm with the pose rounded");
    assert!(error <= 0.05e-9 && with_rounding <= 0.05e-9, "{error:e} m, {with_rounding:e} m");

    // What the difference form is for: the plain formula in f32.
    let (base, platform) = joint_positions(geometry);
    let plain = plain_f32(&rounded, &base, &platform, geometry.height);
    let error = worst(&plain, &exact(&rounded));
    println!("the plain formula in f32: {:.1} nm", error * 1e9);
    assert!(error > 10e-9);
}

/// |P + R P_i − B_i| − l₀ in f32 as one writes it first.
fn plain_f32(poses: &[[f64; 6]], base: &[[f64; 3]; 6], platform: &[[f64; 3]; 6], height: f64) -> Vec<[f64; 6]> {
    let length = |pose: [f32; 6], leg: usize| {
        let [x, y, z, a, b, c] = pose;
        let ((sx, cx), (sy, cy), (sz, cz)) = (a.sin_cos(), b.sin_cos(), c.sin_cos());
        let p = platform[leg].map(|v| v as f32);
        let r = [
            x + cy * cz * p[0] + (sx * sy * cz - cx * sz) * p[1] - base[leg][0] as f32,
            y + cy * sz * p[0] + (sx * sy * sz + cx * cz) * p[1] - base[leg][1] as f32,
            z + height as f32 - sy * p[0] + sx * cy * p[1] - base[leg][2] as f32,
        ];
        (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt()
    };
    let displacements = |pose: &[f64; 6]| {
        std::array::from_fn(|leg| f64::from(length(pose.map(|v| v as f32), leg) - length([0.0; 6], leg)))
    };
    poses.iter().map(displacements).collect()
}

#[test]
fn an_upward_move_lengthens_every_leg_and_a_turn_about_x_lifts_the_side_with_positive_y() {
    let poses = [[0.0, 0.0, 10e-6, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.1e-3, 0.0, 0.0]];
    let emitted_crate = Emitted::new("kinematics-signs", "legs.toml", &[]);
    let (_, platform) = joint_positions(&emitted_crate.compiled.model.geometry);
    let (_, displacements) = emitted("kinematics-signs", &[], &poses);
    assert!(displacements[0].iter().all(|d| (8e-6..8.3e-6).contains(d)), "{:?}", displacements[0]);
    for (displacement, p) in displacements[1].iter().zip(&platform) {
        if p[1].abs() > 0.05 {
            assert_eq!(displacement.signum(), p[1].signum(), "{displacement:e} at y = {}", p[1]);
        }
    }
}
