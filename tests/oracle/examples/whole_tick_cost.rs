//! Host time of the parts of one simulated tick: `cargo run --release -p oracle --example whole_tick_cost [LIBRARY [LEG]]`.
//! LIBRARY is the host library of the reference platform's controller. With it, the example also measures the controller, and the
//! complete simulation of the paper's cases and machining in small, finer and long steps of the plant, and compares their tables.
//! LEG is the class of the legs, `plays` or `bouc-wen`.

use std::hint::black_box;
use std::time::Instant;

use host_sim::closed_loop::Preparation;
use host_sim::controller::{Controller, TickController};
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Noise, RunOptions};
use host_sim::platform::scenario::{FREE_MODES, select};
use host_sim::platform::{PlatformParameters, PlatformRig, PlatformScenario, Specimen, WorkPart};
use host_sim::trajectory::{Multisine, PaperPath, PaperPose, PoseTrajectory};

const TICKS: usize = 500;

/// Processor time of this thread, s, which excludes other work on the computer. Wall-clock time if Linux does not report it.
fn processor_time(start: Instant) -> f64 {
    let said = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = said.as_deref().and_then(|text| text.split(' ').next()).and_then(|word| word.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// Least time of many tries, ns per tick.
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
    let start = Instant::now();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let mut rig = PlatformRig::new(&specimen, &Noise::NONE, 1);
        let begun = processor_time(start);
        rig.prepare(&Preparation::of(&specimen.legs[0], 0.0));
        best = f64::min(best, processor_time(start) - begun);
    }
    println!("pre-cycle: {:.1} ms", best * 1e3);
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
    let leg = std::env::args_os().nth(2).unwrap_or_else(|| "plays".into());
    let leg = match LegParameters::named(leg.as_ref(), |path| std::fs::read_to_string(path)) {
        Ok(leg) => leg,
        Err(error) => return eprintln!("{error}"),
    };
    let specimen = Specimen::within_tolerances(&PlatformParameters::reference(), &leg, 1);
    let cases = [(PaperPath::Case1, 1.0), (PaperPath::Case2, 1.0), (PaperPath::Case1, 10.0), (PaperPath::Case2, 10.0)];
    let machining = [WorkPart::glass(), WorkPart::aluminium()].map(|part| (PaperPath::Machining, 1.0, Some(part)));
    let runs: Vec<_> = cases.iter().map(|(path, hz)| (*path, *hz, None)).chain(machining).collect();
    let options = RunOptions::new(1e-4, [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0]);
    let mut scenario = PlatformScenario::new(&specimen, &Noise::of(&specimen), 1, options);
    let mut tables = Vec::new();
    for (steps, longest) in [("small", 2e-5), ("finer", 4e-6), ("long", 2e-5)] {
        scenario.rig_mut().plant_mut().set_longest_step(longest);
        if steps == "long" {
            scenario.rig_mut().plant_mut().step_whole_ticks(1e-4);
        }
        let (mut best, mut simulated, mut table) = (f64::INFINITY, 0.0, Vec::new());
        for _ in 0..if steps == "finer" { 1 } else { 3 } {
            let begun = processor_time(start);
            (simulated, table) = (0.0, Vec::new());
            for (_, word) in FREE_MODES {
                if let Err(error) = select(&mut controller, word) {
                    return eprintln!("{error}");
                }
                for (path, hertz, part) in &runs {
                    let path = PaperPose::corrected(*path, *hertz);
                    let run = match part {
                        Some(part) => scenario.against(&mut controller, &path, *part),
                        None => scenario.run(&mut controller, &path),
                    };
                    match run {
                        Err(error) => return eprintln!("{error}"),
                        Ok(run) => {
                            simulated += run.arming + scenario.options.settle + path.duration();
                            table.extend(run.errors.rms_nano());
                        }
                    }
                }
            }
            best = f64::min(best, processor_time(start) - begun);
        }
        println!("{simulated:.2} s of everything in {steps} steps: {best:.3} s, {:.1} × real time", simulated / best);
        tables.push(table);
    }
    let apart = |table: &[f64], first: usize| {
        let each = table.iter().zip(&tables[1]).enumerate().filter(|(k, _)| k % 6 / 3 == first / 3);
        each.map(|(_, (found, finer))| (found - finer).abs()).fold(0.0, f64::max)
    };
    for (steps, table) in [("small", &tables[0]), ("long", &tables[2])] {
        let [nm, nrad] = [0, 3].map(|first| apart(table, first));
        println!("largest difference of an rms error, {steps} steps from finer ones: {nm:.4} nm, {nrad:.3} nrad");
    }
}
