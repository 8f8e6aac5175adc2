//! Chooses the grid of an Everett table by cross-validation over whole reversal curves.
//!
//! Curves are grouped by the voltage of their reversal, so that two sweeps of the same curve are always on the same
//! side. Groups are distributed over the folds in turn; the highest group spans the range and is always fitted. Each
//! fold is held out once: the table is fitted to the others and scored on the held-out curves, with equal weight for
//! every sample and a free offset for each branch, as in the fit.
//!
//! Rule: the coarsest grid whose held-out error exceeds that of the best grid by at most one standard error of their
//! difference over the folds (the one-standard-error rule of Breiman et al. 1984, paired by fold).

use serde::Serialize;

use super::branches::Branch;
use super::findings::Findings;
use super::normal::{Normal, Step, Sums, Weighting, walk, weight};
use super::record::Record;
use super::regressor::Plane;
use super::statistics::{extent, mean, mean_and_error};
use super::{DeadTime, Options, coverage, dead_time, defects, prior, selection};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::interrupt;
use specgen_numerics::nnls;

/// Grids that are tried.
pub const TRIED: [usize; 9] = [6, 8, 12, 16, 20, 24, 32, 40, 48];
/// Grid for the estimate of the dead time and the choice of branches.
const PROBE: usize = 16;
/// Number of folds, if there are as many groups of curves below the highest.
const FOLDS: usize = 5;
/// Number of samples used to compare grids; a longer record is decimated evenly.
const SAMPLES: usize = 1_000_000;
/// Fewer folds give no estimate of the spread.
const FEWEST_FOLDS: usize = 3;
/// Curves whose reversals are within this fraction of the range form a group.
const SAME_LEVEL: f64 = 0.005;

/// Held-out error of one grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Intervals per axis of this candidate.
    pub grid: usize,
    /// Root mean square error on held-out curves within their branches, over all folds, m.
    pub held_out_rms: f64,
    /// The same in % of the displacement range.
    pub held_out_percent: f64,
    /// Standard error of the difference to the best grid over the folds, m; 0 for the best one.
    pub standard_error: f64,
}

/// Choice of the grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GridChoice {
    /// Chosen intervals per axis.
    pub chosen: usize,
    /// N with the least held-out error.
    pub best: usize,
    /// Number of parts of the curves; each was held out once.
    pub folds: usize,
    /// Groups of curves with a common reversal voltage.
    pub levels: usize,
    /// Rule of the choice, as text.
    pub rule: &'static str,
    /// Every grid tried, ascending.
    pub scores: Vec<Score>,
}

/// Chooses the grid for `record` over `drive` (V) by cross-validation.
///
/// # Errors
/// As [`super::identify`]; E0622 if the curves have too few different reversal voltages to hold any out.
pub fn choose_grid(record: &Record, drive: [f64; 2], dead_time: DeadTime) -> Result<GridChoice, Vec<Diagnostic>> {
    let mut findings = Findings::after(&record.shown_as, &record.warnings);
    let choice = choose(record, drive, dead_time, &mut findings);
    findings.conclude(choice).map(|(choice, _)| choice)
}

fn choose(record: &Record, drive: [f64; 2], dead_time: DeadTime, findings: &mut Findings) -> Option<GridChoice> {
    let probe = coverage::plane(&Options::new(PROBE, drive), findings)?;
    coverage::check_range(record, &probe, selection::hardly_returns(record, &probe), findings);
    if findings.any_error() {
        return None;
    }
    // `identify` states what is repaired.
    let record = &defects::repaired(record, drive, PROBE, &mut Findings::new(""));
    // All grids use the finest segmentation that the record allows: they are scored on the same samples.
    let mut used = None;
    for grid in TRIED {
        let mut discarded = Findings::new("");
        let plane = Plane { grid, range: drive };
        if let Some(found) = selection::usable(record, &plane, &mut discarded) {
            used = Some((plane, found));
        }
    }
    let Some((finest, used)) = used else {
        // Says why.
        selection::usable(record, &Plane { grid: TRIED[0], range: drive }, findings);
        return None;
    };
    let tau = match dead_time {
        DeadTime::Estimate | DeadTime::FromTurns => dead_time::estimate(&probe, record, used.first, &used.branches).0,
        DeadTime::Fixed(tau) => tau,
    };
    let scale = 1.0 / record.displacement_range();
    let target: Vec<f64> = dead_time::delayed(record, tau).iter().map(|y| y * scale).collect();
    let (_, fitted, _) = selection::select(&probe, record, &used, &target);
    let falls_only = fitted == super::Branches::Descending;

    let (fold_of, folds, levels) = deal(record, &used.branches, drive);
    if folds < FEWEST_FOLDS {
        let message = format!(
            "the curves turn back at {levels} different voltages; cross-validation of the grid needs at least {}",
            FEWEST_FOLDS + 1
        );
        let help = "give the grid with --grid, or record curves that turn back at more voltages";
        return findings.refuse(codes::GRID_NOT_CHOSEN, None, message, help);
    }
    let chosen = used.branches.iter().zip(fold_of).filter(|(b, _)| !(falls_only && b.rising));
    let (branches, fold_of): (Vec<Branch>, Vec<Option<usize>>) = chosen.map(|(b, fold)| (*b, fold)).unzip();
    let weighting = if falls_only { Weighting::AtNodes } else { Weighting::Even };
    let mut errors = Vec::new();
    for grid in TRIED.into_iter().filter(|grid| *grid <= finest.grid) {
        let plane = Plane { grid, range: drive };
        let mut parts = sums(&plane, record, used.first, (&branches, &fold_of, folds), weighting, &target);
        let Some([always, _]) = parts.pop() else { break };
        let whole = parts.iter().fold(always, |sum, [part, _]| sum.add(part));
        let mut near: Option<Vec<f64>> = None;
        let mut squares = Vec::new();
        for [part, held_out] in &parts {
            let mut gram = &whole.gram - &part.gram;
            prior::add(grid, &mut gram);
            let rhs: Vec<f64> = whole.rhs[0].iter().zip(&part.rhs[0]).map(|(sum, b)| sum - b).collect();
            interrupt::point();
            let solved = match &near {
                Some(near) => nnls::solve_from(&gram, &rhs, near),
                None => nnls::solve(&gram, &rhs),
            };
            let Ok(solution) = solved else { break };
            squares.push(mean_square(held_out, &solution.weights));
            near = Some(solution.weights);
        }
        if squares.len() == folds {
            errors.push((grid, squares));
        }
    }
    if errors.is_empty() {
        let message = "no grid could be fitted with curves held out".to_owned();
        return findings.refuse(
            codes::NOT_DETERMINED,
            None,
            message,
            "give the grid with --grid, or record more reversal curves",
        );
    }
    let (bottom, top) = extent(&record.displacement[used.first..]);
    Some(decide(&errors, folds, levels, 1.0 / scale, top - bottom))
}

/// Normal equations of each fold, and last those of the branches that are always fitted: with the weights of the fit, and
/// with equal weights for the score. One pass, over at most [`SAMPLES`] samples.
fn sums(
    plane: &Plane,
    record: &Record,
    first: usize,
    (branches, fold_of, folds): (&[Branch], &[Option<usize>], usize),
    weighting: Weighting,
    target: &[f64],
) -> Vec<[Normal; 2]> {
    let new = |_| [Sums::new(plane.nodes(), 1), Sums::new(plane.nodes(), 1)];
    let mut parts: Vec<[Sums; 2]> = (0..=folds).map(new).collect();
    let every = (record.time.len() - first).div_ceil(SAMPLES);
    let visit = |step: Step| match step {
        Step::Sample(branch, k, row) => {
            let fold = fold_of[branch];
            let [fitted, scored] = &mut parts[fold.unwrap_or(folds)];
            fitted.add(row, &[target[k]], weight(weighting, plane, record, k));
            if fold.is_some() {
                scored.add(row, &[target[k]], 1.0);
            }
        }
        Step::End(branch) => parts[fold_of[branch].unwrap_or(folds)].iter_mut().for_each(Sums::close_branch),
    };
    walk(plane, record, first, branches, |k| k.is_multiple_of(every), visit);
    parts.into_iter().map(|pair| pair.map(|sums| sums.over_weights(plane))).collect()
}

/// Mean square of the held-out samples, each branch with its own offset, in units of the target squared.
fn mean_square(held_out: &Normal, weights: &[f64]) -> f64 {
    let mut square = held_out.energy[0];
    for (column, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
        let mut row = 0.0;
        for (k, v) in weights.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            row += held_out.gram[(k, column)] * v;
        }
        square += w * (row - 2.0 * held_out.rhs[0][column]);
    }
    let mean = square / held_out.samples.max(1) as f64;
    // Rounding may leave a perfect fit slightly below zero.
    if mean > 0.0 { mean } else { 0.0 }
}

/// Fold of each branch (none: always fitted), number of folds, number of groups.
pub(crate) fn deal(record: &Record, branches: &[Branch], drive: [f64; 2]) -> (Vec<Option<usize>>, usize, usize) {
    let peak = |b: &Branch| record.drive[if b.rising { b.end - 1 } else { b.first }];
    let mut peaks: Vec<f64> = branches.iter().map(peak).collect();
    peaks.sort_unstable_by(f64::total_cmp);
    let near = SAME_LEVEL * (drive[1] - drive[0]);
    let mut levels: Vec<f64> = Vec::new();
    for p in peaks {
        if levels.last().is_none_or(|last| p - last > near) {
            levels.push(p);
        }
    }
    let inner = levels.len().saturating_sub(1);
    let folds = FOLDS.min(inner);
    let group = |p: f64| levels.iter().rposition(|level| *level <= p).unwrap_or(0);
    let fold_of = branches
        .iter()
        .map(|b| {
            let group = group(peak(b));
            (group < inner && folds > 0).then(|| group % folds)
        })
        .collect();
    (fold_of, folds, levels.len())
}

/// Applies the rule to the mean squares of each grid and fold; `unit` is the unit of the target, `range` that of the
/// displacement after the skipped samples, m.
fn decide(errors: &[(usize, Vec<f64>)], folds: usize, levels: usize, unit: f64, range: f64) -> GridChoice {
    let best = errors.iter().fold(&errors[0], |best, e| if mean(&e.1) < mean(&best.1) { e } else { best });
    let mut chosen = best.0;
    let mut scores = Vec::new();
    for (grid, squares) in errors {
        let worse: Vec<f64> = squares.iter().zip(&best.1).map(|(a, b)| a.sqrt() - b.sqrt()).collect();
        let (excess, standard_error) = mean_and_error(&worse);
        if excess <= standard_error && *grid < chosen {
            chosen = *grid;
        }
        let rms = mean(squares).sqrt();
        scores.push(Score {
            grid: *grid,
            held_out_rms: rms * unit,
            held_out_percent: 100.0 * rms * unit / range,
            standard_error: standard_error * unit,
        });
    }
    GridChoice {
        chosen,
        best: best.0,
        folds,
        levels,
        rule: "coarsest grid within one standard error of the best",
        scores,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_takes_the_coarsest_grid_that_is_not_worse_by_more_than_one_standard_error() {
        let errors =
            [(8, vec![9.0, 9.0, 9.0]), (16, vec![1.1, 1.3, 1.0]), (32, vec![1.0, 1.0, 1.2]), (40, vec![1.4, 1.5, 1.6])];
        let choice = decide(&errors, 3, 10, 1.0, 1.0);
        assert_eq!((choice.chosen, choice.best), (16, 32));
        // An equal excess in every fold is not chance.
        let steady = [(16, vec![1.21, 1.21, 1.21]), (32, vec![1.0, 1.0, 1.0])];
        assert_eq!(decide(&steady, 3, 10, 1.0, 1.0).chosen, 32);
    }
}
