//! The motions of the acceptance on the simulated machine of `specgen sim`, with the legs that were identified.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::platform::rig::{Bench, Command, Request, Tick};
use host_sim::trajectory::PoseTarget;
use specgen_compiler::compile::Compilation;
use specgen_language::outcome::{Failure, environment};
use specgen_runtime::Motion as SetPoint;
use specgen_runtime::wave::{Limits, Settings, Wave};
use specgen_studies::identified::{IdentifiedLegs, machine};
use specgen_studies::machine::run_failure;

use super::motions::{AFTER_MOVE, Motion, MotionKind};
use super::rows::Rows;
use super::state::Leg;
use crate::wave::read_wave;

/// Time limit for a move, and rest after it, s.
const ARMING: f64 = 60.0;
const SETTLED: f64 = 1.0;
/// Rms of a displacement that uses a stroke evenly, over the stroke: 1/√12.
const EVENLY: f64 = 0.288_675;
/// Limits of waves, which the machine has checked.
const FREE: Limits<f64> =
    Limits { low: [-1.0; 6], high: [1.0; 6], rate: [1e9; 6], acceleration: [1e15; 6], ticks_per_second: 0.0 };

/// Error of the model of each leg, relative to its displacement: by a record that no fit used, or else by that of the fit.
fn errors(compiled: &Compilation, legs: &[Leg]) -> [f64; 6] {
    let [low, high] = compiled.model.actuator.voltage;
    let of_record = |leg: usize| {
        let all = &compiled.records;
        let report = all.get(leg).or(all.last()).and_then(Option::as_ref);
        report.map_or(0.0, |report| 1e-2 * report.fit_rms_percent / EVENLY)
    };
    std::array::from_fn(|number| match legs.get(number) {
        Some(leg) => leg.arbitrary_rms.unwrap_or(leg.fit_rms) / (leg.gain * (high - low) * EVENLY),
        None => of_record(number),
    })
}

/// Records of these motions with these settings, in their order, as the machine would have made them.
///
/// # Errors
/// A motion leaves what the controller accepts.
pub(super) fn records(
    compiled: &Compilation,
    legs: &[Leg],
    settings: &[u64],
    motions: &[Motion],
) -> Result<Vec<Rows>, Failure> {
    let model = &compiled.model;
    let task = model.task_space.as_ref().ok_or_else(|| Failure::Usage("a platform is simulated only".to_owned()))?;
    let mut law = specgen_run_time::controller(&compiled.ir).map_err(environment)?;
    law.configure(settings).map_err(environment)?;
    let mut controller = IdentifiedLegs::new(&mut law, compiled, &errors(compiled, legs))?;
    let mut rig = machine(model, task).rig().clone();
    let period = model.timing.period;
    let bench = Bench::new(&mut rig, &mut controller, period, 0).map_err(run_failure)?;
    let mut simulation = Simulation { bench, period };
    simulation.bench.arm(ARMING).map_err(run_failure)?;
    simulation.rest(SETTLED).map_err(run_failure)?;
    motions.iter().map(|motion| simulation.record(motion)).collect()
}

struct Simulation<'a> {
    bench: Bench<'a>,
    period: f64,
}

impl Simulation<'_> {
    fn rest(&mut self, seconds: f64) -> Result<(), RunError> {
        (0..self.ticks(seconds)).try_for_each(|_| self.bench.tick(&Request::default()).map(drop))
    }

    fn ticks(&self, seconds: f64) -> u64 {
        libm::ceil(seconds / self.period) as u64
    }

    fn record(&mut self, motion: &Motion) -> Result<Rows, Failure> {
        let Motion { name, start, kind, spans: [lead, seconds], row, .. } = motion;
        self.bench.move_to(start, ARMING).map_err(run_failure)?;
        self.rest(AFTER_MOVE).map_err(run_failure)?;
        let [lead, all] = [*lead, lead + seconds].map(|time| self.ticks(time));
        let every = libm::round(row / self.period) as u64;
        let (mut columns, mut sums) = (vec![Vec::new(); 2 + 18], [0.0; 6]);
        let mut wave = match kind {
            MotionKind::Wave(text) => Some(self.wave(text)?),
            _ => None,
        };
        for number in 0..all {
            let request = match kind {
                _ if number < lead => Request::default(),
                MotionKind::Rest => Request::default(),
                MotionKind::Move(pose) => {
                    let target = PoseTarget { pose: *pose, ..PoseTarget::default() };
                    Request { command: Command::Move, target, ..Request::default() }
                }
                MotionKind::Wave(_) => {
                    let next = wave.as_mut().and_then(Wave::advance);
                    next.map_or_else(Request::default, |motion| Request::stream(target_of(motion)))
                }
                MotionKind::Trajectory(selector) => {
                    Request { command: Command::Trajectory, selector: *selector, ..Request::default() }
                }
            };
            let Tick { target, measured, .. } = self.bench.tick(&request).map_err(run_failure)?;
            for (sum, (target, measured)) in sums.iter_mut().zip(target.into_iter().zip(measured)) {
                *sum += (target - measured) / every as f64;
            }
            if (number + 1) % every == 0 {
                let row = [(number + 1 - every) as f64 * self.period, every as f64];
                let values = row.into_iter().chain(measured).chain(target).chain(std::mem::take(&mut sums));
                columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
            }
        }
        // It ends a trajectory that repeats.
        self.bench.arm(ARMING).map_err(run_failure)?;
        let axis = |of: &str, which: &str, k: usize| format!("{of}[{k}]{which}_{}", if k < 3 { "m" } else { "rad" });
        let six = |of: &'static str, which: &'static str| (0..6).map(move |k| axis(of, which, k));
        let first = ["time_s", "ticks"].map(str::to_owned).into_iter();
        let names: Vec<String> =
            first.chain(six("pose", "")).chain(six("target", "")).chain(six("error", "_mean")).collect();
        Ok(Rows::new(name, &names.iter().map(String::as_str).collect::<Vec<_>>(), columns))
    }

    fn wave(&self, text: &str) -> Result<Wave<f64>, Failure> {
        let words = read_wave(text, self.period, false).map_err(Failure::Gate)?.words;
        let refused = || Failure::Gate("the simulation refuses a wave that the machine took".to_owned());
        let words = words.as_slice().try_into().map_err(|_| refused())?;
        let settings = Settings::from_words(words).map_err(|_| refused())?;
        let mut wave = Wave::new(Limits { ticks_per_second: 1.0 / self.period, ..FREE });
        wave.set(&settings).map_err(|_| refused())?;
        wave.start();
        Ok(wave)
    }
}

fn target_of(motion: SetPoint<f64>) -> PoseTarget {
    PoseTarget { pose: motion.pose, rate: motion.rate, acceleration: motion.acceleration }
}
