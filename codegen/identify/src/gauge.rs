//! Calibration of a gauge: its voltage against a reference displacement, as the polynomial of a spec.

use serde::Serialize;

use super::estimate::{self, Estimate};
use super::findings::Findings;
use super::least_squares::{Fit, fit, mean_square};
use super::signals::{ColumnSpec, Input, Signals, optional, required};
use super::statistics::{extent, mean, mean_and_error, median};
use specgen_language::diagnostic::{Diagnostic, codes};

/// A calibration and its quality. Lengths in m, voltages in V.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GaugeCalibration {
    /// Samples of the record.
    pub samples: usize,
    /// Degree of the polynomial, 1 to 5.
    pub degree: usize,
    /// Cross-validated error of each degree from 1 on, m.
    pub held_out_rms: Vec<f64>,
    /// Rule of the choice, as text.
    pub rule: &'static str,
    /// Displacement as a polynomial of the voltage, lowest power first, m/V^k.
    pub coefficients: Vec<f64>,
    /// Standard error of each.
    pub errors: Vec<f64>,
    /// Least and largest voltage of the record, V.
    pub volts: [f64; 2],
    /// Least and largest displacement of the reference, m.
    pub reference: [f64; 2],
    /// Reference less calibration, root mean square, m.
    pub residual_rms: f64,
    /// Largest magnitude of reference less calibration, m.
    pub residual_max: f64,
    /// Time or line of that sample.
    pub residual_max_at: String,
    /// Largest mean difference of the reading between falling and rising displacement, m; none if the displacement
    /// never reverses.
    pub hysteresis: Option<f64>,
    /// Least |slope| over the voltages covered, in % of the mean slope: above 0 the calibration can be inverted.
    pub least_slope_percent: f64,
    /// Voltage and residual of each sample, for drawing.
    #[serde(skip)]
    pub points: Vec<[f64; 2]>,
    /// Knots (V, m) of the calibration as a table: means of the reference over even steps of the voltage.
    pub table: Vec<[f64; 2]>,
}

/// Highest degree that a spec accepts.
const HIGHEST: usize = 5;
/// Interleaved parts of the voltage range, each of which is held out in turn.
const FOLDS: usize = 5;
/// Groups of neighbouring voltages that are distributed over the folds.
const GROUPS: usize = 50;
/// Least number of samples per coefficient.
const PER_COEFFICIENT: usize = 4;
/// Knots of the table.
const KNOTS: usize = 33;
/// Voltages at which slope and hysteresis are evaluated.
const BINS: usize = 25;
/// Hysteresis above this many times the rms residual gives a warning.
const HYSTERESIS: f64 = 2.0;
/// A reference range (m) outside these bounds suggests another unit.
const PLAUSIBLE: [f64; 2] = [50e-9, 5e-3];

const COLUMNS: [ColumnSpec; 3] = [optional("time_s"), required("gauge_V"), required("reference_um")];

/// Calibrates from the columns `gauge_V`, `reference_um` and, if there is one, `time_s`. `degree` 1 to 5 overrides the choice.
///
/// # Errors
/// All findings if the record cannot be read or calibrated: E0512 and E0513 for a gauge that does not move, E0635 for a
/// calibration that is not monotone, E0636 for too few samples or a wrong unit.
pub fn calibrate(
    input: Input,
    shown_as: &str,
    degree: Option<usize>,
) -> Result<Estimate<GaugeCalibration>, Vec<Diagnostic>> {
    estimate::of(input, shown_as, &COLUMNS, |signals, findings| calibrate_checked(signals, degree, findings))
}

fn calibrate_checked(signals: &Signals, degree: Option<usize>, findings: &mut Findings) -> Option<GaugeCalibration> {
    let (volts, micrometres) = (signals.column(1), signals.column(2));
    if volts.len() < PER_COEFFICIENT * 2 * FOLDS {
        let message = format!("has {} samples; at least {} are needed", volts.len(), PER_COEFFICIENT * 2 * FOLDS);
        return findings.refuse(codes::GAUGE_RECORD, None, message, "record more positions of the reference");
    }
    signals.check_moves(2, 1, ["reference_um", "gauge_V"], findings);
    signals.check_moves(1, 2, ["gauge_V", "reference_um"], findings);
    if findings.any_error() {
        return None;
    }
    let reference: Vec<f64> = micrometres.iter().map(|y| y * 1e-6).collect();
    let (low, high) = extent(volts);
    let (bottom, top) = extent(&reference);
    check_units(signals, [low, high], [bottom, top], findings);
    let scaled: Vec<f64> = volts.iter().map(|v| (2.0 * v - low - high) / (high - low)).collect();
    let held_out = held_out(&scaled, &reference);
    if held_out.is_empty() {
        let message = "has too few different voltages for cross-validation".to_owned();
        return findings.refuse(codes::GAUGE_RECORD, None, message, "record more positions of the reference");
    }
    let degree = match degree {
        Some(degree) => degree.clamp(1, HIGHEST),
        None => choose(&held_out),
    };
    let Some(found) = polynomial(&scaled, &reference, degree) else {
        let message = format!("a polynomial of degree {degree} is not determined");
        return findings.refuse(codes::GAUGE_RECORD, None, message, "record more positions of the reference");
    };
    let square = mean_square(&found.residual) * volts.len() as f64 / (volts.len() - degree - 1) as f64;
    let (coefficients, errors) = to_volts(&found, square, low, high);
    let slope = |x: f64| derivative(&found.coefficients, x) * 2.0 / (high - low);
    let mean_slope = (top - bottom) / (high - low);
    let sign = if slope(0.0) < 0.0 { -1.0 } else { 1.0 };
    let mut least = (f64::INFINITY, low);
    for k in 0..=200 {
        let x = -1.0 + f64::from(k) / 100.0;
        let here = sign * slope(x);
        if here < least.0 {
            least = (here, low + 0.5 * (x + 1.0) * (high - low));
        }
    }
    if least.0 <= 0.0 {
        let near = nearest(volts, least.1);
        let (volts, place) = (&least.1, signals.place(near));
        let message = format!(
            "the calibration turns back at {volts:.4} V (near {place}): there one voltage means two displacements"
        );
        let help = "use the gauge only where its voltage is monotonic, or look for a fault there";
        findings.add(codes::GAUGE_NOT_MONOTONE, Some(signals.lines.at(near)), message, help);
    }
    let worst = (0..volts.len()).fold(0, |w, k| if found.residual[k].abs() > found.residual[w].abs() { k } else { w });
    let residual_rms = mean_square(&found.residual).sqrt();
    let hysteresis = hysteresis(&reference, &scaled, &found.residual);
    if let Some(width) = hysteresis.filter(|width| *width > HYSTERESIS * residual_rms.max(noise_of(&found.residual))) {
        let message = format!("the gauge reads up to {:.2} nm differently on the way back", width * 1e9);
        let help =
            "no calibration removes that: look for play or friction in the mount, or a delay between the columns";
        findings.add(codes::GAUGE_HYSTERESIS, None, message, help);
    }
    glitches(signals, &found.residual, findings);
    Some(GaugeCalibration {
        samples: volts.len(),
        degree,
        held_out_rms: held_out.iter().map(|folds| root_mean(folds)).collect(),
        rule: "lowest degree within one standard error, or one per cent, of the best",
        coefficients,
        errors,
        volts: [low, high],
        reference: [bottom, top],
        residual_rms,
        residual_max: found.residual[worst].abs(),
        residual_max_at: signals.place(worst),
        hysteresis,
        least_slope_percent: 100.0 * least.0 / mean_slope,
        points: volts.iter().zip(&found.residual).map(|(v, r)| [*v, *r]).collect(),
        table: table(volts, &reference, low, high),
    })
}

fn check_units(signals: &Signals, volts: [f64; 2], reference: [f64; 2], findings: &mut Findings) {
    let range = reference[1] - reference[0];
    let at =
        |column: usize, value: f64| signals.place(signals.column(column).iter().position(|v| *v == value).unwrap_or(0));
    if !(PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&range) {
        let message = format!(
            "the reference covers {:e} um (highest at {}): is it in another unit?",
            range * 1e6,
            at(2, signals.column(2).iter().fold(f64::NEG_INFINITY, |m, v| if *v > m { *v } else { m }))
        );
        findings.add(codes::GAUGE_RECORD, None, message, "write the reference in micrometres");
    }
    let largest = if volts[1].abs() > volts[0].abs() { volts[1] } else { volts[0] };
    if largest.abs() > 100.0 {
        let message = format!("the gauge shows {largest} V (at {}): is it in mV?", at(1, largest));
        let help = "write the gauge's voltage in volts; are the columns swapped?";
        findings.add(codes::GAUGE_RECORD, None, message, help);
    }
}

/// Legendre polynomials keep the columns nearly orthogonal over −1 … 1.
fn basis(x: &[f64], degree: usize) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![1.0; x.len()], x.to_vec()];
    for n in 1..degree {
        let m = n as f64;
        let next = (0..x.len()).map(|k| ((2.0 * m + 1.0) * x[k] * columns[n][k] - m * columns[n - 1][k]) / (m + 1.0));
        let next = next.collect();
        columns.push(next);
    }
    columns.truncate(degree + 1);
    columns
}

fn polynomial(x: &[f64], y: &[f64], degree: usize) -> Option<Fit> {
    let columns = basis(x, degree);
    let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    fit(&views, y)
}

/// Powers of x of each Legendre polynomial, row by row.
fn legendre_powers(degree: usize) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; degree + 1]; degree + 1];
    rows[0][0] = 1.0;
    if degree > 0 {
        rows[1][1] = 1.0;
    }
    for n in 1..degree {
        let m = n as f64;
        for p in 0..=degree {
            let shifted = if p > 0 { rows[n][p - 1] } else { 0.0 };
            rows[n + 1][p] = ((2.0 * m + 1.0) * shifted - m * rows[n - 1][p]) / (m + 1.0);
        }
    }
    rows
}

/// Slope of a Legendre sum at x.
fn derivative(coefficients: &[f64], x: f64) -> f64 {
    let rows = legendre_powers(coefficients.len() - 1);
    let mut slope = 0.0;
    for (c, row) in coefficients.iter().zip(&rows) {
        let mut power = 1.0;
        for (p, a) in row.iter().enumerate().skip(1) {
            slope += c * a * p as f64 * power;
            power *= x;
        }
    }
    slope
}

/// Powers of the voltage, and their standard errors for residuals of mean square `square`.
fn to_volts(found: &Fit, square: f64, low: f64, high: f64) -> (Vec<f64>, Vec<f64>) {
    let degree = found.coefficients.len() - 1;
    let rows = legendre_powers(degree);
    // x = s·v + o: powers of x as polynomials of v, row by row.
    let (s, o) = (2.0 / (high - low), -(high + low) / (high - low));
    let mut powers = vec![vec![0.0; degree + 1]; degree + 1];
    powers[0][0] = 1.0;
    for p in 1..=degree {
        for k in 0..=degree {
            powers[p][k] = o * powers[p - 1][k] + if k > 0 { s * powers[p - 1][k - 1] } else { 0.0 };
        }
    }
    // Matrix from Legendre coefficients to powers of the voltage.
    let to = |k: usize, n: usize| (0..=degree).fold(0.0, |sum, p| sum + rows[n][p] * powers[p][k]);
    let values =
        (0..=degree).map(|k| (0..=degree).fold(0.0, |sum, n| sum + to(k, n) * found.coefficients[n])).collect();
    let errors = (0..=degree)
        .map(|k| {
            let mut variance = 0.0;
            for a in 0..=degree {
                for b in 0..=degree {
                    variance += to(k, a) * found.covariance[(a, b)] * to(k, b);
                }
            }
            (variance * square).sqrt()
        })
        .collect();
    (values, errors)
}

/// Mean squares of each degree (from 1) and fold. Degrees that are not determined are left out, with all higher ones.
fn held_out(x: &[f64], y: &[f64]) -> Vec<Vec<f64>> {
    let fold_of: Vec<usize> = x.iter().map(|x| ((x + 1.0) * 0.5 * GROUPS as f64) as usize % FOLDS).collect();
    let mut scores = Vec::new();
    for degree in 1..=HIGHEST {
        let mut folds = Vec::new();
        for fold in 0..FOLDS {
            let part = |inside: bool| -> (Vec<f64>, Vec<f64>) {
                (0..x.len()).filter(|&k| (fold_of[k] == fold) == inside).map(|k| (x[k], y[k])).unzip()
            };
            let ((train_x, train_y), (test_x, test_y)) = (part(false), part(true));
            if test_x.is_empty() || train_x.len() < PER_COEFFICIENT * (degree + 1) {
                continue;
            }
            let Some(found) = polynomial(&train_x, &train_y, degree) else { continue };
            let columns = basis(&test_x, degree);
            let errors: Vec<f64> = (0..test_x.len())
                .map(|k| columns.iter().zip(&found.coefficients).fold(test_y[k], |e, (column, c)| e - c * column[k]))
                .collect();
            folds.push(mean_square(&errors));
        }
        if folds.len() < 3 {
            break;
        }
        scores.push(folds);
    }
    scores
}

fn root_mean(squares: &[f64]) -> f64 {
    mean(squares).sqrt()
}

/// A smaller relative gain in error does not justify a degree.
const WORTHWHILE: f64 = 0.01;

/// Lowest degree whose error exceeds the best one's by at most one standard error of the paired difference, or one per
/// cent.
fn choose(scores: &[Vec<f64>]) -> usize {
    let best =
        (0..scores.len()).fold(0, |best, k| if root_mean(&scores[k]) < root_mean(&scores[best]) { k } else { best });
    for (k, folds) in scores.iter().enumerate().take(best) {
        let worse: Vec<f64> = folds.iter().zip(&scores[best]).map(|(a, b)| a.sqrt() - b.sqrt()).collect();
        let (excess, error) = mean_and_error(&worse);
        if excess <= error || excess <= WORTHWHILE * root_mean(&scores[best]) {
            return k + 1;
        }
    }
    best + 1
}

/// Largest difference of the mean residual between falling and rising reference over bins of the voltage, m.
fn hysteresis(reference: &[f64], scaled: &[f64], residual: &[f64]) -> Option<f64> {
    let (low, high) = extent(reference);
    let mut sums = vec![[(0.0, 0.0); 2]; BINS];
    let mut rising: Option<bool> = None;
    let mut turn = reference[0];
    for k in 0..reference.len() {
        let moved = reference[k] - turn;
        match rising {
            Some(true) if moved > 0.0 => turn = reference[k],
            Some(false) if moved < 0.0 => turn = reference[k],
            _ if moved.abs() > 0.02 * (high - low) => {
                rising = Some(moved > 0.0);
                turn = reference[k];
            }
            _ => {}
        }
        if let Some(up) = rising {
            let bin = (((scaled[k] + 1.0) * 0.5 * BINS as f64) as usize).min(BINS - 1);
            let (sum, count) = &mut sums[bin][usize::from(up)];
            *sum += residual[k];
            *count += 1.0;
        }
    }
    let both: Vec<f64> = sums
        .iter()
        .filter(|[fall, rise]| fall.1 >= 2.0 && rise.1 >= 2.0)
        .map(|[fall, rise]| (fall.0 / fall.1 - rise.0 / rise.1).abs())
        .collect();
    (!both.is_empty()).then(|| extent(&both).1)
}

/// Robust standard deviation.
fn noise_of(residual: &[f64]) -> f64 {
    let mut absolute: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
    median(&mut absolute) / 0.674_489_75
}

/// Points at more than twelve times the usual residual.
fn glitches(signals: &Signals, residual: &[f64], findings: &mut Findings) {
    let usual = noise_of(residual);
    for (k, r) in residual.iter().enumerate().filter(|(_, r)| r.abs() > 12.0 * usual && r.abs() > 0.0) {
        let (place, residual, times) = (signals.place(k), r * 1e9, (r / usual).abs());
        let message = format!("at {place} the residual is {residual:.2} nm, {times:.0} times the usual one");
        let help = "delete the point if the reading was disturbed, or record again";
        findings.add(codes::GAUGE_GLITCH, Some(signals.lines.at(k)), message, help);
    }
}

fn nearest(volts: &[f64], at: f64) -> usize {
    (0..volts.len()).fold(0, |best, k| if (volts[k] - at).abs() < (volts[best] - at).abs() { k } else { best })
}

/// Means of voltage and reference over even steps of the voltage; steps without samples are left out.
fn table(volts: &[f64], reference: &[f64], low: f64, high: f64) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 3]; KNOTS];
    for (v, y) in volts.iter().zip(reference) {
        let bin = (((v - low) / (high - low) * KNOTS as f64) as usize).min(KNOTS - 1);
        sums[bin][0] += v;
        sums[bin][1] += y;
        sums[bin][2] += 1.0;
    }
    sums.iter().filter(|s| s[2] > 0.0).map(|s| [s[0] / s[2], s[1] / s[2]]).collect()
}

/// The calibration as a line of a spec.
#[must_use]
pub fn spec_line(report: &GaugeCalibration) -> String {
    let terms: Vec<String> = report
        .coefficients
        .iter()
        .enumerate()
        .map(|(power, c)| {
            let unit = match power {
                0 => "um".to_owned(),
                1 => "um/V".to_owned(),
                _ => format!("um/V^{power}"),
            };
            format!("\"{} {unit}\"", rounded(c * 1e6))
        })
        .collect();
    format!("calibration = [{}]", terms.join(", "))
}

/// Nine significant digits: below the noise of any gauge.
fn rounded(value: f64) -> String {
    let text = format!("{value:.8e}");
    text.parse::<f64>().map_or(text, |v| format!("{v:?}"))
}
