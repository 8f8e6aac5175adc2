//! Fig. 4 and Table 1: residual hysteresis with the inverse model.

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{Record, RunOptions};
use host_sim::scenario::{LINEARITY_FREQUENCIES, LegScenario, MODES, select};
use host_sim::table::Line;
use host_sim::trajectory::{PaperPath, PaperPose, Reading};
use specgen_runtime::{ControlMode, Platform};

use super::motion::REFUSED_PATH;
use crate::chart::{Axis, Chart, LINE, pairs};
use crate::hysteresis::moved_over_requested;
use crate::section::{Grid, Section};
use specgen_language::model::Actuator;
use specgen_studies::reproduce;
use specgen_studies::reproduce::write::digits;

/// Frequencies for a platform, Hz.
const PLATFORM_FREQUENCIES: [f64; 2] = [1.0, 10.0];
/// Largest number of points of a line on a chart.
const POINTS: usize = 500;

fn chart(title: &str) -> Chart {
    let x = Axis::linear("virtual voltage X = q̂/ρ̂", "V");
    Chart::new("linear", title, x, Axis::linear("displacement Y", "µm"))
}

/// Six legs with their own gauges.
///
/// # Errors
/// As [`LegScenario::run`].
pub fn of_legs(
    scenario: &LegScenario,
    controller: &mut dyn TickController,
    actuator: &Actuator,
    command: &str,
) -> Result<Section, RunError> {
    let table = reproduce::legs::table_1(scenario, controller, actuator.stack_gain * 1e6, actuator.stacks)?;
    let mut lines = chart("Fig. 4: leg 0 with the inverse model alone, last period");
    select(controller, MODES[0].1)?;
    for frequency in LINEARITY_FREQUENCIES {
        let tracking = scenario.run(controller, frequency)?.tracking;
        let start = tracking.samples.len().saturating_sub(reproduce::legs::SAMPLES as usize);
        let last = &tracking.samples[start..];
        let x: Vec<f64> = last.iter().map(|sample| sample.requested[0] / actuator.leg_gain()).collect();
        let y: Vec<f64> = last.iter().map(|sample| sample.measured[0] * 1e6).collect();
        lines = lines.with(&format!("{frequency} Hz"), LINE, pairs(&x, &y));
    }
    Ok(Section::new("linear", "Linear relation with the inverse model", command)
        .text("Y over X: a perfect inverse would give a straight line. Its slope divided by ρ̂ is the λ that the adaptation must tolerate.")
        .charts(vec![lines])
        .comparison(&table))
}

/// A platform: actual leg extensions in case 1 with F and the inverse model alone, over the requested ones.
///
/// # Errors
/// As [`PlatformScenario::run`].
pub fn of_platform(
    machine: &PlatformScenario,
    controller: &mut Controller,
    platform: &Platform<f64>,
    actuator: &Actuator,
    command: &str,
) -> Result<Section, RunError> {
    let mut traced = machine.clone();
    traced.options = RunOptions { record: Record::Trace, ..machine.options.clone() };
    let mut lines = chart("Fig. 4: legs 0 and 3 in case 1, F with the inverse model alone");
    let mut table = Grid::new(
        "Linear fit for each leg, Y = λ q̂ + δ",
        &["leg", "Hz", "λ = ρ/ρ̂", "δ, nm", "deviation from the line, nm rms"],
    );
    select(controller, ControlMode::WORDS[1].1)?;
    for frequency in PLATFORM_FREQUENCIES {
        let trajectory = PaperPose { path: PaperPath::Case1, reading: Reading::Corrected, frequency };
        let run = traced.run(controller, &trajectory)?;
        for (leg, points) in moved_over_requested(controller, platform, &run)?.into_iter().enumerate() {
            let Some(line) = Line::fit(&points) else { continue };
            let off: f64 = points.iter().map(|(x, y)| y - line.slope * x - line.offset).map(|e| e * e).sum();
            let rms = libm::sqrt(off / points.len() as f64) * 1e9;
            table.push(vec![
                leg.to_string(),
                format!("{frequency}"),
                digits(line.slope),
                digits(line.offset * 1e9),
                digits(rms),
            ]);
            if leg % 3 == 0 {
                let every = points.len().div_ceil(POINTS).max(1);
                let (x, y): (Vec<f64>, Vec<f64>) =
                    points.iter().step_by(every).map(|(x, y)| (x / actuator.leg_gain(), y * 1e6)).unzip();
                let name = format!("leg {leg}, {frequency} Hz");
                lines = lines.with(&name, LINE, pairs(&x, &y));
            }
        }
    }
    let section = Section::new("linear", "Linear relation with the inverse model", command);
    if lines.series.is_empty() {
        return Ok(section.text(&format!("Not available: case 1 was refused. {REFUSED_PATH}")));
    }
    Ok(section
        .text("Actual extension of a leg, J h of the true pose, over the request to the inverse model. The legs deviate individually within their tolerances and share one record if the spec has one; λ is the deviation. Table 1 of the paper is for six legs with their own gauges: specgen report specs/legs.toml.")
        .charts(vec![lines])
        .table(table))
}
