//! A small controller in plain f64, written apart from the emitted one: an oracle for it and for the plant's figures.
//! For tests (feature `oracle`); slow, with a memory without bounds.
//!
//! Everett table read off the record's nodes; forward model from the list of all extrema that are not wiped out;
//! inverse by bisection on that forward model; run-to-run adaptation (AII.3), (AII.5), (AII.6) in the filter form.

use crate::closed_loop::LEGS;
use crate::controller::{ControllerError, TickController};
use crate::description::Description;
use crate::forc::ReversalRecord;
use crate::word::Scalar;

/// E(u_i, u_j) in m on the nodes u_k = k·interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    intervals: usize,
    interval: f64,
    nodes: Vec<Vec<f64>>,
}

impl Table {
    /// From a record whose rows meet every node: peak minus the falling branch.
    #[must_use]
    pub fn from_record(record: &ReversalRecord, intervals: usize, drive_max: f64) -> Self {
        let interval = drive_max / intervals as f64;
        let mut nodes = vec![vec![0.0; intervals + 1]; intervals + 1];
        let mut peak: Option<(usize, f64)> = None;
        for pair in record.rows.windows(2) {
            let (before, row) = (pair[0], pair[1]);
            let level = row.drive / interval;
            if level.fract() != 0.0 {
                continue;
            }
            let level = level as usize;
            if row.drive > before.drive {
                peak = Some((level, row.displacement));
            } else if let Some((top, at_top)) = peak {
                nodes[top][level] = at_top - row.displacement;
            }
        }
        Self { intervals, interval, nodes }
    }

    /// E(up, down) in m for 0 ≤ `down` ≤ `up` ≤ full drive (V): bilinear in the squares, linear in the diagonal triangles.
    #[must_use]
    pub fn everett(&self, up: f64, down: f64) -> f64 {
        let cell = |x: f64| ((x / self.interval) as usize).min(self.intervals - 1);
        let (i, j) = (cell(up), cell(down));
        let (s, t) = (up / self.interval - i as f64, down / self.interval - j as f64);
        if i == j {
            return self.nodes[i + 1][i] * (s - t);
        }
        let low = self.nodes[i][j] * (1.0 - t) + self.nodes[i][j + 1] * t;
        let high = self.nodes[i + 1][j] * (1.0 - t) + self.nodes[i + 1][j + 1] * t;
        low * (1.0 - s) + high * s
    }
}

/// Extrema in order: minimum 0, maximum, minimum, ...; the last is the present drive.
#[derive(Debug, Clone)]
struct Memory(Vec<f64>);

impl Memory {
    fn moved_to(&self, drive: f64) -> Self {
        let mut extrema = self.0.clone();
        let last = extrema[extrema.len() - 1];
        if drive == last {
            return self.clone();
        }
        let rising = drive > last;
        // Odd places are maxima: continuing in the same direction replaces the last extremum.
        if extrema.len().is_multiple_of(2) == rising && extrema.len() > 1 {
            extrema.pop();
        }
        // Wiping out: a pair of extrema inside the new one is forgotten.
        while extrema.len() >= 3 {
            let outer = extrema[extrema.len() - 2];
            if (rising && drive >= outer) || (!rising && drive <= outer) {
                extrema.truncate(extrema.len() - 2);
            } else {
                break;
            }
        }
        if extrema.len() == 2 && !rising && drive <= extrema[0] {
            extrema.truncate(1);
            return Self(extrema);
        }
        extrema.push(drive);
        Self(extrema)
    }

    fn displacement(&self, table: &Table) -> f64 {
        let mut sum = 0.0;
        for pair in self.0.windows(2) {
            sum += if pair[1] > pair[0] { table.everett(pair[1], pair[0]) } else { -table.everett(pair[0], pair[1]) };
        }
        sum
    }
}

#[derive(Debug, Clone)]
struct Leg {
    memory: Memory,
    requested: f64,
    level: f64,
    drift: f64,
}

/// See the module.
pub struct Oracle {
    table: Table,
    drive_max: f64,
    /// DAC step in V; 0 for none.
    lsb: f64,
    mode: u64,
    legs: [Leg; LEGS],
    description: Description,
}

const LEVEL_WEIGHT: f64 = 0.252;
const DRIFT_WEIGHT: f64 = 0.011;

impl Oracle {
    /// Six legs with one table; `drive_max` in V; `lsb` is the DAC's step in V, 0 for a continuous drive.
    #[must_use]
    pub fn new(table: Table, drive_max: f64, lsb: f64) -> Self {
        let rest = Leg { memory: Memory(vec![0.0]), requested: 0.0, level: 0.0, drift: 0.0 };
        let legs = std::array::from_fn(|_| rest.clone());
        Self { table, drive_max, lsb, mode: 0, legs, description: description() }
    }
}

/// The emitted controller's interface, as far as it goes here.
fn description() -> Description {
    let six = |stem: &str| (0..LEGS).map(move |leg| format!("{stem}[{leg}]")).collect::<Vec<_>>();
    Description {
        name: "oracle".to_owned(),
        digest: "0".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scalar: Scalar::F64,
        config_names: ["mode", "level_weight", "drift_weight"].map(str::to_owned).to_vec(),
        input_names: [six("setpoint"), six("displacement")].concat(),
        output_names: [six("voltage"), six("requested"), six("demand"), six("level"), six("drift")].concat(),
    }
}

impl TickController for Oracle {
    fn description(&self) -> &Description {
        &self.description
    }

    fn default_config(&self) -> Vec<u64> {
        vec![2, LEVEL_WEIGHT.to_bits(), DRIFT_WEIGHT.to_bits()]
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.mode = words[0];
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self { mode: self.mode, ..Self::new(self.table.clone(), self.drive_max, self.lsb) };
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let q_max = self.table.everett(self.drive_max, 0.0);
        for (index, leg) in self.legs.iter_mut().enumerate() {
            let target = f64::from_bits(input[index]);
            let error = f64::from_bits(input[LEGS + index]) - leg.requested;
            if self.mode == 2 {
                leg.drift = DRIFT_WEIGHT * (error - leg.level) + (1.0 - DRIFT_WEIGHT) * leg.drift;
            }
            if self.mode >= 1 {
                leg.level = LEVEL_WEIGHT * error + (1.0 - LEVEL_WEIGHT) * leg.level;
            }
            let demand = (target - leg.level - leg.drift).clamp(0.0, q_max);
            let (mut low, mut high) = (0.0, self.drive_max);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if leg.memory.moved_to(middle).displacement(&self.table) < demand {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let mut drive = 0.5 * (low + high);
            if self.lsb > 0.0 {
                drive = (drive / self.lsb).round() * self.lsb;
            }
            leg.memory = leg.memory.moved_to(drive);
            leg.requested = leg.memory.displacement(&self.table);
            output[index] = drive.to_bits();
            output[LEGS + index] = leg.requested.to_bits();
            output[2 * LEGS + index] = target.to_bits();
            output[3 * LEGS + index] = leg.level.to_bits();
            output[4 * LEGS + index] = leg.drift.to_bits();
        }
    }

    fn state_digest(&self) -> u64 {
        self.legs
            .iter()
            .fold(0, |digest: u64, leg| digest.rotate_left(7) ^ leg.requested.to_bits() ^ leg.level.to_bits())
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::forc::ReversalExperiment;
    use crate::noise::Gauge;
    use crate::plant::{LegParameters, LegPlant, NoiseParameters};

    const N: usize = 8;

    fn table() -> Table {
        let experiment = ReversalExperiment { rate: 2000.0, rows_per_interval: 3, ..ReversalExperiment::reference(8) };
        let mut leg = LegPlant::new(&LegParameters::reference());
        let record = experiment.run(&mut leg, &mut Gauge::new(&NoiseParameters::NONE, 0, 0));
        Table::from_record(&record, N, 100.0)
    }

    #[test]
    fn the_memory_agrees_with_a_sum_over_relays() {
        // One relay per cell of the Preisach plane, driven on the nodes, where a cell is wholly up or down.
        let table = table();
        let node = |up: usize, down: usize| table.nodes[up][down];
        let mut relays = [[false; N]; N];
        let mut memory = Memory(vec![0.0]);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut deepest = 0;
        for _ in 0..20_000 {
            let level = (rng.next_u64() % (N as u64 + 1)) as usize;
            memory = memory.moved_to(level as f64 * table.interval);
            let mut sum = 0.0;
            for (up, row) in relays.iter_mut().enumerate() {
                for (down, relay) in row.iter_mut().enumerate().take(up + 1) {
                    // Relay of thresholds between nodes up, up + 1 and down, down + 1.
                    if level > up {
                        *relay = true;
                    } else if level <= down {
                        *relay = false;
                    }
                    let weight = node(up + 1, down)
                        - node(up, down)
                        - if down < up { node(up + 1, down + 1) - node(up, down + 1) } else { 0.0 };
                    if *relay {
                        sum += weight;
                    }
                }
            }
            let found = memory.displacement(&table);
            assert!((found - sum).abs() < 1e-18, "{:?}: {found} {sum}", memory.0);
            deepest = deepest.max(memory.0.len());
        }
        assert!(deepest >= 6, "{deepest}");
    }

    #[test]
    fn what_is_requested_is_what_was_demanded_within_the_range() {
        let mut oracle = Oracle::new(table(), 100.0, 0.0);
        let mut output = vec![0; 30];
        for k in 0..500 {
            let demand = 30e-6 + 25e-6 * libm::sin(0.37 * f64::from(k));
            let input: Vec<u64> = [[demand.to_bits(); 6], [0; 6]].concat();
            oracle.step(&input, &mut output);
            assert!((f64::from_bits(output[6]) - demand).abs() < 1e-18);
        }
        oracle.step(&[[1.0_f64.to_bits(); 6], [0; 6]].concat(), &mut output);
        assert!((f64::from_bits(output[0]) - 100.0).abs() < 1e-12);
    }
}
