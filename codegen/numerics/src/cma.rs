//! CMA-ES (Hansen, "The CMA evolution strategy: a tutorial", 2016) with the settings of its Table 1, minus active update.
//!
//! Bounds: numbers outside [0, 1] are redrawn a few times, then clipped. Rejected candidates rank last. Once the
//! steps are small, the search restarts from the best point with twice the population. This is our own code because available crates depend on
//! linear algebra whose bits depend on the processor, and the result is written into a spec.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::diagonalize;

/// Initial step, relative to the range, and the step at which the search restarts.
const STEP: f64 = 0.15;
const SMALL: f64 = 2e-4;
const REDRAWS: u32 = 8;
const STREAM: u64 = 12;

/// The optimiser; see the module.
#[derive(Debug, Clone)]
pub struct Cma {
    rng: ChaCha8Rng,
    spare: Option<f64>,
    population: usize,
    mean: Vec<f64>,
    step: f64,
    covariance: Vec<Vec<f64>>,
    /// Columns: eigenvectors times the square roots of their eigenvalues.
    axes: Vec<Vec<f64>>,
    /// Columns: eigenvectors divided by these square roots.
    inverse_axes: Vec<Vec<f64>>,
    path: Vec<f64>,
    step_path: Vec<f64>,
    generation: u32,
    asked: Vec<Vec<f64>>,
    best: Option<(f64, Vec<f64>)>,
}

impl Cma {
    /// Starts at `start` (numbers in [0, 1]) with `population` candidates a generation, at least 4.
    pub fn new(start: &[f64], population: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAM);
        let mut cma = Self {
            rng,
            spare: None,
            population: population.max(4),
            mean: start.to_vec(),
            step: STEP,
            covariance: Vec::new(),
            axes: Vec::new(),
            inverse_axes: Vec::new(),
            path: Vec::new(),
            step_path: Vec::new(),
            generation: 0,
            asked: Vec::new(),
            best: None,
        };
        cma.begin();
        cma
    }

    fn begin(&mut self) {
        let n = self.mean.len();
        let identity = identity(n);
        self.step = STEP;
        self.covariance.clone_from(&identity);
        self.axes.clone_from(&identity);
        self.inverse_axes = identity;
        self.path = vec![0.0; n];
        self.step_path = vec![0.0; n];
        self.generation = 0;
    }

    fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit_interval(&mut self.rng)));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * unit_interval(&mut self.rng));
        self.spare = Some(radius * sin);
        radius * cos
    }

    fn draw(&mut self) -> Vec<f64> {
        let n = self.mean.len();
        let mut point = Vec::new();
        for _ in 0..=REDRAWS {
            let z: Vec<f64> = (0..n).map(|_| self.normal()).collect();
            point = (0..n).map(|i| self.mean[i] + self.step * dot(&self.axes[i], &z)).collect();
            if point.iter().all(|x| (0.0..=1.0).contains(x)) {
                return point;
            }
        }
        point
            .into_iter()
            .map(|x| {
                if x > 1.0 {
                    1.0
                } else if x > 0.0 {
                    x
                } else {
                    0.0
                }
            })
            .collect()
    }
}

/// A number in [0, 1) of 53 random bits.
#[must_use]
pub fn unit_interval(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Indices in ascending order of cost, rejected ones last; ties keep the order of the list.
pub fn ranked(costs: &[Option<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    let key = |index: &usize| costs[*index].unwrap_or(f64::INFINITY);
    order.sort_by(|a, b| key(a).total_cmp(&key(b)));
    order
}

fn identity(n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (x, y) in a.iter().zip(b) {
        sum += x * y;
    }
    sum
}

impl Cma {
    /// The next generation: numbers in [0, 1].
    pub fn ask(&mut self) -> Vec<Vec<f64>> {
        self.asked = (0..self.population).map(|_| self.draw()).collect();
        self.asked.clone()
    }

    /// Costs of that generation in its order; `None` for rejected candidates.
    pub fn tell(&mut self, costs: &[Option<f64>]) {
        let n = self.mean.len();
        let dimension = n as f64;
        let order = ranked(costs);
        if let Some((index, cost)) = order.first().and_then(|&i| costs[i].map(|cost| (i, cost)))
            && self.best.as_ref().is_none_or(|(best, _)| cost < *best)
        {
            self.best = Some((cost, self.asked[index].clone()));
        }
        let scored = costs.iter().filter(|cost| cost.is_some()).count();
        if scored == 0 {
            // No information in this generation: search closer.
            self.step *= 0.5;
            return;
        }
        let parents = (self.population / 2).min(scored);
        let raw: Vec<f64> =
            (0..parents).map(|i| libm::log(0.5 * (self.population as f64 + 1.0)) - libm::log((i + 1) as f64)).collect();
        let total: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / total).collect();
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let step_rate = (effective + 2.0) / (dimension + effective + 5.0);
        let root = libm::sqrt((effective - 1.0) / (dimension + 1.0)) - 1.0;
        let damping = 1.0 + 2.0 * if root > 0.0 { root } else { 0.0 } + step_rate;
        let path_rate = (4.0 + effective / dimension) / (dimension + 4.0 + 2.0 * effective / dimension);
        let rank_one = 2.0 / ((dimension + 1.3) * (dimension + 1.3) + effective);
        let rank_mu = {
            let rate = 2.0 * (effective - 2.0 + 1.0 / effective) / ((dimension + 2.0) * (dimension + 2.0) + effective);
            let rate = if rate > 0.0 { rate } else { 0.0 };
            if rate < 1.0 - rank_one { rate } else { 1.0 - rank_one }
        };
        let expected = libm::sqrt(dimension) * (1.0 - 1.0 / (4.0 * dimension) + 1.0 / (21.0 * dimension * dimension));

        let steps: Vec<Vec<f64>> = order[..parents]
            .iter()
            .map(|&index| (0..n).map(|i| (self.asked[index][i] - self.mean[i]) / self.step).collect())
            .collect();
        let way: Vec<f64> = (0..n).map(|i| steps.iter().zip(&weights).map(|(y, w)| w * y[i]).sum()).collect();
        for (mean, way) in self.mean.iter_mut().zip(&way) {
            *mean += self.step * way;
        }
        // C^(−1/2) · way = B D⁻¹ Bᵀ way.
        let turned: Vec<f64> = (0..n).map(|k| (0..n).map(|i| self.inverse_axes[i][k] * way[i]).sum()).collect();
        let unit_columns = |i: usize, k: usize| {
            // B from B D: the column over its length.
            let length = libm::sqrt((0..n).map(|r| self.axes[r][k] * self.axes[r][k]).sum::<f64>());
            self.axes[i][k] / length
        };
        let whitened: Vec<f64> = (0..n).map(|i| (0..n).map(|k| unit_columns(i, k) * turned[k]).sum()).collect();
        let push = libm::sqrt(step_rate * (2.0 - step_rate) * effective);
        for (path, white) in self.step_path.iter_mut().zip(&whitened) {
            *path = (1.0 - step_rate) * *path + push * white;
        }
        self.generation += 1;
        let length = libm::sqrt(dot(&self.step_path, &self.step_path));
        let grown = 1.0 - libm::pow(1.0 - step_rate, 2.0 * f64::from(self.generation));
        let moving = length / libm::sqrt(grown) < (1.4 + 2.0 / (dimension + 1.0)) * expected;
        let push = if moving { libm::sqrt(path_rate * (2.0 - path_rate) * effective) } else { 0.0 };
        for (path, way) in self.path.iter_mut().zip(&way) {
            *path = (1.0 - path_rate) * *path + push * way;
        }
        let stalled = if moving { 0.0 } else { path_rate * (2.0 - path_rate) };
        for i in 0..n {
            for j in 0..=i {
                let spread: f64 = steps.iter().zip(&weights).map(|(y, w)| w * y[i] * y[j]).sum();
                let old = self.covariance[i][j];
                let new = (1.0 - rank_one - rank_mu) * old
                    + rank_one * (self.path[i] * self.path[j] + stalled * old)
                    + rank_mu * spread;
                self.covariance[i][j] = new;
                self.covariance[j][i] = new;
            }
        }
        let change = step_rate / damping * (length / expected - 1.0);
        self.step *= libm::exp(if change < 1.0 { change } else { 1.0 });
        let (mut turned, mut vectors) = (self.covariance.clone(), identity(n));
        diagonalize(&mut turned, &mut vectors);
        let values: Vec<f64> = (0..n).map(|k| turned[k][k]).collect();
        let floor = 1e-14 * values.iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
        let roots: Vec<f64> = values.iter().map(|v| libm::sqrt(if *v > floor { *v } else { floor })).collect();
        for (i, vector) in vectors.iter().enumerate() {
            for (k, (value, root)) in vector.iter().zip(&roots).enumerate() {
                self.axes[i][k] = value * root;
                self.inverse_axes[i][k] = value / root;
            }
        }
        let longest = roots.iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
        if self.step * longest < SMALL || !self.step.is_finite() {
            if let Some((_, best)) = &self.best {
                self.mean.clone_from(best);
            }
            self.population *= 2;
            self.begin();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Best value after `budget` evaluations, starting at 0.8 in every dimension.
    fn minimise(dimension: usize, budget: usize, seed: u64, f: impl Fn(&[f64]) -> Option<f64>) -> f64 {
        let mut cma = Cma::new(&vec![0.8; dimension], 12, seed);
        let (mut spent, mut best) = (0, f64::INFINITY);
        while spent < budget {
            let points = cma.ask();
            let costs: Vec<Option<f64>> = points.iter().map(|p| f(p)).collect();
            spent += points.len();
            best = costs.iter().flatten().fold(best, |a, b| a.min(*b));
            assert!(points.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
            cma.tell(&costs);
        }
        best
    }

    #[test]
    fn an_ill_conditioned_ellipsoid_is_minimised() {
        // Axes from 1 to 1000, rotated against the coordinates.
        let f = |x: &[f64]| {
            let y: Vec<f64> = (0..5).map(|i| (x[i] - 0.4) + 0.5 * (x[(i + 1) % 5] - 0.4)).collect();
            Some(y.iter().enumerate().map(|(i, y)| libm::pow(1000.0, i as f64 / 2.0) * y * y).sum())
        };
        // Starts at about 1e5. The search does not refine below steps of 2e-4, whose square remains on the flattest axis.
        let best = minimise(5, 4000, 1, f);
        assert!(best < 1e-6, "{best:e}");
    }

    #[test]
    fn rejected_candidates_rank_last_and_ties_keep_their_order() {
        assert_eq!(ranked(&[Some(2.0), None, Some(1.0), Some(2.0), None]), [2, 0, 3, 1, 4]);
    }

    #[test]
    fn a_minimum_on_the_boundary_of_the_rejected_region_is_found() {
        let f = |x: &[f64]| (x[0] + x[1] > 0.6).then(|| x[0] * x[0] + 2.0 * x[1] * x[1]);
        // By Lagrange multipliers: x0 = 0.4, x1 = 0.2.
        let best = minimise(2, 2000, 2, f);
        assert!((best - 0.24).abs() < 1e-3, "{best}");
    }
}
