//! What the tests of the spec language share: the specs of the repository, and a folder with the records they name.

use std::fs;
use std::path::{Path, PathBuf};

use specgen::diagnostic::{Diagnostic, Place, Severity};
use specgen::spec::SpecSource;
use specgen::spec::keys::{Presence, SECTIONS};

/// Folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ is in the repository").to_path_buf()
}

/// Every spec of the repository, sorted.
pub fn spec_files() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for folder in [root().join("specs"), root().join("specs/features")] {
        for entry in fs::read_dir(&folder).expect("specs/ is there") {
            let path = entry.expect("readable").path();
            if path.extension().is_some_and(|e| e == "toml") {
                files.push(path);
            }
        }
    }
    files.sort();
    assert!(files.len() >= 10, "only {} specs found", files.len());
    files
}

/// A folder in which every record that the specs name is there, empty: this is about the spec alone, and must not
/// depend on whether the records are generated yet.
pub fn folder_with_records() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir_all(dir.path().join("specs")).expect("created");
    fs::create_dir_all(dir.path().join("records")).expect("created");
    fs::create_dir_all(dir.path().join("specs/records")).expect("created");
    for place in ["records", "specs/records"] {
        for name in ["reference-forc", "leg1", "leg2", "leg3", "leg4", "leg5", "leg6"] {
            fs::write(dir.path().join(place).join(format!("{name}.csv")), "").expect("written");
        }
    }
    dir
}

/// `text` as if it stood in `folder`/specs/`name`; "../records" and "records" both exist there.
pub fn source(text: &str, name: &str, folder: &tempfile::TempDir) -> SpecSource {
    SpecSource { display_name: name.to_owned(), text: text.to_owned(), dir: folder.path().join("specs") }
}

/// A spec with every key of the key table but the bandwidths, each on a line of its own.
pub fn every_key() -> String {
    let mut text = String::new();
    for section in SECTIONS {
        if !section.name.is_empty() {
            text.push_str(&format!("[{}]\n", section.name));
        }
        for key in section.keys {
            let is_bandwidth = matches!(key.presence, Presence::InsteadOf(_)) && key.name.ends_with("_bandwidth");
            if !is_bandwidth {
                text.push_str(&format!("{} = {}\n", key.name, key.example));
            }
        }
    }
    text
}

/// Line of a finding, from 1.
pub fn line_of(diagnostic: &Diagnostic, text: &str) -> usize {
    match &diagnostic.place {
        Place::Spec(span) => 1 + text[..span.start].bytes().filter(|b| *b == b'\n').count(),
        Place::File { line, .. } => line.expect("a line"),
        Place::Whole => panic!("no place: {diagnostic:?}"),
    }
}

/// The errors among `diagnostics`.
pub fn errors(diagnostics: &[Diagnostic]) -> Vec<&Diagnostic> {
    diagnostics.iter().filter(|d| d.severity == Severity::Error).collect()
}
