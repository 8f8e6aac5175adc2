//! `specgen dynamics` as a user runs it.
#![allow(clippy::unwrap_used)] // A test.

use crate::support::{Folder, repository};
use serde_json::Value;

fn reference() -> (String, Value) {
    let path = repository().join("tests/oracle/dynamics-reference.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let document = serde_json::from_str(&text).unwrap();
    (text, document)
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn same(found: &Value, expected: &Value, tolerance: f64) {
    let (found, expected) = (numbers(found), numbers(expected));
    let size = expected.iter().fold(0.0, |sum: f64, x| sum + x * x).sqrt();
    let error = found.iter().zip(&expected).fold(0.0, |sum: f64, (a, b)| sum + (a - b) * (a - b)).sqrt();
    assert!(found.len() == expected.len() && error <= tolerance * size.max(1e-9), "{error:e} of {size}");
}

#[test]
fn the_reference_vectors_come_back_with_every_field() {
    let folder = Folder::new();
    let (text, expected) = reference();
    folder.write("states.json", text);
    let run = folder.run(&["dynamics", "reference.toml", "--states", "states.json", "-o", "out.json"]);
    assert_eq!(run.code, 0, "{run:?}");
    let found: Value = serde_json::from_str(&folder.read("out.json")).unwrap();
    let (found, expected) = (found["vectors"].as_array().unwrap(), expected["vectors"].as_array().unwrap());
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found["id"], expected["id"]);
        for key in ["leg_lengths", "J", "M", "Cv", "G", "F", "leg_forces"] {
            same(&found[key], &expected[key], 1e-12);
        }
    }
}

#[test]
fn csv_from_rest_gives_what_json_gives_from_the_base() {
    let folder = Folder::new();
    folder.write(
        "rest.csv",
        "x,y,z,a,b,c,vx,vy,vz,va,vb,vc,ax,ay,az,aa,ab,ac\n0,0,0.001,0,0.01,0,0,0,0,0,0,0,1,0,0,0,0,2\n",
    );
    folder.write(
        "base.json",
        r#"[{"h": [0, 0, 0.181, 0, 0.01, 0], "hd": [0, 0, 0, 0, 0, 0], "hdd": [1, 0, 0, 0, 0, 2]}]"#,
    );
    let rest = folder.json(&["dynamics", "reference.toml", "--states", "rest.csv", "--from-rest"]);
    let base = folder.json(&["dynamics", "reference.toml", "--states", "base.json"]);
    let (rest, base) = (&rest.value["result"]["vectors"][0], &base.value["result"]["vectors"][0]);
    for key in ["J", "M", "G", "leg_forces"] {
        same(&rest[key], &base[key], 1e-12);
    }
}

#[test]
fn bad_states_are_refused_in_words() {
    let folder = Folder::new();
    for (name, content, words) in [
        ("empty.json", "[]", "no states"),
        ("broken.json", "[{", "not JSON"),
        ("short.json", r#"[{"h": [0, 0], "hd": [], "hdd": []}]"#, "`h` must be six numbers"),
        ("object.json", r#"{"states": []}"#, "`vectors`"),
        ("short.csv", "1,2,3\n", "line 1: expected 18 finite numbers"),
        ("nan.csv", "0,0,NaN,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "line 1: expected 18 finite numbers"),
        ("tilted.csv", "0,0,0.18,0,0.8,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "beyond"),
        ("far.csv", "0,0,0.5,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "beyond"),
    ] {
        folder.write(name, content);
        folder.run(&["dynamics", "reference.toml", "--states", name]).says(1, &[words, name]);
    }
    folder.run(&["dynamics", "reference.toml", "--states", "none.csv"]).says(1, &["none.csv", "cannot be read"]);
}
