//! Records with a known truth, and an independent model: brute-force relays.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::diagnostic::Diagnostic;
use specgen::everett::EverettTable;
use specgen::identify::regressor::{Plane, evaluate};
use specgen::identify::{Reading, Record, Staircase, read_record};
use specgen_tests::skipped;
use std::path::Path;

pub fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Uniform in [0, 1).
pub fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Standard normal (Box–Muller).
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - uniform(random)).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(random)).cos()
}

/// A finding with a code and a part of its message; it has a help.
pub fn expect<'a>(all: &'a [Diagnostic], code: &str, text: &str) -> &'a Diagnostic {
    let fitting = all.iter().find(|d| d.code == code && d.message.contains(text));
    let found = fitting.unwrap_or_else(|| panic!("no {code} with `{text}` in {all:#?}"));
    assert!(!found.help.is_empty(), "{found:?}");
    found
}

/// Displacement of a table along a drive (m), from a memory.
pub fn response(table: &EverettTable, mut memory: Staircase, drive: &[f64]) -> Vec<f64> {
    let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
    let mut row = Vec::new();
    let displacement = |u: &f64| {
        memory.push(*u);
        plane.row(&memory, &mut row);
        evaluate(&row, &table.nodes)
    };
    drive.iter().map(displacement).collect()
}

/// A measured record of real hardware; none, and a line that says so, where the data is absent.
pub fn measured(name: &str) -> Option<Record> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/piezo-forc").join(name);
    if path.exists() {
        return Some(read_record(&path, name, &Reading::default()).unwrap_or_else(|d| panic!("{d:#?}")));
    }
    skipped(&format!("../shared/data/piezo-forc/{name} is not here"));
    None
}

/// Table from weights by the definition: E(i, j) = Σ of the weights with up ≤ i and down ≥ j.
pub fn table(grid: usize, range: [f64; 2], weight: impl Fn(usize, usize) -> f64) -> EverettTable {
    let mut nodes = vec![0.0; grid * (grid + 1) / 2];
    for up in 1..=grid {
        for down in 0..up {
            let mut sum = 0.0;
            for a in 1..=up {
                for b in down..a {
                    sum += weight(a, b);
                }
            }
            nodes[EverettTable::index(up, down)] = sum;
        }
    }
    EverettTable { grid, drive_min: range[0], drive_max: range[1], nodes }
}

/// Table of positive weights (m) that resembles a piezo actuator: heavy diagonal, `roughness` 0 to 1 of random scatter.
pub fn random_table(grid: usize, range: [f64; 2], stroke: f64, roughness: f64, seed: u64) -> EverettTable {
    let mut random = generator(seed);
    let scatter: Vec<f64> =
        (0..grid * (grid + 1) / 2).map(|_| 1.0 + roughness * (2.0 * uniform(&mut random) - 1.0)).collect();
    let shape = |a: usize, b: usize| {
        let width = (a - 1 - b) as f64 / grid as f64;
        let base = if a == b + 1 { 0.6 } else { 1.2 / grid as f64 * (-4.0 * width).exp() };
        base * scatter[EverettTable::index(a, b)]
    };
    let raw = table(grid, range, shape);
    let scale = stroke / raw.node(grid, 0);
    table(grid, range, |a, b| scale * shape(a, b))
}

/// A record in the making: time from 0 at a fixed rate, drive in V.
pub struct Drive {
    /// Samples per second.
    pub rate: f64,
    /// V.
    pub samples: Vec<f64>,
}

impl Drive {
    pub fn at(start: f64, rate: f64) -> Self {
        Self { rate, samples: vec![start] }
    }

    /// Ramp to `target` at `slope` (V/s).
    pub fn ramp(mut self, target: f64, slope: f64) -> Self {
        let from = *self.samples.last().unwrap();
        let steps = (((target - from).abs() / slope * self.rate).round() as usize).max(1);
        self.samples.extend((1..=steps).map(|k| from + (target - from) * k as f64 / steps as f64));
        self
    }

    /// Constant for `seconds`.
    pub fn hold(mut self, seconds: f64) -> Self {
        let last = *self.samples.last().unwrap();
        self.samples.extend(std::iter::repeat_n(last, (seconds * self.rate) as usize));
        self
    }

    pub fn jump(mut self, target: f64) -> Self {
        self.samples.push(target);
        self
    }

    /// First-order reversal curves: up to k/n of the range and back, k = 1..=n.
    pub fn reversal_curves(mut self, n: usize, range: [f64; 2], slope: f64) -> Self {
        for k in 1..=n {
            self = self.ramp(range[0] + (range[1] - range[0]) * k as f64 / n as f64, slope).ramp(range[0], slope);
        }
        self
    }

    pub fn time(&self) -> Vec<f64> {
        (0..self.samples.len()).map(|k| k as f64 / self.rate).collect()
    }
}

/// Preisach plane of relays, one per cell, half-way thresholds; the drive is meant to stay on grid values.
///
/// The relay of cell (a, b) switches on when the drive reaches u_a from below and off when it falls to u_b.
pub struct Relays {
    grid: usize,
    on: Vec<bool>,
}

impl Relays {
    pub fn off(grid: usize) -> Self {
        Self { grid, on: vec![false; grid * (grid + 1) / 2] }
    }

    /// Moves the drive to grid value k.
    pub fn push(&mut self, k: usize) {
        for a in 1..=self.grid {
            for b in 0..a {
                let relay = &mut self.on[EverettTable::index(a, b)];
                if k >= a {
                    *relay = true;
                } else if k <= b {
                    *relay = false;
                }
            }
        }
    }

    /// Σ of the weights that are on.
    pub fn output(&self, table: &EverettTable) -> f64 {
        let mut sum = 0.0;
        for a in 1..=self.grid {
            for b in 0..a {
                if self.on[EverettTable::index(a, b)] {
                    sum += table.weight(a, b);
                }
            }
        }
        sum
    }
}
