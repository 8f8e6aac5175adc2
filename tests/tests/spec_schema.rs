//! The published JSON Schema against the key table. A validator judges the schema in `tests/schema`.

// Clippy sees the helpers of an integration test as production code.
use std::fs;
use std::path::Path;

use specgen::{findings, spec};
use specgen_tests::repository;

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
fn the_published_schema_is_fresh() {
    assert_fresh(&repository().join("specs/platform.schema.json"), &spec::json_schema());
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

/// The codes that stand in `text` as literals: a quote, E, W or N, four digits, a quote.
fn code_literals(text: &str) -> Vec<&str> {
    text.split('"')
        .filter(|piece| piece.len() == 5 && piece.starts_with(['E', 'W', 'N']))
        .filter(|piece| piece[1..].bytes().all(|b| b.is_ascii_digit()))
        .collect()
}

/// A finding is made from a constant that the table or a lint declares, so that its code has a page; tests may write codes out.
#[test]
fn codes_of_findings_are_written_once() {
    assert_eq!(code_literals(r#"f("E0101", "W0", "E010x", "W0301", "N0862")"#), ["E0101", "W0301", "N0862"]);
    let mut files = Vec::new();
    rust_files(&repository().join("codegen"), &mut files);
    let mut registered = 0;
    for path in files {
        let text = fs::read_to_string(&path).expect("readable");
        let literals = code_literals(&text);
        for code in &literals {
            assert!(findings::find(code).is_some(), "{code} in {} is no finding", path.display());
        }
        if path.ends_with("diagnostic/codes.rs") || path.parent().is_some_and(|folder| folder.ends_with("lint")) {
            registered += literals.len();
        } else if !path.components().any(|part| part.as_os_str() == "tests") {
            assert!(literals.is_empty(), "{literals:?} in {}", path.display());
        }
    }
    assert_eq!(registered, findings::all().len());
}
