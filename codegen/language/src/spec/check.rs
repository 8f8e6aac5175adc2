//! Checks across several values, without records or long computations.
//!
//! Each check reads the values it needs. If a value is missing or wrong, that has its own finding and the check is
//! skipped (the `?` on `Option`). So one run finds everything.

mod adaptation;
mod assumed;
mod control;
mod electrical;
mod gauges;
mod lint;
mod mechanics;
mod rate;
mod records;
mod robust;
mod structure;
mod target;
mod trajectories;
mod triggers;

use std::path::Path;

use super::findings::Findings;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;

/// A check: `None` if a value that it needs is missing.
type Check = fn(&Fields, &mut Findings) -> Option<()>;

const CHECKS: &[Check] = &[
    mechanics::mass_centers_inside_leg,
    mechanics::leg_gyration,
    mechanics::platform_inertia,
    mechanics::platform_gyration,
    mechanics::legs_have_length,
    mechanics::geometry_holds,
    electrical::limits_in_order,
    electrical::voltage_inside_dac,
    electrical::slew_moves_a_code,
    electrical::stroke_fits_gain,
    electrical::resonance_below_tick_rate,
    electrical::sensor_fits,
    target::scalar_fits_fpu,
    target::budget_in_bytes,
    target::budget_fits_part,
    adaptation::alternatives,
    adaptation::weights_for_mode,
    adaptation::bandwidths_fit_period,
    adaptation::gain_ratio_in_order,
    control::parts_need_it,
    control::no_leg_keys,
    control::both_bandwidths,
    control::notch,
    control::small_correction,
    control::cutoff_below_tick_rate,
    control::environment_for_model,
    control::bias_inside_workspace,
    rate::keys_of_option,
    rate::creep_lists,
    rate::model_without_rate,
    rate::dead_time_of_legs,
    gauges::six,
    gauges::directions,
    gauges::not_angles,
    gauges::calibrated_alike,
    gauges::input_of_calibrated,
    robust::ranges_in_order,
    structure::participations,
    structure::differ,
    structure::not_too_many,
    lint::reasons,
    assumed::values,
    trajectories::keys_of_kind,
    trajectories::names_differ,
    trajectories::limits,
    trajectories::not_too_many,
    triggers::keys_of_kind,
    triggers::names_differ,
    triggers::inside_workspace,
    triggers::not_too_many,
];

/// Runs every check. `dir` is the folder that records are relative to.
pub(super) fn all(fields: &Fields, dir: &Path, findings: &mut Findings) {
    for check in CHECKS {
        // `None`: a value is missing, which is already reported.
        let _ = check(fields, findings);
    }
    let _ = records::readable(fields, dir, findings);
}

/// The checks of the lines of one leg.
pub(super) fn of_leg(fields: &Fields, findings: &mut Findings) {
    for check in [rate::keys_of_option as Check, rate::creep_lists] {
        let _ = check(fields, findings);
    }
}

/// Reports [`codes::WRONG_ORDER`] unless the first value of `path` is below the second, or equal if that is permitted.
fn in_order(fields: &Fields, findings: &mut Findings, path: &str, equal_allowed: bool) -> Option<()> {
    let [low, high] = fields.list::<2>(path)?;
    if high > low || (equal_allowed && high >= low) {
        return Some(());
    }
    let message = format!("`{path}` has its values in the wrong order: the first value must be the smaller one");
    let name = path.rsplit('.').next().unwrap_or(path);
    let turned = match [0, 1].map(|item| fields.literal(path, item)) {
        [Some(first), Some(second)] if low > high => Some(format!("[{second}, {first}]")),
        _ => None,
    };
    let template = super::keys::key(path).map_or_else(String::new, super::keys::Key::template);
    let value = turned.as_ref().unwrap_or(&template);
    let help = format!("write the smaller value first: {name} = {value}");
    findings.add(codes::WRONG_ORDER, path, fields.span(path), message, help);
    findings.replace_by(path, turned);
    Some(())
}
