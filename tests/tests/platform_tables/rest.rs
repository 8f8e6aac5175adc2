//! The noise of the pose at rest, as the compiler states it, against the emitted controller on the simulated machine.

use host_sim::controller::TickController;
use host_sim::platform::rig::{Bench as Rig, Noise, Request, RunOptions};
use host_sim::platform::{PlatformScenario, Specimen};
use specgen::rest;
use specgen_tests::length;

use super::bench::{BIAS, PERIOD, SEED, reference_machine};

/// Ticks until creep is slow, and ticks that are looked at.
const STANDING: usize = 5_000;
const LOOKED_AT: usize = 6_000;

/// Rms about a straight line: what creeps is no noise.
fn rms(values: &[f64]) -> f64 {
    let middle = 0.5 * (values.len() - 1) as f64;
    let (mut level, mut slope, mut spread) = (0.0, 0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let time = k as f64 - middle;
        (level, slope, spread) = (level + value, slope + time * value, spread + time * time);
    }
    let (level, slope) = (level / values.len() as f64, slope / spread);
    let left = values.iter().enumerate().map(|(k, value)| value - level - slope * (k as f64 - middle));
    (left.map(|left| left * left).sum::<f64>() / values.len() as f64).sqrt()
}

/// Both sources as they are, and each above the other; with the controller of another test. What voltages so small move is below the leg
/// gain, for most of a leg's hysteresis does not switch: the part of the amplifiers is a bound.
#[test]
fn the_pose_at_rest_is_as_noisy_as_the_compiler_states() {
    let machine = reference_machine();
    let specimen: &Specimen = &machine.specimen;
    let compiled = &machine.emitted.compiled;
    let mut all_hold = true;
    let sources = [(2.2e-9, 2e-3, 0.75..1.05), (80e-9, 0.0, 0.95..1.05), (0.2e-9, 0.1, 0.5..1.05)];
    for (gauge, amplifier, bounds) in sources.into_iter().take(length(1, 3)) {
        let mut model = compiled.model.clone();
        (model.sensor.noise, model.amplifier.noise) = (gauge, amplifier);
        let stated = rest::noise(&model, compiled.design.as_ref()).unwrap();
        let mut noise = Noise::of(specimen);
        (noise.channels.sensor_nm_rms, noise.channels.amplifier_mv_rms) = (gauge * 1e9, amplifier * 1e3);
        let mut scenario = PlatformScenario::new(specimen, &noise, SEED, RunOptions::new(PERIOD, BIAS));
        let mut controller = machine.controller();
        controller.reset();
        let mut rig = Rig::new(scenario.rig_mut(), &mut controller, PERIOD, 0).unwrap();
        rig.arm(10.0).unwrap();
        let mut axes: [Vec<f64>; 6] = Default::default();
        for tick in 0..STANDING + LOOKED_AT {
            let found = rig.tick(&Request::default()).unwrap();
            if tick >= STANDING {
                axes.iter_mut().zip(found.measured).for_each(|(axis, value)| axis.push(value));
            }
        }
        for (axis, values) in axes.iter().enumerate() {
            let ratio = rms(values) / stated.pose[axis];
            let (nm, mv, stated_nm) = (gauge * 1e9, amplifier * 1e3, stated.pose[axis] * 1e9);
            println!("{nm:.1} nm, {mv:.0} mV: axis {axis} {stated_nm:.2} stated, × {ratio:.3}");
            all_hold &= bounds.contains(&ratio);
        }
    }
    assert!(all_hold);
}
