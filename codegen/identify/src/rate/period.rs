//! Shortest period at which a controller can invert (6).
//!
//! In a tick from u₀ to u the rate term is (u − u₀) Γ₁/T. The controller uses the static inverse if that takes away
//! more than half of the gain of Γ₀ (`runtime/src/dynamic.rs`): on a branch of slope f′, if T < −2 Γ₁/f′. The measure
//! is the displacement on the branches that rise from the lowest drive, and on those that fall from each threshold of
//! the grid.

use crate::everett::EverettTable;

/// Least fraction of the travel on which the inverse must be that of (6).
pub const INVERTED: f64 = 0.8;

/// Periods that the segments of the branches need.
pub struct Invertible {
    /// Period that a segment needs, s, and its displacement, m; by rising period.
    pieces: Vec<[f64; 2]>,
}

impl Invertible {
    /// Of the tables of Γ₀ and Γ₁, on one grid.
    #[must_use]
    pub fn of(still: &EverettTable, rate: &EverettTable) -> Self {
        let grid = still.grid;
        let width = (still.drive_max - still.drive_min) / grid as f64;
        let mut pieces = Vec::new();
        let mut add = |gain: f64, least: f64| {
            if gain > 0.0 {
                let needed = -2.0 * least * width / gain;
                pieces.push([if needed > 0.0 { needed } else { 0.0 }, gain]);
            }
        };
        let lower = |a: f64, b: f64| if a < b { a } else { b };
        for top in 1..=grid {
            add(still.node(top, 0) - still.node(top - 1, 0), lower(rate.node(top, 0), rate.node(top - 1, 0)));
            for low in 0..top {
                let risen = rate.node(top, 0);
                let least = lower(risen - rate.node(top, low), risen - rate.node(top, low + 1));
                add(still.node(top, low) - still.node(top, low + 1), least);
            }
        }
        pieces.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { pieces }
    }

    /// Fraction of the travel on which a controller of `period` (s) inverts (6).
    #[must_use]
    pub fn share(&self, period: f64) -> f64 {
        let sum = |pieces: &[[f64; 2]]| pieces.iter().fold(0.0, |sum, piece| sum + piece[1]);
        let inverted = self.pieces.partition_point(|piece| piece[0] <= period);
        sum(&self.pieces[..inverted]) / sum(&self.pieces)
    }

    /// The shortest period (s) with which [`INVERTED`] of the travel is inverted.
    #[must_use]
    pub fn period(&self) -> f64 {
        let all = self.pieces.iter().fold(0.0, |sum, piece| sum + piece[1]);
        let mut sum = 0.0;
        let enough = self.pieces.iter().find(|piece| {
            sum += piece[1];
            sum >= INVERTED * all
        });
        enough.map_or(0.0, |piece| piece[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight branches: every segment needs twice the lag that the second table has at its end.
    #[test]
    fn a_table_that_lags_needs_twice_its_lag() {
        let table = |value: &dyn Fn(f64) -> f64| EverettTable {
            grid: 10,
            drive_min: 0.0,
            drive_max: 100.0,
            nodes: (1..=10).flat_map(|up| (0..up).map(move |down| f64::from(up - down))).map(value).collect(),
        };
        let still = table(&|cells| 1e-6 * cells);
        let lag = |milliseconds: f64| table(&move |cells| -1e-3 * milliseconds * 1e-6 / 10.0 * (cells / 10.0));
        let found = Invertible::of(&still, &lag(0.2));
        assert!(found.period() > 0.2e-3 && found.period() <= 0.4e-3 * (1.0 + 1e-9), "{}", found.period());
        let period = found.period() * (1.0 + 1e-9);
        assert!(found.share(period) >= INVERTED && found.share(0.5 * period) < INVERTED);
        assert_eq!(found.share(1e-9), 0.0);
        // A lead can be inverted at any period.
        assert_eq!(Invertible::of(&still, &lag(-0.2)).share(1e-9), 1.0);
    }
}
