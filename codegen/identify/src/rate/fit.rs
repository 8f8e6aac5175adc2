//! Fits of the options to several records at once.

use super::joint::Shape;
use super::prepare::PreparedRecord;
use super::table::{Tables, accumulate};
use super::{RateModel, creep, joint, table};
use crate::findings::Findings;
use crate::least_squares::dot;
use crate::mixed;
use crate::mode::Mode;
use crate::regressor::Plane;
use crate::{dead_time, normal, prior};
use specgen_numerics::nnls::Failure;

/// Smoothness of μ₁ relative to that of μ₀ ([`prior`]): μ₁ is a small difference between rates, with as many unknowns.
const RATE_SMOOTHNESS: f64 = 1e3;

/// Every option fitted to the records `chosen`, in the order of [`super::RateOption::ALL`]; the last one only with a
/// `mode`.
pub(super) fn all(
    plane: &Plane,
    prepared: &[PreparedRecord],
    chosen: &[usize],
    mode: Option<Mode>,
    findings: &mut Findings,
) -> Option<Vec<RateModel>> {
    let records: Vec<&PreparedRecord> = chosen.iter().map(|k| &prepared[*k]).collect();
    let fitted = || -> Result<Vec<RateModel>, Failure> {
        let tables = Tables::new(plane, &records)?;
        let still = still(&tables, 0.0)?;
        let dead_time = dead_time(plane, &records)?;
        let late = self::still(&tables, dead_time)?;
        let dynamic = dynamic(plane, &records, [0.0, dead_time])?;
        let creep = creep::fit(&tables, &late)?;
        let shaped = |even, mode| joint::fit(&tables, &late, Shape { even, mode });
        let even = shaped(true, None)?;
        let moved = mode.map(|mode| shaped(true, Some(mode))).transpose()?;
        Ok([still, late, dynamic, creep, even].into_iter().chain(moved).collect())
    };
    fitted().map_err(|failure| normal::report_undetermined(&failure, findings)).ok()
}

/// One table for all records with `dead_time` (s).
fn still(tables: &Tables, dead_time: f64) -> Result<RateModel, Failure> {
    let targets: Vec<Vec<f64>> = tables.records.iter().map(|p| p.delayed(dead_time)).collect();
    Ok(RateModel::of_table(tables.fit(&targets)?, dead_time))
}

/// The dead time (s) with which one table fits all records best, without the bounds of the weights; zero if none helps.
fn dead_time(plane: &Plane, records: &[&PreparedRecord]) -> Result<f64, Failure> {
    let longest = |p: &&PreparedRecord| dead_time::longest(p.record, &p.branches);
    let longest = records.iter().map(longest).fold(f64::INFINITY, |least, s| if s < least { s } else { least });
    let found = dead_time::search(longest, |tried| {
        let each = records.iter().map(|p| {
            let targets: Vec<Vec<f64>> = tried.iter().map(|tau| p.delayed(*tau)).collect();
            accumulate(plane, p, &targets, None)
        });
        let mut normal = each.reduce(|sum, more| sum.add(&more))?;
        prior::add(plane.grid, &mut normal.gram);
        dead_time::residuals(&normal.gram, &normal.rhs, &normal.energy)
    });
    found.map(|found| found.dead_time).ok_or(Failure::Singular)
}

/// (6) with the better of the two dead times (s): μ₀ ≥ 0 and μ₁ of either sign in one fit. The common lag of all loops
/// is dead time, for which the controller has a lead; the rest is then mostly small enough for the inverse.
fn dynamic(plane: &Plane, records: &[&PreparedRecord], dead_times: [f64; 2]) -> Result<RateModel, Failure> {
    // Rates of order one, so that both halves of the normal matrix have the same scale.
    let unit = records.iter().fold(f64::MIN_POSITIVE, |most, p| if p.speed > most { p.speed } else { most });
    let each = records.iter().map(|p| accumulate(plane, p, &dead_times.map(|tau| p.delayed(tau)), Some(unit)));
    let mut normal = each.reduce(|sum, more| sum.add(&more)).ok_or(Failure::Singular)?;
    let nodes = plane.nodes();
    for (from, factor) in [(0, 1.0), (nodes, RATE_SMOOTHNESS)] {
        let mut block = normal.gram.view((from, from), (nodes, nodes)).into_owned();
        let before = block.clone();
        prior::add(plane.grid, &mut block);
        for column in 0..nodes {
            for row in 0..nodes {
                let more = block[(row, column)] - before[(row, column)];
                normal.gram[(from + row, from + column)] += factor * more;
            }
        }
    }
    let mut best: Option<(f64, RateModel)> = None;
    for (k, dead_time) in dead_times.into_iter().enumerate() {
        let scale = 1.0 / table::size(&normal.rhs[k]);
        let rhs: Vec<f64> = normal.rhs[k].iter().map(|b| b * scale).collect();
        let weights = mixed::solve(&normal.gram, &rhs, nodes)?;
        // The explained part, by the normal equations: wᵀGw = wᵀb, except for weights at their bound, which are zero.
        let explained = dot(&weights, &rhs) / (scale * scale);
        let left = normal.energy[k] - explained;
        if best.as_ref().is_none_or(|(least, _)| left < *least) {
            let (still, rate) = weights.split_at(nodes);
            let still = normal::table_of(plane, still, 1.0 / scale);
            let rate = Some(normal::table_of(plane, rate, 1.0 / (scale * unit)));
            best = Some((left, RateModel { rate, ..RateModel::of_table(still, dead_time) }));
        }
    }
    best.map(|(_, model)| model).ok_or(Failure::Singular)
}
