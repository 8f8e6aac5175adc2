//! What `[lint] allow` lets pass.

use specgen_language::diagnostic::{Diagnostic, Place, Severity, codes};
use specgen_language::model::Model;

/// Makes notes of warnings, and of values that are far off, whose keys the spec lets pass.
pub fn allow(model: &Model, findings: &mut [Diagnostic]) {
    for finding in findings {
        if finding.severity != Severity::Warning && finding.code != codes::FAR_OFF {
            continue;
        }
        let Some(reason) = model.lint.reason(&finding.key) else { continue };
        finding.message = format!("{} (allowed: {reason})", finding.message);
        finding.help = "nothing is to be done while the reason holds".to_owned();
        finding.replacement = None;
        finding.code = codes::ALLOWED.id;
        finding.severity = codes::ALLOWED.severity();
    }
}

/// Exceptions that let nothing pass: they would hide the next slip.
#[must_use]
pub fn unused(model: &Model, findings: &[Diagnostic]) -> Vec<Diagnostic> {
    let used = |allowed: &str| {
        let covered =
            |key: &str| key.strip_prefix(allowed).is_some_and(|rest| rest.is_empty() || rest.starts_with('['));
        findings.iter().any(|one| one.code == codes::ALLOWED && covered(&one.key))
    };
    let idle = model.lint.reasons().enumerate().filter(|(_, (key, _))| !used(key));
    idle.map(|(index, (key, _))| {
        let path = format!("lint.allow[{index}]");
        let place = model.spans.get(&path).map_or(Place::Whole, |span| Place::Spec(span.clone()));
        let message = format!("nothing is found about `{key}`, so that this lets nothing pass");
        Diagnostic::new(codes::ALLOWED_NOTHING, &path, place, message, "take it out: it would hide the next slip")
    })
    .collect()
}
