//! `specgen commission`: from a wired machine to a verified one, with its own converters and gauges.
//!
//! ```text
//! wiring ─► cross-talk ─► curves ─► identify ─► spec ─►  build, flash or restart  ─► acceptance
//!     records of `watch` in a folder      │         └ platform.toml                     │
//!                                         └──────────► commission.json, commission.md ◄─┘
//! ```
//! `state` is what is known so far, `plan` the drives, `machine` arms and ramps down, `rows` reads records, `legs` identifies, `spec`
//! edits, `acceptance` measures the new controller, `page` shows all of it. Every step may be the last: the next run continues.

mod acceptance;
mod legs;
mod machine;
mod page;
mod plan;
mod rows;
mod spec;
mod state;
mod wiring;

use std::fmt::Write as _;
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde::Serialize;
use serde_json::Value;
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
pub use plan::of as planned;
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
    if options.report {
        work.evaluate(&mut state)?;
        return work.conclude(&state);
    }
    let steps = chosen(&mut state, options, commissioned);
    let moves = steps.iter().any(|step| step.moves());
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
        if moves && interrupt::heed().load(Ordering::Relaxed) {
            let message = "interrupted; the same command continues".to_owned();
            return Err(Failure::Interrupted { message, result: Value::Null });
        }
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
        None => new,
        Some(state) if state.written.as_ref() == Some(&new.spec) => state,
        Some(_) if options.again && options.steps.is_empty() => new,
        Some(state) if state.spec == new.spec => state,
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

/// What every step needs.
struct Work<'a> {
    line: Option<Line<'a>>,
    options: &'a Options,
    compiled: &'a Compilation,
    ui: &'a mut Ui,
}

impl Work<'_> {
    fn plan(&self, state: &State) -> Result<Plan, Failure> {
        plan::of(self.compiled, state.grid, state.mains)
    }

    /// Shows what the machine will do and for how long. Returns whether it may begin: the user agrees, or need not be asked.
    fn permitted(&self, steps: &[Step], state: &State) -> Result<bool, Failure> {
        let plan = self.plan(state)?;
        let report = PlanReport::new(steps, &plan, state, self.options);
        let asks = !self.options.yes && !self.ui.is_json() && io::stdin().is_terminal();
        if self.options.plan || !self.options.yes && !asks {
            self.ui.result(&report);
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
        for drive in self.plan(state).iter().flat_map(|plan| &plan.drives) {
            let step = if plan::is_cross_talk(drive) { Step::CrossTalk } else { Step::Curves };
            let path = record(&self.options.output, &drive.name);
            if steps.contains(&step) && path.exists() {
                fs::remove_file(&path)
                    .map_err(|error| Failure::Environment(format!("could not remove `{}`: {error}", path.display())))?;
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
            Step::CrossTalk | Step::Curves => self.drives(step, &self.plan(state)?)?,
            Step::Identify => {
                let coupling = state.cross_talk.as_ref().map(|found| found.matrix);
                let coupling = coupling.or(compiled.model.actuator.cross_talk).unwrap_or([[0.0; 6]; 6]);
                let plan = self.plan(state)?;
                state.legs = legs::identify(folder, compiled, &plan, &coupling, self.options.model, self.ui)?;
            }
            Step::Spec => self.write_spec(state)?,
            Step::Acceptance => {
                self.powered(|machine, ui| acceptance::measure(machine, compiled, folder, ui))?;
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

    /// Drives the legs, except where there is a record.
    fn drives(&self, step: Step, plan: &Plan) -> Result<(), Failure> {
        let folder = &self.options.output;
        let path = |name: &str| record(folder, name);
        let all = plan.drives.iter().filter(|drive| plan::is_cross_talk(drive) == (step == Step::CrossTalk));
        let is_open = |kind: Kind, name: &str| kind != Kind::Preconditioning && !path(name).exists();
        let open = all.clone().filter(|drive| is_open(drive.kind, &drive.name)).count();
        if open == 0 {
            return Ok(());
        }
        self.powered(|machine, ui| {
            machine::drive(machine, ui)?;
            let (mut first, mut done) = (None, 0);
            for drive in all {
                if drive.kind == Kind::Preconditioning {
                    first = Some(drive);
                } else if is_open(drive.kind, &drive.name) {
                    done += 1;
                    ui.progress(&format!("{} ({done} of {open}), {:.0} s", drive.name, drive.seconds()));
                    for one in first.take().into_iter().chain([drive]) {
                        machine::play(machine, one, &path(&one.name), ui)?;
                    }
                } else {
                    first = None;
                }
            }
            Ok(())
        })
    }

    fn powered(
        &self,
        work: impl FnOnce(&mut machine::Machine, &Ui) -> Result<(), SessionError>,
    ) -> Result<(), Failure> {
        let line = self.line.ok_or_else(|| Failure::Usage("name the device with --port or --socket".to_owned()))?;
        machine::with(line, self.compiled, self.ui, |machine| work(machine, self.ui))
    }

    fn write_spec(&self, state: &mut State) -> Result<(), Failure> {
        let Options { output, spec: path, write, .. } = self.options;
        let source = &self.compiled.source;
        if state.legs.is_empty() && state.cross_talk.is_none() {
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
        if *write {
            if files::text(path).map_err(|unread| unread_file(path, &unread))? != source.text {
                return Err(Failure::Gate(format!(
                    "{} was changed meanwhile: repeat with --step spec --write",
                    source.display_name
                )));
            }
            edit_file(path, text.as_bytes())?;
        } else {
            write_file(&output.join("platform.toml"), text.as_bytes())?;
        }
        state.written = Some(new.ir.digest);
        state.forget(Step::Acceptance);
        Ok(())
    }

    /// Figures of a step, from its records.
    fn evaluate_step(&self, step: Step, state: &mut State) -> Result<(), Failure> {
        let folder = &self.options.output;
        match step {
            Step::Wiring => {
                let readings = self.compiled.ir.supervision.readings_per_leg.unwrap_or_default();
                let read = |name: &str| Rows::read(&record(folder, name))?.rest(state.mains, &readings);
                state.rest = RESTS.into_iter().map(read).collect::<Result<_, _>>()?;
                state.wiring = wiring::text(self.compiled, &self.plan(state)?, state);
            }
            Step::CrossTalk => state.cross_talk = Some(legs::cross_talk(folder, &self.plan(state)?)?),
            Step::Acceptance => state.acceptance = acceptance::figures(folder, self.compiled)?,
            Step::Curves | Step::Identify | Step::Spec => {}
        }
        Ok(())
    }

    /// The same of all steps that were done.
    fn evaluate(&self, state: &mut State) -> Result<(), Failure> {
        // Figures of the commissioned controller have its limits.
        let other = state.written.as_ref().is_some_and(|written| *written != self.compiled.ir.digest);
        let done = |step: &Step| {
            state.steps.get(step).is_some_and(|passed| passed.skipped.is_none())
                && !(other && *step == Step::Acceptance)
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
    grid: usize,
    mains: f64,
}

impl PlanReport {
    fn new(steps: &[Step], plan: &Plan, state: &State, Options { again, output, .. }: &Options) -> Self {
        let step = |drive: &Drive| if plan::is_cross_talk(drive) { Step::CrossTalk } else { Step::Curves };
        let is_kept = |drive: &Drive| !again && record(output, &drive.name).exists();
        let is_open = |drive: &&Drive| steps.contains(&step(drive)) && !is_kept(drive);
        let drives: Vec<_> = plan.drives.iter().filter(is_open).collect();
        let seconds = plan::seconds(&drives);
        let steps = steps.iter().map(|step| step.name()).collect();
        Self { steps, seconds, drives: drives.len(), grid: state.grid, mains: state.mains }
    }
}

impl Outcome for PlanReport {
    fn text(&self) -> String {
        let Self { steps, seconds, drives, grid, mains } = self;
        let mut text = format!("steps {}: about {:.1} min of machine time\n", steps.join(", "), seconds / 60.0);
        if *drives > 0 {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{drives} drives of one leg at a time, {grid} reversal curves of a leg over actuator.voltage, mains {mains} Hz; the \
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
        Options {
            spec: "platform.toml".into(),
            output: folder.to_owned(),
            steps: Vec::new(),
            again: false,
            skip: Vec::new(),
            grid: None,
            mains: None,
            model: LegModelKind::Auto,
            machine: None,
            plan: false,
            yes: true,
            report: false,
            write: false,
        }
    }

    fn names(steps: &[Step]) -> Vec<&'static str> {
        steps.iter().map(|step| step.name()).collect()
    }

    #[test]
    fn open_steps_are_done_and_named_ones_again() {
        let folder = tempfile::tempdir().unwrap();
        let all = options(folder.path());
        let mut state = State::default();
        let before = ["wiring", "cross-talk", "curves", "identify", "spec"];
        assert_eq!(names(&chosen(&mut state, &all, false)), before);
        assert_eq!(names(&chosen(&mut state, &all, true)), ["acceptance"]);
        state.pass(Step::Wiring, None);
        state.pass(Step::Curves, None);
        let skip = Options { skip: vec![(Step::CrossTalk, "soft joints".to_owned())], ..all.clone() };
        assert_eq!(names(&chosen(&mut state, &skip, false)), ["identify", "spec"]);
        assert_eq!(names(&chosen(&mut state, &all, false)), ["identify", "spec"], "it stays skipped");
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
        let again = Options { again: true, ..all.clone() };
        assert_eq!(begun(&again, new("c")).unwrap(), new("c"));
        let finer = Options { grid: Some(64), ..all };
        let why = begun(&finer, new("a")).unwrap_err().message();
        assert!(why.contains("are of --grid 32 --mains 50; give the same, or measure with --again"), "{why}");
        let curves = Options { again: true, steps: vec![Step::Curves], ..finer };
        assert_eq!(begun(&curves, new("a")).unwrap().grid, 64);
    }
}
