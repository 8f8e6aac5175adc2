//! Results of the comparison of the options.

use serde::Serialize;

use super::period::Invertible;
use super::predict::{Drive, predict};
use super::prepare::PreparedRecord;
use super::{CreepTerm, Inertia, RateModel, RateOption, forward};
use crate::mode::Ring;
use crate::record::Record;
use crate::regressor::Plane;
use crate::staircase::Staircase;
use crate::statistics::{extent, mean, noise_floor};
use specgen_language::diagnostic::Diagnostic;

/// Least fraction by which an option's error must be below the static table's.
const BEATS: f64 = 0.02;

/// A record of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RateRecord {
    /// Name of the record.
    pub record: String,
    /// Whether a comment in it marks it as simulated.
    pub simulated: bool,
    /// Curves per second, Hz.
    pub frequency: f64,
    /// Median |u̇|, V/s.
    pub speed: f64,
    /// Samples of the record that were fitted.
    pub samples: usize,
    /// Range of the displacement over them, m.
    pub range: f64,
    /// White noise, % of the range: the lower limit of any model's error.
    pub noise_percent: f64,
}

impl RateRecord {
    /// The frequency to two digits, with its unit.
    #[must_use]
    pub fn frequency_text(&self) -> String {
        let decimals = if self.frequency < 1.0 { 2 } else { usize::from(self.frequency < 9.95) };
        format!("{:.decimals$} Hz", self.frequency)
    }
}

/// One option. Errors are rms in % of each record's range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptionReport {
    /// The option.
    pub option: RateOption,
    /// Its fitted dead time, s.
    pub dead_time: f64,
    /// Its fitted creep terms; empty for options without creep.
    pub creep: Vec<CreepTerm>,
    /// The part of the mode; `None` for options without it.
    pub inertia: Option<Inertia>,
    /// Dynamic Preisach: the shortest period at which a controller can invert it, s. `check` refuses a shorter one.
    pub period: Option<f64>,
    /// Fitted to all records.
    pub fitted: Vec<f64>,
    /// Error on each record of the fit to the others.
    pub left_out: Vec<f64>,
    /// On the record that was excluded from all fits.
    pub hold_out: Option<f64>,
}

/// The record that was excluded from all fits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HoldOut {
    /// Name of the record.
    pub record: String,
}

/// Whether an option predicts an unseen rate better than the static table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// The option with the lowest mean error on unseen rates.
    pub best: RateOption,
    /// Options that are better than the static table on every such rate, and on the held-out record if there is one.
    pub beats_static: Vec<RateOption>,
    /// The same in words.
    pub text: String,
}

/// Figures of every option on every record, and the conclusions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RateReport {
    /// Intervals per axis of the tables.
    pub grid: usize,
    /// The records, in the order given.
    pub records: Vec<RateRecord>,
    /// Part of each dead time that is the hold of the records' commands, s: half a sampling interval, averaged over the
    /// records.
    pub held: f64,
    /// The ring that shows the mode of the last option.
    pub ring: Option<Ring>,
    /// The record held out.
    pub hold_out: Option<HoldOut>,
    /// The options, plainest first.
    pub options: Vec<OptionReport>,
    /// The option to choose, and why.
    pub verdict: Verdict,
}

/// `left_out[k]` are the options fitted without record k.
pub(super) fn report(
    plane: &Plane,
    prepared: &[PreparedRecord],
    models: &[RateModel],
    left_out: &[Vec<RateModel>],
    ring: Option<Ring>,
    hold_out: Option<&Record>,
) -> Result<RateReport, Vec<Diagnostic>> {
    let held_out = |model: &RateModel| -> Result<Option<f64>, Vec<Diagnostic>> {
        let Some(record) = hold_out else { return Ok(None) };
        Ok(predict(model, &Drive::from(record))?.compared.map(|compared| compared.rms_percent))
    };
    let hold_outs = models.iter().map(held_out).collect::<Result<Vec<_>, _>>()?;
    let options: Vec<OptionReport> = RateOption::ALL
        .into_iter()
        .zip(models)
        .zip(hold_outs)
        .enumerate()
        .map(|(k, ((option, model), hold_out))| OptionReport {
            option,
            dead_time: model.dead_time,
            creep: model.creep.clone(),
            inertia: model.inertia,
            period: model.rate.as_ref().map(|rate| Invertible::of(&model.still, rate).period()),
            fitted: prepared.iter().map(|p| error_on(model, plane, p)).collect(),
            left_out: prepared.iter().zip(left_out).map(|(p, fits)| error_on(&fits[k], plane, p)).collect(),
            hold_out,
        })
        .collect();
    let records: Vec<RateRecord> = prepared.iter().map(figures_of).collect();
    let verdict = verdict(&records, &options, hold_out);
    let hold_out = hold_out.map(|record| HoldOut { record: record.shown_as.clone() });
    let held = mean(&prepared.iter().map(|p| p.record.held()).collect::<Vec<_>>());
    Ok(RateReport { grid: plane.grid, records, held, ring, hold_out, options, verdict })
}

fn figures_of(p: &PreparedRecord) -> RateRecord {
    let y = &p.record.displacement[p.first..];
    let (low, high) = extent(y);
    RateRecord {
        record: p.record.shown_as.clone(),
        simulated: p.record.simulated,
        frequency: p.frequency,
        speed: p.speed,
        samples: p.samples(),
        range: high - low,
        noise_percent: 100.0 * noise_floor(y) / (high - low),
    }
}

fn verdict(records: &[RateRecord], options: &[OptionReport], hold_out: Option<&Record>) -> Verdict {
    let plain = &options[0];
    let mut best = plain;
    let mut beats_static = Vec::new();
    let mut lines = Vec::new();
    for option in &options[1..] {
        if mean(&option.left_out) < mean(&best.left_out) {
            best = option;
        }
        let is_better = |ours: f64, theirs: f64| ours < theirs * (1.0 - BEATS);
        let cases = option
            .left_out
            .iter()
            .zip(&plain.left_out)
            .zip(records)
            .map(|((ours, theirs), record)| (record.frequency_text(), *ours, *theirs));
        let held =
            option.hold_out.zip(plain.hold_out).map(|(ours, theirs)| ("the held-out record".to_owned(), ours, theirs));
        let cases: Vec<(String, f64, f64)> = cases.chain(held).collect();
        let say = |won: bool| -> Vec<String> {
            let kept = cases.iter().filter(|(_, ours, theirs)| is_better(*ours, *theirs) == won);
            kept.map(|(name, ours, theirs)| format!("{name} ({ours:.3} against {theirs:.3} %)")).collect()
        };
        let (won, lost) = (say(true), say(false));
        let name = option.option.name();
        lines.push(if lost.is_empty() {
            beats_static.push(option.option);
            format!("{name} beats the static table on what it was not fitted on: {}", won.join(", "))
        } else if won.is_empty() {
            format!("{name} does NOT beat the static table on what it was not fitted on: {}", lost.join(", "))
        } else {
            format!("{name} beats the static table on {}, but not on {}", won.join(", "), lost.join(", "))
        });
    }
    if beats_static.is_empty() {
        let held = if hold_out.is_some() { " and the held-out record" } else { "" };
        lines.push(format!("no option beats the static table on every rate that it was not fitted on{held}"));
    }
    Verdict { best: best.option, beats_static, text: lines.join("\n") }
}

/// Root mean square error of a model in % of the displacement's range, on a record whose start state is known except for
/// creep and mode, after removal of the record's own columns.
fn error_on(model: &RateModel, plane: &Plane, p: &PreparedRecord) -> f64 {
    let memory = Staircase::negative_saturation(plane.range);
    let predicted = forward::predict(model, plane, p.record, p.first, memory);
    let y = p.delayed(model.dead_time);
    let weightless = &p.record.weightless[p.first..];
    let compared: Vec<f64> = y.iter().zip(weightless).filter(|(_, w)| !**w).map(|(y, _)| *y).collect();
    let times: Vec<f64> = model.creep.iter().map(|term| term.time_constant).collect();
    let own = p.own(&times, model.inertia.map(|inertia| inertia.mode));
    let mut errors: Vec<f64> = y.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    own.take_out(&mut errors);
    let (low, high) = extent(&compared);
    100.0 * (own.dot(&errors, &errors) / compared.len() as f64).sqrt() / (high - low)
}
