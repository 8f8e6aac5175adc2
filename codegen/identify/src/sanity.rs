//! Whether a record is plausible as a measurement of any kind.

use super::columns::LineNumbers;
use super::findings::Findings;
use super::least_squares::dot;
use super::limits;
use super::statistics::{Standstill, centred, extent, median, micrometres, standstills};
use super::stretches::GAP;
use specgen_language::diagnostic::codes;

/// Least number of samples of a record.
pub const MIN_SAMPLES: usize = 100;
/// A longer record of reversal curves, s, has another unit, or drifts.
const LONGEST: f64 = 3600.0;
/// White noise of a command, relative to its range, is below this (rounding to five digits); that of a gauge is above.
const COMMANDED_NOISE: f64 = 3e-6;
/// A displacement range outside these bounds (m) is unusual for a piezo actuator and suggests another unit.
pub(crate) const PLAUSIBLE_RANGE: [f64; 2] = [50e-9, 2e-3];

/// Checks columns of finite numbers in s, V, m; `lines` has the line of each sample.
pub(crate) fn check(lines: &LineNumbers, columns: &[Vec<f64>; 3], findings: &mut Findings) {
    let [time, drive, displacement] = columns;
    if time.len() < MIN_SAMPLES {
        let until = time.last().map_or_else(String::new, |t| format!(" and ends at {t} s"));
        let message = format!("has {} samples{until}; at least {MIN_SAMPLES} are needed", time.len());
        findings.add(codes::RECORD_TOO_SHORT, None, message, "record more samples per reversal curve");
        return;
    }
    check_time(lines, time, findings);
    check_duration(time, findings);
    let moving = [(drive, "drive_V", 1.0), (displacement, "displacement_um", 1e6)]
        .into_iter()
        .all(|(column, name, unit)| check_not_constant(time, column, name, unit, findings));
    if moving {
        check_stuck(lines, time, drive, displacement, findings);
        check_sign(time, drive, displacement, findings);
        check_displacement_unit(time, displacement, findings);
    }
    if !findings.any_error() {
        limits::check(lines, time, drive, displacement, findings);
    }
}

/// Reversal curves take seconds to minutes; within an hour the temperature moves an actuator more than its hysteresis.
fn check_duration(time: &[f64], findings: &mut Findings) {
    let [first, .., last] = time else { return };
    let duration = last - first;
    if duration <= LONGEST || !duration.is_finite() {
        return;
    }
    let message = format!("goes on for {:.1} hours, by its column `time_s`", duration / 3600.0);
    findings.add(codes::RECORD_LONG, None, message, "if the column of times is in ms, name it `time_ms`");
}

pub(crate) fn check_time(lines: &LineNumbers, time: &[f64], findings: &mut Findings) {
    if let Some(k) = time.iter().position(|t| !(t - time[0]).is_finite()) {
        let message = format!("time goes from {} s to {} s, more than a number holds", time[0], time[k]);
        let help = "give `--rate HZ` with the sampling rate in Hz";
        findings.add(codes::RECORD_TIME, Some(lines.at(k)), message, help);
        return;
    }
    let mut intervals: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let mut increasing = true;
    for (k, dt) in intervals.iter().enumerate().filter(|(_, dt)| **dt <= 0.0) {
        increasing = false;
        let message = format!("time goes from {} s to {} s ({dt:e} s); it must increase", time[k], time[k + 1]);
        let help = if *dt == 0.0 {
            "delete the repeated sample, write the time with more digits, or give `--rate HZ`"
        } else {
            "sort or re-record; is the time column the right one?"
        };
        findings.add(codes::RECORD_TIME, Some(lines.at(k + 1)), message, help);
    }
    if !increasing {
        return;
    }
    let gap = GAP * median(&mut intervals);
    for (k, w) in time.windows(2).enumerate().filter(|(_, w)| w[1] - w[0] > gap) {
        let (start, end, missing) = (w[0], w[1], GAP * (w[1] - w[0]) / gap);
        let message = format!("nothing was recorded between {start} s and {end} s ({missing:.0} sampling intervals)");
        let help = "record without gaps: a reversal of the drive may be missing";
        findings.add(codes::RECORD_GAP, Some(lines.at(k + 1)), message, help);
    }
}

/// `unit`: number of the units in `name` in one of the column's.
fn check_not_constant(time: &[f64], column: &[f64], name: &str, unit: f64, findings: &mut Findings) -> bool {
    let (low, high) = extent(column);
    if low < high {
        return true;
    }
    let shown = low * unit;
    let message = format!("`{name}` is {shown} in every sample, from {} s to {} s", time[0], time[time.len() - 1]);
    let help = "record while the drive runs through its range; is the channel connected?";
    findings.add(codes::RECORD_CONSTANT, None, message, help);
    false
}

fn check_stuck(lines: &LineNumbers, time: &[f64], drive: &[f64], displacement: &[f64], findings: &mut Findings) {
    let (bottom, top) = extent(displacement);
    let swapped = look_swapped(drive, displacement);
    for Standstill { first, run, input: [low, high] } in standstills(drive, displacement, 1) {
        let (value, from, to) = (displacement[first], time[first], time[first + run - 1]);
        let um = micrometres(value);
        if swapped {
            let message = format!(
                "from {from} s to {to} s `displacement_um` stays at {um:.4} while `drive_V` goes through {low} to {high} with noise on it"
            );
            let help = "the columns `drive_V` and `displacement_um` seem to be swapped";
            findings.add(codes::COLUMNS_SWAPPED, Some(lines.at(first)), message, help);
            return;
        }
        let what = if value == bottom || value == top { "is limited at" } else { "is stuck at" };
        let message = format!(
            "from {from} s to {to} s the displacement {what} {um} um for {run} samples while the drive goes through {low} V to {high} V"
        );
        let help = "check the range and the connection of the displacement sensor";
        findings.add(codes::RECORD_STUCK, Some(lines.at(first)), message, help);
    }
}

/// Whether the displacement looks like a command, and the drive like a measurement.
pub(crate) fn look_swapped(drive: &[f64], displacement: &[f64]) -> bool {
    is_commanded(displacement) && !is_commanded(drive)
}

/// Whether a column looks like a command and not like a measurement: it has almost no noise. From fourth differences,
/// which remove ramps and almost all of a sine.
fn is_commanded(column: &[f64]) -> bool {
    let (low, high) = extent(column);
    let mut fourth: Vec<f64> =
        column.windows(5).map(|w| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs()).collect();
    // The median of |N(0, s)| is 0.6745 s; fourth differences of white noise have the variance 70 σ².
    median(&mut fourth) / (0.674_489_75 * 70f64.sqrt()) < COMMANDED_NOISE * (high - low)
}

/// Displacement must grow with the drive: a Preisach model with non-negative weights cannot do otherwise. The message
/// names the part of the record that shows it best.
fn check_sign(time: &[f64], drive: &[f64], displacement: &[f64], findings: &mut Findings) {
    let correlation = correlation(drive, displacement);
    let butterfly = is_butterfly(drive, displacement);
    if correlation >= 0.5 && !butterfly || correlation.is_nan() {
        return;
    }
    let at = |value: f64| drive.iter().position(|u| *u == value).unwrap_or(0);
    let (low, high) = extent(drive);
    let (a, b) = (at(low).min(at(high)), at(low).max(at(high)));
    let (start, end, drive_before, drive_after) = (time[a], time[b], drive[a], drive[b]);
    let (before, after) = (displacement[a] * 1e6, displacement[b] * 1e6);
    let shown = format!(
        "between {start} s and {end} s the drive goes from {drive_before} V to {drive_after} V and the displacement from {before:.4} um to {after:.4} um"
    );
    if correlation < -0.5 && !butterfly {
        let message = format!("the displacement falls when the drive rises (correlation {correlation:.2}): {shown}");
        findings.add(codes::RECORD_RELATION, None, message, "change the sign of one of the two columns");
    } else if butterfly {
        let message = format!(
            "the displacement turns back within the range of the drive, a butterfly loop: the drive goes beyond the coercive voltage, where the polarisation turns over; {shown}"
        );
        let help =
            "record again with a drive that stays on one side of the coercive voltage; a table cannot hold a butterfly";
        findings.add(codes::RECORD_RELATION, None, message, help);
    } else {
        let message = format!(
            "the displacement hardly follows the drive (correlation {correlation:.2}; a piezo actuator shows more than 0.9): {shown}"
        );
        let help = "check that `drive_V` and `displacement_um` hold what their names say";
        findings.add(codes::RECORD_RELATION, None, message, help);
    }
}

fn correlation(drive: &[f64], displacement: &[f64]) -> f64 {
    let (u, y) = (centred(drive.to_vec()), centred(displacement.to_vec()));
    dot(&u, &y) / (dot(&u, &u) * dot(&y, &y)).sqrt()
}

/// Parts of the drive's range whose mean displacements show a butterfly, and the least share of their extent on each side
/// of its turn.
const PARTS: usize = 24;
const WING: f64 = 0.1;

/// Whether the mean displacement turns back within the range of the drive, wherever it does.
fn is_butterfly(drive: &[f64], displacement: &[f64]) -> bool {
    let (low, high) = extent(drive);
    let mut sums = [[0.0; 2]; PARTS];
    for (u, y) in drive.iter().zip(displacement) {
        // Saturates at the upper end.
        let part = ((u - low) / (high - low) * PARTS as f64) as usize;
        let [sum, count] = &mut sums[if part < PARTS { part } else { PARTS - 1 }];
        *sum += y;
        *count += 1.0;
    }
    let means: Vec<f64> = sums.iter().filter(|[_, count]| *count > 0.0).map(|[sum, count]| sum / count).collect();
    let ((bottom, top), (least, most)) = (extent(&means), extent(displacement));
    // Of noise, means are much closer together than samples.
    let follows = top - bottom > 0.5 * (most - least);
    let turns_at = |end: f64| {
        let at = means.iter().position(|mean| *mean == end).unwrap_or(0);
        let is_wing = |part: &[f64]| part.iter().any(|mean| (mean - end).abs() > WING * (top - bottom));
        is_wing(&means[..at]) && is_wing(&means[at..])
    };
    follows && (turns_at(bottom) || turns_at(top))
}

fn check_displacement_unit(time: &[f64], displacement: &[f64], findings: &mut Findings) {
    let (low, high) = extent(displacement);
    let range = high - low;
    let um = range * 1e6;
    let at = |value: f64| displacement.iter().position(|y| *y == value).map_or(0.0, |k| time[k]);
    let times = format!("least at {} s, most at {} s", at(low), at(high));
    if range > PLAUSIBLE_RANGE[1] {
        let message =
            format!("the displacement covers {um:.0} um ({times}), too much for a piezo actuator: is it in nm?");
        findings.add(codes::RECORD_UNIT, None, message, "convert the column to micrometres");
    } else if range < PLAUSIBLE_RANGE[0] {
        let message = format!("the displacement covers only {um:.2e} um ({times}): is it in mm or m?");
        findings.add(codes::RECORD_UNIT, None, message, "convert the column to micrometres");
    }
}
