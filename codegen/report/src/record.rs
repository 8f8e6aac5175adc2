//! Page of a run of a real machine, compared with a simulation of the same commands.

use host_sim::coverage::Coverage;
use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_language::model::Model;
use specgen_studies::reproduce::write::digits;

use super::chart::{Axis, BLUE, Chart, INK, LINE, Mark, Note, pairs};
use super::margins;
use super::page::marked;
use super::section::{Grid, Multiples, Part, Rows, Section};
use super::spectrum::density;
use super::tracking::{AXES, LEGS, error_groups, norm, round_up, short};
use super::verdict::{Sentence, card, text_row, thin, value_row};
use core::f64::consts::TAU;
use specgen_runtime::ControlMode;
use specgen_toolchain::budget::group;

const GAUGES: [&str; 6] = ["gauge 0", "gauge 1", "gauge 2", "gauge 3", "gauge 4", "gauge 5"];
/// Largest number of points of a loop.
const POINTS: usize = 500;
const RECORDED: &str = "recorded";
const SIMULATED: &str = "simulated";

/// A tick, as seen by a controller.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// Number of the recorded tick.
    pub tick: u64,
    /// Whether the law was active.
    pub running: bool,
    /// Whether its error counts: the law was active, and the tick is comparable.
    pub scored: bool,
    /// Readings of the gauges, m.
    pub gauge: [f64; 6],
    /// Target, m and rad; for legs, m.
    pub target: [f64; 6],
    /// The measured value of the target quantity.
    pub measured: [f64; 6],
    /// Displacement of each leg by the gauges, m.
    pub leg: [f64; 6],
    /// Voltages, V.
    pub voltage: [f64; 6],
    /// Event bit of a late or skipped tick.
    pub late: bool,
    /// Whether a leg was at a limit of stroke, voltage or slew rate.
    pub limited: bool,
}

/// A recorded run.
#[derive(Debug, Clone)]
pub struct Run {
    /// In chronological order.
    pub recorded: Vec<Sample>,
    /// The same ticks with a simulated machine, or why there are none.
    pub simulated: Result<Vec<Sample>, String>,
    /// Control mode, as the value of the word `mode`.
    pub mode: u32,
    /// Number of ticks that replay with identical bits, or where they differ.
    pub bits: Result<u64, String>,
    /// Missing ticks: the first, and the one after the last.
    pub gaps: Vec<(u64, u64)>,
    /// Damaged blocks, as text.
    pub damaged: Vec<String>,
    /// Phase changes: tick and text.
    pub phases: Vec<(u64, String)>,
    /// Number of faults among them.
    pub faults: usize,
}

impl Run {
    fn late(&self) -> Vec<u64> {
        self.recorded.iter().filter(|sample| sample.late).map(|sample| sample.tick).collect()
    }

    fn simulated(&self) -> &[Sample] {
        self.simulated.as_deref().unwrap_or_default()
    }
}

/// First screen and sections of the page of a run.
pub fn page(compiled: &Compilation, run: &Run) -> (Vec<Part>, Vec<Section>) {
    let model = &compiled.model;
    let sections =
        vec![errors(model, run), spectra(compiled, run), noise(model, run), loops(model, run), timing(model, run)];
    (first(compiled, run), sections)
}

fn rms(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for sample in samples.iter().filter(|sample| sample.scored) {
        let value = of(sample);
        sum += value * value;
        count += 1;
    }
    libm::sqrt(sum / count.max(1) as f64)
}

/// Text of an error (nm rms) and the measured time: the scored share of all recorded ticks.
fn error_text(run: &Run, nano: f64, period: f64) -> String {
    let scored = run.recorded.iter().filter(|sample| sample.scored).count();
    if scored == 0 {
        return "unknown: no tick is scored".to_owned();
    }
    let coverage = Coverage::new(scored, run.recorded.len(), period);
    format!("{}\u{2009}nm rms by the gauges over {}", short(nano), coverage.brief())
}

/// Rms error of each coordinate over the scored ticks, nm and nrad.
fn error_rms(samples: &[Sample]) -> [f64; 6] {
    core::array::from_fn(|k| rms(samples, |sample| (sample.target[k] - sample.measured[k]) * 1e9))
}

/// White noise of a gauge, nm, from the second difference, which motion hardly affects.
fn white(samples: &[Sample], gauge: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for window in samples.windows(3) {
        if window[2].tick != window[0].tick + 2 || !window[0].running {
            continue;
        }
        let second = window[2].gauge[gauge] - 2.0 * window[1].gauge[gauge] + window[0].gauge[gauge];
        sum += second * second;
        count += 1;
    }
    libm::sqrt(sum / (6.0 * count.max(1) as f64)) * 1e9
}

fn first(compiled: &Compilation, run: &Run) -> Vec<Part> {
    let model = &compiled.model;
    let late = run.late();
    let missing: u64 = run.gaps.iter().map(|(from, to)| to - from).sum();
    let seconds = run.recorded.len() as f64 * model.timing.period;
    let (found, simulated) = (error_rms(&run.recorded), error_rms(run.simulated()));
    let platform = model.task_space.is_some();
    let length = |errors: &[f64; 6]| {
        if platform { norm(errors, false) } else { libm::sqrt(errors.iter().map(|v| v * v).sum::<f64>() / 6.0) }
    };
    let (verdict, mark) = if run.bits.is_err() {
        ("Replaying the record gives different bits", "error")
    } else if run.faults > 0 {
        ("The machine faulted in this run", "error")
    } else if !late.is_empty() || missing > 0 || !run.damaged.is_empty() {
        ("The run is incomplete", "warning")
    } else {
        ("The run is complete", "ok")
    };
    let against = match &run.simulated {
        Ok(_) => format!("; the simulation of the same commands gives {}\u{2009}nm", short(length(&simulated))),
        Err(why) => format!("; no simulation for comparison: {why}"),
    };
    let sentence = Sentence {
        verdict: verdict.to_owned(),
        why: format!(
            "{}\u{2009}s recorded. Error {}{against}.",
            short(seconds),
            error_text(run, length(&found), model.timing.period)
        ),
        mark,
    };
    let names = if model.task_space.is_some() { AXES } else { LEGS };
    let mut content = String::new();
    for k in 0..6 {
        let unit = if model.task_space.is_some() && k >= 3 { "nrad" } else { "nm" };
        content += &if run.simulated.is_ok() && simulated[k] > 0.0 {
            value_row(names[k], [&short(found[k]), &short(simulated[k]), unit], found[k] / simulated[k], "none")
        } else {
            text_row(names[k], &format!("{} {unit}", short(found[k])), "none")
        };
    }
    let errors = card("Error, rms", "recorded / simulated", "", &content);
    let mut content = String::new();
    let declared = model.sensor.noise * 1e9;
    for (k, name) in GAUGES.iter().enumerate() {
        let value = white(&run.recorded, k);
        // Gauge noise above the spec's invalidates the noise figures of the report.
        let sign = if value > 1.5 * declared { "warning" } else { "ok" };
        content += &value_row(name, [&short(value), &short(declared), "nm"], value / declared, sign);
    }
    let gauges = card("Noise of the gauges, rms", "recorded / spec", "", &content);
    let count = |number: u64| thin(&group(number));
    let mut content = String::new();
    let limited = run.recorded.iter().filter(|sample| sample.limited).count() as u64;
    for (label, text, good) in [
        ("late ticks", count(late.len() as u64), late.is_empty()),
        ("missing", format!("{} ticks in {} gaps", count(missing), run.gaps.len()), missing == 0),
        ("damaged", format!("{} blocks", run.damaged.len()), run.damaged.is_empty()),
        ("at a limit", format!("{} ticks with a leg at a limit", count(limited)), limited == 0),
    ] {
        content += &text_row(label, &text, if good { "ok" } else { "warning" });
    }
    content += &text_row("faults", &run.faults.to_string(), if run.faults == 0 { "ok" } else { "error" });
    content += &match &run.bits {
        Ok(ticks) => text_row("bits", &format!("identical over {} ticks", count(*ticks)), "ok"),
        Err(why) => text_row("bits", why, "error"),
    };
    let whole = card("Completeness of the run", "", "", &content);
    vec![Part::Html(format!(
        "{}<div class=\"first\">\n{errors}{gauges}{whole}</div>\n",
        sentence.html(&compiled.findings).replacen("<h1>", &format!("<h1 title=\"{}\">", marked(&model.name)), 1)
    ))]
}

/// Adds a line over time, interrupted at gaps.
fn over_time(
    chart: Chart,
    name: &str,
    mark: Mark,
    period: f64,
    samples: &[Sample],
    of: impl Fn(&Sample) -> f64,
) -> Chart {
    let stretches = samples.chunk_by(|a, b| b.tick == a.tick + 1).map(|stretch| {
        let start = stretch.first().map_or(0, |sample| sample.tick) as f64 * period;
        (start, stretch.iter().map(&of).collect())
    });
    chart.in_stretches(name, mark, period, stretches.collect())
}

fn errors(model: &Model, run: &Run) -> Section {
    let platform = model.task_space.is_some();
    let (names, lengths) = if platform { (AXES, 3) } else { (LEGS, 6) };
    let (found, simulated) = (error_rms(&run.recorded), error_rms(run.simulated()));
    let period = model.timing.period;
    let mut peaks = [0.0; 6];
    let items = (0..6)
        .map(|k| {
            let unit = if k < lengths { "nm" } else { "nrad" };
            let name = names[k];
            let error =
                |sample: &Sample| if sample.running { (sample.target[k] - sample.measured[k]) * 1e9 } else { 0.0 };
            peaks[k] = run.recorded.iter().map(|s| error(s).abs()).fold(0.0, |peak, v| if v > peak { v } else { peak });
            let chart = Chart::new(
                &format!("record-error-{k}"),
                &format!("Measured error of {name} while the law is active"),
                Axis::linear("time", "s"),
                Axis::linear(&format!("error of {name}"), unit),
            );
            let mut chart = over_time(chart, RECORDED, LINE, period, &run.recorded, error).colored(BLUE);
            if run.simulated.is_ok() {
                chart = over_time(chart, SIMULATED, LINE, period, run.simulated(), error).colored(INK);
            }
            let path = Chart::new(
                &format!("record-path-{k}"),
                &format!("{name}: path above, error below"),
                Axis::linear("time", "s"),
                Axis::linear(name, if k < lengths { "µm" } else { "µrad" }),
            );
            let path =
                over_time(path, "measured", Mark::Line(3.0), period, &run.recorded, |s| s.measured[k] * 1e6).colored(2);
            let mut path =
                over_time(path, "target", Mark::Dashed(1.6), period, &run.recorded, |s| s.target[k] * 1e6).colored(INK);
            chart.short = format!("{name} {} {unit}", short(found[k]));
            chart.height = 240;
            path.height = 130;
            path.bare = true;
            vec![path, chart]
        })
        .collect();
    let range = |axes: core::ops::Range<usize>| {
        let largest = round_up(peaks[axes].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a }));
        Some([-largest, largest])
    };
    let groups = error_groups(platform, range);
    let worst = (1..lengths).fold(0, |worst, k| if found[k] > found[worst] { k } else { worst });
    let against = if run.simulated.is_ok() {
        format!(", the simulation {}\u{2009}nm", short(simulated[worst]))
    } else {
        String::new()
    };
    let left_out = run.recorded.iter().filter(|sample| sample.running && !sample.scored).count();
    let section = Section::new("errors", "Errors", "").lead(&format!(
        "{} has {}{against}.",
        names[worst],
        error_text(run, found[worst], period)
    ));
    let section = if left_out == 0 {
        section
    } else {
        section.text(&format!(
            "{} s of the record are drawn but not scored. Where it starts in the middle of a run, or continues after a gap, the \
             controller starts from its snapshot, and the simulated machine was brought to the voltages of the first tick with its gauges \
             set to the readings of that tick, since a record contains neither the history of the machine nor its creep and speed. They are \
             compared once the simulated machine has settled, while the law is active in both.",
            short(left_out as f64 * period)
        ))
    };
    section.part(Part::Multiples(Multiples { id: "record-errors".to_owned(), items, groups, selected: worst }))
}

fn spectra(compiled: &Compilation, run: &Run) -> Section {
    let model = &compiled.model;
    let (names, lengths) = if model.task_space.is_some() { (AXES, 3) } else { (LEGS, 6) };
    let law = ControlMode::from_word(u64::from(run.mode)).map_or_else(String::new, margins::name);
    let modes: Vec<f64> =
        compiled.design.iter().flat_map(|design| design.modes.iter().map(|mode| mode.frequency / TAU)).collect();
    let charts = (0..6)
        .map(|k| {
            let unit = if k < lengths { "nm/√Hz" } else { "nrad/√Hz" };
            let mut chart = Chart::new(
                &format!("record-spectrum-{k}"),
                &format!("Spectrum of the error of {}", names[k]),
                Axis::log("frequency", "Hz"),
                Axis::log("density", unit),
            );
            let of = |samples: &[Sample]| {
                let running: Vec<f64> =
                    samples.iter().filter(|s| s.scored).map(|s| (s.target[k] - s.measured[k]) * 1e9).collect();
                density(&running, model.timing.period)
            };
            let (frequencies, values) = of(&run.recorded);
            chart = chart.with(RECORDED, LINE, pairs(&frequencies, &values)).colored(BLUE);
            if run.simulated.is_ok() {
                let (frequencies, values) = of(run.simulated());
                chart = chart.with(SIMULATED, Mark::Dashed(1.6), pairs(&frequencies, &values)).colored(INK);
            }
            if !modes.is_empty() {
                chart = chart.noted(Note::Modes(modes.clone(), (1..=modes.len()).map(|k| k.to_string()).collect()));
            }
            chart.short = names[k].to_owned();
            chart
        })
        .collect();
    let section = Section::new("spectra", "Spectra", "");
    let section = if law.is_empty() {
        section
    } else {
        section.lead(&format!(
            "Errors of {law} by frequency; marks at the bottom are the modes of the platform on its legs."
        ))
    };
    section.charts(charts)
}

fn noise(model: &Model, run: &Run) -> Section {
    let declared = model.sensor.noise * 1e9;
    let mut numbers = Grid::new("Noise of the gauges, nm rms", &["gauge", "recorded", "simulated", "spec"]);
    let mut largest = declared;
    let mut worst = (0, 0.0);
    let rows: Vec<Value> = (0..6)
        .map(|k| {
            let found = white(&run.recorded, k);
            let simulated = run.simulated.as_ref().ok().map(|samples| white(samples, k));
            worst = if found > worst.1 { (k, found) } else { worst };
            largest = [found, simulated.unwrap_or(0.0)].into_iter().fold(largest, |a, b| if b > a { b } else { a });
            numbers.push(vec![
                GAUGES[k].to_owned(),
                digits(found),
                simulated.map_or_else(String::new, digits),
                digits(declared),
            ]);
            let mut marks = vec![json!({ "m": "dot", "x": found, "text": short(found) })];
            marks.extend(simulated.map(|value| json!({ "m": "hollow", "x": value })));
            json!({ "name": GAUGES[k], "marks": marks, "limit": declared })
        })
        .collect();
    let mut legend = vec![json!({ "m": "dot", "text": RECORDED })];
    if run.simulated.is_ok() {
        legend.push(json!({ "m": "hollow", "text": SIMULATED }));
    }
    let picture = Rows {
        id: "gauge-noise".to_owned(),
        title: "Noise of the gauges, nm rms; line: sensor.noise of the spec".to_owned(),
        data: json!({ "scale": "linear", "range": [0.0, 1.25 * largest], "unit": "nm", "rows": rows, "legend": legend, "left": 70, "right": 40, "label": "Noise of the gauges" }),
        numbers,
    };
    Section::new("noise", "Gauge noise", "")
        .lead(&format!("{} is the noisiest with {}\u{2009}nm; the spec has {}\u{2009}nm.", GAUGES[worst.0], short(worst.1), short(declared)))
        .part(Part::Rows(picture))
        .text("White noise from the second difference of the readings, which motion hardly affects; it includes converter steps.")
}

fn loops(model: &Model, run: &Run) -> Section {
    let charts = (0..6)
        .map(|k| {
            let mut chart = Chart::new(
                &format!("record-loop-{k}"),
                &format!("Leg {k}: displacement by the gauges over voltage"),
                Axis::linear("voltage", "V"),
                Axis::linear("displacement", "µm"),
            );
            let of = |samples: &[Sample]| -> Vec<[f64; 2]> {
                let every = samples.len().div_ceil(POINTS).max(1);
                samples.iter().step_by(every).map(|s| [s.voltage[k], s.leg[k] * 1e6]).collect()
            };
            chart = chart.with(RECORDED, LINE, of(&run.recorded)).colored(BLUE);
            if run.simulated.is_ok() {
                chart = chart.with(SIMULATED, Mark::Dashed(1.6), of(run.simulated())).colored(INK);
            }
            chart.keys = true;
            chart.short = format!("leg {k}");
            chart.height = 340;
            chart
        })
        .collect();
    let gain = |samples: &[Sample], k: usize| {
        let ends = samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0), |(low, high, at, to), s| {
            let (low, at) = if s.voltage[k] < low { (s.voltage[k], s.leg[k]) } else { (low, at) };
            let (high, to) = if s.voltage[k] > high { (s.voltage[k], s.leg[k]) } else { (high, to) };
            (low, high, at, to)
        });
        (ends.3 - ends.2) / (ends.1 - ends.0) / model.actuator.leg_gain()
    };
    let mut table = Grid::new(
        "Gain of each leg relative to the spec, from lowest to highest voltage",
        &["leg", RECORDED, SIMULATED],
    );
    for k in 0..6 {
        let simulated = run.simulated.as_ref().map_or_else(|_| String::new(), |samples| digits(gain(samples, k)));
        table.push(vec![k.to_string(), digits(gain(&run.recorded, k)), simulated]);
    }
    Section::new("hysteresis", "Hysteresis", "").charts(charts).table(table)
}

fn timing(model: &Model, run: &Run) -> Section {
    let second = |tick: u64| format!("{:.4}", tick as f64 * model.timing.period);
    let mut table = Grid::new("Late and missing ticks, phases", &["tick", "s", "event"]);
    let late = run.late();
    for tick in late.iter().take(100) {
        table.push(vec![tick.to_string(), second(*tick), "late or skipped".to_owned()]);
    }
    for (from, to) in &run.gaps {
        table.push(vec![from.to_string(), second(*from), format!("{} ticks are missing in the record", to - from)]);
    }
    for (tick, what) in run.phases.iter().take(100) {
        table.push(vec![tick.to_string(), second(*tick), what.clone()]);
    }
    table.rows.sort_by_key(|row| row[0].parse::<u64>().unwrap_or_default());
    let (late, all) = (late.len(), thin(&group(run.recorded.len() as u64)));
    let missing = run.gaps.iter().map(|(from, to)| to - from).sum::<u64>();
    let mut section = Section::new("timing", "Late ticks", "").lead(&format!(
        "{late} of {all} ticks were late or skipped on the machine; {missing} are missing in the record."
    ));
    for damaged in &run.damaged {
        section = section.text(damaged);
    }
    section.table(table)
}
