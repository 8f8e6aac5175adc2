//! The work piece that the platform touches.

use super::{AXES, Facts, Findings, amount, figure, times_beyond};

lints! {
    rules: work_piece, lever_of_contact, contact_near_bias;

    /// # W0829: work piece too soft or too stiff
    ///
    /// Along each axis, the stiffness of the work piece should be between a thousandth
    /// and twenty times that of the platform on its legs.
    ///
    /// ## Why it matters
    ///
    /// A softer work piece does not matter in (5). Against a stiffer one the legs
    /// deflect instead of moving the platform.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-environment.toml` with
    ///
    /// ```diff
    /// @@ [control.environment] @@
    /// -stiffness = ["2.4e6 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e3 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// +stiffness = ["5e3 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e3 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check N/m against N/um; 0 means no contact on that axis.
    ///
    /// ```toml
    /// stiffness = ["2.4e6 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e3 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// ```
    WORK_PIECE_ODD = "W0829";

    /// # W0838: lever arm of the contact too long
    ///
    /// Rotational over translational stiffness is a lever arm squared. The lever arm
    /// should be less than three radii of the platform.
    ///
    /// ## Why it matters
    ///
    /// The contact is on the platform, so its lever arm is at most about a radius.
    /// N m/rad and N m/deg differ by a factor of 57.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-environment.toml` with
    ///
    /// ```diff
    /// @@ [control.environment] @@
    /// -stiffness = ["2.4e6 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e3 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// +stiffness = ["2.4e6 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e6 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit of the rotational stiffness.
    ///
    /// ```toml
    /// stiffness = ["2.4e6 N/m", "2.4e6 N/m", "3e6 N/m", "3.8e3 N m/rad", "3.8e3 N m/rad", "0 N m/rad"]
    /// ```
    CONTACT_LEVER = "W0838";

    /// # W0839: contact force beyond the travel of the legs
    ///
    /// At the bias, the force of the work piece, stiffness × (bias − rest) as in (5),
    /// should not deflect the legs by more than their travel.
    ///
    /// ## Why it matters
    ///
    /// The platform cannot move against such a contact. `control.environment.rest` is
    /// the pose at which the work piece is unloaded, relative to the rest pose.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-environment.toml` with
    ///
    /// ```diff
    /// @@ [control.environment] @@
    /// -rest      = ["0 um", "0 um", "10 um", "0 urad", "0 urad", "0 urad"]
    /// +rest      = ["0 um", "0 um", "1 mm", "0 urad", "0 urad", "0 urad"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit of `rest`.
    ///
    /// ```toml
    /// rest      = ["0 um", "0 um", "10 um", "0 urad", "0 urad", "0 urad"]
    /// ```
    CONTACT_FAR = "W0839";
}

/// Stiffness of a work piece over that of the platform on its legs.
const SOUND_WORK_PIECE: core::ops::RangeInclusive<f64> = 1e-3..=20.0;
/// Longest lever arm of a contact, in radii of the platform's joints.
const LONGEST_LEVER: f64 = 3.0;

/// Checks the stiffness of the work piece against that of the platform.
fn work_piece(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (axis, value) in task.environment.stiffness.into_iter().enumerate() {
        let ratio = value / stiffness[axis];
        if value == 0.0 || SOUND_WORK_PIECE.contains(&ratio) {
            continue;
        }
        let (name, times, part, platform) = (AXES[axis], figure(ratio), figure(value), figure(stiffness[axis]));
        found.add_off(
            times_beyond(ratio, &SOUND_WORK_PIECE),
            WORK_PIECE_ODD,
            &format!("control.environment.stiffness[{axis}]"),
            format!(
                "along {name} the work piece is {times} times as stiff as the platform on its legs ({part} against {platform})"
            ),
            "too soft to matter or too stiff to move against: check the unit (N/m or N/um, N m/rad); 0 means no contact on that axis",
        );
    }
}

/// Checks rotational against translational stiffness of the contact.
fn lever_of_contact(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let stiffness = task.environment.stiffness;
    let radius = facts.model.geometry.joint_radius();
    let along = stiffness[..3].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
    if along == 0.0 {
        return;
    }
    for axis in 3..6 {
        let lever = libm::sqrt(stiffness[axis] / along);
        if lever <= LONGEST_LEVER * radius {
            continue;
        }
        let (angular, name, linear, arm) = (figure(stiffness[axis]), AXES[axis], figure(along), figure(lever * 1e3));
        let joints = figure(radius * 1e3);
        found.add(
            CONTACT_LEVER,
            &format!("control.environment.stiffness[{axis}]"),
            format!(
                "{angular} N m/rad about {name} with {linear} N/m means a lever arm of {arm} mm, but the platform's joints are only {joints} mm from its axis"
            ),
            "the rotational stiffness of a contact is its translational stiffness times the lever arm squared: check the units of `control.environment.stiffness`, N/m and N m/rad",
        );
    }
}

/// Checks the contact force at the bias against the travel of the legs.
fn contact_near_bias(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    let environment = &task.environment;
    for axis in 0..6 {
        let pressed = libm::fabs(task.setpoint.bias[axis] - environment.rest[axis]);
        let force = environment.stiffness[axis] * pressed;
        let (gives, reach) = (force / stiffness[axis], 0.5 * facts.model.actuator.stroke / legs.steepest(axis));
        if gives <= reach {
            continue;
        }
        found.add(
            CONTACT_FAR,
            &format!("control.environment.rest[{axis}]"),
            format!(
                "at the bias the work piece pushes with {} {} along {}: that deflects the platform by {}, but it can only move by {}",
                                figure(force),
                                if axis < 3 { "N" } else { "N m" },
                                AXES[axis],
                                amount(axis, gives),
                amount(axis, reach)
            ),
            "`control.environment.rest` is the pose at which the work piece is unloaded, relative to the rest pose: check its unit, and `control.environment.stiffness`",
        );
    }
}
