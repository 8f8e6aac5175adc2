//! A platform in task space whose constants are read at run time.

use specgen_compiler::constants::{self, Numbers as _, kept};
use specgen_compiler::ir::{self, Frames, Ir, LEGS, Path, TaskSpace as Task};
use specgen_law::platform::{self, Platform, State, TaskSpace};
use specgen_runtime::setpoint::{Setpoints, Table as Rows, Tool, Trajectory, Work};
use specgen_runtime::{Affine, Correction, CorrectionLimit, Damping, Gauges, Notch, RateFilter, Real, Resonator};

use crate::InvalidIr;
use crate::common::{AtRunTime, Common, Constants, Number, accessors};
use crate::convert::Convert;
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
    body: specgen_runtime::Platform<T>,
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
    rate_filter: RateFilter<T>,
}

impl<T: Number> Platform for AtRunTime<PlatformConstants<T>> {
    type Damping = Optional<Damping<T, 6>>;
    type Correction = Optional<Correction<T, 6>>;
    type Lines = Lines<T>;
    type Frames = UserFrames<T>;
    type Calibration = Polynomials<T>;

    accessors! { constants =>
        period -> T = constants.period;
        compliance -> T = constants.compliance;
        wrench_to_legs -> &[[T; 6]; 6] = &constants.wrench_to_legs;
        legs_to_wrench -> &[[T; 6]; 6] = &constants.legs_to_wrench;
        force_to_modes -> &[[T; 6]; 6] = &constants.force_to_modes;
        legs_to_modes -> &[[T; 6]; 6] = &constants.legs_to_modes;
        modes_to_legs -> &[[T; 6]; 6] = &constants.modes_to_legs;
        body -> &specgen_runtime::Platform<T> = &constants.body;
        affine_load -> Option<&Affine<T>> = constants.affine_load.as_ref();
        rest_force -> &[T; LEGS] = &constants.rest_force;
        wrench_limit -> &[T; 6] = &constants.wrench_limit;
        lead -> T = constants.lead;
        own_leads -> &[T] = &constants.own_leads;
        transfer_keep -> T = constants.transfer_keep;
        transfer_negligible -> T = constants.transfer_negligible;
        cells_per_metre -> T = constants.cells_per_metre;
        metres_per_cell -> T = constants.metres_per_cell;
        notch -> Option<&Notch<T>> = constants.notch.as_ref();
        damping -> &Option<[Resonator<T>; 6]> = &constants.damping;
        hands_over -> bool = constants.hands_over;
        correction -> &Option<[CorrectionLimit<T>; 6]> = &constants.correction;
        lines -> &LineSettings<T> = &constants.lines;
        setpoints -> &Setpoints<T, UserFrames<T>> = &constants.setpoints;
        gauges -> &Gauges<'_, T> = &constants.gauges;
        calibration -> Option<&Polynomials<T>> = constants.calibration.as_ref();
        rate_filter -> &RateFilter<T> = &constants.rate_filter;
    }
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
    let (law, sensing) = (&task.law, &task.sensing);
    let lines = constants::lines(convert, &task.defaults);
    let names = [INPUT_NAMES[usize::from(law.correction.is_some())], OUTPUT_NAMES[usize::from(!lines.is_empty())]];
    let body = constants::body(convert, &ir.dynamics);
    if body.places.iter().chain(&body.rows).any(|place| *place >= LEGS) {
        return Err(InvalidIr::Part("the order of elimination"));
    }
    let made = PlatformConstants {
        common: Common::new(ir, convert, names)?,
        period: convert.real(law.period),
        compliance: convert.real(law.compliance),
        wrench_to_legs: convert.matrix(&law.wrench_to_legs),
        legs_to_wrench: convert.matrix(&law.legs_to_wrench),
        force_to_modes: convert.matrix(&law.force_to_modes),
        legs_to_modes: convert.matrix(&law.legs_to_modes),
        modes_to_legs: convert.matrix(&law.modes_to_legs),
        body,
        affine_load: constants::affine(convert, &task.load),
        rest_force: convert.vector(&law.rest_force),
        wrench_limit: convert.vector(&law.wrench_limit),
        lead: convert.real(law.lead),
        own_leads: law.own_leads.iter().map(|lead| convert.real(*lead)).collect(),
        transfer_keep: convert.real(law.transfer_keep),
        transfer_negligible: convert.real(law.transfer_negligible),
        cells_per_metre: convert.real(law.cells_per_metre),
        metres_per_cell: convert.real(law.metres_per_cell),
        notch: constants::notch(convert, law),
        damping: law.damping.map(|sections| constants::damping(convert, &sections)),
        hands_over: law.hands_over,
        correction: law.correction.map(|limits| constants::correction(convert, &limits)),
        lines: LineSettings::new(&lines).ok_or(InvalidIr::Part("the number of output lines"))?,
        setpoints: setpoints(convert, ir, &task.setpoints)?,
        gauges: constants::gauges(convert, sensing),
        calibration: sensing
            .calibration
            .as_ref()
            .map(|gauges| Polynomials(gauges.each_ref().map(|coefficients| convert.slice(coefficients)))),
        rate_filter: constants::rate_filter(convert, sensing),
    };
    convert.finish()?;
    Ok(made)
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

/// A trajectory; none if it has more ticks than there may be, or too few parts.
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
