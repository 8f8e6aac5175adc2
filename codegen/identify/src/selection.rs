//! Selects the samples and branches of a record for the fit, and their weights.

use std::borrow::Cow;
use std::ops::Range;

use super::branches::{self, Branch};
use super::coverage;
use super::findings::Findings;
use super::normal::{self, Normal, Weighting};
use super::record::Record;
use super::regressor::Plane;
use super::report::Branches;
use super::statistics;
use specgen_language::diagnostic::codes;

/// Fraction of the drive range within which the drive counts as being at its minimum.
const AT_MINIMUM: f64 = 0.002;
/// A change of direction is a reversal if the drive goes back by this many grid intervals.
const REVERSAL: f64 = 0.5;
/// Shortest rest at the lowest drive before the curves, s.
const REST: f64 = 0.5;
/// A record has first-order reversal curves if at least this fraction of its rises starts in saturation.
const FIRST_ORDER: f64 = 0.9;
/// Of such a record only the falls are fitted if they excite at least this fraction of the cells that all branches
/// excite.
const FALLS_SUFFICE: f64 = 0.99;

/// The part of a record that identification uses.
pub(crate) struct RecordSpan {
    /// First sample; the drive is at its minimum there and rises after it.
    pub(crate) first: usize,
    /// One past the last sample.
    pub(crate) end: usize,
    /// Branches between its reversals, in order.
    pub(crate) branches: Vec<Branch>,
    /// Falls from a reversal.
    pub(crate) curves: usize,
    /// Whether the record consists of first-order reversal curves.
    pub(crate) first_order: bool,
}

impl RecordSpan {
    /// Removes everything after sample `end`.
    pub(crate) fn until(&mut self, end: usize) {
        let end = if end > self.first { end } else { self.first };
        self.end = end;
        self.branches.iter_mut().filter(|b| b.end > end).for_each(|b| b.end = end);
        self.branches.retain(|b| b.end > b.first + 1);
    }
}

/// The start of a record that hardly ever returns to its lowest drive, such as a growing sine: the first sample that
/// moves. The state there is unknown; `None` if most curves follow a visit to the lowest drive.
fn unknown_start(record: &Record, plane: &Plane, after_visit: Option<usize>) -> Option<usize> {
    let found = |first: usize| branches::branches(&record.drive, first, REVERSAL * plane.interval());
    let all = found(0);
    let curves = |branches: &[Branch]| falls(branches).len();
    let most = after_visit.is_some_and(|first| 2 * curves(&found(first)) >= curves(&all));
    all.first().filter(|_| !most && all.len() > 1).map(|branch| branch.first)
}

/// Whether a record hardly ever returns to its lowest drive.
pub(crate) fn hardly_returns(record: &Record, plane: &Plane) -> bool {
    let tolerance = AT_MINIMUM * (plane.range[1] - plane.range[0]);
    unknown_start(record, plane, branches::first_usable(record, tolerance)).is_some()
}

/// Takes the weight of samples at which the drive goes further than ever before, if the state at the start is unknown:
/// there the record shows cells that were on or off before it. Elsewhere its own extrema have set every cell that
/// switches.
pub(crate) fn mask_unknown(record: &mut Record, plane: &Plane, findings: &mut Findings) {
    let tolerance = AT_MINIMUM * (plane.range[1] - plane.range[0]);
    let Some(first) = unknown_start(record, plane, branches::first_usable(record, tolerance)) else { return };
    let (mut low, mut high) = (record.drive[first], record.drive[first]);
    let mut masked = 0;
    for (u, weightless) in record.drive[first..].iter().zip(&mut record.weightless[first..]) {
        if *u <= low || *u >= high {
            *weightless = true;
            masked += 1;
        }
        (low, high) = (if *u < low { *u } else { low }, if *u > high { *u } else { high });
    }
    let message = format!(
        "starts in an unknown state and hardly returns to its lowest drive: {masked} samples at which the drive goes further than ever before get no weight"
    );
    let help = "begin at the lowest drive, and return to it, if you can; decaying loops do";
    findings.add(codes::RECORD_START, None, message, help);
}

/// Whether the drive rests at its lowest value before sample `first`, or the record begins there: its state, and the
/// absence of earlier creep, are then known.
pub(crate) fn begins_at_rest(record: &Record, plane: &Plane, first: usize) -> bool {
    let minimum = at_minimum(record, plane);
    let stay = record.drive[..=first].iter().rev().take_while(|u| **u <= minimum).count();
    stay > first || stay > 0 && record.time[first] - record.time[first + 1 - stay] >= REST
}

/// The first of joined records: the usable part begins in it, even if another one goes lower.
fn first_part(record: &Record) -> Cow<'_, Record> {
    record.parts.first().map_or(Cow::Borrowed(record), |end| Cow::Owned(record.part(0..*end)))
}

/// Finds the usable part; refuses a record with too few reversal curves.
pub(crate) fn usable(record: &Record, plane: &Plane, findings: &mut Findings) -> Option<RecordSpan> {
    let tolerance = AT_MINIMUM * (plane.range[1] - plane.range[0]);
    let head = first_part(record);
    let after_visit = branches::first_usable(&head, tolerance);
    let Some(first) = unknown_start(&head, plane, after_visit).or(after_visit) else {
        let message = "the drive never rises from its minimum".to_owned();
        let help = format!(
            "start at the lowest drive, then rise to each reversal and fall back; {}",
            coverage::such_a_drive(plane)
        );
        return findings.refuse(codes::TOO_FEW_CURVES, None, message, &help);
    };
    let of_part = |span: Range<usize>| {
        let begin = if span.start > first { span.start } else { first };
        branches::branches(&record.drive[..span.end], begin, REVERSAL * plane.interval())
    };
    let branches: Vec<Branch> = record.spans().flat_map(of_part).collect();
    let curves = coverage::check_curves(&branches, plane, findings);
    if findings.any_error() {
        return None;
    }
    let rises = branches.iter().filter(|b| b.rising);
    let minimum = at_minimum(record, plane);
    let from_saturation = rises.clone().filter(|b| record.drive[b.first] <= minimum).count();
    let first_order = from_saturation as f64 >= FIRST_ORDER * rises.count() as f64;
    Some(RecordSpan { first, end: record.time.len(), branches, curves, first_order })
}

/// Normal equations over the falls of first-order reversal curves, if they excite the plane as well as all branches do;
/// otherwise over all branches, because in other records only rises distinguish cells that switch off together. The
/// third value shows for each cell whether the chosen branches excite it.
pub(crate) fn select(
    plane: &Plane,
    record: &Record,
    used: &RecordSpan,
    target: &[f64],
) -> (Normal, Branches, Vec<bool>) {
    let over = |branches: &[Branch], weighting| {
        normal::accumulate(plane, record, used.first, branches, weighting, 1, |k, values| {
            values[0] = target[k];
        })
    };
    let all = over(&used.branches, Weighting::Even);
    let excited_by_all = coverage::excited(plane, &all.gram);
    if used.first_order {
        let falls = falls(&used.branches);
        let excited_by_falls = coverage::excited(plane, &over(&falls, Weighting::Even).gram);
        if share(&excited_by_falls) >= FALLS_SUFFICE * share(&excited_by_all) {
            let normal = over(&falls, Weighting::AtNodes);
            return (normal, Branches::Descending, excited_by_falls);
        }
    }
    (all, Branches::All, excited_by_all)
}

/// The branches in which the drive falls.
pub(crate) fn falls(branches: &[Branch]) -> Vec<Branch> {
    branches.iter().copied().filter(|b| !b.rising).collect()
}

/// Fraction of the cells that are true.
pub(crate) fn share(excited: &[bool]) -> f64 {
    excited.iter().filter(|e| **e).count() as f64 / excited.len() as f64
}

/// Drift in m/s over the returns to negative saturation, and their number.
pub(crate) fn drift_of_returns(record: &Record, branches: &[Branch], plane: &Plane) -> (f64, usize) {
    let minimum = at_minimum(record, plane);
    let returns: Vec<(f64, f64)> = branches
        .iter()
        .filter(|b| b.rising && record.drive[b.first] <= minimum)
        .map(|b| (record.time[b.first], record.displacement[b.first]))
        .collect();
    (statistics::median_slope(&returns), returns.len())
}

/// Largest drive in V that counts as being at its minimum.
fn at_minimum(record: &Record, plane: &Plane) -> f64 {
    let (low, _) = statistics::extent(&record.drive);
    low + AT_MINIMUM * (plane.range[1] - plane.range[0])
}
