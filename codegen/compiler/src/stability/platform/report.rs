//! The design as text for `specgen check`.

use core::f64::consts::TAU;
use std::fmt::Write as _;

use super::Design;
use super::damping::{ActiveDamping, DampedMode, SLOW};
use super::law::{LoopKind, Tuning};

/// Frequencies at which the border of structural modes is listed, over the lowest of the declared range.
const MULTIPLES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.0];

/// A few lines: modes, gains, and a table of margins.
pub fn describe(design: &Design) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let frequencies: Vec<String> = design.modes.iter().map(|mode| format!("{:.1}", mode.frequency / TAU)).collect();
    let (hertz, first, last) = (frequencies.join(", "), design.modes[0].damping_ratio, design.modes[5].damping_ratio);
    let _ = writeln!(text, "  platform modes: {hertz} Hz, damping ratio {first:.4} to {last:.4}");
    let whose = if design.lead_given { "from the spec" } else { "the delay from command to pose" };
    let _ = writeln!(text, "  lead: {:.4} ms, {whose}", design.lead * 1e3);
    let notch = if design.notch.is_some() { "with the modal notch" } else { "without a notch" };
    let _ = writeln!(
        text,
        "  level estimate stable up to {:.1} rad/s {notch}; used {:.1}, drift {:.2} rad/s",
        design.bandwidth_limit, design.combined.level_bandwidth, design.combined.drift_bandwidth
    );
    let _ = write!(text, "{}", gains("gains of P/F ewma, pcc", &design.combined));
    let _ = write!(text, "{}", gains("gains of P, P/F invhys", &design.position));
    if let Some(damping) = &design.damping {
        text.push_str(&describe_damping(design, damping));
    }
    let touching = if design.touching { "free and touching the declared work piece" } else { "without contact" };
    let _ = writeln!(text, "  every control mode, checked {touching}:");
    let _ = writeln!(
        text,
        "  {:<12}{:>9}{:>8}{:>8}{:>16}{:>12}{:>22}",
        "mode", "radius", "λ <", "gain ×", "delay, ticks", "τ max, ms", "least damped"
    );
    for one in &design.margins {
        let or =
            |value: Option<f64>, none: &str, digits: usize| value.map_or(none.to_owned(), |x| format!("{x:.digits$}"));
        let least = one.modes.iter().min_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
        let least = least.map_or("-".to_owned(), |mode| format!("{:.0} Hz, {:.4}", mode.frequency, mode.damping_ratio));
        let (law, radius, ratio) = (one.law.to_string(), one.spectral_radius, or(one.gain_ratio_limit, "> 10", 2));
        let (gain, delay) = (or(one.gain_margin, "-", 2), or(one.delay_margin_ticks, "> 5", 2));
        let time = or(one.settling.map(|time| time * 1e3), "-", 1);
        let _ = writeln!(text, "  {law:<12}{radius:>9.5}{ratio:>8}{gain:>8}{delay:>16}{time:>12}{least:>22}");
    }
    text.push_str(&structure(design));
    text
}

/// For each control mode and kind of structural mode: the smallest ζ with which the loop is stable.
fn structure(design: &Design) -> String {
    let from = design.structure_from;
    let shown = |ratio: f64| if ratio > 0.0 { format!("{ratio:.4}") } else { "any".to_owned() };
    let mut text = format!(
        "  smallest damping ratio of a structural mode with which the loop is stable, at, Hz:\n  {:<12}{:<7}",
        "mode", "kind"
    );
    let frequencies = MULTIPLES.map(|multiple| multiple * from);
    text.extend(frequencies.iter().map(|frequency| format!("{frequency:>9.0}")));
    let _ = writeln!(text, "{:>22}", format!("most from {from:.0} Hz on"));
    for one in design.margins.iter().filter(|one| LoopKind::of(one.law) != LoopKind::Open) {
        for border in &one.borders {
            let _ = write!(text, "  {:<12}{:<7}", one.law.to_string(), border.kind);
            text.extend(frequencies.iter().map(|frequency| format!("{:>9}", shown(border.within(*frequency)))));
            let worst = border.worst(from).map_or("any".to_owned(), |[at, ratio]| format!("{ratio:.4} at {at:.0} Hz"));
            let _ = writeln!(text, "{worst:>22}");
        }
    }
    text
}

fn gains(name: &str, tuning: &Tuning) -> String {
    let list = |values: &[f64; 6]| {
        let shown: Vec<String> = values.iter().map(|value| format!("{value:.3e}")).collect();
        shown.join(" ")
    };
    let mut text = format!("  {name}: k_p {} N/m, N m/rad\n", list(&tuning.proportional));
    let indent = " ".repeat(name.len() + 4);
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{indent}k_I {} N/(m s), N m/(rad s)", list(&tuning.integral));
    if tuning.derivative != [0.0; 6] {
        let _ = writeln!(text, "{indent}k_v {} N s/m, N m s/rad", list(&tuning.derivative));
    }
    text
}

/// Effect of active damping, mode by mode.
pub fn describe_damping(design: &Design, damping: &ActiveDamping) -> String {
    let lowest = design.modes[0].frequency / TAU;
    let (first, second, third) = (lowest / SLOW[0], lowest / SLOW[1], lowest / SLOW[2]);
    let mut text = format!(
        "  active damping in P/F:   peak of       |S|             |S| at {first:.1}, {second:.1}, {third:.0} Hz\n    mode                 compliance   largest   worst            (without)\n"
    );
    for (mode, found) in design.modes.iter().zip(&damping.modes) {
        // Writing to a String cannot fail.
        let _ = match found {
            Some(DampedMode { compliance, sensitivity: [nominal, worst], slow, without, .. }) => writeln!(
                text,
                "    {:>7.1} Hz            {compliance:>6.3} x    {nominal:>6.2}  {worst:>6.2}   {:.3} {:.3} {:.2} ({:.3} {:.3} {:.2})",
                mode.frequency / TAU,
                slow[0],
                slow[1],
                slow[2],
                without[0],
                without[1],
                without[2]
            ),
            None => writeln!(text, "    {:>7.1} Hz   too fast for the period", mode.frequency / TAU),
        };
    }
    text
}
