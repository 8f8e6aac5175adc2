//! Corners of a table of poses: inside the table, at its start and end, and where a repeated one starts again.
//!
//! The bend of a row is its second difference, y₋ − 2 y + y₊; over the time of a row it is the change of speed there. A table that
//! runs once is at rest before its first row and after its last; the last row of a repeated table is followed by the first. A corner is
//! a bend much larger than those around it that makes the lowest mode ring by more than the resolution of a gauge.

use core::ops::Range;

use super::{AXES, amount};
use crate::figure::figure;
use crate::stability::platform::{ModalBasis, RestDynamics};
use specgen_identify::waveform::Waveform;
use specgen_language::diagnostic::{Diagnostic, Place, codes};
use specgen_language::model::Model;

/// Least ratio of a corner's bend to those around it, and of a jump's step to those around it.
const STANDS_OUT: f64 = 4.0;
/// Steps below these do not count, m and rad.
const NO_STEP: [f64; 6] = [5e-9, 5e-9, 5e-9, 50e-9, 50e-9, 50e-9];
/// Offsets of the rows that a bend is compared with. Not the adjacent ones: a step from row to row bends both.
const AROUND: [isize; 4] = [-3, -2, 2, 3];
/// Ringing below these does not count, m and rad.
const NO_RING: [f64; 6] = [10e-9, 10e-9, 10e-9, 100e-9, 100e-9, 100e-9];
/// A radian weighs as much as 0.1 m, its lever arm at a leg.
const WEIGHTS: [f64; 6] = [1.0, 1.0, 1.0, 0.1, 0.1, 0.1];

/// The bend at a row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Corner {
    row: usize,
    axis: usize,
    /// Change of the speed, m/s and rad/s.
    rate: f64,
    /// Ringing of the lowest mode due to it, m and rad.
    ring: f64,
}

/// A warning about the sharpest corner of a table, whose rows are `period` (s) apart; none without corners.
pub(super) fn warning(model: &Model, name: &str, waveform: &Waveform, period: f64, repeat: bool) -> Option<Diagnostic> {
    let platform = crate::lower::platform(model).ok()?;
    let basis = ModalBasis::of(&RestDynamics::of(&platform), model.actuator.axial_stiffness)?;
    // A jump has a warning of its own.
    let jump = stands_out(waveform).map_or(0..0, |step| step.row - 1..step.row + 1);
    let ringing = Ringing { period, mode: basis.frequencies[0] };
    let Corner { row, axis, rate, .. } = sharpest(&waveform.rows, repeat, &ringing, jump)?;
    let last = waveform.rows.len() - 1;
    let speed = format!("{}/s", amount(axis, rate));
    let (place, help) = if repeat && (row == 0 || row == last) {
        let step = amount(axis, waveform.rows[0][axis] - waveform.rows[last][axis]);
        (
            format!(
                "where it starts again: {} steps by {step} to the first row, and its speed changes by {speed}",
                AXES[axis]
            ),
            "the platform rings at every repetition: give whole cycles without repeating the first row at the end, or leave repeat out",
        )
    } else {
        let place = match row {
            0 => "at its start from rest",
            row if row == last => "at its end to rest",
            _ => "here",
        };
        (
            format!("{place}, where the speed of {} changes by {speed}", AXES[axis]),
            "each corner makes the platform ring: expect errors there, or round the path over some rows",
        )
    };
    let message = format!("trajectory \"{name}\" has corners, the sharpest {place}");
    let line = waveform.lines.get(row).copied();
    Some(Diagnostic::in_file(&waveform.shown_as, line, codes::TRAJECTORY_CORNERS, message, help))
}

/// A step of a table that is much larger than those around it: a jump below the speed limit.
pub fn step(waveform: &Waveform) -> Option<Diagnostic> {
    let Step { row, axis, step, around } = stands_out(waveform)?;
    let place = Place::File { path: waveform.shown_as.clone(), line: waveform.lines.get(row).copied() };
    let (name, step, unit) = (AXES[axis], figure(step * 1e6), if axis < 3 { "um" } else { "urad" });
    let around = figure(around * 1e6);
    let message = format!("{name} steps by {step} {unit} here, but by at most {around} in the rows around");
    let help =
        "the platform rings after a jump: if it is between two pieces, join them, or spread the step over some rows";
    Some(Diagnostic::new(codes::WAVEFORM_STEP, "trajectory", place, message, help))
}

/// A step from the row before, and the largest step around it; m or rad.
struct Step {
    row: usize,
    axis: usize,
    step: f64,
    around: f64,
}

fn stands_out(waveform: &Waveform) -> Option<Step> {
    let largest = |steps: [f64; 4]| steps.into_iter().fold(0.0, |a: f64, b| if b > a { b } else { a });
    (0..6).find_map(|axis| {
        let steps: Vec<f64> = waveform.rows.windows(2).map(|pair| (pair[1][axis] - pair[0][axis]).abs()).collect();
        let around = |k: usize| largest([steps[k - 2], steps[k - 1], steps[k + 1], steps[k + 2]]);
        // From rest every step is larger than the ones before.
        let stands_out = |k: usize| around(k) > 0.0 && steps[k] > STANDS_OUT * around(k) && steps[k] > NO_STEP[axis];
        let at = (2..steps.len().saturating_sub(2)).find(|k| stands_out(*k))?;
        Some(Step { row: at + 1, axis, step: steps[at], around: around(at) })
    })
}

/// The sharpest corner outside some rows.
fn sharpest(rows: &[[f64; 6]], repeat: bool, ringing: &Ringing, but: Range<usize>) -> Option<Corner> {
    let count = rows.len() as isize;
    let mut worst: Option<Corner> = None;
    for axis in 0..6 {
        let place = |k: isize| {
            let k = if repeat { k.rem_euclid(count) } else { k.clamp(0, count - 1) };
            rows[k as usize][axis]
        };
        let bend = |k: isize| (place(k - 1) - place(k)) + (place(k + 1) - place(k));
        for k in (0..count).filter(|k| !but.contains(&(*k as usize))) {
            let rate = bend(k) / ringing.period;
            let ring = ringing.at(rate);
            let sharper = worst.is_none_or(|other| ring * WEIGHTS[axis] > other.ring * WEIGHTS[other.axis]);
            if ring > NO_RING[axis]
                && sharper
                && AROUND.iter().all(|step| bend(k).abs() > STANDS_OUT * bend(k + step).abs())
            {
                worst = Some(Corner { row: k as usize, axis, rate, ring });
            }
        }
    }
    worst
}

/// Ringing of a mode at the corners of a table that is interpolated by a spline.
struct Ringing {
    /// From row to row, s.
    period: f64,
    /// rad/s.
    mode: f64,
}

impl Ringing {
    /// Ringing where the speed changes by `rate`: the longer the rows relative to the period of the mode, the less.
    fn at(&self, rate: f64) -> f64 {
        let half = 0.5 * self.mode * self.period;
        rate.abs() / self.mode / (1.0 + half * half / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// 200 Hz.
    const MODE: f64 = TAU * 200.0;

    /// Rows of x (µm), 1 ms apart.
    fn found(rows: impl Iterator<Item = f64>, repeat: bool) -> Option<(usize, f64)> {
        let rows: Vec<[f64; 6]> = rows.map(|um| [um * 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
        sharpest(&rows, repeat, &Ringing { period: 1e-3, mode: MODE }, 0..0)
            .map(|corner| (corner.row, corner.rate * 1e6))
    }

    /// 3 µm, so many cycles in 1000 rows, from a phase in turns.
    fn sine(cycles: f64, phase: f64) -> impl Iterator<Item = f64> {
        (0..1000).map(move |k| 3.0 * libm::sin(TAU * (phase + cycles * f64::from(k) / 1000.0)))
    }

    #[test]
    fn a_wrap_is_a_corner_where_place_or_slope_of_the_ends_differ() {
        // The last row is followed by the first 2.85 µm off: up and down again within two rows.
        let (row, rate) = found(sine(1.3, 0.0), true).unwrap();
        assert!((row == 0 || row == 999) && (rate.abs() - 2853.0).abs() < 40.0, "row {row}: {rate} µm/s");
        // The positions match, but the slope reverses.
        let (row, rate) = found(sine(1.5, 0.0), true).unwrap();
        assert!(row == 0 && (rate - 2.0 * 3.0 * TAU * 1.5).abs() < 0.1, "row {row}: {rate} µm/s");
        // The first row is repeated at the end: it is at rest for a row.
        let (row, rate) = found(sine(1.0, 0.0).chain([1e-3]), true).unwrap();
        assert!((row == 0 || row == 1000) && rate.abs() > 17.0, "row {row}: {rate} µm/s");
        for (cycles, phase) in [(1.0, 0.0), (3.0, 0.0), (1.0, 0.3), (20.0, 0.1)] {
            assert_eq!(found(sine(cycles, phase), true), None, "{cycles} cycles from {phase}");
        }
        // If the table runs once, its ends are not neighbours: only the slope from and to rest matters.
        assert_eq!(found(sine(1.3, 0.25).map(|x| x * 0.05), false), None);
    }

    #[test]
    fn corners_within_a_table_and_at_its_ends_are_found_where_they_are() {
        let triangle = |k: u32| 0.05 * f64::from(20 - (k % 40).abs_diff(20));
        let (row, rate) = found((0..200).map(triangle), true).unwrap();
        assert!(row % 20 == 0 && (rate.abs() - 100.0).abs() < 1e-6, "row {row}: {rate} µm/s");
        let line = |slope: f64| (0..100).map(move |k| slope * f64::from(k));
        let (row, rate) = found(line(0.1), false).unwrap();
        assert!((row == 0 || row == 99) && (rate.abs() - 100.0).abs() < 1e-6, "row {row}: {rate} µm/s");
        // 13 µm/s let 200 Hz ring by 10 nm.
        assert_eq!((found(line(0.012), false).is_some(), found(line(0.015), false).is_some()), (false, true));
        // Rows as long as two periods of the mode smooth a corner.
        let slow: Vec<[f64; 6]> = (0..100).map(|k| [0.1e-6 * f64::from(k), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
        let of = |period: f64| sharpest(&slow, false, &Ringing { period, mode: MODE }, 0..0);
        assert!(of(10e-3).is_none() && of(1e-3).is_some());
        // From rest to rest without a corner, and a dwell.
        let smooth = (0..400).map(|k| if k < 200 { 5.0 - 5.0 * libm::cos(TAU * f64::from(k) / 400.0) } else { 10.0 });
        assert_eq!(found(smooth, false), None);
        // Angles: 0.1 m of arm.
        let mut rows = vec![[0.0; 6]; 40];
        rows.iter_mut().zip(0..).for_each(|(row, k)| row[4] = 1e-6 * f64::from(k));
        let found = sharpest(&rows, false, &Ringing { period: 1e-3, mode: MODE }, 0..0);
        assert_eq!(found.map(|corner| corner.axis), Some(4));
    }
}
