//! Results of an identification.

use serde::Serialize;

use super::cause::Cause;
use super::coverage::Region;

/// Branches that the table was fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Branches {
    /// Falls from a reversal only: by definition E(up, down) is the displacement lost in them.
    Descending,
    /// Rises and falls: the record has more than first-order reversal curves, or its falls alone do not excite every
    /// cell.
    All,
}

/// Result figures of an identification. Lengths in m, times in s; percentages are of `displacement_range`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the record.
    pub record: String,
    /// Whether a comment in it marks it as simulated.
    pub simulated: bool,
    /// Intervals per axis of the table.
    pub grid: usize,
    /// Samples in the record.
    pub samples: usize,
    /// Unused samples at the beginning, where the state is unknown or still settling.
    pub samples_skipped: usize,
    /// Samples in the least-squares fit.
    pub samples_fitted: usize,
    /// Reversal curves found.
    pub reversal_curves: usize,
    /// Branches in the fit; each has a free offset.
    pub branches: Branches,
    /// Fraction of the cells that the record excites: they switch, and not only together with a neighbouring cell.
    pub excited_share: f64,
    /// Difference of the largest and smallest displacement after the skipped samples.
    pub displacement_range: f64,
    /// Residual over all samples that are not skipped, rising and falling, after one offset and one linear drift.
    pub fit_rms: f64,
    /// Largest absolute value of that residual.
    pub fit_max: f64,
    /// `fit_rms` in % of the range.
    pub fit_rms_percent: f64,
    /// `fit_max` in % of the range.
    pub fit_max_percent: f64,
    /// Residual of the fitted branches with their own offsets: only hysteresis, without drift and creep between curves.
    pub branch_rms: f64,
    /// `branch_rms` in % of the range.
    pub branch_rms_percent: f64,
    /// Displacement in negative saturation at the middle of the used time.
    pub offset: f64,
    /// Drift in m/s: median slope of the displacement over the returns to negative saturation. Creep is part of it.
    pub drift: f64,
    /// Number of returns used for the drift.
    pub drift_returns: usize,
    /// Whether the drift was removed from the branches too.
    pub drift_removed: bool,
    /// Mean rate of the drive in the fastest branch that is not a jump, V/s.
    pub fastest: f64,
    /// Time by which the displacement lags the drive column, s.
    pub dead_time: f64,
    /// Part of it that belongs to the converter, which holds each sample of a command: half a sampling interval, s; 0
    /// for `monitor_V` and below 1 kHz. The rest is `hysteresis.dead_time` of a spec.
    pub held: f64,
    /// Basis of the dead time.
    pub dead_time_basis: String,
    /// Whether it is a first-order lag, found where the drive turns.
    #[serde(skip)]
    pub lag_of_turns: bool,
    /// Standard deviation of white noise on the displacement.
    pub noise_floor: f64,
    /// Used samples without weight: glitches, and those after a jump.
    pub weightless: usize,
    /// Causes of the residual of `fit_rms`.
    pub cause: Cause,
    /// Parts of the plane that the record does not excite, largest first.
    pub unexcited: Vec<Region>,
    /// Weights that are zero because the data would make them negative.
    pub zero_weights: usize,
    /// Weights of the table, zero or not.
    pub weights: usize,
    /// Factorisations of the solver.
    pub solver_iterations: usize,
    /// Largest relative violation of the optimality conditions.
    pub kkt_violation: f64,
}

impl Report {
    /// In one line.
    #[must_use]
    pub fn summary(&self) -> String {
        let simulated = if self.simulated { "simulated: " } else { "" };
        let (curves, fit, percent) = (self.reversal_curves, self.fit_rms * 1e9, self.fit_rms_percent);
        let (range, branches, noise) = (self.displacement_range * 1e6, self.branch_rms * 1e9, self.noise_floor * 1e9);
        let (drift, dead_time, zero) = (self.drift * 1e9, self.dead_time * 1e3, self.zero_weights);
        let (weights, excited) = (self.weights, self.excited_share * 100.0);
        format!(
            "{simulated}{curves} reversal curves, fit {fit:.2} nm rms ({percent:.3} % of {range:.2} µm; {branches:.2} nm within branches), noise {noise:.2} nm, drift {drift:.3} nm/s, dead time {dead_time:.3} ms, \
         {zero} of {weights} weights zero, {excited:.1} % of the plane excited"
        )
    }
}
