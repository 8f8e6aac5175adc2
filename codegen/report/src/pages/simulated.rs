//! Sections from simulated runs: the spec's own trajectories, their error budget, hysteresis.

use crate::budget::{self, Pair};
use crate::first::Errors;
use crate::platform::{self, Motion};
use crate::section::Section;
use crate::tracking::{self, Line, PlottedRun, TrackedPath, norm, short};
use crate::{hysteresis, learning, margins};
use host_sim::closed_loop::LEGS;
use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::Noise;
use host_sim::scenario::{MODES, select};
use specgen_compiler::compile::Compilation;
use specgen_language::diagnostic::codes;
use specgen_language::model::TaskSpace;
use specgen_language::shell;
use specgen_studies::machine::run_failure;
use specgen_studies::verdict::Figure;

use super::SEED;
use specgen_compiler::lower;
use specgen_language::outcome::{Failure, environment};
use specgen_language::ui::Ui;
use specgen_runtime::ControlMode;
use specgen_studies::{machine, reproduce};

/// Frequencies for six legs, Hz; the first is that of the budget.
const LEG_FREQUENCIES: [f64; 2] = [1.0, 10.0];

/// Results of the simulated runs.
pub struct SimulatedRuns {
    pub sections: Vec<Section>,
    pub errors: Errors,
    /// Figures for the verdict.
    pub judged: Vec<Figure>,
}

pub fn of(
    compiled: &Compilation,
    controllers: [&mut Controller; 2],
    name: &str,
    ui: &Ui,
) -> Result<SimulatedRuns, Failure> {
    match &compiled.model.task_space {
        Some(task) => of_platform(compiled, task, controllers, name, ui),
        None => of_legs(compiled, controllers, name, ui),
    }
}

fn of_platform(
    compiled: &Compilation,
    task: &TaskSpace,
    [controller, fine]: [&mut Controller; 2],
    name: &str,
    ui: &Ui,
) -> Result<SimulatedRuns, Failure> {
    let model = &compiled.model;
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(SEED));
    let platform = lower::platform(model).map_err(|_| {
        Failure::Environment("the model of the platform was lost; report this as a specgen bug".to_owned())
    })?;
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    let scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), SEED);
    let all =
        tracking::follow(compiled, task, &scenario, controller, &|what| ui.progress(what)).map_err(run_failure)?;
    let mode = tracking::mode_of(controller);
    let law = margins::name(ControlMode::from_word(u64::from(mode)).unwrap_or(ControlMode::P));
    let corners = compiled.findings.iter().any(|finding| finding.code == codes::TRAJECTORY_CORNERS.id);
    let mut sections =
        vec![tracking::section(&all, &law, model.timing.period, corners, &shell::on("specgen sim", name, "-o DIR"))];
    let played = all.iter().find(|one| one.own && one.run.is_some());
    if let Some((one, run)) = played.and_then(|one| Some((one, one.run.as_ref()?))) {
        let motion = Motion::of_platform(&platform, run, model.timing.period);
        let travel = compiled.reach.as_ref().map_or(model.actuator.stroke, |reach| reach.stroke);
        sections.push(
            Section::new("motion", "Motion", "")
                .lead(&format!(
                    "The true pose along {} at {}; bars show each leg within its travel.",
                    one.name,
                    one.speed()
                ))
                .part(platform::in_motion(model, &motion, travel)),
        );
    }
    ui.progress("error budget");
    let pair = Pair { own: &mut *controller, fine };
    sections.push(budget::of_platform(model, task, &specimen, pair, SEED, &all).map_err(run_failure)?);
    sections.push(margins::section(compiled, mode, &shell::on("specgen check", name, "")));
    if task.correction.is_some() {
        ui.progress("learning between passes");
    }
    let learned = learning::section(compiled, task, &scenario, controller, &shell::on("specgen learn", name, ""));
    sections.extend(learned.map_err(|error| Failure::Gate(error.to_string()))?);
    ui.progress("hysteresis of each leg");
    let legs = &specimen.legs;
    let behind =
        hysteresis::of_platform(&scenario, controller, &platform, &model.actuator, legs, &compiled.records, &all);
    sections.push(behind.map_err(run_failure)?);
    let noise = compiled.pose_noise.as_ref().map(|noise| noise.pose);
    let speed = |own: bool| all.iter().find(|one| one.own == own && one.frequency.is_some()).map(TrackedPath::speed);
    let picture = |turning: bool, unit: &'static str| {
        let lines = tracking::lines(model, noise.as_ref(), &all, turning);
        (unit, tracking::dumbbell(&lines, [speed(true), speed(false)], unit))
    };
    let first = all.iter().find(|one| one.run.is_some());
    let text = first.map(|first| {
        let of = all.iter().filter(|one| one.name == first.name);
        let each = of.filter_map(|one| {
            let (rms, coverage) = (one.rms()?, one.coverage()?);
            Some(format!("{}\u{2009}nm at {} over {coverage}", short(norm(&rms, false)), one.speed()))
        });
        each.collect::<Vec<_>>().join(", ")
    });
    let errors = Errors {
        pictures: vec![picture(false, "nm"), picture(true, "nrad")],
        text: text.unwrap_or_else(|| "no trajectory in the spec".to_owned()),
        note: format!("{law}, rms norm of three axes, simulated."),
    };
    Ok(SimulatedRuns { sections, errors, judged: tracking::figures(model, &all) })
}

fn of_legs(
    compiled: &Compilation,
    [controller, fine]: [&mut Controller; 2],
    name: &str,
    ui: &Ui,
) -> Result<SimulatedRuns, Failure> {
    let model = &compiled.model;
    let leg = LegParameters::reference();
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs: [LegParameters; LEGS] = std::array::from_fn(|_| leg.clone());
    let scenario = machine::legs(model, &legs, &leg.noise, SEED, reproduce::legs::SAMPLES);
    let adaptation = &model.adaptation;
    let mode = usize::from(adaptation.level_weight > 0.0) + usize::from(adaptation.drift_weight > 0.0);
    let (law, word) = MODES[mode];
    let law = margins::adapting_name(law);
    let mut tracked = Section::new("tracking", "Tracking", &shell::on("specgen sim", name, "-o DIR"));
    let (mut values, mut motion) = (Vec::new(), None);
    for frequency in LEG_FREQUENCIES {
        ui.progress(&format!("six legs at {frequency} Hz"));
        select(controller, word).map_err(environment)?;
        let run = scenario.run(controller, frequency).map_err(run_failure)?.tracking;
        let speed = format!("{frequency}\u{2009}Hz");
        let shown = PlottedRun {
            id: format!("legs-{frequency}hz"),
            what: format!("the leg trajectory at {speed}"),
            law,
            names: tracking::LEGS,
            lengths: 6,
            interval: run.interval,
            coverage: run.coverage(),
            samples: run.samples.iter().map(|sample| [sample.target, sample.measured]).collect(),
            corner: "corner",
        };
        values.push((frequency == LEG_FREQUENCIES[0], shown.rms_nano(), Some(shown.coverage)));
        tracked = tracked.pane(&[&speed], tracking::pane(&shown));
        if motion.is_none() {
            motion = Motion::of_legs(model, &run);
        }
    }
    let mut sections = vec![tracked];
    if let Some(motion) = motion {
        sections.push(
            Section::new("motion", "Motion", "")
                .lead("Gauge readings of the legs, and the resulting pose of the platform, which no gauge of this spec measures.")
                .part(platform::in_motion(model, &motion, model.actuator.stroke)),
        );
    }
    ui.progress("error budget");
    sections.push(budget::of_legs(&leg, mode, Pair { own: &mut *controller, fine }, SEED).map_err(run_failure)?);
    sections.push(margins::section(compiled, mode as u32, &shell::on("specgen check", name, "")));
    sections.push(hysteresis::of_legs(&leg, model.actuator.voltage[0], &compiled.records));
    let text = values.iter().zip(LEG_FREQUENCIES).map(|((_, nm, coverage), hertz)| {
        let over = coverage.map_or_else(String::new, |coverage| format!(" over {coverage}"));
        format!("{}\u{2009}nm at {hertz}\u{2009}Hz{over}", short(*nm))
    });
    let text = text.collect::<Vec<_>>().join(", ");
    let line = Line { name: "leg trajectory".to_owned(), values, note: String::new(), limit: None };
    let speeds = LEG_FREQUENCIES.map(|hertz| Some(format!("{hertz}\u{2009}Hz")));
    let errors = Errors {
        pictures: vec![("nm", tracking::dumbbell(&[line], speeds, "nm"))],
        text,
        note: format!(
            "{law}, rms gauge error of six legs, simulated. The spec has no [control], so there is no position control of the platform."
        ),
    };
    Ok(SimulatedRuns { sections, errors, judged: Vec::new() })
}
