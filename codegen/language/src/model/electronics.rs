//! Stacks, amplifiers, converters and gauges.

use crate::keys::declare::*;

const READING: Item = item(Dimension::LENGTH, Range::closed(-0.1, 0.1), "um");
// From V to m: the k-th coefficient in m/V^k.
pub(super) const CALIBRATION: Shape = Shape::Leading(
    2,
    &[
        item(per_volt(0), Range::closed(-0.1, 0.1), "um"),
        item(per_volt(1), Range::closed(-1.0, 1.0), "um/V"),
        item(per_volt(2), Range::closed(-1.0, 1.0), "um/V^2"),
        item(per_volt(3), Range::closed(-1.0, 1.0), "um/V^3"),
        item(per_volt(4), Range::closed(-1.0, 1.0), "um/V^4"),
        item(per_volt(5), Range::closed(-1.0, 1.0), "um/V^5"),
    ],
);
const fn per_volt(power: i8) -> Dimension {
    Dimension::new([1, 0, 0, -power, 0, 0])
}

const CROSS_TALK: &str = "[[0, 0.004, -0.002, 0, 0, 0.001], [0.004, 0, 0.001, 0, 0, -0.002], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]";

section! {
    /// The piezo stacks of a leg.
    ///
    /// In SI units: m/V, m, V, V/s, N/m, Hz, F.
    "actuator" ["piezo", "stack", "actuators", "motor"], Plain => Actuator {
        /// Stacks in series in one leg.
        stacks: u32 = integer(1, 1000), Required, "" ["n", "number", "count", "number_of_stacks", "n_stacks"], 5;
        /// Displacement per volt of one stack; a leg has `stacks` times that: the gain of (AII.1).
        stack_gain: f64 = one(Dimension::PIEZO_GAIN, Range::closed(1e-12, 1e-4), "um/V"), Required, "rho" ["gain", "d33", "piezo_gain", "displacement_per_volt"], "0.1262 um/V";
        /// Free stroke of a leg.
        stroke: f64 = one(Dimension::LENGTH, Range::closed(1e-9, 0.01), "um"), Required, "" ["travel", "displacement", "range", "elongation"], "60 um";
        /// Smallest and largest voltage that the controller may output.
        voltage: [f64; 2] = list(&[VOLTS; 2]), Required, "" ["drive", "voltage_range", "U", "limits", "voltage_limits"], ["0 V", "100 V"];
        /// Fastest change of voltage that amplifier and stack tolerate.
        slew_rate: f64 = one(Dimension::SLEW_RATE, Range::closed(1e-3, 1e12), "V/ms"), Required, "" ["slew", "max_slew", "rate"], "40 V/ms";
        /// Axial stiffness of a leg.
        axial_stiffness: f64 = one(Dimension::STIFFNESS, Range::closed(1.0, 1e12), "N/m"), Required, "k_a" ["stiffness", "k", "c"], "1e7 N/m";
        /// First axial resonance of a leg as mounted.
        resonance: f64 = one(Dimension::FREQUENCY, Range::closed(0.1, 1e7), "Hz"), Required, "" ["f_0", "f_r", "natural_frequency", "eigenfrequency", "resonant_frequency", "resonance_frequency"], "870 Hz";
        /// Damping ratio of that resonance.
        damping_ratio: f64 = number(Range::open(0.0, 1.0)), Required, "zeta" ["damping"], 0.1;
        /// Gain of that resonance as a fraction of the gain of a large loop: small and fast motion has less, because it stays within the hysteresis. Six legs with their own gauges then compensate the resonance in their demand; with [control] only `specgen identify predict` uses it.
        resonance_gain: Option<f64> = number(Range::above(0.0, 1.0)), Rule("the slope of the table after a reversal, in predictions; no compensation"), "" ["small_signal_gain", "k_s"], 0.66;
        /// E of an assembled platform: what each leg (row) must displace beside its own length, per length of each other leg (column), because joints are stiff and gauges tilted; from `specgen identify cross-talk`. The diagonal is zero.
        cross_talk: Option<[[f64; 6]; 6]> = Shape::Rows(6, &[Item::Number(Range::closed(-0.5, 0.5)); 6]), Optional, "E" ["crosstalk", "coupling"], CROSS_TALK;
        /// Capacitance of all stacks of a leg together; used for the amplifier's current.
        capacitance: Option<f64> = one(Dimension::CAPACITANCE, Range::above(0.0, 1.0), "uF"), Optional, "" ["C", "C_p"], "35 uF";
    }
}

impl Actuator {
    /// ρ̂ of a whole leg, m/V: stacks in series add.
    pub fn leg_gain(&self) -> f64 {
        f64::from(self.stacks) * self.stack_gain
    }
}

section! {
    /// Power amplifier between converter and stack. No lag is the cautious default: lag damps the resonance.
    ///
    /// In s, V and A.
    "amplifier" ["amp", "driver"], Plain => Amplifier {
        /// Time constant of its first-order lag.
        lag: f64 = one(Dimension::TIME, Range::closed(0.0, 10.0), "ms"), Default("0 ms"), "" ["tau", "time_constant", "bandwidth", "delay"], "0.35 ms";
        /// Output noise, rms.
        noise: f64 = one(Dimension::VOLTAGE, Range::closed(0.0, 100.0), "mV"), Default("0 V"), "" ["sigma", "rms", "noise_rms"], "2 mV";
        /// Largest output current for one leg; the slew rate and trajectories are checked against it with `actuator.capacitance`.
        current: Option<f64> = one(Dimension::CURRENT, Range::above(0.0, 1e4), "mA"), Optional, "" ["I", "I_max", "max_current", "peak_current"], "2 A";
    }
}

section! {
    /// Converter that drives the amplifier, in volts at the stack.
    ///
    /// Full scale is code 2^bits − 1; in V.
    "dac" ["converter", "output"], Plain => Dac {
        /// Resolution.
        bits: u32 = integer(8, 24), Required, "" ["resolution", "n_bits"], 16;
        /// Voltage at code 0 and at full scale.
        range: [f64; 2] = list(&[VOLTS; 2]), Required, "" ["voltage", "output_range"], ["0 V", "150 V"];
    }
}

section! {
    /// Displacement gauge of a leg; with [control], of the six that measure the platform.
    ///
    /// Displacements in m; voltages in V, ±10 V without `input_range`.
    "sensor" ["gauges", "lvdt", "encoder"], Plain => Sensor {
        /// Smallest and largest displacement that it can measure.
        range: [f64; 2] = list(&[READING; 2]), Required, "" ["travel", "measuring_range"], ["-2 um", "48 um"];
        /// Noise, rms.
        noise: f64 = one(Dimension::LENGTH, Range::closed(0.0, 1e-3), "nm"), Default("0 nm"), "" ["sigma", "rms", "noise_rms"], "2.2 nm";
        /// Time constant of its first-order lag, 1/(2π·bandwidth): of the gauge and of the filter before its converter together.
        lag: f64 = one(Dimension::TIME, Range::closed(0.0, 0.01), "us"), Default("0 us"), "" ["tau", "time_constant", "bandwidth", "filter", "cutoff", "latency", "delay"], "15 us";
        /// Resolution of its converter over the range.
        bits: u32 = integer(8, 32), Required, "" ["resolution", "n_bits"], 16;
        /// With a calibration: voltage of its converter at code 0 and at full scale.
        input_range: Option<[f64; 2]> = list(&[VOLTS; 2]), Rule(r#"["-10 V", "10 V"]"#), "", ["0 V", "10 V"];
        /// With [control]: displacement as a polynomial of the gauge's voltage, lowest power first; the gauge words are then volts. Applies to all six gauges, unless a gauge has its own.
        calibration = CALIBRATION, Rule("the gauge words are metres"), "", ["-2 um", "5 um/V"];
    }
}

impl Sensor {
    /// A step of its converter, m.
    pub fn step(&self) -> f64 {
        let [low, high] = self.range;
        (high - low) / libm::exp2(f64::from(self.bits))
    }
}
