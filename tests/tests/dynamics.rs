//! The dynamics of the platform against the reference vectors, against an independent Lagrangian on another geometry
//! (`tests/oracle/lagrangian.py`), and by its theorems.

use std::fs;

use nalgebra::{Matrix6, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::Value;
use specgen::compile::compile;
use specgen::diagnostic::codes;
use specgen::lower::{self, GRAVITY};
use specgen::model::Model;
use specgen::run_time::dynamics;
use specgen_runtime::dynamics::Leg;
use specgen_runtime::{Motion, Platform};
use specgen_tests::{Emitted, length, repository, worse};

const FIELDS: [&str; 6] = ["J", "M", "Cv", "G", "F", "leg_forces"];

fn reference_model() -> Model {
    compile(&repository().join("specs/reference.toml")).unwrap_or_else(|r| panic!("{:?}", r.findings)).model
}

/// States with what is due there; poses from rest.
struct Vector {
    id: String,
    motion: Motion<f64>,
    fields: Vec<Vec<f64>>,
}

fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn array<const N: usize>(value: &Value) -> [f64; N] {
    flat(value).try_into().unwrap()
}

fn read(path: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(repository().join(path)).unwrap()).unwrap()
}

fn vectors(document: &Value, height: &str) -> Vec<Vector> {
    let height = document["parameters"][height].as_f64().unwrap();
    let list = document["vectors"].as_array().unwrap();
    list.iter()
        .map(|vector| {
            let mut pose: [f64; 6] = array(&vector["h"]);
            pose[2] -= height;
            Vector {
                id: vector["id"].as_str().unwrap().to_owned(),
                motion: Motion { pose, rate: array(&vector["hd"]), acceleration: array(&vector["hdd"]) },
                fields: FIELDS.map(|key| flat(&vector[key])).to_vec(),
            }
        })
        .collect()
}

fn reference_vectors() -> Vec<Vector> {
    vectors(&read("tests/oracle/dynamics-reference.json"), "z_nominal")
}

/// Joints in three dimensions and in no order, mass centre off the joints, products of inertia.
fn asymmetric() -> (Model, Vec<Vector>) {
    let document = read("tests/oracle/dynamics-asymmetric.json");
    let p = &document["parameters"];
    let joints = |key: &str| -> [[f64; 3]; 6] { std::array::from_fn(|leg| array(&p[key][leg])) };
    let mut model = reference_model();
    model.geometry.base_joints = joints("base_joints");
    model.geometry.platform_joints = joints("platform_joints");
    model.geometry.height = p["height"].as_f64().unwrap();
    let inertia: [f64; 9] = array(&p["inertia"]);
    model.platform.mass = p["mass"].as_f64().unwrap();
    model.platform.inertia = [inertia[0], inertia[4], inertia[8]];
    model.platform.products = [inertia[1], inertia[2], inertia[5]];
    model.platform.center_of_mass = array(&p["center_of_mass"]);
    let leg = &mut model.leg;
    let parameters = [
        (&mut leg.fixed_mass, "m_s"),
        (&mut leg.extensible_mass, "m_e"),
        (&mut leg.fixed_inertia, "I_s"),
        (&mut leg.extensible_inertia, "I_e"),
        (&mut leg.fixed_center, "l_s"),
        (&mut leg.extensible_center, "l_e"),
    ];
    for (place, key) in parameters {
        *place = p[key].as_f64().unwrap();
    }
    let vectors = vectors(&document, "height");
    (model, vectors)
}

fn fields(platform: &Platform<f64>, motion: &Motion<f64>) -> [Vec<f64>; 6] {
    [
        platform.jacobian(&motion.pose).concat(),
        platform.mass_matrix(&motion.pose).concat(),
        platform.coriolis(&motion.pose, &motion.rate).to_vec(),
        platform.gravity(&motion.pose).to_vec(),
        platform.generalised_force(motion, 1.0).to_vec(),
        platform.leg_forces(motion).to_vec(),
    ]
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, x| sum + x * x).sqrt()
}

/// |a − b| over |b|, Euclidean over the whole field; absolute where b is zero.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let size = norm(b.iter().copied());
    let error = norm(a.iter().zip(b).map(|(a, b)| a - b));
    if size == 0.0 { error } else { error / size }
}

fn single(platform: &Platform<f64>) -> Platform<f32> {
    let n = |x: f64| x as f32;
    let v = |x: [f64; 3]| x.map(n);
    Platform {
        legs: platform.legs.map(|leg| Leg {
            base: v(leg.base),
            joint: v(leg.joint),
            arm: v(leg.arm),
            rest: v(leg.rest),
            length: n(leg.length),
            inverse_length: n(leg.inverse_length),
            half_inverse_square: n(leg.half_inverse_square),
        }),
        places: platform.places,
        rows: platform.rows,
        flat_base: platform.flat_base,
        flat_platform: platform.flat_platform,
        base_depth: n(platform.base_depth),
        pole: v(platform.pole),
        mass: n(platform.mass),
        first_moment: v(platform.first_moment),
        pole_moment: v(platform.pole_moment),
        second_moment: platform.second_moment.map(v),
        extensible_moment: n(platform.extensible_moment),
        leg_inertia: n(platform.leg_inertia),
        leg_weight_moment: n(platform.leg_weight_moment),
        gravity: n(platform.gravity),
    }
}

fn to_single(motion: &Motion<f64>) -> Motion<f32> {
    let six = |values: [f64; 6]| values.map(|x| x as f32);
    Motion { pose: six(motion.pose), rate: six(motion.rate), acceleration: six(motion.acceleration) }
}

/// M, C, G and J, and with them every step from joint motions to leg forces: (3), (4), (AI.5)–(AI.17).
#[test]
fn every_field_agrees_with_the_reference_vectors_and_with_the_lagrangian_of_another_geometry() {
    let (other, states) = asymmetric();
    for (what, model, vectors) in [("reference", reference_model(), reference_vectors()), ("asymmetric", other, states)]
    {
        let platform = lower::platform(&model).unwrap();
        let single = single(&platform);
        let (mut worst, mut worst_single) = ([0.0_f64; 6], 0.0_f64);
        for vector in &vectors {
            let found = fields(&platform, &vector.motion);
            for ((worst, (key, found)), expected) in worst.iter_mut().zip(FIELDS.iter().zip(&found)).zip(&vector.fields)
            {
                let error = relative(found, expected);
                assert!(error <= 1e-12, "{} {key}: {error:e}", vector.id);
                *worst = worse(*worst, error);
            }
            let forces = single.leg_forces(&to_single(&vector.motion)).map(f64::from);
            let error = relative(&forces, &vector.fields[5]);
            assert!(error <= 5e-6, "{} f32: {error:e}", vector.id);
            worst_single = worse(worst_single, error);
        }
        println!("{what}: worst relative errors of {FIELDS:?}: {worst:?}; f32 leg forces {worst_single:e}");
    }
}

#[test]
fn the_controller_agrees_with_the_reference_vectors() {
    let double = Emitted::new("dynamics-f64", "reference.toml", &[]).compiled;
    let single = Emitted::new("dynamics-f32", "reference.toml", &[("scalar = \"f64\"", "scalar = \"f32\"")]).compiled;
    let platform = lower::platform(&reference_model()).unwrap();
    let (mut worst, mut worst_single) = (0.0_f64, 0.0_f64);
    for vector in reference_vectors() {
        let found = dynamics(&double.ir, &vector.motion);
        let of = |key: &str| &vector.fields[FIELDS.iter().position(|field| *field == key).unwrap()];
        for (values, key) in [
            (found.jacobian.concat(), "J"),
            (found.mass.concat(), "M"),
            (found.coriolis.to_vec(), "Cv"),
            (found.gravity.to_vec(), "G"),
            (found.leg_forces.to_vec(), "leg_forces"),
        ] {
            let error = relative(&values, of(key));
            assert!(error <= 1e-12, "{} {key}: {error:e}", vector.id);
            worst = worse(worst, error);
        }
        // The model that analysis uses is the model that runs: not one bit apart.
        assert_eq!(found.leg_forces.map(f64::to_bits), platform.leg_forces(&vector.motion).map(f64::to_bits));
        assert_eq!(
            found.displacements.map(f64::to_bits),
            platform.displacements(&vector.motion.pose).map(f64::to_bits)
        );
        let error = relative(&dynamics(&single.ir, &vector.motion).leg_forces, of("leg_forces"));
        assert!(error <= 5e-6, "{} f32: {error:e}", vector.id);
        worst_single = worse(worst_single, error);
    }
    println!("controller: f64 {worst:e}, f32 leg forces {worst_single:e}");
}

#[test]
fn the_comparison_sees_what_it_must_not_pass() {
    let vector = &reference_vectors()[20];
    for expected in &vector.fields {
        let mut spoilt = expected.clone();
        let largest = (0..spoilt.len()).max_by(|a, b| spoilt[*a].abs().total_cmp(&spoilt[*b].abs())).unwrap();
        spoilt[largest] *= 1.0 + 1e-11;
        assert!(relative(&spoilt, expected) > 1e-12);
        assert_eq!(relative(expected, expected), 0.0);
    }
}

/// Poses to ±reach and ±tilt with rates and accelerations, uniform.
fn states(seed: u64, count: usize, reach: f64, tilt: f64) -> Vec<Motion<f64>> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut six = |a: f64, b: f64| -> [f64; 6] {
        std::array::from_fn(|k| {
            let unit = generator.next_u64() as f64 / 2f64.powi(63) - 1.0;
            unit * if k < 3 { a } else { b }
        })
    };
    (0..count).map(|_| Motion { pose: six(reach, tilt), rate: six(0.3, 2.0), acceleration: six(5.0, 30.0) }).collect()
}

fn matrix(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

fn along(pose: &[f64; 6], direction: &[f64; 6], step: f64) -> [f64; 6] {
    std::array::from_fn(|k| pose[k] + step * direction[k])
}

/// ∂M/∂h along a direction, by central differences.
fn mass_slope(platform: &Platform<f64>, pose: &[f64; 6], direction: &[f64; 6]) -> Matrix6<f64> {
    let step = 1e-5;
    let at = |step| matrix(&platform.mass_matrix(&along(pose, direction, step)));
    (at(step) - at(-step)) / (2.0 * step)
}

fn unit(k: usize) -> [f64; 6] {
    std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 })
}

/// (AI.16): C by Christoffel's symbols of M, so that Ṁ − 2 C is skew; and C ḣ is what the recursion gives.
#[test]
fn the_mass_matrix_less_twice_coriolis_is_skew_and_coriolis_is_that_of_christoffel() {
    for (model, seed) in [(reference_model(), 1), (asymmetric().0, 2)] {
        let platform = lower::platform(&model).unwrap();
        for motion in states(seed, length(3, 12), 0.008, 0.09) {
            let slopes: [Matrix6<f64>; 6] = std::array::from_fn(|k| mass_slope(&platform, &motion.pose, &unit(k)));
            let rate = Vector6::from(motion.rate);
            let coriolis = Matrix6::from_fn(|i, j| {
                (0..6).map(|k| 0.5 * (slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)]) * rate[k]).sum()
            });
            let found = Vector6::from(platform.coriolis(&motion.pose, &motion.rate));
            let expected = coriolis * rate;
            assert!((found - expected).norm() <= 1e-7 * found.norm(), "{found} {expected}");
            // The force of the recursion does the work that changes M: ḣᵀ (Ṁ ḣ − 2 C ḣ) = 0, with Ṁ along the motion itself.
            let drift = mass_slope(&platform, &motion.pose, &motion.rate);
            let work = rate.dot(&(drift * rate)) - 2.0 * rate.dot(&found);
            assert!(work.abs() <= 1e-7 * (rate.norm() * found.norm()), "{work:e}");
            let skew = drift - coriolis * 2.0;
            assert!((skew + skew.transpose()).norm() <= 1e-6 * drift.norm());
        }
    }
}

/// (4): M is the sum of platform and legs.
#[test]
fn the_mass_matrix_is_the_inverse_dynamics_of_unit_accelerations_symmetric_and_positive_definite() {
    for (model, seed) in [(reference_model(), 3), (asymmetric().0, 4)] {
        let platform = lower::platform(&model).unwrap();
        for motion in states(seed, length(6, 20), 0.01, 0.3) {
            let m = matrix(&platform.mass_matrix(&motion.pose));
            assert!((m - m.transpose()).norm() <= 1e-14 * m.norm());
            assert!(m.cholesky().is_some());
            let j = matrix(&platform.jacobian(&motion.pose));
            let force = |acceleration: [f64; 6]| {
                Vector6::from(platform.leg_forces(&Motion { pose: motion.pose, rate: [0.0; 6], acceleration }))
            };
            for k in 0..6 {
                let column = j.transpose() * (force(unit(k)) - force([0.0; 6]));
                assert!((column - m.column(k)).norm() <= 1e-12 * m.norm(), "column {k}");
            }
        }
    }
}

/// The derivative of (AI.2), and with it the joint velocities (AI.5) along the legs.
#[test]
fn the_jacobian_is_the_derivative_of_the_leg_displacements() {
    for (model, seed) in [(reference_model(), 5), (asymmetric().0, 6)] {
        let platform = lower::platform(&model).unwrap();
        for motion in states(seed, length(6, 20), 0.01, 0.3) {
            let jacobian = platform.jacobian(&motion.pose);
            #[allow(clippy::needless_range_loop)] // Two arrays by one index.
            for k in 0..6 {
                let step = 1e-5;
                let ahead = platform.displacements(&along(&motion.pose, &unit(k), step));
                let behind = platform.displacements(&along(&motion.pose, &unit(k), -step));
                for leg in 0..6 {
                    let difference = (ahead[leg] - behind[leg]) / (2.0 * step);
                    assert!((difference - jacobian[leg][k]).abs() <= 1e-9, "leg {leg}, coordinate {k}");
                }
            }
        }
    }
}

/// V, from where the mass centres are, by textbook geometry.
fn potential(model: &Model, pose: &[f64; 6]) -> f64 {
    let turn = nalgebra::Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
    let place = nalgebra::Vector3::new(pose[0], pose[1], model.geometry.height + pose[2]);
    let mut sum = model.platform.mass * (place + turn * nalgebra::Vector3::from(model.platform.center_of_mass)).z;
    for (b, p) in model.geometry.base_joints.iter().zip(&model.geometry.platform_joints) {
        let base = nalgebra::Vector3::from(*b);
        let leg = place + turn * nalgebra::Vector3::from(*p) - base;
        let (length, direction) = (leg.norm(), leg.normalize());
        sum += model.leg.fixed_mass * (base + direction * model.leg.fixed_center).z;
        sum += model.leg.extensible_mass * (base + direction * (length - model.leg.extensible_center)).z;
    }
    sum * GRAVITY
}

/// With (AI.9) and (AI.14): kinetic energy from M, potential energy from where the mass centres are.
#[test]
fn energy_of_free_motion_is_conserved_to_the_order_of_the_integrator() {
    let model = asymmetric().0;
    let platform = lower::platform(&model).unwrap();
    let energy = |pose: &[f64; 6], rate: &[f64; 6]| {
        let rate = Vector6::from(*rate);
        0.5 * rate.dot(&(matrix(&platform.mass_matrix(pose)) * rate)) + potential(&model, pose)
    };
    // No leg force: M ḧ = −(C ḣ + G).
    let acceleration = |pose: &[f64; 6], rate: &[f64; 6]| -> [f64; 6] {
        let motion = Motion { pose: *pose, rate: *rate, acceleration: [0.0; 6] };
        let force = -Vector6::from(platform.generalised_force(&motion, 1.0));
        matrix(&platform.mass_matrix(pose)).cholesky().unwrap().solve(&force).into()
    };
    let drift = |steps: u32| {
        let step = 0.04 / f64::from(steps);
        let (mut pose, mut rate) = ([0.002, -0.003, 0.02, 0.05, -0.04, 0.03], [0.1, -0.2, 0.3, 3.0, -2.0, 4.0]);
        let start = energy(&pose, &rate);
        for _ in 0..steps {
            let (a1, v1) = (acceleration(&pose, &rate), rate);
            let v2 = along(&rate, &a1, step / 2.0);
            let a2 = acceleration(&along(&pose, &v1, step / 2.0), &v2);
            let v3 = along(&rate, &a2, step / 2.0);
            let a3 = acceleration(&along(&pose, &v2, step / 2.0), &v3);
            let v4 = along(&rate, &a3, step);
            let a4 = acceleration(&along(&pose, &v3, step), &v4);
            pose = std::array::from_fn(|k| pose[k] + step / 6.0 * (v1[k] + 2.0 * v2[k] + 2.0 * v3[k] + v4[k]));
            rate = std::array::from_fn(|k| rate[k] + step / 6.0 * (a1[k] + 2.0 * a2[k] + 2.0 * a3[k] + a4[k]));
        }
        (energy(&pose, &rate) - start) / start
    };
    let (coarse, fine) = (drift(20), drift(40));
    println!("relative change of energy: {coarse:e} in 20 steps, {fine:e} in 40: ratio {:.2}", coarse / fine);
    assert!(coarse.abs() < 1e-5 && (10.0..40.0).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
}

/// f' = f − J⁻ᵀ (wrench as generalised force), ω = T(θ) θ̇; and Δl comes along.
#[test]
fn a_wrench_on_the_platform_is_taken_off_the_leg_forces() {
    for (model, seed) in [(reference_model(), 7), (asymmetric().0, 8)] {
        let platform = lower::platform(&model).unwrap();
        for motion in states(seed, length(6, 20), 0.01, 0.3) {
            let wrench = [3.0, -5.0, 7.0, 0.2, -0.4, 0.6];
            let load = platform.load(&motion, Some(&wrench));
            let [_, _, _, _, ty, tz] = motion.pose;
            let axes =
                [[ty.cos() * tz.cos(), ty.cos() * tz.sin(), -ty.sin()], [-tz.sin(), tz.cos(), 0.0], [0.0, 0.0, 1.0]];
            let torque = axes.map(|axis| axis[0] * wrench[3] + axis[1] * wrench[4] + axis[2] * wrench[5]);
            let expected = Vector6::new(wrench[0], wrench[1], wrench[2], torque[0], torque[1], torque[2]);
            let taken = Vector6::from(platform.leg_forces(&motion)) - Vector6::from(load.force);
            let found = matrix(&platform.jacobian(&motion.pose)).transpose() * taken;
            assert!((found - expected).norm() <= 1e-12 * expected.norm(), "{found} {expected}");
            assert_eq!(load.displacement, platform.displacements(&motion.pose));
        }
    }
}

#[test]
fn displacements_in_f32_are_good_to_50_picometres_for_micrometre_poses() {
    for (model, seed) in [(reference_model(), 9), (asymmetric().0, 10)] {
        let platform = lower::platform(&model).unwrap();
        let single = single(&platform);
        let mut worst = 0.0_f64;
        for motion in states(seed, length(500, 2000), 40e-6, 0.6e-3) {
            let pose = motion.pose.map(|x| x as f32);
            let exact = platform.displacements(&pose.map(f64::from));
            for (found, exact) in single.displacements(&pose).into_iter().zip(exact) {
                worst = worse(worst, (f64::from(found) - exact).abs());
            }
        }
        println!("f32 against f64 on the same pose: {:.4} nm", worst * 1e9);
        assert!(worst <= 0.05e-9, "{worst:e} m");
    }
}

/// At the edges of the declared range, too, 1/l has its full precision.
#[test]
fn leg_lengths_are_exact_within_thirty_percent() {
    let model = reference_model();
    let platform = lower::platform(&model).unwrap();
    let rest = platform.rest_lengths();
    let (mut lowest, mut highest) = (1.0_f64, 1.0_f64);
    for k in 0..=200 {
        let z = -0.096 + 0.174 * f64::from(k) / 200.0;
        let found = platform.displacements(&[0.0, 0.0, z, 0.0, 0.0, 0.0]);
        let (b, p) = (model.geometry.base_joints[0], model.geometry.platform_joints[0]);
        let level = (p[0] - b[0]).powi(2) + (p[1] - b[1]).powi(2);
        let exact = (level + (model.geometry.height + z).powi(2)).sqrt();
        let ratio = exact / rest[0];
        if (0.7..=1.3).contains(&ratio) {
            (lowest, highest) = (lowest.min(ratio), highest.max(ratio));
            assert!((rest[0] + found[0] - exact).abs() <= 4e-16 * exact, "{z}: {:e}", rest[0] + found[0] - exact);
        }
    }
    assert!(lowest < 0.72 && highest > 1.28, "{lowest} {highest}");
}

/// Base and platform alike: an architecturally singular hexapod.
#[test]
fn a_geometry_whose_leg_forces_are_not_determined_is_refused_with_its_condition_number() {
    let mut model = reference_model();
    model.geometry.base_joints = model.geometry.platform_joints.map(|p| p.map(|x| 1.5 * x));
    let findings = lower::platform(&model).unwrap_err();
    assert_eq!(findings.len(), 1);
    assert_eq!(findings[0].code, codes::ILL_CONDITIONED);
    assert!(findings[0].key.starts_with("geometry."), "{}", findings[0].key);
    assert!(findings[0].message.contains("condition number"), "{}", findings[0].message);

    // The order that is fixed for a sound geometry keeps its pivots over the whole workspace.
    for model in [reference_model(), asymmetric().0] {
        let platform = lower::platform(&model).unwrap();
        let ratio = platform.pivot_ratio(&[0.0; 6], model.geometry.joint_radius());
        println!("smallest over largest pivot at rest: {ratio:.3}");
        assert!(ratio > 0.05, "{ratio}");
    }
}
