//! Does a record excite the plane that the table covers? Checks that need the drive range and the grid.

use nalgebra::DMatrix;

use super::Options;
use super::branches::Branch;
use super::findings::Findings;
use super::record::Record;
use super::regressor::Plane;
use super::sanity::extent;
use crate::everett::EverettTable;

/// Largest grid that can be identified: the normal matrix of 64 intervals has 2,080 × 2,080 entries.
pub const MAX_GRID: usize = 64;
/// The record may exceed the declared range by this share of it (amplifier overshoot, ADC noise).
const BEYOND: f64 = 0.02;
/// A ratio of ranges this large is a wrong unit, not a wrong experiment.
const UNIT_RATIO: f64 = 100.0;
/// Reversal curves below this number identify nothing.
const MIN_CURVES: usize = 3;
/// Σ(φ − φ̄)², in samples, from which a cell or a difference of two cells counts as excited.
const EXCITED: f64 = 0.25;

/// Checks the options and returns the plane.
pub(crate) fn plane(options: &Options, findings: &mut Findings) -> Option<Plane> {
    let [low, high] = options.drive;
    if !(2..=MAX_GRID).contains(&options.grid) {
        let message = format!("a grid of {} cannot be identified", options.grid);
        findings.error("E0601", None, message, "choose a grid from 2 to 64; 32 is usual");
    }
    if !(low.is_finite() && high.is_finite() && low < high) {
        let message = format!("the declared drive range {low} V to {high} V is empty or not finite");
        findings.error("E0602", None, message, "declare the lowest voltage first, then the highest");
    }
    if findings.any_error() { None } else { Some(Plane { grid: options.grid, range: [low, high] }) }
}

/// Compares the drive of the record with the declared range.
pub(crate) fn check_range(record: &Record, plane: &Plane, findings: &mut Findings) {
    let [low, high] = plane.range;
    let span = high - low;
    let (bottom, top) = extent(&record.drive);
    let found = format!("the drive goes from {bottom} V to {top} V, but the table is to cover {low} V to {high} V");
    let ratio = (top - bottom) / span;
    let um = record.displacement_range() * 1e6;
    if !(1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
        let unit = if ratio > 1.0 { "mV" } else { "kV" };
        findings.error(
            "E0603",
            None,
            format!("{found}: is the column in {unit}?"),
            "write the drive in volts at the stack",
        );
        return;
    }
    if (ratio - 1.0).abs() > 0.2 && (um / span - 1.0).abs() < 0.02 {
        let message = format!("{found}, and the displacement covers {um:.3}, the span of the drive");
        findings.error("E0604", None, message, "the columns `drive_V` and `displacement_um` seem to be swapped");
        return;
    }
    if bottom < low - BEYOND * span || top > high + BEYOND * span {
        let help = "declare the range in which the record was taken, or record again within the declared one";
        findings.error("E0605", None, found.clone(), help);
    }
    let interval = plane.interval();
    if bottom > low + interval {
        let message = format!("{found}: no cell with a down_threshold below {bottom} V was ever excited");
        findings.error("E0606", None, message, "let the drive fall to the lower end of its range between the curves");
    }
    if top < high - interval {
        let message = format!("{found}: no cell with an up_threshold above {top} V was ever excited");
        findings.error("E0606", None, message, "let the last curves rise to the upper end of the drive range");
    }
}

/// Number of reversal curves: falls from a reversal. Refuses a record with too few of them for the grid.
pub(crate) fn check_curves(branches: &[Branch], plane: &Plane, findings: &mut Findings) -> usize {
    let curves = branches.iter().filter(|b| !b.rising).count();
    let help = "let the drive rise to a reversal, fall back, and repeat with one reversal per grid interval";
    if curves < MIN_CURVES.max(plane.grid / 4) {
        let message = format!(
            "has {curves} reversal curves; a grid of {} needs at least {}",
            plane.grid,
            MIN_CURVES.max(plane.grid / 4)
        );
        findings.error("E0607", None, message, help);
    } else if curves < plane.grid / 2 {
        let message =
            format!("has {curves} reversal curves for a grid of {}: weights between them are interpolated", plane.grid);
        findings.warning("W0608", None, message, help);
    }
    curves
}

/// Which cells the record excites: they switch within a branch, and not only together with their neighbours.
///
/// `gram` is Σ(φ − φ̄)(φ − φ̄)ᵀ over the weights, so dᵀGd is what the record holds about the combination d of cells.
/// Tried are single cells, differences of two neighbours, and the mixed difference of four: rises alone tell rows of
/// cells apart and falls alone columns, and only a reversal between them tells apart the four.
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

/// Warns of cells that were not [`excited`] and names the part of the plane they lie in.
pub(crate) fn check_excited(plane: &Plane, excited: &[bool], findings: &mut Findings) {
    let missing = excited.iter().filter(|e| !**e).count();
    if missing == 0 {
        return;
    }
    let (mut up, mut down) = ([f64::INFINITY, f64::NEG_INFINITY], [f64::INFINITY, f64::NEG_INFINITY]);
    let threshold = |k: usize| plane.range[0] + k as f64 * plane.interval();
    for i in 1..=plane.grid {
        for j in (0..i).filter(|&j| !excited[EverettTable::index(i, j)]) {
            up = [smaller(up[0], threshold(i - 1)), -smaller(-up[1], -threshold(i))];
            down = [smaller(down[0], threshold(j)), -smaller(-down[1], -threshold(j + 1))];
        }
    }
    let message = format!(
        "{missing} of {} cells of the plane were never excited apart from their neighbours (up_threshold {:.3} to {:.3} V, down_threshold {:.3} to {:.3} V); their weights are interpolated",
        excited.len(),
        up[0],
        up[1],
        down[0],
        down[1],
    );
    findings.warning("W0609", None, message, "add reversal curves that turn back in that part of the range");
}

fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}
