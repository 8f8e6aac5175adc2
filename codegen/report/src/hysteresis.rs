//! Hysteresis of the legs: without compensation, with the inverse model, with feedback.

use core::f64::consts::TAU;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::plant::{LegParameters, LegPlant};
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{PlatformRun, Record, RunOptions};
use host_sim::platform::scenario::select;
use host_sim::table::Line;
use serde_json::{Value, json};
use specgen_identify::Report;
use specgen_language::model::Actuator;
use specgen_numerics::jacobian;
use specgen_runtime::{ControlMode, Platform};
use specgen_studies::reproduce::write::digits;

use super::chart::{Axis, BLUE, Chart, LINE, Note, pairs};
use super::section::{Grid, Part, Rows, Section};
use super::tracking::{AXES, TrackedPath, short};

/// Loop frequencies, Hz, the least important first.
const FREQUENCIES: [f64; 3] = [0.1, 10.0, 50.0];
/// Frequencies of the paper's figure, Hz.
const PAPER: [f64; 6] = [0.1, 1.0, 10.0, 20.0, 40.0, 50.0];
/// Voltage steps per period.
const SAMPLES: usize = 400;
/// Largest number of points of a curve.
const POINTS: usize = 400;

/// A leg with its inverse model on a path: request (V, virtual), residual (nm), and the fitted line.
struct InverseResidual {
    points: Vec<[f64; 2]>,
    line: Line,
    rms: f64,
}

/// Loops of each leg, the residual of the inverse model on the trajectory of the spec, and the error with feedback.
/// `lowest`: voltage at which legs rest, V.
///
/// # Errors
/// As [`PlatformScenario::run`].
#[allow(clippy::too_many_arguments)]
pub fn of_platform(
    machine: &PlatformScenario,
    controller: &mut Controller,
    platform: &Platform<f64>,
    actuator: &Actuator,
    legs: &[LegParameters; 6],
    records: &[Option<Report>],
    all: &[TrackedPath],
) -> Result<Section, RunError> {
    let own = all.iter().find(|one| one.own && one.run.is_some());
    let behind = match own {
        Some(own) => inverse_residuals(machine, controller, platform, actuator, own)?,
        None => Vec::new(),
    };
    let mut section = Section::new("hysteresis", "Hysteresis", "");
    for (k, leg) in legs.iter().enumerate() {
        let (loops, width) = loops(
            leg,
            actuator.voltage[0],
            &FREQUENCIES,
            &format!("loops-{k}"),
            &format!("Leg {k} without compensation, by rate"),
        );
        let record = records.get(if records.len() == 6 { k } else { 0 }).and_then(Option::as_ref);
        let mut steps = vec![("loop, no model", width * 1e3)];
        steps.extend(record.map(|record| ("record fit, whole record", record.fit_rms * 1e9)));
        let mut columns = vec![vec![Part::Chart(loops)]];
        if let (Some(one), Some(own)) = (behind.get(k), own) {
            steps.push(("inverse model, open loop", one.rms));
            columns.push(vec![Part::Chart(one.chart(k, own))]);
        }
        let mut last = None;
        if let Some(rms) = own.and_then(TrackedPath::rms) {
            let worst = (1..3).fold(0, |worst, axis| if rms[axis] > rms[worst] { axis } else { worst });
            steps.push(("with feedback, worst axis", rms[worst]));
            last = Some((AXES[worst], rms[worst]));
        }
        let behind_it = behind
            .get(k)
            .map_or_else(String::new, |one| format!(" is reduced to {} by the inverse model", length(one.rms)));
        let fed = last.map_or_else(String::new, |(axis, rms)| format!(" and {} of {axis} with feedback", length(rms)));
        columns.push(vec![Part::Rows(funnel(k, &steps))]);
        let lead = format!("The loop of {} at {} Hz{behind_it}{fed}.", length(width * 1e3), FREQUENCIES[2]);
        section = section.pane(&[&format!("leg {k}")], vec![Part::Lead(lead), Part::Columns(columns)]);
    }
    Ok(section)
}

/// The simulated loops of six equal legs with their own gauges.
pub fn of_legs(leg: &LegParameters, lowest: f64, records: &[Option<Report>]) -> Section {
    let (chart, width) = loops(leg, lowest, &FREQUENCIES, "loops-0", "A leg without compensation, by rate");
    let mut steps = vec![("loop, no model", width * 1e3)];
    steps.extend(records.iter().flatten().next().map(|record| ("record fit, whole record", record.fit_rms * 1e9)));
    Section::new("hysteresis", "Hysteresis", "")
        .lead(&format!("The loop is {} wide at {} Hz.", length(width * 1e3), FREQUENCIES[2]))
        .part(Part::Columns(vec![vec![Part::Chart(chart)], vec![Part::Rows(funnel(0, &steps))]]))
}

/// Fig. 3: loops at the paper's frequencies; `lowest` is the voltage at which the leg rests, V.
pub fn of_paper(leg: &LegParameters, lowest: f64) -> Section {
    let title = "Fig. 3: displacement over voltage, second period of a sine over the whole range";
    let (chart, _) = loops(leg, lowest, &PAPER, "paper-loops", title);
    Section::new("loops", "Rate-dependent hysteresis", "")
        .text("The simulated leg in open loop, with amplifier lag, play operators with rate-dependent thresholds, creep, asymmetry and resonance. It is outside the controller's model class: no Everett table can represent it. The loop becomes rounder and wider with the rate, as in the paper.")
        .charts(vec![chart])
}

/// A length in nm as text.
fn length(nm: f64) -> String {
    if nm >= 1e3 { format!("{}\u{2009}µm", short(nm * 1e-3)) } else { format!("{}\u{2009}nm", short(nm)) }
}

/// Chart of the loops, and the width of the fastest one, µm.
fn loops(leg: &LegParameters, lowest: f64, frequencies: &[f64], id: &str, title: &str) -> (Chart, f64) {
    let mut chart = Chart::new(id, title, Axis::linear("voltage", "V"), Axis::linear("displacement", "µm"));
    let mut widest = 0.0;
    for (k, frequency) in frequencies.iter().enumerate() {
        let (voltages, displacements) = sine(leg, *frequency);
        let travel = displacements[SAMPLES / 2] - displacements[0];
        widest = displacements[3 * SAMPLES / 4] - displacements[SAMPLES / 4];
        let voltages: Vec<f64> = voltages.iter().map(|v| v + lowest).collect();
        let name = format!("{frequency} Hz: travel {travel:.1} µm, width {:.1} %", 100.0 * widest / travel);
        // The fastest loop, which is the widest, is the darkest.
        let color = (frequencies.len() - 1 - k) * 3 / (frequencies.len() - 1).max(1);
        chart = chart.with(&name, LINE, pairs(&voltages, &displacements)).colored(color);
    }
    chart.keys = true;
    chart.height = 290;
    (chart, widest)
}

fn inverse_residuals(
    machine: &PlatformScenario,
    controller: &mut Controller,
    platform: &Platform<f64>,
    actuator: &Actuator,
    own: &TrackedPath,
) -> Result<Vec<InverseResidual>, RunError> {
    let mut traced = machine.clone();
    traced.options = RunOptions { record: Record::Trace, ..machine.options.clone() };
    select(controller, ControlMode::WORDS[1].1)?;
    let run = own.course.run(&traced, controller)?;
    let of = |points: Vec<(f64, f64)>| {
        let line = Line::fit(&points)?;
        let left: Vec<[f64; 2]> =
            points.iter().map(|(x, y)| [x / actuator.leg_gain(), (y - line.slope * x - line.offset) * 1e9]).collect();
        let rms = libm::sqrt(left.iter().map(|point| point[1] * point[1]).sum::<f64>() / left.len() as f64);
        let every = left.len().div_ceil(POINTS).max(1);
        Some(InverseResidual { points: left.into_iter().step_by(every).collect(), line, rms })
    };
    Ok(moved_over_requested(controller, platform, &run)?.into_iter().map_while(of).collect())
}

/// For each leg and tick, m: the request to its inverse model, and the actual extension J h from the true pose. `None` if the
/// controller refused the path, or no trace was kept.
pub(crate) fn moved_over_requested(
    controller: &Controller,
    platform: &Platform<f64>,
    run: &PlatformRun,
) -> Result<Vec<Vec<(f64, f64)>>, RunError> {
    let Some(trace) = run.trace.as_ref().filter(|_| run.is_followed()) else { return Ok(Vec::new()) };
    let description = controller.description();
    let (requested, words) = (description.outputs("requested")?, description.input_names.len());
    let before = trace.len().saturating_sub(run.samples.len());
    let of = |(row, place): ([f64; 6], usize)| {
        let both = trace.rows().skip(before).zip(&run.samples);
        both.map(|(words_of, sample)| {
            let moved = row.iter().zip(&sample.tick.pose).map(|(j, h)| j * h).sum();
            (description.scalar.decode(words_of[words + place]), moved)
        })
        .collect()
    };
    Ok(jacobian(platform, &[0.0; 6]).into_iter().zip(requested).map(of).collect())
}

impl InverseResidual {
    fn chart(&self, leg: usize, own: &TrackedPath) -> Chart {
        let (name, speed, slope) = (&own.name, own.speed(), digits(self.line.slope));
        let offset = short(self.line.offset * 1e9);
        let mut chart = Chart::new(
            &format!("behind-{leg}"),
            &format!("Residual of the inverse model: leg {leg}, {name}, {speed}; λ {slope}, δ {offset} nm"),
            Axis::linear("virtual voltage", "V"),
            Axis::linear("residual", "nm"),
        )
        .with("", LINE, self.points.clone())
        .colored(BLUE)
        .noted(Note::Band([-self.rms, self.rms], [format!("+rms {} nm", short(self.rms)), "−rms".to_owned()]));
        chart.height = 290;
        chart
    }
}

/// Chart from the loop to the final error, nm.
fn funnel(leg: usize, steps: &[(&str, f64)]) -> Rows {
    let mut numbers = Grid::new(&format!("From loop to error, leg {leg}"), &["stage", "nm"]);
    let positive = steps.iter().filter(|(_, nm)| *nm > 0.0);
    let (low, high) = positive.clone().fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), (_, nm)| {
        (if *nm < low { *nm } else { low }, if *nm > high { *nm } else { high })
    });
    let decade = |v: f64| libm::pow(10.0, v);
    let least = decade(libm::floor(libm::log10(low / 1.2)));
    let rows: Vec<Value> = positive
        .map(|(name, nm)| {
            numbers.push(vec![(*name).to_owned(), digits(*nm)]);
            json!({ "name": name, "line": [least, nm], "marks": [{ "m": "dot", "x": nm, "text": length(*nm) }] })
        })
        .collect();
    Rows {
        id: format!("funnel-{leg}"),
        title: "From loop to error, rms (loop: width)".to_owned(),
        data: json!({ "scale": "log", "range": [least, decade(libm::ceil(libm::log10(high)))], "unit": "nm", "rows": rows, "above": true, "step": 50, "right": 70,
            "label": "From loop to error" }),
        numbers,
    }
}

/// Voltages relative to rest (V) and displacements relative to the settled leg (µm) over the second period, including the start
/// of the third.
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
