//! What `[lint] allow` lets pass.

use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::model::Model;

lints! {
    rules:;

    /// # E0890: a value that is far off
    ///
    /// A finding of the physical lint whose value lies seven times, or more, beyond
    /// what its rule lets pass is an error. The message says how many times.
    ///
    /// ## Why it matters
    ///
    /// Slips of a unit are of a thousand or more; where the root of a value counts,
    /// such as the stiffness in a resonance, a thousand is 32. No good platform is
    /// seven times beyond a rule, and no rule is wider than four and a half.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [amplifier] @@
    /// -noise = "2 mV"
    /// +noise = "2 V"
    /// ```
    ///
    /// ## Fix
    ///
    /// Correct the value; one that is meant is named in `allow` of `[lint]`, with the
    /// reason.
    ///
    /// ```toml
    /// noise = "2 mV"
    /// ```
    FAR_OFF = "E0890";

    /// # N0891: something odd that the spec lets pass
    ///
    /// A key that `allow` of `[lint]` names, with the reason in the message.
    ///
    /// ## Why it matters
    ///
    /// What is found about it is a note, whatever it was. It is shown so that nobody
    /// forgets that a value is odd.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [amplifier] @@
    /// -noise = "2 mV"
    /// +noise = "2 V"
    /// +[lint]
    /// +allow = ["amplifier.noise: old tubes, measured"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Nothing has to be done. Take the entry out once the value is an ordinary one.
    ALLOWED = "N0891";

    /// # W0892: an exception that lets nothing pass
    ///
    /// An entry of `allow` in `[lint]` should be about a finding that there is.
    ///
    /// ## Why it matters
    ///
    /// An exception that is not needed would hide the next slip of that key.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[lint]
    /// +allow = ["amplifier.noise: old tubes, measured"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Take the entry out.
    ///
    /// ```toml
    /// [lint]
    /// allow = []
    /// ```
    ALLOWED_NOTHING = "W0892";
}

/// Makes notes of warnings, and of values that are far off, whose keys the spec lets pass.
pub fn allow(model: &Model, findings: &mut [Diagnostic]) {
    for finding in findings {
        if finding.severity != Severity::Warning && finding.code != FAR_OFF {
            continue;
        }
        let Some(reason) = model.lint.reason(&finding.key) else { continue };
        finding.message = format!("{} (allowed: {reason})", finding.message);
        finding.help = "nothing is to be done while the reason holds".to_owned();
        finding.replacement = None;
        finding.code = ALLOWED.id;
        finding.severity = ALLOWED.severity();
    }
}

/// Exceptions that let nothing pass: they would hide the next slip.
#[must_use]
pub fn unused(model: &Model, findings: &[Diagnostic]) -> Vec<Diagnostic> {
    let used = |allowed: &str| {
        let covered =
            |key: &str| key.strip_prefix(allowed).is_some_and(|rest| rest.is_empty() || rest.starts_with('['));
        findings.iter().any(|one| one.code == ALLOWED && covered(&one.key))
    };
    let idle = model.lint.reasons().enumerate().filter(|(_, (key, _))| !used(key));
    idle.map(|(index, (key, _))| {
        let path = format!("lint.allow[{index}]");
        let place = model.spans.get(&path).map_or(Place::Whole, |span| Place::Spec(span.clone()));
        let message = format!("nothing is found about `{key}`, so that this lets nothing pass");
        Diagnostic::new(ALLOWED_NOTHING, &path, place, message, "take it out: it would hide the next slip")
    })
    .collect()
}
