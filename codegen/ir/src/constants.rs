//! Converts constants of the IR to the runtime's types, in the scalar of the controller, for emitted text and for the law at run time.

use specgen_runtime::setpoint::{Axis, MoveLimits, Row, Segment, Setpoints, StopLimits, Trajectory};
use specgen_runtime::snapshot::Sizes;
use specgen_runtime::supervisor;
use specgen_runtime::trigger::Line;
use specgen_runtime::{
    Affine, CorrectionLimit, Dac, Gains, Gauges, Legs, Notch, PermittedRange, Platform, RateFilter, Real, Resonator,
    Section, Series,
};

use crate::scalar::{Constant, Numbers};
use crate::{self as ir, Ir, Range};

/// The converter.
pub fn dac<T: Real>(numbers: &impl Numbers<T>, a: &ir::Actuation) -> Dac<T> {
    Dac {
        volts_at_zero: numbers.real(a.volts_at_zero),
        volts_per_code: numbers.real(a.volts_per_code),
        cells_at_zero: numbers.real(a.cells_at_zero),
        cells_per_code: numbers.real(a.cells_per_code),
        codes_per_cell: numbers.real(a.codes_per_cell),
    }
}

/// Leg kinematics.
pub fn legs<T: Real>(numbers: &impl Numbers<T>, k: &ir::Kinematics) -> Legs<'static, T> {
    Legs {
        rest_leg: numbers.matrix(&k.rest_leg),
        platform_joint: numbers.matrix(&k.platform_joint),
        rest_length: numbers.vector(&k.rest_length),
        series: Series { sine: numbers.slice(&k.sine), versine: numbers.slice(&k.versine) },
        root: numbers.slice(&k.root),
        newton_steps: k.newton_steps as usize,
    }
}

/// Geometry of the six gauges of a platform.
pub fn gauges<T: Real>(numbers: &impl Numbers<T>, sensing: &ir::Sensing) -> Gauges<'static, T> {
    Gauges {
        direction: numbers.matrix(&sensing.direction),
        normal: numbers.matrix(&sensing.normal),
        skew: numbers.matrix(&sensing.skew),
        pierced: numbers.matrix(&sensing.pierced),
        inverse: numbers.matrix(&sensing.inverse),
        curvature: numbers.matrix(&sensing.curvature),
        passes: sensing.passes as usize,
        arc_sine: numbers.slice(&sensing.arc_sine),
        arc_tangent: numbers.slice(&sensing.arc_tangent),
    }
}

/// Constants of the set-point generator; poses are within ± `bound`.
pub fn setpoints<T: Real, F>(
    numbers: &impl Numbers<T>,
    bound: &[f64; 6],
    s: &ir::Setpoints,
    frames: F,
    trajectories: &'static [Trajectory<T>],
) -> Setpoints<T, F> {
    Setpoints {
        period: numbers.real(s.period),
        rate: numbers.real(s.rate),
        square_rate: numbers.real(s.square_rate),
        bias: numbers.vector(&s.bias),
        home: numbers.vector(&s.home),
        bound: numbers.vector(bound),
        limits: MoveLimits {
            speed: numbers.vector(&s.speed_limit),
            acceleration: numbers.vector(&s.acceleration_limit),
            jerk: numbers.vector(&s.jerk_limit),
        },
        stop: StopLimits {
            acceleration: numbers.vector(&s.stop_acceleration_limit),
            jerk: numbers.vector(&s.stop_jerk_limit),
            shortest: s.shortest_stop,
        },
        stream_step: numbers.vector(&s.stream_step),
        stream_rate: numbers.vector(&s.stream_rate),
        stream_acceleration: numbers.vector(&s.stream_acceleration),
        stale_ticks: s.stale_ticks,
        frames,
        trajectories,
    }
}

/// A piece of a trajectory.
pub fn segment<T: Real>(numbers: &impl Numbers<T>, segment: &ir::Segment) -> Segment<T> {
    Segment {
        first: segment.first.cast_signed(),
        per_tick: numbers.real(segment.per_tick),
        per_second: numbers.real(segment.per_second),
        phase: segment.phase,
        phase_step: segment.phase_step,
        angular: numbers.real(segment.angular),
        axes: segment.axes.map(|axis| Axis {
            place: numbers.real(axis.place),
            slope: numbers.real(axis.slope),
            sine: numbers.vector(&axis.sine),
            cosine: numbers.vector(&axis.cosine),
        }),
    }
}

/// A row of a trajectory.
pub fn row<T: Real>(numbers: &impl Numbers<T>, row: &ir::Row) -> Row<T> {
    Row { pose: numbers.vector(&row.pose), bend: numbers.vector(&row.bend) }
}

/// The inverse dynamics.
pub fn body<T: Real>(numbers: &impl Numbers<T>, dynamics: &ir::Dynamics) -> Platform<T> {
    dynamics.platform_of(|value| numbers.real(value))
}

/// First-order model of the load of a platform's legs, if it is used.
pub fn affine<T: Real>(numbers: &impl Numbers<T>, load: &ir::Load) -> Option<Affine<T>> {
    load.affine
        .as_ref()
        .map(|affine| Affine { pose: numbers.matrix(&affine.pose), acceleration: numbers.matrix(&affine.acceleration) })
}

/// Cross-talk of the legs beside the full kernel, if there is any.
pub fn cross_talk<T: Real>(numbers: &impl Numbers<T>, load: &ir::Load) -> Option<[[T; 6]; ir::LEGS]> {
    load.cross_talk.as_ref().map(|rows| numbers.matrix(rows))
}

/// The modal notch, if there is one.
pub fn notch<T: Real>(numbers: &impl Numbers<T>, law: &ir::ControlLaw) -> Option<Notch<T>> {
    law.notch.as_ref().map(|notch| Notch {
        sections: notch
            .sections
            .map(|section| Section { depth: numbers.real(section.depth), a: numbers.vector(&section.a) }),
        pose_to_modes: numbers.matrix(&notch.pose_to_modes),
        modes_to_pose: numbers.matrix(&notch.modes_to_pose),
    })
}

/// Active damping of each mode.
pub fn damping<T: Real>(numbers: &impl Numbers<T>, sections: &[ir::Resonator; 6]) -> [Resonator<T>; 6] {
    sections.map(|section| Resonator { b: numbers.vector(&section.b), a: numbers.vector(&section.a) })
}

/// Limits of the correction of each axis.
pub fn correction<T: Real>(numbers: &impl Numbers<T>, limits: &[ir::CorrectionLimit; 6]) -> [CorrectionLimit<T>; 6] {
    limits.map(|limit| CorrectionLimit { most: numbers.real(limit.most), step: numbers.real(limit.step) })
}

/// Gains of (7).
pub fn gains<T: Real>(numbers: &impl Numbers<T>, gains: &ir::Gains) -> Gains<T> {
    Gains {
        proportional: numbers.vector(&gains.proportional),
        integral: numbers.vector(&gains.integral),
        derivative: numbers.vector(&gains.derivative),
    }
}

/// The filter of the pose's rate.
pub fn rate_filter<T: Real>(numbers: &impl Numbers<T>, sensing: &ir::Sensing) -> RateFilter<T> {
    RateFilter { keep: numbers.real(sensing.rate_keep), gain: numbers.real(sensing.rate_gain) }
}

/// Settings of the output lines.
pub fn lines<T: Real>(numbers: &impl Numbers<T>, defaults: &ir::PlatformDefaults) -> Vec<Line<T>> {
    let of_line = |line: &ir::Line| Line {
        kind: line.kind,
        axis: line.axis,
        direction: line.direction,
        start: numbers.real(line.start),
        stop: numbers.real(line.stop),
        step: numbers.real(line.step),
        hysteresis: numbers.real(line.hysteresis),
        first: line.first,
        every: line.every,
        last: line.last,
        width: line.width,
    };
    defaults.triggers.iter().map(of_line).collect()
}

/// Ranges of the settings, run-length encoded: a range, and its number of words. Most gains have the same range, and a row for each
/// would take a kilobyte of flash.
pub fn permitted<T: Real>(numbers: &impl Numbers<T>, table: &ir::PermittedRanges) -> Vec<(PermittedRange<T>, usize)> {
    let ranges: Vec<Range> = table.words().map(|(_, range)| range).collect();
    let of_range = |range| match range {
        Range::Whole(least, most) => PermittedRange::Whole(least as u64, most as u64),
        Range::Number(least, most) => PermittedRange::Number(numbers.real(least), numbers.real(most)),
    };
    let alike = ranges.chunk_by(|a, b| a == b);
    alike.filter_map(|alike| Some((of_range(*alike.first()?), alike.len()))).collect()
}

/// Largest magnitudes of the numbers of a state.
pub fn sizes(ir: &Ir) -> Sizes {
    let s = &ir.permitted.state;
    Sizes {
        place: s.place,
        user: s.user,
        rate: s.rate,
        acceleration: s.acceleration,
        pose: s.pose,
        pose_rate: s.pose_rate,
        error: s.error,
        apart: s.apart,
        wrench: s.wrench,
        leg: s.leg,
        leg_rate: s.leg_rate,
        line: s.line,
        request: s.request,
        reading: s.reading,
        stiffness: s.stiffness,
        codes: [ir.actuation.code_min, ir.actuation.code_max],
        grid: ir.hysteresis.grid as f64,
        memory: ir.hysteresis.memory,
    }
}

/// Constants of the supervisor.
pub fn supervision<T: Real>(numbers: &impl Numbers<T>, s: &ir::Supervision) -> supervisor::Supervision<T> {
    let wiring = s.wiring.as_ref().map(|wiring| wiring.constants);
    supervisor::Supervision { wiring, ..s.constants }.of(numbers)
}
