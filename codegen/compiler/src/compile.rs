//! The compiler as one function: from a spec file to the constants of a controller. [`Compilation::files`] emits the workspace. It
//! writes nothing.

use std::collections::BTreeMap;
use std::path::Path;

use crate::assumed::Assumptions;
use crate::demand;
use crate::emit;
use crate::ir::Ir;
use crate::lint::{self, paths::PathDemand};
use crate::lower::setpoint::{self, Stopping};
use crate::lower::{self, Origin, PoseNoise};
use crate::reach::{self, Reach};
use crate::rest::{self, RestNoise};
use crate::stability::platform::{Design, RestDynamics};
use crate::stability::{self, Margins};
use crate::{requirements, workspace};
use specgen_identify::leg_model::strokes;
use specgen_identify::{self as identify, declared};
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::model::Model;
use specgen_language::outcome::Refusal;
use specgen_language::spec::{self, SpecSource};
use specgen_toolchain::targets::Target;

/// A spec that compiled.
#[derive(Debug, Clone)]
pub struct Compilation {
    /// The file as read.
    pub source: SpecSource,
    /// The checked model.
    pub model: Model,
    /// Report of the identification of each record, in the order of `hysteresis.records`; none if the file is a table.
    pub records: Vec<Option<identify::Report>>,
    /// Stability of the adaptation of six legs with their own gauges.
    pub margins: Option<Margins>,
    /// Modes, tuning and margins of a controller in task space.
    pub design: Option<Design>,
    /// Reach of the platform and conditioning of its geometry, for a controller in task space.
    pub reach: Option<Reach>,
    /// Demand of each trajectory on the legs, in the order of the spec.
    pub demands: Vec<PathDemand>,
    /// Stopping distances from every declared speed.
    pub stops: Vec<Stopping>,
    /// Sensor noise of the pose, rms, m and rad, if the gauges measure the platform.
    pub pose_noise: Option<PoseNoise>,
    /// Computed closed-loop noise of the pose at rest, as the gauges show it, rms, m and rad.
    pub rest_noise: RestNoise,
    /// Values that were not measured.
    pub assumptions: Assumptions,
    /// Every constant of the controller.
    pub ir: Ir,
    /// Warnings and notes.
    pub findings: Vec<Diagnostic>,
}

impl Compilation {
    /// Emits the workspace, with the program of the spec's board if it has one: path, text. Most commands need no text.
    pub fn files(&self) -> BTreeMap<String, String> {
        workspace::files_with(&self.ir, &emit::emit(&self.ir), &[Target::of(self.model.target.mcu).name])
    }

    /// Requirements that the spec does not meet although it compiles. `check` and `build` report them as errors; a
    /// simulation still runs.
    pub fn unmet_requirements(&self) -> Vec<Diagnostic> {
        rest::check(&self.model, &self.rest_noise)
    }
}

/// All phases before emission: reading, checks, stability, identification, set-points, lowering.
///
/// # Errors
/// The spec or a record is refused. Later phases run only if earlier ones accept, so a second run may find more.
pub fn compile(path: &Path) -> Result<Compilation, Refusal> {
    compile_source(SpecSource::read(path).map_err(|finding| Refusal { source: None, findings: vec![finding] })?)
}

/// The same for a text in memory.
///
/// # Errors
/// As [`compile`].
pub fn compile_source(source: SpecSource) -> Result<Compilation, Refusal> {
    let mut findings = Vec::new();
    let compiled = run_phases(&source, &mut findings);
    lint::in_order(&source, &mut findings);
    match compiled {
        Some(compiled) => Ok(Compilation { findings, ..compiled }),
        None => Err(Refusal { source: Some(source), findings }),
    }
}

/// Runs the phases in their order. None if one of `findings` is an error.
fn run_phases(source: &SpecSource, findings: &mut Vec<Diagnostic>) -> Option<Compilation> {
    let mut model = check_spec(source, findings)?;

    // These are independent: one run reports the findings of all of them.
    let stability = accept(check_stability(&model), findings);
    let records = accept(declared::records(&model, &source.dir), findings);
    let setpoints = accept(setpoint::declared(&model, &source.dir), findings);
    let converters = accept(requirements::check(&model), findings);
    let ((margins, design), mut records, setpoints, ()) = (stability?, records?, setpoints?, converters?);
    records.complete(&model);
    // A spec without `hysteresis.grid` takes that of its records.
    model.hysteresis.grid = records.grid(model.hysteresis.grid);
    findings.extend(records.warnings);
    findings.extend(design.iter().flat_map(|design| design.findings.clone()));
    findings.extend(setpoints.warnings);

    let strokes = strokes(&records.tables, &records.around);
    let demand = accept(demand::check(&model, setpoints.setpoints.as_ref(), &strokes), findings)?;
    findings.extend(demand.warnings);

    let geometry = &model.geometry;
    let joints = || format!("{:?}", [geometry.base_joints, geometry.platform_joints]);
    let joints = geometry.joint_file.clone().map(|name| (name, joints()));
    let digest = lower::digest(&source.text, records.texts.iter().chain(&setpoints.texts).chain(&joints));
    // Only a controller in task space has a design and generates set-points.
    let task = design.as_ref().zip(setpoints.setpoints);
    let assumptions = Assumptions::of(&model, records.simulated);
    let origin = Origin { digest: &digest, assumed: assumptions.list() };
    let ir =
        accept(lower::lower(&model, task, &records.tables, &records.rate_tables, &records.around, origin), findings)?;
    let pose_noise = accept(lower::pose_noise(&model), findings)?;
    let rest_noise = accept(rest::noise(&model, design.as_ref()), findings)?;
    // Again: the phases after `check_spec` have added findings.
    lint::allow(&model, findings);
    findings.extend(lint::unused(&model, findings));
    debug_assert!(findings.iter().all(|finding| finding.severity < Severity::Error));
    Some(Compilation {
        source: source.clone(),
        model,
        records: records.reports,
        margins,
        design,
        reach: demand.reach,
        demands: demand.paths,
        stops: demand.stops,
        pose_noise,
        rest_noise,
        assumptions,
        ir,
        findings: Vec::new(),
    })
}

/// The result of a phase; or none, with its errors added to `findings`.
fn accept<T>(result: Result<T, Vec<Diagnostic>>, findings: &mut Vec<Diagnostic>) -> Option<T> {
    result.map_err(|errors| findings.extend(errors)).ok()
}

/// Reads the spec, and checks each value and their relations.
fn check_spec(source: &SpecSource, findings: &mut Vec<Diagnostic>) -> Option<Model> {
    // With some errors there is still a model, so that the checks below can find more.
    let (model, errors) = spec::load_as_far(source);
    findings.extend(errors);
    let model = model?;
    findings.extend(reach::check_bounds(&model));
    findings.extend(lint::check(&model));
    lint::allow(&model, findings);
    if findings.iter().all(|finding| finding.severity < Severity::Error) {
        return Some(model);
    }
    // Paths can be checked without a valid platform, so their findings are reported in the same run.
    findings.extend(setpoint::declared(&model, &source.dir).map_or_else(|errors| errors, |paths| paths.warnings));
    None
}

/// Checks stability: of the adaptation of each leg without `[control]`, otherwise of the loops over the platform's modes.
///
/// # Errors
/// As [`stability::check`] or [`stability::platform::design`].
pub fn check_stability(model: &Model) -> Result<(Option<Margins>, Option<Design>), Vec<Diagnostic>> {
    match &model.task_space {
        None => stability::check(model).map(|margins| (Some(margins), None)),
        Some(task) => {
            let rest = RestDynamics::of(&lower::platform(model)?);
            stability::platform::design(model, task, &rest).map(|design| (None, Some(design)))
        }
    }
}
