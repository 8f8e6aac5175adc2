//! Cross-talk of the legs.

use super::{Facts, Findings};

lints! {
    rules: not_of_itself;

    /// # E0894: cross-talk of a leg with itself
    ///
    /// The diagonal of `actuator.cross_talk` is zero.
    ///
    /// ## Why it matters
    ///
    /// E is what a leg must displace beside its own length, per length of each other
    /// leg. What a leg moves by its own voltage is in its record: an entry on the
    /// diagonal would count that twice.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// +cross_talk = [[0.01, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
    /// ```
    ///
    /// ## Fix
    ///
    /// Write 0 there, or take the lines that `specgen identify cross-talk` prints.
    ///
    /// ```toml
    /// cross_talk = [[0, 0.01, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
    /// ```
    OWN_CROSS_TALK = "E0894";
}

/// Checks that the diagonal is zero.
fn not_of_itself(facts: &Facts, found: &mut Findings) {
    let Some(coupling) = &facts.model.actuator.cross_talk else { return };
    if let Some(leg) = (0..6).find(|leg| coupling[*leg][*leg] != 0.0) {
        found.add(
            OWN_CROSS_TALK,
            "actuator.cross_talk",
            format!("row {leg} has an entry for leg {leg} itself; the diagonal of E is zero"),
            "write 0 there: it is in the leg's gain",
        );
    }
}
