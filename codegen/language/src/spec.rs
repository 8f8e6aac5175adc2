//! Reads the spec file: TOML text to a checked [`Model`]. This is the only module that reads TOML.
//!
//! ```text
//! text → tree with spans (syntax) → values by key path (read, value) → checks → model
//! ```
//! [`crate::model`] declares everything about a key together with its field; the JSON Schema and the reference follow
//! from it, too. A run reports every finding, in the order of the file.

mod check;
mod findings;
mod joint_file;
pub mod keys;
mod messages;
mod names;
mod read;
mod reference;
mod schema;
mod source;
mod suggestion;
mod syntax;
mod text;
mod value;

use findings::Findings;

use crate::diagnostic::{Code, Diagnostic, Severity, codes};
use crate::keys::fields::Value;
use crate::model::{Hysteresis, Model};

pub use crate::SpecSource;
pub use crate::quantity;
pub use reference::{key_markdown, reference_markdown};
pub use schema::json_schema;
pub use source::MAX_BYTES;
pub use text::nearest;

/// Errors after which every value that the model needs is still as in the file. A gain without a unit is one of them:
/// gains are optional.
const UNPHYSICAL: [Code; 8] = [
    codes::BIAS_OUTSIDE,
    codes::VOLTAGE_OUTSIDE_DAC,
    codes::GYRATION,
    codes::INERTIA_UNPHYSICAL,
    codes::CENTER_OUTSIDE_LEG,
    codes::STROKE_IMPOSSIBLE,
    codes::UNIT_MISSING,
    codes::RECORD_UNREADABLE,
];

/// Checks a spec and builds its model.
///
/// The findings are in the order of the file. The model is there if none of them is an error. The records in the spec
/// must exist, but are not read.
#[must_use]
pub fn load(source: &SpecSource) -> (Option<Model>, Vec<Diagnostic>) {
    let (model, findings) = load_as_far(source);
    let refused = findings.iter().any(|finding| finding.severity == Severity::Error);
    (model.filter(|_| !refused), findings)
}

/// The same, but the model is also there if all errors are of a kind that could not be built. Masses, limits and paths
/// are then still checked: a file with one mistake often has another.
#[must_use]
pub fn load_as_far(source: &SpecSource) -> (Option<Model>, Vec<Diagnostic>) {
    let mut findings = Findings::default();
    let text = source.text.as_str();
    if text.len() > MAX_BYTES {
        findings.add(
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
        findings.add(
            codes::EMPTY,
            "",
            0..0,
            "the spec is empty".to_owned(),
            "`specgen new NAME` asks for the values of your platform and writes a spec; docs/spec-reference.md lists every key".to_owned(),
        );
        return (None, findings.finish());
    }
    if !parsed.whole {
        return (None, findings.finish());
    }
    let mut fields = read::read(text, &parsed.root, &mut findings);
    joint_file::read(&mut fields, &source.dir, &mut findings);
    check::all(&fields, &source.dir, &mut findings);
    drop_wrong_advice(&mut findings);
    let whole = |finding: &Diagnostic| {
        finding.severity < Severity::Error || UNPHYSICAL.iter().any(|code| finding.code == *code)
    };
    let model = if findings.all().iter().all(whole) { Model::read(&fields) } else { None };
    (model, findings.finish())
}

/// `[hysteresis]` of one leg, and of `[actuator]` `resonance` (Hz) with `damping_ratio`, and `resonance_gain`, if they
/// are there.
pub type LegLines = (Hysteresis, Option<[f64; 2]>, Option<f64>);

/// Reads a file of these two sections alone, as `specgen identify rate -o` writes one; `None` for a spec.
///
/// # Errors
/// The findings of its lines.
pub fn leg_lines(source: &SpecSource) -> Option<Result<LegLines, Vec<Diagnostic>>> {
    let mut findings = Findings::default();
    let text = source.text.as_str();
    let parsed = syntax::parse(text, &mut findings);
    let is_of_leg = |name: &str| name == "hysteresis" || name == "actuator";
    if text.len() > MAX_BYTES
        || !parsed.root.contains_key("hysteresis")
        || !parsed.root.keys().all(|name| is_of_leg(name.get_ref()))
    {
        return None;
    }
    let fields = read::read(text, &parsed.root, &mut findings);
    // The other sections, and the rest of the actuator.
    let absent = |one: &Diagnostic| one.code == codes::MISSING_SECTION || one.code == codes::MISSING_KEY;
    findings.retain(|one| !absent(one) || one.key.starts_with("hysteresis."));
    check::of_leg(&fields, &mut findings);
    let number = |path: &str| <f64 as Value>::read(&fields, path);
    let mode = number("actuator.resonance").zip(number("actuator.damping_ratio")).map(|(f, zeta)| [f, zeta]);
    let lines = Hysteresis::read(&fields, "hysteresis").filter(|_| parsed.whole && !findings.has_errors());
    Some(lines.map(|lines| (lines, mode, number("actuator.resonance_gain"))).ok_or_else(|| findings.finish()))
}

/// Removes the advice to add quotes if the key takes no text, or if the value is a placeholder.
fn drop_wrong_advice(findings: &mut Findings) {
    let known = |d: &&Diagnostic| d.code == codes::WRONG_TYPE || d.code == codes::PLACEHOLDER;
    let not_text: Vec<_> = findings.all().iter().filter(known).map(|d| d.place.clone()).collect();
    findings.retain(|d| d.code != codes::UNQUOTED || !not_text.contains(&d.place));
}
