//! Sections that need no simulated trajectory: findings, modes, rounding errors, time and memory, digests.

use core::f64::consts::TAU;

use super::section::{Grid, Section};
use specgen_compiler::compile::Compilation;
use specgen_compiler::ir::Scalar;
use specgen_compiler::precision::{self, Precision};
use specgen_compiler::stability::platform::{DampedMode, Design, SLOW};
use specgen_language::diagnostic::to_json;
use specgen_language::model::Target;
use specgen_studies::reproduce::write::digits;
use specgen_studies::verdict::{Mark, Subject, Verdict};
use specgen_studies::verify::Measurement;

/// The findings and their places, as reported by `specgen check`.
pub fn findings(compiled: &Compilation, command: &str) -> Section {
    let section = Section::new("findings", "Findings", command);
    if compiled.findings.is_empty() {
        return section.lead("None: no errors, warnings or notes.");
    }
    let mut table = Grid::new("Findings", &["", "code", "line", "column", "key", "what", "fix"]);
    for finding in to_json(&compiled.findings, &compiled.source).as_array().into_iter().flatten() {
        let text = |key: &str| match &finding[key] {
            serde_json::Value::Null => String::new(),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        table.push(["severity", "code", "line", "column", "key", "message", "help"].map(text).to_vec());
    }
    section.lead("No errors.").table(table)
}

/// Errors on trajectories and their limits.
pub fn tracking(verdict: &Verdict, command: &str) -> Section {
    let mut table = Grid::new("Errors on trajectories, rms", &["error", "value", "limit", "unit", ""]);
    for figure in verdict.figures.iter().filter(|figure| figure.subject == Subject::Tracking) {
        let word = match figure.mark {
            Mark::Within => "within limit",
            Mark::Beyond => "exceeds limit",
            Mark::NoLimit => "no limit in the spec",
        };
        let texts = [&figure.name, &digits(figure.value), &figure.limit_text(), figure.unit, word];
        table.push(texts.map(str::to_owned).to_vec());
    }
    Section::new("errors", "Errors and their limits", command).table(table)
}

/// Table of every control mode that can be selected at run time.
pub fn control_modes(design: &Design) -> Grid {
    let or = |value: Option<f64>, none: &str| value.map_or_else(|| none.to_owned(), digits);
    let mut table = Grid::new(
        "All control modes selectable at run time",
        &[
            "mode",
            "spectral radius",
            "λ limit",
            "gain margin ×",
            "delay margin, ticks",
            "slowest time constant, ms",
            "least damped mode",
            "structural modes need ζ",
        ],
    );
    for one in &design.margins {
        let least = one.modes.iter().min_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
        table.push(vec![
            one.law.to_string(),
            format!("{:.5}", one.spectral_radius),
            or(one.gain_ratio_limit, "> 10"),
            or(one.gain_margin, "none found"),
            or(one.delay_margin_ticks, "> 5"),
            or(one.settling.map(|time| time * 1e3), "no feedback"),
            least.map_or_else(String::new, |mode| format!("{:.0} Hz, ζ {:.4}", mode.frequency, mode.damping_ratio)),
            digits(one.structure_damping),
        ]);
    }
    table
}

/// Modes of the platform on its legs.
pub fn modes(design: &Design) -> Grid {
    let mut modes = Grid::new("Modes of the platform on its legs", &["mode", "Hz", "ζ"]);
    for (number, mode) in design.modes.iter().enumerate() {
        let hertz = mode.frequency / TAU;
        modes.push(vec![format!("{}", number + 1), digits(hertz), format!("{:.4}", mode.damping_ratio)]);
    }
    modes
}

/// Effect of active damping on each mode; `None` without it.
pub fn damping(design: &Design) -> Option<Grid> {
    let damping = design.damping.as_ref()?;
    let at = SLOW.map(|part| format!("|S| at {} Hz", digits(design.modes[0].frequency / TAU / part)));
    let mut head = vec!["mode", "Hz", "compliance peak ×", "largest |S|", "worst |S|", "tracking error ×"];
    head.extend(at.iter().map(String::as_str));
    let mut table = Grid::new("Active damping in P/F (without it in parentheses)", &head);
    for (number, (mode, found)) in design.modes.iter().zip(&damping.modes).enumerate() {
        let mut row = vec![format!("{}", number + 1), digits(mode.frequency / TAU)];
        match found {
            Some(DampedMode { compliance, sensitivity, slow, without, tracking }) => {
                row.extend([*compliance, sensitivity[0], sensitivity[1]].map(|value| format!("{value:.2}")));
                row.push(format!("{tracking:.2}"));
                row.extend(slow.iter().zip(without).map(|(with, without)| format!("{with:.3} ({without:.3})")));
            }
            None => row.extend(["too fast for the period", "", "", "", "", "", ""].map(str::to_owned)),
        }
        table.push(row);
    }
    Some(table)
}

/// Rounding errors of the scalar, per axis.
pub fn rounding(rounding: &Precision, scalar: Scalar, command: &str) -> Section {
    let single = rounding.commanded.against_f64.is_some();
    let mut head = vec!["pose", "axis", "unit", "analytical bound", "largest found", "bound / found"];
    head.extend(single.then_some("largest difference to f64"));
    let mut table = Grid::new(&format!("Rounding errors of f{} over the declared workspace", scalar.bits()), &head);
    for row in precision::rows(rounding) {
        let texts = [row.what, row.axis, row.unit].map(str::to_owned);
        let small = |value: f64| format!("{value:.2e}");
        let mut numbers = vec![small(row.bound), small(row.sampled), row.ratio.map_or_else(String::new, digits)];
        numbers.extend(row.against_f64.map(small));
        table.push([texts.to_vec(), numbers].concat());
    }
    Section::new("precision", "Rounding errors", command)
        .text("Errors due to the controller's number format. The bound holds at every pose of the workspace; the largest error found is from trials against 106-bit arithmetic.")
        .table(table)
}

/// Time and memory on the emulated machine, or why they were not measured.
pub fn budget(target: &Target, measured: Result<&Measurement, &str>, command: &str) -> Section {
    let budget = &target.budget;
    let section = Section::new("budget", "Time and memory", command);
    let m = match measured {
        Ok(measurement) => measurement,
        Err(why) => return section.text(&format!("Not measured: {why}")),
    };
    let mut table = Grid::new(&format!("{}, {}", m.machine, m.compiler), &["resource", "used", "budget", "used, %"]);
    let mut row = |what: &str, used: f64, declared: Option<u64>| {
        let share = declared.map_or_else(String::new, |declared| format!("{:.1}", 100.0 * used / declared as f64));
        let declared = declared.map_or_else(String::new, |declared| declared.to_string());
        table.push(vec![what.to_owned(), format!("{used:.0}"), declared, share]);
    };
    row("flash, bytes", m.used.flash as f64, budget.flash);
    row("of which code reachable from a tick, bytes", m.tick_code as f64, None);
    if let Some(ram) = m.used.ram {
        row("RAM including the tick's stack, bytes", ram as f64, budget.ram);
    }
    row("of which State, bytes", m.state as f64, None);
    if let Some(bound) = m.stack_bound {
        row("tick stack, bytes (static bound)", bound as f64, budget.stack);
    }
    row("tick stack, bytes (measured)", m.stack_painted as f64, budget.stack);
    let mut stages = Grid::new(
        "Instructions per stage, counted exactly (not cycles)",
        &["stage", "mean", "fewest", "most", "calls"],
    );
    for stage in &m.stages {
        let whole = stage.name == "step";
        if whole {
            row("instructions per tick, mean", stage.mean, budget.instructions);
        }
        let counts = [stage.min, stage.max, stage.calls].map(|count| count.to_string());
        let name = if whole { "whole tick".to_owned() } else { stage.name.clone() };
        stages.push([vec![name, format!("{:.0}", stage.mean)], counts.to_vec()].concat());
    }
    let budget =
        "target.budget.instructions limits the mean tick; the most expensive tick must fit into the period as well.";
    let section = section.text(budget).table(table).table(stages);
    let Some(time) = &m.time else { return section };
    let heading = format!(
        "Longest tick on {}, us, modelled for its core at {:.0} MHz: {:.1} of {:.1}",
        time.board, time.core, time.worst, time.period
    );
    let mut parts = Grid::new(&heading, &["what", "us"]);
    for (name, microseconds) in &time.parts {
        parts.push(vec![(*name).to_owned(), format!("{microseconds:.1}")]);
    }
    section.table(parts)
}

/// Bit identity: digests of the exercise on this host, and the comparison with the emulated machine.
pub struct Bits<'a> {
    /// Ticks of the exercise.
    pub ticks: usize,
    /// SHA-256 of its trace.
    pub trace: String,
    /// Digest of the state after the last tick.
    pub state: u64,
    /// The measurement on the emulated machine, or why there is none.
    pub measured: Result<&'a Measurement, &'a str>,
}

/// Digests of spec, controller and the compared runs.
pub fn digests(compiled: &Compilation, bits: &Bits, command: &str) -> Section {
    let mut table = Grid::new("Digests", &["what", "value"]);
    let mut row = |what: &str, value: String| table.push(vec![what.to_owned(), value]);
    row("specgen", env!("CARGO_PKG_VERSION").to_owned());
    row("spec and records, SHA-256", compiled.ir.digest.clone());
    row("scalar", format!("f{}", compiled.ir.scalar.bits()));
    row("ticks in the exercise", bits.ticks.to_string());
    row("trace of the exercise on this host, SHA-256", bits.trace.clone());
    row("final state on this host", format!("{:016x}", bits.state));
    match bits.measured {
        Ok(m) => {
            let verdict = m.first_difference.as_ref().map_or_else(
                || format!("identical bits in every word of {} ticks", m.ticks),
                |difference| format!("DIFFERENT: {difference}"),
            );
            row(&format!("{} compared with this host", m.machine), verdict);
        }
        Err(why) => row("emulated machine compared with this host", format!("not compared: {why}")),
    }
    Section::new("digests", "Bit identity", command)
        .text("Host and emulated microcontroller compute the same bits from the same inputs: outputs and state digest are compared word by word.")
        .table(table)
}
