//! Stability margins: the open loop of each axis, and every control mode.

use core::f64::consts::TAU;

use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_compiler::stability::platform::{DampedMode, Design, LoopKind, RestDynamics};
use specgen_language::model::TaskSpace;
use specgen_runtime::ControlMode;
use specgen_studies::reproduce::write::digits;

use super::chart::{Axis, BLUE, Chart, DASHED, INK, LINE, Note, pairs};
use super::evidence;
use super::section::{Grid, Part, Rows, Section};
use super::tracking::{AXES, short};

/// Points of a Bode plot.
const POINTS: usize = 160;
/// Lowest frequency of a Bode plot, Hz.
const LOWEST: f64 = 1.0;
/// Upper end of the search for margins.
const LARGEST: f64 = 10.0;
/// ζ of structural modes that are drawn.
const DAMPING_RATIOS: [f64; 2] = [1e-3, 1.0];

/// A control mode in full.
pub fn name(law: ControlMode) -> String {
    let name = law.to_string();
    match name.rsplit_once(' ') {
        Some((loops, adapting)) => {
            let word = adapting_name(adapting);
            format!("{loops} with {word}")
        }
        None => name,
    }
}

/// A control mode in short.
pub fn short_name(law: ControlMode) -> String {
    law.to_string().replace("invhys", "Invhys").replace("ewma", "EWMA").replace("pcc", "PCC")
}

/// Full name of an adaptation law: `invhys`, `ewma` or `pcc`.
pub fn adapting_name(word: &str) -> &'static str {
    match word {
        "invhys" => "the inverse model",
        "ewma" => "EWMA",
        _ => "PCC",
    }
}

/// The section. `mode`: the control mode of the spec, as the value of the word `mode`.
pub fn section(compiled: &Compilation, mode: u32, command: &str) -> Section {
    let section = Section::new("margins", "Margins", command);
    let Some((design, task)) = compiled.design.as_ref().zip(compiled.model.task_space.as_ref()) else {
        return of_legs(compiled, section);
    };
    let law = ControlMode::from_word(u64::from(mode)).unwrap_or(ControlMode::P);
    let all = control_modes(compiled, design, law);
    let own = design.margins.iter().find(|margins| margins.law == law);
    let stable = design.margins.iter().filter(|margins| margins.spectral_radius < 1.0).count();
    let or = |value: Option<f64>, beyond: &str| value.map_or_else(|| beyond.to_owned(), |value| format!("{value:.2}"));
    let worst = design
        .margins
        .iter()
        .filter_map(|one| one.gain_ratio_limit.map(|limit| (one.law, limit)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let worst = worst.map_or_else(String::new, |(law, limit)| format!(" (worst mode: {}, {limit:.2})", name(law)));
    let lead = own.map_or_else(String::new, |own| {
        let (law, gain_margin) = (name(law), or(own.gain_margin, "above the tested range"));
        let (leg_margin, count) = (or(own.gain_ratio_limit, "more than 10"), design.margins.len());
        let contact = if design.touching { "free and in contact with the declared work piece" } else { "free of contact" };
        format!(
            "With {law} the gain margin is {gain_margin} and the leg-gain margin {leg_margin}{worst}. {stable} of {count} modes are stable, {contact}."
        )
    });
    let Some(loops) = bode(compiled, design, task, law) else {
        return section.lead(&lead).part(Part::Rows(all)).part(Part::Table(evidence::modes(design)));
    };
    let mut section = section;
    for (axis, charts) in loops.into_iter().enumerate() {
        let mut all = all.clone();
        // Each pane has a copy of the rows.
        all.id = format!("modes-{axis}");
        if axis > 0 {
            all.numbers = Grid::default();
        }
        let left = charts.into_iter().map(Part::Chart).collect();
        section = section
            .pane(&[AXES[axis]], vec![Part::Lead(lead.clone()), Part::Columns(vec![left, vec![Part::Rows(all)]])]);
    }
    if let Some(damping) = evidence::damping(design) {
        let text = damped(design);
        section = section.text(&text).table(damping);
    }
    if let Some((chart, text)) = border(compiled, design, law) {
        section = section.part(Part::Columns(vec![vec![Part::Chart(chart)], vec![Part::Text(text)]]));
    }
    section.text("The open loop is the model's, with the sampled platform, lags of amplifiers and gauges, notch and active damping, opened at the legs for all axes at once, so its gain margin is λ = ρ/ρ̂ of the legs. The limits of the control modes follow from eigenvalues of the complete closed loop.")
}

/// For each kind of structural mode, the smallest ζ at which the loop is stable, over the frequency of the mode, with the range
/// that the spec declares; none without feedback.
fn border(compiled: &Compilation, design: &Design, law: ControlMode) -> Option<(Chart, String)> {
    let own = design.margins.iter().find(|one| one.law == law && LoopKind::of(law) != LoopKind::Open)?;
    let (from, highest) = (design.structure_from, 0.5 / compiled.model.timing.period);
    let least = compiled.model.structure.damping_ratio;
    let title = format!("Smallest damping ratio ζ of a structural mode at which the loop is stable, {}", name(law));
    let mut chart = Chart::new("border", &title, Axis::log("frequency", "Hz"), Axis::log("ζ", ""));
    for border in &own.borders {
        // Each value holds up to the next frequency; zero, which is not drawn, means that every damping is enough.
        let ends = border.frequencies.iter().skip(1);
        let steps = border.frequencies.iter().zip(ends).zip(&border.damping_ratios);
        let points = steps.flat_map(|((start, end), ratio)| [[*start, *ratio], [*end, *ratio]]).collect();
        chart = chart.with(border.kind, LINE, points);
    }
    let [_, top] = DAMPING_RATIOS;
    let declared = vec![[from, top], [from, least], [highest, least]];
    let actuator = &compiled.model.actuator;
    chart = chart
        .with("least of the declared range", DASHED, declared)
        .colored(INK)
        .noted(Note::Ring([actuator.resonance, actuator.damping_ratio], String::new()));
    (chart.keys, chart.y_limits) = (true, Some(DAMPING_RATIOS));
    let (from_hertz, ratio) = (short(from), short(least));
    let text = format!(
        "A structural mode that the model lacks leaves the loop stable if its ζ is above the line of its kind, at the nominal point and at every corner of stiffness, gain, lag and delay. The spec declares such modes from {from_hertz} Hz on with ζ of at least {ratio}: no line may enter the area above and to the right of the dashed line. The ring is actuator.resonance, which is also a mode of the legs: the line of the leg must be below it."
    );
    Some((chart, text))
}

/// Smallest benefit and largest cost of active damping.
fn damped(design: &Design) -> String {
    let found: Vec<_> = design.damping.iter().flat_map(|damping| damping.modes.iter().flatten()).collect();
    let largest = |of: &dyn Fn(&DampedMode) -> f64| {
        found.iter().map(|mode| of(mode)).fold(0.0, |most: f64, value| if value > most { value } else { most })
    };
    format!(
        "Active damping reduces the compliance peak of each mode (force to pose) to at most {} of that without it; the worst |S| over stiffness, gain, lag and delay is {}.",
        short(largest(&|mode| mode.compliance)),
        short(largest(&|mode| mode.sensitivity[1]))
    )
}

fn bode(compiled: &Compilation, design: &Design, task: &TaskSpace, law: ControlMode) -> Option<Vec<Vec<Chart>>> {
    let rest = RestDynamics::of(&lower::platform(&compiled.model).ok()?);
    let closed_loop = design.closed_loop(&compiled.model, task, &rest)?;
    let tuning = design.tuning(law);
    let highest = 0.45 / compiled.model.timing.period;
    let decades = libm::log10(highest / LOWEST);
    let frequencies: Vec<f64> =
        (0..=POINTS).map(|k| LOWEST * libm::pow(10.0, decades * k as f64 / POINTS as f64)).collect();
    let found = closed_loop.open_loop(law, tuning, &frequencies);
    if found.iter().flatten().flatten().any(|value| !value.is_finite())
        || found.iter().flatten().all(|point| point[0] == 0.0)
    {
        return None;
    }
    let modes: Vec<f64> = design.modes.iter().map(|mode| mode.frequency / TAU).collect();
    let numbers = (1..=6).map(|k| k.to_string()).collect::<Vec<_>>();
    let of = |(axis, points): (usize, &Vec<[f64; 2]>)| {
        let decibels: Vec<f64> = points.iter().map(|point| 20.0 * libm::log10(point[0])).collect();
        let phases: Vec<f64> = points.iter().map(|point| point[1]).collect();
        let chart = |kind: &str, label: &str, unit: &str, values: &[f64]| {
            Chart::new(
                &format!("{kind}-{axis}"),
                &format!("Open loop, {}, {}", AXES[axis], name(law)),
                Axis::log("frequency", "Hz"),
                Axis::linear(label, unit),
            )
            .with("", LINE, pairs(&frequencies, values))
            .colored(BLUE)
        };
        let mut gain = chart("gain", "gain", "dB", &decibels)
            .noted(Note::Level(0.0, "0\u{2009}dB".to_owned()))
            .noted(Note::Modes(modes.clone(), numbers.clone()));
        let mut phase = chart("phase", "phase", "°", &phases).noted(Note::Level(-180.0, "−180°".to_owned()));
        phase.title = format!("Phase of the open loop, {}", AXES[axis]);
        let at = |k: usize, values: &[f64], level: f64, of: &[f64]| {
            let part = (level - values[k]) / (values[k + 1] - values[k]);
            let mix = |list: &[f64]| list[k] + part * (list[k + 1] - list[k]);
            (libm::exp(mix(&frequencies.iter().map(|f| libm::log(*f)).collect::<Vec<_>>())), mix(of))
        };
        let crossing = |values: &[f64], level: f64, of: &[f64]| -> Vec<(f64, f64)> {
            (0..POINTS)
                .filter(|k| values[*k] > level && values[k + 1] <= level)
                .map(|k| at(k, values, level, of))
                .collect()
        };
        // The margin is the smallest one of all crossings of −180°.
        if let Some((hertz, value)) = crossing(&phases, -180.0, &decibels)
            .into_iter()
            .filter(|one| one.1 < 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
        {
            let times = libm::pow(10.0, -value / 20.0);
            gain = gain.noted(Note::Segment(hertz, [0.0, value], format!("gain margin ×{}", short(times))));
        }
        if let Some((hertz, value)) = crossing(&decibels, 0.0, &phases)
            .into_iter()
            .filter(|one| one.1 > -180.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
        {
            phase = phase.noted(Note::Segment(hertz, [-180.0, value], format!("phase margin {:.0}°", value + 180.0)));
        }
        gain.height = 190;
        phase.height = 170;
        gain.bare = true;
        vec![gain, phase]
    };
    Some(found.iter().enumerate().map(of).collect())
}

/// Stability limits of λ and gain for each control mode.
fn control_modes(compiled: &Compilation, design: &Design, own: ControlMode) -> Rows {
    let [low, high] = compiled.model.adaptation.gain_ratio;
    let mut rows: Vec<Value> = Vec::new();
    let mut furthest = LARGEST;
    for one in &design.margins {
        let text =
            |value: Option<f64>, beyond: &str| value.map_or_else(|| beyond.to_owned(), |value| format!("{value:.2}"));
        let mut marks = vec![match one.gain_ratio_limit {
            Some(limit) => json!({ "m": "dot", "x": limit }),
            None => json!({ "m": "arrow", "x": LARGEST }),
        }];
        marks.extend(one.gain_margin.map(|gain| json!({ "m": "square", "x": gain })));
        let ends = [one.gain_ratio_limit.unwrap_or(LARGEST), one.gain_margin.unwrap_or(1.0)];
        let end = if ends[0] > ends[1] { ends[0] } else { ends[1] };
        furthest = if end > furthest { end } else { furthest };
        rows.push(json!({
            "name": short_name(one.law),
            "line": [high, end], "marks": marks, "box": one.law == own,
            "note": format!("{} · {}", text(one.gain_ratio_limit, "> 10"), text(one.gain_margin, "–")),
        }));
    }
    let least = if low < 0.85 { low } else { 0.85 };
    Rows {
        id: "modes-0".to_owned(),
        title: "Stability limits of each control mode".to_owned(),
        data: json!({
            "scale": "log", "range": [least, 1.15 * furthest], "prefix": "×", "ticks": [1, 2, 3, 5, 10, 20], "rows": rows, "step": 37, "right": 100, "left": 100,
            "band": { "from": low, "to": high, "text": format!("declared {low}–{high}") },
            "legend": [{ "m": "dot", "text": "λ" }, { "m": "square", "text": "gain" }],
            "label": "Stability limits of λ and gain for each control mode",
        }),
        numbers: evidence::control_modes(design),
    }
}

fn of_legs(compiled: &Compilation, section: Section) -> Section {
    let Some(margins) = &compiled.margins else {
        return section.lead("The law does not adapt, so there is no loop that could be unstable.");
    };
    let [low, high] = compiled.model.adaptation.gain_ratio;
    let adapts = "the law does not adapt";
    let or = |value: Option<f64>| value.map_or_else(|| adapts.to_owned(), digits);
    let mut table = Grid::new("Adaptation of a leg", &["quantity", "value"]);
    for (what, value) in [
        ("level weight of the spec", digits(compiled.model.adaptation.level_weight)),
        ("largest stable level weight, with proportional drift weight", or(margins.largest_level_weight)),
        ("largest spectral radius of the sampled leg over gain_ratio", format!("{:.5}", margins.spectral_radius)),
        ("largest λ without leg dynamics (AII.18, AII.19)", or(margins.static_gain_limit)),
    ] {
        table.push(vec![what.to_owned(), value]);
    }
    let Some(limit) = margins.static_gain_limit else {
        return section.lead("The law does not adapt, so there is no loop that could be unstable.").table(table);
    };
    let end = if limit > high { limit } else { high };
    let rows = Rows {
        id: "leg-margin".to_owned(),
        title: "Stability limit of a leg's adaptation".to_owned(),
        data: json!({
            "scale": "log", "range": [if low < 0.85 { low } else { 0.85 }, 1.3 * end], "prefix": "×", "ticks": [1, 2, 3, 5, 10, 20, 50, 100], "left": 100, "right": 90,
            "rows": [{ "name": "λ", "line": [high, limit], "marks": [{ "m": "dot", "x": limit }], "note": format!("{limit:.2}"), "box": true }],
            "band": { "from": low, "to": high, "text": format!("declared {low}–{high}") },
            "label": "Stability limit of λ for a leg's adaptation",
        }),
        numbers: table.clone(),
    };
    section
        .lead(&format!("Without leg dynamics the adaptation is stable up to {limit:.2} times the declared leg gain; the spectral radius of the sampled leg is {:.4}.", margins.spectral_radius))
        .part(Part::Rows(rows))
        .table(table)
}
