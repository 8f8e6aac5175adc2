//! Runs a rate-dependent model over a record.

use super::{CreepTerm, Inertia, RateModel};
use crate::normal;
use crate::record::Record;
use crate::regressor::{self, Plane};
use crate::staircase::Staircase;

/// The displacement of the model at each sample from `first` on, m above negative saturation, without the dead time.
///
/// `memory` is the state before that sample; creep has settled there.
pub(super) fn predict(model: &RateModel, plane: &Plane, record: &Record, first: usize, memory: Staircase) -> Vec<f64> {
    let (plain, rate) = still(model, plane, &record.time, &record.drive, first, memory);
    let time = &record.time[first..];
    let mut sum = with_creep(model, time, &plain);
    inertia(model, time, &record.drive[first..], &mut sum);
    sum.iter_mut().zip(rate.into_iter().flatten()).for_each(|(y, r)| *y += r);
    sum
}

/// Γ₀ at each sample from `first` on, m, plus u̇ Γ₁ if the model has it; `memory` is the state before.
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
    normal::each_row(memory, plane, drive, first, |k, row| {
        still.push(regressor::evaluate(row, &model.still.nodes));
        if let (Some(rate), Some(part)) = (&model.rate, &mut rate_part) {
            part.push(slope[k] * regressor::evaluate(row, &rate.nodes));
        }
    });
    (still, rate_part)
}

/// f + Σ w_j x_j of a displacement f (m) at `time` (s).
pub(crate) fn with_creep(model: &RateModel, time: &[f64], f: &[f64]) -> Vec<f64> {
    let mut sum = f.to_vec();
    for term in &model.creep {
        let x = creep(term.time_constant, time, f);
        sum.iter_mut().zip(x).for_each(|(y, x)| *y += term.weight * x);
    }
    sum
}

/// Adds the response of the mode to `drive` (V) to `sum` (m) at `time` (s), starting at rest.
pub(crate) fn inertia(model: &RateModel, time: &[f64], drive: &[f64], sum: &mut [f64]) {
    let Some(Inertia { mode, gain }) = model.inertia else { return };
    for ((y, moved), u) in sum.iter_mut().zip(mode.behind(time, drive)).zip(drive) {
        *y += gain * (moved - u);
    }
}

/// x of one creep operator with input `f`, exact for an f that is linear between samples. It starts at rest.
pub(super) fn creep(time_constant: f64, time: &[f64], f: &[f64]) -> Vec<f64> {
    let mut x = f.first().copied().unwrap_or(0.0);
    let mut before = x;
    let mut all = Vec::with_capacity(f.len());
    for (k, &f) in f.iter().enumerate() {
        if k > 0 {
            let step = time[k] - time[k - 1];
            // After a ramp x lags by τ times its slope.
            let behind = (f - before) / step * time_constant;
            x = f - behind + (x - before + behind) * libm::exp(-step / time_constant);
        }
        before = f;
        all.push(x);
    }
    all
}

/// Static displacement over the used part, m.
pub(super) fn static_part(model: &RateModel, plane: &Plane, p: &super::prepare::PreparedRecord) -> Vec<f64> {
    let memory = Staircase::negative_saturation(plane.range);
    still(model, plane, &p.record.time, &p.record.drive, p.first, memory).0
}

/// Static displacement and every creep state of `times` over the used part, m.
pub(super) fn parts(
    still: &RateModel,
    times: &[f64],
    plane: &Plane,
    p: &super::prepare::PreparedRecord,
) -> Vec<Vec<f64>> {
    let f = static_part(still, plane, p);
    let time = &p.record.time[p.first..];
    let states: Vec<Vec<f64>> = times.iter().map(|tau| creep(*tau, time, &f)).collect();
    core::iter::once(f).chain(states).collect()
}

/// The f whose [`with_creep`] is `y`, at rest at the first sample.
pub(super) fn without_creep(model: &RateModel, time: &[f64], y: &[f64]) -> Vec<f64> {
    let total = model.creep.iter().fold(1.0, |sum, term| sum + term.weight);
    let mut f = y.first().copied().unwrap_or(0.0) / total;
    let mut states = vec![f; model.creep.len()];
    let mut all = Vec::with_capacity(y.len());
    for (k, y) in y.iter().enumerate() {
        if k > 0 {
            // x = kept·x + known·f of the last sample + direct·f, as in [`creep`].
            let step = time[k] - time[k - 1];
            let (mut carried, mut direct) = (0.0, 1.0);
            let mut parts = [[0.0; 2]; MOST_TERMS];
            for ((term, x), part) in model.creep.iter().zip(&states).zip(&mut parts) {
                let decay = libm::exp(-step / term.time_constant);
                let lag = term.time_constant / step * (1.0 - decay);
                *part = [decay * x + (lag - decay) * f, 1.0 - lag];
                carried += term.weight * part[0];
                direct += term.weight * part[1];
            }
            f = (y - carried) / direct;
            states.iter_mut().zip(parts).for_each(|(x, [known, of_f])| *x = known + of_f * f);
        }
        all.push(f);
    }
    all
}

/// Most creep operators of a model.
pub(super) const MOST_TERMS: usize = 6;

/// The same terms without those of zero weight.
pub(super) fn nonzero_terms(terms: Vec<CreepTerm>) -> Vec<CreepTerm> {
    terms.into_iter().filter(|term| term.weight > 0.0).collect()
}
