//! Host time of the controller in task space: `cargo bench -p specgen-tests --bench platform`. Quote ratios: machines are
//! noisy. The controller is the committed one, under the closed-loop record of the exercise.

use controller::task_space::notch_error;
use controller::{CONFIG_WORDS, Config, DESCRIPTION, INPUT_WORDS, OUTPUT_WORDS, State, TickInput, step};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use host_sim::controller::{ControllerError, TickController};
use host_sim::description::Description;
use host_sim::trace::Trace;
use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};
use specgen::compile::compile;
use specgen::model::Probe;
use specgen::verify;
use specgen_runtime::{ControlMode, Law, Motion, NotchState};
use specgen_tests::repository;

/// Ticks before those that are timed: the way to the bias pose and into the trajectory.
const BEFORE: usize = 6000;
/// Ticks that are timed.
const TIMED: usize = 4096;

fn main() {
    divan::main();
}

/// The controller of this process.
struct InProcess {
    description: Description,
    config: Config,
    state: State,
}

impl TickController for InProcess {
    fn description(&self) -> &Description {
        &self.description
    }
    fn default_config(&self) -> Vec<u64> {
        Config::new().to_words().to_vec()
    }
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        let (given, expected) = (words.len(), CONFIG_WORDS);
        let words = words.try_into().map_err(|_| ControllerError::ConfigLength { given, expected })?;
        self.config = Config::from_words(words).expect("settings of the spec");
        Ok(())
    }
    fn reset(&mut self) {
        self.state = State::new();
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let input: &[u64; INPUT_WORDS] = input.try_into().expect("a row of input words");
        let words: [u64; OUTPUT_WORDS] = step(&self.config, &mut self.state, &TickInput::from_words(input)).to_words();
        output.copy_from_slice(&words);
    }
    fn state_digest(&self) -> u64 {
        self.state.digest()
    }
}

/// The record of a mode in closed loop: settings, the state before the timed ticks, their inputs.
fn record(mode: ControlMode) -> (Config, State, Vec<TickInput>) {
    let compiled = compile(&repository().join("specs/reference.toml")).expect("the reference spec compiles");
    let config = Config::new().with_mode(mode);
    let description = Description::parse(DESCRIPTION).expect("the controller's own description");
    let mut controller = InProcess { description, config, state: State::new() };
    let ticks = (BEFORE + TIMED) as u32;
    let trace: Trace =
        verify::exercise(&mut controller, &compiled.model, &compiled.ir, ticks).expect("a run in closed loop");
    let inputs: Vec<TickInput> = trace
        .rows()
        .map(|row| TickInput::from_words(row[..INPUT_WORDS].try_into().expect("a row of input words")))
        .collect();
    let mut state = State::new();
    for input in &inputs[..BEFORE] {
        step(&config, &mut state, input);
    }
    (config, state, inputs[BEFORE..].to_vec())
}

fn ticks(bencher: Bencher, mode: ControlMode) {
    let (config, state, inputs) = record(mode);
    bencher.counter(ItemsCount::new(inputs.len())).bench_local(|| {
        let mut state = state;
        for input in &inputs {
            black_box(step(black_box(&config), &mut state, input));
        }
    });
}

/// Six gauges to six voltages under P/F with PCC.
#[divan::bench]
fn tick_pf_pcc(bencher: Bencher) {
    ticks(bencher, ControlMode::PF(Law::Pcc));
}

/// The same without feedback.
#[divan::bench]
fn tick_f_pcc(bencher: Bencher) {
    ticks(bencher, ControlMode::F(Law::Pcc));
}

/// The same without inverse hysteresis and adaptation.
#[divan::bench]
fn tick_p(bencher: Bencher) {
    ticks(bencher, ControlMode::P);
}

/// Motions of the set-point in the record.
fn motions() -> Vec<Motion<f64>> {
    let (config, mut state, inputs) = record(ControlMode::PF(Law::Pcc));
    let mut motions = Vec::new();
    for input in &inputs {
        step(&config, &mut state, input);
        let target = state.target;
        motions.push(Motion { pose: target.pose, rate: target.rate, acceleration: target.acceleration });
    }
    motions
}

/// Set-point to six leg forces with what the tick was emitted with.
#[divan::bench]
fn dynamics(bencher: Bencher) {
    let motions = motions();
    bencher.counter(ItemsCount::new(motions.len())).bench_local(|| {
        for motion in &motions {
            black_box(controller::dynamics::leg_forces(black_box(motion)));
        }
    });
}

/// The modal notch on a pose error.
#[divan::bench]
fn notch(bencher: Bencher) {
    let errors: Vec<[f64; 6]> = motions().iter().map(|motion| motion.pose.map(|x| 1e-3 * x)).collect();
    let mut notch = NotchState::new();
    bencher.counter(ItemsCount::new(errors.len())).bench_local(|| {
        for error in &errors {
            black_box(notch_error(&mut notch, black_box(error)));
        }
    });
}

/// Six gauges to a pose.
#[divan::bench]
fn sensing(bencher: Bencher) {
    let (_, _, inputs) = record(ControlMode::PF(Law::Pcc));
    bencher.counter(ItemsCount::new(inputs.len())).bench_local(|| {
        for input in &inputs {
            black_box(controller::sensing::pose(black_box(&input.gauge)));
        }
    });
}

/// The same as one writes it first: Newton with the exact Jacobian by central differences and LU, three steps.
#[divan::bench]
fn sensing_by_plain_newton(bencher: Bencher) {
    let (_, _, inputs) = record(ControlMode::PF(Law::Pcc));
    let model = compile(&repository().join("specs/reference.toml")).expect("the reference spec compiles").model;
    let task = model.task_space.expect("a controller in task space");
    let plain = Plain { probes: task.probes, height: model.geometry.height };
    for input in &inputs {
        let difference = plain.pose(&input.gauge) - Vector6::from(controller::sensing::pose(&input.gauge));
        assert!(difference.norm() < 1e-12, "both find the same pose: {difference}");
    }
    bencher.counter(ItemsCount::new(inputs.len())).bench_local(|| {
        for input in &inputs {
            black_box(plain.pose(black_box(&input.gauge)));
        }
    });
}

struct Plain {
    probes: [Probe; 6],
    height: f64,
}

impl Plain {
    fn readings(&self, pose: &Vector6<f64>) -> Vector6<f64> {
        let turn = Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
        let place = Vector3::new(pose[0], pose[1], pose[2] + self.height);
        Vector6::from_fn(|k, _| {
            let probe = &self.probes[k];
            let (direction, normal) = (Vector3::from(probe.direction), turn * Vector3::from(probe.plane_normal));
            let at = |place: Vector3<f64>, turned: Vector3<f64>, normal: Vector3<f64>| {
                (place + turned - Vector3::from(probe.point)).dot(&normal) / direction.dot(&normal)
            };
            let (plane, rest) = (Vector3::from(probe.plane_point), Vector3::new(0.0, 0.0, self.height));
            at(place, turn * plane, normal) - at(rest, plane, Vector3::from(probe.plane_normal))
        })
    }

    fn pose(&self, gauge: &[f64; 6]) -> Vector6<f64> {
        const STEP: f64 = 1e-6;
        let wanted = Vector6::from(*gauge);
        let mut pose = Vector6::zeros();
        for _ in 0..3 {
            let columns: [Vector6<f64>; 6] = std::array::from_fn(|k| {
                let mut step = Vector6::zeros();
                step[k] = STEP;
                (self.readings(&(pose + step)) - self.readings(&(pose - step))) / (2.0 * STEP)
            });
            let miss = wanted - self.readings(&pose);
            pose += Matrix6::from_columns(&columns).lu().solve(&miss).expect("gauges that see all directions");
        }
        pose
    }
}
