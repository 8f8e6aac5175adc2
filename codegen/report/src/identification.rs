//! Figures for each kind of identification.

use crate::chart::{Axis, Chart, Mark, Patch};
use crate::plot::{BLUE, GREY, ORANGE, PURPLE, figure};
use specgen_identify::gauge::GaugeCalibration;
use specgen_identify::linear::LinearReport;
use specgen_identify::rate::RateReport;
use specgen_identify::response::FrequencyResponse;
use specgen_identify::stiffness::AxialStiffness;
use specgen_identify::{Estimate, GridChoice, Identification, Prediction, Record, Trace};

fn panel(title: &str, x: Axis, y: Axis) -> Chart {
    Chart::new("", title, x, y)
}

fn micrometres(trace: &Trace, model: bool) -> Vec<[f64; 2]> {
    let value = |k: usize| if model { trace.measured[k] - trace.residual[k] } else { trace.measured[k] };
    (0..trace.time.len()).map(|k| [trace.drive[k], value(k) * 1e6]).collect()
}

fn residual(title: &str, trace: &Trace) -> Chart {
    let points = trace.time.iter().zip(&trace.residual).map(|(t, r)| [*t, r * 1e9]).collect();
    panel(title, Axis::linear("time", "s"), Axis::linear("measured − model", "nm"))
        .with("", Mark::Line(0.8), points)
        .colored(PURPLE)
}

/// Loops and model, residual, Preisach plane with unexcited cells hatched, and the choice of the grid or the
/// validation, if any.
pub fn everett(identified: &Identification, choice: Option<&GridChoice>, validation: Option<&Prediction>) -> String {
    let (report, trace) = (&identified.report, &identified.trace);
    let loops = panel("Loops", Axis::linear("drive", "V"), Axis::linear("displacement", "µm"))
        .with("measured", Mark::Line(2.2), micrometres(trace, false))
        .with("model", Mark::Line(0.9), micrometres(trace, true));
    let mut panels = vec![
        loops,
        residual(
            &format!("Residual of the fit: {:.2} nm rms, mainly {}", report.fit_rms * 1e9, report.cause.main.name()),
            trace,
        ),
        plane(identified),
    ];
    if let Some(choice) = choice {
        panels.push(curve(choice));
    }
    if let Some(validation) = validation {
        panels.extend(error(validation));
    }
    let (grid, percent, range) = (report.grid, report.fit_rms_percent, report.displacement_range * 1e6);
    let (noise, drift, dead_time) = (report.noise_floor * 1e9, report.drift * 1e9, report.dead_time * 1e3);
    let excited = report.excited_share * 100.0;
    let subtitle = format!(
        "N = {grid}; fit {percent:.3} % of {range:.2} µm; noise {noise:.2} nm; drift {drift:.3} nm/s; dead time {dead_time:.3} ms; {excited:.1} % of the plane excited"
    );
    figure(&format!("Everett table of {}", shortened(&report.record)), &subtitle, &panels, 2)
}

/// Measured minus predicted, if the record contains the displacement.
fn error(prediction: &Prediction) -> Option<Chart> {
    let (compared, measured) = (prediction.compared.as_ref()?, prediction.measured.as_ref()?);
    let name = format!("Residual of {}: {:.3} % rms", shortened(&prediction.record), compared.rms_percent);
    let off = |k: usize| if prediction.keep[k] { measured[k] - prediction.displacement[k] } else { f64::NAN };
    let residual_of = (0..measured.len()).map(off).collect();
    let trace = Trace { time: prediction.time.clone(), residual: residual_of, ..Trace::default() };
    Some(residual(&name, &trace))
}

/// Predicted loops, displacement over time, and error for a drive.
pub fn prediction(prediction: &Prediction) -> String {
    let over = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| [*x, y * 1e6]).collect::<Vec<_>>();
    let chart = |title: &str, axis: Axis, x: &[f64]| {
        let mut chart = panel(title, axis, Axis::linear("displacement", "µm"));
        if let Some(measured) = &prediction.measured {
            chart = chart.with("measured", Mark::Line(2.2), over(x, measured));
        }
        chart.with("predicted", Mark::Line(0.9), over(x, &prediction.displacement))
    };
    let mut panels = vec![
        chart("Loops", Axis::linear("drive", "V"), &prediction.drive),
        chart("Over time", Axis::linear("time", "s"), &prediction.time),
    ];
    panels.extend(error(prediction));
    let below =
        format!("{} samples; {} clamped to the table's range", prediction.time.len(), prediction.samples_clipped);
    figure(&format!("Prediction for {}", shortened(&prediction.record)), &below, &panels, 2)
}

/// Errors of each option over the rates of the records, fitted to all records and to the others.
pub fn rate(report: &RateReport) -> String {
    let chart = |title: &str, left_out: bool| {
        let empty = panel(title, Axis::linear("curves per second", "Hz"), Axis::linear("error", "% of range, rms"));
        report.options.iter().enumerate().fold(empty, |chart, (k, option)| {
            let errors = if left_out { &option.left_out } else { &option.fitted };
            let mut points: Vec<[f64; 2]> = report.records.iter().zip(errors).map(|(r, e)| [r.frequency, *e]).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            chart.with(option.option.name(), Mark::Line(1.6), points).colored(k)
        })
    };
    let panels = [chart("Fitted to all records", false), chart("Each record with the fit to the others", true)];
    let names: Vec<&str> = report.records.iter().map(|record| shortened(&record.record)).collect();
    figure("Rate dependence", &format!("N = {}; {}", report.grid, names.join(", ")), &panels, 2)
}

/// The last part of a long path.
fn shortened(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

fn plane(identified: &Identification) -> Chart {
    let table = &identified.table;
    let mut chart = panel(
        "Preisach plane: weight of the cells",
        Axis::linear("down_threshold", "V"),
        Axis::linear("up_threshold", "V"),
    );
    let mut largest = 0.0;
    for up in 2..=table.grid {
        for down in 0..up - 1 {
            let weight = table.weight(up, down);
            largest = if weight > largest { weight } else { largest };
        }
    }
    let cell = |up: usize, down: usize, shade: Option<f64>| Patch {
        x: [table.threshold(down), table.threshold(down + 1)],
        y: [table.threshold(up - 1), table.threshold(up)],
        shade,
    };
    for up in 1..=table.grid {
        for down in 0..up {
            // The diagonal contains the reversible part, which is many times larger.
            let share = if down + 1 == up || largest <= 0.0 { 1.0 } else { table.weight(up, down) / largest };
            // Rounding of the nodes may give a slightly negative weight instead of zero.
            chart.patches.push(cell(up, down, Some(if share > 0.0 { share.sqrt() } else { 0.0 })));
        }
    }
    for (up, down) in identified.report.unexcited.iter().flat_map(|r| &r.members) {
        chart.patches.push(cell(*up, *down, None));
    }
    let share = 100.0 * (1.0 - identified.report.excited_share);
    chart.hatched = Some(if share > 0.0 {
        format!("not excited: {share:.1} % of the cells")
    } else {
        "not excited: none".to_owned()
    });
    let ends = [[table.drive_min; 2], [table.drive_max; 2]];
    chart.with("up = down", Mark::Line(1.0), ends.to_vec()).colored(GREY)
}

/// A vertical bar from below a value to above it, in units of `1 / scale`.
fn bar(x: f64, value: f64, half: f64, scale: f64) -> [[f64; 2]; 3] {
    [[x, (value - half) * scale], [x, (value + half) * scale], [f64::NAN; 2]]
}

fn curve(choice: &GridChoice) -> Chart {
    let points: Vec<[f64; 2]> = choice.scores.iter().map(|s| [s.grid as f64, s.held_out_rms * 1e9]).collect();
    let chosen = points.iter().copied().filter(|p| p[0] == choice.chosen as f64).collect();
    let bars = choice.scores.iter().flat_map(|s| bar(s.grid as f64, s.held_out_rms, s.standard_error, 1e9)).collect();
    panel(
        &format!("Curves held out: N = {} chosen", choice.chosen),
        Axis::linear("grid N", ""),
        Axis::linear("held-out error", "nm rms"),
    )
    .with("standard error of the difference to the best", Mark::Line(1.0), bars)
    .colored(GREY)
    .with("error", Mark::Line(1.5), points)
    .colored(BLUE)
    .with("chosen", Mark::Dots(5.0), chosen)
    .colored(ORANGE)
}

/// Loops and their lines, and gain over frequency. `records` are in the order given.
pub fn linear(report: &LinearReport, records: &[Record]) -> String {
    let mut loops = panel("Y = ρX + δ", Axis::linear("drive", "V"), Axis::linear("displacement", "µm"));
    let mut rest = panel("Distance from the line", Axis::linear("drive", "V"), Axis::linear("Y − ρX − δ", "nm"));
    for (k, relation) in report.relations.iter().enumerate() {
        let Some(record) = records.iter().find(|r| r.shown_as == relation.record) else { continue };
        let inside: Vec<usize> = (0..record.time.len())
            .filter(|&i| record.time[i] >= relation.span[0] && record.time[i] <= relation.span[1])
            .collect();
        let name = format!("{:.4} Hz", relation.frequency);
        let points = inside.iter().map(|&i| [record.drive[i], record.displacement[i] * 1e6]).collect();
        loops = loops.with(&name, Mark::Line(1.2), points).colored(k);
        let off = |i: usize| record.displacement[i] - relation.gain * record.drive[i] - relation.offset;
        rest = rest
            .with(&name, Mark::Line(1.0), inside.iter().map(|&i| [record.drive[i], off(i) * 1e9]).collect())
            .colored(k);
        let (low, high) = specgen_identify::extent(&inside.iter().map(|&i| record.drive[i]).collect::<Vec<_>>());
        let at = |u: f64| [u, (relation.gain * u + relation.offset) * 1e6];
        loops = loops.with("", Mark::Dashed(1.0), vec![at(low), at(high)]).colored(k);
    }
    let gains: Vec<[f64; 2]> = report.relations.iter().map(|r| [r.frequency, r.gain * 1e6]).collect();
    let bars = report.relations.iter().flat_map(|r| bar(r.frequency, r.gain, 2.0 * r.gain_error, 1e6)).collect();
    let reference = vec![[report.reference_frequency, report.reference_gain * 1e6]];
    let gain = panel("Gain over frequency", Axis::log("frequency", "Hz"), Axis::linear("ρ", "µm/V"))
        .with("± 2 standard errors", Mark::Line(1.5), bars)
        .colored(GREY)
        .with("ρ", Mark::Dots(3.5), gains)
        .colored(BLUE)
        .with("reference ρ̂", Mark::Dots(5.0), reference)
        .colored(ORANGE);
    let widths: Vec<[f64; 2]> = report.relations.iter().map(|r| [r.frequency, r.loop_percent]).collect();
    let width = panel("Loop width", Axis::log("frequency", "Hz"), Axis::linear("width", "% of range")).with(
        "",
        Mark::Dots(3.5),
        widths,
    );
    let (per_volt, frequency, low) = (report.reference_gain * 1e6, report.reference_frequency, report.gain_ratio[0]);
    let high = report.gain_ratio[1];
    let subtitle =
        format!("reference gain {per_volt:.5} µm/V at {frequency:.4} Hz; λ = ρ/ρ̂ from {low:.4} to {high:.4}");
    figure("Linear relation of displacement and drive", &subtitle, &[loops, rest, gain, width], 2)
}

/// Magnitude, phase and coherence, with the fitted model.
pub fn response(Estimate { record, value: report, .. }: &Estimate<FrequencyResponse>) -> String {
    let shown: Vec<_> = report
        .bins
        .iter()
        .filter(|b| b.frequency > 0.0 && b.frequency >= 0.5 * report.band[0] && b.frequency <= 1.1 * report.band[1])
        .collect();
    let inside = |f: f64| f >= report.band[0] && f <= report.band[1];
    let modelled: Vec<(f64, f64, f64)> = shown
        .iter()
        .filter(|b| inside(b.frequency))
        .map(|b| {
            let (size, phase) = specgen_identify::response::response(&report.fitted, b.frequency);
            (b.frequency, size, phase)
        })
        .collect();
    let hatched: Vec<[f64; 2]> = report.left_out.iter().map(|b| [b.low, b.high]).collect();
    let with_gaps = |mut panel: Chart, range: [f64; 2]| {
        panel.patches = hatched.iter().map(|x| Patch { x: *x, y: range, shade: None }).collect();
        panel.hatched = (!hatched.is_empty()).then(|| "excluded".to_owned());
        panel
    };
    let size = |h: [f64; 2]| libm::hypot(h[0], h[1]) * 1e6;
    let sizes: Vec<f64> =
        shown.iter().filter(|b| inside(b.frequency)).map(|b| size(b.h)).filter(|s| *s > 0.0).collect();
    let range = specgen_identify::extent(&sizes);
    let magnitude =
        with_gaps(panel("Magnitude", Axis::log("frequency", "Hz"), Axis::log("|H|", "µm/V")), [range.0, range.1])
            .with(
                "measured H1",
                Mark::Dots(1.6),
                shown.iter().filter(|b| inside(b.frequency)).map(|b| [b.frequency, size(b.h)]).collect(),
            )
            .with("model", Mark::Line(1.6), modelled.iter().map(|m| [m.0, m.1 * 1e6]).collect());
    // The measured phase is unwrapped to be close to the model's, which does not jump.
    let turn = |b: &&specgen_identify::response::Bin| {
        let (_, phase) = specgen_identify::response::response(&report.fitted, b.frequency);
        let off = libm::atan2(b.h[1], b.h[0]) - phase;
        let off = off - std::f64::consts::TAU * libm::rint(off / std::f64::consts::TAU);
        [b.frequency, (phase + off).to_degrees()]
    };
    let lowest = modelled.iter().fold(0.0, |m, p| if p.2 < m { p.2 } else { m }).to_degrees();
    let phase = with_gaps(panel("Phase", Axis::log("frequency", "Hz"), Axis::linear("phase", "°")), [lowest, 0.0])
        .with("measured H1", Mark::Dots(1.6), shown.iter().filter(|b| inside(b.frequency)).map(turn).collect())
        .with("model", Mark::Line(1.6), modelled.iter().map(|m| [m.0, m.2.to_degrees()]).collect());
    let mut coherence =
        with_gaps(panel("Coherence", Axis::log("frequency", "Hz"), Axis::linear("γ²", "")), [0.0, 1.05])
            .with("", Mark::Line(1.0), shown.iter().map(|b| [b.frequency, b.coherence]).collect())
            .colored(PURPLE);
    coherence.y_limits = Some([0.0, 1.05]);
    let f = &report.fitted;
    let (hertz, hertz_error, ratio) = (f.resonance.value, f.resonance.error, f.damping_ratio.value);
    let (ratio_error, lag, lag_error) = (f.damping_ratio.error, f.lag.value * 1e3, f.lag.error * 1e3);
    let (dead_time, dead_time_error, gain) = (f.dead_time.value * 1e3, f.dead_time.error * 1e3, f.gain.value * 1e6);
    let (segments, segment) = (report.segments, report.segment);
    let subtitle = format!(
        "resonance {hertz:.2} ± {hertz_error:.1e} Hz; ζ {ratio:.4} ± {ratio_error:.1e}; lag {lag:.4} ± {lag_error:.1e} ms; dead time {dead_time:.4} ± {dead_time_error:.1e} ms; gain {gain:.5} µm/V; {segments} segments of {segment}"
    );
    figure(&format!("Frequency response of {}", shortened(record)), &subtitle, &[magnitude, phase, coherence], 2)
}

/// Calibration and its residual.
pub fn gauge(Estimate { record, value: report, .. }: &Estimate<GaugeCalibration>) -> String {
    let value = |v: f64| report.coefficients.iter().rev().fold(0.0, |sum, c| sum * v + c);
    let [low, high] = report.volts;
    let line = (0..=200).map(|k| low + (high - low) * f64::from(k) / 200.0).map(|v| [v, value(v) * 1e6]).collect();
    let measured: Vec<[f64; 2]> = report.points.iter().map(|p| [p[0], (value(p[0]) + p[1]) * 1e6]).collect();
    let calibration = panel("Calibration", Axis::linear("gauge", "V"), Axis::linear("reference", "µm"))
        .with("measured", Mark::Dots(2.0), measured)
        .with(&format!("polynomial of degree {}", report.degree), Mark::Line(1.4), line);
    let rest = panel("Residual", Axis::linear("gauge", "V"), Axis::linear("reference − calibration", "nm"))
        .with("", Mark::Dots(2.0), report.points.iter().map(|p| [p[0], p[1] * 1e9]).collect())
        .colored(PURPLE);
    let errors: Vec<[f64; 2]> =
        report.held_out_rms.iter().enumerate().map(|(k, e)| [(k + 1) as f64, e * 1e9]).collect();
    let chosen = errors.iter().copied().filter(|p| p[0] == report.degree as f64).collect();
    let degrees = panel("Held-out points", Axis::linear("degree", ""), Axis::log("held-out error", "nm rms"))
        .with("error", Mark::Line(1.5), errors)
        .with("chosen", Mark::Dots(5.0), chosen);
    let (degree, rms, most) = (report.degree, report.residual_rms * 1e9, report.residual_max * 1e9);
    let hysteresis =
        report.hysteresis.map_or_else(|| "unknown (no reversal)".to_owned(), |h| format!("{:.2} nm", h * 1e9));
    let slope = report.least_slope_percent;
    let subtitle = format!(
        "degree {degree}; residual {rms:.2} nm rms, at most {most:.2} nm; hysteresis {hysteresis}; smallest slope {slope:.1} % of the mean"
    );
    figure(&format!("Gauge calibration of {}", shortened(record)), &subtitle, &[calibration, rest, degrees], 2)
}

/// Force over displacement without creep, and the residual.
pub fn stiffness(Estimate { record, value: report, .. }: &Estimate<AxialStiffness>) -> String {
    let measured = report.points.iter().map(|p| [p[0], p[1] * 1e9]).collect();
    let [low, high] = report.force;
    let line = vec![[low, low / report.stiffness * 1e9], [high, high / report.stiffness * 1e9]];
    let law = panel(
        "Displacement without offset, drift and creep",
        Axis::linear("force", "N"),
        Axis::linear("displacement", "nm"),
    )
    .with("measured", Mark::Dots(1.6), measured)
    .with("force / k", Mark::Line(1.4), line);
    let points = report.time.iter().zip(&report.points).map(|(t, p)| [*t, p[2] * 1e9]).collect();
    let rest = panel("Residual", Axis::linear("time", "s"), Axis::linear("measured − model", "nm"))
        .with("", Mark::Line(0.9), points)
        .colored(PURPLE);
    let subtitle = format!(
        "k = {:.4} ± {:.4} N/µm; {}",
        report.stiffness * 1e-6,
        report.error * 1e-6,
        report.creep_time.map_or_else(
            || "no creep found".to_owned(),
            |t| format!("creep {:.1} % with {t:.3} s removed", report.creep_percent)
        )
    );
    figure(&format!("Stiffness from {}", shortened(record)), &subtitle, &[law, rest], 2)
}
