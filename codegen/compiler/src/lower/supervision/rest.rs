//! The rest voltage of the legs.

use crate::ir::{Actuation, Hysteresis, LEGS, Plays, RateModel, Rest, Scalar};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

/// The permitted code nearest to the rest voltage.
pub(super) fn code(model: &Model, actuation: &Actuation) -> i32 {
    let [low, high] = model.dac.range;
    let per_code = (high - low) / f64::from((1_i32 << actuation.bits) - 1);
    // Saturates.
    let nearest = libm::round((model.rest_voltage() - low) / per_code) as i32;
    nearest.clamp(actuation.code_min, actuation.code_max)
}

/// The finding about a rest voltage that is not permitted.
pub(super) fn beyond(model: &Model) -> Option<Diagnostic> {
    let [low, high] = model.actuator.voltage;
    let rest = model.rest_voltage();
    if (low..=high).contains(&rest) {
        return None;
    }
    Some(super::finding(
        model,
        codes::SUPERVISOR_REST,
        "rest_voltage",
        format!("the legs would rest at {rest} V, beyond `actuator.voltage`, {low} V to {high} V"),
        format!("write rest_voltage = \"{} V\" or a voltage within the limits", Model::nearest_to_zero(low, high)),
    ))
}

/// State of the legs at a code above the lowest.
pub(super) fn risen(code: i32, hysteresis: &Hysteresis, actuation: &Actuation, scalar: Scalar) -> Option<Rest> {
    if code == actuation.code_min {
        return None;
    }
    // As the controller computes it.
    let drive =
        scalar.round(actuation.cells_at_zero + scalar.round(scalar.round(f64::from(code)) * actuation.cells_per_code));
    let of_legs = |tables: &[Vec<f64>], table_of_leg: &[usize; LEGS]| {
        table_of_leg.map(|table| first_rise(&tables[table], hysteresis.grid, drive, scalar))
    };
    let rate = match &hysteresis.rate {
        Some(RateModel::DynamicPreisach { tables, table_of_leg, .. }) => of_legs(tables, table_of_leg),
        _ => [0.0; LEGS],
    };
    let mut displacement = of_legs(&hysteresis.tables, &hysteresis.table_of_leg);
    let Some(RateModel::BoucWen { legs, plays }) = &hysteresis.rate else {
        return Some(Rest { drive, displacement, rate, bouc_wen: None, plays: None });
    };
    let plays = plays.as_ref().map(|plays| {
        let each = plays.each_ref().map(|plays| rise(plays, drive, scalar));
        displacement = each.each_ref().map(|(_, p)| *p);
        Box::new(each.map(|(states, _)| states))
    });
    // As the runtime, in small steps of the drive.
    const STEPS: u32 = 4096;
    let at_rest = |leg: usize| {
        let (own, step) = (&legs[leg], drive / f64::from(STEPS));
        let rate = |z: f64| own.slope - if z < 0.0 { own.beta_minus_gamma } else { own.beta_plus_gamma } * z;
        let z = (0..STEPS).fold(own.rest, |z, _| z + step * rate(z + 0.5 * step * rate(z)));
        let p = displacement[leg] - (z - own.rest);
        let h = own.inverse.iter().rev().fold(0.0, |sum, c| (sum + c) * p);
        [displacement[leg], scalar.round(z), scalar.round(h)]
    };
    let all: [[f64; 3]; LEGS] = core::array::from_fn(at_rest);
    let parts = all.map(|[still, z, _]| [still, z]);
    Some(Rest { drive, displacement: all.map(|[.., h]| h), rate, bouc_wen: Some(parts), plays })
}

/// Plays after a slow rise from rest to `drive` (cells), and P there, m, with the runtime's roundings.
fn rise(plays: &Plays, drive: f64, scalar: Scalar) -> (Vec<f64>, f64) {
    let round = |value: f64| scalar.round(value);
    let (mut states, mut sum) = (Vec::new(), 0.0);
    for (r, w) in plays.thresholds.iter().zip(&plays.weights) {
        let state = if drive >= 2.0 * r { -r } else { round(r - drive) };
        sum = round(sum + round(w * state));
        states.push(state);
    }
    let p = round(round(round(plays.slope * drive) + sum) - plays.rest);
    (states, p)
}

/// E(`drive`, 0), with the roundings of `specgen_runtime::Grid::rising`. `nodes` as in [`Hysteresis::tables`].
pub(super) fn first_rise(nodes: &[f64], grid: usize, drive: f64, scalar: Scalar) -> f64 {
    let cell = (drive as usize).min(grid - 1);
    let node = |up: usize| nodes[up * (up + 1) / 2];
    let slope = scalar.round(node(cell + 1) - node(cell));
    scalar.round(node(cell) + scalar.round(slope * scalar.round(drive - cell as f64)))
}
