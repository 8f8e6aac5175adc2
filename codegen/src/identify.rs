//! From reversal-curve records to Everett tables.
//!
//! ```text
//! CSV → record (checked samples) → usable part, branches → dead time → normal equations → non-negative weights → table
//! ```
//! Model: displacement(t + dead time) = offset of the branch + Σ w_c φ_c(drive), w_c ≥ 0, with one weight per cell of
//! the plane, the triangles on the diagonal (reversible) included. Each branch between two reversals has a free
//! offset, and of a first-order reversal record only the falls are fitted, so that the result is the classical
//! E(u_i, u_j) = f(u_i) − f_{u_i}(u_j) averaged over every sample instead of read at the nodes. Drift and creep
//! between the curves cannot bend it.

pub mod branches;
mod columns;
mod coverage;
mod dead_time;
mod export;
mod findings;
pub mod nnls;
pub mod normal;
mod prior;
mod record;
pub mod regressor;
mod report;
mod sanity;
mod staircase;
mod trend;
mod validate;

use crate::diagnostic::Diagnostic;
use crate::everett::EverettTable;
use branches::Branch;
use findings::Findings;
use normal::Normal;
use regressor::Plane;

pub use coverage::MAX_GRID;
pub use export::{read_table_csv, write_table_csv};
pub use record::{MAX_FILE_BYTES, Record, read_record};
pub use report::{Branches, Report};
pub use staircase::Staircase;
pub use validate::{Start, StartResult, Validation, validate};

/// What to identify.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// N, intervals per axis, 2 to [`MAX_GRID`].
    pub grid: usize,
    /// Range of the thresholds [lowest, highest], V.
    pub drive: [f64; 2],
    /// Also remove the drift that the returns to saturation show from within the branches.
    /// Creep looks like drift there, so leave it off unless the sensor is known to drift within one curve.
    pub drift: bool,
    /// How the time by which the displacement lags the drive is found.
    pub dead_time: DeadTime,
}

impl Options {
    /// Usual choices: no drift within a branch, dead time estimated where the record allows it.
    #[must_use]
    pub const fn new(grid: usize, drive: [f64; 2]) -> Self {
        Self { grid, drive, drift: false, dead_time: DeadTime::Estimate }
    }
}

/// Dead time between drive and displacement in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DeadTime {
    /// Estimate it if the record holds branches of different rates, else zero.
    Estimate,
    /// This many seconds, ≥ 0.
    Fixed(f64),
}

/// An identified table and how well it is founded.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// The table, monotone.
    pub table: EverettTable,
    /// Figures.
    pub report: Report,
    /// Findings that refuse nothing, those of the record included.
    pub warnings: Vec<Diagnostic>,
}

/// Share of the drive range within which the drive counts as being at its minimum.
const AT_MINIMUM: f64 = 0.002;
/// A turn of the drive is a reversal when it goes back by this many grid intervals.
const REVERSAL: f64 = 0.5;
/// A record counts as first-order reversal curves if at least this share of its rises starts in saturation.
const FIRST_ORDER: f64 = 0.9;
/// Of such a record the falls alone are fitted if they excite at least this share of the cells that all branches excite.
const FALLS_SUFFICE: f64 = 0.99;
/// A residual above this share of the range means that the model does not hold.
const POOR_FIT_PERCENT: f64 = 3.0;

/// Identifies the Everett table of one record.
///
/// # Errors
/// All findings if the record cannot identify the table: unit or range that contradict `options.drive`, parts of the
/// range never reached, too few reversal curves.
pub fn identify(record: &Record, options: &Options) -> Result<Identified, Vec<Diagnostic>> {
    let mut findings = Findings::new(&record.shown_as);
    match identify_checked(record, options, &mut findings) {
        Some((table, report)) if !findings.any_error() => {
            let mut warnings = record.warnings.clone();
            warnings.extend(findings.into_diagnostics());
            Ok(Identified { table, report, warnings })
        }
        _ => Err(findings.into_diagnostics()),
    }
}

fn identify_checked(record: &Record, options: &Options, findings: &mut Findings) -> Option<(EverettTable, Report)> {
    let plane = coverage::plane(options, findings)?;
    coverage::check_range(record, &plane, findings);
    if findings.any_error() {
        return None;
    }
    let used = usable(record, &plane, findings)?;
    let (dead_time, dead_time_basis) = match options.dead_time {
        DeadTime::Estimate => dead_time::estimate(&plane, record, used.first, &used.branches),
        DeadTime::Fixed(tau) => (if tau > 0.0 { tau } else { 0.0 }, "given".to_owned()),
    };
    let mut displacement = dead_time::delayed(record, dead_time);
    let (drift, drift_returns) = drift_of_returns(record, &used.branches, &plane);
    if options.drift {
        for (y, t) in displacement.iter_mut().zip(&record.time) {
            *y -= drift * (t - record.time[used.first]);
        }
    }
    let scale = 1.0 / record.displacement_range();
    let target: Vec<f64> = displacement.iter().map(|y| y * scale).collect();
    let (mut normal, fitted, excited) = select(&plane, record, &used, target);
    coverage::check_excited(&plane, &excited, findings);

    prior::add(plane.grid, &mut normal.gram);
    let solution = match nnls::solve(&normal.gram, &normal.rhs[0]) {
        Ok(solution) => solution,
        Err(failure) => {
            let message = format!("the weights cannot be determined ({failure:?})");
            findings.error("E0610", None, message, "choose a smaller grid, or record more reversal curves");
            return None;
        }
    };
    let weights: Vec<f64> = solution.weights.iter().map(|w| w / scale).collect();
    let zero_weights = weights.iter().filter(|w| **w == 0.0).count();
    let mut nodes = weights;
    normal::weights_to_nodes(plane.grid, &mut nodes);
    let table = EverettTable { grid: plane.grid, drive_min: plane.range[0], drive_max: plane.range[1], nodes };

    let residual = Residual::of(&plane, record, &used, &displacement, &table);
    let fitted_branches: Vec<Branch> =
        used.branches.iter().copied().filter(|b| fitted == Branches::All || !b.rising).collect();
    let percent = 100.0 / residual.range;
    let (fit_rms, fit_max) = trend::rms_and_max(&residual.detrended);
    let branch_rms = residual.within(&fitted_branches, used.first);
    let report = Report {
        record: record.shown_as.clone(),
        grid: plane.grid,
        samples: record.time.len(),
        samples_skipped: used.first,
        samples_fitted: normal.samples,
        reversal_curves: used.curves,
        branches: fitted,
        excited_share: share(&excited),
        displacement_range: residual.range,
        fit_rms,
        fit_max,
        fit_rms_percent: fit_rms * percent,
        fit_max_percent: fit_max * percent,
        branch_rms,
        branch_rms_percent: branch_rms * percent,
        offset: residual.line.level,
        drift,
        drift_returns,
        drift_removed: options.drift,
        dead_time,
        dead_time_basis,
        noise_floor: trend::noise_floor(&record.displacement[used.first..]),
        zero_weights,
        weights: plane.nodes(),
        solver_iterations: solution.iterations,
        kkt_violation: nnls::kkt_violation(&normal.gram, &normal.rhs[0], &solution.weights),
    };
    if report.fit_rms_percent > POOR_FIT_PERCENT {
        let message = format!("the fitted table misses the record by {:.2} % rms of its range", report.fit_rms_percent);
        findings.warning("W0611", None, message, "is the record one actuator at one load, without steps or lost samples?");
    }
    Some((table, report))
}

/// The part of a record that identification uses.
struct Used {
    /// First sample; the drive is at its minimum there and rises after it.
    first: usize,
    branches: Vec<Branch>,
    curves: usize,
    /// Whether the record consists of first-order reversal curves.
    first_order: bool,
}

fn usable(record: &Record, plane: &Plane, findings: &mut Findings) -> Option<Used> {
    let tolerance = AT_MINIMUM * (plane.range[1] - plane.range[0]);
    let Some(first) = branches::first_usable(record, tolerance) else {
        let message = "the drive never rises from its minimum".to_owned();
        findings.error("E0607", None, message, "start at the lowest drive, then rise to each reversal and fall back");
        return None;
    };
    let branches = branches::branches(&record.drive, first, REVERSAL * plane.interval());
    let curves = coverage::check_curves(&branches, plane, findings);
    if findings.any_error() {
        return None;
    }
    let rises = branches.iter().filter(|b| b.rising);
    let from_saturation = rises.clone().filter(|b| record.drive[b.first] <= plane.range[0] + tolerance).count();
    let first_order = from_saturation as f64 >= FIRST_ORDER * rises.count() as f64;
    Some(Used { first, branches, curves, first_order })
}

/// Normal equations over the falls of first-order reversal curves, if they excite the plane as well as all branches do,
/// else over all branches: in other records it takes the rises to tell apart cells that only switch off together.
fn select(plane: &Plane, record: &Record, used: &Used, target: Vec<f64>) -> (Normal, Branches, Vec<bool>) {
    let falls: Vec<Branch> = used.branches.iter().copied().filter(|b| !b.rising).collect();
    let targets = [target];
    let all = normal::accumulate(plane, record, used.first, &used.branches, &targets);
    let excited_by_all = coverage::excited(all.gram.diagonal().iter().copied());
    if !used.first_order {
        return (all, Branches::All, excited_by_all);
    }
    let descending = normal::accumulate(plane, record, used.first, &falls, &targets);
    let excited_by_falls = coverage::excited(descending.gram.diagonal().iter().copied());
    if share(&excited_by_falls) >= FALLS_SUFFICE * share(&excited_by_all) {
        (descending, Branches::Descending, excited_by_falls)
    } else {
        (all, Branches::All, excited_by_all)
    }
}

fn share(excited: &[bool]) -> f64 {
    excited.iter().filter(|e| **e).count() as f64 / excited.len() as f64
}

/// Drift in m/s over the returns to negative saturation, and their number.
fn drift_of_returns(record: &Record, branches: &[Branch], plane: &Plane) -> (f64, usize) {
    let [low, high] = plane.range;
    let returns: Vec<(f64, f64)> = branches
        .iter()
        .filter(|b| b.rising && record.drive[b.first] <= low + AT_MINIMUM * (high - low))
        .map(|b| (record.time[b.first], record.displacement[b.first]))
        .collect();
    (trend::median_slope(&returns), returns.len())
}

/// Displacement minus model, from the first used sample on.
struct Residual {
    /// As it is, m.
    plain: Vec<f64>,
    /// Without `line`, m.
    detrended: Vec<f64>,
    line: trend::Line,
    /// Of the displacement, m.
    range: f64,
}

impl Residual {
    fn of(plane: &Plane, record: &Record, used: &Used, displacement: &[f64], table: &EverettTable) -> Self {
        let mut plain = Vec::with_capacity(displacement.len() - used.first);
        normal::each_row(plane, &record.drive, used.first, |k, row| {
            plain.push(displacement[k] - regressor::evaluate(row, &table.nodes));
        });
        let time = &record.time[used.first..];
        let line = trend::Line::fit(time, &plain);
        let detrended = plain.iter().zip(time).map(|(r, t)| r - line.at(*t)).collect();
        let (low, high) = sanity::extent(&displacement[used.first..]);
        Self { plain, detrended, line, range: high - low }
    }

    /// Root mean square over `branches` with the mean of each branch removed, m.
    fn within(&self, branches: &[Branch], first: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for branch in branches {
            let part = &self.plain[branch.first - first..branch.end - first];
            let mean = part.iter().fold(0.0, |s, r| s + r) / part.len() as f64;
            sum = part.iter().fold(sum, |s, r| s + (r - mean) * (r - mean));
            count += part.len() as f64;
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }
}
