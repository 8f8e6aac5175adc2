//! Tunes gains and weights by simulating the loop with the controller of the spec.

mod evaluate;
mod figures;
mod start;

use std::path::PathBuf;
use std::time::Instant;

use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use host_sim::trajectory::PaperPath;

use specgen_compiler::compile::{self, Compilation};
use specgen_compiler::spec_file;
use specgen_language::diagnostic::{Diagnostic, Place, Severity, codes};
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::output::{check_edit, claim, edit_file};
use specgen_language::spec::SpecSource;
use specgen_language::ui::Ui;
use specgen_numerics::Cma;
use specgen_studies::controllers::{at_run_time, threads};
use specgen_studies::machine::{PlantOptions, run_failure};
use specgen_studies::tuning::feasible::{Feasibility, RequiredMargins};
use specgen_studies::tuning::genetic::{Genetic, Settings};
use specgen_studies::tuning::search::Progress;
use specgen_studies::tuning::space::GivenBounds;
use specgen_studies::tuning::{
    Candidate, Case, Conditions, Optimiser, Score, Search, SearchOptions, Setting, Space, TrajectoryChoice,
    TunedNumbers, front, write,
};

use crate::drawing::{self, Plot};

/// Options of `tune`.
#[derive(Debug)]
pub struct Options {
    /// The spec file.
    pub spec: PathBuf,
    /// Parameters to tune.
    pub what: TunedNumbers,
    /// Use the genetic algorithm instead of CMA-ES.
    pub genetic: bool,
    /// Run the other algorithm as well.
    pub compare: bool,
    /// Total number of candidates.
    pub evaluations: Option<u32>,
    /// Candidates per generation.
    pub population: Option<u32>,
    /// Name of the trajectory: multisine, zigzag, leg, case-1, case-2 or machining.
    pub trajectory: String,
    /// Highest frequency of a multisine, or frequency of the paper's trajectory, Hz.
    pub frequency: f64,
    /// Length of a multisine, s.
    pub seconds: f64,
    /// Factor on gains and bandwidths for which a candidate must be stable.
    pub gain_margin: f64,
    /// Additional delay for which a candidate must be stable, ticks.
    pub delay_margin: f64,
    /// Bounds of parameters, by group.
    pub bounds: Vec<GivenBounds>,
    /// Delay of the voltages in control intervals.
    pub latency: u32,
    /// Worker threads.
    pub threads: Option<u32>,
    /// File of candidates to score, without a search.
    pub evaluate: Option<PathBuf>,
    /// Folder for front, history, report and picture.
    pub output: Option<PathBuf>,
    /// Write the result into the spec.
    pub write: bool,
    /// Plot of the front.
    pub plot: Plot,
    /// The machine.
    pub plant: PlantOptions,
}

/// Inputs of tuning.
struct Job<'a> {
    options: &'a Options,
    compiled: Compilation,
    controller: Controller,
    leg: LegParameters,
    space: Space,
    feasibility: Feasibility,
    threads: usize,
}

/// Tunes a spec, writes the requested files and shows the result.
///
/// # Errors
/// The options do not fit the spec, no start meets the margins, a run fails, or a file cannot be written.
pub fn run(options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let leg = options.plant.leg()?;
    let compiled = spec_file::compiled(&options.spec, ui)?;
    check(options, &compiled)?;
    let space = Space::of(&compiled, options.what, &options.bounds).map_err(|found| refused(&compiled, found))?;
    let asked = options.evaluate.as_deref().map(|file| evaluate::read(file, &space)).transpose()?;
    let required = RequiredMargins { gain: options.gain_margin, delay: options.delay_margin };
    let feasibility = Feasibility::of(&compiled, required);
    let threads = threads(options.threads);
    let _claimed = options.output.as_deref().map(claim).transpose()?;
    options.plot.wanted()?;
    if options.write {
        check_edit(&options.spec)?;
    }
    let controller = at_run_time(&compiled, ui)?;
    let job = Job { options, compiled, controller, leg, space, feasibility, threads };
    match asked {
        Some(asked) => evaluate::run(&job, &asked, ui),
        None => job.run(ui),
    }
}

/// Refuses options that do not fit the kind of spec.
fn check(options: &Options, compiled: &Compilation) -> Result<(), Failure> {
    let platform = compiled.model.task_space.is_some();
    let fits = match options.trajectory.as_str() {
        "multisine" | "zigzag" => true,
        "leg" => !platform,
        _ => platform,
    };
    if !fits {
        return Err(Failure::Usage(
            "--trajectory leg needs six legs with their own gauges; case-1, case-2 and machining need a spec with [control]"
                .to_owned(),
        ));
    }
    if options.latency != 0 && !platform {
        return Err(Failure::Usage("--latency needs a spec with [control]".to_owned()));
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

        // Compile the patched spec: a result that is refused must not be written.
        let note = format!("Tuned by specgen tune, seed {}.", self.options.plant.seed);
        let source = &self.compiled.source;
        let text = write::edited(&self.compiled, &self.space, &best.setting, &note).map_err(Failure::Gate)?;
        let edited = SpecSource { text: text.clone(), ..source.clone() };
        let tuned = compile::compile_source(edited).map_err(|refusal| self.not_compiled(&refusal))?;
        let patch = write::patch(&source.display_name, &source.text, &text);

        ui.progress("scoring on a machine and trajectory not used for tuning");
        let mut rows = starts.rows();
        rows.push(("tuned", best.setting));
        let other = self.case(&own, &self.scored_on())?;
        let mut report = figures::Report::of(self, &case, &other, &rows, &starts, &searches, &tuned, &patch)?;
        let all: Vec<Candidate> = searches.iter().flat_map(|(_, search)| search.scored.clone()).collect();
        let marks: Vec<(&str, Score)> = report.marks();
        let title = format!("{}: {} candidates, front of error against effort", self.compiled.ir.name, all.len());
        if let Some(line) = self.options.plot.write(&title, || self.front(&title, &all, &marks))? {
            ui.progress(line.trim_end());
        }
        if let Some(folder) = &self.options.output {
            let files = self.files(&searches, &all, self.front(&title, &all, &marks), &report);
            drawing::write(folder, &files, ui)?;
        }
        // The spec may have been edited since it was read.
        let edited =
            self.options.write && SpecSource::read(&self.options.spec).map_or(true, |now| now.text != source.text);
        let written = self.options.write && !edited;
        if written {
            edit_file(&self.options.spec, text.as_bytes())?;
            ui.progress(&format!("wrote the result into {}", self.options.spec.display()));
        }
        ui.progress(&format!("{:.1} s in total", begun.elapsed().as_secs_f64()));
        report.with_patch = !written;
        if edited {
            let spec = self.options.spec.display();
            let message = format!(
                "`{spec}` was changed during tuning, so nothing was written into it. Apply the patch, or tune again"
            );
            return ui.judged(&report, Some(message));
        }
        if found.is_some() {
            let done: usize = searches.iter().map(|(_, search)| search.evaluations).sum();
            let message = format!("interrupted: this is the best of only {done} candidates");
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
            noise: (!self.options.plant.no_noise).then_some(seed),
            machine: Some(seed),
            latency: self.options.latency as usize,
            whole_ticks,
        }
    }

    fn trajectories(&self) -> [TrajectoryChoice; 2] {
        let Options { frequency, seconds, plant, .. } = self.options;
        let (frequency, seconds) = (*frequency, *seconds);
        let corners = self.options.trajectory == "zigzag";
        let sines = TrajectoryChoice::Multisine { frequency, seconds, seed: plant.seed, corners };
        let paper = |path| TrajectoryChoice::Paper { path, frequency };
        match self.options.trajectory.as_str() {
            "multisine" | "zigzag" => [sines, paper(PaperPath::Case1)],
            "leg" | "case-1" => [paper(PaperPath::Case1), sines],
            "case-2" => [paper(PaperPath::Case2), paper(PaperPath::Case1)],
            _ => [paper(PaperPath::Machining), paper(PaperPath::Case1)],
        }
    }

    /// Conditions used for tuning.
    fn tuned_on(&self) -> Conditions {
        self.conditions(self.trajectories()[0], self.options.plant.seed, true)
    }

    /// Conditions not used for tuning: another trajectory, machine and noise, in the time steps of `specgen sim`.
    fn scored_on(&self) -> Conditions {
        self.conditions(self.trajectories()[1], self.options.plant.seed.wrapping_add(1), false)
    }

    fn evaluations(&self) -> usize {
        let usual = if self.compiled.model.task_space.is_some() { 5000 } else { 1000 };
        self.options.evaluations.map_or(usual, |given| given as usize)
    }

    fn search(&self, case: &Case, starts: &start::Starts, ui: &Ui) -> Result<Vec<(&'static str, Search)>, Failure> {
        let genetic = |population: Option<u32>| -> Box<dyn Optimiser> {
            let population = population.map_or(Settings::PAPER.population, |given| given as usize);
            let settings = Settings { population, ..Settings::PAPER };
            let genes: Vec<Vec<f64>> = starts.feasible().map(|setting| self.space.genes(setting)).collect();
            Box::new(Genetic::new(settings, self.space.dimension(), &genes, self.options.plant.seed))
        };
        let cma = |population: Option<u32>| -> Box<dyn Optimiser> {
            let population = population.map_or(20, |given| given as usize);
            Box::new(Cma::new(&self.space.genes(&starts.best), population, self.options.plant.seed))
        };
        let given = self.options.population;
        let mut optimisers: Vec<(&'static str, Box<dyn Optimiser>)> = match self.options.genetic {
            false => vec![("cma", cma(given))],
            true => vec![("genetic", genetic(given))],
        };
        if self.options.compare {
            optimisers.push(if self.options.genetic { ("cma", cma(None)) } else { ("genetic", genetic(None)) });
        }
        let mut searches = Vec::new();
        for (name, mut optimiser) in optimisers {
            let progress = |at: &Progress| ui.rate(&line(name, at));
            let options = SearchOptions {
                evaluations: self.evaluations(),
                threads: self.threads,
                // When interrupted, the best candidate so far is the result.
                stop: interrupt::heed(),
                progress: &progress,
            };
            let search = Search::run(optimiser.as_mut(), &self.space, &self.feasibility, case, &options);
            ui.rate_done();
            searches.push((name, search.map_err(run_failure)?));
        }
        Ok(searches)
    }

    /// The best candidate, starts included; and whether a search was interrupted.
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
                format!("the spec with the tuned parameters is refused: {}", why.join("; ")),
                "require larger margins (--gain-margin, --delay-margin); the spec is unchanged",
            )],
        )
    }

    /// Picture of the front.
    fn front(&self, title: &str, all: &[Candidate], marks: &[(&str, Score)]) -> String {
        let axes = if self.compiled.model.task_space.is_some() {
            ["effort: motion requested by feedback", "pose error, angles at the joints' radius"]
        } else {
            ["effort: change of the estimates per tick", "leg error"]
        };
        crate::front::svg(title, axes, all, &front::front(all), marks)
    }

    fn files(
        &self,
        searches: &[(&'static str, Search)],
        all: &[Candidate],
        drawn: String,
        report: &figures::Report,
    ) -> Vec<(String, Vec<u8>)> {
        let best = front::front(all);
        let mut files = vec![
            ("front.csv".to_owned(), front::to_csv(&best, &self.space).into_bytes()),
            ("front.svg".to_owned(), drawn.into_bytes()),
            drawing::json("front.json", &best),
            drawing::json("report.json", report),
        ];
        for (name, search) in searches {
            files.push((format!("history-{name}.csv"), front::history_csv(&search.history).into_bytes()));
        }
        files
    }
}

fn line(name: &str, at: &Progress) -> String {
    let best = at.best.map_or_else(|| "none yet".to_owned(), |cost| format!("{cost:.5} µm s²"));
    let (done, all, speed, left) = (at.done, at.all, at.speed, at.left.as_secs_f64());
    format!("{name}: {done} of {all}, best cost {best}, {speed:.0} × real time, {left:.0} s left")
}
