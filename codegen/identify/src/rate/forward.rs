//! A rate-dependent model run forward over a record.

use super::{CreepTerm, RateModel};
use crate::normal;
use crate::record::Record;
use crate::regressor::{self, Plane};
use crate::staircase::Staircase;

/// The displacement of the model at each sample from `first` on, m above negative saturation, without the dead time.
///
/// `memory` is what came before that sample; creep has come to rest there.
pub(super) fn predict(model: &RateModel, plane: &Plane, record: &Record, first: usize, memory: Staircase) -> Vec<f64> {
    let (plain, rate) = still(model, plane, &record.time, &record.drive, first, memory);
    let mut sum = creeping(model, &record.time[first..], &plain);
    sum.iter_mut().zip(rate.into_iter().flatten()).for_each(|(y, r)| *y += r);
    sum
}

/// Γ₀ at each sample from `first` on, m, and u̇ Γ₁ where the model has it; `memory` is what came before.
pub(crate) fn still(
    model: &RateModel,
    plane: &Plane,
    time: &[f64],
    drive: &[f64],
    first: usize,
    memory: Staircase,
) -> (Vec<f64>, Option<Vec<f64>>) {
    let mut still = Vec::with_capacity(drive.len() - first);
    let mut rate_part = model.rate.as_ref().map(|_| Vec::with_capacity(drive.len() - first));
    let slope = if model.rate.is_some() { super::prepare::slope(time, drive, plane.range) } else { Vec::new() };
    normal::each_row_from(memory, plane, drive, first, |k, row| {
        still.push(regressor::evaluate(row, &model.still.nodes));
        if let (Some(rate), Some(part)) = (&model.rate, &mut rate_part) {
            part.push(slope[k] * regressor::evaluate(row, &rate.nodes));
        }
    });
    (still, rate_part)
}

/// f + Σ w_j x_j of a displacement f (m) at `time` (s).
pub(crate) fn creeping(model: &RateModel, time: &[f64], f: &[f64]) -> Vec<f64> {
    let mut sum = f.to_vec();
    for term in &model.creep {
        let x = creep(term.time_constant, time, f);
        sum.iter_mut().zip(x).for_each(|(y, x)| *y += term.weight * x);
    }
    sum
}

/// x of one creep operator behind `f`, exact for an f that is straight between samples. It starts at rest.
pub(super) fn creep(time_constant: f64, time: &[f64], f: &[f64]) -> Vec<f64> {
    let mut x = f.first().copied().unwrap_or(0.0);
    let mut before = x;
    let mut all = Vec::with_capacity(f.len());
    for (k, &f) in f.iter().enumerate() {
        if k > 0 {
            let step = time[k] - time[k - 1];
            // Behind a ramp x lags by τ times its slope.
            let behind = (f - before) / step * time_constant;
            x = f - behind + (x - before + behind) * libm::exp(-step / time_constant);
        }
        before = f;
        all.push(x);
    }
    all
}

/// Static displacement and every creep state of `times` over the used part, m.
pub(super) fn parts(still: &RateModel, times: &[f64], plane: &Plane, p: &super::prepare::Prepared) -> Vec<Vec<f64>> {
    let plain = RateModel { creep: Vec::new(), rate: None, ..still.clone() };
    let memory = Staircase::negative_saturation(plane.range);
    let f = predict(&plain, plane, p.record, p.first, memory);
    let time = &p.record.time[p.first..];
    let states: Vec<Vec<f64>> = times.iter().map(|tau| creep(*tau, time, &f)).collect();
    core::iter::once(f).chain(states).collect()
}

/// The same terms without those of no weight.
pub(super) fn kept(terms: Vec<CreepTerm>) -> Vec<CreepTerm> {
    terms.into_iter().filter(|term| term.weight > 0.0).collect()
}
