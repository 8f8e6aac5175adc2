//! `specgen report`: one HTML file about a spec.

use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::closed_loop::LEGS;
use host_sim::controller::{Controller, TickController};
use host_sim::plant::LegParameters;
use host_sim::platform::rig::Noise;
use host_sim::scenario::{MODES, select};
use serde::Serialize;

use super::check::describe;
use super::file::{check_place, write_file};
use super::sim::{emitted, environment};
use super::ui::{Failure, Outcome, Ui};
use crate::{lower, machine, precision, reproduce, target, workspace};
use specgen_compiler::compile::{self, Compiled, Refused};
use specgen_language::interrupt::Scratch;
use specgen_language::model::TaskSpace;
use specgen_language::spec::SpecSource;
use specgen_report::evidence::Bits;
use specgen_report::noise::{FINE_BITS, Pair};
use specgen_report::page::{self, Head};
use specgen_report::section::{Part, Section};
use specgen_report::view::Motion;
use specgen_report::{evidence, hysteresis, legs, linear, machining, motion, noise, region, view};
use specgen_studies::paper::convergence;
use specgen_studies::verify::{self, Measurement};

/// Seed of machine, noise and strings.
const SEED: u64 = 1;
/// Ticks of the exercise of bits, as in the main job.
const TICKS: u32 = 20_000;

/// Arguments of `report`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPORT)]
pub struct Arguments {
    /// The spec file.
    spec: PathBuf,
    /// File to write; `<name>-report.html` if not given.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Generations of the genetic algorithm, 100 strings each; 0 leaves it out.
    #[arg(long, default_value_t = 10, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    generations: u32,
    /// Without the emulated microcontroller: no time, memory and comparison of bits.
    #[arg(long)]
    no_target: bool,
}

#[derive(Serialize)]
struct Page<'a> {
    file: String,
    digest: &'a str,
    bytes: usize,
    sections: Vec<&'a str>,
    figures: usize,
}

impl Outcome for Page<'_> {
    fn text(&self) -> String {
        let (sections, figures) = (self.sections.len(), self.figures);
        format!("wrote {}: {sections} sections, {figures} figures, {} kB\n", self.file, self.bytes / 1000)
    }
}

/// The emitted controller, built, and what building and exercising it showed.
struct Built {
    controller: Controller,
    measured: Result<Measurement, String>,
    ticks: usize,
    trace: String,
    state: u64,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = compile::compile(&arguments.spec)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    let output = arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}-report.html", compiled.ir.name)));
    check_place(&output)?;
    let mut built = build(&compiled, arguments.no_target, ui)?;
    let name = file_name(&arguments.spec);
    let mut fine = fine(&compiled, ui)?;
    let simulated = match &compiled.model.task_space {
        Some(task) => of_platform(&compiled, task, [&mut built.controller, &mut fine], &name, ui)?,
        None => of_legs(&compiled, [&mut built.controller, &mut fine], &name, ui)?,
    };
    let converged = converge(&compiled, &built.controller, arguments.generations, &name, ui)?;

    let measured = built.measured.as_ref().map_err(String::as_str);
    let check = format!("specgen check {name}");
    let main = format!("specgen {name} -o DIR");
    let mut sections =
        vec![evidence::summary(&compiled, &describe(&compiled), &check), evidence::findings(&compiled, &check)];
    sections.extend(simulated);
    sections.extend(converged);
    sections.push(evidence::margins(&compiled, &check));
    let rounding = precision::of(&compiled.model, &compiled.ir)
        .map_err(|findings| Refused { source: Some(compiled.source.clone()), findings })?;
    sections.push(evidence::rounding(&rounding, compiled.ir.scalar, &check));
    sections.push(evidence::budget(&compiled.model.target, measured, &main));
    let bits = Bits { ticks: built.ticks, trace: built.trace, state: built.state, measured };
    sections.push(evidence::digests(&compiled, &bits, &main));
    let command = again(arguments, &name);
    for section in sections.iter_mut().filter(|section| section.command.is_empty()) {
        section.command.clone_from(&command);
    }

    let head = Head { name: compiled.ir.name.clone(), digest: compiled.ir.digest.clone(), command };
    let html = page::html(&head, &sections);
    write_file(&output, html.as_bytes())?;
    let figures: usize = sections.iter().flat_map(|section| &section.parts).map(figures).sum();
    ui.result(&Page {
        file: output.display().to_string(),
        digest: &compiled.ir.digest,
        bytes: html.len(),
        sections: sections.iter().map(|section| section.id).collect(),
        figures,
    });
    Ok(())
}

/// The controller of the spec with a drive converter as fine as there is, for the error budget.
fn fine(compiled: &Compiled, ui: &Ui) -> Result<Controller, Failure> {
    let lost = |why: String| {
        Failure::Environment(format!(
            "the spec with dac.bits = {FINE_BITS} does not compile: {why}; report this as a defect of specgen with the spec"
        ))
    };
    let mut document: toml_edit::DocumentMut =
        compiled.source.text.parse().map_err(|error: toml_edit::TomlError| lost(error.to_string()))?;
    // It compiled, so `dac` is a table; anything else would end here.
    document["dac"]["bits"] = toml_edit::value(FINE_BITS);
    let source = SpecSource { text: document.to_string(), ..compiled.source.clone() };
    let fine = compile::compile_source(source).map_err(|refused| {
        lost(refused.findings.into_iter().map(|finding| finding.message).collect::<Vec<_>>().join("; "))
    })?;
    emitted(&fine, ui)
}

/// Charts and views of a part.
fn figures(part: &Part) -> usize {
    match part {
        Part::Charts(charts) => charts.len(),
        Part::View(_) => 1,
        Part::Text(_) | Part::Lines(_) | Part::Table(_) => 0,
    }
}

/// The command line with the name of the spec alone: its folder is the user's business.
fn again(arguments: &Arguments, name: &str) -> String {
    let mut command = format!("specgen report {name}");
    if arguments.generations != 10 {
        command.push_str(&format!(" --generations {}", arguments.generations));
    }
    if arguments.no_target {
        command.push_str(" --no-target");
    }
    command
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Host library, image, and the exercise on both.
fn build(compiled: &Compiled, no_target: bool, ui: &Ui) -> Result<Built, Failure> {
    let scratch = Scratch::new().map_err(environment)?;
    let folder = scratch.path().join("controller");
    let cache = scratch.path().join("target");
    workspace::write_scratch(&folder, &compiled.files)?;
    ui.progress("building the emitted controller for this host");
    let library = target::host::build_library(&folder, &cache)?;
    let mut controller = Controller::load(&library).map_err(environment)?;
    let host = verify::exercise(&mut controller, &compiled.model, &compiled.ir, TICKS).map_err(environment)?;
    let measured = if no_target {
        Err("left out by --no-target".to_owned())
    } else {
        let mcu = compiled.model.target.mcu;
        ui.progress(&format!("building and measuring for {}", mcu.part().emulated));
        let measured = target::available()
            .and_then(|_| target::build_image(&folder, mcu, &cache))
            .and_then(|image| verify::measure(&image, &controller.default_config(), &host));
        match measured {
            Ok(measurement) => Ok(measurement),
            Err(error) if error.is_of_a_tool() => Err(error.to_string()),
            Err(error) => return Err(error.into()),
        }
    };
    let state = host.rows().last().and_then(|row| row.last().copied()).unwrap_or_default();
    Ok(Built { controller, measured, ticks: host.len(), trace: target::sha256(&host.to_bytes()), state })
}

fn of_platform(
    compiled: &Compiled,
    task: &TaskSpace,
    [controller, fine]: [&mut Controller; 2],
    name: &str,
    ui: &Ui,
) -> Result<Vec<Section>, Failure> {
    let model = &compiled.model;
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(SEED));
    let platform = lower::platform(model).map_err(|_| {
        Failure::Environment("the model of the platform was lost; report this as a defect of specgen".to_owned())
    })?;
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    let scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), SEED);
    let sim = format!("specgen sim {name} --frequency 0.1,1,10 -o DIR");
    let (motions, shown) =
        motion::sections(&scenario, controller, &sim, &|what| ui.progress(what)).map_err(environment)?;
    ui.progress("machining, linear relation, error budget");
    let machined =
        machining::section(&scenario, controller, &format!("specgen sim {name} -o DIR")).map_err(environment)?;
    let lines = linear::of_platform(&scenario, controller, &platform, &model.actuator, "").map_err(environment)?;
    let budget =
        noise::of_platform(model, task, &specimen, Pair { own: controller, fine }, SEED).map_err(environment)?;
    let played = shown.as_ref().map(|run| Motion::of_platform(&platform, run, model.timing.period));
    let mut sections = vec![view::section(model, played.as_ref()), budget];
    sections.extend(motions);
    sections.push(machined);
    sections.push(hysteresis::section(&specimen.legs[0], model.actuator.voltage[0]));
    sections.push(lines);
    sections.push(region::section(compiled, None).map_err(environment)?);
    Ok(sections)
}

fn of_legs(
    compiled: &Compiled,
    [controller, fine]: [&mut Controller; 2],
    name: &str,
    ui: &Ui,
) -> Result<Vec<Section>, Failure> {
    let model = &compiled.model;
    let leg = LegParameters::reference();
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs: [LegParameters; LEGS] = std::array::from_fn(|_| leg.clone());
    let scenario = machine::legs(model, &legs, &leg.noise, SEED, reproduce::legs::SAMPLES);
    let sim = format!("specgen sim {name} -o DIR");
    ui.progress("leg tracking, linear relation, error budget, stability region");
    let adaptation = &model.adaptation;
    let mode = usize::from(adaptation.level_weight > 0.0) + usize::from(adaptation.drift_weight > 0.0);
    select(controller, MODES[mode].1).map_err(environment)?;
    let played = scenario.run(controller, 1.0).map_err(environment)?;
    let mut tracking = legs::section(&scenario, controller, &sim).map_err(environment)?;
    // A law without its weight is the one before it.
    let same = [
        "The spec gives no weights: EWMA and PCC are here the inverse model alone, and no reproduction of the paper's.",
        "The spec gives no drift weight: PCC is here EWMA, and no reproduction of the paper's.",
    ];
    if let Some(text) = same.get(mode) {
        tracking = tracking.text(text);
    }
    let lines = linear::of_legs(&scenario, controller, &model.actuator, &sim).map_err(environment)?;
    let budget = noise::of_legs(&leg, mode, Pair { own: controller, fine }, SEED).map_err(environment)?;
    let region = region::section(compiled, Some(controller)).map_err(environment)?;
    Ok(vec![
        view::section(model, Motion::of_legs(model, &played.tracking).as_ref()),
        budget,
        tracking,
        hysteresis::section(&leg, model.actuator.voltage[0]),
        lines,
        region,
    ])
}

/// The genetic algorithm, or why it was not run: left out, or the spec's mode has nothing to tune.
fn converge(
    compiled: &Compiled,
    controller: &Controller,
    generations: u32,
    name: &str,
    ui: &Ui,
) -> Result<Option<Section>, Failure> {
    let absent =
        |why: &str| Some(Section::new("convergence", "Genetic algorithm", "").text(&format!("Not run: {why}")));
    if generations == 0 {
        return Ok(absent("left out by --generations 0."));
    }
    ui.progress(&format!("the genetic algorithm, {generations} generations"));
    let leg = LegParameters::reference();
    match convergence::run(compiled, controller, &leg, SEED, generations as usize, &|_| {}) {
        Ok(found) => {
            let command = format!("specgen tune {name} --optimiser genetic --evaluations {}", 100 * generations);
            Ok(Some(specgen_report::convergence::section(&found, &command)))
        }
        Err(convergence::ConvergenceError::NothingToTune(why)) => Ok(absent(&format!("{why}."))),
        Err(convergence::ConvergenceError::Run(error)) => Err(environment(error)),
    }
}
