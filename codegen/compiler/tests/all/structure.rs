//! Structural modes: the closed form of the border against eigenvalues of the sampled loop with the mode, designs, and refusals.

use std::f64::consts::TAU;

use specgen_compiler::stability::platform::{
    Border, ClosedLoop, Conditions, Design, StructuralChannel, Tuning, closed_loop_of, design,
};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{Model, StructuralKind, StructuralMode, TaskSpace};
use specgen_numerics::nyquist::Flexure;
use specgen_runtime::{ControlMode, Law};

use super::study::{model, rest};
use super::{COMBINED, length};

fn designed(edit: impl Fn(&mut Model, &mut TaskSpace)) -> Result<(Design, ClosedLoop), Vec<Diagnostic>> {
    let (mut model, mut task) = model();
    task.notch_damping = Some(1.0);
    edit(&mut model, &mut task);
    let found = design(&model, &task, &rest())?;
    let closed_loop = found.closed_loop(&model, &task, &rest()).unwrap();
    Ok((found, closed_loop))
}

/// Every corner at which a loop must tolerate a mode: the loop with its lag, and the conditions.
fn corners(closed_loop: &ClosedLoop) -> Vec<(ClosedLoop, Conditions)> {
    let mut all = vec![(closed_loop.clone(), Conditions::NOMINAL)];
    for stiffness in [0.9, 1.1] {
        for lag in [0.7, 1.3] {
            for delay in [0.0, 1.0] {
                for gain_ratio in [0.9, 1.1] {
                    let with_lag = ClosedLoop { lag: lag * closed_loop.lag, ..closed_loop.clone() };
                    all.push((with_lag, Conditions { stiffness, damping: 0.7, delay, gain_ratio, touching: false }));
                }
            }
        }
    }
    all
}

fn with(closed_loop: &ClosedLoop, flexure: Flexure, hertz: f64, damping_ratio: f64) -> ClosedLoop {
    let mut with = closed_loop.clone();
    with.structure.push(StructuralChannel { flexure, frequency: TAU * hertz, damping_ratio, place: None });
    with
}

/// Whether the loop with the mode is stable at every corner, by the eigenvalues of one tick.
fn tolerates(
    closed_loop: &ClosedLoop,
    law: ControlMode,
    tuning: &Tuning,
    flexure: Flexure,
    hertz: f64,
    damping: f64,
) -> bool {
    corners(closed_loop)
        .iter()
        .all(|(of, conditions)| with(of, flexure, hertz, damping).spectral_radius(law, tuning, conditions) <= 1.0)
}

const KINDS: [Flexure; 3] = [Flexure::Series, Flexure::Sensor(0.5), Flexure::Sensor(-0.1)];

/// The largest ζ that a mode within the interval of a border needs, by bisection with eigenvalues.
fn needed(closed_loop: &ClosedLoop, tuning: &Tuning, flexure: Flexure, [low, high]: [f64; 2]) -> f64 {
    let at = |share: f64| low * (high / low).powf(share);
    let one = |hertz: f64| {
        let (mut unstable, mut stable) = (0.0, 1.0);
        if tolerates(closed_loop, COMBINED, tuning, flexure, hertz, 1e-5) {
            return 0.0;
        }
        for _ in 0..10 {
            let middle = if unstable == 0.0 { 0.1 * stable } else { f64::sqrt(unstable * stable) };
            if tolerates(closed_loop, COMBINED, tuning, flexure, hertz, middle) {
                stable = middle
            } else {
                unstable = middle
            }
        }
        stable
    };
    length(&[0.1, 0.5, 0.9][..], &[0.02, 0.2, 0.4, 0.6, 0.8, 0.98])
        .iter()
        .map(|share| one(at(*share)))
        .fold(0.0, f64::max)
}

/// Theorem: a loop L with a mode is on the border of stability where 1 + L·factor = 0.
#[test]
fn the_border_in_closed_form_is_that_of_the_eigenvalues() {
    let (found, closed_loop) = designed(|_, _| ()).unwrap();
    let margins = found.margins.iter().find(|one| one.law == COMBINED).unwrap();
    for (flexure, kind, bins) in
        [(KINDS[0], "leg", [10, 11]), (KINDS[1], "gauge", [9, 11]), (KINDS[2], "frame", [12, 15])]
    {
        let border: &Border = margins.borders.iter().find(|border| border.kind == kind).unwrap();
        for bin in bins.into_iter().take(length(1, 2)) {
            let [low, high] = [bin, bin + 1].map(|bin| border.frequencies[bin]);
            let (predicted, real) =
                (border.damping_ratios[bin], needed(&closed_loop, &found.combined, flexure, [low, high]));
            println!("{kind} {low:.0} to {high:.0} Hz: ζ {predicted:.4}, by eigenvalues {real:.4}");
            assert!(predicted > 2e-3, "{kind}: nothing to compare at {low} Hz");
            // Few frequencies are tried within the interval, so the largest of them may be smaller.
            assert!(real < 1.2 * predicted && real > 0.6 * predicted, "{kind} {low}: {predicted} {real}");
        }
    }
}

/// An interval of a border is within the declared range or outside of it.
#[test]
fn the_largest_damping_of_the_borders_is_what_the_declared_range_needs() {
    let (found, _) = designed(|_, _| ()).unwrap();
    for margins in &found.margins {
        let worst = margins.borders.iter().filter_map(|border| border.worst(found.structure_from));
        let most = worst.map(|[_, ratio]| ratio).fold(0.0, f64::max);
        assert_eq!(most, margins.structure_damping, "{}", margins.law);
        assert!(most <= 0.01, "{}", margins.law);
    }
}

/// A design with active damping is stable with every mode of the range, at every corner, by eigenvalues.
#[test]
fn a_design_tolerates_every_mode_of_its_range() {
    for from in length(&[900.0][..], &[600.0, 900.0, 1200.0]) {
        let (found, closed_loop) = designed(|model, task| {
            model.structure.from = Some(*from);
            task.active_damping = true;
        })
        .unwrap();
        assert!(found.searched);
        for law in [COMBINED, ControlMode::F(Law::Pcc), ControlMode::PF(Law::Invhys)] {
            for flexure in KINDS {
                for share in length(&[1.0, 1.2][..], &[1.0, 1.05, 1.1, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0]) {
                    let hertz = from * share;
                    let tolerated = tolerates(&closed_loop, law, found.tuning(law), flexure, hertz, 0.01);
                    assert!(tolerated, "f0 {from}: {law} with {flexure:?} at {hertz} Hz");
                }
            }
        }
        // Stored, it is the same law, without a search.
        let (again, _) = designed(|model, task| {
            model.structure.from = Some(*from);
            task.active_damping = true;
            task.design.clone_from(&found.stored);
        })
        .unwrap();
        assert!(!again.searched);
        assert_eq!((&again.combined, &again.notch, &again.damping), (&found.combined, &found.notch, &found.damping));
        // Of another spec, it is not used.
        let (other, _) = designed(|model, task| {
            model.structure.from = Some(from + 1.0);
            task.design.clone_from(&found.stored);
        })
        .unwrap();
        assert!(other.findings.iter().any(|finding| finding.code == codes::DESIGN_STALE));
    }
}

#[test]
fn gains_that_do_not_tolerate_the_range_are_refused_and_what_is_offered_is_accepted() {
    let (rule, _) = designed(|_, _| ()).unwrap();
    let strong = |factor: f64, from: f64| {
        designed(|model, task| {
            let tuning = rule.combined.scaled(factor, 1.0);
            model.structure.from = Some(from);
            task.gains = Some(specgen_language::model::Gains {
                proportional: tuning.proportional,
                integral: tuning.integral,
                derivative: tuning.derivative,
            });
        })
    };
    let refused = strong(1.3, 620.0).unwrap_err();
    let found = refused.iter().find(|finding| finding.code == codes::STRUCTURE_UNSTABLE).unwrap();
    let offered: f64 = found.help.split_once("× ").unwrap().1.split(' ').next().unwrap().parse().unwrap();
    assert!(strong(1.3 * offered, 620.0).is_ok(), "{}", found.help);
    assert!(strong(1.3, 1500.0).is_ok());
    let low = designed(|model, _| model.structure.from = Some(500.0)).unwrap_err();
    assert_eq!(low[0].code, codes::STRUCTURE_TOO_LOW);
    let offered: f64 = low[0].help.split('"').nth(1).unwrap().trim_end_matches(" Hz").parse().unwrap();
    assert!(designed(|model, _| model.structure.from = Some(offered)).is_ok(), "{}", low[0].help);
}

/// A mode that is known is part of the plant: of all legs, or of one, with the same effect as its six oscillators in parallel.
#[test]
fn known_modes_of_six_legs_one_by_one_are_one_mode_of_all_legs() {
    let (mut model, task) = model();
    let mode = |place| StructuralMode {
        kind: StructuralKind::Leg,
        place,
        frequency: 700.0,
        damping_ratio: 0.05,
        participation: 1.0,
    };
    let tuning = {
        let found = design(&model, &task, &rest()).unwrap();
        // So strong that the modes decide.
        found.combined.scaled(3.4, 3.4)
    };
    let mut radius = |modes: Vec<StructuralMode>| {
        model.structural_modes = modes;
        closed_loop_of(&model, &task, &rest()).unwrap().spectral_radius(COMBINED, &tuning, &Conditions::NOMINAL)
    };
    let [none, all, each] = [vec![], vec![mode(None)], (0..6).map(|leg| mode(Some(leg))).collect()].map(&mut radius);
    // Coupled by rounding, multiple eigenvalues are less exact.
    assert!((all - each).abs() < 1e-2 * (all - none).abs(), "{none} {all} {each}");
    let one = radius(vec![mode(Some(2))]);
    assert!((one - none).abs() > 1e-6 && (one - all).abs() > 1e-5, "{none} {one} {all}");
}
