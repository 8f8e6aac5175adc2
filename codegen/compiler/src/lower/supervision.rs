//! The supervisor: times to ticks and samples, bounds to SI, and what cannot work.

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

/// Gauges are looked at in turn.
const CHANNELS: f64 = 6.0;
/// Samples that a fault of a gauge takes at least.
const FEWEST_SAMPLES: f64 = 2.0;
/// Times the noise (rms) that a bound must keep off: what noise alone does once in 10^15 samples.
const NOISE_MARGIN: f64 = 8.0;
/// Largest `supervisor.tracking_error` that a spec may declare.
const LARGEST_SHARE: f64 = 10.0;
/// Fewest steps of the converter by which a sound gauge must have moved.
const FEWEST_STEPS: f64 = 2.0;
/// Reading of each gauge per leg displacement where each leg has its own.
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

/// Every constant of the supervisor, for a platform or legs whose modes ring for `rings` (s) at most, as a time constant.
///
/// # Errors
/// A time that is shorter than it can be seen, a bound below the noise, a ramp faster than the slew rate.
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

    /// Ticks after which a host is lost, and those with the event of it after which it is gone.
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
                        "a host is to be lost after {hold:.6} ms, at least a period, and the machine to ramp down after {down:.6} ms; \
                         before that it holds"
                    ),
                    format!(
                        "leave host_lost out: it is then [\"{} ms\", \"{} ms\"]; it must be at least [\"{least_hold:.6} ms\", \"{least_down:.6} ms\"]",
                        figure(defaults::HOST_LOST[0] * 1e3),
                        figure(defaults::HOST_LOST[1] * 1e3)
                    ),
                ));
            }
        }
        [hold_ticks, (down_ticks - hold_ticks).saturating_add(1)]
    }

    /// How often something that is looked at every `every` ticks is seen in that time; a time that is given must let it be
    /// seen `fewest` times.
    fn counted(&mut self, key: &str, given: Option<f64>, otherwise: f64, every: f64, fewest: f64) -> u32 {
        let between = every * self.model.timing.period;
        let least = fewest * between;
        if let Some(time) = given
            && time < least * (1.0 - 1e-9)
        {
            self.findings.push(finding(
                self.model,
                codes::SUPERVISOR_TIME,
                key,
                format!(
                    "`supervisor.{key}` is {:.6} ms, but it takes {:.6} ms at a period of {:.6} ms to be seen",
                    time * 1e3,
                    least * 1e3,
                    self.model.timing.period * 1e3
                ),
                format!(
                    "leave {key} out: it is then {} ms; it must be at least {:.6} ms, or shorten timing.period",
                    figure(otherwise.max(least) * 1e3),
                    least * 1e3
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
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "stuck_motion",
            format!(
                "`supervisor.stuck_motion` is {:.4} nm, but a step of the gauge's converter is {:.4} nm: a sound gauge may not show it",
                stuck_motion * 1e9,
                step * 1e9
            ),
            format!("write stuck_motion = \"{:.4} nm\" or more", above(least * 1e9)),
        ));
    }
    let disagreement = spec.disagreement.unwrap_or_else(|| defaults::disagreement(model));
    let least = NOISE_MARGIN * noise + step;
    if disagreement < least {
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "disagreement",
            format!(
                "a disagreement of {:.4} nm is below what the gauge's noise and converter make, {:.4} nm",
                disagreement * 1e9,
                least * 1e9
            ),
            format!(
                "write disagreement = \"{:.4} nm\" or more; a fifth of the stroke is {:.4} um",
                above(least * 1e9),
                defaults::disagreement(model) * 1e6
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
                "a tracking error of {share} of the range is below what the gauges' noise makes of one axis, {least:.6}"
            ),
            format!("write tracking_error = {:.6} or more; the default is 0.2", above(least)),
        ));
    }
    full.map(|full| share * full)
}

/// An axis, or a leg, of which noise alone makes more than any share of its range that may be declared.
fn no_range(model: &Model, axis: usize, full: f64, noise: f64) -> Diagnostic {
    let share = model.supervisor.tracking_error;
    if model.task_space.is_none() {
        return Diagnostic::at(
            &model.spans,
            &["sensor.noise", "sensor"],
            codes::SUPERVISOR_BOUND,
            format!("the gauges' noise makes {:.4} um of a leg whose stroke is {:.4} um", noise * 1e6, full * 1e6),
            format!("write noise = \"{:.4} nm\" or less", share * full / NOISE_MARGIN * 1e9 * 0.999),
        );
    }
    let (table, item, unit) =
        if axis < 3 { ("workspace.translation", axis, "um") } else { ("workspace.rotation", axis - 3, "urad") };
    let message = format!(
        "the gauges' noise makes {:.4} {unit} of {}, whose range is {:.4} {unit}: no share of that is above it",
        noise * 1e6,
        AXES[axis],
        full * 1e6
    );
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

/// Codes of a step, and ticks from one to the next: no faster than asked.
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
                "leave ramp_rate out: it is then {} V/s; it must be at most {slew_rate} V/s",
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

/// A little above, for a fix that is itself accepted when printed.
fn above(value: f64) -> f64 {
    value * 1.001 + 1e-4
}

/// A count; what does not fit is as good as never.
fn whole(value: f64) -> u32 {
    // Saturates, and a NaN gives 0.
    value as u32
}

fn finding(model: &Model, code: Code, key: &str, message: String, help: String) -> Diagnostic {
    Diagnostic::at(&model.spans, &[&format!("supervisor.{key}")], code, message, help)
}
