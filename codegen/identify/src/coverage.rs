//! Whether a record excites the plane of the table. Checks that need the drive range and the grid.

use nalgebra::DMatrix;
use serde::Serialize;

use super::Options;
use super::branches::Branch;
use super::findings::Findings;
use super::record::Record;
use super::regressor::Plane;
use super::sanity::{self, PLAUSIBLE_RANGE};
use super::statistics::{extent, micrometres};
use crate::everett::EverettTable;
use specgen_language::diagnostic::codes;
use specgen_language::model::MAX_GRID;
use specgen_language::shell;

/// Fraction by which the record may exceed the declared range (amplifier overshoot, ADC noise).
const BEYOND: f64 = 0.02;
/// Fraction of the range at each of its ends that loops may leave out.
const SMOOTH_END: f64 = 0.1;
/// A ratio of ranges this large shows a wrong unit, not a wrong experiment.
const UNIT_RATIO: f64 = 100.0;
/// Fewer reversal curves identify nothing.
const MIN_CURVES: usize = 3;
/// Σ(φ − φ̄)², in samples, above which a cell or a difference of two cells counts as excited.
const EXCITED: f64 = 0.25;

/// Checks the options and returns the plane.
pub(crate) fn plane(options: &Options, findings: &mut Findings) -> Option<Plane> {
    let [low, high] = options.drive;
    if !(2..=MAX_GRID).contains(&options.grid) {
        let message = format!("a grid of {} cannot be identified", options.grid);
        findings.add(codes::GRID_NOT_IDENTIFIABLE, None, message, "choose a grid from 2 to 128; 32 is usual");
    }
    if !(low.is_finite() && high.is_finite() && low < high) {
        let message = format!("the declared drive range {low} V to {high} V is empty or not finite");
        findings.add(codes::DRIVE_RANGE_EMPTY, None, message, "declare the lowest voltage first, then the highest");
    }
    if findings.any_error() { None } else { Some(Plane { grid: options.grid, range: [low, high] }) }
}

/// Compares the drive of the record with the declared range. `loops`: it grows or decays, and hardly ever returns.
pub(crate) fn check_range(record: &Record, plane: &Plane, loops: bool, findings: &mut Findings) {
    let [low, high] = plane.range;
    let span = high - low;
    let (bottom, top) = extent(&record.drive);
    let (lowest, highest) = (time_of(record, |u| u <= bottom), time_of(record, |u| u >= top));
    let found = format!(
        "the drive goes from {bottom} V (at {lowest} s) to {top} V (at {highest} s), but the table is to cover {low} V to {high} V"
    );
    check_displacement_unit(record, findings);
    let ratio = (top - bottom) / span;
    let um = record.displacement_range() * 1e6;
    if !(1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
        let unit = if ratio > 1.0 { "mV" } else { "kV" };
        let message = format!("{found}: is the column in {unit}?");
        findings.add(codes::DRIVE_UNIT, None, message, "write the drive in volts at the stack");
        return;
    }
    let as_drive = (um / span - 1.0).abs() < 0.02;
    if (ratio - 1.0).abs() > 0.2 && (as_drive || sanity::look_swapped(&record.drive, &record.displacement)) {
        let why = if as_drive { "the span of the drive" } else { "without noise, as a command does" };
        let message = format!("{found}, and the displacement covers {um:.3}, {why}");
        let help = "the columns `drive_V` and `displacement_um` seem to be swapped";
        findings.add(codes::COLUMNS_SWAPPED, None, message, help);
        return;
    }
    if bottom < low - BEYOND * span || top > high + BEYOND * span {
        let help = "declare the range in which the record was taken, or record again within the declared one";
        let left = time_of(record, |u| u < low - BEYOND * span || u > high + BEYOND * span);
        findings.add(codes::DRIVE_RANGE, None, format!("{found}; it leaves that range at {left} s"), help);
    }
    let interval = plane.interval();
    // Growing or decaying loops: a smooth table goes on a little beyond them.
    if loops && bottom <= low + SMOOTH_END * span && top >= high - SMOOTH_END * span {
        if bottom > low + interval || top < high - interval {
            let message = format!("{found}: the cells beyond were never excited, and continue those before them");
            findings.add(codes::CELLS_INTERPOLATED, None, message, "name the range that the record covers as --drive");
        }
        return;
    }
    if bottom > low + interval {
        let message = format!("{found}: no cell with a down_threshold below {bottom} V was ever excited");
        let help =
            format!("let the drive fall to the lower end of its range between the curves; {}", such_a_drive(plane));
        findings.add(codes::NOT_EXCITED, None, message, &help);
    }
    if top < high - interval {
        let message = format!("{found}: no cell with an up_threshold above {top} V was ever excited");
        let help = format!("let the last curves rise to the upper end of the drive range; {}", such_a_drive(plane));
        findings.add(codes::NOT_EXCITED, None, message, &help);
    }
}

/// The command that writes a suitable drive for the plane.
pub(crate) fn such_a_drive(plane: &Plane) -> String {
    let ([low, high], grid) = (plane.range, plane.grid);
    let line = shell::line("specgen forc --drive-only --drive")
        .word(&format!("{low}:{high}"))
        .words(&format!("--grid {grid} -o"))
        .path(shell::free("drive", ".csv"));
    format!("`{line}` writes such a drive for a generator")
}

/// Time of the first sample whose drive satisfies `fits`, s.
fn time_of(record: &Record, fits: impl Fn(f64) -> bool) -> f64 {
    record.drive.iter().position(|u| fits(*u)).map_or(record.time[0], |k| record.time[k])
}

/// Refuses a displacement that no piezo actuator can have: it shows a wrong unit.
fn check_displacement_unit(record: &Record, findings: &mut Findings) {
    let (low, high) = extent(&record.displacement);
    let range = high - low;
    if (PLAUSIBLE_RANGE[0]..=PLAUSIBLE_RANGE[1]).contains(&range) {
        return;
    }
    let at = |value: f64| record.displacement.iter().position(|y| *y == value).map_or(0.0, |k| record.time[k]);
    let unit = if range > PLAUSIBLE_RANGE[1] { "nm" } else { "mm or m" };
    let (lowest, at_lowest, highest, at_highest) = (micrometres(low), at(low), micrometres(high), at(high));
    let message = format!(
        "the displacement goes from {lowest} um (at {at_lowest} s) to {highest} um (at {at_highest} s), which no piezo actuator does: is it in {unit}?"
    );
    findings.add(codes::DISPLACEMENT_UNIT, None, message, "convert the column to micrometres");
}

/// Number of reversal curves: falls from a reversal. Refuses a record with too few of them for the grid.
pub(crate) fn check_curves(branches: &[Branch], plane: &Plane, findings: &mut Findings) -> usize {
    let curves = branches.iter().filter(|b| !b.rising).count();
    let help = format!(
        "let the drive rise to a reversal, fall back, and repeat with one reversal per grid interval; {}",
        such_a_drive(plane)
    );
    if curves < MIN_CURVES.max(plane.grid / 4) {
        let message = format!(
            "has {curves} reversal curves; a grid of {} needs at least {}",
            plane.grid,
            MIN_CURVES.max(plane.grid / 4)
        );
        findings.add(codes::TOO_FEW_CURVES, None, message, &help);
    } else if curves < plane.grid / 2 {
        let message =
            format!("has {curves} reversal curves for a grid of {}: weights between them are interpolated", plane.grid);
        findings.add(codes::FEW_CURVES, None, message, &help);
    }
    curves
}

/// The cells that the record excites: they switch within a branch, and not only together with their neighbours.
///
/// `gram` is Σ(φ − φ̄)(φ − φ̄)ᵀ over the weights, so dᵀGd is the information of the record on the combination d of
/// cells. The check tries single cells, differences of two neighbours, and the mixed difference of four. Rises alone
/// distinguish rows of cells and falls alone columns; only a reversal between them distinguishes all four.
pub(crate) fn excited(plane: &Plane, gram: &DMatrix<f64>) -> Vec<bool> {
    let mut excited = vec![true; gram.nrows()];
    let mut require = |cells: &[(usize, usize)]| {
        // Signs of the mixed difference: neighbours alternate.
        let terms: Vec<(usize, f64)> = cells
            .iter()
            .filter(|(up, down)| *up <= plane.grid && down < up)
            .map(|&(up, down)| (EverettTable::index(up, down), if (up + down) % 2 == 0 { 1.0 } else { -1.0 }))
            .collect();
        if terms.len() < cells.len() {
            return;
        }
        let mut energy = 0.0;
        for &(a, sign_a) in &terms {
            for &(b, sign_b) in &terms {
                energy += sign_a * sign_b * gram[(a, b)];
            }
        }
        if energy <= EXCITED {
            terms.iter().for_each(|&(cell, _)| excited[cell] = false);
        }
    };
    for up in 1..=plane.grid {
        for down in 0..up {
            require(&[(up, down)]);
            require(&[(up, down), (up + 1, down)]);
            require(&[(up, down), (up, down + 1)]);
            require(&[(up, down), (up + 1, down), (up, down + 1), (up + 1, down + 1)]);
        }
    }
    excited
}

/// A connected part of the plane that a record does not excite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// Cells in it.
    pub cells: usize,
    /// Share of all cells.
    pub share: f64,
    /// up_thresholds from and to, V.
    pub up: [f64; 2],
    /// down_thresholds from and to, V.
    pub down: [f64; 2],
    /// The cells as (up, down), for drawing: a cell lies below threshold `up` and above threshold `down`.
    #[serde(skip)]
    pub members: Vec<(usize, usize)>,
}

/// Number of regions that a message names.
const NAMED: usize = 3;

/// Warns of cells that were not [`excited`], with their parts of the plane and the content of the table there.
pub(crate) fn check_excited(plane: &Plane, excited: &[bool], findings: &mut Findings) -> Vec<Region> {
    let regions = regions(plane, excited);
    if regions.is_empty() {
        return regions;
    }
    let missing = excited.iter().filter(|e| !**e).count();
    let mut places: Vec<String> = regions
        .iter()
        .take(NAMED)
        .map(|r| {
            format!(
                "up_threshold {:.3} to {:.3} V, down_threshold {:.3} to {:.3} V",
                r.up[0], r.up[1], r.down[0], r.down[1]
            )
        })
        .collect();
    if regions.len() > NAMED {
        places.push(format!("{} smaller parts", regions.len() - NAMED));
    }
    let (all, percent, parts) = (excited.len(), 100.0 * missing as f64 / excited.len() as f64, places.join("; "));
    let message = format!(
        "{missing} of {all} cells of the plane ({percent:.1} %) were never excited apart from their neighbours ({parts}): there the record holds only sums of weights. \
         No weight is added to these sums; within a part the table divides them evenly, a straight line between the measured curves around it"
    );
    let help = "add reversal curves that turn back in that part of the range";
    findings.add(codes::CELLS_INTERPOLATED, None, message, help);
    regions
}

/// Connected parts of unexcited cells, the largest first.
fn regions(plane: &Plane, excited: &[bool]) -> Vec<Region> {
    let grid = plane.grid;
    let threshold = |k: usize| plane.range[0] + k as f64 * plane.interval();
    let mut seen = excited.to_vec();
    let mut regions = Vec::new();
    for up in 1..=grid {
        for down in 0..up {
            if seen[EverettTable::index(up, down)] {
                continue;
            }
            seen[EverettTable::index(up, down)] = true;
            let mut members = vec![(up, down)];
            let mut next = 0;
            while let Some(&(i, j)) = members.get(next) {
                next += 1;
                for (a, b) in [(i + 1, j), (i - 1, j), (i, j + 1), (i, j.wrapping_sub(1))] {
                    if a <= grid && b < a && !seen[EverettTable::index(a, b)] {
                        seen[EverettTable::index(a, b)] = true;
                        members.push((a, b));
                    }
                }
            }
            members.sort_unstable();
            let (mut ups, mut downs) = ([up, up], [down, down]);
            for &(i, j) in &members {
                ups = [ups[0].min(i), ups[1].max(i)];
                downs = [downs[0].min(j), downs[1].max(j)];
            }
            regions.push(Region {
                cells: members.len(),
                share: members.len() as f64 / excited.len() as f64,
                up: [threshold(ups[0] - 1), threshold(ups[1])],
                down: [threshold(downs[0]), threshold(downs[1] + 1)],
                members,
            });
        }
    }
    regions.sort_by_key(|r| std::cmp::Reverse(r.cells));
    regions
}
