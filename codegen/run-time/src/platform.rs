//! A platform in task space whose constants are read at run time.

use std::fmt::Debug;

use specgen_compiler::ir::{self, Frames, Ir, LEGS, Path, TaskSpace as Task};
use specgen_law::platform::{self, Config, Platform, TaskSpace, TickInput, TickOutput};
use specgen_law::{ConfigError, Reset, Spec, StateOf};
use specgen_runtime::setpoint::{
    Axis, MoveLimits, Row, Segment, Setpoints, StopLimits, Table as Rows, Tool, Trajectory, Work,
};
use specgen_runtime::snapshot::Sizes;
use specgen_runtime::supervisor::Supervision;
use specgen_runtime::trigger::Line;
use specgen_runtime::{
    Affine, Correction, CorrectionLimit, Dac, Damping, Gauges, Notch, Permitted, RateFilter, Real, Resonator, Section,
};

use crate::InvalidIr;
use crate::common::{self, Common};
use crate::convert::{Convert, kept};
use crate::engine::Constants;
use crate::memory::{Memory, Table};
use crate::parts::{LineSettings, Lines, Optional, Polynomials, UserFrames};

/// Input words of a controller without a correction, and with one.
const INPUT_NAMES: [&[&str]; 2] = [&platform::tick::input_names::<33>(), &platform::tick::input_names::<39>()];
/// Output words of a controller without output lines, and with some.
const OUTPUT_NAMES: [&[&str]; 2] = [
    &platform::tick::output_names::<{ platform::tick::output_words_with(0) }>(),
    &platform::tick::output_names::<{ platform::tick::output_words_with(1) }>(),
];

/// The constants.
#[derive(Debug)]
pub struct PlatformConstants<T: Real> {
    common: Common<T>,
    period: T,
    compliance: T,
    wrench_to_legs: [[T; 6]; LEGS],
    legs_to_wrench: [[T; LEGS]; 6],
    force_to_modes: [[T; 6]; 6],
    legs_to_modes: [[T; LEGS]; 6],
    modes_to_legs: [[T; 6]; LEGS],
    affine_load: Option<Affine<T>>,
    rest_force: [T; LEGS],
    wrench_limit: [T; 6],
    lead: T,
    own_leads: Vec<T>,
    transfer_keep: T,
    transfer_negligible: T,
    cells_per_metre: T,
    metres_per_cell: T,
    notch: Option<Notch<T>>,
    damping: Option<[Resonator<T>; 6]>,
    hands_over: bool,
    correction: Option<[CorrectionLimit<T>; 6]>,
    lines: LineSettings<T>,
    setpoints: Setpoints<T, UserFrames<T>>,
    gauges: Gauges<'static, T>,
    calibration: Option<Polynomials<T>>,
    raw_limits: [[T; 2]; 6],
    rate_filter: RateFilter<T>,
}

/// Them, for the law.
#[derive(Debug)]
pub struct PlatformSpec<T: Real>(&'static PlatformConstants<T>);

impl<T: Real> Clone for PlatformSpec<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real> Copy for PlatformSpec<T> {}

impl<T: Real> PartialEq for PlatformSpec<T> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl<T: Real + Debug> Spec for PlatformSpec<T> {
    type Real = T;
    type Law = TaskSpace;
    type Table = Table<T>;
    type Memory = Memory<T>;

    #[inline(always)]
    fn tables(&self) -> &[Table<T>; LEGS] {
        &self.0.common.tables
    }

    #[inline(always)]
    fn dac(&self) -> &Dac<T> {
        &self.0.common.dac
    }

    #[inline(always)]
    fn supervision(&self) -> &Supervision<T> {
        &self.0.common.supervision
    }

    #[inline(always)]
    fn readings_per_leg(&self) -> &[[T; LEGS]; 6] {
        &self.0.common.readings_per_leg
    }

    #[inline(always)]
    fn geometry(&self) -> &specgen_runtime::Legs<'_, T> {
        &self.0.common.geometry
    }

    #[inline(always)]
    fn inverse_jacobian(&self) -> &[[T; LEGS]; 6] {
        &self.0.common.inverse_jacobian
    }

    #[inline(always)]
    fn corrections(&self) -> usize {
        self.0.common.corrections
    }

    #[inline(always)]
    fn pose_bound(&self) -> &[T; 6] {
        &self.0.common.pose_bound
    }

    #[inline(always)]
    fn permitted(&self) -> &[(Permitted<T>, usize)] {
        &self.0.common.permitted
    }

    #[inline(always)]
    fn sizes(&self) -> Sizes {
        self.0.common.sizes
    }

    fn reset(&self) -> Reset<Self> {
        let common = &self.0.common;
        Reset { memory: *common.memory, displacement: common.displacement, code: common.code }
    }
}

impl<T: Real + Debug> Platform for PlatformSpec<T> {
    type Damping = Optional<Damping<T, 6>>;
    type Correction = Optional<Correction<T, 6>>;
    type Lines = Lines<T>;
    type Frames = UserFrames<T>;
    type Calibration = Polynomials<T>;

    #[inline(always)]
    fn period(&self) -> T {
        self.0.period
    }

    #[inline(always)]
    fn compliance(&self) -> T {
        self.0.compliance
    }

    #[inline(always)]
    fn wrench_to_legs(&self) -> &[[T; 6]; 6] {
        &self.0.wrench_to_legs
    }

    #[inline(always)]
    fn legs_to_wrench(&self) -> &[[T; 6]; 6] {
        &self.0.legs_to_wrench
    }

    #[inline(always)]
    fn force_to_modes(&self) -> &[[T; 6]; 6] {
        &self.0.force_to_modes
    }

    #[inline(always)]
    fn legs_to_modes(&self) -> &[[T; 6]; 6] {
        &self.0.legs_to_modes
    }

    #[inline(always)]
    fn modes_to_legs(&self) -> &[[T; 6]; 6] {
        &self.0.modes_to_legs
    }

    #[inline(always)]
    fn body(&self) -> &specgen_runtime::Platform<T> {
        &self.0.common.body
    }

    #[inline(always)]
    fn affine_load(&self) -> Option<&Affine<T>> {
        self.0.affine_load.as_ref()
    }

    #[inline(always)]
    fn rest_force(&self) -> &[T; LEGS] {
        &self.0.rest_force
    }

    #[inline(always)]
    fn wrench_limit(&self) -> &[T; 6] {
        &self.0.wrench_limit
    }

    #[inline(always)]
    fn lead(&self) -> T {
        self.0.lead
    }

    #[inline(always)]
    fn own_leads(&self) -> &[T] {
        &self.0.own_leads
    }

    #[inline(always)]
    fn transfer_keep(&self) -> T {
        self.0.transfer_keep
    }

    #[inline(always)]
    fn transfer_negligible(&self) -> T {
        self.0.transfer_negligible
    }

    #[inline(always)]
    fn cells_per_metre(&self) -> T {
        self.0.cells_per_metre
    }

    #[inline(always)]
    fn metres_per_cell(&self) -> T {
        self.0.metres_per_cell
    }

    #[inline(always)]
    fn notch(&self) -> Option<&Notch<T>> {
        self.0.notch.as_ref()
    }

    #[inline(always)]
    fn damping(&self) -> &Option<[Resonator<T>; 6]> {
        &self.0.damping
    }

    #[inline(always)]
    fn hands_over(&self) -> bool {
        self.0.hands_over
    }

    #[inline(always)]
    fn correction(&self) -> &Option<[CorrectionLimit<T>; 6]> {
        &self.0.correction
    }

    #[inline(always)]
    fn lines(&self) -> &LineSettings<T> {
        &self.0.lines
    }

    #[inline(always)]
    fn setpoints(&self) -> &Setpoints<T, UserFrames<T>> {
        &self.0.setpoints
    }

    #[inline(always)]
    fn gauges(&self) -> &Gauges<'_, T> {
        &self.0.gauges
    }

    #[inline(always)]
    fn calibration(&self) -> Option<&Polynomials<T>> {
        self.0.calibration.as_ref()
    }

    #[inline(always)]
    fn raw_limits(&self) -> &[[T; 2]; 6] {
        &self.0.raw_limits
    }

    #[inline(always)]
    fn rate_filter(&self) -> &RateFilter<T> {
        &self.0.rate_filter
    }
}

impl<T: Real + Debug + Send + Sync> Constants for PlatformSpec<T> {
    fn common(&self) -> &'static Common<T> {
        &self.0.common
    }

    fn read_config(self, words: &[u64]) -> Result<Config<Self>, ConfigError> {
        Config::read(self, words)
    }

    fn state_at_reset(self) -> StateOf<Self> {
        let mut state = platform::State::new(&self.reset());
        state.damping.given = self.0.damping.is_some();
        state.correction.given = self.0.correction.is_some();
        state.triggers = Lines::low(&self.0.lines);
        state
    }

    fn step(self, config: &Config<Self>, state: &mut StateOf<Self>, input: &TickInput<Self>) -> TickOutput<Self> {
        platform::step(self, config, state, input)
    }

    fn words_per_leg(self, gauges: &[T; 6]) -> [[T; 6]; 6] {
        platform::sensing::words_per_leg(self, gauges)
    }
}

/// The constants of a compiled spec.
pub fn constants<T: Real + Debug>(ir: &Ir, task: &Task) -> Result<PlatformSpec<T>, InvalidIr> {
    let convert = &Convert::new();
    let (law, sensing) = (&task.law, &task.sensing);
    let lines: Vec<Line<T>> = task.defaults.triggers.iter().map(|line| of_line(convert, line)).collect();
    let names = [INPUT_NAMES[usize::from(law.correction.is_some())], OUTPUT_NAMES[usize::from(!lines.is_empty())]];
    let constants = PlatformConstants {
        common: Common::new(ir, convert, names)?,
        period: convert.real(law.period),
        compliance: convert.real(law.compliance),
        wrench_to_legs: convert.matrix(&law.wrench_to_legs),
        legs_to_wrench: convert.matrix(&law.legs_to_wrench),
        force_to_modes: convert.matrix(&law.force_to_modes),
        legs_to_modes: convert.matrix(&law.legs_to_modes),
        modes_to_legs: convert.matrix(&law.modes_to_legs),
        affine_load: task.load.affine.as_ref().map(|affine| Affine {
            pose: convert.matrix(&affine.pose),
            acceleration: convert.matrix(&affine.acceleration),
        }),
        rest_force: convert.vector(&law.rest_force),
        wrench_limit: convert.vector(&law.wrench_limit),
        lead: convert.real(law.lead),
        own_leads: law.own_leads.iter().map(|lead| convert.real(*lead)).collect(),
        transfer_keep: convert.real(law.transfer_keep),
        transfer_negligible: convert.real(law.transfer_negligible),
        cells_per_metre: convert.real(law.cells_per_metre),
        metres_per_cell: convert.real(law.metres_per_cell),
        notch: law.notch.as_ref().map(|notch| Notch {
            sections: notch
                .sections
                .map(|section| Section { depth: convert.real(section.depth), a: convert.vector(&section.a) }),
            pose_to_modes: convert.matrix(&notch.pose_to_modes),
            modes_to_pose: convert.matrix(&notch.modes_to_pose),
        }),
        damping: law.damping.map(|sections| {
            sections.map(|section| Resonator { b: convert.vector(&section.b), a: convert.vector(&section.a) })
        }),
        hands_over: law.hands_over,
        correction: law.correction.map(|limits| {
            limits.map(|limit| CorrectionLimit { most: convert.real(limit.most), step: convert.real(limit.step) })
        }),
        lines: LineSettings::new(&lines).ok_or(InvalidIr::Part("the number of output lines"))?,
        setpoints: setpoints(convert, ir, &task.setpoints)?,
        gauges: Gauges {
            direction: convert.matrix(&sensing.direction),
            normal: convert.matrix(&sensing.normal),
            skew: convert.matrix(&sensing.skew),
            pierced: convert.matrix(&sensing.pierced),
            inverse: convert.matrix(&sensing.inverse),
            curvature: convert.matrix(&sensing.curvature),
            passes: sensing.passes as usize,
            arc_sine: convert.slice(&sensing.arc_sine),
            arc_tangent: convert.slice(&sensing.arc_tangent),
        },
        calibration: sensing
            .calibration
            .as_ref()
            .map(|gauges| Polynomials(gauges.each_ref().map(|coefficients| convert.slice(coefficients)))),
        raw_limits: convert.matrix(&sensing.raw_limits),
        rate_filter: RateFilter { keep: convert.real(sensing.rate_keep), gain: convert.real(sensing.rate_gain) },
    };
    convert.finish()?;
    Ok(PlatformSpec(common::constants(constants)))
}

fn of_line<T: Real>(convert: &Convert<T>, line: &ir::Line) -> Line<T> {
    Line {
        kind: line.kind,
        axis: line.axis,
        direction: line.direction,
        start: convert.real(line.start),
        stop: convert.real(line.stop),
        step: convert.real(line.step),
        hysteresis: convert.real(line.hysteresis),
        first: line.first,
        every: line.every,
        last: line.last,
        width: line.width,
    }
}

fn setpoints<T: Real>(
    convert: &Convert<T>,
    ir: &Ir,
    s: &ir::Setpoints,
) -> Result<Setpoints<T, UserFrames<T>>, InvalidIr> {
    let trajectories: Option<Vec<_>> =
        s.trajectories.iter().map(|trajectory| of_path(convert, &trajectory.path)).collect();
    Ok(Setpoints {
        period: convert.real(s.period),
        rate: convert.real(s.rate),
        square_rate: convert.real(s.square_rate),
        bias: convert.vector(&s.bias),
        home: convert.vector(&s.home),
        bound: convert.vector(&ir.bounds.pose),
        limits: MoveLimits {
            speed: convert.vector(&s.speed_limit),
            acceleration: convert.vector(&s.acceleration_limit),
            jerk: convert.vector(&s.jerk_limit),
        },
        stop: StopLimits {
            acceleration: convert.vector(&s.stop_acceleration_limit),
            jerk: convert.vector(&s.stop_jerk_limit),
            shortest: s.shortest_stop,
        },
        stream_step: convert.vector(&s.stream_step),
        stream_rate: convert.vector(&s.stream_rate),
        stream_acceleration: convert.vector(&s.stream_acceleration),
        stale_ticks: s.stale_ticks,
        frames: match &s.frames {
            Frames::Parallel => UserFrames::Parallel,
            Frames::Tool { point, largest_angle } => {
                UserFrames::Tool(Tool { point: convert.vector(point), largest_angle: convert.real(*largest_angle) })
            }
            Frames::Work { axes, point, largest_angle } => UserFrames::Work(Work {
                axes: convert.matrix(axes),
                point: convert.vector(point),
                largest_angle: convert.real(*largest_angle),
            }),
        },
        trajectories: kept(trajectories.ok_or(InvalidIr::Part("the length of a trajectory"))?),
    })
}

/// A trajectory; none if it has more ticks than there may be, or too few parts.
fn of_path<T: Real>(convert: &Convert<T>, path: &Path) -> Option<Trajectory<T>> {
    Some(match path {
        Path::Segments { start, segments, ticks, end } => Trajectory::Segments {
            start: convert.vector(start),
            segments: kept(segments.iter().map(|part| of_segment(convert, part)).collect::<Option<Vec<_>>>()?),
            ticks: i32::try_from(*ticks).ok()?,
            end: convert.vector(end),
        },
        Path::Table { rows, row_ticks, per_tick, per_second, bend_rate, repeat } if rows.len() >= 2 => {
            Trajectory::Table(Rows {
                rows: kept(
                    rows.iter().map(|row| Row { pose: convert.vector(&row.pose), bend: convert.vector(&row.bend) }),
                ),
                row_ticks: i32::try_from(*row_ticks).ok().filter(|ticks| *ticks > 0)?,
                per_tick: convert.real(*per_tick),
                per_second: convert.real(*per_second),
                bend_rate: convert.real(*bend_rate),
                repeat: *repeat,
            })
        }
        Path::Table { .. } => return None,
    })
}

fn of_segment<T: Real>(convert: &Convert<T>, segment: &ir::Segment) -> Option<Segment<T>> {
    Some(Segment {
        first: i32::try_from(segment.first).ok()?,
        per_tick: convert.real(segment.per_tick),
        per_second: convert.real(segment.per_second),
        phase: segment.phase,
        phase_step: segment.phase_step,
        angular: convert.real(segment.angular),
        axes: segment.axes.map(|axis| Axis {
            place: convert.real(axis.place),
            slope: convert.real(axis.slope),
            sine: convert.vector(&axis.sine),
            cosine: convert.vector(&axis.cosine),
        }),
    })
}
