//! Findings about a platform that is unstable, or has small margins.

use core::f64::consts::{PI, TAU};

use super::closed_loop::{ClosedLoop, Conditions};
use super::damping::ActiveDamping;
use super::law::{LoopKind, Tuning};
use super::margins::ModeMargins;
use super::search::largest_stable;
use super::structure::{Corners, StructureDemand};
use super::{LARGEST_RADIUS, damping, nominal_conditions, notch, worst_radius};
use specgen_language::diagnostic::{Code, Diagnostic, codes};
use specgen_language::model::{Model, TaskSpace};
use specgen_runtime::{ControlMode, Law};

/// Lowest factor checked.
const LOWEST: f64 = 1e-4;
/// Suggested value over the largest stable one.
const SLACK: f64 = 0.95;
/// A gain margin below this causes a warning.
const THIN_GAIN: f64 = 1.5;
/// A delay margin below this, in ticks, causes a warning.
const THIN_DELAY: f64 = 0.5;
/// Active damping is ineffective if a mode's compliance exceeds the target this many times.
const MOST_COMPLIANT: f64 = 1.3;
/// Active damping is too strong if |S| exceeds this.
const MOST_SENSITIVE: f64 = 2.2;

/// A platform that [`super::ModalBasis`] refuses.
pub(super) fn no_modes(model: &Model) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["geometry"],
        codes::NO_MODES,
        "the platform does not have six modes on its legs: its mass matrix or K = Jᵀ k_a J at rest is not positive definite"
            .to_owned(),
        "check [geometry] (six legs that constrain every direction), the masses and inertias, and actuator.axial_stiffness"
            .to_owned(),
    )
}

/// Refuses unstable control modes. If smaller values are stable, each finding suggests some; a spec with all of them is accepted.
pub(super) fn check(
    model: &Model,
    task: &TaskSpace,
    corners: &Corners,
    combined: &Tuning,
    position: &Tuning,
) -> Result<(), Vec<Diagnostic>> {
    let closed_loop = corners.closed_loop();
    let conditions = nominal_conditions(closed_loop, model.adaptation.gain_ratio);
    let case = Case { model, corners, closed_loop, conditions: &conditions };
    if let Some(found) = case.interaction() {
        return Err(vec![found]);
    }
    let [estimates, both, alone] = [LoopKind::Estimates, LoopKind::Combined, LoopKind::Position].map(LoopKind::modes);
    let mut findings = Vec::new();
    let mut bandwidths = 1.0;
    if let Some(unstable) = case.unstable(&estimates, combined) {
        let largest = case.largest(&estimates, |factor| combined.scaled(1.0, factor));
        bandwidths = largest.unwrap_or(LOWEST);
        findings.push(case.bandwidths(task, unstable, combined, largest));
    }
    // Gains are checked together with accepted bandwidths, or with the suggested ones.
    let beside = combined.scaled(1.0, bandwidths);
    let judged = task.gains.is_some() || findings.is_empty();
    if let Some(unstable) = case.unstable(&both, &beside).filter(|_| judged) {
        let largest = case.largest(&both, |factor| beside.scaled(factor, 1.0));
        findings.push(case.gains("gains", task.gains.is_some(), unstable, &beside, largest));
    }
    if let Some(unstable) = case.unstable(&alone, position) {
        let largest = case.largest(&alone, |factor| position.scaled(factor, 1.0));
        findings.push(case.gains("position_gains", task.position_gains.is_some(), unstable, position, largest));
    }
    if findings.is_empty() { Ok(()) } else { Err(findings) }
}

/// Least ratio of `robust.structure.f0` to the platform's lowest mode: a lower structural mode would make every law unstable.
const LEAST_FROM: f64 = 1.6;

/// Refuses a range of structural modes that begins too close to the modes of the platform.
pub(super) fn too_low(model: &Model, closed_loop: &ClosedLoop, demand: &StructureDemand) -> Option<Diagnostic> {
    let lowest = closed_loop.basis.frequencies[0] / TAU;
    let least = libm::ceil(LEAST_FROM * lowest);
    (demand.from < LEAST_FROM * lowest).then(|| {
        let (from, times) = (&demand.from, demand.from / lowest);
        Diagnostic::at(
            &model.spans,
            &["robust.structure.f0", "robust.structure"],
            codes::STRUCTURE_TOO_LOW,
            format!(
                "f0 is {from:.0} Hz, {times:.2} times the lowest mode of the platform, {lowest:.0} Hz; expected at least {LEAST_FROM} times"
            ),
            format!(
                "f0 = \"{least:.0} Hz\" or more; list a mode below that as [[mode]], if it is known, or raise its frequency"
            ),
        )
    })
}

/// Warns about a stored design that was made from other values.
pub(super) fn stale(model: &Model) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["control.design.digest", "control.design", "control"],
        codes::DESIGN_STALE,
        "the stored design was made from other values than those of this spec, so it is not used".to_owned(),
        "run `specgen design` on this spec; or remove [control.design]".to_owned(),
    )
}

/// Why a control mode is refused.
struct Unstable {
    code: Code,
    message: String,
}

struct Case<'a> {
    model: &'a Model,
    corners: &'a Corners,
    closed_loop: &'a ClosedLoop,
    conditions: &'a [Conditions],
}

impl Case<'_> {
    /// The law with the largest radius, if that is too large; else the one that needs the most damping of a structural mode.
    fn unstable(&self, laws: &[ControlMode], tuning: &Tuning) -> Option<Unstable> {
        let radius = |law: &ControlMode| (*law, worst_radius(self.closed_loop, *law, tuning, self.conditions));
        let worst = laws.iter().map(radius).filter(|(_, radius)| *radius > LARGEST_RADIUS);
        if let Some((law, radius)) = worst.reduce(|worst, one| if one.1 > worst.1 { one } else { worst }) {
            return Some(Unstable { code: codes::UNSTABLE_PLATFORM, message: self.what(law, radius) });
        }
        let closed = laws.iter().filter(|law| LoopKind::of(**law) != LoopKind::Open);
        let found = closed.filter_map(|law| self.corners.most_demanding(*law, tuning).map(|mode| (*law, mode)));
        let (law, mode) = found.reduce(|worst, one| if one.1.needed > worst.1.needed { one } else { worst })?;
        let message = format!(
            "control mode {law} is unstable with a structural mode that may exist: {} (at ±10 % of stiffness and gain, ±30 % of the \
             amplifier's lag, one tick more)",
            mode.describe()
        );
        Some(Unstable { code: codes::STRUCTURE_UNSTABLE, message })
    }

    fn is_stable(&self, laws: &[ControlMode], tuning: &Tuning) -> bool {
        laws.iter().all(|law| worst_radius(self.closed_loop, *law, tuning, self.conditions) <= LARGEST_RADIUS)
            && laws.iter().all(|law| LoopKind::of(*law) == LoopKind::Open || self.corners.tolerates(*law, tuning))
    }

    fn largest(&self, laws: &[ControlMode], tuning: impl Fn(f64) -> Tuning) -> Option<f64> {
        largest_stable(LOWEST, 1.0, 1.2, |factor| self.is_stable(laws, &tuning(factor)))
            .map(|limit| shown(SLACK * limit))
            .filter(|factor| self.is_stable(laws, &tuning(*factor)))
    }

    fn what(&self, control_mode: ControlMode, radius: f64) -> String {
        let touching = if self.closed_loop.environment == [0.0; 6] { "" } else { ", free or touching the work piece" };
        let [low, high] = self.model.adaptation.gain_ratio;
        let gauges = super::super::gauge_lag_text(self.closed_loop.gauge_lag);
        let (period, first_mode) = (self.closed_loop.period, self.closed_loop.basis.frequencies[0] / TAU);
        let (last_mode, damping) = (self.closed_loop.basis.frequencies[5] / TAU, self.closed_loop.damping[0]);
        let lag = self.closed_loop.lag;
        format!(
            "control mode {control_mode} is unstable on this platform: the loop sampled every {period} s, with modes from {first_mode:.0} Hz to \
             {last_mode:.0} Hz (damping ratio {damping:.3} of the first) and an amplifier lag of {lag} s{gauges}, has spectral radius {radius:.4} \
             somewhere in gain_ratio [{low}, {high}]{touching}; it must be below 1"
        )
    }

    /// Checks the loop that the measured interaction force closes, whatever the gains.
    fn interaction(&self) -> Option<Diagnostic> {
        const BARE: [ControlMode; 1] = [ControlMode::F(Law::Invhys)];
        let radius = worst_radius(self.closed_loop, BARE[0], &Tuning::NONE, self.conditions);
        if radius <= LARGEST_RADIUS {
            return None;
        }
        let stable_with = |factor: f64| {
            let softer = ClosedLoop {
                environment: self.closed_loop.environment.map(|stiffness| stiffness * factor),
                ..self.closed_loop.clone()
            };
            worst_radius(&softer, BARE[0], &Tuning::NONE, self.conditions) <= LARGEST_RADIUS
        };
        let largest = largest_stable(LOWEST, 1.0, 1.2, stable_with)
            .map(|limit| shown(SLACK * limit))
            .filter(|factor| stable_with(*factor));
        let help = match largest {
            Some(factor) => format!(
                "feeding the measured force of the work piece forward closes a loop, which is stable up to {factor} times the \
                 declared stiffness; or set interaction = \"none\" or \"modelled\""
            ),
            None => "no stiffness is stable: check control.modal_damping, timing.period, actuator.axial_stiffness and \
                     amplifier.lag; or set interaction = \"none\" or \"modelled\""
                .to_owned(),
        };
        let keys = ["control.environment.stiffness", "control.interaction", "control.modal_damping", "control"];
        Some(Diagnostic::at(&self.model.spans, &keys, codes::UNSTABLE_PLATFORM, self.what(BARE[0], radius), help))
    }

    fn bandwidths(&self, task: &TaskSpace, unstable: Unstable, tuning: &Tuning, largest: Option<f64>) -> Diagnostic {
        if task.adaptation.is_none() {
            return self.no_tuning(unstable);
        }
        let keys = ["adaptation.level_bandwidth", "adaptation.level_weight", "adaptation"];
        let help = largest.map_or_else(
            || self.nothing_helps(),
            |factor| {
                let drift = if tuning.drift_bandwidth > 0.0 {
                    format!(" with drift_bandwidth = \"{} rad/s\"", shown(tuning.drift_bandwidth * factor))
                } else {
                    String::new()
                };
                format!(
                    "level_bandwidth = \"{} rad/s\"{drift} is stable, {factor} times the given value; a third of that is a \
                     good start; or leave both out, and the compiler chooses them",
                    shown(tuning.level_bandwidth * factor)
                )
            },
        );
        Diagnostic::at(&self.model.spans, &keys, unstable.code, unstable.message, help)
    }

    fn gains(&self, table: &str, given: bool, unstable: Unstable, tuning: &Tuning, largest: Option<f64>) -> Diagnostic {
        if !given {
            return self.no_tuning(unstable);
        }
        let integral = format!("{table}.integral");
        let proportional = format!("{table}.proportional");
        let derivative = format!("{table}.derivative");
        let keys = [integral.as_str(), &proportional, &derivative, table, "control"];
        let help = largest.map_or_else(
            || self.nothing_helps(),
            |factor| {
                let list = |gains: &[f64; 6]| {
                    let shown: Vec<String> = gains.iter().map(|gain| format!("{:e}", shown(gain * factor))).collect();
                    shown.join(", ")
                };
                format!(
                    "all of [{table}] × {factor} is stable: in SI units proportional [{}], integral [{}]{}; a third of \
                     that is a good start; or leave the table out, and the compiler chooses it",
                    list(&tuning.proportional),
                    list(&tuning.integral),
                    if tuning.derivative == [0.0; 6] {
                        String::new()
                    } else {
                        format!(", derivative [{}]", list(&tuning.derivative))
                    }
                )
            },
        );
        Diagnostic::at(&self.model.spans, &keys, unstable.code, unstable.message, help)
    }

    fn no_tuning(&self, unstable: Unstable) -> Diagnostic {
        let message = format!("the tuning rule found no stable values: {}", unstable.message);
        Diagnostic::at(
            &self.model.spans,
            &["control", "timing.period"],
            codes::NO_TUNING,
            message,
            self.nothing_helps(),
        )
    }

    fn nothing_helps(&self) -> String {
        let notch = if self.closed_loop.notch.is_some() { "" } else { "a notch (control.notch_damping), " };
        format!(
            "no smaller value of these alone is stable: a higher [robust.structure] f0 if no mode is below it, {notch}a shorter timing.period, or a machine with more damping \
             or legs whose gains differ less would help; measure control.modal_damping and adaptation.gain_ratio, then correct them"
        )
    }
}

/// Warnings about small margins, one for each group of values, and about modes that the notch cannot cover.
pub(super) fn thin(
    model: &Model,
    task: &TaskSpace,
    closed_loop: &ClosedLoop,
    margins: &[ModeMargins],
) -> Vec<Diagnostic> {
    let mut findings = Vec::new();
    let groups: [(LoopKind, &[&str]); 3] = [
        (LoopKind::Estimates, &["adaptation.level_bandwidth", "adaptation.level_weight", "control"]),
        (LoopKind::Combined, &["gains.integral", "gains.proportional", "gains", "control"]),
        (LoopKind::Position, &["position_gains.integral", "position_gains", "control"]),
    ];
    for (kind, keys) in groups {
        let worst = margins.iter().filter(|one| LoopKind::of(one.law) == kind).find(|one| {
            one.gain_margin.is_some_and(|gain| gain < THIN_GAIN)
                || one.delay_margin_ticks.is_some_and(|delay| delay < THIN_DELAY)
        });
        if let Some(one) = worst {
            let gain = one.gain_margin.filter(|gain| *gain < THIN_GAIN);
            let delay = one.delay_margin_ticks.filter(|delay| *delay < THIN_DELAY);
            let gain = gain.map(|gain| format!("a gain margin of {gain:.2}, below {THIN_GAIN}"));
            let delay = delay.map(|delay| format!("a delay margin of {delay:.2} ticks, below {THIN_DELAY}"));
            let thin: Vec<String> = gain.into_iter().chain(delay).collect();
            let message = format!("control mode {} is stable with {}", one.law, thin.join(" and "));
            let help = "reduce or omit these values: the compiler's own are stable at twice the gain".to_owned();
            findings.push(Diagnostic::at(&model.spans, keys, codes::THIN_MARGIN, message, help));
        }
    }
    let missed: Vec<String> = closed_loop
        .basis
        .frequencies
        .iter()
        .filter(|frequency| !notch::in_reach(**frequency, closed_loop.period))
        .map(|frequency| format!("{:.0} Hz", frequency / TAU))
        .collect();
    if task.notch_damping.is_some() && !missed.is_empty() {
        let (uncovered, half) = (missed.join(", "), PI / closed_loop.period / TAU);
        findings.push(Diagnostic::at(
            &model.spans,
            &["control.notch_damping", "control.notch", "timing.period"],
            codes::MODE_NOT_NOTCHED,
            format!(
                "the notch does not cover the modes at {uncovered}: they are near or above half the tick rate, {half:.0} Hz"
            ),
            "shorten timing.period to cover them; the stability check includes them without the notch".to_owned(),
        ));
    }
    findings
}

/// Warns about modes that active damping does not improve, or leaves with a small margin.
pub(super) fn hardly_damped(model: &Model, closed_loop: &ClosedLoop, found: &ActiveDamping) -> Option<Diagnostic> {
    let left: Vec<String> = closed_loop
        .basis
        .frequencies
        .iter()
        .zip(&found.modes)
        .filter_map(|(frequency, mode)| {
            let hertz = frequency / TAU;
            match mode {
                None => Some(format!("{hertz:.0} Hz (too fast for the period)")),
                Some(mode)
                    if mode.compliance > MOST_COMPLIANT * damping::target(closed_loop, *frequency)
                        || mode.sensitivity[1] > MOST_SENSITIVE =>
                {
                    Some(format!(
                        "{hertz:.0} Hz (compliance peak {:.2} times that without, largest sensitivity {:.2})",
                        mode.compliance, mode.sensitivity[1]
                    ))
                }
                Some(_) => None,
            }
        })
        .collect();
    (!left.is_empty()).then(|| {
        Diagnostic::at(
            &model.spans,
            &["control.active_damping", "control"],
            codes::HARDLY_DAMPED,
            format!("active damping has little effect on the modes at {}", left.join(", ")),
            "shorten timing.period, or use an amplifier with less lag; or disable active damping: active_damping = false"
                .to_owned(),
        )
    })
}

/// Four significant digits, rounded down, so that the number shown is itself accepted.
fn shown(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let scale = libm::pow(10.0, 3.0 - libm::floor(libm::log10(value.abs())));
    libm::floor(value * scale) / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_shown_are_rounded_down() {
        for (value, expected) in [(0.123_49, 0.1234), (98_765.0, 98_760.0), (1.0, 1.0), (0.0, 0.0), (4.2e-7, 4.2e-7)] {
            let found = shown(value);
            assert!((found - expected).abs() <= 1e-12 * expected && found <= value, "{value}: {found}");
        }
    }
}
