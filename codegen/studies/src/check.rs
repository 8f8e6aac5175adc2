//! Reports every finding about a spec; writes nothing.

use std::path::Path;

use serde::Serialize;

use crate::details;
use crate::verdict::{Answer, Verdict};
use specgen_compiler::compile::Compilation;
use specgen_compiler::lint::paths::PathDemand;
use specgen_compiler::lower::PoseNoise;
use specgen_compiler::lower::setpoint::Stopping;
use specgen_compiler::precision::Precision;
use specgen_compiler::reach::Reach;
use specgen_compiler::rest::RestNoise;
use specgen_compiler::stability::Margins;
use specgen_compiler::stability::platform::Design;
use specgen_compiler::{lint, precision, reach, spec_file};
use specgen_identify::Report;
use specgen_language::outcome::{Failure, Outcome, Refusal};
use specgen_language::shell;
use specgen_language::ui::Ui;

/// A valid spec and its properties.
#[derive(Serialize)]
struct CheckReport<'a> {
    name: &'a str,
    digest: &'a str,
    verdict: Verdict,
    margins: &'a Option<Margins>,
    design: &'a Option<Design>,
    reach: &'a Option<Reach>,
    pose_noise: &'a Option<PoseNoise>,
    rest_noise: &'a RestNoise,
    records: &'a [Option<Report>],
    trajectories: &'a [PathDemand],
    stops: &'a [Stopping],
    precision: &'a Precision,
    precision_ratio: Ratio,
    #[serde(skip)]
    compiled: &'a Compilation,
    #[serde(skip)]
    details: bool,
}

/// Bounds of rounding errors relative to the largest ones found.
#[derive(Serialize)]
struct Ratio {
    legs: [Option<f64>; 6],
    commanded: [Option<f64>; 6],
    measured: Option<[Option<f64>; 6]>,
}

/// Reports every finding about a spec, and the verdict; with further properties if `details`.
///
/// # Errors
/// The spec is refused or not ready, or it has a warning and warnings are denied.
pub fn run(spec: &Path, details: bool, deny_warnings: bool, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec_file::quietly(spec, ui)?;
    // Findings use the bounds. The search for actual errors takes longer and runs only if its result is shown.
    let shown_whole = details || ui.is_json();
    let precision = if shown_whole { precision::of } else { precision::bounds };
    let precision = precision(&compiled.model, &compiled.ir)
        .map_err(|findings| Refusal { source: Some(compiled.source.clone()), findings })?;
    let mut findings = compiled.findings.clone();
    findings.extend(precision::findings(&compiled.model, &precision, compiled.pose_noise.as_ref()));
    findings.extend(lint::estimated(&compiled.model));
    findings.extend(compiled.unmet_requirements());
    findings.extend(compiled.reach.iter().flat_map(|reach| reach::notes(&compiled.model, reach)));
    spec_file::accept(&compiled, &findings, deny_warnings)?;
    ui.findings(Some(&compiled.source), &findings);
    let ratio = Ratio {
        legs: precision.legs.ratio(),
        commanded: precision.commanded.ratio(),
        measured: precision.measured.map(|figures| figures.ratio()),
    };
    let mut verdict = Verdict::of(&compiled, "time, memory, bits: the next command measures them");
    verdict.next = vec![shell::on("specgen", spec, "-o DIR"), shell::on("specgen sim", spec, "")];
    let failed = (verdict.answer == Answer::NotReady).then(|| verdict.headline());
    let checked = CheckReport {
        name: &compiled.ir.name,
        digest: &compiled.ir.digest,
        verdict,
        margins: &compiled.margins,
        design: &compiled.design,
        reach: &compiled.reach,
        pose_noise: &compiled.pose_noise,
        rest_noise: &compiled.rest_noise,
        records: &compiled.records,
        trajectories: &compiled.demands,
        stops: &compiled.stops,
        precision: &precision,
        precision_ratio: ratio,
        compiled: &compiled,
        details,
    };
    ui.judged(&checked, failed)
}

impl Outcome for CheckReport<'_> {
    fn text(&self) -> String {
        let verdict = self.verdict.text();
        if !self.details {
            return verdict;
        }
        let precision = precision::describe(self.precision, self.compiled.ir.scalar);
        format!("{verdict}\n{}{precision}", details::of(self.compiled))
    }
}
