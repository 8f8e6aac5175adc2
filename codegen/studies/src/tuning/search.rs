//! The loop of every optimiser: ask, reject, evaluate in parallel, tell; and its archive.
//!
//! Candidates of a generation are independent, and results are processed in the order of the requests: the same
//! seed gives the same bytes for any number of threads. A setting is never simulated twice.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use host_sim::closed_loop::RunError;
use host_sim::controller::Controller;
use serde::Serialize;
use specgen_numerics::Cma;

use super::{Case, Evaluation, Score, Setting, Space};
use crate::tuning::feasible::Feasibility;

/// Proposes numbers in [0, 1] and learns from their costs.
pub trait Optimiser {
    /// The next generation.
    fn ask(&mut self) -> Vec<Vec<f64>>;

    /// Costs of that generation in its order; `None` for rejected candidates.
    fn tell(&mut self, costs: &[Option<f64>]);
}

impl Optimiser for Cma {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        Self::ask(self)
    }

    fn tell(&mut self, costs: &[Option<f64>]) {
        Self::tell(self, costs);
    }
}

/// Options of a search.
pub struct SearchOptions<'a> {
    /// Largest number of candidates.
    pub evaluations: usize,
    /// Worker threads, at least 1.
    pub threads: usize,
    /// Set by the caller to end the search with its results so far.
    pub stop: &'a AtomicBool,
    /// Called after every generation.
    pub progress: &'a dyn Fn(&Progress),
}

/// Progress of a search.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Number of candidates so far, and in total.
    pub done: usize,
    /// See `done`.
    pub all: usize,
    /// Cost of the best candidate.
    pub best: Option<f64>,
    /// Simulated seconds per second.
    pub speed: f64,
    /// Estimated time left.
    pub left: Duration,
}

/// Decision on a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Verdict {
    /// Unstable within the required margins; not simulated.
    Unstable,
    /// Simulated.
    Run(Evaluation),
}

/// A setting and its score.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Candidate {
    /// Sequence number of the request.
    pub number: usize,
    /// The setting.
    pub setting: Setting,
    /// Its score.
    pub score: Score,
}

/// Costs of a generation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Generation {
    /// Number of candidates so far.
    pub evaluations: usize,
    /// Best cost so far.
    pub best: Option<f64>,
    /// Median of the generation's costs.
    pub median: Option<f64>,
    /// Number rejected for stability, and number at a limit.
    pub unstable: usize,
    /// See `unstable`.
    pub limited: usize,
}

/// Result of a search.
#[derive(Debug, Clone, Default)]
pub struct Search {
    /// Every scored setting once, in the order of the requests.
    pub scored: Vec<Candidate>,
    /// Costs by generation.
    pub history: Vec<Generation>,
    /// Number of requested candidates.
    pub evaluations: usize,
    /// Number of simulated runs.
    pub runs: usize,
    /// Whether the caller ended it.
    pub interrupted: bool,
}

impl Search {
    /// The candidate with the lowest cost; the first if there are several.
    pub fn best(&self) -> Option<&Candidate> {
        let mut best: Option<&Candidate> = None;
        for candidate in &self.scored {
            if best.is_none_or(|found| candidate.score.cost < found.score.cost) {
                best = Some(candidate);
            }
        }
        best
    }

    /// Runs `optimiser` on a case.
    ///
    /// # Errors
    /// If a run fails for another reason than a limit: a bug, reported with its settings.
    pub fn run(
        optimiser: &mut dyn Optimiser,
        space: &Space,
        feasibility: &Feasibility,
        case: &Case,
        options: &SearchOptions,
    ) -> Result<Self, RunError> {
        let mut search = Self::default();
        let mut seen: BTreeMap<Vec<u64>, Verdict> = BTreeMap::new();
        let mut workers: Vec<Controller> = (0..options.threads.max(1)).map(|_| case.worker()).collect();
        let begun = Instant::now();
        while search.evaluations < options.evaluations && !options.stop.load(Ordering::Relaxed) {
            let mut asked = optimiser.ask();
            asked.truncate(options.evaluations - search.evaluations);
            let settings: Vec<Setting> = asked.iter().map(|genes| space.setting(genes)).collect();
            let keys: Vec<Vec<u64>> = settings.iter().map(|setting| setting.words(&workers[0])).collect();
            // Of equal candidates only the first is evaluated, once in the whole search.
            let mut fresh: Vec<usize> = Vec::new();
            for (index, key) in keys.iter().enumerate() {
                if !seen.contains_key(key) && !fresh.iter().any(|&other| keys[other] == *key) {
                    fresh.push(index);
                }
            }
            let wanted: Vec<&Setting> = fresh.iter().map(|&index| &settings[index]).collect();
            let verdicts = evaluate(&wanted, feasibility, case, &mut workers, options.stop);
            let mut whole = true;
            for (&index, verdict) in fresh.iter().zip(verdicts) {
                let Some(verdict) = verdict else {
                    whole = false;
                    continue;
                };
                let verdict = verdict?;
                if let Verdict::Run(evaluation) = verdict {
                    search.runs += 1;
                    if let Evaluation::Scored(score) = evaluation {
                        let number = search.evaluations + index;
                        search.scored.push(Candidate { number, setting: settings[index], score });
                    }
                }
                seen.insert(keys[index].clone(), verdict);
            }
            if !whole {
                // An incomplete generation is not learned from, but its results are kept.
                search.interrupted = true;
                break;
            }
            let verdicts: Vec<Verdict> =
                keys.iter().map(|key| seen.get(key).copied().unwrap_or(Verdict::Unstable)).collect();
            search.account(&verdicts);
            if verdicts.len() == settings.len() {
                let costs: Vec<Option<f64>> = verdicts.iter().map(cost).collect();
                optimiser.tell(&costs);
            }
            let elapsed = begun.elapsed();
            let left =
                elapsed.mul_f64((options.evaluations - search.evaluations) as f64 / search.evaluations.max(1) as f64);
            (options.progress)(&Progress {
                done: search.evaluations,
                all: options.evaluations,
                best: search.best().map(|candidate| candidate.score.cost),
                speed: search.runs as f64 * case.seconds() / elapsed.as_secs_f64().max(1e-9),
                left,
            });
        }
        search.interrupted |= search.evaluations < options.evaluations;
        Ok(search)
    }

    fn account(&mut self, verdicts: &[Verdict]) {
        self.evaluations += verdicts.len();
        let mut costs: Vec<f64> = verdicts.iter().filter_map(cost).collect();
        costs.sort_by(f64::total_cmp);
        let unstable = verdicts.iter().filter(|verdict| **verdict == Verdict::Unstable).count();
        self.history.push(Generation {
            evaluations: self.evaluations,
            best: self.best().map(|candidate| candidate.score.cost),
            median: costs.get(costs.len() / 2).copied(),
            unstable,
            limited: verdicts.len() - costs.len() - unstable,
        });
    }
}

fn cost(verdict: &Verdict) -> Option<f64> {
    match verdict {
        Verdict::Run(Evaluation::Scored(score)) => Some(score.cost),
        _ => None,
    }
}

type Outcome = Option<Result<Verdict, RunError>>;

/// Decisions in the order of `settings`; `None` for those not started before `stop` was set.
pub fn evaluate(
    settings: &[&Setting],
    feasibility: &Feasibility,
    case: &Case,
    workers: &mut [Controller],
    stop: &AtomicBool,
) -> Vec<Outcome> {
    let next = AtomicUsize::new(0);
    let work = |worker: &mut Controller| {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(setting) = settings.get(index) else { return done };
            if stop.load(Ordering::Relaxed) {
                return done;
            }
            let verdict = if feasibility.holds(setting) {
                case.run(worker, setting).map(Verdict::Run)
            } else {
                Ok(Verdict::Unstable)
            };
            done.push((index, verdict));
        }
    };
    let mut outcomes: Vec<Outcome> = settings.iter().map(|_| None).collect();
    let mut place = |done: Vec<(usize, Result<Verdict, RunError>)>| {
        for (index, verdict) in done {
            outcomes[index] = Some(verdict);
        }
    };
    if let [worker] = workers {
        place(work(worker));
        return outcomes;
    }
    std::thread::scope(|scope| {
        let threads: Vec<_> = workers.iter_mut().map(|worker| scope.spawn(|| work(worker))).collect();
        for thread in threads {
            match thread.join() {
                Ok(done) => place(done),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
    });
    outcomes
}
