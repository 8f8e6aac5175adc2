//! The families, their errors on curves that were held out, and the choice.

use serde::Serialize;
use specgen_numerics::nnls;

use super::family::{Family, WIDENED_PLAYS};
use super::fit::{Creep, PLAYS, Problem, RATE_LAG, Samples, Shape, Solution, V0, of_play, play};
use super::{Around, LegModel, READ_OUT, WidenedPlays, on_grid};
use crate::branches::Branch;
use crate::everett::EverettTable;
use crate::findings::Findings;
use crate::normal::{self, Weighting};
use crate::record::Record;
use crate::regressor::{self, Plane};
use crate::staircase::Staircase;
use crate::statistics::{mean, mean_and_error};
use crate::{DeadTime, Identification, dead_time, grid_choice, identify, joined, prior, selection};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::LegModelKind as Kind;

/// Most samples of a record in the fits; a longer one is decimated evenly.
const SAMPLES: usize = 12_000;
/// Branches shorter than this share of the range are not scored: they show how the record began.
const SCORED: f64 = 0.1;
/// A family other than the table may be worse than the best by this share of the least error plus this share of the
/// gauge's noise: such a difference does not show in motion.
const WORTHWHILE: [f64; 2] = [0.1, 0.2];
/// Largest κ, and the first ones that are tried.
const MOST_WIDENING: f64 = 0.2;
const FIRST_WIDENINGS: [f64; 5] = [0.0, 5e-3, 1.25e-2, 5e-2, MOST_WIDENING];
/// Plays among which those of the leg are found.
const FINE_PLAYS: usize = 192;
/// Fewer folds give no estimate of the spread.
const FEWEST_FOLDS: usize = 3;

/// Error of a family on curves that were held out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FamilyScore {
    /// The family.
    pub family: Family,
    /// Root mean square over all folds, each branch without its mean, m.
    pub held_out_rms: f64,
    /// Standard error of the difference to the best family over the folds, m; 0 for the best one.
    pub standard_error: f64,
    /// Root mean square on the arbitrary record, if there is one, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arbitrary_rms: Option<f64>,
}

/// The choice of a leg model.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The chosen family.
    pub family: Family,
    /// Its model, fitted to all curves.
    pub model: LegModel,
    /// Every family that was compared.
    pub scores: Vec<FamilyScore>,
    /// The Everett table of the record.
    pub table: Identification,
}

/// Rms error (m) of a leg model with a dead time (s) on a record that no fit used, see [`crate::error_on`].
pub type Selection<'a> = dyn Fn(&LegModel, f64) -> Result<f64, Vec<Diagnostic>> + 'a;

/// Fits the families that `kind` permits to `record`, one or [joined](crate::join), and chooses one: by the `arbitrary`
/// error if there is one, otherwise on curves that were held out. `options` as in [`identify`]. A model
/// with plays may be on a finer grid, see [`crate::Options::finest`].
///
/// # Errors
/// As [`identify`] and [`crate::predict`]; E0622 if the curves turn back at too few voltages to hold any out.
pub fn choose(
    record: &Record,
    arbitrary: Option<&Selection<'_>>,
    options: &crate::Options,
    kind: Kind,
) -> Result<Choice, Vec<Diagnostic>> {
    // A table has a weight for each of its cells. For a fair comparison it gets no more cells per axis than the other
    // families have plays.
    let dead_time = if options.dead_time == DeadTime::Estimate { DeadTime::FromTurns } else { options.dead_time };
    let coarse =
        crate::Options { grid: if options.grid > PLAYS { PLAYS } else { options.grid }, dead_time, ..*options };
    let table = identify(record, if kind == Kind::Preisach { options } else { &coarse })?;
    if let Some(error) = arbitrary {
        // A record that cannot be used is refused.
        error(&LegModel { table: table.table.clone(), around: None }, table.report.dead_time)?;
    }
    if kind == Kind::Preisach {
        let family = Family { kind, creep: false, widens: false };
        let model = LegModel { table: table.table.clone(), around: None };
        return Ok(Choice { family, model, scores: Vec::new(), table });
    }
    let mut findings = Findings::after(&record.shown_as, &table.warnings);
    let found = chosen((record, arbitrary), options, kind, &table, &mut findings);
    let ((family, model, scores), warnings) = findings.conclude(found)?;
    Ok(Choice { family, model, scores, table: Identification { warnings, ..table } })
}

/// A family fitted to all samples, and to all but each fold.
struct Candidate {
    family: Family,
    model: Option<LegModel>,
    /// Mean square of the samples held out, of each fold, µm².
    squares: Vec<f64>,
    /// How the plays of the solution begin, and its searched unknowns; none of a table.
    fitted: Option<(bool, Shape)>,
}

fn chosen(
    (record, arbitrary): (&Record, Option<&Selection<'_>>),
    options: &crate::Options,
    kind: Kind,
    table: &Identification,
    findings: &mut Findings,
) -> Option<(Family, LegModel, Vec<FamilyScore>)> {
    let plane = Plane { grid: table.table.grid, range: options.drive };
    let used = selection::usable(record, &plane, findings)?;
    let (slow, fast) = dead_time::rates(record, &used.branches);
    if fast < dead_time::RATE_RATIO * slow {
        let message = format!("one rate ({slow:.0} to {fast:.0} V/s): creep and rate dependence look alike");
        let help = "name a second record of some curves at a much higher rate, such as the range in 0.2 s, sampled at 1 kHz or more: its turns also show the dead time";
        findings.add(codes::CREEP_FROM_ONE_RATE, None, message, help);
    }
    let at_rest = selection::begins_at_rest(record, &plane, used.first);
    if !at_rest {
        joined::rest_unknown(record, used.first, findings);
    }
    let (fold_of, folds, levels) = grid_choice::deal(record, &used.branches, options.drive);
    if folds < FEWEST_FOLDS {
        let message = format!(
            "the curves turn back at {levels} different voltages; the choice of a leg model needs at least {}",
            FEWEST_FOLDS + 1
        );
        let help = "write hysteresis.model = \"preisach\", or record curves that turn back at more voltages";
        return findings.refuse(codes::GRID_NOT_CHOSEN, None, message, help);
    }
    // A first-order lag, found where the drive turns, also rounds the turns; any other dead time only shifts the
    // displacement.
    let delay = table.report.dead_time;
    let turned = delay > 0.0 && table.report.lag_of_turns;
    let late = turned.then(|| Record { drive: dead_time::lagged(record, delay), ..record.clone() });
    let mut data =
        Data::new(late.as_ref().unwrap_or(record), &plane, &used, &fold_of, if turned { 0.0 } else { delay });
    data.samples.at_rest = at_rest;
    let mut candidates: Vec<Candidate> = Vec::new();
    let two_rates = fast >= dead_time::RATE_RATIO * slow;
    let tried = |family: &Family| (kind == Kind::Auto || family.kind == kind) && (two_rates || !family.widens);
    for family in Family::all().into_iter().filter(tried) {
        candidates.extend(data.candidate(family, folds));
    }
    candidates
        .retain(|candidate| candidate.model.is_some() && candidate.squares.iter().all(|square| square.is_finite()));
    let best = candidates.iter().reduce(|a, b| if mean(&b.squares) < mean(&a.squares) { b } else { a });
    let Some(best) = best.map(|best| best.squares.clone()) else {
        let help = "write hysteresis.model = \"preisach\"";
        return findings.refuse(codes::NOT_DETERMINED, None, "no leg model fits the record".to_owned(), help);
    };
    let mut scores = Vec::new();
    let mut chosen: Option<Candidate> = None;
    let noise = WORTHWHILE[1] * table.report.noise_floor;
    let worthwhile = WORTHWHILE[0] * mean(&best).sqrt() + noise * 1e6;
    let on_arbitrary: Vec<Option<f64>> =
        candidates.iter().map(|candidate| arbitrary?(candidate.model.as_ref()?, delay).ok()).collect();
    let least = on_arbitrary.iter().flatten().copied().reduce(|a, b| if b < a { b } else { a });
    for (candidate, arbitrary_rms) in candidates.into_iter().zip(on_arbitrary) {
        let worse: Vec<f64> = candidate.squares.iter().zip(&best).map(|(a, b)| a.sqrt() - b.sqrt()).collect();
        let (excess, error) = mean_and_error(&worse);
        let held_out_rms = mean(&candidate.squares).sqrt() * 1e-6;
        let standard_error = error * 1e-6;
        scores.push(FamilyScore { family: candidate.family, held_out_rms, standard_error, arbitrary_rms });
        // By cross-validation: within one standard error of the best; families other than the table also within
        // `worthwhile`. The first in the order of `Family::all`, the simplest, is taken.
        let slack = if candidate.family.kind == Kind::Preisach { 0.0 } else { worthwhile };
        let good = match least {
            Some(least) => arbitrary_rms.is_some_and(|rms| rms <= (1.0 + WORTHWHILE[0]) * least + noise),
            None => excess <= error || excess <= slack,
        };
        if chosen.is_none() && good {
            chosen = Some(candidate);
        }
    }
    let mut chosen = chosen?;
    let family = chosen.family;
    if family.is_table() {
        chosen.model = Some(LegModel { table: table.table.clone(), around: None });
    }
    Some((family, data.on_grid(chosen, options)?, scores))
}

/// A record for all families.
struct Data<'a> {
    record: &'a Record,
    plane: &'a Plane,
    /// Branches of the record and the fold of each.
    branches: &'a [Branch],
    fold_of: &'a [Option<usize>],
    first: usize,
    /// Only falls are fitted by a table.
    falls_only: bool,
    /// The used part at every sample, for tables, and decimated.
    whole: Samples,
    samples: Samples,
    /// Index in the used part of each decimated sample.
    kept: Vec<usize>,
    /// Decimated samples of each branch that is scored, with its fold.
    scored: Vec<(usize, Vec<usize>)>,
}

impl<'a> Data<'a> {
    fn new(
        record: &'a Record,
        plane: &'a Plane,
        used: &'a selection::RecordSpan,
        fold_of: &'a [Option<usize>],
        delay: f64,
    ) -> Self {
        let (first, end) = (used.first, used.end);
        // Equal weight for each record.
        let most = SAMPLES / (record.parts.len() + 1);
        let mut thinned = vec![false; end - first];
        let mut parts = Vec::new();
        for span in record.spans() {
            let span = span.start.saturating_sub(first)..span.end.min(end).saturating_sub(first);
            parts.push(span.start);
            let every = span.len().div_ceil(most).max(1);
            span.step_by(every).for_each(|k| thinned[k] = true);
        }
        let y: Vec<f64> = dead_time::delayed(record, delay)[first..end].iter().map(|y| y * 1e6).collect();
        let mut of_branch = vec![None; end - first];
        for (at, branch) in used.branches.iter().enumerate() {
            let span = branch.first - first..(branch.end - first).min(end - first);
            of_branch[span].fill(Some(at));
        }
        let kept: Vec<usize> = (0..end - first).filter(|k| thinned[*k] && !record.weightless[first + k]).collect();
        let pick = |values: &[f64]| -> Vec<f64> { kept.iter().map(|k| values[*k]).collect() };
        let (time, drive) = (&record.time[first..end], &record.drive[first..end]);
        let mut samples = Samples::new(
            plane.range,
            [pick(time), pick(drive), pick(&y)],
            fold_of.to_vec(),
            kept.iter().map(|k| of_branch[*k]).collect(),
        );
        let mut whole = Samples::new(plane.range, [time.to_vec(), drive.to_vec(), y], Vec::new(), Vec::new());
        samples.parts = parts[1..].iter().map(|first| kept.partition_point(|k| k < first)).collect();
        whole.parts = parts.split_off(1);
        let least = SCORED * (plane.range[1] - plane.range[0]);
        let scored = used.branches.iter().zip(fold_of).enumerate().filter_map(|(at, (branch, fold))| {
            let span = (record.drive[branch.end - 1] - record.drive[branch.first]).abs();
            let own = (0..kept.len()).filter(|k| samples.branch[*k] == Some(at)).collect();
            (span >= least).then_some(((*fold)?, own))
        });
        let scored = scored.collect();
        let falls_only = used.first_order;
        Self { record, plane, branches: &used.branches, fold_of, first, falls_only, whole, samples, kept, scored }
    }

    fn candidate(&self, family: Family, folds: usize) -> Option<Candidate> {
        if family.kind == Kind::Preisach {
            return self.tables(family, folds);
        }
        let mut best: Option<(bool, Problem, Solution)> = None;
        // Bouc-Wen alone has one play, which starts where the drive is.
        let mut starts = if family.has_plays() { &[true, false][..] } else { &[false] };
        if family.widens {
            // Which start it is shows without a rate.
            let rms = |saturated| {
                let problem = Problem::new(&self.samples, family, PLAYS, saturated, 0.0);
                problem.search(None, None).map_or(f64::INFINITY, |solution| solution.rms)
            };
            starts = if rms(true) < rms(false) { &[true] } else { &[false] };
        }
        for saturated in starts {
            let fitted = if family.widens {
                self.widened(family, *saturated)
            } else {
                let problem = Problem::new(&self.samples, family, PLAYS, *saturated, 0.0);
                problem.search(None, None).map(|solution| (problem, solution))
            };
            if let Some((problem, solution)) = fitted
                && best.as_ref().is_none_or(|(.., best)| solution.rms < best.rms)
            {
                best = Some((*saturated, problem, solution));
            }
        }
        let (saturated, problem, solution) = best?;
        let model = model_of(&problem, &solution, self.plane);
        let squares = (0..folds).map(|fold| {
            let held_out = problem.search(Some(&solution.shape), Some(fold));
            held_out.map_or(f64::INFINITY, |found| self.square(fold, &found.residual))
        });
        let squares = squares.collect();
        Some(Candidate { family, model, squares, fitted: Some((saturated, solution.shape)) })
    }

    /// Plays that widen: κ, creep and thresholds by turns.
    fn widened(&self, family: Family, saturated: bool) -> Option<(Problem<'_>, Solution)> {
        let mut near: Option<Shape> = None;
        let (mut problem, mut solution) = search_kappa(&FIRST_WIDENINGS, 3, |kappa| {
            let problem = Problem::new(&self.samples, family, PLAYS, saturated, kappa);
            let solution = problem.search(near.as_ref(), None)?;
            near = Some(solution.shape);
            Some((problem, solution))
        })?;
        for rounds in [2, 4] {
            let kappa = problem.kappa;
            let shape = problem.with_own_levels(solution.shape);
            let fine = Problem::new(&self.samples, family, FINE_PLAYS, saturated, kappa);
            let found = fine.at(shape, None)?;
            let r = merged(fine.thresholds(), fine.parts(&found.values).0);
            (problem, solution) = search_kappa(&[kappa], rounds, |kappa| {
                let problem = Problem::with_thresholds(&self.samples, family, r.clone(), saturated, kappa);
                problem.search(Some(&shape), None).map(|solution| (problem, solution))
            })?;
        }
        Some((problem, solution))
    }

    /// The chosen model on the grid of the controller. Plays are tabulated on the finest grid that is allowed, with as many
    /// plays as cells: the table is computed from the model, so a finer one is nearer to it. Other tables are interpolated.
    fn on_grid(&self, chosen: Candidate, options: &crate::Options) -> Option<LegModel> {
        let Candidate { family, model, fitted, .. } = chosen;
        let mut chosen = model?;
        if let Some(plays) = chosen.around.as_ref().and_then(|around| around.plays.as_ref()) {
            chosen.table = plays.table(&Plane { grid: options.grid, range: self.plane.range });
            return Some(chosen);
        }
        if let Some((saturated, shape)) = fitted.filter(|_| family.has_plays() && options.finest > self.plane.grid) {
            let halves = core::iter::successors(Some(options.finest), |grid| Some(grid / 2));
            let finer = halves.take_while(|grid| *grid >= options.grid).find_map(|grid| {
                let problem =
                    Problem::new(&self.samples, family, if grid > PLAYS { grid } else { PLAYS }, saturated, 0.0);
                model_of(&problem, &problem.at(shape, None)?, &Plane { grid, range: self.plane.range })
            });
            if finer.is_some() {
                return finer;
            }
        }
        if options.grid > chosen.table.grid {
            chosen.table = on_grid(&chosen.table, options.grid);
        }
        Some(chosen)
    }

    /// Everett tables, after creep of the level that plays show.
    fn tables(&self, family: Family, folds: usize) -> Option<Candidate> {
        let creep = if family.creep {
            let plays = Family { kind: Kind::GeneralizedPlays, creep: true, widens: false };
            Problem::new(&self.samples, plays, PLAYS, true, 0.0).search(None, None)?.shape.creep
        } else {
            Creep::NONE
        };
        let h = self.whole.without_creep(creep);
        let table = self.table(&h, None)?;
        let squares = (0..folds).map(|fold| {
            let Some(table) = self.table(&h, Some(fold)) else { return f64::INFINITY };
            let mut residual = Vec::with_capacity(self.kept.len());
            let memory = Staircase::negative_saturation(self.plane.range);
            let end = self.first + h.len();
            let mut kept = self.kept.iter().peekable();
            normal::each_row(memory, self.plane, &self.record.drive[..end], self.first, |k, row| {
                if kept.next_if(|kept| **kept == k - self.first).is_some() {
                    residual.push(regressor::evaluate(row, &table.nodes) * 1e6 - h[k - self.first]);
                }
            });
            self.square(fold, &self.samples.with_creep(creep, &residual))
        });
        let squares = squares.collect();
        let model = family.creep.then(|| LegModel {
            around: Some(Around { creep: creep.terms(), ..Around::of_table(&table) }),
            table: table.clone(),
        });
        let model = model.or(Some(LegModel { table, around: None }));
        Some(Candidate { family, model, squares, fitted: None })
    }

    /// The Everett table of `h` (µm) without the curves of fold `out`.
    fn table(&self, h: &[f64], out: Option<usize>) -> Option<EverettTable> {
        let kept = self.branches.iter().zip(self.fold_of);
        let kept =
            kept.filter(|(branch, fold)| (out.is_none() || **fold != out) && !(self.falls_only && branch.rising));
        let branches: Vec<Branch> = kept.map(|(branch, _)| *branch).collect();
        let weighting = if self.falls_only { Weighting::AtNodes } else { Weighting::Even };
        let scale = 1.0 / self.record.displacement_range();
        let fill = |k: usize, values: &mut [f64]| values[0] = h[k - self.first] * 1e-6 * scale;
        let mut normal = normal::accumulate(self.plane, self.record, self.first, &branches, weighting, 1, fill);
        prior::add(self.plane.grid, &mut normal.gram);
        let solution = nnls::solve(&normal.gram, &normal.rhs[0]).ok()?;
        Some(normal::table_of(self.plane, &solution.weights, 1.0 / scale))
    }

    /// Mean square of the held-out branches of a fold, each without its mean, µm².
    fn square(&self, fold: usize, residual: &[f64]) -> f64 {
        let (mut count, mut sum) = (0, 0.0);
        for (_, own) in self.scored.iter().filter(|(of, own)| *of == fold && !own.is_empty()) {
            let values: Vec<f64> = own.iter().map(|k| residual[*k]).collect();
            let level = mean(&values);
            count += values.len();
            sum += values.iter().fold(0.0, |sum, r| sum + (r - level) * (r - level));
        }
        if count == 0 { f64::INFINITY } else { sum / count as f64 }
    }
}

/// The fit with the κ of the least residual: of `from`, then of steps about the best that become shorter.
fn search_kappa<'p>(
    from: &[f64],
    rounds: i32,
    mut fitted: impl FnMut(f64) -> Option<(Problem<'p>, Solution)>,
) -> Option<(Problem<'p>, Solution)> {
    let mut best: Option<(f64, (Problem, Solution))> = None;
    for round in 0..rounds {
        let trials = match &best {
            None => from.to_vec(),
            Some((kappa, _)) => {
                let least = FIRST_WIDENINGS[1];
                let span = 0.4 * if *kappa > 0.0 { *kappa } else { least } * libm::ldexp(1.0, -round);
                vec![kappa - span, kappa + span]
            }
        };
        for kappa in trials.into_iter().filter(|kappa| *kappa >= 0.0 && *kappa <= MOST_WIDENING) {
            if let Some(found) = fitted(kappa)
                && best.as_ref().is_none_or(|(_, best)| found.1.rms < best.1.rms)
            {
                best = Some((kappa, found));
            }
        }
    }
    best.map(|(_, found)| found)
}

/// [`WIDENED_PLAYS`] thresholds in place of `r`: those with a weight, neighbours joined where it changes the displacement least.
/// Without this, an evenly spaced play is up to half a spacing from where the leg has one.
fn merged(r: &[f64], weights: &[f64]) -> Vec<f64> {
    let pairs = r.iter().zip(weights).enumerate();
    let carrying = pairs.filter(|(k, (_, w))| *k == 0 || **w > 0.0);
    let mut plays: Vec<[f64; 2]> = carrying.map(|(_, (r, w))| [*r, *w]).collect();
    while plays.len() > WIDENED_PLAYS {
        let cost = |k: usize| {
            let ([a, v], [b, w]) = (plays[k], plays[k + 1]);
            v * w / (v + w) * (b - a)
        };
        let least = (1..plays.len() - 1).reduce(|a, b| if cost(b) < cost(a) { b } else { a });
        let Some(k) = least else { break };
        let [b, w] = plays.remove(k + 1);
        let [a, v] = plays[k];
        plays[k] = [(v * a + w * b) / (v + w), v + w];
    }
    let mut r: Vec<f64> = plays.iter().map(|play| play[0]).collect();
    // As many as the controller has: the widest gaps are split.
    while r.len() < WIDENED_PLAYS {
        let widest = (1..r.len()).reduce(|a, b| if r[b] - r[b - 1] > r[a] - r[a - 1] { b } else { a });
        let Some(k) = widest else { break };
        r.insert(k, 0.5 * (r[k - 1] + r[k]));
    }
    r
}

/// The solution as a table and the parameters beside it; none if it cannot be inverted.
fn model_of(problem: &Problem, solution: &Solution, plane: &Plane) -> Option<LegModel> {
    let Problem { family, unit, .. } = *problem;
    let (weights, taken, constant, read_out) = problem.parts(&solution.values);
    let [low, high] = plane.range;
    let r = problem.thresholds();
    // Σ f_i at plays that `place` gives, µm.
    let sum = |place: &dyn Fn(f64) -> f64| {
        let (mut sum, mut weights) = (0.0, weights.iter());
        for r in r {
            of_play(family, plane.range, *r, place(*r), &mut |value| {
                sum += value * weights.next().copied().unwrap_or(0.0);
            });
        }
        sum
    };
    let mut table =
        EverettTable { grid: plane.grid, drive_min: low, drive_max: high, nodes: Vec::with_capacity(plane.nodes()) };
    let at = |k: usize| low + k as f64 * (high - low) / plane.grid as f64;
    for up in 1..=plane.grid {
        for down in 0..up {
            let fallen = |r: f64| play(high, r, at(down), plane.range);
            let gained = sum(&|r| play(fallen(r), r, at(up), plane.range)) - sum(&fallen);
            table.nodes.push(gained * 1e-6);
        }
    }
    let Shape { creep, beta_plus_gamma: plus, beta_minus_gamma: minus, .. } = solution.shape;
    let (beta, gamma) = if taken > 0.0 { (0.5 * (plus + minus), 0.5 * (plus - minus)) } else { (0.0, 0.0) };
    // Coefficients of h, then about rest.
    let mut own = [0.0; READ_OUT];
    own[0] = read_out.iter().fold(1.0, |sum, b| sum - b);
    let mut power = 1.0;
    for (own, b) in own[1..].iter_mut().zip(read_out) {
        power *= unit;
        *own = b / power;
    }
    let mut around = Around {
        read_out: own,
        travel_um: unit,
        slope: taken,
        beta,
        gamma,
        rest_um: 0.0,
        creep: creep.terms(),
        plays: family.widens.then(|| WidenedPlays {
            kappa: problem.kappa,
            v0: V0,
            lag_s: RATE_LAG,
            thresholds: r.to_vec(),
            weights: weights.to_vec(),
        }),
    };
    let saturated = if taken > 0.0 { taken / plus } else { 0.0 };
    around.rest_um = around.state_after(saturated, low - high);
    let rest = sum(&|r| low + r) - around.rest_um + constant;
    let root = |around: &Around, p: f64| {
        let (mut below, mut above) = (-unit, 2.0 * unit);
        for _ in 0..60 {
            let middle = 0.5 * (below + above);
            if around.read_out(middle) < p { below = middle } else { above = middle }
        }
        0.5 * (below + above)
    };
    let place = root(&around, rest);
    around.read_out = shifted(&own, place);
    let full = table.node(plane.grid, 0) * 1e6 - (around.state_after(around.rest_um, high - low) - around.rest_um);
    around.travel_um = root(&around, full);
    around.inverse()?;
    // Monotone: no cell of the diagonal is flatter than the state is steep.
    let cell = (high - low) / plane.grid as f64;
    let steepest = if taken > 0.0 { taken * if minus > 0.0 { 1.0 + minus / plus } else { 1.0 } } else { 0.0 };
    let rises = (0..plane.grid).all(|k| table.node(k + 1, k) * 1e6 > steepest * cell);
    let usable = rises && around.plays.as_ref().is_none_or(WidenedPlays::is_valid);
    usable.then_some(LegModel { table, around: Some(around) })
}

/// Coefficients of the polynomial about `place`, without its value there.
fn shifted(own: &[f64; READ_OUT], place: f64) -> [f64; READ_OUT] {
    // Horner's scheme, once for each coefficient.
    let mut all = [0.0; READ_OUT + 1];
    all[1..].copy_from_slice(own);
    for first in 0..=READ_OUT {
        for k in (first..READ_OUT).rev() {
            all[k] += place * all[k + 1];
        }
    }
    let mut about = [0.0; READ_OUT];
    about.copy_from_slice(&all[1..]);
    about
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_about_another_place_has_the_same_values() {
        let own = [1.0, 0.5, -0.2, 0.03, 0.001];
        let value = |c: &[f64; READ_OUT], x: f64| c.iter().rev().fold(0.0, |sum, c| (sum + c) * x);
        let about = shifted(&own, 0.7);
        for x in [-1.0, 0.0, 0.3, 2.0] {
            assert!((value(&about, x) - (value(&own, 0.7 + x) - value(&own, 0.7))).abs() < 1e-12);
        }
    }
}
