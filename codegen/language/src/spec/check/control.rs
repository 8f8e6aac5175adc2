//! The task-space controller: its own values, and keys that need it or exclude it.

use std::f64::consts::PI;

use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model::CORRECTION_SHARE;
use crate::spec::findings::Findings;
use crate::spec::keys;
use crate::spec::text::number;

/// `Some` in a spec with `[control]`.
pub(super) fn there(f: &Fields) -> Option<()> {
    f.table("control").map(|_| ())
}

/// Sections that would have no effect without `[control]`.
pub(super) fn parts_need_it(f: &Fields, findings: &mut Findings) -> Option<()> {
    if there(f).is_some() {
        return Some(());
    }
    let tables = ["gauge[0]", "trajectory[0]", "trigger[0]", "mode[0]", "robust.structure"];
    let parts = tables.iter().filter_map(|path| Some((*path, f.table(path)?)));
    let keys = ["actuator.cross_talk", "sensor.calibration"];
    let keys = keys.into_iter().filter(|key| f.given(key)).map(|key| (key, f.span(key)));
    for (path, span) in parts.chain(keys) {
        let what = path.split('[').next().unwrap_or(path);
        findings.add(
            codes::WITHOUT_CONTROL,
            path,
            span,
            format!("`{what}` is for the task-space controller, but there is no section [control]"),
            "write [control] with modal_damping = <number> and six sections [[gauge]], or take this out".to_owned(),
        );
    }
    for section in ["gains", "position_gains"] {
        if let Some(span) = f.table(section) {
            findings.add(
                codes::GAINS_UNUSED,
                section,
                span,
                format!("[{section}] has no effect without [control]: the leg feed-forward has no feedback"),
                "write [control] for the task-space controller, or take the gains out".to_owned(),
            );
        }
    }
    Some(())
}

/// Weights per run, runs of several ticks and leg set-points belong to the leg feed-forward.
pub(super) fn no_leg_keys(f: &Fields, findings: &mut Findings) -> Option<()> {
    there(f)?;
    let mut refuse = |path: &str, why: &str, fix: &str| {
        findings.add(
            codes::LEG_KEY_WITH_CONTROL,
            path,
            f.span(path),
            format!("`{path}` cannot be used with [control]: {why}"),
            fix.to_owned(),
        );
    };
    for which in ["level", "drift"] {
        let path = format!("adaptation.{which}_weight");
        if f.given(&path) {
            refuse(
                &path,
                "per-run weights change behaviour when the period changes",
                &format!("write {which}_bandwidth in rad/s, or leave both bandwidths to the compiler"),
            );
        }
    }
    if f.integer("adaptation.run_interval").is_some_and(|ticks| ticks != 1) {
        refuse(
            "adaptation.run_interval",
            "the task-space controller adapts in every tick",
            "remove it; a smaller bandwidth has the effect of a longer run",
        );
    }
    if f.choice("controller.setpoint") == Some("leg") {
        refuse(
            "controller.setpoint",
            "its set-point is a pose",
            "write setpoint = \"pose\", or take [control] out for a leg feed-forward",
        );
    }
    Some(())
}

pub(super) fn both_bandwidths(f: &Fields, findings: &mut Findings) -> Option<()> {
    there(f)?;
    let (level, drift) = ("adaptation.level_bandwidth", "adaptation.drift_bandwidth");
    let (given, missing) = match (f.given(level), f.given(drift)) {
        (true, false) => (level, drift),
        (false, true) => (drift, level),
        _ => return Some(()),
    };
    if findings.mentions(&[missing]) {
        return Some(());
    }
    findings.add(
        codes::ALTERNATIVES,
        given,
        f.span(given),
        format!("`{given}` is given without `{missing}`: the adaptation can be changed at run time and needs both"),
        format!(
            "write {} = \"<number> rad/s\", too, or remove this: the compiler then derives both",
            missing.trim_start_matches("adaptation.")
        ),
    );
    Some(())
}

pub(super) fn notch(f: &Fields, findings: &mut Findings) -> Option<()> {
    there(f)?;
    let path = "control.active_damping";
    if f.flag(path)? && !f.flag("control.notch")? {
        findings.add(
            codes::ALTERNATIVES,
            path,
            f.span(path),
            format!(
                "`{path}` cannot be used with notch = false: it is designed together with the notch, in modal coordinates"
            ),
            "remove one of the two".to_owned(),
        );
    }
    let path = "control.notch_damping";
    let damping = f.number(path)?;
    if !f.flag("control.notch")? {
        findings.add(
            codes::ALTERNATIVES,
            path,
            f.span(path),
            format!("`{path}` cannot be used with notch = false: there is no notch"),
            "remove one of the two".to_owned(),
        );
        return Some(());
    }
    let own = f.number("control.modal_damping")?;
    if damping <= own {
        findings.add(
            codes::NOTCH_DAMPING,
            path,
            f.span(path),
            format!("`{path}` is {}, expected more than `control.modal_damping`, {}", number(damping), number(own)),
            "remove notch_damping: the default is 1; or remove the notch with notch = false".to_owned(),
        );
    }
    Some(())
}

/// A correction is a small part of the legs' stroke: larger motions belong in the set-points.
pub(super) fn small_correction(f: &Fields, findings: &mut Findings) -> Option<()> {
    there(f)?;
    let path = "control.correction";
    let (most, stroke) = (f.number(path)?, f.number("actuator.stroke")?);
    let limit = CORRECTION_SHARE * stroke;
    if most > limit * (1.0 + 1e-9) {
        findings.add(
            codes::CORRECTION_TOO_LARGE,
            path,
            f.span(path),
            format!("`{path}` is {} m, above a tenth of `actuator.stroke`, {} m", number(most), number(limit)),
            format!("write correction = \"{} um\" or less", number(libm::floor(limit * 1e8) / 1e2)),
        );
    }
    Some(())
}

pub(super) fn cutoff_below_tick_rate(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "control.velocity_cutoff";
    let (cutoff, limit) = (f.number(path)?, PI / f.number("timing.period")?);
    if cutoff >= limit {
        let [given, most] = [cutoff, limit].map(number);
        findings.add(
            codes::CUTOFF_TOO_HIGH,
            path,
            f.span(path),
            format!("`{path}` is {given} rad/s, expected less than half the tick rate, {most} rad/s"),
            format!("write \"{} rad/s\" or less, or shorten `timing.period`", number(0.6 * limit)),
        );
    }
    Some(())
}

pub(super) fn environment_for_model(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "control.interaction";
    if f.choice(path)? == "modelled" && f.table("control.environment").is_none() {
        findings.add(
            codes::MISSING_SECTION,
            "control.environment",
            f.span(path),
            "interaction = \"modelled\" needs the stiffness in section [control.environment]".to_owned(),
            format!(
                "write interaction = \"none\", or the section:\n{}",
                keys::section("control.environment")
                    .map_or_else(String::new, |section| section.template().trim_end().to_owned())
            ),
        );
    }
    Some(())
}

pub(super) fn bias_inside_workspace(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "control.setpoint.bias";
    let bias = f.list::<6>(path)?;
    let bounds = [f.list::<3>("workspace.translation"), f.list::<3>("workspace.rotation")];
    for (axis, value) in bias.into_iter().enumerate() {
        let Some(bound) = bounds[axis / 3].map(|bounds| bounds[axis % 3]) else {
            continue;
        };
        if value.abs() <= bound {
            continue;
        }
        let (unit, scale) = if axis < 3 { ("um", 1e6) } else { ("urad", 1e6) };
        let [bias, workspace] = [value * scale, bound * scale].map(number);
        findings.add(
            codes::BIAS_OUTSIDE,
            &format!("{path}[{axis}]"),
            f.item_span(path, axis),
            format!(
                "the bias of {bias} {unit} is outside the workspace of {workspace} {unit} on this axis"
            ),
            format!(
                "the workspace counts from rest, including the bias: widen `workspace.{}` or reduce the bias; check the units of both",
                if axis < 3 { "translation" } else { "rotation" }
            ),
        );
    }
    Some(())
}
