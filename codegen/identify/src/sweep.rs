//! Warns if the sweep of a record does not distinguish hysteresis from other effects.

use super::findings::Findings;
use super::record::Record;
use super::regressor::Plane;
use super::report::Report;
use super::selection::RecordSpan;
use super::statistics::median;
use super::time_unit;
use specgen_language::diagnostic::codes;

/// A lag that widens the loop by this fraction of the range causes a warning.
const WIDENING: f64 = 0.01;
/// The assumed lag: one sampling interval, but at most the lag of amplifiers and gauges, s.
const LONGEST_LAG: f64 = 1e-3;
/// Curves differ if their ends differ by this many noise floors.
const ABOVE_NOISE: f64 = 2.0;
/// Curves whose reversals are within this fraction of the range repeat one curve.
const SAME_LEVEL: f64 = 0.005;

/// Checks the rate of the sweep against sampling and dead time, and the spacing of the curves against noise.
pub(crate) fn check(plane: &Plane, record: &Record, used: &RecordSpan, report: &Report, findings: &mut Findings) {
    let span = plane.range[1] - plane.range[0];
    let gain = report.displacement_range / span;
    let mut intervals: Vec<f64> = record.time.windows(2).map(|w| w[1] - w[0]).collect();
    let interval = median(&mut intervals);
    let (rate, at) = fastest(record, used);
    time_unit::check(report, span, findings);
    let lag = if interval < LONGEST_LAG { interval } else { LONGEST_LAG };
    let unknown = !report.dead_time_basis.starts_with("estimated") && report.dead_time == 0.0;
    if rate * interval > plane.interval() {
        let message = format!(
            "from {} s on the drive crosses more than one grid interval per sample ({:.3} V against {:.3} V): the sweep is too fast for the sampling",
            record.time[at],
            rate * interval,
            plane.interval()
        );
        findings.add(
            codes::SWEEP_TOO_FAST,
            None,
            message,
            "sweep more slowly, sample faster, or choose a coarser grid",
        );
    } else if unknown && rate * lag > WIDENING * span {
        let message = format!(
            "from {} s on the drive runs at {rate:.0} V/s, where a dead time of {:.3} ms alone widens the loop by {:.1} nm; any dead time then counts as hysteresis (dead time {})",
            record.time[at],
            lag * 1e3,
            2.0 * rate * lag * gain * 1e9,
            report.dead_time_basis
        );
        findings.add(
            codes::SWEEP_TOO_FAST,
            None,
            message,
            "sweep more slowly, or record branches of at least two rates so that the dead time can be identified",
        );
    }
    let mut turns: Vec<f64> = used.branches.iter().filter(|b| !b.rising).map(|b| record.drive[b.first]).collect();
    turns.sort_unstable_by(f64::total_cmp);
    let mut spacing: Vec<f64> = turns.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > SAME_LEVEL * span).collect();
    let between = median(&mut spacing);
    if between > 0.0 && between * gain < ABOVE_NOISE * report.noise_floor {
        let message = format!(
            "neighbouring curves turn back {between:.3} V apart, {:.2} nm of displacement, while the noise is {:.2} nm rms: what lies between them is noise",
            between * gain * 1e9,
            report.noise_floor * 1e9
        );
        findings.add(
            codes::CURVES_IN_NOISE,
            None,
            message,
            "record fewer curves with more samples each, or average several sweeps",
        );
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
