//! Leg models: families of models are fitted to the records of a leg, and the simplest good one is chosen.
//!
//! ```text
//! P = Σ f_i(p_i) − A z + c₀        p_i: plays of the drive u, V;  dz = du (1 − s β z − γ |z|),  s = sign du
//! P = G(h)                         read-out h = G⁻¹(P): G is a polynomial that rises over the travel;  P, h, y in µm
//! y = h + c Σ L_j h                creep: L_j are first-order lags, time constants a decade apart, one weight c
//! ```
//! A family is a subset of these parts; an Everett table alone is the simplest family. All families are fitted by
//! variable projection (Golub and Pereyra 1973): c, β, γ and the initial z are searched, and for each trial all other
//! parameters are a least-squares solution in which the weights of the plays and A are non-negative. The initial creep states are free parameters, too. The fitted
//! plays become a table: E(a, b) is the rise of Σ f_i when the drive goes from b to a.
//!
//! If there is a record that no fit used, the simplest family whose error on it is within a tenth of the least, plus a
//! fifth of the noise, is chosen. Otherwise families are compared by cross-validation: whole curves are held out, in
//! folds. The simplest family within one standard error of the best is chosen. A family with plays or a Bouc-Wen state may
//! also be worse by a tenth of the least error plus a fifth of the noise.

mod families;
mod family;
mod file;
mod fit;
mod sums;

use serde::{Deserialize, Serialize};

use crate::everett::EverettTable;
use crate::least_squares;
use crate::regressor::{self, Plane};
use crate::staircase::saturate;

pub use families::{Choice, FamilyScore, Selection, choose};
pub use family::Family;
pub(crate) use family::TIMES;
pub use family::WIDENED_PLAYS;
pub use file::{read_leg_csv, write_leg_csv};

/// Least share of the play without a threshold in all weights: what is left of the slope after a turn.
const LEAST_FIRST: f64 = 1e-3;
/// Number of coefficients of a read-out: powers 1 to 5.
const READ_OUT: usize = 5;
/// Largest number of creep operators, as in `hysteresis.creep_times`.
const MOST_CREEP_TERMS: usize = 6;

const NOT_RISING: &str = "the read-out does not rise over its travel";

/// T₃, the Chebyshev polynomial: ±1 at ±1.
pub(crate) fn third(s: f64) -> f64 {
    (4.0 * s * s - 3.0) * s
}

/// Least-squares fit of `y` by a polynomial in `x` without constant: coefficients of x, x², …, and residual. `x` ascends
/// to a positive last value.
fn through_zero(x: &[f64], y: &[f64]) -> Option<([f64; READ_OUT], Vec<f64>)> {
    let unit = *x.last()?;
    let scaled: Vec<f64> = x.iter().map(|x| x / unit).collect();
    let mut columns: Vec<Vec<f64>> = vec![scaled.clone()];
    for k in 1..READ_OUT {
        columns.push(columns[k - 1].iter().zip(&scaled).map(|(power, x)| power * x).collect());
    }
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let fit = least_squares::fit(&columns, y)?;
    let mut coefficients = [0.0; READ_OUT];
    let mut power = 1.0;
    for (own, c) in coefficients.iter_mut().zip(&fit.coefficients) {
        power *= unit;
        *own = c / power;
    }
    Some((coefficients, fit.residual))
}

/// Parameters of a leg model in addition to its table: the line `# leg-model` of the table's file. The equations are those
/// of the module, but the Bouc-Wen state here is A z, in µm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Around {
    /// G: coefficients of h, h², …, hᵏ, µm^(1−k); G(0) = 0 at rest.
    pub read_out: [f64; READ_OUT],
    /// h at full drive, µm: G must rise from 0 to here.
    pub travel_um: f64,
    /// A: slope of the Bouc-Wen state at z = 0, µm/V; 0 without such a state.
    #[serde(rename = "slope_um_per_V")]
    pub slope: f64,
    /// β, 1/V.
    #[serde(rename = "beta_per_V")]
    pub beta: f64,
    /// γ, 1/V.
    #[serde(rename = "gamma_per_V")]
    pub gamma: f64,
    /// A z at rest, µm.
    pub rest_um: f64,
    /// Time constant (s) and weight of each creep operator.
    pub creep: Vec<[f64; 2]>,
    /// Plays that widen with the rate, in place of the table; none if the rate does not show.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plays: Option<WidenedPlays>,
}

/// Plays whose thresholds at rest, r_i, become r_i (1 + κ ln(1 + |v|/v₀)), where v is the rate of the drive behind a low-pass filter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WidenedPlays {
    /// κ, 0 to 1.
    pub kappa: f64,
    /// v₀, V/s.
    #[serde(rename = "v0_V_per_s")]
    pub v0: f64,
    /// Time constant of the filter, s.
    pub lag_s: f64,
    /// r_i at rest, V, rising from 0.
    #[serde(rename = "thresholds_V")]
    pub thresholds: Vec<f64>,
    /// Weights of the plays, µm/V.
    #[serde(rename = "weights_um_per_V")]
    pub weights: Vec<f64>,
}

impl WidenedPlays {
    /// Their displacements (m above rest) at each `time` (s) and `drive` (V); the drive came slowly from `high` if `full`, else
    /// from `low`.
    fn displace(&self, displacement: &mut [f64], time: &[f64], drive: &[f64], [low, high]: [f64; 2], full: bool) {
        let (Some(first), Some(begun)) = (drive.first(), time.first()) else { return };
        let start = |r: &f64| saturate(if full { high - r } else { low + r }, [first - r, first + r]);
        let mut states: Vec<f64> = self.thresholds.iter().map(start).collect();
        let filter = fit::RateFilter { kappa: self.kappa, v0: self.v0, lag: self.lag_s };
        let mut widening = fit::Widening { filter, rate: 0.0, time: *begun, drive: *first };
        for ((y, t), u) in displacement.iter_mut().zip(time).zip(drive) {
            widening.advance(&mut states, &self.thresholds, *t, *u);
            let parts = states.iter().zip(&self.thresholds).zip(&self.weights);
            *y = parts.fold(0.0, |sum, ((p, r), w)| sum + w * (p - low - r)) * 1e-6;
        }
    }

    /// Their Everett table at rest: a play moves by the part of a rise beyond twice its threshold.
    fn table(&self, plane: &Plane) -> EverettTable {
        let Plane { grid, range: [drive_min, drive_max] } = *plane;
        let cell = (drive_max - drive_min) / grid as f64;
        let gained = |span: f64| {
            let plays = self.thresholds.iter().zip(&self.weights).filter(|(r, _)| span > 2.0 * **r);
            plays.fold(0.0, |sum, (r, w)| sum + w * (span - 2.0 * r)) * 1e-6
        };
        let spans = (1..=grid).flat_map(|up| (0..up).map(move |down| (up - down) as f64 * cell));
        EverettTable { grid, drive_min, drive_max, nodes: spans.map(gained).collect() }
    }

    /// Whether a controller can use them, in single precision, too.
    fn is_valid(&self) -> bool {
        let Self { kappa, v0, lag_s, thresholds, weights } = self;
        let rates = (0.0..=1.0).contains(kappa) && (1e-2..=1e6).contains(v0) && (1e-6..=0.1).contains(lag_s);
        let counts = thresholds.len() == WIDENED_PLAYS && weights.len() == WIDENED_PLAYS;
        let rise = thresholds.windows(2).all(|pair| pair[0] < pair[1]) && thresholds.last().is_some_and(|r| *r <= 1e6);
        let sum = weights.iter().fold(0.0, |sum, weight| sum + weight);
        let carried = weights.iter().all(|weight| *weight >= 0.0) && (1e-9..=1e6).contains(&sum);
        rates && counts && rise && thresholds[0] == 0.0 && carried && weights[0] >= LEAST_FIRST * sum
    }
}

impl Around {
    /// The read-out is also used beyond both ends of the travel, up to this share of it.
    pub const MARGIN: f64 = 0.02;

    /// The parameters that leave a table as it is.
    #[must_use]
    pub fn of_table(table: &EverettTable) -> Self {
        let travel_um = table.node(table.grid, 0) * 1e6;
        let read_out = [1.0, 0.0, 0.0, 0.0, 0.0];
        Self { read_out, travel_um, slope: 0.0, beta: 0.0, gamma: 0.0, rest_um: 0.0, creep: Vec::new(), plays: None }
    }

    /// Returns the parameters if a controller can use them.
    ///
    /// # Errors
    /// The conditions that the values must meet.
    pub fn validate(self) -> Result<Self, String> {
        let positive = self.travel_um > 0.0 && self.slope >= 0.0 && self.creep.len() <= MOST_CREEP_TERMS;
        let (plus, minus) = (self.beta + self.gamma, self.beta - self.gamma);
        // The state at rest is within its limit, slope/(β + γ).
        let bounded = plus > 0.0 && minus > -plus && self.rest_um.abs() * plus <= self.slope * (1.0 + 1e-6);
        let saturates = bounded || self.slope == 0.0 && self.rest_um == 0.0;
        let creeps = self.creep.iter().all(|[time, weight]| *time > 0.0 && (0.0..1.0).contains(weight));
        if self.plays.as_ref().is_some_and(|plays| !plays.is_valid() || self.slope > 0.0) {
            return Err(format!(
                "{WIDENED_PLAYS} plays are expected: thresholds that rise from 0, weights >= 0, the first at least a thousandth of all; \
                 kappa 0 to 1, v0_V_per_s 0.01 to 1e6, lag_s 1e-6 to 0.1, slope_um_per_V 0"
            ));
        }
        if !(positive && saturates && creeps) {
            return Err(format!(
                "travel_um > 0, slope_um_per_V >= 0, beta + gamma > 0, beta > 0, rest_um at most slope_um_per_V / \
                 (beta + gamma) and at most {MOST_CREEP_TERMS} creep operators with times > 0 and weights from 0 to 1 \
                 are expected"
            ));
        }
        match self.inverse() {
            Some(_) => Ok(self),
            None => Err(NOT_RISING.to_owned()),
        }
    }

    /// G at `h`, µm.
    #[must_use]
    pub fn read_out(&self, h: f64) -> f64 {
        self.read_out.iter().rev().fold(0.0, |sum, c| (sum + c) * h)
    }

    /// The range of h where the read-out is used, µm.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        [-Self::MARGIN * self.travel_um, (1.0 + Self::MARGIN) * self.travel_um]
    }

    /// G⁻¹ as a polynomial of the same degree, by least squares over the range, and its largest error, µm. None if G is not
    /// monotonic there.
    #[must_use]
    pub fn inverse(&self) -> Option<([f64; READ_OUT], f64)> {
        let h = self.points();
        let p: Vec<f64> = h.iter().map(|h| self.read_out(*h)).collect();
        if p.windows(2).any(|pair| pair[1] <= pair[0]) {
            return None;
        }
        let (inverse, residual) = through_zero(&p, &h)?;
        let worst = residual.iter().fold(0.0, |most: f64, r| if r.abs() > most { r.abs() } else { most });
        Some((inverse, worst))
    }

    /// Values of h over the range, µm: Chebyshev points, ascending: they keep the error small at the ends.
    fn points(&self) -> Vec<f64> {
        const POINTS: usize = 64;
        let [low, high] = self.range();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let angle = |k: usize| core::f64::consts::PI * (k as f64 + 0.5) / POINTS as f64;
        (0..POINTS).map(|k| middle - half * libm::cos(angle(k))).collect()
    }

    /// The same leg with the displacement before its creep, h, multiplied by `gain`, plus `cubic` (share of the travel)
    /// times T₃ + 1 over the travel (T₃: Chebyshev polynomial), so that h = 0 stays. Its table is multiplied by `gain`, too.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub fn refitted(&self, gain: f64, cubic: f64) -> Result<Self, String> {
        let travel = self.travel_um;
        let of = |h: f64| gain * h + cubic * travel * (third(2.0 * h / travel - 1.0) + 1.0);
        let h = self.points();
        let moved: Vec<f64> = h.iter().map(|h| of(*h)).collect();
        if moved.windows(2).any(|pair| pair[1] <= pair[0]) {
            return Err(NOT_RISING.to_owned());
        }
        let p: Vec<f64> = h.iter().map(|h| gain * self.read_out(*h)).collect();
        let (read_out, _) = through_zero(&moved, &p).ok_or_else(|| NOT_RISING.to_owned())?;
        let (slope, rest_um) = (gain * self.slope, gain * self.rest_um);
        let mut plays = self.plays.clone();
        plays.iter_mut().flat_map(|plays| &mut plays.weights).for_each(|weight| *weight *= gain);
        Self { read_out, travel_um: of(travel), slope, rest_um, plays, ..self.clone() }.validate()
    }

    /// The state A z, µm, after a step of the drive (V) from the state `before` (µm).
    #[must_use]
    pub fn state_after(&self, before: f64, step: f64) -> f64 {
        if self.slope == 0.0 {
            return 0.0;
        }
        self.slope * fit::state_after(before / self.slope, step, [self.beta + self.gamma, self.beta - self.gamma])
    }

    /// Converts displacements of the table (m) at `drive` (V) to those of the leg before creep. The range of the drive is
    /// `low` to `high`; `full` means that the drive came from `high`, not from `low`.
    pub(crate) fn complete(
        &self,
        displacement: &mut [f64],
        time: &[f64],
        drive: &[f64],
        [low, high]: [f64; 2],
        full: bool,
    ) {
        if let Some(plays) = &self.plays {
            plays.displace(displacement, time, drive, [low, high], full);
        }
        let start = if full { self.state_after(self.rest_um, high - low) } else { self.rest_um };
        let (mut z, mut before) = (start, if full { high } else { low });
        let inverse = self.inverse().unwrap_or_default().0;
        for (y, u) in displacement.iter_mut().zip(drive) {
            z = self.state_after(z, u - before);
            before = *u;
            let p = *y * 1e6 - (z - self.rest_um);
            *y = inverse.iter().rev().fold(0.0, |sum, c| (sum + c) * p) * 1e-6;
        }
    }

    /// Gain of small motion after a reversal, m/V: that of the table less A, over the mean slope of the read-out.
    pub(crate) fn reversal_gain(&self, table: &EverettTable) -> f64 {
        let slope = self.read_out(self.travel_um) / self.travel_um;
        (table.reversal_gain() - self.slope * 1e-6) / slope
    }
}

/// Displacement of each leg after one second at full drive, m. Without creep parameters this is the end of its table, which
/// contains the creep of the record.
#[must_use]
pub fn strokes(tables: &[EverettTable], around: &[Option<Around>]) -> Vec<f64> {
    let of = |(k, table): (usize, &EverettTable)| match around.get(k) {
        Some(Some(around)) => {
            let crept = |sum, [time, weight]: &[f64; 2]| sum - weight * libm::expm1(-1.0 / time);
            around.travel_um * 1e-6 * around.creep.iter().fold(1.0, crept)
        }
        _ => table.node(table.grid, 0),
    };
    tables.iter().enumerate().map(of).collect()
}

/// The same function on another grid: between the nodes of `table` as the controller interpolates.
#[must_use]
pub(crate) fn on_grid(table: &EverettTable, grid: usize) -> EverettTable {
    let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
    let mut finer = EverettTable { grid, drive_min: table.drive_min, drive_max: table.drive_max, nodes: Vec::new() };
    let mut row = Vec::new();
    for (up, down) in (1..=grid).flat_map(|up| (0..up).map(move |down| (up, down))) {
        row.clear();
        plane.add_everett(finer.threshold(up), finer.threshold(down), 1.0, &mut row);
        finer.nodes.push(regressor::evaluate(&row, &table.nodes));
    }
    finer
}

/// Model of a leg.
#[derive(Debug, Clone, PartialEq)]
pub struct LegModel {
    /// Everett table of Γ, m.
    pub table: EverettTable,
    /// All other parameters; none in the Preisach model.
    pub around: Option<Around>,
}
