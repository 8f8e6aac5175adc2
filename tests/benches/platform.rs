//! Host time of the controller in task space: `cargo bench -p specgen-benches --bench platform`. Quote ratios: machines are
//! noisy. A whole tick is one of the emitted host library, words in and out, under the closed-loop record of the exercise;
//! its parts are the runtime's kernels with the constants of the reference platform.

use std::marker::PhantomData;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use host_sim::controller::{Controller, TickController};
use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};
use specgen::ir::scalar::Rounding;
use specgen::ir::{self, constants};
use specgen::model::Probe;
use specgen::verify;
use specgen_runtime::NotchState;
use specgen_runtime::linear::transform;
use specgen_tests::Emitted;

/// Ticks from reset on that are timed: the way to the bias pose, then tracking.
const TICKS: u32 = 8192;
/// Constants stay in double precision.
const NUMBERS: Rounding<f64> = Rounding(PhantomData);

fn main() {
    divan::main();
}

/// The reference platform's controller in a mode, and the input words of its record in closed loop.
fn record(name: &str, mode: f64) -> (Emitted, Controller, Vec<Vec<u64>>) {
    let emitted = Emitted::new(name, "reference.toml", &[]);
    let mut controller = emitted.controller();
    let mut words = controller.default_config();
    controller.description().set_config(&mut words, "mode", mode).expect("a setting of a platform");
    controller.configure(&words).expect("a permitted mode");
    let trace = verify::exercise(&mut controller, &emitted.compiled.model, &emitted.compiled.ir, TICKS)
        .expect("a run in closed loop");
    let width = trace.description().input_names.len();
    let rows = trace.rows().map(|row| row[..width].to_vec()).collect();
    (emitted, controller, rows)
}

/// A whole tick in P, F with PCC, and P/F with PCC.
#[divan::bench(args = [0.0, 3.0, 6.0])]
fn tick(bencher: Bencher, mode: f64) {
    let (_, mut controller, rows) = record(&format!("bench-tick-{mode}"), mode);
    let mut output = vec![0; controller.description().output_names.len()];
    bencher.counter(ItemsCount::new(rows.len())).bench_local(|| {
        controller.reset();
        for row in &rows {
            controller.step(black_box(row), &mut output);
        }
        black_box(&output);
    });
}

/// Gauge readings of the record.
fn readings(name: &str) -> (Emitted, Vec<[f64; 6]>) {
    let (emitted, controller, rows) = record(name, 6.0);
    let first = controller.description().input("gauge[0]").expect("gauges");
    let readings = rows.iter().map(|row| std::array::from_fn(|k| f64::from_bits(row[first + k]))).collect();
    (emitted, readings)
}

fn task(emitted: &Emitted) -> &ir::TaskSpace {
    emitted.compiled.ir.task_space.as_ref().expect("a controller in task space")
}

/// Times what is computed of each of the readings.
fn each<T>(bencher: Bencher, all: &[[f64; 6]], mut compute: impl FnMut(&[f64; 6]) -> T) {
    bencher.counter(ItemsCount::new(all.len())).bench_local(|| {
        for one in all {
            black_box(compute(black_box(one)));
        }
    });
}

/// The modal notch on a pose error: into modes, six sections, and back.
#[divan::bench]
fn notch(bencher: Bencher) {
    let (emitted, readings) = readings("bench-notch");
    let notch = constants::notch(&NUMBERS, &task(&emitted).law).expect("a notch");
    let mut state = NotchState::new();
    each(bencher, &readings, |error| {
        let modal = state.filter(&notch.sections, &transform(&notch.pose_to_modes, error));
        transform(&notch.modes_to_pose, &modal)
    });
}

/// Six gauges to a pose.
#[divan::bench]
fn sensing(bencher: Bencher) {
    let (emitted, readings) = readings("bench-sensing");
    let gauges = constants::gauges(&NUMBERS, &task(&emitted).sensing);
    each(bencher, &readings, |readings| gauges.pose(readings));
}

/// The same as one writes it first, with nalgebra: three Newton steps, each with a Jacobian by central differences and LU.
#[divan::bench]
fn sensing_by_plain_newton(bencher: Bencher) {
    let (emitted, readings) = readings("bench-newton");
    let gauges = constants::gauges(&NUMBERS, &task(&emitted).sensing);
    let model = &emitted.compiled.model;
    let probes = &model.task_space.as_ref().expect("a controller in task space").probes;
    let plain = Plain { probes, height: model.geometry.height };
    for readings in &readings {
        let difference = plain.pose(readings) - Vector6::from(gauges.pose(readings));
        assert!(difference.norm() < 1e-12, "both find the same pose: {difference}");
    }
    each(bencher, &readings, |readings| plain.pose(readings));
}

struct Plain<'a> {
    probes: &'a [Probe; 6],
    height: f64,
}

impl Plain<'_> {
    fn readings(&self, pose: &Vector6<f64>) -> Vector6<f64> {
        let turn = Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
        let rest = Vector3::new(0.0, 0.0, self.height);
        let place = rest + Vector3::new(pose[0], pose[1], pose[2]);
        Vector6::from_fn(|k, _| {
            let probe = &self.probes[k];
            let (direction, point) = (Vector3::from(probe.direction), Vector3::from(probe.point));
            let (plane, normal) = (Vector3::from(probe.plane_point), Vector3::from(probe.plane_normal));
            let distance = |at: Vector3<f64>, normal: Vector3<f64>| (at - point).dot(&normal) / direction.dot(&normal);
            distance(place + turn * plane, turn * normal) - distance(rest + plane, normal)
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
