//! Host time of the parts of one simulated tick: `cargo run --release -p host-sim --example whole_tick_cost [LIBRARY]`, with
//! the host library of an emitted platform controller for the controller's part.

use std::hint::black_box;
use std::time::Instant;

use host_sim::closed_loop::Preparation;
use host_sim::controller::{Controller, TickController};
use host_sim::platform::rig::{Bench, Noise, Request};
use host_sim::platform::{PlatformRig, Specimen};
use host_sim::trajectory::{Multisine, PoseTrajectory};

const TICKS: usize = 500;

/// Least time of many tries, ns a tick.
fn least(mut part: impl FnMut(usize)) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let begun = Instant::now();
        (0..TICKS).for_each(&mut part);
        best = f64::min(best, begun.elapsed().as_secs_f64() / TICKS as f64 * 1e9);
    }
    best
}

fn main() {
    let specimen = Specimen::reference();
    let mut rig = PlatformRig::new(&specimen, &Noise::of(&specimen), 1);
    rig.prepare(&Preparation { peak: 100.0, rate: 200.0, settle: 0.2, update: 5e-5, rest: 0.0 });
    let voltages = |tick: usize| std::array::from_fn(|leg| 40.0 + 0.01 * ((tick * (leg + 3)) % 500) as f64);
    for whole in [false, true] {
        let mut rig = rig.clone();
        if whole {
            rig.plant_mut().step_whole_ticks(1e-4);
        }
        let plant = least(|tick| rig.plant_mut().hold(&voltages(tick), 1e-4));
        println!("plant{}: {plant:.0} ns", if whole { " in whole ticks" } else { "" });
    }
    for ahead in [false, true] {
        let mut rig = rig.clone();
        if ahead {
            rig.draw_ahead(201 * TICKS);
        }
        let name = if ahead { " drawn ahead" } else { "" };
        println!(
            "gauges, noise{name}: {:.0} ns",
            least(|_| {
                black_box(rig.read_gauges());
            })
        );
        println!(
            "force sensor, noise{name}: {:.0} ns",
            least(|_| {
                black_box(rig.read_wrench());
            })
        );
    }
    let sines = Multisine::new(2.0, 10.0, [0.0; 6], [2e-6; 6], 1);
    println!(
        "set-point: {:.0} ns",
        least(|tick| {
            black_box(sines.target(tick as f64 * 1e-4));
        })
    );
    let Some(path) = std::env::args_os().nth(1) else { return };
    let mut controller = match Controller::load(path.as_ref()) {
        Ok(controller) => controller,
        Err(error) => return eprintln!("{error}"),
    };
    let (inputs, outputs) = (controller.description().input_names.len(), controller.description().output_names.len());
    let (input, mut output) = (vec![0; inputs], vec![0; outputs]);
    println!("controller on zeros: {:.0} ns", least(|_| controller.step(&input, &mut output)));
    rig.plant_mut().step_whole_ticks(1e-4);
    rig.draw_ahead(400 * TICKS);
    let mut bench = match Bench::new(&mut rig, &mut controller, 1e-4, 0) {
        Ok(bench) => bench,
        Err(error) => return eprintln!("{error}"),
    };
    if let Err(error) = bench.arm(60.0) {
        return eprintln!("{error}");
    }
    let loop_ = least(|tick| {
        let _ = black_box(bench.tick(&Request::stream(sines.target(tick as f64 * 1e-4))));
    });
    println!("whole loop with set-point: {loop_:.0} ns");
}
