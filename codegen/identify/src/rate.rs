//! Rate dependence from records at several rates: what a static table misses, and which of three options fixes it.
//!
//! ```text
//! static           y = Γ₀[u]
//! dead time        y(t + τ) = Γ₀[u]
//! dynamic Preisach y(t + τ) = Γ₀[u] + u̇ Γ₁[u]                        paper, (6); μ₁ of either sign
//! creep            y(t + τ) = f + Σ w_j x_j,  τ_j ẋ_j = f − x_j,  f = Γ₀[u],  w_j ≥ 0
//! creep, one weight    the same with all w_j equal and τ_j evenly spaced in their logarithm
//! creep and mode   the same as creep, behind a second-order mode ([`crate::mode`])
//! ```
//! All options are fitted to the same samples of all records, with equal weight for every record, and a free offset for
//! each branch while a table is fitted. They are compared by the error at a rate that they were not fitted on: each
//! option is fitted again without each record in turn. Errors are those of the whole record after one offset and one
//! line.

mod creep;
mod export;
mod fit;
pub(crate) mod forward;
mod joint;
mod open_weight;
pub mod period;
pub(crate) mod predict;
mod prepare;
mod report;
pub(crate) mod start;
mod table;

use crate::everett::EverettTable;
use crate::leg_model::{Around, LegModel};
use specgen_language::diagnostic::Diagnostic;

use super::findings::Findings;
use super::mode::{self, Mode, Ring};
use super::record::Record;
use super::{Options, coverage, defects, selection, sweep};

pub use export::{read_rate_csv, spec_lines, write_rate_csv};
pub use report::{HoldOut, OptionReport, RateRecord, RateReport, Verdict};

specgen_language::named! {
    /// An option for the rate dependence.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum RateOption {
        /// One Everett table, at any rate.
        Static => "static",
        /// One table with a dead time.
        DeadTime => "static, dead time",
        /// A second table times the rate of the drive (6).
        DynamicPreisach => "dynamic Preisach",
        /// Table, creep and dead time.
        Creep => "creep, dead time",
        /// The same with one weight for all its time constants.
        EvenCreep => "creep, one weight",
        /// Table, creep, dead time and a mode after them, if a record rings or the mode is given.
        CreepMode => "creep and mode",
    }
}

/// One creep operator: τ ẋ = f − x, adding w x to the displacement.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct CreepTerm {
    /// τ, s, > 0.
    pub time_constant: f64,
    /// w ≥ 0, of the displacement of the static part.
    pub weight: f64,
}

impl CreepTerm {
    /// Terms of time constants (s) and weights.
    pub(crate) fn list(terms: &[[f64; 2]]) -> Vec<Self> {
        terms.iter().map(|&[time_constant, weight]| Self { time_constant, weight }).collect()
    }
}

/// Contribution of a mode to the displacement: its response to `gain` · drive, less gain · drive itself.
///
/// The input is not the displacement of the table: its edges at the nodes would make a lightly damped mode ring, which
/// the actuator does not. Nor is its gain that of the table's loops: near its frequency the drive moves the actuator by
/// the gain of small motion, [`EverettTable::reversal_gain`].
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Inertia {
    /// The mode.
    pub mode: Mode,
    /// m/V, ≥ 0.
    pub gain: f64,
}

/// A fitted option. Parts that it lacks are empty or zero.
#[derive(Debug, Clone, PartialEq)]
pub struct RateModel {
    /// Γ₀: the rate-independent table, m.
    pub still: EverettTable,
    /// What is around Γ₀ in a leg model; its creep is in `creep`.
    pub around: Option<Around>,
    /// Γ₁, m s/V, on the grid of `still`; its weights are of either sign.
    pub rate: Option<EverettTable>,
    /// Creep after Γ₀, slowest first.
    pub creep: Vec<CreepTerm>,
    /// What a mode adds.
    pub inertia: Option<Inertia>,
    /// Lag of the displacement behind the drive column of a record, s, ≥ 0. If the drive is a command, half a sampling
    /// interval of it is the converter's, see [`Record::held`].
    pub dead_time: f64,
}

impl RateModel {
    /// The static model of a table with `dead_time` (s).
    #[must_use]
    pub const fn of_table(still: EverettTable, dead_time: f64) -> Self {
        Self { still, around: None, rate: None, creep: Vec::new(), inertia: None, dead_time }
    }

    /// A leg model without dead time.
    #[must_use]
    pub fn of_leg(LegModel { table, around }: LegModel) -> Self {
        let creep = around.as_ref().map_or_else(Vec::new, |around| CreepTerm::list(&around.creep));
        Self { around, creep, ..Self::of_table(table, 0.0) }
    }

    /// Gain of small motion, m/V.
    #[must_use]
    pub fn reversal_gain(&self) -> f64 {
        self.around.as_ref().map_or_else(|| self.still.reversal_gain(), |around| around.reversal_gain(&self.still))
    }
}

/// What [`identify_rate`] found.
#[derive(Debug, Clone)]
pub struct RateIdentification {
    /// The options fitted to all records, in the order of [`RateOption::ALL`].
    pub models: Vec<(RateOption, RateModel)>,
    /// Figures of records and options.
    pub report: RateReport,
    /// Findings that refuse nothing.
    pub warnings: Vec<Diagnostic>,
}

/// Fits every option to `records`, at least two at different rates, and tests each at the rate it was not fitted on.
///
/// `hold_out` is excluded from all fits. `options.drift` and `options.dead_time` are not used. The mode is that of the
/// clearest ring in a record.
///
/// # Errors
/// All findings if a record cannot identify the table, or if the records have one rate only.
pub fn identify_rate(
    records: &[Record],
    hold_out: Option<&Record>,
    options: &Options,
) -> Result<RateIdentification, Vec<Diagnostic>> {
    let mut all: Vec<Diagnostic> = records.iter().chain(hold_out).flat_map(|r| r.warnings.clone()).collect();
    let mut refused = false;
    let mut prepared = Vec::new();
    let mut plane = None;
    let mut mended = Vec::new();
    for record in records {
        let mut findings = Findings::new(&record.shown_as);
        plane = coverage::plane(options, &mut findings);
        if let Some(plane) = &plane {
            coverage::check_range(record, plane, selection::hardly_returns(record, plane), &mut findings);
        }
        if let Some(plane) = plane.filter(|_| !findings.any_error()) {
            mended.push(defects::repaired(record, plane.range, plane.grid, &mut findings));
        }
        refused |= findings.any_error();
        all.extend(findings.into_diagnostics());
    }
    for (record, plane) in mended.iter().zip(plane.iter().cycle()) {
        let mut findings = Findings::new(&record.shown_as);
        prepared.extend(prepare::prepare(record, plane, &mut findings));
        refused |= findings.any_error();
        all.extend(findings.into_diagnostics());
    }
    let Some(plane) = plane.filter(|_| !refused) else { return Err(all) };
    let shown = records.first().map_or("", |record| &record.shown_as);
    let mut findings = Findings::after(shown, &all);
    prepare::check_rates(&prepared, &mut findings);
    if findings.any_error() {
        return Err(findings.into_diagnostics());
    }
    let ring = clearest_ring(records);
    let mode = ring.map(|ring| ring.mode);
    let everything: Vec<usize> = (0..prepared.len()).collect();
    let fitted = fit::all(&plane, &prepared, &everything, mode, &mut findings);
    let mut left_out = Vec::new();
    for out in 0..prepared.len() {
        let others: Vec<usize> = everything.iter().copied().filter(|k| *k != out).collect();
        left_out.push(fit::all(&plane, &prepared, &others, mode, &mut findings));
    }
    let (Some(models), Some(left_out)) = (fitted, left_out.into_iter().collect::<Option<Vec<_>>>()) else {
        return Err(findings.into_diagnostics());
    };
    let longest = models.iter().map(|model| model.dead_time).max_by(f64::total_cmp);
    sweep::check_dead_time(longest.unwrap_or_default(), &mut findings);
    let report = report::report(&plane, &prepared, &models, &left_out, ring, hold_out)
        .map_err(|found| all.into_iter().chain(found).collect::<Vec<_>>())?;
    let models = RateOption::ALL.into_iter().zip(models).collect();
    Ok(RateIdentification { models, report, warnings: findings.into_diagnostics() })
}

/// The clearest ring in any of the records.
fn clearest_ring(records: &[Record]) -> Option<Ring> {
    let clear = |ring: &Ring| ring.amplitude / ring.left;
    records
        .iter()
        .filter_map(|r| mode::ring(&r.time, &r.drive, &r.displacement))
        .reduce(|a, b| if clear(&b) > clear(&a) { b } else { a })
}
