//! Fig. 3: hysteresis loops of a leg at several rates.

use core::f64::consts::TAU;

use host_sim::plant::{LegParameters, LegPlant, Plant};

use super::chart::{Axis, Chart, LINE, pairs};
use super::section::{Grid, Section};
use specgen_studies::reproduce::write::digits;

const FREQUENCIES: [f64; 6] = [0.1, 1.0, 10.0, 20.0, 40.0, 50.0];
/// Held voltages in a period.
const SAMPLES: usize = 400;

/// Loops of the simulated leg of the spec; `lowest` is the voltage at which it rests, V.
#[must_use]
pub fn section(leg: &LegParameters, lowest: f64) -> Section {
    let mut chart = Chart::new(
        "loops",
        "Fig. 3: displacement over voltage, second period of a sine over the whole range",
        Axis::linear("voltage", "V"),
        Axis::linear("displacement", "µm"),
    );
    let mut table = Grid::new("Loops", &["rate, Hz", "travel, µm", "width at half voltage, %"]);
    for frequency in FREQUENCIES {
        let (voltages, displacements) = sine(leg, frequency);
        let travel = displacements[SAMPLES / 2] - displacements[0];
        let width = (displacements[3 * SAMPLES / 4] - displacements[SAMPLES / 4]) / travel;
        table.push(vec![format!("{frequency}"), digits(travel), digits(100.0 * width)]);
        let voltages: Vec<f64> = voltages.iter().map(|v| v + lowest).collect();
        chart = chart.with(&format!("{frequency} Hz"), LINE, pairs(&voltages, &displacements));
    }
    Section::new("hysteresis", "Rate-dependent hysteresis", "")
        .text("The simulated leg, open loop: amplifier lag, plays with rate-dependent thresholds, creep, asymmetry, resonance. It is not of the controller's model class: no Everett table can hold it. The loop becomes rounder and wider with the rate, as in the paper.")
        .charts(vec![chart])
        .table(table)
}

/// Voltages from rest (V) and displacements from the settled leg (µm) over the second period, the start of the third
/// included.
fn sine(leg: &LegParameters, frequency: f64) -> (Vec<f64>, Vec<f64>) {
    let mut plant = LegPlant::new(leg);
    let sweep = leg.u_max / leg.forc_rate_v_per_s;
    plant.ramp(0.0, leg.u_max, sweep, leg.step_s);
    plant.ramp(leg.u_max, 0.0, sweep, leg.step_s);
    if leg.settle_s > 0.0 {
        plant.hold(0.0, leg.settle_s);
    }
    let rest = plant.displacement();
    let interval = 1.0 / (frequency * SAMPLES as f64);
    let (mut voltages, mut displacements) = (Vec::new(), Vec::new());
    for k in 0..=2 * SAMPLES {
        let voltage = 0.5 * leg.u_max * (1.0 - libm::cos(TAU * k as f64 / SAMPLES as f64));
        let displacement = plant.hold(voltage, interval) - rest;
        if k >= SAMPLES {
            voltages.push(voltage);
            displacements.push(displacement * 1e6);
        }
    }
    (voltages, displacements)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_widen_with_the_rate() {
        let leg = LegParameters::reference();
        let width = |frequency| {
            let (_, y) = sine(&leg, frequency);
            (y[3 * SAMPLES / 4] - y[SAMPLES / 4]) / (y[SAMPLES / 2] - y[0])
        };
        let (slow, fast) = (width(0.1), width(50.0));
        assert!((0.08..0.16).contains(&slow) && fast > slow + 0.02, "{slow} {fast}");
    }
}
