//! Tables, drives and the brute-force oracle for the Preisach tests.
#![allow(dead_code)] // each test binary uses its own part

mod space;

pub use space::*;
use specgen_runtime::Everett;
pub use specgen_runtime::Grid;

/// The larger of two errors. Unlike `f64::max` it keeps a NaN, which no bound admits.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}

/// 64-bit linear congruential generator (Knuth's constants): a fixed sequence, whatever the platform.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        self.next() as f64 / (1u64 << 31) as f64
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

pub const N: usize = 32;
pub const NODES: usize = (N + 1) * (N + 2) / 2;
pub type Table = Everett<f64, N, NODES>;
pub type Table32 = Everett<f32, N, NODES>;

/// Weights w[up][down] of the cells, up = 1..=n, down = 0..up; the cell down = up − 1 is the diagonal triangle.
pub type Weights = Vec<Vec<f64>>;

/// Non-negative weights of a 60 µm actuator, a fifth of the square cells empty.
pub fn random_weights(seed: u64, n: usize) -> Weights {
    let mut random = Random(seed);
    let mut weights: Weights = (0..=n).map(|up| (0..up).map(|_| random.unit()).collect()).collect();
    for (up, row) in weights.iter_mut().enumerate() {
        for (down, w) in row.iter_mut().enumerate() {
            if down + 1 == up {
                *w += 8.0;
            } else if random.unit() < 0.2 {
                *w = 0.0;
            }
        }
    }
    let total: f64 = weights.iter().flatten().sum();
    weights.iter_mut().flatten().for_each(|w| *w *= 60e-6 / total);
    weights
}

/// E(i, j) = sum of the weights of the cells inside the triangle.
pub fn everett_nodes(weights: &Weights) -> Vec<f64> {
    let n = weights.len() - 1;
    let mut nodes = Vec::new();
    for i in 0..=n {
        for j in 0..=i {
            let mut sum = 0.0;
            for (up, row) in weights.iter().enumerate().take(i + 1) {
                sum += row.iter().skip(j).take(up.saturating_sub(j)).sum::<f64>();
            }
            nodes.push(sum);
        }
    }
    nodes
}

pub fn table(weights: &Weights) -> Table {
    let nodes: Box<[f64; NODES]> = everett_nodes(weights).try_into().expect("N × N weights");
    Everett { nodes: Box::leak(nodes) }
}

pub fn table32(table: &Table) -> Table32 {
    Everett { nodes: Box::leak(Box::new(table.nodes.map(|e| e as f32))) }
}

/// Brute force: every relay of a refined plane on its own.
///
/// Each cell is cut into `refine`² relays (a diagonal triangle into `refine` relays on the diagonal, whose
/// thresholds are one refined step apart). On drives that are multiples of the refined step every relay is wholly on or
/// off, so the sum is the model's exact value.
pub struct Relays {
    relays: Vec<(i64, i64, f64)>,
    on: Vec<bool>,
}

impl Relays {
    pub fn new(weights: &Weights, refine: i64) -> Self {
        let mut relays = Vec::new();
        for (up, row) in weights.iter().enumerate() {
            for (down, &w) in row.iter().enumerate() {
                let (up, down) = (up as i64, down as i64);
                if down + 1 == up {
                    for k in 0..refine {
                        let low = down * refine + k;
                        relays.push((low + 1, low, w / refine as f64));
                    }
                } else {
                    for a in 1..=refine {
                        for b in 0..refine {
                            relays.push(((up - 1) * refine + a, down * refine + b, w / (refine * refine) as f64));
                        }
                    }
                }
            }
        }
        let on = vec![false; relays.len()];
        Self { relays, on }
    }

    /// Drive in refined steps; returns the displacement, summed with compensation (thousands of terms).
    pub fn apply(&mut self, drive: i64) -> f64 {
        let (mut sum, mut lost) = (0.0f64, 0.0f64);
        for (&(up, down, w), on) in self.relays.iter().zip(&mut self.on) {
            if drive >= up {
                *on = true;
            } else if drive <= down {
                *on = false;
            }
            if *on {
                let term = w - lost;
                let next = sum + term;
                lost = (next - sum) - term;
                sum = next;
            }
        }
        sum
    }
}

/// Which pair of extrema a full memory gives up.
#[derive(Clone, Copy, PartialEq)]
pub enum Rule {
    /// The last two: what a stack that simply runs out would do.
    Innermost,
    /// The smallest Everett rectangle |E(M,m) − E(M',m) − E(M,m') + E(M',m')|, by its four look-ups.
    LeastRectangle,
}

/// The bounded staircase written for clarity: a growable list, the displacement summed from scratch.
pub struct PlainStaircase {
    pub extrema: Vec<f64>,
    pub drive: f64,
    capacity: usize,
    rule: Rule,
}

impl PlainStaircase {
    pub fn new(capacity: usize, rule: Rule) -> Self {
        Self { extrema: vec![0.0], drive: 0.0, capacity, rule }
    }

    pub fn apply(&mut self, table: &Table, drive: f64) -> f64 {
        if drive != self.drive {
            let rising = drive > self.drive;
            if rising != (self.extrema.len() % 2 == 1) {
                if self.extrema.len() == self.capacity {
                    self.drop_pair(table);
                }
                self.extrema.push(self.drive);
            }
            while self.extrema.len() >= 3 {
                let outer = self.extrema[self.extrema.len() - 2];
                if (rising && drive >= outer) || (!rising && drive <= outer) {
                    self.extrema.truncate(self.extrema.len() - 2);
                } else {
                    break;
                }
            }
            self.drive = drive;
        }
        let path: Vec<f64> = self.extrema.iter().copied().chain([self.drive]).collect();
        path.windows(2).map(|w| if w[1] >= w[0] { table.value(w[1], w[0]) } else { -table.value(w[0], w[1]) }).sum()
    }

    fn drop_pair(&mut self, table: &Table) {
        let path: Vec<f64> = self.extrema.iter().copied().chain([self.drive]).collect();
        let rectangle = |i: usize| {
            let e = |a: f64, b: f64| {
                if a >= b { table.value(a, b) } else { table.value(b, a) }
            };
            let [p, q, r, s] = [path[i - 1], path[i], path[i + 1], path[i + 2]];
            (e(p, q) - e(r, q) - e(p, s) + e(r, s)).abs()
        };
        let i = match self.rule {
            Rule::Innermost => path.len() - 3,
            Rule::LeastRectangle => {
                (1..path.len() - 2).min_by(|&a, &b| rectangle(a).total_cmp(&rectangle(b))).expect("at least one pair")
            }
        };
        self.extrema.drain(i..i + 2);
    }
}
