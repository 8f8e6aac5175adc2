//! Each mechanism against its closed form, and against Runge–Kutta steps of its own equation.

use super::*;
use crate::closed_loop::Preparation;
use crate::noise::Gaussian;
use crate::plant::LegParameters;
use crate::platform::rig::Noise;
use crate::platform::{PlatformParameters, PlatformPlant, PlatformRig, REFERENCE_PLATFORM, Specimen, Structure};
use crate::platform::{Wrench, worse};

fn mode(at: &str, frequency_hz: f64, damping_ratio: f64) -> StructuralMode {
    let place = ModePlace::try_from(at.to_owned()).unwrap();
    StructuralMode { place, frequency_hz, damping_ratio, participation: None }
}

fn specimen(imperfections: Imperfections) -> Specimen {
    let nominal = PlatformParameters { imperfections, ..PlatformParameters::reference() };
    Specimen::within_tolerances(&nominal, &LegParameters::reference(), 1)
}

fn with_modes(modes: Vec<StructuralMode>) -> Specimen {
    specimen(Imperfections { modes, ..Imperfections::default() })
}

fn preparation() -> Preparation {
    Preparation { peak: 100.0, rate: 200.0, settle: 0.05, update: 5e-5, rest: 0.0 }
}

fn prepared_plant(specimen: &Specimen) -> PlatformPlant {
    let mut plant = PlatformPlant::new(specimen);
    plant.prepare(&preparation());
    plant
}

fn prepared_rig(specimen: &Specimen) -> PlatformRig {
    let mut rig = PlatformRig::new(specimen, &Noise::NONE, 5);
    rig.prepare(&preparation());
    rig
}

/// Voltages that jump, so that everything rings.
fn jumps(tick: usize) -> Six {
    std::array::from_fn(|leg| if (tick / 40 + leg).is_multiple_of(2) { 30.0 } else { 20.0 + leg as f64 })
}

/// w and ẇ of ẅ = ω² (x − w) − 2ζω ẇ after `time` in `steps` Runge–Kutta steps, from `state`.
fn runge_kutta(mode: &StructuralMode, mut state: [f64; 2], x: impl Fn(f64) -> f64, time: f64, steps: u32) -> [f64; 2] {
    let natural = TAU * mode.frequency_hz;
    let slope = |state: [f64; 2], at: f64| {
        [state[1], natural * natural * (x(at) - state[0]) - 2.0 * mode.damping_ratio * natural * state[1]]
    };
    let h = time / f64::from(steps);
    for n in 0..steps {
        let at = f64::from(n) * h;
        let go = |k: [f64; 2], part: f64| [state[0] + part * h * k[0], state[1] + part * h * k[1]];
        let k1 = slope(state, at);
        let k2 = slope(go(k1, 0.5), at + 0.5 * h);
        let k3 = slope(go(k2, 0.5), at + 0.5 * h);
        let k4 = slope(go(k3, 1.0), at + h);
        for k in 0..2 {
            state[k] += h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]);
        }
    }
    state
}

#[test]
fn modes_have_the_frequency_response_of_the_closed_form() {
    let of = mode("leg", 1200.0, 0.01);
    for ratio in [0.1, 0.5, 0.9, 1.0, 1.1, 2.0] {
        let natural = TAU * 1200.0;
        let w = ratio * natural;
        let wave = |time: f64| [libm::sin(w * time), w * libm::cos(w * time)];
        let step = 0.05 / if w > natural { w } else { natural };
        let mut oscillator = Oscillator::new(&of);
        oscillator.set_step(step);
        // The transient is below 1e-9 after 21/(ζω).
        let settled = (21.0 / (0.01 * natural) / step) as u32;
        (0..settled).for_each(|n| {
            oscillator.advance(wave(f64::from(n) * step), wave(f64::from(n + 1) * step));
        });
        // H = 1/(1 − r² + 2jζr).
        let (re, im) = (1.0 - ratio * ratio, 2.0 * 0.01 * ratio);
        let size = re * re + im * im;
        let at = |time: f64, factor: f64| {
            let (sin, cos) = libm::sincos(w * time);
            (factor * (re * sin - im * cos) / size, factor * w * (re * cos + im * sin) / size)
        };
        let (mut worst, mut scale) = (0.0, 0.0_f64);
        for n in settled..settled + 400 {
            let (now, next) = (wave(f64::from(n) * step), wave(f64::from(n + 1) * step));
            oscillator.advance(now, next);
            let time = f64::from(n + 1) * step;
            let (low, high) = (at(time, 1.0), at(time, ratio * ratio));
            let [second, rate] = oscillator.second(next);
            for (found, expected) in [
                (oscillator.position, low.0),
                (oscillator.velocity / natural, low.1 / natural),
                (second, high.0),
                (rate / natural, high.1 / natural),
            ] {
                worst = worse(worst, (found - expected).abs());
                scale = scale.max(expected.abs());
            }
        }
        println!("r {ratio}: {:.1e} of {scale:.2}", worst);
        assert!(worst < 1e-6 * scale, "r {ratio}: {worst:e} of {scale}");
    }
}

#[test]
fn a_mode_is_exact_for_straight_inputs_whatever_the_step() {
    let of = mode("leg", 1200.0, 0.03);
    for step in [1e-6, 2e-5, 1e-4, 1e-3] {
        let mut oscillator = Oscillator::new(&of);
        oscillator.set_step(step);
        let input = |n: u32| libm::sin(f64::from(n * n));
        let mut state = [0.0; 2];
        for n in 0..20 {
            let rate = (input(n + 1) - input(n)) / step;
            oscillator.advance([input(n), rate], [input(n + 1), rate]);
            state = runge_kutta(&of, state, |time| input(n) + rate * time, step, 2000);
        }
        assert!((oscillator.position - state[0]).abs() < 1e-9, "{step}: {} {state:?}", oscillator.position);
        assert!((oscillator.velocity - state[1]).abs() < 1e-9 * TAU * 1200.0, "{step}");
    }
}

#[test]
fn a_leg_mode_is_in_series_with_the_free_displacement() {
    let known = [mode("leg 3", 1200.0, 0.01), mode("leg", 900.0, 0.03)];
    let specimen = with_modes(known.to_vec());
    let mut plant = prepared_plant(&specimen);
    plant.step_whole_ticks(1e-4);
    // The displacements without load do not depend on the structure: Runge–Kutta and a structure of their own.
    let mut structure = Structure::new(specimen.structure(), 2e-5);
    let mut twin = prepared_plant(&with_modes(vec![]));
    let (mut states, mut free, mut worst) = ([[[0.0; 2]; 6]; 2], [0.0; 6], 0.0);
    let mut without = 0.0;
    let mut stiff = prepared_plant(&with_modes(vec![]));
    for n in 0..4000 {
        plant.hold(&jumps(n / 5), 2e-5);
        twin.hold(&jumps(n / 5), 2e-5);
        stiff.hold(&jumps(n / 5), 2e-5);
        let next = twin.free_displacements();
        let driven = std::array::from_fn(|leg| {
            let straight = |time: f64| free[leg] + (next[leg] - free[leg]) * time / 2e-5;
            // Both modes of leg 3 in one system of finer steps: the first drives the second.
            let parts = 50;
            let h = 2e-5 / f64::from(parts);
            let mut first = states[0][leg];
            let mut second = states[1][leg];
            for part in 0..parts {
                let from = f64::from(part) * h;
                let start = first;
                let mut output = (straight(from), straight(from + h));
                if leg == 2 {
                    first = runge_kutta(&known[0], first, |time| straight(from + time), h, 1);
                    output = (start[0], first[0]);
                }
                let along = |time: f64| output.0 + (output.1 - output.0) * time / h;
                second = runge_kutta(&known[1], second, along, h, 1);
            }
            (states[0][leg], states[1][leg]) = (first, second);
            second[0]
        });
        free = next;
        structure.advance(&driven);
        for k in 0..3 {
            worst = worse(worst, (plant.pose()[k] - structure.pose()[k]).abs());
            without = worse(without, (plant.pose()[k] - stiff.pose()[k]).abs());
        }
    }
    println!("leg modes: {:.2e} m from Runge–Kutta, {without:.1e} m from the plant without", worst);
    assert!(worst < 1e-6 * without && without > 1e-7, "{worst:e} of {without:e}");
}

#[test]
fn a_gauge_mode_adds_its_second_derivative_to_the_readings_in_long_steps_too() {
    for (at, share, lag) in [("gauge 2", 0.5, 0.0), ("frame", -0.1, 0.0), ("gauge", 0.5, 15e-6)] {
        let known = mode(at, 1200.0, 0.01);
        let fitted = |modes| {
            let mut specimen = with_modes(modes);
            specimen.legs.iter_mut().for_each(|leg| leg.gauge_lag_s = lag);
            prepared_rig(&specimen)
        };
        let (mut rig, mut plain) = (fitted(vec![known]), fitted(vec![]));
        rig.plant_mut().step_whole_ticks(1e-4);
        plain.plant_mut().set_longest_step(5e-6);
        let (mut states, mut before) = ([[0.0; 2]; 6], [0.0; 6]);
        let (mut worst, mut largest) = (0.0, 0.0);
        for n in 0..600 {
            rig.hold(&jumps(n), 1e-4);
            for _ in 0..20 {
                plain.hold(&jumps(n), 5e-6);
                let now = plain.read_gauges();
                for k in 0..6 {
                    let straight = |time: f64| before[k] + (now[k] - before[k]) * time / 5e-6;
                    states[k] = runge_kutta(&known, states[k], straight, 5e-6, 4);
                }
                before = now;
            }
            let found = rig.read_gauges();
            for k in 0..6 {
                let natural = TAU * 1200.0;
                let added = -share * (before[k] - states[k][0] - 2.0 * 0.01 / natural * states[k][1]);
                let expected = if at == "gauge 2" && k != 1 { 0.0 } else { added };
                worst = worse(worst, (found[k] - before[k] - expected).abs());
                largest = worse(largest, expected.abs());
            }
        }
        println!("{at}: {worst:.1e} m from Runge–Kutta, of {largest:.1e} m");
        assert!(largest > 5e-8 && worst < 3e-3 * largest, "{at}: {worst:e} of {largest:e}");
    }
}

#[test]
fn a_mode_without_participation_and_mains_without_amplitude_leave_the_bits() {
    let run = |specimen: &Specimen| {
        let mut rig = prepared_rig(specimen);
        rig.plant_mut().step_whole_ticks(1e-4);
        let readings: Vec<Six> = (0..300)
            .map(|n| {
                rig.hold(&jumps(n), 1e-4);
                rig.read_gauges()
            })
            .collect();
        (readings, rig.plant().pose())
    };
    let none = run(&with_modes(vec![]));
    let silent = StructuralMode { participation: Some(0.0), ..mode("gauge", 1200.0, 0.01) };
    let mains = Mains { amplitude_m: 0.0, frequency_hz: 50.0, gauge: None, phase_rad: 1.0 };
    let idle = Imperfections { modes: vec![silent], mains: vec![mains], ..Imperfections::default() };
    assert!(none == run(&specimen(idle)));
    assert!(none != run(&with_modes(vec![mode("gauge", 1200.0, 0.01)])));
}

#[test]
fn joints_add_what_it_takes_to_move_them_across_their_legs() {
    let share = 0.04;
    let stiff = specimen(Imperfections { joint_stiffness_share: share, ..Imperfections::default() }).structure();
    let free = specimen(Imperfections::default()).structure();
    let (with, without) = (stiff.stiffness_matrix(), free.stiffness_matrix());
    let quadratic = |matrix: &Matrix6, pose: &Six| {
        let force = apply(matrix, pose);
        (0..6).map(|k| pose[k] * force[k]).sum::<f64>()
    };
    for axis in 0..6 {
        let pose: Six = std::array::from_fn(|k| if k == axis { 1e-7 } else { 1e-8 * k as f64 });
        // Twice the energy, from the motion of the joints across their legs.
        let expected: f64 = (0..6)
            .map(|leg| {
                let (rest, moved) = (free.geometry.legs(&[0.0; 6])[leg].0, free.geometry.legs(&pose)[leg].0);
                let motion: Three = std::array::from_fn(|k| moved[k] - rest[k]);
                let length = libm::sqrt(rest.iter().map(|x| x * x).sum());
                let along = (0..3).map(|k| motion[k] * rest[k]).sum::<f64>() / length;
                let square = motion.iter().map(|x| x * x).sum::<f64>() - along * along;
                share * free.stiffness[leg] * square
            })
            .sum();
        let found = quadratic(&with, &pose) - quadratic(&without, &pose);
        assert!(expected > 0.0 && (found / expected - 1.0).abs() < 1e-5, "{axis}: {found} {expected}");
    }
    // A force bends it as that stiffness says; the weight's moments change it by 1e-5.
    assert!(stiff.modes().0[0] > 1.005 * free.modes().0[0], "{:?}", stiff.modes().0);
    let mut structure = Structure::new(stiff, 2e-5);
    structure.disturb(&Wrench { force: [10.0, 0.0, 0.0], torque: [0.0; 3] });
    (0..50_000).for_each(|_| structure.advance(&[0.0; 6]));
    let force = apply(&with, &structure.pose());
    assert!((force[0] / 10.0 - 1.0).abs() < 1e-4 && force[1].abs() < 1e-3, "{force:?}");
}

#[test]
fn a_cable_loses_the_area_of_its_loop_and_adds_its_stiffness() {
    let of = Cable { stiffness_n_per_m: [2e4, 0.0, 5e4], friction_n: [0.1, 0.0, 0.2] };
    let mut cable = CableForce::new(of);
    let amplitude = 20e-6;
    let mut lost = [0.0; 3];
    let (steps, mut before) = (20_000, [[0.0; 3]; 2]);
    // The second of two periods.
    for n in 1..=2 * steps {
        let place = [amplitude * libm::sin(TAU * f64::from(n) / f64::from(steps)); 3];
        cable.follow(&place);
        let force = cable.force();
        for k in 0..3 {
            if n > steps {
                lost[k] -= 0.5 * (force[k] + before[1][k]) * (place[k] - before[0][k]);
            }
        }
        before = [place, force];
    }
    for k in [0, 2] {
        let (stiffness, friction) = (of.stiffness_n_per_m[k], of.friction_n[k]);
        let expected = 4.0 * friction * (amplitude - friction / stiffness);
        assert!((lost[k] / expected - 1.0).abs() < 1e-4, "{k}: {} {expected}", lost[k]);
    }
    assert_eq!(lost[1], 0.0);
    // On the platform: a force meets the legs, the spring, and friction at its limit.
    let parameters = specimen(Imperfections::default()).structure();
    let stiffness = parameters.stiffness_matrix();
    let mut structure = Structure::new(parameters, 2e-5);
    structure.attach(of);
    structure.disturb(&Wrench { force: [100.0, 0.0, 0.0], torque: [0.0; 3] });
    (0..50_000).for_each(|_| structure.advance(&[0.0; 6]));
    let pose = structure.pose();
    let carried = apply(&stiffness, &pose)[0];
    // It rang before it came to rest: friction is anywhere within its limit.
    let left = 100.0 - carried - 2e4 * pose[0];
    assert!(left.abs() < 0.1 + 5e-3 && (100.0 - carried).abs() > 0.1, "{left} {carried} {pose:?}");
}

#[test]
fn mains_drift_and_jitter_are_in_the_readings_of_their_gauges() {
    let mains = Mains { amplitude_m: 5e-9, frequency_hz: 50.0, gauge: Some(2), phase_rad: 0.3 };
    let mut rig = prepared_rig(&specimen(Imperfections {
        mains: vec![mains],
        gauge_drift_m_per_s: [0.0, 0.0, 20e-9, 0.0, 0.0, 0.0],
        ..Imperfections::default()
    }));
    let mut plain = prepared_rig(&specimen(Imperfections::default()));
    let (mut sine, mut cosine, mut ticks) = (0.0, 0.0, 0.0);
    for n in 0..2000 {
        let (found, clean) = (rig.read_gauges(), plain.read_gauges());
        let time = f64::from(n) * 1e-4;
        let added: Six = std::array::from_fn(|k| found[k] - clean[k]);
        sine += added[1] * libm::sin(TAU * 50.0 * time);
        cosine += added[1] * libm::cos(TAU * 50.0 * time);
        ticks += 0.5;
        assert!((added[2] - 20e-9 * time).abs() < 1e-18, "{added:?}");
        assert!([0, 3, 4, 5].iter().all(|k| added[*k] == 0.0), "{added:?}");
        for rig in [&mut rig, &mut plain] {
            rig.hold(&[0.0; 6], 1e-4);
        }
    }
    let (sine, cosine) = (sine / ticks, cosine / ticks);
    assert!((libm::hypot(sine, cosine) / 5e-9 - 1.0).abs() < 1e-6);
    assert!((libm::atan2(cosine, sine) - 0.3).abs() < 1e-6);
}

/// A platform with jitter and gauges of this lag, s.
fn jittery(lag: f64) -> Specimen {
    let mut specimen = specimen(Imperfections { timing_jitter_s: 2e-6, ..Imperfections::default() });
    specimen.legs.iter_mut().for_each(|leg| leg.gauge_lag_s = lag);
    specimen
}

#[test]
fn jitter_of_readings_is_the_rate_of_the_gauges_times_the_same_time_for_all() {
    let rms = |values: &[f64]| libm::sqrt(values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64);
    for lag in [0.0, 3e-4] {
        let nominal = PlatformParameters::reference();
        let errors = || {
            let mut rig = prepared_rig(&jittery(lag));
            let (mut late, mut apart) = (Vec::new(), Vec::new());
            for n in 0..3000 {
                rig.hold(&jumps(n), 1e-4);
                let (pose, seen) = (rig.plant().pose(), rig.plant().seen());
                let found = rig.read_gauges();
                let rate = |k: usize| if lag > 0.0 { (pose[k] - seen[k]) / lag } else { rig.plant().rate()[k] };
                // The first gauge reads z at x = 80 mm, the second at another place.
                let times = [0, 1].map(|gauge| {
                    let probe = &nominal.probes[gauge];
                    let later = std::array::from_fn(|k| seen[k] + 1e-6 * rate(k));
                    let [now, then] = [&seen, &later].map(|pose| probe.reading(nominal.height_m, pose));
                    (found[gauge] - now) / ((then - now) / 1e-6)
                });
                let moves = (0..6).map(|k| rate(k).abs()).fold(0.0, worse) > 1e-3;
                late.extend(Some(times[0]).filter(|_| moves));
                apart.extend(Some(times[0] - times[1]).filter(|_| moves));
            }
            (late, apart)
        };
        let (late, apart) = errors();
        assert_eq!((&late, &apart), (&errors().0, &errors().1));
        assert!(late.len() > 1000 && (1.85e-6..2.15e-6).contains(&rms(&late)), "{lag} {:e} {}", rms(&late), late.len());
        assert!(rms(&apart) < 0.02 * rms(&late), "{lag} {:e}", rms(&apart));
    }
}

/// To first order, with the pulse that makes it up spread over an interval; the jumps are below the slew limit of an amplifier.
#[test]
fn jitter_of_voltages_shifts_their_changes() {
    const TICK: f64 = 1e-4;
    let mut rig = prepared_rig(&jittery(0.0));
    let mut times = Gaussian::new(2e-6, 5, 19);
    let lowest = PlatformParameters::reference().lowest_voltage_v;
    let (mut effect, mut error, mut before) = (0.0, 0.0, [20.0; 6]);
    for n in 0..800 {
        let after = [if n / 40 % 2 == 0 { 20.0 } else { 20.5 }; 6];
        let late = times.draw();
        let mut punctual = rig.plant().clone();
        let mut shifted = punctual.clone();
        rig.hold(&after, TICK);
        // A plant without jitter cannot change its voltages before the tick.
        if n % 40 == 0 && n > 0 && late > 0.0 {
            punctual.hold(&after.map(|volts| volts - lowest), TICK);
            shifted.hold(&before.map(|volts: f64| volts - lowest), late);
            shifted.hold(&after.map(|volts| volts - lowest), TICK - late);
            let mut jittered = rig.plant().clone();
            for _ in 0..20 {
                let along = [&punctual, &shifted, &jittered].map(|plant| plant.pose()[2]);
                effect += (along[0] - along[1]).abs();
                error += (along[2] - along[1]).abs();
                for plant in [&mut punctual, &mut shifted, &mut jittered] {
                    plant.hold(&after.map(|volts| volts - lowest), TICK);
                }
            }
        }
        before = after;
    }
    assert!(effect > 1e-8 && error < 0.3 * effect, "{effect:e} {error:e}");
}

#[test]
fn the_file_names_places_in_words_and_refuses_what_is_none() {
    let read = |inner: &str| {
        let text = REFERENCE_PLATFORM.replacen(
            "\"step_s\": 2e-5",
            &format!("\"step_s\": 2e-5, \"imperfections\": {{{inner}}}"),
            1,
        );
        PlatformParameters::from_json(&text, "platform.json").map_err(|error| error.to_string())
    };
    assert_eq!(read(""), Ok(PlatformParameters::reference()));
    let one = |at: &str| format!("\"modes\": [{{\"at\": \"{at}\", \"frequency_hz\": 1200, \"damping_ratio\": 0.01}}]");
    for at in ["leg", "leg 1", "leg 6", "gauge", "gauge 4", "frame"] {
        let good = read(&one(at)).unwrap();
        assert_eq!(good.imperfections.modes, [mode(at, 1200.0, 0.01)]);
        let again = serde_json::to_string(&good).unwrap();
        assert_eq!(PlatformParameters::from_json(&again, "again.json").unwrap().imperfections, good.imperfections);
    }
    for at in ["leg 7", "leg 0", "leg one", "frame 1", "base", "leg  1"] {
        let refusal = read(&one(at)).unwrap_err();
        assert!(refusal.contains("expected \"leg\", \"gauge\" (all six)"), "{at}: {refusal}");
    }
    for (inner, expected) in [
        (one("leg").replace("0.01", "0"), "`imperfections.modes[0].damping_ratio` is 0; expected a number > 0"),
        (one("leg").replace("0.01", "0.01, \"participation\": 0.5"), "a leg mode is in series: remove it"),
        ("\"joint_stiffness_share\": -1".into(), "`imperfections.joint_stiffness_share` is -1"),
        ("\"timing_jitter_s\": 1".into(), "`imperfections.timing_jitter_s` is 1"),
        ("\"mains\": [{\"amplitude_m\": 1e-9, \"frequency_hz\": 50, \"gauge\": 7}]".into(), "mains[0].gauge` is 7"),
        ("\"mode\": []".into(), "unknown field `mode`"),
    ] {
        let refusal = read(&inner).unwrap_err();
        assert!(refusal.contains(expected), "{inner}: {refusal}");
    }
}
