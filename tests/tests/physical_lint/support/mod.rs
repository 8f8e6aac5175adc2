//! Specs as lists of lines that can be changed one value at a time.

pub mod mutants;
pub mod plausible;
pub mod slips;
pub mod tally;
pub mod undetectable;

use std::fs;
use std::path::Path;

use specgen::compile::compile_source;
use specgen::diagnostic::Diagnostic;
use specgen::spec::SpecSource;

/// What the compiler says about a text that lies in `dir`: whether it is accepted, and every finding.
pub fn verdict(text: &str, dir: &Path) -> (bool, Vec<Diagnostic>) {
    let source = SpecSource { display_name: "platform.toml".to_owned(), text: text.to_owned(), dir: dir.to_path_buf() };
    match compile_source(source) {
        Ok(compiled) => (true, compiled.findings),
        Err(refused) => (false, refused.findings),
    }
}

/// A spec of the repository, with paths to its records as they are from `specs/`.
pub fn spec(name: &str) -> String {
    let text = fs::read_to_string(specgen_tests::repository().join("specs").join(name)).expect("a spec");
    text.replace("../records/", "records/").replace("../waveforms/", "waveforms/")
}
