//! Variable projection: one family on the samples of one record.

use nalgebra::DMatrix;
use specgen_language::interrupt;
use specgen_numerics::simplex;

use super::family::{Family, TIMES};
use super::sums::{Rows, add_products};
use crate::mixed;
use crate::staircase::saturate;
use crate::statistics::mean;

/// Plays of a family that has them, in the search and in the choice of the family.
pub(super) const PLAYS: usize = 32;
/// v₀ of the widening, V/s, and time constant of the filter of the rate, s.
pub(super) const V0: f64 = 20.0;
pub(super) const RATE_LAG: f64 = 2e-3;
/// Steps of plays that widen while their rate changes, s, and the change of the rate that counts, of the rate and v₀.
const WIDENING_STEP: f64 = 2.5e-4;
const STEADY: f64 = 0.01;
/// Largest creep level.
const MOST_CREEP: f64 = 0.03;
/// Slow starts of the creep that a record may show: those of the first time constants.
const STARTS: usize = 3;
/// Ridge on the columns, of their mean square.
const RIDGE: f64 = 1e-10;
/// Evaluations of a search for each unknown: from the fixed start, and from the solution on all curves.
const SEARCH: [usize; 2] = [45, 15];

/// A record for the fit: at most some thousand samples.
pub(super) struct Samples {
    pub(super) range: [f64; 2],
    /// s.
    pub(super) time: Vec<f64>,
    /// V.
    pub(super) drive: Vec<f64>,
    /// µm.
    pub(super) y: Vec<f64>,
    /// Fold of each branch; none is always fitted.
    pub(super) folds: Vec<Option<usize>>,
    /// Branch of each sample, in order; none is not fitted.
    pub(super) branch: Vec<Option<usize>>,
    /// First sample of each further record.
    pub(super) parts: Vec<usize>,
    /// Whether the first sample is at rest. The offset of the model is then chosen to meet it.
    pub(super) at_rest: bool,
    /// Of each step and time constant: what remains of a state, and the share of the last and the present h.
    steps: Vec<[[f64; 3]; TIMES.len()]>,
}

impl Samples {
    pub(super) fn new(
        range: [f64; 2],
        [time, drive, y]: [Vec<f64>; 3],
        folds: Vec<Option<usize>>,
        branch: Vec<Option<usize>>,
    ) -> Self {
        let step = |pair: &[f64]| {
            TIMES.map(|tau| {
                let step = pair[1] - pair[0];
                let decay = libm::exp(-step / tau);
                let lag = tau / step * (1.0 - decay);
                [decay, lag - decay, 1.0 - lag]
            })
        };
        let steps = time.windows(2).map(step).collect();
        Self { range, time, drive, y, folds, branch, parts: Vec::new(), at_rest: false, steps }
    }

    /// Number of the record that sample `k` is from.
    fn part(&self, k: usize) -> usize {
        self.parts.partition_point(|first| *first <= k)
    }

    /// Samples of each branch and its fold, those of fold `out` left out.
    fn branches(&self, out: Option<usize>) -> impl Iterator<Item = (Option<usize>, core::ops::Range<usize>)> {
        let mut first = 0;
        let next = move || {
            let of = self.branch.get(first)?;
            let count = self.branch[first..].iter().take_while(|branch| *branch == of).count();
            first += count;
            Some((*of, first - count..first))
        };
        core::iter::from_fn(next)
            .filter_map(|(of, span)| Some((self.folds[of?], span)))
            .filter(move |(fold, _)| out.is_none() || *fold != out)
    }

    /// Mean square of `residual` over the branches that are not of fold `out`; each without its mean if it `floats`.
    fn mean_square(&self, residual: &[f64], out: Option<usize>, floats: bool) -> f64 {
        let squares = self.branches(out).map(|(_, span)| {
            let values = &residual[span];
            let level = if floats { mean(values) } else { 0.0 };
            (values.len(), values.iter().fold(0.0, |sum, r| sum + (r - level) * (r - level)))
        });
        let (count, sum) = squares.fold((0, 0.0), |(count, sum), (n, square)| (count + n, sum + square));
        sum / count as f64
    }

    /// The h whose creep gives y; at rest at the first sample of each record.
    pub(super) fn without_creep(&self, Creep { level, shares }: Creep) -> Vec<f64> {
        if level == 0.0 {
            return self.y.clone();
        }
        let all_shares = shares.iter().fold(0.0, |sum, share| sum + share);
        let rest = |y: f64| y / (1.0 + level * all_shares);
        let mut h = rest(self.y.first().copied().unwrap_or(0.0));
        let mut states = [h; TIMES.len()];
        let mut all = vec![h];
        for (step, y) in self.steps.iter().zip(&self.y[1..]) {
            if self.parts.contains(&all.len()) {
                h = rest(*y);
                states = [h; TIMES.len()];
                all.push(h);
                continue;
            }
            let (mut carried, mut direct) = (0.0, 1.0);
            for ((state, [decay, known, now]), share) in states.iter_mut().zip(step).zip(shares) {
                *state = decay * *state + known * h;
                carried += share * *state;
                direct += level * (share * now);
            }
            h = (y - level * carried) / direct;
            states.iter_mut().zip(step).for_each(|(state, part)| *state += part[2] * h);
            all.push(h);
        }
        all
    }

    /// The residual of y that a residual `h` before the creep causes; creep states begin at 0 in each record.
    pub(super) fn with_creep(&self, Creep { level, shares }: Creep, h: &[f64]) -> Vec<f64> {
        let mut states = [0.0; TIMES.len()];
        let mut all = vec![h[0]];
        for (step, pair) in self.steps.iter().zip(h.windows(2)) {
            if self.parts.contains(&all.len()) {
                states = [0.0; TIMES.len()];
                all.push(pair[1]);
                continue;
            }
            let mut sum = 0.0;
            for ((state, [decay, known, now]), share) in states.iter_mut().zip(step).zip(shares) {
                *state = decay * *state + known * pair[0] + now * pair[1];
                sum += share * *state;
            }
            all.push(pair[1] + level * sum);
        }
        all
    }
}

/// Weights of the creep operators with the time constants [`TIMES`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Creep {
    /// c.
    pub(super) level: f64,
    /// Weight of each operator over c; 1 until they are fitted one by one.
    pub(super) shares: [f64; TIMES.len()],
}

impl Creep {
    pub(super) const NONE: Self = Self::even(0.0);

    /// Equal weights.
    pub(super) const fn even(level: f64) -> Self {
        Self { level, shares: [1.0; TIMES.len()] }
    }

    /// The same shares of another level.
    const fn at(self, level: f64) -> Self {
        Self { level, shares: self.shares }
    }

    /// Time constant (s) and weight of each operator.
    pub(super) fn terms(self) -> Vec<[f64; 2]> {
        let terms = TIMES.into_iter().zip(self.shares).map(|(tau, share)| [tau, self.level * share]);
        if self.level > 0.0 { terms.collect() } else { Vec::new() }
    }
}

/// Searched unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    pub(super) creep: Creep,
    /// β + γ, 1/V.
    pub(super) beta_plus_gamma: f64,
    /// β − γ, 1/V.
    pub(super) beta_minus_gamma: f64,
    /// z at the first sample over its largest.
    pub(super) start: f64,
}

/// A family on a record: columns that do not depend on the searched unknowns.
pub(super) struct Problem<'a> {
    pub(super) samples: &'a Samples,
    pub(super) family: Family,
    /// Thresholds of its plays, V.
    r: Vec<f64>,
    /// κ of plays that widen.
    pub(super) kappa: f64,
    /// Largest |y|: the unit of the read-out's polynomial, µm.
    pub(super) unit: f64,
    /// Of each sample: the plays' columns, then 1 and the starts of the creep.
    fixed: Vec<f64>,
    width: usize,
    /// Those whose coefficients are not negative.
    bounded: usize,
    /// Sums over the samples of each fold, and of those that are always fitted.
    grams: Vec<DMatrix<f64>>,
}

/// A fitted family.
pub(super) struct Solution {
    pub(super) shape: Shape,
    /// Coefficients: plays, A, then 1, starts, read-out.
    pub(super) values: Vec<f64>,
    /// Residual of every sample in displacement, µm.
    pub(super) residual: Vec<f64>,
    /// Root mean square of the fitted ones, µm.
    pub(super) rms: f64,
}

/// Columns of a play at `p` with threshold `r`: p itself, or the integrals of the three Bernstein polynomials of degree 2
/// over its range, which rise.
pub(super) fn of_play(family: Family, range: [f64; 2], r: f64, p: f64, write: &mut impl FnMut(f64)) {
    if !family.is_cubic() {
        return write(p - range[0]);
    }
    let (low, length) = (range[0] + r, range[1] - range[0] - 2.0 * r);
    let s = (p - low) / length;
    let (s2, s3) = (s * s, s * s * s);
    write(length * (s - s2 + s3 / 3.0));
    write(length * (s2 - 2.0 / 3.0 * s3));
    write(length * s3 / 3.0);
}

/// A play of threshold `r` at `p` after the drive has gone to `u`, within its range.
pub(super) fn play(p: f64, r: f64, u: f64, range: [f64; 2]) -> f64 {
    saturate(saturate(p, [u - r, u + r]), [range[0] + r, range[1] - r])
}

/// Rate of the drive that widens plays, and by how much.
#[derive(Debug, Clone, Copy)]
pub(super) struct RateFilter {
    pub(super) kappa: f64,
    /// V/s.
    pub(super) v0: f64,
    /// s.
    pub(super) lag: f64,
}

/// Plays that widen with the rate, along a drive of straight lines.
pub(super) struct Widening {
    pub(super) filter: RateFilter,
    /// Filtered rate, V/s.
    pub(super) rate: f64,
    pub(super) time: f64,
    pub(super) drive: f64,
}

impl Widening {
    /// Moves the plays `states` (V) with thresholds `r` to a `drive` at a `time`.
    pub(super) fn advance(&mut self, states: &mut [f64], r: &[f64], time: f64, drive: f64) {
        let whole = time - self.time;
        if whole <= 0.0 {
            return;
        }
        let RateFilter { kappa, v0, lag } = self.filter;
        let (slope, from) = ((drive - self.drive) / whole, self.drive);
        let mut done = 0.0;
        while done < whole {
            let steady = (slope - self.rate).abs() < STEADY * (v0 + slope.abs());
            let step = if steady || whole - done < WIDENING_STEP { whole - done } else { WIDENING_STEP };
            done = if steady { whole } else { done + step };
            self.rate = slope + (self.rate - slope) * libm::exp(-step / lag);
            let scale = 1.0 + kappa * libm::log1p(self.rate.abs() / v0);
            let u = if done < whole { from + slope * done } else { drive };
            for (p, r) in states.iter_mut().zip(r) {
                *p = saturate(*p, [u - scale * r, u + scale * r]);
            }
        }
        (self.time, self.drive) = (time, drive);
    }
}

/// Thresholds of the plays of a family, V: evenly from 0 to half the range.
fn thresholds(family: Family, plays: usize, range: [f64; 2]) -> Vec<f64> {
    let count = if family.has_plays() { plays } else { 1 };
    (0..count).map(|k| 0.5 * (range[1] - range[0]) * k as f64 / plays as f64).collect()
}

impl<'a> Problem<'a> {
    /// `saturated`: the plays begin as after a fall from the highest drive, not as built. They widen by `kappa`.
    pub(super) fn new(samples: &'a Samples, family: Family, plays: usize, saturated: bool, kappa: f64) -> Self {
        Self::with_thresholds(samples, family, thresholds(family, plays, samples.range), saturated, kappa)
    }

    /// The same with the thresholds `r` (V) of its plays.
    pub(super) fn with_thresholds(
        samples: &'a Samples,
        family: Family,
        r: Vec<f64>,
        saturated: bool,
        kappa: f64,
    ) -> Self {
        let range = samples.range;
        let first = samples.drive[0];
        // As built, a play is where the drive is: below the least place of its range after a sweep.
        let as_built = !saturated && !family.is_cubic();
        let start =
            |r: &f64| if as_built { first } else { play(first + if saturated { *r } else { 0.0 }, *r, first, range) };
        let mut states: Vec<f64> = r.iter().map(start).collect();
        let starts = if family.creeps() && !family.floats() { STARTS } else { 0 };
        let bounded = r.len() * if family.is_cubic() { 3 } else { 1 };
        // Initial creep states of each record, and an offset of further ones. Not with free offsets of the branches, which
        // absorb both. Plays and z run on: a record begins at rest, where the one before it ended.
        let starts_of = |part: usize| if part == 0 { starts } else { starts + usize::from(starts > 0) };
        let records = samples.parts.len() + 1;
        let width = bounded + 1 + (0..records).map(starts_of).sum::<usize>();
        let mut fixed = Vec::with_capacity(width * samples.time.len());
        let filter = RateFilter { kappa, v0: V0, lag: RATE_LAG };
        let mut widening = Widening { filter, rate: 0.0, time: samples.time[0], drive: first };
        for (k, (u, t)) in samples.drive.iter().zip(&samples.time).enumerate() {
            interrupt::point();
            if family.widens {
                widening.advance(&mut states, &r, *t, *u);
            }
            for (p, r) in states.iter_mut().zip(&r) {
                if !family.widens {
                    *p = if as_built { saturate(*p, [u - r, u + r]) } else { play(*p, *r, *u, range) };
                }
                of_play(family, range, *r, *p, &mut |value| fixed.push(value));
            }
            fixed.push(1.0);
            let own = samples.part(k);
            let begun = own.checked_sub(1).map_or(samples.time[0], |further| samples.time[samples.parts[further]]);
            for part in 0..records {
                let here = if part == own { 1.0 } else { 0.0 };
                fixed.extend(TIMES[..starts].iter().map(|tau| here * libm::exp((begun - t) / tau)));
                fixed.extend((starts_of(part) > starts).then_some(here));
            }
        }
        let folds = samples.folds.iter().flatten().fold(0, |most, fold| if *fold < most { most } else { fold + 1 });
        let mut grams = vec![vec![0.0; width * width]; folds + 1];
        for (fold, span) in samples.branches(None) {
            let gram = &mut grams[fold.unwrap_or(folds)];
            let rows = Rows { values: &fixed, width }.of(&span);
            let centred = if family.floats() { rows.centred() } else { rows.values.to_vec() };
            let rows = Rows { values: &centred, width };
            add_products(gram, rows, rows, true);
        }
        // Only from the diagonal on: a Gram matrix is symmetric.
        let whole = |gram: Vec<f64>| {
            DMatrix::from_fn(width, width, |r, c| if r < c { gram[r * width + c] } else { gram[c * width + r] })
        };
        let grams = grams.into_iter().map(whole).collect();
        let unit = samples.y.iter().fold(0.0, |most: f64, y| if y.abs() > most { y.abs() } else { most });
        Self { samples, family, r, kappa, unit, fixed, width, bounded, grams }
    }

    /// Thresholds of its plays, V.
    pub(super) fn thresholds(&self) -> &[f64] {
        &self.r
    }

    /// z, V, at each sample.
    fn state(&self, shape: &Shape) -> Vec<f64> {
        let mut z = shape.start / shape.beta_plus_gamma;
        let mut before = self.samples.drive[0];
        let advance = |u: &f64| {
            z = state_after(z, *u - before, [shape.beta_plus_gamma, shape.beta_minus_gamma]);
            before = *u;
            z
        };
        self.samples.drive.iter().map(advance).collect()
    }

    /// Sums of products of the fixed columns over the samples that are not of fold `out`.
    fn gram(&self, out: Option<usize>) -> DMatrix<f64> {
        let parts = self.grams.iter().enumerate().filter(|(fold, _)| out != Some(*fold));
        parts.fold(DMatrix::zeros(self.width, self.width), |sum, (_, gram)| sum + gram)
    }

    /// Fits the linear unknowns to the samples that are not of fold `out`, of which the `fixed` columns have these sums of products:
    /// coefficients, and the residual of every sample in displacement, µm.
    fn solve(&self, shape: &Shape, out: Option<usize>, fixed: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<f64>)> {
        let samples = self.samples;
        let h = samples.without_creep(shape.creep);
        let state = if self.family.has_state() { self.state(shape) } else { Vec::new() };
        let states = usize::from(self.family.has_state());
        let powers = self.family.powers();
        // Own columns of a sample: −z, then those of the read-out, then h itself.
        let count = states + powers + 1;
        let mut own = Vec::with_capacity(count * h.len());
        for (k, h) in h.iter().enumerate() {
            own.extend(state.get(k).map(|z| -z));
            let x = h / self.unit;
            let mut power = x;
            for _ in 0..powers {
                power *= x;
                own.push(self.unit * (x - power));
            }
            own.push(*h);
        }
        let (columns, own) = (Rows { values: &self.fixed, width: self.width }, Rows { values: &own, width: count });
        let (mut cross, mut square) = (vec![0.0; count * self.width], vec![0.0; count * count]);
        for (_, span) in samples.branches(out) {
            // One centred factor is enough.
            let own = own.of(&span);
            let centred = self.family.floats().then(|| own.centred());
            let weights = Rows { values: centred.as_deref().unwrap_or(own.values), ..own };
            add_products(&mut cross, weights, columns.of(&span), false);
            add_products(&mut square, weights, own, false);
        }
        // In the order of the solution, a fixed column or an own one.
        let size = self.width + count - 1;
        let place = |k: usize| match k {
            k if k < self.bounded => Ok(k),
            k if k < self.bounded + states => Err(k - self.bounded),
            k if k < self.width + states => Ok(k - states),
            k => Err(k - self.width),
        };
        let mut gram = DMatrix::from_fn(size, size, |r, c| match (place(r), place(c)) {
            (Ok(r), Ok(c)) => fixed[(r, c)],
            (Ok(f), Err(o)) | (Err(o), Ok(f)) => cross[o * self.width + f],
            (Err(r), Err(c)) => square[r * count + c],
        });
        let target = |k: usize| match place(k) {
            Ok(f) => cross[(count - 1) * self.width + f],
            Err(o) => square[(count - 1) * count + o],
        };
        // The column of 1 vanishes within branches that float.
        let one = self.bounded + states;
        let vanishes = |k: usize| k == one && self.family.floats();
        let length = |k: usize| if !vanishes(k) && gram[(k, k)] > 0.0 { gram[(k, k)].sqrt() } else { f64::INFINITY };
        let scale: Vec<f64> = (0..size).map(|k| 1.0 / length(k)).collect();
        let energy = square[count * count - 1].sqrt();
        let rhs: Vec<f64> = (0..size).map(|k| target(k) * scale[k] / energy).collect();
        for r in 0..size {
            for c in 0..size {
                gram[(r, c)] *= scale[r] * scale[c];
            }
            gram[(r, r)] += if scale[r] > 0.0 { RIDGE } else { 1.0 };
        }
        let mut values = mixed::solve(&gram, &rhs, self.bounded + states).ok()?;
        values.iter_mut().zip(&scale).for_each(|(value, scale)| *value *= scale * energy);
        let mut residual: Vec<f64> = h.iter().map(|h| -h).collect();
        let (bounded, all) = (self.bounded, self.width + states);
        let runs = [(columns, 0..bounded), (own, bounded..one), (columns, one..all), (own, all..size)];
        for (rows, run) in runs {
            let carrying = run.filter(|at| values[*at] != 0.0);
            let carrying: Vec<_> = carrying.map(|at| (place(at).unwrap_or_else(|own| own), values[at])).collect();
            rows.add_columns(&mut residual, &carrying);
        }
        let offset = if !self.family.floats() {
            0.0
        } else if samples.at_rest {
            residual[0]
        } else {
            mean(&residual)
        };
        values[one] -= offset;
        for (r, h) in residual.iter_mut().zip(&h) {
            *r = (*r - offset) / self.steepness(&values, *h);
        }
        Some((values, samples.with_creep(shape.creep, &residual)))
    }

    /// dP/dh at `h`, at least a tenth.
    fn steepness(&self, values: &[f64], h: f64) -> f64 {
        let x = h / self.unit;
        let (mut sum, mut power) = (1.0, x);
        for (k, b) in (2..).zip(&values[values.len() - self.family.powers()..]) {
            sum += b * (f64::from(k) * power - 1.0);
            power *= x;
        }
        if sum > 0.1 { sum } else { 0.1 }
    }

    /// Searches the unknowns, from `near` or from the fixed start, over the samples that are not of fold `out`.
    pub(super) fn search(&self, near: Option<&Shape>, out: Option<usize>) -> Option<Solution> {
        let range = self.samples.range[1] - self.samples.range[0];
        let start = near.copied().unwrap_or(Shape {
            creep: Creep::even(if self.family.creeps() { 5e-3 } else { 0.0 }),
            beta_plus_gamma: 5.0 / range,
            beta_minus_gamma: 1.0 / range,
            start: -0.3,
        });
        let of = |unknowns: &[f64]| {
            let (level, rest) = match (self.family.creeps(), unknowns) {
                (true, [c, rest @ ..]) => (saturate(*c * 1e-2, [0.0, MOST_CREEP]), rest),
                (_, rest) => (0.0, rest),
            };
            let creep = start.creep.at(level);
            let [beta_plus_gamma, share, begun] = *rest else { return Shape { creep, ..start } };
            let beta_plus_gamma = saturate(libm::exp(beta_plus_gamma), [0.5, 500.0]) / range;
            let share = saturate(share, [-0.95, 3.0]);
            Shape {
                creep,
                beta_plus_gamma,
                beta_minus_gamma: share * beta_plus_gamma,
                start: saturate(begun, [-1.0, 1.0]),
            }
        };
        let (mut unknowns, mut steps) = (Vec::new(), Vec::new());
        let fine = if near.is_some() { 0.1 } else { 1.0 };
        if self.family.creeps() {
            unknowns.push(start.creep.level * 1e2);
            steps.push(0.3 * fine);
        }
        if self.family.has_state() {
            unknowns.extend([
                libm::log(start.beta_plus_gamma * range),
                start.beta_minus_gamma / start.beta_plus_gamma,
                start.start,
            ]);
            steps.extend([0.4, 0.3, 0.4].map(|step| step * fine));
        }
        let best = if unknowns.is_empty() {
            start
        } else {
            let most = SEARCH[usize::from(near.is_some())] * unknowns.len();
            let gram = self.gram(out);
            of(&simplex(&unknowns, &steps, most, |unknowns| self.mean_square(&of(unknowns), out, &gram)).0)
        };
        self.at(best, out)
    }

    /// The same with a creep level of its own for each operator.
    pub(super) fn with_own_levels(&self, best: Shape) -> Shape {
        let level = best.creep.level;
        if level <= 0.0 {
            return best;
        }
        let of = |unknowns: &[f64]| {
            let mut shares = [0.0; TIMES.len()];
            shares.iter_mut().zip(unknowns).for_each(|(share, c)| *share = saturate(*c, [0.0, MOST_CREEP / level]));
            Shape { creep: Creep { level, shares }, ..best }
        };
        let gram = self.gram(None);
        let cost = |unknowns: &[f64]| self.mean_square(&of(unknowns), None, &gram);
        of(&simplex(&best.creep.shares, &[0.5; TIMES.len()], SEARCH[0] * TIMES.len(), cost).0)
    }

    /// Mean square of what the best fit with these unknowns leaves of the samples that are not of fold `out`, µm².
    fn mean_square(&self, shape: &Shape, out: Option<usize>, gram: &DMatrix<f64>) -> f64 {
        let left = |(_, found): (_, Vec<f64>)| self.samples.mean_square(&found, out, self.family.floats());
        self.solve(shape, out, gram).map_or(f64::INFINITY, left)
    }

    /// The solution with these unknowns, over the samples that are not of fold `out`.
    pub(super) fn at(&self, shape: Shape, out: Option<usize>) -> Option<Solution> {
        let (values, residual) = self.solve(&shape, out, &self.gram(out))?;
        let rms = self.samples.mean_square(&residual, out, self.family.floats()).sqrt();
        Some(Solution { shape, values, residual, rms })
    }

    /// Coefficients of a solution: of the plays, A (0 without a state), of 1, of the read-out.
    pub(super) fn parts<'s>(&self, values: &'s [f64]) -> (&'s [f64], f64, f64, &'s [f64]) {
        let (plays, rest) = values.split_at(self.bounded);
        let (taken, rest) = if self.family.has_state() { (rest[0], &rest[1..]) } else { (0.0, rest) };
        (plays, taken, rest[0], &rest[self.width - self.bounded..])
    }
}

/// z after a step of the drive, V, with β + γ and β − γ (1/V): exact on either side of 0.
pub(super) fn state_after(z: f64, step: f64, [plus, minus]: [f64; 2]) -> f64 {
    let direction = if step < 0.0 { -1.0 } else { 1.0 };
    let (mut along, mut left) = (direction * z, step.abs());
    if along < 0.0 {
        let slope = 1.0 - minus * along;
        let to_zero = if minus == 0.0 { -along } else { libm::log(slope) / minus };
        if to_zero >= left {
            return direction * (along + slope * grown(minus, left));
        }
        (along, left) = (0.0, left - to_zero);
    }
    direction * (along + (1.0 - plus * along) * grown(plus, left))
}

/// ∫ e^(−rate s) ds from 0 to `way`.
fn grown(rate: f64, way: f64) -> f64 {
    if rate == 0.0 { way } else { -libm::expm1(-rate * way) / rate }
}
