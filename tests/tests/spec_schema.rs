//! The published JSON Schema and the generated documents against the key table and the specs.

// Clippy sees the helpers of an integration test as production code.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;

use crate::support::specs::{every_key, root, spec_files};
use serde_json::{Value, json};
use specgen::{diagnostic, spec};

fn validator() -> jsonschema::Validator {
    let schema: Value = serde_json::from_str(&spec::json_schema()).expect("the schema is JSON");
    jsonschema::draft7::new(&schema).expect("the schema is a draft-07 schema")
}

fn as_json(text: &str) -> Value {
    toml::from_str(text).expect("TOML")
}

#[test]
fn every_spec_of_the_repository_is_valid() {
    let validator = validator();
    for path in spec_files() {
        let value = as_json(&fs::read_to_string(&path).expect("readable"));
        let problems: Vec<String> =
            validator.iter_errors(&value).map(|e| format!("{}: {e}", e.instance_path())).collect();
        assert!(problems.is_empty(), "{}: {problems:?}", path.display());
    }
}

/// What an editor should mark.
#[test]
fn bad_specs_are_invalid() {
    let validator = validator();
    let good = as_json(&every_key());
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
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        bad.pointer_mut(parent).and_then(Value::as_object_mut).expect("a table").insert(name.to_owned(), value.clone());
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
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        bad.pointer_mut(parent).and_then(Value::as_object_mut).expect("a table").remove(name).expect("was there");
        assert!(!validator.is_valid(&bad), "{pointer} missing");
    }
}

/// With SPECGEN_BLESS=1 in the environment the file is written instead.
fn assert_fresh(path: &Path, text: &str) {
    if std::env::var_os("SPECGEN_BLESS").is_some() {
        fs::write(path, text).expect("written");
        return;
    }
    let committed = fs::read_to_string(path).unwrap_or_default();
    assert!(
        committed == text,
        "{} is stale: run SPECGEN_BLESS=1 cargo test -p specgen-tests spec_schema",
        path.display()
    );
}

#[test]
fn generated_documents_are_fresh() {
    assert_fresh(&root().join("specs/platform.schema.json"), &spec::json_schema());
    assert_fresh(&root().join("docs/spec-reference.md"), &spec::reference_markdown());
    assert_fresh(&root().join("docs/diagnostics.md"), &diagnostic::reference_markdown());
}

/// Every file below `folder` whose name ends in `.rs`, sorted.
fn rust_files(folder: &Path, files: &mut Vec<std::path::PathBuf>) {
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
}

/// The codes that stand in `text` as literals: a quote, E or W, four digits, a quote.
fn code_literals(text: &str) -> Vec<&str> {
    text.split('"')
        .filter(|piece| piece.len() == 5 && piece.starts_with(['E', 'W']))
        .filter(|piece| piece[1..].bytes().all(|b| b.is_ascii_digit()))
        .collect()
}

#[test]
fn every_code_in_the_compiler_is_in_the_registry() {
    assert_eq!(code_literals(r#"f("E0101", "W0", "E010x", "W0301")"#), ["E0101", "W0301"]);
    let mut files = Vec::new();
    rust_files(&root().join("codegen/src"), &mut files);
    let mut found = 0;
    for path in files {
        let text = fs::read_to_string(&path).expect("readable");
        for code in code_literals(&text) {
            found += 1;
            assert!(
                diagnostic::codes::find(code).is_some(),
                "{code} in {} is not in diagnostic/codes.rs",
                path.display()
            );
        }
    }
    assert!(found >= diagnostic::codes::REGISTRY.len(), "{found} literals");
}
