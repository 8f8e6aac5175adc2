//! `specs/platform.schema.json` against the specs of the repository, and against changes that an editor should mark.
//!
//! Read as files: nothing of the compiler is built for it. That the file is what the compiler prints is a test of
//! `specgen-tests`.
#![cfg(test)]

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

fn specs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs")
}

fn schema() -> Value {
    serde_json::from_str(&fs::read_to_string(specs().join("platform.schema.json")).unwrap()).unwrap()
}

fn validator(schema: &Value) -> jsonschema::Validator {
    jsonschema::draft7::new(schema).expect("a draft-07 schema")
}

fn as_json(path: &Path) -> Value {
    toml::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn every_spec_of_the_repository_is_valid() {
    let validator = validator(&schema());
    let mut count = 0;
    for folder in [specs(), specs().join("features")] {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            // The paper's data as printed are there to be refused.
            let refused = path.file_stem().is_some_and(|stem| stem == "as-printed");
            if refused || path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            count += 1;
            let spec = as_json(&path);
            let problems: Vec<String> =
                validator.iter_errors(&spec).map(|e| format!("{}: {e}", e.instance_path())).collect();
            assert!(problems.is_empty(), "{}: {problems:?}", path.display());
        }
    }
    assert!(count >= 10, "only {count} specs found");
}

/// What an editor should mark.
#[test]
fn bad_specs_are_invalid() {
    let validator = validator(&schema());
    let mut good = as_json(&specs().join("reference.toml"));
    // What it leaves to the compiler; a weight would be the second of two ways to say it.
    good["adaptation"]["level_bandwidth"] = json!("100 rad/s");
    good["gains"] = json!({"proportional": ["5e6 N/m", "5e6 N/m", "2e7 N/m", "1e5 N m/rad", "1e5 N m/rad", "5e4 N m/rad"], "integral": ["4e7 N/(m s)", "4e7 N/(m s)", "2e8 N/(m s)", "1e6 N m/(rad s)", "1e6 N m/(rad s)", "5e5 N m/(rad s)"], "derivative": ["0 N s/m", "0 N s/m", "0 N s/m", "0 N m s/rad", "0 N m s/rad", "0 N m s/rad"]});
    let good = good;
    assert!(validator.is_valid(&good));
    let changes: [(&str, Value); 18] = [
        ("/name", json!("two words")),
        ("/schema", json!(2)),
        ("/geometry/height", json!(180)),
        ("/geometry/height", json!("tall")),
        ("/geometry/height", json!("1,5 mm")),
        ("/geometry/heigth", json!("180 mm")),
        ("/dac/bits", json!(4)),
        ("/dac/range", json!(["0 V"])),
        ("/adaptation/mode", json!("pid")),
        ("/adaptation/level_weight", json!(0.252)),
        ("/geometry/base_joints", json!([["1 mm", "2 mm", "3 mm"]])),
        ("/control/mode", json!("pid")),
        ("/control/notch", json!("true")),
        ("/gauge/0/direction", json!([0, 0])),
        ("/gauge/5/points", json!(["80 mm", "0 mm", "180 mm"])),
        ("/gauge", json!([])),
        ("/trajectory/0/kind", json!("case-3")),
        ("/hysteresis/records", json!(["a.csv", "b.csv"])),
    ];
    for (pointer, value) in changes {
        let mut bad = good.clone();
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        bad.pointer_mut(parent).and_then(Value::as_object_mut).expect(pointer).insert(name.to_owned(), value.clone());
        assert!(!validator.is_valid(&bad), "{pointer} = {value}");
    }
    for pointer in [
        "/geometry/height",
        "/geometry/base_angle",
        "/timing",
        "/gains/integral",
        "/gauge/3/point",
        "/control/modal_damping",
    ] {
        let mut bad = good.clone();
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        bad.pointer_mut(parent).and_then(Value::as_object_mut).expect(pointer).remove(name).expect(pointer);
        assert!(!validator.is_valid(&bad), "{pointer} missing");
    }
}

/// Every key's example and default, as the key's own part of the schema has them.
#[test]
fn examples_and_defaults_are_valid() {
    fn look(part: &Value, count: &mut usize) {
        let Some(object) = part.as_object() else {
            return part.as_array().into_iter().flatten().for_each(|inner| look(inner, count));
        };
        let examples = object.get("examples").and_then(Value::as_array).into_iter().flatten();
        for value in examples.chain(object.get("default")) {
            *count += 1;
            assert!(validator(part).is_valid(value), "{value} in {part:#}");
        }
        // Under `properties`, a key may itself be called `default`: its value is then an object, looked at like any other.
        object.values().for_each(|inner| look(inner, count));
    }
    let mut count = 0;
    look(&schema(), &mut count);
    assert!(count >= 80, "only {count} values found");
}
