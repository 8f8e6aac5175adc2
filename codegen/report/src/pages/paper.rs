//! The page that compares the paper's figures and tables with ours.

use crate::hysteresis;
use crate::paper::{legs, linear, machining, motion, region};
use crate::section::Section;
use host_sim::closed_loop::LEGS;
use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::Noise;
use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_language::shell;
use specgen_studies::machine::run_failure;
use specgen_studies::paper::convergence;

use super::SEED;
use specgen_compiler::lower;
use specgen_language::outcome::{Failure, environment};
use specgen_language::ui::Ui;
use specgen_studies::{machine, reproduce};

pub fn sections(
    compiled: &Compilation,
    controller: &mut Controller,
    generations: u32,
    name: &str,
    ui: &Ui,
) -> Result<Vec<Section>, Failure> {
    let mut sections = match &compiled.model.task_space {
        Some(task) => of_platform(compiled, task, controller, name, ui)?,
        None => of_legs(compiled, controller, name, ui)?,
    };
    sections.push(converge(compiled, controller, generations, name, ui)?);
    Ok(sections)
}

fn of_platform(
    compiled: &Compilation,
    task: &TaskSpace,
    controller: &mut Controller,
    name: &str,
    ui: &Ui,
) -> Result<Vec<Section>, Failure> {
    let model = &compiled.model;
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(SEED));
    let platform = lower::platform(model).map_err(|_| {
        Failure::Environment("the model of the platform was lost; report this as a specgen bug".to_owned())
    })?;
    let scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), SEED);
    let sim = shell::on("specgen sim", name, "--frequency 0.1,1,10 -o DIR");
    let mut sections = motion::sections(&scenario, controller, &sim, &|what| ui.progress(what)).map_err(run_failure)?;
    ui.progress("machining, linear relation");
    let machined = machining::section(&scenario, controller, &shell::on("specgen sim", name, "-o DIR"));
    sections.push(machined.map_err(run_failure)?);
    sections.push(hysteresis::of_paper(&specimen.legs[0], model.actuator.voltage[0]));
    sections.push(linear::of_platform(&scenario, controller, &platform, &model.actuator, "").map_err(run_failure)?);
    sections.push(region::section(compiled, None).map_err(environment)?);
    Ok(sections)
}

fn of_legs(compiled: &Compilation, controller: &mut Controller, name: &str, ui: &Ui) -> Result<Vec<Section>, Failure> {
    let model = &compiled.model;
    let leg = LegParameters::reference();
    let all: [LegParameters; LEGS] = std::array::from_fn(|_| leg.clone());
    let scenario = machine::legs(model, &all, &leg.noise, SEED, reproduce::legs::SAMPLES);
    let sim = shell::on("specgen sim", name, "-o DIR");
    ui.progress("leg tracking, linear relation, stability region");
    let adaptation = &model.adaptation;
    let mode = usize::from(adaptation.level_weight > 0.0) + usize::from(adaptation.drift_weight > 0.0);
    let mut tracking = legs::section(&scenario, controller, &sim).map_err(run_failure)?;
    // A law with a zero weight equals the simpler law.
    let same = [
        "The spec gives no weights, so EWMA and PCC equal the inverse model alone and do not reproduce the paper's.",
        "The spec gives no drift weight, so PCC equals EWMA and does not reproduce the paper's.",
    ];
    if let Some(text) = same.get(mode) {
        tracking = tracking.text(text);
    }
    let lines = linear::of_legs(&scenario, controller, &model.actuator, &sim).map_err(run_failure)?;
    let region = region::section(compiled, Some(controller)).map_err(environment)?;
    Ok(vec![tracking, hysteresis::of_paper(&leg, model.actuator.voltage[0]), lines, region])
}

/// The genetic algorithm, or why it was not run: skipped, or nothing to tune in the spec's mode.
fn converge(
    compiled: &Compilation,
    controller: &Controller,
    generations: u32,
    name: &str,
    ui: &Ui,
) -> Result<Section, Failure> {
    let absent = |why: &str| Section::new("convergence", "Genetic algorithm", "").text(&format!("Not run: {why}"));
    if generations == 0 {
        return Ok(absent("skipped by --generations 0."));
    }
    ui.progress(&format!("the genetic algorithm, {generations} generations"));
    let leg = LegParameters::reference();
    match convergence::run(compiled, controller, &leg, SEED, generations as usize, &|_| {}) {
        Ok(found) => {
            let command =
                shell::on("specgen tune", name, &format!("--optimiser genetic --evaluations {}", 100 * generations));
            Ok(crate::paper::convergence::section(&found, &command))
        }
        Err(convergence::ConvergenceError::NothingToTune(why)) => Ok(absent(&format!("{why}."))),
        Err(convergence::ConvergenceError::Run(error)) => Err(environment(error)),
    }
}
