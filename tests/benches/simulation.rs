//! Host time of the simulated loop: `cargo bench -p specgen-benches --bench simulation`. Quote ratios: machines are noisy.
//!
//! Every bench simulates a quarter of a second of the reference platform at 10 kHz, or a part of that: items are simulated
//! ticks, so that items/s over 10 000 is simulated time over real time.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use host_sim::controller::TickController;
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformRig;
use host_sim::platform::rig::{Bench, Request};
use host_sim::trajectory::{PaperPath, PaperPose, PoseTrajectory};
use specgen_tests::{Emitted, scenario};

/// Ticks of a bench: a quarter of a second of the machine.
const TICKS: usize = 2500;
const INTERVAL: f64 = 1e-4;

fn main() {
    divan::main();
}

/// Times what is computed in every tick.
fn every_tick<T>(bencher: Bencher, mut compute: impl FnMut(usize) -> T) {
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for tick in 0..TICKS {
            black_box(compute(tick));
        }
    });
}

/// The plant alone under six voltages that change every tick, in long steps or in small ones.
#[divan::bench(args = ["long", "small"])]
fn plant(bencher: Bencher, steps: &str) {
    let emitted = Emitted::new("bench-plant", "reference.toml", &[]);
    let mut rig = stepped(&emitted, steps);
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for tick in 0..TICKS {
            let voltage = std::array::from_fn(|leg| 40.0 + 0.01 * ((tick * (leg + 3)) % 500) as f64);
            rig.plant_mut().hold(black_box(&voltage), INTERVAL);
        }
        black_box(rig.plant().pose());
    });
}

/// The machine in long steps or in small ones.
fn stepped(emitted: &Emitted, steps: &str) -> PlatformRig {
    let mut rig = scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().clone();
    if steps == "small" {
        rig.plant_mut().step_small();
    }
    rig
}

/// A machine as built, through its pre-cycle.
#[divan::bench]
fn preparation(bencher: Bencher) {
    let emitted = Emitted::new("bench-preparation", "reference.toml", &[]);
    bencher.bench_local(|| black_box(scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().plant().pose()));
}

/// Six gauges, their noise and their converters.
#[divan::bench]
fn gauges(bencher: Bencher) {
    let emitted = Emitted::new("bench-gauges", "reference.toml", &[]);
    let mut rig = scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().clone();
    every_tick(bencher, |_| rig.read_gauges());
}

/// Noise of the force sensor: six numbers a tick.
#[divan::bench]
fn force_sensor(bencher: Bencher) {
    let emitted = Emitted::new("bench-force", "reference.toml", &[]);
    let mut rig = scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().clone();
    every_tick(bencher, |_| rig.read_wrench());
}

/// Set-points of the paper's case 1.
#[divan::bench]
fn set_points(bencher: Bencher) {
    let trajectory = PaperPose::corrected(PaperPath::Case1, 1.25);
    every_tick(bencher, |tick| trajectory.target(black_box(tick as f64 * INTERVAL)));
}

/// The controller alone, words in and out, at rest.
#[divan::bench]
fn controller(bencher: Bencher) {
    let emitted = Emitted::new("bench-controller", "reference.toml", &[]);
    let mut controller = emitted.controller();
    let description = controller.description();
    let (input, mut output) = (vec![0; description.input_names.len()], vec![0; description.output_names.len()]);
    bencher.counter(ItemsCount::new(TICKS)).bench_local(|| {
        for _ in 0..TICKS {
            controller.step(black_box(&input), &mut output);
        }
        black_box(&output);
    });
}

/// Everything: controller, plant, gauges, noise, set-points; without a trace and with every word kept.
#[divan::bench(args = ["long", "small", "long, traced"])]
fn whole_loop(bencher: Bencher, steps: &str) {
    let emitted = Emitted::new("bench-loop", "reference.toml", &[]);
    let mut controller = emitted.controller();
    let words = controller.default_config();
    controller.configure(&words).expect("the spec's settings");
    let trajectory = PaperPose::corrected(PaperPath::Case1, 1.25);
    let mut rig = stepped(&emitted, steps);
    let mut bench = Bench::new(&mut rig, &mut controller, INTERVAL, 0).expect("a platform");
    bench.arm(60.0).expect("at its bias pose");
    if steps.ends_with("traced") {
        bench.record();
    }
    every_tick(bencher, |tick| {
        let target = trajectory.target(tick as f64 * INTERVAL);
        bench.tick(&Request::stream(target)).expect("finite voltages")
    });
}
