//! The dynamics of the platform against the reference vectors, against an independent Lagrangian, and by its theorems.

use std::fs;

use serde_json::Value;
use specgen::compile::compile;
use specgen::lower;
use specgen_runtime::{Motion, Platform};
use specgen_tests::repository;

fn reference() -> Platform<f64> {
    let compiled = compile(&repository().join("specs/reference.toml")).unwrap_or_else(|r| panic!("{:?}", r.findings));
    lower::platform(&compiled.model).unwrap()
}

struct Vector {
    id: String,
    motion: Motion<f64>,
    fields: Vec<(&'static str, Vec<f64>)>,
}

fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// The reference vectors with poses from rest.
fn vectors() -> Vec<Vector> {
    let text = fs::read_to_string(repository().join("../shared/reference/dynamics-vectors.json")).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    let height = document["parameters"]["z_nominal"].as_f64().unwrap();
    let vectors = document["vectors"].as_array().unwrap();
    vectors
        .iter()
        .map(|vector| {
            let six = |key: &str| -> [f64; 6] { flat(&vector[key]).try_into().unwrap() };
            let mut pose = six("h");
            pose[2] -= height;
            Vector {
                id: vector["id"].as_str().unwrap().to_owned(),
                motion: Motion { pose, rate: six("hd"), acceleration: six("hdd") },
                fields: ["J", "M", "Cv", "G", "F", "leg_forces"].map(|key| (key, flat(&vector[key]))).to_vec(),
            }
        })
        .collect()
}

fn field(platform: &Platform<f64>, motion: &Motion<f64>, key: &str) -> Vec<f64> {
    match key {
        "J" => platform.jacobian(&motion.pose).concat(),
        "M" => platform.mass_matrix(&motion.pose).concat(),
        "Cv" => platform.coriolis(&motion.pose, &motion.rate).to_vec(),
        "G" => platform.gravity(&motion.pose).to_vec(),
        "F" => platform.generalised_force(motion, 1.0).to_vec(),
        _ => platform.leg_forces(motion).to_vec(),
    }
}

/// |a − b| over |b|, Euclidean over the whole field; absolute where b is zero.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).fold(0.0, |s, x| s + x).sqrt();
    let size = norm(&mut b.iter().copied());
    let error = norm(&mut a.iter().zip(b).map(|(a, b)| a - b));
    if size == 0.0 { error } else { error / size }
}

#[test]
fn every_field_of_the_reference_vectors() {
    let platform = reference();
    let mut worst = [0.0_f64; 6];
    for vector in vectors() {
        for (k, (key, expected)) in vector.fields.iter().enumerate() {
            let error = relative(&field(&platform, &vector.motion, key), expected);
            assert!(error <= 1e-12, "{} {key}: {error:e}", vector.id);
            worst[k] = worst[k].max(error);
        }
    }
    println!("worst relative errors of J, M, Cv, G, F, leg_forces: {worst:?}");
}
