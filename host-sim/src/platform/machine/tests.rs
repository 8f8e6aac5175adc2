use super::*;
use crate::plant::LegParameters;
use crate::platform::PlatformParameters;

fn preparation(specimen: &Specimen) -> Preparation {
    Preparation { peak: specimen.legs[0].u_max, rate: 200.0, settle: 0.2, update: 5e-5 }
}

fn prepared(specimen: &Specimen) -> Machine {
    let mut machine = Machine::new(specimen);
    machine.prepare(&preparation(specimen));
    machine
}

/// Holds equal voltages and lets the platform settle; the pose.
fn raised(machine: &mut Machine, volts: f64, time: f64) -> Six {
    for _ in 0..(time / 1e-4) as usize {
        machine.hold(&[volts; 6], 1e-4);
    }
    machine.pose()
}

#[test]
fn without_a_load_the_platform_goes_where_the_free_legs_are() {
    let specimen = Specimen::reference();
    let mut machine = prepared(&specimen);
    assert_eq!(machine.pose(), [0.0; 6]);
    let pose = raised(&mut machine, 50.0, 0.3);
    let lengths = specimen.nominal.geometry().extensions(&pose);
    for (found, free) in lengths.iter().zip(machine.free_displacements()) {
        // Creep goes on at some nm/ms; the weight's moments bend the platform by picometres.
        assert!((found - free).abs() < 1e-10, "{lengths:?} {:?}", machine.free_displacements());
    }
    assert!(pose[2] > 25e-6 && pose[2] < 60e-6, "{pose:?}");
    // Legs within ±10 % tilt and turn it.
    assert!(pose[3].abs() > 1e-6 && pose[4].abs() > 1e-6, "{pose:?}");
}

#[test]
fn equal_legs_raise_it_straight_and_a_part_holds_it_down() {
    let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
    let mut machine = prepared(&specimen);
    let free = raised(&mut machine.clone(), 50.0, 0.3);
    // Equal legs but for the pairs' angle: the platform rises, and turns by less than a millionth of that.
    assert!(free[0].abs() < 1e-12 && free[1].abs() < 1e-12 && free[3].abs() < 1e-11, "{free:?}");
    machine.touch(WorkPart::glass());
    let pressed = raised(&mut machine, 50.0, 0.3);
    let share = 3.97e7 / (3.97e7 + 3e6);
    assert!((pressed[2] / free[2] / share - 1.0).abs() < 1e-3, "{pressed:?} {free:?}");
    let wrench = machine.wrench();
    assert!((wrench.force[2] + 3e6 * pressed[2]).abs() < 1e-6, "{wrench:?}");
    machine.release();
    assert_eq!(machine.wrench(), Wrench::default());
    let again = raised(&mut machine, 50.0, 0.3);
    assert!((again[2] / free[2] - 1.0).abs() < 0.01);
}

#[test]
fn the_current_limit_binds() {
    let mut specimen = Specimen::reference();
    let stack = |specimen: &Specimen, time: f64| {
        let mut machine = prepared(specimen);
        let mut left = time;
        while left > 1e-12 {
            machine.hold(&[80.0; 6], 1e-4);
            left -= 1e-4;
        }
        machine.stack_voltages()[0]
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
    let mut runs = [2e-5, 1e-5, 2.5e-6].map(|step| {
        let mut machine = prepared(&specimen);
        machine.set_longest_step(step);
        let mut poses = Vec::new();
        for tick in 0..1000 {
            let volts = std::array::from_fn(|leg| {
                40.0 - 40.0
                    * libm::cos(2.0 * core::f64::consts::PI * 10.0 * f64::from(tick) * 1e-4)
                    * (1.0 - 0.1 * leg as f64)
            });
            machine.hold(&volts, 1e-4);
            poses.push(machine.pose());
        }
        poses
    });
    let finest = runs[2].clone();
    let worst = |run: &mut Vec<Six>| {
        run.iter()
            .zip(&finest)
            .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max))
            .fold(0.0, f64::max)
    };
    let (coarse, half) = (worst(&mut runs[0]), worst(&mut runs[1]));
    println!("10 Hz: {:.1} pm at 20 µs, {:.1} pm at 10 µs from 2.5 µs", coarse * 1e12, half * 1e12);
    assert!(coarse < 2e-9 && half < 0.6 * coarse, "{coarse} {half}");
}

#[test]
fn the_same_voltages_give_the_same_bits() {
    let run = || {
        let mut machine = prepared(&Specimen::random(3, 4));
        machine.touch(WorkPart::aluminium());
        raised(&mut machine, 33.0, 0.05).map(f64::to_bits)
    };
    assert_eq!(run(), run());
}
