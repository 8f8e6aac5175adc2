//! The work piece that the platform touches.

use super::{AXES, Facts, Found, amount, figure, times_beyond};
use specgen_language::diagnostic::codes;

/// Stiffness of a work piece over that of the platform on its legs.
const SOUND_WORK_PIECE: core::ops::RangeInclusive<f64> = 1e-3..=20.0;
/// Lever over which a contact makes its stiffness of turning, in radii of the platform's joints.
const LONGEST_LEVER: f64 = 3.0;

/// A work piece that the platform feels, and that does not hold it fast.
pub(super) fn work_piece(facts: &Facts, found: &mut Found) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (axis, value) in task.environment.stiffness.into_iter().enumerate() {
        let ratio = value / stiffness[axis];
        if value == 0.0 || SOUND_WORK_PIECE.contains(&ratio) {
            continue;
        }
        found.add_off(
            times_beyond(ratio, &SOUND_WORK_PIECE),
            codes::WORK_PIECE_ODD,
            &format!("control.environment.stiffness[{axis}]"),
            format!(
                "along {} the work piece is {} times as stiff as the platform on its legs ({} against {})",
                AXES[axis],
                figure(ratio),
                figure(value),
                figure(stiffness[axis])
            ),
            "too soft to matter or too stiff to move against: check the unit (N/m or N/um, N m/rad); 0 means no contact on that axis",
        );
    }
}

/// A contact resists turning by its stiffness over a lever, and the lever is one of the platform's size.
pub(super) fn lever_of_contact(facts: &Facts, found: &mut Found) {
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
        found.add(
            codes::CONTACT_LEVER,
            &format!("control.environment.stiffness[{axis}]"),
            format!(
                "{} N m/rad about {} beside {} N/m is a lever of {} mm, on a platform whose joints are {} mm from the middle",
                figure(stiffness[axis]),
                AXES[axis],
                figure(along),
                figure(lever * 1e3),
                figure(radius * 1e3)
            ),
            "a contact turns with its stiffness times a lever squared: check the units of `control.environment.stiffness`, N/m and N m/rad",
        );
    }
}

/// At the bias the work piece does not press the platform further than its legs reach.
pub(super) fn contact_near_bias(facts: &Facts, found: &mut Found) {
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
            codes::CONTACT_FAR,
            &format!("control.environment.rest[{axis}]"),
            format!(
                "at the bias the work piece presses along {} with {} {}: that bends the legs by {}, and they reach {}",
                AXES[axis],
                figure(force),
                if axis < 3 { "N" } else { "N m" },
                amount(axis, gives),
                amount(axis, reach)
            ),
            "`control.environment.rest` is the pose at which the work piece is unloaded, from rest: check its unit, and `control.environment.stiffness`",
        );
    }
}
