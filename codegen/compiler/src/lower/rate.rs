//! Rate dependence of the leg model: constants at the period of the spec.

use crate::ir::{LEGS, Lead, RateModel, Scalar};
use specgen_identify::everett::EverettTable;
use specgen_language::model::{Model, RateDependence};

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
    scalar: Scalar,
) -> Option<RateModel> {
    let round = |value: f64| scalar.round(value);
    let period = model.timing.period;
    let [min, max] = model.actuator.voltage;
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
            let gain = |time: f64| -libm::expm1(-period / time);
            let direct = terms.iter().fold(1.0, |sum, [time, weight]| sum + weight * gain(*time));
            Some(RateModel::Creep {
                gains: terms.iter().map(|[time, _]| round(gain(*time))).collect(),
                weights: terms.iter().map(|[_, weight]| round(*weight)).collect(),
                carried: terms.iter().map(|[time, weight]| round(weight * (1.0 - gain(*time)))).collect(),
                direct: round(direct),
            })
        }
    }
}

/// The dead time less half a period, because a held voltage corresponds to the middle of its tick, and for six legs with
/// `actuator.resonance_gain` the inverse of the mode: q + k (2ζ/ω q̇ + q̈/ω²), by backward differences. Bounded by the motion of the
/// legs at the amplifier's slew rate within the dead time and the k/ω of the mode, so that jumps of the demand are not extrapolated
/// further.
pub(super) fn lead(model: &Model, scalar: Scalar) -> Option<Lead> {
    let period = model.timing.period;
    let late = model.hysteresis.dead_time - 0.5 * period;
    let late = if late > 0.0 { late } else { 0.0 };
    let gain = model.actuator.resonance_gain.filter(|_| model.task_space.is_none());
    let omega = core::f64::consts::TAU * model.actuator.resonance;
    let (lag, reach) =
        gain.map_or((0.0, 0.0), |gain| (2.0 * gain * model.actuator.damping_ratio / omega, gain / omega));
    let bend = gain.map(|gain| scalar.round(gain / (omega * period * (omega * period))));
    (late > 0.0 || bend.is_some()).then(|| Lead {
        ticks: scalar.round((late + lag) / period),
        bend,
        limit: scalar.round((late + reach) * model.actuator.slew_rate * model.actuator.leg_gain()),
    })
}
