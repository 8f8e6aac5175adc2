//! Figures of a compiled spec that need no build and no run.

use specgen_compiler::compile::Compilation;
use specgen_compiler::requirements;

use super::{AXES, Figure, LOOKED_AT, NOT_SIMULATED, Subject};

/// Reach, noise, records and margins.
pub(super) fn figures(compiled: &Compilation) -> impl Iterator<Item = Figure> {
    [reach(compiled), noise(compiled), record(compiled), margins(compiled), tracking(compiled)].into_iter().flatten()
}

fn reach(compiled: &Compilation) -> Vec<Figure> {
    let Some(reach) = &compiled.reach else { return Vec::new() };
    let axes = reach.axes.iter().enumerate().map(|(axis, one)| {
        let [low, high] = one.from_middle.map(f64::abs);
        let unit = if axis < 3 { "µm" } else { "µrad" };
        let figure = Figure::new(Subject::Reach, AXES[axis], 1e6 * if low > high { low } else { high }, unit);
        // Legs with their own gauges stop individually at the ends of their strokes: no workspace limit applies.
        if compiled.design.is_none() {
            return figure;
        }
        let key = if axis < 3 { "workspace.translation" } else { "workspace.rotation" };
        figure.at_least(1e6 * one.declared, key)
    });
    axes.collect()
}

fn noise(compiled: &Compilation) -> Vec<Figure> {
    let noise = &compiled.rest_noise;
    let axes = noise.pose.iter().enumerate().map(|(axis, value)| {
        let figure = Figure::new(Subject::Noise, AXES[axis], 1e9 * value, if axis < 3 { "nm" } else { "nrad" });
        match compiled.model.requirements.noise_of(axis) {
            Some((limit, key)) => figure.at_most(1e9 * limit, key),
            None => figure,
        }
    });
    let mut figures: Vec<Figure> = axes.collect();
    figures.push(Figure::new(Subject::Noise, "gauge", 1e9 * noise.reading, "nm"));
    let steps = requirements::steps(&compiled.model);
    let largest = steps.platform.iter().fold(steps.leg, |largest, step| if *step > largest { *step } else { largest });
    let step = Figure::new(Subject::Noise, "step", 1e9 * largest, "nm");
    figures.push(match compiled.model.requirements.precision {
        Some(precision) => step.at_most(1e9 * precision, "requirements.precision"),
        None => step,
    });
    figures
}

fn record(compiled: &Compilation) -> Vec<Figure> {
    let worst = compiled.records.iter().flatten().max_by(|a, b| a.fit_rms_percent.total_cmp(&b.fit_rms_percent));
    let Some(worst) = worst else { return Vec::new() };
    vec![
        Figure::new(Subject::Record, "fit", worst.fit_rms_percent, "%"),
        Figure::new(Subject::Record, "range", 1e6 * worst.displacement_range, "µm"),
        Figure::new(Subject::Record, "noise", 1e9 * worst.noise_floor, "nm"),
    ]
}

fn margins(compiled: &Compilation) -> Vec<Figure> {
    let subject = Subject::Margins;
    let highest = compiled.model.adaptation.gain_ratio[1];
    let lambda = |limit: Option<f64>| {
        let figure = limit.map_or_else(
            || Figure::more_than(subject, "λ", LOOKED_AT[0], ""),
            |limit| Figure::new(subject, "λ", limit, ""),
        );
        figure.at_least(highest, "adaptation.gain_ratio")
    };
    if let Some(design) = &compiled.design {
        let least = |of: fn(&specgen_compiler::stability::platform::ModeMargins) -> Option<f64>| {
            design.margins.iter().filter_map(of).min_by(f64::total_cmp)
        };
        let mut figures = vec![lambda(least(|mode| mode.gain_ratio_limit))];
        figures.extend(least(|mode| mode.gain_margin).map(|gain| Figure::new(subject, "gain ×", gain, "")));
        figures.push(least(|mode| mode.delay_margin_ticks).map_or_else(
            || Figure::more_than(subject, "delay", LOOKED_AT[1], "ticks"),
            |ticks| Figure::new(subject, "delay", ticks, "ticks"),
        ));
        let needed = design.margins.iter().map(|mode| mode.structure_damping).fold(0.0, f64::max);
        let structure = Figure::new(subject, "structure ζ", 100.0 * needed, "%");
        figures.push(structure.at_most(100.0 * compiled.model.structure.damping_ratio, "robust.structure"));
        return figures;
    }
    let Some(margins) = &compiled.margins else { return Vec::new() };
    let mut figures: Vec<Figure> = margins.static_gain_limit.map(|limit| lambda(Some(limit))).into_iter().collect();
    if let Some(largest) = margins.largest_level_weight {
        let weight = Figure::new(subject, "level weight", compiled.model.adaptation.level_weight, "");
        figures.push(weight.at_most(largest, "stability of the sampled leg"));
    }
    figures
}

/// Error limits, which need a run: reported as text without an answer.
fn tracking(compiled: &Compilation) -> Vec<Figure> {
    let limits = compiled.model.requirements.tracking.len();
    let words = match limits {
        0 => return Vec::new(),
        1 => "1 limit, not simulated here: specgen report".to_owned(),
        many => format!("{many} limits, not simulated here: specgen report"),
    };
    vec![Figure { words: Some(words), ..Figure::new(Subject::Tracking, NOT_SIMULATED, limits as f64, "") }]
}
