//! What the step `wiring` shows: the check of the controller, gauges at rest and in all drives, lines and amplifiers in the noise.

use std::fmt::Write as _;

use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_identify::assembled::Plan;

use super::page::nano;
use super::plan::travel;
use super::state::{Peak, Rest, State};
use crate::place::AXES;

/// What nobody but the user can check.
const BY_HAND: &str = "    check by hand: each cable that is named here, from end to end; a common factor by one gauge beside a reference \
                       (`specgen identify gauge`)\n";

/// As text.
pub(super) fn text(compiled: &Compilation, plan: &Plan, state: &State) -> String {
    let mut text = lower::describe_wiring(&compiled.model, &compiled.ir.supervision) + BY_HAND;
    if let ([off, on], Some(travel)) = (&state.rest[..], travel(compiled, plan)) {
        gauges(off, &travel, compiled.model.sensor.range, &mut text);
        spectrum([off, on], state.mains, &mut text);
    }
    text
}

/// Offset of each gauge, and where the drives take it, in its range.
fn gauges(rest: &Rest, travel: &[[f64; 2]; 6], [low, high]: [f64; 2], text: &mut String) {
    let um = |length: f64| format!("{:.2}", length * 1e6);
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(text, "  gauges at rest, and in the drives of all steps, of {} to {} um:", um(low), um(high));
    for (gauge, (offset, [from, to])) in rest.gauges.iter().zip(travel).enumerate() {
        let [from, to] = [offset + from, offset + to];
        let beyond = if from < low || to > high { " BEYOND ITS RANGE: zero it, or widen sensor.range" } else { "" };
        let _ = writeln!(text, "    gauge {gauge}: {} um, {} to {} um{beyond}", um(*offset), um(from), um(to));
    }
}

/// What the amplifiers add to the noise, and the lines beside it.
fn spectrum([off, on]: [&Rest; 2], mains: f64, text: &mut String) {
    let added = |axis: usize| {
        let square = on.rms[axis] * on.rms[axis] - off.rms[axis] * off.rms[axis];
        if square > 0.0 { square.sqrt() } else { 0.0 }
    };
    let added: Vec<String> =
        (0..AXES.len()).map(|axis| format!("{} {}", AXES[axis], nano(axis, added(axis)))).collect();
    let _ = writeln!(text, "  the amplifiers add, rms: {}", added.join(", "));
    for (name, rest) in [("off", off), ("on", on)] {
        let shown: Vec<String> = rest.lines.iter().map(|line| named(line, mains)).collect();
        let lines = if shown.is_empty() { "none".to_owned() } else { shown.join(", ") };
        let _ = writeln!(text, "  lines with the amplifiers {name}: {lines}");
    }
}

fn named(Peak { axis, frequency, amplitude }: &Peak, mains: f64) -> String {
    let order = libm::round(frequency / mains);
    let is_mains = order >= 1.0 && (frequency - order * mains).abs() < 0.5;
    let source = if is_mains { ", mains" } else { "" };
    format!("{} {frequency:.1} Hz{source} {}", AXES[*axis], nano(*axis, *amplitude))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauges_beyond_their_range_and_lines_of_the_mains_are_named() {
        let line = |axis, frequency| Peak { axis, frequency, amplitude: 5e-9 };
        let rest =
            |rms, lines| Rest { rms: [rms; 6], mains: [0.0; 6], gauges: [1e-6, -9e-6, 0.0, 0.0, 0.0, 0.0], lines };
        let (off, on) = (rest(3e-9, vec![line(0, 100.25), line(5, 87.5)]), rest(5e-9, Vec::new()));
        let mut text = String::new();
        gauges(&off, &[[-48e-6, 50e-6]; 6], [-55e-6, 55e-6], &mut text);
        spectrum([&off, &on], 50.0, &mut text);
        for part in [
            "    gauge 0: 1.00 um, -47.00 to 51.00 um\n",
            "    gauge 1: -9.00 um, -57.00 to 41.00 um BEYOND ITS RANGE: zero it, or widen sensor.range\n",
            "rms: x 4.00 nm, ",
            "amplifiers off: x 100.2 Hz, mains 5.00 nm, rz 87.5 Hz 5.00 nrad\n",
            "amplifiers on: none\n",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
