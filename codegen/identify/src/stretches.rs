//! Stretches of a record: the samples between gaps, as a logger leaves them when it empties its buffer, and the runs of a
//! file in which time starts again.

use std::ops::Range;

use super::findings::Findings;
use super::statistics::median;
use super::tables::Choice;
use specgen_language::diagnostic::codes;

/// A sampling interval this many times the median is a gap: a reversal may be hidden in it.
pub(crate) const GAP: f64 = 10.0;
/// Least number of samples of a stretch that is a record of its own.
const LEAST: usize = 100;
/// Stretches that a note names.
const NAMED: usize = 4;

/// The stretch of rising `time` (s) without gaps that the user chose, or else the longest, with a note of what is left out;
/// `None` if there is only one, or none is long enough, or after a choice that is not there was reported.
pub(crate) fn chosen(time: &[f64], choice: Choice, findings: &mut Findings) -> Option<Range<usize>> {
    let mut intervals: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let gap = GAP * median(&mut intervals);
    let breaks = time.windows(2).enumerate().filter(|(_, w)| (w[1] - w[0]).abs() > gap).map(|(k, _)| k + 1);
    let mut first = 0;
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for end in breaks.chain([time.len()]) {
        stretches.push(first..end);
        first = end;
    }
    // The first of equals.
    let longest = stretches.iter().rev().max_by_key(|stretch| stretch.len())?.clone();
    let shown = |stretch: &Range<usize>| format!("{} s to {} s", time[stretch.start], time[stretch.end - 1]);
    // A time that is wrong looks like a run of a few samples.
    let is_wrong = |pair: &[Range<usize>]| {
        time[pair[1].start] < time[pair[0].end - 1] && pair.iter().any(|stretch| stretch.len() < LEAST)
    };
    let is_whole = gap <= 0.0 || stretches.len() < 2 || longest.len() < LEAST || stretches.windows(2).any(is_wrong);
    if is_whole {
        stretches.truncate(1);
    }
    let listed = |(k, stretch): (usize, &Range<usize>)| format!("{} ({})", choice.series_of(k + 1), shown(stretch));
    if let Some(number) = choice.stretch {
        return match stretches.get(number - 1) {
            Some(stretch) => Some(stretch.clone()).filter(|_| !is_whole),
            None => {
                let all: Vec<String> = stretches.iter().enumerate().take(NAMED).map(listed).collect();
                let message = format!(
                    "`--series` names stretch {number} between gaps in time; the table has {}",
                    if is_whole { "one".to_owned() } else { all.join(", ") }
                );
                let help = "name one of them, or none for the longest";
                findings.refuse(codes::RECORD_HEADER, None, message, help)
            }
        };
    }
    if is_whole {
        return None;
    }
    let others = stretches.iter().enumerate().filter(|(_, other)| **other != longest);
    let others: Vec<String> = others.map(listed).collect();
    let more = others.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let message = format!(
        "time has gaps or starts again: the longest stretch without, from {} ({} samples), is read; not read: {}{more}",
        shown(&longest),
        longest.len(),
        others[..others.len().min(NAMED)].join(", ")
    );
    let next = stretches
        .iter()
        .enumerate()
        .filter(|(_, other)| **other != longest)
        .rev()
        .max_by_key(|(_, stretch)| stretch.len());
    let next = next.map_or_else(String::new, |(k, _)| choice.series_of(k + 1));
    let help = format!("`--series {next}` reads another stretch; record without gaps, one run in each file");
    findings.add(codes::RECORD_PART, None, message, &help);
    Some(longest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(time: &[f64]) -> (Option<Range<usize>>, usize) {
        let mut findings = Findings::new("r.csv");
        let found = chosen(time, Choice::default(), &mut findings);
        (found, findings.into_diagnostics().len())
    }

    #[test]
    fn gaps_and_restarts_end_a_stretch() {
        let run = |first: f64, count: usize| (0..count).map(move |k| first + 1e-3 * k as f64);
        let gaps: Vec<f64> = (0..3).flat_map(|second| run(f64::from(second), 950 - second as usize)).collect();
        assert_eq!(found(&gaps), (Some(0..950), 1));
        let restarted: Vec<f64> = run(0.0, 200).chain(run(0.0, 300)).collect();
        assert_eq!(found(&restarted), (Some(200..500), 1));
        assert_eq!(found(&run(0.0, 300).collect::<Vec<_>>()), (None, 0));
        // Bursts that are too short, a repeated time, and times in the wrong order.
        assert_eq!(found(&(0..50).flat_map(|k| run(f64::from(k), 20)).collect::<Vec<_>>()), (None, 0));
        let mut swapped: Vec<f64> = run(0.0, 300).collect();
        swapped.swap(100, 101);
        swapped[200] = swapped[199];
        swapped[250] = 0.01;
        assert_eq!(found(&swapped), (None, 0));
        assert_eq!(found(&[]), (None, 0));
    }
}
