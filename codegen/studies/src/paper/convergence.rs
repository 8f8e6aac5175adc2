//! The genetic algorithm with the settings of Table 3 on the emitted controller: convergence of the cost (9).

use std::num::NonZero;
use std::sync::atomic::AtomicBool;

use host_sim::closed_loop::RunError;
use host_sim::controller::Controller;
use host_sim::plant::LegParameters;
use serde::Serialize;

use crate::tuning::feasible::{Feasibility, RequiredMargins};
use crate::tuning::genetic::{Genetic, Settings};
use crate::tuning::search::{Generation, Progress};
use crate::tuning::{
    Candidate, Case, Conditions, Search, SearchOptions, Setting, Space, TrajectoryChoice, TunedNumbers,
};
use specgen_compiler::compile::Compilation;

/// As in `specgen tune`: required margins, and highest frequency (Hz) and length (s) of the multisine.
const REQUIRED: RequiredMargins = RequiredMargins { gain: 2.0, delay: 0.5 };
const MULTISINE: [f64; 2] = [10.0, 2.0];

/// Result of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// Seed of strings, machine, noise and multisine.
    pub seed: u64,
    /// Number of tuned parameters.
    pub dimension: usize,
    /// By generation.
    pub history: Vec<Generation>,
    /// The best candidate.
    pub best: Option<Candidate>,
}

/// Why the search is impossible.
#[derive(Debug, thiserror::Error)]
pub enum ConvergenceError {
    /// The spec's mode uses none of the tuned parameters.
    #[error("{0}")]
    NothingToTune(String),
    /// A run failed.
    #[error(transparent)]
    Run(RunError),
}

/// Runs `generations` of 100 strings, starting from the spec's parameters, reduced until they meet the margins. The bytes do
/// not depend on the number of threads.
///
/// # Errors
/// If there is nothing to tune, or a run fails.
pub fn run(
    compiled: &Compilation,
    controller: &Controller,
    leg: &LegParameters,
    seed: u64,
    generations: usize,
    progress: &dyn Fn(&Progress),
) -> Result<Convergence, ConvergenceError> {
    let space = Space::of(compiled, TunedNumbers::All, &[]).map_err(|found| {
        let why = found.into_iter().map(|finding| finding.message).collect::<Vec<_>>().join("; ");
        ConvergenceError::NothingToTune(why)
    })?;
    let feasibility = Feasibility::of(compiled, REQUIRED);
    let own = Setting::of(compiled);
    let [frequency, seconds] = MULTISINE;
    let conditions = Conditions {
        trajectory: TrajectoryChoice::Multisine { frequency, seconds, seed, corners: false },
        noise: Some(seed),
        machine: Some(seed),
        latency: 0,
        whole_ticks: true,
    };
    let case = Case::new(compiled, controller, leg, &own, &conditions).map_err(ConvergenceError::Run)?;
    let starts: Vec<Vec<f64>> = feasibility.reduce(&space, own).iter().map(|start| space.genes(start)).collect();
    let mut genetic = Genetic::new(Settings::PAPER, space.dimension(), &starts, seed);
    let stop = AtomicBool::new(false);
    let options = SearchOptions {
        evaluations: generations * Settings::PAPER.population,
        threads: std::thread::available_parallelism().map_or(1, NonZero::get),
        stop: &stop,
        progress,
    };
    let search = Search::run(&mut genetic, &space, &feasibility, &case, &options).map_err(ConvergenceError::Run)?;
    Ok(Convergence { seed, dimension: space.dimension(), best: search.best().copied(), history: search.history })
}
