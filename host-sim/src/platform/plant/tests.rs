use super::*;
use crate::plant::LegParameters;
use crate::platform::{PlatformParameters, worse};

fn preparation(specimen: &Specimen) -> Preparation {
    Preparation { peak: specimen.legs[0].u_max, rate: 200.0, settle: 0.2, update: 5e-5, rest: 0.0 }
}

fn prepared(specimen: &Specimen) -> PlatformPlant {
    let mut plant = PlatformPlant::new(specimen);
    plant.prepare(&preparation(specimen));
    plant
}

/// 10 Hz on all legs from rest, slower than the current limit, as a controller would drive them.
fn voltages(tick: u32) -> Six {
    let rise = 40.0 - 40.0 * libm::cos(2.0 * core::f64::consts::PI * 10.0 * f64::from(tick) * 1e-4);
    std::array::from_fn(|leg| rise * (1.0 - 0.1 * leg as f64))
}

fn driven(plant: &mut PlatformPlant, ticks: u32) -> Vec<Six> {
    let pose = |tick| {
        plant.hold(&voltages(tick), 1e-4);
        plant.pose()
    };
    (0..ticks).map(pose).collect()
}

fn worst(run: &[Six], other: &[Six]) -> f64 {
    assert!(!run.is_empty() && run.len() == other.len(), "{} and {} poses", run.len(), other.len());
    let one = |a: &Six, b: &Six| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, worse);
    run.iter().zip(other).map(|(a, b)| one(a, b)).fold(0.0, worse)
}

/// Holds equal voltages and lets the platform settle; the pose.
fn raised(plant: &mut PlatformPlant, volts: f64, time: f64) -> Six {
    for _ in 0..(time / 1e-4) as usize {
        plant.hold(&[volts; 6], 1e-4);
    }
    plant.pose()
}

#[test]
fn without_a_load_the_platform_goes_where_the_free_legs_are() {
    let specimen = Specimen::reference();
    let mut plant = prepared(&specimen);
    assert_eq!(plant.pose(), [0.0; 6]);
    let pose = raised(&mut plant, 50.0, 0.3);
    let lengths = specimen.nominal.geometry().extensions(&pose);
    for (found, free) in lengths.iter().zip(plant.free_displacements()) {
        // Creep goes on at some nm/ms; the weight's moments bend the platform by picometres.
        assert!((found - free).abs() < 1e-10, "{lengths:?} {:?}", plant.free_displacements());
    }
    assert!(pose[2] > 25e-6 && pose[2] < 60e-6, "{pose:?}");
    // Legs within ±10 % tilt and turn it.
    assert!(pose[3].abs() > 1e-6 && pose[4].abs() > 1e-6, "{pose:?}");
}

#[test]
fn equal_legs_raise_it_straight_and_a_part_holds_it_down() {
    let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
    let mut plant = prepared(&specimen);
    let free = raised(&mut plant.clone(), 50.0, 0.3);
    // Equal legs but for the pairs' angle: the platform rises, and turns by less than a millionth of that.
    assert!(free[0].abs() < 1e-12 && free[1].abs() < 1e-12 && free[3].abs() < 1e-11, "{free:?}");
    plant.touch(WorkPart::glass());
    let pressed = raised(&mut plant, 50.0, 0.3);
    let share = 3.97e7 / (3.97e7 + 3e6);
    assert!((pressed[2] / free[2] / share - 1.0).abs() < 1e-3, "{pressed:?} {free:?}");
    let wrench = plant.wrench();
    assert!((wrench.force[2] + 3e6 * pressed[2]).abs() < 1e-6, "{wrench:?}");
    plant.release();
    assert_eq!(plant.wrench(), Wrench::default());
    let again = raised(&mut plant, 50.0, 0.3);
    assert!((again[2] / free[2] - 1.0).abs() < 0.01);
}

#[test]
fn the_current_limit_binds() {
    let mut specimen = Specimen::reference();
    let stack = |specimen: &Specimen, time: f64| {
        let mut plant = prepared(specimen);
        let mut left = time;
        while left > 1e-12 {
            plant.hold(&[80.0; 6], 1e-4);
            left -= 1e-4;
        }
        plant.stack_voltages()[0]
    };
    // 0.3 A into 7 µF is 42.9 V/ms, which 80 V across 0.35 ms (229 V/ms) exceed.
    assert!((stack(&specimen, 1e-3) - 300.0 / 7.0).abs() < 1e-6, "{}", stack(&specimen, 1e-3));
    specimen.nominal.amplifier_current_a = 0.03;
    assert!((stack(&specimen, 1e-3) - 30.0 / 7.0).abs() < 1e-6);
    specimen.nominal.amplifier_current_a = 1e3;
    let lag = specimen.legs[0].tau_amp_s;
    assert!((stack(&specimen, 1e-3) - 80.0 * (1.0 - libm::exp(-1e-3 / lag))).abs() < 1e-9);
}

#[test]
fn halving_the_step_shows_second_order_and_a_nanometre_at_most() {
    let specimen = Specimen::reference();
    let [coarse, half, finest] = [2e-5, 1e-5, 2.5e-6].map(|step| {
        let mut plant = prepared(&specimen);
        plant.set_longest_step(step);
        driven(&mut plant, 1000)
    });
    let (coarse, half) = (worst(&coarse, &finest), worst(&half, &finest));
    println!("10 Hz: {:.1} pm at 20 µs, {:.1} pm at 10 µs from 2.5 µs", coarse * 1e12, half * 1e12);
    assert!(coarse < 0.2e-9 && half < 0.6 * coarse, "{coarse} {half}");
}

#[test]
fn the_same_voltages_give_the_same_bits() {
    let run = |volts: f64| {
        let mut plant =
            prepared(&Specimen::within_tolerances(&PlatformParameters::reference(), &LegParameters::reference(), 3));
        plant.touch(WorkPart::aluminium());
        raised(&mut plant, volts, 0.05).map(f64::to_bits)
    };
    assert_eq!(run(33.0), run(33.0));
    assert_ne!(run(33.0), run(33.000_001));
}

/// Legs of both classes.
fn classes() -> [(&'static str, Specimen); 2] {
    ["plays", "bouc-wen"].map(|name| {
        let leg = LegParameters::named(std::path::Path::new(name), |path| std::fs::read_to_string(path)).unwrap();
        (name, Specimen::within_tolerances(&PlatformParameters::reference(), &leg, 1))
    })
}

/// In steps of `step`, in long ones, and in long ones of half the length under the same voltages.
fn long_from_finest(specimen: &Specimen, part: Option<WorkPart>, step: f64) -> [f64; 2] {
    let mut finest = prepared(specimen);
    part.into_iter().for_each(|part| finest.touch(part));
    let [mut whole, mut half] = [finest.clone(), finest.clone()];
    finest.set_longest_step(step);
    half.set_longest_step(1e-5);
    whole.step_whole_ticks(1e-4);
    half.step_whole_ticks(1e-4);
    let reference = driven(&mut finest, 1000);
    assert!(whole.long.is_some() && half.long.is_some());
    assert_eq!([whole.actuators.step(), half.actuators.step()], [1e-4, 0.5e-4]);
    [whole, half].map(|mut plant| worst(&driven(&mut plant, 1000), &reference))
}

#[test]
fn long_steps_are_a_hundredth_of_a_nanometre_from_the_finest_in_both_classes_of_legs_and_in_touch() {
    for (name, specimen) in classes() {
        for part in [None, Some(WorkPart::glass())] {
            let [whole, half] = long_from_finest(&specimen, part, 2.5e-6);
            let (touching, whole_pm, half_pm) = (part.is_some(), whole * 1e12, half * 1e12);
            println!(
                "10 Hz, 56 µm, {name}, touching {touching}: {whole_pm:.1} pm in whole ticks, {half_pm:.1} pm in halves"
            );
            assert!(whole < 20e-12 && half < 15e-12, "{name}: {whole:e} {half:e}");
        }
    }
}

#[test]
fn long_steps_know_amplifiers_of_every_lag() {
    for lag in [0.0, 5e-6, 20e-6, 50e-6, 0.1e-3, 0.35e-3, 2e-3, 0.1] {
        let mut specimen = Specimen::reference();
        specimen.legs.iter_mut().for_each(|leg| leg.tau_amp_s = lag);
        let [whole, half] = long_from_finest(&specimen, None, if lag < 0.1e-3 { 2.5e-7 } else { 2.5e-6 });
        println!("lag {:.0} µs: {:.1} pm in whole ticks, {:.1} pm in halves", lag * 1e6, whole * 1e12, half * 1e12);
        let bound = if lag < 0.1e-3 { 0.3e-9 } else { 0.05e-9 };
        assert!(whole < bound && half < bound, "lag {lag}: {whole:e} {half:e}");
    }
}

#[test]
fn a_kick_rings_alike_in_long_steps_and_at_the_current_limit() {
    for (name, specimen) in classes() {
        let mut usual = prepared(&specimen);
        let mut whole = usual.clone();
        usual.set_longest_step(2.5e-6);
        whole.step_whole_ticks(1e-4);
        for (volts, bound) in [(10.0, 0.1e-9), (80.0, 1e-9)] {
            let kick = |plant: &PlatformPlant| -> Vec<Six> {
                let mut plant = plant.clone();
                (0..300)
                    .map(|_| {
                        plant.hold(&[volts, 0.0, volts, 0.0, 0.0, 0.5 * volts], 1e-4);
                        plant.pose()
                    })
                    .collect()
            };
            let (a, b) = (kick(&usual), kick(&whole));
            println!("{name}, {volts} V: {:.1} pm of {:.1} µm", worst(&a, &b) * 1e12, a[299][2] * 1e6);
            assert!(worst(&a, &b) < bound, "{name}, {volts} V: {:e}", worst(&a, &b));
        }
    }
}

/// 5 kHz: an interval is two long steps.
#[test]
fn intervals_longer_than_a_long_step_are_several_and_others_may_follow() {
    let specimen = Specimen::reference();
    let [mut fine, mut long] = [prepared(&specimen), prepared(&specimen)];
    fine.set_longest_step(2.5e-6);
    long.step_whole_ticks(2e-4);
    for tick in 0..600 {
        // Of one length, then of another, then of the first again.
        let interval = if (200..400).contains(&tick) { 0.7e-4 } else { 2e-4 };
        let volts =
            std::array::from_fn(|leg| 40.0 * (1.0 - libm::cos(0.01 * f64::from(tick) * (1.0 + 0.1 * leg as f64))));
        fine.hold(&volts, interval);
        long.hold(&volts, interval);
        assert!(worst(&[fine.pose()], &[long.pose()]) < 50e-12, "{tick}: {:?} {:?}", fine.pose(), long.pose());
    }
    assert!(long.long.is_some());
    assert_eq!(long.actuators.step(), 1e-4);
}

/// The pre-cycle of the parameter files, 20 V/s and 50 µs; one leg takes less than the others.
#[test]
fn a_pre_cycle_in_long_steps_leaves_the_legs_where_small_steps_do() {
    for (name, mut specimen) in classes() {
        specimen.legs[2].u_max = 90.0;
        let preparation @ Preparation { rate, settle, update, .. } = Preparation::of(&specimen.legs[0], 0.0);
        let mut long = PlatformPlant::new(&specimen);
        let mut small = long.actuators.clone();
        long.cycle(&preparation);
        let peaks = lanes_of(&specimen.legs.each_ref().map(|leg| leg.u_max));
        let steps = steps_within(100.0 / rate, update);
        small.set_step(100.0 / rate / f64::from(steps));
        for step in (1..=steps).chain((0..steps).rev()) {
            small.advance(&peaks.map(|peak| peak * f64::from(step) / f64::from(steps)), true);
        }
        let steps = steps_within(settle, update);
        small.set_step(settle / f64::from(steps));
        for _ in 0..steps {
            small.advance(&[0.0; LANES], true);
        }
        // Where they rest, and what the history is to a drive through all plays.
        for volts in [0.0, 100.0] {
            let [long, small] = [&mut long.actuators, &mut small].map(|actuators| {
                actuators.set_step(2e-5);
                (0..500).fold([0.0; LANES], |_, _| actuators.advance(&lanes_of(&[volts; 6]), true))
            });
            for leg in 0..6 {
                let apart = (long[leg] - small[leg]).abs() * 1e-6;
                assert!(apart < 10e-12, "{name}, {volts} V, leg {leg}: {apart:e}");
            }
        }
    }
}

#[test]
fn a_disturbed_platform_is_in_small_steps_and_afterwards_in_long_ones() {
    let mut long = prepared(&Specimen::reference());
    let mut small = long.clone();
    long.step_whole_ticks(1e-4);
    for plant in [&mut long, &mut small] {
        plant.disturb(&Wrench { force: [10.0, -20.0, 30.0], torque: [0.1, 0.2, -0.3] });
        driven(plant, 100);
    }
    assert_eq!(long.pose().map(f64::to_bits), small.pose().map(f64::to_bits));
    assert!(long.long.is_none());
    long.disturb(&Wrench::default());
    driven(&mut long, 1);
    assert!(long.long.is_some());
    long.step_small();
    assert!(long.long.is_none());
    driven(&mut long, 1);
    assert!(long.long.is_none());
}

#[test]
fn whole_ticks_have_the_same_bits_on_every_processor_and_end_where_they_must() {
    let specimen = Specimen::reference();
    let mut plant = prepared(&specimen);
    plant.step_whole_ticks(1e-4);
    let mut plain = plant.clone();
    for tick in 0..500 {
        let volts = std::array::from_fn(|leg| f64::from(tick % (50 + 7 * leg as u32)));
        plant.hold(&volts, 1e-4);
        let structure = plain.long.as_mut().unwrap();
        plain.displacement = long_step::advance_anywhere(&mut plain.actuators, structure, &plain.rest, &volts);
        assert_eq!(plant.pose().map(f64::to_bits), plain.pose().map(f64::to_bits), "tick {tick}");
    }
    let (pose, voltages, free) = (plant.pose(), plant.stack_voltages(), plant.free_displacements());
    plant.touch(WorkPart::glass());
    assert!(plant.long.is_none());
    assert_eq!((plant.pose(), plant.stack_voltages()), (pose, voltages));
    assert_eq!(plant.free_displacements(), free);
}

/// What gauges show of a kick, against an integration of their lag of its own behind the true pose of fine steps.
#[test]
fn gauges_show_the_pose_behind_their_lag_in_small_steps_and_in_whole_ticks() {
    for lag in [15e-6, 0.3e-3] {
        let mut specimen = Specimen::reference();
        specimen.legs.iter_mut().for_each(|leg| leg.gauge_lag_s = lag);
        let kick = |tick: usize| [if tick < 5 { 10.0 } else { 0.0 }, 0.0, 10.0, 0.0, 0.0, 5.0];
        let mut fine = prepared(&specimen);
        assert_eq!(fine.seen(), [0.0; 6]);
        let mut shown = [0.0; 6];
        let mut expected = Vec::new();
        for tick in 0..100 {
            for _ in 0..100 {
                let before = fine.pose();
                fine.hold(&kick(tick), 1e-6);
                // Of an input that is a straight line over the step: y − τ ẏ and what is left of the beginning.
                for (k, pose) in fine.pose().into_iter().enumerate() {
                    let slope = (pose - before[k]) / 1e-6;
                    let left = (shown[k] - (before[k] - lag * slope)) * libm::exp(-1e-6 / lag);
                    shown[k] = pose - lag * slope + left;
                }
            }
            expected.push(shown);
        }
        let run = |whole: bool| -> Vec<Six> {
            let mut plant = prepared(&specimen);
            if whole {
                plant.step_whole_ticks(1e-4);
            }
            let shown = |tick| {
                plant.hold(&kick(tick), 1e-4);
                plant.seen()
            };
            (0..100).map(shown).collect()
        };
        let moved = expected.iter().map(|pose| pose[2].abs()).fold(0.0, f64::max);
        let [small, whole] = [false, true].map(|whole| worst(&run(whole), &expected));
        let (small_pm, whole_pm, moved_um) = (small * 1e12, whole * 1e12, moved * 1e6);
        println!("lag {lag} s: {small_pm:.1} pm in small steps, {whole_pm:.1} pm in whole ticks, of {moved_um:.2} µm");
        assert!(moved > 1e-6 && small < 1e-9 && whole < 0.2e-9, "{small:e} {whole:e}");
    }
}

#[test]
fn gauges_without_a_lag_show_the_pose_to_the_bit() {
    let specimen = Specimen::reference();
    let mut plant = prepared(&specimen);
    for tick in 0..50 {
        plant.hold(&voltages(tick), 1e-4);
        assert_eq!(plant.seen().map(f64::to_bits), plant.pose().map(f64::to_bits));
    }
}
