//! Starting points of a search: the spec's own parameters, and those of Ziegler and Nichols from a relay test.

use host_sim::platform::rig::Noise;

use super::{Job, refused};
use specgen_compiler::stability::platform::{ClosedLoop, Tuning};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::machine::{self, run_failure};
use specgen_studies::tuning::feasible::Feasibility;
use specgen_studies::tuning::relay::{self, Ultimate};
use specgen_studies::tuning::space::{Role, rounded};
use specgen_studies::tuning::{Case, Evaluation, Score, Setting};

/// Starting points.
pub(super) struct Starts {
    /// The values from the spec or chosen by the compiler.
    own: Setting,
    /// Ziegler and Nichols, before any reduction.
    ziegler_nichols: Option<Setting>,
    /// K_u and T_u by axis.
    pub(super) ultimate: Option<[Option<Ultimate>; 6]>,
    /// Starts reduced until they meet the margins, with scores.
    scored: Vec<(Setting, Score)>,
    pub(super) best: Setting,
    pub(super) score: Score,
}

impl Starts {
    /// Settings for the report, by name: unreduced, even if they do not meet the margins.
    pub(super) fn rows(&self) -> Vec<(&'static str, Setting)> {
        let mut rows = vec![("spec", self.own)];
        rows.extend(self.ziegler_nichols.map(|setting| ("Ziegler-Nichols", setting)));
        rows
    }

    /// Settings that meet the margins.
    pub(super) fn feasible(&self) -> impl Iterator<Item = &Setting> {
        self.scored.iter().map(|(setting, _)| setting)
    }
}

pub(super) fn starts(job: &Job, case: &Case, own: Setting, ui: &Ui) -> Result<Starts, Failure> {
    let gains = job.space.parameters.iter().any(|parameter| matches!(parameter.role, Role::Proportional(_)));
    let ultimate = if gains { relay_test(job, ui)? } else { None };
    let ziegler_nichols = ultimate.as_ref().and_then(|found| of_relay(job, own, found));
    let mut worker = case.worker();
    let mut scored = Vec::new();
    let mut limited = None;
    for start in [Some(own), ziegler_nichols].into_iter().flatten() {
        let Some(setting) = job.feasibility.reduce(&job.space, start) else { continue };
        match case.run(&mut worker, &setting).map_err(run_failure)? {
            Evaluation::Scored(score) => scored.push((setting, score)),
            Evaluation::Limited { time, status } => limited = Some((time, status)),
        }
    }
    let mut best: Option<(Setting, Score)> = None;
    for (setting, score) in &scored {
        if best.is_none_or(|(_, least)| score.cost < least.cost) {
            best = Some((*setting, *score));
        }
    }
    let Some((best, score)) = best else { return Err(no_start(job, limited)) };
    Ok(Starts { own, ziegler_nichols, ultimate, scored, best, score })
}

fn relay_test(job: &Job, ui: &Ui) -> Result<Option<[Option<Ultimate>; 6]>, Failure> {
    let (Some(task), Feasibility::Platform { corners, .. }) = (&job.compiled.model.task_space, &job.feasibility) else {
        return Ok(None);
    };
    ui.progress("relay feedback test of each axis, with the notch");
    let model = &job.compiled.model;
    let seed = job.options.plant.seed;
    let specimen = machine::specimen(model, task, &job.leg, Some(seed));
    let mut scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), seed);
    scenario.options.latency = job.options.latency as usize;
    let radius = model.geometry.joint_radius();
    let lead = job.compiled.design.as_ref().map_or(0.0, |design| design.lead) / model.timing.period;
    // Only P/F has active damping.
    let closed_loop = corners.closed_loop();
    let active_damping = closed_loop.active_damping.filter(|_| !job.space.alone);
    let closed_loop = ClosedLoop { active_damping, ..closed_loop.clone() };
    relay::test(&scenario, &job.controller, &closed_loop, [radius, lead]).map(Some).map_err(run_failure)
}

/// PI gains of the relay test instead of the spec's; `None` if an axis did not oscillate.
fn of_relay(job: &Job, own: Setting, found: &[Option<Ultimate>; 6]) -> Option<Setting> {
    let Setting::Platform { combined, position, period } = own else { return None };
    let stiffness = job.space.stiffness();
    let mut gains = if job.space.alone { position } else { combined };
    for axis in 0..6 {
        let [proportional, integral] = found[axis]?.ziegler_nichols();
        gains.proportional[axis] = rounded(proportional * stiffness[axis]);
        gains.integral[axis] = rounded(integral * stiffness[axis]);
    }
    let gains = Tuning { derivative: [0.0; 6], ..gains };
    Some(if job.space.alone {
        Setting::Platform { combined, position: gains, period }
    } else {
        Setting::Platform { combined: gains, position, period }
    })
}

fn no_start(job: &Job, limited: Option<(f64, u32)>) -> Failure {
    let spans = &job.compiled.model.spans;
    let keys = ["adaptation.level_weight", "adaptation.level_bandwidth", "gains", "control", "adaptation"];
    let finding = if let Some((time, status)) = limited {
        Diagnostic::at(
            spans,
            &["actuator.voltage"],
            codes::TUNE_LIMITED,
            format!("at {time:.4} s of the trajectory the first stable setting reaches a limit (status {status:#x})"),
            "try another --trajectory or a lower --frequency; bits 0 to 5 are legs at a limit, 8 to 13 implausible gauges, 16 and 17 \
             refused or stale set-points"
                .to_owned(),
        )
    } else {
        let options = job.options;
        Diagnostic::at(
            spans,
            &keys,
            codes::TUNE_NO_START,
            format!(
                "no setting within the bounds is stable with a gain margin of {} and {} ticks of delay",
                options.gain_margin, options.delay_margin
            ),
            "require smaller margins (--gain-margin 1.5, --delay-margin 0) or lower --bounds; `specgen check --details` shows the \
             margins of the unchanged spec"
                .to_owned(),
        )
    };
    refused(&job.compiled, vec![finding])
}
