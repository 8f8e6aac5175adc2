//! `specgen identify linear`.
use std::path::Path;

use serde::Serialize;

use super::{Bench, MeasuredKeys, refused};
use crate::identification as figure;
use specgen_compiler::compile;
use specgen_compiler::stability::Margins;
use specgen_identify as identify;
use specgen_identify::linear::{self, LinearReport, PAPER_PROPORTION};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::Adaptation;
use specgen_language::outcome::{Failure, Outcome, Refusal};
use specgen_language::spec::{self, SpecSource};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;

/// Weights per run printed in the paper.
const PAPER: [f64; 2] = [0.252, 0.011];

/// Reads the records, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(
    records: &[impl AsRef<Path>],
    frequencies: &[f64],
    reference: Option<f64>,
    spec: Option<&Path>,
    bench: &Bench,
    ui: &mut Ui,
) -> Result<(), Failure> {
    if !frequencies.is_empty() && frequencies.len() != records.len() {
        return Err(Failure::Usage(format!(
            "--frequency gives {} frequencies for {} records",
            frequencies.len(),
            records.len()
        )));
    }
    let mut read = Vec::new();
    let mut relations = Vec::new();
    let mut bad = Vec::new();
    for (k, path) in records.iter().map(AsRef::as_ref).enumerate() {
        let shown = path.display().to_string();
        let found = identify::read_record(path, &shown, &bench.reading).and_then(|record| {
            let relation = linear::relation(&record, frequencies.get(k).copied())?;
            Ok((record, relation))
        });
        match found {
            Ok((record, relation)) => {
                ui.findings(None, &record.warnings);
                read.push(record);
                relations.push(relation);
            }
            Err(findings) => bad.extend(findings),
        }
    }
    if !bad.is_empty() {
        return Err(refused(bad));
    }
    let report = linear::together(relations, reference).map_err(refused)?;
    let spec = spec.map(|path| judge(path, &report)).transpose()?;
    let plot = bench.plot.write("Linear relation", || figure::linear(&report, &read))?.unwrap_or_default();
    let simulated = report.relations.iter().any(|relation| relation.simulated);
    let measured = MeasuredKeys::of(&["actuator.stack_gain", "adaptation.gain_ratio"], simulated);
    ui.result(&LinearRelation { gain_ratio: report.gain_ratio_for_spec(), report, measured, spec, plot });
    Ok(())
}

/// An identified linear relation.
#[derive(Serialize)]
struct LinearRelation {
    report: LinearReport,
    gain_ratio: [f64; 2],
    measured: MeasuredKeys,
    spec: Option<WeightCheck>,
    #[serde(skip)]
    plot: String,
}

/// Stability check of a spec's sampled loop over the identified λ.
#[derive(Serialize)]
struct WeightCheck {
    stacks: f64,
    verdict: Verdict,
    #[serde(skip)]
    name: String,
    #[serde(skip)]
    adaptation: Adaptation,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Verdict {
    Stable { stable: bool, margins: Option<Margins>, design: bool },
    Unstable { stable: bool, findings: Vec<Reason> },
}

#[derive(Serialize)]
struct Reason {
    code: &'static str,
    message: String,
    help: String,
}

impl Outcome for LinearRelation {
    fn text(&self) -> String {
        let mut text = table(&self.report);
        match &self.spec {
            None => static_verdict(&self.report, &mut text),
            Some(judged) => text += &judged.text(),
        }
        lines(&self.report, self.spec.as_ref().map(|judged| judged.stacks), &mut text);
        text + &self.measured.text() + &self.plot
    }
}

fn table(report: &LinearReport) -> String {
    let mut text = "Y = ρX + δ\n".to_owned();
    let columns = [12, 10, 10, 10, 8, 4, 11, 6].map(|width| right(width).behind("  "));
    let columns = [&columns[..], &[left(0).behind("  ")]].concat();
    row(
        &mut text,
        &columns,
        &[&"frequency Hz", &"ρ µm/V", &"± std err", &"δ µm", &"loop µm", &"%", &"correlation", &"cycles", &"record"],
    );
    for r in &report.relations {
        let [gain, error] = [r.gain, r.gain_error].map(|value| format!("{:.6}", value * 1e6));
        let [offset, width] = [r.offset, r.loop_width].map(|value| format!("{:.4}", value * 1e6));
        let (hertz, percent) = (format!("{:.4}", r.frequency), format!("{:.1}", r.loop_percent));
        let correlation = format!("{:.5}", r.correlation);
        row(
            &mut text,
            &columns,
            &[&hertz, &gain, &error, &offset, &width, &percent, &correlation, &r.cycles, &r.record],
        );
    }
    let (gain, frequency, low) = (report.reference_gain * 1e6, report.reference_frequency, report.gain_ratio[0]);
    let high = report.gain_ratio[1];
    text += &format!(
        "reference: ρ̂ = {gain:.6} µm/V, at {frequency:.4} Hz; λ = ρ/ρ̂ from {low:.4} to {high:.4} (including two standard errors)\n"
    );
    text
}

fn static_verdict(report: &LinearReport, text: &mut String) {
    let yes = |stable: bool| if stable { "stable" } else { "not stable" };
    let (ewma_limit, level, ewma) = (report.largest_ewma_weight, PAPER[0], yes(report.ewma_is_stable(PAPER[0])));
    let (pcc_limit, drift, pcc) = (report.largest_pcc_weight, PAPER[1], yes(report.pcc_is_stable(PAPER[0], PAPER[1])));
    *text += &format!(
        "for a leg without dynamics: EWMA (AII.18, corrected to 0 < λω < 2) up to ω = {ewma_limit:.4}, ω = {level} is {ewma}; \
         PCC (AII.19) up to ω1 = {pcc_limit:.4} with ω2 = {PAPER_PROPORTION:.4} ω1, ω1 = {level}, ω2 = {drift} is {pcc}\n"
    );
    text.push_str(
        "resonance and lag of the leg lower these limits: use --spec to check the sampled loop of a platform\n",
    );
}

/// Stability of the spec's own weights over the identified λ.
fn judge(path: &Path, report: &LinearReport) -> Result<WeightCheck, Failure> {
    let source = SpecSource::read(path).map_err(|finding| refused(vec![finding]))?;
    let (model, findings) = spec::load(&source);
    let Some(mut model) = model else {
        return Err(Failure::from(Refusal { source: Some(source), findings }));
    };
    model.adaptation.gain_ratio = report.gain_ratio_for_spec();
    let verdict = match compile::check_stability(&model) {
        Ok((margins, design)) => Verdict::Stable { stable: true, margins, design: design.is_some() },
        Err(found) => {
            let reason = |f: Diagnostic| Reason { code: f.code, message: f.message, help: f.help };
            Verdict::Unstable { stable: false, findings: found.into_iter().map(reason).collect() }
        }
    };
    let stacks = f64::from(model.actuator.stacks);
    Ok(WeightCheck { stacks, verdict, name: path.display().to_string(), adaptation: model.adaptation })
}

impl WeightCheck {
    fn text(&self) -> String {
        let Self { name, adaptation, .. } = self;
        match &self.verdict {
            Verdict::Stable { margins: Some(margins), .. } if adaptation.level_weight > 0.0 => {
                let largest = margins
                    .largest_level_weight
                    .map_or_else(String::new, |w| format!("; stable up to level weight {w:.4}"));
                format!(
                    "{name}: the weights (level {}, drift {}) are stable over this range of λ; spectral radius {:.4}{largest}\n",
                    adaptation.level_weight, adaptation.drift_weight, margins.spectral_radius
                )
            }
            Verdict::Stable { .. } => format!("{name}: the adaptation is stable over this range of λ\n"),
            Verdict::Unstable { findings, .. } => {
                let reasons = findings.iter().map(|f| format!("  {}: {}\n    help: {}\n", f.code, f.message, f.help));
                format!("{name}: the weights are NOT stable over this range of λ\n") + &reasons.collect::<String>()
            }
        }
    }
}

fn lines(report: &LinearReport, stacks: Option<f64>, text: &mut String) {
    let [low, high] = report.gain_ratio_for_spec();
    let gain = report.reference_gain * 1e6 / stacks.unwrap_or(1.0);
    let note = match stacks {
        Some(n) if n > 1.0 => format!("for one stack: the record's gain divided by {n}"),
        Some(_) => "for one stack".to_owned(),
        None => "if the record is of one stack; for a leg divide by actuator.stacks".to_owned(),
    };
    *text += &format!(
        "spec lines:\n[actuator]\nstack_gain = \"{gain:.6} um/V\"  # {note}\n[adaptation]\ngain_ratio = [{low:.3}, {high:.3}]\n"
    );
}
