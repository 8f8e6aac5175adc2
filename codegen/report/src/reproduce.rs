//! The paper's complete list of experiments, with our results.

use std::path::Path;
use std::time::Instant;

use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::Noise;
use host_sim::platform::table::{MachiningTable, PoseTable};

use crate::drawing::Plot;
use specgen_compiler::compile::{self, Compilation};
use specgen_language::interrupt::Scratch;
use specgen_language::outcome::{Failure, environment};
use specgen_language::output::{claim, write_folder};
use specgen_language::ui::Ui;
use specgen_studies::controllers::at_run_time;
use specgen_studies::machine::{self, run_failure};
use specgen_studies::paper::{convergence, printed};
use specgen_studies::reproduce::table::{Cell, Row, Table};
use specgen_studies::reproduce::write::Results;
use specgen_studies::reproduce::{embedded, legs, platform};

/// Seed of machine, noise and bit strings.
const SEED: u64 = 1;
/// Approximate times of the parts on one machine, s; only their ratios matter, for the remaining time.
const LEGS: f64 = 2.0;
const REGION: f64 = 1.0;
const CASE: f64 = 1.2;
const MACHINING: f64 = 0.5;
const GENERATION: f64 = 1.2;

/// Progress of the parts, one line each.
struct Steps<'a> {
    ui: &'a Ui,
    begun: Instant,
    all: f64,
    done: f64,
    underway: f64,
}

impl Steps<'_> {
    /// Marks the previous part as done and starts one that takes about `weight`.
    fn next(&mut self, what: &str, weight: f64) {
        self.done += self.underway;
        self.underway = weight;
        let elapsed = self.begun.elapsed().as_secs_f64();
        let left = if self.done > 0.0 {
            format!(", about {:.0} s left", elapsed * (self.all - self.done) / self.done)
        } else {
            String::new()
        };
        self.ui.progress(&format!("[{:3.0} %{left}] {what}", 100.0 * self.done / self.all));
    }
}

/// Runs all experiments, writes the tables and shows them.
///
/// # Errors
/// A run fails, or a file cannot be written.
pub fn run(output: &Path, generations: u32, plot: &Plot, ui: &mut Ui) -> Result<(), Failure> {
    // Refuses an unwritable folder before a long run.
    let _claimed = claim(output)?;
    plot.wanted()?;
    let scratch = Scratch::new().map_err(environment)?;
    let specs = [("legs", embedded::LEGS), ("reference", embedded::PLATFORM)];
    let [legs, reference] = specs.map(|(name, text)| {
        let source = embedded::source(name, text, scratch.path()).map_err(environment)?;
        compile::compile_source(source).map_err(Failure::from)
    });
    let (legs, reference) = (legs?, reference?);
    let generations = generations as usize;
    let cases = (platform::CASES.len() * platform::FREQUENCIES.len()) as f64;
    let all = 2.0 * LEGS + REGION + cases * CASE + 2.0 * MACHINING + generations as f64 * GENERATION;
    let mut steps = Steps { ui, begun: Instant::now(), all, done: 0.0, underway: 0.0 };

    let mut tables = section_3(&legs, &mut steps)?;
    let (section_4, controller) = section_4(&reference, &mut steps)?;
    steps.next(&format!("Table 3: the genetic algorithm, {generations} generations"), generations as f64 * GENERATION);
    let convergence = converge(&reference, &controller, generations, ui)?;
    let figure_29 = tables.pop();
    tables.push(table_3());
    tables.extend(section_4);
    tables.extend(figure_29);
    let results =
        Results { digests: [legs.ir.digest.clone(), reference.ir.digest.clone()], seed: SEED, tables, convergence };
    let files = results.files();
    write_folder(output, &files)?;
    let (count, folder, seconds) = (files.len(), output.display(), steps.begun.elapsed().as_secs_f64());
    ui.progress(&format!("wrote {count} files to {folder} after {seconds:.0} s"));
    let chart = crate::paper::convergence::chart(&results.convergence);
    plot.show("Table 3", "the genetic algorithm", &[chart], ui)?;
    ui.result(&results);
    Ok(())
}

/// Tables 1 and 2, and Fig. 29 last.
fn section_3(compiled: &Compilation, steps: &mut Steps) -> Result<Vec<Table>, Failure> {
    let mut controller = at_run_time(compiled, steps.ui)?;
    let scenario = legs::scenario(SEED);
    let actuator = &compiled.model.actuator;
    steps.next("Table 1: linear fits at six frequencies", LEGS);
    let table_1 = legs::table_1(&scenario, &mut controller, actuator.stack_gain * 1e6, actuator.stacks);
    steps.next("Table 2: three laws at three frequencies", LEGS);
    let table_2 = legs::table_2(&scenario, &mut controller);
    steps.next("Fig. 29: the stability region", REGION);
    let figure_29 = legs::figure_29(&mut controller, compiled.model.adaptation.run_interval);
    [table_1, table_2, figure_29].into_iter().map(|table| table.map_err(run_failure)).collect()
}

/// Tables 5 to 9.
fn section_4(compiled: &Compilation, steps: &mut Steps) -> Result<(Vec<Table>, Controller), Failure> {
    let mut controller = at_run_time(compiled, steps.ui)?;
    let scenario = machine_of(compiled)?;
    let mut free = PoseTable::default();
    for case in platform::CASES {
        for frequency in platform::FREQUENCIES {
            steps.next(&format!("Tables 5 to 8: {} at {frequency} Hz", case.0), CASE);
            platform::free_motion(&scenario, &mut controller, case, frequency, &mut free).map_err(run_failure)?;
        }
    }
    let mut machining = MachiningTable::default();
    for part in platform::parts() {
        steps.next(&format!("Table 9: machining {}", part.0), MACHINING);
        platform::machining(&scenario, &mut controller, part, &mut machining).map_err(run_failure)?;
    }
    let mut tables: Vec<Table> = Vec::new();
    for (case, _) in platform::CASES {
        tables.extend(platform::tables(&free, case));
    }
    tables.push(platform::table_9(&machining));
    Ok((tables, controller))
}

/// The machine of the platform's spec with tolerances and noise.
fn machine_of(compiled: &Compilation) -> Result<PlatformScenario, Failure> {
    let Some(task) = &compiled.model.task_space else {
        return Err(Failure::Environment(
            "the embedded platform has no [control]; report this as a specgen bug".to_owned(),
        ));
    };
    let specimen = machine::specimen(&compiled.model, task, &LegParameters::reference(), Some(SEED));
    Ok(machine::scenario(&compiled.model, task, &specimen, &Noise::of(&specimen), SEED))
}

fn converge(
    compiled: &Compilation,
    controller: &Controller,
    generations: usize,
    ui: &Ui,
) -> Result<convergence::Convergence, Failure> {
    let progress = |at: &specgen_studies::tuning::search::Progress| {
        // About ten progress lines without a terminal.
        let tenth = (at.all / 10).max(1);
        if !ui.is_terminal() && !at.done.is_multiple_of(tenth) {
            return;
        }
        ui.rate(&format!("  {} of {} strings, {:.0} s left", at.done, at.all, at.left.as_secs_f64()));
    };
    let leg = LegParameters::reference();
    let found = convergence::run(compiled, controller, &leg, SEED, generations, &progress);
    ui.rate_done();
    found.map_err(environment)
}

fn table_3() -> Table {
    let rows = printed::TABLE_3.iter().map(|[what, paper, ours]| Row {
        case: "genetic algorithm".to_owned(),
        quantity: (*what).to_owned(),
        frequency_hz: None,
        unit: "",
        paper: Cell::Text((*paper).to_owned()),
        ours: Cell::Text((*ours).to_owned()),
        ratio: None,
        remark: None,
        coverage: None,
    });
    Table {
        id: "table-3",
        title: "Table 3: settings and convergence of the genetic algorithm",
        how: "gains and bandwidths of P/F with PCC, cost (9) on a multisine up to 10 Hz for 2 s; margins as for `specgen tune`".to_owned(),
        command: "specgen tune specs/reference.toml --optimiser genetic",
        rows: rows.collect(),
    }
}
