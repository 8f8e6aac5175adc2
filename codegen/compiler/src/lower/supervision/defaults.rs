//! Default values of the supervisor.

use specgen_language::model::Model;

/// Default of `supervisor.arm_time`, s.
pub(crate) const ARM_TIME: f64 = 0.1;
/// Default of `supervisor.gauge_time`, s.
pub(crate) const GAUGE_TIME: f64 = 0.01;
/// Default of `supervisor.stuck_time`, s.
pub(crate) const STUCK_TIME: f64 = 0.05;
/// Default of `supervisor.disagreement_time`, s.
pub(crate) const DISAGREEMENT_TIME: f64 = 0.1;
/// Default of `supervisor.tracking_time`, s.
pub(crate) const TRACKING_TIME: f64 = 0.1;
/// Default of `supervisor.voltage_time`, s.
pub(crate) const VOLTAGE_TIME: f64 = 0.5;
/// Default of `supervisor.slew_time`, s.
pub(crate) const SLEW_TIME: f64 = 0.05;
/// Default of `supervisor.host_lost`: silence of the host after which the machine holds, and after which it ramps down, s.
pub(crate) const HOST_LOST: [f64; 2] = [0.1, 10.0];
/// Default of `supervisor.wiring_check.time`, s.
pub(crate) const WIRING_TIME: f64 = 0.05;
/// The longest default if the gauges' noise requires more.
pub(crate) const LONGEST_WIRING_TIME: f64 = 0.2;
/// Default of `supervisor.stuck_motion`, in rms noise, and in steps of the gauge's converter.
const STUCK_MARGIN: f64 = 10.0;
/// Default of `supervisor.disagreement`, as a share of the stroke.
const DISAGREEMENT_SHARE: f64 = 0.2;

/// Default of `supervisor.disturbance`, as a share of the stroke.
const DISTURBANCE_SHARE: f64 = 1.0 / 1500.0;

/// Default of `supervisor.disturbance`, m; more if the gauges' noise requires it.
pub(crate) fn disturbance(model: &Model) -> f64 {
    DISTURBANCE_SHARE * model.actuator.stroke
}

/// Default of `supervisor.stuck_motion`, m, for a gauge whose converter has this `step`, m.
pub(crate) fn stuck_motion(model: &Model, step: f64) -> f64 {
    let noise = model.sensor.noise;
    STUCK_MARGIN * if step > noise { step } else { noise }
}

/// Default of `supervisor.disagreement`, m.
pub(crate) fn disagreement(model: &Model) -> f64 {
    DISAGREEMENT_SHARE * model.actuator.stroke
}

/// Default of `supervisor.ramp_rate`, V/s: the whole voltage in a second, but not faster than the slew rate.
pub(crate) fn ramp_rate(model: &Model) -> f64 {
    let [low, high] = model.actuator.voltage;
    let (whole, slew_rate) = (high - low, model.actuator.slew_rate);
    if whole < slew_rate { whole } else { slew_rate }
}
