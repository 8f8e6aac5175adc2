//! How far a model is off on a record: % of the displacement's range, after one offset and one line.

use super::RateModel;
use super::forward::predict;
use super::prepare::Prepared;
use crate::regressor::Plane;
use crate::staircase::Staircase;
use crate::statistics;
use crate::trend::{Line, rms_and_max};

/// Root mean square error in % of the range, on a record whose start is known.
pub(super) fn on(model: &RateModel, plane: &Plane, p: &Prepared) -> f64 {
    let memory = Staircase::negative_saturation(plane.range);
    let predicted = predict(model, plane, p.record, p.first, memory);
    let y = p.delayed(model.dead_time);
    let compared: Vec<usize> = (0..y.len()).filter(|k| !p.record.weightless[p.first + k]).collect();
    percent(&p.record.time[p.first..], &y, &predicted, &compared)
}

fn percent(time: &[f64], y: &[f64], predicted: &[f64], compared: &[usize]) -> f64 {
    let at: Vec<f64> = compared.iter().map(|k| time[*k]).collect();
    let mut errors: Vec<f64> = compared.iter().map(|k| y[*k] - predicted[*k]).collect();
    let (low, high) = statistics::extent(&compared.iter().map(|k| y[*k]).collect::<Vec<_>>());
    let line = Line::fit(&at, &errors);
    errors.iter_mut().zip(&at).for_each(|(e, t)| *e -= line.at(*t));
    100.0 * rms_and_max(&errors).0 / (high - low)
}
