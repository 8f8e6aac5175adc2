//! `specgen identify gauge`, `response` and `stiffness`: a record in, an estimate and lines of a spec out.
use std::path::Path;

use serde::Serialize;

use super::{Bench, IdentificationResult, MeasuredKeys, refused};
use crate::drawing::wrote;
use crate::identification as figure;
use specgen_identify::gauge::{GaugeCalibration, calibrate, spec_line};
use specgen_identify::response::{FrequencyResponse, respond};
use specgen_identify::stiffness::{AxialStiffness, measure};
use specgen_identify::{Estimate, Input, Parameter, marked_as_simulated};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_table, write_table};
use specgen_language::ui::Ui;

/// Shows what was estimated from a record, which measures `keys` of a spec, and draws its `figure`.
fn show<V>(
    report: Estimate<V>,
    keys: &[&str],
    (title, figure): (&str, fn(&Estimate<V>) -> String),
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure>
where
    IdentificationResult<Estimate<V>>: Outcome,
{
    ui.findings(None, &report.warnings);
    let files = bench.plot.write(title, || figure(&report))?.unwrap_or_default();
    let measured = MeasuredKeys::of(keys, report.simulated);
    ui.result(&IdentificationResult { report, measured, files });
    Ok(())
}

/// `specgen identify stiffness`: reads, identifies, draws and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn stiffness(record: &Path, bench: &Bench, ui: &mut Ui) -> Result<(), Failure> {
    let shown = record.display().to_string();
    let report = measure(Input::File(record, &bench.reading), &shown).map_err(refused)?;
    show(report, &["actuator.axial_stiffness"], ("Stiffness", figure::stiffness), bench, ui)
}

impl Outcome for IdentificationResult<Estimate<AxialStiffness>> {
    fn text(&self) -> String {
        let Self { report: Estimate { record, value: report, .. }, measured, files } = self;
        let creep = report.creep_time.map_or_else(
            || "no creep found".to_owned(),
            |t| format!("creep of {:.2} % with {t:.3} s removed", report.creep_percent),
        );
        let (k, error, drift) = (report.stiffness * 1e-6, report.error * 1e-6, report.drift * 1e9);
        let (uncorrected, samples, independent) = (report.uncorrected * 1e-6, report.samples, report.independent);
        let (low, high, rms) = (report.force[0], report.force[1], report.residual_rms * 1e9);
        let (value, measured) = (report.stiffness, measured.text());
        format!(
            "{record}: k = {k:.4} ± {error:.4} N/µm (standard error); {creep}, drift {drift:.3} nm/s; without these corrections {uncorrected:.4} N/µm\n  \
             {samples} samples ({independent:.0} independent), force {low:.3} N to {high:.3} N, residual {rms:.3} nm rms\nspec lines:\n[actuator]\n\
             axial_stiffness = \"{value:.4e} N/m\"\n{measured}{files}"
        )
    }
}

/// `specgen identify response`: reads, identifies, draws and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn response(
    record: &Path,
    segment: Option<usize>,
    output: Option<&Path>,
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure> {
    output.map_or(Ok(()), check_table)?;
    let shown = record.display().to_string();
    let report = respond(Input::File(record, &bench.reading), &shown, segment).map_err(refused)?;
    let keys = ["actuator.resonance", "actuator.damping_ratio", "amplifier.lag"];
    if let Some(path) = output {
        let text = bins(&report.value);
        let text = if report.simulated { marked_as_simulated(&text) } else { text };
        write_table(path, text.as_bytes())?;
        ui.progress(wrote(path).trim_end());
    }
    show(report, &keys, ("Frequency response", figure::response), bench, ui)
}

/// The response as CSV: a row for each bin that is used.
fn bins(response: &FrequencyResponse) -> String {
    let mut text = "frequency_Hz,real_um_per_V,imaginary_um_per_V,coherence\n".to_owned();
    for bin in &response.bins {
        let [real, imaginary] = bin.h.map(|part| part * 1e6);
        text += &format!("{:?},{real:?},{imaginary:?},{:?}\n", bin.frequency, bin.coherence);
    }
    text
}

impl Outcome for IdentificationResult<Estimate<FrequencyResponse>> {
    fn text(&self) -> String {
        let Self { report: Estimate { record, value: report, .. }, measured, files } = self;
        let f = &report.fitted;
        let shown_in = |e: Parameter, scale: f64| format!("{:.4} ± {:.1e}", e.value * scale, e.error * scale);
        let (segments, segment, rate) = (report.segments, report.segment, report.rate);
        let (resolution, low, high) = (report.resolution, report.band[0], report.band[1]);
        let (coherence, misfit) = (report.coherence, report.misfit_percent);
        let mut text = format!(
            "{record}: {segments} segments of {segment} samples at {rate:.1} Hz, bins of {resolution:.3} Hz, used {low:.3} to {high:.1} Hz, coherence {coherence:.4} in the middle, misfit {misfit:.2} %\n"
        );
        let (resonance, damping) = (shown_in(f.resonance, 1.0), shown_in(f.damping_ratio, 1.0));
        let (lag, dead_time) = (shown_in(f.lag, 1e3), shown_in(f.dead_time, 1e3));
        let (sum, correlation) = (shown_in(f.lag_and_dead_time, 1e3), f.lag_dead_time_correlation);
        let (gain, error) = (f.gain.value * 1e6, f.gain.error * 1e6);
        text += &format!(
            "  resonance     {resonance} Hz\n  damping ratio {damping}\n  lag           {lag} ms\n  dead time     {dead_time} ms (including half a period of converter hold)\n  lag + dead    {sum} ms (errors of the two correlated by {correlation:.2})\n  static gain   {gain:.6} ± {error:.1e} µm/V\n"
        );
        // The lag attenuates what the resonance responds to.
        let lagging = std::f64::consts::TAU * f.resonance.value * f.lag.value;
        let (resonance, damping) = (f.resonance.value, f.damping_ratio.value);
        let (gain, lag) = (f.gain.value * 1e6 / (1.0 + lagging * lagging).sqrt(), f.lag.value * 1e3);
        let (measured, mode) = (measured.text(), mode_lines(f.resonance.value, f.damping_ratio.value));
        text += &format!(
            "spec lines:\n[actuator]\nresonance = \"{resonance:.1} Hz\"\ndamping_ratio = {damping:.4}\n# resonance_gain: {gain:.5} um/V, the gain of small motion behind the lag, over that of a large loop\n[amplifier]\nlag = \"{lag:.4} ms\"\n{measured}with [control], [actuator] applies to every leg; for this leg alone, write instead:\n{mode}{files}"
        );
        text
    }
}

/// A `[[mode]]` in series with a leg; frequency in Hz.
fn mode_lines(frequency: f64, damping_ratio: f64) -> String {
    format!(
        "[[mode]]\nfrequency = \"{frequency:.1} Hz\"\ndamping_ratio = {damping_ratio:.4}\nat = \"leg 1\"  # the number of the leg\n"
    )
}

/// `specgen identify gauge`: reads, calibrates, writes the `table`, draws and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn gauge(
    record: &Path,
    degree: Option<u8>,
    table: Option<&Path>,
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let shown = record.display().to_string();
    let report = calibrate(Input::File(record, &bench.reading), &shown, degree.map(usize::from)).map_err(refused)?;
    ui.findings(None, &report.warnings);
    let mut files = String::new();
    if let Some(path) = table {
        let mut rows = "gauge_V,reference_um\n".to_owned();
        rows.extend(report.value.table.iter().map(|[v, y]| format!("{v:?},{:?}\n", y * 1e6)));
        write_table(path, rows.as_bytes())?;
        files += &wrote(path);
    }
    files.extend(bench.plot.write("Gauge calibration", || figure::gauge(&report))?);
    let (calibration, is_given) = (spec_line(&report.value), degree.is_some());
    let measured = MeasuredKeys::of(&["sensor.calibration"], report.simulated);
    ui.result(&Calibration { is_given, report, calibration, measured, files });
    Ok(())
}

/// Calibration of a gauge.
#[derive(Serialize)]
struct Calibration {
    /// The degree was given by the user.
    #[serde(skip)]
    is_given: bool,
    report: Estimate<GaugeCalibration>,
    calibration: String,
    measured: MeasuredKeys,
    /// One line per written file.
    #[serde(skip)]
    files: String,
}

impl Outcome for Calibration {
    fn text(&self) -> String {
        let report = &self.report.value;
        let errors: Vec<String> =
            report.held_out_rms.iter().enumerate().map(|(k, e)| format!("{}: {:.3} nm", k + 1, e * 1e9)).collect();
        let chosen = if self.is_given { "given" } else { report.rule };
        let hysteresis = report.hysteresis.map_or_else(
            || "unknown: the reference has no reversal".to_owned(),
            |h| format!("{:.3} nm between the rising and falling branches", h * 1e9),
        );
        let (record, samples, v_low) = (&self.report.record, report.samples, report.volts[0]);
        let (v_high, low, high) = (report.volts[1], report.reference[0] * 1e6, report.reference[1] * 1e6);
        let (errors, degree, rms) = (errors.join(", "), report.degree, report.residual_rms * 1e9);
        let (most, at, slope) = (report.residual_max * 1e9, &report.residual_max_at, report.least_slope_percent);
        let (calibration, measured, files) = (&self.calibration, self.measured.text(), &self.files);
        format!(
            "{record}: {samples} samples, {v_low:.4} V to {v_high:.4} V, {low:.4} µm to {high:.4} µm\n  held-out error by degree: {errors}\n  degree {degree} ({chosen})\n  \
             residual {rms:.3} nm rms, at most {most:.3} nm (at {at})\n  hysteresis {hysteresis}\n  monotonic over these voltages: smallest slope {slope:.1} % \
             of the mean slope\nspec lines, in [sensor] for all gauges or in [[gauge]] for this one:\n{calibration}\n{measured}{files}"
        )
    }
}
