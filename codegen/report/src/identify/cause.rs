//! Text about the causes of the residual of an identified or predicted record.

use specgen_identify::{self as identify, Cause};

/// The main cause, the share of each, and the drift.
pub(super) fn account(cause: &Cause) -> String {
    let shares: Vec<String> =
        cause.shares.iter().map(|(s, share)| format!("{} {:.0} %", short(*s), share * 100.0)).collect();
    let which = match (cause.main, cause.hum) {
        (identify::Source::DeadTime, _) => format!(" of {:.3} ms", cause.rate_delay * 1e3),
        (identify::Source::Hum, Some(frequency)) => format!(" at {frequency:.1} Hz"),
        _ => String::new(),
    };
    let (main, shares, drift) = (cause.main.name(), shares.join(", "), cause.drift_rms * 1e9);
    format!(
        "mainly {main}{which} (shares of the mean square: {shares}); a linear drift of {drift:.2} nm rms was removed before"
    )
}

fn short(source: identify::Source) -> &'static str {
    match source {
        identify::Source::Drift => "drift",
        identify::Source::DeadTime => "dead time",
        identify::Source::Resonance => "resonance",
        identify::Source::BentDrift => "bent drift",
        identify::Source::Creep => "creep",
        identify::Source::Hum => "hum",
        identify::Source::Noise => "noise",
        identify::Source::Model => "model",
    }
}
