//! The table of permitted settings: the ranges of values that a spec could have.

use specgen_runtime::ControlMode;
use specgen_runtime::snapshot::{LARGEST, LARGEST_PLACE};
use specgen_runtime::trigger::LONGEST;

use super::triggers;
use crate::ir::{
    Actuation, Bounds, ControlLaw, Defaults, Frames, Hysteresis, Kinematics, Notch, PermittedRanges, Range, RateModel,
    Resonator, Scalar, Sensing, Setpoints, Setting, State, TaskSpace,
};
use specgen_language::model::{LARGEST_GAIN, LARGEST_RUN_INTERVAL, LARGEST_TRAVEL, LARGEST_TURN};
use specgen_numerics::Matrix6;

/// Margin on the bounds below, which neglect quadratic terms and rounding.
const MARGIN: f64 = 16.0;
/// Relative rounding error of a pose in the user's coordinates.
const ROUNDING: f64 = 1e-5;
/// Largest number in a state: products with constants stay finite in both scalars.
const FINITE: f64 = 1e30;

pub(super) fn lower(
    actuation: &Actuation,
    defaults: &Defaults,
    task: Option<&TaskSpace>,
    bounds: &Bounds,
    hysteresis: &Hysteresis,
    kinematics: &Kinematics,
    scalar: Scalar,
) -> PermittedRanges {
    let codes = Range::Whole(actuation.code_min, actuation.code_max);
    let code_limits = [
        one(
            "max_step_codes",
            Range::Whole(1, defaults.max_step),
            "codes",
            "Largest change of a leg's code in a tick.",
            "`actuator.slew_rate`",
        ),
        one("code_min", codes, "codes", "Lowest code; at most `code_max`.", "`actuator.voltage`"),
        one("code_max", codes, "codes", "Highest code.", "`actuator.voltage`"),
    ];
    let weight = Range::Number(0.0, 1.0);
    let weights = [
        one(
            "level_weight",
            weight,
            "",
            "ω (EWMA) or ω1 (PCC): weight of a new reading in the level estimate.",
            "`adaptation.level_weight`",
        ),
        one(
            "drift_weight",
            weight,
            "",
            "ω2 (PCC): weight of a new reading in the drift estimate.",
            "`adaptation.drift_weight`",
        ),
    ];
    let legs = legs(hysteresis, bounds, kinematics);
    let (settings, state) = match task {
        None => {
            let mut settings = vec![
                one("mode", Range::Whole(0, 2), "", "0 invhys, 1 ewma, 2 pcc.", "`adaptation.mode`"),
                one("setpoint_kind", Range::Whole(0, 1), "", "0 pose, 1 leg displacements.", "`controller.setpoint`"),
            ];
            settings.extend(weights);
            settings.push(one(
                "run_interval",
                Range::Whole(1, LARGEST_RUN_INTERVAL),
                "ticks",
                "Control ticks per run.",
                "`adaptation.run_interval`",
            ));
            settings.extend(code_limits);
            (settings, of_legs(bounds, kinematics, legs))
        }
        Some(task) => {
            let mut settings = vec![
                one(
                    "mode",
                    Range::Whole(0, ControlMode::WORDS.len() as i32 - 1),
                    "",
                    ControlMode::MEANING,
                    "`control.mode`, `adaptation.mode`",
                ),
                one(
                    "interaction",
                    Range::Whole(0, 2),
                    "",
                    "0 neglected, 1 modelled, 2 measured.",
                    "`control.interaction`",
                ),
            ];
            settings.extend(weights);
            settings.extend(code_limits);
            settings.extend(of_gains(scalar));
            settings.extend((0..task.defaults.triggers.len()).flat_map(|line| of_line(line, &bounds.pose, scalar)));
            (settings, of_platform(task, bounds, legs, defaults.period))
        }
    };
    let state = State { reading: scalar.round(state.reading), stiffness: scalar.round(LARGEST_GAIN), ..state };
    PermittedRanges { settings, state }
}

/// Largest displacement of a leg, m, and its addition by one cell per tick: from the tables and their rate terms, and as demanded.
fn legs(hysteresis: &Hysteresis, bounds: &Bounds, kinematics: &Kinematics) -> [f64; 2] {
    let full = |tables: &[Vec<f64>]| largest(tables.iter().flatten().copied());
    let still = full(&hysteresis.tables);
    // An upper bound: twice the model's creep, or motion, from one end to the other.
    let (displacement, rate) = match &hysteresis.rate {
        None => (still, 0.0),
        Some(RateModel::DynamicPreisach { tables, .. }) => {
            let rate = full(tables);
            (still + hysteresis.grid as f64 * rate, rate)
        }
        Some(RateModel::Creep { weights, .. }) => (still * (1.0 + weights.iter().map(|w| w.abs()).sum::<f64>()), 0.0),
        Some(RateModel::BoucWen { legs, .. }) => {
            let creep = legs.iter().map(|leg| leg.travel[1] * (1.0 + leg.weights.iter().sum::<f64>()));
            (largest(creep.chain([still])), 0.0)
        }
    };
    let lead = hysteresis.lead.as_ref().map_or(0.0, |lead| lead.limit);
    let demanded = largest(bounds.leg.into_iter().chain([bounds.stroke, kinematics.largest_displacement])) + lead;
    [2.0 * if displacement > demanded { displacement } else { demanded }, 2.0 * rate]
}

/// Six legs with their own gauges: set-points are poses or displacements.
fn of_legs(bounds: &Bounds, kinematics: &Kinematics, [leg, leg_rate]: [f64; 2]) -> State {
    let reading = largest(bounds.sensor);
    // A leg starts at its reading; its pose is to first order, which the margin covers.
    let leg = largest([leg, reading]);
    let place = core::array::from_fn(|axis| {
        let seen: f64 = kinematics.inverse_jacobian[axis].iter().map(|value| value.abs() * leg).sum();
        MARGIN * largest([bounds.pose[axis], leg, seen])
    });
    State {
        place,
        user: place,
        leg,
        leg_rate,
        reading,
        // Estimates are averages of readings less displacements, and differences of these.
        request: 4.0 * (reading + leg),
        // Not used for six legs.
        rate: [LARGEST; 6],
        acceleration: [LARGEST; 6],
        pose: [LARGEST_PLACE; 6],
        pose_rate: [LARGEST; 6],
        error: LARGEST_PLACE,
        apart: [MARGIN * (reading + leg); 6],
        wrench: [LARGEST; 6],
        line: LARGEST_PLACE,
        stiffness: LARGEST_GAIN,
    }
}

/// A platform under a generator of set-points, `period` in s.
fn of_platform(task: &TaskSpace, bounds: &Bounds, [leg, leg_rate]: [f64; 2], period: f64) -> State {
    let place = bounds.pose;
    let user = user(&task.setpoints, &place);
    let reading = largest(task.sensing.raw_limits.into_iter().flatten());
    let pose = measured(&task.sensing);
    // An upper bound: from one end to the other in a tick, and back in the next.
    let far: [f64; 6] =
        core::array::from_fn(|axis| largest([user[axis], place[axis], task.setpoints.stream_rate[axis] * period]));
    let rate = far.map(|far| MARGIN * far / period);
    let apart = largest(place) + largest(pose);
    let error = error(&task.law, apart);
    State {
        place,
        user,
        rate,
        acceleration: rate.map(|rate| MARGIN * rate / period),
        pose,
        pose_rate: pose.map(|pose| MARGIN * pose / period),
        error: MARGIN * error,
        apart: core::array::from_fn(|axis| (1.0 + ROUNDING) * (place[axis] + pose[axis])),
        wrench: task.law.wrench_limit,
        leg,
        leg_rate,
        line: triggers::extent(&place)[0] * 2.0,
        request: largest_request(&task.law, apart, error),
        reading,
        stiffness: LARGEST_GAIN,
    }
}

/// The workspace in the user's coordinates, m and rad: t = W q − (R − I) c + bias, with |R − I| at most the sum of the angles.
fn user(setpoints: &Setpoints, place: &[f64; 6]) -> [f64; 6] {
    let away: [f64; 6] = core::array::from_fn(|axis| place[axis] + setpoints.bias[axis].abs());
    let [x, y, z, ..] = away;
    let arm = |point: &[f64; 3], turn: f64| point.iter().map(|value| value.abs()).sum::<f64>() * turn;
    let user = match &setpoints.frames {
        Frames::Parallel => away,
        Frames::Tool { point, .. } => {
            let shift = arm(point, away[3] + away[4] + away[5]);
            [x + shift, y + shift, z + shift, away[3], away[4], away[5]]
        }
        Frames::Work { point, largest_angle, .. } => {
            let far = x + y + z + arm(point, 3.0 * largest_angle);
            [far, far, far, *largest_angle, *largest_angle, *largest_angle]
        }
    };
    core::array::from_fn(|axis| (1.0 + ROUNDING) * largest([user[axis], place[axis], setpoints.home[axis].abs()]))
}

/// The largest pose that gauges measure within their limits, m and rad: to first order, which [`MARGIN`] covers.
fn measured(sensing: &Sensing) -> [f64; 6] {
    let reading = |gauge: usize| {
        let ends = sensing.raw_limits[gauge];
        match &sensing.calibration {
            None => largest(ends),
            // Each power at its maximum.
            Some(calibration) => {
                let end = largest(ends);
                calibration[gauge].iter().rev().fold(0.0, |sum: f64, coefficient| sum * end + coefficient.abs())
            }
        }
    };
    sensing.inverse.map(|row| MARGIN * (0..6).map(|gauge| row[gauge].abs() * reading(gauge)).sum::<f64>())
}

/// The largest magnitude.
fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most: f64, value| if value.abs() > most { value.abs() } else { most })
}

fn one(name: &'static str, range: Range, unit: &'static str, doc: &'static str, from: &'static str) -> Setting {
    Setting { name, six: false, line: None, unit: [unit; 2], range: [range; 2], doc, from }
}

/// Gains of (7) and the environment.
fn of_gains(scalar: Scalar) -> [Setting; 8] {
    let round = |value: f64| scalar.round(value);
    let gain = [Range::Number(0.0, round(LARGEST_GAIN)); 2];
    let six = |name, unit, doc, from| Setting { name, six: true, line: None, unit, range: gain, doc, from };
    let rest = [LARGEST_TRAVEL, LARGEST_TURN].map(|most| Range::Number(round(-most), round(most)));
    let (p, i, v) = (["N/m", "N m/rad"], ["N/(m s)", "N m/(rad s)"], ["N s/m", "N m s/rad"]);
    [
        six("kp", p, "k_p of P/F with EWMA or PCC.", "`gains.proportional`"),
        six("ki", i, "k_I of P/F with EWMA or PCC.", "`gains.integral`"),
        six("kv", v, "k_v of P/F with EWMA or PCC.", "`gains.derivative`"),
        six("position_kp", p, "k_p of P, and of P/F with Invhys.", "`position_gains.proportional`"),
        six("position_ki", i, "k_I of P, and of P/F with Invhys.", "`position_gains.integral`"),
        six("position_kv", v, "k_v of P, and of P/F with Invhys.", "`position_gains.derivative`"),
        six("environment_stiffness", p, "K_e: stiffness of the work piece.", "`control.environment.stiffness`"),
        Setting {
            range: rest,
            ..six(
                "environment_rest",
                ["m", "rad"],
                "h_e: pose from rest at which it is unloaded.",
                "`control.environment.rest`",
            )
        },
    ]
}

/// An output line. Positions of all axes have one range, because the axis is a setting, too.
fn of_line(line: usize, bounds: &[f64; 6], scalar: Scalar) -> [Setting; 11] {
    let [most, least] = triggers::extent(bounds).map(|value| scalar.round(value));
    let places = Range::Number(-most, most);
    let counts = |least| Range::Whole(least, i32::MAX);
    let from = "`trigger`";
    [
        one("trigger_kind", Range::Whole(0, 5), "", "0 off, 1 position, 2 level, 3 motion, 4 points, 5 ticks.", from),
        one("trigger_axis", Range::Whole(0, 5), "", "Axis of the pose: x y z θx θy θz.", from),
        one("trigger_direction", Range::Whole(0, 2), "", "0 both, 1 up, 2 down.", from),
        one("trigger_start", places, "m or rad", "First position, or lower end of the level.", from),
        one(
            "trigger_stop",
            places,
            "m or rad",
            "Last position, or upper end of the level; at least `trigger_start`.",
            from,
        ),
        one("trigger_step", Range::Number(least, 2.0 * most), "m or rad", "From position to position.", from),
        one(
            "trigger_hysteresis",
            Range::Number(0.0, 2.0 * most),
            "m or rad",
            "How far from a position it counts again.",
            from,
        ),
        one("trigger_first", counts(1), "", "First set-point or tick with a pulse, counted from 1.", from),
        one("trigger_every", counts(1), "", "Set-points or ticks from pulse to pulse.", from),
        one("trigger_last", counts(0), "", "Last one that may have a pulse; 0: there is no last.", from),
        one("trigger_width", Range::Whole(1, LONGEST), "ticks", "Length of a pulse.", from),
    ]
    .map(|setting| Setting { line: Some(line), ..setting })
}

/// Largest output of the notch if set-point and pose are `apart`, m and rad.
fn error(law: &ControlLaw, apart: f64) -> f64 {
    match &law.notch {
        None => apart,
        Some(notch) => norm(&notch.modes_to_pose) * ring(notch) * norm(&notch.pose_to_modes) * apart,
    }
}

/// Largest request to a leg under any settings, with estimates and notch, if set-point and pose are `apart` and the notch turns that
/// into `error`, m and rad. The integral has its largest permitted force, and every axis the largest gain.
fn largest_request(law: &ControlLaw, apart: f64, error: f64) -> f64 {
    let (to_modes, ring) = match &law.notch {
        None => (1.0, 1.0),
        Some(notch) => (norm(&notch.pose_to_modes), ring(notch)),
    };
    let modal = to_modes * apart;
    let lead = law.own_leads.iter().fold(law.lead, |most, lead| if *lead > most { *lead } else { most });
    let deflection = norm(&law.force_to_modes) * (LARGEST_GAIN * error + LARGEST);
    // Environment, damping, and all measured or computed terms of the motion.
    let load = norm(&law.wrench_to_legs) * (LARGEST_GAIN * (apart + 2.0 * LARGEST) + LARGEST) + lead * apart;
    // The offset of a bumpless change of mode is as large as the request.
    let damping = law.damping.as_ref().map_or(0.0, |sections| modal * resounds(sections));
    let correction = law.correction.as_ref().map_or(0.0, |limits| to_modes * (limits[0].most + limits[3].most));
    let request = 2.0 * (apart + load + norm(&law.modes_to_legs) * (deflection + damping + correction + 2.0));
    let innovation = modal + deflection + norm(&law.legs_to_modes) * 2.0 * request;
    let filtered = ring * innovation;
    let largest = MARGIN * if filtered > damping { filtered } else { damping };
    if largest < FINITE { largest } else { FINITE }
}

/// Largest sum of magnitudes of a row.
fn norm(matrix: &Matrix6) -> f64 {
    matrix
        .iter()
        .map(|row| row.iter().map(|value| value.abs()).sum())
        .fold(1.0, |most: f64, sum: f64| if sum > most { sum } else { most })
}

/// Largest ratio of output or state of the notch to its input: two poles of radius √a₂ sum up to at most 1/(1 − √a₂)².
fn ring(notch: &Notch) -> f64 {
    notch.sections.iter().fold(1.0, |most: f64, section| {
        let fades = 1.0 - libm::sqrt(section.a[1].abs());
        let rings = 1.0 + 8.0 * section.depth.abs() / (fades * fades);
        if fades > 0.0 && rings > most { rings } else { most }
    })
}

/// The same for active damping.
fn resounds(sections: &[Resonator; 6]) -> f64 {
    sections.iter().fold(1.0, |most: f64, Resonator { b, a }| {
        let fades = 1.0 - libm::sqrt(a[1].abs());
        let rings = 8.0 * (b[0].abs() + b[1].abs() + b[2].abs()) / (fades * fades);
        if fades > 0.0 && rings > most { rings } else { most }
    })
}
