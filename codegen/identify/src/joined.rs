//! Several records of one leg as one, for example reversal curves at two rates.

use super::findings::Findings;
use super::record::Record;
use super::regressor::Plane;
use super::{coverage, defects, selection};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Pause between two records, s. The real one is unknown; fast creep ends within it, and slow creep starts free.
const PAUSE: f64 = 1.0;
/// Grid on which the usable part of a record is found: a further record may have few curves.
const PROBE: usize = 8;

/// `records` (at least one) over `drive` (V) as one: each further one is repaired and begins with its first usable
/// sample. A single record stays as it is.
///
/// # Errors
/// All findings if a record does not cover the range, or has fewer than three reversal curves.
pub fn join(records: &[Record], drive: [f64; 2]) -> Result<Record, Vec<Diagnostic>> {
    let [one, further @ ..] = records else { return Err(Vec::new()) };
    if further.is_empty() {
        return Ok(one.clone());
    }
    let plane = Plane { grid: PROBE, range: drive };
    let mut all: Option<Record> = None;
    let (mut warnings, mut refused) = (Vec::new(), Vec::new());
    for record in records {
        let mut findings = Findings::after(&record.shown_as, &record.warnings);
        let part = usable_part(record, &plane, all.is_some(), &mut findings);
        match findings.conclude(part) {
            Ok((part, found)) => {
                warnings.extend(found);
                all = Some(match all {
                    Some(all) => append(all, &part),
                    None => part,
                });
            }
            Err(found) => refused.extend(found),
        }
    }
    match all.filter(|_| refused.is_empty()) {
        Some(all) => Ok(Record { warnings, ..all }),
        None => Err(warnings.into_iter().chain(refused).collect()),
    }
}

/// The record without its defects; a `further` one from its first usable sample on.
fn usable_part(record: &Record, plane: &Plane, further: bool, findings: &mut Findings) -> Option<Record> {
    coverage::check_range(record, plane, selection::hardly_returns(record, plane), findings);
    if findings.any_error() {
        return None;
    }
    let record = defects::repaired(record, plane.range, plane.grid, findings);
    if !further {
        return Some(record);
    }
    let first = selection::usable(&record, plane, findings)?.first;
    if !selection::begins_at_rest(&record, plane, first) {
        rest_unknown(&record, first, findings);
    }
    Some(record.part(first..record.time.len()))
}

/// Warns of a record whose first used sample, `first`, does not follow a rest.
pub(crate) fn rest_unknown(record: &Record, first: usize, findings: &mut Findings) {
    let message = format!(
        "rest state unknown: the drive does not rest at its lowest value before the curves ({} V at {} s)",
        record.drive[first], record.time[first]
    );
    let help = "let the drive rest at its lowest value for a second before the curves";
    findings.add(codes::REST_UNKNOWN, None, message, help);
}

fn append(all: Record, next: &Record) -> Record {
    let Record { shown_as, mut time, mut drive, monitored, mut displacement, mut weightless, .. } = all;
    let mut parts = all.parts;
    parts.push(time.len());
    let later = time.last().copied().unwrap_or_default() + PAUSE - next.time[0];
    time.extend(next.time.iter().map(|t| t + later));
    drive.extend(&next.drive);
    displacement.extend(&next.displacement);
    weightless.extend(&next.weightless);
    Record {
        shown_as: format!("{shown_as}, {}", next.shown_as),
        time,
        drive,
        monitored: monitored && next.monitored,
        displacement,
        weightless,
        simulated: all.simulated || next.simulated,
        parts,
        warnings: Vec::new(),
    }
}
