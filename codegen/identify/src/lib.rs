//! From reversal-curve records to Everett tables.
//!
//! ```text
//! CSV → record (checked samples) → usable part, branches → dead time → normal equations → non-negative weights → table
//! ```
//! Model: displacement(t + dead time) = offset of the branch + Σ w_c φ_c(drive), w_c ≥ 0, with one weight per cell c of
//! the plane, including the (reversible) triangles on the diagonal; φ_c is the displacement of a unit weight in cell c.
//! `prior` prefers similar weights of neighbouring cells that the record does not determine. Each branch between two reversals has a free
//! offset, so that drift and creep between the curves do not distort the table. For a first-order reversal record only
//! the falls are fitted, with most weight on samples near the thresholds of the grid. The result is the classical
//! E(u_i, u_j) = f(u_i) − f_{u_i}(u_j), with less noise, for any spacing of the curves, and without negative weights.
//!
//! | module | what |
//! |---|---|
//! | `columns`, `container`, `tables`, `record` | the reader of text, MATLAB, HDF5, TDMS and NumPy files; checked samples |
//! | `joined` | several records of one leg as one |
//! | `normal`, `selection`, `residual` | normal equations, choice of the grid, causes of the residual |
//! | [`leg_model`] | families of leg models fitted to a record, and the choice among them |
//! | [`rate`] | records at several rates: dead time, dynamic Preisach (6), creep, each tested on the rate it was not fitted on |
//! | [`response`], [`gauge`], [`stiffness`] | another record to an [`Estimate`] of values of the spec |
//! | [`linear`], [`gains`], [`refit`] | records at several frequencies, and runs of a machine, to values of the spec |
//! | [`declared`] | the records that a spec names, compared with the spec |
//! | [`assembled`] | drives that identify the legs of an assembled platform with its own converters |
//! | [`waveform`] | tables of poses from CSV, every bad row reported |

pub mod assembled;
mod branches;
mod cause;
mod columns;
mod container;
mod coverage;
pub mod cross_talk;
mod dead_time;
pub mod declared;
mod defects;
mod distrust;
mod estimate;
pub mod everett;
mod export;
mod file;
mod findings;
pub mod gains;
pub mod gauge;
mod grid_choice;
mod joined;
pub mod least_squares;
pub mod leg_model;
mod limits;
pub mod linear;
#[cfg(test)]
#[path = "../../../tests/fuzz/targets/memory.rs"]
mod memory;
mod mixed;
pub mod mode;
mod normal;
mod prior;
pub mod rate;
mod reading;
mod record;
pub mod refit;
pub mod regressor;
mod report;
mod residual;
pub mod response;
mod sanity;
mod selection;
mod signals;
mod staircase;
pub mod states;
mod statistics;
pub mod stiffness;
mod stretches;
mod sweep;
mod tables;
mod turns;
pub mod waveform;

use crate::everett::EverettTable;
use findings::Findings;
use residual::Residual;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_numerics::nnls;

pub use cause::{Cause, Source};
pub use columns::{SIMULATED, is_simulated, marked_as_simulated};
pub use coverage::Region;
pub use estimate::{Estimate, Parameter};
pub use export::{is_table_csv, read_table_csv, write_table_csv};
pub use file::{MAX_FILE_BYTES, TextOrArrays, read_file, read_table};
pub use grid_choice::{GridChoice, Score, choose_grid};
pub use joined::join;
pub use leg_model::{read_leg_csv, write_leg_csv};
pub use rate::predict::{Drive, Prediction, PredictionError, error_on, predict, read_drive, validate};
pub use reading::{Reading, size};
pub use record::{Record, decode_record, parse_record, read_record};
pub use report::{Branches, Report};
pub use residual::Trace;
pub use signals::Input;
pub use specgen_language::model::MAX_GRID;
pub use staircase::Staircase;
pub use statistics::{extent, mean};

/// What to identify.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// N, intervals per axis, 2 to [`MAX_GRID`].
    pub grid: usize,
    /// Grid of a leg model with plays, if it can be inverted there: `grid`, doubled or not.
    pub finest: usize,
    /// Range of the thresholds [lowest, highest], V.
    pub drive: [f64; 2],
    /// Also remove, within branches, the drift that the returns to saturation show. Creep looks like drift there, so
    /// leave it off unless the sensor is known to drift within a curve.
    pub drift: bool,
    /// Source of the time by which the displacement lags the drive.
    pub dead_time: DeadTime,
}

impl Options {
    /// Usual choices: this grid, no drift within a branch, dead time estimated where the record allows it.
    #[must_use]
    pub const fn new(grid: usize, drive: [f64; 2]) -> Self {
        Self { grid, finest: grid, drive, drift: false, dead_time: DeadTime::Estimate }
    }
}

/// Dead time between drive and displacement in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DeadTime {
    /// Estimate it if the record has branches of different rates, otherwise zero.
    Estimate,
    /// The same, but from the turns of a triangular drive if it has some that are sampled finely: creep is not taken for a
    /// dead time there.
    FromTurns,
    /// This many seconds, ≥ 0.
    Fixed(f64),
}

/// An identified table and its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The table, monotone.
    pub table: EverettTable,
    /// Figures of record and fit.
    pub report: Report,
    /// Samples and residual from the first usable one on.
    pub trace: Trace,
    /// Findings that do not refuse the record, including those about its file.
    pub warnings: Vec<Diagnostic>,
}

/// A residual above this share of the range, %, shows that the model does not apply.
const POOR_FIT_PERCENT: f64 = 3.0;

/// Identifies the Everett table of one record.
///
/// # Errors
/// All findings if the record cannot identify the table: unit or range that contradict `options.drive`, parts of the
/// range that are never reached, too few reversal curves.
pub fn identify(record: &Record, options: &Options) -> Result<Identification, Vec<Diagnostic>> {
    let mut findings = Findings::after(&record.shown_as, &record.warnings);
    let found = identify_checked(record, options, &mut findings);
    let ((table, report, trace), warnings) = findings.conclude(found)?;
    Ok(Identification { table, report, trace, warnings })
}

fn identify_checked(
    record: &Record,
    options: &Options,
    findings: &mut Findings,
) -> Option<(EverettTable, Report, Trace)> {
    let plane = coverage::plane(options, findings)?;
    coverage::check_range(record, &plane, selection::hardly_returns(record, &plane), findings);
    if findings.any_error() {
        return None;
    }
    let record = &defects::repaired(record, plane.range, plane.grid, findings);
    let mut used = selection::usable(record, &plane, findings)?;
    let of_turns =
        if options.dead_time == DeadTime::FromTurns { turns::estimate(record, &used.branches) } else { None };
    let lag_of_turns = of_turns.is_some();
    let (dead_time, dead_time_basis) = match (options.dead_time, of_turns) {
        (DeadTime::Fixed(tau), _) => (if tau > 0.0 { tau } else { 0.0 }, "given".to_owned()),
        (_, Some(found)) => found,
        _ => dead_time::estimate(&plane, record, used.first, &used.branches),
    };
    used.until(dead_time::within(record, dead_time));
    let mut displacement = dead_time::delayed(record, dead_time);
    let (drift, drift_returns) = selection::drift_of_returns(record, &used.branches, &plane);
    if options.drift {
        for (y, t) in displacement.iter_mut().zip(&record.time) {
            *y -= drift * (t - record.time[used.first]);
        }
    }
    let scale = 1.0 / record.displacement_range();
    let target: Vec<f64> = displacement.iter().map(|y| y * scale).collect();
    let (mut normal, fitted, excited) = selection::select(&plane, record, &used, &target);
    let unexcited = coverage::check_excited(&plane, &excited, findings);

    prior::add(plane.grid, &mut normal.gram);
    // Non-negative weights, in units of the target.
    let solution = nnls::solve(&normal.gram, &normal.rhs[0])
        .map_err(|failure| normal::report_undetermined(&failure, findings))
        .ok()?;
    let table = normal::table_of(&plane, &solution.weights, 1.0 / scale);

    let residual = Residual::of(&plane, record, &used, &displacement, &table);
    let fitted_branches = match fitted {
        Branches::Descending => selection::falls(&used.branches),
        Branches::All => used.branches.clone(),
    };
    let percent = 100.0 / residual.range;
    let (fit_rms, fit_max) = statistics::rms_and_max(&residual.detrended);
    let branch_rms = residual.within(&fitted_branches, used.first);
    let noise_floor = statistics::noise_floor(&record.displacement[used.first..]);
    let gain = residual.range / (plane.range[1] - plane.range[0]);
    let cause = residual.cause(record, used.first, noise_floor, gain);
    let report = Report {
        record: record.shown_as.clone(),
        simulated: record.simulated,
        grid: plane.grid,
        samples: record.time.len(),
        samples_skipped: used.first,
        samples_fitted: normal.samples,
        reversal_curves: used.curves,
        branches: fitted,
        excited_share: selection::share(&excited),
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
        fastest: sweep::fastest(record, &used).0,
        dead_time,
        held: record.held(),
        dead_time_basis,
        lag_of_turns,
        noise_floor,
        weightless: record.weightless[used.first..].iter().filter(|w| **w).count(),
        cause,
        unexcited,
        zero_weights: solution.weights.iter().filter(|w| **w == 0.0).count(),
        weights: plane.nodes(),
        solver_iterations: solution.iterations,
        kkt_violation: nnls::kkt_violation(&normal.gram, &normal.rhs[0], &solution.weights),
    };
    sweep::check(&plane, record, &used, &report, findings);
    if report.fit_rms_percent > POOR_FIT_PERCENT {
        let message = format!("the fitted table misses the record by {:.2} % rms of its range", report.fit_rms_percent);
        let help = "is the record one actuator at one load, without steps or lost samples?";
        findings.add(codes::POOR_FIT, None, message, help);
    }
    let trace = residual.trace(record, used.first, &displacement);
    Some((table, report, trace))
}
