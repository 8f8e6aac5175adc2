//! Exceptions from the lint: `[lint] allow`.

use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::model::Model;

lints! {
    rules:;

    /// # E0890: a value far beyond the limit of a check
    ///
    /// A value seven or more times beyond the limit of a check of the physical lint is
    /// an error. The message states the factor.
    ///
    /// ## Why it matters
    ///
    /// A wrong unit is usually wrong by a factor of a thousand or more. Where a value
    /// enters as its square root, as the stiffness does in a resonance, a thousand
    /// counts as 32. No sound platform is seven times beyond a limit.
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
    /// Correct the value. If it is intended, list its key with the reason in `allow`
    /// of `[lint]`.
    ///
    /// ```toml
    /// noise = "2 mV"
    /// ```
    FAR_OFF = "E0890";

    /// # N0891: an allowed exception
    ///
    /// `allow` of `[lint]` lists the key of a finding. The message contains the reason.
    ///
    /// ## Why it matters
    ///
    /// The finding is reduced to a note. It is still shown, so that nobody forgets that
    /// the value is unusual.
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
    /// None needed. Remove the entry once the value is no longer unusual.
    ALLOWED = "N0891";

    /// # W0892: an unused exception
    ///
    /// Every entry of `allow` in `[lint]` should match a finding.
    ///
    /// ## Why it matters
    ///
    /// An exception that is not needed would hide the next mistake in that key.
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
    /// Remove the entry.
    ///
    /// ```toml
    /// [lint]
    /// allow = []
    /// ```
    ALLOWED_NOTHING = "W0892";
}

/// Turns warnings and `FAR_OFF` errors into notes if the spec allows their keys.
pub fn allow(model: &Model, findings: &mut [Diagnostic]) {
    for finding in findings {
        if finding.severity != Severity::Warning && finding.code != FAR_OFF {
            continue;
        }
        let Some(reason) = model.lint.reason(&finding.key) else { continue };
        finding.message = format!("{} (allowed: {reason})", finding.message);
        finding.help = "no action needed while the reason holds".to_owned();
        finding.replacement = None;
        finding.code = ALLOWED.id;
        finding.severity = ALLOWED.severity();
    }
}

/// Findings about exceptions that match no finding.
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
        let message = format!("this exception has no effect: there is no finding about `{key}`");
        Diagnostic::new(ALLOWED_NOTHING, &path, place, message, "remove it: it would hide the next mistake in that key")
    })
    .collect()
}
