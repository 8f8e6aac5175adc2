//! Warns if the sweep of a record does not distinguish hysteresis from other effects, or its time has a wrong unit.

use super::cause::Source;
use super::findings::Findings;
use super::record::Record;
use super::regressor::Plane;
use super::report::Report;
use super::selection::RecordSpan;
use super::statistics::{median, median_interval, micrometres};
use specgen_language::diagnostic::codes;

/// A lag that widens the loop by this fraction of the range causes a warning.
const WIDENING: f64 = 0.01;
/// The assumed lag: one sampling interval, but at most the lag of amplifiers and gauges, s.
const LONGEST_LAG: f64 = 1e-3;
/// Curves differ if their ends differ by this many noise floors.
const ABOVE_NOISE: f64 = 2.0;
/// Curves whose reversals are within this fraction of the range repeat one curve.
const SAME_LEVEL: f64 = 0.005;

/// The longest dead time of a spec, s: amplifier, actuator and gauge together have less.
const LONGEST_DEAD_TIME: f64 = 10e-3;
/// No amplifier and no piezo actuator crosses its range in a shorter time, s.
const SHORTEST_SWEEP: f64 = 1e-4;

const SLOWER: &str = "if the column of times is in ms, name it `time_ms`; or give `--rate HZ`";
const FASTER: &str = "if the column of times is in s, name it `time_s`; or give `--rate HZ`";

/// Checks the rate of the sweep against sampling and dead time, and the spacing of the curves against noise.
pub(crate) fn check(plane: &Plane, record: &Record, used: &RecordSpan, report: &Report, findings: &mut Findings) {
    let span = plane.range[1] - plane.range[0];
    let gain = report.displacement_range / span;
    let (rate, at) = fastest(record, used);
    let own = record.spans().find(|span| span.contains(&at)).unwrap_or(0..record.time.len());
    let interval = median_interval(&record.time[own]);
    check_time_unit(report, span, findings);
    let lag = if interval < LONGEST_LAG { interval } else { LONGEST_LAG };
    let unknown = !report.dead_time_basis.starts_with("estimated") && report.dead_time == 0.0;
    if rate * interval > plane.interval() {
        let (time, per_sample, allowed) = (record.time[at], rate * interval, plane.interval());
        let message = format!(
            "from {time} s on the drive crosses more than one grid interval per sample ({per_sample:.3} V against {allowed:.3} V): the sweep is too fast for the sampling"
        );
        let help = "sweep more slowly, sample faster, or choose a coarser grid";
        findings.add(codes::SWEEP_TOO_FAST, None, message, help);
    } else if unknown && rate * lag > WIDENING * span {
        let (time, delay, wider) = (record.time[at], lag * 1e3, 2.0 * rate * lag * gain * 1e9);
        let basis = &report.dead_time_basis;
        let message = format!(
            "from {time} s on the drive runs at {rate:.0} V/s, where a dead time of {delay:.3} ms alone widens the loop by {wider:.1} nm; any dead time then counts as hysteresis (dead time {basis})"
        );
        let help =
            "sweep more slowly, or record branches of at least two rates so that the dead time can be identified";
        findings.add(codes::SWEEP_TOO_FAST, None, message, help);
    }
    let mut turns: Vec<f64> = used.branches.iter().filter(|b| !b.rising).map(|b| record.drive[b.first]).collect();
    turns.sort_unstable_by(f64::total_cmp);
    let mut spacing: Vec<f64> = turns.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > SAME_LEVEL * span).collect();
    let between = median(&mut spacing);
    if between > 0.0 && between * gain < ABOVE_NOISE * report.noise_floor {
        let (way, noise) = (between * gain * 1e9, report.noise_floor * 1e9);
        let message = format!(
            "neighbouring curves turn back {between:.3} V apart, {way:.2} nm of displacement, while the noise is {noise:.2} nm rms: what lies between them is noise"
        );
        let help = "record fewer curves with more samples each, or average several sweeps";
        findings.add(codes::CURVES_IN_NOISE, None, message, help);
    }
}

/// Mean rate of the drive in the fastest branch (V/s), and that branch's first sample.
pub(crate) fn fastest(record: &Record, used: &RecordSpan) -> (f64, usize) {
    let mut fastest = (0.0, 0);
    for branch in &used.branches {
        let last = branch.end - 1;
        // A jump is not a sweep; its samples have no weight.
        if record.weightless[branch.first + 1..branch.end].iter().all(|w| *w) {
            continue;
        }
        let rate =
            ((record.drive[last] - record.drive[branch.first]) / (record.time[last] - record.time[branch.first])).abs();
        if rate > fastest.0 {
            fastest = (rate, branch.first);
        }
    }
    fastest
}

/// Whether the time of a record has the unit in its name, from the results of its identification over `span` (V).
fn check_time_unit(report: &Report, span: f64, findings: &mut Findings) {
    let rate = report.fastest;
    let lag = report.dead_time + report.cause.rate_delay;
    if lag > LONGEST_DEAD_TIME
        && report.cause.main == Source::DeadTime
        && report.dead_time_basis.starts_with("not credible")
    {
        let message = format!(
            "the displacement seems to lag the drive by {:.0} ms, which no amplifier, actuator or gauge does",
            lag * 1e3
        );
        findings.add(codes::RECORD_LONG, None, message, SLOWER);
    }
    if rate * SHORTEST_SWEEP > span {
        let message = format!(
            "the drive crosses its range in {} µs, which no amplifier and no actuator follows",
            micrometres(span / rate)
        );
        findings.add(codes::RECORD_LONG, None, message, FASTER);
    }
}

/// The same for records whose models need `dead_time` (s).
pub(crate) fn check_dead_time(dead_time: f64, findings: &mut Findings) {
    if dead_time > LONGEST_DEAD_TIME {
        let message =
            format!("the estimated dead time is {:.0} ms, which no amplifier, actuator or gauge has", dead_time * 1e3);
        findings.add(codes::RECORD_LONG, None, message, SLOWER);
    }
}
