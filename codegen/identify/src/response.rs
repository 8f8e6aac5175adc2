//! Frequency response of drive to displacement: Welch's H1 with coherence, and a resonance, lag and dead time fitted to it.
//!
//! ```text
//! record → uniform samples → segments (Hann, half overlapped) → Sxx, Sxy, Syy → H1 = Sxy/Sxx, γ² = |Sxy|²/(Sxx Syy) → fit
//! H(s) = K · ω0²/(s² + 2ζω0 s + ω0²) · 1/(1 + τs) · e^(−sT)
//! ```
//! Weights are the inverse variances of ln H1, 2 n γ²/(1 − γ²) for n averages (Bendat and Piersol, Random Data, 9.1).

mod fit;
mod welch;

use serde::Serialize;

use super::estimate::{self, Estimate};
use super::findings::Findings;
use super::signals::{ColumnSpec, Input, Signals, required};
use super::statistics::{Standstill, extent, median, median_interval, standstills};
use specgen_language::diagnostic::{Diagnostic, codes};

pub use fit::{ResonanceFit, response};
pub use welch::Bin;

/// A response and its fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrequencyResponse {
    /// Samples per second.
    pub rate: f64,
    /// Samples in a segment.
    pub segment: usize,
    /// Segments averaged.
    pub segments: usize,
    /// Width of a bin, Hz.
    pub resolution: f64,
    /// Lowest and highest frequency used, Hz.
    pub band: [f64; 2],
    /// Bands between them that were left out, Hz, with their mean coherence.
    pub left_out: Vec<Band>,
    /// Median coherence of the bins used.
    pub coherence: f64,
    /// Resonance, lag and dead time with their errors.
    pub fitted: ResonanceFit,
    /// Root mean square of |H1/H − 1| over the bins used, weighted as in the fit, %.
    pub misfit_percent: f64,
    /// Bins from zero up, for drawing.
    #[serde(skip)]
    pub bins: Vec<Bin>,
}

/// A band of frequencies, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// Lowest frequency of the band, Hz.
    pub low: f64,
    /// Highest frequency of the band, Hz.
    pub high: f64,
    /// Mean coherence in it.
    pub coherence: f64,
    /// Whether the drive excites it at all.
    pub excited: bool,
}

/// Coherence below which a bin is left out.
const COHERENT: f64 = 0.6;
/// Power of the drive, relative to the strongest bin, below which a bin is not excited: it has nothing but leakage of
/// the window. Above it the coherence decides, because noise behind a low-pass is weak at the resonance.
const EXCITED: f64 = 1e-9;
/// Least number of bins to fit, and of averages.
const BINS: usize = 12;
const AVERAGES: usize = 4;
/// The resonance is valid if this fraction of the bins within its half width, or [`NARROW`] bins, is used, and as many
/// as [`NARROW`] on either side of it.
const AROUND: f64 = 0.6;
/// If all bins together do not show a resonance, or fit badly, these multiples of the frequency of the largest response
/// bound the fit: a drive of large amplitude has hysteresis below, which the model does not have.
const NEAR: [f64; 2] = [0.6, 1.5];
/// Largest relative deviation of a sampling interval from the median.
const UNIFORM: f64 = 0.01;
/// Fraction of samples at exactly the largest or smallest displacement that shows a limit.
const AT_LIMIT: f64 = 0.01;
/// Misfit that causes a warning, %.
const POOR: f64 = 15.0;
/// Narrower bands, in bins, are not named separately.
const NARROW: usize = 3;

const COLUMNS: [ColumnSpec; 3] = [required("time_s"), required("drive_V"), required("displacement_um")];

/// Identifies from a record of a swept sine, multisine or noise. `segment`: samples in a segment, a power of two is best.
///
/// # Errors
/// E0630 for a record that is too short or not sampled evenly, E0631 if the coherence is too low (the bands are named),
/// E0632 if the model cannot be fitted, and those of reading.
pub fn respond(
    input: Input,
    shown_as: &str,
    segment: Option<usize>,
) -> Result<Estimate<FrequencyResponse>, Vec<Diagnostic>> {
    estimate::of(input, shown_as, &COLUMNS, |signals, findings| respond_checked(signals, segment, findings))
}

fn respond_checked(signals: &Signals, segment: Option<usize>, findings: &mut Findings) -> Option<FrequencyResponse> {
    let rate = sampling_rate(signals, findings)?;
    check_limits(signals, findings);
    if findings.any_error() {
        return None;
    }
    let n = signals.lines.len();
    let segment = segment.unwrap_or_else(|| automatic(n));
    let averages = if segment < 32 || segment > n { 0 } else { (2 * (n - segment)) / segment + 1 };
    if averages < AVERAGES {
        let (from, to) = (signals.place(0), signals.place(n - 1));
        let message = format!(
            "{n} samples from {from} to {to} give {averages} segments of {segment}; at least {AVERAGES} are needed for a coherence"
        );
        let help = "record longer, or choose a shorter --segment (32 or more)";
        return findings.refuse(codes::RESPONSE_SAMPLES, None, message, help);
    }
    let micrometres = signals.column(2);
    let displacement: Vec<f64> = micrometres.iter().map(|y| y * 1e-6).collect();
    let bins = welch::h1(signals.column(1), &displacement, rate, segment);
    let strongest = bins.iter().skip(1).fold(0.0, |m, b| if b.drive_power > m { b.drive_power } else { m });
    let excited = |b: &Bin| b.drive_power > EXCITED * strongest;
    let usable = |b: &Bin| b.frequency > 0.0 && excited(b) && b.coherence >= COHERENT;
    let mut used: Vec<Bin> = bins.iter().copied().filter(|b| usable(b)).collect();
    let bands = left_out(&bins, &usable, &excited);
    if used.len() < BINS {
        let message = format!("the coherence is below {COHERENT} nearly everywhere: {}", named(&bands));
        return findings.refuse(codes::RESPONSE_COHERENCE, None, message, "drive harder within the linear range, record longer, and check both channels; coherence is lost to noise, to hysteresis at large amplitude and to a wrong channel");
    }
    let resolution = rate / segment as f64;
    let mut whole = fit::fit(&used, averages);
    let fits = |fitted: &ResonanceFit, used: &[Bin]| {
        is_shown(fitted, used, resolution) && 100.0 * fit::misfit(fitted, used, averages) <= POOR
    };
    if !whole.as_ref().is_ok_and(|fitted| fits(fitted, &used)) {
        let near = around_peak(&used);
        let fitted = if near.len() < BINS { None } else { fit::fit(&near, averages).ok() };
        if let Some(fitted) = fitted.filter(|fitted| fits(fitted, &near)) {
            (whole, used) = (Ok(fitted), near);
        }
    }
    let fitted = whole.map_err(|why| {
        findings.add(codes::RESPONSE_FIT, None, why, "does the record hold the response from well below to above the resonance, displacement rising with the drive?");
    });
    let fitted = fitted.ok()?;
    let band = [used[0].frequency, used[used.len() - 1].frequency];
    if !is_shown(&fitted, &used, resolution) {
        return refuse_resonance(&fitted, band, &bands, findings);
    }
    if 2.0 * fitted.damping_ratio.value * fitted.resonance.value < 3.0 * resolution {
        let message = format!(
            "the resonance is {:.2} Hz wide, a bin {resolution:.2} Hz: the damping ratio comes out too large",
            2.0 * fitted.damping_ratio.value * fitted.resonance.value
        );
        findings.add(codes::RESPONSE_BAND, None, message, "record longer and choose a longer --segment");
    }
    let inside: Vec<Band> = bands.into_iter().filter(|b| b.high > band[0] && b.low < band[1]).collect();
    if !inside.is_empty() {
        let message = format!("left out of the fit: {}", named(&inside));
        findings.add(codes::RESPONSE_BAND, None, message, "drive harder there or record longer if the band matters");
    }
    let misfit_percent = 100.0 * fit::misfit(&fitted, &used, averages);
    if misfit_percent > POOR {
        let message = format!("the fitted model misses the response by {misfit_percent:.0} % rms");
        let help = "is there more than one resonance in the band? Limit the sweep to the first one";
        findings.add(codes::RESPONSE_POOR, None, message, help);
    }
    let mut coherence: Vec<f64> = used.iter().map(|b| b.coherence).collect();
    Some(FrequencyResponse {
        rate,
        segment,
        segments: averages,
        resolution,
        band,
        left_out: inside,
        coherence: median(&mut coherence),
        fitted,
        misfit_percent,
        bins,
    })
}

/// A power of two that gives about fifteen half-overlapped segments.
fn automatic(samples: usize) -> usize {
    let eighth = (samples / 8).max(1);
    (1usize << eighth.ilog2()).clamp(64, 1 << 15)
}

fn sampling_rate(signals: &Signals, findings: &mut Findings) -> Option<f64> {
    let time = signals.column(0);
    let interval = median_interval(time);
    // A time column with few digits rounds each time by up to half a digit; the grid as a whole must fit.
    let even = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let off = |k: usize| (time[k] - time[0] - k as f64 * even).abs();
    let worst = (0..time.len()).fold(0, |w, k| if off(k) > off(w) { k } else { w });
    if off(worst) > 0.5 * even || (even / interval - 1.0).abs() > UNIFORM {
        let (at_time, intervals) = (time[worst], off(worst) / even);
        let message = format!(
            "the samples are not evenly spaced: at {at_time} s the time is {intervals:.2} sampling intervals off"
        );
        let help = "record with a fixed sampling interval, without lost samples";
        return findings.refuse(codes::RESPONSE_SAMPLES, Some(signals.lines.at(worst)), message, help);
    }
    Some(1.0 / even)
}

/// A limited channel has many samples at exactly its largest or smallest value; a dead one a long standstill.
fn check_limits(signals: &Signals, findings: &mut Findings) {
    for (column, name) in [(1, "drive_V"), (2, "displacement_um")] {
        let values = signals.column(column);
        let (low, high) = extent(values);
        if signals.is_constant(column, name, "is the channel connected?", findings) {
            return;
        }
        for (limit, word) in [(low, "lower"), (high, "upper")] {
            // Two neighbours at the limit: a peak touches it once, a clipped signal stays.
            let stays = values.windows(2).filter(|w| w[0] == limit && w[1] == limit).count();
            // A drive of two levels (a random binary signal) is intentionally at its limits.
            if column == 2 && stays > 10 && stays as f64 > AT_LIMIT * values.len() as f64 {
                let first = values.windows(2).position(|w| w[0] == limit && w[1] == limit).unwrap_or(0);
                let message = format!(
                    "from {} on `{name}` is again and again exactly at its {word} limit {limit} ({stays} samples)",
                    signals.place(first)
                );
                let help = "the gauge or its converter is at the end of its range: drive less, or shift the range";
                findings.add(codes::RECORD_STUCK, Some(signals.lines.at(first)), message, help);
                return;
            }
        }
    }
    let values = signals.column(2);
    for Standstill { first, run, input: [a, b] } in standstills(signals.column(1), values, (values.len() / 50).max(20))
    {
        let (start, end, stuck) = (signals.place(first), signals.place(first + run - 1), values[first]);
        let message = format!(
            "from {start} to {end} the displacement is stuck at {stuck} um for {run} samples while the drive goes through {a} V to {b} V"
        );
        let help = "check the connection of the gauge and record again";
        findings.add(codes::RECORD_STUCK, Some(signals.lines.at(first)), message, help);
    }
}

/// Runs of bins that are not usable, at least [`NARROW`] wide.
fn left_out(bins: &[Bin], usable: &dyn Fn(&Bin) -> bool, excited: &dyn Fn(&Bin) -> bool) -> Vec<Band> {
    let mut bands = Vec::new();
    let mut first = 1;
    while first < bins.len() {
        if usable(&bins[first]) {
            first += 1;
            continue;
        }
        let run = bins[first..].iter().take_while(|b| !usable(b)).count();
        let part = &bins[first..first + run];
        if run >= NARROW {
            bands.push(Band {
                low: part[0].frequency,
                high: part[run - 1].frequency,
                coherence: part.iter().fold(0.0, |sum, b| sum + b.coherence) / run as f64,
                excited: 2 * part.iter().filter(|b| excited(b)).count() > run,
            });
        }
        first += run;
    }
    bands
}

fn named(bands: &[Band]) -> String {
    let mut sorted: Vec<&Band> = bands.iter().collect();
    sorted.sort_by(|a, b| (b.high - b.low).total_cmp(&(a.high - a.low)));
    let each: Vec<String> = sorted
        .iter()
        .take(4)
        .map(|b| {
            let why = if b.excited { format!("coherence {:.2}", b.coherence) } else { "not excited".to_owned() };
            format!("{:.4} to {:.4} Hz ({why})", b.low, b.high)
        })
        .collect();
    let more = if sorted.len() > 4 { format!(" and {} narrower bands", sorted.len() - 4) } else { String::new() };
    format!("{}{more}", each.join(", "))
}

/// Whether the bins `used`, `resolution` (Hz) apart, show the resonance: its width is covered, and both sides of it.
fn is_shown(fitted: &ResonanceFit, used: &[Bin], resolution: f64) -> bool {
    let f0 = fitted.resonance.value;
    let within = |low: f64, high: f64| used.iter().filter(|b| b.frequency >= low && b.frequency <= high).count();
    let half = f0 * fitted.damping_ratio.value;
    let half = if half < NARROW as f64 * resolution { NARROW as f64 * resolution } else { half };
    let covered = within(f0 - half, f0 + half) as f64;
    covered >= AROUND * 2.0 * half / resolution && within(0.7 * f0, f0) >= NARROW && within(f0, 1.3 * f0) >= NARROW
}

/// The bins around the largest response.
fn around_peak(used: &[Bin]) -> Vec<Bin> {
    let size = |b: &Bin| libm::hypot(b.h[0], b.h[1]);
    let peak = used.iter().fold(used[0], |best, b| if size(b) > size(&best) { *b } else { best });
    let [low, high] = NEAR.map(|multiple| multiple * peak.frequency);
    used.iter().copied().filter(|b| b.frequency >= low && b.frequency <= high).collect()
}

/// Refuses a resonance without evidence in the record: outside the band, or where the coherence is too low.
fn refuse_resonance<T>(fitted: &ResonanceFit, band: [f64; 2], bands: &[Band], findings: &mut Findings) -> Option<T> {
    let f0 = fitted.resonance.value;
    let near: Vec<Band> = bands.iter().copied().filter(|b| b.high >= 0.7 * f0 && b.low <= 1.3 * f0).collect();
    let gap = if near.is_empty() { String::new() } else { format!("; too low: {}", named(&near)) };
    let message = format!(
        "the record does not show the resonance: the fit puts it at {f0:.1} Hz, coherent are {:.1} to {:.1} Hz{gap}",
        band[0], band[1]
    );
    let help = "excite the actuator through its resonance, and record long enough for coherence there";
    findings.refuse(codes::RESPONSE_COHERENCE, None, message, help)
}
