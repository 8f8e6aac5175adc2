//! What the supervisor takes for a fault where the spec does not say.

use specgen_language::model::Model;

/// Without `supervisor.arm_time`, s.
pub(crate) const ARM_TIME: f64 = 0.1;
/// Without `supervisor.gauge_time`, s.
pub(crate) const GAUGE_TIME: f64 = 0.01;
/// Without `supervisor.stuck_time`, s.
pub(crate) const STUCK_TIME: f64 = 0.05;
/// Without `supervisor.disagreement_time`, s.
pub(crate) const DISAGREEMENT_TIME: f64 = 0.1;
/// Without `supervisor.tracking_time`, s.
pub(crate) const TRACKING_TIME: f64 = 0.1;
/// Without `supervisor.voltage_time`, s.
pub(crate) const VOLTAGE_TIME: f64 = 0.5;
/// Without `supervisor.slew_time`, s.
pub(crate) const SLEW_TIME: f64 = 0.05;
/// Without `supervisor.host_lost`: silence of a host after which the machine holds and ramps down, s.
pub(crate) const HOST_LOST: [f64; 2] = [0.1, 10.0];
/// Without `supervisor.wiring_check.time`, s.
pub(crate) const WIRING_TIME: f64 = 0.05;
/// The same where the gauges' noise asks for more, at most.
pub(crate) const LONGEST_WIRING_TIME: f64 = 0.2;
/// Of `supervisor.stuck_motion` without the key: times the noise, and steps of the gauge's converter.
const STUCK_MARGIN: f64 = 10.0;
/// Of the stroke, without `supervisor.disagreement`.
const DISAGREEMENT_SHARE: f64 = 0.2;

/// Of the stroke, without `supervisor.disturbance`.
const DISTURBANCE_SHARE: f64 = 1.0 / 1500.0;

/// Without `supervisor.disturbance`, m; more where the gauges' noise makes more.
pub(crate) fn disturbance(model: &Model) -> f64 {
    DISTURBANCE_SHARE * model.actuator.stroke
}

/// Without `supervisor.stuck_motion`, m, for a gauge whose converter has such a `step`, m.
pub(crate) fn stuck_motion(model: &Model, step: f64) -> f64 {
    let noise = model.sensor.noise;
    STUCK_MARGIN * if step > noise { step } else { noise }
}

/// Without `supervisor.disagreement`, m.
pub(crate) fn disagreement(model: &Model) -> f64 {
    DISAGREEMENT_SHARE * model.actuator.stroke
}

/// Without `supervisor.ramp_rate`, V/s: the whole voltage in a second, and no faster than the slew rate.
pub(crate) fn ramp_rate(model: &Model) -> f64 {
    let [low, high] = model.actuator.voltage;
    let (whole, slew_rate) = (high - low, model.actuator.slew_rate);
    if whole < slew_rate { whole } else { slew_rate }
}
