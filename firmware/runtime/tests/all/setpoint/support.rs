//! A plan of the size of a piezo platform, in either scalar, and a user who keeps count of what comes out.
#![allow(dead_code)] // each test binary uses its own part

use specgen_runtime::Real;
use specgen_runtime::setpoint::{
    Axis, Command, CommandKind, Frames, Generator, MoveLimits, Row, Segment, Setpoints, StopLimits, Table, Target,
    Trajectory,
};

/// 10 kHz.
pub const PERIOD: f64 = 100e-6;
pub const SPEED: [f64; 6] = [100e-6, 100e-6, 100e-6, 1e-3, 1e-3, 1e-3];
pub const ACCELERATION: [f64; 6] = [10e-3, 10e-3, 10e-3, 0.1, 0.1, 0.1];
pub const JERK: [f64; 6] = [1.0, 1.0, 1.0, 10.0, 10.0, 10.0];
pub const STOP_ACCELERATION: [f64; 6] = [5.0, 5.0, 5.0, 50.0, 50.0, 50.0];
pub const STOP_JERK: [f64; 6] = [13e3, 13e3, 13e3, 130e3, 130e3, 130e3];
pub const STREAM_SPEED: [f64; 6] = [5e-3, 5e-3, 5e-3, 50e-3, 50e-3, 50e-3];
pub const BOUND: [f64; 6] = [50e-6, 50e-6, 60e-6, 0.3e-3, 0.3e-3, 0.4e-3];
pub const BIAS: [f64; 6] = [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0];
pub const STALE_TICKS: u32 = 10;

pub fn six<T: Real>(values: [f64; 6]) -> [T; 6] {
    values.map(T::from_f64)
}

pub fn plan<T: Real, F: Frames<T>>(frames: F, trajectories: Vec<Trajectory<T>>) -> Setpoints<T, F> {
    let scaled = |values: [f64; 6], factor: f64| six(values.map(|v| 1.0 / (v * factor)));
    Setpoints {
        period: T::from_f64(PERIOD),
        rate: T::from_f64(1.0 / PERIOD),
        square_rate: T::from_f64(1.0 / (PERIOD * PERIOD)),
        bias: six(BIAS),
        home: [T::ZERO; 6],
        bound: six(BOUND),
        limits: MoveLimits {
            speed: scaled(SPEED, PERIOD),
            acceleration: scaled(ACCELERATION, PERIOD * PERIOD),
            jerk: scaled(JERK, PERIOD * PERIOD * PERIOD),
        },
        stop: StopLimits {
            acceleration: scaled(STOP_ACCELERATION, PERIOD * PERIOD),
            jerk: scaled(STOP_JERK, PERIOD * PERIOD * PERIOD),
            shortest: 1,
        },
        stream_step: six(STREAM_SPEED.map(|v| v * PERIOD * (1.0 + 1e-5))),
        stream_rate: six(STREAM_SPEED),
        stream_acceleration: six(STREAM_SPEED.map(|v| v / PERIOD)),
        stale_ticks: STALE_TICKS,
        frames,
        trajectories: Box::leak(trajectories.into_boxed_slice()),
    }
}

/// A ramp of 2.5 µm in x in half a second, then two turns whose radius grows from 3 to 5 µm, in y and θx as well.
pub fn spiral<T: Real>() -> Trajectory<T> {
    let n = |value: f64| T::from_f64(value);
    let axis = |place: f64, slope: f64, sine: [f64; 2], cosine: [f64; 2]| Axis {
        place: n(place),
        slope: n(slope),
        sine: sine.map(n),
        cosine: cosine.map(n),
    };
    let still = axis(0.0, 0.0, [0.0; 2], [0.0; 2]);
    let ramp = Segment {
        first: 0,
        per_tick: n(1.0 / 5000.0),
        per_second: n(2.0),
        phase: 0,
        phase_step: 0,
        angular: n(0.0),
        axes: [axis(0.0, 2.5e-6, [0.0; 2], [0.0; 2]), still, still, still, still, still],
    };
    let turn = Segment {
        first: 5000,
        per_tick: n(1.0 / 20_000.0),
        per_second: n(0.5),
        phase: 0,
        phase_step: ((1_u128 << 64) / 10_000) as u64,
        angular: n(core::f64::consts::TAU),
        axes: [
            axis(5.5e-6, 2e-6, [0.0; 2], [-3e-6, -2e-6]),
            axis(0.0, 0.0, [3e-6, 2e-6], [0.0; 2]),
            still,
            axis(0.0, 0.0, [40e-6, 0.0], [0.0; 2]),
            still,
            still,
        ],
    };
    let end = six([2.5e-6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    Trajectory::Segments { start: [T::ZERO; 6], segments: Box::leak(Box::new([ramp, turn])), ticks: 25_000, end }
}

/// One turn of a circle of 5 µm through five nodes; the spline's second derivatives are those of the circle.
pub fn ring<T: Real>(repeat: bool) -> Trajectory<T> {
    let nodes = 64;
    let row_ticks = 50;
    let step = core::f64::consts::TAU / f64::from(nodes);
    let rows: Vec<Row<T>> = (0..=nodes)
        .map(|k| {
            let (s, c) = (step * f64::from(k % nodes)).sin_cos();
            // Of the periodic spline through samples of cos: m = −y (1 − cos s)/(2 + cos s) with s the step.
            let factor = -(1.0 - step.cos()) / (2.0 + step.cos());
            let pose = [5e-6 * c, 5e-6 * s, 0.0, 0.0, 0.0, 0.0];
            Row { pose: six(pose), bend: six(pose.map(|y| y * factor)) }
        })
        .collect();
    let row_time = f64::from(row_ticks) * PERIOD;
    Trajectory::Table(Table {
        rows: Box::leak(rows.into_boxed_slice()),
        row_ticks,
        per_tick: T::from_f64(1.0 / f64::from(row_ticks)),
        per_second: T::from_f64(1.0 / row_time),
        bend_rate: T::from_f64(6.0 / (row_time * row_time)),
        repeat,
    })
}

pub fn command<T: Real>(kind: CommandKind, pose: [f64; 6]) -> Command<T> {
    Command { kind, selector: 0, sequence: 0, target: Target::at(six(pose)) }
}

pub fn hold<T: Real>() -> Command<T> {
    command(CommandKind::Hold, [0.0; 6])
}

/// A stored trajectory.
pub fn trajectory(selector: u32) -> Command<f64> {
    Command { selector, ..command(CommandKind::Trajectory, [0.0; 6]) }
}

/// A set-point of a stream along x, with its rate.
pub fn streamed(sequence: u32, x: f64, rate: f64) -> Command<f64> {
    let mut command = Command { sequence, ..command(CommandKind::Stream, [x, 0.0, 0.0, 0.0, 0.0, 0.0]) };
    command.target.rate[0] = rate;
    command
}

pub fn doubles<T: Real + Into<f64>>(values: [T; 6]) -> [f64; 6] {
    values.map(Into::into)
}

/// A generator that stands at the bias pose.
pub fn ready<T: Real, F: Frames<T>>(plan: &Setpoints<T, F>) -> Generator<T> {
    let mut generator = Generator::new();
    for _ in 0..100_000 {
        let (_, status) = generator.next(plan, &hold());
        if status == 0 {
            return generator;
        }
    }
    panic!("the bias is never reached");
}

/// What a sequence of set-points breaks, if anything.
pub struct Watch {
    last: [f64; 6],
    /// Largest step of each axis, m and rad.
    pub step: [f64; 6],
    /// Largest |rate| of each axis.
    pub rate: [f64; 6],
}

impl Watch {
    pub fn new(from: [f64; 6], step: [f64; 6], rate: [f64; 6]) -> Self {
        Self { last: from, step, rate }
    }

    /// The first promise that the next set-point breaks: finite, in the workspace, no larger step or rate.
    pub fn broken<T: Real + Into<f64>>(&mut self, target: &Target<T>) -> Option<String> {
        let numbers = [target.pose, target.rate, target.acceleration].map(doubles);
        if numbers.iter().flatten().any(|x| !x.is_finite()) {
            return Some(format!("not finite: {numbers:?}"));
        }
        for axis in 0..6 {
            let (pose, rate) = (numbers[0][axis], numbers[1][axis]);
            let epsilon = if T::SINGLE { 2.0 * f64::from(f32::EPSILON) } else { f64::EPSILON };
            let rounding = epsilon * BOUND[axis];
            if pose.abs() > BOUND[axis] * (1.0 + epsilon) {
                return Some(format!("axis {axis} outside: {pose:e}"));
            }
            let step = (pose - self.last[axis]).abs();
            if step > self.step[axis] + 2.0 * rounding {
                return Some(format!("axis {axis} jumps by {step:e} from {:e}", self.last[axis]));
            }
            if rate.abs() > self.rate[axis] * (1.0 + 8.0 * epsilon) {
                return Some(format!("axis {axis} rate {rate:e}"));
            }
        }
        self.last = numbers[0];
        None
    }
}
