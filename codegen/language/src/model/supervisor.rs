//! Faults, and what is declared about uncertainty.

use crate::keys::declare::*;

/// Longest time of a key, s.
pub const LONGEST_TIMEOUT: f64 = 60.0;
/// Largest pulse of the wiring check, share of the stroke.
pub const LARGEST_PULSE: f64 = 0.02;
const TIMEOUT: Shape = one(Dimension::TIME, Range::closed(1e-6, LONGEST_TIMEOUT), "ms");
const SILENCE: Item = item(Dimension::TIME, Range::closed(1e-6, 3600.0), "ms");
const FACTORS: Shape = Shape::List(&[RATIO; 2]);
/// A fault-free machine shows 0.9 to 1.11, a gauge of half or twice its gain 0.61 or 1.5 at the nearest.
const GAUGE_GAIN: &[Item] = &[Item::Number(Range::closed(0.62, 0.9)), Item::Number(Range::closed(1.11, 1.5))];
/// Alike legs show 0.74 to 1.35, those with records of their own 0.85 to 1.15, a leg of half or twice its gain 0.68 or 1.48 at the nearest.
const LEG_GAIN: &[Item] = &[Item::Number(Range::closed(0.68, 0.85)), Item::Number(Range::closed(1.15, 1.48))];

section! {
    /// What the supervisor in the controller takes for a fault, and for how long it must last; docs/supervisor.md. Gauges are looked at in turn, one a tick.
    ///
    /// In V, s, V/s and m; none where the rule of the key holds.
    "supervisor" ["faults", "watchdog", "safety"], Plain => Supervisor {
        /// Voltage at which the legs stand while disarmed and to which they ramp down. Amplifiers that are switched off leave a stack at 0 V: from any other rest it jumps when they are switched on and off.
        rest_voltage: Option<f64> = Shape::One(VOLTS), Rule("0 V, or the limit of `actuator.voltage` that is nearest to it"), "", "0 V";
        /// Time without any condition that arming takes. Of six legs with their own gauges also the time constant with which the set-point is approached from where the legs are.
        arm_time: Option<f64> = TIMEOUT, Rule("100 ms, at least a period"), "", "100 ms";
        /// Rate at which voltages go to rest when they ramp down, at most the slew rate.
        ramp_rate: Option<f64> = one(Dimension::SLEW_RATE, Range::closed(1e-3, 1e12), "V/ms"), Rule("the whole voltage in a second, or `actuator.slew_rate` if that is less"), "", "0.1 V/ms";
        /// Time after which a gauge that is not finite or out of range, or a converter that does not answer, is a fault. Where every second sample is missing it is one after 2.7 times that.
        gauge_time: Option<f64> = TIMEOUT, Rule("10 ms, at least a period"), "", "10 ms";
        /// Motion along a gauge that the voltages sent must have caused before an unchanged reading shows that the gauge is stuck.
        stuck_motion: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "nm"), Rule("10 steps of the gauge's converter or 10 times `sensor.noise`, whichever is more"), "", "100 nm";
        /// Time after that for which the reading must still be the same.
        stuck_time: Option<f64> = TIMEOUT, Rule("50 ms, at least 12 periods"), "", "50 ms";
        /// Largest difference between a gauge's reading and what the hysteresis model gives for the voltages sent and the known load.
        disagreement: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "um"), Rule("a fifth of `actuator.stroke`"), "", "12 um";
        /// Time for which it must be larger.
        disagreement_time: Option<f64> = TIMEOUT, Rule("100 ms, at least 12 periods"), "", "100 ms";
        /// Largest tracking error of each axis, as a share of its workspace bound; of six legs with their own gauges, of a leg as a share of `actuator.stroke`.
        tracking_error: f64 = number(Range::above(0.0, 10.0)), Default(0.2), "", 0.2;
        /// Time for which it must be larger.
        tracking_time: Option<f64> = TIMEOUT, Rule("100 ms, at least 12 periods"), "", "100 ms";
        /// Largest leap of a gauge's reading from the straight line through the two before it. A reading beyond is replaced by that line, and a fault if that goes on.
        leap: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "um"), Rule("what voltages that turn round at `actuator.slew_rate` make of a reading behind the lags of amplifier and gauge, with noise and converter; of a calibrated gauge 1.5 times that"), "" ["jump", "sample_jump"], "2 um";
        /// Largest amplitude of an error that environment and noise may make for as long as they like, from 60 Hz on; about the axes, at the platform joints. What oscillates beyond it is a fault, unless the motion explains it.
        disturbance: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-10, 1e-2), "nm"), Rule("a 1500th of `actuator.stroke`, at least 6 times what the gauges' noise makes of an axis"), "" ["vibration", "oscillation"], "40 nm";
        /// Time that a leg may stay at a limit of its voltage or table.
        voltage_time: Option<f64> = TIMEOUT, Rule("500 ms, at least a period"), "", "500 ms";
        /// Time that a leg may stay at the limit of its slew rate.
        slew_time: Option<f64> = TIMEOUT, Rule("50 ms, at least a period"), "", "50 ms";
        /// Gaps within a second that are a fault, each of one missed tick or more.
        missed_ticks: u32 = integer(1, 1000), Default(3), "", 3;
        /// Missed ticks in a row, of which more are a fault that ramps down: codes and amplifiers were left alone for so long.
        missed_in_a_row: u32 = integer(1, 1000), Default(100), "", 100;
        /// What happens when an amplifier reports a fault, or the wire of that line breaks: amplifiers off at once, a ramp down, or a hold.
        amplifier_fault: FaultAction = one_of(FaultAction::WORDS), Default("off"), "" ["amplifier_alarm", "on_amplifier_fault"], "ramp-down";
        /// How long a host that has the orders may be silent until the machine holds, and until it ramps down and switches off.
        host_lost: Option<[f64; 2]> = list(&[SILENCE; 2]), Rule(r#"["100 ms", "10 s"]"#), "", ["100 ms", "10 s"];
    }
    and |fields, _table| {
        /// The check that arming ends with.
        wiring_check: WiringCheck = WiringCheck::read(fields, "supervisor.wiring_check")?;
    }
}

choice! {
    /// What a fault that the machine reports leads to.
    FaultAction {
        /// Amplifiers off at once.
        Off = "off",
        /// Voltages to rest, then amplifiers off.
        RampDown = "ramp-down",
        /// Voltages held.
        Hold = "hold",
    }
}

choice! {
    /// Whether the six legs are of one make.
    LegMakes {
        /// They are: each is held against the others.
        Alike = "alike",
        /// They are not: gains are not tested until each leg has a record of its own.
        Different = "different",
    }
}

section! {
    /// The wiring check that arming ends with: each leg in turn makes a small pulse, and the controller holds what the gauges show against the geometry of the spec: sign, order and gain of gauges and legs. On a mismatch the machine does not run; docs/supervisor.md.
    ///
    /// In s.
    "supervisor.wiring_check" ["first_power"], Plain => WiringCheck {
        /// Switches the check off, and says why, in words: nothing then tells that feedback has the right sign.
        off: Option<String> = REASON, Optional, "" ["disabled", "reason"], "no stacks are connected";
        /// Height of a pulse, as a share of `actuator.stroke`.
        amplitude: f64 = number(Range::above(0.0, LARGEST_PULSE)), Default(0.01), "" ["height", "share"], 0.01;
        /// Time of a pulse, one leg after the other.
        time: Option<f64> = TIMEOUT, Rule("50 ms, at least 40 periods and what the slew rate takes, up to 200 ms where the noise of the gauges asks for it"), "" ["duration"], "50 ms";
        /// Smallest and largest gain of a gauge over the median of all six.
        gauge_gain: [f64; 2] = list(GAUGE_GAIN), Default([0.75, 1.33]), "", [0.75, 1.33];
        /// Smallest and largest gain of a leg over the mean of the five others. With six records each is held against its own; with one the range must contain 0.74 to 1.35, as legs of one make differ by 15 %.
        leg_gain: [f64; 2] = list(LEG_GAIN), Default([0.7, 1.43]), "", [0.7, 1.43];
        /// Whether legs are of one make. The gains of legs of different makes are not tested while one record stands for all.
        legs: LegMakes = one_of(LegMakes::WORDS), Default("alike"), "" ["makes"], "alike";
        /// Largest part of what the gauges show that no gains of gauges and legs explain; a fault-free machine leaves 0.04.
        residual: f64 = number(Range::closed(0.05, 0.2)), Default(0.1), "", 0.1;
    }
}

section! {
    /// What `specgen robust` varies: smallest and largest factor on what the other sections say, and the error that it lets pass. Nothing of it is in the controller.
    ///
    /// Errors in m and rad; none where the spec does not say.
    "robust" ["uncertainty", "tolerances"], Optional => Robust {
        /// On mass and inertia of the platform.
        mass: Option<[f64; 2]> = FACTORS, Rule("[0.95, 1.05]"), "", [0.95, 1.05];
        /// On the axial stiffness of a leg.
        stiffness: Option<[f64; 2]> = FACTORS, Rule("[0.95, 1.05]"), "", [0.95, 1.05];
        /// On the damping ratio of the structure.
        damping: Option<[f64; 2]> = FACTORS, Rule("[0.7, 1.3]"), "", [0.7, 1.3];
        /// On the gain of a leg.
        gain: Option<[f64; 2]> = FACTORS, Rule("`adaptation.gain_ratio`"), "lambda", [0.9, 1.1];
        /// On the width of a leg's hysteresis: the thresholds of its plays.
        hysteresis: Option<[f64; 2]> = FACTORS, Rule("[0.9, 1.1]"), "", [0.9, 1.1];
        /// On the creep of a leg.
        creep: Option<[f64; 2]> = FACTORS, Rule("[0.9, 1.1]"), "", [0.9, 1.1];
        /// On the lag of an amplifier.
        lag: Option<[f64; 2]> = FACTORS, Rule("[0.8, 1.2]"), "", [0.8, 1.2];
        /// On the lag of the gauges, `sensor.lag`.
        gauge_lag: Option<[f64; 2]> = FACTORS, Rule("[0.8, 1.2]; 1 where there is no `sensor.lag`"), "" ["sensor_lag"], [0.8, 1.2];
        /// On the noise of gauges, amplifiers and force sensor.
        noise: Option<[f64; 2]> = FACTORS, Rule("[0.5, 1.5]"), "", [0.5, 1.5];
        /// Control intervals by which voltages come late, at most: none to so many are tried.
        delay_ticks: Option<u32> = integer(0, 100), Rule("1"), "", 1;
        /// Gate: largest rms error of the translation, or of the legs.
        max_error: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "200 nm";
        /// Gate: largest rms error of the angles.
        max_orientation: Option<f64> = one(Dimension::ANGLE, Range::closed(1e-12, 0.1), "nrad"), Optional, "", "1 urad";
        /// Gate: largest rms error of the translation once the motion is learned, with `--learn`; learning must grow on no machine, either.
        max_learned: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "6 nm";
    }
}
