//! The genetic algorithm of Table 3: bit strings, roulette, two-point crossover, uniform mutation.
//!
//! What the table leaves open: 10 bits per number; fitness 1/√rank, so that selection does not depend on the unit of the cost;
//! two elite strings are kept unchanged; crossover makes its fraction of the other children, mutation the rest.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_numerics::unit_interval as unit;

use super::search::Optimiser;

/// Settings of Table 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Strings per generation.
    pub population: usize,
    /// Share of the children made by crossover.
    pub crossover: f64,
    /// Probability that a bit of a mutated string is redrawn.
    pub mutation: f64,
}

impl Settings {
    /// Table 3.
    pub const PAPER: Self = Self { population: 100, crossover: 0.9, mutation: 0.03 };
}

/// Bits per number.
const BITS: usize = 10;
/// Strings kept unchanged.
const ELITE: usize = 2;
const STREAM: u64 = 11;

/// The optimiser; see the module.
#[derive(Debug, Clone)]
pub struct Genetic {
    settings: Settings,
    rng: ChaCha8Rng,
    population: Vec<Vec<bool>>,
}

fn below(rng: &mut ChaCha8Rng, count: usize) -> usize {
    (unit(rng) * count as f64) as usize
}

impl Genetic {
    /// Random strings, including those of `starts` (numbers in [0, 1]).
    pub fn new(settings: Settings, dimension: usize, starts: &[Vec<f64>], seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAM);
        let mut population: Vec<Vec<bool>> =
            starts.iter().take(settings.population).map(|start| encode(start)).collect();
        while population.len() < settings.population {
            population.push((0..dimension * BITS).map(|_| rng.next_u64() & 1 == 1).collect());
        }
        Self { settings, rng, population }
    }

    /// Selects a string with probability proportional to its fitness; `wheel` holds cumulative sums.
    fn roulette(&mut self, wheel: &[f64]) -> usize {
        let total = wheel.last().copied().unwrap_or_default();
        let ball = unit(&mut self.rng) * total;
        wheel.iter().position(|sum| ball < *sum).unwrap_or(wheel.len() - 1)
    }

    fn crossed(&mut self, a: &[bool], b: &[bool]) -> Vec<bool> {
        let (x, y) = (below(&mut self.rng, a.len() + 1), below(&mut self.rng, a.len() + 1));
        let (first, last) = if x < y { (x, y) } else { (y, x) };
        let mut child = a.to_vec();
        child[first..last].copy_from_slice(&b[first..last]);
        child
    }

    fn mutated(&mut self, parent: &[bool]) -> Vec<bool> {
        let rate = self.settings.mutation;
        parent.iter().map(|bit| if unit(&mut self.rng) < rate { self.rng.next_u64() & 1 == 1 } else { *bit }).collect()
    }
}

impl Optimiser for Genetic {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        self.population.iter().map(|string| decode(string)).collect()
    }

    fn tell(&mut self, costs: &[Option<f64>]) {
        let order = specgen_numerics::ranked(costs);
        // Rejected strings have zero fitness.
        let mut fitness = vec![0.0; costs.len()];
        for (rank, &index) in order.iter().enumerate() {
            if costs[index].is_some() {
                fitness[index] = 1.0 / libm::sqrt((rank + 1) as f64);
            }
        }
        if fitness.iter().all(|f| *f == 0.0) {
            fitness.fill(1.0);
        }
        let mut sum = 0.0;
        let wheel: Vec<f64> = fitness
            .iter()
            .map(|f| {
                sum += f;
                sum
            })
            .collect();
        let mut next: Vec<Vec<bool>> = order.iter().take(ELITE).map(|&index| self.population[index].clone()).collect();
        let children = self.settings.population.saturating_sub(next.len());
        let crossed = libm::round(self.settings.crossover * children as f64) as usize;
        for child in 0..children {
            let parent = self.roulette(&wheel);
            let parent = self.population[parent].clone();
            let child = if child < crossed {
                let other = self.roulette(&wheel);
                let other = self.population[other].clone();
                self.crossed(&parent, &other)
            } else {
                self.mutated(&parent)
            };
            next.push(child);
        }
        self.population = next;
    }
}

fn encode(genes: &[f64]) -> Vec<bool> {
    let most = ((1_u32 << BITS) - 1) as f64;
    genes
        .iter()
        .flat_map(|gene| {
            let code = libm::round(gene * most) as u32;
            (0..BITS).rev().map(move |bit| code >> bit & 1 == 1)
        })
        .collect()
}

fn decode(string: &[bool]) -> Vec<f64> {
    let most = ((1_u32 << BITS) - 1) as f64;
    string
        .chunks(BITS)
        .map(|bits| f64::from(bits.iter().fold(0_u32, |code, bit| code << 1 | u32::from(*bit))) / most)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_survives_its_bits() {
        for genes in [vec![0.0, 1.0], vec![0.5, 0.25], vec![0.123, 0.987]] {
            for (back, gene) in decode(&encode(&genes)).iter().zip(&genes) {
                assert!((back - gene).abs() <= 0.5 / 1023.0);
            }
        }
    }

    #[test]
    fn two_point_crossover_takes_one_segment_of_the_other_parent() {
        let mut genetic = Genetic::new(Settings::PAPER, 4, &[], 3);
        for _ in 0..200 {
            let child = genetic.crossed(&[false; 40], &[true; 40]);
            let changes = child.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(changes <= 2, "{child:?}");
        }
    }

    #[test]
    fn mutation_redraws_three_percent_of_the_bits() {
        let mut genetic = Genetic::new(Settings::PAPER, 4, &[], 5);
        let flips: usize = (0..500).map(|_| genetic.mutated(&[false; 40]).iter().filter(|bit| **bit).count()).sum();
        // Half of the redrawn bits change: 20000 × 0.015.
        assert!((240..360).contains(&flips), "{flips}");
    }

    #[test]
    fn roulette_never_selects_a_rejected_string() {
        let mut genetic = Genetic::new(Settings { population: 4, ..Settings::PAPER }, 1, &[], 7);
        genetic.population = vec![vec![true; 10], vec![false; 10], vec![true; 10], vec![true; 10]];
        genetic.settings.mutation = 0.0;
        genetic.tell(&[Some(1.0), None, Some(2.0), Some(3.0)]);
        assert!(
            genetic.population.iter().skip(ELITE).all(|string| string.iter().all(|bit| *bit)),
            "{:?}",
            genetic.population
        );
    }
}
