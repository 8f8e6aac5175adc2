//! How long the tick of a board takes, held against its period, in words.

use std::fmt::Write as _;

use specgen_compiler::compile::Compiled;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_toolchain::time::Estimate;

/// What is to be said about it.
pub fn finding(compiled: &Compiled, estimate: &Estimate) -> Option<Diagnostic> {
    let Estimate { board, worst, period, shortest, .. } = estimate;
    let (code, verdict) = if estimate.too_long() {
        (codes::TICK_TOO_LONG, "is longer than")
    } else if estimate.tight() {
        (codes::TICK_TIGHT, "leaves less than a fifth of")
    } else {
        return None;
    };
    let most = estimate.parts.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let most = most.map_or(String::new(), |(name, time)| format!("; most of it: {name}, {time:.1} us"));
    Some(Diagnostic::at(
        &compiled.model.spans,
        &["timing.period", "timing"],
        code,
        format!("a tick on {board} takes {worst:.1} us (modelled), which {verdict} the period of {period:.1} us{most}"),
        if estimate.too_long() {
            format!("write, in [timing]: period = \"{shortest} us\", {:.1} kHz, or more", 1e3 / shortest)
        } else {
            format!("write, in [timing]: period = \"{} us\" or more, or give the tick less to do", estimate.roomy())
        },
    ))
}

/// Where the time goes.
pub fn text(estimate: &Estimate) -> String {
    let Estimate { worst, period, core, law, shortest, .. } = estimate;
    let mut out = format!(
        "  longest tick  {worst:.1} us of {period:.1} (modelled, {core:.0} MHz), {:.0} % room; {shortest} us would do: {:.1} kHz\n",
        100.0 * (1.0 - worst / period),
        1e3 / shortest
    );
    for (name, time) in &estimate.parts {
        let more = match *name {
            "law" => format!(", {} cycles of {} instructions", law.cycles, law.instructions),
            _ => String::new(),
        };
        // Writing to a String cannot fail.
        let _ = writeln!(out, "    {name:<22} {time:>6.1} us{more}");
    }
    out
}
