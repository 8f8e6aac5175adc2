//! How far a model is off on a record: % of the displacement's range, after one offset and one line.

use super::RateModel;
use super::forward::predict;
use super::prepare::{self, Prepared};
use crate::branches::branches;
use crate::findings::Findings;
use crate::record::Record;
use crate::regressor::Plane;
use crate::staircase::Staircase;
use crate::trend::{Line, rms_and_max};
use crate::{dead_time, statistics};
use specgen_language::diagnostic::{Diagnostic, codes};

/// A step between two samples by this share of the drive range is a jump, after which the actuator rings.
const JUMP: f64 = 0.1;
/// Samples that are not compared from a jump on.
const SETTLING: usize = 200;
/// Swings of a demagnetisation.
const SWINGS: u32 = 100;
/// The drive of a held-out record may leave the range of the table by this share of it.
const BEYOND: f64 = 0.02;

/// Root mean square error in % of the range, on a record whose start is known.
pub(super) fn on(model: &RateModel, plane: &Plane, p: &Prepared) -> f64 {
    let memory = Staircase::negative_saturation(plane.range);
    let predicted = predict(model, plane, p.record, &p.slope, p.first, memory);
    let y = p.delayed(model.dead_time);
    let compared: Vec<usize> = (0..y.len()).filter(|k| !p.record.weightless[p.first + k]).collect();
    percent(&p.record.time[p.first..], &y, &predicted, &compared)
}

/// A record that no model was fitted to and whose start is unknown.
pub(super) struct Unknown<'a> {
    record: &'a Record,
    first: usize,
    slope: Vec<f64>,
    /// Samples compared, counted from `first`.
    compared: Vec<usize>,
}

impl<'a> Unknown<'a> {
    /// Refuses a record that the table does not cover, or that does not move.
    pub(super) fn new(record: &'a Record, plane: &Plane) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Findings::new(&record.shown_as);
        let span = plane.range[1] - plane.range[0];
        let (low, high) = statistics::extent(&record.drive);
        if low < plane.range[0] - BEYOND * span || high > plane.range[1] + BEYOND * span {
            let message = format!(
                "the drive goes from {low} V to {high} V, outside the table's {} V to {} V",
                plane.range[0], plane.range[1]
            );
            findings.add(codes::DRIVE_RANGE, None, message, "hold out a record inside the range of the table");
            return Err(findings.into_diagnostics());
        }
        let Some(first) = branches(&record.drive, 0, 0.5 * plane.interval()).first().map(|b| b.first) else {
            let message = "the drive moves by less than half a grid interval".to_owned();
            findings.add(codes::VALIDATION_IDLE, None, message, "hold out a record that moves the drive");
            return Err(findings.into_diagnostics());
        };
        let mut settled = first;
        let mut compared = Vec::new();
        for k in first..record.drive.len() {
            if k > first && (record.drive[k] - record.drive[k - 1]).abs() > JUMP * span {
                settled = k + SETTLING;
            }
            if k >= settled && !record.weightless[k] {
                compared.push(k - first);
            }
        }
        Ok(Self { record, first, slope: prepare::slope(record, plane.range), compared })
    }

    /// Error in % of the range with the start that suits best: saturated below or above, or demagnetised.
    pub(super) fn score(&self, model: &RateModel, plane: &Plane) -> f64 {
        let [low, high] = plane.range;
        let drive = self.record.drive[self.first];
        let below = Staircase::negative_saturation(plane.range);
        let mut above = below.clone();
        above.push(high);
        let mut demagnetised = below.clone();
        for k in 0..SWINGS {
            let share = f64::from(k) / f64::from(SWINGS);
            demagnetised.push(high + share * (drive - high));
            demagnetised.push(low + share * (drive - low));
        }
        let y = dead_time::delayed(self.record, model.dead_time).split_off(self.first);
        [below, above, demagnetised].into_iter().fold(f64::INFINITY, |best, memory| {
            let predicted = predict(model, plane, self.record, &self.slope, self.first, memory);
            let error = percent(&self.record.time[self.first..], &y, &predicted, &self.compared);
            if error < best { error } else { best }
        })
    }
}

fn percent(time: &[f64], y: &[f64], predicted: &[f64], compared: &[usize]) -> f64 {
    let at: Vec<f64> = compared.iter().map(|k| time[*k]).collect();
    let mut errors: Vec<f64> = compared.iter().map(|k| y[*k] - predicted[*k]).collect();
    let (low, high) = statistics::extent(&compared.iter().map(|k| y[*k]).collect::<Vec<_>>());
    let line = Line::fit(&at, &errors);
    errors.iter_mut().zip(&at).for_each(|(e, t)| *e -= line.at(*t));
    100.0 * rms_and_max(&errors).0 / (high - low)
}
