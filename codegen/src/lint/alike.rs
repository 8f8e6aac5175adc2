//! Values that come six at a time and are much alike: calibrations of gauges, gains by stiffness, stiffness of a work piece.

use super::{AXES, Facts, Found, figure};
use crate::diagnostic::codes;
use crate::model::Gains;

/// A coefficient of a calibration against the middle one of the six.
const CALIBRATION_SPREAD: f64 = 3.0;
/// A gain over the stiffness of its axis, against the middle one of the six.
const GAIN_SPREAD: f64 = 10.0;
/// Stiffness of a work piece over that of the platform on its legs.
const SOUND_WORK_PIECE: core::ops::RangeInclusive<f64> = 1e-3..=20.0;

/// The middle of six magnitudes.
fn middle(values: [f64; 6]) -> f64 {
    let mut sorted = values.map(f64::abs);
    sorted.sort_by(f64::total_cmp);
    0.5 * (sorted[2] + sorted[3])
}

/// Gauges of one make have calibrations alike.
pub(super) fn calibrations(facts: &Facts, found: &mut Found) {
    let Some(calibration) = facts.model.task_space.as_ref().and_then(|task| task.calibration.as_ref()) else { return };
    // Offset and slope; higher powers differ from gauge to gauge.
    for power in 0..2 {
        let values: [f64; 6] = core::array::from_fn(|k| calibration[k].get(power).copied().unwrap_or(0.0));
        let usual = middle(values);
        let positive = values.iter().filter(|value| **value > 0.0).count();
        for (gauge, value) in values.into_iter().enumerate() {
            let far =
                usual > 0.0 && (value.abs() > CALIBRATION_SPREAD * usual || value.abs() < usual / CALIBRATION_SPREAD);
            let turned = (positive == 5 && value < 0.0) || (positive == 1 && value > 0.0);
            if !far && !turned {
                continue;
            }
            found.warning(
                codes::CALIBRATION_ODD,
                &format!("gauge[{gauge}].calibration[{power}]"),
                format!(
                    "{} of the calibration of gauge {gauge} is {}, while the six have about {}",
                    ["the offset", "the slope"][power],
                    ["um", "um/V"].map(|unit| format!("{} {unit}", figure(value * 1e6)))[power],
                    figure(usual * 1e6)
                ),
                "check its unit and its sign against the other gauges; a wrong sign makes the loop run away",
            );
        }
    }
}

/// Gains go with the stiffness of the axes.
pub(super) fn gains_by_stiffness(facts: &Facts, found: &mut Found) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    let sections: [(&str, Option<&Gains>); 2] =
        [("gains", task.gains.as_ref()), ("position_gains", task.position_gains.as_ref())];
    for (section, gains) in sections {
        let Some(gains) = gains else { continue };
        for (name, values) in
            [("proportional", gains.proportional), ("integral", gains.integral), ("derivative", gains.derivative)]
        {
            let ratios: [f64; 6] = core::array::from_fn(|axis| values[axis] / stiffness[axis]);
            let usual = middle(ratios);
            for (axis, ratio) in ratios.into_iter().enumerate() {
                // Zero switches an axis off.
                if ratio == 0.0 || usual == 0.0 || (1.0 / GAIN_SPREAD..=GAIN_SPREAD).contains(&(ratio / usual)) {
                    continue;
                }
                found.warning(
                    codes::GAIN_UNEVEN,
                    &format!("{section}.{name}[{axis}]"),
                    format!(
                        "the gain of {} is {}: {} times what the other axes have for their stiffness (its own is {})",
                        AXES[axis],
                        figure(values[axis]),
                        figure(ratio / usual),
                        figure(stiffness[axis])
                    ),
                    &format!("about {:.3e} goes with the others: check the unit", usual * stiffness[axis]),
                );
            }
        }
    }
}

/// A work piece that the platform feels, and that does not hold it fast.
pub(super) fn work_piece(facts: &Facts, found: &mut Found) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (axis, value) in task.environment.stiffness.into_iter().enumerate() {
        let ratio = value / stiffness[axis];
        if value == 0.0 || SOUND_WORK_PIECE.contains(&ratio) {
            continue;
        }
        found.warning(
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
