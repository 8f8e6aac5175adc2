//! The plan of a commissioning: what the platform of a spec is driven with, and for how long.

use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_identify::assembled::{self, Bench, Drive, Kind, Plan};
use specgen_language::outcome::Failure;

/// Rest before and after a drive in its record, s.
pub(super) const MARGIN: f64 = 1.0;
/// Time beside the drives, s: arming, noise, ramp-down, acceptance with trajectories of some seconds.
const BESIDE: f64 = 90.0;
/// Gain of a leg over that of the spec, at most, that the workspace is to hold.
const LARGEST: f64 = 1.15;
/// Part of the voltage that curves may leave out.
const SHORT: f64 = 1e-2;

/// The drives of a platform, for reversal curves of `grid` levels and this frequency of the mains, Hz.
///
/// # Errors
/// The spec has no platform, the grid is not possible, or a leg alone leaves the workspace.
pub fn of(compiled: &Compilation, grid: usize, mains: f64) -> Result<Plan, Failure> {
    let bench = bench(compiled, mains).ok_or_else(|| {
        Failure::Usage(format!(
            "{}: expected a spec with [control], whose six gauges see the platform",
            compiled.ir.name
        ))
    })?;
    let plan = assembled::plan(&bench, grid, false).map_err(Failure::Usage)?;
    let [low, high] = bench.voltage;
    let whole = |drive: &&Drive| {
        let [from, to] = drive.range;
        let is_whole = (from - low).abs() + (high - to).abs() <= SHORT * (high - low);
        is_whole || !matches!(drive.kind, Kind::Curves { .. })
    };
    if plan.drives.iter().all(|drive| whole(&drive)) {
        return Ok(plan);
    }
    Err(Failure::Gate(format!(
        "{}; nothing was sent. A table needs the whole of actuator.voltage: lower it, or widen `workspace` if the gauges reach further",
        plan.notes.join("; ")
    )))
}

/// The platform of a spec; none without one.
fn bench(compiled: &Compilation, mains: f64) -> Option<Bench> {
    let (model, design) = (&compiled.model, compiled.design.as_ref()?);
    model.task_space.as_ref()?;
    let [low, high] = model.actuator.voltage;
    let [from, to] = model.dac.range;
    let code = f64::from(compiled.ir.supervision.constants.rest);
    let gauges = lower::readings_per_pose(model).ok().flatten()?;
    let readings = gauges.map(|row| (row, model.sensor.range)).to_vec();
    let modes = design.modes.iter().map(|mode| mode.frequency / core::f64::consts::TAU);
    Some(Bench {
        tick_rate: 1.0 / model.timing.period,
        voltage: [low, high],
        rest: within(from + code * (to - from) / f64::from((1_u32 << model.dac.bits) - 1), [low, high]),
        slew_rate: model.actuator.slew_rate,
        stroke: [LARGEST * model.actuator.leg_gain() * (high - low); 6],
        jacobian: lower::leg_jacobian(&model.geometry)?,
        workspace: model.workspace.bounds().map(|bound| [-bound, bound]),
        readings,
        mains,
        slowest_mode: modes.reduce(|slowest, mode| if mode < slowest { mode } else { slowest })?,
    })
}

/// Lowest and highest reading of each gauge in all drives, m, of legs with up to the gain that they are planned for.
pub(super) fn travel(compiled: &Compilation, plan: &Plan) -> Option<[[f64; 2]; 6]> {
    let (readings, actuator) = (compiled.ir.supervision.readings_per_leg?, &compiled.model.actuator);
    let gain = LARGEST * actuator.leg_gain();
    let mut travel = [[0.0; 2]; 6];
    for (drive, end) in plan.drives.iter().flat_map(|drive| drive.range.map(|end| (drive, end))) {
        let legs = drive.held.iter().enumerate().map(|(leg, held)| if drive.legs.contains(&leg) { end } else { *held });
        let legs: Vec<f64> = legs.map(|volts| gain * (volts - actuator.voltage[0])).collect();
        for (row, [low, high]) in readings.iter().zip(&mut travel) {
            let reading = row.iter().zip(&legs).fold(0.0, |sum, (part, leg)| sum + part * leg);
            *low = if reading < *low { reading } else { *low };
            *high = if reading > *high { reading } else { *high };
        }
    }
    Some(travel)
}

/// A limit in place of the voltage of a code beside it.
fn within(volts: f64, [low, high]: [f64; 2]) -> f64 {
    let near = 1e-3 * (high - low);
    match volts {
        _ if volts - low < near => low,
        _ if high - volts < near => high,
        _ => volts,
    }
}

/// Time of these drives with the rests in their records, and of all beside them, s.
pub(super) fn seconds(drives: &[&Drive]) -> f64 {
    let of = |drive: &Drive| drive.rest_before + drive.seconds() + margins(drive);
    drives.iter().fold(BESIDE, |sum, drive| sum + of(drive))
}

fn margins(drive: &Drive) -> f64 {
    if drive.kind == Kind::Preconditioning { 0.0 } else { 2.0 * MARGIN }
}

/// Whether a drive belongs to the step of the cross-talk; otherwise to that of the curves.
pub(super) fn is_cross_talk(drive: &Drive) -> bool {
    drive.kind == Kind::CrossTalk
}

/// Drives with records of the hysteresis of a leg: the main curves first, and an arbitrary one last.
pub(super) fn records(plan: &Plan, leg: usize) -> impl Iterator<Item = &Drive> {
    let shows = |drive: &Drive| matches!(drive.kind, Kind::Curves { .. } | Kind::Arbitrary { .. });
    plan.drives.iter().filter(move |drive| drive.legs.contains(&leg) && shows(drive))
}
