//! Cuts the drive of a record into monotone branches between its reversals, and finds where the record becomes usable.

use super::record::Record;
use super::statistics::extent;

/// A branch: the drive goes from one reversal to the next, samples `first..end`.
///
/// Samples during which the drive is held at a reversal belong to no branch: they show only creep, not hysteresis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Branch {
    /// Its first sample.
    pub first: usize,
    /// One past the last sample.
    pub end: usize,
    /// Whether the drive rises.
    pub rising: bool,
}

/// Branches of `drive` from sample `first` on. A change of direction counts as a reversal if the drive goes back by at
/// least `retreat` (V).
#[must_use]
pub fn branches(drive: &[f64], first: usize, retreat: f64) -> Vec<Branch> {
    let mut found = Vec::new();
    // Last sample of the start point, then the span of samples at the extremum reached so far.
    let mut start = first;
    let (mut peak_first, mut peak_last) = (first, first);
    let mut rising = None;
    for (k, &u) in drive.iter().enumerate().skip(first) {
        let peak = drive[peak_first];
        match rising {
            None => {
                if u == drive[start] {
                    start = k;
                    (peak_first, peak_last) = (k, k);
                } else if (u - drive[start]).abs() >= retreat {
                    rising = Some(u > drive[start]);
                    (peak_first, peak_last) = (k, k);
                }
            }
            Some(up) => {
                let advance = if up { u - peak } else { peak - u };
                if advance > 0.0 {
                    (peak_first, peak_last) = (k, k);
                } else if advance == 0.0 {
                    peak_last = k;
                } else if -advance >= retreat {
                    found.push(Branch { first: start, end: peak_first + 1, rising: up });
                    start = peak_last;
                    (peak_first, peak_last) = (k, k);
                    rising = Some(!up);
                }
            }
        }
    }
    if let Some(rising) = rising {
        found.push(Branch { first: start, end: peak_first + 1, rising });
    }
    found.retain(|b| b.end > b.first + 1);
    found
}

/// Fraction of the displacement range by which the displacement may still move in the second half of a hold.
const SETTLED: f64 = 0.01;
/// A hold shorter than this many samples cannot be evaluated and counts as settled.
const JUDGED_HOLD: usize = 8;

/// The first sample that identification may use, or `None` if the drive never leaves its minimum.
///
/// Before the drive has been at its minimum (within `tolerance`, V) the state is unknown, so nothing earlier is used.
/// The record starts with the last sample of that stay at the minimum. If the displacement still moves in the second
/// half of the stay (ringing or creep after a jump to the minimum), the next visit of the minimum is used instead; if
/// none is better, the last visit.
#[must_use]
pub fn first_usable(record: &Record, tolerance: f64) -> Option<usize> {
    let drive = &record.drive;
    let (low, _) = extent(drive);
    let settled = SETTLED * record.displacement_range();
    let mut fallback = None;
    let mut at = 0;
    while at < drive.len() {
        if drive[at] > low + tolerance {
            at += 1;
            continue;
        }
        let stay = drive[at..].iter().take_while(|&&u| u <= low + tolerance).count();
        let end = at + stay;
        if end >= drive.len() {
            break;
        }
        // The last sample at the exact minimum of this stay.
        let (least, _) = extent(&drive[at..end]);
        let leaves = at + drive[at..end].iter().rposition(|&u| u == least).unwrap_or(0);
        let (bottom, top) = extent(&record.displacement[at + (leaves - at) / 2..=leaves]);
        if leaves - at < JUDGED_HOLD || top - bottom <= settled {
            return Some(leaves);
        }
        fallback = fallback.or(Some(leaves));
        at = end;
    }
    fallback
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_end_at_reversals_and_leave_out_holds() {
        let drive = [0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 2.9, 3.0, 2.0, 1.0, 0.0, 1.0, 2.0];
        let found = branches(&drive, 0, 0.5);
        assert_eq!(
            found,
            [
                Branch { first: 1, end: 5, rising: true },
                Branch { first: 7, end: 11, rising: false },
                Branch { first: 10, end: 13, rising: true },
            ]
        );
    }

    #[test]
    fn a_constant_drive_has_no_branches() {
        assert!(branches(&[1.0; 20], 0, 0.1).is_empty());
    }
}
