//! Compensation of the resonance of six legs (`actuator.resonance_gain`): the inverse of the mode on the demand, and nothing without
//! the key.

use core::f64::consts::TAU;
use host_sim::controller::TickController as _;
use specgen::ir::Ir;
use specgen::run_time;
use specgen_tests::compile_edited;

const PERIOD: f64 = 2e-4;
const RESONANCE: f64 = 870.0;
const DAMPING: f64 = 0.1;

fn compiled(name: &str, more: &str) -> Ir {
    let law = ("mode         = \"pcc\"", "mode = \"invhys\"");
    compile_edited(name, "features/leg-setpoint.toml", &[("damping_ratio   = 0.1", more), law], &[]).ir
}

/// Voltages of leg 0 for these set-points (m) of all legs, V.
fn voltages(ir: &Ir, setpoints: &[f64]) -> Vec<f64> {
    let mut controller = run_time::controller(ir).unwrap();
    let mut output = vec![0; controller.description().output_names.len()];
    let row = |setpoint: &f64| {
        let mut input = vec![0; controller.description().input_names.len()];
        input[..6].fill(setpoint.to_bits());
        controller.step(&input, &mut output);
        f64::from_bits(output[0])
    };
    setpoints.iter().map(row).collect()
}

#[test]
fn a_leg_without_the_key_has_no_lead_and_one_with_it_the_inverse_of_its_mode() {
    let plain = compiled("resonance-none", "damping_ratio = 0.1");
    assert_eq!(plain.hysteresis.lead, None);
    let share = 0.65;
    let bent = compiled("resonance-given", &format!("damping_ratio = 0.1\nresonance_gain = {share}"));
    let lead = bent.hysteresis.lead.as_ref().unwrap();
    let angle = TAU * RESONANCE * PERIOD;
    let resonance = lead.resonance.as_ref().unwrap();
    assert_eq!(lead.ticks, 0.0);
    assert!((resonance.lag / (2.0 * DAMPING / angle) - 1.0).abs() < 1e-12, "{lead:?}");
    assert!((resonance.bend * angle.powi(2) - 1.0).abs() < 1e-12, "{lead:?}");
    // The gain of a large loop is reached halfway.
    let grid = bent.hysteresis.grid;
    let travel = bent.hysteresis.tables[0][grid * (grid + 1) / 2];
    assert!((resonance.gain_growth * 0.5 * travel / (1.0 / share - 1.0) - 1.0).abs() < 1e-12, "{lead:?}");
    // 20 µm at 60 Hz behind a smooth start: q + k_s (2ζ/ω u̇ + ü/ω²) as the set-point of a leg without the key.
    let demand: Vec<f64> = (0..1000)
        .map(|n| {
            let t = f64::from(n) * PERIOD;
            let start = if t < 0.05 { t / 0.05 } else { 1.0 };
            20e-6 + 10e-6 * start.powi(3) * (TAU * 60.0 * t).sin()
        })
        .collect();
    let at = |n: usize, back: usize| if n < back { 0.0 } else { demand[n - back] };
    // k_s u of the reversal curve that the leg is on: its gain grows from a turn on.
    let (mut turn, mut driven) = (0.0, vec![0.0]);
    for n in 0..demand.len() {
        let change = at(n, 0) - at(n, 1);
        if (at(n, 1) - turn) * change < 0.0 {
            turn = at(n, 1);
        }
        driven.push(driven[n] + change / (1.0 + resonance.gain_growth * (demand[n] - turn).abs()));
    }
    let distorted: Vec<f64> = (0..demand.len())
        .map(|n| {
            let before = if n == 0 { 0.0 } else { driven[n - 1] };
            let (first, last) = (driven[n + 1] - driven[n], driven[n] - before);
            let addition = first * resonance.lag + (first - last) * resonance.bend;
            demand[n] + addition.clamp(-lead.limit, lead.limit)
        })
        .collect();
    let [compensated, by_hand, without] =
        [voltages(&bent, &demand), voltages(&plain, &distorted), voltages(&plain, &demand)];
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    println!("{} V of a step, {} V of compensation", apart(&compensated, &by_hand), apart(&compensated, &without));
    // A step of the converter, where rounding decides.
    assert!(apart(&compensated, &by_hand) <= 150.0 / 65535.0 * 1.001);
    assert!(apart(&compensated[10..], &without[10..]) > 0.05);
}
