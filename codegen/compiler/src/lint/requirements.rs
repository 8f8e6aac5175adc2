//! Requirements that any platform meets, and limits at frequencies that it cannot reach.

use super::paths::PATH_EXCITES;
use super::{Facts, Findings, figure};

lints! {
    rules: ask_something, frequencies;

    /// # W0866: a requirement that is always met
    ///
    /// A precision, noise or error limit should be at most a twentieth of the stroke,
    /// for a rotation at most a twentieth of the workspace.
    ///
    /// ## Why it matters
    ///
    /// Any platform meets a looser limit, so it checks nothing. The unit is probably
    /// wrong.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[requirements]
    /// +precision = "50 um"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check nm against um, or leave the key out.
    ///
    /// ```toml
    /// [requirements]
    /// precision = "50 nm"
    /// ```
    ASKS_NOTHING = "W0866";
}

/// Loosest meaningful limit, as a share of the stroke or the workspace.
const LOOSEST: f64 = 0.05;

/// Checks for limits that any platform meets.
fn ask_something(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let rotation = model.workspace.rotation.into_iter().fold(0.0, |most: f64, one| if one > most { one } else { most });
    let wholes = [(model.actuator.stroke, "a stroke", "um", 1e6), (rotation, "a workspace", "mrad", 1e3)];
    let one = |key: &str, limit: Option<f64>, about: usize| limit.map(|limit| (key.to_owned(), limit, about));
    let mut limits = vec![
        one("requirements.precision", model.requirements.precision, 0),
        one("requirements.noise", model.requirements.noise, 0),
        one("requirements.rotation_noise", model.requirements.rotation_noise, 1),
        one("robust.max_error", model.robust.max_error, 0),
        one("robust.max_learned", model.robust.max_learned, 0),
        one("robust.max_orientation", model.robust.max_orientation, 1),
    ];
    for (index, limit) in model.requirements.tracking.iter().enumerate() {
        let key = |name: &str| format!("requirements.tracking[{index}].{name}");
        limits.push(one(&key("translation"), limit.translation, 0));
        limits.push(one(&key("rotation"), limit.rotation, 1));
        for (axis, error) in limit.axes.into_iter().flatten().enumerate() {
            limits.push(one(&format!("{}[{axis}]", key("axes")), Some(error), axis / 3));
        }
    }
    for (key, limit, about) in limits.into_iter().flatten() {
        let (whole, of, unit, scale) = wholes[about];
        if limit <= LOOSEST * whole || whole == 0.0 {
            continue;
        }
        found.add(
            ASKS_NOTHING,
            &key,
            format!("`{key}` is {} {unit}, for {of} of {} {unit}", figure(limit * scale), figure(whole * scale)),
            if about == 0 {
                "any platform meets that: check the unit (nm or um)"
            } else {
                "any platform meets that: check the unit (nrad, urad or mrad)"
            },
        );
    }
}

/// Checks that limits are at frequencies below the lowest mode.
fn frequencies(facts: &Facts, found: &mut Findings) {
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    for (index, limit) in facts.model.requirements.tracking.iter().enumerate() {
        let Some(frequency) = limit.frequency.filter(|frequency| *frequency > modes[0]) else { continue };
        let [hertz, lowest] = [frequency, modes[0]].map(figure);
        found.add(
            PATH_EXCITES,
            &format!("requirements.tracking[{index}].frequency"),
            format!("a limit at {hertz} Hz is above the lowest mode of the platform, {lowest} Hz"),
            "a tenth of the lowest mode is usual: check the unit of the frequency (Hz or kHz)",
        );
    }
}
