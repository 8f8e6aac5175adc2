//! Error of a model on a record: % of the displacement's range, after removal of the record's own columns.

use super::RateModel;
use super::forward::predict;
use super::prepare::PreparedRecord;
use crate::regressor::Plane;
use crate::staircase::Staircase;
use crate::statistics;

/// Root mean square error in % of the range, on a record whose start state is known except for creep and mode.
pub(super) fn on(model: &RateModel, plane: &Plane, p: &PreparedRecord) -> f64 {
    let memory = Staircase::negative_saturation(plane.range);
    let predicted = predict(model, plane, p.record, p.first, memory);
    let y = p.delayed(model.dead_time);
    let weightless = &p.record.weightless[p.first..];
    let compared: Vec<f64> = y.iter().zip(weightless).filter(|(_, w)| !**w).map(|(y, _)| *y).collect();
    let times: Vec<f64> = model.creep.iter().map(|term| term.time_constant).collect();
    let own = p.own(&times, model.inertia.map(|inertia| inertia.mode));
    let mut errors: Vec<f64> = y.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    own.take_out(&mut errors);
    let (low, high) = statistics::extent(&compared);
    100.0 * (own.dot(&errors, &errors) / compared.len() as f64).sqrt() / (high - low)
}
