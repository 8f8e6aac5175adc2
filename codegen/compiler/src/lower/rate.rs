//! Rate dependence of the leg model: constants at the period of the spec.

use crate::ir::{BoucWen, LEGS, Lead, Plays, RateModel, Resonance, Scalar};
use specgen_identify::everett::EverettTable;
use specgen_identify::leg_model::{Around, WIDENED_PLAYS, WidenedPlays, strokes};
use specgen_identify::mean;
use specgen_language::model::{Model, RateDependence};

use specgen_runtime::bouc_wen::READ_OUT;
use specgen_runtime::plays::PLAYS;

/// Tolerance of the inverse, as a share of a converter code.
const SHARE_OF_CODE: f64 = 0.125;

/// Distinct lists of nodes, E(i, j) for i = 0..=N, j = 0..=i, and that of each leg; values times `factor`.
pub(super) fn distinct(tables: &[EverettTable], factor: f64, scalar: Scalar) -> (Vec<Vec<f64>>, [usize; LEGS]) {
    let mut distinct: Vec<Vec<f64>> = Vec::new();
    let mut table_of_leg = [0; LEGS];
    for (leg, of_leg) in table_of_leg.iter_mut().enumerate() {
        let table = &tables[if tables.len() == LEGS { leg } else { 0 }];
        let nodes: Vec<f64> = (0..=table.grid)
            .flat_map(|up| (0..=up).map(move |down| scalar.round(table.node(up, down) * factor)))
            .collect();
        *of_leg = distinct.iter().position(|known| *known == nodes).unwrap_or_else(|| {
            distinct.push(nodes);
            distinct.len() - 1
        });
    }
    (distinct, table_of_leg)
}

/// `tables` are the static ones, `rate_tables` those of the second weight (m s/V), as many as the spec names.
pub(super) fn lower(
    model: &Model,
    tables: &[EverettTable],
    rate_tables: &[EverettTable],
    around: &[Option<Around>],
    scalar: Scalar,
) -> Option<RateModel> {
    let round = |value: f64| scalar.round(value);
    let period = model.timing.period;
    let [min, max] = model.actuator.voltage;
    if around.iter().any(Option::is_some) {
        return Some(bouc_wen(model, tables, around, scalar));
    }
    match &model.hysteresis.rate {
        RateDependence::Static => None,
        RateDependence::DynamicPreisach(_) => {
            let volts_per_cell = (max - min) / model.hysteresis.grid as f64;
            let (distinct, table_of_leg) = distinct(rate_tables, volts_per_cell / period, scalar);
            let volts_per_code = (model.dac.range[1] - model.dac.range[0]) / f64::from((1_i32 << model.dac.bits) - 1);
            let least = tables
                .iter()
                .map(|table| table.node(table.grid, 0))
                .fold(f64::INFINITY, |a, b| if b < a { b } else { a });
            let tolerance = round(SHARE_OF_CODE * least * volts_per_code / (max - min));
            Some(RateModel::DynamicPreisach { tables: distinct, table_of_leg, tolerance })
        }
        RateDependence::Creep(terms) => {
            let [gains, weights, carried] = creep(terms, period).map(|list| list.into_iter().map(round).collect());
            Some(RateModel::Creep { gains, weights, carried, direct: round(direct(terms, period)) })
        }
    }
}

/// g_j, w_j and w_j (1 − g_j) of creep operators over a tick of `period` (s).
fn creep(terms: &[[f64; 2]], period: f64) -> [Vec<f64>; 3] {
    [
        terms.iter().map(|[time, _]| gain(*time, period)).collect(),
        terms.iter().map(|[_, weight]| *weight).collect(),
        terms.iter().map(|[time, weight]| weight * (1.0 - gain(*time, period))).collect(),
    ]
}

/// 1 + Σ w_j g_j.
fn direct(terms: &[[f64; 2]], period: f64) -> f64 {
    terms.iter().fold(1.0, |sum, [time, weight]| sum + weight * gain(*time, period))
}

fn gain(time: f64, period: f64) -> f64 {
    -libm::expm1(-period / time)
}

/// What is around the table of each leg, in m and cells. A leg without anything has none of its parts.
fn bouc_wen(model: &Model, tables: &[EverettTable], around: &[Option<Around>], scalar: Scalar) -> RateModel {
    /// µm.
    const UNIT: f64 = 1e-6;
    let round = |value: f64| scalar.round(value);
    let period = model.timing.period;
    let [min, max] = model.actuator.voltage;
    let volts_per_cell = (max - min) / model.hysteresis.grid as f64;
    // Every leg has the same number of creep operators; those that it lacks have no weight.
    let operators = around.iter().flatten().map(|around| around.creep.len()).max().unwrap_or(0);
    let leg = |leg: usize| {
        let at = if around.len() == LEGS { leg } else { 0 };
        let own = around[at].clone().unwrap_or_else(|| Around::of_table(&tables[at]));
        let mut terms = own.creep.clone();
        terms.resize(operators, [1.0, 0.0]);
        // Checked where the leg model was made or read.
        let (inverse, _) = own.inverse().unwrap_or_default();
        // Coefficients in powers of m.
        let powers = |c: [f64; READ_OUT]| {
            let mut unit = UNIT;
            c.map(|c| {
                unit /= UNIT;
                round(c * unit)
            })
        };
        let [gains, weights, carried] = creep(&terms, period).map(|list| list.into_iter().map(round).collect());
        let direct = direct(&terms, period);
        let beta_plus_gamma = (own.beta + own.gamma) * volts_per_cell;
        let slope = own.slope * UNIT * volts_per_cell;
        BoucWen {
            gains,
            weights,
            carried,
            direct: round(direct),
            share: round(1.0 / direct),
            read_out: powers(own.read_out),
            inverse: powers(inverse),
            travel: own.range().map(|h| round(h * UNIT)),
            slope: round(slope),
            beta_plus_gamma: round(beta_plus_gamma),
            beta_minus_gamma: round((own.beta - own.gamma) * volts_per_cell),
            limit: round(if slope > 0.0 { slope / beta_plus_gamma } else { 0.0 }),
            rest: round(own.rest_um * UNIT),
        }
    };
    // Legs of one controller have one kind of model. The table of each leg is its plays at rest.
    let plays: Option<Vec<Plays>> = (0..LEGS)
        .map(|leg| {
            let own = around[if around.len() == LEGS { leg } else { 0 }].as_ref()?.plays.as_ref()?;
            Some(plays(own, model.hysteresis.grid, volts_per_cell, period, scalar))
        })
        .collect();
    let plays = plays.and_then(|plays| plays.try_into().ok());
    RateModel::BoucWen { legs: Box::new(core::array::from_fn(leg)), plays: plays.map(Box::new) }
}

const _: () = assert!(WIDENED_PLAYS == PLAYS);

/// Plays that widen, in m and cells of a `grid`.
fn plays(own: &WidenedPlays, grid: usize, volts_per_cell: f64, period: f64, scalar: Scalar) -> Plays {
    let round = |value: f64| scalar.round(value);
    let thresholds: Vec<f64> = own.thresholds.iter().map(|r| round(r / volts_per_cell)).collect();
    let weights: Vec<f64> = own.weights.iter().map(|w| round(w * 1e-6 * volts_per_cell)).collect();
    // As the runtime sums them: P is exactly 0 at rest.
    let held = weights.iter().zip(&thresholds).skip(1);
    let rest = held.fold(0.0, |sum, (w, r)| round(sum + round(w * r)));
    Plays {
        full_scale: grid as f64,
        slope: round(weights.iter().fold(0.0, |sum, w| sum + w)),
        rest,
        widening: round(own.kappa),
        per_rate: round(volts_per_cell / (own.v0 * period)),
        decay: round(libm::exp(-period / own.lag_s)),
        thresholds,
        weights,
    }
}

/// The dead time less half a period, because a held voltage corresponds to the middle of its tick, and for six legs with
/// `actuator.resonance_gain` the inverse of the mode: q + k_s (2ζ/ω u̇ + ü/ω²), by backward differences. Bounded by the motion of the
/// legs at the amplifier's slew rate within the dead time and 1/ω of the mode, so that jumps of the demand are not extrapolated
/// further.
pub(super) fn lead(model: &Model, tables: &[EverettTable], around: &[Option<Around>], scalar: Scalar) -> Option<Lead> {
    let round = |value: f64| scalar.round(value);
    let period = model.timing.period;
    let late = model.hysteresis.dead_time - 0.5 * period;
    let late = if late > 0.0 { late } else { 0.0 };
    let share = model.actuator.resonance_gain.filter(|_| model.task_space.is_none());
    let omega = core::f64::consts::TAU * model.actuator.resonance;
    let reach = share.map_or(0.0, |_| 1.0 / omega);
    let resonance = share.map(|share| Resonance {
        lag: round(2.0 * model.actuator.damping_ratio / (omega * period)),
        bend: round(1.0 / (omega * period * (omega * period))),
        gain_growth: round(2.0 * (1.0 / share - 1.0) / mean(&strokes(tables, around))),
    });
    (late > 0.0 || resonance.is_some()).then(|| Lead {
        ticks: round(late / period),
        resonance,
        limit: round((late + reach) * model.actuator.slew_rate * model.actuator.leg_gain()),
    })
}
