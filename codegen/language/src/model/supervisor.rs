//! Faults, and declared uncertainty.

use crate::keys::declare::*;

/// Longest time of a key, s.
pub const LONGEST_TIMEOUT: f64 = 60.0;
/// Largest pulse of the wiring check, share of the stroke.
pub const LARGEST_PULSE: f64 = 0.02;
const TIMEOUT: Shape = one(Dimension::TIME, Range::closed(1e-6, LONGEST_TIMEOUT), "ms");
const SILENCE: Item = item(Dimension::TIME, Range::closed(1e-6, 3600.0), "ms");
const FACTORS: Shape = Shape::List(&[RATIO; 2]);
/// A fault-free machine shows 0.9 to 1.11; a gauge of half or twice its gain shows at most 0.61 or at least 1.5.
const GAUGE_GAIN: &[Item] = &[Item::Number(Range::closed(0.62, 0.9)), Item::Number(Range::closed(1.11, 1.5))];
/// Legs of one make show 0.74 to 1.35, legs with their own records 0.85 to 1.15; a leg of half or twice its gain shows at most 0.68 or at least 1.48.
const LEG_GAIN: &[Item] = &[Item::Number(Range::closed(0.68, 0.85)), Item::Number(Range::closed(1.15, 1.48))];

section! {
    /// Faults that the controller's supervisor detects, and their debounce times; docs/supervisor.md. It checks one gauge in each tick.
    ///
    /// In V, s, V/s and m; none means that the key's rule applies.
    "supervisor" ["faults", "watchdog", "safety"], Plain => Supervisor {
        /// Voltage of the legs while disarmed, and target of a ramp-down. A stack whose amplifier is off is at 0 V: with another rest voltage it jumps when the amplifier is switched on or off.
        rest_voltage: Option<f64> = Shape::One(VOLTS), Rule("0 V, or the limit of `actuator.voltage` that is nearest to it"), "", "0 V";
        /// Time without any fault condition that arming requires. For six legs with their own gauges, it is also the time constant of the approach to the set-point.
        arm_time: Option<f64> = TIMEOUT, Rule("100 ms, at least a period"), "", "100 ms";
        /// Rate of the voltages during a ramp-down, at most the slew rate.
        ramp_rate: Option<f64> = one(Dimension::SLEW_RATE, Range::closed(1e-3, 1e12), "V/ms"), Rule("the whole voltage in a second, or `actuator.slew_rate` if that is less"), "", "0.1 V/ms";
        /// Time after which a gauge that is not finite or out of range, or a converter that does not respond, is a fault. If every second sample is bad, the time is 2.7 times as long.
        gauge_time: Option<f64> = TIMEOUT, Rule("10 ms, at least a period"), "", "10 ms";
        /// Motion along a gauge, expected from the voltages sent, after which an unchanged reading means that the gauge is stuck.
        stuck_motion: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "nm"), Rule("10 steps of the gauge's converter or 10 times `sensor.noise`, whichever is more"), "", "100 nm";
        /// Time after that for which the reading must remain unchanged.
        stuck_time: Option<f64> = TIMEOUT, Rule("50 ms, at least 12 periods"), "", "50 ms";
        /// Largest difference between a gauge's reading and the hysteresis model at the voltages sent and the known load.
        disagreement: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "um"), Rule("a fifth of `actuator.stroke`"), "", "12 um";
        /// Time for which the difference must last.
        disagreement_time: Option<f64> = TIMEOUT, Rule("100 ms, at least 12 periods"), "", "100 ms";
        /// Largest tracking error of each axis, as a fraction of its workspace bound; for six legs with their own gauges, of a leg as a fraction of `actuator.stroke`.
        tracking_error: f64 = number(Range::above(0.0, 10.0)), Default(0.2), "", 0.2;
        /// Time for which the error must last.
        tracking_time: Option<f64> = TIMEOUT, Rule("100 ms, at least 12 periods"), "", "100 ms";
        /// Largest jump of a gauge's reading from the straight line through its two previous readings. A reading beyond it is replaced by that line; if this persists, it is a fault.
        leap: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "um"), Rule("the largest jump of a reading when the voltages reverse at `actuator.slew_rate`, behind the lags of amplifier and gauge, with noise and converter; 1.5 times that for a calibrated gauge"), "" ["jump", "sample_jump"], "2 um";
        /// Largest amplitude of an error that environment and noise may cause permanently, from 60 Hz on; about the axes, at the platform joints. A larger oscillation is a fault, unless the motion explains it.
        disturbance: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-10, 1e-2), "nm"), Rule("a 1500th of `actuator.stroke`, at least 6 times what the gauges' noise makes of an axis"), "" ["vibration", "oscillation"], "40 nm";
        /// Time for which a leg may stay at a limit of its voltage or table.
        voltage_time: Option<f64> = TIMEOUT, Rule("500 ms, at least a period"), "", "500 ms";
        /// Time for which a leg may stay at its slew rate limit.
        slew_time: Option<f64> = TIMEOUT, Rule("50 ms, at least a period"), "", "50 ms";
        /// Number of gaps within a second that is a fault; a gap is one or more missed ticks.
        missed_ticks: u32 = integer(1, 1000), Default(3), "", 3;
        /// Largest number of consecutive missed ticks. More are a fault that ramps down, because codes and amplifiers were not updated for that time.
        missed_in_a_row: u32 = integer(1, 1000), Default(100), "", 100;
        /// Reaction to an amplifier fault, or to a broken wire of that line: amplifiers off at once, a ramp-down, or a hold.
        amplifier_fault: FaultAction = one_of(FaultAction::WORDS), Default("off"), "" ["amplifier_alarm", "on_amplifier_fault"], "ramp-down";
        /// How long the host in control may be silent before the machine holds, and before it ramps down and switches off.
        host_lost: Option<[f64; 2]> = list(&[SILENCE; 2]), Rule(r#"["100 ms", "10 s"]"#), "", ["100 ms", "10 s"];
    }
    and |fields, _table| {
        /// The check at the end of arming.
        wiring_check: WiringCheck = WiringCheck::read(fields, "supervisor.wiring_check")?;
    }
}

choice! {
    /// Reaction to a fault that the machine reports.
    FaultAction {
        /// Amplifiers off at once.
        Off = "off",
        /// Ramp the voltages to rest, then amplifiers off.
        RampDown = "ramp-down",
        /// Voltages held.
        Hold = "hold",
    }
}

choice! {
    /// Whether the six legs are of one make.
    LegMakes {
        /// Of one make: each is compared with the others.
        Alike = "alike",
        /// Of different makes: gains are not tested until each leg has its own record.
        Different = "different",
    }
}

section! {
    /// The wiring check at the end of arming. Each leg in turn makes a small pulse, and the controller compares the gauges' response with the spec's geometry: sign, order and gain of gauges and legs. On a mismatch the machine does not run; docs/supervisor.md.
    ///
    /// In s.
    "supervisor.wiring_check" ["first_power"], Plain => WiringCheck {
        /// Switches the check off; the text is the reason. Nothing then shows that the feedback has the right sign.
        off: Option<String> = REASON, Optional, "" ["disabled", "reason"], "no stacks are connected";
        /// Height of a pulse, as a fraction of `actuator.stroke`.
        amplitude: f64 = number(Range::above(0.0, LARGEST_PULSE)), Default(0.01), "" ["height", "share"], 0.01;
        /// Duration of a pulse; the legs follow one another.
        time: Option<f64> = TIMEOUT, Rule("50 ms, at least 40 periods and what the slew rate takes, up to 200 ms where the noise of the gauges asks for it"), "" ["duration"], "50 ms";
        /// Smallest and largest gain of a gauge over the median of all six.
        gauge_gain: [f64; 2] = list(GAUGE_GAIN), Default([0.75, 1.33]), "", [0.75, 1.33];
        /// Smallest and largest gain of a leg over the mean of the five others. With six records each leg is compared with its own; with one, the range must contain 0.74 to 1.35, because legs of one make differ by 15 %.
        leg_gain: [f64; 2] = list(LEG_GAIN), Default([0.7, 1.43]), "", [0.7, 1.43];
        /// Whether the legs are of one make. Gains of legs of different makes are not tested while one record is used for all.
        legs: LegMakes = one_of(LegMakes::WORDS), Default("alike"), "" ["makes"], "alike";
        /// Largest part of the response that no gains of gauges and legs explain; a fault-free machine leaves 0.04.
        residual: f64 = number(Range::closed(0.05, 0.2)), Default(0.1), "", 0.1;
    }
}

section! {
    /// Variations for `specgen robust`: smallest and largest factor on values of other sections, and the largest permitted errors. The controller does not use them.
    ///
    /// Errors in m and rad; none if the spec has no limit.
    "robust" ["uncertainty", "tolerances"], Plain => Robust {
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
        /// Largest extra delay of the voltages, control intervals: all numbers from none to this are tried.
        delay_ticks: Option<u32> = integer(0, 100), Rule("1"), "", 1;
        /// Gate: largest rms error of the translation, or of the legs.
        max_error: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "200 nm";
        /// Gate: largest rms error of the angles.
        max_orientation: Option<f64> = one(Dimension::ANGLE, Range::closed(1e-12, 0.1), "nrad"), Optional, "", "1 urad";
        /// Gate: largest rms error of the translation after the motion was learned, with `--learn`; learning must not diverge on any machine.
        max_learned: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "6 nm";
    }
}
