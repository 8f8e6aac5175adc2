//! The rows of the key table.

use super::{Dimension, Item, Key, Kind, MAX_TABLES, Presence, Range, SCHEMA_VERSION, Section, Shape};
use crate::model::MAX_GRID;
use crate::model::{LARGEST_GAIN, LARGEST_RUN_INTERVAL, LARGEST_TRAVEL, LARGEST_TURN};
use Presence::{Default, Form, InsteadOf, Optional, Required, Rule};

const fn row(
    name: &'static str,
    shape: Shape,
    presence: Presence,
    symbol: &'static str,
    example: &'static str,
    doc: &'static str,
) -> Key {
    Key { name, shape, presence, doc, symbol, example }
}

const fn one(dimension: Dimension, range: Range, unit: &'static str) -> Shape {
    Shape::One(item(dimension, range, unit))
}

const fn item(dimension: Dimension, range: Range, unit: &'static str) -> Item {
    Item::Quantity { dimension, range, unit }
}

const fn integer(min: i64, max: i64) -> Shape {
    Shape::One(Item::Integer(min, max))
}

const TIMEOUT: Shape = one(Dimension::TIME, Range::closed(1e-6, 60.0), "ms");
const SILENCE: Item = item(Dimension::TIME, Range::closed(1e-6, 3600.0), "ms");
const RADIUS: Range = Range::closed(1e-3, 10.0);
const JOINT_ANGLE: Range = Range::open(0.0, 2.0 * std::f64::consts::FRAC_PI_3);
const CIRCLES: &str = "joint circles";
const JOINTS: &str = "joints one by one";
const JOINT: &[Item] = &[CENTER; 3];
const BASE_JOINTS: &str = "[[\"78 mm\", \"128 mm\", \"0 mm\"], [\"72 mm\", \"132 mm\", \"0 mm\"], [\"-150 mm\", \"3 mm\", \"0 mm\"], [\"-150 mm\", \"-3 mm\", \"0 mm\"], [\"72 mm\", \"-132 mm\", \"0 mm\"], [\"78 mm\", \"-128 mm\", \"0 mm\"]]";
const PLATFORM_JOINTS: &str = "[[\"100 mm\", \"2 mm\", \"0 mm\"], [\"-48 mm\", \"88 mm\", \"0 mm\"], [\"-52 mm\", \"86 mm\", \"0 mm\"], [\"-52 mm\", \"-86 mm\", \"0 mm\"], [\"-48 mm\", \"-88 mm\", \"0 mm\"], [\"100 mm\", \"-2 mm\", \"0 mm\"]]";
const BODY_MASS: Range = Range::closed(1e-6, 1e4);
const MOMENT: Range = Range::above(0.0, 1e4);
const PRODUCT: Item = item(Dimension::INERTIA, Range::closed(-1e4, 1e4), "g mm^2");
const CENTER: Item = item(Dimension::LENGTH, Range::closed(-10.0, 10.0), "mm");
const LEG_CENTER: Shape = one(Dimension::LENGTH, Range::closed(0.0, 10.0), "mm");
const VOLTS: Item = item(Dimension::VOLTAGE, Range::closed(-1e4, 1e4), "V");
const READING: Item = item(Dimension::LENGTH, Range::closed(-0.1, 0.1), "um");
const WEIGHT: Shape = Shape::One(Item::Number(Range::above(0.0, 1.0)));
const BANDWIDTH: Shape = one(Dimension::ANGULAR_RATE, Range::above(0.0, 1e6), "rad/s");
const RATIO: Item = Item::Number(Range::above(0.0, 10.0));
const FACTORS: Shape = Shape::List(&[RATIO; 2]);
const CREEP_TIME: Item = item(Dimension::TIME, Range::closed(1e-6, 1e5), "ms");
const CREEP_TIMES: Shape = Shape::Leading(1, &[CREEP_TIME; 6]);
const CREEP_WEIGHTS: Shape = Shape::Leading(1, &[Item::Number(Range::closed(0.0, 1.0)); 6]);
const TRAVEL: Item = item(Dimension::LENGTH, Range::closed(0.0, LARGEST_TRAVEL), "um");
const TURN: Item = item(Dimension::ANGLE, Range::closed(0.0, LARGEST_TURN), "mrad");
const GAIN: Range = Range::closed(0.0, LARGEST_GAIN);
const BYTES: Shape = one(Dimension::MEMORY, Range::closed(1.0, 1_099_511_627_776.0), "KiB");

const fn gains(along: Dimension, along_unit: &'static str, about: Dimension, about_unit: &'static str) -> [Item; 6] {
    let (a, t) = (item(along, GAIN, along_unit), item(about, GAIN, about_unit));
    [a, a, a, t, t, t]
}

const STIFFNESSES: &[Item] = &gains(Dimension::STIFFNESS, "N/m", Dimension::TURN_STIFFNESS, "N m/rad");
const STIFFNESS_RATES: &[Item] =
    &gains(Dimension::STIFFNESS_RATE, "N/(m s)", Dimension::TURN_STIFFNESS_RATE, "N m/(rad s)");
const DAMPINGS: &[Item] = &gains(Dimension::DAMPING, "N s/m", Dimension::TURN_DAMPING, "N m s/rad");

const GAINS: &[Key] = &[
    row(
        "proportional",
        Shape::List(STIFFNESSES),
        Required,
        "k_p",
        "[\"5e6 N/m\", \"5e6 N/m\", \"2e7 N/m\", \"1e5 N m/rad\", \"1e5 N m/rad\", \"5e4 N m/rad\"]",
        "Proportional gain.",
    ),
    row(
        "integral",
        Shape::List(STIFFNESS_RATES),
        Required,
        "k_I",
        "[\"4e7 N/(m s)\", \"4e7 N/(m s)\", \"2e8 N/(m s)\", \"1e6 N m/(rad s)\", \"1e6 N m/(rad s)\", \"5e5 N m/(rad s)\"]",
        "Integral gain.",
    ),
    row(
        "derivative",
        Shape::List(DAMPINGS),
        Required,
        "k_v",
        "[\"0 N s/m\", \"0 N s/m\", \"0 N s/m\", \"0 N m s/rad\", \"0 N m s/rad\", \"0 N m s/rad\"]",
        "Derivative gain.",
    ),
];

const DIRECTION: Item = Item::Number(Range::closed(-1e3, 1e3));
// From V to m: the k-th coefficient in m/V^k.
const CALIBRATION: Shape = Shape::Leading(
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

/// x, y, z with one dimension, then the three rotations with another.
const fn six(along: Item, about: Item) -> [Item; 6] {
    [along, along, along, about, about, about]
}

const POSE: &[Item] = &six(
    item(Dimension::LENGTH, Range::closed(-LARGEST_TRAVEL, LARGEST_TRAVEL), "um"),
    item(Dimension::ANGLE, Range::closed(-LARGEST_TURN, LARGEST_TURN), "urad"),
);
const FRAME: &[Item] = &six(CENTER, item(Dimension::ANGLE, Range::closed(-TURN_AROUND, TURN_AROUND), "rad"));
const TURN_AROUND: f64 = std::f64::consts::PI;
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
const NO_POSE: &str = "[\"0 um\", \"0 um\", \"0 um\", \"0 urad\", \"0 urad\", \"0 urad\"]";
const SLOW_SPEED: &str = "[\"100 um/s\", \"100 um/s\", \"100 um/s\", \"1 mrad/s\", \"1 mrad/s\", \"1 mrad/s\"]";
const SLOW_ACCELERATION: &str =
    "[\"10 mm/s^2\", \"10 mm/s^2\", \"10 mm/s^2\", \"100 mrad/s^2\", \"100 mrad/s^2\", \"100 mrad/s^2\"]";
const SLOW_JERK: &str = "[\"1 m/s^3\", \"1 m/s^3\", \"1 m/s^3\", \"10 rad/s^3\", \"10 rad/s^3\", \"10 rad/s^3\"]";
const STREAM_SPEED: &str = "[\"1 mm/s\", \"1 mm/s\", \"1 mm/s\", \"10 mrad/s\", \"10 mrad/s\", \"10 mrad/s\"]";

/// Every section, in the order of the reference. Sections that hold others come before them.
// One row a line: this is a table.
#[rustfmt::skip]
pub const SECTIONS: &[Section] = &[
    Section {
        name: "",
        kind: Kind::Plain,
        doc: "The keys before the first section.",
        keys: &[
            row("schema", integer(SCHEMA_VERSION, SCHEMA_VERSION), Required, "", "1", "Version of this language."),
            row(
                "name",
                Shape::One(Item::Name),
                Required,
                "",
                "\"reference\"",
                "Name of the platform: a letter, then letters, digits, `-` and `_`.",
            ),
        ],
    },
    Section {
        name: "geometry",
        kind: Kind::Plain,
        doc: "Joints of base and platform, on circles as in equations (1) and (2) or one by one, and the pose at rest.",
        keys: &[
            row("base_radius", one(Dimension::LENGTH, RADIUS, "mm"), Form(CIRCLES), "r_B", "\"150 mm\"", "Radius of the circle through the six base joints."),
            row("platform_radius", one(Dimension::LENGTH, RADIUS, "mm"), Form(CIRCLES), "r_P", "\"100 mm\"", "Radius of the circle through the six platform joints."),
            row("base_angle", one(Dimension::ANGLE, JOINT_ANGLE, "rad"), Form(CIRCLES), "alpha_B", "\"0.012 pi rad\"", "Angle between the two base joints of a pair."),
            row("platform_angle", one(Dimension::ANGLE, JOINT_ANGLE, "rad"), Form(CIRCLES), "alpha_P", "\"0.012 pi rad\"", "Angle between the two platform joints of a pair."),
            row("height", one(Dimension::LENGTH, RADIUS, "mm"), Required, "P_z", "\"180 mm\"", "Height of P_C, the origin of {P}, above that of {B} at rest; with joint circles, of the platform's joint plane above the base's."),
            row("base_joints", Shape::Rows(6, JOINT), Form(JOINTS), "B_i", BASE_JOINTS, "The six base joints in {B}, leg by leg: where the joints lie on no circle."),
            row("platform_joints", Shape::Rows(6, JOINT), Form(JOINTS), "P_i", PLATFORM_JOINTS, "The six platform joints in {P}, leg by leg."),
        ],
    },
    Section {
        name: "platform",
        kind: Kind::Plain,
        doc: "The moving platform as a rigid body, in its own frame {P}, Table 4: its part of (4).",
        keys: &[
            row("mass", one(Dimension::MASS, BODY_MASS, "kg"), Required, "m", "\"1.195 kg\"", "Mass with everything that is mounted on it."),
            row("inertia", Shape::List(&[item(Dimension::INERTIA, MOMENT, "g mm^2"); 3]), Required, "I_xx I_yy I_zz", "[\"3.26e7 g mm^2\", \"3.26e7 g mm^2\", \"9.7e6 g mm^2\"]", "Moments of inertia about the centre of mass."),
            row("products", Shape::List(&[PRODUCT; 3]), Default("[\"0 g mm^2\", \"0 g mm^2\", \"0 g mm^2\"]"), "I_xy I_xz I_yz", "[\"0 g mm^2\", \"0 g mm^2\", \"0 g mm^2\"]", "Entries of the inertia matrix off the diagonal: I_xy is minus the integral of x y dm."),
            row("center_of_mass", Shape::List(&[CENTER; 3]), Default("[\"0 mm\", \"0 mm\", \"0 mm\"]"), "", "[\"0 mm\", \"0 mm\", \"0 mm\"]", "Centre of mass, from the centre of the platform joints."),
        ],
    },
    Section {
        name: "leg",
        kind: Kind::Plain,
        doc: "The two parts of a leg, the same for all six, Table 4: masses and inertias of (AI.9) and (AI.12).",
        keys: &[
            row("fixed_mass", one(Dimension::MASS, BODY_MASS, "g"), Required, "m_s", "\"90.26 g\"", "Mass of the part at the base joint."),
            row("extensible_mass", one(Dimension::MASS, BODY_MASS, "g"), Required, "m_e", "\"73.62 g\"", "Mass of the part at the platform joint."),
            row("fixed_inertia", one(Dimension::INERTIA, MOMENT, "g mm^2"), Required, "I_s", "\"1.07e5 g mm^2\"", "Moment of inertia of the base-side part about a transverse axis through its mass centre."),
            row("extensible_inertia", one(Dimension::INERTIA, MOMENT, "g mm^2"), Required, "I_e", "\"5.27e4 g mm^2\"", "The same of the platform-side part."),
            row("fixed_center", LEG_CENTER, Required, "l_s", "\"50 mm\"", "Mass centre of the base-side part, from the base joint."),
            row("extensible_center", LEG_CENTER, Required, "l_e", "\"50 mm\"", "Mass centre of the platform-side part, from the platform joint."),
            row("joint_angle", one(Dimension::ANGLE, Range::above(0.0, 1.5), "mrad"), Optional, "", "\"20 mrad\"", "Angle by which the joints of a leg may turn from rest, either way."),
        ],
    },
    Section {
        name: "actuator",
        kind: Kind::Plain,
        doc: "The piezo stacks of a leg.",
        keys: &[
            row("stacks", integer(1, 1000), Required, "", "5", "Stacks in series in one leg."),
            row("stack_gain", one(Dimension::PIEZO_GAIN, Range::closed(1e-12, 1e-4), "um/V"), Required, "rho", "\"0.1262 um/V\"", "Displacement per volt of one stack; a leg has `stacks` times that: the gain of (AII.1)."),
            row("stroke", one(Dimension::LENGTH, Range::closed(1e-9, 0.01), "um"), Required, "", "\"60 um\"", "Free stroke of a leg."),
            row("voltage", Shape::List(&[VOLTS; 2]), Required, "", "[\"0 V\", \"100 V\"]", "Smallest and largest voltage that the controller may ask for."),
            row("slew_rate", one(Dimension::SLEW_RATE, Range::closed(1e-3, 1e12), "V/ms"), Required, "", "\"40 V/ms\"", "Fastest change of voltage that amplifier and stack stand."),
            row("axial_stiffness", one(Dimension::STIFFNESS, Range::closed(1.0, 1e12), "N/m"), Required, "k_a", "\"1e7 N/m\"", "Axial stiffness of a leg."),
            row("resonance", one(Dimension::FREQUENCY, Range::closed(0.1, 1e7), "Hz"), Required, "", "\"870 Hz\"", "First axial resonance of a leg as mounted."),
            row("damping_ratio", Shape::One(Item::Number(Range::open(0.0, 1.0))), Required, "zeta", "0.1", "Damping ratio of that resonance."),
            row("capacitance", one(Dimension::CAPACITANCE, Range::above(0.0, 1.0), "uF"), Optional, "", "\"35 uF\"", "Of all stacks of a leg together, for the current that their voltage takes."),
        ],
    },
    Section {
        name: "amplifier",
        kind: Kind::Plain,
        doc: "Power amplifier between converter and stack. No lag is the cautious default: lag damps the resonance.",
        keys: &[
            row("lag", one(Dimension::TIME, Range::closed(0.0, 10.0), "ms"), Default("\"0 ms\""), "", "\"0.35 ms\"", "Time constant of its first-order lag."),
            row("noise", one(Dimension::VOLTAGE, Range::closed(0.0, 100.0), "mV"), Default("\"0 V\""), "", "\"2 mV\"", "Output noise, rms."),
            row("current", one(Dimension::CURRENT, Range::above(0.0, 1e4), "mA"), Optional, "", "\"2 A\"", "Largest output current for one leg; slew rate and trajectories are held against it with `actuator.capacitance`."),
        ],
    },
    Section {
        name: "dac",
        kind: Kind::Plain,
        doc: "Converter that drives the amplifier, in volts at the stack.",
        keys: &[
            row("bits", integer(8, 24), Required, "", "16", "Resolution."),
            row("range", Shape::List(&[VOLTS; 2]), Required, "", "[\"0 V\", \"150 V\"]", "Voltage at code 0 and at full scale."),
        ],
    },
    Section {
        name: "sensor",
        kind: Kind::Plain,
        doc: "Displacement gauge of a leg; with [control], of the six that see the platform.",
        keys: &[
            row("range", Shape::List(&[READING; 2]), Required, "", "[\"-2 um\", \"48 um\"]", "Smallest and largest displacement that it can report."),
            row("noise", one(Dimension::LENGTH, Range::closed(0.0, 1e-3), "nm"), Default("\"0 nm\""), "", "\"2.2 nm\"", "Noise, rms."),
            row("bits", integer(8, 32), Required, "", "16", "Resolution of its converter over the range."),
            row("input_range", Shape::List(&[VOLTS; 2]), Rule("[\"-10 V\", \"10 V\"]"), "", "[\"0 V\", \"10 V\"]", "With a calibration: voltage of its converter at code 0 and at full scale."),
            row("calibration", CALIBRATION, Rule("the gauge words are metres"), "", "[\"-2 um\", \"5 um/V\"]", "With [control]: displacement as a polynomial of the gauge's voltage, lowest power first; the gauge words are then volts. For all six gauges; a gauge may have its own."),
        ],
    },
    Section {
        name: "hysteresis",
        kind: Kind::Plain,
        doc: "The inverse Preisach model and the measurements that identify it.",
        keys: &[
            row("grid", integer(2, MAX_GRID as i64), Default("32"), "N", "32", "Intervals per axis of the Preisach plane; the table grows and the error falls with its square."),
            row("memory", integer(8, 256), Default("64"), "", "64", "Reversals that the controller can remember."),
            row("records", Shape::Records, Required, "", "[\"records/reference-forc.csv\"]", "Reversal-curve files, relative to the spec: one for all legs, or six. A table that `specgen identify -o` wrote is taken as it is."),
            row("rate", Shape::One(Item::Choice(&["static", "dynamic-preisach", "creep"])), Default("\"static\""), "", "\"creep\"", "Rate dependence in model and inverse: none; the dynamic Preisach model (6); creep behind the static model. `specgen identify rate` finds out which is worth it."),
            row("rate_tables", Shape::Records, Rule("error with rate = \"dynamic-preisach\""), "mu_1", "[\"records/leg-mu1.csv\"]", "With \"dynamic-preisach\": tables of the second weight as `specgen identify rate -o` writes them, one for all legs or six."),
            row("creep_times", CREEP_TIMES, Rule("error with rate = \"creep\""), "", "[\"0.8 s\", \"40 ms\"]", "With \"creep\": time constants of up to six creep operators in parallel."),
            row("creep_weights", CREEP_WEIGHTS, Rule("error with rate = \"creep\""), "", "[0.03, 0.09]", "With \"creep\": what each adds in the end, as a share of the static displacement; their sum is below 1."),
            row("dead_time", one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Default("\"0 ms\""), "", "\"0.13 ms\"", "Of six legs with their own gauges: time by which the displacement lags the drive. The demand is led by it, less half a period. With [control] it is `control.lead`."),
        ],
    },
    Section {
        name: "adaptation",
        kind: Kind::Plain,
        doc: "Run-to-run adaptation, Appendix B. A mode that uses a weight needs it, as weight per run or as bandwidth. With [control] both bandwidths are given, or neither: the compiler then derives them.",
        keys: &[
            row("mode", Shape::One(Item::Choice(&["invhys", "ewma", "pcc"])), Default("\"invhys\""), "", "\"pcc\"", "Inverse model alone; with the level estimate (AII.3); with level and drift (AII.5), (AII.6)."),
            row("level_weight", WEIGHT, InsteadOf("level_bandwidth"), "omega_1", "0.252", "Weight of a new reading in the level estimate, per run: (AII.3), (AII.5)."),
            row("level_bandwidth", BANDWIDTH, InsteadOf("level_weight"), "", "\"450 rad/s\"", "The same as a bandwidth: weight = bandwidth x period x run_interval."),
            row("drift_weight", WEIGHT, InsteadOf("drift_bandwidth"), "omega_2", "0.011", "Weight of a new reading in the drift estimate, per run: (AII.6)."),
            row("drift_bandwidth", BANDWIDTH, InsteadOf("drift_weight"), "", "\"20 rad/s\"", "The same as a bandwidth."),
            row("run_interval", integer(1, LARGEST_RUN_INTERVAL as i64), Default("1"), "", "1", "Control ticks per run."),
            row("gain_ratio", Shape::List(&[RATIO; 2]), Default("[0.9, 1.1]"), "lambda", "[0.9, 1.1]", "Smallest and largest true gain over modelled gain for which the loop must be stable: (AII.18), (AII.19)."),
        ],
    },
    Section {
        name: "control",
        kind: Kind::Optional,
        doc: "The task-space controller of section 4. With it the six gauges see the platform ([[gauge]]); without it each leg has its own gauge and its own feed-forward.",
        keys: &[
            row("mode", Shape::One(Item::Choice(&["p/f", "p", "f"])), Default("\"p/f\""), "", "\"p/f\"", "Loops closed at start-up: position feedback and feed-forward, feedback alone, feed-forward alone. How the feed-forward adapts is `adaptation.mode`."),
            row("modal_damping", Shape::One(Item::Number(Range::open(0.0, 1.0))), Required, "zeta", "0.02", "Damping ratio of the lowest mode of the platform on its legs. Give what is measured, or less: less is the cautious side."),
            row("notch", Shape::One(Item::Flag), Default("true"), "", "true", "Whether a modal notch stands in the feedback; without one the bandwidth falls to about a twelfth."),
            row("notch_damping", Shape::One(Item::Number(Range::above(0.0, 1.0))), Rule("1, with a notch"), "zeta_d", "1.0", "Damping ratio that the notch leaves of each mode, above `modal_damping`."),
            row("velocity_cutoff", BANDWIDTH, Rule("0.6 pi rad / period"), "", "\"9e3 rad/s\"", "First-order low-pass of the pose derivative, below half the tick rate (pi rad / period)."),
            row("interaction", Shape::One(Item::Choice(&["none", "modelled", "measured"])), Default("\"none\""), "", "\"none\"", "Where the interaction force (5) in (7) comes from: nowhere, the stiffness of [control.environment], or a force sensor on the `wrench` words."),
            row("lead", one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Default("\"0 ms\""), "", "\"0.2 ms\"", "Time by which the leg displacements are asked for early, in proportion to their rate: about the amplifier lag less one period. Takes out part of the lag of fast motion; a set-point that steps is overshot by step x lead / period for one tick."),
            row("transfer_time", one(Dimension::TIME, Range::closed(1e-6, 100.0), "ms"), Default("\"50 ms\""), "", "\"50 ms\"", "Time constant with which the offset of a change of mode fades, where neither estimates nor an integral on every axis take it over, as in F with Invhys."),
        ],
    },
    Section {
        name: "control.environment",
        kind: Kind::Optional,
        doc: "The work piece that the platform presses on, (5), in the order x, y, z, theta_x, theta_y, theta_z at P_C.",
        keys: &[
            row("stiffness", Shape::List(STIFFNESSES), Required, "K_e", "[\"0 N/m\", \"0 N/m\", \"3e6 N/m\", \"0 N m/rad\", \"0 N m/rad\", \"0 N m/rad\"]", "Diagonal of its stiffness."),
            row("rest", Shape::List(POSE), Default(NO_POSE), "h_e", NO_POSE, "Pose, from rest, at which it is unloaded."),
        ],
    },
    Section {
        name: "control.setpoint",
        kind: Kind::Plain,
        doc: "Limits of the set-point generator, in the order x, y, z, theta_x, theta_y, theta_z of {B}.",
        keys: &[
            row("bias", Shape::List(POSE), Default(NO_POSE), "", "[\"0 um\", \"0 um\", \"10 um\", \"0 urad\", \"0 urad\", \"0 urad\"]", "Pose, from rest, that every set-point is added to: room for corrections downward. It is approached slowly after start-up."),
            row("speed", Shape::List(SPEEDS), Default(SLOW_SPEED), "", SLOW_SPEED, "Largest speed of bias and point-to-point moves."),
            row("acceleration", Shape::List(ACCELERATIONS), Default(SLOW_ACCELERATION), "", SLOW_ACCELERATION, "Their largest acceleration."),
            row("jerk", Shape::List(JERKS), Default(SLOW_JERK), "", SLOW_JERK, "Their largest jerk."),
            row("stop_acceleration", Shape::List(ACCELERATIONS), Rule("derived from the platform's modes, `amplifier.lag`, `actuator.slew_rate` and `actuator.stroke`, for a stop from `stream_speed`"), "", "[\"5 m/s^2\", \"5 m/s^2\", \"5 m/s^2\", \"50 rad/s^2\", \"50 rad/s^2\", \"50 rad/s^2\"]", "Largest deceleration of stops: of a stream that runs dry or is not believed, and of any motion that another command ends. The rate falls smoothly, from v to 0 in 1.5 v over this at least, over half of v times that time, and never within less than two thirds of the time that a stop from the largest declared speed takes; `specgen check` states the distances."),
            row("stop_jerk", Shape::List(JERKS), Rule("the jerk at which a stop from the largest declared speed just reaches `stop_acceleration`"), "", "[\"1e4 m/s^3\", \"1e4 m/s^3\", \"1e4 m/s^3\", \"1e5 rad/s^3\", \"1e5 rad/s^3\", \"1e5 rad/s^3\"]", "Their largest jerk."),
            row("stream_speed", Shape::List(SPEEDS), Default(STREAM_SPEED), "", STREAM_SPEED, "A streamed set-point further from the last one than this in a period is a jump, and refused."),
            row("stale_ticks", integer(1, 1_000_000), Default("10"), "", "10", "A stream that brings nothing new for so many ticks is stale, and the last set-point is held."),
        ],
    },
    Section {
        name: "control.frames",
        kind: Kind::Plain,
        doc: "Coordinates that set-points are given in.",
        keys: &[
            row("work", Shape::List(FRAME), Default(NO_POSE), "", "[\"0 mm\", \"0 mm\", \"0 mm\", \"0 deg\", \"0 deg\", \"30 deg\"]", "Work frame in {B}, about P_C at rest: offset and angles, R = Rz Ry Rx."),
            row("tool", Shape::List(&[CENTER; 3]), Default("[\"0 mm\", \"0 mm\", \"0 mm\"]"), "", "[\"0 mm\", \"0 mm\", \"40 mm\"]", "Tool point in {P}: what set-points place, and what rotations turn about."),
        ],
    },
    Section {
        name: "gains",
        kind: Kind::Optional,
        doc: "Diagonal gains of (7) for P/F in the order x, y, z, theta_x, theta_y, theta_z. Without it the compiler derives them.",
        keys: GAINS,
    },
    Section {
        name: "position_gains",
        kind: Kind::Optional,
        doc: "The same for P alone.",
        keys: GAINS,
    },
    Section {
        name: "gauge",
        kind: Kind::Repeated(6, 6),
        doc: "One of the six gauges that see the platform, in the order of the gauge words; with [control], and with it alone. A gauge fixed in {B} measures along a line to a plane on the platform, from rest.",
        keys: &[
            row("point", Shape::List(&[CENTER; 3]), Required, "", "[\"80 mm\", \"0 mm\", \"180 mm\"]", "A point of the measuring line in {B}."),
            row("direction", Shape::List(&[DIRECTION; 3]), Required, "", "[0, 0, 1]", "Direction of the line in {B}, of any length: the reading grows when the target moves this way."),
            row("target_point", Shape::List(&[CENTER; 3]), Rule("`point`, at rest"), "", "[\"80 mm\", \"0 mm\", \"0 mm\"]", "A point of the target plane in {P}."),
            row("target_normal", Shape::List(&[DIRECTION; 3]), Rule("`direction`"), "", "[0, 0, 1]", "Normal of the target plane in {P}, of any length and either sign."),
            row("calibration", CALIBRATION, Rule("`sensor.calibration`"), "", "[\"-2 um\", \"5 um/V\"]", "Displacement of this gauge as a polynomial of its voltage, lowest power first."),
        ],
    },
    Section {
        name: "trajectory",
        kind: Kind::Repeated(0, MAX_TABLES),
        doc: "A trajectory that the controller can play, numbered from 0 in the order of the file; with [control] alone.",
        keys: &[
            row("name", Shape::One(Item::Name), Required, "", "\"circle\"", "Its name, once in the file."),
            row("kind", Shape::One(Item::Choice(&["case-1", "case-2", "machining", "waveform"])), Required, "", "\"case-1\"", "One of the paper's paths, or a table of poses."),
            row("frequency", one(Dimension::FREQUENCY, Range::closed(1e-3, 1e3), "Hz"), Rule("error, but for a waveform"), "f_c", "\"1 Hz\"", "Of a paper's path: operating frequency."),
            row("as_printed", Shape::One(Item::Flag), Rule("`false`"), "", "false", "Of a paper's path: the formulas as printed, with their jumps."),
            row("file", Shape::One(Item::File), Rule("error for a waveform"), "", "\"waveforms/circle.csv\"", "Of a waveform: the table of poses, a CSV file relative to the spec."),
            row("period", one(Dimension::TIME, Range::closed(1e-6, 3600.0), "ms"), Rule("error for a waveform"), "", "\"1 ms\"", "Of a waveform: time from one row to the next."),
            row("repeat", Shape::One(Item::Flag), Rule("`false`"), "", "false", "Of a waveform: whether it begins again after the last row."),
        ],
    },
    Section {
        name: "timing",
        kind: Kind::Plain,
        doc: "Control timing.",
        keys: &[row("period", one(Dimension::TIME, Range::closed(1e-6, 10.0), "us"), Required, "T_s", "\"200 us\"", "Control period.")],
    },
    Section {
        name: "workspace",
        kind: Kind::Plain,
        doc: "Bounds on the pose that may be asked for, from rest.",
        keys: &[
            row("translation", Shape::List(&[TRAVEL; 3]), Required, "", "[\"40 um\", \"40 um\", \"40 um\"]", "Bounds on |x|, |y|, |z|."),
            row("rotation", Shape::List(&[TURN; 3]), Required, "", "[\"0.6 mrad\", \"0.6 mrad\", \"0.6 mrad\"]", "Bounds on |theta_x|, |theta_y|, |theta_z|."),
        ],
    },
    Section {
        name: "controller",
        kind: Kind::Plain,
        doc: "What is emitted.",
        keys: &[
            row("scalar", Shape::One(Item::Choice(&["f32", "f64"])), Default("\"f64\""), "", "\"f64\"", "Arithmetic of the controller."),
            row("setpoint", Shape::One(Item::Choice(&["pose", "leg"])), Default("\"pose\""), "", "\"pose\"", "What the six set-point numbers are at start-up: a pose, or leg displacements."),
        ],
    },
    Section {
        name: "requirements",
        kind: Kind::Optional,
        doc: "What the platform is for. A spec that cannot meet it is refused.",
        keys: &[row("precision", one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "\"50 nm\"", "Finest displacement that matters. No converter code may move a leg by more, nor half a code on every leg the platform along an axis.")],
    },
    Section {
        name: "supervisor",
        kind: Kind::Plain,
        doc: "What the supervisor in the controller takes for a fault, and for how long it must last; docs/supervisor.md. Gauges are looked at in turn, one a tick.",
        keys: &[
            row("rest_voltage", Shape::One(VOLTS), Rule("0 V, or the limit of `actuator.voltage` that is nearest to it"), "", "\"0 V\"", "Voltage at which the legs stand while disarmed and to which they ramp down. Amplifiers that are switched off leave a stack at 0 V: from any other rest it jumps when they are switched on and off."),
            row("arm_time", TIMEOUT, Rule("100 ms, at least a period"), "", "\"100 ms\"", "Time without any condition that arming takes. Of six legs with their own gauges also the time constant with which the set-point is approached from where the legs are."),
            row("ramp_rate", one(Dimension::SLEW_RATE, Range::closed(1e-3, 1e12), "V/ms"), Rule("the whole voltage in a second, or `actuator.slew_rate` if that is less"), "", "\"0.1 V/ms\"", "Rate at which voltages go to rest when they ramp down, at most the slew rate."),
            row("gauge_time", TIMEOUT, Rule("10 ms, at least a period"), "", "\"10 ms\"", "Time after which a gauge that is not finite or out of range, or a converter that does not answer, is a fault."),
            row("stuck_motion", one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "nm"), Rule("10 steps of the gauge's converter or 10 times `sensor.noise`, whichever is more"), "", "\"100 nm\"", "Motion along a gauge that the voltages sent must have caused before an unchanged reading shows that the gauge is stuck."),
            row("stuck_time", TIMEOUT, Rule("50 ms, at least 12 periods"), "", "\"50 ms\"", "Time after that for which the reading must still be the same."),
            row("disagreement", one(Dimension::LENGTH, Range::closed(1e-12, 1e-2), "um"), Rule("a fifth of `actuator.stroke`"), "", "\"12 um\"", "Largest difference between a gauge's reading and what the hysteresis model gives for the voltages sent and the known load."),
            row("disagreement_time", TIMEOUT, Rule("100 ms, at least 12 periods"), "", "\"100 ms\"", "Time for which it must be larger."),
            row("tracking_error", Shape::One(Item::Number(Range::above(0.0, 10.0))), Default("0.2"), "", "0.2", "Largest tracking error of each axis, as a share of its workspace bound; of six legs with their own gauges, of a leg as a share of `actuator.stroke`."),
            row("tracking_time", TIMEOUT, Rule("100 ms, at least 12 periods"), "", "\"100 ms\"", "Time for which it must be larger."),
            row("voltage_time", TIMEOUT, Rule("500 ms, at least a period"), "", "\"500 ms\"", "Time that a leg may stay at a limit of its voltage or table."),
            row("slew_time", TIMEOUT, Rule("50 ms, at least a period"), "", "\"50 ms\"", "Time that a leg may stay at the limit of its slew rate."),
            row("missed_ticks", integer(1, 1000), Default("3"), "", "3", "Missed ticks within a second that are a fault."),
            row("host_lost", Shape::List(&[SILENCE; 2]), Rule("[\"100 ms\", \"10 s\"]"), "", "[\"100 ms\", \"10 s\"]", "How long a host that has the orders may be silent until the machine holds, and until it ramps down and switches off. A converter that stays silent holds after `gauge_time`, and ramps down after the second time."),
        ],
    },
    Section {
        name: "target",
        kind: Kind::Plain,
        doc: "What it runs on.",
        keys: &[row("mcu", Shape::One(Item::Choice(&["mps2-an500", "mps2-an386", "stm32h743zi", "stm32f446re"])), Default("\"mps2-an500\""), "", "\"mps2-an500\"", "Microcontroller: `mps2-an500` and `stm32h743zi` are a Cortex-M7 with double-precision FPU, `mps2-an386` and `stm32f446re` a Cortex-M4F with single precision; the first of each is emulated.")],
    },
    Section {
        name: "target.budget",
        kind: Kind::Plain,
        doc: "What it may use there; a build that needs more is refused.",
        keys: &[
            row("flash", BYTES, Optional, "", "\"128 KiB\"", "Flash."),
            row("ram", BYTES, Optional, "", "\"32 KiB\"", "RAM, stack included."),
            row("stack", BYTES, Optional, "", "\"2 KiB\"", "Stack of one tick."),
            row("instructions", integer(1, 1_000_000_000), Optional, "", "3000", "Mean instructions per tick."),
        ],
    },
    Section {
        name: "robust",
        kind: Kind::Optional,
        doc: "What `specgen robust` varies: smallest and largest factor on what the other sections say, and the error that it lets pass. Nothing of it is in the controller.",
        keys: &[
            row("mass", FACTORS, Rule("[0.95, 1.05]"), "", "[0.95, 1.05]", "On mass and inertia of the platform."),
            row("stiffness", FACTORS, Rule("[0.95, 1.05]"), "", "[0.95, 1.05]", "On the axial stiffness of a leg."),
            row("damping", FACTORS, Rule("[0.7, 1.3]"), "", "[0.7, 1.3]", "On the damping ratio of the structure."),
            row("gain", FACTORS, Rule("`adaptation.gain_ratio`"), "lambda", "[0.9, 1.1]", "On the gain of a leg."),
            row("hysteresis", FACTORS, Rule("[0.9, 1.1]"), "", "[0.9, 1.1]", "On the width of a leg's hysteresis: the thresholds of its plays."),
            row("creep", FACTORS, Rule("[0.9, 1.1]"), "", "[0.9, 1.1]", "On the creep of a leg."),
            row("lag", FACTORS, Rule("[0.8, 1.2]"), "", "[0.8, 1.2]", "On the lag of an amplifier."),
            row("noise", FACTORS, Rule("[0.5, 1.5]"), "", "[0.5, 1.5]", "On the noise of gauges, amplifiers and force sensor."),
            row("delay_ticks", integer(0, 100), Rule("1"), "", "1", "Control intervals by which voltages come late, at most: none to so many are tried."),
            row("max_error", one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "\"200 nm\"", "Gate: largest rms error of the translation, or of the legs."),
            row("max_orientation", one(Dimension::ANGLE, Range::closed(1e-12, 0.1), "nrad"), Optional, "", "\"1 urad\"", "Gate: largest rms error of the angles."),
        ],
    },
];
