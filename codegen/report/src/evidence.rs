//! What needs no simulation of a trajectory: summary, findings, margins, time and memory, digests.

use core::f64::consts::TAU;

use super::section::{Grid, Section};
use specgen_compiler::compile::Compiled;
use specgen_compiler::ir::Scalar;
use specgen_compiler::precision::{self, Precision};
use specgen_language::diagnostic::to_json;
use specgen_language::model::Target;
use specgen_studies::reproduce::write::digits;
use specgen_studies::verify::Measurement;

/// What `specgen check` says of the spec.
#[must_use]
pub fn summary(compiled: &Compiled, described: &str, command: &str) -> Section {
    let section = Section::new("summary", "Summary", command);
    if compiled.design.is_some() {
        return section
            .text("A platform that six gauges see, with the task-space controller.")
            .lines(described.trim_end());
    }
    section
        .text("Six legs with their own gauges: the leg feed-forward.")
        .text(
            "The spec has no [control], so that there is nothing here of position control of the platform: free motion \
             (Figs 11 to 22, Tables 5 to 8), machining (Figs 23 to 28, Table 9), modes, gains and pose noise.",
        )
        .lines(described.trim_end())
}

/// Findings with their places.
#[must_use]
pub fn findings(compiled: &Compiled, command: &str) -> Section {
    let section = Section::new("findings", "Findings of check", command);
    if compiled.findings.is_empty() {
        return section.text("None: no error, no warning, no note.");
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
    section.text("No error: with one nothing would have been generated.").table(table)
}

/// Stability of what is emitted.
#[must_use]
pub fn margins(compiled: &Compiled, command: &str) -> Section {
    let section = Section::new("margins", "Margins", command);
    let or = |value: Option<f64>, none: &str| value.map_or_else(|| none.to_owned(), digits);
    if let Some(design) = &compiled.design {
        let mut table = Grid::new(
            "Every control mode that a running controller can be put into",
            &[
                "mode",
                "spectral radius",
                "λ up to",
                "gain × up to",
                "delay up to, ticks",
                "settles, ms",
                "least damped",
            ],
        );
        for one in &design.margins {
            let least = one.modes.iter().min_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
            table.push(vec![
                one.law.name().to_owned(),
                format!("{:.5}", one.spectral_radius),
                or(one.gain_ratio_limit, "> 10"),
                or(one.gain_margin, "none met"),
                or(one.delay_margin_ticks, "> 5"),
                or(one.settling.map(|time| time * 1e3), "no feedback"),
                least.map_or_else(String::new, |mode| format!("{:.0} Hz, ζ {:.4}", mode.frequency, mode.damping_ratio)),
            ]);
        }
        let mut modes = Grid::new("Modes of the platform on its legs", &["mode", "Hz", "ζ"]);
        for (number, mode) in design.modes.iter().enumerate() {
            let hertz = mode.frequency / TAU;
            modes.push(vec![format!("{}", number + 1), digits(hertz), format!("{:.4}", mode.damping_ratio)]);
        }
        return section
            .text("The sampled closed loop with the platform's modes, amplifier lag and notch, over the declared gain_ratio.")
            .table(table)
            .table(modes);
    }
    let Some(margins) = &compiled.margins else { return section };
    let mut table = Grid::new("Adaptation of a leg", &["what", "value"]);
    let adapts = "the law does not adapt";
    for (what, value) in [
        ("level weight of the spec", digits(compiled.model.adaptation.level_weight)),
        ("largest stable level weight, drift weight in proportion", or(margins.largest_level_weight, adapts)),
        ("spectral radius of the sampled leg over gain_ratio", format!("{:.5}", margins.spectral_radius)),
        ("largest λ without leg dynamics (AII.18, AII.19)", or(margins.static_gain_limit, adapts)),
    ] {
        table.push(vec![what.to_owned(), value]);
    }
    section.table(table)
}

/// Rounding errors of the scalar, axis by axis.
#[must_use]
pub fn rounding(rounding: &Precision, scalar: Scalar, command: &str) -> Section {
    let single = rounding.commanded.against_f64.is_some();
    let mut head = vec!["pose", "axis", "unit", "bound by analysis", "largest found", "bound / found"];
    head.extend(single.then_some("largest against f64"));
    let mut table = Grid::new(&format!("Rounding errors of f{} over the declared workspace", scalar.bits()), &head);
    for row in precision::rows(rounding) {
        let texts = [row.what, row.axis, row.unit].map(str::to_owned);
        let small = |value: f64| format!("{value:.2e}");
        let mut numbers = vec![small(row.bound), small(row.sampled), row.ratio.map_or_else(String::new, digits)];
        numbers.extend(row.against_f64.map(small));
        table.push([texts.to_vec(), numbers].concat());
    }
    Section::new("precision", "Rounding errors", command)
        .text("What the number format of the controller costs. The bound holds at every pose of the workspace; the largest error found is that of trials against 106 bits.")
        .table(table)
}

/// Time and memory on the emulated machine, or why they were not measured.
#[must_use]
pub fn budget(target: &Target, measured: Result<&Measurement, &str>, command: &str) -> Section {
    let budget = &target.budget;
    let section = Section::new("budget", "Time and memory", command);
    let m = match measured {
        Ok(measurement) => measurement,
        Err(why) => return section.text(&format!("Not measured: {why}")),
    };
    let mut table = Grid::new(&format!("{}, {}", m.machine, m.compiler), &["what", "used", "declared", "used, %"]);
    let mut row = |what: &str, used: f64, declared: Option<u64>| {
        let share = declared.map_or_else(String::new, |declared| format!("{:.1}", 100.0 * used / declared as f64));
        let declared = declared.map_or_else(String::new, |declared| declared.to_string());
        table.push(vec![what.to_owned(), format!("{used:.0}"), declared, share]);
    };
    row("flash, bytes", m.flash as f64, budget.flash);
    row("of which code a tick can reach, bytes", m.tick_code as f64, None);
    row("RAM, bytes", m.ram as f64, budget.ram);
    row("of which State, bytes", m.state as f64, None);
    if let Some(bound) = m.stack_bound {
        row("stack of a tick, bytes (static bound)", bound as f64, budget.stack);
    }
    row("stack of a tick, bytes (seen)", m.stack_painted as f64, budget.stack);
    let mut stages = Grid::new(
        "Instructions of each stage, counted exactly; they are not cycles",
        &["stage", "mean", "fewest", "most", "calls"],
    );
    for stage in &m.stages {
        let whole = stage.name == "step";
        if whole {
            row("instructions of a tick, mean", stage.mean, budget.instructions);
        }
        let counts = [stage.min, stage.max, stage.calls].map(|count| count.to_string());
        let name = if whole { "whole tick".to_owned() } else { stage.name.clone() };
        stages.push([vec![name, format!("{:.0}", stage.mean)], counts.to_vec()].concat());
    }
    let budget =
        "target.budget.instructions is for the mean of a tick; the period has to hold the most expensive one, too.";
    section.text(budget).table(table).table(stages)
}

/// What identifies the bits: digests of the exercise on this host, and whether the emulated machine agrees.
pub struct Bits<'a> {
    /// Ticks of the exercise.
    pub ticks: usize,
    /// SHA-256 of its trace.
    pub trace: String,
    /// Digest of the state after the last tick.
    pub state: u64,
    /// The emulated machine's, if there is one, or why not.
    pub measured: Result<&'a Measurement, &'a str>,
}

/// Digests of spec, controller and the runs that were compared by bits.
#[must_use]
pub fn digests(compiled: &Compiled, bits: &Bits, command: &str) -> Section {
    let mut table = Grid::new("Digests", &["what", "value"]);
    let mut row = |what: &str, value: String| table.push(vec![what.to_owned(), value]);
    row("specgen", env!("CARGO_PKG_VERSION").to_owned());
    row("spec and records, SHA-256", compiled.ir.digest.clone());
    row("scalar", format!("f{}", compiled.ir.scalar.bits()));
    row("ticks of the exercise", bits.ticks.to_string());
    row("trace of the exercise on this host, SHA-256", bits.trace.clone());
    row("state after its last tick, on this host", format!("{:016x}", bits.state));
    match bits.measured {
        Ok(m) => {
            let verdict = m.first_difference.as_ref().map_or_else(
                || format!("the same bits in every word of {} ticks", m.ticks),
                |difference| format!("DIFFERS: {difference}"),
            );
            row(&format!("{} against this host", m.machine), verdict);
        }
        Err(why) => row("emulated machine against this host", format!("not compared: {why}")),
    }
    Section::new("digests", "Bit identity", command)
        .text("The same inputs give the same bits on the host and on the emulated microcontroller: outputs and the state's digest are compared word for word.")
        .table(table)
}
