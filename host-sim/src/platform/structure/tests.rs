//! The structure against theory, and against a full non-linear integration of its own equations.

use core::f64::consts::TAU;

use super::*;
use crate::platform::linear::{inverse, transposed};
use crate::platform::{PlatformParameters, Specimen, worse};

fn parameters(damping_ratio: f64) -> StructureParameters {
    let mut nominal = PlatformParameters::reference();
    nominal.modal_damping = damping_ratio;
    Specimen::ideal(&nominal, &crate::plant::LegParameters::reference()).structure()
}

/// A platform that is not symmetric: legs and joints that differ, a centre of mass off P_C, products of inertia.
fn asymmetric() -> StructureParameters {
    let mut p = parameters(0.03);
    for leg in 0..6 {
        let shift = 0.01 * libm::sin(1.0 + 3.0 * leg as f64);
        p.geometry.platform_joints[leg][2] += shift;
        p.geometry.platform_joints[leg][0] -= 0.5 * shift;
        p.geometry.base_joints[leg][2] -= 0.7 * shift;
        p.stiffness[leg] *= 1.0 + 3.0 * shift;
    }
    p.masses.center = [0.004, -0.003, 0.012];
    p.masses.platform_inertia = [[0.031, 0.002, -0.001], [0.002, 0.035, 0.0015], [-0.001, 0.0015, 0.012]];
    p
}

/// Settles for a second.
fn at_rest(structure: &mut Structure) -> Six {
    (0..50_000).for_each(|_| structure.advance(&[0.0; 6]));
    assert!(structure.rate().iter().all(|rate| rate.abs() < 1e-12), "{:?}", structure.rate());
    structure.pose()
}

impl Structure {
    /// Energy of motion, of leg and contact springs, and of the weight on its leg forces at rest, J.
    fn energy(&self) -> f64 {
        let (pose, rate) = (self.pose(), self.rate());
        let momentum = apply(&self.mass, &rate);
        let extensions = self.parameters.geometry.extensions(&pose);
        let weight = apply(&self.beside, &pose);
        let mut twice = 0.0;
        for k in 0..6 {
            twice += pose[k] * weight[k];
            let stretch = self.displacement[k] - extensions[k];
            twice += rate[k] * momentum[k] + self.parameters.stiffness[k] * stretch * stretch;
        }
        0.5 * twice + self.contact.as_ref().map_or(0.0, |contact| contact.energy(&pose))
    }
}

#[test]
fn a_disturbance_is_carried_by_the_legs_and_gone_when_it_ends() {
    let parameters = asymmetric();
    let mut structure = Structure::new(parameters.clone(), 2e-5);
    let wrench = Wrench { force: [12.0, -7.0, 30.0], torque: [0.3, 0.2, -0.4] };
    structure.disturb(&wrench);
    let pose = at_rest(&mut structure);
    // Virtual work: what the legs do is what is put on, but for the moments of the weight.
    let carried = apply_transposed(&parameters.geometry.jacobian(&pose), &structure.leg_forces());
    let weight = apply(&parameters.weight_stiffness(), &pose);
    let put_on = wrench.generalised(&rate_matrix(angles(&pose)));
    for k in 0..6 {
        let left = carried[k] + put_on[k];
        assert!(left.abs() < 1e-6 + 2.0 * weight[k].abs(), "{k}: {left} of {put_on:?}");
    }
    let stiffness = sum(&parameters.stiffness_matrix(), &parameters.weight_stiffness());
    let expected = apply(&inverse(&stiffness), &wrench.numbers());
    for k in 0..6 {
        assert!((pose[k] / expected[k] - 1.0).abs() < 2e-3, "{k}: {pose:?}, {expected:?}");
    }
    structure.disturb(&Wrench::default());
    assert!(at_rest(&mut structure).iter().all(|x| x.abs() < 1e-15));
}

#[test]
fn a_disturbance_that_swings_is_second_order_in_the_step() {
    let after = |step: f64| {
        let mut structure = Structure::new(parameters(0.03), step);
        let ticks = (0.02 / 1e-4) as u32;
        for tick in 0..ticks {
            // Held for 100 µs, as a rig holds it.
            let swing = libm::sin(TAU * 150.0 * 1e-4 * f64::from(tick));
            structure.disturb(&Wrench { force: [0.0, 0.0, 50.0 * swing], torque: [2.0 * swing, 0.0, 0.0] });
            (0..(1e-4 / step + 0.5) as u32).for_each(|_| structure.advance(&[0.0; 6]));
        }
        structure.pose()
    };
    let [coarse, middle, fine] = [2e-5, 1e-5, 5e-6].map(after);
    for k in 2..4 {
        let ratio = (coarse[k] - middle[k]) / (middle[k] - fine[k]);
        assert!((3.0..5.2).contains(&ratio), "{k}: {ratio}");
    }
}

#[test]
fn modes_of_the_study_ring_at_their_frequencies() {
    let parameters = parameters(0.0);
    let (frequencies, shapes) = parameters.modes();
    let hertz = frequencies.map(|w| w / TAU);
    for (found, study) in hertz.iter().zip([361.0, 361.0, 428.0, 428.0, 615.0, 795.0]) {
        assert!((found - study).abs() < 1.0, "{hertz:?}");
    }
    // Ring-down from each shape, 20 µs steps: time of 200 rising zero crossings of the largest coordinate.
    for mode in 0..6 {
        let shape: Six = std::array::from_fn(|k| 1e-9 * shapes[k][mode]);
        let axis = (0..6).max_by(|a, b| shape[*a].abs().total_cmp(&shape[*b].abs())).unwrap();
        let mut structure = Structure::new(parameters.clone(), 2e-5);
        structure.set_state(&shape, &[0.0; 6], &[0.0; 6]);
        let mut crossings = Vec::new();
        let mut before = structure.pose()[axis];
        let mut time = 0.0;
        while crossings.len() < 201 {
            structure.advance(&[0.0; 6]);
            time += 2e-5;
            let now = structure.pose()[axis];
            if before < 0.0 && now >= 0.0 {
                crossings.push(time - 2e-5 * now / (now - before));
            }
            before = now;
        }
        let found = 200.0 / (crossings[200] - crossings[0]);
        assert!((found / hertz[mode] - 1.0).abs() < 2e-5, "mode {mode}: rings at {found} Hz, {} Hz", hertz[mode]);
    }
}

#[test]
fn damping_of_a_ring_down_is_that_of_the_modes() {
    // ζ_i = ζ_1 ω_i/ω_1 with c = β k.
    let parameters = parameters(0.02);
    let (frequencies, shapes) = parameters.modes();
    assert!((0.02 * frequencies[5] / frequencies[0] - 0.044).abs() < 5e-4);
    for mode in 0..6 {
        let zeta = 0.02 * frequencies[mode] / frequencies[0];
        let shape: Six = std::array::from_fn(|k| 1e-9 * shapes[k][mode]);
        let mut structure = Structure::new(parameters.clone(), 2e-5);
        structure.set_state(&shape, &[0.0; 6], &[0.0; 6]);
        let start = structure.energy();
        let steps = 1000;
        for _ in 0..steps {
            structure.advance(&[0.0; 6]);
        }
        let decay = libm::log(start / structure.energy()) / (2.0 * 2e-5 * f64::from(steps) * frequencies[mode]);
        assert!((decay / zeta - 1.0).abs() < 0.02, "mode {mode}: ζ {decay}, {zeta}");
    }
}

#[test]
fn energy_is_conserved_without_damping_to_second_order() {
    // Geometric non-linearity by extrapolation is what is not exact; large motion makes it visible.
    let drift = |step: f64| {
        let mut structure = Structure::new(parameters(0.0), step);
        structure.set_state(&[30e-6, -20e-6, 40e-6, 300e-6, 200e-6, -400e-6], &[0.0; 6], &[0.0; 6]);
        let start = structure.energy();
        let mut largest = 0.0;
        for _ in 0..(0.2 / step) as usize {
            structure.advance(&[0.0; 6]);
            largest = worse(largest, (structure.energy() / start - 1.0).abs());
        }
        largest
    };
    let (coarse, fine) = (drift(2e-5), drift(1e-5));
    println!("largest energy error over 200 ms: {coarse:.2e} at 20 µs, {fine:.2e} at 10 µs");
    assert!(coarse < 2e-6, "{coarse}");
    assert!(fine < coarse / 3.0, "{coarse} {fine}");
}

#[test]
fn a_static_load_bends_the_platform_as_the_stiffness_says() {
    // A part at P_C resists a demanded displacement: K (x_d − x) = K_c x.
    let parameters = parameters(0.5_f64.sqrt() * 0.5);
    let stiffness = parameters.stiffness_matrix();
    let diagonal = [0, 1, 2, 3, 4, 5].map(|k| stiffness[k][k]);
    for (found, study) in diagonal.iter().zip([1.01e7, 1.01e7, 3.97e7, 1.99e5, 1.99e5, 1.98e5]) {
        assert!((found / study - 1.0).abs() < 0.01, "{diagonal:?}");
    }
    let part = WorkPart { stiffness: [2e6, 3e6, 5e6], tip: [0.01, -0.02, 0.04] };
    let wanted = [2e-6, -1e-6, 3e-6, 20e-6, 10e-6, -15e-6];
    let demand = parameters.geometry.extensions(&wanted);
    let mut structure = Structure::new(parameters, 2e-5);
    structure.touch(part);
    for _ in 0..20_000 {
        structure.advance(&demand);
    }
    let both = sum(&stiffness, &part.stiffness_matrix(&[0.0; 6]));
    let expected = apply(&inverse(&both), &apply(&stiffness, &wanted));
    let pose = structure.pose();
    for k in 0..6 {
        assert!((pose[k] - expected[k]).abs() < 2e-4 * expected[k].abs() + 1e-10, "{pose:?} {expected:?}");
    }
    // The legs carry what the part pushes.
    let push = structure.contact().unwrap().wrench(&pose).generalised(&rate_matrix(angles(&pose)));
    let legs = apply_transposed(&structure.parameters().geometry.jacobian(&pose), &structure.leg_forces());
    for k in 0..6 {
        assert!((push[k] + legs[k]).abs() < 1e-3 + 1e-4 * push[k].abs(), "{push:?} {legs:?}");
    }
}

#[test]
fn contact_raises_the_modes_as_in_the_study() {
    // Glass: 381 … 828 Hz on legs of its own tolerances.
    let parameters = parameters(0.02);
    let stiff = sum(&parameters.stiffness_matrix(), &WorkPart::glass().stiffness_matrix(&[0.0; 6]));
    let (squares, _) = generalised_eigen(&stiff, &parameters.mass_matrix());
    let hertz = squares.map(|w| libm::sqrt(w) / TAU);
    assert!((hertz[0] - 381.0).abs() < 1.5 && (hertz[5] - 828.0).abs() < 5.0, "{hertz:?}");
}

/// Free displacements of a vigorous motion, m.
fn motion(time: f64) -> Six {
    std::array::from_fn(|leg| {
        let phase = TAU * (10.0 + 3.0 * leg as f64) * time;
        20e-6 * (1.0 - libm::cos(phase)) + 3e-9 * libm::sin(TAU * 390.0 * time)
    })
}

/// Pose at every multiple of 0.1 ms over 20 ms, with steps of `step`.
fn driven(parameters: &StructureParameters, step: f64, part: Option<WorkPart>) -> Vec<Six> {
    let mut structure = Structure::new(parameters.clone(), step);
    if let Some(part) = part {
        structure.touch(part);
    }
    let per_sample = (1e-4 / step).round() as usize;
    let mut out = Vec::new();
    for sample in 0..200 {
        for n in 1..=per_sample {
            structure.advance(&motion((sample * per_sample + n) as f64 * step));
        }
        out.push(structure.pose());
    }
    out
}

/// Largest difference in leg length, m.
fn distance(parameters: &StructureParameters, a: &[Six], b: &[Six]) -> f64 {
    assert!(!a.is_empty() && a.len() == b.len(), "{} and {} poses", a.len(), b.len());
    let mut largest = 0.0;
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (parameters.geometry.extensions(a), parameters.geometry.extensions(b));
        for leg in 0..6 {
            largest = worse(largest, (a[leg] - b[leg]).abs());
        }
    }
    largest
}

#[test]
fn halving_the_step_shows_second_order_and_picometres() {
    for (name, parameters, part) in [
        ("free", parameters(0.02), None),
        ("glass", parameters(0.02), Some(WorkPart::glass())),
        ("asymmetric, aluminium", asymmetric(), Some(WorkPart::aluminium())),
    ] {
        let finest = driven(&parameters, 2.5e-6, part);
        let [coarse, half] = [2e-5, 1e-5].map(|step| distance(&parameters, &driven(&parameters, step, part), &finest));
        println!("{name}: step error {:.4} pm at 20 µs, {:.4} pm at 10 µs", coarse * 1e12, half * 1e12);
        assert!(coarse < 3e-11, "{name}: {coarse}");
        let ratio = coarse / half;
        // (1 − 1/64)/(1/4 − 1/64) = 4.2 for second order against the 2.5 µs run.
        assert!((3.7..4.8).contains(&ratio), "{name}: {coarse} {half}");
    }
}

/// ḧ of the full equations: M(h) ḧ + C ḣ + G − (weight carried at rest) = Jᵀ f, with C ḣ from differences of M.
fn full_acceleration(p: &StructureParameters, carried: &Six, pose: &Six, rate: &Six, displacement: &Six) -> Six {
    let (extensions, jacobian) = p.geometry.extensions_and_jacobian(pose);
    let speeds = apply(&jacobian, rate);
    let force: Six = std::array::from_fn(|leg| {
        carried[leg] + p.stiffness[leg] * (displacement[leg] - extensions[leg]) - p.damping[leg] * speeds[leg]
    });
    let mut right = apply_transposed(&jacobian, &force);
    let weight = p.masses.weight(&p.geometry, pose);
    // C ḣ = Ṁ ḣ − ½ ∂(ḣᵀ M ḣ)/∂h.
    const STEP: f64 = 1e-5;
    let slopes: [Matrix6; 6] = std::array::from_fn(|k| {
        let (mut above, mut below) = (*pose, *pose);
        above[k] += STEP;
        below[k] -= STEP;
        let (above, below) = (p.masses.mass_matrix(&p.geometry, &above), p.masses.mass_matrix(&p.geometry, &below));
        std::array::from_fn(|i| std::array::from_fn(|j| (above[i][j] - below[i][j]) / (2.0 * STEP)))
    });
    for row in 0..6 {
        right[row] -= weight[row];
        for k in 0..6 {
            for j in 0..6 {
                right[row] -= slopes[k][row][j] * rate[k] * rate[j] - 0.5 * slopes[row][k][j] * rate[k] * rate[j];
            }
        }
    }
    apply(&inverse(&p.masses.mass_matrix(&p.geometry, pose)), &right)
}

#[test]
fn the_full_equations_differ_by_less_than_a_millionth_of_the_motion() {
    for (name, p) in [("reference", parameters(0.02)), ("asymmetric", asymmetric())] {
        let transposed = transposed(&p.geometry.jacobian(&[0.0; 6]));
        let carried = apply(&inverse(&transposed), &p.masses.weight(&p.geometry, &[0.0; 6]));
        let (mut pose, mut rate) = ([0.0; 6], [0.0; 6]);
        let step = 1e-5;
        let mut poses = Vec::new();
        for n in 0..2000 {
            let time = f64::from(n) * step;
            // Runge–Kutta of fourth order.
            let add = |a: &Six, b: &Six, factor: f64| -> Six { std::array::from_fn(|k| a[k] + factor * b[k]) };
            let slope = |pose: &Six, rate: &Six, time: f64| full_acceleration(&p, &carried, pose, rate, &motion(time));
            let (r1, a1) = (rate, slope(&pose, &rate, time));
            let r2 = add(&rate, &a1, 0.5 * step);
            let a2 = slope(&add(&pose, &r1, 0.5 * step), &r2, time + 0.5 * step);
            let r3 = add(&rate, &a2, 0.5 * step);
            let a3 = slope(&add(&pose, &r2, 0.5 * step), &r3, time + 0.5 * step);
            let r4 = add(&rate, &a3, step);
            let a4 = slope(&add(&pose, &r3, step), &r4, time + step);
            for k in 0..6 {
                pose[k] += step / 6.0 * (r1[k] + 2.0 * r2[k] + 2.0 * r3[k] + r4[k]);
                rate[k] += step / 6.0 * (a1[k] + 2.0 * a2[k] + 2.0 * a3[k] + a4[k]);
            }
            if (n + 1) % 10 == 0 {
                poses.push(pose);
            }
        }
        let difference = distance(&p, &driven(&p, 2e-5, None), &poses);
        println!("{name}: {:.3} pm from the full equations", difference * 1e12);
        assert!(difference < 1e-6 * 40e-6, "{name}: {difference}");
    }
}

#[test]
fn the_mass_matrix_is_that_of_the_reference_vectors() {
    let p = parameters(0.0);
    let home = p.mass_matrix();
    let expected = [1.528_789_584_066_469_4, 1.528_789_584_066_469_4, 1.592_844_100_498_644_4];
    for k in 0..3 {
        assert!((home[k][k] / expected[k] - 1.0).abs() < 1e-13, "{home:?}");
    }
    assert!((home[3][3] / 0.034_589_220_502_493_224 - 1.0).abs() < 1e-13);
    assert!((home[5][5] / 0.013_246_491_448_778_656 - 1.0).abs() < 1e-13);
    assert!((home[0][4] / -0.000_481_490_717_442_031_94 - 1.0).abs() < 1e-11);
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/oracle/dynamics-reference.json");
    let text = std::fs::read_to_string(path).unwrap();
    let vectors: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let mut checked = 0;
    for vector in vectors["vectors"].as_array().unwrap() {
        let mut pose: Six = std::array::from_fn(|k| number(&vector["h"][k]));
        pose[2] -= 0.18;
        let rate: Six = std::array::from_fn(|k| number(&vector["hd"][k]));
        let found = p.masses.mass_matrix(&p.geometry, &pose);
        let weight = p.masses.weight(&p.geometry, &pose);
        let jacobian = p.geometry.jacobian(&pose);
        for row in 0..6 {
            assert!((weight[row] - number(&vector["G"][row])).abs() < 1e-12 * 16.0, "G");
            for column in 0..6 {
                assert!((found[row][column] - number(&vector["M"][row][column])).abs() < 1e-12 * 1.6, "M");
                assert!((jacobian[row][column] - number(&vector["J"][row][column])).abs() < 1e-13, "J");
            }
        }
        // The full equations used above have the same Coriolis forces: M ḧ + C ḣ + G = Jᵀ f.
        let zero = p.geometry.extensions(&pose);
        let undamped = StructureParameters { damping: [0.0; 6], ..p.clone() };
        let acceleration = full_acceleration(&undamped, &[0.0; 6], &pose, &rate, &zero);
        let right = apply(&found, &acceleration);
        let scale = libm::sqrt(rate.iter().map(|x| x * x).sum::<f64>());
        for row in 0..6 {
            let coriolis = -right[row] - weight[row];
            assert!((coriolis - number(&vector["Cv"][row])).abs() < 1e-8 * scale * scale + 1e-12, "Cv");
        }
        checked += 1;
    }
    assert_eq!(checked, 26);
}

#[test]
fn a_step_that_changes_is_the_same_motion() {
    let p = parameters(0.02);
    let mut changing = Structure::new(p.clone(), 2e-5);
    let mut time = 0.0;
    for n in 0..400 {
        let step = if n % 3 == 0 { 2e-5 } else { 1e-5 };
        changing.set_step(step);
        time += step;
        changing.advance(&motion(time));
    }
    let mut steady = Structure::new(p.clone(), 5e-6);
    let steps = (time / 5e-6).round() as usize;
    for n in 1..=steps {
        steady.advance(&motion(n as f64 * 5e-6));
    }
    assert!(distance(&p, &[changing.pose()], &[steady.pose()]) < 2e-11);
}
