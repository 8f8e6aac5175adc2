//! `specgen tune`: gains and weights from the simulated loop with the controller of the spec.

mod evaluate;
mod report;
mod start;

use std::time::Instant;

use clap::{Args, ValueEnum};
use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use host_sim::trajectory::PaperPath;
use serde_json::json;

use super::named::{InputFile, OutputFolder};
use super::plot::Plot;
use super::sim::{PlantArguments, at_run_time, frequency};
use super::spec;
use specgen_compiler::compile::{self, Compilation};
use specgen_language::diagnostic::{Diagnostic, Place, Severity, codes};
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::outcome::Refusal;
use specgen_language::output::{check_edit, claim, edit_file, write_folder};
use specgen_language::spec::SpecSource;
use specgen_language::ui::Ui;
use specgen_studies::machine::run_failure;
use specgen_studies::tuning::cma::Cma;
use specgen_studies::tuning::feasible::{Feasibility, RequiredMargins};
use specgen_studies::tuning::genetic::{Genetic, Settings};
use specgen_studies::tuning::search::Progress;
use specgen_studies::tuning::space::GivenBounds;
use specgen_studies::tuning::{
    Candidate, Case, Conditions, Optimiser, Score, Search, SearchOptions, Setting, Space, TrajectoryChoice,
    TunedNumbers, front, write,
};

/// Arguments of `tune`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::TUNE)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// What is tuned: as far as the spec's mode uses it.
    #[arg(long, value_enum, default_value = "all")]
    what: WhatArgument,
    /// How it is searched for.
    #[arg(long, value_enum, default_value = "cma")]
    optimiser: OptimiserArgument,
    /// Run the genetic algorithm as well, on as many candidates, and keep the better result.
    #[arg(long)]
    compare: bool,
    /// Candidates in all; 5000 for a platform (50 generations of 100), 1000 for legs if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    evaluations: Option<u32>,
    /// Candidates of a generation; 100 (Table 3) for the genetic algorithm, 20 for CMA-ES if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(4..=100_000))]
    population: Option<u32>,
    /// What is followed while tuning. The result is scored on another: case 1 or the leg's, or the multisine for these.
    #[arg(long, value_enum, default_value = "multisine")]
    trajectory: TrajectoryArgument,
    /// Highest frequency of the multisine, or operating frequency of the paper's trajectory, Hz.
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = frequency, allow_negative_numbers = true)]
    frequency: f64,
    /// Length of the multisine, s.
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Factor on all gains and bandwidths at which a candidate must still be stable.
    #[arg(long, default_value = "2", value_parser = at_least_one, allow_negative_numbers = true)]
    gain_margin: f64,
    /// Ticks of further delay at which it must still be stable; for a spec with [control].
    #[arg(long, default_value = "0.5", value_parser = ticks, allow_negative_numbers = true)]
    delay_margin: f64,
    /// Bounds of a group of numbers, such as `ki=10:1000`: kp and kv over the stiffness of the axis, ki likewise in 1/s;
    /// level and drift in rad/s with [control], as weights without.
    #[arg(long, value_name = "GROUP=LOW:HIGH", value_parser = bounds)]
    bounds: Vec<GivenBounds>,
    /// Control intervals by which voltages reach the amplifiers late; with [control].
    #[arg(long, default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=100))]
    latency: u32,
    /// Worker threads; as many as the machine has if not given. The result does not depend on it.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Search nothing: score the candidates of this file, for a search of your own. A JSON array of objects with numbers by the
    /// names of parameters, in the unit of --bounds; one that is left out stays as in the spec. `[]` shows names and bounds.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["optimiser", "compare", "evaluations", "population", "output", "write", "plot"])]
    evaluate: Option<InputFile>,
    /// Write front, history, report and plot here.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Write the result into the spec; without it the change is printed as a patch.
    #[arg(long)]
    write: bool,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum WhatArgument {
    Gains,
    Weights,
    All,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum OptimiserArgument {
    /// CMA-ES.
    Cma,
    /// The paper's genetic algorithm, Table 3.
    Genetic,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum TrajectoryArgument {
    /// Smooth.
    Multisine,
    /// The multisine with a zigzag in place of its fastest sine: corners, where the platform rings.
    Zigzag,
    Leg,
    #[value(name = "case-1")]
    Case1,
    #[value(name = "case-2")]
    Case2,
    Machining,
}

fn number(text: &str, what: &str, good: impl Fn(f64) -> bool) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|value| good(*value));
    value.ok_or_else(|| format!("expected {what}, found `{text}`"))
}

fn seconds(text: &str) -> Result<f64, String> {
    number(text, "a time from 0.01 to 1000 s", |s| (0.01..=1000.0).contains(&s))
}

fn at_least_one(text: &str) -> Result<f64, String> {
    number(text, "a factor from 1 to 20", |x| (1.0..=20.0).contains(&x))
}

fn ticks(text: &str) -> Result<f64, String> {
    number(text, "a number of ticks from 0 to 5", |x| (0.0..=5.0).contains(&x))
}

fn bounds(text: &str) -> Result<GivenBounds, String> {
    let parsed = text.split_once('=').and_then(|(group, range)| {
        let (low, high) = range.split_once(':')?;
        Some(GivenBounds {
            group: group.trim().to_owned(),
            bounds: [low.trim().parse().ok()?, high.trim().parse().ok()?],
        })
    });
    parsed.ok_or_else(|| format!("expected GROUP=LOW:HIGH such as ki=10:1000, found `{text}`"))
}

/// Everything that tuning works on.
struct Job<'a> {
    arguments: &'a Arguments,
    compiled: Compilation,
    controller: Controller,
    leg: LegParameters,
    space: Space,
    feasibility: Feasibility,
    threads: usize,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let leg = arguments.plant.leg()?;
    let compiled = spec::compiled(&arguments.spec, ui)?;
    check(arguments, &compiled)?;
    let what = match arguments.what {
        WhatArgument::Gains => TunedNumbers::Gains,
        WhatArgument::Weights => TunedNumbers::Weights,
        WhatArgument::All => TunedNumbers::All,
    };
    let space = Space::of(&compiled, what, &arguments.bounds).map_err(|found| refused(&compiled, found))?;
    let asked = arguments.evaluate.as_deref().map(|file| evaluate::read(file, &space)).transpose()?;
    let required = RequiredMargins { gain: arguments.gain_margin, delay: arguments.delay_margin };
    let feasibility = Feasibility::of(&compiled, required);
    let threads = arguments.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let _claimed = arguments.output.as_deref().map(claim).transpose()?;
    arguments.plot.wanted()?;
    if arguments.write {
        check_edit(&arguments.spec)?;
    }
    let controller = at_run_time(&compiled, ui)?;
    let job = Job { arguments, compiled, controller, leg, space, feasibility, threads };
    match asked {
        Some(asked) => evaluate::run(&job, &asked, ui),
        None => job.run(ui),
    }
}

/// Arguments that do not go with the kind of the spec.
fn check(arguments: &Arguments, compiled: &Compilation) -> Result<(), Failure> {
    let platform = compiled.model.task_space.is_some();
    let fits = match arguments.trajectory {
        TrajectoryArgument::Multisine | TrajectoryArgument::Zigzag => true,
        TrajectoryArgument::Leg => !platform,
        TrajectoryArgument::Case1 | TrajectoryArgument::Case2 | TrajectoryArgument::Machining => platform,
    };
    if !fits {
        return Err(Failure::Usage(
            "--trajectory leg is for six legs with their own gauges, case-1, case-2 and machining for a spec with [control]"
                .to_owned(),
        ));
    }
    if arguments.latency != 0 && !platform {
        return Err(Failure::Usage("--latency is for a spec with [control]".to_owned()));
    }
    Ok(())
}

fn refused(compiled: &Compilation, findings: Vec<Diagnostic>) -> Failure {
    Failure::from(Refusal { source: Some(compiled.source.clone()), findings })
}

impl Job<'_> {
    fn run(&self, ui: &mut Ui) -> Result<(), Failure> {
        let begun = Instant::now();
        ui.progress("preparing the machine: pre-cycle, settling, arming");
        let own = Setting::of(&self.compiled);
        let case = self.case(&own, &self.tuned_on())?;
        let starts = start::starts(self, &case, own, ui)?;
        let searches = self.search(&case, &starts, ui)?;
        let (best, found) = self.best(&searches, &starts);

        // The patch is what compiles; a result that does not is refused before anything is written.
        let note = format!("Tuned by specgen tune, seed {}.", self.arguments.plant.seed);
        let source = &self.compiled.source;
        let text = write::edited(&self.compiled, &self.space, &best.setting, &note).map_err(Failure::Gate)?;
        let edited = SpecSource { text: text.clone(), ..source.clone() };
        let tuned = compile::compile_source(edited).map_err(|refusal| self.not_compiled(&refusal))?;
        let patch = write::patch(&source.display_name, &source.text, &text);

        ui.progress("scoring on what it was not tuned on");
        let mut rows = starts.rows();
        rows.push(("tuned", best.setting));
        let other = self.case(&own, &self.scored_on())?;
        let mut report = report::Report::of(self, &case, &other, &rows, &starts, &searches, &tuned, &patch)?;
        let all: Vec<Candidate> = searches.iter().flat_map(|(_, search)| search.scored.clone()).collect();
        let marks: Vec<(&str, Score)> = report.marks();
        let title = format!("{}: {} candidates, front of error against effort", self.compiled.ir.name, all.len());
        if let Some(line) = self.arguments.plot.write(&title, || self.front(&title, &all, &marks))? {
            ui.progress(line.trim_end());
        }
        if let Some(folder) = &self.arguments.output {
            let files = self.files(&searches, &all, self.front(&title, &all, &marks), &json!(report));
            write_folder(folder, &files)?;
            ui.progress(&format!("wrote {} files to {}", files.len(), folder.display()));
        }
        // It may have been edited in the minutes since it was read.
        let edited =
            self.arguments.write && SpecSource::read(&self.arguments.spec).map_or(true, |now| now.text != source.text);
        let written = self.arguments.write && !edited;
        if written {
            edit_file(&self.arguments.spec, text.as_bytes())?;
            ui.progress(&format!("wrote the result into {}", self.arguments.spec.display()));
        }
        ui.progress(&format!("{:.1} s in all", begun.elapsed().as_secs_f64()));
        report.with_patch = !written;
        if edited {
            let spec = self.arguments.spec.display();
            let message = format!(
                "`{spec}` was changed while it was tuned: nothing was written into it. Apply the patch, or tune again"
            );
            return ui.judged(&report, Some(message));
        }
        if found.is_some() {
            let done: usize = searches.iter().map(|(_, search)| search.evaluations).sum();
            let message = format!("interrupted: this is the best of {done} candidates, not of all that were asked for");
            return Err(Failure::Interrupted { message, result: ui.shown(&report) });
        }
        ui.result(&report);
        Ok(())
    }

    fn case(&self, start: &Setting, conditions: &Conditions) -> Result<Case, Failure> {
        Case::new(&self.compiled, &self.controller, &self.leg, start, conditions).map_err(run_failure)
    }

    fn conditions(&self, trajectory: TrajectoryChoice, seed: u64, whole_ticks: bool) -> Conditions {
        Conditions {
            trajectory,
            noise: (!self.arguments.plant.no_noise).then_some(seed),
            machine: Some(seed),
            latency: self.arguments.latency as usize,
            whole_ticks,
        }
    }

    fn trajectories(&self) -> [TrajectoryChoice; 2] {
        let Arguments { frequency, seconds, plant, .. } = self.arguments;
        let (frequency, seconds) = (*frequency, *seconds);
        let corners = self.arguments.trajectory == TrajectoryArgument::Zigzag;
        let sines = TrajectoryChoice::Multisine { frequency, seconds, seed: plant.seed, corners };
        let paper = |path| TrajectoryChoice::Paper { path, frequency };
        match self.arguments.trajectory {
            TrajectoryArgument::Multisine | TrajectoryArgument::Zigzag => [sines, paper(PaperPath::Case1)],
            TrajectoryArgument::Leg | TrajectoryArgument::Case1 => [paper(PaperPath::Case1), sines],
            TrajectoryArgument::Case2 => [paper(PaperPath::Case2), paper(PaperPath::Case1)],
            TrajectoryArgument::Machining => [paper(PaperPath::Machining), paper(PaperPath::Case1)],
        }
    }

    /// What candidates are run on.
    fn tuned_on(&self) -> Conditions {
        self.conditions(self.trajectories()[0], self.arguments.plant.seed, true)
    }

    /// Another trajectory, another machine and other noise, in the steps of `specgen sim`.
    fn scored_on(&self) -> Conditions {
        self.conditions(self.trajectories()[1], self.arguments.plant.seed.wrapping_add(1), false)
    }

    fn evaluations(&self) -> usize {
        let usual = if self.compiled.model.task_space.is_some() { 5000 } else { 1000 };
        self.arguments.evaluations.map_or(usual, |given| given as usize)
    }

    fn search(&self, case: &Case, starts: &start::Starts, ui: &Ui) -> Result<Vec<(&'static str, Search)>, Failure> {
        let genetic = |population: Option<u32>| -> Box<dyn Optimiser> {
            let population = population.map_or(Settings::PAPER.population, |given| given as usize);
            let settings = Settings { population, ..Settings::PAPER };
            let genes: Vec<Vec<f64>> = starts.feasible().map(|setting| self.space.genes(setting)).collect();
            Box::new(Genetic::new(settings, self.space.dimension(), &genes, self.arguments.plant.seed))
        };
        let cma = |population: Option<u32>| -> Box<dyn Optimiser> {
            let population = population.map_or(20, |given| given as usize);
            Box::new(Cma::new(&self.space.genes(&starts.best), population, self.arguments.plant.seed))
        };
        let given = self.arguments.population;
        let mut optimisers: Vec<(&'static str, Box<dyn Optimiser>)> = match self.arguments.optimiser {
            OptimiserArgument::Cma => vec![("cma", cma(given))],
            OptimiserArgument::Genetic => vec![("genetic", genetic(given))],
        };
        if self.arguments.compare {
            optimisers.push(if self.arguments.optimiser == OptimiserArgument::Cma {
                ("genetic", genetic(None))
            } else {
                ("cma", cma(None))
            });
        }
        let mut searches = Vec::new();
        for (name, mut optimiser) in optimisers {
            let progress = |at: &Progress| ui.rate(&line(name, at));
            let options = SearchOptions {
                evaluations: self.evaluations(),
                threads: self.threads,
                // The best so far is a result.
                stop: interrupt::heed(),
                progress: &progress,
            };
            let search = Search::run(optimiser.as_mut(), &self.space, &self.feasibility, case, &options);
            ui.rate_done();
            searches.push((name, search.map_err(run_failure)?));
        }
        Ok(searches)
    }

    /// The best of all, starts included; and whether a search was ended early.
    fn best(&self, searches: &[(&'static str, Search)], starts: &start::Starts) -> (Candidate, Option<()>) {
        let mut best = Candidate { number: 0, setting: starts.best, score: starts.score };
        let mut interrupted = None;
        for (_, search) in searches {
            if let Some(candidate) = search.best().filter(|candidate| candidate.score.cost < best.score.cost) {
                best = *candidate;
            }
            if search.interrupted {
                interrupted = Some(());
            }
        }
        (best, interrupted)
    }

    fn not_compiled(&self, refusal: &Refusal) -> Failure {
        let errors = refusal.findings.iter().filter(|finding| finding.severity == Severity::Error);
        let why: Vec<String> = errors.map(|finding| format!("{}: {}", finding.code, finding.message)).collect();
        refused(
            &self.compiled,
            vec![Diagnostic::new(
                codes::TUNE_REFUSED,
                "",
                Place::Whole,
                format!("the spec with the tuned numbers is refused: {}", why.join("; ")),
                "ask for larger margins (--gain-margin, --delay-margin); the spec is as it was",
            )],
        )
    }

    /// The front as a picture.
    fn front(&self, title: &str, all: &[Candidate], marks: &[(&str, Score)]) -> String {
        let axes = if self.compiled.model.task_space.is_some() {
            ["effort: motion asked for by feedback", "pose error, angles at the joints' radius"]
        } else {
            ["effort: change of the estimates per tick", "leg error"]
        };
        specgen_report::front::svg(title, axes, all, &front::front(all), marks)
    }

    fn files(
        &self,
        searches: &[(&'static str, Search)],
        all: &[Candidate],
        drawn: String,
        value: &serde_json::Value,
    ) -> Vec<(String, Vec<u8>)> {
        let best = front::front(all);
        let mut files = vec![
            ("front.csv".to_owned(), front::to_csv(&best, &self.space).into_bytes()),
            ("front.svg".to_owned(), drawn.into_bytes()),
            ("front.json".to_owned(), format!("{:#}\n", json!(best)).into_bytes()),
            ("report.json".to_owned(), format!("{value:#}\n").into_bytes()),
        ];
        for (name, search) in searches {
            files.push((format!("history-{name}.csv"), front::history_csv(&search.history).into_bytes()));
        }
        files
    }
}

fn line(name: &str, at: &Progress) -> String {
    let best = at.best.map_or_else(|| "none yet".to_owned(), |cost| format!("{cost:.5} µm s²"));
    format!(
        "{name}: {} of {}, best cost {best}, {:.0} × real time, {:.0} s left",
        at.done,
        at.all,
        at.speed,
        at.left.as_secs_f64()
    )
}
