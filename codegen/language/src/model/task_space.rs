//! The task-space controller: the user's choices in section 4 of the paper.

use std::f64::consts::PI;

use super::electronics::CALIBRATION;
use super::hysteresis::BANDWIDTH;
use super::trigger::Trigger;
use super::{LARGEST_TRAVEL, LARGEST_TURN};
use crate::keys::declare::*;

/// Largest `control.correction` as a share of the stroke.
pub const CORRECTION_SHARE: f64 = 0.1;

/// Largest gain and stiffness in a spec, in SI units: products with it stay finite in both scalars.
pub const LARGEST_GAIN: f64 = 1e15;
/// Default cutoff of the velocity filter, as a fraction of half the tick rate.
const CUTOFF_SHARE: f64 = 0.6;

const GAIN: Range = Range::closed(0.0, LARGEST_GAIN);

const fn gains(along: Dimension, along_unit: &'static str, about: Dimension, about_unit: &'static str) -> [Item; 6] {
    six(item(along, GAIN, along_unit), item(about, GAIN, about_unit))
}

const STIFFNESSES: &[Item] = &gains(Dimension::STIFFNESS, "N/m", Dimension::TURN_STIFFNESS, "N m/rad");
const STIFFNESS_RATES: &[Item] =
    &gains(Dimension::STIFFNESS_RATE, "N/(m s)", Dimension::TURN_STIFFNESS_RATE, "N m/(rad s)");
const DAMPINGS: &[Item] = &gains(Dimension::DAMPING, "N s/m", Dimension::TURN_DAMPING, "N m s/rad");
const DIRECTION: Item = Item::Number(Range::closed(-1e3, 1e3));
const POSE: &[Item] = &six(
    item(Dimension::LENGTH, Range::closed(-LARGEST_TRAVEL, LARGEST_TRAVEL), "um"),
    item(Dimension::ANGLE, Range::closed(-LARGEST_TURN, LARGEST_TURN), "urad"),
);
const FRAME: &[Item] = &six(CENTER, item(Dimension::ANGLE, Range::closed(-PI, PI), "rad"));
const SPEEDS: &[Item] = &six(
    item(Dimension::SPEED, Range::above(0.0, 100.0), "um/s"),
    item(Dimension::ANGULAR_RATE, Range::above(0.0, 1e3), "mrad/s"),
);
const ACCELERATIONS: &[Item] = &six(
    item(Dimension::ACCELERATION, Range::above(0.0, 1e5), "mm/s^2"),
    item(Dimension::ANGULAR_ACCELERATION, Range::above(0.0, 1e6), "mrad/s^2"),
);
const JERKS: &[Item] = &six(
    item(Dimension::JERK, Range::above(0.0, 1e8), "m/s^3"),
    item(Dimension::ANGULAR_JERK, Range::above(0.0, 1e9), "rad/s^3"),
);
const NO_POSE: &str = r#"["0 um", "0 um", "0 um", "0 urad", "0 urad", "0 urad"]"#;
const SLOW_SPEED: &str = r#"["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]"#;
const SLOW_ACCELERATION: &str =
    r#"["10 mm/s^2", "10 mm/s^2", "10 mm/s^2", "100 mrad/s^2", "100 mrad/s^2", "100 mrad/s^2"]"#;
const SLOW_JERK: &str = r#"["1 m/s^3", "1 m/s^3", "1 m/s^3", "10 rad/s^3", "10 rad/s^3", "10 rad/s^3"]"#;
const STOP_JERK: &str = r#"["1e4 m/s^3", "1e4 m/s^3", "1e4 m/s^3", "1e5 rad/s^3", "1e5 rad/s^3", "1e5 rad/s^3"]"#;
const INTEGRAL: &str =
    r#"["4e7 N/(m s)", "4e7 N/(m s)", "2e8 N/(m s)", "1e6 N m/(rad s)", "1e6 N m/(rad s)", "5e5 N m/(rad s)"]"#;
const COEFFICIENT: Item = Item::Number(Range::closed(-1e6, 1e6));
const SECTIONS_OF_MODES: &str = "[[0.2, -0.1, 0, -1.5, 0.6], [0.2, -0.1, 0, -1.5, 0.6], [0.2, -0.1, 0, -1.4, 0.5], [0.2, -0.1, 0, -1.4, 0.5], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]";
const STREAM_SPEED: &str = r#"["1 mm/s", "1 mm/s", "1 mm/s", "10 mrad/s", "10 mrad/s", "10 mrad/s"]"#;

choice! {
    /// Which loops are closed. The paper's "P", "F" and "P/F".
    ControlMode {
        /// Both.
        PF = "p/f",
        /// Position feedback only: no inverse model, no adaptation.
        P = "p",
        /// Feed-forward alone.
        F = "f",
    }
}

choice! {
    /// Source of the interaction force in the feed-forward.
    Interaction {
        /// No interaction force.
        None = "none",
        /// K_e (h_d − h_e).
        Modelled = "modelled",
        /// A force sensor: the words `wrench[0]` to `wrench[5]`.
        Measured = "measured",
    }
}

choice! {
    /// Computation of the legs' load under motion and gravity.
    DynamicsChoice {
        /// First order if that is proven to be accurate enough, otherwise the full dynamics.
        Cheapest = "cheapest",
        /// The full dynamics.
        Whole = "whole",
    }
}

section! {
    /// The task-space controller of section 4. With it six gauges measure the platform ([[gauge]]); without it each leg has its own gauge and its own feed-forward.
    ///
    /// A pose is x, y, z, θx, θy, θz from rest, m and rad; times in s.
    "control" ["loop", "task_space", "feedback"], Optional => TaskSpace {
        /// Control mode at start-up: position feedback and feed-forward, feedback only, or feed-forward only. `adaptation.mode` sets the adaptation of the feed-forward.
        mode: ControlMode = one_of(ControlMode::WORDS), Default("p/f"), "", "p/f";
        /// Damping ratio of the platform's lowest mode on its legs. Give the measured value or less: a smaller value is conservative.
        modal_damping: f64 = number(Range::open(0.0, 1.0)), Required, "zeta" ["damping", "damping_ratio"], 0.02;
        /// Whether the feedback has a modal notch; without it the bandwidth falls to about a twelfth.
        notch = FLAG, Default(true), "", true;
        /// Damping ratio that the notch gives to each mode, above `modal_damping`.
        notch_damping = number(Range::above(0.0, 1.0)), Rule("1, with a notch"), "zeta_d", 1.0;
        /// Whether a second-order section on its error damps each mode of the platform, in P/F. The compiler designs the sections together with gains and bandwidths that the spec leaves out. Needs the notch.
        active_damping = FLAG, Default(false), "", true;
        /// Largest correction of the request along each axis, in addition to the set-point, for `specgen learn`; about each axis, the same at the platform joints. At most a tenth of `actuator.stroke`; its fastest rise takes 1 ms. Without it the controller has no such input.
        correction: Option<f64> = one(Dimension::LENGTH, Range::above(0.0, 1e-3), "um"), Optional, "", "2 um";
        /// Whether the integral of (7) is transferred to the run-to-run estimates whenever the set-point comes to rest, in P/F with EWMA or PCC. The voltages do not change. The estimates, which are faster, then unlearn the integral of the motion, and steps settle sooner.
        hand_over = FLAG, Default(false), "", true;
        /// First-order low-pass of the pose derivative, below half the tick rate (pi rad / period).
        velocity_cutoff = BANDWIDTH, Rule("0.6 pi rad / period"), "" ["cutoff", "velocity_filter"], "9e3 rad/s";
        /// Source of the interaction force (5) in (7): none, the stiffness of [control.environment], or a force sensor on the `wrench` words.
        interaction: Interaction = one_of(Interaction::WORDS), Default("none"), "", "none";
        /// Computation of the legs' load under motion and gravity, J^-T (M ddh + C dh + G) of (7): to first order in pose and acceleration if its error is proven to be within `dynamics_tolerance` for all moves and trajectories, or always by the full dynamics. With an interaction force it is always the full dynamics.
        dynamics: DynamicsChoice = one_of(DynamicsChoice::WORDS), Default("cheapest"), "", "whole";
        /// Largest error of a leg's displacement from the first-order computation, over the workspace and the limits of moves and trajectories.
        dynamics_tolerance: Option<f64> = one(Dimension::LENGTH, Range::above(0.0, 1e-3), "nm"), Rule("a tenth of the converter's step, as displacement of a leg"), "", "0.1 nm";
        /// Lead time of the leg displacements, in proportion to their rate. It removes the lag of fast motion. A step of the set-point overshoots by step x lead / period for one tick, so paths with corners may need less.
        lead: Option<f64> = one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Rule("the delay from command to pose: `amplifier.lag` and what the modes add, less half a period"), "", "0.2 ms";
        /// Time constant with which the offset of a change of mode fades, if neither the estimates nor an integral on every axis take it over, as in F with Invhys.
        transfer_time: f64 = one(Dimension::TIME, Range::closed(1e-6, 100.0), "ms"), Default("50 ms"), "", "50 ms";
    }
    and |fields, _table| {
        /// Geometry of the six gauges, in the order of the words `gauge[0]` to `gauge[5]`.
        probes: [Probe; 6] = of_gauges(|gauge| Probe::read(fields, &gauge))?;
        /// Reading of each gauge as a polynomial V → m, lowest power first, at least two coefficients. None: the gauge
        /// words are metres.
        calibration: Option<[Vec<f64>; 6]> = calibration(fields);
        /// ζ_d of the modal notch, in (0, 1] and above `modal_damping`. None: no notch.
        notch_damping: Option<f64> =
            fields.flag("control.notch")?.then(|| fields.number("control.notch_damping").unwrap_or(1.0));
        /// Whether the modes are damped actively in P/F.
        active_damping: bool = fields.flag("control.active_damping")?;
        /// Whether the integral is transferred to the estimates when the set-point comes to rest.
        hand_over: bool = fields.flag("control.hand_over")?;
        /// Gains of P/F with EWMA or PCC. None: the compiler's start rule.
        gains: Option<Gains> = Gains::read(fields, "gains");
        /// Gains of P and of P/F with Invhys. None: the compiler's start rule.
        position_gains: Option<Gains> = Gains::read(fields, "position_gains");
        /// Ω1 (level) and Ω2 (drift), rad/s: the weight per tick is Ω T_s, at most 1. None: the compiler's start rule.
        adaptation: Option<[f64; 2]> = bandwidths(fields);
        /// First-order low-pass of the pose derivative, rad/s, below half the angular tick rate.
        velocity_cutoff: f64 = match fields.number("control.velocity_cutoff") {
            Some(cutoff) => cutoff,
            None => CUTOFF_SHARE * PI / fields.number("timing.period")?,
        };
        /// The work piece of [`Interaction::Modelled`]; zero if the spec gives none.
        environment: Environment = Environment::read(fields, "control.environment").unwrap_or(Environment::NONE);
        /// A design that `specgen design` has written.
        design: Option<StoredDesign> = StoredDesign::read(fields, "control.design");
        /// Limits of set-points and moves.
        setpoint: SetpointRules = SetpointRules::read(fields, "control.setpoint")?;
        /// Coordinates of set-points.
        frames: Frames = Frames::read(fields, "control.frames")?;
        /// Trajectories by the word `selector`, in the order of the spec; names are unique.
        trajectories: Vec<Trajectory> = (0..fields.count("trajectory"))
            .map(|index| Trajectory::read(fields, &format!("trajectory[{index}]")))
            .collect::<Option<_>>()?;
        /// Output lines in the order of the spec; names are unique.
        triggers: Vec<Trigger> = (0..fields.count("trigger"))
            .map(|index| Trigger::read(fields, &format!("trigger[{index}]")))
            .collect::<Option<_>>()?;
    }
}

/// `each` applied to the table of each gauge, if there are six.
fn of_gauges<T>(each: impl Fn(String) -> Option<T>) -> Option<[T; 6]> {
    (0..6).map(|gauge| each(format!("gauge[{gauge}]"))).collect::<Option<Vec<T>>>()?.try_into().ok()
}

/// Each gauge's own calibration, or that of all; `None` if the gauge words are metres.
fn calibration(fields: &Fields) -> Option<[Vec<f64>; 6]> {
    let of_all = fields.numbers("sensor.calibration");
    of_gauges(|gauge| fields.numbers(&join(&gauge, "calibration")).or(of_all).map(<[f64]>::to_vec))
}

fn bandwidths(fields: &Fields) -> Option<[f64; 2]> {
    Some([fields.number("adaptation.level_bandwidth")?, fields.number("adaptation.drift_bandwidth")?])
}

section! {
    /// The work piece that the platform presses on, (5), in the order x, y, z, theta_x, theta_y, theta_z at P_C.
    ///
    /// Stiffness in N/m and N m/rad, pose in m and rad.
    "control.environment" ["contact", "work_piece"], Optional => Environment {
        /// Diagonal of its stiffness.
        stiffness: [f64; 6] = list(STIFFNESSES), Required, "K_e", ["0 N/m", "0 N/m", "3e6 N/m", "0 N m/rad", "0 N m/rad", "0 N m/rad"];
        /// Pose, from rest, at which it is unloaded.
        rest: [f64; 6] = list(POSE), Default(NO_POSE), "h_e", NO_POSE;
    }
}

impl Environment {
    /// No work piece.
    const NONE: Self = Self { stiffness: [0.0; 6], rest: [0.0; 6] };
}

section! {
    /// Limits of the set-point generator, in the order x, y, z, theta_x, theta_y, theta_z of {B}.
    ///
    /// In m or rad and their time derivatives. The compiler derives missing stop limits.
    "control.setpoint", Plain => SetpointRules {
        /// Pose from rest that is added to every set-point: it leaves room for downward corrections. It is approached slowly after start-up.
        bias: [f64; 6] = list(POSE), Default(NO_POSE), "", ["0 um", "0 um", "10 um", "0 urad", "0 urad", "0 urad"];
        /// Largest speed of bias and point-to-point moves.
        speed: [f64; 6] = list(SPEEDS), Default(SLOW_SPEED), "", SLOW_SPEED;
        /// Their largest acceleration.
        acceleration: [f64; 6] = list(ACCELERATIONS), Default(SLOW_ACCELERATION), "", SLOW_ACCELERATION;
        /// Their largest jerk.
        jerk: [f64; 6] = list(JERKS), Default(SLOW_JERK), "", SLOW_JERK;
        /// Largest deceleration of stops: of a stream that ends or is refused, and of any motion that another command ends. The rate falls smoothly from v to 0 in at least 1.5 v over this value, over a distance of half of v times that time, and never within less than two thirds of the time that a stop from the largest declared speed takes. `specgen check` states the distances.
        stop_acceleration: Option<[f64; 6]> = list(ACCELERATIONS), Rule("derived from the platform's modes, `amplifier.lag`, `actuator.slew_rate` and `actuator.stroke`, for a stop from `stream_speed`"), "", ["5 m/s^2", "5 m/s^2", "5 m/s^2", "50 rad/s^2", "50 rad/s^2", "50 rad/s^2"];
        /// Their largest jerk.
        stop_jerk: Option<[f64; 6]> = list(JERKS), Rule("the jerk at which a stop from the largest declared speed just reaches `stop_acceleration`"), "", STOP_JERK;
        /// A streamed set-point that is further from the last one than this speed allows in a period is a jump, and refused.
        stream_speed: [f64; 6] = list(SPEEDS), Default(STREAM_SPEED), "", STREAM_SPEED;
        /// A stream without a new set-point for this number of ticks is stale, and the last set-point is held.
        stale_ticks: u32 = integer(1, 1_000_000), Default(10), "", 10;
    }
}

section! {
    /// Coordinates of set-points.
    ///
    /// In m and rad.
    "control.frames", Plain => Frames {
        /// Work frame in {B}, about P_C at rest: offset and angles, R = Rz Ry Rx.
        work: [f64; 6] = list(FRAME), Default(NO_POSE), "", ["0 mm", "0 mm", "0 mm", "0 deg", "0 deg", "30 deg"];
        /// Tool point in {P}: set-points position it, and rotations turn about it.
        tool: [f64; 3] = POINT, Default(["0 mm", "0 mm", "0 mm"]), "", ["0 mm", "0 mm", "40 mm"];
    }
}

section! {
    /// Gains, notches and sections of active damping that `specgen design` has found, with a digest of the values that they were designed from. `specgen check` verifies them. Do not edit them: run `specgen design` again.
    ///
    /// Gains in N/m, N m/rad and N/(m s), N m/(rad s), in the order x, y, z, theta_x, theta_y, theta_z.
    "control.design", Optional => StoredDesign {
        /// Digest of the values of the spec that the design depends on: a letter, then hexadecimal digits.
        digest: String = NAME, Required, "", "d0f1e2d3c4b5a6978";
        /// For each mode of the platform, from the lowest: the section of its active damping, b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z²) / (1 + a1/z + a2/z²).
        sections: [[f64; 5]; 6] = Shape::Rows(6, &[COEFFICIENT; 5]), Required, "", SECTIONS_OF_MODES;
        /// Damping ratio that the notch gives to each mode.
        notch_damping: [f64; 6] = list(&[Item::Number(Range::above(0.0, 2.0)); 6]), Required, "", [0.5, 0.5, 0.4, 0.4, 0.3, 0.3];
        /// Proportional gain.
        proportional: [f64; 6] = list(STIFFNESSES), Required, "k_p", ["5e6 N/m", "5e6 N/m", "2e7 N/m", "1e5 N m/rad", "1e5 N m/rad", "5e4 N m/rad"];
        /// Integral gain.
        integral: [f64; 6] = list(STIFFNESS_RATES), Required, "k_I", INTEGRAL;
        /// Bandwidth of the level estimate.
        level_bandwidth: f64 = BANDWIDTH, Required, "", "450 rad/s";
        /// Bandwidth of the drift estimate.
        drift_bandwidth: f64 = BANDWIDTH, Required, "", "20 rad/s";
    }
}

impl StoredDesign {
    /// The section as in a spec, from which the same design is read.
    pub fn text(&self) -> String {
        let array = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
            format!("[{}]", values.join(", "))
        };
        let with_units = |values: [f64; 6], along: &str, about: &str| {
            let units = [along, along, along, about, about, about];
            let values: Vec<String> =
                values.iter().zip(units).map(|(value, unit)| format!("\"{value:?} {unit}\"")).collect();
            format!("[{}]", values.join(", "))
        };
        let sections: Vec<String> = self.sections.iter().map(|section| format!("  {},\n", array(section))).collect();
        let (digest, sections, notch) = (&self.digest, sections.concat(), array(&self.notch_damping));
        let proportional = with_units(self.proportional, "N/m", "N m/rad");
        let (integral, level) = (with_units(self.integral, "N/(m s)", "N m/(rad s)"), self.level_bandwidth);
        let drift = self.drift_bandwidth;
        format!(
            "[control.design]\ndigest          = \"{digest}\"\nsections        = [\n{sections}]\nnotch_damping   = {notch}\n\
             proportional    = {proportional}\nintegral        = {integral}\nlevel_bandwidth = \"{level:?} rad/s\"\n\
             drift_bandwidth = \"{drift:?} rad/s\"\n"
        )
    }
}

section! {
    /// Diagonal gains of (7) for P/F with EWMA or PCC, in the order x, y, z, theta_x, theta_y, theta_z. Without it the compiler derives them.
    ///
    /// In N/m, N m/rad and, with their times, N/(m s), N m/(rad s), N s/m, N m s/rad.
    "gains" ["pid"], Optional => Gains {
        /// Proportional gain.
        proportional: [f64; 6] = list(STIFFNESSES), Required, "k_p" ["kp", "p", "K"], ["5e6 N/m", "5e6 N/m", "2e7 N/m", "1e5 N m/rad", "1e5 N m/rad", "5e4 N m/rad"];
        /// Integral gain.
        integral: [f64; 6] = list(STIFFNESS_RATES), Required, "k_I" ["ki", "i"], INTEGRAL;
        /// Derivative gain.
        derivative: [f64; 6] = list(DAMPINGS), Required, "k_v" ["kd", "d"], ["0 N s/m", "0 N s/m", "0 N s/m", "0 N m s/rad", "0 N m s/rad", "0 N m s/rad"];
    }
}

impl Gains {
    pub(crate) const OF_POSITION: Section =
        Section { name: "position_gains", doc: "The same for P, and for P/F with Invhys.", ..Self::SECTION };
}

section! {
    /// One of the six gauges that measure the platform, in the order of the gauge words; only with [control], which needs it. A gauge fixed in {B} measures along a line to a plane on the platform, from rest.
    ///
    /// The reading is the distance (m) from the probe point to the plane along `direction`, from rest.
    "gauge", Repeated(6, 6) => Probe {
        /// A point of the measuring line in {B}.
        point: [f64; 3] = POINT, Required, "" ["position", "location", "place"], ["80 mm", "0 mm", "180 mm"];
        /// Direction of the line in {B}, of any length: the reading grows when the target moves in this direction.
        direction = list(&[DIRECTION; 3]), Required, "" ["normal", "axis", "n"], [0, 0, 1];
        /// A point of the target plane in {P}.
        target_point = POINT, Rule("`point`, at rest"), "", ["80 mm", "0 mm", "0 mm"];
        /// Normal of the target plane in {P}, of any length and either sign.
        target_normal = list(&[DIRECTION; 3]), Rule("`direction`"), "", [0, 0, 1];
        /// Displacement of this gauge as a polynomial of its voltage, lowest power first.
        calibration = CALIBRATION, Rule("`sensor.calibration`"), "", ["-2 um", "5 um/V"];
    }
    and |fields, table| {
        /// Unit vector of the line in {B}: the reading grows when the target moves in this direction.
        direction: [f64; 3] = unit(fields.list(&join(table, "direction"))?)?;
        /// A point of the target plane in {P}, m.
        plane_point: [f64; 3] = fields.list(&join(table, "target_point")).or_else(|| facing(fields, table))?;
        /// Unit normal of the target plane in {P}; its sign does not matter.
        plane_normal: [f64; 3] = {
            let normal = fields.list(&join(table, "target_normal"));
            unit(normal.or_else(|| fields.list(&join(table, "direction")))?)?
        };
    }
}

/// The point of the platform that the gauge faces at rest, where {P} differs from {B} only by the height.
fn facing(fields: &Fields, gauge: &str) -> Option<[f64; 3]> {
    let [x, y, z] = fields.list(&join(gauge, "point"))?;
    Some([x, y, z - fields.number("geometry.height")?])
}

/// `vector` with length 1; `None` if its length is almost zero.
pub(crate) fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
    (length > 1e-9).then(|| vector.map(|component| component / length))
}

section! {
    /// A trajectory that the controller can play, numbered from 0 in the order of the file; only with [control].
    "trajectory" ["path"], Repeated(0, MAX_TABLES) => Trajectory {
        /// Its name, unique in the file.
        name: String = NAME, Required, "", "circle";
        /// One of the paper's paths, a step, or a table of poses.
        kind = one_of(&["case-1", "case-2", "machining", "step", "waveform"]), Required, "", "case-1";
        /// Lead time of the leg displacements while the controller plays it. `specgen check --details` proposes less than control.lead for paths with corners.
        lead: Option<f64> = one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Rule("that of `control.lead`"), "", "0.2 ms";
        /// For a paper's path: operating frequency.
        frequency = one(Dimension::FREQUENCY, Range::closed(1e-3, 1e3), "Hz"), Rule("error for a paper's path"), "f_c" ["f", "rate"], "1 Hz";
        /// For a paper's path: the formulas as printed, with their jumps.
        as_printed = FLAG, Rule("`false`"), "", false;
        /// For a step: its end pose; it starts at zero and has no corner in its speed.
        to = list(POSE), Rule("error for a step"), "", ["10 um", "0 um", "0 um", "0 urad", "0 urad", "0 urad"];
        /// For a step: its duration.
        time = one(Dimension::TIME, Range::closed(1e-5, 3600.0), "ms"), Rule("error for a step"), "", "4 ms";
        /// For a waveform: the table of poses, a CSV file relative to the spec.
        file = Shape::One(Item::File), Rule("error for a waveform"), "", "waveforms/circle.csv";
        /// For a waveform: columns by header or number, with units, scale and offset as in `--columns` of `specgen identify`.
        columns = Shape::One(Item::Columns), Rule("found by the names in the file"), "", "x_um=Ch1,z=3*2 um/V";
        /// For a waveform: time from one row to the next.
        period = one(Dimension::TIME, Range::closed(1e-6, 3600.0), "ms"), Rule("error for a waveform"), "", "1 ms";
        /// For a waveform: whether it starts again after the last row.
        repeat = FLAG, Rule("`false`"), "", false;
    }
    and |fields, table| {
        /// What it is.
        kind: TrajectoryKind = TrajectoryKind::read(fields, table)?;
    }
}

/// Kinds of trajectory.
#[derive(Debug, Clone, PartialEq)]
pub enum TrajectoryKind {
    /// One of the paper's paths, as corrected in the errata or as printed.
    Paper {
        /// Which.
        path: PaperPath,
        /// As printed, with jumps.
        as_printed: bool,
        /// f_c, Hz.
        frequency: f64,
    },
    /// A step from zero, whose speed is a period of 1 − cos.
    Step {
        /// m and rad.
        to: [f64; 6],
        /// s.
        time: f64,
    },
    /// A table of poses in a CSV file.
    Waveform {
        /// Relative to the spec.
        file: String,
        /// Time between rows, s.
        period: f64,
        /// Starts again after the last row.
        repeat: bool,
        /// Description of its columns.
        columns: Option<String>,
    },
}

impl TrajectoryKind {
    /// The key that sets how fast it is, and its value: Hz of `frequency`, s of `time` and `period`.
    pub const fn rate(&self) -> (&'static str, f64) {
        match self {
            Self::Paper { frequency, .. } => ("frequency", *frequency),
            Self::Step { time, .. } => ("time", *time),
            Self::Waveform { period, .. } => ("period", *period),
        }
    }

    fn read(fields: &Fields, table: &str) -> Option<Self> {
        let key = |name: &str| join(table, name);
        let paper = |path| {
            Some(Self::Paper {
                path,
                as_printed: fields.flag(&key("as_printed")).unwrap_or(false),
                frequency: fields.number(&key("frequency"))?,
            })
        };
        match fields.choice(&key("kind"))? {
            "case-1" => paper(PaperPath::Case1),
            "case-2" => paper(PaperPath::Case2),
            "machining" => paper(PaperPath::Machining),
            "step" => Some(Self::Step { to: fields.list(&key("to"))?, time: fields.number(&key("time"))? }),
            _ => Some(Self::Waveform {
                file: fields.name(&key("file"))?.to_owned(),
                period: fields.number(&key("period"))?,
                repeat: fields.flag(&key("repeat")).unwrap_or(false),
                columns: fields.name(&key("columns")).map(str::to_owned),
            }),
        }
    }
}

/// Paths of section 4 of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperPath {
    /// Case 1.
    Case1,
    /// Case 2.
    Case2,
    /// Machining.
    Machining,
}
