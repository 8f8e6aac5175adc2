//! Compares the modelled time of a board's tick with its period; text report.

use specgen_compiler::compile::Compilation;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_toolchain::time::Estimate;

/// The finding about the time of a tick, if any.
pub fn finding(compiled: &Compilation, estimate: &Estimate) -> Option<Diagnostic> {
    let Estimate { board, worst, period, shortest, parts, .. } = estimate;
    let most = parts.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let most = most.map_or(String::new(), |(name, time)| format!("; largest part: {name}, {time:.1} us"));
    let budget = compiled.model.target.budget.time.map(|seconds| seconds * 1e6);
    if let Some(budget) = budget.filter(|budget| worst > budget && !estimate.too_long()) {
        return Some(Diagnostic::at(
            &compiled.model.spans,
            &["target.budget.time"],
            codes::TICK_TOO_LONG,
            format!("a tick on {board} takes {worst:.1} us (modelled), longer than its budget of {budget:.1} us{most}"),
            format!("write, in [target.budget]: time = \"{shortest} us\" or more, or reduce the work per tick"),
        ));
    }
    let (code, verdict) = if estimate.too_long() {
        (codes::TICK_TOO_LONG, "is longer than")
    } else if estimate.tight() {
        (codes::TICK_TIGHT, "leaves less than a fifth of")
    } else {
        return None;
    };
    Some(Diagnostic::at(
        &compiled.model.spans,
        &["timing.period", "timing"],
        code,
        format!("a tick on {board} takes {worst:.1} us (modelled): this {verdict} the period of {period:.1} us{most}"),
        if estimate.too_long() {
            format!("write, in [timing]: period = \"{shortest} us\", {:.1} kHz, or more", 1e3 / shortest)
        } else {
            format!("write, in [timing]: period = \"{} us\" or more, or reduce the work per tick", estimate.roomy())
        },
    ))
}

/// The time of a tick by part.
pub fn text(estimate: &Estimate) -> String {
    let Estimate { worst, period, core, law, shortest, .. } = estimate;
    let (margin, rate) = (100.0 * (1.0 - worst / period), 1e3 / shortest);
    let mut out = format!(
        "  longest tick  {worst:.1} us of {period:.1} (modelled, {core:.0} MHz), {margin:.0} % margin; shortest period {shortest} us ({rate:.1} kHz)\n"
    );
    for (name, time) in &estimate.parts {
        let more = match *name {
            "law" => format!(
                ", {} cycles; mean of {} ticks: {} instructions, {} cycles",
                law.longest.cycles, law.ticks, law.mean.instructions, law.mean.cycles
            ),
            _ => String::new(),
        };
        // Writing to a String cannot fail.
        out += &format!("    {name:<22} {time:>6.1} us{more}\n");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_compiler::compile::compile_source;
    use specgen_language::SpecSource;
    use specgen_language::diagnostic::Severity;
    use specgen_toolchain::time::Law;
    use specgen_toolchain::trace::Transfers;

    fn spec(budget: &str) -> Compilation {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml");
        let mut source = SpecSource::read(&path).unwrap();
        source.text = source.text.replace("[target.budget]\n", &format!("[target.budget]\n{budget}\n"));
        compile_source(source).unwrap()
    }

    fn estimate(worst: f64, shortest: f64) -> Estimate {
        let parts = vec![("law", worst)];
        let (law, moved) = (Law::default(), Transfers::default());
        Estimate { board: "board", period: 100.0, core: 400.0, worst, parts, law, moved, shortest }
    }

    #[test]
    fn a_time_budget_below_the_period_is_checked_and_the_suggested_one_is_accepted() {
        let (tight, tick) = (spec("time = \"40 us\""), estimate(47.3, 49.0));
        let found = finding(&tight, &tick).unwrap();
        assert_eq!((found.key.as_str(), found.severity), ("target.budget.time", Severity::Error));
        assert!(found.message.contains("47.3 us") && found.message.contains("budget of 40.0 us"), "{}", found.message);
        assert!(found.help.contains("time = \"49 us\""), "{}", found.help);
        assert!(finding(&spec("time = \"49 us\""), &tick).is_none());
        assert!(finding(&spec(""), &tick).is_none());
        // If the tick exceeds the period as well, the period is reported.
        let late = finding(&tight, &estimate(101.0, 104.0)).unwrap();
        assert!(late.message.contains("the period of 100.0 us"), "{}", late.message);
    }
}
