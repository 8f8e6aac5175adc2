//! Host time of the simulated loop: `cargo bench -p specgen-tests --bench simulation`. Quote ratios: machines are noisy.
//!
//! Every bench simulates a quarter of a second of the reference platform at 10 kHz, or a part of that: items are simulated
//! ticks, so that items/s over 10 000 is simulated time over real time.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use host_sim::controller::TickController;
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{Bench, Noise, Request};
use host_sim::trajectory::{PaperPath, PaperPose, PoseTrajectory};
use specgen::machine;
use specgen_tests::Emitted;

/// Ticks of a bench: a quarter of a second of the machine.
const TICKS: usize = 2500;
const INTERVAL: f64 = 1e-4;

fn main() {
    divan::main();
}

fn scenario(emitted: &Emitted) -> PlatformScenario {
    let model = &emitted.compiled.model;
    let task = model.task_space.as_ref().expect("a controller in task space");
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(1));
    machine::scenario(model, task, &specimen, &Noise::of(&specimen), 1)
}

/// The plant alone under six voltages that change every tick, in small steps or in one per tick.
#[divan::bench(args = [false, true])]
fn plant(bencher: Bencher, whole_ticks: bool) {
    let emitted = Emitted::new("bench-plant", "reference.toml", &[]);
    let mut rig = scenario(&emitted).rig().clone();
    if whole_ticks {
        rig.plant_mut().step_whole_ticks(INTERVAL);
    }
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for tick in 0..TICKS {
            let voltage = std::array::from_fn(|leg| 40.0 + 0.01 * ((tick * (leg + 3)) % 500) as f64);
            rig.plant_mut().hold(black_box(&voltage), INTERVAL);
        }
        black_box(rig.plant().pose());
    });
}

/// Six gauges, their noise and their converters.
#[divan::bench]
fn gauges(bencher: Bencher) {
    let emitted = Emitted::new("bench-gauges", "reference.toml", &[]);
    let mut rig = scenario(&emitted).rig().clone();
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for _ in 0..TICKS {
            black_box(rig.read_gauges());
        }
    });
}

/// Noise of the force sensor: six numbers a tick.
#[divan::bench]
fn force_sensor(bencher: Bencher) {
    let emitted = Emitted::new("bench-force", "reference.toml", &[]);
    let mut rig = scenario(&emitted).rig().clone();
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for _ in 0..TICKS {
            black_box(rig.read_wrench());
        }
    });
}

/// Set-points of the paper's case 1.
#[divan::bench]
fn set_points(bencher: Bencher) {
    let trajectory = PaperPose::corrected(PaperPath::Case1, 1.25);
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for tick in 0..TICKS {
            black_box(trajectory.target(black_box(tick as f64 * INTERVAL)));
        }
    });
}

/// Everything: controller, plant, gauges, noise, set-points.
#[divan::bench]
fn whole_loop(bencher: Bencher) {
    let emitted = Emitted::new("bench-loop", "reference.toml", &[]);
    let scenario = scenario(&emitted);
    let mut controller = emitted.controller();
    let words = controller.default_config();
    controller.configure(&words).expect("the spec's settings");
    let trajectory = PaperPose::corrected(PaperPath::Case1, 1.25);
    let mut rig = scenario.rig().clone();
    let mut bench = Bench::new(&mut rig, &mut controller, INTERVAL, 0).expect("a platform");
    bench.arm(60.0).expect("at its bias pose");
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for tick in 0..TICKS {
            let target = trajectory.target(tick as f64 * INTERVAL);
            black_box(bench.tick(&Request::stream(target)).expect("finite voltages"));
        }
    });
}
