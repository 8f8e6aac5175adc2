//! Lowers the supervisor: times to ticks and samples, bounds to SI; refuses values that cannot work.

pub(crate) mod defaults;
mod rest;
pub(crate) mod samples;
pub(crate) mod steadiness;
mod wiring;

pub(crate) use steadiness::LOWEST as LOWEST_SWING;
pub use wiring::{describe as describe_wiring, single_faults};

use super::kinematics::inverse_jacobian;
use super::sensing::{PoseNoise, pose_noise, readings_per_pose};
use crate::figure::{AXES, figure};
use crate::ir::{Actuation, Hysteresis, Scalar, Sensing, Supervision};
use specgen_language::diagnostic::{Code, Diagnostic, codes};
use specgen_language::model::{FaultAction, Model};
use specgen_numerics::multiply6;
use specgen_runtime::supervisor::{self, Reaction, WRONG};

/// Gauges are checked in turn, one per tick.
const CHANNELS: f64 = 6.0;
/// Fewest samples for a fault of a gauge.
const FEWEST_SAMPLES: f64 = 2.0;
/// Least bound over the rms noise: noise alone exceeds it once in 10^15 samples.
const NOISE_MARGIN: f64 = 8.0;
/// Largest `supervisor.tracking_error` that a spec may declare.
const LARGEST_SHARE: f64 = 10.0;
/// Fewest steps of the converter by which a working gauge must move.
const FEWEST_STEPS: f64 = 2.0;
/// Reading of each gauge per leg displacement if each leg has its own gauge.
const OWN_GAUGES: [[f64; 6]; 6] = {
    let mut rows = [[0.0; 6]; 6];
    let mut leg = 0;
    while leg < 6 {
        rows[leg][leg] = 1.0;
        leg += 1;
    }
    rows
};
/// Missed ticks are counted over this time, s.
const MISSED_WINDOW: f64 = 1.0;

/// Every constant of the supervisor. `rings`: longest decay time constant of the modes of platform or legs, s.
///
/// # Errors
/// A time too short to detect anything, a bound below the noise, a ramp faster than the slew rate.
pub(super) fn lower(
    model: &Model,
    hysteresis: &Hysteresis,
    actuation: &Actuation,
    max_step: i32,
    sensing: Option<&Sensing>,
    rings: f64,
    scalar: Scalar,
) -> Result<Supervision, Vec<Diagnostic>> {
    let spec = &model.supervisor;
    let period = model.timing.period;
    let noise = pose_noise(model)?;
    let mut findings = Vec::new();
    let mut times = Times { model, findings: &mut findings };
    let arm_ticks = times.ticks("arm_time", spec.arm_time, defaults::ARM_TIME);
    let gauge = times.ticks("gauge_time", spec.gauge_time, defaults::GAUGE_TIME).saturating_mul(WRONG);
    let voltage = times.ticks("voltage_time", spec.voltage_time, defaults::VOLTAGE_TIME);
    let slew = times.ticks("slew_time", spec.slew_time, defaults::SLEW_TIME);
    let stuck_samples = times.samples("stuck_time", spec.stuck_time, defaults::STUCK_TIME);
    let disagreement_samples = times.samples("disagreement_time", spec.disagreement_time, defaults::DISAGREEMENT_TIME);
    let tracking_samples = times.samples("tracking_time", spec.tracking_time, defaults::TRACKING_TIME);
    let [host_ticks, host_gone] = times.host_lost();
    let window = whole(MISSED_WINDOW / period);
    let missed = window.saturating_mul(spec.missed_ticks - 1).saturating_add(1);

    let (stuck_motion, disagreement) = gauge_bounds(model, &mut findings);
    let tracking = tracking(model, noise.as_ref(), &mut findings);
    let (ramp_step, ramp_every) = ramp(model, actuation, max_step, &mut findings);
    let readings_per_leg = match (readings_per_pose(model)?, inverse_jacobian(&model.geometry)) {
        (Some(gauges), Some(legs)) => Some(multiply6(&gauges, &legs)),
        _ => None,
    };
    let rest = rest::code(model, actuation);
    findings.extend(rest::beyond(model));
    let readings = readings_per_leg.unwrap_or(OWN_GAUGES);
    let leap = samples::leap(model, &readings, sensing, &mut findings);
    let steadiness = steadiness::lower(model, noise.as_ref(), rings, scalar, &mut findings);
    let wiring = wiring::lower(model, hysteresis, actuation, max_step, &readings, scalar, &mut findings);
    if !findings.is_empty() {
        return Err(findings);
    }
    let round = |value: f64| scalar.round(value);
    Ok(Supervision {
        constants: supervisor::Supervision {
            arm_ticks,
            rest,
            ramp_step,
            ramp_every,
            timeout: [gauge, gauge, voltage, slew, missed, gauge, host_gone],
            weight: [WRONG, WRONG, 1, 1, window, WRONG, 1],
            stuck_motion: round(stuck_motion),
            stuck_samples,
            disagreement: round(disagreement),
            disagreement_samples,
            tracking: tracking.map(round),
            tracking_samples,
            leap: leap.map(round),
            repeats: samples::repeats(model),
            steadiness,
            amplifier_fault: match spec.amplifier_fault {
                FaultAction::Off => Reaction::Off,
                FaultAction::RampDown => Reaction::RampDown,
                FaultAction::Hold => Reaction::Hold,
            },
            wiring: None,
        },
        risen: rest::risen(rest, hysteresis, actuation, scalar),
        host_ticks,
        stall_ticks: spec.missed_in_a_row,
        wiring,
        readings_per_leg: readings_per_leg.map(|rows| rows.map(|row| row.map(round))),
        approach_keep: round(libm::exp(-1.0 / f64::from(arm_ticks))),
    })
}

/// Times as ticks and samples.
struct Times<'a> {
    model: &'a Model,
    findings: &'a mut Vec<Diagnostic>,
}

impl Times<'_> {
    fn ticks(&mut self, key: &str, given: Option<f64>, otherwise: f64) -> u32 {
        self.counted(key, given, otherwise, 1.0, 1.0)
    }

    fn samples(&mut self, key: &str, given: Option<f64>, otherwise: f64) -> u32 {
        self.counted(key, given, otherwise, CHANNELS, FEWEST_SAMPLES)
    }

    /// Ticks of silence after which the machine holds, and further ones after which it ramps down.
    fn host_lost(&mut self) -> [u32; 2] {
        let given = self.model.supervisor.host_lost;
        let [hold, down] = given.unwrap_or(defaults::HOST_LOST);
        let hold_ticks = self.ticks("host_lost", None, hold);
        let least = 1 + hold_ticks;
        let mut down_ticks = self.ticks("host_lost", None, down);
        let period = self.model.timing.period;
        if down_ticks < least || hold < period * (1.0 - 1e-9) {
            down_ticks = if down_ticks < least { least } else { down_ticks };
            if given.is_some() {
                let [hold, down, least_hold, least_down] =
                    [hold, down, f64::from(hold_ticks) * period, f64::from(down_ticks) * period].map(|time| time * 1e3);
                self.findings.push(finding(
                    self.model,
                    codes::SUPERVISOR_TIME,
                    "host_lost",
                    format!(
                        "the machine would hold after {hold:.6} ms without a host and ramp down after {down:.6} ms: the first must be at least a \
                         period, the second longer"
                    ),
                    format!(
                        "leave host_lost out: the default is [\"{} ms\", \"{} ms\"]; it must be at least [\"{least_hold:.6} ms\", \"{least_down:.6} ms\"]",
                        figure(defaults::HOST_LOST[0] * 1e3),
                        figure(defaults::HOST_LOST[1] * 1e3)
                    ),
                ));
            }
        }
        [hold_ticks, (down_ticks - hold_ticks).saturating_add(1)]
    }

    /// Number of checks within a time, with one check every `every` ticks. A time from the spec must allow at least
    /// `fewest` checks.
    fn counted(&mut self, key: &str, given: Option<f64>, otherwise: f64, every: f64, fewest: f64) -> u32 {
        let between = every * self.model.timing.period;
        let least = fewest * between;
        if let Some(time) = given
            && time < least * (1.0 - 1e-9)
        {
            let (usual, milliseconds) = (figure(otherwise.max(least) * 1e3), least * 1e3);
            let (given, detection, period) = (time * 1e3, least * 1e3, self.model.timing.period * 1e3);
            self.findings.push(finding(
                self.model,
                codes::SUPERVISOR_TIME,
                key,
                format!(
                    "`supervisor.{key}` is {given:.6} ms, but detection takes {detection:.6} ms at a period of {period:.6} ms"
                ),
                format!(
                    "leave {key} out: the default is {usual} ms; it must be at least {milliseconds:.6} ms, or shorten timing.period"
                ),
            ));
        }
        let time = given.unwrap_or(otherwise);
        let count = whole(libm::ceil(time / between - 1e-9));
        let fewest = whole(fewest);
        if count < fewest { fewest } else { count }
    }
}

/// `supervisor.stuck_motion` and `supervisor.disagreement`, m.
fn gauge_bounds(model: &Model, findings: &mut Vec<Diagnostic>) -> (f64, f64) {
    let spec = &model.supervisor;
    let step = model.sensor.step();
    let noise = model.sensor.noise;
    let stuck_motion = spec.stuck_motion.unwrap_or_else(|| defaults::stuck_motion(model, step));
    let least = FEWEST_STEPS * step;
    if stuck_motion < least * (1.0 - 1e-9) {
        let (given, code) = (stuck_motion * 1e9, step * 1e9);
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "stuck_motion",
            format!(
                "`supervisor.stuck_motion` is {given:.4} nm, but a step of the gauge's converter is {code:.4} nm: a working gauge may not resolve it"
            ),
            format!("write stuck_motion = \"{:.4} nm\" or more", above(least * 1e9)),
        ));
    }
    let disagreement = spec.disagreement.unwrap_or_else(|| defaults::disagreement(model));
    let least = NOISE_MARGIN * noise + step;
    if disagreement < least {
        let (write, fifth) = (above(least * 1e9), defaults::disagreement(model) * 1e6);
        let (given, effect) = (disagreement * 1e9, least * 1e9);
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "disagreement",
            format!(
                "a disagreement of {given:.4} nm is less than the effect of the gauge's noise and converter, {effect:.4} nm"
            ),
            format!(
                "write disagreement = \"{write:.4} nm\" or more; a fifth of the stroke is {fifth:.4} um"
            ),
        ));
    }
    (stuck_motion, disagreement)
}

/// Bound of each axis, or of each leg.
fn tracking(model: &Model, noise: Option<&PoseNoise>, findings: &mut Vec<Diagnostic>) -> [f64; 6] {
    let share = model.supervisor.tracking_error;
    let (full, noise) = match noise {
        Some(noise) => (model.workspace.bounds(), noise.pose),
        None => ([model.actuator.stroke; 6], [model.sensor.noise; 6]),
    };
    let needed: [f64; 6] = core::array::from_fn(|axis| NOISE_MARGIN * noise[axis] / full[axis]);
    let worst = (0..6).fold(0, |worst, axis| if needed[axis] > needed[worst] { axis } else { worst });
    let least = needed[worst];
    if share < least && least > LARGEST_SHARE {
        findings.push(no_range(model, worst, full[worst], NOISE_MARGIN * noise[worst]));
    } else if share < least {
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "tracking_error",
            format!(
                "a tracking error of {share} of the range is less than the effect of the gauges' noise on one axis, {least:.6}"
            ),
            format!("write tracking_error = {:.6} or more; the default is 0.2", above(least)),
        ));
    }
    full.map(|full| share * full)
}

/// The finding about an axis, or a leg, whose noise alone exceeds the largest share of its range that may be declared.
fn no_range(model: &Model, axis: usize, full: f64, noise: f64) -> Diagnostic {
    let share = model.supervisor.tracking_error;
    if model.task_space.is_none() {
        return Diagnostic::at(
            &model.spans,
            &["sensor.noise", "sensor"],
            codes::SUPERVISOR_BOUND,
            format!("the gauges' noise amounts to {:.4} um at a leg whose stroke is {:.4} um", noise * 1e6, full * 1e6),
            format!("write noise = \"{:.4} nm\" or less", share * full / NOISE_MARGIN * 1e9 * 0.999),
        );
    }
    let (table, item, unit) =
        if axis < 3 { ("workspace.translation", axis, "um") } else { ("workspace.rotation", axis - 3, "urad") };
    let (amounts, name, range) = (noise * 1e6, AXES[axis], full * 1e6);
    let message =
        format!("the gauges' noise amounts to {amounts:.4} {unit} of {name}, whose range is only {range:.4} {unit}");
    let help = format!(
        "write at least {:.4} {unit} there, so that a tracking error of {share} of the range is above the noise",
        above(noise / share * 1e6)
    );
    Diagnostic::at(
        &model.spans,
        &[&format!("{table}[{item}]"), table, "workspace"],
        codes::SUPERVISOR_BOUND,
        message,
        help,
    )
}

/// Codes of a step, and ticks between steps: not faster than requested.
fn ramp(model: &Model, actuation: &Actuation, max_step: i32, findings: &mut Vec<Diagnostic>) -> (i32, u32) {
    let slew_rate = model.actuator.slew_rate;
    let rate = model.supervisor.ramp_rate.unwrap_or_else(|| defaults::ramp_rate(model));
    if rate > slew_rate {
        findings.push(finding(
            model,
            codes::SUPERVISOR_RAMP,
            "ramp_rate",
            format!("voltages would ramp down at {} V/s, faster than actuator.slew_rate, {} V/s", rate, slew_rate),
            format!(
                "leave ramp_rate out: the default is {} V/s; it must be at most {slew_rate} V/s",
                figure(defaults::ramp_rate(model))
            ),
        ));
    }
    let codes = rate * model.timing.period / actuation.volts_per_code;
    if codes >= f64::from(max_step) {
        (max_step, 1)
    } else if codes >= 1.0 {
        (codes as i32, 1)
    } else {
        (1, whole(libm::ceil(1.0 / codes - 1e-9)))
    }
}

/// A slightly larger value, so that the printed fix is itself accepted.
fn above(value: f64) -> f64 {
    value * 1.001 + 1e-4
}

/// A count; the largest if it does not fit.
fn whole(value: f64) -> u32 {
    // Saturates; NaN gives 0.
    value as u32
}

fn finding(model: &Model, code: Code, key: &str, message: String, help: String) -> Diagnostic {
    Diagnostic::at(&model.spans, &[&format!("supervisor.{key}")], code, message, help)
}
