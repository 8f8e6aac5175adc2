//! `specgen check`: every finding about a spec, nothing written.

use std::fmt::Write as _;

use clap::Args;
use serde::Serialize;

use super::named::InputFile;
use super::spec;
use crate::{lint, precision, reach, stability};
use specgen_compiler::compile::Compilation;
use specgen_compiler::lint::paths::PathDemand;
use specgen_compiler::lower::setpoint::{self, Stopping};
use specgen_compiler::lower::{self, PoseNoise};
use specgen_compiler::precision::Precision;
use specgen_compiler::reach::Reach;
use specgen_compiler::rest::RestNoise;
use specgen_compiler::stability::Margins;
use specgen_compiler::stability::platform::Design;
use specgen_identify::Report;
use specgen_language::outcome::Refusal;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::shell;
use specgen_language::ui::Ui;
use specgen_studies::lead::{self, LeadOf};
use specgen_studies::verdict::{Answer, Verdict};

/// Arguments of `check`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::CHECK)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Everything that was found, below the verdict.
    #[arg(long)]
    details: bool,
    #[command(flatten)]
    strictness: super::Strictness,
}

/// A good spec and what is known of it.
#[derive(Serialize)]
struct Checked<'a> {
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

/// Bounds of rounding errors over the largest ones found.
#[derive(Serialize)]
struct Ratio {
    legs: [Option<f64>; 6],
    commanded: [Option<f64>; 6],
    measured: Option<[Option<f64>; 6]>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec::quietly(&arguments.spec, ui)?;
    // Findings come of the bounds; what was found by trial, which takes longer, is shown only where it is asked for.
    let shown_whole = arguments.details || ui.is_json();
    let precision = if shown_whole { precision::of } else { precision::bounds };
    let precision = precision(&compiled.model, &compiled.ir)
        .map_err(|findings| Refusal { source: Some(compiled.source.clone()), findings })?;
    let mut findings = compiled.findings.clone();
    findings.extend(precision::findings(&compiled.model, &precision, compiled.pose_noise.as_ref()));
    findings.extend(lint::estimated(&compiled.model));
    findings.extend(compiled.missed());
    findings.extend(compiled.reach.iter().flat_map(|reach| reach::notes(&compiled.model, reach)));
    arguments.strictness.accept(&compiled, &findings)?;
    ui.findings(Some(&compiled.source), &findings);
    let ratio = Ratio {
        legs: precision.legs.ratio(),
        commanded: precision.commanded.ratio(),
        measured: precision.measured.map(|figures| figures.ratio()),
    };
    let mut verdict = Verdict::of(&compiled, "time, memory, bits: the next command measures them");
    let spec = &arguments.spec;
    verdict.next = vec![shell::on("specgen", spec, "-o DIR"), shell::on("specgen sim", spec, "")];
    let failed = (verdict.answer == Answer::NotReady).then(|| verdict.headline());
    let checked = Checked {
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
        details: arguments.details,
    };
    ui.judged(&checked, failed)
}

impl Outcome for Checked<'_> {
    fn text(&self) -> String {
        let verdict = self.verdict.text();
        if !self.details {
            return verdict;
        }
        let precision = precision::describe(self.precision, self.compiled.ir.scalar);
        format!("{verdict}\n{}{precision}", describe(self.compiled))
    }
}

/// What identification and the stability check found, a line each.
pub fn describe(compiled: &Compilation) -> String {
    let mut text = String::new();
    let assumed = compiled.assumptions.list();
    if !assumed.is_empty() {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(text, "  nobody measured {}:", compiled.assumptions.summary());
        assumed.iter().for_each(|one| text.push_str(&format!("    {one}\n")));
    }
    for (name, report) in compiled.model.hysteresis.records.iter().zip(&compiled.records) {
        let what = report.as_ref().map_or_else(|| "a table, taken as it is".to_owned(), super::identify::summary);
        let _ = writeln!(text, "  record {name}: {what}");
    }
    if let Some(margins) = &compiled.margins
        && let (Some(limit), Some(largest)) = (margins.static_gain_limit, margins.largest_level_weight)
    {
        let _ = writeln!(
            text,
            "  adaptation: λ < {limit:.3} without leg dynamics; sampled leg has spectral radius {:.4}; \
             stable up to level weight {largest:.4} (here {})",
            margins.spectral_radius, compiled.model.adaptation.level_weight
        );
    }
    if let Some(design) = &compiled.design {
        text.push_str(&stability::platform::describe(design));
    }
    for one in lead::of(compiled) {
        let LeadOf { name, lead, best, errors: [error, least] } = &one;
        let _ = write!(
            text,
            "  trajectory {name}: lead {:.4} ms leaves {:.1} nm rms by the model",
            lead * 1e3,
            error * 1e9
        );
        let _ = if one.is_proposed() {
            writeln!(
                text,
                ";\n    its corners ask for less: lead = \"{:.3} ms\" in its [[trajectory]] leaves {:.1} nm",
                best * 1e3,
                least * 1e9
            )
        } else {
            writeln!(text, ", the best {:.1} nm", least * 1e9)
        };
    }
    if let Some(reach) = &compiled.reach {
        text.push_str(&reach::describe(reach, compiled.design.is_some()));
    }
    text.push_str(&lower::describe_wiring(&compiled.model, &compiled.ir.supervision));
    for demand in &compiled.demands {
        let current = demand.current.map_or_else(String::new, |amperes| format!(", {:.3} A", amperes));
        let _ = writeln!(
            text,
            "  trajectory {}: legs at up to {:.1} um/s, which takes {:.3} of {:.3} V/ms{current}; inertia bends them by {:.2} nm",
            demand.name,
            demand.leg_speed * 1e6,
            demand.slew * 1e-3,
            compiled.model.actuator.slew_rate * 1e-3,
            demand.deflection * 1e9
        );
    }
    if let Some(task) = &compiled.ir.task_space {
        text.push_str(&lower::describe_load(&task.load));
    }
    if !compiled.stops.is_empty() {
        text.push_str(&setpoint::describe_stops(&compiled.stops));
    }
    let list = |values: &[f64]| values.iter().map(|v| format!("{:.1}", v * 1e9)).collect::<Vec<_>>().join("/");
    let rest = &compiled.rest_noise;
    let parts = [&rest.pose, &rest.gauges, &rest.amplifiers].map(|part| [list(&part[..3]), list(&part[3..])]);
    let [[pose, turned], [by_gauges, turned_by_gauges], [by_amplifiers, turned_by_amplifiers]] = parts;
    let _ = writeln!(
        text,
        "  pose at rest: {pose} nm and {turned} nrad rms as the gauges show it; {by_gauges} nm and {turned_by_gauges} nrad by the gauges, \
         {by_amplifiers} nm and {turned_by_amplifiers} nrad by the amplifiers"
    );
    if let (Some(noise), Some(task)) = (&compiled.pose_noise, &compiled.ir.task_space) {
        let _ = writeln!(
            text,
            "  gauges: {:.2} nm rms each with quantisation; pose {} nm and {} nrad rms; legs {} nm rms; found in {} passes to {:.1e} m, {:.1e} rad",
            noise.reading * 1e9,
            list(&noise.pose[..3]),
            list(&noise.pose[3..]),
            list(&noise.leg),
            task.sensing.passes,
            task.sensing.remainder[0],
            task.sensing.remainder[1]
        );
    }
    text
}
