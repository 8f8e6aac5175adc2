//! Reads the spec file: TOML text to a checked [`Model`]. The only module that knows TOML.
//!
//! ```text
//! text → tree with spans (syntax) → values by key path (read, value, quantity) → checks → model (build)
//! ```
//! Everything about a key stands in one table, [`keys`]; the JSON Schema and the reference are printed from it.
//! A run reports every finding, in the order of the file.

mod build;
mod check;
mod fields;
mod findings;
mod joints;
pub mod keys;
mod messages;
mod names;
pub mod quantity;
mod read;
mod reference;
mod schema;
mod source;
mod syntax;
mod task_space;
mod text;
mod value;

use findings::Findings;

use crate::diagnostic::{Diagnostic, codes};
use crate::model::Model;

pub use reference::reference_markdown;
pub use schema::json_schema;
pub use source::{MAX_BYTES, SpecSource};

/// Checks a spec and builds its model.
///
/// The findings are in the order of the file; the model is there if none of them is an error. The records that the
/// spec names are looked for beside it, but not read.
#[must_use]
pub fn load(source: &SpecSource) -> (Option<Model>, Vec<Diagnostic>) {
    let mut findings = Findings::default();
    let text = source.text.as_str();
    if text.len() > MAX_BYTES {
        findings.error(
            codes::TOO_LARGE,
            "",
            0..0,
            "the spec is larger than 1 MiB, expected a few kilobytes".to_owned(),
            "measurements belong in CSV files that the spec refers to".to_owned(),
        );
        return (None, findings.finish());
    }
    let parsed = syntax::parse(text, &mut findings);
    if parsed.root.is_empty() && !findings.has_errors() {
        findings.error(
            codes::EMPTY,
            "",
            0..0,
            "the spec is empty".to_owned(),
            "start from a copy of specs/minimal.toml, or of specs/legs.toml for every key".to_owned(),
        );
        return (None, findings.finish());
    }
    if !parsed.whole {
        return (None, findings.finish());
    }
    let fields = read::read(text, &parsed.root, &mut findings);
    check::all(&fields, &source.dir, &mut findings);
    drop_wrong_advice(&mut findings);
    let model = if findings.has_errors() { None } else { build::model(&fields) };
    (model, findings.finish())
}

/// "Put it in quotes" is no help where the key takes no text at all.
fn drop_wrong_advice(findings: &mut Findings) {
    let not_text: Vec<_> =
        findings.all().iter().filter(|d| d.code == codes::WRONG_TYPE).map(|d| d.place.clone()).collect();
    findings.retain(|d| d.code != codes::UNQUOTED || !not_text.contains(&d.place));
}
