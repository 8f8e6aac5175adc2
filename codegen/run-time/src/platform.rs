//! A platform in task space, with constants at run time.

use specgen_ir::constants;
use specgen_ir::scalar::{Numbers as _, kept};
use specgen_ir::{self as ir, Frames, Ir, LEGS, Path, TaskSpace as Task};
use specgen_law::platform::{Platform, State, TaskSpace};
use specgen_runtime::setpoint::{Setpoints, Table as Rows, Tool, Trajectory, Work};
use specgen_runtime::{Affine, Correction, CorrectionLimit, Damping, Gauges, Notch, RateFilter, Real, Resonator};

use crate::InvalidIr;
use crate::common::{AtRunTime, Common, Constants, Number, law_constants};
use crate::convert::Convert;
use crate::parts::{LineSettings, Lines, Optional, Polynomials, UserFrames};

law_constants! {
    /// The constants.
    PlatformConstants: Platform {
        type Damping = Optional<Damping<T, 6>>;
        type Correction = Optional<Correction<T, 6>>;
        type Lines = Lines<T>;
        type Frames = UserFrames<T>;
        type Calibration = Polynomials<T>;
    }
    of (convert, ir: &Ir, task: &Task, law: &ir::ControlLaw, sensing: &ir::Sensing);
    copy period: T = convert.real(law.period);
    copy compliance: T = convert.real(law.compliance);
    lend wrench_to_legs: [[T; 6]; LEGS] = convert.matrix(&law.wrench_to_legs);
    lend legs_to_wrench: [[T; LEGS]; 6] = convert.matrix(&law.legs_to_wrench);
    lend force_to_modes: [[T; 6]; 6] = convert.matrix(&law.force_to_modes);
    lend legs_to_modes: [[T; LEGS]; 6] = convert.matrix(&law.legs_to_modes);
    lend modes_to_legs: [[T; 6]; LEGS] = convert.matrix(&law.modes_to_legs);
    lend body: specgen_runtime::Platform<T> = body(convert, ir)?;
    maybe affine_load: Option<Affine<T>> as Option<&Affine<T>> = constants::affine(convert, &task.load);
    maybe cross_talk: Option<[[T; 6]; LEGS]> as Option<&[[T; 6]; LEGS]> = constants::cross_talk(convert, &task.load);
    lend rest_force: [T; LEGS] = convert.vector(&law.rest_force);
    lend wrench_limit: [T; 6] = convert.vector(&law.wrench_limit);
    copy lead: T = convert.real(law.lead);
    copy own_leads: &'static [T] = convert.slice(&law.own_leads);
    copy transfer_keep: T = convert.real(law.transfer_keep);
    copy transfer_negligible: T = convert.real(law.transfer_negligible);
    copy cells_per_metre: T = convert.real(law.cells_per_metre);
    copy metres_per_cell: T = convert.real(law.metres_per_cell);
    maybe notch: Option<Notch<T>> as Option<&Notch<T>> = constants::notch(convert, law);
    lend damping: Option<[Resonator<T>; 6]> = law.damping.map(|sections| constants::damping(convert, &sections));
    copy hands_over: bool = law.hands_over;
    lend correction: Option<[CorrectionLimit<T>; 6]> = law.correction.map(|limits| constants::correction(convert, &limits));
    lend lines: LineSettings<T> = lines(convert, &task.defaults)?;
    lend setpoints: Setpoints<T, UserFrames<T>> = setpoints(convert, ir, &task.setpoints)?;
    lend gauges: Gauges<'static, T> = constants::gauges(convert, sensing);
    maybe calibration: Option<Polynomials<T>> as Option<&Polynomials<T>> = calibration(convert, sensing);
    lend rate_filter: RateFilter<T> = constants::rate_filter(convert, sensing);
}

impl<T: Number> Constants for PlatformConstants<T> {
    type Real = T;
    type Law = TaskSpace;

    fn common(&self) -> &Common<T> {
        &self.common
    }

    fn complete(&self, state: &mut State<AtRunTime<Self>>) {
        state.damping.given = self.damping.is_some();
        state.correction.given = self.correction.is_some();
        state.triggers = Lines::low(&self.lines);
    }
}

/// The constants of a compiled spec.
pub fn constants<T: Number>(ir: &Ir, task: &Task) -> Result<PlatformConstants<T>, InvalidIr> {
    let convert = &Convert::new();
    let common = Common::new(ir, convert)?;
    let made = PlatformConstants::new(common, convert, ir, task, &task.law, &task.sensing)?;
    convert.finish()?;
    Ok(made)
}

fn body<T: Real>(convert: &Convert<T>, ir: &Ir) -> Result<specgen_runtime::Platform<T>, InvalidIr> {
    let body = constants::body(convert, &ir.dynamics);
    if body.places.iter().chain(&body.rows).any(|place| *place >= LEGS) {
        return Err(InvalidIr::Part("the order of elimination"));
    }
    Ok(body)
}

fn lines<T: Real>(convert: &Convert<T>, defaults: &ir::PlatformDefaults) -> Result<LineSettings<T>, InvalidIr> {
    LineSettings::new(&constants::lines(convert, defaults)).ok_or(InvalidIr::Part("the number of output lines"))
}

fn calibration<T: Real>(convert: &Convert<T>, sensing: &ir::Sensing) -> Option<Polynomials<T>> {
    let gauges = sensing.calibration.as_ref()?;
    Some(Polynomials(gauges.each_ref().map(|coefficients| convert.slice(coefficients))))
}

fn setpoints<T: Real>(
    convert: &Convert<T>,
    ir: &Ir,
    s: &ir::Setpoints,
) -> Result<Setpoints<T, UserFrames<T>>, InvalidIr> {
    let frames = match &s.frames {
        Frames::Parallel => UserFrames::Parallel,
        Frames::Tool { point, largest_angle } => {
            UserFrames::Tool(Tool { point: convert.vector(point), largest_angle: convert.real(*largest_angle) })
        }
        Frames::Work { axes, point, largest_angle } => UserFrames::Work(Work {
            axes: convert.matrix(axes),
            point: convert.vector(point),
            largest_angle: convert.real(*largest_angle),
        }),
    };
    let paths: Option<Vec<_>> = s.trajectories.iter().map(|trajectory| of_path(convert, &trajectory.path)).collect();
    let paths = kept(paths.ok_or(InvalidIr::Part("the length of a trajectory"))?);
    Ok(constants::setpoints(convert, &ir.bounds.pose, s, frames, paths))
}

/// A trajectory; none if it has too many ticks, or too few rows.
fn of_path<T: Real>(convert: &Convert<T>, path: &Path) -> Option<Trajectory<T>> {
    Some(match path {
        Path::Segments { start, segments, ticks, end } => Trajectory::Segments {
            start: convert.vector(start),
            segments: kept(segments.iter().map(|part| constants::segment(convert, part))),
            ticks: i32::try_from(*ticks).ok()?,
            end: convert.vector(end),
        },
        Path::Table { rows, row_ticks, per_tick, per_second, bend_rate, repeat } if rows.len() >= 2 => {
            Trajectory::Table(Rows {
                rows: kept(rows.iter().map(|row| constants::row(convert, row))),
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
