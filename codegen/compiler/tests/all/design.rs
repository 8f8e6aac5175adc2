//! Tests of the design: its values, refusals and warnings.

use specgen_compiler::stability::platform::{Design, Tuning, describe, design};
use specgen_language::model::{Gains, Interaction, Model, TaskSpace};
use specgen_runtime::ControlMode;

use super::length;
use super::study::{model, rest};

fn designed(
    edit: impl Fn(&mut Model, &mut TaskSpace),
) -> Result<Design, Vec<specgen_language::diagnostic::Diagnostic>> {
    let (mut model, mut task) = model();
    // These tests are about the loops of the platform itself: structural modes far above them.
    model.structure.from = Some(1e7);
    model.actuator.resonance = 1e7;
    edit(&mut model, &mut task);
    design(&model, &task, &rest())
}

fn gains_of(tuning: &Tuning) -> Gains {
    Gains { proportional: tuning.proportional, integral: tuning.integral, derivative: tuning.derivative }
}

#[test]
#[ignore = "long: six designs; gains that are not robust are refused in the short run"]
fn the_start_rule_gives_robust_values_with_and_without_notch() {
    for notch in [Some(1.0), Some(0.5), None] {
        for rate in [2e3, 5e3, 1e4, 2e4] {
            for (model_damping, ratio) in [(0.01, [0.9, 1.1]), (0.02, [1.0, 1.0]), (0.05, [0.8, 1.2])] {
                let found = designed(|model, task| {
                    model.timing.period = 1.0 / rate;
                    model.adaptation.gain_ratio = ratio;
                    task.modal_damping = model_damping;
                    task.notch_damping = notch;
                })
                .unwrap();
                let what = format!("notch {notch:?}, {rate} Hz, ζ {model_damping}");
                assert_eq!(found.margins.len(), 7);
                for one in &found.margins {
                    assert!(one.spectral_radius < 1.0, "{what}: {one:?}");
                    assert!(one.gain_ratio_limit.is_none_or(|limit| limit > 2.0), "{what}: {one:?}");
                    assert!(one.delay_margin_ticks.is_none_or(|delay| delay > 1.0), "{what}: {one:?}");
                }
                let shrunk = found.combined.level_bandwidth / (found.bandwidth_limit / 4.5);
                assert!((0.3..=1.0).contains(&shrunk), "{what}: {shrunk}");
            }
        }
    }
}

#[test]
fn given_values_are_checked_and_not_changed() {
    let rule = designed(|_, _| ()).unwrap();
    let given = designed(|_, task| {
        task.gains = Some(gains_of(&rule.combined.scaled(0.5, 1.0)));
        task.position_gains = Some(gains_of(&rule.position.scaled(0.7, 1.0)));
        task.adaptation = Some([300.0, 10.0]);
    })
    .unwrap();
    assert_eq!(given.combined.integral, rule.combined.scaled(0.5, 1.0).integral);
    assert_eq!(given.position.proportional, rule.position.scaled(0.7, 1.0).proportional);
    assert_eq!([given.combined.level_bandwidth, given.combined.drift_bandwidth], [300.0, 10.0]);
    // Only the gains given: the bandwidths follow the rule, and the other way round.
    let mixed = designed(|_, task| task.adaptation = Some([300.0, 10.0])).unwrap();
    assert_eq!(mixed.combined.integral, rule.combined.integral);
    let mixed = designed(|_, task| task.gains = Some(gains_of(&rule.combined.scaled(0.5, 1.0)))).unwrap();
    assert_eq!(mixed.combined.level_bandwidth, rule.combined.level_bandwidth);
}

/// The factor in "… × F is stable" or "F times the given value".
fn offered(help: &str) -> f64 {
    let number = |text: &str| text.trim().split(' ').next().unwrap().parse().unwrap();
    help.split_once('×').map_or_else(|| number(help.split_once("is stable, ").unwrap().1), |(_, after)| number(after))
}

#[test]
fn unstable_numbers_are_refused_at_their_key_and_what_is_offered_is_accepted() {
    let rule = designed(|_, _| ()).unwrap();
    for &factor in length(&[30.0][..], &[8.0, 30.0, 300.0]) {
        // Bandwidths.
        let with = |scale: f64| {
            designed(|_, task| {
                task.adaptation = Some([scale * rule.combined.level_bandwidth, scale * rule.combined.drift_bandwidth]);
            })
        };
        let found = with(factor).unwrap_err();
        assert_eq!((found.len(), found[0].code), (1, "E0421"), "{found:#?}");
        assert!(found[0].key.starts_with("adaptation.level_"), "{}", found[0].key);
        let accepted = offered(&found[0].help) * factor;
        assert!(with(accepted).is_ok(), "× {accepted}: {}", found[0].help);
        assert!(with(1.07 * accepted).is_err(), "the suggestion is near the largest: {accepted}");
        // Gains of P/F.
        let with = |scale: f64| designed(|_, task| task.gains = Some(gains_of(&rule.combined.scaled(scale, 1.0))));
        let found = with(5.0 * factor).unwrap_err();
        assert_eq!((found.len(), found[0].code, found[0].key.as_str()), (1, "E0421", "gains.integral"), "{found:#?}");
        assert!(found[0].message.contains("P/F"), "{}", found[0].message);
        let accepted = offered(&found[0].help) * 5.0 * factor;
        assert!(with(accepted).is_ok(), "× {accepted}: {}", found[0].help);
        // Gains of P alone.
        let with =
            |scale: f64| designed(|_, task| task.position_gains = Some(gains_of(&rule.position.scaled(scale, 1.0))));
        let found = with(factor).unwrap_err();
        assert_eq!((found.len(), found[0].code, found[0].key.as_str()), (1, "E0421", "position_gains.integral"));
        assert!(found[0].message.contains("control mode P is"), "{}", found[0].message);
        let accepted = offered(&found[0].help) * factor;
        assert!(with(accepted).is_ok() && with(1.07 * accepted).is_err(), "× {accepted}: {}", found[0].help);
    }
    // All three together: a spec with all suggested values is accepted.
    let with = |scale: [f64; 3]| {
        designed(|_, task| {
            task.adaptation =
                Some([scale[0] * rule.combined.level_bandwidth, scale[0] * rule.combined.drift_bandwidth]);
            task.gains = Some(gains_of(&rule.combined.scaled(scale[1], 1.0)));
            task.position_gains = Some(gains_of(&rule.position.scaled(scale[2], 1.0)));
        })
    };
    let given = [12.0, 90.0, 7.0];
    let found = with(given).unwrap_err();
    assert_eq!(found.len(), 3, "{found:#?}");
    let accepted: Vec<f64> = found.iter().zip(given).map(|(one, scale)| offered(&one.help) * scale).collect();
    with([accepted[0], accepted[1], accepted[2]]).unwrap();
}

#[test]
fn bandwidths_given_as_numbers_in_the_help_are_accepted() {
    let found = designed(|_, task| task.adaptation = Some([9000.0, 400.0])).unwrap_err();
    let quoted: Vec<f64> = found[0]
        .help
        .split('"')
        .filter_map(|text| text.strip_suffix(" rad/s"))
        .map(|number| number.parse().unwrap())
        .collect();
    assert_eq!(quoted.len(), 2, "{}", found[0].help);
    designed(|_, task| task.adaptation = Some([quoted[0], quoted[1]])).unwrap();
}

#[test]
fn thin_margins_and_modes_beyond_the_notch_are_pointed_out() {
    let rule = designed(|_, _| ()).unwrap();
    let thin = designed(|_, task| task.position_gains = Some(gains_of(&rule.position.scaled(2.2, 1.0)))).unwrap();
    assert_eq!(thin.findings.len(), 1, "{:#?}", thin.findings);
    assert_eq!((thin.findings[0].code, thin.findings[0].key.as_str()), ("W0423", "position_gains.integral"));
    assert!(rule.findings.is_empty());
    let slow = designed(|model, _| model.timing.period = 1.0 / 1500.0).unwrap();
    assert!(
        slow.findings.iter().any(|one| one.code == "W0424" && one.message.contains("795 Hz")),
        "{:#?}",
        slow.findings
    );
}

#[test]
fn a_measured_force_on_a_stiff_work_piece_is_judged_as_the_loop_it_closes() {
    let on = |stiffness: f64, interaction: Interaction| {
        designed(|_, task| {
            task.environment.stiffness = [stiffness, stiffness, stiffness, 0.0, 0.0, 0.0];
            task.interaction = interaction;
        })
    };
    on(3e6, Interaction::Measured).unwrap();
    on(3e6, Interaction::Modelled).unwrap();
    let found = on(3e9, Interaction::Measured).unwrap_err();
    assert_eq!((found.len(), found[0].code), (1, "E0421"), "{found:#?}");
    let factor: f64 = found[0].help.split("up to ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    on(3e9 * factor, Interaction::Measured).map_err(|found| format!("{found:#?}")).unwrap();
}

#[test]
fn a_platform_without_six_modes_is_refused() {
    let (model, task) = model();
    let mut flat = rest();
    flat.jacobian[3] = flat.jacobian[2];
    let found = design(&model, &task, &flat).unwrap_err();
    assert_eq!(found[0].code, "E0420");
    let mut light = rest();
    light.mass[4][4] = -1.0;
    assert_eq!(design(&model, &task, &light).unwrap_err()[0].code, "E0420");
    light.mass[4][4] = f64::NAN;
    assert_eq!(design(&model, &task, &light).unwrap_err()[0].code, "E0420");
}

#[test]
fn the_design_is_the_same_every_time_and_does_not_depend_on_the_numbering_of_legs() {
    let (model, task) = model();
    let one = design(&model, &task, &rest()).unwrap();
    assert_eq!(
        serde_json::to_string(&one).unwrap(),
        serde_json::to_string(&design(&model, &task, &rest()).unwrap()).unwrap()
    );
    let mut permuted = rest();
    permuted.jacobian = [3, 0, 5, 1, 4, 2].map(|leg: usize| rest().jacobian[leg]);
    let other = design(&model, &task, &permuted).unwrap();
    for (a, b) in one.modes.iter().zip(&other.modes) {
        assert!((a.frequency - b.frequency).abs() < 1e-9 * a.frequency);
        for (x, y) in a.shape.iter().zip(&b.shape) {
            assert!((x - y).abs() < 1e-9, "{:?} {:?}", a.shape, b.shape);
        }
    }
    assert!((one.bandwidth_limit - other.bandwidth_limit).abs() < 1e-9 * one.bandwidth_limit);
}

#[test]
fn the_report_names_every_mode() {
    let text = describe(&designed(|_, _| ()).unwrap());
    for law in ControlMode::all() {
        assert!(text.lines().any(|line| line.trim_start().starts_with(&law.to_string())), "{text}");
    }
    assert!(text.contains("360.5, 360.5, 428.1, 428.1, 614.9, 794.9 Hz"), "{text}");
}
