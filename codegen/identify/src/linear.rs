//! The linear relation Y = ρX + δ of an actuator at each frequency (paper, Table 1 and Fig. 4), the gain ratio λ = ρ/ρ̂
//! that follows, and the weights of the run-to-run adaptation that are stable over it (Appendix B).

use serde::Serialize;

use super::findings::Findings;
use super::least_squares::{fit, mean_square};
use super::record::Record;
use super::statistics::{centred, extent, mean_and_error, median};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_numerics::{ewma_limit, pcc_limit};

/// The relation in one record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Relation {
    /// Name of the record.
    pub record: String,
    /// Whether a comment in it marks it as simulated.
    pub simulated: bool,
    /// Frequency of the cycles, Hz.
    pub frequency: f64,
    /// Whether the frequency was found in the record (otherwise given).
    pub frequency_detected: bool,
    /// Whole cycles that the line was fitted to.
    pub cycles: usize,
    /// Start and end of these cycles, s.
    pub span: [f64; 2],
    /// Slope ρ of the line, m/V.
    pub gain: f64,
    /// Standard error of ρ, m/V: from cycle to cycle if there are three or more, otherwise from the line's residual.
    pub gain_error: f64,
    /// Displacement δ of the line at 0 V, m.
    pub offset: f64,
    /// Correlation of X and Y.
    pub correlation: f64,
    /// Largest difference of rise and fall at the same voltage, m.
    pub loop_width: f64,
    /// The same in % of the displacement range.
    pub loop_percent: f64,
    /// Root mean square distance from the line, m.
    pub residual_rms: f64,
}

/// The relations of all records, and their joint results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearReport {
    /// One relation for each record, by rising frequency.
    pub relations: Vec<Relation>,
    /// Reference gain ρ̂ of λ, m/V.
    pub reference_gain: f64,
    /// Frequency of ρ̂, Hz.
    pub reference_frequency: f64,
    /// Least and largest λ = ρ/ρ̂, two standard errors included.
    pub gain_ratio: [f64; 2],
    /// Largest ω for which EWMA is stable on a leg without dynamics over that interval (AII.18 corrected to λω < 2), at most 1.
    pub largest_ewma_weight: f64,
    /// Largest ω1 for which PCC is, with ω2/ω1 as printed in the paper, 0.011/0.252 (AII.19), at most 1.
    pub largest_pcc_weight: f64,
}

/// ω2/ω1 of the paper.
pub const PAPER_PROPORTION: f64 = 0.011 / 0.252;
/// A crossing counts once the drive was beyond this fraction of its half range on the other side.
const ARMED: f64 = 0.3;
/// Largest relative difference in length of cycles.
const STEADY: f64 = 0.2;
/// Voltages at which the loop's width is measured.
const WIDTHS: usize = 40;

/// The relation in `record`; `frequency` (Hz) if it is known, otherwise it is found from the crossings of the drive.
///
/// # Errors
/// E0625 if the record holds no whole cycle, E0626 if its cycles are not alike or contradict `frequency`.
pub fn relation(record: &Record, frequency: Option<f64>) -> Result<Relation, Vec<Diagnostic>> {
    let mut findings = Findings::new(&record.shown_as);
    let relation = relation_checked(record, frequency, &mut findings);
    findings.conclude(relation).map(|(relation, _)| relation)
}

fn relation_checked(record: &Record, frequency: Option<f64>, findings: &mut Findings) -> Option<Relation> {
    let starts = cycle_starts(&record.drive);
    let crossings: Vec<f64> = starts.iter().map(|&k| record.time[k]).collect();
    let duration = record.time[record.time.len() - 1] - record.time[0];
    if starts.len() < 2 {
        // A record from one trough to the next has a cycle, but no two upward crossings: its frequency must be given.
        let Some(frequency) = frequency.filter(|f| duration * f >= 0.99) else {
            let (start, end, crossed) = (record.time[0], record.time[record.time.len() - 1], starts.len());
            let message = format!(
                "from {start} s to {end} s the drive crosses its middle upward {crossed} times: there is no whole cycle to find the frequency from"
            );
            let help = "record two cycles or more, or give --frequency for a record of exactly one cycle";
            return findings.refuse(codes::NO_CYCLE, None, message, help);
        };
        let end = record.time.iter().rposition(|t| *t <= record.time[0] + 1.0001 / frequency)?;
        return line(record, frequency, false, &[0, end], findings);
    }
    let mut periods: Vec<f64> = crossings.windows(2).map(|w| w[1] - w[0]).collect();
    let typical = median(&mut periods);
    if let Some(k) = crossings.windows(2).position(|w| ((w[1] - w[0]) / typical - 1.0).abs() > STEADY) {
        let (start, end, lasted) = (crossings[k], crossings[k + 1], crossings[k + 1] - crossings[k]);
        let message = format!(
            "the cycle from {start} s to {end} s lasts {lasted:.4e} s, the others {typical:.4e} s: the record has no one frequency"
        );
        let help = "record each frequency by itself: sines or triangles of one amplitude";
        return findings.refuse(codes::FREQUENCY_UNCLEAR, None, message, help);
    }
    let found = (crossings.len() - 1) as f64 / (crossings[crossings.len() - 1] - crossings[0]);
    if let Some(given) = frequency.filter(|given| (given / found - 1.0).abs() > STEADY) {
        let message = format!(
            "the drive has {found:.4} Hz (cycle from {} s to {} s), but {given} Hz was given",
            crossings[0], crossings[1]
        );
        let help = "give the frequencies in the order of the records, or leave --frequency out";
        return findings.refuse(codes::FREQUENCY_UNCLEAR, None, message, help);
    }
    // The first cycle is for settling, if there are others.
    let from = usize::from(starts.len() > 3);
    line(record, frequency.unwrap_or(found), frequency.is_none(), &starts[from..], findings)
}

/// First samples after upward crossings of the middle of the drive.
fn cycle_starts(drive: &[f64]) -> Vec<usize> {
    let (low, high) = extent(drive);
    let middle = 0.5 * (low + high);
    let armed = middle - ARMED * 0.5 * (high - low);
    let mut below = false;
    let mut starts = Vec::new();
    for (k, u) in drive.iter().enumerate() {
        if *u < armed {
            below = true;
        } else if below && *u >= middle {
            starts.push(k);
            below = false;
        }
    }
    starts
}

fn line(
    record: &Record,
    frequency: f64,
    detected: bool,
    starts: &[usize],
    findings: &mut Findings,
) -> Option<Relation> {
    let (first, end) = (*starts.first()?, *starts.last()?);
    let straight = |from: usize, to: usize| {
        let kept: Vec<usize> = (from..to).filter(|&k| !record.weightless[k]).collect();
        let x: Vec<f64> = kept.iter().map(|&k| record.drive[k]).collect();
        let y: Vec<f64> = kept.iter().map(|&k| record.displacement[k]).collect();
        let one = vec![1.0; x.len()];
        fit(&[&one, &x], &y).map(|found| (found, x, y))
    };
    let Some((found, x, y)) = straight(first, end) else {
        let message = format!("from {} s to {} s the drive hardly moves", record.time[first], record.time[end]);
        return findings.refuse(codes::NO_CYCLE, None, message, "record whole cycles of the drive");
    };
    let count = x.len() as f64;
    let square = mean_square(&found.residual);
    let each: Vec<f64> =
        starts.windows(2).filter_map(|w| straight(w[0], w[1])).map(|(found, ..)| found.coefficients[1]).collect();
    let gain_error = if each.len() >= 3 {
        mean_and_error(&each).1
    } else {
        // The loop is not noise: the residual of the line counts as one sample per branch.
        (square * found.covariance[(1, 1)] * count / (2.0 * (starts.len() - 1) as f64)).sqrt()
    };
    let (bottom, top) = extent(&y);
    let unexplained = square / mean_square(&centred(y));
    let loop_width = widest(record, first, end, found.coefficients[1]);
    Some(Relation {
        record: record.shown_as.clone(),
        simulated: record.simulated,
        frequency,
        frequency_detected: detected,
        cycles: starts.len() - 1,
        span: [record.time[first], record.time[end]],
        gain: found.coefficients[1],
        gain_error,
        offset: found.coefficients[0],
        correlation: if unexplained < 1.0 { (1.0 - unexplained).sqrt() } else { 0.0 },
        loop_width,
        loop_percent: 100.0 * loop_width / (top - bottom),
        residual_rms: square.sqrt(),
    })
}

/// Largest difference of the mean displacement in falls and in rises at the same voltage, m. `gain` (m/V) compensates
/// voltage differences within a bin.
fn widest(record: &Record, first: usize, end: usize, gain: f64) -> f64 {
    let drive = &record.drive;
    let (low, high) = extent(&drive[first..end]);
    let mut sums = vec![[(0.0, 0.0); 2]; WIDTHS];
    let (mut rising, mut turn) = (true, drive[first]);
    for (k, &u) in drive.iter().enumerate().take(end).skip(first) {
        // A change of direction counts from a fiftieth of the range on: noise of the drive column is not a reversal.
        let back = if rising { turn - u } else { u - turn };
        if back > 0.02 * (high - low) {
            rising = !rising;
            turn = u;
        } else if back < 0.0 {
            turn = u;
        }
        if record.weightless[k] || back > 0.0 {
            continue;
        }
        let position = (u - low) / (high - low) * WIDTHS as f64;
        let bin = (position as usize).min(WIDTHS - 1);
        let (sum, count) = &mut sums[bin][usize::from(rising)];
        *sum += record.displacement[k] - gain * u;
        *count += 1.0;
    }
    let both = sums.iter().filter(|[fall, rise]| fall.1 > 0.0 && rise.1 > 0.0);
    both.map(|[fall, rise]| (fall.0 / fall.1 - rise.0 / rise.1).abs()).fold(0.0, |w, d| if d > w { d } else { w })
}

/// Combines the relations. ρ̂ is that at `reference` (Hz, the nearest one), otherwise at the lowest frequency.
///
/// # Errors
/// E0625 if there is no relation, or one of them has no gain.
pub fn together(mut relations: Vec<Relation>, reference: Option<f64>) -> Result<LinearReport, Vec<Diagnostic>> {
    relations.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    let apart = |f: f64, wanted: f64| libm::log(f / wanted).abs();
    let chosen = match reference {
        None => relations.first(),
        Some(wanted) => {
            relations.iter().min_by(|a, b| apart(a.frequency, wanted).total_cmp(&apart(b.frequency, wanted)))
        }
    };
    let Some(chosen) = chosen else { return Err(Vec::new()) };
    if let Some(bad) = relations.iter().find(|r| r.gain.is_nan() || r.gain <= 0.0) {
        let mut findings = Findings::new(&bad.record);
        let message = format!("from {} s to {} s the gain is {:e} um/V", bad.span[0], bad.span[1], bad.gain * 1e6);
        findings.add(codes::NO_CYCLE, None, message, "the displacement must rise with the drive");
        return Err(findings.into_diagnostics());
    }
    let (reference_gain, reference_frequency) = (chosen.gain, chosen.frequency);
    let ratios = relations.iter().flat_map(|r| [r.gain - 2.0 * r.gain_error, r.gain + 2.0 * r.gain_error]);
    let (low, high) = extent(&ratios.map(|g| g / reference_gain).collect::<Vec<_>>());
    let ewma = 1.0_f64.min(2.0 / high);
    Ok(LinearReport {
        relations,
        reference_gain,
        reference_frequency,
        gain_ratio: [low, high],
        largest_ewma_weight: ewma,
        largest_pcc_weight: largest_pcc(high),
    })
}

/// Largest ω1 ≤ 1 with λ < 4/(2ω_Σ − ω_Π) for ω2 in the paper's proportion.
fn largest_pcc(ratio: f64) -> f64 {
    let stable = |weight: f64| ratio < pcc_limit(weight, PAPER_PROPORTION * weight);
    if stable(1.0) {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if stable(middle) { low = middle } else { high = middle }
    }
    low
}

impl LinearReport {
    /// Whether EWMA with `level` is stable over the interval on a leg without dynamics (AII.18 corrected).
    #[must_use]
    pub fn ewma_is_stable(&self, level: f64) -> bool {
        self.gain_ratio[1] < ewma_limit(level)
    }

    /// Whether PCC with these weights is (AII.19).
    #[must_use]
    pub fn pcc_is_stable(&self, level: f64, drift: f64) -> bool {
        self.gain_ratio[1] < pcc_limit(level, drift)
    }

    /// The interval rounded outwards to three decimals, and never empty, as for a spec.
    #[must_use]
    pub fn gain_ratio_for_spec(&self) -> [f64; 2] {
        let low = (self.gain_ratio[0] * 1e3).floor() / 1e3;
        let high = (self.gain_ratio[1] * 1e3).ceil() / 1e3;
        [if low > 1e-3 { low } else { 1e-3 }, if high > low { high } else { low + 1e-3 }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_weights_are_on_the_border_of_jury_s_region() {
        let weight = largest_pcc(3.0);
        assert!((pcc_limit(weight, PAPER_PROPORTION * weight) - 3.0).abs() < 1e-9, "{weight}");
        assert!((largest_pcc(1.0) - 1.0).abs() < 1e-12);
    }
}
