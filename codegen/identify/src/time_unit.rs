//! Whether the time of a record has the unit in its name, from the results of the identification.

use super::cause::Source;
use super::findings::Findings;
use super::report::Report;
use super::statistics::micrometres;
use specgen_language::diagnostic::codes;

/// The longest dead time of a spec, s: amplifier, actuator and gauge together have less.
const LONGEST: f64 = 10e-3;
/// No amplifier and no piezo actuator crosses its range in a shorter time, s.
const FASTEST: f64 = 1e-4;

const SLOWER: &str = "if the column of times is in ms, name it `time_ms`; or give `--rate HZ`";
const FASTER: &str = "if the column of times is in s, name it `time_s`; or give `--rate HZ`";

/// For a record whose table covers `span` (V).
pub(crate) fn check(report: &Report, span: f64, findings: &mut Findings) {
    let rate = report.fastest;
    let lag = report.dead_time + report.cause.rate_delay;
    if lag > LONGEST && report.cause.main == Source::DeadTime && report.dead_time_basis.starts_with("not credible") {
        let message = format!(
            "the displacement seems to lag the drive by {:.0} ms, which no amplifier, actuator or gauge does",
            lag * 1e3
        );
        findings.add(codes::RECORD_LONG, None, message, SLOWER);
    }
    if rate * FASTEST > span {
        let message = format!(
            "the drive crosses its range in {} µs, which no amplifier and no actuator follows",
            micrometres(span / rate)
        );
        findings.add(codes::RECORD_LONG, None, message, FASTER);
    }
}

/// For records whose models need `dead_time` (s).
pub(crate) fn check_dead_time(dead_time: f64, findings: &mut Findings) {
    if dead_time > LONGEST {
        let message =
            format!("the estimated dead time is {:.0} ms, which no amplifier, actuator or gauge has", dead_time * 1e3);
        findings.add(codes::RECORD_LONG, None, message, SLOWER);
    }
}
