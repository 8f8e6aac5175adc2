//! First screen of a page: verdict, key figures, platform, findings; for a refused spec its source.

use serde_json::json;
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_compiler::reach::{self, Reach};
use specgen_language::diagnostic::{Diagnostic, Severity, codes};
use specgen_language::model::Model;
use specgen_language::spec::SpecSource;
use specgen_runtime::ControlMode;
use specgen_studies::verdict::{Figure, Mark, Subject, Verdict};
use specgen_studies::verify::Measurement;
use specgen_toolchain::budget::group;

use super::margins;
use super::page::marked;
use super::platform;
use super::section::{Part, Rows};
use super::tracking::{AXES, short};
use super::verdict::{
    Sentence, card, findings, limit_row, mark, rows, share, source, text_row, thin, tightest, value_row,
};

/// Number of error limits shown at once.
const JUDGED: usize = 3;
/// Figures that are not computed for a refused spec.
const LATER: [&str; 7] = ["trajectories", "margins", "instructions", "flash, RAM", "stack", "bits", "error budget"];

/// Errors on trajectories.
#[derive(Debug, Clone)]
pub struct Errors {
    /// One picture per unit, with its unit.
    pub pictures: Vec<(&'static str, Rows)>,
    /// Short text.
    pub text: String,
    /// Explanation of the figures.
    pub note: String,
}

/// The first screen of a compiled spec. `mode`: its control mode, as the value of the word `mode`.
pub fn of(
    compiled: &Compilation,
    verdict: &Verdict,
    measured: Result<&Measurement, &str>,
    errors: Errors,
    mode: u32,
) -> Vec<Part> {
    let sentence = Sentence::of(verdict);
    let (headline, limits) = (sentence.html(&compiled.findings), tightest(verdict, &errors.text));
    let reach = reach_card(compiled, verdict);
    let mut parts = vec![Part::Html(format!("{headline}<div class=\"first\">\n{limits}{reach}"))];
    parts.extend(error_card(verdict, errors));
    parts.extend(platform_card(
        &compiled.model,
        platform::at_rest(&compiled.model, &compiled.findings),
        "drag to rotate · to scale",
    ));
    let is_error = |finding: &Diagnostic| finding.severity == Severity::Error;
    let missed = compiled.findings.iter().any(is_error);
    let note = if missed { "a requirement is not met · one row per code" } else { "no errors · one row per code" };
    parts.push(Part::Html(format!(
        "{}{}{}</div>\n",
        controller_card(compiled, verdict, measured),
        margin_card(compiled, verdict, mode),
        findings("Findings", note, &compiled.findings, &compiled.source)
    )));
    parts
}

fn reach_card(compiled: &Compilation, verdict: &Verdict) -> String {
    let mut content = rows(verdict, &[Subject::Reach]);
    if let Some(reach) = &compiled.reach {
        content += &text_row(
            "all axes at once",
            &format!(
                "{:.0}\u{2009}% of the box about {}",
                100.0 * reach.share,
                if compiled.design.is_some() { "the bias" } else { "rest" }
            ),
            "note",
        );
    }
    let noise = verdict.figures.iter().filter(|figure| figure.subject == Subject::Noise && figure.name == "step");
    content += &noise.map(|figure| limit_row("resolution", figure)).collect::<String>();
    // The axis closest to its limit; without limits, x.
    let at_rest = verdict
        .figures
        .iter()
        .filter(|figure| figure.subject == Subject::Noise && AXES.contains(&figure.name.as_str()));
    let used = |figure: &Figure| share(figure).unwrap_or_default();
    let worst = at_rest.reduce(|a, b| if used(b) > used(a) { b } else { a });
    content +=
        &worst.map_or_else(String::new, |figure| limit_row(&format!("noise at rest in {}", figure.name), figure));
    let note =
        if compiled.design.is_some() { "required of available, line: limit" } else { "from the middle of the strokes" };
    card("Reach per axis", note, "", &content)
}

fn error_card(verdict: &Verdict, errors: Errors) -> Vec<Part> {
    let mut head =
        "<div class=\"card\" data-choices><div class=\"head\"><h2>Error on your trajectories</h2>".to_owned();
    if errors.pictures.len() > 1 {
        head += "<span class=\"choice note\" data-axis=\"0\">";
        for (k, (unit, _)) in errors.pictures.iter().enumerate() {
            let on = if k == 0 { " class=\"on\"" } else { "" };
            head += &format!("<button type=\"button\"{on} data-value=\"{unit}\">{unit}</button>");
        }
        head += "</span>";
    }
    head += "</div>\n";
    let mut parts = vec![Part::Html(head)];
    for (k, (unit, picture)) in errors.pictures.into_iter().enumerate() {
        let hidden = if k == 0 { "" } else { " hidden" };
        parts.push(Part::Html(format!("<div class=\"pane\" data-value=\"{unit}\"{hidden}>\n")));
        parts.push(Part::Rows(picture));
        parts.push(Part::Html("</div>\n".to_owned()));
    }
    let judged: Vec<&Figure> =
        verdict.figures.iter().filter(|figure| figure.subject == Subject::Tracking && figure.limit.is_some()).collect();
    // The tightest limits are shown here, all of them in the tables.
    let mut tight = judged.clone();
    tight.sort_by(|a, b| share(b).unwrap_or_default().total_cmp(&share(a).unwrap_or_default()));
    let mut content: String = tight.iter().take(JUDGED).map(|figure| limit_row(&figure.name, figure)).collect();
    let open = match judged.len() {
        0 => "The spec sets no limit. ".to_owned(),
        few if few <= JUDGED => "Limits: requirements.tracking. ".to_owned(),
        many => format!("The tightest of {many} limits of requirements.tracking. "),
    };
    let sign = if judged.is_empty() { mark("none") } else { String::new() };
    content += &format!(
        "<p class=\"legend\" style=\"display:flex;gap:4px\">{sign}<span>{open}{}</span></p></div>\n",
        marked(&errors.note)
    );
    parts.push(Part::Html(content));
    parts
}

fn controller_card(compiled: &Compilation, verdict: &Verdict, measured: Result<&Measurement, &str>) -> String {
    let part = compiled.model.target.mcu.part();
    let mut content = String::new();
    for figure in verdict.figures.iter().filter(|figure| matches!(figure.subject, Subject::Time | Subject::Memory)) {
        // Shown with the period below.
        if figure.name != "longest tick" {
            content += &limit_row(&figure.name, figure);
        }
    }
    match measured {
        Ok(m) => {
            let bits = verdict.figures.iter().find(|figure| figure.subject == Subject::Bits);
            let good = bits.is_some_and(|figure| figure.mark == Mark::Within);
            let text = if good {
                format!("identical to the host over {} ticks", thin(&group(m.ticks)))
            } else {
                "DIFFERENT from the host".to_owned()
            };
            content += &text_row("bits", &text, if good { "ok" } else { "error" });
            if let Some(step) = m.stage("step") {
                let period = compiled.model.timing.period;
                let instructions = thin(&group(step.max));
                let microseconds = short(period * 1e6).trim_end_matches(".0").to_owned();
                let speed = short(step.max as f64 / period * 1e-6);
                let text = format!("{instructions} in {microseconds}\u{2009}µs: core ≥ {speed} MIPS");
                content += &text_row("worst tick", &text, "none");
            }
        }
        Err(why) => {
            for what in ["time", "memory", "bits"] {
                content += &text_row(what, "not measured", "none");
            }
            content += &format!("<p class=\"legend\">{}</p>\n", marked(why));
        }
    }
    // A board is emulated by another machine with its core.
    let counted = measured.ok().filter(|m| m.machine != part.name);
    let note = counted.map_or_else(String::new, |m| format!(" · counted on an emulated {}", m.machine));
    card(&format!("Controller on {}", part.board), &format!("used of budget{note}"), "", &content)
}

fn margin_card(compiled: &Compilation, verdict: &Verdict, mode: u32) -> String {
    let slew = compiled.demands.iter().map(|demand| demand.slew).fold(0.0, |a: f64, b| if b > a { b } else { a });
    let slew_row = |content: &mut String| {
        let limit = compiled.model.actuator.slew_rate;
        if slew > 0.0 {
            let share = slew / limit;
            let text = |value: f64| short(value * 1e-3).trim_end_matches(".0").to_owned();
            *content += &value_row(
                "leg slew",
                [&text(slew), &text(limit), "V/ms"],
                share,
                if share <= 1.0 { "ok" } else { "error" },
            );
        }
    };
    let mut content = String::new();
    let Some(design) = &compiled.design else {
        content += &rows(verdict, &[Subject::Margins]);
        slew_row(&mut content);
        return card("Margins of the adaptation", "declared of stable", "", &content);
    };
    for figure in verdict.figures.iter().filter(|figure| figure.subject == Subject::Margins) {
        let text = figure.value_text();
        content += &match (figure.name.as_str(), &figure.limit) {
            (_, Some(_)) => limit_row("leg gain λ", figure),
            ("delay", None) => value_row("extra delay", ["0", &text, "ticks"], 0.0, "ok"),
            (_, None) => value_row("loop gain", ["×1", &format!("×{text}"), ""], 1.0 / figure.value, "ok"),
        };
    }
    slew_row(&mut content);
    let law = ControlMode::from_word(u64::from(mode)).unwrap_or(ControlMode::P);
    let own = design.margins.iter().find(|one| one.law == law);
    if let Some((own, settling)) = own.and_then(|own| Some((own, own.settling?))) {
        let least = own.modes.iter().min_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
        let least = least.map_or_else(String::new, |mode| {
            format!("; ζ {:.3} at {:.0}\u{2009}Hz", mode.damping_ratio, mode.frequency)
        });
        let text = format!("{:.0}\u{2009}ms, {}{least}", settling * 1e3, margins::short_name(law));
        content += &text_row("slowest time constant", &text, "none");
    }
    let stable = design.margins.iter().filter(|one| one.spectral_radius < 1.0).count();
    let all = stable == design.margins.len();
    content += &text_row(
        "all modes",
        &format!("{stable} of {} stable", design.margins.len()),
        if all { "ok" } else { "error" },
    );
    card("Loop margins", "worst control mode · declared of stable", "", &content)
}

fn platform_card(model: &Model, view: Part, note: &str) -> Vec<Part> {
    // With two poses drawn, gauges would hide them.
    let gauges = if matches!(&view, Part::View(_, data) if data.get("ghost").is_some()) {
        ""
    } else if model.task_space.is_some() {
        "<span><b class=\"blue\">G0–G5</b> gauge, arrow: positive reading</span>"
    } else {
        "<span>a gauge in each leg, positive for elongation</span>"
    };
    let part = if model.task_space.is_some() { "<span>box: work part</span>" } else { "" };
    let mass = format!("{}", model.platform.mass);
    vec![
        Part::Html(format!(
            "<div class=\"card platform\"><div class=\"head\"><h2>Platform</h2><span class=\"note\">{}</span></div>\n",
            marked(note)
        )),
        view,
        Part::Html(format!(
            "<p class=\"legend\">{gauges}<span><b>0–5</b> legs, {}\u{2009}µm stroke</span><span>{mass}\u{2009}kg platform</span>{part}</p></div>\n",
            short(model.actuator.stroke * 1e6).trim_end_matches(".0")
        )),
    ]
}

/// The page of a refused spec. `model`: as far as it could be read; `accepted`: whether the fix of the first error
/// was tried and works.
pub fn refused(text: &SpecSource, all: &[Diagnostic], model: Option<&Model>, accepted: bool) -> Vec<Part> {
    let errors: Vec<&Diagnostic> = all.iter().filter(|finding| finding.severity == Severity::Error).collect();
    let Some(first) = errors.first() else { return Vec::new() };
    let title =
        codes::REGISTRY.iter().find(|code| code.id == first.code).map_or("the spec is refused", |code| code.title());
    let measured = model.and_then(|model| Some((model, measure(model)?)));
    let beyond = measured.as_ref().and_then(|(_, reach)| {
        (0..6).map(|axis| (axis, reach_figure(reach, axis))).find(|(_, figure)| figure.mark == Mark::Beyond)
    });
    let (reason, why) = match &beyond {
        Some((axis, figure)) if first.key.starts_with("workspace") => (
            format!("{} is out of reach", AXES[*axis]),
            format!(
                "The spec requires {}\u{2009}{unit} in {}, but the legs reach only {}\u{2009}{unit}. Nothing was generated.",
                figure.limit_text(),
                AXES[*axis],
                figure.value_text(),
                unit = figure.unit
            ),
        ),
        _ => (title.to_owned(), format!("{} Nothing was generated.", super::verdict::sentence(&first.message))),
    };
    let sentence = Sentence { verdict: format!("Not safe to build: {reason}"), why, mark: "error" };
    let mut html = format!("{}<div class=\"first\">\n{}", sentence.html(all), source(all, text, accepted));
    let mut parts = Vec::new();
    if let Some((_, reach)) = &measured {
        let content: String = (0..6).map(|axis| limit_row(AXES[axis], &reach_figure(reach, axis))).collect();
        html += &card("Reach per axis", "required of available", "", &content);
    }
    let later: String = LATER.iter().map(|what| text_row(what, "not computed", "none")).collect();
    html += &card("Not computed", &format!("blocked by {}", first.code), "", &later);
    parts.push(Part::Html(html));
    if let Some(model) = model {
        let mut view = platform::at_rest(model, all);
        let mut note = "drag to rotate · to scale".to_owned();
        if let (Part::View(_, data), Some((axis, figure))) = (&mut view, &beyond) {
            let asked = figure.limit.as_ref().map_or(0.0, |limit| limit.value) * 1e-6;
            let has = figure.value * 1e-6;
            let larger = larger(model, *axis, asked);
            let pose = |value: f64| {
                let mut pose = [0.0; 6];
                pose[*axis] = value * larger;
                pose
            };
            data["pose"] = json!(pose(has));
            data["ghost"] = json!(pose(asked));
            data["texts"] = json!([
                format!("{} {}\u{2009}{} required", AXES[*axis], figure.limit_text(), figure.unit),
                format!("{}\u{2009}{} reached", figure.value_text(), figure.unit)
            ]);
            note = format!("motion magnified {}\u{2009}times", thin(&group(larger as u64)));
        }
        parts.extend(platform_card(model, view, &note));
    }
    let other: Vec<Diagnostic> = all.iter().filter(|finding| !core::ptr::eq(*finding, *first)).cloned().collect();
    let note =
        if errors.len() > 1 { "the spec is refused because of errors" } else { "none of these would refuse the spec" };
    parts.push(Part::Html(format!("{}</div>\n", findings("Other findings", note, &other, text))));
    parts
}

/// The reach, as far as it can be computed for a refused spec.
fn measure(model: &Model) -> Option<Reach> {
    let bias = model.task_space.as_ref()?.setpoint.bias;
    let platform = lower::platform(model).ok()?;
    Some(reach::measure(model, &platform, model.actuator.stroke, &bias))
}

fn reach_figure(reach: &Reach, axis: usize) -> Figure {
    let [low, high] = reach.axes[axis].from_middle.map(f64::abs);
    let unit = if axis < 3 { "µm" } else { "µrad" };
    Figure::new(Subject::Reach, AXES[axis], 1e6 * if low > high { low } else { high }, unit)
        .at_least(1e6 * reach.axes[axis].declared, "workspace")
}

/// A round magnification for displaying a motion.
fn larger(model: &Model, axis: usize, value: f64) -> f64 {
    let wanted = if axis < 3 { 0.3 * model.geometry.height / value } else { 0.4 / value };
    let decade = libm::pow(10.0, libm::floor(libm::log10(wanted)));
    if wanted >= 5.0 * decade {
        5.0 * decade
    } else if wanted >= 2.0 * decade {
        2.0 * decade
    } else {
        decade
    }
}
