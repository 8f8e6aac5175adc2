//! Dynamic error budget: the contribution of each source to the error during motion.
//!
//! Every run follows the same path from the same state. The reference run has no noise and the finest drive converter: it shows the
//! hysteresis left by model and adaptation, creep, and the corners of the path. A run with
//! one source, minus the reference run, gives the contribution of the source. The converter is part of the controller, so the fine one
//! needs another controller, emitted from the spec with `dac.bits = 24`. With the coarse one in every run, noise would shift the codes
//! and every source would include converter steps.

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::Specimen;
use host_sim::platform::rig::{Noise, PlatformRun, Record, RunOptions};
use host_sim::scenario::{LegScenario, MODES, select};
use serde_json::{Value, json};

use super::chart::{Axis, Chart, DASHED, INK, LINE, pairs};
use super::margins::adapting_name;
use super::section::{Grid, Part, Rows, Section};
use super::spectrum::cumulative;
use super::tracking::{AXES, LEGS, TrackedPath, mode_of};
use super::verdict::capital;
use specgen_language::model::{Model, TaskSpace};
use specgen_studies::machine;
use specgen_studies::reproduce;
use specgen_studies::reproduce::write::digits;

/// Operating frequency of the path of six legs, Hz.
const FREQUENCY: f64 = 1.0;

/// Each source and the noise parameters for it alone.
fn sources(all: &NoiseParameters) -> [(&'static str, NoiseParameters); 3] {
    let none = NoiseParameters::NONE;
    [
        ("gauge noise", NoiseParameters { sensor_nm_rms: all.sensor_nm_rms, ..none }),
        ("ADC steps", NoiseParameters { adc_lsb_nm: all.adc_lsb_nm, ..none }),
        ("amplifier noise", NoiseParameters { amplifier_mv_rms: all.amplifier_mv_rms, ..none }),
    ]
}

/// The emitted controller, and one with a drive converter of [`FINE_BITS`].
pub struct Pair<'a> {
    /// The controller of the spec.
    pub own: &'a mut Controller,
    /// The controller of the spec with a fine converter.
    pub fine: &'a mut Controller,
}

/// Bits of the fine converter, the largest number that a spec may have.
pub const FINE_BITS: i64 = 24;

/// Errors by coordinate, then by tick, m and rad.
type Errors = Vec<Vec<f64>>;

/// A source and its contribution.
struct ErrorSource {
    name: &'static str,
    errors: Errors,
}

/// The budget for the first trajectory of the spec in `all`, at each of its speeds, in the control mode of the spec.
///
/// # Errors
/// As [`host_sim::platform::PlatformScenario::run`].
pub fn of_platform(
    model: &Model,
    task: &TaskSpace,
    specimen: &Specimen,
    controllers: Pair,
    seed: u64,
    all: &[TrackedPath],
) -> Result<Section, RunError> {
    let Pair { own, fine } = controllers;
    let mode = mode_of(own);
    select(own, mode)?;
    select(fine, mode)?;
    let Some(first) = all.iter().find(|one| one.run.is_some()) else {
        return Ok(empty().lead("Not available: no trajectory of the spec was run."));
    };
    let speeds: Vec<&TrackedPath> = all.iter().filter(|one| one.name == first.name && one.run.is_some()).collect();
    let errors = |run: &PlatformRun| -> Errors {
        (0..6).map(|axis| run.samples.iter().map(|s| s.target[axis] - s.tick.pose[axis]).collect()).collect()
    };
    // One machine per noise setting: preparing it takes longer than a run.
    let run = |controller: &mut dyn TickController, noise: &Noise| -> Result<Vec<Errors>, RunError> {
        let mut scenario = machine::scenario(model, task, specimen, noise, seed);
        scenario.options = RunOptions { record: Record::Samples, ..scenario.options };
        let of = |speed: &&TrackedPath| {
            let run = speed.course.run(&scenario, controller)?;
            run.scored()?;
            Ok(errors(&run))
        };
        speeds.iter().map(of).collect()
    };
    let all_noise = Noise::of(specimen);
    let alone = |channels| Noise { channels, ..Noise::NONE };
    let silent = run(own, &Noise::NONE)?;
    let quiet = run(fine, &Noise::NONE)?;
    let mut added = Vec::new();
    for (name, channels) in sources(&all_noise.channels) {
        added.push((name, run(fine, &alone(channels))?));
    }
    let mut section = empty();
    for (k, speed) in speeds.iter().enumerate() {
        let sources = added.iter().map(|(name, runs)| (*name, runs[k].clone())).collect();
        let found = contributions(&quiet[k], sources, silent[k].clone());
        let together = speed.run.as_ref().map(&errors).unwrap_or_default();
        let what = format!("{} at {}", speed.name, speed.speed());
        let coverage = speed.coverage().unwrap_or_default();
        let parts = parts((&what, coverage), k, &AXES, &found, &together, model.timing.period);
        section = section.pane(&[&what], parts);
    }
    Ok(section)
}

/// The budget of six legs on the paper's trajectory at 1 Hz with PCC, or the best law with weights in the spec.
///
/// # Errors
/// As [`LegScenario::run`].
pub fn of_legs(leg: &LegParameters, mode: usize, controllers: Pair, seed: u64) -> Result<Section, RunError> {
    let Pair { own, fine } = controllers;
    let (name, word) = MODES[mode];
    select(own, word)?;
    select(fine, word)?;
    let legs = std::array::from_fn(|_| leg.clone());
    let (mut interval, mut coverage) = (0.0, Coverage::default());
    let mut run = |controller: &mut dyn TickController, noise: &NoiseParameters| -> Result<Errors, RunError> {
        let scenario = LegScenario::new(&legs, noise, seed, reproduce::legs::SAMPLES);
        let tracking = scenario.run(controller, FREQUENCY)?.tracking;
        interval = tracking.interval;
        coverage = tracking.coverage();
        let of = |leg: usize| tracking.samples.iter().map(|s| s.target[leg] - s.measured[leg]).collect();
        Ok((0..6).map(of).collect())
    };
    let silent = run(own, &NoiseParameters::NONE)?;
    let quiet = run(fine, &NoiseParameters::NONE)?;
    let mut added = Vec::new();
    for (source, noise) in sources(&leg.noise) {
        added.push((source, run(fine, &noise)?));
    }
    let found = contributions(&quiet, added, silent);
    let together = run(own, &leg.noise)?;
    let what = format!("the leg trajectory at 1 Hz with {}", adapting_name(name));
    let mut section = empty();
    section.parts = parts((&what, coverage), 0, &LEGS, &found, &together, interval);
    Ok(section.text("Errors are gauge readings and include gauge noise."))
}

/// The residual without noise and the contribution of each source. The last is the drive converter, from the run `silent`
/// without noise and with the spec's converter.
fn contributions(quiet: &Errors, sources: Vec<(&'static str, Errors)>, silent: Errors) -> Vec<ErrorSource> {
    let less = |(name, mut errors): (&'static str, Errors)| {
        for (one, quiet) in errors.iter_mut().flatten().zip(quiet.iter().flatten()) {
            *one -= quiet;
        }
        ErrorSource { name, errors }
    };
    let residual = ErrorSource { name: "hysteresis residual", errors: quiet.clone() };
    core::iter::once(residual).chain(sources.into_iter().chain([("DAC steps", silent)]).map(less)).collect()
}

fn rms(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64) * 1e9
}

fn empty() -> Section {
    Section::new("error-budget", "Error budget", "")
}

/// How to reduce a source.
fn advice(source: &str) -> &'static str {
    match source {
        "amplifier noise" => "A quieter amplifier helps most.",
        "gauge noise" => "A quieter gauge helps most.",
        "ADC steps" => "A higher gauge resolution helps most.",
        "DAC steps" => "A larger dac.bits helps most.",
        _ => "A smoother path, a record of each leg, or a higher gain helps most.",
    }
}

/// Bars in both units, and the cumulative spectrum of the first coordinates together, for the trajectory `what` and its measured
/// part.
fn parts(
    (what, coverage): (&str, Coverage),
    number: usize,
    names: &[&str; 6],
    added: &[ErrorSource],
    together: &Errors,
    interval: f64,
) -> Vec<Part> {
    let legs = names[0] == LEGS[0];
    let mut values: Vec<(&str, [f64; 6])> =
        added.iter().map(|one| (one.name, core::array::from_fn(|axis| rms(&one.errors[axis])))).collect();
    let all: [f64; 6] = core::array::from_fn(|axis| rms(&together[axis]));
    // As shares of the total, so that nanometres and nanoradians count equally.
    let weight = |values: &[f64; 6]| values.iter().zip(&all).map(|(v, whole)| v * v / (whole * whole)).sum::<f64>();
    values.sort_by(|a, b| weight(&b.1).total_cmp(&weight(&a.1)));

    let head: Vec<String> = names
        .iter()
        .enumerate()
        .map(|(axis, name)| format!("{name}, {}", if legs || axis < 3 { "nm" } else { "nrad" }))
        .collect();
    let head: Vec<&str> = core::iter::once("source, rms").chain(head.iter().map(String::as_str)).collect();
    let mut table = Grid::new(&format!("Error budget: {what}, over {coverage}"), &head);
    let row = |name: &str, values: &[f64; 6]| [vec![name.to_owned()], values.map(digits).to_vec()].concat();
    for (name, values) in &values {
        table.push(row(name, values));
    }
    let squares = core::array::from_fn(|axis| values.iter().map(|(_, v)| v[axis] * v[axis]).sum::<f64>());
    table.push(row("root sum of squares", &squares.map(libm::sqrt)));
    table.push(row("simulated, all sources", &all));

    let bars = |axes: core::ops::Range<usize>, unit: &str| {
        let largest = axes
            .clone()
            .map(|axis| {
                let end = libm::sqrt(squares[axis]);
                if all[axis] > end { all[axis] } else { end }
            })
            .fold(0.0, |a: f64, b| if b > a { b } else { a });
        let rows: Vec<Value> =
            axes.clone().map(|axis| bar(names[axis], axis, &values, all[axis], squares[axis], unit)).collect();
        let end = 1.35 * largest;
        Rows {
            id: format!("budget-{number}-{unit}"),
            title: format!("{what}, {unit} rms"),
            data: json!({ "scale": "square", "range": [0.0, end], "unit": format!("{unit} rms"), "ticks": squared(end), "rows": rows, "left": 46, "step": 44,
                "right": 90, "label": format!("Error budget of {what}") }),
            numbers: if axes.start == 0 {
                table.clone()
            } else {
                Grid::new(&format!("Error budget in {unit}: included in the table in nm"), &[])
            },
        }
    };
    let swatches: Vec<String> = values
        .iter()
        .enumerate()
        .map(|(k, (name, _))| {
            format!("<span><i style=\"display:inline-block;width:10px;height:10px;background:var(--s{})\"></i> {name}</span>", 1 + if k < 3 { k } else { 3 })
        })
        .collect();
    let columns = if legs {
        vec![Part::Columns(vec![
            vec![Part::Rows(bars(0..3, "nm"))],
            vec![Part::Rows(Rows { id: "budget-0-nm-b".to_owned(), ..bars(3..6, "nm") })],
        ])]
    } else {
        vec![Part::Columns(vec![vec![Part::Rows(bars(0..3, "nm"))], vec![Part::Rows(bars(3..6, "nrad"))]])]
    };
    let mut chart = Chart::new(
        &format!("spectrum-{number}"),
        &format!("Cumulative error spectrum, {} together: {what}", if legs { "six legs" } else { "x, y and z" }),
        Axis::log("frequency", "Hz"),
        Axis::linear("error", "nm rms"),
    );
    let whole = ErrorSource { name: "all sources", errors: together.clone() };
    let ordered = values.iter().filter_map(|(name, _)| added.iter().find(|one| one.name == *name));
    for (k, one) in ordered.chain([&whole]).enumerate() {
        let signals: Vec<&[f64]> = one.errors[..if legs { 6 } else { 3 }].iter().map(Vec::as_slice).collect();
        let (frequencies, roots) = cumulative(&signals, interval);
        let roots: Vec<f64> = roots.iter().map(|root| root * 1e9).collect();
        let (style, color) = if one.name == whole.name { (DASHED, INK) } else { (LINE, if k < 3 { k } else { 3 }) };
        chart = chart.with(one.name, style, pairs(&frequencies, &roots)).colored(color);
    }
    chart.height = 240;
    let first = values.first().map_or("", |one| one.0);
    let lead = format!("{} contributes most to the error of {what}. {}", capital(first), advice(first));
    [
        vec![Part::Lead(lead), Part::Html(format!("<p class=\"legend\">{}</p>\n", swatches.join("")))],
        columns,
        vec![
            Part::Text("The scale is squared, so independent sources add along the bar. The black line is the run with all sources; if it is off the end of the bar, the sources are not independent. The hysteresis residual is the error without noise and with a 24-bit drive converter: hysteresis and creep not compensated by model and adaptation, and the corners of the path.".to_owned()),
            Part::Chart(chart),
        ],
    ]
    .concat()
}

fn bar(name: &str, axis: usize, values: &[(&str, [f64; 6])], all: f64, square: f64, unit: &str) -> Value {
    let mut sum = 0.0;
    let mut parts = Vec::new();
    for (k, (_, of)) in values.iter().enumerate() {
        let from = libm::sqrt(sum);
        sum += of[axis] * of[axis];
        let share = 100.0 * of[axis] * of[axis] / square;
        parts.push(json!({ "from": from, "to": libm::sqrt(sum), "shade": if k < 3 { k } else { 3 }, "text": format!("{share:.0}\u{2009}%") }));
    }
    json!({ "name": name, "parts": parts, "total": { "x": all, "text": format!("{} {unit}", digits(all)) } })
}

/// Four or five round ticks on a squared axis up to `end`.
fn squared(end: f64) -> Vec<f64> {
    let decade = libm::pow(10.0, libm::floor(libm::log10(end)));
    let step =
        [0.2, 0.25, 0.5, 1.0, 2.0].iter().map(|k| k * decade).find(|step| end / step <= 5.0).unwrap_or(2.0 * decade);
    (0..=5).map(|k| f64::from(k) * step).filter(|v| *v <= end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_its_contribution_to_the_run_without_noise() {
        let quiet = 3.0;
        let of = |value: f64| vec![vec![value; 4]; 6];
        let found = contributions(&of(quiet), vec![("gauge noise", of(quiet + 2.0))], of(3.5));
        assert_eq!((found[0].name, found[0].errors[0][0]), ("hysteresis residual", 3.0));
        assert_eq!((found[1].name, found[1].errors[5][3]), ("gauge noise", 2.0));
        assert_eq!((found[2].name, found[2].errors[0][1]), ("DAC steps", 0.5));
    }

    #[test]
    fn each_source_has_only_its_own_noise() {
        let all = NoiseParameters { sensor_nm_rms: 1.0, adc_lsb_nm: 2.0, dac_lsb_mv: 0.0, amplifier_mv_rms: 3.0 };
        let mut sum = [0.0; 3];
        for (name, noise) in sources(&all) {
            let each = [noise.sensor_nm_rms, noise.adc_lsb_nm, noise.amplifier_mv_rms];
            assert_eq!(each.iter().filter(|v| **v > 0.0).count(), 1, "{name}");
            sum = std::array::from_fn(|k| sum[k] + each[k]);
        }
        assert_eq!(sum, [1.0, 2.0, 3.0], "each once");
    }
}
