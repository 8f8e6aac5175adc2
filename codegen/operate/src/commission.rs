//! `specgen commission`: from a wired machine to a verified one, with its own converters and gauges.
//!
//! ```text
//! wiring ─► response ─► cross-talk ─► curves ─► identify ─► spec ─►  build, flash or restart  ─► acceptance
//!     records of `watch` in a folder      │         └ platform.toml                     │
//!                                         └──────────► commission.json, commission.md ◄─┘
//! ```
//! `state` is what is known so far, `plan` the drives, `machine` arms and ramps down, `rows` reads records, `legs` identifies, `spec`
//! edits, `acceptance` measures the new controller by `motions` and `sensitivity`, beside `simulated` ones, `learned` learns, `health`
//! compares later, `page` shows all of it. Every step may be the last: the next run continues.

mod acceptance;
mod findings;
mod health;
mod learned;
pub mod legs;
mod machine;
mod motions;
mod page;
pub mod plan;
mod response;
mod rows;
mod sensitivity;
mod simulated;
mod spec;
mod state;
mod wiring;

use std::fmt::Write as _;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;
use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_identify::assembled::{Drive, Kind, Plan};
use specgen_language::files;
use specgen_language::interrupt;
use specgen_language::model::LegModelKind;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_edit, edit_file, unread_file, write_file};
use specgen_language::ui::Ui;

use crate::commands::SessionError;
use crate::line::Line;
use rows::Rows;
pub use state::Step;
use state::{State, record};

/// Reversal curves of a leg, and frequency of the mains, Hz, if not given.
const GRID: usize = 32;
const MAINS: f64 = 50.0;
/// Duration of a record of the noise at rest, and of its rows, s.
const REST: [f64; 2] = [4.0, 2e-3];
/// Files of these records: amplifiers off, and on.
const RESTS: [&str; 2] = ["rest-off", "rest-on"];
/// Names of the records of the response begin so.
const RESPONSE: &str = "response";

/// What to do.
#[derive(Debug, Clone)]
pub struct Options {
    /// File of the spec.
    pub spec: PathBuf,
    /// Folder of the records and results.
    pub output: PathBuf,
    /// Steps to do; all that are open, if empty.
    pub steps: Vec<Step>,
    /// Do them although they are done.
    pub again: bool,
    /// Steps to skip, each with a reason.
    pub skip: Vec<(Step, String)>,
    /// Reversal curves of a leg.
    pub grid: Option<usize>,
    /// Frequency of the mains, Hz.
    pub mains: Option<f64>,
    /// Family of leg models.
    pub model: LegModelKind,
    /// Name of the machine, for the page.
    pub machine: Option<String>,
    /// Show the plan, and send nothing.
    pub plan: bool,
    /// Do not ask.
    pub yes: bool,
    /// Only compute figures and page again from the records.
    pub report: bool,
    /// Edit the spec in place.
    pub write: bool,
    /// Only measure again what a machine in use may have changed in, and compare.
    pub check: bool,
    /// Learn the trajectories of the spec on the commissioned machine.
    pub learn: bool,
    /// If it is set, no further step begins.
    pub stop: Arc<AtomicBool>,
}

impl Options {
    /// All open steps of a spec in a folder, after a question.
    pub fn new(spec: &Path, output: &Path) -> Self {
        Self {
            spec: spec.to_owned(),
            output: output.to_owned(),
            steps: Vec::new(),
            again: false,
            skip: Vec::new(),
            grid: None,
            mains: None,
            model: LegModelKind::Auto,
            machine: None,
            plan: false,
            yes: false,
            report: false,
            write: false,
            check: false,
            learn: false,
            stop: Arc::default(),
        }
    }
}

/// What a commissioning has done and will do, as its folder says: `steps` with `name`, `date` and `skipped`, all empty while open, and
/// whether the `next` run does it; `seconds` of machine time of that run; `findings`; `missed` figures; whether it needs the `other`
/// controller; whether there is a `page`.
///
/// # Errors
/// As [`run`], before anything moves.
pub fn outlook(options: &Options, compiled: &Compilation, has_line: bool) -> Result<Value, Failure> {
    let mut state = begun(options, new(compiled))?;
    let commissioned = state.written.as_ref() == Some(&compiled.ir.digest);
    let chosen = chosen(&mut state, options, commissioned);
    let plan = plan_of(compiled, &state)?;
    let moves = has_line && chosen.iter().any(|step| step.moves());
    let seconds = if moves { PlanReport::new(&chosen, &plan, &state, options).seconds } else { 0.0 };
    let step = |step: Step| {
        let passed = state.steps.get(&step);
        let skipped = passed.and_then(|passed| passed.skipped.clone());
        let date = passed.map(|passed| passed.date.clone());
        json!({ "name": step.name(), "date": date, "skipped": skipped, "next": chosen.contains(&step) })
    };
    let needs_other = state.written.is_some() && !commissioned && chosen.is_empty();
    Ok(json!({
        "steps": Step::ALL.map(step), "seconds": seconds, "findings": findings::findings(&state),
        "missed": page::missed(&state), "other": needs_other, "page": options.output.join("commission.html").exists(),
    }))
}

/// Commissions the machine at `line`, whose controller is that of `compiled`.
///
/// # Errors
/// The plan is not possible, the records are of another spec, a step fails, Ctrl-C, or a figure misses its limit. The machine is
/// ramped down.
pub fn run(line: Option<Line<'_>>, options: &Options, compiled: &Compilation, ui: &mut Ui) -> Result<(), Failure> {
    let mut state = begun(options, new(compiled))?;
    let commissioned = state.written.as_ref() == Some(&compiled.ir.digest);
    let mut work = Work { line, options, compiled, ui };
    if options.check {
        return work.check(&state);
    }
    if options.report {
        work.evaluate(&mut state)?;
        return work.conclude(&state);
    }
    let steps = chosen(&mut state, options, commissioned);
    let learns = options.learn && (commissioned || steps.contains(&Step::Acceptance));
    if learns {
        learned::check(compiled)?;
    } else if options.learn {
        return Err(Failure::Usage("--learn belongs to acceptance: name the commissioned spec".to_owned()));
    }
    let moves = learns || steps.iter().any(|step| step.moves());
    if moves && !options.plan && line.is_none() {
        return Err(Failure::Usage("name the device with --port or --socket, or give --plan".to_owned()));
    }
    writable(&steps, commissioned, options)?;
    if moves && !work.permitted(&steps, &state)? {
        return Ok(());
    }
    if options.write {
        check_edit(&options.spec)?;
    }
    if options.again {
        work.clear(&steps, &state)?;
    }
    state.write(&options.output)?;
    for step in steps {
        work.step(step, &mut state)?;
        state.pass(step, None);
        work.save(&state)?;
        // Only a run with a machine to ramp down does not end at once.
        if options.stop.load(Ordering::Relaxed) || moves && interrupt::heed().load(Ordering::Relaxed) {
            let message = "interrupted; the same command continues".to_owned();
            return Err(Failure::Interrupted { message, result: Value::Null });
        }
    }
    if let Some(line) = line.filter(|_| learns) {
        let machine = state.machine.as_deref().unwrap_or(&state.name);
        learned::learn(line, &options.spec, compiled, machine, &options.output, work.ui)?;
        state.learned = learned::figures(&options.output, compiled)?;
    }
    work.conclude(&state)
}

/// A state in which nothing is done.
fn new(compiled: &Compilation) -> State {
    State {
        spec: compiled.ir.digest.clone(),
        name: compiled.ir.name.clone(),
        grid: GRID,
        mains: MAINS,
        spec_gain: compiled.model.actuator.leg_gain(),
        ..State::default()
    }
}

/// The state of the folder, or this new one of a spec.
fn begun(options: &Options, new: State) -> Result<State, Failure> {
    let shown = options.output.display();
    let mut state = match State::read(&options.output)? {
        None if options.report => {
            let (grid, mains) = (options.grid.unwrap_or(new.grid), options.mains.unwrap_or(new.mains));
            State { grid, mains, ..new }.of_records(&options.output)
        }
        None => new,
        Some(state) if state.written.as_ref() == Some(&new.spec) => State { replacing: false, ..state },
        Some(_) if options.again && options.steps.is_empty() => new,
        Some(state) if state.spec == new.spec || state.replacing && state.name == new.name => state,
        Some(state) => {
            return Err(Failure::Gate(format!(
                "`{shown}` has records of another spec, of digest {}: name another folder with -o, or start over with --again",
                state.spec
            )));
        }
    };
    let measured = [Step::CrossTalk, Step::Curves].iter().any(|step| state.is_over(*step));
    let differs =
        options.grid.is_some_and(|grid| grid != state.grid) || options.mains.is_some_and(|mains| mains != state.mains);
    if differs && measured && !options.again {
        return Err(Failure::Usage(format!(
            "the records in `{shown}` are of --grid {} --mains {}; give the same, or measure with --again",
            state.grid, state.mains
        )));
    }
    state.grid = options.grid.unwrap_or(state.grid);
    state.mains = options.mains.unwrap_or(state.mains);
    state.machine = options.machine.clone().or(state.machine);
    Ok(state)
}

/// The steps of this run. Without names: all that are open, up to the restart with the new controller, or those after it if the
/// machine is `commissioned`.
fn chosen(state: &mut State, options: &Options, commissioned: bool) -> Vec<Step> {
    for (step, reason) in &options.skip {
        // Without it, the legs of a pair cannot be distinguished.
        if *step == Step::CrossTalk && !state.is_skipped(*step) {
            state.forget(*step);
        }
        state.pass(*step, Some(reason.clone()));
    }
    let named = |step: &Step| match options.steps.is_empty() {
        true => (*step == Step::Acceptance) == commissioned,
        false => options.steps.contains(step),
    };
    let skipped = |step: &Step| options.skip.iter().any(|(other, _)| other == step);
    let all = Step::ALL.into_iter().filter(|step| named(step) && !skipped(step));
    if options.again {
        let all: Vec<Step> = all.collect();
        all.iter().for_each(|step| state.forget(*step));
        return all;
    }
    all.filter(|step| !state.is_over(*step)).collect()
}

/// Refuses, before the machine moves, steps whose results could not be written: the tables of the legs are inputs of the
/// commissioned spec, which is written with them or not at all.
fn writable(steps: &[Step], commissioned: bool, options: &Options) -> Result<(), Failure> {
    let has = |step: Step| steps.contains(&step);
    if !commissioned || !(has(Step::Identify) || has(Step::Spec)) || has(Step::Spec) && options.write {
        return Ok(());
    }
    Err(Failure::Usage(
        "the spec is the commissioned one and names the tables of its legs: give the first spec, or --step identify --step \
         spec --write"
            .to_owned(),
    ))
}

/// The drives of a machine that was not commissioned yet, for reversal curves of `grid` levels and this frequency of the mains, Hz.
///
/// # Errors
/// As [`plan::of`].
pub fn planned(compiled: &Compilation, grid: usize, mains: f64) -> Result<Plan, Failure> {
    plan_of(compiled, &State { grid, mains, ..new(compiled) })
}

/// The drives of a machine, with the first spec's gain of a leg, so that a commissioned machine has the same plan.
fn plan_of(compiled: &Compilation, state: &State) -> Result<Plan, Failure> {
    let pairs = !state.is_skipped(Step::CrossTalk) || compiled.model.actuator.cross_talk.is_some();
    plan::of(compiled, state.spec_gain, state.grid, state.mains, pairs)
}

fn no_line() -> Failure {
    Failure::Usage("name the device with --port or --socket".to_owned())
}

/// What every step needs.
struct Work<'a> {
    line: Option<Line<'a>>,
    options: &'a Options,
    compiled: &'a Compilation,
    ui: &'a mut Ui,
}

impl Work<'_> {
    fn plan(&self, state: &State) -> Result<Plan, Failure> {
        plan_of(self.compiled, state)
    }

    /// Shows what the machine will do and for how long. Returns whether it may begin: the user agrees, or need not be asked.
    fn permitted(&self, steps: &[Step], state: &State) -> Result<bool, Failure> {
        self.agreed(&PlanReport::new(steps, &self.plan(state)?, state, self.options))
    }

    fn agreed(&self, report: &PlanReport) -> Result<bool, Failure> {
        let asks = !self.options.yes && !self.ui.is_json() && io::stdin().is_terminal();
        if self.options.plan || !self.options.yes && !asks {
            self.ui.result(report);
            self.ui.progress("nothing was sent; --yes begins");
            return Ok(false);
        }
        self.ui.progress(report.text().trim_end());
        if !asks {
            return Ok(true);
        }
        self.ui.progress("Begin? Nobody may touch the platform meanwhile. [y/N]");
        let mut answer = String::new();
        io::stdin().read_line(&mut answer).map_err(|error| Failure::Environment(error.to_string()))?;
        Ok(matches!(answer.trim(), "y" | "Y" | "yes"))
    }

    /// Removes the records of steps that are measured again.
    fn clear(&self, steps: &[Step], state: &State) -> Result<(), Failure> {
        if steps.contains(&Step::Response) {
            response::clear(&self.options.output, RESPONSE)?;
        }
        for drive in self.plan(state).iter().flat_map(|plan| &plan.drives) {
            let path = record(&self.options.output, &drive.name);
            if steps.contains(&plan::step_of(drive)) {
                response::remove(&path)?;
            }
        }
        Ok(())
    }

    fn step(&mut self, step: Step, state: &mut State) -> Result<(), Failure> {
        self.ui.progress(&format!("== {}", step.name()));
        let (folder, compiled) = (&self.options.output, self.compiled);
        match step {
            Step::Wiring => {
                let every = libm::ceil(REST[1] / compiled.model.timing.period) as u32;
                self.powered(|machine, ui| {
                    for (at, name) in RESTS.into_iter().enumerate() {
                        if at > 0 {
                            machine::arm(machine, ui)?;
                        }
                        machine.record_rows(
                            (every, u32::MAX),
                            [0.0, REST[0]],
                            &record(folder, name),
                            &mut |_| Ok(()),
                            ui,
                        )?;
                    }
                    Ok(())
                })?;
            }
            Step::Response => {
                let plan = self.plan(state)?;
                self.powered(|machine, ui| {
                    machine::drive(machine, ui)?;
                    response::measure(machine, (compiled, state.spec_gain, &plan), folder, RESPONSE, ui)
                })?;
            }
            Step::CrossTalk | Step::Curves => self.drives(step, &self.plan(state)?)?,
            Step::Identify => self.identify(state, true)?,
            Step::Spec => self.write_spec(state)?,
            Step::Acceptance => {
                self.powered(|machine, ui| acceptance::measure(machine, compiled, state, folder, ui))?;
            }
        }
        if step.moves() {
            self.evaluate_step(step, state)?;
        }
        if step == Step::Wiring {
            let passed = compiled.ir.supervision.wiring.as_ref().map_or("", |_| "the wiring check passed\n");
            self.ui.progress(&format!("{passed}{}", state.wiring.trim_end()));
        }
        Ok(())
    }

    /// The model of each leg, from its records; whether its table is written.
    fn identify(&mut self, state: &mut State, writes: bool) -> Result<(), Failure> {
        let (folder, compiled) = (&self.options.output, self.compiled);
        let plan = self.plan(state)?;
        let known = state.cross_talk.as_ref().map(|found| found.matrix).or(compiled.model.actuator.cross_talk);
        if known.is_none() && plan.drives.iter().any(|drive| drive.legs.len() > 1) {
            return Err(Failure::Gate(
                "legs moved two at a time, and their cross-talk is unknown: add --step cross-talk".to_owned(),
            ));
        }
        let response = state.response.as_ref().map(|response| &response.found);
        let delays = std::array::from_fn(|leg| legs::delay(compiled, response, leg));
        let bench = (&known.unwrap_or_default(), &delays);
        let model = self.options.model;
        let found = self.ui.during("identifying the legs", || legs::models(folder, compiled, &plan, bench, model))?;
        if writes {
            // Until the spec is written again, its tables are others than those of the digest.
            state.replacing |= state.written.as_ref() == Some(&compiled.ir.digest);
            state.write(folder)?;
        }
        state.legs = legs::results((folder, writes), compiled, &plan, found, self.ui)?;
        Ok(())
    }

    /// Drives the legs, except where there is a record.
    fn drives(&self, step: Step, plan: &Plan) -> Result<(), Failure> {
        let folder = &self.options.output;
        let path = |drive: &Drive| record(folder, &drive.name);
        let open = plan::open(plan, &[step], |drive| path(drive).exists());
        if open.is_empty() {
            return Ok(());
        }
        let recorded = |drives: &[&Drive]| drives.iter().filter(|one| one.kind != Kind::Preconditioning).count();
        self.powered(|machine, ui| {
            machine::drive(machine, ui)?;
            for (at, drive) in open.iter().enumerate() {
                let (done, all, name, seconds) =
                    (recorded(&open[..=at]), recorded(&open), &drive.name, drive.seconds());
                if drive.kind != Kind::Preconditioning {
                    ui.progress(&format!("{name} ({done} of {all}), {seconds:.0} s"));
                }
                machine::play(machine, drive, &path(drive), ui)?;
            }
            Ok(())
        })
    }

    fn powered(
        &self,
        work: impl FnOnce(&mut machine::Machine, &Ui) -> Result<(), SessionError>,
    ) -> Result<(), Failure> {
        let line = self.line.ok_or_else(no_line)?;
        machine::with(line, self.compiled, self.ui, |machine| work(machine, self.ui))
    }

    fn write_spec(&self, state: &mut State) -> Result<(), Failure> {
        let Options { output, spec: path, write, .. } = self.options;
        let source = &self.compiled.source;
        if state.legs.is_empty() && state.cross_talk.is_none() && state.response.is_none() {
            return Err(Failure::Gate("nothing was identified that a spec could have".to_owned()));
        }
        if !write && spec::names_files(&source.text) {
            return Err(Failure::Gate(format!(
                "{} names files beside it, which a copy in `{}` would not find: give --write to edit it in place",
                source.display_name,
                output.display()
            )));
        }
        let folder = if *write { spec::from_spec(path, output)? } else { String::new() };
        let dir = if *write { &source.dir } else { output };
        let (text, new) =
            self.ui.during("compiling the commissioned spec", || spec::edited(self.compiled, state, &folder, dir))?;
        if *write && files::text(path).map_err(|unread| unread_file(path, &unread))? != source.text {
            return Err(Failure::Gate(format!(
                "{} was changed meanwhile: repeat with --step spec --write",
                source.display_name
            )));
        }
        state.written = Some(new.ir.digest);
        state.forget(Step::Acceptance);
        if *write {
            state.replacing = true;
            state.write(output)?;
            edit_file(path, text.as_bytes())?;
            state.replacing = false;
            return Ok(());
        }
        state.replacing = false;
        write_file(&output.join("platform.toml"), text.as_bytes())
    }

    /// Figures of a step, from its records.
    fn evaluate_step(&mut self, step: Step, state: &mut State) -> Result<(), Failure> {
        let folder = &self.options.output;
        match step {
            Step::Wiring => {
                let readings = self.compiled.ir.supervision.readings_per_leg.unwrap_or_default();
                let read = |name: &str| Rows::read(&record(folder, name))?.rest(state.mains, &readings);
                state.rest = RESTS.into_iter().map(read).collect::<Result<_, _>>()?;
                state.wiring = wiring::text(self.compiled, &self.plan(state)?, state);
            }
            Step::Response => {
                let date = state.steps.get(&step).map_or_else(state::today, |passed| passed.date.clone());
                let found = self
                    .ui
                    .during("fitting the response", || response::found(folder, RESPONSE, self.compiled, &date))?;
                found.agreement.iter().for_each(|sentence| self.ui.progress(sentence));
                state.response = Some(found);
            }
            Step::CrossTalk => state.cross_talk = Some(legs::cross_talk(folder, &self.plan(state)?)?),
            Step::Acceptance => {
                acceptance::evaluate(folder, self.compiled, state, self.ui)?;
                state.learned = learned::figures(folder, self.compiled)?;
            }
            // The commissioned spec names the tables: a report leaves them as they are.
            Step::Identify if state.legs.is_empty() => self.identify(state, false)?,
            Step::Curves | Step::Identify | Step::Spec => {}
        }
        Ok(())
    }

    /// The same of all steps that were done.
    fn evaluate(&mut self, state: &mut State) -> Result<(), Failure> {
        // Figures of the commissioned controller have its limits.
        let other = state.written.as_ref().is_some_and(|written| *written != self.compiled.ir.digest);
        // The response is compared with the first spec.
        let void = if other { Step::Acceptance } else { Step::Response };
        let done = |step: &Step| {
            state.steps.get(step).is_some_and(|passed| passed.skipped.is_none())
                && !(state.written.is_some() && *step == void)
        };
        let steps: Vec<Step> = Step::ALL.into_iter().filter(done).collect();
        steps.into_iter().try_for_each(|step| self.evaluate_step(step, state))
    }

    fn save(&self, state: &State) -> Result<(), Failure> {
        state.write(&self.options.output)?;
        write_file(&self.options.output.join("commission.md"), page::page(state).as_bytes())
    }

    /// Writes and shows the page.
    fn conclude(&self, state: &State) -> Result<(), Failure> {
        self.save(state)?;
        self.ui.judged(&Report { state, folder: &self.options.output }, page::missed(state))
    }
}

/// What the machine will do.
#[derive(Serialize)]
struct PlanReport {
    steps: Vec<&'static str>,
    /// Of all steps that are named here, s.
    seconds: f64,
    drives: usize,
    /// Legs that fit move together.
    pairs: bool,
    grid: usize,
    mains: f64,
}

impl PlanReport {
    /// Of a check.
    fn check(state: &State) -> Self {
        let seconds = plan::seconds(&[Step::Wiring, Step::Response], &[]);
        let (grid, mains) = (state.grid, state.mains);
        Self { steps: vec![Step::Response.name()], seconds, drives: 0, pairs: false, grid, mains }
    }

    fn new(steps: &[Step], plan: &Plan, state: &State, Options { again, output, .. }: &Options) -> Self {
        let open = plan::open(plan, steps, |drive| !again && record(output, &drive.name).exists());
        let seconds = plan::seconds(steps, &open);
        let drives = open.iter().filter(|drive| drive.kind != Kind::Preconditioning).count();
        let pairs = open.iter().any(|drive| drive.legs.len() > 1);
        let steps = steps.iter().map(|step| step.name()).collect();
        Self { steps, seconds, drives, pairs, grid: state.grid, mains: state.mains }
    }
}

impl Outcome for PlanReport {
    fn text(&self) -> String {
        let Self { steps, seconds, drives, pairs, grid, mains } = self;
        let legs = if *pairs { "one leg or two" } else { "one leg" };
        let mut text = format!("steps {}: about {:.1} min of machine time\n", steps.join(", "), seconds / 60.0);
        if *drives > 0 {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{drives} drives of {legs} at a time, {grid} reversal curves of a leg over actuator.voltage, mains {mains} Hz; the \
                 platform stays within its workspace"
            );
        }
        text
    }
}

/// Everything that is known, and what is left to do.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    state: &'a State,
    #[serde(skip)]
    folder: &'a Path,
}

impl Outcome for Report<'_> {
    fn text(&self) -> String {
        let next = match (&self.state.written, self.state.is_over(Step::Acceptance)) {
            (Some(_), false) => {
                "\nnext: build the commissioned spec and flash the board or restart the program, then repeat this command with that spec\n"
            }
            _ => "",
        };
        format!("{}{next}wrote {}\n", page::page(self.state), self.folder.join("commission.md").display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(folder: &Path) -> Options {
        Options { yes: true, ..Options::new(Path::new("platform.toml"), folder) }
    }

    fn names(steps: &[Step]) -> Vec<&'static str> {
        steps.iter().map(|step| step.name()).collect()
    }

    #[test]
    fn open_steps_are_done_and_named_ones_again() {
        let folder = tempfile::tempdir().unwrap();
        let all = options(folder.path());
        let mut state = State::default();
        let before = ["wiring", "response", "cross-talk", "curves", "identify", "spec"];
        assert_eq!(names(&chosen(&mut state, &all, false)), before);
        assert_eq!(names(&chosen(&mut state, &all, true)), ["acceptance"]);
        [Step::Wiring, Step::Response, Step::Curves].into_iter().for_each(|step| state.pass(step, None));
        let skip = Options { skip: vec![(Step::CrossTalk, "soft joints".to_owned())], ..all.clone() };
        assert_eq!(names(&chosen(&mut state, &skip, false)), ["curves", "identify", "spec"], "without pairs");
        state.pass(Step::Curves, None);
        for options in [&skip, &all] {
            assert_eq!(names(&chosen(&mut state, options, false)), ["identify", "spec"], "it stays skipped");
        }
        state.pass(Step::Identify, None);
        let one = Options { steps: vec![Step::Curves], ..all.clone() };
        assert!(chosen(&mut state, &one, false).is_empty());
        let again = Options { again: true, ..one };
        assert_eq!(names(&chosen(&mut state, &again, false)), ["curves"]);
        assert_eq!(
            names(&chosen(&mut state, &all, false)),
            ["curves", "identify", "spec"],
            "what depends on it is open"
        );
    }

    #[test]
    fn records_of_another_spec_or_grid_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let new = |digest: &str| State { spec: digest.to_owned(), grid: 32, mains: 50.0, ..State::default() };
        let all = options(folder.path());
        let mut state = begun(&all, new("a")).unwrap();
        state.pass(Step::Curves, None);
        state.written = Some("b".to_owned());
        state.write(folder.path()).unwrap();
        for digest in ["a", "b"] {
            assert_eq!(begun(&all, new(digest)).unwrap(), state);
        }
        let why = begun(&all, new("c")).unwrap_err().message();
        assert!(why.contains("has records of another spec, of digest a"), "{why}");
        // Killed while the tables that the spec names were replaced: its digest is another one.
        let killed = State { replacing: true, ..state.clone() };
        killed.write(folder.path()).unwrap();
        assert_eq!(begun(&all, new("c")).unwrap(), killed);
        assert!(begun(&all, State { name: "other".to_owned(), ..new("c") }).is_err());
        state.write(folder.path()).unwrap();
        let again = Options { again: true, ..all.clone() };
        assert_eq!(begun(&again, new("c")).unwrap(), new("c"));
        let finer = Options { grid: Some(64), ..all };
        let why = begun(&finer, new("a")).unwrap_err().message();
        assert!(why.contains("are of --grid 32 --mains 50; give the same, or measure with --again"), "{why}");
        let curves = Options { again: true, steps: vec![Step::Curves], ..finer };
        assert_eq!(begun(&curves, new("a")).unwrap().grid, 64);
    }
}
