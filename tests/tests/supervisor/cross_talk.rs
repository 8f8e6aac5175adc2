//! Cross-talk of an assembled platform, from open drives of one leg after the other with its own converters. Simulation.

use super::bench::*;
use super::oscillation::machine::{Machine, Six};
use host_sim::platform::Mains;
use host_sim::platform::rig::Noise;
use nalgebra::{Rotation3, Vector3};
use specgen::identify::cross_talk::{CrossTalk, of_records};
use specgen::machine;
use specgen::model::Geometry;
use specgen_tests::{Emitted, leg_class, length};
use std::fmt::Write as _;

/// Ticks of a row of `watch`: a period of the mains.
const ROW: usize = 200;
/// Stroke of a leg, m.
const STROKE: f64 = 60e-6;

/// The reference machine with stiff joints; its gauges drift and hum.
fn assembled(emitted: &Emitted, class: u64, quiet: bool) -> Machine {
    let compiled = &emitted.compiled;
    let leg = leg_class(class);
    let task = compiled.model.task_space.as_ref().expect("a platform");
    let mut specimen = machine::specimen(&compiled.model, task, &leg, Some(7));
    let imperfections = &mut specimen.nominal.imperfections;
    imperfections.joint_stiffness_share = 0.0068;
    if !quiet {
        imperfections.mains = vec![Mains { amplitude_m: 5e-9, frequency_hz: 50.0, gauge: None, phase_rad: 0.3 }];
        imperfections.gauge_drift_m_per_s = [1e-9, -1e-9, 1e-9, -1e-9, 1e-9, -1e-9];
    }
    let noise = if quiet { Noise::NONE } else { Noise::of(&specimen) };
    let mut machine = Machine::new(emitted, &leg, 7);
    machine.rig = machine::scenario(&compiled.model, task, &specimen, &noise, 7).rig().clone();
    machine.tick(NOTHING);
    for (phase, request) in [(HOLDING, ARM), (DRIVING, DRIVE)] {
        for _ in 0..40_000 {
            if machine.tick(request).phase == phase {
                break;
            }
        }
        assert_eq!(machine.word.phase, phase, "{}", machine.word);
    }
    machine
}

/// |P₀ + t + R P_i − B_i| − l₀ of each leg: the kinematics to first order would be off by 10 nm.
pub fn lengths(geometry: &Geometry, pose: &Six) -> Six {
    let turn = Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
    let moved = Vector3::new(pose[0], pose[1], pose[2]);
    std::array::from_fn(|leg| {
        let joint = Vector3::from(geometry.platform_joints[leg]);
        let rest = Vector3::from(geometry.rest_legs()[leg]);
        (rest + moved + turn * joint - joint).norm() - rest.norm()
    })
}

/// A file of `watch` while this leg makes three raised cosines of `volts`, 0.5 s each.
fn strokes(machine: &mut Machine, geometry: &Geometry, leg: usize, volts: f64) -> String {
    let names = (0..6).map(|k| format!(",volts[{k}]_mean_V")).chain((0..6).map(|k| format!(",leg[{k}]_m")));
    let mut text = format!("phase,time_s{}\n", names.collect::<String>());
    for row in 0..15_000 / ROW {
        let (mut volts_mean, mut pose_mean) = ([0.0; 6], [0.0; 6]);
        for tick in 0..ROW {
            let turns = (row * ROW + tick) as f64 * 1e-4 / 0.5;
            let mut voltages = [0.0; 6];
            voltages[leg] = 0.5 * volts * (1.0 - (std::f64::consts::TAU * turns).cos());
            machine.command(4, 0, &voltages);
            machine.tick(DRIVE);
            assert_eq!(machine.word.phase, DRIVING, "leg {leg}, row {row}: {}", machine.word);
            let error = machine.error();
            for k in 0..6 {
                volts_mean[k] += voltages[k] / ROW as f64;
                // The set-point stays where it was.
                pose_mean[k] -= error[k] / ROW as f64;
            }
        }
        let _ = write!(text, "6,{:.2}", row as f64 * 0.02);
        volts_mean.iter().for_each(|volts| text += &format!(",{volts:e}"));
        lengths(geometry, &pose_mean).iter().for_each(|length| text += &format!(",{length:e}"));
        text += "\n";
    }
    text
}

pub fn measured(machine: &mut Machine, geometry: &Geometry, rest: f64, volts: f64) -> CrossTalk {
    let records = std::array::from_fn(|leg| {
        // The leg before creeps back.
        machine.command(4, 0, &[0.0; 6]);
        machine.rest(rest);
        (format!("leg{leg}.csv"), strokes(machine, geometry, leg, volts))
    });
    of_records(&records).unwrap_or_else(|findings| panic!("{findings:?}"))
}

/// What is left at a full stroke, by an independent measurement of the same machine at 90 V without noise: (I + E) B beside its
/// diagonal. `found` is E of small strokes.
pub fn left(found: &[Six; 6], whole: &[Six; 6]) -> f64 {
    let entries = found.iter().flatten().zip(whole.iter().flatten());
    entries.fold(0.0, |most: f64, (found, whole)| most.max((found - whole).abs())) * STROKE
}

#[test]
fn cross_talk_is_found_on_the_assembled_machine() {
    let emitted = emitted("supervisor-drive", "reference.toml", &[]);
    let geometry = &emitted.compiled.model.geometry;
    // Bouc-Wen legs creep for longer.
    for (class, rest) in [(0, 2.0), (1, 10.0), (2, 10.0)].into_iter().take(length(1, 3)) {
        let whole = measured(&mut assembled(&emitted, class, true), geometry, rest, 90.0);
        let found = measured(&mut assembled(&emitted, class, false), geometry, rest, 20.0);
        let before = whole.matrix.iter().flatten().fold(0.0, |most: f64, entry| most.max(entry.abs())) * STROKE;
        let after = left(&found.matrix, &whole.matrix);
        println!(
            "legs of class {class}, {rest} s apart: another leg moves by {:.0} nm at a full stroke, {:.2} nm beside E; standard error {:.1e}, residual {:.2} nm",
            before * 1e9,
            after * 1e9,
            found.error,
            found.residual_rms * 1e9
        );
        assert!(before > 300e-9 && after < 3e-9, "{before:e} {after:e}");
    }
}

/// The law's known load has E l beside the other loads: to first order, and with the whole kernel.
#[test]
fn the_law_adds_the_cross_talk_to_its_load() {
    const E: [[f64; 6]; 6] = [
        [0.0, 0.011, -0.004, 0.002, 0.001, -0.003],
        [0.009, 0.0, 0.002, 0.001, -0.004, 0.002],
        [-0.003, 0.002, 0.0, 0.012, 0.002, 0.001],
        [0.001, 0.002, 0.010, 0.0, -0.002, 0.003],
        [0.002, -0.003, 0.001, -0.002, 0.0, 0.011],
        [-0.004, 0.001, 0.002, 0.003, 0.012, 0.0],
    ];
    let line = format!("axial_stiffness = \"1e7 N/m\"\ncross_talk = {E:?}");
    let coupled = emitted("supervisor-coupled", "reference.toml", &[("axial_stiffness = \"1e7 N/m\"", &line)]);
    let plain = emitted("supervisor-drive", "reference.toml", &[]);
    assert!(plain.compiled.ir.task_space.as_ref().unwrap().load.affine.is_some(), "to first order");
    let jacobian = specgen::lower::leg_jacobian(&plain.compiled.model.geometry).unwrap();
    // Without and with a work piece of no stiffness, which takes the whole kernel.
    for interaction in [0.0, 1.0] {
        let loads = [&plain, &coupled].map(|emitted| {
            let mut bench = Bench::new(Kind::Platform, emitted, &[("mode", 6.0), ("interaction", interaction)]);
            bench.setpoint = [3e-6, -2e-6, 4e-6, 20e-6, -30e-6, 10e-6];
            bench.bring_to(RUNNING);
            (bench.six("load"), bench.six("target"))
        });
        let [(plain, target), (coupled, _)] = loads;
        let lengths = jacobian.map(|row| (0..6).map(|axis| row[axis] * target[axis]).sum::<f64>());
        for leg in 0..6 {
            let expected: f64 = (0..6).map(|other| E[leg][other] * lengths[other]).sum();
            let added = coupled[leg] - plain[leg];
            assert!(expected.abs() > 1e-9 && (added - expected).abs() < 1e-12, "leg {leg}: {added:e} of {expected:e}");
        }
    }
}
