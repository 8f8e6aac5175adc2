//! A Preisach model: Everett table from the record at its nodes; forward model from the list of all remaining extrema; inverse by
//! bisection on that forward model.

use host_sim::forc::ReversalRecord;

/// E(u_i, u_j) in m on the nodes u_k = k·interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    intervals: usize,
    interval: f64,
    nodes: Vec<Vec<f64>>,
}

impl Table {
    /// A table from a record with a row at every node: peak minus the falling branch.
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

/// Extrema in order: minimum 0, maximum, minimum, ...; the last is the present drive. Each with its displacement, m.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    extrema: Vec<(f64, f64)>,
}

impl Memory {
    /// Drive 0 after negative saturation.
    pub(super) fn new() -> Self {
        Self { extrema: vec![(0.0, 0.0)] }
    }

    /// Displacement now, m.
    pub(super) fn displacement(&self) -> f64 {
        self.extrema[self.extrema.len() - 1].1
    }

    /// Number of extrema that remain when the drive goes to `drive`, and the displacement there.
    fn reach(&self, table: &Table, drive: f64) -> (usize, f64) {
        let (last, at_last) = self.extrema[self.extrema.len() - 1];
        let mut kept = self.extrema.len();
        if drive == last {
            return (kept, at_last);
        }
        let rising = drive > last;
        // Odd indices are maxima: continuing in the same direction replaces the last extremum.
        if kept > 1 && kept.is_multiple_of(2) == rising {
            kept -= 1;
        }
        // Wiping out: a pair of extrema inside the new one is removed.
        while kept >= 3 {
            let outer = self.extrema[kept - 2].0;
            if (rising && drive >= outer) || (!rising && drive <= outer) {
                kept -= 2;
            } else {
                break;
            }
        }
        let (from, at_from) = self.extrema[kept - 1];
        let moved = if rising { table.everett(drive, from) } else { -table.everett(from, drive) };
        (kept, at_from + moved)
    }

    /// Goes to `drive`, V.
    pub(super) fn apply(&mut self, table: &Table, drive: f64) {
        let (kept, displacement) = self.reach(table, drive);
        if drive == self.extrema[self.extrema.len() - 1].0 {
            return;
        }
        self.extrema.truncate(kept);
        if drive <= 0.0 {
            // Everything is wiped out.
            self.extrema = vec![(0.0, 0.0)];
        } else {
            self.extrema.push((drive, displacement));
        }
    }

    /// The drive within 0 to `drive_max` (V) that gives `demand` (m), without applying it.
    pub(super) fn solve(&self, table: &Table, drive_max: f64, demand: f64) -> f64 {
        let (mut low, mut high) = (0.0, drive_max);
        for _ in 0..56 {
            let middle = 0.5 * (low + high);
            if self.reach(table, middle).1 < demand {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;
    use host_sim::forc::ReversalExperiment;
    use host_sim::noise::Gauge;
    use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};

    const N: usize = 8;

    fn table() -> Table {
        let experiment = ReversalExperiment { rate: 2000.0, rows_per_interval: 3, ..ReversalExperiment::reference(8) };
        let mut leg = LegPlant::new(&LegParameters::reference());
        let record = experiment.run(&mut leg, &mut Gauge::new(&NoiseParameters::NONE, 0, 0));
        Table::from_record(&record, N, 100.0)
    }

    #[test]
    fn the_memory_agrees_with_a_sum_over_relays() {
        // One relay per cell of the Preisach plane, driven at the nodes, where a cell is completely up or down.
        let table = table();
        let node = |up: usize, down: usize| table.nodes[up][down];
        let mut relays = [[false; N]; N];
        let mut memory = Memory::new();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut deepest = 0;
        for _ in 0..20_000 {
            let level = (rng.next_u64() % (N as u64 + 1)) as usize;
            memory.apply(&table, level as f64 * table.interval);
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
            let found = memory.displacement();
            assert!((found - sum).abs() < 1e-17, "{:?}: {found} {sum}", memory.extrema);
            deepest = deepest.max(memory.extrema.len());
        }
        assert!(deepest >= 6, "{deepest}");
    }
}
