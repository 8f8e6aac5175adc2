//! The plan of a commissioning: what the platform of a spec is driven with, and for how long.

use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_identify::assembled::{self, Bench, Drive, Kind, Plan};
use specgen_language::outcome::Failure;

use super::state::Step;

/// Rest before and after a motion of acceptance, and before and after a drive in its record, s.
pub(super) const MARGIN: f64 = 1.0;
pub(super) const REST: f64 = 0.6;
/// Time of the response of all legs, s, with the downloads over a serial line.
const RESPONSE: f64 = 105.0;
/// Part of the voltage that curves may leave out.
const SHORT: f64 = 1e-2;

/// The drives of a platform, for reversal curves of `grid` levels and this frequency of the mains, Hz. `gain`: of a leg, m/V;
/// `pairs`: legs that fit move together, which needs their cross-talk.
///
/// # Errors
/// The spec has no platform, the grid is not possible, or a leg alone leaves the workspace.
pub fn of(compiled: &Compilation, gain: f64, grid: usize, mains: f64, pairs: bool) -> Result<Plan, Failure> {
    let bench = bench(compiled, gain, mains).ok_or_else(|| {
        Failure::Usage(format!(
            "{}: expected a spec with [control], whose six gauges see the platform",
            compiled.ir.name
        ))
    })?;
    let plan = assembled::plan(&bench, grid, pairs).map_err(Failure::Usage)?;
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
fn bench(compiled: &Compilation, gain: f64, mains: f64) -> Option<Bench> {
    let (model, design) = (&compiled.model, compiled.design.as_ref()?);
    model.task_space.as_ref()?;
    let [low, high] = model.actuator.voltage;
    let gauges = lower::readings_per_pose(model).ok().flatten()?;
    let readings = gauges.map(|row| (row, model.sensor.range)).to_vec();
    let modes = design.modes.iter().map(|mode| mode.frequency / core::f64::consts::TAU);
    Some(Bench {
        tick_rate: 1.0 / model.timing.period,
        voltage: [low, high],
        rest: model.rest_voltage(),
        slew_rate: model.actuator.slew_rate,
        stroke: [gain * (high - low); 6],
        jacobian: lower::leg_jacobian(&model.geometry)?,
        workspace: model.workspace.bounds().map(|bound| [-bound, bound]),
        readings,
        mains,
        slowest_mode: modes.reduce(|slowest, mode| if mode < slowest { mode } else { slowest })?,
    })
}

/// Lowest and highest reading of each gauge in all drives, m.
pub(super) fn travel(compiled: &Compilation, plan: &Plan) -> Option<[[f64; 2]; 6]> {
    let (readings, actuator) = (compiled.ir.supervision.readings_per_leg?, &compiled.model.actuator);
    let gain = actuator.leg_gain();
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

/// Drives of `steps` that have no record yet, each set of curves after its preconditioning.
pub(super) fn open<'a>(plan: &'a Plan, steps: &[Step], is_kept: impl Fn(&Drive) -> bool) -> Vec<&'a Drive> {
    let (mut open, mut before) = (Vec::new(), None);
    for drive in plan.drives.iter().filter(|drive| steps.contains(&step_of(drive))) {
        let prepares = drive.kind == Kind::Preconditioning;
        if !prepares && !is_kept(drive) {
            open.extend(before.into_iter().chain([drive]));
        }
        before = prepares.then_some(drive);
    }
    open
}

/// Time of these open drives with the rests in their records, and of what else the steps do, s.
pub(super) fn seconds(steps: &[Step], drives: &[&Drive]) -> f64 {
    let beside = |step: &Step| match step {
        // Arming, noise, ramp-down.
        Step::Wiring => 20.0,
        Step::Response => RESPONSE,
        // With |S|, and trajectories of some seconds.
        Step::Acceptance => 100.0,
        Step::Identify | Step::Spec => 0.0,
        _ if drives.iter().any(|drive| step_of(drive) == *step) => 10.0,
        _ => 0.0,
    };
    let margins = |drive: &Drive| if drive.kind == Kind::Preconditioning { 0.0 } else { 2.0 * REST };
    let of_drives = drives.iter().fold(0.0, |sum, drive| sum + drive.duration() + margins(drive));
    steps.iter().fold(of_drives, |sum, step| sum + beside(step))
}

/// The step that a drive belongs to.
pub(super) fn step_of(drive: &Drive) -> Step {
    if drive.kind == Kind::CrossTalk { Step::CrossTalk } else { Step::Curves }
}

/// Drives with records of the hysteresis of a leg: the main curves first, and an arbitrary one last.
pub(super) fn records(plan: &Plan, leg: usize) -> impl Iterator<Item = &Drive> {
    let shows = |drive: &Drive| matches!(drive.kind, Kind::Curves { .. } | Kind::Arbitrary { .. });
    plan.drives.iter().filter(move |drive| drive.legs.contains(&leg) && shows(drive))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_goes_on_has_the_time_of_what_is_left() {
        let bench = Bench {
            tick_rate: 1e4,
            voltage: [0.0, 100.0],
            rest: 0.0,
            slew_rate: 1e5,
            stroke: [60e-6; 6],
            jacobian: core::array::from_fn(|leg| core::array::from_fn(|axis| f64::from(u8::from(leg == axis)))),
            workspace: [[-1.0, 1.0]; 6],
            readings: Vec::new(),
            mains: 50.0,
            slowest_mode: 361.0,
        };
        let plan = assembled::plan(&bench, 8, false).unwrap();
        let steps = [Step::CrossTalk, Step::Curves];
        assert_eq!(open(&plan, &steps, |_| false).len(), plan.drives.len());
        let missing = ["leg1-curves-625", "leg3-arbitrary"];
        let left = open(&plan, &steps, |drive| !missing.contains(&drive.name.as_str()));
        let names: Vec<&str> = left.iter().map(|drive| drive.name.as_str()).collect();
        assert_eq!(names, ["leg1-preconditioning", missing[0], missing[1]]);
        let expected: f64 = left.iter().map(|drive| drive.duration()).sum::<f64>() + 2.0 * 2.0 * REST + 10.0;
        assert!((seconds(&steps, &left) - expected).abs() < 1e-9);
        assert_eq!(seconds(&[Step::Curves, Step::Spec], &[]), 0.0);
    }
}
