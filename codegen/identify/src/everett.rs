//! The Everett table: the result of an identification, which the lowering turns into a constant.

/// Least N at which [`EverettTable::reversal_gain`] is the gain of small motion.
pub const FINE_GRID: usize = 32;

/// Everett function E(up, down) of one leg on a uniform grid of `grid` intervals, in metres of displacement.
///
/// E(u_i, u_j) is the displacement gained when the drive rises from saturation at `u_j` to `u_i`
/// (first-order reversal), for thresholds `u_k = drive_min + k·(drive_max − drive_min)/grid`, i > j.
/// E(u, u) = 0. Between nodes the controller interpolates bilinearly in square cells and linearly in
/// the triangles on the diagonal, so that the weight of a diagonal cell is reversible.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EverettTable {
    /// Number of intervals N, 2 to 128.
    pub grid: usize,
    /// Lowest threshold u_0, V.
    pub drive_min: f64,
    /// Highest threshold u_N, V.
    pub drive_max: f64,
    /// E in metres, N(N+1)/2 values: rows `up` i = 1..=N, in each the columns `down` j = 0..i. See [`EverettTable::index`].
    pub nodes: Vec<f64>,
}

impl EverettTable {
    /// A leg without hysteresis that moves by `stroke` (m) over a range of voltages (V), on `grid` intervals.
    #[must_use]
    pub fn straight(grid: usize, [drive_min, drive_max]: [f64; 2], stroke: f64) -> Self {
        let cells = (1..=grid).flat_map(|up| (0..up).map(move |down| up - down));
        let nodes = cells.map(|cells| stroke * cells as f64 / grid as f64).collect();
        Self { grid, drive_min, drive_max, nodes }
    }

    /// Position of E(u_up, u_down) in [`EverettTable::nodes`], for 1 ≤ `up` ≤ N and `down` < `up`.
    #[must_use]
    pub const fn index(up: usize, down: usize) -> usize {
        up * (up - 1) / 2 + down
    }

    /// Node value E(u_up, u_down) in metres; zero on the diagonal.
    #[must_use]
    pub fn node(&self, up: usize, down: usize) -> f64 {
        if up == down { 0.0 } else { self.nodes[Self::index(up, down)] }
    }

    /// Threshold u_k in V, for 0 ≤ `k` ≤ N.
    #[must_use]
    pub fn threshold(&self, k: usize) -> f64 {
        self.drive_min + k as f64 * (self.drive_max - self.drive_min) / self.grid as f64
    }

    /// Displacement of the whole range divided by its voltage, m/V.
    #[must_use]
    pub fn mean_gain(&self) -> f64 {
        self.node(self.grid, 0) / (self.drive_max - self.drive_min)
    }

    /// Displacement per volt just after a reversal, m/V: the mean over the diagonal cells.
    ///
    /// The gain of small and fast motion, and of the mode. A coarse grid gives too much, because its diagonal cells
    /// contain hysteresis: use N ≥ [`FINE_GRID`].
    #[must_use]
    pub fn reversal_gain(&self) -> f64 {
        let sum = (1..=self.grid).fold(0.0, |sum, up| sum + self.node(up, up - 1));
        sum / (self.drive_max - self.drive_min)
    }

    /// Preisach weight of the cell between thresholds `up`−1..`up` and `down`..`down`+1, in metres.
    ///
    /// For `down` = `up` − 1 this is the (reversible) weight of the diagonal triangle.
    /// A table is physical when no weight is negative: then the model is monotone and its inverse unique.
    #[must_use]
    pub fn weight(&self, up: usize, down: usize) -> f64 {
        if down + 1 == up {
            return self.node(up, down);
        }
        self.node(up, down) - self.node(up - 1, down) - self.node(up, down + 1) + self.node(up - 1, down + 1)
    }
}
