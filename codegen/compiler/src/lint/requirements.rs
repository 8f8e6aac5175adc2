//! Requirements that would be met whatever is built, and such as no motion has.

use super::paths::PATH_EXCITES;
use super::{Facts, Found, figure};

lints! {
    rules: ask_something, frequencies;

    /// # W0866: a requirement that asks nothing
    ///
    /// A precision, a noise or a largest error of more than a twentieth of the stroke
    /// is reported, and one of a rotation of more than a twentieth of the workspace.
    ///
    /// ## Why it matters
    ///
    /// It is met whatever is built, so that it checks nothing: probably a slip of the
    /// unit.
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

/// A precision or an error of more than this share of the stroke, or of the workspace, asks nothing of a nanopositioner.
const LOOSEST: f64 = 0.05;

/// What the platform is for is finer than a twentieth of its stroke.
fn ask_something(facts: &Facts, found: &mut Found) {
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
            format!("`{key}` is {} {unit}, of {of} of {} {unit}", figure(limit * scale), figure(whole * scale)),
            if about == 0 {
                "whatever is built meets that: check the unit, nm or um"
            } else {
                "whatever is built meets that: check the unit, nrad, urad or mrad"
            },
        );
    }
}

/// A limit at a frequency is about a motion that the platform can make.
fn frequencies(facts: &Facts, found: &mut Found) {
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    for (index, limit) in facts.model.requirements.tracking.iter().enumerate() {
        let Some(frequency) = limit.frequency.filter(|frequency| *frequency > modes[0]) else { continue };
        found.add(
            PATH_EXCITES,
            &format!("requirements.tracking[{index}].frequency"),
            format!(
                "a limit at {} Hz is above the lowest mode of the platform, {} Hz",
                figure(frequency),
                figure(modes[0])
            ),
            "a tenth of the lowest mode is usual: check the unit of the frequency (Hz or kHz)",
        );
    }
}
